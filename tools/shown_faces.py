"""The faces of the open file as a render shows them, and the colours that lie on them between the vertices."""

from dataclasses import dataclass

import bpy
import numpy as np
from detp.core.triangles import normals_and_areas
from detp.detp_addon.reading.nearest_surface import nearest_places
from detp.detp_addon.reading.read_attributes import stored_normals
from detp.detp_addon.reading.read_meshes import MeshSurface, corner_vertex_indices, vertex_positions
from detp.detp_addon.reading.render_view import view_as_render
from detp.detp_addon.reading.triangle_geometry import has_area
from detp.detp_addon.writing.baked_layers import stored_colours


@dataclass(frozen=True)
class ShownFaces:
    """The T triangles of an object after its modifiers, in Blender's units in world space.

    corners (T, 3, 3); normals (T, 3, 3) of shading, unit; colours (T, 3, 3) at the corners, NaN where there are none
    """

    corners: np.ndarray
    normals: np.ndarray
    colours: np.ndarray

    def at(self, places: np.ndarray, facing: np.ndarray) -> np.ndarray:
        """The colours (K, 3) at ``places`` (K, 3) on faces with normals ``facing`` (K, 3), as they are interpolated."""
        count = len(self.corners)
        if count == 0:
            return np.full((len(places), 3), np.nan)
        rows = np.arange(3 * count).reshape(-1, 3)
        kept = has_area(self.corners)
        surface = MeshSurface(self.corners.reshape(-1, 3), rows.ravel(), rows, rows, kept, (), rows, {}, None)
        found, nearest = nearest_places(surface, places, facing)
        shown = np.einsum("kc,kcx->kx", barycentric(self.corners[found], nearest), self.colours[found])
        return np.where(found[:, None] >= 0, shown, np.nan)


def shown_faces(names: list[str], attribute: str = "") -> dict[str, ShownFaces]:
    """The faces of the mesh objects of these ``names``, with the colours of that ``attribute``, "" for none."""

    def visit(depsgraph) -> dict[str, ShownFaces]:
        return {name: _shown(bpy.data.objects[name].evaluated_get(depsgraph), attribute) for name in names}

    return view_as_render(bpy.context.scene, bpy.context.view_layer, visit)


def barycentric(corners: np.ndarray, places: np.ndarray) -> np.ndarray:
    """The weights (K, 3) of triangles' ``corners`` (K, 3, 3) at ``places`` (K, 3) on them."""
    normals, _ = normals_and_areas(corners)
    towards = (np.roll(corners, -way, axis=1) - places[:, None] for way in (1, 2))
    parts = np.maximum(np.einsum("kcx,kx->kc", np.cross(*towards), normals), 0.0)
    return parts / np.maximum(parts.sum(axis=1, keepdims=True), 1e-300)


def _shown(obj: bpy.types.Object, attribute: str) -> ShownFaces:
    mesh, matrix = obj.data, np.array(obj.matrix_world)
    mesh.calc_loop_triangles()
    loops = np.empty(3 * len(mesh.loop_triangles), np.int32)
    mesh.loop_triangles.foreach_get("loops", loops)
    vertices = corner_vertex_indices(mesh)[loops]
    # What is broken in the mesh lies at one place, where it has no area.
    corners = vertex_positions(mesh)[vertices] @ matrix[:3, :3].T + matrix[:3, 3]
    broken = ~np.isfinite(corners).reshape(-1, 9).all(axis=1)
    corners[np.repeat(broken, 3)] = 0.0
    normals = stored_normals(mesh)[loops] @ np.linalg.pinv(matrix[:3, :3])
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-30)[:, None]
    colours, layer = np.full((len(loops), 3), np.nan), mesh.attributes.get(attribute)
    if layer is not None and layer.domain in ("CORNER", "POINT"):
        colours = stored_colours(layer).astype(float)[loops if layer.domain == "CORNER" else vertices, :3]
    # A mirrored object turns its triangles inside out.
    order = [0, 1, 2] if np.linalg.det(matrix[:3, :3]) >= 0.0 else [2, 1, 0]
    return ShownFaces(*(values.reshape(-1, 3, 3)[:, order] for values in (corners, normals, colours)))
