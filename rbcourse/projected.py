"""Projected curves on SO(3): the optimum among all matrices, then the nearest rotations to it."""

import math
import warnings
from collections.abc import Callable
from functools import cached_property, partial
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._numerics import EPS, Array, as_angle, as_finite, as_time, check_broadcast
from rbcourse.curves import (
    AlongGeodesic,
    BlockwiseCurve,
    Chosen,
    check_times,
    identity,
    least_over_time,
    pick,
    runs,
    start_and_rotation_vector,
    which_curve,
)
from rbcourse.line import f as rbcourse_f
from rbcourse.line import line_singular_value, theta
from rbcourse.polynomials import cubic_coefficients, polynomial, quintic_coefficients
from rbcourse.projection import gap, nearest
from rbcourse.so3 import hat_so3

Progress = Callable[[Array, int], ArrayLike]

_WHY = "the nearest rotation is not unique, the curve jumps here (see margin)"


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
        self._angle = as_angle(self._angle)
        self.margin = 2 * np.cos(self._angle / 2)
        _warn_if_nearly_singular(self.margin)
        start, end = self._line(as_time([0, 1], len(self.batch_shape)), 0, self.batch_shape)
        if np.any(np.abs(start) > 1e-12) or np.any(np.abs(end - 1) > 1e-12):
            raise ValueError(f"f: f(0) = 0 and f(1) = 1 are wanted, got {start} and {end}")

    def _pick(self, chosen: Chosen) -> Self:
        picked = super()._pick(chosen)
        picked.margin = pick(self.margin, chosen, self.batch_shape)
        if self._f is not identity:
            picked._f = partial(self._line_of, chosen)
        return picked

    def _progress_each(self, t: Array, which: Chosen, order: int) -> Array:
        if self._f is identity:
            return self._progress(t, order, self._angle[which])
        parts = [(self[curve], t[run]) for curve, run in runs(which)]
        return np.concatenate([one._progress(times, order, one._angle) for one, times in parts])

    def _line_of(self, chosen: Chosen, t: Array, order: int) -> Array:
        """Return f for the chosen curves; the times have an axis of length 1 for each of theirs."""
        times = t.shape[: t.ndim - chosen.ndim]
        t = t.reshape(times + (1,) * len(self.batch_shape))
        values = self._line(t, order, self.batch_shape)
        return pick(values, chosen, self.batch_shape, lead=len(times))

    def _line(self, t: Array, order: int, batch_shape: tuple[int, ...]) -> Array:
        name, shape = f"f(t, {order})", np.broadcast_shapes(t.shape, batch_shape)
        value = as_finite(name, self._f(t.copy(), order))
        try:
            return np.broadcast_to(value, shape)
        except ValueError as error:
            raise ValueError(f"{name}: shape {shape} wanted, got {value.shape}") from error

    def _progress(self, t: Array, order: int, angle: Array) -> Array:
        on_line = self._line(t, 0, angle.shape)
        lost = line_singular_value(on_line, angle) < 8 * EPS
        check_times(t, lost, angle.ndim, _WHY)
        if order == 0:
            return theta(on_line, angle)
        slope, speed = theta(on_line, angle, 1), self._line(t, 1, angle.shape)
        if order == 1:
            return slope * speed
        return theta(on_line, angle, 2) * speed**2 + slope * self._line(t, 2, angle.shape)


class ProjectedPolynomial(BlockwiseCurve):
    """The `Curve` of the nearest rotations to a polynomial M(t) in the space of matrices.

    Attributes
    ----------
    coefficients : ndarray, shape (degree + 1, ..., 3, 3)
        Of 1, t, t², … in M(t).
    margin : ndarray, shape (...)
        The least sum, over t, of the two smallest eigenvalues of RᵀM, R the projection of M. At 0
        the nearest rotation is not unique.
    margin_time : ndarray, shape (...)
        When that is.

    References
    ----------
    BK 6, BK 6.2.
    """

    def __init__(self, coefficients: Array) -> None:
        self.coefficients = coefficients
        self.batch_shape = coefficients.shape[1:-2]

    def _pick(self, chosen: Chosen) -> Self:
        return type(self)(pick(self.coefficients, chosen, self.batch_shape, core=2, lead=1))

    def _write_each(self, t: Array, which: Chosen, order: int, out: Array) -> None:
        """Work M out curve by curve, as matrices times powers of t, and project all of it."""
        degree, M = len(self.coefficients) - 1, np.empty((order + 1, 9, len(t)))
        units = np.eye(degree + 1)[:, :, None]
        powers = [polynomial(units, t, k) for k in range(order + 1)]
        for curve, run in runs(which):
            matrix = self.coefficients[:, curve].reshape(degree + 1, 9).T
            for k in range(order + 1):
                np.matmul(matrix, powers[k][:, run], out=M[k][:, run])
        out[...] = self._projected(list(M.reshape(-1, 3, 3, len(t))), t, order)

    def _ambient(self, t: Array) -> Array:
        return polynomial(self.coefficients, t[..., None, None])

    def _block(self, t: Array, order: int) -> Array:
        """Return what `_evaluate` does, with each component of all of it together in the memory."""
        entries = np.ascontiguousarray(np.moveaxis(self.coefficients, (-2, -1), (1, 2)))
        M = [polynomial(entries[:, :, :, None], t, k) for k in range(order + 1)]
        return self._projected(M, t, order)

    def _projected(self, M: list[Array], t: Array, order: int) -> Array:
        """Return R, w or w' of the projection of M, components first, with its derivatives."""
        R, unique = nearest(np.moveaxis(M[0], (0, 1), (-2, -1)))
        if not unique.all():
            check_times(t, ~unique, len(self.batch_shape), _WHY)
        if order == 0:
            return R
        rates = _rates(np.ascontiguousarray(np.moveaxis(R, (-2, -1), (0, 1))), *M)
        return np.moveaxis(rates[order - 1], 0, -1)

    @property
    def margin(self) -> Array:
        """The least sum of the two smallest eigenvalues of RᵀM."""
        return self._least_gap[1]

    @property
    def margin_time(self) -> Array:
        """When the margin is reached."""
        return self._least_gap[0]

    @cached_property
    def _least_gap(self) -> tuple[Array, Array]:
        return least_over_time(lambda t: gap(self._ambient(t)), self.batch_shape)

    def may_jump(self) -> bool:
        """Tell whether the gap of a curve at 65 times, if not at 9, leaves room for a 0 between."""
        may = np.ones(math.prod(self.batch_shape), bool)
        coefficients = self.coefficients.reshape(len(self.coefficients), len(may), 3, 3)
        for count in (9, 65):
            times = np.linspace(0, 1, count)[:, None, None, None]
            M = polynomial(coefficients[:, may], times)
            change = np.linalg.norm(np.diff(M, axis=0), axis=(-2, -1)).max(axis=0)
            may[may] = (gap(M) < change).any(axis=0)
        return bool(may.any())


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

    Warns
    -----
    RuntimeWarning
        If ``margin`` is below 1e-6.

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
    >>> from rbcourse import exp_so3, log_so3
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
    return ProjectedLine(*start_and_rotation_vector(R0, R1), identity if f is None else f)


def projected_cubic_so3(
    R0: ArrayLike, R1: ArrayLike, w0: ArrayLike, w1: ArrayLike
) -> ProjectedPolynomial:
    """Return the projection of the cubic with these ends: near-optimal minimum acceleration.

    Parameters
    ----------
    R0, R1 : array_like, shape (..., 3, 3)
        Rotation matrices at t = 0 and 1; what is none is not repaired (see `project_so`).
    w0, w1 : array_like, shape (..., 3)
        Angular velocities there, body frame, in rad per unit time.

    Returns
    -------
    ProjectedPolynomial
        A `Curve`: the nearest rotations to the cubic M(t) with M(0) = R0, M'(0) = R0 hat_so3(w0),
        M(1) = R1, M'(1) = R1 hat_so3(w1). It meets all four ends exactly; with ``margin``.

    Raises
    ------
    ValueError
        If an argument is not finite, not of that shape, or the batches do not broadcast. The
        curve, when called at a time whose nearest rotation is not unique, to rounding.

    Warns
    -----
    RuntimeWarning
        If ``margin`` is below 1e-6; the message names the time.

    See Also
    --------
    rbcourse.textbook.projected_cubic_so3 : The same, matrix by matrix.
    minimum_acceleration_so3 : The optimum with the same ends.
    acceleration_cost : What both cost.

    Notes
    -----
    Singular set: where the two smallest eigenvalues of RᵀM sum to 0, at some time; det M may
    change its sign before, which does no harm. A curve past such a time is returned, and is right
    on both sides; in between it jumps. Near it, where ``margin`` is small, the curve turns by up to
    π in a time of about ``margin`` over the speed of M, and is accurate to a few eps ‖M‖ over the
    sum at that time, its derivatives to that over its square and its cube.

    Moved ends give the moved curve: L R(t) Q for L R0 Q, L R1 Q, Qᵀ w0, Qᵀ w1.

    References
    ----------
    BK 6.2, BK Prop. 3; with M'(1) where the paper prints the second derivative.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> R1 = exp_so3([0, 0, 1.5])
    >>> c = projected_cubic_so3(np.eye(3), R1, [0, 0, 0], [0, 1, 0])  # from rest
    >>> c([0, 1], 1).round(12) + 0.0
    array([[0., 0., 0.],
           [0., 1., 0.]])
    >>> float(c.margin.round(3))
    1.464
    """
    R0, R1 = as_finite("R0", R0, 3, 3), as_finite("R1", R1, 3, 3)
    w0, w1 = as_finite("w0", w0, 3), as_finite("w1", w1, 3)
    check_broadcast(R0=(R0, 2), R1=(R1, 2), w0=(w0, 1), w1=(w1, 1))
    return _watched(cubic_coefficients(R0, R1, R0 @ hat_so3(w0), R1 @ hat_so3(w1)))


def projected_quintic_so3(
    R0: ArrayLike, R1: ArrayLike, w0: ArrayLike, w1: ArrayLike, a0: ArrayLike, a1: ArrayLike
) -> ProjectedPolynomial:
    """Return the projection of the quintic with these ends: near-optimal minimum jerk.

    Parameters
    ----------
    R0, R1 : array_like, shape (..., 3, 3)
        Rotation matrices at t = 0 and 1; what is none is not repaired (see `project_so`).
    w0, w1 : array_like, shape (..., 3)
        Angular velocities there, body frame, in rad per unit time.
    a0, a1 : array_like, shape (..., 3)
        Angular accelerations w' there, body frame, in rad per unit time squared.

    Returns
    -------
    ProjectedPolynomial
        A `Curve`: the nearest rotations to the quintic M(t) with the values R, first derivatives
        R ŵ and second derivatives R (ŵ² + â) at both ends. It meets all six exactly; with
        ``margin``.

    Raises
    ------
    ValueError
        As `projected_cubic_so3`.

    Warns
    -----
    RuntimeWarning
        If ``margin`` is below 1e-6; the message names the time.

    See Also
    --------
    projected_cubic_so3 : The same for minimum acceleration.

    Notes
    -----
    Singular set and invariance: as for `projected_cubic_so3`.

    References
    ----------
    BK 6, BK Prop. 3.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> rest = [0, 0, 0]
    >>> c = projected_quintic_so3(np.eye(3), exp_so3([0, 0, 1.5]), rest, rest, rest, [0, 0, 2])
    >>> c([0, 1], 2).round(12) + 0.0
    array([[0., 0., 0.],
           [0., 0., 2.]])
    """
    R0, R1 = as_finite("R0", R0, 3, 3), as_finite("R1", R1, 3, 3)
    w0, w1 = as_finite("w0", w0, 3), as_finite("w1", w1, 3)
    a0, a1 = as_finite("a0", a0, 3), as_finite("a1", a1, 3)
    check_broadcast(R0=(R0, 2), R1=(R1, 2), w0=(w0, 1), w1=(w1, 1), a0=(a0, 1), a1=(a1, 1))
    W0, W1 = hat_so3(w0), hat_so3(w1)
    ends = R0, R1, R0 @ W0, R1 @ W1, R0 @ (W0 @ W0 + hat_so3(a0)), R1 @ (W1 @ W1 + hat_so3(a1))
    return _watched(quintic_coefficients(*ends))


def _watched(coefficients: Array) -> ProjectedPolynomial:
    curve = ProjectedPolynomial(coefficients)
    if curve.may_jump():
        _warn_if_nearly_singular(curve.margin)
    return curve


def _warn_if_nearly_singular(margin: Array) -> None:
    """Warn of the first curve (of a stack) whose margin is below 1e-6."""
    low = np.argwhere(np.asarray(margin) < 1e-6)
    if len(low):
        warnings.warn(
            f"margin < 1e-6{which_curve(low[0])}: somewhere the nearest rotation is all but not "
            "unique, and the curve jumps there",
            RuntimeWarning,
            stacklevel=4,
        )


def _rates(R: Array, M: Array, M_rate: Array, M_bend: Array | None = None) -> list[Array]:
    """Return w and, if M'' is given, w' of the nearest rotations R to M; components first.

    S = RᵀM is symmetric. With A = RᵀM', differentiated, that says (tr(S) I − S) w = vee(A − Aᵀ),
    and once more (tr(S) I − S) w' = vee(A' − A'ᵀ) − (tr(S') I − S') w.
    """
    S, A = _transposed_times(R, M), _transposed_times(R, M_rate)
    w = _solve(S, _skew(A))
    if M_bend is None:
        return [w]
    S_rate = A - _cross(w, S)
    A_rate = _transposed_times(R, M_bend) - _cross(w, A)
    trace = S_rate[0, 0] + S_rate[1, 1] + S_rate[2, 2]
    spin = trace * w - (S_rate[:, 0] * w[0] + S_rate[:, 1] * w[1] + S_rate[:, 2] * w[2])
    return [w, _solve(S, _skew(A_rate) - spin)]


def _transposed_times(R: Array, M: Array) -> Array:
    """Return RᵀM; row by row, several times faster than NumPy's einsum."""
    product = np.empty_like(M)
    for i in range(3):
        np.multiply(R[0, i], M[0], out=product[i])
        product[i] += R[1, i] * M[1]
        product[i] += R[2, i] * M[2]
    return product


def _cross(w: Array, A: Array) -> Array:
    """Return ŵ A: w × each column."""
    (x, y, z), (a, b, c) = w, A
    return np.stack([y * c - z * b, z * a - x * c, x * b - y * a])


def _skew(A: Array) -> Array:
    """Return vee(A − Aᵀ)."""
    return np.stack([A[2, 1] - A[1, 2], A[0, 2] - A[2, 0], A[1, 0] - A[0, 1]])


def _solve(S: Array, b: Array) -> Array:
    """Return x with (tr(S) I − S) x = b; that matrix, L D Lᵀ, is positive definite."""
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = S
    d1 = yy + zz
    l21, l31 = -xy / d1, -xz / d1
    d2, below = xx + zz + l21 * xy, -yz + l21 * xz
    l32 = below / d2
    d3 = xx + yy + l31 * xz - l32 * below
    y2 = b[1] - l21 * b[0]
    x3 = (b[2] - l31 * b[0] - l32 * y2) / d3
    x2 = y2 / d2 - l32 * x3
    return np.stack([b[0] / d1 - l21 * x2 - l31 * x3, x2, x3])
