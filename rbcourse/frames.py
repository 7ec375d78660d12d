"""Still figures of frames: artists on axes that the caller owns."""

from typing import Any

import numpy as np
from mpl_toolkits.mplot3d.art3d import Line3DCollection

from rbcourse._numerics import Array
from rbcourse.figures import COLOURS, Table
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


def draw_triad(ax: Any, origin: Array, R: Array, name: str) -> list[Any]:
    """Draw the columns of R as arrows x, y, z from the origin, with their names."""
    artists = []
    for axis, direction in zip("xyz", R.T, strict=True):
        artists.append(ax.quiver(*origin, *direction, color=COLOURS[axis], lw=2.5))
        ax.text(*(origin + 1.15 * direction), f"${axis}_{name}$", color=COLOURS[axis])
    ax.text(*(origin - [0, 0, 0.4]), f"{{{name}}}", ha="center")
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
