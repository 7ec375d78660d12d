"""Drawings of a moving arm, as artists on the caller's axes.

Paths are arrays of joint angles in rad, shape (states, n); `lengths` are the lengths of the links
in m.
"""

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Arc, Circle
from numpy.typing import ArrayLike

from rbcourse import Array
from rbcourse.arm import LINKS, arm_forward_kinematics, arm_tip_jacobian
from rbcourse.draw.save import COLOURS, PALE, Table, in_words

_LOOKS = [(COLOURS["path"], "-"), (COLOURS["y"], "--"), (COLOURS["projection"], "-.")]
_MOTORS = [COLOURS["optimum"], COLOURS["projection"], COLOURS["screw"]]


def path_table(path: ArrayLike, lengths: ArrayLike = LINKS) -> Table:
    """Return a path as a table of joint angles and ends of links; the last end is the tip."""
    path = np.asarray(path)
    table = {f"theta{i} [rad]": angle for i, angle in enumerate(path.T)}
    for i, end in enumerate(np.moveaxis(_joints(path, lengths)[:, 1:], 1, 0), start=1):
        table |= {f"x{i} [m]": end[:, 0], f"y{i} [m]": end[:, 1]}
    return table


def draw_posture(ax: Axes, q: Array, lengths: ArrayLike = LINKS) -> list[Any]:
    """Draw an arm at joint angles q, shape (n,), and the frames at the centres of its links.

    Return the artists of the links, then the two axes of each frame (RR 4).
    """
    joints, headings = _joints(q, lengths), np.append(0, np.cumsum(q))
    artists: list[Any] = ax.plot(*joints.T, "o-", color=COLOURS["z"], lw=5, ms=11, alpha=0.75)
    for i, (joint, before, after) in enumerate(
        zip(joints[:-1], headings[:-1], headings[1:], strict=True)
    ):
        ax.annotate(f"$J_{i}$", joint, (4, -24), textcoords="offset points")
        ax.plot(*np.transpose([joint, joint + 0.9 * _towards(before)]), color=PALE, lw=1, ls="--")
        low, high = sorted(np.degrees([before, after]))
        ax.add_patch(Arc(joint, 1.2, 1.2, theta1=low, theta2=high, lw=1.5, color="0.3"))
        x, y = joint + 0.8 * _towards((before + after) / 2)
        ax.text(x, y, rf"$\theta_{i}$", ha="center", va="center")
        artists += _draw_frame(ax, joints[i : i + 2].mean(axis=0), after)
    ax.annotate("tip", joints[-1], (8, 8), textcoords="offset points")
    _show_all(ax)
    return artists


def draw_tip_velocities(ax: Axes, q: Array, lengths: ArrayLike = LINKS) -> list[Any]:
    """Draw an arm, and named arrows at its tip that show the columns of the Jacobian.

    Return the artists of the links, then an arrow for each joint. An arrow is half as long as the
    distance that the tip moves per radian of the joint (RR 4).
    """
    joints = _joints(q, lengths)
    artists: list[Any] = ax.plot(*joints.T, "o-", color=COLOURS["z"], lw=4, ms=8, alpha=0.75)
    for i, (x, y) in enumerate(arm_tip_jacobian(q, lengths).T / 2):
        colour, end = _MOTORS[i % len(_MOTORS)], joints[-1] + [x, y]
        artists.append(_draw_arrow(ax, joints[-1], np.array([x, y]), colour))
        aside = (-1) ** i * np.array([34 * y, -14 * x]) / max(np.hypot(x, y), 1e-9)
        _write(ax, f"motor {i}", end, aside, colour)
        ax.update_datalim([end])
    _show_all(ax)
    return artists


def moving_arm(
    ax: Axes, path: Array, shown: Iterable[int], lengths: ArrayLike = LINKS
) -> Callable[[int], list[Any]]:
    """Draw some states of an arm in a pale colour; return a function that moves the arm.

    The axes show all points that the arm can reach. ``update(i)`` moves the arm to state i, draws
    the path of the tip up to this state, and returns the moving artists (RR 4.3, RR Fig. 8, RR Fig.
    9).
    """
    joints = _joints(path, lengths)
    show_reach(ax, lengths)
    ax.locator_params(nbins=5)
    for i in shown:
        ax.plot(*joints[i].T, "o-", color=PALE, lw=2, ms=5, zorder=1.5)
    (links,) = ax.plot([], [], "o-", color=COLOURS["z"], lw=4, ms=8, zorder=3)
    (way,) = ax.plot([], [], color=COLOURS["path"], lw=2.5, zorder=4)

    def update(i: int) -> list[Any]:
        links.set_data(*joints[i].T)
        way.set_data(*joints[: i + 1, -1].T)
        return [links, way]

    return update


def draw_arm_ways(ax: Axes, paths: Mapping[str, Array], lengths: ArrayLike = LINKS) -> list[Any]:
    """Draw up to three paths of an arm's tip, and the arm at states of the last path.

    Return the lines of the paths (RR 4.3).
    """
    *_, last = paths.values()
    show_reach(ax, lengths)
    joints = _joints(last, lengths)
    for i in (0, len(joints) // 2, -1):
        ax.plot(*joints[i].T, "o-", color=PALE, lw=3, ms=6, zorder=1.5)
    for i, word in ((0, "start"), (-1, "goal")):
        _write(ax, word, joints[i, -1], (-28 if joints[i, -1, 0] > 0 else 28, -14), "black")
    return [
        ax.plot(*_joints(path, lengths)[:, -1].T, color=colour, ls=ls, label=name, zorder=3)[0]
        for (name, path), (colour, ls) in zip(paths.items(), _LOOKS[: len(paths)], strict=True)
    ]


def draw_joint_ways(ax: Axes, paths: Mapping[str, Array]) -> list[Any]:
    """Draw up to three paths of a two-link arm, with names, in the plane of its angles (RR 4.1)."""
    lines = []
    for (name, path), (colour, ls) in zip(paths.items(), _LOOKS[: len(paths)], strict=True):
        lines += ax.plot(*np.degrees(path).T, color=colour, ls=ls, label=name)
        _write(ax, name, np.degrees(path[len(path) // 2]), (0, 12), colour)
    for i, word in ((0, "start"), (-1, "goal")):
        _write(ax, word, np.degrees(path[i]), (0, -14), "black")
    ax.set(xlabel=r"$\theta_0$ (degrees)", ylabel=r"$\theta_1$ (degrees)")
    ax.margins(0.1, 0.2)
    ax.locator_params(nbins=4)
    return lines


def show_reach(ax: Axes, lengths: ArrayLike = LINKS) -> None:
    """Make axes show all points that an arm can reach; dotted circles bound these points."""
    total, longest = np.sum(lengths), np.max(lengths)
    for radius in (total, max(0.0, 2 * longest - total)):
        ax.add_patch(Circle((0, 0), radius, fill=False, ls=":", color="0.5", lw=1.5))
    edge = 1.08 * total
    ax.set(xlim=(-edge, edge), ylim=(-edge, edge), xlabel="$x$ (m)", ylabel="$y$ (m)")
    ax.set_aspect("equal")


def describe_posture(q: Array, lengths: ArrayLike = LINKS) -> str:
    """Return a description of the picture of `draw_posture`."""
    places = ", ".join(_said(place, np.sum(lengths)) for place in _joints(q, lengths))
    return (
        "Joint angles of an arm and the frames of its links. Each frame, with its axes x and y, is "
        f"at the centre of its link. The joint angles are {_degrees(q)} degrees, each measured "
        f"from the link before. The joints, and then the tip, are at {places} m."
    )


def describe_ways(paths: Mapping[str, Array], lengths: ArrayLike = LINKS) -> str:
    """Return a description of the pictures of `draw_arm_ways` and `draw_joint_ways`."""
    said = [
        f"{name}: {_length(_joints(path, lengths)[:, -1]):.1f} m and "
        f"{np.degrees(_length(path)):.0f} degrees"
        for name, path in paths.items()
    ]
    start, goal = map(_degrees, next(iter(paths.values()))[[0, -1]])
    return (
        f"Motions of an arm: paths of its tip (left) and of its joint angles (right), "
        f"{', '.join(paths)}. The angles go from {start} to {goal} degrees. "
        f"Lengths of the paths: {'; '.join(said)}."
    )


def describe_arm(path: Array, lengths: ArrayLike = LINKS) -> str:
    """Return a description of the motion of an arm."""
    tip, reach = _joints(path, lengths)[:, -1], np.sum(lengths)
    turned = np.abs(np.diff(path, axis=0)).sum(axis=0)
    start, end = (_said(place, reach) for place in tip[[0, -1]])
    return (
        f"Motion of an arm from joint angles of {_degrees(path[0])} degrees to "
        f"{_degrees(path[-1])} degrees; the path of its tip is red. The links are "
        f"{_listed(in_words(x, x) for x in np.asarray(lengths))} m long. The joints turn by "
        f"{_degrees(turned)} degrees in all. From state to state the tip covers "
        f"{in_words(_length(tip), reach)} m, from {start} to {end} m."
    )


def describe_tip_velocities(postures: Mapping[str, Array], lengths: ArrayLike = LINKS) -> str:
    """Return a description of pictures of `draw_tip_velocities` on several axes."""
    said = []
    for name, q in postures.items():
        x, y = arm_tip_jacobian(q, lengths)
        said.append(f"{name}, to {_degrees(np.arctan2(y, x))} degrees")
    return (
        f"Velocity of the tip of an arm when one motor runs alone: {', '.join(postures)}. There "
        "is an arrow for each joint, half as long as the tip goes for each radian. Directions of "
        f"the arrows: {'; '.join(said)}."
    )


def _joints(q: ArrayLike, lengths: ArrayLike) -> Array:
    """Return the positions of the joints and the tip, shape (..., n + 1, 2)."""
    return arm_forward_kinematics(q, lengths).joints


def _show_all(ax: Axes) -> None:
    ax.margins(0.15)
    ax.locator_params(nbins=5)
    ax.set(xlabel="$x$ (m)", ylabel="$y$ (m)", aspect="equal")


def _write(ax: Axes, word: str, place: Any, aside: Any, colour: str) -> None:
    centred: Any = {"textcoords": "offset points", "ha": "center", "va": "center"}
    ax.annotate(word, place, aside, color=colour, **centred)


def _draw_frame(ax: Axes, origin: Array, heading: float) -> list[Any]:
    along, left = 0.45 * _towards(heading), 0.45 * _towards(heading + np.pi / 2)
    for axis, (x, y) in {"x": origin + along - 0.3 * left, "y": origin + 1.3 * left}.items():
        ax.text(x, y, f"${axis}$", color=COLOURS[axis], ha="center", va="center")
    return [
        _draw_arrow(ax, origin, arrow, COLOURS[axis]) for axis, arrow in (("x", along), ("y", left))
    ]


def _draw_arrow(ax: Axes, start: Array, along: Array, colour: str) -> Any:
    style: Any = {"angles": "xy", "scale_units": "xy", "scale": 1, "zorder": 4, "width": 0.012}
    return ax.quiver(*start, *along, color=colour, **style)


def _towards(heading: float) -> Array:
    return np.array([np.cos(heading), np.sin(heading)])


def _length(places: Array) -> float:
    return float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())


def _listed(said: Iterable[str]) -> str:
    *others, last = said
    return f"{', '.join(others)} and {last}" if others else last


def _degrees(angles: Array) -> str:
    return _listed(f"{angle:.0f}" for angle in np.degrees(angles).round() + 0.0)


def _said(place: Array, scale: float) -> str:
    x, y = (in_words(value, scale) for value in place)
    return f"({x}, {y})"
