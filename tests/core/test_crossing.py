"""The crossing test against exact rational arithmetic."""

from fractions import Fraction

import numpy as np
from detp.core.crossing import crosses, crossing_times
from hypothesis import given, settings
from hypothesis import strategies as st

whole = st.integers(-64, 64)
vector = st.tuples(whole, whole, whole)


def exact(origin, end, centre, normal, radius):
    """Whether the segment crosses the disc, its place t, and how far the answer is from a change, all rational."""
    origin, end, centre, normal = ([Fraction(x) for x in row] for row in (origin, end, centre, normal))
    s = [e - o for e, o in zip(end, origin, strict=True)]
    w = [c - o for c, o in zip(centre, origin, strict=True)]
    facing = sum(x * n for x, n in zip(s, normal, strict=True))
    height = sum(x * n for x, n in zip(w, normal, strict=True))
    if facing >= 0:
        return False, None
    t = height / facing
    away = sum((o + t * x - c) ** 2 for o, x, c in zip(origin, s, centre, strict=True))
    return 0 <= t <= 1 and away <= Fraction(radius) ** 2, t


def both(origin, end, centre, normal, radius):
    rows = (np.array(row, float) for row in (origin, end, centre, normal))
    hit, time = crossing_times(*rows, np.float64(radius))
    assert hit == crosses(*(np.array(row, float) for row in (origin, end, centre, normal)), np.float64(radius))
    return bool(hit), float(time)


@settings(max_examples=300)
@given(vector, vector, vector, vector, st.integers(1, 64))
def test_whole_numbers_are_judged_exactly_ties_included(origin, end, centre, normal, half_radius):
    # All intermediate results fit into 53 bits, so that the float64 test must be right to the last tie.
    hit, time = both(origin, end, centre, normal, half_radius / 2)
    expected, exact_time = exact(origin, end, centre, normal, half_radius / 2)
    assert hit == expected
    if expected:
        assert time == float(exact_time)


@settings(max_examples=300)
@given(st.integers(0, 2**32), st.sampled_from([0.0, 1e3, 1e6]))
def test_rounding_only_decides_what_is_within_rounding_of_the_rim(seed, offset):
    generator = np.random.default_rng(seed)
    centre = generator.normal(size=3) + offset
    normal = generator.normal(size=3)
    normal /= np.linalg.norm(normal)
    aim = generator.normal(size=3) * 0.1
    origin, end = centre + aim + generator.normal(size=3), centre + aim + generator.normal(size=3)
    radius = 0.2
    hit, _ = both(origin, end, centre, normal, radius)
    answers = {exact(origin, end, centre, normal, radius * (1 + sign * 1e-9))[0] for sign in (-1, 1)}
    # t near 0 or 1 is decided by the heights of the segment's ends over the plane.
    heights = [abs(float(np.dot(point - centre, normal))) for point in (origin, end)]
    assert hit in answers or min(heights) < 1e-12 * max(1.0, offset)


def test_only_arrivals_from_the_front_count():
    disc = np.zeros(3), np.array([0.0, 0.0, 1.0]), np.float64(1.0)
    above, below = np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, -1.0])
    assert crosses(above, below, *disc)
    assert not crosses(below, above, *disc)


def test_a_segment_that_ends_on_the_disc_crosses_it_and_one_in_its_plane_does_not():
    disc = np.zeros(3), np.array([0.0, 0.0, 1.0]), np.float64(1.0)
    assert crosses(np.array([0.5, 0.0, 1.0]), np.array([0.5, 0.0, 0.0]), *disc)
    assert crosses(np.array([0.5, 0.0, 0.0]), np.array([0.5, 0.0, -1.0]), *disc)
    assert not crosses(np.array([-2.0, 0.0, 0.0]), np.array([2.0, 0.0, 0.0]), *disc)
    assert not crosses(np.zeros(3), np.zeros(3), *disc)


def test_not_a_number_never_crosses():
    rows = [np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, -1.0]), np.zeros(3), np.array([0.0, 0.0, 1.0])]
    for number in range(4):
        broken = [row.copy() for row in rows]
        broken[number][2] = np.nan
        assert not crosses(*broken, np.float64(1.0))
    assert not crosses(*rows, np.float64(np.nan))


def test_equal_pairs_get_equal_bits_however_they_are_laid_out():
    generator = np.random.default_rng(5)
    origins, ends = generator.normal(size=(2, 200, 1, 3)) + 1e6
    centres, normals = generator.normal(size=(2, 300, 3))
    centres += 1e6
    radii = generator.uniform(0.1, 1, 300)
    hit, time = crossing_times(origins, ends, centres, normals, radii)
    segment, disc = (index.ravel() for index in np.indices(hit.shape))
    pairs = origins[segment, 0], ends[segment, 0], centres[disc], normals[disc]
    flat_hit, flat_time = crossing_times(*(np.asfortranarray(row) for row in pairs), radii[disc])
    assert np.array_equal(hit.ravel(), flat_hit)
    assert np.array_equal(time.ravel(), flat_time)
