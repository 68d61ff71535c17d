"""Random streams by name, so that no two parts of a bake share one: equal seeds give equal light on any machine."""

from __future__ import annotations

import numpy as np

#: What random numbers are for, in the order of their streams. New ones go to the end, and one that is no longer
#: used leaves its place, lest seeds give other light.
USES = ("radius", "photons", "rays", "", "scouts", "records", "shares", "places", "", "views", "changes")


def random_stream(seed: int, use: str, *key: int) -> np.random.Generator:
    """The random numbers of that ``use``, one of USES; of its part ``key`` where it has parts."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(USES.index(use), *map(int, key))))
