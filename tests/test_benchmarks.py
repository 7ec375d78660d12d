"""The benchmarks run, are fair, and the README says what they found. Nothing is timed here."""

import sys

import matplotlib.pyplot as plt
import numpy as np
import pytest

import rbcourse as rb
from benchmarks import __main__ as bench
from benchmarks import machine, optima, picture, report, rotations, tasks
from benchmarks.contest import OURS, Contest, Method, hold, without_slow
from benchmarks.timing import Patience, in_turn, quartiles, ratios

EPS = np.finfo(float).eps
ONCE = Patience(loop=0, contest=0, fewest=1, most=1)
BOUNDS = {  # in eps; solve_bvp and shooting stop at a tolerance of the rates
    "nearest rotation": 200,
    "geodesic at N times": 20,
    "projected cubic at N times": 200,
    "projected cubic with derivatives": 1000,
    "random rotation matrices": 20,
    "random quaternions": 10,
    "optimum, one problem": 1e5,
    "optimum, stacked": 1e4,
}


class Clock:
    """A clock that goes on when a call says so."""

    def __init__(self):
        self.now = 0.0

    def __call__(self):
        return self.now

    def call(self, seconds):
        def takes():
            self.now += seconds()

        return takes


def test_ratios_are_formed_within_rounds():
    """When the machine gets twice as slow from turn to turn, all methods of a round do."""
    clock, load = Clock(), [1.0]
    calls = [clock.call(lambda s=s: s * load[0]) for s in (1, 3)]

    def tick():
        load[0] *= 2

    times = in_turn(calls, Patience(loop=1, contest=16, fewest=1, most=9), clock, tick)
    assert times == pytest.approx(np.outer(2.0 ** np.arange(4), [1, 3]))
    assert ratios(times)[:, 1] == pytest.approx([3] * 4)
    assert quartiles(times)[0, 1] / quartiles(times)[0, 0] == pytest.approx(3)


@pytest.mark.parametrize(("contest", "rounds"), [(0, 2), (35, 3), (1000, 5)])
def test_the_rounds_take_what_time_there_is_within_bounds(contest, rounds):
    clock = Clock()
    calls = [clock.call(lambda: 10.0), clock.call(lambda: 1.0)]
    assert len(in_turn(calls, Patience(0.1, contest, 2, 5), clock)) == rounds


def test_a_short_call_is_repeated_and_told_for_one():
    clock, count = Clock(), [0]

    def short():
        count[0] += 1
        clock.now += 0.001

    times = in_turn([short], Patience(loop=0.02, contest=0, fewest=2, most=2), clock)
    assert count[0] == 1 + 2 * 20
    assert times == pytest.approx(np.full((2, 1), 0.001))


@pytest.fixture(autouse=True, scope="module")
def no_figures_left():
    yield
    plt.close("all")


@pytest.fixture(scope="module")
def ran():
    """The rows of every task at the smallest size, one round each, without peers."""
    rng = np.random.default_rng(1)
    contests = tasks.all_contests({}, rng, sizes=(1, 2), cases=["5"], problems=1, frames=2)
    return bench.run({}, ONCE, contests, rotations.scaled_errors({}, rng, n=10))


def rows_of(ran, task):
    return [row for row in ran if row["task"] == task]


def test_every_task_has_ours_first_and_others(ran):
    for task in dict.fromkeys(row["task"] for row in ran):
        names = [row["method"] for row in rows_of(ran, task)]
        assert names[0] == OURS
        assert len(set(names)) > 1, task


@pytest.mark.parametrize("task", BOUNDS)
def test_what_computes_the_same_gives_the_same(ran, task):
    errors = {row["method"]: row["error [1]"] for row in rows_of(ran, task)}
    told = {name: error for name, error in errors.items() if error is not None}
    assert OURS in told
    for name, error in told.items():
        assert error <= BOUNDS[task] * EPS, name


def test_times_and_ratios_are_there_and_memory_at_the_largest_size(ran):
    for row in ran:
        if row["task"] == bench.ERRORS:
            assert row["time [s]"] is None
        else:
            assert row["time low [s]"] <= row["time [s]"] <= row["time high [s]"]
            assert row["times ours [1]"] > 0
    rows = [row for row in rows_of(ran, "nearest rotation") if row["method"] != "SciPy"]
    peaks = [row["peak memory [B]"] for row in rows]
    half = len(peaks) // 2
    assert peaks[:half] == [None] * half
    assert all(peak > 0 for peak in peaks[half:])


def test_the_nearest_rotation_is_as_near_as_rounding_lets_it_and_a_refusal_is_told(ran):
    errors = {(r["case"], r["method"]): r["error [1]"] for r in rows_of(ran, bench.ERRORS)}
    kinds = {kind for kind, _ in errors}
    assert len(kinds) == 5
    for kind in kinds:
        assert errors[kind, OURS] < 50
    assert errors["reflected", "SciPy"] is None
    assert errors["noisy", "SciPy"] < 100


def test_inputs_are_of_the_kind_they_are_called():
    made = rotations.kinds(50, np.random.default_rng(2))
    s = {kind: np.linalg.svd(M, compute_uv=False) for kind, M in made.items()}
    assert (np.linalg.det(made["noisy"]) > 0).all()
    assert (np.linalg.det(made["reflected"]) < 0).all()
    assert np.abs(s["rank 2"][:, 2]).max() < 10 * EPS
    gaps = (s["nearly degenerate"][:, 1] - s["nearly degenerate"][:, 2]) / s["rank 2"][:, 0]
    assert gaps.max() < 2e-3


def test_a_wrong_answer_has_a_large_error():
    contest = rotations.nearest_rotation(3, {}, np.random.default_rng(3))
    assert contest.error(np.broadcast_to(np.eye(3), (3, 3, 3))) > 0.1


def test_a_boundary_value_problem_that_was_not_solved_is_not_counted():
    R1, w0, w1 = rb.exp_so3([1, 1, 0]), np.array([0, 0, 1.0]), np.array([1.0, 0, 0])
    curve = rb.minimum_acceleration_so3(np.eye(3), R1, w0, w1)
    other = rb.projected_cubic_so3(np.eye(3), R1, w0, w1)
    solved, not_solved = ([c(optima.MOMENTS, k) for k in range(3)] for c in (curve, other))

    def fails():
        raise RuntimeError("singular Jacobian")

    assert optima._solves(lambda: solved, R1, w0, w1)
    assert not optima._solves(lambda: not_solved, R1, w0, w1)
    assert not optima._solves(lambda: solved, R1, w0, w0)
    assert not optima._solves(fails, R1, w0, w1)


def test_what_would_be_too_slow_is_left_out_and_named():
    methods = [Method(name, "", lambda: None) for name in (OURS, "slow")]
    last = {("task", "", OURS): (1, 0.1), ("task", "", "slow"): (1, 3.0)}
    contest, slow = without_slow(Contest("task", "", 10, methods), last)
    assert slow == ["slow"]
    assert [method.name for method in contest.methods] == [OURS]
    contest, slow = without_slow(Contest("task", "", 1000, methods), last)
    assert slow == [OURS, "slow"]
    assert contest.methods == []


def test_times_are_of_one_item():
    clock = Clock()
    methods = [Method(OURS, "", clock.call(lambda: 6.0), items=3)]
    methods.append(Method("other", "", clock.call(lambda: 4.0)))
    rows = hold(Contest("task", "", 3, methods), ONCE, "here", clock=clock)
    assert [row["time [s]"] for row in rows] == [2, 4]
    assert [row["times ours [1]"] for row in rows] == [1, 2]


def test_missing_peers_are_named_and_left_out(monkeypatch, capsys):
    for name in ("pytransform3d.rotations", "torch"):
        monkeypatch.setitem(sys.modules, name, None)
    assert machine.find_peers() == ({}, ["pytransform3d", "roma"])
    monkeypatch.setattr(bench, "run", lambda *_: [])
    for name in ("write_csv", "update_readme", "read_csv"):
        monkeypatch.setattr(report, name, lambda *_: [])
    for name in ("draw", "save"):
        monkeypatch.setattr(picture, name, lambda *_: None)
    bench.main()
    said = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in said] == ["pytransform3d", "roma"]


def test_the_table_comes_back_from_its_file(ran, tmp_path):
    report.write_csv(ran, tmp_path / "table.csv")
    back = report.read_csv(tmp_path / "table.csv")
    assert len(back) == len(ran)
    for row, again in zip(ran, back, strict=True):
        for name, value in row.items():
            if isinstance(value, float):
                assert again[name] == pytest.approx(value, rel=1e-3)
            else:
                assert again[name] == ("" if value is None and name[-1] != "]" else value)


def test_ratios_are_rounded_down():
    given = [25.97, 1.0, 0.4999, 1234.0, 9.99, 100.0]
    assert [report.rounded_down(x) for x in given] == ["25", "1.0", "0.49", "1200", "9.9", "100"]


def test_a_table_for_the_readme_replaces_the_old_one(ran, tmp_path):
    path = tmp_path / "README.md"
    path.write_text("before\n<!-- benchmarks -->\nold\n<!-- end of benchmarks -->\nafter\n")
    for _ in range(2):
        report.update_readme([r | {"case": "4c"} if r["case"] == "5" else r for r in ran], path)
    text = path.read_text("utf-8")
    assert text.startswith("before\n<!-- benchmarks -->\n\n| task |")
    assert text.endswith("|\n\n<!-- end of benchmarks -->\nafter\n")
    assert text.count("nearest rotation") == 1


def test_the_readme_says_what_the_table_says():
    assert report.parts(report.README.read_text("utf-8"))[1] == report.readme_table(
        report.read_csv()
    )


def test_the_figure_shows_every_method(ran, tmp_path):
    fig = picture.draw(ran)
    _, middle, _ = fig.subfigs
    for ax, task in zip(middle.axes, picture.PANELS, strict=True):
        assert len(ax.lines) == len({row["method"] for row in rows_of(ran, task)})
    picture.save(fig, tmp_path / "figure")
    assert {path.suffix for path in tmp_path.iterdir()} == {".png", ".pdf"}
