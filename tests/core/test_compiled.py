"""Compiled kernels: used when they are there, never waited for, and never different from NumPy."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from detp.core import compiled
from detp.core.compiled import cache
from detp.core.discs import TangentDiscs
from detp.core.gatherers import choose
from detp.core.gatherers.choose import make_gatherer

PACKAGE = """
from pathlib import Path

def compile_now():
    Path(__file__).with_name("done").touch()
"""


@pytest.fixture
def kernels():
    pytest.importorskip("numba")
    compiled.compile_now()
    return compiled.kernels() or pytest.skip("DETP_COMPILED=off")


@pytest.fixture
def cold(monkeypatch, tmp_path):
    """No kernels in memory or in the cache, and what would compile them is noted only."""
    started = []
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.delenv("DETP_COMPILED", raising=False)
    monkeypatch.setattr(compiled, "_NAME", "detp.no_such_module")
    monkeypatch.setattr(compiled, "find_spec", lambda name: name)
    monkeypatch.setattr(cache, "fill_aside", started.append)
    return started


def waited_for(condition, seconds=60.0):
    end = time.monotonic() + seconds
    while not condition() and time.monotonic() < end:
        time.sleep(0.02)
    return condition()


def test_importing_the_core_imports_no_numba():
    code = "import sys, detp.core.bake, detp.core.gatherers.choose; sys.exit('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
                          ).returncode == 0  # fmt: skip


def test_a_cold_cache_gives_none_and_starts_the_compilation(cold):
    assert compiled.kernels(saving=0.1) is None and cold == []
    assert compiled.kernels(saving=100.0) is None
    assert cold == [cache.folder_of_kernels()]


def test_off_means_off(cold, monkeypatch):
    monkeypatch.setenv("DETP_COMPILED", "off")
    assert compiled.kernels() is None and cold == []


def test_without_numba_there_are_none(cold, monkeypatch):
    monkeypatch.setattr(compiled, "find_spec", lambda name: None)
    assert compiled.kernels() is None and cold == []


def test_kernels_that_do_not_load_stop_no_bake(cold):
    pytest.importorskip("numba")
    folder = cache.folder_of_kernels()
    folder.mkdir(parents=True)
    cache.set_complete(folder)
    assert compiled.kernels() is None and cold == []


def test_the_process_beside_compiles_and_another_one_is_not_started(monkeypatch, tmp_path):
    package, folder = tmp_path / "package", tmp_path / "cache"
    package.mkdir()
    (package / "__init__.py").write_text(PACKAGE)
    folder.mkdir()
    monkeypatch.setattr(cache, "_HERE", package)
    lock = folder / "compiling"
    lock.touch()
    cache.fill_aside(folder)
    time.sleep(0.2)
    assert lock.exists() and not (package / "done").exists()
    os.utime(lock, (0.0, time.time() - 2 * cache.LONGEST))
    cache.fill_aside(folder)
    assert waited_for(lambda: (package / "done").exists() and not lock.exists())


def test_a_folder_that_cannot_be_made_stops_nothing(tmp_path):
    (tmp_path / "file").touch()
    cache.fill_aside(tmp_path / "file" / "folder")


def test_the_folder_follows_the_source_and_the_system(monkeypatch, tmp_path):
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setenv("LOCALAPPDATA", str(tmp_path))
    before = cache.folder_of_kernels()
    assert before == cache.folder_of_kernels() and (sys.platform == "darwin" or before.is_relative_to(tmp_path))
    monkeypatch.setattr(cache, "_version", lambda name: "0")
    assert cache.folder_of_kernels() != before
    assert not before.is_relative_to(Path(compiled.__file__).parents[2])


def test_large_searches_are_compiled_and_small_ones_are_not(kernels, monkeypatch):
    points = [[x, y, 0.0] for x in range(50) for y in range(50)]
    discs = TangentDiscs.of_radius(points, [[0.0, 0.0, 1.0]] * 2500, 2.0)
    for name in ("auto", "disc-index"):
        gatherer, reason = make_gatherer(name, discs, 1 << 22)
        assert gatherer.index == "compiled grid" and reason.startswith("Disc Indexing with a compiled grid")
    savings = []
    monkeypatch.setattr(choose, "kernels", savings.append)
    assert make_gatherer("disc-index", discs, 100)[0].index != "compiled grid"
    assert savings[0] < compiled.LOADING
