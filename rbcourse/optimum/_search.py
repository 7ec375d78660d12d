"""The search for the cheapest curve of each problem in a stack.

Among all curves R(t) on SO(3) with given ends, the search looks for the one with the least

    ∫ ‖u‖² dt,    where u depends on w, w' and, for the jerk, w'' (`curves.functionals`).

Such a curve is stationary: R p = c is constant. This equation has many solutions, and Newton's
method (`_collocation`) finds one of them near its start. So the search

1. makes starting curves (`_guesses`), and lowers their costs by Gauss–Newton steps,
2. for a body, adds spin about the principal axes to the cheapest ones,
3. solves R p = c by Newton's method from the cheapest ones,
4. repeats this on more nodes if there is no solution, or if one of the curves costs less; lastly,
   and for thin rods at once, it lowers the cheapest curves by damped steps before,
5. for a body, bends solutions that turn about one axis, since they may be saddles.

`ball`, `body` and `jerk` make a `Task`, and `cheapest` solves it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from rbcourse._numerics import EPS, Array
from rbcourse._polynomials import grid
from rbcourse.curves.bezier import corrected_bezier
from rbcourse.curves.ends import Ends
from rbcourse.curves.functionals import BallAcceleration, Effort, Jerk
from rbcourse.optimum._collocation import (
    BallStationary,
    Failure,
    Results,
    Solution,
    Stationary,
    cayley,
    on_nodes,
    rates_at_nodes,
    relax,
)
from rbcourse.optimum._guesses import (
    SAME,
    Curves,
    Mask,
    Numbers,
    Steps,
    between_free_motions,
    leading_sign,
    lowered,
    spun,
    starts,
)
from rbcourse.projection import nearest
from rbcourse.so3 import log

NOTHING = Failure(np.inf, 0)


class Thresholds:
    """The thresholds. Ratios are costs divided by the lowest cost; angles are in rad.

    In brackets: another value, and how many optima it misses of 2,880 balls, of 900 bodies
    (acceleration and torque, a third of them rods), or of 900 problems of the jerk, at random ends.
    "Of rods" means: of 600 rods with the moments 1, 6 to 10 and up to 1 more (torque).
    """

    nodes = 17  # nodes of starting curves, and of the linear systems of a ball [13: 10]
    nodes_for_rods = 33  # [25: 15 of rods, instead of 2]
    rod = 2.3  # a body is a rod if its middle moment has a larger ratio to the least one [3: 1]
    thin = 20.0  # beyond this ratio of moments, `nodes` suffice [33: at 100, 4 of 12 more fail]
    nodes_for_spin = 14  # added to the nodes before spin is added [12: 4 more of 1,200 rods]
    nodes_for_jerk = 29  # the jerk needs more, since it has higher derivatives [21: 0, 17: 1]
    more_nodes = 33, 65  # for fast problems, and if a start costs less [always 17: 135]
    fast = 24.0, 80.0  # if ‖w0‖ + ‖w1‖ is larger, `more_nodes` are used [48, 160: 7]
    followed = 1.1  # Newton's method starts from curves up to this cost ratio [1.02: 1]
    followed_of_bodies = 1.02  # the same for bodies; their curves have more nodes [1.005: 2]
    same_entries = 0.3  # curves count as equal if all entries of R differ by less [0.1: 0]
    known_cost = 1.01  # largest accepted ratio of a solution's cost to a start's cost [1.1: 2]
    one_start = 0.5  # if all entries of σ, w0 and w1 are smaller, one start suffices [1: 0]
    flat = 0.1  # if w deviates less from its axis, as a share, bent curves are tried [see `bend`]
    bend = 0.5  # rad: size of the bend [0.1, 1: 0; no bend: 1 of 600 bodies near an axis]
    refined = 2.0  # curves up to this cost ratio are lowered on more nodes [1.5: 0]
    spun = 2.0, 1.1, 1.001  # spin is added thrice, up to these cost ratios [twice: 2 of 300 rods]
    worth_a_turn = 0.3  # no spin is added if the cost is below this share of a turn's cost [1: 1]
    needle = 3e4  # beyond this ratio of moments, the work is bounded [no bound: 100 s at 1e6]
    most_of_needles = 16  # promising curves [no bound: 3 of 6 rods of ratio 1e4 take over 20 s]
    most = 100  # promising curves of a problem [at ratio 10: at most 65; at 50, no limit: 9 × time]
    starts = Steps(40, 5e-4)  # for starting curves [20: 0; 5e-3: 8 of 2,880 balls up to 30 rad]
    starts_of_bodies = Steps(12, 5e-3)  # for bodies [20, 2e-3: 0; 10, 1e-2: 1 more of 1,200 rods]
    on_more_nodes = Steps(30, 5e-4)  # for curves of bodies, if spin is added [20, 1e-3: 2]
    # steps for curves with more spin; after each stage, curves above a cost ratio are dropped
    # [1.5 after 2 steps: 1 more of 1,200 rods, by 16 %; 1.1 after 10 steps, then 30: 1.4 × time]
    race = (
        (Steps(4, 5e-4), 2.0),
        (Steps(6, 5e-4), 1.1),
        (Steps(8, 5e-4), 1.04),
        (Steps(20, 5e-4), 1.1),
    )
    bent = Steps(40, 1e-6)  # for bent curves, which may be near a saddle [10, 1e-4: 0]
    # for the cheapest curves of thin rods, and of all bodies at last, if Newton's method fails
    # [without: 5 of 12 rods of ratios 300 to 1,000 at rest fail, instead of 0, and 21 × time]
    damped = Steps(300, 1e-6, damped=True)
    damped_curves = 12  # of a problem


LIMITS = Thresholds()


class Task(NamedTuple):
    """A stack of problems with one batch axis, and the functions that solve them."""

    equations: Stationary
    starts: Callable[[Numbers, int], Curves]  # curves of these problems (numbered 0, 1, …), n nodes
    nodes: Any  # the number of nodes of starting curves, for all problems or for each one
    known: dict[int, Solution | Failure]  # known results; failures are ignored


@np.errstate(over="ignore", invalid="ignore")
def cheapest(task: Task) -> Results:
    """Return the cheapest solution that is found for each problem."""
    of_bodies = isinstance(task.equations.functional, Effort)
    search = BodySearch(task) if of_bodies else Search(task)
    return search.run()


class Search:
    """The search for the cheapest solutions of a task; `found` has the best ones so far."""

    first_steps = LIMITS.starts
    followed = LIMITS.followed

    def __init__(self, task: Task) -> None:
        self.task = task
        equations = task.equations
        self.functional: Any = equations.functional
        self.ends = equations.ends
        self.count = len(self.ends)
        self.found: Results = [NOTHING] * self.count
        for i, one in task.known.items():
            if isinstance(one, Solution):
                self.found[i] = one
        unknown = [one is NOTHING for one in self.found]
        self.unknown = np.flatnonzero(unknown)
        self.most = np.full(self.count, LIMITS.most)
        self.is_thin = np.zeros(self.count, bool)

    def run(self) -> Results:
        """Search for the solutions that are not known, and return all solutions."""
        nodes = self.first_nodes()[self.unknown]
        for n in np.unique(nodes).tolist():
            self.search(self.unknown[nodes == n], n)
        return self.found

    def first_nodes(self) -> Numbers:
        weights = np.array([1, 1, 1 / 6, 1 / 6])  # of w and w' in a quintic
        sizes = np.linalg.norm(self.ends, axis=-1)
        speed = sizes @ weights[: sizes.shape[1]]
        nodes = self.task.nodes
        for fast, more in zip(LIMITS.fast, LIMITS.more_nodes, strict=True):
            nodes = np.where(speed > fast, more, nodes)
        return np.asarray(nodes)

    def search(self, problems: Numbers, n: int) -> None:
        """Search with n nodes; then with more nodes, and with damped steps, where this fails.

        Solutions that still cost more than a curve are marked.
        """
        curves = Curves.none(n)
        stages = n, *(more for more in LIMITS.more_nodes if more > n)
        for nodes in stages:
            curves = self.cheap_curves(problems, nodes, curves)
            likely = self.promising(curves, self.followed)
            self.follow(curves.take(likely))
            problems = self.too_costly(problems, curves)
            hard = problems if nodes == stages[-1] else problems[self.is_thin[problems]]
            if len(hard):
                lower = self.lowered_further(curves, hard)
                self.follow(lower)
                curves = curves.joined(lower)
                problems = self.too_costly(problems, curves)
            if not len(problems):
                return
        self.mark_beaten(problems)

    def lowered_further(self, curves: Curves, problems: Numbers) -> Curves:
        """Return the cheapest curves of these problems, lowered by damped steps."""
        cheap = self.promising(curves, np.inf, LIMITS.damped_curves)
        some = curves.take(cheap & np.isin(curves.problem, problems))
        return lowered(self.functional, some, LIMITS.damped)

    def cheap_curves(self, problems: Numbers, n: int, known: Curves) -> Curves:
        """Return curves of low cost on n nodes, from the starts and from known curves."""
        again = np.isin(known.problem, problems)
        known = known.take(again).on_nodes(n)
        curves = self.task.starts(problems, n)
        curves = Curves.of(problems[curves.problem], curves.R).joined(known)
        curves = curves.with_ends(self.ends)
        return lowered(self.functional, curves, self.first_steps)

    def promising(self, curves: Curves, ratio: float, most: int = LIMITS.most) -> Mask:
        """Tell which curves have a cost up to this ratio, and are not close to a cheaper curve.

        For each problem, these are at most `most` and `self.most` curves, the cheapest ones.
        """
        least = curves.least(self.count)
        costly = curves.cost > ratio * least[curves.problem]
        likely = np.flatnonzero(~costly & ~_repeated(curves))
        order = likely[np.lexsort((curves.cost[likely], curves.problem[likely]))]
        problem = curves.problem[order]
        rank = np.arange(len(order)) - np.searchsorted(problem, problem)
        kept = np.zeros(len(curves), bool)
        kept[order[rank < np.minimum(most, self.most)[problem]]] = True
        return kept

    def follow(self, curves: Curves) -> None:
        """Start Newton's method from these curves, and keep the solutions that cost less.

        Of two solutions of the same cost, the first is kept, so that rounding does not choose.
        """
        equations = self.task.equations.take(curves.problem)
        solutions = relax(equations, curves.R)
        for i, one in zip(curves.problem, solutions, strict=True):
            best = self.found[i]
            if best is NOTHING or one.cost < (1 - SAME) * best.cost:
                self.found[i] = one

    def too_costly(self, problems: Numbers, curves: Curves) -> Numbers:
        """Return the problems without a solution that costs as little as the curves."""
        bound = LIMITS.known_cost * curves.least(self.count)
        failed = self.costs() > bound
        return problems[failed[problems]]

    def mark_beaten(self, problems: Numbers) -> None:
        for i in problems:
            one = self.found[i]
            if isinstance(one, Solution):
                self.found[i] = one._replace(beaten=True)

    def costs(self) -> Array:
        return np.array([one.cost for one in self.found])


def _repeated(curves: Curves) -> Mask:
    """Tell which curves have nearly the entries of a cheaper curve of the same problem."""
    order = np.lexsort((curves.cost, curves.problem))
    problem, R = curves.problem[order], curves.R[order]
    repeated = np.zeros(len(order), bool)
    most = np.bincount(problem, minlength=1).max()
    for after in range(1, most):
        same = problem[after:] == problem[:-after]
        gap = np.abs(R[after:] - R[:-after])
        near = gap.max(axis=(1, 2, 3)) < LIMITS.same_entries
        repeated[order[after:]] |= same & near
    return repeated


class BodySearch(Search):
    """The search for a body, which also adds spin to the curves and bends some solutions."""

    first_steps = LIMITS.starts_of_bodies
    followed = LIMITS.followed_of_bodies

    def __init__(self, task: Task) -> None:
        super().__init__(task)
        self.is_needle = ratio_of_moments(self.functional.G) > LIMITS.needle
        self.is_thin = is_thin(self.functional) & ~self.is_needle
        self.most[self.is_needle] = LIMITS.most_of_needles

    def run(self) -> Results:
        super().run()
        self.leave_the_axis()
        return self.found

    def cheap_curves(self, problems: Numbers, n: int, known: Curves) -> Curves:
        """Return curves of low cost; if spin is worth it, they have more nodes, and some spin more.

        The optima of rods differ mainly in the angle about the axis of the least moment.
        """
        curves = super().cheap_curves(problems, n, known)
        worth = self.worth_a_turn(curves)
        if not worth[curves.problem].any():
            return curves
        some = self.promising(curves, LIMITS.refined)
        more = curves.nodes + LIMITS.nodes_for_spin
        curves = curves.take(some).on_nodes(more)
        curves = curves.with_ends(self.ends)
        curves = lowered(self.functional, curves, LIMITS.on_more_nodes)
        return self.with_spin(curves, worth)

    def too_costly(self, problems: Numbers, curves: Curves) -> Numbers:
        """Return the problems that are searched again: needles are not, if there are many nodes."""
        failed = super().too_costly(problems, curves)
        ends_here = self.is_needle[failed] & (curves.nodes > LIMITS.more_nodes[0])
        self.mark_beaten(failed[ends_here])
        return failed[~ends_here]

    def worth_a_turn(self, curves: Curves) -> Mask:
        """Tell for each problem and principal axis, shape (…, 3), whether spin may lower the cost.

        From rest to rest, a full turn costs at least 12 (2π)² λ, where λ is an eigenvalue of G M G.
        It is not worth it if the cheapest curve costs less than a share of this cost.
        """
        G, M = self.functional.G, self.functional.M
        eigenvalues = np.linalg.eigvalsh(G @ M @ G)
        full_turn = 12 * (2 * np.pi) ** 2 * eigenvalues
        least = curves.least(self.count)
        return least[:, None] > LIMITS.worth_a_turn * full_turn

    def with_spin(self, curves: Curves, worth: Mask) -> Curves:
        """Return the curves and promising ones that spin more; those are spun again."""
        old = 0  # the number of curves that are already spun
        for ratio in LIMITS.spun:
            some = self.promising(curves, ratio)
            some &= worth[curves.problem, 0]
            some[:old] = False
            if not some.any():
                break
            old = len(curves)
            new = spun(curves.take(some), self.ends, self.functional.G, worth)
            for steps, most_costly in LIMITS.race:
                new = lowered(self.functional, new, steps)
                kept = self.promising(curves.joined(new), most_costly)
                new = new.take(kept[old:])
            curves = curves.joined(new)
        return curves

    def leave_the_axis(self) -> None:
        """Bend solutions whose axis is almost constant; follow bent curves that cost less.

        Such a solution may be a saddle. If all starts turn about one axis, no step leaves the axis,
        even if a curve that leaves it costs less.
        """
        bent = [self.bent(i) for i in self.unknown.tolist()]
        curves = Curves.none(LIMITS.nodes).joined(*bent)
        curves = lowered(self.functional, curves, LIMITS.bent)
        bound = (1 - SAME) * self.costs()
        cheaper = curves.cost < bound[curves.problem]
        self.follow(curves.take(cheaper))

    def bent(self, i: int) -> Curves:
        """Return four curves beside a solution whose axis is almost constant; otherwise none."""
        n = LIMITS.nodes
        one = self.found[i]
        if isinstance(one, Failure):
            return Curves.none(n)
        rates = rates_at_nodes(self.ends[[i]], one.k[None])
        w = rates[0][0]
        size, second, _ = np.linalg.svd(w, compute_uv=False)
        if size == 0 or second >= LIMITS.flat * size:
            return Curves.none(n)
        t = grid(n).t[:, None]
        bump = (4 * t * (1 - t)) ** 2
        sides = LIMITS.bend * _across(w / size, self.functional.G[i])
        R = on_nodes(one.R[None], n)
        R = R @ cayley(bump * sides[:, None])
        problem = np.full(len(sides), i)
        return Curves.of(problem, R)


def _across(w: Array, G: Array) -> Array:
    """Return four directions in which w deviates from its approximate axis, shape (4, 3).

    If w does not deviate, the inertia determines the directions. If the moments are equal, the
    order of the axes determines them.
    """
    order = np.diag([3, 2, 1])
    weak = 1e-6 * (G + 1e-3 * order)
    leans = np.concatenate([w, weak])
    _, _, axes = np.linalg.svd(leans, full_matrices=False)
    sides = axes[1:] * leading_sign(axes[1:])
    return np.concatenate([sides, -sides])


def ball(given: Ends) -> Task:
    ends, rates = _flat(given)
    equations = BallStationary(BallAcceleration(), ends.R0, ends.R1, rates)
    return Task(
        equations=equations,
        starts=lambda problems, n: starts(ends.take(problems), n),
        nodes=LIMITS.nodes,
        known=_of_slow_ends(ends, equations),
    )


def _of_slow_ends(ends: Ends, equations: BallStationary) -> dict[int, Solution | Failure]:
    """Solve problems with small σ, w0 and w1 from one start; return solutions by problem index.

    If the entries of σ, w0 and w1 are below ½, their norms are below 1. With e = σ − (w0 + w1)/2
    and d = w1 − w0, the optimum then costs about ∫ ‖w'‖² = 12 ‖e‖² + ‖d‖² < 52. A curve that turns
    the long way between such ends has a length of at least 2π − 1 and costs at least
    12 (2π − 2)² > 200. No second stationary curve that turns the short way was found, but a proof
    is missing.
    """
    turn = log(ends.turn)
    sizes = np.abs([turn, ends.w0, ends.w1])
    slow = np.flatnonzero(sizes.max(axis=(0, 2)) < LIMITS.one_start)
    if not len(slow):
        return {}
    curves = corrected_bezier(*ends.take(slow))
    R = curves(grid(LIMITS.nodes).t).swapaxes(0, 1)
    found = relax(equations.take(slow), np.ascontiguousarray(R))
    return dict(zip(slow.tolist(), found, strict=True))


def body(given: Ends, G: Array, *, of_torque: bool) -> Task:
    """Return the problems of minimum acceleration, or of minimum torque, for bodies of inertia G.

    The starting curves include the optimum of a ball and curves between free motions. If G is a
    multiple of I, the optimum of the ball is the solution.
    """
    ends, rates = _flat(given)
    G = np.broadcast_to(G, (*given.w0.shape, 3))
    functional = Effort(G.reshape(-1, 3, 3), of_torque=of_torque)
    of_balls = cheapest(ball(given))
    deviation = np.abs(functional.G - np.eye(3))
    is_ball = deviation.max(axis=(1, 2)) < 8 * EPS
    balls = np.flatnonzero(is_ball)
    moments = np.linalg.eigvalsh(functional.G)
    is_rod = moments[:, 1] > LIMITS.rod * moments[:, 0]
    is_rod &= ~is_thin(functional)

    def start(problems: Numbers, n: int) -> Curves:
        some = ends.take(problems)
        curves = starts(some, n)
        free = between_free_motions(some, functional.G[problems], n)
        known = _on_nodes([of_balls[i] for i in problems], n)
        return curves.joined(free, known)

    return Task(
        equations=Stationary(functional, ends.R0, ends.R1, rates),
        starts=start,
        nodes=np.where(is_rod, LIMITS.nodes_for_rods, LIMITS.nodes),
        known={i: of_balls[i] for i in balls.tolist()},
    )


def ratio_of_moments(G: Array) -> Array:
    moments = np.linalg.eigvalsh(G)
    return np.asarray(moments[..., 2] / moments[..., 0])


def is_thin(functional: Effort) -> Mask:
    """Tell which bodies are thin rods, whose optima are hard to find."""
    return np.asarray(ratio_of_moments(functional.G) > LIMITS.thin)


def _on_nodes(results: Results, n: int) -> Curves:
    """Return the solutions as curves on n nodes, numbered by their places in the list."""
    curves = []
    for i, one in enumerate(results):
        if isinstance(one, Solution):
            R = on_nodes(one.R[None], n)
            problem = np.array([i])
            curves.append(Curves.of(problem, R))
    return Curves.none(n).joined(*curves)


def jerk(given: Ends, a0: Array, a1: Array) -> Task:
    ends, rates = _flat(given, a0, a1)

    def start(problems: Numbers, n: int) -> Curves:
        accelerations = rates[problems, 2:].swapaxes(0, 1)
        return starts(ends.take(problems), n, *accelerations)

    return Task(
        equations=Stationary(Jerk(), ends.R0, ends.R1, rates),
        starts=start,
        nodes=LIMITS.nodes_for_jerk,
        known={},
    )


def _flat(given: Ends, *accelerations: Array) -> tuple[Ends, Array]:
    """Return the ends with one batch axis and exact rotations, and the end values (N, m, 3)."""
    ends = given.flat()
    # Newton's method fails if the rotations have few correct digits
    R0, _ = nearest(ends.R0)
    R1, _ = nearest(ends.R1)
    ends = ends._replace(R0=R0, R1=R1)
    more = [a.reshape(-1, 3) for a in accelerations]
    rates = np.stack([ends.w0, ends.w1, *more], axis=1)
    return ends, rates
