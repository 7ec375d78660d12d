"""Speeds and accelerations over time: the numbers, the drawing, and what is said of it."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

import rbcourse as rb
from rbcourse.draw.profiles import describe_profiles, draw_profiles, profile_table

POSES = rb.pose_from_coordinates([[0, 0, 0, 0, 0, 0], [0, 0, 1, 3, 4, 0], [0, 0, 1, 3, 4, 5]])
MOTION = rb.chain([0, 2, 4], POSES, leg=rb.geodesic_se3)
SMOOTH = rb.chain([0, 2, 4], POSES)
TABLE = {"t [s]": [0, 1, 2], "speed [m/s]": [0, 2.5, 1], "turn [rad/s]": [1, 0, 0.25]}


def test_speeds_are_those_of_the_motion():
    table = profile_table(MOTION, 1, 5)
    assert table["t [s]"].tolist() == [0, 1, 2, 3, 4]
    assert np.allclose(table["angular speed [rad/s]"], [0.5, 0.5, 0, 0, 0], atol=1e-14)
    assert np.allclose(table["speed [m/s]"], 2.5, atol=1e-14)


def test_accelerations_are_those_of_the_body():
    table = profile_table(SMOOTH, 2, 9)
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
    lines = draw_profiles(axes, TABLE, [0, 1.5])
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
    assert describe_profiles(TABLE, [0, 1.5]) == (
        "Over time: speed up to 2.5 m/s at 1 s; turn up to 1 rad/s at 0 s. "
        "The poses are reached at 0, 1.5 s."
    )


def test_what_never_changes_has_axes_too():
    fig, axes = plt.subplots(2)
    draw_profiles(axes, TABLE | {"speed [m/s]": [0, 0, 0], "turn [rad/s]": [-1, 0, 3]}, [])
    assert [ax.get_ylim() for ax in axes] == [(0, 1), pytest.approx((-1.08, 3.24))]
    plt.close(fig)


def test_of_rotations_alone_there_is_no_profile():
    with pytest.raises(ValueError, match=r"^motion: a single curve on SE\(3\) wanted"):
        profile_table(rb.geodesic_so3(np.eye(3), np.eye(3)), 1)
