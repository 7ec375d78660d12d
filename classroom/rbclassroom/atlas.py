"""The atlas: surveys of the problems and bodies for which a closed form is near the optimum.

``python -m rbclassroom.atlas`` computes the tables of lesson 13 again, in some minutes.
"""

from __future__ import annotations

import csv
import signal
import sys
import warnings
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import ExitStack
from functools import partial
from itertools import product
from multiprocessing import get_context
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

import rbcourse as rb
from rbclassroom.figures import FORMS, quantile, rounded
from rbcourse import Array, Body, Curve, exp_so3, sample_rotation
from rbcourse.draw.save import csv_text
from rbcourse.files import replace_file
from rbcourse.sampling import Rng

Makers = Mapping[str, Callable[..., Curve]]
Columns = dict[str, NDArray[Any]]

CELLS = 10
"""The number of steps into which the atlas divides the displacement and the end velocity."""
FASTEST = 9.0
"""The largest √(‖w0‖² + ‖w1‖²) of the atlas, in rad per unit time."""
FAMILIES = "along", "across"
"""Directions of the end velocities in lesson 12: along the displacement's axis, or across it."""
CHUNK = 500
"""The number of problems that are computed together."""

BODIES = {
    "ball": Body.ball(),
    "brick": Body.box([0.28, 0.24, 0.20]),
    "book": Body.box([0.30, 0.20, 0.03]),
}
"""A ball, a brick that is nearly a cube, and a book."""
DOMAINS = {"small": 2, "medium": 5, "all": CELLS}
"""For each domain, the number of steps of displacement and end velocity, counted from 0."""
TABLES = Path(__file__).parent


class Problems(NamedTuple):
    """Rotations and angular velocities at both ends of N curves.

    ``make(*problems)`` calls a function ``make(R0, R1, w0, w1)``.

    Parameters
    ----------
    R0, R1, w0, w1 : ndarray, shapes (N, 3, 3) and (N, 3)
    """

    R0: Array
    R1: Array
    w0: Array
    w1: Array

    def take(self, index: Any) -> Problems:
        """Return the problems that a NumPy index selects."""
        return Problems._make(x[index] for x in self)


def closed_forms(body: Body | None = None) -> Makers:
    """Return the closed forms that are compared: `FORMS`, and two that depend on a given body."""
    if body is None:
        return FORMS
    weighted = partial(rb.projected_cubic, body=body)
    normal = partial(rb.closed_forms.normal_cubic, body=body)
    return {"projection": FORMS["projection"], "weighted": weighted, **FORMS, "normal": normal}


def atlas_problems(draws: int, families: Sequence[str] = FAMILIES, *, rng: Rng = None) -> Problems:
    """Return `draws` random problems in every cell of the atlas.

    A cell is a family, a step of the displacement ‖σ‖ from 0 to π, and a step of the end velocity v
    = √(‖w0‖² + ‖w1‖²) from 0 to `FASTEST`. Within a cell, ‖σ‖ and v are uniform. A random angle
    divides v between w0 and w1. In the family "along", both velocities point along the axis of σ or
    against it. In "across", each velocity has a random direction perpendicular to the axis; in
    "any", it has any random direction. The problems are sorted by family, displacement, end
    velocity and draw. R0 and the axis of σ are uniform.
    """
    rng = np.random.default_rng(rng)
    family, turn, speed = np.indices((len(families), CELLS, CELLS, draws))[:3].reshape(3, -1)
    count = len(family)
    angle = (turn + rng.random(count)) * np.pi / CELLS
    v = (speed + rng.random(count)) * FASTEST / CELLS
    share, *spins = 2 * np.pi * rng.random((3, count))
    frames, R0 = sample_rotation(count, rng=rng), sample_rotation(count, rng=rng)
    axis, first, second = np.moveaxis(frames, -1, 0)

    velocities = []
    for size, spin in zip((v * np.cos(share), v * np.sin(share)), spins, strict=True):
        across = np.cos(spin)[:, None] * first + np.sin(spin)[:, None] * second
        ways = {"along": axis, "across": across}
        if "any" in families:
            ways["any"] = sample_rotation(count, rng=rng)[..., 0]
        direction = np.choose(family[:, None], [ways[name] for name in families])
        velocities.append(size[:, None] * direction)
    return Problems(R0, R0 @ exp_so3(angle[:, None] * axis), *velocities)


def random_problems(count: int, size: float, *, rng: Rng = None) -> Problems:
    """Return problems with σ in a ball of radius `size`, and w0 and w1 in a ball twice as large."""
    rng = np.random.default_rng(rng)
    radii = size * np.array([[1.0], [2.0], [2.0]]) * np.cbrt(rng.random((3, count)))
    directions = rng.standard_normal((3, count, 3))
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    sigma, w0, w1 = radii[..., None] * directions
    R0 = sample_rotation(count, rng=rng)
    return Problems(R0, R0 @ exp_so3(sigma), w0, w1)


def survey(
    problems: Problems,
    executor: Executor | None = None,
    *,
    body: Body | None = None,
    ways: Makers | None = None,
    title: str = "",
) -> dict[str, Array]:
    """Return the costs of the optimum and of closed forms for N problems, an array for each curve.

    Source: BK 1, BK 7, BK (18); for real bodies, beyond BK 1.

    The relative error is at most 1e-5, mostly 1e-8. An optimum that is not found costs NaN. The
    number of workers does not change a bit of the results.

    Parameters
    ----------
    problems : Problems
    executor : concurrent.futures.Executor, optional
        Computes chunks of `CHUNK` problems, for example ``Client(...).get_executor()`` of
        dask.distributed. By default new processes compute them if there are several chunks; a
        script then calls this function below ``if __name__ == "__main__":``.
    body : Body, optional
        The body that moves; the default is the ball.
    ways : mapping of str to callable, optional
        Functions ``make(R0, R1, w0, w1)`` of the compared curves, by default `closed_forms`. Other
        processes need functions of a module, or partials of these.
    title : str, optional
        The title of a line that shows the progress.

    Examples
    --------
    >>> found = survey(random_problems(3, 1, rng=1), title="Problems")
    Problems: 3 of 3
    """
    work = partial(_survey_chunk, closed_forms(body) if ways is None else ways, body)
    total = len(problems.w0)
    chunks = [problems.take(slice(k, k + CHUNK)) for k in range(0, max(total, 1), CHUNK)]
    parts = list[dict[str, Array]]()
    with ExitStack() as stack:
        if executor is None and len(chunks) > 1 and sys.platform != "emscripten":
            from concurrent.futures import ProcessPoolExecutor  # not available in web browsers

            # new processes share nothing with a notebook's threads; they ignore Ctrl-C
            new, ignored = get_context("spawn"), (signal.SIGINT, signal.SIG_IGN)
            executor = stack.enter_context(ProcessPoolExecutor(None, new, signal.signal, ignored))
        stack.enter_context(threadpool_limits(1))  # all threads keep this limit until the end
        for part in (executor.map if executor else map)(work, chunks):
            parts.append(part)
            if title:
                done = min(total, len(parts) * CHUNK)
                end = "\r" if done < total else "\n"
                print(f"{title}: {done:,} of {total:,}", end=end, flush=True)
    return _joined(parts)


def _survey_chunk(ways: Makers, body: Body | None, chunk: Problems) -> dict[str, Array]:
    # neither a cost of NaN nor a small margin needs a warning
    with threadpool_limits(1), warnings.catch_warnings(category=RuntimeWarning, action="ignore"):
        found = {"optimum": np.asarray(rb.minimum_acceleration(*chunk, body=body).cost)}
        for name, make in ways.items():
            try:
                found[name] = costs(make, chunk, body)
            except Exception as error:
                error.add_note(f"This is the curve {name!r} of the survey.")
                raise
    return found


def costs(make: Callable[..., Curve], problems: Problems, body: Body | None = None) -> Array:
    """Return the costs of the curves ``make(R0, R1, w0, w1)`` for N problems, as `survey` does."""
    return np.asarray(rb.acceleration_cost(make(*problems), body=body or Body.ball(), rtol=1e-6))


def excesses(problems: Problems, found: Columns, body: Body | None = None) -> Columns:
    """Return the excesses in a survey: each cost divided by the optimum's cost, minus 1.

    The excess is NaN if the optimum was not found, or if its cost is too small for a ratio: below
    1e-4 (‖σ‖² + ‖w0‖² + ‖w1‖²), where ‖x‖² denotes ½ xᵀ G x with the
    inertia G of the body (2 I for the ball).
    """
    half = (body or Body.ball()).inertia / 2
    R0, R1, w0, w1 = problems
    size = sum(np.sum(x * (x @ half), axis=-1) for x in (rb.log_so3(R0.mT @ R1), w0, w1))
    optimum = np.where(found["optimum"] < 1e-4 * size, np.nan, found["optimum"])
    return {way: cost / optimum - 1 for way, cost in found.items() if way != "optimum"}


def cell_table(
    excess: Columns, draws: int, shares: Mapping[str, float], families: Sequence[str] = FAMILIES
) -> Columns:
    """Return quantiles of `excesses` in each cell of `atlas_problems`, as a table.

    The table has a row for each cell. Its columns are the family, the middle of the cell, the
    number of problems that count, and a `quantile` for each name in `shares` and each curve.
    """
    family, turn, speed = np.indices((len(families), CELLS, CELLS)).reshape(3, -1)
    cells = {way: x.reshape(-1, draws) for way, x in excess.items()}
    named = product(shares.items(), cells.items())
    return {
        "family": np.array(families)[family],
        "displacement [rad]": (turn + 0.5) * np.pi / CELLS,
        "end velocity [rad]": (speed + 0.5) * FASTEST / CELLS,
        "problems [1]": np.sum(~np.isnan(next(iter(cells.values()))), axis=-1),
        **{f"{way} {name} [1]": quantile(x, share) for (name, share), (way, x) in named},
    }


def body_excesses(
    problems: Problems, body: Body, executor: Executor | None = None, title: str = ""
) -> Columns:
    """Return the excesses of all curves of lesson 13.

    After the closed forms come "two Béziers", the cheaper of two Bézier curves, one of them the
    long way round; "three", the cheapest of these two and "normal"; and the optimum for a ball.
    """
    # the correction of the corrected Bézier curve is for a ball
    forms = {name: make for name, make in closed_forms(body).items() if name != "corrected"}
    long = partial(rb.closed_forms.bezier, long=True)
    ways: Makers = {"long way": long, "ball's optimum": rb.minimum_acceleration}
    found = survey(problems, executor, body=body, ways={**forms, **ways}, title=title)
    excess = excesses(problems, found, body)
    two = np.fmin(excess["Bézier"], excess["long way"])
    excess |= {"two Béziers": two, "three": np.fmin(two, excess["normal"])}
    return {name: excess[name] for name in (*forms, "two Béziers", "three", "ball's optimum")}


def domain(name: str, draws: int) -> NDArray[np.bool_]:
    """Tell which of the `atlas_problems` of one family belong to a domain."""
    turn, speed, _ = np.indices((CELLS, CELLS, draws)).reshape(3, -1)
    return (turn < DOMAINS[name]) & (speed < DOMAINS[name])


def intervals(excess: Columns, draws: int) -> Columns:
    """Return quantiles and shares of the excess, with 95 % intervals, for each domain and curve.

    The columns are the median, the 90 % quantile, and the share of the problems with an excess
    below a tenth; after each value come the ends of its interval. Those of quantiles are values of
    the sample, with ranks from the binomial distribution; those of shares are by Clopper and
    Pearson. Both hold for independent problems. Since each cell has the same number of problems,
    the intervals are too long rather than too short. Problems with a NaN do not count.
    """
    from scipy.stats import binomtest, quantile_test  # loads slowly, and only here

    known = ~np.isnan(list(excess.values())).any(axis=0)
    rows = []
    for name, (curve, values) in product(DOMAINS, excess.items()):
        x = values[domain(name, draws) & known]
        row: dict[str, Any] = {"domain": name, "curve": curve, "problems [1]": len(x)}
        small = binomtest(int(np.sum(x < 0.1)), len(x))
        for words, found in {
            "median": (np.quantile(x, 0.5), *quantile_test(x, p=0.5).confidence_interval()),
            "90 %": (np.quantile(x, 0.9), *quantile_test(x, p=0.9).confidence_interval()),
            "within a tenth": (small.statistic, *small.proportion_ci()),
        }.items():
            keys = f"{words} [1]", f"{words} low [1]", f"{words} high [1]"
            row |= dict(zip(keys, rounded(np.array(found)), strict=True))
        rows.append(row)
    return {key: np.array([row[key] for row in rows]) for key in rows[0]}


def stored(table: str) -> Columns:
    """Return a stored table of lesson 13, "maps" (for the first seed) or "intervals"."""
    with (TABLES / f"atlas_{table}.csv").open(encoding="utf-8", newline="") as file:
        names, *rows = csv.reader(file)
    columns = zip(names, zip(*rows, strict=True), strict=True)
    return {name: np.array(x, float if name.endswith("]") else str) for name, x in columns}


def write_tables(draws: int = 200, seeds: Sequence[int] = (31, 32, 33)) -> None:
    """Compute both tables of lesson 13, with `draws` problems in each cell for each seed."""
    tables: dict[str, list[Columns]] = {"maps": [], "intervals": []}
    for seed, (name, body) in product(seeds, BODIES.items()):
        problems = atlas_problems(draws, ["any"], rng=seed)
        excess = body_excesses(problems, body, None, f"{name}, seed {seed}")
        cells = cell_table(excess, draws, {"median": 0.5, "90 %": 0.9}, [name])
        known = intervals(excess, draws)
        named = {"seed [1]": seed, "body": name}
        columns = {key: np.full(len(known["curve"]), x) for key, x in named.items()}
        tables["intervals"].append(columns | known)
        if seed == seeds[0]:
            tables["maps"].append({"body": cells.pop("family")} | cells)
    for table, parts in tables.items():
        file = TABLES / f"atlas_{table}.csv"
        replace_file(file, csv_text(_joined(parts)).encode())
        print(f"{file} is written.")


def _joined(parts: Sequence[Columns]) -> Columns:
    return {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}


if __name__ == "__main__":
    write_tables()
