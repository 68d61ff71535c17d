"""Writes docs/extremes.md: every case of tests/analytic/extreme_cases.py and extent_cases.py with more photons.

    python tools/measure_extremes.py [-o docs/extremes.md] [--size 5] [--objects 20000]

With ``--objects`` a scene of so many objects that share one mesh is made and baked through Blender too. The exit status
says whether every case came out as expected.
"""

import argparse
import platform
import sys
from pathlib import Path

import numpy as np
from detp.detp_addon.tables import markdown_table

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests" / "analytic"))

import extent_cases  # noqa: E402, F401 the folder has just been made known; it adds its cases
from extreme_cases import CASES, Case  # noqa: E402

HEADING = """# The numerical extremes

Made by `python tools/measure_extremes.py --objects 20000`, which runs the cases of tests/analytic/extreme_cases.py and
extent_cases.py with more photons than the tests do. Unless it says otherwise a case of the former bakes with both
estimators, and with direct light by photons and by shadow rays; *sigma* is the reported standard error.
"""


def main() -> int:
    options = parse()
    cases = list(CASES)
    if options.objects:
        cases.append(many_objects(options.objects))
    versions = f"NumPy {np.__version__}, Python {platform.python_version()}, {platform.machine()}"
    lines = [HEADING, f"{options.size:g} times the photons of the tests; {versions}.", ""]
    rows = []
    for case in cases:
        measured, as_expected = case.run(options.size)
        rows.append([case.name, case.expected, measured, "yes" if as_expected else "**no**"])
        print(rows[-1], flush=True)
    lines.append(markdown_table(("case", "expected", "measured", "verdict"), rows))
    options.output.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return 1 if any(row[-1] != "yes" for row in rows) else 0


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "docs" / "extremes.md")
    parser.add_argument("--size", type=float, default=5.0, help="times the photons of the tests")
    parser.add_argument("--objects", type=int, default=0, help="objects of the scene made in Blender, 0 for none")
    return parser.parse_args()


def many_objects(count: int) -> Case:
    return Case(
        f"{count} Blender objects that share one mesh", "the ground gets its light", lambda size: _baked_objects(count)
    )


def _baked_objects(count: int) -> tuple[str, bool]:
    """Bakes the ground under a cloud of ``count`` cubes, all one mesh, in a new Blender scene."""
    import bpy
    from detp.core.settings import BakeSettings
    from detp.core.stages import finished
    from detp.detp_addon.job import bake_scene
    from detp.detp_addon.request import BakeRequest
    from detp.detp_addon.writing.baked_layers import stored_colours

    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    bpy.ops.mesh.primitive_cube_add(size=0.01)
    mesh = bpy.context.object.data
    for place in np.random.default_rng(4).uniform((-5, -5, 0.5), (5, 5, 4), (count - 1, 3)):
        cube = bpy.data.objects.new("Cube", mesh)
        cube.location = place
        scene.collection.objects.link(cube)
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=20, y_subdivisions=20, size=10)
    ground = bpy.context.object
    bpy.ops.object.light_add(type="SUN")
    bpy.context.object.data.energy = 1.0
    bpy.context.object.data.angle = 0.0
    request = BakeRequest(BakeSettings(quality="draft"), (ground.name,), quantity="irradiance")
    report = finished(bake_scene(scene, bpy.context.view_layer, request))
    light = stored_colours(ground.data.attributes["irradiance"])[:, :3]
    text = f"E from {light.min():.2f} to {light.max():.2f}; {report.triangles} triangles"
    return text, bool(np.isfinite(light).all() and 0.5 < np.median(light) < 1.2)


if __name__ == "__main__":
    sys.exit(main())
