"""Line plots of curves over time and over parameters, from tables: artists on given axes.

A table is a dict of columns whose names carry the units (see `rbcourse.draw.save`).
"""

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Arc
from matplotlib.ticker import MaxNLocator
from numpy.typing import ArrayLike

from rbcourse import Array, Curve, log_so3
from rbcourse.draw.save import COLOURS, Table, in_words
from rbcourse.draw.spheres import draw_sphere

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
_STYLES: dict[str, dict[str, Any]] = {
    "optimum": {"ls": "-", "marker": "o", "ms": 8, "mfc": "white"},
    "projection": {"ls": "--", "marker": "o", "ms": 4},
}
RATES = {
    1: ("angular speed [rad/s]", "speed [m/s]"),
    2: ("angular acceleration [rad/s²]", "acceleration [m/s²]"),
}
_TIME = "t [s]"


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


def coordinate_table(curves: Mapping[str, Curve], t: ArrayLike) -> Table:
    """Return the exponential coordinates σ of rotations over time, as a table (BK 6.2, BK (21))."""
    table = {"t [1]": np.asarray(t)}
    for name, curve in curves.items():
        for i, sigma in enumerate(log_so3(curve(t)).T, start=1):
            table[f"{name} sigma{i} [rad]"] = sigma
    return table


def draw_comparison(fig: Figure, data: Table) -> list[Any]:
    """Draw the paths in the space of σ, the coordinates over time, and their difference.

    BK Fig. 4.
    """
    space: Any = {"a": {"projection": "3d"}}
    axes = fig.subplot_mosaic("ab;ac", per_subplot_kw=space, height_ratios=[2, 1])
    return [
        *draw_coordinate_paths(axes["a"], data),
        *draw_coordinates(axes["b"], data),
        *draw_difference(axes["c"], data),
    ]


def draw_coordinate_paths(ax: Any, data: Table) -> list[Any]:
    """Draw the paths of an optimum and a projection in the space of σ, every tenth time marked.

    BK Fig. 4.
    """
    lines = [
        ax.plot(*_coordinates(data, name), color=COLOURS[name], label=name, markevery=10, **style)[
            0
        ]
        for name, style in _STYLES.items()
    ]
    start, end = _coordinates(data, "optimum")[:, [0, -1]].T
    ax.text(*start, "   t = 0", va="top")
    ax.text(*end, "t = 1   ", va="bottom", ha="right")
    ax.set_xlabel("σ₁ (rad)", labelpad=11)
    ax.set_ylabel("σ₂ (rad)", labelpad=11)
    ax.zaxis.set_rotate_label(False)
    ax.set_zlabel("σ₃ (rad)", rotation=90)
    for axis in (ax.xaxis, ax.yaxis, ax.zaxis):
        axis.set_major_locator(MaxNLocator(4))
    ax.view_init(elev=22, azim=-62)
    ax.set_box_aspect((1, 1, 0.9), zoom=0.9)
    ax.legend(loc="upper left", bbox_to_anchor=(0, 1.06))
    return lines


def draw_coordinates(ax: Axes, data: Table) -> list[Any]:
    """Draw σ₁, σ₂, σ₃ over time, of the optimum as full lines and of the projection dashed.

    BK Fig. 4.
    """
    t = np.asarray(data["t [1]"])
    lines = []
    for name, style in _STYLES.items():
        for axis, sigma in zip("xyz", _coordinates(data, name), strict=True):
            lines += ax.plot(t, sigma, color=COLOURS[axis], markevery=10, clip_on=False, **style)
    for axis, number, sigma in zip("xyz", "₁₂₃", _coordinates(data, "optimum"), strict=True):
        ax.text(1.04, sigma[-1], f"σ{number}", color=COLOURS[axis], va="center")
    ax.set(xlabel="time t", ylabel="σ (rad)", xlim=(0, 1))
    ax.legend(handles=[Line2D([], [], color="0.3", label=name, **s) for name, s in _STYLES.items()])
    return lines


def draw_difference(ax: Axes, data: Table) -> list[Any]:
    """Draw by how much σ₁, σ₂, σ₃ of the projection differ from those of the optimum."""
    t, difference = (
        np.asarray(data["t [1]"]),
        _coordinates(data, "projection") - _coordinates(data, "optimum"),
    )
    lines = [
        ax.plot(t, part, color=COLOURS[axis], ls=dash, label=f"σ{number}")[0]
        for axis, number, part, dash in zip("xyz", "₁₂₃", difference, ["-", "--", ":"], strict=True)
    ]
    ax.set(xlabel="time t", ylabel="Δσ (rad)", xlim=(0, 1))
    ax.legend(
        title="projection\n− optimum", loc="center left", bbox_to_anchor=(1, 0.5), handlelength=1.5
    )
    return lines


def describe_coordinates(data: Table) -> str:
    """Return in words what `draw_comparison` shows."""
    best, near = _coordinates(data, "optimum"), _coordinates(data, "projection")
    apart = np.linalg.norm(best - near, axis=0)
    start, end = (", ".join(f"{x:.3g}" for x in best[:, k].round(9) + 0.0) for k in (0, -1))
    said = (
        "The optimum and the projection in exponential coordinates: their paths, marked at equal "
        "times, the coordinates over time, and by how much they differ. "
        f"Both run from ({start}) to ({end}) rad. "
    )
    if apart.max() < 1e-9:
        return said + "They coincide at all times."
    when = np.asarray(data["t [1]"])[np.argmax(apart > (1 - 1e-9) * apart.max())]
    return said + f"σ differs most at t = {when:g}, by {apart.max():.2g} rad in length."


def draw_excess(ax: Axes, data: Table) -> list[Any]:
    """Draw, on logarithmic axes, what near-optimal curves cost too much over their excursion."""
    (_, scale), *families = data.items()
    scale = np.asarray(scale)
    looks = [("x", "o-"), ("y", "s--"), ("z", "^-."), ("projection", "d:")]
    lines = [
        ax.plot(scale, excess, mark, color=COLOURS[look], label=name.removesuffix(" excess [1]"))[0]
        for (name, excess), (look, mark) in zip(families, looks, strict=False)
    ]
    slope = ax.plot(scale, 1e-2 * scale**4, color=COLOURS["reference"], lw=1, label="slope 4")
    ax.set(xscale="log", yscale="log", xlabel="size s of the excursion (1: as given)")
    ax.set_ylabel("cost / optimum − 1")
    ax.axhline(0.01, color=COLOURS["reference"], lw=1, ls=":")
    ax.text(scale.min(), 0.012, "1 %", color=COLOURS["reference"])
    ax.legend(loc="center left", bbox_to_anchor=(1, 0.5))
    return [*lines, *slope]


def describe_excess(data: Table) -> str:
    """Return in words what `draw_excess` shows."""
    (_, scale), *families = data.items()
    ends = "; ".join(
        f"{name.removesuffix(' excess [1]')} from {np.asarray(excess)[0]:.1e} to "
        f"{np.asarray(excess)[-1]:.2g}"
        for name, excess in families
    )
    return (
        "What the projection costs above the optimum, as a share, over the size of the excursion, "
        f"on logarithmic axes. From size {np.min(scale):g} to {np.max(scale):g} it goes: {ends}. "
        "All follow a line of slope four where they are small."
    )


def _coordinates(data: Table, name: str) -> Array:
    return np.array([data[f"{name} sigma{i} [rad]"] for i in (1, 2, 3)])


def profile_table(motion: Curve, order: int, samples: int = 401) -> Table:
    """Return how fast a motion turns and moves over time, or how strongly it is accelerated.

    They are the norms of the two halves of ``motion(t, order)``, order 1 or 2, at even times in s.

    Raises
    ------
    ValueError
        If it is no single motion on SE(3).

    Examples
    --------
    >>> from rbcourse import geodesic_se3, pose_from_coordinates
    >>> c = geodesic_se3(np.eye(4), pose_from_coordinates([0, 0, 1, 3, 4, 0]))
    >>> {name: x.round(9).tolist() for name, x in profile_table(c, 1, 2).items()}
    {'t [s]': [0.0, 1.0], 'angular speed [rad/s]': [1.0, 1.0], 'speed [m/s]': [5.0, 5.0]}
    """
    t = np.linspace(*motion.domain, samples)
    rates = motion(t, order)
    if rates.shape != (samples, 6):
        raise ValueError("motion: a single curve on SE(3) wanted")
    halves = np.split(rates, 2, axis=-1)
    norms = (np.linalg.norm(half, axis=-1) for half in halves)
    return {_TIME: t, **dict(zip(RATES[order], norms, strict=True))}


def draw_profiles(axes: Sequence[Axes], data: Table, knots: ArrayLike) -> list[Any]:
    """Draw each column over time, on axes of its own, and a thin line at each of some times."""
    t, lines = np.asarray(data[_TIME]), []
    for ax, (name, values) in zip(axes, _profiles(data), strict=True):
        for knot in np.asarray(knots):
            ax.axvline(knot, color=COLOURS["reference"], lw=0.8, ls=":")
        lines += ax.plot(t, values, color=COLOURS["path"])
        label, unit = name.removesuffix("]").split(" [")
        ax.set(ylabel=f"{label}\n({unit})", xlim=(t[0], t[-1]))
        low, high = 1.08 * min(np.min(values), 0), 1.08 * max(np.max(values), 0)
        ax.set_ylim(low, high if high > low else 1)
    axes[-1].set_xlabel("time (s)")
    axes[0].figure.align_ylabels(axes)
    return lines


def describe_profiles(data: Table, knots: ArrayLike) -> str:
    """Say how large each column of such a drawing becomes, and when."""
    t = np.asarray(data[_TIME])
    parts, labels = [], []
    for name, values in _profiles(data):
        label, unit = name.removesuffix("]").split(" [")
        labels.append(f"{label} ({unit})")
        scale, largest = np.abs(values).max(), int(np.argmax(np.round(values, 9)))
        low = f"from {in_words(values.min(), scale)} " if values.min() < -0.01 * scale else ""
        parts.append(f"{label} {low}up to {in_words(values[largest], scale)} {unit}")
        parts[-1] += f" at {in_words(t[largest], t[-1])} s"
    when = ", ".join(in_words(knot, t[-1]) for knot in np.asarray(knots))
    return (
        f"Over time, with dotted lines where poses are reached: {', '.join(labels)}. "
        f"They go: {'; '.join(parts)}. The poses are reached at {when} s."
    )


def _profiles(data: Table) -> list[tuple[str, Any]]:
    return [(name, np.asarray(values)) for name, values in data.items() if name != _TIME]


def draw_angles(axes: Sequence[Axes], data: Table) -> list[Any]:
    """Draw ZYX angles over time, each motion on its own axes (RR (8))."""
    looks = {"α": (COLOURS["z"], "-"), "β": (COLOURS["y"], "-."), "γ": (COLOURS["x"], "--")}
    lines = []
    for ax, name in zip(axes, _motions(data), strict=True):
        for angle, (colour, dash) in looks.items():
            degrees = np.degrees(np.asarray(data[f"{name} {angle} [rad]"]))
            lines += ax.plot(data["t [1]"], degrees, color=colour, ls=dash, label=angle)
        ax.set(
            xlabel="time t",
            title=name,
            xlim=(0, 1),
            xticks=[0, 0.5, 1],
            yticks=[-180, -90, 0, 90, 180],
        )
    axes[0].set_ylabel("angle (degrees)")
    axes[0].legend()
    return lines


def describe_angles(data: Table) -> str:
    """Return in words what `draw_angles` shows."""
    t = np.asarray(data["t [1]"])
    said = []
    for name in _motions(data):
        alpha = np.unwrap(np.asarray(data[f"{name} α [rad]"]))
        share = (alpha - alpha[0]) / (alpha[-1] - alpha[0])
        early, late = np.interp([0.25, 0.75], share, t)
        beta = np.degrees(np.asarray(data[f"{name} β [rad]"]))
        extreme = beta[np.abs(beta).argmax()]
        said.append(
            f"{name}: β goes to {extreme:.0f} degrees, and the middle half of α's change takes "
            f"{100 * (late - early):.1f} % of the time"
        )
    return (
        f"ZYX angles over time of bodies that turn steadily: {'; '.join(_motions(data))}. "
        f"In turn, {'; '.join(said)}."
    )


def _motions(data: Table) -> list[str]:
    return [key.removesuffix(" α [rad]") for key in data if key.endswith(" α [rad]")]


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
