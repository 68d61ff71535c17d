"""Which settings of Cycles change the light, and what was decided on each: honoured, harmless or named.

A test walks over Blender's own lists of properties and fails where one is missing here.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .findings import Findings

#: read where scenes, lamps and worlds are; without effect on the light that surfaces receive
HONOURED, HARMLESS = "honoured", "harmless"

#: how far a path may go before Cycles' usual limits cut it; scenes that allow less are named
USUAL_LIMITS = {
    "max_bounces": 12, "diffuse_bounces": 4, "glossy_bounces": 4, "transmission_bounces": 12,
    "transparent_max_bounces": 8,
}  # fmt: skip

#: share of the light, in a closed room, whose lack would be seen
WORTH_A_WORD = 0.02

#: as far as any limit on a light's bounces can matter
FAR = 64


def _below_usual(name: str) -> Callable:
    def sentence(settings):
        limit = getattr(settings, name)
        if limit < USUAL_LIMITS[name]:
            return f"the scene's limit of {limit} for {name.replace('_', ' ')}, beyond which light is followed here"
        return None

    return sentence


def _when(unlike: object, name: str, words: str) -> Callable:
    """The ``words`` when a setting is other than its usual value."""
    return lambda settings: words if getattr(settings, name) != unlike else None


def _clamped(name: str, usual: float) -> Callable:
    def sentence(settings):
        most = getattr(settings, name)
        if 0 < most and not 0 < usual <= most:
            return f"the clamping of {name.split('_')[-1]} light at {most:g}, which is kept whole here"
        return None

    return sentence


def _few_bounces(words: str) -> Callable:
    return lambda settings: words if settings.max_bounces < FAR else None


def _where_simplified(unlike: object, name: str, words: str) -> Callable:
    """The same in scenes with *Simplify* alone, which most settings of it need."""
    sentence = _when(unlike, name, words)
    return lambda settings: sentence(settings) if settings.id_data.render.use_simplify else None


_CULLED = "culling by camera or distance, which leaves all objects in place here"
_SMALLER = "textures made smaller by Simplify, which have their own size here"

#: by the kind of settings: property -> a function that gives a sentence where it changes the light
NAMED = {
    "scene": {
        **{name: _below_usual(name) for name in USUAL_LIMITS},
        "sample_clamp_direct": _clamped("sample_clamp_direct", 0.0),
        "sample_clamp_indirect": _clamped("sample_clamp_indirect", 10.0),
        "caustics_reflective": _when(True, "caustics_reflective", "switched-off caustics of mirrors, thrown here"),
        "caustics_refractive": _when(True, "caustics_refractive", "switched-off caustics of glass, thrown here"),
        "use_fast_gi": _when(False, "use_fast_gi", "Fast GI, in whose place all light is followed to its end"),
        "film_exposure": _when(1.0, "film_exposure", "film exposure, by which the light is not multiplied here"),
        "use_camera_cull": _where_simplified(False, "use_camera_cull", _CULLED),
        "use_distance_cull": _where_simplified(False, "use_distance_cull", _CULLED),
        "texture_limit_render": _where_simplified("OFF", "texture_limit_render", _SMALLER),
        "texture_resolution_render": _where_simplified(1.0, "texture_resolution_render", _SMALLER),
    },
    "object": {
        "use_adaptive_subdivision": _when(
            False, "use_adaptive_subdivision", "adaptive subdivision of {}, divided as the modifier says instead"
        ),
    },
    "visibility": {
        "is_shadow_catcher": _when(False, "is_shadow_catcher", "{} that only catch shadows, ordinary surfaces here"),
    },
    "visibility in mirrors": {
        "visible_glossy": _when(True, "visible_glossy", "{} hidden from mirrors, which show them here"),
        "visible_transmission": _when(True, "visible_transmission", "{} hidden through glass, seen through it here"),
    },
    "light": {"max_bounces": _few_bounces("the limit on bounces of the light of {}, followed to its end here")},
    "world": {
        "max_bounces": _few_bounces("the limit on bounces of the world's light, followed to its end here"),
        "use_shadows": _when(True, "use_shadows", "light without shadows of the world, which does cast them here"),
    },
    "world in mirrors": {
        "glossy": _when(True, "glossy", "the world hidden from mirrors, which show it here"),
        "transmission": _when(True, "transmission", "the world hidden through glass, seen through it here"),
    },
    "view layer": {"use_solid": _when(True, "use_solid", "the view layer's hidden surfaces, which are there here")},
}

#: honoured by kind of settings
_HONOURED = {
    "visibility": {"visible_diffuse", "visible_shadow", "hide_render", "color", "pass_index"},
    "light": {"is_portal"},
    "world in mirrors": {"diffuse"},
    "view layer": set("material_override world_override use_sky layer_collection use objects lightgroups".split()),
    "collection": {"exclude", "hide_viewport", "collection", "children"},
    "material data": {"node_tree", "use_nodes", "diffuse_color", "use_transparent_shadow", "pass_index"},
    "world data": {"node_tree", "use_nodes", "color", "lightgroup"},
    "lamp": set(
        "angle color energy exposure node_tree normalize shadow_soft_size shape size size_y spot_blend spot_size "
        "spread temperature temperature_color type use_nodes use_soft_falloff use_temperature".split()
    ),
    "node": set(
        "attribute_name attribute_type blend_type clamp clamp_factor clamp_result clamp_type color_ramp data_type "
        "distribution extension factor_mode fresnel_type from_instancer gradient_type image interpolation "
        "interpolation_type invert is_active_output layer_name mapping mode node_tree object operation rotation_type "
        "target texture_mapping use_clamp uv_map vector_type "
        # of skies, which Cycles makes a picture of
        "aerosol_density air_density altitude dust_density ground_albedo ozone_density sky_type sun_direction sun_disc "
        "sun_elevation sun_intensity sun_rotation sun_size turbidity".split()
    ),
}

#: named where lamps and shining meshes are read
_NAMED_THERE = {
    "light linking": {"receiver_collection", "blocker_collection"},
    "lamp": {"use_shadow", "use_square"},
    # With the nodes that have them, which are named as a whole.
    "node": set(
        "active_index active_item axis bands_direction base bytecode bytecode_hash component convention convert_from "
        "convert_to direction_type distance falloff feature filepath gabor_type ies image_user inside model "
        "noise_dimensions noise_type normalize offset offset_frequency only_local parametrization "
        "particle_color_source particle_system phase point_source projection radius resolution rings_direction "
        "sample_attribute_items script space squash squash_frequency subsurface_method turbulence_depth "
        "use_auto_update use_pixel_size use_tips vertex_attribute_name vertex_color_source voronoi_dimensions "
        "wave_profile wave_type".split()
    ),
}

#: parts of names of settings for noise, speed, pictures, motion, and of volumes, hair and previews
_HARMLESS_PARTS = (
    "adaptive_", "bake_type", "bump_map_correction", "caustics_caster", "caustics_light", "caustics_receiver",
    "cryptomatte", "cull_margin", "debug_", "denois", "device", "dicing", "emission_sampling", "feature_set",
    "film_transparent", "filter", "guiding", "homogeneous_volume", "importance_sampling", "light_sampling",
    "light_tree", "max_subdivisions", "min_light", "min_transparent", "motion", "pass_", "pixel_jitter", "preview_",
    "rolling_shutter", "sample_map", "sample_offset", "sample_subset", "samples", "sampling", "scrambling", "seed",
    "shading_system", "shadow_terminator", "texture_", "tile", "time_limit", "volume",
)  # fmt: skip

#: of Fast GI alone; mirrors' blur; and what shows in pictures or holds lists, of view layers, objects and collections
_HARMLESS = frozenset(
    "ao_bounces ao_bounces_render ao_distance fast_gi_method blur_glossy use_camera_cull use_distance_cull camera "
    "scatter shadow visible_camera visible_volume_scatter visible_raycast is_holdout holdout indirect_only is_visible "
    "cycles eevee depsgraph aovs active_aov active_aov_index active_lightgroup active_lightgroup_index "
    "use_strand use_ao use_freestyle freestyle_settings use_grease_pencil active_layer_collection "
    "has_export_collections".split()
)

#: of EEVEE, viewports, lists and pictures, by kind; displacement is named by the nodes that make it
_HARMLESS_OF = {
    "material data": set(
        "surface_render_method displacement_method blend_method shadow_method alpha_threshold lineart roughness "
        "use_transparency_overlap show_transparent_back use_backface_culling use_backface_culling_shadow metallic "
        "use_backface_culling_lightprobe_volume lightprobe_volume_single_sided use_raytrace_refraction line_color "
        "use_screen_refraction use_sss_translucency refraction_depth thickness_mode use_thickness_from_shadow "
        "max_vertex_displacement paint_active_slot paint_clone_slot specular_color specular_intensity line_priority "
        "grease_pencil is_grease_pencil volume_intersection_method preview_render_type use_preview_world "
        "texture_paint_images texture_paint_slots".split()
    ),
    "world data": set(
        "light_settings mist_settings probe_resolution sun_threshold sun_angle use_sun_shadow "
        "use_eevee_finite_volume sun_shadow_maximum_resolution sun_shadow_filter_radius use_sun_shadow_jitter "
        "sun_shadow_jitter_overblur".split()
    ),
    "lamp": set(
        "cutoff_distance diffuse_factor specular_factor transmission_factor volume_factor show_cone "
        "use_custom_distance shadow_buffer_clip_start shadow_cascade_count shadow_cascade_exponent "
        "shadow_cascade_fade shadow_cascade_max_distance shadow_filter_radius shadow_jitter_overblur "
        "shadow_maximum_resolution use_absolute_resolution use_shadow_jitter contact_shadow_bias "
        "contact_shadow_distance contact_shadow_thickness use_contact_shadow shadow_buffer_bias shadow_color".split()
    ),
    # Noise, blends of projections that are named, and what Cycles does not ask for.
    "node": set("aov_name color_mapping projection_blend samples use_alpha".split()),
}


def decision(kind: str, name: str) -> str | None:
    """What was decided on the property ``name`` of a ``kind`` of settings; None when nothing was."""
    if name in NAMED.get(kind, ()) or name in _NAMED_THERE.get(kind, ()):
        return "named"
    if name in _HONOURED.get(kind, ()):
        return HONOURED
    known = name in _HARMLESS_OF.get(kind, ()) or (
        kind not in _HARMLESS_OF and (name in _HARMLESS or any(part in name for part in _HARMLESS_PARTS))
    )
    return HARMLESS if known else None


def note(kind: str, settings, findings: Findings, thing: str = "", name: str = "") -> None:
    """Name the settings of a ``kind`` that change the light and are not followed; ``settings`` None has none."""
    for prop, sentence in NAMED[kind].items() if settings is not None else ():
        words = sentence(settings) if hasattr(settings, prop) else None
        if words:
            findings.left_out(words, thing, name)


def note_scene(scene, view_layer, world, mirrors: bool, findings: Findings) -> None:
    """Name what the scene, its view layer and its world ask of Cycles and do not get here.

    ``mirrors`` says whether anything mirrors or refracts.
    """
    note("scene", getattr(scene, "cycles", None), findings)
    note("view layer", view_layer, findings)
    note("world", getattr(world, "cycles", None), findings)
    if mirrors:
        note("world in mirrors", getattr(world, "cycles_visibility", None), findings)


def note_reflections(scene, albedo: np.ndarray, findings: Findings) -> None:
    """Say that surfaces of this ``albedo`` (..., 3) reflect, and whether beyond what the scene lets Cycles follow."""
    if not albedo.any():
        return
    findings.modelled("diffuse bounces")
    cycles = getattr(scene, "cycles", None)
    most = FAR if cycles is None else min(cycles.diffuse_bounces, cycles.max_bounces)
    if most < FAR and albedo.reshape(-1, 3).mean(axis=0).max() ** (most + 1) > WORTH_A_WORD:
        findings.modelled(f"light after the {most} reflections at which the scene lets Cycles stop")


def note_object(obj, shines: bool, mirrors: bool, findings: Findings) -> None:
    """Name the same of an object, mesh or lamp; a mesh may shine, and there may be mirrors in the scene."""
    if mirrors:
        note("visibility in mirrors", obj, findings, "object", obj.name)
    if obj.type == "LIGHT":
        note("light", getattr(obj.data, "cycles", None), findings, "light", obj.name)
        return
    note("visibility", obj, findings, "object", obj.name)
    note("object", getattr(obj, "cycles", None), findings, "object", obj.name)
    for modifier in obj.modifiers:  # from Blender 5 on it is the modifier's
        note("object", modifier, findings, "object", obj.name)
        textures = [getattr(modifier, name, None) for name in ("texture", "mask_texture")]
        if modifier.show_render and any(texture and texture.type == "NOISE" for texture in textures):
            findings.left_out("Noise textures in modifiers of {}, which Blender makes anew whenever it looks, so that "
                              "renders see other surfaces", "object", obj.name)  # fmt: skip
    linking = getattr(obj, "light_linking", None)
    if shines and linking and linking.receiver_collection:
        findings.left_out("light linking of {} that shine, which light everything here", "object", obj.name)
    if shines and linking and linking.blocker_collection:
        findings.left_out("shadow linking of {} that shine, which everything shades here", "object", obj.name)
