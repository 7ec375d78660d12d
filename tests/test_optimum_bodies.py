"""The optima of real bodies and of jerk: `solve_bvp`, direct minimisation, closed forms."""

import functools
import warnings

import numpy as np
import oracles
import pytest
from direct_search import least_costs
from scipy.interpolate import CubicHermiteSpline
from scipy.spatial.transform import Rotation

import rbcourse as rb
from rbcourse.closed_forms import CLOSED_FORMS

I3, REST = np.eye(3), np.zeros(3)
ALONG = np.pi / 6 * np.array([1, 2, 3])
PAPER = {
    "4b": (ALONG, ALONG, ALONG + np.array([1.0, 0, 0])),
    "4c": (ALONG, ALONG, ALONG + np.array([5.0, 0, 0])),
    "5": (np.pi / 6 * np.array([1, 4, 3]), np.array([1.0, 2, 3]), np.array([2.0, 1, 1])),
}
BOOK = rb.metrics.box_inertia([0.3, 0.2, 0.03])
"""The inertia of a book of 1 kg, 30 cm by 20 cm by 3 cm."""

TIMES = np.linspace(0, 1, 101)


def random_problems(count, seed, turn=3.0, speed=9.0):
    """R0, R1, w0, w1, inertias with moments up to (1, 2, 2.9) about random axes, a0, a1."""
    rng = np.random.default_rng(seed)
    vectors = rng.normal(size=(5, count, 3))
    vectors *= rng.random((5, count, 1)) / np.linalg.norm(vectors, axis=-1, keepdims=True)
    sigma, w0, w1, a0, a1 = np.reshape([turn, speed, speed, 20, 20], (5, 1, 1)) * vectors
    moments = 1 + rng.random((count, 3)) * [0, 1, 1.9]
    R0, axes = (Rotation.random(count, rng=rng).as_matrix() for _ in range(2))
    G = axes @ (moments[:, :, None] * axes.mT)
    return R0, R0 @ rb.exp_so3(sigma), w0, w1, (G + G.mT) / 2, a0, a1


PROBLEMS = random_problems(6, 32)
OPTIMA = {
    "acceleration": lambda R0, R1, w0, w1, G, *_: rb.minimum_acceleration_so3(R0, R1, w0, w1, G),
    "torque": lambda R0, R1, w0, w1, G, *_: rb.minimum_torque_so3(R0, R1, w0, w1, G),
    "jerk": lambda R0, R1, w0, w1, _, a0, a1: rb.minimum_jerk_so3(R0, R1, w0, w1, a0, a1),
}
COSTS = {
    "acceleration": lambda curve, G: rb.acceleration_cost(curve, G),
    "torque": lambda curve, G: rb.torque_cost(curve, G),
    "jerk": lambda curve, _: rb.jerk_cost(curve),
}
FORCES = ("acceleration", "torque")


def some(problems, which):
    return [x[which] for x in problems]


def times(A, x):
    return (A @ x[..., None])[..., 0]


def deviation(what, G, w, a, b=0):
    """u, written down again: what is squared and integrated."""
    torque = times(G, a) + np.cross(w, times(G, w))
    return {
        "acceleration": lambda: times(np.linalg.cholesky(np.linalg.inv(G)).mT, torque),
        "torque": lambda: torque,
        "jerk": lambda: np.sqrt(2) * (b + np.cross(w, a) / 2),
    }[what]()


@pytest.mark.source("beyond BK 3", "beyond BK 4", "beyond BK 5")
@pytest.mark.parametrize("what", OPTIMA)
@pytest.mark.parametrize("which", range(6))
def test_solve_bvp_finds_the_same_curve(what, which):
    problem = some(PROBLEMS, which)
    G = problem[4]
    curve = OPTIMA[what](*problem)
    of = {"acceleration": ("effort", G, np.linalg.inv(G)), "torque": ("effort", G, I3)}
    ends = [*problem[:4], *problem[5:]] if what == "jerk" else problem[:4]
    theirs, cost = oracles.stationary(of.get(what, ("jerk",)), ends, curve)
    assert curve.cost == pytest.approx(cost * (2 if what == "jerk" else 1), rel=1e-9)
    assert np.abs(curve(TIMES, 1) - theirs.sol(TIMES)[4:7].T).max() < 1e-8
    assert (
        np.abs(curve(TIMES) - oracles.rotation_of_quaternions(theirs.sol(TIMES)[:4])).max() < 1e-8
    )


@pytest.mark.source("beyond BK 3", "beyond BK 4", "beyond BK 5")
@pytest.mark.parametrize("what", OPTIMA)
@pytest.mark.parametrize("which", range(2))
def test_no_polynomial_nearby_costs_less(what, which):
    problem = some(random_problems(2, 5, 2.0, 4.0), which)
    curve = OPTIMA[what](*problem)
    ends = [*problem[:4], *problem[5:]] if what == "jerk" else problem[:4]
    w, cost = oracles.least_directly(functools.partial(deviation, what, problem[4]), ends, curve)
    assert curve.cost == pytest.approx(cost, rel=1e-9)
    assert np.abs(curve(TIMES, 1) - w(TIMES)).max() < 1e-6


@pytest.mark.parametrize("what", OPTIMA)
def test_the_cost_is_the_integral(what):
    problems = random_problems(5, 33)
    curves = OPTIMA[what](*problems)
    x, weights = np.polynomial.legendre.leggauss(120)
    rates = (np.moveaxis(curves((x + 1) / 2, k), 0, 1) for k in (1, 2, 3))
    u = deviation(what, problems[4][:, None], *rates)
    assert curves.cost == pytest.approx(np.sum(u**2, axis=-1) @ weights / 2, rel=1e-12)
    assert COSTS[what](curves, problems[4]) == pytest.approx(curves.cost, rel=1e-10)
    for i in (0, 3):
        assert COSTS[what](curves[i], problems[4][i]) == pytest.approx(curves.cost[i], rel=1e-10)


@pytest.mark.parametrize("what", OPTIMA)
def test_the_ends_are_met_and_the_rates_are_derivatives(what):
    R0, R1, w0, w1, _, a0, a1 = problems = random_problems(5, 34)
    curves = OPTIMA[what](*problems)
    wanted = [(0, R0, R1), (1, w0, w1), *([(2, a0, a1)] if what == "jerk" else [])]
    for order, start, end in wanted:
        assert np.abs(curves([0, 1], order) - [start, end]).max() < 1e-11
    for t in (0.15, 0.5, 0.9):
        rate = oracles.derivative_by_differences(curves, t)
        assert np.abs(rate - curves(t) @ rb.hat_so3(curves(t, 1))).max() < 1e-8
        for order in (2, 3):
            rate = oracles.derivative_by_differences(lambda u, k=order: curves(u, k - 1), t)
            assert np.abs(rate - curves(t, order)).max() < 1e-10 * (1 + np.abs(rate).max())


@pytest.mark.source("beyond BK 2")
@pytest.mark.parametrize("what", OPTIMA)
def test_the_costate_is_constant_in_the_fixed_frame_between_the_nodes(what):
    """p by its definition, from w and its derivatives; the fourth by differences."""
    problems = random_problems(20, 35)
    curves, G = OPTIMA[what](*problems), problems[4]
    t = np.linspace(0.02, 0.98, 37)
    w, a, b = (curves(t, k) for k in (1, 2, 3))
    if what == "jerk":

        def third(s):
            return oracles.derivative_by_differences(lambda u: curves(u, 3), s)

        d, e = third(t), oracles.derivative_by_differences(third, t)
        j, j1 = b + np.cross(w, a) / 2, d + np.cross(w, b) / 2
        j2 = e + (np.cross(a, b) + np.cross(w, d)) / 2
        p, tolerance = j2 + np.cross(w, j1) / 2 + np.cross(a, j), 1e-7
    else:
        M = np.linalg.inv(G) if what == "acceleration" else I3
        h, h1 = times(G, w), times(G, a)
        v = times(M, h1 + np.cross(w, h))
        v1 = times(M, times(G, b) + np.cross(a, h) + np.cross(w, h1))
        p, tolerance = times(G, v1 + np.cross(w, v)) - np.cross(h, v), 1e-11
    size = 1 + np.abs(p).max(axis=(0, 2))[:, None]
    assert np.all(np.abs(times(curves(t), p) - curves.c) < tolerance * size)
    assert np.all(np.abs(times(curves(t), curves.costate(t)) - curves.c) < 1e-11 * size)
    assert np.abs(curves[3].costate(0.3) - curves.costate(0.3)[3]).max() < 1e-11 * size[3]


@pytest.mark.parametrize("what", FORCES)
@pytest.mark.parametrize("size", [2.0, 0.3, 1e-6, 1e9])
def test_of_a_round_body_it_is_the_balls_optimum(what, size):
    R0, R1, w0, w1, *_ = PROBLEMS
    curves = OPTIMA[what](R0, R1, w0, w1, size * I3)
    of_balls = rb.minimum_acceleration_so3(R0, R1, w0, w1)
    for order in (0, 1, 2, 3):
        assert np.array_equal(curves(TIMES, order), of_balls(TIMES, order))
    power = 2 if what == "torque" else 1
    assert curves.cost == pytest.approx(size**power * of_balls.cost / 2, rel=1e-14)
    assert curves.c == pytest.approx(size**power * of_balls.c, rel=1e-13)
    assert COSTS[what](curves, size * I3) == pytest.approx(curves.cost, rel=1e-10)


def test_almost_round_bodies_are_close_to_round_ones():
    R0, R1, w0, w1, *_ = PROBLEMS
    of_balls = rb.minimum_acceleration_so3(R0, R1, w0, w1)
    for what in FORCES:
        curves = OPTIMA[what](R0, R1, w0, w1, np.diag([1, 1 + 1e-9, 1 - 1e-9]))
        assert curves.cost == pytest.approx(of_balls.cost / 2, rel=1e-7)
        assert np.abs(curves(TIMES, 1) - of_balls(TIMES, 1)).max() < 1e-5


@pytest.mark.parametrize("what", FORCES)
@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("shares", [(0, 0), (1, 1), (2, 0.5), (-0.3, 1.5)])
def test_about_a_principal_axis_it_is_a_cubic(what, axis, shares):
    angle, G = 1.3, np.diag([1.0, 2.2, 2.9])
    e = I3[axis]
    curve = OPTIMA[what](I3, rb.exp_so3(angle * e), shares[0] * angle * e, shares[1] * angle * e, G)
    p = CubicHermiteSpline([0, 1], [0, angle], angle * np.array(shares))
    assert np.abs(curve(TIMES) - rb.exp_so3(np.outer(p(TIMES), e))).max() < 1e-11
    square = (
        12
        * angle**2
        * (1 - sum(shares) + (shares[0] ** 2 + shares[0] * shares[1] + shares[1] ** 2) / 3)
    )
    moment = G[axis, axis] ** (2 if what == "torque" else 1)
    assert curve.cost == pytest.approx(moment * square, rel=1e-12)


@pytest.mark.source("beyond BK 1", "beyond BK 4")
@pytest.mark.parametrize("what", FORCES)
def test_a_free_motion_costs_nothing(what):
    """Euler's equations, by SciPy; the ends of the motion lead back to it."""
    for G, w0 in ((np.diag([1.0, 2, 2.9]), [0.8, 0.1, 1.2]), (BOOK, [1.0, 2.0, 0.3])):
        A, w = rb.geodesic_flow(G, I3, w0, [0.0, 0.5, 1.0])
        curve = OPTIMA[what](I3, A[2], w0, w[2], G)
        assert curve.cost < 1e-18 * np.max(G) ** 2
        assert np.abs(curve(0.5) - A[1]).max() < 1e-9
        assert np.abs(curve(0.5, 1) - w[1]).max() < 1e-9
        assert COSTS[what](curve, G) < 1e-18 * np.max(G) ** 2


@pytest.mark.parametrize("what", OPTIMA)
def test_a_turned_room_turned_axes_reversed_time_and_another_unit_change_nothing_else(what):
    R0, R1, w0, w1, G, a0, a1 = problems = random_problems(12, 36, 2.5, 5.0)
    L, Q = Rotation.random(2, rng=4).as_matrix()
    curves = OPTIMA[what](*problems)
    w, a = (x @ Q for x in ((w0, w1), (a0, a1)))
    moved = OPTIMA[what](L @ R0 @ Q, L @ R1 @ Q, *w, Q.T @ G @ Q, *a)
    assert moved.cost == pytest.approx(curves.cost, rel=1e-10)
    assert np.abs(moved(TIMES) - L @ curves(TIMES) @ Q).max() < 1e-8
    back = OPTIMA[what](R1, R0, -w1, -w0, G, a1, a0)
    assert back.cost == pytest.approx(curves.cost, rel=1e-10)
    assert np.abs(back(1 - TIMES) - curves(TIMES)).max() < 1e-8
    if what in FORCES:
        tripled = OPTIMA[what](R0, R1, w0, w1, 3 * G)
        factor = 9 if what == "torque" else 3
        assert tripled.cost == pytest.approx(factor * curves.cost, rel=1e-12)
        assert np.abs(tripled(TIMES) - curves(TIMES)).max() < 1e-11
        assert tripled.c == pytest.approx(factor * curves.c, rel=1e-9)


def test_the_numbers_that_other_programs_found():
    turn, w0, w1 = PAPER["4c"]
    ends, G = (I3, rb.exp_so3(turn), w0, w1), np.diag([1, 2, 2.9])
    assert rb.minimum_acceleration_so3(*ends, G).cost == pytest.approx(98.454424335438, rel=1e-12)
    assert rb.minimum_torque_so3(*ends, G).cost == pytest.approx(101.909358271737, rel=1e-12)
    jerk = rb.minimum_jerk_so3(*ends, REST, REST)
    assert jerk.cost == pytest.approx(2 * 4550.04139829186, rel=1e-12)


@pytest.mark.source("beyond BK 6", "beyond BK 7")
@pytest.mark.parametrize(
    ("case", "weighted", "unweighted", "bezier", "ball", "normal"),
    [
        ("4b", 1.066, 1.119, 1.120, 1.120, 1.072),
        ("4c", 1.217, 1.435, 1.338, 1.318, 1.214),
        ("5", 1.604, 1.642, 1.050, 1.060, 1.069),
    ],
)
def test_what_closed_forms_cost_for_the_book(case, weighted, unweighted, bezier, ball, normal):
    turn, w0, w1 = PAPER[case]
    ends = I3, rb.exp_so3(turn), w0, w1
    best = rb.minimum_acceleration_so3(*ends, BOOK)
    found = [
        rb.acceleration_cost(curve, BOOK) / best.cost
        for curve in (
            rb.weighted_cubic_so3(*ends, BOOK),
            rb.projected_cubic_so3(*ends),
            rb.bezier_so3(*ends),
            rb.minimum_acceleration_so3(*ends),
            rb.normal_cubic_so3(*ends, BOOK),
        )
    ]
    assert found == pytest.approx([weighted, unweighted, bezier, ball, normal], abs=6e-4)


@pytest.mark.source("beyond BK 5")
@pytest.mark.parametrize("angle", [0.1, 1.0, 2.67, np.pi - 1e-9])
def test_least_jerk_from_rest_to_rest_is_the_geodesic(angle):
    axis = np.array([0.6, 0, 0.8])
    curve = rb.minimum_jerk_so3(I3, rb.exp_so3(angle * axis), REST, REST, REST, REST)
    share = TIMES**3 * (10 - 15 * TIMES + 6 * TIMES**2)
    assert np.abs(curve(TIMES) - rb.exp_so3(np.outer(angle * share, axis))).max() < 1e-10
    assert curve.cost == pytest.approx(1440 * angle**2, rel=1e-11)


@pytest.mark.parametrize("what", OPTIMA)
def test_many_problems_converge_and_no_closed_form_costs_less(what):
    R0, R1, w0, w1, G, a0, a1 = problems = random_problems(200, 37)
    best = OPTIMA[what](*problems)
    assert best.converged.all()
    assert best.residual.max() < 1e-11
    quintics = (rb.projected_quintic_so3, rb.exponential_quintic_so3)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "margin < 1e-6", RuntimeWarning)
        if what == "jerk":
            others = [make(R0, R1, w0, w1, a0, a1) for make in quintics]
        else:
            others = [make(R0, R1, w0, w1) for make in CLOSED_FORMS.values()]
            others += [rb.minimum_acceleration_so3(R0, R1, w0, w1)]
            others += [rb.normal_cubic_so3(R0, R1, w0, w1, G)]
            bodies = np.linalg.eigvalsh(G) @ [1, 1, -1] > 0
            others += [rb.weighted_cubic_so3(*some((R0, R1, w0, w1, G), bodies))]
    t, weights = np.linspace(0, 1, 2001), np.full(2001, 1 / 2000)
    weights[[0, -1]] /= 2
    for other in others:
        chosen = bodies if what != "jerk" and other is others[-1] else slice(None)
        rates = (np.moveaxis(other(t, k), 0, 1) for k in (1, 2, 3)[: 3 if what == "jerk" else 2])
        u = deviation(what, G[chosen][:, None], *rates)
        rough = np.sum(u**2, axis=-1) @ weights
        assert np.all(rough > best.cost[chosen] * (1 - 1e-3))


@pytest.mark.parametrize("what", FORCES)
def test_fast_problems_have_a_cheapest_way_round(what):
    """Such as a valley along which Newton's method does not find its way."""
    problems = random_problems(40, 38, np.pi, 20.0)
    best = OPTIMA[what](*problems)
    of_balls = rb.minimum_acceleration_so3(*problems[:4])
    assert best.converged.all()
    assert np.all(COSTS[what](of_balls, problems[4]) > best.cost * (1 - 1e-9))


@pytest.mark.parametrize("what", OPTIMA)
def test_a_stack_is_what_each_is_alone(what):
    problems = random_problems(6, 39, 2.0, 5.0)
    problems[4][2] = 0.7 * I3
    stack = OPTIMA[what](*(x.reshape(2, 3, *x.shape[1:]) for x in problems))
    assert stack.batch_shape == stack.cost.shape == stack.converged.shape == (2, 3)
    assert stack.c.shape == (2, 3, 3)
    for order, core in ((0, (3, 3)), (1, (3,)), (2, (3,)), (3, (3,))):
        values = stack(TIMES, order)
        assert values.shape == (101, 2, 3, *core)
        for i in range(6):
            alone = OPTIMA[what](*some(problems, i))
            off = np.abs(values[:, i // 3, i % 3] - alone(TIMES, order)).max()
            assert off < 1e-10 * (1 + np.abs(values).max())
            assert type(alone.cost) is float
    one = stack[1, 0]
    assert one.cost == stack.cost[1, 0]
    assert one(0.3, 3) == pytest.approx(stack(0.3, 3)[1, 0], rel=1e-13)
    assert np.abs(one.costate(0.3) - stack.costate(0.3)[1, 0]).max() < 1e-12 * (
        1 + np.abs(one.c).max()
    )
    assert stack.costate([0.1, 0.2]).shape == (2, 2, 3, 3)


@pytest.mark.parametrize("what", OPTIMA)
def test_a_hopeless_problem_is_named_and_harms_no_other(what):
    problems = random_problems(3, 41, 2.0, 4.0)
    good = OPTIMA[what](*problems)
    problems[2][1], problems[3][1] = [1e160, 0, 0], [0, 1e160, 0]
    with pytest.warns(RuntimeWarning, match=r"^1 of 3 problems .* \[1\]: there the curve") as said:
        curves = OPTIMA[what](*problems)
    assert [warning.filename for warning in said] == [__file__]
    assert np.array_equal(curves.converged, [True, False, True])
    assert np.isnan(curves(0.5, 3)[1]).all()
    assert np.isnan(curves.costate(0.5)[1]).all()
    assert np.isnan([*curves.c[1], curves.cost[1]]).all()
    assert np.abs(curves(TIMES)[:, [0, 2]] - good(TIMES)[:, [0, 2]]).max() < 1e-10
    with pytest.raises(rb.ConvergenceError, match=r"residual \S+ after \d+ iterations"):
        OPTIMA[what](*some(problems, 1))


@pytest.mark.parametrize("what", OPTIMA)
def test_no_motion_at_all(what):
    curve = OPTIMA[what](I3, I3, REST, REST, BOOK, REST, REST)
    assert curve.cost == 0
    assert np.abs(curve(TIMES) - I3).max() < 1e-14
    assert COSTS[what](curve, BOOK) == 0


def test_bad_arguments_are_named():
    ends = I3, I3, REST, REST
    for make in (rb.minimum_acceleration_so3, rb.minimum_torque_so3, rb.normal_cubic_so3):
        for G, said in (
            (
                np.diag([1.0, 2, 0]),
                r"^inertia is not positive definite, to rounding: its eigenvalues are 0, 1, 2",
            ),
            (
                np.diag([1.0, 2, -1]),
                r"^inertia is not positive definite, to rounding: its eigenvalues are -1",
            ),
            (np.array([[1, 0.1, 0], [0, 1, 0], [0, 0, 1]]), r"^inertia is not symmetric"),
            (
                5e307 * I3,
                r"^inertia: eigenvalues from 1e-150 to 1e150 are wanted, they are 5e\+307",
            ),
            (1e-310 * BOOK, r"^inertia: eigenvalues from 1e-150 to 1e150 are wanted"),
            (np.diag([1.0, 2, np.nan]), r"^inertia\[2, 2\] is nan"),
            ([1.0, 2, 3], r"^inertia: shape \(\.\.\., 3, 3\) wanted, got \(3,\)"),
        ):
            with pytest.raises(ValueError, match=said):
                make(*ends, G)
        with pytest.raises(ValueError, match=r"^inertia\[1\] is not positive definite"):
            make(*ends, np.stack([I3, -I3]))
        with pytest.raises(ValueError, match=r"do not broadcast: ends \(2,\), inertia \(3,\)"):
            make(np.stack([I3] * 2), *ends[1:], np.stack([I3] * 3))
    with pytest.raises(ValueError, match=r"^a1: shape \(\.\.\., 3\) wanted, got \(2,\)"):
        rb.minimum_jerk_so3(*ends, REST, [0, 0])
    with pytest.raises(ValueError, match=r"do not broadcast: ends \(2,\), a0 \(3,\)"):
        rb.minimum_jerk_so3(np.stack([I3] * 2), *ends[1:], np.zeros((3, 3)), REST)
    for turn in (rb.minimum_torque_so3(*ends, BOOK), rb.minimum_jerk_so3(*ends, REST, REST)):
        with pytest.raises(ValueError, match="order: 0, 1, 2 or 3 wanted, got 4"):
            turn(0.5, 4)
    assert "MinimumTorque on SO(3)" in repr(rb.minimum_torque_so3(*ends, BOOK))


@pytest.mark.parametrize(
    ("what", "which", "cost"),
    [
        ("acceleration", 79, 256.965743468),  # from one that is lowered in torque first;
        ("acceleration", 654, 359.307210288),
        ("torque", 565, 615.812105282),  # from one that is lowered in acceleration first;
        ("torque", 177, 314.084506816),  # only after many steps down a valley
    ],
)
def test_the_cheapest_curve_that_is_known_is_found(what, which, cost):
    curve = OPTIMA[what](*some(random_problems(800, 50), which))
    assert curve.cost == pytest.approx(cost, rel=1e-9)


@pytest.mark.parametrize("what", OPTIMA)
def test_another_optimiser_finds_no_cheaper_curve_from_random_starts(what):
    problems = random_problems(16, 84)
    problems[4][:] = bodies(16, 85)
    least = least_costs(what, problems, 16, seed=86)
    assert np.all(OPTIMA[what](*problems).cost < least * (1 + 1e-6))


def bodies(count, seed):
    """Inertias of bodies whose largest moment is up to ten times the least one."""
    rng = np.random.default_rng(seed)
    moments = np.sort(np.exp(rng.uniform(0, np.log(10), (20 * count, 3))), axis=1)
    moments = moments[moments @ [1, 1, -1] > 0][:count]
    axes = Rotation.random(count, rng=rng).as_matrix()
    G = axes @ (moments[:, :, None] * axes.mT)
    return (G + G.mT) / 2


@pytest.mark.parametrize(
    ("turn", "w0", "w1", "moments", "cost"),
    [
        (
            (2.751, 0.431, 1.014),
            (5.098, -0.082, 4.558),
            (-5.168, 5.805, -4.112),
            (0.399, 1.031, 1.219),
            134.51,
        ),
        (
            (1.532, 1.491, 0.224),
            (-3.494, 7.652, 2.381),
            (2.509, 5.826, -5.963),
            (0.21, 0.544, 0.654),
            20.98,
        ),
    ],
)
def test_tumbling_motions_are_found(turn, w0, w1, moments, cost):
    """Random starts of other programs led to these costs."""
    curve = rb.minimum_torque_so3(I3, rb.exp_so3(turn), w0, w1, np.diag(moments))
    assert curve.cost == pytest.approx(cost, abs=0.006)


@pytest.mark.parametrize("what", FORCES)
def test_free_motions_of_speeds_up_to_16_cost_nothing(what):
    count, rng = 40, np.random.default_rng(16)
    G = bodies(count, 17)
    w0 = rng.normal(size=(count, 3))
    w0 *= rng.uniform(3, 16, (count, 1)) / np.linalg.norm(w0, axis=1, keepdims=True)
    ends = [rb.geodesic_flow(g, I3, w, [0.0, 1.0]) for g, w in zip(G, w0, strict=True)]
    R1, w1 = (np.stack([x[i][1] for x in ends]) for i in (0, 1))
    assert np.all(OPTIMA[what](I3, R1, w0, w1, G).cost < 1e-15)


def cost_of_quintic(angle, w, a):
    """The cost of a turn by the quintic with these ends: twice the integral of p'''²."""
    powers = [np.polynomial.Polynomial.basis(k) for k in range(6)]
    at = [[p.deriv(d)(t) if d else p(t) for p in powers] for t in (0.0, 1) for d in (0, 1, 2)]
    p = np.linalg.solve(at, np.stack([0 * angle, w[0], a[0], angle, w[1], a[1]]))
    third, fourth, fifth = 6 * p[3], 24 * p[4], 60 * p[5]  # p''' = third + fourth t + fifth t²
    square = third**2 + third * fourth + (fourth**2 + 2 * third * fifth) / 3
    return 2 * (square + fourth * fifth / 2 + fifth**2 / 5)


@pytest.mark.source("beyond BK 5")
def test_least_jerk_about_one_axis_is_the_best_quintic_of_all_turns():
    rng = np.random.default_rng(55)
    angle = rng.uniform(-np.pi, np.pi, 200)
    w, a = rng.uniform(-9, 9, (2, 200)), rng.uniform(-20, 20, (2, 200))
    w[:, :100], a[:, :100] = rng.uniform(5, 9, (2, 100)), rng.uniform(10, 20, (2, 100))
    a[1, :100] *= -1  # so that both accelerations add turns
    least = np.min([cost_of_quintic(angle + 2 * np.pi * k, w, a) for k in range(-9, 10)], axis=0)
    e = np.array([0.6, 0, 0.8])
    rates = [x[:, None] * e for x in (*w, *a)]
    curves = rb.minimum_jerk_so3(I3, rb.exp_so3(angle[:, None] * e), *rates)
    assert np.all(curves.cost < least * (1 + 1e-9))


def test_accelerations_near_one_axis_add_turns():
    """Without a full turn more it costs 34,447."""
    rates = (
        [0.0478, -1.2536, 7.2756],
        [0.7923, 0.2244, 6.3072],
        [0.0926, -1.1733, 13.5431],
        [3.2645, -1.6836, -16.3042],
    )
    curve = rb.minimum_jerk_so3(I3, rb.exp_so3([0, 0, -1.6796]), *rates)
    assert curve.cost == pytest.approx(6350.394, abs=0.001)


@pytest.mark.parametrize(
    ("turn", "rates", "cost"),
    [
        (0.8, (-8, -8, -19, 19), 3405.8885478242787),
        (-0.6, (5.2, 7.2, 19, -18), 13158.112233979306),
    ],
)
def test_accelerations_add_turns(turn, rates, cost):
    """About one axis each winding has its quintic; these are the cheapest."""
    e = np.array([0, 0, 1.0])
    curve = rb.minimum_jerk_so3(I3, rb.exp_so3(turn * e), *(x * e for x in rates))
    assert curve.cost == pytest.approx(cost, rel=1e-10)


@pytest.mark.parametrize("moments", [(1, 2.22, 3.18), (0.3, 1, 1.28)])
def test_a_turn_about_the_largest_moment_may_leave_its_axis(moments):
    """From rest to rest the turn about the axis is a saddle of the torque, if it is large."""
    G, end = np.diag(moments), rb.exp_so3([0, 0, 3.1])
    along_the_axis = 12 * (moments[2] * 3.1) ** 2
    exact = rb.minimum_torque_so3(I3, end, REST, REST, G)
    assert exact.cost < 0.9 * along_the_axis
    near = rb.minimum_torque_so3(I3, rb.exp_so3([1e-4, 2e-4, 3.1]), REST, REST, G)
    assert near.cost == pytest.approx(exact.cost, rel=1e-3)
    small = rb.minimum_torque_so3(I3, rb.exp_so3([0, 0, 1.0]), REST, REST, G)
    assert small.cost == pytest.approx(12 * moments[2] ** 2, rel=1e-10)


@pytest.mark.parametrize("shape", [(), (6,), (2, 3), (0,)])
def test_one_guess_is_followed(shape):
    R0, R1, w0, w1, *_ = random_problems(6, 42, 2.0, 4.0)
    count = int(np.prod(shape))
    ends = [
        x[0] if shape == () else x[:count].reshape(*shape, *x.shape[1:]) for x in (R0, R1, w0, w1)
    ]
    found = rb.stationary_so3(rb.cumulative_bezier_so3(*ends))
    assert found.batch_shape == shape
    assert found.cost == pytest.approx(rb.minimum_acceleration_so3(*ends).cost, rel=1e-9)


@pytest.mark.parametrize("turn", [110, 120, 140, 170])
def test_of_two_best_curves_rounding_does_not_choose(turn):
    """From rest about the axis of the largest moment: a half-turn about it carries one into the
    other."""
    axes = rb.exp_so3([0.3, -0.5, 0.2])
    for frame in (np.eye(3), axes):
        G, axis = frame @ BOOK @ frame.T, frame[:, 2]
        R1, rest, t = rb.exp_so3(np.radians(turn) * axis), np.zeros(3), np.linspace(0, 1, 5)
        first = rb.minimum_torque_so3(np.eye(3), R1, rest, rest, G)(t, 1)
        assert np.abs(np.cross(first, axis)).max() > 0.1  # it leaves the axis
        for nudge in np.random.default_rng(turn).normal(scale=1e-15, size=(8, 3)):
            again = rb.minimum_torque_so3(np.eye(3), R1 @ rb.exp_so3(nudge), rest, rest, G)(t, 1)
            assert np.abs(again - first).max() < 1e-6


@pytest.mark.parametrize("what", OPTIMA)
@pytest.mark.parametrize("axis", [(0, 0, 1), (0.6, -0.8, 0), (-1, 1, 0), (-0.48, -0.6, 0.64)])
def test_of_two_half_turns_rounding_does_not_choose(what, axis):
    """From rest to rest both ways round cost the same."""
    half, t = rb.exp_so3(np.pi * np.array(axis) / np.linalg.norm(axis)), np.linspace(0, 1, 5)
    problem = I3, half, REST, REST, 2 * I3, REST, REST
    first = OPTIMA[what](*problem)(t, 1)
    for nudge in np.random.default_rng(180).normal(scale=1e-15, size=(12, 3)):
        again = OPTIMA[what](I3, half @ rb.exp_so3(nudge), *problem[2:])(t, 1)
        assert np.abs(again - first).max() < 1e-6
