"""Surveys: costs of curves for many ends, in chunks, on one machine or a cluster."""

from __future__ import annotations

import os
import pickle
import signal
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from functools import partial
from inspect import signature
from multiprocessing import get_context, parent_process
from threading import Thread

import numpy as np
from numpy.typing import ArrayLike
from threadpoolctl import threadpool_limits

from rbclassroom.surveys.atlas import Maker, closed_forms, starts
from rbcourse import (
    Array,
    Curve,
    Ends,
    acceleration_cost,
    geodesic_so3,
    minimum_acceleration_so3,
    stationary_so3,
)

Report = Callable[[int, int], object]

CHUNK = 500
"""So many problems are computed together."""


def survey(
    problems: Ends,
    executor: Executor | None = None,
    *,
    inertia: ArrayLike | None = None,
    ways: Mapping[str, Maker] | None = None,
    report: Report | None = None,
) -> dict[str, Array]:
    """Return the costs of the optimum and of closed forms, for each of many problems.

    Source: BK 1, BK 7, BK (18); for bodies beyond BK 1.

    Parameters
    ----------
    problems : Ends
        Arrays of one batch axis, N problems.
    executor : concurrent.futures.Executor, optional
        It computes the chunks of `CHUNK` problems: any executor whose workers can import
        `rbcourse`, for example ``Client(...).get_executor()`` of dask.distributed for a cluster. By
        default `processes`, on all processors of this machine; a single chunk is computed in this
        process.
    inertia : array_like, shape (3, 3), optional
        Of the body, in body axes. By default the body is a ball.
    ways : mapping of str to callable, optional
        The curves that are compared, ``make(R0, R1, w0, w1)``; by default `closed_forms`.
    report : callable, optional
        ``report(done, total)`` is called after each chunk with numbers of problems.

    Returns
    -------
    dict of str to ndarray, shape (N,)
        ∫ τᵀ G⁻¹ τ dt, for a ball ∫ 2 ‖w'‖² dt: of the "optimum", NaN where none is found, and of
        each of the ways, to 1e-5 relative, mostly to 1e-8. The chunks are always the same, each
        computed with one BLAS thread, so the number of workers does not change a single bit.

    Raises
    ------
    ValueError, RuntimeError
        If `ways` cannot be sent to another process, if a way has no curve for one of the problems,
        or if an integral does not settle. The message names the way and the chunk.

    Notes
    -----
    Ways that are sent to other processes have to be functions of a module, or partials of these;
    functions of a notebook are not. A script has to call this function below
    ``if __name__ == "__main__":``, as each new process imports the script.

    Examples
    --------
    >>> from rbclassroom.surveys.atlas import random_problems
    >>> found = survey(random_problems(3, 1, rng=1))
    >>> bool(np.all(found["projection"] > found["optimum"]))
    True
    """
    if inertia is not None:
        acceleration_cost(geodesic_so3(np.eye(3), np.eye(3)), inertia)  # raises if it is invalid
        inertia = np.asarray(inertia, float)
    ways = dict(closed_forms(inertia) if ways is None else ways)
    for name, make in ways.items():
        if not callable(make):
            raise ValueError(f"ways: {name!r} is no function")
        if (asked := _not_given(make)) is not None:
            raise ValueError(f"ways: {name!r} is called with R0, R1, w0, w1: {asked}")
        if name == "optimum":
            raise ValueError("ways: 'optimum' is the name of what all are compared with")
    work = partial(_costs, inertia, tuple(ways.items()))
    return _in_chunks(work, ["optimum", *ways], problems, executor, report)


def several_starts(
    problems: Ends, executor: Executor | None = None, *, report: Report | None = None
) -> dict[str, Array]:
    """Return the costs of the curves that Newton's method finds from several guesses, by guess.

    The guesses are `starts`; the body is a ball; `problems`, `executor` and `report` are those of
    `survey`. The curves are stationary; none is proven to be the best. NaN where none is found
    (BK (19)).
    """
    return _in_chunks(_from_each_start, list(starts()), problems, executor, report)


def costs(make: Maker, problems: Ends, inertia: ArrayLike | None = None) -> Array:
    """Return the costs of the curves ``make(R0, R1, w0, w1)`` for N problems, as `survey` does.

    See `acceleration_cost` for 1e-10, and for any curve (BK (18)).

    Examples
    --------
    >>> from rbcourse import acceleration_cost, projected_cubic_so3
    >>> from rbclassroom.surveys.atlas import random_problems
    >>> ends = random_problems(2, 1, rng=1)
    >>> exact = acceleration_cost(projected_cubic_so3(*ends))
    >>> bool(np.allclose(costs(projected_cubic_so3, ends), exact, rtol=1e-6))
    True
    """
    problems, curve = _checked(problems), make(*problems)
    if (
        not isinstance(curve, Curve)
        or (curve.size, curve.domain) != (3, (0, 1))
        or curve.batch_shape != problems.w0.shape[:-1]
    ):
        raise ValueError(f"make: curves on SO(3) and [0, 1] are wanted, one each, got {curve!r}")
    return acceleration_cost(curve, inertia, rtol=1e-6)


def _checked(problems: Ends) -> Ends:
    problems = Ends(*problems)
    if problems.w0.ndim != 2:
        raise ValueError(f"problems: one batch axis is wanted, got {problems.w0.shape[:-1]}")
    return problems


def _in_chunks(
    work: Callable[[Ends], Array],
    names: Sequence[str],
    problems: Ends,
    executor: Executor | None,
    report: Report | None,
) -> dict[str, Array]:
    """Return ``work(chunk)``, shape (len(names), n), of all chunks together, by name."""
    problems = _checked(problems)
    total = len(problems.w0)
    chunks = [problems.take(slice(k, k + CHUNK)) for k in range(0, total, CHUNK)]
    if executor is None and len(chunks) > 1:
        _check_that_it_can_be_sent(work)
        with processes() as own:
            return _in_chunks(work, names, problems, own, report)
    alone, found = partial(_alone, os.getpid(), work), list[Array]([np.empty((len(names), 0))])
    with threadpool_limits(1):
        results = iter(map(alone, chunks) if executor is None else executor.map(alone, chunks))
        for k in range(len(chunks)):
            try:
                found.append(next(results))
            except (ValueError, RuntimeError) as error:
                kind = ValueError if isinstance(error, ValueError) else RuntimeError
                raise kind(f"chunk {k}, from problem {k * CHUNK} on: {error}") from error
            if report:
                report(min(total, (k + 1) * CHUNK), total)
    return dict(zip(names, np.concatenate(found, axis=-1), strict=True))


@contextmanager
def processes(workers: int | None = None) -> Iterator[Executor]:
    """Give an executor of `workers` processes of this machine, by default one per processor.

    The processes are new ones: they share nothing with a notebook's threads. They end with the
    block, and when this process is killed. When an error or Ctrl-C ends the block, the chunks that
    have not begun are dropped.
    """
    with ProcessPoolExecutor(workers, get_context("spawn"), _end_with_parent) as pool:
        try:
            yield pool
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise


def _end_with_parent() -> None:
    """Leave Ctrl-C to the parent, and end when it is killed: the queue of work does not tell."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = parent_process()
    assert parent is not None

    def wait() -> None:
        parent.join()
        os._exit(1)

    Thread(target=wait, daemon=True).start()


def _check_that_it_can_be_sent(work: Callable[[Ends], Array]) -> None:
    try:
        pickle.dumps(work)
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        raise ValueError(
            f"ways: functions of a module, or partials of these, are wanted, for they are sent to "
            f"other processes ({error})"
        ) from error


def _alone(own: int, work: Callable[[Ends], Array], chunk: Ends) -> Array:
    """Return ``work(chunk)``, with one BLAS thread in another process than `own`."""
    if os.getpid() == own:  # where it is limited while the survey lasts
        return work(chunk)
    with threadpool_limits(1):
        return work(chunk)


def _not_given(make: Maker) -> str | None:
    """Return why a function cannot be called with four arguments; None if it can."""
    try:
        signature(make).bind(*Ends._fields)
    except TypeError as error:
        return str(error)
    except ValueError:  # of a function without a signature
        return None
    return None


def _costs(inertia: Array | None, ways: Sequence[tuple[str, Maker]], chunk: Ends) -> Array:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # where none is found there is NaN
        found = [np.asarray(minimum_acceleration_so3(*chunk, inertia).cost)]
    for name, make in ways:
        try:
            found.append(costs(make, chunk, inertia))
        except (ValueError, RuntimeError) as error:
            kind = ValueError if isinstance(error, ValueError) else RuntimeError
            raise kind(f"{name}: {error}") from error
    return np.stack(found)


def _from_each_start(chunk: Ends) -> Array:
    return np.stack([stationary_so3(make(*chunk)).cost for make in starts().values()])
