"""What is drawn is what is in the table."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

import rbcourse as rb
from rbcourse.draw import plots


@pytest.fixture
def ax():
    fig, ax = plt.subplots()
    yield ax
    plt.close(fig)


@pytest.fixture
def ax3d():
    fig, ax = plt.subplots(subplot_kw={"projection": "3d"})
    yield ax
    plt.close(fig)


@pytest.fixture
def family():
    angle, t = np.meshgrid(np.arange(1, 23) * np.pi / 24, np.linspace(0, 1, 5), indexing="ij")
    return {"angle [rad]": angle, "t [1]": t, "theta [1]": rb.projected_line.theta(t, angle)}


@pytest.fixture
def motions():
    R1 = rb.exp_so3([0, 0, 2])
    curves = {
        "geodesic": rb.geodesic_so3(np.eye(3), R1),
        "projected line": rb.projected_line_so3(np.eye(3), R1),
    }
    return plots.motion_table(curves, [1, 0, 0], np.linspace(0, 1, 21))


def test_a_family_shows_six_curves_that_differ_in_colour_and_dashes(ax, family):
    lines = plots.draw_family(ax, family)
    rows = [3, 7, 11, 15, 19, 21]
    for line, row in zip(lines, rows, strict=True):
        assert np.array_equal(line.get_ydata(), family["theta [1]"][row])
    labels = [text.get_text() for text in ax.get_legend().get_texts()]
    assert labels == ["π/6", "π/3", "π/2", "2π/3", "5π/6", "11π/12"]
    assert len({tuple(line.get_color()) for line in lines}) == 6
    assert len({str(line._dash_pattern) for line in lines}) == 6
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("time t", "θ")


def test_a_family_of_one_is_one_curve(ax, family):
    (line,) = plots.draw_family(ax, {name: column[5:6] for name, column in family.items()})
    assert np.array_equal(line.get_ydata(), family["theta [1]"][5])


def test_a_surface_spans_the_table(ax3d, family):
    (surface,) = plots.draw_surface(ax3d, family)
    points = np.concatenate([np.asarray(face) for face in surface._faces])
    for axis, column in enumerate(["t [1]", "angle [rad]", "theta [1]"]):
        assert points[:, axis].min() == family[column].min()
        assert points[:, axis].max() == family[column].max()


def test_a_family_is_described_by_its_numbers(family):
    said = plots.describe_family(family)
    assert "for 22 angles" in said
    assert "for the largest angle, 11π/12 rad, it is 0, 0.0439, 0.5, 0.956, 1." in said


def test_the_chord_shows_its_cuts_and_their_projections(ax):
    z = np.array([1, 0.5 + 0.5j, 1j])
    arc = z / np.abs(z)
    table = dict(zip("txyab", [[0, 0.5, 1], z.real, z.imag, arc.real, arc.imag], strict=True))
    *_, chord, projections = plots.draw_chord(ax, table)
    assert np.array_equal(chord.get_xydata(), np.array([z.real, z.imag]).T)
    assert np.array_equal(projections.get_xydata(), np.array([arc.real, arc.imag]).T)
    said = plots.describe_chord(table)
    assert "over 90 degrees, cut into 2 equal steps" in said


def test_motions_are_carried_points_and_speeds(motions):
    t = motions["t [1]"]
    assert np.abs(motions["geodesic x [1]"] - np.cos(2 * t)).max() < 1e-15
    assert (
        np.abs(motions["projected line y [1]"] - np.sin(2 * rb.projected_line.theta(t, 2))).max()
        < 1e-15
    )
    assert (
        np.abs(motions["projected line speed [rad]"] - 2 * rb.projected_line.theta(t, 2, 1)).max()
        < 1e-14
    )


def test_paths_and_speeds_show_both_motions(ax, ax3d, motions):
    for name, path, speed in zip(
        ["geodesic", "projected line"],
        plots.draw_paths(ax3d, motions),
        plots.draw_speeds(ax, motions),
        strict=True,
    ):
        shown = [motions[f"{name} {axis} [1]"] for axis in "xyz"]
        assert np.array_equal(path.get_data_3d(), shown)
        assert np.array_equal(speed.get_ydata(), motions[f"{name} speed [rad]"])
        assert path.get_color() == speed.get_color()
    said = plots.describe_paths(motions)
    assert "the geodesic takes the steps 57, 57 degrees; its speed is 2.00 at the start" in said
    assert "0.91 at the start, 3.11 in the middle, 0.91 at the end" in said


def test_the_style_is_part_of_the_package():
    with plt.style.context("rbcourse.rbcourse"):
        assert plt.rcParams["pdf.fonttype"] == 42
