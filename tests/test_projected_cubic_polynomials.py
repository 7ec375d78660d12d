"""Polynomials through given ends."""

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from rbcourse._hermite import hermite
from rbcourse.textbook import cubic_coefficients, polynomial

RNG = np.random.default_rng(62)
EPS = np.finfo(float).eps


@pytest.mark.source("BK 6.2")
@pytest.mark.parametrize(
    "sizes", [[1] * 6, [1e-200, 1, 1e9, 1e-9, 1, 1e12], [1, 1e200, 1, 1, 1, 1]]
)
@pytest.mark.parametrize("count", [2, 4, 6])
def test_the_ends_are_met_exactly_however_they_differ_in_size(count, sizes):
    ends = (RNG.normal(size=(6, 5)) * np.reshape(sizes, (6, 1)))[:count]
    for order in range(count // 2):
        for t in (0, 1):
            assert np.array_equal(hermite(ends, np.array(float(t)), order), ends[2 * order + t])


@pytest.mark.source("BK 6.2")
@pytest.mark.parametrize("count", [2, 4, 6])
def test_it_is_a_polynomial_of_least_degree(count):
    """Through its own values at as many times goes one polynomial, which is it everywhere."""
    ends, t = RNG.normal(size=count), np.linspace(0, 1, 21)
    series = np.polynomial.Chebyshev.fit(t, hermite(ends, t), count - 1, domain=[0, 1])
    for order in (0, 1, 2):
        want = series.deriv(order)(t) if order else series(t)
        assert np.abs(hermite(ends, t, order) - want).max() < 1e4 * EPS * np.abs(ends).sum()


@pytest.mark.source("BK 6.2")
def test_the_cubic_is_the_papers():
    R0, R1, V0, V1 = RNG.normal(size=(4, 3, 3))
    printed = [R0, V0, -3 * R0 + 3 * R1 - 2 * V0 - V1, 2 * R0 - 2 * R1 + V0 + V1]
    assert np.abs(cubic_coefficients(R0, R1, V0, V1) - printed).max() < 20 * EPS


@pytest.mark.source("BK 6.2")
def test_the_cubic_by_its_ends_is_that_of_its_coefficients():
    ends, t = RNG.normal(size=(4, 3, 3)), np.linspace(0, 1, 9)[:, None, None]
    coefficients = cubic_coefficients(*ends)
    for order in (0, 1, 2):
        want = polynomial(coefficients, t, order)
        assert np.abs(hermite(ends, t, order) - want).max() < 200 * EPS * np.abs(ends).max()


@pytest.mark.parametrize("count", [2, 4, 6])
@pytest.mark.source("BK 6")
def test_all_are_optimal(count):
    """The derivative that counts is orthogonal to that of any change which keeps the ends."""
    ends, order = RNG.normal(size=count), count // 2
    t = (1 + np.cos(np.pi * np.arange(9) / 8)) / 2
    best = Polynomial.fit(t, hermite(ends, t), count - 1).convert().deriv(order)
    keeps_ends = Polynomial([0, 1, -1]) ** order
    for k in range(5):
        change = (keeps_ends * Polynomial.basis(k)).deriv(order)
        product = (best * change).integ()
        assert abs(product(1) - product(0)) < 1e4 * EPS * np.abs(product.coef).sum()


def test_where_little_changes_the_rates_are_as_exact():
    """From 1e6 to 1e6 and a billionth: no cancellation."""
    x1, t = 1e6 + 2.0**-30, np.linspace(0, 1, 9)
    for count in (2, 4, 6):
        ends = [1e6, x1, *np.zeros(count - 2)]
        want = hermite([0, x1 - 1e6, *np.zeros(count - 2)], t, 1)
        assert np.abs(hermite(ends, t, 1) - want).max() < 8 * EPS * (x1 - 1e6)


@pytest.mark.parametrize("count", [2, 4, 6])
def test_its_derivatives_are_complex_steps(count):
    ends, t = RNG.normal(size=count), np.linspace(0, 1, 9)
    for order in (0, 1):
        step = hermite(ends, t + 1e-100j, order).imag / 1e-100
        off = np.abs(hermite(ends, t, order + 1) - step)
        assert off.max() < 400 * EPS * np.abs(ends).sum()


def test_it_takes_numbers_and_ends_that_broadcast_with_the_times():
    assert hermite([0, 1, 0, 0], np.array(0.5)) == 0.5
    ends = [np.zeros(3), np.ones((4, 3)), 0, np.zeros(3)]
    assert hermite(ends, np.zeros((7, 1, 1)), 2).shape == (7, 4, 3)


def test_the_cubic_of_its_ends_has_three_derivatives():
    with pytest.raises(ValueError, match=r"^order: 0, 1, 2 or 3 wanted, got 4"):
        hermite([0, 1, 0, 0], np.array([0.5]), 4)


def test_an_odd_number_of_ends_makes_no_polynomial():
    for order in (0, 2):
        with pytest.raises(ValueError, match=r"^ends: two, four or six wanted, got 3"):
            hermite([0, 1, 2], np.array([0.5]), order)
