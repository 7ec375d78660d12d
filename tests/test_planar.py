"""Planar poses, twists and paths, against SciPy's expm, small steps and complex numbers."""

import re

import numpy as np
import oracles
import pytest
from scipy.linalg import expm

import rbcourse as rb

EPS = np.finfo(float).eps
RNG = np.random.default_rng(6)
POSES = RNG.uniform(-4, 4, (200, 3))
TWISTS = np.concatenate(
    [
        RNG.uniform(-4, 4, (200, 3)),
        [[3, -2, w] for w in (0, 1e-300, 1e-12, -1e-8, np.pi, -np.pi, 2 * np.pi)],
    ]
)
PLAN = [([1, 0, 0], 3), ([0.3, -1, 0.7], 0), ([0, 0, -2], 1.5), ([-0.5, 2, 4], 0.25)]


def hat(S):
    vx, vy, w = S
    return np.array([[0, -w, vx], [w, 0, vy], [0, 0, 0]])


def undone(plan):
    return [(-np.array(velocity), duration) for velocity, duration in reversed(plan)]


@pytest.mark.source("RR 3.1")
def test_a_matrix_carries_points_of_the_body_into_the_world():
    for (x, y, theta), A in zip(POSES, rb.planar.matrix_from_planar(POSES), strict=True):
        for point in (1, 1j, 2 - 3j):
            moved = complex(x, y) + np.exp(1j * theta) * point
            assert np.abs(A @ [point.real, point.imag, 1] - [moved.real, moved.imag, 1]).max() < (
                16 * EPS
            )
    assert rb.is_se(rb.planar.matrix_from_planar(POSES), 1e-15).all()


@pytest.mark.source("RR 3.1")
def test_there_and_back_between_poses_and_matrices():
    back = rb.planar.planar_from_matrix(rb.planar.matrix_from_planar(POSES))
    assert np.array_equal(back[:, :2], POSES[:, :2])
    turns = (back[:, 2] - POSES[:, 2]) / (2 * np.pi)
    assert np.abs(turns - turns.round()).max() < 4 * EPS
    assert np.abs(back[:, 2]).max() <= np.pi
    for theta in (0, 1e-300, 1e-9, np.pi / 2, np.pi, -np.pi, -3):
        kept = rb.planar.planar_from_matrix(rb.planar.matrix_from_planar([1, 2, theta]))
        assert abs(abs(kept[2]) - abs(theta)) <= 4 * EPS * abs(theta)


def test_of_a_matrix_that_is_no_pose_the_nearest_rotation_counts():
    for block in RNG.normal(size=(50, 2, 2)):
        A = np.eye(3)
        A[:2, :2] = block
        theta = rb.planar.planar_from_matrix(A)[2]
        nearest = rb.project_so(block)
        assert np.abs(nearest - rb.planar.matrix_from_planar([0, 0, theta])[:2, :2]).max() < 1e-13
    for mirrored in (np.diag([1.0, -1, 1]), [[0, 1, 0], [1, 0, 0], [0, 0, 1]], np.zeros((3, 3))):
        for sign in (1, -1):  # of zeros too
            assert rb.planar.planar_from_matrix(sign * np.asarray(mirrored, dtype=float))[2] == 0
    huge = np.array([[1e308, -1.7e308, 0], [1.7e308, 1e308, 0], [0, 0, 1]])
    assert rb.planar.planar_from_matrix(huge)[2] == pytest.approx(np.arctan2(1.7, 1))


@pytest.mark.source("RR 3.2")
def test_composition_and_inverse_are_those_of_the_matrices():
    one, other = POSES[:100], POSES[100:]
    product = rb.planar.matrix_from_planar(one) @ rb.planar.matrix_from_planar(other)
    assert (
        np.abs(rb.planar.matrix_from_planar(rb.planar.compose_planar(one, other)) - product).max()
        < 32 * EPS
    )
    inverse = np.linalg.inv(rb.planar.matrix_from_planar(one))
    assert (
        np.abs(rb.planar.matrix_from_planar(rb.planar.inverse_planar(one)) - inverse).max()
        < 32 * EPS
    )
    assert np.abs(rb.planar.compose_planar(one, rb.planar.inverse_planar(one))).max() < 32 * EPS
    assert np.array_equal(rb.planar.compose_planar([0, 0, 7], [0, 0, 8]), [0, 0, 15])


@pytest.mark.source("RR 3.2")
@pytest.mark.parametrize("S", TWISTS)
def test_the_exponential_is_that_of_the_matrix(S):
    """Of small twists SciPy's too; its error grows with the twist, to 5e-14 here."""
    ours = rb.planar.exp_planar(S)
    assert np.abs(rb.planar.matrix_from_planar(ours) - oracles.expm(hat(S))).max() < 8 * EPS
    assert ours[2] == S[2]
    small = rb.planar.matrix_from_planar(rb.planar.exp_planar(S / 8))
    assert np.abs(small - expm(hat(S / 8))).max() < 1e-14


@pytest.mark.source("RR 3.2")
def test_the_exponential_is_that_of_space():
    in_space = np.zeros((len(TWISTS), 6))
    in_space[:, 2], in_space[:, 3:5] = TWISTS[:, 2], TWISTS[:, :2]
    A = rb.exp_se3(in_space)[:, [0, 1, 3]][:, :, [0, 1, 3]]
    assert np.abs(rb.planar.matrix_from_planar(rb.planar.exp_planar(TWISTS)) - A).max() < 1e-14


def test_the_logarithm_undoes_the_exponential():
    short = TWISTS[np.abs(TWISTS[:, 2]) <= np.pi]
    assert len(short) > 100
    assert np.abs(rb.planar.log_planar(rb.planar.exp_planar(short)) - short).max() < 32 * EPS
    again = rb.planar.exp_planar(rb.planar.log_planar(POSES))
    full = (POSES[:, 2] - again[:, 2]) / (2 * np.pi)
    assert np.abs(again[:, :2] - POSES[:, :2]).max() < 32 * EPS
    assert np.abs(full - full.round()).max() < 4 * EPS
    assert np.abs(rb.planar.log_planar(POSES)[:, 2]).max() <= np.pi
    assert np.array_equal(rb.planar.log_planar([1, 2, 0]), [1, 2, 0])
    assert np.array_equal(rb.planar.log_planar(short)[:, 2], short[:, 2])
    assert [rb.planar.log_planar([0, 2, w])[2] for w in (np.pi, -np.pi)] == [np.pi, -np.pi]


def test_the_logarithm_forgets_any_number_of_turns():
    for theta in [*(k * np.pi for k in range(-41, 42)), 1e6, -2.3e6, 1e15]:
        twist = rb.planar.log_planar([1, 2, theta])
        assert abs(twist[2]) <= np.pi
        turned = rb.planar.matrix_from_planar(rb.planar.exp_planar(twist))
        assert np.abs(turned - rb.planar.matrix_from_planar([1, 2, theta])).max() < 16 * EPS


@pytest.mark.source("RR (14)", "RR (15)", "RR (16)")
@pytest.mark.parametrize("steps", [1, 10, 37])
def test_poses_are_blended_evenly(steps):
    path = rb.planar.interpolate_planar(POSES[0], POSES[1], steps)
    assert path.shape == (steps + 1, 3)
    assert np.array_equal(path[[0, -1]], POSES[:2])
    for i, pose in enumerate(path):
        even = POSES[0] + i / steps * (POSES[1] - POSES[0])
        assert np.abs(pose - even).max() < 16 * EPS
    assert rb.planar.interpolate_planar(POSES[0], POSES[1]).shape == (11, 3)


def test_the_ends_of_a_blend_are_exact():
    start, goal = POSES[:100], 1e16 * POSES[100:]
    for one, other in ((start, goal), (goal, start), (start, start)):
        path = rb.planar.interpolate_planar(one, other, steps=7)
        assert np.array_equal(path[0], one)
        assert np.array_equal(path[-1], other)


@pytest.mark.source("RR (16)")
def test_theta_goes_as_far_as_the_numbers_say_or_the_short_way():
    for k in (-41, -5, -3, 3, 5, 17, 41):
        path = rb.planar.interpolate_planar([0, 0, 0.25], [0, 0, 0.25 + k * np.pi], shortest=True)
        assert abs(abs(path[-1, 2] - 0.25) - np.pi) < 8 * (1 + abs(k)) * EPS
    start, goal = np.radians([[0, 0, 170], [0, 0, -170]])
    assert np.degrees(np.ptp(rb.planar.interpolate_planar(start, goal)[:, 2])) == pytest.approx(340)
    short = rb.planar.interpolate_planar(start, goal, shortest=True)[:, 2]
    assert np.degrees(short[[0, -1]]) == pytest.approx([170, 190])
    for turns in (-3, 0, 2):
        for delta in (0.3, -3.1, 3.1):
            end = 1 + delta + 2 * np.pi * turns
            path = rb.planar.interpolate_planar([0, 0, 1], [5, 6, end], shortest=True)
            assert np.abs(path[-1] - [5, 6, 1 + delta]).max() < 32 * EPS
            assert np.array_equal(path[0], [0, 0, 1])


def test_the_short_way_leaves_a_short_way_alone():
    for goal in (1, -1, np.pi, -np.pi):
        plain, short = (
            rb.planar.interpolate_planar([0, 0, 0], [1, 2, goal], shortest=flag)
            for flag in (False, True)
        )
        assert np.array_equal(plain, short)
    start, goal = POSES[:, None] * [1, 1, 0.3], POSES * [1, 1, 0.3]
    assert np.array_equal(rb.planar.interpolate_planar(start, goal, 1, shortest=True)[1, 0], goal)


def test_the_same_pose_may_be_start_and_goal():
    path = rb.planar.interpolate_planar(POSES[0], POSES[0], steps=3)
    assert np.array_equal(path, [POSES[0]] * 4)
    turned = rb.planar.interpolate_planar([1.1, 0.7, 0], [1.1, 0.7, 6], steps=50)
    assert np.array_equal(turned[:, :2], [[1.1, 0.7]] * 51)


@pytest.mark.source("RR (17)", "RR (18)", "RR (19)")
def test_in_the_world_velocity_times_duration_is_added():
    path = rb.planar.propagate_planar(POSES[0], PLAN)
    assert path.shape == (len(PLAN) + 1, 3)
    assert np.array_equal(path[0], POSES[0])
    x, y, theta = POSES[0]
    for i, ((vx, vy, vtheta), d) in enumerate(PLAN, start=1):
        x, y, theta = x + vx * d, y + vy * d, theta + vtheta * d
        assert np.array_equal(path[i], [x, y, theta])


@pytest.mark.source("RR 3.2")
def test_in_the_body_a_command_is_a_constant_twist():
    path = rb.planar.propagate_planar(POSES[0], PLAN, frame="body")
    assert path.shape == (len(PLAN) + 1, 3)
    assert np.array_equal(path[0], POSES[0])
    A = rb.planar.matrix_from_planar(POSES[0])
    for i, (velocity, duration) in enumerate(PLAN, start=1):
        A = A @ expm(duration * hat(velocity))
        assert np.abs(rb.planar.matrix_from_planar(path[i]) - A).max() < 1e-14
    assert np.array_equal(path[2], path[1])
    assert path[-1, 2] == pytest.approx(POSES[0, 2] - 2 * 1.5 + 4 * 0.25)


def test_in_the_body_many_small_steps_come_to_the_same():
    velocity, duration, count = np.array([1.2, -0.4, 2.5]), 3.0, 100_000
    theta = 0.3 + velocity[2] * duration * np.arange(count) / count
    c, s = np.cos(theta), np.sin(theta)
    small = np.array([c * velocity[0] - s * velocity[1], s * velocity[0] + c * velocity[1]])
    place = np.array([1, 2]) + small.sum(axis=1) * duration / count
    path = rb.planar.propagate_planar([1, 2, 0.3], [(velocity, duration)], frame="body")
    bound = np.hypot(*velocity[:2]) * velocity[2] * duration**2 / (2 * count)
    assert np.linalg.norm(path[-1, :2] - place) < bound < 1.5e-4
    assert np.abs(path[-1, :2] - place).max() < 1e-4
    pieces = [(velocity, duration / 1000)] * 1000
    fine = rb.planar.propagate_planar([1, 2, 0.3], pieces, frame="body")
    assert np.abs(fine[-1] - path[-1]).max() < 1e-12


@pytest.mark.source("RR 3.2")
@pytest.mark.parametrize("frame", ["world", "body"])
def test_a_plan_undone_leads_back(frame):
    there = rb.planar.propagate_planar(POSES[0], PLAN, frame=frame)
    back = rb.planar.propagate_planar(there[-1], undone(PLAN), frame=frame)
    assert np.abs(back - there[::-1]).max() < 1e-14


def test_stacks_of_bodies_obey_one_plan():
    for frame in ("world", "body"):
        path = rb.planar.propagate_planar(POSES.reshape(4, 50, 3), PLAN, frame=frame)
        assert path.shape == (len(PLAN) + 1, 4, 50, 3)
        one = rb.planar.propagate_planar(POSES[57], PLAN, frame=frame)
        assert np.abs(path[:, 1, 7] - one).max() < 16 * EPS
    path = rb.planar.interpolate_planar(POSES[:5, None], POSES[5:12], steps=4, shortest=True)
    assert path.shape == (5, 5, 7, 3)
    one = rb.planar.interpolate_planar(POSES[2], POSES[8], steps=4, shortest=True)
    assert np.array_equal(path[:, 2, 3], one)


@pytest.mark.parametrize("frame", ["world", "body"])
def test_no_commands_leave_the_start_alone(frame):
    path = rb.planar.propagate_planar([1, 2, 3], [], frame=frame)
    assert path.tolist() == [[1, 2, 3]]


@pytest.mark.parametrize("frame", ["world", "body"])
@pytest.mark.parametrize(
    ("plan", "message"),
    [
        ([([1, 0, 0], 1), ([1, 0, 0], -2)], "plan[1] duration is -2.0, a duration from 0 up"),
        ([([1, np.nan, 0], 1)], "plan[0] velocity[1] is nan, a finite number is wanted"),
        ([([1, 0, 0], np.inf)], "plan[0] duration is inf, a finite number is wanted"),
        ([([1, 0, 0], np.nan)], "plan[0] duration is nan, a finite number is wanted"),
        ([([1, 0], 1)], "plan[0] velocity: shape (3) wanted, got (2,)"),
        ([([[1, 0, 0]], 1)], "plan[0] velocity: shape (3) wanted, got (1, 3)"),
        ([([1, 0, 0], [1, 2])], "plan[0] duration: shape () wanted, got (2,)"),
        ([([1e300, 0, 0], 1e300)], "plan[0] leads beyond all numbers"),
        ([([0, 1e308, 0], 1), ([0, 1e308, 0], 1)], "plan[1] leads beyond all numbers"),
        ([[1, 0, 0]], "plan[0]: (velocity, duration) wanted, got [1, 0, 0]"),
        ([7], "plan[0]: (velocity, duration) wanted, got 7"),
        (7, "plan: a list of (velocity, duration) wanted, got 7"),
        ([("abc", 1)], "plan[0] velocity: real numbers wanted"),
        ([([1, 0, 0], "1 s")], "plan[0] duration: real numbers wanted"),
    ],
)
def test_what_is_no_plan_is_refused_and_named(frame, plan, message):
    with pytest.raises(ValueError, match=f"^{re.escape(message)}"):
        rb.planar.propagate_planar([0, 0, 0], plan, frame=frame)


def test_what_is_no_pose_is_refused_and_named():
    plan = [([1, 0, 0], 1)]
    for call in (
        lambda bad: rb.planar.matrix_from_planar(bad),
        lambda bad: rb.planar.inverse_planar(bad),
        lambda bad: rb.planar.log_planar(bad),
        lambda bad: rb.planar.compose_planar(bad, [0, 0, 0]),
    ):
        with pytest.raises(ValueError, match=r"^pose: shape \(\.\.\., 3\) wanted, got \(2,\)"):
            call([1, 2])
        with pytest.raises(ValueError, match=r"^pose\[2\] is nan"):
            call([1, 2, np.nan])
    with pytest.raises(ValueError, match=r"^start\[0\] is nan"):
        rb.planar.propagate_planar([np.nan, 0, 0], plan)
    with pytest.raises(ValueError, match=r"^goal: shape \(\.\.\., 3\) wanted, got \(4,\)"):
        rb.planar.interpolate_planar([0, 0, 0], [1, 2, 3, 4])
    with pytest.raises(ValueError, match=r"broadcast: start \(2,\), goal \(3,\)"):
        rb.planar.interpolate_planar(np.zeros((2, 3)), np.zeros((3, 3)), shortest=True)
    with pytest.raises(ValueError, match=r"broadcast: pose \(2,\), step \(3,\)"):
        rb.planar.compose_planar(np.zeros((2, 3)), np.zeros((3, 3)))
    with pytest.raises(ValueError, match=r"^S\[2\] is inf"):
        rb.planar.exp_planar([0, 0, np.inf])
    with pytest.raises(ValueError, match=r"^A: shape \(\.\.\., 3, 3\) wanted, got \(4, 4\)"):
        rb.planar.planar_from_matrix(np.eye(4))
    with pytest.raises(ValueError, match=r"^frame: 'world' or 'body' wanted, got 'World'"):
        rb.planar.propagate_planar([0, 0, 0], plan, frame="World")
    for steps in (0, -3, 2.5, True, "10"):
        with pytest.raises(ValueError, match=r"^steps: an integer from 1 up wanted, got"):
            rb.planar.interpolate_planar([0, 0, 0], [1, 1, 1], steps)


def test_arguments_are_not_changed():
    start, velocity = np.array([1.0, 2, 3]), np.array([1.0, 0, 2])
    for frame in ("world", "body"):
        path = rb.planar.propagate_planar(start, [(velocity, 1)], frame=frame)
        path[0] = 9
    assert start.tolist() == [1, 2, 3]
    assert velocity.tolist() == [1, 0, 2]
