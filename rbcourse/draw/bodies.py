"""Drawings of bodies and frames, still or moving, as artists on the caller's `Space`.

Motions are arrays of poses, shape (times, 4, 4); `pose_table` turns them into columns for a file.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.ticker import MaxNLocator
from numpy.typing import ArrayLike

from rbcourse import Array, Curve, angle_between
from rbcourse.draw.save import COLOURS, Table
from rbcourse.draw.scene import OVER
from rbcourse.draw.space import Faces


def pose_table(first: Table, poses: Array) -> Table:
    """Return poses as a table: the given columns (such as times), positions and rotations.

    Examples
    --------
    >>> list(pose_table({"t [1]": [0]}, np.eye(4)[None]))[:5]
    ['t [1]', 'x [m]', 'y [m]', 'z [m]', 'R11 [1]']
    """
    position = dict(zip(["x [m]", "y [m]", "z [m]"], poses[:, :3, 3].T, strict=True))
    entries = {f"R{i + 1}{j + 1} [1]": poses[:, i, j] for i in range(3) for j in range(3)}
    return {**first, **position, **entries}


def motion_table(t: Array, motion: Curve, drawn: Array) -> Table:
    """Return a table of a motion with times, poses, twists and accelerations.

    A column marks the times at which the body is drawn. The twists (w, v) and the accelerations
    (w', a), where a = Rᵀ d'', are in the body frame (BK 6.3).

    Examples
    --------
    >>> from rbcourse import geodesic
    >>> t = np.linspace(0, 1, 7)
    >>> motion_table(t, geodesic(np.eye(4), np.eye(4)), t[::2])["drawn [1]"]
    array([1, 0, 1, 0, 1, 0, 1])
    """
    first = {"t [1]": t, "drawn [1]": np.isin(t, drawn).astype(int)}
    state = motion.state(t)
    names = [f"{x}{i} [{unit}]" for x, unit in (("w", "rad"), ("v", "m")) for i in (1, 2, 3)]
    names += [f"{x}{i}{unit}" for x, unit in (("w", "' [rad]"), ("a", " [m]")) for i in (1, 2, 3)]
    rates = dict(zip(names, np.hstack([state.velocity, state.acceleration]).T, strict=True))
    return {**pose_table(first, state.pose), **rates}


def draw_box(ax: Any, pose: Array, edges: float | Array) -> Faces:
    """Draw a box, centred at the origin of its frame, with a rectangle on its +z face.

    `edges` gives the lengths of its three edges in m, or one length for a cube. `move_box` moves
    the box (BK Fig. 5).
    """
    box: Faces = ax.add_artist(Faces(_box_faces(pose, edges), [*["#E6F0FB"] * 6, COLOURS["z"]]))
    return box


def move_box(box: Faces, pose: Array, edges: float | Array) -> None:
    """Move a box that `draw_box` has drawn."""
    box.corners = _box_faces(pose, edges)


def _draw_outline(ax: Any, pose: Array, edges: float | Array) -> Faces:
    """Draw only the edges of a box."""
    box = draw_box(ax, pose, edges)
    box.set(colours=7 * ["none"], edgecolor=COLOURS["optimum"])
    return box


def draw_cube_motion(
    ax: Any,
    poses: Array,
    side: float,
    *,
    omitted: Sequence[int] = (),
    compared: Sequence[Array] | Array = (),
) -> list[Any]:
    """Draw a cube at each pose, and stars in front of the cubes at their centres.

    The edges of the cubes have the length `side` in m. Poses with the indices `omitted` have a star
    but no cube. Behind these cubes, black outlines show cubes at the poses `compared`; then the
    edges of the cubes are pink. Return the artists of the cubes, and then the stars (BK Fig. 5).
    """
    for pose in compared:
        _draw_outline(ax, pose, side).set_zorder(-1)
    cubes = [draw_box(ax, pose, side) for i, pose in enumerate(poses) if i not in omitted]
    for cube in cubes if len(compared) else ():
        cube.set_edgecolor(COLOURS["projection"])
    set_space(ax, poses[:, :3, 3], side, zoom=1.1)
    stars = draw_centre_path(ax, poses[:, :3, 3])
    stars.set_zorder(OVER)
    return [*cubes, stars]


def draw_centre_path(ax: Any, places: Array) -> Any:
    """Draw stars at points, shape (times, 3), joined by a thin line."""
    return ax.plot(*places.T, "*-", color=COLOURS["optimum"], ms=7, lw=0.8)[0]


def set_space(
    ax: Any, places: Array, side: float, view: tuple[float, float] = (18, -22), zoom: float = 1.0
) -> None:
    """Fit the axes to a cube at these positions, shape (times, 3), and draw a floor and axes.

    The axes have names and numbers in m. The vertical axis is at the corner that is farthest to
    the left. `view` is the elevation and the azimuth in degrees.
    """
    low, high = places.min(axis=0) - 0.9 * side, places.max(axis=0) + 0.9 * side
    ax.fit(low, high, zoom)
    ax.view_init(*view)
    draw_ground(ax, low, high)
    ticks = [_ticks(*ends) for ends in zip(low, high, strict=True)]
    # each axis has a start, and an offset of its numbers
    azimuth = np.radians(view[1])
    left = np.array([np.sin(azimuth), -np.cos(azimuth), 0])
    corners = [low, np.array([high[0], *low[1:]]), np.where(left > 0, high, low)]
    beside = 0.06 * np.max(high - low) * np.array([[0, -1, -0.4], [1, 0, -0.4], left])
    centred: Any = {"ha": "center", "va": "center", "zorder": 3}
    for k, name in enumerate("xyz"):
        start, along = corners[k], np.eye(3)[k]
        end = start + (high - low) * along
        ax.plot(*np.stack([start, end], axis=-1), color="0.5", lw=1, zorder=0)
        for tick in ticks[k]:
            place = start + (tick - start[k]) * along + beside[k]
            ax.text(*place, f"{tick:g}", color="0.4", **centred)
        if name == "z":
            place = end + 0.09 * np.max(high - low) * along
        else:  # beside the last of the widest gaps, and farther out than the numbers
            marks = np.array([start[k], *ticks[k], end[k]])
            last = len(marks) - 2 - np.diff(marks)[::-1].round(9).argmax()
            place = start + (marks[last : last + 2].mean() - start[k]) * along + 3 * beside[k]
        ax.text(*place, f"${name}$ (m)", **centred)


def set_turning(ax: Any, reach: float, zoom: float, lw: float = 2.0, named: bool = False) -> None:
    """Fit the axes to a turning body whose points are within `reach` (in m) of the origin.

    Draw the axes of the fixed frame in a pale colour, with the line width `lw` and maybe names. In
    the initial view the body does not cover the names.
    """
    ax.fit(np.full(3, -reach), reach * np.array([1, 1, 1.15 if named else 1]), zoom)
    ax.view_init(elev=20, azim=-55)
    for name, axis in zip("xyz", np.eye(3), strict=True):
        far = reach / float(np.linalg.norm(np.cross(axis, ax.sight().eye))) if named else reach
        ax.plot(*np.outer(axis, [-reach, far]), color="0.75", lw=lw, zorder=0)
        if named:
            ax.text(*(1.1 * far * axis), f"${name}$", color="0.4", ha="center", va="center")


def draw_ground(ax: Any, low: Array, high: Array) -> None:
    """Draw a floor between two corners; its lines are at the numbers that `set_space` writes."""
    pale: Any = {"color": "0.8", "lw": 0.8, "zorder": 0}
    for x in [low[0], *_ticks(low[0], high[0]), high[0]]:
        ax.plot([x, x], [low[1], high[1]], low[2], **pale)
    for y in [low[1], *_ticks(low[1], high[1]), high[1]]:
        ax.plot([low[0], high[0]], [y, y], low[2], **pale)


def _ticks(low: float, high: float) -> list[float]:
    found = MaxNLocator(3, steps=[1, 2, 4, 5, 10]).tick_values(low, high)
    return [float(x) for x in found if low < x < high]


def describe_cube_motion(poses: Array) -> str:
    """Return a description of the picture of `draw_cube_motion`."""
    steps = np.degrees(angle_between(poses[:-1, :3, :3], poses[1:, :3, :3]))
    ends = " to ".join("(" + ", ".join(f"{x:.3g}" for x in d) + ")" for d in poses[[0, -1], :3, 3])
    return (
        f"Motion of a cube from {ends} m, shown at {len(poses)} times. A square marks one of its "
        f"faces, and a star its centre. From one time to the next it turns by "
        f"{', '.join(f'{step:.0f}' for step in steps)} degrees."
    )


def draw_ways(ax: Any, ways: Mapping[str, Array], places: ArrayLike = ()) -> list[Any]:
    """Draw up to three motions of a frame: the paths of its origin, and the frame at the ends.

    The motions begin at the same pose, where letters mark the axes of the frame. The names of the
    motions are written at `places`, shape (motions, 3). Return a line for each motion (BK 2.6).
    """
    looks: list[dict[str, Any]] = [
        {"color": COLOURS["optimum"], "ls": "-", "lw": 2},
        {"color": COLOURS["screw"], "ls": "--", "lw": 2.5},
        {"color": COLOURS["reference"], "ls": ":", "lw": 4, "zorder": 1},  # seen below the others
    ]
    lines = [
        ax.plot(*poses[:, :3, 3].T, label=name, **look)[0]
        for (name, poses), look in zip(ways.items(), looks, strict=False)
    ]
    for line, place in zip(lines, np.asarray(places), strict=False):
        ax.text(*place, line.get_label(), color=line.get_color(), ha="center", va="center")
    start, ends = next(iter(ways.values()))[0], list[Array]()
    for poses in ways.values():
        if all(np.abs(poses[-1] - other).max() > 1e-9 for other in ends):
            ends.append(poses[-1])
    draw_triad(ax, start[:3, 3], start[:3, :3], "0", (1.4, 1.9, 1.4))
    for pose in ends:
        draw_triad(ax, pose[:3, 3], pose[:3, :3])
    places = [poses[:, :3, 3] for poses in ways.values()]
    tips = [A[:3, 3] + A[:3, :3].T for A in (start, *ends)]
    set_space(ax, np.concatenate([*places, *tips]), 0.6, view=(32, -65), zoom=0.95)
    return lines


def describe_ways(ways: Mapping[str, Array]) -> str:
    """Return a description of the picture of `draw_ways`."""
    lengths = []
    for name, poses in ways.items():
        steps = np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=-1)
        lengths.append(f"{name} {steps.sum():.2f} m")
    return (
        "Paths of a frame's origin from the same pose, and its axes at the start and at the ends: "
        f"x orange, y green, z blue. Lengths of the paths: {'; '.join(lengths)}."
    )


def moving_boxes(
    axes: Sequence[Any],
    motions: Mapping[str, Array],
    edges: float | Array,
    compared: Array | None = None,
) -> Callable[[int], list[Any]]:
    """Draw a box for each motion, on separate axes; return a function that moves all boxes.

    The motions have the same number of poses. `edges` gives the lengths of a box's edges in m, or
    one length for cubes. Boxes that stay at the origin are drawn larger; they have the axes of the
    fixed frame instead of a floor. On the last axes, a black outline shows the box in the motion
    `compared`, and the box has pink edges. Return ``update(i)``, which moves all boxes to pose i of
    their motions and returns their artists, the outline last.
    """
    ways = list(motions.values())
    boxes = [draw_box(ax, poses[0], edges) for ax, poses in zip(axes, ways, strict=True)]
    for ax, name, poses in zip(axes, motions, ways, strict=True):
        if poses[:, :3, 3].any():
            set_space(ax, poses[:, :3, 3], float(np.max(edges)))
            draw_centre_path(ax, poses[:: max(1, len(poses) // 10), :3, 3])
        else:
            reach = 0.5 * float(np.linalg.norm(edges * np.ones(3)))
            set_turning(ax, reach, zoom=1.5, named=True)
        ax.set_title(name)
    if compared is not None:
        boxes[-1].set_edgecolor(COLOURS["projection"])
        ways.append(compared)
        boxes.append(_draw_outline(axes[-1], compared[0], edges))
        boxes[-1].set_linewidth(2)

    def update(i: int) -> list[Any]:
        for box, poses in zip(boxes, ways, strict=True):
            move_box(box, poses[i], edges)
        return boxes

    return update


def describe_moving_boxes(t: Array, motions: Mapping[str, Array]) -> str:
    """Return a description of the picture of `moving_boxes`; t are the times of the poses."""
    (first, poses), *others = motions.items()
    said = f"Motions of a box: {', '.join(motions)}. A rectangle marks one of its faces."
    for name, other in others:
        apart = np.degrees(angle_between(poses[:, :3, :3], other[:, :3, :3]))
        said += (
            f" The orientations of {first} and {name} differ most at t = {t[apart.argmax()]:.2f}, "
            f"by {apart.max():.0f} degrees."
            if apart.max() > 1e-6
            else f" The orientations of {first} and {name} agree at all times."
        )
    return said


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


def draw_triad(ax: Any, origin: Array, R: Array, name: str = "", at: ArrayLike = 1.4) -> None:
    """Draw the columns of R as arrows from `origin`.

    A `name` adds letters with this index, at multiples `at` of the arrows.
    """
    for axis, direction, far in zip("xyz", R.T, np.broadcast_to(at, 3), strict=True):
        draw_arrow(ax, origin, direction, COLOURS[axis])
        if name:
            letter: Any = {"color": COLOURS[axis], "ha": "center", "va": "center"}
            ax.text(*(origin + far * direction), f"${axis}_{name}$", **letter)


def draw_arrow(ax: Any, start: Array, along: Array, color: str) -> None:
    """Draw an arrow from a point, shape (3,), with a cone as its head."""
    tip, length = start + along, float(np.linalg.norm(along))
    size, across = 0.14 * min(1.0, length), np.linalg.svd(along[None])[2][1:]
    foot, turn = tip - size / length * along, np.linspace(0, 2 * np.pi, 32)
    rim = foot + size / 3 * np.stack([np.cos(turn), np.sin(turn)], axis=-1) @ across
    cone = np.stack([np.broadcast_to(tip, rim[1:].shape), rim[:-1], rim[1:]], axis=1)
    ax.plot(*np.transpose([start, foot]), color=color, lw=2.5)
    ax.plot(*cone.reshape(-1, 3).T, color=color, lw=1)


def _box_faces(pose: Array, edges: float | Array) -> Array:
    """Return the corners of the six faces and of a rectangle on the +z face, shape (7, 4, 3)."""
    around = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    faces = np.empty((7, 4, 3))
    for k in range(6):
        axis, sign = k % 3, 1 - 2 * (k // 3)
        faces[k, :, axis] = sign
        faces[k][:, [(axis + 1) % 3, (axis + 2) % 3]] = around
    faces[6] = faces[2] * [0.5, 0.5, 1.02]
    placed: Array = pose[:3, 3] + edges / 2 * faces @ pose[:3, :3].T
    return placed
