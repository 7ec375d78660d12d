"""Lesson 3: angles of a motion, and turns of a box."""

import re
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from rbclassroom.figures import vectors
from rbcourse import Array, pose_from_components
from rbcourse.draw.bodies import draw_arrow, draw_box, set_turning
from rbcourse.draw.save import COLOURS, Table

_LOOKS = {
    "α": (r"$\alpha$", COLOURS["z"], "-", (0.25, -90)),
    "β": (r"$\beta$", COLOURS["y"], "-.", (0.85, -60)),
    "γ": (r"$\gamma$", COLOURS["x"], "--", (0.4, 110)),
}
"""The name, the colour, the line style and the place of the name of each angle."""


def draw_angles(axes: Sequence[Axes], data: Table) -> None:
    """Draw ZYX angles over time, each motion on its own axes (RR (8))."""
    for ax, (name, angles) in zip(axes, vectors("{} {} [rad]", data, "αβγ").items(), strict=True):
        for k, (letter, (_, colour, dash, _)) in enumerate(_LOOKS.items()):
            degrees = np.degrees(angles[:, k])
            ax.plot(data["t [1]"], degrees, color=colour, ls=dash, label=letter)
        ax.set(xlabel="time $t$", title=name, xlim=(0, 1))
        ax.set_xticks([0, 0.5, 1], ["0", "0.5", "1"])
        ax.set_yticks([-180, -90, 0, 90, 180])
    axes[0].set_ylabel("angle (degrees)")
    for name, colour, _, place in _LOOKS.values():
        axes[0].text(*place, name, color=colour, ha="center", va="center")


def describe_angles(data: Table) -> str:
    """Return a description of the picture of `draw_angles`."""
    motions, said = vectors("{} {} [rad]", data, "αβγ"), []
    for name, angles in motions.items():
        alpha, beta = np.unwrap(angles[:, 0]), np.degrees(angles[:, 1])
        share = (alpha - alpha[0]) / (alpha[-1] - alpha[0])
        early, late = np.interp([0.25, 0.75], share, np.asarray(data["t [1]"]))
        said.append(
            f"{name}: β goes to {beta[np.abs(beta).argmax()]:.0f} degrees, and the middle half of "
            f"α's change takes {100 * (late - early):.1f} % of the time"
        )
    return (
        f"ZYX angles over time of bodies that turn steadily: {', '.join(motions)}. "
        f"In turn, {'; '.join(said)}."
    )


def draw_turns(axes: Sequence[Any], names: Sequence[str], R: Array) -> None:
    """Draw a box and its frame in each orientation R, shape (n, 3, 3), on separate axes.

    The names become titles; pale lines are the axes of the fixed frame (RR 2.1).
    """
    for ax, name, turned in zip(axes, names, R, strict=True):
        pose = pose_from_components(turned, np.zeros(3))
        draw_box(ax, pose, np.array([1.6, 1.0, 0.3]))
        set_turning(ax, 1.3, zoom=1.4)
        for axis, direction in zip("xyz", turned.T, strict=True):
            draw_arrow(ax, np.zeros(3), 1.2 * direction, COLOURS[axis])
            look: Any = {"color": COLOURS[axis], "ha": "center", "va": "center"}
            ax.text(*(1.54 * direction), f"${axis}$", **look)
        ax.set_title(re.sub(r"\b([xyz])\b", r"$\1$", name))


def describe_turns(names: Sequence[str], R: Array) -> str:
    """Return a description of the picture of `draw_turns`."""
    said = []
    for name, turned in zip(names, R, strict=True):
        nearest = zip("xyz", np.abs(turned).argmax(axis=0), turned.T, strict=True)
        ways = [f"{x} along {'+−'[int(v[k] < 0)]}{'xyz'[k]}" for x, k, v in nearest]
        said.append(f"{name}: {', '.join(ways)}")
    return f"Orientations of a box: {', '.join(names)}. Directions of its axes: {'; '.join(said)}."
