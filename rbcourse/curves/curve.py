"""Rotations and poses over time: the class `Curve`."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from functools import cached_property
from html import escape
from typing import Any, Literal, NamedTuple, Self, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbcourse._checks import as_array, as_duration, as_time, check_broadcast, check_order
from rbcourse._docs import described_by
from rbcourse._numerics import BLOCK, Array, blocks, cross
from rbcourse._polynomials import hermite
from rbcourse._quaternions import Jet, angular_velocity, multiply, rotation
from rbcourse._valid import as_rotations_or_poses
from rbcourse.body import Body, of_point

_GROUPS = {3: "SO(3)", 4: "SE(3)"}
HALVES, SIXTEENTHS = np.arange(3) / 2, np.arange(17) / 16
_WIDTH, _HEIGHT = 240, 60  # of pictures
BALL = Body.ball()
Order: TypeAlias = Literal[0, 1, 2, 3]


class SingularTime(ValueError):
    """The error for a time at which curve number `curve` of a stack is undefined."""

    def __init__(
        self, time: float, curve: int, reason: str, batch_shape: tuple[int, ...] = ()
    ) -> None:
        super().__init__(time, curve, reason, batch_shape)
        self.time, self.curve, self.reason, self.batch_shape = self.args

    def __str__(self) -> str:
        return f"t = {self.time}{which_curve(self.curve, self.batch_shape)}: {self.reason}"


class State(NamedTuple):
    """A curve and its first two derivatives: ``c(t)``, ``c(t, 1)`` and ``c(t, 2)``.

    For poses, the acceleration is (w', Rᵀ d''), as `Curve` defines it.
    """

    pose: Array
    velocity: Array
    acceleration: Array


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Curve:
    """A rotation or a pose over time: ``c(t)``, with derivatives ``c(t, 1)`` and ``c(t, 2)``.

    On SO(3), ``c(t)`` is the rotation matrix R. Its derivatives are in the body frame: ``c(t, 1)``
    is the angular velocity w (R' = R hat_so3(w)), ``c(t, 2)`` is the angular acceleration w', and
    ``c(t, 3)`` is the angular jerk w''.

    On SE(3), ``c(t)`` is the pose A, and ``c(t, 1)`` is the twist S = (w, v), with A' = A
    hat_se3(S). ``c(t, 2)`` is the covariant acceleration (w', Rᵀ d'') in metric (14). It is *not*
    the derivative (w', v') of the twist, which `twist_rate` returns. There is no third derivative.

    The derivatives are exact. Times of shape ``t.shape`` and a stack of curves of shape ``(...)``
    give results of the shapes ``t.shape + (..., 3, 3)`` and ``t.shape + (..., 3)``. On SE(3), the
    shapes are ``t.shape + (..., 4, 4)`` and ``t.shape + (..., 6)``. A stack is indexed like an
    array of its shape: ``c[2]`` is its third curve. The first axes of all array attributes are the
    axes of the stack. Curves are immutable, and their arrays are read-only.

    Source: BK (1), BK (9), BK 6.

    Attributes
    ----------
    duration : ndarray, shape (...)
        The duration of each curve, which starts at t = 0. Velocities are per unit of this time.
    body : Body
        The body that moves along the curve, for its costs and for its fastest timing. By default,
        it is the ball of the paper's metrics (12) and (14).
    batch_shape : tuple of int
        The shape of the stack; ``()`` for a single curve.
    domain : tuple of float
        The first and the last time. For a stack, the domain is the interval that all curves have in
        common; for an empty stack, it is (0, inf).
    margin : ndarray, shape (...)
        For projections: the least distance, in a sense that their functions define, from matrices
        without a unique projection. It is infinite for all other curves.
    """

    duration: Array
    body: Body = BALL

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        for name, value in vars(self).items():
            if isinstance(value, np.ndarray) and value.flags.writeable:
                view = value.view()
                view.flags.writeable = False
                object.__setattr__(self, name, view)

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

    @cached_property
    def domain(self) -> tuple[float, float]:
        """The first and the last time."""
        return 0.0, float(self.duration.min(initial=np.inf))

    @property
    def margin(self) -> Array:
        """The margin of a projection; infinite for other curves."""
        return np.full(self.batch_shape, np.inf)

    @property
    def breakpoints(self) -> list[Array]:
        """The ends of panels for a quadrature of each curve, as fractions of its duration.

        The panels are sixteenths of the duration, divided further where a curve may turn fast: near
        an end with a large velocity or acceleration, and near times of small margin. A margin below
        1e-6 raises RuntimeError.
        """
        ends = np.array([[0.0], [1.0]])
        w, a = (np.linalg.norm(self.flat.values(ends, k)[..., :3], axis=-1) for k in (1, 2))
        return graded([SIXTEENTHS] * self.count, ends, 1 / (1 + w + np.sqrt(a)))

    def __call__(self, t: ArrayLike, order: Order = 0) -> Array:
        """Return the curve, or a derivative, at times of any shape in the domain.

        Parameters
        ----------
        t : array_like, shape t.shape
            Times. They may exceed the domain by 8 eps of its larger end.
        order : {0, 1, 2, 3}, optional
            The order of the derivative; on SE(3), at most 2.

        Examples
        --------
        >>> from rbcourse import exp_so3, geodesic
        >>> c = geodesic(np.eye(3), exp_so3([0, 0, 1.5]))
        >>> c(np.linspace(0, 1, 5)).shape, c(0.5, 1).shape
        ((5, 3, 3), (3,))
        """
        self._check_order(order)
        times = as_time(t, 0, self.domain)
        if times.ndim == 0 and not self.batch_shape:
            return self._once(float(times), (order,))[0]
        values = self._evaluate(times.reshape(-1, 1), order)
        return values.reshape(times.shape + self.batch_shape + self._core(order))

    @described_by(__call__, returns="State")
    def state(self, t: ArrayLike) -> State:
        """Return the pose (or rotation), the velocity and the acceleration.

        The fields ``pose``, ``velocity``, ``acceleration`` are ``c(t)``, ``c(t, 1)``, ``c(t, 2)``.
        A controller whose last time is after the end of the curve uses ``min(t, c.domain[1])``.

        Examples
        --------
        >>> from rbcourse import exp_so3, geodesic
        >>> R, w, a = geodesic(np.eye(3), exp_so3([0, 0, 1.5])).state(0.5)
        >>> w.round(12)
        array([0. , 0. , 1.5])
        """
        times = as_time(t, 0, self.domain)
        if times.ndim == 0 and not self.batch_shape:
            return State(*self._once(float(times), (0, 1, 2)))
        return State(self(times), self(times, 1), self(times, 2))

    def _once(self, t: float, orders: tuple[int, ...]) -> list[Array]:
        """Return derivatives of a single curve at one time."""
        T = float(self.duration)
        try:
            values = self._single(0, t / T, orders)
        except SingularTime as error:
            raise SingularTime(error.time * T, 0, error.reason) from None
        return [x / T**k if k else x for x, k in zip(values, orders, strict=True)]

    def _single(self, i: int, t: float, orders: tuple[int, ...]) -> list[Array]:
        """Return derivatives of curve number i of the flat stack at one time from 0 to 1.

        Subclasses replace this by a method without the overhead of stacks.
        """
        flat, time = self.flat if self.count == 1 else self.flat._take([i]), np.array([[t]])
        try:
            return [flat.values(time, k)[0, 0] for k in orders]
        except SingularTime as error:
            raise SingularTime(error.time, i, error.reason) from None

    @described_by(__call__)
    def twist_rate(self, t: ArrayLike) -> Array:
        """Return the derivative of ``c(t, 1)``.

        On SO(3), it is ``c(t, 2)``. On SE(3), it is (w', v') with v' = Rᵀ d'' − w × v.

        Examples
        --------
        >>> from rbcourse import pose_from_coordinates, screw
        >>> c = screw(np.eye(4), pose_from_coordinates([0, 0, 1, 2, 0, 0]))
        >>> c.twist_rate(0.5).round(12) + 0.0  # the twist of a screw motion is constant
        array([0., 0., 0., 0., 0., 0.])
        """
        rate = self(t, 2)
        if self.size == 4:
            twist = self(t, 1)
            rate[..., 3:] -= cross(twist[..., :3], twist[..., 3:])
        return rate

    @described_by(__call__)
    def at_own_times(self, t: ArrayLike, order: Order = 0) -> Array:
        """Evaluate each curve of the stack, or a derivative, at its own times.

        The result has the shape t.shape + (3, 3) or t.shape + (3,); on SE(3), t.shape + (4, 4) or
        t.shape + (6,).

        Parameters
        ----------
        t : array_like, shape (...) + batch_shape
            Times in the domains of the curves.
        """
        times, stacked = as_array("t", t), len(self.batch_shape)
        if times.shape[max(0, times.ndim - stacked) :] != self.batch_shape:
            wanted = ", ".join(["...", *map(str, self.batch_shape)])
            raise ValueError(f"t: shape ({wanted}) is wanted, got {times.shape}")
        start = self.domain[0]
        times = as_time(times, 0, (start, start + self.duration))
        rows = math.prod(times.shape[: times.ndim - stacked])
        self._check_order(order)
        values = self._evaluate(times.reshape(rows, self.count), order)
        return values.reshape(times.shape + self._core(order))

    def __getitem__(self, index: Any) -> Self:
        """Return one curve or a smaller stack, by NumPy's rules of indexing."""
        if not self.batch_shape:
            raise TypeError("a single curve is not a stack and has no index")
        return self._take(np.arange(self.count).reshape(self.batch_shape)[index])

    def __len__(self) -> int:
        """Return the length of the first axis of a stack."""
        if not self.batch_shape:
            raise TypeError("a single curve is not a stack and has no length")
        return self.batch_shape[0]

    def __bool__(self) -> bool:
        """Return True, also for a single curve, which has no length."""
        return True

    def retimed(self, duration: ArrayLike) -> Self:
        """Return the curve reparameterised linearly to a new duration, with the same start time.

        Parameters
        ----------
        duration : array_like, shape (...)
            The new duration, at least 1e-100: one for all curves, or one for each curve. For a
            `chain`, the duration must not be lost in rounding when it is added to the first time.

        Returns
        -------
        Curve
            A curve of the same kind, with the same body. If the duration is multiplied by k,
            velocities and accelerations are divided by k and k², and `acceleration_cost` by k³. If
            a `chain` starts at the time a, its pose at the time t moves to the time a + k (t − a).

        Examples
        --------
        >>> from rbcourse import exp_so3, geodesic
        >>> c = geodesic(np.eye(3), exp_so3([0, 0, 1.5])).retimed(3)
        >>> c.domain, c(3, 1).round(12)
        ((0.0, 3.0), array([0. , 0. , 0.5]))
        """
        T = as_duration("duration", duration)
        if check_broadcast(curve=(self.duration, 0), duration=(T, 0)) != self.batch_shape:
            wanted = f"a single number or shape {self.batch_shape} is wanted"
            raise ValueError(f"duration: {wanted}, got shape {T.shape}")
        return self._lasting(np.broadcast_to(T, self.batch_shape))

    def moved(self, left: ArrayLike | None = None, right: ArrayLike | None = None) -> Curve:
        """Return the curve L c(t) X: the same motion in another fixed frame or body frame.

        Parameters
        ----------
        left, right : array_like, shape (3, 3) on SO(3), (4, 4) on SE(3), optional
            L moves the fixed frame. X is the new body frame in the old one, such as the offset of a
            tool.

        Returns
        -------
        Curve
            A curve with the same body, whose inertia and centre are relative to the new body frame,
            and with the same costs. `fastest` and `limits_used` still limit the speed of this
            centre; for another point, give them a body. A `chain` remains a chain; other curves
            have the attribute ``curve``, the original.

        Examples
        --------
        >>> from rbcourse import pose_from_coordinates, screw
        >>> c = screw(np.eye(4), pose_from_coordinates([0, 0, np.pi / 2, 0, 0, 0]))
        >>> tip = c.moved(right=pose_from_coordinates([0, 0, 0, 2, 0, 0]))  # 2 m ahead
        >>> tip(1)[:3, 3].round(12), tip(1, 1)[3:].round(3)
        (array([0., 2., 0.]), array([0.   , 3.142, 0.   ]))
        """
        L, X = self._frame("left", left), self._frame("right", right)
        return self._moved(L, X)

    def _frame(self, name: str, given: ArrayLike | None) -> Array:
        core = self._core(0)
        if given is None:
            return np.eye(self.size)
        if self.size == 4 and np.shape(given) == (3,):
            raise ValueError(
                f"{name}: a pose is wanted, such as pose_from_components(np.eye(3), d), got {given}"
            )
        frame, _ = as_rotations_or_poses(name, given)
        if frame.shape != core:
            what = {3: "rotations", 4: "poses"}[self.size]
            raise ValueError(
                f"{name}: shape {core} is wanted, since the curve consists of {what}, "
                f"got {frame.shape}"
            )
        return frame

    def _moved(self, L: Array, X: Array) -> Curve:
        d = X[:3, 3] if self.size == 4 else np.zeros(3)
        body = self.body.moved(X[:3, :3], d)
        return Moved(duration=self.duration, body=body, curve=self, left=L, right=X)

    def __repr__(self) -> str:
        """Return the kind of curve, the stack, the domain, and the cost of an optimum."""
        stack = f", stack of shape {self.batch_shape}" if self.batch_shape else ""
        start, end = self.domain
        what = f"{self._what()} on {_GROUPS[self.size]}{stack}, t in [{start:g}, {end:g}]"
        return f"<{what}{self._result()}>"

    def _repr_html_(self) -> str:
        """Return the description and, for a single curve, a picture of its speeds."""
        words, drawn = escape(repr(self)[1:-1]), ""
        if not self.batch_shape:
            with suppress(RuntimeError, ValueError):  # the curve jumps
                rates = self(np.linspace(*self.domain, 121), 1)
                drawn = "<br>" + _graph(rates[:, :3], "#0072b2", "‖ω‖", "rad")
                if self.size == 4:
                    drawn += _graph(rates[:, 3:], "#d55e00", "‖v‖", "m")
        return f"<div>{words}{drawn}</div>"

    def _what(self) -> str:
        return type(self).__name__

    def _result(self) -> str:
        """Return words about the cost of an optimum; "" for other curves."""
        return ""

    def _take(self, index: Any) -> Self:
        """Return the curves with these indices in the flattened stack, in the shape of `index`."""
        parts = {field.name: getattr(self, field.name) for field in fields(self)}
        stacked = len(self.batch_shape)
        for name, value in parts.items():
            if isinstance(value, Curve):
                parts[name] = value._take(index)
            elif isinstance(value, Body):
                parts[name] = value._take(index, self.batch_shape)
            elif isinstance(value, np.ndarray):
                flat = value.reshape(self.count, *value.shape[stacked:])
                parts[name] = np.asarray(flat[index])
        return type(self)(**parts)

    def _lasting(self, duration: Array) -> Self:
        """Return the same curves with other durations, without the checks of `retimed`."""
        return replace(self, duration=duration)

    def values(self, t: Array, order: int) -> Array:
        """Return all curves of a flat stack, or a derivative, at times from 0 to 1.

        Subclasses implement this method. The result has the shape (T, count, 3, 3) or (T, count,
        3); on SE(3), (T, count, 4, 4) or (T, count, 6). SingularTime is raised if a curve is not
        defined at one of the times.

        Parameters
        ----------
        t : ndarray, shape (T, count) or (T, 1)
            Times as fractions of the durations.
        order : int
            The order of the derivative with respect to these times.
        """
        raise NotImplementedError

    def _evaluate(self, t: Array, order: int) -> Array:
        """Return `values` at times in the domains of the curves, without checks."""
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
        return self if len(self.batch_shape) == 1 else self._take(np.arange(self.count))

    def _check_order(self, order: int) -> None:
        check_order(order, 3 if self.size == 3 else 2)

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

    def _single(self, i: int, t: float, orders: tuple[int, ...]) -> list[Array]:
        flat, time = self.flat, np.array([[t]])
        Q = flat.quaternion(flat._first[:, :, None, i : i + 1], time, max(orders))
        try:
            flat._check(Q[0], time)
        except SingularTime as error:
            raise SingularTime(error.time, i, error.reason) from None
        return [
            angular_velocity(Q[: k + 1])[:, 0, 0]
            if k
            else rotation(multiply(flat.start[i], Q[0][:, 0, 0]))
            for k in orders
        ]

    def _check(self, Q: Array, t: Array) -> None:
        """Raise SingularTime if Q is 0 up to rounding at one of the times."""

    @cached_property
    def _first(self) -> Array:
        """The controls, with the axis of the components moved to the front."""
        return np.ascontiguousarray(np.moveaxis(self.controls, (-2, -1), (0, 1)))


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Moved(Curve):
    """The `Curve` L c(t) X; ``curve`` is c, ``left`` is L and ``right`` is X."""

    curve: Curve
    left: Array
    right: Array

    @property
    def size(self) -> int:
        """The size of the curve's matrices."""
        return self.curve.size

    @property
    def margin(self) -> Array:
        """The margin of the curve that is moved."""
        return self.curve.margin

    @property
    def breakpoints(self) -> list[Array]:
        """The `Curve.breakpoints` of the curve that is moved."""
        return self.curve.breakpoints

    def _take(self, index: Any) -> Self:
        some, body = self.curve._take(index), self.body._take(index, self.batch_shape)
        return replace(self, duration=some.duration, body=body, curve=some)

    def _lasting(self, duration: Array) -> Self:
        return replace(self, duration=duration, curve=self.curve._lasting(duration))

    def _single(self, i: int, t: float, orders: tuple[int, ...]) -> list[Array]:
        pose, *rates = self.curve._single(i, t, tuple(range(max(orders) + 1)))
        found = [self.left @ pose @ self.right, *moved_rates(self.right, *rates)]
        return [found[k] for k in orders]

    def values(self, t: Array, order: int) -> Array:
        """Return L c X, or a derivative in the new body frame."""
        if order == 0:
            return self.left @ self.curve.values(t, 0) @ self.right
        return moved_rates(self.right, *(self.curve.values(t, k + 1) for k in range(order)))[-1]


def moved_rates(X: Array, *rates: Array) -> list[Array]:
    """Return velocities and accelerations (as ``c(t, 1)`` and ``c(t, 2)``) relative to the frame X.

    The new origin is a point of the body.
    """
    R = X[:3, :3]
    found = [rate[..., :3] @ R for rate in rates]
    if X.shape == (3, 3):
        return found
    moving = [of_point(X[:3, 3], *rates[:k]) @ R for k in range(1, len(rates) + 1)]
    return [np.concatenate(pair, axis=-1) for pair in zip(found, moving, strict=True)]


def other_way(turn: Array) -> Array:
    """Return the rotation vectors that reach the same rotations the other way round."""
    angle = np.linalg.norm(turn, axis=-1, keepdims=True)
    return turn - 2 * np.pi * turn / np.where(angle == 0, 1, angle)


def polynomial_jet(ends: Array, t: Array, order: int) -> Jet:
    """Return the jet of the Hermite polynomial with these ends."""
    return [hermite(ends, t, k) for k in range(order + 1)]


def weighted_sums(weights: Array, terms: Array, *core: int) -> Array:
    """Return, for each curve of a stack, the weighted sums of its terms.

    `weights` has the shape (T, count, n) or (T, 1, n), `terms` has the shape (count, n, m), and the
    result has the shape (T, count) + core.
    """
    sums = np.empty((len(weights), len(terms), terms.shape[-1]))
    np.matmul(np.swapaxes(weights, 0, 1), terms, out=np.swapaxes(sums, 0, 1))
    return sums.reshape(*sums.shape[:2], *core)


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


def near_margins(points: list[Array], times: ArrayLike, margins: ArrayLike) -> list[Array]:
    """Refine the points of each curve near a small margin; a margin below 1e-6 is an error."""
    gaps = np.ravel(margins)
    if gaps.min(initial=np.inf) < 1e-6:
        raise RuntimeError(f"cost: the curve almost jumps (margin {gaps.min():.1e})")
    return graded(points, np.ravel(times), np.where(gaps < 0.25, gaps / 4, 1))


def graded(points: list[Array], times: ArrayLike, widths: ArrayLike) -> list[Array]:
    """Refine the points of each curve near its times, shape (count,) or (n, count).

    The new points are in [0, 1], at the distances 1/32, 1/64, …, `widths` from the times.
    """
    points = list(points)
    times, widths = np.broadcast_arrays(times, np.atleast_2d(widths))
    finest = 2 - np.floor(np.log2(widths))
    for k, i in np.argwhere(finest > 5):
        apart = 2.0 ** -np.arange(5, finest[k, i])
        near = times[k, i] + np.concatenate([-apart, [0], apart])
        points[i] = np.union1d(points[i], near[(near >= 0) & (near <= 1)])
    return points


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


def _graph(rates: Array, colour: str, name: str, unit: str) -> str:
    """Return a small graph of the norm over time, from 0 to its largest value."""
    speed = np.linalg.norm(rates, axis=-1)
    largest = speed.max()
    if not np.isfinite(largest):
        return ""
    x = np.linspace(2, _WIDTH - 2, len(speed))
    y = _HEIGHT - 2 - (_HEIGHT - 4) * speed / (largest or 1)
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))
    line = f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="1.5"/>'
    frame = f'<path d="M1 1V{_HEIGHT - 1}H{_WIDTH}" fill="none" stroke="currentColor"/>'
    label = f"{name} up to {largest:.3g} {unit} per unit of time"
    return (
        f'<span style="display:inline-block;margin-right:1em;font-size:small">{label}<br>'
        f'<svg width="{_WIDTH}" height="{_HEIGHT}" role="img" aria-label="{label}">'
        f"{frame}{line}</svg></span>"
    )
