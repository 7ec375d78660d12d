"""The rotation group SO(3) and its Lie algebra so(3): hat, vee, exp, log and their Jacobians.

Parameters
----------
w : array_like, shape (..., 3)
    Rotation vectors, in rad.
W : array_like, shape (..., 3, 3)
    Matrices, of which only the skew-symmetric part matters.
R, S : array_like, shape (..., 3, 3)
    Rotation matrices.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._checks import as_finite, check_broadcast
from rbcourse._docs import described_by
from rbcourse._numerics import Array, in_blocks, sinc
from rbcourse._quaternions import axis_and_angle, quaternion_of, rotation_vector_of
from rbcourse._valid import as_rotations

BASIS_SO3 = np.array(
    [
        [[0.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]],
        [[0.0, 0.0, 1.0], [0.0, 0.0, 0.0], [-1.0, 0.0, 0.0]],
        [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]],
    ]
)
"""The standard basis of so(3), shape (3, 3, 3): turns about x, y and z (BK (2))."""
BASIS_SO3.flags.writeable = False


def hat(w: Array) -> Array:
    """Compute `hat_so3` without checks."""
    return (w @ BASIS_SO3.reshape(3, 9)).reshape(*w.shape, 3) + 0.0


def vee(W: Array) -> Array:
    """Compute `vee_so3` without checks."""
    return W.reshape(*W.shape[:-2], 9) @ (BASIS_SO3.reshape(3, 9).T / 2)


@described_by(returns="ndarray, shape (..., 3, 3)")
def hat_so3(w: ArrayLike) -> Array:
    """Return the skew-symmetric matrix of a vector: hat_so3(w) @ x = w × x.

    Source: BK 2.1, BK (2).

    Parameters
    ----------
    w : array_like, shape (..., 3)
        Vectors.

    Examples
    --------
    >>> hat_so3([1, 2, 3])
    array([[ 0., -3.,  2.],
           [ 3.,  0., -1.],
           [-2.,  1.,  0.]])
    """
    return hat(as_finite("w", w, 3))


@described_by(__doc__, returns="ndarray, shape (..., 3)")
def vee_so3(W: ArrayLike) -> Array:
    """Return the vector of the skew-symmetric part (W − Wᵀ)/2: the inverse of `hat_so3`.

    Source: BK 2.1.

    Examples
    --------
    >>> vee_so3(hat_so3([1, 2, 3]))
    array([1., 2., 3.])
    """
    return vee(as_finite("W", W, 3, 3))


@described_by(__doc__, returns="ndarray, shape (..., 3, 3)")
def exp_so3(w: ArrayLike) -> Array:
    """Return the rotation by ‖w‖ about w: I + sin a n̂ + (1 − cos a) n̂² with a = ‖w‖ and n = w/a.

    Rodrigues' formula is accurate to a few eps (1 + a). The result is a rotation for every a, but
    for a > 1/eps, no digit is significant. There is no singular set; w = 0 gives I exactly.
    Source: BK 2.5.

    Examples
    --------
    >>> exp_so3([0, 0, np.pi / 2]).round(12) + 0.0
    array([[ 0., -1.,  0.],
           [ 1.,  0.,  0.],
           [ 0.,  0.,  1.]])
    """
    return in_blocks(_exp, as_finite("w", w, 3), 3)


def _exp(w: Array) -> Array:
    n, a = axis_and_angle(w)
    return _quadratic(np.sin(a) * n, n, 2 * np.sin(a / 2) ** 2)


@described_by(__doc__, returns="ndarray, shape (..., 3)")
def log_so3(R: ArrayLike) -> Array:
    """Return the shortest rotation vector w of R: exp_so3(w) = R and ‖w‖ ≤ π, up to rounding.

    The result is accurate to a few eps. Singular set: half-turns (up to 8 eps in the angle), where
    w and −w are equally short. The sign is then chosen so that the component of largest magnitude
    is positive (see `canonical_quaternion`).
    Source: BK 2.5.

    Examples
    --------
    >>> log_so3([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    array([0.        , 0.        , 1.57079633])
    """
    return log(as_rotations("R", R))


def log(R: Array) -> Array:
    """Compute `log_so3` without checks."""
    return rotation_vector_of(quaternion_of(R))


@described_by(__doc__, returns="ndarray, shape (...)")
def angle_between(R: ArrayLike, S: ArrayLike) -> Array:
    """Return the angle of the rotation from R to S: the geodesic distance ‖log_so3(Rᵀ S)‖.

    The angles are in [0, π], accurate to a few eps.
    Source: BK 6.1.

    Examples
    --------
    >>> float(angle_between(np.eye(3), exp_so3([0, 0.3, 0.4])).round(12))
    0.5
    """
    R, S = as_rotations("R", R), as_rotations("S", S)
    check_broadcast(R=(R, 2), S=(S, 2))
    return np.linalg.norm(log(np.swapaxes(R, -1, -2) @ S), axis=-1)


@described_by(__doc__, returns="ndarray, shape (..., 3, 3)")
def right_jacobian_so3(w: ArrayLike) -> Array:
    """Return the matrix J for which J w' is the body angular velocity along exp_so3(w(t)).

    The transpose of J is the left Jacobian, which gives the angular velocity in the fixed frame.
    J is I − (1 − cos a)/a n̂ + (1 − sin a/a) n̂² with a = ‖w‖ and n = w/a, accurate to a few eps.
    Singular set: J is smooth, but has rank 1 if ‖w‖ = 2π, 4π, …
    Source: BK 2.5.

    Examples
    --------
    >>> right_jacobian_so3([0, 0, 1]) @ [0, 0, 5]  # a vector along the axis is unchanged
    array([0., 0., 5.])
    """
    n, a = axis_and_angle(as_finite("w", w, 3))
    return _quadratic(-np.sin(a / 2) * sinc(a / 2) * n, n, 1 - sinc(a))


@described_by(__doc__, returns="ndarray, shape (..., 3, 3)")
def right_jacobian_inverse_so3(w: ArrayLike) -> Array:
    """Return the inverse of `right_jacobian_so3`, which maps body angular velocities to w'.

    Singular set: ‖w‖ = 2π, 4π, …. J then has no inverse, and the result is finite and huge. Near
    this set, the entries are inversely proportional to the distance from it. The result is I + ŵ/2
    + (1 − (a/2) cot(a/2)) n̂² with a = ‖w‖ and n = w/a.
    Source: BK 2.5.

    Examples
    --------
    >>> w = [0.3, -0.4, 1.2]
    >>> bool(np.allclose(right_jacobian_inverse_so3(w) @ right_jacobian_so3(w), np.eye(3)))
    True
    """
    w = as_finite("w", w, 3)
    n, a = axis_and_angle(w)
    return _quadratic(w / 2, n, 1 - np.cos(a / 2) / sinc(a / 2))


def _quadratic(u: Array, n: Array, c: Array) -> Array:
    """Return I + û + c n̂², shape (..., 3, 3), for vectors u and n; c has the shape (..., 1)."""
    (u, v, w), (x, y, z), (c,) = u.T, n.T, c.T  # in these and in R.T, the batch axes are reversed
    cx, cy, cz = c * x, c * y, c * z
    R = np.empty((*n.shape, 3))
    R.T[...] = (  # the columns of R
        (1 - (cz * z + cy * y), cx * y + w, cx * z - v),
        (cy * x - w, 1 - (cz * z + cx * x), cy * z + u),
        (cz * x + v, cz * y - u, 1 - (cy * y + cx * x)),
    )
    R += 0.0  # changes −0 to 0
    return R
