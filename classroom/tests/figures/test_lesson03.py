"""Turned boxes of lesson 3."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

import rbcourse as rb
from rbclassroom.figures import lesson03


def corners(cube):
    """The corners of the six faces and of the square, in space."""
    return cube.corners


@pytest.fixture
def ax3d():
    fig, ax = plt.subplots(subplot_kw={"projection": "space"})
    yield ax
    plt.close(fig)


@pytest.mark.source("RR 2.1")
def test_turned_boxes_carry_their_frames(ax3d):
    R = rb.exp_so3([[0, 0, np.pi / 2]])
    box, *room, x, y, z = lesson03.draw_turns([ax3d], ["turned"], R)
    assert np.array_equal([np.ptp(line.get_data_3d(), axis=1) for line in room], 2.6 * np.eye(3))
    assert np.abs(np.ptp(corners(box)[:6], axis=(0, 1)) - [1.0, 1.6, 0.3]).max() < 1e-15
    for arrow, direction in zip((x, y, z), R[0].T, strict=True):
        start, tip, *_ = np.transpose(arrow.get_data_3d())
        assert np.array_equal(start, [0, 0, 0])
        assert np.abs(tip - 1.2 * direction).max() < 1e-15
    assert ax3d.get_title() == "turned"
    assert [text.get_text() for text in ax3d.texts] == ["x", "y", "z"]
    said = lesson03.describe_turns(["turned"], R)
    assert "turned: x along +y, y along −x, z along +z." in said
