"""Bodies on their way: artists on axes that the caller owns, still or moving."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.ticker import MultipleLocator
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from numpy.typing import ArrayLike

from rbcourse._numerics import Array
from rbcourse.draw.frames import draw_triad, pose_columns
from rbcourse.draw.save import COLOURS, Table
from rbcourse.so3 import log_so3


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
    return {"t [1]": np.asarray(t), **pose_columns(poses)}


def draw_box(ax: Any, pose: Array, edges: float | Array) -> Poly3DCollection:
    """Draw a box with a rectangle on one of its faces, centred at the origin of its frame.

    Parameters
    ----------
    ax : Axes3D
        Where to draw.
    pose : ndarray, shape (4, 4)
        Where the box is.
    edges : float or ndarray of shape (3,)
        Its three edges, or the one of a cube, in m.

    Returns
    -------
    Poly3DCollection
        Six faces and the rectangle; `move_box` moves it.

    References
    ----------
    BK Fig. 5.
    """
    fill = ["0.86", "0.93", "0.98"] * 2 + [COLOURS["x"]]  # a shade for each direction
    box = Poly3DCollection(_box_faces(pose, edges), facecolors=fill, edgecolors="0.3", lw=0.8)
    return ax.add_collection3d(box)


def move_box(box: Poly3DCollection, pose: Array, edges: float | Array) -> None:
    """Move a box that `draw_box` has drawn."""
    box.set_verts(_box_faces(pose, edges))


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
    poses = poses_from_table(data)
    cubes = [draw_box(ax, pose, side) for pose in poses]
    set_space(ax, poses[:, :3, 3], side)
    return [*cubes, draw_centre_path(ax, poses[:, :3, 3])]


def draw_centre_path(ax: Any, places: Array) -> Any:
    """Draw stars at places, shape (times, 3), joined by a thin line, in front of everything."""
    return ax.plot(*places.T, "*-", color=COLOURS["optimum"], ms=7, lw=0.8, zorder=1000)[0]


def set_space(ax: Any, places: Array, side: float) -> None:
    """Fit the axes to a cube at these places, shape (times, 3), with equal units."""
    low, high = places.min(axis=0) - 0.9 * side, places.max(axis=0) + 0.9 * side
    ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    ax.set(xlabel="x (m)", ylabel="y (m)")
    ax.zaxis.set_rotate_label(False)
    ax.set_zlabel("z (m)", rotation=90)
    for axis in (ax.xaxis, ax.yaxis, ax.zaxis):
        axis.set_major_locator(MultipleLocator(4))
    ax.set_box_aspect(high - low, zoom=0.97)
    ax.set_proj_type("ortho")  # in perspective the square can sink into its face
    ax.view_init(elev=18, azim=-22)  # never behind the square of BK Fig. 5


def draw_ways(ax: Any, tables: Mapping[str, Table]) -> list[Any]:
    """Draw the paths of the origin in several motions, and its frame at the start and the ends.

    Parameters
    ----------
    ax : Axes3D
        Where to draw.
    tables : mapping of str to table
        A `motion_table` for up to three motions from one pose at the same times, with their names.

    Returns
    -------
    list of Line3D
        A path for each motion.

    References
    ----------
    BK 2.6.
    """
    looks = [(COLOURS["optimum"], "-"), (COLOURS["screw"], "--"), (COLOURS["reference"], ":")]
    lines = [
        ax.plot(*poses_from_table(table)[:, :3, 3].T, color=colour, ls=dash, lw=2.5, label=name)[0]
        for (name, table), (colour, dash) in zip(tables.items(), looks, strict=False)
    ]
    ways = [poses_from_table(table) for table in tables.values()]
    poses = [ways[0][0]]
    for A in ways:
        if all(np.abs(A[-1] - other).max() > 1e-9 for other in poses[1:]):
            poses.append(A[-1])
    for pose, name in zip(poses, "0111", strict=False):
        draw_triad(ax, pose[:3, 3], pose[:3, :3], name)
    paths = np.array([line.get_data_3d() for line in lines])
    places = np.concatenate(paths, axis=1).T
    set_space(ax, np.concatenate([places, *(A[:3, 3] + 0.5 * A[:3, :3].T for A in poses)]), 1.0)
    _look_across(ax, paths)
    ax.legend(loc="upper left", bbox_to_anchor=(0, 1.1))
    return lines


def _look_across(ax: Any, paths: Array) -> None:
    """Look at the plane in which the paths, shape (n, 3, times), bend away from the chord."""
    chord = paths[0, :, -1] - paths[0, :, 0]
    from_start = (paths - paths[:, :, :1]).transpose(0, 2, 1).reshape(-1, 3)
    off = from_start - np.outer(from_start @ chord, chord) / (chord @ chord)
    x, y, z = np.cross(off[np.linalg.norm(off, axis=-1).argmax()], chord)
    up = 1 if z >= 0 else -1
    ax.view_init(
        np.degrees(np.arctan2(up * z, np.hypot(x, y))), np.degrees(np.arctan2(up * y, up * x))
    )


def describe_ways(tables: Mapping[str, Table]) -> str:
    """Return in words what `draw_ways` shows.

    Parameters
    ----------
    tables : mapping of str to table
        As for `draw_ways`.

    Returns
    -------
    str
    """
    lengths = []
    for name, table in tables.items():
        steps = np.linalg.norm(np.diff(poses_from_table(table)[:, :3, 3], axis=0), axis=-1)
        lengths.append(f"{name} {steps.sum():.2f} m")
    return (
        "The paths of the origin of a frame in several motions from one pose, and the frame at the "
        f"ends. Lengths of the paths: {', '.join(lengths)}."
    )


def moving_cubes(
    axes: Sequence[Any], tables: Mapping[str, Table], side: float
) -> Callable[[int], list[Any]]:
    """Draw cubes at the start of their motions, each on its axes; return what moves them.

    Parameters
    ----------
    axes : sequence of Axes3D
        Where to draw.
    tables : mapping of str to table
        A `motion_table` for each at the same times, with its name.
    side : float
        The edge of the cubes, in m.

    Returns
    -------
    callable
        ``update(i)`` moves all cubes to row i of their tables and returns them.
    """
    motions = [poses_from_table(table) for table in tables.values()]
    cubes = [draw_box(ax, poses[0], side) for ax, poses in zip(axes, motions, strict=True)]
    for ax, name, poses in zip(axes, tables, motions, strict=True):
        set_space(ax, poses[:, :3, 3], side)
        if np.ptp(poses[:, :3, 3], axis=0).any():
            draw_centre_path(ax, poses[:: max(1, len(poses) // 10), :3, 3])
        ax.set(xlabel="", ylabel="", zlabel="", xticklabels=[], yticklabels=[], zticklabels=[])
        ax.set_title(name)

    def update(i: int) -> list[Any]:
        for cube, poses in zip(cubes, motions, strict=True):
            move_box(cube, poses[i], side)
        return cubes

    return update


def describe_moving_cubes(tables: Mapping[str, Table]) -> str:
    """Return in words what `moving_cubes` shows.

    Parameters
    ----------
    tables : mapping of str to table
        As for `moving_cubes`.

    Returns
    -------
    str
    """
    (first, table), *others = tables.items()
    t, R = np.asarray(table["t [1]"]), np.swapaxes(poses_from_table(table)[:, :3, :3], -1, -2)
    said = f"Cubes with a square on one face move side by side: {', '.join(tables)}."
    for name, other in others:
        apart = np.degrees(np.linalg.norm(log_so3(R @ poses_from_table(other)[:, :3, :3]), axis=-1))
        said += (
            f" The orientations of {first} and {name} differ most at t = {t[apart.argmax()]:.2f}, "
            f"by {apart.max():.0f} degrees."
            if apart.max() > 1e-6
            else f" The orientations of {first} and {name} agree at all times."
        )
    return said


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
    poses = poses_from_table(data)
    R = poses[:, :3, :3]
    steps = np.degrees(np.linalg.norm(log_so3(np.swapaxes(R[:-1], -1, -2) @ R[1:]), axis=-1))
    ends = " to ".join("(" + ", ".join(f"{x:g}" for x in d) + ")" for d in poses[[0, -1], :3, 3])
    return (
        f"A cube with a square on one face, at {len(poses)} times on its way from {ends} m, its "
        f"centre starred. From one to the next it turns by "
        f"{', '.join(f'{step:.0f}' for step in steps)} degrees."
    )


def _box_faces(pose: Array, edges: float | Array) -> Array:
    """Return the corners of the six faces, and of a rectangle on the face of +z: (7, 4, 3)."""
    around = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    faces = np.empty((7, 4, 3))
    for k in range(6):
        axis, sign = k % 3, 1 - 2 * (k // 3)
        faces[k, :, axis] = sign
        faces[k][:, [(axis + 1) % 3, (axis + 2) % 3]] = around
    faces[6] = faces[2] * [0.5, 0.5, 1.02]
    placed: Array = pose[:3, 3] + edges / 2 * faces @ pose[:3, :3].T
    return placed


def poses_from_table(data: Table) -> Array:
    """Return the poses, shape (times, 4, 4), of a `motion_table`."""
    columns = [np.asarray(column) for name, column in data.items() if name[0] in "xyzR"]
    poses = np.zeros((len(columns[0]), 4, 4))
    poses[:, :3, 3] = np.stack(columns[:3], axis=-1)
    poses[:, :3, :3] = np.stack(columns[3:], axis=-1).reshape(-1, 3, 3)
    poses[:, 3, 3] = 1
    return poses
