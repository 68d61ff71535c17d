"""Writes docs/calibration.md: how often the reported 95 % intervals hold the converged value, over repeated seeds.

    python tools/measure_calibration.py [-o docs/calibration.md] [--seeds 100] [--photons 12000] [--points 80]

Bakes the scenes of tests/analytic/calibration.py once per seed, for several disc radii and numbers of crossings; each
estimate is held against the mean of the other seeds, and against one bake with --limit photons, which has hardly any
blur left. Rows that would need more photons per bake are left out.
"""

import argparse
import platform
import sys
from pathlib import Path

import numpy as np
from detp.detp_addon.tables import markdown_table

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests" / "analytic"))

import calibration  # noqa: E402 the folder has just been made known

RADII = (0.01, 0.05, 0.2, 1.0)
CROSSINGS = (1, 5, 20, 100, 1000)
QUALITIES = ("draft", "preview", "final")
HEADING = """# Can the standard error be trusted?

Each row repeats a bake with many seeds and counts how often E ± 1.96 standard errors holds the value that E tends to.
It should be 95 % of the points. There are two such values, since discs are used the more finely the more photons there
are ([method.md](method.md), *Nested discs*). *Mean*: that of the other seeds, what bakes with so many photons give on
average, blur included. *Limit*: one bake with {limit} photons and the same radius, where hardly any blur is left;
intervals hold it as often as they should only if they count the blur that is still to go. The error of either value is
added.

*Below* and *above* are estimates whose interval misses the mean because they are too low and too high; *variance* is
the reported over the true one, the median over the points; *crossings* is the squared signal to noise of the median
point: so many equal crossings have this noise, and points within a factor of two of it count. The last column is the
standard error of the coverage of the mean.

Where few segments cross a disc, the intervals stay honest by counting one crossing more than there were, and hold the
value more often than they say. The error of a sum over RGB takes its channels for fully correlated: cautious, too.

The mean is held in 93 to 97 % of the points from about twenty crossings on. So is the limit by discs of a twentieth of
the scene's radius, and nearly so by those of a fifth; the automatic radius mostly lies below a tenth. Discs as large as
the scene leave blur that noise hides, and hold the limit the less often the smaller their noise is. Shadow rays come in
rounds, four at least; where points are alike, their groups know the variance that so few rounds cannot tell.
"""
PHOTONS = (
    "scene | radius / scene's | photons | crossings | mean, RGB sum | single channels | limit, RGB sum | "
    "single channels | below | above | variance | ±"
)
SHADOW = "scene | quality | crossings | mean, RGB sum | single channels | below | above | variance | ±"


def main() -> int:
    options = parse()
    versions = f"NumPy {np.__version__}, Python {platform.python_version()}"
    command = f"python tools/measure_calibration.py --seeds {options.seeds} --points {options.points}"
    setting = f"Made by `{command} --photons {options.photons}`; {versions}."
    lines = [HEADING.format(limit=f"{options.limit:,}".replace(",", " ")), setting, ""]
    lines += ["## Photons: direct and indirect light from crossings", ""]
    lines += [markdown_table(PHOTONS.split(" | "), told(crossing_rows(options)))]
    lines += ["", "## Shadow rays: direct light alone", ""]
    lines += [markdown_table(SHADOW.split(" | "), told(shadow_rows(options)))]
    options.output.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return 0


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "docs" / "calibration.md")
    parser.add_argument("--seeds", type=int, default=100)
    parser.add_argument("--points", type=int, default=80)
    parser.add_argument("--photons", type=int, default=12_000, help="most photons of one bake")
    parser.add_argument("--limit", type=int, default=2_000_000, help="photons of the bake that is taken for the limit")
    return parser.parse_args()


def told(rows):
    for row in rows:
        print(*row, sep=" | ", flush=True)
        yield row


def crossing_rows(options):
    for name, make in calibration.SUBJECTS.items():
        subject = make(points=options.points)
        for share in RADII:
            settings = {"radius": share * subject.scene.bounds.radius, "direct": "photons"}
            limit = None
            for crossings in CROSSINGS:
                photons = calibration.photons_for(subject, crossings, options.photons, **settings)
                if photons > options.photons:
                    break
                limit = limit or calibration.limit_of(subject, options.limit, **settings)
                measured = calibration.repeated(subject, options.seeds, photons=photons, **settings)
                mean, held = (calibration.coverage(*measured, spread=2.0, limit=value) for value in (None, limit))
                yield row([name, f"{share:g}", f"{photons}"], mean, held)


def shadow_rows(options):
    for name, make in calibration.SUBJECTS.items():
        subject = make(points=options.points)
        for quality in QUALITIES:
            settings = {"quality": quality, "indirect": "off", "direct": "shadow-rays"}
            measured = calibration.repeated(
                subject, options.seeds, radius=0.01 * subject.scene.bounds.radius, **settings
            )
            yield row([name, quality], calibration.coverage(*measured))


def row(cells: list[str], mean: calibration.Coverage, *limits: calibration.Coverage) -> list[str]:
    shares = [share for found in (mean, *limits) for share in (found.sums, found.channels)] + [mean.below, mean.above]
    shares = [f"{share:.1%}" for share in shares]
    return [*cells, f"{mean.crossings:.0f}", *shares, f"{mean.variance:.2f}", f"{mean.doubt:.1%}"]


if __name__ == "__main__":
    sys.exit(main())
