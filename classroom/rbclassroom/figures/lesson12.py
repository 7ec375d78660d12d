"""Lesson 12: heat maps of the atlas, and the excess over the excursion or the margin."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from rbclassroom.figures import name_ends, name_lines, named
from rbcourse import Array
from rbcourse.draw.save import COLOURS, PALE, Table

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
    "normal": ("y", "*"),
    "weighted": ("reference", "p"),
}
SHOWN = "projection", "quaternion", "Bézier"
"""The curves with a map; the tables have all curves."""
_BEHIND = "quaternion", "Cayley"
"""Curves that are grey in the figure of the growth, because they end where others do."""
_OTHER = "path", "."
"""The look of any other curve."""
_DASHES = ("white", 5, "-"), ("black", 3, "--")
"""Colour, width and style of two lines, which together mark 10 % on every colour."""
_SUM = "least sum of the two smallest\neigenvalues of $R^{\\mathsf{T}}M$ (rotation: 2)"
_NORM = "least norm\nof the cubic (rotation: 1)"
_MARGINS = {"projection": (_SUM, [0.01, 0.1, 1, 2]), "quaternion": (_NORM, [0.5, 1])}


def groups(data: Table, by: str) -> dict[str, dict[str, Array]]:
    """Return the rows of a table, grouped by the words in a column."""
    columns = {name: np.asarray(column) for name, column in data.items()}
    return {
        word: {name: column[columns[by] == word] for name, column in columns.items()}
        for word in dict.fromkeys(columns[by])
    }


def draw_atlas(fig: Figure, data: Table, quantile: str, ways: Iterable[str] = SHOWN) -> None:
    """Draw maps of the excess of some curves, with a row for each family.

    `data` is a table of `rbclassroom.atlas.cell_table`. The scale of colours has the name of the
    `quantile` (BK 1, BK 7).
    """
    rows = {f"{family} the axis": cells for family, cells in groups(data, "family").items()}
    draw_maps(fig, rows, {f"{way} excess [1]": way for way in ways}, quantile)


def draw_maps(
    fig: Figure, rows: Mapping[str, Table], columns: Mapping[str, str], quantile: str
) -> None:
    """Draw a map of the excess for each table and column.

    `rows` maps labels to tables, and `columns` maps names in the tables to headings. A dashed
    line marks 10 %.
    """
    axes = fig.subplots(len(rows), len(columns), sharex=True, sharey=True, squeeze=False)
    for row, (label, cells) in zip(axes, rows.items(), strict=True):
        row[0].set_ylabel(label)
        for ax, (column, title) in zip(row, columns.items(), strict=True):
            drawn = _draw_map(ax, np.asarray(cells[column]))
            ax.set_title(title if ax in axes[0] else "")
    for ax in axes[-1]:
        for tick, side in zip(ax.xaxis.get_major_ticks(), ("left", "center", "right"), strict=True):
            tick.label1.set(ha=side)  # the labels of neighbouring maps stay apart
    fig.supylabel("end velocity (rad)", fontsize="medium")
    fig.supxlabel("displacement (°)", fontsize="medium")
    scale = fig.colorbar(drawn, ax=axes, fraction=0.03, pad=0.02, extend="both")
    scale.ax.set_title(f"excess,\n{quantile}", loc="left")
    ticks = sorted({*_LEVELS[::2], _TENTH})
    scale.set_ticks(ticks, labels=_percents(ticks))
    scale.ax.minorticks_off()
    for colour, width, dash in _DASHES:
        scale.ax.axhline(_TENTH, color=colour, lw=width, ls=dash)


def _draw_map(ax: Axes, excess: Array) -> Any:
    """Draw the excess over displacement and end velocity, with smooth colours between the cells.

    If the excess is below all levels everywhere, a text on the map states this.
    """
    cells = round(np.sqrt(len(excess)))
    excess = np.pad(excess.reshape(cells, cells).T, 1, "edge")  # up to the edges of the map
    middles = np.clip(np.arange(-0.5, cells + 1), 0, cells) / cells
    x, y, norm = 180 * middles, 9 * middles, LogNorm(min(_LEVELS), max(_LEVELS), clip=True)
    drawn = ax.pcolormesh(x, y, excess, norm=norm, cmap="viridis_r", shading="gouraud")
    if np.nanmin(excess) < _TENTH < np.nanmax(excess):
        powers = np.log10(np.maximum(excess, min(_LEVELS)))
        for colour, width, dash in _DASHES:
            line: Any = {"colors": colour, "linewidths": width, "linestyles": dash}
            ax.contour(x, y, powers, [np.log10(_TENTH)], **line)
    if np.max(excess) < min(_LEVELS):
        said = f"< {_percents(_LEVELS)[0]}\neverywhere"
        ax.text(0.5, 0.5, said, transform=ax.transAxes, ha="center", va="center")
    ax.set(xticks=[0, 90, 180], yticks=[0, 3, 6, 9])
    return drawn


def describe_atlas(data: Table, quantile: str, ways: Iterable[str] = SHOWN) -> str:
    """Return a description of the figure of `draw_atlas`."""
    levels, said = (0.01, _TENTH, 1), []
    for family, cells in groups(data, "family").items():
        each = (f"{way} {shares(cells[f'{way} excess [1]'], levels)}" for way in ways)
        said.append(f"{family} the axis: {'; '.join(each)}")
    return (
        f"Cost of closed forms over the optimum minus 1, {quantile}, for end velocities along the "
        "axis of the displacement (upper row) and across it (lower row). In each heat map, to the "
        "right the displacement grows from 0 to 180 degrees, and upwards the end velocity from 0 "
        f"to 9 rad. Share of the cells below 1, 10 and 100 %, in percent: {'. '.join(said)}."
    )


def shares(excess: Any, levels: Sequence[float] = (_TENTH,)) -> str:
    """Return the shares of the cells with an excess below each level, in percent, as text."""
    return ", ".join(f"{100 * np.mean(excess < level):.0f}" for level in levels)


def draw_growth(ax: Axes, data: Table, slopes: Mapping[int, float]) -> None:
    """Draw, on logarithmic axes, the median excess of each closed form against the excursion.

    `slopes` maps the slopes of thin grey lines, up to a size of 1, to their lowest values
    (BK 1, BK 7).
    """
    size, medians = np.asarray(data["size [rad]"]), _medians(data)
    for way, median in medians.items():
        colour, mark = _LOOKS.get(way, _OTHER)
        named_line: Any = {"marker": mark, "ms": 8, "label": way, "color": COLOURS[colour]}
        grey: Any = {"lw": 1, "label": f"_{way}", "color": PALE, "zorder": 1}
        ax.plot(size, median, "-", **(grey if way in _BEHIND else named_line))
    ax.set(xscale="log", yscale="log", ymargin=0.1, xlabel="size $s$ of the excursion (rad)")
    x, ink = np.array([size[0], 0.5, 1]), COLOURS["reference"]
    for slope, low in slopes.items():
        y = low * (x / x[0]) ** slope
        ax.plot(x, y, ":", lw=1.5, color=ink)
        above = low > max(median[0] for median in medians.values())
        ha, va = ("right", "bottom") if above else ("left", "top")
        ax.text(x[1], y[1], f" slope {slope} ", color=ink, ha=ha, va=va)
    ax.set_xticks(size, [f"{s:g}" for s in size], minor=False)
    ax.minorticks_off()
    if any(way in medians for way in _BEHIND):
        said = f"grey: {' and '.join(_BEHIND)}"
        ax.text(0.98, 0.03, said, color="0.4", ha="right", transform=ax.transAxes)
    lowest = min(np.nanmin(median) for median in medians.values())
    _set_percents(ax, [x for x in [1e-12, 1e-10, 1e-8, 1e-6, *_LEVELS[::2]] if x > lowest / 30])
    name_ends(ax, 0.085)


def _medians(data: Table) -> dict[str, Array]:
    medians = named(" median excess [1]", data)
    return {way: medians[way] for way in _LOOKS | medians if way in medians}


def draw_margins(axes: Sequence[Axes], data: Table) -> None:
    """Draw the excess against the margin: projections on the left, quaternion cubics on the right.

    In both panels, dots are problems of the first family in the column "family". Large black marks
    are problems of up to two other families. A line of slope −3 runs beside the projections.
    """
    for ax, (way, (name, ticks)) in zip(axes, _MARGINS.items(), strict=True):
        dots: Any = {"color": COLOURS[_LOOKS[way][0]], "ms": 4, "rasterized": True}
        marks: Any = [{"color": "black", "mec": "white", "ms": size} for size in (17, 9)]
        looks = zip(groups(data, "family").items(), ".*D", [dots, *marks], strict=False)
        for (family, rows), mark, style in looks:
            ax.plot(*_margins(rows, way), mark, label=family, **style)
        ax.set(xscale="log", yscale="log", title=way, xlabel=f"margin: {name}")
        ax.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
        ax.minorticks_off()
    x = np.array([0.02, 0.7])
    axes[0].plot(x, x**-3, color=COLOURS["reference"], lw=1.5, label="slope −3")
    _set_percents(axes[0], [*_LEVELS[2::2], 1e4, 1e6])
    axes[0].legend(loc="lower left")


def describe_margins(data: Table) -> str:
    """Return a description of the figure of `draw_margins`."""
    first, *others = groups(data, "family").items()
    margin, excess = _margins(first[1], "projection")
    low, high = (np.nanmedian(excess[x]) for x in (margin < 0.2, margin > 1))
    said = ""
    for family, rows in others:
        pairs = zip(*_margins(rows, "projection"), strict=True)
        said += f" {family}: {', '.join(f'{100 * y:.0f} % at {x:.3f}' for x, y in pairs)}."
    return (
        "Cost over the optimum minus 1 of each problem, over its margin: of the projection (left), "
        "and of the quaternion cubic (right). Both axes are logarithmic. Of the projection the "
        f"median is {low:.1e} where the margin is below 0.2, and {high:.1e} where it is above 1; "
        f"beside the dots runs a line of slope minus three.{said} The least margin of the "
        f"quaternions is {np.min(data['quaternion margin [1]']):.2f}."
    )


def _margins(data: Table, way: str) -> list[Array]:
    return [np.asarray(data[f"{way} {name} [1]"]) for name in ("margin", "excess")]


def _set_percents(ax: Axes, levels: list[float]) -> None:
    ax.set_yticks(levels, _percents(levels))
    ax.set_ylabel("cost / optimum − 1")


def _percents(levels: list[float]) -> list[str]:
    """Return levels as text in percent; if any is far from 1 %, write all as powers of ten."""
    powers = np.log10(levels).round().astype(int) + 2
    if np.abs(powers).max() > 4:
        return [rf"$\mathregular{{10^{{{power}}}}}$ %" for power in powers]
    return [f"{100 * level:,.9g} %" for level in levels]


def draw_deviations(axes: Sequence[Axes], data: Table) -> None:
    """Draw the deviations of closed forms from the optimum near a geodesic, in panels for d and e.

    `data` has the time, and columns "NAME d [1]" and "NAME e [1]" for each form (beyond BK 10).
    """
    titles = {"d": "difference $d$, across the axis", "e": "mean $e$, across the axis"}
    for ax, (letter, title) in zip(axes, titles.items(), strict=True):
        for way, deviation in named(f" {letter} [1]", data).items():
            colour, mark = _LOOKS[way]
            style: Any = {"color": COLOURS[colour], "marker": mark, "markevery": 10}
            ax.plot(data["t [1]"], deviation, label=way, **style)
        ax.axhline(0, color="0.8", lw=1, zorder=0)
        ax.set(title=title, xlabel="time $t$", ylim=(-0.0068, 0.0068), yticks=[-0.004, 0, 0.004])
        ax.set_xticks([0, 0.5, 1], ["0", "0.5", "1"])
    axes[0].set_ylabel(r"deviation / ($\Vert\sigma\Vert^2\,\Vert d$ or $e\Vert$)")
    places = {"projection": (0.5, 0.006), "quaternion": (0.5, 0.0023), "Bézier": (0.5, -0.0009)}
    name_lines(axes[0], places)
    name_lines(axes[1], {"exponential": (0.5, -0.0061)})
