"""Update: the light of a bake of the changed scene, the first light where nothing changed, and a sentence where only a
whole bake will do."""

import bpy
import numpy as np
import pytest
from detp.core.errors import OutOfMemoryError
from detp.detp_addon.job import bake_scene
from detp.detp_addon.panel import session
from detp.detp_addon.reading.kept_places import KeptPlaces
from detp.detp_addon.reading.read_scene import read_scene
from detp.detp_addon.reading.recalled import Recollection
from detp.detp_addon.updates import kept_bake
from detp.detp_addon.updates.latest_kept import kept_of
from made_scenes import image, material, node
from scipy import stats
from small_scenes import colours, cube, grid, lamp, painted

BAKES = 3
NAMES, PLACE = ("Floor", "Wall", "Box"), (0.5, 0.5, 0.25)


@pytest.fixture(autouse=True)
def scene(addon):
    """A red box before a wall on a floor, in a light from above."""
    grid("Floor")
    wall = grid("Wall", (0, 2, 2))
    wall.rotation_euler.x = np.pi / 2
    painted(cube("Box", PLACE, 0.5), (0.8, 0.2, 0.1))
    lamp((-1, -0.5, 2.5))
    return bpy.context.scene


def bake(**options):
    assert bpy.ops.detp.bake(**{"quality": "DRAFT", "keep": True, **options}) == {"FINISHED"}


def update():
    assert bpy.ops.detp.update() == {"FINISHED"}
    return session.latest().outcome.report


def light(names=NAMES, attribute="irradiance"):
    return np.concatenate([colours(name, attribute)[:, :3] for name in names])


def move(to=(0.0, 0.9, 0.5)):
    bpy.data.objects["Box"].location = to


def turn_to_glass(name):
    materials = bpy.data.objects[name].data.materials
    materials.clear()
    materials.append(material(lambda tree: node(tree, "ShaderNodeBsdfGlass")))


def kept():
    return kept_of(bpy.context.scene, bpy.context.view_layer)


def test_an_update_finds_the_light_of_a_whole_bake_and_the_old_light_is_another():
    old, updated, whole = [], [], []
    for seed in range(BAKES):
        bake(seed=seed)
        old.append(light())
        move()
        report = update()
        assert report.updated and report.headline().startswith("Updated 3 objects")
        updated.append(light())
        bake(seed=100 + seed, keep=False)
        whole.append(light())
        move(PLACE)
    old, updated, whole = (np.array(part).sum(axis=2) for part in (old, updated, whole))
    scale = whole.mean(axis=0)
    seen = scale > 0.05 * np.median(scale)
    # Points of one bake share photons and records, so that only bakes are independent.
    off = ((updated - whole) / scale)[:, seen]
    assert stats.ttest_1samp(off.mean(axis=1), 0.0).pvalue > 0.002
    noise = np.sqrt((whole.var(axis=0, ddof=1) + updated.var(axis=0, ddof=1))[seen] / BAKES)
    noise = np.hypot(noise, 0.01 * scale[seen])

    def score(other):
        return np.sqrt(np.mean(((other.mean(axis=0) - whole.mean(axis=0))[seen] / noise) ** 2))

    assert score(updated) < 2.0 < 5.0 < score(old)


def test_where_nothing_changed_and_where_all_is_back_the_light_is_the_first_bit_for_bit():
    bake()
    first = light()
    assert update().updated
    assert np.array_equal(light(), first)
    move()
    update()
    assert not np.array_equal(light(), first)
    move(PLACE)
    cube("Another", (-1, -1, 0.2), 0.4)
    update()
    assert light(("Another",)).any() and not np.array_equal(light(), first)
    bpy.data.objects.remove(bpy.data.objects["Another"])
    move(PLACE)
    bpy.ops.detp.use_in_material()
    update()
    assert np.array_equal(light(), first)


def test_points_of_other_objects_stay_where_they_are(scene):
    before = read(scene)
    places = KeptPlaces.of([(target.object_name, target.library) for target in before.targets], before.shown)
    move()
    cube("Aardvark", (-1, -1, 0.2), 0.4)
    bpy.data.objects.remove(bpy.data.objects["Wall"])
    after = read(scene, places)
    for name, same in (("Floor", True), ("Box", False)):
        first, second = (of(export, name, export.centres) for export in (before, after))
        assert np.array_equal(first, second) == same
        # What moved looks from the same parts of its faces.
        assert np.array_equal(*(of(export, name, export.shown.places.weights) for export in (before, after)))
    fresh, whole = of(after, "Aardvark", after.shown.places.area), bpy.data.objects["Aardvark"].data
    # Half of its places are one for each value, the others as dense as elsewhere: few, for so small a thing.
    assert 24 <= len(fresh) < 24 + 2.0 * places.density * sum(face.area for face in whole.polygons)


def paint_picture(picture, left, right):
    """Two halves of one colour each, on an image that is there already."""
    height, width = picture.size[1], picture.size[0]
    pixels = np.tile(np.array([*left, 1.0], np.float32), (height, width, 1))
    pixels[:, width // 2 :, :3] = right
    picture.pixels.foreach_set(pixels.ravel())


RED_BLUE, GREEN_WHITE = ((0.9, 0.1, 0.1), (0.1, 0.1, 0.9)), ((0.1, 0.9, 0.1), (0.9, 0.9, 0.9))


@pytest.mark.parametrize("how", ["pixels", "colour space", "coordinates", "extension"])
def test_what_images_show_is_recalled_only_where_all_of_it_is_the_same(how):
    floor, picture = bpy.data.objects["Floor"].data, image(np.ones((8, 8, 4)))

    def shaded(tree):
        texture = node(tree, "ShaderNodeTexImage", {"image": picture, "name": "Texture"})
        return node(tree, "ShaderNodeBsdfDiffuse", Color=texture.outputs["Color"])

    floor.materials.append(material(shaded))
    texture = floor.materials[0].node_tree.nodes["Texture"]
    layer = floor.uv_layers[0].data
    places = np.empty(2 * len(layer), np.float32)
    layer.foreach_get("uv", places)

    def change(there):
        picture.colorspace_settings.name = "Non-Color" if there and how == "colour space" else "sRGB"
        # An image that was only painted loses that with its colour space.
        paint_picture(picture, *(GREEN_WHITE if there and how == "pixels" else RED_BLUE))
        texture.extension = "CLIP" if there and how == "extension" else "REPEAT"
        scale = 0.4 if there and how == "coordinates" else 1.5
        floor.uv_layers[0].data.foreach_set("uv", scale * places)

    def albedo():
        return read(bpy.context.scene).scene.albedo

    change(False)
    bake()
    first, before = light(), albedo()
    assert update().updated and np.array_equal(light(), first)
    change(True)
    with kept().recollection.used():
        recalled = albedo()
    assert np.array_equal(recalled, albedo()) and not np.array_equal(recalled, before)
    update()
    assert not np.array_equal(light(), first)
    change(False)
    update()
    assert np.array_equal(light(), first)


def bend():
    bpy.data.objects["Box"].data.vertices[0].co.x -= 0.2


def shade_smooth():
    faces = bpy.data.objects["Box"].data.polygons
    faces.foreach_set("use_smooth", np.ones(len(faces), bool))


def turn_faces():
    bpy.data.objects["Box"].data.flip_normals()


@pytest.mark.parametrize(
    "change", [move, bend, shade_smooth, turn_faces, lambda: bpy.data.objects["Box"].modifiers.new("", "BEVEL")]
)
def test_what_is_recalled_of_objects_is_what_reading_anew_finds(scene, change):
    recollection = Recollection()
    with recollection.used():
        before = read(scene)
    change()
    with recollection.used():
        recalled = read(scene)
    anew = read(scene)
    first, second, third = ((e.centres, e.normals, e.facing, e.shown.faces.normals) for e in (before, recalled, anew))
    assert all(map(np.array_equal, second, third))
    assert not all(map(np.array_equal, first, third))


def read(scene, kept=None):
    return read_scene(scene, bpy.context.view_layer, None, "CORNER", (), "faces", None, kept)


def of(export, name, values):
    """Those of an object among ``values`` (K, ...) at places."""
    number = [target.object_name for target in export.targets].index(name)
    return values[export.shown.owners[export.shown.places.triangle] == number]


def test_undo_takes_an_update_back_and_the_next_one_finds_what_is_there():
    bake()
    first = light()
    bpy.ops.ed.undo_push(message="bake")
    move()
    bpy.ops.ed.undo_push(message="move")
    update()
    bpy.ops.ed.undo_push(message="update")
    bpy.ops.ed.undo()
    assert np.array_equal(light(), first) and bpy.data.objects["Box"].location.z == 0.5
    bpy.ops.ed.undo()
    assert update().updated
    assert np.array_equal(light(), first)


def test_a_cancelled_update_leaves_all_as_it_was(scene):
    bake()
    first, whole = light(), kept()
    move()
    steps = bake_scene(scene, bpy.context.view_layer, whole.request(scene), kept=whole)
    running = session.begin(steps)
    for _ in range(5):
        running.step(0.0)
    assert bpy.ops.detp.cancel() == {"FINISHED"}
    assert np.array_equal(light(), first)
    move(PLACE)
    assert update().updated and kept() is whole
    assert np.array_equal(light(), first)


def test_without_a_kept_bake_the_update_is_one_and_keeps_it(scene):
    scene.detp.quality = "DRAFT"
    assert not update().updated
    assert update().updated
    bake(keep=False)
    assert kept() is None
    bake()
    assert kept() is not None
    bpy.ops.wm.read_factory_settings(use_empty=True)
    assert kept() is None


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (lambda: lamp((1, -1, 2)), "lights have changed"),
        (lambda: move((9.0, 0.0, 0.0)), "left the box"),
        (lambda: turn_to_glass("Box"), "glass"),
        (lambda: setattr(bpy.data.objects["Floor"], "location", (0.0, 0.0, 0.2)), "take as long as a bake"),
    ],
)
def test_what_cannot_be_updated_is_baked_as_a_whole_and_that_is_said(change, why):
    bake()
    change()
    report = update()
    assert not report.updated and report.headline().startswith("Baked")
    assert why in report.warnings[0] and report.warnings[0].endswith(".")
    # Unless it never can be, the new bake is updated from now on.
    assert (kept() is not None) == (why != "glass")


def test_where_memory_runs_short_what_is_recalled_goes_first_and_then_the_kept_bake(monkeypatch):
    bake()
    short = [True]

    def check(*_sizes):
        if short:
            raise OutOfMemoryError(f"short {short.pop()}")

    monkeypatch.setattr(kept_bake, "check_baking", check)
    assert update().updated and not short
    short += [True, True]
    report = update()
    assert not report.updated and "memory ran short" in report.warnings[0] and not short
    short += [True, True, True]
    with pytest.raises(RuntimeError, match="short"):
        bpy.ops.detp.update()


def test_bakes_that_no_update_suits_say_so():
    bake(quantity="AMBIENT_OCCLUSION")
    warnings = session.latest().outcome.report.warnings
    assert kept() is None and any("cannot be updated" in warning for warning in warnings)


def test_the_objects_and_settings_are_those_of_the_bake(scene):
    for obj in scene.objects:
        obj.select_set(obj.name == "Floor")
    bake(targets="SELECTED", attribute="Light", by_light=True, split=True)
    before = set(bpy.data.objects["Floor"].data.attributes.keys())
    for obj in scene.objects:
        obj.select_set(obj.name == "Wall")
    scene.detp.attribute = "Other"
    move()
    assert update().updated
    assert set(bpy.data.objects["Floor"].data.attributes.keys()) == before
    assert "Light" not in bpy.data.objects["Wall"].data.attributes


def test_only_the_light_groups_that_changed_are_baked_anew(scene):
    lamp((1, -1, 2), 30.0)
    bake(by_light=True)
    first = light(attribute="irradiance:Lamp")
    bpy.data.objects["Lamp.001"].location.x -= 0.5
    report = update()
    anew = [warning for warning in report.warnings if "anew" in warning]
    assert not report.updated and len(anew) == 1 and anew[0].startswith("The light of 'Lamp.001' was baked anew")
    # What is dark in all light counts less in the fit, so that one group's light is not quite its own.
    assert light(attribute="irradiance:Lamp") == pytest.approx(first, rel=1e-3)
    bpy.data.lights["Lamp"].energy *= 0.5
    assert update().updated
    assert light(attribute="irradiance:Lamp") == pytest.approx(0.5 * first, rel=1e-3)


def test_light_groups_that_are_new_are_named(scene):
    lamp((1, -1, 2), 30.0)
    bake(by_light=True)
    lamp((0, -1, 2), 10.0)
    report = update()
    assert not report.updated
    assert [warning for warning in report.warnings if "anew" in warning] == [
        "The light of 'Lamp.002' was baked anew, since it was not kept before."
    ]
    assert update().updated


def test_a_mixture_of_light_groups_stays(scene):
    bake(by_light=True)
    scene.detp_mix.lights["Lamp"].strength = 2.0
    mixed = light()
    assert update().updated
    assert np.array_equal(light(), mixed) and scene.detp_mix.lights["Lamp"].strength == 2.0
