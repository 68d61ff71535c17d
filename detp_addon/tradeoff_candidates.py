"""The bakes of ours that a trade-off is measured with."""

from __future__ import annotations

from dataclasses import dataclass

from ..core.settings import QUALITIES, BakeSettings

#: what may be measured: the panel's qualities, each gatherer over photons, radii, and photons for direct light too
GROUPS = ("quality", "disc-index", "sphere-cache", "radius", "direct")

#: what --bakes takes
NAMES = (*GROUPS, *QUALITIES)

#: photons of the runs over the radius and over the ways to direct light
_PHOTONS = 1 << 20


@dataclass(frozen=True)
class Candidate:
    """A bake to measure; those of one ``group`` make a line in the plots. A ``preset`` is one that the panel offers."""

    label: str
    group: str
    settings: BakeSettings
    preset: bool = False

    @property
    def options(self) -> list[str]:
        """The same for `detp bake`."""
        standard, options = BakeSettings(), []
        for name in ("quality", "photons", "radius", "gatherer", "estimator", "direct"):
            value = getattr(self.settings, name)
            if value != getattr(standard, name):
                options += [f"--{name}", str(value)]
        return options


def candidates(radius: float, quick: bool, names: tuple[str, ...] = GROUPS) -> tuple[Candidate, ...]:
    """Those of these groups, or of these names; radii are tried around ``radius``, in metres. ``quick``: fewer."""
    everything = (*_qualities(quick), *_gatherers(quick), *_radii(radius, quick), *_direct(quick))
    return tuple(candidate for candidate in everything if {candidate.group, candidate.label} & {*names})


def _qualities(quick: bool) -> list[Candidate]:
    names = list(QUALITIES)[: 1 if quick else None]
    return [Candidate(name, "quality", BakeSettings(name), preset=True) for name in names]


def _gatherers(quick: bool) -> list[Candidate]:
    few, many = (1 << 16, 1 << 18), (1 << 16, 1 << 18, 1 << 20, 1 << 22)
    return [
        Candidate(f"{gatherer}, {_short(count)} photons", gatherer, BakeSettings(photons=count, gatherer=gatherer))
        for gatherer, counts in (("disc-index", many), ("sphere-cache", many[:3]))
        for count in (few if quick else counts)
    ]


def _radii(radius: float, quick: bool) -> list[Candidate]:
    settings = {
        share: BakeSettings(photons=_photons(quick), radius=share * radius)
        for share in ((0.5, 2.0) if quick else (0.25, 0.5, 1.0, 2.0))
    }
    return [Candidate(f"radius {share:g} x {radius:.3g} m", "radius", chosen) for share, chosen in settings.items()]


def _direct(quick: bool) -> list[Candidate]:
    return [
        Candidate(
            f"direct light by photons, {estimator} discs", "direct",
            BakeSettings(photons=_photons(quick), direct="photons", estimator=estimator),
        )
        for estimator in ("visible", "plain")
    ]  # fmt: skip


def _photons(quick: bool) -> int:
    return 1 << 18 if quick else _PHOTONS


def _short(count: int) -> str:
    return f"{count >> 10} k" if count < 1 << 20 else f"{count >> 20} M"
