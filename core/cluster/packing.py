"""What travels between the processes of a bake, see ``core/packing.py``; on this machine as messages: each is a tuple,
packed, after the number of its bytes."""

from __future__ import annotations

import socket

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
KINDS = (
    AreaLight, BakeSettings, Bounds, CastPiece, CrossingSums, EnvironmentWorld, PhotonPiece, PieceSums, PointGroups,
    PointLight, Points, Scene, Specular, SpotLight, Standpoints, Stands, SunLight, TangentDiscs, UniformWorld,
)  # fmt: skip


def packed(value) -> np.ndarray:
    """``value`` as bytes, (B,) uint8. Raises ClusterError on what cannot travel."""
    try:
        return packing.packed(value, KINDS)
    except TypeError as error:
        raise ClusterError(f"A {error} cannot be sent to the workers.") from None


def unpacked(data: np.ndarray):
    """What was :func:`packed` into ``data`` (B,) uint8; its arrays are views of that. Raises ClusterError."""
    try:
        return packing.unpacked(data, KINDS)
    except ValueError as error:
        raise ClusterError("What came over the network is no part of a bake.") from error


def send(to: socket.socket, message: tuple) -> None:
    """Send ``message``, a tuple of text, text in tuples and arrays, as a whole. Raises OSError when nobody listens."""
    data = packed(message)
    to.sendall(len(data).to_bytes(8, "little"))
    to.sendall(data.data)


def received(at: socket.socket) -> tuple:
    """The next message, which is waited for. Raises EOFError at the end of them, OSError when it is broken off."""
    return unpacked(exactly(at, int.from_bytes(exactly(at, 8), "little")))


def exactly(at: socket.socket, size: int) -> np.ndarray:
    """The next ``size`` bytes, uint8; raises as :func:`received`."""
    data = np.empty(size, np.uint8)
    left = memoryview(data)
    while left:
        # Asked for all, the system puts it together while this process goes on with its work.
        count = at.recv_into(left, 0, socket.MSG_WAITALL)
        if count == 0:
            raise EOFError
        left = left[count:]
    return data
