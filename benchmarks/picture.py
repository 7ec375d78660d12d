"""The figure of a run: the time for each item over N, and what the optimum takes."""

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.lines import Line2D

from benchmarks.contest import OURS
from benchmarks.report import power

PANELS = {
    "nearest rotation": "nearest rotation",
    "geodesic at N times": "geodesic",
    "projected cubic at N times": "projected cubic",
    "projected cubic with derivatives": "… with its derivatives",
    "random rotation matrices": "random rotation matrices",
    "random quaternions": "random quaternions",
}
_OWN = {"linestyle": "--", "mfc": "white"}
_TEXTBOOK = {"color": "#000000", "marker": "s"}
_SCIPY = {"color": "#D55E00", "marker": "o"}
_ROMA = {"color": "#009E73", "marker": "^"}
_PYTRANSFORM3D = {"color": "#AA4499", "marker": "v"}
LOOKS = {
    OURS: {"color": "#0072B2", "linewidth": 6, "solid_capstyle": "round", "zorder": 1.5},
    "textbook": _TEXTBOOK,
    "NumPy, SVD alone": {"color": "#777777", "linestyle": ":", "marker": "x"},
    "SciPy": _SCIPY,
    "SciPy, as Rotation": _SCIPY | _OWN,
    "SciPy, another curve": _SCIPY | {"linestyle": ":", "marker": "*", "markersize": 9},
    "RoMa": _ROMA,
    "RoMa, as quaternions": _ROMA | _OWN,
    "pytransform3d": _PYTRANSFORM3D,
    "pytransform3d, as quaternions": _PYTRANSFORM3D | _OWN,
}
CASES = {"4a": "o", "4b": "s", "4c": "^", "5": "D"}


def draw(rows):
    """Return the figure of the rows of a run."""
    with plt.style.context(["default", "rbcourse.rbcourse"]):
        fig = plt.figure(figsize=(9, 16))
        above, middle, below = fig.subfigures(3, 1, height_ratios=[0.55, 3.15, 1.1])
        draw_legend(above, rows)
        axes = middle.subplots(3, 2)
        for ax, (task, title) in zip(axes.flat, PANELS.items(), strict=True):
            draw_over_size(ax, [row for row in rows if row["task"] == task])
            ax.set_title(title, loc="left")
        for ax in axes[:, 0]:
            ax.set_ylabel("time for each [µs]")
        for ax in axes[-1]:
            ax.set_xlabel("N")
        draw_optimum(below.subplots(), rows)
    return fig


def draw_over_size(ax, rows):
    """Draw the time for each item over N, with the quartiles as a band."""
    for method in _methods(rows):
        here = [row for row in rows if row["method"] == method]
        n = np.array([row["N [1]"] for row in here])
        names = "time [s]", "time low [s]", "time high [s]"
        middle, low, high = ([1e6 * row[name] for row in here] / n for name in names)
        ax.plot(n, middle, **_look(method))
        ax.fill_between(n, low, high, color=LOOKS[method]["color"], alpha=0.2, linewidth=0)
    ax.set(xscale="log", yscale="log")
    ax.set_xticks(sorted({row["N [1]"] for row in rows}))
    ax.minorticks_off()


def draw_legend(fig, rows):
    """Name every method that is drawn over N."""
    drawn = {row["method"] for row in rows if row["task"] in PANELS}
    names = [name for name in LOOKS if name in drawn]
    lines = [Line2D([], [], **_look(name)) for name in names]
    title = "medians; the quartiles as bands, where they can be seen"
    fig.legend(lines, names, title=title, loc="center", ncols=2, handlelength=3.5, columnspacing=3)


def draw_optimum(ax, rows):
    """Draw what the optimum takes: a line for each method, a mark for each case."""
    one = [row for row in rows if row["task"] == "optimum, one problem"]
    many = [row for row in rows if row["task"] == "optimum, stacked"]
    names = _methods(one)
    for row in one:
        aside = 0.14 * (list(CASES).index(row["case"]) - 1.5)
        _mark(ax, row, names.index(row["method"]) + aside, CASES[row["case"]])
    for k, row in enumerate(many):
        _mark(ax, row, len(names) + k, "P")
    ways = [f"rbcourse, {power(many[0]['N [1]'])} at once", "textbook, one by one"]
    ax.set_yticks(range(len(names) + len(ways)), names + ways)
    ax.invert_yaxis()
    ax.set(xscale="log", xlabel="time of one problem [ms]")
    ax.set_title("minimum acceleration, 101 rotations on the curve", loc="left")
    shown = {f"Figure {case}": mark for case, mark in CASES.items()} | {"random": "P"}
    marks = [Line2D([], [], linestyle="", color="black", marker=mark) for mark in shown.values()]
    ax.legend(marks, shown, loc="upper left", bbox_to_anchor=(1, 1))


def _mark(ax, row, place, mark):
    color = LOOKS[row["method"].split(",")[0]]["color"]
    ax.plot(1e3 * row["time [s]"], place, mark, color=color, markersize=9)


def _look(method):
    return {"markersize": 6, "markeredgewidth": 1.5} | LOOKS[method]


def _methods(rows):
    return list(dict.fromkeys(row["method"] for row in rows))


def save(fig, path):
    """Save the figure as PNG and PDF, the same bytes each time, and close it."""
    fig.savefig(path.with_suffix(".png"), metadata={"Software": None})
    fig.savefig(path.with_suffix(".pdf"), metadata={"CreationDate": None})
    plt.close(fig)
