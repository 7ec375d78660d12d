"""Newton's method for optima between two poses, with values at Chebyshev nodes as unknowns.

The unknowns are R and the highest derivative k = w⁽ᵐ⁾ at the nodes, and c. The equations are

    R = R0 + ∫ R ŵ dt,    R(1) = R1,    p(w, w', …, k) = Rᵀ c,

where w, w', … are integrals of k plus polynomials that give the end values. A Newton step turns R
by ε in the fixed frame, and changes k and c. To first order,

    ε = d + ∫ R δw dt,    ε(1) = 0,    p + δp = Rᵀ(c + ĉ ε + δc),

where d corrects the error of the first equation. The method works on few nodes until the steps are
short, and then on more nodes until the last Chebyshev coefficients have decayed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, NamedTuple, Self, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from rbcourse._numerics import Array, blocks, scaled, solve
from rbcourse._polynomials import along, grid, interpolation, primitives, tails
from rbcourse.curves.functionals import Functional
from rbcourse.so3 import hat, vee

TOGETHER = 64  # problems solved together, which bounds the memory: 120 MB a matrix on 161 nodes
NODES = 17, 25, 33, 49, 65, 97, 129, 161  # one after the other [to 129: 6 of 300 rods missed]
MOST_INTERVALS = 256  # between the nodes of a ball, whose linear systems do not grow
STEPS = 25  # on one set of nodes; then the problem has failed
LONGEST_STEP = 0.5  # rad: no step turns a node by more than this
ROUGH = 1e-2  # rad: after a step shorter than this, the method continues on more nodes
EXACT = 3e-12  # bound on the residual and on the last Chebyshev coefficients of R
SHARE = 0.03  # SHARE * EXACT bounds the relative residual of p and the last coefficients of k
UNRESOLVED = 1e3  # steps shorter than this many last coefficients do not improve the curve
STALLED = 1e-6  # rad: if a step shorter than this does not halve the residual, rounding prevents it
Numbers: TypeAlias = NDArray[np.intp]
Record = TypeVar("Record", bound=NamedTuple)


class Solution(NamedTuple):
    """A solution of R p = c, with R and the highest derivative k of w at the nodes.

    The cost is ∫ ‖u‖² dt. A solution is `beaten` by a known curve from which Newton's method fails.
    """

    R: Array
    k: Array
    c: Array
    cost: float
    residual: float
    iterations: int
    beaten: bool = False


class Failure(NamedTuple):
    """The report of a failure: the last residual and the number of steps."""

    residual: float
    iterations: int

    @property
    def cost(self) -> float:
        return np.inf


Results: TypeAlias = list[Solution | Failure]


def relax(equations: Stationary, R: Array) -> Results:
    """Solve problems by Newton's method, starting from rotations at nodes, (N, n, 3, 3).

    A problem that is singular or overflows gives a `Failure`.
    """
    found: Results = []
    for some in blocks(len(R), TOGETHER):
        problems = replace(equations.take(some), coarse=R.shape[1])
        found += _attempt(problems, R[some])
    return found


def _attempt(equations: Stationary, R: Array) -> Results:
    """Solve a stack; if this raises an error, solve its problems one by one."""
    try:
        return _relax(equations, R)
    except (FloatingPointError, np.linalg.LinAlgError, ValueError):
        if len(R) == 1:
            return [Failure(np.inf, 0)]
    ones = [slice(i, i + 1) for i in range(len(R))]
    return [_attempt(equations.take(one), R[one])[0] for one in ones]


def _relax(equations: Stationary, R: Array) -> Results:
    found: Results = [Failure(np.inf, 0)] * len(R)
    first = R.shape[1]
    number = np.arange(len(R))
    unknowns = equations.first(equations.with_ends(R))
    now = Iterates.start(unknowns, number, steps=np.zeros_like(number))
    for n in equations.nodes(first):
        some = equations.take(now.number)
        if n > first:
            now = Iterates.start(some.refined(now.unknowns, n), now.number, now.steps)
        now = _newton(some, now, rough=n == first)
        _store(equations, now, found)
        now = take(now, now.finer)
        if not len(now.number):
            break
    return found


def _newton(equations: Stationary, now: Iterates, rough: bool) -> Iterates:
    """Make steps on one set of nodes until each problem stops.

    If `rough`, a problem needs more nodes as soon as its steps are short.
    """
    stopped = []
    for _ in range(STEPS):
        errors = equations.errors(now.unknowns)
        left = np.where(np.isnan(errors.largest), np.inf, errors.largest)
        if rough:
            now = now._replace(left=left, finer=now.turned < ROUGH)
        else:
            now = now.judged(left, equations.tails(now.unknowns))
        going = ~(now.solved | now.finer) & np.isfinite(left)
        if not going.all():
            stopped.append(take(now, ~going))
            equations = equations.take(going)
            now = take(now, going)
            errors = take(errors, going)
        if not going.any():
            break
        responses = equations.responses(now.unknowns, errors)
        now = now.stepped(equations, step=take(responses, np.s_[..., 0]))
    now = joined([*stopped, now])
    return take(now, np.argsort(now.number))


def _store(equations: Stationary, now: Iterates, found: Results) -> None:
    for i, *failure in zip(now.number, now.left.tolist(), now.steps.tolist(), strict=True):
        found[i] = Failure(*failure)
    done = take(now, now.solved)
    costs = equations.take(done.number).costs(done.k)
    for i, *solution in zip(done.number, *done.unknowns, costs.tolist(), strict=True):
        found[i] = Solution(*solution, *found[i])


def take(record: Record, index: Any) -> Record:
    return record._make(x[index] for x in record)


def joined(records: list[Record]) -> Record:
    return records[0]._make(map(np.concatenate, zip(*records, strict=True)))


class Iterates(NamedTuple):
    """The state of Newton's method for a stack of problems on one set of nodes.

    `number` is the index of a problem in the stack of `_relax`, `left` its largest error, `turned`
    its largest turn by the last step. A problem stops if it is `solved` or needs `finer` nodes.
    """

    R: Array
    k: Array
    c: Array
    number: Numbers
    steps: Numbers
    left: Array
    turned: Array
    solved: NDArray[np.bool_]
    finer: NDArray[np.bool_]

    @classmethod
    def start(cls, unknowns: Unknowns, number: Numbers, steps: Numbers) -> Self:
        large = np.full(len(number), np.inf)
        no = np.zeros(len(number), bool)
        return cls(*unknowns, number, steps, left=large, turned=large, solved=no, finer=no)

    @property
    def unknowns(self) -> Unknowns:
        return Unknowns(self.R, self.k, self.c)

    def judged(self, left: Array, tail: Array) -> Self:
        """Return the state with new errors; tell from the last coefficients which problems stop.

        A problem is solved if both are small. It needs more nodes if the last coefficients
        dominate, or if rounding stops the iteration.
        """
        solved = (tail < EXACT) & (left < EXACT)
        unresolved = (tail > EXACT) & (self.turned < UNRESOLVED * tail)
        stalled = (self.turned < STALLED) & (left > self.left / 2)
        finer = (unresolved | stalled) & ~solved
        return self._replace(left=left, solved=solved, finer=finer)

    def stepped(self, equations: Stationary, step: Change) -> Self:
        turned = np.linalg.norm(step.turn, axis=-1).max(axis=1)
        share = LONGEST_STEP / np.maximum(turned, LONGEST_STEP)
        R, k, c = equations.stepped(self.unknowns, step, share)
        return self._replace(R=R, k=k, c=c, turned=turned, steps=self.steps + 1)


class Unknowns(NamedTuple):
    """R, shape (N, n, 3, 3), and k, shape (N, n, 3), at the nodes, and c, shape (N, 3)."""

    R: Array
    k: Array
    c: Array


class Change(NamedTuple):
    """Turns ε of the nodes in the fixed frame, δk and δc; several changes are on a last axis."""

    turn: Array
    k: Array
    c: Array


class Errors(NamedTuple):
    """The errors of the equations at the nodes, and ŵ, from which they are computed.

    E is R0 + ∫ R ŵ dt − R, and `lacking` is p − Rᵀc, which is 0 for a ball.
    """

    largest: Array
    E: Array
    W: Array
    lacking: Array


@dataclass(frozen=True, eq=False)
class Stationary:
    """The equation R p = c for any functional, for a stack of problems.

    `ends` contains w0 and w1, and for the jerk also a0 and a1; its shape is (N, m, 3).
    """

    functional: Functional
    R0: Array
    R1: Array
    ends: Array
    coarse: int = 17  # the number of nodes of the linear systems of `BallStationary`

    def take(self, index: Any) -> Self:
        functional = self.functional.take(index)
        R0, R1, ends = (x[index] for x in (self.R0, self.R1, self.ends))
        return replace(self, functional=functional, R0=R0, R1=R1, ends=ends)

    def nodes(self, n: int) -> tuple[int, ...]:
        return n, *(more for more in NODES if more > n)

    def first(self, R: Array) -> Unknowns:
        """Return initial values: the given R, k fitted to w by n/2 polynomials, and c = 0.

        The mean of R p would be a worse initial value of c.
        """
        by = primitives(R.shape[1], self.ends.shape[1])
        lacking = rates_of(R, 1)[0] - by.from_ends[0] @ self.ends
        return Unknowns(R, by.fit @ lacking, c=np.zeros((len(R), 3)))

    def unknowns(self, R: Array, k: Array, c: Array) -> Unknowns:
        """Return the unknowns. If k depends on R and c, it is computed from them."""
        return Unknowns(R, k, c)

    def with_ends(self, R: Array) -> Array:
        R = R.copy()
        R[:, 0] = self.R0
        R[:, -1] = self.R1
        return R

    def refined(self, now: Unknowns, n: int) -> Unknowns:
        R = self.with_ends(on_nodes(now.R, n))
        k = interpolation(now.k.shape[1], n) @ now.k
        return self.unknowns(R, k, now.c)

    def stepped(self, now: Unknowns, step: Change, share: Array) -> Unknowns:
        at_nodes = share[:, None, None]
        R = cayley(at_nodes * step.turn) @ now.R
        k = now.k + at_nodes * step.k
        c = now.c + share[:, None] * step.c
        return self.unknowns(R, k, c)

    def errors(self, now: Unknowns) -> Errors:
        """Return the errors; that of p = Rᵀc is relative to the size of k and p."""
        rates = rates_at_nodes(self.ends, now.k)
        W = hat(rates[0])
        E = self.R0[:, None] + integrals(now.R @ W) - now.R
        p = self.functional.p(*rates)
        lacking = p - in_body(now.R, now.c)
        size = 1 + _largest(now.k) + _largest(p)
        relative = _largest(lacking) / (SHARE * size)
        return Errors(np.maximum(_largest(E), relative), E, W, lacking)

    def tails(self, now: Unknowns) -> Array:
        """Return the last coefficients of R or, if larger, those of k relative to its size."""
        size = 1 + _largest(now.k)
        return np.maximum(tails(now.R), tails(now.k) / (SHARE * size))

    def responses(self, now: Unknowns, errors: Errors, by_ends: bool = False) -> Change:
        """Return a Newton step and, if `by_ends`, the responses to a unit change of each end value.

        Let Kᵢ be the integrals that give the rates w, w', … from k, let T x be ∫ R K₀ x dt, and
        let Pᵢ be the derivatives of p with respect to the rates. The equations are

            [Σ Pᵢ Kᵢ − Rᵀĉ T   −Rᵀ] [δk]   [Rᵀĉ d − (p − Rᵀc)]
            [T at t = 1          0] [δc] = [−d at t = 1       ],    ε = d + T δk.

        A change of the end values adds terms to d and p.
        """
        R, k, c = now
        by = primitives(R.shape[1], self.ends.shape[1])
        P = self.functional.p_by(*rates_at_nodes(self.ends, k))
        d = self.known_turns(R, errors, by_ends)
        lacking = errors.lacking[..., None]
        if by_ends:
            p_by_ends = np.asarray(sum(map(by_ends_of, by.from_ends, P)))
            lacking = np.append(lacking, p_by_ends, axis=-1)
        T = _turns_by_k(R, by.from_k[0])
        pull = R.mT @ hat(c)[:, None]
        dk, dc = _solve_blocks(
            _with_rates(-(pull @ T), P, by.from_k),
            -R.mT,
            T[:, -1],
            pull @ d - lacking,
            -d[:, -1],
        )
        count, size, columns = dk.shape
        turn = T.reshape(count, size, size) @ dk
        dk = dk.reshape(count, 3, -1, columns).swapaxes(1, 2)
        return Change(d + turn.reshape(d.shape), dk, dc)

    def known_turns(self, R: Array, errors: Errors, by_ends: bool) -> Array:
        """Return d and, if `by_ends`, also ∫ R δw dt for a unit change of each end value.

        The turns ε = d + ∫ R δw dt correct E to first order if w changes by δw. They also change
        R ŵ, so d = vee(E Rᵀ + ∫ E ŵ Rᵀ dt).
        """
        _, E, W, _ = errors
        Rt = np.ascontiguousarray(R.mT)  # faster to multiply
        d = vee(E @ Rt + integrals(E @ W @ Rt))[..., None]
        if not by_ends:
            return d
        w_by_ends = primitives(R.shape[1], self.ends.shape[1]).from_ends[0]
        return np.append(d, integrals(by_ends_of(w_by_ends, R)), axis=-1)

    def costs(self, k: Array) -> Array:
        """Return ∫ ‖u‖² dt, computed with twice as many nodes as k has."""
        fine = 2 * k.shape[1] - 1
        k = interpolation(k.shape[1], fine) @ k
        rates = rates_at_nodes(self.ends, k)
        u = self.functional.deviation(*rates[: self.ends.shape[1] // 2 + 1])
        squares = np.sum(u**2, axis=-1)
        return np.asarray(squares @ grid(fine).integral[-1])


def _turns_by_k(R: Array, K: Array) -> Array:
    """Return T of `Stationary.responses`, shape (N, n, 3, 3 n).

    The columns are ordered by the components of x, and then by its nodes, which is fast.
    """
    count, n = R.shape[:2]
    entries = R.reshape(count, n, 9).mT
    T = (grid(n).integral * entries[:, :, None]) @ K
    T = T.reshape(count, 3, 3, n, n)  # the axes are row, column, node of T x, node of x
    return T.transpose(0, 3, 1, 2, 4).reshape(count, n, 3, 3 * n)


def _with_rates(by_k: Array, P: list[Array], from_k: list[Array]) -> Array:
    """Add Σ Pᵢ Kᵢ to matrices of the shape (N, n, 3, 3 n), whose columns are ordered as in T."""
    count, n = by_k.shape[:2]
    total = by_k.reshape(count, n, 3, 3, n)
    for Pi, K in zip(P, from_k, strict=True):
        total += Pi[..., None] * K[:, None, None]
    return by_k


def _solve_blocks(A: Array, B: Array, C: Array, f: Array, g: Array) -> tuple[Array, Array]:
    """Return x and y with A x + B y = f and C x = g, for each column of f and g.

    The shapes of A, B and f are (N, n, 3, ...), since the first equation holds at each node.
    """
    count, size = len(C), C.shape[-1]
    matrix = np.zeros((count, size + 3, size + 3))
    matrix[:, :-3, :-3] = A.reshape(count, size, size)
    matrix[:, :-3, -3:] = B.reshape(count, size, 3)
    matrix[:, -3:, :-3] = C
    both = solve(matrix, np.append(f.reshape(count, size, -1), g, axis=1))
    return both[:, :-3], both[:, -3:]


class BallStationary(Stationary):
    """The equation R w'' = c; the unknowns are R at the nodes and c, and k = w'' = Rᵀc.

    The linear systems are solved on a fixed number of nodes, `coarse`. This is 1.5 times as fast as
    `Stationary` for one problem, and 4.5 times as fast for stacks of 300.
    """

    def nodes(self, n: int) -> tuple[int, ...]:
        intervals = [(n - 1) * times for times in (1, 2, 4, 8, 16)]
        return tuple(1 + i for i in intervals if i <= MOST_INTERVALS)

    def first(self, R: Array) -> Unknowns:
        """Return initial values: the given R, and the c for which w'' = Rᵀc fits w best."""
        count = len(R)
        by = primitives(R.shape[1], 2)
        lacking = rates_of(R, 1)[0] - by.from_ends[0] @ self.ends
        effect = along(by.from_k[0], R.mT).reshape(count, -1, 3)
        right = effect.mT @ lacking.reshape(count, -1, 1)
        c = solve(effect.mT @ effect, right)
        return self.unknowns(R, lacking, c[..., 0])

    def unknowns(self, R: Array, k: Array, c: Array) -> Unknowns:
        return Unknowns(R, in_body(R, c), c)

    def errors(self, now: Unknowns) -> Errors:
        """Return the errors; only R0 + ∫ R ŵ dt − R is not 0."""
        W = hat(rates_at_nodes(self.ends, now.k)[0])
        E = self.R0[:, None] + integrals(now.R @ W) - now.R
        return Errors(_largest(E), E, W, np.zeros_like(now.k))

    def tails(self, now: Unknowns) -> Array:
        return tails(now.R)

    def responses(self, now: Unknowns, errors: Errors, by_ends: bool = False) -> Change:
        """Return the result of `Stationary.responses` from smaller systems.

        Since w'' = Rᵀc, we have w = (1 − t) w0 + t w1 + K Rᵀc, and to first order

            ε = d + ∫ R K Rᵀ(ĉ ε + δc) dt,    ε(1) = 0.

        `effects` solves the first equation, and the second one gives δc.
        """
        by_d, by_c = self.effects(now, errors, by_ends)
        dc = -solve(by_c[:, -1], by_d[:, -1])
        turn = by_d + by_c @ dc[:, None]
        if not by_ends:  # δk is not needed, since `unknowns` computes k
            return Change(turn, np.zeros_like(turn), dc)
        return Change(turn, turned_rate(now, turn, dc), dc)

    def effects(self, now: Unknowns, errors: Errors, by_ends: bool) -> tuple[Array, Array]:
        """Return ε at the nodes for each column of d, and for unit vectors δc.

        The equation is solved for ĉ ε on the `coarse` nodes. Then the right side gives ε on all
        nodes. The integrals smooth the error, so this ε is as accurate as a solution on all nodes.
        """
        R, _, c = now
        n = R.shape[1]
        d = self.known_turns(R, errors, by_ends)
        stride = (n - 1) // (self.coarse - 1)
        causes = _coarse_causes(R[:, ::stride], c, d[:, ::stride])
        causes = along(interpolation(causes.shape[1], n), causes)
        causes[..., -3:] += np.eye(3)  # δc itself
        Rt = np.ascontiguousarray(R.mT)  # faster to multiply
        w = along(primitives(n, 2).from_k[0], Rt @ causes)
        turns = integrals(R @ w)
        return turns[..., :-3] + d, turns[..., -3:]


def turned_rate(now: Unknowns, turn: Array, dc: Array) -> Array:
    """Return the changes of w'' = Rᵀc by the turns ε of the nodes, and by δc."""
    return now.R.mT @ (hat(now.c)[:, None] @ turn + dc[:, None])


def _coarse_causes(R: Array, c: Array, d: Array) -> Array:
    """Return ĉ ε at the nodes for each column of d, and for unit vectors δc.

    Only the two components of ε perpendicular to c matter. With them as unknowns x,

        x = e · (d + ∫ R K Rᵀ((c × e) x + δc) dt),

    where e are two unit vectors perpendicular to c.
    """
    count, n, _, columns = d.shape
    across, ahead = _across(c)
    w_by_c = along(primitives(n, 2).from_k[0], R.mT)
    by_c = integrals(R @ w_by_c)
    right = across[:, None] @ np.append(d, by_c, axis=-1)
    right = right.reshape(count, 2 * n, columns + 3)
    x = solve(_system_across(R, across, ahead), right)
    return ahead[:, None] @ x.reshape(count, n, 2, columns + 3)


def _system_across(R: Array, across: Array, ahead: Array) -> Array:
    count, n = R.shape[:2]
    left = (across[:, None] @ R).reshape(count, 2 * n, 3)
    right = (-ahead.mT[:, None] @ R).reshape(count, 2 * n, 3)
    products = (left @ right.mT) * _for_each_entry(n)
    system = integrals(products.reshape(count, n, -1)).reshape(count, 2 * n, 2 * n)
    np.einsum("...ii->...i", system)[...] += 1
    return system


def _across(c: Array) -> tuple[Array, Array]:
    """Return unit vectors e₁, e₂ perpendicular to c as rows, and c × e₁, c × e₂ as columns.

    The rows, shape (N, 2, 3), belong to the Householder reflection that maps c to the third axis.
    """
    v = scaled(c, axis=-1)  # otherwise squares of small numbers could underflow
    length = np.sqrt(np.sum(v * v, axis=-1))
    v[:, 2] += np.copysign(length, v[:, 2])
    square = np.sum(v * v, axis=-1)
    factor = 2 / np.where(square == 0, 1, square)
    twice = v * factor[:, None]
    across = np.eye(2, 3) - v[:, :2, None] * twice[:, None]
    return across, hat(c) @ across.mT


@lru_cache
def _for_each_entry(n: int) -> Array:
    """Return the matrix of the twofold integral; each entry is repeated in a 2 × 2 block."""
    return primitives(n, 2).from_k[0].repeat(2, axis=0).repeat(2, axis=1)


def by_ends_of(from_ends: Array, matrices: Array) -> Array:
    """Multiply the matrices by the rates for unit end values; the shape is (N, n, 3, 3 m)."""
    products = matrices[..., None, :] * from_ends[:, None, :, None]
    count, n, rows = products.shape[:3]
    return products.reshape(count, n, rows, -1)


def rates_at_nodes(ends: Array, k: Array) -> list[Array]:
    """Return w, w', … up to the highest derivative k at the nodes, from k and the end values."""
    by = primitives(k.shape[1], ends.shape[1])
    integrals_of_k = zip(by.from_ends[:-1], by.from_k[:-1], strict=True)
    return [*(E @ ends + K @ k for E, K in integrals_of_k), k]


def rates_of(R: Array, count: int) -> list[Array]:
    """Return `count` rates w, w', … at the nodes, from R at the nodes."""
    return with_derivatives(vee(R.mT @ along(grid(R.shape[1]).derivative, R)), count - 1)


def with_derivatives(values: Array, count: int) -> list[Array]:
    """Return values at the nodes, shape (..., n, columns), and their first derivatives."""
    found = [values]
    for _ in range(count):
        found.append(grid(values.shape[-2]).derivative @ found[-1])
    return found


def integrals(values: Array) -> Array:
    """Return the integrals from 0 to each node, from values at the nodes, (N, n, ...)."""
    return along(grid(values.shape[1]).integral, values)


def in_body(R: Array, c: Array) -> Array:
    """Return Rᵀc at the nodes, shape (N, n, 3)."""
    return (c[:, None, None] @ R)[:, :, 0]


def on_nodes(R: Array, n: int) -> Array:
    """Return rotations at nodes, shape (N, ..., 3, 3), interpolated to n nodes."""
    return orthogonal(along(interpolation(R.shape[1], n), R))


def orthogonal(R: Array) -> Array:
    """Return R after a Newton–Schulz step, which makes it orthogonal up to rounding."""
    square = R.mT @ R
    return R @ (1.5 * np.eye(3) - 0.5 * square)


def cayley(turn: Array) -> Array:
    """Return the rotations by 2 atan(‖turn‖/2) about the vectors `turn`, by Cayley's formula."""
    H = hat(turn)
    square = np.sum(turn**2, axis=-1)
    share = 1 / (1 + square / 4)
    return np.eye(3) + share[..., None, None] * (H + H @ H / 2)


def _largest(values: Array) -> Array:
    return np.asarray(np.abs(values).max(axis=tuple(range(1, values.ndim))))
