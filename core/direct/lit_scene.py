"""A scene as rays look at it that ask for its light: what all of them share is made once."""

from __future__ import annotations

from collections.abc import Sequence

from ..lights.emissive import EmissiveTriangles
from ..lights.light import Light, is_lamp
from ..photons.emission import lights_of
from ..rays import RayCaster
from ..scene import Scene
from .emitters import Emitters
from .shadows import Shadows


class LitScene:
    """A ``scene``, whose surfaces ``caster`` has.

    Attributes: both; its ``lights``, of which ``surroundings`` are all but the lamps; and ``shadows``.
    """

    def __init__(self, scene: Scene, caster: RayCaster):
        self.scene, self.caster = scene, caster
        self.lights = lights_of(scene)
        self.surroundings = [light for light in self.lights if not is_lamp(light)]
        self.shadows = Shadows(scene, caster)
        self._emitters: dict[tuple[int, ...], Emitters] = {}

    def emitters(self, lights: Sequence[Light]) -> Emitters:
        """Those among which rays choose: some lamps of the scene's ``lights``, or all triangles of one that shines."""
        key = tuple(map(id, lights))
        if key not in self._emitters:
            shining = isinstance(lights[0], EmissiveTriangles)
            self._emitters[key] = Emitters.of_triangles(lights[0]) if shining else Emitters.of_lamps(lights)
        return self._emitters[key]
