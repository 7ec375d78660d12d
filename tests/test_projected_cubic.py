"""Projected cubics and quintics, and the polynomials that they are projections of."""

import warnings

import numpy as np
import oracles
import pytest
from numpy.polynomial import Chebyshev, Polynomial
from scipy.spatial.transform import Rotation

import rbcourse as rb
from rbcourse._hermite import hermite
from rbcourse.textbook import cubic_coefficients, polynomial

EPS = np.finfo(float).eps
RNG = np.random.default_rng(62)
N = 60
R0, R1 = (Rotation.random(N, rng=RNG).as_matrix() for _ in range(2))
W0, W1, B0, B1 = 4 * RNG.normal(size=(4, N, 3))
TIMES, REST = np.linspace(0, 1, 41), np.zeros(3)


def cubic_of_matrices(t, order=0):
    """M(t) of BK 6.2 or a derivative."""
    rates = R0 @ rb.hat_so3(W0), R1 @ rb.hat_so3(W1)
    return polynomial(cubic_coefficients(R0, R1, *rates), t[:, None, None, None], order)


CUBICS = rb.projected_cubic_so3(R0, R1, W0, W1)
QUINTICS = rb.projected_quintic_so3(R0, R1, W0, W1, B0, B1)
GAPS = oracles.two_smallest_eigenvalues(CUBICS(TIMES).mT @ cubic_of_matrices(TIMES))


@pytest.mark.source("BK 6", "BK 6.2", "BK Prop. 2")
def test_the_cubic_is_projected_to_the_nearest_rotation():
    R, M = CUBICS(TIMES), cubic_of_matrices(TIMES)
    S = R.mT @ M
    scale = np.linalg.norm(CUBICS.ends, axis=(-2, -1)).sum(axis=-1)
    assert np.abs(R.mT @ R - np.eye(3)).max() < 20 * EPS
    assert np.abs(np.linalg.det(R) - 1).max() < 20 * EPS
    assert np.all(np.abs(S - S.mT).max(axis=(-2, -1)) < 10 * EPS * scale)
    assert GAPS.min() > 0


@pytest.mark.source("BK 6.2")
def test_where_the_determinant_is_negative_the_curve_is_right_and_smooth():
    reflected = (np.linalg.det(cubic_of_matrices(TIMES)) < 0).any(axis=0)
    assert 5 < reflected.sum() < N
    t = np.linspace(0, 1, 2001)
    some = rb.projected_cubic_so3(R0[reflected], R1[reflected], W0[reflected], W1[reflected])
    steps = np.linalg.norm(rb.log_so3(some(t[:-1]).mT @ some(t[1:])), axis=-1)
    speed = np.linalg.norm(some((t[1:] + t[:-1]) / 2, 1), axis=-1)
    clear = some.margin > 0.1
    assert clear.sum() > 3
    assert np.abs(steps / (t[1] * speed) - 1)[:, clear].max() < 0.01


@pytest.mark.source("BK 6.2", "errata 11")
def test_the_ends_are_met_to_their_rounding():
    for curve in (CUBICS, QUINTICS):
        scale = np.linalg.norm(curve.ends, axis=(-2, -1)).sum(axis=-1)[:, None]
        for t, R, w in ((0, R0, W0), (1, R1, W1)):
            assert np.all(np.abs(curve(t) - R).max(axis=-1) < 4 * EPS * scale)
            assert np.all(np.abs(curve(t, 1) - w) < 40 * EPS * scale)
    for t, a in ((0, B0), (1, B1)):
        assert np.all(np.abs(QUINTICS(t, 2) - a) < 1000 * EPS * scale)


@pytest.mark.source("errata 11")
def test_the_printed_end_condition_and_group_do_not_hold():
    """The second derivative at the end is not the one that is prescribed; and R0 ŵ0 is singular."""
    M0, M1, V0, V1 = np.moveaxis(CUBICS.ends, -3, 0)
    M2, M3 = 3 * (M1 - M0) - 2 * V0 - V1, V0 + V1 - 2 * (M1 - M0)
    missed = np.abs(2 * M2 + 6 * M3 - R1 @ rb.hat_so3(W1)).max(axis=(-2, -1))
    assert np.all(missed > 0.1)
    assert np.abs(np.linalg.det(V0)).max() < 1e-13 * 64


@pytest.mark.parametrize(("degrees", "times"), [(20, 1.002), (60, 1.17), (90, 2.31), (120, 11.56)])
def test_the_quintic_is_not_of_least_jerk(degrees, times):
    """About one axis least jerk is a quintic in the angle: 720 angle² from rest to rest."""
    angle = np.radians(degrees)
    curve = rb.projected_quintic_so3(np.eye(3), rb.exp_so3([0, 0, angle]), *[REST] * 4)
    t = np.linspace(0, 1, 4001)
    jerk = np.gradient(curve(t, 2)[:, 2], t, edge_order=2)
    assert np.trapezoid(jerk**2, t) / (720 * angle**2) == pytest.approx(times, rel=2e-3)


@pytest.mark.source("BK 6.1")
def test_the_projected_line_has_the_ends_of_a_cubic_and_a_quintic_that_project_to_it():
    """They are the line times a positive number ρ(t), which the projection does not see."""
    line = rb.projected_line_so3(R0, R0 @ rb.exp_so3([0.3, -0.4, 1.2]))
    ends = [line(t, order) for order in (0, 1, 2) for t in (0, 1)]
    for curve in (rb.projected_cubic_so3(*ends[:4]), rb.projected_quintic_so3(*ends)):
        for order in (0, 1, 2):
            assert np.abs(curve(TIMES, order) - line(TIMES, order)).max() < 1e-13


@pytest.mark.source("BK Prop. 3", "BK Prop. 5")
def test_moved_and_reversed_ends_give_the_moved_and_reversed_curve():
    """Moved from both sides. The bound is the claim, 1e-12 over the margin."""
    L, Q = Rotation.random(2, rng=5).as_matrix()
    ends, rates = (L @ R0 @ Q, L @ R1 @ Q), np.array([W0, W1, B0, B1]) @ Q
    for moved, curve, want in (
        (rb.projected_cubic_so3(*ends, *rates[:2]), CUBICS, L @ CUBICS(TIMES) @ Q),
        (rb.projected_quintic_so3(*ends, *rates), QUINTICS, L @ QUINTICS(TIMES) @ Q),
        (rb.projected_cubic_so3(R1, R0, -W1, -W0), CUBICS, CUBICS(1 - TIMES)),
    ):
        off = np.abs(moved(TIMES) - want).max(axis=(0, -2, -1))
        assert np.all(off < 1e-12 / np.minimum(curve.margin, 1))


def test_the_margin_is_the_least_gap():
    t = np.linspace(0, 1, 4001)
    gap = oracles.two_smallest_eigenvalues(CUBICS(t).mT @ cubic_of_matrices(t)).min(axis=0)
    speed = np.linalg.norm(cubic_of_matrices(t, 1), axis=(-2, -1)).max(axis=0)
    assert np.all(CUBICS.margin <= gap + 1e-14)
    assert np.all(gap - CUBICS.margin < 2 * speed * t[1])


def test_a_margin_of_zero_is_told_and_the_time_of_the_jump_is_refused():
    """From rest to rest over a half-turn: the cubic runs through a matrix of rank 1."""
    half = np.diag([1.0, -1, -1])
    with pytest.warns(RuntimeWarning, match=r"^margin < 1e-6: below 1e-12 at t = 0\.5; .* jumps"):
        curve = rb.projected_cubic_so3(np.eye(3), half, REST, REST)
    assert curve.margin < 8 * EPS
    assert np.abs(curve([0, 0.3, 0.7, 1]) - [np.eye(3), np.eye(3), half, half]).max() < 80 * EPS
    pair = np.stack([np.eye(3), half])
    with pytest.warns(RuntimeWarning, match=r"of curve \[1\]: .* at t = 0\.5; "):
        curves = rb.projected_quintic_so3(np.eye(3), pair, REST, REST, REST, REST)
    assert np.abs(curves.margin - [2, 0]).max() < 8 * EPS
    goals = np.tile(np.eye(3), (2, 3, 1, 1))
    goals[1, 2] = half
    with pytest.warns(RuntimeWarning, match=r"of curve \[1, 2\]"):
        stack = rb.projected_cubic_so3(np.eye(3), goals, REST, REST)
    for order in (0, 1, 2):
        for one, name in ((curve, ""), (curves, r" of curve \[1\]")):
            with pytest.raises(ValueError, match=rf"^t = 0\.5{name}: the nearest rotation is not"):
                one([0.3, 0.5], order)
        assert np.isfinite(stack(np.linspace(0, 0.4, 4000), order)).all()
        for k in (0, 833, 834, 3999):
            times = np.where(np.arange(4000) == k, 0.5, np.linspace(0, 0.4, 4000))
            for t in (times, times.reshape(40, 100)):
                with pytest.raises(ValueError, match=r"^t = 0\.5 of curve \[1, 2\]: the nearest"):
                    stack(t, order)


@pytest.mark.parametrize("short_of", [1e-3, 1e-5, 1e-7, 1e-9])
def test_near_the_singular_set_it_is_right_or_warned_of(short_of):
    """Just short of a half-turn the margin is 2 cos(a/2), the curve right to eps over the gap."""
    turn = np.array([0, 0, np.pi - short_of])
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        curve = rb.projected_cubic_so3(np.eye(3), rb.exp_so3(turn), REST, REST)
    assert abs(curve.margin - 2 * np.sin(short_of / 2)) < 20 * EPS
    assert bool(warned) == (curve.margin < 1e-6)
    for t in (0.4, 0.5 + short_of, 0.6):
        share = 3 * t**2 - 2 * t**3
        gap = 2 * oracles.line_singular_value(share, turn[2])
        want = oracles.theta(share, turn[2]) * turn[2]
        assert abs(rb.log_so3(curve(t))[2] - want) < 40 * EPS / gap


def through_the_centre(t, k1):
    """Ends about one axis whose cubic, as a complex number z, runs through 0 at the time t.

    z(0) = 1, z'(0) = i k0, z(1) = exp(ia), z'(1) = i k1 exp(ia): with Hermite's basis,
    z(t) = h00 + i k0 h10 + exp(ia) (h01 + i k1 h11) = 0 fixes k0 and a.
    """
    h00, h01, h10, h11 = (hermite(one, np.array(t)) for one in np.eye(4))
    k0 = np.sqrt(h01**2 + (k1 * h11) ** 2 - h00**2) / h10
    a = np.angle(-(h00 + 1j * k0 * h10) / (h01 + 1j * k1 * h11))
    return np.eye(3), rb.exp_so3([0, 0, a]), [0, 0, k0], [0, 0, k1]


@pytest.mark.parametrize("k", [40, 45, 50, 55])
@pytest.mark.parametrize("fast", [5, 40])
def test_a_jump_between_the_sampled_times_is_found(k, fast):
    """Half way between two of 65 times, and of 129 too."""
    t = (k + 0.25) / 64
    with pytest.warns(RuntimeWarning, match="jumps there"):
        curve = rb.projected_cubic_so3(*through_the_centre(t, fast))
    assert curve.margin < 1e-12


@pytest.mark.parametrize("order", [0, 1, 2])
def test_the_time_at_which_f_is_no_number_is_named(order):
    def timing(t, order):
        value = np.full_like(t, order == 1) if order else t.copy()
        if t.size > 2:
            value[t == np.linspace(0, 1, 6001)[5000]] = np.nan
        return value

    line = rb.projected_line_so3(np.eye(3), rb.exp_so3([0, 1, 0]), timing)
    with pytest.raises(ValueError, match=r"^t = 0\.8333\d*: f\(t, 0\) is not a finite"):
        line(np.linspace(0, 1, 6001), order)


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
def test_it_is_a_polynomial_of_least_degree_and_its_derivatives(count):
    """Through its own values at as many times goes one polynomial, which is it everywhere."""
    ends, t = RNG.normal(size=count), np.linspace(0, 1, 21)
    series = Chebyshev.fit(t, hermite(ends, t), count - 1, domain=[0, 1])
    assert np.abs(hermite(ends, t) - series(t)).max() < 1e4 * EPS * np.abs(ends).sum()
    for order in (0, 1, 2):
        step = hermite(ends, t + 1e-100j, order).imag / 1e-100
        off = np.abs(hermite(ends, t, order + 1) - step).max()
        assert off < (400 if order < 2 else 4000) * EPS * np.abs(ends).sum()


@pytest.mark.source("BK 6.2")
def test_the_cubic_is_that_of_the_papers_coefficients():
    ends, t = RNG.normal(size=(4, 3, 3)), np.linspace(0, 1, 9)[:, None, None]
    R0, R1, V0, V1 = ends
    printed = [R0, V0, -3 * R0 + 3 * R1 - 2 * V0 - V1, 2 * R0 - 2 * R1 + V0 + V1]
    assert np.abs(cubic_coefficients(*ends) - printed).max() < 20 * EPS
    for order in (0, 1, 2):
        off = hermite(ends, t, order) - polynomial(cubic_coefficients(*ends), t, order)
        assert np.abs(off).max() < 200 * EPS * np.abs(ends).max()


@pytest.mark.parametrize("count", [2, 4, 6])
@pytest.mark.source("BK 6")
def test_the_polynomial_is_optimal(count):
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


def test_other_numbers_of_ends_and_higher_derivatives_are_refused():
    for order in (0, 2):
        with pytest.raises(ValueError, match=r"^ends: two, four or six wanted, got 3"):
            hermite([0, 1, 2], np.array([0.5]), order)
    with pytest.raises(ValueError, match=r"^order: 0, 1, 2 or 3 wanted, got 4"):
        hermite([0, 1, 0, 0], np.array([0.5]), 4)
