"""The study's own arithmetic, and the whole study in miniature."""

import csv
import io
import itertools
import json

import numpy as np
import pytest
from detp.core.errors import NoLightError
from detp.core.gatherers.balanced_tree import BalancedTree
from detp.core.machine import Machine
from detp.core.study import growth, measure, q_scan, quasi_static
from detp.core.study.fields import StudyScene, spacing, uniform_discs, uniform_lines
from detp.core.study.measure import crossing, lowest
from detp.core.study.measure import growth as fitted_growth
from detp.core.study.run import Extent, run
from detp.detp_addon import tables
from detp.detp_addon.study import report

TINY = Extent(
    q_points=400, q_lines=160, growth_points=(200, 400, 800), growth_lines=(50, 100, 200), spacings=(0.5, 4.0),
    scan_segments=1500, choice_segments=2000, crofton_lines=32_000, repeats=1,
    quasi_static=quasi_static.FramesExtent((0.02, 0.3), (0.1,), frames=3, points=500, segments=1000),
)  # fmt: skip


def test_an_exponent_and_its_interval():
    sizes = np.array([10.0, 100.0, 1000.0, 10_000.0])
    exact = fitted_growth(sizes, 3 * sizes**0.4)
    assert exact == {"exponent": 0.4, "interval": [0.4, 0.4]}
    generator = np.random.default_rng(1)
    held = 0
    for _ in range(400):
        low, high = fitted_growth(sizes, sizes**0.4 * np.exp(0.1 * generator.normal(size=4)))["interval"]
        held += low <= 0.4 <= high
    assert 0.92 < held / 400 < 0.98


def test_the_lowest_place_and_the_crossing():
    q = np.linspace(0.2, 0.95, 16)
    assert lowest(q, np.exp((q - 0.613) ** 2)) == pytest.approx(0.613)
    assert lowest(q, q) == pytest.approx(0.2)
    assert crossing([1.0, 2.0, 4.0, 8.0], [0.5, 0.5, 2.0, 4.0]) == pytest.approx(np.sqrt(8.0))
    assert crossing([1.0, 2.0], [0.5, 0.9]) is None and crossing([1.0, 2.0], [1.5, 0.9]) is None


@pytest.mark.parametrize("kind", ["volume", "surface"])
def test_the_best_q_by_counted_tests_is_the_studys(kind):
    rows = q_scan.q_rows(kind, 2000, 400, least=0.4, most=0.81)
    assert 0.55 <= q_scan.optimum(rows, "tests") <= 0.75
    assert all(0.4 < row["theory"] / row["tests"] < 2.5 for row in rows)
    walked = q_scan.q_rows(kind, 600, 100, sort=False, least=0.6, most=0.63)[0]
    in_order = q_scan.q_rows(kind, 600, 100, least=0.6, most=0.63)[0]
    assert walked["tests"] > 1.3 * in_order["tests"]


def test_an_unbalanced_tree_is_deeper_and_finds_the_same():
    generator = np.random.default_rng(3)
    discs, lines = uniform_discs("volume", 2000, spacing("volume", 2000), generator), uniform_lines(300, generator)
    found = []
    for name in ("disc-index", "disc-index, unbalanced"):
        chunks = list(growth.GATHERERS[name](discs).crossings(lines))
        found.append({(s, d) for c in chunks for s, d in zip(c.segment.tolist(), c.disc.tolist(), strict=True)})
    assert found[0] == found[1] and len(found[0]) > 1000
    kind = np.zeros(2000, np.int64)
    levels = [len(BalancedTree.over(discs.centres, kind, 8, halves).levels) for halves in (None, growth.unbalanced)]
    assert levels[1] > levels[0]
    for node in range(9, 40):
        count = np.full(50, node)
        assert ((growth.unbalanced(count) >= 0) & (growth.unbalanced(count) < count)).all()


def room(name, points, seed):
    generator = np.random.default_rng(seed)
    discs, lines = uniform_discs("surface", points, 0.1, generator), uniform_lines(2000, generator)
    return StudyScene(name, 2 * points, discs.centres, discs.normals, 0.1, lines)


def test_the_whole_study_in_miniature():
    def dark():
        raise NoLightError("Nothing shines.")

    steps = run({"ball": lambda: room("ball", 900, 4)}, {"small": lambda: room("small", 60, 5), "dark": dark}, TINY)
    said = []
    while True:
        try:
            said.append(next(steps))
        except StopIteration as stop:
            found = stop.value
            break
    assert "dark is left out: Nothing shines." in said
    figures = json.loads(report.as_json(found))
    assert set(figures["q_optimum"]) == {"volume", "surface"}
    assert set(figures["disc_index_saving"]) == {"ball"}
    for by_size in figures["exponents"].values():
        for entry in (by_size["small_discs"], by_size["large_discs"]):
            low, high = entry["interval"]
            assert low <= entry["exponent"] <= high
            assert abs(entry["volume"]["n_R"]["exponent"] - 1.0) < 0.3
        assert "d" not in by_size["small_discs"]["volume"]
        low, high = by_size["large_discs"]["volume"]["d"]["interval"]
        assert 0.0 < by_size["large_discs"]["volume"]["d"]["exponent"] and low < high
    low, high = figures["cauchy_crofton"]["interval"]
    assert low < figures["cauchy_crofton"]["measured"] < high
    assert figures["cauchy_crofton"]["expected"] == pytest.approx(0.01)
    assert 0 <= figures["chosen_by_theory"]["right"] <= figures["chosen_by_theory"]["of"] == 4
    assert "ball" in figures["crossover_d_over_spacing"]
    assert {row["scene"] for row in found.tables["choice"]} == {"ball", "small"}
    assert set(figures["quasi_static"]) == {"uniform, 10% of the discs", "ball, 10% of the discs"}
    for name, rows in found.tables.items():
        read = list(csv.DictReader(io.StringIO(tables.as_csv(rows))))
        assert len(read) == len(rows) > 0, name
    text = report.as_markdown(found, "detp study", pictures=True)
    assert text.count("\n## ") == 7 and "(radius.svg)" in text and "| nan" not in text
    assert "svg" not in report.as_markdown(found, "detp study", pictures=False)


def test_all_ways_find_the_same_in_frames_and_as_much_as_the_theory_says():
    extent = quasi_static.FramesExtent((0.05, 0.3), (0.1,), frames=4, points=2000, segments=4000)
    rows = quasi_static.scene_rows(quasi_static.uniform_scene(extent), extent)
    for size, discs_are in itertools.product(extent.sizes, ("all", "moving")):
        here = [row for row in rows if (row["r/R"], row["discs"]) == (size, discs_are)]
        assert len({row["crossings"] for row in here}) == 1 and here[0]["crossings"] > 0
        for row in here:
            assert 0.4 < row.get("theory", row["work"]) / row["work"] < 2.5
    kept = {row["r/R"]: row["work"] for row in rows if row["search"] == "disc-index, outer spheres kept"}
    alone = {row["r/R"]: row["work"] for row in rows if (row["search"], row["discs"]) == ("disc-index", "moving")}
    assert kept[0.05] < 0.5 * alone[0.05]


def test_times_in_turn_are_put_right_by_the_speed_of_the_moment(monkeypatch):
    clock, slow = [0.0], itertools.count(2.0)
    monkeypatch.setattr(measure.time, "perf_counter", lambda: clock[0])
    monkeypatch.setattr(measure.time, "process_time", lambda: 2.0 * clock[0])
    pace = [1.0]

    def machine():
        pace.append(next(slow))
        return Machine(pace[-1], 1.5)

    monkeypatch.setattr(measure, "measured_machine", machine)

    def work(seconds, name):
        # Half of it at the speed that was measured, half at the one that will be.
        done.append(name)
        clock[0] += seconds * (pace[-1] + 0.5)

    done = []
    times = measure.in_turn({"short": lambda: work(0.01, "short"), "long": lambda: work(5.0, "long")}, 3)
    assert done == ["short", "long", "short", "short"]
    assert times["short"].wall == pytest.approx(0.01 * 4.0)
    assert times["long"].processor == pytest.approx(2.0 * 5.0 * 4.0)
