"""Makes a large scene: hills, and a forest of trees that are instances of a few, under a sun and a sky.

    python tools/big_scene.py OUT.blend --triangles 10

The hills are a quarter of the triangles, and have all of the points; docs/scale.md has what such scenes take.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import bpy
import numpy as np
from made_objects import one_shader, put, sky, sun

#: Share of the triangles that the hills have; leaves of each kind of tree, of two triangles each; kinds of trees.
HILLS, LEAVES, KINDS = 0.23, 10_000, 3

#: Metres between corners of the hills.
STEP = 0.5


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("output", type=Path)
    parser.add_argument("--triangles", type=float, default=1.0, help="millions in all (default: 1)")
    arguments = parser.parse_args()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    triangles = int(arguments.triangles * 1e6)
    across = max(int(np.sqrt(HILLS * triangles / 2)), 2)
    trees = max(int((1.0 - HILLS) * triangles / (2 * LEAVES)), 1)
    generator = np.random.default_rng(1)
    put("Hills", _hills(across, _material("Ground", (0.35, 0.3, 0.2))))
    leaves = _material("Leaves", (0.15, 0.4, 0.1))
    kinds = [_kind(_tree(f"Tree {number}", generator, leaves)) for number in range(KINDS)]
    for number in range(trees):
        x, y = generator.uniform(0.02, 0.98, 2) * across * STEP
        tree = put(f"Instance {number:04}", None)
        tree.instance_type, tree.instance_collection = "COLLECTION", kinds[number % KINDS]
        tree.location = x, y, _height(np.array(x), np.array(y)) + 3.0
        tree.rotation_euler[2] = generator.uniform(0, 2 * np.pi)
        tree.scale = [generator.uniform(0.7, 1.4)] * 3
    sun(3.0, (0.7, 0.3, 0.0))
    sky((0.3, 0.5, 0.9))
    bpy.ops.wm.save_as_mainfile(filepath=str(arguments.output), compress=False)
    print(f"{2 * across**2 + trees * 2 * LEAVES} triangles, {trees} trees")


def _height(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return 4.0 * np.sin(0.05 * x) * np.cos(0.04 * y) + 0.8 * np.sin(0.31 * x + 0.2 * y)


def _hills(across: int, material: bpy.types.Material) -> bpy.types.Mesh:
    y, x = np.divmod(np.arange((across + 1) ** 2), across + 1) * np.array([[STEP], [STEP]])
    corner = (np.arange(across)[:, None] * (across + 1) + np.arange(across)).ravel()
    quads = corner[:, None] + (0, 1, across + 2, across + 1)
    return _mesh("Hills", np.stack([x, y, _height(x, y)], axis=1), quads, material)


def _tree(name: str, generator: np.random.Generator, material: bpy.types.Material) -> bpy.types.Mesh:
    """Leaves of a hand's width, evenly spread in a crown."""
    ways = generator.normal(size=(LEAVES, 3))
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    places = 2.0 * ways * generator.random((LEAVES, 1)) ** (1 / 3) * (1, 1, 1.4)
    first = np.cross(ways, generator.normal(size=(LEAVES, 3)))
    first *= 0.08 / np.linalg.norm(first, axis=1)[:, None]
    second = np.cross(ways, first)
    leaves = places[:, None] + np.stack([first + second, second - first, -first - second, first - second], axis=1)
    return _mesh(name, leaves.reshape(-1, 3), np.arange(4 * LEAVES).reshape(-1, 4), material)


def _mesh(name: str, vertices: np.ndarray, quads: np.ndarray, material: bpy.types.Material) -> bpy.types.Mesh:
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(vertices))
    mesh.vertices.foreach_set("co", vertices.astype(np.float32).ravel())
    mesh.loops.add(quads.size)
    mesh.loops.foreach_set("vertex_index", quads.astype(np.int32).ravel())
    mesh.polygons.add(len(quads))
    mesh.polygons.foreach_set("loop_start", np.arange(0, quads.size, 4, dtype=np.int32))
    mesh.update(calc_edges=True)
    mesh.materials.append(material)
    return mesh


def _material(name: str, colour: tuple[float, float, float]) -> bpy.types.Material:
    return one_shader(name, "BsdfPrincipled", Base_Color=(*colour, 1.0))


def _kind(mesh: bpy.types.Mesh) -> bpy.types.Collection:
    """A collection of its own, which stands nowhere by itself."""
    made = bpy.data.collections.new(mesh.name)
    made.objects.link(bpy.data.objects.new(mesh.name, mesh))
    return made


if __name__ == "__main__":
    main()
