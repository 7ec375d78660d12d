import pickle

import awkward
import numpy as np
import oracles
import pytest
from scipy.spatial.transform import Rotation, Slerp

import rbcourse as rb
from rbcourse.curves import SingularTime, least_over_time

EPS = np.finfo(float).eps
RNG = np.random.default_rng(61)
STARTS = Rotation.random(30, rng=RNG).as_matrix()
TIMES = np.linspace(0, 1, 9)


def turns(angles):
    """One rotation vector of each angle, about random axes."""
    axes = RNG.normal(size=(len(angles), 3))
    return np.asarray(angles)[:, None] * axes / np.linalg.norm(axes, axis=1, keepdims=True)


ANGLES = np.concatenate(
    [RNG.uniform(0, 3.1, 22), 10.0 ** -np.array([1, 3, 6, 9, 12]), [0, 3.14, 3.1415]]
)
TURNS = turns(ANGLES)
GOALS = STARTS @ np.array([oracles.exp_so3(w) for w in TURNS])
GEODESICS = rb.geodesic_so3(STARTS, GOALS)
LINES = rb.projected_line_so3(STARTS, GOALS)


def quick(t, order):
    """A reparameterisation that leaves [0, 1]: 4 t² − 3 t."""
    return (4 * t**2 - 3 * t, 8 * t - 3, 8 + 0 * t)[order]


@pytest.mark.source("BK 6.1")
def test_the_geodesic_turns_uniformly_about_one_axis():
    for R0, w, i in zip(STARTS, TURNS, range(30), strict=True):
        want = np.array([R0 @ oracles.exp_so3(t * w) for t in TIMES])
        assert np.abs(GEODESICS(TIMES)[:, i] - want).max() < 20 * EPS


@pytest.mark.source("BK 6.1")
def test_the_geodesic_agrees_with_scipy():
    for i in range(22):
        slerp = Slerp([0, 1], Rotation.from_matrix([STARTS[i], GOALS[i]]))
        assert np.abs(GEODESICS(TIMES)[:, i] - slerp(TIMES).as_matrix()).max() < 40 * EPS


@pytest.mark.source("BK Remark 7")
def test_the_geodesic_is_slerp():
    q0, q1 = rb.quaternion_from_matrix(STARTS), rb.quaternion_from_matrix(GOALS)
    slerp = rb.matrix_from_quaternion(rb.slerp(q0, q1, TIMES))
    assert np.abs(GEODESICS(TIMES) - slerp).max() < 40 * EPS


@pytest.mark.source("BK 6.1")
def test_the_geodesics_velocity_is_constant_and_its_length_the_angle():
    assert np.array_equal(
        GEODESICS(TIMES, 1), np.broadcast_to(GEODESICS.rotation_vector, (9, 30, 3))
    )
    assert np.all(GEODESICS(TIMES, 2) == 0)
    assert np.abs(np.linalg.norm(GEODESICS(0.3, 1), axis=-1) - ANGLES).max() < 20 * EPS


@pytest.mark.parametrize("curve", [GEODESICS, LINES], ids=["geodesic", "projected line"])
def test_both_ends_are_met(curve):
    assert np.abs(curve(0) - STARTS).max() < 8 * EPS
    assert np.abs(curve(1) - GOALS).max() < 20 * EPS


@pytest.mark.source("BK Prop. 6", "BK (15)", "BK Cor. 1")
@pytest.mark.parametrize("f", [None, quick], ids=["the identity", "one that leaves the interval"])
def test_the_projected_line_is_the_projection_of_the_line(f):
    curves, t = rb.projected_line_so3(STARTS, GOALS, f), np.linspace(0, 1, 21)
    x = (t if f is None else quick(t, 0))[:, None, None, None]
    M = STARTS + (GOALS - STARTS) * x
    R = rb.project_so(M)
    margin = oracles.two_smallest_eigenvalues(np.swapaxes(R, -1, -2) @ M)
    off = np.abs(curves(t) - R).max(axis=(-2, -1))
    scale = np.linalg.norm(M, axis=(-2, -1))
    assert np.all(off < 10 * EPS * scale / margin)


@pytest.mark.source("BK Prop. 6", "BK (17)")
def test_the_margin_is_the_least_sum_of_the_two_smallest_eigenvalues():
    for i in range(len(ANGLES)):
        t = np.linspace(0, 1, 1001)[:, None, None]
        M = STARTS[i] + (GOALS[i] - STARTS[i]) * t
        sums = oracles.two_smallest_eigenvalues(np.swapaxes(rb.project_so(M), -1, -2) @ M)
        assert abs(sums.min() - LINES.margin[i]) < 20 * EPS


@pytest.mark.source("BK Cor. 1")
def test_geodesic_and_projected_line_follow_the_same_path():
    """The rotation between a point of one and the start is about the axis of the other."""
    between = rb.log_so3(np.swapaxes(STARTS, -1, -2) @ LINES(TIMES))
    across = np.cross(between, TURNS)
    assert np.abs(across).max() < 40 * EPS * np.pi


@pytest.mark.source("BK Cor. 2")
def test_the_line_run_through_as_f_projects_to_the_geodesic():
    angle = np.linalg.norm(GEODESICS.rotation_vector, axis=-1)
    lines = rb.projected_line_so3(
        STARTS, GOALS, lambda t, order: rb.projected_line.f(t, angle, order)
    )
    growth = 1 + 2 * np.tan(angle / 2) / np.maximum(angle, 1)
    for order in (0, 1, 2):
        core = (-2, -1) if order == 0 else -1
        off = np.abs(lines(TIMES, order) - GEODESICS(TIMES, order)).max(axis=core)
        assert np.all(off < 20 * EPS * growth ** (1 + order))


@pytest.mark.parametrize("f", [None, quick], ids=["the identity", "one that leaves the interval"])
def test_velocity_and_acceleration_are_the_derivatives(f):
    few = ANGLES < 2.5
    curves = rb.projected_line_so3(STARTS[few], GOALS[few], f)
    for t in (0.2, 0.5, 0.7):
        rate = oracles.derivative_by_differences(curves, t)
        velocity = rb.vee_so3(np.swapaxes(curves(t), -1, -2) @ rate)
        assert np.abs(curves(t, 1) - velocity).max() < 1e-9
        acceleration = oracles.derivative_by_differences(lambda u: curves(u, 1), t)
        assert np.abs(curves(t, 2) - acceleration).max() < 1e-8


@pytest.mark.source("BK 6.1", "BK Prop. 3")
def test_moving_the_ends_moves_the_curve():
    L, Q = Rotation.random(2, rng=1).as_matrix()
    for make in (rb.geodesic_so3, rb.projected_line_so3):
        curve, moved = make(STARTS[:22], GOALS[:22]), make(L @ STARTS[:22] @ Q, L @ GOALS[:22] @ Q)
        bound = 80 * EPS / LINES.margin[:22, None, None]
        assert np.all(np.abs(moved(TIMES) - L @ curve(TIMES) @ Q) < bound)


def test_no_turn_at_all():
    for make in (rb.geodesic_so3, rb.projected_line_so3):
        curve = make(np.eye(3), np.eye(3))
        assert np.array_equal(curve(TIMES), np.broadcast_to(np.eye(3), (9, 3, 3)))
        for order in (1, 2):
            assert np.all(curve(TIMES, order) == 0)
    assert rb.projected_line_so3(np.eye(3), np.eye(3)).margin == 2


def named_sign(n):
    """The axes ±n whose component of largest magnitude, the first of equals, is positive."""
    first = np.argmax(np.abs(n) > np.abs(n).max(axis=1, keepdims=True) - 1e-9, axis=1)
    return n * np.sign(np.take_along_axis(n, first[:, None], axis=1))


def half_turn_pairs():
    exact, axes = awkward.half_turns()
    R0, R1, n = awkward.rounded_half_turns(np.random.default_rng(180))
    start = np.broadcast_to(np.eye(3), exact.shape)
    return np.concatenate([start, R0]), np.concatenate([exact, R1]), np.concatenate([axes, n])


def test_between_rotations_a_half_turn_apart_the_geodesic_is_a_shortest_one_and_says_which():
    R0, R1, n = half_turn_pairs()
    curves = rb.geodesic_so3(R0, R1)
    assert np.abs(curves.rotation_vector - np.pi * named_sign(n)).max() < 40 * EPS
    assert np.abs(curves(1) - R1).max() < 40 * EPS


def test_between_rotations_a_half_turn_apart_the_middle_of_the_line_is_refused():
    for R0, R1, _ in zip(*half_turn_pairs(), strict=True):
        with pytest.warns(RuntimeWarning, match="^margin < 1e-6: .* jumps there"):
            curve = rb.projected_line_so3(R0, R1)
        assert 0 <= curve.margin < 8 * EPS
        assert np.abs(curve([0, 0.25, 0.75, 1]) - [R0, R0, R1, R1]).max() < 80 * EPS
        for order in (0, 1, 2):
            with pytest.raises(ValueError, match=r"^t = 0\.5: the nearest rotation .* not unique"):
                curve([0.25, 0.5], order)


def test_a_timed_line_is_told_where_on_the_line_its_margin_is():
    w = [0, 0, np.pi - 1e-7]
    with pytest.warns(RuntimeWarning, match=r": 1\.0e-07 at f\(t\) = 0\.5; "):
        rb.projected_line_so3(np.eye(3), rb.exp_so3(w), lambda t, k: (t * t, 2 * t, 2 + 0 * t)[k])


def test_in_a_stack_the_pair_a_half_turn_apart_is_named():
    R1 = np.stack([np.diag([1.0, 1, 1]), np.diag([-1.0, 1, -1])])
    with pytest.warns(RuntimeWarning, match=r"of curve \[0, 1\]"):
        curve = rb.projected_line_so3(np.eye(3), np.stack([R1, R1[::-1], R1[:1].repeat(2, 0)]))
    with pytest.raises(ValueError, match=r"t = 0\.5 of curve \[0, 1\]: the nearest rotation"):
        curve([0.1, 0.5])


def test_just_before_the_half_turn_the_line_is_still_right():
    w = np.array([0, 0, np.pi - 1e-8])
    with pytest.warns(RuntimeWarning, match="^margin < 1e-6: 1.0e-08 at t = 0.5; "):
        curve = rb.projected_line_so3(np.eye(3), oracles.exp_so3(w))
    assert abs(curve.margin - 1e-8) < 4 * EPS
    want = oracles.theta(0.5 + 1e-9, w[2]) * w[2]
    assert abs(rb.log_so3(curve(0.5 + 1e-9))[2] - want) < 20 * EPS / 1e-8


@pytest.mark.source("BK 6.1")
@pytest.mark.parametrize("i", [0, 5, 22, 26, 27, 29])
def test_at_many_times_the_geodesic_is_rodrigues_formula(i):
    """More times than are worked out together; against 60 digits, at some of all of them."""
    t = np.random.default_rng(i).random(100_000)
    curve = rb.geodesic_so3(np.eye(3), oracles.exp_so3(TURNS[i]))
    R = curve(t)
    assert R.shape == (100_000, 3, 3)
    for k in (0, 4095, 4096, 8191, 8192, 50_000, 98_303, 98_304, 99_999):
        assert np.abs(R[k] - oracles.exp_so3(t[k] * TURNS[i])).max() < 8 * EPS
    assert np.abs(R.mT @ R - np.eye(3)).max() < 16 * EPS
    assert np.abs(R[::-1] - curve(t[::-1])).max() < 4 * EPS


@pytest.mark.parametrize("f", [None, quick], ids=["the identity", "one that leaves the interval"])
def test_at_many_times_the_line_is_what_it_is_at_each(f):
    t = np.random.default_rng(7).random(10_000)
    line = rb.projected_line_so3(STARTS[3], GOALS[3], f)
    bound = 20 * EPS / line.margin
    for order in (0, 1, 2):
        values = line(t, order)
        for k in (0, 4095, 4096, 8192, 9999):
            scale = max(1, np.abs(values[k]).max())
            assert np.abs(values[k] - line(t[k], order)).max() < bound * scale


def test_at_the_start_the_geodesic_is_the_start():
    for i in range(len(ANGLES)):
        curve = rb.geodesic_so3(STARTS[i], GOALS[i])
        assert np.array_equal(curve(0), STARTS[i])
        assert np.array_equal(curve(np.zeros(5000))[[0, -1]], STARTS[[i, i]])
    assert np.array_equal(GEODESICS(0), STARTS)
    for R in STARTS:
        assert np.array_equal(rb.geodesic_so3(np.eye(3), np.eye(3))(TIMES)[4], np.eye(3))
        assert np.abs(rb.geodesic_so3(R, R)(TIMES) - R).max() < 4 * EPS


def test_geodesics_over_half_turns_are_rodrigues_formula():
    """About the axis they say, to the end of the interval, where the tangent is infinite."""
    R0, R1, n = half_turn_pairs()
    n = named_sign(n)
    cross = rb.hat_so3(n)
    for t in (1e-9, 0.25, 0.5, 1 - 2.0**-53, 1):
        sine, versine = np.sin(np.pi * t), 1 - np.cos(np.pi * t)
        want = R0 @ (np.eye(3) + sine * cross + versine * cross @ cross)
        assert np.abs(rb.geodesic_so3(R0, R1)(t) - want).max() < 20 * EPS
        for k in range(0, len(R0), 25):
            assert np.abs(rb.geodesic_so3(R0[k], R1[k])(t) - want[k]).max() < 20 * EPS


def test_f_may_be_a_constant_rate_and_must_have_the_right_ends():
    curve = rb.projected_line_so3(STARTS[:2], GOALS[:2], lambda t, order: (t, 1, 0)[order])
    assert np.array_equal(curve(TIMES, 2), rb.projected_line_so3(STARTS[:2], GOALS[:2])(TIMES, 2))
    with pytest.raises(ValueError, match=r"f: f\(0\) = 0 and f\(1\) = 1 are wanted"):
        rb.projected_line_so3(STARTS[0], GOALS[0], lambda t, order: t / 2)
    with pytest.raises(ValueError, match=r"f\(t, 0\): shape \(2,\) wanted, got \(3,\)"):
        rb.projected_line_so3(STARTS[0], GOALS[0], lambda t, order: np.zeros(3))
    with pytest.raises(ValueError, match=r"^t = 0\.0: f\(t, 0\) is not a finite number"):
        rb.projected_line_so3(STARTS[0], GOALS[0], lambda t, order: np.nan)


def test_f_without_its_angle_is_refused():
    with pytest.raises(ValueError, match=r"^f: it must be bound to an angle"):
        rb.projected_line_so3(STARTS[0], GOALS[0], rb.projected_line.f)
    for no_function in (0, 1, [], "f"):
        with pytest.raises(ValueError, match=r"f: a callable f\(t, order\) is wanted"):
            rb.projected_line_so3(STARTS[0], GOALS[0], no_function)


def test_f_may_work_in_place_and_end_at_rounding():
    def squared(t, order):
        t *= t
        return (t * (1 + 1e-14), 2 * np.sqrt(t), 2)[order]

    curve = rb.projected_line_so3(STARTS[0], GOALS[0], squared)
    want = rb.projected_line_so3(STARTS[0], GOALS[0], lambda t, order: (t**2, 2 * t, 2)[order])
    for order in (0, 1, 2):
        assert np.abs(curve(TIMES, order) - want(TIMES, order)).max() < 1e-10
    with pytest.raises(ValueError, match=r"are wanted, got 0\.0 and 1\.000001"):
        rb.projected_line_so3(STARTS[0], GOALS[0], lambda t, order: t * 1.000001)


def test_a_time_of_its_own_at_which_a_curve_jumps_is_named():
    half = np.diag([1.0, -1, -1])
    with pytest.warns(RuntimeWarning, match=r"of curve \[1\]"):
        stack = rb.projected_cubic_so3(np.eye(3), [np.eye(3), half], np.zeros(3), np.zeros(3))
    t = np.full((3000, 2), [0.5, 0.25])
    assert np.isfinite(stack.at_own_times(t)).all()
    t[2999, 1] = 0.5
    with pytest.raises(ValueError, match=r"^t = 0\.5 of curve \[1\]: the nearest"):
        stack.at_own_times(t)


def test_the_least_over_time_is_found_wherever_it_is():
    """Of kinks to rounding; of parabolas, which are flat there, to the root of it."""
    where = np.array([[0, 1e-9, 1 / 3], [0.5, 0.9999, 1]])
    kinks = least_over_time(lambda t: 2 + np.abs(t - where), (2, 3))
    parabolas = least_over_time(lambda t: 2 + (t - where) ** 2, (2, 3))
    for (when, least), reach in ((kinks, 4 * EPS), (parabolas, 4 * np.sqrt(EPS))):
        assert when.shape == least.shape == (2, 3)
        assert np.abs(when - where).max() < reach
        assert np.abs(least - 2).max() < 8 * EPS
    when, least = least_over_time(lambda t: np.cos(7 * t) - t, ())
    t = np.linspace(0, 1, 100_001)
    assert least <= (np.cos(7 * t) - t).min()
    assert abs(least - (np.cos(7 * when) - when)) < 4 * EPS
    assert [x.shape for x in least_over_time(np.sin, (2, 0))] == [(2, 0), (2, 0)]


def test_f_for_each_curve_of_a_stack_is_picked_with_it():
    p = np.arange(1, 7).reshape(2, 3)

    def powers(t, order):
        return (1, p, p * (p - 1))[order] * t ** np.maximum(p - order, 0)

    stack = rb.projected_line_so3(STARTS[:3], GOALS[:6].reshape(2, 3, 3, 3), powers)
    for order in (0, 1, 2):
        assert np.abs(stack[1, ::2](TIMES, order) - stack(TIMES, order)[:, 1, ::2]).max() < 1e-13


def test_what_failed_in_a_stack_stays_failed():
    R = rb.exp_so3([[0, 0, 1], [1, 0, 0]])
    w = np.array([[0, 0, 0], [90, 300.0, -500]])
    with pytest.warns(RuntimeWarning):
        stack = rb.minimum_acceleration_so3(np.eye(3), R, w, -w)
    assert stack.converged.tolist() == [True, False]
    assert stack[0].converged
    assert not stack[1].converged
    assert np.isnan(stack[1](0.5)).all()
    out = stack.at_own_times([0.5, 0.5])
    assert np.abs(out[0] - stack(0.5)[0]).max() < 1e-14
    assert np.isnan(out[1]).all()


def test_an_error_of_a_time_survives_a_pickle():
    error = SingularTime(0.5, 3, "no rotation", (2, 2))
    again = pickle.loads(pickle.dumps(error))
    assert str(again) == str(error) == "t = 0.5 of curve [1, 1]: no rotation"
    assert (again.time, again.curve, again.reason) == (0.5, 3, "no rotation")
    lost = pickle.loads(pickle.dumps(rb.ConvergenceError(1e-3, 5)))
    assert (lost.residual, lost.iterations) == (1e-3, 5)


def test_a_time_at_which_f_fails_is_named_with_its_curve():
    def timing(t, order):
        rates = [t + np.array([0, 0.1, 0]) * (t * (1 - t)), np.array([1, np.nan, 1]) + 0 * t]
        return rates[order]

    stack = rb.projected_line_so3(np.eye(3), rb.exp_so3(np.eye(3)), timing)
    with pytest.raises(ValueError, match=r"^t = 0\.6 of curve \[1\]: f\(t, 1\) is not a finite"):
        stack(0.6, 1)
    with pytest.raises(ValueError, match=r"^t = 0\.2 of curve \[1\]: f\(t, 1\) is not a finite"):
        stack.at_own_times([0.1, 0.2, 0.3], 1)
    each = [stack[k](t) for k, t in enumerate((0.1, 0.2, 0.3))]
    assert np.abs(stack.at_own_times([0.1, 0.2, 0.3]) - each).max() < 1e-14


THIRD = {
    **rb.CLOSED_FORMS,
    "geodesic": lambda R0, R1, w0, w1: rb.geodesic_so3(R0, R1),
    "line": lambda R0, R1, w0, w1: rb.projected_line_so3(R0, R1),
    "timed line": lambda R0, R1, w0, w1: rb.projected_line_so3(
        R0, R1, lambda t, order: (t**3, 3 * t**2, 6 * t, 6 + 0 * t)[order]
    ),
    "quintic": lambda R0, R1, w0, w1: rb.projected_quintic_so3(R0, R1, w0, w1, w1, w0),
    "optimum": rb.minimum_acceleration_so3,
    "retimed": lambda *ends: rb.retime(rb.bezier_so3(*ends), 2.5),
}


@pytest.mark.parametrize("size", [1.0, 1e-3, 1e-7])
@pytest.mark.parametrize("name", THIRD)
def test_the_jerk_is_the_derivative_of_the_acceleration(name, size):
    R0 = rb.exp_so3([0.1, 0.2, 0.3])
    turns = size * np.array([[0.4, 1.2, -0.9], [1.0, 0.5, 2.0]])
    ends = R0, R0 @ rb.exp_so3(turns), size * np.array([2.0, 1, 0]), size * np.array([1.0, -1, 2])
    curves = THIRD[name](*ends)
    start, end = curves.domain
    for share in (0.1, 0.4, 0.77):
        t = start + share * (end - start)
        rate = oracles.derivative_by_differences(lambda u: curves(u, 2), t)
        scale = np.abs(curves(t, 2)).max() + np.abs(rate).max()
        assert np.abs(rate - curves(t, 3)).max() < 1e-11 * scale + 1e-12 * size
    assert curves([[0.1, 0.2]], 3).shape == (1, 2, 2, 3)
    own = curves.at_own_times([0.2, 0.3], 3)
    assert np.abs(own[1] - curves(0.3, 3)[1]).max() < 1e-12 * size * (1 + np.abs(own / size).max())
