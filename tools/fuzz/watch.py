"""Runs trials in a child process that may crash or hang without taking the rest along."""

from __future__ import annotations

import faulthandler
import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path

#: scenes after which a child makes room for a new one, since Blender keeps some memory of each
SCENES_PER_CHILD = 100

#: times the limit, by the clock, after which a child that waits for ever is killed
PATIENCE = 10.0

_CHILD = "import sys; sys.path.insert(0, {folder!r}); from fuzz.watch import {run}; {run}({arguments})"


def trials(seeds: Sequence[int], limit: float) -> Iterator[dict]:
    """The outcome of each seed, in order, as dicts with the keys of trial.Outcome.

    A child that crashes, or takes more than ``limit`` seconds of processor time for one scene, gives the verdict
    "crashed" or "hung" with the phase it was in and the Python stack there, and the next child goes on behind that
    seed. When Blender does the same on that scene before or without the bake, the verdict is "blender".
    """
    left = list(seeds)
    while left:
        for outcome in _from_child(left[:SCENES_PER_CHILD], limit):
            if outcome["verdict"] in ("crashed", "hung") and outcome["way"] == "making":
                # Blender may have failed on what the scene before left to be done: a fresh child tells.
                (outcome,) = _from_child([outcome["seed"]], limit)
            if outcome["verdict"] in ("crashed", "hung"):
                if outcome["way"] == "making" or _blender_fails_alone(outcome["seed"], limit):
                    outcome["verdict"] = "blender"
            yield outcome
            left.pop(0)


def _from_child(seeds: list[int], limit: float) -> Iterator[dict]:
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "log.txt"
        with open(log, "wb") as errors:
            process = subprocess.Popen(
                _command("child", seeds, limit), stdout=subprocess.PIPE, stderr=errors, cwd=folder, text=True
            )
        left, phase = list(seeds), "starting"
        while True:
            killer = threading.Timer(PATIENCE * limit, process.kill)
            killer.start()
            line = process.stdout.readline()
            killer.cancel()
            if not line:
                break
            entry = json.loads(line)
            if "verdict" in entry:
                yield entry
                left.pop(0)
                phase = "starting"
            else:
                phase = entry["phase"]
        status = process.wait()
        if left:
            stack = _last_stack(log.read_text(encoding="utf-8", errors="replace"))
            verdict = "hung" if status in (-signal.SIGPROF, -signal.SIGKILL) else "crashed"
            yield {"seed": left[0], "verdict": verdict, "way": phase, "message": f"exit status {status}\n{stack}",
                   "noise": [], "seconds": {}}  # fmt: skip


def _command(run: str, *arguments) -> list[str]:
    folder = str(Path(__file__).parents[1])
    return [sys.executable, "-c", _CHILD.format(folder=folder, run=run, arguments=", ".join(map(str, arguments)))]


def _last_stack(text: str) -> str:
    """What Python said last of where it was."""
    starts = [text.rfind(words) for words in ("Fatal Python error", "Current thread", "Traceback")]
    return text[max(starts) if max(starts) >= 0 else -2000 :][:6000]


def _blender_fails_alone(seed: int, limit: float) -> bool:
    """Whether making the scene and rendering it, with an engine that draws nothing, fails without the bake.

    It may take a quarter of the time, since opening, baking and saving a file evaluate the scene several times.
    """
    share = max(1, round(limit / 4))
    with tempfile.TemporaryDirectory() as folder, suppress(subprocess.TimeoutExpired):
        looked = subprocess.run(
            _command("look", seed), capture_output=True, cwd=folder, timeout=PATIENCE * share,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (share, share)),
        )  # fmt: skip
        return looked.returncode != 0
    return True


def look(seed: int) -> None:
    """Make the scene of ``seed`` and let Blender evaluate it as for a render."""
    import bpy
    from fuzz.chance import Chance
    from fuzz.scenes import make_scene
    from fuzz.wishes import attribute_name

    class Looker(bpy.types.RenderEngine):
        bl_idname = "FUZZ_LOOKER"
        bl_label = "Looker"

        def render(self, depsgraph):
            print(sum(instance.object is not None for instance in depsgraph.object_instances))

    chance = Chance(seed)
    make_scene(chance, attribute_name(chance))
    bpy.utils.register_class(Looker)
    scene = bpy.context.scene
    scene.render.engine = "FUZZ_LOOKER"
    scene.camera = scene.camera or bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    with suppress(RuntimeError):
        bpy.ops.render.render(scene=scene.name)
    os._exit(0)


def child(seeds: list[int], limit: float) -> None:
    """Try the seeds and print each outcome as a line of JSON; what Blender prints goes to standard error."""
    results = os.fdopen(os.dup(1), "w", buffering=1, encoding="utf-8")
    os.dup2(2, 1)
    log = os.fdopen(os.dup(2), "w")  # stays open while the command silences the standard streams
    faulthandler.enable(log)
    # Tells where it is, and then ends the process, as that signal does unless someone handles it.
    faulthandler.register(signal.SIGPROF, log, chain=True)
    from fuzz.trial import try_seed

    def entered(phase: str) -> None:
        print(json.dumps({"phase": phase}), file=results)

    for seed in seeds:
        signal.setitimer(signal.ITIMER_PROF, limit)
        print(try_seed(seed, entered).as_json(), file=results)
        signal.setitimer(signal.ITIMER_PROF, 0)
    results.close()
    os._exit(0)  # Blender as a module may hang or crash at exit, after all is done
