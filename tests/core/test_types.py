"""The central types refuse what they cannot hold, in one clear sentence, and keep what they were given."""

import numpy as np
import pytest
from detp.core.bounds import Bounds
from detp.core.discs import TangentDiscs
from detp.core.errors import DetpError, InvalidArrayError, InvalidSettingError, NoMeshError
from detp.core.scene import Scene
from detp.core.segments import Segments
from detp.core.settings import GATHERERS, QUALITIES, BakeSettings

TRIANGLE = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0)], float)


def scene(**changes):
    values = {
        "vertices": TRIANGLE,
        "triangles": [(0, 1, 2)],
        "albedo": [(0.5, 0.5, 0.5)],
        "emission": [(0, 0, 0)],
        "transmittance": [(0, 0, 0)],
    }
    return Scene(**(values | changes))


def test_a_scene_keeps_its_arrays_read_only_and_as_float64():
    held = scene(vertices=TRIANGLE.astype(np.float32))
    assert held.vertices.dtype == np.float64
    with pytest.raises(ValueError):
        held.vertices[0, 0] = 5


@pytest.mark.parametrize(
    "changes",
    [
        {"vertices": TRIANGLE[:, :2]},
        {"vertices": np.where(TRIANGLE == 1, np.nan, TRIANGLE)},
        {"vertices": np.where(TRIANGLE == 1, np.inf, TRIANGLE)},
        {"triangles": [(0, 1, 3)]},
        {"triangles": [(0, 1, -1)]},
        {"albedo": [(0.5, 0.5)]},
        {"albedo": [(0.5, 0.5, 0.5)] * 2},
        {"albedo": [(0.5, -0.5, 0.5)]},
        {"emission": "red"},
    ],
)
def test_a_scene_refuses_wrong_arrays(changes):
    with pytest.raises(InvalidArrayError) as error:
        scene(**changes)
    assert str(error.value).endswith(".") and "\n" not in str(error.value).strip()


def test_a_scene_without_faces_says_what_to_do():
    with pytest.raises(NoMeshError, match="add a mesh"):
        scene(triangles=[], albedo=[], emission=[], transmittance=[])


def test_bounds_ignore_vertices_that_no_triangle_uses():
    held = scene(vertices=np.concatenate([TRIANGLE, [(99, 99, 99)]]))
    assert held.bounds.upper.tolist() == [1, 1, 0]
    assert held.bounds.radius == pytest.approx(np.sqrt(2) / 2)


def test_bounds_of_huge_coordinates_do_not_overflow():
    bounds = Bounds.of(np.array([(-1e308, 0, 0), (1e307, 1, 1)]))
    assert np.isfinite(bounds.centre).all()


@pytest.mark.parametrize("radius", [0.0, -1.0, np.nan, np.inf])
def test_a_radius_must_be_finite_and_positive(radius):
    with pytest.raises(InvalidSettingError, match="radius"):
        TangentDiscs.of_radius(TRIANGLE, TRIANGLE + 1, radius)
    if radius != 0.0:
        with pytest.raises(InvalidSettingError, match="radius"):
            BakeSettings(radius=radius)


def test_discs_make_normals_unit_and_refuse_those_without_direction():
    discs = TangentDiscs.of_radius(TRIANGLE, [(0, 0, 5), (1e-200, 0, 0), (0, -1e200, 0)], 2.0)
    assert np.allclose(discs.normals, [(0, 0, 1), (1, 0, 0), (0, -1, 0)])
    assert np.allclose(discs.areas, 4 * np.pi)
    with pytest.raises(InvalidArrayError, match="direction"):
        TangentDiscs.of_radius(TRIANGLE, np.zeros((3, 3)), 1.0)


@pytest.mark.parametrize(
    "wrong",
    [
        {"photons": 0},
        {"bounces": -1},
        {"seed": -1},
        {"quality": "best"},
        {"gatherer": "kd-tree"},
        {"radius": -0.1},
        {"error": 0.0},
        {"error": 5.0},
        {"seconds": 0.0},
        {"seconds": float("inf")},
    ],
)
def test_settings_refuse_what_they_cannot_be(wrong):
    with pytest.raises(DetpError) as error:
        BakeSettings(**wrong)
    assert str(error.value).endswith(".")


def test_qualities_trade_photons_for_error():
    photons = [BakeSettings(quality=quality).expected_photons for quality in QUALITIES]
    errors = [BakeSettings(quality=quality).target_error for quality in QUALITIES]
    assert photons == sorted(photons) and errors == sorted(errors, reverse=True)
    assert BakeSettings(photons=7).expected_photons == BakeSettings(photons=7).most_photons == 7
    assert "auto" in GATHERERS


def test_a_number_of_photons_ends_no_bake_that_sends_none():
    assert BakeSettings(photons=7).aimed_noise is None
    assert BakeSettings(photons=7, indirect="off", direct="photons").aimed_noise is None
    assert BakeSettings(photons=7, indirect="photons", bounces=1).aimed_noise is None
    for without in ({"indirect": "off"}, {"bounces": 0}, {"bounces": 1}):
        assert BakeSettings(photons=7, **without).aimed_noise == BakeSettings().aimed_noise > 0


def test_segments_join_and_weigh():
    one = Segments(np.zeros((2, 3)), np.ones((2, 3)), np.full((2, 3), 4.0), np.zeros(2, np.uint16))
    both = Segments.joined([one.weighted(0.25), one])
    assert len(both) == 4
    assert both.flux[:, 0].tolist() == [1, 1, 4, 4]
