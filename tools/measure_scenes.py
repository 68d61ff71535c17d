"""Bakes every .blend of a folder with several gatherers through the real command, and writes a table of what happened.

    python tools/measure_scenes.py FOLDER -o TABLE.md [--quality draft] [--gatherers disc-index,sphere-cache]

Baked files go to a temporary folder; what the command printed on a failure is shown, and the exit status says whether
every bake succeeded.
"""

import argparse
import json
import os
import platform
import subprocess
import sys
import tempfile
from pathlib import Path

COLUMNS = (
    "scene | gatherer | objects | points | triangles | photons | segments | radius | "
    "export s | trace s | gather s | total s | error | left out and warnings"
)


def main() -> int:
    arguments = parse()
    scenes = sorted(arguments.folder.glob("*.blend"))
    rows, failed = [], 0
    with tempfile.TemporaryDirectory() as folder:
        for scene in scenes:
            for gatherer in arguments.gatherers.split(","):
                entry, output = measured(scene, gatherer, arguments.quality, Path(folder))
                failed += "error" in entry
                rows.append(row(scene.stem, gatherer, entry))
                print(rows[-1] if "error" not in entry else f"{rows[-1]}\n{output}", flush=True)
    version = subprocess.run([sys.executable, "-m", "pip", "list", "--format=freeze"], capture_output=True, text=True)
    packages = [line for line in version.stdout.splitlines() if line.split("==")[0] in ("bpy", "numpy", "embreex")]
    heading = f"Quality {arguments.quality}; {os.cpu_count()} cores, {platform.machine()}, {', '.join(packages)}."
    table = [f"| {COLUMNS} |", "|" + " --- |" * (COLUMNS.count("|") + 1), *rows]
    arguments.output.write_text("\n".join([heading, "", *table, ""]), encoding="utf-8")
    return 1 if failed else 0


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--quality", default="draft")
    parser.add_argument("--gatherers", default="disc-index,sphere-cache")
    return parser.parse_args()


def measured(scene: Path, gatherer: str, quality: str, folder: Path) -> tuple[dict, str]:
    """The report's entry of one bake, and all that the command printed."""
    report = folder / "report.json"
    program = "from detp.detp_addon.command.console import console; console()"
    command = [sys.executable, "-c", program, "bake", str(scene), "-o", str(folder / "baked.blend"),
               "--quality", quality, "--gatherer", gatherer, "--report", str(report)]  # fmt: skip
    finished = subprocess.run(command, capture_output=True, text=True)
    output = finished.stdout + finished.stderr
    if "Traceback" in output or not report.exists():
        return {"error": "traceback"}, output
    entry = json.loads(report.read_text(encoding="utf-8"))[0]
    report.unlink()
    return entry, output


def row(name: str, gatherer: str, entry: dict) -> str:
    if "error" in entry:
        return f"| {name} | {gatherer} | {entry['error']} |" + " |" * (COLUMNS.count("|") - 2)
    seconds = entry["seconds"]
    error = "dark" if entry["relative_error"] is None else f"{entry['relative_error']:.1%}"
    cells = [
        name, gatherer, *(f"{entry[key]:,}".replace(",", " ") for key in ("objects", "points", "triangles")),
        f"{entry['photons']:,}".replace(",", " "), f"{entry['segments']:,}".replace(",", " "), f"{entry['radius']:.3g}",
        *(f"{seconds[key]:.1f}" for key in ("export", "trace", "gather", "total")), error,
        f"{len(entry['left_out'])} + {len(entry['warnings'])}",
    ]  # fmt: skip
    return "| " + " | ".join(cells) + " |"


if __name__ == "__main__":
    sys.exit(main())
