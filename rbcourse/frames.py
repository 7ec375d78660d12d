"""Still figures of frames and bodies in space: artists on axes that the caller owns."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.ticker import MultipleLocator
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection
from numpy.typing import ArrayLike

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
    return {"frame": np.array(names), **_pose_columns(poses)}


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
        artists += _draw_triad(ax, origin, axes, name)
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


def motion_table(t: ArrayLike, poses: Array) -> Table:
    """Return poses over time as a table: time, position and rotation matrix.

    Parameters
    ----------
    t : array_like, shape (times,)
        The times.
    poses : ndarray, shape (times, 4, 4)
        Poses [[R, d], [0, 1]].

    Returns
    -------
    dict of str to ndarray
    """
    return {"t [1]": np.asarray(t), **_pose_columns(poses)}


def draw_cube(ax: Any, pose: Array, side: float) -> Poly3DCollection:
    """Draw a cube with a square on one of its faces, centred at the origin of its frame.

    Parameters
    ----------
    ax : Axes3D
        Where to draw.
    pose : ndarray, shape (4, 4)
        Where the cube is.
    side : float
        Its edge, in m.

    Returns
    -------
    Poly3DCollection
        Six faces and the square; `move_cube` moves it.

    References
    ----------
    BK Fig. 5.
    """
    fill = ["0.86", "0.93", "0.98"] * 2 + [COLOURS["x"]]  # a shade for each direction
    cube = Poly3DCollection(_cube_faces(pose, side), facecolors=fill, edgecolors="0.3", lw=0.8)
    return ax.add_collection3d(cube)


def move_cube(cube: Poly3DCollection, pose: Array, side: float) -> None:
    """Move a cube that `draw_cube` has drawn."""
    cube.set_verts(_cube_faces(pose, side))


def draw_cube_motion(ax: Any, data: Table, side: float) -> list[Any]:
    """Draw a cube at several times, and stars along the path of its centre.

    Parameters
    ----------
    ax : Axes3D
        Where to draw.
    data : mapping of str to array_like, shape (times,)
        A `motion_table`; a cube is drawn at each time.
    side : float
        Its edge, in m.

    Returns
    -------
    list of artists
        The cubes, then the stars.

    References
    ----------
    BK Fig. 5.
    """
    poses = _poses(data)
    cubes = [draw_cube(ax, pose, side) for pose in poses]
    set_space(ax, poses[:, :3, 3], side)
    return [*cubes, draw_centre_path(ax, poses[:, :3, 3])]


def draw_centre_path(ax: Any, places: Array) -> Any:
    """Draw stars at places, shape (times, 3), joined by a thin line, in front of everything."""
    return ax.plot(*places.T, "*-", color=COLOURS["optimum"], ms=7, lw=0.8, zorder=1000)[0]


def set_space(ax: Any, places: Array, side: float) -> None:
    """Fit the axes to a cube at these places, shape (times, 3), with equal units."""
    low, high = places.min(axis=0) - 0.8 * side, places.max(axis=0) + 0.8 * side
    ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    ax.set(xlabel="x (m)", ylabel="y (m)")
    ax.zaxis.set_rotate_label(False)
    ax.set_zlabel("z (m)", rotation=90)
    for axis in (ax.xaxis, ax.yaxis, ax.zaxis):
        axis.set_major_locator(MultipleLocator(4))
    ax.set_box_aspect(high - low, zoom=0.9)
    ax.view_init(elev=18, azim=-22)  # never behind the square of BK Fig. 5


def moving_cubes(
    axes: Sequence[Any], tables: Mapping[str, Table], side: float
) -> Callable[[int], list[Any]]:
    """Draw cubes at the start of their motions, each on its axes; return what moves them.

    Parameters
    ----------
    axes : sequence of Axes3D
        Where to draw.
    tables : mapping of str to table
        A `motion_table` for each, with its name.
    side : float
        The edge of the cubes, in m.

    Returns
    -------
    callable
        ``update(i)`` moves all cubes to row i of their tables and returns them.
    """
    motions = [_poses(table) for table in tables.values()]
    cubes = [draw_cube(ax, poses[0], side) for ax, poses in zip(axes, motions, strict=True)]
    for ax, name, poses in zip(axes, tables, motions, strict=True):
        set_space(ax, poses[:, :3, 3], side)
        draw_centre_path(ax, poses[:: len(poses) // 10, :3, 3])
        ax.set(xlabel="", ylabel="", zlabel="", xticklabels=[], yticklabels=[], zticklabels=[])
        ax.set_title(name, color=COLOURS.get(name, "0"))

    def update(i: int) -> list[Any]:
        for cube, poses in zip(cubes, motions, strict=True):
            move_cube(cube, poses[i], side)
        return cubes

    return update


def describe_cube_motion(data: Table) -> str:
    """Return in words what `draw_cube_motion` shows.

    Parameters
    ----------
    data : mapping of str to array_like, shape (times,)
        As for `draw_cube_motion`.

    Returns
    -------
    str
    """
    poses = _poses(data)
    R = poses[:, :3, :3]
    steps = np.degrees(np.linalg.norm(log_so3(np.swapaxes(R[:-1], -1, -2) @ R[1:]), axis=-1))
    ends = " to ".join("(" + ", ".join(f"{x:g}" for x in d) + ")" for d in poses[[0, -1], :3, 3])
    return (
        f"A cube with a square on one face, at {len(poses)} times on its way from {ends} m, its "
        f"centre starred. From one to the next it turns by "
        f"{', '.join(f'{step:.0f}' for step in steps)} degrees."
    )


def _draw_triad(ax: Any, origin: Array, R: Array, name: str) -> list[Any]:
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


def _cube_faces(pose: Array, side: float) -> Array:
    """Return the corners of the six faces, and of a square on the face of +z: (7, 4, 3)."""
    around = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    faces = np.empty((7, 4, 3))
    for k in range(6):
        axis, sign = k % 3, 1 - 2 * (k // 3)
        faces[k, :, axis] = sign
        faces[k][:, [(axis + 1) % 3, (axis + 2) % 3]] = around
    faces[6] = faces[2] * [0.5, 0.5, 1.02]
    placed: Array = pose[:3, 3] + side / 2 * faces @ pose[:3, :3].T
    return placed


def _poses(data: Table) -> Array:
    columns = [np.asarray(column) for name, column in data.items() if name[0] in "xyzR"]
    poses = np.zeros((len(columns[0]), 4, 4))
    poses[:, :3, 3] = np.stack(columns[:3], axis=-1)
    poses[:, :3, :3] = np.stack(columns[3:], axis=-1).reshape(-1, 3, 3)
    poses[:, 3, 3] = 1
    return poses


def _pose_columns(poses: Array) -> dict[str, Array]:
    position = dict(zip(["x [m]", "y [m]", "z [m]"], poses[:, :3, 3].T, strict=True))
    entries = {f"R{i + 1}{j + 1} [1]": poses[:, i, j] for i in range(3) for j in range(3)}
    return position | entries
