"""Cubic and quintic polynomials with given ends, projected on SO(3)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbcourse._docs import described_by
from rbcourse._foam import GAP_ERROR, gaps
from rbcourse._numerics import BLOCK, Array, blocks, cross
from rbcourse._polynomials import hermite, hermite_stack, stack_terms
from rbcourse.body import Body, weight_of
from rbcourse.curves.curve import (
    HALVES,
    Curve,
    SingularTime,
    check_defined,
    least_over_time,
    near_margins,
)
from rbcourse.curves.ends import Ends, Rate, between
from rbcourse.curves.rigid import moving
from rbcourse.projection import NOT_UNIQUE, gap, nearest, warn_if_nearly_singular
from rbcourse.so3 import hat


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class ProjectedPolynomial(Curve):
    """The `Curve` of the rotations nearest to a polynomial M(t) in the space of matrices.

    Its `ends`, shape (..., n, 3, 3), are M(0), M(1), M'(0), M'(1), and for a quintic also M''(0),
    M''(1), with time from 0 to 1. If there is a weight W, all matrices are multiplied by it.
    Source: BK 6, BK 6.2.
    """

    ends: Array

    def values(self, t: Array, order: int) -> Array:
        """Return R, w, w' or w'' of the projection of M."""
        M = [hermite_stack(self._terms, t, k) for k in range(order + 1)]
        R, unique = nearest(np.moveaxis(M[0], (0, 1), (-2, -1)))
        check_defined(t, ~unique, NOT_UNIQUE)
        if order == 0:
            return R
        R = np.ascontiguousarray(np.moveaxis(R, (-2, -1), (0, 1)))
        return np.moveaxis(_rates(R, *M)[order - 1], 0, -1)

    def _single(self, i: int, t: float, orders: tuple[int, ...]) -> list[Array]:
        """Return R, w and w' of one curve at one time, as `textbook.projected_cubic` does."""
        if max(orders) > 2:
            return super()._single(i, t, orders)
        # the formulas of `_rates` without stacks take a third of the time
        ends = self.flat.ends[i]
        M = [hermite(ends, t, k) for k in range(max(orders) + 1)]
        R, unique = nearest(M[0])
        if not unique:
            raise SingularTime(t, i, NOT_UNIQUE)
        found = [R]
        if len(M) > 1:
            S, A = R.T @ M[0], R.T @ M[1]
            inverse = np.linalg.inv(np.trace(S) * np.eye(3) - S)
            w = inverse @ _skew(A)
            found.append(w)
        if len(M) > 2:
            W = hat(w)
            S_rate, A_rate = A - W @ S, R.T @ M[2] - W @ A
            found.append(inverse @ (_skew(A_rate) - np.trace(S_rate) * w + S_rate @ w))
        return [found[k] for k in orders]

    @cached_property
    def _terms(self) -> Array:
        """The terms of M, shape (n + 1, 3, 3, count)."""
        return stack_terms(self.ends)

    @property
    def margin(self) -> Array:
        """The minimum over time of the sum of the two smallest eigenvalues of RᵀM.

        If it is 0, the nearest rotation is not unique. A small margin indicates a poor curve, but a
        large margin does not guarantee a good curve (see docs/near_optimal.md).
        """
        return self._least_gap[1].copy()

    @property
    def margin_time(self) -> Array:
        """The time at which the margin is reached."""
        return self._least_gap[0] * self.duration

    @cached_property
    def _least_gap(self) -> tuple[Array, Array]:
        ends = np.moveaxis(self.ends, -3, 0)
        return least_over_time(lambda t: gap(hermite(ends, t[..., None, None])), self.batch_shape)

    def least_margins(self, samples: int) -> Array:
        """Return estimates of the margins from below, shape (count,), from sample times."""
        times = np.linspace(0, 1, samples)[:, None, None, None]
        least = np.empty(self.count)
        for part in blocks(self.count, BLOCK // samples):
            M = hermite(np.moveaxis(self.flat.ends[part], 1, 0), times)
            M = np.ascontiguousarray(M.transpose(2, 3, 0, 1))
            change = np.sqrt(np.sum(np.diff(M, axis=2) ** 2, axis=(0, 1))).max(axis=0)
            size = np.sqrt(np.sum(M**2, axis=(0, 1)))
            margins = gaps(M.reshape(3, 3, -1)).reshape(samples, -1) - GAP_ERROR * size
            least[part] = (margins - change).min(axis=0)
        return least

    @property
    def breakpoints(self) -> list[Array]:
        """The `Curve.breakpoints`, refined near a small margin; two panels if the turn is small."""
        least = self.least_margins(9)
        times, margins = np.full((2, self.count), np.inf)
        doubtful = np.flatnonzero(~(least >= 0.25))
        times[doubtful], margins[doubtful] = self.flat._take(doubtful)._least_gap
        points = near_margins(super().breakpoints, times, margins)
        small = least > 1  # the margin of a curve that stands still is 2
        return [HALVES if here else there for here, there in zip(small, points, strict=True)]


@described_by(between, returns="Curve")
def projected_cubic(
    start: ArrayLike,
    goal: ArrayLike,
    v0: Rate = None,
    v1: Rate = None,
    *,
    body: Body | None = None,
    duration: ArrayLike = 1.0,
) -> Curve:
    """Return the projected cubic with these ends, which is near-optimal for minimum acceleration.

    The curve has the attribute ``margin``. For rotations, it consists of the nearest rotations to
    the cubic M(t) that has the values R and the derivatives R ŵ at both ends; for a body, they are
    nearest in its metric (`project_so_weighted`, with the weight of `weight_from_inertia`). For
    poses, this is the ``rotation``, and the centre of mass moves on a cubic, which is its optimal
    path. The curve meets all boundary conditions exactly.
    Source: BK 6.2, BK 6.3, BK Prop. 3, BK Prop. 5; with M'(1) where the paper prints the second
    derivative. For other bodies than a ball, beyond BK 6.

    Parameters
    ----------
    body : Body, optional
        The body that moves, by default the ball of metric (12). Each principal moment is at most
        the sum of the other two, as for every real body.

    Notes
    -----
    Singular set: times at which the two smallest eigenvalues of RᵀM sum to 0. The curve jumps at
    such a time, and a call at this time raises ValueError. At other times, the curve is correct. A
    ``margin`` below 1e-6 gives a RuntimeWarning that names the time. If ``margin`` is small, the
    curve turns by up to π in a time of about ``margin`` divided by the speed of M. At each time,
    the error of the curve is a few eps ‖M‖ divided by the sum of the two eigenvalues. The errors of
    its first two derivatives are a few eps divided by the square and the cube of this sum. For a
    body, M W takes the place of M, where the weight W is scaled to have trace 3.

    The curve does not depend on the choice of frames: the ends L R0 Q, L R1 Q, Qᵀ w0, Qᵀ w1 give
    the curve L R(t) Q (and the inertia Qᵀ G Q). The optimum is `minimum_acceleration`. If the
    excursion is multiplied by s, the relative excess over this optimum is multiplied by about s⁴.
    Near a half-turn, the acceleration has a high peak: from rest to rest, the curve costs 2.6 times
    as much as the optimum for a turn by 120°, 14 times for 150°, and 300 times for 170°. No warning
    is given. `closed_forms.corrected_bezier` has no such peak. `rbcourse.textbook.projected_cubic`
    is a short version for a single curve.

    Examples
    --------
    >>> from rbcourse import Body, exp_so3, pose_from_coordinates
    >>> c = projected_cubic(np.eye(3), exp_so3([0, 0, 1.5]), v1=[0, 1, 0])  # from rest
    >>> c(1, 1).round(12) + 0.0, float(c.margin.round(3))
    (array([0., 1., 0.]), 1.464)
    >>> book = Body([[1, 0, 0], [0, 2.22, 0], [0, 0, 3.18]])
    >>> c = projected_cubic(np.eye(4), pose_from_coordinates([0, 0, 1, 2, 0, 0]), body=book)
    >>> c(0.5, 1).round(3)[[2, 3, 4]]  # turn, forward, to the left
    array([ 1.639,  2.633, -1.438])
    """
    given = between(start, goal, v0, v1, body=body, duration=duration)
    curve = polynomial(given.ends, given.duration)
    if given.body.is_ball:
        return moving(given, watched(curve, bound_of_margin(given.ends)))
    W = weight_of("body.inertia", given.body.inertia)
    W = 3 * W / np.trace(W, axis1=-2, axis2=-1)[..., None, None]
    curve = replace(curve, ends=curve.ends @ W[..., None, :, :], body=given.body)
    return moving(given, watched(curve))


@described_by(projected_cubic, returns="Curve")
def projected_quintic(
    start: ArrayLike,
    goal: ArrayLike,
    v0: Rate = None,
    v1: Rate = None,
    a0: Rate = None,
    a1: Rate = None,
    *,
    duration: ArrayLike = 1.0,
) -> Curve:
    """Return the projected quintic with these ends, which include accelerations.

    The curve has the attribute ``margin``. For rotations, it consists of the nearest rotations to
    the quintic M(t) that has the values R, the first derivatives R ŵ and the second derivatives
    R (ŵ² + â) at both ends. For poses, this is the ``rotation``, and the origin moves on a quintic.
    In general, this curve is not near the curve of least jerk, `minimum_jerk`. From rest to rest,
    it costs 1.17 times the optimum for a turn by 60°, and 11.6 times the optimum for 120°.
    `closed_forms.exponential_quintic` is near the optimum. The singular set and the symmetries are
    as for `projected_cubic`.
    Source: BK 6, BK Prop. 3.

    Parameters
    ----------
    a0, a1 : array_like, shape (..., 3) or (..., 6), optional
        Accelerations at both ends as ``c(t, 2)`` returns them: w', or (w', Rᵀ d''), per unit time
        squared. The default is 0.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> c = projected_quintic(np.eye(3), exp_so3([0, 0, 1.5]), a1=[0, 0, 2])  # from rest to rest
    >>> c(1, 2).round(12) + 0.0
    array([0., 0., 2.])
    """
    given = between(start, goal, v0, v1, a0, a1, duration=duration)
    (R0, R1, w0, w1), (a0, a1) = given.ends, given.bends
    W0, W1 = hat(w0), hat(w1)
    curvatures = R0 @ (W0 @ W0 + hat(a0)), R1 @ (W1 @ W1 + hat(a1))
    M = np.stack([R0, R1, R0 @ W0, R1 @ W1, *curvatures], axis=-3)
    return moving(given, watched(ProjectedPolynomial(ends=M, duration=given.duration)))


def polynomial(ends: Ends, duration: Array) -> ProjectedPolynomial:
    """Return the projected cubic for ends rescaled to unit time, without a warning."""
    R0, R1, w0, w1 = ends
    M = np.stack([R0, R1, R0 @ hat(w0), R1 @ hat(w1)], axis=-3)
    return ProjectedPolynomial(ends=M, duration=duration)


def watched(curve: ProjectedPolynomial, bound: Array | None = None) -> ProjectedPolynomial:
    """Return the curve; warn if its margin is below 1e-6. The margin is at least the `bound`."""
    doubtful = np.arange(curve.count) if bound is None else np.flatnonzero(bound < 1e-3)
    if not len(doubtful):
        return curve
    times, margins = np.zeros(curve.count), np.full(curve.count, 2.0)
    for part in blocks(len(doubtful)):
        low = doubtful[part]
        low = low[_may_almost_jump(curve.flat.ends[low])]
        if len(low):
            times[low], margins[low] = curve.flat._take(low)._least_gap
    if (margins < 1e-6).any():
        margins, times = margins.reshape(curve.batch_shape), times.reshape(curve.batch_shape)
        warn_if_nearly_singular(margins, times * curve.duration)
    return curve


def _may_almost_jump(ends: Array) -> NDArray[np.bool_]:
    """Return whether margins may be below 1e-6, given the ends of polynomials, (N, n, 3, 3).

    A polynomial is in the convex hull of its Bézier control points P. For every matrix C, the sum
    of the two smallest eigenvalues is at least its value at C minus √2 max ‖P − C‖. Where this
    bound is too small, the interval of time is halved.
    """
    count, n = ends.shape[:2]
    P = np.tensordot(_control_points(n), ends.reshape(count, n, 9).transpose(1, 2, 0), axes=1)
    P = np.ascontiguousarray(np.moveaxis(P, 2, 1)).reshape(n, 9, -1)
    which, doubt = np.tile(np.arange(count), 8), np.zeros(count, bool)
    for _ in range(20):
        C = P.mean(axis=0)
        reach = np.sqrt(2 * np.square(P - C).sum(axis=1).max(axis=0))
        least = gaps(C.reshape(3, 3, -1)) - GAP_ERROR * np.sqrt(np.square(C).sum(axis=0))
        near = ~(least - reach > 1e-6)
        doubt |= np.bincount(which[near], minlength=count) > 64  # small for a long time
        near &= ~doubt[which]
        if not near.any():
            return doubt
        P, which = _halves(P[..., near]), np.tile(which[near], 2)
    doubt[which] = True
    return doubt


def bound_of_margin(ends: Ends) -> Array:
    """Return a lower bound of the margins of projected cubics with these ends in unit time.

    The bound is 2 cos(a/2) − sin(a/2) (5p + 3q)/16, where a is the angle between R0 and R1, and
    p ≥ q are the norms of w0 and w1. For a turn about one axis with w0 = w1, it may be the margin.

    Proof: let Q be any rotation, A = QᵀM, and N the symmetric 4 × 4 matrix for which qᵀNq is
    tr(RᵀA) for the rotation R of a unit quaternion q. Its largest eigenvalues are s₁ + s₂ + s₃ and
    s₁ − s₂ − s₃. The first one is at least N₀₀ = tr A. The second one is at most the largest
    eigenvalue of A + Aᵀ − tr(A) I, the other diagonal block, since eigenvalues interlace. So s₂ +
    s₃ is at least the minimum of tr((I − uuᵀ) A) over all unit vectors u.
    Let Q be half-way from R0 to R1. Then QᵀR0 and QᵀR1 are turns E by ∓a/2 about one axis. The
    minimum of tr((I − uuᵀ) E) is 2 cos(a/2), and |tr((I − uuᵀ) E ŵ)| is at most 2 sin(a/2) ‖w‖. M
    is an average of R0 and R1 plus t (1 − t)² R0 ŵ0 − t² (1 − t) R1 ŵ1, and
    t (1 − t) ((1 − t) ‖w0‖ + t ‖w1‖) ≤ (5p + 3q)/32.
    """
    trace = np.einsum("...ij,...ij", ends.R0, ends.R1)  # 1 + 2 cos a
    speeds = [np.sqrt(np.einsum("...i,...i", w, w)) for w in (ends.w0, ends.w1)]
    sums = 5 * np.maximum(*speeds) + 3 * np.minimum(*speeds)
    off = 1e-8  # the largest error of the trace, since entries of RᵀR may be off by 1e-9
    double_cosine, double_sine = np.sqrt(np.maximum(1 + trace - off, 0)), np.sqrt(3 - trace + off)
    bound: Array = double_cosine - sums / 32 * double_sine
    return bound


@cache
def _control_points(count: int) -> Array:
    """Return the weights of the ends in the Bézier control points on eighths of the time.

    The shape is (count, 8, count): control points, intervals, ends.
    """
    x0, x1, v0, v1, *rest = np.eye(count)
    points = [x0, x0 + v0 / 3, x1 - v1 / 3, x1]
    if rest:
        a0, a1 = rest
        inner = [x0 + 0.4 * v0 + a0 / 20, x1 - 0.4 * v1 + a1 / 20]
        points = [x0, x0 + v0 / 5, *inner, x1 - v1 / 5, x1]
    P = np.stack(points)[..., None]
    return np.swapaxes(_halves(_halves(_halves(P))), 1, 2)


def _halves(P: Array) -> Array:
    """Return the Bézier control points on both halves of all intervals, the last axis of P."""
    first, last = [P[0]], [P[-1]]
    while len(P) > 1:
        P = (P[1:] + P[:-1]) / 2
        first.append(P[0])
        last.append(P[-1])
    return np.concatenate([np.stack(first), np.stack(last[::-1])], axis=-1)


def _rates(R: Array, M: Array, *rates: Array) -> list[Array]:
    """Return w, w', w'', one for each given derivative M', M'', M'''.

    R is the nearest rotation to M. In all arrays, the first axes index the components.

    S = RᵀM is symmetric. With A = RᵀM' and K(S) = tr(S) I − S, differentiation gives
    K(S) w = vee(A − Aᵀ), K(S) w' = vee(A' − A'ᵀ) − K(S') w and
    K(S) w'' = vee(A'' − A''ᵀ) − 2 K(S') w' − K(S'') w. The derivative of RᵀX is RᵀX' − ŵ RᵀX.
    """
    S, *turned = (_transposed_times(R, X) for X in (M, *rates))
    A = turned[0]
    w = _solve(S, _skew(A))
    if len(turned) == 1:
        return [w]
    S_rate, A_rate = A - cross(w, S, axis=0), turned[1] - cross(w, A, axis=0)
    a = _solve(S, _skew(A_rate) - _spin(S_rate, w))
    if len(turned) == 2:
        return [w, a]
    S_bend = A_rate - cross(a, S, axis=0) - cross(w, S_rate, axis=0)
    A_bend = (
        turned[2] - cross(w, turned[1], axis=0) - cross(a, A, axis=0) - cross(w, A_rate, axis=0)
    )
    return [w, a, _solve(S, _skew(A_bend) - 2 * _spin(S_rate, a) - _spin(S_bend, w))]


def _spin(S: Array, w: Array) -> Array:
    """Return (tr(S) I − S) w."""
    trace = S[0, 0] + S[1, 1] + S[2, 2]
    return trace * w - (S[:, 0] * w[0] + S[:, 1] * w[1] + S[:, 2] * w[2])


def _transposed_times(R: Array, M: Array) -> Array:
    """Return RᵀM, computed by rows; this is several times faster than NumPy's einsum."""
    product = np.empty_like(M)
    for i in range(3):
        np.multiply(R[0, i], M[0], out=product[i])
        product[i] += R[1, i] * M[1]
        product[i] += R[2, i] * M[2]
    return product


def _skew(A: Array) -> Array:
    """Return vee(A − Aᵀ)."""
    return np.stack([A[2, 1] - A[1, 2], A[0, 2] - A[2, 0], A[1, 0] - A[0, 1]])


def _solve(S: Array, b: Array) -> Array:
    """Solve (tr(S) I − S) x = b by the L D Lᵀ factorisation of the matrix."""
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
