"""Reads a Blender scene as a render sees it: triangles, lights, and the points where light is wanted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import NoReturn

import bpy
import numpy as np

from ...core.errors import EditModeError, NoMeshError
from ...core.group_sums import group_means
from ...core.lights.environment import EnvironmentWorld
from ...core.lights.light import Light
from ...core.lights.world import UniformWorld
from ...core.points import Points
from ...core.rays import RayCaster
from ...core.scene import Scene
from ...core.sides import any_side
from ...core.triangles import cross, dots
from ..wording import counted
from .doubled_faces import flush_with, share_alone
from .face_places import PlacedFaces, drawn_anew, placed_faces
from .findings import Findings
from .joined_rows import batches, numbered, starts_of
from .kept_places import KeptPlaces
from .placed_triangles import PlacedTriangles, placed_triangles
from .read_instances import RenderedObjects, TargetPoints, read_instances
from .read_shaders import DEFAULT_ALBEDO
from .read_specular import specular_table
from .render_settings import note_reflections
from .render_view import view_as_render
from .settled_corners import SettledPoints, settled_points
from .world_picture import world_lights

#: faces are large beyond this share of the scene
LARGE = 0.05

#: so many of the faces that reflect, the largest, are looked at for others that lie on them
LOOKED_AT = 4096

#: where light is looked for: on the faces, whose values are fitted to it, or at their vertices
FITS = ("faces", "vertices")


@dataclass(frozen=True)
class BakeTarget:
    """One mesh object to bake, by names, since Blender's own objects may go while a bake runs.

    library     path of the library file the object is linked from, None for the file's own
    domain      CORNER or POINT; E is the number of those elements of the mesh before modifiers, C that of its corners
    point_rows  (C,) the estimation point of each face corner, or the value that it shows, -1 for none
    albedo      (E, 3) and emission (E, 3) in W/(m^2 sr) of the surface there
    rendered    vertices and triangles that a render shows
    """

    object_name: str
    library: str | None
    mesh_name: str
    domain: str
    point_rows: np.ndarray
    albedo: np.ndarray
    emission: np.ndarray
    rendered: tuple[int, int] = (0, 0)


@dataclass(frozen=True)
class LightOrigins:
    """Whose the light of a scene is.

    lights    (object, light group) by name of each of the scene's lights; the world has the name WORLD
    groups    the names of light groups of objects, and emission (T,): the row there of each triangle's
    """

    lights: tuple[tuple[str | None, str], ...]
    groups: tuple[str, ...]
    emission: np.ndarray


#: what stands for the world among the names of objects
WORLD = None


@dataclass(frozen=True)
class ExportedScene:
    """What was read: the core's scene, what to bake, and what a person should know.

    centres    (N, 3) metres and normals (N, 3) unit: the estimation points of all targets
    facing     (N, 3) unit normals of their faces
    inward     (N, 3) metres, from each point into its own faces; zero on faces
    shown      the faces whose values are to be fitted to the light at the points, which lie on them; None where each
               point is that of some corners
    covered    (N,) whether another face lies against that of the point (see settled_corners.py)
    modelled   features that were found and are honoured; left_out: those that are not; warnings: one sentence each
    origins    whose the light is
    lights     how many there are: lamps, the world, and objects that shine
    """

    scene: Scene
    targets: tuple[BakeTarget, ...]
    centres: np.ndarray
    normals: np.ndarray
    facing: np.ndarray
    inward: np.ndarray
    covered: np.ndarray
    shown: PlacedFaces | None
    modelled: tuple[str, ...]
    left_out: tuple[str, ...]
    warnings: tuple[str, ...]
    origins: LightOrigins
    lights: int

    @property
    def points(self) -> Points:
        """The estimation points as the core takes them."""
        return Points(self.centres, self.normals, self.inward, self.facing)


def read_scene(
    context_scene: bpy.types.Scene,
    view_layer: bpy.types.ViewLayer,
    targets: list[bpy.types.Object] | None,
    domain: str,
    written: Sequence[str] = (),
    fit: str = "vertices",
    frame: int | None = None,
    kept: KeptPlaces | None = None,
) -> ExportedScene:
    """Read ``context_scene`` as a render of ``view_layer`` sees it at a ``frame``, None for now.

    ``targets`` are the objects to bake, None for every mesh object that the render shows; ``domain`` is CORNER or
    POINT; ``fit`` says where the points are, one of FITS. The colours of the attributes ``written`` and of earlier
    bakes are not looked at. Places on faces are those ``kept``, where there are such. Blender's data are afterwards
    as they were.

    Raises NoMeshError when nothing can be baked, EditModeError when all that could is open in Edit Mode, SceneBusyError
    while Blender renders, and InvalidArrayError on numbers that are out of range.
    """
    findings = Findings()
    wanted = None if targets is None else _bakeable(targets, findings)
    visit = partial(read_instances, wanted=wanted, findings=findings, written=written)
    read = view_as_render(context_scene, view_layer, visit, frame)
    placed = _met_once(read, placed_triangles(read.surfaces, read.placements), findings)
    frame = context_scene.frame_current if frame is None else frame
    world = _world_light(read, frame, findings, (view_layer, context_scene))
    # Cycles leaves highlights away where mirrors are to send no light on.
    even = "even" if getattr(getattr(context_scene, "cycles", None), "caustics_reflective", True) else "albedo"
    scene = _scene(read, placed, world, even, findings)
    _name_patterns(read, placed, findings)
    baked, points, shown = _targets(read, scene, domain, fit, kept)
    if targets is not None:
        _name_missing(wanted, {target.object_name for target in baked}, findings)
    if len(points.centres) == 0:
        _raise_no_mesh(read, wanted)
    note_reflections(context_scene, scene.albedo, findings)
    modelled, left_out, warnings = findings.sentences()
    return ExportedScene(
        scene, baked, points.centres, points.normals, points.facing, points.inward, points.covered, shown,
        modelled, left_out, warnings, _origins(read, placed, scene), len(scene.lights) + _shining(read),
    )  # fmt: skip


def _raise_no_mesh(read: RenderedObjects, wanted: set[bpy.types.Object] | None) -> NoReturn:
    """Say why none of the ``wanted`` objects, None for all, can be baked."""
    if read.editing:
        names = ", ".join(f"'{name}'" for name in read.editing[:3])
        raise EditModeError(f"All meshes to bake are open in Edit Mode ({names}): leave Edit Mode and bake again.")
    chosen = None if wanted is None else {obj.name for obj in wanted}
    realize = (
        "instances that geometry nodes make ({}): add a Realize Instances node, so that they have faces of their own"
    )
    apply = "faces that modifiers make ({}): apply them (on the command line --apply-modifiers)"
    for found, what in ((read.scattered, realize), (read.faceless, apply)):
        names = [f"'{name}'" for name in found if chosen is None or name in chosen]
        if names:
            raise NoMeshError(f"There is nothing to bake but {what.format(', '.join(names[:3]))}.")
    raise NoMeshError("There is nothing to bake: choose mesh objects with faces that a render shows.")


def _origins(read: RenderedObjects, placed: PlacedTriangles, scene: Scene) -> LightOrigins:
    """Whose the lights of ``scene`` are, which has the lamps first."""
    world = (WORLD, read.world.lightgroup if read.world is not None else "")
    lights = (*read.lamps, *[world] * (len(scene.lights) - len(read.lamps)))
    names, rows = np.unique([each.lightgroup for each in read.placements], return_inverse=True)
    return LightOrigins(lights, tuple(names.tolist()), rows[placed.placement])


def _shining(read: RenderedObjects) -> int:
    """How many objects give light by their materials."""
    return sum(bool(read.shines[placement.surface]) and placement.diffuse for placement in read.placements)


def _bakeable(targets: list[bpy.types.Object], findings: Findings) -> set[bpy.types.Object]:
    """The targets that are meshes."""
    for obj in targets:
        if obj.type != "MESH":
            findings.warn("only mesh objects can be baked, not {}", "object", obj.name)
    return {obj for obj in targets if obj.type == "MESH"}


def _name_missing(wanted: set[bpy.types.Object], baked: set[str], findings: Findings) -> None:
    for name in sorted(obj.name for obj in wanted if not obj.data.is_editmode):
        if name not in baked:
            findings.warn("there is no light to bake on {}, of which a render shows no face", "object", name)


def _world_light(read: RenderedObjects, frame: int, findings: Findings, owners: Sequence) -> list[Light]:
    """The world at a ``frame`` as a light, none when it is black; ``owners`` as :func:`world_lights` has them."""
    if read.radiance is not None:
        if not read.radiance.any():
            return []
        findings.modelled("a world of one colour")
        return [UniformWorld(read.radiance)]
    picture, suns = world_lights(read.world, frame, findings.left_out, owners)
    for sun in suns:
        findings.modelled(f"a sun of the world, {np.degrees(sun.angle):.2g} degrees wide, as a light of its own")
    if not picture.any():
        return suns
    height, width = picture.shape[:2]
    findings.modelled(f"the world's sky or image, as Cycles shows it in {width} x {height} pixels")
    return [*suns, EnvironmentWorld(picture)]


def _scene(read: RenderedObjects, placed: PlacedTriangles, world: list[Light], even: str, findings: Findings) -> Scene:
    """Everything in world space, without the triangles that have no area there; they reflect the share ``even``."""
    # Nothing reflects or shines that diffuse rays do not meet.
    seen = partial(_seen, read, placed)
    albedo, emission = seen(even, 0), seen("emission", 4)
    between, straight = seen("transmittance", 0, otherwise=1.0), seen("transmittance", 2, "shadow", 1.0)
    unshaded = None if np.array_equal(between, straight) else straight
    if unshaded is not None and world:
        sentence = "shadow rays to the world: what they pass otherwise than diffuse rays do, the world's light does not"
        findings.left_out(sentence)
    if unshaded is not None and emission.any():
        sentence = "light of what shines that diffuse rays find: it passes, and is blocked, where shadow rays are"
        findings.left_out(sentence)
    _name_doubled(placed, any_side(albedo) & ~any_side(between), findings)
    _name_flush(placed, any_side(emission), ~any_side(between), findings)
    spread = seen("spread", 0)
    specular, lights = specular_table(read.surfaces, read.optics.front, read.placements, placed), (*read.lights, *world)
    return Scene(
        placed.vertices, placed.triangles, albedo, emission, between, lights, specular, unshaded,
        spread if spread.any() else None,
    )  # fmt: skip


def _seen(
    read: RenderedObjects,
    placed: PlacedTriangles,
    name: str,
    first: int,
    rays: str = "diffuse",
    otherwise: float = 0.0,
) -> np.ndarray:
    """What the triangles are by the views from the ``first`` on: (T, 3), or (2, T, 3) when any one's sides differ.

    Those that such ``rays`` do not meet are ``otherwise``.
    """
    met = np.array([getattr(placement, rays) for placement in read.placements], bool)[placed.placement, None]
    views = (first, first + 1) if len(read.optics.rows) else (first,)
    sides = [np.where(met, read.optics.seen(name, view).take(placed.rows, axis=0), otherwise) for view in views]
    return sides[0] if np.array_equal(sides[0], sides[-1]) else np.stack(sides)


def _met_once(read: RenderedObjects, placed: PlacedTriangles, findings: Findings) -> PlacedTriangles:
    """The triangles without opaque ones that shine, to both sides alike, and lie on others that do.

    Were they there, rays would meet either by chance, and light would be looked for on both.
    """
    shining = np.array([read.shines[placement.surface] for placement in read.placements], bool)
    rows = np.flatnonzero(shining[placed.placement])
    some = placed.taken(rows)
    emission, between = _seen(read, some, "emission", 4), _seen(read, some, "transmittance", 0, otherwise=1.0)
    even = (emission[0] == emission[-1]).all(axis=-1) if emission.ndim == 3 else True
    rows = rows[any_side(emission) & ~any_side(between) & even]
    if len(rows) == 0:
        return placed
    doubled = rows[share_alone(placed.vertices[placed.triangles[rows]]) < 0.5]
    if len(doubled) == 0:
        return placed
    findings.warn(f"{counted(len(doubled), 'triangle')} shining where others do: counted once; look for doubled faces, "
                  f"or objects")  # fmt: skip
    return placed.taken(np.delete(np.arange(len(placed.triangles)), doubled))


def _name_doubled(placed: PlacedTriangles, reflects: np.ndarray, findings: Findings) -> None:
    """Name opaque triangles that reflect and lie on others: a path that leaves one may meet the other at once."""
    rows = np.flatnonzero(reflects)
    if len(rows) == 0:
        return
    first, second, third = (placed.vertices.take(placed.triangles[rows, k], axis=0) for k in range(3))
    across = cross(second - first, third - first)
    size = dots(across, across)
    # Only what may be among the largest is sorted.
    large = np.flatnonzero(size >= np.partition(size, -LOOKED_AT)[-LOOKED_AT]) if len(rows) > LOOKED_AT else slice(None)
    rows = rows[large][np.argsort(-size[large], kind="stable")[:LOOKED_AT]]
    doubled = int((share_alone(placed.vertices[placed.triangles[rows]], placed.placement[rows]) < 0.5).sum())
    if doubled:
        findings.warn(f"{counted(doubled, 'triangle')} on top of others: as one with them here, less in renders; "
                      f"look for doubled faces, or objects")  # fmt: skip


def _name_flush(placed: PlacedTriangles, shines: np.ndarray, opaque: np.ndarray, findings: Findings) -> None:
    """Name shining triangles that lie in opaque ones which do not shine: whether a ray meets either is chance."""
    dark = np.flatnonzero(opaque & ~shines)
    if not shines.any() or len(dark) == 0:
        return
    corners, shining = placed.vertices[placed.triangles[dark]], placed.vertices[placed.triangles[shines]]
    # What shines is small in most scenes, and only few triangles reach into the box around it.
    low, high = shining.min(axis=(0, 1)), shining.max(axis=(0, 1))
    margin = 1e-3 * (high - low).max()
    reach = ((corners.max(axis=1) >= low - margin) & (corners.min(axis=1) <= high + margin)).all(axis=1)
    if not reach.any():
        return
    flush = int(flush_with(RayCaster(corners[reach], corners.reshape(-1, 3)), shining).sum())
    if flush:
        findings.warn(f"{counted(flush, 'triangle')} that shine lie in other faces: move them a little off, or renders "
                      f"show anything between none and all of their light")  # fmt: skip


def _name_patterns(read: RenderedObjects, placed: PlacedTriangles, findings: Findings) -> None:
    """Name materials with patterns on faces that are large in the scene, since a triangle has one value here."""
    if not read.optics.uneven:
        return
    size = np.ptp(np.percentile(placed.vertices, (5, 95), axis=0), axis=0).max()
    corners = placed.vertices[placed.triangles]
    large = placed.rows[(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2) > LARGE * size).any(axis=1)]
    for name, rows in read.optics.uneven:
        if np.isin(large, rows).any():
            findings.warn("patterns on large faces count as one colour a triangle in {}", "material", name)


def _targets(
    read: RenderedObjects, scene: Scene, domain: str, fit: str, kept: KeptPlaces | None
) -> tuple[tuple[BakeTarget, ...], SettledPoints, PlacedFaces | None]:
    """The objects to bake, and the estimation points of all of them, on faces or at their corners."""
    surfaces = [read.surfaces[target.surface] for target in read.targets]
    points, shown = [target.points for target in read.targets], None
    if fit == "faces":
        names = [(target.object_name, target.library) for target in read.targets]
        shown = placed_faces(points, surfaces, domain, drawn_anew if kept is None else partial(kept.drawn, names))
        count = len(shown.centres)
        nowhere, seen = np.zeros((count, 3)), np.zeros(count, bool)
        settled = SettledPoints(shown.rows, shown.centres, shown.normals, shown.facing, nowhere, seen)
    else:
        settled = settled_points(points, surfaces, scene, domain)
    starts = starts_of([len(surface.triangles) for surface in read.surfaces])
    colour, emission = read.optics.front.colour, read.optics.emission
    targets = []
    for some in batches([len(target.points.corners) for target in read.targets]):
        parts = read.targets[some]
        first = starts[[target.surface for target in parts]]
        means = (
            _element_means(parts, first, colour, DEFAULT_ALBEDO, domain),
            _element_means(parts, first, emission, 0.0, domain),
        )
        for target, rows, *values in zip(parts, settled.rows[some], *means, strict=True):
            surface, names = read.surfaces[target.surface], (target.object_name, target.library, target.mesh_name)
            rendered = len(surface.vertices), len(surface.triangles)
            targets.append(BakeTarget(*names, domain, rows, *values, rendered))
    return tuple(targets), settled, shown


def _element_means(
    targets: list[TargetPoints], first: np.ndarray, values: np.ndarray, missing: float, domain: str
) -> list[np.ndarray]:
    """Mean (E, 3) of ``values`` (all triangles, 3) over the triangles of each element of each of the K targets,
    ``missing`` where it has none; the triangles of a target's surface begin at ``first`` (K,).
    """
    points = [target.points for target in targets]
    elements, sizes = [each.corners for each in points], [len(each.rows) for each in points]
    if domain == "POINT":
        elements = [each.vertices[each.corners] for each in points]
        sizes = [target.vertex_count for target in targets]
    ends = starts_of(sizes)
    elements, triangles = numbered(elements, ends), numbered([each.triangles for each in points], first)
    means, known = group_means(values[triangles], elements, ends[-1])
    return np.split(np.where(known[:, None], means, missing), ends[1:-1])
