"""Density estimation on the tangent plane with NumPy and embreex; knows nothing of Blender.

Whoever has a mesh in arrays needs ``baked``, or ``bake`` of :mod:`.bake` to go step by step, with a ``Scene`` of
triangles and lights, ``Points`` where light is wanted, and ``BakeSettings``.
"""

from importlib import import_module

#: Where each name comes from. They are loaded when they are asked for: Blender starts without Embree.
_NAMES = {
    "AreaLight": "lights.area",
    "BakeResult": "result",
    "BakeSettings": "settings",
    "DetpError": "errors",
    "PointLight": "lights.point",
    "Points": "points",
    "Progress": "result",
    "Scene": "scene",
    "SpotLight": "lights.spot",
    "SunLight": "lights.sun",
    "UniformWorld": "lights.world",
    "baked": "bake",
}

__all__ = sorted(_NAMES)


def __getattr__(name: str):
    if name not in _NAMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f".{_NAMES[name]}", __name__), name)
