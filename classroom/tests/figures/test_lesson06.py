"""The moving frame of lesson 6."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

import rbcourse as rb
from rbclassroom.figures import lesson06


@pytest.fixture
def axes():
    fig, axes = plt.subplots(1, 2, subplot_kw={"projection": "space"})
    yield axes
    plt.close(fig)


def corners(cube):
    """The corners of the six faces and of the square, in space."""
    return cube.corners


@pytest.fixture
def ax3d():
    fig, ax = plt.subplots(subplot_kw={"projection": "space"})
    yield ax
    plt.close(fig)


@pytest.mark.source("BK Fig. 1")
def test_the_moving_frame_shows_both_frames(ax3d):
    poses = np.stack([np.eye(4), np.eye(4)])
    poses[1, :3, :3], poses[1, :3, 3] = rb.exp_so3([0, 0, np.pi / 2]), [1, 2, 3]
    artists = lesson06.draw_moving_frame(ax3d, ["F", "M"], poses)
    assert len(artists) == 8  # box, six axes, vector
    faces = corners(artists[0])[:6]
    assert np.abs(faces.mean(axis=(0, 1)) - [1, 2, 3]).max() < 1e-14
    assert np.abs(np.ptp(faces, axis=(0, 1)) - [1.0, 1.4, 0.7]).max() < 1e-14  # turned by 90°
    assert np.array_equal(np.transpose(artists[-1].get_data_3d())[:2], [[0, 0, 0], [1, 2, 3]])
    texts = [text.get_text() for text in ax3d.texts]
    axes = [f"${axis}_{name}$" for name in "FM" for axis in "xyz"]
    assert texts == [*axes[:3], "{F}", *axes[3:], "{M}", "d"]
    said = lesson06.describe_moving_frame(["F", "M"], poses)
    assert "(1, 2, 3) m" in said
    assert "90 degrees" in said
