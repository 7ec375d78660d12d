"""The search for the cheapest curve: Newton's method from many starting curves (starts)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rbcourse._chebyshev import grid
from rbcourse._numerics import EPS, Array
from rbcourse.curves.bezier import corrected_bezier
from rbcourse.curves.ends import Ends
from rbcourse.curves.functionals import BallAcceleration, Effort, Functional, Jerk
from rbcourse.optimum._collocation import (
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
from rbcourse.optimum._guesses import (
    SAME,
    between_free_motions,
    leading_sign,
    lowered,
    spun,
    starts,
    with_ends,
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
    nodes_for_rods: int = 25  # with 17 nodes, 2 more of 100 rods miss their optima
    rod: float = 3.0  # a body whose moments have a larger ratio is a rod
    nodes_for_spin: int = 8  # the number of nodes that are added if spin is added
    nodes_for_jerk: int = 29  # the jerk needs more, since it has higher derivatives
    more_nodes: tuple[int, int] = (33, 65)  # for fast problems, and if a start costs less
    fast: tuple[float, float] = (24.0, 80.0)  # if ‖w0‖ + ‖w1‖ is larger, `more_nodes` are used
    followed: float = 1.1  # Newton's method starts from curves up to this cost ratio
    followed_of_bodies: float = 1.02  # the same for bodies; their curves have more nodes
    same_entries: float = 0.1  # starts count as equal if all entries of R differ by less than this
    known_cost: float = 1.01  # largest accepted ratio of a solution's cost to a start's cost
    one_start: float = 0.5  # if all entries of σ, w0 and w1 are smaller, one start suffices
    flat: float = 0.1  # if w deviates from its axis by less than this share, bent curves are tried
    bend: float = 0.5  # rad: size of the bend
    refined: float = 3.0  # curves up to this cost ratio are lowered on more nodes
    spun: tuple[float, ...] = (3.0, 1.15)  # spin is added twice, to curves up to these cost ratios
    worth_a_turn: float = 0.3  # no spin is added if the cost is below this share of a turn's cost
    promising: float = 1.3  # curves above this cost ratio are dropped before more steps
    starts: tuple[int, float] = (40, 5e-4)
    brief: tuple[int, float] = (4, 5e-4)  # steps for new curves, before most are dropped
    starts_of_bodies: tuple[int, float] = (20, 2e-3)
    on_more_nodes: tuple[int, float] = (60, 1e-4)
    bent: tuple[int, float] = (40, 1e-6)  # steps for bent curves, which may be near a saddle
    last: tuple[int, float] = (200, 0.0)  # used if the other pairs do not suffice


LIMITS = Limits()


class Task(NamedTuple):
    """A stack of problems with one batch axis, and the functions that solve them.

    If the functional is an `Effort`, the search also adds spin to the starts, and bends
    solutions that turn about one axis, because such solutions may be saddles.
    """

    batch: tuple[int, ...]  # the shape of the stack
    functional: Functional
    equations: Equations
    # a call with problem indices and n returns the problem of each start, and the starts at n nodes
    starts: Callable[[Numbers, int], tuple[Numbers, Array]]
    solver: Callable[[Any, Array], list[Solution | Failure]] = relax
    nodes: Any = LIMITS.nodes  # of starting curves, for all problems or for each one
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
    curves = corrected_bezier(*ends.take(slow))
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
    moments = np.linalg.eigvalsh(functional.G)
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
        nodes=np.where(
            moments[:, 2] > LIMITS.rod * moments[:, 0], LIMITS.nodes_for_rods, LIMITS.nodes
        ),
        known={i: one for i, one in curves.items() if round_ones[i]},
    )


def jerk(given: Ends, a0: Array, a1: Array) -> Task:
    """Return the problems of minimum jerk."""
    ends, rates = _flat(given, given.w0, given.w1, a0, a1)

    def start(index: Numbers, n: int) -> tuple[Numbers, Array]:
        return starts(ends.take(index), n, *rates[index, 2:].swapaxes(0, 1))

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
    cheapest ones. Where no solution is found, or where a start costs less than the solution, the
    search is repeated on more nodes. If this fails, more steps are made.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        return _searched(task)


def _searched(task: Task) -> list[Solution | Failure]:
    ends = task.equations.ends
    found: list[Solution | Failure] = [task.known.get(i, NOTHING) for i in range(len(ends))]
    index = np.flatnonzero([one is NOTHING for one in found])
    share = np.array([1, 1, 1 / 6, 1 / 6])[: ends.shape[1]]  # weights of w and w' in a quintic
    speed = np.linalg.norm(ends, axis=-1) @ share
    fast, very_fast = LIMITS.fast
    nodes = np.select(
        [~(speed <= very_fast), ~(speed <= fast)], LIMITS.more_nodes[::-1], task.nodes
    )
    for n in np.unique(nodes[index]).tolist():
        some = index[nodes[index] == n]
        _search(task, some, n, (some[:0], np.empty((0, n, 3, 3))), found)
    if isinstance(task.functional, Effort):
        _leave_the_axis(task, task.functional, index, found)
    return found


def _search(
    task: Task,
    index: Numbers,
    n: int,
    known: tuple[Numbers, Array],
    found: list[Solution | Failure],
) -> None:
    """Search with n nodes, also from the `known` curves; then with more nodes, where this fails."""
    problem, R, cost = _lowered_starts(task, index, n, *known)
    of_bodies = isinstance(task.functional, Effort)
    ratio = LIMITS.followed_of_bodies if of_bodies else LIMITS.followed
    likely = _promising(ratio, len(found), problem, R, cost)
    _follow(task, problem[likely], R[likely], found)
    bound = LIMITS.known_cost * _least(len(found), problem, cost)
    costly = index[_costs(found)[index] > bound[index]]
    if not len(costly):
        return
    for more in LIMITS.more_nodes:
        if more > n:
            return _search(task, costly, more, (problem, R), found)
    some = np.isin(problem, costly)
    R, _ = lowered(task.functional.take(problem[some]), R[some], *LIMITS.last)
    _follow(task, problem[some], R, found)
    for i in costly[_costs(found)[costly] > bound[costly]]:
        if isinstance(one := found[i], Solution):
            found[i] = one._replace(beaten=True)


def _lowered_starts(
    task: Task, index: Numbers, n: int, problem: Numbers, R: Array
) -> tuple[Numbers, Array, Array]:
    """Return curves of low cost for some problems, and their costs; n is the number of nodes.

    The curves come from the starts at n nodes and from the curves R of an earlier search.
    """
    more, starting = task.starts(index, n)
    again = np.isin(problem, index)
    problem = np.append(index[more], problem[again])
    R = np.concatenate([starting, on_nodes(R[again], n)])
    R = with_ends(R, task.equations.ends[problem])
    steps = LIMITS.starts_of_bodies if isinstance(task.functional, Effort) else LIMITS.starts
    R, cost = lowered(task.functional.take(problem), R, *steps)
    if isinstance(task.functional, Effort):
        return _with_more_spin(task, task.functional, problem, R, cost)
    return problem, R, cost


def _with_more_spin(
    task: Task, effort: Effort, problem: Numbers, R: Array, cost: Array
) -> tuple[Numbers, Array, Array]:
    """Lower the costs of the cheapest curves, also with more spin, on more nodes.

    The optima of rods differ mainly in the angle about the axis of the least moment. From rest to
    rest, a full turn costs at least 12 (2π)² λ, where λ is the least eigenvalue of G M G. No spin
    is added if the cheapest curve costs less than `worth_a_turn` times this cost.
    """
    ends, count = task.equations.ends, len(task.equations.ends)
    full_turn = 12 * (2 * np.pi) ** 2 * np.linalg.eigvalsh(effort.G @ effort.M @ effort.G)
    worth = _least(count, problem, cost)[:, None] > LIMITS.worth_a_turn * full_turn
    if not worth[problem].any():
        return problem, R, cost
    some = _promising(LIMITS.refined, count, problem, R, cost)
    problem, R = problem[some], on_nodes(R[some], R.shape[1] + LIMITS.nodes_for_spin)
    R, cost = lowered(effort.take(problem), with_ends(R, ends[problem]), *LIMITS.on_more_nodes)
    old = 0
    for ratio in LIMITS.spun:
        some = _promising(ratio, count, problem, R, cost) & worth[problem, 0]
        some[:old] = False
        if not some.any():
            break
        old, number = len(some), problem[some]
        index, more = spun(R[some], ends[number], effort.G[number], worth[number])
        number = number[index]
        more, briefly = lowered(effort.take(number), more, *LIMITS.brief)
        problem, R = np.append(problem, number), np.concatenate([R, more])
        cost = np.append(cost, briefly)
        kept = _promising(LIMITS.promising, count, problem, R, cost)
        kept[:old] = True
        problem, R, cost = problem[kept], R[kept], cost[kept]
        R[old:], cost[old:] = lowered(effort.take(problem[old:]), R[old:], *LIMITS.on_more_nodes)
    return problem, R, cost


def _promising(
    ratio: float, count: int, problem: Numbers, R: Array, cost: Array
) -> NDArray[np.bool_]:
    """Tell which curves have a cost up to this ratio, and are not close to a cheaper curve."""
    least = _least(count, problem, cost)
    return ~(cost > ratio * least[problem]) & ~_repeated(problem, cost, R)


def _leave_the_axis(
    task: Task, effort: Effort, index: Numbers, found: list[Solution | Failure]
) -> None:
    """Bend solutions whose axis is almost constant; start Newton's method from cheaper bent curves.

    Such a solution may be a saddle. If all starts turn about one axis, no step leaves the axis,
    even if a curve that leaves it costs less.
    """
    order, t = task.functional.ends // 2 + 1, grid(LIMITS.nodes).t
    problem, bent = [], [np.empty((0, LIMITS.nodes, 3, 3))]
    for i in index:
        one = found[i]
        if isinstance(one, Solution):
            w = rates_at_nodes(task.equations.ends[i][None], one.k[None])[0][0]
            size = np.linalg.svd(w, compute_uv=False)
            if size[0] > 0 and size[1] < LIMITS.flat * size[0]:
                sides = LIMITS.bend * _across(w / size[0], effort.G[i])[:, None]
                turn = (4 * t * (1 - t))[:, None] ** order * sides
                bent.append(on_nodes(one.R[None], LIMITS.nodes) @ cayley(turn))
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


def _follow(task: Task, problem: Numbers, R: Array, found: list[Solution | Failure]) -> None:
    """Solve the problems from these curves; cheaper solutions replace those in `found`.

    If two solutions have the same cost, the first one is kept, so that rounding does not choose.
    """
    for i, one in zip(problem, task.solver(task.equations.take(problem), R), strict=True):
        if found[i] is NOTHING or one.cost < (1 - SAME) * found[i].cost:
            found[i] = one
