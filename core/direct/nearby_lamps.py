"""Light of lamps at places that are no points of a bake, but near some, by one shadow ray each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..lights.light import ShadowRays
from ..parallel import slices
from ..sampling import choose_in_rows, running_shares
from .emitter_choice import EmitterChoice
from .lamp_light import LampLight

#: Share that each kind of lamps counts at least as, of all their light, however little of it was found.
LEAST_SHARE = 0.1

#: Places that are worked on at a time.
_PLACES_PER_BLOCK = 1 << 14

#: So few lamps are not chosen by what groups know, but at each place by what each would bring, and all alike for a
#: half: a group in a room and in the sun before it knows little of either.
FEW_LAMPS = 4


@dataclass(frozen=True)
class Arriving:
    """A ray from each of K places towards a lamp.

    directions  (K, 3) unit, from the place to the lamp
    distances   (K,) metres to the lamp; inf for distant ones
    light       (K, 3) W/m^2, RGB: radiance times cosine over density, still to be multiplied by what the way lets pass
    """

    directions: np.ndarray
    distances: np.ndarray
    light: np.ndarray


@dataclass(frozen=True)
class NearbyLamps:
    """Aims from places near G groups of points, which may face any way, at what the groups know of the lamps.

    kinds    of lamps, of which each has learnt how to choose
    centres  (G, 3) metres, the middle of each group's points, from which lamps look much as from the places
    brought  (G, kinds) what light, RGB sum, the groups found of each kind, in any unit
    """

    kinds: Sequence[LampLight]
    centres: np.ndarray
    brought: np.ndarray

    def rays(self, places: np.ndarray, normals: np.ndarray, group: np.ndarray, uniforms: np.ndarray) -> Arriving:
        """A ray from each of ``places`` (K, 3), metres, that face along unit ``normals`` (K, 3).

        They follow what ``group`` (K,) knows of the lamps, and ``uniforms`` (K, 3) in [0, 1): which lamp, and where
        on it (2). Times what the way over the distance lets pass (:meth:`.Shadows.transmitted`), the mean of the light
        over uniforms is the irradiance by all lamps, whatever was learnt; the better the group knows which of them
        shine there, the less noisy it is. Light from behind the surface is zero.
        """
        found = Arriving(np.tile((0.0, 0.0, 1.0), (len(places), 1)), np.full(len(places), np.inf), 0.0 * places)
        for block in slices(len(places) if self.brought.shape[1] else 0, _PLACES_PER_BLOCK):
            share = self._shares(group[block])
            kind, rest = _chosen(share, uniforms[block, 0])
            for number in np.unique(kind).tolist():
                rows = np.flatnonzero(kind == number)
                at = block.start + rows
                within = np.stack([rest[rows], uniforms[at, 1], uniforms[at, 2]], axis=1)
                rays, probability = self._of_kind(number, places[at], normals[at], group[at], within)
                cosine = np.maximum(np.einsum("ij,ij->i", normals[at], rays.directions), 0.0)
                weight = cosine / (rays.density * probability * share[rows, number])
                found.directions[at], found.distances[at] = rays.directions, rays.distances
                found.light[at] = rays.radiance * weight[:, None]
        return found

    def _shares(self, group: np.ndarray) -> np.ndarray:
        """The probability (K, kinds) with which each chooses that kind."""
        brought = self.brought[group]
        total = brought.sum(axis=1, keepdims=True)
        share = np.divide(brought, total, out=np.zeros_like(brought), where=total > 0.0) + LEAST_SHARE
        return share / share.sum(axis=1, keepdims=True)

    @cached_property
    def _choices(self) -> list[EmitterChoice | None]:
        """How each group chooses among the lamps of each kind; None where they are few."""
        every = np.arange(len(self.centres))
        return [None if lamps.count <= FEW_LAMPS else lamps.learnt.around(self.centres, every) for lamps in self.kinds]

    def _of_kind(self, number, places, normals, group, uniforms) -> tuple[ShadowRays, np.ndarray]:
        """Rays to lamps of one kind, and the probability (K,) of each lamp among them."""
        lamps = self.kinds[number]
        if lamps.count <= FEW_LAMPS:
            light = lamps.unshadowed(places, normals)[0]
            whole = np.maximum(light.sum(axis=1, keepdims=True), np.finfo(float).tiny)
            shares = (light / whole + 1.0 / lamps.count) / (light.any(axis=1, keepdims=True) + 1.0)
            column, _ = _chosen(shares, uniforms[:, 0])
            chosen, probability = lamps.learnt.emitters.order[column], shares[np.arange(len(column)), column]
        else:
            chosen, _, _, probability = self._choices[number].chosen(group, uniforms[:, 0])
        return lamps.rays_to(chosen, places, uniforms[:, 1:]), probability


def _chosen(share: np.ndarray, uniforms: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The column (K,) that each row of ``share`` (K, C) chooses by ``uniforms`` (K,), and these rescaled in it."""
    rows, columns = np.arange(len(share)), share.shape[1]
    place, rest = choose_in_rows(running_shares(share), columns, rows, uniforms)
    return place - rows * columns, rest
