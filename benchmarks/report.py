"""Write the results of a run as printed lines, as CSV, and as the table in README.md."""

import csv
import io
from decimal import ROUND_DOWN, Context

from benchmarks.contests import OURS
from rbcourse.files import replace_file

START, END = "<!-- benchmarks -->\n", "<!-- end of benchmarks -->\n"
TABLE = [
    ("nearest rotation of {} matrices", "nearest rotation", "noisy"),
    ("geodesic at {} times", "geodesic at N times", ""),
    ("projected cubic at {} times", "projected cubic at N times", ""),
    ("the same with velocity and acceleration", "projected cubic with derivatives", ""),
    ("other curves with the same ends at {} times", "closed forms at N times", ""),
    ("the same with velocity and acceleration", "closed forms with derivatives", ""),
    ("{} random rotation matrices", "random rotation matrices", ""),
    ("{} random quaternions", "random quaternions", ""),
    ("a chain of 1,000 poses at {} times", "chain at N times", "projected cubics"),
    ("the same with geodesic legs", "chain at N times", "geodesics"),
    ("spline of minimum acceleration with {} legs", "spline of N legs", "30°"),
    ("fastest timing of one leg, with 1,000 cells", "fastest timing", "chain of N"),
    ("minimum acceleration, BK Figure 4c", "optimum, one problem", "4c"),
    ("minimum acceleration, {} random problems together", "optimum, stacked", "random"),
    ("least torque of a book, BK Figure 4c", "optimum of a body, one problem", "4c"),
    ("least torque, {} random bodies together", "optimum of a body, stacked", "random"),
    ("GIF of two cubes with {} frames", "cubes as GIF", ""),
]
"""For each row of the README: its text with {} for N, the task, and the case."""


def line(row, bound):
    """Return a row as text, with a warning if its error is larger than the bound."""
    time, ratio, error = row["time [s]"], row["times ours [1]"], row["error [1]"]
    text = f"  {row['method']:28} {time:10.3g} s, {ratio:7.3g} × ours"
    if error is not None:
        text += f", error {error:.1e}" + ("" if error <= bound else f", LARGER THAN {bound:.0e}")
    return text


def write_csv(rows, path):
    """Write rows as CSV; numbers have four digits."""
    texts = ([f"{x:.4g}" if isinstance(x, float) else x for x in row.values()] for row in rows)
    table = io.StringIO()
    csv.writer(table, lineterminator="\n").writerows([rows[0], *texts])
    replace_file(path, table.getvalue().encode())


def read_csv(path):
    """Return the rows of a CSV that `write_csv` wrote; a missing number is None."""

    def value(name, text):
        number = int if text.isdigit() else float if text else lambda _: None
        return number(text) if name.endswith("]") else text

    with open(path, encoding="utf-8", newline="") as file:
        return [{name: value(name, x) for name, x in row.items()} for row in csv.DictReader(file)]


def readme_table(rows):
    """Return the README's table: for the largest N, times divided by ours and rounded down."""
    text = "\n| task | time divided by ours |\n|---|---|\n"
    for words, task, case in TABLE:
        here = [row for row in rows if (row["task"], row["case"]) == (task, case)]
        n = max(row["N [1]"] for row in here)
        others = [row for row in here if row["N [1]"] == n and row["method"] != OURS]
        told = [f"{rounded_down(row['times ours [1]'])} × {row['method']}" for row in others]
        text += f"| {words.format({1_000_000: '10⁶'}.get(n, n))} | {'; '.join(told)} |\n"
    return text + "\n"


def rounded_down(ratio):
    """Return a ratio as text with two significant digits, rounded towards 0."""
    return f"{Context(prec=2, rounding=ROUND_DOWN).create_decimal(f'{ratio:.3e}'):f}"


def update_readme(rows, path):
    """Replace the table between the two marks in the README."""
    before, rest = path.read_text("utf-8").split(START)
    text = before + START + readme_table(rows) + END + rest.split(END)[1]
    replace_file(path, text.encode())
