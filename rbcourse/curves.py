"""Curves between rotations: the geodesic, and the projection of the straight line."""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._numerics import (
    EPS,
    Array,
    as_angle,
    as_finite,
    as_time,
    check_broadcast,
    check_order,
)
from rbcourse.line import f as rbcourse_f
from rbcourse.line import line_singular_value, theta
from rbcourse.so3 import exp_so3, log_so3

Progress = Callable[[Array, int], ArrayLike]


class Curve:
    """A rotation that depends on the time t in [0, 1]; called as SciPy's splines are.

    ``c(t)`` is the rotation matrix R, ``c(t, 1)`` the angular velocity w and ``c(t, 2)`` the
    angular acceleration w', both in the body frame: R' = R hat_so3(w). The derivatives are exact.
    Times of shape ``t.shape`` and a stack of curves of shape ``(...)`` give results of shapes
    ``t.shape + (..., 3, 3)`` and ``t.shape + (..., 3)``.

    Attributes
    ----------
    batch_shape : tuple of int
        The shape of the stack; ``()`` for a single curve.

    References
    ----------
    BK (1), BK 6.
    """

    batch_shape: tuple[int, ...]

    def __call__(self, t: ArrayLike, order: int = 0) -> Array:
        """Return the curve, or a derivative, at the times t.

        Parameters
        ----------
        t : array_like
            Times in [0, 1], of any shape.
        order : {0, 1, 2}, optional
            The rotation, its angular velocity or its angular acceleration.

        Returns
        -------
        ndarray, shape t.shape + (..., 3, 3) or t.shape + (..., 3)

        Raises
        ------
        ValueError
            If a time is not finite or outside [0, 1], or `order` is another.

        Examples
        --------
        >>> c = geodesic_so3(np.eye(3), exp_so3([0, 0, 1.5]))
        >>> c(np.linspace(0, 1, 5)).shape, c(0.5, 1).shape
        ((5, 3, 3), (3,))
        """
        return self._evaluate(as_time(t, len(self.batch_shape)), check_order(order))

    def _evaluate(self, t: Array, order: int) -> Array:
        raise NotImplementedError


class AlongGeodesic(Curve):
    """The `Curve` R0 exp(σ̂ p(t)) on the geodesic from R0 to R0 exp(σ̂); here p(t) = t.

    Attributes
    ----------
    R0 : ndarray, shape (..., 3, 3)
        The start.
    rotation_vector : ndarray, shape (..., 3)
        σ, which turns R0 into the goal; body frame, in rad.

    References
    ----------
    BK 6.1.
    """

    def __init__(self, R0: Array, rotation_vector: Array) -> None:
        self.R0 = R0
        self.rotation_vector = rotation_vector
        self.batch_shape = rotation_vector.shape[:-1]

    def _progress(self, t: Array, order: int) -> Array:
        return _identity(t, order)

    def _evaluate(self, t: Array, order: int) -> Array:
        turned = self._progress(t, order)[..., None] * self.rotation_vector
        return turned if order else self.R0 @ exp_so3(turned)


class ProjectedLine(AlongGeodesic):
    """The projection of a straight line between two rotations: p(t) = θ(f(t)).

    Attributes
    ----------
    margin : ndarray, shape (...)
        The least sum, over the line, of the two smallest eigenvalues of RᵀM, M on the line and R
        its projection: 2 cos(‖σ‖/2). At 0 the projection of the middle is not unique.

    References
    ----------
    BK Prop. 6, BK (15), BK (17).
    """

    def __init__(self, R0: Array, rotation_vector: Array, f: Progress) -> None:
        super().__init__(R0, rotation_vector)
        self._f = f
        self._angle = as_angle(np.linalg.norm(rotation_vector, axis=-1))
        self.margin = 2 * np.cos(self._angle / 2)
        start, end = self._line(as_time([0, 1], len(self.batch_shape)), 0)
        if np.any(np.abs(start) > 1e-12) or np.any(np.abs(end - 1) > 1e-12):
            raise ValueError(f"f: f(0) = 0 and f(1) = 1 are wanted, got {start} and {end}")

    def _line(self, t: Array, order: int) -> Array:
        name, shape = f"f(t, {order})", np.broadcast_shapes(t.shape, self.batch_shape)
        value = as_finite(name, self._f(t.copy(), order))
        try:
            return np.broadcast_to(value, shape)
        except ValueError as error:
            raise ValueError(f"{name}: shape {shape} wanted, got {value.shape}") from error

    def _progress(self, t: Array, order: int) -> Array:
        on_line, angle = self._line(t, 0), self._angle
        self._check_unique(t, line_singular_value(on_line, angle))
        if order == 0:
            return theta(on_line, angle)
        slope, speed = theta(on_line, angle, 1), self._line(t, 1)
        if order == 1:
            return slope * speed
        return theta(on_line, angle, 2) * speed**2 + slope * self._line(t, 2)

    def _check_unique(self, t: Array, s: Array) -> None:
        lost = s < 8 * EPS
        if lost.any():
            time = np.broadcast_to(t, s.shape)[lost][0]
            pair = np.argwhere(lost)[0][lost.ndim - len(self.batch_shape) :]
            which = f" of pair {[int(i) for i in pair]}" if pair.size else ""
            raise ValueError(
                f"t = {time}: the nearest rotation to this point of the line is not unique, "
                f"R0 and R1{which} are a half-turn apart (see margin)"
            )


def geodesic_so3(R0: ArrayLike, R1: ArrayLike) -> AlongGeodesic:
    """Return the shortest curve from R0 to R1, at constant angular velocity.

    Parameters
    ----------
    R0, R1 : array_like, shape (..., 3, 3)
        Rotation matrices; what is none is not repaired (see `project_so`).

    Returns
    -------
    AlongGeodesic
        A `Curve`: R0 exp(σ̂ t) with ``rotation_vector`` σ = log_so3(R0ᵀ R1), of length ‖σ‖ ≤ π.

    Raises
    ------
    ValueError
        If an argument is not finite, not of that shape, or the batches do not broadcast.

    See Also
    --------
    projected_line_so3 : The same path by projection, at another speed.
    slerp : The same curve in quaternions.

    Notes
    -----
    Singular set: between rotations a half-turn apart two geodesics are shortest. The one about the
    axis whose component of largest magnitude (the first of equals, body frame) is positive is
    returned; read it in ``rotation_vector``. R0 = R1 gives the constant curve.

    References
    ----------
    BK 6.1.

    Examples
    --------
    >>> c = geodesic_so3(np.eye(3), exp_so3([0, 0, 1.5]))
    >>> log_so3(c([0, 0.5, 1])).round(12)
    array([[0.  , 0.  , 0.  ],
           [0.  , 0.  , 0.75],
           [0.  , 0.  , 1.5 ]])
    >>> c(0.3, 1).round(12)  # the velocity
    array([0. , 0. , 1.5])
    """
    return AlongGeodesic(*_start_and_rotation_vector(R0, R1))


def projected_line_so3(R0: ArrayLike, R1: ArrayLike, f: Progress | None = None) -> ProjectedLine:
    """Return the projection on SO(3) of the line R0 + (R1 − R0) f(t), in closed form.

    Parameters
    ----------
    R0, R1 : array_like, shape (..., 3, 3)
        Rotation matrices; what is none is not repaired (see `project_so`).
    f : callable, optional
        ``f(t, order)``, order 0, 1 or 2: how the line is run through, f(0) = 0 and f(1) = 1 to
        1e-12, and the derivatives of that. The times come with an axis of length 1 for each batch
        axis. By default f(t) = t.

    Returns
    -------
    ProjectedLine
        A `Curve`: R0 exp(σ̂ θ(f(t))), the nearest rotations to the line; with ``margin``.

    Raises
    ------
    ValueError
        If an argument is not finite, not of that shape, the batches do not broadcast, or f is no
        callable, has other ends, or is `rbcourse.f` without its angle. The curve, when called: if
        f returns what is not finite or of another shape, or at a time whose nearest rotation is
        not unique.

    See Also
    --------
    geodesic_so3 : The same path at constant speed.
    rbcourse.f : The timing that gives this speed, once its angle is set (see the example).
    project_so : The projection, for any matrix.

    Notes
    -----
    Singular set: R0 and R1 a half-turn apart. The line then runs through a matrix of rank 1, at
    f(t) = 1/2, and its projection jumps there from R0 to R1. ``margin`` is 0 to a few eps, and the
    curve raises at that time. Near it the projection is accurate to eps over the sum of the two
    smallest eigenvalues of RᵀM, which ``margin`` bounds from below.

    References
    ----------
    BK Prop. 6, BK Cor. 1, BK Cor. 2, BK (15), BK (16).

    Examples
    --------
    >>> c = projected_line_so3(np.eye(3), exp_so3([0, 0, 1.5]))
    >>> log_so3(c([0.25, 0.5, 0.75]))[:, 2].round(3)  # slow, fast, slow
    array([0.314, 0.75 , 1.186])
    >>> from rbcourse import f
    >>> c = projected_line_so3(np.eye(3), exp_so3([0, 0, 1.5]), lambda t, order: f(t, 1.5, order))
    >>> log_so3(c([0.25, 0.5, 0.75]))[:, 2].round(3)  # uniform
    array([0.375, 0.75 , 1.125])
    """
    if f is rbcourse_f:
        raise ValueError(
            "f: rbcourse.f wants its angle, lambda t, order: rbcourse.f(t, angle, order)"
        )
    if not (f is None or callable(f)):
        raise ValueError(f"f: a callable f(t, order) is wanted, got {f!r}")
    return ProjectedLine(*_start_and_rotation_vector(R0, R1), _identity if f is None else f)


def _start_and_rotation_vector(R0: ArrayLike, R1: ArrayLike) -> tuple[Array, Array]:
    R0, R1 = as_finite("R0", R0, 3, 3), as_finite("R1", R1, 3, 3)
    check_broadcast(R0=(R0, 2), R1=(R1, 2))
    return R0, log_so3(np.swapaxes(R0, -1, -2) @ R1)


def _identity(t: Array, order: int) -> Array:
    return t if order == 0 else np.full_like(t, order == 1)
