"""Problem set 2: what is asked of rotations, and of the nearest one, and what goes wrong."""

from functools import partial

import numpy as np

from rbclassroom.assignments.marking import IN_RADIANS, Drawing, Mistake, Problem
from rbcourse import (
    Array,
    distance_to_so,
    exp_so3,
    hat_so3,
    matrix_from_zyx,
    orthonormalize_gram_schmidt,
    project_so,
)

X, Y, Z = np.eye(3)


def _unit(axis: Array) -> Array:
    return axis / np.linalg.norm(axis)


def _sum(axis: Array, angle: float, identity: float, outer: float) -> Array:
    """Return the sum of Rodrigues' three terms, the first and the last with factors."""
    n = _unit(axis)
    return identity * np.eye(3) + np.sin(angle) * hat_so3(n) + outer * np.outer(n, n)


TURN_ABOUT = Problem(
    answer=lambda axis, angle: exp_so3(angle * _unit(axis)),
    inputs=[
        (np.array([0.0, 0.0, 1.0]), 0.5),
        (np.array([1.0, -2.0, 2.0]), 1.2),
        (np.array([0.3, 0.4, 0.0]), -2.5),
    ],
    mistakes=[
        Mistake(
            "The turn goes the wrong way: your matrix is the transpose. Check the signs of n̂: its "
            "product with x is n × x.",
            lambda axis, angle: exp_so3(-angle * _unit(axis)),
        ),
        Mistake(
            IN_RADIANS,
            lambda axis, angle: exp_so3(np.radians(angle) * _unit(axis)),
            lambda axis, angle: exp_so3(np.degrees(angle) * _unit(axis)),
        ),
        Mistake(
            "The axis need not have the length 1. Only its direction counts: divide by its length.",
            lambda axis, angle: (
                np.eye(3)
                + np.sin(angle) * hat_so3(axis)
                + (1 - np.cos(angle)) * hat_so3(axis) @ hat_so3(axis)
            ),
            lambda axis, angle: (
                np.cos(angle) * np.eye(3)
                + np.sin(angle) * hat_so3(axis)
                + (1 - np.cos(angle)) * np.outer(axis, axis)
            ),
            lambda axis, angle: exp_so3(angle * axis),
        ),
        Mistake(
            "A term is missing: what lies along the axis should stay as it is, and does not.",
            lambda axis, angle: _sum(axis, angle, np.cos(angle), 0),
        ),
        Mistake(
            "Two forms of the formula are mixed: I goes with (1 − cos a) n̂², cos a · I with "
            "(1 − cos a) n nᵀ.",
            lambda axis, angle: _sum(axis, angle, 1, 1 - np.cos(angle)),
            lambda axis, angle: (
                np.cos(angle) * np.eye(3)
                + np.sin(angle) * hat_so3(_unit(axis))
                + (1 - np.cos(angle)) * hat_so3(_unit(axis)) @ hat_so3(_unit(axis))
            ),
        ),
        Mistake(
            "The last term has n̂², the product of n̂ with itself.",
            lambda axis, angle: (
                np.eye(3) + (np.sin(angle) + 1 - np.cos(angle)) * hat_so3(_unit(axis))
            ),
            lambda axis, angle: (
                np.eye(3)
                + np.sin(angle) * hat_so3(_unit(axis))
                + (1 - np.cos(angle)) * hat_so3(_unit(axis)) ** 2
            ),
        ),
        Mistake(
            "Sine and cosine are exchanged: for the angle 0 the result should be I.",
            lambda axis, angle: (
                np.eye(3)
                + np.cos(angle) * hat_so3(_unit(axis))
                + (1 - np.sin(angle)) * hat_so3(_unit(axis)) @ hat_so3(_unit(axis))
            ),
        ),
        Mistake(
            "The sign of the last term is wrong: it is (1 − cos a), which is never negative.",
            lambda axis, angle: _sum(axis, angle, np.cos(angle), np.cos(angle) - 1),
            lambda axis, angle: (
                np.eye(3)
                + np.sin(angle) * hat_so3(_unit(axis))
                - (1 - np.cos(angle)) * hat_so3(_unit(axis)) @ hat_so3(_unit(axis))
            ),
        ),
    ],
)


def _factors(yaw: float, pitch: float, roll: float) -> tuple[Array, Array, Array]:
    return exp_so3(yaw * Z), exp_so3(pitch * Y), exp_so3(roll * X)


FROM_ANGLES = Problem(
    answer=lambda yaw, pitch, roll: matrix_from_zyx([yaw, pitch, roll]),
    inputs=[(0.7, -0.4, 1.1), (-2.0, 0.9, 0.3)],
    mistakes=[
        Mistake(
            "The order is Rz Ry Rx, from left to right; yours is Rx Ry Rz.",
            lambda yaw, pitch, roll: np.linalg.multi_dot(_factors(yaw, pitch, roll)[::-1]),
        ),
        Mistake(
            "Yaw and roll are exchanged: yaw is the turn about z, roll that about x.",
            lambda yaw, pitch, roll: matrix_from_zyx([roll, pitch, yaw]),
        ),
        Mistake(
            "Each of your three turns goes the wrong way: they are transposed.",
            lambda yaw, pitch, roll: matrix_from_zyx([-yaw, -pitch, -roll]),
        ),
        Mistake(
            "The turn about y goes the wrong way. It carries z to x: the minus stands at the lower "
            "left.",
            lambda yaw, pitch, roll: matrix_from_zyx([yaw, -pitch, roll]),
        ),
        Mistake(
            "The result is transposed.",
            lambda yaw, pitch, roll: matrix_from_zyx([yaw, pitch, roll]).T,
        ),
        Mistake(
            "These are sums or products of entries. Turns are joined by the product of matrices: "
            "A @ B, not A * B.",
            lambda yaw, pitch, roll: np.prod(_factors(yaw, pitch, roll), axis=0),
            lambda yaw, pitch, roll: np.sum(_factors(yaw, pitch, roll), axis=0),
        ),
        Mistake(
            IN_RADIANS,
            lambda yaw, pitch, roll: matrix_from_zyx(np.radians([yaw, pitch, roll])),
            lambda yaw, pitch, roll: matrix_from_zyx(np.degrees([yaw, pitch, roll])),
        ),
    ],
)

_R = exp_so3([0.3, -0.8, 0.5])

TURN_ON = Problem(
    answer=lambda R, angle: R @ exp_so3(angle * X),
    inputs=[(_R, 0.6), (exp_so3([-1.0, 0.2, 2.0]), -1.4)],
    mistakes=[
        Mistake(
            "This turns about the x axis of the room. On which side of the product stands what "
            "happens in the body's frame?",
            lambda R, angle: exp_so3(angle * X) @ R,
        ),
        Mistake(
            "This turns about the right axis the wrong way.",
            lambda R, angle: R @ exp_so3(-angle * X),
        ),
        Mistake(
            "This is the further turn alone. Where the body was before is lost: multiply by R.",
            lambda R, angle: exp_so3(angle * X),
        ),
        Mistake(
            "R Rx Rᵀ is the further turn alone, as the room sees it. Where the body was before is "
            "lost.",
            lambda R, angle: R @ exp_so3(angle * X) @ R.T,
        ),
        Mistake(
            "This is the transpose of what is wanted.",
            lambda R, angle: (R @ exp_so3(angle * X)).T,
        ),
        Mistake(
            IN_RADIANS,
            lambda R, angle: R @ exp_so3(np.radians(angle) * X),
            lambda R, angle: R @ exp_so3(np.degrees(angle) * X),
        ),
    ],
)

_MATRICES = [
    np.array([[1.0, 0.2, -0.1], [0.1, 0.9, 0.3], [0.2, -0.2, 1.2]]),
    np.array([[0.5, -2.0, 0.3], [1.0, 0.4, 0.8], [-0.6, 0.7, 1.5]]),
    np.array([[0.2, 1.0, 0.3], [1.1, -0.3, 0.4], [0.5, 0.2, 0.9]]),  # the last two: det < 0
    np.array([[-1.2, 0.4, -0.6], [0.3, 0.8, 0.9], [0.2, -1.1, 0.7]]),
]


def _svd(M: Array) -> tuple[Array, Array, Array]:
    return np.linalg.svd(M)


def _signed(M: Array, *where: int) -> Array:
    """Return U D Vᵀ with the determinant's sign at some places of D."""
    U, _, Vt = _svd(M)
    D = np.ones(3)
    D[list(where)] = np.linalg.det(U @ Vt)
    return U @ np.diag(D) @ Vt


def _turned_round(axis: int, k: int, M: Array) -> Array:
    """Return U Vᵀ with a row or column of it turned round where its determinant is negative."""
    R = _signed(M)
    signs = np.where(np.arange(3) == k, np.linalg.det(R), 1)
    return R * np.expand_dims(signs, axis)


NEAREST = Problem(
    answer=lambda M: project_so(M),
    inputs=[(M,) for M in _MATRICES],
    mistakes=[
        Mistake(
            "For some matrices this has the determinant −1: a mirror, not a rotation. U Vᵀ is what "
            "the paper prints; something is missing where det M < 0.",
            lambda M: _signed(M),
        ),
        Mistake(
            "np.linalg.svd returns U, the singular values, and Vᵀ: the last is transposed already.",
            lambda M: _svd(M)[0] @ _svd(M)[2].T,
            lambda M: (
                _svd(M)[0]
                @ np.diag([1, 1, np.linalg.det(_svd(M)[0] @ _svd(M)[2].T)])
                @ _svd(M)[2].T
            ),
        ),
        Mistake(
            "It is a rotation, but not the nearest: turn the direction round that belongs to the "
            "smallest singular value, which costs the least. It comes last.",
            lambda M: _signed(M, 0),
            lambda M: _signed(M, 1),
            *(partial(_turned_round, axis, k) for axis in (0, 1) for k in range(3)),
        ),
        Mistake(
            "You change a sign also where none is to be changed: where the determinant of U Vᵀ is "
            "1, this is a mirror.",
            lambda M: _svd(M)[0] @ np.diag([1, 1, -1]) @ _svd(M)[2],
        ),
        Mistake(
            "This is M itself again: leave the singular values out.",
            lambda M: M,
        ),
        Mistake(
            "Only the lengths of the columns are repaired. They also have to be at right angles.",
            lambda M: M / np.linalg.norm(M, axis=0),
        ),
        Mistake(
            "It is a rotation, but far away: you change all signs where the determinant is "
            "negative. One is enough.",
            lambda M: _signed(M, 0, 1, 2),
        ),
        Mistake(
            "This is Gram and Schmidt's, which is not the nearest rotation: it trusts the first "
            "column more than the others. Use the SVD.",
            lambda M: np.linalg.qr(M)[0] * np.sign(np.diag(np.linalg.qr(M)[1])),
            lambda M: np.linalg.qr(M)[0],
            lambda M: orthonormalize_gram_schmidt(M),
            lambda M: orthonormalize_gram_schmidt(M) * [1, 1, np.sign(np.linalg.det(M))],
        ),
        Mistake(
            "This is the transpose of the nearest rotation: U comes first.",
            lambda M: project_so(M).T,
        ),
        Mistake(
            "This only scales M, so that its determinant is 1. Its columns are no unit vectors.",
            lambda M: M / np.cbrt(np.linalg.det(M)),
        ),
    ],
)


def _off(M: Array, sign: bool = True) -> Array:
    sigma = _svd(M)[1] * [1, 1, np.sign(np.linalg.det(M)) if sign else 1]
    return sigma - 1


HOW_FAR = Problem(
    answer=lambda M: distance_to_so(M),
    inputs=[(M,) for M in _MATRICES],
    mistakes=[
        Mistake(
            "This is the square of the distance: the root is missing.",
            lambda M: distance_to_so(M) ** 2,
        ),
        Mistake(
            "This is what the paper prints. Two things are missing: the root, and a sign at the "
            "last singular value where det M < 0.",
            lambda M: np.sum(_off(M, sign=False) ** 2),
        ),
        Mistake(
            "Where det M < 0 this is the distance to a mirror, which is nearer. For a rotation the "
            "last singular value counts with a minus.",
            lambda M: np.linalg.norm(_off(M, sign=False)),
        ),
        Mistake(
            "The minus where det M < 0 belongs to the last singular value, which is the smallest.",
            lambda M: np.linalg.norm(_svd(M)[1] * [np.sign(np.linalg.det(M)), 1, 1] - 1),
        ),
        Mistake(
            "This measures how far MᵀM is from I: 0 for a rotation, but no distance to one.",
            lambda M: np.linalg.norm(M.T @ M - np.eye(3)),
        ),
        Mistake(
            "This adds the singular values' differences from 1 as they are. Their squares are to "
            "be added, and the root taken of the sum.",
            lambda M: np.abs(_off(M)).sum(),
            lambda M: _off(M).sum(),
        ),
        Mistake(
            "This is only the largest difference, the spectral norm. All entries count.",
            lambda M: np.abs(_off(M)).max(),
        ),
        Mistake(
            "This is the distance to I. The nearest rotation is another one.",
            lambda M: np.linalg.norm(M - np.eye(3)),
        ),
    ],
)


def _line(R: Array, t: Array) -> Array:
    return np.eye(3) + t[:, None, None] * (R - np.eye(3))


_T = np.linspace(0, 1, 21)

DRAW_DISTANCE = Drawing(
    answer=lambda R, t: [np.column_stack([t, distance_to_so(_line(R, t))])],
    inputs=[(exp_so3([0.0, 0.0, 2.0]), _T), (_R, _T)],
    mistakes=[
        Mistake(
            "x and y are swapped: t belongs on the x axis.",
            lambda R, t: [np.column_stack([distance_to_so(_line(R, t)), t])],
        ),
        Mistake(
            "These are the squares of the distances.",
            lambda R, t: [np.column_stack([t, distance_to_so(_line(R, t)) ** 2])],
        ),
        Mistake(
            "This is the distance from I. That from the nearest rotation is asked for, which is "
            "another one at each t.",
            lambda R, t: [np.column_stack([t, t * np.linalg.norm(R - np.eye(3))])],
        ),
        Mistake(
            "This is the distance from R. That from the nearest rotation is asked for, which is "
            "another one at each t.",
            lambda R, t: [np.column_stack([t, (1 - t) * np.linalg.norm(R - np.eye(3))])],
        ),
        Mistake(
            "Only the numbers of the points stand on the x axis. Hand t to plot as well.",
            lambda R, t: [np.column_stack([np.arange(len(t)), distance_to_so(_line(R, t))])],
        ),
    ],
)
