"""Still figures: artists on axes that the caller owns.

Each ``draw_*(ax, data)`` draws a table (see `rbcourse.figures`) and returns its artists; the
``describe_*(data)`` beside it says in words what is to be seen.
"""

from fractions import Fraction
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle
from mpl_toolkits.mplot3d.art3d import Line3DCollection

from rbcourse._numerics import Array
from rbcourse.figures import Table

COLOURS = {
    "x": "#D55E00",
    "y": "#009E73",
    "z": "#0072B2",
    "optimum": "#000000",
    "projection": "#CC79A7",
    "reference": "#808080",
}
"""The same meaning has the same colour everywhere; all can be told apart when colour-blind."""

LABELS = {
    "t": "time t",
    "angle": "angle a (rad)",
    "theta": "θ",
    "theta_dot": "dθ/dt",
    "f": "f",
    "f_dot": "df/dt",
    "s": "s",
}
"""How the columns of a table are called on an axis."""

_MOTIONS: dict[str, dict[str, Any]] = {
    "geodesic": {
        "color": COLOURS["optimum"],
        "ls": "-",
        "marker": "o",
        "markevery": 10,
        "ms": 9,
        "mfc": "white",
    },
    "projected line": {
        "color": COLOURS["projection"],
        "ls": "--",
        "marker": "o",
        "markevery": 10,
        "ms": 5,
    },
}
_DASHES: list[Any] = ["-", "--", "-.", ":", (0, (6, 1, 1, 1)), (0, (3, 1, 1, 1, 1, 1))]


def draw_family(ax: Axes, data: Table) -> list[Any]:
    """Draw six curves of a table (parameter, abscissa, value), one for each of six parameters.

    Parameters
    ----------
    ax : Axes
        Where to draw.
    data : mapping of str to array_like, shape (parameters, abscissas)
        Three columns, in that order; the parameter an angle in rad, constant along a row.

    Returns
    -------
    list of Line2D
    """
    (_, parameter), (x_name, x), (y_name, y) = _columns(data)
    rows = _shown_rows(parameter)
    colours = plt.get_cmap("viridis")(np.linspace(0.85, 0, len(rows)))
    lines = [
        ax.plot(x[row], y[row], color=colour, ls=dash, label=pi_fraction(parameter[row, 0]))[0]
        for row, colour, dash in zip(rows, colours, _DASHES, strict=True)
    ]
    ax.set(xlabel=_label(x_name), ylabel=_label(y_name), xlim=(x.min(), x.max()))
    ax.legend(title="angle a (rad)", loc="center left", bbox_to_anchor=(1, 0.5))
    return lines


def draw_surface(ax: Any, data: Table) -> list[Any]:
    """Draw a table (parameter, abscissa, value) as a surface over abscissa and parameter.

    Parameters
    ----------
    ax : Axes3D
        Where to draw.
    data : mapping of str to array_like, shape (parameters, abscissas)
        Three columns, in that order.

    Returns
    -------
    list of Poly3DCollection
    """
    (p_name, parameter), (x_name, x), (y_name, y) = _columns(data)
    surface = ax.plot_surface(
        x, parameter, y, cmap="viridis_r", rcount=24, ccount=34, lw=0.3, edgecolor="white"
    )
    ax.set(xlabel=_label(x_name), xticks=[0, 0.5, 1])
    ax.set_ylabel(_label(p_name), labelpad=8)
    ax.set_yticks([0, np.pi / 2, np.pi], ["0", "π/2", "π"])
    ax.text2D(0.06, 0.88, _label(y_name), transform=ax.transAxes)
    ax.view_init(elev=24, azim=-128)
    ax.set_box_aspect((1, 1, 0.75), zoom=0.95)
    return [surface]


def describe_family(data: Table) -> str:
    """Return in words what `draw_family` and `draw_surface` show.

    Parameters
    ----------
    data : mapping of str to array_like, shape (parameters, abscissas)
        As for `draw_family`.

    Returns
    -------
    str
    """
    (_, parameter), (_, x), (y_name, y) = _columns(data)
    at = np.linspace(0, x.shape[1] - 1, 5).round().astype(int)
    ends = [
        f"for the {which} angle, {pi_fraction(parameter[row, 0])} rad, it is "
        + ", ".join(f"{value:.3g}" for value in y[row, at])
        for which, row in (("smallest", 0), ("largest", -1))
    ]
    times = ", ".join(f"{value:g}" for value in x[0, at])
    return (
        f"{_label(y_name)} over the time t, for {len(parameter)} angles a, as a surface and as "
        f"curves. At the times {times} {'; '.join(ends)}."
    )


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
    trace = sum(np.asarray(data[f"R{i}{i} [1]"])[1] for i in (1, 2, 3))
    turn = np.degrees(np.arccos((trace - 1) / 2))
    return (
        f"The fixed frame {{{fixed}}} with its axes x, y, z, and a box that carries the moving "
        f"frame {{{moving}}}. Its origin is at ({place}) m, the tip of the vector d, and it is "
        f"turned by {turn:.0f} degrees against the fixed one."
    )


def draw_chord(ax: Axes, data: Table) -> list[Any]:
    """Draw equal steps along a chord of the unit circle, and the rays that project them.

    Parameters
    ----------
    ax : Axes
        Where to draw.
    data : mapping of str to array_like, shape (steps,)
        The times; x and y of the points of the chord; x and y of their projections.

    Returns
    -------
    list of artists
    """
    t, x, y, arc_x, arc_y = (np.asarray(column) for column in data.values())
    circle = Circle((0, 0), 1, fill=False, color=COLOURS["reference"], lw=1)
    ax.add_patch(circle)
    rays = ax.plot(
        [np.zeros_like(x), arc_x], [np.zeros_like(y), arc_y], color=COLOURS["reference"], lw=0.8
    )
    chord = ax.plot(x, y, "s-", color=COLOURS["optimum"], ms=5, label="equal steps on the chord")
    arc = ax.plot(
        arc_x,
        arc_y,
        "o",
        color=COLOURS["projection"],
        ms=8,
        label="their projections on the circle",
    )
    for k, offset in ((0, (-14, -22)), (len(x) // 2, (2, 9)), (-1, (-14, -24))):
        ax.annotate(f"t = {t[k]:g}", (x[k], y[k]), offset, textcoords="offset points")
    ax.set(aspect="equal", xlim=(-1.12, 1.12), ylim=(-0.12, 1.12))
    ax.set(xlabel="real part", ylabel="imaginary part")
    ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1))
    return [circle, *rays, *chord, *arc]


def describe_chord(data: Table) -> str:
    """Return in words what `draw_chord` shows.

    Parameters
    ----------
    data : mapping of str to array_like, shape (steps,)
        As for `draw_chord`.

    Returns
    -------
    str
    """
    _, _, _, x, y = (np.asarray(column) for column in data.values())
    steps = np.degrees(np.diff(np.unwrap(np.arctan2(y, x))))
    return (
        f"A chord of the unit circle over {steps.sum():.0f} degrees, cut into {len(steps)} equal "
        "steps, and rays from the centre through the cuts to the circle. The first step on the "
        f"circle spans {steps[0]:.0f} degrees, the widest, in the middle, {steps.max():.0f}."
    )


def draw_paths(ax: Any, data: Table) -> list[Any]:
    """Draw on the unit sphere where two motions carry one point, every tenth time marked.

    Parameters
    ----------
    ax : Axes3D
        Where to draw.
    data : mapping of str to array_like, shape (times,)
        A `motion_table` of a "geodesic" and a "projected line".

    Returns
    -------
    list of Line3D
    """
    paths = {
        name: np.array([data[f"{name} {axis} [1]"] for axis in "xyz"])
        for name in ("geodesic", "projected line")
    }
    longitude, latitude = np.mgrid[0 : 2 * np.pi : 25j, 0 : np.pi : 13j]
    across = np.sin(latitude)
    sphere = [np.cos(longitude) * across, np.sin(longitude) * across, np.cos(latitude)]
    ax.plot_wireframe(*sphere, color="0.85", lw=0.5)
    lines = [ax.plot(*path, **_MOTIONS[name])[0] for name, path in paths.items()]
    start, middle, end = paths["geodesic"][:, [0, paths["geodesic"].shape[1] // 2, -1]].T
    for when, place in (("t = 0", start), ("t = 1", end)):
        ax.text(*(0.82 * place), when, ha="center", va="center")
    x, y, z = np.cross(start, end) / np.linalg.norm(np.cross(start, end)) + middle / 2
    ax.view_init(elev=np.degrees(np.arctan2(z, np.hypot(x, y))), azim=np.degrees(np.arctan2(y, x)))
    ax.set_proj_type("ortho")
    ax.set(xlim=(-1, 1), ylim=(-1, 1), zlim=(-1, 1))
    ax.set_box_aspect((1, 1, 1), zoom=1.6)
    ax.set_axis_off()
    return lines


def draw_speeds(ax: Axes, data: Table) -> list[Any]:
    """Draw the angular speed of two motions over time, every tenth time marked.

    Parameters
    ----------
    ax : Axes
        Where to draw.
    data : mapping of str to array_like, shape (times,)
        As for `draw_paths`.

    Returns
    -------
    list of Line2D
    """
    lines = [
        ax.plot(data["t [1]"], data[f"{name} speed [rad]"], label=name, **style)[0]
        for name, style in _MOTIONS.items()
    ]
    ax.set(xlabel=LABELS["t"], ylabel="‖ω‖ (rad per unit time)", xlim=(0, 1), ylim=(0, None))
    ax.legend()
    return lines


def describe_paths(data: Table) -> str:
    """Return in words what `draw_paths` and `draw_speeds` show.

    Parameters
    ----------
    data : mapping of str to array_like, shape (times,)
        As for `draw_paths`.

    Returns
    -------
    str
    """
    geodesic, projected = (np.asarray(data[f"{name} speed [rad]"]) for name in _MOTIONS)
    return (
        "Left, a sphere: the geodesic and the projected line carry a point along one and the same "
        f"arc; the marks at {len(geodesic[::10])} equal times are evenly spaced for the geodesic, "
        "and for the projected line dense at both ends and sparse in the middle. Right, the "
        f"angular speed: constant {geodesic[0]:.2f} for the geodesic; for the projected line "
        f"{projected[0]:.2f} at the ends and {projected.max():.2f} in the middle."
    )


def _columns(data: Table) -> list[tuple[str, Array]]:
    return [(name, np.asarray(column, dtype=float)) for name, column in data.items()]


def _label(column: str) -> str:
    name = column.split(" [")[0]
    return LABELS.get(name, name)


def _shown_rows(parameter: Array) -> list[int]:
    """Return the rows of the five multiples of π/6 below π, and the last."""
    sixths = np.arange(1, 6) * np.pi / 6
    return [int(np.abs(parameter[:, 0] - angle).argmin()) for angle in sixths] + [-1]


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


def pi_fraction(angle: float) -> str:
    """Return an angle in rad as a fraction of π.

    Parameters
    ----------
    angle : float
        A multiple of π/24, to rounding.

    Returns
    -------
    str

    Examples
    --------
    >>> pi_fraction(5 * np.pi / 6), pi_fraction(np.pi)
    ('5π/6', 'π')
    """
    share = Fraction(angle / np.pi).limit_denominator(24)
    over = f"/{share.denominator}" if share.denominator > 1 else ""
    return f"{share.numerator if share.numerator > 1 else ''}π{over}"
