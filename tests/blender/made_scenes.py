"""Scenes made piece by piece for the tests of reading, each piece one call; needs bpy."""

import bpy
import numpy as np
from detp.detp_addon.reading.read_scene import read_scene


def fresh():
    """An empty scene with a grey world, so that there is light."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    world((0.5, 0.5, 0.5))
    return bpy.context.scene


def linked(name, data, location=(0, 0, 0), scale=(1, 1, 1), collection=None):
    obj = bpy.data.objects.new(name, data)
    (collection or bpy.context.scene.collection).objects.link(obj)
    obj.location, obj.scale = location, scale
    return obj


def mesh(vertices, faces, name="mesh"):
    data = bpy.data.meshes.new(name)
    data.from_pydata(vertices, [], faces)
    return data


def quad(name="quad", size=1.0, **placing):
    """A square in the XY plane with a corner at the origin, facing up."""
    s = size
    return linked(name, mesh([(0, 0, 0), (s, 0, 0), (s, s, 0), (0, s, 0)], [(0, 1, 2, 3)], name), **placing)


def cube(name="cube", **placing):
    """A cube from -1 to 1, flat shaded."""
    vertices = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return linked(name, mesh(vertices, faces, name), **placing)


def with_nodes(owner):
    """The emptied node tree of a material, world or light."""
    if bpy.app.version < ((5, 2) if isinstance(owner, bpy.types.Light) else (5, 0)):
        owner.use_nodes = True
    owner.node_tree.nodes.clear()
    return owner.node_tree


def node(tree, kind, settings=None, **inputs):
    """A node with settings and inputs by identifier, each a value or an output to link."""
    made = tree.nodes.new(kind)
    for name, value in (settings or {}).items():
        setattr(made, name, value)
    for name, value in inputs.items():
        socket = next(s for s in made.inputs if s.identifier == name.replace("_", " ") or s.identifier == name)
        if isinstance(value, bpy.types.NodeSocket):
            tree.links.new(value, socket)
        else:
            socket.default_value = value
    return made


def constant(tree, value):
    """An output with a number or an RGB."""
    made = tree.nodes.new("ShaderNodeRGB" if np.ndim(value) else "ShaderNodeValue")
    made.outputs[0].default_value = (*value, 1) if np.ndim(value) else value
    return made.outputs[0]


def material(build, name="material"):
    """A material whose surface is what ``build(tree)`` returns (a node or an output)."""
    made = bpy.data.materials.new(name)
    tree = with_nodes(made)
    shader = build(tree)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(shader if isinstance(shader, bpy.types.NodeSocket) else shader.outputs[0], output.inputs["Surface"])
    return made


def diffuse(colour, name="diffuse"):
    return material(lambda tree: node(tree, "ShaderNodeBsdfDiffuse", Color=(*colour, 1)), name)


def image(pixels, name="image", colour_space="sRGB", is_float=False):
    """An image from rows (H, W, 4), row 0 at the bottom."""
    pixels = np.asarray(pixels, np.float32)
    made = bpy.data.images.new(name, pixels.shape[1], pixels.shape[0], alpha=True, float_buffer=is_float)
    made.colorspace_settings.name = colour_space
    made.pixels.foreach_set(pixels.ravel())
    return made


def map_to_unit_square(obj):
    """A UV map equal to the X and Y of the vertices."""
    data = obj.data
    layer = data.uv_layers.new(name="UVMap")
    at = np.array([data.vertices[loop.vertex_index].co[:2] for loop in data.loops], np.float32)
    layer.uv.foreach_set("vector", at.ravel())


def world(colour):
    made = bpy.data.worlds.new("world")
    tree = with_nodes(made)
    background = node(tree, "ShaderNodeBackground", Color=(*colour, 1))
    tree.links.new(background.outputs[0], tree.nodes.new("ShaderNodeOutputWorld").inputs["Surface"])
    bpy.context.scene.world = made
    return made


def lamp(kind, name="lamp", location=(0, 0, 0), scale=(1, 1, 1), **settings):
    data = bpy.data.lights.new(name, kind)
    for key, value in settings.items():
        setattr(data, key, value)
    return linked(name, data, location, scale)


def read(targets=None, domain="CORNER"):
    return read_scene(bpy.context.scene, bpy.context.view_layer, targets, domain)


def all_counts():
    """How many data-blocks of each kind there are."""
    kinds = [name for name in dir(bpy.data) if hasattr(getattr(bpy.data, name), "foreach_get")]
    return {name: len(getattr(bpy.data, name)) for name in kinds}
