"""Right samplers are almost never refused; refusals of wrong ones state the reason."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from test_student_code import student, told

from rbclassroom.assignments.marking import Mistake
from rbclassroom.assignments.marking_samplers import DELTA, LAWS, Sampler, quantiles

COIN = Sampler(
    shape=(),
    fault=lambda x: "outside" if np.abs(x - 0.5).max() > 0.5 else "",
    uniforms=lambda x: {"the number": x},
    mistakes=[Mistake("squared", [[quantiles(np.linspace(0, 1, 4001) ** 2)]])],
    draws=4000,
)


def draws(law, n, rng):
    """Return SciPy's draws from the right distribution."""
    if law == "direction":
        points = rng.normal(size=(n, 3))
        return points / np.linalg.norm(points, axis=1, keepdims=True)
    turns = Rotation.random(n, rng)
    return turns.as_matrix() if law == "rotation" else turns.as_quat(scalar_first=True)


@pytest.mark.parametrize("law", LAWS)
def test_right_samplers_are_refused_less_often_than_once_in_a_million(law):
    """By Massart's inequality, the probability of a refusal is at most 1e-6.

    The test makes 20 times as many draws, to detect a row that is not uniform.
    """
    problem = Sampler(**LAWS[law], mistakes=())
    drawn = draws(law, 20 * problem.draws, np.random.default_rng(17))
    assert not problem.fault(drawn)
    rows, chances = problem.uniforms(drawn), []
    for key, row in rows.items():
        places = np.linspace(0, 1, 1001)
        observed = np.searchsorted(np.sort(row), places) / len(row)
        assert np.abs(observed - places).max() < problem._bound(rows, key), key
        assert len(row) >= 10 * problem.draws
        chances.append(2 * np.exp(-2 * len(row) * problem._bound(rows, key) ** 2))
    assert sum(chances) == pytest.approx(DELTA)
    assert DELTA <= 1e-6


def test_a_right_sampler_is_accepted(capsys):
    assert COIN.accepts(student("def answer(rng): return rng.random()"), 5)
    assert capsys.readouterr().out == "The 4000 draws agree with the distribution that is wanted.\n"


def test_a_sampler_may_use_its_own_generator():
    source = "import random\nrandom.seed(3)\ndef answer(rng): return random.random()"
    assert COIN.accepts(student(source))


@pytest.mark.parametrize(
    ("body", "said"),
    [
        ("rng.random() ** 2", "squared"),
        ("rng.random() * 2", "outside"),
        ("0.3", "Every call returns the same draw"),
        ("__import__('numpy').random.default_rng(0).random()", "Every call returns the same"),
        ("rng.random(3)", "A draw should have shape (); yours has (3,)"),
        ("'x'", "Draw 0 should be numbers; yours is x"),
        ("float('nan')", "Draw 0 is not finite: nan"),
        ("rng.random() / 2", "These draws are not uniform. The distribution of the number"),
    ],
)
def test_refusals_of_wrong_samplers_state_the_reason(body, said):
    assert told(COIN, f"def answer(rng): return {body}", 1).startswith(said)


@pytest.mark.parametrize(
    ("late", "said"),
    [
        ("2.0", "outside"),
        ("None", "Draw 2999 should be numbers; yours is None. Does a branch end without return?"),
        ("float('inf')", "Draw 2999 is not finite: inf"),
        ("1 / 0", "Your function stops: ZeroDivisionError"),
    ],
)
def test_an_error_after_many_draws_is_reported(late, said):
    counted = "calls = []\ndef answer(rng):\n    calls.append(0)\n    "
    source = f"{counted}return rng.random() if len(calls) < 3000 else {late}"
    assert told(COIN, source, 1).startswith(said)


@pytest.mark.parametrize("step", [1, -1])
def test_similar_mistakes_get_their_own_hints(step):
    near = [Mistake("near", [[quantiles(np.linspace(0, 1, 4001) ** 2.02)]]), *COIN.mistakes]
    alike = replace(COIN, mistakes=near[::step], draws=40_000)
    assert told(alike, "def answer(rng): return rng.random() ** 1.98", 5) == "squared"


def test_repeated_draws_are_detected():
    source = """
        import numpy as np
        last = []
        def answer(rng):
            if last:
                return last.pop()
            q = rng.normal(size=4)
            last.append(q / np.linalg.norm(q))
            return last[0]
    """
    problem = Sampler(**LAWS["quaternion"], mistakes=())
    assert "the angle from a draw to the next" in told(problem, source, 1)


@pytest.mark.parametrize(
    ("law", "change", "said"),
    [
        ("direction", lambda p: 2 * p, "A direction should have the length 1; one of yours has 2."),
        ("quaternion", lambda q: 0.5 * q, "A unit quaternion should have the length 1"),
        ("quaternion", lambda q: q * (1 - 0.3 * q[:, :1] ** 2), "The length is between 0.71 and 1"),
        ("rotation", lambda R: -R, "The determinant is −1 for all"),
        ("rotation", lambda R: np.r_[R[:300], -R[300:]], "The determinant is −1 for 70%"),
        ("rotation", lambda R: 2 * R, "A draw is not a rotation: its singular values are [2.0, 2."),
        ("rotation", lambda R: R * [1, 1, 0.5], "A draw is not a rotation. If you reflect"),
    ],
)
def test_invalid_draws_are_described(law, change, said):
    right = draws(law, 1000, np.random.default_rng(2))
    assert LAWS[law]["fault"](change(right)).startswith(said)
    assert LAWS[law]["fault"](right) == ""
