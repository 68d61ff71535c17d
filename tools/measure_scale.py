"""Bakes scenes by the command, and says how long each phase took and the most memory that was held in it.

    python tools/measure_scale.py SCENE.blend … [-- OPTIONS OF detp bake]

Linux only. Memory is the resident set, read twenty times a second.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

CALL = "from detp.detp_addon.command.console import console; console()"


def main() -> None:
    words = sys.argv[1:]
    at = words.index("--") if "--" in words else len(words)
    for scene in map(Path, words[:at]):
        with tempfile.TemporaryDirectory() as folder:
            _measure(scene, [*words[at + 1 :], "-o", str(Path(folder) / "baked.blend")])


def _measure(scene: Path, options: list[str]) -> None:
    begin = time.perf_counter()
    command = [sys.executable, "-u", "-c", CALL, "bake", str(scene), *options]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    phases: list[list] = [["Starting and opening", begin, 0]]
    threading.Thread(target=_watch, args=(process, phases), daemon=True).start()
    for line in process.stdout:
        phase = line.strip().removeprefix(f"{scene.stem}: ").rpartition(", ")[0]
        if line.startswith(f"{scene.stem}: ") and phase:
            _tell(phases[-1])
            phases.append([phase, time.perf_counter(), 0])
        else:
            print(f"  {line.rstrip()}", flush=True)
    status = process.wait()
    _tell(phases[-1])
    most, seconds = max(peak for *_, peak in phases) / 1e9, time.perf_counter() - begin
    print(f"{scene.name}: {seconds:.0f} s, {most:.2f} GB, exit status {status}", flush=True)


def _tell(phase: list) -> None:
    name, start, peak = phase
    print(f"  {time.perf_counter() - start:7.1f} s  {peak / 1e9:6.2f} GB  {name}", flush=True)


def _watch(process: subprocess.Popen, phases: list[list]) -> None:
    """Note the memory that the process holds, with the phase that it is in."""
    page = 4096
    while process.poll() is None:
        try:
            held = page * int(Path(f"/proc/{process.pid}/statm").read_text().split()[1])
        except (OSError, IndexError):
            return
        phases[-1][2] = max(phases[-1][2], held)
        time.sleep(0.05)


if __name__ == "__main__":
    main()
