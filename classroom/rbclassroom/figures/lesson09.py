"""Lesson 9: coordinates of the optimum and the projection, and the excess."""

from collections.abc import Mapping
from fractions import Fraction
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import ArrayLike

from rbclassroom.figures import columns, named, vectors
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
    sigma = {name: log_so3(curve(t)) for name, curve in curves.items()}
    return {"t [1]": np.asarray(t)} | columns(_SIGMA, sigma, "123")


def draw_comparison(fig: Figure, data: Table) -> None:
    """Draw the "optimum" and the "projection" in the coordinates σ.

    The picture shows the paths in the space of σ, the coordinates over time, and their difference.
    Every tenth time is marked (BK Fig. 4).
    """
    space: Any = {"a": {"projection": "3d"}}
    axes: Any = fig.subplot_mosaic("ab;ac", per_subplot_kw=space, height_ratios=[3, 2])
    t, sigma = data["t [1]"], vectors(_SIGMA, data, "123")
    sigma = {name: x.round(14) for name, x in sigma.items()}  # the same pixels on every processor
    _draw_paths(axes["a"], sigma)
    for name, style in _STYLES.items():
        for axis, part in zip("xyz", sigma[name].T, strict=True):
            axes["b"].plot(t, part, color=COLOURS[axis], clip_on=False, **style)
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
    best, near = (vectors(_SIGMA, data, "123")[name] for name in _STYLES)
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


def draw_excess(ax: Axes, data: Table) -> None:
    """Draw the excess of curves against the size of the excursion, on logarithmic axes."""
    scale, families = np.asarray(data["scale [1]"]), named(" excess [1]", data)
    looks = [("x", "o-", -9), ("y", "s--", 6), ("z", "^-.", 0), ("projection", "d:", 0)]
    end: Any = {"textcoords": "offset points", "va": "center"}
    for (name, excess), (look, mark, dy) in zip(families.items(), looks, strict=False):
        ax.plot(scale, excess, mark, color=COLOURS[look], label=name)
        ax.annotate(name, (scale[-1], excess[-1]), (9, dy), color=COLOURS[look], **end)
    grey: Any = {"color": COLOURS["reference"]}
    ax.plot(scale, 1e-2 * scale**4, lw=1, label="slope 4", **grey)
    ax.annotate("slope 4", (scale[-3], 1e-2 * scale[-3] ** 4), (5, -10), **grey, **end)
    ax.set(xscale="log", yscale="log", xlabel="size $s$ of the excursion (1: as given)")
    ax.set_ylabel("cost / optimum − 1")
    ax.set_xticks(scale[::2], [str(Fraction(s)) for s in scale[::2]])
    ax.set_yticks([1e-6, 1e-4, 1e-2, 1])
    ax.minorticks_off()
    ax.axhline(0.01, lw=1, ls=":", **grey)
    ax.text(scale.min(), 0.013, "1 %", **grey)
