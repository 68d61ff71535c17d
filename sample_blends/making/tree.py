"""A broad-leaved tree in the sun: branches grown level by level, and a leaf on every twig's stations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from . import stage
from .regions import circle, region
from .surfaces import Surface, joined, tube

TRIANGLES = 72_500
MEADOW_RADIUS = 7.0
TRUNK_SIDES = 16


@dataclass(frozen=True)
class Level:
    """How branches of one level grow.

    children  how many branches of this level each parent carries
    first     where the first one starts, as a share of the parent's length
    angle     between parent and child, degrees
    length    as a share of the parent's length
    sides, rings  of the tube
    bend      how far a branch strays from its direction at each ring
    lift      how much it turns upwards at each ring
    """

    children: int
    first: float
    angle: float
    length: float
    sides: int
    rings: int
    bend: float
    lift: float


LEVELS = (
    Level(16, 0.29, 68.0, 0.62, 8, 9, 0.12, 0.045),
    Level(8, 0.22, 52.0, 0.50, 5, 5, 0.15, 0.02),
    Level(6, 0.12, 48.0, 0.50, 3, 3, 0.18, 0.0),
)


@dataclass(frozen=True)
class Branch:
    """A grown branch: its middle line (n, 3) and radius (n,) in metres."""

    path: np.ndarray
    radii: np.ndarray

    @property
    def length(self) -> float:
        """Of the middle line."""
        return float(np.linalg.norm(np.diff(self.path, axis=0), axis=1).sum())

    def at(self, share: float) -> tuple[np.ndarray, np.ndarray, float]:
        """Point, direction and radius after this share of the way."""
        place = share * (len(self.path) - 1)
        row = min(int(place), len(self.path) - 2)
        blend = place - row
        step = self.path[row + 1] - self.path[row]
        radius = (1 - blend) * self.radii[row] + blend * self.radii[row + 1]
        return self.path[row] + blend * step, unit(step), radius


def unit(vector: np.ndarray) -> np.ndarray:
    """Vectors scaled to length one."""
    return vector / np.linalg.norm(vector, axis=-1, keepdims=True)


def grow(random, start, direction, length, radius, rings, bend, lift) -> Branch:
    """A branch that strays, turns upwards and tapers."""
    path = [np.asarray(start, float)]
    for _ in range(rings):
        direction = unit(direction + bend * random.normal(size=3) + (0.0, 0.0, lift))
        path.append(path[-1] + direction * length / rings)
    taper = np.linspace(1.0, 0.0, rings + 1) ** 0.8
    return Branch(np.array(path), np.maximum(radius * taper, 0.004))


def trunk(random) -> Branch:
    """The stem, leaning a little, from the ground to near the top of the crown."""
    heights = np.concatenate([[0.0, 0.06, 0.13, 0.22, 0.34, 0.50], np.linspace(0.72, 5.6, 18)])
    sway = np.cumsum(np.cumsum(random.normal(0.0, 0.012, (len(heights), 2)), axis=0), axis=0)
    sway[:6] = sway[5]  # upright where the roots spread
    radii = 0.25 * (1 - heights / 5.9) ** 1.1 + 0.01
    return Branch(np.column_stack([sway, heights]), radii)


def offshoots(random, parent: Branch, level: Level) -> list[Branch]:
    """The branches of ``level`` on one parent, turned on by the golden angle from each to the next."""
    made = []
    turn = random.uniform(0, 2 * np.pi)
    for number in range(level.children):
        share = level.first + (0.97 - level.first) * (number + random.uniform(0.1, 0.9)) / level.children
        point, along, radius = parent.at(share)
        turn += np.radians(137.5) + random.normal(0.0, 0.25)
        side = unit(np.cross(along, (0.3, 0.1, 1.0) if abs(along[2]) < 0.9 else (1.0, 0.2, 0.0)))
        outwards = np.cos(turn) * side + np.sin(turn) * np.cross(along, side)
        # The lower ones stand out more and reach further, which rounds the crown.
        angle = np.radians(level.angle * (1.15 - 0.55 * share) + random.normal(0.0, 5.0))
        direction = np.cos(angle) * along + np.sin(angle) * outwards
        crown = np.sin(np.pi * (0.30 + 0.66 * share)) ** 0.8
        length = parent.length * level.length * crown * random.uniform(0.85, 1.15)
        start = point + 0.75 * radius * outwards
        made.append(grow(random, start, direction, length, radius * 0.55, level.rings, level.bend, level.lift))
    return made


def bark(trunk_branch: Branch, levels: list[list[Branch]]) -> list[Surface]:
    """Tubes around all branches; the trunk's foot spreads into roots."""
    angle = 2 * np.pi * np.arange(TRUNK_SIDES) / TRUNK_SIDES
    heights = trunk_branch.path[:, 2]
    flare = np.exp(-heights / 0.20)[:, None]
    roots = 1.0 + flare * (0.50 + 0.38 * np.cos(4 * angle + 0.8) + 0.20 * np.cos(3 * angle))
    surfaces = [tube(trunk_branch.path, trunk_branch.radii[:, None] * roots, TRUNK_SIDES).of(0, smooth=True)]
    for level, branches in zip(LEVELS, levels, strict=True):
        surfaces.append(joined([tube(b.path, b.radii, level.sides).of(0, smooth=True) for b in branches]))
    return surfaces


def foliage(random, twigs: list[Branch], count: int) -> Surface:
    """``count`` leaves of four triangles, folded along the rib, spread over the twigs by their length."""
    lengths = np.array([twig.length for twig in twigs])
    owner = np.sort(random.choice(len(twigs), count, p=lengths / lengths.sum()))
    places = [twigs[row].at(share) for row, share in zip(owner, random.uniform(0.2, 1.0, count), strict=True)]
    stems = np.array([point for point, _, _ in places])
    along = np.array([direction for _, direction, _ in places])
    rib = unit(0.5 * along + 0.75 * unit(random.normal(size=(count, 3))) + (0.0, 0.0, -0.15))
    up = unit(random.normal(0.0, 0.45, (count, 3)) + (0.0, 0.0, 1.0) + 0.35 * unit(stems - (0.0, 0.0, 3.2)))
    across = unit(np.cross(up, rib))
    up = np.cross(rib, across)
    length = random.uniform(0.15, 0.23, count)[:, None]
    stems = stems + 0.15 * length * rib
    width, fold = 0.33 * length, 0.10 * length
    middle = stems + 0.45 * length * rib
    corners = np.stack(
        [
            stems,
            middle - width * across + fold * up,
            middle,
            middle + width * across + fold * up,
            stems + length * rib - 0.06 * length * up,
        ],
        axis=1,
    )
    faces = np.array([(0, 1, 2), (1, 4, 2), (0, 2, 3), (2, 4, 3)])
    tint = random.choice(3, count, p=(0.5, 0.35, 0.15))
    faces = (faces + 5 * np.arange(count)[:, None, None]).reshape(-1, 3)
    return Surface(corners.reshape(-1, 3), faces, np.repeat(tint, 4))


def meadow(foot: np.ndarray) -> Surface:
    """A gentle hill with the trunk's ``foot`` (n, 2) left out."""
    ground = region(circle(MEADOW_RADIUS, 120), [foot], 0.165)
    away = np.maximum(np.hypot(*ground.vertices[:, :2].T) - 0.6, 0.0)
    ground.vertices[:, 2] = -0.009 * away**2
    return ground.of(0, smooth=True)


def build() -> None:
    """Fill an empty file with the tree; the number of leaves makes up the number of triangles."""
    stage.empty_file(720, 720)
    random = np.random.default_rng(2006)
    stem = trunk(random)
    levels = [offshoots(random, stem, LEVELS[0])]
    for level in LEVELS[1:]:
        levels.append([branch for parent in levels[-1] for branch in offshoots(random, parent, level)])
    wood = bark(stem, levels)
    ground = meadow(wood[0].vertices.reshape(TRUNK_SIDES, -1, 3)[:, 0, :2])
    used = 2 * sum(len(surface.faces) for surface in wood) + len(ground.faces)
    leaves = foliage(random, levels[-1], (TRIANGLES - used) // 4)

    stage.add("Meadow", [ground], [stage.material("Grass", (0.20, 0.30, 0.09))])
    stage.add("Wood", wood, [stage.material("Bark", (0.26, 0.17, 0.11))])
    greens = [("Leaf", (0.16, 0.36, 0.06)), ("Young leaf", (0.30, 0.46, 0.08)), ("Old leaf", (0.42, 0.34, 0.07))]
    stage.add("Leaves", [leaves], [stage.material(name, colour) for name, colour in greens])
    stage.sun(2.6, 42.0, -60.0, (1.0, 0.93, 0.80), 1.0)
    stage.sky((0.55, 0.72, 1.0), 0.55)
    stage.camera((2.2, -11.5, 1.7), (0.1, 0.0, 3.0), 46.0)
