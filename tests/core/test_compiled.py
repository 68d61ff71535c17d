"""Compiled kernels: used when they are there, never waited for, and never different from NumPy."""

import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from detp.core import compiled
from detp.core.compiled import cache
from detp.core.discs import TangentDiscs
from detp.core.estimator import crossing_sums
from detp.core.estimator.crossing_sums import CrossingSums
from detp.core.estimator.repeated_crossings import RepeatedCrossings
from detp.core.estimator.rings import nested_areas
from detp.core.estimator.visible_area import DIRECTIONS, VisibleArea
from detp.core.gatherers import choose
from detp.core.gatherers.choose import make_gatherer
from detp.core.gatherers.disc_index import DiscIndex
from detp.core.rays import RayCaster
from detp.core.segments import Segments

PACKAGE = """
from pathlib import Path

def compile_now():
    Path(__file__).with_name("done").write_text(__name__)
"""


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
    # Stored kernels ask for their modules by name.
    assert (package / "done").read_text() == compiled.__name__


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


def crossed(generator, count=4000, points=300):
    """Discs with outlines cut off at random, segments of particles with several each, and their crossings."""
    normals = generator.normal(size=(points, 3))
    normals[:6] = np.concatenate([np.eye(3), -np.eye(3)])
    discs = TangentDiscs.of_radius(generator.uniform(-1, 1, (points, 3)), normals, 0.4)
    reach = 0.4 * np.minimum(1.0, generator.uniform(0.0, 1.5, (points, DIRECTIONS)))
    reach[::3] = 0.4
    partial = (reach < 0.4).any(axis=1)
    nowhere = np.zeros(points, bool)
    visible = VisibleArea(reach, nested_areas(reach, discs.radii), partial, nowhere)
    flux = generator.exponential(size=(count, 3)) * np.where(np.arange(count) % 7 == 0, -1, 1)[:, None]
    particle = generator.integers(0, 200, count).astype(np.uint32)
    origins, ends = generator.uniform(-1.5, 1.5, (2, count, 3))
    segments = Segments(origins, ends, flux, np.ones(count, np.uint16), particle)
    return discs, visible, segments, list(DiscIndex(discs, "grid").crossings(segments))


def test_sums_over_crossings_equal_those_of_numpy(kernels, monkeypatch):
    monkeypatch.setattr(crossing_sums, "SHARED", 100)
    discs, visible, segments, found = crossed(np.random.default_rng(1))
    sums = {}
    for how in ("off", "on"):
        monkeypatch.setenv("DETP_COMPILED", how)
        adding, repeated = CrossingSums(discs, segments, visible), RepeatedCrossings(len(discs), segments)
        kept = [adding.add(crossings) for crossings in found]
        for crossings, inside in zip(found, kept, strict=True):
            repeated.add(crossings, inside)
        sums[how] = np.concatenate(kept), adding.total, adding.squares, repeated.products()
    assert np.array_equal(sums["on"][0], sums["off"][0])
    assert 0.3 < sums["on"][0].mean() < 0.9 and np.abs(sums["on"][3]).sum() > 0
    for one, other in zip(sums["on"][1:], sums["off"][1:], strict=True):
        assert np.allclose(one, other, rtol=1e-12, atol=1e-12 * np.abs(other).max())


def test_whole_discs_have_no_outlines(kernels):
    discs, _, segments, found = crossed(np.random.default_rng(2))
    nowhere = np.zeros(len(discs), bool)
    whole = VisibleArea(np.empty((len(discs), 0)), discs.areas[:, None], nowhere, nowhere)
    adding = CrossingSums(discs, segments, whole)
    assert all(adding.add(crossings).all() for crossings in found)


@pytest.mark.parametrize("size", [1, 500])
def test_threads_change_no_bit(kernels, monkeypatch, size):
    monkeypatch.setattr(crossing_sums, "SHARED", size)
    discs, visible, segments, found = crossed(np.random.default_rng(3))
    totals = []
    for threads in (1, 3):
        monkeypatch.setattr(crossing_sums, "worker_count", lambda threads=threads: threads)
        adding = CrossingSums(discs, segments, visible)
        for crossings in found:
            adding.add(crossings)
        totals.append(np.stack([adding.total, adding.squares]))
    assert np.array_equal(*totals)


@pytest.mark.parametrize("x", [1.0, -1.0])
@pytest.mark.parametrize("y", [1.0, -1.0])
def test_sectors_are_those_of_the_angle(kernels, x, y):
    angle = (np.arange(400) + 0.5) * (0.5 * np.pi / 400)  # on none of the borders
    points = np.stack([x * np.cos(angle), y * np.sin(angle)], axis=1)
    expected = np.floor(np.arctan2(points[:, 1], points[:, 0]) * (DIRECTIONS / (2 * np.pi))) % DIRECTIONS
    assert [kernels.sector(*point) for point in points.tolist()] == expected.tolist()


def test_rays_hit_the_same_points(kernels, monkeypatch):
    generator = np.random.default_rng(4)
    corners = generator.uniform(-1, 1, (60, 1, 3)) + 0.3 * generator.normal(size=(60, 3, 3))
    origins, ways = generator.normal(size=(2, 500, 3))
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    caster, hits = RayCaster(corners), {}
    for how in ("off", "on"):
        monkeypatch.setenv("DETP_COMPILED", how)
        hits[how] = caster.first_hits(origins, ways)
    hit = hits["on"].triangle >= 0
    assert np.array_equal(hits["on"].triangle, hits["off"].triangle) and 50 < hit.sum() < 450
    assert np.array_equal(hits["on"].points[hit], hits["off"].points[hit])
    # No farther than asked for, nothing is left out.
    far = np.linalg.norm(hits["on"].points - origins, axis=1)
    near = caster.first_hits(origins, ways, np.where(np.arange(500) % 2, far, 0.5 * far))
    assert np.array_equal(near.triangle[1::2], hits["on"].triangle[1::2])
    assert (near.triangle[::2] < 0).all()
