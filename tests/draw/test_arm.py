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


def test_a_table_holds_angles_and_ends():
    table = arm.path_table(PATH)
    assert list(table) == [
        "theta0 [rad]",
        "theta1 [rad]",
        *("x1 [m]", "y1 [m]"),
        *("x2 [m]", "y2 [m]"),
    ]
    assert np.array_equal(np.transpose([table["theta0 [rad]"], table["theta1 [rad]"]]), PATH)
    for i, q in enumerate(PATH):
        for k in (1, 2):
            place = table[f"x{k} [m]"][i] + 1j * table[f"y{k} [m]"][i]
            assert abs(place - ends(q)[k]) < 1e-14
    longer = arm.path_table([[0.1, 0.2, 0.3]], [1, 2, 3])
    assert abs(longer["x3 [m]"][0] - ends([0.1, 0.2, 0.3], [1, 2, 3])[3].real) < 1e-14


@pytest.mark.source("RR 4")
@pytest.mark.parametrize("q", [[0.5, 0.8], [-0.5, -2], [2, -1]])
def test_a_posture_shows_links_angles_and_frames(axes, q):
    links, *arrows = arm.draw_posture(axes[0], np.array(q))
    joints = ends(q)
    assert np.abs(drawn(links) - joints).max() < 1e-14
    headings = np.cumsum(q)
    for arrow, centre, heading in zip(
        arrows,
        np.repeat((joints[1:] + joints[:-1]) / 2, 2),
        [headings[0], headings[0] + np.pi / 2, headings[1], headings[1] + np.pi / 2],
        strict=True,
    ):
        assert abs(arrow.XY[0] @ [1, 1j] - centre) < 1e-14
        assert abs((arrow.U[0] + 1j * arrow.V[0]) / 0.45 - np.exp(1j * heading)) < 1e-14
    arcs = [patch for patch in axes[0].patches if isinstance(patch, Arc)]
    for arc, before, angle in zip(arcs, [0, q[0]], q, strict=True):
        assert arc.theta2 - arc.theta1 == pytest.approx(abs(np.degrees(angle)))
        assert np.degrees(before) in (pytest.approx(arc.theta1), pytest.approx(arc.theta2))
    names = ["J0", "$θ_0$", "x", "y", "J1", "$θ_1$", "x", "y", "tip"]
    assert [text.get_text() for text in axes[0].texts] == names
    middles = headings - np.array(q) / 2
    for line, joint, heading in zip(axes[0].lines[1:], joints[:2], [0, q[0]], strict=True):
        assert np.abs(drawn(line) - joint - [0, 0.9 * np.exp(1j * heading)]).max() < 1e-14
    for k, (joint, middle) in enumerate(zip(joints[:2], middles, strict=True)):
        assert complex(*axes[0].texts[4 * k].xy) == joint
        label = axes[0].texts[4 * k + 1].get_position()
        assert abs(label @ np.array([1, 1j]) - joint - 0.8 * np.exp(1j * middle)) < 1e-14


@pytest.mark.source("RR 4")
@pytest.mark.parametrize("q", [[0.5, 1.5], [0.2, 0.1, 0.3]])
def test_the_arrows_at_the_tip_are_the_columns_of_the_jacobian(axes, q):
    lengths = [2, 1.5, 1][: len(q)]
    links, *arrows = arm.draw_tip_velocities(axes[0], np.array(q), lengths)
    assert np.abs(drawn(links) - ends(q, lengths)).max() < 1e-14
    J = rb.arm.arm_tip_jacobian(q, lengths)
    for arrow, column in zip(arrows, J.T, strict=True):
        assert abs(arrow.XY[0] @ [1, 1j] - ends(q, lengths)[-1]) < 1e-14
        assert np.abs([arrow.U[0], arrow.V[0]] - column / 2).max() < 1e-14
    assert [arrow.get_label() for arrow in arrows] == [f"motor {i} runs" for i in range(len(q))]
    said = arm.describe_tip_velocities({"here": np.array(q)}, lengths)
    first = np.degrees(np.arctan2(J[1, 0], J[0, 0]))
    assert f"The arrows point, here, to {first:.0f}" in said


def assert_reach_is_seen(ax):
    circles = [patch for patch in ax.patches if isinstance(patch, Circle)]
    assert [circle.radius for circle in circles] == pytest.approx([3.5, 0.5])
    assert ax.get_xlim()[1] > 3.5


@pytest.mark.source("RR 4.3", "RR Fig. 8", "RR Fig. 9")
def test_the_arm_moves_and_its_tip_leaves_a_curve(axes):
    update = arm.moving_arm(axes[0], PATH, shown=[0, 2])
    for i in (0, 3, 1):
        links, way = update(i)
        assert np.abs(drawn(links) - ends(PATH[i])).max() < 1e-14
        assert np.abs(drawn(way) - [ends(q)[-1] for q in PATH[: i + 1]]).max() < 1e-14
    assert_reach_is_seen(axes[0])
    pale = axes[0].lines[:2]
    for line, i in zip(pale, (0, 2), strict=True):
        assert np.abs(drawn(line) - ends(PATH[i])).max() < 1e-14


@pytest.mark.parametrize(
    ("lengths", "radii"), [((2, 1.5), (3.5, 0.5)), ((1, 1, 1), (3, 0)), ((1, 5, 1), (7, 3))]
)
def test_the_reach_is_bounded_by_circles(axes, lengths, radii):
    arm.show_reach(axes[0], lengths)
    circles = [patch for patch in axes[0].patches if isinstance(patch, Circle)]
    assert [circle.radius for circle in circles] == pytest.approx(radii, abs=1e-14)
    assert axes[0].get_xlim()[1] == axes[0].get_ylim()[1] > radii[0]
    assert axes[0].get_aspect() == 1


@pytest.mark.source("RR 4.1", "RR 4.3")
def test_ways_are_drawn_in_the_room_and_in_the_plane_of_the_angles(axes):
    ways = {"one": PATH, "other": PATH[::-1] + 0.3}
    for lines, place in (
        (arm.draw_arm_ways(axes[0], ways), lambda q: ends(q)[-1]),
        (arm.draw_joint_ways(axes[1], ways), lambda q: np.degrees(q) @ [1, 1j]),
    ):
        for line, path in zip(lines, (PATH, PATH[::-1] + 0.3), strict=True):
            assert np.abs(drawn(line) - [place(q) for q in path]).max() < 1e-12
        assert [line.get_label() for line in lines] == ["one", "other"]
        assert lines[0].get_linestyle() != lines[1].get_linestyle()
    assert_reach_is_seen(axes[0])
    last = PATH[::-1] + 0.3
    for line, i in zip(axes[0].lines[:3], (0, 2, 3), strict=True):
        assert np.abs(drawn(line) - ends(last[i])).max() < 1e-14
    for text, i in zip(axes[0].texts, (0, 3), strict=True):
        assert abs(complex(*text.xy) - ends(last[i])[-1]) < 1e-14
    for draw in (arm.draw_arm_ways, arm.draw_joint_ways):
        with pytest.raises(ValueError, match="shorter"):
            draw(axes[0], dict.fromkeys("abcd", PATH))


def test_descriptions_give_numbers():
    tips = np.array([ends(q)[-1] for q in PATH])
    covered = np.abs(np.diff(tips)).sum()
    said = arm.describe_arm(PATH)
    assert "links of 2 and 1.5 m turns its joints from 11 and 29 to 229 and 6 degrees" in said
    turned = np.degrees(np.abs(np.diff(PATH, axis=0)).sum(axis=0))
    assert f"by {turned[0]:.0f} and {turned[1]:.0f} degrees in all" in said
    assert (
        f"its tip covers {covered:.2f} m, from ({tips[0].real:.2f}, {tips[0].imag:.2f}) to ("
        in said
    )
    unequal = arm.describe_arm(np.zeros((1, 2)), [1e-3, 1000])
    assert "links of 0.001 and 1000 m" in unequal
    said = arm.describe_posture(np.array([-0.5, np.pi / 2]))
    assert "joint angles are -29 and 90 degrees" in said
    assert f"at (0, 0), ({2 * np.cos(0.5):.2f}, {-2 * np.sin(0.5):.2f}), (" in said
    said = arm.describe_ways({"one": PATH})
    angles = np.degrees(np.linalg.norm(np.diff(PATH, axis=0), axis=1).sum())
    assert "from joint angles of 11 and 29 to 229 and 6 degrees" in said
    assert f"one: {covered:.1f} m and {angles:.0f} degrees." in said
