"""Cycles' light at any places of the open scene, not only where its meshes have corners.

Each place is a tiny triangle of an object that no path meets (detp_addon/tradeoff/face_copies.py), plain diffuse, whose
corners Cycles bakes: exactly there, with the normal that is asked for.
"""

import bpy
import numpy as np
from detp.core.sampling import frames
from detp.detp_addon.tradeoff.cycles_bake import bake_with_cycles, light_of, set_up_cycles
from detp.detp_addon.tradeoff.face_copies import CopiedFaces, copy_in

#: Size of the triangles and, of places on surfaces, their height: in steps of single precision, in which Cycles works.
#: The corners' rounding turns a triangle by a hundredth or two then, which shows in no more than its square.
STEPS = 32


def clearance(places: np.ndarray, least: float = 0.0) -> np.ndarray:
    """How far (K,) off a surface paths may start at ``places`` (K, 3) or, of triangles, (K, 3, 3), Blender's units.

    In a scene near the origin, see ``centred`` of face_copies.py. ``least`` is the coordinate that counts at least.
    """
    size = np.abs(places).reshape(len(places), -1).max(axis=1, initial=0.0)
    return STEPS * np.spacing(np.maximum(size, least).astype(np.float32)).astype(float)


def light_at(places: np.ndarray, normals: np.ndarray, samples: int, facing: np.ndarray | None = None) -> np.ndarray:
    """E/pi (2, K, 3) at ``places`` (K, 3), clear of surfaces, as Cycles finds it with two seeds.

    ``normals`` (K, 3) unit are those of shading; ``facing`` (K, 3) those of the faces, below which no light comes; None
    when they are the same. Each seed takes about so many ``samples`` at a place. The scene's render settings change.
    """
    if len(places) == 0:
        return np.zeros((2, 0, 3))
    scene = bpy.context.scene
    set_up_cycles(scene)
    size = clearance(places, 1e-3 * np.abs(places).max())
    first, second = frames(normals if facing is None else facing)
    angles = np.arange(3) * 2.0 * np.pi / 3.0
    around = np.cos(angles)[:, None] * first[:, None] + np.sin(angles)[:, None] * second[:, None]
    corners = (places[:, None] + size[:, None, None] * around).reshape(-1, 3)
    triangles = CopiedFaces(corners, np.repeat(normals, 3, axis=0), np.full(len(places), 3))
    halves = []
    with copy_in(scene, triangles) as copy:
        for seed in (1, 2):
            bake_with_cycles([copy], max(1, round(samples / 3)), seed)
            halves.append(light_of(copy).reshape(-1, 3, 3).mean(axis=1))
    return np.array(halves)
