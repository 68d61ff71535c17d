"""What stands and hangs in the atrium: columns, pillars, the balustrade, the fountain, pots and banners."""

from __future__ import annotations

import numpy as np

from .atrium_plan import ARCH, PIER
from .regions import circle, rectangle, region
from .surfaces import Surface, box, frame, lathe, net, steps

SIDES = 24


def column(height: float) -> list[Surface]:
    """A round column between a square plinth and a square abacus of the pier's width, standing on z = 0."""
    half, top = 0.5 * PIER, height
    square_parts = [
        lathe([(half, 0.0), (half, 0.08), (half, 0.16)], SIDES, 1.0),
        lathe([(half, 0.16), (0.225, 0.16)], SIDES, (1.0, 0.0)),
        lathe([(0.205, top - 0.12), (half, top - 0.12)], SIDES, (0.0, 1.0)),
        lathe([(half, top - 0.12), (half, top)], SIDES, 1.0),
    ]
    base = [(0.225, 0.16), (0.24, 0.19), (0.24, 0.22), (0.215, 0.25), (0.19, 0.26), (0.19, 0.29), (0.17, 0.32)]
    rise = steps(0.32, top - 0.36, 0.19)[1:]
    share = (rise - 0.32) / (top - 0.68)
    shaft = np.column_stack([0.17 - 0.03 * share**1.6, rise])
    capital = [(0.165, top - 0.345), (0.165, top - 0.315), (0.142, top - 0.30), (0.145, top - 0.25)]
    capital += [(0.165, top - 0.19), (0.195, top - 0.14), (0.205, top - 0.12)]
    return [*square_parts, lathe([*base, *shaft, *capital], SIDES).of(smooth=True)]


def pillar(height: float) -> list[Surface]:
    """The square pillar at a corner of the court."""
    half = 0.5 * PIER
    foot = [(half, 0.0), (half, 0.14), (half - 0.03, 0.18)]
    head = [(half - 0.03, height - 0.20), (half, height - 0.14), (half, height)]
    rise = [(half - 0.03, z) for z in steps(0.18, height - 0.20, 0.2)[1:-1]]
    return [lathe([*foot, *rise, *head], 16, 1.0)]


def balustrade() -> list[Surface]:
    """Balusters and a rail between two columns, along x, standing on z = 0."""
    profile = [(0.07, 0.0), (0.07, 0.07), (0.042, 0.11), (0.072, 0.24), (0.07, 0.34), (0.036, 0.60), (0.042, 0.76)]
    profile += [(0.068, 0.83), (0.068, 0.92)]
    width = 2 * ARCH / 7
    posts = [lathe(profile, 8).of(smooth=True).moved(x=width * (n + 0.5) - ARCH) for n in range(7)]
    reach = ARCH + 0.09
    return [*posts, box((-reach, -0.1, 0.92), (reach, 0.1, 1.04), 0.2, without="-x +x")]


def pool(half_x: float, half_y: float, floor: float) -> tuple[list[Surface], Surface]:
    """A stone pool with a fountain on the ground at height ``floor``; and its water."""
    rim, depth = floor + 0.42, floor + 0.30
    stone = [
        frame(half_x, half_y, [(0.0, floor), (0.0, rim - 0.07)], 0.2),
        frame(half_x, half_y, [(0.0, rim - 0.07), (0.04, rim - 0.07), (0.04, rim)], 0.2),
        frame(half_x, half_y, [(0.04, rim), (-0.11, rim), (-0.26, rim), (-0.26, depth)], 0.2),
    ]
    foot = [(0.30, 0.0), (0.29, 0.06), (0.18, 0.14), (0.12, 0.34), (0.10, 0.60), (0.15, 0.74), (0.36, 0.84)]
    bowl = [(0.58, 0.98), (0.62, 1.10), (0.585, 1.10), (0.52, 1.0), (0.30, 0.92), (0.09, 0.90)]
    spout = [(0.07, 1.05), (0.06, 1.22), (0.11, 1.30), (0.12, 1.38), (0.08, 1.46), (0.005, 1.52)]
    stone.append(lathe(foot + bowl + spout, SIDES).of(smooth=True).moved(z=depth))
    inside = rectangle(0.26 - half_x, 0.26 - half_y, half_x - 0.26, half_y - 0.26)
    return stone, region(inside, [circle(0.30, SIDES)], 0.16).moved(z=depth)


def pot(random) -> tuple[Surface, Surface, Surface]:
    """A terracotta pot, the clipped tree in it and the tree's stem, standing on z = 0."""
    clay = [(0.20, 0.0), (0.24, 0.12), (0.29, 0.32), (0.31, 0.48), (0.35, 0.49), (0.35, 0.56), (0.30, 0.56)]
    clay += [(0.29, 0.50), (0.05, 0.50)]
    share = np.linspace(0.0, 1.0, 16)
    radius = 0.40 * np.sin(np.pi * share**0.6) ** 0.6 * (1.1 - share) + 0.01
    tree = lathe(np.column_stack([radius, 0.58 + 1.25 * share]), SIDES)
    tree.vertices[:, :2] *= random.uniform(0.84, 1.16, (len(tree.vertices), 1))
    return lathe(clay, SIDES).of(smooth=True), tree, lathe([(0.05, 0.50), (0.045, 0.62)], 8)


def banner(width: float, length: float) -> Surface:
    """A cloth hanging down from z = 0 in slow folds, facing -y."""
    x, z = np.meshgrid(steps(-0.5 * width, 0.5 * width, 0.07), steps(-length, 0.0, 0.1), indexing="ij")
    z = z - 0.18 * (1 - 2 * np.abs(x) / width) * (z / length) ** 2  # cut to a point
    folds = 0.03 * np.sin(9.0 * x + 0.8 * z) * (-z / length)
    return net(np.stack([x, folds, z], axis=-1)).of(smooth=True)
