"""Glass balls and a golden ring in low sun: light gathered by refraction and reflection."""

from __future__ import annotations

from . import stage
from .regions import circle, rectangle, region
from .surfaces import ball, lathe

CELL = 0.007
#: radius, and place on the floor, in metres
CLEAR, AMBER, RING = (0.10, (-0.10, 0.14)), (0.065, (-0.24, -0.17)), (0.13, (0.17, -0.13))
THICKNESS, HEIGHT = 0.006, 0.06


def build() -> None:
    """Fill an empty file with the balls and the ring."""
    stage.empty_file(960, 600)
    radius, at = RING
    # The ring stands on a floor without a face under it.
    floor = region(rectangle(-0.45, -0.40, 0.45, 0.40), [circle(radius, 128, *at)], CELL)
    stage.add("Floor", [floor, region(circle(radius - THICKNESS, 128, *at), [], CELL)],
              [stage.material("Plaster", (0.70, 0.69, 0.66))])  # fmt: skip
    profile = [(radius, 0.0), (radius, HEIGHT), (radius - THICKNESS, HEIGHT), (radius - THICKNESS, 0.0)]
    ring = stage.add("Ring", [lathe(profile, 128).of(smooth=True)], [stage.metal("Gold", (1.0, 0.77, 0.34), 0.05)])
    ring.location = (*at, 0.0)
    for name, (size, place), colour in (("Clear", CLEAR, (1.0, 1.0, 1.0)), ("Amber", AMBER, (0.95, 0.45, 0.08))):
        made = stage.add(f"{name} ball", [ball(size, 32)], [stage.glass(f"{name} glass", colour, 1.5)])
        made.location = (*place, size)
    stage.sun(6.0, 38.0, 188.0, (1.0, 0.95, 0.88))
    stage.sky((0.75, 0.86, 1.0), 0.35)
    stage.camera((0.10, -0.90, 0.80), (0.02, -0.02, 0.03), 38.0)
