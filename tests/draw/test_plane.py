"""Rectangles are drawn at the poses of a path, and the descriptions state its numbers."""

import numpy as np
import pytest
from matplotlib.figure import Figure

import rbcourse as rb
from rbcourse.draw import plane

PATH = np.array([[0, 0, 0], [3, 0, 0.5], [3, 2, -2.0], [1, 4, -2.0]])


@pytest.fixture
def ax():
    return Figure().subplots()


def way_of(line):
    return np.transpose(line.get_data())


def assert_body(outline, nose, pose, length):
    """Check that the body is drawn in this pose, inside the picture."""
    A, ax = rb.planar.matrix_from_planar(pose), outline.axes
    ahead = A @ [length / 2, 0, 1]  # the nose is ahead of the centre, as the lesson says
    assert np.abs(way_of(nose)[1] - ahead[:2]).max() < 1e-14
    corners = length / 4 * np.array([[-2, -1], [2, -1], [2, 1], [-2, 1]]) @ A[:2, :2].T + A[:2, 2]
    assert np.abs(outline.get_xy()[:4] - corners).max() < 1e-14
    low, high = np.array([ax.get_xlim(), ax.get_ylim()]).T
    assert ((low < corners) & (corners < high)).all()
    assert (ax.get_aspect(), ax.get_xlabel(), ax.get_ylabel()) == (1, "$x$ (m)", "$y$ (m)")


@pytest.mark.source("RR 3.3", "RR Fig. 6", "RR Fig. 7")
def test_rectangles_are_drawn_at_the_poses_of_the_table(ax):
    way, *bodies = plane.draw_route(ax, PATH, 1.5, shown=[0, 1, 2, 3])
    assert {text.get_text(): text.xy[0] for text in ax.texts} == {"start": 0, "goal": 1}
    table = plane.path_table(PATH)
    assert list(table) == ["x [m]", "y [m]", "theta [rad]"]
    assert np.array_equal(np.transpose(list(table.values())), PATH)
    assert np.array_equal(way_of(way), PATH[:, :2])
    for pose, outline, nose in zip(PATH, bodies[::2], bodies[1::2], strict=True):
        assert_body(outline, nose, pose, 1.5)
    ax.clear()
    update = plane.moving_route(ax, PATH, 0.8, shown=[1, 3])
    for ghost, nose, i in zip(ax.patches[:2], ax.lines[:2], (1, 3), strict=True):
        assert_body(ghost, nose, PATH[i], 0.8)
    for i in (0, 3, 2, 1):
        outline, nose, way = update(i)
        assert_body(outline, nose, PATH[i], 0.8)
        assert way.get_zorder() > outline.get_zorder()  # the end of the path stays visible
        assert np.array_equal(way_of(way), PATH[: i + 1, :2])


def test_two_paths_are_drawn_in_different_styles(ax):
    raised = PATH + np.array([0, 1, 0]) * [[0], [1], [2], [0.5]]
    pair, points = {"one": PATH, "other": raised}, ([0, 0], [0.3, -0.2])
    artists = plane.draw_compared(ax, pair, 1, shown=[1], points=points)
    for k, (name, path) in enumerate(pair.items()):
        way, outline, nose = artists[3 * k : 3 * k + 3]
        wanted = path[:, :2] @ [1, 1j] + points[k] @ np.array([1, 1j]) * np.exp(1j * path[:, 2])
        assert np.abs(way_of(way) @ [1, 1j] - wanted).max() < 1e-14
        assert_body(outline, nose, path[1], 1)
        assert {one.get_linestyle() for one in (way, outline, nose)} == {("-", "--")[k]}
        assert way.get_label() == name
    way = plane.draw_compared(ax, pair, 1, shown=[1])[3]
    assert np.abs(way_of(way) - raised[:, :2]).max() < 1e-14
    assert plane.describe_compared({"here": pair}) == (
        "Paths of a rectangle in pairs, the second path dashed: here. "
        "The paths of each pair: here: one and other, the centres apart by 2 m at most."
    )


def test_the_description_states_the_start_and_the_goal():
    said = plane.describe_route(PATH)
    assert "from (0, 0) m, heading 0 degrees, to (1, 4) m, heading -115 degrees" in said
    assert f"its centre covers {3 + 2 + np.sqrt(8):.2f} m" in said
    assert "by 29 degrees to the left and 143 degrees to the right." in said
    still = plane.describe_route(np.array([[1, -0.001, -0.004], [1, -0.001, 0]]))
    assert "from (1, 0) m, heading 0 degrees" in still
    assert "it turns by less than a degree." in still
    both = plane.describe_routes({"one": PATH, "two": PATH})
    assert both.startswith("Paths of a rectangle from start to goal: one, two. In turn, one: ")
    assert both.endswith(f"one: {said} two: {said}")
