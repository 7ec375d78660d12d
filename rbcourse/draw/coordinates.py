"""Drawings of curves of rotations in exponential coordinates (BK Fig. 4)."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import ArrayLike

from rbcourse import Array, Curve, log_so3
from rbcourse.draw.save import COLOURS, Table

_STYLES: dict[str, dict[str, Any]] = {
    "optimum": {"ls": "-", "marker": "o", "markevery": 10, "ms": 8, "mfc": "white"},
    "projection": {"ls": "--", "marker": "o", "markevery": 10, "ms": 4},
}
_SIGMA = "{} sigma{} [rad]"
_NAMES = r"$\sigma_1$", r"$\sigma_2$", r"$\sigma_3$"


def coordinate_table(curves: Mapping[str, Curve], t: ArrayLike) -> Table:
    """Return a table of the exponential coordinates σ of curves over time (BK 6.2, BK (21))."""
    table = {"t [1]": np.asarray(t)}
    for name, curve in curves.items():
        for k, part in enumerate(log_so3(curve(t)).T, start=1):
            table[_SIGMA.format(name, k)] = part
    return table


def _coordinates(name: str, data: Table) -> Array:
    """Return the coordinates of a curve in a table, shape (times, 3)."""
    return np.stack([data[_SIGMA.format(name, k)] for k in (1, 2, 3)], axis=-1)


def draw_comparison(fig: Figure, data: Table) -> None:
    """Draw the "optimum" and the "projection" in the coordinates σ.

    The picture shows the paths in the space of σ, the coordinates over time, and their difference.
    Every tenth time is marked (BK Fig. 4).
    """
    space: Any = {"a": {"projection": "3d"}}
    axes: Any = fig.subplot_mosaic("ab;ac", per_subplot_kw=space, height_ratios=[3, 2])
    # with fourteen decimals, the picture has the same pixels on every processor
    t, sigma = data["t [1]"], {name: _coordinates(name, data).round(14) for name in _STYLES}
    for name, style in _STYLES.items():
        # σ jumps where the rotation passes 180°; a line does not show such a jump
        jumps = np.linalg.norm(np.diff(sigma[name], axis=0), axis=1) > np.pi
        sigma[name][1:][jumps] = np.nan
        for axis, part in zip("xyz", sigma[name].T, strict=True):
            axes["b"].plot(t, part, color=COLOURS[axis], clip_on=False, **style)
    _draw_paths(axes["a"], sigma)
    looks = zip("xyz", ("-", "-.", ":"), _NAMES, strict=True)
    for k, (axis, dash, label) in enumerate(looks):
        axes["b"].text(1.04, sigma["optimum"][-1, k], label, color=COLOURS[axis], va="center")
        difference = sigma["projection"][:, k] - sigma["optimum"][:, k]
        axes["c"].plot(t, difference, color=COLOURS[axis], ls=dash, label=label)
    for name, label in {"b": r"$\sigma$ (rad)", "c": r"$\Delta\sigma$ (rad)"}.items():
        axes[name].set(ylabel=label, xlim=(0, 1), xticks=[0, 0.5, 1])
        axes[name].yaxis.set_major_locator(MaxNLocator(3, steps=[1, 2, 5, 10]))
    axes["b"].tick_params(labelbottom=False)
    axes["c"].set_xlabel("time $t$")
    axes["c"].set_title("projection − optimum", loc="left")


def _draw_paths(ax: Any, sigma: Mapping[str, Array]) -> None:
    sides = ("right", "bottom", 0.7), ("left", "top", 0.5)
    for (name, style), (ha, va, share) in zip(_STYLES.items(), sides, strict=True):
        ax.plot(*sigma[name].T, color=COLOURS[name], label=name, **style)
        place = sigma[name][int(share * len(sigma[name]))]
        ax.text(*place, f"   {name}  ", color=COLOURS[name], ha=ha, va=va)
    start, end = sigma["optimum"][[0, -1]]
    above = np.array([0, 0, 0.08 * np.ptp(sigma["optimum"][:, 2])])
    ax.text(*(start + above), "$t = 0$     ", ha="right")
    ax.text(*(end + above), "$t = 1$", ha="center")
    labels = [f"{name} (rad)" for name in _NAMES]
    ax.set_xlabel(labels[0], labelpad=11)
    ax.set_ylabel(labels[1], labelpad=11)
    ax.zaxis.set_rotate_label(False)
    ax.set_zlabel(labels[2], rotation=90, labelpad=4)
    for axis in (ax.xaxis, ax.yaxis, ax.zaxis):
        axis.set_major_locator(MaxNLocator(3, steps=[1, 2, 5, 10]))
    ax.view_init(elev=22, azim=-62)
    ax.set_box_aspect((1, 1, 0.9), zoom=0.9)


def describe_coordinates(data: Table) -> str:
    """Return a description of the picture of `draw_comparison`."""
    best, near = (_coordinates(name, data) for name in _STYLES)
    apart = np.linalg.norm(best - near, axis=-1)
    start, end = (", ".join(f"{x:.3g}" for x in best[k].round(9) + 0.0) for k in (0, -1))
    said = (
        "Optimum and projection in exponential coordinates σ: their paths, marked at equal times "
        "(left), the coordinates over time and the differences (right). "
        f"Both run from ({start}) to ({end}) rad. "
    )
    if apart.max() < 1e-9:
        return said + "They coincide at all times."
    when = np.asarray(data["t [1]"])[np.argmax(apart > (1 - 1e-9) * apart.max())]
    return said + f"σ differs most at t = {when:g}, by {apart.max():.2g} rad in length."
