"""Time several calls in turn, so that all of them meet the same state of the machine."""

from dataclasses import dataclass
from time import perf_counter

import numpy as np


@dataclass(frozen=True)
class Patience:
    """How long to time.

    Parameters
    ----------
    loop : float
        A short call is repeated until about so many seconds have passed.
    contest : float
        All rounds together take about so many seconds, within these bounds:
    fewest, most : int
        Numbers of rounds.
    """

    loop: float = 0.02
    contest: float = 15.0
    fewest: int = 5
    most: int = 15


def in_turn(calls, patience, clock=perf_counter, tick=lambda: None):
    """Return the seconds a call, shape (rounds, calls): in each round every one has its turn.

    Parameters
    ----------
    calls : sequence of callable
        What is timed; each has been called before.
    patience : Patience
        How many rounds, and how long a turn is.
    clock : callable, optional
        Returns the time in s.
    tick : callable, optional
        Is called after each round.
    """
    once = np.array([_seconds(call, 1, clock) for call in calls])
    loops = np.maximum(1, np.round(patience.loop / np.maximum(once, 1e-7))).astype(int)
    rounds = np.clip(patience.contest // (loops @ once), patience.fewest, patience.most)
    times = []
    for _ in range(int(rounds)):
        times.append([_seconds(call, n, clock) for call, n in zip(calls, loops, strict=True)])
        tick()
    return np.array(times)


def _seconds(call, times, clock):
    start = clock()
    for _ in range(times):
        call()
    return (clock() - start) / times


def quartiles(values):
    """Return the median, the lower and the upper quartile along the first axis."""
    return np.percentile(values, [50, 25, 75], axis=0)


def ratios(times):
    """Return each call's time over that of the first call, within the rounds."""
    return times / times[:, :1]
