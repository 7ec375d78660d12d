"""Quaternions with two derivatives, against polynomials and 60 digits."""

import mpmath as mp
import numpy as np
import oracles
import pytest
from numpy.polynomial import Polynomial

from rbcourse import _taylor as jets
from rbcourse import vee_so3

EPS = np.finfo(float).eps
STEP = mp.mpf(10) ** -15


def exact_jet(f, t):
    """f(t), f'(t), f''(t) by differences, f from an mpmath number to a list of them."""
    with mp.workdps(oracles.DIGITS):
        t = mp.mpf(float(t))
        before, now, after = (np.array(f(t + k * STEP), dtype=object) for k in (-1, 0, 1))
        values = now, (after - before) / (2 * STEP), (after - 2 * now + before) / STEP**2
        return [x.astype(float) for x in values]


def assert_equal_to_rounding(got, want, factor=20):
    """Each derivative to a multiple of eps times its largest value."""
    for x, y in zip(got, want, strict=True):
        assert np.abs(x - y).max() < factor * EPS * np.abs(y).max(initial=1)


def test_products_are_differentiated_by_leibnizs_rule():
    *q, number = [Polynomial(c) for c in np.random.default_rng(1).normal(size=(9, 4))]
    t = np.linspace(-1, 1, 9)

    def jet(*polynomials):
        return [np.array([p.deriv(k)(t) if k else p(t) for p in polynomials]) for k in range(3)]

    left, right, share = jet(*q[:4]), jet(*q[4:]), [x[0] for x in jet(number)]
    product = oracles.quaternion_product(q[:4], q[4:])
    assert_equal_to_rounding(jets.product(left, right), jet(*product))
    assert_equal_to_rounding(jets.times(share, right), jet(*(number * x for x in q[4:])))
    inner = sum(x * y for x, y in zip(q[:4], q[4:], strict=True))
    assert_equal_to_rounding(jets.dot(left, right), [x[0] for x in jet(inner)])


def test_multiplication_is_hamiltons():
    p, q = np.random.default_rng(4).normal(size=(2, 4, 5, 3))
    scale = 4 * EPS * np.linalg.norm(p, axis=0) * np.linalg.norm(q, axis=0)
    assert np.all(np.abs(jets.multiply(p, q) - oracles.quaternion_product(p, q)) < scale)


def exact_exp(u):
    angle = oracles.exact_norm(u)
    share = mp.sin(angle) / angle if angle else mp.mpf(1)
    return [mp.cos(angle), *(share * x for x in u)]


def line(length):
    """u(0), u' and u''/2, with u(0) of that length, the others about 1."""
    u0, *others = np.random.default_rng(5).normal(size=(3, 3))
    return np.array([length * u0 / np.linalg.norm(u0), *others])


LENGTHS = [0, 1e-300, 1e-170, 1e-12, 1e-8, 1e-4, 0.1, 0.49, 0.5 - 1e-9, 0.5, 0.51, 1, 1.5]
LENGTHS += [np.pi / 2, 3, np.pi - 1e-8, np.pi, 3 * np.pi / 2, 2 * np.pi, 7, 50, 400]


@pytest.mark.parametrize("length", LENGTHS)
def test_the_exponential_is_cosine_and_sine_with_exact_derivatives(length):
    """Where the power series is, where it is not, and where the tangent has its poles."""
    u = line(length)
    got = jets.exp([u[0], u[1], 2 * u[2]])
    assert_equal_to_rounding(got, exact_jet(lambda t: exact_exp(_at(t, *u)), 0), 20 + 4 * length)


def test_the_exponential_of_many_is_that_of_each():
    """Those that need the power series beside those that do not."""
    u = np.stack([line(length) for length in LENGTHS], axis=-1)
    many = jets.exp(list(u))
    for k in range(len(LENGTHS)):
        assert_equal_to_rounding([x[:, k] for x in many], jets.exp(list(u[..., k])), 4)


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


@pytest.mark.parametrize(
    "angle", [1e-6, 1e-3, 0.1, 0.32, 0.33, 1, 1.5, np.pi / 2, 2, 2.5, 2.8, 2.85, 3, 3.1]
)
def test_slerp_is_its_definition_with_exact_derivatives(angle):
    """Lost are powers of the distance to φ = π, where a and b do not say which way to go."""
    exact, start, end, share = slerp_case(angle)
    want = exact_jet(lambda t: exact_slerp(*exact(t)), 0)
    for order, (x, y) in enumerate(zip(jets.slerp(start, end, share), want, strict=True)):
        power = 1 + (order if angle < 2.85 else 2 * order)
        assert np.abs(x - y).max() < 200 * EPS / (1 - angle / np.pi) ** power


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
    _, p, q, share = slerp_case(1.2)
    for f, arguments in (
        (jets.exp, (list(line(0.7)),)),
        (jets.product, (p, q)),
        (jets.dot, (p, q)),
        (jets.times, (share, q)),
        (jets.slerp, (p, q, share)),
    ):
        begun = f(*(x[:count] for x in arguments))
        assert len(begun) == count
        assert_equal_to_rounding(begun, f(*arguments)[:count], 4)


def test_a_quaternion_of_any_norm_has_one_rotation():
    q = np.random.default_rng(10).normal(size=(4, 50))
    want = oracles.rotation_of_quaternions(q)
    for scale in (1, -1, 1e-100, 3, 1e100):
        assert np.abs(jets.rotation(scale * q) - want).max() < 20 * EPS
    assert jets.rotation(q.reshape(4, 5, 10)).shape == (5, 10, 3, 3)
    assert np.array_equal(jets.rotation(np.eye(4)[0]), np.eye(3))


@pytest.mark.parametrize("seed", range(5))
def test_the_angular_velocity_is_that_of_the_rotation_at_any_rate_of_the_norm(seed):
    """R' = R ŵ and R'' = R (ŵ' + ŵ²), of which the second part is symmetric."""

    def exact_rotation(t):
        w, *v = _at(t, *coefficients)
        W = oracles.exact_hat(v)
        n = w * w + mp.fsum(x * x for x in v)
        return (mp.eye(3) + (2 * w * W + 2 * W * W) / n).tolist()

    coefficients = np.random.default_rng(seed).normal(size=(4, 4))
    p = [Polynomial(c) for c in coefficients.T]
    q = [np.array([x.deriv(k)(0.4) if k else x(0.4) for x in p]) for k in range(3)]
    R, rate, bend = exact_jet(exact_rotation, 0.4)
    norms = np.linalg.norm(q, axis=1)
    fast = max(1, norms[1] / norms[0], np.sqrt(norms[2] / norms[0]))
    assert np.abs(jets.angular_velocity(q[:2]) - vee_so3(R.T @ rate)).max() < 20 * EPS * fast
    assert np.abs(jets.angular_velocity(q) - vee_so3(R.T @ bend)).max() < 40 * EPS * fast**2
