"""Cubic and quintic polynomials through given ends, and their projections on SO(3)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._checks import as_finite, check_broadcast, check_order
from rbcourse._numerics import Array
from rbcourse.curves import (
    Chosen,
    Curve,
    Ends,
    events_of,
    has_long_runs,
    least_over_time,
    runs,
    with_inertia,
)
from rbcourse.metrics import weight_of
from rbcourse.projection import NOT_UNIQUE, gap, nearest, warn_if_nearly_singular
from rbcourse.so3 import hat


class ProjectedPolynomial(Curve):
    """The `Curve` of the nearest rotations to a polynomial M(t) in the space of matrices.

    Attributes
    ----------
    ends : ndarray, shape (n, ..., 3, 3)
        M(0), M(1), M'(0), M'(1), and for a quintic M''(0), M''(1). With a weight, all times W.
    margin : ndarray, shape (...)
        The least sum, over t, of the two smallest eigenvalues of RᵀM, R the projection of M: how
        far the curve stays from where the nearest rotation is not unique. A small margin is a sign
        of a poor cubic: of 4,000 random ones (‖σ‖ < 3, ‖w0‖, ‖w1‖ < 9) those with less than 0.7
        cost about four times the optimum or more. A large one certifies nothing: BK Figure 5 has
        1.75 of at most 2 and costs 1.77 times the optimum, and others with more than 1.9 cost up to
        some 40 times. A fifth of these cubics have det M < 0 at some time: they are defined and
        smooth, and expensive, in the median about 100 times the optimum, the others 2.2 times.
    margin_time : ndarray, shape (...)
        When that is.

    References
    ----------
    BK 6, BK 6.2.
    """

    per_curve: ClassVar[dict[str, int]] = {"ends": 1}

    def __init__(self, *ends: Array) -> None:
        self.ends = np.stack(np.broadcast_arrays(*ends))
        self.batch_shape = self.ends.shape[1:-2]

    def _at(self, t: Array, which: Chosen, order: int, out: Array) -> None:
        """Write R, w, w' or w'' of the projection of M; its arrays have their components first."""
        M = [hermite_stack(self._entries, t, which, k) for k in range(order + 1)]
        R, unique = nearest(np.moveaxis(M[0], (0, 1), (-2, -1)))
        self._check_defined(t, which, ~unique, NOT_UNIQUE)
        if order == 0:
            out[...] = R
        else:
            R = np.ascontiguousarray(np.moveaxis(R, (-2, -1), (0, 1)))
            out[...] = np.moveaxis(_rates(R, *M)[order - 1], 0, -1)

    @cached_property
    def _entries(self) -> Array:
        """The terms, shape (n + 1, 3, 3, count)."""
        return stack_terms(self._flat(self.ends, 1))

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
        def gap_at(t: Array) -> Array:
            return gap(hermite(self.ends, t[..., None, None]))

        return least_over_time(gap_at, self.batch_shape)

    def may_jump(self) -> bool:
        """Tell whether the gap at 65 times, if not at 9, leaves room for a zero in between."""
        may = np.ones(self.count, bool)
        ends = self._flat(self.ends, 1)
        for count in (9, 65):
            times = np.linspace(0, 1, count)[:, None, None, None]
            M = hermite(ends[:, may], times)
            change = np.linalg.norm(np.diff(M, axis=0), axis=(-2, -1)).max(axis=0)
            may[may] = (gap(M) < change).any(axis=0)
        return bool(may.any())

    def _events(self) -> list[tuple[float, float]]:
        return events_of(self.margin_time, self.margin)


def projected_cubic_so3(
    R0: ArrayLike, R1: ArrayLike, w0: ArrayLike, w1: ArrayLike
) -> ProjectedPolynomial:
    """Return the projection of the cubic with these ends: near-optimal minimum acceleration.

    Parameters
    ----------
    R0, R1 : array_like, shape (..., 3, 3)
        Rotation matrices at t = 0 and 1. Validity is not checked; see `project_so`.
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
        From the curve, when called at a time whose nearest rotation is not unique, to rounding.

    Warns
    -----
    RuntimeWarning
        If ``margin`` is below 1e-6; the message names the time.

    See Also
    --------
    rbcourse.textbook.projected_cubic_so3 : The same, matrix by matrix.
    minimum_acceleration_so3 : The optimum with the same ends.
    weighted_cubic_so3 : For the inertia of another body than a ball.
    acceleration_cost : What both cost.
    retime : From [0, 1] to T seconds.

    Notes
    -----
    Singular set: where the two smallest eigenvalues of RᵀM sum to 0, at some time. A curve past
    such a time is returned, and is right on both sides; in between it jumps. Near it, where
    ``margin`` is small, the curve turns by up to π in a time of about ``margin`` over the speed of
    M, and is accurate to a few eps ‖M‖ over the sum at that time, its derivatives to that over its
    square and its cube.

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
    return watched(projected_cubic(Ends(R0, R1, w0, w1)))


def weighted_cubic_so3(
    R0: ArrayLike, R1: ArrayLike, w0: ArrayLike, w1: ArrayLike, inertia: ArrayLike
) -> ProjectedPolynomial:
    """Return the projection of the cubic with these ends in the metric of a body's inertia.

    Parameters
    ----------
    R0, R1 : array_like, shape (..., 3, 3)
        Rotation matrices at t = 0 and 1. Validity is not checked; see `project_so`.
    w0, w1 : array_like, shape (..., 3)
        Angular velocities there, body frame, in rad per unit time.
    inertia : array_like, shape (..., 3, 3)
        G, body frame: symmetric and positive definite, and of a body: each principal moment is at
        most the sum of the other two.

    Returns
    -------
    ProjectedPolynomial
        A `Curve`: `project_so_weighted` of the cubic of `projected_cubic_so3`, with the weight W
        that belongs to G, `weight_from_inertia`. It meets all four ends; with ``margin``, of M W
        with W of trace 3.

    Raises
    ------
    ValueError
        As `projected_cubic_so3`; if `inertia` is not symmetric and positive definite; or if it
        belongs to no body, so that there is no W.

    Warns
    -----
    RuntimeWarning
        If ``margin`` is below 1e-6; the message names the time.

    See Also
    --------
    minimum_acceleration_so3 : The optimum, for any inertia.
    normal_cubic_so3 : Another closed form, which needs no W.
    acceleration_cost : What they cost.

    Notes
    -----
    Near-optimal for small excursions: data s times as large have a relative excess over the
    optimum about s⁴ times as large, where that of `projected_cubic_so3` is s² times as large. For
    large ones it may be far from it, as `projected_cubic_so3` is.

    Singular set: as for `projected_cubic_so3`, of M W. With G a multiple of I it is that curve.

    Moved ends give the moved curve: L R(t) Q for L R0 Q, L R1 Q, Qᵀ w0, Qᵀ w1 and Qᵀ G Q.

    References
    ----------
    BK 6.2, BK Prop. 3; beyond BK 6: the paper leaves such metrics to a later publication.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> R1, rest, book = exp_so3([0.5, 0.3, 0]), [0, 0, 0], np.diag([1.0, 2.22, 3.18])
    >>> c = weighted_cubic_so3(np.eye(3), R1, rest, [0, 1, 0], book)
    >>> c([0, 1], 1).round(12) + 0.0
    array([[0., 0., 0.],
           [0., 1., 0.]])
    """
    return watched(weighted_cubic(*with_inertia(Ends(R0, R1, w0, w1), inertia)))


def projected_quintic_so3(
    R0: ArrayLike, R1: ArrayLike, w0: ArrayLike, w1: ArrayLike, a0: ArrayLike, a1: ArrayLike
) -> ProjectedPolynomial:
    """Return the projection of the quintic with these ends: a curve with given accelerations.

    Parameters
    ----------
    R0, R1 : array_like, shape (..., 3, 3)
        Rotation matrices at t = 0 and 1. Validity is not checked; see `project_so`.
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
    projected_cubic_so3 : The projection of a cubic, for given velocities only.
    exponential_quintic_so3 : What is near the curve of least jerk.
    minimum_jerk_so3 : That curve.
    retime : From [0, 1] to T seconds.

    Notes
    -----
    The curve is in general not near the one of least jerk. From rest to rest, where the geodesic at
    the pace of the quintic has the least `jerk_cost`, it has 1.002 times that for a turn by 20°,
    1.17 times for 60°, 2.3 times for 90°, 11.6 times for 120° and 448 times for the 153° of BK
    Figure 5.

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
    ends, a0, a1 = check_ends_of_quintic(R0, R1, w0, w1, a0, a1)
    (R0, R1, w0, w1), W0, W1 = ends, hat(ends.w0), hat(ends.w1)
    curvatures = R0 @ (W0 @ W0 + hat(a0)), R1 @ (W1 @ W1 + hat(a1))
    return watched(ProjectedPolynomial(R0, R1, R0 @ W0, R1 @ W1, *curvatures))


def check_ends_of_quintic(
    R0: ArrayLike, R1: ArrayLike, w0: ArrayLike, w1: ArrayLike, a0: ArrayLike, a1: ArrayLike
) -> tuple[Ends, Array, Array]:
    """Return `Ends`, and the accelerations a0 and a1, all of one batch shape."""
    ends, a0, a1 = Ends(R0, R1, w0, w1), as_finite("a0", a0, 3), as_finite("a1", a1, 3)
    batch = check_broadcast(ends=(ends.R0, 2), a0=(a0, 1), a1=(a1, 1))
    a0, a1 = (np.broadcast_to(a, (*batch, 3)) for a in (a0, a1))
    return ends.broadcast_to(batch), a0, a1


def projected_cubic(ends: Ends) -> ProjectedPolynomial:
    """Return `projected_cubic_so3` of checked ends, without a warning of its margin."""
    R0, R1, w0, w1 = ends
    return ProjectedPolynomial(R0, R1, R0 @ hat(w0), R1 @ hat(w1))


def weighted_cubic(ends: Ends, inertia: Array) -> ProjectedPolynomial:
    """Return `weighted_cubic_so3` of checked ends and inertias, without that warning."""
    W = weight_of("inertia", inertia)
    W = 3 * W / np.trace(W, axis1=-2, axis2=-1)[..., None, None]
    return ProjectedPolynomial(*(M @ W for M in projected_cubic(ends).ends))


def watched(curve: ProjectedPolynomial) -> ProjectedPolynomial:
    """Return the curve, with a warning if its margin is below 1e-6."""
    if curve.may_jump():
        warn_if_nearly_singular(curve.margin, curve.margin_time)
    return curve


def hermite(ends: Sequence[ArrayLike] | Array, t: Array, order: int = 0) -> Array:
    """Return the polynomial of least degree with these ends, or a derivative, at the times t.

    Written from the nearer end, it meets both exactly, however they differ in size. Of all curves
    with its ends the line has the least ∫ ‖x'‖² dt, the cubic the least ∫ ‖x''‖² dt, and the
    quintic the least ∫ ‖x'''‖² dt.

    Parameters
    ----------
    ends : sequence of array_like
        x0, x1 of a line; x0, x1, v0, v1 of a cubic; x0, x1, v0, v1, a0, a1 of a quintic: values and
        derivatives at t = 0 and 1.
    t : ndarray
        The times; they broadcast with the ends.
    order : {0, 1, 2, 3}, optional
        Which derivative.

    Returns
    -------
    ndarray

    Raises
    ------
    ValueError
        If `order` is another, or there are not two, four or six ends.

    References
    ----------
    BK 6, BK 6.2.

    Examples
    --------
    >>> hermite([0, 1, 0, 0], np.array([0.0, 0.5, 1.0]))
    array([0. , 0.5, 1. ])
    """
    return _sum(_weights(len(ends), t, check_order(order, 3)), _terms(ends))


def hermite_stack(terms: Array, t: Array, which: Chosen, order: int) -> Array:
    """Return `hermite` of a stack with these `stack_terms`, components first.

    Parameters
    ----------
    terms : ndarray, shape (n + 1, ..., count)
    t : ndarray, shape (T, K) or (T, 1)
    which : ndarray of int, shape (K,)
    order : int

    Returns
    -------
    ndarray, shape (..., T, K)
    """
    core = terms.shape[1:-1]
    if len(which) != 1 and not (len(t) == 1 and has_long_runs(which)):
        chosen = np.take(terms, which, axis=-1)[..., None, :]
        return _sum(_weights(len(terms) - 1, t, order), chosen)
    weights = np.stack(_weights(len(terms) - 1, t.ravel(), order))
    flat = terms[-len(weights) :].reshape(len(weights), math.prod(core), terms.shape[-1])
    if len(which) == 1:
        values = flat[:, :, which[0]].T @ weights
    else:
        values = np.empty((flat.shape[1], weights.shape[1]))
        for curve, run in runs(which):
            np.matmul(flat[:, :, curve].T, weights[:, run], out=values[:, run])
    return values.reshape(*core, len(t), len(which))


def _sum(weights: list[Array], terms: Sequence[Array] | Array) -> Array:
    """Return the sum of the last terms, weighed."""
    first, *others = (w * x for w, x in zip(weights, terms[-len(weights) :], strict=True))
    return sum(others, first)


def stack_terms(ends: Array) -> Array:
    """Return the terms of a stack: of ends of shape (n, count, ...), shape (n + 1, ..., count)."""
    return np.stack([np.ascontiguousarray(np.moveaxis(x, 0, -1)) for x in _terms(ends)])


def _terms(ends: Sequence[ArrayLike] | Array) -> list[Array]:
    """Return what a polynomial is a sum of: x0, x1, x1 − x0 and the derivatives at the ends."""
    x0, x1, *rates = map(np.asarray, ends)
    return [x0, x1, x1 - x0, *rates]


def _weights(count: int, t: Array, order: int) -> list[Array]:
    """Return what the terms weigh; those of derivatives begin with x1 − x0."""
    starts, ends = _start_weights(count, t, order), _start_weights(count, 1 - t, order)
    rates = [(starts[j], (-1) ** (j + order) * ends[j]) for j in range(1, count // 2)]
    weights = [weight for pair in rates for weight in pair]
    if order:
        return [(-1) ** order * ends[0], *weights]
    early = t.real < 0.5
    return [early + 0 * t, ~early + 0 * t, np.where(early, ends[0], -starts[0]), *weights]


def _start_weights(count: int, t: Array, order: int) -> list[Array]:
    """Return the weights of x0, v0 and a0.

    By symmetry x1, v1 and a1 have the same at 1 − t; the sign changes for each derivative.
    """
    s = 1 - t
    match count, order:
        case 2, 0:
            return [s]
        case 2, 1:
            return [0 * t - 1]
        case 2, _:
            return [0 * t]
        case 4, 0:
            return [s * s * (1 + 2 * t), t * s * s]
        case 4, 1:
            return [-6 * t * s, s * (1 - 3 * t)]
        case 4, 2:
            return [6 * (t - s), 2 - 6 * s]
        case 4, 3:
            return [12 + 0 * t, 6 + 0 * t]
        case 6, 0:
            sss = s * s * s
            return [sss * (1 + 3 * t + 6 * t * t), t * sss * (1 + 3 * t), t * t * sss / 2]
        case 6, 1:
            ts, ss = t * s, s * s
            return [-30 * ts * ts, ss * (1 - 3 * t) * (1 + 5 * t), ts * s * (2 - 5 * t) / 2]
        case 6, 2:
            ts = t * s
            return [60 * ts * (t - s), -12 * ts * (3 - 5 * t), s * (1 - 8 * t + 10 * t * t)]
        case 6, 3:
            tt = t * t
            return [60 * (6 * t * s - 1), -12 * (3 - 16 * t + 15 * tt), -9 + 36 * t - 30 * tt]
    raise ValueError(f"ends: two, four or six wanted, got {count}")


def _rates(R: Array, M: Array, *rates: Array) -> list[Array]:
    """Return w, w', w'', as many as there are of M', M'', M'''; R nearest to M; components first.

    S = RᵀM is symmetric. With A = RᵀM', differentiated, that says (tr(S) I − S) w = vee(A − Aᵀ),
    and differentiated again, by Leibniz's rule for its left side,

        (tr(S) I − S) w' = vee(A' − A'ᵀ) − (tr(S') I − S') w
        (tr(S) I − S) w'' = vee(A'' − A''ᵀ) − 2 (tr(S') I − S') w' − (tr(S'') I − S'') w.

    The derivative of RᵀX is RᵀX' − ŵ RᵀX.
    """
    S, *turned = (_transposed_times(R, X) for X in (M, *rates))
    A = turned[0]
    w = _solve(S, _skew(A))
    if len(turned) == 1:
        return [w]
    S_rate, A_rate = A - _cross(w, S), turned[1] - _cross(w, A)
    a = _solve(S, _skew(A_rate) - _spin(S_rate, w))
    if len(turned) == 2:
        return [w, a]
    S_bend = A_rate - _cross(a, S) - _cross(w, S_rate)
    A_bend = turned[2] - _cross(w, turned[1]) - _cross(a, A) - _cross(w, A_rate)
    return [w, a, _solve(S, _skew(A_bend) - 2 * _spin(S_rate, a) - _spin(S_bend, w))]


def _spin(S: Array, w: Array) -> Array:
    """Return (tr(S) I − S) w."""
    trace = S[0, 0] + S[1, 1] + S[2, 2]
    return trace * w - (S[:, 0] * w[0] + S[:, 1] * w[1] + S[:, 2] * w[2])


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
