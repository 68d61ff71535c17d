"""Lights of every kind that tests share, and whether what is drawn from them is spread evenly."""

import numpy as np
from detp.core.lights.area import AreaLight
from detp.core.lights.emissive import EmissiveTriangles
from detp.core.lights.environment import EnvironmentWorld
from detp.core.lights.point import PointLight
from detp.core.lights.spot import SpotLight
from detp.core.lights.sun import SunLight
from scipy.stats import chisquare

LEAST_P = 0.001
COLOUR = np.array([2.0, 1.0, 0.5])
AT = np.array([0.3, -0.1, 0.8])
UP = np.array([0.0, 0.0, 1.0])
STRETCHED = np.array([[2.0, 0.3, 0.2], [0.0, 1.0, 0.1], [0.1, 0.0, 1.5]])
SQUARE = (0.5, 0, 0), (0, 0.3, 0.1)
SHEARED = (0.5, 0.1, 0), (0.2, 0.3, 0.1)
CORNERS = np.array([[(0.5, -0.2, 0.3), (0.1, 0.6, 0.8), (-0.4, -0.3, 0.6)], [(-0.6, 0, 1), (0, 0.6, 0.9), (0, 0, 0.7)]])
GLOW = np.array([COLOUR, -0.3 * COLOUR])
PICTURE = np.random.default_rng(7).random((5, 8, 3)) ** 4

# Each takes the colour's sign, so that a negative and a black lamp can be made of it.
LIGHTS = {
    "point": lambda s: PointLight(AT, s * COLOUR),
    "point sphere": lambda s: PointLight(AT, s * COLOUR, 0.2),
    "point soft": lambda s: PointLight(AT, s * COLOUR, 0.2, True),
    "spot": lambda s: SpotLight(AT, (-0.2, 0, -1), s * COLOUR, 1.2, 0.5),
    "spot hard": lambda s: SpotLight(AT, (-0.2, 0, -1), s * COLOUR, 1.2, 0.0),
    "spot stretched sphere": lambda s: SpotLight(AT, STRETCHED, s * COLOUR, 1.8, 0.5, 0.2),
    "spot mirrored soft": lambda s: SpotLight(AT, STRETCHED * (1, -1, 1), s * COLOUR, 1.8, 0.2, 0.2, True),
    "sun": lambda s: SunLight((0.3, 0.2, -1), s * COLOUR),
    "sun wide": lambda s: SunLight((0.3, 0.2, -1), s * COLOUR, 2.0),
    "rectangle": lambda s: AreaLight(AT, *SQUARE, s * COLOUR),
    "rectangle with spread": lambda s: AreaLight(AT, *SQUARE, s * COLOUR, spread=1.2),
    "parallelogram": lambda s: AreaLight(AT, *SHEARED, s * COLOUR, spread=2.0),
    "ellipse": lambda s: AreaLight(AT, *SHEARED, s * COLOUR, "ellipse"),
    "ellipse with spread": lambda s: AreaLight(AT, (1.5, 0.1, 0), (0.2, 1.3, 0.1), s * COLOUR, "ellipse", 0.7),
    "beam": lambda s: AreaLight(AT, *SHEARED, s * COLOUR, spread=0.0),
    "emissive": lambda s: EmissiveTriangles(CORNERS, s * GLOW),
    "picture": lambda s: EnvironmentWorld(s * PICTURE),
}


def assert_uniform(*values):
    """Each value is the probability of a smaller one: together they must fill the unit square (or line) evenly."""
    stacked = np.stack(values, axis=1)
    assert stacked.min() >= -1e-9
    assert stacked.max() <= 1 + 1e-9
    counts, _ = np.histogramdd(np.clip(stacked, 0, 1), bins=16, range=[(0, 1)] * len(values))
    assert chisquare(counts.ravel()).pvalue > LEAST_P


def turn(x, y):
    """Azimuth as a share of a full turn."""
    return np.arctan2(y, x) / (2 * np.pi) + 0.5
