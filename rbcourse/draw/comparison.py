"""Still figures that compare an optimum with its projection: artists on given axes."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from numpy.typing import ArrayLike

from rbcourse._numerics import Array
from rbcourse.curves import Curve
from rbcourse.draw.save import COLOURS, Table
from rbcourse.so3 import log_so3

_STYLES: dict[str, dict[str, Any]] = {
    "optimum": {"ls": "-", "marker": "o", "ms": 8, "mfc": "white"},
    "projection": {"ls": "--", "marker": "o", "ms": 4},
}


def coordinate_table(curves: Mapping[str, Curve], t: ArrayLike) -> Table:
    """Return the exponential coordinates σ of rotations over time, as a table.

    Parameters
    ----------
    curves : mapping of str to Curve
        Rotations over time, with their names.
    t : array_like, shape (times,)
        Times in [0, 1].

    Returns
    -------
    dict of str to ndarray

    References
    ----------
    BK 6.2, BK (21).
    """
    table = {"t [1]": np.asarray(t)}
    for name, curve in curves.items():
        for i, sigma in enumerate(log_so3(curve(t)).T, start=1):
            table[f"{name} sigma{i} [rad]"] = sigma
    return table


def draw_comparison(fig: Figure, data: Table) -> list[Any]:
    """Draw the paths in the space of σ, the coordinates over time, and their difference.

    Parameters
    ----------
    fig : Figure
        Where to draw, on axes of its own.
    data : mapping of str to array_like, shape (times,)
        A `coordinate_table` of "optimum" and "projection".

    Returns
    -------
    list of artists

    References
    ----------
    BK Fig. 4.
    """
    space: Any = {"a": {"projection": "3d"}}
    axes = fig.subplot_mosaic("ab;ac", per_subplot_kw=space, height_ratios=[2, 1])
    return [
        *draw_coordinate_paths(axes["a"], data),
        *draw_coordinates(axes["b"], data),
        *draw_difference(axes["c"], data),
    ]


def draw_coordinate_paths(ax: Any, data: Table) -> list[Any]:
    """Draw the paths of an optimum and a projection in the space of σ, every tenth time marked.

    Parameters
    ----------
    ax : Axes3D
        Where to draw.
    data : mapping of str to array_like, shape (times,)
        A `coordinate_table` of "optimum" and "projection".

    Returns
    -------
    list of Line3D

    References
    ----------
    BK Fig. 4.
    """
    lines = [
        ax.plot(*_path(data, name), color=COLOURS[name], label=name, markevery=10, **style)[0]
        for name, style in _STYLES.items()
    ]
    start, end = _path(data, "optimum")[:, [0, -1]].T
    ax.text(*start, "   t = 0", va="top")
    ax.text(*end, "t = 1   ", va="bottom", ha="right")
    ax.set_xlabel("σ₁ (rad)", labelpad=8)
    ax.set_ylabel("σ₂ (rad)", labelpad=8)
    ax.zaxis.set_rotate_label(False)
    ax.set_zlabel("σ₃ (rad)", rotation=90)
    for axis in (ax.xaxis, ax.yaxis, ax.zaxis):
        axis.set_major_locator(MaxNLocator(4))
    ax.view_init(elev=22, azim=-62)
    ax.set_box_aspect((1, 1, 0.9), zoom=0.9)
    ax.legend(loc="upper left", bbox_to_anchor=(0, 1.06))
    return lines


def draw_coordinates(ax: Axes, data: Table) -> list[Any]:
    """Draw σ₁, σ₂, σ₃ over time, of the optimum as full lines and of the projection dashed.

    Parameters
    ----------
    ax : Axes
        Where to draw.
    data : mapping of str to array_like, shape (times,)
        As for `draw_coordinate_paths`.

    Returns
    -------
    list of Line2D

    References
    ----------
    BK Fig. 4.
    """
    t = np.asarray(data["t [1]"])
    lines = []
    for name, style in _STYLES.items():
        for axis, sigma in zip("xyz", _path(data, name), strict=True):
            lines += ax.plot(t, sigma, color=COLOURS[axis], markevery=10, clip_on=False, **style)
    for axis, number, sigma in zip("xyz", "₁₂₃", _path(data, "optimum"), strict=True):
        ax.text(1.04, sigma[-1], f"σ{number}", color=COLOURS[axis], va="center")
    ax.set(xlabel="time t", ylabel="σ (rad)", xlim=(0, 1))
    ax.legend(handles=[Line2D([], [], color="0.3", label=name, **s) for name, s in _STYLES.items()])
    return lines


def draw_difference(ax: Axes, data: Table) -> list[Any]:
    """Draw by how much σ₁, σ₂, σ₃ of the projection differ from those of the optimum.

    Parameters
    ----------
    ax : Axes
        Where to draw.
    data : mapping of str to array_like, shape (times,)
        As for `draw_coordinate_paths`.

    Returns
    -------
    list of Line2D
    """
    t, difference = np.asarray(data["t [1]"]), _path(data, "projection") - _path(data, "optimum")
    lines = [
        ax.plot(t, part, color=COLOURS[axis], ls=dash, label=f"σ{number}")[0]
        for axis, number, part, dash in zip("xyz", "₁₂₃", difference, ["-", "--", ":"], strict=True)
    ]
    ax.set(xlabel="time t", ylabel="Δσ (rad)", xlim=(0, 1))
    ax.legend(
        title="projection\n− optimum", loc="center left", bbox_to_anchor=(1, 0.5), handlelength=1.5
    )
    return lines


def describe_coordinates(data: Table) -> str:
    """Return in words what `draw_comparison` shows.

    Parameters
    ----------
    data : mapping of str to array_like, shape (times,)
        As for `draw_coordinate_paths`.

    Returns
    -------
    str
    """
    best, near = _path(data, "optimum"), _path(data, "projection")
    apart = np.linalg.norm(best - near, axis=0)
    start, end = (", ".join(f"{x:.3g}" for x in best[:, k].round(9) + 0.0) for k in (0, -1))
    said = (
        "Two paths in the space of exponential coordinates, the optimum and the projection, "
        f"marked at equal times; the coordinates over time; and by how much they differ. "
        f"Both run from ({start}) to ({end}) rad. "
    )
    if apart.max() < 1e-9:
        return said + "They coincide at all times."
    when = np.asarray(data["t [1]"])[np.argmax(apart > (1 - 1e-9) * apart.max())]
    return said + f"σ differs most at t = {when:g}, by {apart.max():.2g} rad in length."


def draw_excess(ax: Axes, data: Table) -> list[Any]:
    """Draw, on logarithmic axes, what near-optimal curves cost too much over their excursion.

    Parameters
    ----------
    ax : Axes
        Where to draw.
    data : mapping of str to array_like, shape (scales,)
        The scale of the excursion; then, for each of up to four families, the cost of the
        projection over that of the optimum, minus 1.

    Returns
    -------
    list of Line2D
        The families, then a line of slope four.
    """
    (_, scale), *families = data.items()
    scale = np.asarray(scale)
    looks = [("x", "o-"), ("y", "s--"), ("z", "^-."), ("projection", "d:")]
    lines = [
        ax.plot(scale, excess, mark, color=COLOURS[look], label=name.removesuffix(" excess [1]"))[0]
        for (name, excess), (look, mark) in zip(families, looks, strict=False)
    ]
    slope = ax.plot(scale, 1e-2 * scale**4, color=COLOURS["reference"], lw=1, label="slope 4")
    ax.set(xscale="log", yscale="log", xlabel="size s of the excursion (1: as given)")
    ax.set_ylabel("cost / optimum − 1")
    ax.axhline(0.01, color=COLOURS["reference"], lw=1, ls=":")
    ax.text(scale.min(), 0.012, "1 %", color=COLOURS["reference"])
    ax.legend(loc="center left", bbox_to_anchor=(1, 0.5))
    return [*lines, *slope]


def describe_excess(data: Table) -> str:
    """Return in words what `draw_excess` shows.

    Parameters
    ----------
    data : mapping of str to array_like, shape (scales,)
        As for `draw_excess`.

    Returns
    -------
    str
    """
    (_, scale), *families = data.items()
    ends = "; ".join(
        f"{name.removesuffix(' excess [1]')} from {np.asarray(excess)[0]:.1e} to "
        f"{np.asarray(excess)[-1]:.2g}"
        for name, excess in families
    )
    return (
        "What the projection costs above the optimum, as a share, over the size of the excursion "
        f"from {np.min(scale):g} to {np.max(scale):g}, on logarithmic axes: {ends}. All follow a "
        "line of slope four where they are small."
    )


def _path(data: Table, name: str) -> Array:
    return np.array([data[f"{name} sigma{i} [rad]"] for i in (1, 2, 3)])
