"""Time every task, print what comes out, and write the CSV, the figure and the README's table."""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from benchmarks import machine, picture, report
from benchmarks.contest import hold, without_slow
from benchmarks.rotations import scaled_errors
from benchmarks.tasks import all_contests
from benchmarks.timing import Patience

ERRORS = "nearest rotation, error by kind of input"

HOW = """\
Times are medians over the rounds (lower – upper quartile). In a round each method is called in
turn, a short call so often that it takes 0.02 s; ratios are formed within a round."""


def run(peers, patience, contests, kinds):
    """Return the rows of all contests and of the errors by kind, and print them meanwhile.

    Parameters
    ----------
    peers : dict of str to module
        Those that are installed.
    patience : Patience
        How long to time.
    contests : iterable of Contest
        See `all_contests`.
    kinds : iterable
        See `scaled_errors`.
    """
    here, rows, last = machine.describe(peers), [], {}
    print(f"{here}\n{HOW}", flush=True)
    for contest in contests:
        contest, slow = without_slow(contest, last)
        print(heading(contest), end="", flush=True)
        found = hold(contest, patience, here, tick=tick) if contest.methods else []
        print("\n" + report.lines(found), flush=True)
        for name in slow:
            print(f"  {name} would take too long")
        if found and contest.in_and_out and contest.weigh:
            print(report.memory_line(contest, found))
        last |= {(row["task"], row["case"], row["method"]): times(row) for row in found}
        rows += found
    return rows + errors(kinds, rows[0])


def tick():
    """Show that a round is over."""
    print(".", end="", flush=True)


def times(row):
    """Return N, and the time that a call took."""
    return row["N [1]"], row["time [s]"]


def heading(contest):
    """Return what a contest is about, in a line."""
    return ", ".join(filter(None, [contest.task, contest.case, f"N = {contest.size}"])) + " "


def errors(kinds, like):
    """Return the rows of the errors by kind of input, with the columns of another; print them."""
    print(f"{ERRORS}, times the sum of the two smallest eigenvalues of S, over eps × norm")
    rows = []
    for kind, method, error in kinds:
        told = "refuses" if error is None else f"{error:.3g}"
        print(f"  {kind:20} {method:20} {told}", flush=True)
        given = {"task": ERRORS, "case": kind, "method": method, "error [1]": error}
        given |= {"machine": like["machine"]}
        rows.append(dict.fromkeys(like) | given)
    return rows


def main():
    """Run everything, with the peers that are there."""
    peers, missing = machine.find_peers()
    for name in missing:
        print(f"{name} is not installed: the run goes on without it.")
    rng = np.random.default_rng()
    rows = run(peers, Patience(), all_contests(peers, rng), scaled_errors(peers, rng))
    report.write_csv(rows)
    written = report.read_csv()
    report.update_readme(written)
    picture.save(picture.draw(written), Path(__file__).parent / "benchmarks")


if __name__ == "__main__":
    plt.switch_backend("Agg")
    main()
