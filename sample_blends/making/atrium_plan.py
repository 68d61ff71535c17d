"""The plan of the atrium: bays of ``2 * ARCH`` between piers of ``PIER``, square, around an open court."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .surfaces import Surface, net

ARCH, PIER = 1.1, 0.5
PITCH = 2 * ARCH + PIER
BAYS = (5, 3)
#: chords of one arch
CHORDS = 14
#: half the open court, and half the whole building, along x and y, in metres
COURT = tuple(0.5 * (n * PITCH - PIER) for n in BAYS)
HOUSE = tuple(half + PITCH for half in COURT)


@dataclass(frozen=True)
class Level:
    """Heights of one storey in metres: its floor, where its arches spring, and the top of its wall."""

    floor: float
    springing: float
    top: float


LEVELS = (Level(0.0, 2.6, 4.0), Level(4.3, 6.25, 7.65))


def from_middle(coordinate: np.ndarray, half: float) -> np.ndarray:
    """Distance from the middle of the bay along one axis, at most ARCH (as on piers and ribs)."""
    return np.minimum(np.abs((coordinate - half + ARCH + 0.5 * PITCH) % PITCH - 0.5 * PITCH), ARCH)


def arch(distance: np.ndarray) -> np.ndarray:
    """Height of a round arch above its springing, at ``distance`` from its middle."""
    return np.sqrt(np.maximum(ARCH**2 - distance**2, 0.0))


def vault(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Height above the springing of all groin vaults, ribs and arches, which are one surface over the plan.

    Two barrels cross in each bay and the higher one counts, so the vaults meet the round arches of the arcade
    and of the rear wall, and rest on the piers.
    """
    return arch(np.minimum(from_middle(x, COURT[0]), from_middle(y, COURT[1])))


def stations(half: float) -> np.ndarray:
    """Plan lines from -half to half, denser towards the piers, so that arches have chords of one length."""
    bay = ARCH - ARCH * np.cos(np.pi * np.arange(CHORDS + 1) / CHORDS)
    count = round((2 * half + PIER) / PITCH)
    return np.concatenate([bay + PITCH * n - half for n in range(count)])


def piers(half: float) -> np.ndarray:
    """The middles of the piers between the bays of one side."""
    count = round((2 * half + PIER) / PITCH)
    return PITCH * np.arange(1, count) - 0.5 * PIER - half


def covered(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Whether plan points belong to the walk around the court, without what the piers stand on."""
    in_court = (np.abs(x) < COURT[0]) & (np.abs(y) < COURT[1])
    in_arcade = (np.abs(x) < COURT[0] + PIER) & (np.abs(y) < COURT[1] + PIER) & ~in_court
    on_pier = in_arcade & (from_middle(x, COURT[0]) >= ARCH) & (from_middle(y, COURT[1]) >= ARCH)
    return ~in_court & ~on_pier


def around(halves: tuple[float, float], side) -> list[Surface]:
    """Four sides of a rectangle, facing inwards: ``side(half)`` makes one of that half length on y = 0, facing -y."""
    return [side(halves[turn % 2]).moved(y=halves[1 - turn % 2]).turned(90 * turn) for turn in range(4)]


def wall(x: np.ndarray, low, high, rows: int) -> Surface:
    """A wall over the line y = 0 between heights ``low`` and ``high`` at the stations ``x`` (n,), facing -y."""
    share = np.linspace(0.0, 1.0, rows + 1)
    low, high = (np.broadcast_to(z, x.shape)[:, None] for z in (low, high))
    z = (1 - share) * low + share * high
    return net(np.stack([np.broadcast_to(x[:, None], z.shape), np.zeros_like(z), z], axis=-1))
