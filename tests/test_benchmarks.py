"""The benchmarks run, their methods agree, and the README states the stored results."""

import csv
from itertools import count
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest

from benchmarks import benchmarks

FOLDER = Path(benchmarks.__file__).parent


def test_ratios_compare_methods_under_the_same_load():
    """The machine becomes twice as slow after each round; one method takes half as long."""
    now, load = [0.0], [1.0]

    def take(seconds, grows=1):
        now[0] += seconds * load[0]
        load[0] *= grows

    short = benchmarks.in_turn([lambda: take(0.05)], rounds=1, clock=lambda: now[0])
    assert short == pytest.approx(0.05)
    calls = [lambda: take(6), lambda: take(3, grows=2)]
    times = benchmarks.in_turn(calls, rounds=3, clock=lambda: now[0])
    assert times[:, 1] / times[:, 0] == pytest.approx(0.5)
    assert times[1:] / times[:-1] == pytest.approx(2)


@pytest.mark.filterwarnings("ignore:cross validation of 3 poses")
@pytest.mark.parametrize("task", benchmarks.TASKS, ids=lambda task: " ".join(task[:2]))
def test_all_methods_of_a_task_agree(task):
    name, _, sizes, make, *options = task
    methods = dict(make(min(3, sizes[-1]), np.random.default_rng(2), *options))
    results = {method: call() for method, call in methods.items()}
    ours = results.pop("rbcourse")
    for method, result in results.items():
        if "random" not in name and "," not in method:  # not another curve or type of result
            pairs = zip(ours, result, strict=True) if isinstance(ours, list) else [(ours, result)]
            for one, same in pairs:
                assert np.abs(np.asarray(one) - np.asarray(same)).max() < 1e-6, method


def test_a_run_writes_the_results_and_the_readme_states_the_stored_ones(tmp_path):
    (tmp_path / "README.md").write_text("before\n<!-- benchmarks -->\nold\n<!-- end -->\nafter\n")
    name, case, _, *make = benchmarks.TASKS[0]
    with plt.rc_context({"savefig.dpi": 30}):
        benchmarks.main([(name, case, (1, 2), *make)], tmp_path, rounds=1, clock=count().__next__)
    assert (
        (tmp_path / "README.md").read_text("utf-8").startswith("before\n<!-- benchmarks -->\n\n|")
    )
    assert {path.suffix for path in tmp_path.iterdir()} == {".csv", ".png", ".md"}
    stored = (FOLDER / "benchmarks.csv").read_text("utf-8").splitlines()
    rows = list(csv.DictReader(stored))
    assert benchmarks.table(rows) in (FOLDER / "README.md").read_text("utf-8")
    rows[-1] |= {"times ours [1]": "0.4999", "method": "given"}
    assert "; 0.49 × given |" in benchmarks.table(rows)
