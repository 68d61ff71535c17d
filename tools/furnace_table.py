"""Bakes white furnaces, where every point must read the same, and writes how far each estimator is off.

    python tools/furnace_table.py [-o docs/furnace.md] [--photons 300000] [--radii 0.02 0.05 0.1] [--more 10000000]

Every enclosure of tools/enclosures.py is read by the add-on and baked with direct light by photons, so that nothing but
the estimator is tested, once for each domain, estimator and radius. The colours are those that would be written, with
vertices averaged over their faces; elements that were filled from their neighbours are counted and left out.

The photons' noise hides small errors, so the visible estimator is measured a second time without: from random places
of each outline, and of what it leaves of each nested disc, rays are cast back along the directions that light comes
from, and it is counted how many meet a shining surface. That is what the estimate converges to, however finely the disc
is used: the nested disc counts that is farthest from one. And the corners are baked once more with so many photons
that what is hidden behind three standard errors becomes small.
"""

import argparse
import os
import platform
import sys
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from detp.core.bake import bake
from detp.core.discs import TangentDiscs
from detp.core.estimator.enclosure import unlit
from detp.core.estimator.rings import RINGS
from detp.core.estimator.visible_area import DIRECTIONS, VisibleDiscs, visible_discs
from detp.core.rays import RayCaster
from detp.core.result import BakeResult
from detp.core.sampling import cosine_hemisphere, frames
from detp.core.settings import BakeSettings
from detp.core.stages import finished
from detp.detp_addon.tables import markdown_table
from detp.detp_addon.writing.element_values import spread
from detp.detp_addon.writing.write_attributes import faces_of
from enclosures import ENCLOSURES, Furnace, furnace

#: how far from one counts as wrong, beyond three standard errors
ALLOWED = 0.02

#: rays that are cast back from each disc
LIMIT_RAYS = 512

DOCS = Path(__file__).parents[1] / "docs" / "furnace.md"

COLUMNS = ("enclosure", "domain", "radius m", "points", "filled", "plain: worst", "mean", "wrong", "visible: worst",
           "mean", "wrong", "limit: worst", "mean", "wrong")  # fmt: skip
MORE_COLUMNS = ("enclosure", "radius m", "corners", "standard error: median", "largest", "visible: worst", "mean",
                "wrong")  # fmt: skip


@dataclass(frozen=True)
class Readings:
    """What M elements read, with the standard error (M,), and how many more were filled from their neighbours."""

    values: np.ndarray
    errors: np.ndarray
    filled: int

    @property
    def worst(self) -> float:
        """The value farthest from one."""
        return float(self.values[np.abs(self.values - 1).argmax()])

    @property
    def wrong(self) -> float:
        """The share that is farther from one than allowed, beyond three standard errors."""
        return float((np.abs(self.values - 1) > ALLOWED + 3 * self.errors).mean())


def main() -> int:
    arguments = parse()
    rows = []
    for name, build in ENCLOSURES.items():
        for domain in ("CORNER", "POINT"):
            enclosure = furnace(build, domain)
            for radius in (*arguments.radii, None):
                rows.append(row(name, domain, enclosure, radius, arguments.photons))
                print(rows[-1], flush=True)
    more = []
    for name, build in ENCLOSURES.items():
        enclosure = furnace(build, "CORNER")
        more.append(row_with_more(name, enclosure, max(arguments.radii), arguments.more))
        print(more[-1], flush=True)
    lines = [*heading(arguments), markdown_table(COLUMNS, rows), "", *heading_of_more(arguments)]
    arguments.output.write_text("\n".join([*lines, markdown_table(MORE_COLUMNS, more), ""]), encoding="utf-8")
    return 0


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, default=DOCS)
    parser.add_argument("--photons", type=int, default=300_000)
    parser.add_argument(
        "--more", type=int, default=10_000_000, help="photons of the second table, of the largest radius"
    )
    parser.add_argument("--radii", type=float, nargs="*", default=[0.02, 0.05, 0.1])
    return parser.parse_args()


def heading(arguments: argparse.Namespace) -> list[str]:
    return [
        "# White furnaces",
        "",
        f"    python tools/furnace_table.py --photons {arguments.photons}",
        "",
        "Closed rooms in which all surfaces shine alike, about 2 m across (tools/enclosures.py): every vertex and",
        f"every corner must read 1. *Wrong* is the share that is off by more than {percent(ALLOWED, 0)} after three",
        "standard errors of noise: what the bake reports, but no less than is usual for discs of such an area.",
        "Noise alone puts up to 0.3 % of them there, more where few particles cross a disc. Now and then",
        "the inner part of a disc is taken for brighter by chance: such a point has more noise, and reports it.",
        f"*Limit* is the visible estimator without noise, from {LIMIT_RAYS} rays back from the nested disc",
        "that is farthest off. *Filled* are elements that look into something solid or that something covers, and",
        "that take their colours from their neighbours. The automatic radius is marked with *.",
        "",
        f"{os.cpu_count()} cores, {platform.machine()}.",
        "",
    ]


def heading_of_more(arguments: argparse.Namespace) -> list[str]:
    return [
        f"## With {arguments.more:,} photons".replace(",", " "),
        "",
        "The visible estimator alone, so that what three standard errors could hide is small.",
        "",
    ]


def percent(share: float, digits: int) -> str:
    return f"{share:.{digits}%}".replace("%", " %")


def row(name: str, domain: str, enclosure: Furnace, radius: float | None, photons: int) -> list[str]:
    """One line of the table."""
    plain, visible = (baked_with(enclosure, estimator, radius, photons) for estimator in ("plain", "visible"))
    placed = placed_discs(enclosure, visible.radius)
    noiseless = limit(enclosure, placed, LIMIT_RAYS, np.random.default_rng(1))
    readings = [
        elements(enclosure, visible.hidden, plain.irradiance[:, 0], errors(visible, placed.area.areas, plain.radius)),
        elements(enclosure, visible.hidden, visible.irradiance[:, 0], errors(visible, placed.area.areas)),
        elements(enclosure, visible.hidden, noiseless, np.zeros(len(noiseless))),
    ]
    cells = [name, domain.lower(), f"{visible.radius:.3g}" + "*" * (radius is None)]
    cells += [str(len(readings[0].values)), str(readings[0].filled)]
    for reading in readings:
        cells += [f"{reading.worst:.3f}", f"{reading.values.mean():.3f}", percent(reading.wrong, 1)]
    return cells


def row_with_more(name: str, enclosure: Furnace, radius: float, photons: int) -> list[str]:
    """One line of the second table."""
    visible = baked_with(enclosure, "visible", radius, photons)
    noise = errors(visible, placed_discs(enclosure, radius).area.areas)
    reading = elements(enclosure, visible.hidden, visible.irradiance[:, 0], noise)
    cells = [name, f"{radius:.3g}", str(len(reading.values))]
    cells += [percent(float(share), 1) for share in (np.median(reading.errors), reading.errors.max())]
    cells += [f"{reading.worst:.3f}", f"{reading.values.mean():.4f}", percent(reading.wrong, 1)]
    return cells


def baked_with(enclosure: Furnace, estimator: str, radius: float | None, photons: int) -> BakeResult:
    exported = enclosure.exported
    # What shines here is known to photons alone.
    settings = BakeSettings("final", photons, radius, estimator=estimator, direct="photons", indirect="photons")
    return finished(bake(exported.scene, exported.points, settings))


def errors(visible: BakeResult, areas: np.ndarray, whole: float | None = None) -> np.ndarray:
    """Standard error (N,) that readings of one have over the seen ``areas`` (N,) m^2, or over discs as a ``whole`` of
    this radius.

    Counted crossings follow the area, so the typical error tells that of a disc that hardly any particle crosses, whose
    own estimate of it is worth nothing. Where only the middle of a disc is used, its own error is larger than that.
    """
    typical = np.median(visible.standard_error[:, 0] * np.sqrt(areas))
    if whole is not None:
        return np.full(len(areas), typical / np.sqrt(np.pi * whole**2))
    return np.maximum(typical / np.sqrt(areas), visible.standard_error[:, 0])


def elements(enclosure: Furnace, hidden: np.ndarray, values: np.ndarray, noise: np.ndarray) -> Readings:
    """What the elements of all meshes read when their points read ``values`` (N,) and ``hidden`` (N,) ones nothing.

    ``noise`` (N,) is the values' standard error.
    """
    hidden = hidden | (enclosure.exported.covered & unlit(np.repeat(values[:, None], 3, axis=1)))
    read, filled = [np.zeros((0, 2))], 0
    for target in enclosure.exported.targets:
        faces = faces_of(bpy.data.objects[target.object_name].data, target.domain)
        rows = np.where((target.point_rows >= 0) & ~hidden[target.point_rows], target.point_rows, -1)
        colours = spread(np.stack([values, noise, np.zeros(len(values))], axis=1), rows, faces)
        own = np.zeros(len(colours), bool)
        own[faces.corner_vertex[rows >= 0] if faces.by_vertex else np.flatnonzero(rows >= 0)] = True
        read.append(colours[own, :2])
        filled += int((~own).sum())
    joined = np.concatenate(read)
    return Readings(joined[:, 0], joined[:, 1], filled)


def placed_discs(enclosure: Furnace, radius: float) -> VisibleDiscs:
    exported = enclosure.exported
    discs = TangentDiscs.of_radius(exported.centres, exported.normals, radius)
    caster = RayCaster(exported.scene.corners, exported.centres)
    return VisibleDiscs.joined(list(visible_discs(caster, discs, exported.inward, facing=exported.facing)))


def limit(enclosure: Furnace, placed: VisibleDiscs, rays: int, generator: np.random.Generator) -> np.ndarray:
    """What (N,) the visible estimator converges to, by ``rays`` back from random places of each nested disc: of the
    discs the one that is farthest from one.
    """
    caster, wide = RayCaster(enclosure.scene.corners), placed.discs.radii[:, None]
    reaches = [np.minimum(placed.area.reach, wide * 0.5**ring) for ring in range(RINGS)]
    found = np.stack([lit_share(enclosure, caster, placed.discs, reach, rays, generator) for reach in reaches])
    return np.take_along_axis(found, np.abs(found - 1).argmax(axis=0)[None], axis=0)[0]


def lit_share(enclosure, caster: RayCaster, discs: TangentDiscs, reach: np.ndarray, rays: int, generator) -> np.ndarray:
    """The share (N,) of ``rays`` back from random places of the discs' outlines ``reach`` (N, D) that meet light."""
    rows = np.arange(len(discs))
    angle = (np.arange(DIRECTIONS) * (2 * np.pi / DIRECTIONS))[:, None]
    first, second = (axis[:, None] for axis in frames(discs.normals))
    outline = reach[:, :, None] * (np.cos(angle) * first + np.sin(angle) * second)
    sectors = np.cumsum(reach * np.roll(reach, -1, axis=1), axis=1)
    lit = np.zeros(len(discs))
    for _ in range(rays):
        uniforms = generator.random((len(discs), 5))
        sector = (sectors < uniforms[:, :1] * sectors[:, -1:]).sum(axis=1) % DIRECTIONS
        root, along = np.sqrt(uniforms[:, 1:2]), uniforms[:, 2:3]
        here, following = outline[rows, sector], outline[rows, (sector + 1) % DIRECTIONS]
        origins = discs.centres + root * ((1 - along) * here + along * following)
        directions = cosine_hemisphere(discs.normals, uniforms[:, 3:5])
        lit += enclosure.lit(origins, directions, caster.first_hits(origins, directions).triangle)
    return lit / rays


if __name__ == "__main__":
    sys.exit(main())
