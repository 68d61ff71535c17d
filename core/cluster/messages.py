"""Messages between processes of this machine: each is a tuple, packed, after the number of its bytes."""

from __future__ import annotations

import socket

import numpy as np

from .packing import packed, unpacked


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
