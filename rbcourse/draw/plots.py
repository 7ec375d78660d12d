"""Still figures of curves: artists on axes that the caller owns.

Each ``draw_*(ax, data)`` draws a table (see `rbcourse.draw.save`) and returns its artists; the
``describe_*(data)`` beside it says in words what is to be seen.
"""

from collections.abc import Mapping
from fractions import Fraction
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle
from numpy.typing import ArrayLike

from rbcourse._numerics import Array
from rbcourse.curves import Curve
from rbcourse.draw.save import COLOURS, Table

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
    """Draw up to six curves of a table (parameter, abscissa, value), each for one parameter.

    Parameters
    ----------
    ax : Axes
        Where to draw.
    data : mapping of str to array_like, shape (parameters, abscissas)
        Three columns, in that order; the parameter an angle in rad, constant along a row.

    Returns
    -------
    list of Line2D

    References
    ----------
    BK Fig. 2, BK Fig. 3.
    """
    (_, parameter), (x_name, x), (y_name, y) = _columns(data)
    rows = _shown_rows(parameter)
    colours = plt.get_cmap("viridis")(np.linspace(0.85, 0, len(rows)))
    lines = [
        ax.plot(x[row], y[row], color=colour, ls=dash, label=pi_fraction(parameter[row, 0]))[0]
        for row, colour, dash in zip(rows, colours, _DASHES, strict=False)
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

    References
    ----------
    BK Fig. 2, BK Fig. 3.
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


def motion_table(curves: Mapping[str, Curve], point: ArrayLike, t: ArrayLike) -> Table:
    """Return where rotations carry a point, and how fast they turn, as a table.

    Parameters
    ----------
    curves : mapping of str to Curve
        Rotations over time, with their names.
    point : array_like, shape (3,)
        A point of the unit sphere, body frame.
    t : array_like, shape (times,)
        Times in [0, 1].

    Returns
    -------
    dict of str to ndarray
        The times; for each curve x, y, z of the point in the fixed frame, and the angular speed.
    """
    table = {"t [1]": np.asarray(t)}
    for name, curve in curves.items():
        x, y, z = (curve(t) @ np.asarray(point)).T
        speed = np.linalg.norm(curve(t, 1), axis=-1)
        table |= {f"{name} x [1]": x, f"{name} y [1]": y, f"{name} z [1]": z}
        table |= {f"{name} speed [rad]": speed}
    return table


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
    said = []
    for name in _MOTIONS:
        speed = np.asarray(data[f"{name} speed [rad]"])
        marks = np.array([data[f"{name} {axis} [1]"] for axis in "xyz"]).T[::10]
        sine = np.linalg.norm(np.cross(marks[:-1], marks[1:]), axis=1)
        steps = np.degrees(np.arctan2(sine, np.sum(marks[:-1] * marks[1:], axis=1)))
        said.append(
            f"the {name} takes the steps {', '.join(f'{step:.0f}' for step in steps)} degrees; its "
            f"speed is {speed[0]:.2f} at the start, {speed[len(speed) // 2]:.2f} in the middle, "
            f"{speed[-1]:.2f} at the end"
        )
    return (
        "Left, a sphere with the paths of one point under two motions, marked at equal times; "
        f"right, the angular speeds in rad per unit time. Between the marks {'; '.join(said)}."
    )


def _columns(data: Table) -> list[tuple[str, Array]]:
    return [(name, np.asarray(column, dtype=float)) for name, column in data.items()]


def _label(column: str) -> str:
    name = column.split(" [")[0]
    return LABELS.get(name, name)


def _shown_rows(parameter: Array) -> list[int]:
    """Return the rows nearest to the five multiples of π/6 below π, and the last."""
    sixths = np.arange(1, 6) * np.pi / 6
    nearest = [int(np.abs(parameter[:, 0] - angle).argmin()) for angle in sixths]
    return sorted({*nearest, len(parameter) - 1})


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
    >>> pi_fraction(5 * np.pi / 6), pi_fraction(np.pi), pi_fraction(-np.pi / 2), pi_fraction(0)
    ('5π/6', 'π', '−π/2', '0')
    """
    share = Fraction(angle / np.pi).limit_denominator(24)
    if share == 0:
        return "0"
    sign, count = "−" if share < 0 else "", abs(share.numerator)
    over = f"/{share.denominator}" if share.denominator > 1 else ""
    return f"{sign}{count if count > 1 else ''}π{over}"
