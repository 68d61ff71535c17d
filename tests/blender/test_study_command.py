"""``detp study``: what it writes, with and without matplotlib, and what it says when it cannot begin."""

import json
import sys

import bpy
import pytest
from detp.core.study import quasi_static, run
from detp.core.study.run import Extent
from detp.detp_addon.command.command import main
from detp.detp_addon.study.plots import draw
from detp.detp_addon.study.report import PLOTS
from small_scenes import cube, grid, lamp, saved

TINY = Extent(
    q_points=300, q_lines=100, growth_points=(100, 200, 400), growth_lines=(50, 100, 200), spacings=(0.5, 2.0),
    scan_segments=1000, choice_segments=1500, crofton_lines=16_000, repeats=1,
    quasi_static=quasi_static.FramesExtent((0.02, 0.3), (0.1,), frames=2, points=300, segments=500),
)  # fmt: skip


@pytest.fixture
def samples(tmp_path):
    """Small scenes by the names of the study's own."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    grid("Floor")
    cube("Box")
    lamp()
    folder = tmp_path / "samples"
    folder.mkdir()
    for name in ("tree", "atrium"):
        saved(folder / f"{name}.blend")
    return folder


def test_it_writes_figures_tables_and_a_report_draws_every_plot_and_else_asks_for_matplotlib(
    samples, tmp_path, monkeypatch, capsys
):
    measured, real = [], run.run

    def remembered(*arguments):
        measured.append((yield from real(*arguments)))
        return measured[-1]

    monkeypatch.setattr(run, "QUICK", TINY)
    monkeypatch.setattr(run, "run", remembered)
    out, plots = tmp_path / "new" / "study", tmp_path / "plots"
    with monkeypatch.context() as without:
        without.setitem(sys.modules, "matplotlib", None)
        assert main(["study", "-o", str(out), "--quick", "--samples", str(samples), "--scenes", str(samples)]) == 0
    said = capsys.readouterr()
    assert said.err.strip() == 'detp: The plots need matplotlib: install it with pip install ".[study]".'
    figures = json.loads((out / "study.json").read_text())
    for key in ("q_optimum", "exponents", "cauchy_crofton", "chosen_by_theory"):
        assert key in figures
    for key in ("disc_index_saving", "crossover_d_over_spacing"):
        assert set(figures[key]) == {"tree", "atrium"}
    assert sorted(path.name for path in out.glob("*.csv")) == [
        "cauchy_crofton.csv", "choice.csv", "frames.csv", "growth.csv", "q.csv", "radius.csv", "slack.csv",
    ]  # fmt: skip
    assert "samples/tree" in (out / "choice.csv").read_text()
    assert "detp study --quick" in (out / "study.md").read_text()
    pytest.importorskip("matplotlib")
    plots.mkdir()
    draw(measured[0], plots)
    assert {path.name for path in plots.iterdir()} == {f"{name}.{end}" for name in PLOTS for end in ("svg", "png")}


@pytest.mark.parametrize(
    "arguments, said, status",
    [
        (["--samples", "nowhere"], "There is no scene at 'nowhere'", 1),
        (["--scenes", "nothing.blend"], "There is no scene at 'nothing.blend'", 1),
    ],
)
def test_it_says_what_is_missing(samples, tmp_path, capsys, arguments, said, status):
    if "--samples" not in arguments:
        arguments = [*arguments, "--samples", str(samples)]
    assert main(["study", "-o", str(tmp_path / "out"), *arguments]) == status
    assert said in capsys.readouterr().err
    (samples / "tree.blend").unlink()
    assert main(["study", "-o", str(tmp_path / "out"), "--samples", str(samples)]) == 1
    assert "lack tree" in capsys.readouterr().err
    assert main(["study"]) == 2
