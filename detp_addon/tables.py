"""Tables of figures as text: JSON, CSV and Markdown."""

from __future__ import annotations

import csv
import io
import json
import math
import platform
from collections.abc import Iterable

import numpy as np


def as_json(value) -> str:
    """``value``, indented; what is NaN or infinite, which JSON does not know, as null."""
    return json.dumps(_plain(value), indent=2) + "\n"


def as_csv(rows: list[dict]) -> str:
    """A table with a heading; rows may lack some of its columns."""
    text = io.StringIO()
    writer = csv.DictWriter(text, list(dict.fromkeys(key for row in rows for key in row)))
    writer.writeheader()
    writer.writerows(_plain(rows))
    return text.getvalue()


def markdown_table(heading: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """A table in Markdown."""
    heading = list(heading)
    lines = [heading, ["---"] * len(heading), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def versions() -> dict[str, str]:
    """What figures were measured with."""
    return {
        "python": platform.python_version(),
        "numpy": np.__version__,
        "machine": platform.machine(),
        "system": platform.system(),
    }


def _plain(value):
    """The same with Python's own numbers, which json and csv write in full; None where they are not finite."""
    if isinstance(value, dict):
        return {key: _plain(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(inner) for inner in value]
    value = value.item() if isinstance(value, np.generic) else value
    return None if isinstance(value, float) and not math.isfinite(value) else value
