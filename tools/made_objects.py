"""Objects, materials of one shader, skies and suns for the scenes that tools make in Blender."""

import bpy


def put(name: str, data) -> bpy.types.Object:
    """An object of that ``data``, None for an empty one, in the scene."""
    made = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(made)
    return made


def mesh_object(name: str, corners, faces, material: bpy.types.Material) -> bpy.types.Object:
    """A mesh object of these ``corners`` (V, 3) and ``faces``, rows of them."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([tuple(map(float, corner)) for corner in corners], [], [tuple(face) for face in faces])
    mesh.materials.append(material)
    return put(name, mesh)


def one_shader(name: str, shader: str, **inputs) -> bpy.types.Material:
    """A material of one node of the kind ``shader``, with those values of its ``inputs``, _ for a space."""
    made = bpy.data.materials.new(name)
    _shaded(made, f"ShaderNode{shader}", "ShaderNodeOutputMaterial", inputs)
    return made


def diffuse(name: str, colour: tuple[float, float, float]) -> bpy.types.Material:
    """A material that reflects evenly."""
    return one_shader(name, "BsdfDiffuse", Color=(*colour, 1.0))


def sky(colour: tuple[float, float, float]) -> None:
    """Let the scene's world be of one colour."""
    bpy.context.scene.world = bpy.data.worlds.new("Sky")
    _shaded(bpy.context.scene.world, "ShaderNodeBackground", "ShaderNodeOutputWorld", {"Color": (*colour, 1.0)})


def sun(energy: float, rotation: tuple[float, float, float]) -> None:
    """A sun of ``energy`` W/m^2, 0.01 rad wide, that shines down where its ``rotation`` in radians is zero."""
    made = put("Sun", bpy.data.lights.new("Sun", "SUN"))
    made.data.energy, made.data.angle, made.rotation_euler = energy, 0.01, rotation


def _shaded(owner: bpy.types.Material | bpy.types.World, shader: str, output: str, inputs: dict) -> None:
    if bpy.app.version < (5, 0):
        owner.use_nodes = True
    nodes = owner.node_tree.nodes
    nodes.clear()
    node = nodes.new(shader)
    for name, value in inputs.items():
        node.inputs[name.replace("_", " ")].default_value = value
    owner.node_tree.links.new(node.outputs[0], nodes.new(output).inputs["Surface"])
