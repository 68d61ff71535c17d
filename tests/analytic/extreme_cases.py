"""The numerical extremes: each case says what is expected, bakes, and says what came out.

tests/analytic/test_extremes.py runs them small; tools/measure_extremes.py runs them larger and writes the table.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from itertools import product

import numpy as np
from detp.core.bake import baked
from detp.core.discs import TangentDiscs
from detp.core.errors import DetpError
from detp.core.gatherers.choose import make_gatherer
from detp.core.lights.area import AreaLight
from detp.core.lights.emissive import EmissiveTriangles
from detp.core.lights.point import PointLight
from detp.core.lights.sun import SunLight
from detp.core.lights.world import UniformWorld
from detp.core.points import Points
from detp.core.result import BakeResult
from detp.core.scene import Scene
from detp.core.segments import Segments
from detp.core.settings import BakeSettings
from rooms import box_quads, face_points, scene_of

#: both formulas, with direct light found both ways
DISCS = [
    {"estimator": estimator, "direct": direct, "indirect": "photons"}
    for estimator, direct in product(("visible", "plain"), ("photons", "shadow-rays"))
]
WAYS = [*DISCS, {"direct": "shadow-rays", "indirect": "gather"}]
SEARCHES = ("disc-index", "sphere-cache", "brute-force")


@dataclass(frozen=True)
class Case:
    """One extreme. ``run(size)`` bakes it with ``size`` times the photons and returns what was measured and whether
    that is as expected."""

    name: str
    expected: str
    run: Callable[[float], tuple[str, bool]]


CASES: list[Case] = []


def case(name: str, expected: str):
    """Adds the decorated function to CASES."""

    def added(run):
        CASES.append(Case(name, expected, run))
        return run

    return added


def baked_with(scene: Scene, points, normals, photons: float, inward=None, **settings) -> BakeResult:
    settings = {"radius": 0.1, "quality": "draft"} | settings
    return baked(scene, Points(points, normals, inward), BakeSettings(photons=int(photons), **settings))


def lamp_room(albedo=0.6, power=(30.0, 20.0, 10.0)) -> tuple[Scene, np.ndarray, np.ndarray]:
    """A closed room of side 2 around the origin with a block in it and a lamp; points in the walls' middles."""
    quads, points, normals, covered = room_with_block()
    scene = scene_of(quads, albedo, lights=(PointLight((0.4, -0.3, 0.5), power),))
    return scene, points[~covered], normals[~covered]


def room_with_block() -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Its faces, the points in the walls' middles with their normals, and which of them the block covers."""
    room = box_quads((2, 2, 2)) - 1
    block = box_quads((0.5, 0.6, 0.7))[:, ::-1] + (-0.7, 0.1, -1)
    points, normals = face_points(room, 3)
    covered = (np.abs(points - (-0.45, 0.4, -1)) <= (0.35, 0.4, 0.1)).all(axis=1)
    return np.concatenate([room, block]), points, normals, covered


def changed(scene: Scene, turn=None, factor=1.0, shift=(0.0, 0.0, 0.0)) -> Scene:
    """``scene`` with its vertices and its point lights turned, scaled and moved."""
    turn = np.eye(3) if turn is None else turn

    def placed(points):
        return factor * np.asarray(points) @ turn.T + shift

    lights = tuple(replace(lamp, position=placed(lamp.position)) for lamp in scene.lights)
    return replace(scene, vertices=placed(scene.vertices), lights=lights)


def finite(result: BakeResult) -> bool:
    return bool(np.isfinite(result.irradiance).all() and not np.isnan(result.standard_error).any())


def scores(one: BakeResult, other=0.0) -> np.ndarray:
    """How many standard errors (N,) each point's RGB sum is from another bake's or from a known sum."""
    value, error = other, 0.0
    if isinstance(other, BakeResult):
        value, error = other.irradiance.sum(axis=1), other.standard_error.sum(axis=1)
    summed = one.irradiance.sum(axis=1)
    allowed = np.hypot(one.standard_error.sum(axis=1), error) + 1e-6 * np.abs(summed)
    difference = np.abs(summed - value)
    return np.divide(difference, allowed, out=np.where(difference > 0, np.inf, 0.0), where=allowed > 0)


def relative(one: np.ndarray, other: np.ndarray) -> float:
    """The largest difference as a share of the largest value; 0 where there is none."""
    difference = float(np.abs(one - other).max())
    return difference / float(np.abs(other).max()) if difference > 0 else 0.0


# Where and how large the scene is


@case("the scene scaled by 2^-17 … 2^17 (1e-5 … 1e5)", "E · s² and the error the same to the last bit")
def scaled_exactly(size):
    worst = 0.0
    for unit, other in scaled_bakes(size, (2.0**-17, 2.0**17)):
        worst = max(worst, relative(other.irradiance, unit.irradiance))
        worst = max(worst, relative(other.standard_error, unit.standard_error))
    return f"largest difference {worst:.1e}", worst == 0.0


@case("the scene scaled by 1e-5, 1e-2, 1e3, 1e5", "E · s² the same up to rounding (no photon goes another way)")
def scaled(size):
    worst, spread = 0.0, 0.0
    for unit, other in scaled_bakes(size, (1e-5, 1e-2, 1e3, 1e5)):
        worst = max(worst, median_difference(other.irradiance, unit.irradiance))
        spread = max(spread, scores(other, unit).max())
    return f"median difference {worst:.1e}, none above {spread:.2f} sigma", worst < 1e-6 and spread < 2


def scaled_bakes(size, factors):
    """The lamp room baked in all ways, as it is and scaled by each of the ``factors``, whose light is taken back."""
    scene, points, normals = lamp_room()
    for way, factor in product(WAYS, factors):
        unit = baked_with(scene, points, normals, 2000 * size, **way)
        large, radius = changed(scene, factor=factor), 0.1 * factor
        yield unit, replaced(baked_with(large, points * factor, normals, 2000 * size, radius=radius, **way), factor**2)


def median_difference(found: np.ndarray, expected: np.ndarray) -> float:
    """Median relative difference where there is light; few photons leave some points without."""
    lit = expected != 0
    return float(np.median(np.abs(found[lit] / expected[lit] - 1)))


def replaced(result: BakeResult, factor: float) -> BakeResult:
    """The result with all its light multiplied by ``factor``."""
    light = (type(part)(part.value * factor, part.standard_error * factor) for part in (result.direct, result.indirect))
    return replace(result, **dict(zip(("direct", "indirect"), light, strict=True)))


@case("the scene moved by 1e6 units", "E the same up to rounding")
def moved(size):
    scene, points, normals = lamp_room()
    worst, spread = 0.0, 0.0
    for way in WAYS:
        unit = baked_with(scene, points, normals, 2000 * size, **way)
        shift = np.array((1e6, -2e6, 3e6))
        other = baked_with(changed(scene, shift=shift), points + shift, normals, 2000 * size, **way)
        worst = max(worst, median_difference(other.irradiance, unit.irradiance))
        spread = max(spread, scores(other, unit).max())
    return f"median difference {worst:.1e}, none above {spread:.2f} sigma", worst < 1e-4 and spread < 3


@case(
    "the scene turned arbitrarily",
    "E the same within noise; direct light to 0.1 % (the lift off the surface follows the scene's box)",
)
def turned(size):
    scene, points, normals = lamp_room()
    generator = np.random.default_rng(3)
    worst, exact = 0.0, 0.0
    for way in WAYS:
        turn = np.linalg.qr(generator.normal(size=(3, 3)))[0]
        turn *= np.sign(np.linalg.det(turn))
        unit = baked_with(scene, points, normals, 20_000 * size, **way)
        other = baked_with(changed(scene, turn), points @ turn.T, normals @ turn.T, 20_000 * size, seed=1, **way)
        worst = max(worst, scores(other, unit).max())
        if way["direct"] == "shadow-rays":
            exact = max(exact, relative(other.direct.value, unit.direct.value))
    return (
        f"largest difference {worst:.1f} sigma of {len(points)} points; direct {exact:.1e}",
        worst < 5 and exact < 1e-3,
    )


# Discs, flux and counts


@case(
    "disc radius 1e-6 … 10 times the scene", "E = 1 in a furnace; the mean of a face, times its share of a plain disc"
)
def radii(size):
    quads = box_quads((2, 2, 2))
    points, normals = quads.mean(axis=1), face_points(quads, 1)[1]
    furnace = scene_of(quads, 0.5, 0.5 / np.pi)
    lamp = scene_of(quads, 0.5, lights=(PointLight((1, 1, 1), (12.0,) * 3),))
    worst, different = 0.0, 0.0
    for share, way in product((1e-6, 1e-3, 0.1, 1.0, 10.0), DISCS):
        # Discs within a face read E in its middle. Discs that hold the face read its mean, 1 by the energy balance:
        # plain ones of its size do, and of visible ones of ten times its size all the nested discs do.
        plain, radius = way["estimator"] == "plain", share * furnace.bounds.radius
        whole = share >= (1 if plain else 10)
        scene = lamp if whole else furnace
        results = [
            baked_with(scene, points, normals, 3000 * size, radius=radius, gatherer=search, **way)
            for search in SEARCHES
        ]
        different = max(different, *(relative(r.irradiance, results[0].irradiance) for r in results[1:]))
        seen = 4 / (np.pi * radius**2) if plain and whole else 1.0
        at_point = 12 / (4 * np.pi) if whole else 0.5
        expected = at_point + 0.5 * seen if way["direct"] == "shadow-rays" else seen
        worst = max(worst, scores(results[0], 3 * expected).max())
    return f"largest error {worst:.1f} sigma; gatherers differ by {different:.0e}", worst < 5 and different < 1e-12


@case("the gatherers with discs of 1e-6 … 10, grazing down to 1e-7 rad, at 1e6", "the same pairs, thousands of them")
def searches(size):
    generator = np.random.default_rng(5)
    count, wrong, found = int(3000 * size), 0, 0
    for offset, share in product((0.0, 1e6), (1e-6, 1e-3, 0.1, 10.0)):
        centres = generator.uniform(-1, 1, (400, 3)) + offset
        normals = generator.normal(size=(400, 3))
        discs = TangentDiscs.of_radius(centres, normals, share)
        # Each segment is aimed at a disc, past its rim or not, at any angle down to grazing.
        disc = generator.integers(0, 400, count)
        normal = discs.normals[disc]
        along = np.cross(generator.normal(size=(count, 3)), normal)
        along /= np.linalg.norm(along, axis=1)[:, None]
        angle = 10 ** generator.uniform(-7, 0.19, (count, 1))
        onward = np.cos(angle) * along - np.sin(angle) * normal
        place = centres[disc] + share * generator.uniform(0, 1.2, (count, 1)) * np.cross(normal, along)
        ends = place + generator.uniform(0.01, 2, (2, count, 1)) * np.array([-1, 1])[:, None, None] * onward
        segments = Segments(*ends, np.ones((count, 3)), np.zeros(count, np.uint16))
        pairs = []
        for search in SEARCHES:
            parts = list(make_gatherer(search, discs)[0].crossings(segments))
            rows = np.concatenate([part.segment * 400 + part.disc for part in parts])
            pairs.append(np.sort(rows))
        found += len(pairs[0])
        wrong += sum(not np.array_equal(pairs[-1], other) for other in pairs)
    return f"{found} pairs, {wrong} differences", wrong == 0 and found > count


@case("flux of 1e-20 and 1e20 W", "E in proportion, the relative error unchanged")
def fluxes(size):
    worst = 0.0
    for way, factor in product(WAYS, (1e-20, 1e20)):
        scene, points, normals = lamp_room()
        unit = baked_with(scene, points, normals, 2000 * size, **way)
        scene, points, normals = lamp_room(power=np.array((30.0, 20.0, 10.0)) * factor)
        other = baked_with(scene, points, normals, 2000 * size, **way)
        worst = max(worst, relative(other.irradiance / factor, unit.irradiance))
        worst = max(worst, abs(other.relative_error / unit.relative_error - 1))
    return f"largest difference {worst:.1e}", worst < 1e-12


@case("one photon, one triangle, one point", "a finite E, and an error that says nothing is known")
def singles(size):
    scene = Scene([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)], [(0.5,) * 3], [(0,) * 3], [(0,) * 3])
    scene = replace(scene, lights=(SunLight((0, 0, -1), (1.0, 1.0, 1.0)),))
    values, fine = [], True
    for way, search in product(DISCS, (*SEARCHES, "auto")):
        radius = None if search == "auto" else 0.1
        result = baked_with(
            scene, np.array([(0.2, 0.2, 0)]), np.array([(0, 0, 1.0)]), 1, radius=radius, gatherer=search, **way
        )
        values.append(result.irradiance[0, 0])
        fine &= finite(result) and result.photons == 1 and np.isinf(result.standard_error).all()
    return f"E from {min(values):.3g} to {max(values):.3g}, error inf", fine


# What surfaces and lights do


@case("albedo 0", "E = direct light; nothing reflected, nothing cut")
def black(size):
    scene, points, normals = lamp_room(albedo=0.0)
    results = [baked_with(scene, points, normals, 5000 * size, **way) for way in WAYS]
    fine = all(
        not r.indirect.value.any() and not r.cut_flux.any() and not r.indirect.standard_error.any() for r in results
    )
    worst = scores(results[0], results[1]).max()
    return f"indirect 0, cut 0 W; photons and shadow rays differ by {worst:.1f} sigma at most", fine and worst < 5


@case(
    "albedo 1 and 1.05 (out of range) in a closed room, 64 bounces",
    "the geometric sum of 65 terms; the rest is reported as cut",
)
def white(size):
    texts, fine = [], True
    for albedo in (1.0, 1.05):
        quads = box_quads((2, 2, 2))
        scene = scene_of(quads, albedo, lights=(PointLight((1, 1, 1.2), (24.0,) * 3),))
        points, normals = quads.mean(axis=1), face_points(quads, 1)[1]
        terms = albedo ** np.arange(65)
        result = baked_with(scene, points, normals, 2000 * size, radius=0.3, direct="shadow-rays")
        indirect = float(result.indirect.value.mean() / terms[1:].sum())
        cut = float(result.cut_flux[0] / (24 * albedo**65))
        fine &= abs(indirect - 1) < 0.1 / np.sqrt(size) and abs(cut - 1) < 1e-9 and finite(result)
        texts.append(f"albedo {albedo}: {indirect:.3f} of the sum, cut {cut:.6f} of what is left")
    return "; ".join(texts), fine


@case("sun 1e-7 … 1e-2 rad above the ground, and exactly grazing", "E = S sin(angle); exactly 0 when grazing")
def grazing(size):
    ground = np.array([[(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]], float)
    points, normals = np.array([(0.1, 0.2, 0.0), (-0.3, 0.1, 0)]), np.tile((0, 0, 1.0), (2, 1))
    worst, ray = 0.0, 0.0
    fine = True
    for way, angle in product(WAYS, (1e-7, 1e-5, 1e-2, 0.0)):
        for about in (0.3, 0.0):
            level = np.array((np.cos(about), np.sin(about), 0.0)) * np.cos(angle)
            scene = scene_of(ground, 0.5, lights=(SunLight(level - (0, 0, np.sin(angle)), (1.0, 1.0, 1.0)),))
            result = baked_with(scene, points, normals, 20_000 * size, **way)
            worst = max(worst, scores(result, 3 * np.sin(angle)).max())
            if way["direct"] == "shadow-rays":
                ray = max(ray, float(np.abs(result.irradiance - np.sin(angle)).max() / max(angle, 1e-300)))
            fine &= angle > 0 or not result.irradiance.any()
    return f"photons {worst:.1f} sigma off at most, shadow rays {ray:.0e}", fine and worst < 5 and ray < 1e-8


@case("lamps on a wall, in a corner, at a point, inside a solid and behind a wall", "finite; 0 from the last two")
def lamps(size):
    quads, points, normals, covered = room_with_block()
    texts, fine = [], True
    places = {"on": (0.3, 0.2, -1), "corner": (1, 1, 1), "point": points[4], "inside": (-0.5, 0.4, -0.8),
              "behind": (0, 0, 1.5)}  # fmt: skip
    for name, place in places.items():
        for way, radius in product(WAYS, (0.0, 0.05)):
            scene = scene_of(quads, 0.5, lights=(PointLight(place, (9.0,) * 3, radius),))
            result = baked_with(scene, points, normals, 2000 * size, **way)
            fine &= finite(result)
            if name in ("inside", "behind"):
                # A wall through a cell of records may escape the few rays that look for it.
                leak = 2e-4 * result.irradiance.max() if way["indirect"] == "gather" else 0.0
                fine &= result.irradiance[~covered].max() <= leak
        texts.append(f"{name}: E up to {result.irradiance.max():.3g}")
    return "; ".join(texts), fine


@case("area lamp exactly in the ceiling, shining down", "photons and shadow rays agree")
def flush(size):
    quads = box_quads((2, 2, 2)) - 1
    points, normals = face_points(quads, 3)
    lamp = AreaLight((0, 0, 1), (0.5, 0, 0), (0, 0.5, 0), (9.0,) * 3)
    scene = scene_of(quads, 0.5, lights=(lamp,))
    visible = [baked_with(scene, points, normals, 20_000 * size, **way) for way in WAYS[:2]]
    worst = scores(*visible).max()
    balance = float(visible[1].direct.value.mean() * 24 / 27)
    return (
        f"{worst:.1f} sigma at most; mean direct light {visible[1].direct.value.mean():.3f}",
        worst < 5 and balance > 0,
    )


@case("a closed room in the dark, with sun, world and lamp outside", "E = 0 but for a ray in millions, also in corners")
def darkness(size):
    quads = box_quads((2, 2, 2)) - 1
    points, normals = face_points(quads, 3)
    corners, faces = quads.reshape(-1, 3), np.repeat(quads.mean(axis=1), 4, axis=0)
    points, inward = np.concatenate([points, corners]), np.concatenate([np.zeros_like(points), faces - corners])
    normals = np.concatenate([normals, np.repeat(normals[::9], 4, axis=0)])
    lights = (SunLight((0.3, 0.2, -1), (5.0,) * 3), UniformWorld((1.0,) * 3), PointLight((0, 0, 1.2), (50.0,) * 3))
    worst = 0.0
    for turn in (np.eye(3), np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]):
        turn = turn * np.sign(np.linalg.det(turn))
        scene = scene_of(
            quads @ turn.T, 0.5, lights=(*lights[:2], replace(lights[2], position=lights[2].position @ turn.T))
        )
        for direct in ("photons", "shadow-rays"):
            settings = BakeSettings(photons=int(30_000 * size), radius=0.1, direct=direct, quality="draft")
            result = baked(scene, Points(points @ turn.T, normals @ turn.T, inward @ turn.T), settings)
            worst = max(worst, float(result.irradiance.max()))
    # A ray in millions slips through the line where two walls meet; outside is a light of 8 W/m^2.
    return f"E up to {worst:.3g}", worst < 1e-5


# Broken and awkward geometry


def with_faces(scene: Scene, vertices, triangles) -> Scene:
    """``scene`` with more grey triangles."""
    count = len(triangles)
    more = np.asarray(triangles) + len(scene.vertices)
    grey = {name: np.concatenate([getattr(scene, name), np.full((count, 3), value)])
            for name, value in (("albedo", 0.6), ("emission", 0.0), ("transmittance", 0.0))}  # fmt: skip
    vertices = np.concatenate([scene.vertices, np.asarray(vertices, float)])
    return replace(scene, vertices=vertices, triangles=np.concatenate([scene.triangles, more]), **grey)


@cache
def _lamp_room_baked(photons: float) -> list[BakeResult]:
    """The lamp room as it is, in all ways."""
    return [baked_with(*lamp_room(), photons, **way) for way in WAYS]


def compared(size, change) -> tuple[float, bool]:
    """The largest difference in sigma that ``change`` makes to the lamp room, and whether all is finite."""
    scene, points, normals = lamp_room()
    worst, fine = 0.0, True
    for way, unit in zip(WAYS, _lamp_room_baked(20_000 * size), strict=True):
        other = baked_with(change(scene), points, normals, 20_000 * size, seed=1, **way)
        worst, fine = max(worst, scores(other, unit).max()), fine and finite(other)
    return worst, fine


@case("all faces twice, in the same place", "E the same")
def doubled(size):
    worst, fine = compared(size, lambda scene: with_faces(scene, scene.vertices, scene.triangles))
    return f"largest difference {worst:.1f} sigma", fine and worst < 5


@case("faces without area, of one point and of a line", "E the same, finite")
def collapsed(size):
    flat = [(0, 0, -1), (0, 0, -1), (0, 0, -1), (0.5, 0.5, -1), (0.5, 0.7, -1), (0.5, 0.9, -1)]
    worst, fine = compared(size, lambda scene: with_faces(scene, flat, [(0, 1, 2), (3, 4, 5), (0, 0, 0)]))
    return f"largest difference {worst:.1f} sigma", fine and worst < 5


@case("all faces inverted", "E the same: surfaces reflect on both sides")
def inverted(size):
    worst, fine = compared(size, lambda scene: replace(scene, triangles=scene.triangles[:, ::-1]))
    return f"largest difference {worst:.1f} sigma", fine and worst < 5


@case("three faces on one edge, and a loose fin of no thickness", "finite; photons and shadow rays agree")
def fins(size):
    scene, points, normals = lamp_room()
    scene = with_faces(
        scene, [(0, 0.8, -1), (0.5, 0.8, -1), (0.2, 0.8, 0), (0.2, 0.3, -0.6)], [(0, 1, 2), (0, 1, 3), (1, 0, 3)]
    )
    results = [baked_with(scene, points, normals, 20_000 * size, **way) for way in WAYS]
    worst = max(scores(results[0], results[1]).max(), scores(results[2], results[3]).max())
    return f"largest difference {worst:.1f} sigma", all(map(finite, results)) and worst < 5


@case("ground of needles 1e6 : 1 (1 km by 1 mm)", "E = S cos on top, 0 beneath")
def needles(size):
    count, width, length = 200, 1e-3, 1e3
    x = (np.arange(count + 1) - count / 2) * width
    vertices = np.stack(
        [np.repeat(x, 2), np.tile((-length / 2, length / 2), count + 1), np.zeros(2 * count + 2)], axis=1
    )
    left = 2 * np.arange(count)[:, None]
    triangles = np.concatenate([left + (0, 2, 3), left + (0, 3, 1)])
    grey = np.full((2 * count, 3), 0.5)
    sun = SunLight((0.3, 0.4, -1.0), (2.0,) * 3)
    scene = Scene(vertices, triangles, grey, 0 * grey, 0 * grey, (sun,))
    middle = vertices[triangles].mean(axis=1)[::20] * (1, 0.1, 1)
    points, normals = np.tile(middle, (2, 1)), np.repeat([(0, 0, 1.0), (0, 0, -1.0)], len(middle), axis=0)
    half, worst, ray = len(middle), 0.0, 0.0
    expected = -2 * sun.direction[2]
    for way in WAYS:
        result = baked_with(scene, points, normals, 20_000 * size, radius=0.05, **way)
        worst = max(worst, float(np.abs(result.irradiance[half:]).max()))
        if way["direct"] == "shadow-rays":
            ray = max(ray, float(np.abs(result.irradiance[:half] / expected - 1).max()))
    return f"shadow rays {ray:.0e} off on top; beneath {worst:.3g}", worst == 0.0 and ray < 1e-6


@case("NaN or infinite vertices, colours, emission, points, normals, lamps", "InvalidArrayError or another named error")
def broken(size):
    refused = tried = 0
    for value in (np.nan, np.inf, -np.inf):
        for attempt in _broken_input(value):
            tried += 1
            try:
                attempt()
            except DetpError:
                refused += 1
    return f"{refused} of {tried} refused by name", refused == tried


def _broken_input(value: float):
    """What must be refused when one of its numbers is ``value``."""
    scene, points, normals = lamp_room()
    ones = (1.0, 1.0, 1.0)
    for name in ("vertices", "albedo", "emission", "transmittance"):
        spoilt = _spoilt(getattr(scene, name), value)
        yield lambda name=name, spoilt=spoilt: replace(scene, **{name: spoilt})
    yield lambda: baked_with(scene, _spoilt(points, value), normals, 10)
    yield lambda: baked_with(scene, points, _spoilt(normals, value), 10)
    yield lambda: PointLight((value, 0, 0), ones)
    yield lambda: PointLight((0, 0, 0), (value, 1.0, 1.0))
    yield lambda: SunLight((0, value, 1), ones)
    yield lambda: UniformWorld((value, 1.0, 1.0))
    yield lambda: AreaLight((0, 0, value), (1, 0, 0), (0, 1, 0), ones)
    yield lambda: EmissiveTriangles(np.full((1, 3, 3), value), np.ones((1, 3)))
    yield lambda: TangentDiscs.of_radius(points, normals, value)
    yield lambda: BakeSettings(radius=value)


def _spoilt(values: np.ndarray, value: float) -> np.ndarray:
    values = np.array(values)
    values[-1, 1] = value
    return values


@case(
    "100 000 tiny tetrahedra over a floor (1000 in the tests)",
    "finite, with light under the cloud and all gatherers alike",
)
def swarm(size):
    count = 1000 if size <= 1 else 100_000
    generator = np.random.default_rng(8)
    corners = 0.002 * np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)])
    places = generator.uniform((-1, -1, 0.1), (1, 1, 1), (count, 3))
    vertices = (places[:, None] + corners).reshape(-1, 3)
    triangles = (4 * np.arange(count)[:, None, None] + [(0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2)]).reshape(-1, 3)
    ground = np.array([[(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]], float)
    scene = with_faces(scene_of(ground, 0.6, lights=(UniformWorld((1 / np.pi,) * 3),)), vertices, triangles)
    points, normals = face_points(ground, 5)
    rows = generator.choice(count, 200)
    points = np.concatenate([points, places[rows] + corners[0]])
    normals = np.concatenate([normals, np.tile(corners[0], (200, 1))])
    results = [baked_with(scene, points, normals, 20_000, gatherer=search, direct="shadow-rays") for search in SEARCHES]
    different = max(relative(r.irradiance, results[0].irradiance) for r in results)
    ground_light = float(results[0].irradiance[:25].mean())
    text = (
        f"{count} objects; ground {ground_light:.2f}, objects {results[0].irradiance[25:].mean():.2f} of the open sky"
    )
    return text, all(map(finite, results)) and different < 1e-12 and 0 < ground_light <= 1.05
