"""Compare the optima with direct minimisation, and test their equations."""

from functools import partial

import numpy as np
import oracles
import pytest
from optima import (
    BOOK,
    COSTS,
    I3,
    OPTIMA,
    PAPER,
    REST,
    deviation,
    random_problems,
    some,
    times,
)
from scipy.interpolate import CubicHermiteSpline
from scipy.spatial.transform import Rotation
from threadpoolctl import threadpool_limits

import rbcourse as rb
from rbcourse._polynomials import grid, interpolation
from rbcourse.optimum._search import Search

every_optimum = pytest.mark.parametrize("what", OPTIMA)
TIMES = np.linspace(0, 1, 101)
FEW = random_problems(2, 5, 2.0, 4.0)


@pytest.mark.source("BK (18)", "BK (19)", "BK (20)", "BK Prop. 7", "BK 6.2", "BK 6.3")
@pytest.mark.source("BK Fig. 4", "BK Fig. 5", "beyond BK 3", "beyond BK 4", "beyond BK 5")
@pytest.mark.parametrize(
    ("what", "problem"),
    [
        ("ball", (I3, rb.exp_so3(PAPER["5"][0]), *PAPER["5"][1:], None, REST, REST)),
        *((what, some(FEW, i)) for what in ("acceleration", "torque", "jerk") for i in range(2)),
    ],
)
def test_direct_minimisation_finds_the_same_curve(what, problem):
    *ends, G, a0, a1 = problem
    curve = OPTIMA[what](*problem)
    ends += [a0, a1] * (what == "jerk")
    w, least = oracles.least_directly(partial(deviation, what, G), ends, curve)
    assert np.abs(curve(TIMES, 1) - w(TIMES)).max() < 1e-6
    assert least == pytest.approx(curve.cost, rel=1e-9)


@pytest.mark.source("beyond BK 2", "BK (19)")
@every_optimum
def test_the_costate_is_constant_in_the_fixed_frame_between_the_nodes(what):
    curves = OPTIMA[what](*random_problems(20, 35))
    t = np.linspace(0.02, 0.98, 37)
    p = curves.costate(t)
    size = 1 + np.abs(p).max(axis=(0, 2))[:, None]
    assert np.all(np.abs(times(curves(t), p) - curves.c) < 1e-11 * size)
    assert np.abs(curves[3].costate(0.3) - curves.costate(0.3)[3]).max() < 1e-11 * size[3]
    slower = curves.retimed(3.0)
    assert times(slower(1.2), slower.costate(1.2)) == pytest.approx(slower.c, rel=1e-9)
    if what == "ball":
        w, a, b = (curves(t, order) for order in (1, 2, 3))
        number = np.vecdot(w, b) - np.vecdot(a, a) / 2
        assert np.array_equal(p, b)
        assert np.all(np.abs(number - number[0]) < 1e-10 * np.abs(number).max(axis=0))


@pytest.mark.parametrize("what", ["acceleration", "torque"])
@pytest.mark.parametrize("size", [2.0, 0.3, 1e-6, 1e9])
def test_a_round_body_has_the_optimum_of_a_ball(what, size):
    """The optimum of an almost round body is near the optimum of a ball."""
    ends, power = random_problems(6, 32)[:4], 2 if what == "torque" else 1
    curves, of_balls = OPTIMA[what](*ends, size * I3), rb.minimum_acceleration(*ends)
    for order in range(4):
        assert np.array_equal(curves(TIMES, order), of_balls(TIMES, order))
    assert curves.cost == pytest.approx(size**power * of_balls.cost / 2, rel=1e-14)
    unit = size**power
    if (what, size) == ("acceleration", 2):  # the ball of metric (12), for which c is R w''
        unit = 1
    assert curves.c == pytest.approx(unit * of_balls.c, rel=1e-13)
    assert COSTS[what](curves, size * I3) == pytest.approx(curves.cost, rel=1e-10)
    almost = OPTIMA[what](*ends, size * np.diag([1, 1 + 1e-9, 1 - 1e-9]))
    assert almost.cost == pytest.approx(curves.cost, rel=1e-7)
    assert np.abs(almost(TIMES, 1) - of_balls(TIMES, 1)).max() < 1e-5


@pytest.mark.source("BK 6.2")
@pytest.mark.parametrize("what", ["ball", "acceleration", "torque"])
@pytest.mark.parametrize("shares", [(1, 1), (0, 0), (2, 0.5), (0, 3), (-0.3, 1.5)])
def test_the_optimum_of_turns_about_a_principal_axis_is_a_cubic(what, shares):
    """All axes of a ball are principal axes."""
    frame, R0 = Rotation.random(2, 4).as_matrix()
    moments, angle = np.array([1.0, 2.2, 2.9]), 1.3 if what in ("acceleration", "torque") else 1.96
    G = (frame * moments) @ frame.T
    p, (j, k) = CubicHermiteSpline([0, 1], [0, 1], shares), shares
    square = 12 * angle**2 * (1 - j - k + (j**2 + j * k + k**2) / 3)
    for axis, moment in zip(frame.T, moments, strict=True):
        turn = angle * axis
        ends = R0, R0 @ rb.exp_so3(turn), j * turn, k * turn
        curve = OPTIMA[what](*ends, (G + G.T) / 2)
        assert np.abs(curve(TIMES) - R0 @ rb.exp_so3(np.outer(p(TIMES), turn))).max() < 1e-11
        for order in (1, 2):
            assert np.abs(curve(TIMES, order) - np.outer(p(TIMES, order), turn)).max() < 1e-9
        factor = {"acceleration": moment, "torque": moment**2}.get(what, 2)
        assert curve.cost == pytest.approx(factor * square, rel=1e-12)


@pytest.mark.source("beyond BK 5")
@pytest.mark.parametrize("angle", [0.1, 1.0, 2.67, np.pi - 1e-9])
def test_the_least_jerk_from_rest_to_rest_follows_the_geodesic(angle):
    axis = np.array([0.6, 0, 0.8])
    curve = rb.minimum_jerk(I3, rb.exp_so3(angle * axis), REST, REST, REST, REST)
    share = TIMES**3 * (10 - 15 * TIMES + 6 * TIMES**2)
    assert np.abs(curve(TIMES) - rb.exp_so3(np.outer(angle * share, axis))).max() < 1e-10
    assert curve.cost == pytest.approx(1440 * angle**2, rel=1e-11)


@every_optimum
def test_reversed_ends_reverse_the_optimum(what):
    size = (100, 36, np.pi, 12.0) if what == "ball" else (12, 36, 2.5, 5.0)
    R0, R1, w0, w1, G, a0, a1 = problems = random_problems(*size)
    curves, back = OPTIMA[what](*problems), OPTIMA[what](R1, R0, -w1, -w0, G, a1, a0)
    R = curves(TIMES)
    assert back.cost == pytest.approx(curves.cost, rel=1e-10)
    assert np.abs(back(TIMES) - R[::-1]).max() < 1e-8
    tripled = OPTIMA[what](R0, R1, w0, w1, 3 * G, a0, a1)
    factor = {"acceleration": 3, "torque": 9}.get(what, 1)
    assert tripled.cost == pytest.approx(factor * curves.cost, rel=1e-12)
    assert np.abs(tripled(TIMES) - R).max() < 1e-11
    assert tripled.c == pytest.approx(factor * curves.c, rel=1e-9)


@pytest.mark.parametrize(("what", "speed"), [*((what, 1e160) for what in OPTIMA), ("ball", 1e3)])
def test_a_problem_without_convergence_does_not_affect_the_others(what, speed):
    problems = random_problems(6, 41, 2.0, 4.0)
    problems[0][4], problems[1][4] = I3, rb.exp_so3([1, 2, 0])
    good, others = OPTIMA[what](*problems), np.arange(6) != 4
    problems[2][4], problems[3][4] = [speed, 0, 0], [0, speed, 0]
    message = r"^1 of 6 problems did not converge, .* \[1, 1\]: their curves are NaN"
    with pytest.warns(RuntimeWarning, match=message) as said:
        curves = OPTIMA[what](*(x.reshape(2, 3, *x.shape[1:]) for x in problems))
    assert [warning.filename for warning in said] == [OPTIMA[what].__code__.co_filename]
    assert np.array_equal(curves.converged.ravel(), others)
    assert np.array_equal(curves.residual.ravel() < 1e-11, others)
    assert curves.cost.ravel()[others] == pytest.approx(good.cost[others], rel=1e-10)
    for order in range(3):
        values = curves(TIMES, order).reshape(101, 6, -1)
        want = good(TIMES, order).reshape(101, 6, -1)
        assert np.isnan(values[:, 4]).all()
        assert np.abs(values - want)[:, others].max() < 1e-10
    own = curves.at_own_times(np.full((2, 3), 0.5)).reshape(6, 3, 3)
    assert np.abs(own - good(0.5))[others].max() < 1e-10
    for values in (own[4], curves.costate(0.5)[1, 1], curves.c[1, 1], curves.cost[1, 1]):
        assert np.isnan(values).all()
    assert np.isfinite(curves.c.reshape(6, 3)[others]).all()


@pytest.mark.source("BK 6.3")
def test_single_problems_without_convergence_raise_an_error():
    R, w = rb.exp_so3([1, 2, 0]), 1e160 * I3[:2]
    with pytest.warns(RuntimeWarning, match=r"^2 of 2 problems .* \[0\]:"):
        curve = rb.minimum_acceleration(I3, R, w, w[::-1])
    assert np.isnan(curve(TIMES)).all()
    with pytest.raises(ValueError, match=r"^guess: a curve is NaN, since it did not converge"):
        rb.optimum.stationary(curve)
    for what, speed in (*((what, 1) for what in OPTIMA), ("ball", 1e-10), ("ball", 1e148)):
        with pytest.raises(
            rb.optimum.ConvergenceError, match=r"residual \S+ after \d+ iter"
        ) as failed:
            OPTIMA[what](I3, R, *(speed * w), BOOK, REST, REST)
        assert isinstance(failed.value, RuntimeError)
        assert failed.value.residual > 1e-11
        assert failed.value.iterations >= 0
    poses, twists = rb.pose_from_components([I3, R], np.eye(2, 3)), np.ones((2, 2, 6))
    twists[:, 1, :3] = w
    with pytest.warns(RuntimeWarning, match=r"^1 of 2 problems .* \[1\]:"):
        broken = rb.minimum_acceleration(*poses, *twists)
    motion = rb.minimum_acceleration(*poses, *twists[:, 0])
    assert np.array_equal(broken.converged, [True, False])
    assert np.array_equal(np.isnan(broken.cost), [False, True])
    assert np.isnan(broken(TIMES)[:, 1, :3, :3]).all()
    for order in range(3):
        assert np.isnan(broken(TIMES, order)[:, 1]).reshape(101, -1).any(axis=1).all()
        assert np.abs(broken(TIMES, order)[:, 0] - motion(TIMES, order)).max() < 1e-10


@pytest.mark.parametrize("make", [rb.minimum_acceleration, rb.minimum_torque])
def test_the_work_for_rods_without_convergence_is_bounded(monkeypatch, make):
    """Each curve from which Newton's method fails takes half a second."""
    real, numbers = Search.follow, []

    def counted(search, curves):
        numbers.append(len(curves))
        assert sum(numbers) <= 40
        real(search, curves)

    monkeypatch.setattr(Search, "follow", counted)
    with pytest.raises(rb.optimum.ConvergenceError, match="iterations; the principal moments"):
        make(I3, rb.exp_so3([0.4, 0.9, -0.3]), REST, I3[1], body=rb.Body(np.diag([1e-6, 1, 1])))


def test_thin_rods_are_solved_and_their_uncertainty_is_told():
    """BFGS on splines found the cost 10.525; Newton's method fails from all curves that
    Gauss–Newton steps without damping reach."""
    ends = I3, rb.exp_so3([0.4, 0.8, -0.5])
    with pytest.warns(RuntimeWarning, match="^the problem may not .* above 20 is not certified$"):
        c = rb.minimum_torque(*ends, body=rb.Body(np.diag([1 / 400, 1, 1])))
    assert c.converged
    assert c.cost < 10.5255
    with pytest.raises(rb.optimum.ConvergenceError, match=r"iterations; the principal moments may"):
        rb.minimum_torque(*ends, body=rb.Body(np.diag([1e-6, 1, 1])))


def test_the_search_warns_if_newtons_method_fails_from_the_cheapest_start(monkeypatch):
    """For the first of three problems, the test lets Newton's method converge only to curves that
    turn the other way."""
    real, turns = Search.follow, rb.exp_so3([[0, 0, 1], [0, 1, 0], [0, 1, 1]])
    ends = I3, turns, [0, 0, 1], [1, 0, 0]
    good = rb.minimum_acceleration(*ends)

    def failing(search, curves):
        far = np.trace(curves.R[:, curves.nodes // 2], axis1=1, axis2=2) < 0
        real(search, curves.take(far | (curves.problem > 0)))

    monkeypatch.setattr(Search, "follow", failing)
    said = r"^1 of 3 problems may not .* \[0\]: a curve that was tried costs less"
    with pytest.warns(RuntimeWarning, match=said) as warned:
        curves = rb.minimum_acceleration(*ends)
    assert [warning.filename for warning in warned] == [__file__]
    assert np.array_equal(curves.converged, [False, True, True])
    assert curves.cost[0] > 100
    assert np.abs(curves(TIMES) - good(TIMES))[:, 1:].max() < 1e-10


@every_optimum
def test_the_optimum_between_equal_rotations_at_rest_does_not_move(what):
    curve = OPTIMA[what](I3, I3, REST, REST, BOOK, REST, REST)
    name = {"ball": "acceleration"}.get(what, what)
    assert f"Optimum of {name} on SO(3), t in [0, 1], cost 0, a proven local minimum" in repr(curve)
    assert curve.cost == COSTS[what](curve, BOOK) == 0
    assert np.abs(curve(TIMES) - I3).max() < 1e-14
    assert np.abs(curve(TIMES, 2)).max() < 1e-14


def test_the_nodes_do_not_depend_on_the_threads_of_blas():
    """The matrices are computed with one thread and with two threads, and must agree bit by bit."""
    found = []
    for threads in (1, 2):
        for kept in (grid, interpolation):
            kept.cache_clear()
        with threadpool_limits(threads):
            found.append([x.tobytes() for x in (*grid(129), interpolation(129, 257))])
    assert found[0] == found[1]


def test_the_solver_improves_a_guess():
    ends = random_problems(6, 42, 2.0, 4.0)[:4]
    found = rb.optimum.stationary(rb.closed_forms.cumulative_bezier(*ends))
    assert found.cost == pytest.approx(rb.minimum_acceleration(*ends).cost, rel=1e-9)
    motion = rb.geodesic(np.eye(4), np.eye(4))
    for guess in (I3, motion, rb.projected_spline([1, 2], [I3] * 2)):
        with pytest.raises(ValueError, match=r"^guess: a Curve on SO\(3\) that starts at t = 0"):
            rb.optimum.stationary(guess)
