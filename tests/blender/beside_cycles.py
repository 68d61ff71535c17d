"""Our bake and Cycles' own of one object, each with several seeds, so that what differs beyond noise can be told."""

import bpy
import numpy as np
from detp.core.settings import BakeSettings
from detp.core.stages import finished
from detp.detp_addon.job import bake_scene
from detp.detp_addon.request import BakeRequest
from detp.detp_addon.tradeoff.cycles_bake import bake_with_cycles, light_of, set_up_cycles
from detp.detp_addon.tradeoff.face_copies import give_light_attribute

SEEDS = 6


def beside_cycles(obj, samples=256, photons=100_000, radius=None):
    """E / pi (corners, 3) as we and Cycles bake it, means over SEEDS, and the standard error of their difference."""
    scene, layer = bpy.context.scene, bpy.context.view_layer
    ours = []
    for seed in range(SEEDS):
        request = BakeRequest(
            BakeSettings(photons=photons, seed=seed, radius=radius), (obj.name,), activate=False, fit="vertices"
        )
        finished(bake_scene(scene, layer, request))
        ours.append(light_of(obj, "irradiance"))
    give_light_attribute(obj.data)
    set_up_cycles(scene, bounces=16)
    theirs = []
    for seed in range(SEEDS):
        assert bake_with_cycles([obj], samples, seed).complete
        theirs.append(light_of(obj))
    errors = [np.std(values, axis=0, ddof=1) / np.sqrt(SEEDS) for values in (ours, theirs)]
    return np.mean(ours, axis=0), np.mean(theirs, axis=0), np.hypot(*errors)


def worst(ours, theirs, noise):
    """The largest difference (RGB together), in standard errors; what rounds off counts as a thousandth."""
    return (np.abs(ours - theirs) / np.hypot(noise, 1e-3 * theirs.max())).max()
