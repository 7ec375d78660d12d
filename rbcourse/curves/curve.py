"""Rotations and poses over time: the class `Curve`, boundary conditions, and geodesics."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, NamedTuple, Self, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbcourse._checks import (
    as_array,
    as_duration,
    as_finite,
    as_inertia,
    as_time,
    check_broadcast,
    check_order,
)
from rbcourse._hermite import hermite
from rbcourse._numerics import BLOCK, Array, blocks, cross
from rbcourse._taylor import Jet, angular_velocity, multiply, rotation
from rbcourse._valid import as_rotations
from rbcourse.so3 import hat, log

_GROUPS = {3: "SO(3)", 4: "SE(3)"}
AnyCurve = TypeVar("AnyCurve", bound="Curve")


class _Ends(NamedTuple):
    R0: Array
    R1: Array
    w0: Array
    w1: Array


class Ends(_Ends):
    """Boundary conditions: rotations and angular velocities at both ends, in a common batch shape.

    `Ends` is a tuple, so that ``make(*ends)`` calls a function ``make`` with these arguments.
    Source: BK 6.2.

    Parameters
    ----------
    R0, R1, w0, w1 : array_like, shapes (..., 3, 3) and (..., 3)
        Rotation matrices and angular velocities.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> ends = Ends(np.eye(3), exp_so3([[0, 0, 1], [0, 0, 1.5]]), [0, 0, 0], [0, 1, 0])
    >>> ends.w1.shape
    (2, 3)
    """

    __slots__ = ()

    def __new__(cls, R0: ArrayLike, R1: ArrayLike, w0: ArrayLike, w1: ArrayLike) -> Self:
        """Check the arguments, and broadcast them to a common batch shape."""
        R0 = as_rotations("R0", R0)
        R1 = as_rotations("R1", R1)
        w0 = as_finite("w0", w0, 3)
        w1 = as_finite("w1", w1, 3)
        batch = check_broadcast(R0=(R0, 2), R1=(R1, 2), w0=(w0, 1), w1=(w1, 1))
        return cls._make((R0, R1, w0, w1)).broadcast_to(batch)

    @property
    def turn(self) -> Array:
        """The rotation R0ᵀ R1 from the start to the end."""
        return np.swapaxes(self.R0, -1, -2) @ self.R1

    def over(self, duration: ArrayLike) -> tuple[Self, Array]:
        """Return the ends rescaled to unit time, and the durations, in a common batch shape."""
        T = as_duration("duration", duration)
        batch = check_broadcast(ends=(self.R0, 2), duration=(T, 0))
        T, (R0, R1, w0, w1) = np.broadcast_to(T, batch), self.broadcast_to(batch)
        return type(self)._make((R0, R1, T[..., None] * w0, T[..., None] * w1)), T

    def flat(self) -> Self:
        """Return the ends with a single batch axis."""
        return type(self)._make(x.reshape(-1, *x.shape[self.w0.ndim - 1 :]) for x in self)

    def broadcast_to(self, batch: tuple[int, ...]) -> Self:
        """Return the ends, broadcast to another batch shape."""
        shapes = (3, 3), (3, 3), (3,), (3,)
        arrays = zip(self, shapes, strict=True)
        return type(self)._make(np.broadcast_to(x, (*batch, *shape)) for x, shape in arrays)

    def take(self, index: Any) -> Self:
        """Return the ends that a NumPy index into the batch axes selects."""
        return type(self)._make(x[index] for x in self)


def with_inertia(ends: Ends, inertia: ArrayLike) -> tuple[Ends, Array]:
    """Broadcast the boundary conditions and the inertia to a common batch shape."""
    G = as_inertia("inertia", inertia)
    batch = check_broadcast(ends=(ends.R0, 2), inertia=(G, 2))
    return ends.broadcast_to(batch), np.broadcast_to(G, (*batch, 3, 3))


class SingularTime(ValueError):
    """The error for a time at which curve number `curve` of a stack is undefined."""

    def __init__(
        self, time: float, curve: int, reason: str, batch_shape: tuple[int, ...] = ()
    ) -> None:
        super().__init__(time, curve, reason, batch_shape)
        self.time, self.curve, self.reason, self.batch_shape = self.args

    def __str__(self) -> str:
        return f"t = {self.time}{which_curve(self.curve, self.batch_shape)}: {self.reason}"


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Curve:
    """A rotation or a pose over time: ``c(t)``, with derivatives ``c(t, 1)`` and ``c(t, 2)``.

    On SO(3), ``c(t)`` is the rotation matrix R. Its derivatives are in the body frame: ``c(t, 1)``
    is the angular velocity w (R' = R hat_so3(w)), ``c(t, 2)`` is the angular acceleration w', and
    ``c(t, 3)`` is the angular jerk w''.

    On SE(3), ``c(t)`` is the pose A, and ``c(t, 1)`` is the twist S = (w, v), with A' = A
    hat_se3(S). ``c(t, 2)`` is the covariant acceleration (w', Rᵀ d'') in metric (14). It is *not*
    the derivative (w', v') of the twist, which `twist_rate` returns.

    The derivatives are exact. Times of shape ``t.shape`` and a stack of curves of shape ``(...)``
    give results of the shapes ``t.shape + (..., 3, 3)`` and ``t.shape + (..., 3)``. On SE(3), the
    shapes are ``t.shape + (..., 4, 4)`` and ``t.shape + (..., 6)``. A stack is indexed like an
    array of its shape: ``c[2]`` is its third curve. The first axes of all array attributes are the
    axes of the stack.

    Source: BK (1), BK (9), BK 6.

    Attributes
    ----------
    duration : ndarray, shape (...)
        The duration of each curve, which starts at t = 0. Velocities are per unit of this time.
    batch_shape : tuple of int
        The shape of the stack; ``()`` for a single curve.
    domain : tuple of float
        The first and the last time. For a stack, the domain is the interval that all curves have in
        common; for an empty stack, it is (0, inf).
    """

    duration: Array

    @property
    def batch_shape(self) -> tuple[int, ...]:
        """The shape of the stack."""
        return self.duration.shape

    @property
    def size(self) -> int:
        """The size of the curve's matrices: 3 on SO(3), 4 on SE(3)."""
        return 3

    @property
    def count(self) -> int:
        """The number of curves."""
        return self.duration.size

    @property
    def domain(self) -> tuple[float, float]:
        """The first and the last time."""
        return 0.0, float(self.duration.min(initial=np.inf))

    @property
    def breakpoints(self) -> Array:
        """The ends of panels for a quadrature, as fractions of the duration, shape (n,).

        The panels are sixteenths of the duration, divided further where a curve may turn fast: near
        an end with a large velocity or acceleration, and near times of small margin. A margin below
        1e-6 raises RuntimeError.
        """
        ends = np.array([[0.0], [1.0]])
        w, a = (np.linalg.norm(self.flat.values(ends, k)[..., :3], axis=-1) for k in (1, 2))
        fastest = (w + np.sqrt(a)).max(axis=1, initial=0)
        return graded(np.arange(17) / 16, [0.0, 1.0], 1 / (1 + fastest))

    def __call__(self, t: ArrayLike, order: int = 0) -> Array:
        """Return the curve, or a derivative, at times of any shape in the domain.

        `order` is from 0 to 3, or from 0 to 2 on SE(3). Times may exceed the domain by 8 eps of its
        larger end.

        Examples
        --------
        >>> from rbcourse import exp_so3
        >>> c = geodesic_so3(np.eye(3), exp_so3([0, 0, 1.5]))
        >>> c(np.linspace(0, 1, 5)).shape, c(0.5, 1).shape
        ((5, 3, 3), (3,))
        """
        times = as_time(t, 0, self.domain)
        values = self.evaluate(times.reshape(-1, 1), self._check_order(order))
        return values.reshape(times.shape + self.batch_shape + self._core(order))

    def twist_rate(self, t: ArrayLike) -> Array:
        """Return the derivative of ``c(t, 1)``.

        On SO(3), it is ``c(t, 2)``. On SE(3), it is (w', v') with v' = Rᵀ d'' − w × v.

        Examples
        --------
        >>> from rbcourse import pose_from_coordinates, screw_se3
        >>> c = screw_se3(np.eye(4), pose_from_coordinates([0, 0, 1, 2, 0, 0]))
        >>> c.twist_rate(0.5).round(12) + 0.0  # the twist of a screw motion is constant
        array([0., 0., 0., 0., 0., 0.])
        """
        rate = self(t, 2)
        if self.size == 4:
            twist = self(t, 1)
            rate[..., 3:] -= cross(twist[..., :3], twist[..., 3:])
        return rate

    def at_own_times(self, t: ArrayLike, order: int = 0) -> Array:
        """Evaluate each curve of the stack, or a derivative, at its own times.

        `t` has the shape (...) + batch_shape. The result has the shape t.shape + (3, 3) or t.shape
        + (3,); on SE(3), t.shape + (4, 4) or t.shape + (6,).
        """
        times, stacked = as_array("t", t), len(self.batch_shape)
        if times.shape[max(0, times.ndim - stacked) :] != self.batch_shape:
            wanted = ", ".join(["...", *map(str, self.batch_shape)])
            raise ValueError(f"t: shape ({wanted}) is wanted, got {times.shape}")
        start = self.domain[0]
        times = as_time(times, 0, (start, start + self.duration))
        rows = math.prod(times.shape[: times.ndim - stacked])
        values = self.evaluate(times.reshape(rows, self.count), self._check_order(order))
        return values.reshape(times.shape + self._core(order))

    def __getitem__(self, index: Any) -> Self:
        """Return one curve or a smaller stack, by NumPy's rules of indexing."""
        if not self.batch_shape:
            raise TypeError("a single curve is not a stack and has no index")
        return self.take(np.arange(self.count).reshape(self.batch_shape)[index])

    def __repr__(self) -> str:
        """Return the kind of curve, the shape of the stack, and the domain."""
        stack = f", stack of shape {self.batch_shape}" if self.batch_shape else ""
        start, end = self.domain
        return f"<{self._what()} on {_GROUPS[self.size]}{stack}, t in [{start:g}, {end:g}]>"

    def _what(self) -> str:
        return type(self).__name__

    def take(self, index: Any) -> Self:
        """Return the stack of the curves with these indices in the flattened stack."""
        parts = {field.name: getattr(self, field.name) for field in fields(self)}
        stacked = len(self.batch_shape)
        for name, value in parts.items():
            if isinstance(value, Curve):
                parts[name] = value.take(index)
            elif isinstance(value, np.ndarray):
                flat = value.reshape(self.count, *value.shape[stacked:])
                parts[name] = np.asarray(flat[index])
        return type(self)(**parts)

    def lasting(self, duration: Array) -> Self:
        """Return the same curves with other durations."""
        return replace(self, duration=duration)

    def values(self, t: Array, order: int) -> Array:
        """Return all curves of a flat stack, or a derivative, at times from 0 to 1.

        Subclasses implement this method. `t` has the shape (T, count) or (T, 1). The result has the
        shape (T, count, 3, 3) or (T, count, 3); on SE(3), (T, count, 4, 4) or (T, count, 6).
        SingularTime is raised if a curve is not defined at one of the times.
        """
        raise NotImplementedError

    def evaluate(self, t: Array, order: int) -> Array:
        """Return all curves, or a derivative, at the times t, shape (T, count) or (T, 1)."""
        T, core = self.flat.duration, self._core(order)
        shares = t / (T[:1] if np.all(T[:1] == T) else T)
        values = np.empty((len(t), self.count, *core))
        try:
            for rows in blocks(len(t), max(1, BLOCK // max(1, self.count))):
                values[rows] = self.flat.values(shares[rows], order)
        except SingularTime as error:
            k = error.curve
            time = error.time * float(T[k])
            raise SingularTime(time, k, error.reason, self.batch_shape) from None
        if order:
            values /= T.reshape(-1, *(1 for _ in core)) ** order
        return values

    @cached_property
    def flat(self) -> Self:
        """The same curves as a stack with one axis."""
        return self if len(self.batch_shape) == 1 else self.take(np.arange(self.count))

    def _check_order(self, order: int) -> int:
        return check_order(order, 3 if self.size == 3 else 2)

    def _core(self, order: int) -> tuple[int, ...]:
        return (self.size,) * 2 if order == 0 else (3 * self.size - 6,)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class QuaternionCurve(Curve):
    """The `Curve` of a fixed rotation times the rotation of a quaternion Q(t), of any norm.

    Source: BK 1.
    """

    start: Array  # the fixed rotation as a quaternion, shape (..., 4)
    controls: Array  # the data that define Q, shape (..., n, components)

    def quaternion(self, controls: Array, t: Array, order: int) -> Jet:
        """Return the jet of Q at the times t; the controls broadcast with the times."""
        raise NotImplementedError

    def values(self, t: Array, order: int) -> Array:
        """Return the start rotation times the rotation of Q, or a derivative."""
        Q = self.quaternion(self._first[..., None, :], t, order)
        self._check(Q[0], t)
        if order:
            return np.moveaxis(angular_velocity(Q), 0, -1)
        return rotation(multiply(self.start.T[:, None], Q[0]))

    def _check(self, Q: Array, t: Array) -> None:
        """Raise SingularTime if Q is 0 up to rounding at one of the times."""

    @cached_property
    def _first(self) -> Array:
        """The controls, with the axis of the components moved to the front."""
        return np.ascontiguousarray(np.moveaxis(self.controls, (-2, -1), (0, 1)))


def other_way(turn: Array) -> Array:
    """Return the rotation vectors that reach the same rotations the other way round."""
    angle = np.linalg.norm(turn, axis=-1, keepdims=True)
    return turn - 2 * np.pi * turn / np.where(angle == 0, 1, angle)


def polynomial_jet(ends: Array, t: Array, order: int) -> Jet:
    """Return the jet of the Hermite polynomial with these ends."""
    return [hermite(ends, t, k) for k in range(order + 1)]


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class AlongGeodesic(Curve):
    """The `Curve` R0 exp(σ̂ p(t)) on the geodesic from R0 to R0 exp(σ̂); by default, p(t) = t.

    Source: BK 6.1.

    Attributes
    ----------
    R0, rotation_vector : ndarray, shapes (..., 3, 3) and (..., 3)
        The start, and the rotation vector σ from the start to the goal, in the body frame.
    """

    rotation_vector: Array
    terms: Array  # R0, R0 K and R0 K², for Rodrigues' formula R0 (I + sin a K + (1 − cos a) K²)

    @property
    def R0(self) -> Array:
        """The start."""
        return self.terms[..., 0, :, :]

    def _progress(self, t: Array, order: int) -> Array:
        """Return p or a derivative, shape (T, count) or (T, 1)."""
        return identity(t, order)

    def values(self, t: Array, order: int) -> Array:
        """Return R0 exp(σ̂ p), or σ times a derivative of p."""
        progress, count = self._progress(t, order), self.count
        if order:
            values = np.empty((len(t), count, 3))
            for i in range(3):  # four times as fast as one product
                np.multiply(progress, self.rotation_vector[:, i], out=values[..., i])
            return values
        weights = np.empty((3, count, len(t)))
        weights[0] = 1
        _write_sine_and_versine(progress.T, self._half_angle, *weights[1:])
        return weighted_sums(weights.T, self.terms.reshape(count, 3, 9), 3, 3)

    @cached_property
    def _half_angle(self) -> Array:
        return np.linalg.norm(self.rotation_vector, axis=-1, keepdims=True) / 2


def _write_sine_and_versine(progress: Array, half: Array, sine: Array, versine: Array) -> None:
    """Write sin a and 1 − cos a, computed from tan(a/2), where a is 2 · `half` · `progress`."""
    tangent = np.tan(np.multiply(progress, half, out=versine), out=versine)
    np.multiply(tangent, tangent, out=sine)
    sine += 1
    np.divide(tangent, sine, out=sine)
    sine *= 2
    versine *= sine


def weighted_sums(weights: Array, terms: Array, *core: int) -> Array:
    """Return, for each curve of a stack, the weighted sums of its terms.

    `weights` has the shape (T, count, n) or (T, 1, n), `terms` has the shape (count, n, m), and the
    result has the shape (T, count) + core.
    """
    sums = np.empty((len(weights), len(terms), terms.shape[-1]))
    np.matmul(np.swapaxes(weights, 0, 1), terms, out=np.swapaxes(sums, 0, 1))
    return sums.reshape(*sums.shape[:2], *core)


def geodesic_so3(R0: ArrayLike, R1: ArrayLike, *, duration: ArrayLike = 1.0) -> AlongGeodesic:
    """Return the shortest curve from R0 to R1, at constant angular velocity.

    Source: BK 6.1.

    Parameters
    ----------
    R0, R1 : array_like, shape (..., 3, 3)
        Rotation matrices.
    duration : array_like, shape (...), optional
        The duration of the motion.

    Returns
    -------
    AlongGeodesic
        The `Curve` R0 exp(σ̂ t), where the ``rotation_vector`` is σ = log_so3(R0ᵀ R1), with ‖σ‖ ≤
        π.

    Notes
    -----
    Singular set: R0 and R1 are a half-turn apart. Two geodesics are then shortest. In the
    ``rotation_vector`` of the returned geodesic, the component of largest magnitude (the first, if
    several are equal) is positive.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> c = geodesic_so3(np.eye(3), exp_so3([0, 0, 1.5]), duration=3)
    >>> c(0.3, 1).round(12)  # the velocity
    array([0. , 0. , 0.5])
    """
    return AlongGeodesic(**geodesic_data(R0, R1, duration))


def geodesic_data(R0: ArrayLike, R1: ArrayLike, duration: ArrayLike) -> dict[str, Array]:
    """Return the attributes of the `AlongGeodesic` that `geodesic_so3` returns."""
    R0, R1 = as_rotations("R0", R0), as_rotations("R1", R1)
    T = as_duration("duration", duration)
    batch = check_broadcast(R0=(R0, 2), R1=(R1, 2), duration=(T, 0))
    turn = np.broadcast_to(log(np.swapaxes(R0, -1, -2) @ R1), (*batch, 3))
    angle = np.linalg.norm(turn, axis=-1, keepdims=True)
    K = hat(turn / np.where(angle == 0, 1.0, angle))
    swept = R0 @ K
    terms = np.stack(np.broadcast_arrays(R0, swept, swept @ K), axis=-3)
    return {"duration": np.broadcast_to(T, batch), "rotation_vector": turn, "terms": terms}


def retime(curve: AnyCurve, duration: ArrayLike) -> AnyCurve:
    """Return the curve reparameterised linearly to a new duration, with the same start time.

    Parameters
    ----------
    curve : Curve
        A curve or a stack of curves.
    duration : array_like, shape (...)
        The new duration, at least 1e-100: one for all curves, or one for each curve. For a `chain`,
        the duration must not be lost in rounding when it is added to the first time.

    Returns
    -------
    Curve
        A curve of the same kind. If the duration is multiplied by k, velocities and accelerations
        are divided by k and k², and `acceleration_cost` by k³. If a `chain` starts at the time a,
        its pose at the time t moves to the time a + k (t − a).

    Examples
    --------
    >>> from rbcourse import exp_so3, geodesic_so3
    >>> c = retime(geodesic_so3(np.eye(3), exp_so3([0, 0, 1.5])), 3)
    >>> c.domain, c(3, 1).round(12)
    ((0.0, 3.0), array([0. , 0. , 0.5]))
    """
    if not isinstance(curve, Curve):
        raise ValueError(f"curve: a Curve is wanted, got {curve!r}")
    T = as_duration("duration", duration)
    if check_broadcast(curve=(curve.duration, 0), duration=(T, 0)) != curve.batch_shape:
        raise ValueError(
            f"duration: a single number or shape {curve.batch_shape} is wanted, got shape {T.shape}"
        )
    return curve.lasting(np.broadcast_to(T, curve.batch_shape))


def identity(t: Array, order: int) -> Array:
    """Return t or, for order > 0, its derivative."""
    return t if order == 0 else np.full_like(t, order == 1)


def which_curve(curve: int, batch_shape: tuple[int, ...]) -> str:
    """Return words by which messages identify one curve of a stack, or "" for a single curve."""
    index = [int(i) for i in np.unravel_index(curve, batch_shape)] if batch_shape else []
    return f" of curve {index}" if index else ""


def check_defined(t: Array, lost: NDArray[np.bool_], reason: str) -> None:
    """Raise `SingularTime` for the first time at which a curve is `lost`, shape (T, count)."""
    if lost.any():
        time, curve = np.argwhere(lost)[0]
        raise SingularTime(float(np.broadcast_to(t, lost.shape)[time, curve]), int(curve), reason)


def near_margins(points: Array, times: ArrayLike, margins: ArrayLike) -> Array:
    """Refine `points` near small margins; raise RuntimeError for a margin below 1e-6."""
    gaps = np.ravel(margins)
    if gaps.min(initial=np.inf) < 1e-6:
        raise RuntimeError(f"cost: the curve almost jumps (margin {gaps.min():.1e})")
    when, small = np.broadcast_to(np.ravel(times), gaps.shape), gaps < 0.25
    return graded(points, when[small], gaps[small] / 4)


def graded(points: Array, times: ArrayLike, widths: ArrayLike) -> Array:
    """Add to `points` those in [0, 1] whose distances from `times` are 1/32, 1/64, …, `widths`."""
    cuts = [points]
    for when, width in zip(np.ravel(times), np.ravel(widths), strict=True):
        apart = 2.0 ** -np.arange(5, max(5, 2 - np.floor(np.log2(width))))
        cuts += [np.append(when - apart, when), when + apart]
    points = np.unique(np.concatenate(cuts))
    return points[(points >= 0) & (points <= 1)]


def least_over_time(
    value: Callable[[Array], Array], batch_shape: tuple[int, ...]
) -> tuple[Array, Array]:
    """Return the time of a function's minimum, and the minimum.

    The function takes times of the shape (N,) + batch_shape and returns values of this shape. Both
    results have the shape batch_shape.
    """
    centre, reach, count = np.full(batch_shape, 0.5), 0.5, 129
    while reach > 1e-15:
        steps = np.linspace(-reach, reach, count).reshape(-1, *(1 for _ in batch_shape))
        times = np.clip(centre + steps, 0, 1)
        values = value(times)
        least = values.argmin(axis=0)[None]
        centre = np.take_along_axis(times, least, axis=0)[0]
        reach, count = 2 * reach / (count - 1), 17
    return centre, np.take_along_axis(values, least, axis=0)[0]
