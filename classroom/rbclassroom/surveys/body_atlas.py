"""The atlas of real bodies in lesson 13: a survey of the curves near the optimum of each body.

``course.py atlas`` runs this module. The run takes some minutes and shows its progress.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binomtest, quantile_test

from rbclassroom.surveys import atlas
from rbclassroom.surveys.atlas import CELLS, FASTEST
from rbclassroom.surveys.progress import bar
from rbclassroom.surveys.survey import processes, survey
from rbcourse import Array, Ends, bezier_long_so3, minimum_acceleration_so3
from rbcourse.draw.save import csv_text
from rbcourse.files import replace_file
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
"""The closed forms among the curves; "weighted" and "normal" use the inertia."""
CURVES = (*CLOSED_FORMS, "two Béziers", "three", "ball's optimum")
"""The curves that are compared. "two Béziers" is the cheaper of two Bézier curves, one of them the
long way round. "three" is the cheapest of these two and "normal". "ball's optimum" is the
optimum for a ball, which is not a closed form."""
DOMAINS = {"small": 2, "medium": 5, "all": CELLS}
"""For each domain, the number of steps of displacement and end velocity, counted from 0."""
SEEDS = 31, 32, 33
DRAWS = 200
"""The seeds of the problems, and the number of problems in each of the 10 × 10 cells; the maps use
the first seed."""
TABLES = Path(__file__).parent
"""The folder of the tables of the atlas."""


def body_problems(draws: int, seed: int) -> Ends:
    """Return the problems of `atlas_problems` with end velocities in any direction."""
    return atlas.atlas_problems(draws, ["any"], rng=seed)


def curves_for(body: str) -> dict[str, atlas.Maker]:
    """Return the curves that a survey has to compute for the excesses of `CURVES`."""
    compared = atlas.closed_forms(BODIES[body])
    return {
        **{name: compared[name] for name in CLOSED_FORMS},
        "other way": bezier_long_so3,
        "ball's optimum": minimum_acceleration_so3,
    }


def with_choices(excess: Mapping[str, Array]) -> dict[str, Array]:
    """Return the excesses of all `CURVES`, given the excesses of the curves in a survey."""
    two = np.fmin(excess["Bézier"], excess["other way"])
    chosen = {"two Béziers": two, "three": np.fmin(two, excess["normal"])}
    return {name: {**excess, **chosen}[name] for name in CURVES}


def domain(name: str, draws: int) -> NDArray[np.bool_]:
    """Tell which of the `body_problems` belong to a domain."""
    turn, speed, _ = np.indices((CELLS, CELLS, draws)).reshape(3, -1)
    return (turn < DOMAINS[name]) & (speed < DOMAINS[name])


def domain_in_words(name: str) -> str:
    """Return the limits of a domain as text.

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
        part = {"body": np.full(CELLS**2, body)}
        for name, share in (("median", 0.5), ("90 %", 0.9)):
            table = atlas.cell_table(of_body, draws, share, ["any"])
            del table["family"]
            part |= {key.replace("excess", name): x for key, x in table.items()}
        parts.append(part)
    return _joined(parts)


def intervals(excess: Mapping[str, Array], draws: int) -> dict[str, Array]:
    """Return quantiles and shares of the excess, with 95 % intervals, for each domain and curve.

    The columns are the median, the 90 % quantile, the share of the problems with an excess below a
    tenth, and the share for which the curve is the cheapest of the `CLOSED_FORMS`. If several
    curves are equally cheap, the first counts as the cheapest. For curves that are not closed
    forms, this share is NaN. After each value come the ends of its interval, "low" and "high".
    For quantiles, these ends are values of the sample, with ranks from the binomial distribution.
    They are NaN if the sample is too small. Intervals of shares are those of Clopper and Pearson.
    Both kinds hold for independent problems; for a sample with the same number of problems in each
    cell, the intervals are too long rather than too short. All values are rounded to four digits.
    Problems with a NaN do not count.
    """
    cheapest = np.argmin([excess[curve] for curve in CLOSED_FORMS], axis=0)
    known = ~np.isnan([excess[curve] for curve in CURVES]).any(axis=0)
    rows = []
    for name in DOMAINS:
        inside = domain(name, draws) & known
        for k, curve in enumerate(CURVES):
            x = excess[curve][inside]
            row: dict[str, object] = {"domain": name, "curve": curve, "problems [1]": len(x)}
            closed = curve in CLOSED_FORMS
            for words, values in {
                "median": _quantile(x, 0.5),
                "90 %": _quantile(x, 0.9),
                "within a tenth": _share(x < 0.1),
                "cheapest": _share(cheapest[inside] == k) if closed else [np.nan] * 3,
            }.items():
                keys = f"{words} [1]", f"{words} low [1]", f"{words} high [1]"
                row |= dict(zip(keys, atlas.rounded(np.array(values)), strict=True))
            rows.append(row)
    return {key: np.array([row[key] for row in rows]) for key in rows[0]}


def _quantile(x: Array, share: float) -> list[float]:
    interval = quantile_test(x, p=share).confidence_interval(0.95)
    return [np.quantile(x, share), interval.low, interval.high]


def _share(chosen: NDArray[np.bool_]) -> list[float]:
    interval = binomtest(int(chosen.sum()), len(chosen)).proportion_ci(0.95)
    return [chosen.mean(), interval.low, interval.high]


def stored(table: str) -> dict[str, NDArray[Any]]:
    """Return a stored table of the atlas: "maps" or "intervals".

    Examples
    --------
    >>> table = stored("intervals")
    >>> row = (table["body"] == "book") & (table["domain"] == "all") & (table["curve"] == "normal")
    >>> [float(x) for x in table["median [1]"][row]]  # for three seeds
    [0.08113, 0.07856, 0.08171]
    """
    if table not in ("maps", "intervals"):
        raise ValueError(f"table: 'maps' or 'intervals' is wanted, got {table!r}")
    with (TABLES / f"atlas_{table}.csv").open(encoding="utf-8", newline="") as file:
        names, *rows = csv.reader(file)
    columns = zip(names, zip(*rows, strict=True), strict=True)
    return {name: np.array(x, float if name.endswith("]") else str) for name, x in columns}


def make_tables(
    executor: Executor, tables: Path = TABLES, draws: int = DRAWS, seeds: Sequence[int] = SEEDS
) -> None:
    """Compute the atlas; write the `maps` of the first seed and the `intervals` of all seeds."""
    parts, first = list[dict[str, Array]](), dict[str, dict[str, Array]]()
    for seed, (body, inertia) in product(seeds, BODIES.items()):
        problems = body_problems(draws, seed)
        ways, report = curves_for(body), bar(f"{body}, seed {seed}")
        found = survey(problems, executor, inertia=inertia, ways=ways, report=report)
        excess = with_choices(atlas.excesses(problems, found, inertia))
        first.setdefault(body, excess)
        table = intervals(excess, draws)
        named = {"seed [1]": seed, "body": body}
        parts.append({k: np.full(len(table["curve"]), x) for k, x in named.items()} | table)
    for name, table in {"maps": maps(first, draws), "intervals": _joined(parts)}.items():
        replace_file(tables / f"atlas_{name}.csv", csv_text(table).encode())


def _joined(parts: Sequence[Mapping[str, Array]]) -> dict[str, Array]:
    return {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}


if __name__ == "__main__":
    with processes() as pool:
        make_tables(pool)
    print(f"{TABLES / 'atlas_maps.csv'} and atlas_intervals.csv are written.")
