"""The buttons that put the baked light into the materials, take it out, and fit its exposure."""

import bpy
from bpy.props import EnumProperty

from ..command.terminal import escaped
from ..materials.light_in_materials import materials_with_light, remove_from_materials, use_in_materials
from ..wording import counted
from ..writing.encoding import fit_stored
from . import session
from .idle import Idle
from .properties import attribute_name, core_name
from .show_light import follow_light


class DETP_OT_use_in_material(Idle, bpy.types.Operator):
    """Put the baked light into the materials of all meshes that have it, so that renders and glTF exports carry it"""

    bl_idname = "detp.use_in_material"
    bl_label = "Use in Material"

    way: EnumProperty(
        name="As",
        description="What the light does in the materials",
        items=[
            ("AUTO", "Automatic", "Base color for ambient occlusion, else unlit"),
            ("UNLIT", "Unlit", "The camera sees color times light, and no lamp adds to it"),
            ("BASE_COLOR", "Base Color", "The light multiplies the base color, and lamps light that still"),
        ],
        default="AUTO",
    )

    def _act(self, context):
        use = use_in_materials(context.scene.objects, attribute_name(context.scene.detp), core_name(self.way))
        for note in use.notes:
            self.report({"WARNING"}, escaped(note))
        self.report({"INFO"}, f"{use.sentence()} Material Preview, renders and glTF exports show it.")
        follow_light()


class DETP_OT_remove_from_material(Idle, bpy.types.Operator):
    """Take the baked light out of the scene's materials again, and leave them as they were before"""

    bl_idname = "detp.remove_from_material"
    bl_label = "Remove from Material"

    def _act(self, context):
        count = remove_from_materials(context.scene.objects)
        self.report({"INFO"}, f"Removed the light from {counted(count, 'material')}.")
        follow_light()


class DETP_OT_fit_exposure(Idle, bpy.types.Operator):
    """Multiply the stored light so that 99 % of its lit colours are 1 or less, and note the factor on the meshes"""

    bl_idname = "detp.fit_exposure"
    bl_label = "Fit Exposure"

    def _act(self, context):
        settings = context.scene.detp
        brightness = fit_stored(context.scene.objects, attribute_name(settings))
        settings.fit_exposure = True  # and the next bake fits it by itself
        session.exposed(brightness)
        self.report({"INFO"}, brightness.sentence())


def draw_use(layout: bpy.types.UILayout, context) -> None:
    """The buttons for the light that the scene has."""
    row = layout.row(align=True)
    row.operator("detp.use_in_material", icon="MATERIAL")
    if any(True for _ in materials_with_light(context.scene.objects)):
        row.operator("detp.remove_from_material", text="", icon="X")


CLASSES = (DETP_OT_use_in_material, DETP_OT_remove_from_material, DETP_OT_fit_exposure)
