"""Compare the costs with closed forms and with another quadrature."""

from functools import partial
from itertools import product

import numpy as np
import pytest
from numpy.polynomial import Polynomial, chebyshev
from optima import OPTIMA, deviation
from scipy.integrate import quad

import rbcourse as rb
from rbcourse._polynomials import hermite

I3, I4, REST = np.eye(3), np.eye(4), np.zeros(3)
INERTIA = np.array([[0.2, 0.02, 0], [0.02, 0.3, 0.01], [0, 0.01, 0.4]])
BOOK = rb.Body(INERTIA)


def about_z(angle):
    return rb.exp_so3([0, 0, angle])


def gauss(density, near=(), end=1.0):
    """Integrate from 0 to `end`; panels are finer near the ends and near the times `near`."""
    apart = 2.0 ** -np.arange(1, 42)
    cuts = np.unique([x for t in (0, 1, *near) for x in (*(t - apart), t, *(t + apart))])
    cuts = end * cuts[(cuts >= 0) & (cuts <= 1)]
    nodes, weights = np.polynomial.legendre.leggauss(20)
    half = np.diff(cuts)[:, None] / 2
    return np.sum(half * weights * density(cuts[:-1, None] + half * (1 + nodes)), axis=(-2, -1))


def squared(x):
    return np.sum(x**2, axis=-1)


@pytest.mark.source("BK (18)", "BK (14)", "beyond BK 9")
def test_the_parts_of_the_cost_on_se3_agree_with_their_integrals():
    """∫ m ‖d_c''‖² is computed from the positions of the centre, by a Chebyshev series."""
    A1 = rb.pose_from_coordinates([0.5, 0.4, 0.3, 1, 2, 3])
    curve = rb.projected_cubic(I4, A1, [1, 2, 0, 1, 1, 1], [0, -1, 1, 1, 0, 3])
    parts = rb.acceleration_cost_parts(curve)
    squares = gauss(lambda t: np.moveaxis(curve(t, 2) ** 2, -1, 0)).reshape(2, 3)
    assert parts == pytest.approx(squares.sum(axis=1) * [2, 1], rel=1e-10)
    assert rb.acceleration_cost(curve) == pytest.approx(sum(parts), rel=1e-15)
    assert rb.acceleration_cost(curve.rotation) == pytest.approx(parts[0], rel=1e-10)
    m, r = 2.5, np.array([0.1, -0.3, 0.2])
    path = chebyshev.chebinterpolate(lambda x: curve((x + 1) / 2)[:, :3] @ [*r, 1], 60)
    second = chebyshev.chebder(path, 2, scl=2)
    body = rb.Body(INERTIA, m, r)
    rotation, translation = rb.acceleration_cost_parts(curve, body=body)
    squares = gauss(lambda t: chebyshev.chebval(2 * t - 1, second) ** 2)
    assert translation == pytest.approx(m * squares.sum(), rel=1e-8)
    assert rotation == pytest.approx(rb.acceleration_cost(curve.rotation, body=BOOK), rel=1e-10)
    assert rb.acceleration_cost(curve, body=body) == pytest.approx(rotation + translation)
    assert rb.torque_cost(curve, body=body) == rb.torque_cost(curve.rotation, body=BOOK)


PROBLEM = rb.exp_so3([0.5, 1.2, -0.4]), [1, 2, 0], [0, -1, 1]


@pytest.mark.parametrize("what", ["acceleration", "torque", "jerk"])
def test_an_optimum_costs_what_it_states_for_its_body(what):
    """The costs take the body of the curve, also if it moves slowly or is a member of a stack."""
    body = rb.Body(np.stack([INERTIA, 3 * INERTIA]), 2.5, [0.1, -0.3, 0.2])
    given = {} if what == "jerk" else {"body": body}
    cost, optimum = getattr(rb, f"{what}_cost"), getattr(rb, f"minimum_{what}")
    curves = [optimum(I3, *PROBLEM, **given)]
    if what == "acceleration":
        poses = I4, rb.pose_from_components(PROBLEM[0], [1, 2, 3])
        curves += [rb.minimum_acceleration(*poses, [1, 2, 0, 1, 1, 1], body=body)]
    for curve in curves:
        for one in (curve, curve.retimed(2), *(curve if curve.batch_shape else ())):
            assert cost(one) == pytest.approx(one.cost, rel=1e-9)
        if given:
            other = rb.Body(np.diag([1.0, 2, 2.5]))
            assert np.all(cost(curve, body=other) != cost(curve))
            assert cost(curve, body=body) == pytest.approx(curve.cost, rel=1e-9)


@pytest.mark.parametrize("make", [rb.projected_spline, rb.minimum_acceleration_spline])
def test_a_spline_knows_its_body(make):
    """On the optimal spline for poses, cost and translation are those of the body."""
    A = rb.pose_from_coordinates([[0, 0, 0, 0, 0, 0], [0.3, 0.8, 0, 1, 0, 0], [0, 1, 1, 1, 1, 0]])
    body = rb.Body(INERTIA, 2.5, [0.1, -0.3, 0.2])
    for spline in (make([0, 1, 3], P, "rest", body=body) for P in (A[:, :3, :3], A)):
        cost = rb.acceleration_cost(spline, body=body)
        assert rb.acceleration_cost(spline) == cost
        assert cost == pytest.approx(getattr(spline, "cost", cost), rel=1e-9)
        assert rb.acceleration_cost(spline, body=BOOK) != cost or spline.size == 3


@pytest.mark.source("BK 2.6")
def test_geodesics_cost_nothing():
    A1 = rb.pose_from_coordinates([0, 0, 1, 2, 0, 0])
    assert rb.acceleration_cost(rb.geodesic(I4, A1)) == 0
    screw = rb.screw(I4, A1)
    rotation, translation = rb.acceleration_cost_parts(screw)
    assert rotation == 0
    across = np.cross(screw.twist[:3], screw.twist[3:])
    assert translation == pytest.approx(squared(across), rel=1e-12)


@pytest.mark.parametrize("margin", [2e-3, 1e-3, 1e-4, 1e-5, 3e-6])
def test_the_cost_of_sharp_turns_is_accurate(margin):
    """Nearly all of the cost arises within a time of half the margin.

    The line is tested alone and as a leg of a chain. The breakpoints are close together where the
    cost arises.
    """
    turn = about_z(np.pi - margin)
    k = np.tan((np.pi - margin) / 2)  # aθ = a/2 + atan u, u = (2t − 1) k; ∫ u²/(1 + u²)⁴ du = π/16
    for line in (
        rb.projected_line(I3, turn, duration=3),
        rb.chain([2, 5], [I3, turn], leg=rb.projected_line),
    ):
        assert rb.acceleration_cost(line) == pytest.approx(4 * np.pi * k**3 / 27, rel=1e-9)
        least = np.abs(np.setdiff1d(line.breakpoints[0], 0.5) - 0.5).min()
        assert margin / 20 < least < margin / 4
    # at half time, the cubic turns 3/2 times as fast
    cubic = rb.projected_cubic(I3, turn, REST, REST)
    assert rb.acceleration_cost(cubic) == pytest.approx(27 / 8 * 4 * np.pi * k**3, rel=20 * margin)


def late_line(when, angle):
    """Return a line whose acceleration is confined to a thousandth of the time."""

    def late(t, order):
        x = np.tanh(2000 * (t - when))
        return [(1 + x) / 2, 1000 * (1 - x * x), -4e6 * x * (1 - x * x)][order]

    return rb.projected_line(I3, about_z(angle), late), [when]


def cubic(when, off):
    """Return a cubic about one axis; it almost jumps, since the complex M(`when`) is of order
    `off`."""
    h00, h01, h10, h11 = (hermite(one, np.array(when)) for one in np.eye(4))
    turn = np.exp(2.5j)
    columns = np.array([1j * h10, 1j * turn * h11, -h00 - turn * h01])
    k0, k1 = np.linalg.solve(*np.split(np.array([columns.real, columns.imag]), [2], axis=1))[:, 0]
    curve = rb.projected_cubic(I3, about_z(2.5), [0, 0, k0 + off], [0, 0, k1])
    assert curve.margin_time == pytest.approx(when, abs=off)
    assert curve.margin < off
    return curve, [curve.margin_time]


def cubic_of_quaternions(margin):
    """Return a turn by 2 rad about an axis; the complex Q(1/2) is cos(1/2) + k/8 sin(1/2)."""
    k = 8 * (margin - np.cos(0.5)) / np.sin(0.5)
    curve = rb.closed_forms.quaternion_cubic(I3, about_z(2.0), [0, 0, k], [0, 0, k])
    assert curve.margin == pytest.approx(margin)
    return curve, [0.5]


def cayleys_cubic(short_of):
    """Return Cayley's cubic to a goal that is `short_of` less than a half-turn away.

    The cubic makes an extra turn within a time of about `short_of`².
    """
    w0, w1, n = np.array([1.0, 0, 0]), np.array([0, 2.0, 0]), np.array([1.0, 2, 2]) / 3
    goal = n / np.tan(short_of / 2)
    rate = (w1 + np.cross(goal, w1) + goal * (goal @ w1)) / 2
    square, cube = 3 * goal - w0 - rate, w0 / 2 + rate - 2 * goal
    length = sum(Polynomial(c) ** 2 for c in zip(0 * w0, w0 / 2, square, cube, strict=True))
    quick = [t.real for t in length.deriv().roots() if abs(t.imag) < 1e-6]
    return rb.closed_forms.cayley_cubic(I3, rb.exp_so3((np.pi - short_of) * n), w0, w1), quick


@pytest.mark.parametrize(
    ("make", "given"),
    [
        *((late_line, [0.37, angle]) for angle in (1, 1e-8)),
        *((cubic, [when, off]) for when in (0.37, 0.61) for off in (1e-2, 1e-4, 1e-5)),
        *((cubic_of_quaternions, [margin]) for margin in (0.1, 1e-3)),
        *((cayleys_cubic, [short_of]) for short_of in (0.3, 1e-2, 1e-3, 1e-4)),
    ],
)
def test_the_cost_of_a_sudden_turn_is_accurate(make, given):
    curve, near = make(*given)
    want = gauss(lambda t: 2 * squared(curve(t, 2)), near)
    assert rb.acceleration_cost(curve) == pytest.approx(want, rel=1e-8)


@pytest.mark.parametrize("speed", [1e3, 1e12, 1e26])
def test_the_cost_of_a_very_fast_start_is_accurate(speed):
    """M(t) = I + t M'(0) + … turns immediately, so the cost grows as the cube of the speed."""
    cubic = rb.projected_cubic(I3, I3, [speed] * 3, REST)
    a = np.sqrt(3) * speed  # along one axis, θ = atan(a t)
    want = 2 * a**3 * quad(lambda u: (2 * u / (1 + u * u) ** 2) ** 2, 0, np.inf)[0]
    assert rb.acceleration_cost(cubic) == pytest.approx(want, rel=5 / speed + 1e-9)


def test_panels_are_equally_fine_for_motions_about_each_axis():
    one, *others = (
        rb.closed_forms.exponential_cubic(I3, I3, 1e3 * x, 1e3 * x).breakpoints[0] for x in I3
    )
    assert len(one) > 17
    assert all(other == pytest.approx(one, rel=1e-9) for other in others)


@pytest.mark.parametrize("make", [*rb.closed_forms.FORMS.values(), rb.minimum_acceleration])
def test_the_panels_of_a_curve_do_not_depend_on_the_other_curves_of_its_stack(make):
    """Only panels of curves that turn fast somewhere are divided further."""
    goals = rb.exp_so3(np.array([[0, 0, 0.1], [0, 2, 2.0], [0, 0, 3.1]]))
    w0 = np.random.default_rng(0).normal(size=(3, 3))
    stack = make(I3, goals, w0, [[0, 0, 0], [0, 3, 8], [0, 0, 0]])
    for one, points in zip(stack, stack.breakpoints, strict=True):
        assert np.array_equal(points, one.breakpoints[0])
    assert len({len(points) for points in stack.breakpoints}) > 1


def test_the_cost_of_a_jump_raises_an_error():
    for turn in (np.diag([-1.0, -1, 1]), np.diag([1.0, -1, -1]), about_z(np.pi - 5e-7)):
        with pytest.warns(RuntimeWarning, match="margin < 1e-6"):
            jump = rb.projected_cubic(I3, turn, [0, 1e-9, 0], REST)
        with pytest.raises(RuntimeError, match="almost jumps"):
            rb.acceleration_cost(jump)
    with pytest.raises(RuntimeError, match="almost jumps"):
        rb.acceleration_cost(cubic_of_quaternions(0)[0])
    with pytest.warns(RuntimeWarning):
        stack = rb.minimum_acceleration(I3, about_z(1), *[[REST, [1e160, 0, 0]]] * 2)
    with pytest.raises(RuntimeError, match=r"^acceleration cost of curve \[1\]: the curve is NaN"):
        rb.acceleration_cost(stack)


def test_an_integral_that_does_not_converge_raises_an_error():
    noise, turn = np.random.default_rng(0), (np.pi - 1e-6) * np.array([1, 2, 2]) / 3

    def line(bend):
        return rb.projected_line(I3, about_z(1), lambda t, k: bend(t) if k == 2 else t)

    for curve in (
        line(lambda t: noise.normal(size=t.shape)),
        line(lambda t: np.where(abs(t - 0.5) < 0.4, 1e160, 0)),
        # accuracy is limited by rounding
        rb.closed_forms.cayley_cubic(I3, rb.exp_so3(turn), [1, 0, 0], [0, 2, 0]),
    ):
        with np.errstate(over="ignore"), pytest.raises(RuntimeError, match="has an uncertainty"):
            rb.acceleration_cost(curve)


@pytest.mark.parametrize("make", [rb.projected_cubic, rb.closed_forms.quaternion_cubic])
def test_a_stack_has_one_cost_for_each_curve(make):
    turns = rb.exp_so3(np.linspace(0.5, 2.9, 6).reshape(2, 3, 1) * [0.6, 0, 0.8])
    stack = make(I3, turns, REST, [0, 2, 0])
    each = INERTIA * np.linspace(1, 2, 6).reshape(2, 3, 1, 1)
    for cost, body in (
        *product((rb.torque_cost, rb.acceleration_cost), (BOOK, rb.Body(each))),
        (rb.acceleration_cost, None),
    ):
        costs = cost(stack, body=body)
        for i in np.ndindex(2, 3):
            one = cost(stack[i], body=rb.Body(each[i]) if body and body is not BOOK else body)
            assert costs[i] == pytest.approx(one, rel=2e-10)
    assert rb.acceleration_cost(stack[:, :0].retimed(3)).shape == (2, 0)
    assert np.all(rb.acceleration_cost(stack.retimed(1e120)) == 0)
    for curve, G, message in (
        (stack[0, 0], each, r"^body: a single body or a stack of shape \(\)"),
        (stack[0], [INERTIA] * 2, r"do not broadcast: curve \(3,\), body \(2,\)"),
    ):
        with pytest.raises(ValueError, match=message):
            rb.torque_cost(curve, body=rb.Body(G))


CURVES = rb.closed_forms.FORMS | {
    "geodesic": lambda R0, R1, w0, w1: rb.geodesic(R0, R1),
    "line": lambda R0, R1, w0, w1: rb.projected_line(R0, R1),
    "optimum": rb.minimum_acceleration,
    "retimed": lambda *ends: rb.closed_forms.cumulative_bezier(*ends).retimed(1.7),
    "quintics": lambda R0, R1, w0, w1: rb.closed_forms.exponential_quintic(
        R0, R1, w0, w1, w1, w0
    ).retimed(0.6),
}


@pytest.mark.source("beyond BK 1", "beyond BK 4", "beyond BK 5")
@pytest.mark.parametrize("name", CURVES)
def test_costs_agree_with_the_integrals_that_define_them(name):
    curve = CURVES[name](I3, *PROBLEM)

    def densities(t):
        rates = [curve(t, order) for order in (1, 2, 3)]
        return np.stack([squared(deviation(what, INERTIA, *rates)) for what in OPTIMA])

    found = rb.acceleration_cost(curve), rb.acceleration_cost(curve, body=BOOK)
    found += rb.torque_cost(curve, body=BOOK), rb.jerk_cost(curve)
    want = gauss(densities, end=curve.domain[1])
    assert found == pytest.approx(want, rel=1e-10, abs=1e-20)


def test_a_smooth_chain_costs_the_sum_of_its_legs():
    """Quintic legs have a continuous acceleration here. The acceleration of chained cubics
    jumps."""
    R = rb.exp_so3([[0, 0, 0], [0.3, 0.8, 0], [0, 1.0, 1.0]])
    w, a = np.array([[0, 0, 0], [0.2, 0.5, 0.5], [0, 0, 0]]), [REST, [0.3, -0.2, 0.1], REST]

    leg = rb.closed_forms.exponential_quintic
    chain = rb.chain([0, 1, 3], R, w, a, leg=leg)
    legs = leg(R[:2], R[1:], w[:2], w[1:], a[:2], a[1:], duration=[1, 2])
    for cost in (rb.jerk_cost, partial(rb.torque_cost, body=BOOK)):
        assert cost(chain) == pytest.approx(cost(legs).sum(), rel=1e-10)
    cubics = rb.chain([0, 1, 3], R, velocities=w, leg=rb.closed_forms.bezier)
    two = rb.closed_forms.bezier(R[:2], R[1:], w[:2], w[1:], duration=[1, 2])
    torques = rb.torque_cost(two, body=BOOK)
    assert rb.torque_cost(cubics, body=BOOK) == pytest.approx(torques.sum(), rel=1e-9)
    poses = rb.pose_from_components(R, np.array(a) - w)
    motion = rb.projected_spline([0, 1, 3], poses, "rest")
    parts = [sum(x) for x in zip(*map(rb.acceleration_cost_parts, motion.legs), strict=True)]
    assert rb.acceleration_cost_parts(motion) == pytest.approx(parts, rel=1e-9)
    twice = rb.acceleration_cost(motion.retimed(6))
    assert twice == pytest.approx(sum(parts) / 8, rel=1e-9)
    with pytest.raises(RuntimeError, match=r"^jerk cost: an acceleration jumps at a joint, by"):
        rb.jerk_cost(cubics)
    with pytest.raises(RuntimeError, match=r"^torque cost: a velocity jumps at a joint, by"):
        rb.torque_cost(rb.chain([0, 1, 3], R, leg=rb.geodesic), body=BOOK)


@pytest.mark.parametrize("unit", [1e-4, 1, 1e4])
@pytest.mark.parametrize(
    "leg", [rb.closed_forms.exponential_cubic, rb.closed_forms.bezier, rb.minimum_acceleration]
)
def test_a_steady_turn_of_several_legs_has_no_jerk(leg, unit):
    """The accelerations of the turn, and their jumps at the joints, are rounding errors."""
    t, w = np.array([0, 1, 2.5, 3]), 0.7 * np.array([0.6, 0, 0.8])
    chain = rb.chain(unit * t, rb.exp_so3(np.outer(t, w)), [w / unit] * 4, leg=leg)
    assert rb.jerk_cost(chain) * unit**5 < 1e-20


@pytest.mark.parametrize("size", [1e-12, 1e-8, 1.0, 1e8])
def test_costs_scale_with_the_unit_of_inertia(size):
    G, w0 = size * np.diag([1.0, 2, 2.9]), np.array([0.8, 0.1, 1.2])
    A, w = rb.connection.geodesic_flow(G / size, I3, w0, [0.0, 1.0])
    ends = I3, A[1], w0, w[1]
    body, unit = rb.Body(G), rb.Body(G / size)
    free, other = rb.minimum_torque(*ends, body=body), rb.closed_forms.bezier(*ends)
    for cost, power in ((rb.torque_cost, 2), (rb.acceleration_cost, 1)):
        assert cost(free) < 1e-18 * size**power
        want = size**power * cost(other, body=unit)
        assert cost(other, body=body) == pytest.approx(want, rel=1e-12)


@pytest.mark.parametrize("rtol", [1e-2, 1e-6, 1e-8, 1e-12])
def test_a_cost_is_as_accurate_as_rtol_demands(rtol):
    """One of the two tested lines turns fast at half time."""
    curve = rb.projected_line(I3, rb.exp_so3([[0.3, 1, -0.5], [2, 2, 0.5]]))
    for cost in (
        partial(rb.acceleration_cost, curve),
        lambda **rtol: rb.acceleration_cost_parts(curve, body=BOOK, **rtol)[0],
        partial(rb.torque_cost, curve, body=BOOK),
        partial(rb.jerk_cost, curve),
    ):
        off = np.abs(cost(rtol=rtol) / cost() - 1).max()
        assert off < max(rtol, 1e-10)
        assert (off > 1e-9) == (rtol == 1e-2)  # the loose tolerance needs fewer times


def test_bad_arguments_are_refused():
    line, motion = rb.geodesic(I3, I3), rb.geodesic(I4, I4)
    acceleration, jerk, torque = rb.acceleration_cost, rb.jerk_cost, rb.torque_cost
    for cost, given, message in (
        (partial(acceleration, body=INERTIA), line, "^body: a Body is wanted, such as Body"),
        (partial(torque, body=2), motion, "^body: a Body is wanted, such as Body"),
        (acceleration, None, "^curve: a Curve is wanted, got None"),
        (jerk, None, "^curve: a Curve is wanted, got None"),
        (jerk, motion, "^curve: a curve on SO.3., as of poses.* is wanted, got <Rigid"),
        *((partial(jerk, rtol=x), line, "^rtol") for x in (0, 1e-13, 0.2, np.nan, [1e-6] * 2)),
    ):
        with pytest.raises(ValueError, match=message):
            cost(given)
