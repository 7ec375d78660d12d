import pickle
from functools import partial

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


ANGLES = np.concatenate(
    [RNG.uniform(0, 3.1, 22), 10.0 ** -np.array([1, 3, 6, 9, 12]), [0, 3.14, 3.1415]]
)
TURNS = RNG.normal(size=(30, 3))
TURNS *= (ANGLES / np.linalg.norm(TURNS, axis=1))[:, None]
GOALS = STARTS @ np.array([oracles.exp_so3(w) for w in TURNS])
GEODESICS = rb.geodesic_so3(STARTS, GOALS)
LINES = rb.projected_line_so3(STARTS, GOALS)


def quick(t, order):
    """A reparameterisation that leaves [0, 1]: 4 t² − 3 t."""
    return (4 * t**2 - 3 * t, 8 * t - 3, 8 + 0 * t, 0 * t)[order]


def squared(t, order):
    return (t * t, 2 * t, 2 + 0 * t)[order]


@pytest.mark.source("BK 6.1", "BK Remark 7")
def test_the_geodesic_turns_uniformly_about_one_axis_as_slerp_does():
    R = GEODESICS(TIMES)
    for i, (R0, R1, w) in enumerate(zip(STARTS, GOALS, TURNS, strict=True)):
        want = np.array([R0 @ oracles.exp_so3(t * w) for t in TIMES])
        assert np.abs(R[:, i] - want).max() < 20 * EPS
        if i < 22:
            slerp = Slerp([0, 1], Rotation.from_matrix([R0, R1]))
            assert np.abs(R[:, i] - slerp(TIMES).as_matrix()).max() < 40 * EPS
    q0, q1 = rb.quaternion_from_matrix(STARTS), rb.quaternion_from_matrix(GOALS)
    assert np.abs(R - rb.matrix_from_quaternion(rb.slerp(q0, q1, TIMES))).max() < 40 * EPS


@pytest.mark.source("BK 6.1")
def test_the_geodesics_velocity_is_constant_and_its_length_the_angle():
    assert np.array_equal(
        GEODESICS(TIMES, 1), np.broadcast_to(GEODESICS.rotation_vector, (9, 30, 3))
    )
    assert np.all(GEODESICS(TIMES, 2) == 0)
    assert np.abs(np.linalg.norm(GEODESICS(0.3, 1), axis=-1) - ANGLES).max() < 20 * EPS


@pytest.mark.source("BK Prop. 6", "BK (15)", "BK Cor. 1")
@pytest.mark.parametrize("f", [None, quick], ids=["the identity", "one that leaves the interval"])
def test_the_projected_line_is_the_projection_of_the_line(f):
    curves, t = rb.projected_line_so3(STARTS, GOALS, f), np.linspace(0, 1, 21)
    x = (t if f is None else quick(t, 0))[:, None, None, None]
    M = STARTS + (GOALS - STARTS) * x
    R = rb.project_so(M)
    margin = oracles.two_smallest_eigenvalues(R.mT @ M)
    off = np.abs(curves(t) - R).max(axis=(-2, -1))
    scale = np.linalg.norm(M, axis=(-2, -1))
    assert np.all(off < 10 * EPS * scale / margin)


@pytest.mark.source("BK Prop. 6", "BK (17)")
def test_the_margin_is_the_least_sum_of_the_two_smallest_eigenvalues():
    M = STARTS + (GOALS - STARTS) * np.linspace(0, 1, 1001)[:, None, None, None]
    sums = oracles.two_smallest_eigenvalues(rb.project_so(M).mT @ M)
    assert np.abs(sums.min(axis=0) - LINES.margin).max() < 20 * EPS


@pytest.mark.source("BK Cor. 1")
def test_geodesic_and_projected_line_follow_the_same_path():
    """The rotation between a point of one and the start is about the axis of the other."""
    between = rb.log_so3(STARTS.mT @ LINES(TIMES))
    assert np.abs(np.cross(between, TURNS)).max() < 40 * EPS * np.pi


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


@pytest.mark.parametrize("make", [rb.geodesic_so3, rb.projected_line_so3])
def test_no_turn_at_all(make):
    curve = make(np.eye(3), np.eye(3))
    assert np.array_equal(curve(TIMES), np.broadcast_to(np.eye(3), (9, 3, 3)))
    assert not np.any([curve(TIMES, 1), curve(TIMES, 2)])
    assert getattr(curve, "margin", 2) == 2


def half_turn_pairs():
    exact, axes = awkward.half_turns()
    R0, R1, n = awkward.rounded_half_turns(np.random.default_rng(180))
    start = np.broadcast_to(np.eye(3), exact.shape)
    return np.concatenate([start, R0]), np.concatenate([exact, R1]), np.concatenate([axes, n])


def test_the_geodesic_over_a_half_turn_is_rodrigues_formula_about_the_axis_of_positive_sign():
    """To the end of the interval, where the tangent is infinite."""
    R0, R1, n = half_turn_pairs()
    # of ±n the one whose component of largest magnitude, the first of equals, is positive
    first = np.argmax(np.abs(n) > np.abs(n).max(axis=1, keepdims=True) - 1e-9, axis=1)
    n *= np.sign(np.take_along_axis(n, first[:, None], axis=1))
    curves, cross = rb.geodesic_so3(R0, R1), rb.hat_so3(n)
    assert np.abs(curves.rotation_vector - np.pi * n).max() < 40 * EPS
    assert np.abs(curves(1) - R1).max() < 40 * EPS
    for t in (1e-9, 0.25, 0.5, 1 - 2.0**-53, 1):
        sine, versine = np.sin(np.pi * t), 1 - np.cos(np.pi * t)
        want = R0 @ (np.eye(3) + sine * cross + versine * cross @ cross)
        assert np.abs(curves(t) - want).max() < 20 * EPS
        for k in range(0, len(R0), 25):
            assert np.abs(curves[k](t) - want[k]).max() < 20 * EPS


def test_between_rotations_a_half_turn_apart_the_middle_of_the_line_is_refused():
    for R0, R1, _ in zip(*half_turn_pairs(), strict=True):
        with pytest.warns(RuntimeWarning, match="^margin < 1e-6: .* jumps there"):
            curve = rb.projected_line_so3(R0, R1)
        assert 0 <= curve.margin < 8 * EPS
        assert np.abs(curve([0, 0.25, 0.75, 1]) - [R0, R0, R1, R1]).max() < 80 * EPS
        for order in (0, 1, 2):
            with pytest.raises(ValueError, match=r"^t = 0\.5: the nearest rotation .* not unique"):
                curve([0.25, 0.5], order)


def test_just_before_the_half_turn_the_line_is_right_and_warned_of():
    angle = np.pi - 1e-8
    with pytest.warns(RuntimeWarning, match=r"^margin < 1e-6: 1\.0e-08 at t = 0\.5; "):
        curve = rb.projected_line_so3(np.eye(3), oracles.exp_so3([0, 0, angle]))
    assert abs(curve.margin - 1e-8) < 4 * EPS
    want = oracles.theta(0.5 + 1e-9, angle) * angle
    assert abs(rb.log_so3(curve(0.5 + 1e-9))[2] - want) < 20 * EPS / 1e-8
    with pytest.warns(RuntimeWarning, match=r": 1\.0e-08 at f\(t\) = 0\.5; "):
        rb.projected_line_so3(np.eye(3), rb.exp_so3([0, 0, angle]), squared)


@pytest.mark.source("BK 6.1")
@pytest.mark.parametrize("i", [0, 5, 22, 26, 27, 29])
def test_at_many_times_the_geodesic_is_rodrigues_formula(i):
    """More times than are worked out together; against 60 digits, at some of all of them."""
    t = np.random.default_rng(i).random(100_000)
    curve = rb.geodesic_so3(np.eye(3), oracles.exp_so3(TURNS[i]))
    R = curve(t)
    for k in (0, 4095, 4096, 8191, 8192, 50_000, 98_303, 98_304, 99_999):
        assert np.abs(R[k] - oracles.exp_so3(t[k] * TURNS[i])).max() < 8 * EPS
    assert np.abs(R.mT @ R - np.eye(3)).max() < 16 * EPS
    assert np.abs(R[::-1] - curve(t[::-1])).max() < 4 * EPS


def test_at_the_start_the_geodesic_is_the_start():
    assert np.array_equal(GEODESICS(0), STARTS)
    for i in range(len(ANGLES)):
        assert np.array_equal(GEODESICS[i](np.zeros(5000))[[0, -1]], STARTS[[i, i]])
    assert np.abs(rb.geodesic_so3(STARTS, STARTS)(TIMES) - STARTS).max() < 4 * EPS


def test_f_may_be_a_constant_rate():
    curve = rb.projected_line_so3(STARTS[:2], GOALS[:2], lambda t, order: (t, 1, 0)[order])
    assert np.array_equal(curve(TIMES, 2), rb.projected_line_so3(STARTS[:2], GOALS[:2])(TIMES, 2))


@pytest.mark.parametrize(
    ("f", "message"),
    [
        (lambda t, order: t / 2, r"f: f\(0\) = 0 and f\(1\) = 1 are wanted"),
        (lambda t, order: t * 1.000001, r"are wanted, got 0\.0 and 1\.000001"),
        (lambda t, order: np.zeros(3), r"f\(t, 0\): shape \(2,\) wanted, got \(3,\)"),
        (lambda t, order: np.nan, r"^t = 0\.0: f\(t, 0\) is not a finite number"),
        (rb.projected_line.f, r"^f: it must be bound to an angle"),
        *((one, r"f: a callable f\(t, order\) is wanted") for one in (0, 1, [], "f")),
    ],
)
def test_f_that_is_no_timing_is_refused(f, message):
    with pytest.raises(ValueError, match=message):
        rb.projected_line_so3(STARTS[0], GOALS[0], f)


def test_f_may_work_in_place_and_end_at_rounding():
    def in_place(t, order):
        t *= t
        return (t * (1 + 1e-14), 2 * np.sqrt(t), 2)[order]

    curve, want = (rb.projected_line_so3(STARTS[0], GOALS[0], f) for f in (in_place, squared))
    for order in (0, 1, 2):
        assert np.abs(curve(TIMES, order) - want(TIMES, order)).max() < 1e-10


def test_in_a_stack_the_curve_that_jumps_is_named():
    R1 = np.stack([np.eye(3), np.diag([1.0, -1, -1])])
    R1 = np.stack([R1, R1[::-1], R1[:1].repeat(2, 0)])
    for make in (rb.projected_line_so3, partial(rb.projected_cubic_so3, w0=[0] * 3, w1=[0] * 3)):
        with pytest.warns(RuntimeWarning, match=r"of curve \[0, 1\]"):
            stack = make(np.eye(3), R1)
        t = np.full((3000, 3, 2), [[0.5, 0.25], [0.25, 0.5], [0.5, 0.5]])
        assert np.isfinite(stack.at_own_times(t)).all()
        t[2999, 0, 1] = 0.5
        for call, times in ((stack, [0.1, 0.5]), (stack.at_own_times, t)):
            with pytest.raises(ValueError, match=r"^t = 0\.5 of curve \[0, 1\]: the nearest rot"):
                call(times)


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


@pytest.mark.parametrize("size", [1.0, 1e-3, 1e-7])
@pytest.mark.parametrize(
    "make",
    [
        *rb.CLOSED_FORMS.values(),
        lambda R0, R1, w0, w1: rb.projected_line_so3(R0, R1),
        lambda R0, R1, w0, w1: rb.projected_line_so3(R0, R1, quick),
        lambda R0, R1, w0, w1: rb.projected_quintic_so3(R0, R1, w0, w1, w1, w0),
        rb.minimum_acceleration_so3,
        lambda *ends: rb.retime(rb.bezier_so3(*ends), 2.5),
    ],
)
def test_acceleration_and_jerk_are_exact_derivatives(make, size):
    R0 = rb.exp_so3([0.1, 0.2, 0.3])
    turns = size * np.array([[0.4, 1.2, -0.9], [1.0, 0.5, 2.0]])
    curves = make(R0, R0 @ rb.exp_so3(turns), *(size * np.array([[2.0, 1, 0], [1, -1, 2]])))
    for t in curves.domain[1] * np.array([0.1, 0.4, 0.77]):
        for order in (2, 3):
            rate = oracles.derivative_by_differences(lambda u, k=order: curves(u, k - 1), t)
            scale = np.abs(curves(t, order - 1)).max() + np.abs(rate).max()
            assert np.abs(rate - curves(t, order)).max() < 1e-11 * scale + 1e-12 * size
