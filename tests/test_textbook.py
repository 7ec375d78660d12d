from types import SimpleNamespace

import numpy as np
import pytest
from optima import ALONG, PAPER
from scipy import integrate
from scipy.spatial.transform import Rotation

import rbcourse as rb
from rbcourse import textbook

EPS = np.finfo(float).eps
TIMES = np.linspace(0, 1, 101)


@pytest.mark.source("BK 6.1")
def test_the_geodesic_agrees_with_the_textbook():
    for turn in (ALONG, [0, 0, 0], [1e-9, 0, 2e-9], [0, 3.14, 0], [0, 0, np.pi]):
        R0 = Rotation.random(None, 6).as_matrix()
        R1 = R0 @ rb.exp_so3(turn)
        off = np.abs(rb.geodesic(R0, R1)(TIMES) - textbook.geodesic(R0, R1, TIMES))
        assert off.max() < 8 * EPS


@pytest.mark.source("BK 6.2")
def test_the_projected_cubic_agrees_with_the_textbook():
    """The error of derivative k is of order eps/gap^(k + 1), where gap is the least gap."""
    rng = np.random.default_rng(62)
    for _ in range(15):
        ends = *Rotation.random(2, rng).as_matrix(), *3 * rng.normal(size=(2, 3))
        curve = rb.projected_cubic(*ends)
        size = np.linalg.norm(curve.ends, axis=(-2, -1)).sum() / min(curve.margin, 1)
        for order, want in enumerate(textbook.projected_cubic(*ends, TIMES)):
            assert np.abs(curve(TIMES, order) - want).max() < 4 * EPS * size ** (1 + order)


@pytest.mark.parametrize(("turn", "w0", "w1"), [PAPER["4c"], PAPER["5"]])
@pytest.mark.source("BK (19)", "beyond BK 4")
def test_the_optima_agree_with_the_textbook(turn, w0, w1):
    R0, G = Rotation.random(None, 19).as_matrix(), np.diag([1, 2.2, 2.9])
    ends = R0, R0 @ rb.exp_so3(turn), w0, w1
    for curve, values, bound in (
        (rb.minimum_acceleration(*ends), textbook.minimum_acceleration(*ends, TIMES), 1e-9),
        (rb.minimum_torque(*ends, body=rb.Body(G)), textbook.minimum_torque(*ends, G, TIMES), 1e-8),
    ):
        for order, want in enumerate(values):
            assert np.abs(curve(TIMES, order) - want).max() < bound * max(1, np.abs(want).max())


@pytest.mark.source("beyond BK 17")
@pytest.mark.parametrize("turn", [0.05, 0.3])
def test_smoothing_splines_agree_with_the_textbook(turn):
    rng = np.random.default_rng(17)
    times = np.cumsum(rng.uniform(0.5, 1.5, 30))
    t = np.linspace(times[0], times[-1], 99)
    vectors = turn * np.stack([7 * np.sin(times / 7), times, 5 * np.cos(times / 5)], axis=-1)
    R = rb.exp_so3(vectors) @ rb.exp_so3(0.02 * rng.normal(size=(30, 3)))
    c = rb.smoothing_spline(times, R, period=8)
    smoothing = (8 / (2 * np.pi)) ** 4 / np.diff(times).mean()
    assert np.abs(c(t) - textbook.smoothing_spline(times, R, smoothing, t)).max() < 1e-12


@pytest.mark.source("BK (20)", "BK 6.2", "BK Fig. 4", "BK Fig. 5")
@pytest.mark.parametrize("case", PAPER)
def test_shooting_reaches_the_optimum(case):
    turn, w0, w1 = PAPER[case]
    R0 = Rotation.random(None, 20).as_matrix()
    ends = R0, R0 @ rb.exp_so3(turn), w0, w1
    best = rb.minimum_acceleration(*ends)
    *found, corrections = textbook.shoot(*ends, TIMES)
    for order, values in enumerate(found):
        assert np.abs(best(TIMES, order) - values).max() < 1e-9
    assert 0 < corrections < 5


def test_shooting_says_when_it_fails():
    R1, slow, fast = rb.exp_so3([0, 0, 1]), np.array([9.4, 0, 0]), np.array([0, 3 * np.pi, 0])
    for name, w in (("v0", (fast, slow)), ("v1", (slow, fast))):
        with pytest.raises(ValueError, match=f"^{name}: an angle .* below 3π is wanted, got 9.425"):
            textbook.shoot(np.eye(3), R1, *w, TIMES)
    with pytest.raises(RuntimeError, match=r"^the motion misses its end by \S+ after 20"):
        textbook.shoot(np.eye(3), R1, slow, slow[[1, 0, 2]], TIMES)


def test_an_optimum_that_is_not_found_raises_an_error(monkeypatch):
    failed = SimpleNamespace(success=False, message="too many nodes")
    monkeypatch.setattr(integrate, "solve_bvp", lambda *_, **__: failed)
    given, times = (np.eye(3), np.eye(3), np.zeros(3), np.zeros(3)), np.zeros(1)
    for name, body in (("minimum_acceleration", ()), ("minimum_torque", [np.eye(3)])):
        with pytest.raises(RuntimeError, match="too many nodes"):
            getattr(textbook, name)(*given, *body, times)


def test_show_refuses_a_function_without_a_docstring():
    with pytest.raises(ValueError, match="one with a docstring is wanted"):
        textbook.show(textbook._spin)
