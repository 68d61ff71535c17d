"""Interrupts, kills, full disks, hostile files, extremes, broken scenes: what becomes of files and light, as a table.

    python tools/try_reliability.py -o docs/reliability.md [--interrupts 200] [--disks 24] [--scenes 1000] [--seed 0]

Full disks are small ones made in memory, which only an administrator may mount; others get a limit on file sizes.
"""

import argparse
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import chain
from pathlib import Path

import hostile_files
import light_trials
from reliability_trials import OUTPUTS, Trials, table

PROGRAM = [sys.executable, "-c", "from detp.detp_addon.command.console import console; console()", "bake"]
#: seconds that a process may take to end after a signal, and that any may take at all
PROMPT, LONGEST = 2.0, 300.0


def leftovers(*folders: Path) -> list[str]:
    return [f"left {path.name}" for folder in folders for path in folder.iterdir() if path.name.startswith(".detp")]


def arguments_in(folder: Path, drawn: bool = True) -> list[str]:
    scene, report, picture = (str(folder / name) for name in OUTPUTS)
    quick = ["--photons", "20000", "--radius", "0.3", "--indirect", "off", "--fit", "vertices"]
    drawing = ["--preview", picture] if drawn else []
    return [str(folder / "scene.blend"), "-o", scene, "--report", report, *drawing, *quick]


def environment(temporary: Path) -> dict:
    return {**os.environ, "TMPDIR": str(temporary)}


def interrupt(trials: Trials, number: signal.Signals, moment: float, source: Path, folder: Path, drawn: bool) -> None:
    """Bake, send the signal after so many seconds, and look; after a kill another run must find nothing in its way."""
    temporary = folder / "tmp"
    temporary.mkdir()
    shutil.copy(source, folder / "scene.blend")
    for name in OUTPUTS:
        (folder / name).write_bytes(b"old")
    process = subprocess.Popen(
        [*PROGRAM, *arguments_in(folder, drawn)], env=environment(temporary), stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    time.sleep(moment)
    begin = time.perf_counter()
    process.send_signal(number)
    _, said = process.communicate(timeout=LONGEST)
    seconds, status = time.perf_counter() - begin, process.returncode
    # Python starts up in its first hundredths of a second, when a signal still ends it as it ends any of its programs.
    early = status == -number != -signal.SIGKILL or (
        status == 1 and "KeyboardInterrupt" in said and "detp_addon" not in said
    )
    faults = [] if status in (128 + number, 0, -signal.SIGKILL) or early else [f"exit {status}"]
    if status == 0 and seconds > 0.5:
        faults.append("swallowed")
    if seconds > PROMPT and status != 0:
        faults.append(f"took {seconds:.1f} s")
    if said.strip() not in ("", "detp: cancelled") and not early:
        faults.append(said.strip().splitlines()[-1])
    faults += trials.outputs(folder, old=True, done=status == 0, drawn=drawn)
    if (folder / "scene.blend").read_bytes() != source.read_bytes():
        faults.append("the scene was changed")
    if number == signal.SIGKILL:
        subprocess.run(
            [*PROGRAM, *arguments_in(folder, drawn=False)], env=environment(temporary), capture_output=True, check=True
        )
    faults += leftovers(folder, temporary)
    when = "before the program's first line" if early else "in the first 2 s" if moment < 2 else "later"
    trials.note(f"{number.name}, {when}", seconds, [f"{fault} at {moment:.2f} s" for fault in faults])


@contextmanager
def small_disk(size: int) -> Iterator[Path]:
    """A folder with room for ``size`` bytes."""
    with tempfile.TemporaryDirectory() as folder:
        mount = ["mount", "-t", "tmpfs", "-o", f"size={size // 4096 * 4096}", "detp", folder]
        mounted = subprocess.run(mount, capture_output=True).returncode == 0
        try:
            yield Path(folder)
        finally:
            if mounted:
                subprocess.run(["umount", folder], check=True)


def limited(size: int) -> None:
    """Let this process write no longer file, where no small disk can be mounted."""
    if os.geteuid() != 0:
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))


def fill(trials: Trials, share: float, need: int, source: Path, folder: Path) -> None:
    """Bake to a disk that has room for a ``share`` of what the outputs need."""
    with small_disk(int(share * need) + 4096 * len(OUTPUTS)) as disk:
        for name in OUTPUTS:
            (disk / name).write_bytes(b"old")
        arguments = arguments_in(disk)
        arguments[0] = str(source)
        begin = time.perf_counter()
        done = subprocess.run(
            [*PROGRAM, *arguments], env=environment(folder), capture_output=True, text=True, timeout=LONGEST,
            preexec_fn=lambda: limited(int(share * need)),
        )  # fmt: skip
        seconds = time.perf_counter() - begin
        faults = trials.outputs(disk, old=True, done=done.returncode == 0) + leftovers(disk, folder)
        if done.returncode == 1 and "disk is full" not in done.stderr:
            faults.append(done.stderr.strip())
        elif done.returncode not in (0, 1):
            faults.append(f"exit {done.returncode}")
    kind = "plain" if source.read_bytes().startswith(b"BLENDER") else "compressed"
    outcome = "all saved" if done.returncode == 0 else "refused"
    trials.note(f"disk with room for a part, {kind}: {outcome}", seconds, [f"{each} at {share:.0%}" for each in faults])


def needed(source: Path, drawn: bool = True) -> tuple[int, float]:
    """Bytes that all outputs of a bake of ``source`` take, and its seconds."""
    begin = time.perf_counter()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        subprocess.run([*PROGRAM, str(source), *arguments_in(folder, drawn)[1:]], capture_output=True, check=True)
        size = sum((folder / output).stat().st_size for output in OUTPUTS if (folder / output).exists())
    return size, time.perf_counter() - begin


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--interrupts", type=int, default=60)
    parser.add_argument("--disks", type=int, default=20)
    parser.add_argument("--scenes", type=int, default=0, help="broken ones, from number 10 000 times the seed on")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    for each in (signal.SIGINT, signal.SIGTERM):
        signal.signal(each, signal.default_int_handler)  # a shell's background job would hand down that it ignores them
    chance = random.Random(options.seed)
    with tempfile.TemporaryDirectory() as name:
        work = Path(name)
        (work / "kept").mkdir()
        trials = Trials(work / "kept")
        sources = hostile_files.both_kinds(work)
        needs = [needed(source)[0] for source in sources]
        whole = [needed(sources[0], drawn)[1] for drawn in (False, True)]
        for trial in range(options.interrupts):
            number = (signal.SIGINT, signal.SIGTERM, signal.SIGINT, signal.SIGKILL)[trial % 4]
            drawn = trial % 16 >= 12  # drawing takes longest
            moment = chance.uniform(0, 2) if trial % 8 < 4 else chance.uniform(2, whole[drawn])
            with tempfile.TemporaryDirectory() as folder:
                interrupt(trials, number, moment, sources[trial % 2], Path(folder), drawn)
        options.output.write_text(table(trials, options), encoding="utf-8")
        for trial in range(options.disks):
            with tempfile.TemporaryDirectory() as folder:
                share = 1.2 * (trial // 2) / max(1, options.disks // 2 - 1)
                fill(trials, share, needs[trial % 2], sources[trial % 2], Path(folder))
        broken = light_trials.broken_scenes(10_000 * options.seed, options.scenes)
        for found in chain(hostile_files.tried(PROGRAM, work), light_trials.extremes(), broken):
            trials.note(*found)
        options.output.write_text(table(trials, options), encoding="utf-8")
    return 1 if any(row["faults"] for row in trials.rows.values()) else 0


if __name__ == "__main__":
    sys.exit(main())
