"""Compare the arm with complex numbers and differences; check misprints of the report."""

import re

import numpy as np
import oracles
import pytest

from rbcourse import arm

EPS = np.finfo(float).eps
RNG = np.random.default_rng(7)
LENGTHS = (0.7, 2.0, 0.1, 1.3)


def tips(q, *lengths):
    return arm.arm_forward_kinematics(q, *lengths).joints[..., -1, :]


@pytest.mark.source("RR 4")
@pytest.mark.parametrize("lengths", [(), LENGTHS[:1], LENGTHS[:3], LENGTHS])
def test_arms_with_any_number_of_links_agree_with_complex_numbers(lengths):
    """The default lengths of the links are 2 m and 1.5 m, as in the report. The Jacobian is
    compared with differences."""
    n = len(lengths) or 2
    q, given = RNG.uniform(-7, 7, (5, 6, n)), [lengths] * bool(lengths)
    joints, frames = arm.arm_forward_kinematics(q, *given)
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
    q = q[0, :, None]
    by_each_angle = oracles.derivative_by_differences(
        lambda t: tips(q + t * np.eye(n), *given), 0.0
    )
    J = arm.arm_tip_jacobian(q[:, 0], *given)
    assert J.shape == (6, 2, n)
    assert np.abs(by_each_angle - J.mT).max() < 1e-9


@pytest.mark.source("RR (20)", "RR (21)", "RR 4.1", "errata 19")
@pytest.mark.parametrize("steps", [1, 10, 37])
def test_each_joint_goes_from_its_own_start_to_its_own_goal(steps):
    """The printed formula would blend the starts of links 1 and 2. In this formula, the first index
    counts the links. In the sentence below the formula, the first index distinguishes start and
    goal."""
    theta = np.array([[0.1, 0.2], [1.0, 2.0]])
    path, t = arm.interpolate_joints(*theta, steps), np.linspace(0, 1, steps + 1)[:, None]
    assert np.array_equal(path[[0, -1]], theta)
    assert np.abs(path - ((1 - t) * theta[0] + t * theta[1])).max() < 4 * EPS
    printed = (1 - t) * theta[:, 0] + t * theta[:, 1]
    assert np.abs(path - printed).max(axis=1).min() > 0.05


@pytest.mark.source("RR (22)", "RR (23)", "RR 4.2")
def test_each_command_adds_velocity_times_duration():
    plan = [([1, -0.5], 2), ([0.3, 0.3], 0), ([0, 4], 0.25)]
    changes = np.array([np.multiply(velocity, duration) for velocity, duration in plan])
    want = np.cumsum([[0.1, 0.2], *changes], axis=0)
    path = arm.propagate_joints([[0.1, 0.2]] * 7, plan)
    assert np.array_equal(path, np.stack([want] * 7, axis=1))
    assert arm.propagate_joints([0.1, 0.2], []).tolist() == [[0.1, 0.2]]


@pytest.mark.source("RR 4.2", "errata 20")
def test_a_configuration_of_the_arm_is_not_a_planar_pose():
    """Two configurations take the tip to the same place, and most planar poses are out of reach."""
    q = np.array([0.3, 0.8])
    tip = tips(q)
    mirrored = [2 * np.arctan2(tip[1], tip[0]) - 0.3, -0.8]
    assert np.abs(tips(mirrored) - tip).max() < 8 * EPS
    grid = np.stack(np.meshgrid(*[np.linspace(-np.pi, np.pi, 181)] * 2), axis=-1)
    reached = np.linalg.norm(tips(grid), axis=-1)
    assert 0.5 - 1e-12 < reached.min() < reached.max() < 3.5 + 1e-12
    with pytest.raises(ValueError, match=r"^plan\[0\] velocity: shape \(3\) is wanted, got \(2,\)"):
        arm.propagate_joints(np.zeros(3), [([1, -0.5], 2)])  # x, y, θ


@pytest.mark.source("RR 4")
@pytest.mark.parametrize(
    "lengths", [(2, 1.5), (1.5, 2), (1, 1), (1e-3, 4), (1e-200, 2e-200), (3e200, 1e200)]
)
def test_both_inverse_solutions_reach_the_tip(lengths):
    q = np.random.default_rng(3).uniform(-np.pi, np.pi, size=(4, 250, 2))
    q[0, :3, 1] = [0, np.pi, -np.pi]  # arms that are stretched or folded
    tip = tips(q, lengths)
    found = arm.arm_inverse_kinematics(tip, lengths)
    assert np.abs(tips(found, lengths) - tip[..., None, :]).max() < 16 * EPS * sum(lengths)
    assert (np.abs(found) <= np.pi).all()
    assert (found[..., 0, 1] >= 0).all()
    assert np.array_equal(found[..., 1, 1], -found[..., 0, 1])
    if lengths == (2, 1.5):
        for k, elbow in enumerate((q[..., 1], -q[..., 1])):
            bent = (elbow > 0.1) & (elbow < 3)
            assert np.abs(found[bent, k] - q[bent]).max() < 1e-13
    if lengths == (1, 1):  # the tip is at the base
        assert np.abs(tips(arm.arm_inverse_kinematics([0, 0], lengths), lengths)).max() < 1e-15


REACH = "0.5 to 3.5 m from the base wanted, got"
ANGLES_AND_LENGTHS = [
    (([0, np.nan],), "q[1] is nan, a finite number is wanted"),
    ((3,), "q: shape (..., n) is wanted, got ()"),
    (([0, 0, 0],), "lengths: shape (3) is wanted, got (2,)"),
    (([0, 0], [0, 1]), "lengths[0] is 0.0, a length above 0 is wanted"),
]


@pytest.mark.parametrize(
    ("function", "arguments", "message"),
    [
        *(("arm_forward_kinematics", *bad) for bad in ANGLES_AND_LENGTHS),
        *(("arm_tip_jacobian", *bad) for bad in ANGLES_AND_LENGTHS),
        ("interpolate_joints", ([0, 0], [1, 2], 0), "steps: an integer from 1 up is wanted, got 0"),
        ("propagate_joints", ([0, np.nan], [([1], -1)]), "start[1] is nan"),
        ("propagate_joints", ([0], [([1], -1)]), "plan[0] dur"),
        ("arm_inverse_kinematics", ([0, 3.5 + 1e-12],), f"tip: {REACH} 3.500000000001 m"),
        ("arm_inverse_kinematics", ([0.5 - 1e-12, 0],), f"tip: {REACH} 0.499999999999 m"),
        ("arm_inverse_kinematics", ([[1, 1], [0, 4], [0, 5]],), f"tip[1]: {REACH} 4.0 m"),
        ("arm_inverse_kinematics", ([1, 0], [1, 1, 1]), "lengths"),
    ],
)
def test_places_out_of_reach_are_refused(function, arguments, message):
    with pytest.raises(ValueError, match=f"^{re.escape(message)}"):
        getattr(arm, function)(*arguments)
