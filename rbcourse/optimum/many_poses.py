"""Curves of least acceleration, torque or jerk through many rotations or poses."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbcourse._checks import as_single
from rbcourse._docs import described_by
from rbcourse._numerics import Array, matvec
from rbcourse._polynomials import grid
from rbcourse.body import Body
from rbcourse.curves.closed import normalised_cubic
from rbcourse.curves.ends import Ends, as_body
from rbcourse.curves.functionals import BallAcceleration, Effort, Functional, Jerk
from rbcourse.curves.velocities import (
    Conditions,
    PathEnds,
    as_ends,
    checked_path,
    path_velocities,
    quaternion_system,
    spline_velocities,
)
from rbcourse.optimum._collocation import NODES, Failure, Solution, on_nodes
from rbcourse.optimum._guesses import SAME
from rbcourse.optimum._result import ConvergenceError, OptimalChain, OptimalMotion, optimum_of
from rbcourse.optimum._search import body as of_body
from rbcourse.optimum._search import cheapest
from rbcourse.optimum._spline import Found, Problem, solve_spline
from rbcourse.projection import nearest
from rbcourse.so3 import log

WINDING = 1.5  # rad: legs that turn by less were the cheapest ones [others turned by 2.4 or more]
ROUNDS = 8  # of replacing legs by cheaper ones [of 160 splines, 14 needed 1 to 6]
TOO_UNEVEN = "the poses may be too far apart, or the times between them too different"
TOO_DIFFERENT = ", or the principal moments too different"


@described_by(spline_velocities)
def minimum_acceleration_spline(
    times: ArrayLike,
    poses: ArrayLike,
    ends: PathEnds = "natural",
    *,
    body: Body | None = None,
    long: ArrayLike = False,
) -> OptimalChain:
    """Return the curve of least acceleration through many rotations or poses.

    Source: BK (18), BK 6.3; beyond BK 12, beyond BK 15.

    Parameters
    ----------
    body : Body, optional
        The body that moves, by default the ball of metrics (12) and (14).
    long : array_like of bool, shape (N − 1,), optional
        Whether each leg of the starting curve (or all legs) turns by 2π minus the least angle.

    Returns
    -------
    OptimalChain
        A `Chain` of optimal legs with the least `acceleration_cost` that Newton's method finds,
        starting from `quaternion_spline`; for a body, again with cheaper legs as long as there are
        any. w' (for a body, the torque) is continuous, and 0 at natural ends. For poses, the centre
        of mass moves on a cubic spline.

    Raises
    ------
    ConvergenceError
        If no minimum is found.

    Warns
    -----
    RuntimeWarning
        If, for a body, another leg with the same ends costs less, and no spline with this leg is
        found. Then ``converged`` is False.

    Notes
    -----
    If velocities are given at both ends, a curve of least acceleration exists. With natural or
    periodic ends, it may not exist: for rotations by 0, 1 and 0.3 rad about one axis, at the times
    0, 1 and 1 + √2, more full turns on the legs make the cost as small as you like. For bodies, a
    result that is not ``certified`` can have a leg that is a saddle. A leg that is much shorter
    than its neighbours may spin; to prevent this, insert poses. Singular set: neighbouring
    rotations a half-turn apart raise ValueError.

    Examples
    --------
    >>> from rbcourse import acceleration_cost, exp_so3, projected_spline
    >>> path = [0, 1, 3], exp_so3([[0, 0, 0], [0, 0, 1], [0, 1, 0]])
    >>> c = minimum_acceleration_spline(*path)
    >>> c.certified, bool(np.abs(c.jumps(2)).max() < 1e-9)
    (True, True)
    >>> round(float(acceleration_cost(projected_spline(*path)) / c.cost) - 1, 3)
    0.201
    """
    times, poses, _ = checked_path(times, poses)
    size = 3 * poses.shape[-1] - 6
    h = np.diff(times)
    of_mass = as_body(body, Body.ball())
    conditions = as_ends(ends, len(poses), size)
    rotations = conditions._replace(given=conditions.given[:, :3])
    turning = _spline(times, poses[:, :3, :3], rotations, of_mass, "acceleration", long)
    if size == 3:
        return turning
    R, w = poses[:, :3, :3], turning.velocities
    v = path_velocities(h, poses, w, conditions, of_mass.centre)
    d = poses[:, :3, 3] + R @ of_mass.centre
    rate = matvec(R, v + np.cross(w, of_mass.centre))
    path = [d[:-1], d[1:], h[:, None] * rate[:-1], h[:, None] * rate[1:]]
    legs = OptimalMotion(
        duration=h,
        body=of_mass,
        rotation=turning.optimum,
        path=np.stack(path, axis=-2),
    )
    cost = turning.cost + of_mass.mass * float(np.sum(legs.moving_cost))
    return replace(turning, legs=legs, velocities=np.append(w, v, axis=1), cost=cost)


@described_by(spline_velocities, minimum_acceleration_spline)
def minimum_torque_spline(
    times: ArrayLike,
    poses: ArrayLike,
    ends: PathEnds = "natural",
    *,
    body: Body,
    long: ArrayLike = False,
) -> OptimalChain:
    """Return the curve with the least integral of squared torque through many rotations.

    Errors, domain and singular set are those of `minimum_acceleration_spline`.
    Source: beyond BK 4, beyond BK 12.

    Parameters
    ----------
    poses : array_like, shape (N, 3, 3)
        A rotation matrix for each of the times.
    body : Body
        The body that moves.

    Returns
    -------
    OptimalChain
        The chain of least `torque_cost` found; the torque is continuous, and 0 at natural ends.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> turns, book = exp_so3([[0, 0, 0], [0, 0, 1], [0, 1, 0]]), Body(np.diag([1.0, 2.22, 3.18]))
    >>> minimum_torque_spline([0, 1, 3], turns, body=book).definite
    True
    """
    times, rotations = _rotations(times, poses)
    conditions = as_ends(ends, len(rotations), 3)
    return _spline(times, rotations, conditions, as_body(body), "torque", long)


@described_by(spline_velocities, minimum_torque_spline)
def minimum_jerk_spline(
    times: ArrayLike, poses: ArrayLike, ends: PathEnds = "natural", *, long: ArrayLike = False
) -> OptimalChain:
    """Return the curve of least jerk through many rotations.

    Errors, domain and singular set are those of `minimum_acceleration_spline`.
    Source: beyond BK 5, beyond BK 12.

    Parameters
    ----------
    ends : {"natural", "rest", "periodic"} or pair of array_like, optional
        "natural": the covariant jerk and its derivative are 0 at both ends. "rest": velocity and
        acceleration are 0 at both ends. "periodic": they are the same at both ends. A pair gives
        the first and the last velocity, followed by the acceleration, in arrays of shape (6,). None
        in a pair means a natural end.

    Returns
    -------
    OptimalChain
        The chain with the least `jerk_cost` that was found. w, w', w'' and w''' are continuous.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> c = minimum_jerk_spline([0, 1, 3], exp_so3([[0, 0, 0], [0, 0, 1], [0, 1, 0]]))
    >>> c.jumps(3).round(8) + 0.0
    array([[0., 0., 0.]])
    """
    times, rotations = _rotations(times, poses)
    return _spline(times, rotations, as_ends(ends, len(rotations), 6), Body.ball(), "jerk", long)


def _rotations(times: ArrayLike, poses: ArrayLike) -> tuple[Array, Array]:
    times, rotations, _ = checked_path(times, poses)
    if rotations.shape[-1] != 3:
        raise ValueError(
            f"poses: rotations, shape (N, 3, 3), are wanted, got {rotations.shape}; "
            "take poses[:, :3, :3]"
        )
    return times, rotations


def _spline(
    times: Array, R: Array, ends: Conditions, body: Body, what: str, long: ArrayLike
) -> OptimalChain:
    """Return the optimum through rotations; `what` is "acceleration", "torque" or "jerk"."""
    T, R = np.diff(times), nearest(R)[0]
    unit = T.mean()
    orders = np.arange(1, 1 + ends.given.shape[1] // 3)
    scaled = ends._replace(given=ends.given * np.repeat(unit**orders, 3))
    functional: Functional = Jerk() if what == "jerk" else BallAcceleration()
    problem = Problem(R, T / unit, scaled, functional)
    curve = _starting_curve(problem, _as_long(long, len(T)))
    if what == "torque" or not body.is_ball:
        of_ball = solve_spline(problem, curve)
        curve = on_nodes(of_ball.R, NODES[0]) if isinstance(of_ball, Found) else curve
        G = as_single("body.inertia", body.inertia, 3, 3)
        effort = Effort(np.broadcast_to(G, (len(T), 3, 3)), of_torque=what == "torque")
        problem = problem._replace(functional=effort)
    found = solve_spline(problem, curve)
    if isinstance(found, Failure):
        is_body = isinstance(problem.functional, Effort)
        raise ConvergenceError(*found, TOO_UNEVEN + TOO_DIFFERENT * is_body)
    converged = True
    if isinstance(problem.functional, Effort):
        free = ~_as_long(long, len(T))
        found, converged = _with_cheaper_legs(problem, problem.functional, found, free)
    if not converged:
        warnings.warn(
            "the spline may not be the optimum: another leg between two of its poses costs less "
            "(see converged)",
            RuntimeWarning,
            stacklevel=3,
        )
    legs = optimum_of(problem.functional, problem.own(found.values), found.legs, T, body)
    return OptimalChain(
        duration=np.array(times[-1] - times[0]),
        body=body,
        times=times,
        legs=legs,
        velocities=found.values[:, :3] / unit,
        cost=float(np.sum(legs.cost)),
        definite=found.shift < 0,
        residual=float(np.max(legs.residual)),
        converged=converged,
        iterations=found.legs[0].iterations,
    )


def _with_cheaper_legs(
    problem: Problem, effort: Effort, found: Found, free: NDArray[np.bool_]
) -> tuple[Found, bool]:
    """Replace free legs by cheaper curves with the same ends, and solve again from this curve.

    Newton's method finds a minimum near its start; for bodies, legs of another shape can cost less.
    The second result tells whether no leg can be replaced any more.
    """
    for _ in range(ROUNDS):
        ends = problem.own(found.values).swapaxes(0, 1)
        turns = log(problem.R[:-1].mT @ problem.R[1:])
        size = np.linalg.norm([turns, *ends], axis=-1).max(axis=0)
        some = np.flatnonzero(free & (size > WINDING))
        if not len(some):
            return found, True
        between = Ends(problem.R[some], problem.R[some + 1], *ends[:, some])
        legs = cheapest(of_body(between, effort.G[some], of_torque=effort.of_torque))
        cheaper = {
            i: on_nodes(leg.R[None], NODES[2])
            for i, leg in zip(some.tolist(), legs, strict=True)
            if isinstance(leg, Solution) and leg.cost < (1 - SAME) * found.legs[i].cost
        }
        if not cheaper:
            return found, True
        curve = on_nodes(found.R, NODES[2])
        for i, leg in cheaper.items():
            curve[i] = leg[0]
        again = solve_spline(problem, curve)
        if isinstance(again, Failure) or again.cost >= (1 - SAME) * found.cost:
            break
        found = again
    return found, False


def _starting_curve(problem: Problem, long: NDArray[np.bool_]) -> Array:
    """Return the `quaternion_spline` at the nodes of its legs."""
    R, h, ends = problem.R, problem.h, problem.ends
    w = quaternion_system(h, R, long).solve(ends._replace(given=ends.given[:, :3]))
    legs = normalised_cubic(Ends(R[:-1], R[1:], h[:, None] * w[:-1], h[:, None] * w[1:]), h, long)
    return np.ascontiguousarray(legs.values(grid(NODES[0]).t[:, None], 0).swapaxes(0, 1))


def _as_long(long: ArrayLike, legs: int) -> NDArray[np.bool_]:
    way = np.asarray(long)
    if way.dtype != bool or way.shape not in ((), (legs,)):
        raise ValueError(f"long: a bool for each of {legs} legs is wanted, got {long!r}")
    return way
