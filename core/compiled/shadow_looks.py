"""Looking for light all around: rays along the cosine or as was learnt, and what they and aimed rays bring."""

from __future__ import annotations

import math

from numba import njit

from .vectors import BELOW_ONE, TINY, in_disc

SIDE = 16  # as in core/direct/direction_guide.py

_FAR = 1e30  # as in core/rays.py


@njit(error_model="numpy")
def _seek(ends, owner, u):
    """direction_guide._chosen: the entry among those of the owner, and the uniform number rescaled in it."""
    target = owner + u
    begin = owner * SIDE
    at = begin
    for step in (8, 4, 2, 1):
        if ends[at + step - 1] <= target:
            at += step
    start = ends[at - 1] if at > begin else float(owner)
    return at, min(max((target - start) / (ends[at] - start), 0.0), BELOW_ONE)


@njit(error_model="numpy")
def _cell(group, u, v):
    return (group * SIDE + min(int(u * SIDE), SIDE - 1)) * SIDE + min(int(v * SIDE), SIDE - 1)


@njit(error_model="numpy")
def _uniforms(x, y):
    """sampling.hemisphere_uniforms"""
    wide = abs(x) > abs(y)
    longer, shorter = (x, y) if wide else (y, x)
    radius = math.copysign(math.hypot(x, y), longer)
    aside = (4.0 / math.pi) * radius * math.atan(shorter / (1.0 if longer == 0.0 else longer))
    u, v = (radius, aside) if wide else (aside, radius)
    return min(max(0.5 * (u + 1.0), 0.0), 1.0), min(max(0.5 * (v + 1.0), 0.0), 1.0)


@njit(
    "void(f8[:,::1], f8[:,::1], f8[:,::1], f8[:,::1], i8[::1], i8[::1], i8, f8[:,::1], f8[::1], f8[::1], f8[::1],"
    " f8[::1], f8, f8[:,::1], f8[::1], f8[::1], i8[::1], f4[:,::1], f4[:,::1])",
    nogil=True,
    cache=True,
    error_model="numpy",
)
def look_by_chance(
    points, normals, first, second, group, spot, count, uniforms, density, row_ends, column_ends, centre, scale,
    directions, cosine, factor, cell, near, towards,
):  # fmt: skip
    """Rays along the cosine, or where what was learnt moves them: DirectionChoice.warped and Spots.directions.

    points, normals, first, second, group   (K, ...) see direct/spots.py
    spot, uniforms                  (S,) whose each sample is, with ``count`` rays, and (R, 2) what decides on each
    density, row_ends, column_ends  see DirectionChoice; empty where nothing was learnt
    directions, cosine, factor, cell, near, towards     (R, ...) written: also the density over the cosine's, the cell
                                    of each ray, and the rays as Embree has them
    """
    for ray in range(len(uniforms)):
        at = spot[ray // count]
        u, v, moved = uniforms[ray, 0], uniforms[ray, 1], 1.0
        if len(density) > 0:
            row, u = _seek(row_ends, group[at], u)
            column, v = _seek(column_ends, row, v)
            u = min((row % SIDE + u) / SIDE, BELOW_ONE)
            v = min((column % SIDE + v) / SIDE, BELOW_ONE)
            moved = density[column]
        x, y = in_disc(u, v)
        z = math.sqrt(max(1.0 - x * x - y * y, TINY))
        factor[ray], cosine[ray], cell[ray] = moved, z, _cell(group[at], u, v)
        for axis in range(3):
            way = x * first[at, axis] + y * second[at, axis] + z * normals[at, axis]
            directions[ray, axis] = way
            towards[ray, axis] = way
            near[ray, axis] = min(max((points[at, axis] - centre[axis]) * scale, -_FAR), _FAR)


@njit(
    "i8(f8[:,::1], f8[:,::1], f8[:,::1], f8[:,::1], i8[::1], i8[::1], i8, f8[:,::1], f8[::1], f8[:,::1], f8[::1],"
    " f8[::1], f8[::1], f8, f8, i8[::1], f8[:,::1], f8[::1], f8[::1], i8[::1], f4[:,::1], f4[:,::1], f4[::1])",
    nogil=True,
    cache=True,
    error_model="numpy",
)
def weigh_aimed(
    points, normals, first, second, group, spot, count, directions, distances, radiance, density, learnt,
    centre, scale, short, rows, arriving, weight, whole, cell, near, towards, reach,
):  # fmt: skip
    """Of the rays that a light chose, those that bring light unless something is in between: their number A.

    As above; ``directions``, ``distances``, ``radiance``, ``density`` (R, ...) are ShadowRays, ``learnt`` is the
    density of DirectionChoice, or empty.
    rows, arriving      written up to A: which rays these are, and what they bring over the densities of both kinds
    weight, whole       written: that of the cosine, and of the cosine and aiming, over those densities
    cell, near, towards, reach   written: cells, and the rays as Embree has them, which end ``short`` m before the light
    """
    found = 0
    for ray in range(len(directions)):
        at = spot[ray // count]
        x, y, z = directions[ray, 0], directions[ray, 1], directions[ray, 2]
        cosine = normals[at, 0] * x + normals[at, 1] * y + normals[at, 2] * z
        if not cosine > 0.0 or (radiance[ray, 0] == 0.0 and radiance[ray, 1] == 0.0 and radiance[ray, 2] == 0.0):
            continue
        u, v = _uniforms(
            first[at, 0] * x + first[at, 1] * y + first[at, 2] * z,
            second[at, 0] * x + second[at, 1] * y + second[at, 2] * z,
        )
        place, chance = _cell(group[at], u, v), cosine / math.pi
        sent = density[ray] + (chance * learnt[place] if len(learnt) > 0 else chance)
        rows[found], cell[found] = ray, place
        weight[found], whole[found] = chance / sent, (density[ray] + chance) / sent
        reach[found] = min((distances[ray] - short) * scale, _FAR)
        for axis in range(3):
            arriving[found, axis] = radiance[ray, axis] * cosine / sent
            towards[found, axis] = directions[ray, axis]
            near[found, axis] = min(max((points[at, axis] - centre[axis]) * scale, -_FAR), _FAR)
        found += 1
    return found


@njit(
    "void(i8[::1], f8[:,::1], f8[:,::1], f8[::1], f8[::1], f8[::1], f8[:,::1], f8[::1], f8[::1])",
    nogil=True,
    cache=True,
    error_model="numpy",
)
def weigh_met(rows, share, radiance, density, cosine, factor, found, plain, densities):
    """Add to ``found`` (R, 3) what the ``rows`` (A,) of rays along the cosine met of one light.

    share, radiance, density  (A, ...) of it that comes through, and what it is and how dense aimed rays are there
    cosine, factor            (R,) of the rays, see look_by_chance
    plain, densities          (R,) counted up: what the cosine alone would bring, RGB sum, and the densities
    """
    for place in range(len(rows)):
        ray = rows[place]
        chance = cosine[ray] / math.pi
        bright = 0.0
        for channel in range(3):
            arriving = radiance[place, channel] * share[place, channel] * cosine[ray]
            found[ray, channel] += arriving / (density[place] + chance * factor[ray])
            bright += abs(arriving)
        plain[ray] += bright / (density[place] + chance)
        densities[ray] += density[place]


@njit(
    "void(i8[::1], i8[::1], f8[::1], f8[::1], f8[::1], f8[::1], f8[:,::1], f8[:,::1], f8[:,::1])",
    nogil=True,
    cache=True,
    error_model="numpy",
)
def count_sightings(spot, cell, light, weight, whole, scale, found, sought, moment):
    """Add K sightings to three sums (2, cells) of DirectionSums, apart for even and odd points.

    scale          (N,) what light at each point is multiplied by
    spot, cell, light, weight, whole    (K,) see direct/surrounding_light.py
    """
    for place in range(len(spot)):
        side, at = spot[place] % 2, cell[place]
        square = (light[place] * scale[spot[place]]) ** 2
        found[side, at] += square * weight[place]
        sought[side, at] += weight[place]
        moment[side, at] += square * whole[place]
