"""Numbers, shares, times and names for people, in the panel as on a terminal."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence

#: names that are shown of many
SHOWN_NAMES = 3


def counted(number: int, thing: str) -> str:
    """A number with its unit for people: ``1 object``, ``45 210 points``, ``2.10 M photons``."""
    text = f"{number / 1e6:.3g} M" if number >= 1_000_000 else f"{number:,}".replace(",", " ")
    return f"{text} {thing}" + ("" if number == 1 else "s")


def some(names: Sequence[str], quote: str = "'") -> str:
    """The first of the names, quoted."""
    shown = ", ".join(f"{quote}{name}{quote}" for name in names[:SHOWN_NAMES])
    return shown + (", ..." if len(names) > SHOWN_NAMES else "")


def alike(name: str, names: Iterable[str]) -> str:
    """Those of the ``names`` that ``name`` may be meant for: ``'Key' or 'Fill'``."""
    names = list(names)
    return " or ".join(f"'{other}'" for other in difflib.get_close_matches(name, names) or names[:3])


def percent(share: float) -> str:
    """``4.2 %``."""
    return f"{share:.1%}".replace("%", " %")


def duration(seconds: float) -> str:
    """``4.2 s``, ``3 min 20 s`` or ``2 h 5 min``."""
    if seconds < 60:
        return f"{seconds:.1f} s" if seconds < 10 else f"{seconds:.0f} s"
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest} s" if minutes < 60 else f"{minutes // 60} h {minutes % 60} min"
