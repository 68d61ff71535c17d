"""The standard error can be trusted: over repeated seeds 95 % intervals hold the converged value in 93 to 97 %."""

import calibration
import pytest
from detp.core.estimator import repeated_crossings

SEEDS = 80


def assert_calibrated(found: calibration.Coverage):
    # Three standard errors of the measured share, which seeds alone make: points of one bake share their photons.
    assert 0.93 - 3 * found.doubt < found.sums < 0.97 + 3 * found.doubt, found
    assert found.doubt < 0.02, found


@pytest.mark.parametrize(
    "subject, share, photons, settings",
    [
        ("furnace, albedo 0.8", 0.1, 2_500, {}),
        ("furnace, albedo 0.8", 0.3, 700, {"estimator": "plain"}),
        ("Cornell box", 0.1, 3_000, {}),
        ("outdoors, sun and sky", 0.1, 9_000, {}),
        ("outdoors, sun and sky", 0.3, 4_000, {"direct": "shadow-rays"}),
    ],
)
def test_intervals_hold_the_converged_value_as_often_as_they_say(subject, share, photons, settings):
    place = calibration.SUBJECTS[subject](points=40)
    radius = share * place.scene.bounds.radius
    settings = {"direct": "photons", "indirect": "photons", "radius": radius, "photons": photons} | settings
    found = calibration.coverage(*calibration.repeated(place, SEEDS, **settings), spread=2.0)
    assert found.crossings > 20
    assert_calibrated(found)


def test_a_disc_as_large_as_the_room_is_crossed_by_the_same_particles_again_and_again(monkeypatch):
    place = calibration.furnace(points=25)
    settings = {"radius": 0.6 * place.scene.bounds.radius, "photons": 300, "direct": "photons", "indirect": "photons"}
    found = calibration.coverage(*calibration.repeated(place, SEEDS, **settings))
    assert_calibrated(found)
    # What this takes away: without it the error is far too small.
    monkeypatch.setattr(repeated_crossings.RepeatedCrossings, "_hold", lambda self, crossings: None)
    alone = calibration.coverage(*calibration.repeated(place, SEEDS, **settings))
    assert alone.sums < 0.9 < found.sums
    assert alone.variance < 0.85 < 0.92 < found.variance


@pytest.mark.parametrize("subject, quality", [("furnace, albedo 0.8", "draft"), ("outdoors, sun and sky", "preview")])
def test_the_light_that_shadow_rays_bring_has_an_honest_error_too(subject, quality):
    place = calibration.SUBJECTS[subject](points=40)
    settings = {"indirect": "off", "direct": "shadow-rays", "quality": quality, "radius": 0.1}
    assert_calibrated(calibration.coverage(*calibration.repeated(place, SEEDS, **settings)))
