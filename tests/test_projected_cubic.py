"""Projected cubics and quintics, from the definition of the nearest rotation."""

import warnings

import numpy as np
import oracles
import pytest
from scipy.spatial.transform import Rotation

import rbcourse as rb

EPS = np.finfo(float).eps
RNG = np.random.default_rng(62)
N = 60
R0, R1 = (Rotation.random(N, rng=RNG).as_matrix() for _ in range(2))
W0, W1, B0, B1 = 4 * RNG.normal(size=(4, N, 3))
TIMES = np.linspace(0, 1, 41)


def cubic_of_matrices(t, order=0):
    """M(t) of BK 6.2 with its derivatives, written out."""
    V0, V1 = R0 @ rb.hat_so3(W0), R1 @ rb.hat_so3(W1)
    M2, M3 = -3 * R0 + 3 * R1 - 2 * V0 - V1, 2 * R0 - 2 * R1 + V0 + V1
    t = np.asarray(t)[..., None, None, None]
    return (R0 + V0 * t + M2 * t**2 + M3 * t**3, V0 + 2 * M2 * t + 3 * M3 * t**2)[order]


def transposed(M):
    return np.swapaxes(M, -1, -2)


CUBICS = rb.projected_cubic_so3(R0, R1, W0, W1)
QUINTICS = rb.projected_quintic_so3(R0, R1, W0, W1, B0, B1)
GAPS = oracles.two_smallest_eigenvalues(transposed(CUBICS(TIMES)) @ cubic_of_matrices(TIMES))


@pytest.mark.source("BK 6", "BK 6.2", "BK Prop. 2")
def test_the_cubic_is_projected_to_the_nearest_rotation():
    R, M = CUBICS(TIMES), cubic_of_matrices(TIMES)
    S = transposed(R) @ M
    scale = np.linalg.norm(CUBICS.ends, axis=(-2, -1)).sum(axis=-1)
    assert np.abs(transposed(R) @ R - np.eye(3)).max() < 20 * EPS
    assert np.abs(np.linalg.det(R) - 1).max() < 20 * EPS
    assert np.all(np.abs(S - transposed(S)).max(axis=(-2, -1)) < 10 * EPS * scale)
    assert GAPS.min() > 0


@pytest.mark.source("BK 6.2")
def test_where_the_determinant_is_negative_the_curve_is_right_and_smooth():
    reflected = (np.linalg.det(cubic_of_matrices(TIMES)) < 0).any(axis=0)
    assert 5 < reflected.sum() < N
    t = np.linspace(0, 1, 2001)
    some = rb.projected_cubic_so3(R0[reflected], R1[reflected], W0[reflected], W1[reflected])
    steps = np.linalg.norm(rb.log_so3(transposed(some(t[:-1])) @ some(t[1:])), axis=-1)
    speed = np.linalg.norm(some((t[1:] + t[:-1]) / 2, 1), axis=-1)
    clear = some.margin > 0.1
    assert clear.sum() > 3
    assert np.abs(steps / (t[1] * speed) - 1)[:, clear].max() < 0.01


@pytest.mark.source("BK 6.2", "errata 11")
def test_the_ends_are_met_to_their_rounding():
    for curve in (CUBICS, QUINTICS):
        scale = np.linalg.norm(curve.ends, axis=(-2, -1)).sum(axis=-1)[:, None]
        for t, R, w in ((0, R0, W0), (1, R1, W1)):
            assert np.all(np.abs(curve(t) - R).max(axis=-1) < 4 * EPS * scale)
            assert np.all(np.abs(curve(t, 1) - w) < 40 * EPS * scale)
    for t, a in ((0, B0), (1, B1)):
        assert np.all(np.abs(QUINTICS(t, 2) - a) < 1000 * EPS * scale)


@pytest.mark.source("errata 11")
def test_the_printed_end_condition_and_group_do_not_hold():
    """The second derivative at the end is not the one that is prescribed; and R0 ŵ0 is singular."""
    M0, M1, V0, V1 = np.moveaxis(CUBICS.ends, -3, 0)
    M2, M3 = 3 * (M1 - M0) - 2 * V0 - V1, V0 + V1 - 2 * (M1 - M0)
    missed = np.abs(2 * M2 + 6 * M3 - R1 @ rb.hat_so3(W1)).max(axis=(-2, -1))
    assert np.all(missed > 0.1)
    assert np.abs(np.linalg.det(V0)).max() < 1e-13 * 64


@pytest.mark.parametrize("curve", [CUBICS, QUINTICS], ids=["cubic", "quintic"])
def test_velocity_and_acceleration_are_the_derivatives(curve):
    calm = curve.margin > 0.3
    assert calm.sum() > N / 3
    for t in (0.1, 0.45, 0.8):
        rate = oracles.derivative_by_differences(curve, t, 2.0**-11)
        velocity = rb.vee_so3(transposed(curve(t)) @ rate)
        assert np.abs(curve(t, 1) - velocity)[calm].max() < 1e-8
        rate = oracles.derivative_by_differences(lambda u: curve(u, 1), t, 2.0**-11)
        assert np.abs(curve(t, 2) - rate)[calm].max() < 1e-6


@pytest.mark.parametrize(("degrees", "times"), [(20, 1.002), (60, 1.17), (90, 2.31), (120, 11.56)])
def test_the_quintic_is_not_of_least_jerk(degrees, times):
    """About one axis least jerk is a quintic in the angle: 720 angle² from rest to rest."""
    rest, angle = np.zeros(3), np.radians(degrees)
    curve = rb.projected_quintic_so3(np.eye(3), rb.exp_so3([0, 0, angle]), rest, rest, rest, rest)
    t = np.linspace(0, 1, 4001)
    jerk = np.gradient(curve(t, 2)[:, 2], t, edge_order=2)
    assert np.trapezoid(jerk**2, t) / (720 * angle**2) == pytest.approx(times, rel=2e-3)


@pytest.mark.source("BK 6.1")
def test_the_projected_line_has_the_ends_of_a_cubic_and_a_quintic_that_project_to_it():
    """They are the line times a positive number ρ(t), which the projection does not see."""
    line = rb.projected_line_so3(R0, R0 @ rb.exp_so3([0.3, -0.4, 1.2]))
    ends = [line(t, order) for order in (0, 1, 2) for t in (0, 1)]
    for curve in (rb.projected_cubic_so3(*ends[:4]), rb.projected_quintic_so3(*ends)):
        for order in (0, 1, 2):
            assert np.abs(curve(TIMES, order) - line(TIMES, order)).max() < 1e-13


@pytest.mark.source("BK Prop. 3", "BK Prop. 5")
def test_moving_the_ends_moves_the_curve():
    """From both sides. The bound is the claim, 1e-12 over the margin."""
    L, Q = Rotation.random(2, rng=5).as_matrix()
    bound = 1e-12 / np.minimum(CUBICS.margin, 1)
    moved = rb.projected_cubic_so3(L @ R0 @ Q, L @ R1 @ Q, W0 @ Q, W1 @ Q)
    off = np.abs(moved(TIMES) - L @ CUBICS(TIMES) @ Q).max(axis=(0, -2, -1))
    assert np.all(off < bound)
    moved = rb.projected_quintic_so3(L @ R0 @ Q, L @ R1 @ Q, W0 @ Q, W1 @ Q, B0 @ Q, B1 @ Q)
    off = np.abs(moved(TIMES) - L @ QUINTICS(TIMES) @ Q).max(axis=(0, -2, -1))
    assert np.all(off < 1e-12 / np.minimum(QUINTICS.margin, 1))


def test_backwards_in_time_it_is_the_same_curve():
    back = rb.projected_cubic_so3(R1, R0, -W1, -W0)
    off = np.abs(back(1 - TIMES) - CUBICS(TIMES)).max(axis=(0, -2, -1))
    assert np.all(off < 1e-12 / np.minimum(CUBICS.margin, 1))


def test_the_margin_is_the_least_gap():
    t = np.linspace(0, 1, 4001)
    for i in range(0, N, 4):
        one = rb.projected_cubic_so3(R0[i], R1[i], W0[i], W1[i])
        gap = oracles.two_smallest_eigenvalues(
            transposed(one(t)) @ cubic_of_matrices(t)[:, i],
        ).min()
        speed = np.linalg.norm(cubic_of_matrices(t, 1)[:, i], axis=(-2, -1)).max()
        assert one.margin <= gap + 1e-14
        assert gap - one.margin < 2 * speed * t[1]
        assert abs(one.margin - CUBICS.margin[i]) < 1e-12


def test_a_margin_of_nothing_is_said():
    """From rest to rest over a half-turn: the cubic runs through a matrix of rank 1."""
    half, rest = np.diag([1.0, -1, -1]), np.zeros(3)
    with pytest.warns(RuntimeWarning, match=r"^margin < 1e-6: below 1e-12 at t = 0\.5; .* jumps"):
        curve = rb.projected_cubic_so3(np.eye(3), half, rest, rest)
    assert curve.margin < 8 * EPS
    assert np.abs(curve([0, 0.3, 0.7, 1]) - [np.eye(3), np.eye(3), half, half]).max() < 80 * EPS
    for order in (0, 1, 2):
        with pytest.raises(ValueError, match=r"^t = 0\.5: the nearest rotation is not unique"):
            curve([0.3, 0.5], order)
    pair = np.stack([np.eye(3), half])
    with pytest.warns(RuntimeWarning, match=r"of curve \[1\]: .* at t = 0\.5; "):
        curves = rb.projected_quintic_so3(np.eye(3), pair, rest, rest, rest, rest)
    assert np.abs(curves.margin - [2, 0]).max() < 8 * EPS
    with pytest.raises(ValueError, match=r"t = 0\.5 of curve \[1\]"):
        curves(0.5)


@pytest.mark.parametrize("short_of", [1e-3, 1e-5, 1e-7, 1e-9])
def test_near_the_singular_set_it_is_right_or_warned_of(short_of):
    """Just short of a half-turn the margin is 2 cos(a/2), the curve right to eps over the gap."""
    turn = np.array([0, 0, np.pi - short_of])
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        curve = rb.projected_cubic_so3(np.eye(3), rb.exp_so3(turn), np.zeros(3), np.zeros(3))
    assert abs(curve.margin - 2 * np.sin(short_of / 2)) < 20 * EPS
    assert bool(warned) == (curve.margin < 1e-6)
    for t in (0.4, 0.5 + short_of, 0.6):
        share = 3 * t**2 - 2 * t**3
        gap = 2 * oracles.line_singular_value(share, turn[2])
        want = oracles.theta(share, turn[2]) * turn[2]
        assert abs(rb.log_so3(curve(t))[2] - want) < 40 * EPS / gap


def through_the_centre(t, k1):
    """Ends about one axis whose cubic, as a complex number, runs through 0 at the time t.

    z(0) = 1, z'(0) = i k0, z(1) = exp(ia), z'(1) = i k1 exp(ia): with Hermite's basis,
    z(t) = h00 + i k0 h10 + exp(ia) (h01 + i k1 h11) = 0 fixes k0 and a.
    """
    h00, h10, h01, h11 = (
        (1 + 2 * t) * (1 - t) ** 2,
        t * (1 - t) ** 2,
        t**2 * (3 - 2 * t),
        t**3 - t**2,
    )
    k0 = np.sqrt(h01**2 + (k1 * h11) ** 2 - h00**2) / h10
    a = np.angle(-(h00 + 1j * k0 * h10) / (h01 + 1j * k1 * h11))
    return np.eye(3), rb.exp_so3([0, 0, a]), np.array([0, 0, k0]), np.array([0, 0, k1])


@pytest.mark.parametrize("k", [40, 45, 50, 55])
@pytest.mark.parametrize("fast", [5, 40])
def test_what_is_warned_of_is_found_between_the_times_looked_at(k, fast):
    """Half way between two of 65 times, and of 129 too."""
    t = (k + 0.25) / 64
    with pytest.warns(RuntimeWarning, match="jumps there"):
        curve = rb.projected_cubic_so3(*through_the_centre(t, fast))
    assert curve.margin < 1e-12


def test_no_warning_without_need():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        rb.projected_cubic_so3(R0, R1, W0, W1)


def test_the_time_and_the_curve_that_jump_are_named_in_any_block():
    half, rest = np.diag([1.0, -1, -1]), np.zeros(3)
    goals = np.tile(np.eye(3), (2, 3, 1, 1))
    goals[1, 2] = half
    with pytest.warns(RuntimeWarning, match=r"of curve \[1, 2\]"):
        stack = rb.projected_cubic_so3(np.eye(3), goals, rest, rest)
    t = np.linspace(0, 0.4, 4000)
    for order in (0, 1, 2):
        assert np.isfinite(stack(t, order)).all()
        for k in (0, 833, 834, 3999):
            times = t.copy()
            times[k] = 0.5
            with pytest.raises(ValueError, match=r"^t = 0\.5 of curve \[1, 2\]: the nearest"):
                stack(times, order)
            with pytest.raises(ValueError, match=r"^t = 0\.5 of curve \[1, 2\]: the nearest"):
                stack(times.reshape(40, 100), order)


@pytest.mark.parametrize("order", [0, 1, 2])
def test_the_time_at_which_f_is_no_number_is_named(order):
    def timing(t, order):
        value = np.full_like(t, order == 1) if order else t.copy()
        if t.size > 2:
            value[t == np.linspace(0, 1, 6001)[5000]] = np.nan
        return value

    line = rb.projected_line_so3(np.eye(3), rb.exp_so3([0, 1, 0]), timing)
    with pytest.raises(ValueError, match=r"^t = 0\.8333\d*: f\(t, 0\) is not a finite"):
        line(np.linspace(0, 1, 6001), order)
