import awkward
import numpy as np
import oracles
import pytest
from scipy.spatial.transform import Rotation

import rbcourse as rb

EPS = np.finfo(float).eps
RNG = np.random.default_rng(31)
TURNS = awkward.ROTATION_VECTORS
TWISTS = np.concatenate([TURNS, RNG.normal(size=TURNS.shape)], axis=-1)
POSES = np.tile(np.eye(4), (40, 1, 1))
POSES[:, :3, 3], POSES[:, :3, :3] = (
    5 * RNG.normal(size=(40, 3)),
    Rotation.random(40, RNG).as_matrix(),
)
SIZES = 1 + np.linalg.norm(POSES[:, :3, 3], axis=-1)[:, None, None]


@pytest.mark.source("BK 2.1", "BK (3)")
def test_hat_is_the_printed_matrix():
    S = RNG.normal(size=(4, 5, 6))
    X = rb.hat_se3(S)
    assert np.array_equal(X[..., :3, :3], rb.hat_so3(S[..., :3]))
    assert np.array_equal(X[..., :3, 3], S[..., 3:])
    assert np.all(X[..., 3, :] == 0)
    assert np.array_equal(rb.vee_se3(X), S)
    assert np.array_equal(np.tensordot(S, rb.connection.BASIS_SE3, 1), X)


@pytest.mark.source("BK 2.6")
def test_exp_agrees_with_the_power_series_and_scipy():
    for S in TWISTS[::15]:
        bound = 10 * EPS * (1 + np.linalg.norm(S[:3])) * (1 + np.linalg.norm(S[3:]))
        assert np.abs(rb.exp_se3(S) - oracles.expm(rb.hat_se3(S))).max() < bound
    assert np.all(np.abs(rb.exp_se3(rb.log_se3(POSES)) - POSES) < 20 * EPS * SIZES)
    near = TWISTS[np.linalg.norm(TURNS, axis=-1) < np.pi - 1e-3]
    assert np.abs(rb.log_se3(rb.exp_se3(near)) - near).max() < 1e-12
    translation = [0, 0, 0, 1, 2, 3]
    assert np.array_equal(rb.exp_se3(translation)[:3, 3], [1, 2, 3])
    assert np.array_equal(rb.log_se3(rb.exp_se3(translation)), translation)
    matrices, _ = awkward.half_turns()
    A = rb.pose_from_components(matrices, [1.0, -2.0, 3.0])
    assert np.abs(rb.exp_se3(rb.log_se3(A)) - A).max() < 40 * EPS
    assert np.array_equal(rb.log_se3(A)[:, :3], rb.log_so3(matrices))
    if awkward.RigidTransform:
        theirs = awkward.RigidTransform.from_exp_coords(TWISTS)
        assert np.abs(rb.exp_se3(TWISTS) - theirs.as_matrix()).max() < 1e-13


@pytest.mark.source("BK (1)", "BK 2.1")
def test_the_inverse_and_the_adjoint_agree_with_their_definitions():
    S = RNG.normal(size=(40, 6))
    inverse = rb.inverse_se3(POSES)
    assert np.all(np.abs(POSES @ inverse - np.eye(4)) < 20 * EPS * SIZES)
    moved = rb.hat_se3((rb.adjoint_se3(POSES) @ S[..., None])[..., 0])
    assert np.all(np.abs(moved - POSES @ rb.hat_se3(S) @ inverse) < 40 * EPS * SIZES)
    rate = oracles.derivative_by_differences(lambda t: POSES @ rb.exp_se3(t * S), 0.0)
    assert np.abs(rb.vee_se3(inverse @ rate) - S).max() < 1e-11
    assert np.abs((POSES[:, :3, :3].mT @ rate[:, :3, 3:])[..., 0] - S[:, 3:]).max() < 1e-11


@pytest.mark.source("BK 2.5")
def test_conversions_to_coordinates_and_components_can_be_undone():
    x = rb.coordinates_from_pose(POSES)
    assert np.array_equal(x[:, :3], rb.log_so3(POSES[:, :3, :3]))
    assert np.array_equal(x[:, 3:], POSES[:, :3, 3])
    assert np.abs(rb.pose_from_coordinates(x) - POSES).max() < 20 * EPS
    R, d = rb.exp_so3(RNG.normal(size=(2, 5, 3))), RNG.normal(size=(5, 3))
    again = rb.components_from_pose(rb.pose_from_components(R, d))
    assert np.array_equal(again[0], R)
    assert np.array_equal(again[1], np.broadcast_to(d, (2, 5, 3)))
    with pytest.raises(ValueError, match=r"^A: shape \(\.\.\., 4, 4\) is wanted"):
        rb.components_from_pose(np.eye(3))
