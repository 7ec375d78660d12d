"""Lesson 6: the chord, and paths on the sphere."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Arc

from rbclassroom.figures import columns
from rbcourse import Array
from rbcourse.draw.save import COLOURS, Table
from rbcourse.draw.spheres import draw_sphere

_MARKED: dict[str, Any] = {"marker": "o", "markevery": 10}
_MOTIONS: dict[str, dict[str, Any]] = {
    "geodesic": {"color": COLOURS["optimum"], "ls": "-", "ms": 11, "mfc": "none", **_MARKED},
    "projected line": {"color": COLOURS["projection"], "ls": "--", "ms": 7, **_MARKED},
}


def draw_chord(ax: Axes, data: Table) -> None:
    """Draw equal steps along a chord of the upper unit circle, and the rays that project them."""
    t, x, y, *projected = (np.asarray(column) for column in data.values())
    grey: Any = {"color": COLOURS["reference"]}
    ax.add_patch(Arc((0, 0), 2, 2, theta1=0, theta2=180, lw=1, **grey))
    ax.plot(*([np.zeros_like(x), end] for end in projected), lw=0.8, **grey)
    steps, marks = "equal steps on the chord", "their projections on the circle"
    ax.plot(x, y, "s-", color=COLOURS["optimum"], ms=5, label=steps)
    ax.plot(*projected, "o", color=COLOURS["projection"], ms=8, label=marks)
    for k, offset in ((0, (-16, -22)), (len(x) // 2, (8, 8)), (-1, (-50, 6))):
        ax.annotate(f"$t = {t[k]:g}$", (x[k], y[k]), offset, textcoords="offset points")
    ax.text(-0.69, 0.05, "equal steps\non the chord", ha="center")
    ax.text(0.57, 0.86, "projections\non the circle", color=COLOURS["projection"])
    ax.set(aspect="equal", xlim=(-1.24, 1.12), ylim=(-0.16, 1.08), xticks=[-1, 0, 1], yticks=[0, 1])
    ax.set(xlabel="real part", ylabel="imaginary part")
    ax.grid(False)


def describe_chord(data: Table) -> str:
    """Return a description of the picture of `draw_chord`."""
    _, _, _, x, y = (np.asarray(column) for column in data.values())
    steps = np.degrees(np.diff(np.unwrap(np.arctan2(y, x))))
    return (
        "Equal steps on a chord of the unit circle and their projections on the circle. The chord "
        f"spans {steps.sum():.0f} degrees and is cut into {len(steps)} steps; rays lead from the "
        f"centre through the cuts to the circle. The first step on the circle spans {steps[0]:.0f} "
        f"degrees, the widest, in the middle, {steps.max():.0f}."
    )


def path_table(t: Array, paths: Mapping[str, Array], speeds: Mapping[str, Array]) -> Table:
    """Return paths of a point and angular speeds as a table."""
    table = {"t [1]": t}
    for name, path in paths.items():
        table |= columns("{} {} [1]", {name: path}) | {f"{name} speed [rad]": speeds[name]}
    return table


def draw_paths(ax: Any, paths: Mapping[str, Array]) -> None:
    """Draw the paths of one point, shape (times, 3), for a "geodesic" and a "projected line"."""
    draw_sphere(ax)
    for name, path in paths.items():
        ax.plot(*path.T, label=name, **_MOTIONS[name])
    way = paths["geodesic"]
    start, middle, end = way[[0, len(way) // 2, -1]]
    up = np.cross(start, end) / np.linalg.norm(np.cross(start, end))
    for when, place in (("$t = 0$", start), ("$t = 1$", end)):
        ax.text(*(0.72 * place + 0.12 * up), when, ha="center", va="center")
    x, y, z = up + middle / 2
    ax.view_init(elev=np.degrees(np.arctan2(z, np.hypot(x, y))), azim=np.degrees(np.arctan2(y, x)))


def draw_speeds(ax: Axes, t: Array, speeds: Mapping[str, Array]) -> None:
    """Draw the angular speeds of the "geodesic" and the "projected line" over time."""
    for (name, style), (x, y) in zip(_MOTIONS.items(), ((0.03, 1.14), (0.57, 0.93)), strict=True):
        ax.plot(t, speeds[name], label=name, clip_on=False, **style)
        ax.text(x, y * speeds[name].max(), name, color=style["color"])
    ax.set(xlabel="time $t$", ylabel=r"$\Vert\omega\Vert$ (rad per unit time)")
    ax.set(xlim=(0, 1), ylim=(0, None), xticks=[0, 0.5, 1], yticks=[0, 2, 4, 6])


def describe_paths(paths: Mapping[str, Array], speeds: Mapping[str, Array]) -> str:
    """Return a description of the pictures of `draw_paths` and `draw_speeds`."""
    said = []
    for name in _MOTIONS:
        speed, marks = speeds[name], paths[name][::10]
        sine = np.linalg.norm(np.cross(marks[:-1], marks[1:]), axis=1)
        steps = np.degrees(np.arctan2(sine, np.sum(marks[:-1] * marks[1:], axis=1)))
        said.append(
            f"the {name} takes the steps {', '.join(f'{step:.0f}' for step in steps)} degrees; its "
            f"speed is {speed[0]:.2f} at the start, {speed[len(speed) // 2]:.2f} in the middle, "
            f"{speed[-1]:.2f} at the end"
        )
    return (
        f"Paths of a point on a sphere, marked at equal times (left), and angular speeds (right): "
        f"{' and '.join(_MOTIONS)}. Speeds are in rad per unit time. Between the marks "
        f"{'; '.join(said)}."
    )
