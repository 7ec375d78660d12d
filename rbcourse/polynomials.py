"""Polynomials through given ends, in any vector space: numbers, vectors, matrices."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._numerics import Array, check_order


def cubic_coefficients(x0: Array, x1: Array, v0: Array, v1: Array) -> Array:
    """Return the cubic on [0, 1] with values x0, x1 and derivatives v0, v1 at its ends.

    It is the minimum-acceleration curve: of all curves with these ends it has the least
    ∫ ‖x''‖² dt.

    Parameters
    ----------
    x0, x1, v0, v1 : ndarray
        They broadcast.

    Returns
    -------
    ndarray, shape (4, ...)
        The coefficients of 1, t, t², t³.

    References
    ----------
    BK 6.2.

    Examples
    --------
    >>> cubic_coefficients(0.0, 1.0, 0.0, 0.0)
    array([ 0.,  0.,  3., -2.])
    """
    gap = x1 - x0
    return _stack(x0, v0, 3 * gap - 2 * v0 - v1, v0 + v1 - 2 * gap)


def hermite(ends: Sequence[ArrayLike], t: Array, order: int = 0) -> Array:
    """Return that cubic, or one of its first two derivatives, at the times t.

    Written by its ends, it meets them exactly, however they differ in size.

    Parameters
    ----------
    ends : sequence of array_like
        x0, x1, v0, v1, as for `cubic_coefficients`.
    t : ndarray
        The times; they broadcast with the ends.
    order : {0, 1, 2}, optional
        Which derivative.

    Returns
    -------
    ndarray

    Raises
    ------
    ValueError
        If `order` is another.

    References
    ----------
    BK 6.2.

    Examples
    --------
    >>> hermite([0, 1, 0, 0], np.array([0.0, 0.5, 1.0]))
    array([0. , 0.5, 1. ])
    """
    check_order(order)
    weights: list[Array]
    s = 1 - t
    if order == 0:
        weights = [s * s * (1 + 2 * t), t * t * (1 + 2 * s), t * s * s, -t * t * s]
    elif order == 1:
        weights = [-6 * t * s, 6 * t * s, s * (1 - 3 * t), t * (1 - 3 * s)]
    else:
        weights = [6 * (t - s), 6 * (s - t), 2 - 6 * s, 6 * t - 2]
    first, *others = (w * x for w, x in zip(weights, map(np.asarray, ends), strict=True))
    return sum(others, first)


def quintic_coefficients(x0: Array, x1: Array, v0: Array, v1: Array, a0: Array, a1: Array) -> Array:
    """Return the quintic on [0, 1] with given values, first and second derivatives at its ends.

    It is the minimum-jerk curve: of all curves with these ends it has the least ∫ ‖x'''‖² dt.

    Parameters
    ----------
    x0, x1, v0, v1, a0, a1 : ndarray
        They broadcast.

    Returns
    -------
    ndarray, shape (6, ...)
        The coefficients of 1, t, …, t⁵.

    References
    ----------
    BK 6.

    Examples
    --------
    >>> quintic_coefficients(0.0, 1.0, 0.0, 0.0, 0.0, 0.0)
    array([  0.,   0.,   0.,  10., -15.,   6.])
    """
    gap = x1 - x0 - v0 - a0 / 2
    speed = v1 - v0 - a0
    bend = a1 - a0
    return _stack(
        x0,
        v0,
        a0 / 2,
        10 * gap - 4 * speed + bend / 2,
        -15 * gap + 7 * speed - bend,
        6 * gap - 3 * speed + bend / 2,
    )


def polynomial(coefficients: Array, t: Array, order: int = 0) -> Array:
    """Return a polynomial, or one of its derivatives, at the times t.

    Parameters
    ----------
    coefficients : ndarray, shape (degree + 1, ...)
        Of 1, t, t², ….
    t : ndarray
        The times; they broadcast with one coefficient.
    order : int, optional
        Which derivative.

    Returns
    -------
    ndarray

    Examples
    --------
    >>> polynomial(np.array([1.0, 2.0, 3.0]), np.array([0.0, 1.0]), 1)
    array([2., 8.])
    """
    for _ in range(order):
        powers = np.arange(len(coefficients)).reshape(-1, *(1,) * (coefficients.ndim - 1))
        coefficients = (powers * coefficients)[min(1, len(coefficients) - 1) :]
    value: Array = np.array(coefficients[-1] + 0.0 * t)
    for coefficient in coefficients[-2::-1]:  # Horner's scheme
        value *= t
        value += coefficient
    return value[()]


def _stack(*coefficients: Array) -> Array:
    return np.stack(np.broadcast_arrays(*coefficients))
