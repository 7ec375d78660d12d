"""The fastest timing of a path under limits on speeds, accelerations, torque and force.

The timing s(t) moves the body along a path c(s). Let x = s'² and u = s'' = ½ dx/ds. With
V = c(s, 1) = (ω, v) and A = c(s, 2) = (α, β), the motion has the velocity V s' and the acceleration
V u + A x in the body frame. The torque is G ω u + (G α + ω × G ω) x. The acceleration of the point
r of the body is (v + ω × r) u + (β + α × r + ω × (ω × r)) x. The force on a mass m at this point is
m times this acceleration, minus m Rᵀ g. So every limit has the form ‖a u + b x + k‖ ≤ 1. For a
limit on a speed, a = k = 0, and b is the square of the share that the speed uses at s' = 1.

The path is divided into cells of length h. In a cell, u is constant, x is linear in s from x_i to
y = x_i+1, and u = (y − x_i)/2h. The vector a u + b x + k is replaced by the quadratic polynomial
with the same values at the start, in the middle and at the end of the cell. The polynomial lies in
the convex hull of its Bernstein coefficients, so that the limit holds in the whole cell if it holds
for them. They have the form p x_i + q y + k. So each limit is an ellipse, or a strip, in the plane
of x_i and y. Since a, b and k may jump between cells, their values inside the cell are used.

The body stops where the path rests or its velocity jumps. Legs in which the path stands still take
no time. On the pieces between stops, the algorithm makes two passes. The backward pass finds the
largest x_i from which the end can be reached. The forward pass finds the largest x_i+1 that x_i and
the first pass allow. Since the limits of a cell are convex, the passes find a timing that satisfies
the limits on the cells, if one exists. The motion takes the time Σ 2h/(s'_i + s'_i+1), which
decreases if any x increases.

Near the top of an ellipse, x_i grows only if y decreases. TOPP-RA chooses the largest x_i, which is
not the best choice there, since a small gain of x_i causes a large loss of y. The time depends
nearly equally on x_i and y, so `_tops` maximises x_i + y. On 16 random paths, the time is at most
2e-5 above the optimum of a cone program, which has limits only at the ends of the same cells.

Pham and Pham (TOPP-RA, IEEE Transactions on Robotics 34, 2018) find reachable and controllable sets
of joints by two passes of linear programs. Nguyen and Pham (Journal of Guidance, Control, and
Dynamics, 2016) compute timings of rotations with bounds on angular velocities, accelerations or
torques. For this module, only the abstracts or introductions of both papers were read. We found no
other method that times poses under limits on the norms of vectors.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from math import inf, sqrt
from typing import NamedTuple, Self, TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbcourse._checks import as_finite, as_single, as_time
from rbcourse._docs import described_by
from rbcourse._numerics import Array, blocks, cross, matvec, reported
from rbcourse.body import Body
from rbcourse.curves.chain import Chain, evaluate_legs
from rbcourse.curves.curve import Curve
from rbcourse.curves.ends import as_body

REFINEMENTS = 3  # how often the cells of a leg are halved if it exceeds a limit
TOLERANCE = 1e-4  # the share by which a limit may be exceeded
_BLOCK = 1024  # cells, or times, evaluated together, which bounds the memory
_MEMORY = 200  # bytes for each cell: places, two passes, and the result
_DENSE = 0.2  # a leg has fewer cells if its velocity changes by less than this share
_PLACES = np.array([0, 0.5, 1])
"""The places in a cell at which the path is evaluated."""
_CHECKED = np.array([0.04, 0.25, 0.75, 0.96])
"""The places in a cell at which the limits are checked."""
_CONTROL = np.array([[1, 0, 0], [-0.5, 2, -0.5], [0, 0, 1]])
"""Maps the values of a quadratic polynomial at the places to its Bernstein coefficients."""
_SPEEDS = "angular_speed", "speed"
_BENDS = "angular_acceleration", "acceleration", "torque", "force"
Row = tuple[str, Array, Array, Array]
Rows = Callable[[Array, Array, Array], Iterator[Row]]


class Limits(TypedDict, total=False):
    """The largest allowed values of a motion, and the gravity; `fastest` describes them."""

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
        A single curve. Only its path is used; its times do not matter. For a `Timed`, this is the
        path from which it was made.
    body : Body, optional
        The body that moves, by default ``curve.body``. It is required for a limit on the torque or
        the force if the body of the curve is the default ball. Its centre is the point whose speed
        and acceleration are limited; ``curve.moved(right=...)`` moves the origin to another point,
        such as the tip of a tool.
    rates : (float, float), optional
        The values of s' at both ends: 0 is rest, and 1 is the velocity of the path itself. A rate
        has no effect at an end where the curve rests.
    **limits
        At least one limit on an acceleration, the torque or the force is required.

        angular_speed, speed : float or array_like, shape (3,)
            The largest norms of ω, in rad per unit time, and of the velocity of the centre, in m
            per unit time. Three numbers limit the magnitudes of the components in the body frame
            instead, here and below. For rotations, only ω, ω' and the torque can be limited.
        angular_acceleration, acceleration : float or array_like, shape (3,)
            The largest norms of ω', and of the acceleration of the centre.
        torque, force : float or array_like, shape (3,)
            The largest norms of the torque G ω' + ω × G ω and of the force. The force is the mass
            times the acceleration of the centre, minus the weight.
        gravity : array_like, shape (3,)
            The acceleration of free fall in the fixed frame, by default 0, for a limit on the
            force.

    Returns
    -------
    Timed
        A `Curve` on [0, T].

    Raises
    ------
    ValueError
        If the whole path stands still, if no limit bounds the speed, if the force cannot hold the
        body at rest, or if the `rates` are out of reach. The message names the first place on the
        path by its s, as in `Timed`.
    MemoryError
        If the cells need more memory than the computer has.

    Warns
    -----
    RuntimeWarning
        If a limit is still exceeded by more than 1e-4 with the finest grid.

    Notes
    -----
    The grid has 1,000 cells or, for a chain, 250 for each leg. If there are many legs, each has 25
    cells, 50 next to a stop, or as few as 4 if its velocity hardly changes. A leg in which a limit
    is exceeded by more than 1e-4 gets twice as many cells, up to three times. T is then about 1e-3
    above the shortest time; for some paths with many legs, it is 5e-3 above, and up to 2e-2
    if the legs are quintics from rest to rest. The calculation takes about 50 ms for 1,000 cells,
    and a time and a memory in proportion for more. If it takes more than 10 s, lines on stderr show
    its progress.

    The result depends only on the path: neither a shift of its times nor another unit of time
    changes T. The motion stops where the path rests or its velocity jumps, and legs in which the
    path stands still take no time. The acceleration jumps where that of the path jumps, at stops,
    and between cells; the jerk is not limited. If noise bends the path between the poses, the
    motion follows the noise, and is slow.

    Examples
    --------
    >>> from rbcourse import exp_so3, geodesic
    >>> turn = geodesic(np.eye(3), exp_so3([0, 0, 3]))
    >>> c = fastest(turn, angular_speed=1, angular_acceleration=2)  # 3/1 + 1/2 s
    >>> round(c.domain[1], 4), c(1.75, 1).round(9)
    (3.5, array([0., 0., 1.]))
    """
    given = curve.curve if isinstance(curve, Timed) else curve
    rows_of = _limits(given, body, **limits)
    if all(limits.get(name) is None for name in _BENDS):
        raise ValueError(f"limits: one of {', '.join(_BENDS)} is needed")
    ends = as_single("rates", rates, 2)
    if ends.min() < 0:
        raise ValueError(f"rates: two numbers from 0 up are wanted, got {rates}")
    path = _surveyed(given, ends**2)
    counts = path.cell_counts()
    for left in range(REFINEMENTS, -1, -1):
        grid = _Grid(path, counts, rows_of)
        x, y = _two_passes(grid)
        shares = grid.largest_shares(x, y)
        over = shares > 1 + TOLERANCE
        if left == 0 or not over.any():
            break
        counts[np.unique(grid.leg[over])] *= 2
    if over.any():
        worst = np.argmax(shares)
        what = f"exceeded by {shares[worst] - 1:.1e} near s = {grid.place(worst):.6g}"
        warnings.warn(f"a limit is {what}", RuntimeWarning, stacklevel=2)
    return grid.timed(given, x, y)


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
    body, **limits
        As for `fastest`.

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
    return _shares(curve, _limits(curve, body, **limits), 20_001)


def _shares(curve: Curve, rows_of: Rows, count: int) -> dict[str, tuple[float, float]]:
    start, c = curve.domain[0], _from_zero(curve)
    t = np.linspace(*c.domain, count)
    if isinstance(c, Chain | Timed):
        starts, ends = c.times[:-1], np.nextafter(c.times[1:], -inf)
        t = np.unique([*t, *starts, *(starts + ends) / 2, *np.maximum(starts, ends)])
    shares: dict[str, Array] = {}
    for part in blocks(len(t), _BLOCK):
        V, A, R = c(t[part], 1), c(t[part], 2), c(t[part])[:, :3, :3]
        for name, _, b, k in rows_of(V, A, R):
            share = np.linalg.norm(b + k, axis=-1) ** (0.5 if name in _SPEEDS else 1)
            largest = shares.setdefault(name, np.zeros(len(t)))
            largest[part] = np.maximum(largest[part], share)
    first = {name: np.argmax(x >= x.max() * (1 - 1e-6)) for name, x in shares.items()}
    return {name: (float(x.max()), float(t[first[name]]) + start) for name, x in shares.items()}


def _from_zero(curve: Curve) -> Curve:
    """Return the curve with times that begin at 0; large times would lose digits in differences."""
    if isinstance(curve, Chain):
        return replace(curve, times=curve.times - curve.times[0])
    return curve


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Timed(Curve):
    """The `Curve` c(s(t)) on [0, T], with constant s'' in each cell.

    At the end of a cell, the s'' of the next cell is used.

    Attributes
    ----------
    curve : Curve
        The path c. For a chain, s = 0 is its first time.
    s, rate, times : ndarray, shape (N,)
        The grid points, the values of s' there, and the times at which the curve passes them. The
        curve passes the pose at s0 of the path at ``times[np.searchsorted(s, s0)]``. At a stop, s'
        jumps, and two grid points have the same time.
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
        """The size of the curve's matrices: 3 on SO(3), 4 on SE(3)."""
        return self.curve.size

    def lasting(self, duration: Array) -> Self:
        """Return the same curve with another duration."""
        k = duration / self.duration
        return replace(self, duration=duration, rate=self.rate / k, times=self.times * k)

    def _moved(self, L: Array, X: Array) -> Curve:
        moved = self.curve._moved(L, X)
        return replace(self, body=moved.body, curve=moved)

    def progress(self, t: ArrayLike) -> tuple[Array, Array, Array]:
        """Return s, s' and s'' at the times t."""
        t = as_time(t, 0, self.domain)
        i = np.clip(np.searchsorted(self.times, t, side="right") - 1, 0, len(self.s) - 2)
        first, last = self.s[i], self.s[i + 1]
        v = self.rate[i]
        u = (self.rate[i + 1] ** 2 - v**2) / (last - first) / 2
        past = t - self.times[i]
        s = first + past * (v + past * u / 2)
        below = np.where(t < self.times[-1], np.nextafter(last, -inf), self.s[-1])
        return np.clip(s, first, below), v + past * u, u

    def evaluate(self, t: Array, order: int) -> Array:
        """Return the values at the times t, shape (T, 1), by the chain rule."""
        s, v, u = self.progress(t)
        c = [self._path.evaluate(s, k) for k in range((order + 1) // 2, order + 1)]
        v, u = v[..., None], u[..., None]
        if order < 2:
            return c[0] * v if order else c[0]
        return c[0] * u + c[1] * v**2 if order == 2 else 3 * c[0] * u * v + c[1] * v**3

    def _once(self, t: float, orders: tuple[int, ...]) -> list[Array]:
        s, v, u = (float(x) for x in self.progress(t))
        c = self._path._once(s, tuple(range(max(orders) + 1)))
        by_order = [c[0], c[1] * v] if len(c) > 1 else c
        if len(c) > 2:
            by_order.append(c[1] * u + c[2] * v**2)
        if len(c) > 3:
            by_order.append(3 * c[2] * u * v + c[3] * v**3)
        return [by_order[k] for k in orders]

    def values(self, t: Array, order: int) -> Array:
        """Raise RuntimeError, because costs require smooth curves."""
        raise RuntimeError("curve: a Timed curve has no cost here, because its acceleration jumps")

    @property
    def flat(self) -> Self:
        """The curve itself."""
        return self


def _limits(
    curve: Curve,
    body: Body | None,
    *,
    gravity: ArrayLike = (0.0, 0.0, 0.0),
    **limits: ArrayLike | None,
) -> Rows:
    """Check the limits, and return a function that yields the name, a, b and k of each limit."""
    if not isinstance(curve, Curve) or curve.batch_shape:
        raise ValueError(f"curve: a single Curve, not a stack, is wanted, got {curve!r}")
    most = {name: as_finite(name, x) for name, x in limits.items() if x is not None}
    for name, x in most.items():
        if name not in _SPEEDS + _BENDS:
            raise TypeError(f"{name}: no limit has this name")
        if x.shape not in ((), (3,)) or x.min() <= 0:
            raise ValueError(f"{name}: one or three numbers above 0 are wanted, got {x.tolist()}")
        if curve.size == 3 and name in ("speed", "acceleration", "force"):
            raise ValueError(f"{name}: a curve on SO(3) has no such limit")
    if not most:
        raise ValueError(f"limits: none of {', '.join(_SPEEDS + _BENDS)} is given")
    moved = as_body(body, curve.body)
    if {"torque", "force"} & most.keys() and body is None and curve.body is Body.ball():
        raise ValueError("body: it is required for a limit on the torque or the force")
    G, m, r = as_single("body.inertia", moved.inertia, 3, 3), moved.mass, moved.centre
    g = as_single("gravity", gravity, 3)

    def rows(V: Array, A: Array, R: Array) -> Iterator[Row]:
        w, bend, none = V[..., :3], A[..., :3], np.zeros_like(V[..., :3])
        parts = {"angular_speed": (none, w, none), "angular_acceleration": (w, bend, none)}
        parts["torque"] = w @ G, bend @ G + cross(w, w @ G), none
        if curve.size == 4:
            v, pull = V[..., 3:] + cross(w, r), A[..., 3:] + cross(bend, r) + cross(w, cross(w, r))
            parts |= {"speed": (none, v, none), "acceleration": (v, pull, none)}
            parts["force"] = m * v, m * pull, -m * matvec(R.mT, g)
        for name, x in most.items():
            for i in [[0, 1, 2]] if x.ndim == 0 else [[0], [1], [2]]:
                a, b, k = (part[..., i] / np.broadcast_to(x, 3)[i] for part in parts[name])
                if name in _SPEEDS:
                    a, b, k = a[..., :1], np.vecdot(b, b)[..., None], k[..., :1]
                yield name, a, b, k

    return rows


class _Path(NamedTuple):
    """The legs of a path from the time 0 on, in a flat stack, and their ends.

    The first axis of `x`, `fine` and `rest` has the length 2, for the start and the end of a leg.
    At a stop, `x` is the value of x: 0, the value of `rates`, or infinity if it is free, since the
    body rests. Elsewhere, it is NaN.
    """

    legs: Curve
    knots: Array  # the ends of the legs, shape (L + 1,)
    moves: NDArray[np.bool_]  # whether the path moves in the leg, shape (L,)
    x: Array  # shape (2, L)
    fine: NDArray[np.bool_]  # whether cells are smaller towards this end, shape (2, L)
    rest: NDArray[np.bool_]  # whether ω or v is 0, shape (2, L, 1 or 2)
    change: Array  # the largest change of a leg's velocity, as a share of its size, shape (L,)

    def cell_counts(self) -> NDArray[np.intp]:
        """Return the number of cells of each leg."""
        L = int(np.count_nonzero(self.moves))
        most, least = max(1000 // L, min(250, 4000 // L), 25), max(1000 // L, 4)
        halvings = np.log2(_DENSE / np.clip(self.change, 1e-9, _DENSE)).astype(np.intp)
        counts = np.maximum(most >> halvings, least)
        counts[~np.isnan(self.x).all(axis=0)] = max(most, 50)  # near a stop, the speed changes much
        return np.where(self.moves, counts, 0)


def _surveyed(curve: Curve, ends: Array) -> _Path:
    """Return the legs of a path, and its stops; `ends` are the values of x at both ends."""
    legs = curve.legs.flat if isinstance(curve, Chain) else curve.flat
    times = curve.times if isinstance(curve, Chain) else np.array(curve.domain)
    h, L = legs.duration, legs.count
    # the velocity and the acceleration at five places of each leg, and their sizes in unit time
    place = np.linspace(0, 1, 5)[:, None]
    V, A = (legs.evaluate(place * h, k).reshape(5, L, -1, 3) for k in (1, 2))
    d = legs.evaluate(place[::4] * h, 0)[..., :3, 3:]
    far = np.array([1.0, np.abs(d).max(initial=0)])[: V.shape[2]]
    v, a = np.abs(V).max(axis=-1) * h[:, None], np.abs(A).max(axis=-1) * h[:, None] ** 2
    moves = (v > 1e-14 * far).any(axis=(0, 2))
    if not moves.any():
        raise ValueError("curve: the path stands still")
    # up to rounding: at ends that rest, c' = 0; at slow ends, also c'' = 0
    rest = (v <= 1e-12 * v.max(axis=0) + 1e-14 * far)[[0, -1]]
    slow = (rest & (a <= 1e-9 * a.max(axis=0) + 1e-12 * far)[[0, -1]]).all(axis=-1)
    resting = rest.all(axis=-1)
    # the body stops between two legs if the velocity jumps or is 0, or if one leg stands still
    jumps = np.abs(V[0, 1:] - V[-1, :-1]).max(axis=-1)
    corner = (jumps > 1e-9 * np.abs(V).max(axis=(0, 1, 3))).any(axis=-1)
    stop = corner | (resting[1, :-1] & resting[0, 1:]) | ~moves[1:] | ~moves[:-1]
    x = np.full((2, L), np.nan)
    x[0, 1:][stop] = x[1, :-1][stop] = 0
    x[0, 0], x[1, -1] = ends
    x[~np.isnan(x) & resting] = inf
    x[slow] = 0
    # the cells are smaller towards stops, but not where the whole motion begins or ends
    moved = np.logical_or.accumulate(moves[:-1])
    moves_on = np.logical_or.accumulate(moves[:0:-1])[::-1]
    fine = slow.copy()
    fine[0, 1:] |= stop & moved
    fine[1, :-1] |= stop & moves_on
    change = np.abs(V - V[2]).max(axis=(0, 3)) / np.maximum(np.abs(V).max(axis=(0, 3)), 1e-300)
    return _Path(legs, times - times[0], moves, x, fine, rest, change.max(axis=-1))


class _Grid:
    """The cells of the moving legs: their legs, and their ends as shares of these legs."""

    def __init__(self, path: _Path, counts: NDArray[np.intp], rows_of: Rows) -> None:
        self.path, self.rows_of = path, rows_of
        total = int(counts.sum())
        _check_memory(total)
        self.leg = np.repeat(np.arange(len(counts)), counts)
        number = np.arange(total) - np.repeat(np.cumsum(counts) - counts, counts)
        share: Array = np.stack([number, number + 1]) / counts[self.leg]
        self.first, self.last = number == 0, number + 1 == counts[self.leg]
        fine: NDArray[np.bool_] = path.fine[:, self.leg]
        kinds = [fine.all(axis=0), fine[0], fine[1]]
        graded = [share**2 * (3 - 2 * share), share**2, 1 - (1 - share) ** 2]
        self.share = np.select(kinds, graded, share)
        h = path.legs.duration[self.leg]
        self.s = path.knots[self.leg] + self.share[0] * h
        self.h = np.diff(self.share, axis=0)[0] * h
        start, end = path.rest[0, self.leg].any(axis=-1), path.rest[1, self.leg].any(axis=-1)
        self.near = (start & (share[1] <= 0.04)) | (end & (share[0] >= 0.96))
        self.begins = self.first & ~np.isnan(path.x[0, self.leg])  # the first cells of pieces
        self.ends = self.last & ~np.isnan(path.x[1, self.leg])
        self.ellipses = lru_cache(maxsize=4)(self._ellipses)  # each pass needs all of them

    def stops(self, at: NDArray[np.bool_], end: int) -> dict[int, float]:
        """Return the x at the stops of the cells that begin or end a piece."""
        x = self.path.x[end, self.leg[at]]
        return dict(zip(np.flatnonzero(at).tolist(), x.tolist(), strict=True))

    def sampled(self, cells: slice, places: Array) -> tuple[Array, Array, Array]:
        """Return V, A and R at places in the cells, shape (places, cells, ...)."""
        low, high = self.share[:, cells, None]
        shares = low * (1 - places) + high * places
        own = np.repeat(self.leg[cells], len(places))

        def values(order: int) -> Array:
            found = evaluate_legs(self.path.legs, own, shares.ravel(), order)
            return found.reshape(*shares.shape, *found.shape[1:]).swapaxes(0, 1)

        return values(1), values(2), values(0)[..., :3, :3]

    def _ellipses(self, start: int, stop: int) -> Array:
        """Return the coefficients of the limits A x² + 2 B x y + C y² + 2 D x + 2 E y + F ≤ 0.

        In cells near rest, where b changes much, limits on speeds use its largest value in the
        cell.
        """
        cells = slice(start, stop)
        V, A, R = self.sampled(cells, _PLACES)
        halves = V.reshape(3, stop - start, -1, 3)
        leg, h, near = self.leg[cells], self.h[cells, None], self.near[cells, None]
        halves[0][self.first[cells, None] & self.path.rest[0, leg]] = 0  # exactly, not to rounding
        halves[2][self.last[cells, None] & self.path.rest[1, leg]] = 0
        made = []
        for name, a, b, k in self.rows_of(V, A, R):
            held = np.linalg.norm(k, axis=-1).max(axis=0)
            if (held >= 1).any():
                where = f"to hold the body near s = {self.place(start + np.argmax(held >= 1)):.6g}"
                raise ValueError(f"force: {held.max():.6g} times the limit is needed {where}")
            if name in _SPEEDS:
                b = np.where(near, b.max(axis=0), b)
            g, q = a / (2 * h), _PLACES[:, None, None]
            p, q, k = (np.tensordot(_CONTROL, x, 1) for x in ((1 - q) * b - g, q * b + g, k))
            made.append(np.vecdot([p, p, q, p, q, k], [p, q, q, k, k, k]))
            made[-1][5] -= 1
        return np.concatenate(made, axis=1).swapaxes(1, 2)

    def largest_shares(self, x: Array, y: Array) -> Array:
        """Return, for each cell, the largest share of a limit between the places."""
        most = np.zeros(len(x))
        for part in reported("fastest, check", list(blocks(len(x), _BLOCK))):
            x0, y0, h = x[part, None], y[part, None], self.h[part, None]
            q = _CHECKED[:, None, None]
            for name, a, b, k in self.rows_of(*self.sampled(part, _CHECKED)):
                used = np.linalg.norm(
                    a * (y0 - x0) / (2 * h) + b * (x0 + q * (y0 - x0)) + k, axis=-1
                )
                share = used.max(axis=0) ** (0.5 if name in _SPEEDS else 1)
                most[part] = np.maximum(most[part], share)
        return most

    def timed(self, curve: Curve, x: Array, y: Array) -> Timed:
        """Return the motion with the values x and y of s'² at the ends of the cells."""
        at = np.arange(len(x)) + np.cumsum(self.begins) - 1  # each piece has one more point
        stop, knots = at[self.ends] + 1, self.path.knots[self.leg[self.ends] + 1]
        s, rate, steps = np.zeros((3, len(x) + len(stop)))
        s[at], s[stop] = self.s, knots
        rate[at], rate[stop] = np.sqrt(x), np.sqrt(y[self.ends])
        steps[at + 1] = 2 * self.h / (np.sqrt(x) + np.sqrt(y))
        if not self.path.moves[-1]:  # a pause at the end
            s, rate, steps = (
                np.append(s, self.path.knots[-1]),
                np.append(rate, 0),
                np.append(steps, 0),
            )
        times = np.cumsum(steps)
        return Timed(duration=times[-1], body=curve.body, curve=curve, s=s, rate=rate, times=times)

    def place(self, cell: np.intp | int) -> float:
        """Return s at the start of a cell."""
        return float(self.s[cell])


def _check_memory(cells: int) -> None:
    """Raise MemoryError if the cells of a path need more memory than the computer has."""
    pages = getattr(os, "sysconf_names", {}).get("SC_PHYS_PAGES")
    most = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") if pages else 2**33
    if cells * _MEMORY > most:
        raise MemoryError(
            f"curve: {cells} cells of the path need {cells * _MEMORY / 1e9:.1f} GB of memory, "
            f"and this computer has {most / 1e9:.1f} GB; divide the path"
        )


def _two_passes(grid: _Grid) -> tuple[Array, Array]:
    """Return s'² at the start and at the end of each cell."""
    count = len(grid.s)
    parts = list(blocks(count, _BLOCK))
    begins, ends = grid.stops(grid.begins, 0), grid.stops(grid.ends, 1)
    high, low = np.empty(count), np.empty(count)
    most, least = 0.0, 0.0
    for part in reported("fastest, first pass", parts[::-1]):
        Q = grid.ellipses(part.start, part.stop)
        A, B, C, D, E, F = Q
        tops, there = _tops(Q).tolist(), _listed(Q)
        for i in range(part.stop - 1, part.start - 1, -1):
            j = i - part.start
            if i in ends:
                most = ends[i]
                least = most if most < inf else 0.0
            y = max(min(most, tops[j]), least)
            if least > 0:  # the motion is still fast at the end of the path
                mirrored = np.stack([A[j], -B[j], C[j], -D[j], E[j], F[j]], axis=-1).tolist()
                least = max(0.0, -_largest(mirrored, least))
            most = _largest(there[j], y)
            if min(most, begins.get(i, inf)) == inf:
                raise ValueError(
                    f"limits: none of them bounds the speed near s = {grid.place(i):.6g}"
                )
            if least > most * (1 + 1e-9):
                where = f"a limit is too low near s = {grid.place(i):.6g}"
                raise ValueError(f"rates[1] is out of reach: {where}")
            high[i], low[i] = most, least
    x, y = np.empty(count), np.empty(count)
    for part in reported("fastest, second pass", parts):
        A, B, C, D, E, F = grid.ellipses(part.start, part.stop)
        back = _listed(np.stack([C, B, A, E, D, F]))
        for i in range(part.start, part.stop):
            if i in begins:
                wanted = begins[i] if begins[i] < inf else 0.0
                here = float(min(high[i], begins[i]))
                if here < max(low[i], wanted) * (1 - 1e-9):
                    why = (
                        "too low for rates[1]"
                        if low[i] > here
                        else "too high to brake, or above a limit"
                    )
                    raise ValueError(f"rates[0] is {why}")
            if i in ends:
                most = ends[i]
                least = most if most < inf else 0.0
            else:
                most, least = high[i + 1], low[i + 1]
            x[i] = here
            y[i] = here = float(max(min(_largest(back[i - part.start], here), most), least, 0.0))
    return x, y


def _listed(Q: Array) -> list[list[list[float]]]:
    """Return the coefficients by cell and limit, as lists: Python is faster than NumPy for rows."""
    cells: list[list[list[float]]] = Q.transpose(1, 2, 0).tolist()
    return cells


def _tops(Q: Array) -> Array:
    """Return, for each cell, the y with the largest x + y, where x is as large as y allows.

    This y is found by bisection of its logarithm.
    """
    A, B, C, D, E, F = Q
    free = A == 0  # the limit does not depend on x
    low, high = np.full((len(A), 1), 1e-60), np.full((len(A), 1), 1e60)
    for _ in range(50):
        y = np.sqrt(low * high)
        t, G = B * y + D, (C * y + 2 * E) * y + F
        square = t * t - A * G
        root = np.sqrt(np.maximum(square, 0))
        with np.errstate(divide="ignore", invalid="ignore"):
            most, least = (
                np.where(free, sign * inf, np.where(sign * t > 0, -G / (t + x), (x - t) / A))
                for sign, x in ((1, root), (-1, -root))
            )
            i = np.arange(len(A)), most.argmin(axis=1)
            x = most[i][:, None]
            rises = ((A - B) * x + (B - C) * y + D - E)[i][:, None] > 0
        allowed = np.where(free, G <= 0, square >= 0).all(axis=1, keepdims=True)
        allowed &= (x >= least.max(axis=1, keepdims=True)) & (x >= 0)
        low, high = np.where(allowed & rises, y, low), np.where(allowed & rises, high, y)
    return low[:, 0]


def _largest(ellipses: list[list[float]], y: float) -> float:
    """Return the largest x that all limits of a cell allow for a given y."""
    x = inf
    for A, B, C, D, E, F in ellipses:
        t, G = B * y + D, (C * y + 2 * E) * y + F
        if A == 0:
            x = -1.0 if G > 1e-9 else x  # this limit concerns y alone
        else:
            root = sqrt(max(t * t - A * G, 0.0))
            x = min(x, -G / (t + root) if t > 0 else (root - t) / A)
    return x
