"""Compare all closed forms with their definitions, evaluated in 60 digits."""

from functools import partial
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
from rbcourse._polynomials import hermite

EPS = np.finfo(float).eps
MAKERS = {
    "exponential": rb.closed_forms.exponential_cubic,
    "bezier": rb.closed_forms.bezier,
    "cumulative": rb.closed_forms.cumulative_bezier,
    "quaternion": rb.closed_forms.quaternion_cubic,
    "cayley": rb.closed_forms.cayley_cubic,
}
I3, REST = np.eye(3), np.zeros(3)
every_curve = pytest.mark.parametrize("name", MAKERS)
STEP = mp.mpf(10) ** -15


def directions(count, rng):
    axes = rng.normal(size=(count, 3))
    return axes / np.linalg.norm(axes, axis=1, keepdims=True)


def ends(count, angle=None, size=None):
    """Return random R0, R1, w0, w1; `angle` and `size` fix the turn and the speeds."""
    rng = np.random.default_rng(count)
    R0, R1 = (Rotation.random(count, rng).as_matrix() for _ in range(2))
    if angle is not None:
        R1 = R0 @ Rotation.from_rotvec(angle * directions(count, rng)).as_matrix()
    sizes = rng.uniform(0, 9, (2, count, 1)) if size is None else (size, size)
    return R0, R1, sizes[0] * directions(count, rng), sizes[1] * directions(count, rng)


def quaternion_of(R):
    """Return an unnormalised quaternion of a rotation."""
    sine = [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]
    return [1 + R[0, 0] + R[1, 1] + R[2, 2], *sine]


def unit_quaternion_of(R):
    q = quaternion_of(R)
    return [x / oracles.exact_norm(q) for x in q]


def exact_log(R):
    """Return the rotation vector of a rotation that is not a half-turn."""
    q, *sine = quaternion_of(R)
    length = oracles.exact_norm(sine)
    return [mp.atan2(length, q - 2) / (length or 1) * x for x in sine]


def turned_by(q):
    """Return the matrix of p ↦ q p q⁻¹."""
    w, W = q[0], oracles.exact_hat(q[1:])
    return mp.eye(3) + 2 * (w * W + W * W) / mp.fsum(x * x for x in q)


def along(w, share):
    return oracles.exact_exp([share * x for x in w])


def in_coordinates(coordinates, point):
    """Return the curve that is a cubic in these coordinates, with the given end velocities."""

    def curve(turn, w0, w1):
        values, rates = [], []
        for R, w in ((mp.eye(3), w0), (turn, w1)):
            before, after = (coordinates(R * along(w, h)) for h in (-STEP, STEP))
            values.append(coordinates(R))
            rates.append([(b - a) / (2 * STEP) for a, b in zip(before, after, strict=True)])
        columns = list(zip(*values, *rates, strict=True))

        def at(t):
            weights = (1 - t) ** 2 * (1 + 2 * t), t**2 * (3 - 2 * t), t * (1 - t) ** 2, t**3 - t**2
            return point([mp.fdot(weights, column) for column in columns])

        return at

    return curve


def by_de_casteljau(turn, w0, w1):
    inner = along(w0, mp.mpf(1) / 3), turn * along(w1, mp.mpf(-1) / 3)

    def at(t):
        points = [mp.eye(3), *inner, turn]
        while len(points) > 1:
            points = [a * along(exact_log(a.T * b), t) for a, b in pairwise(points)]
        return points[0]

    return at


def by_three_factors(turn, w0, w1):
    middle = exact_log(along(w0, mp.mpf(-1) / 3) * turn * along(w1, mp.mpf(-1) / 3))
    return lambda t: (
        along(w0, (1 - (1 - t) ** 3) / 3) * along(middle, 3 * t**2 - 2 * t**3) * along(w1, t**3 / 3)
    )


DEFINITIONS = {
    "exponential": in_coordinates(exact_log, oracles.exact_exp),
    "bezier": by_de_casteljau,
    "cumulative": by_three_factors,
    "quaternion": in_coordinates(unit_quaternion_of, turned_by),
    "cayley": in_coordinates(
        lambda R: [x / quaternion_of(R)[0] for x in quaternion_of(R)[1:]],
        lambda g: turned_by([1, *g]),
    ),
}


def by_differences(f, t):
    """Return f(t), f'(t), f''(t) as mpmath numbers."""
    before, now, after = (f(mp.mpf(float(t)) + k * STEP) for k in (-1, 0, 1))
    return now, (after - before) / (2 * STEP), (after - 2 * now + before) / STEP**2


def exactly(name, given, times):
    """Return R, w and w' of a curve from I; ŵ' is the skew part of Rᵀ R'' = ŵ' + ŵ²."""
    jets = []
    with mp.workdps(oracles.DIGITS):
        turn, w0, w1 = ([mp.mpf(float(x)) for x in v] for v in given)
        curve = DEFINITIONS[name](oracles.exact_exp(turn), w0, w1)
        for t in times:
            R, *rates = by_differences(curve, t)
            vectors = [[x / 2 for x in quaternion_of(R.T * rate)[1:]] for rate in rates]
            jets.append((R.tolist(), *vectors))
    return [np.array(x, dtype=float) for x in zip(*jets, strict=True)]


def cases():
    """Return a dict with the turn, w0 and w1 of each case."""
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
        "a small turn, fast": (0.01 * n, w0, w1),
        "a tiny turn, slow": (1e-6 * n, 1e-6 * w0, 1e-6 * w1),
        "near a half-turn": ((np.pi - 1e-3) * n, w0, w1),
        "nearer to a half-turn": ((np.pi - 1e-6) * n, w0, w1),
        "inner points near a half-turn": (oracles.log_so3(product), w0, w1),
        "fast": (2 * turn, 9 * n, 9 * m),
        "fastest": (-turn, 9.42 * m, 9.42 * n),
        **{f"random {k}": tuple(3 * rng.normal(size=(3, 3)) / [[3], [1], [1]]) for k in range(2)},
    }


CASES = cases()


@pytest.mark.source("BK 1")
@every_curve
@pytest.mark.parametrize("case", CASES)
def test_curves_and_derivatives_agree_with_the_definition(name, case):
    """Errors of Cayley's parameters grow with the secant of half the angle: near a half-turn, all
    digits are lost."""
    (turn, w0, w1), start, times = CASES[case], Rotation.random(None, 1).as_matrix(), (0.13, 0.6, 1)
    curve = MAKERS[name](start, start @ oracles.exp_so3(turn), w0, w1)
    R, *rates = exactly(name, CASES[case], times)
    worse = 1 / np.cos(np.linalg.norm(turn) / 2) if name == "cayley" else 1
    assert np.abs(curve(times) - start @ R).max() < 20 * EPS
    for order, rate in enumerate(rates, 1):
        scale = worse * np.abs(rate).max(initial=1)
        assert np.abs(curve(times, order) - rate).max() < 20 * EPS * scale


@pytest.mark.parametrize("name", ["exponential", "bezier"])
def test_the_long_and_the_short_way_add_up_to_a_full_turn(name):
    """The turns are about one axis, from rest to rest or at the constant rate 1 − 2π."""
    make, e, t = partial(MAKERS[name], long=True), I3[1], np.linspace(0, 1, 201)
    for w in [0 * e, (1 - 2 * np.pi) * e][: 2 if name == "exponential" else 1]:
        speed = make(I3, rb.exp_so3(e), w, w)(t, 1)[:, 1]
        assert np.trapezoid(speed, t) == pytest.approx(1 - 2 * np.pi, abs=1e-3)
        assert not w.any() or speed == pytest.approx(np.full(201, 1 - 2 * np.pi))
    assert np.all(make(I3, I3)(t) == I3)


def test_errors_name_the_ends_that_are_outside_the_domain():
    w, half = np.zeros((2, 3, 3)), np.diag([-1.0, 1, -1])
    w[1, 2] = 3 * np.pi * np.array([2, 1, 2]) / 3
    for name, given in (("v0", (w, REST)), ("v1", (REST, w))):
        with pytest.raises(ValueError, match=rf"^{name}\[1, 2\]: an angle .* below 3π is wanted"):
            rb.closed_forms.bezier(I3, I3, *given)
    below = w * (1 - 1e-12)
    curve = rb.closed_forms.bezier(I3, I3, below, below)
    assert np.abs(curve([0, 1], 1) - below).max() < 100 * EPS
    with pytest.raises(ValueError, match=r"^start, goal of curve \[1\] are a half-turn apart"):
        rb.closed_forms.cayley_cubic(I3, np.stack([I3, half]))
    rounded = awkward.rounded_half_turns(np.random.default_rng(12), 100)[:2]
    for R0, R1 in (*((I3, R) for R in awkward.half_turns()[0]), *zip(*rounded, strict=True)):
        with pytest.raises(ValueError, match=r"^start, goal are a half-turn apart"):
            rb.closed_forms.cayley_cubic(R0, R1)


@pytest.mark.parametrize("name", ["bezier", "corrected_bezier", "quaternion_cubic"])
def test_closed_forms_with_fast_ends_are_reversible_in_time(name):
    """For some fast ends, the correction uses a logarithm that is not the shortest one."""
    R0, R1, w0, w1 = ends(40, 2.5)
    make, t = getattr(rb.closed_forms, name), np.linspace(0, 1, 11)
    curve, back = make(R0, R1, w0, w1), make(R1, R0, -w1, -w0)
    worse = 1 / np.minimum(curve.margin, 1)
    for order in (0, 1, 2):
        others = (0, 2) if order else (0, 2, 3)
        want = (-1) ** order * curve(t, order)
        off = np.abs(back(1 - t, order) - want).max(axis=others)
        assert np.all(off < 400 * EPS * np.abs(want).max(axis=others, initial=1) * worse)


def cubic_of_quaternions(R0, R1, w0, w1, t):
    """Return Q(t) by its definition, shape (N, 4, times); of ±q1, the one nearer to q0 is used."""
    q = Rotation.from_matrix(R0.mT @ R1).as_quat(canonical=True, scalar_first=True).T
    one, (v0, v1) = np.eye(4)[:1].T, (np.insert(w, 0, 0, axis=1).T for w in (w0, w1))
    values = one + 0 * q, q, v0 / 2, oracles.quaternion_product(q, v1) / 2
    weights = (1 - t) ** 2 * (1 + 2 * t), t**2 * (3 - 2 * t), t * (1 - t) ** 2, t**3 - t**2
    return sum(x.T[..., None] * weight for x, weight in zip(values, weights, strict=True))


def test_the_margin_is_the_least_norm_of_the_cubic():
    given = ends(200, size=20)
    curve = rb.closed_forms.quaternion_cubic(*given)
    norms = np.linalg.norm(cubic_of_quaternions(*given, np.linspace(0, 1, 1001)), axis=1)
    assert curve.margin.shape == curve.margin_time.shape == (200,)
    assert curve.margin.min() < 0.3
    assert np.all(norms.min(axis=1) > curve.margin - 20 * EPS)
    assert np.all(norms.min(axis=1) < curve.margin + np.abs(np.diff(norms)).max(axis=1))
    there = np.linalg.norm(cubic_of_quaternions(*given, curve.margin_time), axis=1)
    assert np.abs(np.diag(there) - curve.margin).max() < 20 * EPS


def in_a_plane(margin):
    """Return a turn by 2 rad about an axis, and both velocities along this axis.

    Relative to the half-way rotation, Q is a complex number. The least norm of Q, at t = 1/2, is
    cos(1/2) + k/8 sin(1/2).
    """
    [n] = directions(1, np.random.default_rng(13))
    k = 8 * (margin - np.cos(0.5)) / np.sin(0.5)
    return 2 * n, k * n, k * n


@pytest.mark.parametrize("margin", [0.3, 1e-2, 1e-4, 1e-6])
def test_errors_grow_with_the_inverse_norm_of_the_cubic(margin):
    turn, w0, w1 = in_a_plane(margin)
    given = I3, oracles.exp_so3(turn), w0, w1
    curve, t = (
        rb.closed_forms.quaternion_cubic(*given),
        0.5 + np.array([-0.25, -margin / 8, 0, margin / 32]),
    )
    assert abs(curve.margin - margin) < 20 * EPS
    assert abs(curve.margin_time - 0.5) < 1e-7
    [Q] = cubic_of_quaternions(*(x[None] for x in given), t)
    for order, want in enumerate(exactly("quaternion", (turn, w0, w1), t)):
        off = np.abs(curve(t, order) - want).reshape(4, -1).max(axis=1)
        assert np.all(off < 40 * EPS * 8**order / np.linalg.norm(Q, axis=0) ** (1 + order))


def test_a_zero_of_the_quaternion_cubic_is_refused():
    turn, w0, w1 = in_a_plane(0)
    stack = rb.closed_forms.quaternion_cubic(I3, oracles.exp_so3(turn), np.stack([0 * w0, w0]), w1)
    assert stack.margin[1] < 20 * EPS
    assert abs(stack.margin_time[1] - 0.5) < 1e-12
    for order in (0, 1, 2):
        assert np.isfinite(stack([0, 0.25, 0.75, 1], order)).all()
        for curve, name in ((stack[1], ""), (stack, r" of curve \[1\]")):
            with pytest.raises(ValueError, match=rf"^t = 0\.5{name}: the cubic of quaternions"):
                curve([0.25, 0.5], order)


BOOK = rb.Body(np.diag([1.0, 2.22, 3.18]))
RNG = np.random.default_rng(5)
R0 = Rotation.random(6, RNG).as_matrix()
TURN, W0, W1, A0, A1 = RNG.normal(size=(5, 6, 3)) * np.reshape([0.6, 1.5, 1.5, 4, 4], (5, 1, 1))
R1 = R0 @ rb.exp_so3(TURN)
TIMES = np.linspace(0, 1, 51)


@pytest.mark.source("beyond BK 6")
def test_the_weighted_cubic_gives_the_nearest_rotation_in_its_metric():
    curves = rb.projected_cubic(R0, R1, W0, W1, body=BOOK)
    M = hermite([R0, R1, R0 @ rb.hat_so3(W0), R1 @ rb.hat_so3(W1)], TIMES[:, None, None, None])
    nearest = rb.projection.project_so_weighted(M, rb.metrics.weight_from_inertia(BOOK.inertia))
    assert np.abs(curves(TIMES) - nearest).max() < 1e-13
    round_one = rb.projected_cubic(R0, R1, W0, W1, body=rb.Body(5 * I3))
    same = rb.projected_cubic(R0, R1, W0, W1)
    assert np.abs(round_one(TIMES) - same(TIMES)).max() < 1e-14
    assert round_one.margin == pytest.approx(same.margin, rel=1e-12)
    flat = rb.projected_cubic(R0, R1, W0, W1, body=rb.Body(np.diag([1.0, 2, 3])))
    assert np.abs(flat([0, 1]) - [R0, R1]).max() < 1e-14


@pytest.mark.source("beyond BK 7")
def test_the_normal_cubic_satisfies_its_formula():
    """SciPy solves the formula for x(t), which must be a cubic."""
    curve = rb.closed_forms.normal_cubic(R0[0], R1[0], W0[0], W1[0], body=BOOK)
    t, G, inverse = np.linspace(0, 1, 9), BOOK.inertia, np.linalg.inv(BOOK.inertia)

    def x(y):
        return fsolve(lambda x: x - inverse @ np.cross(x, G @ x) / 2 - y, y, xtol=1e-13)

    for one in np.transpose([x(y) for y in rb.log_so3(R0[0].T @ curve(t))]):
        assert np.abs(Polynomial.fit(t, one, 3)(t) - one).max() < 1e-12
    round_one = rb.closed_forms.normal_cubic(R0, R1, W0, W1, body=rb.Body(3 * I3))
    same = rb.closed_forms.exponential_cubic(R0, R1, W0, W1)
    assert np.abs(round_one(TIMES) - same(TIMES)).max() < 1e-13


def test_the_normal_cubic_of_thin_bodies_exists_except_at_the_singular_angle():
    """For turns about a plate's middle axis, the map from x to y is singular at about 2.02 rad."""
    for moments in ((1e-6, 1, 1), (1, 1, 1e-6), (1e-3, 1, 1)):
        R1 = rb.exp_so3([0.4, 0.1, 0.3])
        curve = rb.closed_forms.normal_cubic(I3, R1, body=rb.Body(np.diag(moments)))
        assert np.abs(curve(1) - R1).max() < 1e-9
    plate = rb.Body(np.diag([0.01, 1.0, 1.01]))
    for angle in (2.0, 2.03, 2.5, 3.1):
        curve = rb.closed_forms.normal_cubic(I3, rb.exp_so3([0, angle, 0]), body=plate)
        turn = angle * np.outer(3 * TIMES**2 - 2 * TIMES**3, [0, 1, 0])
        assert np.abs(curve(TIMES) - rb.exp_so3(turn)).max() < 1e-12
    singular = 1 / np.sqrt((1.01 - 1) / (2 * 0.01) * (1 - 0.01) / (2 * 1.01))
    turns = rb.exp_so3([[0, 0.1, 0], [0, singular, 0]])
    for given, curve in ((turns[1], ""), (turns, r" of curve \[1\]")):
        with pytest.raises(ValueError, match=rf"^normal cubic{curve}: the map from x to y is sing"):
            rb.closed_forms.normal_cubic(I3, given, body=plate)


@pytest.mark.source("beyond BK 8")
def test_the_excess_of_the_quintic_grows_as_the_fourth_power():
    found = []
    for s in (0.2, 0.1, 1):
        ends = I3, rb.exp_so3(s * TURN), *(s * x for x in (W0, W1, A0, A1))
        excess = (
            rb.jerk_cost(rb.closed_forms.exponential_quintic(*ends)) / rb.minimum_jerk(*ends).cost
        )
        found.append(np.median(excess - 1))
    assert np.log2(found[0] / found[1]) == pytest.approx(4, abs=0.25)
    assert found[2] < 0.05
    rest = rb.closed_forms.exponential_quintic(R0, R1)
    assert rb.jerk_cost(rest) == pytest.approx(1440 * np.sum(TURN**2, axis=-1), rel=1e-10)


@pytest.mark.source("BK 1")
def test_the_quaternion_cubic_turns_the_short_way_if_both_ends_are_below_8_rad():
    """Its component along the quaternion half-way is at least cos(a/4) − (k/8) sin(a/4)."""
    R0, R1, w0, w1 = ends(400)
    speed = np.maximum(np.linalg.norm(w0, axis=1), np.linalg.norm(w1, axis=1))
    a = rb.angle_between(R0, R1)
    bound = np.cos(a / 4) - speed / 8 * np.sin(a / 4)
    assert np.all(rb.closed_forms.quaternion_cubic(R0, R1, w0, w1).margin >= bound - 8 * EPS)
    assert bound.min() < 0.1
    t, goal = np.linspace(0, 1, 2001), rb.exp_so3([0, 0, np.radians(170)])

    def turn(k0, k1):  # about z, in degrees
        w = rb.closed_forms.quaternion_cubic(I3, goal, [0, 0, k0], [0, 0, k1])(t, 1)[:, 2]
        return np.degrees(np.trapezoid(w, t))

    for k0 in (-7.99, 0, 7.99):
        for k1 in (-7.99, 3, 7.99):
            assert turn(k0, k1) == pytest.approx(170, abs=0.5)
    assert turn(-9, -9) == pytest.approx(170 - 720, abs=0.5)
    turning_point = -8 / np.tan(np.radians(170 / 4))  # the cubic meets 0 at t = ½
    for k, degrees in ((0.99 * turning_point, 170), (1.01 * turning_point, -550)):
        assert turn(k, k) == pytest.approx(degrees, abs=2)
    assert rb.closed_forms.quaternion_cubic(I3, goal, *[[0, 0, turning_point]] * 2).margin < 1e-12
