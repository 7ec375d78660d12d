"""A right sampler is as good as never refused; a wrong one is, with the reason."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from test_student_code import student

from rbclassroom.assignments.marking import Mistake
from rbclassroom.assignments.marking_samplers import DELTA, LAWS, Sampler, quantiles
from rbclassroom.assignments.student_code import NotYet

COIN = Sampler(
    shape=(),
    fault=lambda x: "outside" if np.abs(x - 0.5).max() > 0.5 else "",
    uniforms=lambda x: {"the number": x},
    mistakes=[Mistake("squared", [[quantiles(np.linspace(0, 1, 4001) ** 2)]])],
    draws=4000,
)
PROBLEMS = [Sampler(**law, mistakes=()) for law in LAWS.values()]
GENERATORS = ("PCG64", "MT19937", "Philox", "SFC64")


def draws(problem, n, rng):
    """Right draws, by SciPy."""
    if problem.shape == (3,):
        points = rng.normal(size=(n, 3))
        return points / np.linalg.norm(points, axis=1, keepdims=True)
    turns = Rotation.random(n, rng=rng)
    return turns.as_matrix() if problem.shape == (3, 3) else turns.as_quat(scalar_first=True)


@pytest.mark.parametrize("problem", PROBLEMS)
def test_the_chances_of_refusing_a_right_sampler_add_up_to_one_in_a_million(problem):
    """The law of each row is uniform, and Massart's bound holds for every number of draws."""
    rows = problem.uniforms(draws(problem, problem.draws, np.random.default_rng(3)))
    chances = [2 * np.exp(-2 * len(row) * problem._bound(rows, k) ** 2) for k, row in rows.items()]
    assert sum(chances) == pytest.approx(DELTA)
    assert DELTA <= 1e-6


@pytest.mark.parametrize("problem", PROBLEMS)
def test_right_draws_stay_well_within_the_bounds(problem):
    """If rows had other laws than the uniform one, 20 times as many draws would show it."""
    drawn = draws(problem, 20 * problem.draws, np.random.default_rng(17))
    assert not problem.fault(drawn)
    rows = problem.uniforms(drawn)
    for key, row in rows.items():
        places = np.linspace(0, 1, 1001)
        observed = np.searchsorted(np.sort(row), places) / len(row)
        assert np.abs(observed - places).max() < problem._bound(rows, key), key
        assert len(row) >= 10 * problem.draws


@pytest.mark.parametrize("name", GENERATORS)
def test_a_right_sampler_is_accepted_under_any_generator(name, capsys):
    rng = np.random.Generator(getattr(np.random, name)(5))
    assert COIN.accepts(student("def answer(rng): return rng.random()"), rng)
    assert capsys.readouterr().out == "4000 draws look as they should.\n"


def test_a_sampler_may_have_a_generator_of_its_own():
    source = "import random\nrandom.seed(3)\ndef answer(rng): return random.random()"
    assert COIN.accepts(student(source))


@pytest.mark.parametrize(
    ("body", "said"),
    [
        ("rng.random() ** 2", "squared"),
        ("rng.random() * 2", "outside"),
        ("0.3", "Every call returns the same draw"),
        ("__import__('numpy').random.default_rng(0).random()", "Every call returns the same"),
        ("rng.random(3)", "A draw has the shape (); yours has (3,)"),
        ("'x'", "Draw 0 is to be numbers; yours is x"),
        ("float('nan')", "Draw 0 is not finite: nan"),
        ("rng.random() / 2", "These draws are not uniform. What gives it away: the number"),
    ],
)
def test_what_is_wrong_with_a_sampler_is_told(body, said):
    with pytest.raises(NotYet) as refused:
        COIN.accepts(student(f"def answer(rng): return {body}"), 1)
    assert str(refused.value).startswith(said)


def test_a_wrong_draw_late_in_the_run_is_seen():
    source = """
        count = 0
        def answer(rng):
            global count
            count += 1
            return rng.random() if count < 3000 else 2.0
    """
    with pytest.raises(NotYet, match="outside"):
        COIN.accepts(student(source))


@pytest.mark.parametrize(
    ("late", "said"),
    [
        ("None", "Draw 2999 is to be numbers; yours is None. Does a branch end without return?"),
        ("float('inf')", "Draw 2999 is not finite: inf"),
        ("1 / 0", "Your function stops: ZeroDivisionError"),
    ],
)
def test_what_goes_wrong_late_is_told_too(late, said):
    source = f"""
        count = 0
        def answer(rng):
            global count
            count += 1
            return rng.random() if count < 3000 else {late}
    """
    with pytest.raises(NotYet) as refused:
        COIN.accepts(student(source))
    assert str(refused.value).startswith(said)


@pytest.mark.parametrize("step", [1, -1])
def test_of_two_mistakes_that_look_alike_the_nearer_gets_its_hint(step):
    near = [Mistake("near", [[quantiles(np.linspace(0, 1, 4001) ** 2.02)]]), *COIN.mistakes]
    alike = replace(COIN, mistakes=near[::step], draws=40_000)
    with pytest.raises(NotYet, match="squared"):
        alike.accepts(student("def answer(rng): return rng.random() ** 1.98"), 5)


def test_draws_that_are_used_twice_are_seen():
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
    with pytest.raises(NotYet, match="the angle from a draw to the next"):
        PROBLEMS[-1].accepts(student(source))
