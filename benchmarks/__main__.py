"""Run all contests, print the results, and write the CSV, the figure and the README's table."""

import io
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from benchmarks import contests, figure, report, timing
from rbcourse.draw.pictures import pdf
from rbcourse.files import replace_file


def main(chosen=contests.CONTESTS, folder=Path(__file__).parent, **options):
    """Run contests, print the results, and write them; `options` are those of `timing.in_turn`."""
    if not contests.roma:
        print("roma is not installed; the run continues without it.")
    machine, rng, rows = timing.describe_machine(), np.random.default_rng(), []
    print(f"{machine}\nThe times of a call and their ratios are medians over rounds.")
    for contest in chosen:
        for n in contest.sizes:
            print(f"{contest.task} {contest.case} N = {n}")
            for row in timing.compete(contest, n, rng, machine, **options):
                print(report.line(row, contest.bound), flush=True)
                rows.append(row)
    report.write_csv(rows, folder / "benchmarks.csv")
    written = report.read_csv(folder / "benchmarks.csv")
    report.update_readme(written, folder / "README.md")
    fig = figure.draw(written)
    fig.savefig(picture := io.BytesIO(), metadata={"Software": None})  # the same bytes each time
    replace_file(folder / "benchmarks.png", picture.getvalue())
    replace_file(folder / "benchmarks.pdf", pdf(fig))


if __name__ == "__main__":
    plt.switch_backend("Agg")
    main()
