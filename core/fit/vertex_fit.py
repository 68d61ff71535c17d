"""Values at vertices by least squares, so that what faces show between them is the light that was found there.

Source: Kavan, Bargteil and Sloan, "Least Squares Vertex Baking", 2011. Plain squares give whole faces away to a few
bright places, and whole walls to the part of them that lies in the dark; so squares count in proportion to the light
that is shown and found, large ones count linearly (Huber 1964), and light that is missing weighs more than light that
is too much. Weights follow from the solution before (iteratively reweighted least squares).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..irradiance import Irradiance
from .shown_faces import FacePlaces, ShownFaces

#: Differences between neighbouring values weigh so much, over places that show as much area.
SMOOTH = 0.03

#: Differences count relative to the light shown and found, and this share of what is usual in the scene; beyond such
#: a share of that they count linearly.
USUAL, LINEAR = 0.3, 0.3

#: Places that show less than half of their light weigh so many times more; from three quarters on none does.
LACKING = 6.0

#: Places with less than this share of the usual light are unlit: nobody looks from there, and they weigh little where
#: their face is lit elsewhere.
UNLIT_SHARE, UNLIT = 1e-3, 0.05

#: Times that weights are found anew, and steps of conjugate gradients each time and for errors.
REWEIGHTED, STEPS, STEPS_FOR_ERRORS = 6, 6, 12

#: Random noises that tell how errors of places become errors of values.
NOISES = 8


@dataclass(frozen=True)
class Fitted:
    """Values (U) fitted to light.

    light   with the errors that noise leaves
    part    (U, 3) W/m^2, of the part of the light that was asked for
    known   (U,) whether light was found on any face that shows the value
    """

    light: Irradiance
    part: np.ndarray
    known: np.ndarray


class VertexFit:
    """Fits U values to the light found at ``places`` (K) of ``faces``."""

    def __init__(self, faces: ShownFaces, places: FacePlaces):
        self._faces, self._places = faces, places
        self._values = faces.values.take(places.triangle, axis=0)
        self._left: np.ndarray | None = None

    @property
    def count(self) -> int:
        """How many values there are."""
        return self._faces.count

    def fitted(self, light: Irradiance, hidden: np.ndarray, part: Irradiance | None = None) -> Fitted:
        """The values for the ``light`` at the places but the ``hidden`` (K,) ones, and for ``part`` of that light.

        Standard errors say what noise of the places, independent of each other's, does to them.
        """
        area, found, usual = self._counted(light.value, hidden)
        low, high = self._ranges(light.value, area > 0)
        value = np.clip(0.0, low, high)
        weights, level = area / (found + usual) ** 2, np.full(self.count, usual)
        for _ in range(REWEIGHTED):
            blocks = self._blocks(weights, level, usual)
            value = np.clip(self._solved(blocks, self._sums(weights[:, None] * light.value), value, STEPS), low, high)
            weights = area * _weights(np.abs(self.shown(value)).sum(axis=1), found, usual)
            level = np.abs(value).sum(axis=1)
        known = self._sums((area > 0).astype(float)[:, None])[:, 0] > 0
        part = light if part is None else part
        share = self._solved(blocks, self._sums(weights[:, None] * part.value), 0.5 * value, STEPS)
        errors = self._errors(blocks, weights, light.standard_error)
        return Fitted(Irradiance(value, errors), np.clip(share, np.minimum(value, 0.0), np.maximum(value, 0.0)), known)

    def seen(self, light: Irradiance, hidden: np.ndarray, chance: Irradiance) -> Irradiance:
        """The ``light`` at the places with the errors (K, 3) of what is shown there.

        Errors by ``chance``, which are independent of each other's, the fit takes down to a share that is found out
        once; others stay.
        """
        if self._left is None and np.isfinite(light.standard_error).all():
            unit = np.ones(len(hidden))
            area, found, usual = self._counted(light.value, hidden)
            relative = np.divide(chance.standard_error.sum(axis=1), found, out=unit, where=found > 0)
            weights = area / (2.0 * found + USUAL * usual) ** 2
            level = self._sums(area[:, None] * found[:, None]) / np.maximum(self._sums(area[:, None]), 1e-300)
            blocks = self._blocks(weights, level[:, 0], usual)
            errors = self._errors(blocks, weights, (relative * found)[:, None] * np.ones(3) / 3.0)
            left = self.shown(errors).sum(axis=1)
            own = chance.standard_error.sum(axis=1)
            self._left = np.divide(left, own, out=np.ones(len(left)), where=own > 0)
        left = 1.0 if self._left is None else self._left[:, None]
        with np.errstate(invalid="ignore"):
            squared = light.standard_error**2 - chance.standard_error**2 * (1.0 - left**2)
        return Irradiance(light.value, np.sqrt(np.where(np.isnan(squared), np.inf, np.maximum(squared, 0.0))))

    def _counted(self, value: np.ndarray, hidden: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
        """The area (K,) for which each place counts, the light (K,) that was found there, and what is usual."""
        found = np.abs(value).sum(axis=1)
        lit = found[(found > 0) & ~hidden]
        usual = float(np.median(lit)) if len(lit) else 1.0
        area = np.where(hidden, 0.0, self._places.area)
        return np.where(found <= UNLIT_SHARE * usual, UNLIT, 1.0) * area, found, usual

    def shown(self, value: np.ndarray) -> np.ndarray:
        """What (K, d) is shown at the places where vertices have this ``value`` (U, d)."""
        return np.einsum("kc,kcd->kd", self._places.weights, value.take(self._values, axis=0))

    def _errors(self, blocks, weights: np.ndarray, standard_error: np.ndarray) -> np.ndarray:
        """Standard errors (U, 3) of values whose places have these, independent of each other."""
        signs = np.random.default_rng(0).choice([-1.0, 1.0], (len(weights), NOISES))
        noise = np.nan_to_num(standard_error.sum(axis=1), posinf=0.0)
        start = np.zeros((self._faces.count, NOISES))
        spread = self._solved(blocks, self._sums((weights * noise)[:, None] * signs), start, STEPS_FOR_ERRORS)
        whole = np.sqrt((spread**2).mean(axis=1))
        channels = self._sums(weights[:, None] * standard_error)
        return whole[:, None] * channels / np.maximum(channels.sum(axis=1, keepdims=True), 1e-300)

    def _sums(self, at_places: np.ndarray) -> np.ndarray:
        """Sums (U, d) of what is given at the places (K, d), by their weights at each value."""
        parts = self._places.weights[:, :, None] * at_places[:, None, :]
        return _added(self._values, parts, self._faces.count)

    def _blocks(self, weights: np.ndarray, level: np.ndarray, usual: float) -> np.ndarray:
        """What each triangle adds to the equations of its values, (T, 3, 3); these are about at ``level`` (U,)."""
        faces, places = self._faces, self._places
        outer = places.weights[:, :, None] * (places.weights * weights[:, None])[:, None, :]
        count = len(faces.values)
        sums = [np.bincount(places.triangle, part, count) for part in outer.reshape(-1, 9).T]
        blocks = np.stack(sums, axis=1).reshape(-1, 3, 3)
        smooth = SMOOTH / 3.0 * faces.areas / (2.0 * level.take(faces.values).mean(axis=1) + USUAL * usual) ** 2
        return blocks + smooth[:, None, None] * (3.0 * np.eye(3) - 1.0)

    def _solved(self, blocks: np.ndarray, right: np.ndarray, start: np.ndarray, steps: int) -> np.ndarray:
        """Solve the equations of all ``blocks`` (T, 3, 3) for the ``right`` side (U, d), by conjugate gradients."""
        values = self._faces.values
        diagonal = _added(values, np.einsum("tcc->tc", blocks)[:, :, None], self._faces.count)
        inverse = np.divide(1.0, diagonal, out=np.zeros_like(diagonal), where=diagonal > 0)

        def applied(x):
            return _added(values, np.einsum("tcd,tdx->tcx", blocks, x.take(values, axis=0)), self._faces.count)

        x = start.copy()
        residual = right - applied(x)
        step = inverse * residual
        size = np.einsum("ux,ux->x", residual, step)
        for _ in range(steps):
            turned = applied(step)
            along = np.einsum("ux,ux->x", step, turned)
            share = np.divide(size, along, out=np.zeros_like(size), where=along > 0)
            x += share * step
            residual -= share * turned
            better = inverse * residual
            before, size = size, np.einsum("ux,ux->x", residual, better)
            step = better + np.divide(size, before, out=np.zeros_like(size), where=before > 0) * step
        return x

    def _ranges(self, value: np.ndarray, counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The least and the most (U, 3) that was found on the triangles around each value, 0 where nothing was."""
        low, high = np.full((2, self._faces.count, 3), np.inf)
        rows, at = self._values[counts], value[counts]
        for corner in range(3):
            np.minimum.at(low, rows[:, corner], at)
            np.minimum.at(high, rows[:, corner], -at)
        return np.where(np.isfinite(low), low, -np.inf), np.where(np.isfinite(high), -high, np.inf)


def _weights(shown: np.ndarray, found: np.ndarray, usual: float) -> np.ndarray:
    """How much places (K,) weigh, where ``shown`` (K,) is what they show of what was ``found`` (K,)."""
    scale = shown + found + USUAL * usual
    off = np.abs(shown - found) / scale
    lacks = np.divide(found - shown, found, out=np.zeros_like(found), where=found > 0)
    more = 1.0 + LACKING * np.clip(4.0 * lacks - 1.0, 0.0, 1.0)
    return more * LINEAR / (np.maximum(off, LINEAR) * scale**2)


def _added(rows: np.ndarray, parts: np.ndarray, count: int) -> np.ndarray:
    """Sums (count, d) of ``parts`` (..., d) by their ``rows`` (...)."""
    flat = rows.ravel()
    return np.stack([np.bincount(flat, part.ravel(), count) for part in np.moveaxis(parts, -1, 0)], axis=1)
