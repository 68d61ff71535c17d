"""What surfaces do to particles between two casts of rays: the steps of photons/bounces.py in one pass."""

from __future__ import annotations

import math

from numba import njit

from .specular import facet, shares, turned
from .vectors import TINY, dot, over_hemisphere, plus, row_of, times

ABSORBED, REFLECTED, PASSED, MIRRORED, REFRACTED = range(5)  # as in photons/bounces.py
OPAQUE = -2  # as there
DARK = (0.0, 0.0, 0.0)


@njit(error_model="numpy", inline="always")
def _write(array, row, vector):
    for axis in range(3):
        array[row, axis] = vector[axis]


@njit(error_model="numpy")
def _largest(rgb):
    return max(max(abs(rgb[0]), abs(rgb[1])), abs(rgb[2]))


@njit(error_model="numpy")
def _shaded(rgb, share):
    return rgb[0] * share[0], rgb[1] * share[1], rgb[2] * share[2]


@njit(error_model="numpy")
def _reflected(flux, albedo, choice):
    """The fate on a surface that only reflects diffusely, and the flux that goes on."""
    going = _shaded(flux, albedo)
    chance = min(_largest(going) / max(_largest(flux), TINY), 1.0)
    return (REFLECTED if choice < chance else ABSORBED), times(1.0 / max(chance, TINY), going)


@njit(error_model="numpy")
def _roulette(flux, albedo, through, mirrored, refracted, choice):
    """The fate that a uniform number chooses among these shares of what a surface does, and the flux that goes on."""
    largest = max(_largest(flux), TINY)
    going = _shaded(flux, albedo), _shaded(flux, through), _shaded(flux, mirrored), _shaded(flux, refracted)
    first, second = _largest(going[0]) / largest, _largest(going[1]) / largest
    third, fourth = _largest(going[2]) / largest, _largest(going[3]) / largest
    excess = max(first + second + third + fourth, 1.0)
    first, second, third, fourth = first / excess, second / excess, third / excess, fourth / excess
    if choice < first:
        return REFLECTED, times(1.0 / first, going[0])
    if choice < first + second:
        return PASSED, times(1.0 / second, going[1])
    if choice < first + second + third:
        return MIRRORED, times(1.0 / third, going[2])
    if choice < first + second + third + fourth:
        return REFRACTED, times(1.0 / fourth, going[3])
    return ABSORBED, DARK


@njit(error_model="numpy", inline="always")
def _sent_on(at, u, v, surfaces, specular, direction, flux, choice, facets, row):
    """The fate of a particle where light may pass or be turned, its flux and direction after it, and the next ``row``.

    ``row`` of facets (K, 5), uniform numbers, is used if the triangle ``at`` is specular.
    """
    _, normals, albedo, transmittance, kinds = surfaces
    own = kinds[at]
    if own < 0:
        fate, flux = _roulette(flux, row_of(albedo, at), row_of(transmittance, at), DARK, DARK, choice)
        return fate, flux, direction, row
    normal = row_of(normals, at)
    reflectance, met = facet(specular, own, u, v, normal, direction, facets[row, 0], facets[row, 1])
    mirrored, refracted = shares(specular[1], own, reflectance)
    fate, flux = _roulette(flux, row_of(albedo, at), row_of(transmittance, at), mirrored, refracted, choice)
    if fate == MIRRORED or fate == REFRACTED:
        direction = turned(met, fate == MIRRORED, direction, specular[2][own, 1], facets, row)
    return fate, flux, direction, row + 1


@njit(error_model="numpy", inline="always")
def _begun(origins, path, ends, direction, flux, start, row):
    """Let a particle shine from ``start`` on; one that is blocked before loses its flux, and its start becomes -1."""
    origin, end = row_of(origins, path), row_of(ends, path)
    way = plus(end, -1.0, origin)
    if start[row] < math.sqrt(dot(way, way)):
        _write(origins, path, plus(origin, start[row], direction))
    else:
        start[row] = -1.0
        _write(flux, path, DARK)


@njit(
    "i8(Tuple((i4[::1], f4[::1], f4[::1])), Tuple((f8[:,::1], f8[:,::1], f8[:,::1], u2[::1], u4[::1])), i8,"
    " Tuple((f8[:,::1], u2[::1], f4[:,::1], f4[:,::1])), f8[::1],"
    " Tuple((f8[:,::1], f8[:,::1], f8[:,::1], f8[:,::1], i8[::1])), Tuple((f8[:,::1], f8[:,::1], f8[:,::1])),"
    " Tuple((f8[:,::1], f8[:,::1])), Tuple((f8, f8, f8)), Tuple((f8[::1], f8, f8[::1], f8)), Tuple((i8, i8)), f8[::1])",
    nogil=True,
    cache=True,
    error_model="numpy",
)
def bounce(hits, paths, begin, going, start, surfaces, specular, uniforms, lengths, spaces, most, cut):
    """Where segments end, and which R particles go on, and how: their number K.

    hits       triangle, u, v (R,): what the rays met and where, -1 for nothing
    paths      origins, ends, flux (S, 3), bounce, particle (S,) of segments; the rays' are those from ``begin`` on,
               whose ends are written, and K new ones follow them without ends
    going      directions (R, 3), how many surfaces each passed straight (R,), and origins and directions (R, 3) for
               Embree; the first K rows are overwritten with the next
    start      (R,) distances from where the particles shine, or none; -1 is written for those that are blocked before
    surfaces   edged as in core/compiled/hits.py, normals, albedo, transmittance and kinds of the triangles, the last
               two empty if all only reflect, see photons/bounces.py
    specular   as in core/compiled/specular.py
    uniforms   (H, 3) for each particle that met something, and (F, 5) for each that met something specular
    lengths    how far segments reach behind their hit along the normal, the least cosine, and the lift of origins
    spaces     centre and radius of everything, which segments without a hit leave; centre and scale for Embree
    most       bounces, and passages: the flux of those that would go on after them is added to ``cut`` (3,)
    """
    triangle, us, vs = hits
    origins, ends, fluxes, bounces, particle = paths
    directions, passages, near, towards = going
    edged, normals, albedo, _, kinds = surfaces
    reach_behind, grazing, lift = lengths
    centre, radius, middle, scale = spaces
    chances, facets = uniforms
    met = glossy = 0
    alive = begin + len(triangle)
    for row in range(len(triangle)):
        path, at = begin + row, triangle[row]
        direction, origin = row_of(directions, row), row_of(origins, path)
        if at < 0:
            away = plus(origin, -1.0, (centre[0], centre[1], centre[2]))
            _write(ends, path, plus(origin, math.sqrt(dot(away, away)) + radius, direction))
            if len(start):
                _begun(origins, path, ends, direction, fluxes, start, row)
            continue
        u, v, normal = float(us[row]), float(vs[row]), row_of(normals, at)
        point = (
            edged[at, 0] + u * edged[at, 3] + v * edged[at, 6],
            edged[at, 1] + u * edged[at, 4] + v * edged[at, 7],
            edged[at, 2] + u * edged[at, 5] + v * edged[at, 8],
        )
        along = dot(normal, direction)
        _write(ends, path, plus(point, reach_behind / max(abs(along), grazing), direction))
        if len(start):
            _begun(origins, path, ends, direction, fluxes, start, row)
        flux, choice = row_of(fluxes, path), chances[met, 0]
        if len(kinds) and kinds[at] != OPAQUE:
            fate, flux, direction, glossy = _sent_on(
                at, u, v, surfaces, specular, direction, flux, choice, facets, glossy
            )
        else:
            fate, flux = _reflected(flux, row_of(albedo, at), choice)
        met += 1
        if fate == ABSORBED:
            continue
        if (passages[row] >= most[1]) if fate == PASSED else (bounces[path] >= most[0]):
            for channel in range(3):
                cut[channel] += flux[channel]
            continue
        side = math.copysign(lift, dot(normal, direction))
        if fate == REFLECTED:
            side = -side
            direction = over_hemisphere(times(math.copysign(1.0, side), normal), chances[met - 1, 1],
                                        chances[met - 1, 2])  # fmt: skip
        onward = alive - begin - len(triangle)
        origin = plus(point, side, normal)
        _write(origins, alive, origin)
        _write(fluxes, alive, flux)
        particle[alive] = particle[path]
        bounces[alive] = bounces[path] + (fate != PASSED)
        passages[onward] = passages[row] + (fate == PASSED)
        _write(directions, onward, direction)
        _write(towards, onward, direction)
        for axis in range(3):
            near[onward, axis] = (origin[axis] - middle[axis]) * scale
        alive += 1
    return alive - begin - len(triangle)
