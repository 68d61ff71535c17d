"""What users see between the vertices: light that baked files show on faces, beside Cycles' light at the same places.

    python tools/measure_faces.py SCENE.blend BAKED.blend[:ATTRIBUTE] ... --reference FILE.npz [--places N]
        [--samples N] [--worst N]
    python tools/measure_faces.py SCENE.blend BAKED.blend[:ATTRIBUTE] ... --faces FILE.npz [--worst N]

Places are drawn evenly over the area of all faces that a bake colours, as a render shows the scene, and kept where

- somebody could see them: from just off the face at least a sixteenth of the rays by the cosine is free over 5 % of the
  scene's radius, and they do not look at the insides of closed geometry (core/estimator/enclosure.py), so that what is
  buried or lies against something else does not count;
- they are lit: Cycles finds more than a thousandth of the median light there.

FILE.npz keeps Cycles' light at these places (E/pi: DIFFUSE without colour, two seeds), and is made if need be. With
--faces it is one of another kind: arrays "<object>|<seed>" (corners, 3) of light at corners that were moved nine tenths
of their way to the middles of their faces, NaN where there is none. A face's mean of them is compared then, weighed by
its area.

A baked file holds E/pi (the quantity `lighting`, in the attribute `irradiance` unless another is named) on corners or
vertices. It is interpolated over the triangles as Blender shows it, after modifiers; its faces may be finer than those
of the scene. Only objects that have colours in all of the files count.

The table: shares of the lit area that show less than half or a tenth, or more than twice, of what *each* of the two
seeds found; *seen*, the mean of |shown - true| / (shown + true + median light); median and 95th percentile of
|shown / true - 1|; the ratio of means; all of RGB sums. Of *seen* and of the percentiles the same figure of the
reference's own noise is taken out in squares; how large it is stands above the table.
"""

import argparse
import sys
from pathlib import Path

import bpy
import numpy as np
from detp.core.estimator.enclosure import unlit
from detp.detp_addon.command.blender_output import blender_silenced
from detp.detp_addon.files.open_files import open_blend
from detp.detp_addon.tables import markdown_table
from face_places import Places, cycles_places, given_places
from shown_faces import shown_faces

COLUMNS = ("bake", "< half", "< a tenth", "> twice", "seen", "median", "95 %", "mean")


def main() -> int:
    arguments = parse(sys.argv[1:])
    scene = Path(arguments.scene)
    with blender_silenced():
        open_blend(scene)
        if arguments.faces:
            places = given_places(arguments.faces)
        else:
            places = cycles_places(scene, Path(arguments.reference), arguments.places, arguments.samples)
        seen = len(places.area)
        places = places.taken(~unlit(places.light.mean(axis=0)))
        lit = len(places.area)
        bakes = {name: colours_shown(name, places) for name in arguments.baked}
    coloured = np.full(lit, True)
    for shown in bakes.values():
        coloured &= np.isfinite(shown).all(axis=1)
    missing = np.unique(places.object[~coloured[places.group]])
    places, bakes = places.taken(coloured), {name: shown[coloured] for name, shown in bakes.items()}
    light, area = places.light.sum(axis=2), places.area
    noise = errors(*reference_noise(light), area)
    print(f"{scene.name}: {len(area)} places, lit and coloured, of {lit} that are lit and {seen} that can be seen")
    print(f"Noise of the reference: seen {noise[0]:.3f}, median {noise[1]:.2%}, 95 % {noise[2]:.2%}")
    if len(missing):
        print(f"Without colours in one of the files, so left out: {', '.join(places.names[missing])}")
    rows = [row(name, figures(shown.sum(axis=1), light, area)) for name, shown in bakes.items()]
    print(markdown_table(COLUMNS, rows))
    for name, shown in bakes.items() if arguments.worst else ():
        print(f"\n{name}\n{worst_objects(shown.sum(axis=1), places, arguments.worst)}")
    return 0


def parse(arguments: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene")
    parser.add_argument("baked", nargs="*", help="without any, the reference is made and its noise told")
    source = parser.add_mutually_exclusive_group(required=True)
    source.add_argument("--reference", help="keeps Cycles' light; made if need be")
    source.add_argument("--faces", help="light near the middles of faces, made by others")
    parser.add_argument("--places", type=int, default=10_000, help="of a reference that is made")
    parser.add_argument("--samples", type=int, default=256, help="of each seed at a place")
    parser.add_argument("--worst", type=int, default=0, help="also name so many objects that show most light wrong")
    return parser.parse_args(arguments)


def colours_shown(baked: str, places: Places) -> np.ndarray:
    """What the file ``baked`` shows (G, 3) on the groups of ``places``, NaN on objects without colours."""
    path, attribute = parted(baked)
    open_blend(path)
    names = {row: str(places.names[row]) for row in np.unique(places.object)}
    faces = shown_faces([name for name in names.values() if name in bpy.data.objects], attribute)
    shown = np.full((len(places.positions), 3), np.nan)
    for row, name in names.items():
        if name in faces:
            rows = places.object == row
            shown[rows] = faces[name].at(places.positions[rows], places.facing[rows])
    return places.of_groups(shown)


def parted(baked: str) -> tuple[Path, str]:
    """The file and the attribute that BAKED.blend[:ATTRIBUTE] names."""
    path, blend, attribute = baked.rpartition(".blend:")
    return (Path(path + ".blend"), attribute) if blend else (Path(baked), "irradiance")


def figures(shown: np.ndarray, halves: np.ndarray, area: np.ndarray) -> dict[str, float]:
    """The figures of light ``shown`` (G,) where two seeds found ``halves`` (2, G), on an ``area`` (G,) each."""
    true, share = halves.mean(axis=0), area / area.sum()
    squares = errors(shown, true, share) ** 2 - errors(*reference_noise(halves), share) ** 2
    seen, median, high = np.sqrt(np.maximum(squares, 0.0)).tolist()
    return {
        "half": float(share[shown < halves.min(axis=0) / 2].sum()),
        "tenth": float(share[shown < halves.min(axis=0) / 10].sum()),
        "twice": float(share[shown > halves.max(axis=0) * 2].sum()),
        "seen": seen,
        "median": median,
        "95": high,
        "mean": float((share * shown).sum() / (share * true).sum()),
    }


def errors(shown: np.ndarray, true: np.ndarray, area: np.ndarray) -> np.ndarray:
    """*seen*, median and 95th percentile of the light ``shown`` (G,), on an ``area`` (G,) each."""
    away, share = np.abs(shown - true), area / area.sum()
    seen = (share * away / (shown + true + percentile(true, share, 50))).sum()
    return np.array([seen, percentile(away / true, share, 50), percentile(away / true, share, 95)])


def reference_noise(halves: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Light (G,) that is off by as much as the mean (G,) of two ``halves`` (2, G) is itself, and that mean."""
    mean = halves.mean(axis=0)
    return mean + np.abs(halves[0] - halves[1]) / 2, mean


def percentile(values: np.ndarray, share: np.ndarray, percent: float) -> float:
    """The value below which so many per cent of the area lie, ``share`` (G,) being that of each of ``values`` (G,)."""
    order = np.argsort(values)
    row = np.searchsorted(np.cumsum(share[order]), percent / 100)
    return float(values[order[min(row, len(order) - 1)]])


def row(name: str, found: dict[str, float]) -> list[str]:
    path, attribute = parted(name)
    shares = (f"{100 * found[key]:.2g} %" for key in ("half", "tenth", "twice"))
    errors = (f"{100 * found[key]:.3g} %" for key in ("median", "95"))
    return [f"{path.stem}, {attribute}", *shares, f"{found['seen']:.3f}", *errors, f"{found['mean']:.3f}"]


def worst_objects(shown: np.ndarray, places: Places, count: int) -> str:
    """A table of the objects that have most part in *seen*, the reference's noise included."""
    light, share = places.light.sum(axis=2), places.area / places.area.sum()
    true = light.mean(axis=0)
    wrong = share * np.abs(shown - true) / (shown + true + percentile(true, share, 50))
    dark = np.where(shown < light.min(axis=0) / 2, share, 0.0)
    owner = np.zeros(len(share), int)
    owner[places.group] = places.object
    parts = [np.bincount(owner, values, len(places.names)) for values in (share, wrong, dark)]
    order = np.argsort(-parts[1])[:count]
    rows = [[str(places.names[at]), *(f"{part[at]:.4f}" for part in parts)] for at in order]
    return markdown_table(("object", "share of the area", "part in seen", "share that shows < half"), rows)


if __name__ == "__main__":
    sys.exit(main())
