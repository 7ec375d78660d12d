"""Test smooth curves near noisy rotations and poses by their definitions and by SciPy."""

import warnings
from pathlib import Path

import numpy as np
import pytest
import recording
from scipy.interpolate import CubicHermiteSpline, make_smoothing_spline
from scipy.spatial.transform import Rotation

import rbcourse as rb
from rbcourse.curves.smoothing import Smoother

RNG = np.random.default_rng(79)
T = np.cumsum(RNG.uniform(0.5, 1.5, 40))
W = RNG.uniform(0.5, 2, 40)
FINE = np.linspace(T[0], T[-1], 201)


def wandering(t, turn=0.1, noise=0.02, seed=3):
    """Return rotations without and with noise; they turn by about `turn` per unit of time."""
    rng = np.random.default_rng(seed)
    vectors = turn * np.stack([7 * np.sin(t / 7), t, 5 * np.cos(t / 5)], axis=-1)
    R = rb.exp_so3(vectors)
    return R, R @ rb.exp_so3(noise * rng.normal(size=(len(t), 3)))


TRUE, NOISY = wandering(T)
PLACES = np.stack([np.sin(T / 6), np.cos(T / 5), 0.1 * T], axis=-1)
POSES = rb.pose_from_components(NOISY, PLACES + 0.01 * RNG.normal(size=(40, 3)))


def test_without_bend_the_smoother_is_scipys_smoothing_spline():
    y = RNG.normal(size=(40, 3))
    smoother = Smoother(T, W, "natural")
    for smoothing in (1e-3, 1.0, 1e3):
        lam = smoothing * W.mean() * smoother.unit**3
        theirs = make_smoothing_spline(T, y, w=W, lam=lam)
        values, rates = smoother.fit(y, smoothing)
        assert np.abs(values - theirs(T)).max() < 1e-12
        assert np.abs(rates - theirs(T, 1)).max() < 1e-11


@pytest.mark.parametrize("ends", ["natural", "rest"])
def test_the_smoother_has_the_least_cost(ends):
    """The cost of values and rates is quadratic; least squares solves for them."""
    t, w = T[:9], W[:9]
    smoother, bend, y = Smoother(t, w, ends), RNG.normal(size=9), RNG.normal(size=9)
    smoothing = 0.7
    nodes, shares = np.polynomial.legendre.leggauss(4)
    u, lam = (nodes + 1) / 2, smoothing * w.mean() * smoother.unit**3
    inner = slice(1, -1) if ends == "rest" else slice(None)

    def residuals(x):
        rates = np.zeros(9)
        rates[inner] = x[9:]
        spline, parts = CubicHermiteSpline(t, x[:9], rates), [np.sqrt(w) * (x[:9] - y)]
        for i, h in enumerate(np.diff(t)):
            off = spline(t[i] + h * u, 2) - (1 - u) * bend[i] - u * bend[i + 1]
            parts.append(np.sqrt(lam * h * shares / 2) * off)
        return np.concatenate(parts)

    count = 9 + len(np.zeros(9)[inner])
    zero = residuals(np.zeros(count))
    J = np.stack([residuals(e) - zero for e in np.eye(count)], axis=-1)
    best = np.linalg.lstsq(J, -zero, rcond=None)[0]
    values, rates = smoother.fit(y[:, None], smoothing, bend[:, None])
    assert np.abs(values[:, 0] - best[:9]).max() < 1e-10
    assert np.abs(rates[inner, 0] - best[9:]).max() < 1e-10
    assert ends == "natural" or np.abs(rates[[0, -1]]).max() < 1e-12


def test_the_degrees_of_freedom_are_those_of_the_linear_map():
    times = np.sort(np.append(T, T[:5]))  # five times are repeated
    for ends in ("natural", "rest"):
        smoother = Smoother(times, np.append(W, W[:5]), ends)
        values = smoother.fit(np.eye(45), 0.7)[0][smoother.which]
        assert smoother.freedom(0.7) == pytest.approx(45 - np.trace(values), rel=1e-9)


def test_an_oscillation_of_the_period_keeps_half_of_its_amplitude():
    t = np.arange(4000.0)
    smoother = Smoother(t, np.ones(4000), "natural")
    wave = np.cos(2 * np.pi * t / 40)
    found = smoother.best(lambda _: 1.0, None, 40.0)
    kept = smoother.fit(wave[:, None], found.smoothing)[0][1000:3000, 0]
    assert kept @ wave[1000:3000] / 1000 == pytest.approx(0.5, rel=1e-3)


@pytest.mark.parametrize("data", [NOISY, POSES], ids=["rotations", "poses"])
def test_velocity_and_acceleration_are_continuous(data):
    c = rb.smoothing_spline(T, data, weights=W)
    for order in (1, 2):
        sizes = np.abs(c(FINE, order)).max()
        assert np.abs(c.jumps(order)).max() < 1e-10 * max(1, sizes)
    assert np.abs(c(T, 1) - c.velocities).max() < 1e-12
    step = 1e-5
    for order in (1, 2):
        later, before = (c(FINE[1:-1] + x, order) for x in (step, -step))
        if data is NOISY:
            rate = c(FINE[1:-1], order + 1)
            middle = np.abs(FINE[1:-1, None] - T).min(axis=1) > 2 * step
            assert np.abs((later - before) / (2 * step) - rate)[middle].max() < 1e-6
    rest = rb.smoothing_spline(T, data, "rest")
    assert np.abs(rest(T[[0, -1]], 1)).max() < 1e-12


def test_moved_reversed_and_rescaled_rotations_give_the_same_curve():
    L, Q = Rotation.random(2, RNG).as_matrix()
    c = rb.smoothing_spline(T, NOISY, weights=W)
    moved = rb.smoothing_spline(T, L @ NOISY @ Q, weights=W)
    back = rb.smoothing_spline(-T[::-1], NOISY[::-1], weights=W[::-1])
    slow = rb.smoothing_spline(1e3 * T, NOISY, weights=5 * W)
    assert np.abs(L @ c(FINE) @ Q - moved(FINE)).max() < 1e-10
    assert np.abs(c(FINE) - back(-FINE)).max() < 1e-10
    assert np.abs(c(T) - slow(1e3 * T)).max() < 1e-10
    assert slow.period == pytest.approx(1e3 * c.period)
    assert slow.noise == pytest.approx(5**0.5 * c.noise)
    twice = rb.smoothing_spline(
        np.repeat(T, 2), np.repeat(NOISY, 2, axis=0), weights=np.repeat(W, 2), period=c.period
    )
    assert np.abs(twice(FINE) - c.retimed(c.duration)(FINE)).max() > 0
    same = rb.smoothing_spline(T, NOISY, weights=2 * W, period=c.period)
    assert np.abs(twice(FINE) - same(FINE)).max() < 1e-12
    longer = c.retimed(2 * float(c.duration))
    assert longer.period == pytest.approx(2 * c.period)


def test_moved_poses_give_the_moved_curve():
    L = rb.pose_from_coordinates([0.3, -1, 2, 1, 2, 3])
    Q = rb.pose_from_coordinates([1, 0.2, 0.1, 0, 0, 0])  # keeps the origin
    c, moved = rb.smoothing_spline(T, POSES), rb.smoothing_spline(T, L @ POSES @ Q)
    assert np.abs(L @ c(FINE) @ Q - moved(FINE)).max() < 1e-9
    rotations = rb.smoothing_spline(T, POSES[:, :3, :3])
    assert np.abs(c(FINE)[:, :3, :3] - rotations(FINE)).max() < 1e-14
    assert c.period[0] == rotations.period
    path = make_smoothing_spline(T, POSES[:, :3, 3], lam=_lam(c.period[1]))
    assert np.abs(c(T)[:, :3, 3] - path(T)).max() < 1e-12


def _lam(period):
    return (period / (2 * np.pi)) ** 4 / np.diff(T).mean()


def test_rotations_about_one_axis_follow_the_spline_of_the_angle():
    for noise, bound in ((0.1, 1e-3), (0.01, 1e-4)):
        angle = 0.3 * np.sin(T / 4) + noise * RNG.normal(size=40)
        c = rb.smoothing_spline(T, rb.exp_so3(angle[:, None] * [0, 0, 1]), period=10)
        theirs = make_smoothing_spline(T, angle, lam=_lam(10))(T)
        assert np.abs(rb.log_so3(c(T))[:, 2] - theirs).max() < bound


def test_the_noise_is_found_and_reduced():
    t, ratios, found = np.arange(120.0), [], []
    for seed in range(6):
        R, measured = wandering(t, 0.05, 0.03, seed)
        for options in ({}, {"noise": 0.03}):
            c = rb.smoothing_spline(t, measured, **options)
            off = np.sqrt(np.mean(rb.angle_between(c(t), R) ** 2) / 3)
            ratios.append(off / 0.03)
            found.append(c.noise / 0.03)
    assert max(ratios) < 0.55
    assert 0.85 < min(found) < max(found) < 1.15


def test_a_short_period_interpolates_and_a_long_one_gives_a_steady_turn():
    c = rb.smoothing_spline(T, NOISY, period=1e-3)
    assert np.abs(c(T) - NOISY).max() < 1e-8
    spline = rb.quaternion_spline(T, NOISY)
    assert np.abs(c(FINE) - spline(FINE)).max() < 1e-3
    steady = rb.exp_so3(T[:, None] * [0.002, 0.001, 0.003])
    measured = steady @ rb.exp_so3(1e-3 * RNG.normal(size=(40, 3)))
    c = rb.smoothing_spline(T, measured, period=500)
    assert np.abs(c(FINE, 2)).max() < 1e-7
    assert np.abs(c(T) - steady).max() < 1e-3


def test_the_fastest_motion_along_a_noisy_recording_takes_hardly_longer():
    """Without smoothing, it takes 22 times as long."""
    file = Path(recording.__file__).with_suffix(".txt")
    times, poses, _ = rb.read_path(file, start="first", skip="nan")
    t = np.linspace(0, 20, 401)
    clean = rb.projected_spline(t, recording.true_path(t), "rest")
    smooth = rb.smoothing_spline(times, poses, "rest")
    assert smooth.noise == pytest.approx([1e-4, 1e-4], rel=0.02)
    limits = {"angular_speed": 1.5, "angular_acceleration": 6, "speed": 0.7, "acceleration": 3}
    least, found = (rb.fastest(c, **limits).domain[1] for c in (clean, smooth))
    assert least < found < 1.05 * least


def test_wrong_poses_are_found_by_the_loop_of_the_docstring():
    t = np.arange(100.0)
    R, measured = wandering(t, 0.05, 0.02)
    measured[[7, 40, 41, 80]] = Rotation.random(4, RNG).as_matrix()
    w = np.ones(100)
    with warnings.catch_warnings(action="ignore"):
        for _ in range(5):
            off = rb.angle_between(rb.smoothing_spline(t, measured, weights=w)(t), measured)
            w = np.minimum(1, 1.5 * np.median(off) / off)
    good = off < 3 * np.median(off)
    assert not good[[7, 40, 41, 80]].any()
    assert good.sum() > 88
    c = rb.smoothing_spline(t[good], measured[good])
    assert np.sqrt(np.mean(rb.angle_between(c(t), R) ** 2)) < 0.02


def test_a_curve_outside_the_domain_is_announced():
    steady = rb.exp_so3(T[:, None] * [0, 0, 2])
    with pytest.warns(RuntimeWarning, match=r"the body turns by 2 rad in the time period/2π"):
        rb.smoothing_spline(T, steady, period=10)
    exact, _ = wandering(T, 0.3)
    with pytest.warns(RuntimeWarning, match="finds nothing to smooth, so the noise is not known"):
        rb.smoothing_spline(T, exact)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"noise": 0.1, "period": 3}, "noise, period: one of them is wanted, got both"),
        ({"noise": 0}, r"noise\[0\] is 0.0, a number above 0"),
        ({"period": [1, 2]}, "period: one is wanted"),
        ({"weights": -W}, r"weights\[0\] is -"),
        ({"weights": W[:5]}, "times, poses, weights: equal numbers are wanted, got 40"),
        ({"ends": "periodic"}, "ends: 'natural' or 'rest' is wanted"),
        ({"times": T[::-1]}, r"times\[1\] is .*, a time from .* on is wanted"),
        ({"times": np.repeat(T[:2], 20)}, "times: three or more different ones"),
    ],
)
def test_bad_arguments_are_named(options, message):
    arguments = {"times": T, "poses": NOISY} | options
    with pytest.raises(ValueError, match=f"^{message}"):
        rb.smoothing_spline(**arguments)
    if options.keys() & {"noise"}:
        with pytest.raises(ValueError, match=r"^noise: a pair"):
            rb.smoothing_spline(T, POSES, noise=0.1)
