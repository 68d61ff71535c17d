"""Shadow rays to lamps, from the choice of the lamps to the sum of what arrives: direct/lamp_light.py in few passes."""

from __future__ import annotations

from numba import njit

from .lamp_rays import lamp_ray

_FAR = 1e30  # as in core/rays.py


@njit("void(f8[:,::1], f8[:,::1], f8[:,::1], f8[:,::1], f8[:,::1])", nogil=True, cache=True, error_model="numpy")
def lamp_strengths(points, normals, table, light, strength):
    """What the middle of each lamp brings unshadowed: ``light`` (K, L), and ``strength`` without the cosine; RGB sums.

    points, normals  (K, 3)
    table            (L, WIDTH) see core/direct/lamp_table.py
    """
    for point in range(len(points)):
        x, y, z = points[point, 0], points[point, 1], points[point, 2]
        for lamp in range(len(table)):
            row = table[lamp]
            dx, dy, dz, _, weight = lamp_ray(row, x, y, z, 0.5, 0.5)
            cosine = normals[point, 0] * dx + normals[point, 1] * dy + normals[point, 2] * dz
            strength[point, lamp] = weight * (abs(row[1]) + abs(row[2]) + abs(row[3]))
            light[point, lamp] = strength[point, lamp] * max(cosine, 0.0)


@njit("void(f8[:,::1], f8[:,::1], i8[::1], f8[::1], i8, i8[::1], f8[::1])", nogil=True, cache=True, error_model="numpy")
def choose_lamps(shares, ends, spot, offsets, count, chosen, probability):
    """``count`` lamps for each sample, systematically from its offset: LampChoice.chosen.

    shares, ends         (K, L) probabilities at each point, and their running sums
    spot, offsets        (S,) the point of each sample, and its offset in [0, 1)
    chosen, probability  (S * count,) written
    """
    last = shares.shape[1] - 1
    for sample in range(len(spot)):
        at, lamp = spot[sample], 0
        for number in range(count):
            step = (number + offsets[sample]) / count
            while lamp < last and ends[at, lamp] <= step:
                lamp += 1
            chosen[sample * count + number] = lamp
            probability[sample * count + number] = shares[at, lamp]


@njit(
    "i8(f8[:,::1], f8[:,::1], i8[::1], i8, i8[::1], f8[::1], f8[:,::1], f8[:,::1], f8[::1], f8, f8,"
    " f4[:,::1], f4[:,::1], f4[::1], f8[:,::1], i8[::1])",
    nogil=True,
    cache=True,
    error_model="numpy",
)
def aim_at_lamps(
    points, normals, spot, count, chosen, probability, uniforms, table, centre, scale, short,
    near, towards, reach, arriving, sample,
):  # fmt: skip
    """Rays that bring light unless something is in between: their number R.

    points, normals     (K, 3); ``spot`` (S,) which of them each sample is of, with ``count`` rays
    chosen, probability, uniforms   (S * count,), (S * count, 2) the lamp of each ray, and where it aims
    table               (L, WIDTH) see core/direct/lamp_table.py
    centre, scale, short    rays end ``short`` m before the lamp; Embree sees them less centre, times scale
    near, towards, reach, arriving, sample   written up to R: the rays as Embree has them, irradiance, and whose it is
    """
    found = 0
    for ray in range(len(chosen)):
        at = spot[ray // count]
        x, y, z = points[at, 0], points[at, 1], points[at, 2]
        row = table[chosen[ray]]
        dx, dy, dz, distance, weight = lamp_ray(row, x, y, z, uniforms[ray, 0], uniforms[ray, 1])
        cosine = normals[at, 0] * dx + normals[at, 1] * dy + normals[at, 2] * dz
        if not cosine > 0.0 or weight == 0.0 or (row[1] == 0.0 and row[2] == 0.0 and row[3] == 0.0):
            continue
        weight *= cosine / probability[ray]
        for channel in range(3):
            arriving[found, channel] = row[1 + channel] * weight
        near[found, 0] = min(max((x - centre[0]) * scale, -_FAR), _FAR)
        near[found, 1] = min(max((y - centre[1]) * scale, -_FAR), _FAR)
        near[found, 2] = min(max((z - centre[2]) * scale, -_FAR), _FAR)
        towards[found, 0] = dx
        towards[found, 1] = dy
        towards[found, 2] = dz
        reach[found] = min((distance - short) * scale, _FAR)
        sample[found] = ray // count
        found += 1
    return found


@njit("void(b1[::1], f8[:,::1], i8[::1], f8, f8[:,::1])", nogil=True, cache=True, error_model="numpy")
def arrived(blocked, arriving, sample, share, samples):
    """Add ``share`` of what is ``arriving`` (R, 3) without being ``blocked`` (R,) to its ``sample`` (R,)."""
    for ray in range(len(blocked)):
        if not blocked[ray]:
            at = sample[ray]
            for channel in range(3):
                samples[at, channel] += share * arriving[ray, channel]
