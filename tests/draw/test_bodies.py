"""Bodies and frames are drawn at the given poses."""

import numpy as np
import pytest
from matplotlib.figure import Figure

import rbcourse as rb
from rbcourse.draw import bodies

A1 = rb.pose_from_coordinates([0.3, -0.5, 1.0, 4, 5, 3])
TIMES = np.linspace(0, 1, 6)
SCREW, GEODESIC = (way(np.eye(4), A1)(TIMES) for way in (rb.screw, rb.geodesic))
MOTIONS = {"geodesic": GEODESIC, "screw": SCREW}


@pytest.fixture
def axes():
    return Figure().subplots(1, 2, subplot_kw={"projection": "space"})


def off(box, pose, in_body):
    """Compare a drawn box with its pose; return the largest distance between corners."""
    return np.abs(box.corners - (in_body @ pose[:3, :3].T + pose[:3, 3])).max()


@pytest.mark.source("BK Fig. 5")
def test_cubes_with_a_square_on_one_face_are_drawn_at_the_poses(axes):
    in_body = bodies.draw_box(axes[1], np.eye(4), 2.0).corners
    faces, square = in_body[:6], in_body[6]
    assert np.all(np.abs(faces) == 1)
    centres = {tuple(face.mean(axis=0)) for face in faces}
    assert centres == {tuple(s * e) for e in np.eye(3) for s in (1, -1)}
    assert np.all(np.linalg.norm(np.roll(faces, -1, axis=1) - faces, axis=-1) == 2)
    assert np.all(square[:, 2] > 1)
    assert np.all(np.abs(square[:, :2]) == 0.5)
    *cubes, stars = bodies.draw_cube_motion(axes[0], SCREW, 2.0)
    for cube, A in zip(cubes, SCREW, strict=True):
        assert off(cube, A, in_body) < 1e-14
    assert np.array_equal(stars.get_data_3d(), SCREW[:, :3, 3].T)
    bodies.draw_cube_motion(axes[1], SCREW, 2.0, compared=GEODESIC[1:3])
    for outline, A in zip(axes[1].artists[1:3], GEODESIC[1:3], strict=True):
        assert off(outline, A, in_body) < 1e-14
    low, high = np.array([axes[0].get_xlim(), axes[0].get_ylim(), axes[0].get_zlim()]).T
    drawn = np.concatenate([cube.corners.reshape(-1, 3) for cube in cubes])
    assert np.all((drawn.min(axis=0) > low) & (drawn.max(axis=0) < high))
    axes[0].sight()
    assert np.allclose(np.divide(*(axes[0].get_box_aspect()[:2])), np.divide(*(high - low)[:2]))


def test_a_box_that_stays_at_the_origin_fills_its_axes(axes):
    edges = np.array([0.3, 0.2, 0.03])
    still = rb.pose_from_components(rb.exp_so3(np.outer(TIMES, [1.0, 2, 3])), np.zeros(3))
    update = bodies.moving_boxes(axes, {"screw": SCREW, "still": still}, edges)
    in_body = bodies.draw_box(axes[0], np.eye(4), edges).corners
    for i in (0, 5, 1):
        for box, poses in zip(update(i), (SCREW, still), strict=True):
            assert off(box, poses[i], in_body) < 1e-14
    assert [ax.get_title() for ax in axes] == ["screw", "still"]
    reach = np.linalg.norm(edges) / 2
    assert axes[1].get_xlim() == axes[1].get_ylim() == (-reach, reach)
    assert [text.get_text() for text in axes[1].texts] == ["$x$", "$y$", "$z$"]
    eye = axes[1].sight().eye
    for text in axes[1].texts:  # beyond the ball in which the box turns
        assert np.linalg.norm(np.cross(text.get_position_3d(), eye)) == pytest.approx(1.1 * reach)


def test_an_outline_follows_the_compared_motion(axes):
    motions = {"screw": SCREW, "geodesic": GEODESIC}
    update = bodies.moving_boxes(axes, motions, 2.0, SCREW)
    in_body = bodies.draw_box(axes[0], np.eye(4), 2.0).corners
    for i in (0, 5, 1):
        *boxes, outline = update(i)
        assert len(boxes) == 2
        assert outline.axes is axes[1]
        assert off(outline, SCREW[i], in_body) < 1e-14
        assert off(boxes[1], GEODESIC[i], in_body) < 1e-14


def test_paths_are_drawn_with_the_frames_at_their_ends(axes):
    places = [[1, 2, 3], [4, 0, 1]]
    lines = bodies.draw_ways(axes[0], MOTIONS, places)
    for text, line, place in zip(axes[0].texts, lines, places, strict=False):
        assert (text.get_text(), text.get_color()) == (line.get_label(), line.get_color())
        assert text.get_position_3d() == tuple(place)
    for line, (name, poses) in zip(lines, MOTIONS.items(), strict=True):
        assert np.array_equal(line.get_data_3d(), poses[:, :3, 3].T)
        assert line.get_label() == name
    assert len({line.get_color() for line in lines}) == 2
    assert len({line.get_linestyle() for line in lines}) == 2
    back = rb.screw(np.eye(4), rb.inverse_se3(A1))(TIMES)
    bodies.draw_ways(axes[1], {**MOTIONS, "back": back})
    names = [[text.get_text() for text in ax.texts if "_" in text.get_text()] for ax in axes]
    assert names == 2 * [["$x_0$", "$y_0$", "$z_0$"]]
    bodies.draw_ways(axes[0], {"straight": GEODESIC})
    axes[0].sight()  # this works although the path is not in a plane


@pytest.mark.parametrize("view", [(18, -22), (32, -65), (60, 140)])
def test_axis_names_overlap_no_text(view, axes):
    ax, places = axes[0], np.array([[0, 0, 0], [8, 10, 12.0]])
    ax.figure.set_size_inches(13, 5)
    bodies.set_space(ax, places, 2.0, view)
    seen = ax.sight()
    at = np.array([text.get_position_3d() for text in ax.texts])
    found, words = seen.flat(seen.scale * (at - seen.middle)), [x.get_text() for x in ax.texts]
    low, high = places.min(axis=0) - 1.8, places.max(axis=0) + 1.8
    numbers = 0.1 * np.max(high - low)
    for i in (words.index(f"${name}$ (m)") for name in "xyz"):
        across, up = np.abs(np.delete(found, i, axis=0) - found[i]).T
        assert ((across > 30) | (up > 12)).all(), words[i]
    assert at[words.index("$x$ (m)"), 1] < low[1] - numbers
    assert at[words.index("$y$ (m)"), 0] > high[0] + numbers


def test_letters_of_a_frame_are_beyond_the_tips_of_its_arrows(axes):
    R, origin = A1[:3, :3], A1[:3, 3]
    bodies.draw_triad(axes[0], origin, R, "M", (1.4, 1.2, 2))
    for text, direction in zip(axes[0].texts, R.T, strict=True):
        beyond = text.get_position_3d() - origin
        assert np.abs(np.cross(beyond, direction)).max() < 1e-14
        assert beyond @ direction > 1.1


def test_descriptions_state_the_drawn_numbers():
    # the maximum is at 1/3, but the largest of the six given values is at 0.4
    bump = 4 * TIMES * (1 - TIMES) ** 2
    turns = rb.exp_so3(np.radians(50) * np.outer(bump, [0, 0.6, 0.8]))
    tilted = rb.pose_from_components(turns, [0, 0, 0])
    angle = np.degrees(np.linalg.norm([0.3, -0.5, 1.0]))
    said = bodies.describe_ways(MOTIONS) + bodies.describe_cube_motion(GEODESIC)
    for pair in ({"one": SCREW, "two": SCREW}, {"upright": np.eye(4) + 0 * tilted, "bent": tilted}):
        said += bodies.describe_moving_boxes(TIMES, pair)
    for words in (
        f"geodesic {np.linalg.norm(A1[:3, 3]):.2f} m",
        "from (0, 0, 0) to (4, 5, 3) m, shown at 6 times.",
        ", ".join([f"{angle / 5:.0f}"] * 5),
        "The orientations of one and two agree at all times.",
        f"upright and bent differ most at t = 0.40, by {50 * bump.max():.0f} degrees.",
    ):
        assert words in said


def test_tables_hold_the_poses_and_rates_with_units():
    table = bodies.pose_table({"t [1]": TIMES}, SCREW)
    wanted = {"t [1]": TIMES, "y [m]": SCREW[:, 1, 3], "R23 [1]": SCREW[:, 1, 2]}
    assert list(table)[:4] == ["t [1]", "x [m]", "y [m]", "z [m]"]
    assert all(np.array_equal(table[name], column) for name, column in wanted.items())
    motion, t = rb.projected_spline([0, 2], [np.eye(4), A1], "rest"), np.linspace(0, 2, 5)
    table = bodies.motion_table(t, motion, t[:1])
    for name, column in {
        "w1 [rad]": motion(t, 1)[:, 0],
        "v3 [m]": motion(t, 1)[:, 5],
        "w2' [rad]": motion(t, 2)[:, 1],
        "a1 [m]": motion(t, 2)[:, 3],
    }.items():
        assert np.array_equal(table[name], column)
