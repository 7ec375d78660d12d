"""Time the optimum, three ways, and its projection: writes minimum_acceleration.csv beside it.

Each method is timed in turn, many rounds in one process; a row holds medians over the rounds.
"""

import platform
import sys
from pathlib import Path
from time import perf_counter

import numpy as np
import scipy

import rbcourse as rb
from rbcourse.figures import csv_text

HERE = Path(__file__).parent
sys.path.append(str(HERE.parent / "tests"))
import oracles  # noqa: E402

ALONG = np.pi / 6 * np.array([1, 2, 3])
E1 = np.array([1.0, 0, 0])
CASES = {
    "4a": (ALONG, ALONG, ALONG),
    "4b": (ALONG, ALONG, ALONG + E1),
    "4c": (ALONG, ALONG, ALONG + 5 * E1),
    "5": (np.pi / 6 * np.array([1, 4, 3]), np.array([1.0, 2, 3]), np.array([2.0, 1, 1])),
}
ROUNDS = 15
SAMPLES = np.linspace(0, 1, 101)


def processor():
    """Return the name of the processor, where the system tells it."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.split(":")[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


def methods(turn, w0, w1):
    """Return what is timed: from the end conditions to 101 rotations on the curve."""
    ends = np.eye(3), rb.exp_so3(turn), w0, w1
    return {
        "projection": lambda: rb.projected_cubic_so3(*ends)(SAMPLES),
        "relaxation": lambda: rb.minimum_acceleration_so3(*ends)(SAMPLES),
        "shooting": lambda: rb.shoot_minimum_acceleration_so3(*ends)(SAMPLES),
        "solve_bvp": lambda: oracles.minimum_acceleration(turn, w0, w1).sol(SAMPLES),
        "solve_bvp, exact Jacobians": lambda: oracles.minimum_acceleration(
            turn, w0, w1, jacobians=True
        ).sol(SAMPLES),
    }


def milliseconds(function):
    """Return how long a call takes."""
    start = perf_counter()
    function()
    return 1000 * (perf_counter() - start)


def main():
    """Time everything, print it, and write the table."""
    rows = []
    for case, ends in CASES.items():
        timed = methods(*ends)
        for function in timed.values():
            function()
        rounds = np.array([[milliseconds(f) for f in timed.values()] for _ in range(ROUNDS)])
        relative = rounds / rounds[:, [list(timed).index("relaxation")]]
        for name, times, ratios in zip(timed, rounds.T, relative.T, strict=True):
            rows.append((case, name, np.median(times), np.median(ratios)))
            print(f"{case:3} {name:27} {rows[-1][2]:8.2f} ms {rows[-1][3]:8.2f} x relaxation")
    case, method, time, ratio = zip(*rows, strict=True)
    machine = f"{processor()}; NumPy {np.__version__}, SciPy {scipy.__version__}"
    table = {
        "case": case,
        "method": method,
        "time [ms]": np.round(time, 3),
        "ratio to relaxation [1]": np.round(ratio, 3),
        "machine": [machine] * len(rows),
    }
    (HERE / "minimum_acceleration.csv").write_text(csv_text(table), encoding="utf-8", newline="\n")


if __name__ == "__main__":
    main()
