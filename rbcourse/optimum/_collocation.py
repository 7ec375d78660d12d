"""Newton's method for R p = c; the unknowns are the values of a curve at Chebyshev nodes.

`Stationary` is the equation for any functional. `BallStationary` is the equation R w'' = c for a
ball; it has fewer unknowns and faster steps. Both contain a stack of problems and have the same
methods.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple, Self, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rbcourse._chebyshev import along, grid, interpolation, primitives, tails
from rbcourse._numerics import Array, blocks, scaled
from rbcourse.curves.functionals import BallAcceleration, Functional
from rbcourse.so3 import hat, vee

STEPS = 25
TOGETHER = 64  # problems solved together, which bounds the memory: 80 MB a matrix on 129 nodes
EXACT = 3e-12  # bound on the residual and on the last Chebyshev coefficients of R
SHARE = 0.03  # SHARE * EXACT bounds the relative residual of p and the last coefficients of k
LONGEST_STEP = 0.5  # rad: no step turns a node by more than this
ROUGH = 1e-2  # rad: after a step shorter than this, the method continues on more nodes
NODES = 17, 25, 33, 49, 65, 97, 129
FAILED, FINER, SOLVED = range(3)
Arrays: TypeAlias = tuple[Array, ...]
Equations: TypeAlias = "Stationary | BallStationary"


class Solution(NamedTuple):
    """A solution of R p = c, with R and the highest derivative k of w at the nodes.

    The cost is ∫ ‖u‖² dt. `beaten` is True if a known curve costs less, but Newton's method fails
    when it starts from that curve.
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
        """The cost, which is infinite."""
        return np.inf


def relax(equations: Equations, R: Array) -> list[Solution | Failure]:
    """Solve problems by Newton's method, starting from rotations at nodes, (N, n, 3, 3).

    The method works on these nodes until the steps are short, and then on more nodes until the last
    Chebyshev coefficients have decayed. A problem that is singular or overflows gives a `Failure`.
    """
    parts = blocks(len(R), TOGETHER)
    return [one for part in parts for one in _attempt(equations.take(part), R[part])]


def relax_ball(equations: BallStationary, R: Array) -> list[Solution | Failure]:
    """Solve problems of balls as `relax` does, with linear systems on the nodes of the given R."""
    parts = equations.R0, equations.R1, equations.ends
    return relax(BallStationary(*parts, R.shape[1]), R)


def _attempt(equations: Equations, R: Array) -> list[Solution | Failure]:
    """Solve a stack; if this raises an error, solve its problems one by one."""
    try:
        return _relax(equations, R)
    except (FloatingPointError, np.linalg.LinAlgError, ValueError):
        if len(R) == 1:
            return [Failure(np.inf, 0)]
    parts = [slice(i, i + 1) for i in range(len(R))]
    return [_attempt(equations.take(one), R[one])[0] for one in parts]


def _relax(equations: Equations, R: Array) -> list[Solution | Failure]:
    found: list[Solution | Failure] = [Failure(np.inf, 0)] * len(R)
    number, steps = np.arange(len(R)), np.zeros(len(R), int)
    first, R = R.shape[1], _with_ends(equations, R)
    unknowns: Arrays = R, *equations.first(R)
    for n in equations.nodes(first):
        if not len(number):
            break
        if n > first:
            unknowns = refined(equations, n, unknowns)
        now = _newton(equations, unknowns, rough=n == first)
        steps += now.steps
        solved, finer = now.verdict == SOLVED, now.verdict == FINER
        for i, left, taken in zip(number, now.left.tolist(), steps.tolist(), strict=True):
            found[i] = Failure(left, taken)
        good = tuple(x[solved] for x in now.unknowns)
        results = equations.take(solved).solution(good)
        for i, R_i, k, c, cost in zip(number[solved], good[0], *results, strict=True):
            found[i] = Solution(R_i, k, c, float(cost), *found[i])
        equations, number, steps = equations.take(finer), number[finer], steps[finer]
        unknowns = tuple(x[finer] for x in now.unknowns)
    return found


def _with_ends(equations: Equations, R: Array) -> Array:
    R = R.copy()
    R[:, 0], R[:, -1] = equations.R0, equations.R1
    return R


def refined(equations: Equations, n: int, unknowns: Arrays) -> Arrays:
    """Return the unknowns interpolated to n nodes; c does not depend on the nodes."""
    R, *others = unknowns
    up = interpolation(R.shape[1], n)
    return _with_ends(equations, on_nodes(R, n)), *(up @ x if x.ndim == 3 else x for x in others)


def on_nodes(R: Array, n: int) -> Array:
    """Return rotations at nodes, shape (N, ..., 3, 3), interpolated to n nodes."""
    return orthogonal(along(interpolation(R.shape[1], n), R))


class Iterate(NamedTuple):
    """The result of Newton's method on one set of nodes, with a verdict for each problem."""

    unknowns: Arrays
    left: Array
    steps: NDArray[np.intp]
    verdict: NDArray[np.intp]


def _newton(equations: Equations, unknowns: Arrays, rough: bool) -> Iterate:
    """Improve the unknowns by Newton steps that turn no node by more than 0.5 rad."""
    unknowns = tuple(x.copy() for x in unknowns)
    R, *others = unknowns
    left, size = np.full((2, len(R)), np.inf)
    steps, verdict = np.zeros((2, len(R)), int)
    active = np.arange(len(R))
    for _ in range(STEPS):
        some, now = equations.take(active), tuple(x[active] for x in unknowns)
        before = left[active]
        left[active], parts = some.errors(now)
        left[np.isnan(left)] = np.inf
        if rough:
            verdict[active] = np.where(size[active] < ROUGH, FINER, FAILED)
        else:
            verdict[active] = _verdicts(some.tails(now), left[active], before, size[active])
        going = (verdict[active] == FAILED) & np.isfinite(left[active])
        if not going.any():
            break
        active = active[going]
        now, parts = (tuple(x[going] for x in arrays) for arrays in (now, parts))
        turn, *changes = (x[..., 0] for x in some.take(going).responses(now, parts))
        size[active] = np.linalg.norm(turn, axis=-1).max(axis=1)
        share = LONGEST_STEP / np.maximum(size[active], LONGEST_STEP)
        R[active] = cayley(share[:, None, None] * turn) @ now[0]
        for x, change in zip(others, changes, strict=True):
            x[active] += share.reshape(-1, *(1 for _ in x.shape[1:])) * change
        steps[active] += 1
    return Iterate(unknowns, left, steps, verdict)


def _verdicts(tail: Array, left: Array, before: Array, size: Array) -> NDArray[np.intp]:
    """Return SOLVED, FINER or FAILED for each problem, after a step of the given size.

    A problem is solved if the residual and the last coefficients are small. It needs more nodes if
    the last coefficients dominate, or if rounding stops the iteration.
    """
    stalled = (size < 1e-6) & (left > before / 2)
    enough = stalled | (tail > EXACT) & (size < 1e3 * tail)
    return np.where((tail < EXACT) & (left < EXACT), SOLVED, np.where(enough, FINER, FAILED))


def cayley(turn: Array) -> Array:
    """Return the rotations by 2 atan(‖turn‖/2) about the vectors `turn`, by Cayley's formula."""
    H = hat(turn)
    share = 1 / (1 + np.sum(turn**2, axis=-1) / 4)
    return np.eye(3) + share[..., None, None] * (H + H @ H / 2)


def orthogonal(R: Array) -> Array:
    """Return R after a Newton–Schulz step, which makes it orthogonal up to rounding."""
    return R @ (1.5 * np.eye(3) - 0.5 * (R.mT @ R))


def in_body(R: Array, c: Array) -> Array:
    """Return Rᵀc at the nodes, shape (N, n, 3)."""
    return (c[:, None, None] @ R)[:, :, 0]


def rates_at_nodes(ends: Array, k: Array) -> list[Array]:
    """Return w, w', … up to the highest derivative k at the nodes, from k and the end values."""
    by = primitives(k.shape[1], ends.shape[1])
    return [E @ ends + K @ k for E, K in zip(by.from_ends, by.from_k, strict=True)]


def kinematic_error(R0: Array, R: Array, w: Array) -> tuple[Array, Array]:
    """Return E = R0 + ∫ R ŵ dt − R at the nodes, and ŵ."""
    W = hat(w)
    return R0[:, None] + along(grid(R.shape[1]).integral, R @ W) - R, W


def mending_turns(R: Array, E: Array, W: Array) -> Array:
    """Return d such that the turns ε = d + ∫ R δw dt correct E to first order if w changes by δw.

    The turns ε are in the fixed frame. They also change R ŵ, so d = vee(E Rᵀ + ∫ E ŵ Rᵀ dt).
    """
    Rt = np.ascontiguousarray(R.mT)  # faster to multiply
    return vee(E @ Rt + along(grid(R.shape[1]).integral, E @ W @ Rt))


def costs(functional: Functional, ends: Array, k: Array) -> Array:
    """Return ∫ ‖u‖² dt, computed with twice as many nodes as k has."""
    fine = grid(2 * k.shape[1] - 1)
    up = interpolation(k.shape[1], len(fine.t))
    rates = rates_at_nodes(ends, up @ k)
    u = functional.deviation(*rates[: ends.shape[1] // 2 + 1])
    return np.sum(u**2, axis=-1) @ fine.integral[-1]


class Stationary:
    """The equation R p = c for any functional; the unknowns are R and k = w⁽ᵐ⁾ at nodes, and c.

    `ends` contains w0 and w1, and for the jerk also a0 and a1; its shape is (N, m, 3).

    Source: beyond BK 2.
    """

    def __init__(self, functional: Functional, R0: Array, R1: Array, ends: Array) -> None:
        self.functional, self.R0, self.R1, self.ends = functional, R0, R1, ends

    def take(self, index: Any) -> Self:
        """Return the equations of some of the problems."""
        parts = self.R0[index], self.R1[index], self.ends[index]
        return type(self)(self.functional.take(index), *parts)

    def first(self, R: Array) -> tuple[Array, Array]:
        """Return initial values, given R: k, fitted to w by n/2 polynomials, and c = 0.

        The mean of R p would be a worse initial value of c.
        """
        nodes, by = grid(R.shape[1]), primitives(R.shape[1], self.ends.shape[1])
        w = vee(R.mT @ along(nodes.derivative, R))
        return by.fit @ (w - by.from_ends[0] @ self.ends), np.zeros((len(R), 3))

    def nodes(self, n: int) -> tuple[int, ...]:
        """Return the numbers of nodes on which to work: n and those of `NODES` that are larger."""
        return n, *(more for more in NODES if more > n)

    def errors(self, unknowns: Arrays) -> tuple[Array, Arrays]:
        """Return the largest error of each problem, and the data for a step.

        The equations are R = R0 + ∫ R ŵ dt and p = Rᵀc. The error of the second equation is
        relative to the size of k and p.
        """
        R, k, c = unknowns
        rates = rates_at_nodes(self.ends, k)
        E, W = kinematic_error(self.R0, R, rates[0])
        p = self.functional.p(*rates)
        lacking = p - in_body(R, c)
        size = 1 + np.abs(k).max(axis=(1, 2)) + np.abs(p).max(axis=(1, 2))
        left = np.abs(E).max(axis=(1, 2, 3)), np.abs(lacking).max(axis=(1, 2)) / (SHARE * size)
        return np.maximum(*left), (E, W, lacking, *rates)

    def responses(self, unknowns: Arrays, parts: Arrays, by_ends: bool = False) -> Arrays:
        """Return the turns ε of the nodes, in the fixed frame, and the changes of k and c.

        On the last axis, the first column is a Newton step. If `by_ends`, the other columns are the
        responses to a unit change of each end value.

        Let Kᵢ be the integrals that give the rates w, w', … from k, and let Pᵢ be the derivatives
        of p with respect to these rates. Then

            p + Σ Pᵢ Kᵢ δk = Rᵀ(c + ĉ ε + δc),    ε = d + ∫ R K₀ δk dt,    ε(1) = 0.

        If the second equation is substituted into the first, 3 n + 3 equations for δk and δc
        remain. A change of the end values adds terms to d and p.
        """
        (R, _, c), (E, W, lacking, *rates) = unknowns, parts
        count, n = R.shape[:2]
        by, P = primitives(n, self.ends.shape[1]), self.functional.p_by(*rates)
        known, lacking = mending_turns(R, E, W)[..., None], lacking[..., None]
        if by_ends:
            effects = sum(by_ends_of(F, x) for F, x in zip(by.from_ends, P, strict=True))
            known = np.concatenate([known, _turns_by_ends(R, by.from_ends[0])], axis=-1)
            lacking = np.concatenate([lacking, effects], axis=-1)
        turned_by_k = _integrals(R, by.from_k[0])
        pull = R.mT @ hat(c)[:, None]
        system = np.zeros((count, 3 * n + 3, 3 * n + 3 + known.shape[-1]))
        by_k = -(pull @ turned_by_k).reshape(count, n, 3, n, 3)
        for Pi, K in zip(P, by.from_k, strict=True):
            if K is not by.from_k[-1]:
                by_k += Pi[:, :, :, None, :] * K[:, None, :, None]
            else:  # the identity
                each = np.arange(n)
                by_k[:, each, :, each, :] += Pi.swapaxes(0, 1)
        split, columns = 3 * n + 3, known.shape[-1]
        system[:, : 3 * n, : 3 * n] = by_k.reshape(count, 3 * n, 3 * n)
        system[:, : 3 * n, 3 * n : split] = -R.mT.reshape(count, 3 * n, 3)
        system[:, : 3 * n, split:] = (pull @ known - lacking).reshape(count, 3 * n, columns)
        system[:, 3 * n :, : 3 * n], system[:, 3 * n :, split:] = turned_by_k[:, -1], -known[:, -1]
        x = np.linalg.solve(system[:, :, :split], system[:, :, split:])
        by_x = turned_by_k.reshape(count, 3 * n, 3 * n) @ x[:, : 3 * n]
        turn = known + by_x.reshape(known.shape)
        return turn, x[:, : 3 * n].reshape(count, n, 3, columns), x[:, 3 * n :]

    def bend(self, unknowns: Arrays) -> Array:
        """Return k at the nodes."""
        return unknowns[1]

    def bend_by(self, unknowns: Arrays, responses: Arrays) -> Array:
        """Return the changes of k that belong to the `responses`."""
        return responses[1]

    def tails(self, unknowns: Arrays) -> Array:
        """Return the last coefficients of R or, if larger, the last relative coefficients of k."""
        R, k, _ = unknowns
        return np.maximum(tails(R), tails(k) / (SHARE * (1 + np.abs(k).max(axis=(1, 2)))))

    def solution(self, unknowns: Arrays) -> tuple[Array, Array, Array]:
        """Return k, c and the cost."""
        _, k, c = unknowns
        return k, c, costs(self.functional, self.ends, k)


def by_ends_of(from_ends: Array, matrices: Array) -> Array:
    """Multiply the matrices by the rates for unit end values; the shape is (N, n, 3, 3 m)."""
    products = matrices[..., None, :] * from_ends[:, None, :, None]
    return products.reshape(*products.shape[:3], -1)


def _turns_by_ends(R: Array, from_ends: Array) -> Array:
    """Return ∫ R δw dt at the nodes for a unit change of each end value."""
    return along(grid(R.shape[1]).integral, by_ends_of(from_ends, R))


def _integrals(R: Array, K: Array) -> Array:
    """Return the matrices that give ∫ R K x dt at each node from values x at the nodes."""
    count, n = R.shape[:2]
    entries = R.reshape(count, n, 9).mT[:, :, None]
    blocks_of_nodes = ((grid(n).integral * entries) @ K).reshape(count, 3, 3, n, n)
    return blocks_of_nodes.transpose(0, 3, 1, 4, 2).reshape(count, n, 3, 3 * n)


class BallStationary:
    """The equation R w'' = c; the unknowns are R at the nodes and c, and w'' = Rᵀc gives w.

    The linear systems are solved on a fixed number of nodes, `coarse`. This is 1.3 times as fast as
    `Stationary` for one problem, and 2.5 times as fast for stacks of 300.

    Source: BK (19).
    """

    def __init__(self, R0: Array, R1: Array, ends: Array, coarse: int = 17) -> None:
        self.R0, self.R1, self.ends, self.coarse = R0, R1, ends, coarse

    def take(self, index: Any) -> Self:
        """Return the equations of some of the problems."""
        return type(self)(self.R0[index], self.R1[index], self.ends[index], self.coarse)

    def first(self, R: Array) -> tuple[Array]:
        """Return the c for which w'' = Rᵀc fits w best."""
        nodes, by = grid(R.shape[1]), primitives(R.shape[1], 2)
        w = vee(R.mT @ along(nodes.derivative, R))
        lacking = (w - by.from_ends[0] @ self.ends).reshape(len(R), -1, 1)
        effect = along(by.from_k[0], R.mT).reshape(len(R), -1, 3)
        return (np.linalg.solve(effect.mT @ effect, effect.mT @ lacking)[..., 0],)

    def nodes(self, n: int) -> tuple[int, ...]:
        """Return n, and the numbers of nodes for 2, 4, 8 and 16 times as many intervals (≤ 257)."""
        return tuple((n - 1) * times + 1 for times in (1, 2, 4, 8, 16) if (n - 1) * times <= 256)

    def errors(self, unknowns: Arrays) -> tuple[Array, Arrays]:
        """Return the largest entry of R0 + ∫ R ŵ dt − R."""
        R, c = unknowns
        by = primitives(R.shape[1], 2)
        w = by.from_ends[0] @ self.ends + by.from_k[0] @ in_body(R, c)
        E, W = kinematic_error(self.R0, R, w)
        return np.abs(E).max(axis=(1, 2, 3)), (E, W)

    def responses(self, unknowns: Arrays, parts: Arrays, by_ends: bool = False) -> Arrays:
        """Return the turns ε of the nodes, and the change of c.

        The unknowns are R and c. Since w'' = Rᵀc, we have w = (1 − t) w0 + t w1 + K Rᵀc. If ε turns
        R, then Rᵀc changes by Rᵀ(ĉ ε + δc). To first order,

            ε = d + ∫ R K Rᵀ(ĉ ε + δc) dt,    ε(1) = 0.

        The equation is solved for ĉ ε on the `coarse` nodes. Then the right side gives ε on all
        nodes. The integrals smooth the error, so this ε is as accurate as a solution on all nodes.
        A change of the end values adds a term to d.
        """
        R, c = unknowns
        stride = (R.shape[1] - 1) // (self.coarse - 1)
        nodes, by = grid(R.shape[1]), primitives(R.shape[1], 2)
        Rt, known = np.ascontiguousarray(R.mT), mending_turns(R, *parts)[..., None]
        if by_ends:
            known = np.concatenate([known, _turns_by_ends(R, by.from_ends[0])], axis=-1)
        columns = known.shape[-1]
        coarse = _coarse_causes(R[:, ::stride], c, known[:, ::stride])
        causes = along(interpolation(coarse.shape[1], len(nodes.t)), coarse)
        causes[..., columns:] += np.eye(3)
        effects = along(nodes.integral, R @ along(by.from_k[0], Rt @ causes))
        effects[..., :columns] += known
        end = effects[:, -1]
        dc = -np.linalg.solve(end[..., columns:], end[..., :columns])
        return effects[..., :columns] + effects[..., columns:] @ dc[:, None], dc

    def bend(self, unknowns: Arrays) -> Array:
        """Return w'' = Rᵀc."""
        return in_body(*unknowns)

    def bend_by(self, unknowns: Arrays, responses: Arrays) -> Array:
        """Return Rᵀ(ĉ ε + δc)."""
        (R, c), (turn, dc) = unknowns, responses
        return R.mT @ (hat(c)[:, None] @ turn + dc[:, None])

    def tails(self, unknowns: Arrays) -> Array:
        """Return the last coefficients of R."""
        return tails(unknowns[0])

    def solution(self, unknowns: Arrays) -> tuple[Array, Array, Array]:
        """Return w'' at the nodes, c and the cost."""
        R, c = unknowns
        k = in_body(R, c)
        return k, c, costs(BallAcceleration(), self.ends, k)


def _coarse_causes(R: Array, c: Array, known: Array) -> Array:
    """Return ĉ ε at the nodes for each column of d, and for unit vectors δc.

    Only the two components of ε perpendicular to c matter. For each problem, they are the solution
    of one linear system.
    """
    count, n = R.shape[:2]
    nodes, twice, (across, ahead) = grid(n), primitives(n, 2).from_k[0], _across(c)
    rows, causes = ((x[:, None] @ R).reshape(count, 2 * n, 3) for x in (across, -ahead.mT))
    between = (rows @ causes.mT) * _for_each_entry(n)
    system = along(nodes.integral, between.reshape(count, n, -1)).reshape(count, 2 * n, 2 * n)
    np.einsum("...ii->...i", system)[...] += 1
    by_c = along(nodes.integral, R @ along(twice, R.mT))
    right = across[:, None] @ np.concatenate([known, by_c], axis=-1)
    columns = right.shape[-1]
    x = np.linalg.solve(system, right.reshape(count, 2 * n, columns))
    return ahead[:, None] @ x.reshape(count, n, 2, columns)


def _across(c: Array) -> tuple[Array, Array]:
    """Return unit vectors e₁, e₂ perpendicular to c as rows, and c × e₁, c × e₂ as columns.

    The rows, shape (N, 2, 3), belong to the Householder reflection that maps c to the third axis.
    """
    v = scaled(c, axis=-1)  # otherwise squares of small numbers could underflow
    v[:, 2] += np.copysign(np.sqrt(np.sum(v * v, axis=-1)), v[:, 2])
    square = np.sum(v * v, axis=-1)
    twice = v * (2 / np.where(square == 0, 1, square))[:, None]
    across = np.eye(2, 3) - v[:, :2, None] * twice[:, None]
    return across, hat(c) @ across.mT


@lru_cache
def _for_each_entry(n: int) -> Array:
    """Return the matrix of the twofold integral; each entry is repeated in a 2 × 2 block."""
    return np.kron(primitives(n, 2).from_k[0], np.ones((2, 2)))
