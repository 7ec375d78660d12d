import awkward
import numpy as np
import oracles
import pytest
from scipy.spatial.transform import Rotation

import rbcourse as rb
from rbcourse.quaternion import canonical_quaternion, slerp_long

EPS = np.finfo(float).eps
RNG = np.random.default_rng(2002)
RANDOM = (lambda q: q / np.linalg.norm(q, axis=-1, keepdims=True))(RNG.normal(size=(200, 4)))
ONE = np.array([1.0, 0, 0, 0])


@pytest.mark.source("RR 2.2")
def test_multiplication_follows_hamiltons_rules():
    one, i, j, k = np.eye(4)
    assert np.array_equal(rb.quaternion.quaternion_multiply([i, j, k], [i, j, k]), [-one] * 3)
    for a, b, c in [(i, j, k), (j, k, i), (k, i, j)]:
        assert np.array_equal(rb.quaternion.quaternion_multiply([a, b], [b, a]), [c, -c])
    p, q = RNG.normal(size=(2, 50, 4))
    want = oracles.quaternion_product(p.T, q.T).T
    size = np.linalg.norm(want, axis=-1, keepdims=True)
    assert np.all(np.abs(rb.quaternion.quaternion_multiply(p, q) - want) < 4 * EPS * size)
    points = RNG.normal(size=(200, 3))
    want = Rotation.from_quat(RANDOM, scalar_first=True).apply(points)
    off = np.abs(rb.quaternion.rotate_by_quaternion(RANDOM, points) - want).max()
    assert off < 8 * EPS * np.linalg.norm(points, axis=1).max()


@pytest.mark.source("RR 1.5", "RR (6)", "RR Fig. 2")
def test_the_nearest_unit_quaternion_has_the_same_direction():
    q = RANDOM * 10.0 ** RNG.uniform(-300, 300, size=(200, 1))
    nearest = rb.quaternion.project_quaternion(q)
    assert np.abs(nearest - RANDOM).max() < 4 * EPS
    assert np.abs(np.linalg.norm(nearest, axis=-1) - 1).max() < 2 * EPS
    for size in (10, np.finfo(float).max):
        assert np.array_equal(rb.quaternion.project_quaternion([size] * 4), [0.5] * 4)
    assert np.array_equal(rb.quaternion.project_quaternion([5e-324, 0, 0, 0]), [1, 0, 0, 0])
    for zero, name in ((np.zeros(4), "q"), ([[[1, 0, 0, 0]], [[0, 0, 0, 0]]], r"q\[1, 0\]")):
        with pytest.raises(ValueError, match=f"^{name} is zero"):
            rb.quaternion.project_quaternion(zero)


def test_q_and_minus_q_have_one_canonical_form():
    for q in (RANDOM, awkward.quaternions(), np.insert(awkward.half_turns()[1], 0, 0, axis=1)):
        one = canonical_quaternion(q)
        assert np.array_equal(canonical_quaternion(-q), one)
        assert np.array_equal(canonical_quaternion(one), one)
        assert np.abs(np.abs(one) - np.abs(q)).max() < 4 * EPS
        assert np.all(one[:, 0] >= 0)
    for off, first in [(0, True), (1e-9, True), (-1e-9, True), (1e-7, False)]:
        # if two components are largest, the first one decides
        q = rb.quaternion.project_quaternion([0, -1, 1 + off, 0.3])
        assert (canonical_quaternion(q)[1] > 0) is np.bool_(first)
    for off in (1e-9, 1e-12, 1e-14):
        q = np.array([-off, 0.8, 0.6, 0])
        assert np.array_equal(canonical_quaternion(q), -q)
    assert np.array_equal(canonical_quaternion([-2e-16, 0.8, 0.6, 0]), [0, 0.8, 0.6, 0])


@pytest.mark.source("BK 6.1", "errata 32")
def test_two_opposite_points_of_the_sphere_are_one_rotation():
    """The paper places S³ in RP³. S³ is in R⁴, and RP³ has one point for each pair q, −q."""
    q = rb.sample_quaternion(50, rng=32)
    assert np.abs(np.linalg.norm(q, axis=1) - 1).max() < 4 * EPS
    assert np.abs(q - -q).max(axis=1).min() > 0.9  # two points of S³
    R = rb.matrix_from_quaternion([q, -q])
    assert np.array_equal(R[0], R[1])
    projectors = q[:, :, None] * q[:, None]  # a point of RP³ is a line through 0, q qᵀ
    apart = np.abs(projectors[:, None] - projectors).max(axis=(2, 3)) > 1e-3
    turned = rb.angle_between(R[0][:, None], R[0]) > 1e-3
    assert np.array_equal(apart, turned)


@pytest.mark.source("BK Remark 7")
def test_slerps_agree_with_mpmath_and_the_paper():
    """The long way ends at −q1; its arc in R⁴ is longer than a quarter circle."""
    for start in (RANDOM[0], ONE):
        for turn in awkward.quaternions()[::7]:
            goal = rb.quaternion.quaternion_multiply(start, turn)
            for t in (0.3, 1.0):
                want = oracles.arc(start, goal, t)
                assert np.abs(rb.slerp(start, [goal, -goal], t) - want).max() < 8 * EPS
    q0, q1 = RANDOM[:30], RANDOM[30:60]
    q1 = q1 * np.sign(np.vecdot(q0, q1))[:, None]
    for t in (0.0, 0.2, 0.5, 1.0):
        for slerp, end in ((rb.slerp, q1), (slerp_long, -q1)):
            want = np.array([oracles.arc(p, q, t) for p, q in zip(q0, end, strict=True)])
            assert np.abs(slerp(q0, np.array([q1, -q1]), t) - want).max() < 20 * EPS
        a = np.arccos(np.vecdot(q0, q1))[:, None]
        printed = (np.sin((1 - t) * a) * q0 + np.sin(t * a) * q1) / np.sin(a)
        assert np.abs(rb.slerp(q0, q1, t) - printed).max() < 40 * EPS
    q0 = q0.reshape(5, 6, 4)
    for slerp in (rb.slerp, slerp_long):
        stack = slerp(q0, q1[:6], [[0.3], [0.4]])
        assert np.abs(stack[1, 0, 4, 2] - slerp(q0[4, 2], q1[2], 0.4)).max() < 4 * EPS
        assert stack.shape == (2, 1, 5, 6, 4)
        for bad, message in (([1, 0, 0], r"^q1: shape \(\.\.\., 4\)"), (q1[:5], r"q1 \(5,\)")):
            with pytest.raises(ValueError, match=message):
                slerp(q0, bad, 0)


def test_slerps_are_accurate_near_their_singular_sets():
    """The singular sets are equal rotations and half-turns. If the rotations differ by a half-turn,
    exact or rounded, the sign of q1 selects the arc."""
    near = rb.slerp(ONE, [1, 1e-12, 0, 0], 0.25)
    assert abs(near[1] / 0.25e-12 - 1) < 4 * EPS
    for goal in (ONE, -ONE, [1, 1e-17, 0, 0]):
        with pytest.raises(ValueError, match=r"^q1\[1\] is the same rotation as q0"):
            slerp_long(ONE, [[0, 1, 0, 0], goal], 0.5)
    for angle in (1e-3, 1e-6, 1e-9):
        near = np.array([np.cos(angle), 0, np.sin(angle), 0])
        quarter = slerp_long(ONE, near, np.pi / 2 / (np.pi - angle))  # a quarter of the circle
        assert np.abs(quarter - [0, 0, -1, 0]).max() < 4 * EPS / angle
    near = [np.cos(1e-14), np.sin(1e-14), 0, 0]
    assert np.abs(slerp_long(ONE, near, 0.5) - [0, -1, 0, 0]).max() < 0.1
    for sign in (-1, 1):
        half_turn, goal = np.array([[0, 0, sign, 0], [sign * 1e-14, 1, 0, 0]])
        assert np.abs(rb.slerp(ONE, half_turn, 0.5) - (ONE + half_turn) / 2**0.5).max() < 2 * EPS
        assert np.abs(slerp_long(ONE, half_turn, 1) + half_turn).max() < 4 * EPS
        # the arc is nearly a half-turn
        assert np.abs(rb.slerp(ONE, goal, 1) - sign * goal).max() < 4 * EPS
        assert np.abs(slerp_long(ONE, goal, 1) + sign * goal).max() < 4 * EPS
    rounded = [-2e-16, 1, 0, 0]
    assert rb.slerp(ONE, rounded, 1)[1] > 0 > slerp_long(ONE, rounded, 1)[1]


def test_continuous_quaternions_do_not_jump():
    t, w = np.linspace(0, 4, 401), np.array([[0.3, -1, 2], [-1, 0.3, 2]])
    # w, the real part, is 0 three times
    q = rb.quaternion_from_matrix(rb.exp_so3(np.multiply.outer(t, w)))
    before, smooth = q.copy(), rb.quaternion.continuous_quaternions(q)
    assert np.array_equal(q, before)
    assert np.abs(np.diff(q, axis=0)).max() > 1
    assert np.abs(np.diff(smooth, axis=0)).max() < np.linalg.norm(w[0]) * t[1] / 2
    assert np.array_equal(smooth[0], q[0])
    assert np.array_equal(np.abs(smooth), np.abs(q))
    assert np.array_equal(smooth[:, 1], rb.quaternion.continuous_quaternions(q[:, 1]))
    for few in (q[0, 0], -q[:1], np.empty((0, 4))):
        assert np.array_equal(rb.quaternion.continuous_quaternions(few), few)
