"""A display list, when unpacked, gives the drawn polygons with their places and colours."""

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

import rbcourse as rb
from rbclassroom.course.agreement import polygons, split
from rbcourse.draw import bodies
from rbcourse.draw.display import PARTS, Display, joined


@pytest.fixture
def ax():
    """Return axes from 0 to 1 that fill a figure of 300 by 200 pixels."""
    fig = Figure(figsize=(3, 2), dpi=100, layout="none")
    return fig.add_axes((0, 0, 1, 1), xlim=(0, 1), ylim=(0, 1))


def recorded(ax, *artists):
    display = Display(ax.figure)
    (state,) = split(joined([display.record(artists)]))
    return polygons(state, list(display.styles))


@pytest.mark.parametrize("width", [3, 15])
def test_lines_that_leave_the_picture_keep_their_slope(ax, width):
    ax.figure.set_size_inches(width, 4)
    (line,) = ax.plot([0, 5], [0, 5])
    patch = ax.add_patch(Rectangle((-1e6, 0), 2e6, 1e6))
    (_, _, places), (_, _, far) = recorded(ax, line, patch)
    x, y = (places / [100 * width, 400]).T
    assert np.abs(y - (1 - x)).max() < 1 / (400 * PARTS)
    assert x.max() > 1
    assert far[:, 0].min() < 0 < 100 * width < far[:, 0].max()
    assert far[:, 1].min() < 0


def test_figures_that_are_too_large_are_refused(ax):
    ax.figure.set_size_inches(16, 4)
    with pytest.raises(ValueError, match=r"at most 1500 × 1500 pixels are wanted, got \(1600, 4"):
        Display(ax.figure)


def test_faces_without_area_are_recorded_as_edges(ax):
    """A face without area defines no plane that could order the other parts."""
    space = ax.figure.add_subplot(projection="space")
    space.fit(np.full(3, -1.5), np.full(3, 4.5))
    cube, sight = bodies.draw_box(space, np.eye(4), 1.0), space.sight()
    bodies.move_box(cube, rb.exp_se3([0.5, 1.0, 0.5, 1, 2, 1]), 1.0)
    bodies.draw_box(space, np.eye(4), np.array([1.0, 1.0, 1e-4]))
    ax.remove()
    found = recorded(space)
    for (_, _, places), corners in zip(found[:7], cube.corners, strict=True):
        assert np.abs(places - sight.scale * (corners - sight.middle)).max() <= 0.5 / PARTS
    kinds = [style[9] for style, _, _ in found]
    assert (kinds[:7].count("face"), kinds[7:].count("line")) == (7, 4)
    for (_, _, places), kind in zip(found[7:], kinds[7:], strict=True):
        assert kind == "line" or np.linalg.matrix_rank(places - places[0]) == 2
