"""Lesson 13: motions of a body for several costs, and free motions (beyond BK 1)."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rbclassroom.figures import columns, name_ends, name_lines, vectors
from rbclassroom.figures.lesson12 import draw_maps, groups, shares
from rbcourse import Array, Body, Curve, log_so3
from rbcourse.closed_forms import normal_cubic
from rbcourse.connection import geodesic_flow
from rbcourse.draw.save import COLOURS, Table

LOOKS: dict[str, dict[str, Any]] = {
    "as if a ball": {"color": COLOURS["reference"], "ls": ":", "lw": 2.5},
    "least acceleration": {"color": COLOURS["optimum"], "ls": "-"},
    "least torque": {"color": COLOURS["screw"], "ls": "--"},
}
"""Three motions of a body, and the styles of their lines; no colour is that of an axis."""
_MAPPED = {
    "weighted": "weighted\nprojection",
    "two Béziers": "cheaper of\ntwo Béziers",
    "normal": "normal\ncubic",
}
"""The curves with a map, by their names in the stored table; the table has more curves."""
_SPEEDS = {"least jerk": ("optimum", "-"), "projected quintic": ("projection", "--")}


def torques(curve: Curve, inertia: Array, t: Array) -> Array:
    """Return the torques G w' + w × G w at the times t, in body axes, shape (times, 3)."""
    w = curve(t, 1)
    return curve(t, 2) @ inertia + np.cross(w, w @ inertia)


def torque_table(t: Array, curves: Mapping[str, Curve], inertia: Array) -> dict[str, Array]:
    """Return a table of the torques of curves over time, in body axes."""
    found = {name: torques(curve, inertia, t) for name, curve in curves.items()}
    return {"t [s]": t} | columns("{} {} [N m]", found)


def draw_torques(axes: Sequence[Axes], data: Table) -> None:
    """Draw the components and the norm of each torque of a `torque_table`, one Axes per torque.

    The norm has the style of its motion in `LOOKS`.
    """
    norm = r"$\Vert\tau\Vert$"
    t, laws = data["t [s]"], vectors("{} {} [N m]", data)
    for ax, (law, torque) in zip(axes, laws.items(), strict=True):
        ax.axhline(0, color="0.8", lw=1, zorder=0)
        for axis, column, dash in zip("xyz", torque.T, ("-", "--", "-."), strict=True):
            ax.plot(t, column, color=COLOURS[axis], ls=dash, lw=1.5, label=f"about ${axis}$")
        ax.plot(t, np.linalg.norm(torque, axis=-1), label=norm, **LOOKS[law] | {"lw": 3.5})
        ax.set_title(law, color=LOOKS[law]["color"])
        ax.set(xlabel="time (s)", xlim=(0, 1), yticks=[-0.1, 0, 0.1])
        ax.set_xticks([0, 0.5, 1], ["0", "0.5", "1"])
    axes[0].set_ylabel("torque in body axes (N m)")
    name_ends(axes[-1])
    for ax in axes[:-1]:
        name_lines(ax, {norm: (0.66, 0.09)})


def describe_torques(data: Table) -> str:
    """Return a description of the picture of `draw_torques`."""
    said = []
    for law, torque in vectors("{} {} [N m]", data).items():
        largest = np.linalg.norm(torque, axis=-1).max()
        each = ", ".join(f"{x:.2g}" for x in np.abs(torque).max(axis=0))
        said.append(f"{law}: {largest:.2g} N m, about x, y, z {each}")
    return (
        "Torque on a body over time, in body axes, and its norm, for several motions of the "
        f"body. The largest values: {'; '.join(said)}."
    )


def speed_table(t: Array, curves: Mapping[str, Curve]) -> dict[str, Array]:
    """Return a table of the angular speeds of curves over time."""
    speeds = {name: np.linalg.norm(curve(t, 1), axis=-1) for name, curve in curves.items()}
    return {"t [1]": t} | {f"{name} [rad]": speed for name, speed in speeds.items()}


def draw_speeds(ax: Axes, data: Table) -> None:
    """Draw a `speed_table` of two curves, the "least jerk" and the "projected quintic"."""
    for name, (colour, dash) in _SPEEDS.items():
        ax.plot(data["t [1]"], data[f"{name} [rad]"], label=name, color=COLOURS[colour], ls=dash)
    ax.set(xlabel="time $t$", xlim=(0, 1), ylim=(0, None))
    ax.set(ylabel=r"$\Vert\omega\Vert$ (rad per unit time)", yticks=[0, 5, 10, 15])
    ax.set_xticks([0, 0.5, 1], ["0", "0.5", "1"])
    name_lines(ax, {"projected quintic": (0.58, 13.5), "least jerk": (0.66, 5.5)}, ha="left")


_FREE = "{} {} [rad]"
_COORDINATES = "exponential coordinates", "normal coordinates"


def normal_table(t: Array, w: Array, inertia: Array) -> dict[str, Array]:
    """Return a table of free motions in exponential and in normal coordinates (beyond BK 7).

    The motions start at I with the angular velocities w, shape (motions, 3). For each motion, the
    columns have the x and y components of three curves at the times t: the straight line t w, the
    logarithm, and the normal coordinates. The normal coordinates are exact to second order, as in
    `closed_forms.normal_cubic`.
    """
    R, _ = geodesic_flow(inertia, np.eye(3), w, t)
    cubics: Any = normal_cubic(np.eye(3), R, body=Body(inertia))
    normal = cubics.controls[..., 1, :]
    line = np.multiply.outer(t, w)
    kinds = dict(zip(("straight", *_COORDINATES), (line, log_so3(R), normal), strict=True))
    found = {f"{kind} {k + 1}": x[:, k] for kind, x in kinds.items() for k in range(len(w))}
    return {"t [s]": t} | columns(_FREE, found, "xy")


def draw_normal(axes: Sequence[Axes], data: Table) -> None:
    """Draw the motions and lines of a `normal_table`, each kind of coordinates on its own axes.

    The motions have dots at half time and at the end.
    """
    lines, *kinds = _by_kind(data).items()
    for ax, (kind, motions) in zip(axes, kinds, strict=True):
        for k, line in enumerate(lines[1]):
            ax.plot(*line.T, color=COLOURS["reference"], ls=":", label="" if k else "straight line")
        look: dict[str, Any] = {"color": COLOURS["optimum"], "marker": "o", "ms": 5}
        middle = len(motions[0]) // 2
        for k, motion in enumerate(motions):
            label = "" if k else "free motion"
            ax.plot(*motion.T, markevery=[middle, -1], label=label, **look)
        reach, ticks = 1.05 * np.abs([lines[1], motions]).max(), [-0.5, 0, 0.5]
        ax.set(title=kind, xlabel="about $x$ (rad)", aspect="equal")
        ax.set(xlim=(-reach, reach), ylim=(-reach, reach), xticks=ticks, yticks=ticks)
    axes[0].set_ylabel("about $y$ (rad)")
    names = axes[0].get_legend_handles_labels()
    axes[0].figure.legend(*names, loc="outside lower center", ncols=2)


def describe_normal(data: Table) -> str:
    """Return a description of the picture of `draw_normal`."""
    (_, lines), *kinds = _by_kind(data).items()
    said = []
    for kind, motions in kinds:
        x, y = np.array([lines, motions])[:, :, -1] @ np.array([1, 1j])
        off = np.degrees(np.abs(np.angle(y / x))).max()
        said.append(f"in {kind} by up to {off:.0f} degrees")
    return (
        f"{len(lines)} free motions of a body from one rotation, and straight lines with the same "
        f"start, in {' and '.join(kind for kind, _ in kinds)}. Seen from the start the end of a "
        f"motion is off its line {', '.join(said)}."
    )


def _by_kind(data: Table) -> dict[str, list[Array]]:
    """Return the motions of a `normal_table`, shape (times, 2), by their kind."""
    found: dict[str, list[Array]] = {}
    for name, motion in vectors(_FREE, data, "xy").items():
        found.setdefault(name.rpartition(" ")[0], []).append(motion)
    return found


def draw_body_atlas(fig: Figure, data: Table, bodies: Sequence[str]) -> None:
    """Draw maps of medians, with a row for each body and a column for each curve of `_MAPPED`.

    `data` is the stored table "maps" of `rbclassroom.atlas` (beyond BK 3).
    """
    cells = groups(data, "body")
    columns = {f"{curve} median [1]": title for curve, title in _MAPPED.items()}
    draw_maps(fig, {body: cells[body] for body in bodies}, columns, "median")


def describe_body_atlas(data: Table, bodies: Sequence[str]) -> str:
    """Return a description of the figure of `draw_body_atlas`."""
    cells, said = groups(data, "body"), []
    for body in bodies:
        each = (f"{title} {shares(cells[body][f'{x} median [1]'])}" for x, title in _MAPPED.items())
        said.append(f"{body}: {', '.join(each)}".replace("\n", " "))
    return (
        "Median of the cost over the optimum minus 1, with a row for each body and a column for "
        "each curve. In each heat map, to the right the displacement grows from 0 to 180 degrees, "
        "and upwards the end velocity from 0 to 9 rad. Share of the cells below 10 %, in percent: "
        f"{'; '.join(said)}."
    )
