"""Bodies and frames are drawn where the poses are."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

import rbcourse as rb
from rbcourse.draw import bodies

A1 = rb.pose_from_coordinates([0.3, -0.5, 1.0, 4, 5, 3])
TIMES = np.linspace(0, 1, 6)
SCREW, GEODESIC = rb.screw_se3(np.eye(4), A1), rb.geodesic_se3(np.eye(4), A1)
MOTIONS = {"geodesic": GEODESIC(TIMES), "screw": SCREW(TIMES)}


@pytest.fixture
def axes():
    fig, axes = plt.subplots(1, 2, subplot_kw={"projection": "space"})
    yield axes
    plt.close(fig)


def test_a_pose_table_holds_the_poses():
    table = bodies.pose_table({"t [1]": TIMES}, MOTIONS["screw"])
    assert list(table)[:4] == ["t [1]", "x [m]", "y [m]", "z [m]"]
    assert np.array_equal(table["t [1]"], TIMES)
    assert np.array_equal(table["R23 [1]"], SCREW(TIMES)[:, 1, 2])
    assert np.array_equal(table["y [m]"], SCREW(TIMES)[:, 1, 3])


@pytest.mark.source("BK Fig. 5")
def test_a_cube_has_six_faces_and_a_square_on_one(axes):
    in_body = bodies.draw_box(axes[0], np.eye(4), 2.0).corners
    faces, square = in_body[:6], in_body[6]
    assert np.all(np.abs(faces) == 1)
    centres = {tuple(face.mean(axis=0)) for face in faces}
    assert centres == {tuple(s * e) for e in np.eye(3) for s in (1, -1)}
    edges = np.linalg.norm(np.roll(faces, -1, axis=1) - faces, axis=-1)
    assert np.all(edges == 2)
    assert np.all(square[:, 2] > 1)
    assert np.all(np.abs(square[:, :2]) == 0.5)


@pytest.mark.source("BK Fig. 5")
def test_cubes_are_where_the_poses_are(axes):
    *cubes, stars = bodies.draw_cube_motion(axes[0], MOTIONS["screw"], 2.0)
    in_body = bodies.draw_box(axes[1], np.eye(4), 2.0).corners
    assert len(cubes) == 6
    for cube, A in zip(cubes, SCREW(TIMES), strict=True):
        assert np.abs(cube.corners - (in_body @ A[:3, :3].T + A[:3, 3])).max() < 1e-14
    assert np.array_equal(stars.get_data_3d(), SCREW(TIMES)[:, :3, 3].T)
    low, high = np.array([axes[0].get_xlim(), axes[0].get_ylim(), axes[0].get_zlim()]).T
    drawn = np.concatenate([cube.corners.reshape(-1, 3) for cube in cubes])
    assert np.all((drawn.min(axis=0) > low) & (drawn.max(axis=0) < high))
    axes[0].sight()
    assert np.allclose(np.divide(*(axes[0].get_box_aspect()[:2])), np.divide(*(high - low)[:2]))


@pytest.mark.parametrize("count", [6, 3])
def test_moving_boxes_move(axes, count):
    motions = {name: poses[:count] for name, poses in MOTIONS.items()}
    update = bodies.moving_boxes(axes, motions, edges=1.5)
    in_body = bodies.draw_box(axes[0], np.eye(4), 1.5).corners
    for i in (0, 1, count - 1):
        for cube, poses in zip(update(i), motions.values(), strict=True):
            A = poses[i]
            assert np.abs(cube.corners - (in_body @ A[:3, :3].T + A[:3, 3])).max() < 1e-14
    assert [ax.get_title() for ax in axes] == ["geodesic", "screw"]


def test_what_stays_at_the_origin_is_drawn_as_large_as_it_fits(axes):
    edges, turns = np.array([0.3, 0.2, 0.03]), rb.exp_so3(np.outer(TIMES, [1.0, 2, 3]))
    still = rb.pose_from_components(turns, np.zeros(3))
    update = bodies.moving_boxes(axes, {"one": still, "two": still}, edges)
    reach = np.linalg.norm(edges) / 2
    for i in (0, 5):
        places = np.concatenate([box.corners.reshape(-1, 3) for box in update(i)])
        assert np.linalg.norm(places, axis=-1).max() == pytest.approx(reach, rel=1e-3)
    for ax in axes:
        assert ax.get_xlim() == ax.get_ylim() == ax.get_zlim() == (-reach, reach)
        assert [text.get_text() for text in ax.texts] == ["x", "y", "z"]


def test_ways_are_the_paths_with_the_frame_at_the_start_and_once_at_each_end(axes):
    lines = bodies.draw_ways(axes[0], MOTIONS)
    for line, (name, poses) in zip(lines, MOTIONS.items(), strict=True):
        assert np.array_equal(line.get_data_3d(), poses[:, :3, 3].T)
        assert line.get_label() == name
    assert len({line.get_color() for line in lines}) == 2
    assert len({line.get_linestyle() for line in lines}) == 2
    other = rb.screw_se3(np.eye(4), rb.inverse_se3(A1))(TIMES)
    bodies.draw_ways(axes[1], {**MOTIONS, "back": other})
    names = [[text.get_text() for text in ax.texts if "$" in text.get_text()] for ax in axes]
    assert [len(those) for those in names] == [2 * 3, 3 * 3]
    bodies.draw_ways(axes[0], {"straight": MOTIONS["geodesic"]})
    assert np.isfinite([axes[0].elev, axes[0].azim]).all()


def test_the_square_is_seen_on_the_face_that_is_turned_to_the_eye():
    turns = rb.exp_so3(np.outer(np.linspace(0, 6, 20), [0, 0, 1]))
    for R in turns:
        fig, ax = plt.subplots(figsize=(2, 2), subplot_kw={"projection": "space"})
        bodies.draw_cube_motion(ax, rb.pose_from_components(R, [[0, 0, 0]]), 2.0)
        fig.canvas.draw()
        red, green, blue = np.moveaxis(np.asarray(fig.canvas.buffer_rgba())[..., :3], -1, 0)
        assert ((red > 180) & (green < 130) & (blue < 60)).any()
        plt.close(fig)


def test_descriptions_give_numbers():
    assert f"geodesic {np.linalg.norm(A1[:3, 3]):.2f} m" in bodies.describe_ways(MOTIONS)
    said = bodies.describe_cube_motion(MOTIONS["geodesic"])
    angle = np.degrees(np.linalg.norm([0.3, -0.5, 1.0]))
    assert "at 6 times on its way from (0, 0, 0) to (4, 5, 3) m" in said
    assert ", ".join([f"{angle / 5:.0f}"] * 5) in said
    same = bodies.describe_moving_boxes(TIMES, dict.fromkeys(("one", "two"), MOTIONS["screw"]))
    assert "side by side: one; two." in same
    assert "one and two agree at all times." in same
    bump = 4 * TIMES * (1 - TIMES) ** 2  # most at 1/3, of the six times at 0.4
    tilted = rb.exp_so3(np.radians(50) * bump[:, None] * [0, 0.6, 0.8])
    both = {"upright": 0 * tilted + np.eye(3), "tilted": tilted}
    both = {name: rb.pose_from_components(R, [0, 0, 0]) for name, R in both.items()}
    said = bodies.describe_moving_boxes(TIMES, both)
    assert f"upright and tilted differ most at t = 0.40, by {50 * bump.max():.0f} degrees." in said


def test_an_arrow_has_its_barbs_at_its_tip_and_on_four_sides(axes):
    along = np.array([1.0, -2, 2])
    arrow = bodies.draw_arrow(axes[0], np.ones(3), along, "red")
    start, tip, *others = np.transpose(arrow.get_data_3d())
    assert np.array_equal(np.stack([start, tip]), [[1, 1, 1], [2, -1, 3]])
    barbs, back = np.array(others[::2]), np.array(others[1::2])
    assert np.array_equal(back, np.broadcast_to(tip, (4, 3)))
    off = barbs - tip
    assert np.abs(off.sum(axis=0) @ along + 4 * 0.12 * 3).max() < 1e-14
    beside = off - np.outer(off @ along, along) / 9
    assert np.linalg.matrix_rank(beside, tol=1e-12) == 2
    assert np.abs(beside.sum(axis=0)).max() < 1e-15


def test_the_room_has_names_with_units_and_numbers_where_they_are(axes):
    low, high = np.array([-1.0, 2, 0]), np.array([11.0, 9, 5])
    ax = axes[0]
    ax.fit(low, high)
    bodies.draw_room(ax, low, high)
    texts = {text.get_text(): text.get_position_3d() for text in ax.texts}
    assert {"x (m)", "y (m)", "z (m)"} <= set(texts)
    seen = {name: [] for name in "xyz"}
    for text in ax.texts:
        if not text.get_text().endswith("(m)"):
            value, place = float(text.get_text().replace("−", "-")), text.get_position_3d()
            seen[next(n for n, at in zip("xyz", place, strict=True) if at == value)].append(value)
    assert all(len(values) > 1 for values in seen.values())
    for line in ax.lines:
        places = np.transpose(line.get_data_3d())
        assert ((places >= low) & (places <= high)).all()


def test_a_motion_in_seconds_has_its_units():
    poses = rb.pose_from_coordinates([[0, 0, 0, 0, 0, 0], [0, 0, 1, 2, 0, 0]])
    motion, t = rb.chain([0, 2], poses), np.linspace(0, 2, 5)
    plain, timed = (bodies.motion_table(t, motion, t[:1], *unit) for unit in ((), ("s",)))
    assert [name.split(" [")[0] for name in plain] == [name.split(" [")[0] for name in timed]
    units = "t [s]", "drawn [1]", "x [m]", "w1 [rad/s]", "v3 [m/s]", "w2' [rad/s²]", "a1 [m/s²]"
    assert set(units) <= set(timed)
