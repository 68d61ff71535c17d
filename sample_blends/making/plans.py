"""Ground plans for buildings: lines in x and y, and the faces of a height over some of their cells."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from .surfaces import Surface, steps


def lines(*stations: float, cell: float) -> np.ndarray:
    """Plan lines through all ``stations``, the spans between them diced into about ``cell`` metres."""
    spans = [steps(start, stop, cell)[:-1] for start, stop in pairwise(stations)]
    return np.concatenate([*spans, stations[-1:]])


def storey(x, y, wanted, height=None, material=None) -> Surface:
    """The surface z = ``height(x, y)`` (default 0), front upwards, over cells whose middle is ``wanted(x, y)``.

    ``material(x, y)`` gives each cell's slot. Cells are split along the diagonal on which the height is the
    greater, so that the groins of a vault become edges.
    """
    gx, gy = np.meshgrid(x, y, indexing="ij")
    gz = np.zeros_like(gx) if height is None else height(gx, gy)
    index = np.arange(gx.size).reshape(gx.shape)
    quads = np.stack([index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]], axis=-1).reshape(-1, 4)
    vertices = np.column_stack([gx.ravel(), gy.ravel(), gz.ravel()])
    middles = vertices[quads].mean(axis=1)
    keep = wanted(middles[:, 0], middles[:, 1])
    quads, middles = quads[keep], middles[keep]
    slots = np.zeros(len(quads), int) if material is None else material(middles[:, 0], middles[:, 1])
    if height is not None:
        z = vertices[quads, 2]
        other = (z[:, 1] + z[:, 3] > z[:, 0] + z[:, 2])[:, None]
        split = np.where(other, quads[:, [0, 1, 3, 1, 2, 3]], quads[:, [0, 1, 2, 0, 2, 3]])
        quads, slots = split.reshape(-1, 3), np.repeat(slots, 2)
    used, renumbered = np.unique(quads, return_inverse=True)
    return Surface(vertices[used], renumbered.reshape(quads.shape), slots)
