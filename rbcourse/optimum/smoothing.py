"""The curve of least acceleration near noisy rotations or poses.

The rotations R(t) have the least Σ wᵢ (3 − tr RᵢᵀR(tᵢ)) + λ ∫ ‖w'‖² dt; the first terms are half of
the squared distances. Vary R to exp(ε̂) R. On each leg R w'' = c, and the integral changes by
2 [w' · δw − c · ε] at its ends. With A = R Dᵀ, where D is the weighted sum of the measurements at
one time, their term changes by vee(A − Aᵀ) · ε. So w' is continuous, and 0 at natural ends, and

    2 λ (cᵢ − cᵢ₋₁) = −vee(A − Aᵀ),    with c = 0 before the first time and after the last one.

A Newton step linearises all legs together, as in `_spline`, but the values at a knot are ε and w. A
turn of both ends of a leg by the same ε turns the leg and c. So each leg needs its responses to w
at both ends and to a turn ε of its end alone; they are a symmetric matrix of 12 rows. The second
derivative of the term of a knot is tr A I − ½ (A + Aᵀ).

The first curve is the closed form with a period in which the body does not turn far. From it, the
period grows in steps up to the wanted one, or as long as it improves the score.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, Literal, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._docs import described_by
from rbcourse._numerics import Array, solve
from rbcourse._polynomials import grid
from rbcourse.body import Body
from rbcourse.curves._doubts import warn_of_doubts
from rbcourse.curves.functionals import BallAcceleration
from rbcourse.curves.smoothing import (
    LEAST,
    MOST,
    STEP,
    SmoothedChain,
    Smoother,
    checked_problem,
    closed_form,
    smoothing_spline,
    with_origins,
)
from rbcourse.curves.velocities import Conditions, KnotSystem
from rbcourse.optimum._collocation import (
    EXACT,
    LONGEST_STEP,
    NODES,
    BallStationary,
    Change,
    Errors,
    Unknowns,
    turned_rate,
)
from rbcourse.optimum._result import ConvergenceError, OptimalChain, OptimalMotion, optimum_of
from rbcourse.optimum._spline import (
    SHIFTS,
    SHORT,
    Legs,
    combined,
    end_momenta,
    knot_system,
    minimum,
    responses_of,
)
from rbcourse.so3 import angle_between, hat, vee

STEPS = 30  # of Newton's method for one smoothing; then it has failed
SAFE = 0.5  # rad: a closed form is a good start if the body turns less in the time period/2π
CLEAR = 1e-12  # of the diagonal, which grows with the fourth power of the period; rounding is less
LAST = 1e-8  # rad: a longer step is not the last one; by rounding, steps are shorter than 1e-9
TOO_FAR = "the body may turn too far in the time period/2π, or between two measurements"
BEYOND = 2  # steps without a better score after which the search ends


@described_by(smoothing_spline)
def minimum_acceleration_smoothing(
    times: ArrayLike,
    poses: ArrayLike,
    ends: Literal["natural", "rest"] = "natural",
    *,
    noise: ArrayLike | None = None,
    period: ArrayLike | None = None,
    weights: ArrayLike | None = None,
) -> OptimalSmoothing:
    """Return the curve of least acceleration near noisy rotations or poses.

    The body is the ball of metrics (12) and (14). Warnings are those of `smoothing_spline`, but the
    body may turn far in the time period/2π.
    Source: BK (18); beyond BK 12, beyond BK 17.

    Returns
    -------
    OptimalSmoothing
        An `OptimalChain` of the least Σ wᵢ ‖R(tᵢ) − Rᵢ‖² + λ ∫ 2 ‖w'‖² dt that Newton's method
        finds from `smoothing_spline`, with the attributes ``period`` and ``noise``. Its ``cost`` is
        the `acceleration_cost`. w' is continuous, and 0 at natural ends. For poses, the origin
        moves on a smoothing spline.

    Raises
    ------
    ConvergenceError
        If no minimum is found.

    Notes
    -----
    The chain is ``certified`` if it is proven that all nearby curves have a larger sum. It takes
    about ten times as long as `smoothing_spline`, and is better if the body turns by more than 0.2
    rad in the time period/2π. As the period grows, the curve tends to the best steady turn. If
    the body turns far between two measurements, another minimum may be less. Singular set: that of
    `quaternion_spline`.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> t, rng = np.linspace(0, 1, 50), np.random.default_rng(1)
    >>> measured = exp_so3(t[:, None] ** 2 * [0, 0, 2] + rng.normal(scale=0.02, size=(50, 3)))
    >>> c = minimum_acceleration_smoothing(t, measured)
    >>> c(0.5, 1).round(1) + 0.0, c.certified
    (array([0., 0., 2.]), True)
    """
    A, smoother, noises, periods = checked_problem(times, poses, ends, noise, period, weights)
    c = _rotations(_Problem.of(smoother, A[:, :3, :3], ends), noises[0], periods[0])
    if A.shape[-1] == 4:
        c = with_origins(c, OptimalMotion, smoother, A[:, :3, 3], noises[1], periods[1])
        c = replace(c, cost=c.cost + c.body.mass * float(np.sum(c.legs.moving_cost)))
    warn_of_doubts(smoother, c, A, noise, period, weights)
    return c


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class OptimalSmoothing(OptimalChain):
    """An `OptimalChain` near noisy rotations or poses, with attributes as in `SmoothedChain`."""

    period: Any
    noise: Any

    def _what(self) -> str:
        return f"Optimum of acceleration near poses at {len(self.times)} times"

    def _lasting(self, duration: Array) -> Self:
        share = float(duration / self.duration)
        return replace(super()._lasting(duration), period=self.period * share)


def _rotations(problem: _Problem, noise: float | None, period: float | None) -> OptimalSmoothing:
    smoother, R = problem.smoother, problem.R
    first = R[smoother.first]
    speeds = angle_between(first[:-1], first[1:]) / np.diff(smoother.knots)
    safe = 2 * np.pi * SAFE / max(float(np.median(speeds)), 1e-300)
    start = closed_form(smoother, R, noise, period and min(period, safe))
    if start.period > safe:
        start = closed_form(smoother, R, None, safe)
    log = 4 * np.log(start.period / smoother.period(1.0))
    goal = log if period is None else 4 * np.log(period / smoother.period(1.0))
    state = problem.start(start)
    for step in (*np.arange(log, goal, STEP), goal):
        state, _ = problem.solved(state, step)
    if period is None:
        state, goal = _best(problem, _Tried(problem.score(state, goal, noise), goal, state), noise)
    for more in (*NODES[1:], None):
        state, legs = problem.solved(state, goal, LAST)
        if legs.tail < EXACT or more is None:
            break
        state = state._replace(unknowns=legs.equations.refined(legs.unknowns, more))
    if legs.tail > EXACT:
        raise ConvergenceError(legs.tail, state.steps, TOO_FAR)
    return problem.curve(state, legs, goal)


class _Tried(NamedTuple):
    score: float
    log: float
    state: _State


def _best(problem: _Problem, first: _Tried, noise: float | None) -> tuple[_State, float]:
    """Return the logarithm of the smoothing with the least score, and the curve of a nearby one.

    From a first smoothing, steps go down the slope of the score; then the least is bracketed.
    """
    from scipy.optimize import minimize_scalar

    def tried(log: float, near: _State) -> _Tried:
        try:
            state, _ = problem.solved(near, log)
        except ConvergenceError:
            return _Tried(np.inf, log, near)
        return _Tried(problem.score(state, log, noise), log, state)

    best = first
    for way in (1, -1):
        last, worse = first, 0
        # for steps above the noise, the score of short periods has other minima
        while last.score < np.inf and (worse < BEYOND or way > 0 > last.log):
            if not LEAST <= last.log + way * STEP <= MOST:
                break
            last = tried(last.log + way * STEP, last.state)
            best, worse = (last, 0) if last.score < best.score else (best, worse + 1)
    found = minimize_scalar(
        lambda log: tried(log, best.state).score,
        bounds=(best.log - STEP, best.log + STEP),
        method="bounded",
        options={"xatol": 0.05},
    )
    return best.state, float(found.x)


class _State(NamedTuple):
    """A curve at the nodes of its legs, and w at its knots; the unit of time is the mean step."""

    unknowns: Unknowns
    w: Array
    steps: int = 0

    @property
    def knots(self) -> Array:
        R = self.unknowns.R
        return np.append(R[:, 0], R[-1:, -1], axis=0)


class _Legs(BallStationary):
    """The equation R w'' = c on legs whose ends may turn."""

    def responses(self, now: Unknowns, errors: Errors, by_ends: bool = False) -> Change:
        """Return also the responses to a turn ε(1) of the end about each axis, in last columns."""
        by_d, by_c = self.effects(now, errors, by_ends=True)
        dc_by_turn = solve(by_c[:, -1], np.broadcast_to(np.eye(3), (len(by_c), 3, 3)))
        dc: Array = np.append(-dc_by_turn @ by_d[:, -1], dc_by_turn, axis=-1)
        turn = by_c @ dc[:, None]
        turn[..., :-3] += by_d
        return Change(turn, turned_rate(now, turn, dc), dc)


class _Problem(NamedTuple):
    """Measured rotations R, their weighted sums D at the knots, and the durations h of the legs."""

    smoother: Smoother
    R: Array
    D: Array  # for weights with the mean sum 1
    h: Array  # with mean 1
    ends: Conditions  # for ε and δw at the knots

    @classmethod
    def of(cls, smoother: Smoother, R: Array, ends: str) -> Self:
        D = np.add.reduceat(smoother.weights[:, None, None] * R, smoother.first)
        fixed = np.zeros((len(D), 6), bool)
        fixed[[0, -1], 3:] = ends == "rest"
        h = np.diff(smoother.knots) / smoother.unit
        conditions = Conditions(fixed, np.zeros(fixed.shape))
        return cls(smoother, R, D / smoother.total.mean(), h, conditions)

    def start(self, curve: SmoothedChain) -> _State:
        R = curve.legs.values(grid(NODES[0]).t[:, None], 0).swapaxes(0, 1)
        w = np.where(self.ends.fixed[:, 3:], 0, self.smoother.unit * curve.velocities)
        return _State(self.equations(R, w).first(R), w)

    def equations(self, R: Array, w: Array) -> _Legs:
        h = self.h[:, None]
        rates = np.stack([h * w[:-1], h * w[1:]], axis=1)
        return _Legs(BallAcceleration(), R[:, 0], R[:, -1], rates, coarse=9)

    def legs(self, state: _State) -> Legs:
        now = state.unknowns
        equations = self.equations(now.R, state.w)
        return Legs(equations, now, equations.errors(now), float(equations.tails(now).max()))

    def misfit(self, state: _State) -> float:
        """Return Σ wᵢ (3 − tr RᵢᵀR)."""
        off = state.knots[self.smoother.which] - self.R
        return self.smoother.sum_of(off.reshape(-1, 9)) / 2

    def score(self, state: _State, log: float, noise: float | None) -> float:
        return self.smoother.score(self.misfit(state), np.exp(log), noise)

    @np.errstate(over="raise", invalid="raise", divide="raise")
    def solved(self, state: _State, log: float, exact: float = SHORT) -> tuple[_State, Legs]:
        """Return the curve for a logarithm of λ, and its legs, by Newton's method.

        Its last step is shorter than `exact`, and the residual at most that of the nodes.
        """
        turned = np.inf
        with suppress(FloatingPointError, np.linalg.LinAlgError):
            for _ in range(STEPS):
                legs = self.legs(state)
                if turned < exact and legs.left < max(EXACT, legs.tail):
                    return state, legs
                responses = responses_of(legs)
                _, change = minimum(self.system(state, legs, responses, np.exp(log)), self.ends)
                state, turned = self.stepped(state, legs, responses, change)
        raise ConvergenceError(turned, state.steps, TOO_FAR)

    def stepped(
        self, state: _State, legs: Legs, responses: Change, change: Array
    ) -> tuple[_State, float]:
        """Return the curve after a step, and the largest turn of a node by the step.

        Each leg turns with its start, and then its end by the rest.
        """
        turn, dw = change[:, :3], change[:, 3:]
        h, start = self.h[:, None], turn[:-1]
        of_legs = combined(responses, np.hstack([h * dw[:-1], h * dw[1:], np.diff(turn, axis=0)]))
        turns = of_legs.turn + start[:, None]
        dc = of_legs.c + np.cross(start, state.unknowns.c)
        turned = float(np.linalg.norm(turns, axis=-1).max())
        share = LONGEST_STEP / max(LONGEST_STEP, turned)
        unknowns = legs.stepped(Change(turns, of_legs.k, dc), share)
        unknowns.R[:-1, -1] = unknowns.R[1:, 0]  # the same up to rounding
        return _State(unknowns, state.w + share * dw, state.steps + 1), turned

    def system(self, state: _State, legs: Legs, responses: Change, smoothing: float) -> KnotSystem:
        """Return the second derivative of half of the sum, and minus its gradient after a step."""
        c, h = state.unknowns.c, self.h
        momenta, changes = end_momenta(BallAcceleration(), legs, responses)
        gradient = _by_ends(momenta, c) + _by_ends(changes, responses.c)[..., 0]
        _, by_w0, by_w1, by_turn = np.split(_by_ends(changes, responses.c), [1, 4, 7], axis=2)
        H = np.concatenate([-by_turn, by_w0, by_turn, by_w1], axis=2)
        H[:, :, :3] += _by_ends(np.zeros((len(h), 2, 3, 3)), -hat(c))  # both ends turn by ε
        scale = np.tile(np.repeat(h[:, None] ** [0, 1], 3, axis=1), 2)
        factor = (smoothing / h**3)[:, None] * scale
        H *= factor[..., None] * scale[:, None]
        b = -factor * gradient
        A = state.knots @ self.D.mT
        pull = np.trace(A, axis1=1, axis2=2)[:, None, None] * np.eye(3) - A
        H[:, :3, :3] += pull[:-1]
        H[-1, 6:9, 6:9] += pull[-1]
        b[:, :3] -= vee(A - A.mT)[:-1]
        b[-1, 6:9] -= vee(A - A.mT)[-1]
        return knot_system((H + H.mT) / 2, b)

    def curve(self, state: _State, legs: Legs, log: float) -> OptimalSmoothing:
        smoother, smoothing = self.smoother, float(np.exp(log))
        found = smoother.found(self.misfit(state), smoothing)
        steps = np.diff(smoother.knots)
        ends, solutions = legs.equations.ends, legs.solutions(state.steps)
        optima = optimum_of(BallAcceleration(), ends, solutions, steps, Body.ball())
        system = self.system(state, legs, responses_of(legs), smoothing)
        shift, _ = minimum(system, self.ends, (-CLEAR, *SHIFTS))
        return OptimalSmoothing(
            duration=np.array(steps.sum()),
            body=Body.ball(),
            times=smoother.knots,
            legs=optima,
            velocities=state.w / smoother.unit,
            cost=float(np.sum(optima.cost)),
            definite=shift < 0,
            residual=legs.left,
            iterations=state.steps,
            period=found.period,
            noise=found.noise,
        )


def _by_ends(momenta: Array, c: Array) -> Array:
    """Return the derivatives of ∫ ‖w'‖² dt by ε and w at the start, and by those at the end.

    The momenta are 2 w' at both ends.
    """
    start, end = momenta[:, 0], momenta[:, 1]
    return np.concatenate([2 * c, -start, -2 * c, end], axis=1)
