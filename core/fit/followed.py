"""Values that follow light which differs a little from what they were fitted to.

Where light changed by less than it is off, a value changes by as much as the light around it does in the mean; where it
changed by more, and on faces that were not there, values are fitted anew, while the others are held as they are.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..irradiance import Irradiance
from ..rows import Rows
from .settled import Settled
from .shown_faces import ShownFaces
from .vertex_fit import Begun, VertexFit

#: Values are fitted anew in so many rings of triangles around those whose light changed; and so many more rings hold
#: all that these stand together with.
RINGS, HELD_RINGS = 1, 2


@dataclass(frozen=True)
class PlacesLight(Rows):
    """What was found at K places: all ``light``, a ``part`` of it, and all with the errors by ``chance`` alone, which
    are independent of each other's; how far each place is ``open`` (K,), 0..1, and how its light changed: ``more`` and
    ``more_part`` (K, 3) W/m^2, beside the standard error (K,) that it ``had``, RGB sum; and whether (K,) it was found
    ``anew`` and may be any other."""

    light: Irradiance
    part: Irradiance
    chance: Irradiance
    open: np.ndarray
    more: np.ndarray
    more_part: np.ndarray
    had: np.ndarray
    anew: np.ndarray


def followed(fit: VertexFit, before: Settled, same: np.ndarray, now: PlacesLight) -> Settled:
    """The values of ``fit`` for the light at its places ``now``, where those ``before`` were for the light that was at
    the ``same`` (K,) of their places, -1 where there was none."""
    was = before.among(fit.placed, fit.count, same)
    weights, _, usual = fit.counted(now.light.value, now.open)
    whole = fit.sums(weights[:, None])
    known = whole[:, 0] > 0
    means = np.divide(1.0, whole, out=np.zeros_like(whole), where=whole > 0)
    left = np.where(same >= 0, before.left.take(same), 1.0)
    # What it has now would not tell few rays of the change, that brought much, from noise.
    noise = means * fit.sums((weights * now.had)[:, None])
    more, more_part = (means * fit.sums(weights[:, None] * each) for each in (now.more, now.more_part))
    kept = (was >= 0)[:, None]
    value, part = (np.where(kept, each.take(was, axis=0), 0.0) for each in (before.value, before.part))
    value = _same_sign(value + more, np.where(kept, value, more))
    part = np.clip(part + more_part, np.minimum(value, 0.0), np.maximum(value, 0.0))
    differs = (was < 0) | (np.abs(more).sum(axis=1) > noise[:, 0])
    differs[fit.placed[now.anew]] = True
    if differs.any():
        free = _around(fit.faces, differs, RINGS)
        used = _around(fit.faces, free, HELD_RINGS)
        faces, triangles = fit.faces.of_values(used)
        places, rows = fit.places.on(triangles)
        some, here, at = VertexFit(faces, places), now.taken(rows), np.flatnonzero(used)
        begun = Begun(value[at], part[at], ~free[at], usual)
        own = here.chance.standard_error
        # Errors do not stand still where values are held.
        found = some.fitted(Irradiance(here.light.value, own), here.open, start=begun)
        changed = free[fit.placed[rows]].any(axis=1)
        left[rows[changed]] = some.left_of(found, own)[changed]
        found = some.fitted(here.light, here.open, here.part, begun)
        fresh = free[at]
        value[at[fresh]], part[at[fresh]] = found.value[fresh], found.part[fresh]
    return Settled(value, part, known, fit.placed, left)


def _same_sign(values: np.ndarray, before: np.ndarray) -> np.ndarray:
    """The ``values``, none where they are no longer on the side of zero where they were ``before``."""
    return np.where(values * before < 0, 0.0, values)


def _around(faces: ShownFaces, chosen: np.ndarray, rings: int) -> np.ndarray:
    """Those of the values that are ``chosen`` (U,), and in so many ``rings`` of triangles around them."""
    for _ in range(rings):
        chosen, before = chosen.copy(), chosen
        chosen[faces.values[before[faces.values].any(axis=1)]] = True
        chosen[faces.beside[before[faces.beside].any(axis=1)]] = True
    return chosen
