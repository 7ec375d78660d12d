"""Bézier curves of rotations: by geodesics, in cumulative form, and with a correction."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._checks import first_index
from rbcourse._docs import described_by
from rbcourse._numerics import Array, matvec
from rbcourse._quaternions import Jet, exp, product, quaternion_of, slerp, times
from rbcourse.curves.curve import Curve, QuaternionCurve, identity, other_way
from rbcourse.curves.ends import Ends, Given, Rate, between
from rbcourse.curves.projected import projected_cubic
from rbcourse.curves.rigid import moving
from rbcourse.quaternion import (
    quaternion_conjugate,
    quaternion_from_rotation_vector,
    quaternion_multiply,
)
from rbcourse.so3 import exp_so3, log

Legs = tuple[Array, Array, Array]


@described_by(projected_cubic, returns="Curve")
def bezier(
    start: ArrayLike,
    goal: ArrayLike,
    v0: Rate = None,
    v1: Rate = None,
    *,
    long: bool = False,
    duration: ArrayLike = 1.0,
) -> Curve:
    """Return the cubic Bézier curve with these ends, by de Casteljau's algorithm with geodesics.

    The control points are R0, R0 exp(ŵ0/3), R1 exp(−ŵ1/3), R1. Domain: ‖w0‖ and ‖w1‖ times the
    duration are below 3π. Singular set: the two inner control points are a half-turn apart.
    `log_so3` then chooses the geodesic between them. If `long` is True, equal inner control points
    are also singular; then `long` has no effect. By the triangle inequality, no other leg can
    become a half-turn. The curve does not depend on the choice of frames, and the ends R1, R0, −w1,
    −w0 give the reversed curve.
    Source: BK 1, its references 3 to 5; for ``long``, beyond BK 10.

    Parameters
    ----------
    long : bool, optional
        Whether the middle leg turns the other way round. If the end velocities are large, this
        curve may cost less.

    Examples
    --------
    >>> from rbcourse import acceleration_cost, exp_so3
    >>> ends = np.eye(3), exp_so3([0, 0, 1.5]), [0, 0, -2.4], [0, 0, -2.4]
    >>> [float(acceleration_cost(bezier(*ends, long=k)).round(1)) for k in (False, True)]
    [365.0, 136.3]
    """
    given = between(start, goal, v0, v1, duration=duration)
    first, middle, last = _slow_legs(given.ends)
    middle = other_way(middle) if long else middle
    return moving(given, _bezier(given, (first, middle, last)))


@described_by(projected_cubic, returns="Curve")
def cumulative_bezier(
    start: ArrayLike,
    goal: ArrayLike,
    v0: Rate = None,
    v1: Rate = None,
    *,
    duration: ArrayLike = 1.0,
) -> Curve:
    """Return R0 exp(β₁ v̂₁) exp(β₂ v̂₂) exp(β₃ v̂₃), the cubic Bézier curve in cumulative form.

    This curve is faster to evaluate than `bezier`. The turns are v₁ = w0/3, v₃ = w1/3, and the
    shortest turn v₂ from R0 exp(ŵ0/3) to R1 exp(−ŵ1/3). The weights are β₁ = 1 − (1 − t)³, β₂ = 3t²
    − 2t³, β₃ = t³. The curve has the given ends. Singular set: v₂ is a half-turn. `log_so3` then
    chooses its axis. The curve itself is smooth everywhere. It does not depend on the choice of
    frames, but the reversed ends do not give the reversed curve.
    Source: BK 1; M.-J. Kim, M.-S. Kim and S. Y. Shin, A general construction scheme for unit
    quaternion curves with simple high order derivatives, SIGGRAPH 1995.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> c = cumulative_bezier(np.eye(3), exp_so3([0, 0, 1.5]), [0, 0, 0], [0, 1, 0])
    >>> c(1, 1).round(12) + 0.0
    array([0., 1., 0.])
    """
    given = between(start, goal, v0, v1, duration=duration)
    halves = np.stack(bezier_legs(given.ends), axis=-2) / 2
    first = quaternion_of(given.ends.R0)
    return moving(given, CumulativeBezier(duration=given.duration, start=first, controls=halves))


@described_by(projected_cubic, returns="Curve")
def corrected_bezier(
    start: ArrayLike,
    goal: ArrayLike,
    v0: Rate = None,
    v1: Rate = None,
    *,
    duration: ArrayLike = 1.0,
) -> Curve:
    """Return the Bézier curve minus its leading deviation from the optimum.

    The curve is R_m exp(−δ̂/2) R_mᵀ B(t) exp(−δ̂/2), with B(t) of `bezier` and δ(t) of
    `bezier_deviation`. It has the given ends.
    Source: beyond BK 10.

    Notes
    -----
    R_m = R0 exp(σ̂/2) is the half-way rotation. Among all logarithms of R0ᵀ R1, including those
    longer than π, σ is the one nearest to the sum of the three legs of the Bézier curve. The
    corrected curve is near-optimal for small excursions: if the excursion is multiplied by s, the
    relative excess over the optimum is multiplied by about s⁸ (for the other closed forms, by s⁴ or
    s²). The deviation δ is of third order in the excursion. Large end velocities make δ large, and
    the curve may then cost more than the Bézier curve (see docs/near_optimal.md). The singular set
    and the symmetries are as for `bezier`. Ends are also singular if two logarithms are equally
    near to this sum.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> c = corrected_bezier(np.eye(3), exp_so3([0, 0, 1.5]), [0, 0, 0], [0, 1, 0])
    >>> c(1, 1).round(12) + 0.0
    array([0., 1., 0.])
    """
    given = between(start, goal, v0, v1, duration=duration)
    ends, legs = given.ends, _slow_legs(given.ends)
    curve = _bezier(given, legs)
    sigma = nearest_turn(log(ends.turn), legs[0] + legs[1] + legs[2])
    deviation = bezier_deviation(sigma, *seen_from_the_middle(sigma, ends.w0, ends.w1))
    middle = quaternion_from_rotation_vector(sigma / 2)
    points = quaternion_multiply(quaternion_conjugate(middle)[..., None, :], curve.controls)
    pure = [np.concatenate([np.zeros_like(c[..., :1]), c], axis=-1) for c in deviation]
    rotation = CorrectedBezier(
        duration=given.duration,
        start=quaternion_multiply(curve.start, middle),
        controls=np.concatenate([points, np.stack(pure, axis=-2)], axis=-2),
    )
    return moving(given, rotation)


def bezier_legs(ends: Ends) -> Legs:
    """Return the shortest turns from each Bézier control point to the next."""
    first, last = ends.w0 / 3, ends.w1 / 3
    return first, log(exp_so3(-first) @ ends.turn @ exp_so3(-last)), last


def _slow_legs(ends: Ends) -> Legs:
    """Return the legs of the Bézier curve; refuse velocities of 3π or more."""
    for name, w in (("v0", ends.w0), ("v1", ends.w1)):
        angle = np.linalg.norm(w, axis=-1)
        fast = angle >= 3 * np.pi
        if fast.any():
            raise ValueError(
                f"{first_index(name, fast)}: an angle ‖w‖ · duration below 3π is wanted, "
                f"got {angle[fast][0]:.4g}"
            )
    return bezier_legs(ends)


def seen_from_the_middle(sigma: Array, w0: Array, w1: Array) -> tuple[Array, Array]:
    """Return e = (u0 + u1)/2 − σ and d = u1 − u0, where σ = log(R0ᵀ R1).

    The vectors u0 and u1 are w0 and w1, parallel transported to the half-way rotation R0 exp(σ̂/2)
    in a bi-invariant metric. On each half, the body axes turn by σ/2, and parallel vectors by σ/4.
    For the geodesic, e and d are 0.
    """
    quarter = exp_so3(sigma / 4)
    u0, u1 = matvec(quarter.mT, w0), matvec(quarter, w1)
    return (u0 + u1) / 2 - sigma, u1 - u0


def bezier_deviation(sigma: Array, e: Array, d: Array) -> list[Array]:
    """Return the coefficients c₀, …, c₄ of the Bézier curve's deviation from the optimum.

    To third order, the deviation is the rotation vector δ(t) = t² (1 − t)² (c₀ + c₁ u + … + c₄ u⁴),
    where u = 2t − 1. `seen_from_the_middle` defines e and d. In the code, ``sed`` is σ × (e × d).
    Source: beyond BK 10.
    """
    first = np.stack([sigma, sigma, sigma, e, e, e, d, d])
    second = np.stack([sigma, sigma, e, sigma, sigma, e, sigma, e])
    third = np.stack([e, d, d, e, d, d, d, d])
    sse, ssd, sed, ese, esd, eed, dsd, ded = np.cross(first, np.cross(second, third))
    return [
        (17 * sed - 10 * ssd - 13 * esd) / 1080 + 97 * eed / 15120,
        11 * ded / 6048 - sse / 90 - ese / 60 - dsd / 720,
        sed / 180 - esd / 120 + 3 * eed / 560,
        17 * ded / 30240 - ese / 90,
        eed / 504,
    ]


def nearest_turn(turn: Array, way: Array) -> Array:
    """Return the vector nearest to `way` that differs from `turn` by full turns."""
    angle = np.linalg.norm(turn, axis=-1, keepdims=True)
    axis = turn / np.where(angle == 0, 1, angle)
    more = (np.sum(way * axis, axis=-1, keepdims=True) - angle) / (2 * np.pi)
    return turn + 2 * np.pi * np.round(more) * axis


class CumulativeBezier(QuaternionCurve):
    """The `Curve` of `cumulative_bezier`."""

    def quaternion(self, controls: Array, t: Array, order: int) -> Jet:
        """Return the product of exp(βᵢ vᵢ/2)."""
        s = 1 - t
        shares: list[Jet] = [
            [t * (1 + s + s * s), 3 * s * s, -6 * s, 6 + 0 * t],
            [t * t * (1 + 2 * s), 6 * t * s, 6 * (s - t), -12 + 0 * t],
            [t * t * t, 3 * t * t, 6 * t, 6 + 0 * t],
        ]
        first, second, third = (
            exp([beta * half for beta in share[: order + 1]])
            for share, half in zip(shares, controls, strict=True)
        )
        return product(product(first, second), third)


class Bezier(QuaternionCurve):
    """The `Curve` of de Casteljau's construction with geodesics in place of straight lines."""

    def quaternion(self, controls: Array, t: Array, order: int) -> Jet:
        """Return the point constructed from four control points."""
        share = [identity(t, k) for k in range(order + 1)]
        points = [[point, *[np.zeros_like(point)] * order] for point in controls]
        while len(points) > 1:
            points = [slerp(a, b, share) for a, b in pairwise(points)]
        return points[0]


def _bezier(given: Given, legs: Legs) -> Bezier:
    points = [np.broadcast_to(np.eye(4)[0], (*given.duration.shape, 4))]
    for leg in legs:
        points.append(quaternion_multiply(points[-1], quaternion_from_rotation_vector(leg)))
    controls = np.stack(points, axis=-2)
    return Bezier(duration=given.duration, start=quaternion_of(given.ends.R0), controls=controls)


class CorrectedBezier(Bezier):
    """The `Curve` of de Casteljau's construction minus its leading deviation from the optimum.

    In the frame of the half-way rotation, the curve is multiplied by exp(−δ̂/2) on both sides.
    """

    def quaternion(self, controls: Array, t: Array, order: int) -> Jet:
        """Return exp(−δ/4) Q exp(−δ/4)."""
        points, deviation = controls[:4], controls[4:, 1:]
        moved = exp([x / -4 for x in _clamped(deviation, t, order)])
        return product(product(moved, super().quaternion(points, t, order)), moved)


def _clamped(coefficients: Array, t: Array, order: int) -> Jet:
    """Return the jet of t² (1 − t)² (c₀ + c₁ u + …), u = 2t − 1."""
    s = 1 - t
    bump: Jet = [t * t * s * s, 2 * t * s * (s - t), 2 - 12 * t * s, 12 * (t - s)]
    powers: Jet = []
    for _ in range(order + 1):
        powers.append(sum(c * (t - s) ** k for k, c in enumerate(coefficients)))
        coefficients = np.stack([2 * k * c for k, c in enumerate(coefficients)][1:])
    return times(bump[: order + 1], powers)
