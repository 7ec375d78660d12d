"""What is read off the atlas: excesses over the optimum, their quantiles, words for them."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from rbcourse._numerics import Array
from rbcourse.optimum import Ends
from rbcourse.so3 import log_so3
from rbcourse.study.atlas import CELLS, FAMILIES, FASTEST

NEAR_ZERO = 1e-4
"""What costs less than this share of ‖σ‖² + ‖w0‖² + ‖w1‖² is not divided by."""


def near_zero(ends: Ends, optimum: Array) -> NDArray[np.bool_]:
    """Tell which optima cost so little, in view of their ends, that no ratio says anything.

    Parameters
    ----------
    ends : Ends
        N problems.
    optimum : ndarray, shape (N,)
        What they cost.

    Returns
    -------
    ndarray of bool, shape (N,)
    """
    sigma = log_so3(ends.R0.mT @ ends.R1)
    return optimum < NEAR_ZERO * sum(np.sum(x**2, axis=-1) for x in (sigma, ends.w0, ends.w1))


def excesses(ends: Ends, found: Mapping[str, Array]) -> dict[str, Array]:
    """Return the costs over the optimum, minus 1; NaN where it is near zero, or not found.

    Parameters
    ----------
    ends : Ends
        N problems.
    found : mapping of str to ndarray, shape (N,)
        See `atlas.survey`.

    Returns
    -------
    dict of str to ndarray, shape (N,)
    """
    optimum = np.where(near_zero(ends, found["optimum"]), np.nan, found["optimum"])
    return {way: cost / optimum - 1 for way, cost in found.items() if way != "optimum"}


def cell_table(excess: Mapping[str, Array], draws: int, share: float) -> dict[str, Array]:
    """Return a quantile of the excess in each cell of the atlas, as a table.

    Parameters
    ----------
    excess : mapping of str to ndarray, shape (2 * 10 * 10 * draws,)
        See `excesses`, of `atlas.atlas_problems`.
    draws : int
        How many there are in each cell.
    share : float
        Which quantile: 0.5 for the median.

    Returns
    -------
    dict of str to ndarray, shape (2 * 10 * 10,)
        Family, the middle of the cell, how many problems count, and a `quantile` for each way.
    """
    family, turn, speed = np.indices((2, CELLS, CELLS)).reshape(3, -1)
    cells = {way: x.reshape(-1, draws) for way, x in excess.items()}
    return {
        "family": np.array(FAMILIES)[family],
        "displacement [rad]": (turn + 0.5) * np.pi / CELLS,
        "end velocity [rad]": (speed + 0.5) * FASTEST / CELLS,
        "problems [1]": np.sum(~np.isnan(next(iter(cells.values()))), axis=-1),
        **{f"{way} excess [1]": quantile(x, share) for way, x in cells.items()},
    }


def quantile(x: Array, share: float) -> Array:
    """Return the smallest of the numbers that `share` of them do not pass.

    Parameters
    ----------
    x : ndarray, shape (..., N)
        Numbers; NaN does not count.
    share : float
        From 0 to 1.

    Returns
    -------
    ndarray, shape (...)
        With four digits, and eight decimals at most.

    Examples
    --------
    >>> float(quantile(np.array([3.0, 1.23456, np.nan, 0.1]), 0.5))
    1.235
    """
    ordered, count = np.sort(x, axis=-1), np.sum(~np.isnan(x), axis=-1, keepdims=True)  # NaN last
    place = np.maximum(np.ceil(share * count).astype(int) - 1, 0)
    return rounded(np.take_along_axis(ordered, place, axis=-1)[..., 0])


def rounded(x: Array) -> Array:
    """Return numbers with four digits, and eight decimals at most."""
    return np.vectorize(lambda y: round(float(f"{y:.4g}"), 8) + 0.0, otypes=[float])(x)


def in_words(excess: float) -> str:
    """Return an excess as text: in percent, or how many times the optimum.

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
