"""What of a scene is honoured, named and harmless: the tables of docs/scenes.md, made from Blender's lists of types.

    python tools/scene_table.py docs/scenes.md

merges what this version of Blender has into the file: run it with each version that is supported. Nodes are tried: each
output of each node feeds a shining material of its own, and each input of each shader is fed, and a warning of the
reading that names the material tells that it is not honoured. tests/blender/test_every_node.py holds what is called
honoured against Cycles.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from detp.detp_addon import wording
from detp.detp_addon.reading.read_scene import ExportedScene, read_scene
from detp.detp_addon.reading.read_shaders import HARMLESS_INPUTS, NOT_IN_CYCLES
from detp.detp_addon.reading.render_settings import NAMED, decision

#: what is asked to be baked is no shader, groups are looked into, and frames and reroutes hold nothing
WITHOUT_TABLE = ("NodeFrame", "NodeReroute", "NodeGroupInput", "NodeGroupOutput", "ShaderNodeGroup", "ShaderNodeScript")

HONOURED, NAMED_WORD, HARMLESS = "honoured", "named", "harmless"


def emptied(owner) -> bpy.types.NodeTree:
    """The node tree of a material, world or light, without nodes."""
    if bpy.app.version < ((5, 2) if isinstance(owner, bpy.types.Light) else (5, 0)):
        owner.use_nodes = True
    owner.node_tree.nodes.clear()
    return owner.node_tree


def node_types() -> list[str]:
    """The types of all nodes that a material's tree may hold, but for those that only arrange others."""
    scratch = bpy.data.materials.new("scratch")
    tree, found = emptied(scratch), []
    for name in sorted(dir(bpy.types)):
        kind = getattr(bpy.types, name)
        if name in WITHOUT_TABLE or not (isinstance(kind, type) and issubclass(kind, bpy.types.Node)):
            continue
        # Nodes of other kinds of trees are refused on the console, too, so only likely ones are asked for.
        if not name.startswith(("ShaderNode", "FunctionNode", "Node", "GeometryNodeMenu", "GeometryNodeInputScene")):
            continue
        try:
            tree.nodes.new(name)
        except RuntimeError:
            continue
        found.append(name)
    bpy.data.materials.remove(scratch)
    return found


def shining(tree, build: Callable) -> bpy.types.NodeSocket:
    """A shader that gives off what ``build(tree)`` returns."""
    emission = tree.nodes.new("ShaderNodeEmission")
    emission.inputs["Strength"].default_value = 1.0
    tree.links.new(build(tree), emission.inputs["Color"])
    return emission.outputs[0]


def new_file() -> None:
    """An empty one, in place of what is open."""
    bpy.ops.wm.read_factory_settings(use_empty=True)


@dataclass(frozen=True)
class Zoo:
    """One mesh, ``obj``, with a triangle for each of some shaders."""

    obj: bpy.types.Object

    @classmethod
    def of(cls, shaders: list[Callable]) -> Zoo:
        """Of the materials whose surface ``shader(tree)`` returns; in a new file."""
        new_file()
        generator, count = np.random.default_rng(3), len(shaders)
        side = int(np.ceil(np.sqrt(count)))
        column, row = np.arange(count) % side, np.arange(count) // side
        corners = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0)]) + 1.5 * np.stack([column, row, 0 * row], 1)[:, None]
        corners[..., 2] += 0.3 * generator.random((count, 3))
        mesh = bpy.data.meshes.new("zoo")
        mesh.from_pydata(corners.reshape(-1, 3).tolist(), [], np.arange(3 * count).reshape(-1, 3).tolist())
        obj = bpy.data.objects.new("zoo", mesh)
        bpy.context.scene.collection.objects.link(obj)
        obj.location, obj.rotation_euler, obj.scale = (0.3, -0.2, 0.5), (0.3, 0.2, 0.5), (1, 1.3, 0.7)
        obj.color, obj.pass_index = (0.2, 0.4, 0.6, 0.8), 3
        mesh.uv_layers.new(name="UVMap").uv.foreach_set("vector", generator.random(6 * count).astype(np.float32))
        paint = mesh.color_attributes.new("Col", "FLOAT_COLOR", "CORNER")
        paint.data.foreach_set("color", generator.random(12 * count).astype(np.float32))
        for number, shader in enumerate(shaders):
            material = bpy.data.materials.new(f"material {number}")
            tree = emptied(material)
            tree.links.new(shader(tree), tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
            material.pass_index = 2
            mesh.materials.append(material)
            mesh.polygons[number].use_smooth, mesh.polygons[number].material_index = True, number
        return cls(obj)

    def read(self) -> tuple[ExportedScene, list[str]]:
        """The scene as the bake reads it, and for each triangle what was said of its material."""
        shown, wording.SHOWN_NAMES = wording.SHOWN_NAMES, 1 << 20
        try:
            result = read_scene(bpy.context.scene, bpy.context.view_layer, None, "CORNER")
        finally:
            wording.SHOWN_NAMES = shown
        said = [""] * len(self.obj.data.polygons)
        # That faces are too large for a pattern says nothing of the node that makes it.
        told = [sentence for sentence in (*result.warnings, *result.left_out) if "patterns on large" not in sentence]
        for sentence in told:
            words, _, names = sentence.partition(" (material ") if "(material " in sentence else (sentence, "", "")
            for name in names.partition(")")[0].split(", "):
                number = name.removeprefix("material ")
                if number.isdigit():
                    said[int(number)] += words + ". "
        return result, said


def odd_inputs(node, seed: int = 0) -> None:
    """Give the inputs of ``node`` values that none of them has by itself."""
    generator = np.random.default_rng(seed + len(node.bl_idname))
    for socket in node.inputs:
        if socket.type == "VALUE":
            socket.default_value = float(generator.uniform(0.2, 0.8))
        elif socket.type == "RGBA":
            socket.default_value = (*generator.uniform(0.2, 0.8, 3), 1)
        elif socket.type == "VECTOR" and not socket.hide_value:
            dimensions = len(socket.default_value)
            socket.default_value = tuple(generator.uniform(0.2, 0.8, dimensions))


def outputs() -> dict[tuple[str, str], Callable]:
    """(type of node, output) -> a shader that shows it, for all outputs that are colours, numbers or vectors."""
    scratch, found = emptied(bpy.data.materials.new("scratch")), {}
    for kind in node_types():
        for output in scratch.nodes.new(kind).outputs:
            if output.type in ("VALUE", "RGBA", "VECTOR", "INT", "BOOLEAN"):
                found[kind, output.identifier] = _shows(kind, output.identifier)
    return found


#: settings of nodes that choose which outputs there are
_KINDS_OF_OUTPUTS = {
    "data_type": ("RGBA", "FLOAT_VECTOR", "VECTOR", "ROTATION"),
    "operation": ("DOT_PRODUCT",),
    "voronoi_dimensions": ("4D", "1D"),
    "feature": ("N_SPHERE_RADIUS",),
}


def _shows(kind: str, identifier: str) -> Callable:
    def build(tree):
        node = tree.nodes.new(kind)
        wanted = next(output for output in node.outputs if output.identifier == identifier)
        for name, choices in _KINDS_OF_OUTPUTS.items():
            for choice in choices if hasattr(node, name) and not wanted.enabled else ():
                with suppress(TypeError):
                    setattr(node, name, choice)
                if wanted.enabled:
                    break
        odd_inputs(node)
        if kind == "ShaderNodeAttribute":
            node.attribute_name = "Col"
        return next(output for output in node.outputs if output.identifier == identifier)

    return lambda tree: shining(tree, build)


def output_table() -> dict[str, dict[str, list[str]]]:
    """Label of each node -> decision -> names of its outputs."""
    wanted = outputs()
    zoo = Zoo.of(list(wanted.values()))
    _, said = zoo.read()
    table: dict[str, dict[str, list[str]]] = {}
    for (kind, identifier), words in zip(wanted, said, strict=True):
        row = table.setdefault(label(kind), {HONOURED: [], NAMED_WORD: []})
        row[NAMED_WORD if words else HONOURED].append(identifier)
    return table


def label(kind: str) -> str:
    """A node's name for people."""
    return getattr(bpy.types, kind).bl_rna.name


def shaders() -> Iterator[tuple[str, list[str]]]:
    """The nodes with a shader as output, but for volumes, with their inputs."""
    scratch = emptied(bpy.data.materials.new("scratch"))
    for kind in node_types():
        node = scratch.nodes.new(kind)
        if any(output.type == "SHADER" for output in node.outputs) and "Volume" not in kind:
            yield kind, [socket.identifier for socket in node.inputs if socket.enabled and not socket.is_unavailable]


def shader_table() -> dict[str, dict[str, list[str]]]:
    """Label of each shader -> decision -> its inputs; those on which nothing was decided count as "?"."""
    found: dict[tuple[str, str], str] = {}
    known = list(shaders())
    for weighty in (False, True):
        builds, keys = [], []
        for kind, inputs in known:
            for fed in (None, *inputs):
                builds.append(_fed(kind, fed, weighty))
                keys.append((kind, fed))
        result, said = Zoo.of(builds).read()
        responses = _responses(result)
        base = {kind: number for number, (kind, fed) in enumerate(keys) if fed is None}
        for number, (kind, fed) in enumerate(keys):
            if fed is None or found.get((kind, fed)) == HONOURED:
                continue
            if kind != "ShaderNodeBsdfPrincipled" and said[base[kind]]:
                # The whole shader is named.
                found[kind, fed] = NAMED_WORD
            if "plain value" not in said[number] and not np.allclose(responses[number], responses[base[kind]]):
                found[kind, fed] = HONOURED
            elif said[number] != said[base[kind]]:
                found[kind, fed] = NAMED_WORD
    table = {}
    for kind, inputs in known:
        row = table[label(kind)] = {HONOURED: [], NAMED_WORD: [], HARMLESS: [], "?": []}
        for fed in inputs:
            harmless = HARMLESS if fed in HARMLESS_INPUTS or kind in NOT_IN_CYCLES else "?"
            row[found.get((kind, fed), harmless)].append(fed)
    return table


#: values of inputs, such that all parts of a shader count
_SHARES = {"Metallic": 0.3, "Emission Strength": 0.3, "Specular IOR Level": 0.0}


def _fed(kind: str, fed: str | None, weighty: bool) -> Callable:
    """A shader whose input ``fed`` is linked to a number or a shader; ``weighty``: all its parts have a share."""

    def shader(tree):
        node = tree.nodes.new(kind)
        if weighty:
            for socket in node.inputs:
                if socket.type == "VALUE" and ("Weight" in socket.name or socket.name in _SHARES):
                    socket.default_value = _SHARES.get(socket.name, 0.3)
                elif socket.type == "SHADER":
                    part = "Emission" if socket.identifier == "Shader" else "BsdfTransparent"
                    tree.links.new(tree.nodes.new(f"ShaderNode{part}").outputs[0], socket)
        for socket in node.inputs:
            if socket.identifier != fed:
                continue
            if socket.type == "SHADER":
                source = tree.nodes.new("ShaderNodeBsdfDiffuse").outputs[0]
            else:
                source = tree.nodes.new("ShaderNodeValue").outputs[0]
                source.default_value = 1.0 if socket.type == "BOOLEAN" else 0.37
            tree.links.new(source, socket)
        return next(output for output in node.outputs if output.type == "SHADER")

    return shader


def _responses(result: ExportedScene) -> np.ndarray:
    """All that is known of what each triangle does to light, one row each."""
    scene = result.scene
    unshaded = scene.transmittance if scene.unshaded is None else scene.unshaded
    spread = np.zeros_like(scene.albedo) if scene.translucency is None else scene.translucency
    arrays = (scene.albedo, scene.emission, scene.transmittance, unshaded, spread)
    both = [np.broadcast_to(array, (2, *array.shape[-2:])) for array in arrays]
    columns = [side for array in both for side in array]
    specular = np.zeros((len(scene.triangles), 11))
    if scene.specular is not None:
        held = scene.specular
        specular[held.triangles] = np.column_stack([held.mirror, held.gloss, held.clear, held.ior, held.roughness])
    return np.column_stack([*columns, specular])


def settings() -> dict[str, list[str]]:
    """Kind of settings -> the properties that this Blender has of them."""
    scene, data = bpy.context.scene, bpy.data
    data.materials.new("scratch")
    obj = data.objects.new("scratch", data.meshes.new("scratch"))
    scene.collection.objects.link(obj)
    world = scene.world = scene.world or data.worlds.new("scratch")
    lamps = {kind: data.lights.new("scratch", kind) for kind in ("POINT", "SPOT", "SUN", "AREA")}
    made = {
        "scene": scene.cycles, "object": obj.cycles, "light": lamps["AREA"].cycles, "world": world.cycles,
        "world in mirrors": world.cycles_visibility, "view layer": scene.view_layers[0],
        "collection": scene.view_layers[0].layer_collection, "light linking": obj.light_linking,
        "material": data.materials["scratch"].cycles, "material data": data.materials["scratch"], "world data": world,
    }  # fmt: skip
    walk = {kind: list(owner.bl_rna.properties.keys()) for kind, owner in made.items()}
    walk["lamp"] = sorted({name for lamp in lamps.values() for name in lamp.bl_rna.properties.keys()})
    of_objects = ("visible_", "is_holdout", "is_shadow_catcher", "hide_render", "pass_index", "color")
    walk["visibility"] = [name for name in obj.bl_rna.properties.keys() if name.startswith(of_objects)]
    common = set(bpy.types.ShaderNode.bl_rna.properties.keys())
    shading = [kind for kind in node_types() if kind.startswith("ShaderNode")]
    walk["node"] = sorted({name for kind in shading for name in _properties(kind)} - common)
    known = {"rna_type", "name", "animation_data", "cycles", "cycles_visibility"}
    ids = known | set(bpy.types.ID.bl_rna.properties.keys())
    return {kind: [name for name in names if name not in ids] for kind, names in walk.items()}


def _properties(kind: str) -> list[str]:
    return getattr(bpy.types, kind).bl_rna.properties.keys()


def settings_table() -> dict[str, dict[str, list[str]]]:
    """Kind of settings -> decision -> properties; those on which nothing was decided count as "?"."""
    table = {}
    for kind, names in settings().items():
        row = table[kind] = {HONOURED: [], NAMED_WORD: [], HARMLESS: [], "?": []}
        for name in names:
            in_mirrors = kind == "visibility" and name in NAMED["visibility in mirrors"]
            row[NAMED_WORD if in_mirrors else decision(kind, name) or "?"].append(name)
    return table


#: heading in the file -> (what its rows are called, the table, decisions)
TABLES = {
    "Outputs of nodes": ("node", output_table, (HONOURED, NAMED_WORD)),
    "Inputs of shaders": ("shader", shader_table, (HONOURED, NAMED_WORD, HARMLESS)),
    "Settings": ("settings of", settings_table, (HONOURED, NAMED_WORD, HARMLESS)),
}


def parsed(text: str, heading: str) -> dict[str, dict[str, list[str]]]:
    """The rows of the table below a ``heading`` of the file."""
    section = text.partition(f"## {heading}\n")[2].partition("\n## ")[0]
    rows = [line.strip("|").split("|") for line in section.splitlines() if line.startswith("|")]
    decisions = [cell.strip() for cell in rows[0]][1:] if rows else []
    table = {}
    for name, *cells in rows[2:]:
        lists = [[word for word in cell.strip().split(", ") if word] for cell in cells]
        table[name.strip()] = dict(zip(decisions, lists, strict=True))
    return table


def merged(text: str) -> str:
    """The file's ``text`` with what this version of Blender has."""
    for heading, (title, make, decisions) in TABLES.items():
        table = parsed(text, heading)
        for name, row in make().items():
            held = table.setdefault(name, {})
            for kind in decisions:
                here = set(row[kind])
                others = {other for one in decisions if one != kind for other in row[one]}
                held[kind] = sorted((set(held.get(kind, ())) - others) | here)
        lines = [f"| {title} | {' | '.join(decisions)} |", "| --- " * (len(decisions) + 1) + "|"]
        lines += [
            f"| {name} | {' | '.join(', '.join(table[name].get(kind, ())) for kind in decisions)} |"
            for name in sorted(table)
        ]
        before, mark, after = text.partition(f"## {heading}\n")
        kept, _, rest = after.partition("\n## ")
        words = "\n".join(line for line in kept.splitlines() if not line.startswith("|")).strip("\n")
        text = f"{before}{mark}{words}\n\n" + "\n".join(lines) + "\n" + (f"\n## {rest}" if rest else "")
    return text


if __name__ == "__main__":
    path = Path(sys.argv[1])
    path.write_text(merged(path.read_text()))
