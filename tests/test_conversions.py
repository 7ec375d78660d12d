import awkward
import numpy as np
import oracles
import pytest
from scipy.spatial.transform import Rotation

import rbcourse as rb
from rbcourse.conversions import quaternion_from_zyx, zyx_from_quaternion

EPS = np.finfo(float).eps
RNG = np.random.default_rng(2026)
RANDOM = rb.project_quaternion(RNG.normal(size=(200, 4)))


@pytest.mark.parametrize("q", [RANDOM, awkward.quaternions()], ids=["random", "awkward"])
def test_matrices_agree_with_scipy_and_give_the_quaternion_back(q):
    want = Rotation.from_quat(q, scalar_first=True).as_matrix()
    R = rb.matrix_from_quaternion(q)
    assert np.abs(R - want).max() < 4 * EPS
    assert np.abs(rb.matrix_from_quaternion(-q) - R).max() == 0
    back = rb.quaternion_from_matrix(R)
    assert oracles.between_rotations(back, q).max() < 4 * EPS
    assert np.all(back[..., 0] >= 0)


def test_half_turns_exact_or_rounded_have_the_named_sign():
    R0, R1, n = awkward.rounded_half_turns(np.random.default_rng(7))
    matrices, axes = awkward.half_turns()
    exact, rounded = rb.quaternion_from_matrix(matrices), rb.quaternion_from_matrix(R0.mT @ R1)
    for q, size in ((exact, np.abs(axes)), (rounded, np.abs(n))):
        first = np.argmax(size > size.max(axis=1, keepdims=True) - 1e-9, axis=1)
        assert np.all(q[:, 0] == 0)
        assert np.all(np.take_along_axis(q[:, 1:], first[:, None], axis=1) > 0)
    given = np.insert(axes, 0, 0, axis=1)
    assert oracles.between_rotations(exact, given).max() < 2 * EPS
    w = rb.rotation_vector_from_quaternion(given)
    assert np.array_equal(rb.rotation_vector_from_quaternion(-given), w)
    sign = np.sign(np.sum(exact * given, axis=1, keepdims=True))
    assert np.abs(w - np.pi * axes * sign).max() < 4 * EPS
    for R in (matrices, rb.matrix_from_quaternion(given)):
        assert np.abs(rb.log_so3(R) - w).max() < 8 * EPS


@pytest.mark.source("BK 2.5", "RR 2.2")
def test_rotation_vectors_and_quaternions_agree_with_mpmath():
    q = rb.quaternion_from_rotation_vector(awkward.ROTATION_VECTORS)
    exact = np.array([oracles.quaternion(w) for w in awkward.ROTATION_VECTORS])
    assert np.abs(q - exact)[:, 0].max() < 2 * EPS
    assert np.all(np.abs(q - exact)[:, 1:] <= 3 * EPS * np.abs(exact[:, 1:]))
    back = rb.rotation_vector_from_quaternion(exact)
    scale = np.linalg.norm(awkward.ROTATION_VECTORS, axis=-1, keepdims=True)
    assert np.all(np.abs(back - awkward.ROTATION_VECTORS) <= 4 * EPS * scale)
    assert np.array_equal(rb.rotation_vector_from_quaternion(-exact), back)


def test_more_than_a_half_turn_comes_back_as_the_shorter_one():
    axis = awkward.UNIT_AXES
    back = rb.rotation_vector_from_quaternion(rb.quaternion_from_rotation_vector(4 * axis))
    assert np.abs(back + (2 * np.pi - 4) * axis).max() < 4 * EPS
    full = rb.quaternion_from_rotation_vector(2 * np.pi * axis)
    assert np.abs(full - [-1, 0, 0, 0]).max() < 2 * EPS
    turns = np.array([3, 9, -20.0])[:, None] * axis[3]
    R = rb.matrix_from_quaternion(rb.quaternion_from_rotation_vector(turns))
    assert np.abs(R - rb.exp_so3(turns)).max() < 40 * EPS


def angles_of(count):
    """Any angles, the multiples of π/4, and those within 1e-12 … 1e-3 of gimbal lock."""
    quarter = np.pi / 4 * np.array(np.meshgrid(*3 * [np.arange(-8, 9)])).reshape(3, -1).T
    near = RNG.uniform(-3, 3, size=(40, 3))
    near[:, 1] = RNG.choice([-1, 1], 40) * (np.pi / 2 - 10.0 ** RNG.uniform(-12, -3, 40))
    return np.concatenate([RNG.uniform(-7, 7, size=(count, 3)), quarter, near])


@pytest.mark.source("RR 2.1", "RR (7)", "RR (8)")
def test_zyx_matrices_are_the_product_of_the_printed_ones():
    for a, b, c in angles_of(50):
        (ca, cb, cc), (sa, sb, sc) = np.cos([a, b, c]), np.sin([a, b, c])
        Rz = np.array([[ca, -sa, 0], [sa, ca, 0], [0, 0, 1]])
        Ry = np.array([[cb, 0, sb], [0, 1, 0], [-sb, 0, cb]])
        Rx = np.array([[1, 0, 0], [0, cc, -sc], [0, sc, cc]])
        assert np.abs(rb.matrix_from_zyx([a, b, c]) - Rz @ Ry @ Rx).max() < 2 * EPS


def test_zyx_angles_agree_with_scipy_and_give_the_rotation_back_gimbal_lock_included():
    angles = angles_of(200)
    R, q = rb.matrix_from_zyx(angles), quaternion_from_zyx(angles)
    want = Rotation.from_euler("ZYX", angles)
    assert np.abs(R - want.as_matrix()).max() < 4 * EPS
    assert oracles.between_rotations(q, want.as_quat(scalar_first=True)).max() < 4 * EPS
    for back in (rb.zyx_from_matrix(R), zyx_from_quaternion(q), zyx_from_quaternion(-q)):
        assert np.all(np.abs(back[:, 1]) <= np.pi / 2 * (1 + EPS))
        assert np.all((back[:, ::2] > -np.pi) & (back[:, ::2] <= np.pi))
        assert np.abs(rb.matrix_from_zyx(back) - R).max() < 40 * EPS  # twice what q loses
        plain = back[:200]  # the rest is near gimbal lock
        off = np.abs(plain - want[:200].as_euler("ZYX")).max(axis=1)
        assert np.all(off < 20 * EPS / np.cos(plain[:, 1]))


def test_in_gimbal_lock_the_last_angle_is_zero():
    a, c = np.pi / 4 * np.array(np.meshgrid(np.arange(-4, 5), np.arange(-4, 5))).reshape(2, -1)
    for lock in (np.pi / 2, -np.pi / 2):
        R = rb.matrix_from_zyx(np.stack([a, np.full_like(a, lock), c], axis=1))
        back = rb.zyx_from_matrix(R)
        assert np.all(back[:, 2] == 0)
        assert np.abs(back[:, 1] - lock).max() < 16 * EPS
        alone = a - c if lock > 0 else a + c  # the only combination that is determined
        assert np.abs(np.exp(1j * back[:, 0]) - np.exp(1j * alone)).max() < 16 * EPS


def test_close_to_gimbal_lock_both_angles_are_told():
    for off in (1e-3, 1e-6, 1e-9):
        given = np.array([0.3, np.pi / 2 - off, -0.4])
        back = rb.zyx_from_matrix(rb.matrix_from_zyx(given))
        assert np.abs(back - given).max() < 10 * EPS / off
        assert abs((back - given) @ [1, 0, -1]) < 10 * EPS


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(("steps", "locked"), [(17, True), (19, False)])
def test_zyx_from_quaternion_counts_as_locked_angles_within_16_eps(steps, locked, sign):
    """|β| misses π/2 by twice the ratio of 17, or 19, times 2⁻⁵³ to √1.25: by 15 or 17 eps."""
    angles = zyx_from_quaternion([0.5 + steps * 2.0**-53, -0.25 * sign, 0.5 * sign, 0.25])
    assert bool(angles[2] == 0) is locked


def test_rounding_chooses_no_sign_of_a_half_turn_about_z():
    beta = RNG.uniform(-1, 1, size=200)
    R = rb.matrix_from_zyx(np.stack([np.full(200, np.pi), beta, RNG.uniform(-3, 3, 200)], axis=1))
    assert np.all(rb.zyx_from_matrix(R)[:, 0] > 0)
    near = np.array([1e-12 - np.pi, 0.3, 0.4])  # no rounding: it keeps its sign
    assert np.abs(zyx_from_quaternion(quaternion_from_zyx(near)) - near).max() < 20 * EPS


@pytest.mark.source("errata 17")
def test_the_printed_naive_quaternion_takes_its_angles_in_the_other_order():
    angles = RNG.uniform(0, 2 * np.pi, size=(50, 3))
    (ca, cb, cc), (sa, sb, sc) = np.cos(angles.T / 2), np.sin(angles.T / 2)
    printed = np.transpose(
        [
            ca * cb * cc + sa * sb * sc,
            sa * cb * cc - ca * sb * sc,
            ca * sb * cc + sa * cb * sc,
            ca * cb * sc - sa * sb * cc,
        ]
    )
    assert oracles.between_rotations(quaternion_from_zyx(angles[:, ::-1]), printed).max() < 4 * EPS
    assert oracles.between_rotations(quaternion_from_zyx(angles), printed).min() > 1e-3
