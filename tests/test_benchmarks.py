"""The benchmarks run, their methods agree, and the README states the results."""

from functools import cache, partial
from itertools import count
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest

from benchmarks import __main__ as bench
from benchmarks import contests, figure, report, timing
from benchmarks.contests import CONTESTS, OURS

FOLDER = Path(bench.__file__).parent
STORED = FOLDER / "benchmarks.csv"


class Clock:
    """A clock that advances by the duration of each call, on a machine whose load may grow."""

    now, load = 0.0, 1.0

    def __call__(self):
        return self.now

    def take(self, seconds, grows=1):
        self.now += seconds * self.load
        self.load *= grows


def test_ratios_compare_methods_under_the_same_load():
    """The machine becomes twice as slow after each round."""
    clock, rounds = Clock(), {"loop": 0, "total": 0, "fewest": 3, "most": 3}
    ours, other = partial(clock.take, 6), partial(clock.take, 4, grows=2)
    methods = {OURS: contests.Method("", ours, items=3), "other": contests.Method("", other)}
    contest = contests.Contest("task", "", (3,), None, lambda n, rng: (methods, None))
    rows = timing.compete(contest, 3, None, "here", **rounds, clock=clock)
    wanted = [[16, 12, 24], [1, 1, 1]], [[32, 24, 48], [2, 2, 2]]  # median and quartiles
    for row, values in zip(rows, wanted, strict=True):
        assert [[row[name] for name in names] for names in (timing.TIMES, timing.RATIOS)] == values


def once(contest):
    """Return the contest at its smallest sizes, with each method called once."""

    def make(n, rng, *options):
        methods, error = contest.make(n, rng, *options)
        return {name: m._replace(call=cache(m.call)) for name, m in methods.items()}, error

    sizes = tuple(dict.fromkeys(min(n, 2) for n in contest.sizes))
    return contest._replace(sizes=sizes, make=make)


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    """Run every task with one case and easy problems; return the folder and the rows."""
    folder = tmp_path_factory.mktemp("run")
    text = "before\n<!-- benchmarks -->\nold\n<!-- end of benchmarks -->\nafter\n"
    (folder / "README.md").write_text(text)
    chosen = [once(contest) for contest in CONTESTS if contest.case not in ("4a", "4b", "5")]
    problems = contests.random_problems
    with pytest.MonkeyPatch.context() as patch:
        for cases in (contests.CASES, contests.ENDS):
            patch.setitem(cases, "4c", cases["5"])
        patch.setitem(plt.rcParams, "savefig.dpi", 30)
        patch.setattr(contests, "random_problems", lambda n, _, rng: problems(n, 0.5, rng=rng))
        options = {"loop": 0, "total": 0, "fewest": 1, "most": 1, "clock": count().__next__}
        bench.main(chosen, folder, **options)
    yield folder, report.read_csv(folder / "benchmarks.csv")
    plt.close("all")


def test_all_methods_of_a_task_agree(ran):
    contest = {(contest.task, contest.case): contest for contest in CONTESTS}
    methods = {contest.task: [] for contest in CONTESTS}
    for row in ran[1]:
        methods[row["task"]].append(row["method"])
        bound, error = contest[row["task"], row["case"]].bound, row["error [1]"]
        polar = row["call"] == "robust_polar_decomposition"  # 20 iterations are too few
        assert error is None or error <= (1e-2 if polar else bound), row
        assert (error is None) <= (bound is None or row["method"] != OURS)
    assert all(names[0] == OURS and len(set(names)) > 1 for names in methods.values()), methods


def test_wrong_results_have_errors_above_the_bound():
    _, error = CONTESTS[0].make(3, np.random.default_rng(3))
    assert error(np.broadcast_to(np.eye(3), (3, 3, 3))) > 0.1
    row = {"method": "", "time [s]": 1.0, "times ours [1]": 1.0}
    assert "LARGER" in report.line(row | {"error [1]": np.nan}, 1.0)
    assert "LARGER" not in report.line(row | {"error [1]": 0.5}, 1.0)


def test_a_run_writes_the_table_and_the_figure(ran):
    folder, rows = ran
    text = (folder / "README.md").read_text("utf-8")
    assert text.startswith("before\n<!-- benchmarks -->\n\n| task |")
    assert text.endswith("|\n\n<!-- end of benchmarks -->\nafter\n")
    assert text.count("|\n") == 2 + len(report.TABLE)
    assert {path.suffix for path in folder.iterdir()} == {".png", ".pdf", ".csv", ".md"}
    for ax, task in zip(figure.draw(rows).subfigs[1].axes, figure.PANELS, strict=True):
        assert len(ax.lines) == len({row["method"] for row in rows if row["task"] == task})


def test_the_report_reproduces_the_stored_csv_and_readme(ran, tmp_path):
    stored = report.read_csv(STORED)
    report.write_csv(stored, tmp_path / "table.csv")
    assert (tmp_path / "table.csv").read_bytes() == STORED.read_bytes()
    assert list(stored[0]) == list(ran[1][0])
    assert report.readme_table(stored) in (FOLDER / "README.md").read_text("utf-8")
    given = [25.97, 1.0, 0.4999, 1234.0, 9.99, 100.0]
    assert [report.rounded_down(x) for x in given] == ["25", "1.0", "0.49", "1200", "9.9", "100"]
