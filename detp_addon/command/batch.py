"""Bakes scene files: one in this process, several in processes of their own; one that fails stops no other."""

from __future__ import annotations

import math
import sys
import time
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import closing

from ...core.errors import DetpError
from ..files.write_files import check_writable, write_text
from ..report import to_json
from ..steps import JobProgress
from ..wording import duration, percent
from .blender_output import blender_silenced
from .jobs import BAKED, FAILED, FORESEEN, SKIPPED, Batch, Outcome, SceneJob, done_before, previews_of, skipped
from .processes import outcomes_apart
from .progress import ProgressDisplay

#: seconds between two lines on the progress of many files, where they are no bar
SELDOM = 30.0


def bake_batch(batch: Batch) -> int:
    """Bake every file of ``batch``, print what was done, and return how many files failed.

    The report is written after each file, so that it outlives whatever happens to the next. Raises UnwritableFileError
    before any work when that is not possible, and after it when it was not; InvalidSettingError on options that no
    file can be baked with.
    """
    if batch.report is not None:
        check_writable(batch.report)
    begin = time.monotonic()
    display = ProgressDisplay(sys.stdout, batch.options["quiet"], **({"interval": SELDOM} if batch.apart else {}))
    outcomes: dict[int, Outcome] = {}
    unreported = None
    with closing(_apart(batch, display) if batch.apart else _alone(batch, display)) as done:
        for number, outcome in done:
            outcomes[number] = outcome
            if outcome.failure is not None:
                display.complain(f"{batch.jobs[number].scene}: {outcome.failure}")
            unreported = _reported(batch, outcomes)
    ordered = [outcomes[number] for number in sorted(outcomes)]
    display.end()
    if len(batch.jobs) > 1 or batch.options["dry_run"]:
        for line in table_lines(batch.jobs, ordered, time.monotonic() - begin):
            display.line(line)
    for line in failure_lines(batch.jobs, ordered):
        display.complain(line)
    if unreported is not None:
        raise unreported
    return sum(outcome.failure is not None for outcome in ordered)


def _reported(batch: Batch, outcomes: dict[int, Outcome]) -> DetpError | None:
    """Write the report of all that was done so far; return why it could not be."""
    if batch.report is None:
        return None
    try:
        write_text(batch.report, to_json([entry for number in sorted(outcomes) for entry in outcomes[number].entries]))
    except DetpError as error:
        return error
    return None


def _alone(batch: Batch, display: ProgressDisplay) -> Iterator[tuple[int, Outcome]]:
    """The outcome of the only file, baked in this process; Blender is loaded when there is work for it."""
    (job,) = batch.jobs
    entries = done_before(job, batch.options) if batch.options["resume"] else None
    undrawn = entries is not None and not all(path.exists() for path in previews_of(job, entries))
    if entries is not None and (batch.options["dry_run"] or not undrawn):
        display.line(f"{job.output} is done already")
        yield 0, skipped(entries)
        return
    with blender_silenced():
        from .bake_file import bake_file
    outcome = bake_file(job, batch.options, display, entries)
    display.end()
    yield 0, outcome


def _apart(batch: Batch, display: ProgressDisplay) -> Iterator[tuple[int, Outcome]]:
    """The outcome of each file, as soon as its process has ended; what it had to say is printed together."""
    states: dict[int, JobProgress] = {}
    begin, baked, failed, finished = time.monotonic(), 0, 0, 0
    with closing(outcomes_apart(batch)) as events:
        for number, event in events:
            job = batch.jobs[number]
            if isinstance(event, JobProgress):
                states[number] = event
            else:
                states.pop(number, None)
                finished, failed = finished + 1, failed + (event.outcome.failure is not None)
                baked += event.outcome.state != SKIPPED
                yield number, event.outcome  # into the report, before anybody hears of it
                for line in event.lines:
                    display.line(line)
                for line in event.complaints:
                    display.complain(f"{job.scene}: {line}")
            # What was done before takes no time.
            ahead = max(1, len(batch.jobs) - finished + baked)
            share = (baked + sum(state.fraction for state in states.values())) / ahead
            left = (time.monotonic() - begin) * (1 - share) / share if 0.01 < share < 1 else None
            names = ", ".join(batch.jobs[each].scene.stem for each in sorted(states)[:3])
            title = f"{finished} of {len(batch.jobs)} files" + (f", {failed} failed" if failed else "")
            phase = "Forecasting" if batch.options["dry_run"] else "Baking"
            display.show(f"{title}: {names}" if names else title, JobProgress(phase, share, left))


def table_lines(jobs: Sequence[SceneJob], outcomes: Iterable[Outcome], seconds: float) -> list[str]:
    """A line for each file with what became of it, how long it took and how well it turned out; and one for all."""
    outcomes = list(outcomes)
    by_state = Counter(outcome.state for outcome in outcomes)
    lines = [f"{'':<11}{'time':>10}{'error':>8}  scene", *map(_row, jobs, outcomes)]
    states = (BAKED, FORESEEN, SKIPPED, FAILED)
    counts = ", ".join(f"{by_state[state]} {state}" for state in states if by_state[state])
    foreseen = sum(_figures(outcome)[0] for outcome in outcomes if outcome.state == FORESEEN)
    told = f"about {duration(foreseen)} one after the other" if by_state[FORESEEN] else f"in {duration(seconds)}"
    return [*lines, f"{counts}: {told}."]


def failure_lines(jobs: Sequence[SceneJob], outcomes: Sequence[Outcome]) -> list[str]:
    """After several files, once more which failed, where it cannot be missed."""
    failed = [(job, outcome) for job, outcome in zip(jobs, outcomes, strict=False) if outcome.failure is not None]
    if len(jobs) < 2 or not failed:
        return []
    return [f"{len(failed)} of {len(jobs)} scenes failed:", *(f"  {job.scene}: {out.failure}" for job, out in failed)]


def _figures(outcome: Outcome) -> tuple[float, float]:
    """The seconds that a file's scenes take together, and the largest error among them, NaN where none is known."""
    forecasts = [entry["forecast"] for entry in outcome.entries if "forecast" in entry]
    errors = [entry.get("relative_error") for entry in forecasts or outcome.entries]
    seconds = sum(each["seconds"] for each in forecasts) if forecasts else outcome.seconds
    return seconds, max((error for error in errors if error is not None), default=math.nan)


def _row(job: SceneJob, outcome: Outcome) -> str:
    seconds, error = _figures(outcome)
    time = "" if outcome.state == SKIPPED else duration(seconds)
    error = percent(error) if math.isfinite(error) and outcome.state != FAILED else ""
    warnings = sum(len(entry.get("warnings", ())) for entry in outcome.entries) if outcome.state != FAILED else 0
    remark = f" ({warnings} warning{'s' * (warnings > 1)})" if warnings else ""
    return f"{outcome.state:<11}{time:>10}{error:>8}  {job.scene}{remark}"
