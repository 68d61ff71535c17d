"""The bakes of ours that a trade-off is measured with."""

from __future__ import annotations

from dataclasses import dataclass

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


@dataclass(frozen=True)
class MeasuredBake:
    """A bake to measure; those of one ``group`` make a line in the plots. A ``preset`` is one that the panel offers."""

    label: str
    group: str
    settings: BakeSettings
    preset: bool = False

    @property
    def options(self) -> list[str]:
        """The same for `detp bake`."""
        standard, options = BakeSettings(), []
        for name in ("quality", "error", "seconds", "photons", "radius", "gatherer", "estimator", "direct"):
            value = getattr(self.settings, name)
            if value != getattr(standard, name):
                options += [f"--{'time' if name == 'seconds' else name}", str(value)]
        return options


def candidates(radius: float, quick: bool, names: tuple[str, ...] = GROUPS) -> tuple[MeasuredBake, ...]:
    """Those of these groups, or of these names; radii are tried around ``radius``, in metres. ``quick``: fewer."""
    photons, few, many = 1 << 18 if quick else _PHOTONS, (1 << 16, 1 << 18), (1 << 16, 1 << 18, 1 << 20, 1 << 22)
    qualities = [MeasuredBake(name, "quality", BakeSettings(name), preset=True) for name in QUALITIES]
    targets = [MeasuredBake(label, label.split()[0], settings) for label, settings in TARGETS.items()]
    found = [*qualities[:1], targets[0], targets[3]] if quick else [*qualities, *targets]
    for gatherer, counts in (("disc-index", many), ("sphere-cache", many[:3])):
        for count in few if quick else counts:
            short = f"{count >> 10} k" if count < 1 << 20 else f"{count >> 20} M"
            settings = BakeSettings(photons=count, gatherer=gatherer)
            found.append(MeasuredBake(f"{gatherer}, {short} photons", gatherer, settings))
    for share in (0.5, 2.0) if quick else (0.25, 0.5, 1.0, 2.0):
        settings = BakeSettings(photons=photons, radius=share * radius)
        found.append(MeasuredBake(f"radius {share:g} x {radius:.3g} m", "radius", settings))
    for estimator in ("visible", "plain"):
        settings = BakeSettings(photons=photons, direct="photons", estimator=estimator)
        found.append(MeasuredBake(f"direct light by photons, {estimator} discs", "direct", settings))
    return tuple(candidate for candidate in found if {candidate.group, candidate.label} & {*names})
