"""Places on the faces that bakes colour, with Cycles' light there."""

import hashlib
from dataclasses import dataclass, replace
from pathlib import Path

import bpy
import numpy as np
from cycles_places import clearance, light_at
from detp.core.estimator.enclosure import enclosed
from detp.core.group_sums import group_means
from detp.core.rays import RayCaster
from detp.core.sampling import cosine_hemisphere, triangle
from detp.core.triangles import normals_and_areas
from detp.detp_addon.reading.read_scene import read_scene
from detp.detp_addon.tradeoff.face_copies import CopiedFaces, centred, render_faces
from detp.detp_addon.units import metres_per_unit
from shown_faces import shown_faces

#: A place can be seen when at least this share of so many rays by the cosine is free over ROOM scene radii, and it does
#: not look at the insides of closed geometry.
RAYS, FREE_SHARE, ROOM = 64, 1 / 16, 0.05


@dataclass(frozen=True)
class Places:
    """K places on faces, in G groups that are each compared as one.

    names     (O,) of objects, and ``object`` (K,) which of them each place is on
    positions (K, 3) and facing (K, 3), the unit normals of the faces, in Blender's units in world space
    group     (K,) of each place, and ``area`` (G,) that it stands for
    light     (2, G, 3) E/pi, as two seeds found it
    """

    names: np.ndarray
    object: np.ndarray
    positions: np.ndarray
    facing: np.ndarray
    group: np.ndarray
    area: np.ndarray
    light: np.ndarray

    def of_groups(self, values: np.ndarray) -> np.ndarray:
        """The means (G, 3) of ``values`` (K, 3)."""
        return means(values, self.group, len(self.area))

    def taken(self, groups: np.ndarray) -> "Places":
        """Those of the groups of a mask (G,)."""
        kept = groups[self.group]
        parts = (values[kept] for values in (self.object, self.positions, self.facing))
        group = (np.cumsum(groups) - 1)[self.group[kept]]
        return Places(self.names, *parts, group, self.area[groups], self.light[:, groups])


def cycles_places(scene: Path, file: Path, count: int, samples: int) -> Places:
    """Those of ``count`` places, drawn over all faces of the open ``scene``, that can be seen.

    ``file`` keeps them; when there is none, Cycles bakes them with about so many ``samples`` a seed.
    """
    key = hashlib.sha256(scene.read_bytes()).hexdigest()[:16]
    if file.exists():
        with np.load(file) as arrays:
            if str(arrays["key"]) != key:
                raise SystemExit(f"'{file}' belongs to another scene: name another file.")
            return Places(*(arrays[name] for name in Places.__dataclass_fields__))
    places, normals = drawn_places(count)
    # Cycles computes in single precision, so what is far away comes nearer.
    points = CopiedFaces(places.positions, normals, np.ones(len(normals), int))
    near, radius = centred(bpy.context.scene, {"": points})
    starts = near[""].corners
    starts = starts + clearance(starts, 1e-3 * radius)[:, None] * places.facing
    places = replace(places, light=light_at(starts, normals, samples, places.facing))
    np.savez_compressed(file, key=np.array(key), samples=np.array(samples), **vars(places))
    return places


def given_places(file: str) -> Places:
    """The places of a file of corners, that were moved nine tenths of their way to the middles of their faces.

    A face is a group. Those that cannot be seen are left out.
    """
    caster, _, unit = _geometry()
    arrays = np.load(file)
    names = list(dict.fromkeys(key.rsplit("|", 1)[0] for key in arrays if key[:2] != "__"))
    rendered = render_faces(bpy.context.scene, bpy.context.view_layer, names)
    parts, lights = [], []
    for name in names:
        light = np.array([arrays[f"{name}|{seed}"] for seed in (1, 2)], float)
        if light.shape[1] != len(rendered[name].corners):
            raise SystemExit(f"'{file}' belongs to another scene: '{name}' has other faces.")
        there = np.isfinite(light).all(axis=(0, 2))
        faces = np.bincount(rendered[name].face, there, len(rendered[name].sizes)) == rendered[name].sizes
        parts.append(rendered[name].taken(faces))
        lights.append(light[:, faces[rendered[name].face]])
    faces, light = CopiedFaces.joined(parts), np.concatenate(lights, axis=1)
    count, face = len(faces.sizes), faces.face
    owner = np.repeat(np.arange(len(names)), [len(part.corners) for part in parts])
    middles = means(faces.corners, face, count)
    vectors = _area_vectors(faces, middles)
    area = np.linalg.norm(vectors, axis=1)
    facing = (vectors / np.maximum(area, 1e-300)[:, None])[face]
    inside = 0.1 * faces.corners + 0.9 * middles[face]
    of_faces = np.array([means(half, face, count) for half in light])
    places = Places(np.array(names), owner, inside, facing, face, area, of_faces)
    free = seen(caster, unit * inside, facing)
    return places.taken(np.bincount(face, free, count) > 0.5 * faces.sizes)


def means(values: np.ndarray, groups: np.ndarray, count: int) -> np.ndarray:
    """The mean (count, 3) of the ``values`` (K, 3) of each of the ``groups`` (K,)."""
    return group_means(values, groups, count)[0]


def seen(caster: RayCaster, positions: np.ndarray, facing: np.ndarray) -> np.ndarray:
    """Whether (K,) somebody could see ``positions`` (K, 3) in metres on faces with normals ``facing`` (K, 3)."""
    radius = caster.radius
    off = np.maximum(clearance(positions - caster.centre, 1e-3 * radius), 4 * caster.tolerance(positions))
    origins = positions + off[:, None] * facing
    reach, free = np.full(len(positions), ROOM * radius), np.zeros(len(positions))
    generator = np.random.default_rng(0)
    for _ in range(RAYS):
        directions = cosine_hemisphere(facing, generator.random((len(positions), 2)))
        free += ~caster.occluded(origins, directions, reach)
    return (free >= FREE_SHARE * RAYS) & ~enclosed(caster, origins, facing)


def drawn_places(count: int) -> tuple[Places, np.ndarray]:
    """Of ``count`` places in proportion to area those that can be seen, without light; and the normals of shading."""
    caster, names, unit = _geometry()
    surfaces = [*shown_faces(names).values()]
    corners, normals = (np.concatenate([getattr(faces, part) for faces in surfaces]) for part in ("corners", "normals"))
    owner = np.repeat(np.arange(len(names)), [len(faces.corners) for faces in surfaces])
    directions, areas = normals_and_areas(corners)
    ends, generator = np.cumsum(areas), np.random.default_rng(0)
    # Evenly along the sum of areas, so that each face gets its share.
    rows = np.searchsorted(ends, (np.arange(count) + generator.random(count)) * (ends[-1] / count))
    rows = np.minimum(rows, len(corners) - 1)
    weights = triangle(generator.random((count, 2)))
    positions, shading = (np.einsum("kc,kcx->kx", weights, values[rows]) for values in (corners, normals))
    kept = np.flatnonzero(seen(caster, unit * positions, directions[rows]))
    rows, positions, shading = rows[kept], positions[kept], shading[kept]
    shading = shading / np.maximum(np.linalg.norm(shading, axis=1), 1e-30)[:, None]
    each = np.full(len(kept), ends[-1] / count)
    unknown = np.zeros((2, len(kept), 3))
    groups = np.arange(len(kept))
    return Places(np.array(names), owner[rows], positions, directions[rows], groups, each, unknown), shading


def _geometry() -> tuple[RayCaster, list[str], float]:
    """What rays meet in the open scene, in metres; names of what a bake colours; metres in one of Blender's units."""
    scene = bpy.context.scene
    read = read_scene(scene, bpy.context.view_layer, None, "CORNER")
    names = [target.object_name for target in read.targets if target.library is None]
    return RayCaster(read.scene.corners), names, metres_per_unit(scene)


def _area_vectors(faces: CopiedFaces, middles: np.ndarray) -> np.ndarray:
    """The normals (F, 3) of the faces around their ``middles`` (F, 3), as long as their areas, by Newell's sum."""
    ends = np.cumsum(faces.sizes)
    following = np.arange(1, len(faces.corners) + 1)
    following[ends - 1] = ends - faces.sizes
    spokes = faces.corners - middles[faces.face]
    crosses = means(np.cross(spokes, spokes[following]), faces.face, len(faces.sizes))
    return 0.5 * faces.sizes[:, None] * crosses
