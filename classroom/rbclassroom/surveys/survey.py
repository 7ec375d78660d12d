"""Compute costs of curves for many ends, in chunks, on one machine or a cluster."""

from __future__ import annotations

import os
import pickle
import signal
import sys
import warnings
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor
from contextlib import ExitStack, contextmanager
from functools import partial
from inspect import signature
from multiprocessing import get_context, parent_process
from threading import Thread

import numpy as np
from numpy.typing import ArrayLike
from threadpoolctl import threadpool_limits

import rbcourse as rb
from rbclassroom.surveys.atlas import Maker, closed_forms, starts
from rbcourse import Array, Ends

Report = Callable[[int, int], object]
Measures = Mapping[str, Callable[[Ends], Array]]

CHUNK = 500
"""The number of problems that are computed together."""


def survey(
    problems: Ends,
    executor: Executor | None = None,
    *,
    inertia: ArrayLike | None = None,
    ways: Mapping[str, Maker] | None = None,
    report: Report | None = None,
) -> dict[str, Array]:
    """Return the costs of the optimum and of closed forms, for each of many problems.

    Source: BK 1, BK 7, BK (18); for real bodies, beyond BK 1.

    Parameters
    ----------
    problems : Ends
        Arrays with one batch axis, for N problems.
    executor : concurrent.futures.Executor, optional
        The executor that computes the chunks of `CHUNK` problems. Its workers must be able to
        import `rbcourse`. For a cluster, use for example ``Client(...).get_executor()`` of
        dask.distributed. The default is `processes` on all processors of this machine. A script
        must then call this function below ``if __name__ == "__main__":``. A single chunk is
        computed in this process.
    inertia : array_like, shape (3, 3), optional
        The inertia of the body in body axes. By default the body is a ball.
    ways : mapping of str to callable, optional
        Functions ``make(R0, R1, w0, w1)`` of the curves that are compared, by default
        `closed_forms`. Functions that are sent to other processes must be functions of a module, or
        partials of these.
    report : callable, optional
        A function that is called as ``report(done, total)`` after each chunk, with numbers of
        problems.

    Returns
    -------
    dict of str to ndarray, shape (N,)
        The cost ∫ τᵀ G⁻¹ τ dt of the "optimum" and of each of the ways. For a ball it is ∫ 2 ‖w'‖²
        dt. The cost of an optimum that is not found is NaN. The relative error is at most 1e-5,
        mostly 1e-8. The chunks do not depend on the number of workers, and each is computed with
        one BLAS thread, so the number of workers does not change a single bit of the results.

    Raises
    ------
    ValueError, RuntimeError
        If `ways` cannot be sent to another process, if a way has no curve for one of the problems,
        or if an integral does not converge. The message names the way and the chunk.

    Examples
    --------
    >>> from rbclassroom.surveys.atlas import random_problems
    >>> found = survey(random_problems(3, 1, rng=1))
    >>> bool(np.all(found["projection"] > found["optimum"]))
    True
    """
    if inertia is not None:  # raise a ValueError if the inertia is invalid
        rb.acceleration_cost(rb.geodesic_so3(np.eye(3), np.eye(3)), inertia)
    ways = closed_forms(inertia) if ways is None else ways
    for name, make in ways.items():
        try:
            signature(make).bind(*Ends._fields)
        except TypeError as error:
            raise ValueError(
                f"ways: make(R0, R1, w0, w1) is wanted, got {name!r}: {error}"
            ) from error
    if "optimum" in ways:
        raise ValueError("ways: names other than 'optimum', which is the reference, are wanted")
    measures = {name: partial(costs, make, inertia=inertia) for name, make in ways.items()}
    return _in_chunks({"optimum": partial(_least, inertia), **measures}, problems, executor, report)


def several_starts(problems: Ends, *, report: Report | None = None) -> dict[str, Array]:
    """Return the costs of the curves that Newton's method finds from each of several guesses.

    The guesses are `starts`, and the body is a ball. `problems` and `report` are those of
    `survey`. The curves are stationary, but none is proven to be the best. If no curve is found,
    the cost is NaN (BK (19)).
    """
    measures = {name: partial(_stationary, make) for name, make in starts().items()}
    return _in_chunks(measures, problems, None, report)


def costs(make: Maker, problems: Ends, inertia: ArrayLike | None = None) -> Array:
    """Return the costs of the curves ``make(R0, R1, w0, w1)`` for N problems, as `survey` does.

    `acceleration_cost` computes the cost of any curve, accurate to 1e-10 (BK (18)).

    Examples
    --------
    >>> from rbcourse import acceleration_cost, projected_cubic_so3
    >>> from rbclassroom.surveys.atlas import random_problems
    >>> ends = random_problems(2, 1, rng=1)
    >>> exact = acceleration_cost(projected_cubic_so3(*ends))
    >>> bool(np.allclose(costs(projected_cubic_so3, ends), exact, rtol=1e-6))
    True
    """
    curve = make(*problems)
    wanted = 3, (0, 1), problems.w0.shape[:-1]
    if not isinstance(curve, rb.Curve) or (curve.size, curve.domain, curve.batch_shape) != wanted:
        raise ValueError(
            f"make: one curve on SO(3) and [0, 1] per problem is wanted, got {curve!r}"
        )
    return rb.acceleration_cost(curve, inertia, rtol=1e-6)


def _least(inertia: ArrayLike | None, chunk: Ends) -> Array:
    # a cost of NaN needs no warning
    with warnings.catch_warnings(category=RuntimeWarning, action="ignore"):
        return np.asarray(rb.minimum_acceleration_so3(*chunk, inertia).cost)


def _stationary(make: Maker, chunk: Ends) -> Array:
    return np.asarray(rb.stationary_so3(make(*chunk)).cost)


def _in_chunks(
    measures: Measures, problems: Ends, executor: Executor | None, report: Report | None
) -> dict[str, Array]:
    """Return the values of some functions of N problems, computed chunk by chunk."""
    problems, work = Ends(*problems), partial(_of_chunk, measures)
    if problems.w0.ndim != 2:
        raise ValueError(f"problems: one batch axis is wanted, got {problems.w0.shape[:-1]}")
    total = len(problems.w0)
    firsts = range(0, total, CHUNK)
    chunks = [problems.take(slice(first, first + CHUNK)) for first in firsts]
    parts: list[Array] = [np.empty((len(measures), 0))]
    with ExitStack() as stack:
        if executor is None and len(chunks) > 1 and sys.platform != "emscripten":
            try:
                pickle.dumps(work)
            except (pickle.PicklingError, AttributeError, TypeError) as error:
                raise ValueError(
                    "ways: functions of a module, or partials of these, are wanted, because they "
                    f"are sent to other processes ({error})"
                ) from error
            executor = stack.enter_context(processes())
        stack.enter_context(threadpool_limits(1))  # all threads keep this limit until the end
        compute = map if executor is None else executor.map
        for part in compute(work, firsts, chunks):
            parts.append(part)
            if report:
                report(min(total, (len(parts) - 1) * CHUNK), total)
    return dict(zip(measures, np.concatenate(parts, axis=-1), strict=True))


def _of_chunk(measures: Measures, first: int, chunk: Ends) -> Array:
    with threadpool_limits(1):
        rows = []
        for name, measure in measures.items():
            try:
                rows.append(measure(chunk))
            except (ValueError, RuntimeError) as error:
                kind = ValueError if isinstance(error, ValueError) else RuntimeError
                raise kind(f"chunk from problem {first} on: {name}: {error}") from error
        return np.stack(rows)


@contextmanager
def processes(workers: int | None = None) -> Iterator[Executor]:
    """Yield an executor of `workers` processes on this machine, by default one per processor.

    The processes are new and share nothing with the threads of a notebook. They end when the
    ``with`` block ends or this process is killed. If an error or Ctrl-C ends the block, chunks that
    have not begun are not computed.
    """
    from concurrent.futures import ProcessPoolExecutor  # not available in web browsers

    pool = ProcessPoolExecutor(workers, get_context("spawn"), _end_with_parent)
    try:
        yield pool
    finally:
        pool.shutdown(cancel_futures=True)


def _end_with_parent() -> None:
    """Ignore Ctrl-C, and end this process if its parent is killed; no queue reports this."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = parent_process()
    assert parent is not None

    def wait() -> None:
        parent.join()
        os._exit(1)

    Thread(target=wait, daemon=True).start()
