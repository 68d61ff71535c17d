"""One bake by processes of this machine: the same light, bit for bit, whatever becomes of them."""

import os
import signal
import socket
import subprocess
import sys
import time
import uuid
from dataclasses import replace

import pytest
from crew_bakes import PHOTONS, QUICK, finished_after_loss, room, same, steps_by
from detp.core import BakeSettings, PointLight, forecast, memory
from detp.core.bake import bake, baked
from detp.core.cluster import crew as crews
from detp.core.cluster import processes
from detp.core.cluster.crew import Crew, crew_of
from detp.core.cluster.processes import ProcessHands, processes_at_hand
from detp.core.errors import OutOfMemoryError
from detp.core.stages import finished
from detp.core.update.session import BakeSession


@pytest.fixture(scope="module")
def lit_room():
    return room((PointLight((0.5, 0.4, 0.6), (3, 2, 1)), PointLight((0.2, 0.7, 0.8), (1, 2, 1), 0.02)), 0.1)


@pytest.fixture
def started(monkeypatch):
    """The processes that the test starts."""
    found, start = [], subprocess.Popen

    def noted(*arguments, **options):
        found.append(start(*arguments, **options))
        return found[-1]

    monkeypatch.setattr(processes.subprocess, "Popen", noted)
    return found


@pytest.mark.parametrize("settings", [QUICK, PHOTONS])
@pytest.mark.parametrize("number", [1, 3])
def test_processes_give_the_light_of_none(lit_room, number, settings):
    with ProcessHands(number) as hands:
        while hands._coming():
            hands._look()
        assert same(finished(steps_by(hands, *lit_room, settings)), baked(*lit_room, settings))
        assert len(hands._workers) == len(hands.started) == number
    assert all(process.returncode is not None for process in hands.started)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has other signals")
@pytest.mark.parametrize("lost", [1, 3])
@pytest.mark.parametrize(("settings", "phase", "number"), [(QUICK, "Casting rays", 1), (PHOTONS, "Tracing photons", 4)])
def test_processes_that_are_killed_cost_nothing_but_time(lit_room, lost, settings, phase, number):
    with ProcessHands(3) as hands:

        def lose():
            for process in hands.started[:lost]:
                process.send_signal(signal.SIGKILL)
                process.wait()

        found = finished_after_loss(steps_by(hands, *lit_room, settings), phase, number, lose)
        assert sum(process.poll() is not None for process in hands.started) == lost
    assert same(found, baked(*lit_room, settings))


@pytest.mark.parametrize("program", ["/no/such/python", "/usr/bin/blender", ""])
def test_where_processes_cannot_start_there_is_no_crew(monkeypatch, program):
    """There is no such program, or it is not Python."""
    monkeypatch.setattr(processes.sys, "executable", program)
    with processes_at_hand(2) as hands:
        assert hands is None


def test_where_no_sockets_are_allowed_there_is_no_crew(monkeypatch):
    def refuse(*_, **__):
        raise PermissionError

    monkeypatch.setattr(processes.socket, "create_server", refuse)
    with processes_at_hand(2) as hands:
        assert hands is None


def test_where_processes_end_at_once_this_one_does_all(lit_room, monkeypatch, tmp_path):
    monkeypatch.setattr(processes, "_WORKER", tmp_path / "no_such_script.py")
    with processes_at_hand(2) as hands:
        assert same(finished(steps_by(hands, *lit_room, QUICK)), baked(*lit_room, QUICK))
        assert not hands._workers


def test_no_stranger_is_let_in(lit_room):
    with ProcessHands(1) as hands:
        with socket.create_connection(hands._door.getsockname()) as stranger:
            stranger.sendall(bytes(32))
            assert same(finished(steps_by(hands, *lit_room, QUICK)), baked(*lit_room, QUICK))
            assert len(hands._workers) == 1
            stranger.settimeout(5.0)
            assert stranger.recv(1) == b""


def test_a_bake_that_is_closed_leaves_no_processes(lit_room, monkeypatch, started):
    monkeypatch.setattr(crews, "WORTH", 0.0)
    monkeypatch.setattr(crews, "worker_count", lambda: 2)

    def baking():
        with crew_of(*lit_room, QUICK) as crew:
            yield from bake(*lit_room, QUICK, crew=crew)

    steps = baking()
    for progress in steps:
        if progress.phase == "Casting rays":
            assert [process.poll() for process in started] == [None, None]
            break
    steps.close()
    assert all(process.returncode is not None for process in started)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has other signals")
def test_processes_end_with_the_one_that_started_them(tmp_path):
    script = "import sys, time; from detp.core.cluster.processes import ProcessHands; hands = ProcessHands(2)\n"
    script += "while len(hands._workers) < 2: hands._look()\n"
    script += "print(*(each.pid for each in hands.started), flush=True); time.sleep(60)"
    starter = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    started = [int(each) for each in starter.stdout.readline().split()]
    starter.kill()
    starter.wait()
    starter.stdout.close()
    until = time.monotonic() + 10.0
    while any(os.path.exists(f"/proc/{each}") for each in started) and time.monotonic() < until:
        time.sleep(0.05)
    assert len(started) == 2 and not any(os.path.exists(f"/proc/{each}") for each in started)


def test_a_bake_that_is_kept_for_updates_has_the_same_light_and_paths_by_processes(lit_room):
    alone = BakeSession(*lit_room, QUICK)
    by_crew = BakeSession(*lit_room, QUICK)
    with ProcessHands(2) as hands:
        found = finished(by_crew.bake(crew=Crew(hands, uuid.uuid4().hex, *lit_room, QUICK)))
    assert same(found, finished(alone.bake()))
    painted = lit_room[0].albedo.copy()
    painted[:2] = 0.2
    changed = replace(lit_room[0], albedo=painted), lit_room[1]
    assert same(finished(by_crew.update(*changed, dear=True)), finished(alone.update(*changed, dear=True)))


@pytest.mark.parametrize(
    ("worth", "processors", "beside", "free", "hired"),
    [
        (0.0, 2, 1, 1 << 40, True),
        (0.0, 1, 1, 1 << 40, False),
        (0.0, 4, 4, 1 << 40, False),
        (0.0, 2, 1, memory.BAKING + memory.WORKER, False),
        (1e9, 2, 1, 1 << 40, False),
    ],
)
def test_processes_are_started_where_they_pay(lit_room, monkeypatch, started, worth, processors, beside, free, hired):
    monkeypatch.setattr(crews, "WORTH", worth)
    monkeypatch.setattr(crews, "worker_count", lambda: processors)
    monkeypatch.setattr(memory, "free_bytes", lambda: free)
    with crew_of(*lit_room, QUICK, beside=beside) as crew:
        assert (crew is not None) == hired
        assert len(started) == (processors if hired else 0)


def test_local_processes_work_on_the_smallest_bake_where_there_is_memory(lit_room, monkeypatch, started):
    monkeypatch.setattr(crews, "worker_count", lambda: 2)
    with crew_of(*lit_room, QUICK, crews.LOCAL) as crew:
        assert len(started) == 2
        same(finished(bake(*lit_room, QUICK, crew=crew)), baked(*lit_room, QUICK))
    monkeypatch.setattr(memory, "free_bytes", lambda: 1 << 20)
    with pytest.raises(OutOfMemoryError), crew_of(*lit_room, QUICK, crews.LOCAL):
        pass
    assert len(started) == 2


def test_workers_are_worth_it_by_what_is_to_be_done():
    quick, long = BakeSettings(quality="draft"), BakeSettings(quality="final")
    assert forecast.processor_seconds(1_000, quick) < crews.WORTH < forecast.processor_seconds(50_000, quick)
    assert forecast.processor_seconds(1_000, quick) < forecast.processor_seconds(1_000, long)
    assert forecast.processor_seconds(1_000, BakeSettings(seconds=30.0)) == 30.0


def test_as_many_workers_as_memory_has_room_for():
    of_bake, of_worker = memory._of_bake(1_000_000, 100_000), memory._of_worker(1_000_000, 100_000, 10_000)
    for number in (0, 1, 5):
        assert memory.workers_that_fit(1_000_000, 100_000, 10_000, of_bake + number * of_worker) == number
    assert memory.workers_that_fit(1_000_000, 100_000, 10_000, 0) == 0
    with pytest.raises(OutOfMemoryError):
        memory.check_workers(1_000_000, 100_000, 10_000, 5, 5 * of_worker - 1)
