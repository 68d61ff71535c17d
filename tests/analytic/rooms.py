"""Closed rooms and open plates for the analytic tests: geometry with a known answer."""

import numpy as np
from detp.core.scene import Scene


def box_quads(size):
    """The six inner faces of a box from the origin to ``size``: (6, 4 corners, 3), normals inward."""
    x, y, z = size
    v = np.array([(0, 0, 0), (x, 0, 0), (x, y, 0), (0, y, 0), (0, 0, z), (x, 0, z), (x, y, z), (0, y, z)], float)
    return v[[(0, 1, 2, 3), (7, 6, 5, 4), (4, 5, 1, 0), (6, 7, 3, 2), (7, 4, 0, 3), (5, 6, 2, 1)]]


def scene_of(quads, albedo=0.0, emission=0.0, lights=(), transmittance=0.0):
    """A scene of quads (Q, 4, 3); the optical values are numbers, RGB, or one row per quad."""
    quads = np.asarray(quads, float)
    count = len(quads)
    triangles = (np.arange(count)[:, None, None] * 4 + np.array([(0, 1, 2), (0, 2, 3)])).reshape(-1, 3)

    def per_triangle(value):
        value = np.asarray(value, float)
        rows = np.broadcast_to(value[:, None] if value.shape == (count,) else value, (count, 3))
        return np.repeat(rows, 2, axis=0)

    return Scene(
        quads.reshape(-1, 3),
        triangles,
        per_triangle(albedo),
        per_triangle(emission),
        per_triangle(transmittance),
        lights,
    )


def face_points(quads, across=5):
    """Points (Q * across^2, 3) in the middle part of each quad, and their normals."""
    quads = np.asarray(quads, float)
    u, v = np.meshgrid(*[np.linspace(0.25, 0.75, across)] * 2)
    u, v = u.reshape(1, -1, 1), v.reshape(1, -1, 1)
    a, b, c, d = (quads[:, None, i] for i in range(4))
    points = (1 - u) * (1 - v) * a + u * (1 - v) * b + u * v * c + (1 - u) * v * d
    normals = np.cross(quads[:, 1] - quads[:, 0], quads[:, 3] - quads[:, 0])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    return points.reshape(-1, 3), np.repeat(normals, across**2, axis=0)


def z_scores(estimate, expected):
    """How many standard errors each point is off, (N,), of the RGB sum; channels count as fully correlated.

    Light from shadow rays may have no error but rounding, for which a millionth is allowed.
    """
    difference = (estimate.irradiance - expected).sum(axis=1)
    rounding = 1e-6 * np.broadcast_to(expected, estimate.irradiance.shape).sum(axis=1)
    return difference / np.hypot(estimate.standard_error.sum(axis=1), rounding)
