"""A low-poly street corner at night: lamps, a spot, a lit window and a sign; flat shading and few colours.

It shows what a game scene brings along: several materials in one mesh, a modifier, a text object, an object
mirrored by its scale, two objects that share a mesh, and an instanced collection.
"""

from __future__ import annotations

import math
from itertools import pairwise

import bpy
import numpy as np

from . import stage
from .game_props import barrel, bench, bush, conifer, crate, lamp_post, planter
from .regions import circle, rectangle, region
from .surfaces import Surface, box, frame, quad

#: the paved ground, and the house front's length and height, in metres
GROUND, FRONT = rectangle(-5.0, -4.0, 4.0, 3.0), (9.0, 4.0)
DOOR, WINDOW = rectangle(-0.6, 0.0, 0.5, 2.15), rectangle(1.2, 0.9, 3.2, 2.15)
#: where things stand: x, y and turn in degrees
CRATES = [(-4.1, 2.2, 8.0), (-3.05, 2.35, -14.0)]
LAMPS = [(-2.15, 1.9), (3.6, 0.2)]
BARREL, BENCH, CONIFER = (-4.35, 0.75), (2.2, 2.45), (-4.0, -2.6)
PLANTERS = [(-0.95, 2.62), (0.85, 2.62)]


def mosaic(surface: Surface, random, slots: tuple[int, ...]) -> Surface:
    """The surface with each face in one of several materials."""
    return surface.of(random.choice(slots, len(surface.faces)))


def ground(random) -> Surface:
    """Paving around everything that stands on it."""
    feet = [_turned_square(x, y, 0.45, turn) for x, y, turn in CRATES]
    feet += [circle(0.16, 6, *place) for place in LAMPS]
    feet += [circle(0.30, 10, *BARREL), circle(0.75, 8, *CONIFER)]
    feet += [rectangle(x - 0.25, y - 0.25, x + 0.25, y + 0.25) for x, y in PLANTERS]
    return mosaic(region(GROUND, feet, 0.24), random, (0, 0, 1, 2))


def house(random) -> list[Surface]:
    """The front y = 3, facing -y, with a door and a shop window; a side wall; a cornice."""
    length, height = FRONT
    front = region(rectangle(-5.0, 0.0, length - 5.0, height), [DOOR, WINDOW], 0.26)
    parts = [mosaic(standing(front), random, (0, 0, 1))]
    for opening, slot in ((DOOR, 2), (WINDOW, 3)):
        (x0, z0), (x1, z1) = opening[0], opening[2]
        half_x, half_z = 0.5 * (x1 - x0), 0.5 * (z1 - z0)
        lying = frame(half_x, half_z, [(0.0, 0.0), (0.0, -0.2)], 0.25)
        parts.append(standing(lying).moved(x0 + half_x, 0.0, z0 + half_z).of(4))
        parts.append(standing(quad([(x0, z0, -0.2), (x1, z0, -0.2), (x1, z1, -0.2), (x0, z1, -0.2)], 0.3)).of(slot))
    parts.append(box((-5.05, 2.82, height), (4.05, 3.0, height + 0.25), 0.3, without="+y").of(4))
    side = quad([(-5.0, -4.0, 0.0), (-5.0, 3.0, 0.0), (-5.0, 3.0, 1.5), (-5.0, -4.0, 1.5)], 0.26)
    parts.append(mosaic(side, random, (5, 5, 1)))
    parts.append(box((-5.25, -4.0, 1.5), (-4.93, 3.0, 1.65), 0.3, without="+y").of(4))
    return parts


def standing(lying: Surface) -> Surface:
    """What lies in the ground plane (x, z), facing up, as a part of the house front, facing -y."""
    return lying.turned(90.0, "x").moved(y=3.0)


def awning() -> list[Surface]:
    """Striped cloth over the shop window."""
    edges = np.linspace(1.0, 3.4, 9)
    parts = []
    for number, (x0, x1) in enumerate(pairwise(edges)):
        slope = quad([(x0, 2.0, 2.25), (x1, 2.0, 2.25), (x1, 2.99, 2.75), (x0, 2.99, 2.75)], 0.25)
        hem = quad([(x0, 2.0, 2.08), (x1, 2.0, 2.08), (x1, 2.0, 2.25), (x0, 2.0, 2.25)], 0.25)
        parts += [slope.of(number % 2), hem.of(number % 2)]
    return parts


def sign(board, letters) -> None:
    """A board over the door, and on it a text object whose letters shine."""
    stage.add("Sign board", [box((-1.15, 2.9, 2.45), (0.75, 3.0, 3.15), 0.2, without="+y")], [board])
    text = bpy.data.curves.new("Sign", "FONT")
    text.body, text.size, text.extrude = "DETP", 0.62, 0.015
    text.align_x, text.align_y = "CENTER", "CENTER"
    text.materials.append(letters)
    made = stage.place("Sign", text, (-0.2, 2.86, 2.8))
    made.rotation_euler = (math.radians(90), 0.0, 0.0)


def lamps(iron, bulb) -> None:
    """Two lamp posts with a point light each; the second one is the first one's mirror image."""
    for name, (x, y), mirror in zip(("Lamp post", "Lamp post mirrored"), LAMPS, (1.0, -1.0), strict=True):
        stage.place(name, stage.mesh(name, lamp_post(), [iron, bulb]), (x, y, 0.0), scale=(mirror, 1.0, 1.0))
        light = bpy.data.lights.new("Lamp", "POINT")
        light.energy, light.color, light.shadow_soft_size = 150.0, (1.0, 0.68, 0.34), 0.06
        stage.place("Lamp", light, (x + 0.62 * mirror, y, 2.55))


def bushes(random, leaf, dark_leaf) -> None:
    """Three instances of a collection that holds one bush."""
    plants = bpy.data.collections.new("Bush")
    plants.objects.link(bpy.data.objects.new("Bush", stage.mesh("Bush", [bush(random)], [leaf, dark_leaf])))
    for x, y, size, turn in ((-4.55, -0.6, 1.0, 0.0), (-4.45, -1.45, 0.8, 130.0), (3.35, 2.55, 0.95, 250.0)):
        instance = stage.place("Bush", None, (x, y, 0.0), turn, (size, size, size))
        instance.instance_type, instance.instance_collection = "COLLECTION", plants


def build() -> None:
    """Fill an empty file with the street corner."""
    stage.empty_file(960, 600)
    random = np.random.default_rng(64)
    paint = stage.material
    wood, dark_wood = paint("Wood", (0.50, 0.30, 0.14)), paint("Dark wood", (0.26, 0.14, 0.07))
    iron, brick = paint("Iron", (0.10, 0.11, 0.13)), paint("Brick", (0.52, 0.22, 0.15))
    leaf, dark_leaf = paint("Leaf", (0.16, 0.42, 0.12)), paint("Dark leaf", (0.08, 0.28, 0.12))
    trim = paint("Trim", (0.62, 0.58, 0.52))
    paving = [(0.40, 0.40, 0.44), (0.34, 0.34, 0.39), (0.46, 0.45, 0.47)]
    stage.add("Ground", [ground(random)], [paint(f"Paving {n}", c) for n, c in enumerate(paving, 1)])
    glass = paint("Lit window", (0.3, 0.25, 0.2), (1.0, 0.74, 0.38), 2.2)
    door, plaster = paint("Door", (0.10, 0.34, 0.36)), paint("Plaster", (0.56, 0.50, 0.60))
    shade = paint("Plaster shade", (0.48, 0.42, 0.54))
    stage.add("House", house(random), [plaster, shade, door, glass, trim, brick])
    stage.add("Awning", awning(), [paint("White cloth", (0.75, 0.73, 0.70)), paint("Red cloth", (0.62, 0.08, 0.07))])
    sign(paint("Board", (0.05, 0.06, 0.10)), paint("Neon", (0.1, 0.1, 0.1), (1.0, 0.12, 0.42), 14.0))
    lamps(iron, paint("Bulb", (0.8, 0.8, 0.8), (1.0, 0.68, 0.34), 9.0))
    bushes(random, leaf, dark_leaf)

    shared = stage.mesh("Crate", [crate()], [wood, dark_wood])
    for x, y, turn in CRATES:
        bevel = stage.place("Crate", shared, (x, y, 0.0), turn).modifiers.new("Bevel", "BEVEL")
        bevel.width, bevel.segments = 0.025, 1
    small = stage.place(
        "Small crate", stage.mesh("Small crate", [crate()], [wood, dark_wood]), (-3.75, 2.3, 0.901), 32.0
    )
    small.scale = (0.62, 0.62, 0.62)
    stage.place("Barrel", stage.mesh("Barrel", barrel(), [dark_wood, iron]), (*BARREL, 0.0))
    stage.place("Bench", stage.mesh("Bench", bench(), [wood, iron]), (*BENCH, 0.0))
    stage.place("Conifer", stage.mesh("Conifer", conifer(random), [dark_wood, leaf, dark_leaf]), (*CONIFER, 0.0))
    for x, y in PLANTERS:
        stage.place("Planter", stage.mesh("Planter", planter(random), [brick, leaf, dark_leaf]), (x, y, 0.0))

    spot = bpy.data.lights.new("Moonbeam", "SPOT")
    spot.energy, spot.color, spot.shadow_soft_size = 1500.0, (0.40, 0.60, 1.0), 0.15
    spot.spot_size, spot.spot_blend = math.radians(50), 0.7
    stage.aimed("Moonbeam", spot, (1.0, -5.5, 7.5), (-1.6, -0.8, 0.0))
    stage.sky((0.16, 0.22, 0.45), 0.20)
    stage.camera((6.8, -8.6, 5.6), (-0.75, 0.35, 1.05), 44.0)


def _turned_square(x: float, y: float, half: float, degrees: float) -> np.ndarray:
    corners = circle(half * math.sqrt(2.0), 4)
    angle = math.radians(degrees + 45.0)
    turn = np.array([(math.cos(angle), math.sin(angle)), (-math.sin(angle), math.cos(angle))])
    return corners @ turn + (x, y)
