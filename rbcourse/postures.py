"""An arm on its way: artists on axes that the caller owns."""

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Arc, Circle
from numpy.typing import ArrayLike

from rbcourse._numerics import Array
from rbcourse.arm import LINKS, arm_forward_kinematics
from rbcourse.figures import COLOURS, Table
from rbcourse.plans import as_path

_LOOKS = [(COLOURS["path"], "-"), (COLOURS["y"], "--"), (COLOURS["projection"], "-.")]


def arm_table(path: ArrayLike, lengths: ArrayLike = LINKS) -> dict[str, Array]:
    """Return a path of an arm as a table: one row for each state.

    Parameters
    ----------
    path : array_like, shape (states, n)
        Joint angles, in rad.
    lengths : array_like, shape (n,), optional
        Lengths of the links, in m.

    Returns
    -------
    dict of str to ndarray
        The joint angles; then, for each link, where it ends: the last end is the tip.
    """
    path = as_path(path)
    ends = arm_forward_kinematics(path, lengths).joints[:, 1:]
    table = {f"theta{i} [rad]": angle for i, angle in enumerate(path.T)}
    for i, end in enumerate(np.moveaxis(ends, 1, 0), start=1):
        table |= {f"x{i} [m]": end[:, 0], f"y{i} [m]": end[:, 1]}
    return table


def draw_posture(ax: Axes, data: Table) -> list[Any]:
    """Draw an arm with its joint angles and the frames at the centres of its links.

    Parameters
    ----------
    ax : Axes
        Where to draw.
    data : mapping of str to array_like, shape (1,)
        An `arm_table`.

    Returns
    -------
    list of artists
        The links; then for each link its two axes.

    References
    ----------
    RR 4.
    """
    (q,), (joints,) = _angles(data), _joints(data)
    artists: list[Any] = ax.plot(*joints.T, "o-", color=COLOURS["z"], lw=5, ms=11, alpha=0.6)
    before = 0.0
    for i, (joint, angle) in enumerate(zip(joints[:-1], q, strict=True)):
        ax.annotate(f"J{i}", joint, (-8, -22), textcoords="offset points", ha="right")
        along = np.array([np.cos(before), np.sin(before)])
        ax.plot(*np.transpose([joint, joint + 0.9 * along]), color="0.6", lw=1, ls="--")
        span = sorted(np.degrees([before, before + angle]))
        ax.add_patch(Arc(joint, 1.2, 1.2, theta1=span[0], theta2=span[1], lw=1.5, color="0.3"))
        middle = before + angle / 2
        x, y = joint + 0.8 * np.array([np.cos(middle), np.sin(middle)])
        ax.text(x, y, f"$θ_{i}$", ha="center", va="center")
        before += angle
        centre = joints[i : i + 2].mean(axis=0)
        for axis, heading in zip("xy", (before, before + np.pi / 2), strict=True):
            arrow = 0.45 * np.array([np.cos(heading), np.sin(heading)])
            style: Any = {
                "angles": "xy",
                "scale_units": "xy",
                "scale": 1,
                "zorder": 4,
                "width": 0.008,
            }
            artists.append(ax.quiver(*centre, *arrow, color=COLOURS[axis], **style))
    ax.annotate("tip", joints[-1], (8, 8), textcoords="offset points")
    ax.margins(0.15)
    ax.set(xlabel="x (m)", ylabel="y (m)")
    ax.set_aspect("equal")
    return artists


def moving_arm(ax: Axes, data: Table, shown: Iterable[int]) -> Callable[[int], list[Any]]:
    """Draw an arm, pale, in some of its states; return what moves it along its way.

    Dotted circles bound what the tip can reach.

    Parameters
    ----------
    ax : Axes
        Where to draw; it is made to show all that the arm can reach, lengths equal on both axes.
    data : mapping of str to array_like, shape (states,)
        An `arm_table`.
    shown : iterable of int
        In which states it is drawn pale.

    Returns
    -------
    callable
        ``update(i)`` moves the arm to state i, draws the way of the tip up to there, and returns
        the artists that move.

    References
    ----------
    RR 4.3, RR Fig. 8, RR Fig. 9.
    """
    joints = _joints(data)
    show_reach(ax, data)
    for i in shown:
        ax.plot(*joints[i].T, "o-", color="0.82", lw=3, ms=6, zorder=1.5)
    (links,) = ax.plot([], [], "o-", color=COLOURS["z"], lw=4, ms=8, zorder=3)
    (way,) = ax.plot([], [], color=COLOURS["path"], lw=2.5, zorder=4)

    def update(i: int) -> list[Any]:
        links.set_data(*joints[i].T)
        way.set_data(*joints[: i + 1, -1].T)
        return [links, way]

    return update


def draw_arm_ways(ax: Axes, ways: Mapping[str, Table]) -> list[Any]:
    """Draw the ways of the tip of an arm, and the arm, pale, at the ends of the first of them.

    Parameters
    ----------
    ax : Axes
        Where to draw; it is made to show all that the arm can reach.
    ways : mapping of str to mapping of str to array_like
        An `arm_table` for each name, at most three.

    Returns
    -------
    list of Line2D
        The ways.

    References
    ----------
    RR 4.3.
    """
    first = next(iter(ways.values()))
    show_reach(ax, first)
    for i in (0, -1):
        ax.plot(*_joints(first)[i].T, "o-", color="0.75", lw=4, ms=8, zorder=1.5)
    return [
        ax.plot(*_joints(data)[:, -1].T, color=colour, ls=ls, label=name, zorder=3)[0]
        for (name, data), (colour, ls) in zip(ways.items(), _LOOKS, strict=False)
    ]


def draw_joint_ways(ax: Axes, ways: Mapping[str, Table]) -> list[Any]:
    """Draw the same ways in the plane of the two joint angles.

    Parameters
    ----------
    ax : Axes
        Where to draw.
    ways : mapping of str to mapping of str to array_like
        An `arm_table` of a two-link arm for each name, at most three.

    Returns
    -------
    list of Line2D

    References
    ----------
    RR 4.1.
    """
    lines = [
        ax.plot(*np.degrees(_angles(data)).T, color=colour, ls=ls, label=name)[0]
        for (name, data), (colour, ls) in zip(ways.items(), _LOOKS, strict=False)
    ]
    ax.set(xlabel="$θ_0$ (degrees)", ylabel="$θ_1$ (degrees)")
    ax.legend()
    return lines


def show_reach(ax: Axes, data: Table) -> None:
    """Make axes show all that an arm can reach; dotted circles bound it."""
    lengths = np.linalg.norm(np.diff(_joints(data)[0], axis=0), axis=1)
    outer, inner = lengths.sum(), max(0.0, 2 * lengths.max() - lengths.sum())
    for radius in (outer, inner):
        ax.add_patch(Circle((0, 0), radius, fill=False, ls=":", color="0.5", lw=1.5))
    edge = 1.08 * outer
    ax.set(xlim=(-edge, edge), ylim=(-edge, edge), xlabel="x (m)", ylabel="y (m)")
    ax.set_aspect("equal")


def describe_posture(data: Table) -> str:
    """Return in words what `draw_posture` shows.

    Parameters
    ----------
    data : mapping of str to array_like, shape (1,)
        An `arm_table`.

    Returns
    -------
    str
    """
    (q,), (joints,) = _angles(data), _joints(data)
    places = ", ".join(map(_point, joints))
    return (
        "An arm, each link with the x and y axes of its frame at its centre. Its joint angles are "
        f"{_listed(np.degrees(q), 0)} degrees, each against the link before; its joints, and "
        f"then its tip, are at {places} m."
    )


def describe_ways(ways: Mapping[str, Table]) -> str:
    """Return in words what `draw_arm_ways` and `draw_joint_ways` show.

    Parameters
    ----------
    ways : mapping of str to mapping of str to array_like
        As for these.

    Returns
    -------
    str
    """
    said = [
        f"{name}: the tip covers {_length(_joints(data)[:, -1]):.1f} m, the joint angles "
        f"{np.degrees(_length(_angles(data))):.0f} degrees"
        for name, data in ways.items()
    ]
    return (
        "Ways of an arm between two configurations, drawn by its tip in the room, and in the "
        f"plane of its joint angles. {'; '.join(said)}."
    )


def describe_arm(data: Table) -> str:
    """Return in words how an arm goes.

    Parameters
    ----------
    data : mapping of str to array_like, shape (states,)
        An `arm_table`.

    Returns
    -------
    str
    """
    angles, joints = _angles(data), _joints(data)
    tip = joints[:, -1]
    lengths = np.linalg.norm(np.diff(joints[0], axis=0), axis=1)
    return (
        f"An arm with links of {_listed(lengths, 1)} m turns its joints from "
        f"{_listed(np.degrees(angles[0]), 0)} to {_listed(np.degrees(angles[-1]), 0)} degrees. "
        f"Its tip goes from {_point(tip[0])} m to {_point(tip[-1])} m, on a way of "
        f"{_length(tip):.1f} m that is drawn in red."
    )


def _angles(data: Table) -> Array:
    return np.stack([np.asarray(x) for key, x in data.items() if key.startswith("theta")], axis=-1)


def _joints(data: Table) -> Array:
    """Return the joints and the tip, shape (states, n + 1, 2)."""
    x, y = ([np.asarray(v) for key, v in data.items() if key[0] == letter] for letter in "xy")
    ends = np.stack([np.stack(x, axis=-1), np.stack(y, axis=-1)], axis=-1)
    return np.concatenate([np.zeros_like(ends[:, :1]), ends], axis=1)


def _length(places: Array) -> float:
    return float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())


def _listed(values: Array, digits: int) -> str:
    *others, last = (f"{value.round(digits) + 0.0:.{digits}f}" for value in values)
    return f"{', '.join(others)} and {last}" if others else last


def _point(place: Array) -> str:
    x, y = place.round(1) + 0.0
    return f"({x:.1f}, {y:.1f})"
