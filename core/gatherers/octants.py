"""The octants of directions that may arrive against a disc's normal."""

from __future__ import annotations

import numpy as np

OCTANTS = 8
# Components of normals below this count as zero. So that no crossing is lost, directions with a component below 8 times
# it, relative to the largest, belong to no octant: all others then have n.s > 1e-5 |s| for the discs that are left out,
# far from a change of sign.
FLAT = 1e-5


def facing_octants(normals: np.ndarray) -> np.ndarray:
    """Octants of directions (N,) uint8 that may arrive against ``normals`` (N, 3), one bit each.

    Bit o stands for directions whose component along axis a is negative where o has bit a.
    """
    against = normals < -FLAT, normals > FLAT
    octants = np.zeros(len(normals), np.uint8)
    for octant in range(OCTANTS):
        faces = against[octant & 1][:, 0] | against[octant >> 1 & 1][:, 1] | against[octant >> 2 & 1][:, 2]
        octants |= faces.astype(np.uint8) << octant
    return octants


def octants_of(step: np.ndarray) -> np.ndarray:
    """The octant (P,) int64 of each direction ``step`` (3, P)."""
    return (step[0] < 0) + 2 * (step[1] < 0) + 4 * (step[2] < 0).astype(np.int64)


def is_slanted(step: np.ndarray) -> np.ndarray:
    """Whether (P,) each direction ``step`` (3, P) is far enough from all axis planes to belong to one octant alone."""
    size = np.abs(step)
    return size.min(axis=0) > 8 * FLAT * size.max(axis=0)
