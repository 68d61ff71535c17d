"""Large triangles in pieces that are small beside their distance from where coordinates are most exact."""

from __future__ import annotations

import numpy as np

from .parallel import slices

#: Triangles that are worked on in one array.
TRIANGLES_AT_ONCE = 1 << 17

#: Pieces are no longer than this share of their distance from the centre: on which side of a triangle a place lies is
#: only as exact as the triangle is small.
LONGEST = 1.0

#: Triangles of so many times the shortest length that may be too long, and whose height is a smaller share of it than
#: that, are cut across: of needles and of those whose corners are nearly in a line halves go on lying side by side, so
#: that each halving of their length gives thrice as many.
EXTENDED, SLIM = 256.0, 2.0**-10

#: How often triangles are halved at most, and how many pieces there may be beyond as many as there are triangles.
MOST_HALVINGS, MOST_PIECES = 80, 1 << 20


def short_pieces(corners: np.ndarray, centre: np.ndarray, nearest: float) -> tuple[np.ndarray, np.ndarray]:
    """Pieces (P, 3, 3) of the triangles ``corners`` (T, 3, 3) whose edges are short beside their distance from the
    ``centre`` (3,), and the triangle (P,) of each. Distances count ``nearest`` metres more.

    Edges that are too long are halved, again and again, in both their triangles, so that there are no gaps.
    """
    pieces, owner, done = corners, np.arange(len(corners)), []
    for _ in range(MOST_HALVINGS):
        edges = np.concatenate([_long_edges(pieces[some], centre, nearest) for some in _parts(len(pieces))])
        rows = np.flatnonzero(edges >= 0)
        if len(rows) == 0 or 2 * len(rows) > MOST_PIECES:
            break
        kept = np.flatnonzero(edges < 0)
        done.append((pieces[kept], owner[kept]))
        needles = _are_needles(pieces[rows], EXTENDED * nearest)
        across, row = _cut_across(pieces[rows[needles]], centre, nearest)
        across_owner, rows = owner[rows[needles]][row], rows[~needles]
        a, b, c = (pieces[rows, (edges[rows] + step) % 3] for step in range(3))
        middle = 0.5 * (a + b)
        pieces = np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1), across])
        owner = np.concatenate([owner[rows], owner[rows], across_owner])
    if not done:
        return pieces, owner
    done.append((pieces, owner))
    return tuple(map(np.concatenate, zip(*done, strict=True)))


def _long_edges(pieces: np.ndarray, centre: np.ndarray, nearest: float) -> np.ndarray:
    """The longest (P,) of the edges of each of ``pieces`` (P, 3, 3) that are too long, -1 where none is."""
    lengths, long = _lengths(pieces, np.roll(pieces, -1, axis=1), centre, nearest)
    return np.where(long.any(axis=1), np.where(long, lengths, 0.0).argmax(axis=1), -1)


def _lengths(starts: np.ndarray, ends: np.ndarray, centre: np.ndarray, nearest: float) -> tuple[np.ndarray, np.ndarray]:
    """The lengths (...) of edges between ``starts`` and ``ends`` (..., 3), and whether they are too long (...)."""
    lengths = np.linalg.norm(ends - starts, axis=-1)
    beside = np.maximum(np.minimum(starts, ends) - centre, centre - np.maximum(starts, ends))
    return lengths, lengths > LONGEST * (np.maximum(beside, 0.0).max(axis=-1) + nearest)


def _are_needles(pieces: np.ndarray, shortest: float) -> np.ndarray:
    """Which (P,) of ``pieces`` (P, 3, 3), each longer than a point, are longer than ``shortest`` but hardly high."""
    edges = np.roll(pieces, -1, axis=1) - pieces
    longest = np.linalg.norm(edges, axis=2).max(axis=1)
    edges /= longest[:, None, None]
    return (longest > shortest) & (np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1) < SLIM)


def _cut_across(needles: np.ndarray, centre: np.ndarray, nearest: float) -> tuple[np.ndarray, np.ndarray]:
    """Pieces (P, 3, 3) of ``needles`` (S, 3, 3), none of whose own edges is too long, and of which (P,) each is.

    From one end to the other the longest side and the two beside it go on to their next place by turns, whichever has
    it nearer; each such step and the place where the other is make a piece.
    """
    along = np.roll(needles, -1, axis=1) - needles
    longest = np.linalg.norm(along, axis=2).argmax(axis=1)
    every = np.arange(len(needles))
    first, last, third = (needles[every, (longest + step) % 3] for step in range(3))
    starts, ends, line = _halved(
        np.stack([first, first, third], axis=1).reshape(-1, 3),
        np.stack([last, third, last], axis=1).reshape(-1, 3),
        centre,
        nearest,
    )
    row, beside = line // 3, line % 3 > 0
    order = np.lexsort((np.einsum("ij,ij->i", ends - centre, (last - first)[row]), row))
    # Rounding changes nothing about the order of the steps along one side.
    turns = beside[order]
    order[turns], order[~turns] = np.flatnonzero(beside), np.flatnonzero(~beside)
    starts, ends, row = starts[order], ends[order], row[order]
    steps = np.arange(len(order))
    latest = np.where(turns, *(np.maximum.accumulate(np.where(side, steps, -1)) for side in (~turns, turns)))
    begun = (latest >= 0) & (row[latest] == row)
    others = np.where(begun[:, None], ends[latest], first[row])
    whole = (others != starts).any(axis=1) & (others != ends).any(axis=1)
    return np.stack([starts, ends, others], axis=1)[whole], row[whole]


def _halved(
    starts: np.ndarray, ends: np.ndarray, centre: np.ndarray, nearest: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The parts of lines from ``starts`` to ``ends`` (L, 3), in order, that are left when all that are too long are
    halved: their own starts and ends (E, 3), and the line (E,) of each."""
    line = np.arange(len(starts))
    for _ in range(MOST_HALVINGS):
        long = _lengths(starts, ends, centre, nearest)[1]
        if not long.any():
            break
        middle = 0.5 * (starts[long] + ends[long])
        times = 1 + long
        starts, ends, line = (np.repeat(each, times, axis=0) for each in (starts, ends, line))
        second = (np.cumsum(times) - 1)[long]
        starts[second], ends[second - 1] = middle, middle
    return starts, ends, line


def _parts(count: int) -> list[slice]:
    """Slices of so many triangles as are worked on in one array, one at least."""
    return slices(count, TRIANGLES_AT_ONCE) or [slice(0, 0)]
