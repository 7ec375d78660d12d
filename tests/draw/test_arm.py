"""Arms are drawn where the path says, and described by its numbers."""

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.patches import Arc, Circle

import rbcourse as rb
from rbcourse.draw import arm

PATH = np.array([[0.2, 0.5], [1.0, -0.5], [-2.0, 3.0], [4.0, 0.1]])


@pytest.fixture
def axes():
    fig, axes = plt.subplots(1, 2)
    yield axes
    plt.close(fig)


def ends(q, lengths=(2, 1.5)):
    """The joints and the tip as complex numbers."""
    return np.append(0, np.cumsum(np.array(lengths) * np.exp(1j * np.cumsum(q))))


def drawn(line):
    return np.transpose(line.get_data()) @ [1, 1j]


@pytest.mark.parametrize(
    ("path", "lengths"), [(PATH, (2, 1.5)), (np.array([[0.1, 0.2, 0.3]]), (1, 2, 3))]
)
def test_a_table_holds_angles_and_ends(path, lengths):
    table, n = arm.path_table(path, lengths), len(lengths)
    places = [f"{axis}{k} [m]" for k in range(1, n + 1) for axis in "xy"]
    assert list(table) == [*(f"theta{i} [rad]" for i in range(n)), *places]
    angles, xy = np.split(np.array(list(table.values())), [n])
    assert np.array_equal(angles.T, path)
    want = np.array([ends(q, lengths)[1:] for q in path]).T
    assert np.abs(xy[::2] + 1j * xy[1::2] - want).max() < 1e-14


@pytest.mark.source("RR 4")
@pytest.mark.parametrize("q", [[0.5, 0.8], [-0.5, -2], [2, -1]])
def test_a_posture_shows_links_angles_and_frames(axes, q):
    links, *arrows = arm.draw_posture(axes[0], np.array(q))
    joints, headings, texts = ends(q), np.cumsum(q), axes[0].texts
    assert np.abs(drawn(links) - joints).max() < 1e-14
    centres = np.repeat((joints[1:] + joints[:-1]) / 2, 2)
    directions = np.exp(1j * np.repeat(headings, 2)) * [1, 1j, 1, 1j]
    assert np.abs([arrow.XY[0] @ [1, 1j] for arrow in arrows] - centres).max() < 1e-14
    found = np.array([arrow.U[0] + 1j * arrow.V[0] for arrow in arrows])
    assert np.abs(found / 0.45 - directions).max() < 1e-14
    names = ["J0", "$θ_0$", "x", "y", "J1", "$θ_1$", "x", "y", "tip"]
    assert [text.get_text() for text in texts] == names
    arcs = [patch for patch in axes[0].patches if isinstance(patch, Arc)]
    for k, (arc, joint, before, angle) in enumerate(zip(arcs, joints, [0, q[0]], q, strict=False)):
        assert arc.theta2 - arc.theta1 == pytest.approx(abs(np.degrees(angle)))
        assert np.degrees(before) in (pytest.approx(arc.theta1), pytest.approx(arc.theta2))
        line = drawn(axes[0].lines[1 + k]) - joint
        assert np.abs(line - [0, 0.9 * np.exp(1j * before)]).max() < 1e-14
        assert complex(*texts[4 * k].xy) == joint
        label = texts[4 * k + 1].get_position() @ np.array([1, 1j])
        assert abs(label - joint - 0.8 * np.exp(1j * (before + angle / 2))) < 1e-14
    assert len(arcs) == 2


@pytest.mark.source("RR 4")
@pytest.mark.parametrize("q", [[0.5, 1.5], [0.2, 0.1, 0.3]])
def test_the_arrows_at_the_tip_are_the_columns_of_the_jacobian(axes, q):
    lengths = [2, 1.5, 1][: len(q)]
    links, *arrows = arm.draw_tip_velocities(axes[0], np.array(q), lengths)
    assert np.abs(drawn(links) - ends(q, lengths)).max() < 1e-14
    J = rb.arm.arm_tip_jacobian(q, lengths)
    for i, (arrow, column) in enumerate(zip(arrows, J.T, strict=True)):
        assert abs(arrow.XY[0] @ [1, 1j] - ends(q, lengths)[-1]) < 1e-14
        assert np.abs([arrow.U[0], arrow.V[0]] - column / 2).max() < 1e-14
        assert arrow.get_label() == f"motor {i} runs"
    said = arm.describe_tip_velocities({"here": np.array(q)}, lengths)
    first = np.degrees(np.arctan2(J[1, 0], J[0, 0]))
    assert f"The arrows point, here, to {first:.0f}" in said


def assert_reach_is_seen(ax, radii):
    circles = [patch for patch in ax.patches if isinstance(patch, Circle)]
    assert [circle.radius for circle in circles] == pytest.approx(radii, abs=1e-14)
    assert ax.get_xlim()[1] == ax.get_ylim()[1] > radii[0]
    assert ax.get_aspect() == 1
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("x (m)", "y (m)")


@pytest.mark.source("RR 4.3", "RR Fig. 8", "RR Fig. 9")
def test_the_arm_moves_and_its_tip_leaves_a_curve(axes):
    update = arm.moving_arm(axes[0], PATH, shown=[0, 2])
    for i in (0, 3, 1):
        links, way = update(i)
        assert np.abs(drawn(links) - ends(PATH[i])).max() < 1e-14
        assert np.abs(drawn(way) - [ends(q)[-1] for q in PATH[: i + 1]]).max() < 1e-14
    assert_reach_is_seen(axes[0], (3.5, 0.5))
    for pale, i in zip(axes[0].lines[:2], (0, 2), strict=True):
        assert np.abs(drawn(pale) - ends(PATH[i])).max() < 1e-14


@pytest.mark.parametrize(("lengths", "radii"), [((1, 1, 1), (3, 0)), ((1, 5, 1), (7, 3))])
def test_the_reach_is_bounded_by_circles(axes, lengths, radii):
    arm.show_reach(axes[0], lengths)
    assert_reach_is_seen(axes[0], radii)


@pytest.mark.source("RR 4.1", "RR 4.3")
def test_ways_are_drawn_in_the_room_and_in_the_plane_of_the_angles(axes):
    ways = {"one": PATH, "other": PATH[::-1] + 0.3}
    for ax, draw, place in (
        (axes[0], arm.draw_arm_ways, lambda q: ends(q)[-1]),
        (axes[1], arm.draw_joint_ways, lambda q: np.degrees(q) @ [1, 1j]),
    ):
        lines = draw(ax, ways)
        for line, (name, path) in zip(lines, ways.items(), strict=True):
            assert np.abs(drawn(line) - [place(q) for q in path]).max() < 1e-12
            assert line.get_label() == name
        assert lines[0].get_linestyle() != lines[1].get_linestyle()
    assert_reach_is_seen(axes[0], (3.5, 0.5))
    for line, i in zip(axes[0].lines[:3], (0, 2, 3), strict=True):
        assert np.abs(drawn(line) - ends(path[i])).max() < 1e-14
    for text, i in zip(axes[0].texts, (0, 3), strict=True):
        assert abs(complex(*text.xy) - ends(path[i])[-1]) < 1e-14
    for draw in (arm.draw_arm_ways, arm.draw_joint_ways):
        with pytest.raises(ValueError, match="shorter"):
            draw(axes[0], dict.fromkeys("abcd", PATH))


def test_descriptions_give_numbers():
    tips = np.array([ends(q)[-1] for q in PATH])
    covered = np.abs(np.diff(tips)).sum()
    first, second = np.degrees(np.abs(np.diff(PATH, axis=0)).sum(axis=0))
    angles = np.degrees(np.linalg.norm(np.diff(PATH, axis=0), axis=1).sum())
    for said, words in {
        arm.describe_arm(PATH): (
            "links of 2 and 1.5 m turns its joints from 11 and 29 to 229 and 6 degrees",
            f"by {first:.0f} and {second:.0f} degrees in all",
            f"its tip covers {covered:.2f} m, from ({tips[0].real:.2f}, {tips[0].imag:.2f}) to (",
        ),
        arm.describe_arm(np.zeros((1, 2)), [1e-3, 1000]): ("links of 0.001 and 1000 m",),
        arm.describe_posture(np.array([-0.5, np.pi / 2])): (
            "joint angles are -29 and 90 degrees",
            f"at (0, 0), ({2 * np.cos(0.5):.2f}, {-2 * np.sin(0.5):.2f}), (",
        ),
        arm.describe_ways({"one": PATH}): (
            "from joint angles of 11 and 29 to 229 and 6 degrees",
            f"one: {covered:.1f} m and {angles:.0f} degrees.",
        ),
    }.items():
        for word in words:
            assert word in said
