"""Random numbers of objects and of the connected parts of meshes, the same as Cycles gives them."""

from __future__ import annotations

import numpy as np

_MOST = 0xFFFFFFFF


def island_numbers(mesh) -> np.ndarray:
    """A number from 0 to 1 (V,) for each vertex, the same over all that edges connect.

    Cycles hashes the vertex that stands for a part once its edges are united by rank in their order.
    """
    edges = np.empty(2 * len(mesh.edges), np.int32)
    mesh.edges.foreach_get("vertices", edges)
    parents, ranks = list(range(len(mesh.vertices))), [0] * len(mesh.vertices)

    def root(vertex: int) -> int:
        while parents[vertex] != vertex:
            parents[vertex] = vertex = parents[parents[vertex]]
        return vertex

    for one, other in zip(edges[0::2].tolist(), edges[1::2].tolist(), strict=True):
        one, other = root(one), root(other)
        if one != other:
            if ranks[one] < ranks[other]:
                one, other = other, one
            parents[other] = one
            ranks[one] += ranks[one] == ranks[other]
    roots = np.array([root(vertex) for vertex in range(len(parents))], np.uint32)
    return hashed(roots) / float(_MOST)


def object_number(name: str) -> float:
    """A number from 0 to 1 for the object of that ``name``."""
    number = 0
    for byte in name.encode():
        number = (number * 37 + byte) & _MOST
    return float(hashed(np.array([number], np.uint32), np.zeros(1, np.uint32))[0]) / _MOST


def hashed(*numbers: np.ndarray) -> np.ndarray:
    """A hash (n,) of 32 bits of one or two ``numbers`` (n,) of 32 bits each: Jenkins' lookup3, 2006."""
    start = np.full(len(numbers[0]), 0xDEADBEEF + (len(numbers) << 2) + 13, np.uint32)
    words = [start + number for number in numbers] + [start] * (3 - len(numbers))
    for step, turn in enumerate((14, 11, 25, 16, 4, 14, 24)):
        target, source = (step + 2) % 3, words[(step + 1) % 3]
        turned = (source << np.uint32(turn)) | (source >> np.uint32(32 - turn))
        words[target] = (words[target] ^ source) - turned
    return words[2]
