import awkward
import numpy as np
import oracles
import pytest
from scipy.spatial.transform import Rotation

import rbcourse as rb
from rbcourse.quaternion import canonical_quaternion, quaternion_conjugate, slerp_long

EPS = np.finfo(float).eps
RNG = np.random.default_rng(2002)
RANDOM = (lambda q: q / np.linalg.norm(q, axis=-1, keepdims=True))(RNG.normal(size=(200, 4)))
ONE = np.array([1.0, 0, 0, 0])


@pytest.mark.source("RR 1.2", "RR (3)")
def test_a_unit_quaternion_has_norm_one():
    q = np.array([[1, 0, 0, 0], [2, 0, 0, 0], [0.5, 0.5, 0.5, -0.5], [1, 1e-4, 0, 0]])
    assert np.array_equal(rb.is_unit_quaternion(q), [True, False, True, False])
    loosely = rb.is_unit_quaternion(np.outer([1.009, 1.011], ONE), atol=0.01)
    assert np.array_equal(loosely, [True, False])
    assert not rb.is_unit_quaternion([[np.nan, 0, 0, 1], [np.inf, 0, 0, 0], [1e200] * 4]).any()
    for atol in (-1e-9, np.nan, [1e-9, 1e-9]):
        with pytest.raises(ValueError, match="atol: a number from 0 up wanted"):
            rb.is_unit_quaternion([1, 0, 0, 0], atol)


@pytest.mark.source("RR 2.2")
def test_multiplication_is_bilinear_with_hamiltons_rules():
    one, i, j, k = np.eye(4)
    assert np.array_equal(rb.quaternion_multiply([i, j, k], [i, j, k]), [-one] * 3)
    for a, b, c in [(i, j, k), (j, k, i), (k, i, j)]:
        assert np.array_equal(rb.quaternion_multiply([a, b], [b, a]), [c, -c])
    p, q = RNG.normal(size=(2, 50, 4))
    want = oracles.quaternion_product(p.T, q.T).T
    size = np.linalg.norm(want, axis=-1, keepdims=True)
    assert np.all(np.abs(rb.quaternion_multiply(p, q) - want) < 4 * EPS * size)
    identity = rb.quaternion_multiply(RANDOM, quaternion_conjugate(RANDOM))
    assert np.abs(identity - one).max() < 4 * EPS


@pytest.mark.source("RR 2.2")
def test_rotation_of_points_agrees_with_scipy_and_is_that_of_products():
    p, q, points = RANDOM[:100], RANDOM[100:], RNG.normal(size=(100, 3))
    turned, size = rb.rotate_by_quaternion(q, points), np.linalg.norm(points, axis=1).max()
    want = Rotation.from_quat(q, scalar_first=True).apply(points)
    assert np.abs(turned - want).max() < 8 * EPS * size
    once = rb.rotate_by_quaternion(rb.quaternion_multiply(p, q), points)
    assert np.allclose(once, rb.rotate_by_quaternion(p, turned), atol=1e-14)


@pytest.mark.parametrize("function", [rb.slerp, slerp_long])
def test_slerps_take_stacks_and_name_bad_arguments(function):
    q, p = RANDOM[:6].reshape(2, 3, 4), RANDOM[6:9]
    for i in np.ndindex(2, 3):
        single = function(q[i], p[i[1]], 0.3)
        assert np.abs(function(q, p, [0.3, 0.4])[0][i] - single).max() < 4 * EPS
    assert function(q, p, np.zeros((5, 1))).shape == (5, 1, 2, 3, 4)
    for bad, message in (([1, 0, 0], r"^q1: shape \(\.\.\., 4\)"), (RANDOM[:5], r"q1 \(5,\)")):
        with pytest.raises(ValueError, match=message):
            function(q, bad, 0)


@pytest.mark.source("BK Remark 7")
def test_slerp_is_the_constant_speed_arc_and_the_formula_of_the_paper():
    """q0 (q0⁻¹ q1)ᵗ, by mpmath's logarithm of the rotation between."""
    for q0, q1 in zip(RANDOM[:20], RANDOM[20:40], strict=True):
        R0, R1 = rb.matrix_from_quaternion(np.array([q0, q1]))
        turn = oracles.log_so3(R0.T @ R1)
        for t in (0.0, 0.2, 0.5, 1.0):
            got = rb.matrix_from_quaternion(rb.slerp(q0, q1, t))
            assert np.abs(got - R0 @ oracles.exp_so3(t * turn)).max() < 20 * EPS
        q1 = q1 * np.sign(q0 @ q1)
        a, u = np.arccos(q0 @ q1), np.linspace(0, 1, 11)[:, None]
        printed = (np.sin((1 - u) * a) * q0 + np.sin(u * a) * q1) / np.sin(a)
        assert np.abs(rb.slerp(q0, q1, u[:, 0]) - printed).max() < 40 * EPS


def test_slerp_near_its_singular_sets():
    assert np.array_equal(rb.slerp(ONE, ONE, [0, 0.3, 1]), [ONE] * 3)
    assert np.array_equal(rb.slerp(ONE, -ONE, 0.5), ONE)
    near = rb.slerp(ONE, [1, 1e-12, 0, 0], 0.25)
    assert abs(near[1] / 0.25e-12 - 1) < 4 * EPS
    for angle in (np.pi / 2 + 1e-9, np.pi / 2 + 0.05, np.pi - 1e-9):  # −q is the nearer goal
        there = np.array([np.cos(angle), np.sin(angle), 0, 0])
        assert np.abs(rb.slerp(ONE, there, 1) + there).max() < 4 * EPS
    for goal in np.array([[0, 0, 1, 0], [0, 0, -1, 0]]):
        assert np.abs(rb.slerp(ONE, goal, 0.5) - (ONE + goal) / np.sqrt(2)).max() < 2 * EPS


@pytest.mark.source("RR 1.5", "RR (6)", "RR Fig. 2")
def test_the_nearest_unit_quaternion_has_the_same_direction():
    q = RANDOM * 10.0 ** RNG.uniform(-300, 300, size=(200, 1))
    nearest = rb.project_quaternion(q)
    assert np.abs(nearest - RANDOM).max() < 4 * EPS
    assert np.abs(np.linalg.norm(nearest, axis=-1) - 1).max() < 2 * EPS
    for size in (10, np.finfo(float).max):
        assert np.array_equal(rb.project_quaternion([size] * 4), [0.5] * 4)
    assert np.array_equal(rb.project_quaternion([5e-324, 0, 0, 0]), [1, 0, 0, 0])
    for zero, name in ((np.zeros(4), "q"), ([[[1, 0, 0, 0]], [[0, 0, 0, 0]]], r"q\[1, 0\]")):
        with pytest.raises(ValueError, match=f"^{name} is zero"):
            rb.project_quaternion(zero)


def test_one_of_q_and_minus_q_is_canonical():
    for q in (RANDOM, awkward.quaternions(), np.insert(awkward.half_turns()[1], 0, 0, axis=1)):
        one = canonical_quaternion(q)
        assert np.array_equal(canonical_quaternion(-q), one)
        assert np.array_equal(canonical_quaternion(one), one)
        assert np.abs(np.abs(one) - np.abs(q)).max() < 4 * EPS
        assert np.all(one[:, 0] >= 0)
    for off, first in [(0, True), (1e-9, True), (-1e-9, True), (1e-7, False)]:
        q = rb.project_quaternion([0, -1, 1 + off, 0.3])  # of two largest the first decides
        assert (canonical_quaternion(q)[1] > 0) is np.bool_(first)


def test_only_rounding_counts_as_a_half_turn():
    for off in (1e-9, 1e-12, 1e-14):
        q = np.array([-off, 0.8, 0.6, 0])
        assert np.array_equal(canonical_quaternion(q), -q)
    assert np.array_equal(canonical_quaternion([-2e-16, 0.8, 0.6, 0]), [0, 0.8, 0.6, 0])
    for sign in (-1, 1):  # nearly as far both ways
        goal = np.array([sign * 1e-14, 1, 0, 0])
        assert np.abs(rb.slerp(ONE, goal, 1) - sign * goal).max() < 4 * EPS
        assert np.abs(slerp_long(ONE, goal, 1) + sign * goal).max() < 4 * EPS
    rounded = [-2e-16, 1, 0, 0]
    assert rb.slerp(ONE, rounded, 1)[1] > 0 > slerp_long(ONE, rounded, 1)[1]
    near = [np.cos(1e-14), np.sin(1e-14), 0, 0]
    assert np.abs(slerp_long(ONE, near, 0.5) - [0, -1, 0, 0]).max() < 0.1


@pytest.mark.source("BK Remark 7")
def test_slerp_agrees_with_mpmath_on_awkward_pairs():
    for start in (RANDOM[0], ONE):
        for turn in awkward.quaternions()[::3]:
            goal = rb.quaternion_multiply(start, turn)
            for t in (0.3, 1.0):
                want = oracles.arc(start, goal, t)
                assert np.abs(rb.slerp(start, [goal, -goal], t) - want).max() < 8 * EPS


@pytest.mark.source("BK Remark 7")
def test_the_long_way_is_the_rest_of_the_great_circle():
    """From q0 to −q1: the arc in R⁴ is longer than a quarter circle."""
    q0, q1 = RANDOM[:50], RANDOM[50:100]
    q1 = q1 * np.sign(np.sum(q0 * q1, axis=-1, keepdims=True))
    for t in (0.0, 0.2, 0.5, 1.0):
        exact = np.array([oracles.arc(p, -q, t) for p, q in zip(q0, q1, strict=True)])
        for goal in (q1, -q1):
            assert np.abs(slerp_long(q0, goal, t) - exact).max() < 20 * EPS
    size = np.linalg.norm(np.diff(slerp_long(q0, q1, np.linspace(0, 1, 9)), axis=0), axis=-1)
    assert np.abs(size - size[0]).max() < 20 * EPS  # at constant speed


def test_the_long_way_near_its_singular_sets():
    for goal in (ONE, -ONE, [1, 1e-17, 0, 0]):
        with pytest.raises(ValueError, match=r"^q1\[1\] is the same rotation as q0"):
            slerp_long(ONE, [[0, 1, 0, 0], goal], 0.5)
    for angle in (1e-3, 1e-6, 1e-9):
        near = np.array([np.cos(angle), 0, np.sin(angle), 0])
        quarter = slerp_long(ONE, near, np.pi / 2 / (np.pi - angle))  # of the circle
        assert np.abs(quarter - [0, 0, -1, 0]).max() < 4 * EPS / angle
    for half_turn in np.array([[0, 0, 0, 1], [0, 0, 0, -1]]):  # both ways are as long, and differ
        assert np.abs(slerp_long(ONE, half_turn, 1) + half_turn).max() < 4 * EPS


def test_continuous_quaternions_are_the_same_rotations_without_jumps_for_each_of_a_stack():
    t = np.linspace(0, 4, 401)
    q = rb.quaternion_from_matrix(rb.exp_so3(t[:, None] * [[0.3, -1, 2]]))  # w is 0 three times
    smooth = rb.continuous_quaternions(q)
    assert np.abs(np.diff(q, axis=0)).max() > 1
    assert np.abs(np.diff(smooth, axis=0)).max() < np.linalg.norm([0.3, -1, 2]) * t[1] / 2
    assert np.array_equal(smooth[0], q[0])
    assert np.array_equal(np.abs(smooth), np.abs(q))
    q = rb.sample_quaternion((50, 3), rng=8)
    before, signs = q.copy(), rb.continuous_quaternions(q)
    assert np.array_equal(q, before)
    assert np.all(np.sum(signs[1:] * signs[:-1], axis=-1) >= 0)
    assert np.array_equal(signs[:, 2], rb.continuous_quaternions(q[:, 2]))
    for few in (q[0, 0], -q[:1], np.empty((0, 4))):
        assert np.array_equal(rb.continuous_quaternions(few), few)
