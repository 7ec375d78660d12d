"""The arm against complex numbers and differences; the misprints of the report's section 4."""

import re

import numpy as np
import oracles
import pytest

from rbcourse.arm import (
    arm_forward_kinematics,
    arm_inverse_kinematics,
    arm_tip_jacobian,
    interpolate_joints,
    propagate_joints,
)

EPS = np.finfo(float).eps
RNG = np.random.default_rng(7)
LENGTHS = (0.7, 2.0, 0.1, 1.3)


@pytest.mark.source("RR 4")
@pytest.mark.parametrize("lengths", [(), LENGTHS[:1], LENGTHS[:3], LENGTHS])
def test_arms_of_any_number_of_links_by_complex_numbers(lengths):
    """The arm of the report, of 2 and 1.5 m, if none are given."""
    n = len(lengths) or 2
    q = RNG.uniform(-7, 7, (5, 6, n))
    joints, frames = arm_forward_kinematics(q, *[lengths] * bool(lengths))
    assert (joints.shape, frames.shape) == ((5, 6, n + 1, 2), (5, 6, n, 3))
    place, heading = 0, 0
    for i, length in enumerate(lengths or (2, 1.5)):
        heading = heading + q[..., i]
        link = length * np.exp(1j * heading)
        assert np.abs(frames[..., i, :2] @ [1, 1j] - (place + link / 2)).max() < 16 * EPS
        assert np.array_equal(frames[..., i, 2], heading)
        place = place + link
        assert np.abs(joints[..., i + 1, :] @ [1, 1j] - place).max() < 16 * EPS
    assert not joints[..., 0, :].any()


@pytest.mark.source("RR 4")
@pytest.mark.parametrize("lengths", [(2, 1.5), LENGTHS])
def test_the_jacobian_is_the_derivative_of_the_tip(lengths):
    def tips(t):
        """With the first, second, … angles moved by t."""
        turned = q + t * np.eye(len(lengths))[:, None]
        return arm_forward_kinematics(turned, lengths).joints[..., -1, :]

    q = RNG.uniform(-3, 3, (20, len(lengths)))
    columns = np.moveaxis(arm_tip_jacobian(q, lengths), -1, 0)
    assert columns.shape == (len(lengths), 20, 2)
    assert np.abs(oracles.derivative_by_differences(tips, 0.0) - columns).max() < 1e-9


def test_the_jacobian_of_two_links_is_singular_where_they_are_in_line():
    q = RNG.uniform(-7, 7, (100, 2))
    assert np.abs(np.linalg.det(arm_tip_jacobian(q)) - 3 * np.sin(q[:, 1])).max() < 32 * EPS
    for bent, reach in ((0, 3.5), (np.pi, 0.5)):  # of joint 0; of joint 1 it is 1.5 always
        singular = np.linalg.svd(arm_tip_jacobian([0.4, bent]), compute_uv=False)
        assert singular == pytest.approx([np.hypot(reach, 1.5), 0], abs=8 * EPS)


@pytest.mark.source("RR (20)", "RR (21)", "RR 4.1", "errata 19")
@pytest.mark.parametrize("steps", [1, 10, 37])
def test_each_joint_goes_from_its_own_start_to_its_own_goal(steps):
    """As printed, link 1's start would be blended with link 2's: the first index counts the links
    in the formula, start and goal in the sentence below it."""
    theta = np.array([[0.1, 0.2], [1.0, 2.0]])
    path, t = interpolate_joints(*theta, steps), np.linspace(0, 1, steps + 1)[:, None]
    assert np.array_equal(path[[0, -1]], theta)
    assert np.abs(path - ((1 - t) * theta[0] + t * theta[1])).max() < 4 * EPS
    printed = (1 - t) * theta[:, 0] + t * theta[:, 1]
    assert np.abs(path - printed).max(axis=1).min() > 0.05


@pytest.mark.source("RR (22)", "RR (23)", "RR 4.2")
def test_each_command_adds_velocity_times_duration():
    plan = [([1, -0.5], 2), ([0.3, 0.3], 0), ([0, 4], 0.25)]
    path, want = propagate_joints([0.1, 0.2], plan), [np.array([0.1, 0.2])]
    for velocity, duration in plan:
        want.append(want[-1] + np.array(velocity) * duration)
    assert np.array_equal(path, want)
    undone = [(-np.array(v), d) for v, d in reversed(plan)]
    assert np.abs(propagate_joints(path[-1], undone) - path[::-1]).max() < 8 * EPS
    assert propagate_joints([0.1, 0.2], []).tolist() == [[0.1, 0.2]]
    assert np.array_equal(propagate_joints([[0.1, 0.2]] * 7, plan)[:, 6], want)


@pytest.mark.source("RR 4.2", "errata 20")
def test_a_configuration_of_the_arm_is_no_planar_pose():
    """Two configurations take the tip to one place, and most planar poses are out of reach."""
    q = np.array([0.3, 0.8])
    tip = arm_forward_kinematics(q).joints[-1]
    mirrored = [2 * np.arctan2(tip[1], tip[0]) - 0.3, -0.8]
    assert np.abs(arm_forward_kinematics(mirrored).joints[-1] - tip).max() < 8 * EPS
    grid = np.stack(np.meshgrid(*[np.linspace(-np.pi, np.pi, 181)] * 2), axis=-1)
    reached = np.linalg.norm(arm_forward_kinematics(grid).joints[..., -1, :], axis=-1)
    assert 0.5 - 1e-12 < reached.min() < reached.max() < 3.5 + 1e-12
    with pytest.raises(ValueError, match=r"^plan\[0\] velocity: shape \(3\) wanted, got \(2,\)"):
        propagate_joints(np.zeros(3), [([1, -0.5], 2)])  # x, y, θ


@pytest.mark.parametrize("function", [arm_forward_kinematics, arm_tip_jacobian])
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (([0, np.nan],), "q[1] is nan, a finite number is wanted"),
        ((3,), "q: shape (..., n) wanted, got ()"),
        (([0, 0, 0],), "lengths: shape (3) wanted, got (2,)"),
        (([0, 0], [0, 1]), "lengths[0] is 0.0, a length above 0 is wanted"),
    ],
)
def test_bad_angles_and_lengths_are_named(function, arguments, message):
    with pytest.raises(ValueError, match=f"^{re.escape(message)}"):
        function(*arguments)


def test_bad_steps_starts_and_plans_are_named():
    with pytest.raises(ValueError, match=r"^steps: an integer from 1 up wanted, got 0"):
        interpolate_joints([0, 0], [1, 2], 0)
    for start, message in (
        ([0, np.nan], "start[1] is nan"),
        (1, "start: sh"),
        ([0], "plan[0] dur"),
    ):
        with pytest.raises(ValueError, match=f"^{re.escape(message)}"):
            propagate_joints(start, [([1], -1)])


@pytest.mark.source("RR 4")
@pytest.mark.parametrize(
    "lengths", [(2, 1.5), (1.5, 2), (1, 1), (1e-3, 4), (1e-200, 2e-200), (3e200, 1e200)]
)
def test_both_solutions_bring_the_tip_there(lengths):
    q = np.random.default_rng(3).uniform(-np.pi, np.pi, size=(4, 250, 2))
    q[0, :3, 1] = [0, np.pi, -np.pi]  # stretched and folded, as they come out of rounding
    tip = arm_forward_kinematics(q, lengths).joints[..., -1, :]
    found = arm_inverse_kinematics(tip, lengths)
    reached = arm_forward_kinematics(found, lengths).joints[..., -1, :]
    assert np.abs(reached - tip[..., None, :]).max() < 16 * EPS * sum(lengths)
    assert (np.abs(found) <= np.pi).all()
    assert (found[..., 0, 1] >= 0).all()
    assert np.array_equal(found[..., 1, 1], -found[..., 0, 1])


def test_one_of_the_solutions_is_the_one_it_came_from():
    q = np.random.default_rng(4).uniform(0.1, 3.0, size=(100, 2))
    for sign, k in ((1, 0), (-1, 1)):
        tip = arm_forward_kinematics(sign * q).joints[:, -1]
        assert np.abs(arm_inverse_kinematics(tip)[:, k] - sign * q).max() < 1e-13
    folded = arm_inverse_kinematics([0, 0], [1, 1])  # equal links, with the tip at the base
    assert np.abs(arm_forward_kinematics(folded, [1, 1]).joints[:, -1]).max() < 1e-15


@pytest.mark.parametrize(
    ("tip", "message"),
    [
        ([0, 3.5 + 1e-12], "tip: 0.5 to 3.5 m from the base wanted, got 3.500000000001 m"),
        ([0.5 - 1e-12, 0], "tip: 0.5 to 3.5 m from the base wanted, got 0.499999999999 m"),
        ([[1, 1], [0, 4], [0, 5]], "tip[1]: 0.5 to 3.5 m from the base wanted, got 4.0 m"),
    ],
)
def test_places_out_of_reach_are_named_and_two_links_wanted(tip, message):
    with pytest.raises(ValueError, match=f"^{re.escape(message)}"):
        arm_inverse_kinematics(tip)
    for lengths in ([1, 1, 1], [1, 0]):
        with pytest.raises(ValueError, match=r"^lengths"):
            arm_inverse_kinematics([1, 0], lengths)
