"""What a run leaves: the lines that it prints, the CSV, and the README's table of ratios."""

import csv
from pathlib import Path

import numpy as np

from benchmarks.contest import OURS, SPREADS
from rbcourse.draw.save import csv_text

HERE = Path(__file__).parent
CSV = HERE / "benchmarks.csv"
README = HERE.parent / "README.md"
UNITS = (1, "s"), (1e-3, "ms"), (1e-6, "µs")
MARKS = "<!-- benchmarks -->\n", "<!-- end of benchmarks -->\n"
RATIOS = [
    ("nearest rotation of {} matrices", "nearest rotation", "noisy"),
    ("geodesic at {} times", "geodesic at N times", ""),
    ("projected cubic at {} times", "projected cubic at N times", ""),
    ("the same with velocity and acceleration", "projected cubic with derivatives", ""),
    ("other curves with the same ends at {} times", "closed forms at N times", ""),
    ("the same with velocity and acceleration", "closed forms with derivatives", ""),
    ("{} random rotation matrices", "random rotation matrices", ""),
    ("{} random quaternions", "random quaternions", ""),
    ("a chain of 1,000 poses at {} times", "chain at N times", "projected cubics"),
    ("the same of geodesics", "chain at N times", "geodesics"),
    ("minimum acceleration, BK Figure 4c", "optimum, one problem", "4c"),
    ("minimum acceleration, {} random problems at once", "optimum, stacked", "random"),
    ("least torque of a book, BK Figure 4c", "optimum of a body, one problem", "4c"),
    ("least torque, {} random bodies at once", "optimum of a body, stacked", "random"),
    ("{} frames of two cubes as GIF", "cubes as GIF", ""),
]


def lines(rows):
    """Return the text for the rows of one contest."""
    return "\n".join(
        f"  {row['method']:28} {_time(row)} {_ratio(row)}{_error(row)}{_memory(row)}"
        for row in rows
    )


def _time(row):
    middle, low, high = (_seconds(row[name]) for name in SPREADS[:3])
    return f"{middle:>8} ({low:>8} – {high:>8})"


def _seconds(time):
    size, unit = next(pair for pair in UNITS if time >= pair[0] or pair == UNITS[-1])
    return f"{time / size:.3g} {unit}"


def _ratio(row):
    middle, low, high = (row[name] for name in SPREADS[3:])
    return f"{middle:7.3g} × ours ({low:.3g} – {high:.3g})"


def _error(row):
    return "" if row["error [1]"] is None else f", error {row['error [1]']:.1e}"


def _memory(row):
    peak = row["peak memory [B]"]
    return "" if peak is None else f", {peak / 1e6:.3g} MB at most"


def memory_line(contest, rows):
    """Return the most memory of each method, as a multiple of what input and output fill."""
    peaks = {row["method"]: row["peak memory [B]"] for row in rows}
    told = [f"{name} {b / contest.in_and_out:.2f}" for name, b in peaks.items() if b is not None]
    return "  most memory over that of input and output: " + ", ".join(told)


def write_csv(rows, path=CSV):
    """Write rows, all with the same columns, as CSV; numbers with four digits."""
    table = {name: [_cell(row[name]) for row in rows] for name in rows[0]}
    path.write_text(csv_text(table), encoding="utf-8", newline="\n")


def _cell(value):
    if value is None:
        return ""
    if isinstance(value, float | np.floating):
        return f"{value:.4g}"
    return str(value)


def read_csv(path=CSV):
    """Return the rows of a CSV that `write_csv` has written: what is empty is None."""
    with open(path, encoding="utf-8", newline="") as file:
        return [
            {name: _value(name, text) for name, text in row.items()} for row in csv.DictReader(file)
        ]


def _value(name, text):
    if not name.endswith("]"):
        return text
    if not text:
        return None
    return int(text) if name in ("N [1]", "rounds [1]", "peak memory [B]") else float(text)


def readme_table(rows):
    """Return the README's table: what each method takes over what ours does, rounded down.

    It tells of the largest N of each task.
    """
    text = ["", "| task | time over ours |", "|---|---|"]
    for words, task, case in RATIOS:
        here = [row for row in rows if (row["task"], row["case"]) == (task, case)]
        largest = max(row["N [1]"] for row in here)
        others = [row for row in here if row["N [1]"] == largest and row["method"] != OURS]
        told = [f"{rounded_down(row['times ours [1]'])} × {row['method']}" for row in others]
        text.append(f"| {words.format(power(largest))} | {'; '.join(told)} |")
    return "\n".join(text) + "\n\n"


def power(n):
    """Return a number as text, a power of ten as such.

    Examples
    --------
    >>> power(1_000_000), power(100), power(1200)
    ('10⁶', '100', '1200')
    """
    exponent = len(str(n)) - 1
    return f"10{'⁰¹²³⁴⁵⁶⁷⁸⁹'[exponent]}" if n == 10**exponent and exponent > 3 else str(n)


def rounded_down(ratio):
    """Return a ratio as text with two significant digits, rounded towards 0.

    Examples
    --------
    >>> rounded_down(25.97), rounded_down(1.0), rounded_down(0.4999), rounded_down(1234)
    ('25', '1.0', '0.49', '1200')
    """
    digits = 1 - int(np.floor(np.log10(ratio)))
    down = np.floor(ratio * 10.0**digits + 1e-9) / 10.0**digits
    return f"{down:.{max(digits, 0)}f}"


def update_readme(rows, path=README):
    """Put the table between the marks of the README."""
    before, _, after = parts(path.read_text("utf-8"))
    path.write_text(before + readme_table(rows) + after, encoding="utf-8", newline="\n")


def parts(text):
    """Return what stands before the table, the table, and what stands after it."""
    start, end = text.index(MARKS[0]) + len(MARKS[0]), text.index(MARKS[1])
    return text[:start], text[start:end], text[end:]
