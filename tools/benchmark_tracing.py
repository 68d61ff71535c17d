"""How many rays per second photon tracing follows in .blend scenes, beside Embree's bare rate for the very same rays.

Embree gets the rays of a trace as float32 arrays that lie ready, and finds first hits and nothing else, on all
processors. Tracing emits particles, finds their hits, decides what becomes of them and keeps their segments, on all
processors too. Both are taken in turns; all figures are medians. With ``--direct`` the segments straight from the
lights are kept. Needs bpy; run it with the package installed:

    python tools/benchmark_tracing.py sample_blends/*.blend
"""

from __future__ import annotations

import argparse
import platform
import time
from pathlib import Path

import bpy
import numpy as np
from detp.core import parallel
from detp.core.photons.photon_light import PHOTONS_PER_TRACE
from detp.core.photons.tracing import PhotonTracer
from detp.core.rays import RAYS_PER_SLICE, RayCaster
from detp.core.scene import Scene
from detp.detp_addon.reading.read_scene import read_scene
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

RUNS = 5


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", type=Path, nargs="+")
    parser.add_argument("--traces", type=int, default=8, help=f"of {PHOTONS_PER_TRACE} particles in one run")
    parser.add_argument("--direct", action="store_true", help="keep the segments straight from the lights")
    options = parser.parse_args()
    print(f"{parallel.worker_count()} processors, {platform.machine()}, NumPy {np.__version__}\n")
    print("| scene | rays per particle | tracing, million rays/s | Embree, million rays/s | ratio |")
    print("| --- | --- | --- | --- | --- |", flush=True)
    for path in options.scenes:
        scene = loaded(path)
        traced, bare, share = rates(scene, options.traces, options.direct)
        print(
            f"| {path.stem} | {share:.2f} | {traced / 1e6:.2f} | {bare / 1e6:.2f} | {traced / bare:.0%} |", flush=True
        )


def loaded(path: Path) -> Scene:
    """The scene of a .blend file, as a bake sees it."""
    bpy.ops.wm.open_mainfile(filepath=str(path), load_ui=False, use_scripts=False)
    return read_scene(bpy.context.scene, bpy.context.view_layer, None, "CORNER").scene


def rates(scene: Scene, traces: int, direct: bool) -> tuple[float, float, float]:
    """Rays per second of tracing and of Embree alone, and rays per particle."""
    caster = RayCaster(scene.corners)
    bounds = scene.bounds.expanded(1e-4 * scene.bounds.radius)
    tracer = PhotonTracer(scene, caster, bounds, 64, direct)
    near, towards = rays_of(caster, PhotonTracer(scene, caster, bounds, 64))
    embree = EmbreeScene()
    mesh = TriangleMesh(embree, as_embree_sees(caster, scene.corners))
    embree.run(near[:1], towards[:1])  # commits the scene
    share = len(near) / PHOTONS_PER_TRACE
    tracing, bare = [], []
    for _ in range(RUNS):
        start = time.perf_counter()
        for _ in parallel.ordered_map(
            lambda seed: tracer.trace(PHOTONS_PER_TRACE, np.random.default_rng(seed)), range(traces)
        ):
            pass
        tracing.append(traces * PHOTONS_PER_TRACE * share / (time.perf_counter() - start))
        slices = [slice(at, at + RAYS_PER_SLICE) for at in range(0, len(near), RAYS_PER_SLICE)] * traces
        start = time.perf_counter()
        for _ in parallel.ordered_map(lambda rows: embree.run(near[rows], towards[rows], output=1), slices):
            pass
        bare.append(len(near) * traces / (time.perf_counter() - start))
    del mesh
    return float(np.median(tracing)), float(np.median(bare)), share


def rays_of(caster: RayCaster, tracer: PhotonTracer) -> tuple[np.ndarray, np.ndarray]:
    """The rays of one trace as Embree gets them, in the order in which tracing casts them."""
    segments = tracer.trace(PHOTONS_PER_TRACE, np.random.default_rng(0)).segments
    along = segments.ends - segments.origins
    along /= np.linalg.norm(along, axis=1)[:, None]
    return as_embree_sees(caster, segments.origins), along.astype(np.float32)


def as_embree_sees(caster: RayCaster, points: np.ndarray) -> np.ndarray:
    """``points`` (..., 3) m centred and scaled as in core/rays.py."""
    return np.ascontiguousarray(((points - caster.centre) / caster.radius).astype(np.float32))


if __name__ == "__main__":
    main()
