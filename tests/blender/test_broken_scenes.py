"""What broken scenes once made of a bake: each a finding of tools/fuzz_scenes.py, built as small as it can be."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from detp.detp_addon.reading.remembered import DEEPEST, Remembered  # noqa: E402
from made_scenes import fresh, material, node, quad, read  # noqa: E402


@pytest.fixture(autouse=True)
def scene():
    return fresh()


def albedo_of(build):
    quad().data.materials.append(material(build))
    return read().scene.albedo


def test_shaders_mixed_with_themselves_are_looked_at_once():
    """Two to the power of forty paths lead through these nodes."""

    def ladder(tree):
        shader = node(tree, "ShaderNodeBsdfDiffuse", Color=(0.5, 0.25, 0.125, 1))
        for _ in range(40):
            shader = node(tree, "ShaderNodeMixShader", Fac=0.3, Shader=shader.outputs[0], Shader_001=shader.outputs[0])
        return shader

    assert np.allclose(albedo_of(ladder), (0.5, 0.25, 0.125))


def test_node_trees_may_be_deeper_than_pythons_stack():
    def chain(tree):
        value = node(tree, "ShaderNodeValue")
        value.outputs[0].default_value = 0.0
        for _ in range(300):
            value = node(tree, "ShaderNodeMath", {"operation": "ADD"}, Value=value.outputs[0], Value_001=0.002)
        shader = node(tree, "ShaderNodeBsdfDiffuse", Color=value.outputs[0])
        for _ in range(100):
            shader = node(tree, "ShaderNodeMixShader", Fac=0.0, Shader=shader.outputs[0])
        return shader

    assert np.allclose(albedo_of(chain), 0.6)


def test_what_is_remembered_is_found_once_at_any_depth_and_loops_end():
    asked = []

    def number(n):
        asked.append(n)
        return 1 + known.of(n - 1, lambda: number(n - 1)) if n else 0

    known = Remembered(in_a_loop=None)
    assert known.of(50 * DEEPEST, lambda: number(50 * DEEPEST)) == 50 * DEEPEST
    assert len(asked) < 3 * 50 * DEEPEST
    for length in (1, DEEPEST - 1, DEEPEST, 3 * DEEPEST):
        ring = Remembered(in_a_loop="loop")

        def follow(n, ring=ring, length=length):
            after = (n + 1) % length
            return ring.of(after, lambda: follow(after))

        assert ring.of(0, lambda follow=follow: follow(0)) == "loop"
