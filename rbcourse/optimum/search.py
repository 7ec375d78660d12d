"""The search for the cheapest curve: Newton's method from many starting curves (starts)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rbcourse._numerics import EPS, Array
from rbcourse.bezier import corrected_bezier_so3
from rbcourse.curves import Ends
from rbcourse.optimum.chebyshev import grid
from rbcourse.optimum.collocation import (
    BallStationary,
    Equations,
    Failure,
    Solution,
    Stationary,
    cayley,
    on_nodes,
    rates_at_nodes,
    relax,
    relax_ball,
)
from rbcourse.optimum.functionals import BallAcceleration, Effort, Functional, Jerk
from rbcourse.optimum.guesses import (
    SAME,
    between_free_motions,
    cost_at_nodes,
    leading_sign,
    lowered,
    starts,
    with_ends,
    with_full_turns,
)
from rbcourse.projection import nearest
from rbcourse.so3 import log

Numbers: TypeAlias = NDArray[np.intp]
NOTHING = Failure(np.inf, 0)


@dataclass(frozen=True)
class Limits:
    """The parameters of the search. Ratios are costs divided by the lowest cost; angles are in rad.

    A pair (steps, share) limits the Gauss–Newton steps: at most `steps` steps are made, and they
    end when one of them lowers the cost by less than the fraction `share`.
    """

    nodes: int = 17  # nodes of starting curves, and of the linear systems of a ball
    nodes_for_turns: int = 25  # nodes for bodies if full turns are added
    nodes_for_jerk: int = 29  # the jerk needs more, since it has higher derivatives
    nodes_for_all_starts: int = 33  # nodes if a start costs less than all solutions
    nodes_for_very_fast: int = 65
    followed: float = 1.1  # Newton's method starts from curves up to this cost ratio
    same_entries: float = 0.1  # starts count as equal if all entries of R differ by less than this
    fast: float = 24.0  # if ‖w0‖ + ‖w1‖ is larger, all starts are tried
    very_fast: float = 80.0  # if ‖w0‖ + ‖w1‖ is larger, `nodes_for_very_fast` is used
    known_cost: float = 1.01  # largest accepted ratio of a solution's cost to a start's cost
    one_start: float = 0.5  # if all entries of σ, w0 and w1 are smaller, one start suffices
    flat: float = 0.1  # if w deviates from its axis by less than this share, bent curves are tried
    bend: float = 0.5  # rad: size of the bend
    turned: float = 3.0  # full turns are added to curves up to this cost ratio
    turned_again: float = 1.2  # second full turns are added to curves up to this cost ratio
    worth_a_turn: float = 0.3  # no turn is added if the cost is below this share of a turn's cost
    promising_turn: float = 1.5  # after `new_turns`, curves above this cost ratio are dropped
    starts: tuple[int, float] = (40, 5e-4)
    new_turns: tuple[int, float] = (3, 5e-4)
    on_more_nodes: tuple[int, float] = (40, 1e-4)
    bent: tuple[int, float] = (40, 1e-6)  # steps for bent curves, which may be near a saddle
    last: tuple[int, float] = (200, 0.0)  # used if the other pairs do not suffice


LIMITS = Limits()


class Task(NamedTuple):
    """A stack of problems with one batch axis, and the functions that solve them.

    If the functional is an `Effort`, the search also adds full turns to the starts, and bends
    solutions that turn about one axis, because such solutions may be saddles.
    """

    batch: tuple[int, ...]  # the shape of the stack
    functional: Functional
    equations: Equations
    # a call with problem indices and n returns the problem of each start, and the starts at n nodes
    starts: Callable[[Numbers, int], tuple[Numbers, Array]]
    solver: Callable[[Any, Array], list[Solution | Failure]] = relax
    nodes: int = LIMITS.nodes  # of starting curves
    known: Mapping[int, Solution] = MappingProxyType({})  # solutions that are already known


def ball(given: Ends) -> Task:
    """Return the problems of minimum acceleration for a ball."""
    ends, rates = _flat(given, given.w0, given.w1)
    equations = BallStationary(ends.R0, ends.R1, rates)
    return Task(
        given.w0.shape[:-1],
        BallAcceleration(),
        equations,
        lambda index, n: starts(ends.take(index), n),
        relax_ball,
        known=_of_slow_ends(ends, equations),
    )


def _of_slow_ends(ends: Ends, equations: BallStationary) -> dict[int, Solution]:
    """Solve problems with small σ, w0 and w1 from one start; return solutions by problem index.

    If the entries of σ, w0 and w1 are below ½, their norms are below 1. With e = σ − (w0 + w1)/2
    and d = w1 − w0, the optimum then costs about ∫ ‖w'‖² = 12 ‖e‖² + ‖d‖² < 52. A curve that turns
    the long way between such ends has a length of at least 2π − 1 and costs at least
    12 (2π − 2)² > 200. No second stationary curve that turns the short way was found, but a proof
    is missing.
    """
    largest = np.abs([log(ends.turn), ends.w0, ends.w1]).max(axis=(0, 2))
    slow = np.flatnonzero(largest < LIMITS.one_start)
    if not len(slow):
        return {}
    curves = corrected_bezier_so3(*ends.take(slow))
    R = np.ascontiguousarray(curves(grid(LIMITS.nodes).t).swapaxes(0, 1))
    found = relax_ball(equations.take(slow), R)
    each = zip(slow.tolist(), found, strict=True)
    return {i: one for i, one in each if isinstance(one, Solution)}


def body(given: Ends, G: Array, *, of_torque: bool) -> Task:
    """Return the problems of minimum acceleration, or of minimum torque, for bodies of inertia G.

    The starting curves include the optimum of a ball and curves between free motions. If G is a
    multiple of I, the optimum of the ball is the solution.
    """
    ends, rates = _flat(given, given.w0, given.w1)
    functional = Effort(G.reshape(-1, 3, 3), of_torque=of_torque)
    of_ball = dict(enumerate(cheapest(ball(given))))
    curves = {i: one for i, one in of_ball.items() if isinstance(one, Solution)}
    round_ones = np.abs(functional.G - np.eye(3)).max(axis=(1, 2)) < 8 * EPS

    def start(index: Numbers, n: int) -> tuple[Numbers, Array]:
        problem, R = starts(ends.take(index), n)
        number, free = between_free_motions(ends.take(index), functional.G[index], n)
        more = [k for k, i in enumerate(index) if i in curves]
        of_balls = [on_nodes(curves[index[k]].R[None], n) for k in more]
        return np.concatenate([problem, number, np.array(more, int)]), np.concatenate(
            [R, free, *of_balls]
        )

    return Task(
        given.w0.shape[:-1],
        functional,
        Stationary(functional, ends.R0, ends.R1, rates),
        start,
        known={i: one for i, one in curves.items() if round_ones[i]},
    )


def jerk(given: Ends, a0: Array, a1: Array) -> Task:
    """Return the problems of minimum jerk."""
    ends, rates = _flat(given, given.w0, given.w1, a0, a1)
    # among turns about one axis, the turn by (w0 + w1)/2 + (a0 − a1)/12 costs least
    bend = np.linalg.norm(rates[:, 2:], axis=-1).sum(axis=-1) / 6

    def start(index: Numbers, n: int) -> tuple[Numbers, Array]:
        problem, R = starts(ends.take(index), n, bend[index])
        return problem, with_ends(R, rates[index][problem])

    equations = Stationary(Jerk(), ends.R0, ends.R1, rates)
    return Task(given.w0.shape[:-1], Jerk(), equations, start, nodes=LIMITS.nodes_for_jerk)


def _flat(given: Ends, *rates: Array) -> tuple[Ends, Array]:
    """Return the ends with one batch axis and exact rotations, and the end values (N, m, 3)."""
    ends = given.flat()
    R0, R1 = (nearest(R)[0] for R in ends[:2])  # Newton's method fails if R has few correct digits
    return ends._replace(R0=R0, R1=R1), np.stack([x.reshape(-1, 3) for x in rates], axis=1)


def cheapest(task: Task) -> list[Solution | Failure]:
    """Return the cheapest solution that is found for each problem.

    Gauss–Newton steps lower the costs of the starts, and Newton's method continues from the
    cheapest ones. All starts are tried if no solution is found, or if a start, before or after
    these steps, costs less than the solution. If this fails, more steps are made.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        return _searched(task)


def _searched(task: Task) -> list[Solution | Failure]:
    ends = task.equations.ends
    found: list[Solution | Failure] = [task.known.get(i, NOTHING) for i in range(len(ends))]
    index = np.flatnonzero([one is NOTHING for one in found])
    if not len(index):
        return found
    share = np.array([1, 1, 1 / 6, 1 / 6])[: ends.shape[1]]  # weights of w and w' in a quintic
    fast = np.linalg.norm(ends, axis=-1) @ share
    problem, R = _started(task, index, task.nodes)
    R, cost = lowered(task.functional.take(problem), R, *LIMITS.starts)
    if isinstance(task.functional, Effort):
        problem, R, cost = _with_more_turns(task, task.functional, problem, R, cost)
    least = partial(_least, len(ends), problem)
    likely = ~(cost > LIMITS.followed * least(cost)[problem]) & ~_repeated(problem, cost, R)
    _follow(task, problem[likely], R[likely], found)
    costly = _costs(found) > LIMITS.known_cost * least(cost)
    again = np.unique(problem[(costly | (fast > LIMITS.fast))[problem]])
    for n, some in (
        (LIMITS.nodes_for_all_starts, fast <= LIMITS.very_fast),
        (LIMITS.nodes_for_very_fast, ~(fast <= LIMITS.very_fast)),
    ):
        if some[again].any():
            _follow_on(task, again[some[again]], problem, R, n, found)
    if isinstance(task.functional, Effort):
        _leave_the_axis(task, task.functional, index, found)
    return found


def _with_more_turns(
    task: Task, effort: Effort, problem: Numbers, R: Array, cost: Array
) -> tuple[Numbers, Array, Array]:
    """Lower the costs of the cheapest curves, also with added full turns, on more nodes.

    The cheapest motion may turn once or twice more about the axis of a small moment. From rest to
    rest, a full turn costs at least 12 (2π)² λ, where λ is the least eigenvalue of G M G. No turn
    is added if the cheapest curve costs less than `worth_a_turn` times this cost.
    """
    ends, count = task.equations.ends, len(task.equations.ends)
    full_turn = 12 * (2 * np.pi) ** 2 * np.linalg.eigvalsh(effort.G @ effort.M @ effort.G)[:, 0]
    least = _least(count, problem, cost)
    if not (least > LIMITS.worth_a_turn * full_turn)[problem].any():
        return problem, R, cost
    some = ~(cost > LIMITS.turned * least[problem]) & ~_repeated(problem, cost, R)
    problem, R = problem[some], on_nodes(R[some], LIMITS.nodes_for_turns)
    R, cost = lowered(effort.take(problem), with_ends(R, ends[problem]), *LIMITS.on_more_nodes)
    turned = 0
    for apart in LIMITS.turned, LIMITS.turned_again:
        least = _least(count, problem, cost)
        some = ~(cost > apart * least[problem]) & ~_repeated(problem, cost, R)
        some &= (least > LIMITS.worth_a_turn * full_turn)[problem]
        some[:turned] = False
        if not some.any():
            break
        turned = len(some)
        number = np.tile(problem[some], 6)
        more = with_full_turns(R[some], ends[problem[some]], effort.G[problem[some]])
        more, briefly = lowered(effort.take(number), more, *LIMITS.new_turns)
        some = ~(briefly > LIMITS.promising_turn * least[number])
        some &= ~_repeated(number, briefly, more)
        number = number[some]
        more, cost_of_more = lowered(effort.take(number), more[some], *LIMITS.on_more_nodes)
        problem, R = np.append(problem, number), np.concatenate([R, more])
        cost = np.append(cost, cost_of_more)
    return problem, R, cost


def _leave_the_axis(
    task: Task, effort: Effort, index: Numbers, found: list[Solution | Failure]
) -> None:
    """Bend solutions whose axis is almost constant; start Newton's method from cheaper bent curves.

    Such a solution may be a saddle. If all starts turn about one axis, no step leaves the axis,
    even if a curve that leaves it costs less.
    """
    order, t = task.functional.ends // 2 + 1, grid(task.nodes).t
    problem, bent = [], [np.empty((0, task.nodes, 3, 3))]
    for i in index:
        one = found[i]
        if isinstance(one, Solution):
            w = rates_at_nodes(task.equations.ends[i][None], one.k[None])[0][0]
            size = np.linalg.svd(w, compute_uv=False)
            if size[0] > 0 and size[1] < LIMITS.flat * size[0]:
                sides = LIMITS.bend * _across(w / size[0], effort.G[i])[:, None]
                turn = (4 * t * (1 - t))[:, None] ** order * sides
                bent.append(on_nodes(one.R[None], task.nodes) @ cayley(turn))
                problem += [i] * len(sides)
    number = np.array(problem, int)
    R, cost = lowered(task.functional.take(number), np.concatenate(bent), *LIMITS.bent)
    cheaper = cost < (1 - SAME) * _costs(found)[number]
    _follow(task, number[cheaper], R[cheaper], found)


def _across(w: Array, G: Array) -> Array:
    """Return four directions perpendicular to the approximate axis of w, shape (4, 3).

    They are the directions in which w deviates from its axis. If w does not deviate, the inertia
    determines the directions. If the moments are equal, the order of the axes determines the
    directions.
    """
    leans = np.concatenate([w, 1e-6 * (G + 1e-3 * np.diag([3, 2, 1]))])
    axes = np.linalg.svd(leans, full_matrices=False)[2][1:]
    axes *= leading_sign(axes)
    return np.concatenate([axes, -axes])


def _follow_on(
    task: Task,
    index: Numbers,
    problem: Numbers,
    R: Array,
    n: int,
    found: list[Solution | Failure],
) -> None:
    """Solve some problems from more starts, on n nodes, where the costs are more accurate."""
    mine = np.isin(problem, index)
    problem, R = problem[mine], with_ends(on_nodes(R[mine], n), task.equations.ends[problem[mine]])
    more, as_they_are = _started(task, index, n)
    problem, R = np.concatenate([problem, more]), np.concatenate([R, as_they_are])
    functional = task.functional.take(problem)
    bound = LIMITS.known_cost * _least(len(found), problem, cost_at_nodes(functional, R))
    some = (_costs(found) > bound)[problem]
    some[-len(more) :] = True
    _follow(task, problem[some], R[some], found)
    costly = (_costs(found) > bound)[problem]
    if costly.any():
        R, _ = lowered(functional.take(costly), R[costly], *LIMITS.last)
        _follow(task, problem[costly], R, found)
        for i in np.flatnonzero(_costs(found) > bound):
            if isinstance(one := found[i], Solution):
                found[i] = one._replace(beaten=True)


def _costs(found: list[Solution | Failure]) -> Array:
    return np.array([one.cost for one in found])


def _least(count: int, problem: Numbers, cost: Array) -> Array:
    """Return the cost of the cheapest start of each problem."""
    least = np.full(count, np.inf)
    np.fmin.at(least, problem, cost)
    return least


def _repeated(problem: Numbers, cost: Array, R: Array) -> NDArray[np.bool_]:
    """Tell which starts are close, at all nodes, to a cheaper start of the same problem."""
    order, repeated = np.lexsort((cost, problem)), np.zeros(len(problem), bool)
    number, R = problem[order], R[order]
    for after in range(1, np.bincount(problem, minlength=1).max()):
        near = np.abs(R[after:] - R[:-after]).max(axis=(1, 2, 3)) < LIMITS.same_entries
        repeated[order[after:]] |= near & (number[after:] == number[:-after])
    return repeated


def _started(task: Task, index: Numbers, n: int) -> tuple[Numbers, Array]:
    problem, R = task.starts(index, n)
    return index[problem], R


def _follow(task: Task, problem: Numbers, R: Array, found: list[Solution | Failure]) -> None:
    """Solve the problems from these curves; cheaper solutions replace those in `found`.

    If two solutions have the same cost, the first one is kept, so that rounding does not choose.
    """
    for i, one in zip(problem, task.solver(task.equations.take(problem), R), strict=True):
        if found[i] is NOTHING or one.cost < (1 - SAME) * found[i].cost:
            found[i] = one
