"""Test the tables of the atlas, and surveys of costs on any executor."""

import subprocess
import sys
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

import rbcourse as rb
from rbclassroom.surveys import atlas, body_atlas, progress, survey
from rbclassroom.surveys.survey import costs, several_starts

SOME = atlas.random_problems(60, 3, rng=2)
# A turn of almost 180° from rest to rest. The margin of the projection is 2 cos(89.9°).
SHARP = atlas.Ends(np.eye(3)[None], rb.exp_so3([[0, 0, np.radians(179.8)]]), *np.zeros((2, 1, 3)))
FEW = atlas.Ends(*map(np.concatenate, zip(SOME.take(slice(20)), SHARP, strict=True)))
BOOK = rb.metrics.box_inertia([0.3, 0.2, 0.03])


@pytest.mark.source("BK (18)", "beyond BK 1", "beyond BK 2")
@pytest.mark.parametrize("inertia", [None, BOOK], ids=["ball", "book"])
def test_a_survey_has_the_optimum_and_the_cost_of_every_curve(inertia):
    assert rb.projected_cubic_so3(*SHARP).margin < 0.004
    found = survey.survey(FEW, inertia=inertia)
    # this call uses several threads; a survey uses one thread
    best = rb.minimum_acceleration_so3(*FEW, inertia)
    assert found.pop("optimum") == pytest.approx(best.cost, rel=1e-12)
    makers = dict(atlas.FORMS)
    if inertia is not None:
        makers["weighted"] = partial(rb.weighted_cubic_so3, inertia=inertia)
        makers["normal"] = partial(rb.normal_cubic_so3, inertia=inertia)
    assert list(found) == list(makers)
    for way, make in makers.items():
        exact = rb.acceleration_cost(make(*FEW), inertia)
        assert found[way] == pytest.approx(exact, rel=1e-6), way
        assert np.all(found[way] > (1 - 1e-6) * best.cost)


def test_a_survey_of_no_problems_is_empty():
    none = SOME.take(slice(0))
    for found in (survey.survey(none), several_starts(none)):
        assert {cost.shape for cost in found.values()} == {(0,)}


def test_the_cost_of_an_unsolved_problem_is_nan_without_a_warning():
    w0, w1 = SOME.w0[:3].copy(), SOME.w1[:3].copy()
    w0[1], w1[1] = [1e3, 0, 0], [0, 1e3, 0]
    ends = atlas.Ends(SOME.R0[:3], SOME.R1[:3], w0, w1)
    found = survey.survey(ends, ways={"exponential": rb.exponential_cubic_so3})
    assert np.isnan(found["optimum"]).tolist() == [False, True, False]
    assert np.isfinite(found["exponential"]).all()


@pytest.mark.source("BK (19)")
def test_solving_from_several_starts_finds_no_cheaper_curve():
    """A solver that starts from the projected cubic turns the wrong way in many of these
    problems."""
    used, found = rb.minimum_acceleration_so3(*SOME).cost, several_starts(SOME)
    left_out = "corrected", "Cayley"
    assert list(found) == [*(way for way in atlas.WAYS if way not in left_out), "long way round"]
    lowest = np.nanmin(list(found.values()), axis=0)
    assert used == pytest.approx(np.minimum(used, lowest), rel=1e-9)
    assert 5 < np.sum(found["projection"] > lowest * (1 + 1e-6)) < 30


class Backwards(Executor):
    """An executor of one worker that runs the last submitted task first."""

    def __init__(self):
        self.waiting = []

    def submit(self, work, /, *arguments):
        future = Future()
        self.waiting.append((future, partial(work, *arguments)))
        if len(self.waiting) == 3:
            for one, call in reversed(self.waiting):
                one.set_result(call())
        return future


def test_every_executor_gives_the_same_bytes(monkeypatch):
    monkeypatch.setattr(survey, "CHUNK", 5)
    monkeypatch.setattr(survey, "processes", partial(survey.processes, 1))
    known, told, found = {"inertia": BOOK, "ways": {"Bézier": rb.bezier_so3}}, [], []
    with ThreadPoolExecutor(3) as threads:
        for executor in (None, threads, Backwards()):
            few, report = SOME.take(slice(15)), lambda *done: told.append(done)
            costs = survey.survey(few, executor, **known, report=report)
            found.append({name: x.tobytes() for name, x in costs.items()})
    assert found[0] == found[1] == found[2]
    assert told == 3 * [(5, 15), (10, 15), (15, 15)]


def refuses(*ends):
    raise ValueError("no curve")


@pytest.mark.parametrize(("chunk", "first"), [(20, "0|20|40"), (60, "0")])
def test_an_error_in_a_survey_names_the_curve(monkeypatch, chunk, first):
    monkeypatch.setattr(survey, "CHUNK", chunk)
    said = rf"^chunk from problem ({first}) on: none: no curve"
    ways = {"projection": atlas.projection, "none": refuses}
    with ThreadPoolExecutor(2) as threads, pytest.raises(ValueError, match=said):
        survey.survey(SOME, threads if chunk < 60 else None, ways=ways)


@pytest.mark.parametrize(
    ("bad", "said"),
    [
        ({"problems": SOME.take(0)}, r"^problems: one batch axis is wanted, got \(\)"),
        ({"inertia": np.stack([BOOK, BOOK])}, r"^inertia"),
        ({"inertia": [1, 2, 3]}, r"^inertia"),
        ({"inertia": -BOOK}, r"^inertia is not positive definite"),
        ({"ways": {"optimum": rb.bezier_so3}}, r"^ways: names other than 'optimum'"),
        ({"ways": {"g": rb.geodesic_so3}}, r"^ways: make\(R0, R1, w0, w1\) is wanted, got .g"),
        ({"ways": {"five": 5}}, r"^ways: make\(R0, R1, w0, w1\) is wanted, got 'five': 5 is"),
    ],
)
def test_bad_arguments_are_refused_before_anything_is_computed(bad, said):
    def reported(*done):
        raise AssertionError

    with pytest.raises(ValueError, match=said):
        survey.survey(**{"problems": SOME, **bad}, report=reported)


def test_functions_that_cannot_be_pickled_run_only_in_this_process(monkeypatch):
    ways = {"own": lambda *ends: atlas.projection(*ends)}
    found = survey.survey(SOME, ways=ways)
    assert np.array_equal(found["own"], costs(atlas.projection, SOME))
    monkeypatch.setattr(survey, "CHUNK", 20)
    with pytest.raises(ValueError, match=r"^ways: functions of a module"):
        survey.survey(SOME, ways=ways)
    with ThreadPoolExecutor(2) as threads:
        again = survey.survey(SOME, threads, ways=ways)
    assert again["own"] == pytest.approx(found["own"], rel=1e-12)


@pytest.mark.parametrize(
    "make",
    [
        lambda *ends: rb.retime(rb.exponential_cubic_so3(*ends), 2.0),
        lambda R0, R1, w0, w1: rb.geodesic_se3(*np.tile(np.eye(4), (2, 60, 1, 1))),
        lambda *ends: rb.bezier_so3(*(x[0] for x in ends)),
        lambda *ends: None,
    ],
)
def test_a_maker_must_return_one_curve_for_each_problem(make):
    with pytest.raises(ValueError, match=r"^make: one curve on SO\(3\) and \[0, 1\] per"):
        costs(make, SOME)


KILLED = """
import sys
from rbclassroom.surveys.survey import processes
if __name__ == "__main__":
    with processes(1) as pool:
        pool.submit(print, "begun", flush=True).result()
        sys.stdin.read()
"""


def test_processes_end_when_their_parent_is_killed(tmp_path):
    """The pipe of the parent's output stays open until the worker processes end."""
    script = tmp_path / "parent.py"
    script.write_text(KILLED)
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
    with subprocess.Popen([sys.executable, script], text=True, **pipes) as job:
        assert job.stdout.readline() == "begun\n"
        job.kill()
        assert job.communicate(timeout=600)[0] == ""


def test_the_maps_use_only_the_first_seed(tmp_path, monkeypatch):
    surveyed = []

    def made_up(problems, executor, *, inertia, ways, report):
        surveyed.append((executor, problems.w0[0, 0], inertia[0, 0]))
        report(len(problems.w0), len(problems.w0))
        rng = np.random.default_rng(len(surveyed))
        return {name: 1000 + rng.random(len(problems.w0)) for name in ["optimum", *ways]}

    monkeypatch.setattr(body_atlas, "survey", made_up)
    monkeypatch.setattr(body_atlas, "DOMAINS", {"all": 10})
    monkeypatch.setattr(body_atlas, "TABLES", tmp_path)
    body_atlas.make_tables("executor", tmp_path, 1, [5, 6])
    assert len(set(surveyed)) == 6
    assert {executor for executor, *_ in surveyed} == {"executor"}
    assert len(body_atlas.stored("maps")["body"]) == 300  # this table is from the first seed
    assert body_atlas.stored("intervals")["seed [1]"].tolist() == [5] * 33 + [6] * 33


def test_a_progress_bar_grows(monkeypatch):
    stages = []
    handle = SimpleNamespace(update=lambda stage, raw: stages.append(stage))
    shown = {"display": lambda stage, **_: stages.append(stage) or handle}
    ipython = SimpleNamespace(get_ipython=object, display=SimpleNamespace(**shown))
    monkeypatch.setitem(sys.modules, "IPython", ipython)
    report = progress.bar("A < B")
    report(5000, 20_000)
    report(20_000, 20_000)
    assert [stage["text/plain"] for stage in stages][1] == "A < B: 20,000 of 20,000"
    assert [stage["text/html"] for stage in stages] == [
        '<div><progress max="20000" value="5000"></progress> A &lt; B: 5,000 of 20,000</div>',
        "<div>A &lt; B: 20,000 of 20,000</div>",
    ]
