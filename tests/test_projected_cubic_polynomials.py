"""Polynomials through given ends."""

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from rbcourse.projected_cubic import cubic_coefficients, polynomial, quintic_coefficients
from rbcourse.rivals import hermite

RNG = np.random.default_rng(62)
EPS = np.finfo(float).eps


@pytest.mark.source("BK 6.2")
def test_both_meet_their_ends():
    x0, x1, v0, v1, a0, a1 = RNG.normal(size=(6, 5, 3, 3))
    cubic = cubic_coefficients(x0, x1, v0, v1)
    quintic = quintic_coefficients(x0, x1, v0, v1, a0, a1)
    for coefficients, ends in ((cubic, [x0, v0, x1, v1]), (quintic, [x0, v0, a0, x1, v1, a1])):
        orders = len(ends) // 2
        for t, wanted in ((0.0, ends[:orders]), (1.0, ends[orders:])):
            for order, want in enumerate(wanted):
                got = polynomial(coefficients, np.array(t), order)
                assert np.abs(got - want).max() < 2000 * EPS


@pytest.mark.source("BK 6.2")
def test_the_cubic_is_the_papers():
    R0, R1, V0, V1 = RNG.normal(size=(4, 3, 3))
    printed = [R0, V0, -3 * R0 + 3 * R1 - 2 * V0 - V1, 2 * R0 - 2 * R1 + V0 + V1]
    assert np.abs(cubic_coefficients(R0, R1, V0, V1) - printed).max() < 20 * EPS


@pytest.mark.parametrize(
    ("make", "count", "order"), [(cubic_coefficients, 4, 2), (quintic_coefficients, 6, 3)]
)
@pytest.mark.source("BK 6")
def test_both_are_optimal(make, count, order):
    """The derivative that counts is orthogonal to that of any change which keeps the ends."""
    best = Polynomial(make(*RNG.normal(size=count))).deriv(order)
    keeps_ends = Polynomial([0, 1, -1]) ** order
    for k in range(5):
        change = (keeps_ends * Polynomial.basis(k)).deriv(order)
        product = (best * change).integ()
        assert abs(product(1) - product(0)) < 10 * EPS * np.abs(product.coef).sum()


def test_ends_and_times_broadcast():
    coefficients = cubic_coefficients(np.zeros(3), np.ones((4, 3)), np.zeros(3), np.zeros(3))
    assert coefficients.shape == (4, 4, 3)
    assert polynomial(coefficients, np.zeros((7, 1, 1)), 1).shape == (7, 4, 3)


@pytest.mark.source("BK 6.2")
def test_the_cubic_by_its_ends_is_that_of_its_coefficients():
    ends, t = RNG.normal(size=(4, 3, 3)), np.linspace(0, 1, 9)[:, None, None]
    coefficients = cubic_coefficients(*ends)
    scale = np.abs(coefficients).sum(axis=0).max()
    for order in (0, 1, 2):
        want = polynomial(coefficients, t, order)
        assert np.abs(hermite(ends, t, order) - want).max() < 20 * EPS * scale


@pytest.mark.source("BK 6.2")
def test_the_cubic_by_its_ends_meets_them_exactly_however_they_differ_in_size():
    for sizes in ([1, 1, 1, 1], [1e-200, 1, 1e9, 1e-9], [1e-9, 1e200, 1, 1e100]):
        ends = RNG.normal(size=(4, 5)) * np.reshape(sizes, (4, 1))
        for t, value, rate in ((0.0, ends[0], ends[2]), (1.0, ends[1], ends[3])):
            assert np.array_equal(hermite(ends, np.array(t)), value)
            assert np.array_equal(hermite(ends, np.array(t), 1), rate)


def test_its_derivatives_are_complex_steps():
    ends, t = RNG.normal(size=4), np.linspace(0, 1, 9)
    scale = np.abs(cubic_coefficients(*ends)).sum()
    for order in (0, 1):
        step = hermite(ends, t + 1e-100j, order).imag / 1e-100
        assert np.abs(hermite(ends, t, order + 1) - step).max() < 40 * EPS * scale


def test_it_takes_numbers_and_ends_that_broadcast_with_the_times():
    assert hermite([0, 1, 0, 0], np.array(0.5)) == 0.5
    ends = [np.zeros(3), np.ones((4, 3)), 0, np.zeros(3)]
    assert hermite(ends, np.zeros((7, 1, 1)), 2).shape == (7, 4, 3)


def test_the_cubic_of_its_ends_has_two_derivatives():
    with pytest.raises(ValueError, match=r"^order: 0, 1 or 2 wanted, got 3"):
        hermite([0, 1, 0, 0], np.array([0.5]), 3)
