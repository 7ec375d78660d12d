"""Functions on [0, 1], given by values at Chebyshev–Lobatto nodes or by Chebyshev series."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple, cast

import numpy as np

from rbcourse._hermite import hermite
from rbcourse._numerics import Array


class Grid(NamedTuple):
    """Nodes, and matrices that act on values at the nodes.

    The matrix `derivative` gives the derivative at the nodes, `integral` the integral from 0 to
    each node, and `series` the Chebyshev coefficients.
    """

    t: Array
    derivative: Array
    integral: Array
    series: Array


class Primitives(NamedTuple):
    """Matrices that give x, x', … x⁽ᵐ⁾ from k = x⁽ᵐ⁾ at the nodes and the m end values of x.

    At the nodes x⁽ⁱ⁾ = from_ends[i] @ ends + from_k[i] @ k; no derivative of k is needed. Here x is
    the m-fold integral of k plus the polynomial of least degree that corrects the ends. The
    matrices `series_from_ends` and `series_from_k` give the Chebyshev coefficients of x⁽ⁱ⁾ in the
    same way. The matrix `fit` gives a smooth k for an x with zero end values.
    """

    from_ends: list[Array]
    from_k: list[Array]
    series_from_ends: list[Array]
    series_from_k: list[Array]
    fit: Array


def chebyshev(t: Array, count: int) -> Array:
    """Return the first `count` Chebyshev polynomials on [0, 1] at the times t."""
    from numpy.polynomial.chebyshev import chebvander

    return cast(Array, chebvander(2 * t - 1, count - 1))


@lru_cache
def grid(n: int) -> Grid:
    """Return the grid of n nodes; its bits do not depend on the number of BLAS threads."""
    from numpy.polynomial.chebyshev import chebder, chebint

    k = np.arange(n)
    t = (1 - np.cos(np.pi * k / (n - 1))) / 2
    weight = np.where((k == 0) | (k == n - 1), 0.5, 1.0)
    cosines = np.cos(np.pi / (n - 1) * (np.outer(k, k) % (2 * n - 2)))
    series = 2 / (n - 1) * (-1.0) ** k[:, None] * np.outer(weight, weight) * cosines
    slopes, sums = chebder(series, scl=2), chebint(series, lbnd=-1, scl=0.5)
    derivative, integral = (_product(chebyshev(t, len(c)), c) for c in (slopes, sums))
    return Grid(*map(_shared, (t, derivative, integral, series)))


def _product(A: Array, B: Array) -> Array:
    """Return A B without BLAS, whose rounding depends on the number of threads."""
    return np.einsum("ij,jk->ik", A, B)


@lru_cache
def primitives(n: int, m: int) -> Primitives:
    """Return the matrices for n nodes and m end values: x at 0 and 1, and for m = 4 also x'."""
    from numpy.polynomial.chebyshev import chebint

    nodes, few, each = grid(n), grid(m), list(np.eye(m)[:, None])
    polynomial = [_product(few.series, hermite(each, few.t[:, None], i)) for i in range(m)]
    integral = [cast(Array, chebint(nodes.series, m - i, lbnd=-1, scl=0.5)) for i in range(m)]
    ends = np.concatenate(
        [_product(chebyshev(few.t[[0, -1]], len(c)), c) for c in integral[: m // 2]]
    )
    series_from_ends = [np.pad(c, ((0, n - i), (0, 0))) for i, c in enumerate(polynomial)]
    series_from_k = [c - _product(p, ends) for c, p in zip(integral, series_from_ends, strict=True)]
    from_ends, from_k = (
        [_product(chebyshev(nodes.t, len(c)), c) for c in series]
        for series in (series_from_ends, series_from_k)
    )
    smooth = chebyshev(nodes.t, max(3, n // 2))
    return Primitives(
        [*map(_shared, from_ends), _shared(np.zeros((n, m)))],
        [*map(_shared, from_k), _shared(np.eye(n))],
        [*map(_shared, series_from_ends), _shared(np.zeros((n, m)))],
        [*map(_shared, series_from_k), nodes.series],
        _shared(smooth @ np.linalg.pinv(from_k[0] @ smooth)),
    )


def _shared(matrix: Array) -> Array:
    """Make the matrix read-only, since all callers share it."""
    matrix.flags.writeable = False
    return matrix


@lru_cache
def interpolation(few: int, many: int) -> Array:
    """Return the matrix that maps values at `few` nodes to values at `many` nodes."""
    return _product(chebyshev(grid(many).t, few), grid(few).series)


def along(matrix: Array, values: Array) -> Array:
    """Multiply values at the nodes, shape (N, n, ...), by the matrix."""
    count, n, *core = values.shape
    columns = values.reshape(count, n, math.prod(core))
    return (matrix @ columns).reshape(count, len(matrix), *core)


def tails(values: Array) -> Array:
    """Estimate the truncation error by the larger of the last two Chebyshev coefficients."""
    last = np.abs(along(grid(values.shape[1]).series[-2:], values))
    return last.max(axis=tuple(range(1, last.ndim)))
