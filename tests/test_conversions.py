import awkward
import numpy as np
import oracles
import pytest
from scipy.spatial.transform import Rotation

import rbcourse as rb
from rbcourse.quaternion import quaternion_from_zyx, zyx_from_quaternion

EPS = np.finfo(float).eps
RNG = np.random.default_rng(2026)


def test_rotation_matrices_agree_with_scipy():
    q = np.concatenate(
        [rb.quaternion.project_quaternion(RNG.normal(size=(200, 4))), awkward.quaternions()]
    )
    R = rb.matrix_from_quaternion(q)
    assert np.abs(R - Rotation.from_quat(q, scalar_first=True).as_matrix()).max() < 4 * EPS
    assert np.array_equal(rb.matrix_from_quaternion(-q), R)
    back = rb.quaternion_from_matrix(R)
    assert oracles.between_rotations(back, q).max() < 4 * EPS
    assert np.all(back[..., 0] >= 0)


def test_exact_and_rounded_half_turns_have_the_documented_sign():
    R0, R1, n = awkward.rounded_half_turns(np.random.default_rng(7))
    matrices, axes = awkward.half_turns()
    exact, rounded = rb.quaternion_from_matrix(matrices), rb.quaternion_from_matrix(R0.mT @ R1)
    for q, size in ((exact, np.abs(axes)), (rounded, np.abs(n))):
        first = np.argmax(size > size.max(axis=1, keepdims=True) - 1e-9, axis=1)
        assert np.all(q[:, 0] == 0)
        assert np.all(np.take_along_axis(q[:, 1:], first[:, None], axis=1) > 0)
    given = np.insert(axes, 0, 0, axis=1)
    assert oracles.between_rotations(exact, given).max() < 2 * EPS
    w = rb.quaternion.rotation_vector_from_quaternion(given)
    assert np.array_equal(rb.quaternion.rotation_vector_from_quaternion(-given), w)
    assert np.abs(w - np.pi * axes * np.sign(np.vecdot(exact, given))[:, None]).max() < 4 * EPS
    for R in (matrices, rb.matrix_from_quaternion(given)):
        assert np.abs(rb.log_so3(R) - w).max() < 8 * EPS
    beta = RNG.uniform(-1, 1, size=200)
    R = rb.matrix_from_zyx(np.stack([np.full(200, np.pi), beta, RNG.uniform(-3, 3, 200)], axis=1))
    assert np.all(rb.zyx_from_matrix(R)[:, 0] > 0)
    # 1e-12 is more than rounding, so the angle keeps its sign
    near = np.array([1e-12 - np.pi, 0.3, 0.4])
    assert np.abs(zyx_from_quaternion(quaternion_from_zyx(near)) - near).max() < 20 * EPS


@pytest.mark.source("BK 2.5", "RR 2.2")
def test_rotation_vectors_and_quaternions_agree_with_mpmath():
    vectors, axis = awkward.ROTATION_VECTORS, awkward.UNIT_AXES
    q = rb.quaternion.quaternion_from_rotation_vector(vectors)
    exact = np.array([oracles.quaternion(w) for w in vectors])
    assert np.abs(q - exact)[:, 0].max() < 2 * EPS
    assert np.all(np.abs(q - exact)[:, 1:] <= 3 * EPS * np.abs(exact[:, 1:]))
    back = rb.quaternion.rotation_vector_from_quaternion(exact)
    off = np.abs(back - vectors)
    assert np.all(off <= 4 * EPS * np.linalg.norm(vectors, axis=-1, keepdims=True))
    assert np.array_equal(rb.quaternion.rotation_vector_from_quaternion(-exact), back)
    back = rb.quaternion.rotation_vector_from_quaternion(
        rb.quaternion.quaternion_from_rotation_vector(4 * axis)
    )
    assert np.abs(back + (2 * np.pi - 4) * axis).max() < 4 * EPS
    off = rb.quaternion.quaternion_from_rotation_vector(2 * np.pi * axis) - [-1, 0, 0, 0]
    assert np.abs(off).max() < 2 * EPS
    turns = np.array([3, 9, -20.0])[:, None] * axis[3]
    R = rb.matrix_from_quaternion(rb.quaternion.quaternion_from_rotation_vector(turns))
    assert np.abs(R - rb.exp_so3(turns)).max() < 40 * EPS


@pytest.mark.source("RR 2.1", "RR (7)", "RR (8)")
def test_zyx_angles_agree_with_the_printed_product_and_scipy():
    """Angles are random, multiples of π/4, and within 1e-12 … 1e-3 of gimbal lock."""
    quarter = np.pi / 4 * np.array(np.meshgrid(*3 * [np.arange(-8, 9)])).reshape(3, -1).T
    near = RNG.uniform(-3, 3, size=(40, 3))
    near[:, 1] = RNG.choice([-1, 1], 40) * (np.pi / 2 - 10.0 ** RNG.uniform(-12, -3, 40))
    angles = np.concatenate([RNG.uniform(-7, 7, size=(200, 3)), quarter, near])
    R, q, want = rb.matrix_from_zyx(angles), quaternion_from_zyx(angles), angles[::40]
    for (ca, cb, cc), (sa, sb, sc), got in zip(np.cos(want), np.sin(want), R[::40], strict=True):
        Rz = np.array([[ca, -sa, 0], [sa, ca, 0], [0, 0, 1]])
        Ry = np.array([[cb, 0, sb], [0, 1, 0], [-sb, 0, cb]])
        Rx = np.array([[1, 0, 0], [0, cc, -sc], [0, sc, cc]])
        assert np.abs(got - Rz @ Ry @ Rx).max() < 2 * EPS
    want = Rotation.from_euler("ZYX", angles)
    assert np.abs(R - want.as_matrix()).max() < 4 * EPS
    assert oracles.between_rotations(q, want.as_quat(scalar_first=True)).max() < 4 * EPS
    for back in (rb.zyx_from_matrix(R), zyx_from_quaternion(q), zyx_from_quaternion(-q)):
        assert np.all(np.abs(back[:, 1]) <= np.pi / 2 * (1 + EPS))
        assert np.all((back[:, ::2] > -np.pi) & (back[:, ::2] <= np.pi))
        # a matrix has twice the error of a quaternion
        assert np.abs(rb.matrix_from_zyx(back) - R).max() < 40 * EPS
        plain = back[:200]  # the other angles are near gimbal lock
        off = np.abs(plain - want[:200].as_euler("ZYX")).max(axis=1)
        assert np.all(off < 20 * EPS / np.cos(plain[:, 1]))


def test_the_last_angle_is_zero_within_16_eps_of_gimbal_lock():
    a, c = np.pi / 4 * np.array(np.meshgrid(np.arange(-4, 5), np.arange(-4, 5))).reshape(2, -1)
    for lock in (np.pi / 2, -np.pi / 2):
        R = rb.matrix_from_zyx(np.stack([a, np.full_like(a, lock), c], axis=1))
        back = rb.zyx_from_matrix(R)
        assert np.all(back[:, 2] == 0)
        assert np.abs(back[:, 1] - lock).max() < 16 * EPS
        alone = a - c if lock > 0 else a + c  # only this combination of the angles is determined
        assert np.abs(np.exp(1j * back[:, 0]) - np.exp(1j * alone)).max() < 16 * EPS
    for off in (1e-3, 1e-6, 1e-9):
        given = np.array([0.3, np.pi / 2 - off, -0.4])
        back = rb.zyx_from_matrix(rb.matrix_from_zyx(given))
        assert np.abs(back - given).max() < 10 * EPS / off
        assert abs((back - given) @ [1, 0, -1]) < 10 * EPS
    # the distance of q from gimbal lock, in units of 2⁻⁵³
    for steps, locked in ((22, True), (24, False)):
        for sign in (1, -1):
            q = [0.5 + steps * 2.0**-53, -0.5 * sign, 0.5 * sign, 0.5]
            assert (zyx_from_quaternion(q)[2] == 0) is np.bool_(locked)
