"""The atlas of real bodies, lesson 13: which curve is near the optimum, for which body.

``course.py atlas`` calls this module. It takes some minutes, shows how far it is, and goes on where
it was stopped.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binomtest, quantile_test
from tqdm import tqdm

from rbclassroom.surveys.atlas import (
    CELLS,
    FASTEST,
    Maker,
    atlas_problems,
    cell_table,
    closed_forms,
    excesses,
    rounded,
)
from rbclassroom.surveys.survey import processes, survey
from rbcourse import Array, Ends, bezier_long_so3, minimum_acceleration_so3
from rbcourse.draw.save import csv_text
from rbcourse.metrics import METRIC_SO3, box_inertia

BODIES = {
    "ball": METRIC_SO3,
    "brick": box_inertia([0.28, 0.24, 0.20]),
    "book": box_inertia([0.30, 0.20, 0.03]),
}
"""The inertia of a ball, of a brick that is nearly a cube, and of a book."""
CLOSED_FORMS = (
    *("projection", "weighted", "exponential", "Bézier"),
    *("cumulative", "quaternion", "Cayley", "normal"),
)
"""The closed forms among the curves; "weighted" and "normal" know the inertia."""
CURVES = (*CLOSED_FORMS, "two Béziers", "three", "ball's optimum")
"""What is compared: "two Béziers" is the cheaper of the two ways round, "three" the cheapest of
these and "normal", and "ball's optimum" the optimum for a ball, which is no closed form."""
DOMAINS = {"small": 2, "medium": 5, "all": CELLS}
"""So many steps of the displacement, from 0, and of the end velocity belong to a domain."""
SEEDS = 31, 32, 33
"""Of the problems; the maps are of the first."""
DRAWS = 200
"""Problems in each of the 10 × 10 cells: 20,000."""
TABLES = Path(__file__).parent
"""Where the tables of the atlas are stored."""

_CONFIDENCE = 0.95


def body_problems(draws: int, seed: int) -> Ends:
    """Return the problems of the atlas: end velocities in any direction.

    Examples
    --------
    >>> len(body_problems(2, 31).w0)
    200
    """
    return atlas_problems(draws, ["any"], rng=seed)


def curves_for(body: str) -> dict[str, Maker]:
    """Return the curves that a survey needs for the excesses of `CURVES`."""
    compared = closed_forms(BODIES[body])
    return {
        **{name: compared[name] for name in CLOSED_FORMS},
        "other way": bezier_long_so3,
        "ball's optimum": minimum_acceleration_so3,
    }


def with_choices(excess: Mapping[str, Array]) -> dict[str, Array]:
    """Return the excesses of all `CURVES`, from those of the curves of a survey."""
    two = np.fmin(excess["Bézier"], excess["other way"])
    chosen = {"two Béziers": two, "three": np.fmin(two, excess["normal"])}
    return {name: {**excess, **chosen}[name] for name in CURVES}


def domain(name: str, draws: int) -> NDArray[np.bool_]:
    """Return which of the `body_problems` belong to a domain.

    Examples
    --------
    >>> int(domain("small", 200).sum())
    800
    """
    turn, speed, _ = np.indices((CELLS, CELLS, draws)).reshape(3, -1)
    return (turn < DOMAINS[name]) & (speed < DOMAINS[name])


def domain_in_words(name: str) -> str:
    """Return the limits of a domain.

    Examples
    --------
    >>> domain_in_words("medium")
    'up to 90° and 4.5 rad'
    """
    share = DOMAINS[name] / CELLS
    return f"up to {180 * share:g}° and {FASTEST * share:g} rad"


def maps(excess: Mapping[str, Mapping[str, Array]], draws: int) -> dict[str, Array]:
    """Return the medians and the 90 % quantiles in each cell, for each body, as a table."""
    parts = []
    for body, of_body in excess.items():
        tables = {
            name: cell_table(of_body, draws, share, ["any"])
            for name, share in (("median", 0.5), ("90 %", 0.9))
        }
        part: dict[str, Array] = {"body": np.full(CELLS**2, body)}
        part |= {key: x for key, x in tables["median"].items() if "excess" not in key}
        for name, table in tables.items():
            part |= {f"{curve} {name} [1]": table[f"{curve} excess [1]"] for curve in CURVES}
        del part["family"]
        parts.append(part)
    return _joined(parts)


def intervals(excess: Mapping[str, Array], draws: int) -> dict[str, Array]:
    """Return for each domain and curve what is known of its excess, with 95 % intervals.

    The columns: the median and the 90 % quantile, the share of the problems within a tenth of the
    optimum, and the share for which it is the cheapest of the `CLOSED_FORMS`, the first of equals,
    NaN for what is none; each with the ends of its interval, "low" and "high". Those of quantiles
    are numbers of the sample, by the binomial law, NaN where it is too small; those of shares are
    Clopper and Pearson's. Both hold for independent problems, and are too long, rather than too
    short, for a sample with the same number of problems in each cell. All are rounded to four
    digits. Problems with a NaN do not count.
    """
    cheapest = np.argmin([excess[curve] for curve in CLOSED_FORMS], axis=0)
    known = ~np.isnan([excess[curve] for curve in CURVES]).any(axis=0)
    rows = []
    for name in DOMAINS:
        inside = domain(name, draws) & known
        for curve in CURVES:
            x = excess[curve][inside]
            row: dict[str, object] = {"domain": name, "curve": curve, "problems [1]": len(x)}
            for words, share in (("median", 0.5), ("90 %", 0.9)):
                row |= _with_ends(words, float(np.quantile(x, share)), *_around(x, share))
            row |= _share("within a tenth", x < 0.1)
            row |= _share(
                "cheapest",
                cheapest[inside] == CLOSED_FORMS.index(curve) if curve in CLOSED_FORMS else None,
            )
            rows.append(row)
    return {key: np.array([row[key] for row in rows]) for key in rows[0]}


def _around(x: Array, share: float) -> tuple[float, float]:
    interval = quantile_test(x, p=share).confidence_interval(_CONFIDENCE)
    return float(interval.low), float(interval.high)


def _share(words: str, chosen: NDArray[np.bool_] | None) -> dict[str, float]:
    if chosen is None:
        return _with_ends(words, np.nan, np.nan, np.nan)
    test = binomtest(int(chosen.sum()), len(chosen))
    interval = test.proportion_ci(_CONFIDENCE)
    return _with_ends(words, float(chosen.mean()), float(interval.low), float(interval.high))


def _with_ends(words: str, value: float, low: float, high: float) -> dict[str, float]:
    keys = f"{words} [1]", f"{words} low [1]", f"{words} high [1]"
    return dict(zip(keys, rounded(np.array([value, low, high])).tolist(), strict=True))


def stored(table: str) -> dict[str, NDArray[Any]]:
    """Return a table of the atlas that comes with the package: "maps" or "intervals".

    Examples
    --------
    >>> table = stored("intervals")
    >>> row = (table["body"] == "book") & (table["domain"] == "all") & (table["curve"] == "normal")
    >>> [float(x) for x in table["median [1]"][row]]  # for three seeds
    [0.08113, 0.07856, 0.08171]
    """
    if table not in ("maps", "intervals"):
        raise ValueError(f"table: 'maps' or 'intervals' wanted, got {table!r}")
    with (TABLES / f"atlas_{table}.csv").open(encoding="utf-8", newline="") as file:
        names, *rows = csv.reader(file)
    columns = dict(zip(names, zip(*rows, strict=True), strict=True))
    return {
        name: np.array(column, float if name.endswith("]") else str)
        for name, column in columns.items()
    }


def make_tables(
    chunks: Path,
    tables: Path = TABLES,
    draws: int = DRAWS,
    seeds: Sequence[int] = SEEDS,
    executor: Executor | None = None,
) -> None:
    """Compute the atlas, and write `maps` of the first seed and the `intervals` of each.

    The costs of each body and seed are kept in a file of the folder `chunks`, so that a run that
    was stopped goes on. The files are deleted when the `tables` are written.
    """
    if executor is None:
        with processes() as own:
            return make_tables(chunks, tables, draws, seeds, own)
    parts, first, kept = [], {}, []
    for seed in seeds:
        problems = body_problems(draws, seed)
        for body, inertia in BODIES.items():
            kept.append(chunks / f"{body}-{seed}-{draws}.npz")
            costs = _kept_costs(kept[-1], problems, body, executor)
            excess = with_choices(excesses(problems, costs, inertia))
            if seed == seeds[0]:
                first[body] = excess
            table = intervals(excess, draws)
            count = len(table["curve"])
            parts.append({"seed [1]": np.full(count, seed), "body": np.full(count, body), **table})
    for name, table in {"maps": maps(first, draws), "intervals": _joined(parts)}.items():
        text = csv_text(table)
        (tables / f"atlas_{name}.csv").write_text(text, encoding="utf-8", newline="\n")
    for path in kept:
        path.unlink()


def _kept_costs(path: Path, problems: Ends, body: str, executor: Executor) -> dict[str, Array]:
    """Return the costs of a file; where it is missing, compute them and write it."""
    if path.exists():
        return dict(np.load(path))
    with tqdm(desc=path.stem, total=len(problems.w0), unit="problem") as bar:

        def report(done: int, total: int) -> None:
            bar.update(done - bar.n)

        inertia, ways = BODIES[body], curves_for(body)
        costs = survey(problems, executor, inertia=inertia, ways=ways, report=report)
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix(".part")
    with part.open("wb") as file:
        np.savez(file, **cast(dict[str, Any], costs))
    part.replace(path)
    return costs


def _joined(parts: Sequence[Mapping[str, Array]]) -> dict[str, Array]:
    return {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}


if __name__ == "__main__":
    own = Path(".atlas")
    make_tables(own)
    own.rmdir()
    print(f"{TABLES / 'atlas_maps.csv'} and atlas_intervals.csv are written.")
