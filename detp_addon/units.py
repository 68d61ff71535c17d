"""The one rule for lengths: Blender's are turned into metres where they are read, as the scene's units say."""

import bpy


def metres_per_unit(scene: bpy.types.Scene) -> float:
    """How long one of Blender's own units is; as in Blender's fields, the scale counts only where there are units."""
    settings = scene.unit_settings
    return 1.0 if settings.system == "NONE" else settings.scale_length
