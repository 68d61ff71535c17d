"""What travels between the processes of a bake, see ``core/packing.py``."""

from __future__ import annotations

import numpy as np

from .. import packing
from ..bounds import Bounds
from ..direct.cast_piece import CastPiece
from ..direct.point_groups import PointGroups
from ..direct.stands import Stands
from ..discs import TangentDiscs
from ..errors import ClusterError
from ..estimator.crossing_sums import CrossingSums
from ..estimator.standpoints import Standpoints
from ..lights.area import AreaLight
from ..lights.environment import EnvironmentWorld
from ..lights.point import PointLight
from ..lights.spot import SpotLight
from ..lights.sun import SunLight
from ..lights.world import UniformWorld
from ..photons.photon_light import PhotonPiece, PieceSums
from ..photons.specular import Specular
from ..points import Points
from ..scene import Scene
from ..settings import BakeSettings

#: classes of which objects may travel
_KINDS = (
    AreaLight, BakeSettings, Bounds, CastPiece, CrossingSums, EnvironmentWorld, PhotonPiece, PieceSums, PointGroups,
    PointLight, Points, Scene, Specular, SpotLight, Standpoints, Stands, SunLight, TangentDiscs, UniformWorld,
)  # fmt: skip


def packed(value) -> np.ndarray:
    """``value`` as bytes, (B,) uint8. Raises ClusterError on what cannot travel."""
    try:
        return packing.packed(value, _KINDS)
    except TypeError as error:
        raise ClusterError(f"A {error} cannot be sent to the workers.") from None


def unpacked(data: np.ndarray):
    """What was :func:`packed` into ``data`` (B,) uint8; its arrays are views of that. Raises ClusterError."""
    try:
        return packing.unpacked(data, _KINDS)
    except ValueError as error:
        raise ClusterError("What came over the network is no part of a bake.") from error
