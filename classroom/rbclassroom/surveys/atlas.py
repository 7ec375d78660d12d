"""The atlas: a survey of the problems and bodies for which a closed form is near the optimum."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

import rbcourse as rb
from rbcourse import Array, Curve, Ends, exp_so3, sample_rotation
from rbcourse.draw.save import FORMS
from rbcourse.metrics import weight_from_inertia
from rbcourse.sampling import Rng

Maker = Callable[[Array, Array, Array, Array], Curve]

CELLS = 10
"""The number of steps into which the atlas divides the displacement and the end velocity."""
FASTEST = 9.0
"""The largest √(‖w0‖² + ‖w1‖²) of the atlas, in rad per unit time."""
FAMILIES = "along", "across"
"""Directions of the end velocities in lesson 12: along the displacement's axis, or across it."""

NEAR_ZERO = 1e-4
"""Excesses are not computed if the optimum costs less than this share of ‖σ‖² + ‖w0‖² + ‖w1‖²."""


def projection(R0: Array, R1: Array, w0: Array, w1: Array) -> rb.ProjectedPolynomial:
    """Return the stack of `projected_cubic_so3`, without the slow computation of its margins."""
    M = R0, R1, R0 @ rb.hat_so3(w0), R1 @ rb.hat_so3(w1)
    ends = np.stack(np.broadcast_arrays(*M), axis=-3)
    return rb.ProjectedPolynomial(duration=np.ones(ends.shape[:-3]), ends=ends)


WAYS: dict[str, Maker] = {**FORMS, "projection": projection}
"""The closed forms for a ball, with their names in figures and tables."""


def closed_forms(inertia: ArrayLike | None = None) -> dict[str, Maker]:
    """Return the closed forms that are compared for a body.

    If an inertia is given, "weighted" (`weighted_cubic_so3`) and "normal" (`normal_cubic_so3`) are
    added to `WAYS`.
    """
    if inertia is None:
        return WAYS
    makers = {"weighted": _weighted, "normal": rb.normal_cubic_so3}
    return WAYS | {way: partial(make, inertia=inertia) for way, make in makers.items()}


def _weighted(R0: Array, R1: Array, w0: Array, w1: Array, inertia: ArrayLike) -> Curve:
    W, cubic = weight_from_inertia(inertia), projection(R0, R1, w0, w1)
    return replace(cubic, ends=cubic.ends @ (3 * W / np.trace(W)))


def atlas_problems(draws: int, families: Sequence[str] = FAMILIES, *, rng: Rng = None) -> Ends:
    """Return `draws` random problems in every cell of the atlas.

    A cell is a family, a step of the displacement ‖σ‖ from 0 to π, and a step of the end velocity v
    = √(‖w0‖² + ‖w1‖²) from 0 to `FASTEST`. Within a cell, ‖σ‖ and v are uniform. A random angle
    divides v between w0 and w1. In the family "along", both velocities point along the axis of σ or
    against it. In "across", each velocity has a random direction perpendicular to the axis; in
    "any", it has any random direction. The problems are sorted by family, displacement, end
    velocity and draw. R0 and the axis of σ are uniform, too.

    Examples
    --------
    >>> atlas_problems(3, rng=1).w0.shape
    (600, 3)
    """
    draws, rng = _as_count("draws", draws), np.random.default_rng(rng)
    unknown = set(families) - {"along", "across", "any"}
    if unknown or not families:
        raise ValueError(f"families: along, across or any is wanted, got {sorted(unknown)}")
    family, turn, speed = np.indices((len(families), CELLS, CELLS, draws))[:3].reshape(3, -1)
    count = len(family)
    angle = (turn + rng.random(count)) * np.pi / CELLS
    v = (speed + rng.random(count)) * FASTEST / CELLS
    share, *spins = 2 * np.pi * rng.random((3, count))
    frames, R0 = sample_rotation(count, rng=rng), sample_rotation(count, rng=rng)
    axis, first, second = np.moveaxis(frames, -1, 0)

    velocities = []
    for size, spin in zip((v * np.cos(share), v * np.sin(share)), spins, strict=True):
        across = np.cos(spin)[:, None] * first + np.sin(spin)[:, None] * second
        ways = {"along": axis, "across": across}
        if "any" in families:
            ways["any"] = sample_rotation(count, rng=rng)[..., 0]
        direction = np.choose(family[:, None], [ways[name] for name in families])
        velocities.append(size[:, None] * direction)
    return Ends(R0, R0 @ exp_so3(angle[:, None] * axis), *velocities)


def random_problems(count: int, size: float, *, rng: Rng = None) -> Ends:
    """Return random problems: σ in a ball of radius `size`, w0 and w1 in a ball of radius 2 `size`.

    Examples
    --------
    >>> ends = random_problems(1000, 0.5, rng=1)
    >>> bool(np.linalg.norm(ends.w0, axis=-1).max() < 1)
    True
    """
    count, rng = _as_count("count", count), np.random.default_rng(rng)
    if not isinstance(size, int | float) or not 0 < size <= np.pi:
        raise ValueError(f"size: a number above 0 and at most π is wanted, got {size}")
    radii = size * np.array([[1.0], [2.0], [2.0]]) * np.cbrt(rng.random((3, count)))
    directions = rng.standard_normal((3, count, 3))
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    sigma, w0, w1 = radii[..., None] * directions
    R0 = sample_rotation(count, rng=rng)
    return Ends(R0, R0 @ exp_so3(sigma), w0, w1)


def _as_count(name: str, value: int) -> int:
    if not isinstance(value, int | np.integer) or value < 1:
        raise ValueError(f"{name}: an integer from 1 up is wanted, got {value!r}")
    return int(value)


def starts() -> dict[str, Maker]:
    """Return initial guesses of Newton's method, to see how the result depends on the guess.

    The guesses are the exponential cubic that turns the long way round, and all closed forms except
    two. If the Cayley cubic is far from the optimum, the method seldom converges from this guess.
    The corrected Bézier curve leads to the same result as the Bézier curve.
    """
    return {way: make for way, make in WAYS.items() if way not in ("Cayley", "corrected")} | {
        "long way round": rb.exponential_cubic_long_so3
    }


def defects(make: Maker, ends: Ends, *, rng: Rng = None) -> dict[str, float]:
    """Return how far curves are from being invariant when their ends are moved or exchanged.

    The values are the largest angles in rad over all problems at 33 values of t, for random
    rotations L and Q (BK Prop. 3). "left" compares L R(t) with the curve of the ends moved by L,
    "right" compares R(t) Q with the curve of the ends moved by Q, and "reversed" compares R(1 − t)
    with the curve of the exchanged ends.
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
    return {name: float(rb.angle_between(A, curve(t)).max()) for name, (A, curve) in pairs.items()}


def near_zero(ends: Ends, optimum: Array, inertia: ArrayLike | None = None) -> NDArray[np.bool_]:
    """Tell which optima have a cost that is too small for ratios of costs.

    The cost is compared with ‖σ‖² + ‖w0‖² + ‖w1‖², where ‖x‖² denotes ½ xᵀ G x. For a ball,
    G = 2 I.
    """
    half = np.eye(3) if inertia is None else np.asarray(inertia) / 2
    sigma = rb.log_so3(ends.R0.mT @ ends.R1)
    size = sum(np.sum(x * (x @ half), axis=-1) for x in (sigma, ends.w0, ends.w1))
    return optimum < NEAR_ZERO * size


def excesses(
    ends: Ends, found: Mapping[str, Array], inertia: ArrayLike | None = None
) -> dict[str, Array]:
    """Return the excesses in a survey: each cost divided by the optimum's cost, minus 1.

    The excess is NaN if the optimum is near zero or was not found.
    """
    lost = near_zero(ends, found["optimum"], inertia)
    optimum = np.where(lost, np.nan, found["optimum"])
    return {way: cost / optimum - 1 for way, cost in found.items() if way != "optimum"}


def cell_table(
    excess: Mapping[str, Array], draws: int, share: float, families: Sequence[str] = FAMILIES
) -> dict[str, Array]:
    """Return the quantile `share` of `excesses` in each cell of `atlas_problems`, as a table.

    The table has a row for each cell. Its columns are the family, the middle of the cell, the
    number of problems that count, and a `quantile` for each closed form.
    """
    family, turn, speed = np.indices((len(families), CELLS, CELLS)).reshape(3, -1)
    cells = {way: x.reshape(-1, draws) for way, x in excess.items()}
    return {
        "family": np.array(families)[family],
        "displacement [rad]": (turn + 0.5) * np.pi / CELLS,
        "end velocity [rad]": (speed + 0.5) * FASTEST / CELLS,
        "problems [1]": np.sum(~np.isnan(next(iter(cells.values()))), axis=-1),
        **{f"{way} excess [1]": quantile(x, share) for way, x in cells.items()},
    }


def quantile(x: Array, share: float, decimals: int = 8) -> Array:
    """Return the least y such that a fraction `share` of x, along the last axis, is at most y.

    NaN does not count. The result is rounded to four digits, and to at most `decimals` decimals.

    Examples
    --------
    >>> float(quantile(np.array([3.0, 1.23456, np.nan, 0.1]), 0.5))
    1.235
    """
    return rounded(np.nanquantile(x, share, axis=-1, method="inverted_cdf"), decimals)


def rounded(x: Array, decimals: int = 8) -> Array:
    """Return numbers rounded to four digits, and to at most `decimals` decimals."""
    return np.vectorize(lambda y: round(float(f"{y:.4g}"), decimals) + 0.0, otypes=[float])(x)


def in_words(excess: float) -> str:
    """Return an excess as text, in percent or as a multiple of the optimum.

    Examples
    --------
    >>> [in_words(x) for x in (-1e-12, 3.141e-3, 0.5, 46.2, 1e9, -0.3, np.nan)]
    ['< 0.01 %', '0.31 %', '50 %', '47 ×', '> 10⁴ ×', '−30 %', '–']
    """
    if np.isnan(excess):
        return "–"
    if excess < -1e-4:
        return f"−{-100 * excess:.2g} %"
    if excess < 1e-4:
        return "< 0.01 %"
    if excess < 10:
        return f"{100 * excess:.2g} %" if excess < 0.1 else f"{100 * excess:.0f} %"
    return f"{1 + excess:.0f} ×" if excess < 1e4 else "> 10⁴ ×"
