"""Check the fastest timing by formulas, other programs, limits at many times, and symmetries."""

import tracemalloc
from itertools import pairwise
from unittest import mock

import numpy as np
import oracles
import pytest
from quick import quick_for
from scipy.integrate import quad

import rbcourse as rb
from rbcourse import textbook
from rbcourse.curves import _cells

I4, REST = np.eye(4), np.zeros(3)
LEMNISCATE = 2.62205755429212  # B(1/4, 1/2)/2
BODY = {"torque": 0.08, "force": 25.0, "gravity": (0, 0, -9.81)}
NORMS = {"angular_speed": 1.5, "speed": 1, "angular_acceleration": 4, "acceleration": 3}
SETS = {
    "norms": NORMS,
    "boxes": NORMS | {"angular_acceleration": [4, 3, 5], "acceleration": [3, 4, 2]},
    "body": BODY | {"body": rb.Body(np.diag([0.02, 0.03, 0.04]), 1.5, [0.05, 0, 0.1])},
    "accelerations": {"angular_acceleration": 4, "acceleration": 3},
}
sets = pytest.mark.parametrize("name", quick_for(["boxes", "body"], SETS))


def random_chain(seed):
    rng = np.random.default_rng([52, seed])
    n, poses = int(rng.integers(3, 9)), [I4]
    scale = [0.8, 0.8, 0.8, 0.5, 0.5, 0.5]
    for step in rb.pose_from_coordinates(rng.uniform(-1, 1, (n, 6)) * scale):
        poses.append(poses[-1] @ step)
    return spline(np.append(0, np.cumsum(rng.uniform(0.5, 1.5, n))), np.array(poses))


def limits_of(given):
    return {name: limit for name, limit in given.items() if name != "body"}


def spline(times, poses, **given):
    return rb.projected_spline(times, poses, "rest", **given)


def moved(*d):
    return rb.pose_from_components(np.eye(3), d)


def circle(angle, radius):
    R = rb.exp_so3([0, 0, angle])
    return rb.screw(moved(radius, 0, 0), rb.pose_from_components(R, R @ [radius, 0, 0]))


def trapezoid(length, v, a):
    return length / v + v / a if length >= v * v / a else 2 * np.sqrt(length / a)


def on_circle(angle, r, a):
    """Return the least time from rest to rest on a circle; v² is r a sin(2s/r) until it is r a."""
    if angle > np.pi / 2:
        return LEMNISCATE * np.sqrt(r / a) + (angle - np.pi / 2) * np.sqrt(r / a)
    half = np.sqrt(r * angle / 2)
    return 2 * quad(lambda q: 2 * q / np.sqrt(r * a * np.sin(2 * q * q / r)), 0, half)[0]


TURN, LINE = np.array([0.3, 1.0, -0.7]), moved(1, 2, 2)
ANGLE = np.linalg.norm(TURN)
SIDEWAYS, G = np.array([1, 2, -1]) / np.sqrt(6), np.diag([1.0, 2, 3])
ALONG, ACROSS = np.linalg.norm(G @ SIDEWAYS), np.linalg.norm(np.cross(SIDEWAYS, G @ SIDEWAYS))
CORNERS = rb.exp_so3([[0, 0, 0], [0, 0, 1], [0, 0.7, 1]])
CORNER = [float(rb.angle_between(R0, R1)) for R0, R1 in pairwise(CORNERS)]


def about(axis):
    return rb.geodesic(np.eye(3), rb.exp_so3(axis))


SPINNING = {"angular_speed": 1, "angular_acceleration": 2}
MOVING = {"speed": 1, "acceleration": 2}
FORMULAS = {
    "trapezoid": (about(TURN), SPINNING, trapezoid(ANGLE, 1, 2), 3e-7),
    "bang-bang": (about(TURN), {"angular_acceleration": 2}, 2 * np.sqrt(ANGLE / 2), 1e-12),
    "line": (rb.geodesic(I4, LINE), MOVING, 3.5, 2e-6),
    "line, cubic": (spline([0, 1], [I4, LINE]), MOVING, 3.5, 2e-5),
    "line, quintic": (rb.projected_quintic(I4, LINE), MOVING, 3.5, 5e-4),
    "long circle": (circle(3, 0.5), {"acceleration": 2}, on_circle(3, 0.5, 2), 3e-4),
    "short circle": (circle(1.2, 0.5), {"acceleration": 2}, on_circle(1.2, 0.5, 2), 3e-4),
    "tool": (
        rb.geodesic(I4, rb.pose_from_components(rb.exp_so3([0, 0, 3]), REST)),
        {"acceleration": 2, "body": rb.Body(G, centre=(0.3, 0.4, 1))},
        on_circle(3, 0.5, 2),
        3e-4,
    ),
    "torque": (
        about(3 * SIDEWAYS),
        {"torque": 1.5, "body": rb.Body(G)},
        on_circle(3 * ACROSS / ALONG, ALONG / ACROSS, 1.5 / ALONG),
        1e-4,
    ),
    "upwards": (
        rb.geodesic(I4, moved(0, 0, 2)),
        {"force": 15, "gravity": (0, 0, -9.81), "body": rb.Body(G)},
        2 * np.sqrt(1 / (15 - 9.81) + 1 / (15 + 9.81)),
        1e-9,
    ),
    "corner": (
        rb.chain([0, 1, 3], CORNERS, leg=rb.geodesic),
        SPINNING,
        sum(trapezoid(angle, 1, 2) for angle in CORNER),
        1e-5,
    ),
    "from 0.5 to 0.8 m/s": (
        rb.geodesic(I4, LINE),
        MOVING | {"rates": (0.5 / 3, 0.8 / 3)},
        0.35 + 3 - (1 - 0.25) / 4 - (1 - 0.64) / 4,
        2e-6,
    ),
}


@pytest.mark.source("beyond BK 16")
@pytest.mark.parametrize("name", FORMULAS)
def test_the_least_time_agrees_with_the_formula(name):
    curve, limits, T, tolerance = FORMULAS[name]
    assert rb.fastest(curve, **limits).domain[1] == pytest.approx(T, rel=tolerance)


def test_a_turn_with_bounded_torque_has_the_timing_of_the_textbook():
    s, times = textbook.fastest(2.5 * SIDEWAYS, G, 1.5, 1000)
    timed = rb.fastest(about(2.5 * SIDEWAYS), torque=1.5, body=rb.Body(G))
    np.testing.assert_allclose(timed.s, s, rtol=1e-14)
    np.testing.assert_allclose(timed.times, times, rtol=1e-10)


OPTIMA = {
    "norms": [6.400006444, 6.118844646, 4.46818924, 3.023376116],
    "boxes": [6.071880093, 5.777161945, 4.280636912, 2.98707453],
    "body": [7.85807474, 7.153200228, 4.84100414, 2.785995165],
    "accelerations": [6.093687594, 5.602320193, 4.178093288, 2.900274533],
}
"""The least times on the same cells, by the cone program Clarabel."""


@pytest.mark.parametrize("name", OPTIMA)
def test_no_timing_on_the_same_cells_is_faster(name, monkeypatch):
    monkeypatch.setattr(_cells, "REFINEMENTS", 0)
    monkeypatch.setattr(_cells, "TOLERANCE", 0.1)
    for seed, T in enumerate(OPTIMA[name]):
        found = rb.fastest(random_chain(seed), **SETS[name]).domain[1]
        assert -1e-8 < found / T - 1 < 1e-4


def test_times_with_box_limits_agree_with_toppra():
    for seed, T in enumerate([2.4639600513, 2.8119294681, 1.8797166882]):
        c, rng = random_chain(seed), np.random.default_rng(seed)
        A0, A1 = c(np.array(c.domain))
        w0, w1, d0_dot, d1_dot = rng.uniform(-1, 1, (4, 3))
        v0, v1 = rb.twist_from_rates(A0, w0, d0_dot), rb.twist_from_rates(A1, w1, d1_dot)
        leg = rb.minimum_acceleration(A0, A1, v0, v1)
        limits = {"angular_speed": 1.5, "speed": 1.0}
        limits |= {"angular_acceleration": [4, 3, 5], "acceleration": [3, 4, 2]}
        assert rb.fastest(leg, **limits).domain[1] == pytest.approx(T, rel=1e-5)


@sets
def test_one_limit_is_reached_at_nearly_all_times(name):
    for seed in range(2):
        timed = rb.fastest(random_chain(100 + seed), **SETS[name])
        t = np.linspace(*timed.domain, 20_001)
        V, A, R = (timed(t, order) for order in (1, 2, 0))
        limits = _cells.as_limits(timed, SETS[name].get("body"), **limits_of(SETS[name]))
        vectors = [limit.vectors(V, A, R[:, :3, :3]) for limit in limits]
        used = [np.linalg.norm(b + k, axis=-1).max(axis=-1) for _, b, k in vectors]
        used = np.max(used, axis=0)  # these are the squares of the shares of speeds
        assert used.max() < 1 + 1e-4
        assert np.mean(used > 0.99) > 0.9
        largest = rb.limits_used(timed, **SETS[name])
        assert max(share for share, _ in largest.values()) == pytest.approx(used.max(), abs=1e-4)


def test_shares_of_limits_agree_with_the_torque_and_the_force():
    c, r, g = random_chain(4), np.array([0.2, -0.1, 0.4]), np.array([1.0, 2, -9])
    t = np.linspace(0.2, 0.8, 7) * c.times[1]
    V, A, R = c(t, 1), c(t, 2), c(t)[:, :3, :3]

    def point(t):
        return c(t)[..., :3, :3] @ r + c(t)[..., :3, 3]

    rate = oracles.derivative_by_differences(point, t, 1e-3)
    bend = oracles.derivative_by_differences(
        lambda t: oracles.derivative_by_differences(point, t, 1e-2), t, 1e-2
    )
    force = (R.mT @ (2.0 * (bend - g))[..., None])[..., 0]
    limits = {"speed": 1, "acceleration": 1, "force": [1, 1, 1], "torque": 1}
    used = {}
    for limit in _cells.as_limits(c, rb.Body(G, 2.0, r), **limits, gravity=g):
        _, b, k = limit.vectors(V, A, R)
        used[limit.name] = b + k
    w = V[:, :3]
    torque = A[:, :3] @ G + np.cross(w, w @ G)
    np.testing.assert_allclose(used["torque"][:, 0], torque, atol=1e-13)
    np.testing.assert_allclose(used["force"][..., 0], force, atol=1e-7)
    np.testing.assert_allclose(used["speed"][:, 0, 0], np.sum(rate**2, axis=1))
    size = np.linalg.norm(bend, axis=1)
    np.testing.assert_allclose(np.linalg.norm(used["acceleration"][:, 0], axis=1), size, atol=1e-7)


@sets
def test_the_least_time_has_the_symmetries_of_the_problem(name):
    """Move or reverse the path, change its times, or change the unit of length. Finally scale all
    limits so that the motion is k times as fast."""
    c, limits = random_chain(7), SETS[name]
    t, poses, T = c.times, c(c.times), rb.fastest(c, **limits).domain[1]
    turned = rb.pose_from_coordinates([0, 0, 0.8, 3, -2, 1])  # this pose turns about the vertical
    metres, body = ("speed", "acceleration", "force", "gravity"), limits.get("body", rb.Body.ball())

    def longer(unit):
        far = poses.copy()
        far[:, :3, 3] *= unit
        other = rb.Body(body.inertia, body.mass, unit * body.centre)
        theirs = limits_of(limits).items()
        return far, {k: np.multiply(x, unit) if k in metres else x for k, x in theirs}, other

    def faster(k):
        power, theirs = {"speed": 1, "angular_speed": 1}, limits_of(limits).items()
        return {name: np.multiply(x, k ** power.get(name, 2)) for name, x in theirs}

    same = [rb.fastest(spline(t, turned @ poses), **limits)]
    same += [rb.fastest(spline(-t[::-1], poses[::-1]), **limits)]
    same += [rb.fastest(c.retimed(7.0), **limits), rb.fastest(c.moved(turned), **limits)]
    if "body" not in limits:  # norms and components are those of the centre, in the body frame
        same += [rb.fastest(c.moved(right=moved(1, 2, 3)), **limits)]
    for unit in (1e-4, 1e6):
        far, theirs, other = longer(unit)
        same += [rb.fastest(spline(t, far), **theirs, body=other)]
    assert [x.domain[1] / T for x in same] == pytest.approx(np.ones(len(same)), rel=1e-12)
    quick = rb.fastest(c, body=body, **faster(1.7))
    assert quick.domain[1] * 1.7 == pytest.approx(T, rel=1e-12)


def test_the_body_of_a_curve_is_timed():
    """Another body frame, such as that of a tool, is no other body, and the motion is the same."""
    c, limits, X = random_chain(7), dict(SETS["body"]), rb.pose_from_coordinates([1, 2, 3, 1, 2, 3])
    c = spline(c.times, c(c.times), body=limits.pop("body"))
    timed, tool = rb.fastest(c, **limits), rb.fastest(c.moved(right=X), **limits)
    other = rb.fastest(c, body=rb.Body(G), **limits)
    assert timed.domain == rb.fastest(c, body=c.body, **limits).domain
    assert timed.domain[1] < 0.9 * other.domain[1]
    for one, body in ((timed, c.body), (other, rb.Body(G))):
        used = rb.limits_used(one, body=body, **limits)
        assert rb.limits_used(one, **limits) == used
        of_tool = rb.limits_used(one.moved(right=X), **limits)
        assert [of_tool[name][0] for name in used] == pytest.approx([x for x, _ in used.values()])
        assert rb.fastest(one, **limits).domain == one.domain
    assert tool.domain == pytest.approx(timed.domain, rel=1e-9)
    t = np.linspace(*timed.domain, 9)
    for order, found in enumerate(timed.moved(right=X).state(t)):
        np.testing.assert_allclose(found, tool(t * tool.domain[1] / t[-1], order), atol=1e-6)
    assert np.abs(tool(t[:-1]) - timed(t[:-1]) @ X).max() < 1e-9


def test_the_centre_of_a_given_body_is_limited():
    """The speed of the tip of a tool is found by differences of its places."""
    c, tip = random_chain(9), np.array([0.3, -0.2, 0.1])
    timed = rb.fastest(c, body=rb.Body(np.eye(3), centre=tip), speed=0.7, acceleration=3)
    t = np.linspace(*timed.domain, 20_001)
    places = timed(t)[:, :3, :3] @ tip + timed(t)[:, :3, 3]
    speeds = np.linalg.norm(np.diff(places, axis=0), axis=1) / np.diff(t)
    assert speeds.max() == pytest.approx(0.7, rel=1e-4)
    assert rb.limits_used(timed, speed=0.7)["speed"][0] == pytest.approx(1)
    of_origin = rb.limits_used(timed, body=rb.Body(np.eye(3)), speed=0.7)
    assert of_origin["speed"][0] != pytest.approx(1, rel=0.1)


@sets
def test_the_least_time_does_not_depend_on_the_clock(name):
    """Shift and scale the times. A shift loses the digits of the times below its ulp."""
    c, limits = random_chain(8), SETS[name]
    poses, T = c(c.times), rb.fastest(c, **limits).domain[1]
    clocks = [(1e-3, 0, 1e-12), (1e3, 0, 1e-12), (1, 1e3, 1e-11), (1, 1e6, 1e-9), (1, 1.7e9, 1e-6)]
    for unit, shift, tolerance in clocks:
        later = spline(unit * c.times + shift, poses)
        timed = rb.fastest(later, **limits)
        assert timed.domain[1] == pytest.approx(T, rel=tolerance)
        there = timed.times[np.searchsorted(timed.s, later.times - later.times[0])]
        assert np.abs(timed(there) - poses).max() < 1e-12


def test_shares_of_limits_do_not_depend_on_the_clock():
    c = random_chain(8)
    used = rb.limits_used(c, **NORMS)
    for shift, tolerance in ((1e3, 1e-11), (1e6, 1e-8), (1.7e9, 1e-5)):
        later = rb.limits_used(spline(c.times + shift, c(c.times)), **NORMS)
        for limit, (share, when) in used.items():
            assert later[limit] == pytest.approx((share, when + shift), rel=tolerance)


def recording(seed, count):
    """Return the poses of a smooth motion, sampled at 200 Hz."""
    rng, t = np.random.default_rng([53, seed]), np.arange(count) / 200
    waves = rng.normal(size=(3, 6)) * [[0.3], [0.2], [0.05]]
    phases = np.multiply.outer(t, [0.7, 1.9, 4.6])[..., None] + rng.uniform(0, 6, (3, 6))
    return t, rb.pose_from_coordinates(np.sum(waves * np.sin(phases), axis=1))


@pytest.mark.parametrize("seed", range(2))
def test_a_pause_of_a_recording_takes_no_time(seed):
    """Repeat the first, the last and an inner pose; the body has to stop at the inner pose."""
    t, poses = recording(seed, 60)
    stop = 20 + 20 * seed
    times = np.arange(60 + 100) / 200
    paused = np.concatenate([poses[[0] * 30], poses[: stop + 1], poses[[stop] * 20]])
    paused = np.concatenate([paused, poses[stop + 1 :], poses[[-1] * 50]])
    still = np.flatnonzero((paused[1:] == paused[:-1]).all(axis=(1, 2)))
    pausing = spline(times, paused, rest_at=np.union1d(still, still + 1))
    T = rb.fastest(spline(t, poses, rest_at=[stop]), **NORMS).domain[1]
    timed = rb.fastest(pausing, **NORMS)
    assert timed.domain[1] == pytest.approx(T, rel=1e-9)
    there = timed.times[np.searchsorted(timed.s, pausing.times)]
    assert np.abs(timed(there) - paused).max() < 1e-12
    both = [spline(t[part], poses[part]) for part in (slice(stop + 1), slice(stop, None))]
    apart = sum(rb.fastest(c, **NORMS).domain[1] for c in both)
    assert apart == pytest.approx(T, rel=5e-3)  # the leg next to a stop has other velocities


def test_the_times_of_legs_between_stops_do_not_matter():
    """After a rest, the motion may continue at another s', because the velocity is 0."""
    poses = rb.pose_from_coordinates(np.random.default_rng(9).uniform(-1, 1, (3, 6)))
    T = [
        rb.fastest(spline([0, 1, 1 + h], poses, rest_at=[1]), **NORMS).domain[1]
        for h in (1, 30, 1e-3)
    ]
    assert T[1:] == pytest.approx([T[0]] * 2, rel=1e-12)


def test_a_recording_needs_little_memory():
    t, poses = recording(0, 1000)
    path = spline(t, poses)
    tracemalloc.start()
    timed = rb.fastest(path, **NORMS)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 1000 * 20e3
    assert len(timed.s) < 6 * 1000
    with mock.patch.object(_cells, "_check_memory", wraps=_cells._check_memory) as checked:
        rb.fastest(path, acceleration=1, angular_acceleration=1)
    assert checked.call_args.args[0] == pytest.approx(4 * 1000, rel=0.1)
    with pytest.raises(MemoryError, match="divide the path"):
        _cells._check_memory(10**13)


def test_a_long_calculation_shows_its_progress(capsys, monkeypatch):
    clock = iter(range(0, 10**6, 7))
    monkeypatch.setattr(_cells.reported.__globals__["time"], "monotonic", lambda: next(clock))
    list(_cells.reported("work", range(3)))
    assert capsys.readouterr().err == "work: 33%\nwork: 67%\n"
    monkeypatch.setattr(_cells, "reported", lambda work, parts: print(work) or parts)
    rb.fastest(rb.geodesic(np.eye(3), rb.exp_so3([0, 0, 1])), angular_acceleration=1)
    wanted = [f"fastest, grid 1 of at most 4, pass {i} of 2" for i in (1, 2)]
    assert capsys.readouterr().out.splitlines()[:2] == wanted


def test_a_short_peak_of_a_limit_is_found():
    """One of 20,001 times is in a leg that takes a ten-thousandth of the duration."""
    turns = np.array([0, 0.1, 0.2, 0.3])
    times = [0, 1, 1 + 1e-4, 2]
    c = rb.chain(times, rb.exp_so3(turns[:, None] * [0, 0, 1]), np.zeros((4, 3)))
    (share, when) = rb.limits_used(c, angular_speed=1)["angular_speed"]
    assert share == pytest.approx(c(1 + 5e-5, 1)[2])
    assert when == pytest.approx(1 + 5e-5, abs=1e-6)


@pytest.mark.parametrize("legs", [10, 100])
def test_many_stops_cost_what_the_formula_says(legs):
    """A chain of geodesics stops at each pose; at a low speed, it accelerates in a small cell."""
    turns = 0.5 * np.eye(3)[np.arange(legs) % 3]
    R = [np.eye(3)]
    for turn in turns:
        R.append(R[-1] @ rb.exp_so3(turn))
    c = rb.chain(np.arange(legs + 1), R, leg=rb.geodesic)
    for speed in (0.05, 0.2, 1):
        timed = rb.fastest(c, angular_speed=speed, angular_acceleration=2)
        assert timed.domain[1] == pytest.approx(legs * trapezoid(0.5, speed, 2), rel=2e-3)


@pytest.mark.parametrize("size", [3, 4])
def test_a_timed_curve_has_exact_derivatives(size):
    c = random_chain(5)
    if size == 3:
        c = spline(c.times, c(c.times)[:, :3, :3])
    limits = {k: NORMS[k] for k in NORMS if size == 4 or k.startswith("angular")}
    timed = rb.fastest(c, **limits)
    there = timed.times[np.searchsorted(timed.s, c.times)]
    assert np.abs(timed(there) - c(c.times)).max() < 1e-14
    assert timed.progress(timed.domain)[0] == pytest.approx(c.domain)
    t = (timed.times[1:-1:50] + timed.times[2::50])[3:-3] / 2  # these times are inside cells
    for order in range(2, 4 if size == 3 else 2):
        slope = oracles.derivative_by_differences(lambda t, k=order: timed(t, k - 1), t, 1e-4)
        np.testing.assert_allclose(timed(t, order)[:, :3], slope[:, :3], atol=1e-7)
    rate = oracles.derivative_by_differences(lambda t: timed(t)[:, :3, 3:], t, 1e-4)
    if size == 4:
        v = (timed(t)[:, :3, :3].mT @ rate)[..., 0]
        np.testing.assert_allclose(timed(t, 1)[:, 3:], v, atol=1e-9)
        slow = timed.retimed(3 * timed.domain[1])
        np.testing.assert_allclose(slow(3 * t, 2), timed(t, 2) / 9, rtol=1e-9, atol=1e-12)
        assert rb.fastest(slow, **limits).domain == timed.domain
    before, after = (timed(x, 1) for x in (np.nextafter(timed.times[1:-1], 0), timed.times[1:-1]))
    assert np.abs(after - before).max() < 1e-12
    with pytest.raises(RuntimeError, match="is not computed"):
        rb.acceleration_cost(timed)


def test_the_first_time_at_a_limit_is_returned():
    used = rb.limits_used(rb.fastest(rb.geodesic(I4, LINE), **MOVING), **MOVING)
    assert used["speed"] == pytest.approx((1, 0.5), abs=5e-3)


def test_limits_hold_in_the_cells_next_to_a_rest():
    """In the cells next to a rest, speeds and accelerations are polynomials."""
    line, bent = moved(1, 2, 2), rb.pose_from_coordinates([0.5, 0.3, 1, 1, 0.5, 0.2])
    slow = rb.fastest(spline([0, 1], [I4, line]), speed=1e-3, acceleration=10)
    still, weight = rb.projected_quintic(I4, bent), {"gravity": (0, 0, -9.81), "body": rb.Body(G)}
    held = rb.fastest(still, force=12, acceleration=3, **weight)
    further = rb.pose_from_coordinates([0.5, 0.3, 1, 2, 0, 0])
    still = rb.projected_quintic(I4, further)
    free = rb.fastest(still, acceleration=3, angular_acceleration=3)
    for timed, order, most in ((slow, 1, 1e-3), (held, 2, 3), (free, 2, 3)):
        t = np.geomspace(1e-8, 0.5, 10_001) * timed.domain[1]
        for moments in (t, timed.domain[1] - t):
            sizes = np.linalg.norm(timed(moments, order)[:, 3:], axis=1)
            assert sizes.max() < most * (1 + 1e-4)


def test_a_uniform_motion_at_its_limits_is_not_changed():
    leg = rb.geodesic(I4, rb.pose_from_coordinates([0.5, 0.3, 1, 1, 0.5, 0.2]))
    w, v = np.linalg.norm(leg(0, 1).reshape(2, 3), axis=1)
    timed = rb.fastest(leg, angular_speed=w, speed=v, acceleration=1, rates=(1, 1))
    assert timed.domain[1] == pytest.approx(1, rel=1e-9)


UP = rb.geodesic(I4, moved(0, 0, 2))
REFUSED = [
    (about(TURN), {}, "limits: none of angular_speed, "),
    (about(TURN), {"angular_speed": 1}, "limits: one of angular_acceleration, "),
    (about(TURN).moved(right=rb.exp_so3(TURN)), {"torque": 1}, "^body: it is required for a limit"),
    (about(TURN), {"torque": 1, "body": G}, "^body: a Body is wanted"),
    (about(TURN), {"torque": 1, "body": rb.Body([G, G])}, r"^body.inertia: shape \(3, 3\) is"),
    (about(TURN), {"torque": -1, "body": rb.Body(G)}, "torque: one or three numbers above 0"),
    (about(TURN), {"angular_acceleration": [1, 2]}, "angular_acceleration: one or three numbers"),
    (about(TURN), {"acceleration": 1}, "acceleration: a curve on SO.3. has no such limit"),
    (about(TURN), SPINNING | {"rates": (-1, 0)}, "rates: two numbers from 0 up"),
    (about(TURN), SPINNING | {"rates": (2, 0)}, "rates.0. is too high to brake, or above"),
    (about(TURN), SPINNING | {"rates": (0, 2)}, "rates.1. is out of reach"),
    (about(TURN), {"angular_acceleration": 2, "rates": (0, 5)}, "rates.0. is too low for rates.1."),
    (UP, {"angular_acceleration": 1}, "none of them bounds the speed near s = "),
    (
        spline([1.7e9, 1.7e9 + 1], [I4, moved(0, 0, 2)]),
        {"force": 9, "gravity": (0, 0, -9.81), "body": rb.Body(G)},
        "force: 1.09 times the limit is needed to hold the body near s = 0$",
    ),
    (rb.geodesic(LINE, LINE), MOVING, "curve: the path stands still"),
    (rb.geodesic(np.eye(3), CORNERS), SPINNING, "curve: a single curve, not a stack, is wanted"),
    (np.sin, SPINNING, "curve: a Curve is wanted, got ufunc"),
]


@pytest.mark.parametrize(("curve", "limits", "message"), REFUSED)
def test_bad_limits_and_paths_are_refused(curve, limits, message):
    with pytest.raises(ValueError, match=message):
        rb.fastest(curve, **limits)


def test_an_unknown_limit_is_refused():
    with pytest.raises(TypeError, match="jerk: no limit has this name"):
        rb.limits_used(UP, jerk=1)


def test_a_limit_that_is_exceeded_between_the_points_gives_a_warning(monkeypatch):
    monkeypatch.setattr(_cells, "REFINEMENTS", 0)
    c = random_chain(0)
    steps = np.diff(c.times) * [1, 1e-3, *np.ones(len(c.times) - 3)]  # the path runs off and back
    uneven = spline(np.append(0, np.cumsum(steps)), c(c.times))
    with pytest.warns(RuntimeWarning, match="a limit is exceeded by .* near s = ") as told:
        timed = rb.fastest(uneven, **NORMS)
    place = float(str(told[0].message).split()[-1])
    i = np.argmin(np.abs(timed.s - place))
    t = np.linspace(timed.times[i], timed.times[i + 1], 101)
    assert np.linalg.norm(timed(t, 1)[:, :3], axis=1).max() > 1.5 * (1 + 1e-4)


@pytest.mark.parametrize(("angle", "stops"), [(2.0, 0), (2.0001, 1)])
def test_the_motion_stops_where_the_velocity_jumps_a_little(angle, stops):
    path = rb.chain([0, 1, 2], rb.exp_so3([[0, 0, 0], [0, 0, 1], [0, 0, angle]]), leg=rb.geodesic)
    quick = rb.fastest(path, angular_speed=10, angular_acceleration=1)
    inside = (quick.s > 0.5) & (quick.s < 1.5)
    assert np.any(quick.rate[inside] == 0) == stops
