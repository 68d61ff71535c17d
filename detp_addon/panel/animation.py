"""The panel's part for light that moves: which frames, which objects, bake it, remove it."""

import bpy
from bpy.props import EnumProperty

from ...core.errors import DetpError
from ..animation.bake_animation import bake_animation
from ..animation.frames import Frames
from ..animation.moving import MOVING, is_animated
from ..animation.playback import animated_objects, remove_playback
from ..wording import counted, duration
from . import session
from .forecasts import forecast_of
from .idle import Idle
from .operators import BakeRunner
from .panel import SidebarTab, fields, settings_column
from .properties import BakeOptions, Flag, Whole, attribute_name, bake_request, scene_options


class FrameOptions:
    """What the scene's settings and the operator's arguments have in common."""

    own_range: Flag("Own Range", "Bake other frames than those that the scene renders", False)
    first: Whole("First", "The first frame", 1)
    last: Whole("Last", "The last frame", 48)
    every: Whole(
        "Every", "Bake every so many frames, and the last one. The light of those between is blended", 1, min=1
    )
    moving_only: Flag(
        "Moving Only",
        "Bake objects that do not move once, at the first frame. Smaller, and much faster where most stands still, but "
        "they show no shadow or light of those that move",
        False,
    )
    whole: Flag(
        "Whole Frames",
        "Bake each frame as a whole: exactly what a still bake gives there. Otherwise those after the first are "
        "updates of it where that is possible, just as good and faster",
        False,
    )


class DETP_PG_animation(FrameOptions, bpy.types.PropertyGroup):
    """The panel's settings for animations, saved with the scene."""


class DETP_OT_bake_animation(FrameOptions, BakeOptions, BakeRunner, bpy.types.Operator):
    """Bake the light at key frames, and let it play in the meshes' color attributes"""

    bl_idname = "detp.bake_animation"
    bl_label = "Bake Animation"

    def _wants_live(self, _context) -> bool:
        return False  # one frame's light would be shown on another frame's scene

    def _options(self, context) -> dict:
        return super()._options(context) | self._given(_frame_options(context.scene))

    def _steps(self, context, request, options, _live):
        frames = frames_of(context.scene, options)
        return bake_animation(
            context.scene, context.view_layer, request, frames, options["moving_only"], options["whole"]
        )

    def _expected(self, context, request, options) -> float | None:
        still = forecast_of(context.scene, context.view_layer, request)
        return None if still is None else still.seconds * len(frames_of(context.scene, options).keys)

    def _remember(self, _context, _seconds) -> None:
        """What frames took says little of a still bake."""


class DETP_OT_remove_animation(Idle, bpy.types.Operator):
    """Remove the baked animation from the attribute of the panel. The light of its first frame stays"""

    bl_idname = "detp.remove_animation"
    bl_label = "Remove Animation"

    def _act(self, context):
        count = remove_playback(context.scene.objects, attribute_name(context.scene.detp))
        self.report({"INFO"}, f"Removed the animation from {counted(count, 'object')}.")


class DETP_OT_mark_moving(Idle, bpy.types.Operator):
    """Say whether the selected objects move, for animations that bake moving ones alone"""

    bl_idname = "detp.mark_moving"
    bl_label = "Mark as Moving"

    moving: EnumProperty(
        name="Moving",
        description="Whether the objects move",
        items=[
            ("AUTO", "Automatic", "Those move that have keys, drivers, constraints or physics, or whose parents do"),
            ("YES", "Moving", "They move"),
            ("NO", "Static", "They do not move"),
        ],
        default="YES",
    )

    def _act(self, context):
        for obj in context.selected_objects:
            if self.moving != "AUTO":
                obj[MOVING] = self.moving == "YES"
            elif MOVING in obj:
                del obj[MOVING]


class DETP_PT_animation(SidebarTab, bpy.types.Panel):
    """Animations in the sidebar."""

    bl_label = "Animation"
    bl_parent_id = "DETP_PT_bake"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        """Which frames; then the buttons, and what it will take."""
        scene, settings = context.scene, context.scene.detp_animation
        column = settings_column(self.layout)
        fields(column, settings, f"own_range {'first last' if settings.own_range else ''} every moving_only")
        if settings.moving_only and context.object is not None:
            _draw_moving(column, context.object)
        column.prop(settings, "whole")
        if session.running() is not None:
            return
        column.operator("detp.bake_animation", icon="RENDER_ANIMATION")
        try:
            frames = frames_of(scene, _frame_options(scene))
            still = forecast_of(scene, context.view_layer, bake_request(scene_options(scene.detp)))
        except DetpError as error:
            column.label(text=str(error), icon="INFO")
            return
        if still is not None:
            count = len(frames.keys)
            text = f"About {duration(count * still.seconds)} for {counted(count, 'frame')}"
            column.label(text=text, icon="TIME")
        if animated_objects(scene.objects, attribute_name(scene.detp)):
            column.operator("detp.remove_animation", icon="X")


def frames_of(scene: bpy.types.Scene, options: dict) -> Frames:
    """The frames that the operator's arguments mean. Raises InvalidSettingError."""
    first, last = (options["first"], options["last"]) if options["own_range"] else (scene.frame_start, scene.frame_end)
    return Frames(first, last, options["every"])


def _frame_options(scene: bpy.types.Scene) -> dict:
    """The scene's settings for animations as arguments of the operator."""
    return {name: getattr(scene.detp_animation, name) for name in FrameOptions.__annotations__}


def _draw_moving(layout: bpy.types.UILayout, obj: bpy.types.Object) -> None:
    """Whether the active object moves, and the choice."""
    marked = obj.get(MOVING)
    state = "Moving" if (is_animated(obj) if marked is None else marked) else "Static"
    layout.label(text=f"{obj.name}: {state}" + (" (automatic)" if marked is None else ""))
    layout.operator_menu_enum("detp.mark_moving", "moving", text="Selected Objects")


CLASSES = (DETP_PG_animation, DETP_OT_bake_animation, DETP_OT_remove_animation, DETP_OT_mark_moving, DETP_PT_animation)
