"""One rule of validity for rotation matrices, poses and unit quaternions.

A deviation of at most 1e-9 is accepted. A deviation of at most 1e-6, which numbers in single
precision have, is removed by projection. A larger deviation raises ValueError.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._checks import SINGLE, as_array, as_finite, first_index
from rbcourse._foam import Entries, cofactors, determinant
from rbcourse._numerics import Array, blocks
from rbcourse.projection import nearest

ACCEPTED, REMOVED = 1e-9, SINGLE
_LAST_ROW = np.array([0.0, 0, 0, 1])


def as_rotations(name: str, value: ArrayLike) -> Array:
    """Return rotation matrices, shape (..., 3, 3)."""
    R = as_finite(name, value)
    if R.shape[-2:] != (3, 3):
        raise _wrong_shape(name, R.shape, "(..., 3, 3)")
    _repair(name, R, "rotation", "project_so")
    return R


def as_poses(name: str, value: ArrayLike) -> Array:
    """Return poses, shape (..., 4, 4)."""
    A = as_finite(name, value)
    if A.shape[-2:] != (4, 4):
        raise _wrong_shape(name, A.shape, "(..., 4, 4)")
    row = A[..., 3, :]
    wrong = ~(np.abs(row - _LAST_ROW).max(axis=-1) <= REMOVED)
    if wrong.any():
        raise ValueError(
            f"{first_index(name, wrong)} is not a pose: its last row is {row[wrong][0].tolist()}, "
            "and [0, 0, 0, 1] is wanted"
        )
    row[...] = _LAST_ROW
    _repair(name, A[..., :3, :3], "pose", "project_se")
    return A


def as_rotations_or_poses(name: str, value: ArrayLike) -> tuple[Array, int]:
    """Return the matrices, and the dimension of their group: 3 for SO(3), 6 for SE(3)."""
    A = as_array(name, value)
    if A.shape[-2:] == (3, 3):
        return as_rotations(name, A), 3
    if A.shape[-2:] == (4, 4):
        return as_poses(name, A), 6
    raise _wrong_shape(name, A.shape, "(..., 3, 3) or (..., 4, 4)")


def as_unit_quaternions(name: str, value: ArrayLike) -> Array:
    """Return quaternions of norm 1, shape (..., 4)."""
    q = as_finite(name, value, 4)
    with np.errstate(over="ignore"):
        norm = np.sqrt(np.vecdot(q, q))
    deviation = np.abs(norm - 1)
    wrong = deviation > REMOVED
    if wrong.any():
        raise ValueError(
            f"{first_index(name, wrong)} has the norm {norm[wrong][0]:.9g}, and 1 is wanted, up to "
            f"{REMOVED:g}; project_quaternion returns the nearest unit quaternion"
        )
    near = deviation > ACCEPTED
    q[near] /= norm[near][..., None]
    return q


def _wrong_shape(name: str, shape: tuple[int, ...], wanted: str) -> ValueError:
    """Return an error that names the function that makes matrices of arrays of this shape."""
    makers = {
        (3, 3): "pose_from_components makes poses of rotations and positions",
        (3, 4): "a pose also has the row [0, 0, 0, 1]",
        (4, 4): "",
        (3,): "exp_so3 makes rotations of rotation vectors",
        (4,): "matrix_from_quaternion makes rotations of quaternions (w, x, y, z)",
        (6,): "pose_from_coordinates makes poses of rotation vectors and positions",
        (7,): "pose_from_components makes poses of positions and of the rotations that "
        "matrix_from_quaternion makes of quaternions (w, x, y, z)",
    }
    hint = makers.get(shape[-2:], makers.get(shape[-1:]))
    cure = f"; {hint}" if hint else ""
    return ValueError(f"{name}: shape {wanted} is wanted, got {shape}{cure}")


def _repair(name: str, R: Array, kind: str, cure: str) -> None:
    """Project matrices that are nearly rotations, in place; refuse matrices that are not."""
    if R.size == 9 and _accepted(R.ravel().tolist()):  # with Python's numbers, 3 µs instead of 25
        return
    flat, off = R.reshape(-1, 3, 3), np.empty(R.shape[:-2], bool)
    for part in blocks(len(flat)):
        block = np.ascontiguousarray(flat[part].transpose(1, 2, 0))
        with np.errstate(over="ignore", invalid="ignore"):
            off.reshape(-1)[part] = ~_accepted([*block.reshape(9, -1)])
    if not off.any():
        return
    M = R[off]
    with np.errstate(over="ignore", invalid="ignore"):
        deviation, det = np.abs(M.mT @ M - np.eye(3)).max(axis=(1, 2)), np.linalg.det(M)
    wrong = ~((deviation <= REMOVED) & (det > 0))
    if wrong.any():
        i = np.argmax(wrong)
        why = f"an entry of RᵀR − I is {deviation[i]:.2g}, and {REMOVED:g} is allowed"
        if deviation[i] <= REMOVED:
            why = "its determinant is −1, as of a left-handed frame"
        off[off] = wrong
        raise ValueError(
            f"{first_index(name, off)} is not a {kind}: {why}; {cure} returns the nearest {kind}"
        )
    R[off] = nearest(M)[0]


def _accepted(R: Entries) -> Any:
    """Return whether R − cof R and det R − 1 are at most `ACCEPTED`; only rotations have zeros.

    To first order, R − cof R is 2E − tr(E) I for a matrix Q (I + E), where Q is the nearest
    rotation. Its diagonal vanishes only if E does.
    """
    C = cofactors(R)
    accepted = abs(determinant(R, C) - 1) <= ACCEPTED
    for x, c in zip(R, C, strict=True):
        accepted &= abs(x - c) <= ACCEPTED
    return accepted
