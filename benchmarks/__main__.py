"""Run all contests, print the results, and write the CSV, the figure and the README's table."""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from benchmarks import contests, figure, report, timing


def run(chosen, rng, **options):
    """Run contests; print and return their rows. `options` are passed to `timing.in_turn`."""
    machine, rows = timing.describe_machine(), []
    print(f"{machine}\nThe times of a call and their ratios are medians over rounds.")
    for contest in chosen:
        for n in contest.sizes:
            print(f"{contest.task} {contest.case} N = {n}")
            for row in timing.compete(contest, n, rng, machine, **options):
                print(report.line(row, contest.bound), flush=True)
                rows.append(row)
    return rows


def main(chosen=contests.CONTESTS, folder=Path(__file__).parent, readme=report.README, **options):
    """Run the contests of all installed packages, and write the results."""
    if not contests.roma:
        print("roma is not installed; the run continues without it.")
    rows = run(chosen, np.random.default_rng(), **options)
    report.write_csv(rows, folder / "benchmarks.csv")
    written = report.read_csv(folder / "benchmarks.csv")
    report.update_readme(written, readme)
    figure.save(figure.draw(written), folder / "benchmarks")


if __name__ == "__main__":
    plt.switch_backend("Agg")
    main()
