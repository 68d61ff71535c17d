"""Values at vertices by least squares, so that what faces show between them is the light that was found there.

Source: Kavan, Bargteil and Sloan, "Least Squares Vertex Baking", 2011. Plain squares give whole faces away to a few
bright places, and whole walls to the part of them that lies in the dark; so squares count in proportion to the light
that is shown and found, large ones count linearly (Huber 1964), and light that is missing weighs more than light that
is too much. Weights follow from the solution before (iteratively reweighted least squares).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from ..group_sums import column_sums
from ..irradiance import DARK_SHARE, Irradiance
from .bends import Bends
from .equations import Matrix, Neighbours
from .shown_faces import FacePlaces, ShownFaces

#: Across an edge values bend by about this share of the light, as long as nothing is known of them, and then by as much
#: as they do beyond noise around it, at least by the second share: the noisier places are, the more that counts. Bends
#: beyond so many standard errors of a place are no noise, and stay. Where the surface bends, light is likely to, by so
#: large a share for each radian.
BEND, LEAST_BEND, BEYOND, BEND_OF_SURFACE = 0.1, 0.02, 3.0, 0.3

#: Values beside each other on faces that bend differ about by the angle in radians and LEAST_ANGLE, as shares of the
#: light; that counts as much as a place does that differs by SEAM. So do the ends of edges that are shorter than SHORT
#: of the size of the faces around both, by that share of it and the angle: light across a sliver is one.
LEAST_ANGLE, SEAM, SHORT = 0.05, 0.15, 0.03

#: Values whose faces alone would differ there by more than this share are not held: a thin wall stands between them.
APART = 0.15

#: A place that is exact still differs from what any values show by about this share: as if by noise.
MISFIT = 0.03

#: Differences count relative to the light shown and found, and this share of what is usual in the scene; beyond such
#: a share of that they count linearly.
USUAL, LINEAR = 0.6, 0.05

#: Places that show less than half of their light weigh so many times more; from three quarters on none does.
LACKING = 6.0

#: Places with less than this share of the usual light are unlit, such as those within something that is not closed:
#: they weigh little where their face is lit elsewhere.
DIM_SHARE, UNLIT = 0.02, 0.05

#: So many standard errors of a place may be noise.
NOISE = 2.0

#: Of squared differences so many times the squared standard error may well be noise.
CERTAIN = 2.0

#: Places in gaps, however narrow, weigh so much.
UNSEEN = 1e-3

#: Times that weights are found anew before it is known how much values differ, and after; and steps of conjugate
#: gradients each time, and for errors. A fit that begins near its end needs once before.
ROUGHLY, FINALLY, STEPS, STEPS_FOR_ERRORS, ONCE = 3, 3, 8, 10, 1

#: What the fit leaves of errors is found out again when they have fallen to this share.
AGAIN = 0.75

#: Bends are looked at in so many rings of triangles.
RINGS = 3

#: Values below this share of the usual light are none: what the solution leaves of its start where all is dark.
ROUNDING = 1e-9

#: Random noises that tell how errors of places become errors of values.
NOISES = 4


@dataclass(frozen=True)
class Fitted:
    """Values (U) fitted to light.

    value    (U, 3) W/m^2
    errors   finds the standard errors (U, 3) that noise leaves of them
    part     (U, 3) W/m^2, of the part of the light that was asked for
    known    (U,) whether light was found on any face that shows the value
    """

    value: np.ndarray
    errors: Callable[[], np.ndarray]
    part: np.ndarray
    known: np.ndarray

    @cached_property
    def light(self) -> Irradiance:
        """The values with their errors."""
        return Irradiance(self.value, self.errors())


@dataclass(frozen=True)
class Begun:
    """Where a fit of some of a scene's values begins: at ``value`` and ``part`` (U, 3) W/m^2, of which those ``held``
    (U,) stay; ``usual`` W/m^2 is what light is in the whole scene, RGB sum."""

    value: np.ndarray
    part: np.ndarray
    held: np.ndarray
    usual: float


@dataclass(frozen=True)
class FaceLosses:
    """What F faces show wrong.

    share   (F,) of the light, 0..1, in the mean over places: how far what is shown there is from what was found, beyond
            noise, over the larger of both
    area    (F,) m^2, of which buried and unlit parts count as little as in the fit
    bright  (F,) how bright each looks, 0..1: the mean of the larger of both, over that and what is usual in the scene
    """

    share: np.ndarray
    area: np.ndarray
    bright: np.ndarray


class VertexFit:
    """Fits U values to the light found at ``places`` (K) of ``faces``."""

    def __init__(self, faces: ShownFaces, places: FacePlaces):
        self.faces, self.places = faces, places
        self.placed = faces.values.take(places.triangle, axis=0)

    # What only a fit of all values needs is made when that is asked for.
    @cached_property
    def _sides(self) -> tuple[np.ndarray, np.ndarray]:
        """Values (P, 2) beside each other, and by what angle or share (P,) they differ."""
        short, turns = self.faces.short_edges(SHORT)
        return np.concatenate([self.faces.beside, short]), np.concatenate([self.faces.angles, turns])

    @cached_property
    def _bends(self) -> Bends:
        return Bends.of(self.faces)

    @cached_property
    def _neighbours(self) -> Neighbours:
        shown = self.faces.values
        pairs = [shown[:, [0, 1]], shown[:, [1, 2]], shown[:, [2, 0]], self._sides[0], self._bends.pairs]
        return Neighbours(np.concatenate(pairs), self.count)

    @cached_property
    def _seams(self) -> np.ndarray:
        """How much (P,) m^2 values beside each other are held together at most."""
        beside, turns = self._sides
        pairs = np.maximum(np.bincount(beside.ravel(), minlength=self.count), 1)
        share = (self.faces.around / pairs)[beside].min(axis=1, initial=np.inf)
        return share * SEAM**2 / (turns**2 + LEAST_ANGLE**2)

    @cached_property
    def _place_area(self) -> np.ndarray:
        """How much (T,) m^2 a place stands for on each triangle, or would if it had one."""
        return np.minimum(self.faces.areas, self.faces.areas / np.maximum(self.places.expected, 1e-300))

    @property
    def count(self) -> int:
        """How many values there are."""
        return self.faces.count

    def fitted(
        self, light: Irradiance, open: np.ndarray, part: Irradiance | None = None, start: Begun | None = None
    ) -> Fitted:
        """The values for the ``light`` at the places, each as far as it is ``open`` (K,), 0..1, and for ``part`` of it.

        Standard errors say what noise of the places, independent of each other's, does to them.
        """
        area, found, usual = self.counted(light.value, open, None if start is None else start.usual)
        errors = np.nan_to_num(light.standard_error, posinf=0.0)
        noise = np.hypot(self._noise(errors.sum(axis=1), area, found, usual), MISFIT)
        low, lit = self._least(light.value, area > 0), (area > 0) & (found > DIM_SHARE * usual)
        # What has no lit place around it may take the light of what is beside it.
        high = -self._least(-light.value, lit)
        if start is None:
            value = np.clip(np.median(light.value[lit], axis=0) if lit.any() else 0.0, low, high)
            weights, level = area / (found + usual) ** 2, np.full(self.count, usual)
            turns, free = ROUGHLY, None
        else:
            low[start.held], high[start.held] = -np.inf, np.inf
            value = np.clip(start.value, low, high)
            weights = area * _weights(np.abs(self.shown(value)).sum(axis=1), found, errors.sum(axis=1), usual)
            turns, free, level = ONCE, ~start.held, np.abs(value).sum(axis=1)
        bend, seams = BEND, np.zeros(len(self._seams))
        for turn in range(turns + FINALLY):
            equations = self._equations(weights, self._smooth(noise, bend, level, usual), seams, level, usual)
            value = equations.solved(self.sums(weights[:, None] * light.value), value, STEPS, free)
            value = np.clip(value, low, high)
            level = np.abs(value).sum(axis=1)
            if turn + 1 == turns:
                bend = self._bent(level, self._spread(equations, weights, errors), usual)
                seams = self._held(level, usual)
            weights = area * _weights(np.abs(self.shown(value)).sum(axis=1), found, errors.sum(axis=1), usual)
        value[np.abs(value) < ROUNDING * usual] = 0.0
        share = value
        if part is not None:
            share = 0.5 * value if start is None else start.part
            share = equations.solved(self.sums(weights[:, None] * part.value), share, STEPS_FOR_ERRORS, free)
            share = np.clip(share, np.minimum(value, 0.0), np.maximum(value, 0.0))
        known = self.sums((area > 0).astype(float)[:, None])[:, 0] > 0
        return Fitted(value, partial(self._errors, equations, weights, errors), share, known)

    def left_of(self, found: Fitted, errors: np.ndarray) -> np.ndarray:
        """The share (K,) of the places' ``errors`` (K, 3) that is left of them where what was ``found`` is shown."""
        left, whole = self.shown(found.light.standard_error).sum(axis=1), errors.sum(axis=1)
        return np.divide(left, whole, out=np.ones(len(left)), where=whole > 0)

    def counted(
        self, value: np.ndarray, open: np.ndarray, usual: float | None = None
    ) -> tuple[np.ndarray, np.ndarray, float]:
        """The area (K,) for which each place counts, the light (K,) that was found there, and what is usual."""
        found = np.abs(value).sum(axis=1)
        if usual is None:
            lit = found[(found > 0) & (open > 0)]
            usual = float(np.median(lit)) if len(lit) else 1.0
        # Nobody looks from within narrow gaps, but without any other light theirs counts.
        area = np.where(open > 0, np.maximum(open**2, UNSEEN), 0.0) * self.places.area
        return np.where(found <= DIM_SHARE * usual, UNLIT, 1.0) * area, found, usual

    def shown(self, value: np.ndarray) -> np.ndarray:
        """What (K, d) is shown at the places where vertices have this ``value`` (U, d)."""
        return np.einsum("kc,kcd->kd", self.places.weights, value.take(self.placed, axis=0))

    def losses(self, value: np.ndarray, light: Irradiance, open: np.ndarray, face: np.ndarray) -> FaceLosses:
        """What faces show wrong of the ``light`` at their places, with ``value`` (U, 3); ``face`` (T,) from 0 up are
        those that the triangles belong to.
        """
        area, found, usual = self.counted(light.value, open)
        shown = self.shown(value)
        squares = np.abs(shown - light.value).sum(axis=1) ** 2
        noise = np.nan_to_num(light.standard_error.sum(axis=1), posinf=0.0) ** 2
        beside = np.maximum(np.maximum(np.abs(shown).sum(axis=1), found), DARK_SHARE * usual)
        wrong = np.minimum(np.sqrt(np.maximum(squares - CERTAIN * noise, 0.0)) / beside, 1.0)
        of, count = face[self.places.triangle], int(face.max(initial=-1)) + 1
        whole, counted, *sums = (
            np.bincount(of, each, count)
            for each in (self.places.area, area, area * wrong, area * beside / (beside + usual))
        )
        share, bright = (np.divide(each, counted, out=np.zeros(count), where=counted > 0) for each in sums)
        part = np.divide(counted, whole, out=np.zeros(count), where=whole > 0)
        return FaceLosses(share, np.bincount(face, self.faces.areas, count) * part, bright)

    def _spread(self, equations: Matrix, weights: np.ndarray, errors: np.ndarray) -> np.ndarray:
        """What (U, NOISES) noises of the places with these standard ``errors`` (K, 3) do to the values, RGB sums."""
        signs = np.random.default_rng(0).choice([-1.0, 1.0], (len(weights), NOISES))
        right = self.sums((weights * errors.sum(axis=1))[:, None] * signs)
        return equations.solved(right, np.zeros_like(right), STEPS_FOR_ERRORS)

    def _errors(self, equations: Matrix, weights: np.ndarray, errors: np.ndarray) -> np.ndarray:
        """Standard errors (U, 3) of the values by those ``errors`` (K, 3) of the places."""
        spread = np.sqrt((self._spread(equations, weights, errors) ** 2).mean(axis=1, keepdims=True))
        channels = self.sums(weights[:, None] * errors)
        return spread * channels / np.maximum(channels.sum(axis=1, keepdims=True), 1e-300)

    def _bent(self, level: np.ndarray, spread: np.ndarray, usual: float) -> np.ndarray:
        """By what share (H,) of the light values bend across each edge and around it, beyond noise."""
        bends = self._bends
        mean = level.take(bends.values).mean(axis=1) + USUAL * usual
        beyond = (bends.at(level) ** 2 - (bends.at(spread) ** 2).mean(axis=1)) / mean**2
        return np.sqrt(np.clip(bends.smoothed(beyond, RINGS), LEAST_BEND**2, BEND**2))

    def _smooth(self, noise: np.ndarray, bend: np.ndarray | float, level: np.ndarray, usual: float) -> np.ndarray:
        """How much (H,) bends count, where places have that relative ``noise`` (T,), of values of that ``level`` (U,)
        that are likely to ``bend`` by that share."""
        bends = self._bends
        scale = 2.0 * level.take(bends.values).mean(axis=1) + USUAL * usual
        squared = (noise**2).take(bends.triangles).mean(axis=1)
        noise = BEYOND**2 * squared * scale**2
        kept = np.divide(noise, noise + bends.at(level) ** 2, out=np.zeros_like(noise), where=noise > 0)
        area = self._place_area.take(bends.triangles).mean(axis=1)
        likely = bend**2 + (BEND_OF_SURFACE * bends.angles) ** 2
        return kept * squared / likely * area / scale**2

    def sums(self, at_places: np.ndarray) -> np.ndarray:
        """Sums (U, d) of what is given at the places (K, d), by their weights at each value."""
        parts = ((self.places.weights * part[:, None]).ravel() for part in at_places.T)
        return column_sums(parts, self.placed.ravel(), self.count)

    def _noise(self, errors: np.ndarray, area: np.ndarray, found: np.ndarray, usual: float) -> np.ndarray:
        """Relative standard error (T,) of a place on each triangle, from the places' ``errors`` (K,)."""
        relative = np.minimum(errors / (found + USUAL * usual), 1.0)
        triangle, count = self.places.triangle, len(self.faces.values)
        squares, whole = np.bincount(triangle, area * relative**2, count), np.bincount(triangle, area, count)
        everywhere = float(squares.sum() / max(whole.sum(), 1e-300))
        return np.sqrt(np.divide(squares, whole, out=np.full(count, everywhere), where=whole > 0))

    def _held(self, level: np.ndarray, usual: float) -> np.ndarray:
        """How much (P,) m^2 seams hold, where each side alone gave values of that ``level`` (U,)."""
        ends = level.take(self._sides[0])
        apart = np.abs(ends[:, 0] - ends[:, 1]) / (ends.sum(axis=1) + USUAL * usual)
        return self._seams / (1.0 + (apart / APART) ** 2) ** 2

    def _equations(self, weights, smooth: np.ndarray, seams, level: np.ndarray, usual: float) -> Matrix:
        """The equations of values, which are about at ``level`` (U,), where places have those ``weights`` (K,).

        Bends count ``smooth`` (H,), and ``seams`` (P,) m^2 say how much what lies beside each other is held together.
        """
        places, shown, bends = self.places, self.faces.values, self._bends
        products = weights[:, None] * places.weights * np.roll(places.weights, -1, axis=1)
        pulled = [np.bincount(places.triangle, product, len(shown)) for product in products.T]
        seams = seams / (level.take(self._sides[0]).sum(axis=1) + USUAL * usual) ** 2
        # Sums over nothing are whole numbers, to which nothing can be added in place.
        own = bends.squares(smooth) + np.bincount(self._sides[0].ravel(), np.repeat(seams, 2), self.count)
        own = own + np.bincount(self.placed.ravel(), (weights[:, None] * places.weights**2).ravel(), self.count)
        return self._neighbours.matrix(own, np.concatenate([*pulled, -seams, bends.products(smooth)]))

    def _least(self, at_places: np.ndarray, counts: np.ndarray) -> np.ndarray:
        """The least (U, 3) of what is given at places that count, on the triangles around each value and beside it;
        minus infinity where there is none.
        """
        rows = np.flatnonzero(counts)
        rows = rows[np.argsort(self.places.triangle[rows], kind="stable")]
        triangle = self.places.triangle[rows]
        begin = np.flatnonzero(np.diff(triangle, prepend=-1))
        around = self.faces.values[triangle[begin]].ravel()
        order = np.argsort(around, kind="stable")
        first = np.flatnonzero(np.diff(around[order], prepend=-1))
        least = np.full((self.count, 3), np.inf)
        if len(rows):
            found = np.minimum.reduceat(at_places[rows], begin)
            least[around[order[first]]] = np.minimum.reduceat(found[order // 3], first)
        np.minimum.at(least, self._sides[0], least[self._sides[0]][:, ::-1])
        return np.where(np.isfinite(least), least, -np.inf)


def _weights(shown: np.ndarray, found: np.ndarray, errors: np.ndarray, usual: float) -> np.ndarray:
    """How much places (K,) weigh, where ``shown`` (K,) is what they show of what was ``found`` (K,) with ``errors``.

    Differences that may be noise count as none: else places where noise found too little would weigh the more.
    """
    away = found - shown
    found = shown + np.sign(away) * np.maximum(np.abs(away) - NOISE * errors, 0.0)
    scale = shown + found + USUAL * usual
    off = np.abs(shown - found) / scale
    lacks = np.divide(found - shown, found, out=np.zeros_like(found), where=found > 0)
    more = 1.0 + LACKING * np.clip(4.0 * lacks - 1.0, 0.0, 1.0)
    return more * LINEAR / (np.maximum(off, LINEAR) * scale**2)


class ShownErrors:
    """What the ``fit`` leaves in one bake of errors at its places.

    Attribute ``left``: the share (K,) of errors by chance that is left where it is shown, one as long as none is known.
    """

    def __init__(self, fit: VertexFit):
        self._fit = fit
        # The sum of errors by chance when it was found out how much is left of them.
        self.left, self._sized = np.ones(len(fit.placed)), np.inf

    def seen(self, light: Irradiance, open: np.ndarray, chance: Irradiance) -> Irradiance:
        """The ``light`` at the places with the errors (K, 3) of what is shown there.

        Errors by ``chance``, which are independent of each other's, the fit takes down; others stay.
        """
        own = chance.standard_error
        if not np.isfinite(light.standard_error).all():
            return light
        size = float(own.sum())
        if size < AGAIN * self._sized:
            self.left = self._fit.left_of(self._fit.fitted(Irradiance(light.value, own), open), own)
            self._sized = size
        return seen_errors(light, self.left, own)


def seen_errors(light: Irradiance, left: np.ndarray, own: np.ndarray) -> Irradiance:
    """The ``light`` (K) of whose errors by chance, ``own`` (K, 3), that share is ``left`` (K,)."""
    squared = np.maximum(light.standard_error**2 - own**2, 0.0) + (left[:, None] * own) ** 2
    return Irradiance(light.value, np.sqrt(squared))
