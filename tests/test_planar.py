"""Planar poses, twists and paths, against SciPy's expm, small steps and complex numbers."""

import re

import numpy as np
import oracles
import pytest
from scipy.linalg import expm

import rbcourse as rb
from rbcourse.planar import (
    compose_planar,
    exp_planar,
    interpolate_planar,
    inverse_planar,
    log_planar,
    matrix_from_planar,
    planar_from_matrix,
    propagate_planar,
)

EPS = np.finfo(float).eps
RNG = np.random.default_rng(6)
POSES = RNG.uniform(-4, 4, (200, 3))
TURNS = [0, 1e-300, 1e-12, -1e-8, np.pi, -np.pi, 2 * np.pi]
TWISTS = np.concatenate([RNG.uniform(-4, 4, (200, 3)), [[3, -2, w] for w in TURNS]])
PLAN = [([1, 0, 0], 3), ([0.3, -1, 0.7], 0), ([0, 0, -2], 1.5), ([-0.5, 2, 4], 0.25)]
both_frames = pytest.mark.parametrize("frame", ["world", "body"])


def hat(S):
    vx, vy, w = S
    return np.array([[0, -w, vx], [w, 0, vy], [0, 0, 0]])


@pytest.mark.source("RR 3.1")
def test_a_matrix_carries_points_of_the_body_into_the_world():
    A, (x, y, theta) = matrix_from_planar(POSES), POSES.T
    for point in (1, 1j, 2 - 3j):
        moved = x + 1j * y + np.exp(1j * theta) * point
        want = np.transpose([moved.real, moved.imag, np.ones(len(A))])
        assert np.abs(A @ [point.real, point.imag, 1] - want).max() < 16 * EPS
    assert rb.is_se(A, 1e-15).all()


@pytest.mark.source("RR 3.1")
def test_there_and_back_between_poses_and_matrices():
    back = planar_from_matrix(matrix_from_planar(POSES))
    assert np.array_equal(back[:, :2], POSES[:, :2])
    turns = (back[:, 2] - POSES[:, 2]) / (2 * np.pi)
    assert np.abs(turns - turns.round()).max() < 4 * EPS
    assert np.abs(back[:, 2]).max() <= np.pi
    for theta in (0, 1e-300, 1e-9, np.pi / 2, np.pi, -np.pi, -3):
        kept = planar_from_matrix(matrix_from_planar([1, 2, theta]))
        assert abs(abs(kept[2]) - abs(theta)) <= 4 * EPS * abs(theta)


def test_of_a_matrix_that_is_no_pose_the_nearest_rotation_counts():
    for block in RNG.normal(size=(50, 2, 2)):
        A = np.eye(3)
        A[:2, :2] = block
        nearest = matrix_from_planar([0, 0, planar_from_matrix(A)[2]])[:2, :2]
        assert np.abs(nearest - rb.project_so(block)).max() < 1e-13
    mirrored = np.array([np.diag([1.0, -1, 1]), np.eye(3)[[1, 0, 2]], np.zeros((3, 3))])
    assert not planar_from_matrix([mirrored, -mirrored])[..., 2].any()
    huge = np.array([[1e308, -1.7e308, 0], [1.7e308, 1e308, 0], [0, 0, 1]])
    assert planar_from_matrix(huge)[2] == pytest.approx(np.arctan2(1.7, 1))


@pytest.mark.source("RR 3.2")
def test_composition_and_inverse_are_those_of_the_matrices():
    one, other = POSES[:100], POSES[100:]
    product = matrix_from_planar(one) @ matrix_from_planar(other)
    assert np.abs(matrix_from_planar(compose_planar(one, other)) - product).max() < 32 * EPS
    inverse = np.linalg.inv(matrix_from_planar(one))
    assert np.abs(matrix_from_planar(inverse_planar(one)) - inverse).max() < 32 * EPS
    assert np.abs(compose_planar(one, inverse_planar(one))).max() < 32 * EPS
    assert np.array_equal(compose_planar([0, 0, 7], [0, 0, 8]), [0, 0, 15])


@pytest.mark.source("RR 3.2")
def test_the_exponential_is_that_of_the_matrix_and_of_space():
    """Of small twists SciPy's too; its error grows with the twist, to 5e-14 here."""
    ours = exp_planar(TWISTS)
    assert np.array_equal(ours[:, 2], TWISTS[:, 2])
    exact = np.array([oracles.expm(hat(S)) for S in TWISTS])
    assert np.abs(matrix_from_planar(ours) - exact).max() < 8 * EPS
    small = np.array([expm(hat(S / 8)) for S in TWISTS])
    assert np.abs(matrix_from_planar(exp_planar(TWISTS / 8)) - small).max() < 1e-14
    in_space = np.insert(TWISTS[:, [2, 0, 1]], [0, 0, 3], 0, axis=1)
    A = rb.exp_se3(in_space)[:, [0, 1, 3]][:, :, [0, 1, 3]]
    assert np.abs(matrix_from_planar(ours) - A).max() < 1e-14


def test_the_logarithm_undoes_the_exponential():
    short = TWISTS[np.abs(TWISTS[:, 2]) <= np.pi]
    assert np.abs(log_planar(exp_planar(short)) - short).max() < 32 * EPS
    assert np.array_equal(log_planar([1, 2, 0]), [1, 2, 0])
    assert np.array_equal(log_planar(short)[:, 2], short[:, 2])  # ±π are among them


def test_the_logarithm_forgets_any_number_of_turns():
    for theta in [*(k * np.pi for k in range(-41, 42)), 1e6, -2.3e6, 1e15]:
        twist = log_planar([1, 2, theta])
        assert abs(twist[2]) <= np.pi
        turned = matrix_from_planar(exp_planar(twist))
        assert np.abs(turned - matrix_from_planar([1, 2, theta])).max() < 16 * EPS


@pytest.mark.source("RR (14)", "RR (15)", "RR (16)")
@pytest.mark.parametrize("steps", [1, 10, 37])
def test_poses_are_blended_evenly_with_exact_ends(steps):
    path = interpolate_planar(POSES[0], POSES[1], steps)
    even = POSES[0] + np.linspace(0, 1, steps + 1)[:, None] * (POSES[1] - POSES[0])
    assert np.abs(path - even).max() < 16 * EPS
    start, goal = POSES[:100], 1e16 * POSES[100:]
    for one, other in ((start, goal), (goal, start)):
        assert np.array_equal(interpolate_planar(one, other, steps)[[0, -1]], [one, other])
    turned = interpolate_planar(POSES, np.add(POSES, [0, 0, 5]), steps)
    assert (turned[..., :2] == POSES[:, :2]).all()  # exactly equal places stay so


@pytest.mark.source("RR (16)")
def test_the_short_way_turns_by_half_a_turn_at_most():
    for k in (-41, -5, -3, 3, 5, 17, 41):
        path = interpolate_planar([0, 0, 0.25], [0, 0, 0.25 + k * np.pi], shortest=True)
        assert abs(abs(path[-1, 2] - 0.25) - np.pi) < 8 * (1 + abs(k)) * EPS
    for turns in (-3, 0, 2):
        for delta in (0.3, -3.1, 3.1):
            end = 1 + delta + 2 * np.pi * turns
            path = interpolate_planar([0, 0, 1], [5, 6, end], shortest=True)
            assert np.abs(path[-1] - [5, 6, 1 + delta]).max() < 32 * EPS
            assert np.array_equal(path[0], [0, 0, 1])


def test_the_short_way_leaves_a_short_way_alone_in_stacks_too():
    for goal in (1, -1, np.pi, -np.pi):
        plain = interpolate_planar([0, 0, 0], [1, 2, goal])
        assert np.array_equal(plain, interpolate_planar([0, 0, 0], [1, 2, goal], shortest=True))
    start, goal = POSES[:, None] * [1, 1, 0.3], POSES * [1, 1, 0.3]
    path = interpolate_planar(start, goal, 1, shortest=True)
    assert np.array_equal(path[1], np.broadcast_to(goal, (200, 200, 3)))
    with pytest.raises(ValueError, match=r"broadcast: start \(2,\), goal \(3,\)"):
        interpolate_planar(np.zeros((2, 3)), np.zeros((3, 3)), shortest=True)


@pytest.mark.source("RR 3.2", "RR (17)", "RR (18)", "RR (19)")
def test_a_command_adds_in_the_world_and_is_a_constant_twist_in_the_body():
    added, A = [POSES[0]], [matrix_from_planar(POSES[0])]
    for velocity, duration in PLAN:
        added.append(added[-1] + np.array(velocity) * duration)
        A.append(A[-1] @ expm(duration * hat(velocity)))
    assert np.array_equal(propagate_planar(POSES[0], PLAN), added)
    path = propagate_planar(POSES[0], PLAN, frame="body")
    assert np.abs(matrix_from_planar(path) - A).max() < 1e-14
    assert np.array_equal(path[[0, 2]], [POSES[0], path[1]])
    assert path[:, 2] == pytest.approx(np.array(added)[:, 2])


def test_in_the_body_many_small_steps_come_to_the_same():
    velocity, duration, count = np.array([1.2, -0.4, 2.5]), 3.0, 100_000
    theta = 0.3 + velocity[2] * duration * np.arange(count) / count
    c, s = np.cos(theta), np.sin(theta)
    small = np.array([c * velocity[0] - s * velocity[1], s * velocity[0] + c * velocity[1]])
    place = np.array([1, 2]) + small.sum(axis=1) * duration / count
    path = propagate_planar([1, 2, 0.3], [(velocity, duration)], frame="body")
    bound = np.hypot(*velocity[:2]) * velocity[2] * duration**2 / (2 * count)
    assert np.linalg.norm(path[-1, :2] - place) < bound < 1.5e-4
    pieces = [(velocity, duration / 1000)] * 1000
    fine = propagate_planar([1, 2, 0.3], pieces, frame="body")
    assert np.abs(fine[-1] - path[-1]).max() < 1e-12


@pytest.mark.source("RR 3.2")
@both_frames
def test_a_plan_undone_leads_back_and_no_plan_nowhere(frame):
    there = propagate_planar(POSES[0], PLAN, frame=frame)
    undone = [(-np.array(velocity), duration) for velocity, duration in reversed(PLAN)]
    back = propagate_planar(there[-1], undone, frame=frame)
    assert np.abs(back - there[::-1]).max() < 1e-14
    assert propagate_planar([1, 2, 3], [], frame=frame).tolist() == [[1, 2, 3]]


@both_frames
def test_stacks_of_bodies_obey_one_plan_and_arguments_are_not_changed(frame):
    start, plan = POSES.reshape(4, 50, 3).copy(), [(np.array(v, float), d) for v, d in PLAN]
    path = propagate_planar(start, plan, frame=frame)
    assert path.shape == (len(PLAN) + 1, 4, 50, 3)
    one = propagate_planar(POSES[57], PLAN, frame=frame)
    assert np.abs(path[:, 1, 7] - one).max() < 16 * EPS
    path[:] = 9
    assert np.array_equal(start.reshape(-1, 3), POSES)
    assert all(np.array_equal(v, given) for (v, _), (given, _) in zip(plan, PLAN, strict=True))


@both_frames
@pytest.mark.parametrize(
    ("plan", "message"),
    [
        ([([1, 0, 0], 1), ([1, 0, 0], -2)], "plan[1] duration is -2.0, a duration from 0 up"),
        ([([[1, 0, 0]], 1)], "plan[0] velocity: shape (3) wanted, got (1, 3)"),
        ([([1e300, 0, 0], 1e300)], "plan[0] leads beyond all numbers"),
        ([([0, 1e308, 0], 1)] * 2, "plan[1] leads beyond all numbers"),
        ([[1, 0, 0]], "plan[0]: (velocity, duration) wanted, got [1, 0, 0]"),
        (7, "plan: a list of (velocity, duration) wanted, got 7"),
        ([("abc", 1)], "plan[0] velocity: real numbers wanted"),
    ],
)
def test_malformed_plans_are_named(frame, plan, message):
    with pytest.raises(ValueError, match=f"^{re.escape(message)}"):
        propagate_planar([0, 0, 0], plan, frame=frame)


def test_bad_starts_frames_and_steps_are_named():
    with pytest.raises(ValueError, match=r"^start\[0\] is nan"):
        propagate_planar([np.nan, 0, 0], PLAN)
    with pytest.raises(ValueError, match=r"^frame: 'world' or 'body' wanted, got 'World'"):
        propagate_planar([0, 0, 0], PLAN, frame="World")
    for steps in (0, -3, 2.5, True, "10"):
        with pytest.raises(ValueError, match=r"^steps: an integer from 1 up wanted, got"):
            interpolate_planar([0, 0, 0], [1, 1, 1], steps)
