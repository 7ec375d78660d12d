"""Drawings of a function of time for many angles: curves, and a surface (BK Fig. 2, BK Fig. 3)."""

from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator
from numpy.typing import ArrayLike

from rbcourse import Array
from rbcourse.draw.save import Table

_COLOURS = ListedColormap(plt.get_cmap("viridis_r")(np.linspace(0.42, 1, 256)))
"""The colours of viridis without the bright end, which is hard to see on white."""
_SHOWN: dict[float, Any] = {30: "-", 90: "--", 150: "-.", 165: ":"}
"""The angles in degrees of the curves that `draw_family` draws, with their line styles."""
_LABELS = {"t": "time $t$", "angle": "angle $a$", "theta": r"$\theta$", "f": "$f$"}
_LABELS |= {"theta_dot": r"$d\theta/dt$", "f_dot": "$df/dt$"}
_NAMED: dict[str, list[tuple[float, int, int, int]]] = {
    r"$\theta$": [(0.21, -5, 5, 0), (0.33, 0, -13, 38), (0.72, 0, 0, 31), (0.6, -8, 4, 0)],
    r"$d\theta/dt$": [(0.1, 0, 9, 0), (0.72, 5, 9, 0), (0.58, 7, 3, 0), (0.54, 7, 4, 0)],
    "$f$": [(0.8, -5, 5, 0), (0.83, 0, -13, 38), (0.22, 0, 0, 25), (0.74, 5, -10, 0)],
    "$df/dt$": [(1, 6, -5, 0), (1, 6, 5, 0), (1, 6, 0, 0), (1, 6, 0, 0)],
}
"""The name of each curve in `draw_family`: its time, its offset in points, and its slope.

A name without an offset interrupts its curve.
"""


def draw_family(ax: Axes, data: Table) -> None:
    """Draw curves from a table of angles, abscissas and values (BK Fig. 2, BK Fig. 3).

    The curves belong to 30°, 90°, 150° and 165°, or to up to four of the angles in the table if
    these are missing.
    """
    (_, p), (x_label, x), (y_label, y) = _columns(data)
    rows = [np.abs(p[:, 0] - np.radians(angle)).argmin() for angle in _SHOWN]
    places: list[Any] = list(_NAMED.get(y_label, []))
    if not places or not np.allclose(np.degrees(p[rows, 0]), list(_SHOWN)):
        rows, places = np.linspace(0, len(p) - 1, min(4, len(p))).round().astype(int).tolist(), []
    for row, dash in zip(rows, _SHOWN.values(), strict=False):
        angle, colour = np.degrees(p[row, 0]), _colours(p[row, 0])
        ax.plot(x[row], y[row], color=colour, ls=dash, lw=2.2, label=f"{angle:.4g}°")
    for row, (at, dx, dy, slope) in zip(rows, places, strict=False):
        angle, colour = round(float(np.degrees(p[row, 0]))), _colours(p[row, 0])
        look: Any = {"ha": ("right", "center", "left")[1 + np.sign(dx)], "va": "center"}
        look |= {"color": colour, "rotation": slope, "textcoords": "offset points"}
        look["path_effects"] = [withStroke(linewidth=4, foreground="white")]
        text = f"$a = {angle}$°" if angle > 150 else f"${angle}$°"
        ax.annotate(text, (at, np.interp(at, x[row], y[row])), (dx, dy), **look)
    if not places:
        ax.legend(title="$a$")
    ax.set(xlabel=x_label, ylabel=y_label, xlim=(x.min(), x.max()), xticks=[0, 0.5, 1])
    ax.yaxis.set_major_locator(MaxNLocator(3, steps=[1, 2, 5, 10]))


def draw_surface(ax: Any, data: Table) -> None:
    """Draw the table of `draw_family` as a surface, in the same colours (BK Fig. 2, BK Fig. 3)."""
    (p_label, p), (x_label, x), (y_label, y) = _columns(data)
    mesh: Any = {"lw": 0.4, "edgecolor": (0, 0, 0, 0.25)}  # a transparent mesh
    look = {"facecolors": _colours(p), "shade": False}
    ax.plot_surface(x, p, y, rcount=24, ccount=25, **look, **mesh)
    ax.set_xticks([0, 0.5, 1], ["0", "0.5", "1"])
    ax.set_xlabel(x_label, labelpad=10)
    ax.set_ylabel(p_label, labelpad=13)
    ax.set_yticks([0, np.pi / 2, np.pi], ["0°", "90°", "180°"])
    ax.zaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10]))
    (left, _), (_, far), (_, top) = ax.get_xlim(), ax.get_ylim(), ax.get_zlim()
    ax.text(left, far, 1.1 * top, y_label, ha="center")  # above the vertical axis
    ax.view_init(elev=24, azim=-128)
    ax.set_box_aspect((1, 1, 0.75), zoom=0.95)


def describe_family(data: Table) -> str:
    """Return a description of the pictures of `draw_family` and `draw_surface`."""
    (_, p), (_, x), (y_label, y) = _columns(data)
    at = np.linspace(0, x.shape[1] - 1, 5).round().astype(int)
    ends = [
        f"for the {which} angle, {np.degrees(p[row, 0]):.4g}°, it is "
        + ", ".join(f"{value:.3g}" for value in y[row, at])
        for which, row in (("smallest", 0), ("largest", -1))
    ]
    times = ", ".join(f"{value:g}" for value in x[0, at])
    name = y_label.replace(r"\theta", "θ").strip("$")
    return (
        f"{name} over the time t for {len(p)} angles a from {np.degrees(p[0, 0]):.4g}° to "
        f"{np.degrees(p[-1, 0]):.4g}°, with a colour for each: a surface (left) and some of its "
        f"sections (right). At the times {times} {'; '.join(ends)}."
    )


def _colours(angle: ArrayLike) -> Any:
    """Return the colours of angles in rad; those of `_SHOWN` are equally far apart."""
    return _COLOURS(np.interp(np.degrees(angle), list(_SHOWN), np.linspace(0, 1, len(_SHOWN))))


def _columns(data: Table) -> list[tuple[str, Array]]:
    """Return the label and the values of each column."""
    plain = {name.split(" [")[0]: np.asarray(column, float) for name, column in data.items()}
    return [(_LABELS.get(name, name), column) for name, column in plain.items()]
