"""Curves on SO(3) that are quaternions in the making: products, arcs, cubics divided by norms.

Each is a fixed rotation times that of a quaternion Q(t), which need not keep its norm. `rivals` has
the functions that make them.
"""

from functools import cached_property
from itertools import pairwise
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._numerics import EPS, Array, as_finite, check_broadcast
from rbcourse.conversions import quaternion_from_matrix
from rbcourse.curves import (
    BlockwiseCurve,
    Chosen,
    check_times,
    least_over_time,
    pick,
    which_curve,
)
from rbcourse.jets import Jet, angular_velocity, exp, multiply, product, rotation, slerp
from rbcourse.polynomials import hermite
from rbcourse.quaternion import quaternion_conjugate, quaternion_multiply
from rbcourse.so3 import exp_so3, log_so3, right_jacobian_inverse_so3


class Given(NamedTuple):
    """Where a curve starts, by how far it turns, R0ᵀ R1, and how fast: all of the batch's shape."""

    R0: Array
    turn: Array
    w0: Array
    w1: Array


Legs = tuple[Array, Array, Array]


def to_given(R0: ArrayLike, R1: ArrayLike, w0: ArrayLike, w1: ArrayLike) -> Given:
    """Check the arguments of all these curves, and bring them to one batch shape."""
    R0, R1 = as_finite("R0", R0, 3, 3), as_finite("R1", R1, 3, 3)
    w0, w1 = as_finite("w0", w0, 3), as_finite("w1", w1, 3)
    batch = check_broadcast(R0=(R0, 2), R1=(R1, 2), w0=(w0, 1), w1=(w1, 1))
    matrices = (np.broadcast_to(x, (*batch, 3, 3)) for x in (R0, np.swapaxes(R0, -1, -2) @ R1))
    return Given(*matrices, *(np.broadcast_to(w, (*batch, 3)) for w in (w0, w1)))


def bezier_legs(given: Given) -> Legs:
    """Return the turns from each of Bézier's control points to the next, the shortest."""
    first, last = given.w0 / 3, given.w1 / 3
    return first, log_so3(exp_so3(-first) @ given.turn @ exp_so3(-last)), last


def other_way(turn: Array) -> Array:
    """Return the turns to the same rotations the other way round, by 2π − angle; of 0, itself."""
    angle = np.linalg.norm(turn, axis=-1, keepdims=True)
    return turn - 2 * np.pi * turn / np.where(angle == 0, 1, angle)


class QuaternionCurve(BlockwiseCurve):
    """A `Curve` that is R0 times the rotation of Q(t), if a subclass does not start elsewhere.

    References
    ----------
    BK 1.
    """

    def __init__(self, given: Given) -> None:
        self.batch_shape = given.w0.shape[:-1]
        self._start = _components(quaternion_from_matrix(given.R0))
        self._controls: list[Array] = []

    def _pick(self, chosen: Chosen) -> Self:
        picked = object.__new__(type(self))
        picked.batch_shape = chosen.shape
        picked._start, *picked._controls = (
            pick(x, chosen, self.batch_shape, lead=2) for x in [self._start, *self._controls]
        )
        return picked

    def _quaternion(self, t: Array, order: int) -> Jet:
        raise NotImplementedError

    def _block(self, t: Array, order: int) -> Array:
        Q = self._quaternion(t, order)
        if order == 0:
            return rotation(multiply(self._start, Q[0]))
        return np.moveaxis(angular_velocity(Q), 0, -1)


class ExponentialCubic(QuaternionCurve):
    """The `Curve` R0 exp(σ̂(t)), σ a cubic; σ(1) is any logarithm of the turn."""

    def __init__(self, given: Given, turn: Array) -> None:
        super().__init__(given)
        end_rate = (right_jacobian_inverse_so3(turn) @ given.w1[..., None])[..., 0]
        vectors = np.zeros_like(turn), turn, given.w0, end_rate
        self._controls = [_components(x / 2) for x in vectors]

    def _quaternion(self, t: Array, order: int) -> Jet:
        return exp(_cubic(self._controls, t, order))


class CumulativeBezier(QuaternionCurve):
    """The `Curve` R0 exp(β₁ v̂₁) exp(β₂ v̂₂) exp(β₃ v̂₃), β the cumulative Bernstein polynomials."""

    def __init__(self, given: Given, legs: Legs) -> None:
        super().__init__(given)
        self._controls = [_components(leg / 2) for leg in legs]

    def _quaternion(self, t: Array, order: int) -> Jet:
        s = 1 - t
        shares: list[Jet] = [
            [t * (1 + s + s * s), 3 * s * s, -6 * s],
            [t * t * (1 + 2 * s), 6 * t * s, 6 * (s - t)],
            [t * t * t, 3 * t * t, 6 * t],
        ]
        first, second, third = (
            exp([beta * half for beta in share[: order + 1]])
            for share, half in zip(shares, self._controls, strict=True)
        )
        return product(product(first, second), third)


class Bezier(QuaternionCurve):
    """The `Curve` of de Casteljau's construction, geodesics in the place of straight lines."""

    def __init__(self, given: Given, legs: Legs) -> None:
        super().__init__(given)
        start, first, second, third = (
            exp([_components(leg / 2)])[0] for leg in (np.zeros_like(given.w0), *legs)
        )
        last = multiply(multiply(first, second), third)
        self._controls = [start, first, multiply(first, second), last]

    def _quaternion(self, t: Array, order: int) -> Jet:
        share = [t, np.ones_like(t), np.zeros_like(t)][: order + 1]
        points = [[point, *[np.zeros_like(point)] * order] for point in self._controls]
        while len(points) > 1:
            points = [slerp(a, b, share) for a, b in pairwise(points)]
        return points[0]


class NormalizedCubic(QuaternionCurve):
    """The `Curve` of a cubic of quaternions, of norm 1 at its start and of another at its end.

    Its components are those seen from the goal: there Q(1) is real, and does not round w1 away,
    however large it is.
    """

    def __init__(self, given: Given, norm: Array, growth: Array) -> None:
        super().__init__(given)
        turn = quaternion_from_matrix(given.turn)
        self._start = multiply(self._start, _components(turn))
        start, one = quaternion_conjugate(turn), np.eye(4)[0] + np.zeros_like(turn)
        end_rate = growth[..., None] * one + _rate(one, given.w1)
        ends = start, norm[..., None] * one, _rate(start, given.w0), norm[..., None] * end_rate
        self._controls = [_components(x) for x in ends]

    def _quaternion(self, t: Array, order: int) -> Jet:
        return _cubic(self._controls, t, order)


class QuaternionCubic(NormalizedCubic):
    """The `Curve` of the unit quaternions nearest to a cubic between unit quaternions.

    Attributes
    ----------
    margin : ndarray, shape (...)
        The least norm of the cubic. At 0 the nearest unit quaternion is not unique.
    margin_time : ndarray, shape (...)
        When that is.
    """

    def __init__(self, given: Given) -> None:
        norm = np.ones(given.w0.shape[:-1])
        super().__init__(given, norm, 0 * norm)

    def _quaternion(self, t: Array, order: int) -> Jet:
        Q = super()._quaternion(t, order)
        lost = np.abs(Q[0]).max(axis=0) < 8 * EPS * self._scale
        check_times(t, lost, len(self.batch_shape), "the cubic of quaternions is zero")
        return Q

    @cached_property
    def _scale(self) -> Array:
        return np.abs(self._controls).max(axis=(0, 1))

    @property
    def margin(self) -> Array:
        """The least norm of the cubic."""
        return self._least[1]

    @property
    def margin_time(self) -> Array:
        """When the margin is reached."""
        return self._least[0]

    @cached_property
    def _least(self) -> tuple[Array, Array]:
        def norm(t: Array) -> Array:
            return np.linalg.norm(_cubic(self._controls, t, 0)[0], axis=0)

        return least_over_time(norm, self.batch_shape)


class CayleyCubic(NormalizedCubic):
    """The `Curve` of a cubic in Cayley's parameters.

    Attributes
    ----------
    quickest : tuple of ndarray, shape (...)
        When it turns most quickly, and about how long it takes for a radian then.
    """

    def __init__(self, given: Given) -> None:
        turn = quaternion_from_matrix(given.turn)
        infinite = np.argwhere(turn[..., 0] == 0)
        if len(infinite):
            raise ValueError(
                f"R0 and R1{which_curve(infinite[0])} are a half-turn apart: no Cayley parameters"
            )
        growth = np.sum(turn[..., 1:] * given.w1, axis=-1) / (2 * turn[..., 0])
        super().__init__(given, 1 / turn[..., 0], growth)

    @cached_property
    def quickest(self) -> tuple[Array, Array]:
        """When it turns most quickly, and about how long it takes for a radian then."""

        def time_for_a_radian(t: Array) -> Array:
            Q, rate = (np.linalg.norm(x, axis=0) for x in _cubic(self._controls, t, 1))
            return Q / (1 + rate)

        return least_over_time(time_for_a_radian, self.batch_shape)


def _components(x: Array) -> Array:
    """Return vectors of shape (..., n) as (n, 1, ...): the components first, then the times."""
    return np.ascontiguousarray(np.moveaxis(x, -1, 0))[:, None]


def _cubic(ends: list[Array], t: Array, order: int) -> Jet:
    return [hermite(ends, t, k) for k in range(order + 1)]


def _rate(q: Array, w: Array) -> Array:
    """Return q' = q (0, w)/2."""
    return quaternion_multiply(q, np.concatenate([np.zeros_like(w[..., :1]), w], axis=-1)) / 2
