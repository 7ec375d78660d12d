"""Each fast function against its textbook twin."""

from types import SimpleNamespace

import numpy as np
import oracles
import pytest
from scipy import integrate
from scipy.spatial.transform import Rotation

import rbcourse as rb
from rbcourse import textbook

EPS = np.finfo(float).eps
TIMES = np.linspace(0, 1, 101)
ALONG = np.pi / 6 * np.array([1, 2, 3])
PAPER = {
    "4b": (ALONG, ALONG, ALONG + np.eye(3)[0]),
    "4c": (ALONG, ALONG, ALONG + 5 * np.eye(3)[0]),
    "5": (np.pi / 6 * np.array([1, 4, 3]), np.array([1.0, 2, 3]), np.array([2.0, 1, 1])),
}


@pytest.mark.parametrize("n", [2, 3, 4])
@pytest.mark.source("BK Prop. 2")
def test_the_projection_is_the_textbooks(n):
    """To ‖M‖ over the sum of the two smallest eigenvalues of RᵀM, by which rounding grows."""
    M = np.random.default_rng(n).normal(size=(1000, n, n))
    R = textbook.project_so(M)
    condition = np.linalg.norm(M, axis=(-2, -1)) / oracles.two_smallest_eigenvalues(R.mT @ M)
    off = np.abs(rb.project_so(M) - R).max(axis=(-2, -1))
    assert np.all(off < 8 * n * EPS * (1 + condition))
    assert np.linalg.det(R).min() > 0 > np.linalg.det(M).min()


@pytest.mark.source("BK 6.1")
def test_the_geodesic_is_the_textbooks():
    for turn in (ALONG, [0, 0, 0], [1e-9, 0, 2e-9], [0, 3.14, 0], [0, 0, np.pi]):
        R0 = Rotation.random(rng=6).as_matrix()
        R1 = R0 @ rb.exp_so3(turn)
        off = np.abs(rb.geodesic_so3(R0, R1)(TIMES) - textbook.geodesic_so3(R0, R1, TIMES))
        assert off.max() < 8 * EPS


@pytest.mark.source("BK 6.2")
def test_the_projected_cubic_is_the_textbooks():
    """To eps over the least gap, its derivatives to that over its square and its cube."""
    rng = np.random.default_rng(62)
    for _ in range(40):
        ends = *Rotation.random(2, rng=rng).as_matrix(), *3 * rng.normal(size=(2, 3))
        curve = rb.projected_cubic_so3(*ends)
        size = np.linalg.norm(curve.ends, axis=(-2, -1)).sum() / min(curve.margin, 1)
        for order, want in enumerate(textbook.projected_cubic_so3(*ends, TIMES)):
            assert np.abs(curve(TIMES, order) - want).max() < 4 * EPS * size ** (1 + order)


@pytest.mark.parametrize(
    ("name", "core"), [("sample_rotation", (3, 3)), ("sample_quaternion", (4,))]
)
@pytest.mark.parametrize("count", [0, 1, 7, 8184, 20_000])
@pytest.mark.source("RR 2.1", "RR (9)", "RR (10)", "RR (11)", "RR 2.2", "RR (13)")
def test_samplers_draw_what_the_textbooks_draw(name, core, count):
    """More than a block of draws, too; and the generator is left where the textbook leaves it."""
    fast, slow = np.random.default_rng(21), np.random.default_rng(21)
    draws, want = getattr(rb, name)(count, rng=fast), getattr(textbook, name)(count, slow)
    assert draws.shape == want.shape == (count, *core)
    assert np.abs(draws - want).max(initial=0) < 8 * EPS
    assert fast.random() == slow.random()


BODY = np.diag([1, 2.2, 2.9])


@pytest.mark.parametrize(("turn", "w0", "w1"), PAPER.values(), ids=PAPER)
@pytest.mark.parametrize(
    ("name", "inertia", "bound"),
    [("minimum_acceleration_so3", (), 1e-9), ("minimum_torque_so3", (BODY,), 1e-8)],
)
@pytest.mark.source("BK (19)", "beyond BK 4")
def test_the_optima_are_the_textbooks(name, inertia, bound, turn, w0, w1):
    R0 = Rotation.random(rng=19).as_matrix()
    given = R0, R0 @ rb.exp_so3(turn), w0, w1, *inertia
    curve = getattr(rb, name)(*given)
    for order, want in enumerate(getattr(textbook, name)(*given, TIMES)):
        assert np.abs(curve(TIMES, order) - want).max() < bound * max(1, np.abs(want).max())


def test_code_is_shown_without_its_docstring(capsys):
    textbook.show(textbook.geodesic_so3)
    shown = capsys.readouterr().out
    assert shown.startswith("def geodesic_so3(")
    assert "return R0 @ exp_so3" in shown
    assert '"""' not in shown
    with pytest.raises(ValueError, match="one with a docstring is wanted"):
        textbook.show(textbook._spin)


def test_an_optimum_that_is_not_found_is_no_result(monkeypatch):
    failed = SimpleNamespace(success=False, message="too many nodes")
    monkeypatch.setattr(integrate, "solve_bvp", lambda *_, **__: failed)
    given = np.eye(3), np.eye(3), np.zeros(3), np.zeros(3)
    for call in (
        lambda: textbook.minimum_acceleration_so3(*given, np.zeros(1)),
        lambda: textbook.minimum_torque_so3(*given, np.eye(3), np.zeros(1)),
    ):
        with pytest.raises(RuntimeError, match="too many nodes"):
            call()
