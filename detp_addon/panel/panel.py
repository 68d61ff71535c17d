"""The settings and the button, in the 3D View's sidebar and in the render properties."""

from collections.abc import Iterator

import bpy

from ...core.errors import DetpError
from ..updates.latest_kept import kept_of, may_be_read, note_of_file
from ..wording import duration, percent
from . import session
from .forecasts import forecast_of
from .labels import line_length, sentence
from .properties import bake_request, scene_options
from .show_light import draw_show, has_light
from .use_light import draw_use


class SidebarTab:
    """Where the panels of the sidebar are."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Light Bake"


class RenderTab:
    """Where the panels of the render properties are, beside Cycles' own bake."""

    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"


class _Bake:
    """What most bakes need, in the order in which a user decides it, and the button."""

    bl_label = "Bake Vertex Light"

    def draw(self, context):
        """Settings, greyed out during a bake; then the button, or the progress with its Cancel."""
        settings = context.scene.detp
        column = settings_column(self.layout)
        column.prop(settings, "quantity", text="Bake")
        if settings.quantity == "AMBIENT_OCCLUSION":
            column.prop(settings, "occlusion_distance")
        column.prop(settings, "quality")
        if settings.quality in ("ERROR", "TIME"):
            column.prop(settings, {"ERROR": "error", "TIME": "seconds"}[settings.quality], text=" ")
        fields(column, settings, "targets attribute")
        self.layout.separator()
        bake = session.running()
        if bake is not None:
            _draw_progress(self.layout, bake)
            return
        _draw_button(self.layout, context)
        if has_light(context.scene):
            column = self.layout.column(align=True)
            if context.space_data.type == "VIEW_3D":
                draw_show(column, context)
            draw_use(column, context)


class _Output:
    """What is stored, and how."""

    bl_label = "Output"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        """Settings, greyed out during a bake."""
        settings = context.scene.detp
        column = settings_column(self.layout)
        exposure = column.column(align=True, heading="Exposure")
        exposure.prop(settings, "fit_exposure", text="Fit")
        if not settings.fit_exposure:
            exposure.prop(settings, "exposure", text=" ")
        parts = "" if settings.quantity == "AMBIENT_OCCLUSION" else "split by_light"
        fields(column, settings, f"clamp storage - domain fit {parts} activate")


class _Advanced:
    """What few bakes need."""

    bl_label = "Advanced"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        """Settings, greyed out during a bake."""
        settings = context.scene.detp
        column = settings_column(self.layout)
        _automatic(column, settings, "auto_radius", "radius", "Radius")
        _automatic(column, settings, "auto_photons", "photons", "Photons")
        fields(column, settings, "bounces seed - direct indirect gatherer estimator - live keep")
        if settings.keep:
            column.prop(settings, "keep_on_disk")


def _panels(tab: type, prefix: str, **more) -> Iterator[type]:
    """The panel of the bake in one of both places, and the two in it."""
    bake = f"DETP_PT_{prefix}bake"
    yield type(bake, (tab, _Bake, bpy.types.Panel), more)
    for name, part in (("output", _Output), ("advanced", _Advanced)):
        yield type(f"DETP_PT_{prefix}{name}", (tab, part, bpy.types.Panel), {"bl_parent_id": bake})


def draw_in_render_menu(self, _context) -> None:
    """The bake in Blender's Render menu, where the search for menu entries (F3) finds it too."""
    self.layout.separator()
    self.layout.operator("detp.bake", icon="LIGHT_SUN")


def settings_column(layout: bpy.types.UILayout) -> bpy.types.UILayout:
    """A column of settings with their names on the left, greyed out during a bake."""
    layout.use_property_split = True
    layout.use_property_decorate = False
    column = layout.column()
    column.enabled = session.running() is None
    return column


def fields(column: bpy.types.UILayout, settings, names: str) -> None:
    """The ``settings`` of these names, one below the other, with room where a dash stands."""
    for name in names.split():
        if name == "-":
            column.separator()
        else:
            column.prop(settings, name)


def _automatic(layout, settings, switch: str, value: str, heading: str) -> None:
    """A checkbox "Automatic", and the field only when it is off."""
    column = layout.column(align=True, heading=heading)
    column.prop(settings, switch)
    if not getattr(settings, switch):
        column.prop(settings, value, text=" ")


def _draw_progress(layout: bpy.types.UILayout, bake: session.RunningBake) -> None:
    progress = bake.progress
    column = layout.column(align=True)
    bar = column.row()
    bar.scale_y = 1.3
    bar.progress(factor=bake.fraction, type="BAR", text=f"{progress.phase}  {bake.fraction:.0%}")
    row = column.row(align=True)
    left = "" if bake.remaining is None else f"About {duration(bake.remaining)} left"
    now = "" if progress.error is None else f"error {percent(progress.error)}"
    row.label(text=", ".join(filter(None, (left, now))))
    row = column.row(align=True)
    row.operator("detp.stop", text="Stop and Keep", icon="PAUSE")
    row.operator("detp.cancel", text="Cancel", icon="X")


def _draw_button(layout: bpy.types.UILayout, context) -> None:
    """The button and what it will take; where it cannot work it is grey, and the reason stands below."""
    settings, forecast, reason = context.scene.detp, None, ""
    try:
        forecast = forecast_of(context.scene, context.view_layer, bake_request(scene_options(settings)))
    except DetpError as error:
        reason = str(error)
    if forecast is None and not reason:
        chosen = "No mesh object is selected" if settings.targets == "SELECTED" else "The scene shows no mesh object"
        reason = f"{chosen}: there is nothing to bake."
    row = layout.row()
    row.scale_y = 1.6
    row.enabled = not reason
    row.operator("detp.bake", text="Bake", icon="LIGHT_SUN")
    kept = kept_of(context.scene, context.view_layer) is not None
    if settings.keep or kept or may_be_read(context.scene):
        _draw_update(row, layout, context)
    if reason:
        sentence(layout, reason, line_length(context), "INFO")
        return
    row = layout.row()
    row.active = False
    row.label(text=f"About {duration(forecast.seconds)}, error {percent(forecast.error)}", icon="TIME")


def _draw_update(beside: bpy.types.UILayout, layout: bpy.types.UILayout, context) -> None:
    """The button for updates, ``beside`` the other one, and the switch that presses it by itself."""
    beside.operator("detp.update", text="Update", icon="FILE_REFRESH")
    note = note_of_file(context.scene)
    if note:
        sentence(layout, note, line_length(context), "FILE_BLEND")
    row = layout.row()
    row.use_property_split = False  # which would leave no room for its name
    row.prop(context.window_manager, "detp_live_updates")
    if context.window_manager.detp_live_note:
        sentence(layout, context.window_manager.detp_live_note, line_length(context), "INFO")


CLASSES = (*_panels(SidebarTab, ""), *_panels(RenderTab, "render_", bl_options={"DEFAULT_CLOSED"}))
