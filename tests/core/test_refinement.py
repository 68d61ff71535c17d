"""What a bake does next: where the noise is, until what was asked for is reached."""

import time
from types import SimpleNamespace

import numpy as np
import pytest
from detp.core import refinement, stop_rule
from detp.core.bake import bake
from detp.core.irradiance import Irradiance
from detp.core.lights.world import UniformWorld
from detp.core.points import Points
from detp.core.refinement import (
    FIRST_PHOTONS,
    FIRST_ROUNDS,
    Refinement,
    Step,
    _weights,
    first_rounds,
    look_in_every,
)
from detp.core.settings import NOISE_SHARE, BakeSettings
from detp.core.stages import Stopwatch
from detp.core.stop_rule import AIMED_AFTER, DARK_AFTER, MORE_RAYS, MOST_ROUNDS
from rooms import box_quads, face_points, scene_of

POINTS = 1000


class Bake:
    """Made-up light whose noise falls as it does: at every point 1 W/m^2 directly, and 1 W/m^2 by photons."""

    def __init__(self, settings, ray_noise=0.5, photon_noise=100.0, rays=True, photons=True, lit=True, cells=0):
        rays_of_points = {
            "rays_per_round": 8 * POINTS,
            "points": POINTS,
            "rays": 0,
            "around_each": lambda values: values,
        }
        self.direct = SimpleNamespace(done=0, exact=False, **rays_of_points) if rays else None
        self.photons = SimpleNamespace(particles=0, segments=0, crossings=0) if photons else None
        self.noises, self.lit = (ray_noise, photon_noise), lit
        self.stopwatch = Stopwatch("shadow", "trace", "gather")
        self.settings, self.start = settings, time.perf_counter()
        self.refinement = Refinement(settings, self.direct, self.photons, self.stopwatch, self.start, cells)
        self.steps = []

    def light(self, noise, amount):
        value = np.full((POINTS, 3), float(self.lit and amount > 0))
        return Irradiance(
            value, np.full((POINTS, 3), noise / np.sqrt(amount)) if amount else np.full((POINTS, 3), np.inf)
        )

    def observed(self):
        parts = []
        for part, noise, name in ((self.direct, self.noises[0], "done"), (self.photons, self.noises[1], "particles")):
            parts.append(Irradiance.dark(POINTS) if part is None else self.light(noise, getattr(part, name)))
        light = parts[0] + parts[1]
        self.refinement.observe(*parts, light, light.relative_error)
        return light.relative_error

    def run(self, most=500):
        error, first = float("nan"), []
        if self.direct is not None and self.direct.done == 0:
            first = [Step(rounds=first_rounds(self.direct, self.settings, self.start))]
        while (step := first.pop() if first else self.refinement.next()) is not None:
            assert len(self.steps) < most
            self.steps.append(step)
            if step.rounds:
                self.direct.done += step.rounds
                self.stopwatch.seconds["shadow"] += 1e-3 * step.rounds
            else:
                self.photons.particles += step.photons
                self.photons.segments += step.photons
                self.photons.crossings += step.photons
                self.stopwatch.seconds["trace"] += 1e-7 * step.photons
            error = self.observed()
        return error


def test_first_a_little_of_both():
    bake = Bake(BakeSettings(error=0.02))
    bake.run()
    assert bake.steps[:2] == [Step(rounds=FIRST_ROUNDS), Step(photons=FIRST_PHOTONS)]


@pytest.mark.parametrize("error", [0.1, 0.05, 0.02])
def test_the_error_is_reached_and_hardly_passed(error):
    found = Bake(BakeSettings(error=error), photon_noise=200.0).run()
    assert 0.5 * error < found <= NOISE_SHARE * error


def test_work_goes_where_the_noise_is():
    noisy_rays, noisy_photons = (Bake(BakeSettings(error=0.02), *noises) for noises in ((1.0, 10.0), (0.1, 300.0)))
    noisy_rays.run()
    noisy_photons.run()
    ratios = [bake.direct.done / bake.photons.particles for bake in (noisy_rays, noisy_photons)]
    # At the least cost, rounds over photons are as the roots of the variances over the costs, up to doubled steps.
    best = np.sqrt((1.0 / 0.1) ** 2 * (300.0 / 10.0) ** 2)
    assert best / 4 < ratios[0] / ratios[1] < best * 4


def test_so_many_photons_and_no_more():
    bake = Bake(BakeSettings(photons=100_000), ray_noise=5.0)
    bake.run()
    assert bake.photons.particles == 100_000
    # The rays end when what they would save costs more than the last photons did.
    assert FIRST_ROUNDS < bake.direct.done <= MOST_ROUNDS


def test_so_many_photons_that_leave_next_to_no_noise_do_not_keep_rays_going():
    bake = Bake(BakeSettings(photons=1000), photon_noise=1e-4)
    error = bake.run()
    goal = stop_rule.FINE * NOISE_SHARE * bake.settings.target_error
    assert 0.5 * goal < error <= goal and bake.direct.done < MOST_ROUNDS


@pytest.mark.parametrize(("error", "goes_on"), [(0.138, False), (0.11, True)])
def test_rays_end_when_twice_as_many_hardly_bring_the_error_down_and_no_photons_are_left(error, goes_on):
    bake = Bake(BakeSettings(error=0.05, photons=5000), ray_noise=0.5, photon_noise=6.0, cells=100)
    bake.photons.particles, bake.refinement._due = 5000, 0
    bake.photons.segments = bake.photons.crossings = 5000
    for rounds, found in ((16, 0.14), (32, error)):
        bake.direct.done = rounds
        parts = bake.light(0.5, rounds), bake.light(6.0, 5000)
        bake.refinement.observe(*parts, parts[0] + parts[1], found)
        assert (bake.refinement.next() is not None) == (rounds == 16 or goes_on)


def test_an_error_out_of_reach_ends_with_the_photons():
    bake = Bake(BakeSettings(error=0.01, photons=50_000), photon_noise=1000.0)
    assert bake.run() > 0.01 and bake.photons.particles == 50_000


def test_when_rays_cannot_do_more_photons_are_not_sent_for_nothing():
    bake = Bake(BakeSettings(error=0.01), ray_noise=10.0)
    assert bake.run() > 0.01
    assert bake.direct.done == MOST_ROUNDS and bake.photons.particles < 10_000_000


def test_rays_alone_and_photons_alone():
    assert Bake(BakeSettings(error=0.05, indirect="off"), photons=False).run() <= 0.05
    assert Bake(BakeSettings(error=0.05, direct="photons"), rays=False).run() <= 0.05


def test_exact_light_needs_one_round():
    bake = Bake(BakeSettings(error=0.05, indirect="off"), ray_noise=0.0, photons=False)
    bake.direct.exact = True
    bake.run()
    assert bake.steps == [Step(rounds=1)]


def test_points_that_are_sure_do_not_vouch_for_others():
    errors = np.r_[np.zeros(900), np.full(100, 0.06)]
    light = Irradiance(np.ones((1000, 3)), errors[:, None] * np.ones(3))
    assert light.relative_error == 0.0
    unsure = light.error_among(light.doubtful)
    assert unsure == pytest.approx(0.6745 * 0.06, rel=1e-3)
    bake = Bake(BakeSettings("final", indirect="off"), photons=False)
    bake.direct.done = FIRST_ROUNDS
    bake.refinement.observe(light, Irradiance.dark(1000), light, unsure)
    assert bake.refinement.next() is not None
    # One in a thousand changes nothing.
    few = Irradiance(light.value, np.where(np.arange(1000) == 999, 0.06, 0.0)[:, None] * np.ones(3))
    assert few.doubtful.all()


@pytest.mark.parametrize(("error", "goes_on"), [(0.2, False), (0.6, True)])
def test_where_light_is_hard_to_find_half_as_many_rays_again_are_enough_unless_it_is_far_off(error, goes_on):
    errors = np.where(np.arange(POINTS) < 0.8 * POINTS, 0.01, error)
    light, bake = Irradiance(np.ones((POINTS, 3)), errors[:, None] * np.ones(3)), Bake(BakeSettings(error=0.05))
    refinement = Refinement(bake.settings, bake.direct, None, bake.stopwatch, bake.start)
    for bake.direct.done, bake.direct.rays in ((16, 1000), (24, 1400), (32, 1600)):
        refinement.observe(light, Irradiance.dark(POINTS), light, light.relative_error)
        assert refinement.rule.missing.sum() == 0.2 * POINTS
        assert (refinement.next() is not None) == (goes_on or bake.direct.rays <= MORE_RAYS * 1000)


@pytest.mark.parametrize(("common", "goes_on"), [(0.03, False), (0.06, True)])
def test_a_tenth_of_the_points_whose_light_photons_leave_off_alike_keeps_a_bake_going(common, goes_on):
    """They are well within what rays may leave at single points, but all of a wall is off by as much."""
    off = np.where(np.arange(POINTS) < 0.1 * POINTS, common, 0.0)
    by_rays, by_photons = (
        Irradiance(np.ones((POINTS, 3)), np.ones((POINTS, 3)) * error) for error in (0.01, off[:, None])
    )
    light = Irradiance(by_rays.value, np.hypot(by_rays.standard_error, by_photons.standard_error))
    bake = Bake(BakeSettings(error=0.04))
    bake.direct.done, bake.photons.particles = AIMED_AFTER, FIRST_PHOTONS
    refinement = Refinement(bake.settings, bake.direct, bake.photons, bake.stopwatch, bake.start, cells=100)
    refinement._due = 0
    refinement.observe(by_rays, by_photons, light, light.relative_error)
    assert (refinement.next() is not None) == goes_on
    if goes_on:
        bake.photons.particles, bake.direct.done = 1 << 22, AIMED_AFTER + refinement.next().rounds
        refinement.observe(by_rays, by_photons, light, light.relative_error)
        assert refinement.next() is None, "enough photons are enough"


def test_what_single_rays_light_later_does_not_keep_a_bake_from_ending(monkeypatch):
    """Sunk into a floor in the open lies a box with a lid that has a hole: at first hardly any ray gets in."""
    monkeypatch.setattr(stop_rule, "FINE", 0.0)  # so that it goes on for long enough
    floor = [(-4, -4, 2), (4, -4, 2), (4, 4, 2), (-4, 4, 2)]
    bottom, _, *walls = box_quads((1, 1, 1))
    hole = 0.02
    lid = [
        [(0, 0, 1), (0, 1, 1), (0.5 - hole, 1, 1), (0.5 - hole, 0, 1)],
        [(0.5 + hole, 0, 1), (0.5 + hole, 1, 1), (1, 1, 1), (1, 0, 1)],
        [(0.5 - hole, 0, 1), (0.5 - hole, 0.5, 1), (0.5 + hole, 0.5, 1), (0.5 + hole, 0, 1)],
        [(0.5 - hole, 0.5 + hole, 1), (0.5 - hole, 1, 1), (0.5 + hole, 1, 1), (0.5 + hole, 0.5 + hole, 1)],
    ]
    quads = np.array([floor, bottom, *walls, *lid], float)
    scene = scene_of(quads, 0.3, lights=(UniformWorld((1.0, 1.0, 1.0)),))
    places = [face_points(part, across) for part, across in ((quads[:1], 6), (quads[1:6], 4))]
    points = Points(*(np.concatenate(part) for part in zip(*places, strict=True)))
    steps, found = bake(scene, points, BakeSettings(photons=1 << 15)), []
    while True:
        try:
            step = next(steps)
        except StopIteration as end:
            last = end.value
            break
        if step.found is not None and np.isfinite(step.found.seen.standard_error).all():
            found.append(step.found)
    assert len(found) > 1
    assert all(np.array_equal(each.doubtful, last.doubtful) for each in found)
    lit = last.irradiance.any(axis=1)
    assert np.count_nonzero(lit & ~last.doubtful) > 3
    assert last.ending_error < last.relative_error


def test_records_that_photons_do_not_mend_are_given_up():
    """Two records of a cell, one of them in a gap that shines, differ whatever lights them."""
    bake = Bake(BakeSettings("final"))
    refinement = Refinement(bake.settings, bake.direct, bake.photons, bake.stopwatch, bake.start, cells=100)
    bake.direct.done, steps = FIRST_ROUNDS, 0
    while steps < 100:
        by_rays, by_photons = bake.light(0.05, bake.direct.done), bake.light(0.1, min(bake.photons.particles, 1))
        light = by_rays + by_photons
        refinement.observe(by_rays, by_photons, light, light.relative_error)
        step = refinement.next()
        if step is None:
            break
        bake.direct.done += step.rounds
        bake.photons.particles += step.photons
        steps += 1
    assert steps < 100 and bake.photons.particles <= 16 * FIRST_PHOTONS


def test_darkness_is_given_up():
    bake = Bake(BakeSettings(error=0.01), lit=False)
    bake.run()
    assert DARK_AFTER <= bake.photons.particles <= 4 * DARK_AFTER


def test_a_time_that_is_over_still_brings_some_light():
    settings = BakeSettings(seconds=1e-6)
    bake = Bake(settings)
    bake.run()
    assert bake.steps[0].rounds >= 2 and bake.steps[1].photons > 0 and len(bake.steps) == 2
    assert bake.refinement.fraction == 1.0


def test_a_step_that_would_not_end_in_time_is_smaller():
    bake = Bake(BakeSettings(seconds=60.0), photon_noise=1e4)
    for _ in range(4):
        step = bake.refinement.next()
        if step.rounds:
            bake.direct.done += step.rounds
            bake.stopwatch.seconds["shadow"] += step.rounds * 1e-3
        else:
            bake.photons.particles += step.photons
            bake.photons.segments += step.photons
            bake.stopwatch.seconds["trace"] += step.photons * 1e-4
        bake.observed()
    left = 60.0
    assert bake.refinement.next().photons * 1e-4 <= left


def test_outlines_are_looked_at_sparsely_only_when_time_is_short():
    now = time.perf_counter()
    assert look_in_every(BakeSettings(seconds=10.0), 0.1, now) == 1
    assert look_in_every(BakeSettings(seconds=10.0), 1.5, now) > 1
    assert look_in_every(BakeSettings(seconds=10.0), 0.1, now - 9.0) > 1
    assert look_in_every(BakeSettings(error=0.05), 100.0, now) == 1


def test_photons_whose_noise_no_longer_falls_give_way_to_rays(monkeypatch):
    def rounds_before_the_last_photons():
        bake = Bake(BakeSettings(error=0.001, photons=64 * FIRST_PHOTONS))
        plain, ray_noise = bake.light, bake.noises[0]
        bake.light = lambda noise, amount: plain(
            noise, amount if noise == ray_noise else min(amount, 2 * FIRST_PHOTONS)
        )
        bake.run()
        last = max(number for number, step in enumerate(bake.steps) if step.photons)
        return sum(step.rounds for step in bake.steps[:last])

    learnt = rounds_before_the_last_photons()
    monkeypatch.setattr(refinement, "LEAST_WORTH", 1.0)
    assert learnt > 2 * rounds_before_the_last_photons()


def test_points_count_as_much_as_the_median_error_depends_on_them():
    generator = np.random.default_rng(5)
    errors = generator.lognormal(-3.0, 1.0, 4000)

    def median(errors):
        light = np.ones((len(errors), 3))
        return Irradiance(light, errors[:, None] * light).relative_error

    weights = _weights(errors, median(errors))
    for some in (errors < 0.03, (errors > 0.03) & (errors < 0.1), errors > 0.1):
        rise = np.where(some, 1e-4, 0.0)
        slope = (median(np.sqrt(errors**2 + rise)) - median(np.sqrt(np.maximum(errors**2 - rise, 0)))) / 2
        everywhere = (median(np.sqrt(errors**2 + 1e-4)) - median(np.sqrt(np.maximum(errors**2 - 1e-4, 0)))) / 2
        assert slope / everywhere == pytest.approx(weights[some].sum() / weights.sum(), abs=0.05)
