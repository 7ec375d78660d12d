"""Compare planar poses, twists and paths with SciPy's expm, small steps and complex numbers."""

import re

import numpy as np
import oracles
import pytest
from scipy.linalg import expm

import rbcourse as rb
from rbcourse import planar

EPS = np.finfo(float).eps
RNG = np.random.default_rng(6)
POSES = RNG.uniform(-4, 4, (200, 3))
TURNS = [0, 1e-300, 1e-12, -1e-8, np.pi, -np.pi, 2 * np.pi]
TWISTS = np.concatenate([RNG.uniform(-4, 4, (60, 3)), [[3, -2, w] for w in TURNS]])
PLAN = [([1, 0, 0], 3), ([0.3, -1, 0.7], 0), ([0, 0, -2], 1.5), ([-0.5, 2, 4], 0.25)]
ORIGIN = np.zeros(3)
both_frames = pytest.mark.parametrize("frame", ["world", "body"])


def hat(S):
    vx, vy, w = S
    return np.array([[0, -w, vx], [w, 0, vy], [0, 0, 0]])


@pytest.mark.source("RR 3.1", "RR 3.2")
def test_matrices_carry_points_into_the_world():
    A, (x, y, theta) = planar.matrix_from_planar(POSES), POSES.T
    for point in (1, 1j, 2 - 3j):
        moved = x + 1j * y + np.exp(1j * theta) * point
        want = np.transpose([moved.real, moved.imag, np.ones(len(A))])
        assert np.abs(A @ [point.real, point.imag, 1] - want).max() < 16 * EPS
    assert rb.is_se(A, 1e-15).all()
    back = planar.planar_from_matrix(A)
    assert np.array_equal(back[:, :2], POSES[:, :2])
    turns = (back[:, 2] - theta) / (2 * np.pi)
    assert np.abs(turns - turns.round()).max() < 4 * EPS
    assert np.abs(back[:, 2]).max() <= np.pi
    for angle in (0, 1e-300, 1e-9, np.pi / 2, np.pi, -np.pi, -3):
        kept = planar.planar_from_matrix(planar.matrix_from_planar([1, 2, angle]))
        assert abs(abs(kept[2]) - abs(angle)) <= 4 * EPS * abs(angle)
    product, inverse = planar.compose_planar(POSES, POSES[::-1]), planar.inverse_planar(POSES)
    for pose, want in ((product, A @ A[::-1]), (inverse, np.linalg.inv(A))):
        assert np.abs(planar.matrix_from_planar(pose) - want).max() < 32 * EPS
    assert np.abs(planar.compose_planar(POSES, inverse)).max() < 32 * EPS
    assert np.array_equal(product[:, 2], theta + theta[::-1])  # full turns are kept


def test_the_nearest_rotation_replaces_a_matrix_that_is_not_a_rotation():
    blocks = RNG.normal(size=(50, 2, 2))
    poses = planar.planar_from_matrix(np.pad(blocks, ((0, 0), (0, 1), (0, 1))))
    nearest = planar.matrix_from_planar(poses)[:, :2, :2]
    assert np.abs(nearest - rb.project_so(blocks)).max() < 1e-13
    mirrored = np.array([np.diag([1.0, -1, 1]), np.eye(3)[[1, 0, 2]], np.zeros((3, 3))])
    assert not planar.planar_from_matrix([mirrored, -mirrored])[..., 2].any()
    huge = np.array([[1e308, -1.7e308, 0], [1.7e308, 1e308, 0], [0, 0, 1]])
    assert planar.planar_from_matrix(huge)[2] == pytest.approx(np.arctan2(1.7, 1))


@pytest.mark.source("RR 3.2")
def test_the_exponential_agrees_with_its_series_and_with_exp_se3():
    ours = planar.exp_planar(TWISTS)
    assert np.array_equal(ours[:, 2], TWISTS[:, 2])
    A = planar.matrix_from_planar(ours)
    assert np.abs(A - [oracles.expm(hat(S)) for S in TWISTS]).max() < 8 * EPS
    in_space = rb.exp_se3(np.insert(TWISTS[:, [2, 0, 1]], [0, 0, 3], 0, axis=1))
    assert np.abs(A - in_space[:, [0, 1, 3]][:, :, [0, 1, 3]]).max() < 1e-14


def test_the_logarithm_undoes_the_exponential_except_for_full_turns():
    short = TWISTS[np.abs(TWISTS[:, 2]) <= np.pi]
    assert np.abs(planar.log_planar(planar.exp_planar(short)) - short).max() < 32 * EPS
    assert np.array_equal(planar.log_planar([1, 2, 0]), [1, 2, 0])
    assert np.array_equal(planar.log_planar(short)[:, 2], short[:, 2])  # these angles include ±π
    many = np.array([[1, 2, w] for w in (*(np.arange(-41, 42) * np.pi), 1e6, -2.3e6, 1e15)])
    twists = planar.log_planar(many)
    assert np.abs(twists[:, 2]).max() <= np.pi
    turned = planar.matrix_from_planar(planar.exp_planar(twists))
    assert np.abs(turned - planar.matrix_from_planar(many)).max() < 16 * EPS


@pytest.mark.source("RR (14)", "RR (15)", "RR (16)")
@pytest.mark.parametrize("steps", [1, 37])
def test_blended_poses_have_exact_ends(steps):
    path = planar.interpolate_planar(POSES[0], POSES[1], steps)
    even = POSES[0] + np.linspace(0, 1, steps + 1)[:, None] * (POSES[1] - POSES[0])
    assert np.abs(path - even).max() < 16 * EPS
    start, goal = POSES[:100], 1e16 * POSES[100:]
    for ends in ((start, goal), (goal, start)):
        assert np.array_equal(planar.interpolate_planar(*ends, steps)[[0, -1]], ends)
    turned = planar.interpolate_planar(POSES, np.add(POSES, [0, 0, 5]), steps)
    assert (turned[..., :2] == POSES[:, :2]).all()  # exactly equal places stay equal


@pytest.mark.source("RR (16)")
def test_the_short_way_turns_by_at_most_half_a_turn():
    def short(start, goal, steps=1):
        return planar.interpolate_planar(start, goal, steps, shortest=True)

    for k in (-41, -5, -3, 3, 5, 17, 41):
        turn = short([0, 0, 0.25], [0, 0, 0.25 + k * np.pi])[-1, 2] - 0.25
        assert abs(abs(turn) - np.pi) < 8 * (1 + abs(k)) * EPS
    for delta in (0.3, -3.1, 3.1):
        ends = [[5, 6, 1 + delta + 2 * np.pi * turns] for turns in (-3, 0, 2)]
        path = short([0, 0, 1], ends)
        assert np.abs(path - [[[0, 0, 1]], [[5, 6, 1 + delta]]]).max() < 32 * EPS
    # these turns are already the short way
    start, goal = POSES[:, None] * [1, 1, 0.3], POSES * [1, 1, 0.3]
    assert np.array_equal(short(start, goal)[1], np.broadcast_to(goal, (200, 200, 3)))
    for angle in (1, -1, np.pi, -np.pi):
        assert short([0, 0, 0], [1, 2, angle])[-1, 2] == angle


@pytest.mark.source("RR 3.2", "RR (17)", "RR (18)", "RR (19)")
def test_a_command_in_the_body_frame_is_a_constant_twist():
    added, A = [POSES[0]], [planar.matrix_from_planar(POSES[0])]
    for velocity, duration in PLAN:
        added.append(added[-1] + np.array(velocity) * duration)
        A.append(A[-1] @ expm(duration * hat(velocity)))
    assert np.array_equal(planar.propagate_planar(POSES[0], PLAN), added)
    path = planar.propagate_planar(POSES[0], PLAN, frame="body")
    assert np.abs(planar.matrix_from_planar(path) - A).max() < 1e-14
    assert np.array_equal(path[[0, 2]], [POSES[0], path[1]])
    assert path[:, 2] == pytest.approx(np.array(added)[:, 2])


@pytest.mark.source("RR 3.2")
@both_frames
def test_a_plan_moves_all_poses_of_a_stack(frame):
    plan = [(np.array(v, float), d) for v, d in PLAN]
    there = planar.propagate_planar(POSES.reshape(4, 50, 3), plan, frame=frame)
    one = planar.propagate_planar(POSES[57], PLAN, frame=frame)
    assert np.abs(there[:, 1, 7] - one).max() < 16 * EPS
    assert planar.propagate_planar([1, 2, 3], [], frame=frame).tolist() == [[1, 2, 3]]
    assert all(np.array_equal(v, given) for (v, _), (given, _) in zip(plan, PLAN, strict=True))


@both_frames
@pytest.mark.parametrize(
    ("start", "plan", "message"),
    [
        ([np.nan, 0, 0], PLAN, "start[0] is nan"),
        (ORIGIN, [*PLAN[:1], ([1, 0, 0], -2)], "plan[1] duration is -2.0, a duration from 0 up"),
        (ORIGIN, [([[1, 0, 0]], 1)], "plan[0] velocity: shape (3) is wanted, got (1, 3)"),
        (ORIGIN, [([1e300, 0, 0], 1e300)], "plan[0] leads beyond the floating-point numbers"),
        (ORIGIN, [[1, 0, 0]], "plan[0]: (velocity, duration) is wanted, got [1, 0, 0]"),
        (ORIGIN, 7, "plan: a list of (velocity, duration) is wanted, got 7"),
        (ORIGIN, [("abc", 1)], "plan[0] velocity: real numbers are wanted"),
    ],
)
def test_bad_starts_and_malformed_plans_are_refused(frame, start, plan, message):
    with pytest.raises(ValueError, match=f"^{re.escape(message)}"):
        planar.propagate_planar(start, plan, frame=frame)


def test_unknown_frames_and_bad_steps_are_refused():
    with pytest.raises(ValueError, match=r"^frame: 'world' or 'body' is wanted, got 'World'"):
        planar.propagate_planar([0, 0, 0], PLAN, frame="World")
    for steps in (0, -3, 2.5, True, "10"):
        with pytest.raises(ValueError, match=r"^steps: an integer from 1 up is wanted, got"):
            planar.interpolate_planar([0, 0, 0], [1, 1, 1], steps)
