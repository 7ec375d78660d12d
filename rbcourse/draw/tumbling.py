"""Bodies that turn freely: how their angular velocity wanders, and the flip of a book."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import ArrayLike

from rbcourse._numerics import Array
from rbcourse.draw.bodies import draw_box, move_box, poses_from_table
from rbcourse.draw.save import COLOURS, Table
from rbcourse.draw.spheres import AZIMUTH, ELEVATION, EYE, draw_sphere


def spin_table(t: ArrayLike, spins: Mapping[str, Array]) -> Table:
    """Return angular velocities over time as a table.

    Parameters
    ----------
    t : array_like, shape (times,)
        The times.
    spins : mapping of str to ndarray of shape (times, 3)
        Angular velocities in the body frame, in rad per unit time, with their names.

    Returns
    -------
    dict of str to ndarray
    """
    table = {"t [1]": np.asarray(t)}
    for name, w in spins.items():
        table |= {f"{name} w{i + 1} [rad]": w[:, i] for i in range(3)}
    return table


def draw_spins(axes: Sequence[Axes], data: Table) -> list[Any]:
    """Draw the components of angular velocities over time, each on its own axes.

    Parameters
    ----------
    axes : sequence of Axes
        Where to draw.
    data : mapping of str to array_like, shape (times,)
        A `spin_table` of as many.

    Returns
    -------
    list of Line2D
    """
    lines: list[Any] = []
    t = np.asarray(data["t [1]"])
    for ax, (name, w) in zip(axes, _spins(data).items(), strict=True):
        for i, (axis, dash) in enumerate(zip("xyz", ("-", "--", "-."), strict=True)):
            lines += ax.plot(t, w[:, i], color=COLOURS[axis], ls=dash, label=f"ω{'₁₂₃'[i]}")
        ax.set(title=name, xlabel="time t", xlim=(t[0], t[-1]))
        ax.set_xticks(np.linspace(t[0], t[-1], 5))
    axes[0].set_ylabel("rad per unit time")
    axes[-1].legend(loc="center left", bbox_to_anchor=(1, 0.5))
    return lines


def describe_spins(data: Table) -> str:
    """Return in words what `draw_spins` shows.

    Parameters
    ----------
    data : mapping of str to array_like, shape (times,)
        As for `draw_spins`.

    Returns
    -------
    str
    """
    said = []
    for name, w in _spins(data).items():
        main = w[:, np.abs(w[0]).argmax()]
        flips = np.count_nonzero(np.diff(main > 0))
        said.append(f"{name}: it changes its sign {flips} times" if flips else f"{name}: it stays")
    return (
        "The three components of the angular velocity of a free body over time, for spins that "
        f"start about one axis, nearly. What becomes of the largest component: {'; '.join(said)}."
    )


def momentum_table(moments: ArrayLike, w: Array) -> Table:
    """Return the directions of the angular momentum in the body frame as a table.

    Parameters
    ----------
    moments : array_like, shape (3,)
        Principal moments of inertia, the second one between the others.
    w : ndarray, shape (times, paths, 3)
        Angular velocities in the body frame.

    Returns
    -------
    dict of str to ndarray
        The number of the path and the direction, each of shape (paths, times).
    """
    momentum = np.swapaxes(w * np.asarray(moments), 0, 1)
    direction = momentum / np.linalg.norm(momentum, axis=-1, keepdims=True)
    numbers = np.broadcast_to(np.arange(len(direction))[:, None], direction.shape[:2])
    columns = {f"{axis} [1]": direction[..., i] for i, axis in enumerate("xyz")}
    return {"path [1]": numbers, **columns}


def draw_momenta(ax: Any, data: Table) -> list[Any]:
    """Draw how the angular momentum wanders through the body, on the unit sphere.

    Parameters
    ----------
    ax : Axes3D
        Where to draw.
    data : mapping of str to array_like, shape (paths, times)
        A `momentum_table` of closed paths. A path has the colour of the axis that it goes round;
        black is what passes close to the middle one.

    Returns
    -------
    list of Line3D
    """
    draw_sphere(ax)
    lines: list[Any] = []
    for path in _directions(data):
        axis = _goes_round(path)
        near_middle = _comes_near_axis_2(path)
        colour = COLOURS["optimum"] if near_middle else COLOURS["xyz"[axis]]
        seen = path @ EYE > 0
        front = (seen | np.roll(seen, 1))[:, None]  # each piece begins where the last one ended
        ax.plot(*np.where(front, np.nan, path).T, color=colour, lw=0.8, alpha=0.4, zorder=2)
        lines += ax.plot(*np.where(front, path, np.nan).T, color=colour, lw=2, zorder=3)
    for name, end in zip("123", np.diag(np.sign(EYE)), strict=True):
        ax.text(*end, name, ha="center", va="center", zorder=4)
        ax.text(*-end, name, ha="center", va="center", zorder=1, color="0.6")
    return lines


def describe_momenta(data: Table) -> str:
    """Return in words what `draw_momenta` shows.

    Parameters
    ----------
    data : mapping of str to array_like, shape (paths, times)
        As for `draw_momenta`.

    Returns
    -------
    str
    """
    paths = _directions(data)
    rounds = [_goes_round(path) for path in paths]
    near = sum(_comes_near_axis_2(path) for path in paths)
    return (
        f"{len(rounds)} paths of the angular momentum on a sphere that is fixed in the body: "
        f"{rounds.count(0)} go round axis 1, {rounds.count(2)} round axis 3, "
        f"{rounds.count(1) or 'none'} round axis 2. Black: the {near} that pass close to axis 2."
    )


def moving_book(ax: Any, data: Table, edges: ArrayLike) -> Callable[[int], list[Any]]:
    """Draw a book in its first orientation, with a pin in its middle axis; return what turns it.

    Parameters
    ----------
    ax : Axes3D
        Where to draw. A vertical line is called its angular momentum.
    data : mapping of str to array_like, shape (times,)
        A `bodies.motion_table`: its orientations, such that the angular momentum is vertical; where
        it is does not matter.
    edges : array_like, shape (3,)
        Its edges along its axes, in m; the pin is along the second.

    Returns
    -------
    callable
        ``update(i)`` turns the book to orientation i and returns what moves.
    """
    t, poses, edges = np.asarray(data["t [1]"]), poses_from_table(data), np.asarray(edges)
    poses[:, :3, 3] = 0
    reach = 0.5 * float(np.linalg.norm(edges))
    ax.plot([0, 0], [0, 0], [-1.2 * reach, 1.2 * reach], color="0.75", lw=1.5)
    label = {"color": "0.45", "fontsize": 12, "ha": "right", "transform": ax.transAxes}
    ax.text2D(0.98, 0.02, "angular\nmomentum", **label)
    clock = ax.text2D(0.02, 0.02, "", transform=ax.transAxes)
    book = draw_box(ax, poses[0], edges)
    pin = ax.plot([], [], [], "o-", color=COLOURS["optimum"], markevery=[1], ms=9, lw=3)[0]
    ax.set(xlim=(-reach, reach), ylim=(-reach, reach), zlim=(-reach, reach))
    ax.set_box_aspect((1, 1, 1), zoom=1.5)
    ax.set_axis_off()
    ax.set_proj_type("ortho")  # in perspective the square on the cover can sink into it
    ax.view_init(np.degrees(ELEVATION), np.degrees(AZIMUTH))

    def update(i: int) -> list[Any]:
        move_box(book, poses[i], edges)
        ends = np.outer([0.5 * edges[1], 0.5 * edges[1] + 0.5 * reach], poses[i, :3, 1])
        pin.set_data_3d(*ends.T)
        clock.set_text(f"t = {t[i]:.1f}")
        away = poses[i, :3, 1] @ EYE < 0  # the pin leaves the book on its far side
        return [clock, pin, book] if away else [clock, book, pin]

    return update


def describe_book(data: Table) -> str:
    """Return in words what `moving_book` shows.

    Parameters
    ----------
    data : mapping of str to array_like, shape (times,)
        A `bodies.motion_table` of its orientations.

    Returns
    -------
    str
    """
    t, height = np.asarray(data["t [1]"]), np.asarray(data["R32 [1]"])
    start = "up" if height[0] > 0 else "down"
    over = ", ".join(f"{x:.1f}" for x in t[1:][np.diff(height > 0)])
    fate = f"turns over at t = {over}" if over else "stays there"
    return f"A book spins freely, with a pin in its middle axis. It starts {start}, and {fate}."


def _spins(data: Table) -> dict[str, Array]:
    names = [key.removesuffix(" w1 [rad]") for key in data if key.endswith(" w1 [rad]")]
    return {
        name: np.stack([data[f"{name} w{i} [rad]"] for i in (1, 2, 3)], axis=-1) for name in names
    }


def _directions(data: Table) -> Array:
    return np.stack([data[f"{axis} [1]"] for axis in "xyz"], axis=-1)


def _comes_near_axis_2(path: Array) -> bool:
    return bool(np.abs(path[:, 1]).max() > 0.99)


def _goes_round(path: Array) -> int:
    """Return the axis along which the component of a path keeps its sign, the farthest from 0."""
    low, high = path.min(axis=0), path.max(axis=0)
    return int(np.where(low * high > 0, np.abs(path).min(axis=0), 0).argmax())
