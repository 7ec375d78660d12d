"""Time the methods of a contest in turn, so that the load of the machine is the same for all."""

import os
import platform
import re
import tracemalloc
from importlib.metadata import version
from pathlib import Path
from timeit import default_timer, timeit

import numpy as np

from benchmarks.contests import roma, torch

TIMES = ("time [s]", "time low [s]", "time high [s]")
RATIOS = ("times ours [1]", "times ours low [1]", "times ours high [1]")
"""The columns of the median, the lower and the upper quartile."""


def compete(contest, n, rng, machine, **timing):
    """Time the methods of a contest at size n; yield a dict for each method."""
    methods, error = contest.make(n, rng, *contest.options)
    times = in_turn([method.call for method in methods.values()], **timing)
    times /= [method.items for method in methods.values()]
    for (name, method), column in zip(methods.items(), times.T, strict=True):
        off = error and method.value and float(error(np.asarray(method.value(method.call()))))
        # Python cannot measure the memory of these packages
        most, hidden = None, name.startswith(("RoMa", "SciPy"))
        if min(contest.sizes) < n == max(contest.sizes) and not hidden:
            tracemalloc.start()
            method.call()
            _, most = tracemalloc.get_traced_memory()
            tracemalloc.stop()
        row = {"task": contest.task, "case": contest.case, "N [1]": n}
        row |= {"method": name, "call": method.does}
        spreads = np.percentile([column, column / times[:, 0]], [50, 25, 75], axis=1)
        row |= zip(TIMES + RATIOS, spreads.T.ravel().tolist(), strict=True)
        row |= {"rounds [1]": len(times), "error [1]": off, "peak memory [B]": most}
        yield row | {"machine": machine}


def in_turn(calls, loop=0.02, total=15.0, fewest=5, most=15, clock=default_timer):
    """Return the seconds per call, shape (rounds, calls); each round runs every call.

    A short call is repeated until about `loop` seconds have passed. There are between `fewest` and
    `most` rounds, which take about `total` seconds.
    """

    def seconds(call, times):
        return timeit(call, timer=clock, number=times) / times

    once = np.min([[seconds(call, 1) for call in calls] for _ in range(2)], axis=0)
    loops = np.maximum(1, np.round(loop / np.maximum(once, 1e-7))).astype(int)
    rounds = int(np.clip(total // (loops @ once), fewest, most))
    return np.array([[seconds(*x) for x in zip(calls, loops, strict=True)] for _ in range(rounds)])


def describe_machine():
    """Return a line with the processor, the threads, and the versions of the packages."""
    file = Path("/proc/cpuinfo")
    known = re.search(r"model name\s*: (.*)", file.read_text() if file.exists() else "")
    processor = known[1].strip() if known else platform.processor() or platform.machine()
    simd = np.show_config(mode="dicts")["SIMD Extensions"].get("found", [])
    wide = "with" if any(x.startswith(("X86_V4", "AVX512")) for x in simd) else "without"
    names = {"numpy": "NumPy", "scipy": "SciPy", "pytransform3d": "pytransform3d"}
    names |= {"roma": "RoMa", "torch": "PyTorch"} if roma else {}
    parts = [f"{processor}, {wide} AVX-512, {os.cpu_count()} threads"]
    parts += [f"OPENBLAS_NUM_THREADS {os.environ.get('OPENBLAS_NUM_THREADS', 'not set')}"]
    parts += [f"{torch.get_num_threads()} threads of PyTorch"] if roma else []
    versions = [f"{shown} {version(name)}" for name, shown in names.items()]
    return "; ".join([*parts, f"Python {platform.python_version()}", *versions])
