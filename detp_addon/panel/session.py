"""The bake that is running, or ran last: it is stepped in slices, can be cancelled, and keeps its outcome."""

from __future__ import annotations

import math
import time
from collections.abc import Generator
from dataclasses import dataclass, replace

from ...core.errors import DetpError
from ..report import BakeReport, Brightness
from ..steps import JobProgress


@dataclass(frozen=True)
class Ending:
    """How a bake ended: a sentence, one of DONE, CANCELLED and FAILED, and the report when it is done."""

    status: str
    message: str
    report: BakeReport | None = None


DONE, CANCELLED, FAILED = "DONE", "CANCELLED", "FAILED"

#: Seconds after reading the scene in which no pause is made to show what comes next: the first light comes the sooner.
HURRY = 1.0

#: By how much of a bake the forecast may be ahead of what the bake itself says, which speaks up only between its steps.
MOST_GUESSED = 0.2


class RunningBake:
    """One run of the generator ``steps``; nobody else may step or close it.

    progress  where it stands
    outcome   None while it runs
    expected  seconds that it was forecast to take, None when nothing is known; ``timed`` when it will take just these
    standing  error of the light that it is to replace, None when nothing is known
    """

    def __init__(
        self,
        steps: Generator[JobProgress, None, BakeReport],
        expected: float | None = None,
        timed: bool = False,
        standing: float | None = None,
    ):
        self.standing = standing
        self._steps, self._expected, self._lead = steps, expected, 1.0 if timed else MOST_GUESSED
        self._start, self._shown = time.perf_counter(), 0.0
        self._phases: set[str] = set()
        self._read = math.inf  # when the scene had been read
        self._stop: bool | None = None
        self._begun = False  # a generator takes nothing before its first step
        self.progress = JobProgress("Starting", 0.0)
        self.outcome: Ending | None = None

    def step(self, seconds: float) -> None:
        """Work for about so long, to the end, or to what can be shown: colours, or the name of a phase that is new.

        What a user can cause becomes the outcome; an error of the program is raised, after the outcome is set.
        """
        deadline = time.perf_counter() + seconds
        while self.outcome is None:
            try:
                self.progress = self._steps.send(self._stop if self._begun else None)
                self._begun = True
            except StopIteration as stop:
                self.outcome = Ending(DONE, stop.value.headline(), stop.value)
            except DetpError as error:
                self.outcome = Ending(FAILED, str(error))
            except ReferenceError:
                self.outcome = Ending(CANCELLED, "The bake ended because what it was baking was removed.")
            except BaseException as error:
                self.outcome = Ending(FAILED, f"The bake broke off, please report this: {error!r}")
                raise
            now, new = time.perf_counter(), self.progress.phase not in self._phases
            self._phases.add(self.progress.phase)
            if new and len(self._phases) == 2:
                self._read = now
            named = new and not self._read <= now < self._read + HURRY
            if named or self.progress.shown or now >= deadline:
                return

    @property
    def fraction(self) -> float:
        """The share done (0..1), which never falls; by the forecast, as far ahead of the bake's own as it may be."""
        passed, known = time.perf_counter() - self._start, self.progress.fraction
        guess = min(passed / self._expected, known + self._lead, 0.99) if self._expected else 0.0
        self._shown = max(self._shown, known, guess)
        return self._shown

    @property
    def remaining(self) -> float | None:
        """The seconds still needed; by the forecast until the bake itself knows, None when that is over."""
        if self.progress.remaining is not None or self._expected is None:
            return self.progress.remaining
        left = self._expected - (time.perf_counter() - self._start)
        return left if left > 0 else None

    @property
    def stopped(self) -> bool:
        """Whether the user has ended it before its end."""
        return bool(self._stop)

    def run(self) -> None:
        """Work to the end; raises as :meth:`step` does."""
        while self.outcome is None:
            self.step(math.inf)

    @property
    def worse(self) -> bool:
        """Whether what has been found so far is not as good as what it would replace."""
        found = self.progress.error
        return self.standing is not None and found is not None and found > self.standing

    def stop(self) -> None:
        """Let the bake end as soon as it can, and keep what it has found."""
        self._stop = True

    def cancel(self, message: str = "The bake was cancelled; nothing was changed.") -> None:
        """End without writing anything; does nothing when the bake is over."""
        if self.outcome is None:
            self.outcome = Ending(CANCELLED, message)
            self._steps.close()


_latest: RunningBake | None = None


def latest() -> RunningBake | None:
    """The bake that is running or ran last since this file was opened."""
    return _latest


def running() -> RunningBake | None:
    """The bake that is running."""
    return _latest if _latest is not None and _latest.outcome is None else None


def report() -> BakeReport | None:
    """That of the latest bake, once it is done."""
    return _latest.outcome.report if _latest is not None and _latest.outcome is not None else None


def begin(steps: Generator[JobProgress, None, BakeReport], **known) -> RunningBake:
    """Make ``steps`` the running bake in place of one that is over; what is ``known`` is as in :class:`RunningBake`."""
    global _latest
    _latest = RunningBake(steps, **known)
    return _latest


def cancel_running(message: str) -> None:
    """Cancel the running bake, if there is one."""
    session = running()
    if session is not None:
        session.cancel(message)


def exposed(brightness: Brightness) -> None:
    """Note that the light of the latest bake has been multiplied since."""
    if report() is not None:
        _latest.outcome = replace(_latest.outcome, report=replace(report(), brightness=brightness))


def forget() -> None:
    """Drop the latest bake: it belongs to a file that is no longer open."""
    global _latest
    _latest = None
