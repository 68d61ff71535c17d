"""The crossing test against exact rational arithmetic."""

from fractions import Fraction

import numpy as np
from detp.core.crossing import crosses
from hypothesis import given, settings
from hypothesis import strategies as st

whole = st.integers(-64, 64)
vector = st.tuples(whole, whole, whole)


def exact(origin, end, centre, normal, radius):
    """Whether the segment crosses the disc, all rational."""
    origin, end, centre, normal = ([Fraction(x) for x in row] for row in (origin, end, centre, normal))
    s = [e - o for e, o in zip(end, origin, strict=True)]
    w = [c - o for c, o in zip(centre, origin, strict=True)]
    facing = sum(x * n for x, n in zip(s, normal, strict=True))
    height = sum(x * n for x, n in zip(w, normal, strict=True))
    if facing >= 0:
        return False
    t = height / facing
    away = sum((o + t * x - c) ** 2 for o, x, c in zip(origin, s, centre, strict=True))
    return 0 <= t <= 1 and away <= Fraction(radius) ** 2


def judged(origin, end, centre, normal, radius):
    return bool(crosses(*(np.array(row, float) for row in (origin, end, centre, normal)), np.float64(radius)))


@settings(max_examples=300)
@given(vector, vector, vector, vector, st.integers(1, 64))
def test_whole_numbers_are_judged_exactly_ties_included(origin, end, centre, normal, half_radius):
    # All intermediate results fit into 53 bits, so that the float64 test must be right to the last tie.
    case = origin, end, centre, normal, half_radius / 2
    assert judged(*case) == exact(*case)


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
    hit = judged(origin, end, centre, normal, radius)
    answers = {exact(origin, end, centre, normal, radius * (1 + sign * 1e-9)) for sign in (-1, 1)}
    # t near 0 or 1 is decided by the heights of the segment's ends over the plane.
    heights = [abs(float(np.dot(point - centre, normal))) for point in (origin, end)]
    assert hit in answers or min(heights) < 1e-12 * max(1.0, offset)


UNIT_ROUNDOFF = 2.0**-53


def outside_the_stated_band(origin, end, centre, normal, radius):
    """What exact arithmetic answers, or None where the promise of crosses() leaves the answer open."""
    s, w = np.subtract(end, origin), np.subtract(centre, origin)
    across = sum(Fraction(a) * Fraction(b) for a, b in zip(s, normal, strict=True))
    height = sum(Fraction(a) * Fraction(b) for a, b in zip(w, normal, strict=True))
    length, away, size = (float(np.linalg.norm(v)) for v in (s, w, normal))
    near_plane = 8 * UNIT_ROUNDOFF * (away + length) * size
    if (
        abs(across) <= 8 * UNIT_ROUNDOFF * length * size
        or abs(height) <= near_plane
        or abs(height - across) <= near_plane
    ):
        return None
    rim = 32 * UNIT_ROUNDOFF * (away + radius) * length * size / abs(float(across))
    answers = {exact(origin, end, centre, normal, max(radius + sign * rim, 0.0)) for sign in (-1, 1)}
    return answers.pop() if len(answers) == 1 else None


def past_the_rim(generator, angle, radius, gap, offset):
    """A disc, and a segment at ``angle`` to its plane that passes gap times the radius outside its rim."""
    normal, first = generator.normal(size=(2, 3))
    normal /= np.linalg.norm(normal)
    first = np.cross(first, normal) / np.linalg.norm(np.cross(first, normal))
    turn = generator.uniform(0, 2 * np.pi)
    centre = offset + generator.uniform(-1, 1, 3)
    place = centre + radius * (1 + gap) * (np.cos(turn) * first + np.sin(turn) * np.cross(normal, first))
    onward = np.cos(angle) * first - np.sin(angle) * normal
    origin, end = place - generator.uniform(0.01, 1) * onward, place + generator.uniform(0.01, 1) * onward
    return origin, end, centre, normal, radius


# In a scene of size 1: angles with the disc's plane down to 1e-7 rad, radii from 1e-6 to 10, and passages from a
# rounding error to a whole radius beside the rim.
@settings(max_examples=600)
@given(
    seed=st.integers(0, 2**32),
    angle=st.floats(-7, 0),
    radius=st.floats(-6, 1),
    gap=st.floats(-16, 0),
    side=st.sampled_from([-1, 1]),
    offset=st.sampled_from([0.0, 1e3, 1e6]),
)
def test_the_answer_is_exact_outside_a_band_of_rounding(seed, angle, radius, gap, side, offset):
    case = past_the_rim(np.random.default_rng(seed), 10**angle, 10**radius, side * 10**gap, offset)
    expected = outside_the_stated_band(*case)
    assert expected is None or judged(*case) == expected


def test_the_band_leaves_few_answers_open():
    for angle, gap, radius in ((0.5, 1e-13, 1.0), (1e-3, 1e-10, 1.0), (1e-7, 1e-6, 1.0), (0.5, 1e-8, 1e-6)):
        for seed in range(50):
            for side in (-1, 1):
                case = past_the_rim(np.random.default_rng(seed), angle, radius, side * gap, 0.0)
                assert outside_the_stated_band(*case) == (side < 0)


@settings(max_examples=200)
@given(
    seed=st.integers(0, 2**32),
    axis=st.integers(0, 2),
    drop=st.floats(-7, 0),
    radius=st.floats(-6, 1),
    offset=st.sampled_from([0.0, 1e6]),
)
def test_a_segment_that_ends_or_begins_in_the_plane_of_an_upright_disc_crosses_it(seed, axis, drop, radius, offset):
    generator = np.random.default_rng(seed)
    radius, normal = 10**radius, np.eye(3)[axis]
    centre = offset + generator.uniform(-1, 1, 3)
    inside = centre + (1 - normal) * 0.5 * radius * generator.uniform(-1, 1, 3)
    aside = (1 - normal) * generator.uniform(-1, 1, 3)
    above, below = inside + aside + 10**drop * normal, inside + aside - 10**drop * normal
    if above[axis] == centre[axis] or below[axis] == centre[axis]:
        return
    assert judged(above, inside, centre, normal, radius)
    assert judged(inside, below, centre, normal, radius)
    assert not judged(below, inside, centre, normal, radius)
    # Within the plane nothing arrives from the front.
    assert not judged(inside + aside, inside - aside, centre, normal, radius)


@settings(max_examples=200)
@given(st.integers(0, 2**32), st.integers(-200, 200))
def test_scaling_by_a_power_of_two_changes_no_answer(seed, power):
    generator = np.random.default_rng(seed)
    origins, ends, centres, normals = generator.normal(size=(4, 50, 3))
    radii = generator.uniform(0.1, 2, 50)
    scaled = (np.ldexp(rows, power) for rows in (origins, ends, centres))
    hit = crosses(origins, ends, centres, normals, radii)
    assert np.array_equal(hit, crosses(*scaled, normals, np.ldexp(radii, power)))


@settings(max_examples=200)
@given(
    st.integers(0, 2**32),
    st.integers(0, 3),
    st.sets(st.integers(0, 2), min_size=1),
    st.sampled_from([np.nan, np.inf, -np.inf]),
)
def test_what_is_not_finite_never_crosses(seed, number, components, value):
    # An infinite radius is left to TangentDiscs, which refuses it.
    generator = np.random.default_rng(seed)
    rows = list(generator.normal(size=(4, 3)))
    rows[number][list(components)] = value
    with np.errstate(all="ignore"):
        assert not crosses(*rows, np.float64(1.0))


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
    hit = crosses(origins, ends, centres, normals, radii)
    segment, disc = (index.ravel() for index in np.indices(hit.shape))
    pairs = origins[segment, 0], ends[segment, 0], centres[disc], normals[disc]
    assert np.array_equal(hit.ravel(), crosses(*(np.asfortranarray(row) for row in pairs), radii[disc]))
