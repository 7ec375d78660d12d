import awkward
import numpy as np
import oracles
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

import rbcourse as rb

EPS = np.finfo(float).eps
RNG = np.random.default_rng(31)
TWISTS = np.concatenate(
    [awkward.ROTATION_VECTORS, RNG.normal(size=(len(awkward.ROTATION_VECTORS), 3))], axis=-1
)
POSES = RigidTransform.from_components(
    5 * RNG.normal(size=(40, 3)), Rotation.random(40, rng=RNG)
).as_matrix()
SIZES = 1 + np.linalg.norm(POSES[:, :3, 3], axis=-1)[:, None, None]


@pytest.mark.source("BK 2.1", "BK (3)")
def test_hat_is_the_printed_matrix_and_vee_its_inverse():
    S = RNG.normal(size=(4, 5, 6))
    X = rb.hat_se3(S)
    assert np.array_equal(X[..., :3, :3], rb.hat_so3(S[..., :3]))
    assert np.array_equal(X[..., :3, 3], S[..., 3:])
    assert np.all(X[..., 3, :] == 0)
    assert np.array_equal(rb.vee_se3(X), S)
    assert np.array_equal(np.tensordot(S, rb.BASIS_SE3, 1), X)
    with pytest.raises(ValueError, match="read-only"):
        rb.BASIS_SE3[0, 0, 0] = 1


@pytest.mark.source("BK 2.6")
def test_exp_is_the_power_series():
    for S in TWISTS[::7]:
        bound = 10 * EPS * (1 + np.linalg.norm(S[:3])) * (1 + np.linalg.norm(S[3:]))
        assert np.abs(rb.exp_se3(S) - oracles.expm(rb.hat_se3(S))).max() < bound


@pytest.mark.source("BK 2.6")
def test_log_is_the_inverse_of_exp():
    assert np.all(np.abs(rb.exp_se3(rb.log_se3(POSES)) - POSES) < 20 * EPS * SIZES)
    near = np.linalg.norm(TWISTS[:, :3], axis=-1) < np.pi - 1e-3
    assert np.abs(rb.log_se3(rb.exp_se3(TWISTS[near])) - TWISTS[near]).max() < 1e-12
    translation = [0, 0, 0, 1, 2, 3]
    assert np.array_equal(rb.exp_se3(translation)[:3, 3], [1, 2, 3])
    assert np.array_equal(rb.log_se3(rb.exp_se3(translation)), translation)


def test_log_of_half_turns_reaches_the_pose():
    matrices, _ = awkward.half_turns()
    A = rb.pose_from_components(matrices, [1.0, -2.0, 3.0])
    assert np.abs(rb.exp_se3(rb.log_se3(A)) - A).max() < 40 * EPS
    assert np.abs(rb.log_se3(A)[:, :3] - rb.log_so3(matrices)).max() == 0


@pytest.mark.source("BK 2.6")
def test_exp_and_log_agree_with_scipy():
    theirs = RigidTransform.from_matrix(POSES)
    assert np.abs(rb.log_se3(POSES) - theirs.as_exp_coords()).max() < 1e-12
    theirs = RigidTransform.from_exp_coords(TWISTS)
    assert np.abs(rb.exp_se3(TWISTS) - theirs.as_matrix()).max() < 1e-13


@pytest.mark.source("BK 2.1")
def test_the_inverse_inverts_and_the_adjoint_carries_twists():
    S = RNG.normal(size=(40, 6))
    inverse = rb.inverse_se3(POSES)
    assert np.all(np.abs(POSES @ inverse - np.eye(4)) < 20 * EPS * SIZES)
    moved = rb.hat_se3((rb.adjoint_se3(POSES) @ S[..., None])[..., 0])
    assert np.all(np.abs(moved - POSES @ rb.hat_se3(S) @ inverse) < 40 * EPS * SIZES)


@pytest.mark.source("BK (1)")
def test_the_twist_does_not_depend_on_the_fixed_frame_and_is_rotation_and_velocity_in_the_body():
    S = RNG.normal(size=6)
    for A in POSES[:5]:
        rate = oracles.derivative_by_differences(lambda t, A=A: A @ rb.exp_se3(t * S), 0.0)
        assert np.abs(rb.vee_se3(rb.inverse_se3(A) @ rate) - S).max() < 1e-11
        assert np.abs(A[:3, :3].T @ rate[:3, 3] - S[3:]).max() < 1e-11


@pytest.mark.source("BK 2.5")
def test_coordinates_are_rotation_vector_and_position():
    x = rb.coordinates_from_pose(POSES)
    assert np.array_equal(x[:, :3], rb.log_so3(POSES[:, :3, :3]))
    assert np.array_equal(x[:, 3:], POSES[:, :3, 3])
    assert np.abs(rb.pose_from_coordinates(x) - POSES).max() < 20 * EPS


def test_components_make_a_pose_and_are_given_back():
    R, d = rb.exp_so3(RNG.normal(size=(2, 5, 3))), RNG.normal(size=(5, 3))
    again = rb.components_from_pose(rb.pose_from_components(R, d))
    assert np.array_equal(again[0], R)
    assert np.array_equal(again[1], np.broadcast_to(d, (2, 5, 3)))
    with pytest.raises(ValueError, match=r"^A: shape \(\.\.\., 4, 4\) wanted"):
        rb.components_from_pose(np.eye(3))
