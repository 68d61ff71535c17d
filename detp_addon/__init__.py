"""The Blender side: reads scenes, writes colour attributes, the panel, the operators and the command line."""

from __future__ import annotations

#: what Blender wants back to take ``blender --command detp`` away
_command = None


def register() -> None:
    """Add properties, operators, the panel, the handlers and ``blender --command detp``."""
    global _command
    import bpy

    from .command import command
    from .panel import handlers, operators, panel, properties, show_light

    properties.register_properties()
    for cls in (*operators.CLASSES, *show_light.CLASSES, *panel.CLASSES):
        bpy.utils.register_class(cls)
    handlers.register_handlers()
    _command = command.register_command()


def unregister() -> None:
    """Take everything away that :func:`register` added; a running bake is cancelled."""
    import bpy

    from .command import command
    from .panel import handlers, operators, panel, properties, show_light

    command.unregister_command(_command)
    handlers.unregister_handlers()
    for cls in reversed((*operators.CLASSES, *show_light.CLASSES, *panel.CLASSES)):
        bpy.utils.unregister_class(cls)
    properties.unregister_properties()
