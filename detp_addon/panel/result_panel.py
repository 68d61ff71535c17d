"""How the last bake went: figures, warnings, what was left out, and what can be done about it."""

import math
from collections.abc import Sequence

import bpy

from ...core.settings import GATHERERS
from ..report import BakeReport
from ..wording import counted, duration, percent
from . import session
from .labels import length, line_length, number, sentence
from .panel import SidebarTab

#: entries of a list shown before "and so many more"
MOST_LINES = 12


class DETP_PT_result(SidebarTab, bpy.types.Panel):
    """How the last bake went."""

    bl_label = "Last Bake"

    @classmethod
    def poll(cls, _context):
        """Once there is one."""
        bake = session.latest()
        return bake is not None and bake.outcome is not None

    def draw(self, context):
        """The report, or why there is none."""
        outcome = session.latest().outcome
        width = line_length(context)
        if outcome.report is None:
            icon = "ERROR" if outcome.status == session.FAILED else "INFO"
            sentence(self.layout, outcome.message, width, icon)
            return
        _draw_figures(self.layout, outcome.report)
        _draw_brightness(self.layout, outcome.report, context, width)
        _draw_faces(self.layout, outcome.report, width)
        _draw_lists(self.layout, outcome.report, context, width)


def _draw_figures(layout: bpy.types.UILayout, report: BakeReport) -> None:
    error = percent(report.relative_error) if math.isfinite(report.relative_error) else "No light arrived"
    high = percent(report.high_error) if math.isfinite(report.high_error) else "Unknown"
    column = layout.column(align=True)
    frames = [("Frames", number(len(report.frames)))] if report.frames else []
    for name, value in (
        ("Objects", number(report.objects)),
        *frames,
        ("Points", number(report.points)),
        ("Time", duration(report.seconds["total"])),
        ("Median Error", error),
        ("9 in 10 Within", high),
    ):
        _figure(column, name, value)


def _draw_search(layout: bpy.types.UILayout, report: BakeReport, units: bpy.types.UnitSettings, width: int) -> None:
    """How photons were searched, where any were needed."""
    column = layout.column(align=True)
    _figure(column, "Photons", number(report.photons))
    if report.photons:
        _figure(column, "Radius", length(report.radius, units))
        _figure(column, "Gatherer", GATHERERS.get(report.gatherer, report.gatherer))
    sentence(layout, report.gatherer_reason, width)


def _figure(column: bpy.types.UILayout, name: str, value: str) -> None:
    split = column.split(factor=0.45)
    left = split.row()
    left.alignment = "RIGHT"
    left.active = False
    left.label(text=name)
    split.label(text=value)


def _draw_brightness(layout: bpy.types.UILayout, report: BakeReport, context, width: int) -> None:
    """How much of the light is above 1, and the way below it."""
    if report.brightness.sentence():
        sentence(layout, report.brightness.sentence(), width)
    settings = context.scene.detp
    if report.brightness.above and not settings.fit_exposure and settings.storage == "FLOAT":
        layout.operator("detp.fit_exposure", icon="LIGHT_HEMI")


def _draw_faces(layout: bpy.types.UILayout, report: BakeReport, width: int) -> None:
    """What faces show wrong between their vertices, and what to do about it."""
    if not math.isfinite(report.lossy_faces.whole):
        return
    sentence(layout, report.faces(), width)
    if len(report.lossy_faces.faces):
        row = layout.row(align=True)
        row.operator("detp.select_faces", icon="FACESEL")
        row.operator("detp.divide_faces", text="Subdivide", icon="MOD_SUBSURF")


def _draw_lists(layout: bpy.types.UILayout, report: BakeReport, context, width: int) -> None:
    if report.warnings:
        many = len(report.warnings) > 3
        body = _section(layout, "warnings", counted(len(report.warnings), "Warning"), many, "ERROR")
        _bullets(body, report.warnings, width)
    if report.left_out:
        _bullets(
            _section(layout, "left_out", f"{counted(len(report.left_out), 'Feature')} Left Out"), report.left_out, width
        )
    body = _section(layout, "details", "Details")
    if body:
        _draw_search(body, report, context.scene.unit_settings, width)
        _bullets(body, [f"Modelled: {feature}" for feature in report.modelled], width)
        body.operator("detp.copy_report", icon="COPYDOWN")


def _section(layout: bpy.types.UILayout, name: str, title: str, closed: bool = True, icon: str = "NONE"):
    """The body of a part that can be folded away, or None while it is."""
    header, body = layout.panel(f"DETP_{name}", default_closed=closed)
    header.label(text=title, icon=icon)
    return body


def _bullets(layout: bpy.types.UILayout | None, sentences: Sequence[str], width: int) -> None:
    if layout is None:
        return
    for each in sentences[:MOST_LINES]:
        sentence(layout, each, width, "DOT")
    if len(sentences) > MOST_LINES:
        layout.label(text=f"and {len(sentences) - MOST_LINES} more: see Copy Report in Details")


CLASSES = (DETP_PT_result,)
