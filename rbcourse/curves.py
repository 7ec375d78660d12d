"""What a curve is: a rotation or a pose over time. And the simplest one, the geodesic."""

import math
from collections.abc import Callable, Iterator
from copy import copy
from functools import cached_property
from itertools import pairwise
from typing import Any, Self, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbcourse._numerics import (
    Array,
    as_finite,
    as_time,
    blocks,
    check_broadcast,
    check_order,
)
from rbcourse.so3 import hat_so3, log_so3

Chosen: TypeAlias = NDArray[np.intp]
BLOCK = 4096  # rotations that are worked out together, in the cache


class Curve:
    """A rotation or a pose over time; called as SciPy's splines are.

    The time t is in [0, 1], but for what `retime` and `chain` return.

    On SO(3), ``c(t)`` is the rotation matrix R, ``c(t, 1)`` the angular velocity w and ``c(t, 2)``
    the angular acceleration w', both in the body frame: R' = R hat_so3(w).

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

    def __call__(self, t: ArrayLike, order: int = 0) -> Array:
        """Return the curve, or a derivative, at the times t.

        Parameters
        ----------
        t : array_like
            Times in the domain, of any shape.
        order : {0, 1, 2}, optional
            The curve, its velocity or its acceleration.

        Returns
        -------
        ndarray, shape t.shape + (..., 3, 3) or t.shape + (..., 3); or with 4 and 6

        Raises
        ------
        ValueError
            If a time is not finite or outside the domain, or `order` is another.

        Examples
        --------
        >>> from rbcourse import exp_so3
        >>> c = geodesic_so3(np.eye(3), exp_so3([0, 0, 1.5]))
        >>> c(np.linspace(0, 1, 5)).shape, c(0.5, 1).shape
        ((5, 3, 3), (3,))
        """
        return self._evaluate(as_time(t, len(self.batch_shape), self.domain), check_order(order))

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
        numbers = np.arange(math.prod(self.batch_shape)).reshape(self.batch_shape)
        return self._pick(np.asarray(numbers[index]))

    def _evaluate(self, t: Array, order: int) -> Array:
        raise NotImplementedError

    def _pick(self, chosen: Chosen) -> Self:
        """Return the stack of the curves with these numbers, which count through the stack."""
        raise NotImplementedError(f"{type(self).__name__} has no index")

    def _write_each(self, t: Array, which: Chosen, order: int, out: Array) -> None:
        """Write curve which[i] of the stack at t[i] into out[i]; `which` ascends."""
        out[...] = self._pick(which)._evaluate(t, order)


class BlockwiseCurve(Curve):
    """A `Curve` on SO(3), or a stack of them, worked out for as many times as fit into the cache.

    References
    ----------
    BK 6.
    """

    def _evaluate(self, t: Array, order: int) -> Array:
        free = t.ndim - len(self.batch_shape)
        shape = np.broadcast_shapes(t.shape, self.batch_shape) + ((3,) if order else (3, 3))
        times = t.reshape(math.prod(t.shape[:free]), *t.shape[free:])
        values = np.empty((len(times), *shape[free:]))
        rows = max(1, BLOCK // max(1, math.prod(self.batch_shape)))
        for block in blocks(len(times), rows):
            values[block] = self._block(times[block], order)
        return values.reshape(shape)

    def at_own_times(self, t: ArrayLike, order: int = 0) -> Array:
        """Return each curve of the stack, or a derivative, at times of its own.

        Parameters
        ----------
        t : array_like, shape (..., *batch_shape)
            Times in [0, 1].
        order : {0, 1, 2}, optional
            As for a call.

        Returns
        -------
        ndarray, shape t.shape + (3, 3) or t.shape + (3,)

        Raises
        ------
        ValueError
            As a call, or if `t` has not that shape.
        """
        times, stacked = as_time(t, 0), len(self.batch_shape)
        if times.shape[max(0, times.ndim - stacked) :] != self.batch_shape:
            wanted = ", ".join(["...", *map(str, self.batch_shape)])
            raise ValueError(f"t: shape ({wanted}) wanted, got {times.shape}")
        return self._evaluate(times, check_order(order))

    def _block(self, t: Array, order: int) -> Array:
        """Return the values at times of shape (N, ...): for each curve the same, or its own."""
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
        self._angle = np.linalg.norm(rotation_vector, axis=-1)

    def _progress(self, t: Array, order: int, angle: Array) -> Array:
        return identity(t, order)

    def _progress_each(self, t: Array, which: Chosen, order: int) -> Array:
        return identity(t, order)

    def _pick(self, chosen: Chosen) -> Self:
        picked = copy(self)
        picked.__dict__.pop("_terms", None)
        picked.R0 = pick(self.R0, chosen, self.batch_shape, core=2)
        picked.rotation_vector = pick(self.rotation_vector, chosen, self.batch_shape, core=1)
        picked._angle = pick(self._angle, chosen, self.batch_shape)
        picked.batch_shape = chosen.shape
        return picked

    def _write_each(self, t: Array, which: Chosen, order: int, out: Array) -> None:
        progress = self._progress_each(t, which, order)
        if order:
            np.multiply(progress[:, None], self.rotation_vector[which], out=out)
            return
        shares, R = np.ones((3, len(t))), out.reshape(-1, 9)
        _write_shares(progress, self._angle[which], shares)
        for curve, run in runs(which):
            np.matmul(shares[:, run].T, self._terms[:, curve].reshape(3, 9), out=R[run])

    def _evaluate(self, t: Array, order: int) -> Array:
        progress = self._progress(t, order, self._angle)
        if order:
            return progress[..., None] * self.rotation_vector
        if self.batch_shape:
            shares = np.ones((3, *np.broadcast_shapes(t.shape, self.batch_shape)))
            _write_shares(progress, self._angle, shares)
            return np.einsum("k...,k...ij->...ij", shares, self._terms)
        shares, terms = np.ones((3, min(t.size, BLOCK))), self._terms.reshape(3, 9)
        R, progress = np.empty((t.size, 9)), progress.reshape(-1)
        for block in blocks(t.size, BLOCK):
            part = shares[:, : block.stop - block.start]
            _write_shares(progress[block], self._angle, part)
            np.matmul(part.T, terms, out=R[block])
        return R.reshape(*t.shape, 3, 3)

    @cached_property
    def _terms(self) -> Array:
        """R0, R0 K and R0 K² of R0 (I + sin a K + (1 − cos a) K²), Rodrigues' formula."""
        axis = self.rotation_vector / np.where(self._angle == 0, 1.0, self._angle)[..., None]
        turn = self.R0 @ hat_so3(axis)
        return np.stack(np.broadcast_arrays(self.R0, turn, turn @ hat_so3(axis)))


def _write_shares(progress: Array, angle: Array, shares: Array) -> None:
    """Write sin a and 1 − cos a beside the 1, a so much of the angle, by tan(a/2): fastest."""
    _, sine, versine = shares
    tangent = np.tan(progress * (angle / 2), out=versine)
    np.multiply(tangent, tangent, out=sine)
    sine += 1
    np.divide(2 * tangent, sine, out=sine)
    versine *= sine


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
    rbcourse.textbook.geodesic_so3 : The same in two lines.
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


def start_and_rotation_vector(R0: ArrayLike, R1: ArrayLike) -> tuple[Array, Array]:
    """Return R0 as an array, and log_so3(R0ᵀ R1); or raise the ValueError of `geodesic_so3`."""
    R0, R1 = as_finite("R0", R0, 3, 3), as_finite("R1", R1, 3, 3)
    check_broadcast(R0=(R0, 2), R1=(R1, 2))
    return R0, log_so3(np.swapaxes(R0, -1, -2) @ R1)


def pick(
    array: NDArray[Any], chosen: Chosen, batch_shape: tuple[int, ...], core: int = 0, lead: int = 0
) -> NDArray[Any]:
    """Return what belongs to the chosen curves; the batch axes are behind `lead`, before `core`.

    The numbers count through the shape of the batch, to which that of the array broadcasts.
    """
    own = array.shape[lead : array.ndim - core]
    if own != batch_shape:
        numbers = np.arange(math.prod(own)).reshape(own)
        chosen = np.broadcast_to(numbers, batch_shape).reshape(-1)[chosen]
    flat = array.reshape(*array.shape[:lead], math.prod(own), *array.shape[array.ndim - core :])
    return np.take(flat, chosen, axis=lead)


def runs(which: Chosen) -> Iterator[tuple[int, slice]]:
    """Yield each curve of an ascending list, and where it stands there."""
    cuts = [0, *(np.flatnonzero(np.diff(which)) + 1).tolist(), len(which)]
    for start, end in pairwise(cuts):
        yield int(which[start]), slice(start, end)


def identity(t: Array, order: int) -> Array:
    """Return t, or its derivative."""
    return t if order == 0 else np.full_like(t, order == 1)


def check_times(t: Array, lost: NDArray[np.bool_], batch_ndim: int, why: str) -> None:
    """Raise a ValueError that names the first time (and curve of the stack) that is lost."""
    if lost.any():
        first = np.argwhere(lost)[0]
        time = np.broadcast_to(t, lost.shape)[tuple(first)]
        raise ValueError(f"t = {time}{which_curve(first[lost.ndim - batch_ndim :])}: {why}")


def which_curve(index: NDArray[np.intp]) -> str:
    """Return how a curve of a stack is called, nothing for a single one."""
    return f" of curve {[int(i) for i in index]}" if len(index) else ""


def least_over_time(
    value: Callable[[Array], Array], batch_shape: tuple[int, ...]
) -> tuple[Array, Array]:
    """Return when a function of time is least, and how large: on 129 times, then ever closer.

    Times and values have the shape (N, *batch_shape).
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
