"""How much of a disc to use: the estimate of nested discs, as small ones as their noise allows.

A disc blurs: its estimate is the mean of the light on it. A smaller one within blurs less, and has more noise. From the
whole disc inward, what each nested disc would change is added as far as it stands out from its own noise.
Where light is even, all of the disc is used; beside a shadow, or in a corner, as little of it as there is light for.

Where noise is the whole, this is James and Stein's shrinkage (1961) of differences towards zero, one by one.
"""

from __future__ import annotations

import numpy as np

#: A difference d of variance v counts by max(1 - CAUTION v / d^2, 0), for each nested disc but the outermost. More of
#: it leaves more blur, less of it more noise, most of all in the smallest discs: so, light that is even gets 1.1 times
#: the noise that whole discs would give.
CAUTION = (3.0, 6.0, 10.0)

#: What the square of a difference that was not added is beyond so many times its variance is blur. With less of it even
#: light would seem blurred.
DOUBT = 4.0


def nested_estimate(
    flux: np.ndarray, squares: np.ndarray, once_more: np.ndarray, contrasts: np.ndarray, areas: np.ndarray, samples: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """The irradiance (N, 3) W/m^2 of discs from their rings, its second moment, the square of what blur is left, and
    the same share (N, S) W/m^2 of the ``contrasts`` as of the flux.

    flux       (N, K, 3) W: mean over the samples of what one sample alone brings to each ring
    squares    (N, K, 3) W^2: mean of the sum of its crossings' squares
    once_more  (N, 3) W^2: what one crossing more would add to the mean of the squares
    contrasts  (N, K, S) W: what halves of the samples differ by
    areas      (N, K) m^2 of the nested discs; nested disc k has the rings from k on
    samples    how many

    The second moment (N, 3) is the mean over samples of the squared estimate by that sample alone, as far as it comes
    from ``squares``. The blur's square (N, 3) is what the differences that were not added are beyond their noise.
    """
    rings = flux.shape[1]
    inner_squares = np.cumsum(squares[:, ::-1], axis=1)[:, ::-1]
    per_area = 1.0 / areas
    shares = -np.diff(areas, axis=1, append=0.0)
    # By which each ring's flux is multiplied in all.
    factor = np.repeat(per_area[:, :1], rings, axis=1)
    value = np.einsum("nkc,nk->nc", flux, factor)
    blur = np.zeros_like(value)
    for ring in range(1, rings):
        change = -factor
        change[:, ring:] += per_area[:, ring, None]
        difference = np.einsum("nkc,nk->nc", flux, change)
        # Of the squares as they are, and as light that is even on the next larger disc would part them: in the one a
        # difference grows with its own variance, in the other its opposite does.
        change_squared = change**2
        own = np.einsum("nkc,nk->nc", squares, change_squared)
        spread = (shares * change_squared)[:, ring - 1 :].sum(axis=1) * per_area[:, ring - 1]
        even = inner_squares[:, ring - 1] * spread[:, None]
        even += np.einsum("nkc,nk->nc", squares[:, : ring - 1], change_squared[:, : ring - 1])
        once = (per_area[:, ring] - per_area[:, ring - 1]) ** 2
        variance = (0.5 * (own + even) + once_more * once[:, None]) / max(samples - 1, 1)
        squared = difference**2
        noise, whole = CAUTION[ring - 1] * variance.sum(axis=1), squared.sum(axis=1)
        kept = 1.0 - np.divide(noise, whole, out=np.ones_like(whole), where=whole > noise)[:, None]
        value += kept * difference
        factor += kept * change
        blur += np.maximum(squared - DOUBT * variance, 0.0)
        blur *= (1.0 - kept) ** 2
    differ = np.einsum("nks,nk->ns", contrasts, factor)
    factor *= factor
    # One crossing more falls into a ring by the ring's share of the area.
    moment = np.einsum("nkc,nk->nc", squares, factor)
    moment += once_more * (shares * factor).sum(axis=1, keepdims=True) * per_area[:, :1]
    return value, moment, blur, differ
