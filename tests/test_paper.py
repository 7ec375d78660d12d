"""Test the figures of both texts as functions and as commands."""

import re
import subprocess
import sys

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.figure import Figure
from shown import FIGURES, numbers

import rbcourse as rb
from rbcourse import paper, report
from rbcourse.draw import bodies, coordinates, families
from rbcourse.draw.drawing import run
from rbcourse.draw.save import csv_text

STORED = {f"paper_fig{name}": draw for name, draw in paper.FIGURES.items()}
STORED |= {f"report_fig{name}": draw for name, draw in report.FIGURES.items()}


def axes_of(*kinds):
    fig = Figure()
    return [fig.add_subplot(1, len(kinds), k, projection=kind) for k, kind in enumerate(kinds, 1)]


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


def test_one_argument_changes_a_figure(tmp_path):
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
    rest = paper.figure_5("b", velocities=np.zeros((2, 6))).data
    curve = rb.projected_cubic(*paper.POSES, *np.zeros((2, 6)))
    assert (
        np.abs(np.array([rest[f"{x} [m]"] for x in "xyz"]).T - curve(rest["t [1]"])[:, :3, 3]).max()
        < 1e-12
    )
    route = report.figure_7(plan=[([1, 0, 0], 1), ([0, 1, 1], 0.55)]).data
    assert len(route["x [m]"]) == 1 + 10 + 6
    assert [float(x[-1]) for x in route.values()] == pytest.approx([1, 0.55, 0.55])


@pytest.mark.parametrize(
    ("draw", "options", "message"),
    [
        (paper.figure_2, {"panel": "c"}, "panel: one of 'a', 'b' is wanted, got 'c'"),
        (paper.figure_2, {"angles": [1]}, "angles: two or more increasing"),
        (paper.figure_3, {"angles": [1, 4]}, "angles.1. is 4.0, an angle above 0 and below π"),
        (paper.figure_4, {"w1": [1, 2]}, "w1: shape"),
        (paper.figure_4, {"panel": "ab"}, "panel: one of 'a', 'b', 'c' is wanted, got 'ab'"),
        (paper.figure_5, {"poses": np.eye(4)}, "poses: shape"),
        (report.figure_4, {"steps": 0}, "steps: an integer from 1 up"),
        (report.figure_6, {"goal": [1, 2]}, "goal: shape"),
    ],
)
def test_bad_arguments_are_named(draw, options, message):
    with pytest.raises(ValueError, match=f"^{message}"):
        draw(**options)


def test_the_command_draws_figures_into_files(tmp_path, capsys):
    words = ["--w1", "0.5", "-1e0", "7", "4c", "--folder", str(tmp_path / "mine")]
    run("rbcourse.paper", paper.FIGURES, words)
    assert "paper_fig4c: png, pdf, csv" in capsys.readouterr().out
    files = sorted(path.name for path in (tmp_path / "mine").iterdir())
    assert files == ["paper_fig4c.csv", "paper_fig4c.pdf", "paper_fig4c.png"]
    written = (tmp_path / "mine" / "paper_fig4c.csv").read_text("utf-8")
    assert written == csv_text(paper.figure_4(w1=[0.5, -1, 7]).data)
    run(
        "rbcourse.report", report.FIGURES, ["6", "--goal", "4", "2", "1", "--folder", str(tmp_path)]
    )
    assert (tmp_path / "report_fig6.pdf").exists()
    for words, message in {
        "6 --folder x": "FIGURE: one of 1, 2a, .*5b or all is wanted, got 6",
        "2a --w1 1 2 3": "figure 2a has no option --w1",
        "4c --w1 1 2": "argument --w1: expected 3 arguments",
        "5a --velocities 1 2 3": "--velocities: 12 numbers are wanted, got 3",
        "2a --angles 1": "angles: two or more increasing",
    }.items():
        with pytest.raises(SystemExit):
            run("rbcourse.paper", paper.FIGURES, [*words.split(), "--folder", str(tmp_path / "no")])
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
    plt.close(drawing.figure)


def test_one_command_knows_the_figures_of_both_texts():
    told = subprocess.run(
        [sys.executable, "-m", "rbcourse", "--help"], capture_output=True, text=True, check=True
    )
    for name in [f"BK{name}" for name in paper.FIGURES] + [f"RR{name}" for name in report.FIGURES]:
        assert name in told.stdout


@pytest.mark.source("BK Fig. 1")
def test_the_description_of_the_moving_frame_states_its_numbers():
    poses = rb.pose_from_coordinates([[0] * 6, [0, 0, np.pi / 2, 1, 2, 3]])
    said = bodies.describe_moving_frame(["F", "M"], poses)
    assert "(1, 2, 3) m" in said
    assert "90 degrees" in said


@pytest.mark.source("BK Fig. 2", "BK Fig. 3")
def test_the_curves_of_a_family_have_the_colours_of_its_surface():
    angle, t = np.meshgrid(np.arange(1, 23) * np.pi / 24, np.linspace(0, 1, 5), indexing="ij")
    table = {"angle [rad]": angle, "t [1]": t, "theta [1]": rb.straight_line.theta(t, angle)}
    ax, space = axes_of(None, "3d")
    families.draw_family(ax, table)
    rows = {"30°": 3, "90°": 11, "150°": 19, "165°": 21}
    for line, row in zip(ax.lines, rows.values(), strict=True):
        assert np.allclose(line.get_data(), [t[0], table["theta [1]"][row]], 1e-14, 1e-14)
    assert [line.get_label() for line in ax.lines] == list(rows)
    assert len({str(line._dash_pattern) for line in ax.lines}) == 4
    families.draw_surface(space, table)
    if not hasattr(space.collections[0], "_faces"):
        pytest.skip("the corners of surfaces are new in Matplotlib 3.10")
    faces = np.array([face[:4] for face in space.collections[0]._faces])
    for line, row in zip(ax.lines[:3], rows.values(), strict=False):
        chosen = faces[..., 1].min(axis=1) == angle[row, 0]
        colours = space.collections[0]._facecolor3d[chosen]
        assert np.array_equal(colours, np.tile(line.get_color(), (4, 1)))
    for line in ax.lines:  # this is the WCAG contrast with white
        rgb = np.array(line.get_color()[:3])
        linear = np.where(rgb > 0.04045, ((rgb + 0.055) / 1.055) ** 2.4, rgb / 12.92)
        assert 1.05 / (linear @ [0.2126, 0.7152, 0.0722] + 0.05) > 3
    said = families.describe_family(table)
    assert "22 angles a from 7.5° to 165°, with a colour for each: a surface (left)" in said
    assert "for the largest angle, 165°, it is 0, 0.0439, 0.5, 0.956, 1." in said


def test_a_family_of_other_angles_has_a_legend():
    angle, t = np.meshgrid([0.5, 1, 2], np.linspace(0, 1, 5), indexing="ij")
    (ax,) = axes_of(None)
    table = {"angle [rad]": angle, "t [1]": t, "f [1]": rb.straight_line.f(t, angle)}
    families.draw_family(ax, table)
    shown = [text.get_text() for text in ax.get_legend().get_texts()]
    assert shown == ["28.65°", "57.3°", "114.6°"]


@pytest.mark.source("BK Fig. 4")
def test_the_comparison_draws_and_names_the_coordinates():
    data = numbers("paper_fig4c")
    fig = Figure()
    coordinates.draw_comparison(fig, data)
    best, near = (sigma_of(name, data).round(14) for name in ("optimum", "projection"))
    drawn = [np.array(line.get_ydata()) for line in fig.axes[1].lines]
    assert np.abs(np.array(drawn) - [*best.T, *near.T]).max() < 1e-15
    for line, part in zip(fig.axes[2].lines, (near - best).T, strict=True):
        assert np.abs(line.get_ydata() - part).max() < 1e-15
    named = {text.get_text().strip(): text.get_color() for ax in fig.axes for text in ax.texts}
    curves = {line.get_label(): line.get_color() for ax in fig.axes for line in ax.lines}
    for name in ("optimum", "projection", r"$\sigma_1$", r"$\sigma_2$", r"$\sigma_3$"):
        assert named[name] == curves[name]
    far = np.linalg.norm(sigma_of("projection", data) - sigma_of("optimum", data), axis=-1)
    words = f"t = {data['t [1]'][far.argmax()]:g}, by {far.max():.2g} rad in length"
    assert words in coordinates.describe_coordinates(data)
    same = data | {f"projection sigma{i} [rad]": data[f"optimum sigma{i} [rad]"] for i in "123"}
    assert "They coincide at all times." in coordinates.describe_coordinates(same)


def test_a_goal_of_a_half_turn_or_more_is_refused():
    with pytest.raises(ValueError, match="sigma: a norm below π is wanted, in rad, got 180"):
        paper.figure_4(sigma=[180, 0, 0])
