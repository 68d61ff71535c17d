"""Why there is nothing to bake, no light, or only darkness: sentences that name the cause where the scene shows it."""

from __future__ import annotations

from collections.abc import Iterable

import bpy
import numpy as np

from .reading.read_meshes import vertex_positions
from .units import metres_per_unit
from .wording import counted, some

#: so many times as far away as most of the scene, an object leaves too few digits to tell the rest apart
_STRAY = 1e5

#: words of what may have been left out in place of light
_DARKENS = (
    *("lights ", "gives no light", "hidden from diffuse light", "portal", "nodes that vary the light"),
    *("a plain value takes", "kind of ray", "volume"),
)

#: lamps that are looked at, and how far behind a face one counts as meant to shine on it, of the face's size
MOST_LAMPS, SUNK = 16, 1e-2


def why_nothing_to_bake(scene: bpy.types.Scene, chosen: list[bpy.types.Object] | None) -> str | None:
    """Why no face is left of the ``chosen`` objects, or of all; None when it cannot be seen from outside."""
    objects = [obj for obj in (scene.objects if chosen is None else chosen) if obj.type == "MESH"]
    found: dict[str, list[str]] = {}
    for obj in objects:
        reason = _why_no_face(obj)
        if reason is None:
            return None
        found.setdefault(reason, []).append(obj.name)
    return f"There is nothing to bake: {_listed(found, 'object')}." if found else None


def why_no_light(scene: bpy.types.Scene, said: Iterable[str]) -> str | None:
    """Why nothing gives light, from the scene and what was ``said`` at its reading; None when it just has no light."""
    causes = [sentence for sentence in said if any(words in sentence for words in _DARKENS)]
    found: dict[str, list[str]] = {}
    for obj in scene.objects:
        if obj.type == "LIGHT" and obj.hide_render:
            found.setdefault("hidden from renders", []).append(obj.name)
        elif obj.type == "LIGHT" and obj.data.energy == 0:
            found.setdefault("of no strength", []).append(obj.name)
    causes += [_listed(found, "light")] if found else []
    scripts = _scripts_not_run()
    if scripts:
        causes.append(scripts)
    return f"Nothing in the scene gives light: {'; '.join(causes)}." if causes else None


def why_dark(scene: bpy.types.Scene, corners: np.ndarray, photons: int) -> str:
    """Why no light met what was baked, from ``scene`` as it is now and the corners (T, 3, 3) m of all its triangles."""
    cause = _scripts_not_run() or _stray(corners.reshape(-1, 3)) or _sunk(scene, corners)
    if cause:
        return f"All that was baked is dark: {cause}."
    sought = f", or use more photons than {counted(photons, 'photon')} or a larger radius" if photons else ""
    return (
        f"No light met a baked surface from its front: look for lights inside solid geometry or normals that point "
        f"away from the light{sought}."
    )


def turned_away(whole: list[str], some: list[str]) -> str:
    """That the objects ``whole``, and ``some`` faces of others, are dark in front and lit from behind; by names."""
    found = {
        "dark on the side that their faces point to, and lit from behind": whole,
        "with some faces that are dark in front and lit from behind": some,
    }
    which = _listed({reason: names for reason, names in found.items() if names}, "object")
    return f"{which}: if that side is seen, turn their normals (Mesh > Normals > Recalculate Outside)."


def _why_no_face(obj: bpy.types.Object) -> str | None:
    if obj.hide_render:
        return "hidden from renders"
    if not len(obj.data.polygons):
        return "without faces"
    matrix = np.array(obj.matrix_world)
    if not np.isfinite(matrix).all():
        return "at a place that is not a number"
    if not np.isfinite(vertex_positions(obj.data)).all(axis=1).any():
        return "with vertices that are not numbers"
    # Two directions left are a plane, which still shows faces that do not stand on it.
    lengths = np.linalg.norm(matrix[:3, :3], axis=0)
    if np.count_nonzero(lengths > 1e-12 * lengths.max()) < 3:
        return "scaled to nothing"
    return None


def _scripts_not_run() -> str | None:
    """A sentence on a script or driver that Blender did not run, if there was one."""
    if not bpy.app.autoexec_fail:
        return None
    which = f" ({bpy.app.autoexec_fail_message})" if bpy.app.autoexec_fail_message else ""
    return (
        f"scripts in the file were not run{which}, which may be what lights it: allow them in Blender if you trust "
        f"them, and save the scene with the values they set"
    )


def _stray(vertices: np.ndarray) -> str | None:
    """A sentence on the object that lies out of all proportion to the rest, if there is one."""
    if not len(vertices):
        return None
    middle = np.median(vertices, axis=0)
    distances = np.linalg.norm(vertices - middle, axis=1)
    if distances.max() <= _STRAY * np.quantile(distances, 0.8):
        return None
    reach = {}
    for obj in bpy.data.objects:
        if obj.type == "MESH" and not obj.hide_render:
            corners = np.array(obj.bound_box) @ np.array(obj.matrix_world)[:3, :3].T + np.array(obj.matrix_world)[:3, 3]
            reach[obj.name] = float(np.linalg.norm(corners - middle, axis=1).max())
    name = max(reach, key=reach.get, default=None)
    where = f"'{name}' reaches" if name is not None else "something reaches"
    return (
        f"{where} {distances.max() / 1000:.7g} km away, beside which the rest is too small to be told apart: "
        f"move it, or hide it from renders"
    )


def _sunk(scene: bpy.types.Scene, corners: np.ndarray) -> str | None:
    """A sentence on the lamps that lie in a face, or so little behind it that they were to shine on it; or None."""
    lamps = [obj for obj in scene.objects if obj.type == "LIGHT" and obj.data.type != "SUN" and not obj.hide_render]
    found = []
    for lamp in lamps[:MOST_LAMPS]:
        place = metres_per_unit(scene) * np.array(lamp.matrix_world.translation)
        # Of triangles without area come no numbers, which compare with nothing.
        with np.errstate(all="ignore"):
            depth = _depth(place, corners)
        if depth is not None:
            where = f"{1000 * depth:.3g} mm behind a face" if depth > 0 else "in the plane of a face"
            found.append(f"the light '{lamp.name}' lies {where}")
    return f"{'; '.join(found[:3])}: move it to the side that should be lit" if found else None


def _depth(place: np.ndarray, corners: np.ndarray) -> float | None:
    """Metres by which ``place`` (3,) m lies behind the nearest of the triangles (T, 3, 3) that it all but touches."""
    edges, other = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normals = np.cross(edges, other)
    doubled = np.linalg.norm(normals, axis=1)
    away = place - corners[:, 0]
    depths = -np.einsum("tj,tj->t", away, normals) / doubled
    first = np.einsum("tj,tj->t", np.cross(away, other), normals) / doubled**2
    second = np.einsum("tj,tj->t", np.cross(edges, away), normals) / doubled**2
    inside = (first >= 0) & (second >= 0) & (first + second <= 1)
    near = inside & (depths >= 0) & (depths <= SUNK * np.sqrt(doubled))
    return float(depths[near].min()) if near.any() else None


def _listed(found: dict[str, list[str]], thing: str) -> str:
    """``2 objects scaled to nothing (A, B), 1 object without faces (C)``."""
    return ", ".join(f"{counted(len(names), thing)} {reason} ({some(names, '')})" for reason, names in found.items())
