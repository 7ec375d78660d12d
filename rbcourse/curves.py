"""Rotations and poses over time: what a curve is, its boundary conditions, and the geodesic."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from copy import copy
from functools import cached_property
from itertools import pairwise
from typing import Any, ClassVar, NamedTuple, Self, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbcourse._checks import (
    as_finite,
    as_inertia,
    as_positive,
    as_time,
    check_broadcast,
    check_order,
)
from rbcourse._numerics import Array, blocks
from rbcourse.so3 import hat, log_so3

Chosen: TypeAlias = NDArray[np.intp]
BLOCK = 4096  # rotations that are evaluated together, in the cache
LONG_RUN = 8  # times on one curve for which a matrix product of their own pays
SHORTEST = 1e-100  # of a duration
_GROUPS = {3: "SO(3)", 4: "SE(3)"}


class _Ends(NamedTuple):
    R0: Array
    R1: Array
    w0: Array
    w1: Array


class Ends(_Ends):
    """Boundary conditions at t = 0 and 1, all of one batch shape: rotations and body velocities.

    It is a tuple, so that the makers of curves take it as ``make(*ends)``.

    Parameters
    ----------
    R0, R1 : array_like, shape (..., 3, 3)
        Rotation matrices. Validity is not checked; see `project_so`.
    w0, w1 : array_like, shape (..., 3)
        Angular velocities, body frame, in rad per unit time.

    References
    ----------
    BK 6.2.

    Examples
    --------
    >>> from rbcourse import acceleration_cost, bezier_so3, exp_so3, projected_cubic_so3
    >>> ends = Ends(np.eye(3), exp_so3([[0, 0, 1], [0, 0, 1.5]]), [0, 0, 0], [0, 1, 0])
    >>> ends.w1.shape
    (2, 3)
    >>> costs = [acceleration_cost(make(*ends)) for make in (projected_cubic_so3, bezier_so3)]
    """

    __slots__ = ()

    def __new__(cls, R0: ArrayLike, R1: ArrayLike, w0: ArrayLike, w1: ArrayLike) -> Self:
        """Check the arguments, and give them one batch shape."""
        R0, R1 = as_finite("R0", R0, 3, 3), as_finite("R1", R1, 3, 3)
        w0, w1 = as_finite("w0", w0, 3), as_finite("w1", w1, 3)
        batch = check_broadcast(R0=(R0, 2), R1=(R1, 2), w0=(w0, 1), w1=(w1, 1))
        return cls._make((R0, R1, w0, w1)).broadcast_to(batch)

    @property
    def turn(self) -> Array:
        """R0ᵀ R1."""
        return np.swapaxes(self.R0, -1, -2) @ self.R1

    def flat(self) -> Self:
        """Return the same with one batch axis."""
        return type(self)._make(x.reshape(-1, *x.shape[self.w0.ndim - 1 :]) for x in self)

    def broadcast_to(self, batch: tuple[int, ...]) -> Self:
        """Return the same with another batch shape."""
        shapes = (3, 3), (3, 3), (3,), (3,)
        arrays = zip(self, shapes, strict=True)
        return type(self)._make(np.broadcast_to(x, (*batch, *shape)) for x, shape in arrays)

    def take(self, index: Any) -> Self:
        """Return some of the problems, by an index of NumPy's into the batch axes."""
        return type(self)._make(x[index] for x in self)


def with_inertia(ends: Ends, inertia: ArrayLike) -> tuple[Ends, Array]:
    """Return the boundary conditions and the inertia of bodies, of one batch shape.

    Raises
    ------
    ValueError
        If `inertia` is not finite, not of shape (..., 3, 3), not symmetric and positive definite,
        or the batches do not broadcast.
    """
    G = as_inertia("inertia", inertia)
    batch = check_broadcast(ends=(ends.R0, 2), inertia=(G, 2))
    return ends.broadcast_to(batch), np.broadcast_to(G, (*batch, 3, 3))


class SingularTime(ValueError):
    """A curve is not defined at a time; `curve` is its number in the stack."""

    def __init__(self, time: float, curve: int, batch_shape: tuple[int, ...], why: str) -> None:
        super().__init__(time, curve, batch_shape, why)
        self.curve, self.reason = curve, f"t = {time}: {why}"
        self._said = f"t = {time}{which_curve(curve, batch_shape)}: {why}"

    def __str__(self) -> str:
        return self._said


class Curve:
    """A rotation or a pose over time: ``c(t)``, with derivatives ``c(t, 1)`` and ``c(t, 2)``.

    On SO(3) ``c(t, 2)`` is the derivative of ``c(t, 1)``; on SE(3) it is not, see below. Times t
    are in [0, 1], except for the curves that `retime` and `chain` return.

    On SO(3), ``c(t)`` is the rotation matrix R, ``c(t, 1)`` the angular velocity w, ``c(t, 2)``
    the angular acceleration w' and ``c(t, 3)`` the angular jerk w'', all three in the body frame:
    R' = R hat_so3(w).

    On SE(3), ``c(t)`` is the pose A, ``c(t, 1)`` the twist S = (w, v), A' = A hat_se3(S), and
    ``c(t, 2)`` the covariant acceleration in metric (14), (w', Rᵀ d''). That is *not* the
    derivative of the twist: v' = Rᵀ d'' − w × v.

    The derivatives are exact. Times of shape ``t.shape`` and a stack of curves of shape ``(...)``
    give results of shapes ``t.shape + (..., 3, 3)`` and ``t.shape + (..., 3)``; on SE(3)
    ``t.shape + (..., 4, 4)`` and ``t.shape + (..., 6)``. A stack is indexed as an array of that
    shape is: ``c[2]`` is its third curve.

    Attributes
    ----------
    batch_shape : tuple of int
        The shape of the stack; ``()`` for a single curve.
    domain : tuple of float
        The first and the last time.

    References
    ----------
    BK (1), BK (9), BK 6.
    """

    batch_shape: tuple[int, ...]
    domain: tuple[float, float] = (0.0, 1.0)
    size: int = 3  # of its matrices
    per_curve: ClassVar[dict[str, int]] = {}
    """Attributes with an entry for each curve: how many of their axes stand before the batch's."""

    def __call__(self, t: ArrayLike, order: int = 0) -> Array:
        """Return the curve, or a derivative, at the times t.

        Parameters
        ----------
        t : array_like
            Times in the domain, of any shape.
        order : {0, 1, 2, 3}, optional
            The curve, its velocity, its acceleration or, on SO(3) only, its jerk.

        Returns
        -------
        ndarray, shape t.shape + (..., 3, 3) or t.shape + (..., 3); or with 4 and 6

        Raises
        ------
        ValueError
            If a time is not finite or outside the domain, by more than 8 eps of the larger end, or
            `order` is another.

        Examples
        --------
        >>> from rbcourse import exp_so3
        >>> c = geodesic_so3(np.eye(3), exp_so3([0, 0, 1.5]))
        >>> c(np.linspace(0, 1, 5)).shape, c(0.5, 1).shape
        ((5, 3, 3), (3,))
        """
        times = as_time(t, 0, self.domain)
        values = self._at_all(times.reshape(-1, 1), self._check_order(order))
        return values.reshape(times.shape + self.batch_shape + self._core(order))

    def at_own_times(self, t: ArrayLike, order: int = 0) -> Array:
        """Return each curve of the stack, or a derivative, at times of its own.

        Parameters
        ----------
        t : array_like, shape (...) + batch_shape
            Times in the domain.
        order : {0, 1, 2, 3}, optional
            As for a call.

        Returns
        -------
        ndarray, shape t.shape + (3, 3) or t.shape + (3,); or with 4 and 6

        Raises
        ------
        ValueError
            As a call, or if `t` does not have that shape.
        """
        times, stacked = as_time(t, 0, self.domain), len(self.batch_shape)
        if times.shape[max(0, times.ndim - stacked) :] != self.batch_shape:
            wanted = ", ".join(["...", *map(str, self.batch_shape)])
            raise ValueError(f"t: shape ({wanted}) wanted, got {times.shape}")
        rows = math.prod(times.shape[: times.ndim - stacked])
        values = self._at_all(times.reshape(rows, self.count), self._check_order(order))
        return values.reshape(times.shape + self._core(order))

    def __getitem__(self, index: Any) -> Self:
        """Return a curve of the stack, or some as a stack; the index is one for NumPy's arrays.

        Raises
        ------
        IndexError
            If there is no such curve.
        TypeError
            If there is no stack.

        Examples
        --------
        >>> from rbcourse import exp_so3
        >>> c = geodesic_so3(np.eye(3), exp_so3([[0, 0, 1], [0, 0, 1.5]]))
        >>> c[1](0, 1).round(12), c[:1].batch_shape
        (array([0. , 0. , 1.5]), (1,))
        """
        if not self.batch_shape:
            raise TypeError("a single curve is no stack, and has no index")
        return self.take(np.arange(self.count).reshape(self.batch_shape)[index])

    def __repr__(self) -> str:
        """Return what it is a curve of, how many there are, and when."""
        stack = f", stack of shape {self.batch_shape}" if self.batch_shape else ""
        start, end = self.domain
        return f"<{self._what()} on {_GROUPS[self.size]}{stack}, t in [{start:g}, {end:g}]>"

    def _what(self) -> str:
        return type(self).__name__

    @property
    def count(self) -> int:
        """How many curves there are."""
        return math.prod(self.batch_shape)

    def _at(self, t: Array, which: Chosen, order: int, out: Array) -> None:
        """Write curve which[k] of the stack at the times t[:, k] into out[:, k].

        This is how every curve is evaluated, alone, in a stack, or as the leg of a chain.

        Parameters
        ----------
        t : ndarray, shape (T, K), or (T, 1) for the same times on all
        which : ndarray of int, shape (K,)
            Numbers that count through the stack.
        order : {0, 1, 2, 3}
        out : ndarray, shape (T, K, 3, 3) or (T, K, 3); or with 4 and 6
            In C order.
        """
        raise NotImplementedError

    def _at_all(self, t: Array, order: int) -> Array:
        """Return all curves at the times t, shape (T, count) or (T, 1), in blocks."""
        count = self.count
        which, values = np.arange(count), np.empty((len(t), count, *self._core(order)))
        for rows in blocks(len(t), max(1, BLOCK // max(1, count))):
            self._at(t[rows], which, order, values[rows])
        return values

    def _check_order(self, order: int) -> int:
        """Return the order of a derivative, or raise a ValueError if the curve has none of it."""
        return check_order(order, 3 if self.size == 3 else 2)

    def _core(self, order: int) -> tuple[int, ...]:
        return (self.size,) * 2 if order == 0 else (3 * self.size - 6,)

    def take(self, index: Any) -> Self:
        """Return the stack of the curves with these numbers, which count through the stack."""
        picked = copy(self)
        picked.batch_shape = np.shape(index)
        for name in list(vars(picked)):
            if isinstance(getattr(type(self), name, None), cached_property):
                del picked.__dict__[name]
        for name, lead in self.per_curve.items():
            value = getattr(self, name)
            if isinstance(value, Curve):
                setattr(picked, name, value.take(index))
            else:
                flat = self._flat(value, lead)
                setattr(picked, name, np.take(flat, index, axis=lead))
        return picked

    def _flat(self, values: NDArray[Any], lead: int = 0) -> NDArray[Any]:
        """Return an array with one axis for the stack in place of the batch axes."""
        stacked = lead + len(self.batch_shape)
        return values.reshape(*values.shape[:lead], self.count, *values.shape[stacked:])

    def _check_defined(self, t: Array, which: Chosen, lost: NDArray[np.bool_], why: str) -> None:
        """Raise a SingularTime for the first time, shape (T, K), at which a curve is `lost`."""
        if lost.any():
            row, k = np.argwhere(lost)[0]
            time = float(np.broadcast_to(t, lost.shape)[row, k])
            curve = int(np.broadcast_to(which, lost.shape[1:])[k])
            raise SingularTime(time, curve, self.batch_shape, why)

    def _events(self) -> list[tuple[float, float]]:
        """Return when a curve of the stack is quick, and about how long that takes."""
        return []

    def _unit_legs(self, name: str, smooth: int) -> tuple[Curve, Any]:
        """Return the curves on [0, 1] that it consists of, as a stack, and their durations.

        Raises
        ------
        RuntimeError
            If a derivative jumps in between, up to the order `smooth`; `name` is the cost that
            does not exist then.
        """
        return self, 1.0


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

    per_curve: ClassVar[dict[str, int]] = {"R0": 0, "rotation_vector": 0, "_angle": 0}

    def __init__(self, R0: Array, rotation_vector: Array) -> None:
        self.batch_shape = rotation_vector.shape[:-1]
        self.R0 = np.broadcast_to(R0, (*self.batch_shape, 3, 3))
        self.rotation_vector = rotation_vector
        self._angle = np.linalg.norm(rotation_vector, axis=-1)

    def _progress(self, t: Array, which: Chosen, order: int) -> Array:
        """Return p or a derivative, shape (T, K) or (T, 1)."""
        return identity(t, order)

    def _at(self, t: Array, which: Chosen, order: int, out: Array) -> None:
        progress = self._progress(t, which, order)
        if order:
            sigma = self._flat(self.rotation_vector)[which]
            for i in range(3):  # four times as fast as in one go
                np.multiply(progress, sigma[:, i], out=out[..., i])
            return
        shares = np.ones((3, len(t), len(which)))
        _write_sine_and_versine(progress, self._half_angle[which], *shares[1:])
        combine(shares, self._terms, which, out.reshape(*out.shape[:2], 9))

    @cached_property
    def _half_angle(self) -> Array:
        return self._flat(self._angle) / 2

    @cached_property
    def _terms(self) -> Array:
        """R0, R0 K and R0 K² of R0 (I + sin a K + (1 − cos a) K²), Rodrigues' formula."""
        axis = self.rotation_vector / np.where(self._angle == 0, 1.0, self._angle)[..., None]
        K = hat(axis)
        turn = self.R0 @ K
        return np.stack([self.R0, turn, turn @ K]).reshape(3, self.count, 9)


def _write_sine_and_versine(progress: Array, half: Array, sine: Array, versine: Array) -> None:
    """Write sin a and 1 − cos a, a = 2 `half` times `progress`, by tan(a/2): the fastest way."""
    tangent = np.tan(np.multiply(progress, half, out=versine), out=versine)
    np.multiply(tangent, tangent, out=sine)
    sine += 1
    np.divide(tangent, sine, out=sine)
    sine *= 2
    versine *= sine


def geodesic_so3(R0: ArrayLike, R1: ArrayLike) -> AlongGeodesic:
    """Return the shortest curve from R0 to R1, at constant angular velocity.

    Parameters
    ----------
    R0, R1 : array_like, shape (..., 3, 3)
        Rotation matrices. Validity is not checked; see `project_so`.

    Returns
    -------
    AlongGeodesic
        A `Curve`: R0 exp(σ̂ t) with ``rotation_vector`` σ = log_so3(R0ᵀ R1), of length ‖σ‖ ≤ π.

    See Also
    --------
    rbcourse.textbook.geodesic_so3 : The same in two lines.
    projected_line_so3 : The same path by projection, at another speed.
    slerp : The same curve in quaternions.
    retime : From [0, 1] to T seconds.

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
    >>> from rbcourse import exp_so3
    >>> c = geodesic_so3(np.eye(3), exp_so3([0, 0, 1.5]))
    >>> log_so3(c([0, 0.5, 1])).round(12)
    array([[0.  , 0.  , 0.  ],
           [0.  , 0.  , 0.75],
           [0.  , 0.  , 1.5 ]])
    >>> c(0.3, 1).round(12)  # the velocity
    array([0. , 0. , 1.5])
    """
    return AlongGeodesic(*start_and_rotation_vector(R0, R1))


class Retimed(Curve):
    """A `Curve` reparameterised linearly to another duration.

    Attributes
    ----------
    curve : Curve
        The original.
    rate : float
        How much of its time passes in a unit of time.
    """

    per_curve: ClassVar[dict[str, int]] = {"curve": 0}

    def __init__(self, curve: Curve, rate: float, domain: tuple[float, float]) -> None:
        self.curve, self.rate, self.domain = curve, rate, domain
        self.batch_shape, self.size = curve.batch_shape, curve.size

    def _at(self, t: Array, which: Chosen, order: int, out: Array) -> None:
        (start, end), (first, last) = self.domain, self.curve.domain
        inner = np.minimum(first + (t - start) * self.rate, last)
        self.curve._at(np.where(t == end, last, inner), which, order, out)
        if order:
            out *= self.rate**order

    def _what(self) -> str:
        return f"Retimed {self.curve._what()}"

    def _events(self) -> list[tuple[float, float]]:
        start, first = self.domain[0], self.curve.domain[0]
        events = self.curve._events()
        return [(start + (t - first) / self.rate, width / self.rate) for t, width in events]

    def _unit_legs(self, name: str, smooth: int) -> tuple[Curve, Any]:
        legs, durations = self.curve._unit_legs(name, smooth)
        return legs, durations / self.rate


def retime(curve: Curve, duration: float) -> Retimed:
    """Return the curve reparameterised linearly to a new duration, with the same start time.

    Parameters
    ----------
    curve : Curve
        Or a stack of them.
    duration : float
        The new duration, in s or any other unit of time; more than 0.

    Returns
    -------
    Retimed
        A `Curve` on [a, a + duration], a the first time of `curve`, which is 0 except for a
        `chain`. Velocities and accelerations are per unit of the new time: k times the duration
        divides them by k and k². `acceleration_cost` falls by k³.

    Raises
    ------
    ValueError
        If `curve` is no `Curve`, `duration` no number above 0, or so short that accelerations
        overflow or that it vanishes beside the first time.

    See Also
    --------
    chain : Through many poses, at times of your own.

    Notes
    -----
    To arrive with the angular velocity w after T seconds, make a curve with the end velocity T w,
    then retime it to T. A chain that takes k times as long is at its poses at a + k (t − a).

    Examples
    --------
    >>> from rbcourse import exp_so3, geodesic_so3
    >>> c = retime(geodesic_so3(np.eye(3), exp_so3([0, 0, 1.5])), 3)
    >>> c.domain, c(3, 1).round(12)
    ((0.0, 3.0), array([0. , 0. , 0.5]))
    """
    if not isinstance(curve, Curve):
        raise ValueError(f"curve: a Curve wanted, got {curve!r}")
    time, (start, end) = as_positive("duration", duration), curve.domain
    if start + time == start:
        raise ValueError(f"duration is {time}: that vanishes beside the first time, {start}")
    if time < SHORTEST * (end - start):
        raise ValueError(f"duration is {time}: too short, accelerations would overflow")
    return Retimed(curve, (end - start) / time, (start, start + time))


def start_and_rotation_vector(R0: ArrayLike, R1: ArrayLike) -> tuple[Array, Array]:
    """Return R0 as an array, and log_so3(R0ᵀ R1); or raise the ValueError of `geodesic_so3`."""
    R0, R1 = as_finite("R0", R0, 3, 3), as_finite("R1", R1, 3, 3)
    check_broadcast(R0=(R0, 2), R1=(R1, 2))
    return R0, log_so3(np.swapaxes(R0, -1, -2) @ R1)


def identity(t: Array, order: int) -> Array:
    """Return t, or its derivative."""
    return t if order == 0 else np.full_like(t, order == 1)


def combine(weights: Array, terms: Array, which: Chosen, out: Array) -> None:
    """Write the sums over n of weights[n] terms[n] of the curves which[k] into out[:, k].

    Parameters
    ----------
    weights : ndarray, shape (n, T, K) or (n, T, 1)
    terms : ndarray, shape (n, count, m)
    which : ndarray of int, shape (K,)
    out : ndarray, shape (T, K, m)
    """
    if len(which) == 1:
        np.matmul(weights[:, :, 0].T, terms[:, which[0]], out=out[:, 0])
    elif weights.shape[2] == 1:
        columns = np.take(terms, which, axis=1).reshape(len(terms), -1)
        out[...] = (weights[:, :, 0].T @ columns).reshape(out.shape)
    elif len(out) == 1 and has_long_runs(which):
        for curve, run in runs(which):
            np.matmul(weights[:, 0, run].T, terms[:, curve], out=out[0, run])
    else:
        np.einsum("ntk,nkm->tkm", weights, np.take(terms, which, axis=1), out=out)


def runs(which: Chosen) -> Iterator[tuple[int, slice]]:
    """Yield each stretch of equal numbers, and where it is."""
    cuts = [0, *(np.flatnonzero(np.diff(which)) + 1).tolist()] if len(which) else []
    for start, end in pairwise([*cuts, len(which)]):
        yield int(which[start]), slice(start, end)


def has_long_runs(which: Chosen) -> bool:
    """Tell whether equal numbers stand together, `LONG_RUN` of them or more in the mean."""
    return len(which) >= LONG_RUN * (1 + int(np.count_nonzero(np.diff(which))))


def which_curve(curve: int, batch_shape: tuple[int, ...]) -> str:
    """Return how a curve of a stack is called in messages, nothing for a single one."""
    index = [int(i) for i in np.unravel_index(curve, batch_shape)] if batch_shape else []
    return f" of curve {index}" if index else ""


def events_of(times: ArrayLike, margins: ArrayLike) -> list[tuple[float, float]]:
    """Return the times at which margins are small, and about how long curves turn quickly there.

    Raises
    ------
    RuntimeError
        If a margin is below 1e-6.
    """
    gaps = np.ravel(margins)
    if gaps.min(initial=np.inf) < 1e-6:
        raise RuntimeError(f"cost: the curve almost jumps (margin {gaps.min():.1e})")
    when = np.broadcast_to(np.ravel(times), gaps.shape)
    return [(float(t), gap / 4) for t, gap in zip(when, gaps, strict=True) if gap < 0.25]


def least_over_time(
    value: Callable[[Array], Array], batch_shape: tuple[int, ...]
) -> tuple[Array, Array]:
    """Return when a function of time is least, and its value: on 129 times, then refined.

    Times and values have the shape (N,) + batch_shape.
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
