"""Bakes by workers of any kind, shared by tests: a room, what is the same in two bakes, and workers that are lost."""

import uuid

import numpy as np
from detp.core import BakeSettings, PointLight, Points, SpotLight
from detp.core.bake import bake
from detp.core.cluster.crew import Crew
from rooms import box_quads, face_points, scene_of

QUICK = BakeSettings(photons=3_000)
PHOTONS = BakeSettings(photons=40_000, radius=0.2, indirect="photons")


def lamps():
    spot = SpotLight((0.2, 0.2, 0.9), (0, 0, -1), (5, 5, 5), 1.0, 0.2, 0.05)
    many = [PointLight((x, 0.7, 0.8), (1, 2, 1), 0.02) for x in np.linspace(0.1, 0.9, 33)]
    return PointLight((0.5, 0.4, 0.6), (3, 2, 1)), spot, *many


def room(lights=None, emission=0.0, **more):
    """A room of six walls, with its points."""
    quads = box_quads((1.0, 1.0, 1.0))
    scene = scene_of(quads, 0.6, emission, lamps() if lights is None else lights, **more)
    points, normals = face_points(quads, 10)
    return scene, Points(0.97 * (points - 0.5) + 0.5, normals)


def same(one, other):
    """Whether two results are equal, bit for bit."""
    for name in ("direct", "indirect", "seen"):
        for part in ("value", "standard_error"):
            assert np.array_equal(getattr(getattr(one, name), part), getattr(getattr(other, name), part))
    counts = [(each.photons, each.segments, each.shadow_rays, each.radius) for each in (one, other)]
    return counts[0] == counts[1]


def steps_by(hands, scene, points, settings):
    """The steps of a bake by these ``hands``."""
    return bake(scene, points, settings, crew=Crew(hands, uuid.uuid4().hex, scene, points, settings))


def finished_after_loss(steps, phase, number, lose):
    """What the ``steps`` come to, when workers are made to ``lose`` at the ``number``-th step of that ``phase``."""
    seen, lost = 0, False
    while True:
        try:
            progress = next(steps)
        except StopIteration as end:
            assert lost
            return end.value
        seen += progress.phase == phase
        if seen == number and not lost:
            lose()
            lost = True
