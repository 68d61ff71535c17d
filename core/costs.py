"""What the parts of a bake cost, and by what it is told how long they will take.

Seconds are those of one processor of the reference, see machine.py. Where an error is aimed at, these and not the clock
decide what comes next, so that a seed gives the same light on every machine.
"""

from __future__ import annotations

#: Of a ray, of tracing a segment, and of a crossing.
RAY, SEGMENT, CROSSING = 7e-7, 1.2e-6, 2.5e-7

#: Crossings of a photon as long as none have been counted: many, so that a first step of little time keeps to it; and
#: what such a photon takes.
CROSSINGS = 50
PHOTON = SEGMENT + CROSSINGS * CROSSING

#: Of placing a disc. That takes about so many times as long as finding where its point stands.
PLACING, PLACING_OVER_STANDING = 5e-5, 5.0

#: How much longer than tracing a photon all takes that is done for it in a bake of a given time, shadow rays included.
FOR_A_PHOTON = 4.0

#: What whole bakes took, with all that goes with it: for each point (reading, fitting and writing, by one processor),
#: for each shadow ray and each photon.
WHOLE_POINT, WHOLE_RAY, WHOLE_PHOTON = 6.0e-5, 1.0e-6, 4.0e-6

#: The same for what gathers: for each point what is done whatever the error (its place, records, the first rounds), and
#: rays for as much light as a crossing brings; and by what share each lamp makes both dearer.
FIRST_GATHERED, GATHERED, LAMP = 2.5e-4, 8.5e-7, 0.08

#: Wall seconds before and beside all that.
START = 0.3
