"""Draw the results of a run: the time per item against N, and the times for optimal curves."""

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.lines import Line2D

from benchmarks.contests import ALL, CONTESTS
from benchmarks.timing import TIMES

PANELS = [contest.task for contest in CONTESTS if contest.sizes == ALL]
SCIPY, ROMA = {"color": "#D55E00", "marker": "o"}, {"color": "#009E73", "marker": "^"}
HOLLOW, PYTRANSFORM3D = {"ls": "--", "mfc": "white"}, {"color": "#AA4499", "marker": "v"}
LOOKS = {
    "rbcourse": {"color": "#0072B2", "linewidth": 6, "solid_capstyle": "round", "zorder": 1.5},
    "textbook": {"color": "#000000", "marker": "s"},
    "NumPy, SVD alone": {"color": "#777777", "linestyle": ":", "marker": "x"},
    "SciPy": SCIPY,
    "SciPy, as Rotation": SCIPY | HOLLOW,
    "SciPy, another curve": SCIPY | {"linestyle": ":", "marker": "*", "markersize": 9},
    "RoMa": ROMA,
    "RoMa, as quaternions": ROMA | HOLLOW,
    "pytransform3d": PYTRANSFORM3D,
    "pytransform3d, as quaternions": PYTRANSFORM3D | HOLLOW,
}
LOOKS = {name: {"markersize": 6, "markeredgewidth": 1.5} | look for name, look in LOOKS.items()}
MARKERS = {"4a": "o", "4b": "s", "4c": "^", "5": "D", "random": "P"}


def draw(rows):
    """Return a figure with the results of a run."""
    with plt.style.context(["default", "rbcourse.rbcourse"]):
        fig = plt.figure(figsize=(9, 16))
        above, middle, below = fig.subfigures(3, 1, height_ratios=[0.55, 3.15, 1.1])
        drawn = {row["method"] for row in rows if row["task"] in PANELS}
        lines = [Line2D([], [], label=x, **look) for x, look in LOOKS.items() if x in drawn]
        title = "medians; the quartiles as bands, where they can be seen"
        spaces = {"handlelength": 3.5, "columnspacing": 3}
        above.legend(handles=lines, title=title, loc="center", ncols=2, **spaces)
        axes = middle.subplots(3, 2)
        for ax, task in zip(axes.flat, PANELS, strict=True):
            draw_over_size(ax, [row for row in rows if row["task"] == task])
            title = task.removesuffix(" at N times").replace("projected cubic with", "… with its")
            ax.set_title(title, loc="left")
        plt.setp(axes[:, 0], ylabel="time for each [µs]")
        plt.setp(axes[-1], xlabel="N")
        draw_optimum(below.subplots(), rows)
    return fig


def draw_over_size(ax, rows):
    """Draw the time per item against N, with the quartiles as a band."""
    for method in dict.fromkeys(row["method"] for row in rows):
        here = [row for row in rows if row["method"] == method]
        n = np.array([row["N [1]"] for row in here])
        middle, low, high = ([1e6 * row[name] for row in here] / n for name in TIMES)
        ax.plot(n, middle, **LOOKS[method])
        ax.fill_between(n, low, high, color=LOOKS[method]["color"], alpha=0.2, linewidth=0)
    ax.set(xscale="log", yscale="log", xticks=sorted({row["N [1]"] for row in rows}))
    ax.minorticks_off()


def draw_optimum(ax, rows):
    """Draw the times for optimal curves: a row for each method and a mark for each case."""
    one = [row for row in rows if row["task"] == "optimum, one problem"]
    many = [row for row in rows if row["task"] == "optimum, stacked"]
    names = list(dict.fromkeys(row["method"] for row in one))
    for row in one + many:
        aside = 0.14 * (list(MARKERS).index(row["case"]) - 1.5)
        place = names.index(row["method"]) + aside if row in one else len(names) + many.index(row)
        color = LOOKS[row["method"].split(",")[0]]["color"]
        ax.plot(1e3 * row["time [s]"], place, MARKERS[row["case"]], color=color, markersize=9)
    names += [f"rbcourse, {many[0]['N [1]']} at once", "textbook, one by one"]
    ax.set_yticks(range(len(names)), names)
    ax.invert_yaxis()
    ax.set(xscale="log", xlabel="time of one problem [ms]")
    ax.set_title("minimum acceleration, 101 rotations on the curve", loc="left")
    marks = [Line2D([], [], ls="", color="black", marker=mark) for mark in MARKERS.values()]
    shown = [f"Figure {case}" if case != "random" else case for case in MARKERS]
    ax.legend(marks, shown, loc="upper left", bbox_to_anchor=(1, 1))
