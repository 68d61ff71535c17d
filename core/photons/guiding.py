"""Learning where light must start to reach the points: a pilot's particles, and a tree of boxes that follows from them.

Light that falls on the outside of a house is traced for nothing. Which of a light's particles reach the points is a
question about the uniform numbers that they are made from, whatever the kind of light (as Guo, Bauszat, Bikker and
Eisemann, "Primary Sample Space Path Guiding", EGSR 2018, ask of paths from the camera). The guide is fixed before any
particle counts, and a particle's flux is divided by the density of its choice: whatever was learnt, the mean is right.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass

import numpy as np

from ..estimator.visible_area import VisibleDiscs
from ..gatherers.gatherer import Gatherer
from ..parallel import ordered_map
from ..random_streams import random_stream
from ..segments import Segments
from .emission_guide import Draws, EmissionGuide
from .emission_tree import grown
from .photon_light import PHOTONS_PER_TRACE
from .tracing import PhotonTracer

#: The pilot's part of all particles, its most, and fewer than the least teach nothing.
PILOT_SHARE = 1 / 16
MOST_PILOT = 1 << 18
LEAST_PILOT = 1 << 12

#: Share of the pilot that goes by power; what it teaches aims the rest, from which the guide is learnt.
FIRST_ROUND = 0.3

#: Shares of the probability that may stay by power alone: one over it is the most that aiming can raise the variance.
DEFENSIVE = (0.25, 0.5)

#: Gain that particles which the guide was not learnt from must find before it is used.
LEAST_GAIN = 1.1

#: Costs of emitting a particle, of tracing and searching a segment, and of a crossing, in those of a ray.
EMISSION_COST, SEGMENT_COST, CROSSING_COST = 1.0, 1.0, 0.5

#: Crossings of the pilot that are held; of more, those of every second, fourth, ... disc.
MOST_HELD = 1 << 22


@dataclass(frozen=True)
class Pilot:
    """What P particles were, how much each is of use, squared (P,), and what it cost (P,) in rays."""

    draws: Draws
    use: np.ndarray
    cost: np.ndarray


def learn_guide(
    tracer: PhotonTracer,
    gatherer: Gatherer,
    placed: VisibleDiscs,
    kind: str,
    light: np.ndarray,
    seed: int,
    particles: int,
) -> Generator[None, None, EmissionGuide]:
    """Learn to aim the lights of ``tracer`` at ``placed`` discs (N), over which ``gatherer`` searches, step by step.

    kind       of light that photons will bring, "indirect" or "caustic"; "direct" stands for all
    light      (N, 3) W/m^2 known already: points that have much of it need less of the photons
    particles  how many will be traced

    Returns the guide to use, which is the tracer's own when there is nothing to gain. Equal arguments give the same
    guide on any number of threads.
    """
    natural = tracer.guide
    count = min(int(PILOT_SHARE * particles), MOST_PILOT)
    if count < LEAST_PILOT:
        return natural
    first = int(FIRST_ROUND * count)
    guide = natural
    for number, share in enumerate((first, count - first)):
        pilot = yield from _pilot(tracer.guided(guide), gatherer, placed, kind, light, seed, number, share)
        # Every second one, so that both halves hold what all boxes sent.
        others = np.arange(share) % 2 == 1
        if not pilot.use[~others].any():
            return natural
        tried = grown(pilot.draws, pilot.use, pilot.cost, others, natural)
        yield
        gains = [tried.gain(tried.guide(defensive)) for defensive in DEFENSIVE]
        best = int(np.argmax(gains))
        last = number == 1
        if last and gains[best] < LEAST_GAIN:
            return natural
        whole = grown(pilot.draws, pilot.use, pilot.cost, np.zeros(share, bool), natural)
        guide = whole.guide(DEFENSIVE[best] if last else DEFENSIVE[-1])
        yield
    return guide


def _pilot(tracer, gatherer, placed, kind, light, seed, number, particles) -> Generator[None, None, Pilot]:
    """Trace the particles of round ``number`` and see what they bring, as :func:`learn_guide` says."""
    starts = range(0, particles, PHOTONS_PER_TRACE)
    shares = [min(PHOTONS_PER_TRACE, particles - start) for start in starts]

    def trace(task: tuple[int, int]):
        share, start = task
        return tracer.trace(share, random_stream(seed, "pilot", number, start), start)

    segments, draws = [], []
    for share, traced in zip(shares, ordered_map(trace, zip(shares, starts, strict=True)), strict=True):
        segments.append(traced.segments.weighted(share / particles))
        draws.append(traced.draws)
        yield
    segments = Segments.joined(segments)
    traced = segments.particle
    segments = segments if kind == "direct" else segments.of_kind(kind)
    use, crossed = yield from _uses(segments, particles, gatherer, placed, light)
    cost = EMISSION_COST + SEGMENT_COST * np.bincount(traced, minlength=particles) + CROSSING_COST * crossed
    return Pilot(Draws.joined(draws), use, cost)


def _uses(
    segments: Segments, particles: int, gatherer: Gatherer, placed: VisibleDiscs, light: np.ndarray
) -> Generator[None, None, tuple[np.ndarray, np.ndarray]]:
    """The squared use (P,) of each particle to the discs, and how many of them (P,) it crossed.

    The discs' relative standard errors, added up, are to be least. With X what a particle alone would give disc i,
    sigma_i the root of the mean of X^2 and E_i all of its light, the particle's part in that is X^2 / (E_i sigma_i).
    """
    discs, particle = len(placed.discs), segments.particle.astype(np.int64)
    power = np.abs(segments.flux).sum(axis=1) * particles
    found, squares = np.zeros(discs), np.zeros(discs)
    crossed = np.zeros(particles)
    held, count, every = [], 0, 1
    for crossings in gatherer.crossings(segments):
        crossed += np.bincount(particle.take(crossings.segment), minlength=particles)
        crossings = crossings.taken(placed.area.inside(placed.discs, segments, crossings))
        alone = power.take(crossings.segment) / placed.area.areas.take(crossings.disc)
        found += np.bincount(crossings.disc, alone, discs)
        squares += np.bincount(crossings.disc, alone**2, discs)
        held.append((crossings.disc, particle.take(crossings.segment), alone**2))
        count += len(crossings)
        while count > MOST_HELD:
            every *= 2
            held = [tuple(array[part[0] % every == 0] for array in part) for part in held]
            count = sum(len(part[0]) for part in held)
        yield
    total = found / particles + np.abs(light).sum(axis=1)
    wanted = np.flatnonzero((squares > 0) & (np.arange(discs) % every == 0))
    weight = np.zeros(discs)
    weight[wanted] = 1.0 / (total[wanted] * np.sqrt(squares[wanted] / particles))
    use = np.zeros(particles)
    for disc, who, square in held:
        use += np.bincount(who, square * weight.take(disc), particles)
        yield
    return use, crossed
