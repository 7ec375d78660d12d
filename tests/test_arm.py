"""The arm against complex numbers and differences; the misprints of the report's section 4."""

import numpy as np
import oracles
import pytest

import rbcourse as rb

EPS = np.finfo(float).eps
RNG = np.random.default_rng(7)
ANGLES = RNG.uniform(-7, 7, (100, 2))
LENGTHS = (0.7, 2.0, 0.1, 1.3)


@pytest.mark.source("RR 4")
def test_the_arm_of_the_report_by_complex_numbers():
    posture = rb.arm.arm_forward_kinematics(ANGLES)
    assert posture.joints.shape == (100, 3, 2)
    assert posture.frames.shape == (100, 2, 3)
    for (theta0, theta1), joints, frames in zip(ANGLES, *posture, strict=True):
        elbow = 2 * np.exp(1j * theta0)
        tip = elbow + 1.5 * np.exp(1j * (theta0 + theta1))
        assert np.abs(joints @ [1, 1j] - [0, elbow, tip]).max() < 16 * EPS
        centres = frames[:, :2] @ [1, 1j]
        assert np.abs(centres - [elbow / 2, (elbow + tip) / 2]).max() < 16 * EPS
        assert np.array_equal(frames[:, 2], [theta0, theta0 + theta1])


@pytest.mark.source("RR 4")
@pytest.mark.parametrize("n", [1, 3, 4])
def test_arms_of_any_number_of_links(n):
    q = RNG.uniform(-3, 3, (5, 6, n))
    posture = rb.arm.arm_forward_kinematics(q, LENGTHS[:n])
    headings = np.array([q[..., : i + 1].sum(axis=-1) for i in range(n)])
    ends = np.array([length * np.exp(1j * h) for length, h in zip(LENGTHS, headings, strict=False)])
    for i in range(n + 1):
        place = posture.joints[..., i, :] @ [1, 1j]
        assert np.abs(place - ends[:i].sum(axis=0)).max() < 32 * EPS
    joints = posture.joints
    middles = (joints[..., :-1, :] + joints[..., 1:, :]) / 2
    assert np.abs(posture.frames[..., :2] - middles).max() < 16 * EPS
    assert np.abs(posture.frames[..., 2] - np.moveaxis(headings, 0, -1)).max() < 16 * EPS


@pytest.mark.source("RR 4")
def test_a_frame_carries_its_link():
    """The ends of a link are half its length before and behind its frame."""
    posture = rb.arm.arm_forward_kinematics(ANGLES)
    A = rb.planar.matrix_from_planar(posture.frames)
    for i, length in enumerate((2, 1.5)):
        for side, end in ((-1, posture.joints[:, i]), (1, posture.joints[:, i + 1])):
            assert np.abs((A[:, i] @ [side * length / 2, 0, 1])[:, :2] - end).max() < 16 * EPS


@pytest.mark.source("RR 4")
@pytest.mark.parametrize("lengths", [(2, 1.5), LENGTHS])
def test_the_jacobian_is_the_derivative_of_the_tip(lengths):
    q, n = RNG.uniform(-3, 3, (20, len(lengths))), len(lengths)
    J = rb.arm.arm_tip_jacobian(q, lengths)
    assert J.shape == (20, 2, n)
    for k in range(n):

        def tip(t, k=k):
            turned = np.asarray(t)[..., None, None] * np.eye(n)[k]
            return rb.arm.arm_forward_kinematics(q + turned, lengths).joints[..., -1, :]

        assert np.abs(oracles.derivative_by_differences(tip, 0.0) - J[..., k]).max() < 1e-9


def test_the_jacobian_of_two_links_is_singular_where_they_are_in_line():
    J = rb.arm.arm_tip_jacobian(ANGLES)
    assert np.abs(np.linalg.det(J) - 3 * np.sin(ANGLES[:, 1])).max() < 32 * EPS
    for bent, reach in ((0, 3.5), (np.pi, 0.5)):  # of joint 0; of joint 1 it is 1.5 always
        singular = np.linalg.svd(rb.arm.arm_tip_jacobian([0.4, bent]), compute_uv=False)
        assert singular == pytest.approx([np.hypot(reach, 1.5), 0], abs=8 * EPS)


@pytest.mark.source("RR (20)", "RR (21)", "RR 4.1", "errata 19")
@pytest.mark.parametrize("steps", [1, 10, 37])
def test_each_joint_goes_from_its_own_start_to_its_own_goal(steps):
    """As printed, link 1's start would be blended with link 2's: the first index counts the links
    in the formula, start and goal in the sentence below it."""
    start, goal = np.array([0.1, 0.2]), np.array([1.0, 2.0])
    path = rb.arm.interpolate_joints(start, goal, steps)
    assert path.shape == (steps + 1, 2)
    assert np.array_equal(path[[0, -1]], [start, goal])
    for i, q in enumerate(path):
        t, theta = i / steps, np.transpose([start, goal])
        assert np.abs(q - ((1 - t) * theta[:, 0] + t * theta[:, 1])).max() < 4 * EPS
        theta = np.array([start, goal])
        printed = (1 - t) * theta[:, 0] + t * theta[:, 1]
        assert np.abs(q - printed).max() > 0.05


@pytest.mark.source("RR (22)", "RR (23)", "RR 4.2")
def test_each_command_adds_velocity_times_duration():
    plan = [([1, -0.5], 2), ([0.3, 0.3], 0), ([0, 4], 0.25)]
    path = rb.arm.propagate_joints([0.1, 0.2], plan)
    theta0, theta1 = 0.1, 0.2
    assert path.shape == (4, 2)
    assert path[0].tolist() == [0.1, 0.2]
    for i, ((v0, v1), d) in enumerate(plan, start=1):
        theta0, theta1 = theta0 + v0 * d, theta1 + v1 * d
        assert path[i].tolist() == [theta0, theta1]
    undone = [(-np.array(v), d) for v, d in reversed(plan)]
    assert np.abs(rb.arm.propagate_joints(path[-1], undone) - path[::-1]).max() < 8 * EPS
    assert rb.arm.propagate_joints([0.1, 0.2], []).tolist() == [[0.1, 0.2]]
    assert rb.arm.propagate_joints(np.zeros((7, 2)), plan).shape == (4, 7, 2)


@pytest.mark.source("RR 4.2", "errata 20")
def test_a_configuration_of_the_arm_is_no_planar_pose():
    """Two configurations take the tip to one place, and most planar poses are out of reach."""
    q = np.array([0.3, 0.8])
    tip = rb.arm.arm_forward_kinematics(q).joints[-1]
    mirrored = [2 * np.arctan2(tip[1], tip[0]) - 0.3, -0.8]
    assert np.abs(rb.arm.arm_forward_kinematics(mirrored).joints[-1] - tip).max() < 8 * EPS
    grid = np.stack(np.meshgrid(*[np.linspace(-np.pi, np.pi, 181)] * 2), axis=-1)
    reached = np.linalg.norm(rb.arm.arm_forward_kinematics(grid).joints[..., -1, :], axis=-1)
    assert 0.5 - 1e-12 < reached.min() < reached.max() < 3.5 + 1e-12
    assert rb.arm.propagate_joints(q, [([1, -0.5], 2)]).shape == (2, 2)
    with pytest.raises(ValueError, match=r"^plan\[0\] velocity: shape \(3\) wanted, got \(2,\)"):
        rb.arm.propagate_joints(np.zeros(3), [([1, -0.5], 2)])  # x, y, θ


def test_bad_input_is_named():
    for call in (rb.arm.arm_forward_kinematics, rb.arm.arm_tip_jacobian):
        with pytest.raises(ValueError, match=r"^q\[1\] is nan, a finite number is wanted"):
            call([0, np.nan])
        with pytest.raises(ValueError, match=r"^q: shape \(\.\.\., n\) wanted, got \(\)"):
            call(3)
        with pytest.raises(ValueError, match=r"^lengths: shape \(3\) wanted, got \(2,\)"):
            call([0, 0, 0])
        with pytest.raises(ValueError, match=r"^lengths: shape \(2\) wanted, got \(1, 2\)"):
            call([0, 0], [[1, 2]])
        with pytest.raises(ValueError, match=r"^lengths\[1\] is -1.0, a length above 0 is wanted"):
            call([0, 0], [1, -1])
        with pytest.raises(ValueError, match=r"^lengths\[0\] is 0.0, a length above 0 is wanted"):
            call([0, 0], [0, 1])
    with pytest.raises(ValueError, match=r"^goal: shape \(\.\.\., 2\) wanted, got \(3,\)"):
        rb.arm.interpolate_joints([0, 0], [1, 2, 3])
    with pytest.raises(ValueError, match=r"^steps: an integer from 1 up wanted, got 0"):
        rb.arm.interpolate_joints([0, 0], [1, 2], 0)
    with pytest.raises(ValueError, match=r"^start\[0\] is inf"):
        rb.arm.interpolate_joints([np.inf, 0], [1, 2])
    with pytest.raises(ValueError, match=r"broadcast: start \(2,\), goal \(3,\)"):
        rb.arm.interpolate_joints(np.zeros((2, 2)), np.zeros((3, 2)))
    with pytest.raises(ValueError, match=r"^start\[1\] is nan"):
        rb.arm.propagate_joints([0, np.nan], [])
    with pytest.raises(ValueError, match=r"^start: shape \(\.\.\., n\) wanted, got \(\)"):
        rb.arm.propagate_joints(1, [])
    with pytest.raises(ValueError, match=r"^plan\[1\] duration is -1\.0"):
        rb.arm.propagate_joints([0, 0], [([1, 0], 1), ([1, 0], -1)])


PAIRS = [(2.0, 1.5), (1.5, 2.0), (1.0, 1.0), (1e-3, 4.0), (1e-200, 2e-200), (3e200, 1e200)]


@pytest.mark.source("RR 4")
@pytest.mark.parametrize("lengths", PAIRS)
def test_both_solutions_bring_the_tip_there(lengths):
    q = np.random.default_rng(3).uniform(-np.pi, np.pi, size=(4, 250, 2))
    q[0, :3, 1] = [0, np.pi, -np.pi]  # stretched and folded, as they come out of rounding
    tip = rb.arm.arm_forward_kinematics(q, lengths).joints[..., -1, :]
    found = rb.arm.arm_inverse_kinematics(tip, lengths)
    assert found.shape == (4, 250, 2, 2)
    reached = rb.arm.arm_forward_kinematics(found, lengths).joints[..., -1, :]
    assert np.abs(reached - tip[..., None, :]).max() < 16 * EPS * sum(lengths)
    assert (np.abs(found) <= np.pi).all()
    assert (found[..., 0, 1] >= 0).all()
    assert np.array_equal(found[..., 1, 1], -found[..., 0, 1])


def test_one_of_the_solutions_is_the_one_it_came_from():
    q = np.random.default_rng(4).uniform(0.1, 3.0, size=(100, 2))
    for sign, k in ((1, 0), (-1, 1)):
        tip = rb.arm.arm_forward_kinematics(sign * q).joints[:, -1]
        assert np.abs(rb.arm.arm_inverse_kinematics(tip)[:, k] - sign * q).max() < 1e-13


def test_at_the_base_equal_links_fold_up():
    for found in rb.arm.arm_inverse_kinematics([0, 0], [1, 1]):
        assert np.abs(rb.arm.arm_forward_kinematics(found, [1, 1]).joints[-1]).max() < 1e-15


@pytest.mark.parametrize(
    ("tip", "message"),
    [
        ([3.6, 0], "tip: 0.5 to 3.5 m from the base wanted, got 3.6 m"),
        ([0, 0.4], "tip: 0.5 to 3.5 m from the base wanted, got 0.4 m"),
        ([0, 3.5 + 1e-12], "tip: 0.5 to 3.5 m from the base wanted, got 3.500000000001 m"),
        ([0.5 - 1e-12, 0], "tip: 0.5 to 3.5 m from the base wanted, got 0.499999999999 m"),
        ([[1, 1], [0, 4], [0, 5]], r"tip\[1\]: 0.5 to 3.5 m from the base wanted, got 4.0 m"),
        ([1, np.nan], r"tip\[1\] is nan"),
        ([1, 2, 3], "tip: shape"),
    ],
)
def test_places_out_of_reach_are_named(tip, message):
    with pytest.raises(ValueError, match=f"^{message}"):
        rb.arm.arm_inverse_kinematics(tip)


def test_an_arm_of_two_links_is_wanted():
    for lengths in ([1, 1, 1], [1], [1, 0], [1, -1]):
        with pytest.raises(ValueError, match="lengths"):
            rb.arm.arm_inverse_kinematics([1, 0], lengths)
