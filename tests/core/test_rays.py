"""Embree behind its one wrapper: hits, misses, exact hit points, no hits on the own surface, threads."""

import threading

import numpy as np
import pytest
from detp.core import parallel
from detp.core.rays import RAYS_PER_SLICE, RayCaster


def square(size=1.0, height=0.0, offset=(0.0, 0.0, 0.0)):
    a, b, c, d = np.array([(0, 0, 0), (size, 0, 0), (size, size, 0), (0, size, 0)], float) + (0, 0, height)
    return np.array([(a, b, c), (a, c, d)]) + offset


def test_hit_and_miss():
    caster = RayCaster(square())
    hits = caster.first_hits(np.array([(0.25, 0.5, 2.0), (3.0, 0.5, 2.0)]), np.array([(0, 0, -1.0)] * 2))
    assert hits.triangle.tolist() == [1, -1]
    assert np.allclose(hits.points[0], (0.25, 0.5, 0.0), atol=1e-6)


def test_the_nearest_of_two_surfaces_is_hit():
    caster = RayCaster(np.concatenate([square(), square(height=1.0)]))
    down = caster.first_hits(np.array([(0.5, 0.3, 2.0)]), np.array([(0, 0, -1.0)]))
    up = caster.first_hits(np.array([(0.5, 0.3, -2.0)]), np.array([(0, 0, 1.0)]))
    assert down.triangle[0] >= 2 > up.triangle[0] >= 0


def test_hit_points_lie_on_the_plane_in_double_precision_far_from_the_origin():
    corners = square(1.0, offset=(8.5e4, 4.47e5, 17.125))
    generator = np.random.default_rng(1)
    count = 1000
    origins = np.array((8.5e4, 4.47e5, 18.0)) + np.c_[generator.random((count, 2)), np.zeros(count)]
    directions = np.array([(0.01, 0.02, -1.0)] * count)
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    hits = RayCaster(corners).first_hits(origins, directions)
    hit = hits.triangle >= 0
    assert hit.mean() > 0.9
    assert np.abs(hits.points[hit, 2] - 17.125).max() < 1e-9


@pytest.mark.parametrize("offset", [(0, 0, 0), (1e6, -1e6, 1e6)])
def test_rays_leaving_a_surface_do_not_hit_it_again(offset):
    caster = RayCaster(square(offset=offset))
    generator = np.random.default_rng(2)
    origins = np.c_[generator.random((20000, 2)), np.zeros(20000)] + offset
    origins[:, 2] += caster.tolerance(origins)
    cosine = 10.0 ** generator.uniform(-7, 0, 20000)
    azimuth = generator.uniform(0, 2 * np.pi, 20000)
    sine = np.sqrt(1 - cosine**2)
    directions = np.c_[sine * np.cos(azimuth), sine * np.sin(azimuth), cosine]
    assert (caster.first_hits(origins, directions).triangle < 0).all()


@pytest.mark.parametrize("size, distance", [(1e-2, 1e3), (1.0, 1e3), (1e4, 0.0), (1e4, 1.0), (1e6, 0.0)])
def test_half_the_tolerance_keeps_clear_of_triangles_of_any_size_turned_any_way(size, distance):
    generator = np.random.default_rng(6)
    for _ in range(5):
        turn = np.linalg.qr(generator.normal(size=(3, 3)))[0]
        corners = (square(size) - (size / 2, size / 2, 0)) @ turn.T + distance * generator.uniform(-1, 1, 3)
        caster = RayCaster(corners, generator.normal(size=(100, 3)))
        # Places all over it, and as many close to where coordinates are most exact.
        weights = np.sort(generator.random((2000, 2)), axis=1)
        weights = np.diff(weights, prepend=0.0, append=1.0, axis=1)
        places = np.einsum("kc,kcx->kx", weights, corners[generator.integers(0, 2, 2000)])
        middle = corners.reshape(-1, 3).mean(axis=0)
        places = np.concatenate([places, middle + (places - middle) * 10.0 ** generator.uniform(-6, 0, (2000, 1))])
        origins = places + 0.5 * caster.tolerance(places)[:, None] * caster.normals[0]
        cosine = 10.0 ** generator.uniform(-5, 0, len(places))
        azimuth, sine = generator.uniform(0, 2 * np.pi, len(places)), np.sqrt(1 - cosine**2)
        directions = np.c_[sine * np.cos(azimuth), sine * np.sin(azimuth), cosine]
        directions = directions @ np.stack([turn[:, 0], turn[:, 1], caster.normals[0]])
        assert (caster.first_hits(origins, directions).triangle < 0).all()
        # Rounding may tell whether a place near the edge lies on it.
        below = caster.first_hits(origins, np.tile(-caster.normals[0], (len(origins), 1)))
        hit = below.triangle >= 0
        assert hit.mean() > 0.98
        off = np.linalg.norm(below.points - places, axis=1)
        assert (off[hit] < 4 * caster.tolerance(places[hit])).all()


def test_the_number_of_threads_changes_nothing(monkeypatch):
    generator = np.random.default_rng(3)
    corners = generator.normal(size=(500, 3, 3)) * 0.2 + generator.normal(size=(500, 1, 3))
    origins = generator.normal(size=(3 * RAYS_PER_SLICE + 7, 3))
    directions = generator.normal(size=origins.shape)
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    found = []
    for workers in (1, 2, 5):
        monkeypatch.setattr(parallel, "worker_count", lambda workers=workers: workers)
        found.append(RayCaster(corners).first_hits(origins, directions))
    for other in found[1:]:
        assert np.array_equal(found[0].triangle, other.triangle)
        assert np.array_equal(found[0].points, other.points)


def test_tasks_in_threads_share_no_work_out_themselves(monkeypatch):
    monkeypatch.setattr(parallel, "worker_count", lambda: 2)

    def threads(task):
        return threading.get_ident(), set(parallel.ordered_map(lambda part: threading.get_ident(), range(4)))

    for own, helpers in parallel.ordered_map(threads, range(2)):
        assert helpers == {own}


def test_what_is_no_farther_than_asked_for_is_found():
    generator = np.random.default_rng(4)
    corners = generator.uniform(-1, 1, (60, 1, 3)) + 0.3 * generator.normal(size=(60, 3, 3))
    origins, directions = generator.normal(size=(2, 500, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    caster = RayCaster(corners)
    whole = caster.first_hits(origins, directions)
    assert 50 < (whole.triangle >= 0).sum() < 450
    far = np.linalg.norm(whole.points - origins, axis=1)
    near = caster.first_hits(origins, directions, np.where(np.arange(500) % 2, far, 0.5 * far))
    assert np.array_equal(near.triangle[1::2], whole.triangle[1::2])
    assert (near.triangle[::2] < 0).all()


def test_no_rays_and_a_scene_without_extent():
    point = np.zeros((1, 3, 3))
    hits = RayCaster(point).first_hits(np.zeros((0, 3)), np.zeros((0, 3)))
    assert len(hits.triangle) == 0
