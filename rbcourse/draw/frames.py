"""Still figures of frames: artists on axes that the caller owns."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from mpl_toolkits.mplot3d.art3d import Line3DCollection

from rbcourse._numerics import Array
from rbcourse.draw.save import COLOURS, Table
from rbcourse.so3 import log_so3


def pose_table(names: list[str], poses: Array) -> Table:
    """Return poses as a table: one row each, position and rotation matrix.

    Parameters
    ----------
    names : list of str
        One for each pose.
    poses : ndarray, shape (len(names), 4, 4)
        Poses [[R, d], [0, 1]].

    Returns
    -------
    dict of str to ndarray
    """
    return {"frame": np.array(names), **pose_columns(poses)}


def draw_moving_frame(ax: Any, data: Table) -> list[Any]:
    """Draw a fixed frame, a moving frame on its body, and the position vector between them.

    Parameters
    ----------
    ax : Axes3D
        Where to draw.
    data : mapping of str to array_like, shape (2,)
        A `pose_table` of the fixed frame and the moving one, in that order.

    Returns
    -------
    list of artists

    References
    ----------
    BK Fig. 1.
    """
    names, rest = np.asarray(data["frame"]), [np.asarray(data[key]) for key in list(data)[1:]]
    d, R = np.stack(rest[:3], axis=-1), np.stack(rest[3:], axis=-1).reshape(2, 3, 3)
    artists = [_draw_box(ax, d[1], R[1], np.array([0.7, 0.5, 0.35]))]
    for name, origin, axes in zip(names, d, R, strict=True):
        artists += draw_triad(ax, origin, axes, name)
        ax.text(*(origin - [0, 0, 0.4]), f"{{{name}}}", ha="center")
    vector = ax.quiver(*d[0], *(d[1] - d[0]), color=COLOURS["reference"], arrow_length_ratio=0.06)
    ax.text(*(d.mean(axis=0) - [0, 0, 0.25]), "d", fontstyle="italic")
    ax.set_box_aspect(np.ptp([ax.get_xlim(), ax.get_ylim(), ax.get_zlim()], axis=1), zoom=1.3)
    ax.set_axis_off()
    ax.view_init(elev=20, azim=-60)
    return [*artists, vector]


def describe_moving_frame(data: Table) -> str:
    """Return in words what `draw_moving_frame` shows.

    Parameters
    ----------
    data : mapping of str to array_like, shape (2,)
        As for `draw_moving_frame`.

    Returns
    -------
    str
    """
    fixed, moving = np.asarray(data["frame"])
    place = ", ".join(f"{np.asarray(data[key])[1]:g}" for key in ("x [m]", "y [m]", "z [m]"))
    R = np.array([np.asarray(data[f"R{i}{j} [1]"])[1] for i in (1, 2, 3) for j in (1, 2, 3)])
    turn = np.degrees(np.linalg.norm(log_so3(R.reshape(3, 3))))
    return (
        f"The fixed frame {{{fixed}}} with its axes x, y, z, and a box that carries the moving "
        f"frame {{{moving}}}. Its origin is at ({place}) m, the tip of the vector d, and it is "
        f"turned by {turn:.0f} degrees against the fixed one."
    )


def draw_turns(axes: Sequence[Any], data: Table) -> list[Any]:
    """Draw a box with its frame in several orientations, each on its own axes; pale: the room's.

    Parameters
    ----------
    axes : sequence of Axes3D
        Where to draw.
    data : mapping of str to array_like, shape (len(axes),)
        A `pose_table`; the names become titles.

    Returns
    -------
    list of artists

    References
    ----------
    RR 2.1.
    """
    names, R = np.asarray(data["frame"]), _rotations(data)
    artists: list[Any] = []
    for ax, name, turned in zip(axes, names, R, strict=True):
        artists.append(_draw_box(ax, np.zeros(3), turned, np.array([0.8, 0.5, 0.15])))
        for room in 1.3 * np.eye(3):
            artists += ax.plot(*np.stack([-room, room], axis=1), color="0.85", lw=2, zorder=0)
        for axis, direction in zip("xyz", turned.T, strict=True):
            arrow = {"color": COLOURS[axis], "lw": 2.5, "arrow_length_ratio": 0.15}
            artists.append(ax.quiver(0, 0, 0, *(1.2 * direction), **arrow))
            ax.text(*(1.45 * direction), axis, color=COLOURS[axis], ha="center", va="center")
        ax.set(xlim=(-1.3, 1.3), ylim=(-1.3, 1.3), zlim=(-1.3, 1.3))
        ax.set_box_aspect((1, 1, 1), zoom=1.4)
        ax.set_axis_off()
        ax.view_init(elev=20, azim=-55)
        ax.set_title(name)
    return artists


def describe_turns(data: Table) -> str:
    """Return in words what `draw_turns` shows.

    Parameters
    ----------
    data : mapping of str to array_like
        As for `draw_turns`.

    Returns
    -------
    str
    """
    said = [
        f"{name}: x {_heading(R[:, 0])}, y {_heading(R[:, 1])}, z {_heading(R[:, 2])}"
        for name, R in zip(np.asarray(data["frame"]), _rotations(data), strict=True)
    ]
    return f"A box with its axes in several orientations. Where they point: {'; '.join(said)}."


def draw_angles(axes: Sequence[Axes], data: Table) -> list[Any]:
    """Draw ZYX angles over time, each motion on its own axes.

    Parameters
    ----------
    axes : sequence of Axes
        Where to draw.
    data : mapping of str to array_like, shape (times,)
        The times; then for each motion the columns "NAME α [rad]", "NAME β [rad]" and
        "NAME γ [rad]".

    Returns
    -------
    list of Line2D

    References
    ----------
    RR (8).
    """
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
    """Return in words what `draw_angles` shows.

    Parameters
    ----------
    data : mapping of str to array_like, shape (times,)
        As for `draw_angles`.

    Returns
    -------
    str
    """
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
    return f"ZYX angles of steadily turning bodies over time. {'; '.join(said)}."


def _motions(data: Table) -> list[str]:
    return [key.removesuffix(" α [rad]") for key in data if key.endswith(" α [rad]")]


def _rotations(data: Table) -> Array:
    entries = [np.asarray(data[f"R{i}{j} [1]"]) for i in (1, 2, 3) for j in (1, 2, 3)]
    return np.stack(entries, axis=-1).reshape(-1, 3, 3)


def _heading(direction: Array) -> str:
    """Return a direction as the fixed axis that it is nearest to, with its sign."""
    k = int(np.abs(direction).argmax())
    return f"along {'−' if direction[k] < 0 else '+'}{'xyz'[k]}"


def draw_triad(ax: Any, origin: Array, R: Array, name: str) -> list[Any]:
    """Draw the columns of R as arrows x, y, z from the origin, labelled with the name."""
    artists = []
    for axis, direction in zip("xyz", R.T, strict=True):
        artists.append(ax.quiver(*origin, *direction, color=COLOURS[axis], lw=2.5))
        ax.text(*(origin + 1.15 * direction), f"${axis}_{name}$", color=COLOURS[axis])
    return artists


def _draw_box(ax: Any, centre: Array, R: Array, half: Array) -> Any:
    """Draw the edges of a box with the half sides `half`, turned by R about its centre."""
    corners = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1], indexing="ij")).reshape(3, 8).T
    placed = centre + (corners * half) @ R.T
    edges = [
        (placed[i], placed[j])
        for i in range(8)
        for j in range(i)
        if np.abs(corners[i] - corners[j]).sum() == 2
    ]
    return ax.add_collection3d(Line3DCollection(edges, colors=COLOURS["reference"], lw=1))


def pose_columns(poses: Array) -> dict[str, Array]:
    """Return position and rotation matrix of poses, shape (n, 4, 4), as columns of a table."""
    position = dict(zip(["x [m]", "y [m]", "z [m]"], poses[:, :3, 3].T, strict=True))
    entries = {f"R{i + 1}{j + 1} [1]": poses[:, i, j] for i in range(3) for j in range(3)}
    return position | entries
