"""Vectors as tuples of three numbers, and the mappings of core/sampling.py for one of them.

What takes arrays is inlined by Numba, which else would count references to them at every call; LLVM inlines the rest.
"""

from __future__ import annotations

import math

from numba import njit

TINY, BELOW_ONE = 2.2250738585072014e-308, 1.0 - 2.0**-53  # the smallest number, and the largest below one

#: Taylor's coefficients of the sine from the third power on, and of the cosine from the second.
_S = tuple((-1.0) ** k / math.factorial(2 * k + 1) for k in range(1, 9))
_C = tuple((-1.0) ** k / math.factorial(2 * k) for k in range(1, 9))


@njit(error_model="numpy", inline="always")
def row_of(array, row):
    """Row ``row`` of an array (K, 3)."""
    return array[row, 0], array[row, 1], array[row, 2]


@njit(error_model="numpy")
def dot(a, b):
    """The scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(error_model="numpy")
def times(factor, a):
    """A vector times a number."""
    return factor * a[0], factor * a[1], factor * a[2]


@njit(error_model="numpy")
def plus(a, factor, b):
    """a + factor b."""
    return a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]


@njit(error_model="numpy")
def unit(a):
    """The vector scaled to length one."""
    return times(1.0 / math.sqrt(dot(a, a)), a)


@njit(error_model="numpy")
def within_frame(normal, x, y, z):
    """x and y along the two vectors that sampling.frames adds to the unit ``normal``, z along the normal itself."""
    nx, ny, nz = normal
    sign = math.copysign(1.0, nz)
    a = -1.0 / (sign + nz)
    b = nx * ny * a
    return (
        x * (1.0 + sign * nx * nx * a) + y * b + z * nx,
        x * (sign * b) + y * (sign + ny * ny * a) + z * ny,
        x * (-sign * nx) + y * (-ny) + z * nz,
    )


@njit(error_model="numpy")
def sine_and_cosine(angle):
    """Of an angle of at most pi / 4 either way, by Taylor's series: to 1e-16, and several times faster than libm's."""
    s = angle * angle
    sine = _S[3] + s * (_S[4] + s * (_S[5] + s * (_S[6] + s * _S[7])))
    sine = angle * (1.0 + s * (_S[0] + s * (_S[1] + s * (_S[2] + s * sine))))
    cosine = _C[3] + s * (_C[4] + s * (_C[5] + s * (_C[6] + s * _C[7])))
    cosine = 1.0 + s * (_C[0] + s * (_C[1] + s * (_C[2] + s * cosine)))
    return sine, cosine


@njit(error_model="numpy")
def full_turn(share):
    """Cosine and sine of a share, -1..1, of a full turn."""
    quarter = math.floor(4.0 * share + 0.5)
    sine, cosine = sine_and_cosine(2.0 * math.pi * (share - 0.25 * quarter))
    # Without branches, which chance would make expensive.
    quarter = int(quarter) & 3
    x, y = (sine, cosine) if quarter & 1 else (cosine, sine)
    return (-x if quarter == 1 or quarter == 2 else x), (-y if quarter >= 2 else y)


@njit(error_model="numpy")
def in_disc(first, second):
    """sampling.disc: the point x, y of the unit disc for two uniform numbers."""
    p, q = 2.0 * first - 1.0, 2.0 * second - 1.0
    wide = abs(p) > abs(q)
    radius, other = (p, q) if wide else (q, p)
    sine, cosine = sine_and_cosine(0.25 * math.pi * (other / (radius if radius != 0.0 else 1.0)))
    along, across = radius * cosine, radius * sine
    return (along, across) if wide else (across, along)


@njit(error_model="numpy")
def over_hemisphere(normal, first, second):
    """sampling.cosine_hemisphere: a direction about the unit ``normal`` for two uniform numbers."""
    x, y = in_disc(first, second)
    radius = max(abs(2.0 * first - 1.0), abs(2.0 * second - 1.0))
    return within_frame(normal, x, y, math.sqrt((1.0 - radius) * (1.0 + radius)))


@njit(error_model="numpy")
def about(axis, fall, turn):
    """sampling.around: a unit vector at 1 - cosine ``fall`` from the unit ``axis``."""
    sine = math.sqrt(max(fall * (2.0 - fall), 0.0))
    x, y = full_turn(turn)
    return within_frame(axis, sine * x, sine * y, 1.0 - fall)


@njit(error_model="numpy")
def in_triangle(u, v):
    """sampling.triangle: the weights of a triangle's corners."""
    root = math.sqrt(u)
    second = root * v
    return 1.0 - root, root - second, second


@njit(error_model="numpy", inline="always")
def choose(sums, line, uniform, before):
    """sampling.choose by the running sums in that ``line`` of (L, K): row and what is left of the uniform number.

    The search begins at the row chosen ``before``, since numbers mostly ascend.
    """
    value = uniform * sums[line, -1]
    low, high, step = 0, sums.shape[1], 1
    if sums[line, before] <= value:
        low = before + 1
        while low + step <= high and sums[line, low + step - 1] <= value:
            low += step
            step *= 2
        high = min(low + step, high)
    else:
        high = before
        while step <= high and sums[line, high - step] > value:
            high -= step
            step *= 2
        low = max(high - step, 0)
    while low < high:
        middle = (low + high) // 2
        if sums[line, middle] <= value:
            low = middle + 1
        else:
            high = middle
    # Rounding up to the whole sum must not lead to a row without weight.
    low = min(low, sums.shape[1] - 1)
    while low > 0 and sums[line, low - 1] == sums[line, -1]:
        low -= 1
    start = sums[line, low - 1] if low > 0 else 0.0
    whole = sums[line, low] - start
    return low, min(max((value - start) / whole, 0.0), BELOW_ONE) if whole > 0.0 else 0.0
