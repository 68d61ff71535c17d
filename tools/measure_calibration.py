"""Writes docs/calibration.md: how often the reported 95 % intervals hold the converged value, over repeated seeds.

    python tools/measure_calibration.py [-o docs/calibration.md] [--seeds 200] [--photons 20000] [--points 100]

Bakes the scenes of tests/analytic/calibration.py once per seed, for several disc radii and numbers of crossings; each
estimate is held against the mean of the other seeds. Rows that would need more photons per bake are left out.
"""

import argparse
import platform
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests" / "analytic"))

import calibration  # noqa: E402 the folder has just been made known

RADII = (0.01, 0.05, 0.2, 1.0)
CROSSINGS = (1, 5, 20, 100, 1000)
QUALITIES = ("draft", "preview", "final")
HEADING = """# Can the standard error be trusted?

Each row repeats a bake with many seeds and counts how often E ± 1.96 standard errors holds the converged value: the
mean of the other seeds, whose own error is added. It should be 95 % of the points. *Below* and *above* are estimates
whose interval misses the value because they are too low and too high; *variance* is the reported over the true one,
the median over the points; *crossings* is the squared signal to noise of the median point: so many equal crossings have
this noise, and points within a factor of two of it count. The last column is the standard error of the coverage.

Where few segments cross a disc, the intervals stay honest by counting one crossing more than there were, and hold the
value more often than they say. The error of a sum over RGB takes its channels for fully correlated: cautious, too.
"""
COLUMNS = "scene | {} | crossings | coverage, RGB sum | single channels | below | above | variance | ±"


def main() -> int:
    options = parse()
    versions = f"NumPy {np.__version__}, Python {platform.python_version()}"
    setting = (
        f"Made by `python tools/measure_calibration.py`: {options.seeds} seeds, {options.points} points; {versions}."
    )
    lines = [HEADING, setting, "", "## Photons: direct and indirect light from crossings", ""]
    lines += table("radius / scene's | photons", crossing_rows(options))
    lines += ["", "## Shadow rays: direct light alone", ""]
    lines += table("quality", shadow_rows(options))
    options.output.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return 0


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "docs" / "calibration.md")
    parser.add_argument("--seeds", type=int, default=200)
    parser.add_argument("--points", type=int, default=100)
    parser.add_argument("--photons", type=int, default=20_000, help="most photons of one bake")
    return parser.parse_args()


def table(settings: str, rows) -> list[str]:
    heading = COLUMNS.format(settings)
    lines = [f"| {heading} |", "|" + " --- |" * (heading.count("|") + 1)]
    for row in rows:
        print(row, flush=True)
        lines.append(row)
    return lines


def crossing_rows(options):
    for name, make in calibration.SUBJECTS.items():
        subject = make(points=options.points)
        for share in RADII:
            settings = {"radius": share * subject.scene.bounds.radius, "direct": "photons"}
            for crossings in CROSSINGS:
                photons = calibration.photons_for(subject, crossings, options.photons, **settings)
                if photons > options.photons:
                    break
                measured = calibration.repeated(subject, options.seeds, photons=photons, **settings)
                yield row([name, f"{share:g}", f"{photons}"], calibration.coverage(*measured, spread=2.0))


def shadow_rows(options):
    for name, make in calibration.SUBJECTS.items():
        subject = make(points=options.points)
        for quality in QUALITIES:
            settings = {"quality": quality, "indirect": False, "direct": "shadow-rays"}
            measured = calibration.repeated(
                subject, options.seeds, radius=0.01 * subject.scene.bounds.radius, **settings
            )
            yield row([name, quality], calibration.coverage(*measured))


def row(cells: list[str], found: calibration.Coverage) -> str:
    shares = (found.sums, found.channels, found.below, found.above)
    cells = [*cells, f"{found.crossings:.0f}", *(f"{share:.1%}" for share in shares)]
    return "| " + " | ".join([*cells, f"{found.variance:.2f}", f"{found.doubt:.1%}"]) + " |"


if __name__ == "__main__":
    sys.exit(main())
