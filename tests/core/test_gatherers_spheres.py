"""Sphere Cache: the plan against the study's walk from disc to disc, and the test of segments against spheres."""

import numpy as np
import pytest
from detp.core.gatherers.sphere_cache import meets
from detp.core.gatherers.sphere_cache_plan import SpherePlan, sphere_starts
from detp.core.space_filling import curve_order


def studied_walk(centres, radii, radius_of_level):
    """The study's loop: which spheres (level, first disc, centre) are made while walking the discs in order."""
    made, current = [], {}
    for row, (centre, disc) in enumerate(zip(centres, radii, strict=True)):
        for level, radius in enumerate(radius_of_level, start=1):
            if disc > radius:  # it cannot be held from here on inwards
                current = {key: value for key, value in current.items() if key < level}
                break
            held = level in current and np.sqrt(((centre - current[level]) ** 2).sum()) + disc <= radius
            if not held:
                current = {key: value for key, value in current.items() if key < level}
                for inner, inner_radius in enumerate(radius_of_level[level - 1 :], start=level):
                    if disc > inner_radius:
                        break
                    current[inner] = centre
                    made.append((inner, row))
                break
    return sorted(made)


def level_of(plan):
    level = np.zeros(len(plan.radius), int)
    for sphere in range(len(plan.radius)):
        level[plan.child[sphere] : plan.child[sphere] + plan.children[sphere]] = level[sphere] + 1
    return level


@pytest.mark.parametrize("spread", [0.0, 0.7])
@pytest.mark.parametrize("q", [0.4, 0.62, 0.85])
def test_the_plan_makes_the_spheres_of_the_studys_walk(q, spread):
    generator = np.random.default_rng(1)
    centres = generator.uniform(-1, 1, (600, 3)) * [1, 1, 0.1]
    centres = centres[curve_order(centres)]
    radii = 0.03 * np.exp(spread * generator.normal(size=600))
    plan = SpherePlan.of(centres, radii, q, 0.05)
    level = level_of(plan)
    finite = np.isfinite(plan.radius)
    radius_of_level = plan.radius[0] * q ** np.arange(1, level[finite].max() + 1)
    assert np.allclose(plan.radius[finite], plan.radius[0] * q ** level[finite])
    assert radius_of_level[-1] >= 0.05 > radius_of_level[-1] * q
    made = [(int(level[sphere]), int(plan.begin[sphere])) for sphere in np.flatnonzero(finite & (level > 0))]
    assert sorted(made) == studied_walk(centres, radii, radius_of_level)


def test_every_sphere_holds_the_discs_that_it_serves_and_all_are_served():
    generator = np.random.default_rng(2)
    centres = generator.normal(size=(3000, 3))
    radii = 0.05 * np.exp(generator.normal(size=3000))
    plan = SpherePlan.of(centres, radii, 0.6, 0.1)
    served = np.zeros(3000, int)
    for sphere in range(len(plan.radius)):
        rows = slice(plan.begin[sphere], plan.end[sphere])
        away = np.linalg.norm(centres[rows] - plan.centre[sphere], axis=1)
        assert (away + radii[rows] <= plan.radius[sphere] * (1 + 1e-12)).all()
        children = slice(plan.child[sphere], plan.child[sphere] + plan.children[sphere])
        if plan.children[sphere]:
            assert plan.begin[children][0] == plan.begin[sphere] and plan.end[children][-1] == plan.end[sphere]
            assert (plan.begin[children][1:] == plan.end[children][:-1]).all()
        else:
            served[rows] += 1
    assert (served == 1).all()


def test_starts_do_not_depend_on_how_many_rows_are_scanned_together(monkeypatch):
    generator = np.random.default_rng(3)
    centres, radii = np.cumsum(generator.normal(size=(2000, 3)), axis=0) * 0.05, generator.uniform(0.01, 0.4, 2000)
    begin, end = np.array([0, 700, 701, 1200]), np.array([700, 701, 1200, 2000])
    expected = sphere_starts(centres, radii, begin, end, 0.3)
    for scanned in (1, 100, 10_000):
        monkeypatch.setattr("detp.core.gatherers.sphere_cache_plan.SCANNED", scanned)
        assert np.array_equal(sphere_starts(centres, radii, begin, end, 0.3), expected)


def test_no_sphere_loses_a_segment_that_meets_it():
    generator = np.random.default_rng(4)
    count = 20_000
    centre = generator.uniform(0, 1000, (count, 3))
    radius = 10.0 ** generator.uniform(-2, 3, count)
    toward = generator.normal(size=(2, count, 3))
    axis, side = toward / np.linalg.norm(toward, axis=2)[:, :, None]
    side -= (side * axis).sum(axis=1)[:, None] * axis
    side /= np.linalg.norm(side, axis=1)[:, None]
    # The closest point to the centre lies at this share of the radius, beside the segment's middle or at its end.
    share = generator.choice([0.999, 0.5, 1.5], count)
    nearest = centre + (share * radius)[:, None] * side
    reach = generator.uniform(0, 700, (2, count, 1)) * generator.integers(0, 2, (2, count, 1))
    start, end = nearest - reach[0] * axis, nearest + reach[1] * axis
    step = (end - start).astype(np.float32).T
    length = np.maximum((step * step).sum(axis=0), np.finfo(np.float32).tiny)
    rays = np.concatenate([start.astype(np.float32).T, step, 1 / length[None]])
    met = meets(
        rays, centre.astype(np.float32).T[:, None], ((radius * (1 + 1e-5) + 8e-3) ** 2).astype(np.float32)[None]
    )
    assert met[0, share < 1].all()
    assert not met[0, (share == 1.5) & (radius > 0.1)].any()
