"""Lines for terminals and logs: no name out of a file can steer them, and no stream that fails ends a bake."""

from __future__ import annotations

import re
import sys
from typing import TextIO

#: what moves the cursor, starts a line, turns the direction of reading, or is half a character
_UNSHOWN = re.compile("[\x00-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")


def escaped(text: str) -> str:
    """``text`` on one line, its control characters and halves of characters as Python would write them."""
    return _UNSHOWN.sub(lambda found: found[0].encode("unicode_escape").decode("ascii"), text)


def harmless(text: str) -> str:
    """``text`` of several lines, all else of it that steers a terminal written out."""
    return _UNSHOWN.sub(lambda found: found[0] if found[0] in "\t\r\n" else escaped(found[0]), text)


def say(text: str, stream: TextIO | None = None) -> bool:
    """Print ``text`` as one line on ``stream`` (standard output when None); return whether somebody could read it."""
    return put(escaped(text) + "\n", sys.stdout if stream is None else stream)


def complain(text: str) -> None:
    """Print ``text`` as one line on standard error."""
    put(escaped(text) + "\n", sys.stderr)


def put(text: str, stream: TextIO | None) -> bool:
    """Write ``text`` as far as the stream's alphabet goes; return False when it takes nothing: full, closed or none."""
    try:
        alphabet = getattr(stream, "encoding", None) or "utf-8"
        stream.write(text.encode(alphabet, "backslashreplace").decode(alphabet))
        stream.flush()
    except (OSError, ValueError, AttributeError):
        return False
    return True
