"""The light mixer: strength and colour of each light group, mixed while they are changed."""

import bpy
import numpy as np
from bpy.props import CollectionProperty, FloatProperty, FloatVectorProperty, StringProperty

from ...core.errors import DetpError
from ..mixing.mix import gains_of, has_mixture, mix
from . import session
from .idle import Idle
from .labels import line_length, sentence
from .panel import SidebarTab
from .properties import attribute_name

#: while entries are made to say what the meshes hold, there is nothing to mix
_following = False


def _changed(entry, _context) -> None:
    """Mix anew; what stands in the way is said by the panel."""
    if _following or session.running():
        return
    scene = entry.id_data
    try:
        mix(scene.objects, attribute_name(scene.detp), {entry.name: _gain(entry)})
    except DetpError as error:
        print(f"detp: {error}")


class DETP_PG_light(bpy.types.PropertyGroup):
    """How one light group counts in the mixture."""

    strength: FloatProperty(
        name="Strength",
        description="What the light of this group is multiplied by",
        min=0.0,
        soft_max=10.0,
        default=1.0,
        update=_changed,
    )
    colour: FloatVectorProperty(
        name="Color",
        description="What the light of this group is tinted with",
        subtype="COLOR",
        size=3,
        min=0.0,
        soft_max=1.0,
        default=(1.0, 1.0, 1.0),
        update=_changed,
    )


class DETP_PG_mixture(bpy.types.PropertyGroup):
    """How the light in an attribute is mixed; the meshes note it too, and have the last word."""

    attribute: StringProperty(name="Attribute", description="The attribute whose light the groups describe")
    lights: CollectionProperty(
        type=DETP_PG_light, name="Lights", description="How each light group counts in the mixture"
    )


class DETP_OT_find_lights(Idle, bpy.types.Operator):
    """List the light groups that the light in the attribute of the panel is mixed of"""

    bl_idname = "detp.find_lights"
    bl_label = "Find Light Groups"

    def _act(self, context):
        # Needed after layers came from elsewhere, or the panel's attribute was changed.
        follow_mixture(context.scene)


class DETP_OT_reset_mix(Idle, bpy.types.Operator):
    """Let all light groups count as they were baked"""

    bl_idname = "detp.reset_mix"
    bl_label = "Reset Mix"

    def _act(self, context):
        scene, attribute = context.scene, attribute_name(context.scene.detp)
        mix(scene.objects, attribute, dict.fromkeys(gains_of(scene.objects, attribute), (1.0, 1.0, 1.0)))
        follow_mixture(scene)


class DETP_PT_mixer(SidebarTab, bpy.types.Panel):
    """The light mixer in the sidebar."""

    bl_label = "Light Mixer"

    @classmethod
    def poll(cls, context):
        """Where there is light to mix."""
        scene = context.scene
        return scene is not None and has_mixture(scene.objects, attribute_name(scene.detp))

    def draw(self, context):
        """A row for each light group; greyed out during a bake."""
        settings, mixture, column = context.scene.detp, context.scene.detp_mix, self.layout.column(align=True)
        column.enabled = session.running() is None
        if mixture.attribute != attribute_name(settings) or not mixture.lights:
            column.operator("detp.find_lights", icon="LIGHT")
            return
        for entry in mixture.lights:
            row = column.row(align=True)
            row.prop(entry, "strength", text=entry.name)
            colour = row.row(align=True)
            colour.ui_units_x = 2
            colour.prop(entry, "colour", text="")
        column.operator("detp.reset_mix", icon="LOOP_BACK")
        if settings.split:
            sentence(self.layout, "Direct and indirect parts are not mixed.", line_length(context), "INFO")


def follow_mixture(scene: bpy.types.Scene) -> None:
    """Let the scene's entries say how its light is mixed; those that say it already keep their words."""
    global _following
    mixture, attribute = scene.detp_mix, attribute_name(scene.detp)
    gains = gains_of(scene.objects, attribute)
    before = {entry.name: (_gain(entry), entry.strength, tuple(entry.colour)) for entry in mixture.lights}
    _following = True
    try:
        mixture.lights.clear()
        mixture.attribute = attribute
        for name, gain in gains.items():
            entry = mixture.lights.add()
            said, strength, colour = before.get(name, (None, 0.0, None))
            if said is None or not np.allclose(said, gain, rtol=1e-5):
                strength = max(gain)
                colour = tuple(channel / strength for channel in gain) if strength else (1.0,) * 3
            entry.name, entry.strength, entry.colour = name, strength, colour
    finally:
        _following = False


def _gain(entry: DETP_PG_light) -> tuple[float, float, float]:
    return tuple(entry.strength * channel for channel in entry.colour)


CLASSES = (DETP_PG_light, DETP_PG_mixture, DETP_OT_find_lights, DETP_OT_reset_mix, DETP_PT_mixer)
