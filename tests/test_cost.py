"""The acceleration functional, against closed forms and another quadrature."""

from functools import partial

import numpy as np
import pytest
from numpy.polynomial import Chebyshev, Polynomial
from scipy.integrate import quad

import rbcourse as rb

I3, REST = np.eye(3), np.zeros(3)


@pytest.mark.source("BK (18)", "BK (12)", "errata 1")
def test_one_axis_has_a_closed_form():
    """A cubic from rest to rest over the angle a costs 2 · 12 a²; a projected line 2 ∫ (a θ'')²."""
    turn = rb.exp_so3([0, 0.9, 0])
    optimum = rb.minimum_acceleration_so3(I3, turn, REST, REST)
    assert rb.acceleration_cost(optimum) == pytest.approx(24 * 0.81, rel=1e-10)
    square = quad(lambda t: rb.projected_line.theta(t, 0.9, 2) ** 2, 0, 1, epsrel=1e-13)[0]
    line = rb.projected_line_so3(I3, turn)
    assert rb.acceleration_cost(line) == pytest.approx(2 * 0.81 * square, rel=1e-10)


@pytest.mark.source("BK (18)", "BK (14)")
def test_the_parts_on_se3_are_the_integrals():
    A1 = rb.pose_from_coordinates([0.5, 2.0, 1.5, 8, 10, 12])
    curve = rb.projected_cubic_se3(np.eye(4), A1, [1, 2, 3], [2, 1, 1], [1, 1, 1], [1, 5, 3])
    parts = rb.acceleration_cost_parts(curve)
    for part, weight, cost in ((slice(3), 2, parts[0]), (slice(3, 6), 1, parts[1])):
        squares = quad(lambda t, p=part: np.sum(curve(t, 2)[p] ** 2), 0, 1, epsrel=1e-13, limit=500)
        assert cost == pytest.approx(weight * squares[0], rel=1e-10)
    assert rb.acceleration_cost(curve) == pytest.approx(sum(parts), rel=1e-15)
    assert rb.acceleration_cost(curve.rotation) == pytest.approx(parts[0], rel=1e-10)


@pytest.mark.source("BK 2.6")
def test_geodesics_cost_nothing_and_screws_do():
    A1 = rb.pose_from_coordinates([0, 0, 1, 2, 0, 0])
    assert rb.acceleration_cost(rb.geodesic_se3(np.eye(4), A1)) == 0
    screw = rb.screw_se3(np.eye(4), A1)
    w, v = screw.twist[:3], screw.twist[3:]
    rotation, translation = rb.acceleration_cost_parts(screw)
    assert rotation == 0
    assert translation == pytest.approx(np.sum(np.cross(w, v) ** 2), rel=1e-12)


@pytest.mark.parametrize("margin", [2e-3, 1e-3, 1e-4, 1e-5, 3e-6])
def test_sharp_turns_are_not_missed(margin):
    """Nearly all of the cost arises within a share of the time that is half the margin.

    Alone, and as a leg of a chain: the breakpoints are close where it is.
    """
    turn = rb.exp_so3([0, 0, np.pi - margin])
    k = np.tan((np.pi - margin) / 2)  # aθ = a/2 + atan u, u = (2t − 1) k; ∫ u²/(1 + u²)⁴ du = π/16
    for line in (
        rb.projected_line_so3(I3, turn, duration=3),
        rb.chain([2, 5], [I3, turn], leg=rb.projected_line_so3),
    ):
        assert rb.acceleration_cost(line) == pytest.approx(4 * np.pi * k**3 / 27, rel=1e-9)
        least = np.abs(np.setdiff1d(line.breakpoints, 0.5) - 0.5).min()
        assert margin / 20 < least < margin / 4
    cubic = rb.projected_cubic_so3(I3, turn, REST, REST)  # 3/2 as fast there
    assert rb.acceleration_cost(cubic) == pytest.approx(27 / 8 * 4 * np.pi * k**3, rel=20 * margin)


def test_a_sharp_turn_off_the_middle_is_not_missed():
    """All of it within a thousandth of the time, about t = 0.37; against a rule that is told."""

    def late(t, order):
        x = np.tanh(2000 * (t - 0.37))
        return [(1 + x) / 2, 1000 * (1 - x * x), -4e6 * x * (1 - x * x)][order]

    line = rb.projected_line_so3(I3, rb.exp_so3([0, 0, 1.0]), late)
    want = quad(lambda t: 2 * line(t, 2)[2] ** 2, 0.36, 0.38, epsrel=1e-12, limit=500)[0]
    assert rb.acceleration_cost(line) == pytest.approx(want, rel=1e-9)


@pytest.mark.parametrize("when", [0.37, 0.61])
@pytest.mark.parametrize("off", [1e-2, 1e-4, 1e-5])
def test_a_projected_cubic_that_all_but_jumps_off_the_middle(when, off):
    """About one axis M is a complex cubic z, here with |z| of the order `off` at `when`."""
    t, turn = Polynomial([0, 1]), np.exp(2.5j)
    still = 1 + (turn - 1) * (3 * t**2 - 2 * t**3)
    leave, arrive = 1j * (t - 2 * t**2 + t**3), 1j * turn * (t**3 - t**2)
    at = np.array([leave(when), arrive(when), -still(when)])
    k0, k1 = np.linalg.solve([at.real[:2], at.imag[:2]], [at.real[2], at.imag[2]])  # z(when) = 0
    k0 += off
    curve = rb.projected_cubic_so3(I3, rb.exp_so3([0, 0, 2.5]), [0, 0, k0], [0, 0, k1])
    z, middle = still + k0 * leave + k1 * arrive, float(curve.margin_time)
    assert middle == pytest.approx(when, abs=off)
    assert curve.margin == pytest.approx(2 * abs(z(middle)), rel=1e-6)
    reach = 2.0 ** -np.arange(1, 36)
    ends = np.unique(np.clip([*(middle - reach), middle, *(middle + reach)], 0, 1))
    nodes, weights = np.polynomial.legendre.leggauss(40)
    half = np.diff(ends)[:, None] / 2
    u = ends[:-1, None] + half * (1 + nodes)
    a = z.deriv(2)(u) / z(u) - (z.deriv()(u) / z(u)) ** 2
    assert rb.acceleration_cost(curve) == pytest.approx(
        np.sum(half * weights * 2 * a.imag**2), rel=1e-8
    )


@pytest.mark.parametrize("speed", [1e3, 1e12, 1e26])
def test_what_happens_in_the_first_instant_is_not_missed(speed):
    """M(t) = I + t M'(0) + … turns at once: the cost is of the order of the speed cubed."""
    cubic = rb.projected_cubic_so3(I3, I3, [speed] * 3, REST)
    a = np.sqrt(3) * speed  # along one axis θ = atan(a t)
    want = 2 * a**3 * quad(lambda u: (2 * u / (1 + u * u) ** 2) ** 2, 0, np.inf)[0]
    assert rb.acceleration_cost(cubic) == pytest.approx(want, rel=5 / speed + 1e-9)


def test_a_jump_has_no_cost():
    for turn in (np.diag([-1.0, -1, 1]), np.diag([1.0, -1, -1]), rb.exp_so3([0, 0, np.pi - 5e-7])):
        with pytest.warns(RuntimeWarning, match="margin < 1e-6"):
            jump = rb.projected_cubic_so3(I3, turn, [0, 1e-9, 0], REST)
        with pytest.raises(RuntimeError, match="almost jumps"):
            rb.acceleration_cost(jump)


@pytest.mark.parametrize("make", [rb.projected_cubic_so3, rb.quaternion_cubic_so3])
def test_a_stack_has_a_cost_for_each(make):
    turns = rb.exp_so3(np.linspace(0.5, 2.9, 12).reshape(2, 6, 1) * [0.6, 0, 0.8])
    stack = make(I3, turns, REST, [0, 2, 0])
    costs = rb.acceleration_cost(stack)
    assert costs.shape == (2, 6)
    for i in np.ndindex(2, 6):
        assert costs[i] == pytest.approx(rb.acceleration_cost(stack[i]), rel=2e-10)
    assert rb.acceleration_cost(rb.retime(stack[:, :0], 3)).shape == (2, 0)


def test_an_integral_that_does_not_settle_is_refused():
    noise = np.random.default_rng(0)
    line = rb.projected_line_so3(
        I3, rb.exp_so3([0, 0, 1.0]), lambda t, k: t if k < 2 else noise.normal(size=t.shape)
    )
    with pytest.raises(RuntimeError, match="halved panels leave an uncertainty of"):
        rb.acceleration_cost(line)


def test_a_curve_that_was_not_found_has_no_cost():
    w = np.array([[0, 0, 0], [1e160, 0, 0]])
    with pytest.warns(RuntimeWarning):
        stack = rb.minimum_acceleration_so3(I3, rb.exp_so3([0, 0, 1]), w, w)
    with pytest.raises(RuntimeError, match=r"^acceleration cost of curve \[1\]: the curve is NaN"):
        rb.acceleration_cost(stack)


def test_a_very_long_time_costs_nothing_and_an_overflow_is_no_number():
    line = rb.projected_line_so3(I3, rb.exp_so3([0, 0, 1.0]))
    assert rb.acceleration_cost(rb.retime(line, 1e120)) == 0
    far = np.eye(4)
    far[:3, 3] = 1e160
    with np.errstate(over="ignore"), pytest.raises(RuntimeError, match="an uncertainty of"):
        rb.acceleration_cost(rb.projected_cubic_se3(np.eye(4), far, REST, REST, REST, REST))


BOOK = np.array([[0.2, 0.02, 0], [0.02, 0.3, 0.01], [0, 0.01, 0.4]])
CURVES = {
    "projection": rb.projected_cubic_so3,
    "geodesic": lambda R0, R1, w0, w1: rb.geodesic_so3(R0, R1),
    "line": lambda R0, R1, w0, w1: rb.projected_line_so3(R0, R1),
    "Bézier": rb.bezier_so3,
    "exponential": rb.exponential_cubic_so3,
    "quaternion": rb.quaternion_cubic_so3,
    "Cayley": rb.cayley_cubic_so3,
    "optimum": rb.minimum_acceleration_so3,
    "retimed": lambda *ends: rb.retime(rb.cumulative_bezier_so3(*ends), 1.7),
    "quintics": lambda R0, R1, w0, w1: rb.retime(
        rb.exponential_quintic_so3(R0, R1, w0, w1, w1, w0), 0.6
    ),
}


@pytest.mark.source("beyond BK 1", "beyond BK 4", "beyond BK 5")
@pytest.mark.parametrize("name", CURVES)
def test_costs_of_bodies_are_the_integrals(name):
    curve = CURVES[name](I3, rb.exp_so3([0.5, 1.2, -0.4]), [1, 2, 0], [0, -1, 1])

    def torque(t):
        w, a = curve(t, 1), curve(t, 2)
        return BOOK @ a + np.cross(w, BOOK @ w)

    def jerk(t):
        return curve(t, 3) + np.cross(curve(t, 1), curve(t, 2)) / 2

    for cost, square in (
        (rb.acceleration_cost(curve, BOOK), lambda t: torque(t) @ np.linalg.solve(BOOK, torque(t))),
        (rb.torque_cost(curve, BOOK), lambda t: torque(t) @ torque(t)),
        (rb.jerk_cost(curve), lambda t: 2 * jerk(t) @ jerk(t)),
    ):
        want = quad(square, *curve.domain, epsabs=1e-13, epsrel=1e-13, limit=500)[0]
        assert cost == pytest.approx(want, rel=1e-10, abs=1e-20)


def test_a_chain_that_is_smooth_enough_has_the_costs_of_its_legs():
    """Quintics that meet with one acceleration; of cubics the acceleration jumps."""
    R = rb.exp_so3([[0, 0, 0], [0.3, 0.8, 0], [0, 1.0, 1.0]])
    w, a = np.array([[0, 0, 0], [0.2, 0.5, 0.5], [0, 0, 0]]), [REST, [0.3, -0.2, 0.1], REST]

    def leg(R0, R1, w0, w1, duration):
        return rb.exponential_quintic_so3(R0, R1, w0, w1, a[:2], a[1:], duration=duration)

    chain = rb.chain([0, 1, 3], R, velocities=w, leg=leg)
    for cost in (rb.jerk_cost, lambda curve: rb.torque_cost(curve, BOOK)):
        legs = [
            rb.exponential_quintic_so3(*R[i : i + 2], *w[i : i + 2], *a[i : i + 2], duration=i + 1)
            for i in range(2)
        ]
        assert cost(chain) == pytest.approx(sum(map(cost, legs)), rel=1e-10)
    cubics = rb.chain([0, 1, 3], R, velocities=w, leg=rb.bezier_so3)
    assert rb.torque_cost(cubics, BOOK) > 0
    with pytest.raises(RuntimeError, match=r"^jerk cost: an acceleration jumps at a joint, by"):
        rb.jerk_cost(cubics)
    with pytest.raises(RuntimeError, match=r"^torque cost: a velocity jumps at a joint, by"):
        rb.torque_cost(rb.chain([0, 1, 3], R, leg=rb.geodesic_so3), BOOK)


@pytest.mark.parametrize("unit", [1e-4, 1e4])
def test_a_chain_is_smooth_in_any_unit_of_time(unit):
    """Turned evenly: accelerations are rounding, and so are their jumps."""
    axis, t = np.array([0.3, -0.5, 0.8]), np.array([0, 1, 3, 4.0])
    chain = rb.chain(
        unit * t,
        rb.exp_so3(np.outer(t, axis)),
        np.tile(axis / unit, (4, 1)),
        leg=rb.exponential_cubic_so3,
    )
    assert rb.jerk_cost(chain) * unit**5 < 1e-20


def test_the_breakpoints_of_a_chain_have_its_joints():
    t = np.array([-1.0, 0, 2, 3, 7])
    chain = rb.chain(t, rb.exp_so3(np.outer(t, [0.1, 0.2, 0])))
    shares = (t - t[0]) / (t[-1] - t[0])
    assert np.abs(chain.breakpoints[:, None] - shares).min(axis=0).max() < 1e-15
    assert len(chain.breakpoints) >= 4 * 16


def test_stacks_have_an_inertia_for_all_or_one_for_each():
    turns = np.array([[0.5, 0, 0.2], [0, 1, 0.3]])
    curves = rb.bezier_so3(I3, rb.exp_so3(turns), [1, 2, 0], [0, -1, 1])
    G = np.stack([BOOK, np.diag([1.0, 2, 2.5])])
    each = rb.torque_cost(curves, G)
    for i in range(2):
        assert each[i] == pytest.approx(rb.torque_cost(curves[i], G[i]), rel=1e-10)
    assert rb.acceleration_cost(curves, BOOK)[1] == pytest.approx(
        rb.acceleration_cost(curves[1], BOOK), rel=1e-10
    )
    with pytest.raises(
        ValueError, match=r"^inertia: one, or one for each curve of a stack of shape \(\)"
    ):
        rb.torque_cost(curves[0], G)
    with pytest.raises(ValueError, match=r"do not broadcast: curve \(2,\), inertia \(3,\)"):
        rb.torque_cost(curves, np.stack([BOOK] * 3))


@pytest.mark.source("beyond BK 9")
def test_on_se3_the_centre_of_mass_counts():
    """∫ m ‖d_c''‖² by differences of where the centre is."""
    A1 = rb.pose_from_coordinates([0.5, 0.4, 0.3, 1, 2, 3])
    curve = rb.projected_cubic_se3(np.eye(4), A1, [1, 2, 0], [0, -1, 1], [1, 1, 1], [1, 0, 3])
    m, r = 2.5, np.array([0.1, -0.3, 0.2])
    paths = [
        Chebyshev.interpolate(lambda t, i=i: curve(t)[:, i, :3] @ r + curve(t)[:, i, 3], 60, [0, 1])
        for i in range(3)
    ]
    x, weights = np.polynomial.legendre.leggauss(80)
    squares = sum(path.deriv(2)((x + 1) / 2) ** 2 for path in paths)
    rotation, translation = rb.acceleration_cost_parts(curve, BOOK, m, r)
    assert translation == pytest.approx(m * squares @ weights / 2, rel=1e-8)
    assert rotation == pytest.approx(rb.acceleration_cost(curve.rotation, BOOK), rel=1e-10)
    assert rb.acceleration_cost(curve, BOOK, m, r) == pytest.approx(rotation + translation)
    assert rb.acceleration_cost(curve, 2 * I3) == pytest.approx(rb.acceleration_cost(curve))


LINE, MOTION = rb.geodesic_so3(I3, I3), rb.geodesic_se3(np.eye(4), np.eye(4))


@pytest.mark.parametrize(
    ("cost", "message"),
    [
        (lambda: rb.acceleration_cost(MOTION, mass=0), "^mass is 0.0"),
        (lambda: rb.acceleration_cost(MOTION, mass=True), "^mass is True"),
        (lambda: rb.acceleration_cost(MOTION, centre=[0, 1]), r"^centre: shape \(3\)"),
        (lambda: rb.acceleration_cost(LINE, BOOK, 2.5), "^mass, centre: a curve on SO.3. has none"),
        (lambda: rb.acceleration_cost(None), "^curve: a Curve wanted, got None"),
        (lambda: rb.jerk_cost(None), "^curve: a Curve wanted, got None"),
        (lambda: rb.torque_cost(None, BOOK), "^curve: a Curve wanted, got None"),
        (lambda: rb.jerk_cost(MOTION), "^curve: one on SO.3. is wanted, got <Rigid"),
        (lambda: rb.torque_cost(MOTION, BOOK), "^curve: one on SO.3. is wanted, got <Rigid"),
        *(
            (lambda rtol=rtol: rb.jerk_cost(LINE, rtol=rtol), "^rtol")
            for rtol in (0, -1e-6, 1e-13, 0.2, np.nan, [1e-6, 1e-6])
        ),
    ],
)
def test_bad_arguments_are_named(cost, message):
    with pytest.raises(ValueError, match=message):
        cost()


@pytest.mark.parametrize(
    "leg", [rb.exponential_cubic_so3, rb.bezier_so3, rb.minimum_acceleration_so3]
)
def test_a_steady_turn_in_legs_has_no_jerk(leg):
    """What its acceleration jumps by at the joints is rounding only."""
    times, axis = np.array([0, 1, 2.5, 3]), np.array([0.6, 0, 0.8])
    R = rb.exp_so3(0.7 * times[:, None] * axis)
    chain = rb.chain(times, R, velocities=np.tile(0.7 * axis, (4, 1)), leg=leg)
    assert rb.jerk_cost(chain) < 1e-18


@pytest.mark.parametrize("size", [1e-12, 1e-8, 1.0, 1e8])
def test_the_unit_of_inertia_does_not_matter(size):
    G, w0 = size * np.diag([1.0, 2, 2.9]), np.array([0.8, 0.1, 1.2])
    A, w = rb.geodesic_flow(G / size, I3, w0, [0.0, 1.0])
    free = rb.minimum_torque_so3(I3, A[1], w0, w[1], G)
    assert rb.torque_cost(free, G) < 1e-18 * size**2
    assert rb.acceleration_cost(free, G) < 1e-18 * size
    other = rb.bezier_so3(I3, A[1], w0, w[1])
    for cost, power in ((rb.torque_cost, 2), (rb.acceleration_cost, 1)):
        want = size**power * cost(other, G / size)
        assert cost(other, G) == pytest.approx(want, rel=1e-12)


@pytest.mark.parametrize("rtol", [1e-2, 1e-6, 1e-8, 1e-12])
def test_a_cost_is_as_exact_as_rtol_asks(rtol):
    """On lines of which one turns fast half-way."""
    curve = rb.projected_line_so3(I3, rb.exp_so3([[0.3, 1, -0.5], [2, 2, 0.5]]))
    parts = partial(rb.acceleration_cost_parts, curve, BOOK)
    for cost in (
        partial(rb.acceleration_cost, curve),
        lambda **rtol: parts(**rtol)[0],
        partial(rb.torque_cost, curve, BOOK),
        partial(rb.jerk_cost, curve),
    ):
        off = np.abs(cost(rtol=rtol) / cost() - 1).max()
        assert off < max(rtol, 1e-10)
        assert (off > 1e-9) == (rtol == 1e-2)  # fewer times are enough for that
