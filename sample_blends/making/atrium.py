"""An atrium: a court under the open sky, with vaulted arcades in two storeys, a pool, banners and potted trees."""

from __future__ import annotations

import numpy as np

from . import stage
from .atrium_parts import balustrade, banner, column, pillar, pool, pot
from .atrium_plan import (
    ARCH,
    COURT,
    HOUSE,
    LEVELS,
    PIER,
    PITCH,
    Level,
    arch,
    around,
    covered,
    from_middle,
    piers,
    stations,
    vault,
    wall,
)
from .plans import lines, storey
from .surfaces import Surface, box, frame, steps

CELL = 0.2
TILE = 0.6
#: height of the court's ground below the walk, and half the pool's size, in metres
GROUND, POOL = -0.15, (2.7, 1.2)
#: of the masonry around, in metres
THICKNESS = 0.5


def ceiling(level: Level) -> Surface:
    """The vaults and arches of one storey, seen from below."""
    x, y = (stations(half) for half in HOUSE)
    return storey(x, y, covered, lambda x, y: level.springing + vault(x, y)).flipped().of(smooth=True)


def walk(level: Level) -> Surface:
    """The floor around the court: two kinds of tile in each bay, bands of stone between the piers."""
    x, y = (
        lines(-half, *np.ravel([(p - 0.5 * PIER, p + 0.5 * PIER) for p in piers(half)]), half, cell=2 * ARCH / 9)
        for half in HOUSE
    )

    def kind(x, y):
        on_band = (from_middle(x, COURT[0]) >= ARCH) | (from_middle(y, COURT[1]) >= ARCH)
        tiles = [np.floor((v + half) % PITCH / (2 * ARCH / 3)) for v, half in ((x, HOUSE[0]), (y, HOUSE[1]))]
        return np.where(on_band, 2, (tiles[0] + tiles[1]).astype(int) % 2)

    return storey(x, y, covered, material=kind).moved(z=level.floor)


def ground() -> Surface:
    """The court's floor around the pool: a border and two kinds of tile."""
    inner = [half - 0.2 for half in COURT]
    x, y = (lines(-half, -edge, edge, half, cell=CELL) for half, edge in zip(COURT, inner, strict=True))

    def kind(x, y):
        border = (np.abs(x) > inner[0]) | (np.abs(y) > inner[1])
        tiles = [np.floor((v + half) / TILE) for v, half in zip((x, y), inner, strict=True)]
        return np.where(border, 2, (tiles[0] + tiles[1]).astype(int) % 2)

    def free(x, y):
        return (np.abs(x) > POOL[0]) | (np.abs(y) > POOL[1])

    return storey(x, y, free, material=kind).moved(z=GROUND)


def masonry() -> list[Surface]:
    """What is of stone: the walls over the arches, mouldings, columns, pillars and balustrades."""
    lower, upper = LEVELS
    step = [(0.0, 0.0), (0.0, GROUND)]
    string_course = [(0.0, upper.floor), (-0.12, upper.floor), (-0.12, 4.22), (-0.05, 4.13), (-0.05, 4.05)]
    string_course += [(0.0, lower.top)]
    eaves = [(-0.32, 8.02), (-0.32, 7.93), (-0.18, 7.85), (-0.12, 7.72), (0.0, upper.top)]
    made = [frame(*COURT, profile, CELL) for profile in (step, string_course, eaves)]
    for level in LEVELS:

        def over_arches(half, level=level):
            x = stations(half)
            return wall(x, level.springing + arch(from_middle(x, half)), level.top, 7)

        made += around(COURT, over_arches)
        supports = column(level.springing - level.floor)
        for turn in range(4):
            along, across = COURT[turn % 2], COURT[1 - turn % 2] + 0.5 * PIER
            places = [(x, part) for x in piers(along) for part in supports]
            places += [(along + 0.5 * PIER, part) for part in pillar(level.springing - level.floor)]
            made += [part.moved(x, across, level.floor).turned(90 * turn) for x, part in places]
            if level is upper:
                bays = np.arange(-along + ARCH, along, PITCH)
                rails = [part.moved(x, across, level.floor) for x in bays for part in balustrade()]
                made += [part.turned(90 * turn) for part in rails]
    return made


def rear_walls() -> list[Surface]:
    """The walls behind the walk up to the vaults, one material for each storey."""
    made = []
    for slot, level in enumerate(LEVELS):

        def side(half, level=level):
            x = stations(half)
            return wall(x, level.floor, level.springing + arch(from_middle(x, half)), 14)

        made += [part.of(slot) for part in around(HOUSE, side)]
    return made


def shell() -> tuple[list[Surface], Surface]:
    """The outer walls on their foundation, and the roof over the upper walk, down to the eaves.

    They close what lies behind the inner surfaces, as masonry does, so that no outdoor light is a disc's width away.
    """
    half_x, half_y = (half + THICKNESS for half in HOUSE)
    walls = frame(half_x, half_y, [(0.0, z) for z in steps(-THICKNESS, 9.3, 2.0)], 2.0)
    bottom = box((-half_x, -half_y, -THICKNESS), (half_x, half_y, 0.0), 2.4, without="-x +x -y +y +z")
    eaves = -PITCH - THICKNESS - 0.32
    return [walls, bottom], frame(half_x, half_y, [(0.0, 9.3), (0.55 * eaves, 8.7), (eaves, 8.02)], 1.0)


def build() -> None:
    """Fill an empty file with the atrium."""
    stage.empty_file(960, 600)
    random = np.random.default_rng(1337)
    stone = stage.material("Limestone", (0.72, 0.64, 0.52))
    cream = stage.material("Cream tile", (0.68, 0.58, 0.42))
    terracotta = stage.material("Terracotta", (0.50, 0.22, 0.12))
    slate = stage.material("Slate", (0.22, 0.23, 0.25))
    ochre = stage.material("Ochre plaster", (0.68, 0.38, 0.17))
    plaster = stage.material("Plaster", (0.76, 0.72, 0.64))
    leaf = stage.material("Leaf", (0.12, 0.28, 0.06))

    stage.add("Court", [ground()], [cream, slate, stone])
    stage.add("Walks", [walk(level) for level in LEVELS], [cream, terracotta, stone])
    stage.add("Vaults", [ceiling(level) for level in LEVELS], [plaster])
    stage.add("Rear walls", rear_walls(), [ochre, plaster])
    stage.add("Masonry", masonry(), [stone])
    walls, roof = shell()
    stage.add("Shell", [*walls, roof.of(1)], [plaster, terracotta])
    basin, water = pool(*POOL, GROUND)
    stage.add("Pool", [*basin, water.of(1)], [stone, stage.material("Water", (0.08, 0.28, 0.30))])
    for number, (x, y) in enumerate([(1, 1), (-1, 1), (1, -1), (-1, -1)], start=1):
        clay, tree, stem = pot(random)
        potted = stage.add(f"Potted tree {number}", [clay, tree.of(1), stem.of(2)], [terracotta, leaf, slate])
        potted.location = (x * (COURT[0] - 0.9), y * (COURT[1] - 0.9), GROUND)
    cloths = [stage.material("Red cloth", (0.55, 0.05, 0.04)), stage.material("Blue cloth", (0.05, 0.15, 0.48))]
    hangings = []
    for side in (0, 180):
        for number, x in enumerate((-2 * PITCH, 0.0, 2 * PITCH)):
            cloth = banner(1.0, 1.9).of((number + (side > 0)) % 2, smooth=True)
            hangings.append(cloth.moved(x, COURT[1] - 0.18, 5.34).turned(side))
    stage.add("Banners", hangings, cloths)
    stage.sun(6.0, 48.0, 146.0, (1.0, 0.90, 0.74), 0.6)
    stage.sky((0.45, 0.66, 1.0), 0.5)
    stage.camera((-6.35, -0.9, 1.7), (1.5, 0.75, 2.9), 18.0)
