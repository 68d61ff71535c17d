"""What became of many files, as lines of a table."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence

from ..wording import duration, percent
from .jobs import BAKED, FAILED, FORESEEN, SKIPPED, Outcome, SceneJob


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
