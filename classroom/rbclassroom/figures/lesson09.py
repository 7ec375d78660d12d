"""Lesson 9: coordinates of compared curves, and the excess."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from numpy.typing import ArrayLike

from rbcourse import Array, Curve, log_so3
from rbcourse.draw.save import COLOURS, Table

_STYLES: dict[str, dict[str, Any]] = {
    "optimum": {"ls": "-", "marker": "o", "ms": 8, "mfc": "white"},
    "projection": {"ls": "--", "marker": "o", "ms": 4},
}


def coordinate_table(curves: Mapping[str, Curve], t: ArrayLike) -> Table:
    """Return the exponential coordinates σ of rotations over time, as a table (BK 6.2, BK (21))."""
    table = {"t [1]": np.asarray(t)}
    for name, curve in curves.items():
        for i, sigma in enumerate(log_so3(curve(t)).T, start=1):
            table[f"{name} sigma{i} [rad]"] = sigma
    return table


def draw_comparison(fig: Figure, data: Table) -> list[Any]:
    """Draw the paths in the space of σ, the coordinates over time, and their difference.

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

    BK Fig. 4.
    """
    lines = [
        ax.plot(*_coordinates(data, name), color=COLOURS[name], label=name, markevery=10, **style)[
            0
        ]
        for name, style in _STYLES.items()
    ]
    start, end = _coordinates(data, "optimum")[:, [0, -1]].T
    ax.text(*start, "   t = 0", va="top")
    ax.text(*end, "t = 1   ", va="bottom", ha="right")
    ax.set_xlabel("σ₁ (rad)", labelpad=11)
    ax.set_ylabel("σ₂ (rad)", labelpad=11)
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

    BK Fig. 4.
    """
    t = np.asarray(data["t [1]"])
    lines = []
    for name, style in _STYLES.items():
        for axis, sigma in zip("xyz", _coordinates(data, name), strict=True):
            lines += ax.plot(t, sigma, color=COLOURS[axis], markevery=10, clip_on=False, **style)
    for axis, number, sigma in zip("xyz", "₁₂₃", _coordinates(data, "optimum"), strict=True):
        ax.text(1.04, sigma[-1], f"σ{number}", color=COLOURS[axis], va="center")
    ax.set(xlabel="time t", ylabel="σ (rad)", xlim=(0, 1))
    ax.legend(handles=[Line2D([], [], color="0.3", label=name, **s) for name, s in _STYLES.items()])
    return lines


def draw_difference(ax: Axes, data: Table) -> list[Any]:
    """Draw by how much σ₁, σ₂, σ₃ of the projection differ from those of the optimum."""
    t, difference = (
        np.asarray(data["t [1]"]),
        _coordinates(data, "projection") - _coordinates(data, "optimum"),
    )
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
    """Return in words what `draw_comparison` shows."""
    best, near = _coordinates(data, "optimum"), _coordinates(data, "projection")
    apart = np.linalg.norm(best - near, axis=0)
    start, end = (", ".join(f"{x:.3g}" for x in best[:, k].round(9) + 0.0) for k in (0, -1))
    said = (
        "The optimum and the projection in exponential coordinates: their paths, marked at equal "
        "times, the coordinates over time, and by how much they differ. "
        f"Both run from ({start}) to ({end}) rad. "
    )
    if apart.max() < 1e-9:
        return said + "They coincide at all times."
    when = np.asarray(data["t [1]"])[np.argmax(apart > (1 - 1e-9) * apart.max())]
    return said + f"σ differs most at t = {when:g}, by {apart.max():.2g} rad in length."


def draw_excess(ax: Axes, data: Table) -> list[Any]:
    """Draw, on logarithmic axes, what near-optimal curves cost too much over their excursion."""
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
    """Return in words what `draw_excess` shows."""
    (_, scale), *families = data.items()
    ends = "; ".join(
        f"{name.removesuffix(' excess [1]')} from {np.asarray(excess)[0]:.1e} to "
        f"{np.asarray(excess)[-1]:.2g}"
        for name, excess in families
    )
    return (
        "What the projection costs above the optimum, as a share, over the size of the excursion, "
        f"on logarithmic axes. From size {np.min(scale):g} to {np.max(scale):g} it goes: {ends}. "
        "All follow a line of slope four where they are small."
    )


def _coordinates(data: Table, name: str) -> Array:
    return np.array([data[f"{name} sigma{i} [rad]"] for i in (1, 2, 3)])
