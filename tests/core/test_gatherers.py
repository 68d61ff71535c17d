"""The contract of every gatherer and index kind: the pairs that the crossing test accepts, each once."""

from functools import partial

import numpy as np
import pytest
from detp.core import parallel
from detp.core.crossing import crosses
from detp.core.discs import TangentDiscs
from detp.core.errors import InvalidSettingError
from detp.core.gatherers import brute_force, disc_index, sphere_cache
from detp.core.gatherers import gatherer as portioned
from detp.core.gatherers.brute_force import BruteForce
from detp.core.gatherers.choose import make_gatherer
from detp.core.gatherers.disc_index import DiscIndex
from detp.core.gatherers.hybrid import Hybrid
from detp.core.gatherers.sphere_cache import SphereCache
from detp.core.segments import Segments
from hypothesis import given, settings
from hypothesis import strategies as st


def spheres(last=None, **options):
    """A Sphere Cache whose last radius is given in median radii of the discs."""

    def make(discs):
        radius = last * float(np.median(discs.radii)) if last and len(discs) else None
        return SphereCache(discs, last_radius=radius, **options)

    return make


def hybrid(every, **options):
    """A hybrid of whose discs one in ``every`` moves, all from the place of the first that does."""

    def make(discs):
        rows = np.arange(len(discs))
        moving = rows % every == 0
        return Hybrid(discs.taken(np.where(moving, 0, rows)), moving, **options).moved(discs)

    return make


GATHERERS = {
    "brute force": BruteForce,
    "disc index": DiscIndex,
    "disc index, unbalanced": partial(DiscIndex, halves=lambda count: count // 5),
    "spheres 0.3": spheres(q=0.3),
    "spheres 0.6": spheres(q=0.6),
    "spheres 0.9": spheres(q=0.9),
    "spheres 0.6, small last": spheres(q=0.6, last=0.4),
    "spheres 0.6, large last": spheres(q=0.6, last=4.0),
    "spheres 0.6, unsorted": spheres(q=0.6, sort=False),
    "hybrid, nothing moves": Hybrid,
    "hybrid, one in three moves": hybrid(3),
    "hybrid, all move": hybrid(1, q=0.8, mobile=DiscIndex),
}


def segments_of(origins, ends):
    return Segments(origins, ends, np.ones((len(origins), 3)), np.zeros(len(origins), np.uint16))


def pairs_of(chunks):
    segment = np.concatenate([chunk.segment for chunk in chunks] or [np.zeros(0, np.int64)])
    disc = np.concatenate([chunk.disc for chunk in chunks] or [np.zeros(0, np.int64)])
    assert segment.dtype == disc.dtype == np.int64
    return list(zip(segment.tolist(), disc.tolist(), strict=True))


def all_pairs(discs, segments):
    hit = crosses(segments.origins[:, None], segments.ends[:, None], discs.centres, discs.normals, discs.radii)
    return set(zip(*(index.tolist() for index in np.nonzero(hit)), strict=True))


def check(gatherer, discs, segments):
    found = pairs_of(list(gatherer.crossings(segments)))
    expected = all_pairs(discs, segments)
    missing, extra = expected - set(found), set(found) - expected
    twice = len(found) - len(set(found))
    assert not (missing or extra or twice), (
        f"{len(expected)} crossings: {len(missing)} missing {sorted(missing)[:5]}, "
        f"{len(extra)} too many {sorted(extra)[:5]}, {twice} repeated"
    )
    return len(expected)


def directions(generator, count):
    rows = generator.normal(size=(count, 3))
    return rows / np.linalg.norm(rows, axis=1)[:, None]


AXES = np.concatenate([np.eye(3), -np.eye(3)])


def volume(generator, radius, offset=0.0, spread=0.0, size=1.0):
    """Discs and segments strewn through a cube; their radii spread over as many powers of e."""
    centres = generator.uniform(-size, size, (150, 3)) + offset
    radii = radius * size * np.exp(spread * generator.normal(size=150))
    ends = generator.uniform(-1.5 * size, 1.5 * size, (2, 150, 3)) + offset
    return TangentDiscs(centres, directions(generator, 150), radii), segments_of(*ends)


def aimed(generator, radius):
    """Small discs, each aimed at by segments that pass near its rim."""
    centres = generator.uniform(-1, 1, (100, 3))
    discs = TangentDiscs.of_radius(centres, directions(generator, 100), radius)
    targets = np.tile(centres, (3, 1)) + 1.2 * radius * generator.normal(size=(300, 3))
    step = directions(generator, 300) * generator.uniform(0.1, 3, (300, 1))
    share = generator.uniform(0, 1, (300, 1))
    return discs, segments_of(targets - share * step, targets + (1 - share) * step)


def clustered(generator):
    """Three clusters a thousandth of the scene's size, some strays, and segments within and between them."""
    middles = generator.uniform(-1, 1, (3, 3))
    centres = np.concatenate([m + 1e-3 * generator.normal(size=(60, 3)) for m in middles] + [middles * 3])
    discs = TangentDiscs.of_radius(centres, directions(generator, len(centres)), 4e-4)
    near = centres[generator.integers(0, len(centres), 300)] + 3e-4 * generator.normal(size=(300, 3))
    away = near + directions(generator, 300) * 10.0 ** generator.uniform(-4, 0.5, (300, 1))
    return discs, segments_of(np.concatenate([near, away[:150]]), np.concatenate([away, near[:150]]))


def lattice(generator, tilt=0.0):
    """Discs on a square lattice in three axis planes, hit by segments that run along axes, edges and rims."""
    x, y = (index.ravel().astype(float) for index in np.meshgrid(np.arange(6), np.arange(6)))
    flat = np.column_stack([x, y, np.zeros(36)])
    centres = np.concatenate([flat, np.roll(flat, 1, axis=1), np.roll(flat, 2, axis=1)])
    normals = np.repeat(AXES[[2, 0, 1]], 36, axis=0) * generator.choice([-1, 1], (108, 1))
    discs = TangentDiscs.of_radius(centres, normals + tilt * generator.normal(size=(108, 3)), 1.0)
    start = generator.integers(-1, 7, (400, 3)) * generator.choice([1.0, 0.5], (400, 1))
    along = start + AXES[generator.integers(0, 6, 400)] * generator.integers(0, 8, (400, 1))
    across = generator.integers(-1, 7, (400, 3)) * 0.5
    return discs, segments_of(np.concatenate([start, start]), np.concatenate([along, across]))


def room(generator):
    """Points on the walls of a box, segments from wall to wall, ending exactly in the discs' planes."""

    def on_walls(count):
        points = generator.uniform(0, 1, (count, 3))
        axis, side = generator.integers(0, 3, count), generator.integers(0, 2, count)
        points[np.arange(count), axis] = side
        normals = np.zeros((count, 3))
        normals[np.arange(count), axis] = 1 - 2 * side
        return points, normals

    discs = TangentDiscs.of_radius(*on_walls(400), 0.08)
    return discs, segments_of(on_walls(300)[0], on_walls(300)[0])


def in_plane(generator):
    """Segments in or almost in the plane of all discs, along the grid's axes and across."""
    centres = generator.uniform(0, 1, (100, 3)) * [1, 1, 0]
    discs = TangentDiscs.of_radius(centres, np.tile([0.0, 0.0, 1.0], (100, 1)), 0.1)
    origins, ends = generator.uniform(-0.5, 1.5, (2, 300, 3)) * [1, 1, 0]
    origins[:, 2] = generator.choice([0.0, 1e-16, 1e-9, 1e-3], 300)
    ends[:, 2] = -generator.choice([0.0, 1e-16, 1e-9, 1e-3], 300)
    ends[:100, 1] = origins[:100, 1]
    return discs, segments_of(origins, ends)


def far_reaching(generator):
    """Segments that begin or end up to a million times the scene's size away."""
    discs, near = volume(generator, 0.2)
    step = (near.ends - near.origins) * 10.0 ** generator.uniform(0, 6, (150, 1))
    middle = generator.uniform(-1, 1, (150, 3))
    return discs, segments_of(middle - generator.uniform(0, 1, (150, 1)) * step, middle + step)


def repeated(generator):
    """The same discs and segments many times, and segments without length, on and off the discs."""
    discs, segments = volume(generator, 0.3)
    rows = generator.integers(0, 20, 150)
    discs = discs.taken(rows)
    origins, ends = segments.origins[rows].copy(), segments.ends[rows].copy()
    ends[:40] = origins[:40]
    origins[40:60] = ends[40:60] = discs.centres[40:60]
    return discs, segments_of(origins, ends)


SCENES = {
    "tiny discs": partial(aimed, radius=1e-4),
    "small discs": partial(aimed, radius=0.02),
    "discs as large as their spacing": partial(volume, radius=0.3),
    "discs larger than the scene": partial(volume, radius=5.0),
    "radii from tiny to huge": partial(volume, radius=0.1, spread=2.0),
    "far from the origin": partial(volume, radius=0.2, offset=1e6),
    "a micrometre wide": partial(volume, radius=0.2, size=1e-6),
    "a thousand kilometres wide": partial(volume, radius=0.2, size=1e6),
    "clusters": clustered,
    "lattice": lattice,
    "lattice, almost": partial(lattice, tilt=1e-7),
    "room": room,
    "in the plane": in_plane,
    "far reaching segments": far_reaching,
    "repeated rows": repeated,
}


@pytest.mark.parametrize("make", GATHERERS.values(), ids=GATHERERS.keys())
class TestContract:
    @pytest.mark.parametrize("scene", SCENES.values(), ids=SCENES.keys())
    def test_finds_the_pairs_that_cross_each_once(self, make, scene):
        crossings = 0
        for seed in range(3):
            discs, segments = scene(np.random.default_rng(seed))
            crossings += check(make(discs), discs, segments)
        assert crossings > 20

    @settings(max_examples=25)
    @given(st.data())
    def test_small_whole_numbers_full_of_ties(self, make, data):
        place = st.tuples(*[st.integers(0, 4)] * 3)
        normal = place.map(lambda row: tuple(x - 2 for x in row)).filter(any)
        rows = data.draw(
            st.lists(st.tuples(place, normal, st.sampled_from([0.5, 1.0, 2**0.5])), min_size=1, max_size=12)
        )
        paths = data.draw(st.lists(st.tuples(place, place), min_size=1, max_size=12))
        discs = TangentDiscs(*(np.array(column, float) for column in zip(*rows, strict=True)))
        segments = segments_of(*(np.array(column, float) for column in zip(*paths, strict=True)))
        check(make(discs), discs, segments)

    def test_no_segments_no_discs_one_disc(self, make):
        discs, segments = volume(np.random.default_rng(1), 0.5)
        none = segments_of(np.zeros((0, 3)), np.zeros((0, 3)))
        assert pairs_of(list(make(discs).crossings(none))) == []
        assert pairs_of(list(make(discs.taken(slice(0))).crossings(segments))) == []
        assert check(make(discs.taken([0])), discs.taken([0]), segments) > 0
        flat = TangentDiscs.of_radius(np.zeros((1, 3)), [(0, 0, 1)], 1e-3)
        check(make(flat), flat, segments_of(np.array([[0, 0, 1.0]]), np.array([[0, 0, -1.0]])))

    def test_chunks_are_bounded_and_independent_of_threads(self, make, monkeypatch):
        monkeypatch.setattr(disc_index, "SEGMENTS", 100)
        monkeypatch.setattr(sphere_cache, "SEGMENTS", 100)
        monkeypatch.setattr(brute_force, "SEGMENTS", 2)
        monkeypatch.setattr(portioned, "PAIRS", 1000)
        generator = np.random.default_rng(3)
        discs, _ = volume(generator, 1.0)
        origins, ends = generator.uniform(-1, 1, (2, 2000, 3))
        chunks = {}
        for threads in (1, 2, 5):
            monkeypatch.setattr(parallel, "worker_count", lambda threads=threads: threads)
            chunks[threads] = list(make(discs).crossings(segments_of(origins, ends)))
        assert max(map(len, chunks[1])) <= 100 * len(discs)
        assert len(chunks[1]) >= 20
        for threads in (2, 5):
            assert len(chunks[threads]) == len(chunks[1])
            for one, other in zip(chunks[1], chunks[threads], strict=True):
                assert np.array_equal(one.segment, other.segment) and np.array_equal(one.disc, other.disc)


def test_many_discs_larger_than_the_scene_come_in_bounded_chunks():
    generator = np.random.default_rng(8)
    discs = TangentDiscs.of_radius(generator.uniform(-1, 1, (3000, 3)), directions(generator, 3000), 20.0)
    segments = segments_of(*generator.uniform(-1, 1, (2, 3000, 3)))
    counts = {}
    for name in ("disc-index", "sphere-cache", "brute-force"):
        gatherer, _ = make_gatherer(name, discs)
        sizes = [len(chunk) for chunk in gatherer.crossings(segments)]
        assert max(sizes) <= portioned.PAIRS
        counts[name] = sum(sizes)
    assert len(set(counts.values())) == 1 and counts["brute-force"] > 1e6


def test_the_gatherers_have_the_names_of_the_command_line_and_say_why():
    discs, _ = volume(np.random.default_rng(1), 0.5)
    for name in ("disc-index", "sphere-cache", "hybrid", "brute-force"):
        gatherer, reason = make_gatherer(name, discs)
        assert gatherer.name == name
        assert "as asked for" in reason
    for some in (discs, discs.taken([0, 0]), discs.taken(slice(0))):
        gatherer, reason = make_gatherer("auto", some)
        assert gatherer.name == "disc-index" and reason.startswith("Disc Indexing: ")


def test_wrong_options_are_named():
    discs, _ = volume(np.random.default_rng(1), 0.5)
    for make in (
        partial(make_gatherer, "octopus"),
        partial(SphereCache, q=1.0),
        partial(SphereCache, q=0.0),
        partial(SphereCache, last_radius=0.0),
    ):
        with pytest.raises(InvalidSettingError):
            make(discs)
