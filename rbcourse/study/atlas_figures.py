"""Still figures of the atlas: heat maps, quantiles over the excursion, excess over the margin."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from rbcourse._numerics import Array
from rbcourse.draw.save import COLOURS, Table
from rbcourse.study.atlas import CELLS, FAMILIES, FASTEST, WAYS

_LEAST, _MOST = 1e-4, 1e2
_CONTOURS = {0.01: ":", 0.1: "--", 1.0: "-"}
_LOOKS: dict[str, tuple[str, str]] = {
    "projection": ("projection", "o-"),
    "exponential": ("x", "s--"),
    "Bézier": ("z", "^-"),
    "cumulative": ("y", "v--"),
    "quaternion": ("screw", "D-."),
    "Cayley": ("reference", "x:"),
}


def draw_atlas(fig: Figure, data: Table, quantile: str) -> list[Any]:
    """Draw a heat map for each closed form and each family, with contours at 1, 10 and 100 %.

    BK 1, BK 7.
    """
    fig.set_layout_engine("none")
    room = {
        "left": 0.085,
        "right": 0.88,
        "bottom": 0.16,
        "top": 0.93,
        "wspace": 0.13,
        "hspace": 0.12,
    }
    axes = fig.subplots(len(FAMILIES), len(WAYS), sharex=True, sharey=True, gridspec_kw=room)
    turns, speeds = (np.linspace(0, end, CELLS + 1) for end in (180, FASTEST))
    norm = LogNorm(_LEAST, _MOST)
    maps = []
    for row, family in zip(axes, FAMILIES, strict=True):
        for ax, way in zip(row, WAYS, strict=True):
            here = np.asarray(data["family"]) == family
            excess = np.asarray(data[f"{way} excess [1]"])[here].reshape(CELLS, CELLS)
            excess = np.clip(excess, _LEAST / 10, None)
            maps.append(ax.pcolormesh(turns, speeds, excess.T, norm=norm, cmap="viridis_r"))
            _draw_contours(ax, turns, speeds, excess)
            ax.set(xticks=[0, 60, 120], yticks=[0, 3, 6, 9])
            if family == FAMILIES[0]:
                ax.set_title(way)
        row[0].set_ylabel(f"{family}\nend velocity (rad)")
    fig.text(0.085, 0.04, "displacement (°)")
    bar = fig.colorbar(maps[0], cax=fig.add_axes((0.9, 0.16, 0.015, 0.77)), extend="both")
    bar.set_label(f"cost / optimum − 1, {quantile}")
    handles = [
        Line2D([], [], color="black", lw=1.2, ls=dash, label=f"{100 * level:g} %")
        for level, dash in _CONTOURS.items()
    ]
    fig.legend(handles=handles, loc="lower right", bbox_to_anchor=(0.89, -0.01), ncols=3)
    return maps


def _draw_contours(ax: Axes, turns: Array, speeds: Array, excess: Array) -> None:
    for level, dash in _CONTOURS.items():
        if np.nanmin(excess) < level < np.nanmax(excess):
            x, y = ((edges[1:] + edges[:-1]) / 2 for edges in (turns, speeds))
            style: Any = {"colors": "black", "linestyles": dash, "linewidths": 1.2}
            ax.contour(x, y, np.log10(excess.T), [np.log10(level)], **style)


def describe_atlas(data: Table, quantile: str) -> str:
    """Return in words what `draw_atlas` shows."""
    said = "; ".join(f"{way} {_shares(data, way)}" for way in WAYS)
    return (
        f"Heat maps of the cost over the optimum minus 1, {quantile}, for six closed forms, over "
        "the displacement from 0 to 180 degrees and the end velocity from 0 to 9 rad, along the "
        f"axis of the displacement and across. Share of the cells below 1, 10 and 100 %: {said}."
    )


def _shares(data: Table, way: str) -> str:
    excess = np.asarray(data[f"{way} excess [1]"])
    return ", ".join(f"{100 * np.mean(excess < level):.0f}" for level in _CONTOURS)


def draw_growth(ax: Axes, data: Table) -> list[Any]:
    """Draw, on logarithmic axes, the median excess of each closed form over the excursion.

    BK 1, BK 7.
    """
    size = np.asarray(data["size [rad]"])
    lines = []
    for k, (way, (colour, mark)) in enumerate(_LOOKS.items()):
        median, high = (np.asarray(data[f"{way} {q} excess [1]"]) for q in ("median", "90 %"))
        x = size * 1.03 ** (k - 2.5)
        lines += ax.plot(x, median, mark, color=COLOURS[colour], label=way)
        ax.vlines(x, median, high, color=COLOURS[colour], lw=1)
    ax.set(xscale="log", yscale="log", xlabel="size s of the excursion (rad)")
    ax.set_xticks(size, [f"{s:g}" for s in size], minor=False)
    ax.minorticks_off()
    ax.set_ylabel("cost / optimum − 1")
    for level in _CONTOURS:
        ax.axhline(level, color="0.8", lw=1, zorder=0)
        ax.text(0.01, level, f"{100 * level:g} %", va="bottom", transform=ax.get_yaxis_transform())
    ax.legend(loc="center left", bbox_to_anchor=(1, 0.5))
    return lines


def describe_growth(data: Table) -> str:
    """Return in words what `draw_growth` shows."""
    size = np.asarray(data["size [rad]"])
    said = "; ".join(
        f"{way} from {values[0]:.1e} to {values[-1]:.1e}"
        for way, values in ((w, np.asarray(data[f"{w} median excess [1]"])) for w in WAYS)
    )
    return (
        "Median of the cost over the optimum minus 1, for six closed forms, over the size of the "
        f"excursion from {size[0]:g} to {size[-1]:g} rad, on logarithmic axes, with bars up to the "
        f"90 % quantile: {said}."
    )


def draw_margins(ax: Axes, data: Table) -> list[Any]:
    """Draw the excess of the projections, of matrices and of quaternions, over their margins."""
    dots = []
    for way, mark in {"projection": ".", "quaternion": "+"}.items():
        style: Any = {"color": COLOURS[_LOOKS[way][0]], "alpha": 0.5, "ms": 4, "label": way}
        dots += ax.plot(*_margins(data, way), mark, rasterized=True, **style)
    x = np.array([0.02, 0.7])
    line = ax.plot(x, x**-3, color=COLOURS["reference"], lw=1, label="slope −3")
    ax.set(xscale="log", yscale="log", xlabel="margin", ylabel="cost / optimum − 1")
    ax.legend(loc="center left", bbox_to_anchor=(1, 0.5))
    return [*dots, *line]


def describe_margins(data: Table) -> str:
    """Return in words what `draw_margins` shows."""
    margin, excess = _margins(data, "projection")
    low, high = (np.nanmedian(excess[x]) for x in (margin < 0.2, margin > 1))
    least = _margins(data, "quaternion")[0].min()
    return (
        "The cost over the optimum minus 1 over the margin, a dot for each problem, on logarithmic "
        f"axes. Of the projection the median is {low:.1e} where the margin is below 0.2, and "
        f"{high:.1e} where it is above 1; beside the dots runs a line of slope minus three. The "
        f"margin of the quaternions is {least:.1f} or more."
    )


def _margins(data: Table, way: str) -> tuple[Array, Array]:
    margin, excess = (np.asarray(data[f"{way} {name} [1]"]) for name in ("margin", "excess"))
    return margin, excess
