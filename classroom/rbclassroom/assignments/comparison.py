"""Compare a student's function with others: errors and times."""

import time
from collections.abc import Callable
from contextlib import redirect_stdout
from io import StringIO
from typing import Any

import numpy as np

from rbclassroom.assignments.marking import EMPTY, NotYet, call_student
from rbcourse import Array

Function = Callable[..., Any]


def compare(
    functions: dict[str, Function],
    trials: dict[str, tuple[tuple[Any, ...], Array]],
    measure: Function = np.asarray,
) -> None:
    """Print a table of errors, and of times for the first trial, with a column for each function.

    A trial has arguments and the right result. The error is the largest entry of the difference
    between the right result and ``measure(result)``.
    """
    print(f"{'error':30}", *(f"{name:>13}" for name in functions))
    for said, (given, right) in trials.items():
        errors = (_error(function, given, right, measure) for function in functions.values())
        print(f"{said:30}", *(f"{error:>13}" for error in errors))
    given, _ = next(iter(trials.values()))
    print(f"{'time':30}", *(f"{_time(function, given):>13}" for function in functions.values()))


def _error(function: Function, given: tuple[Any, ...], right: Array, measure: Function) -> str:
    try:
        with redirect_stdout(StringIO()):
            (result,) = call_student(function, given)
        return f"{np.abs(measure(result) - right).max():.0e}"
    except (NotYet, TypeError, ValueError) as problem:
        empty = str(problem) == EMPTY or "nothing is written" in str(problem)
        return "not written" if empty else "fails"


def _time(function: Function, given: tuple[Any, ...]) -> str:
    """Return the median time of a call, from calls in a tenth of a second."""
    times, end = list[float](), time.perf_counter() + 0.1
    while not times or time.perf_counter() < end:
        start = time.perf_counter()
        try:
            with redirect_stdout(StringIO()):  # students print in their functions
                call_student(function, given)
        except NotYet:
            return "-"
        times.append(time.perf_counter() - start)
    took = float(np.median(times))
    return f"{took * 1e3:.1f} ms" if took > 1e-3 else f"{took * 1e6:.0f} µs"
