"""The fastest timing of a path under limits on speeds, accelerations, torque and force.

The timing s(t) moves the body along a path c(s). Let x = s'² and u = s'' = ½ dx/ds. With
V = c(s, 1) = (ω, v) and A = c(s, 2) = (α, β), the motion has the velocity V s' and the acceleration
V u + A x in the body frame. The torque is G ω u + (G α + ω × G ω) x. The acceleration of the point
r of the body is (v + ω × r) u + (β + α × r + ω × (ω × r)) x. The force on a mass m at this point is
m times this acceleration, minus m Rᵀ g. So a limit on a speed has the form x ≤ X(s), and every
other limit has the form ‖a u + b x + k‖ ≤ 1.

The path is divided into cells of length h. In a cell, u is constant, x changes linearly from x_i to
y = x_i+1, and u = (y − x_i)/2h. Each limit is imposed at both ends of the cell. Since a, b and k
may jump between cells, their values inside the cell are used. The limit is ‖p x_i + q y + k‖ ≤ 1.
At the start, p = b − a/2h and q = a/2h; at the end, p = −a/2h and q = b + a/2h. These limits are
ellipses, or strips, in the plane of x_i and y.

The algorithm makes two passes. The backward pass finds the largest x_i from which the end can be
reached. The forward pass finds the largest x_i+1 that x_i and the first pass allow. Since the
limits of a cell are convex, the passes find a timing that satisfies the limits on the cells, if one
exists. The motion takes the time Σ 2h/(s'_i + s'_i+1), which decreases if any x increases.

Near the top of an ellipse, x_i grows only if y decreases. TOPP-RA chooses the largest x_i, which is
not the best choice there, since a small gain of x_i causes a large loss of y. The time depends
nearly equally on x_i and y, so `_tops` maximises x_i + y. On 80 random paths, the time is at most
1e-5 above the optimum on the same cells, which was computed by a cone program.

Pham and Pham (TOPP-RA, IEEE Transactions on Robotics 34, 2018) find reachable and controllable sets
of joints by two passes of linear programs. Nguyen and Pham (Journal of Guidance, Control, and
Dynamics, 2016) compute timings of rotations with bounds on angular velocities, accelerations or
torques. For this module, only the abstracts or introductions of both papers were read. We found no
other method that times poses under limits on the norms of vectors.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace
from functools import cached_property
from math import inf, sqrt
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbcourse._checks import as_finite, as_inertia, as_positive, as_single, as_time
from rbcourse._numerics import Array, cross, matvec
from rbcourse.curves import Curve
from rbcourse.paths import Chain

FINER = 1, 2, 4, 8
TOLERANCE = 1e-4  # the share by which a limit may be exceeded inside a cell
_REPEATS = 12
_INSIDE = np.linspace(0, 1, 6)[:, None, None]
_BETWEEN = np.linalg.solve(
    np.vander(np.linspace(0, 1, 6)).T, np.vander(np.linspace(0, 1, 121), 6).T
).T
"""The matrix that maps values at six points of a cell to their polynomial at 121 points."""
_SPEEDS = "angular_speed", "speed"
_BENDS = "angular_acceleration", "acceleration", "torque", "force"
Row = tuple[str, Array, Array, Array]


def fastest(
    curve: Curve,
    *,
    angular_speed: ArrayLike | None = None,
    speed: ArrayLike | None = None,
    angular_acceleration: ArrayLike | None = None,
    acceleration: ArrayLike | None = None,
    torque: ArrayLike | None = None,
    force: ArrayLike | None = None,
    inertia: ArrayLike | None = None,
    mass: float = 1.0,
    centre: ArrayLike = (0.0, 0.0, 0.0),
    gravity: ArrayLike = (0.0, 0.0, 0.0),
    rates: tuple[float, float] = (0.0, 0.0),
) -> Timed:
    """Return a curve that follows the given path as fast as the limits allow.

    Source: beyond BK 16.

    Parameters
    ----------
    curve : Curve
        A single curve. Only its path is used; its times do not matter.
    angular_speed, speed, angular_acceleration, acceleration : float or array_like, shape (3,)
        The largest allowed norms: of ω, of the velocity of the body's point `centre`, of ω', and of
        the acceleration of this point. Three numbers limit the magnitudes of the components in the
        body frame instead. For rotations, only ω, ω' and the torque can be limited.
    torque, force : float or array_like, shape (3,)
        The largest allowed norms of the torque G ω' + ω × G ω and of the force. The force is `mass`
        times the acceleration of `centre`, minus the weight. At least one limit on an acceleration,
        the torque or the force is required.
    inertia : array_like, shape (3, 3), optional
        The inertia G about the centre of mass; required for a limit on the torque.
    mass, centre, gravity : float; array_like, shape (3,); optional
        For a limit on the force, these are the mass, the centre of mass in the body frame, and the
        acceleration of free fall in the fixed frame. Without such a limit, `centre` may be any
        point, such as the tip of a tool.
    rates : (float, float), optional
        The values of s' at both ends: 0 is rest, and 1 is the velocity of the curve itself. A rate
        has no effect at an end where the curve rests.

    Returns
    -------
    Timed
        A `Curve` on [0, T].

    Raises
    ------
    ValueError
        If the path stands still, if no limit bounds the speed, if the force cannot hold the body at
        rest, or if the `rates` are out of reach. The message names the first place on the path.

    Warns
    -----
    RuntimeWarning
        If a limit is still exceeded by more than 1e-4 between the points of the finest grid.

    Notes
    -----
    The grid has 1,000 cells or, for a chain, 250 for each leg (25 if there are many legs). It is
    refined by factors of at most eight, until no limit is exceeded by more than 1e-4 between its
    points. T is then about 1e-3 above the shortest time. The motion stops where the velocity of the
    path jumps. The acceleration of the motion jumps where the acceleration of the path jumps, at
    both ends, and between cells; the jerk is not limited. A thousand cells take about 50 ms.

    Examples
    --------
    >>> from rbcourse import exp_so3, geodesic_so3
    >>> turn = geodesic_so3(np.eye(3), exp_so3([0, 0, 3]))
    >>> c = fastest(turn, angular_speed=1, angular_acceleration=2)  # 3/1 + 1/2 s
    >>> round(c.domain[1], 4), c(1.75, 1).round(9)
    (3.5, array([0., 0., 1.]))
    """
    path = curve.curve if isinstance(curve, Timed) else curve
    limits = _limits(
        path,
        angular_speed=angular_speed,
        speed=speed,
        angular_acceleration=angular_acceleration,
        acceleration=acceleration,
        torque=torque,
        force=force,
        inertia=inertia,
        mass=mass,
        centre=centre,
        gravity=gravity,
    )
    if not set(limits.most) & set(_BENDS):
        raise ValueError(f"limits: one of {', '.join(_BENDS)} is needed")
    ends = as_single("rates", rates, 2)
    if ends.min() < 0:
        raise ValueError(f"rates: two numbers from 0 up are wanted, got {rates}")
    for finer in FINER:
        grid = _sampled(path, finer)
        x, used = _squared_rates(grid, limits, ends)
        timed = Timed(duration=np.array(1.0), curve=path, s=grid.s, rate=np.sqrt(x))
        timed = replace(timed, duration=np.array(timed.times[-1]))
        most, when = max(_shares(timed, limits, 5001).values())
        if used.max() > most:
            most, when = float(used.max()), timed.times[np.argmax(used)]
        if most <= 1 + TOLERANCE:
            return timed
    what = f"a limit is exceeded by {most - 1:.1e} near s = {timed.progress(when)[0]:.6g}"
    warnings.warn(what, RuntimeWarning, stacklevel=2)
    return timed


def limits_used(curve: Curve, **limits: Any) -> dict[str, tuple[float, float]]:
    """Return, for each limit, the largest share that a curve uses, and the time of this maximum.

    Source: beyond BK 16.

    Parameters
    ----------
    curve : Curve
        A single curve.
    **limits
        The keyword arguments of `fastest`, without `rates`.

    Returns
    -------
    dict of str to (float, float)
        The largest share, and the first time at which the curve reaches this share to one part in a
        million. The curve is evaluated at 20,001 times and on both sides of the joints of a chain;
        a limit may be exceeded between these times.

    Examples
    --------
    >>> from rbcourse import exp_so3, geodesic_so3
    >>> limits_used(geodesic_so3(np.eye(3), exp_so3([0, 0, 3])), angular_speed=[1, 1, 2])
    {'angular_speed': (1.5, 0.0)}
    """
    return _shares(curve, _limits(curve, **limits), 20_001)


def _shares(curve: Curve, limits: _Limits, count: int) -> dict[str, tuple[float, float]]:
    t = np.linspace(*curve.domain, count)
    if isinstance(curve, Chain | Timed):
        t = np.unique([*t, *curve.times[:-1], *np.nextafter(curve.times[1:], -inf)])
    V, A, R = (curve(t, order) for order in (1, 2, 0))
    shares: dict[str, Array] = {}
    for name, a, b, k in limits.rows(V, A, R[:, :3, :3]):
        share = np.linalg.norm(a if name in _SPEEDS else b + k, axis=-1)
        shares[name] = np.maximum(shares.get(name, 0.0), share)
    first = {name: np.argmax(x >= x.max() * (1 - 1e-6)) for name, x in shares.items()}
    return {name: (float(x.max()), float(t[first[name]])) for name, x in shares.items()}


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Timed(Curve):
    """The `Curve` c(s(t)) on [0, T], with constant s'' in each cell.

    At the end of a cell, the s'' of the next cell is used.

    Attributes
    ----------
    curve : Curve
        The path c(s).
    s, rate, times : ndarray, shape (N + 1,)
        The grid points, the values of s' there, and the times at which the curve passes them. The
        curve passes the pose c(s0) of the path at ``times[np.searchsorted(s, s0)]``.
    """

    curve: Curve
    s: Array
    rate: Array

    @cached_property
    def times(self) -> Array:
        """The times at which the curve passes the grid points."""
        return np.append(0, np.cumsum(2 * np.diff(self.s) / (self.rate[1:] + self.rate[:-1])))

    @property
    def size(self) -> int:
        """The size of the curve's matrices: 3 on SO(3), 4 on SE(3)."""
        return self.curve.size

    def lasting(self, duration: Array) -> Self:
        """Return the same curve with another duration."""
        return replace(self, duration=duration, rate=self.rate * (self.duration / duration))

    def progress(self, t: ArrayLike) -> tuple[Array, Array, Array]:
        """Return s, s' and s'' at the times t."""
        t = as_time(t, 0, self.domain)
        i = np.clip(np.searchsorted(self.times, t, side="right") - 1, 0, len(self.s) - 2)
        past, v = t - self.times[i], self.rate[i]
        u = (np.diff(self.rate**2) / np.diff(self.s) / 2)[i]
        last = np.where(t < self.times[-1], np.nextafter(self.s[i + 1], -inf), self.s[-1])
        return np.clip(self.s[i] + past * (v + past * u / 2), self.s[i], last), v + past * u, u

    def evaluate(self, t: Array, order: int) -> Array:
        """Return the values at the times t, shape (T, 1), by the chain rule."""
        s, v, u = self.progress(t)
        c = [self.curve.evaluate(s, k) for k in range((order + 1) // 2, order + 1)]
        v, u = v[..., None], u[..., None]
        if order < 2:
            return c[0] * v if order else c[0]
        return c[0] * u + c[1] * v**2 if order == 2 else 3 * c[0] * u * v + c[1] * v**3

    def values(self, t: Array, order: int) -> Array:
        """Raise RuntimeError, because costs require smooth curves."""
        raise RuntimeError("curve: a Timed curve has no cost here, because its acceleration jumps")

    @property
    def flat(self) -> Self:
        """The curve itself."""
        return self


class _Limits(NamedTuple):
    most: dict[str, Array]
    G: Array
    mass: float
    centre: Array
    gravity: Array

    def rows(self, V: Array, A: Array, R: Array) -> list[Row]:
        """Return the name, a, b and k of each limit; a limit on a speed is ‖a‖² x ≤ 1."""
        (w, bend), (_, G, m, r, g) = (V[..., :3], A[..., :3]), self
        parts = {"angular_speed": (w,), "angular_acceleration": (w, bend)}
        parts["torque"] = w @ G, bend @ G + cross(w, w @ G)
        if V.shape[-1] == 6:
            v, pull = V[..., 3:] + cross(w, r), A[..., 3:] + cross(bend, r) + cross(w, cross(w, r))
            parts |= {"speed": (v,), "acceleration": (v, pull)}
            parts["force"] = m * v, m * pull, -m * matvec(R.mT, g)
        rows = []
        for name, most in self.most.items():
            a, b, k = (*parts[name], *np.zeros((2, *w.shape)))[:3]
            for i in [[0, 1, 2]] if most.ndim == 0 else [[0], [1], [2]]:
                each = np.broadcast_to(most, 3)[i]
                rows.append((name, a[..., i] / each, b[..., i] / each, k[..., i] / each))
        return rows


def _limits(
    curve: Curve,
    *,
    inertia: ArrayLike | None = None,
    mass: float = 1.0,
    centre: ArrayLike = (0.0, 0.0, 0.0),
    gravity: ArrayLike = (0.0, 0.0, 0.0),
    **limits: ArrayLike | None,
) -> _Limits:
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
    if "torque" in most and inertia is None:
        raise ValueError("inertia: it is required for a limit on the torque")
    G = np.eye(3) if inertia is None else as_inertia("inertia", as_single("inertia", inertia, 3, 3))
    vectors = as_single("centre", centre, 3), as_single("gravity", gravity, 3)
    return _Limits(most, G, as_positive("mass", mass), *vectors)


class _Grid(NamedTuple):
    """The grid points, shape (N + 1,), and V, A, R at six points of each cell, shape (6, N, ...).

    `stops` contains the indices of the grid points at which x = 0.
    """

    s: Array
    V: Array
    A: Array
    R: Array
    stops: NDArray[np.intp]


def _sampled(curve: Curve, finer: int) -> _Grid:
    """Return a grid with the same number of cells on each leg.

    The cells are smaller near ends with c' = c'' = 0.
    """
    legs = (curve.legs if isinstance(curve, Chain) else curve).flat
    knots = curve.times if isinstance(curve, Chain) else np.append(0.0, legs.duration)
    L, h, halves = legs.count, legs.duration, (curve.size - 2, 3)
    n = finer * max(1000 // L, min(250, 4000 // L), 25)
    q, probe = np.linspace(0, 1, n + 1)[:, None], np.linspace(0, 1, 5)[:, None]
    far = np.array([1.0, np.abs(legs.values(probe, 0)[..., :3, 3:]).max(initial=0)])[: halves[0]]

    def sizes(x: Array) -> Array:
        return np.abs(x.reshape(*x.shape[:-1], *halves)).max(axis=-1)

    rates, bends = (sizes(legs.values(probe, order)) for order in (1, 2))
    rest = (rates <= 1e-12 * rates.max(axis=0) + 1e-14 * far)[[0, -1]]  # up to rounding
    slow = rest & (bends <= 1e-9 * bends.max(axis=0) + 1e-12 * far)[[0, -1]]
    slow = slow.all(axis=-1)
    graded = q * q * (3 - 2 * q), q * q, 1 - (1 - q) ** 2
    share = np.select([slow.all(axis=0), slow[0], slow[1]], graded, q + np.zeros(L))
    points = np.minimum(share[:-1] + _INSIDE * np.diff(share, axis=0), 1)

    def along(order: int) -> Array:
        x = legs.values(points.reshape(-1, L), order)
        x = x.reshape(*points.shape, *x.shape[2:]).swapaxes(1, 2)
        return x.reshape(len(points), L * n, *x.shape[3:])

    V, A, R, each = along(1), along(2), along(0)[..., :3, :3], np.repeat(h, n)[:, None]
    V, A, first = V / each, A / each**2, np.arange(L) * n
    V[0, first] *= ~np.repeat(rest[0], 3, axis=-1)
    V[-1, first + n - 1] *= ~np.repeat(rest[1], 3, axis=-1)
    s = np.append((knots[:-1, None] + h[:, None] * share[:-1].T).ravel(), knots[-1])
    if (still := (rates <= 1e-14 * far).all(axis=(0, 2))).any():
        i = np.argmax(still)
        between = f", between poses[{i}] and poses[{i + 1}]" if L > 1 else ""
        raise ValueError(f"curve: the path stands still near s = {knots[i]:.6g}{between}")
    joints, fast = first[1:], sizes(V).max(axis=(0, 1))
    corners = (sizes(V[0, joints] - V[-1, joints - 1]) > 1e-9 * fast).any(axis=-1)
    ends = first[slow[0]], first[slow[1]] + n
    return _Grid(s, V, A, R, np.concatenate([joints[corners], *ends]))


def _squared_rates(grid: _Grid, limits: _Limits, rates: Array) -> tuple[Array, Array]:
    """Return x on the grid, and the largest share of a limit that is used in each cell.

    Cells in which a limit is exceeded between the ends are solved again with a lower limit.
    """
    s, V, A, R, stops = grid
    rows, h, X = limits.rows(V, A, R), np.diff(s), np.full(V.shape[:2], inf)
    with np.errstate(divide="ignore"):
        for name, a, _, _ in rows:
            if name in _SPEEDS:
                X = np.minimum(X, 1 / np.sum(a * a, axis=-1))
    parts = [row[1:] for row in rows if row[0] in _BENDS]
    held = np.max([np.linalg.norm(k, axis=-1) for _, _, k in parts], axis=(0, 1))
    if (held >= 1).any():
        most, where = held.max(), s[np.argmax(held >= 1)]
        raise ValueError(
            f"force: {most:.6g} times the limit is needed to hold the body near s = {where:.6g}"
        )
    caps = np.minimum(np.append(X[0], inf), np.append(inf, X[-1]))
    caps[stops] = 0
    moving = V[0, 0].any(), V[-1, -1].any()
    ends = [(r * r, r * r) if v else (0, inf) for r, v in zip(rates.tolist(), moving, strict=True)]
    scale = np.ones((len(h), 1))
    for _ in range(_REPEATS):
        ends_of_cells = [[y[[0, -1]] for y in (scale * a, scale * b, k)] for a, b, k in parts]
        x = _two_passes(s, ends_of_cells, caps, ends)
        u, inside = (np.diff(x) / h / 2)[:, None], x[:-1] + _INSIDE[..., 0] * np.diff(x)
        squares = [np.sum((a * u + b * inside[..., None] + k) ** 2, axis=-1) for a, b, k in parts]
        share = np.sqrt(np.max([(_BETWEEN @ y).max(axis=0) for y in squares], axis=0))
        fast = np.sqrt((_BETWEEN @ (inside / X)).max(axis=0))
        if max(share.max(), fast.max()) < 1 + TOLERANCE / 10:
            break
        scale *= 1 + 2 * (np.maximum(share, 1) - 1)[:, None] / (1 - held)[:, None]
        over = np.maximum(np.append(fast, 1), np.append(1, fast))
        caps = np.where(over > 1, np.minimum(caps, x) / np.maximum(over, 1) ** 2, caps)
    return x, np.maximum(share, fast)


def _two_passes(s: Array, rows: list[list[Array]], caps: Array, ends: list[Any]) -> Array:
    """Return x on the grid; `ends` are the least and the greatest allowed x at both ends."""
    A, B, C, D, E, F = Q = _ellipses(np.diff(s), rows)
    tops, cap, N = _tops(Q, caps).tolist(), caps.tolist(), len(s) - 1
    there, back, least = (
        np.stack(some).transpose(1, 2, 0).tolist()
        for some in ((A, B, C, D, E, F), (C, B, A, E, D, F), (A, -B, C, -D, E, F))
    )
    (first, most), (last, most_there) = ends
    low, high = [0.0] * N + [last], [inf] * N + [min(most_there, cap[N])]
    if last > high[N] * (1 + 1e-9):
        raise ValueError("rates[1] is above a limit on a speed")
    for i in range(N - 1, -1, -1):  # find the largest x from which the end can be reached
        high[i] = min(_largest(there[i], max(min(high[i + 1], tops[i]), low[i + 1])), cap[i])
        low[i] = max(0.0, -_largest(least[i], low[i + 1])) if low[i + 1] > 0 else 0.0
        if high[i] == inf:
            raise ValueError(f"limits: none of them bounds the speed near s = {s[i]:.6g}")
        if low[i] > high[i] * (1 + 1e-9):
            raise ValueError(f"rates[1] is out of reach: a limit is too low near s = {s[i]:.6g}")
    x = [min(high[0], most)]
    if x[0] < max(low[0], first) * (1 - 1e-9):
        why = "too low for rates[1]" if low[0] > x[0] else "too high to brake, or above a limit"
        raise ValueError(f"rates[0] is {why}")
    for i in range(N):
        x.append(max(min(_largest(back[i], x[i]), high[i + 1]), low[i + 1], 0.0))
    return np.array(x)


def _ellipses(h: Array, rows: list[list[Array]]) -> Array:
    """Return the coefficients of the limits A x² + 2 B x y + C y² + 2 D x + 2 E y + F ≤ 0."""
    made = []
    for a, b, k in rows:
        q = a / (2 * h[:, None])
        for p, r, c in ((b[0] - q[0], q[0], k[0]), (-q[1], b[1] + q[1], k[1])):
            A, B, C, D, E, F = np.vecdot([p, p, r, p, r, c], [p, r, r, c, c, c])
            made.append([A, B, C, D, E, F - 1])
    return np.stack(made, axis=-1)


def _tops(Q: Array, caps: Array) -> Array:
    """Return, for each cell, the y with the largest x + y, where x is as large as y allows.

    This y is found by bisection of its logarithm.
    """
    A, B, C, D, E, F = Q
    free = A == 0  # the limit does not depend on x
    low, high = np.full((len(A), 1), 1e-60), np.minimum(caps[1:], 1e60)[:, None]
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
        allowed &= (x >= least.max(axis=1, keepdims=True)) & (x >= 0) & (x < caps[:-1, None])
        low, high = np.where(allowed & rises, y, low), np.where(allowed & rises, high, y)
    return np.minimum(low[:, 0], caps[1:])


def _largest(ellipses: list[list[float]], y: float) -> float:
    """Return the largest x that all limits of a cell allow for a given y."""
    x = inf
    for A, B, C, D, E, F in ellipses:
        if A > 0:
            t, G = B * y + D, (C * y + 2 * E) * y + F
            root = sqrt(max(t * t - A * G, 0.0))
            x = min(x, -G / (t + root) if t > 0 else (root - t) / A)
    return x
