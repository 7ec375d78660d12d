"""Test splines through many rotations and poses, in closed form and optimal."""

from dataclasses import replace
from functools import partial
from itertools import accumulate

import numpy as np
import oracles
import pytest
from optima import BOOK, deviation
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation, RotationSpline

import rbcourse as rb
from rbcourse import textbook
from rbcourse.optimum import many_poses
from rbcourse.optimum._spline import BEND

EPS, BODY = np.finfo(float).eps, rb.Body(BOOK)
AXIS = np.array([2.0, -1, 2]) / 3
NATURAL = {
    "projected": rb.projected_spline,
    "quaternion": rb.quaternion_spline,
    "optimum": rb.minimum_acceleration_spline,
    "weighted": partial(rb.projected_spline, body=BODY),
    "of a body": partial(rb.minimum_acceleration_spline, body=BODY),
    "torque": partial(rb.minimum_torque_spline, body=BODY),
    "jerk": rb.minimum_jerk_spline,
}
INVARIANT = ["projected", "quaternion", "optimum", "jerk"]
RATES = {"weighted": "torque", "of a body": "torque", "torque": "torque", "jerk": "jerk"}
every_spline = pytest.mark.parametrize("name", NATURAL)


def path(count, degrees, seed, ratio=3.0):
    """Return times and rotations; each leg has a new axis, and durations differ by at most the
    factor `ratio`."""
    rng = np.random.default_rng([511, seed])
    axes = rng.normal(size=(count - 1, 3))
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    R = [oracles.exp_so3(rng.normal(size=3))]
    for axis in axes:
        R.append(R[-1] @ oracles.exp_so3(np.radians(degrees) * axis))
    h = ratio ** rng.uniform(-0.5, 0.5, count - 1)
    return rng.normal() + np.append(0, np.cumsum(h)), np.array(R)


def poses_of(R, seed=0):
    return rb.pose_from_components(R, np.random.default_rng(seed).normal(size=(len(R), 3)))


def rate(name, c, t):
    """Return the acceleration, torque or jerk that a spline keeps continuous, times a factor."""
    return deviation(RATES.get(name, "ball"), BOOK, *(c(t, order) for order in (1, 2, 3)))


def off(x, size):
    return np.abs(x).max() / np.abs(size).max()


@every_spline
@pytest.mark.parametrize("degrees", [10, 110])
@pytest.mark.parametrize("ends", ["natural", "periodic"])
def test_the_acceleration_of_a_spline_is_continuous(name, degrees, ends):
    """The acceleration is 0 at natural ends and equal at periodic ends. The same holds for the
    torque of bodies, and for j of least-jerk splines."""
    t, R = path(7, degrees, 1)
    c = NATURAL[name](t, R, ends)
    assert off(c(t) - R, 1) < 100 * EPS
    for order in range(1, 4 if name == "jerk" else 3):
        assert off(c.jumps(order), c(t, order)) < 1e-10
    first, last = t[[0, -1]]
    if ends == "natural":
        assert off(rate(name, c, t[[0, -1]]), rate(name, c, (t[1:] + t[:-1]) / 2)) < 1e-11
    else:
        assert off(c(first, 1) - c(last, 1), c(t, 1)) < 1e-12
        if name == "jerk":
            assert off(c(first, 2) - c(last, 2), c(t, 2)) < 1e-12
        assert off(rate(name, c, first) - rate(name, c, last), rate(name, c, t)) < 1e-10


@pytest.mark.source("beyond BK 13")
def test_a_wide_leg_of_a_projected_spline_is_reported():
    """From rest to rest, a leg of 120° costs 2.6 times as much as the optimum."""
    turns = rb.exp_so3(np.radians([[0, 0, 0], [0, 0, 119], [0, 0, 240]]))
    rb.projected_spline([0, 1], turns[:2])
    with pytest.warns(RuntimeWarning, match=r"poses\[1\] and poses\[2\]: .* 121°") as warned:
        rb.projected_spline([0, 1, 2], turns)
    assert warned[0].filename == __file__
    ratio = rb.acceleration_cost(rb.projected_cubic(np.eye(3), rb.exp_so3([0, 0, 2 * np.pi / 3])))
    assert ratio / (24 * (2 * np.pi / 3) ** 2) == pytest.approx(2.57, abs=0.01)


def test_velocities_of_projected_splines_agree_with_the_textbook():
    t, R = path(9, 100, 2)
    assert off(rb.spline_velocities(t, R) - textbook.spline_velocities(t, R), 1) < 100 * EPS
    poses = poses_of(R)
    for ends in ("natural", "periodic", ([0, 1, 2, 3, 4, 5], None)):
        c = rb.projected_spline(t, poses, ends)
        assert off(c.jumps(2), c(t, 2)) < 1e-13
        assert off(c(t, 1) - rb.spline_velocities(t, poses, ends), 1) < 1e-13
        if ends == "periodic":
            assert off(c(t[0], 2) - c(t[-1], 2), c(t, 2)) < 1e-13
        else:
            assert off(c(t[-1], 2), c(t, 2)) < 1e-13
    origin = CubicSpline(t, poses[:, :3, 3], bc_type="natural")
    c, s = rb.projected_spline(t, poses), np.linspace(t[0], t[-1], 40)
    assert off(c(s)[:, :3, 3] - origin(s), 1) < 1e-13


@every_spline
def test_a_moved_path_has_the_moved_spline(name):
    """With the inertia of a body, only the fixed frame is moved."""
    t, R = path(6, 80, 3)
    c, s = NATURAL[name](t, R), np.linspace(t[0], t[-1], 30)
    L, Q = (oracles.exp_so3(x) for x in np.random.default_rng(4).normal(size=(2, 3)))
    assert off(NATURAL[name](t, L @ R)(s) - L @ c(s), 1) < 1e-12
    if name in INVARIANT:
        assert off(NATURAL[name](t, R @ Q)(s) - c(s) @ Q, 1) < 1e-12
    assert off(NATURAL[name](-t[::-1], R[::-1])(-s) - c(s), 1) < 1e-12
    for scale in (1e-60, 1e-6, 1e6, 1e60):
        quick = NATURAL[name](scale * t, R)
        assert off(quick.jumps(1), quick(scale * t, 1)) < 1e-10
        assert off(quick(np.clip(scale * s, *quick.domain)) - c(s), 1) < 1e-9


@pytest.mark.source("beyond BK 14")
@pytest.mark.parametrize("name", ["projected", "quaternion"])
def test_the_excess_of_a_spline_that_turns_back_has_the_exact_constant(name):
    """The angle about one axis is 0, θ, 0 at the times 0, 1, 2. docs/near_optimal.py derives the
    constant, and test_excess.py checks it."""
    constant = 20711 / 180180 / (16 if name == "quaternion" else 1)
    found = []
    for size in (0.2, 0.1):
        R = rb.exp_so3(np.outer([0, size, 0], AXIS))
        best = rb.minimum_acceleration_spline([0, 1, 2], R).cost
        cost = rb.acceleration_cost(NATURAL[name]([0, 1, 2], R), rtol=1e-12)
        found.append((cost / best - 1) / size**4)
    assert (4 * found[1] - found[0]) / 3 == pytest.approx(constant, rel=1e-3)


@pytest.mark.parametrize("ends", ["natural", "periodic", "given"])
@pytest.mark.parametrize("size", [1.0, 2.3])
def test_the_optimum_about_one_axis_is_the_cubic_spline_of_the_angle(ends, size):
    rng = np.random.default_rng(5)
    t, steps = np.cumsum(rng.uniform(0.5, 1.5, 9)), size * rng.uniform(-1, 1, 8)
    angle, rates, kind = np.append(0, np.cumsum(steps - steps.mean())), [1.3, -0.4], ends
    if ends == "periodic":
        angle[-1] = angle[0]
    elif ends == "given":
        kind, ends = [(1, rate) for rate in rates], [rate * AXIS for rate in rates]
    want, s = CubicSpline(t, angle, bc_type=kind), np.linspace(t[0], t[-1], 60)
    c = rb.minimum_acceleration_spline(t, rb.exp_so3(np.outer(angle, AXIS)), ends)
    assert off(c(s) - rb.exp_so3(np.outer(want(s), AXIS)), 1) < 1e-11
    for order in (1, 2):
        assert off(c(s, order) - np.outer(want(s, order), AXIS), want(s, order)) < 1e-11
    assert c.certified


def test_the_optimal_spline_through_samples_of_an_optimum_equals_this_optimum():
    """Passing through the inner samples does not change the optimum."""
    _, (R0, R1) = path(2, 100, 6)
    w0, w1 = 2 * np.random.default_rng(7).normal(size=(2, 3))
    one = rb.minimum_acceleration(R0, R1, w0, w1)
    t, s = np.array([0, 0.1, 0.35, 0.4, 0.8, 1]), np.linspace(0, 1, 30)
    for times in (t[[0, -1]], t):
        c = rb.minimum_acceleration_spline(times, one(times), (w0, w1))
        assert off(c(s) - one(s), 1) < 1e-11
        assert c.cost == pytest.approx(one.cost, rel=1e-11)
        assert off(c.c - one.c, one.c) < 1e-9
    natural = rb.minimum_acceleration_spline([0, 1], [R0, R1])
    assert off(natural(s) - rb.geodesic(R0, R1)(s), 1) < 1e-13
    c = rb.minimum_torque_spline([0, 1], [R0, R1], (w0, w1), body=BODY)
    torque, a = rb.minimum_torque(R0, R1, w0, w1, body=BODY), np.zeros(3)
    assert c.cost == pytest.approx(torque.cost, rel=1e-10)
    ends = np.append(w0, a), np.append(w1, a)
    c = rb.minimum_jerk_spline([0, 1], [R0, R1], ends)
    assert c.cost == pytest.approx(rb.minimum_jerk(R0, R1, w0, w1, a, a).cost, rel=1e-10)


@pytest.mark.source("beyond BK 12")
def test_the_optimum_agrees_with_the_textbook():
    t, R = path(3, 30, 8)
    for ends in (None, np.random.default_rng(3).normal(size=(2, 3))):
        w, a = textbook.minimum_acceleration_spline(t, R, ends)
        c = rb.minimum_acceleration_spline(t, R, "natural" if ends is None else ends)
        assert off(c.velocities - w, w) < 1e-9
        assert off(c(t, 2) - a, a) < 1e-7


@pytest.mark.parametrize(("degrees", "ratio"), [(30, 10), (60, 2), (90, 10), (120, 2)])
def test_no_other_spline_costs_less_than_the_optimum(degrees, ratio):
    """All splines have the same ends. A chain whose velocities come from parabolas costs a tenth to
    a third more than the optimum."""
    chains = []
    for seed in range(6):
        t, R = path(10, degrees, [10, seed], ratio)
        spline = RotationSpline(t - t[0], Rotation.from_matrix(R))
        ends = spline([0, t[-1] - t[0]], 1)
        c = rb.minimum_acceleration_spline(t, R, ends)
        assert c.definite
        w = rb.bessel_velocities(t, R)
        w[[0, -1]] = ends
        others = [rb.chain(t, R, w)]
        others += [make(t, R, ends) for make in (rb.projected_spline, rb.quaternion_spline)]
        costs = [rb.acceleration_cost(one) / c.cost for one in others]
        nodes, weights = np.polynomial.legendre.leggauss(12)
        h = np.diff(t) / 2
        s = ((t[1:] + t[:-1]) / 2 - t[0])[:, None] + h[:, None] * nodes
        squares = np.sum(spline(s.ravel(), 2) ** 2, axis=1).reshape(s.shape)
        costs.append(2 * np.sum(h[:, None] * weights * squares) / c.cost)
        assert min(costs) > 1 - 1e-9
        chains.append(costs[0])
    assert np.median(chains) > 1.05


@pytest.mark.parametrize("seed", [3, 9])
@pytest.mark.parametrize("ends", ["natural", "periodic"])
def test_splines_of_large_turns_at_uneven_times_are_found(ends, seed):
    """In these problems, plain Newton's method meets systems that are not positive definite."""
    t, R = path(10, 120, [10, seed], ratio=10)
    for name in ("optimum", "torque"):
        c = NATURAL[name](t, R, ends)
        assert c.definite
        s = t[1:-1]
        before = rate(name, c, np.nextafter(s, -9))
        assert off(rate(name, c, s) - before, before) < 1e-9


def test_optimal_splines_keep_the_chosen_long_way_round():
    t, R = path(5, 70, 11)
    way = [False, True, False, False]
    c = rb.minimum_acceleration_spline(t, R, long=way)
    s = np.linspace(0, 1, 200)[:, None] * c.legs.duration
    R_legs = c.legs.at_own_times(s)
    turned = rb.angle_between(R_legs[1:], R_legs[:-1]).sum(axis=0)
    assert np.array_equal(turned > np.pi, way)
    assert rb.acceleration_cost(c) == pytest.approx(c.cost, rel=1e-9)
    for name, cost in (("torque", rb.torque_cost), ("of a body", rb.acceleration_cost)):
        c = NATURAL[name](t, R)
        assert cost(c) == pytest.approx(c.cost, rel=1e-9)
    c = NATURAL["jerk"](t, R)
    assert rb.jerk_cost(c) == pytest.approx(c.cost, rel=1e-9)
    twice = c.retimed(2 * (t[-1] - t[0]))
    assert twice.cost == pytest.approx(c.cost / 32, rel=1e-12)


@pytest.mark.parametrize("ends", ["natural", "periodic", "given"])
def test_the_rotation_of_a_body_is_optimal_on_se3(ends):
    t, R = path(5, 60, 12)
    poses, centre = poses_of(R, 13), np.array([0.3, -0.2, 0.1])
    twist = np.random.default_rng(14).normal(size=(2, 6))
    given = twist if ends == "given" else ends
    body = rb.Body(BOOK, 2.5, centre)
    c = rb.minimum_acceleration_spline(t, poses, given, body=body)
    turning = twist[:, :3] if ends == "given" else ends
    rotation = rb.minimum_acceleration_spline(t, R, turning, body=BODY)
    s = np.linspace(t[0], t[-1], 50)
    assert off(c(s)[:, :3, :3] - rotation(s), 1) < 1e-12
    assert off(c.jumps(2), c(t, 2)) < 1e-9
    assert rb.acceleration_cost(c) == pytest.approx(c.cost, rel=1e-9)
    at_ends = c(t[[0, -1]], 1)
    if ends == "given":
        assert off(at_ends - twist, 1) < 1e-12
    elif ends == "periodic":
        assert off(at_ends[0] - at_ends[1], at_ends) < 1e-12
    else:
        place = poses[:, :3, 3] + R @ centre
        want = CubicSpline(t, place, bc_type="natural")
        assert off(c(s)[:, :3, 3] + c(s)[:, :3, :3] @ centre - want(s), 1) < 1e-12


@pytest.mark.source("beyond BK 15")
def test_the_certificate_needs_a_definite_system_and_legs_that_are_minima():
    t, R = path(6, 110, 15)
    for what in ("optimum", "torque", "jerk"):
        c = NATURAL[what](t, R)
        assert c.certified == c.definite == c.optimum.positive.all()
        assert not replace(c, definite=False).certified
    fast = rb.minimum_acceleration_spline([0, 1], R[:2], (30 * AXIS, [0, 25, 0]))
    assert np.linalg.norm(fast.c) > 2 * np.pi**3
    assert fast.certified


OF_BODIES = (rb.minimum_acceleration_spline, 1), (rb.minimum_torque_spline, 2)


@pytest.mark.parametrize("axis", [[0, 0, 1.0], BEND])
@pytest.mark.parametrize("degrees", [120, 150])
@pytest.mark.parametrize(("make", "power"), OF_BODIES)
def test_a_body_leaves_the_axis_of_its_poses_if_this_costs_less(make, power, degrees, axis):
    """The motion turns forwards and then back about axis 3 of the book, from rest to rest. The
    cubics about this axis are stationary. The axis may be that of the first bend."""
    n, angle = axis / np.linalg.norm(axis), np.radians(degrees)
    Q = Rotation.align_vectors([[0, 0, 1.0]], [n])[0].as_matrix()  # Q n is axis 3
    R = rb.exp_so3(np.outer([0, angle, 0], n))
    c = make([0, 1, 2], R, "rest", body=rb.Body(Q.T @ BOOK @ Q))
    assert c.definite
    assert c.certified
    assert c.cost < 0.9999 * 2 * 12 * angle**2 * BOOK[2, 2] ** power


@pytest.mark.parametrize("seed", [0, 1])
def test_legs_of_a_rod_cannot_be_replaced_by_cheaper_ones(seed, monkeypatch):
    """Newton's method alone finds splines with legs that cost 13 and 15 % more than others."""
    rng, rod = np.random.default_rng([seed, 3]), rb.Body(np.diag([1, 1, 0.05]))
    turns = rb.exp_so3(rng.choice([0.5, 1, 1.5]) * rng.normal(size=(5, 3)))
    R = np.array([*accumulate(turns, np.matmul, initial=np.eye(3))])
    times = np.cumsum(rng.uniform(0.5, 1.5, 6))
    c = rb.optimum.minimum_torque_spline(times, R, body=rod)
    V, h = c(times, 1), np.diff(times)
    legs = rb.minimum_torque(R[:-1], R[1:], V[:-1], V[1:], body=rod, duration=h)
    assert c.converged
    assert legs.cost == pytest.approx(c.legs.cost, rel=1e-6)
    monkeypatch.setattr(many_poses, "ROUNDS", 1)
    with pytest.warns(RuntimeWarning, match="another leg between two of its poses costs less"):
        less = rb.optimum.minimum_torque_spline(times, R, body=rod)
    assert not less.converged
    assert less.cost > (1 - 1e-9) * c.cost


def test_a_family_of_equally_cheap_curves_is_not_definite():
    """For a plate, each curve that leaves its axis can be turned about this axis at the same
    cost."""
    plate = rb.Body(np.diag([1, 1, 1.9]))
    R = rb.exp_so3([[0, 0, 0], [0, 0, 2.0], [0, 0, 0]])
    c = rb.minimum_torque_spline([0, 1, 2], R, "rest", body=plate)
    assert c.cost < 0.99 * 2 * 12 * 4 * 1.9**2
    assert not c.definite


def test_a_saddle_is_not_returned_as_a_minimum():
    """A ball takes the long way there and back. The stationary curve about one axis is a saddle."""
    R = rb.exp_so3([[0, 0, 0], [0, 0, 1.0], [0, 0, 0]])
    with pytest.raises(rb.optimum.ConvergenceError, match=r"only a saddle was found$"):
        rb.minimum_acceleration_spline([0, 1, 2], R, long=True)


@pytest.mark.parametrize("name", ["projected", "quaternion", "optimum"])
def test_bad_ends_are_refused(name):
    wanted = "ends: 'natural', 'rest', 'periodic' or a pair of velocities is wanted"
    for ends, message in (
        ("nature", f"{wanted}, got 'nature'"),
        ([[0, 0, 0]], wanted),
        (np.zeros(()), wanted),
        (np.zeros((3, 3)), wanted),
        (([0, 0], None), r"ends\[0\]: shape \(3,\) is wanted"),
        (([0, 0, np.nan], None), "ends"),
    ):
        with pytest.raises(ValueError, match=f"^{message}"):
            NATURAL[name](*path(3, 50, 16), ends)


@pytest.mark.parametrize("long", [[True], 1, ["yes", "no"]])
def test_bad_choices_of_the_long_way_are_refused(long):
    with pytest.raises(ValueError, match=r"^long: a bool for each of 2 legs is wanted, got"):
        rb.minimum_acceleration_spline(*path(3, 50, 16), long=long)


def test_a_failure_names_the_times():
    R = rb.sample_rotation(4, rng=1)
    with pytest.raises(rb.optimum.ConvergenceError, match="the times between them too different"):
        rb.minimum_acceleration_spline([0, 1e-3, 1, 90], R)


@every_spline
def test_nearly_equal_times_are_refused(name):
    t = 0.1 * np.arange(40)
    t[20] = t[19] + 9e-7
    R = rb.exp_so3(np.stack([np.sin(t), np.cos(t), t], axis=1))
    with pytest.raises(ValueError, match=r"^times\[19\] and times\[20\] are 9e-07 apart"):
        NATURAL[name](t, R)
    t[20] = t[19] + 1e-3
    assert np.abs(NATURAL[name](t, R).jumps(2)).max() < 1e-6


@pytest.mark.parametrize("size", [0, 1e-13, 1e-7, 1e-3])
@every_spline
def test_a_spline_of_tiny_turns_is_the_cubic_spline_of_rotation_vectors(name, size):
    """A gripper that keeps its orientation has the size 0; the legs have different durations."""
    rng = np.random.default_rng(7)
    for count, spread in ((3, 0.3), (4, 1.5), (8, 0.3)):
        t = np.cumsum(10 ** rng.uniform(-spread, spread, count))
        x = size * rng.normal(size=(count, 3))
        R = rb.sample_rotation(rng=rng) @ rb.exp_so3(x)
        for ends, kind in (("rest", "clamped"), ("natural", "natural")):
            c = NATURAL[name](t, R, ends)
            assert getattr(c, "certified", True)
            if name != "jerk":
                w = CubicSpline(t, x, bc_type=kind)(t, 1)
                assert np.abs(c.velocities - w).max() <= 20 * size**2 + 1e-11
