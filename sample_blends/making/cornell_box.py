"""The Cornell box, from the measured vertex lists of the Cornell University Program of Computer Graphics.

The published lists are in millimetres with y up, seen along +z with x to the left; here they are metres with
z up, seen along +y with x to the right, so x changes its sign with the exchange of y and z.
"""

from __future__ import annotations

import numpy as np

from . import stage
from .regions import region
from .surfaces import Surface, quad

CELL = 0.025

#: The published reflectance and emission spectra, reduced to linear RGB as renderers commonly do.
WHITE, RED, GREEN = (0.725, 0.71, 0.68), (0.63, 0.065, 0.05), (0.14, 0.45, 0.091)
EMISSION = (17.0, 12.0, 4.0)

FLOOR = [(552.8, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 559.2), (549.6, 0.0, 559.2)]
CEILING = [(556.0, 548.8, 0.0), (556.0, 548.8, 559.2), (0.0, 548.8, 559.2), (0.0, 548.8, 0.0)]
LIGHT = [(343.0, 548.8, 227.0), (343.0, 548.8, 332.0), (213.0, 548.8, 332.0), (213.0, 548.8, 227.0)]
WALLS = {
    "Back wall": [(549.6, 0.0, 559.2), (0.0, 0.0, 559.2), (0.0, 548.8, 559.2), (556.0, 548.8, 559.2)],
    "Right wall": [(0.0, 0.0, 559.2), (0.0, 0.0, 0.0), (0.0, 548.8, 0.0), (0.0, 548.8, 559.2)],
    "Left wall": [(552.8, 0.0, 0.0), (549.6, 0.0, 559.2), (556.0, 548.8, 559.2), (556.0, 548.8, 0.0)],
}
BLOCKS = {
    "Short block": [(130.0, 165.0, 65.0), (82.0, 165.0, 225.0), (240.0, 165.0, 272.0), (290.0, 165.0, 114.0)],
    "Tall block": [(423.0, 330.0, 247.0), (265.0, 330.0, 296.0), (314.0, 330.0, 456.0), (472.0, 330.0, 406.0)],
}
CAMERA, FOCAL_LENGTH, FILM = (278.0, 273.0, -800.0), 35.0, 25.0


def metres(points) -> np.ndarray:
    """Published coordinates as metres, z up."""
    x, y, z = np.asarray(points, float).reshape(-1, 3).T / 1000.0
    return np.column_stack([-x, z, y])


def build() -> None:
    """Fill an empty file with the box."""
    stage.empty_file(512, 512).view_settings.exposure = 1.0
    white = stage.material("White", WHITE)
    walls = {"Left wall": stage.material("Red", RED), "Right wall": stage.material("Green", GREEN)}
    lamp = stage.material("Lamp", (0.78, 0.78, 0.78), EMISSION, 1.0)
    blocks = {name: metres(top) for name, top in BLOCKS.items()}

    # Floor and ceiling leave out what the blocks and the lamp cover: no vertex is hidden, nothing overlaps.
    floor = region(metres(FLOOR)[:, :2], [top[:, :2] for top in blocks.values()], CELL)
    stage.add("Floor", [floor], [white])
    ceiling = region(metres(CEILING)[:, :2], [metres(LIGHT)[:, :2]], CELL)
    stage.add("Ceiling", [ceiling.flipped().moved(z=0.5488)], [white])
    stage.add("Light", [quad(metres(LIGHT), 1.0)], [lamp])
    for name, corners in WALLS.items():
        stage.add(name, [quad(metres(corners), CELL)], [walls.get(name, white)])
    for name, top in blocks.items():
        stage.add(name, block(top), [white])

    eye = metres(CAMERA)[0]
    stage.camera(eye, eye + np.array([0.0, 1.0, 0.0]), FOCAL_LENGTH, FILM)


def block(top: np.ndarray) -> list[Surface]:
    """A block standing on the floor: its top (4, 3) and the four sides below, without a bottom."""
    bottom = top * (1.0, 1.0, 0.0)
    following = np.roll(np.arange(4), -1)
    sides = [quad([bottom[i], bottom[j], top[j], top[i]], CELL) for i, j in enumerate(following)]
    return [quad(top, CELL), *sides]
