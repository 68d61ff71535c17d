"""Ambient occlusion: the direct light of a white sky in which only what is near casts shadows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..lights.world import UniformWorld
from ..scene import Scene
from ..settings import BakeSettings

#: The distance within which surfaces occlude, as a share of the scene's radius, when none is given.
DISTANCE_SHARE = 0.2


def ambient_occlusion(scene: Scene, settings: BakeSettings) -> tuple[Scene, BakeSettings]:
    """The scene and settings whose irradiance over pi is the open share of each point's hemisphere, cosine-weighted.

    The sky has the radiance 1, so an open point has the irradiance pi. Surfaces farther away than
    ``settings.shadow_distance`` do not count; by default that is DISTANCE_SHARE of the scene's radius.
    """
    distance = settings.shadow_distance or DISTANCE_SHARE * scene.bounds.radius
    sky = replace(scene, emission=np.zeros_like(scene.emission), lights=(UniformWorld(np.ones(3)),))
    return sky, replace(settings, direct="shadow-rays", indirect="off", shadow_distance=distance)
