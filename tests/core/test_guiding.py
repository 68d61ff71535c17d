"""Aimed lights: whatever was learnt the light is the same, and where there is nothing to learn nothing changes."""

import numpy as np
import pytest
from detp.core import parallel
from detp.core.discs import TangentDiscs
from detp.core.estimator.visible_area import whole_discs
from detp.core.gatherers.choose import make_gatherer
from detp.core.lights.light import EMISSION_DIMENSIONS
from detp.core.lights.point import PointLight
from detp.core.lights.sun import SunLight
from detp.core.lights.world import UniformWorld
from detp.core.photons import guiding
from detp.core.photons.emission_guide import EmissionGuide
from detp.core.photons.emission_tree import grown
from detp.core.photons.photon_light import PhotonLight, PhotonSearch
from detp.core.photons.tracing import PhotonTracer
from detp.core.rays import RayCaster
from detp.core.stages import Stopwatch, finished
from rooms import box_quads, face_points, scene_of
from scipy import stats

RADIUS = 0.35
#: so many that the pilot teaches something, and yet is quick
PARTICLES = 16 << 15


def hut():
    """A grey room of 3 m with a window of 1 m in its roof, under a sky and a sun."""
    floor, _, *walls = box_quads((3, 3, 3))
    corners = {name: np.array([(x, y, 3.0) for x, y in places], float) for name, places in {
        "left": [(0, 0), (0, 3), (1.0, 3), (1.0, 0)], "right": [(2.0, 0), (2.0, 3), (3, 3), (3, 0)],
        "near": [(1.0, 0), (1.0, 1.0), (2.0, 1.0), (2.0, 0)], "far": [(1.0, 2.0), (1.0, 3), (2.0, 3), (2.0, 2.0)],
    }.items()}  # fmt: skip
    quads = [floor, *walls, *corners.values()]
    lights = (UniformWorld((0.5, 0.7, 1.0)), SunLight((0.3, 0.2, -1), (2.0, 1.9, 1.8), 0.01))
    return scene_of(quads, 0.6, lights=lights), np.array([floor, *walls])


def furnace():
    quads = box_quads((2, 2, 2))
    return scene_of(quads, 0.5, 0.5 / np.pi), quads


class Setting:
    """A tracer, the discs on ``quads`` and a search over them; indirect light alone is looked for."""

    def __init__(self, scene, quads):
        caster = RayCaster(scene.corners)
        points, normals = face_points(quads, across=3)
        (self.placed,) = whole_discs(TangentDiscs.of_radius(points, normals, RADIUS))
        self.tracer = PhotonTracer(scene, caster, scene.bounds.expanded(2 * RADIUS), 64, direct=False)
        self.gatherer, _ = make_gatherer("brute-force", self.placed.discs)

    def learnt(self, particles=PARTICLES, seed=1) -> EmissionGuide:
        dark = np.zeros((len(self.placed.discs), 3))
        return finished(guiding.learn_guide(self.tracer, self.gatherer, self.placed, "indirect", dark, seed, particles))

    def light(self, guide, seeds, particles=10_000):
        """Irradiance of each disc, (seeds, N), and its standard error, RGB sums."""
        found = []
        for seed in seeds:
            search = PhotonSearch("indirect", self.placed)
            search.gatherer = self.gatherer
            photons = PhotonLight(self.tracer, [search], seed)
            photons.aim(guide)
            for _ in photons.batch(particles, Stopwatch("trace", "gather")):
                pass
            found.append(search.estimate.irradiance)
        return np.array([part.value.sum(axis=1) for part in found]), np.array(
            [part.standard_error.sum(axis=1) for part in found]
        )


def arbitrary_guide(tracer):
    """A guide that follows from nothing: what its particles are said to be of use for is drawn by lot."""
    generator = np.random.default_rng(8)
    draws = tracer.guide.draws(4000, generator)
    use = generator.exponential(size=4000) * (draws.uniforms[:, 2] > 0.6)
    return grown(draws, use, np.ones(4000), np.zeros(4000, bool), tracer.guide).guide(0.25)


def test_boxes_fill_each_light_once_and_probabilities_add_up_to_one():
    tracer = Setting(*hut()).tracer
    guide = arbitrary_guide(tracer)
    assert len(guide.light) > 50
    assert guide.chance.sum() == pytest.approx(1, abs=1e-12)
    assert np.bincount(guide.light, guide.natural) == pytest.approx(tracer.guide.natural, abs=1e-12)
    volume = (guide.upper - guide.lower).prod(axis=1)
    assert guide.natural == pytest.approx(volume * tracer.guide.natural[guide.light])
    assert (guide.chance >= 0.25 * guide.natural * (1 - 1e-12)).all()
    places = np.random.default_rng(3).random((500, 1, EMISSION_DIMENSIONS))
    inside = ((places >= guide.lower) & (places < guide.upper)).all(axis=2)
    for light in range(len(tracer.guide.light)):
        assert (inside[:, guide.light == light].sum(axis=1) == 1).all()


def test_draws_lie_in_their_boxes_as_often_as_the_guide_says():
    tracer = Setting(*hut()).tracer
    guide = arbitrary_guide(tracer)
    draws = guide.draws(10_000, np.random.default_rng(4))
    assert (np.diff(draws.light) >= 0).all()
    inside = (draws.uniforms[:, None] >= guide.lower) & (draws.uniforms[:, None] < guide.upper)
    inside = inside.all(axis=2) & (draws.light[:, None] == guide.light)
    assert (inside.sum(axis=1) == 1).all()
    assert np.abs(inside.sum(axis=0) - 10_000 * guide.chance).max() <= 1
    assert draws.density == pytest.approx((guide.chance / guide.natural)[inside.argmax(axis=1)])
    assert (1 / draws.density).mean() == pytest.approx(1, abs=len(guide.light) / 10_000)


@pytest.mark.parametrize("make", [hut, furnace])
def test_any_guide_gives_the_same_light(make):
    setting = Setting(*make())
    by_power, _ = setting.light(setting.tracer.guide, range(24))
    aimed, _ = setting.light(arbitrary_guide(setting.tracer), range(100, 124))
    assert stats.ttest_ind(by_power.mean(axis=1), aimed.mean(axis=1), equal_var=False).pvalue > 0.001
    each = stats.ttest_ind(by_power, aimed, equal_var=False).pvalue
    assert each.min() > 0.001 / by_power.shape[1]


def test_an_aimed_furnace_still_reads_one():
    setting = Setting(*furnace())
    values, _ = setting.light(arbitrary_guide(setting.tracer), range(24))
    # Half of it is direct light, which is not traced.
    assert stats.ttest_1samp(values.mean(axis=1), 3 * 0.5).pvalue > 0.001


def test_light_aimed_at_a_window_has_less_noise_and_the_same_mean():
    setting = Setting(*hut())
    guide = setting.learnt()
    by_power, _ = setting.light(setting.tracer.guide, range(24))
    aimed, errors = setting.light(guide, range(100, 124))
    assert stats.ttest_ind(by_power.mean(axis=1), aimed.mean(axis=1), equal_var=False).pvalue > 0.001
    assert np.median(by_power.var(axis=0, ddof=1) / aimed.var(axis=0, ddof=1)) > 4
    assert np.median((errors**2).mean(axis=0) / aimed.var(axis=0, ddof=1)) > 0.8


def test_a_lamp_that_lights_nothing_gets_few_particles():
    room = box_quads((2, 2, 2))
    outside = PointLight((5, 1, 1), (10.0, 10.0, 10.0))
    setting = Setting(scene_of(room, 0.6, lights=(PointLight((1, 1, 1), (1.0, 1.0, 1.0)), outside)), room)
    guide = setting.learnt()
    shares = np.bincount(guide.light, guide.chance)
    assert setting.tracer.guide.chance == pytest.approx([1 / 11, 10 / 11])
    assert shares[0] > 0.6


def test_where_nothing_is_to_be_gained_the_lights_are_left_as_they_are():
    room = box_quads((2, 2, 2))
    setting = Setting(scene_of(room, 0.6, lights=(PointLight((1, 1, 1), (1.0, 1.0, 1.0)),)), room)
    assert setting.learnt() is setting.tracer.guide


def test_few_particles_teach_nothing():
    setting = Setting(*hut())
    assert setting.learnt(particles=guiding.LEAST_PILOT) is setting.tracer.guide


def test_a_scene_whose_discs_no_light_reaches_teaches_nothing():
    room = box_quads((2, 2, 2))
    setting = Setting(scene_of(room, 0.0, lights=(PointLight((1, 1, 1), (1.0, 1.0, 1.0)),)), room)
    assert setting.learnt() is setting.tracer.guide


def test_the_guide_does_not_depend_on_the_number_of_threads(monkeypatch):
    setting = Setting(*hut())
    guides = []
    for workers in (1, 3):
        monkeypatch.setattr(parallel, "worker_count", lambda workers=workers: workers)
        guides.append(setting.learnt())
    for name in ("light", "lower", "upper", "natural", "chance"):
        assert np.array_equal(getattr(guides[0], name), getattr(guides[1], name))


def test_held_crossings_are_bounded(monkeypatch):
    setting = Setting(*hut())
    monkeypatch.setattr(guiding, "MOST_HELD", 1000)
    guide = setting.learnt()
    assert len(guide.light) > 2
    assert guide.chance.sum() == pytest.approx(1)
