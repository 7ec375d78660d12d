"""Quaternions with two derivatives, against polynomials and 60 digits."""

from itertools import pairwise

import mpmath as mp
import numpy as np
import oracles
import pytest
from numpy.polynomial import Polynomial

from rbcourse import _taylor as jets
from rbcourse import vee_so3

EPS = np.finfo(float).eps
STEP = mp.mpf(10) ** -15
TIMES = np.linspace(-1, 1, 9)


def polynomials(count, seed, degree=3):
    """As many random polynomials, the components of a vector."""
    rng = np.random.default_rng(seed)
    return [Polynomial(rng.normal(size=degree + 1)) for _ in range(count)]


def jet_of(polynomials, t):
    return [np.array([p.deriv(k)(t) for p in polynomials]) for k in range(3)]


def exact_jet(f, t):
    """f(t), f'(t), f''(t) by differences, f from an mpmath number to a list of them."""
    with mp.workdps(oracles.DIGITS):
        t = mp.mpf(float(t))
        before, now, after = (np.array(f(t + k * STEP), dtype=object) for k in (-1, 0, 1))
        values = now, (after - before) / (2 * STEP), (after - 2 * now + before) / STEP**2
        return [x.astype(float) for x in values]


def stacked(jets_at_times):
    """Jets at one time each as one jet, components first."""
    return [np.stack(x, axis=-1) for x in zip(*jets_at_times, strict=True)]


def assert_equal_to_rounding(got, want, factor=20):
    """Each derivative to a multiple of eps times its largest value."""
    for x, y in zip(got, want, strict=True):
        assert np.abs(x - y).max() < factor * EPS * np.abs(y).max(initial=1)


def test_products_are_differentiated_by_leibnizs_rule():
    p, q = polynomials(4, 1), polynomials(4, 2)
    number = polynomials(1, 3)[0]
    left, right = jet_of(p, TIMES), jet_of(q, TIMES)
    share = [x[0] for x in jet_of([number], TIMES)]
    assert_equal_to_rounding(
        jets.product(left, right), jet_of(oracles.quaternion_product(p, q), TIMES)
    )
    assert_equal_to_rounding(jets.times(share, right), jet_of([number * x for x in q], TIMES))
    inner = sum(x * y for x, y in zip(p, q, strict=True))
    want = [x[0] for x in jet_of([inner], TIMES)]
    assert_equal_to_rounding(jets.dot(left, right), want)


def test_multiplication_is_hamiltons():
    p, q = np.random.default_rng(4).normal(size=(2, 4, 5, 3))
    scale = 4 * EPS * np.linalg.norm(p, axis=0) * np.linalg.norm(q, axis=0)
    assert np.all(np.abs(jets.multiply(p, q) - oracles.quaternion_product(p, q)) < scale)
    one, i, j, k = np.eye(4)
    for a, b, c in ((i, j, k), (j, k, i), (k, i, j)):
        assert np.array_equal(jets.multiply(a, b), c)
        assert np.array_equal(jets.multiply(b, a), -c)
        assert np.array_equal(jets.multiply(a, a), -one)


def exact_exp(u):
    angle = oracles.exact_norm(u)
    share = mp.sin(angle) / angle if angle else mp.mpf(1)
    return [mp.cos(angle), *(share * x for x in u)]


def lines(lengths):
    """Polynomials u with u(0) of those lengths, u' and u'' about 1."""
    rng = np.random.default_rng(5)
    for length in lengths:
        u0, u1, u2 = rng.normal(size=(3, 3))
        yield np.array([length * u0 / np.linalg.norm(u0), u1, u2])


LENGTHS = [0, 1e-300, 1e-170, 1e-12, 1e-8, 1e-4, 0.1, 0.49, 0.5 - 1e-9, 0.5, 0.51, 1, 1.5]
LENGTHS += [np.pi / 2, 3, np.pi - 1e-8, np.pi, 3 * np.pi / 2, 2 * np.pi, 7, 50, 400]


@pytest.mark.parametrize("length", LENGTHS)
def test_the_exponential_is_cosine_and_sine_with_exact_derivatives(length):
    """Where the power series is, where it is not, and where the tangent has its poles."""
    [(u0, u1, u2)] = lines([length])
    got = jets.exp([u0, u1, 2 * u2])
    with mp.workdps(oracles.DIGITS):
        a, b, c = ([mp.mpf(float(x)) for x in u] for u in (u0, u1, u2))
    want = exact_jet(
        lambda t: exact_exp([x + y * t + z * t * t for x, y, z in zip(a, b, c, strict=True)]), 0
    )
    assert_equal_to_rounding(got, want, 20 + 4 * length)


def test_the_exponential_of_many_is_that_of_each():
    """Those that need the power series beside those that do not."""
    u = np.array(list(lines(LENGTHS))).transpose(1, 2, 0)
    many = jets.exp(list(u))
    for k in range(len(LENGTHS)):
        assert_equal_to_rounding([x[:, k] for x in many], jets.exp(list(u[..., k])), 4)


def test_the_shares_of_an_angle_turn_about_its_axis():
    """exp(t u)' = exp(t u) u."""
    u = np.array([0.3, -0.4, 1.2])
    q = jets.exp(
        [np.multiply.outer(u, TIMES), np.multiply.outer(u, 1 + 0 * TIMES), np.zeros((3, 9))]
    )
    rate = jets.multiply(q[0], np.array([0, *u])[:, None] + 0 * TIMES)
    assert np.abs(q[1] - rate).max() < 20 * EPS
    assert np.abs(q[2] + u @ u * q[0]).max() < 20 * EPS


def exact_slerp(a, b, t):
    """The definition, at any angle: between parallel quaternions it is a."""
    cosine = mp.fdot(a, b)
    side = [y - cosine * x for x, y in zip(a, b, strict=True)]
    sine = oracles.exact_norm(side)
    angle = mp.atan2(sine, cosine)
    if not sine:
        return a
    return [
        (mp.sin((1 - t) * angle) * x + mp.sin(t * angle) * y) / mp.sin(angle)
        for x, y in zip(a, b, strict=True)
    ]


def slerp_case(angle):
    """Two unit quaternions with an angle between them, moving, and a share, all as functions."""
    rng = np.random.default_rng(7)
    n, u0, u1, v1, v2 = rng.normal(size=(5, 3))
    n *= angle / np.linalg.norm(n)

    def exact(t):
        start, turn = exact_exp(_at(t, u0, u1)), exact_exp(_at(t, n, v1, v2))
        return start, oracles.quaternion_product(start, turn), mp.mpf("0.3") + t + t * t / 2

    zero = np.zeros(3)
    start = jets.exp([u0, u1, zero])
    end = jets.product(start, jets.exp([n, v1, 2 * v2]))
    return exact, start, end, [np.array(x) for x in (0.3, 1.0, 1.0)]


def _at(t, *coefficients):
    columns = zip(*coefficients, strict=True)
    return [oracles.exact_polynomial([mp.mpf(float(c)) for c in column], t) for column in columns]


def slerp_errors(angle):
    exact, start, end, share = slerp_case(angle)
    want = exact_jet(lambda t: exact_slerp(*exact(t)), 0)
    return [np.abs(x - y).max() for x, y in zip(jets.slerp(start, end, share), want, strict=True)]


@pytest.mark.parametrize("angle", [1e-6, 1e-3, 0.1, 0.32, 0.33, 1, 1.5, np.pi / 2, 2, 2.5, 2.8])
def test_slerp_is_its_definition_with_exact_derivatives(angle):
    """Lost are powers of the distance to φ = π, where a and b do not say which way to go."""
    for order, error in enumerate(slerp_errors(angle)):
        assert error < 200 * EPS / (1 - angle / np.pi) ** (1 + order)


@pytest.mark.parametrize("angle", [2.85, 3, 3.1])
def test_slerp_has_exact_derivatives_up_to_opposite_quaternions(angle):
    for order, error in enumerate(slerp_errors(angle)):
        assert error < 200 * EPS / (1 - angle / np.pi) ** (1 + 2 * order)


def test_between_equal_quaternions_slerp_stays():
    """Also where rounding makes their product larger than 1."""
    q = np.random.default_rng(8).normal(size=(4, 200))
    q /= np.linalg.norm(q, axis=0)
    assert np.einsum("in,in->n", q, q).max() > 1
    still = [q, 0 * q, 0 * q]
    for share in (0.0, 0.3, 1.0):
        got = jets.slerp(still, still, [np.full(200, share), np.ones(200), np.zeros(200)])
        assert np.abs(got[0] - q).max() < 8 * EPS
        assert np.abs(got[1:]).max() < 40 * EPS


def test_between_fixed_quaternions_slerp_is_the_arc():
    rng = np.random.default_rng(9)
    a, b = rng.normal(size=(2, 4))
    a, b = a / np.linalg.norm(a), np.sign(a @ b) * b / np.linalg.norm(b)
    for t in (0, 0.2, 0.5, 1):
        assert np.abs(jets.slerp([a], [b], [np.array(t)])[0] - oracles.arc(a, b, t)).max() < 8 * EPS


@pytest.mark.parametrize("count", [1, 2])
def test_the_beginning_of_a_jet_is_enough(count):
    exact_share = slerp_case(1.2)[1:]
    u = list(next(lines([0.7])))
    p, q, share = exact_share
    for f, arguments in (
        (jets.exp, (u,)),
        (jets.product, (p, q)),
        (jets.dot, (p, q)),
        (jets.times, (share, q)),
        (jets.slerp, (p, q, share)),
    ):
        begun = f(*(x[:count] for x in arguments))
        assert len(begun) == count
        assert_equal_to_rounding(begun, f(*arguments)[:count], 4)


@pytest.mark.parametrize("order", [1, 2])
def test_each_derivative_is_the_complex_step_of_the_one_before(order):
    """Away from the poles of the tangent, and of 0, where √s hides the step in the rounding."""
    step, lengths = 1e-100, [x for x in LENGTHS if x > 0.05 and abs(np.cos(x / 2)) > 0.01]
    u = list(np.array(list(lines(lengths))).transpose(1, 2, 0))
    ahead = [x + 1j * step * rate for x, rate in pairwise(u[: order + 1])]
    got, want = jets.exp(ahead)[-1].imag / step, jets.exp(u)[order]
    off = np.abs(got - want).max(axis=0)
    assert np.all(off < 4 * EPS * (20 + np.array(lengths)) * np.abs(want).max(axis=0, initial=1))


def test_a_quaternion_of_any_norm_has_one_rotation():
    q = np.random.default_rng(10).normal(size=(4, 50))
    want = oracles.rotation_of_quaternions(q)
    for scale in (1, -1, 1e-100, 3, 1e100):
        assert np.abs(jets.rotation(scale * q) - want).max() < 20 * EPS
    assert jets.rotation(q.reshape(4, 5, 10)).shape == (5, 10, 3, 3)
    assert np.array_equal(jets.rotation(np.eye(4)[0]), np.eye(3))


def exact_rotation(q):
    w, x, y, z = q
    n = mp.fsum(c * c for c in q)
    W = mp.matrix([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    R = mp.eye(3) + (2 * w * W + 2 * W * W) / n
    return R.tolist()


@pytest.mark.parametrize("seed", range(5))
def test_the_angular_velocity_is_that_of_the_rotation_whatever_the_norm_does(seed):
    """R' = R ŵ and R'' = R (ŵ' + ŵ²), of which the second part is symmetric."""
    coefficients = np.random.default_rng(seed).normal(size=(4, 4))
    q = jet_of([Polynomial(c) for c in coefficients.T], 0.4)
    R, rate, bend = exact_jet(lambda t: exact_rotation(_at(t, *coefficients)), 0.4)
    fast = max(1, np.linalg.norm(q[1]) / np.linalg.norm(q[0]))
    fast = max(fast, np.sqrt(np.linalg.norm(q[2]) / np.linalg.norm(q[0])))
    assert np.abs(jets.angular_velocity(q[:2]) - vee_so3(R.T @ rate)).max() < 20 * EPS * fast
    assert np.abs(jets.angular_velocity(q) - vee_so3(R.T @ bend)).max() < 40 * EPS * fast**2
