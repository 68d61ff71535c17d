"""Geometry node trees that instance, empty, turn around or lose the mesh they are given."""

from __future__ import annotations

import bpy
from fuzz.chance import REFUSALS, Chance, put


def geometry_tree(chance: Chance) -> bpy.types.NodeTree | None:
    """A tree for a Nodes modifier, or none."""
    if chance.likely(0.1):
        return None
    tree = bpy.data.node_groups.new("geometry", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    given, result = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    end = given.outputs[0]
    for _ in range(chance.count(0, 3)):
        end = _step(chance, tree, end)
    if chance.likely(0.95):
        tree.links.new(end, result.inputs[0])
    return tree


def _step(chance: Chance, tree, source):
    kind = chance.one_of(*STEPS)
    try:
        node = tree.nodes.new(f"GeometryNode{kind}")
    except REFUSALS:
        return source
    geometry = [socket for socket in node.inputs if socket.type == "GEOMETRY"]
    for socket in geometry if kind == "JoinGeometry" else geometry[:1]:
        tree.links.new(source, socket)
    for socket in node.inputs:
        if socket.type in ("VALUE", "VECTOR") and hasattr(socket, "default_value") and chance.likely(0.3):
            values = chance.numbers(3 if socket.type == "VECTOR" else 1, 0, 2)
            put(socket, "default_value", values if socket.type == "VECTOR" else values[0])
    if kind == "InstanceOnPoints":
        shape = tree.nodes.new(f"GeometryNode{chance.one_of('MeshCube', 'MeshIcoSphere', 'CurvePrimitiveCircle')}")
        tree.links.new(shape.outputs[0], node.inputs["Instance"])
    if kind == "SetMaterial" and len(bpy.data.materials):
        node.inputs["Material"].default_value = chance.one_of(*bpy.data.materials)
    if kind == "ObjectInfo":
        node.inputs["Object"].default_value = chance.one_of(None, *bpy.data.objects)
    if kind == "CollectionInfo":
        node.inputs["Collection"].default_value = chance.one_of(None, *bpy.data.collections)
    outputs = [socket for socket in node.outputs if socket.type == "GEOMETRY"]
    return outputs[0] if outputs else source


STEPS = (
    *("InstanceOnPoints", "InstanceOnPoints", "RealizeInstances", "JoinGeometry", "Transform", "SetMaterial"),
    *("MeshToPoints", "DeleteGeometry", "SetPosition", "DualMesh", "ConvexHull", "ExtrudeMesh", "FlipFaces"),
    *("MeshToCurve", "ObjectInfo", "CollectionInfo", "SplitEdges", "MeshCube", "Bake", "Viewer", "SetShadeSmooth"),
    *("ScaleElements", "Triangulate", "GeometryToInstance", "MergeByDistance", "RemoveAttribute"),
)
