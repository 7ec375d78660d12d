"""The fastest timing s(t) of a path c(s) under limits on speeds, accelerations, torque and force.

The private module `_cells` has the method.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from math import inf
from typing import Any, Self, TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._checks import as_single, as_time
from rbcourse._docs import described_by
from rbcourse._numerics import Array, blocks
from rbcourse.body import Body
from rbcourse.curves._cells import BENDS, BLOCK, as_limits, fastest_motion
from rbcourse.curves.chain import Chain
from rbcourse.curves.curve import Curve

TIMES = 20_001  # the times at which `limits_used` evaluates a curve
PLATEAU = 1e-6  # the share below the maximum within which `limits_used` takes the first time


class Limits(TypedDict, total=False):
    """The largest allowed values of a motion, and the gravity, for annotations.

    The keys are the names below; `fastest` describes them.
    """

    angular_speed: ArrayLike | None
    speed: ArrayLike | None
    angular_acceleration: ArrayLike | None
    acceleration: ArrayLike | None
    torque: ArrayLike | None
    force: ArrayLike | None
    gravity: ArrayLike


def fastest(
    curve: Curve,
    *,
    body: Body | None = None,
    rates: tuple[float, float] = (0.0, 0.0),
    **limits: Unpack[Limits],
) -> Timed:
    """Return a curve that follows the given path as fast as the limits allow.

    Source: beyond BK 16.

    Parameters
    ----------
    curve : Curve
        A single curve, of which only the path is used; for a `Timed`, that from which it was made.
    body : Body, optional
        The body that moves, by default ``curve.body``. It is required for a limit on the torque or
        the force if the body of the curve is the default ball. Its centre is the point whose speed
        and acceleration are limited. To limit those of another point, such as the tip of a tool,
        give a body with this centre; the torque is the same, but the force is not.
    rates : (float, float), optional
        The values of s' at both ends: 0 is rest, and 1 is the velocity of the path itself. A rate
        has no effect at an end where the curve rests.
    **limits : Limits
        The keyword arguments are:

        angular_speed, speed : float or array_like, shape (3,)
            The largest norms of ω, in rad per unit time, and of the velocity of the centre, in m
            per unit time. Three numbers limit the magnitudes of the components in the body frame
            instead, here and below. For rotations, only ω, ω' and the torque can be limited.
        angular_acceleration, acceleration : float or array_like, shape (3,)
            The largest norms of ω', and of the acceleration of the centre.
        torque, force : float or array_like, shape (3,)
            The largest norms of the torque G ω' + ω × G ω and of the force: the mass times the
            acceleration of the centre, minus the weight.
        gravity : array_like, shape (3,)
            The acceleration of free fall in the fixed frame, by default 0, for the force.

    Returns
    -------
    Timed
        A `Curve` on [0, T].

    Raises
    ------
    ValueError
        If the whole path stands still, if no limit bounds the speed, if the force cannot hold the
        body at rest, or if the `rates` are out of reach. The message names the first s of the path.
    MemoryError
        If the cells need more memory than the computer has.

    Warns
    -----
    RuntimeWarning
        If a limit is still exceeded by more than 1e-4 with the finest grid.

    Notes
    -----
    At least one limit on an acceleration, the torque or the force is required.

    The grid has 1,000 cells or, for a chain, from 250 to 4 for each leg, and more if a limit is
    exceeded. T is then about 1e-3 above the shortest time; for some paths with many legs, it is
    5e-3 above, and up to 2e-2 if the legs are quintics from rest to rest. The calculation takes
    about 50 ms for 1,000 cells, and a time and a memory in proportion for more. If it takes more
    than 10 s, lines on stderr show its progress.

    The motion stops where the path rests or its velocity jumps, and legs in which the path stands
    still take no time. The acceleration jumps where that of the path jumps, at stops, and between
    cells; the jerk is not limited. If noise bends the path, the motion follows it, and is slow.

    Examples
    --------
    >>> from rbcourse import exp_so3, geodesic
    >>> turn = geodesic(np.eye(3), exp_so3([0, 0, 3]))
    >>> c = fastest(turn, angular_speed=1, angular_acceleration=2)  # 3/1 + 1/2 s
    >>> round(c.domain[1], 4), c(1.75, 1).round(9)
    (3.5, array([0., 0., 1.]))
    """
    given = curve.curve if isinstance(curve, Timed) else curve
    known = as_limits(curve, body, **limits)
    if all(limit.of_speed for limit in known):
        raise ValueError(f"limits: one of {', '.join(BENDS)} is needed")
    ends = as_single("rates", rates, 2)
    if ends.min() < 0:
        raise ValueError(f"rates: two numbers from 0 up are wanted, got {rates}")
    s, rate, times = fastest_motion(given, known, ends**2)
    moved = known[0].body
    return Timed(duration=times[-1], body=moved, curve=given, s=s, rate=rate, times=times)


@described_by(fastest)
def limits_used(
    curve: Curve, *, body: Body | None = None, **limits: Unpack[Limits]
) -> dict[str, tuple[float, float]]:
    """Return, for each limit, the largest share that a curve uses, and the time of this maximum.

    Source: beyond BK 16.

    Parameters
    ----------
    curve : Curve
        A single curve.

    Returns
    -------
    dict of str to (float, float)
        The largest share, and the first time at which the curve reaches this share to one part in a
        million. The curve is evaluated at 20,001 times and on both sides of the joints of a chain;
        a limit may be exceeded between these times.

    Examples
    --------
    >>> from rbcourse import exp_so3, geodesic
    >>> limits_used(geodesic(np.eye(3), exp_so3([0, 0, 3])), angular_speed=[1, 1, 2])
    {'angular_speed': (1.5, 0.0)}
    """
    known = as_limits(curve, body, **limits)
    path = _from_zero(curve)
    t = _moments(path)
    shares = np.empty((len(known), len(t)))
    for part in blocks(len(t), BLOCK):
        V = path(t[part], 1)
        A = path(t[part], 2)
        R = path(t[part])[:, :3, :3]
        for i, limit in enumerate(known):
            _, b, k = limit.vectors(V, A, R)  # s' = 1 and s'' = 0
            shares[i, part] = limit.share(b + k)
    largest = shares.max(axis=1)
    first = np.argmax(shares >= largest[:, None] * (1 - PLATEAU), axis=1)
    when = t[first] + curve.domain[0]
    names = [limit.name for limit in known]
    return dict(zip(names, zip(largest.tolist(), when.tolist(), strict=True), strict=True))


def _moments(curve: Curve) -> Array:
    """Return even times, and times at the ends and in the middle of each leg or cell."""
    t = np.linspace(*curve.domain, TIMES)
    if not isinstance(curve, Chain | Timed):
        return t
    starts = curve.times[:-1]
    ends = np.nextafter(curve.times[1:], -inf)
    middles = (starts + ends) / 2
    return np.unique([*t, *starts, *middles, *np.maximum(starts, ends)])


def _from_zero(curve: Curve) -> Curve:
    """Return the curve with times that begin at 0; large times would lose digits in differences."""
    if isinstance(curve, Chain):
        return replace(curve, times=curve.times - curve.times[0])
    return curve


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Timed(Curve):
    """The `Curve` c(s(t)) on [0, T], with constant s'' in each cell, from its start on.

    Attributes
    ----------
    curve : Curve
        The path c. For a chain, s = 0 is its first time.
    s, rate, times : ndarray, shape (N,)
        The grid points, the values of s' there, and the times at which the curve passes them. It
        passes the pose at s0 of the path at ``times[np.searchsorted(s, s0)]``. At a stop, s' jumps,
        and two grid points have the same time.
    """

    curve: Curve
    s: Array
    rate: Array
    times: Array

    @cached_property
    def _path(self) -> Curve:
        return _from_zero(self.curve)

    @property
    def size(self) -> int:
        """3 on SO(3), 4 on SE(3)."""
        return self.curve.size

    def _lasting(self, duration: Array) -> Self:
        k = duration / self.duration
        return replace(self, duration=duration, rate=self.rate / k, times=self.times * k)

    def _moved(self, L: Array, X: Array) -> Curve:
        body = super()._moved(L, X).body
        return replace(self, body=body, curve=self.curve._moved(L, X))

    def progress(self, t: ArrayLike) -> tuple[Array, Array, Array]:
        """Return s, s' and s'' at the times t."""
        t = as_time(t, 0, self.domain)
        cell = np.searchsorted(self.times, t, side="right") - 1
        cell = np.clip(cell, 0, len(self.s) - 2)
        first = self.s[cell]
        last = self.s[cell + 1]
        v = self.rate[cell]
        u = (self.rate[cell + 1] ** 2 - v**2) / (last - first) / 2
        past = t - self.times[cell]
        s = first + past * (v + past * u / 2)
        # in the cell, also by rounding, since the velocity may jump at its end
        below = np.where(t < self.times[-1], np.nextafter(last, -inf), self.s[-1])
        return np.clip(s, first, below), v + past * u, u

    def _evaluate(self, t: Array, order: int) -> Array:
        s, v, u = (x[..., None] for x in self.progress(t))
        return _composed(lambda k: self._path._evaluate(s[..., 0], k), v, u, order)

    def _once(self, t: float, orders: tuple[int, ...]) -> list[Array]:
        s, v, u = (float(x) for x in self.progress(t))
        c = self._path._once(s, tuple(range(max(orders) + 1)))
        return [_composed(lambda k: c[k], v, u, order) for order in orders]

    def values(self, t: Array, order: int) -> Array:
        """Raise RuntimeError, because costs require smooth curves."""
        raise RuntimeError("curve: the cost of a Timed curve is not computed; integrate c.state(t)")

    @property
    def flat(self) -> Self:
        """The curve itself."""
        return self


def _composed(c: Callable[[int], Array], v: Any, u: Any, order: int) -> Array:
    """Return c(s(t)) or a derivative, given the derivatives c(0), c(1), … and v = s', u = s''."""
    match order:
        case 0:
            return c(0)
        case 1:
            return c(1) * v
        case 2:
            return c(1) * u + c(2) * v**2
        case _:
            return 3 * c(2) * u * v + c(3) * v**3
