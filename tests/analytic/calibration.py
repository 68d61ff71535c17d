"""Does the standard error mean what it says? Repeated bakes of known scenes, and how often their intervals hold."""

from dataclasses import dataclass

import numpy as np
from detp.core.bake import baked
from detp.core.lights.area import AreaLight
from detp.core.lights.sun import SunLight
from detp.core.lights.world import UniformWorld
from detp.core.points import Points
from detp.core.scene import Scene
from detp.core.settings import BakeSettings
from rooms import box_quads, scene_of

#: half the width, in standard errors, of an interval that holds a normal variable's mean in 95 % of cases
WIDTH = 1.959964


@dataclass(frozen=True)
class Subject:
    """A scene, and where in it light is estimated: points (N, 3), unit normals (N, 3)."""

    scene: Scene
    points: np.ndarray
    normals: np.ndarray


@dataclass(frozen=True)
class Coverage:
    """How often intervals of 1.96 standard errors held the converged value.

    sums, channels  share of points and seeds, for the sum over RGB and for single channels
    below, above    share of sums that lie below and above their interval: they differ when the error is skewed
    variance        reported over true variance of the sums, the median over the points
    crossings       squared signal to noise, the median over the points: so many equal crossings have this noise
    points          how many were looked at
    doubt           standard error of ``sums``: the points of one bake share their photons, seeds share nothing
    """

    sums: float
    channels: float
    below: float
    above: float
    variance: float
    crossings: float
    points: int
    doubt: float


def coverage(
    values: np.ndarray,
    errors: np.ndarray,
    spread: float = np.inf,
    limit: tuple[np.ndarray, np.ndarray] | None = None,
) -> Coverage:
    """Compare R estimates at N points, ``values`` (R, N, 3), with their standard ``errors`` (R, N, 3).

    Each is held against the ``limit``, a value and its standard error (N, 3), or else against the mean of the other
    seeds; the error of that is added. Points count whose signal to noise, squared, is within a factor ``spread`` of the
    median, and whose noise is not zero.
    """
    summed, sum_errors = values.sum(axis=2), errors.sum(axis=2)
    variance = summed.var(axis=0, ddof=1)
    noisy = variance > 1e-24 * summed.mean(axis=0) ** 2
    crossings = summed.mean(axis=0) ** 2 / np.where(noisy, variance, 1.0)
    middle = np.median(crossings[noisy])
    rows = noisy & (crossings >= middle / spread) & (crossings <= middle * spread)
    if limit is None:
        z = _distances(summed[:, rows], sum_errors[:, rows])
        channels = _distances(values[:, rows], errors[:, rows])
    else:
        z = _distances_to(limit[0].sum(axis=1)[rows], limit[1].sum(axis=1)[rows], summed[:, rows], sum_errors[:, rows])
        channels = _distances_to(limit[0][rows], limit[1][rows], values[:, rows], errors[:, rows])
    lit = values[:, rows].any(axis=0)
    return Coverage(
        sums=float((np.abs(z) <= WIDTH).mean()),
        channels=float((np.abs(channels[:, lit]) <= WIDTH).mean()),
        below=float((z < -WIDTH).mean()),
        above=float((z > WIDTH).mean()),
        variance=float(np.median((sum_errors**2).mean(axis=0)[rows] / variance[rows])),
        crossings=float(middle),
        points=int(rows.sum()),
        doubt=float((np.abs(z) <= WIDTH).mean(axis=1).std(ddof=1) / np.sqrt(len(values))),
    )


def repeated(subject: Subject, seeds: int, first: int = 0, **settings) -> tuple[np.ndarray, np.ndarray]:
    """Bake ``subject`` with ``seeds`` seeds: the values and standard errors, (seeds, N, 3) each."""
    results = [
        baked(subject.scene, Points(subject.points, subject.normals), BakeSettings(seed=first + seed, **settings))
        for seed in range(seeds)
    ]
    return np.stack([result.irradiance for result in results]), np.stack([r.standard_error for r in results])


def limit_of(subject: Subject, photons: int, **settings) -> tuple[np.ndarray, np.ndarray]:
    """What bakes of ``subject`` tend to, by one with so many ``photons``: values and standard errors, (N, 3) each."""
    values, errors = repeated(subject, 1, 2_000_000, photons=photons, **settings)
    return values[0], errors[0]


def photons_for(subject: Subject, crossings: float, pilot: int = 20_000, **settings) -> int:
    """How many photons give the median point the noise of so many equal crossings."""
    values, _ = repeated(subject, 12, 1_000_000, photons=pilot, **settings)
    summed = values.sum(axis=2)
    lit = summed.any(axis=0)
    reached = np.median(summed[:, lit].mean(axis=0) ** 2 / summed[:, lit].var(axis=0, ddof=1))
    return max(2, round(pilot * crossings / reached))


def _distances(values, errors):
    """How many standard errors (R, ...) each estimate is from the mean of the others."""
    seeds = len(values)
    others = (values.sum(axis=0) - values) / (seeds - 1)
    return _distances_to(others, np.sqrt(values.var(axis=0, ddof=1) / (seeds - 1)), values, errors)


def _distances_to(limit, doubt, values, errors):
    """How many standard errors (R, ...) each estimate is from its ``limit``, which is known to the ``doubt``."""
    total = np.sqrt(errors**2 + doubt**2)
    return np.divide(values - limit, total, out=np.zeros_like(values), where=total > 0)


def furnace(albedo: float = 0.8, points: int = 150) -> Subject:
    """A closed box of side 2 that shines to its inside and reflects; E = 1 everywhere."""
    quads = box_quads((2, 2, 2))
    return _strewn(scene_of(quads, albedo, (1 - albedo) / np.pi), quads, points)


def cornell(points: int = 150) -> Subject:
    """A box of side 1 with a red and a green wall, a lamp under its ceiling and a block on its floor."""
    grey, red, green = (0.73, 0.73, 0.73), (0.61, 0.06, 0.06), (0.12, 0.45, 0.15)
    room = box_quads((1, 1, 1))
    block = box_quads((0.3, 0.3, 0.6))[:, ::-1] + (0.5, 0.2, 0.0)
    quads = np.concatenate([room, block])
    colours = np.array([*(grey,) * 4, red, green, *(grey,) * 6])
    lamp = AreaLight((0.5, 0.5, 0.98), (0.3, 0, 0), (0, 0.3, 0), (10.0, 8.0, 5.0))
    return _strewn(scene_of(quads, colours, lights=(lamp,)), quads[[0, 1, 2, 3, 4, 5, 7, 10]], points)


def outdoors(points: int = 150) -> Subject:
    """Ground with three houses under a low yellow sun and a blue sky."""
    ground = np.array([(-4, -4, 0), (4, -4, 0), (4, 4, 0), (-4, 4, 0)], float)
    houses = [box_quads(size)[:, ::-1] + place for size, place in _HOUSES]
    quads = np.concatenate([ground[None], *houses])
    colours = np.array([(0.3, 0.35, 0.2)] + [(0.7, 0.65, 0.6)] * (len(quads) - 1))
    lights = (SunLight((1, 0.4, -0.5), (3.0, 2.5, 1.8), 0.01), UniformWorld((0.2, 0.25, 0.4)))
    return _strewn(scene_of(quads, colours, lights=lights), quads, points)


_HOUSES = (((1, 2, 1.5), (-2, -1, 0)), ((1.5, 1, 1), (0.5, 0.5, 0)), ((0.6, 0.6, 2.5), (1, -2, 0)))

SUBJECTS = {"furnace, albedo 0.8": furnace, "Cornell box": cornell, "outdoors, sun and sky": outdoors}


def _strewn(scene: Scene, quads: np.ndarray, points: int) -> Subject:
    """``points`` uniform over the ``quads``' area, not at their edges, some of them under what stands there."""
    generator = np.random.default_rng(7)
    across, up = quads[:, 1] - quads[:, 0], quads[:, 3] - quads[:, 0]
    cross = np.cross(across, up)
    area = np.linalg.norm(cross, axis=1)
    face = generator.choice(len(quads), points, p=area / area.sum())
    u, v = generator.uniform(0.05, 0.95, (2, points, 1))
    return Subject(scene, quads[face, 0] + u * across[face] + v * up[face], (cross / area[:, None])[face])
