"""The optimum by relaxation: Newton's method on the whole curve at once."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbcourse._numerics import Array, blocks
from rbcourse.motions import RigidMotion, cubic_ends
from rbcourse.optimum import (
    COARSE,
    Ends,
    Failure,
    Guess,
    MinimumAcceleration,
    Solution,
    along,
    chebyshev,
    defects,
    first_guess,
    grid,
    hats,
    orthogonal,
    solve,
    tails,
    vees,
)

STEPS = 25
EXACT = 3e-12  # what may be left of the equation, and of R in the last Chebyshev coefficients
LONGEST_STEP = 0.5
ROUGH = 1e-2  # rad: with shorter steps the fewest nodes are left
_BLOCK = 128  # problems whose linear systems fit into the cache together


def minimum_acceleration_so3(
    R0: ArrayLike, R1: ArrayLike, w0: ArrayLike, w1: ArrayLike
) -> MinimumAcceleration:
    """Return the minimum-acceleration curve with these ends, by relaxation.

    Parameters
    ----------
    R0, R1 : array_like, shape (..., 3, 3)
        Rotation matrices at t = 0 and 1; of what is none, the nearest rotation (`project_so`).
    w0, w1 : array_like, shape (..., 3)
        Angular velocities there, body frame, in rad per unit time.

    Returns
    -------
    MinimumAcceleration
        A `Curve`, or a stack of them, that meets all four ends and solves w''' + w × w'' = 0. Its
        ``converged``, ``residual``, ``iterations`` and ``nodes`` tell how it was found, and ``c``
        is the constant R w''.

    Raises
    ------
    ValueError
        If an argument is not finite, not of that shape, or the batches do not broadcast.
    ConvergenceError
        For a single problem, if Newton's method does not converge from either of two guesses. None
        in ten thousand for ‖w0‖, ‖w1‖ < 12; one draw in thirty up to 30.

    Warns
    -----
    RuntimeWarning
        For a stack, if that happens to some: there the curve is NaN and ``converged`` False.

    See Also
    --------
    rbcourse.textbook.minimum_acceleration_so3 : The equation, and SciPy's `solve_bvp`.
    shoot_minimum_acceleration_so3 : The same by shooting.
    projected_cubic_so3 : Its near-optimal stand-in, in closed form.
    acceleration_cost : What both cost.

    Notes
    -----
    Singular set: none is known in closed form. (19) is necessary, not sufficient, and has several
    solutions: a turn by σ and one by σ ± 2π reach the same rotation. Newton's method starts from
    `cumulative_bezier_so3`, its middle leg turned the short way or the other, whichever curve costs
    less; where that is in doubt from both, and the better is returned. It is stationary, and not
    proven to be the best.

    End velocities along the geodesic give R0 exp(σ̂ p(t)), with p a cubic and σ a logarithm of
    R0ᵀR1: the shortest, or one that turns the other way round or once more; as a rule because that
    costs less.

    References
    ----------
    BK (19), BK 6.2, BK Prop. 7.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> R1 = exp_so3([0, 0, 1.5])
    >>> c = minimum_acceleration_so3(np.eye(3), R1, [0, 0, 0], [0, 1, 0])
    >>> c([0, 1], 1).round(9) + 0.0
    array([[0., 0., 0.],
           [0., 1., 0.]])
    >>> c.residual < 1e-12
    True
    """
    return solve(relax, R0, R1, w0, w1)


def minimum_acceleration_se3(
    A0: ArrayLike,
    A1: ArrayLike,
    w0: ArrayLike,
    w1: ArrayLike,
    d0_dot: ArrayLike,
    d1_dot: ArrayLike,
) -> RigidMotion:
    """Return the minimum-acceleration motion: the optimum on SO(3), and a cubic in R³.

    Parameters
    ----------
    A0, A1 : array_like, shape (..., 4, 4)
        Poses at t = 0 and 1; of what is none, the nearest pose (`project_se`).
    w0, w1 : array_like, shape (..., 3)
        Angular velocities there, body frame, in rad per unit time.
    d0_dot, d1_dot : array_like, shape (..., 3)
        Velocities of the origin there, *fixed* frame, in m per unit time.

    Returns
    -------
    RigidMotion
        A `Curve`: its ``rotation`` is `minimum_acceleration_so3`.

    Raises
    ------
    ValueError
        If an argument is not finite, not of that shape, or the batches do not broadcast.
    ConvergenceError
        As `minimum_acceleration_so3`.

    Warns
    -----
    RuntimeWarning
        As `minimum_acceleration_so3`.

    See Also
    --------
    projected_cubic_se3 : Its near-optimal stand-in, in closed form.

    Notes
    -----
    In metric (14) rotation and translation do not know of each other, so each has its own optimum.

    References
    ----------
    BK 6.3.

    Examples
    --------
    >>> from rbcourse import pose_from_coordinates
    >>> A1, rest = pose_from_coordinates([0, 0, 1, 2, 0, 0]), [0, 0, 0]
    >>> c = minimum_acceleration_se3(np.eye(4), A1, rest, rest, rest, rest)
    >>> c(0.5)[:3, 3].round(9)
    array([1., 0., 0.])
    """
    R0, R1, path = cubic_ends(A0, A1, w0, w1, d0_dot, d1_dot)
    return RigidMotion(minimum_acceleration_so3(R0, R1, w0, w1), path)


def relax(ends: Ends, guess: Guess) -> list[Solution | Failure]:
    """Solve (19) for a stack, from 17 nodes on; what fails, from 33 nodes on."""
    found: list[Solution | Failure] = []
    for block in blocks(len(ends.w0), _BLOCK):
        found += _refine(ends.of(block), guess(COARSE)[block])
    failed = [i for i, solution in enumerate(found) if isinstance(solution, Failure)]
    for block in blocks(len(failed), _BLOCK):
        again = np.array(failed[block])
        for i, solution in zip(again, _refine(ends.of(again), guess(33)[again]), strict=True):
            found[i] = solution
    return found


def _refine(ends: Ends, R: Array) -> list[Solution | Failure]:
    """Solve (19) roughly on the nodes of a guess, then on ever more, until they carry the curve."""
    found: list[Solution | Failure] = [Failure(np.inf, 0)] * len(R)
    intervals = R.shape[1] - 1
    R, c = first_guess(ends, R)
    rough = _newton(_State(np.arange(len(R)), ends, R, c, np.zeros(len(R), int)), 1, found)
    stride = 1
    while rough and stride < 16:
        stride *= 2
        R = orthogonal(along(_interpolation(rough.R.shape[1], intervals * stride + 1), rough.R))
        R[:, 0], R[:, -1] = rough.ends.R0, rough.ends.R1
        rough = _newton(rough._replace(R=R), stride, found)
    return found


class _State(NamedTuple):
    """How far the problems are that are still worked at, and which they are."""

    which: NDArray[np.intp]
    ends: Ends
    R: Array
    c: Array
    steps: NDArray[np.intp]

    def of(self, part: NDArray[np.bool_]) -> "_State":
        """Return some of them."""
        if part.all():
            return self
        which, ends, R, c, steps = self
        return _State(which[part], ends.of(part), R[part], c[part], steps[part])


def _joined(states: list[_State]) -> _State:
    which, ends, R, c, steps = zip(*states, strict=True)
    joined = Ends(*(np.concatenate(array) for array in zip(*ends, strict=True)))
    return _State(np.concatenate(which), joined, *map(np.concatenate, (R, c, steps)))


def _newton(now: _State, stride: int, found: list[Solution | Failure]) -> _State | None:
    """Improve R and c, no node turned about any axis of the frame by more than half a rad at once.

    What is solved, or fails, is written into `found`; what wants more nodes is returned.
    """
    size = before = np.full(len(now.R), np.inf)
    finer = []
    for _ in range(STEPS):
        E, W = defects(now.ends, now.R, now.c)
        left = np.abs(E).max(axis=(1, 2, 3))
        left[np.isnan(left)] = np.inf
        if stride == 1:
            solved, enough = np.zeros(len(left), bool), size < ROUGH
        else:
            tail, stalled = tails(now.R), (size < 1e-6) & (left > before / 2)
            solved = (tail < EXACT) & (left < EXACT)
            enough = (stalled | (tail > EXACT) & (size < 1e3 * tail)) & ~solved
        done = solved | enough | ~np.isfinite(left)
        if done.any():
            for i in np.flatnonzero(done):
                outcome = float(left[i]), int(now.steps[i])
                found[now.which[i]] = (
                    Solution(now.R[i], now.c[i], *outcome) if solved[i] else Failure(*outcome)
                )
            if enough.any():
                finer.append(now.of(enough))
            if done.all():
                break
            now, E, W, left, size = now.of(~done), E[~done], W[~done], left[~done], size[~done]
        turn, dc = _newton_step(now.R, now.c, E, W, stride)
        size, before = np.abs(turn).max(axis=(1, 2)), left
        share = LONGEST_STEP / np.maximum(size, LONGEST_STEP)
        R, c = _turned(now.R, share[:, None, None] * turn), now.c + share[:, None] * dc
        now = _State(now.which, now.ends, R, c, now.steps + 1)
    else:
        for k, where in enumerate(now.which):
            found[where] = Failure(float(left[k]), int(now.steps[k]))
    return _joined(finer) if len(finer) > 1 else next(iter(finer), None)


def _turned(R: Array, turn: Array) -> Array:
    """Return the rotations R turned, in the fixed frame, by Cayley's formula: 2 tan(a/2) for a."""
    H = hats(turn)
    share = 1 / (1 + np.sum(turn**2, axis=-1) / 4)
    HR = H @ R
    return R + share[..., None, None] * (HR + H @ HR / 2)


def _newton_step(R: Array, c: Array, E: Array, W: Array, stride: int) -> tuple[Array, Array]:
    """Return the turns ε of the nodes, in the fixed frame, and the change of c.

    With w'' = Rᵀc, so w = (1 − t) w0 + t w1 + G Rᵀc, the unknowns are R and c. The equation is
    R' = R ŵ in integral form; its defect is E = R0 + ∫ R ŵ − R. When ε turns R, Rᵀc changes by
    Rᵀ(ĉ ε + dc), and to first order

        ε = d + ∫ R G Rᵀ (ĉ ε + dc),    d = vee(E Rᵀ + ∫ E ŵ Rᵀ),

    with ε = 0 at the end. It is solved for ĉ ε on every `stride`-th node; the integrals smooth so
    much that the right side, worked out on all nodes, is as good as a solution on all of them.
    """
    nodes, Rt = grid(R.shape[1]), np.ascontiguousarray(R.mT)  # faster to multiply with
    defect = vees(E @ Rt + along(nodes.integral, E @ W @ Rt))
    coarse = _coarse_causes(R[:, ::stride], c, defect[:, ::stride])
    causes = along(_interpolation(coarse.shape[1], len(nodes.t)), coarse)
    causes[..., 1:] += np.eye(3)
    effects = along(nodes.integral, R @ along(nodes.twice, Rt @ causes))
    effects[..., 0] += defect
    dc = -np.linalg.solve(effects[:, -1, :, 1:], effects[:, -1, :, :1])[..., 0]
    return effects[..., 0] + (effects[..., 1:] @ dc[:, None, :, None])[..., 0], dc


def _coarse_causes(R: Array, c: Array, defect: Array) -> Array:
    """Return ĉ ε that comes from d and from each unit of dc, at the nodes, shape (N, n, 3, 4).

    Only the two components of ε across c count: a linear system for each problem, for these.
    """
    count, n = R.shape[:2]
    nodes, (across, ahead) = grid(n), _across(c)
    rows, causes = ((x[:, None] @ R).reshape(count, 2 * n, 3) for x in (across, -ahead.mT))
    between = (rows @ causes.mT) * _for_each_entry(n)
    system = along(nodes.integral, between.reshape(count, n, -1)).reshape(count, 2 * n, 2 * n)
    np.einsum("...ii->...i", system)[...] += 1
    by_c = along(nodes.integral, R @ along(nodes.twice, R.mT))
    right = across[:, None] @ np.concatenate([defect[..., None], by_c], axis=-1)
    x = np.linalg.solve(system, right.reshape(count, 2 * n, 4)).reshape(count, n, 2, 4)
    return ahead[:, None] @ x


def _across(c: Array) -> tuple[Array, Array]:
    """Return two unit vectors across c as rows, shape (N, 2, 3), and c × both as columns.

    They are rows of Householder's reflection that takes c to the third axis.
    """
    v = c.copy()
    v[:, 2] += np.copysign(np.sqrt(np.sum(c * c, axis=-1)), c[:, 2])
    square = np.sum(v * v, axis=-1)
    twice = v * (2 / np.where(square == 0, 1, square))[:, None]
    across = np.eye(2, 3) - v[:, :2, None] * twice[:, None]
    return across, hats(c) @ across.mT


@lru_cache
def _for_each_entry(n: int) -> Array:
    """Return `twice` with each number in a 2 × 2 block of its own."""
    return np.kron(grid(n).twice, np.ones((2, 2)))


@lru_cache
def _interpolation(few: int, many: int) -> Array:
    """Return the matrix that goes from the values at some nodes to those at more."""
    return chebyshev(grid(many).t, few) @ grid(few).series
