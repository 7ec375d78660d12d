"""Display lists: unpacked, they are the polygons that were drawn, in their places and colours."""

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.patches import Annulus, Rectangle

from rbclassroom.course.agreement import polygons, split
from rbcourse.draw import bodies
from rbcourse.draw.display import PARTS, Display, joined


@pytest.fixture
def ax():
    """Axes from 0 to 1 that fill a figure of 300 by 200 pixels."""
    fig = plt.figure(figsize=(3, 2), dpi=100, layout="none")
    axes = fig.add_axes((0, 0, 1, 1))
    axes.set(xlim=(0, 1), ylim=(0, 1))
    yield axes
    plt.close(fig)


def recorded(ax, *artists):
    display = Display(ax.figure)
    (state,) = split(joined([display.record(artists)]))
    return polygons(state, list(display.styles))


def test_a_line_is_where_it_is_drawn(ax):
    (line,) = ax.plot([0, 0.5, 1], [0, 1, 0.25], color="#ff8000", lw=3.6, ls=(0, (2, 1)))
    ((style, more, places),) = recorded(ax, line)
    assert np.abs(places - [[0, 200], [150, 0], [300, 150]]).max() <= 0.5 / PARTS
    fill, stroke, width, dashes, cap, join, box, marker = style
    assert (fill, stroke, width, cap, join) == (None, "#ff8000ff", 5.0, "butt", "round")
    assert dashes == (10.0, 5.0)  # in widths of the line
    assert box == (0, 0, 300, 200)
    assert marker == ()
    assert not more


def test_a_patch_is_filled_with_its_colours(ax):
    patch = ax.add_patch(Rectangle((0.1, 0.25), 0.5, 0.5, fc=(0, 0, 1, 0.5), ec="black", lw=0))
    ((style, _, places),) = recorded(ax, patch)
    corners = {tuple(place) for place in np.round(places)}
    assert corners == {(30, 150), (180, 150), (180, 50), (30, 50)}
    assert style[:3] == ("#0000ff80", None, 0)


def test_a_hole_belongs_to_what_it_is_in(ax):
    ring = ax.add_patch(Annulus((0.5, 0.5), 0.4, 0.2))
    outer, inner = recorded(ax, ring)
    assert not outer[1]
    assert inner[1]
    assert inner[0] == outer[0]
    assert np.ptp(inner[2][:, 0]) == pytest.approx(300 * 0.4, abs=1)
    assert np.ptp(outer[2][:, 0]) == pytest.approx(300 * 0.8, abs=1)


def test_a_state_is_what_the_artists_are_then_and_none_may_be_empty(ax):
    (line,) = ax.plot([], [])
    display, states = Display(ax.figure), []
    for x in (0.2, np.nan, 0.6):
        line.set_data([x, x], [0, 1])
        states.append(display.record([line]))
    first, none, last = (polygons(state, list(display.styles)) for state in split(joined(states)))
    assert none == []
    assert np.abs(first[0][2][:, 0] - 60).max() <= 1
    assert np.abs(last[0][2][:, 0] - 180).max() <= 1
    assert first[0][0] == last[0][0]
    assert len(list(display.styles)) == 1


def test_far_places_do_not_come_back_on_the_other_side(ax):
    patch = ax.add_patch(Rectangle((-1e6, 0), 2e6, 1e6))
    ((_, _, places),) = recorded(ax, patch)
    assert places[:, 0].min() < 0
    assert places[:, 0].max() > 300
    assert places[:, 1].min() < 0


def test_a_marker_is_kept_once_and_drawn_at_each_point(ax):
    (dots,) = ax.plot([0.1, np.nan, 0.5], [0.5, 0.5, 1], "s", ms=7.2, mew=0, color="#0000ff")
    ((style, _, places),) = recorded(ax, dots)
    assert np.abs(places - [[30, 100], [150, 0]]).max() <= 0.5 / PARTS
    assert style[:2] == ("#0000ffff", None)
    (marker,) = style[7]
    square = np.reshape(marker, (-1, 2)).cumsum(axis=0) / PARTS
    assert np.abs(np.abs(square) - 5).max() <= 1 / PARTS


@pytest.mark.parametrize("width", [3, 15])
def test_what_leaves_the_picture_keeps_its_slope(ax, width):
    ax.figure.set_size_inches(width, 4)
    (line,) = ax.plot([0, 5], [0, 5])
    ((_, _, places),) = recorded(ax, line)
    x, y = (places / [100 * width, 400]).T
    assert np.abs(y - (1 - x)).max() < 1 / (400 * PARTS)
    assert x.max() > 1


def test_figures_that_are_too_large_are_refused(ax):
    ax.figure.set_size_inches(16, 4)
    with pytest.raises(ValueError, match=r"at most 1500 pixels each way wanted, got \(1600, 400\)"):
        Display(ax.figure)


def test_a_face_that_has_no_area_in_whole_numbers_is_its_edge(ax):
    """In the browser its plane would part nothing from nothing."""
    space = ax.figure.add_subplot(projection="space")
    space.fit(-np.ones(3), np.ones(3))
    bodies.draw_box(space, np.eye(4), np.array([1.0, 1.0, 1e-4]))
    ax.remove()
    found = recorded(space)
    kinds = [style[9] for style, _, _ in found]
    assert kinds.count("line") == 4
    for (_, _, places), kind in zip(found, kinds, strict=True):
        assert kind == "line" or np.linalg.matrix_rank(places - places[0]) == 2
