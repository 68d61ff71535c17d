"""Reads evaluated meshes: each once, in its own space, however often it stands in the scene."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np

from ..writing.baked_layers import NO_LAYERS, ColourLayers
from .findings import Findings
from .glass_bodies import settled_glass, without_faint
from .joined_rows import any_of, batches, starts_of
from .placed_values import BASES, Standing, placed_value
from .read_attributes import NAMED, corner_values, stored_normals
from .read_materials import Materials, Recipe
from .response import Optics, Response
from .triangle_geometry import has_area
from .views import VIEWS, same_view


@dataclass(frozen=True)
class MeshSurface:
    """An evaluated mesh with its materials, in its own space.

    vertices    (V, 3) metres; those that are not finite are zero, and belong to no triangle that is kept
    at_corners  (C,) the vertex of each face corner
    triangles   (T, 3) vertex of each triangle corner
    corners     (T, 3) face corner of each triangle corner
    kept        (T,) whether the triangle has finite vertices and an area
    recipe_rows (T,) which of ``recipes`` it has
    attributes  what the recipes need, one row per face corner
    normals     (C, 3) of the face corners; None when no modifier made them and no recipe mirrors or refracts
    """

    vertices: np.ndarray
    at_corners: np.ndarray
    triangles: np.ndarray
    corners: np.ndarray
    kept: np.ndarray
    recipes: tuple[Recipe, ...]
    recipe_rows: np.ndarray
    attributes: dict[tuple[str, str], np.ndarray]
    normals: np.ndarray | None

    @property
    def placed_needs(self) -> frozenset[tuple[str, str]]:
        """What the recipes need that each object gives anew."""
        return frozenset(key for recipe in self.recipes for key in recipe.needs if key in BASES or key[0] in BASES)

    def placed(self, standing: Standing) -> MeshSurface:
        """The same with what an object gives that wears it."""
        corners = len(self.at_corners)
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
    mesh,
    slots: list,
    materials: Materials,
    layers: Callable[[], ColourLayers],
    findings: Findings,
    name: str,
    changed: bool = False,
) -> MeshSurface:
    """The ``mesh`` of the object ``name`` with the materials of its ``slots`` (None where empty).

    ``layers`` tells the colour layers of the mesh before its modifiers, when materials ask for colours; ``changed``,
    whether it has modifiers. All triangles with finite vertices are kept, until :func:`with_area` has looked at them.
    """
    vertices, corner_vertices = vertex_positions(mesh), corner_vertex_indices(mesh)
    corners = corner_triangles(mesh)
    triangles = corner_vertices[corners]
    whole = np.ones(len(triangles), bool)
    if not np.isfinite(vertices).all():
        finite = np.isfinite(vertices).all(axis=1)
        whole = finite[triangles].all(axis=1)
        vertices = np.where(finite[:, None], vertices, 0.0)
    if not whole.all():
        findings.warn("faces with vertices that are not numbers are left out of {}", "object", name)
    recipes, rows = _recipes(mesh, slots, materials, len(triangles))
    needs = set().union(*(recipe.needs for recipe in recipes))
    needs = sorted({BASES.get(key, BASES.get(key[0], key)) for key in needs} - {None})
    colours = layers() if any(kind in NAMED for kind, _ in needs) else NO_LAYERS
    return MeshSurface(
        vertices,
        corner_vertices,
        triangles,
        corners,
        whole,
        recipes,
        rows,
        {key: corner_values(mesh, key, corner_vertices, colours, findings) for key in needs},
        stored_normals(mesh) if changed or any(recipe.specular for recipe in recipes) else None,
    )


def with_area(surfaces: list[MeshSurface]) -> list[MeshSurface]:
    """The ``surfaces``, of whose triangles only those are kept that have an area."""
    kept = []
    for some in batches([len(surface.triangles) for surface in surfaces]):
        corners = np.concatenate([surface.vertices[surface.triangles] for surface in surfaces[some]])
        kept += np.split(has_area(corners), starts_of([len(surface.triangles) for surface in surfaces[some]])[1:-1])
    return [
        replace(surface, kept=surface.kept & solid) if not solid.all() else surface
        for surface, solid in zip(surfaces, kept, strict=True)
    ]


def vertex_positions(mesh) -> np.ndarray:
    """Positions (V, 3) in the mesh's own space."""
    values = np.empty(3 * len(mesh.vertices), np.float32)
    if not _read_layer(mesh, "position", "vector", values):
        mesh.vertices.foreach_get("co", values)
    return values.astype(np.float64).reshape(-1, 3)


def corner_vertex_indices(mesh) -> np.ndarray:
    """The vertex (C,) of each face corner."""
    values = np.empty(len(mesh.loops), np.int32)
    if not _read_layer(mesh, ".corner_vert", "value", values):
        mesh.loops.foreach_get("vertex_index", values)
    return values


def corner_triangles(mesh) -> np.ndarray:
    """The face corners (T, 3) of the triangles that make up the faces."""
    mesh.calc_loop_triangles()
    return _triangle_numbers(mesh, "loops", 3).reshape(-1, 3)


def respond(surfaces: list[MeshSurface], materials: Materials) -> Optics:
    """What the triangles of all surfaces, one after the other, do to light; all triangles of a material at once."""
    starts = starts_of([len(surface.triangles) for surface in surfaces])
    front, differing, patterned = Response.none(starts[-1]), [], []
    for recipe, wearers in _wearers(surfaces):
        rows = np.concatenate([starts[number] + rows for number, rows in wearers])
        corners = {
            key: np.concatenate(
                [surfaces[number].attributes[key][surfaces[number].corners[rows]] for number, rows in wearers]
            )
            for key in recipe.needs
        }
        found, uneven = materials.evaluate(recipe, corners, len(rows))
        if uneven.any():
            patterned.append((recipe.name, rows[uneven]))
        front.put(rows, found[0])
        if len(found) > 1:
            differing.append((rows, [found[same_view(number, recipe.asks)] for number in range(len(VIEWS))]))
    _settle(front, np.arange(starts[-1]), surfaces, starts, materials)
    rows = np.concatenate([np.zeros(0, np.int64), *(rows for rows, _ in differing)])
    order, views, known = np.argsort(rows), [], {}
    for parts in zip(*(found for _, found in differing), strict=True):
        same = tuple(map(id, parts))
        if same not in known:
            known[same] = Response.joined(parts).rows(order)
            _settle(known[same], rows[order], surfaces, starts, materials)
        views.append(known[same])
    return Optics(front, rows[order], tuple(views), tuple(patterned))


def _wearers(surfaces: list[MeshSurface]) -> Iterator[tuple[Recipe, list[tuple[int, np.ndarray]]]]:
    """Each recipe in use, with the numbers of the surfaces that have it, and on which of their triangles."""
    wearers: dict[int, tuple[Recipe, list]] = {}
    for number, surface in enumerate(surfaces):
        if len(surface.recipes) == 1:
            used = [(surface.recipes[0], np.arange(len(surface.triangles)))] if len(surface.triangles) else []
        else:
            used = [
                (surface.recipes[row], np.flatnonzero(surface.recipe_rows == row))
                for row in np.unique(surface.recipe_rows)
            ]
        for recipe, rows in used:
            wearers.setdefault(id(recipe), (recipe, []))[1].append((number, rows))
    yield from wearers.values()


def _settle(
    response: Response, rows: np.ndarray, surfaces: list[MeshSurface], starts: np.ndarray, materials: Materials
) -> None:
    """Settle what is faint and what is glass in the ``response`` of the triangles ``rows`` (R,), which ascend.

    Those of each of the ``surfaces`` begin at ``starts``.
    """
    ends = np.searchsorted(rows, starts)
    for some in batches(np.diff(ends)):
        here = slice(ends[some.start], ends[some.stop])
        response.put(here, without_faint(response.rows(here)))
    for number in np.flatnonzero(any_of((response.gloss + response.clear).any(axis=1), ends)):
        here, surface = slice(ends[number], ends[number + 1]), surfaces[number]
        own = rows[here] - starts[number]
        settled, *straight = settled_glass(response.rows(here), surface.vertices, surface.triangles, own)
        response.put(here, settled)
        panes, sheets = (
            [surface.recipes[row].name for row in np.unique(surface.recipe_rows[own[some]])] for some in straight
        )
        materials.name_straight(panes, sheets)


def _recipes(mesh, slots: list, materials: Materials, count: int) -> tuple[tuple[Recipe, ...], np.ndarray]:
    """The recipes of the slots, and which of them each triangle has."""
    layer = mesh.attributes.get("material_index")
    if len(slots) < 2 or layer is None or (layer.domain, layer.data_type) != ("FACE", "INT") or count == 0:
        rows = np.zeros(count, np.int64)
    else:
        indices = np.empty(len(mesh.polygons), np.int32)
        layer.data.foreach_get("value", indices)
        rows = np.clip(indices, 0, len(slots) - 1)[_triangle_numbers(mesh, "polygon_index", 1)]
    for row in np.unique(rows) if len(slots) > 1 else range(min(len(slots), count)):
        if slots[row] is not None:
            materials.note(slots[row])
    return tuple(materials.recipe(slot) for slot in slots or [None]), rows


def _read_layer(mesh, name: str, prop: str, values: np.ndarray) -> bool:
    """Fill ``values`` from the attribute that Blender itself reads, a thousand times as fast as element by element.

    Not in Edit Mode, where attributes are empty.
    """
    layer = mesh.attributes.get(name)
    if layer is None or len(layer.data) == 0:
        return False
    layer.data.foreach_get(prop, values)
    return True


def _triangle_numbers(mesh, prop: str, width: int) -> np.ndarray:
    values = np.empty(width * len(mesh.loop_triangles), np.int32)
    mesh.loop_triangles.foreach_get(prop, values)
    return values
