"""Records: places where gather rays land, at which light is worked out beforehand, in two independent halves.

Each cell in which rays land has two records, at different places in it where there are any. The light of the first
comes from one half of the photons, that of the second from the other, so that what the halves differ by tells what
photons, places and shadow rays get wrong at all points that look into the cell; reflected_light.py parts the photons
further. Sources: Christensen, "Faster Photon Map Global Illumination", 1999 (irradiance worked out beforehand); Havran,
Herzog and Seidel, "Fast Final Gathering via Reverse Photon Mapping", 2005 (only where gather rays land).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..bounds import Bounds
from ..direct.lit_scene import LitScene
from ..discs import TangentDiscs
from ..lights.lamp_rays import towards
from ..parallel import ordered_map, slices
from ..random_streams import random_stream
from ..ranges import expanded
from ..rays import RayCaster
from ..rows import Rows
from ..sampling import cosine_hemisphere
from ..sides import BySide
from .cells import Cells

#: Rays that find out where gather rays land: so many a point, but in all no fewer and no more than these.
SCOUTS, LEAST_SCOUTS, MOST_SCOUTS = 8, 1 << 17, 1 << 20

#: Most cells: so many for each point, but at least and at most these.
CELLS_PER_POINT, LEAST_CELLS, MOST_CELLS = 0.5, 1 << 13, 1 << 16

#: About so large a share of the rays are to be too short to look something up, if there may be cells enough; but so
#: many cells are to be there as well, for light varies between walls that are far from each other, too.
SHORT, AMPLE = 0.15, 1 << 11

#: Radius of a record's disc over the side of the smallest cells. Discs of larger cells grow as the root of their side:
#: they are seen from afar, where what they blur is small, and there are photons enough for smaller ones.
WIDTH, GROWTH = 1.2, 0.5

#: Rays shorter than so many sides of the smallest cells look nothing up.
NEAR = 2.0

#: Photons that a bake may well have, and crossings of them that the smallest disc of a half is to have at least if they
#: come down evenly on the box around all landings but an outlying share on each side; of some shares and so many times
#: their boxes the least, lest what is far away and seldom seen makes all that is near coarse.
PHOTONS, CROSSINGS = 1 << 18, 8.0
OUTLYING = (0.02, 1.0), (0.1, 6.0), (0.25, 16.0)

#: Who looks around from where a ray landed stands so many tolerances of the caster off the surface, back along the ray,
#: which is free; rays that graze go back no farther than those of this cosine.
STAND_OFF, GRAZING = 8, 0.1

#: Of fewer landings than this nobody knows whether a wall runs through their cell.
LEAST_LANDINGS = 4

#: From so many landings in its half of a cell each record looks for lights: an edge of light may run through the cell.
LOOKOUTS = 2

#: Landings of a cell that do not see its records may do so from this share of the cell's side higher: over a bump.
HIGHER = 0.15

#: Points whose rays are cast at a time.
POINTS_PER_CHUNK = 1 << 13


@dataclass(frozen=True)
class Landings(Rows):
    """Where K gather rays landed, on surfaces that reflect light.

    places   (K, 3) metres
    stands   (K, 3) metres, just off the surface: who looks around from a landing stands there
    normals  (K, 3) unit normals of the surface, on the side that the ray came from
    lengths  (K,) metres of the rays
    """

    places: np.ndarray
    stands: np.ndarray
    normals: np.ndarray
    lengths: np.ndarray

    @classmethod
    def of(
        cls, caster: RayCaster, origins, directions, triangle: np.ndarray, places: np.ndarray, side: float = 1.0
    ) -> Landings:
        """Of rays from ``origins`` m along unit ``directions``, (K, 3), to ``triangle`` (K,) at ``places`` (K, 3).

        With ``side`` -1 they are on the other side of the surfaces.
        """
        away = places - origins
        lengths = np.sqrt(np.einsum("ij,ij->i", away, away))
        normals = caster.normals.take(triangle, axis=0)
        cosine = np.einsum("ij,ij->i", normals, directions)
        normals *= -side * np.copysign(1.0, cosine)[:, None]
        back = np.minimum(STAND_OFF * caster.tolerance(places) / np.maximum(np.abs(cosine), GRAZING), 0.5 * lengths)
        return cls(places, places - side * back[:, None] * directions, normals, lengths)


def scouted(lit: LitScene, points: np.ndarray, normals: np.ndarray, seed: int, least: int = LEAST_SCOUTS) -> Landings:
    """Where a few gather rays, ``least`` or more, land from ``points`` (N, 3), clear of surfaces, with unit ``normals``
    (N, 3)."""
    scene, caster = lit.scene, lit.caster
    wanted = np.clip(SCOUTS * len(points), least, MOST_SCOUTS)
    sides = [(1.0, BySide(scene.albedo.any(axis=-1, keepdims=True), caster.normals))]
    if scene.translucency is not None:
        sides.append((-1.0, BySide(scene.translucency.any(axis=-1, keepdims=True), caster.normals)))
    surfaces = lit.shadows.between.surfaces

    def found(rows: slice) -> Landings:
        generator = random_stream(seed, "scouts", rows.start)
        # As many rays from all points as are wanted together, where that is no whole number by chance.
        count = (wanted / len(points) + generator.random(rows.stop - rows.start)).astype(np.int64)
        spot = np.repeat(np.arange(rows.start, rows.stop), count)
        origins = points.take(spot, axis=0)
        directions = cosine_hemisphere(normals.take(spot, axis=0), generator.random((len(spot), 2)))
        parts = []
        for ray, hits, _ in surfaces.met(origins, directions):
            along = directions.take(ray, axis=0)
            for side, sends in sides:
                met = np.flatnonzero((hits.triangle >= 0) & sends.met(hits.triangle, along)[:, 0])
                begin, way = origins.take(ray.take(met), axis=0), along.take(met, axis=0)
                triangle, places = hits.triangle.take(met), hits.points.take(met, axis=0)
                parts.append(Landings.of(caster, begin, way, triangle, places, side))
        return Landings.joined(parts)

    return Landings.joined(list(ordered_map(found, slices(len(points), POINTS_PER_CHUNK))))


@dataclass(frozen=True)
class RecordFinder:
    """Finds the cell whose records tell of the light somewhere.

    corner   (3,) metres, from where cells are counted, and ``finest`` metres, the sides of the smallest
    numbers  (C,) uint64 of the cells, ascending
    cut      (C,) whether a wall may run through each, so that its records tell nothing
    """

    corner: np.ndarray
    finest: float
    numbers: np.ndarray
    cut: np.ndarray

    def __len__(self) -> int:
        return len(self.numbers)

    @property
    def near(self) -> float:
        """Metres: the light where shorter rays land is not looked up."""
        return NEAR * self.finest

    @cached_property
    def _cells(self) -> Cells:
        return Cells(self.corner, self.finest)

    def sides_of(self, lengths: np.ndarray) -> np.ndarray:
        """Sides (K,) metres of the cells into which rays of these ``lengths`` (K,) metres look."""
        return self._cells.sides(self._cells.levels(lengths))

    def rows(self, cells: np.ndarray) -> np.ndarray:
        """The rows (K,) of the ``cells`` of these numbers (K,), -1 where no record tells of the light there."""
        if len(self) == 0:
            return np.full(len(cells), -1)
        row = np.minimum(np.searchsorted(self.numbers, cells), len(self) - 1)
        return np.where((self.numbers.take(row) == cells) & ~self.cut.take(row), row, -1)

    def find(self, landings: Landings, lengths: np.ndarray) -> np.ndarray:
        """The cell (K,) whose records tell of the light at ``landings`` (K), -1 where none does.

        ``lengths`` (K,) metres are those of the ways there from where the light is wanted, over other landings or not.
        """
        cell = np.full(len(lengths), -1)
        far = np.flatnonzero(lengths >= self.near)
        places, normals = (part.take(far, axis=0) for part in (landings.places, landings.normals))
        cell[far] = self.rows(self._cells.numbers(places, normals, self._cells.levels(lengths.take(far))))
        return cell


class Records:
    """C cells with two records each, where ``landings`` of gather rays from ``points`` points are.

    ``finest`` metres are the sides of the smallest cells; None: as small as the number of records allows. ``beside``
    finds records whose cells these share.

    Attributes
    held      Landings of the 2 C records; those of the second half follow those of the first
    seen      (2 C,) how many landings each record speaks for
    lookouts  Landings from where records look for lights: LOOKOUTS of the first one, of the next, and so on
    sides     (C,) metres of the cells
    radii     (2 C,) metres, of their discs
    finder    finds the cells
    """

    def __init__(
        self,
        caster: RayCaster,
        landings: Landings,
        points: int,
        seed: int,
        finest: float | None = None,
        beside: RecordFinder | None = None,
    ):
        if beside is not None:
            corner, finest = beside.corner, beside.finest
        else:
            corner = _corner(caster)
            finest = _affordable(caster, landings, points) if finest is None else finest
        numbered = Cells(corner, finest)
        # What only rays see that are followed on is no part of what is seen from afar.
        landings = landings.taken(np.flatnonzero(landings.lengths > 0.5 * NEAR * finest))
        order = random_stream(seed, "records").permutation(len(landings.lengths))
        landings = landings.taken(order)
        cells, cell, count = np.unique(_numbers(numbered, landings), return_inverse=True, return_counts=True)
        self._landings = landings.taken(np.argsort(cell, kind="stable"))
        # Half of a cell's landings are the first record's, the rest the other's; a lone one is both's.
        start, half = np.cumsum(count) - count, np.maximum(count // 2, 1)
        self._begin = np.concatenate([start, start + np.minimum(half, count - 1)])
        self.seen = np.concatenate([half, np.maximum(count - half, 1)])
        self.held = self._landings.taken(self._begin)
        self.lookouts = self._landings.taken((self._begin[:, None] + np.arange(LOOKOUTS) % self.seen[:, None]).ravel())
        self.sides = numbered.sides(numbered.levels_of(cells))
        self.radii = np.tile(WIDTH * finest * (self.sides / finest) ** GROWTH, 2)
        cut = _cut(caster, landings, self.held, cell, self.sides)
        self.finder = RecordFinder(corner, finest, cells, cut)

    def __len__(self) -> int:
        return len(self.radii) // 2

    def more_lookouts(self, records: np.ndarray) -> tuple[np.ndarray, Landings]:
        """All other landings that these ``records`` (K,) speak for, and for each of them (L,) which record that is."""
        row, place = expanded(self._begin[records] + LOOKOUTS, np.maximum(self.seen[records] - LOOKOUTS, 0))
        return records[row], self._landings.taken(place)

    @property
    def discs(self) -> TangentDiscs:
        """The records' discs, 2 C."""
        return TangentDiscs(self.held.places, self.held.normals, self.radii)


def _numbers(cells: Cells, landings: Landings) -> np.ndarray:
    return cells.numbers(landings.places, landings.normals, cells.levels(landings.lengths))


def _corner(caster: RayCaster) -> np.ndarray:
    """From where (3,) cells are counted: no surface is likely to lie there, on which rounding would tell the cell."""
    box = Bounds.of(caster.corners.reshape(-1, 3))
    return box.centre - box.radius


def _affordable(caster: RayCaster, landings: Landings, points: int) -> float:
    """Sides of the smallest cells, metres, such that hardly any rays are too short, and cells are not too many."""
    if len(landings.lengths) == 0:
        return caster.radius
    corner, step = _corner(caster), 2.0**0.25

    def count(finest: float) -> int:
        seen = landings.lengths > 0.5 * NEAR * finest
        return len(np.unique(_numbers(Cells(corner, finest), landings)[seen]))

    most, allowed = int(np.clip(CELLS_PER_POINT * points, LEAST_CELLS, MOST_CELLS)), _photons_allow(landings)
    finest = max(float(np.quantile(landings.lengths, SHORT)) / NEAR, allowed)
    found = count(finest)
    while finest > allowed and found < AMPLE:
        finest = max(finest / step, allowed)
        found = count(finest)
    while finest < caster.radius and found > most:
        finest *= step
        found = count(finest)
    return finest


def _photons_allow(landings: Landings) -> float:
    """Sides of cells, metres, below which discs would be crossed too seldom."""
    areas = []
    for share, times in OUTLYING:
        low, high = np.quantile(landings.places, (share, 1.0 - share), axis=0)
        areas.append(2.0 * times * float(Bounds(low, high).face_areas.sum()))
    area = min(areas)
    return np.sqrt(2.0 * CROSSINGS * area / PHOTONS / np.pi) / WIDTH


def _cut(caster: RayCaster, landings: Landings, held: Landings, cell: np.ndarray, sides: np.ndarray) -> np.ndarray:
    """Whether (C,) a wall may run through each cell: one of ``landings`` (K), in ``cell`` (K,), does not see a record.

    ``held`` are the records' 2 C landings, ``sides`` (C,) the cells' in metres.
    """
    cut = np.bincount(cell, minlength=len(sides)) < LEAST_LANDINGS
    for half in (0, len(sides)):
        record = cell + half
        hidden = np.flatnonzero(_between(caster, landings.stands, held.stands.take(record, axis=0)))
        rows, record = hidden, record.take(hidden)
        rise = HIGHER * sides.take(cell.take(rows))[:, None]
        here, there = landings.stands.take(rows, axis=0), held.stands.take(record, axis=0)
        above = here + rise * landings.normals.take(rows, axis=0)
        beyond = there + rise * held.normals.take(record, axis=0)
        blocked = _between(caster, here, above) | _between(caster, above, beyond) | _between(caster, there, beyond)
        cut[cell.take(rows[blocked])] = True
    return cut


def _between(caster: RayCaster, one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Whether (K,) anything lies between places (K, 3)."""
    directions, distances = towards(other - one)
    return caster.occluded(one, directions, distances) & (distances > 0)
