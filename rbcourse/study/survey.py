"""Surveys: what curves cost for many ends, chunk by chunk, on one machine or a cluster."""

from __future__ import annotations

import hashlib
import os
import signal
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from functools import partial
from multiprocessing import get_context, parent_process
from pathlib import Path
from threading import Thread
from zipfile import BadZipFile

import numpy as np
from numpy.typing import ArrayLike
from threadpoolctl import threadpool_limits

from rbcourse import __version__
from rbcourse._numerics import Array, blocks
from rbcourse.cost import rotation_cost
from rbcourse.curves import Ends, check_ends, with_inertia
from rbcourse.functionals import BallAcceleration, Effort, Functional
from rbcourse.optimum import Optimum, from_guess
from rbcourse.search import ball, body, cheapest
from rbcourse.study.atlas import Maker, closed_forms, starts

Report = Callable[[int, int], object]

CHUNK = 500
"""So many problems are computed, and written, together."""


def survey(
    problems: Ends,
    executor: Executor | None = None,
    *,
    inertia: ArrayLike | None = None,
    ways: Mapping[str, Maker] | None = None,
    folder: str | os.PathLike[str] | None = None,
    report: Report | None = None,
) -> dict[str, Array]:
    """Return what the optimum and closed forms cost, for each of many problems.

    Parameters
    ----------
    problems : Ends
        Arrays of one batch axis, N problems.
    executor : concurrent.futures.Executor, optional
        What computes the chunks of `CHUNK` problems, with one BLAS thread for each: any executor
        whose workers can import `rbcourse`, for example ``Client(...).get_executor()`` of
        dask.distributed for a cluster. By default `processes`, on all processors of this machine;
        a single chunk is computed in this process.
    inertia : array_like, shape (3, 3), optional
        Of the body, in body axes. By default the body is a ball.
    ways : mapping of str to callable, optional
        The curves that are compared, ``make(R0, R1, w0, w1)``; by default `closed_forms`. To be
        sent to another process they have to be functions of a module, or partials of these.
    folder : path, optional
        Each chunk is written there as soon as it is done. A survey that was stopped, and is called
        again in the same way, goes on with the chunks that are missing.
    report : callable, optional
        ``report(done, total)`` is called after each chunk with numbers of problems.

    Returns
    -------
    dict of str to ndarray, shape (N,)
        ∫ τᵀ G⁻¹ τ dt, for a ball ∫ 2 ‖w'‖² dt: of the "optimum", NaN where none is found, and of
        each of the ways, to about 1e-7 relative. The chunks are always the same, so the number of
        workers does not change a single bit.

    Raises
    ------
    ValueError
        If an argument is not of its shape, or `folder` has a chunk of another survey, or one that
        cannot be read.

    References
    ----------
    BK 1, BK 7, BK (18); for bodies beyond BK 1.

    Examples
    --------
    >>> from rbcourse.study.atlas import random_problems
    >>> found = survey(random_problems(3, 1, rng=1))
    >>> bool(np.all(found["projection"] > found["optimum"]))
    True
    """
    ways = closed_forms(inertia) if ways is None else ways
    if inertia is not None:
        inertia = with_inertia(problems, inertia)[1][:1]
    work = partial(_costs, inertia, tuple(ways.values()))
    return _in_chunks(work, ["optimum", *ways], problems, executor, inertia, folder, report)


def several_starts(
    problems: Ends, executor: Executor | None = None, *, report: Report | None = None
) -> dict[str, Array]:
    """Return the costs of the curves that Newton's method finds from several guesses, by guess.

    The arguments are those of `survey`, for a ball; the guesses are `starts`. The curves are
    stationary; none is proven to be the best. NaN where none is found (BK (19)).
    """
    return _in_chunks(_from_each_start, list(starts()), problems, executor, report=report)


def costs(make: Maker, problems: Ends, inertia: ArrayLike | None = None) -> Array:
    """Return what the curves of ``make(R0, R1, w0, w1)`` cost for N problems, as `survey` does.

    See `acceleration_cost` for 1e-10, and for any curve (BK (18)).

    Examples
    --------
    >>> from rbcourse import acceleration_cost, projected_cubic_so3
    >>> from rbcourse.study.atlas import random_problems
    >>> ends = random_problems(2, 1, rng=1)
    >>> exact = acceleration_cost(projected_cubic_so3(*ends))
    >>> bool(np.allclose(costs(projected_cubic_so3, ends), exact, rtol=1e-6))
    True
    """
    functional: Functional = BallAcceleration()
    if inertia is not None:
        functional = Effort(with_inertia(problems, inertia)[1], of_torque=False)
    panels = np.array([0.0, 0.5, 1.0])
    return rotation_cost("cost", make(*problems), functional, panels, 1e-6)


def _in_chunks(
    work: Callable[[Ends], Array],
    names: Sequence[str],
    problems: Ends,
    executor: Executor | None = None,
    inertia: Array | None = None,
    folder: str | os.PathLike[str] | None = None,
    report: Report | None = None,
) -> dict[str, Array]:
    """Return ``work(chunk)``, shape (len(names), n), of all chunks together, by name.

    The other arguments are those of `survey`; chunks on the disk are told apart by the problems,
    the inertia, the names and the version of the package.
    """
    problems = check_ends(*problems)
    if problems.w0.ndim != 2:
        raise ValueError(f"problems: one batch axis is wanted, got {problems.w0.shape[:-1]}")
    total = len(problems.w0)
    chunks = [problems.of(part) for part in blocks(total, CHUNK)]
    found: dict[int, Array] = {}
    files = {}
    if folder is not None:
        of = " ".join([__version__, *names]), np.zeros(0) if inertia is None else inertia
        files = {k: _File(Path(folder), k, (*of, *chunk)) for k, chunk in enumerate(chunks)}
        found = {k: file.read() for k, file in files.items() if file.path.exists()}
    missing = [k for k in range(len(chunks)) if k not in found]
    done = sum(len(chunks[k].w0) for k in found)
    for k, result in _results(partial(_alone, work), chunks, missing, executor):
        found[k] = result
        if k in files:
            files[k].write(result)
        done += len(chunks[k].w0)
        if report:
            report(done, total)
    columns = [found[k] for k in range(len(chunks))] or [np.empty((len(names), 0))]
    return dict(zip(names, np.concatenate(columns, axis=-1), strict=True))


@contextmanager
def processes(workers: int | None = None) -> Iterator[Executor]:
    """Give an executor of `workers` processes of this machine, by default one per processor.

    The processes are new ones: they share nothing with a notebook's threads. They end with the
    block, and when this process is killed. When the block is left by an error, chunks that have not
    begun are dropped.
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


def _results(
    work: Callable[[Ends], Array], chunks: list[Ends], missing: list[int], executor: Executor | None
) -> Iterator[tuple[int, Array]]:
    """Yield the numbers and the results of the missing chunks, in the order in which they end."""
    if executor is not None:
        numbers = {executor.submit(work, chunks[k]): k for k in missing}
        try:
            for future in as_completed(numbers):
                yield numbers[future], future.result()
        finally:
            for future in numbers:
                future.cancel()
    elif len(missing) == 1:
        yield missing[0], work(chunks[missing[0]])
    elif missing:
        with processes() as own:
            yield from _results(work, chunks, missing, own)


def _alone(work: Callable[[Ends], Array], chunk: Ends) -> Array:
    """Return ``work(chunk)``, with one BLAS thread."""
    with threadpool_limits(1):
        return work(chunk)


def _costs(inertia: Array | None, makers: Sequence[Maker], chunk: Ends) -> Array:
    task = ball(chunk) if inertia is None else body(*with_inertia(chunk, inertia), of_torque=False)
    best = Optimum(task.functional, task.equations.ends, cheapest(task), task.batch).cost
    return np.stack([best, *(costs(make, chunk, inertia) for make in makers)])


def _from_each_start(chunk: Ends) -> Array:
    return np.stack([from_guess(chunk, make(*chunk)).cost for make in starts().values()])


class _File:
    """A chunk on the disk: what was found, and a digest of what it was found for."""

    def __init__(self, folder: Path, number: int, of: Sequence[str | Array]) -> None:
        self.path = folder / f"chunk_{number:05}.npz"
        digest = hashlib.sha256()
        for part in of:
            digest.update(part.encode() if isinstance(part, str) else part.tobytes())
        self.digest = digest.hexdigest()

    def read(self) -> Array:
        """Return what was found."""
        try:
            with self.path.open("rb") as file, np.load(file) as content:
                digest, found = str(content["digest"]), content["costs"]
        except (OSError, ValueError, KeyError, EOFError, BadZipFile) as error:
            raise ValueError(f"folder: {self.path} cannot be read ({error}): delete it") from None
        if digest != self.digest:
            raise ValueError(
                f"folder: {self.path} belongs to another survey, or to another version of the "
                "package: choose another folder, or delete this one"
            )
        return found

    def write(self, found: Array) -> None:
        """Write what was found, all of it or nothing."""
        self.path.parent.mkdir(parents=True, exist_ok=True)
        unfinished = self.path.with_suffix(".unfinished")
        with unfinished.open("wb") as file:
            np.savez(file, digest=self.digest, costs=found)
        unfinished.replace(self.path)
