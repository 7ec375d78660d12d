"""A rectangle on its way through the plane: artists on axes that the caller owns."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import ArrayLike

from rbcourse._numerics import Array
from rbcourse.draw.save import COLOURS, Table, in_words
from rbcourse.planar import as_states, compose_planar

_OUTLINE = np.array([[-2, -1, 0], [2, -1, 0], [2, 1, 0], [-2, 1, 0]]) / 4
_NOSE = np.array([[0.8, -1, 0], [2, 0, 0], [0.8, 1, 0]]) / 4
"""A body of length 1, half as wide, and the mark on its front; it heads along its x axis."""
_FILL = "#D6E6F2"
STATES = {"planar": ["x [m]", "y [m]", "theta [rad]"]}


def route_table(path: ArrayLike) -> dict[str, Array]:
    """Return a path of planar poses as a table: one row for each.

    Parameters
    ----------
    path : array_like, shape (states, 3)
        Poses (x, y, theta): m, m, rad.

    Returns
    -------
    dict of str to ndarray
    """
    return dict(zip(STATES["planar"], as_states(path).T, strict=True))


def draw_route(ax: Axes, data: Table, length: float, shown: Iterable[int]) -> list[Any]:
    """Draw the way of a rectangle's centre, and the rectangle at some of its poses.

    Parameters
    ----------
    ax : Axes
        Where to draw; it is made to show all of it, lengths equal on both axes.
    data : mapping of str to array_like, shape (states,)
        A `route_table`.
    length : float
        How long the rectangle is, in m. It is half as wide, and a mark shows its front.
    shown : iterable of int
        At which states it is drawn.

    Returns
    -------
    list of artists
        The way; then outline and mark for each.

    References
    ----------
    RR 3.3.
    """
    path = _path(data)
    artists: list[Any] = ax.plot(*path[:, :2].T, color=COLOURS["path"], zorder=2)
    for i in shown:
        artists += draw_body(ax, path[i], length, COLOURS["z"])
    for word, (x, y, _) in {"start": path[0], "goal": path[-1]}.items():
        ax.annotate(word, (x, y), (0, 3), textcoords="offset points", ha="center")
    show_plane(ax, [data], length)
    return artists


def draw_compared(
    ax: Axes,
    routes: Mapping[str, Table],
    length: float,
    shown: Iterable[int],
    points: Sequence[ArrayLike] = ((0, 0), (0, 0)),
) -> list[Any]:
    """Draw two rectangles on their ways, the second dashed, at the same states.

    Parameters
    ----------
    ax : Axes
        Where to draw; it is made to show both, lengths equal on both axes.
    routes : mapping of str to mapping of str to array_like
        Two names, and a `route_table` for each.
    length : float
        How long the rectangles are, in m.
    shown : iterable of int
        At which states they are drawn.
    points : two array_like, shape (2,), optional
        Of each the point, in the frame of the body, whose way is drawn; by default the centre.

    Returns
    -------
    list of artists
        For each: the way of its point, with dots at the states; then outline and mark at each.

    References
    ----------
    RR 3.3.
    """
    artists: list[Any] = []
    looks = (COLOURS["z"], _FILL, "-"), (COLOURS["x"], "none", "--")
    states = list(shown)
    for (name, data), point, look in zip(routes.items(), points, looks, strict=True):
        path, (colour, fill, ls) = _path(data), look
        way = compose_planar(path, np.append(point, 0))[:, :2]
        artists += ax.plot(*way.T, "o", ls=ls, color=colour, label=name, markevery=states)
        for i in states:
            artists += draw_body(ax, path[i], length, colour, fill=fill, ls=ls)
    show_plane(ax, routes.values(), length)
    return artists


def moving_route(
    ax: Axes, data: Table, length: float, shown: Iterable[int]
) -> Callable[[int], list[Any]]:
    """Draw a rectangle, pale, at some of its poses; return what moves it along its way.

    Parameters
    ----------
    ax, data, length, shown
        As for `draw_route`.

    Returns
    -------
    callable
        ``update(i)`` moves the rectangle to state i, draws the way of its centre up to there, and
        returns the artists that move.

    References
    ----------
    RR 3.3, RR Fig. 6, RR Fig. 7.
    """
    path = _path(data)
    for i in shown:
        draw_body(ax, path[i], length, "0.75", fill="none")
    (way,) = ax.plot([], [], color=COLOURS["path"], zorder=2)
    body = draw_body(ax, path[0], length, COLOURS["z"])
    for artist in body:
        artist.set_zorder(3)
    show_plane(ax, [data], length)

    def update(i: int) -> list[Any]:
        way.set_data(*path[: i + 1, :2].T)
        move_body(body, path[i], length)
        return [way, *body]

    return update


def draw_body(
    ax: Axes, pose: Array, length: float, colour: str, *, fill: str = _FILL, ls: str = "-"
) -> list[Any]:
    """Draw a rectangle with a mark on its front at a pose; `move_body` moves it."""
    corners, nose = _placed(pose, length)
    outline = ax.fill(*corners.T, facecolor=fill, edgecolor=colour, lw=1.5, ls=ls, zorder=1.5)
    return [*outline, *ax.plot(*nose.T, color=colour, lw=1.5, ls=ls, zorder=1.6)]


def move_body(body: Sequence[Any], pose: Array, length: float) -> None:
    """Move a rectangle that `draw_body` has drawn."""
    corners, nose = _placed(pose, length)
    body[0].set_xy(corners)
    body[1].set_data(*nose.T)


def show_plane(ax: Axes, routes: Iterable[Table], length: float) -> None:
    """Make axes show all places that a rectangle passes, with equal lengths on both."""
    places = np.concatenate([_path(data)[:, :2] for data in routes])
    margin = 0.75 * length
    (left, low), (right, high) = places.min(axis=0) - margin, places.max(axis=0) + margin
    ax.set(xlim=(left, right), ylim=(low, high), xlabel="x (m)", ylabel="y (m)")
    ax.set_aspect("equal")


def extent_of(path: Array) -> float:
    """Return the larger extent of a path; 0 for less than 1e-12 of its distance, or of a metre.

    Less is rounding: of a body that stays on the spot, or comes back to it.
    """
    places = path[:, :2]
    extent = float(np.ptp(places, axis=0).max())
    return extent if extent > 1e-12 * max(1.0, np.abs(places).max()) else 0.0


def describe_route(data: Table) -> str:
    """Return in words how a rectangle goes.

    Parameters
    ----------
    data : mapping of str to array_like, shape (states,)
        A `route_table`.

    Returns
    -------
    str
    """
    path = _path(data)
    steps = np.diff(path, axis=0)
    turns = np.degrees(steps[:, 2])
    sides = {"left": turns[turns > 0].sum(), "right": -turns[turns < 0].sum()}
    said = [f"{angle:.0f} degrees to the {side}" for side, angle in sides.items() if angle > 0.5]
    extent = extent_of(path)
    way = np.hypot(steps[:, 0], steps[:, 1]).sum() if extent else 0.0
    start, end = (_said(pose, extent or 1.0) for pose in path[[0, -1]])
    return (
        f"A rectangle goes from {start}, to {end}. From state to state its centre covers "
        f"{in_words(way, way)} m, and it turns by {' and '.join(said) or 'less than a degree'}."
    )


def describe_compared(panels: Mapping[str, Mapping[str, Table]]) -> str:
    """Return in words what `draw_compared` shows on several axes.

    Parameters
    ----------
    panels : mapping of str to mapping of str to mapping of str to array_like
        For each of the axes its name, and its two routes.

    Returns
    -------
    str
    """
    said = []
    for title, routes in panels.items():
        one, other = (_path(data)[:, :2] for data in routes.values())
        apart = in_words(np.linalg.norm(one - other, axis=1).max(), extent_of(one))
        said.append(f"{title}: {' and '.join(routes)}, the centres apart by {apart} m at most")
    return f"Rectangles on two ways each. {'; '.join(said)}."


def describe_routes(routes: Mapping[str, Table]) -> str:
    """Return in words how rectangles go, with the names of their ways."""
    return " ".join(f"{name}: {describe_route(data)}" for name, data in routes.items())


def _path(data: Table) -> Array:
    return np.stack([np.asarray(data[key], dtype=float) for key in STATES["planar"]], axis=-1)


def _placed(pose: Array, length: float) -> tuple[Array, Array]:
    corners, nose = (compose_planar(pose, length * part)[:, :2] for part in (_OUTLINE, _NOSE))
    return corners, nose


def _said(pose: Array, scale: float) -> str:
    x, y = (in_words(value, scale) for value in pose[:2])
    return f"({x}, {y}) m, heading {np.degrees(pose[2]).round() + 0.0:.0f} degrees"
