"""What is drawn is what is in the table."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

import rbcourse as rb
from rbclassroom.figures import lesson03, lesson06, lesson09, lesson14

CURVE_TIMES = np.linspace(0, 1, 21)
SIGMA = np.array([0.3, 0.6, 0.9])
ENDS = np.eye(3), rb.exp_so3(SIGMA), SIGMA, SIGMA + np.array([1, 0, 0])
CURVES = {
    "optimum": rb.minimum_acceleration_so3(*ENDS),
    "projection": rb.projected_cubic_so3(*ENDS),
}
COORDINATES = lesson09.coordinate_table(CURVES, CURVE_TIMES)
POSES = rb.pose_from_coordinates([[0, 0, 0, 0, 0, 0], [0, 0, 1, 3, 4, 0], [0, 0, 1, 3, 4, 5]])
MOTION = rb.chain([0, 2, 4], POSES, leg=rb.geodesic_se3)
SMOOTH = rb.chain([0, 2, 4], POSES)
PROFILES = {"t [s]": [0, 1, 2], "speed [m/s]": [0, 2.5, 1], "turn [rad/s]": [1, 0, 0.25]}


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
    t = np.linspace(0, 1, 21)
    paths = {name: curve(t) @ [1, 0, 0] for name, curve in curves.items()}
    speeds = {name: np.linalg.norm(curve(t, 1), axis=-1) for name, curve in curves.items()}
    return t, paths, speeds


def test_a_family_shows_six_curves_that_differ_in_colour_and_dashes(ax, family):
    lines = lesson06.draw_family(ax, family)
    rows = [3, 7, 11, 15, 19, 21]
    for line, row in zip(lines, rows, strict=True):
        assert np.array_equal(line.get_ydata(), family["theta [1]"][row])
    labels = [text.get_text() for text in ax.get_legend().get_texts()]
    assert labels == ["π/6", "π/3", "π/2", "2π/3", "5π/6", "11π/12"]
    assert len({tuple(line.get_color()) for line in lines}) == 6
    assert len({str(line._dash_pattern) for line in lines}) == 6
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("time t", "θ")


def test_a_family_of_one_is_one_curve(ax, family):
    (line,) = lesson06.draw_family(ax, {name: column[5:6] for name, column in family.items()})
    assert np.array_equal(line.get_ydata(), family["theta [1]"][5])


def test_a_surface_spans_the_table(ax3d, family):
    (surface,) = lesson06.draw_surface(ax3d, family)
    points = np.concatenate([np.asarray(face) for face in surface._faces])
    for axis, column in enumerate(["t [1]", "angle [rad]", "theta [1]"]):
        assert points[:, axis].min() == family[column].min()
        assert points[:, axis].max() == family[column].max()


def test_an_angle_has_one_colour_on_the_curves_and_on_the_surface(ax, ax3d, family):
    (surface,) = lesson06.draw_surface(ax3d, family)
    starts = np.array([np.asarray(face)[:, 1].min() for face in surface._faces])
    for line, row in zip(lesson06.draw_family(ax, family)[:-1], [3, 7, 11, 15, 19], strict=True):
        faces = surface._facecolor3d[starts == family["angle [rad]"][row, 0]]
        assert len(faces) == 4
        assert np.array_equal(faces, np.tile(line.get_color(), (4, 1)))


def test_a_family_is_described_by_its_numbers(family):
    said = lesson06.describe_family(family)
    assert "for 22 angles" in said
    assert "for the largest angle, 11π/12 rad, it is 0, 0.0439, 0.5, 0.956, 1." in said


def test_the_chord_shows_its_cuts_and_their_projections(ax):
    z = np.array([1, 0.5 + 0.5j, 1j])
    arc = z / np.abs(z)
    table = dict(zip("txyab", [[0, 0.5, 1], z.real, z.imag, arc.real, arc.imag], strict=True))
    circle, *_, chord, projections = lesson06.draw_chord(ax, table)
    assert np.array_equal(chord.get_xydata(), np.array([z.real, z.imag]).T)
    assert np.array_equal(projections.get_xydata(), np.array([arc.real, arc.imag]).T)
    for artist in (circle, projections, *ax.texts):
        box = artist.get_window_extent()
        assert np.array_equal(box.corners(), np.clip(box.corners(), *ax.bbox.corners()[[0, 3]]))
    said = lesson06.describe_chord(table)
    assert "over 90 degrees, cut into 2 equal steps" in said


def test_motions_are_carried_points_and_speeds(motions):
    table = lesson06.path_table(*motions)
    t = table["t [1]"]
    assert np.abs(table["geodesic x [1]"] - np.cos(2 * t)).max() < 1e-15
    assert (
        np.abs(table["projected line y [1]"] - np.sin(2 * rb.projected_line.theta(t, 2))).max()
        < 1e-15
    )
    assert (
        np.abs(table["projected line speed [rad]"] - 2 * rb.projected_line.theta(t, 2, 1)).max()
        < 1e-14
    )


def test_paths_and_speeds_show_both_motions(ax, motions):
    t, paths, speeds = motions
    sphere = plt.figure().add_subplot(projection="space")
    for name, path, speed in zip(
        paths, lesson06.draw_paths(sphere, paths), lesson06.draw_speeds(ax, t, speeds), strict=True
    ):
        assert np.array_equal(path.get_data_3d(), paths[name].T)
        assert np.array_equal(speed.get_xydata(), np.transpose([t, speeds[name]]))
        assert path.get_color() == speed.get_color()
    plt.close(sphere.figure)
    said = lesson06.describe_paths(paths, speeds)
    assert "the geodesic takes the steps 57, 57 degrees; its speed is 2.00 at the start" in said
    assert "0.91 at the start, 3.11 in the middle, 0.91 at the end" in said


def test_the_style_is_part_of_the_package():
    with plt.style.context("rbcourse.rbcourse"):
        assert plt.rcParams["pdf.fonttype"] == 42


def test_the_table_holds_rotation_vectors():
    assert np.array_equal(COORDINATES["t [1]"], CURVE_TIMES)
    for name, curve in CURVES.items():
        sigma = np.array([COORDINATES[f"{name} sigma{i} [rad]"] for i in (1, 2, 3)]).T
        assert np.array_equal(sigma, rb.log_so3(curve(CURVE_TIMES)))


@pytest.mark.source("BK Fig. 4")
def test_paths_coordinates_and_differences_are_those_of_the_table(ax):
    fig, ax3d = plt.subplots(subplot_kw={"projection": "3d"})
    lines = lesson09.draw_coordinate_paths(ax3d, COORDINATES)
    sigma = [rb.log_so3(curve(CURVE_TIMES)).T for curve in CURVES.values()]
    for line, path in zip(lines, sigma, strict=True):
        assert np.array_equal(line.get_data_3d(), path)
    assert len({line.get_color() for line in lines}) == len(
        {line.get_linestyle() for line in lines}
    )
    plt.close(fig)
    for line, part in zip(
        lesson09.draw_coordinates(ax, COORDINATES), np.concatenate(sigma), strict=True
    ):
        assert np.array_equal(line.get_ydata(), part)
    apart = sigma[1] - sigma[0]
    for line, part in zip(lesson09.draw_difference(ax, COORDINATES), apart, strict=True):
        assert np.array_equal(line.get_ydata(), part)
    distance = np.linalg.norm(apart, axis=0)
    said = lesson09.describe_coordinates(COORDINATES)
    assert (
        f"most at t = {CURVE_TIMES[distance.argmax()]:g}, by {distance.max():.2g} rad in length"
        in said
    )


def test_equal_curves_are_said_to_coincide():
    same = lesson09.coordinate_table(dict.fromkeys(CURVES, CURVES["optimum"]), CURVE_TIMES)
    assert lesson09.describe_coordinates(same).endswith("They coincide at all times.")


def test_excess_is_drawn_on_logarithmic_axes(ax):
    scale = np.array([0.25, 0.5, 1])
    table = {"scale [1]": scale, "one excess [1]": scale**4, "two excess [1]": 2 * scale**4}
    one, two, slope = lesson09.draw_excess(ax, table)
    assert np.array_equal(one.get_ydata(), scale**4)
    assert np.array_equal(two.get_ydata(), 2 * scale**4)
    assert np.allclose(np.diff(np.log(slope.get_ydata())), 4 * np.log(2))
    assert (ax.get_xscale(), ax.get_yscale()) == ("log", "log")
    assert "one from 3.9e-03 to 1; two from 7.8e-03 to 2" in lesson09.describe_excess(table)


def test_speeds_are_those_of_the_motion():
    table = lesson14.profile_table(MOTION, 1, 5)
    assert table["t [s]"].tolist() == [0, 1, 2, 3, 4]
    assert np.allclose(table["angular speed [rad/s]"], [0.5, 0.5, 0, 0, 0], atol=1e-14)
    assert np.allclose(table["speed [m/s]"], 2.5, atol=1e-14)


def test_accelerations_are_those_of_the_body():
    table = lesson14.profile_table(SMOOTH, 2, 9)
    h = 1e-4
    for t, w, d in zip(*table.values(), strict=True):
        if t in (0, 2, 4):
            continue
        before, now, after = (SMOOTH(t + s)[:3, 3] for s in (-h, 0, h))
        assert d == pytest.approx(np.linalg.norm(after - 2 * now + before) / h**2, abs=1e-5)
        w_dot = (SMOOTH(t + h, 1) - SMOOTH(t - h, 1))[:3] / (2 * h)
        assert w == pytest.approx(np.linalg.norm(w_dot), abs=1e-6)


def test_each_column_has_its_axes_and_the_knots_their_lines():
    fig, axes = plt.subplots(2)
    lines = lesson14.draw_profiles(axes, PROFILES, [0, 1.5])
    for ax, line, label in zip(axes, lines, ("speed\n(m/s)", "turn\n(rad/s)"), strict=True):
        assert line.axes is ax
        assert ax.get_ylabel() == label
        assert line.get_xdata().tolist() == [0, 1, 2]
        knots = [other.get_xdata()[0] for other in ax.lines if other is not line]
        assert knots == [0, 1.5]
        assert ax.get_ylim()[1] > line.get_ydata().max()
    assert lines[0].get_ydata().tolist() == [0, 2.5, 1]
    assert axes[1].get_xlabel() == "time (s)"
    plt.close(fig)


def test_what_is_said():
    assert lesson14.describe_profiles(PROFILES, [0, 1.5]) == (
        "Over time, with dotted lines where poses are reached: speed (m/s), turn (rad/s). "
        "They go: speed up to 2.5 m/s at 1 s; turn up to 1 rad/s at 0 s. "
        "The poses are reached at 0, 1.5 s."
    )


def test_what_never_changes_has_axes_too():
    fig, axes = plt.subplots(2)
    lesson14.draw_profiles(
        axes, PROFILES | {"speed [m/s]": [0, 0, 0], "turn [rad/s]": [-1, 0, 3]}, []
    )
    assert [ax.get_ylim() for ax in axes] == [(0, 1), pytest.approx((-1.08, 3.24))]
    plt.close(fig)


def test_of_rotations_alone_there_is_no_profile():
    with pytest.raises(ValueError, match=r"^motion: a single curve on SE\(3\) wanted"):
        lesson14.profile_table(rb.geodesic_so3(np.eye(3), np.eye(3)), 1)


@pytest.mark.source("RR (8)")
def test_angles_are_drawn_in_degrees_and_described():
    t = np.linspace(0, 1, 11)
    letters = {"α": -t, "β": -t, "γ": 2 * t}
    table = {"t [1]": t} | {f"slow {name} [rad]": angle for name, angle in letters.items()}
    fig, ax = plt.subplots()
    lines = lesson03.draw_angles([ax], table)
    for line, (name, angle) in zip(lines, letters.items(), strict=True):
        assert line.get_label() == name
        assert np.array_equal(line.get_ydata(), np.degrees(angle))
    assert ax.get_title() == "slow"
    plt.close(fig)
    said = lesson03.describe_angles(table)
    assert "slow: β goes to -57 degrees, and the middle half of α's change takes 50.0 %" in said
