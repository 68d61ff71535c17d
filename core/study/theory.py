"""What a search costs by the study's theory: comparisons, from a handful of numbers of the scene.

The study assumes segments and points that are uniformly distributed. Then the share of the segments that meets a
convex set is the set's surface over that of the sphere around the scene (Cauchy and Crofton), and all below follows.
Symbols as in the study: n_R segments, n_P points, d disc radius, r0 first sphere, Q ratio of successive spheres.
Points fill a volume in the study, dimension D = 3; vertices lie on surfaces, D = 2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..discs import TangentDiscs
from ..gatherers.disc_index import LEAF
from ..gatherers.sphere_cache_plan import SLACK, Q, around

#: Spheres that a walk along the Morton curve makes, over (r0 / (r - d))^D, for D = 2 and 3: each is centred where the
#: walk left the one before, half of it lies behind, and the curve leaves it again and again. Measured on a sphere's
#: surface and in a ball, within a factor of 2.
WALK = (20.0, 14.0)


@dataclass(frozen=True)
class SearchProblem:
    """A search in the study's terms.

    segments   n_R
    points     n_P
    radius     d, metres
    around     r0, metres: the sphere around all discs
    dimension  D: 3 for points that fill a volume, 2 on surfaces
    """

    segments: float
    points: float
    radius: float
    around: float
    dimension: float

    @classmethod
    def of(cls, discs: TangentDiscs, segments: int, dimension: float = 2.0) -> SearchProblem:
        """The problem of ``discs``, N >= 1, whose centres lie on surfaces, and a number of segments."""
        _, radius = around(discs.centres, discs.radii)
        return cls(segments, len(discs), float(np.median(discs.radii)), radius, dimension)


def share_through(radius, around):
    """Share of uniform lines through a sphere ``around`` that meet one of ``radius`` in it: surface over surface.

    Cauchy and Crofton's formula, the study's second assumption.
    """
    return np.minimum(np.asarray(radius) / around, 1.0) ** 2


def rebuild_cost(q, dimension: float):
    """Cost of making spheres over Q, up to a factor: the sum over the levels of spheres made times their parent's list.

    Spheres of radius r made for points of dimension D grow as r^-D, lists as r^2, hence sum (r_i / Q)^2 r_i^-D from r0
    down to a fixed last sphere:

        D = 3   1 / (Q^2 (1 - Q)), least at Q = 2/3
        D = 2   1 / (Q^2 ln(1/Q)), least at Q = e^(-1/2) = 0.607

    [study, optimum "around 0.6-0.7"; D = 2 is ours.] Between them the geometric sum is q^-2 / (1 - q^(D - 2)).
    """
    q, power = np.asarray(q, float), dimension - 2.0
    steps = -np.log(q) if abs(power) < 1e-6 else (1.0 - q**power) / power
    return 1.0 / (q**2 * steps)


def best_q(dimension: float) -> float:
    """The Q of least :func:`rebuild_cost`, between e^(-1/2) for surfaces and 2/3 for volumes.

    With p = D - 2 the derivative vanishes where q^p (2 + p) = 2.
    """
    power = float(np.clip(dimension, 2.0, 3.0)) - 2.0
    return float(np.exp(-0.5) if power < 1e-6 else (2.0 / (2.0 + power)) ** (1.0 / power))


def spheres_made(problem: SearchProblem, radius):
    """How often the walk makes a sphere of ``radius``: WALK (r0 / (r - d))^D, but hardly more than once a point.

    A sphere serves the discs whose centres lie within r - d of its own [study: a disc must not leave the sphere].
    """
    free = np.maximum(np.asarray(radius, float) - problem.radius, 1e-9 * problem.around)
    made = np.interp(problem.dimension, (2.0, 3.0), WALK) * (problem.around / free) ** problem.dimension
    return np.maximum(1.0, 1.0 / (1.0 / made + 1.0 / problem.points))


def sphere_radii(problem: SearchProblem, q: float, last: float) -> np.ndarray:
    """r_i = r0 Q^i for i = 0, 1, ... as long as r_i >= ``last``."""
    count = max(0, int(np.floor(np.log(last / problem.around) / np.log(q) + 1e-9)))
    return problem.around * q ** np.arange(count + 1.0)


def sphere_cache_tests(problem: SearchProblem, q: float, last: float) -> tuple[float, float]:
    """Sphere Cache: comparisons of segments with spheres, and of segments with discs.

    sum over i of spheres_made(r_i) n_R (r_{i-1} / r0)^2, and n_P n_R (r_m / r0)^2 [study]. With d about the spacing
    the first grows as n_R n_P^(1/3) for D = 3, with large d the second as n_R n_P d^2 / r0^2.
    """
    radii = sphere_radii(problem, q, last)
    lists = problem.segments * share_through(radii, problem.around)
    made = spheres_made(problem, radii[1:])
    return float((made * lists[:-1]).sum()), float(problem.points * lists[-1])


def disc_index_tests(
    problem: SearchProblem, leaf: int = 1, balanced: bool = True, roots: int = 1
) -> tuple[float, float]:
    """Disc Indexing: comparisons of segments with the index's nodes, and with discs.

    Level k has 2^(D k) nodes of radius r0 2^-k, grown by d; a segment that meets a node is compared with its 2^D
    children, down to nodes that hold ``leaf`` points: sum over k of 2^(D k) ((r0 2^(1-k) + d) / r0)^2. With d about the
    spacing that is O(n_R n_P^(1/3)) for D = 3 [study] and O(n_R log n_P) for D = 2; with large d the last levels
    dominate with n_R n_P d^2 / r0^2 and the levels above add up to the study's log(r0 / d). An unbalanced index costs
    log n_P more [study]. ``roots`` trees share the points, all over the scene each.
    """
    leaves = max(problem.points / leaf / roots, 1.0)
    levels = np.arange(np.ceil(np.log2(max(leaves, 2.0)) / problem.dimension) + 1)
    nodes = np.minimum(2.0 ** (problem.dimension * levels), leaves)
    met = problem.segments * share_through(problem.around * 0.5**levels + problem.radius, problem.around)
    visits = (
        roots
        * float(problem.segments + (nodes[1:] * met[:-1]).sum())
        * (1.0 if balanced else np.log2(max(problem.points, 2.0)))
    )
    return visits, float(problem.points * met[-1])


def search_tests(name: str, problem: SearchProblem) -> float:
    """All comparisons of the search of that ``name``, "sphere-cache", with the Q and the last sphere that it takes by
    itself, "disc-index" or "disc-index, unbalanced"."""
    if name == "sphere-cache":
        return sum(sphere_cache_tests(problem, Q, SLACK * problem.radius))
    # The tree keeps discs apart by six sides; on a surface these lie apart anyway.
    roots = 6 if problem.dimension > 2.5 else 1
    return sum(disc_index_tests(problem, LEAF, "unbalanced" not in name, roots))


def outer_sphere_tests(problem: SearchProblem, moving: float, step: float, q: float) -> float:
    """Hybrid: comparisons of segments with the spheres between the scene and what moves, on average of a frame.

    moving  radius of the sphere around what moves, metres
    step    how far that goes in a frame, metres; infinite where all segments are other ones in each frame

    The study's walk, from frame to frame: sphere i serves as long as what moves stays in it, for r_i - ``moving``
    metres, so that a frame makes it anew, from the list around it, with chance min(1, step / (r_i - moving)). [ours]
    """
    radii = sphere_radii(problem, q, moving) if moving < problem.around else np.array([problem.around])
    lists = problem.segments * share_through(radii[:-1], problem.around)
    free = np.maximum(radii[1:] - moving, 1e-9 * problem.around)
    return float((np.minimum(step / free, 1.0) * lists).sum())
