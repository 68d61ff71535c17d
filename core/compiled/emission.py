"""Particles leaving lights, one by one: photons/emission_guide.py, the lights' `emit`, and their first rays."""

from __future__ import annotations

import math

from numba import njit

from .vectors import BELOW_ONE, choose, full_turn, in_triangle, over_hemisphere, row_of, times


@njit(
    "void(f8[::1], f8, f8[:,::1], f8[:,::1], f8[:,::1], i8[::1])",
    nogil=True,
    cache=True,
    error_model="numpy",
)
def draw(sums, offset, lower, upper, uniforms, box):
    """Choose P particles' ``box`` (P,) of B by systematic sampling and bring their ``uniforms`` (P, 4) into it.

    sums          (B,) running sums of the boxes' probabilities
    offset        the uniform number of the sampling
    lower, upper  (B, 4) the boxes' corners
    """
    particles, last, end, at = len(box), len(sums) - 1, 0, 0
    while end < particles:
        row = end
        while at < last and sums[at] <= (row + offset) / particles:
            at += 1
        while end < particles and (at == last or (end + offset) / particles < sums[at]):
            end += 1
        for each in range(row, end):
            box[each] = at
            uniforms[each, 0] = (each - row + uniforms[each, 0]) / (end - row)
            for axis in range(4):
                low = lower[at, axis]
                uniforms[each, axis] = min(low + uniforms[each, axis] * (upper[at, axis] - low), BELOW_ONE)


@njit(
    "void(f8[:,::1], Array(f8, 3, 'C', True), f8[:,::1], f8[:,::1], f8, f8[:,:], f8[:,::1], f8[:,::1], f8[:,::1])",
    nogil=True,
    cache=True,
    error_model="numpy",
)
def leave_triangles(sums, corners, normals, colours, flux, uniforms, origins, directions, fluxes):
    """EmissiveTriangles.emit: P particles of ``colours`` (T, 3) times ``flux``, by ``uniforms`` (P, 4).

    sums              (1, T) running sums of the triangles' weights
    corners, normals  (T, 3, 3), (T, 3)
    """
    at = 0
    for row in range(len(uniforms)):
        at, rest = choose(sums, 0, uniforms[row, 0], at)
        weights = in_triangle(rest, uniforms[row, 1])
        back = uniforms[row, 2] >= 0.5
        normal = times(-1.0 if back else 1.0, row_of(normals, at))
        direction = over_hemisphere(normal, 2.0 * uniforms[row, 2] - (1.0 if back else 0.0), uniforms[row, 3])
        for axis in range(3):
            origins[row, axis] = (
                weights[0] * corners[at, 0, axis]
                + weights[1] * corners[at, 1, axis]
                + weights[2] * corners[at, 2, axis]
            )
            directions[row, axis] = direction[axis]
            fluxes[row, axis] = colours[at, axis] * flux


@njit(
    "void(f8[:,::1], f8[:,::1], f8[:,::1], f8[:,::1], Array(f8, 3, 'C', True), f8[::1], f8[:,::1], f8,"
    " f8[:,:], f8[:,::1], f8[:,::1], f8[:,::1])",
    nogil=True,
    cache=True,
    error_model="numpy",
)
def leave_sky(power, sums, rows, columns, radiance, sines, ends, flux, uniforms, origins, directions, fluxes):
    """EnvironmentWorld.emit: P particles that stand for ``flux`` each, by ``uniforms`` (P, 4).

    power     (1, 3) running sums of what enters through faces perpendicular to each axis
    sums      (3, H W) running sums of the pixels' weights for each axis
    rows, columns, radiance   (3, H), (3, W), (H, W, 3) the pixels' factors of their weights, and their radiance
    sines     (H + 1,) of the latitudes of the rows' borders
    ends      (2, 3) lower and upper corner of the box
    """
    width, axis, pixel = radiance.shape[1], 0, 0
    for number in range(len(uniforms)):
        axis, rest = choose(power, 0, uniforms[number, 0], axis)
        pixel, rest = choose(sums, axis, rest, pixel)
        row = pixel // width
        column = pixel - row * width
        high = sines[row + 1] - sines[row]
        z = sines[row] + uniforms[number, 1] * high
        level = math.sqrt(max(1.0 - z * z, 0.0))
        x, y = full_turn(0.5 - (column + rest) / width)
        direction = -level * x, -level * y, -z
        along = direction[axis]
        strength = 0.0
        for channel in range(3):
            strength = max(strength, abs(radiance[row, column, channel]))
        mean = rows[axis, row] * columns[axis, column] / ((2.0 * math.pi / width) * high)
        scale = abs(along) / mean / strength * flux if strength > 0.0 else 0.0
        for channel in range(3):
            directions[number, channel] = direction[channel]
            fluxes[number, channel] = radiance[row, column, channel] * scale
            # The first of the two numbers is for the axis after this one.
            share = uniforms[number, 2 if channel == axis + 1 or channel == axis - 2 else 3]
            share = (1.0 if along < 0.0 else 0.0) if channel == axis else share
            origins[number, channel] = (1.0 - share) * ends[0, channel] + share * ends[1, channel]


@njit(
    "void(Array(f8, 2, 'A', True), Array(f8, 2, 'A', True), Array(f8, 2, 'A', True), f8, i8, f8[::1], f8,"
    " Tuple((f8[:,::1], f8[:,::1], f8[:,::1], u2[::1], u4[::1])), Tuple((f8[:,::1], u2[::1], f4[:,::1], f4[:,::1])))",
    nogil=True,
    cache=True,
    error_model="numpy",
)
def launch(starts, sent, power, lift, first, middle, scale, paths, going):
    """The first generation of ``paths`` and ``going``, as of :func:`..bounces.bounce`: P particles from ``first`` on.

    starts, sent, power  (P, 3) where they leave their lights, their directions and flux
    lift                 how far along their directions they begin
    middle, scale        for Embree
    """
    origins, _, fluxes, bounces, particle = paths
    directions, _, near, towards = going
    for row in range(len(sent)):
        bounces[row], particle[row] = 0, first + row
        for axis in range(3):
            direction = sent[row, axis]
            origin = starts[row, axis] + lift * direction
            origins[row, axis], fluxes[row, axis], directions[row, axis] = origin, power[row, axis], direction
            near[row, axis], towards[row, axis] = (origin - middle[axis]) * scale, direction
