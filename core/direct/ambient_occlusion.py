"""Ambient occlusion: the direct light of a white sky in which only what is near casts shadows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..lights.world import UniformWorld
from ..rays import MOST_OF_ALL
from ..scene import Scene
from ..settings import BakeSettings

#: The distance within which surfaces occlude, as a share of the scene's radius, when none is given.
DISTANCE_SHARE = 0.2

#: A scene is that much wider than its vertices usually lie from their middle only where some are astray, and then their
#: usual distance counts: else everything would occlude.
ASTRAY = 64.0


def ambient_occlusion(scene: Scene, settings: BakeSettings) -> tuple[Scene, BakeSettings]:
    """The scene and settings whose irradiance over pi is the open share of each point's hemisphere, cosine-weighted.

    The sky has the radiance 1, so an open point has the irradiance pi. Surfaces farther away than
    ``settings.shadow_distance`` do not count; by default that is DISTANCE_SHARE of the scene's radius.
    """
    distance = settings.shadow_distance or DISTANCE_SHARE * _radius(scene)
    sky = replace(scene, emission=np.zeros_like(scene.emission), lights=(UniformWorld(np.ones(3)),))
    return sky, replace(settings, direct="shadow-rays", indirect="off", shadow_distance=distance)


def _radius(scene: Scene) -> float:
    """The radius of the scene, metres, without what is far astray."""
    radius, away = scene.bounds.radius, scene.vertices - np.median(scene.vertices, axis=0)
    usual = float(np.median(np.sqrt(np.einsum("ij,ij->i", away, away))))
    return MOST_OF_ALL * usual if 0.0 < ASTRAY * usual < radius else radius
