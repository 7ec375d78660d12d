"""Check the bracket formulas of docs/near_optimal.md on SO(3), SO(4) and SO(5)."""

import itertools
from fractions import Fraction
from functools import cache

import numpy as np
import pytest

from rbcourse._polynomials import grid
from rbcourse.optimum._second_variation import polynomials

NODES = 33


@cache
def basis(n):
    """Return the basis of so(n), orthonormal for tr(XᵀY)/2, shape (n (n − 1)/2, n, n)."""
    found = []
    for i, j in itertools.combinations(range(n), 2):
        X = np.zeros((n, n), int)
        X[j, i], X[i, j] = 1, -1
        found.append(X)
    return np.array(found)


def to_matrix(x, n):
    return np.tensordot(x, basis(n), axes=1)


def to_vector(X):
    n = X.shape[-1]
    return np.tensordot(X, basis(n), axes=((-2, -1), (-2, -1))) / 2


def bracket(x, y, n):
    X, Y = to_matrix(x, n), to_matrix(y, n)
    return to_vector(X @ Y - Y @ X)


def exp(X):
    """Return the exponential of skew matrices, by their eigenvectors."""
    values, V = np.linalg.eigh(1j * X)
    return np.real((V * np.exp(-1j * values)[..., None, :]) @ V.conj().mT)


def log(R):
    """Return the logarithm of rotations by less than about 2 rad, by Newton's method."""
    X = (R - R.mT) / 2
    for _ in range(9):
        E = exp(-X) @ R
        X = X + (E - E.mT) / 2
    return X


@pytest.mark.source("beyond BK 15")
@pytest.mark.parametrize("n", [3, 4, 5])
def test_the_two_forms_of_the_second_variation_are_equal(n):
    """For vectors of integers, ‖x'‖² − w' · [η, x]' with x = η' + [w, η] equals the sum of squares
    exactly."""
    rng, d = np.random.default_rng(n), n * (n - 1) // 2
    for _ in range(5):
        w, a, eta, rate, bend = (
            np.array([Fraction(int(k)) for k in row]) for row in rng.integers(-9, 10, (5, d))
        )
        b = lambda x, y: bracket(x, y, n)  # noqa: E731
        x = rate + b(w, eta)
        x_rate = bend + b(a, eta) + b(w, rate)
        definition = x_rate @ x_rate - a @ (b(rate, x) + b(eta, x_rate))
        D1 = rate + b(w, eta) / 2
        D2 = bend + b(a, eta) / 2 + b(w, rate) + b(w, b(w, eta)) / 4
        bent, pulled = D2 - b(w, b(w, eta)) / 4, b(a, eta)
        assert definition == bent @ bent - pulled @ pulled / 4 - b(a, D1) @ b(w, eta)


def closed_forms(sigma, w0, w1, n):
    """Return Bézier's curve from I, the same curve minus its deviation, and E by (9)."""
    nodes = grid(NODES)
    t = nodes.t
    S, W0, W1 = (to_matrix(x, n) for x in (sigma, w0, w1))
    points = [np.eye(n), exp(W0 / 3), exp(S) @ exp(-W1 / 3), exp(S)]
    points = [np.broadcast_to(P, (len(t), n, n)) for P in points]
    while len(points) > 1:
        points = [A @ exp(t[:, None, None] * log(A.mT @ B)) for A, B in itertools.pairwise(points)]
    quarter = exp(S / 4)
    u0, u1 = (to_vector(x) for x in (quarter.mT @ W0 @ quarter, quarter @ W1 @ quarter.mT))
    e, d = (u0 + u1) / 2 - sigma, u1 - u0
    half, u = exp(S / 2), 2 * t[:, None] - 1
    delta = ((1 - u**2) / 4) ** 2 * sum(c * u**k for k, c in enumerate(deviation(sigma, e, d, n)))
    moved = exp(-to_matrix(delta, n) / 2)
    bend = nodes.derivative @ nodes.derivative @ delta
    E = nodes.integral[-1] @ np.sum(bend**2, axis=1)
    return points[0], half @ moved @ half.mT @ points[0] @ moved, E


def triple_brackets(s, e, d, n):
    """Return the eight brackets [x, [y, z]] of degree three in (9) of docs/near_optimal.md."""
    triples = (s, s, e), (s, s, d), (s, e, d), (e, s, e), (e, s, d), (e, e, d), (d, s, d), (d, e, d)
    return [bracket(x, bracket(y, z, n), n) for x, y, z in triples]


def deviation(s, e, d, n):
    """Return the coefficients of (9) of docs/near_optimal.md, in powers of u."""
    sse, ssd, sed, ese, esd, eed, dsd, ded = triple_brackets(s, e, d, n)
    return [
        -ssd / 108 + 17 * sed / 1080 - 13 * esd / 1080 + 97 * eed / 15120,
        -sse / 90 - 3 * ese / 180 - dsd / 720 + 55 * ded / 30240,
        6 * sed / 1080 - 9 * esd / 1080 + 81 * eed / 15120,
        -2 * ese / 180 + 17 * ded / 30240,
        30 * eed / 15120,
    ]


def as_so3(x):
    """Convert a vector of ℝ³ to the basis of so(3) used here."""
    return to_vector(np.array([[0, -x[2], x[1]], [x[2], 0, -x[0]], [-x[1], x[0], 0]]))


def excess(R, n):
    """Find the least cost by descent; return the excess of R, and the least cost."""
    nodes = grid(NODES)
    weights = nodes.integral[-1]
    w = to_vector(R.mT @ np.tensordot(nodes.derivative, R, axes=1))
    a = nodes.derivative @ w
    d = w.shape[1]
    shapes = [np.einsum("tj,ab->jatb", p, np.eye(d)) for p in polynomials(10, 2, NODES)[:3]]
    eta, rate, bend = (x.reshape(-1, NODES, d) for x in shapes)
    saved = 0.0
    for _ in range(10):
        by = bend + bracket(a, eta, n) + bracket(w, rate, n)
        slope = np.einsum("t,ta,jta->j", weights, a, by)
        step = np.linalg.solve(np.einsum("t,ita,jta->ij", weights, by, by), -slope)
        x, x_rate, x_bend = (np.tensordot(step, z, axes=1) for z in (eta, rate, bend))
        # dw is the change of w from R to R exp(x), as a series of brackets; da is its derivative
        dw, da, term, its_rate, k = x_rate.copy(), x_bend.copy(), x_rate, x_bend, 1
        other, other_rate = w, a
        while np.abs(term).max() + np.abs(other).max() > 1e-20 and k < 12:
            its_rate = -(bracket(x_rate, term, n) + bracket(x, its_rate, n)) / (k + 1)
            other_rate = -(bracket(x_rate, other, n) + bracket(x, other_rate, n)) / k
            term, other = -bracket(x, term, n) / (k + 1), -bracket(x, other, n) / k
            dw, da, k = dw + term + other, da + its_rate + other_rate, k + 1
        saved -= weights @ np.sum(2 * a * da + da**2, axis=1)
        w, a = w + dw, a + da
    return saved, weights @ np.sum(a**2, axis=1)


@pytest.mark.source("beyond BK 10")
@pytest.mark.parametrize("n", [4, pytest.param(5, marks=pytest.mark.slow)])
def test_the_excess_agrees_with_the_note_in_higher_dimensions(n):
    """Bézier's curve has the excess E; the excess of the corrected curve is of eighth order."""
    d = n * (n - 1) // 2
    for data in np.random.default_rng(n).normal(size=(6 if n == 4 else 20, 3, d)):
        data *= [[0.6], [0.8], [1.0]] / np.linalg.norm(data, axis=1, keepdims=True)
        found = []
        for size in (1.0, 0.7):
            bezier, corrected, E = closed_forms(*size * data, n)
            above, best = excess(corrected, n)
            found.append(above / best)
        assert 7.5 < np.log(found[0] / found[1]) / np.log(1 / 0.7) < 8.5
        assert excess(bezier, n)[0] == pytest.approx(E, rel=0.1)


def test_the_eight_brackets_are_independent_on_so3():
    """No other brackets have degree three, so the derivation on SO(3) holds on every group."""
    rows = []
    for vectors in np.random.default_rng(2).integers(-3, 4, (6, 3, 3)):
        rows += np.transpose(triple_brackets(*map(as_so3, vectors), 3)).tolist()
    assert np.linalg.matrix_rank(rows) == 8
