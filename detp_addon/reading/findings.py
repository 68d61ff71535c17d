"""What was met while a scene was read, as sentences for people: each once, with a count and a few names."""

from __future__ import annotations

from ..wording import counted, some


class Findings:
    """Collects what was modelled, what was left out and what to warn of.

    A sentence holds one ``{}``, where the number of ``thing``s and their names appear. The same sentence added for
    another name only counts up.
    """

    def __init__(self):
        self._modelled, self._left_out, self._warnings = {}, {}, {}

    def modelled(self, sentence: str, thing: str = "", name: str = "") -> None:
        """Note a feature that the scene has and the bake honours."""
        self._modelled.setdefault((sentence, thing), {})[name] = None

    def left_out(self, sentence: str, thing: str = "", name: str = "") -> None:
        """Note a feature that the scene has and the bake does not honour."""
        self._left_out.setdefault((sentence, thing), {})[name] = None

    def warn(self, sentence: str, thing: str = "", name: str = "") -> None:
        """Note something the user should look at."""
        self._warnings.setdefault((sentence, thing), {})[name] = None

    def sentences(self) -> tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]]:
        """What was modelled (with counts), left out and the warnings (with names too), as first met."""
        modelled = tuple(
            sentence.replace("{}", counted(len(names), thing)) for (sentence, thing), names in self._modelled.items()
        )
        return modelled, _with_names(self._left_out), _with_names(self._warnings)


def _with_names(entries: dict) -> tuple[str, ...]:
    return tuple(sentence.replace("{}", _named(thing, list(names))) for (sentence, thing), names in entries.items())


def _named(thing: str, names: list[str]) -> str:
    return f"{counted(len(names), thing)} ({some(names, '')})"
