"""Light by its groups: what they are, that they add up, that each is what a bake of it alone gives, and mixing."""

import bpy
import numpy as np
import pytest
from detp.core.errors import NotBakedError
from detp.detp_addon.command.command import main
from detp.detp_addon.job import bake_scene
from detp.detp_addon.mixing.light_groups import light_groups, lit_by
from detp.detp_addon.mixing.mix import gains_of, mix
from detp.detp_addon.request import BakeRequest
from detp.detp_addon.writing.baked_layers import light_of
from made_scenes import cube, lamp, linked, material, node, quad, read, world
from small_scenes import colours, opened, saved

GROUPS = ("Key", "Fill", "Rest")


def glowing(strength=2.0):
    return material(lambda tree: node(tree, "ShaderNodeEmission", Strength=strength))


def with_groups():
    """A floor under two lamps, each in a group, and a box that glows and is in none."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    quad("Floor", size=4.0, location=(-2, -2, 0))
    cube("Box", location=(1, 1, 0.6), scale=(0.3, 0.3, 0.3)).data.materials.append(glowing())
    for name, where, energy in (("Key", (-1, -1, 2), 60.0), ("Fill", (1, -1, 2), 20.0)):
        bpy.context.view_layer.lightgroups.add(name=name)
        lamp("POINT", f"{name} lamp", where, energy=energy, shadow_soft_size=0.1).lightgroup = name
    return bpy.context.scene


@pytest.fixture
def scene(addon):
    return with_groups()


def bake(**options):
    options = {"quality": "ERROR", "error": 50.0, "fit": "VERTICES", "by_light": True, **options}
    assert bpy.ops.detp.bake(**options) == {"FINISHED"}


def layer(name, group=None):
    return colours(name, "irradiance" if group is None else f"irradiance:{group}")[:, :3]


def found_groups():
    groups, notes = light_groups(bpy.context.view_layer, read(), "irradiance")
    return [group.name for group in groups], notes


class TestGroups:
    def test_what_belongs_to_no_group_of_the_view_layer_is_the_rest(self, scene):
        assert found_groups() == (["Key", "Fill", "Rest"], [])
        lamp("SUN", "sun", energy=1.0).lightgroup = "of another layer"
        bpy.data.objects["Box"].lightgroup = "Fill"
        export = read()
        key, fill, rest = light_groups(bpy.context.view_layer, export, "irradiance")[0]
        assert [origin[0] for origin in export.origins.lights] == ["Key lamp", "Fill lamp", "sun"]
        assert (key.lights, fill.lights, rest.lights) == ((0,), (1,), (2,))
        assert lit_by(export, fill).emission.any() and not lit_by(export, rest).emission.any()

    def test_an_instance_without_a_group_has_that_of_its_instancer(self, scene):
        held = bpy.data.collections.new("held")
        lamp("POINT", "inner", energy=1.0)
        held.objects.link(bpy.data.objects["inner"])
        scene.collection.objects.unlink(bpy.data.objects["inner"])
        holder = linked("holder", None)
        holder.instance_type, holder.instance_collection, holder.lightgroup = "COLLECTION", held, "Fill"
        assert ("inner", "Fill") in read().origins.lights

    def test_without_light_groups_each_lamp_is_one(self, scene):
        for _ in list(bpy.context.view_layer.lightgroups):
            bpy.context.view_layer.active_lightgroup_index = 0
            bpy.ops.scene.view_layer_remove_lightgroup()
        world((0.1, 0.1, 0.1))
        assert found_groups() == (["Key lamp", "Fill lamp", "World", "Emission"], [])

    def test_of_many_lamps_the_strongest_stay_apart(self, addon):
        quad("Floor")
        for number in range(20):
            lamp("POINT", f"L{number}", (0, 0, 1), energy=1.0 + number)
        names, [note] = found_groups()
        assert names == [*(f"L{number}" for number in range(5, 20)), "Rest"]
        assert "15 strongest" in note


class TestBake:
    def test_the_groups_add_up_to_the_whole(self, scene):
        bake(fit="FACES", fit_exposure=True)
        for name in ("Floor", "Box"):
            total = sum(layer(name, group).astype(float) for group in GROUPS)
            assert np.allclose(total, layer(name), rtol=1e-6, atol=1e-7) and total.any()
            groups = light_of(bpy.data.objects[name].data, "irradiance")["groups"]
            assert [mark["name"] for mark in groups.values()] == list(GROUPS)

    def test_shaded_counts_the_glow_in_its_own_group(self, scene):
        bpy.data.objects["Box"].lightgroup = "Fill"
        bake(quantity="SHADED")
        assert layer("Box", "Fill").min() >= 2.0 and layer("Box", "Key").max() < 2.0
        assert np.allclose(layer("Box", "Fill") + layer("Box", "Key"), layer("Box"), rtol=1e-6)

    def test_each_is_what_the_others_switched_off_leave(self, scene):
        error = 0.02
        options = {"error": 100 * error}
        bake(**options)
        parts = {group: np.concatenate([layer(name, group) for name in ("Floor", "Box")]) for group in GROUPS}
        glow = bpy.data.materials["material"].node_tree.nodes["Emission"].inputs["Strength"]
        for group, part in parts.items():
            for name in ("Key", "Fill"):
                bpy.data.objects[f"{name} lamp"].hide_render = name != group
            glow.default_value = 2.0 if group == "Rest" else 0.0
            bake(**options, by_light=False, seed=7)
            alone = np.concatenate([layer(name) for name in ("Floor", "Box")])
            lit = alone.sum(axis=1) > 0.02 * alone.sum(axis=1).max()
            apart = (part - alone)[lit].sum(axis=1) / alone[lit].sum(axis=1)
            # Half of the values of each are off by less than the error.
            assert np.median(np.abs(apart)) < 2.0 * error and abs(np.median(apart)) < 2.0 * error

    def test_a_bake_that_is_stopped_has_light_of_all_groups(self, scene):
        steps = bake_scene(scene, bpy.context.view_layer, BakeRequest(by_light=True))
        report, wish = None, None
        while report is None:
            try:
                steps.send(wish)
                wish = True
            except StopIteration as end:
                report = end.value
        assert report.light_groups == GROUPS and any("was stopped" in warning for warning in report.warnings)
        assert all(layer("Floor", group).any() for group in GROUPS)
        assert np.allclose(sum(layer("Floor", group) for group in GROUPS), layer("Floor"), rtol=1e-6, atol=1e-7)

    def test_ambient_occlusion_has_no_groups(self, scene):
        with pytest.raises(RuntimeError, match="cannot be baked by light"):
            bake(quantity="AMBIENT_OCCLUSION")


class TestMix:
    def test_the_mixer_follows_its_sliders_and_undo(self, scene):
        bake()
        lights = scene.detp_mix.lights
        assert [entry.name for entry in lights] == list(GROUPS)
        before, alpha = layer("Floor").copy(), colours("Floor")[:, 3]
        bpy.ops.ed.undo_push(message="before")
        lights["Key"].strength = 2.0
        lights["Fill"].colour = (0.5, 0.0, 1.0)
        wanted = 2 * layer("Floor", "Key") + layer("Floor", "Fill") * (0.5, 0, 1) + layer("Floor", "Rest")
        assert np.allclose(layer("Floor"), wanted, rtol=1e-6)
        assert np.array_equal(colours("Floor")[:, 3], alpha)
        bpy.ops.ed.undo_push(message="mixed")
        bpy.ops.ed.undo()
        assert np.array_equal(layer("Floor"), before)
        assert bpy.context.scene.detp_mix.lights["Key"].strength == 1.0
        assert gains_of(bpy.data.objects, "irradiance")["Key"] == (1.0, 1.0, 1.0)

    def test_reset_and_exposure_keep_the_mixture_right(self, scene):
        bake()
        before = layer("Floor").copy()
        scene.detp_mix.lights["Key"].strength = 3.0
        bpy.ops.detp.fit_exposure()
        scale = light_of(bpy.data.objects["Floor"].data, "irradiance")["scale"]
        assert gains_of(bpy.data.objects, "irradiance")["Key"] == (3.0, 3.0, 3.0)
        bpy.ops.detp.reset_mix()
        assert np.allclose(layer("Floor"), scale * before, rtol=1e-5)
        assert scene.detp_mix.lights["Key"].strength == 1.0

    def test_bytes_stay_cut_at_one(self, scene):
        bake(storage="BYTE")
        scene.detp_mix.lights["Key"].strength = 100.0
        assert layer("Floor").max() == 1.0
        scene.detp_mix.lights["Key"].strength = 1.0
        total = sum(layer("Floor", group) for group in GROUPS)
        # Each of the four is rounded to 8 bits in sRGB encoding, whose steps are below 0.009.
        assert np.abs(np.minimum(total, 1) - layer("Floor")).max() < 4 * 0.0045

    def test_what_cannot_be_mixed_is_said(self, scene):
        bake(by_light=False)
        with pytest.raises(NotBakedError, match="bake it by light"):
            mix(bpy.data.objects, "irradiance", {})
        bake()
        mesh = bpy.data.objects["Floor"].data
        mesh.attributes.remove(mesh.attributes["irradiance:Key"])
        with pytest.raises(NotBakedError, match="'Floor' has lost the layer 'irradiance:Key'"):
            mix(bpy.data.objects, "irradiance", {"Key": (2, 2, 2)})


def test_the_command_bakes_and_mixes(tmp_path, capsys, addon):
    with_groups()
    source, baked = saved(tmp_path / "scene.blend"), tmp_path / "baked.blend"
    quick = ["--error", "50%", "--fit", "vertices", "--quiet"]
    assert main(["bake", str(source), "-o", str(baked), "--by-light", *quick]) == 0
    assert main(["mix", str(baked), "--gain", "Key=2,Fill=1:0.5:0", "-o", str(baked)]) == 0
    assert "Key: 2\nFill: 1:0.5:0\nRest: 1\nSaved" in capsys.readouterr().out
    opened(baked)
    wanted = 2 * layer("Floor", "Key") + layer("Floor", "Fill") * (1, 0.5, 0) + layer("Floor", "Rest")
    assert np.allclose(layer("Floor"), wanted, rtol=1e-6)
    entry = bpy.context.scene.detp_mix.lights["Fill"]
    assert (entry.strength, tuple(entry.colour)) == (1.0, (1.0, 0.5, 0.0))
    before = baked.read_bytes()
    for wrong, status, why in (
        (["--gain", "Kay=2", "-o", str(baked)], 1, "No light group 'Kay' is in 'irradiance': did you mean 'Key'?"),
        (["--gain", "Key=-1", "-o", str(baked)], 2, "choose 0 or more"),
        (["--gain", "Key=2"], 2, "Say with -o"),
        (["--gain", "Key", "-o", str(baked)], 2, "is no mixture"),
        (["--attribute", "Other"], 1, "No mesh has light by groups in 'Other'"),
    ):
        assert main(["mix", str(baked), *wrong]) == status
        assert why in capsys.readouterr().err
    assert baked.read_bytes() == before
