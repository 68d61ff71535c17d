"""What a trade-off is measured with: bakes of ours and of Cycles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ...core.settings import QUALITIES, BakeSettings

#: what may be measured: the panel's qualities, targets, each gatherer over photons, radii, photons for direct light too
GROUPS = ("quality", "error", "time", "disc-index", "sphere-cache", "radius", "direct")

#: errors and seconds to aim at
TARGETS = {
    **{f"error {100 * error:g}%": BakeSettings(error=error) for error in (0.1, 0.05, 0.025)},
    **{f"time {seconds:g}s": BakeSettings(seconds=seconds) for seconds in (1.0, 3.0, 10.0)},
}

#: what --bakes takes
NAMES = (*GROUPS, *QUALITIES, *TARGETS)

#: photons of the runs over the radius and over the ways to direct light
_PHOTONS = 1 << 20


#: reflections that Blender allows unless told otherwise
DEFAULT_BOUNCES = 4


@dataclass(frozen=True)
class Measured:
    """Equal runs: what, ``seconds`` and RGB sums ``light`` (M,) of each run.

    group    those of one group make a line in the plots; ``preset`` whether it is one that the panel offers
    who      "detp", "cycles", as pressing its button does, or "cycles inside" the corners, all objects as one
    settings of ours, ``samples`` of Cycles, 0 of ours
    facts    about the last run
    """

    label: str
    group: str
    settings: BakeSettings | None = None
    preset: bool = False
    who: str = "detp"
    samples: int = 0
    seconds: list[float] = field(default_factory=list)
    light: list[np.ndarray] = field(default_factory=list)
    facts: dict = field(default_factory=dict)

    @property
    def median_seconds(self) -> float:
        """Of all runs."""
        return float(np.median(self.seconds))

    @property
    def options(self) -> list[str]:
        """The settings for `detp bake`."""
        standard, options = BakeSettings(), []
        for name in ("quality", "error", "seconds", "photons", "radius", "gatherer", "estimator", "direct"):
            value = getattr(self.settings, name)
            if value != getattr(standard, name):
                options += [f"--{'time' if name == 'seconds' else name}", str(value)]
        return options


def cycles_runs(samples: Sequence[int]) -> list[Measured]:
    """Cycles' button and Cycles inside with these numbers of ``samples``, and there once more with Blender's default
    bounces."""
    pressed = [Measured(f"Cycles, {n} samples", "cycles", who="cycles", samples=n) for n in samples]
    inside = [(f"Cycles inside, {n} samples", "inside", n) for n in samples]
    for n in samples[len(samples) // 2 :][:1]:
        inside.append((f"Cycles inside, {n} samples, {DEFAULT_BOUNCES} bounces", "bounces", n))
    return pressed + [Measured(label, group, who="cycles inside", samples=n) for label, group, n in inside]


def candidates(radius: float, quick: bool, names: tuple[str, ...] = GROUPS) -> list[Measured]:
    """Ours of these groups, or of these names; radii are tried around ``radius``, in metres. ``quick``: fewer."""
    photons, few, many = 1 << 18 if quick else _PHOTONS, (1 << 16, 1 << 18), (1 << 16, 1 << 18, 1 << 20, 1 << 22)
    qualities = [Measured(name, "quality", BakeSettings(name), preset=True) for name in QUALITIES]
    targets = [Measured(label, label.split()[0], settings) for label, settings in TARGETS.items()]
    found = [*qualities[:1], targets[0], targets[3]] if quick else [*qualities, *targets]
    for gatherer, counts in (("disc-index", many), ("sphere-cache", many[:3])):
        for count in few if quick else counts:
            short = f"{count >> 10} k" if count < 1 << 20 else f"{count >> 20} M"
            settings = BakeSettings(photons=count, gatherer=gatherer)
            found.append(Measured(f"{gatherer}, {short} photons", gatherer, settings))
    for share in (0.5, 2.0) if quick else (0.25, 0.5, 1.0, 2.0):
        settings = BakeSettings(photons=photons, radius=share * radius)
        found.append(Measured(f"radius {share:g} x {radius:.3g} m", "radius", settings))
    for estimator in ("visible", "plain"):
        settings = BakeSettings(photons=photons, direct="photons", estimator=estimator)
        found.append(Measured(f"direct light by photons, {estimator} discs", "direct", settings))
    return [candidate for candidate in found if {candidate.group, candidate.label} & {*names}]
