"""How many photon path segments per second each gatherer searches, over the number of points and the radius.

The scene is a closed room with boxes in it, points strewn over all surfaces, and segments that bounce diffusely
from surface to surface. Beside each rate stands its ratio to that of Embree in the same run, with all processors: the
first hits, and nothing else, of the same segments in the same room as a mesh with as many vertices as there are points.
All are medians. Run it with the package installed:

    python tools/benchmark_gatherers.py --points 10000 45000 --spacings 0.3 1 3 --seconds 2
"""

from __future__ import annotations

import argparse
import platform
import sys
import time

import numpy as np
from detp.core import parallel
from detp.core.discs import TangentDiscs
from detp.core.gatherers.brute_force import BruteForce
from detp.core.gatherers.disc_index import DiscIndex
from detp.core.gatherers.sphere_cache import SphereCache
from detp.core.rays import RayCaster
from detp.core.sampling import cosine_hemisphere
from detp.core.segments import Segments
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

RUNS = 3
ROOM = np.array([[0.0, 0.0, 0.0], [4.0, 3.0, 2.5]])
BOXES = np.array(
    [
        [[0.5, 0.5, 0.0], [1.2, 1.3, 0.8]],
        [[2.2, 0.4, 0.0], [3.4, 1.0, 0.5]],
        [[1.6, 1.9, 0.0], [2.3, 2.5, 1.4]],
        [[3.0, 1.9, 0.6], [3.7, 2.6, 0.7]],
        [[0.3, 2.2, 0.0], [0.9, 2.8, 0.4]],
    ]
)
GATHERERS = {kind.name: kind for kind in (DiscIndex, SphereCache, BruteForce)}


def faces() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Lower and upper corners (F, 3) of the room's and the boxes' sides, and their normals into the room."""
    lower, upper, normals = [], [], []
    for box, inwards in [(ROOM, 1.0), *((box, -1.0) for box in BOXES)]:
        for axis in range(3):
            for side in range(2):
                corners = box.copy()
                corners[:, axis] = box[side, axis]
                lower.append(corners[0])
                upper.append(corners[1])
                normals.append(inwards * (1 - 2 * side) * np.eye(3)[axis])
    return np.array(lower), np.array(upper), np.array(normals)


def room_mesh(spacing: float) -> np.ndarray:
    """Triangles (T, 3, 3) of the room, whose vertices are about ``spacing`` apart."""
    triangles = []
    for lower, upper, _ in zip(*faces(), strict=True):
        u, v = np.flatnonzero(upper > lower)
        ticks = [np.linspace(lower[k], upper[k], 2 + int((upper - lower)[k] / spacing)) for k in (u, v)]
        grid = np.broadcast_to(lower, (len(ticks[0]), len(ticks[1]), 3)).copy()
        grid[..., u], grid[..., v] = np.meshgrid(*ticks, indexing="ij")
        one, other = grid[1:, :-1], grid[:-1, 1:]
        for corner in (grid[:-1, :-1], grid[1:, 1:]):
            triangles.append(np.stack([corner, one, other], axis=2).reshape(-1, 3, 3))
    return np.concatenate(triangles)


def embree_rate(spacing: float, segments: Segments) -> float:
    """First hits per second that Embree finds of all ``segments``, with all processors."""
    scene = EmbreeScene()
    mesh = TriangleMesh(scene, room_mesh(spacing).astype(np.float32))
    step = segments.ends - segments.origins
    directions = (step / np.linalg.norm(step, axis=1)[:, None]).astype(np.float32)
    origins = (segments.origins + 1e-5 * step).astype(np.float32)
    scene.run(origins[:1], directions[:1])  # commits the scene
    slices = [slice(start, start + (1 << 15)) for start in range(0, len(origins), 1 << 15)]
    seconds = []
    for _ in range(RUNS):
        begin = time.perf_counter()
        for _ in parallel.ordered_map(lambda rows: scene.run(origins[rows], directions[rows]), slices):
            pass
        seconds.append(time.perf_counter() - begin)
    del mesh
    return len(origins) / float(np.median(seconds))


def room_points(count: int, generator: np.random.Generator) -> tuple[np.ndarray, np.ndarray, float]:
    """``count`` points on the room's and the boxes' surfaces, by area, their normals into the room, their spacing."""
    lower, upper, normals = faces()
    size = upper - lower
    areas = np.prod(np.where(size > 0, size, 1.0), axis=1)
    face = generator.choice(len(areas), size=2 * count + 100, p=areas / areas.sum())
    points = lower[face] + generator.random((len(face), 3)) * size[face]
    # What stands on the floor hides it, and is itself hidden from below.
    hidden = (points[:, 2] == 0.0) & np.any(
        [(box[0, 2] == 0) & ((points >= box[0]) & (points <= box[1]))[:, :2].all(axis=1) for box in BOXES], axis=0
    )
    seen = np.flatnonzero(~hidden)[:count]
    return points[seen], normals[face[seen]], float(np.sqrt(areas.sum() * (~hidden).mean() / count))


def bounces(count: int, generator: np.random.Generator) -> Segments:
    """``count`` segments of cosine-distributed paths through the room, each longer by a millionth than its way."""
    points, normals, _ = room_points(max(1, count // 8), generator)
    caster = RayCaster(room_mesh(np.inf))
    origins, ends = [], []
    while sum(map(len, origins)) < count:
        directions = cosine_hemisphere(normals, generator.random((len(points), 2)))
        hits = caster.first_hits(points + caster.tolerance(points)[:, None] * normals, directions)
        rows = np.flatnonzero(hits.triangle >= 0)
        points, directions, places = points[rows], directions[rows], hits.points[rows]
        origins.append(points)
        ends.append(points + (places - points) * (1 + 1e-6))
        normals = caster.normals[hits.triangle[rows]]
        normals *= -np.sign(np.einsum("ij,ij->i", normals, directions))[:, None]
        points = places
    return Segments.between(np.concatenate(origins)[:count], np.concatenate(ends)[:count])


def measure(make, discs: TangentDiscs, segments: Segments, seconds: float) -> dict:
    """Build a gatherer and search as many of the segments as take about ``seconds``, medians of RUNS."""
    building = []
    for _ in range(RUNS):
        begin = time.perf_counter()
        gatherer = make(discs)
        building.append(time.perf_counter() - begin)
    rows, elapsed = 512, 0.0
    while elapsed < 0.1 * seconds and rows < len(segments):
        rows = min(4 * rows, len(segments))
        elapsed, *_ = _search(gatherer, segments, rows)
    rows = max(1, min(len(segments), int(rows * seconds / elapsed)))
    runs = sorted(_search(gatherer, segments, rows) for _ in range(RUNS))
    elapsed, crossings, step = runs[RUNS // 2]
    build = float(np.median(building))
    return {"build": build, "rows": rows, "rate": rows / elapsed, "crossings": crossings / rows, "step": step}


def _search(gatherer, segments: Segments, rows: int) -> tuple[float, int, float]:
    part = segments.taken(slice(rows))
    begin = last = time.perf_counter()
    crossings, longest = 0, 0.0
    for chunk in gatherer.crossings(part):
        crossings += len(chunk)
        now = time.perf_counter()
        longest, last = max(longest, now - last), now
    return time.perf_counter() - begin, crossings, longest


def main() -> int:
    """Print one row per gatherer, number of points and radius."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--points", type=int, nargs="+", default=[10_000, 45_000, 200_000])
    parser.add_argument("--spacings", type=float, nargs="+", default=[0.3, 1.0, 3.0], help="radius / mean spacing")
    parser.add_argument("--segments", type=int, default=1 << 20, help="most segments of a batch")
    parser.add_argument("--seconds", type=float, default=2.0, help="about how long each of three runs takes")
    parser.add_argument("--gatherers", nargs="+", choices=GATHERERS, default=list(GATHERERS))
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    generator = np.random.default_rng(options.seed)
    segments = bounces(options.segments, generator)
    length = np.linalg.norm(segments.ends - segments.origins, axis=1).mean()
    print(f"NumPy {np.__version__}, Python {platform.python_version()}, {parallel.worker_count()} threads; ", end="")
    print(f"room {' x '.join(map(str, ROOM[1]))} m, segments of {length:.2f} m on average; medians of {RUNS} runs\n")
    print("| points | radius / spacing | gatherer | build s | segments", end=" ")
    print("| crossings / segment | segments / s | of Embree | step s |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    for count in options.points:
        points, normals, spacing = room_points(count, generator)
        embree = embree_rate(spacing, segments)
        print(f"| {count} | | Embree's first hits | | {len(segments)} | | {embree:.3g} | 1 | |", flush=True)
        for ratio in options.spacings:
            discs = TangentDiscs.of_radius(points, normals, ratio * spacing)
            for name in options.gatherers:
                got = measure(GATHERERS[name], discs, segments, options.seconds)
                print(
                    f"| {count} | {ratio:g} | {name} | {got['build']:.2f} | {got['rows']} | {got['crossings']:.2f} "
                    f"| {got['rate']:.3g} | {got['rate'] / embree:.2g} | {got['step']:.2f} |",
                    flush=True,
                )
    return 0


if __name__ == "__main__":
    sys.exit(main())
