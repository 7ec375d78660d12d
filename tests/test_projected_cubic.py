"""Test projected cubics and quintics, and the polynomials that are projected."""

import tracemalloc

import numpy as np
import oracles
import pytest
from numpy.polynomial import Polynomial
from scipy.spatial.transform import Rotation

import rbcourse as rb
from rbcourse._polynomials import hermite
from rbcourse.curves.ends import Ends
from rbcourse.curves.projected import (
    _may_almost_jump,
    bound_of_margin,
    polynomial,
)

EPS = np.finfo(float).eps
RNG = np.random.default_rng(62)
N = 60
R0, R1 = (Rotation.random(N, RNG).as_matrix() for _ in range(2))
W0, W1 = 4 * RNG.normal(size=(2, N, 3))
TIMES, I3, REST = np.linspace(0, 1, 41), np.eye(3), np.zeros(3)
CUBICS = rb.projected_cubic(R0, R1, W0, W1)
V0, V1 = R0 @ rb.hat_so3(W0), R1 @ rb.hat_so3(W1)
PRINTED = [R0, V0, -3 * R0 + 3 * R1 - 2 * V0 - V1, 2 * R0 - 2 * R1 + V0 + V1]


def cubic_of_matrices(t):
    """Return M(t), with the coefficients that BK 6.2 prints."""
    return sum(M * t[:, None, None, None] ** k for k, M in enumerate(PRINTED))


def gaps(t):
    return oracles.two_smallest_eigenvalues(CUBICS(t).mT @ cubic_of_matrices(t))


@pytest.mark.source("BK 6", "BK 6.2", "BK Prop. 2")
def test_the_cubic_is_projected_to_the_nearest_rotation():
    """The projected curve is correct and smooth even where the determinant of M is negative."""
    R, M = CUBICS(TIMES), cubic_of_matrices(TIMES)
    S = R.mT @ M
    scale = np.linalg.norm(CUBICS.ends, axis=(-2, -1)).sum(axis=-1)
    assert np.abs(R.mT @ R - I3).max() < 20 * EPS
    assert np.abs(np.linalg.det(R) - 1).max() < 20 * EPS
    assert np.all(np.abs(S - S.mT).max(axis=(-2, -1)) < 10 * EPS * scale)
    assert gaps(TIMES).min() > 0
    reflected = (np.linalg.det(M) < 0).any(axis=0)
    assert 5 < reflected.sum() < N
    clear = CUBICS[reflected & (CUBICS.margin > 0.1)]
    assert clear.count > 3
    t = TIMES[1:-1]
    W = clear(t).mT @ oracles.derivative_by_differences(clear, t, 1e-3)
    assert np.abs(rb.vee_so3(W) - clear(t, 1)).max() < 1e-6


@pytest.mark.source("BK 6.2", "errata 11", "errata 23")
def test_the_printed_derivatives_at_the_ends_are_wrong():
    """The printed second derivative at the end is not V1, and R0 ŵ0 is singular."""
    missed = np.abs(2 * PRINTED[2] + 6 * PRINTED[3] - V1).max(axis=(-2, -1))
    assert np.all(missed > 0.1)
    assert np.abs(np.linalg.det(V0)).max() < 1e-13 * 64


def test_the_quintic_does_not_have_the_least_jerk():
    """About one axis, a quintic in the angle has the least jerk; from rest to rest it costs 720
    angle²."""
    t = np.linspace(0, 1, 4001)
    for degrees, times in ((20, 1.002), (60, 1.17), (90, 2.31), (120, 11.56)):
        angle = np.radians(degrees)
        curve = rb.projected_quintic(I3, rb.exp_so3([0, 0, angle]), *[REST] * 4)
        cost = np.trapezoid(curve(t, 3)[:, 2] ** 2, t)
        assert cost / (720 * angle**2) == pytest.approx(times, rel=2e-3)


@pytest.mark.source("BK 6.1")
def test_the_cubic_with_the_ends_of_the_projected_line_equals_this_line():
    """The cubic and the quintic are the line times a positive factor ρ(t), which the projection
    ignores."""
    line = rb.projected_line(R0, R0 @ rb.exp_so3([0.3, -0.4, 1.2]))
    ends = [line(t, order) for order in (0, 1, 2) for t in (0, 1)]
    for curve in (rb.projected_cubic(*ends[:4]), rb.projected_quintic(*ends)):
        for order in (0, 1, 2):
            assert np.abs(curve(TIMES, order) - line(TIMES, order)).max() < 1e-13


def test_the_margin_is_the_least_gap():
    t = np.linspace(0, 1, 1001)
    gap, steps = gaps(t).min(axis=0), np.diff(cubic_of_matrices(t), axis=0)
    assert np.all(CUBICS.margin <= gap + 1e-14)
    assert np.all(gap - CUBICS.margin < 2 * np.linalg.norm(steps, axis=(-2, -1)).max(axis=0))


@pytest.mark.parametrize("k", [40, 45, 50, 50.05, 55])
@pytest.mark.parametrize("k1", [5, 40])
def test_a_jump_between_the_sampled_times_is_found(k, k1):
    """The curves jump between 65 or 129 sampled times, at the midpoints and elsewhere.

    The cubic is a complex number z with z(0) = 1, z'(0) = i k0, z(1) = exp(ia) and z'(1) = i k1
    exp(ia). With Hermite's basis, z(t) = h00 + i k0 h10 + exp(ia) (h01 + i k1 h11) = 0 determines
    k0 and a.
    """
    h00, h01, h10, h11 = (hermite(one, np.array((k + 0.25) / 64)) for one in np.eye(4))
    k0 = np.sqrt(h01**2 + (k1 * h11) ** 2 - h00**2) / h10
    a = np.angle(-(h00 + 1j * k0 * h10) / (h01 + 1j * k1 * h11))
    with pytest.warns(RuntimeWarning, match="jumps there"):
        curve = rb.projected_cubic(I3, rb.exp_so3([0, 0, a]), [0, 0, k0], [0, 0, k1])
    assert curve.margin < 1e-12


@pytest.mark.source("BK 6.2")
@pytest.mark.parametrize("count", [2, 4, 6])
def test_the_polynomial_of_least_degree_has_exact_ends(count):
    """The ends may have very different sizes, and small changes are computed without
    cancellation."""
    given, t = RNG.normal(size=(6, 5))[:count], np.linspace(0, 1, 21)
    want = np.array([oracles.polynomial_through(given, x) for x in t])
    scale = np.abs(given).sum(axis=0)
    assert np.all(np.abs(hermite(given, t[:, None]) - want) < 200 * EPS * scale)
    for order in (0, 1, 2):
        step = hermite(given, t[:, None] + 1e-100j, order).imag / 1e-100
        off = np.abs(hermite(given, t[:, None], order + 1) - step)
        assert np.all(off < (400 if order < 2 else 4000) * EPS * scale)
    x1, rest = 1e6 + 2.0**-30, np.zeros(count - 2)
    want = hermite([0, x1 - 1e6, *rest], t, 1)
    assert np.abs(hermite([1e6, x1, *rest], t, 1) - want).max() < 8 * EPS * (x1 - 1e6)
    for sizes in ([1] * 6, [1e-200, 1, 1e9, 1e-9, 1, 1e12], [1, 1e200, 1, 1, 1, 1]):
        ends = given * np.array(sizes)[:count, None]
        for order in range(count // 2):
            for at in (0, 1):
                assert np.array_equal(hermite(ends, np.array(at), order), ends[2 * order + at])
    with pytest.raises(ValueError, match=f"^ends: two, four or six are wanted, got {count + 1}"):
        hermite([*given, given[0]], t[:, None])


@pytest.mark.parametrize("count", [2, 4, 6])
@pytest.mark.source("BK 6")
def test_the_polynomial_minimises_its_cost(count):
    """If a change keeps the ends, its derivative is orthogonal to the derivative in the cost."""
    ends, order = RNG.normal(size=count), count // 2
    t = (1 + np.cos(np.pi * np.arange(9) / 8)) / 2
    best = Polynomial.fit(t, hermite(ends, t), count - 1).convert().deriv(order)
    for k in range(5):
        change = (Polynomial([0, 1, -1]) ** order * Polynomial.basis(k)).deriv(order)
        product = (best * change).integ()
        assert abs(product(1) - product(0)) < 1e4 * EPS * np.abs(product.coef).sum()


def ends_with_a_jump(count, rng, miss=0.0):
    """Return planar problems, in random frames, whose complex numbers z(t) are `miss` at t = ½."""
    h00, h01, h10, h11 = (hermite(one, np.array(0.5)) for one in np.eye(4))
    k1, sign = rng.uniform(-40, 40, count), rng.choice([-1, 1], count)
    k0 = sign * np.sqrt((h01**2 + (k1 * h11) ** 2 - (h00 - miss) ** 2) / h10**2)
    a = np.angle(-(h00 - miss + 1j * k0 * h10) / (h01 + 1j * k1 * h11))
    L, Q = (Rotation.random(count, rng).as_matrix() for _ in "LQ")
    z = np.eye(3)[2]
    turn = L @ rb.exp_so3(a[:, None] * z) @ Q
    return L @ Q, turn, *(k[:, None] * (Q.mT @ z) for k in (k0, k1))


def test_the_margin_is_at_least_its_bound():
    """The bound is the margin for turns about one axis with w0 = w1 against the turn."""
    rng, count = np.random.default_rng(77), 200
    start, axis = Rotation.random(count, rng).as_matrix(), rng.normal(size=(count, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    angle = np.pi * (1 - 10.0 ** rng.uniform(-9, -0.03, (count, 1)))
    goal, fastest = start @ rb.exp_so3(angle * axis), 4 / np.tan(angle / 2)
    speeds = fastest * rng.random((2, count, 1))
    directions = rng.normal(size=(2, count, 3))
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    near = -axis + 0.1 * directions
    for w0, w1, exact in (
        (*2 * (-speeds[0] * axis,), True),
        (*-speeds * axis, False),
        (*speeds * near, False),
        (*speeds * directions, False),
        (*2 * speeds * directions, False),
    ):
        ends = Ends(start, goal, w0, w1)
        bound, margin = bound_of_margin(ends), polynomial(ends, np.ones(count)).margin
        assert (bound <= margin + 20 * EPS).all()
        assert not exact or np.abs(bound - margin)[margin > 0.01].max() < 1e-4


@pytest.mark.parametrize("miss", [0, 1e-8, 4e-7, 1e-5, 1e-3])
def test_curves_with_a_small_margin_are_found_in_a_stack(miss):
    rng, count = np.random.default_rng(3), 80
    ends = Ends(*ends_with_a_jump(count, rng, miss))
    curves = polynomial(ends, np.ones(count))
    small = curves.margin < 1e-6
    assert small.all() if miss < 5e-7 else not small.all()
    assert _may_almost_jump(curves.ends)[small].all()
    assert miss < 1e-3 or not _may_almost_jump(curves.ends)[curves.margin > 1e-4].any()
    assert (bound_of_margin(ends) <= curves.margin + 1e-9).all()


def test_a_stack_with_a_jump_needs_little_memory():
    """The margins of 20,000 curves at 129 times would need 190 MB for the matrices alone."""
    rng, count = np.random.default_rng(4), 20_000
    ends = [rb.sample_rotation(count, rng=rng) for _ in range(2)]
    ends += [*rng.normal(size=(2, count, 3))]
    for stack, one in zip(ends, ends_with_a_jump(1, rng), strict=True):
        stack[12_345] = one[0]
    tracemalloc.start()
    with pytest.warns(RuntimeWarning, match=r"^margin < 1e-6 of curve \[12345\]: .* t = 0\.5; "):
        rb.projected_cubic(*ends)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 100e6


@pytest.mark.parametrize(("degrees", "ratio"), [(120, 2.6), (150, 14), (170, 300)])
def test_the_documented_costs_near_half_turns(degrees, ratio):
    """From rest to rest, the optimum costs 24 ‖σ‖²."""
    curve = rb.projected_cubic(np.eye(3), rb.exp_so3([0, 0, np.radians(degrees)]))
    assert rb.acceleration_cost(curve) == pytest.approx(24 * np.radians(degrees) ** 2 * ratio, 0.02)
    assert f"{ratio} times" in rb.projected_cubic.__doc__
