"""Drawings of a rectangle that moves in the plane, as artists on the caller's axes.

Paths are arrays of poses (x, y, theta) in m, m and rad, shape (states, 3).
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import ArrayLike

from rbcourse import Array
from rbcourse.draw.save import COLOURS, PALE, Table, in_words
from rbcourse.planar import compose_planar

_OUTLINE = np.array([[-2, -1, 0], [2, -1, 0], [2, 1, 0], [-2, 1, 0]]) / 4
_NOSE = np.array([[0.8, -1, 0], [2, 0, 0], [0.8, 1, 0]]) / 4
"""The outline of a rectangle of length 1 and width 1/2, and the mark on its front, at +x."""
_FILL = "#D6E6F2"


def path_table(path: Array) -> Table:
    """Return a path as a table with one row for each pose."""
    return dict(zip(["x [m]", "y [m]", "theta [rad]"], path.T, strict=True))


def draw_route(ax: Axes, path: Array, length: float, shown: Iterable[int]) -> list[Any]:
    """Draw the path of a rectangle's centre, and the rectangle at some of its poses.

    The rectangle has a `length` in m, is half as wide, and has a mark on its front. The axes fit
    the path and have equal units. Return the line of the path, then the outline and the mark of
    each rectangle (RR 3.3).
    """
    artists: list[Any] = ax.plot(*path[:, :2].T, color=COLOURS["path"], zorder=2)
    for i in shown:
        artists += draw_body(ax, path[i], length, COLOURS["z"])
    for word, (x, y, _) in {"start": path[0], "goal": path[-1]}.items():
        ax.annotate(word, (x, y + 0.56 * length), (0, 2), textcoords="offset points", ha="center")
    show_plane(ax, [path], length)
    return artists


def draw_compared(
    ax: Axes,
    paths: Mapping[str, Array],
    length: float,
    shown: Iterable[int],
    points: Sequence[ArrayLike] = ((0, 0), (0, 0)),
) -> list[Any]:
    """Draw two rectangles at the same states of their paths; the second one is dashed.

    For each body, the path of one point is drawn: `points` gives this point in the frame of the
    body; the default is the centre. For each body, return the line of the path (with dots at the
    states), and then the outline and the mark at each state (RR 3.3).
    """
    artists: list[Any] = []
    looks = (COLOURS["z"], _FILL, "-"), (COLOURS["x"], "none", "--")
    states = list(shown)
    for (name, path), point, look in zip(paths.items(), points, looks, strict=True):
        colour, fill, ls = look
        way = compose_planar(path, np.append(point, 0))[:, :2]
        artists += ax.plot(*way.T, "o", ls=ls, color=colour, label=name, markevery=states)
        for i in states:
            artists += draw_body(ax, path[i], length, colour, fill=fill, ls=ls)
    show_plane(ax, paths.values(), length)
    return artists


def moving_route(
    ax: Axes, path: Array, length: float, shown: Iterable[int]
) -> Callable[[int], list[Any]]:
    """Draw some poses of a rectangle in a pale colour; return a function that moves the rectangle.

    ``update(i)`` moves the rectangle to state i, draws the path of its centre up to this state, and
    returns the moving artists (RR 3.3, RR Fig. 6, RR Fig. 7).
    """
    for i in shown:
        draw_body(ax, path[i], length, PALE, fill="none")
    (way,) = ax.plot([], [], color=COLOURS["path"], zorder=4)
    body = draw_body(ax, path[0], length, COLOURS["z"])
    for artist in body:
        artist.set_zorder(3)
    show_plane(ax, [path], length)

    def update(i: int) -> list[Any]:
        way.set_data(*path[: i + 1, :2].T)
        move_body(body, path[i], length)
        return [*body, way]  # the path is drawn over the body

    return update


def draw_body(
    ax: Axes, pose: Array, length: float, colour: str, *, fill: str = _FILL, ls: str = "-"
) -> list[Any]:
    """Draw a rectangle at a pose, with a mark on its front; `move_body` moves it."""
    corners, nose = _placed(pose, length)
    outline = ax.fill(*corners.T, facecolor=fill, edgecolor=colour, lw=1.5, ls=ls, zorder=1.5)
    return [*outline, *ax.plot(*nose.T, color=colour, lw=1.5, ls=ls, zorder=1.6)]


def move_body(body: Sequence[Any], pose: Array, length: float) -> None:
    """Move a rectangle that `draw_body` has drawn."""
    corners, nose = _placed(pose, length)
    body[0].set_xy(corners)
    body[1].set_data(*nose.T)


def show_plane(ax: Axes, paths: Iterable[Array], length: float) -> None:
    """Make axes show all positions of a rectangle, with equal units on both axes."""
    places = np.concatenate([path[:, :2] for path in paths])
    margin = 0.75 * length
    (left, low), (right, high) = places.min(axis=0) - margin, places.max(axis=0) + margin
    ax.set(xlim=(left, right), ylim=(low, high), xlabel="$x$ (m)", ylabel="$y$ (m)")
    ax.set_aspect("equal")


def extent_of(path: Array) -> float:
    """Return the larger extent of a path, in x or y, or 0 if this extent is due to rounding.

    An extent below 1e-12 of the largest coordinate, or below 1e-12 m, counts as rounding: the body
    stays on the spot or returns to it.
    """
    places = path[:, :2]
    extent = float(np.ptp(places, axis=0).max())
    return extent if extent > 1e-12 * max(1.0, np.abs(places).max()) else 0.0


def describe_route(path: Array, what: str = "a rectangle") -> str:
    """Return a description of the motion of a rectangle."""
    steps = np.diff(path, axis=0)
    turns = np.degrees(steps[:, 2])
    sides = {"left": turns[turns > 0].sum(), "right": -turns[turns < 0].sum()}
    said = [f"{angle:.0f} degrees to the {side}" for side, angle in sides.items() if angle > 0.5]
    extent = extent_of(path)
    way = np.hypot(steps[:, 0], steps[:, 1]).sum() if extent else 0.0
    start, end = (_said(pose, extent or 1.0) for pose in path[[0, -1]])
    return (
        f"Path of the centre of {what}, and some of its poses. The rectangle goes from "
        f"{start}, to {end}. From state to state its centre covers {in_words(way, way)} m, and it "
        f"turns by {' and '.join(said) or 'less than a degree'}."
    )


def describe_compared(panels: Mapping[str, Mapping[str, Array]]) -> str:
    """Return a description of `draw_compared` on several axes, with two paths on each."""
    said = []
    for title, paths in panels.items():
        one, other = (path[:, :2] for path in paths.values())
        apart = in_words(np.linalg.norm(one - other, axis=1).max(), extent_of(one))
        said.append(f"{title}: {' and '.join(paths)}, the centres apart by {apart} m at most")
    return (
        f"Paths of a rectangle in pairs, the second path dashed: {', '.join(panels)}. "
        f"The paths of each pair: {'; '.join(said)}."
    )


def describe_routes(paths: Mapping[str, Array]) -> str:
    """Return a description of several motions of a rectangle, with the names of their paths."""
    said = " ".join(f"{name}: {describe_route(path)}" for name, path in paths.items())
    return f"Paths of a rectangle from start to goal: {', '.join(paths)}. In turn, {said}"


def _placed(pose: Array, length: float) -> tuple[Array, Array]:
    corners, nose = (compose_planar(pose, length * part)[:, :2] for part in (_OUTLINE, _NOSE))
    return corners, nose


def _said(pose: Array, scale: float) -> str:
    x, y = (in_words(value, scale) for value in pose[:2])
    return f"({x}, {y}) m, heading {np.degrees(pose[2]).round() + 0.0:.0f} degrees"
