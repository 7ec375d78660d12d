"""Test the figures of both texts as functions and as commands."""

import re
import subprocess
import sys

import numpy as np
import pytest
from shown import FIGURES, numbers

import rbcourse as rb
from rbcourse import paper, report
from rbcourse.__main__ import FIGURES as COMMAND
from rbcourse.draw.drawing import run
from rbcourse.draw.save import csv_text

STORED = {f"paper_fig{name}": draw for name, draw in paper.FIGURES.items()}
STORED |= {f"report_fig{name}": draw for name, draw in report.FIGURES.items()}


def sigma_of(name, data):
    return np.stack([data[f"{name} sigma{k} [rad]"] for k in "123"], axis=-1)


@pytest.mark.source("BK Fig. 1", "BK Fig. 2", "BK Fig. 3", "BK Fig. 4", "BK Fig. 5")
@pytest.mark.source("RR Fig. 4", "RR Fig. 5", "RR Fig. 6", "RR Fig. 7", "RR Fig. 8", "RR Fig. 9")
@pytest.mark.parametrize("name", STORED)
def test_figures_of_the_texts_have_the_stored_numbers(name):
    drawing, stored = STORED[name](), numbers(name)
    assert drawing.name == name
    assert list(drawing.data) == list(stored)
    for column, values in drawing.data.items():
        if stored[column].dtype.kind == "U":
            assert np.array_equal(values, stored[column])
        else:
            off = np.abs(np.ravel(values) - stored[column])
            assert (off < 1e-11 * np.maximum(1, np.abs(stored[column]))).all()


def test_the_stored_names_are_all_figures_of_the_texts():
    assert set(STORED) == {file.stem for file in FIGURES.glob("*_fig*.pdf")}


def test_one_argument_changes_a_figure():
    w1 = [0.5, 1, 7]
    data = paper.figure_4(w1=w1).data
    ends = np.eye(3), rb.exp_so3(paper.SIGMA), paper.SIGMA, w1
    for name, make in (("optimum", rb.minimum_acceleration), ("projection", rb.projected_cubic)):
        want = rb.log_so3(make(*ends)(data["t [1]"]))
        assert np.abs(sigma_of(name, data) - want).max() < 1e-12
    data = report.figure_4(rng=7).data
    v0 = np.stack([data[f"uniform v0 {axis} [1]"] for axis in "xyz"], axis=-1)
    assert np.abs(v0 - rb.sample_rotation(100, rng=7)[:, :, 2]).max() < 1e-15
    data = paper.figure_2("b", angles=[0.5, 1, 2]).data
    assert np.array_equal(np.unique(data["angle [rad]"]), [0.5, 1, 2])
    ends = [np.eye(4), rb.pose_from_coordinates([0.3, 0, 1, 2, 1, 0])]
    rates = {"w0": [1, 0, 0], "w1": [0, 1, 0], "d0_dot": [0, 0, 2], "d1_dot": [3, 0, 0]}
    drawing = paper.figure_5("b", sigma=[0.3, 0, 1], d=[2, 1, 0], **rates)
    twists = rb.twist_from_rates(ends, [[1, 0, 0], [0, 1, 0]], [[0, 0, 2], [3, 0, 0]])
    curve = rb.projected_cubic(*ends, *twists)
    places = np.stack([drawing.data[f"{x} [m]"] for x in "xyz"], axis=-1)
    assert np.abs(places - curve(drawing.data["t [1]"])[:, :3, 3]).max() < 1e-12
    rotation, moving = rb.acceleration_cost_parts(curve)
    assert f"the projected one {rotation:.6g}" in drawing.alt
    assert f"translation costs {moving:.6g}." in drawing.alt
    route = report.figure_7(plan=[([1, 0, 0], 1), ([0, 1, 1], 0.55)]).data
    assert len(route["x [m]"]) == 1 + 10 + 6
    assert [float(x[-1]) for x in route.values()] == pytest.approx([1, 0.55, 0.55])


@pytest.mark.parametrize(
    ("draw", "options", "message"),
    [
        (paper.figure_2, {"panel": "c"}, "panel: one of 'a', 'b' is wanted, got 'c'"),
        (paper.figure_3, {"angles": [1, 4]}, "angles.1. is 4.0, an angle above 0 and below π"),
        (paper.figure_4, {"w1": [1, 2]}, "w1: shape"),
        (paper.figure_5, {"d0_dot": 1}, "d0_dot: shape"),
        (
            paper.figure_4,
            {"sigma": [180, 0, 0]},
            "sigma: a norm below π is wanted, in rad, got 180",
        ),
        (report.figure_4, {"steps": 0}, "steps: an integer from 1 up"),
        (report.figure_6, {"goal": [1, 2]}, "goal: shape"),
    ],
)
def test_bad_arguments_are_named(draw, options, message):
    with pytest.raises(ValueError, match=f"^{message}"):
        draw(**options)


def test_the_command_draws_figures_into_files(tmp_path, capsys):
    words = ["--w1", "0.5", "-1e0", "7", "BK4c", "--folder", str(tmp_path / "my own")]
    run(COMMAND, words)
    said = capsys.readouterr().out
    assert "paper_fig4c: png, pdf, csv, txt" in said
    assert "The optimal rotation costs" in " ".join(said.split())
    files = sorted(path.name for path in (tmp_path / "my own").iterdir())
    assert files == [f"paper_fig4c.{kind}" for kind in ("csv", "pdf", "png", "txt")]
    text = (tmp_path / "my own" / "paper_fig4c.txt").read_text("utf-8")
    assert text.startswith("python -m rbcourse --w1 0.5 -1e0 7 BK4c --folder '")
    assert "The optimal rotation costs" in " ".join(text.split())
    written = (tmp_path / "my own" / "paper_fig4c.csv").read_text("utf-8")
    assert written == csv_text(paper.figure_4(w1=[0.5, -1, 7]).data)
    run(COMMAND, ["rr6", "--goal", "4", "2", "1", "--folder", str(tmp_path)])
    assert (tmp_path / "report_fig6.pdf").exists()
    for words, message in {
        "6 --folder x": "FIGURE: one of BK1, BK2a, .*RR9 or all is wanted, got 6",
        "BK2a --w1 1 2 3": "figure BK2a has no option --w1",
        "BK4c --w1 1 2": "argument --w1: expected 3 arguments",
        "BK5a --d0_dot 1 2": "argument --d0_dot: expected 3 arguments",
        "BK2a --angles 1": "angles: two or more increasing",
    }.items():
        with pytest.raises(SystemExit):
            run(COMMAND, [*words.split(), "--folder", str(tmp_path / "no")])
        assert re.search(message, capsys.readouterr().err)
    assert not (tmp_path / "no").exists()


def test_lines_of_coordinates_do_not_show_jumps():
    """The optimum passes 180° several times."""
    drawing = paper.figure_4(w1=[0, 0, 40])
    for line in drawing.figure.axes[1].lines[:3]:
        steps = np.abs(np.diff(line.get_ydata()))
        assert np.isnan(steps).any()
        assert np.nanmax(steps) < 1
    assert all(np.isfinite(column).all() for column in drawing.data.values())


def test_one_command_knows_the_figures_of_both_texts():
    told = subprocess.run(
        [sys.executable, "-m", "rbcourse", "--help"], capture_output=True, text=True, check=True
    )
    for name in [f"BK{name}" for name in paper.FIGURES] + [f"RR{name}" for name in report.FIGURES]:
        assert name in told.stdout


def test_a_family_of_other_angles_has_a_legend():
    legend = paper.figure_3(angles=[0.5, 1, 2]).figure.axes[1].get_legend()
    assert [text.get_text() for text in legend.get_texts()] == ["28.65°", "57.3°", "114.6°"]
