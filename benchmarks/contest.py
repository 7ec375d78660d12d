"""A contest: methods for one task, timed in turn, with their errors and their memory."""

import tracemalloc
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from benchmarks.timing import in_turn, quartiles, ratios

OURS = "rbcourse"
"""The name of our own method, the first of each contest."""

SLOW = 10.0
"""What would take longer, in s a call, is left out."""

SPREADS = (
    "time [s]",
    "time low [s]",
    "time high [s]",
    "times ours [1]",
    "times ours low [1]",
    "times ours high [1]",
)
"""The columns of median, lower and upper quartile."""


@dataclass(frozen=True)
class Method:
    """One way to do a task.

    Parameters
    ----------
    name : str
        Whose it is, and what it returns if that differs: "SciPy, as Rotation".
    does : str
        What is called.
    call : callable
        Does it; what it needs was made before.
    value : callable, optional
        Makes what `call` returns comparable.
    same : bool, optional
        Whether it computes what the first method does; else it has no error.
    items : int, optional
        How many problems a call solves, where the times are of one problem.
    """

    name: str
    does: str
    call: Callable[[], Any]
    value: Callable[[Any], np.ndarray] = np.asarray
    same: bool = True
    items: int = 1


@dataclass(frozen=True)
class Contest:
    """Methods that do the same task.

    Parameters
    ----------
    task, case : str
        What is done, and on which input.
    size : int
        N, of how many items.
    methods : sequence of Method
        The first is ours.
    error : callable, optional
        Returns the error of a method's value.
    in_and_out : int, optional
        The bytes that input and output fill.
    weigh : bool, optional
        Whether the memory is of interest: at the largest N.
    """

    task: str
    case: str
    size: int
    methods: Sequence[Method]
    error: Callable[[np.ndarray], float] | None = None
    in_and_out: int = 0
    weigh: bool = False


def hold(contest, patience, machine, **timing):
    """Return the rows of a contest, one for each method: column to value.

    Parameters
    ----------
    contest : Contest
        What is compared.
    patience : Patience
        How long to time.
    machine : str
        On what.
    **timing
        See `in_turn`.
    """
    errors = [error(contest, method) for method in contest.methods]
    times = in_turn([method.call for method in contest.methods], patience, **timing)
    times = times / [method.items for method in contest.methods]
    spreads = np.concatenate([quartiles(times), quartiles(ratios(times))])
    return [
        {
            "task": contest.task,
            "case": contest.case,
            "N [1]": contest.size,
            "method": method.name,
            "call": method.does,
            **dict(zip(SPREADS, map(float, spread), strict=True)),
            "rounds [1]": len(times),
            "error [1]": off,
            "peak memory [B]": peak(method) if contest.weigh else None,
            "machine": machine,
        }
        for method, off, spread in zip(contest.methods, errors, spreads.T, strict=True)
    ]


def error(contest, method):
    """Call a method, and return how far it is off, or None where it computes something else."""
    result = method.call()
    return contest.error(method.value(result)) if contest.error and method.same else None


def peak(method):
    """Return the most memory that a call holds, in B; None for who does not tell Python all."""
    if method.name.startswith(("RoMa", "SciPy")):
        return None
    tracemalloc.start()
    try:
        method.call()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def without_slow(contest, last):
    """Return the contest without what would be too slow, and the names of that: all if ours is.

    Parameters
    ----------
    contest : Contest
        Of a larger N than the last one.
    last : dict
        (task, case, method) to the last N and the time it took.
    """
    slow = [
        method.name
        for method in contest.methods
        if _expected(last.get((contest.task, contest.case, method.name)), contest.size) > SLOW
    ]
    if contest.methods[0].name in slow:
        slow = [method.name for method in contest.methods]
    return replace(contest, methods=[m for m in contest.methods if m.name not in slow]), slow


def _expected(last, size):
    return 0 if last is None else last[1] * size / last[0]
