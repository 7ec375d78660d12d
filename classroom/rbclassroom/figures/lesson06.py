"""Lesson 6: families of projected lines, the chord, paths and the moving frame."""

from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.patches import Arc
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator
from numpy.typing import ArrayLike

from rbclassroom.figures import columns
from rbcourse import Array, angle_between
from rbcourse.draw.bodies import draw_arrow, draw_box, draw_triad
from rbcourse.draw.save import COLOURS, Table
from rbcourse.draw.scene import OVER
from rbcourse.draw.spheres import draw_sphere

_MARKED: dict[str, Any] = {"marker": "o", "markevery": 10}
_MOTIONS: dict[str, dict[str, Any]] = {
    "geodesic": {"color": COLOURS["optimum"], "ls": "-", "ms": 11, "mfc": "none", **_MARKED},
    "projected line": {"color": COLOURS["projection"], "ls": "--", "ms": 7, **_MARKED},
}
_COLOURS = ListedColormap(plt.get_cmap("viridis_r")(np.linspace(0.42, 1, 256)))
"""The colours of viridis without the bright end, which is hard to see on white."""
_SHOWN: dict[float, Any] = {30: "-", 90: "--", 150: "-.", 165: ":"}
"""The angles in degrees whose curves `draw_family` draws, with their line styles."""
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
    """Draw four curves from a table of angles, abscissas and values (BK Fig. 2, BK Fig. 3)."""
    (_, p), (x_label, x), (y_label, y) = _columns(data)
    for (angle, dash), (at, dx, dy, slope) in zip(_SHOWN.items(), _NAMED[y_label], strict=True):
        row = np.abs(p[:, 0] - np.radians(angle)).argmin()
        name, colour = f"{angle}°", _colours(p[row, 0])
        ax.plot(x[row], y[row], color=colour, ls=dash, lw=2.2, label=name)
        look: Any = {"ha": ("right", "center", "left")[1 + np.sign(dx)], "va": "center"}
        look |= {"color": colour, "rotation": slope, "textcoords": "offset points"}
        look["path_effects"] = [withStroke(linewidth=4, foreground="white")]
        text = f"$a = {angle}$°" if angle > 150 else f"${angle}$°"
        ax.annotate(text, (at, np.interp(at, x[row], y[row])), (dx, dy), **look)
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


def _colours(angle: ArrayLike) -> Any:
    """Return the colours of angles in rad; those of `_SHOWN` are equally far apart."""
    return _COLOURS(np.interp(np.degrees(angle), list(_SHOWN), np.linspace(0, 1, len(_SHOWN))))


def _columns(data: Table) -> list[tuple[str, Array]]:
    """Return the label and the values of each column."""
    plain = {name.split(" [")[0]: np.asarray(column, float) for name, column in data.items()}
    return [(_LABELS.get(name, name), column) for name, column in plain.items()]


def draw_moving_frame(ax: Any, names: Sequence[str], poses: Array) -> None:
    """Draw a fixed frame, a moving frame with its body, and the vector between them (BK Fig. 1).

    `names` and `poses`, shape (2, 4, 4), belong to the two frames.
    """
    d, R = poses[:, :3, 3], poses[:, :3, :3]
    draw_box(ax, poses[1], np.array([1.1, 0.8, 0.6])).set_alpha(0.5)
    for name, origin, axes in zip(names, d, R, strict=True):
        draw_triad(ax, origin, axes, name, 1.17)
        ax.text(*(origin + axes @ [0, 0.65, 0.65]), f"{{{name}}}", ha="center", va="center")
        ax.plot(*origin[:, None], "o", ms=5, color="black", zorder=OVER)
    draw_arrow(ax, d[0], d[1] - d[0], color=COLOURS["reference"])
    ax.text(*(d.mean(axis=0) - [0, 0, -0.1]), "$d$", ha="center", va="center")
    ax.fit(d.min(axis=0) - 0.3, d.max(axis=0) + 1, zoom=1.95)
    ax.view_init(elev=30, azim=-75)


def describe_moving_frame(names: Sequence[str], poses: Array) -> str:
    """Return a description of the picture of `draw_moving_frame`."""
    fixed, moving = names
    place = ", ".join(f"{x:g}" for x in poses[1, :3, 3])
    turn = np.degrees(angle_between(np.eye(3), poses[1, :3, :3]))
    return (
        f"The fixed frame {{{fixed}}} and the frame {{{moving}}} that moves with a body; d is the "
        "vector from the origin of the first to the origin of the second. The body is a box. The "
        f"second origin is at ({place}) m, and the second frame is turned by {turn:.0f} degrees."
    )
