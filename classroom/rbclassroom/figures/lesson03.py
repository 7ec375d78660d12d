"""Lesson 3: angles of a motion, and turns of a box."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from rbcourse import Array, pose_from_components
from rbcourse.draw.bodies import draw_arrow, draw_box
from rbcourse.draw.save import COLOURS, Table


def draw_angles(axes: Sequence[Axes], data: Table) -> list[Any]:
    """Draw ZYX angles over time, each motion on its own axes (RR (8))."""
    looks = {"α": (COLOURS["z"], "-"), "β": (COLOURS["y"], "-."), "γ": (COLOURS["x"], "--")}
    lines = []
    for ax, name in zip(axes, _motions(data), strict=True):
        for angle, (colour, dash) in looks.items():
            degrees = np.degrees(np.asarray(data[f"{name} {angle} [rad]"]))
            lines += ax.plot(data["t [1]"], degrees, color=colour, ls=dash, label=angle)
        ax.set(
            xlabel="time t",
            title=name,
            xlim=(0, 1),
            xticks=[0, 0.5, 1],
            yticks=[-180, -90, 0, 90, 180],
        )
    axes[0].set_ylabel("angle (degrees)")
    axes[0].legend()
    return lines


def describe_angles(data: Table) -> str:
    """Return in words what `draw_angles` shows."""
    t = np.asarray(data["t [1]"])
    said = []
    for name in _motions(data):
        alpha = np.unwrap(np.asarray(data[f"{name} α [rad]"]))
        share = (alpha - alpha[0]) / (alpha[-1] - alpha[0])
        early, late = np.interp([0.25, 0.75], share, t)
        beta = np.degrees(np.asarray(data[f"{name} β [rad]"]))
        extreme = beta[np.abs(beta).argmax()]
        said.append(
            f"{name}: β goes to {extreme:.0f} degrees, and the middle half of α's change takes "
            f"{100 * (late - early):.1f} % of the time"
        )
    return (
        f"ZYX angles over time of bodies that turn steadily: {'; '.join(_motions(data))}. "
        f"In turn, {'; '.join(said)}."
    )


def _motions(data: Table) -> list[str]:
    return [key.removesuffix(" α [rad]") for key in data if key.endswith(" α [rad]")]


def draw_turns(axes: Sequence[Any], names: Sequence[str], R: Array) -> list[Any]:
    """Draw a box with its frame in orientations R, shape (n, 3, 3), each in its own space.

    The names become titles; pale are the axes of the room (RR 2.1).
    """
    artists: list[Any] = []
    for ax, name, turned in zip(axes, names, R, strict=True):
        pose = pose_from_components(turned, np.zeros(3))
        artists.append(draw_box(ax, pose, np.array([1.6, 1.0, 0.3])))
        for room in 1.3 * np.eye(3):
            artists += ax.plot(*np.stack([-room, room], axis=1), color="0.85", lw=2, zorder=0)
        for axis, direction in zip("xyz", turned.T, strict=True):
            artists.append(draw_arrow(ax, np.zeros(3), 1.2 * direction, COLOURS[axis]))
            ax.text(*(1.45 * direction), axis, color=COLOURS[axis], ha="center", va="center")
        ax.fit(np.full(3, -1.3), np.full(3, 1.3), zoom=1.4)
        ax.view_init(elev=20, azim=-55)
        ax.set_title(name)
    return artists


def describe_turns(names: Sequence[str], R: Array) -> str:
    """Return in words what `draw_turns` shows."""
    said = [
        f"{name}: x {_heading(x)}, y {_heading(y)}, z {_heading(z)}"
        for name, (x, y, z) in zip(names, np.swapaxes(R, -1, -2), strict=True)
    ]
    return f"A box with its axes: {'; '.join(names)}. Where they point: {'; '.join(said)}."


def _heading(direction: Array) -> str:
    """Return a direction as the fixed axis that it is nearest to, with its sign."""
    k = int(np.abs(direction).argmax())
    return f"along {'−' if direction[k] < 0 else '+'}{'xyz'[k]}"
