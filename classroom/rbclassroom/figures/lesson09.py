"""Lesson 9: the excess against the size of the excursion."""

from fractions import Fraction
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from rbclassroom.figures import named
from rbcourse.draw.save import COLOURS, Table


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
