"""Test smooth curves near noisy rotations and poses by their definitions and by SciPy."""

import warnings

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline, make_interp_spline, make_smoothing_spline
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation, Slerp

import rbcourse as rb
from rbcourse.curves.smoothing import Smoother
from rbcourse.optimum import minimum_acceleration_smoothing

RNG = np.random.default_rng(79)
T = np.cumsum(RNG.uniform(0.5, 1.5, 40))
W = RNG.uniform(0.5, 2, 40)
METHODS = rb.smoothing_spline, minimum_acceleration_smoothing
FINE = np.linspace(T[0], T[-1], 201)


def wandering(t, turn=0.1, noise=0.02, seed=3):
    """Return rotations without and with noise; they turn by about `turn` per unit of time."""
    rng = np.random.default_rng(seed)
    vectors = turn * np.stack([7 * np.sin(t / 7), t, 5 * np.cos(t / 5)], axis=-1)
    R = rb.exp_so3(vectors)
    return R, R @ rb.exp_so3(noise * rng.normal(size=(len(t), 3)))


NOISY = wandering(T)[1]
PLACES = np.stack([np.sin(T / 6), np.cos(T / 5), 0.1 * T], axis=-1)
POSES = rb.pose_from_components(NOISY, PLACES + 0.01 * RNG.normal(size=(40, 3)))


def test_without_bend_the_smoother_is_scipys_smoothing_spline():
    y = np.random.default_rng(7).normal(size=(40, 3))
    smoother = Smoother(T, W, "natural")
    for smoothing in (1e-3, 1.0, 1e3):
        lam = smoothing * W.mean() * smoother.unit**3
        values, rates = smoother.fit(y, smoothing)
        for column, value, rate in zip(y.T, values.T, rates.T, strict=True):
            theirs = make_smoothing_spline(T, column, w=W, lam=lam)
            assert np.abs(value - theirs(T)).max() < 1e-12
            assert np.abs(rate - theirs(T, 1)).max() < 1e-11


@pytest.mark.parametrize("ends", ["natural", "rest"])
def test_the_smoother_has_the_least_cost(ends):
    """The cost of values and rates is quadratic; least squares solves for them."""
    t, w = T[:9], W[:9]
    smoother, bend, y = Smoother(t, w, ends), *np.random.default_rng(7).normal(size=(2, 9))
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


@pytest.mark.parametrize("make", METHODS)
@pytest.mark.parametrize("data", [NOISY, POSES], ids=["rotations", "poses"])
def test_velocity_and_acceleration_are_continuous(data, make):
    c = make(T, data, weights=W)
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
    with pytest.warns(
        RuntimeWarning, match=r"^ends: the body \w+ at the (first|last) pose, so it is"
    ):
        rest = make(T, data, "rest")
    assert np.abs(rest(T[[0, -1]], 1)).max() < 1e-12


@pytest.mark.parametrize("make", METHODS)
def test_moved_reversed_and_rescaled_rotations_give_the_same_curve(make):
    L, Q = Rotation.random(2, np.random.default_rng(7)).as_matrix()
    c = make(T, NOISY, weights=W)
    moved = make(T, L @ NOISY @ Q, weights=W)
    back = make(-T[::-1], NOISY[::-1], weights=W[::-1])
    slow = make(1e3 * T, NOISY, weights=5 * W)
    assert np.abs(L @ c(FINE) @ Q - moved(FINE)).max() < 1e-10
    assert np.abs(c(FINE) - back(-FINE)).max() < 1e-10
    assert np.abs(c(T) - slow(1e3 * T)).max() < 1e-10
    assert slow.period == pytest.approx(1e3 * c.period)
    assert slow.noise == pytest.approx(5**0.5 * c.noise)
    repeated = np.repeat(T, 2), np.repeat(NOISY, 2, axis=0)
    twice = make(*repeated, weights=np.repeat(W, 2), period=c.period)
    same = make(T, NOISY, weights=2 * W, period=c.period)
    assert np.abs(twice(FINE) - same(FINE)).max() < 1e-12
    longer = c.retimed(2 * float(c.duration))
    assert longer.period == pytest.approx(2 * c.period)


@pytest.mark.parametrize("make", METHODS)
def test_moved_poses_give_the_moved_curve(make):
    L = rb.pose_from_coordinates([0.3, -1, 2, 1, 2, 3])
    Q = rb.pose_from_coordinates([1, 0.2, 0.1, 0, 0, 0])  # keeps the origin
    c, moved = make(T, POSES), make(T, L @ POSES @ Q)
    assert np.abs(L @ c(FINE) @ Q - moved(FINE)).max() < 1e-9
    rotations = make(T, POSES[:, :3, :3])
    assert np.abs(c(FINE)[:, :3, :3] - rotations(FINE)).max() < 1e-14
    assert c.period[0] == rotations.period
    for column, path in zip(POSES[:, :3, 3].T, c(T)[:, :3, 3].T, strict=True):
        theirs = make_smoothing_spline(T, column, lam=_lam(c.period[1]))
        assert np.abs(path - theirs(T)).max() < 1e-12


def _lam(period):
    return (period / (2 * np.pi)) ** 4 / np.diff(T).mean()


BOUNDS = [(METHODS[0], (1e-3, 1e-4)), (METHODS[1], (3e-4, 1e-6))]


@pytest.mark.parametrize(("make", "bounds"), BOUNDS)
def test_rotations_about_one_axis_follow_the_spline_of_the_angle(make, bounds):
    for noise, bound in zip((0.1, 0.01), bounds, strict=True):
        angle = 0.3 * np.sin(T / 4) + noise * np.random.default_rng(7).normal(size=40)
        c = make(T, rb.exp_so3(angle[:, None] * [0, 0, 1]), period=10)
        theirs = make_smoothing_spline(T, angle, lam=_lam(10))(T)
        assert np.abs(rb.log_so3(c(T))[:, 2] - theirs).max() < bound


def test_the_noise_is_found_and_reduced():
    t, ratios, found = np.arange(120.0), [], []
    for seed in range(3):
        R, measured = wandering(t, 0.05, 0.03, seed)
        for options in ({}, {"noise": 0.03}):
            c = rb.smoothing_spline(t, measured, **options)
            off = np.sqrt(np.mean(rb.angle_between(c(t), R) ** 2) / 3)
            ratios.append(off / 0.03)
            found.append(c.noise / 0.03)
    assert max(ratios) < 0.55
    assert 0.85 < min(found) < max(found) < 1.15


def test_a_short_period_interpolates_and_a_long_one_gives_a_steady_turn():
    with pytest.warns(RuntimeWarning, match=r"^period: 0.002 is shorter than a tenth of a step"):
        c = rb.smoothing_spline(T, NOISY, period=2e-3)
    assert np.abs(c(T) - NOISY).max() < 1e-8
    spline = rb.quaternion_spline(T, NOISY)
    assert np.abs(c(FINE) - spline(FINE)).max() < 1e-3
    steady = rb.exp_so3(T[:, None] * [0.002, 0.001, 0.003])
    measured = steady @ rb.exp_so3(1e-3 * np.random.default_rng(7).normal(size=(40, 3)))
    c = rb.smoothing_spline(T, measured, period=500)
    assert np.abs(c(FINE, 2)).max() < 1e-7
    assert np.abs(c(T) - steady).max() < 1e-3


@pytest.mark.parametrize("decimals", [3, 6])
def test_wrong_poses_are_found_in_rounded_recordings_with_long_rests(decimals):
    """Where a recording rests, rounded poses have no errors."""
    t = np.linspace(0, 15, 1001)
    moving = np.sin(np.clip(t, 2, 5))  # for a fifth of the time
    x = moving[:, None] * [0.5, 0.3, 1, 1, 2, 0.5]
    poses = rb.pose_from_coordinates(x.round(decimals))
    poses[[200, 600, 700], :3, 3] += 0.05
    wrong = np.flatnonzero(rb.outliers.wrong_poses(t, poses))
    assert {200, 600, 700} <= {*wrong.tolist()}
    assert len(wrong) < 100  # where the motion begins and ends, its acceleration jumps


@pytest.mark.parametrize("still", [np.s_[:3], np.s_[3:]], ids=["turns", "moves"])
def test_wrong_poses_of_bodies_that_only_turn_or_only_move_are_found(still):
    rng, t = np.random.default_rng(9), np.linspace(0, 6, 600)
    x = np.sin(t)[:, None] * [0.5, 0.2, 0.1, 0.3, 0.4, 0] + 1e-4 * rng.normal(size=(600, 6))
    x[200] += 0.1
    x[:, still] = 0
    found = rb.outliers.wrong_poses(t, rb.pose_from_coordinates(x))
    assert np.flatnonzero(found).tolist() == [200]


def test_wrong_poses_are_found_between_noisy_ones():
    """The first poses accelerate, where natural ends do not follow them."""
    rng, t = np.random.default_rng(7), np.linspace(0, 10, 301)
    vectors = np.stack([np.sin(t), 0.5 * t, np.cos(1.3 * t)], axis=-1)
    true = rb.pose_from_components(rb.exp_so3(vectors), np.stack([np.cos(t), np.sin(t), t], -1))
    poses = true.copy()
    poses[:, :3, :3] @= rb.exp_so3(0.004 * rng.normal(size=(301, 3)))
    poses[:, :3, 3] += 0.002 * rng.normal(size=(301, 3))
    poses[[20, 120, 121, 240], :3, :3] = Rotation.random(4, rng).as_matrix()
    poses[[70, 200], :3, 3] += 0.1
    good = ~rb.outliers.wrong_poses(t, poses)
    assert np.flatnonzero(~good).tolist() == [20, 70, 120, 121, 200, 240]
    turned = rb.outliers.wrong_poses(t, poses[::-1, :3, :3], period=0.4)[::-1]
    assert np.flatnonzero(turned).tolist() == [20, 120, 121, 240]
    c = rb.smoothing_spline(t[good], poses[good])
    assert c.noise == pytest.approx([0.004, 0.002], rel=0.1)
    assert np.sqrt(np.mean(rb.angle_between(c(t)[:, :3, :3], true[:, :3, :3]) ** 2)) < 0.004


@pytest.mark.parametrize("smooth", METHODS)
@pytest.mark.parametrize("part", ["turn", "origin"])
@pytest.mark.parametrize("count", [1, 3])
def test_wrong_poses_are_announced(smooth, part, count):
    """The wrong poses are off by 50 times the noise."""
    rng, t = np.random.default_rng(11), np.linspace(0, 4, 200)
    steady = rb.exp_se3(t[:, None] * [0, 0.3, 1, 0.2, 0, 0])
    good = steady @ rb.exp_se3(0.002 * rng.normal(size=(200, 6)))
    with warnings.catch_warnings(action="error"):
        smooth(t, good)
    shift = np.zeros(6)
    shift[0 if part == "turn" else 4] = 0.1
    wrong = good.copy()
    wrong[60 : 60 + count] @= rb.exp_se3(shift)
    how = rf"or a pose near it may be wrong: its {part} is" if count == 1 else f": the {part} jumps"
    message = rf"^poses\[(59|6[0-3])\] ?{how} .* times .* rbcourse.outliers.wrong_poses finds"
    with pytest.warns(RuntimeWarning, match=message) as told:
        smooth(t, wrong)
    assert told[0].filename == __file__
    with pytest.warns(RuntimeWarning, match=message):
        smooth(t, wrong, period=0.4)
    smooth(t, wrong, period=0.4, weights=np.ones(200))  # as the loop does


def test_a_lasting_turn_by_relabelled_markers_is_announced():
    rng, t = np.random.default_rng(3), np.linspace(0, 10, 1000)
    poses = rb.exp_se3(t[:, None] * [0, 0.3, 1, 0.2, 0, 0] + 0.001 * rng.normal(size=(1000, 6)))
    poses[600:, :3, :3] @= rb.exp_so3([np.pi, 0, 0])
    message = r"^poses\[(599|600)\]: the turn jumps near it, .*; if the poses before .* apart;"
    for period in (None, 0.5):
        with pytest.warns(RuntimeWarning, match=message):
            rb.smoothing_spline(t, poses, period=period)


def test_a_turn_too_fast_for_the_search_of_wrong_poses_is_announced():
    t = np.arange(100.0)
    noise = 0.05 * np.random.default_rng(2).normal(size=(100, 3))
    turning = rb.exp_so3(t[:, None] * [0, 0, 1]) @ rb.exp_so3(noise)
    with pytest.warns(RuntimeWarning, match=r"^period: the body turns by 1.* rad .* shorter one"):
        rb.outliers.wrong_poses(t, turning)
    assert not rb.outliers.wrong_poses(t, turning, period=3).any()
    with pytest.raises(ValueError, match=r"^period"):
        rb.outliers.wrong_poses(t, turning, period=0)


@pytest.mark.parametrize("step", [0.005, 0.1])
@pytest.mark.parametrize("noise", [0, 1e-5, 1e-3])
def test_motions_whose_velocity_jumps_have_no_wrong_poses(step, noise):
    rng, t = np.random.default_rng(5), np.arange(0, 10, step)
    way = np.interp(t, [0, 2, 4, 5, 5.5, 8], [0, 0, 2, 2, 1, 3])[:, None] * [0.2, 0.5, 0, 1, 0, 0.3]
    poses = rb.pose_from_coordinates(way + noise * rng.normal(size=(len(t), 6)))
    with warnings.catch_warnings(action="error"):
        rb.smoothing_spline(t, poses, period=max(1, 10 * step))


@pytest.mark.parametrize("speed", [0.1, 1, 10])
@pytest.mark.parametrize("period", [None, 0.5])
def test_an_end_that_does_not_rest_is_told(speed, period):
    rng, t = np.random.default_rng(6), np.linspace(0, 4, 401)
    steady = speed * t[:, None] * [0, 0, 1, 1, 0, 0] + 1e-3 * speed * rng.normal(size=(401, 6))
    until = np.minimum(steady, 3 * speed)  # at rest for the last second
    with pytest.warns(RuntimeWarning) as told:
        rb.smoothing_spline(t, rb.pose_from_coordinates(until), "rest", period=period)
    ends = [str(each.message) for each in told if str(each.message).startswith("ends:")]
    assert [x.removeprefix("ends: the body ").partition(",")[0] for x in ends] == [
        "turns at the first pose",
        "moves at the first pose",
    ]


def moving_and_resting(rng):
    t = np.arange(2000) / 100
    way = np.clip(np.sin(t), -0.5, 1)[:, None] * [0.2, 0.5, 0, 1, 0, 0.3]
    return t, rb.exp_se3(way + 1e-3 * rng.normal(size=(2000, 6)))


@pytest.mark.parametrize("kind", ["25 Hz", "50 Hz", "some", "one freeze"])
def test_poses_that_a_tracker_repeats_are_announced(kind):
    rng = np.random.default_rng(10)
    t, poses = moving_and_resting(rng)
    last = np.arange(2000)
    if kind == "some":
        last = np.maximum.accumulate(np.where(rng.uniform(size=2000) < 0.3, 0, last))
    elif kind == "one freeze":
        last[1230:1260] = 1230
    else:
        last -= last % (100 // int(kind[:2]))
    held = poses[last]
    for period in (None, 0.5):
        with pytest.warns(RuntimeWarning, match=r"^poses: \d+ poses, such as .* new = ") as told:
            rb.smoothing_spline(t, held, period=period)
    new = eval(str(told[0].message).rpartition("new = ")[2], {"np": np, "poses": held})
    with warnings.catch_warnings(action="ignore"):  # the freeze is a gap now
        c = rb.smoothing_spline(t[new], held[new])
    assert c.noise == pytest.approx([1e-3, 1e-3], rel=0.15)


@pytest.mark.parametrize("decimals", [3, 6])
def test_equal_poses_of_rounded_rests_are_not_those_of_a_tracker(decimals):
    t = np.arange(1500) / 100
    x = np.sin(np.clip(t, 4, 9))[:, None] * [0.5, 0.3, 1, 1, 2, 0.5]
    x += 0.2 * 10.0**-decimals * np.random.default_rng(1).normal(size=x.shape)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        rb.smoothing_spline(t, rb.pose_from_coordinates(x.round(decimals)))
    assert not [each for each in told if str(each.message).startswith("poses: ")]


def test_an_exact_rest_at_the_start_is_not_a_frozen_tracker():
    t = np.arange(200) / 100
    way = np.maximum(t - 0.15, 0)[:, None] * [0, 0, 1, 1, 0, 0]
    with warnings.catch_warnings(action="error"):
        rb.smoothing_spline(t, rb.pose_from_coordinates(way), period=0.2)


def test_a_period_in_another_unit_than_the_times_is_announced():
    t, poses = moving_and_resting(np.random.default_rng(13))
    with pytest.warns(RuntimeWarning, match=r"^period: 0.5 is shorter than a tenth of a step, "):
        rb.smoothing_spline(1000 * t, poses, period=0.5)


def test_times_of_receipt_are_announced():
    t, poses = moving_and_resting(np.random.default_rng(12))
    received = np.floor(10 * t) / 10 + np.arange(2000) % 10 * 2e-4
    said = r"and in 19[0-9] other intervals.* the times may be those at which"
    with pytest.warns(RuntimeWarning, match=said):
        rb.smoothing_spline(received, poses)


@pytest.mark.parametrize("noise", [0, 1e-5, 1e-3])
def test_ends_at_rest_are_not_called_moving(noise):
    rng, t = np.random.default_rng(8), np.linspace(0, 4, 401)
    u = t / 4
    for way in (0 * t, 3 * u**2 - 2 * u**3, 10 * u**3 - 15 * u**4 + 6 * u**5, np.maximum(t - 1, 0)):
        moves = way[:, None] * [0.2, 0.5, 0, 1, 0, 0.3] * (t < 3)[:, None]
        poses = rb.pose_from_coordinates(moves + noise * rng.normal(size=(401, 6)))
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            rb.smoothing_spline(t[:300], poses[:300], "rest", period=0.3)
        assert not [x for x in told if "the last pose" not in str(x.message)]


@pytest.mark.parametrize("rests", [0, 900])
def test_no_pose_of_a_motion_without_noise_is_called_wrong(rests):
    """A steady turn has errors of rounding. After a rest, poses have rounded coordinates."""
    t = np.arange(1500) / 100
    turn = np.maximum(t - t[rests], 0)
    vectors = (turn if not rests else (1 - np.cos(3 * turn)).round(4))[:, None] * [0, 0.3, 0.8]
    with warnings.catch_warnings(action="error"):
        rb.smoothing_spline(t, rb.exp_so3(vectors))


@pytest.mark.parametrize("smooth", METHODS)
def test_cross_validation_of_few_poses_is_announced(smooth):
    """These poses have no noise, but a curve that hardly moves is found."""
    t = np.arange(4) / 3
    path = np.stack([np.sin(2 * np.pi * t), 0 * t, 0 * t], axis=-1)
    with pytest.warns(RuntimeWarning, match="cross validation of 4 poses may take the motion for"):
        smooth(t, rb.pose_from_components(np.eye(3), path))


@pytest.mark.parametrize("smooth", METHODS)
def test_a_gap_is_announced(smooth):
    """A gap of two periods; every tenth time, and random times without a gap, are no gaps."""
    t = np.linspace(0, 8, 200)
    _, poses = wandering(t, 0.3)
    known = np.abs(t - 4) > 1
    with pytest.warns(RuntimeWarning, match=r"no pose between 2\.97\S* and 5\.02\S*, .* period 1,"):
        smooth(t[known], poses[known], period=1)
    smooth(t[known], poses[known], period=2.2)
    smooth(t[::10], poses[::10], period=0.3)
    uneven = np.sort(np.random.default_rng(4).choice(200, 100, replace=False))
    smooth(t[uneven], poses[uneven], period=1)


def test_a_curve_outside_the_domain_is_announced():
    steady = rb.exp_so3(T[:, None] * [0, 0, 2])
    with pytest.warns(RuntimeWarning, match=r"the body turns by 2 rad in the time period/2π"):
        rb.smoothing_spline(T, steady, period=10)
    exact, _ = wandering(T, 0.3)
    with pytest.warns(RuntimeWarning, match="finds nothing to smooth, so the noise is not known"):
        rb.smoothing_spline(T, exact)
    origins = np.random.default_rng(0).normal(size=(len(T), 3))
    with pytest.warns(RuntimeWarning, match=r"^rotations: cross validation finds nothing"):
        rb.smoothing_spline(T, rb.pose_from_components(exact, origins))
    with pytest.warns(RuntimeWarning, match="nothing is smoothed; some poses are wrong, or noise"):
        rb.smoothing_spline(T, NOISY, noise=1e-9)


def test_a_period_that_is_too_long_for_weights_that_differ_is_refused():
    t = np.arange(2000.0)
    w = np.where(np.arange(2000) % 2, 1e-6, 1)
    R = rb.exp_so3(t[:, None] * [0, 0, 1e-9])
    with pytest.raises(ValueError, match=r"^period: a shorter one .* weights from 1e-06 to 1$"):
        rb.smoothing_spline(t, R, weights=w, period=1e8)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"noise": 0.1, "period": 3}, "noise, period: one of them is wanted, got both"),
        ({"noise": 0}, "noise is 0.0, a number above 0"),
        ({"period": [1, 2]}, "period: one is wanted"),
        ({"weights": -W}, r"weights\[0\] is -"),
        ({"weights": W**40}, "weights: a ratio of at most 1e\\+06 is wanted, got"),
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


# the optimum


def _pulls(c):
    """Return 2 λ times the jumps of c, and vee(R Dᵀ − D Rᵀ), at the knots."""
    lam = (c.period / (2 * np.pi)) ** 4 * W.mean() / np.diff(T).mean()
    A = c(T) @ (W[:, None, None] * NOISY).mT
    return 2 * lam * np.diff(np.pad(c.c, [(1, 1), (0, 0)]), axis=0), rb.vee_so3(A - A.mT)


def test_the_costate_of_the_optimum_jumps_by_the_pull_of_the_measurement():
    for options in ({}, {"period": 5.0}, {"noise": 0.03}, {"period": 60.0}):
        c = minimum_acceleration_smoothing(T, NOISY, weights=W, **options)
        jumps, pulls = _pulls(c)
        assert np.abs(jumps + pulls).max() < 1e-10
        assert np.abs(pulls.sum(axis=0)).max() < 1e-10
        assert np.abs(c(T[[0, -1]], 2)).max() < 1e-10
        assert c.certified
        assert c.cost == pytest.approx(rb.acceleration_cost(c), rel=1e-10)


def test_the_optimum_ranges_from_the_interpolating_one_to_the_best_steady_turn():
    t, R = T[:8], wandering(T[:8], 0.4, 0.1)[1]
    with pytest.warns(RuntimeWarning, match=r"^period: 0.01 is shorter than a tenth of a step"):
        tight = minimum_acceleration_smoothing(t, R, period=1e-2)
    through = rb.minimum_acceleration_spline(t, R)
    fine = np.linspace(t[0], t[-1], 99)
    assert np.abs(tight(fine) - through(fine)).max() < 1e-8
    assert tight.cost == pytest.approx(through.cost, rel=1e-8)

    def off(x):
        return (rb.exp_so3(x[:3]) @ rb.exp_so3(t[:, None] * x[3:]) - R).ravel()

    exact = dict.fromkeys(("xtol", "ftol", "gtol"), 1e-15)
    best = least_squares(off, np.append(rb.log_so3(R[0]), [0.4, 0.4, 0]), **exact).x
    steady = rb.exp_so3(best[:3]) @ rb.exp_so3(t[:, None] * best[3:])
    apart = [
        np.abs(minimum_acceleration_smoothing(t, R, period=x)(t) - steady).max()
        for x in (100.0, 200.0)
    ]
    assert apart[0] < 1e-4
    assert apart[1] == pytest.approx(apart[0] / 16, rel=0.02)


def test_the_optimum_is_found_where_the_closed_form_is_far_from_it():
    t = np.arange(30.0)
    for step in (0.3, 0.8, 1.5):
        measured = wandering(t, step, step / 6)[1]
        period = 2 * np.pi * 1.5 / step
        c = minimum_acceleration_smoothing(t, measured, period=period)
        with pytest.warns(RuntimeWarning, match=r"optimum\.minimum_acceleration_smoothing"):
            near = rb.smoothing_spline(t, measured, period=period)
        lam = (period / (2 * np.pi)) ** 4
        of_both = [
            np.sum((x(t) - measured) ** 2) + lam * rb.acceleration_cost(x) for x in (c, near)
        ]
        assert c.certified
        assert of_both[0] < 0.98 * of_both[1]


def test_the_cost_of_an_optimum_near_poses_has_both_parts():
    c = minimum_acceleration_smoothing(T, POSES)
    assert c.cost == pytest.approx(rb.acceleration_cost(c), rel=1e-9)
    assert rb.acceleration_cost_parts(c)[1] > 1e-3 * c.cost
    assert repr(c).startswith("<Optimum of acceleration near poses at 40 times")


def test_the_optimum_finds_its_own_period():
    """At 60° a step, the cross validation of the closed form finds nothing to smooth."""
    t, rng = np.arange(60.0), np.random.default_rng(5)
    turns = np.cumsum(rng.normal(scale=0.3, size=(60, 3)), axis=0) / 4 + [0.6, 0.6, 0.6]
    R = np.array([np.eye(3)] * 60)
    for i in range(1, 60):
        R[i] = R[i - 1] @ rb.exp_so3(turns[i])
    measured = R @ rb.exp_so3(0.1 * rng.normal(size=(60, 3)))
    c = minimum_acceleration_smoothing(t, measured)
    lams = (c.period / (2 * np.pi)) ** 4 * np.exp([-0.75, 0, 0.75])
    smoother = Smoother(t, np.ones(60), "natural")
    scores = []
    for lam in lams:
        near = minimum_acceleration_smoothing(t, measured, period=2 * np.pi * lam**0.25)
        misfit = np.sum((near(t) - measured) ** 2) / 2
        scores.append(np.log(misfit) - 2 * np.log(smoother.freedom(lam)))
    assert scores[1] < min(scores[0], scores[2])
    assert c.certified
    longer = c.retimed(2 * c.domain[1])
    assert longer.period == pytest.approx(2 * c.period)


def test_an_optimum_that_is_not_found_raises_an_error():
    R = Rotation.random(12, np.random.default_rng(1)).as_matrix()
    with pytest.raises(rb.optimum.ConvergenceError, match="body may turn too far in the time"):
        minimum_acceleration_smoothing(np.arange(12), R, period=100)


@pytest.mark.parametrize("gap", [1e-9, 5e-4])
def test_poses_at_nearly_equal_times_are_averaged(gap):
    """The gap is in steps; two sensors on one clock give such times."""
    t = 0.05 * np.arange(80)
    R = rb.exp_so3(np.stack([np.sin(t), np.cos(t), 0 * t], axis=1))
    R = R @ rb.exp_so3(0.01 * np.random.default_rng(0).normal(size=(80, 3)))
    t[40] = t[39]
    for again in (t, np.repeat(t[::2], 2)):
        close = again + 0.05 * gap * (np.append(1, np.diff(again)) == 0)
        for smooth in (rb.smoothing_spline, rb.optimum.minimum_acceleration_smoothing):
            wanted, found = smooth(again, R), smooth(close, R)
            assert found.period == pytest.approx(wanted.period, rel=1e-4)
            assert found.noise == pytest.approx(wanted.noise, rel=1e-4)
            assert rb.angle_between(found(again), wanted(again)).max() < 1e-4


def test_a_period_in_another_unit_than_the_times_is_refused():
    t = np.linspace(0, 10e6, 100)  # µs
    with pytest.raises(
        ValueError, match=r"^period: a thousandth of the mean step 1.01e\+05 or more"
    ):
        rb.smoothing_spline(t, rb.exp_so3(t[:, None] * [0, 0, 1e-7]), period=0.5)


@pytest.mark.parametrize(("rate", "noise"), [(30, 0), (30, 1e-5), (200, 0), (200, 1e-3)])
def test_few_right_poses_are_found_to_be_wrong(rate, noise):
    """Without noise, the curve is farther from poses where the motion accelerates."""
    rng, t = np.random.default_rng(1), np.arange(0, 10, 1 / rate)
    x = np.sin(t[:, None] + np.arange(6)) * [0.5, 0.8, 0.3, 0.3, 0.4, 0.2]
    poses = rb.pose_from_coordinates(x + noise * rng.normal(size=x.shape))
    wrong = np.sort(rng.choice(len(t), 8, replace=False))
    poses[wrong, :3, 3] += [0, 0.05, 0]
    found = rb.outliers.wrong_poses(t, poses)
    assert found[wrong].all()
    assert found.sum() <= 8 + 6
    inside = np.arange(20, len(t) - 20)
    assert {*inside[found[20:-20]].tolist()} <= {*wrong.tolist()}


@pytest.mark.parametrize("size", [0.02, 0.1, 1])
def test_three_wrong_poses_in_a_row_are_found(size):
    rng, t = np.random.default_rng(1), np.arange(0, 10, 0.02)
    x = np.sin(t[:, None] + np.arange(6)) * [0.5, 0.8, 0.3, 0.3, 0.4, 0.2]
    poses = rb.pose_from_coordinates(x + 1e-3 * rng.normal(size=x.shape))
    poses[100:103, :3, 3] += [size, 0, 0]
    poses[300:303] @= rb.exp_se3([0, size, 0, 0, 0, 0])
    found = np.flatnonzero(rb.outliers.wrong_poses(t, poses))
    assert found.tolist() == [100, 101, 102, 300, 301, 302]


@pytest.mark.parametrize("rate", [100, 200, 1000])
@pytest.mark.parametrize("jitter", [0, 0.004])
def test_interpolated_poses_are_announced(rate, jitter):
    """Poses of 50 in a second are looked up at other times."""
    rng, t = np.random.default_rng(4), np.arange(0, 10, 0.02)
    t = t + rng.uniform(-jitter, jitter, len(t))
    x = np.sin(t[:, None] + np.arange(6)) * [0.5, 0.8, 0.3, 0.3, 0.4, 0.2]
    A = rb.pose_from_coordinates(x + 1e-3 * rng.normal(size=x.shape))
    at = np.arange(t[1], t[-2], 1 / rate)
    R = Slerp(t, Rotation.from_matrix(A[:, :3, :3]))(at).as_matrix()
    looked_up = rb.pose_from_components(R, make_interp_spline(t, A[:, :3, 3], k=1)(at))
    message = (
        "nothing to smooth" if rate == 100 and jitter else r"^poses: .* if .* interpolated, smo"
    )
    with pytest.warns(RuntimeWarning, match=message) as told:
        rb.smoothing_spline(at, looked_up)
    assert not any("wrong" in str(each.message) for each in told)
    assert {each.filename for each in told} == {__file__}
    with warnings.catch_warnings(action="error"):
        rb.smoothing_spline(t, A)
        rb.smoothing_spline(at, looked_up, period=0.3)


@pytest.mark.parametrize("speed", [0.003, 0.01])
def test_rounded_poses_of_a_slow_motion_are_not_called_interpolated(speed):
    rng, t = np.random.default_rng(4), np.arange(0, 20, 0.005)
    x = speed * np.sin(t[:, None] + np.arange(6))
    x[:, :3] += 1e-3 * rng.normal(size=(len(t), 3))
    x[:, 3:] = x[:, 3:].round(3)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        rb.smoothing_spline(t, rb.pose_from_coordinates(x))
    for each in told:  # errors of rounding are alike in neighbouring poses
        assert "the origin seems to oscillate" in str(each.message)


@pytest.mark.parametrize("dependence", [0, 0.5, 0.9])
def test_dependent_errors_of_a_slow_motion_are_announced(dependence):
    rng, t = np.random.default_rng(4), np.arange(0, 10, 0.01)
    errors = rng.normal(size=(len(t), 6))
    for i in range(1, len(t)):
        errors[i] = dependence * errors[i - 1] + np.sqrt(1 - dependence**2) * errors[i]
    x = np.sin(t[:, None] + np.arange(6)) * [0.5, 0.8, 0.3, 0.3, 0.4, 0.2]
    A = rb.pose_from_coordinates(x + 0.01 * errors)
    with warnings.catch_warnings(action="error"):
        rb.smoothing_spline(t, A, period=0.5)
        if not dependence:
            rb.smoothing_spline(t, A)
            return
    with pytest.warns(RuntimeWarning) as told:
        rb.smoothing_spline(t, A)
    assert {each.filename for each in told} == {__file__}
    for each, part in zip(told, ("turn", "origin"), strict=True):
        assert f"poses: the {part} seems to oscillate" in str(each.message)


def test_many_wrong_poses_may_be_those_of_a_varying_noise():
    rng, t = np.random.default_rng(4), np.arange(0, 10, 0.01)
    noise = np.where((t > 3) & (t < 5), 0.02, 0.001)[:, None] * rng.normal(size=(len(t), 6))
    A = rb.pose_from_coordinates(np.sin(t[:, None] + np.arange(6)) * 0.3 + noise)
    with pytest.warns(
        RuntimeWarning, match=r"^poses: 1\d\d of 1000 .* noise may vary; if so, keep"
    ):
        rb.outliers.wrong_poses(t, A)
