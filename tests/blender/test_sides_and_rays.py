"""Materials and objects that differ by the side that is met and by the kind of ray, held against Cycles."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from beside_cycles import beside_cycles  # noqa: E402
from made_scenes import diffuse, lamp, linked, material, mesh, node, quad, read, world  # noqa: E402

#: metres between the stations, each a floor with something above it
APART = 60.0


pytestmark = pytest.mark.usefixtures("dark_scene")


def output(tree, kind, name):
    return tree.nodes.new(f"ShaderNode{kind}").outputs[name]


def mixed(chosen, first=None, second=None):
    """A material of two shaders, diffuse and transparent unless others are given, mixed by an output."""

    def build(tree):
        shaders = [
            node(tree, f"ShaderNode{kind}", **inputs).outputs[0]
            for kind, inputs in (first or ("BsdfDiffuse", {}), second or ("BsdfTransparent", {}))
        ]
        return node(tree, "ShaderNodeMixShader", Fac=output(tree, *chosen), Shader=shaders[0], Shader_001=shaders[1])

    return material(build)


BACKFACING, SHADOW = ("NewGeometry", "Backfacing"), ("LightPath", "Is Shadow Ray")
GLOW = ("Emission", {"Strength": 2.0})


def veil():
    made = material(lambda tree: node(tree, "ShaderNodeBsdfTransparent"))
    made.use_transparent_shadow = False
    return made


#: what stands over each floor: a material, whether it is turned over, and rays that do not meet it
STATIONS = {
    "a roof that culls its back": (lambda: mixed(BACKFACING), False, ()),
    "the same turned over": (lambda: mixed(BACKFACING), True, ()),
    "a shade for all but shadow rays": (lambda: mixed(SHADOW), False, ()),
    "shadow rays alone": (lambda: mixed(SHADOW, ("BsdfTransparent", {}), ("BsdfDiffuse", {})), False, ()),
    "hidden from shadow rays": (lambda: diffuse((0.8, 0.8, 0.8)), False, ("visible_shadow",)),
    "hidden from diffuse rays": (lambda: diffuse((0.8, 0.8, 0.8)), False, ("visible_diffuse",)),
    "transparent but for shadow rays": (veil, False, ()),
    "shining from its front": (lambda: mixed(BACKFACING, GLOW), False, ()),
    "shining from its back": (lambda: mixed(BACKFACING, ("BsdfTransparent", {}), GLOW), False, ()),
    "two colours": (
        lambda: mixed(BACKFACING, ("BsdfDiffuse", {"Color": (0.9, 0.1, 0.1, 1)}), GLOW), True, (),
    ),
    "translucent": (
        lambda: material(lambda tree: node(tree, "ShaderNodeBsdfTranslucent", Color=(0.7, 0.5, 0.3, 1))), False, (),
    ),
    "shining where shadow rays pass": (lambda: mixed(SHADOW, GLOW), False, ()),
}  # fmt: skip


def test_what_sides_and_rays_decide_agrees_with_cycles():
    """E / pi at the corners of the floors under a sun and, at each, a lamp below the shade."""
    corners, faces = [], []
    for number, (build, over, hidden) in enumerate(STATIONS.values()):
        x = APART * number
        faces.append(range(len(corners), len(corners) + 4))
        corners += [(x - 1, -1, 0), (x + 1, -1, 0), (x + 1, 1, 0), (x - 1, 1, 0)]
        shade = quad("shade", size=6.0, location=(x - 3, -3, 1.5))
        if over:
            shade.rotation_euler, shade.location = (np.pi, 0, 0), (x - 3, 3, 1.5)
        shade.data.materials.append(build())
        for name in hidden:
            setattr(shade, name, False)
        lamp("POINT", location=(x + 0.3, 0.2, 0.8), energy=30.0, shadow_soft_size=0.0)
    floor = linked("floor", mesh(corners, faces))
    floor.data.materials.append(diffuse((0.6, 0.6, 0.6)))
    lamp("SUN", energy=np.pi, angle=0.0)
    # The tree hardly ever finds a lamp that stands alone in hundreds of metres.
    bpy.context.scene.cycles.use_light_tree = False
    ours, theirs, noise = (
        values.mean(axis=1).reshape(-1, 4) for values in beside_cycles(floor, photons=30_000, samples=256)
    )
    # Six seeds tell one corner's noise badly, all corners' together well.
    usual = np.sqrt(np.mean(noise**2)) / 2
    off = dict(zip(STATIONS, np.abs((ours - theirs).mean(axis=1)) / usual, strict=True))
    assert max(off.values()) < 6, off
    direct = {name: theirs[number].mean() > 1.0 for number, name in enumerate(STATIONS)}
    assert direct["a roof that culls its back"] and not direct["the same turned over"]
    assert direct["a shade for all but shadow rays"] and not direct["transparent but for shadow rays"]


def test_only_what_asks_costs_anything():
    """Arrays are of one side, and of one kind of rays, as long as no material asks for more."""
    floor = quad()
    floor.data.materials.append(mixed(("LightPath", "Is Camera Ray")))
    plain = read().scene
    assert plain.albedo.ndim == 2 and plain.unshaded is None
    floor.data.materials[0] = mixed(BACKFACING)
    by_side = read().scene
    assert np.allclose(by_side.albedo, np.reshape((0.8, 0.0), (2, 1, 1))) and by_side.unshaded is None
    assert np.allclose(by_side.transmittance, np.reshape((0.0, 1.0), (2, 1, 1)))
    floor.data.materials[0] = mixed(SHADOW)
    by_rays = read().scene
    assert by_rays.albedo.ndim == 2 and not by_rays.transmittance.any() and np.allclose(by_rays.unshaded, 1.0)


def test_the_worlds_shadow_rays_are_named():
    quad().data.materials.append(mixed(SHADOW))
    assert not any("shadow rays" in sentence for sentence in read().left_out)
    world((1, 1, 1))
    assert any("shadow rays to the world" in sentence for sentence in read().left_out)


@pytest.mark.parametrize("hidden_from", ["diffuse", "shadow"])
def test_diffuse_rays_to_what_shines_are_named(hidden_from):
    """Past a ball that diffuse rays do not meet, Cycles had 7 % more light, and of a box that shadow rays pass half."""
    setattr(quad(), f"visible_{hidden_from}", False)
    assert not any("diffuse rays" in sentence for sentence in read().left_out)
    quad("glow").data.materials.append(material(lambda tree: node(tree, "ShaderNodeEmission")))
    assert any(sentence.startswith("light of what shines that diffuse rays find") for sentence in read().left_out)
