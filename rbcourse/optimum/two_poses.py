"""Curves between two rotations or poses with the least acceleration (BK (19)), torque or jerk."""

from __future__ import annotations

import warnings

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._docs import described_by
from rbcourse._numerics import Array
from rbcourse._polynomials import grid
from rbcourse.body import Body
from rbcourse.curves.curve import Curve
from rbcourse.curves.ends import Ends, Given, Rate, as_body, between, on_rotations
from rbcourse.curves.functionals import Effort
from rbcourse.optimum._collocation import Failure, relax
from rbcourse.optimum._result import (
    ConvergenceError,
    OptimalMotion,
    OptimalRotation,
    Optimum,
    optimum_of,
)
from rbcourse.optimum._search import LIMITS, Task, ball, cheapest, is_thin, jerk
from rbcourse.optimum._search import body as of_body


@described_by(between)
def minimum_acceleration(
    start: ArrayLike,
    goal: ArrayLike,
    v0: Rate = None,
    v1: Rate = None,
    *,
    body: Body | None = None,
    duration: ArrayLike = 1.0,
) -> Optimum:
    """Return the minimum-acceleration curve with these ends, for a ball or for any body.

    Source: BK (19), BK 6.2, BK 6.3, BK Prop. 7; beyond BK 3, beyond BK 9 (for bodies, see
    `rbcourse.curves.functionals.Effort`).

    Parameters
    ----------
    body : Body, optional
        The body that moves: one for all problems of a stack, or one for each problem. The default
        is the ball of metrics (12) and (14).

    Returns
    -------
    Optimum
        A `Curve` that meets all boundary conditions. Its ``cost`` is the `acceleration_cost`, the
        lowest that was found; ``c`` is the constant R w'' (for a body, R p of the costate p). For
        poses, the ``rotation`` is optimal, and the centre of mass moves on a cubic.

    Raises
    ------
    ConvergenceError
        For a single problem, if Newton's method does not converge from any of its starting curves.

    Warns
    -----
    RuntimeWarning
        If Newton's method does not converge for some problems of a stack (their curves are NaN), or
        if a starting curve costs less than the returned one. Then ``converged`` is False. Also if a
        body is a thin rod, whose moments have a ratio above 20, and the curve is not certified.

    Notes
    -----
    Singular set: none is known in closed form. Equation (19) is a necessary condition, not a
    sufficient one, and has several solutions. Costs with a relative difference below 1e-9 count as
    equal, so that rounding does not decide which curve is returned.

    Newton's method solves R p = c, starting from the cheapest of several curves, which turn the
    short way or the long way. The result is stationary, and ``certified`` tells whether it is
    proven to be a local minimum. It is not proven that no other curve costs less, even if
    ``converged`` is True, and for very thin rods, the method may not converge (docs/near_optimal.md
    has tests). If a body's moments have a ratio above 3e4, fewer curves are tried. If the end
    velocities are along the geodesic, the optimum is R0 exp(σ̂ p(t)), where p is a cubic and σ is a
    logarithm of R0ᵀR1 (not always the shortest logarithm). For poses, the mass changes the cost of
    the motion, but not the motion. `closed_forms.corrected_bezier` and `projected_cubic` are
    near-optimal, and `rbcourse.textbook` solves (19) by SciPy's `solve_bvp` and by shooting.

    Examples
    --------
    >>> from rbcourse import exp_so3, pose_from_coordinates
    >>> ends = np.eye(3), exp_so3([0, 0, 1.5]), [0, 0, 0], [0, 1, 0]
    >>> minimum_acceleration(*ends)([0, 1], 1).round(9) + 0.0
    array([[0., 0., 0.],
           [0., 1., 0.]])
    >>> book = Body(np.diag([1.0, 2.22, 3.18]))
    >>> minimum_acceleration(*ends, body=book)
    <Optimum of acceleration on SO(3), t in [0, 1], cost 91.221, a proven local minimum>
    >>> A1 = pose_from_coordinates([0, 0, 1, 2, 0, 0])
    >>> minimum_acceleration(np.eye(4), A1)(0.5)[:3, 3].round(9)
    array([1., 0., 0.])
    """
    given = between(start, goal, v0, v1, body=body, duration=duration)
    if given.body.is_ball:
        return _solved(ball(given.ends), given)
    return _solved(of_body(given.ends, given.body.inertia, of_torque=False), given)


@described_by(minimum_acceleration)
def minimum_torque(
    start: ArrayLike,
    goal: ArrayLike,
    v0: Rate = None,
    v1: Rate = None,
    *,
    body: Body,
    duration: ArrayLike = 1.0,
) -> Optimum:
    """Return the curve with these ends and the least integral of squared torque, on SO(3).

    Source: beyond BK 4 (see `rbcourse.curves.functionals.Effort`).

    Parameters
    ----------
    start, goal : array_like, shape (..., 3, 3)
        Rotation matrices.
    v0, v1 : array_like, shape (..., 3), optional
        The angular velocities at both ends in the body frame. The default is rest.
    body : Body
        The body that moves: one for all problems of a stack, or one for each problem.

    Returns
    -------
    Optimum
        A `Curve` that meets all boundary conditions. Its ``cost``, the `torque_cost`, is the lowest
        that was found; ``c`` is the constant R p of the costate p.

    Notes
    -----
    The method, errors, warnings and singular set are those of `minimum_acceleration`. The curve of
    a rod may not be the cheapest one, even if ``converged`` is True. For thin rods, the method
    may not converge, and may take a minute: for a ratio of moments of 100, it failed in 3 of 12
    problems with end velocities, and from rest to rest up to 1,000 in none of 12
    (docs/near_optimal.md has tests). A turn about a
    principal axis is a stationary curve; about the axis of the largest moment of inertia, it may be
    a saddle. With J = R G Rᵀ and H = R G w, the equation is J H'' + H' × H = c
    (`rbcourse.textbook.minimum_torque`).

    Examples
    --------
    From rest to rest, a turn of a book about the axis of its largest moment has the least torque if
    the angle is at most about 107.9°. Beyond this angle, curves that leave the axis cost less:

    >>> from rbcourse import exp_so3
    >>> book = Body(np.diag([1.0, 2.22, 3.18]))
    >>> c = minimum_torque(np.eye(3), exp_so3([0, 1.5, 0]), body=book)
    >>> round(c.cost, 9)  # about a principal axis 12 (2.22 · 1.5)²
    133.0668
    >>> minimum_torque(np.eye(3), exp_so3([0, 0, np.radians(100)]), body=book).certified
    True
    """
    given = between(start, goal, v0, v1, body=as_body(body), duration=duration)
    given = on_rotations(given, "minimum torque")
    return _solved(of_body(given.ends, given.body.inertia, of_torque=True), given)


@described_by(minimum_torque)
def minimum_jerk(
    start: ArrayLike,
    goal: ArrayLike,
    v0: Rate = None,
    v1: Rate = None,
    a0: Rate = None,
    a1: Rate = None,
    *,
    duration: ArrayLike = 1.0,
) -> Optimum:
    """Return the minimum-jerk curve with these ends, on SO(3).

    Source: beyond BK 5 (see `rbcourse.curves.functionals.Jerk`).

    Parameters
    ----------
    v0, v1, a0, a1 : array_like, shape (..., 3), optional
        The angular velocities w and accelerations w' at both ends in the body frame, by default 0.

    Returns
    -------
    Optimum
        A `Curve` that meets all boundary conditions. Its ``cost``, the `jerk_cost`, is the lowest
        that was found; ``c`` is the constant R p of the costate p.

    Notes
    -----
    The method, errors, warnings and singular set are those of `minimum_acceleration`. From rest to
    rest, the optimum follows the geodesic: R0 exp(σ̂ (10 t³ − 15 t⁴ + 6 t⁵)), which costs
    1440 ‖σ‖². `closed_forms.exponential_quintic` is near-optimal and has a closed form.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> c = minimum_jerk(np.eye(3), exp_so3([0, 0, 1.5]), a1=[0, 1, 0])
    >>> c([0, 1], 2).round(9) + 0.0
    array([[0., 0., 0.],
           [0., 1., 0.]])
    """
    given = between(start, goal, v0, v1, a0, a1, duration=duration)
    given = on_rotations(given, "minimum jerk")
    return _solved(jerk(given.ends, *given.bends), given)


def stationary(guess: Curve) -> Optimum:
    """Return the stationary curve that Newton's method finds from a guess with the same ends.

    Source: BK (19).

    Parameters
    ----------
    guess : Curve
        A curve on SO(3), or a stack of curves, without NaN. Its body does not matter.

    Returns
    -------
    Optimum
        A `Curve` along which R w'' is constant. It may not be the cheapest such curve. If no curve
        is found, the result is NaN (see ``converged``).

    Examples
    --------
    >>> from rbcourse import exp_so3, projected_cubic
    >>> guess = projected_cubic(np.eye(3), exp_so3([0, 0, 1.5]), [0, 0, 0], [0, 1, 0])
    >>> c = stationary(guess)
    >>> bool(np.abs(c([0, 1], 1) - guess([0, 1], 1)).max() < 1e-12), c.residual < 1e-12
    (True, True)
    """
    if not isinstance(guess, Curve) or guess.size != 3 or guess.domain[0] != 0:
        raise ValueError(f"guess: a Curve on SO(3) that starts at t = 0 is wanted, got {guess!r}")
    unit = guess.retimed(1.0)
    (R0, R1), (w0, w1) = unit([0, 1]), unit([0, 1], 1)
    if not np.isfinite([w0, w1]).all():
        raise ValueError("guess: a curve is NaN, since it did not converge")
    task = ball(Ends(R0, R1, w0, w1))
    R = np.moveaxis(unit(grid(LIMITS.nodes).t).reshape(LIMITS.nodes, -1, 3, 3), 0, 1)
    with np.errstate(over="ignore", invalid="ignore"):
        found = relax(task.equations, R)
        functional, ends = task.equations.functional, task.equations.ends
        return optimum_of(functional, ends, found, guess.duration, Body.ball())


def _solved(task: Task, given: Given) -> Optimum:
    solutions = cheapest(task)
    if not given.duration.ndim and isinstance(solutions[0], Failure):
        raise ConvergenceError(*solutions[0], _reason(task))
    equations, T = task.equations, given.duration
    rotation = optimum_of(equations.functional, equations.ends, solutions, T, given.body)
    lost = np.isnan(rotation.cost)
    _warn(rotation, lost, "did not converge", "their curves are NaN (see converged)")
    beaten = ~np.asarray(rotation.converged) & ~lost
    why = "a curve that was tried costs less (see converged)"
    _warn(rotation, beaten, "may not have reached the optimum", why)
    thin = np.zeros_like(lost)
    if isinstance(equations.functional, Effort):
        thin = is_thin(equations.functional).reshape(T.shape) & ~lost & ~beaten
    if thin.any():
        unclear = thin & ~np.asarray(rotation.certified)
        why = f"the curve of a rod with a ratio of moments above {LIMITS.thin:g} is not certified"
        _warn(rotation, unclear, "may not have reached the optimum", why)
    if not given.path:
        return rotation
    path = np.stack(given.path, axis=-2)
    return OptimalMotion(duration=T, body=given.body, rotation=rotation, path=path)


def _reason(task: Task) -> str:
    """Return the possible causes of a failure."""
    largest = np.abs(task.equations.ends[:, :2]).max()
    if not isinstance(task.equations.functional, Effort):
        return "the end velocities may be too large"
    large = "the end velocities may be too large, or " * bool(largest > LIMITS.fast[0] / 2)
    return f"{large}the principal moments may be too different"


def _warn(curve: OptimalRotation, some: Array, what: str, why: str) -> None:
    places = np.argwhere(some)
    if len(places):
        first = [int(i) for i in places[0]]
        some_of = f"{len(places)} of {curve.count} problems"
        which = f"{some_of} {what}, the first of them {first}" if first else f"the problem {what}"
        warnings.warn(
            f"{which}: {why}",
            RuntimeWarning,
            stacklevel=4,
        )
