"""Judges what a bake did: finite light or one clear sentence, and nothing else changed."""

from __future__ import annotations

import re

import bpy
import numpy as np
from detp.detp_addon.report import BakeReport, to_json
from detp.detp_addon.request import BakeRequest
from fuzz.fingerprint import baked_objects, broken_promises, fingerprint, values

#: the longest that a clear sentence may be; some name three objects, whose names have sixty letters here
LONGEST_SENTENCE = 1000


class Refused(Exception):  # noqa: N818
    """The bake gave an error that a user can understand."""


class Wrong(Exception):  # noqa: N818
    """The bake did something that it must never do."""


def judge_refusal(sentence: str, kind: str, before: dict, request: dict) -> None:
    """Raise Refused when the error is a clear sentence and nothing has changed, Wrong otherwise."""
    if not sentence.endswith((".", "?")) or "\n" in sentence or len(sentence) > LONGEST_SENTENCE:
        raise Wrong(f"not a clear sentence ({kind}): {sentence}")
    if kind == "InvalidArrayError" or re.search(r"\brow \d+ is", sentence):
        raise Wrong(f"a sentence for programmers ({kind}): {sentence}")
    changes = broken_promises(before, fingerprint(), (), [])
    if changes:
        raise Wrong(f"a bake that failed with '{sentence}' changed something: " + "; ".join(changes)[:2000])
    raise Refused(f"{kind}: {sentence}")


def judge_bake(before: dict, request: dict, objects: int, notes) -> None:
    """Raise Wrong unless ``objects`` meshes have finite colours and the rest is as it was."""
    after = fingerprint()
    attributes = BakeRequest(**request).attributes
    baked = baked_objects(before, after, attributes[0])
    if len(baked) != objects:
        raise Wrong(f"the report names {objects} objects, and {len(baked)} have new colours: {baked}")
    for name in baked:
        mesh = next(obj for obj in bpy.data.objects if obj.name_full == name).data
        for layer in (mesh.attributes[attribute] for attribute in attributes):
            if (layer.data_type, layer.domain) != ("FLOAT_COLOR", request["domain"]):
                raise Wrong(f"the colours of {name} are {layer.data_type} on {layer.domain}")
            if not np.isfinite(values(layer)[:, :3]).all():
                raise Wrong(f"colours {layer.name} of {name} are not finite: {values(layer)[:8].tolist()}")
    changes = broken_promises(before, after, attributes, baked)
    if changes:
        raise Wrong("the bake changed more than its colours: " + "; ".join(changes)[:2000])
    for note in notes:
        if "\n" in note or "nan" in note.lower().split() or "{}" in note:
            raise Wrong(f"not a clear note: {note}")


def judged_report(report: BakeReport) -> str:
    """The report's headline; raises Wrong when it does not make sense."""
    to_json([report.as_json()])
    headline = report.headline()
    if "nan" in headline.split() or not all(isinstance(line, str) for line in report.details()):
        raise Wrong(f"not a clear headline: {headline}")
    return headline
