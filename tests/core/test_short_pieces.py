"""Large triangles in pieces: short ones, the whole of each triangle, no gaps between neighbours, and not too many."""

import numpy as np
import pytest
from detp.core.short_pieces import short_pieces

CENTRE, NEAREST = np.zeros(3), 0.25


def pair(generator, length, height, third):
    """Two triangles on one edge of ``length``, turned any way near the origin: one as high as ``height`` over the
    share ``third`` of it, one as high as long."""
    flat = np.array([(0, 0, 0), (length, 0, 0), (third * length, height, 0), (0.4 * length, -length, 0)])
    flat += (-generator.uniform(0.2, 0.8) * length, *generator.uniform(-2, 2, 2))
    places = flat @ np.linalg.qr(generator.normal(size=(3, 3)))[0]
    return places[[(0, 1, 2), (1, 0, 3)]]


def areas(triangles):
    return 0.5 * np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1)


@pytest.mark.parametrize("third", [-1e-7, 0.0, 1e-6, 0.5, 1.0])
@pytest.mark.parametrize("length, height", [(1e3, 1.0), (1e5, 1e-3), (1e9, 100.0), (1e9, 1e5)])
def test_pieces_are_few_and_short_and_make_up_their_triangles_without_gaps(length, height, third):
    generator = np.random.default_rng(3)
    for _ in range(2):
        corners = pair(generator, length, height, third)
        pieces, owner = short_pieces(corners, CENTRE, NEAREST)
        assert len(pieces) < 10_000
        edges = np.linalg.norm(np.roll(pieces, -1, axis=1) - pieces, axis=2)
        nearest = np.abs(pieces).max(axis=2).min(axis=1)
        assert (edges.max(axis=1) <= 2 * nearest + NEAREST).all()
        assert np.allclose(np.bincount(owner, areas(pieces)), areas(corners), rtol=1e-6)
        # An edge of a piece belongs to two of them, unless it lies on one of the four edges that are free.
        places, names = np.unique(pieces.reshape(-1, 3), axis=0, return_inverse=True)
        names = names.reshape(-1, 3)
        sides = np.sort(np.stack([names, np.roll(names, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
        each, times = np.unique(sides, axis=0, return_counts=True)
        assert times.max() == 2
        free = np.delete(corners[:, [(0, 1), (1, 2), (2, 0)]].reshape(-1, 2, 3), [0, 3], axis=0)
        alone = places[each[times == 1]]
        assert len(alone) == sum(_are_on(line, alone).sum() for line in free)


def _are_on(line, edges):
    """Which of ``edges`` (E, 2, 3) lie on the ``line`` (2, 3) but for rounding."""
    way = line[1] - line[0]
    off = np.linalg.norm(np.cross(edges - line[0], way / np.linalg.norm(way)), axis=2)
    return (off <= 1e-12 * np.linalg.norm(way)).all(axis=1)
