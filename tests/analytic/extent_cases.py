"""Small things in large scenes, of every size, turned any way: cases as in extreme_cases.py.

Offsets follow the place, so that what lies far away changes nothing near; each case has a value that is known exactly,
or that the near part has alone.
"""

from dataclasses import replace
from itertools import product

import numpy as np
from detp.core.lights.point import PointLight
from detp.core.lights.sun import SunLight
from detp.core.lights.world import UniformWorld
from detp.core.scene import Scene
from extreme_cases import baked_with, case
from rooms import box_quads, scene_of

#: sizes of the near part, metres over what it is made for
SIZES = (1e-5, 1.0, 1e6)

#: how far off light may be
ALLOWED = 0.01

_GROUND = np.array([(-0.5, -0.5, 0), (0.5, -0.5, 0), (0.5, 0.5, 0), (-0.5, 0.5, 0)], float)


def turns() -> tuple[np.ndarray, np.ndarray]:
    """No turn, and any."""
    turn = np.linalg.qr(np.random.default_rng(7).normal(size=(3, 3)))[0]
    return np.eye(3), turn * np.sign(np.linalg.det(turn))


def grid(size: float, cells: int, middle=(0.0, 0.0)) -> np.ndarray:
    """Squares (Q, 4, 3) of a level grid around ``middle``, facing up."""
    at = (np.arange(cells) + 0.5) / cells - 0.5
    places = np.stack([*np.meshgrid(at, at), np.zeros((cells, cells))], axis=-1).reshape(-1, 1, 3)
    return size * (_GROUND / cells + places) + (*middle, 0.0)


def corners_of(quads: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Each quad's corners (P, 3), their normals, and what leads inward from them."""
    normals = np.cross(quads[:, 1] - quads[:, 0], quads[:, 3] - quads[:, 0])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    inward = quads.mean(axis=1)[:, None] - quads
    return quads.reshape(-1, 3), np.repeat(normals, 4, axis=0), inward.reshape(-1, 3)


def light(quads, lights, turn, factor, points, albedo=0.0, photons=2000, **settings):
    """The bake of ``points`` (their places, normals and ways inward) among ``quads``, turned and times ``factor``."""
    places, normals, inward = points
    turned = [replace(lamp, position=factor * turn @ lamp.position) if hasattr(lamp, "position") else lamp
              for lamp in lights]  # fmt: skip
    scene: Scene = scene_of(factor * quads @ turn.T, albedo, lights=tuple(turned))
    places, inward = factor * places @ turn.T, factor * inward @ turn.T
    return baked_with(scene, places, normals @ turn.T, photons, inward=inward, radius=None, **settings)


def from_lamp(points, normals, place, power) -> np.ndarray:
    """Irradiance (P,) by a lamp without extent."""
    away = place - points
    square = np.einsum("ij,ij->i", away, away)
    return power / (4 * np.pi) * np.maximum(np.einsum("ij,ij->i", away, normals), 0.0) / square**1.5


def farthest_off(found, expected) -> float:
    """The largest relative difference; infinite where nothing was found."""
    return float(np.nan_to_num(np.abs(found / expected - 1), nan=np.inf).max())


@case("a grid of 2 m under a lamp, a triangle 1 … 1000 km away", f"E as without it, to {ALLOWED:.0%}")
def stray(size):
    ground, lamp = grid(2, 10), np.array((0, 0, 1.0))
    points = corners_of(ground)
    expected, worst = from_lamp(*points[:2], lamp, 1.0), 0.0
    for factor, far, turn in product(SIZES, (1e3, 1e4, 1e6), turns()):
        away = np.array([[(far, 0, 0), (far + 1, 0, 0), (far, 1, 0), (far, 1, 0)]])
        result = light(np.concatenate([ground, away]), [PointLight(lamp, (1.0,) * 3)], turn, factor, points)
        worst = max(worst, farthest_off(result.irradiance[:, 0] * factor**2, expected))
    return f"off by {worst:.1e} at most", worst < ALLOWED


@case("a closed room of 3 m with a lamp, ground of 100 m … 10 km outside", f"E in its corners exact, to {ALLOWED:.0%}")
def outside(size):
    room, lamp = box_quads((3, 3, 3)) - (1.5, 1.5, 0), np.array((0, 0, 1.5))
    points, worst = corners_of(room), 0.0
    for factor, far, turn in product(SIZES, (100, 1e3, 1e4), turns()):
        ground = grid(far, 2) - (0, 0, 0.1)
        both = [np.concatenate(pair) for pair in zip(points, corners_of(ground), strict=True)]
        result = light(np.concatenate([room, ground]), [PointLight(lamp, (5.0,) * 3)], turn, factor, both)
        found = result.irradiance[: len(points[0]), 0] * factor**2
        worst = max(worst, farthest_off(found, from_lamp(*points[:2], lamp, 5.0)))
    return f"off by {worst:.1e} at most", worst < ALLOWED


@case("a cube of 1 cm, a lamp 5 cm over it, ground of 100 m … 10 km below", f"E on its top exact, to {ALLOWED:.0%}")
def cube(size):
    worst = 0.0
    for factor, far, cells, turn in product(SIZES, (100, 1e3, 1e4), (1, 30), turns()):
        # Of many corners most are far from the cube: there coordinates are most exact, not here.
        middle = np.zeros(3) if cells == 1 else np.array((0.3, 0.2, 0)) * min(far, 1e3)
        block = 0.01 * box_quads((1, 1, 1))[:, ::-1] + middle
        ground, lamp = grid(far, cells), middle + (0.005, 0.005, 0.06)
        points = corners_of(block)
        both = [np.concatenate(pair) for pair in zip(points, corners_of(ground), strict=True)]
        result = light(np.concatenate([block, ground]), [PointLight(lamp, (1.0,) * 3)], turn, factor, both)
        top = np.flatnonzero(points[1][:, 2] > 0.5)
        expected = from_lamp(points[0][top], points[1][top], lamp, 1.0)
        worst = max(worst, farthest_off(result.irradiance[top, 0] * factor**2, expected))
    return f"off by {worst:.1e} at most", worst < ALLOWED


@case("a lamp 1 mm … 10 um over a ground of 2 m", f"E everywhere exact, to {ALLOWED:.0%}")
def close(size):
    worst, ground = 0.0, grid(2, 10)
    points = corners_of(ground)
    for factor, height, turn in product(SIZES, (1e-3, 1e-4, 1e-5), turns()):
        lamp = np.array((0.0, 0.0, height))
        result = light(ground, [PointLight(lamp, (1e-4,) * 3)], turn, factor, points)
        found, expected = result.irradiance[:, 0] * factor**2, from_lamp(*points[:2], lamp, 1e-4)
        worst = max(worst, farthest_off(found, expected))
    return f"off by {worst:.1e} at most", worst < ALLOWED


@case("a lit room of 3 m beside sunlit ground of 100 m and 1 km", "E in the room as without it, to its error")
def beside(size):
    room, lamp = box_quads((3, 3, 3)) - (1.5, 1.5, 0), PointLight((0, 0, 1.5), (10.0,) * 3)
    points, sun = corners_of(room), SunLight((0.2, 0.1, -1), (3.0,) * 3)
    alone = light(room, [lamp], np.eye(3), 1.0, points, 0.5, error=0.02)
    texts, fine = [], True
    for far in (100.0, 1000.0):
        ground = grid(far, 10, (far / 2 + 5, 0)) - (0, 0, 0.1)
        both = [np.concatenate(pair) for pair in zip(points, corners_of(ground), strict=True)]
        result = light(np.concatenate([room, ground]), [lamp, sun], np.eye(3), 1.0, both, 0.5, quality="draft")
        found, error = (part[: len(points[0])].sum(axis=1) for part in (result.irradiance, result.standard_error))
        ratio = float(found.mean() / alone.irradiance.sum(axis=1).mean())
        texts.append(f"{far:g} m: {ratio:.3f}, by its error within {float((error / found).mean()):.3f}")
        fine &= abs(ratio - 1) < 0.05
    return "; ".join(texts), fine


@case(
    "a pit of 3 m under sun and sky, ground of 10 km around, or a triangle 100 km away",
    "E in it as without, to 1 %, and of few photons to its error",
)
def pit(size):
    sides = box_quads((3, 3, 3))[[0, 2, 3, 4, 5]] - (1.5, 1.5, 3.0)
    lights = [SunLight((0.2, 0.1, -1), (3.0,) * 3), UniformWorld((0.3,) * 3)]
    points, away = corners_of(sides), np.array([[(1e5, 0, 0), (1e5 + 1, 0, 0), (1e5, 1, 0), (1e5, 1, 0)]])

    def mean(others, photons):
        quads = np.concatenate([sides, others])
        result = light(quads, lights, np.eye(3), 1.0, points, 0.5, photons, error=0.004)
        return result.irradiance.mean(), result.standard_error.mean()

    (alone, error), texts, fine = mean(np.zeros((0, 4, 3)), 100_000), [], True
    for others in (grid(1e4, 4, (5002, 0)), away):
        (few, by_few), (many, _) = mean(others, 2000), mean(others, 100_000)
        off, off_few = abs(many / alone - 1), abs(few - alone)
        texts.append(f"{off:.3f} ({off_few / alone:.3f} of 2000 photons, by their error {by_few / alone:.3f})")
        fine &= bool(off < ALLOWED and off_few < 2 * np.hypot(by_few, error))
    return f"off by {' and '.join(texts)}", fine
