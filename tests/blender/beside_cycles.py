"""Our bake and Cycles' own of one object, each with several seeds, so that what differs beyond noise can be told.

And what Cycles says that an object gives off.
"""

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


def emitted(obj):
    """What Cycles' own bake says that each triangle gives off (T, 3), the mean of its corners."""
    scene, data = bpy.context.scene, obj.data
    set_up_cycles(scene, bounces=0)
    scene.cycles.samples = 1
    data.color_attributes.new("emitted", "FLOAT_COLOR", "CORNER")
    paint = data.attributes.active_color_name
    data.attributes.active_color_name = "emitted"
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.bake(type="EMIT", target="VERTEX_COLORS")
    data.attributes.active_color_name = paint
    values = np.empty((len(data.loops), 4), np.float32)
    data.attributes["emitted"].data.foreach_get("color", values.ravel())
    return values[:, :3].reshape(-1, 3, 3).mean(axis=1)
