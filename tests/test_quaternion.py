import awkward
import numpy as np
import oracles
import pytest
from scipy.spatial.transform import Rotation

import rbcourse as rb

EPS = np.finfo(float).eps
RNG = np.random.default_rng(2002)
RANDOM = (lambda q: q / np.linalg.norm(q, axis=-1, keepdims=True))(RNG.normal(size=(200, 4)))


@pytest.mark.source("RR 1.2", "RR (3)")
def test_a_unit_quaternion_has_norm_one():
    q = np.array([[1, 0, 0, 0], [2, 0, 0, 0], [0.5, 0.5, 0.5, -0.5], [1, 1e-4, 0, 0]])
    assert np.array_equal(rb.is_unit_quaternion(q), [True, False, True, False])
    assert rb.is_unit_quaternion([1.009, 0, 0, 0], atol=0.01)
    assert not rb.is_unit_quaternion([1.011, 0, 0, 0], atol=0.01)
    assert not rb.is_unit_quaternion([[np.nan, 0, 0, 1], [np.inf, 0, 0, 0], [1e200] * 4]).any()
    with pytest.raises(ValueError, match=r"q: shape \(\.\.\., 4\) wanted, got \(3,\)"):
        rb.is_unit_quaternion([1, 0, 0])


@pytest.mark.source("RR 2.2")
def test_hamiltons_rules():
    one, i, j, k = np.eye(4)
    for unit in (i, j, k):
        assert np.array_equal(rb.quaternion_multiply(unit, unit), -one)
    for a, b, c in [(i, j, k), (j, k, i), (k, i, j)]:
        assert np.array_equal(rb.quaternion_multiply(a, b), c)
        assert np.array_equal(rb.quaternion_multiply(b, a), -c)


@pytest.mark.source("RR 2.2")
def test_multiplication_is_associative_bilinear_and_keeps_the_norm():
    p, q, r = RNG.normal(size=(3, 50, 4))
    product = rb.quaternion_multiply(p, q)
    scale = np.linalg.norm(p, axis=-1) * np.linalg.norm(q, axis=-1)
    assert np.all(np.abs(np.linalg.norm(product, axis=-1) - scale) < 4 * EPS * scale)
    left = rb.quaternion_multiply(product, r)
    right = rb.quaternion_multiply(p, rb.quaternion_multiply(q, r))
    assert np.abs(left - right).max() < 8 * EPS * (scale * np.linalg.norm(r, axis=-1)).max()
    assert np.allclose(rb.quaternion_multiply(p + r, q), product + rb.quaternion_multiply(r, q))


def test_the_conjugate_turns_back():
    identity = rb.quaternion_multiply(RANDOM, rb.quaternion.quaternion_conjugate(RANDOM))
    assert np.abs(identity - [1, 0, 0, 0]).max() < 4 * EPS


@pytest.mark.source("RR 2.2")
def test_rotation_of_points_agrees_with_scipy():
    points = RNG.normal(size=(200, 3))
    want = Rotation.from_quat(RANDOM, scalar_first=True).apply(points)
    size = np.linalg.norm(points, axis=1).max()
    assert np.abs(rb.rotate_by_quaternion(RANDOM, points) - want).max() < 8 * EPS * size


@pytest.mark.source("RR 2.2")
def test_turning_by_a_product_is_turning_twice():
    p, q, x = RANDOM[:100], RANDOM[100:], RNG.normal(size=(100, 3))
    once = rb.rotate_by_quaternion(rb.quaternion_multiply(p, q), x)
    assert np.allclose(once, rb.rotate_by_quaternion(p, rb.rotate_by_quaternion(q, x)), atol=1e-14)


def test_any_batch_is_the_stack_of_its_members():
    q, p = RANDOM[:6].reshape(2, 3, 4), RANDOM[6:9]
    for i in np.ndindex(2, 3):
        single = rb.slerp(q[i], p[i[1]], 0.3)
        assert np.abs(rb.slerp(q, p, [0.3, 0.4])[0][i] - single).max() < 4 * EPS
    assert rb.slerp(q, p, np.zeros((5, 1))).shape == (5, 1, 2, 3, 4)


@pytest.mark.source("BK Remark 7")
def test_slerp_is_the_constant_speed_arc():
    """q0 (q0⁻¹ q1)ᵗ, by mpmath's logarithm of the rotation between."""
    for q0, q1 in zip(RANDOM[:20], RANDOM[20:40], strict=True):
        R0, R1 = rb.matrix_from_quaternion(np.array([q0, q1]))
        turn = oracles.log_so3(R0.T @ R1)
        for t in (0.0, 0.2, 0.5, 1.0):
            got = rb.matrix_from_quaternion(rb.slerp(q0, q1, t))
            assert np.abs(got - R0 @ oracles.exp_so3(t * turn)).max() < 20 * EPS


@pytest.mark.source("BK Remark 7")
def test_slerp_is_the_formula_of_the_paper():
    q0, q1 = RANDOM[0], RANDOM[1]
    q1 = q1 * np.sign(q0 @ q1)
    a, u = np.arccos(q0 @ q1), np.linspace(0, 1, 11)[:, None]
    printed = (np.sin((1 - u) * a) * q0 + np.sin(u * a) * q1) / np.sin(a)
    assert np.abs(rb.slerp(q0, q1, u[:, 0]) - printed).max() < 40 * EPS


def test_slerp_near_its_singular_sets():
    one = np.array([1.0, 0, 0, 0])
    assert np.array_equal(rb.slerp(one, one, [0, 0.3, 1]), [one] * 3)
    assert np.array_equal(rb.slerp(one, -one, 0.5), one)
    near = rb.slerp(one, [1, 1e-12, 0, 0], 0.25)
    assert abs(near[1] / 0.25e-12 - 1) < 4 * EPS
    for angle in (np.pi / 2 + 1e-9, np.pi / 2 + 0.05, np.pi - 1e-9):  # −q is the nearer goal
        there = np.array([np.cos(angle), np.sin(angle), 0, 0])
        assert np.abs(rb.slerp(one, there, 1) + there).max() < 4 * EPS
    half = np.sqrt(0.5)
    quarter = rb.slerp(one, [0, 0, 1, 0], 0.5)
    assert np.abs(quarter - [half, 0, half, 0]).max() < 2 * EPS
    assert np.abs(rb.slerp(one, [0, 0, -1, 0], 0.5) - [half, 0, -half, 0]).max() < 2 * EPS


def test_bad_arguments_are_named():
    with pytest.raises(ValueError, match=r"q1: shape \(\.\.\., 4\) wanted, got \(3,\)"):
        rb.slerp([1, 0, 0, 0], [1, 0, 0], 0)
    with pytest.raises(ValueError, match=r"p \(2,\), q \(3,\)"):
        rb.quaternion_multiply(RANDOM[:2], RANDOM[:3])
    with pytest.raises(ValueError, match=r"q \(2,\), p \(3,\)"):
        rb.rotate_by_quaternion(RANDOM[:2], np.ones((3, 3)))
    for atol in (-1e-9, np.nan, [1e-9, 1e-9]):
        with pytest.raises(ValueError, match="atol: a number from 0 up wanted"):
            rb.is_unit_quaternion([1, 0, 0, 0], atol)


@pytest.mark.source("RR 1.5", "RR (6)", "RR Fig. 2")
def test_the_nearest_unit_quaternion_has_the_same_direction():
    q = RANDOM * 10.0 ** RNG.uniform(-300, 300, size=(200, 1))
    nearest = rb.project_quaternion(q)
    assert np.abs(nearest - RANDOM).max() < 4 * EPS
    assert np.abs(np.linalg.norm(nearest, axis=-1) - 1).max() < 2 * EPS
    assert np.array_equal(rb.project_quaternion([10, 10, 10, 10]), [0.5] * 4)
    assert np.array_equal(rb.project_quaternion([5e-324, 0, 0, 0]), [1, 0, 0, 0])
    largest = np.finfo(float).max
    assert np.array_equal(rb.project_quaternion([largest] * 4), [0.5] * 4)


def test_zero_has_no_nearest_unit_quaternion():
    with pytest.raises(ValueError, match=r"^q is zero"):
        rb.project_quaternion([0, 0, 0, 0])
    with pytest.raises(ValueError, match=r"^q\[1, 0\] is zero"):
        rb.project_quaternion([[[1, 0, 0, 0]], [[0, 0, 0, 0]]])


def test_one_of_q_and_minus_q_is_canonical():
    for q in (RANDOM, awkward.quaternions(), np.insert(awkward.half_turns()[1], 0, 0, axis=1)):
        one = rb.quaternion.canonical_quaternion(q)
        assert np.array_equal(rb.quaternion.canonical_quaternion(-q), one)
        assert np.array_equal(rb.quaternion.canonical_quaternion(one), one)
        assert np.abs(np.abs(one) - np.abs(q)).max() < 4 * EPS
        assert np.all(one[:, 0] >= 0)


def test_of_two_largest_components_the_first_decides():
    for off, first in [(0, True), (1e-9, True), (-1e-9, True), (1e-7, False)]:
        q = rb.project_quaternion([0, -1, 1 + off, 0.3])
        assert (rb.quaternion.canonical_quaternion(q)[1] > 0) is np.bool_(first)


def test_only_rounding_counts_as_a_half_turn():
    for off in (1e-9, 1e-12, 1e-14):
        q = np.array([-off, 0.8, 0.6, 0])
        assert np.array_equal(rb.quaternion.canonical_quaternion(q), -q)
    assert np.array_equal(
        rb.quaternion.canonical_quaternion([-2e-16, 0.8, 0.6, 0]), [0, 0.8, 0.6, 0]
    )
    for goal in ([-1e-14, 1, 0, 0], [1e-14, 1, 0, 0]):  # nearly as far both ways
        sign = np.sign(goal[0])
        assert np.abs(rb.slerp([1, 0, 0, 0], goal, 1) - sign * np.array(goal)).max() < 4 * EPS
        assert (
            np.abs(rb.quaternion.slerp_long([1, 0, 0, 0], goal, 1) + sign * np.array(goal)).max()
            < 4 * EPS
        )
    rounded = [-2e-16, 1, 0, 0]
    assert rb.slerp([1, 0, 0, 0], rounded, 1)[1] > 0
    assert rb.quaternion.slerp_long([1, 0, 0, 0], rounded, 1)[1] < 0
    near = [np.cos(1e-14), np.sin(1e-14), 0, 0]
    assert np.abs(rb.quaternion.slerp_long([1, 0, 0, 0], near, 0.5) - [0, -1, 0, 0]).max() < 0.1


@pytest.mark.source("BK Remark 7")
def test_slerp_agrees_with_mpmath_on_awkward_pairs():
    for start in (RANDOM[0], np.array([1.0, 0, 0, 0])):
        for turn in awkward.quaternions()[::3]:
            goal = rb.quaternion_multiply(start, turn)
            for t in (0.3, 1.0):
                assert (
                    np.abs(rb.slerp(start, goal, t) - oracles.arc(start, goal, t)).max() < 8 * EPS
                )
                assert (
                    np.abs(rb.slerp(start, -goal, t) - oracles.arc(start, goal, t)).max() < 8 * EPS
                )


@pytest.mark.source("BK Remark 7")
def test_the_long_way_is_the_rest_of_the_great_circle():
    """From q0 to −q1: the arc in R⁴ is longer than a quarter circle."""
    q0, q1 = RANDOM[:50], RANDOM[50:100]
    q1 = q1 * np.sign(np.sum(q0 * q1, axis=-1, keepdims=True))
    for t in (0.0, 0.2, 0.5, 1.0):
        exact = np.array([oracles.arc(p, -q, t) for p, q in zip(q0, q1, strict=True)])
        for goal in (q1, -q1):
            assert np.abs(rb.quaternion.slerp_long(q0, goal, t) - exact).max() < 20 * EPS
    t = np.linspace(0, 1, 9)
    steps = np.diff(rb.quaternion.slerp_long(q0, q1, t), axis=0)
    size = np.linalg.norm(steps, axis=-1)
    assert np.abs(size - size[0]).max() < 20 * EPS  # at constant speed


def test_the_long_way_near_its_singular_sets():
    one = np.array([1.0, 0, 0, 0])
    for goal in (one, -one, [1, 1e-17, 0, 0]):
        with pytest.raises(ValueError, match=r"^q1 is the same rotation as q0"):
            rb.quaternion.slerp_long(one, goal, 0.5)
    with pytest.raises(ValueError, match=r"^q1\[1\] is the same"):
        rb.quaternion.slerp_long(one, [[0, 1, 0, 0], [-1, 0, 0, 0]], 0.5)
    for angle in (1e-3, 1e-6, 1e-9):
        near = np.array([np.cos(angle), 0, np.sin(angle), 0])
        middle = rb.quaternion.slerp_long(
            one, near, np.pi / 2 / (np.pi - angle)
        )  # a quarter of the circle
        assert np.abs(middle - [0, 0, -1, 0]).max() < 4 * EPS / angle
    half_turn = np.array([0, 0, 0, 1.0])  # both ways are as long, and they differ
    assert np.abs(rb.quaternion.slerp_long(one, half_turn, 1) + half_turn).max() < 4 * EPS
    assert np.abs(rb.quaternion.slerp_long(one, -half_turn, 1) - half_turn).max() < 4 * EPS


def test_continuous_quaternions_are_the_same_rotations_without_jumps():
    t = np.linspace(0, 4, 401)
    R = rb.exp_so3(t[:, None] * [[0.3, -1, 2]])  # w passes through 0 three times
    q = rb.quaternion_from_matrix(R)
    jumping = np.abs(np.diff(q, axis=0)).max()
    smooth = rb.continuous_quaternions(q)
    assert jumping > 1
    assert np.abs(np.diff(smooth, axis=0)).max() < np.linalg.norm([0.3, -1, 2]) * t[1] / 2
    assert np.array_equal(smooth[0], q[0])
    assert np.array_equal(np.abs(smooth), np.abs(q))


def test_continuous_quaternions_take_each_path_of_a_stack_and_change_no_argument():
    q = rb.sample_quaternion((50, 3), rng=8)
    before, signs = q.copy(), rb.continuous_quaternions(q)
    assert np.array_equal(q, before)
    assert np.all(np.sum(signs[1:] * signs[:-1], axis=-1) >= 0)
    for k in range(3):
        assert np.array_equal(signs[:, k], rb.continuous_quaternions(q[:, k]))
    assert np.array_equal(rb.continuous_quaternions(q[0, 0]), q[0, 0])
    assert np.array_equal(rb.continuous_quaternions(-q[:1]), -q[:1])
    assert rb.continuous_quaternions(np.empty((0, 4))).shape == (0, 4)
