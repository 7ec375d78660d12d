"""The benchmarks run and agree, and the README says what they found. Nothing is timed here."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

from benchmarks import __main__ as bench
from benchmarks import contests, figure, report, timing
from benchmarks.contests import CONTESTS, OURS

ONCE = {"loop": 0, "total": 0, "fewest": 1, "most": 1}
STORED = report.README.parent / "benchmarks/benchmarks.csv"


class Clock:
    """A clock that goes on when a call says so."""

    def __init__(self):
        self.now, self.load, self.calls = 0.0, 1.0, 0

    def __call__(self):
        return self.now

    def call(self, seconds, grows=1):
        def takes():
            self.now += seconds * self.load
            self.load *= grows
            self.calls += 1

        return takes


def test_every_round_has_all_calls_under_the_same_load():
    """When the machine gets twice as slow from turn to turn, all methods of a round do."""
    clock = Clock()
    calls = [clock.call(1), clock.call(3, grows=2)]
    times = timing.in_turn(calls, loop=1, total=16, fewest=1, most=9, clock=clock)
    assert times == pytest.approx(4 * np.outer(2.0 ** np.arange(4), [1, 3]))


@pytest.mark.parametrize(("total", "rounds"), [(0, 2), (35, 3), (1000, 5)])
def test_the_rounds_take_what_time_there_is_within_bounds(total, rounds):
    clock = Clock()
    calls = [clock.call(10), clock.call(1)]
    assert len(timing.in_turn(calls, 0.1, total, 2, 5, clock)) == rounds


def test_a_short_call_is_repeated_and_told_for_one():
    clock = Clock()
    times = timing.in_turn([clock.call(0.001)], 0.02, 0, 2, 2, clock)
    assert clock.calls == 2 + 2 * 20
    assert times == pytest.approx(np.full((2, 1), 0.001))


def test_times_are_of_one_item():
    clock = Clock()
    ours, other = (clock.call(seconds) for seconds in (6, 4))
    methods = {OURS: contests.Method("", ours, items=3), "other": contests.Method("", other)}
    contest = contests.Contest("task", "", (3,), None, lambda n, rng: (methods, None))
    rows = timing.compete(contest, 3, None, "here", **ONCE, clock=clock)
    assert [row["time [s]"] for row in rows] == [2, 4]
    assert [row["times ours [1]"] for row in rows] == [1, 2]


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    """The folder of a run of every task at the smallest sizes, one round each."""
    folder = tmp_path_factory.mktemp("run")
    text = "before\n<!-- benchmarks -->\nold\n<!-- end of benchmarks -->\nafter\n"
    (folder / "README.md").write_text(text)
    small = [c._replace(sizes=tuple(dict.fromkeys(min(n, 2) for n in c.sizes))) for c in CONTESTS]
    bench.main(small, folder, folder / "README.md", **ONCE)
    yield folder
    plt.close("all")


@pytest.fixture(scope="module")
def rows(ran):
    return report.read_csv(ran / "benchmarks.csv")


def test_every_task_has_ours_first_and_others(rows):
    for task in {contest.task for contest in CONTESTS}:
        names = [row["method"] for row in rows if row["task"] == task]
        assert names[0] == OURS
        assert len(set(names)) > 1, task


def test_results_agree_and_times_are_in_order(rows):
    bounds = {(contest.task, contest.case): contest.bound for contest in CONTESTS}
    for row in rows:
        bound, error = bounds[row["task"], row["case"]], row["error [1]"]
        polar = row["call"] == "robust_polar_decomposition"  # 20 iterations, which is too few
        assert error is None or error <= (1e-2 if polar else bound), row
        assert (error is None) <= (bound is None or row["method"] != OURS)
        assert 0 < row["time low [s]"] <= row["time [s]"] <= row["time high [s]"]
        assert (row["method"] == OURS) <= (row["times ours [1]"] == 1)


def test_wrong_results_have_errors_above_the_bound():
    contest = CONTESTS[0]
    _, error = contest.make(3, np.random.default_rng(3))
    assert error(np.broadcast_to(np.eye(3), (3, 3, 3))) > 0.1
    row = {"method": "", "time [s]": 1.0, "times ours [1]": 1.0}
    assert "LARGER" in report.line(row | {"error [1]": np.nan}, 1.0)
    assert "LARGER" not in report.line(row | {"error [1]": 0.5}, 1.0)


def test_a_run_writes_the_table_and_the_figure(ran, rows):
    text = (ran / "README.md").read_text("utf-8")
    assert text.startswith("before\n<!-- benchmarks -->\n\n| task |")
    assert text.endswith("|\n\n<!-- end of benchmarks -->\nafter\n")
    assert text.count("|\n") == 2 + len(report.TABLE)
    assert {path.suffix for path in ran.iterdir()} == {".png", ".pdf", ".csv", ".md"}
    for ax, task in zip(figure.draw(rows).subfigs[1].axes, figure.PANELS, strict=True):
        assert len(ax.lines) == len({row["method"] for row in rows if row["task"] == task})


def test_the_stored_csv_and_readme_are_what_the_report_writes(rows, tmp_path):
    stored = report.read_csv(STORED)
    report.write_csv(stored, tmp_path / "table.csv")
    assert (tmp_path / "table.csv").read_bytes() == STORED.read_bytes()
    assert list(stored[0]) == list(rows[0])
    assert report.readme_table(stored) in report.README.read_text("utf-8")


def test_ratios_are_rounded_down():
    given = [25.97, 1.0, 0.4999, 1234.0, 9.99, 100.0]
    assert [report.rounded_down(x) for x in given] == ["25", "1.0", "0.49", "1200", "9.9", "100"]
