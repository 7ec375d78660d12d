"""Lessons 14 to 16: accelerations and costs of curves through rotations, and speeds of motions."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import accumulate
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation, RotationSpline

import rbcourse as rb
from rbclassroom.figures import name_ends, named
from rbcourse import Array, Curve
from rbcourse.draw.save import COLOURS, PALE, Table, in_words

RATES = {
    1: ("angular speed [rad/s]", "speed [m/s]"),
    2: ("angular acceleration [rad/s²]", "acceleration [m/s²]"),
}
_TIME = "t [s]"
EXCESSES: dict[str, dict[str, Any]] = {
    "parabolas": {"color": COLOURS["z"], "ls": "-."},
    "projected spline": {"color": COLOURS["projection"], "ls": "-"},
    "quaternion spline": {"color": COLOURS["screw"], "ls": "--"},
    "SciPy's spline": {"color": COLOURS["reference"], "ls": ":"},
}
"""The curves of `excess_table`, and the styles of their lines."""
_CURVES: dict[str, dict[str, Any]] = {
    "parabolas": {"color": COLOURS["z"], "ls": "-."},
    "projected spline": {"color": COLOURS["projection"], "ls": "--"},
    "optimum": {"color": COLOURS["optimum"], "ls": "-", "lw": 2},
}
_CLOCK = np.array([0, 1, 1 + 2**0.5])
_ANGLES = np.array([0, 1, 0.3])
_TURNS: list[dict[str, Any]] = [
    {"color": COLOURS["y"], "ls": "-."},
    {"color": COLOURS["screw"], "ls": "--"},
    {"color": COLOURS["optimum"], "ls": "-"},
]


def profile_table(motion: Curve, order: Literal[1, 2], samples: int = 401) -> Table:
    """Return the speeds (order 1) or the accelerations (order 2) of a motion over time.

    They are the norms of the two halves of ``motion(t, order)``, at equally spaced times in s.
    `motion` must be a single motion on SE(3).
    """
    t = np.linspace(*motion.domain, samples)
    rates = motion(t, order)
    if rates.shape != (samples, 6):
        raise ValueError("motion: a single curve on SE(3) is wanted")
    norms = np.linalg.norm(np.split(rates, 2, axis=-1), axis=-1)
    return {_TIME: t, **dict(zip(RATES[order], norms, strict=True))}


def draw_profiles(axes: Sequence[Axes], data: Table, knots: ArrayLike) -> None:
    """Draw each column over time, on its own axes, with a dotted line at each knot."""
    t = np.asarray(data[_TIME])
    for ax, (label, unit, values) in zip(axes, _profiles(data), strict=True):
        for knot in np.asarray(knots):
            ax.axvline(knot, color=COLOURS["reference"], lw=0.8, ls=":")
        ax.plot(t, values, color=COLOURS["path"])
        ax.set(ylabel=f"{label}\n({unit})", xlim=(t[0], t[-1]))
        low, high = 1.08 * np.minimum(values.min(), 0), 1.08 * np.maximum(values.max(), 0)
        ax.set_ylim(low, high if high > low else 1)
    axes[-1].set_xlabel("time (s)")
    axes[0].figure.align_ylabels(axes)


def _profiles(data: Table) -> Iterator[tuple[str, str, Array]]:
    """Yield the label, the unit and the values of each column except for the time."""
    for name, values in data.items():
        label, unit = name.removesuffix("]").split(" [")
        if name != _TIME:
            yield label, unit, np.asarray(values)


def acceleration_table(curves: Mapping[str, Curve], component: int) -> Table:
    """Return one component of ω' of curves on SO(3) at 401 equally spaced times."""
    t = np.linspace(*next(iter(curves.values())).domain, 401)
    return {_TIME: t} | {f"{name} [rad/s²]": c(t, 2)[:, component] for name, c in curves.items()}


def draw_accelerations(ax: Axes, data: Table, knots: ArrayLike) -> None:
    """Draw an `acceleration_table`, with a dotted line at each knot."""
    for knot in np.asarray(knots):
        ax.axvline(knot, color=COLOURS["reference"], lw=1.5, ls=":")
    for name, _, values in _profiles(data):
        ax.plot(data[_TIME], values, label=name, **_CURVES[name])
    t = np.asarray(data[_TIME])
    ax.set(xlabel="time (s)", ylabel=r"$\omega'$ about one axis (rad/s²)", xlim=(t[0], t[-1]))
    ax.set(xticks=range(5), yticks=[-2, 0, 2])
    name_ends(ax)


def describe_accelerations(data: Table, knots: ArrayLike) -> str:
    """Return a description of the picture of `draw_accelerations`."""
    t, inner = np.asarray(data[_TIME]), np.asarray(knots)[1:-1]
    parts = []
    for name, _, values in _profiles(data):
        steps = [np.interp(k + 0.01, t, values) - np.interp(k - 0.01, t, values) for k in inner]
        parts.append(f"{name} by {', '.join(in_words(x, 1) for x in steps)} rad/s²")
    return (
        "One component of the angular acceleration over time, of curves that reach the same "
        "rotations at the dotted lines. Within 0.02 s at the inner ones they change: "
        f"{'; '.join(parts)}."
    )


def turns_table(turns: Mapping[str, tuple[int, int]]) -> Table:
    """Return a table of natural cubic splines through three angles, with whole turns added.

    The "bend" of a spline is its difference from the straight line between its ends.
    """
    t = np.linspace(0, _CLOCK[-1], 201)
    data = {_TIME: t}
    for name, (first, second) in turns.items():
        angles = _ANGLES + 2 * np.pi * np.array([0, first, first + second])
        data[f"{name} [rad]"] = spline = CubicSpline(_CLOCK, angles, bc_type="natural")(t)
        data[f"{name} bend [rad]"] = spline - spline[-1] * t / t[-1]
    return data


def draw_turns(axes: Sequence[Axes], data: Table) -> None:
    """Draw a `turns_table`, with dots at all angles that represent the three rotations."""
    t, *columns = (np.asarray(x) for x in data.values())
    low, high = np.min(columns) - 8, np.max(columns) + 8
    for clock, angle in zip(_CLOCK, _ANGLES, strict=True):
        dots = angle + 2 * np.pi * np.arange(-20, 20)
        dots = dots[(dots > low) & (dots < high)]
        axes[0].plot(np.full(len(dots), clock), dots, "o", color=PALE, ms=2, zorder=0)
    for (name, bend), look in zip(named(" bend [rad]", data).items(), _TURNS, strict=True):
        for ax, values in zip(axes, (data[f"{name} [rad]"], bend), strict=True):
            ax.plot(t, values, label=name, **look)
    axes[0].set(ylabel=r"angle $\theta$ (rad)", ylim=(low, high), yticks=[0, 20, 40, 60])
    axes[1].set(ylabel=r"$\theta$ less the straight line (rad)", yticks=[0, 0.4, 0.8])
    for ax in axes:
        ax.set(xlabel="time (s)", xticks=[0, 1, 2])
    name_ends(axes[0])


def excess_table(degrees: Sequence[float], paths: int, rng: int) -> Table:
    """Return a table of the median excess of curves through ten rotations.

    Each leg turns by the same angle about a random axis, and the axes are the same for all angles.
    The curves and their optimum have the end velocities of Bessel's parabolas. SciPy's spline is
    compared with the optimum that has this spline's end velocities.
    """
    axes, times = np.random.default_rng(rng).standard_normal((paths, 9, 3)), np.arange(10.0)
    axes /= np.linalg.norm(axes, axis=-1, keepdims=True)
    nodes, weights = np.polynomial.legendre.leggauss(16)
    within = times[:-1, None] + (1 + nodes) / 2  # at 16 times in each leg
    medians = []
    for degree in degrees:
        rows = []
        for turns in rb.exp_so3(np.radians(degree) * axes):
            R = np.array(list(accumulate(turns, np.matmul, initial=np.eye(3))))
            w = rb.bessel_velocities(times, R)
            scipys = RotationSpline(times, Rotation.from_matrix(R))
            ends, scipy_ends = (w[0], w[-1]), tuple(scipys([0, 9], 1))
            curves = (
                rb.chain(times, R, w),
                rb.projected_spline(times, R, ends),
                rb.quaternion_spline(times, R, ends),
            )
            best, other = (
                rb.minimum_acceleration_spline(times, R, x).cost for x in (ends, scipy_ends)
            )
            squares = np.sum(scipys(within.ravel(), 2) ** 2, axis=-1).reshape(within.shape)
            cost = np.sum(squares @ weights)  # 2 from the metric, ½ from the length of a leg
            rows.append([*(rb.acceleration_cost(c) / best for c in curves), cost / other])
        medians.append(np.median(rows, axis=0) - 1)
    columns = (f"{name} [1]" for name in EXCESSES)
    digits = np.vectorize(lambda x: float(f"{x:.3g}"))(np.transpose(medians))
    return {"leg [rad]": np.radians(degrees), **dict(zip(columns, digits, strict=True))}


def draw_excesses(ax: Axes, data: Table) -> None:
    """Draw an `excess_table` on logarithmic axes."""
    ticks = np.degrees(data["leg [rad]"]).round(9)
    for name, values in named(" [1]", data).items():
        ax.loglog(ticks, values, label=name, **EXCESSES[name])
    ax.set(xlabel="turn of a leg (°)", ylabel="excess over the optimum")
    ax.set_xticks(ticks, [f"{tick:g}" for tick in ticks], minor=False)
    ax.set_yticks([1e-7, 1e-5, 1e-3, 1e-1], ["0.00001 %", "0.001 %", "0.1 %", "10 %"])
    ax.minorticks_off()
    name_ends(ax)
