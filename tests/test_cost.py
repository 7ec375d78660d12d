"""The acceleration functional, against closed forms and another quadrature."""

import numpy as np
import pytest
from scipy.integrate import quad

import rbcourse as rb
from rbcourse.curves import Retimed

REST = np.zeros(3)


def by_quad(curve, part):
    def integrand(t):
        a = curve(t, 2)[..., part]
        return a @ a

    return quad(integrand, 0, 1, epsabs=1e-13, epsrel=1e-13, limit=500)[0]


@pytest.mark.source("BK (18)", "BK (12)", "errata 1")
def test_one_axis_has_a_closed_form():
    """A cubic from rest to rest over the angle a costs 2 · 12 a²; a projected line 2 ∫ (a θ'')²."""
    turn = np.array([0, 0.9, 0])
    optimum = rb.minimum_acceleration_so3(np.eye(3), rb.exp_so3(turn), REST, REST)
    assert rb.acceleration_cost(optimum) == pytest.approx(24 * 0.81, rel=1e-10)
    line = rb.projected_line_so3(np.eye(3), rb.exp_so3(turn))
    want = (
        2 * quad(lambda t: (0.9 * rb.projected_line.theta(t, 0.9, 2)) ** 2, 0, 1, epsrel=1e-13)[0]
    )
    assert rb.acceleration_cost(line) == pytest.approx(want, rel=1e-10)


@pytest.mark.source("BK (18)", "BK (14)")
def test_the_parts_on_se3_are_the_integrals():
    A1 = rb.pose_from_coordinates([0.5, 2.0, 1.5, 8, 10, 12])
    curve = rb.projected_cubic_se3(np.eye(4), A1, [1, 2, 3], [2, 1, 1], [1, 1, 1], [1, 5, 3])
    rotation, translation = rb.acceleration_cost_parts(curve)
    assert rotation == pytest.approx(2 * by_quad(curve, slice(0, 3)), rel=1e-10)
    assert translation == pytest.approx(by_quad(curve, slice(3, 6)), rel=1e-10)
    assert rb.acceleration_cost(curve) == pytest.approx(rotation + translation, rel=1e-15)
    assert rb.acceleration_cost(curve.rotation) == pytest.approx(rotation, rel=1e-10)


@pytest.mark.source("BK 2.6")
def test_geodesics_cost_nothing_and_screws_do():
    A1 = rb.pose_from_coordinates([0, 0, 1, 2, 0, 0])
    assert rb.acceleration_cost(rb.geodesic_se3(np.eye(4), A1)) == 0
    screw = rb.screw_se3(np.eye(4), A1)
    w, v = screw.twist[:3], screw.twist[3:]
    rotation, translation = rb.acceleration_cost_parts(screw)
    assert rotation == 0
    assert translation == pytest.approx(np.sum(np.cross(w, v) ** 2), rel=1e-12)


@pytest.mark.parametrize("margin", [2e-3, 1e-4, 1e-5, 3e-6])
def test_sharp_turns_are_not_missed(margin):
    """Nearly all of the cost arises within a share of the time that is half the margin."""
    turn = np.array([0, 0, np.pi - margin])
    line = rb.projected_line_so3(np.eye(3), rb.exp_so3(turn))
    k = np.tan(turn[2] / 2)  # aθ = a/2 + atan u, u = (2t − 1) k; ∫ u²/(1 + u²)⁴ du = π/16
    assert rb.acceleration_cost(line) == pytest.approx(4 * np.pi * k**3, rel=1e-9)
    cubic = rb.projected_cubic_so3(np.eye(3), rb.exp_so3(turn), REST, REST)  # 3/2 as fast there
    assert rb.acceleration_cost(cubic) == pytest.approx(27 / 8 * 4 * np.pi * k**3, rel=20 * margin)


def test_a_sharp_turn_off_the_middle_is_not_missed():
    """All of it within a thousandth of the time, about t = 0.37; against a rule that is told."""

    def late(t, order):
        x = np.tanh(2000 * (t - 0.37))
        return [(1 + x) / 2, 1000 * (1 - x * x), -4e6 * x * (1 - x * x)][order]

    line = rb.projected_line_so3(np.eye(3), rb.exp_so3([0, 0, 1.0]), late)
    want = quad(lambda t: 2 * line(t, 2)[2] ** 2, 0.36, 0.38, epsrel=1e-12, limit=500)[0]
    assert rb.acceleration_cost(line) == pytest.approx(want, rel=1e-9)


@pytest.mark.parametrize("when", [0.37, 0.61])
@pytest.mark.parametrize("off", [1e-2, 1e-4, 1e-5])
def test_a_projected_cubic_that_all_but_jumps_off_the_middle(when, off):
    """About one axis M is a complex cubic z, here with |z| of the order `off` at `when`."""
    angle = 2.5
    t, z = np.polynomial.Polynomial([0, 1]), np.exp(1j * angle)
    leave, arrive = t - 2 * t**2 + t**3, t**3 - t**2
    still = 1 + (z - 1) * (3 * t**2 - 2 * t**3)
    a, b, c = 1j * leave(when), 1j * z * arrive(when), -still(when)
    k0, k1 = np.linalg.solve([[a.real, b.real], [a.imag, b.imag]], [c.real, c.imag])  # z(when) = 0
    k0 += off
    curve = rb.projected_cubic_so3(np.eye(3), rb.exp_so3([0, 0, angle]), [0, 0, k0], [0, 0, k1])
    z = still + 1j * k0 * leave + 1j * k1 * z * arrive
    assert curve.margin_time == pytest.approx(when, abs=off)
    assert curve.margin == pytest.approx(2 * abs(z(float(curve.margin_time))), rel=1e-6)

    def square(u):
        rate = z.deriv()(u) / z(u)
        return 2 * (z.deriv(2)(u) / z(u) - rate**2).imag ** 2

    middle, reach = float(curve.margin_time), 2.0 ** -np.arange(1, 36)
    ends = np.unique(np.clip([*(middle - reach), middle, *(middle + reach)], 0, 1))
    nodes, weights = np.polynomial.legendre.leggauss(40)
    half = np.diff(ends)[:, None] / 2
    want = np.sum(half * weights * square(ends[:-1, None] + half * (1 + nodes)))
    assert rb.acceleration_cost(curve) == pytest.approx(want, rel=1e-8)


@pytest.mark.parametrize("speed", [1e3, 1e12, 1e26])
def test_what_happens_in_the_first_instant_is_not_missed(speed):
    """M(t) = I + t M'(0) + … turns at once: the cost is of the order of the speed cubed."""
    cubic = rb.projected_cubic_so3(np.eye(3), np.eye(3), [speed] * 3, REST)
    a = np.sqrt(3) * speed  # along one axis θ = atan(a t)
    want = 2 * a**3 * quad(lambda u: (2 * u / (1 + u * u) ** 2) ** 2, 0, np.inf)[0]
    assert rb.acceleration_cost(cubic) == pytest.approx(want, rel=5 / speed + 1e-9)


def test_a_jump_has_no_cost():
    for turn in (np.diag([-1.0, -1, 1]), np.diag([1.0, -1, -1]), rb.exp_so3([0, 0, np.pi - 5e-7])):
        with pytest.warns(RuntimeWarning, match="margin < 1e-6"):
            jump = rb.projected_cubic_so3(np.eye(3), turn, [0, 1e-9, 0], REST)
        with pytest.raises(RuntimeError, match="almost jumps"):
            rb.acceleration_cost(jump)


def test_a_stack_has_a_cost_for_each():
    R1 = rb.exp_so3(np.array([[0.1, 0, 0], [0, 1, 0], [0, 0, 2.5]]))
    stack = rb.acceleration_cost(rb.projected_cubic_so3(np.eye(3), R1, REST, REST))
    assert stack.shape == (3,)
    for cost, R in zip(stack, R1, strict=True):
        one = rb.acceleration_cost(rb.projected_cubic_so3(np.eye(3), R, REST, REST))
        assert cost == pytest.approx(one, rel=2e-10)


def test_what_does_not_settle_is_no_number():
    noise = np.random.default_rng(0)

    def rough(t, order):
        return t if order < 2 else noise.normal(size=t.shape)

    line = rb.projected_line_so3(np.eye(3), rb.exp_so3([0, 0, 1.0]), rough)
    with pytest.raises(RuntimeError, match="halved panels leave an uncertainty of"):
        rb.acceleration_cost(line)


def test_stacks_of_any_shape_have_costs():
    for curve in (rb.projected_cubic_so3, rb.quaternion_cubic_so3):
        turns = rb.exp_so3(np.linspace(0.5, 2.9, 12).reshape(2, 6, 1) * [0.6, 0, 0.8])
        stack = curve(np.eye(3), turns, np.zeros(3), [0, 2, 0])
        costs = rb.acceleration_cost(stack)
        assert costs.shape == (2, 6)
        assert costs[1, 4] == pytest.approx(rb.acceleration_cost(stack[1, 4]), rel=1e-9)


def test_of_a_curve_that_was_not_found_there_is_no_cost():
    R, w = rb.exp_so3([[0, 0, 1], [1, 0, 0]]), np.array([[0, 0, 0], [90, 300.0, -500]])
    with pytest.warns(RuntimeWarning):
        stack = rb.minimum_acceleration_so3(np.eye(3), R, w, -w)
    with pytest.raises(RuntimeError, match=r"^acceleration cost of curve \[1\]: the curve is NaN"):
        rb.acceleration_cost(stack)


@pytest.mark.parametrize("margin", [1e-3, 3e-6])
def test_a_sharp_turn_of_a_retimed_leg_is_not_missed(margin):
    """A curve that is retimed twice, to the time that it took, alone and as a leg of a chain."""
    turn = rb.exp_so3([0, 0, np.pi - margin])

    def leg(R0, R1):
        return rb.retime(rb.retime(rb.projected_line_so3(R0, R1), 3), 1)

    want = rb.acceleration_cost(rb.projected_line_so3(np.eye(3), turn))
    assert rb.acceleration_cost(leg(np.eye(3), turn)) == pytest.approx(want, rel=1e-9)
    legs, _ = rb.chain([0, 1], [np.eye(3), turn], leg=leg)._unit_legs("", 1)
    assert isinstance(legs, Retimed)
    ((when, width),) = legs._events()
    assert (when, width) == pytest.approx((0.5, margin / 4), rel=1e-6)


def test_a_stack_of_no_curves_has_no_costs():
    stack = rb.geodesic_so3(np.eye(3), rb.exp_so3(np.empty((2, 0, 3))))
    assert rb.acceleration_cost(stack).shape == (2, 0)
    assert rb.acceleration_cost(rb.retime(stack, 3)).shape == (2, 0)


def test_a_very_long_time_costs_nothing_and_an_overflow_is_no_number():
    line = rb.projected_line_so3(np.eye(3), rb.exp_so3([0, 0, 1.0]))
    assert rb.acceleration_cost(rb.retime(line, 1e120)) == 0
    far = np.eye(4)
    far[:3, 3] = 1e160
    with np.errstate(over="ignore"), pytest.raises(RuntimeError, match="an uncertainty of"):
        rb.acceleration_cost(rb.projected_cubic_se3(np.eye(4), far, REST, REST, REST, REST))
