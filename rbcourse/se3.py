"""Poses and twists: SE(3), its Lie algebra se(3), exp, log, and coordinates.

A twist is (ω, v): the angular velocity and the velocity of the origin, both in the body frame.

Parameters
----------
R : array_like, shape (..., 3, 3)
    Rotation matrices.
d : array_like, shape (..., 3)
    Positions in the fixed frame.
A : array_like, shape (..., 4, 4)
    Poses.
x : array_like, shape (..., 6)
    Coordinates (σ, d).
S : array_like, shape (..., 6)
    Twists (ω, v), in rad and m per unit of time.
matrix : array_like, shape (..., 4, 4)
    The skew-symmetric part of its 3 × 3 block is used; the last row is ignored.
w : array_like, shape (..., 3)
    Angular velocities in the body frame.
d_dot : array_like, shape (..., 3)
    Velocities of the origin in the fixed frame.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._checks import as_finite, as_single, check_broadcast
from rbcourse._docs import described_by
from rbcourse._numerics import Array, in_blocks, matvec
from rbcourse._valid import as_poses, as_rotations, as_rotations_or_poses
from rbcourse.so3 import (
    exp_so3,
    hat_so3,
    log,
    right_jacobian_inverse_so3,
    right_jacobian_so3,
    vee_so3,
)


@described_by(__doc__, returns="ndarray, shape (..., 4, 4)")
def pose_from_components(R: ArrayLike, d: ArrayLike) -> Array:
    """Return the pose [[R, d], [0, 1]].

    Source: BK 2.1.

    Examples
    --------
    >>> pose_from_components(np.eye(3), [1, 2, 3])
    array([[1., 0., 0., 1.],
           [0., 1., 0., 2.],
           [0., 0., 1., 3.],
           [0., 0., 0., 1.]])
    """
    R, d = as_rotations("R", R), as_finite("d", d, 3)
    check_broadcast(R=(R, 2), d=(d, 1))
    return join(R, d)


@described_by(__doc__)
def components_from_pose(A: ArrayLike) -> tuple[Array, Array]:
    """Return R and d of a pose [[R, d], [0, 1]]; d is the position in the fixed frame.

    Source: BK 2.1.

    Returns
    -------
    R : ndarray, shape (..., 3, 3)
    d : ndarray, shape (..., 3)

    Examples
    --------
    >>> R, d = components_from_pose([[0, -1, 0, 5], [1, 0, 0, 6], [0, 0, 1, 7], [0, 0, 0, 1]])
    >>> d
    array([5., 6., 7.])
    """
    return split(as_poses("A", A))


def split(A: Array) -> tuple[Array, Array]:
    """Return views of the blocks R and d of poses, without checks."""
    return A[..., :3, :3], A[..., :3, 3]


def join(R: Array, d: Array) -> Array:
    """Return `pose_from_components`, without checks."""
    A = np.zeros((*np.broadcast_shapes(R.shape[:-2], d.shape[:-1]), 4, 4))
    A[..., :3, :3], A[..., :3, 3], A[..., 3, 3] = R, d, 1
    return A


@described_by(__doc__, returns="ndarray, shape (..., 4, 4)")
def inverse_se3(A: ArrayLike) -> Array:
    """Return the inverse of a pose: [[Rᵀ, −Rᵀ d], [0, 1]].

    Source: BK 2.1.

    Examples
    --------
    >>> A = exp_se3([0, 0, 1, 2, 3, 4])
    >>> bool(np.allclose(inverse_se3(A) @ A, np.eye(4)))
    True
    """
    R, d = split(as_poses("A", A))
    Rt = np.swapaxes(R, -1, -2)
    return join(Rt, -matvec(Rt, d))


@described_by(__doc__, returns="ndarray, shape (..., 4, 4)")
def pose_from_coordinates(x: ArrayLike) -> Array:
    """Return the pose with rotation exp_so3(σ) and position d, in the fixed frame.

    Source: BK 2.5.

    Examples
    --------
    >>> pose_from_coordinates([0, 0, np.pi / 2, 1, 2, 3]).round(12)[:3] + 0.0
    array([[ 0., -1.,  0.,  1.],
           [ 1.,  0.,  0.,  2.],
           [ 0.,  0.,  1.,  3.]])
    """
    x = as_finite("x", x, 6)
    return join(exp_so3(x[..., :3]), x[..., 3:])


@described_by(__doc__, returns="ndarray, shape (..., 6)")
def coordinates_from_pose(A: ArrayLike) -> Array:
    """Return the coordinates (σ, d) of a pose: σ = log_so3(R), and d in the fixed frame.

    Singular set: half-turns, as for `log_so3`.
    Source: BK 2.5.

    Examples
    --------
    >>> coordinates_from_pose(pose_from_coordinates([0.1, 0, 0.3, 1, 2, 3])).round(12)
    array([0.1, 0. , 0.3, 1. , 2. , 3. ])
    """
    R, d = split(as_poses("A", A))
    return np.concatenate([log(R), d], axis=-1)


@described_by(__doc__, returns="ndarray, shape (..., 4, 4)")
def hat_se3(S: ArrayLike) -> Array:
    """Return the matrix of a twist S = (ω, v): [[hat_so3(ω), v], [0, 0]].

    Source: BK 2.1, BK (1), BK (3).

    Examples
    --------
    >>> hat_se3([1, 2, 3, 4, 5, 6])
    array([[ 0., -3.,  2.,  4.],
           [ 3.,  0., -1.,  5.],
           [-2.,  1.,  0.,  6.],
           [ 0.,  0.,  0.,  0.]])
    """
    S = as_finite("S", S, 6)
    matrix = np.zeros((*S.shape[:-1], 4, 4))
    matrix[..., :3, :3], matrix[..., :3, 3] = hat_so3(S[..., :3]), S[..., 3:]
    return matrix


@described_by(__doc__, returns="ndarray, shape (..., 6)")
def vee_se3(matrix: ArrayLike) -> Array:
    """Return the twist (ω, v) of a matrix [[ω̂, v], [0, 0]]: the inverse of `hat_se3`.

    Source: BK 2.1, BK (1).

    Examples
    --------
    >>> vee_se3(hat_se3([1, 2, 3, 4, 5, 6]))
    array([1., 2., 3., 4., 5., 6.])
    """
    W, v = split(as_finite("matrix", matrix, 4, 4))
    return np.concatenate([vee_so3(W), v], axis=-1)


BASIS_SE3 = hat_se3(np.eye(6))
"""The standard basis of se(3), shape (6, 4, 4): turns about, then moves along x, y, z (BK (3))."""
BASIS_SE3.flags.writeable = False


@described_by(__doc__, returns="ndarray, shape (..., 4, 4)")
def exp_se3(S: ArrayLike) -> Array:
    """Return the pose to which the constant twist S = (ω, v) leads from I in unit time.

    The pose is [[exp_so3(ω), J v], [0, 1]] with J = ``right_jacobian_so3(ω).mT``. It is accurate to
    a few eps (1 + ‖ω‖) (1 + ‖v‖). There is no singular set; ω = 0 gives the translation by v
    exactly.
    Source: BK 2.6.

    Examples
    --------
    >>> exp_se3([0, 0, np.pi / 2, 1, 0, 3]).round(3) + 0.0  # a quarter of a helix
    array([[ 0.   , -1.   ,  0.   ,  0.637],
           [ 1.   ,  0.   ,  0.   ,  0.637],
           [ 0.   ,  0.   ,  1.   ,  3.   ],
           [ 0.   ,  0.   ,  0.   ,  1.   ]])
    """
    return in_blocks(_exp, as_finite("S", S, 6), 4)


def _exp(S: Array) -> Array:
    w, v = S[..., :3], S[..., 3:]
    left_jacobian = np.swapaxes(right_jacobian_so3(w), -1, -2)
    return join(exp_so3(w), matvec(left_jacobian, v))


@described_by(__doc__, returns="ndarray, shape (..., 6)")
def log_se3(A: ArrayLike) -> Array:
    """Return the twist (ω, v) with exp_se3((ω, v)) = A and ‖ω‖ ≤ π.

    The result is accurate to a few eps (1 + ‖d‖). Singular set: half-turns, where two twists give
    A. `log_so3` then chooses ω.
    Source: BK 2.6.

    Examples
    --------
    >>> log_se3(exp_se3([0, 0, 1.5, 1, 2, 3])).round(12)
    array([0. , 0. , 1.5, 1. , 2. , 3. ])
    """
    R, d = split(as_poses("A", A))
    w = log(R)
    left_jacobian_inverse = np.swapaxes(right_jacobian_inverse_so3(w), -1, -2)
    return np.concatenate([w, matvec(left_jacobian_inverse, d)], axis=-1)


@described_by(__doc__, returns="ndarray, shape (..., 6, 6)")
def adjoint_se3(A: ArrayLike) -> Array:
    """Return [[R, 0], [d̂ R, R]], which maps twists from the body frame of A to the fixed frame.

    ``hat_se3(adjoint_se3(A) @ S)`` is A hat_se3(S) A⁻¹.
    Source: BK 2.1.

    Examples
    --------
    >>> A = pose_from_components(np.eye(3), [0, 2, 0])
    >>> adjoint_se3(A) @ [0, 0, 1, 0, 0, 0]  # a turn about an axis 2 m away moves the origin
    array([0., 0., 1., 2., 0., 0.])
    """
    R, d = split(as_poses("A", A))
    Ad = np.zeros((*R.shape[:-2], 6, 6))
    Ad[..., :3, :3] = Ad[..., 3:, 3:] = R
    Ad[..., 3:, :3] = hat_so3(d) @ R
    return Ad


@described_by(__doc__, returns="ndarray, shape (..., 6)")
def twist_from_rates(A: ArrayLike, w: ArrayLike, d_dot: ArrayLike) -> Array:
    """Return the twist (ω, Rᵀ ḋ) of a body from ω in the body frame and ḋ in the fixed frame.

    Source: BK 6.3, which states end velocities by ω and ḋ.

    Examples
    --------
    >>> A = pose_from_coordinates([0, 0, np.pi / 2, 5, 0, 0])  # turned to the left
    >>> twist_from_rates(A, [0, 0, 1], [0, 2, 0]).round(12)  # it moves ahead
    array([0., 0., 1., 2., 0., 0.])
    """
    A, w, d_dot = as_poses("A", A), as_finite("w", w, 3), as_finite("d_dot", d_dot, 3)
    batch = check_broadcast(A=(A, 2), w=(w, 1), d_dot=(d_dot, 1))
    v = np.broadcast_to(matvec(A[..., :3, :3].mT, d_dot), (*batch, 3))
    return np.concatenate([np.broadcast_to(w, (*batch, 3)), v], axis=-1)


def check_path(
    times: ArrayLike, poses: ArrayLike, velocities: ArrayLike | None = None, name: str = "poses"
) -> tuple[Array, Array, Array | None]:
    """Check a path; return its times, its poses or rotations, and its velocities or None.

    ValueError names the first wrong shape, the first time that does not increase, or the first
    invalid matrix. `name` is the name of the argument with the poses.
    """
    if np.size(times) == 0:
        raise ValueError(f"times, {name}: one or more are wanted, got none")
    times = as_single("times", times, "N")
    poses, _ = as_rotations_or_poses(name, poses)
    size = poses.shape[-1]
    if poses.ndim != 3:
        raise ValueError(f"{name}: shape (N, 4, 4) or (N, 3, 3) is wanted, got {poses.shape}")
    if len(times) != len(poses):
        raise ValueError(
            f"times, {name}: equal numbers are wanted, got {len(times)} and {len(poses)}"
        )
    late = np.flatnonzero(times[1:] <= times[:-1])
    if len(late):
        before, after = times[late[0] :][:2]
        raise ValueError(f"times[{late[0] + 1}] is {after}, a time after {before} is wanted")
    if velocities is not None:
        velocities = as_single("velocities", velocities, "N", 3 if size == 3 else 6)
        if len(velocities) != len(times):
            raise ValueError(
                f"velocities: {len(times)} are wanted, one for each pose, got {len(velocities)}"
            )
    return times, poses, velocities
