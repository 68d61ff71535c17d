"""Values at vertices by least squares, so that what faces show between them is the light that was found there.

Source: Kavan, Bargteil and Sloan, "Least Squares Vertex Baking", 2011. Plain squares give whole faces away to a few
bright places, and whole walls to the part of them that lies in the dark; so squares count in proportion to the light
that is shown and found, large ones count linearly (Huber 1964), and light that is missing weighs more than light that
is too much. Weights follow from the solution before (iteratively reweighted least squares).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..irradiance import DARK_SHARE, Irradiance
from .shown_faces import FacePlaces, ShownFaces

#: Values beside each other differ by about this share of the light, as long as nothing is known of them: the noisier
#: places are, the more that counts. Differences beyond so many standard errors of a place are no noise, and stay.
DIFFERENCE, BEYOND = 0.15, 3.0

#: Values beside each other on faces that bend differ about by the angle in radians and LEAST_ANGLE, as shares of the
#: light; that counts as much as a place does that differs by SEAM.
LEAST_ANGLE, SEAM = 0.05, 0.15

#: Differences count relative to the light shown and found, and this share of what is usual in the scene; beyond such
#: a share of that they count linearly.
USUAL, LINEAR = 0.3, 0.3

#: Places that show less than half of their light weigh so many times more; from three quarters on none does.
LACKING = 6.0

#: Places with less than this share of the usual light are unlit: nobody looks from there, and they weigh little where
#: their face is lit elsewhere.
UNLIT_SHARE, UNLIT = 1e-3, 0.05

#: Values may leave the range of what was found on their triangles by this share of it: vertices are its farthest ends.
RANGE = 0.1

#: Of squared differences so many times the squared standard error may well be noise.
CERTAIN = 2.0

#: Times that weights are found anew, and steps of conjugate gradients each time and for errors.
REWEIGHTED, STEPS, STEPS_FOR_ERRORS = 6, 6, 12

#: What the square of the difference along each edge of a triangle adds to the equations of its values.
_EDGES = np.array(
    [[[1, -1, 0], [-1, 1, 0], [0, 0, 0]], [[0, 0, 0], [0, 1, -1], [0, -1, 1]], [[1, 0, -1], [0, 0, 0], [-1, 0, 1]]],
    float,
)

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


@dataclass(frozen=True)
class _Equations:
    """What each triangle adds to the equations of its three values (T, 3, 3), and what seams (P,) add."""

    blocks: np.ndarray
    seams: np.ndarray


@dataclass(frozen=True)
class FaceLosses:
    """What F faces show wrong.

    share  (F,) of the light, 0..1, in the mean over places: how far what is shown there is from what was found, beyond
           noise, over the larger of both
    area   (F,) m^2, 0 where nothing is known
    """

    share: np.ndarray
    area: np.ndarray


class VertexFit:
    """Fits U values to the light found at ``places`` (K) of ``faces``."""

    def __init__(self, faces: ShownFaces, places: FacePlaces):
        self._faces, self._places = faces, places
        self._values = faces.values.take(places.triangle, axis=0)
        around = _added(faces.values, np.repeat(faces.areas / 3.0, 3).reshape(-1, 3, 1), faces.count)[:, 0]
        pairs = np.maximum(np.bincount(faces.beside.ravel(), minlength=faces.count), 1)
        share = (around / pairs)[faces.beside].min(axis=1, initial=np.inf)
        self._seams = share * SEAM**2 / (faces.angles**2 + LEAST_ANGLE**2)
        # m^2 that a place stands for on each triangle, or would if it had one.
        self._place_area = np.minimum(faces.areas, faces.areas / np.maximum(places.expected, 1e-300))
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
        noise = self._noise(light.standard_error.sum(axis=1), area, found, usual)
        low, high = self._ranges(light.value, area > 0)
        value = np.clip(0.0, low, high)
        weights, level = area / (found + usual) ** 2, np.full(self.count, usual)
        for _ in range(REWEIGHTED):
            equations = self._equations(weights, noise, level, usual)
            value = np.clip(
                self._solved(equations, self._sums(weights[:, None] * light.value), value, STEPS), low, high
            )
            weights = area * _weights(np.abs(self.shown(value)).sum(axis=1), found, usual)
            level = np.abs(value).sum(axis=1)
        known = self._sums((area > 0).astype(float)[:, None])[:, 0] > 0
        part = light if part is None else part
        share = self._solved(equations, self._sums(weights[:, None] * part.value), 0.5 * value, STEPS)
        errors = self._errors(equations, weights, light.standard_error)
        return Fitted(Irradiance(value, errors), np.clip(share, np.minimum(value, 0.0), np.maximum(value, 0.0)), known)

    def seen(self, light: Irradiance, hidden: np.ndarray, chance: Irradiance) -> Irradiance:
        """The ``light`` at the places with the errors (K, 3) of what is shown there.

        Errors by ``chance``, which are independent of each other's, the fit takes down to a share that is found out
        once; others stay.
        """
        if self._left is None and np.isfinite(light.standard_error).all():
            area, found, usual = self._counted(light.value, hidden)
            own = chance.standard_error.sum(axis=1)
            noise = self._noise(own, area, found, usual)
            weights = area / (2.0 * found + USUAL * usual) ** 2
            level = self._sums((area * found)[:, None]) / np.maximum(self._sums(area[:, None]), 1e-300)
            errors = self._errors(self._equations(weights, noise, level[:, 0], usual), weights, chance.standard_error)
            left = self.shown(errors).sum(axis=1)
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

    def losses(self, value: np.ndarray, light: Irradiance, hidden: np.ndarray, face: np.ndarray) -> FaceLosses:
        """What faces show wrong of the ``light`` at their places, with ``value`` (U, 3); ``face`` (T,) from 0 up are
        those that the triangles belong to.
        """
        area, found, usual = self._counted(light.value, hidden)
        shown = self.shown(value)
        squares = np.abs(shown - light.value).sum(axis=1) ** 2
        noise = np.nan_to_num(light.standard_error.sum(axis=1), posinf=0.0) ** 2
        beside = np.maximum(np.maximum(np.abs(shown).sum(axis=1), found), DARK_SHARE * usual)
        wrong = np.minimum(np.sqrt(np.maximum(squares - CERTAIN * noise, 0.0)) / beside, 1.0)
        of, count = face[self._places.triangle], int(face.max(initial=-1)) + 1
        sums, counted = np.bincount(of, area * wrong, count), np.bincount(of, area, count)
        share = np.divide(sums, counted, out=np.zeros(count), where=counted > 0)
        return FaceLosses(share, np.bincount(face, self._faces.areas, count) * (counted > 0))

    def _errors(self, equations: _Equations, weights: np.ndarray, standard_error: np.ndarray) -> np.ndarray:
        """Standard errors (U, 3) of values whose places have these, independent of each other."""
        signs = np.random.default_rng(0).choice([-1.0, 1.0], (len(weights), NOISES))
        noise = np.nan_to_num(standard_error.sum(axis=1), posinf=0.0)
        start = np.zeros((self._faces.count, NOISES))
        spread = self._solved(equations, self._sums((weights * noise)[:, None] * signs), start, STEPS_FOR_ERRORS)
        whole = np.sqrt((spread**2).mean(axis=1))
        channels = self._sums(weights[:, None] * standard_error)
        return whole[:, None] * channels / np.maximum(channels.sum(axis=1, keepdims=True), 1e-300)

    def _sums(self, at_places: np.ndarray) -> np.ndarray:
        """Sums (U, d) of what is given at the places (K, d), by their weights at each value."""
        parts = self._places.weights[:, :, None] * at_places[:, None, :]
        return _added(self._values, parts, self._faces.count)

    def _noise(self, errors: np.ndarray, area: np.ndarray, found: np.ndarray, usual: float) -> np.ndarray:
        """Relative standard error (T,) of a place on each triangle, from the places' ``errors`` (K,)."""
        relative = np.minimum(np.nan_to_num(errors, posinf=0.0) / (found + USUAL * usual), 1.0)
        triangle, count = self._places.triangle, len(self._faces.values)
        squares, whole = np.bincount(triangle, area * relative**2, count), np.bincount(triangle, area, count)
        everywhere = float(squares.sum() / max(whole.sum(), 1e-300))
        return np.sqrt(np.divide(squares, whole, out=np.full(count, everywhere), where=whole > 0))

    def _equations(self, weights: np.ndarray, noise: np.ndarray, level: np.ndarray, usual: float) -> _Equations:
        """The equations of values, which are about at ``level`` (U,).

        Places have that relative ``noise`` (T,).
        """
        places, count = self._places, len(self._faces.values)
        outer = places.weights[:, :, None] * (places.weights * weights[:, None])[:, None, :]
        sums = [np.bincount(places.triangle, part, count) for part in outer.reshape(-1, 9).T]
        at = level.take(self._faces.values)
        scale = 2.0 * at.mean(axis=1) + USUAL * usual
        differ = np.roll(at, -1, axis=1) - at
        expected = (BEYOND * noise * scale)[:, None]
        kept = np.divide(expected**2, expected**2 + differ**2, out=np.zeros_like(differ), where=expected > 0)
        smooth = kept * ((noise / DIFFERENCE) ** 2 * self._place_area / (3.0 * scale**2))[:, None]
        blocks = np.stack(sums, axis=1).reshape(-1, 3, 3) + np.einsum("te,ecd->tcd", smooth, _EDGES)
        beside = level.take(self._faces.beside).sum(axis=1) + USUAL * usual
        return _Equations(blocks, self._seams / beside**2)

    def _solved(self, equations: _Equations, right: np.ndarray, start: np.ndarray, steps: int) -> np.ndarray:
        """Solve the ``equations`` for the ``right`` side (U, d), by conjugate gradients."""
        values, beside, count = self._faces.values, self._faces.beside, self.count
        blocks, seams = equations.blocks, equations.seams[:, None]
        diagonal = _added(values, np.einsum("tcc->tc", blocks)[:, :, None], count)
        diagonal += _added(beside, np.repeat(seams, 2, axis=1)[:, :, None], count)
        inverse = np.divide(1.0, diagonal, out=np.zeros_like(diagonal), where=diagonal > 0)

        def applied(x):
            total = _added(values, np.einsum("tcd,tdx->tcx", blocks, x.take(values, axis=0)), count)
            if len(beside):
                pull = seams * (x.take(beside[:, 0], axis=0) - x.take(beside[:, 1], axis=0))
                total += _added(beside, np.stack([pull, -pull], axis=1), count)
            return total

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
        """The least and the most (U, 3) that each value may be by what was found on the triangles around it."""
        rows = np.flatnonzero(counts)
        rows = rows[np.argsort(self._places.triangle[rows], kind="stable")]
        triangle, at = self._places.triangle[rows], value[rows]
        begin = np.flatnonzero(np.diff(triangle, prepend=-1))
        around = self._faces.values[triangle[begin]].ravel()
        order = np.argsort(around, kind="stable")
        first = np.flatnonzero(np.diff(around[order], prepend=-1))
        low, high = np.full((2, self.count, 3), np.inf)
        if len(rows):
            for side, found in ((low, np.minimum.reduceat(at, begin)), (high, np.minimum.reduceat(-at, begin))):
                side[around[order[first]]] = np.minimum.reduceat(found[order // 3], first)
        known = np.isfinite(low)
        margin = RANGE * np.where(known, -high - low, 0.0)
        return np.where(known, low - margin, -np.inf), np.where(known, margin - high, np.inf)


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
