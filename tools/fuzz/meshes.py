"""Meshes with everything that can be wrong with them."""

from __future__ import annotations

import math

import bpy
import numpy as np
from fuzz.chance import REFUSALS, Chance, put

#: of a box whose corners come by x, then y, then z
BOX_FACES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


def broken_mesh(chance: Chance, attribute: str) -> bpy.types.Mesh:
    """A mesh of one of SHAPES with layers, normals and coordinates that may be broken."""
    vertices, edges, faces = chance.one_of(*SHAPES)(chance)
    vertices = np.array(vertices, np.float64).reshape(-1, 3) * chance.one_of(1, 1, 1, 1, 1e-4, 1e3)
    if chance.likely(0.1):
        vertices += chance.one_of(1e3, -1e6)
    vertices = spoilt(chance, vertices)
    mesh = bpy.data.meshes.new(chance.one_of("mesh", "Würfel", "a" * 60))
    mesh.from_pydata(vertices.tolist(), edges, [face[::-1] for face in faces] if chance.likely(0.2) else faces)
    if chance.likely(0.3):
        mesh.polygons.foreach_set("use_smooth", [chance.likely(0.5) for _ in mesh.polygons])
    if chance.likely(0.15):
        _custom_normals(chance, mesh)
    _layers(chance, mesh, attribute)
    return mesh


def spoilt(chance: Chance, vertices: np.ndarray) -> np.ndarray:
    """The vertices (V, 3) with odd numbers in odd scenes, and sometimes squeezed to a plane, a line or a point."""
    odd = chance.arrays.random(vertices.shape) < chance.oddness / 8
    vertices[odd] = chance.rows((int(odd.sum()),), -1, 1) if chance.likely(0.2) else chance.number(-1, 1)
    if chance.likely(0.05):
        vertices[:, : chance.count(1, 3)] = chance.between(-1, 1)
    return np.where(np.abs(vertices) > 3.4e38, np.copysign(np.inf, vertices), vertices)


def _cube(chance: Chance):
    vertices = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    return vertices, [], BOX_FACES


def _room(chance: Chance):
    vertices, edges, faces = _cube(chance)
    return [(3 * x, 3 * y, 3 * z) for x, y, z in vertices], edges, [face[::-1] for face in faces]


def _grid(chance: Chance):
    n = chance.count(2, 9)
    vertices = [(4 * i / n - 2, 4 * j / n - 2, chance.between(-0.1, 0.1)) for i in range(n) for j in range(n)]
    return vertices, [], [(k, k + n, k + n + 1, k + 1) for i in range(n - 1) for k in range(i * n, i * n + n - 1)]


def _soup(chance: Chance):
    """Triangles anywhere: crossing, non-manifold, some of them twice, in both directions, or without an area."""
    count = chance.count(1, 40)
    faces = [tuple(int(v) for v in chance.arrays.choice(count + 3, 3, replace=False)) for _ in range(count)]
    faces += [face[::-1] for face in faces[: chance.count(0, 5)]]
    return chance.arrays.uniform(-2, 2, (count + 3, 3)), [], faces


def _repeated(chance: Chance):
    """Faces over each other, in one plane, with vertices of their own."""
    square = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)
    count = chance.count(2, 8)
    vertices = np.concatenate([square + (chance.one_of(0, 0, 0.5, 1e-7), 0, 0) for _ in range(count)])
    return vertices, [], [tuple(range(4 * k, 4 * k + 4)) for k in range(count)]


def _needles(chance: Chance):
    count = chance.count(1, 20)
    thin = chance.one_of(1e-3, 1e-6, 1e-9, 0.0)
    vertices = [(k * 0.1 + side * thin, end, 0.3 * k) for k in range(count) for side, end in ((0, 0), (1, 0), (0, 3))]
    return vertices, [], [(3 * k, 3 * k + 1, 3 * k + 2) for k in range(count)]


def _polygon(chance: Chance):
    """One face of many corners: a star, concave, crossing itself, or with corners in one place."""
    count, step = chance.count(3, 40), chance.one_of(1, 1, 2, 3)
    places = [(step * k * 2 * math.pi / count, chance.one_of(1, 2, 0.2)) for k in range(count)]
    vertices = [(r * math.cos(a), r * math.sin(a), chance.one_of(0, 0, 0, 0.3)) for a, r in places]
    if chance.likely(0.2):
        vertices[1:3] = [vertices[0]] * 2
    return vertices, [], [tuple(range(count))]


def _fan(chance: Chance):
    """Many faces around one edge, as on no real surface."""
    count = chance.count(3, 12)
    rim = [(math.cos(2 * math.pi * k / count), math.sin(2 * math.pi * k / count), 0.5) for k in range(count)]
    return [(0, 0, 0), (0, 0, 1), *rim], [], [(0, 1, k + 2) for k in range(count)]


def _loose(chance: Chance):
    vertices, _, faces = _cube(chance)
    extra = [tuple(row) for row in chance.arrays.uniform(-3, 3, (6, 3))]
    return vertices + extra, [(8, 9), (10, 11), (0, 12)], faces[: chance.count(0, 6)]


def _wire(chance: Chance):
    return chance.arrays.uniform(-1, 1, (5, 3)), [(0, 1), (1, 2), (3, 4)], []


def _nothing(chance: Chance):
    return [], [], []


def _dense(chance: Chance):
    """A sphere of some hundred faces."""
    n = chance.count(8, 20)
    angles = [(math.pi * (i + 1) / (n + 1), 2 * math.pi * j / n) for i in range(n) for j in range(n)]
    vertices = [(math.sin(t) * math.cos(p), math.sin(t) * math.sin(p), math.cos(t)) for t, p in angles]
    quads = [(i * n + j, (i + 1) * n + j, (i + 1) * n + (j + 1) % n, i * n + (j + 1) % n)
             for i in range(n - 1) for j in range(n)]  # fmt: skip
    return vertices, [], [*quads, tuple(range(n))[::-1], tuple(range(n * n - n, n * n))]


SHAPES = (
    *(_cube, _cube, _cube, _room, _room, _grid, _grid, _dense),
    *(_soup, _soup, _repeated, _needles, _polygon, _polygon, _fan, _loose, _wire, _nothing),
)


def _custom_normals(chance: Chance, mesh) -> None:
    normals = chance.rows((len(mesh.loops), 3), -1, 1)
    if chance.likely(0.3):
        normals[:] = chance.one_of((0, 0, 0), (0, 0, 1), (math.nan, 0, 0))
    try:
        mesh.normals_split_custom_set(normals.tolist())
    except REFUSALS:
        return


def _layers(chance: Chance, mesh, attribute: str) -> None:
    """UV maps, attributes, vertex colours; sometimes one with the bake's own name, of whatever type."""
    if chance.likely(0.5):
        layer = mesh.uv_layers.new(name=chance.one_of("UVMap", "Ω", attribute if chance.likely(0.1) else "second"))
        if layer:
            layer.uv.foreach_set("vector", chance.rows((len(mesh.loops) * 2,), -2, 3).astype(np.float32))
    kinds = ("FLOAT", "INT", "FLOAT_VECTOR", "FLOAT_COLOR", "BYTE_COLOR", "BOOLEAN", "FLOAT2", "INT8", "QUATERNION")
    names = ["Col", "weight", "Attribute", "sharp_face", "material_index", "custom_normal"] * chance.likely(0.3)
    names += [attribute] * chance.likely(0.2)
    for name in chance.some_of(names, 3):
        kind, domain = chance.one_of(*kinds), chance.one_of("POINT", "EDGE", "FACE", "CORNER", "CORNER")
        if name == attribute and chance.likely(0.6):
            kind = "FLOAT_COLOR"
        try:
            layer = mesh.attributes.new(name, kind, domain)
            if kind in ("FLOAT_COLOR", "BYTE_COLOR"):
                values = chance.rows((len(layer.data) * 4,), 0, 1).astype(np.float32)
                layer.data.foreach_set("color", values)
        except REFUSALS:
            continue
    # Blender 5.2 itself crashes when it is told the materials of faces that have an attribute of that name.
    if chance.likely(0.3) and len(mesh.polygons) and "material_index" not in mesh.attributes:
        mesh.polygons.foreach_set("material_index", [chance.one_of(0, 0, 1, 2, 7) for _ in mesh.polygons])
    if chance.likely(0.05):
        put(mesh, "texspace_size", chance.numbers(3, 0, 1))
