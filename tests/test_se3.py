"""Poses, twists, exp and log on SE(3), against power series and definitions."""

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
POSES = np.array(
    [
        rb.pose_from_components(R, d)
        for R, d in zip(
            Rotation.random(40, rng=RNG).as_matrix(), 5 * RNG.normal(size=(40, 3)), strict=True
        )
    ]
)


def translated(A):
    return np.linalg.norm(A[..., :3, 3], axis=-1)[..., None, None]


@pytest.mark.source("BK 2.1", "BK (3)")
def test_hat_is_the_printed_matrix_and_vee_its_inverse():
    S = RNG.normal(size=(4, 5, 6))
    w, v = S[..., :3], S[..., 3:]
    X = rb.hat_se3(S)
    assert np.array_equal(X[..., :3, :3], rb.hat_so3(w))
    assert np.array_equal(X[..., :3, 3], v)
    assert np.all(X[..., 3, :] == 0)
    assert np.array_equal(rb.vee_se3(X), S)
    assert np.array_equal(np.tensordot(S, rb.BASIS_SE3, 1), X)


@pytest.mark.source("BK 2.6")
def test_exp_is_the_power_series():
    for S in TWISTS[::7]:
        bound = 10 * EPS * (1 + np.linalg.norm(S[:3])) * (1 + np.linalg.norm(S[3:]))
        assert np.abs(rb.exp_se3(S) - oracles.expm(rb.hat_se3(S))).max() < bound


@pytest.mark.source("BK 2.6")
def test_log_is_the_inverse_of_exp():
    back = rb.exp_se3(rb.log_se3(POSES))
    assert np.all(np.abs(back - POSES) < 20 * EPS * (1 + translated(POSES)))
    near = np.linalg.norm(TWISTS[:, :3], axis=-1) < np.pi - 1e-3
    assert np.abs(rb.log_se3(rb.exp_se3(TWISTS[near])) - TWISTS[near]).max() < 1e-12


def test_log_of_half_turns_reaches_the_pose():
    matrices, _ = awkward.half_turns()
    A = rb.pose_from_components(matrices, [1.0, -2.0, 3.0])
    assert np.abs(rb.exp_se3(rb.log_se3(A)) - A).max() < 40 * EPS
    assert np.abs(rb.log_se3(A)[:, :3] - rb.log_so3(matrices)).max() == 0


@pytest.mark.source("BK 2.6")
def test_exp_and_log_agree_with_scipy():
    theirs = RigidTransform.from_matrix(POSES)
    assert np.abs(rb.log_se3(POSES) - theirs.as_exp_coords()).max() < 1e-12
    assert np.abs(rb.exp_se3(TWISTS) - RigidTransform.from_exp_coords(TWISTS).as_matrix()).max() < (
        1e-14 * 10
    )


def test_no_turn_is_a_translation_exactly():
    assert np.array_equal(rb.exp_se3([0, 0, 0, 1, 2, 3])[:3, 3], [1, 2, 3])
    assert np.array_equal(rb.log_se3(rb.exp_se3([0, 0, 0, 1, 2, 3])), [0, 0, 0, 1, 2, 3])


@pytest.mark.source("BK 2.1")
def test_inverse_and_adjoint_are_what_they_say():
    S = RNG.normal(size=(40, 6))
    inverse = rb.inverse_se3(POSES)
    assert np.all(np.abs(POSES @ inverse - np.eye(4)) < 20 * EPS * (1 + translated(POSES)))
    moved = rb.hat_se3((rb.adjoint_se3(POSES) @ S[..., None])[..., 0])
    want = POSES @ rb.hat_se3(S) @ inverse
    assert np.all(np.abs(moved - want) < 40 * EPS * (1 + translated(POSES)))


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


def test_batches_broadcast():
    assert rb.pose_from_components(np.eye(3), np.zeros((5, 1, 3))).shape == (5, 1, 4, 4)
    assert rb.pose_from_components(np.stack([np.eye(3)] * 2), np.zeros((5, 1, 3))).shape == (
        5, 2, 4, 4,
    )  # fmt: skip
    A = np.stack([np.eye(4)] * 6).reshape(2, 3, 4, 4)
    for function, core in (
        (rb.inverse_se3, (4, 4)),
        (rb.log_se3, (6,)),
        (rb.adjoint_se3, (6, 6)),
        (rb.coordinates_from_pose, (6,)),
        (rb.vee_se3, (6,)),
    ):
        assert function(A).shape == (2, 3, *core)


def test_the_basis_cannot_be_changed():
    with pytest.raises(ValueError, match="read-only"):
        rb.BASIS_SE3[0, 0, 0] = 1


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: rb.exp_se3([1, 2, 3]), r"S: shape \(\.\.\., 6\) wanted, got \(3,\)"),
        (lambda: rb.hat_se3([0, 0, 0, 0, 0, np.nan]), r"S\[5\] is nan"),
        (lambda: rb.log_se3(np.eye(3)), r"A: shape \(\.\.\., 4, 4\) wanted, got \(3, 3\)"),
        (lambda: rb.vee_se3(np.eye(3)), "matrix: shape"),
        (lambda: rb.adjoint_se3(np.full((4, 4), np.inf)), r"A\[0, 0\] is inf"),
        (lambda: rb.pose_from_coordinates([1, 2]), "x: shape"),
        (lambda: rb.pose_from_components(np.eye(3), [1, 2]), "d: shape"),
        (
            lambda: rb.pose_from_components(np.stack([np.eye(3)] * 2), np.zeros((3, 3))),
            r"batch shapes do not broadcast: R \(2,\), d \(3,\)",
        ),
    ],
)
def test_bad_arguments_are_named(call, message):
    with pytest.raises(ValueError, match=message):
        call()


def test_the_components_of_a_pose_are_what_it_is_made_of():
    R, d = rb.exp_so3(RNG.normal(size=(2, 5, 3))), RNG.normal(size=(5, 3))
    again = rb.components_from_pose(rb.pose_from_components(R, d))
    assert np.array_equal(again[0], R)
    assert np.array_equal(again[1], np.broadcast_to(d, (2, 5, 3)))
    with pytest.raises(ValueError, match=r"^A: shape \(\.\.\., 4, 4\) wanted"):
        rb.components_from_pose(np.eye(3))
