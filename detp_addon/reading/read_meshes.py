"""Reads evaluated meshes: each once, in its own space, however often it stands in the scene."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..baked_layers import ColourLayers
from .findings import Findings
from .glass_bodies import settled
from .placed_values import BASES, Standing, placed_value
from .read_attributes import corner_values, stored_normals
from .read_materials import Materials, Recipe
from .response import Optics, Response
from .triangle_geometry import has_area
from .views import VIEWS, same_view


@dataclass(frozen=True)
class MeshSurface:
    """An evaluated mesh with its materials, in its own space.

    vertices    (V, 3) metres; those that are not finite are zero, and belong to no triangle that is kept
    triangles   (T, 3) vertex of each triangle corner
    corners     (T, 3) face corner of each triangle corner
    kept        (T,) whether the triangle has finite vertices and an area
    recipe_rows (T,) which of ``recipes`` it has
    attributes  what the recipes need, one row per face corner
    normals     (C, 3) of the face corners, None when no recipe mirrors or refracts
    """

    vertices: np.ndarray
    triangles: np.ndarray
    corners: np.ndarray
    kept: np.ndarray
    recipes: tuple[Recipe, ...]
    recipe_rows: np.ndarray
    attributes: dict[tuple[str, str], np.ndarray]
    normals: np.ndarray | None

    @cached_property
    def asks(self) -> frozenset[str]:
        """What the recipes of the triangles depend on besides the place."""
        return frozenset().union(*(self.recipes[row].asks for row in np.unique(self.recipe_rows)))

    @property
    def placed_needs(self) -> frozenset[tuple[str, str]]:
        """What the recipes need that each object gives anew."""
        return frozenset(key for recipe in self.recipes for key in recipe.needs if key in BASES or key[0] in BASES)

    def placed(self, standing: Standing) -> MeshSurface:
        """The same with what an object gives that wears it."""
        corners = int(self.corners.max(initial=-1)) + 1
        own = {key: placed_value(key, standing, self.attributes, corners) for key in self.placed_needs}
        return replace(self, attributes=self.attributes | own)


@contextmanager
def rendered_mesh(obj) -> Iterator:
    """The mesh of an evaluated object; in Edit Mode its data are empty, and a render makes a mesh as here."""
    if not obj.data.is_editmode:
        yield obj.data
        return
    try:
        yield obj.to_mesh()
    finally:
        obj.to_mesh_clear()


def read_mesh(
    mesh, slots: list, materials: Materials, layers: ColourLayers, findings: Findings, name: str
) -> MeshSurface:
    """The ``mesh`` of the object ``name`` with the materials of its ``slots`` (None where empty).

    ``layers`` are the colour layers of the mesh before its modifiers.
    """
    vertices, corner_vertices = vertex_positions(mesh), corner_vertex_indices(mesh)
    finite = np.isfinite(vertices).all(axis=1)
    mesh.calc_loop_triangles()
    corners = _triangle_numbers(mesh, "loops", 3).reshape(-1, 3)
    triangles = corner_vertices[corners]
    whole = finite[triangles].all(axis=1)
    if not whole.all():
        findings.warn("faces with vertices that are not numbers are left out of {}", "object", name)
    vertices = np.where(finite[:, None], vertices, 0.0)
    recipes, rows = _recipes(mesh, slots, materials, len(triangles))
    needs = set().union(*(recipe.needs for recipe in recipes))
    needs = sorted({BASES.get(key, BASES.get(key[0], key)) for key in needs} - {None})
    return MeshSurface(
        vertices,
        triangles,
        corners,
        whole & has_area(vertices[triangles]),
        recipes,
        rows,
        {key: corner_values(mesh, key, corner_vertices, layers, findings) for key in needs},
        stored_normals(mesh) if any(recipe.specular for recipe in recipes) else None,
    )


def vertex_positions(mesh) -> np.ndarray:
    """Positions (V, 3) in the mesh's own space."""
    values = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", values)
    return values.astype(np.float64).reshape(-1, 3)


def corner_vertex_indices(mesh) -> np.ndarray:
    """The vertex (C,) of each face corner."""
    values = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", values)
    return values


def respond(surfaces: list[MeshSurface], materials: Materials) -> list[Optics]:
    """What the triangles of each surface do to light; all triangles of a material at once."""
    numbers = range(len(VIEWS))
    responses = [
        {same_view(number, surface.asks): Response.none(len(surface.triangles)) for number in numbers}
        for surface in surfaces
    ]
    wearers: dict[int, tuple[Recipe, list]] = {}
    for surface, found in zip(surfaces, responses, strict=True):
        for row in np.unique(surface.recipe_rows):
            recipe = surface.recipes[row]
            rows = np.flatnonzero(surface.recipe_rows == row)
            wearers.setdefault(id(recipe), (recipe, []))[1].append((surface, found, rows))
    for recipe, parts in wearers.values():
        corners = {
            key: np.concatenate([surface.attributes[key][surface.corners[rows]] for surface, _, rows in parts])
            for key in recipe.needs
        }
        whole = materials.evaluate(recipe, corners, sum(len(rows) for _, _, rows in parts))
        start = 0
        for _, found, rows in parts:
            here = slice(start, start + len(rows))
            for number, response in found.items():
                of_recipe = whole[same_view(number, recipe.asks)]
                for array, values in zip(response.arrays, of_recipe.arrays, strict=True):
                    array[rows] = values[here]
            start = here.stop
    optics = []
    for surface, found in zip(surfaces, responses, strict=True):
        views = {number: settled(view, surface.vertices, surface.triangles) for number, view in found.items()}
        optics.append(Optics(tuple(views[same_view(number, surface.asks)] for number in numbers)))
    return optics


def _recipes(mesh, slots: list, materials: Materials, count: int) -> tuple[tuple[Recipe, ...], np.ndarray]:
    """The recipes of the slots, and which of them each triangle has."""
    layer = mesh.attributes.get("material_index")
    if len(slots) < 2 or layer is None or (layer.domain, layer.data_type) != ("FACE", "INT") or count == 0:
        rows = np.zeros(count, np.int64)
    else:
        indices = np.empty(len(mesh.polygons), np.int32)
        layer.data.foreach_get("value", indices)
        rows = np.clip(indices, 0, len(slots) - 1)[_triangle_numbers(mesh, "polygon_index", 1)]
    for row in np.unique(rows):
        if slots and slots[row] is not None:
            materials.note(slots[row])
    return tuple(materials.recipe(slot) for slot in slots or [None]), rows


def _triangle_numbers(mesh, prop: str, width: int) -> np.ndarray:
    values = np.empty(width * len(mesh.loop_triangles), np.int32)
    mesh.loop_triangles.foreach_get(prop, values)
    return values
