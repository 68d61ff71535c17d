"""What a batch is made of: files to bake, how, and what became of each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ...core.errors import DetpError
from ..files.bake_mark import BakeMark, fingerprint, read_mark
from ..files.open_files import check_readable

#: options of the command that say where things come from and go, and not what light is baked
_ELSEWHERE = frozenset(
    "run scenes recursive output report preview quiet jobs resume dry_run time_limit cluster keep".split()
)  # fmt: skip

BAKED, SKIPPED, FAILED, FORESEEN = "baked", "done before", "failed", "forecast"


@dataclass(frozen=True)
class SceneJob:
    """One scene file to bake, where the result goes, and the picture of it if one is wanted."""

    scene: Path
    output: Path
    preview: Path | None = None


@dataclass(frozen=True)
class Batch:
    """Scenes to bake alike, and where the report of all goes if one is wanted.

    options     of the command, by name; all are text, numbers, or lists of them
    """

    jobs: tuple[SceneJob, ...]
    options: dict
    report: Path | None = None

    @property
    def apart(self) -> bool:
        """Whether each file needs a process of its own, so that what ends one ends no other."""
        return len(self.jobs) > 1 or self.options["time_limit"] is not None


@dataclass(frozen=True)
class Outcome:
    """What became of a job: one of the words above, entries for the report, why it failed, the seconds it took."""

    state: str
    entries: list[dict]
    failure: str | None = None
    seconds: float = 0.0


def failed(job: SceneJob, why: str, entries: Sequence[dict] = ()) -> Outcome:
    """The outcome of a job that failed, after it had made some ``entries``."""
    entries = [*entries] or [{"scene": str(job.scene), "output": None}]
    entries[-1]["error"] = why
    return Outcome(FAILED, entries, why)


def light_options(options: dict) -> dict:
    """Those of the command's ``options`` that the baked colours depend on."""
    return {name: value for name, value in options.items() if name not in _ELSEWHERE}


def done_before(job: SceneJob, options: dict) -> list[dict] | None:
    """The report's entries of a bake that is there already, of the same content and options; None otherwise."""
    mark: BakeMark | None = read_mark(job.output)
    if mark is None:
        return None
    try:
        check_readable(job.scene)
        if mark.fingerprint != fingerprint(job.scene, light_options(options)):
            return None
    except DetpError:
        return None  # the bake will say why
    return [{"scene": str(job.scene), "output": str(job.output), **entry} for entry in mark.entries]


def skipped(entries: list[dict]) -> Outcome:
    """The outcome of a job that an earlier run has done."""
    return Outcome(SKIPPED, [{**entry, "resumed": True} for entry in entries])


def previews_of(job: SceneJob, entries: list[dict]) -> list[Path]:
    """The pictures of the scenes in these ``entries``, none when none is wanted."""
    if job.preview is None:
        return []
    if len(entries) == 1:
        return [job.preview]
    path = job.preview
    # In a scene's name a slash or the like would be a folder.
    names = ("".join(c if c.isalnum() or c in " -_." else "_" for c in entry["blender_scene"]) for entry in entries)
    return [path.with_name(f"{path.stem}_{name}{path.suffix}") for name in names]
