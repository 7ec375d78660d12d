"""What near-optimal curves cost above the optimum, for thousands of boundary conditions."""

import os
import warnings
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from rbcourse._numerics import Array, Rng, as_count, as_generator, as_single, blocks
from rbcourse.curves import BlockwiseCurve, Curve
from rbcourse.optimum import Ends, MinimumAcceleration, from_curve, grid
from rbcourse.polynomials import cubic_coefficients
from rbcourse.projected import ProjectedPolynomial
from rbcourse.quaternion_curves import (
    Bezier,
    ExponentialCubic,
    bezier_legs,
    other_way,
    to_given,
)
from rbcourse.relaxation import minimum_acceleration_so3, relax
from rbcourse.rivals import (
    bezier_so3,
    cayley_cubic_so3,
    cumulative_bezier_so3,
    exponential_cubic_so3,
    quaternion_cubic_so3,
)
from rbcourse.sampling import sample_rotation
from rbcourse.so3 import exp_so3, hat_so3, log_so3

Maker = Callable[[Array, Array, Array, Array], BlockwiseCurve]
Report = Callable[[int, int], object]

CELLS = 10
"""Into so many steps the atlas divides the displacement and the end velocity."""
FASTEST = 9.0
"""The largest √(‖w0‖² + ‖w1‖²) of the atlas, in rad per unit time."""
FAMILIES = "along", "across"
"""Where the end velocities of the atlas point: along the axis of the displacement, or across."""

_PART = 1000  # problems between two reports
_PANELS = 2000  # panels that are worked out together


def projection(R0: Array, R1: Array, w0: Array, w1: Array) -> ProjectedPolynomial:
    """Return the stack of `projected_cubic_so3`, without a warning of any of its margins."""
    V0, V1 = R0 @ hat_so3(w0), R1 @ hat_so3(w1)
    return ProjectedPolynomial(cubic_coefficients(R0, R1, V0, V1))


WAYS: dict[str, Maker] = {
    "projection": projection,
    "exponential": exponential_cubic_so3,
    "Bézier": bezier_so3,
    "cumulative": cumulative_bezier_so3,
    "quaternion": quaternion_cubic_so3,
    "Cayley": cayley_cubic_so3,
}
"""The closed forms that are compared, with the names that figures and tables have for them."""


def atlas_problems(draws: int, *, rng: Rng = None) -> Ends:
    """Return random problems in every cell of the atlas.

    A cell is a family, a step of the displacement ‖σ‖ from 0 to π, and a step of the end velocity
    v = √(‖w0‖² + ‖w1‖²) from 0 to `FASTEST`; within it both are uniform. v is shared out between
    w0 and w1 by a random angle. "along": both point along the axis of σ or against it; "across":
    each in a random direction across it.

    Parameters
    ----------
    draws : int
        How many in each cell.
    rng : Generator, int or None, optional
        Where the numbers come from; a seed gives the same ones each time.

    Returns
    -------
    Ends
        2 × 10 × 10 × draws problems: family, displacement, end velocity, draw.

    Raises
    ------
    ValueError
        If `draws` is no integer from 1 up, or `rng` makes no numbers.

    Examples
    --------
    >>> atlas_problems(3, rng=1).w0.shape
    (600, 3)
    """
    draws, rng = as_count("draws", draws), as_generator(rng)
    family, turn, speed = np.indices((2, CELLS, CELLS, draws))[:3].reshape(3, -1)
    count = len(family)
    angle = (turn + rng.random(count)) * np.pi / CELLS
    v = (speed + rng.random(count)) * FASTEST / CELLS
    share, *spins = 2 * np.pi * rng.random((3, count))
    frames, R0 = sample_rotation(count, rng=rng), sample_rotation(count, rng=rng)
    axis, first, second = np.moveaxis(frames, -1, 0)
    w0, w1 = (
        size[:, None]
        * np.where(
            family[:, None] == 0,
            axis,
            np.cos(spin)[:, None] * first + np.sin(spin)[:, None] * second,
        )
        for size, spin in zip((v * np.cos(share), v * np.sin(share)), spins, strict=True)
    )
    return Ends(R0, R0 @ exp_so3(angle[:, None] * axis), w0, w1)


def random_problems(count: int, size: float, *, rng: Rng = None) -> Ends:
    """Return random problems: σ in a ball of the radius `size`, w0 and w1 in one of twice that.

    Parameters
    ----------
    count : int
        How many.
    size : float
        The radius in rad, above 0 and at most π.
    rng : Generator, int or None, optional
        Where the numbers come from.

    Returns
    -------
    Ends

    Raises
    ------
    ValueError
        If `count` is no integer from 1 up, `size` is another, or `rng` makes no numbers.

    Examples
    --------
    >>> ends = random_problems(1000, 0.5, rng=1)
    >>> bool(np.linalg.norm(ends.w0, axis=-1).max() < 1)
    True
    """
    count, rng, radius = as_count("count", count), as_generator(rng), as_single("size", size)
    if not 0 < radius <= np.pi:
        raise ValueError(f"size: a number above 0 and at most π is wanted, got {size}")
    radii = radius * np.array([[1.0], [2.0], [2.0]]) * np.cbrt(rng.random((3, count)))
    directions = rng.standard_normal((3, count, 3))
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    sigma, w0, w1 = radii[..., None] * directions
    R0 = sample_rotation(count, rng=rng)
    return Ends(R0, R0 @ exp_so3(sigma), w0, w1)


def survey(
    ends: Ends, report: Report | None = None, ways: Mapping[str, Maker] = WAYS
) -> dict[str, Array]:
    """Return what the optimum costs, and what each of the closed forms does.

    Parameters
    ----------
    ends : Ends
        N problems.
    report : callable, optional
        ``report(done, total)`` is told now and then how many problems are done.
    ways : mapping of str to callable, optional
        What is compared: makers of stacks of curves, with names.

    Returns
    -------
    dict of str to ndarray, shape (N,)
        ∫ 2 ‖w'‖² dt of the "optimum", NaN where it is not found, and under their names of the
        others, to about 1e-7 relative.

    Raises
    ------
    ValueError
        If a curve is not defined for some ends, or at a time at which it is evaluated.

    References
    ----------
    BK 1, BK (18), BK 7.
    """
    parts = list(blocks(len(ends.w0), _PART)) or [slice(0, 0)]

    def solve(part: slice) -> Array:
        some = ends.of(part)
        best = np.asarray(minimum_acceleration_so3(*some).cost)
        return np.stack([best, *(costs(make, some) for make in ways.values())])

    found = _side_by_side(solve, parts, report)
    return dict(zip(("optimum", *ways), np.concatenate(found, axis=-1), strict=True))


def costs(make: Maker, ends: Ends) -> Array:
    """Return ∫ 2 ‖w'‖² dt of many curves, each to about 1e-7 relative.

    Each has panels of its own: one on which the rules of Clenshaw and Curtis with 9 and 17 nodes
    differ by 1e-6 of the cost is halved.

    Parameters
    ----------
    make : callable
        ``make(R0, R1, w0, w1)`` returns a stack of curves.
    ends : Ends
        N problems.

    Returns
    -------
    ndarray, shape (N,)

    Raises
    ------
    ValueError
        As `survey`.

    See Also
    --------
    acceleration_cost : To 1e-10, for any curve.

    References
    ----------
    BK (18).

    Examples
    --------
    >>> ends = random_problems(2, 1, rng=1)
    >>> from rbcourse import acceleration_cost
    >>> bool(np.allclose(costs(projection, ends), acceleration_cost(projection(*ends)), rtol=1e-6))
    True
    """
    count, nodes, few = len(ends.w0), grid(17), grid(9)
    cost, which = np.zeros(count), np.repeat(np.arange(count), 2)
    start, width = np.tile([0.0, 0.5], count), np.full(2 * count, 0.5)
    while len(which):
        squares = np.empty((len(nodes.t), len(which)))
        for part in blocks(len(which), _PANELS):
            curves = make(*ends.of(which[part]))
            times = start[part] + nodes.t[:, None] * width[part]
            squares[:, part] = np.sum(curves.at_own_times(times, 2) ** 2, axis=-1)
        value = 2 * width * (nodes.integral[-1] @ squares)
        rough = 2 * width * (few.integral[-1] @ squares[::2])
        expected = cost + np.bincount(which, value, count)
        halved = (np.abs(value - rough) > 1e-6 * expected[which]) & (width > 1e-9)
        cost += np.bincount(which[~halved], value[~halved], count)
        which, start, width = (np.repeat(x[halved], 2) for x in (which, start, width / 2))
        start[1::2] += width[1::2]
    return cost


def several_starts(ends: Ends, report: Report | None = None) -> dict[str, Array]:
    """Return what the curves cost that Newton's method finds from several guesses.

    The guesses are the closed forms but Cayley's, which seldom leads anywhere when it is far off,
    and the exponential cubic the long way round. What is found is stationary; none is proven to be
    the best.

    Parameters
    ----------
    ends : Ends
        N problems.
    report : callable, optional
        See `survey`.

    Returns
    -------
    dict of str to ndarray, shape (N,)
        The costs, NaN where nothing is found; by the name of the guess.

    References
    ----------
    BK (19).
    """
    starts = {way: make for way, make in WAYS.items() if way != "Cayley"}
    starts["long way round"] = long_way_round
    parts = list(blocks(len(ends.w0), _PART)) or [slice(0, 0)]

    def solve(part: slice) -> Array:
        some = ends.of(part)
        return np.stack([_cost_from(some, make(*some)) for make in starts.values()])

    found = _side_by_side(solve, parts, report)
    return dict(zip(starts, np.concatenate(found, axis=-1), strict=True))


def long_way_round(R0: Array, R1: Array, w0: Array, w1: Array) -> ExponentialCubic:
    """Return the exponential cubics that turn the other way round, by 2π − ‖σ‖."""
    given = to_given(R0, R1, w0, w1)
    return ExponentialCubic(given, other_way(log_so3(given.turn)))


def bezier_other_way(R0: Array, R1: Array, w0: Array, w1: Array) -> Bezier:
    """Return the Bézier curves whose middle legs turn the other way round; they must not be 0."""
    given = to_given(R0, R1, w0, w1)
    first, middle, last = bezier_legs(given)
    return Bezier(given, (first, other_way(middle), last))


def defects(make: Maker, ends: Ends, *, rng: Rng = None) -> dict[str, float]:
    """Return by how much curves differ when their ends are moved, or exchanged.

    Parameters
    ----------
    make : callable
        As for `costs`.
    ends : Ends
        N problems.
    rng : Generator, int or None, optional
        Where the rotations L and Q come from.

    Returns
    -------
    dict of str to float
        The largest angle in rad, over all problems and 33 times, between L R(t) and the curve of
        the "left"-moved ends, R(t) Q and that of the "right"-moved ones, and R(1 − t) and that of
        the "reversed" ones.

    References
    ----------
    BK Prop. 3.
    """
    R0, R1, w0, w1 = ends
    L, Q = sample_rotation(2, rng=rng)
    t = np.linspace(0, 1, 33)
    R = make(*ends)(t)
    pairs = {
        "left": (L @ R, make(L @ R0, L @ R1, w0, w1)),
        "right": (R @ Q, make(R0 @ Q, R1 @ Q, w0 @ Q, w1 @ Q)),
        "reversed": (R[::-1], make(R1, R0, -w1, -w0)),
    }
    return {name: _largest_angle(A, curve(t)) for name, (A, curve) in pairs.items()}


def _largest_angle(A: Array, B: Array) -> float:
    return float(np.linalg.norm(log_so3(A.mT @ B), axis=-1).max())


def _cost_from(ends: Ends, guess: Curve) -> Array:
    with np.errstate(over="ignore", invalid="ignore"):
        solutions = relax(ends, from_curve(guess))
    return np.asarray(MinimumAcceleration(ends, solutions, (len(ends.w0),)).cost)


def _side_by_side(
    work: Callable[[slice], Array], parts: list[slice], report: Report | None
) -> list[Array]:
    """Return the work on each part, done in as many threads as there are processors."""
    found = []
    with warnings.catch_warnings(), ThreadPoolExecutor(os.cpu_count()) as pool:
        warnings.filterwarnings("ignore", ".*did not converge", RuntimeWarning)  # it is NaN
        try:
            for part, result in zip(parts, pool.map(work, parts), strict=True):
                found.append(result)
                if report:
                    report(part.stop, parts[-1].stop)
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    return found
