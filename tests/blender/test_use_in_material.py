"""Baked light in materials: put in, exported, taken out; and no bake reads it."""

import bpy
import numpy as np
import pytest
from detp.core.errors import NotBakedError
from detp.core.settings import BakeSettings
from detp.core.stages import finished
from detp.detp_addon.job import bake_scene
from detp.detp_addon.materials.light_in_materials import materials_with_light, remove_from_materials, use_in_materials
from detp.detp_addon.request import BakeRequest
from detp.detp_addon.writing.encoding import Encoding
from detp.detp_addon.writing.write_attributes import MeshColours, write_colours
from glb import Glb
from made_scenes import cube, diffuse, fresh, image, linked, map_to_unit_square, material, mesh, node, quad, read, world
from small_scenes import colours

PAINT = (0.8, 0.4, 0.2)


def plain():
    return material(lambda tree: node(tree, "ShaderNodeBsdfPrincipled", Base_Color=(*PAINT, 1)), "plain")


def textured():
    pixels = image(np.tile((*PAINT, 1.0), (2, 2, 1)), "pixels", "Non-Color")
    build = lambda tree: node(  # noqa: E731
        tree, "ShaderNodeBsdfPrincipled", Base_Color=node(tree, "ShaderNodeTexImage", {"image": pixels}).outputs[0]
    )
    return material(build, "textured")


def with_alpha():
    return material(lambda tree: node(tree, "ShaderNodeBsdfPrincipled", Base_Color=(*PAINT, 1), Alpha=0.5), "alpha")


def painted():
    def build(tree):
        return node(
            tree, "ShaderNodeBsdfDiffuse", Color=node(tree, "ShaderNodeVertexColor", {"layer_name": "Col"}).outputs[0]
        )

    return material(build, "painted")


def mixed():
    def build(tree):
        first, second = (node(tree, "ShaderNodeBsdfDiffuse", Color=(*rgb, 1)) for rgb in (PAINT, (0.1, 0.1, 0.1)))
        return node(tree, "ShaderNodeMixShader", Fac=0.25, Shader=first.outputs[0], Shader_001=second.outputs[0])

    return material(build, "mixed")


def leaf():
    def build(tree):
        clear, green = node(tree, "ShaderNodeBsdfTransparent"), node(tree, "ShaderNodeBsdfDiffuse", Color=(*PAINT, 1))
        return node(tree, "ShaderNodeMixShader", Fac=0.75, Shader=clear.outputs[0], Shader_001=green.outputs[0])

    return material(build, "leaf")


def glowing():
    def build(tree):
        return node(tree, "ShaderNodeBsdfPrincipled", Base_Color=(*PAINT, 1), Emission_Strength=2.0)

    return material(build, "glowing")


def in_a_group():
    group = bpy.data.node_groups.new("shader", "ShaderNodeTree")
    group.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    shader = node(group, "ShaderNodeBsdfPrincipled", Base_Color=(*PAINT, 1))
    group.links.new(shader.outputs[0], group.nodes.new("NodeGroupOutput").inputs[0])
    return material(lambda tree: node(tree, "ShaderNodeGroup", {"node_tree": group}), "grouped")


def without_nodes():
    made = bpy.data.materials.new("no nodes")
    made.diffuse_color = (*PAINT, 1)
    if bpy.app.version < (5, 0):
        made.use_nodes = False
    else:
        made.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (*PAINT, 1)
    return made


KINDS = (plain, textured, with_alpha, painted, mixed, leaf, glowing, in_a_group, without_nodes)


def room(made):
    """Two walls of one material that face each other under an even sky."""
    fresh()
    world((1, 1, 1))
    low = quad("low")
    high = linked("high", mesh([(0, 0, 0.5), (0, 1, 0.5), (1, 1, 0.5), (1, 0, 0.5)], [(0, 1, 2, 3)]))
    used = made()
    for obj in (low, high):
        obj.data.materials.append(used)
        map_to_unit_square(obj)
        layer = obj.data.color_attributes.new("Col", "FLOAT_COLOR", "CORNER")
        layer.data.foreach_set("color", np.tile((*PAINT, 1.0), 4).astype(np.float32))
    return used


def bake(**options):
    request = BakeRequest(BakeSettings(error=0.5, indirect="off"), **options)
    return finished(bake_scene(bpy.context.scene, bpy.context.view_layer, request))


def light_up(*names, quantity="lighting", even=False, look=False):
    """What a bake leaves, with random light at each corner, or the same at all, and a look for the viewport."""
    objects = [bpy.data.objects[name] for name in names or ("low", "high")]
    rng = np.random.default_rng(1)
    light = [rng.uniform(0.1, 1.0, (len(obj.data.loops), 3)) for obj in objects]
    if even:
        light = [np.tile(rgb[:1], (len(rgb), 1)) for rgb in light]
    entries = [
        MeshColours(obj, {"irradiance": rgb}, {"quantity": quantity}, look=rgb / 2 if look else None)
        for obj, rgb in zip(objects, light, strict=True)
    ]
    write_colours(entries, "CORNER", "irradiance")


def use(way="auto", attribute="irradiance"):
    return use_in_materials(bpy.context.scene.objects, attribute, way)


def exported(tmp_path, **settings):
    path = tmp_path / "scene.glb"
    bpy.ops.export_scene.gltf(filepath=str(path), **settings)
    return Glb(path)


def fingerprint(material):
    """All that nodes are: their kinds, values and links."""
    found = []
    for tree in (material.node_tree, *bpy.data.node_groups):
        for each in tree.nodes if tree else ():
            values = [str(getattr(s, "default_value", None) and list(np.ravel(s.default_value))) for s in each.inputs]
            found.append((each.bl_idname, each.name, values))
        for link in tree.links if tree else ():
            found.append(
                (link.from_node.name, link.from_socket.identifier, link.to_node.name, link.to_socket.identifier)
            )
    return bpy.app.version >= (5, 0) or material.use_nodes, sorted(map(str, found))


def optics():
    scene = read().scene
    return [scene.albedo, scene.emission, scene.transmittance] if hasattr(scene, "transmittance") else [scene.albedo]


@pytest.mark.parametrize("way", ["unlit", "base-color"])
@pytest.mark.parametrize("kind", KINDS)
def test_the_next_bake_is_the_same_and_all_can_be_taken_out(kind, way):
    used = room(kind)
    nodes, before = fingerprint(used), optics()
    light_up()
    for _ in range(2):  # the second time replaces the first
        done = use(way)
        assert done.unlit + done.base == [used.name]
    assert list(materials_with_light(bpy.context.scene.objects)) == [used]
    for mine, theirs in zip(optics(), before, strict=True):
        np.testing.assert_allclose(mine, theirs, atol=1e-7)
    assert remove_from_materials(bpy.context.scene.objects) == 1
    if kind is not without_nodes:  # Blender makes the nodes it would have made for a new material
        assert fingerprint(used) == nodes
    assert bpy.app.version >= (5, 0) or used.use_nodes == (kind is not without_nodes)


@pytest.mark.parametrize("way", ["unlit", "base-color"])
def test_a_second_bake_gives_the_same_light_bit_by_bit(way):
    room(mixed)
    bake()
    light = colours("low")
    use(way)
    assert bake().warnings == ()
    np.testing.assert_array_equal(colours("low"), light)


@pytest.mark.parametrize("way", ["unlit", "base-color"])
@pytest.mark.parametrize("kind", [plain, textured, with_alpha, glowing, in_a_group, without_nodes])
def test_a_default_export_carries_the_light(kind, way, tmp_path):
    used = room(kind)
    light_up()
    use(way)
    glb = exported(tmp_path)
    for name in ("low", "high"):
        layer = colours(name)[:, :3]
        mesh_ = bpy.data.objects[name].data
        places, values = glb.corners(name, "COLOR_0")
        corners = np.array([mesh_.vertices[loop.vertex_index].co for loop in mesh_.loops])
        nearest = np.linalg.norm(places[:, None] - corners, axis=2).argmin(axis=1)
        np.testing.assert_allclose(values[:, :3], layer[nearest], atol=1e-6)
    entry = glb.material(used.name)
    unlit = way == "unlit" and kind not in (glowing, in_a_group)
    assert ("KHR_materials_unlit" in entry.get("extensions", {})) == unlit
    surface = entry["pbrMetallicRoughness"]
    if kind is textured:
        assert "baseColorTexture" in surface
    else:
        np.testing.assert_allclose(surface["baseColorFactor"], (*PAINT, 0.5 if kind is with_alpha else 1), atol=1e-6)


def test_colours_above_one_arrive_uncut_and_their_scale_in_the_extras(tmp_path):
    room(plain)
    world((5, 5, 5))
    report = bake()
    assert report.brightness.above == report.brightness.colours == 8
    use()
    assert exported(tmp_path).corners("low", "COLOR_0")[1].min() > 1
    report = bake(encoding=Encoding(None))
    assert report.brightness.above == 0 and 0.1 < report.brightness.scale < 1
    glb = exported(tmp_path, export_extras=True)
    assert glb.corners("low", "COLOR_0")[1].max() <= 1
    light = glb.extras("low")["detp_bakes"]["light"]["irradiance"]
    assert light["quantity"] == "lighting" and light["scale"] == pytest.approx(report.brightness.scale)


def test_meshes_without_material_export_their_light_by_themselves(tmp_path):
    room(plain)
    cube("bare", location=(5, 0, 0))
    light_up("low", "bare", look=True)
    assert any("'bare'" in note for note in use().notes)
    exported_colours = exported(tmp_path).corners("bare", "COLOR_0")[1]
    assert exported_colours[:, :3].max() == pytest.approx(colours("bare")[:, :3].max(), abs=1e-4)


@pytest.mark.parametrize(("slots", "named"), [([plain, None], True), ([None, plain], False), ([plain, plain], False)])
def test_faces_in_an_empty_slot_are_named(slots, named):
    fresh()
    walls = cube("walls")
    for each in slots:
        walls.data.materials.append(each and each())
    walls.data.polygons.foreach_set("material_index", [1, 1, 1, 1, 1, 7])
    light_up("walls")
    assert any("'walls'" in note and "without material" in note for note in use().notes) == named


def test_materials_of_geometry_nodes_are_named_unless_a_slot_has_them_too(tmp_path):
    fresh()
    walls, given = cube("walls"), plain()
    walls.data.materials.append(textured())
    group = bpy.data.node_groups.new("given", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    give = node(group, "GeometryNodeSetMaterial", Geometry=group.nodes.new("NodeGroupInput").outputs[0], Material=given)
    group.links.new(give.outputs[0], group.nodes.new("NodeGroupOutput").inputs[0])
    walls.modifiers.new("given", "NODES").node_group = group
    light_up("walls")
    assert any("'walls'" in note and "Geometry nodes" in note for note in use().notes)
    walls.data.materials.append(given)
    assert use().notes == []
    seen = exported(tmp_path, export_apply=True).corners("walls", "COLOR_0")[1]
    assert np.isin(np.round(seen, 6), np.round(colours("walls")[:, :3], 6)).all()


def test_others_with_the_same_material_are_not_black():
    used = room(plain)
    other = cube("other", location=(5, 0, 0))
    other.data.materials.append(used)
    light_up()
    assert any("'other'" in note for note in use().notes)
    assert (colours("other") == 1).all()
    assert np.allclose([target.albedo.mean(axis=0) for target in read().targets], PAINT, atol=1e-6)
    remove_from_materials(bpy.context.scene.objects)
    assert "irradiance" not in other.data.color_attributes
    assert "irradiance" in bpy.data.objects["low"].data.color_attributes


def test_lamps_and_what_is_linked_stay_as_they_are_and_are_named(tmp_path):
    used = room(plain)
    library = tmp_path / "library.blend"
    bpy.data.libraries.write(str(library), {used})
    shine = material(lambda tree: node(tree, "ShaderNodeEmission"), "shine")
    with bpy.data.libraries.load(str(library), link=True) as (_, wanted):
        wanted.materials = ["plain"]
    bpy.data.objects["low"].data.materials[0] = shine
    bpy.data.objects["high"].data.materials[0] = wanted.materials[0]
    before = fingerprint(shine)
    light_up()
    done = use()
    assert not done.unlit and not done.base and "No material" in done.sentence()
    assert any("'shine'" in note for note in done.notes) and any("library" in note for note in done.notes)
    assert fingerprint(shine) == before


def test_paint_and_light_do_not_both_fit_a_gltf_file_and_that_is_said(tmp_path):
    room(painted)
    light_up()
    assert any("'painted'" in note for note in use().notes)
    light = exported(tmp_path).corners("low", "COLOR_0")[1]
    assert np.isin(np.round(light, 6), np.round(colours("low")[:, :3], 6)).all()
    remove_from_materials(bpy.context.scene.objects)
    light_up(quantity="shaded")
    assert use().notes == []
    shaded = exported(tmp_path).corners("low", "COLOR_0")[1]
    np.testing.assert_allclose(shaded, light, rtol=1e-6)


def test_ambient_occlusion_goes_into_the_base_colour():
    room(plain)
    light_up(quantity="ambient-occlusion")
    assert use().base == ["plain"]


def test_materials_follow_when_the_light_becomes_another_quantity(tmp_path):
    room(plain)
    bake()
    use()
    assert exported(tmp_path).material("plain")["pbrMetallicRoughness"]["baseColorFactor"][0] == pytest.approx(0.8)
    assert any("'plain'" in warning for warning in bake(quantity="shaded").warnings)
    assert "baseColorFactor" not in exported(tmp_path).material("plain")["pbrMetallicRoughness"]
    assert bake(quantity="shaded").warnings == ()


def test_what_is_not_baked_has_a_sentence():
    room(plain)
    with pytest.raises(NotBakedError, match="'night'"):
        use(attribute="night")


def test_a_camera_sees_colour_times_light(tmp_path):
    used = room(plain)
    bpy.data.objects["high"].data.materials[0] = diffuse((0.5, 0.5, 0.5))
    assert used.users == 1
    light_up(even=True)
    use("unlit")
    bpy.data.objects.remove(bpy.data.objects["high"])
    scene = bpy.context.scene
    scene.camera = linked("camera", bpy.data.cameras.new("camera"), location=(0.5, 0.5, 0.4))
    scene.render.engine, scene.cycles.samples, scene.cycles.use_denoising = "CYCLES", 4, False
    scene.render.resolution_x = scene.render.resolution_y = 4
    scene.view_settings.view_transform = "Raw"
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.filepath = str(tmp_path / "seen.exr")
    bpy.ops.render.render(write_still=True)
    seen = bpy.data.images.load(scene.render.filepath)
    pixels = np.array(seen.pixels[:]).reshape(-1, 4)[:, :3]
    np.testing.assert_allclose(pixels, np.tile(colours("low")[0, :3] * PAINT, (16, 1)), rtol=2e-3)
