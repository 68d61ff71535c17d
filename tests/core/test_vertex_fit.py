"""Values at vertices are right for what faces show between them, whatever the vertices themselves see."""

import numpy as np
import pytest
from detp.core.fit.equations import Neighbours
from detp.core.fit.followed import PlacesLight, followed
from detp.core.fit.settled import Settled
from detp.core.fit.shown_faces import ShownFaces
from detp.core.fit.vertex_fit import VertexFit
from detp.core.irradiance import Irradiance


def plane(cells):
    """A square of one metre, ``cells`` quads along each side, and the positions of its vertices."""
    steps = np.arange(cells + 1)
    vertices = np.stack([*np.meshgrid(steps, steps, indexing="ij"), np.zeros((cells + 1,) * 2)], -1).reshape(-1, 3)
    first = (steps[:-1, None] * (cells + 1) + steps[:-1]).ravel()
    below, above = first + cells + 1, first + cells + 2
    triangles = np.concatenate([np.stack([first, below, above], 1), np.stack([first, above, first + 1], 1)])
    positions = vertices / cells
    normals = np.broadcast_to([0.0, 0.0, 1.0], (len(triangles), 3, 3))
    return ShownFaces(triangles, positions[triangles], normals, len(positions)), positions


def fitted(faces, light, noise=0.0, hidden=None, seed=0):
    """The fit to ``light`` (K,) of positions (K, 3), with that relative noise."""
    places = faces.drawn(seed)
    at = places.of(faces.corners)
    true = np.tile(light(at)[:, None], 3)
    error = noise * true
    value = true + error * np.random.default_rng(seed + 10).normal(size=(len(true), 1))
    buried = np.zeros(len(true), bool) if hidden is None else hidden(at)
    return VertexFit(faces, places).fitted(Irradiance(value, error), 1.0 - buried)


def test_places_lie_evenly_on_faces_and_near_every_value():
    faces, positions = plane(5)
    places = faces.drawn(3)
    at = places.of(faces.corners)
    assert places.weights.min() >= 0.0
    assert places.weights.sum(axis=1) == pytest.approx(1.0)
    assert places.area.sum() == pytest.approx(1.0, rel=0.02)
    assert np.einsum("k,kc->c", places.area, at)[:2] == pytest.approx([0.5, 0.5], abs=0.02)
    first = places.weights[: len(positions)]
    nearest = faces.values[places.triangle[: len(positions)], first.argmax(axis=1)]
    assert nearest.tolist() == list(range(len(positions)))


@pytest.mark.parametrize("cells", [1, 8])
def test_light_that_runs_evenly_over_a_plane_is_shown_as_it_is(cells):
    faces, positions = plane(cells)
    found = fitted(faces, lambda at: 1.0 + 2.0 * at[:, 0] + at[:, 1])
    assert found.known.all()
    assert found.light.value[:, 0] == pytest.approx(1.0 + 2.0 * positions[:, 0] + positions[:, 1], rel=0.03)


def test_a_wall_whose_corners_are_buried_shows_the_light_between_them():
    faces, _ = plane(1)
    inside = lambda at: (np.abs(at[:, :2] - 0.5).max(axis=1) < 0.35).astype(float)  # noqa: E731
    found = fitted(faces, inside, hidden=lambda at: inside(at) == 0.0)
    assert found.light.value == pytest.approx(1.0, rel=0.01)


def test_a_wall_that_reaches_into_the_dark_keeps_the_light_of_its_lit_part():
    faces, _ = plane(1)
    places = faces.drawn(1)
    lit = places.of(faces.corners)[:, 0] < 0.4
    shown = VertexFit(faces, places).fitted(
        Irradiance(*np.stack([lit, 0.0 * lit])[..., None] * np.ones(3)), np.ones(len(lit))
    )
    assert VertexFit(faces, places).shown(shown.light.value)[lit].min() > 0.5


def test_a_spot_hundreds_of_times_brighter_does_not_take_the_ceiling():
    faces, _ = plane(4)
    near = lambda at: np.linalg.norm(at - [0.4, 0.4, 0.0], axis=1) < 0.03  # noqa: E731
    found = fitted(faces, lambda at: np.where(near(at), 300.0, 1.0))
    assert np.quantile(found.light.value[:, 0], 0.9) == pytest.approx(1.0, rel=0.02)


def test_values_stay_among_those_that_were_found_around_them():
    faces, _ = plane(6)
    found = fitted(faces, lambda at: np.where(at[:, 0] < 0.47, 0.2, 1.0))
    assert found.light.value.min() >= 0.2 - 1e-9
    assert found.light.value.max() <= 1.0 + 1e-9


def test_an_edge_of_light_beyond_noise_stays_while_noise_is_taken_away():
    faces, positions = plane(20)
    step = lambda at: np.where(at[:, 0] < 0.5, 1.0, 4.0)  # noqa: E731
    found = fitted(faces, step, noise=0.05).light.value[:, 0]
    apart = np.abs(positions[:, 0] - 0.5) > 0.11
    off = found[apart] / step(positions)[apart] - 1.0
    assert np.abs(off).max() < 0.15
    assert np.sqrt(np.mean(off**2)) < 0.03


def test_what_is_dark_beside_light_is_black():
    faces, _ = plane(6)
    apart = ShownFaces(np.arange(len(faces.values) * 3).reshape(-1, 3), faces.corners, faces.normals, faces.values.size)
    left = faces.corners[..., 0].mean(axis=1) < 0.5
    places = apart.drawn(0)
    light = np.where(left[places.triangle], 0.0, 3.0)[:, None] * np.ones(3)
    shown = VertexFit(apart, places).fitted(Irradiance(light, 0.1 * light), np.ones(len(light))).light.value
    assert (shown.reshape(-1, 9)[left] == 0.0).all() and shown.reshape(-1, 9)[~left] == pytest.approx(3.0, rel=1e-3)


def test_noise_is_taken_away_where_light_runs_steeply():
    faces, positions = plane(20)
    steep = lambda at: 0.2 + 4.0 * at[:, 0]  # noqa: E731
    off = fitted(faces, steep, noise=0.15).light.value[:, 0] / steep(positions) - 1.0
    lit = positions[:, 0] > 0.2
    assert np.sqrt(np.mean(off[lit] ** 2)) < 0.04


def test_standard_errors_are_what_seeds_differ_by():
    faces, _ = plane(24)
    places = faces.drawn(0)
    true = np.tile(1.0 + places.of(faces.corners)[:, :1], 3)
    generator, fit = np.random.default_rng(5), VertexFit(faces, places)
    values = [
        fit.fitted(Irradiance(true * (1 + 0.06 * generator.normal(size=(len(true), 1))), 0.06 * true), true[:, 0] > 0)
        for _ in range(24)
    ]
    spread = np.std([found.light.value[:, 0] for found in values], axis=0, ddof=1)
    told = np.sqrt(np.mean([found.light.standard_error[:, 0] ** 2 for found in values], axis=0))
    assert np.sqrt(np.mean(spread**2)) == pytest.approx(np.sqrt(np.mean(told**2)), rel=0.15)


def test_parts_of_the_light_make_up_the_whole():
    faces, _ = plane(3)
    places = faces.drawn(2)
    x = places.of(faces.corners)[:, :1] * np.ones(3)
    nothing = np.zeros_like(x)
    fit = VertexFit(faces, places)
    whole, none = Irradiance(1.0 + 2.0 * x, nothing), np.ones(len(x))
    part = fit.fitted(whole, none, Irradiance(1.0 + 0.0 * x, nothing)).part
    rest = fit.fitted(whole, none, Irradiance(2.0 * x, nothing)).part
    assert part + rest == pytest.approx(fit.fitted(whole, none).light.value, rel=2e-3)


def test_noise_that_is_skewed_makes_no_bias():
    faces, _ = plane(16)
    places = faces.drawn(0)
    true, none = np.ones((len(places.area), 3)), np.ones(len(places.area))
    means = []
    for seed in range(4):
        noisy = np.random.default_rng(seed).gamma(25.0, 0.04, (len(true), 1)) * true
        means.append(VertexFit(faces, places).fitted(Irradiance(noisy, 0.2 * true), none).light.value.mean())
    assert np.mean(means) == pytest.approx(1.0, abs=0.005)


def walls(gap, light, width=4.0):
    """Two squares beside each other with a sliver of that width between; what they show along the edges there."""
    x = np.array([0.0, width, width + gap, 2.0 * width + gap])
    positions = np.stack([np.repeat(x, 2), np.tile([0.0, width], 4), np.zeros(8)], axis=1)
    quads = np.array([[0, 2, 3, 1], [2, 4, 5, 3], [4, 6, 7, 5]])
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    normals = np.broadcast_to([0.0, 0.0, 1.0], (6, 3, 3))
    return fitted(ShownFaces(triangles, positions[triangles], normals, 8), light).light.value[:, 0]


def test_faces_with_a_sliver_between_them_show_one_light_along_it():
    curved = lambda at: 2.0 + ((at[:, 0] - 2.5) / 3.0) ** 2  # noqa: E731
    shown = walls(0.004, curved)
    assert shown[4:6] == pytest.approx(shown[2:4], rel=0.01)


def test_faces_with_a_thin_wall_between_them_keep_their_own_light():
    shown = walls(0.004, lambda at: np.where(at[:, 0] < 4.002, 0.1, 2.0))
    assert shown[:4] == pytest.approx(0.1, rel=0.1)
    assert shown[4:] == pytest.approx(2.0, rel=0.1)


@pytest.mark.parametrize("light", [0.0, 1e-250, 1.0])
@pytest.mark.parametrize("weight", [1e-30, 1.0])
def test_equations_of_light_as_small_as_may_be_have_a_solution(light, weight):
    """Of two values that stand together: 2 x - y = light and 2 y - x = light."""
    matrix = Neighbours(np.array([(0, 1)]), 2).matrix(np.full(2, 2.0 * weight), np.array([-weight]))
    found = matrix.solved(np.full((2, 3), light * weight), np.zeros((2, 3)), 8)
    assert np.allclose(found, light, rtol=1e-5, atol=0.0)


@pytest.mark.parametrize("little", [1e-30, 1e-39, 1e-44])
def test_values_of_next_to_no_weight_beside_others_leave_those_right(little):
    """Of two pairs of values that have nothing in common, one weighs less than float32 can tell of the other."""
    weight, light = np.array([1.0, 1.0, little, little]), np.full(3, 3.0)
    matrix = Neighbours(np.array([(0, 1), (2, 3)]), 4).matrix(2.0 * weight, -weight[::2])
    found = matrix.solved(weight[:, None] * light, np.ones((4, 3)), 8)
    assert np.isfinite(found).all() and np.allclose(found[:2], light, rtol=1e-5)


def followed_and_fresh(faces, before, first, light, same, error=0.1):
    """Values that follow from ``first`` to another ``light``, (K,) of places of ``faces``, and a fit that begins with
    nothing; ``before`` was settled on the first one, at places which are the ``same``."""
    places = faces.drawn(0)
    fit, known = VertexFit(faces, places), np.ones(len(places.area))
    was, now = (np.tile(each(places.of(faces.corners))[:, None], 3) for each in (first, light))
    given = Irradiance(now, np.full_like(now, error))
    more = np.where((same >= 0)[:, None], now - was, now)
    found = followed(
        fit,
        before,
        same,
        PlacesLight(given, given, given, known, more, more, np.full(len(known), 3.0 * error), same < 0),
    )
    return found, fit.fitted(given, known, given), fit


def settled_on(faces, light, error=0.1):
    """Where a fit of ``light`` (K,) at places of ``faces`` settles."""
    places = faces.drawn(0)
    fit, known = VertexFit(faces, places), np.ones(len(places.area))
    value = np.tile(light(places.of(faces.corners))[:, None], 3)
    given = Irradiance(value, np.full_like(value, error))
    found = fit.fitted(given, known, given)
    return Settled(found.value, found.part, found.known, fit.placed, fit.left_of(found, given.standard_error))


def spot(middle):
    """Light with a hard edge around ``middle``, as a shadow has."""
    return lambda at: 0.5 + 2.0 * (np.linalg.norm(at[:, :2] - (middle, 0.5), axis=1) < 0.2)


def test_values_that_follow_a_spot_are_those_of_a_fit_that_begins_with_nothing():
    faces, positions = plane(24)
    same = np.arange(len(faces.drawn(0).area))
    before = settled_on(faces, spot(0.35))
    found, fresh, fit = followed_and_fresh(faces, before, spot(0.35), spot(0.5), same)
    moved = np.abs(fresh.value - before.value)
    assert moved.max() > 1.0
    assert np.abs(found.value - fresh.value).mean() < 0.02 * moved.mean()
    # Two standard errors of a place.
    assert np.abs(found.value - fresh.value).max() < 0.2
    assert np.abs(found.part - fresh.part).max() < 0.2
    left = fit.left_of(fresh, np.full((len(same), 3), 0.1))
    assert np.sqrt(np.mean(found.left**2)) == pytest.approx(np.sqrt(np.mean(left**2)), rel=0.1)
    # Far from both spots nothing is touched.
    far = positions[:, 1] > 0.95
    assert np.array_equal(found.value[far], before.value[far])


def test_values_follow_light_that_changes_by_less_than_it_is_off():
    faces, _ = plane(24)
    same = np.arange(len(faces.drawn(0).area))
    first, now = (lambda at, more=more: 1.0 + 0.2 * at[:, 0] + more for more in (0.0, 0.03))
    found, fresh, _ = followed_and_fresh(faces, settled_on(faces, first), first, now, same)
    assert found.value == pytest.approx(fresh.value, abs=2e-3)


def test_values_of_faces_that_are_new_are_those_of_a_fit_that_begins_with_nothing():
    faces, positions = plane(24)
    left = positions[:, 0] < 0.7
    some, _ = faces.of_values(left)
    places = faces.drawn(0)
    before = settled_on(some, spot(0.35))
    # Of the larger plane's places those are the same that show the same values; the others are new.
    number = np.where(left, np.cumsum(left) - 1, -1)[faces.values[places.triangle]]
    first = {tuple(row): place for place, row in reversed(list(enumerate(before.placed)))}
    same = np.array([first.get(tuple(row), -1) for row in number])
    assert (same < 0).any() and (same >= 0).any()
    found, fresh, _ = followed_and_fresh(faces, before, spot(0.35), spot(0.35), same)
    assert np.abs(found.value - fresh.value).mean() < 0.01
    assert np.isfinite(found.value).all() and found.known.all()


def test_few_rays_that_brought_much_leave_no_spots_where_values_follow():
    faces, _ = plane(24)
    places = faces.drawn(0)
    before, fit, known = (
        settled_on(faces, lambda at: np.ones(len(at))),
        VertexFit(faces, places),
        np.ones(len(places.area)),
    )
    value, error = np.ones((len(known), 3)), np.full((len(known), 3), 0.1)
    value[::97], error[::97] = 4.0, 3.0
    given = Irradiance(value, error)
    now = PlacesLight(given, given, given, known, value - 1.0, value - 1.0, np.full(len(known), 0.3), known < 0)
    found, fresh = followed(fit, before, np.arange(len(known)), now), fit.fitted(given, known, given)
    assert np.abs(found.value - fresh.value).max() < 0.1
    assert found.value.max() < 1.3
