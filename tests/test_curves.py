import pickle
from contextlib import nullcontext

import awkward
import numpy as np
import oracles
import pytest
from scipy.spatial.transform import Rotation

import rbcourse as rb
from rbcourse.curves.curve import SingularTime
from rbcourse.straight_line import f

EPS = np.finfo(float).eps
RNG = np.random.default_rng(61)
STARTS = Rotation.random(30, RNG).as_matrix()
TIMES = np.linspace(0, 1, 9)
ANGLES = np.concatenate(
    [RNG.uniform(0, 3.1, 22), 10.0 ** -np.array([1, 3, 6, 9, 12]), [0, 3.14, 3.1415]]
)
TURNS = RNG.normal(size=(30, 3))
TURNS *= (ANGLES / np.linalg.norm(TURNS, axis=1))[:, None]
TURNED = np.array([oracles.exp_so3(w) for w in TURNS])
GOALS = STARTS @ TURNED
GEODESICS = rb.geodesic(STARTS, GOALS)
I3, REST = np.eye(3), np.zeros(3)


def quick(t, order):
    """Return 4 t² − 3 t, a reparameterisation that leaves [0, 1], and its derivatives."""
    return (4 * t**2 - 3 * t, 8 * t - 3, 8 + 0 * t, 0 * t)[order]


def squared(t, order):
    return (t * t, 2 * t, 2 + 0 * t)[order]


@pytest.mark.source("BK 6.1", "BK Remark 7")
def test_the_geodesic_agrees_with_slerp():
    R, from_I = GEODESICS(TIMES), rb.geodesic(I3, TURNED)(TIMES)
    want = np.array([[oracles.exp_so3(t * w) for w in TURNS] for t in TIMES])
    assert np.abs(from_I - want).max() < 8 * EPS
    assert np.abs(R - STARTS @ want).max() < 20 * EPS
    q0, q1 = rb.quaternion_from_matrix(STARTS), rb.quaternion_from_matrix(GOALS)
    assert np.abs(R - rb.matrix_from_quaternion(rb.slerp(q0, q1, TIMES))).max() < 40 * EPS
    assert np.array_equal(GEODESICS(0), STARTS)
    assert np.abs(np.linalg.norm(GEODESICS.rotation_vector, axis=-1) - ANGLES).max() < 20 * EPS
    assert np.all(GEODESICS(TIMES, 1) == GEODESICS.rotation_vector)
    assert np.all(GEODESICS(TIMES, 2) == 0)


@pytest.mark.source("BK Prop. 6", "BK (15)", "BK (17)", "BK Cor. 1")
@pytest.mark.parametrize("timing", [None, quick])
def test_the_projected_line_is_the_projection_of_the_line(timing):
    """The rotation from the start to any point of the curve is about the axis of the geodesic."""
    curves, t = rb.projected_line(STARTS, GOALS, timing), np.linspace(0, 1, 1001)[::50]
    x = (t if timing is None else quick(t, 0))[:, None, None, None]
    M = STARTS + (GOALS - STARTS) * x
    R = rb.project_so(M)
    margin = oracles.two_smallest_eigenvalues(R.mT @ M)
    off = np.abs(curves(t) - R).max(axis=(-2, -1))
    assert np.all(off < 10 * EPS * np.linalg.norm(M, axis=(-2, -1)) / margin)
    assert np.abs(margin[x[:, 0, 0, 0] == 0.5] - curves.margin).max(initial=0) < 20 * EPS
    assert np.all(margin > curves.margin - 20 * EPS)
    between = rb.log_so3(STARTS.mT @ curves(t))
    assert np.abs(np.cross(between, TURNS)).max() < 40 * EPS * np.pi


@pytest.mark.source("BK Cor. 2")
def test_the_line_with_the_timing_f_projects_to_the_geodesic():
    angle = np.linalg.norm(GEODESICS.rotation_vector, axis=-1)
    lines = rb.projected_line(STARTS, GOALS, lambda t, order: f(t, angle, order))
    growth = 1 + 2 * np.tan(angle / 2) / np.maximum(angle, 1)
    for order in (0, 1, 2):
        core = (-2, -1) if order == 0 else -1
        off = np.abs(lines(TIMES, order) - GEODESICS(TIMES, order)).max(axis=core)
        assert np.all(off < 20 * EPS * growth ** (1 + order))


def at_rest(R0, R1):
    return rb.projected_cubic(R0, R1, REST, REST)


def quintic_at_rest(R0, R1):
    return rb.projected_quintic(R0, R1, *[REST] * 4)


def half_turns():
    """Return starts, goals and axes of half-turns, exact and rounded."""
    exact, axes = awkward.half_turns()
    R0, R1, n = awkward.rounded_half_turns(np.random.default_rng(180), 80)
    start = np.broadcast_to(I3, exact.shape)
    return np.concatenate([start, R0]), np.concatenate([exact, R1]), np.concatenate([axes, n])


def test_the_geodesic_over_a_half_turn_follows_rodrigues_formula():
    """The formula holds up to the end of the interval, where the tangent is infinite."""
    R0, R1, n = half_turns()
    # the first of the largest components of the axis is positive
    first = np.argmax(np.abs(n) > np.abs(n).max(axis=1, keepdims=True) - 1e-9, axis=1)
    n *= np.sign(np.take_along_axis(n, first[:, None], axis=1))
    curves, cross = rb.geodesic(R0, R1), rb.hat_so3(n)
    assert np.abs(curves.rotation_vector - np.pi * n).max() < 40 * EPS
    assert np.abs(curves(1) - R1).max() < 40 * EPS
    for t in (1e-9, 0.25, 0.5, 1 - 2.0**-53, 1):
        sine, versine = np.sin(np.pi * t), 1 - np.cos(np.pi * t)
        want = R0 @ (I3 + sine * cross + versine * cross @ cross)
        assert np.abs(curves(t) - want).max() < 20 * EPS


def test_a_projected_line_over_a_half_turn_is_undefined_halfway():
    for R0, R1, _ in zip(*half_turns(), strict=True):
        with pytest.warns(RuntimeWarning, match="^margin < 1e-6: .* jumps there"):
            curve = rb.projected_line(R0, R1)
        assert 0 <= curve.margin < 8 * EPS
        assert np.abs(curve([0, 0.25, 0.75, 1]) - [R0, R0, R1, R1]).max() < 80 * EPS
        for order in (0, 1, 2):
            with pytest.raises(ValueError, match=r"^t = 0\.5: the nearest rotation .* not unique"):
                curve([0.25, 0.5], order)


@pytest.mark.parametrize("short_of", [1e-3, 1e-5, 1e-7, 1e-8, 1e-9])
@pytest.mark.parametrize(
    ("make", "where", "share"),
    [
        (rb.projected_line, "t", lambda t: t),
        (lambda R0, R1: rb.projected_line(R0, R1, squared), r"f\(t\)", lambda t: t * t),
        (at_rest, "t", lambda t: 3 * t**2 - 2 * t**3),
    ],
)
def test_a_curve_near_the_singular_set_is_accurate_or_gives_a_warning(make, where, share, short_of):
    """Just short of a half-turn, the margin is 2 cos(a/2), and errors are of order eps divided by
    the gap."""
    turn, margin = np.array([0, 0, np.pi - short_of]), f"{short_of:.1e}"
    message = rf"^margin < 1e-6: {margin} at {where} = 0\.5; "
    with pytest.warns(RuntimeWarning, match=message) if short_of < 1e-6 else nullcontext():
        curve = make(I3, oracles.exp_so3(turn))
    assert abs(curve.margin - 2 * np.sin(short_of / 2)) < 4 * EPS
    for t in (0.4, 0.5 + short_of, 0.6):
        gap = 2 * oracles.line_singular_value(share(t), turn[2])
        want = oracles.theta(share(t), turn[2]) * turn[2]
        assert abs(rb.log_so3(curve(t))[2] - want) < 40 * EPS / gap


@pytest.mark.parametrize("make", [rb.projected_line, at_rest, quintic_at_rest])
def test_a_jump_gives_a_warning(make):
    """If a half-turn goes from rest to rest, its matrix M(t) has rank 1 at half time."""
    half = np.diag([1.0, -1, -1])
    with pytest.warns(RuntimeWarning, match=r"^margin < 1e-6 of curve \[0, 1\]: .* t = 0\.5; .* j"):
        stack = make(I3, np.array([[I3, half], [half, I3], [I3, I3]]))
    assert np.abs(stack.margin - [[2, 0], [0, 2], [2, 2]]).max() < 8 * EPS
    one = stack[0, 1]
    assert np.abs(one([0, 0.25, 0.75, 1]) - [I3, I3, half, half]).max() < 80 * EPS
    t = np.linspace(0, 0.4, 1000)  # for six curves, these times fill more than one block
    own = np.full((1000, 3, 2), [[0.5, 0.25], [0.25, 0.5], [0.5, 0.5]])
    for order in (0, 1, 2):
        assert np.isfinite(stack(t, order)).all()
        assert np.isfinite(stack.at_own_times(own, order)).all()
        with pytest.raises(ValueError, match=r"^t = 0\.5: the nearest rotation is not unique"):
            one([0.3, 0.5], order)
        with pytest.raises(ValueError, match=r"^t = 1\.5: the nearest rotation is not unique"):
            one.retimed(3)(1.5, order)
        for k in (0, 999):
            times, late = (np.where(np.arange(1000) == k, 0.5, t).reshape(10, 100), own.copy())
            late[k, 0, 1] = 0.5
            for call, given in ((stack, times), (stack.at_own_times, late)):
                with pytest.raises(ValueError, match=r"^t = 0\.5 of curve \[0, 1\]: the nearest"):
                    call(given, order)


def test_f_may_miss_its_end_value_by_a_rounding_error():
    def in_place(t, order):
        t *= t
        return (t * (1 + 1e-14), 2 * np.sqrt(t), 2)[order]

    for pair in ((in_place, squared), (lambda t, order: (t, 1, 0)[order], None)):
        curve, want = (rb.projected_line(STARTS[:2], GOALS[:2], one) for one in pair)
        for order in (0, 1, 2):
            assert np.abs(curve(TIMES, order) - want(TIMES, order)).max() < 1e-10


@pytest.mark.parametrize(
    ("timing", "message"),
    [
        (lambda t, order: t / 2, r"f: f\(0\) = 0 and f\(1\) = 1 are wanted"),
        (lambda t, order: t * 1.000001, r"are wanted, got 0\.0 and 1\.000001"),
        (lambda t, order: np.zeros(3), r"f\(t, 0\): shape \(2,\) is wanted, got \(3,\)"),
        (lambda t, order: np.nan, r"^t = 0\.0: f\(t, 0\) is not a finite number"),
        (f, r"^f: bind it to an angle"),
        *((one, r"f: a callable f\(t, order\) is wanted") for one in (0, 1, [], "f")),
    ],
)
def test_an_f_that_is_not_a_timing_is_refused(timing, message):
    with pytest.raises(ValueError, match=message):
        rb.projected_line(STARTS[0], GOALS[0], timing)


def test_the_error_names_the_time_and_the_curve_at_which_f_fails():
    def rates(t, order):
        rates = [t + np.array([0, 0.1, 0]) * (t * (1 - t)), np.array([1, np.nan, 1]) + 0 * t]
        return rates[order]

    stack = rb.projected_line(I3, rb.exp_so3(I3), rates)
    for call, t, time in ((stack, 0.6, 0.6), (stack.at_own_times, [0.1, 0.2, 0.3], 0.2)):
        with pytest.raises(ValueError, match=rf"^t = {time} of curve \[1\]: f\(t, 1\) is not a fi"):
            call(t, 1)
    t = np.linspace(0, 1, 6001)

    def lost(s, order):
        return np.where(s == t[5000], np.nan, squared(s, order))

    line = rb.projected_line(I3, rb.exp_so3([0, 1, 0]), lost)
    for order in (0, 1, 2):
        with pytest.raises(ValueError, match=r"^t = 0\.8333\d*: f\(t, 0\) is not a finite"):
            line(t, order)


def test_errors_can_be_pickled():
    error = SingularTime(0.5, 3, "no rotation", (2, 2))
    again = pickle.loads(pickle.dumps(error))
    assert str(again) == str(error) == "t = 0.5 of curve [1, 1]: no rotation"
    assert (again.time, again.curve, again.reason) == (0.5, 3, "no rotation")
    lost = pickle.loads(pickle.dumps(rb.optimum.ConvergenceError(1e-3, 5, "no reason")))
    assert (lost.residual, lost.iterations) == (1e-3, 5)
