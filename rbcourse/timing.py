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

The algorithm makes two passes. The backward pass finds the largest x_i from which the end can be
reached. The forward pass finds the largest x_i+1 that x_i and the first pass allow. Since the
limits of a cell are convex, the passes find a timing that satisfies the limits on the cells, if one
exists. The motion takes the time Σ 2h/(s'_i + s'_i+1), which decreases if any x increases.

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

import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from math import inf, sqrt
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._checks import as_finite, as_inertia, as_positive, as_single, as_time
from rbcourse._numerics import Array, cross, matvec
from rbcourse.curves import Curve
from rbcourse.paths import Chain

FINER = 1, 2, 4, 8
TOLERANCE = 1e-4  # the share by which a limit may be exceeded
_PLACES = np.array([0, 0.5, 1])[:, None, None]
"""The places in a cell at which the path is evaluated."""
_CONTROL = np.array([[1, 0, 0], [-0.5, 2, -0.5], [0, 0, 1]])
"""Maps the values of a quadratic polynomial at these places to its Bernstein coefficients."""
_SPEEDS = "angular_speed", "speed"
_BENDS = "angular_acceleration", "acceleration", "torque", "force"
Row = tuple[str, Array, Array, Array]
Rows = Callable[[Array, Array, Array], Iterator[Row]]


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
        If a limit is still exceeded by more than 1e-4 with the finest grid.

    Notes
    -----
    The grid has 1,000 cells or, for a chain, 250 for each leg (25 if there are many legs). It is
    refined by factors of at most eight, until no limit is exceeded by more than 1e-4. T is then
    about 1e-3 above the shortest time. The motion stops where the velocity of the path jumps. Its
    acceleration jumps where that of the path jumps, at both ends, and between cells; the jerk is
    not limited. A thousand cells take about 50 ms.

    Examples
    --------
    >>> from rbcourse import exp_so3, geodesic_so3
    >>> turn = geodesic_so3(np.eye(3), exp_so3([0, 0, 3]))
    >>> c = fastest(turn, angular_speed=1, angular_acceleration=2)  # 3/1 + 1/2 s
    >>> round(c.domain[1], 4), c(1.75, 1).round(9)
    (3.5, array([0., 0., 1.]))
    """
    path = curve.curve if isinstance(curve, Timed) else curve
    rows_of = _limits(
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
    ends = as_single("rates", rates, 2)
    if ends.min() < 0:
        raise ValueError(f"rates: two numbers from 0 up are wanted, got {rates}")
    for finer in FINER:
        s, V, A, R, caps, near = _sampled(path, finer)
        rows, moving = list(rows_of(V, A, R)), np.array([V[0, 0].any(), V[-1, -1].any()])
        if all(name in _SPEEDS for name, *_ in rows):
            raise ValueError(f"limits: one of {', '.join(_BENDS)} is needed")
        held = np.max([np.linalg.norm(k, axis=-1) for *_, k in rows], axis=(0, 1))
        if (held >= 1).any():
            where = f"to hold the body near s = {s[np.argmax(held >= 1)]:.6g}"
            raise ValueError(f"force: {held.max():.6g} times the limit is needed {where}")
        x = _two_passes(s, _ellipses(np.diff(s), rows, near), caps, ends**2 * moving, moving)
        timed = Timed(duration=np.array(1.0), curve=path, s=s, rate=np.sqrt(x))
        timed = replace(timed, duration=np.array(timed.times[-1]))
        most, when = max(_shares(timed, rows_of, 1001).values())
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


def _shares(curve: Curve, rows_of: Rows, count: int) -> dict[str, tuple[float, float]]:
    t = np.linspace(*curve.domain, count)
    if isinstance(curve, Chain | Timed):
        starts, ends = curve.times[:-1], np.nextafter(curve.times[1:], -inf)
        t = np.unique([*t, *starts, *(starts + ends) / 2, *ends])
    shares: dict[str, Array] = {}
    for name, _, b, k in rows_of(curve(t, 1), curve(t, 2), curve(t)[:, :3, :3]):
        share = np.linalg.norm(b + k, axis=-1) ** (0.5 if name in _SPEEDS else 1)
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


def _limits(
    curve: Curve,
    *,
    inertia: ArrayLike | None = None,
    mass: float = 1.0,
    centre: ArrayLike = (0.0, 0.0, 0.0),
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
    if "torque" in most and inertia is None:
        raise ValueError("inertia: it is required for a limit on the torque")
    G = np.eye(3) if inertia is None else as_inertia("inertia", as_single("inertia", inertia, 3, 3))
    m, r = as_positive("mass", mass), as_single("centre", centre, 3)
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


def _sampled(path: Curve, finer: int) -> tuple[Array, ...]:
    """Return the grid points s, shape (N + 1,), and V, A, R at three places of each of the N cells.

    Each leg has the same number of cells, which are smaller near ends with c' = c'' = 0. The array
    `caps` has the largest allowed x: 0 at these ends and at corners, and infinity elsewhere. The
    cells `near` rest are the first or last 4 % of a leg.
    """
    knots = path.times if isinstance(path, Chain) else np.array(path.domain)
    h, L, halves = np.diff(knots), len(knots) - 1, path.size - 2
    n = finer * max(1000 // L, min(250, 4000 // L), 25)

    def at(share: Array) -> Array:
        return np.minimum(knots[:-1] + share * h, np.nextafter(knots[1:], -inf))

    def sizes(x: Array) -> Array:
        return np.abs(x.reshape(*x.shape[:-1], halves, 3)).max(axis=-1)

    probe = at(np.linspace(0, 1, 5)[:, None])
    far = np.array([1.0, np.abs(path(probe)[..., :3, 3:]).max(initial=0)])[:halves]
    v, a = (sizes(path(probe, k)) * h[:, None] ** k for k in (1, 2))
    if (still := (v <= 1e-14 * far).all(axis=(0, 2))).any():
        i = np.argmax(still)
        between = f", between poses[{i}] and poses[{i + 1}]" if L > 1 else ""
        raise ValueError(f"curve: the path stands still near s = {knots[i]:.6g}{between}")
    rest = (v <= 1e-12 * v.max(axis=0) + 1e-14 * far)[[0, -1]]  # up to rounding
    slow = (rest & (a <= 1e-9 * a.max(axis=0) + 1e-12 * far)[[0, -1]]).all(axis=-1)
    q = np.linspace(0, 1, n + 1)[:, None]
    graded = q * q * (3 - 2 * q), q * q, 1 - (1 - q) ** 2
    share = np.select([slow.all(axis=0), slow[0], slow[1]], graded, q + np.zeros(L))
    t = at(share[:-1] + _PLACES * np.diff(share, axis=0)).swapaxes(1, 2)
    V, A, R = path(t, 1), path(t, 2), path(t)[..., :3, :3]
    each = V.reshape(*t.shape, halves, 3)
    each[0, :, 0][rest[0]] = each[-1, :, -1][rest[1]] = 0
    caps, corners = np.full(L * n + 1, inf), np.append(slow[0], False) | np.append(False, slow[1])
    jumps = np.abs(each[0, 1:, 0] - each[-1, :-1, -1]).max(axis=-1)
    corners[1:-1] |= (jumps > 1e-9 * sizes(V).max(axis=(0, 1, 2))).any(axis=-1)
    caps[::n][corners] = 0
    near = np.zeros((L, n, 1), bool)
    near[rest[0].any(axis=-1), : n // 25] = near[rest[1].any(axis=-1), -(n // 25) :] = True
    V, A, R = (x.reshape(len(x), L * n, *x.shape[3:]) for x in (V, A, R))
    return np.append(t[0], knots[-1]), V, A, R, caps, near.reshape(-1, 1)


def _two_passes(s: Array, Q: Array, caps: Array, ends: Array, moving: Array) -> Array:
    """Return x on the grid; `ends` are the values of x at both ends, if the path moves there."""
    A, B, C, D, E, F = Q
    tops, cap, N = _tops(Q, caps).tolist(), caps.tolist(), len(s) - 1

    def listed(*rows: Array) -> list[list[list[float]]]:
        cells: list[list[list[float]]] = np.stack(rows).transpose(1, 2, 0).tolist()
        return cells

    first, last = ends.tolist()
    there, back = listed(A, B, C, D, E, F), listed(C, B, A, E, D, F)
    least = listed(A, -B, C, -D, E, F) if last > 0 else []
    low, high = [0.0] * N + [last], [inf] * N + [last if moving[1] else cap[N]]
    for i in range(N - 1, -1, -1):  # find the largest x from which the end can be reached
        high[i] = min(_largest(there[i], max(min(high[i + 1], tops[i]), low[i + 1])), cap[i])
        low[i] = max(0.0, -_largest(least[i], low[i + 1])) if low[i + 1] > 0 else 0.0
        if high[i] == inf:
            raise ValueError(f"limits: none of them bounds the speed near s = {s[i]:.6g}")
        if low[i] > high[i] * (1 + 1e-9):
            raise ValueError(f"rates[1] is out of reach: a limit is too low near s = {s[i]:.6g}")
    x = [min(high[0], first) if moving[0] else high[0]]
    if x[0] < max(low[0], first) * (1 - 1e-9):
        why = "too low for rates[1]" if low[0] > x[0] else "too high to brake, or above a limit"
        raise ValueError(f"rates[0] is {why}")
    for i in range(N):
        x.append(max(min(_largest(back[i], x[i]), high[i + 1]), low[i + 1], 0.0))
    return np.array(x)


def _ellipses(h: Array, rows: list[Row], near: Array) -> Array:
    """Return the coefficients of the limits A x² + 2 B x y + C y² + 2 D x + 2 E y + F ≤ 0.

    In cells near rest, where b changes much, limits on speeds use its largest value in the cell.
    """
    made = []
    for name, a, b, k in rows:
        if name in _SPEEDS:
            b = np.where(near, b.max(axis=0), b)
        g = a / (2 * h[:, None])
        parts = (1 - _PLACES) * b - g, _PLACES * b + g, k
        p, q, k = (np.tensordot(_CONTROL, part, 1) for part in parts)
        made.append(np.vecdot([p, p, q, p, q, k], [p, q, q, k, k, k]))
        made[-1][5] -= 1
    return np.concatenate(made, axis=1).swapaxes(1, 2)


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
        t, G = B * y + D, (C * y + 2 * E) * y + F
        if A == 0:
            x = -1.0 if G > 1e-9 else x  # this limit concerns y alone
        else:
            root = sqrt(max(t * t - A * G, 0.0))
            x = min(x, -G / (t + root) if t > 0 else (root - t) / A)
    return x
