"""Whole bakes of several scenes: seconds, peak memory, true error, and Cycles' time at equal error from the same run.

    python tools/benchmark_bakes.py SCENE.blend ... -o FOLDER [--bakes preview,error] [--samples 4,16] [--runs 3]

For each scene, `detp tradeoff` measures errors and times in a process of its own (everything it writes, the reference
too, is kept in FOLDER/<scene> and used again), and then `detp bake` does each of the bakes once more as a command,
whose peak memory and whole time, start-up, reading and saving the file included, are those of its process. The table
goes to FOLDER/benchmarks.md. What the columns mean, and why the comparison is fair, see docs/tradeoff.md.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from detp.detp_addon.tables import markdown_table

PROGRAM = "from detp.detp_addon.command.console import console; console()"

RATIOS = ("button", "button, set-up once", "one object", "one object, set-up once")
COLUMNS = ("scene", "objects", "corners", "bake", "runs", "s", "error", "estimated", "95 %", "photons", *RATIOS,
           "command s", "peak GB")  # fmt: skip


def main() -> int:
    arguments = parse()
    rows, machines, failed = [], [], 0
    arguments.output.mkdir(parents=True, exist_ok=True)
    stems = [scene.stem for scene in arguments.scenes]
    for scene in arguments.scenes:
        name = scene.stem if stems.count(scene.stem) == 1 else f"{scene.parent.name}_{scene.stem}"
        done, said = tradeoff(scene, arguments.output / name, arguments)
        if done is None:
            failed += 1
            rows.append([name, *["" for _ in COLUMNS[2:]], said])
            print(f"{name}: {said}", flush=True)
            continue
        machines.append(json.dumps({**done["machine"], "load before": None}))
        for run in done["runs"]:
            if run["who"] == "detp":
                seconds, memory = command(scene, run["options"], arguments.timeout)
                rows.append(row(name, done["points"], run, seconds, memory))
                print(" | ".join(rows[-1]), flush=True)
        text = "\n\n".join([*dict.fromkeys(machines), markdown_table(COLUMNS, rows)])
        (arguments.output / "benchmarks.md").write_text(text + "\n", encoding="utf-8")
    return 1 if failed else 0


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", type=Path)
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--bakes", default="quality")
    parser.add_argument("--samples", default="4,16", help="of Cycles")
    parser.add_argument("--runs", default="3")
    parser.add_argument("--points", default="3000")
    parser.add_argument("--reference-samples", default="1024")
    parser.add_argument("--cycles-seconds", default="60", help="most of one bake of Cycles")
    parser.add_argument("--timeout", type=float, default=3600.0, help="seconds for all of a scene's rounds")
    return parser.parse_args()


def tradeoff(scene: Path, folder: Path, arguments: argparse.Namespace) -> tuple[dict | None, str]:
    """What `detp tradeoff` wrote, after the rounds that it did in time, or None and why."""
    names = ("bakes", "samples", "runs", "points", "reference_samples", "cycles_seconds")
    options = [part for name in names for part in (f"--{name.replace('_', '-')}", getattr(arguments, name))]
    written = folder / "tradeoff.json"
    written.unlink(missing_ok=True)
    try:
        finished = subprocess.run(
            [sys.executable, "-c", PROGRAM, "tradeoff", str(scene), "-o", str(folder), *options],
            stderr=subprocess.PIPE, text=True, timeout=arguments.timeout,
        )  # fmt: skip
        failure = (finished.stderr.strip().splitlines() or [f"exit status {finished.returncode}"])[-1]
    except subprocess.TimeoutExpired:
        failure = f"not done in {arguments.timeout:g} s"
    return (json.loads(written.read_text(encoding="utf-8")), "") if written.exists() else (None, failure)


def command(scene: Path, options: list[str], timeout: float) -> tuple[float, float]:
    """Seconds and peak memory in GB of a `detp bake` in a process of its own; NaN when it fails."""
    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        process = subprocess.Popen(
            [sys.executable, "-c", PROGRAM, "bake", str(scene), "-o", f"{folder}/baked.blend", "--quiet", *options]
        )
        # Popen.wait() does not tell the resources that the process used.
        while True:
            ended, status, used = os.wait4(process.pid, os.WNOHANG)
            if ended:
                break
            if time.perf_counter() - start > timeout:
                process.kill()
            time.sleep(0.02)
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode:
            return float("nan"), float("nan")
        unit = 1 if sys.platform == "darwin" else 1024
        return time.perf_counter() - start, used.ru_maxrss * unit / 1e9


def row(name: str, points: dict, run: dict, seconds: float, memory: float) -> list[str]:
    def percent(value: float | None) -> str:
        return "" if value is None else f"{100 * value:.2g} %"

    return [
        name, str(points["objects"]), str(points["corners"]), run["label"], str(run["runs"]), f"{run['seconds']:.2f}",
        percent(run["error"]), percent(run["estimated_error"]), percent(run["error 95"]), str(run["photons"]),
        *("" if run.get(ratio) is None else f"{run[ratio]:.3g}" for ratio in RATIOS),
        f"{seconds:.1f}", f"{memory:.2f}",
    ]  # fmt: skip


if __name__ == "__main__":
    sys.exit(main())
