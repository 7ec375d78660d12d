"""Still figures of the atlas: heat maps, quantiles over the excursion, excess over the margin."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm
from matplotlib.figure import Figure

from rbclassroom.surveys.atlas import CELLS, FASTEST, WAYS
from rbcourse import Array
from rbcourse.draw.save import COLOURS, Table

_TENTH = 0.1
_LEVELS = [1e-4, 1e-3, 0.01, _TENTH, 1.0, 10.0, 100.0]
_LOOKS: dict[str, tuple[str, str]] = {
    "projection": ("projection", "o"),
    "exponential": ("x", "s"),
    "Bézier": ("z", "^"),
    "corrected": ("optimum", "P"),
    "cumulative": ("y", "v"),
    "quaternion": ("screw", "D"),
    "Cayley": ("reference", "x"),
    "weighted": ("path", "p"),
    "normal": ("optimum", "*"),
}
_MARGINS = {
    "projection": (
        "least sum of the two\nsmallest singular values (rotation: 2)",
        [0.01, 0.1, 1, 2],
    ),
    "quaternion": ("least norm\nof the cubic (rotation: 1)", [0.5, 1]),
}


def of_family(data: Table, family: str) -> dict[str, Array]:
    """Return the rows of a table that belong to a family.

    Examples
    --------
    >>> of_family({"family": ["along", "across"], "x [1]": [1, 2]}, "across")["x [1]"]
    array([2])
    """
    chosen = np.asarray(data["family"]) == family
    return {name: np.asarray(column)[chosen] for name, column in data.items()}


def draw_atlas(fig: Figure, data: Table, family: str, quantile: str) -> list[Any]:
    """Draw for a family a heat map of each closed form: a colour for each power of ten.

    A dashed line runs at 10 %. `data` is what `rbclassroom.surveys.atlas.cell_table` gives; its
    `quantile` is named beside the colours (BK 1, BK 7).
    """
    axes = fig.subplots(2, 4, sharex=True, sharey=True)
    cells = of_family(data, family)
    maps = [
        _heat_map(ax, way, cells[f"{way} excess [1]"])
        for ax, way in zip(axes.flat[: len(WAYS)], WAYS, strict=True)
    ]
    for ax in axes.flat[len(WAYS) :]:
        ax.set_axis_off()
    axes[0, -1].tick_params(labelbottom=True)
    fig.supylabel(f"end velocity, {family} the axis (rad)", fontsize="medium")
    _colour_bar(fig, axes, maps[0], quantile, aspect=15)
    return maps


def draw_body_atlas(fig: Figure, data: Table, curves: Mapping[str, str]) -> list[Any]:
    """Draw heat maps of medians: a row for each body, a column for each curve.

    `data` is what `rbclassroom.surveys.body_atlas.maps` gives; `curves` are the names of columns
    in it, and the headings above them (beyond BK 3).
    """
    bodies = list(dict.fromkeys(np.asarray(data["body"])))
    axes = fig.subplots(len(bodies), len(curves), sharex=True, sharey=True, squeeze=False)
    maps = []
    for row, body in zip(axes, bodies, strict=True):
        chosen = np.asarray(data["body"]) == body
        row[0].set_ylabel(body)
        for ax, curve in zip(row, curves, strict=True):
            maps.append(_heat_map(ax, "", np.asarray(data[f"{curve} median [1]"])[chosen]))
    for ax, title in zip(axes[0], curves.values(), strict=True):
        ax.set_title(title)
    fig.supylabel("end velocity, in any direction (rad)", fontsize="medium")
    _colour_bar(fig, axes, maps[0], "median", aspect=25)
    return maps


def describe_body_atlas(data: Table, curves: Mapping[str, str]) -> str:
    """Return in words what `draw_body_atlas` shows."""
    said = []
    for body in dict.fromkeys(np.asarray(data["body"])):
        chosen = np.asarray(data["body"]) == body
        shares = []
        for curve, title in curves.items():
            excess = np.asarray(data[f"{curve} median [1]"])[chosen]
            shares.append(f"{title.replace(chr(10), ' ')} {100 * np.mean(excess < _TENTH):.0f}")
        said.append(f"{body}: {', '.join(shares)}")
    return (
        "What curves cost above the optimum of three bodies, median. A heat map for each body and "
        "curve: to the right the displacement grows from 0 to 180 degrees, and upwards the end "
        "velocity from 0 to 9 rad. Share of the cells below 10 %, in percent: "
        f"{'; '.join(said)}."
    )


def _heat_map(ax: Axes, title: str, excess: Array) -> Any:
    """Draw the excess in each cell, in their order, and a dashed line at 10 %."""
    turns, speeds = (np.linspace(0, end, CELLS + 1) for end in (180, FASTEST))
    x, y = ((edges[1:] + edges[:-1]) / 2 for edges in (turns, speeds))
    excess = np.asarray(excess).reshape(CELLS, CELLS).T
    norm: Any = BoundaryNorm(_LEVELS, 256, extend="both")
    drawn = ax.pcolormesh(turns, speeds, excess, norm=norm, cmap="viridis_r")
    if np.nanmin(excess) < _TENTH < np.nanmax(excess):
        powers = np.log10(np.maximum(excess, min(_LEVELS)))
        line: Any = {"linestyles": "--", "linewidths": 2.5, "colors": "black"}
        ax.contour(x, y, powers, [np.log10(_TENTH)], **line)
    ax.set(title=title, xticks=[0, 60, 120, 180], yticks=[0, 3, 6, 9])
    return drawn


def _colour_bar(fig: Figure, axes: Any, drawn: Any, quantile: str, aspect: float) -> None:
    fig.supxlabel("displacement (°)", fontsize="medium")
    label = f"cost / optimum − 1, {quantile}"
    bar = fig.colorbar(drawn, ax=axes, aspect=aspect, label=label)
    bar.set_ticks(_LEVELS, labels=_percents(_LEVELS))
    bar.ax.axhline(_TENTH, color="black", lw=2.5, ls="--")


def _percents(levels: list[float]) -> list[str]:
    return [f"{100 * level:,.9g} %" for level in levels]


def describe_atlas(data: Table, family: str, quantile: str) -> str:
    """Return in words what `draw_atlas` shows."""
    cells = of_family(data, family)
    said = "; ".join(f"{way} {_shares(cells, way)}" for way in WAYS)
    return (
        f"What seven closed forms cost above the optimum, {quantile}, where the end velocities are "
        f"{family} the axis of the displacement. A heat map each: to the right the displacement "
        "grows from 0 to 180 degrees, and upwards the end velocity from 0 to 9 rad. Share of the "
        f"cells below 1, 10 and 100 %, in percent: {said}."
    )


def _shares(data: Table, way: str) -> str:
    excess = np.asarray(data[f"{way} excess [1]"])
    return ", ".join(f"{100 * np.mean(excess < level):.0f}" for level in (0.01, 0.1, 1))


def draw_growth(ax: Axes, data: Table) -> list[Any]:
    """Draw, on logarithmic axes, the excess of each closed form over the excursion.

    The medians have marks; thin and dashed is the 90 % quantile. Return the medians, then those
    (BK 1, BK 7).
    """
    size = np.asarray(data["size [rad]"])
    medians, highs = [], []
    for way in _compared(data):
        colour, mark = _LOOKS[way]
        median, high = (np.asarray(data[f"{way} {q} excess [1]"]) for q in ("median", "90 %"))
        style: Any = {"color": COLOURS[colour]}
        medians += ax.plot(size, median, "-", marker=mark, ms=8, label=way, **style)
        highs += ax.plot(size, high, "--", lw=1, **style)
    ax.set(xscale="log", yscale="log", xlabel="size s of the excursion (rad)")
    ax.set_xticks(size, [f"{s:g}" for s in size], minor=False)
    ax.minorticks_off()
    hundredfold = [1e-12, 1e-10, 1e-8, 1e-6, *_LEVELS[::2]]
    lowest = min(np.nanmin(line.get_ydata()) for line in medians)
    hundredfold = [level for level in hundredfold if level > lowest / 30]
    ax.set_yticks(hundredfold, _percents(hundredfold))
    ax.set_ylabel("cost / optimum − 1")
    ax.plot([], [], "--", lw=1, color="black", label="90 % quantile")
    ax.legend(loc="center left", bbox_to_anchor=(1, 0.5))
    return [*medians, *highs]


def describe_growth(data: Table) -> str:
    """Return in words what `draw_growth` shows."""
    size = np.asarray(data["size [rad]"])
    medians = {way: np.asarray(data[f"{way} median excess [1]"]) for way in _compared(data)}
    said = "; ".join(
        f"{way} from {f'{x[0]:.1e}' if x[0] > 1e-11 else 'less than 1e-11'} to {x[-1]:.1e}"
        for way, x in medians.items()
    )
    return (
        "What closed forms cost above the optimum over the size of the excursion, the median "
        "and the 90 % quantile, on logarithmic axes. While the size grows from "
        f"{size[0]:g} to {size[-1]:g} rad, the median of the cost over the optimum minus 1 grows: "
        f"{said}."
    )


def _compared(data: Table) -> list[str]:
    return [way for way in _LOOKS if f"{way} median excess [1]" in data]


def draw_margins(axes: Sequence[Axes], data: Table) -> list[Any]:
    """Draw the excess over the margin: of projections left, of cubics of quaternions right.

    The first family in the column "family" becomes dots, up to two others large black marks, the
    same in both panels. Return them for each panel, and a line of slope −3 beside the projections.
    """
    marks: list[Any] = []
    families = list(dict.fromkeys(np.asarray(data["family"])))
    for ax, (way, (name, ticks)) in zip(axes, _MARGINS.items(), strict=True):
        for family, mark in zip(families, ".*D", strict=False):
            style: Any = {"color": "black", "mec": "white", "ms": 17 if mark == "*" else 9}
            if family == families[0]:
                style = {"color": COLOURS[_LOOKS[way][0]], "alpha": 0.6, "rasterized": True}
            points = _margins(of_family(data, family), way)
            marks += ax.plot(*points, mark, label=family, **style)
        ax.set(xscale="log", yscale="log", title=way, xlabel=f"margin: {name}")
        ax.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
        ax.minorticks_off()
    x = np.array([0.02, 0.7])
    line = axes[0].plot(x, x**-3, color=COLOURS["reference"], lw=1.5, label="slope −3")
    hundredfold = [*_LEVELS[2::2], 1e4, 1e6]
    axes[0].set_yticks(hundredfold, _percents(hundredfold))
    axes[0].set_ylabel("cost / optimum − 1")
    axes[0].legend(loc="lower left")
    return [*marks, *line]


def describe_margins(data: Table) -> str:
    """Return in words what `draw_margins` shows."""
    first, *others = dict.fromkeys(np.asarray(data["family"]))
    margin, excess = _margins(of_family(data, first), "projection")
    low, high = (np.nanmedian(excess[x]) for x in (margin < 0.2, margin > 1))
    least = _margins(data, "quaternion")[0].min()
    said = ""
    for family in others:
        pairs = zip(*_margins(of_family(data, family), "projection"), strict=True)
        said += f" {family}: {', '.join(f'{100 * y:.0f} % at {x:.3f}' for x, y in pairs)}."
    return (
        "A small margin condemns, a large one certifies nothing: the cost over the optimum minus 1 "
        "over the margin, a dot for each problem, on logarithmic axes. Of the projection the "
        f"median is {low:.1e} where the margin is below 0.2, and {high:.1e} where it is above 1; "
        f"beside the dots runs a line of slope minus three.{said} The least margin of the "
        f"quaternions is {least:.2f}."
    )


def _margins(data: Table, way: str) -> tuple[Array, Array]:
    margin, excess = (np.asarray(data[f"{way} {name} [1]"]) for name in ("margin", "excess"))
    return margin, excess


def draw_deviations(axes: Sequence[Axes], data: Table) -> list[Any]:
    """Draw by what closed forms differ from the optimum near a geodesic: a panel for d and for e.

    `data` has the time, and a column "way d [1]" and "way e [1]" for each of them (beyond BK 10).
    """
    lines: list[Any] = []
    titles = {"d": "difference d, across the axis", "e": "mean e, across the axis"}
    for ax, (letter, title) in zip(axes, titles.items(), strict=True):
        for name in data:
            if name.endswith(f" {letter} [1]"):
                way = name[: -len(f" {letter} [1]")]
                colour, mark = _LOOKS[way]
                style: Any = {"color": COLOURS[colour], "marker": mark, "markevery": 10}
                lines += ax.plot(data["t [1]"], data[name], label=way, **style)
        ax.axhline(0, color="0.8", lw=1, zorder=0)
        ax.set(title=title, xlabel="time t")
    axes[0].set_ylabel("deviation / (‖σ‖² ‖d or e‖)")
    axes[-1].legend(loc="center left", bbox_to_anchor=(1, 0.5))
    return lines


def describe_deviations(data: Table) -> str:
    """Return in words what `draw_deviations` shows."""
    largest = "; ".join(
        f"{name[:-4]} {np.abs(data[name]).max():.1e}" for name in data if name != "t [1]"
    )
    return (
        "By what closed forms differ from the optimum over time, near a geodesic, for a difference "
        "d and a mean e of the end velocities across the axis, over the square of the displacement "
        f"and d or e. Largest: {largest}."
    )
