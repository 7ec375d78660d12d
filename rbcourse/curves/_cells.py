"""The fastest motion along a path that is divided into cells.

The timing s(t) moves the body along a path c(s). Let x = s'² and u = s'' = ½ dx/ds. Every limit has
the form ‖a u + b x + k‖ ≤ 1, where a, b and k depend on s. In a cell of length h, u is constant, x
is linear in s from x to y, and u = (y − x)/2h. Each limit then confines (x, y) to ellipses or
strips. The motion takes the time Σ 2h/(√x + √y), which decreases if any x increases. On the pieces
between stops, a backward pass finds the largest x of each cell from which the end can be reached. A
forward pass finds the largest y that x and the first pass allow, which is the x of the next cell.
Since the limits of a cell are convex, this timing satisfies them, if any timing does. On 16 random
paths, it takes at most 2e-5 longer than the optimum of a cone program with limits only at the ends
of the same cells.

Similar methods, of which only abstracts or introductions were read: Pham and Pham (TOPP-RA, IEEE
Transactions on Robotics 34, 2018; two passes of linear programs for joints), Nguyen and Pham
(Journal of Guidance, Control, and Dynamics, 2016; rotations).
"""

from __future__ import annotations

import os
import warnings
from dataclasses import dataclass
from functools import lru_cache
from math import inf, sqrt
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbcourse._checks import as_finite, as_single
from rbcourse._numerics import Array, blocks, cross, matvec, reported
from rbcourse.body import Body, of_point
from rbcourse.curves.chain import Chain, evaluate_legs
from rbcourse.curves.curve import Curve
from rbcourse.curves.ends import as_body

Flags: TypeAlias = NDArray[np.bool_]
Counts: TypeAlias = NDArray[np.intp]
Triple: TypeAlias = tuple[Array, Array, Array]  # V, A and R, or a, b and k, or s, s' and times
SPEEDS = "angular_speed", "speed"
BENDS = "angular_acceleration", "acceleration", "torque", "force"

PATH = 1000  # the least cells of a path; T is then about 1e-3 above the shortest time
MOST_IN_LEG = 250  # the cells of a leg, in a chain of 4 to 16 legs
CHAIN = 4000  # the cells of a chain of 16 to 160 legs
USUAL_IN_LEG = 25  # the cells of a leg in a longer chain; T is 5e-3 too long for some paths
LEAST_IN_LEG = 4  # the cells of a leg whose velocity hardly changes
LEAST_AT_STOP = 50  # with 25, a chain of 100 geodesics at a low speed was up to 20 % too slow
DENSE = 0.2  # a leg has fewer cells if its velocity changes by less than this share
REFINEMENTS = 3  # how often the cells of a leg are halved if it exceeds a limit
TOLERANCE = 1e-4  # the share by which a limit may be exceeded

# Rounding. A leg of duration 1 stands still below STILL. Next to larger values, an end rests below
# REST of the largest speed, and is slow if its acceleration is below LEVEL of the largest.
STILL = 1e-14  # as a share of an angle of 1, or of the largest coordinate
STILL_BEND = 1e-12  # the same for accelerations
REST = 1e-12
LEVEL = 1e-9
CORNER = 1e-9  # a larger jump of the velocity is a stop, as a share [rounding, 3,000 legs: 4e-16]
ROUNDING = 1e-9  # of x where the passes meet, as a share; of limits that concern y alone

BLOCK = 1024  # cells, or times, evaluated together, which bounds the memory
MEMORY = 200  # bytes for each cell: places, two passes, and the result
PLACES = np.array([0, 0.5, 1])  # the places in a cell at which the path is evaluated
CHECKED = np.array([0.04, 0.25, 0.75, 0.96])  # the places at which the limits are checked
CONTROL = np.array(
    [
        [1, 0, 0],
        [-0.5, 2, -0.5],
        [0, 0, 1],
    ]
)
"""Maps the values of a quadratic polynomial at the places to its Bernstein coefficients."""


@dataclass(frozen=True)
class Limit:
    """The limit ‖a u + b x + k‖ ≤ 1 on the norm of a vector, or on each of its three components.

    The motion has the velocity V s' and the acceleration V u + A x in the body frame, with
    V = c(s, 1) and A = c(s, 2). For a speed, a = k = 0, and b is the squared share at s' = 1.
    """

    name: str
    bound: Array  # shape () or (3,)
    body: Body
    gravity: Array

    @property
    def of_speed(self) -> bool:
        return self.name in SPEEDS

    def vectors(self, V: Array, A: Array, R: Array) -> Triple:
        """Return a, b and k where the path has the velocity V, the acceleration A and rotation R.

        Their shape is (..., 1, 3) for a norm, and (..., 3, 1) for three components.
        """
        axis = -1 if self.bound.ndim else -2
        parts = (part / self.bound for part in self._quantity(V, A, R))
        a, b, k = (np.expand_dims(part, axis) for part in parts)
        if self.of_speed:
            square = np.vecdot(b, b)
            return a[..., :1], square[..., None], k[..., :1]
        return a, b, k

    def _quantity(self, V: Array, A: Array, R: Array) -> Triple:
        """Return a, b and k of the vector itself, such as the torque, each of shape (..., 3)."""
        body = self.body
        G, m, r = body.inertia, body.mass, body.centre
        w = V[..., :3]
        w_rate = A[..., :3]
        zero = np.zeros_like(w)
        if self.name == "angular_speed":
            return zero, w, zero
        if self.name == "angular_acceleration":
            return w, w_rate, zero
        if self.name == "torque":
            return w @ G, w_rate @ G + cross(w, w @ G), zero
        v = of_point(r, V)
        if self.name == "speed":
            return zero, v, zero
        v_rate = of_point(r, V, A)
        if self.name == "acceleration":
            return v, v_rate, zero
        weight = m * matvec(R.mT, self.gravity)
        return m * v, m * v_rate, -weight

    def share(self, used: Array) -> Array:
        """Return the largest share that a motion with the vectors a u + b x + k uses."""
        norms = np.linalg.norm(used, axis=-1)
        share = norms.max(axis=-1)
        return np.sqrt(share) if self.of_speed else share


def as_limits(
    curve: Curve,
    body: Body | None,
    *,
    gravity: ArrayLike = (0.0, 0.0, 0.0),
    **given: ArrayLike | None,
) -> list[Limit]:
    """Check the arguments of `fastest`, and return the limits that are not None."""
    if not isinstance(curve, Curve):
        raise ValueError(f"curve: a Curve is wanted, got {type(curve).__name__}")
    if curve.batch_shape:
        raise ValueError(f"curve: a single curve, not a stack, is wanted, got {curve!r}")
    bounds = {
        name: _as_bound(name, bound, curve.size)
        for name, bound in given.items()
        if bound is not None
    }
    if not bounds:
        raise ValueError(f"limits: none of {', '.join(SPEEDS + BENDS)} is given")
    moved = as_body(body, curve.body)
    by_inertia = {"torque", "force"} & bounds.keys()
    if by_inertia and body is None and moved.is_ball:
        raise ValueError("body: it is required for a limit on the torque or the force")
    as_single("body.inertia", moved.inertia, 3, 3)
    g = as_single("gravity", gravity, 3)
    return [Limit(name, bound, moved, g) for name, bound in bounds.items()]


def _as_bound(name: str, value: ArrayLike, size: int) -> Array:
    if name not in SPEEDS + BENDS:
        known = ", ".join(SPEEDS + BENDS)
        raise TypeError(f"{name}: no limit has this name; the limits are {known}")
    if size == 3 and name in ("speed", "acceleration", "force"):
        raise ValueError(f"{name}: a curve on SO(3) has no such limit")
    bound = as_finite(name, value)
    if bound.shape not in ((), (3,)) or bound.min() <= 0:
        raise ValueError(f"{name}: one or three numbers above 0 are wanted, got {bound.tolist()}")
    return bound


def fastest_motion(curve: Curve, limits: list[Limit], ends: Array) -> Triple:
    """Return grid points s, and s' and the times there; `ends` are the values of x at both ends."""
    path = _surveyed(curve, ends)
    counts = path.cell_counts()
    for left in range(REFINEMENTS, -1, -1):
        cells = Cells(path, counts, limits)
        of = f"fastest, grid {REFINEMENTS + 1 - left} of at most {REFINEMENTS + 1}, pass"
        x, y = _forward(cells, *_backward(cells, of), of)
        shares = cells.largest_shares(x, y)
        over = shares > 1 + TOLERANCE
        if left == 0 or not over.any():
            break
        counts[np.unique(cells.leg[over])] *= 2
    if over.any():
        worst = np.argmax(shares)
        what = f"a limit is exceeded by {shares[worst] - 1:.1e} {cells.near(worst)}"
        warnings.warn(what, RuntimeWarning, stacklevel=3)
    return cells.motion(x, y)


@dataclass(frozen=True)
class Path:
    """The legs of a path from the time 0 on, in a flat stack.

    The first axis of `rests`, `x` and `fine` has the length 2, for the start and the end of a leg.
    """

    legs: Curve
    knots: Array  # the ends of the legs, shape (L + 1,)
    moves: Flags  # whether the path moves in the leg, shape (L,)
    rests: Flags  # whether ω or v is 0, shape (2, L, 1 or 2)
    change: Array  # the largest change of a leg's velocity, as a share of its size, shape (L,)
    x: Array  # x at stops, which is infinite if it is free, and NaN elsewhere, shape (2, L)
    fine: Flags  # whether cells are smaller towards this end, shape (2, L)

    def cell_counts(self) -> Counts:
        legs = int(np.count_nonzero(self.moves))
        most = max(PATH // legs, min(MOST_IN_LEG, CHAIN // legs), USUAL_IN_LEG)
        least = max(PATH // legs, LEAST_IN_LEG)
        change = np.clip(self.change, 1e-9, DENSE)
        halvings = np.log2(DENSE / change).astype(np.intp)
        counts = np.maximum(most >> halvings, least)
        at_stop = ~np.isnan(self.x).all(axis=0)
        counts[at_stop] = max(most, LEAST_AT_STOP)
        return np.where(self.moves, counts, 0)

    def stops(self, end: int, cells: Counts) -> dict[int, float]:
        """Return x at the stops at one end of the legs, by the cell at this end."""
        x = self.x[end]
        chosen = np.flatnonzero(self.moves & ~np.isnan(x))
        return {int(cells[i]): float(x[i]) for i in chosen}


def _surveyed(curve: Curve, ends: Array) -> Path:
    if isinstance(curve, Chain):
        legs, knots = curve.legs.flat, curve.times
    else:
        legs, knots = curve.flat, np.array(curve.domain)
    V, A, unit = _sampled(legs)
    h = legs.duration[:, None]
    speed = np.abs(V).max(axis=-1) * h
    bend = np.abs(A).max(axis=-1) * h**2
    moves: Flags = (speed > STILL * unit).any(axis=(0, 2))
    if not moves.any():
        raise ValueError("curve: the path stands still")
    rests = _zero_at_ends(speed, REST, STILL * unit)
    level = _zero_at_ends(bend, LEVEL, STILL_BEND * unit)
    slow = np.all(rests & level, axis=-1)
    resting = np.all(rests, axis=-1)
    stops = _stops(V, resting, moves)
    size = np.abs(V).max(axis=(0, 3))
    change = np.abs(V - V[2]).max(axis=(0, 3)) / np.maximum(size, 1e-300)
    return Path(
        legs=legs,
        knots=knots - knots[0],
        moves=moves,
        rests=rests,
        change=np.max(change, axis=-1),
        x=_x_at_stops(stops, resting, slow, ends),
        fine=_fine_ends(stops, moves, slow),
    )


def _sampled(legs: Curve) -> Triple:
    """Return velocities and accelerations at five places of each leg, and their units.

    The shapes are (5, L, parts, 3) and (parts,). The parts are the rotation and the position; their
    units are an angle of 1 and the largest coordinate.
    """
    t = np.linspace(0, 1, 5)[:, None] * legs.duration
    shape = 5, legs.count, -1, 3
    V = legs._evaluate(t, 1).reshape(shape)
    A = legs._evaluate(t, 2).reshape(shape)
    coordinates = legs._evaluate(t[::4], 0)[..., :3, 3:]
    largest = np.abs(coordinates).max(initial=0)
    unit = np.array([1.0, largest])
    return V, A, unit[: V.shape[2]]


def _zero_at_ends(size: Array, share: float, rounding: Array) -> Flags:
    """Return whether a size is 0, up to rounding, at the start and at the end of each leg."""
    zero: Flags = size <= share * size.max(axis=0) + rounding
    return zero[[0, -1]]


def _stops(V: Array, resting: Flags, moves: Flags) -> Flags:
    """Return whether the body stops between legs: at a corner, at rest, or next to a pause."""
    jump = np.abs(V[0, 1:] - V[-1, :-1]).max(axis=-1)
    largest = np.abs(V).max(axis=(0, 1, 3))
    corner: Flags = (jump > CORNER * largest).any(axis=-1)
    rest = resting[1, :-1] & resting[0, 1:]
    pause = ~moves[1:] | ~moves[:-1]
    return corner | rest | pause


def _x_at_stops(stops: Flags, resting: Flags, slow: Flags, ends: Array) -> Array:
    x = np.full(slow.shape, np.nan)
    x[0, 1:][stops] = 0
    x[1, :-1][stops] = 0
    x[0, 0], x[1, -1] = ends
    x[~np.isnan(x) & resting] = inf  # the body rests at any s'
    x[slow] = 0
    return x


def _fine_ends(stops: Flags, moves: Flags, slow: Flags) -> Flags:
    """Return the slow ends, and the stops, but not those where the motion begins or ends."""
    moved = np.logical_or.accumulate(moves[:-1])
    moves_on = np.logical_or.accumulate(moves[:0:-1])[::-1]
    fine = slow.copy()
    fine[0, 1:] |= stops & moved
    fine[1, :-1] |= stops & moves_on
    return fine


class Cells:
    """The cells of the moving legs: their legs, starts s, lengths h, and ends as shares of legs."""

    def __init__(self, path: Path, counts: Counts, limits: list[Limit]) -> None:
        self.path = path
        self.limits = limits
        total = int(counts.sum())
        _check_memory(total)
        self.parts = list(blocks(total, BLOCK))
        first = np.cumsum(counts) - counts  # the first cell of each leg
        self.begins = path.stops(0, first)  # the first cells of pieces, and x there
        self.ends = path.stops(1, first + counts - 1)
        self.leg = leg = np.repeat(np.arange(len(counts)), counts)
        number = np.arange(total) - first[leg]
        even: Array = np.stack([number, number + 1]) / counts[leg]
        rests: Flags = path.rests[:, leg]
        self.rests = rests & (even == [[0], [1]])[..., None]  # at the ends of cells
        self.share = _graded(even, path.fine[:, leg])
        h = path.legs.duration[leg]
        self.s = path.knots[leg] + self.share[0] * h
        self.h = np.diff(self.share, axis=0)[0] * h
        self.ellipses = lru_cache(maxsize=4)(self._ellipses)  # each pass needs all of them

    def near(self, cell: np.intp | int) -> str:
        return f"near s = {self.s[cell]:.6g}"

    def _sampled(self, part: slice, places: Array) -> Triple:
        start, end = self.share[:, part, None]
        shares = start * (1 - places) + end * places
        own = np.repeat(self.leg[part], len(places))

        def values(order: int) -> Array:
            found = evaluate_legs(self.path.legs, own, shares.ravel(), order)
            found = found.reshape(*shares.shape, *found.shape[1:])
            return found.swapaxes(0, 1)

        R = values(0)[..., :3, :3]
        return values(1), values(2), R

    def _ellipses(self, start: int, stop: int) -> Array:
        """Return the coefficients of the limits A x² + 2 B x y + C y² + 2 D x + 2 E y + F ≤ 0.

        Their shape is (6, cells, ellipses). The vector a u + b x + k is replaced by the quadratic
        polynomial with the same values at the places. It lies in the convex hull of its Bernstein
        coefficients p x + q y + k, so that the limit holds in the whole cell if it holds for them.
        """
        part = slice(start, stop)
        V, A, R = self._sampled(part, PLACES)
        ends = V[::2].reshape(2, stop - start, -1, 3)
        ends[self.rests[:, part]] = 0  # exactly, not to rounding
        made = [self._ellipses_of(limit, limit.vectors(V, A, R), part) for limit in self.limits]
        return np.concatenate(made, axis=1).swapaxes(1, 2)

    def _ellipses_of(self, limit: Limit, vectors: Triple, part: slice) -> Array:
        a, b, k = vectors
        norms = np.linalg.norm(k, axis=-1)
        held = norms.max(axis=(0, 2))
        if held.max() >= 1:
            needed = f"{held.max():.6g} times the limit is needed to hold the body"
            where = self.near(part.start + np.argmax(held >= 1))
            raise ValueError(f"{limit.name}: {needed} {where}")
        u = a / (2 * self.h[part, None, None])
        place = PLACES[:, None, None, None]
        p = np.tensordot(CONTROL, (1 - place) * b - u, 1)
        q = np.tensordot(CONTROL, place * b + u, 1)
        k = np.tensordot(CONTROL, k, 1)
        first = np.stack([p, p, q, p, q, k])
        second = np.stack([p, q, q, k, k, k])
        coefficients = np.vecdot(first, second)
        coefficients[5] -= 1
        return coefficients.swapaxes(2, 3).reshape(6, -1, len(held))

    def largest_shares(self, x: Array, y: Array) -> Array:
        """Return, for each cell, the largest share of a limit at the places `CHECKED`."""
        largest = np.zeros(len(x))
        place = CHECKED[:, None, None, None]
        for part in reported("fastest, check", self.parts):
            V, A, R = self._sampled(part, CHECKED)
            start = x[part, None, None]
            step = y[part, None, None] - start
            h = self.h[part, None, None]
            here = start + place * step
            for limit in self.limits:
                a, b, k = limit.vectors(V, A, R)
                share = limit.share(a * step / (2 * h) + b * here + k)
                largest[part] = np.maximum(largest[part], share.max(axis=0))
        return largest

    def motion(self, x: Array, y: Array) -> Triple:
        last = np.array(list(self.ends))
        knots = self.path.knots
        s = np.insert(self.s, last + 1, knots[self.leg[last] + 1])
        start = np.sqrt(x)
        end = np.sqrt(y)
        rate = np.insert(start, last + 1, end[last])
        steps = 2 * self.h / (start + end)
        steps = np.insert(steps, list(self.begins), 0)
        if not self.path.moves[-1]:  # a pause at the end
            s = np.append(s, knots[-1])
            rate = np.append(rate, 0)
            steps = np.append(steps, 0)
        return s, rate, np.cumsum(steps)


def _check_memory(cells: int) -> None:
    pages = getattr(os, "sysconf_names", {}).get("SC_PHYS_PAGES")
    most = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") if pages else 2**33
    if cells * MEMORY > most:
        raise MemoryError(
            f"curve: {cells} cells of the path need {cells * MEMORY / 1e9:.1f} GB of memory, "
            f"and this computer has {most / 1e9:.1f} GB; divide the path"
        )


def _graded(even: Array, fine: Flags) -> Array:
    """Return the ends of cells, as shares of their legs, with smaller cells at fine ends."""
    start, end = fine
    from_start = even**2
    to_end = 1 - (1 - even) ** 2
    both = from_start * (3 - 2 * even)
    return np.select([start & end, start, end], [both, from_start, to_end], even)


def _backward(cells: Cells, of: str) -> tuple[Array, Array]:
    """Return the least and the largest x of each cell from which the end can be reached.

    The least x exceeds 0 if the motion is still fast at the end of the path.
    """
    begins = cells.begins
    ends = cells.ends
    low, high = np.empty((2, len(cells.s)))
    least, most = 0.0, 0.0
    for part in reported(f"{of} 1 of 2", cells.parts[::-1]):
        Q = cells.ellipses(part.start, part.stop)
        # these are lists, because Python is faster than NumPy for single cells
        ellipses = Q.transpose(1, 2, 0).tolist()
        tops = _tops(Q).tolist()
        rows = zip(range(part.start, part.stop), ellipses, tops, strict=True)
        for i, limits, top in reversed(list(rows)):
            if i in ends:
                least, most = _span(ends[i])
            y = max(min(most, top), least)
            if least > 0:
                mirrored = [[A, -B, C, -D, E, F] for A, B, C, D, E, F in limits]
                least = max(0.0, -_largest(mirrored, least))
            most = _largest(limits, y)
            if min(most, begins.get(i, inf)) == inf:
                raise ValueError(f"limits: none of them bounds the speed {cells.near(i)}")
            if least > most * (1 + ROUNDING):
                where = f"a limit is too low {cells.near(i)}"
                raise ValueError(f"rates[1] is out of reach: {where}")
            low[i] = least
            high[i] = most
    return low, high


def _forward(cells: Cells, low: Array, high: Array, of: str) -> tuple[Array, Array]:
    """Return the largest x and y of each cell, if all x are between `low` and `high`."""
    begins = cells.begins
    ends = cells.ends
    x, y = np.empty((2, len(low)))
    for part in reported(f"{of} 2 of 2", cells.parts):
        A, B, C, D, E, F = cells.ellipses(part.start, part.stop)
        swapped = np.stack([C, B, A, E, D, F], axis=-1)  # limits on y and x
        for i, limits in enumerate(swapped.tolist(), part.start):
            if i in begins:
                here = _first_x(begins[i], low[i], high[i])
            if i in ends:
                least, most = _span(ends[i])
            else:
                least, most = low[i + 1], high[i + 1]
            x[i] = here
            here = float(max(min(_largest(limits, here), most), least))
            y[i] = here
    return x, y


def _span(x: float) -> tuple[float, float]:
    """Return the least and the largest x at a stop; x is free if it is infinite."""
    return (x, x) if x < inf else (0.0, inf)


def _first_x(wanted: float, low: float, high: float) -> float:
    least, most = _span(wanted)
    x = float(min(high, most))
    if x < max(low, least) * (1 - ROUNDING):
        why = "too low for rates[1]" if low > x else "too high to brake, or above a limit"
        raise ValueError(f"rates[0] is {why}")
    return x


def _largest(ellipses: list[list[float]], y: float) -> float:
    """Return the largest x that all limits of a cell allow for a given y.

    `_can_rise` has the same formula for arrays, which takes longer for one cell.
    """
    x = inf
    for A, B, C, D, E, F in ellipses:
        # the limit is A x² + 2 t x + G ≤ 0
        t = B * y + D
        G = (C * y + 2 * E) * y + F
        if A == 0:
            x = -1.0 if G > ROUNDING else x  # this limit concerns y alone
        else:
            root = sqrt(max(t * t - A * G, 0.0))
            x = min(x, -G / (t + root) if t > 0 else (root - t) / A)
    return x


def _tops(Q: Array) -> Array:
    """Return, for each cell, the y with the largest x + y, where x is as large as y allows.

    Near the top of an ellipse, a small gain of x causes a large loss of y, on which the time
    depends nearly equally. The y is found by bisection of its logarithm.
    """
    low = np.full((Q.shape[1], 1), 1e-60)
    high = np.full((Q.shape[1], 1), 1e60)
    for _ in range(50):
        y = np.sqrt(low * high)
        more = _can_rise(Q, y)
        low = np.where(more, y, low)
        high = np.where(more, high, y)
    return low[:, 0]


def _can_rise(Q: Array, y: Array) -> Flags:
    """Return whether y is allowed, and x + y increases with y, shape (cells, 1)."""
    A, B, C, D, E, F = Q
    t = B * y + D
    G = (C * y + 2 * E) * y + F
    square = t * t - A * G
    root = np.sqrt(np.maximum(square, 0))
    free = A == 0  # the limit does not depend on x
    with np.errstate(divide="ignore", invalid="ignore"):
        most = np.where(t > 0, -G / (t + root), (root - t) / A)
        least = np.where(t < 0, -G / (t - root), (-root - t) / A)
        most = np.where(free, inf, most)
        least = np.where(free, -inf, least)
        active = np.arange(len(A)), most.argmin(axis=1)
        x = most[active][:, None]
        # on the active limit, dx/dy = −(B x + C y + E)/(A x + B y + D)
        rises = (A - B) * x + (B - C) * y + D - E > 0
    allowed = np.where(free, G <= 0, square >= 0)
    allowed &= x >= np.maximum(least, 0)
    return rises[active][:, None] & allowed.all(axis=1, keepdims=True)
