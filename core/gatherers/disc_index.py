"""Disc Indexing: each segment descends a balanced tree over the discs, into the nodes that it meets on its way."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..discs import TangentDiscs
from .balanced_tree import BRANCHES, BalancedTree, Halves
from .gatherer import Counts
from .local_frame import MARGIN, Pieces
from .patch_search import PatchSearch
from .patches import Stretches

SEGMENTS = 1 << 16  # most segments that descend together
LEAF = 8  # most discs of a leaf
BLOCK = 1 << 14  # pairs of a piece and a node looked at together
_LARGE = np.float32(1e30)

OCTANTS = 8  # of directions that may arrive against a disc's normal
# Components of normals below this count as zero. So that no crossing is lost, directions with a component below 8 times
# it, relative to the largest, belong to no octant: all others then have n.s > 1e-5 |s| for the discs that are left out,
# far from a change of sign.
FLAT = 1e-5


class DiscIndex(PatchSearch):
    """The study's second gatherer: boxes around discs and around their normals, halved along the longest side.

    The roots keep the discs apart by the axis and side that their normals point to, so that whole walls are
    left out at once by the segments that cannot face them.

    discs   the TangentDiscs to search
    halves  where to cut, see BalancedTree.over; None: in the middle, which keeps the tree balanced
    """

    name = "disc-index"

    def __init__(self, discs: TangentDiscs, halves: Halves | None = None):
        tree = BalancedTree.over(discs.centres, _sides(discs), LEAF, halves)
        ordered = discs.taken(tree.order)
        super().__init__(ordered, tree.order, SEGMENTS)
        if len(discs) == 0:
            return
        leaves = tree.leaves
        self._patch(ordered, np.arange(len(discs)), tree.start[leaves])
        self._child, self._roots = tree.child, int(tree.levels[1])
        self._leaf = np.full(len(tree.child), -1)
        self._leaf[leaves] = np.arange(len(leaves))
        extent = discs.extents
        low = tree.bounds(self._frame.local(discs.centres - extent) - MARGIN, np.minimum).astype(np.float32)
        high = tree.bounds(self._frame.local(discs.centres + extent) + MARGIN, np.maximum).astype(np.float32)
        octants = tree.bounds(facing_octants(discs.normals)[:, None], np.bitwise_or)[:, 0]
        self._boxes = _mirrored_boxes(low, high, octants)

    def _stretches(self, pieces: Pieces, counts: Counts | None) -> Iterator[Stretches]:
        """Where the pieces meet leaves, many of them together."""
        held: list[Stretches] = []
        for leaves in self._leaves(pieces, counts):
            held.append(leaves)
            if sum(map(len, held)) >= BLOCK:
                yield Stretches.joined(held)
                held = []
        if held:
            yield Stretches.joined(held)

    def _leaves(self, pieces: Pieces, counts: Counts | None) -> Iterator[Stretches]:
        """Descend depth first, in blocks of pairs, so that only the blocks beside the path are waiting."""
        octant = octants_of(pieces.step)
        offset = np.where(is_slanted(pieces.step), octant, OCTANTS + octant) * len(self._child)
        rays = _mirrored_rays(pieces)
        for begin in range(0, len(offset), BLOCK):
            # The roots stand side by side, as the children of every inner node do.
            piece = np.arange(begin, min(begin + BLOCK, len(offset)))
            waiting, siblings = [(piece, np.zeros(len(piece), np.int64))], self._roots
            while waiting:
                piece, node = _last_pairs(waiting)
                if counts is not None:
                    counts.note("nodes", siblings * len(node))
                met = self._met(rays, offset, piece, node, siblings)
                child = self._child.take(met.patch)
                leaves = met.taken(np.flatnonzero(child < 0))
                if len(leaves):
                    yield Stretches(leaves.piece, self._leaf.take(leaves.patch), leaves.first, leaves.last)
                inner = np.flatnonzero(child >= 0)
                piece, node, siblings = met.piece.take(inner), child.take(inner), BRANCHES
                waiting += [(piece[at : at + BLOCK], node[at : at + BLOCK]) for at in range(0, len(node), BLOCK)]

    def _met(
        self, rays: np.ndarray, offset: np.ndarray, piece: np.ndarray, node: np.ndarray, siblings: int
    ) -> Stretches:
        """Where each ``piece`` passes the boxes of ``siblings`` side by side, the first of which is ``node``, in a
        direction that something in them may face."""
        start, inverse = rays[0].take(piece, axis=0), rays[1].take(piece, axis=0)
        box, met = node + offset.take(piece), []
        for sibling in range(siblings):
            time = self._boxes[sibling:].take(box, axis=0)
            time -= start
            time *= inverse
            first = np.maximum(time[:, 0], time[:, 1])
            np.maximum(first, time[:, 2], out=first)
            np.maximum(first, np.float32(0.0), out=first)
            last = np.minimum(time[:, 4], time[:, 5])
            np.minimum(last, time[:, 6], out=last)
            np.minimum(last, np.float32(1.0), out=last)
            kept = np.flatnonzero(first <= last)
            met.append(Stretches(piece.take(kept), sibling + node.take(kept), first.take(kept), last.take(kept)))
        return Stretches.joined(met)


def _sides(discs: TangentDiscs) -> np.ndarray:
    """Which of the six axis directions each normal is closest to, (N,) int64 in 0..5."""
    axis = np.abs(discs.normals).argmax(axis=1)
    return 2 * axis + (np.take_along_axis(discs.normals, axis[:, None], axis=1)[:, 0] < 0)


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


def _mirrored_boxes(low: np.ndarray, high: np.ndarray, octants: np.ndarray) -> np.ndarray:
    """Boxes (16 * K, 8) as low x, y, z, 0, high x, y, z, 0 for the directions of each octant.

    Mirrored, so that all directions of the octant go towards greater x, y and z and enter by the low side.
    For the first eight octants a box without anything that faces them is empty; the other eight keep all.
    """
    boxes = np.zeros((2 * OCTANTS, len(low), 8), np.float32)
    for octant in range(OCTANTS):
        for axis in range(3):
            near, far = (high, low) if octant >> axis & 1 else (low, high)
            sign = np.float32(-1.0 if octant >> axis & 1 else 1.0)
            boxes[octant::OCTANTS, :, axis] = sign * near[:, axis]
            boxes[octant::OCTANTS, :, axis + 4] = sign * far[:, axis]
        boxes[octant, (octants >> octant & 1) == 0, :3] = np.inf
    return boxes.reshape(-1, 8)


def _mirrored_rays(pieces: Pieces) -> np.ndarray:
    """Start and inverse step (2, P, 8), laid out and mirrored as the boxes of the pieces' octants."""
    rays = np.zeros((2, len(pieces.segment), 8), np.float32)
    with np.errstate(divide="ignore", over="ignore"):
        inverse = np.minimum(np.float32(1.0) / np.abs(pieces.step), _LARGE)
    rays[0, :, :3] = rays[0, :, 4:7] = np.where(pieces.step < 0, -pieces.start, pieces.start).T
    rays[1, :, :3] = rays[1, :, 4:7] = inverse.T
    return rays


def _last_pairs(waiting: list[tuple[np.ndarray, np.ndarray]]) -> tuple[np.ndarray, np.ndarray]:
    """Take the last pairs off the list, up to BLOCK of them, so that no block is too small for its overhead."""
    taken = [waiting.pop()]
    while waiting and sum(len(piece) for piece, _ in taken) + len(waiting[-1][0]) <= BLOCK:
        taken.append(waiting.pop())
    pieces, nodes = zip(*taken, strict=True)
    return np.concatenate(pieces), np.concatenate(nodes)
