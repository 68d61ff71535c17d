"""Direct light of whole scenes: shadow rays against the error, as it claims to be and as it is.

    python tools/benchmark_direct.py SCENE.blend ... [--points 6000] [--error 0.01] [--check 500]

For each scene a bake of direct light alone, at points drawn at random, goes on until it claims that error. After each
step the rays so far are printed, the claimed error (core/irradiance.py), and the true one at some of the points, by
DirectLight itself with another seed and MOST rounds: that tells how noisy the light is; whether it is right, the tests
tell. Rays are what to compare, since seconds depend on the machine.
"""

import argparse
import time
from pathlib import Path

import bpy
import numpy as np
from detp.core.direct.direct_light import DirectLight
from detp.core.direct.lit_scene import LitScene
from detp.core.estimator.standpoints import Standpoints, standpoints
from detp.core.irradiance import Irradiance
from detp.core.rays import RayCaster
from detp.core.refinement import Refinement, first_rounds
from detp.core.settings import BakeSettings
from detp.core.stages import Stopwatch
from detp.detp_addon.chosen_objects import chosen_objects
from detp.detp_addon.reading.read_scene import read_scene

#: Rounds of the reference.
MOST = 4096


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", type=Path)
    parser.add_argument("--points", type=int, default=6000)
    parser.add_argument("--error", type=float, default=0.01)
    parser.add_argument("--check", type=int, default=500)
    arguments = parser.parse_args()
    for path in arguments.scenes:
        scene, caster, points, normals = opened(path, arguments.points)
        print(f"{path.stem}: {len(scene.triangles)} triangles, {len(points)} points", flush=True)
        some = np.random.default_rng(1).permutation(len(points))[: arguments.check]
        lit = LitScene(scene, caster)
        reference = DirectLight(lit, points[some], normals[some], BakeSettings(indirect="off", seed=1))
        for _ in reference.rounds(0, 1 if reference.exact else MOST):
            pass
        measure(lit, points, normals, arguments.error, some, reference.irradiance.value.sum(axis=1))


def opened(path: Path, count: int):
    """The scene, its caster, and points with normals, drawn among those of all visible meshes' face corners."""
    bpy.ops.wm.open_mainfile(filepath=str(path))
    scene, layer = bpy.context.scene, bpy.context.view_layer
    export = read_scene(scene, layer, chosen_objects(scene, layer, "visible"), "CORNER")
    caster = RayCaster(export.scene.corners)
    places = Standpoints.joined(list(standpoints(caster, export.centres, export.facing, export.inward)))
    free = np.flatnonzero(~places.enclosed)
    rows = np.sort(np.random.default_rng(3).permutation(free)[:count])
    return export.scene, caster, places.origins[rows], export.normals[rows]


def measure(lit_scene, points, normals, error, some, reference) -> None:
    settings = BakeSettings(error=error, indirect="off")
    light = DirectLight(lit_scene, points, normals, settings)
    start = time.perf_counter()
    for _ in light.rounds(0, first_rounds(light, settings, start)):
        pass
    refinement = Refinement(settings, light, None, Stopwatch("shadow", "trace", "gather"), start)
    dark, lit = Irradiance.dark(len(points)), reference > 0
    while True:
        found = light.irradiance
        off = np.abs(found.value.sum(axis=1)[some] - reference)[lit] / reference[lit]
        print(
            f"{light.done:5d} rounds {light.rays / 1e6:8.2f} M rays, claimed {found.relative_error:.4f}, true median "
            f"{np.median(off):.4f}, root mean square {np.sqrt(np.mean(np.minimum(off, 0.5) ** 2)):.4f}",
            flush=True,
        )
        refinement.observe(found, dark, found, found.relative_error)
        step = refinement.next()
        if step is None:
            return
        for _ in light.rounds(light.done, light.done + step.rounds):
            pass


if __name__ == "__main__":
    main()
