"""Surveys: costs of curves, on any executor, and an atlas that goes on when it was stopped."""

import signal
import subprocess
import sys
import time
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import rbcourse as rb
from rbclassroom.surveys import atlas, survey
from rbclassroom.surveys.survey import costs, processes, several_starts

SOME = atlas.random_problems(60, 3, rng=2)
BOOK = rb.metrics.box_inertia([0.3, 0.2, 0.03])


@pytest.mark.source("BK (18)")
@pytest.mark.parametrize("way", atlas.WAYS)
def test_costs_are_the_integral(way):
    make = atlas.WAYS[way]
    found = costs(make, SOME.take(slice(20)))
    for k in range(20):
        exact = rb.acceleration_cost(make(*(x[k] for x in SOME)))
        assert found[k] == pytest.approx(exact, rel=1e-6)


@pytest.mark.source("beyond BK 1")
@pytest.mark.parametrize("way", ["weighted", "normal", "Bézier"])
def test_costs_of_a_body_are_the_integral(way):
    make = atlas.closed_forms(BOOK)[way]
    found = costs(make, SOME.take(slice(10)), BOOK)
    for k in range(10):
        exact = rb.acceleration_cost(make(*(x[k] for x in SOME)), BOOK)
        assert found[k] == pytest.approx(exact, rel=1e-6)


def test_a_projection_that_all_but_jumps_is_integrated_too():
    """A turn from rest by a little less than 180°: the margin is 2 cos(89.9°)."""
    turn, rest = np.radians([[0, 0, 179.8]]), np.zeros((1, 3))
    ends = atlas.Ends(np.eye(3)[None], rb.exp_so3(turn), rest, rest)
    curve = rb.projected_cubic_so3(*(x[0] for x in ends))
    assert curve.margin < 0.004
    found = costs(atlas.projection, ends)[0]
    assert found == pytest.approx(rb.acceleration_cost(curve), rel=1e-6)


def test_a_survey_has_the_optimum_and_every_way():
    found = survey.survey(SOME)
    assert list(found) == ["optimum", *atlas.WAYS]
    assert np.array_equal(found["optimum"], rb.minimum_acceleration_so3(*SOME).cost)
    for way, make in atlas.WAYS.items():
        assert np.array_equal(found[way], costs(make, SOME))
        assert np.all(found[way] > (1 - 1e-6) * found["optimum"])


@pytest.mark.source("beyond BK 2")
def test_a_survey_of_a_body_has_its_optimum_and_what_knows_the_body():
    few = SOME.take(slice(20))
    found = survey.survey(few, inertia=BOOK)
    assert list(found) == ["optimum", *atlas.WAYS, "weighted", "normal"]
    best = rb.minimum_acceleration_so3(*few, BOOK)  # not on one thread, as in a survey
    assert found["optimum"] == pytest.approx(best.cost, rel=1e-12)
    for way in atlas.WAYS:
        assert np.array_equal(found[way], costs(atlas.WAYS[way], few, BOOK))


def test_a_survey_tells_how_far_it_is():
    told = []
    few = atlas.random_problems(1100, 1, rng=1)
    survey.survey(few, report=lambda *done: told.append(done), ways={})
    assert sorted(total for _, total in told) == [1100] * 3
    assert told[-1][0] == 1100
    assert np.diff([0, *(done for done, _ in told)]).tolist().count(500) == 2


def test_a_survey_of_nothing_is_empty():
    none = SOME.take(slice(0))
    for found in (survey.survey(none), several_starts(none)):
        assert {cost.shape for cost in found.values()} == {(0,)}


def test_a_single_problem_is_refused():
    with pytest.raises(ValueError, match=r"^problems: one batch axis is wanted, got \(\)"):
        survey.survey(SOME.take(0))


def test_what_is_not_found_is_nan_and_silent():
    w0, w1 = SOME.w0[:3].copy(), SOME.w1[:3].copy()
    w0[1], w1[1] = [1e3, 0, 0], [0, 1e3, 0]
    ends = atlas.Ends(SOME.R0[:3], SOME.R1[:3], w0, w1)
    found = survey.survey(ends, ways={"exponential": rb.exponential_cubic_so3})
    assert np.isnan(found["optimum"]).tolist() == [False, True, False]
    assert np.isfinite(found["exponential"]).all()


@pytest.mark.source("BK (19)")
def test_the_optimum_is_the_lowest_of_several_starts():
    """From the projected cubic the solver turns the wrong way round in a good part of them."""
    used, found = rb.minimum_acceleration_so3(*SOME).cost, several_starts(SOME)
    left_out = "corrected", "Cayley"
    assert list(found) == [*(way for way in atlas.WAYS if way not in left_out), "long way round"]
    lowest = np.nanmin(list(found.values()), axis=0)
    assert used == pytest.approx(np.minimum(used, lowest), rel=1e-9)
    assert 5 < np.sum(found["projection"] > lowest * (1 + 1e-6)) < 30


class Backwards(Executor):
    """An executor of one worker that does what is submitted last first."""

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
    monkeypatch.setattr(survey, "CHUNK", 20)
    of_body = partial(survey.survey, SOME, inertia=BOOK, ways={"Bézier": rb.bezier_so3})
    expected = of_body()
    with processes(1) as one, ThreadPoolExecutor(3) as threads:
        for executor in (one, threads, Backwards()):
            found = of_body(executor)
            assert {name: x.tobytes() for name, x in found.items()} == {
                name: x.tobytes() for name, x in expected.items()
            }


def test_a_cluster_gives_the_same_bytes(monkeypatch):
    distributed = pytest.importorskip("distributed")
    monkeypatch.setattr(survey, "CHUNK", 20)
    cluster = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": None}
    with distributed.Client(**cluster) as client:
        found = survey.survey(SOME, client.get_executor(), inertia=BOOK)
    for name, x in survey.survey(SOME, inertia=BOOK).items():
        assert x.tobytes() == found[name].tobytes()


def refuses(*ends):
    raise ValueError("no curve")


@pytest.mark.parametrize("chunk", [20, 60])
def test_an_error_ends_a_survey_and_names_the_way(monkeypatch, chunk):
    monkeypatch.setattr(survey, "CHUNK", chunk)
    said = r"^chunk \d, from problem (0|20|40) on: none: no curve"
    with pytest.raises(ValueError, match=said):
        survey.survey(SOME, ways={"projection": atlas.projection, "none": refuses})


@pytest.mark.parametrize(
    ("bad", "said"),
    [
        ({"inertia": np.stack([BOOK, BOOK])}, r"^inertia"),
        ({"inertia": [1, 2, 3]}, r"^inertia"),
        ({"inertia": -BOOK}, r"^inertia is not positive definite"),
        ({"ways": {"optimum": rb.bezier_so3}}, r"^ways: 'optimum' is the name"),
        ({"ways": {"g": rb.geodesic_so3}}, r"^ways: 'g' is called with R0, R1, w0, w1: too many"),
        ({"ways": {"five": 5}}, r"^ways: 'five' is no function"),
    ],
)
def test_bad_arguments_are_named_before_anything_is_computed(bad, said):
    def reported(*done):
        raise AssertionError

    with pytest.raises(ValueError, match=said):
        survey.survey(SOME, **bad, report=reported)


def test_what_cannot_be_sent_is_refused_and_stays_here(monkeypatch):
    ways = {"own": lambda *ends: atlas.projection(*ends)}
    found = survey.survey(SOME, ways=ways)
    assert np.array_equal(found["own"], costs(atlas.projection, SOME))
    monkeypatch.setattr(survey, "CHUNK", 20)
    with pytest.raises(ValueError, match=r"^ways: functions of a module"):
        survey.survey(SOME, ways=ways)
    with ThreadPoolExecutor(2) as threads:
        again = survey.survey(SOME, threads, ways=ways)
    assert again["own"] == pytest.approx(found["own"], rel=1e-12)


REST = np.zeros(3)


@pytest.mark.parametrize(
    "make",
    [
        lambda *ends: rb.retime(rb.exponential_cubic_so3(*ends), 2.0),
        lambda R0, R1, *w: rb.geodesic_se3(*(rb.pose_from_components(R, REST) for R in (R0, R1))),
        lambda *ends: rb.bezier_so3(*(x[0] for x in ends)),
        lambda *ends: None,
    ],
)
def test_what_is_no_curve_for_each_problem_is_refused(make):
    with pytest.raises(ValueError, match=r"^make: curves on SO\(3\) and \[0, 1\] are wanted"):
        costs(make, SOME)


STOPPED = """
import sys
from rbclassroom.surveys import body_atlas, survey
from pathlib import Path
if __name__ == "__main__":
    survey.CHUNK = 50
    with survey.processes(2) as pool:
        body_atlas.make_tables(*map(Path, sys.argv[1:]), draws=1, seeds=[5, 6], executor=pool)
"""
TABLES = "atlas_maps.csv", "atlas_intervals.csv"


def runs(process):
    try:
        state = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"


@pytest.mark.skipif(not Path("/proc").exists(), reason="looks for processes in /proc")
def test_an_atlas_that_was_killed_goes_on_and_gives_the_same_bytes(tmp_path):
    script = tmp_path / "atlas.py"
    script.write_text(STOPPED)

    def start(name):
        (tmp_path / name).mkdir(exist_ok=True)
        words = [sys.executable, str(script), str(tmp_path / f"chunks-{name}"), tmp_path / name]
        return subprocess.Popen(words, stderr=subprocess.DEVNULL)

    job, chunks = start("stopped"), tmp_path / "chunks-stopped"
    while len(list(chunks.glob("*.npz"))) < 2:
        assert job.poll() is None
        time.sleep(0.01)
    workers = Path(f"/proc/{job.pid}/task/{job.pid}/children").read_text().split()
    assert len(workers) >= 2
    job.send_signal(signal.SIGKILL)
    job.wait()
    done = {path: path.stat().st_mtime_ns for path in chunks.glob("*.npz")}
    assert not list((tmp_path / "stopped").iterdir())
    patience = time.monotonic() + 60
    while any(map(runs, workers)):
        assert time.monotonic() < patience
        time.sleep(0.01)
    job = start("stopped")
    while len(now := list(chunks.glob("*.npz"))) <= len(done):
        assert job.poll() is None
        time.sleep(0.01)
    assert {path: path.stat().st_mtime_ns for path in now if path in done} == done
    assert job.wait() == 0
    assert start("whole").wait() == 0
    for table in TABLES:
        assert (tmp_path / "stopped" / table).read_bytes() == (
            tmp_path / "whole" / table
        ).read_bytes()
    assert not list(chunks.iterdir())
