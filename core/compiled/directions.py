"""The mappings of core/sampling.py for many particles at once."""

from __future__ import annotations

from numba import njit

from .vectors import about, in_disc, over_hemisphere, row_of, within_frame


@njit("void(Array(f8, 2, 'A', True), f8[:,::1])", nogil=True, cache=True, error_model="numpy")
def discs(uniforms, found):
    """sampling.disc: points (P, 2)."""
    for row in range(len(found)):
        found[row, 0], found[row, 1] = in_disc(uniforms[row, 0], uniforms[row, 1])


@njit("void(Array(f8, 2, 'A', True), Array(f8, 2, 'A', True), f8[:,::1])", nogil=True, cache=True, error_model="numpy")
def hemispheres(normals, uniforms, found):
    """sampling.cosine_hemisphere: directions (P, 3) about ``normals`` (P, 3), or (1, 3) for all."""
    for row in range(len(found)):
        normal = row_of(normals, row if len(normals) > 1 else 0)
        found[row, 0], found[row, 1], found[row, 2] = over_hemisphere(normal, uniforms[row, 0], uniforms[row, 1])


@njit("void(Array(f8, 2, 'A', True), f8[:], f8[:], f8[:,::1])", nogil=True, cache=True, error_model="numpy")
def turned_around(axes, fall, turn, found):
    """sampling.around: directions (P, 3) about ``axes`` (P, 3), or (1, 3) for all."""
    for row in range(len(found)):
        axis = row_of(axes, row if len(axes) > 1 else 0)
        found[row, 0], found[row, 1], found[row, 2] = about(axis, fall[row], turn[row])


@njit(
    "void(Array(f8, 2, 'A', True), Array(f8, 2, 'A', True), f8, f8[:,::1])", nogil=True, cache=True, error_model="numpy"
)
def set_crosswise(directions, uniforms, radius, found):
    """lights.point.crosswise times the ``radius``: points (P, 3) of the disc perpendicular to ``directions`` (P, 3)."""
    for row in range(len(found)):
        x, y = in_disc(uniforms[row, 0], uniforms[row, 1])
        found[row, 0], found[row, 1], found[row, 2] = within_frame(row_of(directions, row), radius * x, radius * y, 0.0)
