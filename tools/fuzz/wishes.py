"""What is asked of the bake: any settings, most of them possible."""

from __future__ import annotations

from dataclasses import fields

from detp.core.settings import ESTIMATORS, GATHERERS, INDIRECT_LIGHT, QUALITIES, BakeSettings
from detp.detp_addon.request import BakeRequest
from detp.detp_addon.writing.element_values import QUANTITIES
from fuzz.chance import Chance


def attribute_name(chance: Chance) -> str:
    """The colour attribute to bake into; some names are not allowed."""
    odd = ("", ".hidden", "x" * 64, "ä" * 40, "position", "UVMap", "sharp_edge", "material_index", " ", "Col")
    return chance.one_of(*odd) if chance.likely(0.03) else chance.one_of("irradiance", "irradiance", "Licht")


def settings_values(chance: Chance) -> dict:
    """Arguments of BakeSettings."""
    odd = chance.likely(0.01)
    values = {
        "quality": chance.one_of(*QUALITIES),
        "photons": chance.one_of(0, -5) if odd else chance.one_of(1, 2, 100, 1000, 1000, 5000, 5000, 40000),
        "radius": chance.one_of(None, None, None, 0.05, 0.3, 1.0, 2.0, 1e-6, 1e-3, 50.0, 1e6)
        if chance.likely(0.97)
        else chance.one_of(1e-30, 1e-300, 1e30, 1e200, 0.0, -1.0, float("nan"), float("inf")),
        "bounces": -1 if chance.likely(0.003) else chance.one_of(0, 1, 4, 16, 64),
        "seed": -1 if chance.likely(0.003) else chance.count(0, 1 << 20),
        "gatherer": chance.one_of(*GATHERERS),
        "estimator": chance.one_of(*ESTIMATORS),
        "direct": chance.one_of(None, "shadow-rays", "photons", "none"),
        "indirect": chance.one_of(None, *INDIRECT_LIGHT),
        "shadow_distance": chance.one_of(None, None, None, 0.1, 10.0, 1e-30, 1e30),
        "error": 0.05,  # where no photons are needed, only this ends a bake soon
    }
    if values["direct"] == "none" and chance.likely(0.9):
        values["indirect"] = "gather"
    return _known_by(BakeSettings, values)


def request_values(chance: Chance, attribute: str, names: list[str]) -> dict:
    """Arguments of BakeRequest beside its settings; ``names`` are those of the scene's objects."""
    chosen = tuple(chance.some_of([*names, "no such object"] if chance.likely(0.1) else names, 3))
    quantity = chance.one_of(*QUANTITIES)
    values = {
        "targets": chosen if chosen and chance.likely(0.15) else chance.one_of("visible", "visible", "selected"),
        "attribute": attribute,
        "domain": chance.one_of("CORNER", "CORNER", "POINT"),
        "quantity": quantity,
        "split": chance.likely(0.2) and quantity != "ambient-occlusion",
        "activate": chance.likely(0.7),
    }
    return _known_by(BakeRequest, values)


def _known_by(cls, values: dict) -> dict:
    known = {field.name for field in fields(cls)}
    return {name: value for name, value in values.items() if name in known}
