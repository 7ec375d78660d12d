"""Arms are drawn at the angles of the path, and the descriptions state the numbers of the path."""

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.patches import Arc, Circle

import rbcourse as rb
from rbcourse.draw import arm

PATH = np.array([[0.2, 0.5], [1.0, -0.5], [-2.0, 3.0], [4.0, 0.1]])


@pytest.fixture
def axes():
    return Figure().subplots(1, 2)


def ends(q, lengths=(2, 1.5)):
    """Return the joints and the tip as complex numbers."""
    return np.append(0, np.cumsum(np.array(lengths) * np.exp(1j * np.cumsum(q))))


def off(found, wanted):
    """Return the largest distance between two lists of lines, pairs or complex numbers."""
    pairs = np.transpose(found.get_data()) if hasattr(found, "get_data") else np.array(found)
    return np.abs((pairs if np.iscomplexobj(pairs) else pairs @ [1, 1j]) - wanted).max()


def test_the_path_table_has_joint_angles_and_link_ends():
    path, lengths = np.random.default_rng(1).uniform(-3, 3, (4, 3)), (1, 2, 3)
    table = arm.path_table(path, lengths)
    places = [f"{axis}{k} [m]" for k in (1, 2, 3) for axis in "xy"]
    assert list(table) == [*(f"theta{i} [rad]" for i in range(3)), *places]
    angles, xy = np.split(np.array(list(table.values())), [3])
    assert np.array_equal(angles.T, path)
    assert off((xy[::2] + 1j * xy[1::2]).T, [ends(q, lengths)[1:] for q in path]) < 1e-14


@pytest.mark.source("RR 4")
@pytest.mark.parametrize("q", [[0.5, 0.8], [-0.5, -2], [2, -1]])
def test_a_drawn_arm_shows_its_links_and_angles(axes, q):
    links, *arrows = arm.draw_posture(axes[0], np.array(q))
    joints, headings = ends(q), np.cumsum(q)
    assert off(links, joints) < 1e-14
    centres = np.repeat((joints[1:] + joints[:-1]) / 2, 2)
    assert off([arrow.XY[0] for arrow in arrows], centres) < 1e-14
    directions = 0.45 * np.exp(1j * np.repeat(headings, 2)) * [1, 1j, 1, 1j]
    assert off([(arrow.U[0], arrow.V[0]) for arrow in arrows], directions) < 1e-14
    arcs = [patch for patch in axes[0].patches if isinstance(patch, Arc)]
    for k, (arc, before, angle) in enumerate(zip(arcs, [0, q[0]], q, strict=True)):
        assert complex(*arc.center) == joints[k]
        turned = sorted(np.degrees([before, before + angle]))
        assert [arc.theta1, arc.theta2] == pytest.approx(turned)
        along = 0.9 * np.exp(1j * before)
        assert off(axes[0].lines[1 + k], joints[k] + [0, along]) < 1e-14


@pytest.mark.source("RR 4")
@pytest.mark.parametrize("q", [[0.5, 1.5], [0.2, 0.1, 0.3]])
def test_the_arrows_at_the_tip_are_the_columns_of_the_jacobian(axes, q):
    lengths = [2, 1.5, 1][: len(q)]
    links, *arrows = arm.draw_tip_velocities(axes[0], np.array(q), lengths)
    assert off(links, ends(q, lengths)) < 1e-14
    J = rb.arm.arm_tip_jacobian(q, lengths)
    for arrow, (x, y) in zip(arrows, J.T, strict=True):
        assert off(arrow.XY[0], ends(q, lengths)[-1]) < 1e-14
        assert off([arrow.U[0], arrow.V[0]], complex(x, y) / 2) < 1e-14
    first = np.degrees(np.arctan2(J[1, 0], J[0, 0]))
    said = arm.describe_tip_velocities({"here": np.array(q)}, lengths)
    assert f"Directions of the arrows: here, to {first:.0f}" in said


@pytest.mark.parametrize(
    ("lengths", "radii"), [((2, 1.5), (3.5, 0.5)), ((1, 1, 1), (3, 0)), ((1, 5, 1), (7, 3))]
)
def test_the_reach_is_bounded_by_circles(axes, lengths, radii):
    arm.show_reach(axes[0], lengths)
    circles = [patch for patch in axes[0].patches if isinstance(patch, Circle)]
    assert [circle.radius for circle in circles] == pytest.approx(radii, abs=1e-14)
    assert axes[0].get_xlim()[1] == axes[0].get_ylim()[1] > radii[0]
    assert axes[0].get_aspect() == 1


@pytest.mark.source("RR 4.1", "RR 4.3", "RR Fig. 8", "RR Fig. 9")
def test_arms_move_along_their_paths(axes):
    tips = np.array([ends(q)[-1] for q in PATH])
    update = arm.moving_arm(axes[0], PATH, shown=[0, 2])
    for i in (0, 3, 1):
        links, way = update(i)
        assert off(links, ends(PATH[i])) < 1e-14
        assert off(way, tips[: i + 1]) < 1e-14
    paths = {"other": PATH[::-1] + 0.3, "one": PATH}
    ways = {arm.draw_arm_ways: tips, arm.draw_joint_ways: np.degrees(PATH) @ [1, 1j]}
    for draw, way in ways.items():
        other, line = draw(axes[1], paths)
        assert off(line, way) < 1e-12
        assert [other.get_label(), line.get_label()] == list(paths)
        assert line.get_linestyle() != other.get_linestyle()
        with pytest.raises(ValueError, match="shorter"):
            draw(axes[1], dict.fromkeys("abcd", PATH))
    for line, i in zip(axes[0].lines[:2] + axes[1].lines[:3], (0, 2, 0, 2, 3), strict=True):
        assert off(line, ends(PATH[i])) < 1e-14  # the pale arms


def test_descriptions_state_the_drawn_numbers():
    tips, steps = np.array([ends(q)[-1] for q in PATH]), np.diff(PATH, axis=0)
    covered, (first, second) = np.abs(np.diff(tips)).sum(), np.degrees(np.abs(steps).sum(axis=0))
    said = arm.describe_arm(PATH) + arm.describe_arm(np.zeros((1, 2)), [1e-3, 1000])
    said += arm.describe_posture(np.array([-0.5, np.pi / 2])) + arm.describe_ways({"one": PATH})
    for words in (
        "from joint angles of 11 and 29 degrees to 229 and 6 degrees",
        "links are 2 and 1.5 m long",
        f"by {first:.0f} and {second:.0f} degrees in all",
        f"the tip covers {covered:.2f} m, from ({tips[0].real:.2f}, {tips[0].imag:.2f}) to (",
        "links are 0.001 and 1000 m long",
        "joint angles are -29 and 90 degrees",
        f"at (0, 0), ({2 * np.cos(0.5):.2f}, {-2 * np.sin(0.5):.2f}), (",
        f"one: {covered:.1f} m and {np.degrees(np.linalg.norm(steps, axis=1).sum()):.0f} degrees.",
    ):
        assert words in said
