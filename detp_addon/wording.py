"""Numbers, shares, times and names for people, in the panel as on a terminal."""

from __future__ import annotations

from collections.abc import Sequence


def counted(number: int, thing: str) -> str:
    """A number with its unit for people: ``1 object``, ``45 210 points``, ``2.10 M photons``."""
    text = f"{number / 1e6:.3g} M" if number >= 1_000_000 else f"{number:,}".replace(",", " ")
    return f"{text} {thing}" + ("" if number == 1 else "s")


def some(names: Sequence[str]) -> str:
    """The first three of the names, quoted."""
    return ", ".join(f"'{name}'" for name in names[:3]) + (", ..." if len(names) > 3 else "")


def percent(share: float) -> str:
    """``4.2 %``."""
    return f"{share:.1%}".replace("%", " %")


def duration(seconds: float) -> str:
    """``4.2 s``, ``3 min 20 s`` or ``2 h 5 min``."""
    if seconds < 60:
        return f"{seconds:.1f} s" if seconds < 10 else f"{seconds:.0f} s"
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest} s" if minutes < 60 else f"{minutes // 60} h {minutes % 60} min"
