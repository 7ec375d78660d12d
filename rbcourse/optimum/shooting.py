"""The optimum by shooting: a search for initial values from which the motion reaches its end.

`rbcourse.optimum.minimum_acceleration_so3` is faster and more robust.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._numerics import Array
from rbcourse.curves import Ends
from rbcourse.optimum import Optimum, solve
from rbcourse.optimum.chebyshev import grid
from rbcourse.optimum.collocation import (
    BallStationary,
    Failure,
    Solution,
    in_body,
    rates_at_nodes,
)
from rbcourse.optimum.search import ball
from rbcourse.so3 import hat_so3, log

NODES = 96
STEPS = 20
LONGEST_STEP = 0.5


def shoot_minimum_acceleration_so3(
    R0: ArrayLike, R1: ArrayLike, w0: ArrayLike, w1: ArrayLike, *, duration: ArrayLike = 1.0
) -> Optimum:
    """Return the minimum-acceleration curve with these ends, by shooting.

    Equation (20), w'' + w × w' = b, is integrated from t = 0. Newton's method improves the unknown
    w'(0) and b until R(1) and w(1) are correct.
    Source: BK (20), BK 6.2.

    Parameters
    ----------
    R0, R1, w0, w1, duration
        As for `projected_cubic_so3`.

    Returns
    -------
    Optimum
        The optimum. Errors, warnings and singular set are those of `minimum_acceleration_so3`. If
        both functions find the same solution of (19), their curves agree to about 1e-11.

    Notes
    -----
    The method rarely fails for ‖w0‖, ‖w1‖ < 12. A failure takes seconds if ‖w‖ = 30, and minutes if
    ‖w‖ = 1000.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> c = shoot_minimum_acceleration_so3(np.eye(3), exp_so3([0, 0, 1.5]), [0, 0, 0], [0, 0, 0])
    >>> c(0.5, 1).round(9) + 0.0  # 1.5 times the average, as for any cubic from rest to rest
    array([0.  , 0.  , 2.25])
    """
    given, T = Ends(R0, R1, w0, w1).over(duration)
    return solve(ball(given)._replace(solver=shoot), T)


def shoot(equations: BallStationary, R: Array) -> list[Solution | Failure]:
    """Solve the problems of a stack, one by one."""
    parts = [slice(i, i + 1) for i in range(len(R))]
    return [_shoot(equations.take(one), R[one]) for one in parts]


def _shoot(equations: BallStationary, start: Array) -> Solution | Failure:
    """Improve the aim (w'(0), b) by Newton steps that move the end by at most 0.5."""
    try:
        aim = _first_aim(equations, start)
        for iteration in range(STEPS):
            miss, by_aim = _miss(equations, aim)
            size = float(np.abs(miss).max())
            if size < 1e-11:
                return _solution(equations, aim, iteration)
            aim = aim - np.linalg.solve(by_aim, miss) * min(1.0, LONGEST_STEP / size)
    except (FloatingPointError, np.linalg.LinAlgError, ValueError):
        return Failure(np.inf, 0)
    return Failure(size, STEPS)


def _solution(equations: BallStationary, aim: Array, iterations: int) -> Solution | Failure:
    """Return the curve that reaches its end, or a failure if the curve violates the equations."""
    R, w, _ = _shot(equations, aim, grid(NODES).t)
    c = equations.R0[0] @ (aim[3:] - np.cross(w[0], aim[:3]))
    residual = float(equations.errors((R[None], c[None]))[0][0])
    if not residual < 1e-10:
        return Failure(residual, iterations)
    k, c, cost = equations.solution((R[None], c[None]))
    return Solution(R, k[0], c[0], float(cost[0]), residual, iterations)


def _first_aim(equations: BallStationary, start: Array) -> Array:
    """Return w'(0) and b = w''(0) + w(0) × w'(0) of the curve that `relax` would start with."""
    (c,), w0 = equations.first(start), equations.ends[0, 0]
    _, [acceleration, *_], [bend, *_] = (
        x[0] for x in rates_at_nodes(equations.ends, in_body(start, c))
    )
    return np.concatenate([acceleration, bend + np.cross(w0, acceleration)])


def _miss(equations: BallStationary, aim: Array) -> tuple[Array, Array]:
    """Return the errors of R(1) and w(1), and their derivatives with respect to the aim.

    The derivatives are accurate near the goal, where R(1) is close to R1.
    """
    R, w, sensitivity = (values[-1] for values in _shot(equations, aim, np.ones(1)))
    turn = log(equations.R1[0].T @ R)
    return np.concatenate([turn, w - equations.ends[0, 1]]), sensitivity[:6]


def _shot(equations: BallStationary, aim: Array, t: Array) -> tuple[Array, Array, Array]:
    """Return R, w and the derivatives of (turn, w, w') with respect to the aim, at the times t."""
    from scipy.integrate import solve_ivp

    sensitivity = np.eye(9, 6, -6)
    R0, w0 = equations.R0.ravel(), equations.ends[0, 0]
    start = np.concatenate([R0, w0, aim[:3], sensitivity.ravel()])
    shot = solve_ivp(
        _flow, (0, 1), start, "DOP853", t_eval=t, args=(aim[3:],), rtol=1e-12, atol=1e-13
    )
    if not shot.success:
        raise FloatingPointError(shot.message)
    return shot.y[:9].T.reshape(-1, 3, 3), shot.y[9:12].T, shot.y[15:].T.reshape(-1, 9, 6)


def _flow(_: float, state: Array, b: Array) -> Array:
    """Return the rates of R, w and w', and of their derivatives with respect to the aim."""
    R, w, acceleration = state[:9].reshape(3, 3), state[9:12], state[12:15]
    turn, dw, da = state[15:].reshape(3, 3, 6)
    W = hat_so3(w)  # if the motion overflows, a ValueError ends the attempt
    dda = np.eye(3, 6, 3) + hat_so3(acceleration) @ dw - W @ da
    rates = R @ W, acceleration, b - W @ acceleration, dw - W @ turn, da, dda
    return np.concatenate([rate.ravel() for rate in rates])
