"""Settings of Cycles that change the light: each has been decided on, and what is not followed is named."""

import pytest

bpy = pytest.importorskip("bpy")

from detp.detp_addon.reading.render_settings import USUAL_LIMITS  # noqa: E402
from made_scenes import diffuse, fresh, lamp, material, node, quad, read  # noqa: E402


@pytest.fixture(autouse=True)
def scene():
    made = fresh()
    quad("floor")
    return made


def glowing(name="panel"):
    obj = quad(name, location=(0, 0, 2))
    obj.data.materials.append(material(lambda tree: node(tree, "ShaderNodeEmission", Strength=2.0)))
    return obj


def mirror():
    quad("mirror", location=(0, 0, 3)).data.materials.append(
        material(lambda tree: node(tree, "ShaderNodeBsdfGlossy", Roughness=0.0))
    )


def test_blenders_usual_settings_need_no_word(scene):
    glowing()
    mirror()
    lamp("POINT")
    result = read()
    assert result.left_out == () and result.warnings == ()
    for name, limit in USUAL_LIMITS.items():
        assert getattr(scene.cycles, name) == limit


def changed(owner, **settings):
    for name, value in settings.items():
        setattr(owner, name, value)


SCENE = {
    **{name: (name, limit - 1, f"{name.replace('_', ' ')}") for name, limit in USUAL_LIMITS.items()},
    "clamp direct": ("sample_clamp_direct", 3.0, "clamping of direct light at 3"),
    "clamp indirect": ("sample_clamp_indirect", 2.0, "clamping of indirect light at 2"),
    "mirrors": ("caustics_reflective", False, "caustics of mirrors"),
    "glass": ("caustics_refractive", False, "caustics of glass"),
    "fast": ("use_fast_gi", True, "Fast GI"),
    "film": ("film_exposure", 2.0, "film exposure"),
}


@pytest.mark.parametrize("case", SCENE)
def test_settings_of_the_scene_are_named(scene, case):
    name, value, words = SCENE[case]
    setattr(scene.cycles, name, value)
    (sentence,) = read().left_out
    assert words in sentence


def test_culling_and_small_textures_count_in_simplified_scenes_alone(scene):
    scene.cycles.use_camera_cull, scene.cycles.texture_limit_render = True, "256"
    assert read().left_out == ()
    scene.render.use_simplify = True
    left_out = read().left_out
    assert len(left_out) == 2 and "culling" in left_out[0] and "textures made smaller" in left_out[1]


def test_light_linking_of_meshes_that_shine_is_named():
    chosen = bpy.data.collections.new("chosen")
    dark, receiver, blocker = quad("dark"), glowing("receiver"), glowing("blocker")
    for obj in (dark, receiver):
        obj.light_linking.receiver_collection = chosen
    blocker.light_linking.blocker_collection = chosen
    left_out = read().left_out
    assert len(left_out) == 2
    assert any("light linking of 1 object (receiver)" in sentence for sentence in left_out)
    assert any("shadow linking of 1 object (blocker)" in sentence for sentence in left_out)


@pytest.mark.parametrize("kind", ["DISPLACE", "WARP", "VERTEX_WEIGHT_EDIT"])
def test_noise_that_is_another_at_each_look_is_named(kind):
    moved = quad("moved", location=(0, 0, 1)).modifiers.new("moved", kind)
    slot = "mask_texture" if hasattr(moved, "mask_texture") else "texture"
    setattr(moved, slot, bpy.data.textures.new("clouds", "CLOUDS"))
    assert read().left_out == ()
    setattr(moved, slot, bpy.data.textures.new("noise", "NOISE"))
    assert [words for words in read().left_out if "Noise textures in modifiers of 1 object (moved)" in words]
    moved.show_render = False
    assert read().left_out == ()


@pytest.mark.parametrize("prop", ["visible_glossy", "visible_transmission"])
def test_what_mirrors_do_not_show_is_named_where_there_are_some(prop):
    setattr(bpy.data.objects["floor"], prop, False)
    setattr(lamp("POINT", "bulb"), prop, False)
    assert read().left_out == ()
    mirror()
    (sentence,) = read().left_out
    assert "2 objects" in sentence and "bulb" in sentence


@pytest.mark.parametrize("prop", ["glossy", "transmission"])
def test_a_world_that_mirrors_do_not_show_is_named(scene, prop):
    setattr(scene.world.cycles_visibility, prop, False)
    assert read().left_out == ()
    mirror()
    assert any("the world hidden" in sentence for sentence in read().left_out)


def test_shadow_catchers_and_limits_of_lamps_and_worlds_are_named(scene):
    bpy.data.objects["floor"].is_shadow_catcher = True
    lamp("POINT", "bulb").data.cycles.max_bounces = 2
    scene.world.cycles.max_bounces = 1
    words = ("1 object (floor) that only catch", "1 light (bulb)", "the world's light")
    left_out = read().left_out
    assert len(left_out) == 3
    for word in words:
        assert any(word in sentence for sentence in left_out)


def test_holdouts_and_indirect_only_collections_light_as_others_do(scene):
    group = bpy.data.collections.new("group")
    scene.collection.children.link(group)
    quad("inside", location=(0, 0, 1), collection=group)
    before = read()
    layer = bpy.context.view_layer.layer_collection.children["group"]
    for prop in ("holdout", "indirect_only"):
        setattr(layer, prop, True)
        result = read()
        assert len(result.scene.triangles) == len(before.scene.triangles) and result.left_out == ()
        setattr(layer, prop, False)


def test_a_scene_without_a_world_has_no_settings_of_one(scene):
    scene.world = None
    lamp("SUN", energy=1.0)
    assert read().left_out == ()


@pytest.mark.parametrize("albedo, limit, said", [(0.8, 4, True), (0.2, 4, False), (0.8, 64, False), (0.95, 32, True)])
def test_a_word_on_light_that_cycles_would_cut(scene, albedo, limit, said):
    """In a closed room albedo^(limit + 1) of the light comes after the limit."""
    bpy.data.objects["floor"].data.materials.append(diffuse((albedo,) * 3))
    scene.cycles.diffuse_bounces = scene.cycles.max_bounces = limit
    assert any(f"after the {limit} reflections" in sentence for sentence in read().modelled) == said
