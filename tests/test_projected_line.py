import awkward
import numpy as np
import oracles
import pytest

import rbcourse as rb
from rbcourse import straight_line as line

EPS = np.finfo(float).eps
GRID = np.meshgrid(awkward.LINE_TIMES, awkward.LINE_ANGLES, indexing="ij")


@pytest.mark.parametrize("order", [0, 1, 2, 3])
@pytest.mark.parametrize("name", ["theta", "f"])
@pytest.mark.source("BK (16)", "BK Prop. 6", "BK Cor. 1", "BK Cor. 2")
def test_theta_and_f_agree_with_the_corrected_formulas(name, order):
    grid = [x[:, 1::3] for x in GRID] if order == 3 else GRID
    want = np.vectorize(getattr(oracles, name))(*grid, order)
    off = np.abs(getattr(line, name)(*grid, order) - want)
    scale = np.abs(want)
    if (name, order) == ("theta", 3):  # rounding errors are relative to the subtracted terms
        scale += 4 * line.theta(*grid, 2) ** 2 / line.theta(*grid, 1)
    assert np.all(off <= (2 * EPS if (name, order) == ("theta", 0) else 8 * EPS * scale + 1e-60))
    assert isinstance(getattr(line, name)(0.5, 1.0, order), float)


@pytest.mark.source("BK (16)", "BK Cor. 1", "BK Cor. 2", "errata 8", "errata 9", "errata 10")
def test_the_printed_formulas_for_theta_and_f_do_not_hold():
    """The arguments of atan2 are exchanged, θ' lacks a square, and f lacks an angle on the
    right."""
    angle, t = 2.0, 0.15
    cosine, sine = 1 - t + t * np.cos(angle), t * np.sin(angle)
    assert abs(np.arctan2(sine, cosine) / angle - line.theta(t, angle)) < 2 * EPS
    assert abs(np.arctan2(cosine, sine) / angle - line.theta(t, angle)) > 0.5
    x = line.f(t, angle)
    left = np.arctan2(x * np.sin(angle), 1 - x + x * np.cos(angle))
    assert abs(left - angle * t) < 4 * EPS
    assert abs(left - t) > 0.1
    s, slope = line.line_singular_value(0.5, angle), np.sin(angle) / angle
    difference = (oracles.theta(0.5 + 1e-6, angle) - oracles.theta(0.5 - 1e-6, angle)) / 2e-6
    assert abs(slope / s**2 - difference) < 1e-9
    assert abs(slope / s - difference) > 0.5


@pytest.mark.source("BK (17)")
def test_the_singular_values_of_the_line_agree_with_the_printed_formula():
    want = np.vectorize(oracles.line_singular_value)(*GRID)
    assert np.all(np.abs(line.line_singular_value(*GRID) - want) <= 4 * EPS * want)
    for angle in (1e-6, 1.0, 3.0):
        M = np.eye(3) + 0.3 * (oracles.exp_so3(np.array([2, -1, 2]) / 3 * angle) - np.eye(3))
        s = line.line_singular_value(0.3, angle)
        assert np.abs(np.linalg.svd(M)[1] - [1, s, s]).max() < 8 * EPS


def printed_eigenvectors(w):
    """Return the second and the third printed eigenvector; the first is along w."""
    x, y, z = w
    second, third = np.array([-z, 0, x]), np.array([-y * x, z**2 + x**2, -z * y])
    size = np.sqrt(y**2 * x**2 + (z**2 + x**2) ** 2 + z**2 * y**2)
    return np.array([second / np.sqrt(z**2 + x**2), third / size])


@pytest.mark.source("BK Prop. 6", "BK (15)", "errata 5", "errata 6", "errata 7")
def test_the_printed_proof_of_the_projected_line_has_three_misprints():
    w, x = np.array([0.3, -1.2, 0.8]), 0.3
    a, W, R2, I3 = np.linalg.norm(w), rb.hat_so3(w), oracles.exp_so3(w), np.eye(3)
    N = 2 * I3 - R2 - R2.T
    printed = (1 - np.cos(a)) / a**2 * (W @ W + (W @ W).T)  # the printed sign of N
    assert np.abs(N + printed).max() < 8 * EPS
    assert np.abs(N - printed).max() > 1
    s = oracles.line_singular_value(x, a)
    g1, g2 = (1 - x + x * np.cos(a)) / s, x * np.sin(a) / s
    projected = oracles.exp_so3(w * oracles.theta(x, a))
    holds = I3 + W / a * g2 + (1 - g1) * W @ W / a**2
    assert np.abs(holds - projected).max() < 8 * EPS
    for unit in (I3, np.ones((3, 3))):  # the printed sum of a number and a matrix has two readings
        printed = I3 + W / a * g2 + (1 - g1) * unit + W @ W / a**2
        assert np.abs(printed - projected).max() > 0.1
    pairs = [(w, printed_eigenvectors(w))]
    along_y, turn = np.array([0, 1.2, 0]), oracles.exp_so3([0, 0.7, 0])
    # for w along y, the printed vectors are undefined; any pair across w is valid
    with np.errstate(invalid="ignore"):
        assert np.isnan(printed_eigenvectors(along_y)).any(axis=1).all()
    pairs += [(along_y, I3[[0, 2]]), (along_y, I3[[0, 2]] @ turn.T)]
    for w, across in pairs:
        R2, a = oracles.exp_so3(w), np.linalg.norm(w)
        moved = (2 * I3 - R2 - R2.T) @ across.T
        assert np.abs(moved - 2 * (1 - np.cos(a)) * across.T).max() < 8 * EPS


@pytest.mark.source("BK Prop. 6", "errata 7")
def test_theta_is_accurate_outside_the_unit_interval():
    outside = [(-0.5, 1.0), (1.5, 1.0), (1e6, 9.99e-10), (1e10, 9.99e-10), (-1e3, 1e-6), (1e12, 3)]
    want = np.array([oracles.theta(*one) for one in outside])
    off = np.abs(line.theta(*np.transpose(outside)) - want)
    assert np.all(off < [2 * EPS, 2 * EPS, *(4 * EPS * np.abs(want[2:]))])
    assert want[0] < 0 < 1 < want[1]


def test_theta_and_f_have_their_limits_at_angle_0():
    """Rounding may make an angle larger than π."""
    t = awkward.LINE_TIMES
    for function in (line.theta, line.f):
        for angle in (0, 1e-310):
            assert np.abs(function(t, angle) - t).max() < EPS
        assert np.abs(function(t, 0, 1) - 1).max() < 2 * EPS
        assert np.all(function(t, 0, 2) == 0)
    assert np.all(line.line_singular_value(t, 0) == 1)
    t = np.array([0, 0.1, 0.49, 0.5, 0.51, 1])
    assert np.abs(line.theta(t, np.pi) - [0, 0, 0, 0.5, 1, 1]).max() < 2 * EPS / 0.02
    assert np.abs(line.f(t, np.pi) - [0, 0.5, 0.5, 0.5, 0.5, 1]).max() < 2 * EPS
    assert 1e15 < line.theta(0.5, np.pi, 1) < 1e17
    assert 1e15 < line.f(0, np.pi, 1) < 1e17
    for function in (line.theta, line.f, line.line_singular_value):
        assert function(0.25, np.nextafter(np.pi, 4)) == function(0.25, np.pi)


def test_bad_angles_and_times_are_refused():
    for one in (line.theta, line.f):
        with pytest.raises(ValueError, match=r"^angle is 3\.2, an angle in"):
            one(0.5, 3.2)
        for order, got in ((4, "4"), (np.array([0, 1]), "array")):
            with pytest.raises(ValueError, match=f"^order: 0, 1, 2 or 3 is wanted, got {got}"):
                one(0.5, 1.0, order)
    with pytest.raises(ValueError, match=r"^t is 1.5, a time in \[0, 1\] is wanted"):
        line.f(1.5, 1.0)
