"""Light on the backs of faces: whether what is dark faces the wrong way."""

from __future__ import annotations

import numpy as np

from ..estimator.standpoints import Standpoints, standpoints
from ..rays import RayCaster
from ..scene import Scene
from ..settings import BakeSettings
from ..stages import finished
from .direct_light import DirectLight
from .lit_scene import LitScene
from .stands import Stands

#: rounds of shadow rays: enough to tell light from darkness
ROUNDS = 4


def lit_behind(
    scene: Scene, points: np.ndarray, normals: np.ndarray, facing: np.ndarray, inward: np.ndarray
) -> np.ndarray:
    """Direct irradiance (N,) W/m^2, RGB sum, at ``points`` (N, 3) on the side against their ``normals`` (N, 3).

    ``facing`` (N, 3) are the unit normals of their faces, and ``inward`` (N, 3) metres leads from points on an edge
    into those.
    """
    caster = RayCaster(scene.corners, points)
    places = Standpoints.joined(list(standpoints(caster, points, -facing, inward)))
    stands = Stands(points, places.origins, -facing)
    light = DirectLight(LitScene(scene, caster), stands, -normals, BakeSettings())
    finished(light.rounds(0, ROUNDS))
    return np.abs(light.irradiance.value).sum(axis=1)
