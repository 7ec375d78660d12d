"""Motions of a rigid body: a rotation curve and a path of the origin, each on its own."""

import math
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._numerics import Array, as_finite, check_broadcast
from rbcourse.curves import Chosen, Curve, geodesic_so3, pick
from rbcourse.polynomials import cubic_coefficients, polynomial
from rbcourse.projected import ProjectedPolynomial, projected_cubic_so3


class RigidMotion(Curve):
    """The `Curve` on SE(3) of a rotation R(t) and a polynomial path d(t) of the origin.

    Attributes
    ----------
    rotation : Curve
        R(t), on SO(3).
    coefficients : ndarray, shape (degree + 1, ..., 3)
        Of 1, t, t², … in d(t): in m, fixed frame.

    References
    ----------
    BK 6.3.
    """

    def __init__(self, rotation: Curve, coefficients: Array) -> None:
        self.rotation = rotation
        self.coefficients = coefficients
        self.batch_shape = np.broadcast_shapes(rotation.batch_shape, coefficients.shape[1:-1])

    def _pick(self, chosen: Chosen) -> Self:
        of_rotation = self._of_rotation(chosen)
        path = pick(self.coefficients, chosen, self.batch_shape, core=1, lead=1)
        return type(self)(self.rotation._pick(of_rotation), path)

    def _of_rotation(self, chosen: Chosen) -> Chosen:
        """Return the numbers of the rotations of the chosen motions."""
        own = self.rotation.batch_shape
        return pick(np.arange(math.prod(own)).reshape(own), chosen, self.batch_shape)

    def _evaluate(self, t: Array, order: int) -> Array:
        rotation = [self.rotation._evaluate(t, k) for k in sorted({0, order})]
        return _joined(rotation, polynomial(self.coefficients, t[..., None], order))

    def _write_each(self, t: Array, which: Chosen, order: int, out: Array) -> None:
        rotation = [np.empty((len(t), *((3,) if k else (3, 3)))) for k in sorted({0, order})]
        for k, values in zip(sorted({0, order}), rotation, strict=True):
            if self.rotation.batch_shape:
                self.rotation._write_each(t, self._of_rotation(which), k, values)
            else:
                values[...] = self.rotation._evaluate(t, k)
        path = pick(self.coefficients, which, self.batch_shape, core=1, lead=1)
        out[...] = _joined(rotation, polynomial(path, t[..., None], order))


def _joined(rotation: list[Array], d: Array) -> Array:
    """Return poses from R and d; or twists, or accelerations, from R, that of R, and that of d."""
    R, *turning = rotation
    batch = np.broadcast_shapes(R.shape[:-2], d.shape[:-1])
    if turning:
        in_body = (np.swapaxes(R, -1, -2) @ d[..., None])[..., 0]
        return np.concatenate([np.broadcast_to(turning[0], (*batch, 3)), in_body], axis=-1)
    A = np.zeros((*batch, 4, 4))
    A[..., :3, :3], A[..., :3, 3], A[..., 3, 3] = R, d, 1
    return A


class ProjectedMotion(RigidMotion):
    """The `RigidMotion` whose rotation is a `ProjectedPolynomial`."""

    rotation: ProjectedPolynomial

    @property
    def margin(self) -> Array:
        """The margin of the rotation."""
        return self.rotation.margin


def geodesic_se3(A0: ArrayLike, A1: ArrayLike) -> RigidMotion:
    """Return the shortest curve from A0 to A1 in metric (14): turn and straight line at once.

    Parameters
    ----------
    A0, A1 : array_like, shape (..., 4, 4)
        Poses; what is none is not repaired (see `project_se`), and the last row is not read.

    Returns
    -------
    RigidMotion
        A `Curve`: its ``rotation`` is `geodesic_so3`, the origin moves on a straight line at
        constant speed. The angular velocity is constant, and so is d', but not v = Rᵀ d'.

    Raises
    ------
    ValueError
        If an argument is not finite, not of that shape, or the batches do not broadcast.

    See Also
    --------
    screw_se3 : The other natural motion, a geodesic of another metric.

    Notes
    -----
    Singular set: half-turns, as for `geodesic_so3`.

    References
    ----------
    BK 2.6, BK (14).

    Examples
    --------
    >>> from rbcourse import pose_from_coordinates
    >>> A1 = pose_from_coordinates([0, 0, np.pi / 2, 2, 4, 0])
    >>> geodesic_se3(np.eye(4), A1)(0.5).round(3)[:3] + 0.0
    array([[ 0.707, -0.707,  0.   ,  1.   ],
           [ 0.707,  0.707,  0.   ,  2.   ],
           [ 0.   ,  0.   ,  1.   ,  0.   ]])
    """
    A0, A1 = as_finite("A0", A0, 4, 4), as_finite("A1", A1, 4, 4)
    check_broadcast(A0=(A0, 2), A1=(A1, 2))
    d0, d1 = A0[..., :3, 3], A1[..., :3, 3]
    line = np.stack(np.broadcast_arrays(d0, d1 - d0))
    return RigidMotion(geodesic_so3(A0[..., :3, :3], A1[..., :3, :3]), line)


def projected_cubic_se3(
    A0: ArrayLike,
    A1: ArrayLike,
    w0: ArrayLike,
    w1: ArrayLike,
    d0_dot: ArrayLike,
    d1_dot: ArrayLike,
) -> ProjectedMotion:
    """Return the near-optimal minimum-acceleration motion: projected cubic, and a cubic in R³.

    Parameters
    ----------
    A0, A1 : array_like, shape (..., 4, 4)
        Poses at t = 0 and 1; what is none is not repaired (see `project_se`), and the last row is
        not read.
    w0, w1 : array_like, shape (..., 3)
        Angular velocities there, body frame, in rad per unit time.
    d0_dot, d1_dot : array_like, shape (..., 3)
        Velocities of the origin there, *fixed* frame, in m per unit time.

    Returns
    -------
    ProjectedMotion
        A `Curve`: its ``rotation`` is `projected_cubic_so3`, with its ``margin``; the path of the
        origin is the optimum.

    Raises
    ------
    ValueError
        If an argument is not finite, not of that shape, or the batches do not broadcast; and as
        `projected_cubic_so3`.

    Warns
    -----
    RuntimeWarning
        If ``margin`` is below 1e-6.

    See Also
    --------
    minimum_acceleration_se3 : The optimum with the same ends.

    Notes
    -----
    Singular set: as for `projected_cubic_so3`.

    References
    ----------
    BK 6.3, BK Prop. 5.

    Examples
    --------
    >>> from rbcourse import pose_from_coordinates
    >>> A1, rest = pose_from_coordinates([0, 0, 1, 2, 0, 0]), [0, 0, 0]
    >>> c = projected_cubic_se3(np.eye(4), A1, rest, rest, rest, rest)  # from rest to rest
    >>> c([0, 0.5, 1], 1).round(3)[:, [2, 3, 4]] + 0.0  # turn, forward, to the left
    array([[ 0.   ,  0.   ,  0.   ],
           [ 1.639,  2.633, -1.438],
           [ 0.   ,  0.   ,  0.   ]])
    """
    R0, R1, path = cubic_ends(A0, A1, w0, w1, d0_dot, d1_dot)
    return ProjectedMotion(projected_cubic_so3(R0, R1, w0, w1), path)


def cubic_ends(
    A0: ArrayLike,
    A1: ArrayLike,
    w0: ArrayLike,
    w1: ArrayLike,
    d0_dot: ArrayLike,
    d1_dot: ArrayLike,
) -> tuple[Array, Array, Array]:
    """Return the rotations of the ends and the cubic path of the origin between them.

    Raises
    ------
    ValueError
        If an argument is not finite, not of its shape, or the batches do not broadcast.
    """
    A0, A1 = as_finite("A0", A0, 4, 4), as_finite("A1", A1, 4, 4)
    w0, w1 = as_finite("w0", w0, 3), as_finite("w1", w1, 3)
    v0, v1 = as_finite("d0_dot", d0_dot, 3), as_finite("d1_dot", d1_dot, 3)
    check_broadcast(A0=(A0, 2), A1=(A1, 2), w0=(w0, 1), w1=(w1, 1), d0_dot=(v0, 1), d1_dot=(v1, 1))
    path = cubic_coefficients(A0[..., :3, 3], A1[..., :3, 3], v0, v1)
    return A0[..., :3, :3], A1[..., :3, :3], path
