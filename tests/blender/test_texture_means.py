"""Textures over triangles: the mean over the area that each covers, against the same found texel by texel."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from beside_cycles import emitted  # noqa: E402
from made_scenes import image, linked, material, mesh, node, read  # noqa: E402

pytestmark = pytest.mark.usefixtures("scene")


def clipped(polygon, axis, limit, below):
    """The polygon (n, 2) on one side of a line along an axis."""
    side = (limit - polygon[:, axis]) * (1 if below else -1)
    found = []
    for k in range(len(polygon)):
        here, there = side[k - 1], side[k]
        if here * there < 0:
            found.append(polygon[k - 1] + here / (here - there) * (polygon[k] - polygon[k - 1]))
        if there >= 0:
            found.append(polygon[k])
    return np.array(found).reshape(-1, 2)


def area(polygon):
    x, y = polygon.T
    return 0.5 * abs(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))


def exact_mean(grey, triangle):
    """The mean of ``grey`` (H, W), a repeated picture, over a triangle (3, 2) in texels, each by what is covered."""
    height, width = grey.shape
    total = 0.0
    (left, low), (right, high) = np.floor(triangle.min(axis=0)).astype(int), np.ceil(triangle.max(axis=0)).astype(int)
    for column in range(left, right):
        strip = clipped(clipped(triangle, 0, column, below=False), 0, column + 1, below=True)
        for row in range(low, high) if len(strip) else ():
            part = clipped(clipped(strip, 1, row, below=False), 1, row + 1, below=True)
            if len(part):
                total += area(part) * grey[row % height, column % width]
    return total / area(triangle)


def leaves(size, across):
    """Bright ellipses, ``across`` in a row, on black: their cards' corners are dark."""
    place = (np.mgrid[0:size, 0:size] + 0.5) / size * across
    y, x = place % 1 - 0.5
    cell = np.floor(place).astype(int)
    shade = np.random.default_rng(1).uniform(0.3, 0.9, (across, across))[cell[0], cell[1]]
    return np.where((x / 0.4) ** 2 + (y / 0.2) ** 2 < 1, shade, 0.0)


def read_means(grey, triangles):
    """The albedo (T,) of triangles whose texture coordinates (T, 3, 2) are in texels of ``grey``."""
    pixels = np.ones((*grey.shape, 4))
    pixels[..., :3] = grey[..., None]
    picture = image(pixels, colour_space="Non-Color", is_float=True)
    count = len(triangles)
    vertices = [(x + 2.0 * k, y, 0) for k in range(count) for x, y in ((0, 0), (1, 0), (0, 1))]
    obj = linked("cards", mesh(vertices, [(3 * k, 3 * k + 1, 3 * k + 2) for k in range(count)]))
    layer = obj.data.uv_layers.new(name="UVMap")
    layer.uv.foreach_set("vector", (triangles / grey.shape[::-1]).astype(np.float32).ravel())
    obj.data.materials.append(
        material(lambda tree: node(tree, "ShaderNodeBsdfDiffuse",
                                   Color=node(tree, "ShaderNodeTexImage", {"image": picture}).outputs["Color"]))
    )  # fmt: skip
    scene = read().scene
    order = np.argsort(scene.corners[:, :, 0].min(axis=1))
    return scene.albedo[order, 0]


def cards(size, across, count=200):
    """Triangles around the middles of leaves, of many sizes and directions."""
    generator = np.random.default_rng(2)
    middles = (generator.integers(0, across, (count, 1, 2)) + 0.5) * size / across
    angles = generator.random((count, 1)) * 2 * np.pi + np.array([0.0, 2.1, 4.2])
    radii = generator.uniform(0.15, 0.45, (count, 1, 1)) * size / across
    return middles + radii * np.stack([np.cos(angles), np.sin(angles)], axis=2)


def test_leaf_cards_have_the_mean_of_what_they_show():
    grey = leaves(512, 16)
    triangles = cards(512, 16)
    expected = np.array([exact_mean(grey, triangle) for triangle in triangles])
    ratio = read_means(grey, triangles) / expected
    # A look for each half texel leaves a percent at the leaves' edges, and nothing on the whole.
    assert ratio.std() < 0.01 and abs(ratio.mean() - 1) < 0.003
    assert np.percentile(ratio, 5) > 0.98 and np.percentile(ratio, 95) < 1.02


def test_slivers_and_triangles_smaller_than_a_texel():
    grey = np.random.default_rng(3).uniform(0.1, 0.9, (64, 64))
    thin = np.array([[(10.2, 5.5), (50.4, 5.6), (50.4, 5.5)], [(7.5, 3.1), (7.6, 60.3), (7.5, 60.3)]])
    small = np.array([[(20.2, 30.2), (20.8, 30.2), (20.2, 30.8)], [(41.1, 8.1), (41.9, 8.3), (41.3, 8.9)]])
    means = read_means(grey, np.concatenate([thin, small]))
    assert np.allclose(means[2:], (grey[30, 20], grey[8, 41]), atol=1e-3)
    expected = [exact_mean(grey, triangle) for triangle in thin]
    assert np.allclose(means[:2], expected, rtol=0.05)


def test_triangles_over_many_repetitions_have_the_mean_of_the_picture():
    grey = leaves(64, 2)
    wide = 64 * np.array([[(0.0, 0.0), (40.0, 0.0), (0.0, 40.0)], [(-3.0, 2.0), (9.0, 5.0), (1.0, 17.0)]])
    assert np.allclose(read_means(grey, wide), grey.mean(), rtol=0.02)


def test_an_edge_across_a_triangle_splits_it_exactly():
    """Of a right triangle of side 1, x < t covers 1 - (1 - t)^2."""
    grey = np.zeros((256, 256))
    shares = np.array([0.125, 0.25, 0.5, 0.75])
    grey[:, :128] = 1.0
    starts = 128 - shares * 100
    triangles = np.array([[(x, 10.0), (x + 100, 10.0), (x, 110.0)] for x in starts])
    assert np.allclose(read_means(grey, triangles), 1 - (1 - shares) ** 2, atol=0.005)


@pytest.mark.parametrize("interpolation", ["Linear", "Closest"])
@pytest.mark.parametrize("extension", ["REPEAT", "EXTEND"])
@pytest.mark.parametrize("asked", ["", "Gone"])
def test_without_their_uv_map_images_show_their_corner_as_in_cycles(interpolation, extension, asked):
    pixels = np.ones((4, 4, 4))
    pixels[..., :3] = np.random.default_rng(5).uniform(0.1, 0.9, (4, 4, 3))
    picture = image(pixels, colour_space="Non-Color", is_float=True)
    obj = linked("card", mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)], "bare"))
    settings = {"image": picture, "interpolation": interpolation, "extension": extension}

    def build(tree):
        coordinates = {"Vector": node(tree, "ShaderNodeUVMap", {"uv_map": asked}).outputs[0]} if asked else {}
        colours = node(tree, "ShaderNodeTexImage", settings, **coordinates)
        return node(tree, "ShaderNodeEmission", Color=colours.outputs["Color"])

    obj.data.materials.append(material(build))
    exported = read()
    assert any(("bare: Gone" if asked else "1 mesh (bare)") in warning for warning in exported.warnings)
    assert np.allclose(exported.scene.emission[0], emitted(obj)[0], atol=2e-3)


def checked(build, count=1, tiles=16):
    """What a card of ``count`` squares, each ``tiles`` times a picture of four texels, does by ``build(tree, image)``.

    Of the texels two are whole and bright and two clear and black.
    """
    texels = np.array([[(1, 1, 1, 1), (0, 0, 0, 0)], [(0, 0, 0, 0), (1, 1, 1, 1)]], float)
    picture = image(texels, colour_space="Non-Color")

    def made(tree):
        return build(tree, node(tree, "ShaderNodeTexImage", {"image": picture, "interpolation": "Closest"}))

    vertices = [(x, y, 0.0) for y in (0, 1) for x in range(count + 1)]
    faces = [(k, k + 1, count + k + 2, count + k + 1) for k in range(count)]
    card = linked("card", mesh(vertices, faces))
    places = np.array([np.array(vertices[loop.vertex_index][:2]) * tiles for loop in card.data.loops])
    card.data.uv_layers.new(name="UVMap").uv.foreach_set("vector", places.ravel().astype(np.float32))
    card.data.materials.append(material(made))
    return card


def veiled(tree, share):
    """A black surface that is there by that ``share``."""
    shader, clear = node(tree, "ShaderNodeBsdfDiffuse", Color=(0, 0, 0, 1)), tree.nodes.new("ShaderNodeBsdfTransparent")
    return node(tree, "ShaderNodeMixShader", Fac=share, Shader=clear.outputs[0], Shader_001=shader.outputs[0])


def clipped_alpha(tree, shown):
    return veiled(tree, node(tree, "ShaderNodeMath", {"operation": "GREATER_THAN"}, Value=shown.outputs[1]).outputs[0])


def clipped_as_gltf(tree, shown):
    below = node(tree, "ShaderNodeMath", {"operation": "LESS_THAN"}, Value=shown.outputs[1], Value_001=0.3)
    return veiled(
        tree, node(tree, "ShaderNodeMath", {"operation": "SUBTRACT"}, Value=1.0, Value_001=below.outputs[0]).outputs[0]
    )


def clipped_in_a_group(tree, shown):
    group = bpy.data.node_groups.new("clip", "ShaderNodeTree")
    group.interface.new_socket("Alpha", in_out="INPUT", socket_type="NodeSocketFloat")
    group.interface.new_socket("Share", in_out="OUTPUT", socket_type="NodeSocketFloat")
    ramp = node(group, "ShaderNodeValToRGB", Fac=group.nodes.new("NodeGroupInput").outputs[0])
    ramp.color_ramp.interpolation = "CONSTANT"
    ramp.color_ramp.elements[1].position = 0.9
    group.links.new(ramp.outputs[0], group.nodes.new("NodeGroupOutput").inputs[0])
    used = tree.nodes.new("ShaderNodeGroup")
    used.node_tree = group
    tree.links.new(shown.outputs[1], used.inputs[0])
    return veiled(tree, used.outputs[0])


def clipped_as_a_vector(tree, shown):
    higher = node(tree, "ShaderNodeVectorMath", {"operation": "MULTIPLY"}, Vector=shown.outputs[1])
    higher.inputs[1].default_value = (1.1, 1.1, 1.1)
    return veiled(tree, node(tree, "ShaderNodeVectorMath", {"operation": "FLOOR"}, Vector=higher.outputs[0]).outputs[0])


@pytest.mark.parametrize("build", [clipped_alpha, clipped_as_gltf, clipped_in_a_group, clipped_as_a_vector])
@pytest.mark.parametrize("count, looks", [(1, 64), (2000, 16)])
def test_fences_cut_out_by_a_threshold_let_their_mean_pass(build, count, looks):
    """The mean alpha of a patch of many texels is beyond the threshold, or not; that of the texels is for half."""
    checked(build, count)
    passed = read().scene.transmittance[:, 0]
    assert passed.mean() == pytest.approx(0.5, abs=0.01)
    # As coins fall, so many times on each of 16 patches.
    assert np.abs(passed - 0.5).max() < 4 * 0.5 / np.sqrt(16 * looks)


def test_checkers_are_cut_out_by_a_threshold_check_by_check():
    def build(tree, shown):
        checks = node(tree, "ShaderNodeTexChecker", Scale=64.0, Vector=tree.nodes.new("ShaderNodeUVMap").outputs[0])
        return veiled(
            tree, node(tree, "ShaderNodeMath", {"operation": "GREATER_THAN"}, Value=checks.outputs["Fac"]).outputs[0]
        )

    checked(build)
    assert read().scene.transmittance == pytest.approx(0.5, abs=1e-6)


def test_ramps_and_powers_bend_texels_and_not_their_mean():
    def build(tree, shown):
        squared = node(tree, "ShaderNodeMath", {"operation": "POWER"}, Value=shown.outputs[0], Value_001=3.0)
        return node(tree, "ShaderNodeBsdfDiffuse", Color=squared.outputs[0])

    checked(build)
    # Of 1 024 looks each, as coins fall.
    assert read().scene.albedo[:, 0] == pytest.approx(0.5, abs=4 * 0.5 / 32)


def test_what_texels_become_depends_on_nothing_but_their_triangle():
    first = checked(clipped_alpha, count=30)
    alone = read().scene.transmittance
    other = checked(clipped_alpha, count=20, tiles=7.3)
    # One material, whose triangles are all evaluated together.
    other.data.materials[0] = first.data.materials[0]
    among = read().scene.transmittance
    assert len(alone) == 60 and len(among) == 100
    assert any(np.array_equal(among[k : k + 60], alone) for k in (0, 40))
    assert len(np.unique(among)) > 20


def speckled(clear):
    """Bytes (64, 64, 4) of chance, black and clear in a ``clear`` share."""
    generator = np.random.default_rng(5)
    there = generator.random((64, 64, 1)) >= clear
    return np.concatenate([generator.random((64, 64, 3)) * there, there], axis=2)


@pytest.mark.parametrize("interpolation", ["Linear", "Closest", "Cubic"])
@pytest.mark.parametrize("clear, alpha", [(0.0, False), (0.5, False), (0.5, True)])
@pytest.mark.parametrize("colour_space", ["sRGB", "Non-Color"])
def test_bytes_are_blended_before_they_are_decoded(interpolation, clear, alpha, colour_space):
    """At places all over a picture, and as the mean of a face, it is what Cycles shows there."""
    picture = image(speckled(clear), colour_space=colour_space)

    def build(tree):
        shown = node(tree, "ShaderNodeTexImage", {"image": picture, "interpolation": interpolation})
        glow = node(tree, "ShaderNodeEmission", Color=shown.outputs["Color"]).outputs[0]
        none = tree.nodes.new("ShaderNodeBsdfTransparent").outputs[0]
        cut = {"Shader": none, "Shader_001": glow, "Fac": shown.outputs["Alpha"]}
        return node(tree, "ShaderNodeMixShader", **cut).outputs[0] if alpha else glow

    count = 3000
    places = np.repeat(np.random.default_rng(6).random((count, 1, 2)), 3, axis=1)
    places = np.concatenate([places, [[(0, 0), (1, 0), (1, 1)], [(0, 0), (1, 1), (0, 1)]]])
    corners = [(x + 2.0 * k, y, 0) for k in range(len(places)) for x, y in ((0, 0), (1, 0), (0, 1))]
    obj = linked("faces", mesh(corners, np.arange(len(corners)).reshape(-1, 3).tolist()))
    obj.data.uv_layers.new(name="UVMap").uv.foreach_set("vector", places.astype(np.float32).ravel())
    obj.data.materials.append(material(build))
    ours, theirs = read().scene.emission, emitted(obj)[:count]
    np.testing.assert_allclose(ours[:count], theirs, atol=8e-3)
    # Where alpha and colours go together by chance of 2048 looks.
    noise = theirs.std(axis=0) * np.sqrt(1 / count + 1 / 2048)
    off = (ours[count:].mean(axis=0) - theirs.mean(axis=0)) / noise
    assert (np.abs(off) < 4.0).all(), off


def stored(folder, kind, depth, alpha_mode, packed):
    """An image of one veiled colour from a file of that ``kind`` and ``depth``."""
    drawn = image(np.tile((0.25, 0.12, 0.06, 0.3), (4, 4, 1)), is_float=depth != "8")
    settings = bpy.context.scene.render.image_settings
    settings.file_format, settings.color_mode, settings.color_depth = kind, "RGBA", depth
    path = folder / f"{kind}{depth}"
    drawn.save_render(str(path), scene=bpy.context.scene)
    bpy.data.images.remove(drawn)
    made = bpy.data.images.load(str(path))
    made.alpha_mode = alpha_mode
    if packed:
        made.pack()
    return made


@pytest.mark.parametrize("packed", [False, True])
def test_the_alpha_of_files_counts_as_in_cycles(tmp_path, packed):
    """By the file's format before 5.2 and by the alpha mode since, on colours as they are stored; packed, too."""
    bpy.context.scene.view_settings.view_transform = "Standard"
    cases = [
        (kind, depth, mode, used)
        for kind, depth in (("PNG", "8"), ("PNG", "16"), ("TARGA", "8"), ("OPEN_EXR", "16"))
        for mode in ("STRAIGHT", "PREMUL", "CHANNEL_PACKED", "NONE")
        for used in (False, True)
    ]
    obj = linked("faces", mesh([(2 * k + x, y, 0) for k in range(len(cases)) for x, y in ((0, 0), (1, 0), (0, 1))],
                               np.arange(3 * len(cases)).reshape(-1, 3).tolist()))  # fmt: skip
    obj.data.uv_layers.new(name="UVMap").uv.foreach_set("vector", np.full(6 * len(cases), 0.4, np.float32))
    for number, (kind, depth, mode, used) in enumerate(cases):

        def build(tree, kind=kind, depth=depth, mode=mode, used=used):
            shown = node(tree, "ShaderNodeTexImage", {"image": stored(tmp_path, kind, depth, mode, packed)})
            strength = {"Strength": shown.outputs["Alpha"]} if used else {}
            return node(tree, "ShaderNodeEmission", Color=shown.outputs["Color"], **strength)

        obj.data.materials.append(material(build))
        obj.data.polygons[number].material_index = number
    modes = [each.alpha_mode for each in bpy.data.images]
    ours = read().scene.emission
    assert modes == [each.alpha_mode for each in bpy.data.images]
    theirs = emitted(obj)
    off = np.abs(ours - theirs) > 0.02 * theirs + 2e-3
    assert not off.any(), [case for case, row in zip(cases, off, strict=True) if row.any()]
