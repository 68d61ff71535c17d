"""What try_reliability.py found, counted and told: were the outputs whole, and which faults were there of each kind."""

import os
import platform
import shutil
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

import hostile_files
from detp.detp_addon.tables import markdown_table

OUTPUTS = ("out.blend", "r.json", "p.png")
#: opens each file that is named, one a line, in Blender; says which it cannot
REOPEN = """import bpy, os, sys
for path in sys.stdin.read().splitlines():
    try: bpy.ops.wm.open_mainfile(filepath=path, use_scripts=False)
    except RuntimeError: print("BROKEN", path)
    else: print("BROKEN" if "irradiance" not in bpy.data.meshes[0].attributes else "WHOLE", path)
sys.stdout.flush(); os._exit(0)"""


class Trials:
    """Counts what happened by kind, and keeps the saved scenes to open them all in the end."""

    def __init__(self, kept: Path):
        self.rows = defaultdict(lambda: {"trials": 0, "seconds": 0.0, "faults": []})
        self._kept = kept

    def note(self, kind: str, seconds: float, faults: list[str]) -> None:
        """Count one trial."""
        row = self.rows[kind]
        row["trials"] += 1
        row["seconds"] = max(row["seconds"], seconds)
        row["faults"] += faults
        print(f"{kind}: {seconds:.2f} s {'; '.join(faults)}", flush=True)

    def outputs(self, folder: Path, old: bool, done: bool, drawn: bool = True) -> list[str]:
        """Faults of the outputs: each must be whole and new or, unless ``done``, what it was: b"old", or nothing."""
        faults = []
        for name in OUTPUTS:
            path = folder / name
            content = path.read_bytes() if path.exists() else b""
            if content == (b"old" if old else b""):
                faults += [f"{name} is missing"] if done and (drawn or name != "p.png") else []
            elif name.endswith(".blend"):
                shutil.copy(path, self._kept / f"{len(os.listdir(self._kept))}.blend")
            elif not (hostile_files.whole_json if name == "r.json" else hostile_files.whole_png)(content):
                faults.append(f"{name} is not whole")
        return faults

    def reopened(self) -> str:
        """Open every saved scene in Blender; a sentence on how many are whole."""
        names = "\n".join(str(path) for path in self._kept.iterdir())
        said = subprocess.run([sys.executable, "-c", REOPEN], input=names, capture_output=True, text=True).stdout
        return f"Blender opened {said.count('WHOLE /')} of {len(names.splitlines())} scenes that these runs had saved."


def table(trials: Trials, options) -> str:
    """The page docs/reliability.md."""
    lines = [
        "# Reliability", "",
        f"Made by `python tools/try_reliability.py --interrupts {options.interrupts} --disks {options.disks} --scenes "
        f"{options.scenes} --seed {options.seed}` on {platform.system()}, {os.cpu_count()} cores.", "",
        "Each row counts bakes of a box on a floor with a report and, now and then, a preview, over older files, a "
        "hostile file, one of the numerical extremes ([extremes.md](extremes.md) has them with more photons), or "
        "random broken scenes ([fuzzing.md](fuzzing.md)). A fault is: another exit status than 128 + the signal, more "
        "than 2 s to end after a signal, a file that is neither whole and new nor what it was, a message that does not "
        "name the cause, anything left behind (after SIGKILL: by the run after it), a control character on a terminal, "
        "light that is not what is known, a traceback, or a hang. A signal that comes before the program's first line "
        "ends Python as it ends any of its programs, by the signal or with a traceback.", "",
        markdown_table(
            ("what", "trials", "longest, s", "faults"),
            ((kind, str(row["trials"]), f"{row['seconds']:.2f}", "; ".join(row["faults"]) or "none")
             for kind, row in sorted(trials.rows.items())),
        ), "",
        "In rows with a signal *longest* is from the signal to the end of the process, in the others the whole run.",
        trials.reopened(), "",
    ]  # fmt: skip
    return "\n".join(lines)
