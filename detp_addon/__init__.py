"""The Blender side: reads scenes, writes colour attributes, the panel, the operators and the command line."""

from __future__ import annotations

#: what Blender wants back to take ``blender --command detp`` away
_command = None


def register() -> None:
    """Add properties, operators, the panels, the handlers and ``blender --command detp``."""
    global _command
    import bpy

    from .command import command
    from .panel import animation, handlers, live_updates, mixer, panel, properties, show_light

    properties.register_properties()
    mixer.register_mixture()
    animation.register_animation()
    live_updates.register_live_updates()
    for cls in _classes():
        bpy.utils.register_class(cls)
    bpy.types.VIEW3D_PT_shading.append(show_light.draw_in_shading)
    bpy.types.TOPBAR_MT_render.append(panel.draw_in_render_menu)
    handlers.register_handlers()
    _command = command.register_command()


def unregister() -> None:
    """Take everything away that :func:`register` added; a running bake is cancelled."""
    import bpy

    from .command import command
    from .panel import animation, handlers, live_updates, mixer, panel, properties, show_light

    command.unregister_command(_command)
    handlers.unregister_handlers()
    bpy.types.TOPBAR_MT_render.remove(panel.draw_in_render_menu)
    bpy.types.VIEW3D_PT_shading.remove(show_light.draw_in_shading)
    for cls in reversed(_classes()):
        bpy.utils.unregister_class(cls)
    live_updates.unregister_live_updates()
    animation.unregister_animation()
    mixer.unregister_mixture()
    properties.unregister_properties()


def _classes() -> tuple[type, ...]:
    """The operators and panels in the order in which Blender wants them."""
    from .panel import animation, mixer, operators, panel, result_panel, show_light, update, use_light

    parts = (operators, update, show_light, use_light, panel, animation, mixer, result_panel)
    return tuple(cls for part in parts for cls in part.CLASSES)
