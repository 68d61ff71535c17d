"""The Blender side: reads scenes, writes colour attributes, the panel, the operators and the command line."""

from __future__ import annotations

#: what Blender wants back to take ``blender --command detp`` away
_command = None


def register() -> None:
    """Add properties, operators, the panels, the handlers and ``blender --command detp``."""
    global _command
    import bpy

    from .command import command
    from .panel import handlers, live_updates, panel, show_light

    live_updates.register_live_updates()
    for cls in _classes():
        bpy.utils.register_class(cls)
    for name, group in _settings().items():
        setattr(bpy.types.Scene, name, bpy.props.PointerProperty(type=group))
    bpy.types.VIEW3D_PT_shading.append(show_light.draw_in_shading)
    bpy.types.TOPBAR_MT_render.append(panel.draw_in_render_menu)
    handlers.register_handlers()
    _command = bpy.utils.register_cli_command("detp", command.inside_blender)


def unregister() -> None:
    """Take everything away that :func:`register` added; a running bake is cancelled."""
    import bpy

    from .panel import handlers, live_updates, panel, show_light

    bpy.utils.unregister_cli_command(_command)
    handlers.unregister_handlers()
    bpy.types.TOPBAR_MT_render.remove(panel.draw_in_render_menu)
    bpy.types.VIEW3D_PT_shading.remove(show_light.draw_in_shading)
    for name in _settings():
        delattr(bpy.types.Scene, name)
    for cls in reversed(_classes()):
        bpy.utils.unregister_class(cls)
    live_updates.unregister_live_updates()


def _classes() -> tuple[type, ...]:
    """The settings, operators and panels in the order in which Blender wants them."""
    from .panel import animation, mixer, operators, panel, properties, result_panel, show_light, update, use_light

    parts = (properties, operators, update, show_light, use_light, panel, animation, mixer, result_panel)
    return tuple(cls for part in parts for cls in part.CLASSES)


def _settings() -> dict[str, type]:
    """What every scene has of settings, by the property's name; the values stay in files whatever becomes of it."""
    from .panel import animation, mixer, properties

    return {
        "detp": properties.DETP_PG_settings,
        "detp_mix": mixer.DETP_PG_mixture,
        "detp_animation": animation.DETP_PG_animation,
    }
