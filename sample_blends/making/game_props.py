"""Low-poly things for the street corner, each standing on z = 0 around the z axis."""

from __future__ import annotations

import numpy as np

from .surfaces import Surface, box, joined, lathe, net


def crate() -> Surface:
    """A wooden crate 0.9 m wide: panels set back between edges, welded so that a bevel can round it."""
    half, rim, depth = 0.45, 0.08, 0.035
    inner = half - rim
    outside = [(-half, -half), (half, -half), (half, half), (-half, half)]
    inside = [(-inner, -inner), (inner, -inner), (inner, inner), (-inner, inner)]
    rings = np.array(
        [[(*p, half) for p in outside], [(*p, half) for p in inside], [(*p, half - depth) for p in inside]]
    )
    border = net(rings.transpose(1, 0, 2), closed=True)
    panel = np.linspace(-inner, inner, 4)
    boards = net(np.stack([*np.meshgrid(panel, panel, indexing="ij"), np.full((4, 4), half - depth)], axis=-1)).of(1)
    side = joined([border, boards])
    sides = [side.turned(90.0, "x").turned(90.0 * n) for n in range(4)]
    return joined([side, side.turned(180.0, "x"), *sides]).welded().moved(z=half)


def barrel() -> list[Surface]:
    """A barrel of ten staves with iron hoops and a lid."""
    wood = [
        (0.30, 0.0),
        (0.345, 0.2),
        (0.365, 0.45),
        (0.345, 0.70),
        (0.30, 0.9),
        (0.27, 0.9),
        (0.27, 0.86),
        (0.01, 0.86),
    ]
    hoops = []
    for low, radius in ((0.12, 0.332), (0.70, 0.35)):
        ring = [(radius, low), (radius + 0.018, low), (radius + 0.018, low + 0.07), (radius - 0.012, low + 0.07)]
        hoops.append(lathe(ring, 10).of(1))
    return [lathe(wood, 10), *hoops]


def bench() -> list[Surface]:
    """A bench along x: three boards to sit on, two to lean on, iron feet."""
    boards = [box((-0.8, y, 0.42), (0.8, y + 0.13, 0.46), 0.2) for y in (-0.24, -0.08, 0.08)]
    boards += [box((-0.8, 0.23, z), (0.8, 0.265, z + 0.13), 0.2) for z in (0.58, 0.76)]
    feet = []
    for x in (-0.62, 0.56):
        feet.append(box((x, -0.22, 0.0), (x + 0.06, -0.16, 0.42), 0.2, without="-z +z").of(1))
        feet.append(box((x, 0.21, 0.0), (x + 0.06, 0.23, 0.89), 0.2, without="-z").of(1))
        feet.append(box((x, -0.24, 0.38), (x + 0.06, 0.21, 0.42), 0.2, without="+z +y").of(1))
    return [*boards, *feet]


def lamp_post() -> list[Surface]:
    """A six-sided post with an arm towards +x and a lantern whose glass shines."""
    post = lathe([(0.16, 0.0), (0.16, 0.18), (0.07, 0.32), (0.05, 1.6), (0.045, 2.95), (0.09, 3.02), (0.01, 3.15)], 6)
    arm = box((0.03, -0.03, 2.84), (0.72, 0.03, 2.90), 0.2, without="-x")
    roof = lathe([(0.17, 2.74), (0.17, 2.77), (0.02, 2.86)], 6).moved(x=0.62)
    glass = lathe([(0.09, 2.66), (0.13, 2.74)], 6).moved(x=0.62).of(1)
    return [post, arm, roof, glass]


def bush(random) -> Surface:
    """A round bush of jagged facets in two greens."""
    angle = np.linspace(0.06, 0.96, 8) * np.pi
    profile = np.column_stack([0.42 * np.sin(angle), 0.36 - 0.36 * np.cos(angle)])
    return _two_greens(_jagged(lathe(profile, 11), random, 0.16), random, 0)


def conifer(random) -> list[Surface]:
    """A low-poly fir in a round bed: trunk and four tiers."""
    bed = lathe([(0.75, 0.0), (0.70, 0.16), (0.58, 0.20), (0.12, 0.24)], 8)
    trunk = lathe([(0.12, 0.24), (0.08, 0.9)], 8)
    tiers = []
    for low, radius in ((0.75, 0.95), (1.35, 0.78), (1.95, 0.58), (2.5, 0.36)):
        profile = [(0.06, low + 0.12), (radius, low), (0.55 * radius, low + 0.42), (0.02, low + 1.0)]
        tiers.append(_two_greens(_jagged(lathe(profile, 11), random, 0.10), random, 1))
    return [bed, trunk, *tiers]


def planter(random) -> list[Surface]:
    """A square brick box with a clipped bush."""
    sides = box((-0.25, -0.25, 0.0), (0.25, 0.25, 0.42), 0.2, without="-z")
    angle = np.linspace(0.08, 0.97, 7) * np.pi
    ball = lathe(np.column_stack([0.24 * np.sin(angle), 0.66 - 0.26 * np.cos(angle)]), 9)
    return [sides, _two_greens(_jagged(ball, random, 0.12), random, 1)]


def _jagged(surface: Surface, random, share: float) -> Surface:
    surface.vertices[:, :2] *= 1.0 + share * random.uniform(-1.0, 1.0, (len(surface.vertices), 1))
    return surface


def _two_greens(surface: Surface, random, first: int) -> Surface:
    return surface.of(first + random.integers(0, 2, len(surface.faces)))
