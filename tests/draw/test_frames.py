"""Frames: what is drawn is what is in the table."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

import rbcourse as rb
from rbcourse.draw import frames


@pytest.fixture
def ax3d():
    fig, ax = plt.subplots(subplot_kw={"projection": "3d"})
    yield ax
    plt.close(fig)


@pytest.mark.source("BK Fig. 1")
def test_the_moving_frame_shows_both_frames(ax3d):
    poses = np.stack([np.eye(4), np.eye(4)])
    poses[1, :3, :3], poses[1, :3, 3] = rb.exp_so3([0, 0, np.pi / 2]), [1, 2, 3]
    table = frames.pose_table(["F", "M"], poses)
    artists = frames.draw_moving_frame(ax3d, table)
    assert len(artists) == 8  # box, six axes, vector
    edges = np.array(artists[0]._segments3d)
    assert edges.shape == (12, 2, 3)
    assert np.abs(edges.mean(axis=(0, 1)) - [1, 2, 3]).max() < 1e-15
    assert np.abs(np.ptp(edges, axis=(0, 1)) - [1.0, 1.4, 0.7]).max() < 1e-15  # turned by 90°
    assert np.array_equal(artists[-1]._segments3d[0], [[1, 2, 3], [0, 0, 0]])
    texts = [text.get_text() for text in ax3d.texts]
    axes = [f"${axis}_{name}$" for name in "FM" for axis in "xyz"]
    assert texts == [*axes[:3], "{F}", *axes[3:], "{M}", "d"]
    said = frames.describe_moving_frame(table)
    assert "(1, 2, 3) m" in said
    assert "90 degrees" in said


@pytest.mark.source("RR 2.1")
def test_turned_boxes_carry_their_frames(ax3d):
    R = rb.exp_so3([[0, 0, np.pi / 2]])
    table = frames.pose_table(["turned"], rb.pose_from_components(R, [0, 0, 0]))
    box, *room, x, y, z = frames.draw_turns([ax3d], table)
    assert np.array_equal([np.ptp(line.get_data_3d(), axis=1) for line in room], 2.6 * np.eye(3))
    edges = np.array(box._segments3d)
    assert np.abs(np.ptp(edges, axis=(0, 1)) - [1.0, 1.6, 0.3]).max() < 1e-15
    for arrow, direction in zip((x, y, z), R[0].T, strict=True):
        shaft = np.array(arrow._segments3d[0])
        assert np.abs(shaft[np.linalg.norm(shaft, axis=1).argmax()] - 1.2 * direction).max() < 1e-12
    assert ax3d.get_title() == "turned"
    assert [text.get_text() for text in ax3d.texts] == ["x", "y", "z"]
    said = frames.describe_turns(table)
    assert "turned: x along +y, y along −x, z along +z." in said


@pytest.mark.source("RR (8)")
def test_angles_are_drawn_in_degrees_and_described():
    t = np.linspace(0, 1, 11)
    letters = {"α": -t, "β": -t, "γ": 2 * t}
    table = {"t [1]": t} | {f"slow {name} [rad]": angle for name, angle in letters.items()}
    fig, ax = plt.subplots()
    lines = frames.draw_angles([ax], table)
    for line, (name, angle) in zip(lines, letters.items(), strict=True):
        assert line.get_label() == name
        assert np.array_equal(line.get_ydata(), np.degrees(angle))
    assert ax.get_title() == "slow"
    plt.close(fig)
    said = frames.describe_angles(table)
    assert "slow: β goes to -57 degrees, and the middle half of α's change takes 50.0 %" in said
