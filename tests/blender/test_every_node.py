"""Every node and every setting of Cycles, lamps, worlds and materials: honoured as in Cycles, or named, or harmless."""

from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

import scene_table  # noqa: E402
from beside_cycles import emitted  # noqa: E402
from scene_table import HARMLESS, HONOURED, NAMED_WORD, Zoo  # noqa: E402

TEXT = (Path(__file__).parents[2] / "docs" / "scenes.md").read_text()


def unlike_cycles(shaders):
    """The keys of ``shaders`` of which nothing was said though Cycles gives another value: (ours, Cycles')."""
    zoo = Zoo.of(list(shaders.values()))
    result, said = zoo.read()
    ours = result.scene.emission.reshape(-1, len(said), 3)[0]
    theirs = emitted(zoo.obj)
    off = {}
    for key, mine, other, words in zip(shaders, ours, theirs, said, strict=True):
        if not words and not np.allclose(mine, other, rtol=5e-3, atol=2e-3):
            off[key] = mine, other
    return off


def test_what_is_not_named_is_what_cycles_gives():
    """Light Path tells Cycles' bake of a camera; test_light_paths.py and test_sides_and_rays.py have it.

    Images that are missing are named for all materials together.
    """
    shaders = scene_table.outputs()
    assert len(shaders) > 130
    others = ("ShaderNodeLightPath", "ShaderNodeTexImage")
    assert unlike_cycles({key: made for key, made in shaders.items() if key[0] not in others}) == {}


#: nodes whose settings choose what they do: the setting, and others that are set before
CHOICES = {
    "Math": [("operation", {})],
    "VectorMath": [("operation", {})],
    "Mix": [("blend_type", {"data_type": "RGBA"}), ("factor_mode", {"data_type": "VECTOR"})],
    "MixRGB": [("blend_type", {})],
    "MapRange": [("interpolation_type", {}), ("interpolation_type", {"clamp": False}),
                 ("interpolation_type", {"data_type": "FLOAT_VECTOR"})],
    "Clamp": [("clamp_type", {})],
    "VectorRotate": [("rotation_type", {}), ("rotation_type", {"invert": True})],
    "SeparateColor": [("mode", {})],
    "CombineColor": [("mode", {})],
    "Mapping": [("vector_type", {})],
    "RGBCurve": [(None, {})],
    "VectorCurve": [(None, {})],
    "FloatCurve": [(None, {})],
    "HueSaturation": [(None, {})],
    "BrightContrast": [(None, {})],
    "Invert": [(None, {})],
    "Gamma": [(None, {})],
}  # fmt: skip


def choices():
    """(node, choice, others, seed) -> a shader that shows its first output, for numbers of both signs and above one."""
    scratch, found = scene_table.emptied(bpy.data.materials.new("scratch")), {}
    for name, settings in CHOICES.items():
        for setting, others in settings:
            node = scratch.nodes.new(f"ShaderNode{name}")
            items = node.bl_rna.properties[setting].enum_items.keys() if setting else [None]
            for item in items:
                for seed in (1, 2):
                    chosen = {**others, **({setting: item} if setting else {})}
                    found[name, str(chosen), seed] = _chosen(f"ShaderNode{name}", chosen, seed)
    return found


def _chosen(kind, settings, seed):
    def build(tree):
        node = tree.nodes.new(kind)
        for name, value in settings.items():
            setattr(node, name, value)
        generator = np.random.default_rng(seed)
        # From Blender 5 on nodes with nothing but constants are worked out elsewhere, by rules of their own for these.
        low, high = (0, 1) if kind.endswith(("FloatCurve", "MapRange")) else (-0.6, 1.4)
        for socket in node.inputs:
            if socket.type == "VALUE":
                socket.default_value = float(generator.uniform(low, high))
            elif socket.type == "RGBA":
                socket.default_value = (*generator.random(3), 1)
            elif socket.type == "VECTOR" and not socket.hide_value:
                # A zero among them, in every second one, divides nothing.
                size = len(socket.default_value)
                chosen = generator.uniform(low, high, size) * (seed == 1, *[1] * (size - 1))
                socket.default_value = tuple(chosen)
        return next(output for output in node.outputs if output.enabled)

    return lambda tree: scene_table.shining(tree, build)


def test_whatever_nodes_are_set_to_do_they_do_as_in_cycles_or_are_named():
    shaders = choices()
    assert len(shaders) > 250
    assert unlike_cycles(shaders) == {}


def test_textures_map_coordinates_by_themselves_as_in_cycles():
    """Scripts, and files of old, set what no panel shows."""

    def gradient(number):
        def build(tree):
            node, generator = tree.nodes.new("ShaderNodeTexGradient"), np.random.default_rng(number)
            # Within where the gradient is straight.
            near = tree.nodes.new("ShaderNodeMapping")
            near.inputs["Location"].default_value, near.inputs["Scale"].default_value = (0.4, 0.5, 0.6), (0.05,) * 3
            tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"], near.inputs["Vector"])
            tree.links.new(near.outputs["Vector"], node.inputs["Vector"])
            own = node.texture_mapping
            own.vector_type = ("POINT", "TEXTURE", "VECTOR", "NORMAL")[number % 4]
            own.translation, own.rotation = generator.uniform(-0.1, 0.1, 3), generator.uniform(-0.3, 0.3, 3)
            own.scale = generator.uniform(0.7, 1.1, 3)
            axes = (("X", "Y", "Z"), ("Y", "Z", "X"), ("NONE", "X", "Y"), ("Y", "Y", "X"))
            own.mapping_x, own.mapping_y, own.mapping_z = axes[number // 4]
            return node.outputs["Fac"]

        return lambda tree: scene_table.shining(tree, build)

    shaders = {number: gradient(number) for number in range(16)}
    zoo = Zoo.of(list(shaders.values()))
    assert len(np.unique(zoo.read()[0].scene.emission.round(3))) > 8
    assert unlike_cycles(shaders) == {}


def test_generated_coordinates_stay_on_what_is_bent():
    def build(tree):
        return tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"]

    zoo = Zoo.of([lambda tree: scene_table.shining(tree, build)])
    obj = zoo.obj
    for name in ("Basis", "bent"):
        obj.shape_key_add(name=name)
    for place in obj.data.shape_keys.key_blocks["bent"].data:
        place.co = (place.co.y, 2.0 * place.co.x, place.co.x + 1.0)
    flat = zoo.read()[0].scene.emission
    obj.data.shape_keys.key_blocks["bent"].value = 1.0
    bent, said = zoo.read()
    np.testing.assert_allclose(bent.scene.emission, flat, atol=1e-5)
    assert said == [""]
    np.testing.assert_allclose(emitted(obj), flat.reshape(-1, 3)[:1], atol=2e-3)


@pytest.mark.parametrize(
    "kind, domain",
    [
        *((kind, "EDGE") for kind in ("FLOAT", "INT", "BOOLEAN", "FLOAT_COLOR")),
        *(("QUATERNION", "POINT"), ("FLOAT2", "CORNER"), ("INT8", "FACE")),
    ],
)
def test_attributes_of_all_domains_and_types_are_as_in_cycles(kind, domain):
    def build(tree):
        node = tree.nodes.new("ShaderNodeAttribute")
        node.attribute_name = "gift"
        return node.outputs["Color"]

    zoo = Zoo.of([lambda tree: scene_table.shining(tree, build)])
    layer = zoo.obj.data.attributes.new("gift", kind, domain)
    generator = np.random.default_rng(1)
    for element in layer.data:
        field = next(name for name in ("color", "vector", "value") if hasattr(element, name))
        held = getattr(element, field)
        number = generator.uniform(0.2, 3.0, 4)
        setattr(element, field, type(held)(number[0]) if np.isscalar(held) else number[: len(held)])
    result, _ = zoo.read()
    ours = result.scene.emission.reshape(-1, 3)[:1]
    assert ours.max() > 0.1
    np.testing.assert_allclose(ours, emitted(zoo.obj), rtol=5e-3, atol=2e-3)


def test_low_temperatures_have_the_colours_of_cycles():
    def glow(kelvin):
        def build(tree):
            node = tree.nodes.new("ShaderNodeBlackbody")
            node.inputs[0].default_value = kelvin
            return node.outputs[0]

        return lambda tree: scene_table.shining(tree, build)

    assert unlike_cycles({kelvin: glow(float(kelvin)) for kelvin in (801, 1000, 1500, 2000, 3000, 6500, 11000)}) == {}


@pytest.mark.parametrize("heading", scene_table.TABLES)
def test_the_tables_say_what_this_blender_has(heading):
    """Each thing stands in the column of what becomes of it, and nothing was left undecided."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    _, make, _ = scene_table.TABLES[heading]
    written = scene_table.parsed(TEXT, heading)
    made = make()
    undecided = {name: row["?"] for name, row in made.items() if row.get("?")}
    assert undecided == {}
    for name, row in made.items():
        for decision in (HONOURED, NAMED_WORD, HARMLESS):
            missing = set(row.get(decision, ())) - set(written.get(name, {}).get(decision, ()))
            assert not missing, f"{name}: {sorted(missing)} {decision}; run tools/scene_table.py docs/scenes.md"
