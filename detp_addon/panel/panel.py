"""The sidebar tab: settings, progress, and what the last bake did."""

import math
import textwrap
from collections.abc import Sequence

import bpy

from ..report import BakeReport, counted
from . import session
from .forecasts import forecast_of
from .show_light import shows_light

#: entries of a list shown before "and so many more"
MOST_LINES = 12

GATHERER_NAMES = {"disc-index": "Disc Indexing", "sphere-cache": "Sphere Cache", "brute-force": "Brute Force"}


class _Tab:
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "DETP"


class DETP_PT_bake(_Tab, bpy.types.Panel):
    """What most bakes need, and the button."""

    bl_label = "Bake Vertex Light"

    def draw(self, context):
        """Settings, greyed out during a bake; then the button, or the progress with its Cancel."""
        settings = context.scene.detp
        bake = session.running()
        quality = self.layout.row(align=True)
        quality.enabled = bake is None
        quality.scale_y = 1.2
        quality.prop(settings, "quality", expand=True)
        column = _settings_column(self.layout)
        if settings.quality in ("ERROR", "TIME"):
            column.prop(settings, {"ERROR": "error", "TIME": "seconds"}[settings.quality])
        column.row().prop(settings, "targets", expand=True)
        column.prop(settings, "gatherer")
        _automatic(column, settings, "auto_radius", "radius", "Radius")
        column.prop(settings, "attribute")
        self.layout.separator()
        if bake is None:
            row = self.layout.row()
            row.scale_y = 1.6
            row.operator("detp.bake", text="Bake", icon="LIGHT_SUN")
            _draw_forecast(self.layout, context)
        else:
            _draw_progress(self.layout, bake)


class DETP_PT_advanced(_Tab, bpy.types.Panel):
    """What few bakes need."""

    bl_label = "Advanced"
    bl_parent_id = "DETP_PT_bake"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        """Settings, greyed out during a bake."""
        settings = context.scene.detp
        column = _settings_column(self.layout)
        column.prop(settings, "quantity")
        if settings.quantity == "AMBIENT_OCCLUSION":
            column.prop(settings, "occlusion_distance")
        else:
            column.prop(settings, "split")
        column.prop(settings, "domain")
        column.prop(settings, "fit")
        column.prop(settings, "activate")
        column.prop(settings, "live")
        column.separator()
        column.prop(settings, "direct")
        column.prop(settings, "indirect")
        column.prop(settings, "estimator")
        column.separator()
        _automatic(column, settings, "auto_photons", "photons", "Photons")
        column.prop(settings, "bounces")
        column.prop(settings, "seed")


class DETP_PT_result(_Tab, bpy.types.Panel):
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
        width = _line_length(context)
        if outcome.report is None:
            icon = "ERROR" if outcome.status == session.FAILED else "INFO"
            _sentence(self.layout, outcome.message, width, icon)
            return
        _draw_figures(self.layout, outcome.report, context.scene.unit_settings)
        row = self.layout.row()
        row.scale_y = 1.3
        shown = shows_light(context.space_data.shading)
        row.operator("detp.show", icon="SHADING_SOLID", depress=shown)
        _draw_faces(self.layout, outcome.report, width)
        _draw_lists(self.layout, outcome.report, width)


def _settings_column(layout: bpy.types.UILayout) -> bpy.types.UILayout:
    layout.use_property_split = True
    layout.use_property_decorate = False
    column = layout.column()
    column.enabled = session.running() is None
    return column


def _automatic(layout, settings, switch: str, value: str, heading: str) -> None:
    """A checkbox "Automatic", and the field only when it is off."""
    column = layout.column(align=True, heading=heading)
    column.prop(settings, switch)
    if not getattr(settings, switch):
        column.prop(settings, value, text=" ")


def _draw_progress(layout: bpy.types.UILayout, bake: session.BakeSession) -> None:
    progress = bake.progress
    column = layout.column(align=True)
    bar = column.row()
    bar.scale_y = 1.3
    bar.progress(factor=progress.fraction, type="BAR", text=f"{progress.phase}  {progress.fraction:.0%}")
    row = column.row(align=True)
    left = "" if progress.remaining is None else f"About {_duration(progress.remaining)} left"
    now = "" if progress.error is None else f"error {progress.error:.1%}"
    row.label(text=", ".join(filter(None, (left, now))))
    row = column.row(align=True)
    row.operator("detp.stop", text="Stop and Keep", icon="PAUSE")
    row.operator("detp.cancel", text="Cancel", icon="X")


def _draw_forecast(layout: bpy.types.UILayout, context) -> None:
    """What the bake is likely to take, and how far off half of its points will be."""
    forecast = forecast_of(context.scene, context.view_layer)
    if forecast is not None:
        row = layout.row()
        row.active = False
        row.label(text=f"About {_duration(forecast.seconds)}, error {forecast.error:.1%}", icon="TIME")


def _draw_figures(layout: bpy.types.UILayout, report: BakeReport, units: bpy.types.UnitSettings) -> None:
    error = f"{report.relative_error:.1%}" if math.isfinite(report.relative_error) else "No light arrived"
    high = f"{report.high_error:.1%}" if math.isfinite(report.high_error) else "Unknown"
    column = layout.column(align=True)
    for name, value in (
        ("Objects", _number(report.objects)),
        ("Points", _number(report.points)),
        ("Time", _duration(report.seconds["total"])),
        ("Estimated Error", error),
        ("Of Nine Tenths", high),
        ("Photons", _number(report.photons)),
        ("Radius", _length(report.radius, units)),
        ("Gatherer", GATHERER_NAMES.get(report.gatherer, report.gatherer)),
    ):
        split = column.split(factor=0.4)
        left = split.row()
        left.alignment = "RIGHT"
        left.active = False
        left.label(text=name)
        split.label(text=value)


def _draw_faces(layout: bpy.types.UILayout, report: BakeReport, width: int) -> None:
    """What faces show wrong between their vertices, and what to do about it."""
    if not math.isfinite(report.lossy_faces.whole):
        return
    _sentence(layout, report.faces(), width)
    if len(report.lossy_faces.faces):
        row = layout.row(align=True)
        row.operator("detp.select_faces", icon="FACESEL")
        row.operator("detp.divide_faces", text="Subdivide", icon="MOD_SUBSURF")


def _draw_lists(layout: bpy.types.UILayout, report: BakeReport, width: int) -> None:
    if report.warnings:
        many = len(report.warnings) > 3
        body = _section(layout, "warnings", counted(len(report.warnings), "Warning"), many, "ERROR")
        _bullets(body, report.warnings, width)
    if report.left_out:
        _bullets(_section(layout, "left_out", f"{len(report.left_out)} Left Out"), report.left_out, width)
    body = _section(layout, "details", "Details")
    if body:
        _sentence(body, report.gatherer_reason, width)
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
    for sentence in sentences[:MOST_LINES]:
        _sentence(layout, sentence, width, "DOT")
    if len(sentences) > MOST_LINES:
        layout.label(text=f"and {len(sentences) - MOST_LINES} more: see Copy Report in Details")


def _sentence(layout: bpy.types.UILayout, text: str, width: int, icon: str = "NONE") -> None:
    """Labels do not wrap, so each line of the text gets one."""
    column = layout.column(align=True)
    column.scale_y = 0.8
    for number, line in enumerate(textwrap.wrap(text, width) or [""]):
        column.label(text=line, icon=icon if number == 0 or icon == "NONE" else "BLANK1")


def _line_length(context) -> int:
    """Characters that fit a line of the sidebar beside an icon."""
    scale = context.preferences.system.ui_scale
    return max(20, int((context.region.width / scale - 70) / 6.2))


def _length(metres: float, units: bpy.types.UnitSettings) -> str:
    """As Blender's own fields show it."""
    return bpy.utils.units.to_string(units.system, "LENGTH", metres, precision=3)


def _number(number: int) -> str:
    return counted(number, "").strip(" s")


def _duration(seconds: float) -> str:
    if seconds < 60:
        return f"{seconds:.1f} s" if seconds < 10 else f"{seconds:.0f} s"
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest} s" if minutes < 60 else f"{minutes // 60} h {minutes % 60} min"


CLASSES = (DETP_PT_bake, DETP_PT_advanced, DETP_PT_result)
