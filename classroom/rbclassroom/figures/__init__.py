"""Figures of single lessons: each module has the tables, drawings and captions for a lesson."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from scipy.optimize import isotonic_regression

from rbcourse import Array, Curve, closed_forms
from rbcourse.draw.save import Table

_SHORT = {"projected": "projection", "bezier": "Bézier", "cayley": "Cayley"}
FORMS: dict[str, Callable[..., Curve]] = {
    _SHORT.get(first := name.partition("_")[0], first): make
    for name, make in closed_forms.FORMS.items()
}
"""The `rbcourse.closed_forms.FORMS` by their short names in figures and tables."""


def columns(form: str, vectors: Mapping[str, Array], letters: str = "xyz") -> dict[str, Array]:
    """Return the components of vectors, shape (n, 2) or (n, 3), as columns of a table.

    `form` makes the name of a column from the names of a vector and of a component.
    """
    return {
        form.format(name, letter): column
        for name, vector in vectors.items()
        for letter, column in zip(letters, vector.T, strict=False)
    }


def vectors(form: str, data: Table, letters: str = "xyz") -> dict[str, Array]:
    """Return the vectors of a table that `columns` made, by name."""
    return {
        name: np.stack([data[form.format(name, letter)] for letter in letters], axis=-1)
        for name in named(form.format("", letters[0]), data)
    }


def named(ending: str, data: Table) -> dict[str, Array]:
    """Return the columns whose names end with `ending`; the keys are the names without `ending`."""
    return {
        name.removesuffix(ending): np.asarray(column)
        for name, column in data.items()
        if name.endswith(ending)
    }


def name_lines(ax: Axes, places: Mapping[str, tuple[float, float]], ha: str = "center") -> None:
    """Write labels of lines at the given places, each in the colour of its line."""
    colours = {str(line.get_label()): line.get_color() for line in ax.lines}
    for name, (x, y) in places.items():
        ax.text(x, y, name, color=colours[name], ha=ha, va="center")


def name_ends(ax: Axes, gap: float = 0.1) -> None:
    """Write the labels of lines beside their right ends, each in the colour of its line.

    The labels are moved up or down as little as possible (least squares), until they are at least
    `gap` apart, and at least half as far from the top and the bottom of the axes. The unit of `gap`
    is the height of the axes. A thin line leads to a label that has moved.
    """
    ax.autoscale_view()
    lines = [line for line in ax.lines if not str(line.get_label()).startswith("_")]
    maps = [line.get_transform() - ax.transAxes for line in lines]
    xy = np.array([x.transform(line.get_xydata())[-1] for x, line in zip(maps, lines, strict=True)])
    order, steps = np.argsort(xy[:, 1], kind="stable"), gap * np.arange(len(lines))
    limits, ends = (gap / 2, 1 - gap / 2 - steps[-1]), xy[:, 1].copy()
    xy[order, 1] = np.clip(isotonic_regression(xy[order, 1] - steps).x, *limits) + steps
    style: Any = {"xycoords": "axes fraction", "textcoords": "offset points"}
    moved = abs(xy[:, 1] - ends) > 0.03
    for (x, y), end, line, is_moved in zip(xy, ends, lines, moved, strict=True):
        name, colour = str(line.get_label()), line.get_color()
        if is_moved:
            lead: Any = {"transform": ax.transAxes, "clip_on": False, "lw": 1}
            ax.plot([x + 0.012, x + 0.03], [end, y], color=colour, **lead)
        ax.annotate(name, (x, y), (14 if any(moved) else 7, 0), color=colour, va="center", **style)


def quantile(x: Array, share: float, decimals: int = 8) -> Array:
    """Return the least y such that a fraction `share` of x, along the last axis, is at most y.

    NaN does not count. The result is `rounded`.

    Examples
    --------
    >>> float(quantile(np.array([3.0, 1.23456, np.nan, 0.1]), 0.5))
    1.235
    """
    return rounded(np.nanquantile(x, share, axis=-1, method="inverted_cdf"), decimals)


def rounded(x: Array, decimals: int = 8) -> Array:
    """Return numbers rounded to four digits, and to at most `decimals` decimals."""
    return np.vectorize(lambda y: round(float(f"{y:.4g}"), decimals) + 0.0, otypes=[float])(x)


def in_words(excess: float) -> str:
    """Return an excess as text, in percent or as a multiple of the optimum.

    Examples
    --------
    >>> [in_words(x) for x in (-1e-12, 3.141e-3, 0.5, 46.2, 1e9, -0.3, np.nan)]
    ['< 0.01 %', '0.31 %', '50 %', '47 ×', '> 10⁴ ×', '−30 %', '–']
    """
    if np.isnan(excess):
        return "–"
    if excess < -1e-4:
        return f"−{-100 * excess:.2g} %"
    if excess < 1e-4:
        return "< 0.01 %"
    if excess < 10:
        return f"{100 * excess:.2g} %" if excess < 0.1 else f"{100 * excess:.0f} %"
    return f"{1 + excess:.0f} ×" if excess < 1e4 else "> 10⁴ ×"
