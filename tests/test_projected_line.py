import awkward
import numpy as np
import oracles
import pytest

import rbcourse as rb
from rbcourse import projected_line as line

EPS = np.finfo(float).eps
GRID = np.meshgrid(awkward.LINE_TIMES, awkward.LINE_ANGLES, indexing="ij")


def exact(name, order):
    oracle = np.vectorize(getattr(oracles, name))
    return oracle(*GRID, order)


@pytest.mark.source("BK (16)", "BK Prop. 6")
def test_theta_is_the_angle_of_the_printed_point():
    assert np.abs(line.theta(*GRID) - exact("theta", 0)).max() < 2 * EPS


@pytest.mark.parametrize(
    ("name", "order"), [("theta", 1), ("theta", 2), ("f", 0), ("f", 1), ("f", 2)]
)
@pytest.mark.source("BK Cor. 1", "BK Cor. 2")
def test_the_derivatives_of_theta_and_f_and_its_derivatives(name, order):
    want = exact(name, order)
    off = np.abs(getattr(line, name)(*GRID, order) - want)
    assert np.all(off <= 8 * EPS * np.abs(want) + 1e-60)


@pytest.mark.source("BK Cor. 2")
def test_theta_undoes_f():
    t, angle = GRID
    error = np.abs(line.theta(line.f(t, angle), angle) - t)
    assert np.all(error <= 4 * EPS * np.maximum(1, 2 * np.tan(angle / 2) / angle))
    assert all(isinstance(one(0.5, 1.0), float) for one in (line.theta, line.f))


@pytest.mark.source("BK Cor. 2", "errata 10")
def test_the_equation_for_f_holds_with_the_angle_on_its_right_and_not_as_printed():
    angle, t = 2.0, 0.3
    x = line.f(t, angle)
    left = np.arctan2(x * np.sin(angle), 1 - x + x * np.cos(angle))
    assert abs(left - angle * t) < 4 * EPS
    assert abs(left - t) > 0.1


@pytest.mark.source("BK Cor. 1", "errata 9")
def test_the_printed_derivative_of_theta_lacks_a_square():
    t, angle = 0.5, 2.0
    s, slope = line.line_singular_value(t, angle), np.sin(angle) / angle
    difference = (oracles.theta(t + 1e-6, angle) - oracles.theta(t - 1e-6, angle)) / 2e-6
    assert abs(slope / s**2 - difference) < 1e-9
    assert abs(slope / s - difference) > 0.5


@pytest.mark.source("BK (16)", "errata 8")
def test_the_printed_order_of_atan2_is_cosine_first():
    x, angle = 0.3, 1.0
    cosine, sine = 1 - x + x * np.cos(angle), x * np.sin(angle)
    assert abs(np.arctan2(sine, cosine) / angle - line.theta(x, angle)) < 2 * EPS
    assert abs(np.arctan2(cosine, sine) / angle - line.theta(x, angle)) > 0.5


@pytest.mark.source("BK (17)")
def test_the_singular_values_of_the_line():
    want = np.vectorize(oracles.line_singular_value)(*GRID)
    assert np.all(np.abs(line.line_singular_value(*GRID) - want) <= 4 * EPS * want)
    for angle in (1e-6, 1.0, 3.0):
        M = np.eye(3) + 0.3 * (oracles.exp_so3(np.array([2, -1, 2]) / 3 * angle) - np.eye(3))
        s = line.line_singular_value(0.3, angle)
        assert np.abs(np.linalg.svd(M)[1] - [1, s, s]).max() < 8 * EPS


@pytest.mark.source("BK Cor. 1", "BK Cor. 2")
def test_theta_and_f_are_symmetric_about_the_middle():
    angle = awkward.LINE_ANGLES
    assert np.all(line.theta(0.5, angle) == 0.5)
    assert np.abs(line.f(0.5, angle) - 0.5).max() < EPS
    t = np.arange(9)[:, None] / 16  # whose distance from 1 is exact
    for function in (line.theta, line.f):
        assert np.abs(function(t, angle) + function(1 - t, angle) - 1).max() < 4 * EPS


@pytest.mark.source("BK Prop. 6", "errata 5")
def test_the_printed_sign_of_N_in_the_proof():
    w = np.array([0.3, -1.2, 0.8])
    a, W, R2 = np.linalg.norm(w), rb.hat_so3(w), oracles.exp_so3(w)
    N = 2 * np.eye(3) - R2 - R2.T
    printed = (1 - np.cos(a)) / a**2 * (W @ W + (W @ W).T)
    assert np.abs(N + printed).max() < 8 * EPS
    assert np.abs(N - printed).max() > 1
    across = printed_eigenvectors(w).T
    assert np.abs(N @ across - 2 * (1 - np.cos(a)) * across).max() < 8 * EPS


def printed_eigenvectors(w):
    """The second and the third; the first is along w."""
    x, y, z = w
    second = np.array([-z, 0, x]) / np.sqrt(z**2 + x**2)
    third = np.array([-y * x, z**2 + x**2, -z * y])
    third = third / np.sqrt(y**2 * x**2 + (z**2 + x**2) ** 2 + z**2 * y**2)
    return np.array([second, third])


@pytest.mark.source("BK Prop. 6", "errata 7")
def test_the_printed_eigenvectors_of_N_are_undefined_where_any_pair_serves():
    w = np.array([0, 1.2, 0])
    with np.errstate(invalid="ignore"):
        assert np.isnan(printed_eigenvectors(w)).any(axis=1).all()
    R2 = oracles.exp_so3(w)
    N, turn = 2 * np.eye(3) - R2 - R2.T, oracles.exp_so3([0, 0.7, 0])
    for across in (np.eye(3)[[0, 2]], np.eye(3)[[0, 2]] @ turn.T):
        assert np.abs(N @ across.T - 2 * (1 - np.cos(1.2)) * across.T).max() < 8 * EPS


@pytest.mark.source("BK Prop. 6", "BK (15)", "errata 6")
def test_the_printed_product_in_the_proof_has_a_plus_too_many():
    w, x = np.array([0.3, -1.2, 0.8]), 0.3
    a, W = np.linalg.norm(w), rb.hat_so3(w)
    s = oracles.line_singular_value(x, a)
    g1, g2 = (1 - x + x * np.cos(a)) / s, x * np.sin(a) / s
    projected = oracles.exp_so3(w * oracles.theta(x, a))
    holds = np.eye(3) + W / a * g2 + (1 - g1) * W @ W / a**2
    assert np.abs(holds - projected).max() < 8 * EPS
    for unit in (np.eye(3), np.ones((3, 3))):  # either reading of a number plus a matrix
        printed = np.eye(3) + W / a * g2 + (1 - g1) * unit + W @ W / a**2
        assert np.abs(printed - projected).max() > 0.1


@pytest.mark.source("BK Prop. 6", "errata 7")
def test_theta_leaves_the_unit_interval_where_f_does_and_far_from_the_line():
    outside = [(-0.5, 1.0), (1.5, 1.0), (1e6, 9.99e-10), (1e10, 9.99e-10), (-1e3, 1e-6), (1e12, 3)]
    want = np.array([oracles.theta(*one) for one in outside])
    off = np.abs(line.theta(*np.transpose(outside)) - want)
    assert np.all(off < [2 * EPS, 2 * EPS, *(4 * EPS * np.abs(want[2:]))])
    assert want[0] < 0 < 1 < want[1]


def test_angle_0_is_the_limit():
    t = awkward.LINE_TIMES
    for function in (line.theta, line.f):
        assert np.abs(function(t, 0) - t).max() < EPS
        assert np.abs(function(t, 0, 1) - 1).max() < 2 * EPS
        assert np.all(function(t, 0, 2) == 0)
        assert np.abs(function(t, 1e-310) - t).max() < EPS
    assert np.all(line.line_singular_value(t, 0) == 1)


def test_angle_pi_is_the_step_also_if_it_is_larger_by_rounding():
    t = np.array([0, 0.1, 0.49, 0.5, 0.51, 1])
    assert np.abs(line.theta(t, np.pi) - [0, 0, 0, 0.5, 1, 1]).max() < 2 * EPS / 0.02
    assert np.abs(line.f(t, np.pi) - [0, 0.5, 0.5, 0.5, 0.5, 1]).max() < 2 * EPS
    assert 1e15 < line.theta(0.5, np.pi, 1) < 1e17
    assert 1e15 < line.f(0, np.pi, 1) < 1e17
    for function in (line.theta, line.f, line.line_singular_value):
        assert function(0.25, np.nextafter(np.pi, 4)) == function(0.25, np.pi)


@pytest.mark.parametrize(
    ("functions", "arguments", "message"),
    [
        ("theta f", (0.5, 3.2), r"angle is 3\.2, an angle in"),
        ("theta f", (0.5, 1.0, 4), "order: 0, 1, 2 or 3 wanted, got 4"),
        ("theta f", (0.5, 1.0, np.array([0, 1])), "order: 0, 1, 2 or 3 wanted, got array"),
        ("f", ([0, 1], [1, 2, 3]), r"batch shapes do not broadcast: t \(2,\), angle \(3,\)"),
        ("f", ([0, np.nan], 1.0), r"t\[1\] is nan"),
        ("f", (1.5, 1.0), r"t is 1.5, a time in \[0, 1\] is wanted"),
    ],
)
def test_bad_arguments_are_named(functions, arguments, message):
    for name in functions.split():
        with pytest.raises(ValueError, match=message):
            getattr(line, name)(*arguments)
