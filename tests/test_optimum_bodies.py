"""The optima of real bodies and of jerk: `solve_bvp`, direct minimisation, closed forms."""

import functools
import re
import warnings

import numpy as np
import oracles
import pytest
from direct_search import least_costs
from scipy.interpolate import CubicHermiteSpline
from scipy.spatial.transform import Rotation

import rbcourse as rb
from rbcourse._hermite import hermite
from rbcourse.closed_forms import CLOSED_FORMS

I3, REST = np.eye(3), np.zeros(3)
ALONG = np.pi / 6 * np.array([1, 2, 3])
PAPER = {
    "4b": (ALONG, ALONG, ALONG + I3[0]),
    "4c": (ALONG, ALONG, ALONG + 5 * I3[0]),
    "5": (np.pi / 6 * np.array([1, 4, 3]), [1.0, 2, 3], [2.0, 1, 1]),
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
every_optimum = pytest.mark.parametrize("what", OPTIMA)
of_forces = pytest.mark.parametrize("what", FORCES)


def some(problems, which):
    return [x[which] for x in problems]


def ends_of(what, problem):
    """The boundary conditions alone."""
    return [*problem[:4], *problem[5:]] if what == "jerk" else problem[:4]


def times(A, x):
    return (A @ x[..., None])[..., 0]


def deviation(what, G, w, a, b=0):
    """u, written down again: what is squared and integrated."""
    if what == "jerk":
        return np.sqrt(2) * (b + np.cross(w, a) / 2)
    torque = times(G, a) + np.cross(w, times(G, w))
    return torque if what == "torque" else times(np.linalg.cholesky(np.linalg.inv(G)).mT, torque)


@pytest.mark.source("beyond BK 3", "beyond BK 4", "beyond BK 5")
@every_optimum
@pytest.mark.parametrize("which", range(6))
def test_solve_bvp_finds_the_same_curve(what, which):
    problem = some(PROBLEMS, which)
    curve, G = OPTIMA[what](*problem), problem[4]
    of = {"acceleration": ("effort", G, np.linalg.inv(G)), "torque": ("effort", G, I3)}
    theirs, cost = oracles.stationary(of.get(what, ("jerk",)), ends_of(what, problem), curve)
    assert curve.cost == pytest.approx(cost * (2 if what == "jerk" else 1), rel=1e-9)
    y = theirs.sol(TIMES)
    assert np.abs(curve(TIMES, 1) - y[4:7].T).max() < 1e-8
    assert np.abs(curve(TIMES) - oracles.rotation_of_quaternions(y[:4])).max() < 1e-8


@pytest.mark.source("beyond BK 3", "beyond BK 4", "beyond BK 5")
@every_optimum
@pytest.mark.parametrize("which", range(2))
def test_no_polynomial_nearby_costs_less(what, which):
    problem = some(random_problems(2, 5, 2.0, 4.0), which)
    curve = OPTIMA[what](*problem)
    u, ends = functools.partial(deviation, what, problem[4]), ends_of(what, problem)
    w, cost = oracles.least_directly(u, ends, curve)
    assert curve.cost == pytest.approx(cost, rel=1e-9)
    assert np.abs(curve(TIMES, 1) - w(TIMES)).max() < 1e-6


@every_optimum
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


@pytest.mark.source("beyond BK 2")
@every_optimum
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


@of_forces
@pytest.mark.parametrize("size", [2.0, 0.3, 1e-6, 1e9])
def test_of_a_round_body_it_is_the_balls_optimum(what, size):
    """And near it for a body that is almost round."""
    ends, power = PROBLEMS[:4], 2 if what == "torque" else 1
    curves, of_balls = OPTIMA[what](*ends, size * I3), rb.minimum_acceleration_so3(*ends)
    for order in (0, 1, 2, 3):
        assert np.array_equal(curves(TIMES, order), of_balls(TIMES, order))
    assert curves.cost == pytest.approx(size**power * of_balls.cost / 2, rel=1e-14)
    assert curves.c == pytest.approx(size**power * of_balls.c, rel=1e-13)
    assert COSTS[what](curves, size * I3) == pytest.approx(curves.cost, rel=1e-10)
    almost = OPTIMA[what](*ends, size * np.diag([1, 1 + 1e-9, 1 - 1e-9]))
    assert almost.cost == pytest.approx(curves.cost, rel=1e-7)
    assert np.abs(almost(TIMES, 1) - of_balls(TIMES, 1)).max() < 1e-5


@of_forces
@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("shares", [(0, 0), (1, 1), (2, 0.5), (-0.3, 1.5)])
def test_about_a_principal_axis_it_is_a_cubic(what, axis, shares):
    G, (j, k), turn = np.diag([1.0, 2.2, 2.9]), shares, 1.3 * I3[axis]
    curve = OPTIMA[what](I3, rb.exp_so3(turn), j * turn, k * turn, G)
    p = CubicHermiteSpline([0, 1], [0, 1], shares)
    assert np.abs(curve(TIMES) - rb.exp_so3(np.outer(p(TIMES), turn))).max() < 1e-11
    square = 12 * 1.3**2 * (1 - j - k + (j**2 + j * k + k**2) / 3)
    moment = G[axis, axis] ** (2 if what == "torque" else 1)
    assert curve.cost == pytest.approx(moment * square, rel=1e-12)


@pytest.mark.source("beyond BK 1", "beyond BK 4")
@of_forces
def test_free_motions_cost_nothing(what):
    """Euler's equations, by SciPy; the ends of the motion lead back to it, at speeds up to 16."""
    rng, few = np.random.default_rng(16), [np.diag([1.0, 2, 2.9]), BOOK]
    w = rng.normal(size=(40, 3))
    w *= rng.uniform(3, 16, (40, 1)) / np.linalg.norm(w, axis=1, keepdims=True)
    w, G = (
        np.concatenate([[[0.8, 0.1, 1.2], [1, 2, 0.3]], w]),
        np.concatenate([few, bodies(40, 17)]),
    )
    flows = [rb.geodesic_flow(*one, [0.0, 0.5, 1.0]) for one in zip(G, [I3] * 42, w, strict=True)]
    A, rates = (np.stack(x, axis=1) for x in zip(*flows, strict=True))
    curves = OPTIMA[what](I3, A[2], w, rates[2], G)
    assert np.all(curves.cost < 1e-15)
    slow = curves[:2]
    assert np.abs(slow(0.5) - A[1, :2]).max() < 1e-9
    assert np.abs(slow(0.5, 1) - rates[1, :2]).max() < 1e-9
    for cost in (slow.cost, COSTS[what](slow, G[:2])):
        assert np.all(cost < 1e-18 * G[:2].max(axis=(1, 2)) ** 2)


@every_optimum
def test_moved_or_reversed_ends_and_another_unit_change_nothing_else(what):
    R0, R1, w0, w1, G, a0, a1 = problems = random_problems(12, 36, 2.5, 5.0)
    L, Q = Rotation.random(2, rng=4).as_matrix()
    curves, (v0, v1, b0, b1) = OPTIMA[what](*problems), np.stack([w0, w1, a0, a1]) @ Q
    R = curves(TIMES)
    moved = OPTIMA[what](L @ R0 @ Q, L @ R1 @ Q, v0, v1, Q.T @ G @ Q, b0, b1)
    back = OPTIMA[what](R1, R0, -w1, -w0, G, a1, a0)
    for other, want in ((moved, L @ R @ Q), (back, R[::-1])):
        assert other.cost == pytest.approx(curves.cost, rel=1e-10)
        assert np.abs(other(TIMES) - want).max() < 1e-8
    if what in FORCES:
        tripled = OPTIMA[what](R0, R1, w0, w1, 3 * G)
        factor = 9 if what == "torque" else 3
        assert tripled.cost == pytest.approx(factor * curves.cost, rel=1e-12)
        assert np.abs(tripled(TIMES) - R).max() < 1e-11
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
    ("case", "wanted"),
    [
        ("4b", [1.066, 1.119, 1.120, 1.120, 1.072]),
        ("4c", [1.217, 1.435, 1.338, 1.318, 1.214]),
        ("5", [1.604, 1.642, 1.050, 1.060, 1.069]),
    ],
)
def test_costs_of_closed_forms_for_the_book(case, wanted):
    turn, w0, w1 = PAPER[case]
    ends = I3, rb.exp_so3(turn), w0, w1
    others = rb.projected_cubic_so3, rb.bezier_so3, rb.minimum_acceleration_so3
    curves = [make(*ends) for make in others]
    curves = [rb.weighted_cubic_so3(*ends, BOOK), *curves, rb.normal_cubic_so3(*ends, BOOK)]
    costs = np.array([rb.acceleration_cost(curve, BOOK) for curve in curves])
    best = rb.minimum_acceleration_so3(*ends, BOOK).cost
    assert costs / best == pytest.approx(wanted, abs=6e-4)


@pytest.mark.source("beyond BK 5")
@pytest.mark.parametrize("angle", [0.1, 1.0, 2.67, np.pi - 1e-9])
def test_least_jerk_from_rest_to_rest_is_the_geodesic(angle):
    axis = np.array([0.6, 0, 0.8])
    curve = rb.minimum_jerk_so3(I3, rb.exp_so3(angle * axis), REST, REST, REST, REST)
    share = TIMES**3 * (10 - 15 * TIMES + 6 * TIMES**2)
    assert np.abs(curve(TIMES) - rb.exp_so3(np.outer(angle * share, axis))).max() < 1e-10
    assert curve.cost == pytest.approx(1440 * angle**2, rel=1e-11)


@every_optimum
def test_many_problems_converge_and_no_closed_form_costs_less(what):
    *ends, G, a0, a1 = problems = random_problems(200, 37)
    best = OPTIMA[what](*problems)
    assert best.converged.all()
    assert best.residual.max() < 1e-11
    chosen = [slice(None)] * 20
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "margin < 1e-6", RuntimeWarning)
        if what == "jerk":
            quintics = rb.projected_quintic_so3, rb.exponential_quintic_so3
            others = [make(*ends, a0, a1) for make in quintics]
        else:
            bodies = np.linalg.eigvalsh(G) @ [1, 1, -1] > 0
            others = [rb.weighted_cubic_so3(*some((*ends, G), bodies))]
            others += [rb.normal_cubic_so3(*ends, G), rb.minimum_acceleration_so3(*ends)]
            others += [make(*ends) for make in CLOSED_FORMS.values()]
            chosen[0] = bodies
    t, weights = np.linspace(0, 1, 2001), np.full(2001, 1 / 2000)
    weights[[0, -1]] /= 2
    for other, those in zip(others, chosen, strict=False):
        rates = (np.moveaxis(other(t, k), 0, 1) for k in (1, 2, 3)[: 3 if what == "jerk" else 2])
        rough = np.sum(deviation(what, G[those][:, None], *rates) ** 2, axis=-1) @ weights
        assert np.all(rough > best.cost[those] * (1 - 1e-3))


@of_forces
def test_fast_problems_have_a_cheapest_way_round(what):
    """Such as a valley along which Newton's method does not find its way."""
    problems = random_problems(40, 38, np.pi, 20.0)
    best = OPTIMA[what](*problems)
    of_balls = rb.minimum_acceleration_so3(*problems[:4])
    assert best.converged.all()
    assert np.all(COSTS[what](of_balls, problems[4]) > best.cost * (1 - 1e-9))


@every_optimum
def test_a_stack_of_which_one_body_is_round_is_what_each_is_alone(what):
    problems = random_problems(6, 39, 2.0, 5.0)
    problems[4][2] = 0.7 * I3
    stack = OPTIMA[what](*(x.reshape(2, 3, *x.shape[1:]) for x in problems))
    alone = [OPTIMA[what](*some(problems, i)) for i in range(6)]
    assert all(type(one.cost) is float for one in alone)
    assert stack.cost == pytest.approx(np.reshape([one.cost for one in alone], (2, 3)), rel=1e-10)
    for order in range(4):
        values = stack(TIMES, order)
        want = np.stack([one(TIMES, order) for one in alone], axis=1).reshape(values.shape)
        assert np.abs(values - want).max() < 1e-10 * (1 + np.abs(values).max())
    assert stack.costate([0.1, 0.2]).shape == (2, 2, 3, 3)
    off = stack[1, 0].costate(0.3) - stack.costate(0.3)[1, 0]
    assert np.abs(off).max() < 1e-12 * (1 + np.abs(stack.c[1, 0]).max())


@every_optimum
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


@every_optimum
def test_no_motion_at_all(what):
    curve = OPTIMA[what](I3, I3, REST, REST, BOOK, REST, REST)
    assert curve.cost == COSTS[what](curve, BOOK) == 0
    assert np.abs(curve(TIMES) - I3).max() < 1e-14


ENDS = I3, I3, REST, REST


@pytest.mark.parametrize(
    "make", [rb.minimum_acceleration_so3, rb.minimum_torque_so3, rb.normal_cubic_so3]
)
@pytest.mark.parametrize(
    ("G", "message"),
    [
        (
            np.diag([1.0, 2, 0]),
            "inertia is not positive definite, to rounding: its eigenvalues are 0, ",
        ),
        (
            np.diag([1.0, 2, -1]),
            "inertia is not positive definite, to rounding: its eigenvalues are -1",
        ),
        (np.stack([I3, -I3]), "inertia[1] is not positive definite"),
        (I3 + 0.1 * I3[1], "inertia is not symmetric"),
        (5e307 * I3, "inertia: eigenvalues from 1e-150 to 1e150 are wanted, they are 5e+307"),
        (1e-310 * BOOK, "inertia: eigenvalues from 1e-150 to 1e150 are wanted"),
    ],
)
def test_bad_inertias_are_named(make, G, message):
    with pytest.raises(ValueError, match=f"^{re.escape(message)}"):
        make(*ENDS, G)


def test_ends_and_inertias_or_accelerations_that_do_not_broadcast_are_named():
    pairs = np.stack([I3] * 2), *ENDS[1:]
    with pytest.raises(ValueError, match=r"do not broadcast: ends \(2,\), inertia \(3,\)"):
        rb.minimum_torque_so3(*pairs, np.stack([I3] * 3))
    with pytest.raises(ValueError, match=r"do not broadcast: ends \(2,\), a0 \(3,\)"):
        rb.minimum_jerk_so3(*pairs, np.zeros((3, 3)), REST)
    assert "MinimumTorque on SO(3)" in repr(rb.minimum_torque_so3(*ENDS, BOOK))


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


@every_optimum
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
    ("numbers", "cost"),
    [
        ("2.751 0.431 1.014  5.098 -0.082 4.558  -5.168 5.805 -4.112  0.399 1.031 1.219", 134.51),
        ("1.532 1.491 0.224  -3.494 7.652 2.381  2.509 5.826 -5.963  0.21 0.544 0.654", 20.98),
    ],
)
def test_tumbling_motions_are_found(numbers, cost):
    """Random starts of other programs led to these costs."""
    turn, w0, w1, moments = np.reshape(numbers.split(), (4, 3)).astype(float)
    curve = rb.minimum_torque_so3(I3, rb.exp_so3(turn), w0, w1, np.diag(moments))
    assert curve.cost == pytest.approx(cost, abs=0.006)


@pytest.mark.source("beyond BK 5")
def test_least_jerk_about_one_axis_is_the_best_quintic_of_all_turns():
    """Of half of them both accelerations add turns."""
    rng, e = np.random.default_rng(55), np.array([0.6, 0, 0.8])
    angle = np.append(rng.uniform(-np.pi, np.pi, 200), [0.8, -0.6])
    w, a = rng.uniform(-9, 9, (2, 202)), rng.uniform(-20, 20, (2, 202))
    w[:, :100], a[:, :100] = rng.uniform(5, 9, (2, 100)), rng.uniform(10, 20, (2, 100))
    a[1, :100] *= -1
    w[:, 200:], a[:, 200:] = [[-8, 5.2], [-8, 7.2]], [[-19, 19], [19, -18]]
    angles = angle + 2 * np.pi * np.arange(-9, 10)[:, None]
    x, weights = np.polynomial.legendre.leggauss(3)
    jerk = [hermite([0 * angles, angles, *w, *a], (t + 1) / 2, 3) for t in x]
    least = np.tensordot(weights, np.square(jerk), axes=1).min(axis=0)
    rates = [x[:, None] * e for x in (*w, *a)]
    curves = rb.minimum_jerk_so3(I3, rb.exp_so3(angle[:, None] * e), *rates)
    assert np.all(curves.cost < least * (1 + 1e-9))
    assert curves.cost[200:] == pytest.approx([3405.8885478242787, 13158.112233979306], rel=1e-10)


def test_accelerations_near_one_axis_add_turns():
    """Without a full turn more it costs 34,447."""
    rates = [[0.0478, -1.2536, 7.2756], [0.7923, 0.2244, 6.3072]]
    rates += [[0.0926, -1.1733, 13.5431], [3.2645, -1.6836, -16.3042]]
    curve = rb.minimum_jerk_so3(I3, rb.exp_so3([0, 0, -1.6796]), *rates)
    assert curve.cost == pytest.approx(6350.394, abs=0.001)


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
    ends = [
        x[: np.prod(shape, dtype=int)].reshape(*shape, *x.shape[1:])
        for x in random_problems(6, 42, 2.0, 4.0)[:4]
    ]
    found = rb.stationary_so3(rb.cumulative_bezier_so3(*ends))
    assert found.batch_shape == shape
    assert found.cost == pytest.approx(rb.minimum_acceleration_so3(*ends).cost, rel=1e-9)


@pytest.mark.parametrize("turn", [110, 120, 140, 170])
@pytest.mark.parametrize("frame", [I3, rb.exp_so3([0.3, -0.5, 0.2])])
def test_of_two_best_curves_rounding_does_not_choose(turn, frame):
    """From rest about the axis of the largest moment: a half-turn about it carries one into the
    other."""
    G, axis, t = frame @ BOOK @ frame.T, frame[:, 2], np.linspace(0, 1, 5)
    R1 = rb.exp_so3(np.radians(turn) * axis)
    first = rb.minimum_torque_so3(I3, R1, REST, REST, G)(t, 1)
    assert np.abs(np.cross(first, axis)).max() > 0.1  # it leaves the axis
    for nudge in np.random.default_rng(turn).normal(scale=1e-15, size=(8, 3)):
        again = rb.minimum_torque_so3(I3, R1 @ rb.exp_so3(nudge), REST, REST, G)(t, 1)
        assert np.abs(again - first).max() < 1e-6


@every_optimum
@pytest.mark.parametrize("axis", [(0, 0, 1), (0.6, -0.8, 0), (-1, 1, 0), (-0.48, -0.6, 0.64)])
def test_of_two_half_turns_rounding_does_not_choose(what, axis):
    """From rest to rest both ways round cost the same."""
    half, t = rb.exp_so3(np.pi * np.array(axis) / np.linalg.norm(axis)), np.linspace(0, 1, 5)
    problem = I3, half, REST, REST, 2 * I3, REST, REST
    first = OPTIMA[what](*problem)(t, 1)
    for nudge in np.random.default_rng(180).normal(scale=1e-15, size=(12, 3)):
        again = OPTIMA[what](I3, half @ rb.exp_so3(nudge), *problem[2:])(t, 1)
        assert np.abs(again - first).max() < 1e-6
