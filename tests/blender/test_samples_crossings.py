"""All gatherers find the same crossings on the sample scenes: real photons, real points, three radii."""

from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from detp.core.discs import TangentDiscs  # noqa: E402
from detp.core.gatherers.brute_force import BruteForce  # noqa: E402
from detp.core.gatherers.disc_index import DiscIndex  # noqa: E402
from detp.core.gatherers.sphere_cache import SphereCache  # noqa: E402
from detp.core.photons.tracing import PhotonTracer  # noqa: E402
from detp.core.rays import RayCaster  # noqa: E402
from detp.detp_addon.reading.read_scene import read_scene  # noqa: E402

SAMPLES = sorted((Path(__file__).parents[2] / "sample_blends").glob("*.blend"))


def pairs(gatherer, segments):
    found = [crossings.disc * len(segments) + crossings.segment for crossings in gatherer.crossings(segments)]
    keys = np.sort(np.concatenate(found)) if found else np.zeros(0, np.int64)
    assert len(np.unique(keys)) == len(keys), "a pair came twice"
    return keys


@pytest.mark.parametrize("sample", SAMPLES, ids=lambda path: path.stem)
def test_gatherers_agree_on_a_sample(sample):
    bpy.ops.wm.open_mainfile(filepath=str(sample), load_ui=False, use_scripts=False)
    read = read_scene(bpy.context.scene, bpy.context.view_layer, None, "CORNER")
    generator = np.random.default_rng(11)
    rows = np.sort(generator.choice(len(read.centres), min(1000, len(read.centres)), replace=False))
    size = read.scene.bounds.radius
    tracer = PhotonTracer(read.scene, RayCaster(read.scene.corners), read.scene.bounds.expanded(0.3 * size), 64)
    segments = tracer.trace(4000, generator).segments
    for share in (0.003, 0.03, 0.3):
        discs = TangentDiscs.of_radius(read.centres[rows], read.normals[rows], share * size)
        expected = pairs(BruteForce(discs), segments)
        assert share < 0.3 or len(expected) > 1000
        searches = [DiscIndex(discs), SphereCache(discs), SphereCache(discs, q=0.9)]
        for search in searches:
            found = pairs(search, segments)
            missing, extra = np.setdiff1d(expected, found), np.setdiff1d(found, expected)
            assert len(missing) == len(extra) == 0, f"{search.name}: {len(missing)} missing, {len(extra)} too many"
