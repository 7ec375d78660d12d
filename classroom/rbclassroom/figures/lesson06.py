"""Lesson 6: families of projected lines, the chord, paths and the moving frame."""

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Arc
from numpy.typing import ArrayLike

from rbcourse import Array, angle_between
from rbcourse.draw.bodies import draw_arrow, draw_box, draw_triad
from rbcourse.draw.save import COLOURS, Table
from rbcourse.draw.scene import OVER
from rbcourse.draw.spheres import draw_sphere

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


def draw_family(ax: Axes, data: Table) -> list[Any]:
    """Draw up to six curves of a table (parameter, abscissa, value), each for one parameter.

    BK Fig. 2, BK Fig. 3.
    """
    (_, parameter), (x_name, x), (y_name, y) = _columns(data)
    lines = []
    for row, dash in zip(_shown_rows(parameter), _DASHES, strict=False):
        angle = parameter[row, 0]
        look = {"color": _angle_colour(angle), "ls": dash, "label": pi_fraction(angle)}
        lines += ax.plot(x[row], y[row], **look)
    ax.set(xlabel=_label(x_name), ylabel=_label(y_name), xlim=(x.min(), x.max()))
    ax.legend(title="angle a (rad)", loc="center left", bbox_to_anchor=(1, 0.5))
    return lines


def draw_surface(ax: Any, data: Table) -> list[Any]:
    """Draw a table (parameter, abscissa, value) as a surface over abscissa and parameter.

    An angle has the colour of its curve in `draw_family` (BK Fig. 2, BK Fig. 3).
    """
    (p_name, parameter), (x_name, x), (y_name, y) = _columns(data)
    colours = _angle_colour(parameter)
    look = {"facecolors": colours, "shade": False, "lw": 0.3, "edgecolor": "white"}
    surface = ax.plot_surface(x, parameter, y, rcount=24, ccount=34, **look)
    ax.set(xticks=[0, 0.5, 1])
    ax.set_xlabel(_label(x_name), labelpad=7)
    ax.set_ylabel(_label(p_name), labelpad=13)
    ax.set_yticks([0, np.pi / 2, np.pi], ["0", "π/2", "π"])
    ax.text2D(0.06, 0.88, _label(y_name), transform=ax.transAxes)
    ax.view_init(elev=24, azim=-128)
    ax.set_box_aspect((1, 1, 0.75), zoom=0.95)
    return [surface]


def describe_family(data: Table) -> str:
    """Return in words what `draw_family` and `draw_surface` show."""
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
        f"curves, a colour for each angle. At the times {times} {'; '.join(ends)}."
    )


def draw_chord(ax: Axes, data: Table) -> list[Any]:
    """Draw equal steps along a chord of the upper unit circle, and the rays that project them."""
    t, x, y, arc_x, arc_y = (np.asarray(column) for column in data.values())
    circle = Arc((0, 0), 2, 2, theta1=0, theta2=180, color=COLOURS["reference"], lw=1)
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
    for k, offset in ((0, (-16, -22)), (len(x) // 2, (8, 8)), (-1, (-54, -4))):
        ax.annotate(f"t = {t[k]:g}", (x[k], y[k]), offset, textcoords="offset points")
    ax.set(aspect="equal", xlim=(-1.12, 1.12), ylim=(-0.16, 1.08))
    ax.set(xlabel="real part", ylabel="imaginary part")
    ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1))
    return [circle, *rays, *chord, *arc]


def describe_chord(data: Table) -> str:
    """Return in words what `draw_chord` shows."""
    _, _, _, x, y = (np.asarray(column) for column in data.values())
    steps = np.degrees(np.diff(np.unwrap(np.arctan2(y, x))))
    return (
        f"A chord of the unit circle over {steps.sum():.0f} degrees, cut into {len(steps)} equal "
        "steps, and rays from the centre through the cuts to the circle. The first step on the "
        f"circle spans {steps[0]:.0f} degrees, the widest, in the middle, {steps.max():.0f}."
    )


def path_table(t: Array, paths: Mapping[str, Array], speeds: Mapping[str, Array]) -> Table:
    """Return paths of a point and angular speeds as a table."""
    table = {"t [1]": t}
    for name, path in paths.items():
        table |= {f"{name} {axis} [1]": x for axis, x in zip("xyz", path.T, strict=True)}
        table |= {f"{name} speed [rad]": speeds[name]}
    return table


def draw_paths(ax: Any, paths: Mapping[str, Array]) -> list[Any]:
    """Draw on the unit sphere the paths of one point, shape (times, 3), every tenth time marked.

    They are those of a "geodesic" and a "projected line".
    """
    draw_sphere(ax)
    lines = [ax.plot(*path.T, **_MOTIONS[name])[0] for name, path in paths.items()]
    way = paths["geodesic"]
    start, middle, end = way[[0, len(way) // 2, -1]]
    for when, place in (("t = 0", start), ("t = 1", end)):
        ax.text(*(0.82 * place), when, ha="center", va="center")
    x, y, z = np.cross(start, end) / np.linalg.norm(np.cross(start, end)) + middle / 2
    ax.view_init(elev=np.degrees(np.arctan2(z, np.hypot(x, y))), azim=np.degrees(np.arctan2(y, x)))
    return lines


def draw_speeds(ax: Axes, t: Array, speeds: Mapping[str, Array]) -> list[Any]:
    """Draw the angular speeds of these two motions over time, every tenth time marked."""
    lines = [ax.plot(t, speeds[name], label=name, **style)[0] for name, style in _MOTIONS.items()]
    ax.set(xlabel=LABELS["t"], ylabel="‖ω‖ (rad per unit time)", xlim=(0, 1), ylim=(0, None))
    ax.legend()
    return lines


def describe_paths(paths: Mapping[str, Array], speeds: Mapping[str, Array]) -> str:
    """Return in words what `draw_paths` and `draw_speeds` show."""
    said = []
    for name in _MOTIONS:
        speed, marks = speeds[name], paths[name][::10]
        sine = np.linalg.norm(np.cross(marks[:-1], marks[1:]), axis=1)
        steps = np.degrees(np.arctan2(sine, np.sum(marks[:-1] * marks[1:], axis=1)))
        said.append(
            f"the {name} takes the steps {', '.join(f'{step:.0f}' for step in steps)} degrees; its "
            f"speed is {speed[0]:.2f} at the start, {speed[len(speed) // 2]:.2f} in the middle, "
            f"{speed[-1]:.2f} at the end"
        )
    return (
        f"The paths of one point on a sphere, {' and '.join(_MOTIONS)}, marked at equal times, and "
        "beside them the angular speeds over time. Speeds are in rad per unit time. Between the "
        f"marks {'; '.join(said)}."
    )


def _columns(data: Table) -> list[tuple[str, Array]]:
    return [(name, np.asarray(column, dtype=float)) for name, column in data.items()]


def _label(column: str) -> str:
    name = column.split(" [")[0]
    return LABELS.get(name, name)


def _angle_colour(angle: ArrayLike) -> Any:
    return plt.get_cmap("viridis_r")(np.asarray(angle) / np.pi)


def _shown_rows(parameter: Array) -> list[int]:
    """Return the rows nearest to the five multiples of π/6 below π, and the last."""
    sixths = np.arange(1, 6) * np.pi / 6
    nearest = [int(np.abs(parameter[:, 0] - angle).argmin()) for angle in sixths]
    return sorted({*nearest, len(parameter) - 1})


def pi_fraction(angle: float) -> str:
    """Return an angle in rad as a fraction of π.

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


def draw_moving_frame(ax: Any, names: Sequence[str], poses: Array) -> list[Any]:
    """Draw a fixed frame, a moving frame on its body, and the position vector between them.

    `names` and `poses`, shape (2, 4, 4), are those of the fixed frame and the moving one
    (BK Fig. 1).
    """
    d, R = poses[:, :3, 3], poses[:, :3, :3]
    artists = [draw_box(ax, poses[1], np.array([1.4, 1.0, 0.7]))]
    artists[0].set_alpha(0.5)
    for name, origin, axes in zip(names, d, R, strict=True):
        artists += draw_triad(ax, origin, axes, name)
        ax.text(*(origin - [0, 0, 0.4]), f"{{{name}}}", ha="center", zorder=OVER)
    vector = draw_arrow(ax, d[0], d[1] - d[0], color=COLOURS["reference"])
    ax.text(*(d.mean(axis=0) - [0, 0, 0.25]), "d", fontstyle="italic")
    ax.fit(d.min(axis=0) - 0.4, d.max(axis=0) + 1, zoom=1.3)
    ax.view_init(elev=20, azim=-60)
    return [*artists, vector]


def describe_moving_frame(names: Sequence[str], poses: Array) -> str:
    """Return in words what `draw_moving_frame` shows."""
    fixed, moving = names
    place = ", ".join(f"{x:g}" for x in poses[1, :3, 3])
    turn = np.degrees(angle_between(np.eye(3), poses[1, :3, :3]))
    return (
        f"The fixed frame {{{fixed}}} with its axes x, y, z, and a box that carries the moving "
        f"frame {{{moving}}}. Its origin is at ({place}) m, the tip of the vector d, and it is "
        f"turned by {turn:.0f} degrees against the fixed one."
    )
