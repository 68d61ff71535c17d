"""Low-discrepancy numbers: few of them, spread evenly over the unit square."""

from __future__ import annotations

import numpy as np

from ..lights.light import SHADOW_DIMENSIONS

_BITS = 32


def nets(count: int, samples: int, generator: np.random.Generator) -> np.ndarray:
    """Pairs (samples * count, 2): for each of some ``samples`` a net of its own of ``count`` points."""
    shifts = generator.integers(0, 1 << 32, (samples, SHADOW_DIMENSIONS), np.uint32)
    return scrambled_net(count, shifts).reshape(-1, SHADOW_DIMENSIONS)


def scrambled_net(count: int, shifts: np.ndarray) -> np.ndarray:
    """For each of ``shifts`` (K, 2) uint32, ``count`` points (K, count, 2) in [0, 1)^2.

    With ``count`` a power of two each set is a (0, m, 2)-net in base 2: every dyadic box of area 1 / count holds one
    point. With random shifts each point is uniform, so means over a net are unbiased, and different shifts give
    independent nets. Source: the first two dimensions of Sobol's sequence, randomised by digital shifts (Kollig and
    Keller, "Efficient Multidimensional Sampling", Computer Graphics Forum 21(3), 2002).
    """
    net = _first_points(count)
    return (net[None, :, :] ^ shifts[:, None, :]) * 2.0**-_BITS


def _first_points(count: int) -> np.ndarray:
    """The first points (count, 2) of Sobol's sequence, as 32-bit fractions."""
    numbers = np.arange(count, dtype=np.uint32)
    points = np.zeros((count, 2), np.uint32)
    directions = np.array([1 << (_BITS - 1)] * 2, np.uint32)
    for bit in range(max(count - 1, 1).bit_length()):
        chosen = ((numbers >> np.uint32(bit)) & np.uint32(1)).astype(bool)
        points[chosen] ^= directions
        directions[0] >>= np.uint32(1)
        directions[1] ^= directions[1] >> np.uint32(1)
    return points
