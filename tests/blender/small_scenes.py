"""Pieces of small scenes, and a look at the files that bakes leave."""

import bpy
from detp.detp_addon.writing.baked_layers import stored_colours


def grid(name, location=(0, 0, 0), size=4.0):
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=3, y_subdivisions=3, size=size, location=location)
    obj = bpy.context.object
    obj.name = obj.data.name = name
    return obj


def cube(name, location=(0, 0, 0.5), size=1.0):
    bpy.ops.mesh.primitive_cube_add(size=size, location=location)
    obj = bpy.context.object
    obj.name = obj.data.name = name
    return obj


def painted(obj, rgb):
    material = bpy.data.materials.new("paint")
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    shader = nodes.new("ShaderNodeBsdfDiffuse")
    shader.inputs["Color"].default_value = (*rgb, 1)
    material.node_tree.links.new(shader.outputs[0], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    obj.data.materials.append(material)


def lamp(location=(1, 0.5, 3), power=100.0):
    light = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    light.data.energy, light.location = power, location
    bpy.context.collection.objects.link(light)


def box_on_floor():
    """Nothing but a box on a floor under a lamp."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    grid("Floor")
    cube("Box")
    lamp()


def saved(path, compress=False):
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=compress, copy=True)
    return path


def opened(path):
    bpy.ops.wm.open_mainfile(filepath=str(path), use_scripts=False)


def colours(name, attribute="irradiance"):
    """The RGBA (elements, 4) of an object's layer."""
    return stored_colours(bpy.data.objects[name].data.attributes[attribute])
