"""The other closed forms: of BK 1 against their definitions in 60 digits, and of real bodies."""

from functools import cache
from itertools import pairwise

import awkward
import mpmath as mp
import numpy as np
import oracles
import pytest
from numpy.polynomial import Polynomial
from scipy.optimize import fsolve
from scipy.spatial.transform import Rotation

import rbcourse as rb
from rbcourse._hermite import hermite
from rbcourse._quaternion_curve import other_way
from rbcourse.curves import Ends

EPS = np.finfo(float).eps
MAKERS = {
    "exponential": rb.exponential_cubic_so3,
    "bezier": rb.bezier_so3,
    "cumulative": rb.cumulative_bezier_so3,
    "quaternion": rb.quaternion_cubic_so3,
    "cayley": rb.cayley_cubic_so3,
}
I3, REST = np.eye(3), np.zeros(3)
every_curve = pytest.mark.parametrize("name", MAKERS)
STEP = mp.mpf(10) ** -15


def directions(count, rng):
    axes = rng.normal(size=(count, 3))
    return axes / np.linalg.norm(axes, axis=1, keepdims=True)


def ends(count, angle=None, size=None):
    """R0, R1, w0, w1: turns by an angle, or any; velocities of a size, or up to 9."""
    rng = np.random.default_rng(count)
    R0, R1 = (Rotation.random(count, rng=rng).as_matrix() for _ in range(2))
    if angle is not None:
        R1 = R0 @ Rotation.from_rotvec(angle * directions(count, rng)).as_matrix()
    sizes = rng.uniform(0, 9, (2, count, 1)) if size is None else (size, size)
    return R0, R1, sizes[0] * directions(count, rng), sizes[1] * directions(count, rng)


def exact_log(R):
    """The rotation vector of an mpmath rotation, no half-turn."""
    sine = [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]
    length = oracles.exact_norm(sine)
    share = mp.atan2(length, R[0, 0] + R[1, 1] + R[2, 2] - 1) / (length or 1)
    return [share * x for x in sine]


def exact_quaternion(R):
    q = [1 + R[0, 0] + R[1, 1] + R[2, 2]]
    q += [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]
    return [x / oracles.exact_norm(q) for x in q]


def turned_by(q):
    """The matrix of p ↦ q p q⁻¹, q an mpmath quaternion of any norm."""
    w, v = q[0], mp.matrix(q[1:])
    square = mp.fsum(x * x for x in v)
    R = (w * w - square) * mp.eye(3) + 2 * v * v.T + 2 * w * oracles.exact_hat(q[1:])
    return R / (w * w + square)


def cayley_parameters(R):
    w, *v = exact_quaternion(R)
    return [x / w for x in v]


def cayley_map(g):
    W = oracles.exact_hat(g)
    return (mp.eye(3) + W) * (mp.eye(3) - W) ** -1


def along(w, share):
    return oracles.exact_exp([share * x for x in w])


def in_coordinates(coordinates, point):
    """The cubic in coordinates, whose rates at the ends are those of the turning body."""

    def curve(turn, w0, w1):
        values, rates = [], []
        for R, w in ((mp.eye(3), w0), (turn, w1)):
            before, after = (coordinates(R * along(w, h)) for h in (-STEP, STEP))
            values.append(coordinates(R))
            rates.append([(b - a) / (2 * STEP) for a, b in zip(before, after, strict=True)])

        def at(t):
            weights = (1 - t) ** 2 * (1 + 2 * t), t**2 * (3 - 2 * t), t * (1 - t) ** 2, t**3 - t**2
            columns = zip(*values, *rates, strict=True)
            return point([mp.fdot(weights, column) for column in columns])

        return at

    return curve


def exact_middle_leg(turn, w0, w1):
    return exact_log(along(w0, mp.mpf(-1) / 3) * turn * along(w1, mp.mpf(-1) / 3))


def by_de_casteljau(turn, w0, w1):
    inner = along(w0, mp.mpf(1) / 3), turn * along(w1, mp.mpf(-1) / 3)

    def at(t):
        points = [mp.eye(3), *inner, turn]
        while len(points) > 1:
            points = [a * along(exact_log(a.T * b), t) for a, b in pairwise(points)]
        return points[0]

    return at


def by_three_factors(turn, w0, w1):
    middle = exact_middle_leg(turn, w0, w1)
    return lambda t: (
        along(w0, (1 - (1 - t) ** 3) / 3) * along(middle, 3 * t**2 - 2 * t**3) * along(w1, t**3 / 3)
    )


DEFINITIONS = {
    "exponential": in_coordinates(exact_log, oracles.exact_exp),
    "bezier": by_de_casteljau,
    "cumulative": by_three_factors,
    "quaternion": in_coordinates(exact_quaternion, turned_by),
    "cayley": in_coordinates(cayley_parameters, cayley_map),
}


def exact_jet(curve, t):
    """R, w and w' by differences: Rᵀ R'' = ŵ' + ŵ², of which the second is symmetric."""
    before, R, after = (curve(t + k * STEP) for k in (-1, 0, 1))
    rates = (after - before) / (2 * STEP), (after - 2 * R + before) / STEP**2
    turned = [R.T * rate for rate in rates]
    vectors = [[W[2, 1] - W[1, 2], W[0, 2] - W[2, 0], W[1, 0] - W[0, 1]] for W in turned]
    return np.array(R.tolist(), dtype=float), *(np.array(v, dtype=float) / 2 for v in vectors)


def unit_cases():
    """Turn, w0 and w1, from R0 on."""
    rng = np.random.default_rng(11)
    n, m = directions(2, rng)
    w0, w1, turn = np.array([2.0, -1, 3]), np.array([1.0, 4, -2]), np.array([0.3, -0.4, 1.2])
    inner = [w0 / 3, (np.pi - 1e-3) * n, w1 / 3]
    product = np.linalg.multi_dot([oracles.exp_so3(leg) for leg in inner])
    return {
        "at rest": (turn, REST, REST),
        "nothing": (REST, REST, REST),
        "no turn": (REST, w0, w1),
        "one axis": (turn, 2 * turn, -turn),
        "a tiny turn": (1e-6 * n, REST, REST),
        "a tiny turn, fast": (1e-6 * n, w0, w1),
        "a tiny turn, slow": (1e-6 * n, 1e-6 * w0, 1e-6 * w1),
        "near a half-turn": ((np.pi - 1e-3) * n, w0, w1),
        "nearer to a half-turn": ((np.pi - 1e-6) * n, w0, w1),
        "inner points near a half-turn": (oracles.log_so3(product), w0, w1),
        "fast": (2 * turn, 9 * n, 9 * m),
        "fastest": (-turn, 9.42 * m, 9.42 * n),
        **{f"random {k}": tuple(3 * rng.normal(size=(3, 3)) / [[3], [1], [1]]) for k in range(2)},
    }


CASES = unit_cases()
START = Rotation.random(rng=1).as_matrix()


@cache
def exactly(name, case):
    """The jet by definition, as a function of time, from I on."""
    with mp.workdps(oracles.DIGITS):
        turn, w0, w1 = ([mp.mpf(float(x)) for x in v] for v in CASES[case])
        curve = DEFINITIONS[name](oracles.exact_exp(turn), w0, w1)

    def at(t):
        with mp.workdps(oracles.DIGITS):
            return exact_jet(curve, mp.mpf(float(t)))

    return at


def made(name, case):
    turn, w0, w1 = CASES[case]
    return MAKERS[name](START, START @ oracles.exp_so3(turn), w0, w1)


def condition(name, angle):
    """Of Cayley's parameters, the secant of half the angle: what they lose near a half-turn."""
    return 1 / np.cos(angle / 2) if name == "cayley" else np.ones_like(angle)


@pytest.mark.source("BK 1")
@every_curve
@pytest.mark.parametrize("case", CASES)
def test_curve_and_derivatives_are_those_of_the_definition(name, case):
    curve, times = made(name, case), (0.13, 0.6, 1)
    R, *rates = (np.array(x) for x in zip(*map(exactly(name, case), times), strict=True))
    worse = condition(name, np.linalg.norm(CASES[case][0]))
    assert np.abs(curve(times) - START @ R).max() < 20 * EPS
    for order, rate in enumerate(rates, 1):
        scale = worse * np.abs(rate).max(initial=1)
        assert np.abs(curve(times, order) - rate).max() < 20 * EPS * scale


@every_curve
@pytest.mark.parametrize("size", [None, 0, 9, 100], ids=str)
def test_all_four_ends_are_met_wherever_the_curve_is_defined(name, size):
    size = min(size, 9.42) if size and name == "bezier" else size
    angles = [None, 0, 1e-9, 1e-3, 3, np.pi - 1e-3, np.pi - 1e-6, np.pi]
    for angle in angles[:-1] if name == "cayley" else angles:
        R0, R1, w0, w1 = ends(100, angle, size)
        curve = MAKERS[name](R0, R1, w0, w1)
        turns = Rotation.from_matrix(R0.mT @ R1).magnitude()
        bound = (20 * EPS * (1 + (size or 9)) * condition(name, turns))[:, None]
        assert np.abs(curve([0, 1]) - [R0, R1]).max() < 20 * EPS
        assert np.all(np.abs(curve([0, 1], 1) - [w0, w1]) < bound)


def test_near_half_turns_cayleys_end_velocity_is_met_too():
    R0, R1, w0, w1 = ends(20, np.pi - 1e-6, 9)
    assert np.abs(rb.cayley_cubic_so3(R0, R1, w0, w1)(1, 1) - w1).max() < 1e-12


@pytest.mark.parametrize("make", [rb.exponential_cubic_long_so3, rb.bezier_long_so3])
def test_the_long_way_round_is_what_is_left_of_a_full_turn(make):
    """About one axis, from rest to rest or at the constant speed 1 − 2π."""
    e, t = np.eye(3)[1], np.linspace(0, 1, 201)
    for w in [0 * e, (1 - 2 * np.pi) * e][: 2 if make is rb.exponential_cubic_long_so3 else 1]:
        speed = make(I3, rb.exp_so3(e), w, w)(t, 1)[:, 1]
        assert np.trapezoid(speed, t) == pytest.approx(1 - 2 * np.pi, abs=1e-3)
        assert not w.any() or speed == pytest.approx(np.full(201, 1 - 2 * np.pi))


def test_the_other_logarithm_gives_the_same_rotation():
    turn = Ends(*ends(50, 2.5)).turn
    other = other_way(rb.log_so3(turn))
    assert np.abs(np.linalg.norm(other, axis=-1) - (2 * np.pi - 2.5)).max() < 20 * EPS
    assert np.abs(rb.exp_so3(other) - turn).max() < 40 * EPS
    assert np.array_equal(other_way(np.zeros((2, 3))), np.zeros((2, 3)))


def test_beziers_velocities_stay_below_3_pi():
    w = np.zeros((2, 3, 3))
    w[1, 2] = 3 * np.pi * np.array([2, 1, 2]) / 3
    for name, given in (("w0", (w, REST)), ("w1", (REST, w))):
        with pytest.raises(ValueError, match=rf"^{name}\[1, 2\]: a norm below 3π is wanted"):
            rb.bezier_so3(I3, I3, *given)
    below = w * (1 - 1e-12)
    curve = rb.bezier_so3(I3, I3, below, below)
    assert np.abs(curve([0, 1], 1) - below).max() < 100 * EPS


def test_half_turns_have_no_cayley_parameters():
    with pytest.raises(ValueError, match=r"^R0 and R1 of curve \[1\] are a half-turn apart"):
        rb.cayley_cubic_so3(I3, np.stack([I3, np.diag([-1.0, 1, -1])]), REST, REST)
    exact, _ = awkward.half_turns()
    rounded = zip(*awkward.rounded_half_turns(np.random.default_rng(12), 100), strict=True)
    for R0, R1, *_ in (*((I3, R) for R in exact), *rounded):
        with pytest.raises(ValueError, match=r"^R0 and R1 are a half-turn apart"):
            rb.cayley_cubic_so3(R0, R1, REST, REST)


@pytest.mark.parametrize("name", ["exponential", "bezier", "cumulative"])
def test_velocities_along_the_geodesic_give_a_cubic_along_it(name):
    """R0 exp(σ p(t)), p the cubic with those ends."""
    R0, R1, _, _ = ends(40)
    turn = Rotation.from_matrix(R0.mT @ R1).as_rotvec()
    rates = np.random.default_rng(5).uniform(0.1, 2, (2, 40))
    curve, t = MAKERS[name](R0, R1, *(rates[..., None] * turn)), np.linspace(0, 1, 11)
    p, v, a = (hermite([0, 1, *rates], t[:, None], k)[..., None] * turn for k in range(3))
    assert np.abs(curve(t) - R0 @ rb.exp_so3(p)).max() < 40 * EPS
    assert np.abs(curve(t, 1) - v).max() < 400 * EPS
    assert np.abs(curve(t, 2) - a).max() < 400 * EPS


@pytest.mark.parametrize("make", [rb.quaternion_cubic_so3, rb.cayley_cubic_so3])
def test_other_charts_leave_the_optimum_along_the_geodesic(make):
    t = np.linspace(0.1, 0.4, 4)
    speed = make(I3, rb.exp_so3([0, 0, 2.0]), REST, REST)(t, 1)[:, 2]
    assert np.all(np.abs(speed - 2 * hermite([0, 1, 0, 0], t, 1)) > 1e-3)


@every_curve
def test_backwards_in_time_two_are_the_same_and_three_are_not(name):
    R0, R1, w0, w1 = ends(40, 2.5)
    curve, back = MAKERS[name](R0, R1, w0, w1), MAKERS[name](R1, R0, -w1, -w0)
    t = np.linspace(0, 1, 11)
    if name not in ("bezier", "quaternion"):
        assert np.all(np.abs(curve(t) - back(1 - t)).max(axis=(0, 2, 3)) > 1e-3)
        return
    worse = 1 / np.minimum(getattr(curve, "margin", np.ones(40)), 1)
    for order, core in ((0, (3, 3)), (1, (3,)), (2, (3,))):
        want = (-1) ** order * curve(t, order)
        scale = np.abs(want).max(axis=(0, *range(-len(core), 0)), initial=1)
        off = np.abs(back(1 - t, order) - want).max(axis=(0, *range(-len(core), 0)))
        assert np.all(off < 400 * EPS * scale * worse)


def test_the_correction_of_fast_ends_is_reversible():
    """The logarithm is the one nearest to the sum of Bézier's legs: often not the shortest."""
    R0, R1, w0, w1 = ends(60, 2.5, 9)
    w1 = 0.7 * w1
    curve, back = (rb.corrected_bezier_so3(*x) for x in ((R0, R1, w0, w1), (R1, R0, -w1, -w0)))
    t = np.linspace(0, 1, 11)
    assert np.abs(back(1 - t) - curve(t)).max() < 1e-9


def test_no_leg_of_de_casteljaus_construction_is_longer_than_the_longest_before():
    """Also of velocities just below 3π, whose legs are all but half-turns."""
    R0, R1, w0, w1 = ends(200)
    for w in (w0[::2], w1[::4]):
        w *= 9.4247 / np.linalg.norm(w, axis=1, keepdims=True)
    curve, turn = rb.bezier_so3(R0, R1, w0, w1), Rotation.from_rotvec
    R0, R1 = map(Rotation.from_matrix, (R0, R1))
    for t in np.linspace(0, 1, 21):
        points, longest = [R0, R0 * turn(w0 / 3), R1 * turn(-w1 / 3), R1], np.pi
        while len(points) > 1:
            legs = [(a.inv() * b).as_rotvec() for a, b in pairwise(points)]
            lengths = np.linalg.norm(legs, axis=-1)
            assert np.all(lengths < np.pi)
            assert np.all(lengths < longest + 40 * EPS)
            longest = [np.maximum(*pair) for pair in pairwise(lengths)]
            points = [a * turn(t * leg) for a, leg in zip(points[:-1], legs, strict=True)]
        assert np.abs(points[0].as_matrix() - curve(t)).max() < 400 * EPS


def cubic_of_quaternions(R0, R1, w0, w1, t):
    """Q(t) as the definition says, shape (N, 4, times), q1 nearer to q0 than −q1."""
    q = Rotation.from_matrix(R0.mT @ R1).as_quat(canonical=True, scalar_first=True).T
    one, (v0, v1) = np.eye(4)[:1].T, (np.concatenate([0 * w[:, :1], w], axis=1).T for w in (w0, w1))
    values = one + 0 * q, q, v0 / 2, oracles.quaternion_product(q, v1) / 2
    weights = (1 - t) ** 2 * (1 + 2 * t), t**2 * (3 - 2 * t), t * (1 - t) ** 2, t**3 - t**2
    return sum(x.T[..., None] * weight for x, weight in zip(values, weights, strict=True))


def test_the_margin_is_the_least_norm_of_the_cubic():
    given = ends(200, size=20)
    curve, t = rb.quaternion_cubic_so3(*given), np.linspace(0, 1, 4001)
    norms = np.linalg.norm(cubic_of_quaternions(*given, t), axis=1)
    assert curve.margin.shape == curve.margin_time.shape == (200,)
    assert curve.margin.min() < 0.3
    assert np.all(norms.min(axis=1) > curve.margin - 20 * EPS)
    steps = np.abs(np.diff(norms)).max(axis=1)
    assert np.all(norms.min(axis=1) < curve.margin + steps)
    for k in range(200):
        [Q] = cubic_of_quaternions(*(x[[k]] for x in given), curve.margin_time[[k]])
        assert abs(np.linalg.norm(Q) - curve.margin[k]) < 20 * EPS


def in_a_plane(margin, angle=2.0):
    """Ends about one axis, and the coefficients of the cubic, a complex number z.

    Seen from half way it is cos(a/4) + k/8 sin(a/4) at t = 1/2, the least there is.
    """
    [n] = directions(1, np.random.default_rng(13))
    with mp.workdps(oracles.DIGITS):
        a = mp.mpf(angle)
        k = mp.mpf(float(8 * (margin - mp.cos(a / 4)) / mp.sin(a / 4)))
        turn = mp.expj(a / 2)
        v0, v1 = 0.5j * k, 0.5j * k * turn
        z = [mp.mpc(1), v0, 3 * (turn - 1) - 2 * v0 - v1, 2 * (1 - turn) + v0 + v1]
    w = float(k) * n
    return n, (np.eye(3), oracles.exp_so3(angle * n), w, w), z


def turning(z, t):
    """The angle, velocity and acceleration of a body turned by twice the argument of z(t)."""
    first = [k * c for k, c in enumerate(z)][1:]
    second = [k * c for k, c in enumerate(first)][1:]
    x, v, a = (oracles.exact_polynomial(c, t) for c in (z, first, second))
    return 2 * mp.arg(x), 2 * mp.im(v / x), 2 * mp.im(a / x - (v / x) ** 2)


@pytest.mark.parametrize("margin", [0.3, 1e-2, 1e-4, 1e-6])
def test_where_the_margin_is_small_its_powers_are_lost(margin):
    n, given, z = in_a_plane(margin)
    curve = rb.quaternion_cubic_so3(*given)
    assert abs(curve.margin - margin) < 20 * EPS
    assert abs(curve.margin_time - 0.5) < 1e-7
    for t in (0.25, 0.5 - margin / 8, 0.5, 0.5 + margin / 32, 0.75):
        with mp.workdps(oracles.DIGITS):
            angle, w, acceleration = map(float, turning(z, mp.mpf(float(t))))
            gap = float(abs(oracles.exact_polynomial(z, mp.mpf(float(t)))))
        assert np.abs(curve(t) - oracles.exp_so3(angle * n)).max() < 40 * EPS / gap
        assert np.abs(curve(t, 1) - w * n).max() < 40 * EPS * 8 / gap**2
        assert np.abs(curve(t, 2) - acceleration * n).max() < 40 * EPS * 64 / gap**3


def test_where_the_cubic_of_quaternions_is_zero_it_is_refused_at_that_time():
    _, (R0, R1, w0, w1), _ = in_a_plane(0)
    stack = rb.quaternion_cubic_so3(R0, R1, np.stack([0 * w0, w0]), w1)
    assert stack.margin[1] < 20 * EPS
    assert abs(stack.margin_time[1] - 0.5) < 1e-12
    t, zero = np.linspace(0, 0.4, 5000), "the cubic of quaternions is zero"
    for order in (0, 1, 2):
        assert np.isfinite(stack([0, 0.25, 0.75, 1], order)).all()
        with pytest.raises(ValueError, match=rf"^t = 0\.5: {zero}"):
            stack[1]([0.1, 0.5], order)
        for k in (0, 2047, 2048, 4999):
            with pytest.raises(ValueError, match=rf"^t = 0\.5 of curve \[1\]: {zero}"):
                stack(np.where(np.arange(5000) == k, 0.5, t), order)


@every_curve
def test_the_cost_is_the_integral_of_the_squared_acceleration(name):
    """By Gauss's rule with 24 nodes, of the curve by its definition."""
    nodes, weights = np.polynomial.legendre.leggauss(24)
    squares = [np.sum(exactly(name, "random 0")((1 + x) / 2)[2] ** 2) for x in nodes]
    cost = rb.acceleration_cost(made(name, "random 0"))
    assert cost == pytest.approx(weights @ squares, rel=1e-9)


@pytest.mark.parametrize("margin", [0.1, 1e-3])
def test_the_cost_of_a_sudden_turn_is_not_missed(margin):
    _, given, z = in_a_plane(margin)
    cuts = [0.5 + s * margin * 8**k for k in range(9) for s in (-1, 1) if margin * 8**k < 0.5]
    with mp.workdps(15):
        want = mp.quad(lambda t: 2 * turning(z, t)[2] ** 2, sorted([0, 0.5, 1, *cuts]))
    assert rb.acceleration_cost(rb.quaternion_cubic_so3(*given)) == pytest.approx(
        float(want), rel=1e-8
    )


@pytest.mark.parametrize("short_of", [0.3, 1e-2, 1e-3, 1e-4])
def test_the_cost_of_cayleys_cubic_near_a_half_turn(short_of):
    """It turns once more in a time of about the square of what is lacking: panels round that."""
    w0, w1, n = np.array([1.0, 0, 0]), np.array([0, 2.0, 0]), np.array([1.0, 2, 2]) / 3
    curve = rb.cayley_cubic_so3(I3, rb.exp_so3((np.pi - short_of) * n), w0, w1)
    goal = n / np.tan(short_of / 2)
    rate = (w1 + np.cross(goal, w1) + goal * (goal @ w1)) / 2
    square, cube = 3 * goal - w0 - rate, w0 / 2 + rate - 2 * goal
    length = sum(Polynomial(c) ** 2 for c in zip(0 * w0, w0 / 2, square, cube, strict=True))
    quick = [t.real for t in length.deriv().roots() if abs(t.imag) < 1e-6]
    apart = 2.0 ** -np.arange(1, 42)
    cuts = np.unique([x for t in (0, 1, *quick) for x in (*(t - apart), t, *(t + apart))])
    cuts = cuts[(cuts >= 0) & (cuts <= 1)]
    x, weights = np.polynomial.legendre.leggauss(20)
    nodes = ((cuts[1:] + cuts[:-1])[:, None] + np.diff(cuts)[:, None] * x) / 2
    # half a panel, and twice the square
    cost = np.sum(np.sum(curve(nodes, 2) ** 2, axis=-1) @ weights * np.diff(cuts))
    assert rb.acceleration_cost(curve) == pytest.approx(cost, rel=1e-8)


def test_a_cost_of_cayleys_cubic_that_is_beyond_rounding_is_refused():
    turn = (np.pi - 1e-6) * np.array([1, 2, 2]) / 3
    with pytest.raises(RuntimeError, match="leave an uncertainty"):
        rb.acceleration_cost(rb.cayley_cubic_so3(I3, rb.exp_so3(turn), [1, 0, 0], [0, 2, 0]))


BOOK = np.diag([1.0, 2.22, 3.18])
RNG = np.random.default_rng(5)
R0 = Rotation.random(6, rng=RNG).as_matrix()
TURN, W0, W1, A0, A1 = RNG.normal(size=(5, 6, 3)) * np.reshape([0.6, 1.5, 1.5, 4, 4], (5, 1, 1))
R1 = R0 @ rb.exp_so3(TURN)
TIMES = np.linspace(0, 1, 51)


@pytest.mark.source("beyond BK 6")
def test_the_weighted_cubic_is_the_nearest_rotation_in_the_metric():
    curves = rb.weighted_cubic_so3(R0, R1, W0, W1, BOOK)
    M = hermite([R0, R1, R0 @ rb.hat_so3(W0), R1 @ rb.hat_so3(W1)], TIMES[:, None, None, None])
    nearest = rb.project_so_weighted(M, rb.metrics.weight_from_inertia(BOOK))
    assert np.abs(curves(TIMES) - nearest).max() < 1e-13
    round_one = rb.weighted_cubic_so3(R0, R1, W0, W1, 5 * I3)
    same = rb.projected_cubic_so3(R0, R1, W0, W1)
    assert np.abs(round_one(TIMES) - same(TIMES)).max() < 1e-14
    assert round_one.margin == pytest.approx(same.margin, rel=1e-12)
    flat = rb.weighted_cubic_so3(R0, R1, W0, W1, np.diag([1.0, 2, 3]))
    assert np.abs(flat([0, 1]) - [R0, R1]).max() < 1e-14


@pytest.mark.source("beyond BK 7")
def test_the_normal_cubic_is_that_of_its_formula():
    """x(t) is solved for again, by SciPy, and is a cubic."""
    curve = rb.normal_cubic_so3(R0[0], R1[0], W0[0], W1[0], BOOK)
    t, inverse = np.linspace(0, 1, 9), np.linalg.inv(BOOK)

    def x(y):
        return fsolve(lambda x: x - inverse @ np.cross(x, BOOK @ x) / 2 - y, y, xtol=1e-13)

    for one in np.transpose([x(y) for y in rb.log_so3(R0[0].T @ curve(t))]):
        assert np.abs(Polynomial.fit(t, one, 3)(t) - one).max() < 1e-12
    round_one = rb.normal_cubic_so3(R0, R1, W0, W1, 3 * I3)
    same = rb.exponential_cubic_so3(R0, R1, W0, W1)
    assert np.abs(round_one(TIMES) - same(TIMES)).max() < 1e-13


@pytest.mark.parametrize("moments", [(1e-6, 1, 1), (1, 1, 1e-6), (1e-3, 1, 1)])
def test_the_normal_cubic_of_a_rod_meets_its_ends(moments):
    R1 = rb.exp_so3([0.4, 0.1, 0.3])
    curve = rb.normal_cubic_so3(I3, R1, REST, REST, np.diag(moments))
    assert np.abs(curve(1) - R1).max() < 1e-9


@pytest.mark.parametrize("angle", [2.0, 2.03, 2.5, 3.1])
def test_the_normal_cubic_of_a_thin_plate_exists_but_at_the_singular_angle(angle):
    """About the middle axis the map from x to y is singular at about 2.02."""
    thin = np.diag([0.01, 1.0, 1.01])
    curve = rb.normal_cubic_so3(I3, rb.exp_so3([0, angle, 0]), REST, REST, thin)
    turn = angle * np.outer(3 * TIMES**2 - 2 * TIMES**3, [0, 1, 0])
    assert np.abs(curve(TIMES) - rb.exp_so3(turn)).max() < 1e-12
    singular = 1 / np.sqrt((1.01 - 1) / (2 * 0.01) * (1 - 0.01) / (2 * 1.01))
    turns = rb.exp_so3([[0, 0.1, 0], [0, singular, 0]])
    for given, curve in ((turns[1], ""), (turns, r" of curve \[1\]")):
        with pytest.raises(ValueError, match=rf"^normal cubic{curve}: the map from x to y is sing"):
            rb.normal_cubic_so3(I3, given, REST, REST, thin)


@pytest.mark.source("beyond BK 6", "beyond BK 7")
@pytest.mark.parametrize("make", [rb.weighted_cubic_so3, rb.normal_cubic_so3])
def test_the_excess_falls_with_the_fourth_power(make):
    """Of the projection without the weight it falls with the square."""

    def excess(make, s):
        ends = I3, rb.exp_so3(s * TURN), s * W0, s * W1
        best = rb.minimum_acceleration_so3(*ends, BOOK).cost
        return np.median(rb.acceleration_cost(make(*ends), BOOK) / best - 1)

    for form, power in ((lambda *ends: make(*ends, BOOK), 4), (rb.projected_cubic_so3, 2)):
        assert np.log2(excess(form, 0.2) / excess(form, 0.1)) == pytest.approx(power, abs=0.25)


@pytest.mark.source("beyond BK 8")
def test_the_quintic_is_near_the_least_jerk_and_is_it_from_rest_to_rest():
    def excess(s):
        ends = I3, rb.exp_so3(s * TURN), s * W0, s * W1, s * A0, s * A1
        return rb.jerk_cost(rb.exponential_quintic_so3(*ends)) / rb.minimum_jerk_so3(*ends).cost - 1

    assert np.median(excess(1.0)) < 0.05
    assert np.log2(np.median(excess(0.2)) / np.median(excess(0.1))) == pytest.approx(4, abs=0.4)
    rest = rb.exponential_quintic_so3(R0, R1, REST, REST, REST, REST)
    assert rb.jerk_cost(rest) == pytest.approx(1440 * np.sum(TURN**2, axis=-1), rel=1e-10)


def test_only_the_inertia_of_a_body_has_a_weight():
    with pytest.raises(
        ValueError, match=r"^inertia\[1\] has the principal moments 1, 1, 3; each must be at most"
    ):
        rb.weighted_cubic_so3(I3, I3, REST, REST, np.stack([I3, np.diag([1.0, 1, 3])]))
    rb.normal_cubic_so3(I3, I3, REST, REST, np.diag([1.0, 1, 3]))
