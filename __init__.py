"""DETP for Blender: global illumination in vertex colours by density estimation on the tangent plane.

The repository's root is the Blender extension and, installed with pip, the package ``detp``. Blender calls
:func:`register`; everything that needs bpy is imported only then, so that the core works without Blender.
"""


def register():
    """Add the operators, the panel and the ``detp`` command to Blender."""
    from . import detp_addon

    detp_addon.register()


def unregister():
    """Take everything away that :func:`register` added."""
    from . import detp_addon

    detp_addon.unregister()
