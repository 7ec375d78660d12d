"""Lesson 8: spins of a book, its angular momentum, and velocities that a turning body carries."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import ArrayLike

from rbclassroom.figures import columns, vectors
from rbcourse import Array, pose_from_components
from rbcourse.draw.bodies import draw_box, move_box
from rbcourse.draw.save import COLOURS, PALE, Table
from rbcourse.draw.spheres import AZIMUTH, ELEVATION, draw_sphere


def spin_table(t: Array, spins: Mapping[str, Array]) -> Table:
    """Return a table of angular velocities over time, shape (times, 3), in the body frame."""
    return {"t [1]": t} | columns("{} w{} [rad]", spins, "123")


def draw_spins(axes: Sequence[Axes], t: Array, spins: Mapping[str, Array]) -> None:
    """Draw the components of angular velocities over time, each motion on its own axes."""
    for ax, (name, w) in zip(axes, spins.items(), strict=True):
        for axis, k, part, dash in zip("xyz", "123", w.T, ("-", "--", "-."), strict=True):
            ax.plot(t, part, color=COLOURS[axis], ls=dash, label=f"w{k}")
            i = (np.abs(part) > 0.97 * np.abs(part).max()).argmax()
            if abs(part[i]) > 1:  # the small components have the same colours on the other axes
                look: Any = {"color": COLOURS[axis], "textcoords": "offset points", "va": "center"}
                side, look["ha"] = (15, "left") if part[i] > 0 else (-15, "right")
                ax.annotate(rf"$\omega_{k}$", (t[i], part[i]), (side, -0.8 * side), **look)
        times = np.linspace(t[0], t[-1], 5)[1:-1]
        ax.set(title=name, xlabel="time $t$", xlim=(t[0], t[-1]), xticks=times, yticks=[-4, 0, 4])
    axes[0].set_ylabel("rad per unit time")


def describe_spins(spins: Mapping[str, Array]) -> str:
    """Return a description of the picture of `draw_spins`."""
    said = []
    for name, w in spins.items():
        main = w[:, np.abs(w[0]).argmax()]
        flips = np.count_nonzero(np.diff(main > 0))
        fate = f"changes its sign {flips} times" if flips else "keeps its sign"
        said.append(f"{name}: it {fate}")
    return (
        "Angular velocity ω(t), in body axes, of a free body that first spins nearly about "
        f"{', '.join(spins)}. The largest component of each: {'; '.join(said)}."
    )


def momentum_directions(moments: ArrayLike, w: Array) -> Array:
    """Return the directions of the angular momentum in the body frame, shape (paths, times, 3).

    `moments` are the principal moments of inertia, and w the angular velocities in the body frame,
    shape (times, paths, 3).
    """
    momentum = np.swapaxes(w * np.asarray(moments), 0, 1)
    return momentum / np.linalg.norm(momentum, axis=-1, keepdims=True)


def momentum_table(directions: Array) -> Table:
    """Return `momentum_directions` as a table, with the number of each path."""
    numbers = np.broadcast_to(np.arange(len(directions))[:, None], directions.shape[:2])
    columns = {f"{axis} [1]": directions[..., i] for i, axis in enumerate("xyz")}
    return {"path [1]": numbers, **columns}


def draw_momenta(ax: Any, directions: Array) -> None:
    """Draw the closed paths of the angular momentum in the body frame, on the unit sphere.

    A path has the colour of the axis that it goes round; paths that pass close to the middle axis
    are black.
    """
    draw_sphere(ax)
    for path in directions:
        axis, near_axis_2 = _course(path)
        look = "optimum" if near_axis_2 else "xyz"[axis]
        ax.plot(*path.T, color=COLOURS[look], lw=2)
    looks = zip("123", np.diag([1.25, 1.04, 1.16]), ("x", "optimum", "z"), strict=True)
    for name, end, look in looks:
        for place in (end, -end):
            ax.text(*place, name, color=COLOURS[look], size=18, ha="center", va="center")


def describe_momenta(directions: Array) -> str:
    """Return a description of the picture of `draw_momenta`."""
    rounds, near = zip(*map(_course, directions), strict=True)
    return (
        "Paths of the angular momentum of a free body, on a sphere that is fixed in the body, with "
        f"the numbers of the axes. Of {len(rounds)} paths {rounds.count(0)} go round axis 1, "
        f"{rounds.count(2)} round axis 3, {rounds.count(1) or 'none'} round axis 2. "
        f"Black: the {sum(near)} that pass close to axis 2."
    )


def _course(path: Array) -> tuple[int, bool]:
    """Return the axis that a path goes round, and whether the path comes close to the middle axis.

    A path goes round an axis if its component along this axis keeps its sign. If there are several
    such axes, the axis whose component remains farthest from 0 is returned.
    """
    keeps_sign = path.min(axis=0) * path.max(axis=0) > 0
    nearest, farthest = np.abs(path).min(axis=0), np.abs(path).max(axis=0)
    return int(np.where(keeps_sign, nearest, 0).argmax()), bool(farthest[1] > 0.99)


def moving_book(ax: Any, t: Array, R: Array, edges: ArrayLike) -> Callable[[int], list[Any]]:
    """Draw a book with a pin along its middle axis, and return the function that turns the book.

    R contains the orientations of the book at the times t, in a frame whose vertical axis is the
    direction of the angular momentum. A line through the centre of the book shows this direction.
    `edges` are the lengths of the book along its axes, in m; the pin is along the second axis.
    ``update(i)`` turns the book to orientation i and returns the artists that move.
    """
    poses, edges = pose_from_components(R, np.zeros(3)), np.asarray(edges)
    reach = 0.5 * float(np.linalg.norm(edges))
    ax.plot([0, 0], [0, 0], [-1.2 * reach, 1.2 * reach], color=PALE, lw=1.5)
    label = {"color": "0.45", "fontsize": 12, "transform": ax.transAxes}
    ax.text2D(0.66, 0.02, "angular\nmomentum", **label)
    clock = ax.text2D(0.02, 0.02, "", transform=ax.transAxes)
    book = draw_box(ax, poses[0], edges)
    pin = ax.plot([], [], [], "o-", color=COLOURS["optimum"], markevery=[1], ms=9, lw=3)[0]
    ax.fit(np.full(3, -reach), np.full(3, reach), zoom=1.5)
    ax.view_init(np.degrees(ELEVATION), np.degrees(AZIMUTH))

    def update(i: int) -> list[Any]:
        move_box(book, poses[i], edges)
        ends = np.outer([0.5 * edges[1], 0.5 * edges[1] + 0.5 * reach], R[i, :, 1])
        pin.set_data_3d(*ends.T)
        clock.set_text(f"$t = {t[i]:.1f}$")
        return [book, pin, clock]

    return update


def describe_book(t: Array, R: Array) -> str:
    """Return a description of the picture of `moving_book`."""
    height = R[:, 2, 1]
    start = "up" if height[0] > 0 else "down"
    over = ", ".join(f"{x:.1f}" for x in t[1:][np.diff(height > 0)])
    fate = f"turns over at t = {over}" if over else "stays there"
    return (
        "A book that spins freely, with a pin in its middle axis and a line along its angular "
        f"momentum. It starts {start}, and {fate}."
    )


CARRIED = {
    "constant in the room": ("reference", 0.0),
    "parallel": ("path", 0.5),
    "constant in the body": ("z", 1.0),
}
"""The colours of three velocities, and the turns of their axes as fractions of the body's turn."""
_NAMED = (0.75, 0.72), (-1.0, 0.95), (-0.7, -1.08)
"""Places of the names of these velocities, after half a turn."""


def carried_table(turned: Array) -> dict[str, Array]:
    """Return the axes of the velocities of `CARRIED` after the body has turned by these angles."""
    angles = {name: np.pi / 6 + share * turned for name, (_, share) in CARRIED.items()}
    ends = {name: np.stack([np.cos(a), np.sin(a)], axis=-1) for name, a in angles.items()}
    return {"turn [rad]": turned} | columns("{} {} [1]", ends)


def draw_carried(axes: Sequence[Axes], turned: Array) -> None:
    """Draw a body that turns in the plane, and the axes of three velocities (`CARRIED`, BK (9)).

    The axis of an angular velocity is drawn as an arrow with two heads.
    """
    ends = vectors("{} {} [1]", carried_table(turned), "xy")
    for k, (ax, angle) in enumerate(zip(axes, turned, strict=True)):
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        corners = turn @ np.array([[-0.7, 0.7, 0.7, -0.7], [-0.4, -0.4, 0.4, 0.4]])
        ax.fill(*corners, facecolor="0.93", edgecolor="0.5")
        ax.plot(*turn @ [[0.55], [0.25]], "o", color="0.5")  # a mark on the body
        for name, (colour, _) in CARRIED.items():
            x, y = ends[name][k]
            ax.plot([0, x], [0, y], lw=2.5, color=COLOURS[colour], label=name)
            along = np.array([[x, y], [-y, x]])
            head = np.array([[0, 0], [-1, 0.4], [-1, -0.4]]) @ along
            for share in (0.82, 1):
                ax.plot(share * x, share * y, marker=head.tolist(), ms=17, color=COLOURS[colour])
        ax.set(xlim=(-1.15, 1.15), ylim=(-1.15, 1.35), aspect="equal")
        ax.set_title(f"turned by {np.degrees(angle):.0f}°")
        ax.set_axis_off()
    for (name, (colour, _)), place in zip(CARRIED.items(), _NAMED, strict=True):
        text = name.replace(" in", "\nin")
        axes[-1].text(*place, text, color=COLOURS[colour], ha="center", linespacing=1)


def describe_carried(turned: Array) -> str:
    """Return a description of the picture of `draw_carried`."""
    angles = ", ".join(f"{np.degrees(angle):.0f}" for angle in turned)
    return (
        "The axis of a second angular velocity, which a body carries in three ways while it turns "
        f"in the plane. After {angles} degrees the velocity that is constant in the room has not "
        "turned, the one that is constant in the body has turned with it, and the parallel one has "
        "turned by half as much."
    )
