"""One bake over many workers: the same light, bit for bit, whoever casts its rays and whatever becomes of them."""

import itertools
import json
import os
import signal
import sys
import time
from dataclasses import replace

import numpy as np
import pytest
from crew_bakes import PHOTONS, QUICK, finished_after_loss, lamps, room, same, steps_by
from detp.core import AreaLight, BakeSettings, SunLight, UniformWorld, parallel
from detp.core.bake import baked
from detp.core.cluster import bench, dask_hands
from detp.core.cluster.packing import packed, unpacked
from detp.core.cluster.processes import ProcessHands
from detp.core.errors import ClusterError
from detp.core.photons import photon_light
from detp.core.photons.photon_light import PhotonPiece
from detp.core.stages import finished


@pytest.mark.parametrize(
    ("lights", "settings"),
    [
        (None, QUICK),
        ((SunLight((0.3, 0.2, -1), (3, 3, 2), 0.1), UniformWorld((0.5, 0.5, 1))), QUICK),
        ((AreaLight((0.5, 0.5, 0.9), (0.3, 0, 0), (0, 0.3, 0), (5, 5, 5)),), BakeSettings(error=0.2, seed=3)),
        (None, BakeSettings(photons=6_000, indirect="photons")),
        (None, BakeSettings(photons=6_000, direct="none")),
        (None, BakeSettings(photons=6_000, estimator="plain", radius=0.2)),
    ],
)
def test_what_travels_is_all_that_it_takes(lights, settings):
    scene, points = room(lights, emission=0.1, transmittance=0.0 if lights is None else 0.2)
    with ProcessHands(0) as hands:
        assert same(finished(steps_by(hands, scene, points, settings)), baked(scene, points, settings))


@pytest.mark.parametrize("gatherer", ["disc-index", "sphere-cache"])
@pytest.mark.parametrize("more", [{}, {"estimator": "plain"}, {"direct": "photons"}, {"indirect": "gather"}])
def test_photons_in_pieces_bring_the_light_of_one_process(monkeypatch, gatherer, more):
    """Two steps, of eight pieces and of two; with one thread and with four; all that is asked for is done by hands."""
    scene, points = room((*lamps()[:3], UniformWorld((0.5, 0.5, 1))), emission=0.1, transmittance=0.2)
    settings = replace(PHOTONS, gatherer=gatherer, **more)
    found = []
    for count in (1, 4):
        monkeypatch.setattr(parallel, "worker_count", lambda count=count: count)
        monkeypatch.setattr(photon_light, "worker_count", lambda count=count: count)
        found.append(baked(scene, points, settings))
    with ProcessHands(0) as hands:
        by_crew = finished(steps_by(hands, scene, points, settings))
    assert same(found[0], found[1]) and same(by_crew, found[0])
    for name in ("segments", "gatherer", "reason"):
        assert getattr(by_crew, name) == getattr(found[0], name)
    assert np.array_equal(by_crew.cut_flux, found[0].cut_flux) and np.array_equal(by_crew.hidden, found[0].hidden)
    assert by_crew.indirect.value.all() and by_crew.gatherer == gatherer


@pytest.mark.parametrize(
    ("begin", "particles", "sizes"),
    [
        (0, 1, [1]),
        (0, 10_000, [8_192, 1_808]),
        (5_000, 1 << 15, [1 << 13] * 4),
        (7, (1 << 17) + 1, [(1 << 14) + 1] * 7 + [(1 << 14) - 6]),
        (0, 1 << 18, [1 << 15] * 8),
        (0, 1 << 19, [1 << 15] * 16),
    ],
)
def test_pieces_of_photons_are_each_once_and_do_not_ask_how_many_workers(begin, particles, sizes):
    pieces = PhotonPiece.of_batch(begin, particles)
    assert [piece.particles for piece in pieces] == sizes
    assert pieces[0].first == begin
    assert all(one.last == other.first for one, other in itertools.pairwise(pieces))
    assert sum(piece.share for piece in pieces) == pytest.approx(1.0)


def test_packed_values_come_back_as_they_were():
    arrays = np.arange(6).reshape(2, 3), np.zeros((0, 3)), (np.float32([1.5]),)
    value = (None, True, 3, 0.1, "name", *arrays, {"a": 1}, QUICK)
    back = unpacked(packed(value))
    assert back[:5] == value[:5] and back[-1] == QUICK
    for one, other in zip(back[5:7], value[5:7], strict=True):
        assert np.array_equal(one, other) and one.dtype == other.dtype and one.shape == other.shape
    sun = SunLight((0.3, 0.2, -1), (3, 3, 2), 0.1)
    assert np.array_equal(unpacked(packed(sun)).direction, sun.direction)


def test_zeros_take_no_bytes_and_stay_what_they_are():
    nothing = np.zeros((1000, 3)), np.zeros(1000, np.uint16), np.zeros((7, 1000), np.float32)[:, ::2]
    data = packed((*nothing, np.zeros(1000, bool), np.full(3, -0.0)))
    assert len(data) < 1000
    *back, minus = unpacked(data)
    for one, other in zip(back, (*nothing, np.zeros(1000, bool)), strict=True):
        assert np.array_equal(one, other) and one.dtype == other.dtype and one.shape == other.shape
    assert np.signbit(minus).all()


@pytest.mark.parametrize("value", [print, np.array([print]), object(), {1}, b"code"])
def test_nothing_but_arrays_numbers_and_names_travels(value):
    with pytest.raises(ClusterError, match="cannot be sent"):
        packed((value,))


def test_bytes_that_are_no_part_of_a_bake_are_refused():
    data = packed((np.arange(4.0),))
    for tree in ('{"Popen": [["sh"]]}', '{"array": 7}', '{"array": 0, "Scene": []}', "[["):
        text = json.dumps([("<f8", (4,), 0)])
        made = np.frombuffer(np.array([len(tree), len(text)], "<i8").tobytes() + (tree + text).encode(), np.uint8)
        with pytest.raises(ClusterError, match="no part of a bake"):
            unpacked(made)
    for shape in ([-1], [10**15], [10**30], ["a"]):
        text = json.dumps([("<f8", shape, None)])
        made = np.frombuffer(np.array([11, len(text)], "<i8").tobytes() + ('{"array":0}' + text).encode(), np.uint8)
        with pytest.raises(ClusterError, match="no part of a bake"):
            unpacked(made)
    with pytest.raises(ClusterError, match="no part of a bake"):
        unpacked(data[:40])


def test_without_dask_a_sentence_says_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "dask", None)
    with pytest.raises(ClusterError, match=r"pip install"), dask_hands.hands_at("tcp://127.0.0.1:1"):
        pass


@pytest.fixture(scope="module")
def cluster():
    """Workers of one thread each, one at first."""
    distributed = pytest.importorskip("distributed", reason='needs Dask: pip install "detp[cluster]"')
    made = distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, memory_limit=0, dashboard_address=None, silence_logs=50
    )
    with made:
        yield made


def workers(hands):
    return hands._client.run(os.getpid)


def test_one_two_and_three_workers_give_the_light_of_none(cluster):
    scene, points = room()
    alone = baked(scene, points, QUICK)
    for count in (1, 2, 3):
        cluster.scale(count)
        with dask_hands.hands_at(cluster.scheduler_address) as hands:
            hands._client.wait_for_workers(count, 30)
            assert same(finished(steps_by(hands, scene, points, QUICK)), alone)


@pytest.mark.parametrize("lost", [1, 3])
@pytest.mark.parametrize(("settings", "phase", "number"), [(QUICK, "Casting rays", 1), (PHOTONS, "Tracing photons", 4)])
def test_workers_that_are_killed_cost_nothing_but_time(cluster, lost, settings, phase, number):
    """Of three, one or all, in whose place others come, which have seen nothing of the scene.

    Photons are in the middle of a step then: two of eight pieces have come back.
    """
    cluster.scale(3)
    scene, points = room()
    with dask_hands.hands_at(cluster.scheduler_address) as hands:
        hands._client.wait_for_workers(3, 30)
        left = list(workers(hands).values())[:lost]

        def lose():
            for process in left:
                os.kill(process, signal.SIGKILL)

        found = finished_after_loss(steps_by(hands, scene, points, settings), phase, number, lose)
    assert same(found, baked(scene, points, settings))


def test_a_bake_that_is_closed_leaves_the_workers_nothing_to_do(cluster):
    scene, points = room()
    with dask_hands.hands_at(cluster.scheduler_address) as hands:
        steps = steps_by(hands, scene, points, QUICK)
        for progress in steps:
            if progress.phase == "Casting rays":
                break
        steps.close()
    for _ in range(50):
        if not cluster.scheduler.tasks:
            break
        time.sleep(0.1)
    assert not cluster.scheduler.tasks


def test_workers_of_another_version_are_refused(cluster):
    with dask_hands.hands_at(cluster.scheduler_address) as hands:
        hands._code = "other"
        with pytest.raises(ClusterError, match="another version"):
            hands.check()
    with pytest.raises(ClusterError, match="another version"):
        bench.worked("stand", "other", ("scene",), packed((0, 1)), packed(()))


def test_a_scheduler_that_does_not_answer_or_has_no_workers_is_named(cluster, monkeypatch):
    monkeypatch.setattr(dask_hands, "CONNECT", 0.5)
    with (
        pytest.raises(ClusterError, match="No Dask scheduler answers at 'tcp://"),
        dask_hands.hands_at("tcp://127.0.0.1:9"),
    ):
        pass
    cluster.scale(0)
    with (
        pytest.raises(ClusterError, match="has no workers"),
        dask_hands.hands_at(cluster.scheduler_address, wait=0.2) as hands,
    ):
        # Some may still be on their way out.
        while True:
            hands.check()
