"""Lesson 16: a noisy recording of a hand, and curves near it."""

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from scipy.interpolate import make_smoothing_spline

import rbcourse as rb
from rbclassroom.figures import name_lines, named, rounded
from rbcourse import Array, Curve
from rbcourse.draw.save import COLOURS, Table

MARKS = np.array([[0.0, 0, 0], [70, 35, -20], [140, -20, 40], [200, 30, 10], [170, 60, -30]])
"""Yaw, pitch and roll at 0, 1, 2, 3 and 4 s, in degrees."""
_LOOKS: dict[str, dict[str, Any]] = {
    "through all poses": {"color": COLOURS["z"], "lw": 1},
    "the hand": {"color": COLOURS["optimum"], "lw": 4, "alpha": 0.35},
    "smoothed": {"color": COLOURS["projection"], "lw": 2},
    "rotation vectors": {"color": COLOURS["x"], "ls": "--"},
}
_ERRORS: dict[str, dict[str, Any]] = {
    "from the measured poses": {"color": COLOURS["z"], "ls": "-."},
    "from an omitted pose": {"color": COLOURS["projection"], "lw": 2.5},
    "from the hand": {"color": COLOURS["optimum"], "ls": "--"},
}


def hand() -> Curve:
    """Return the motion of the hand: least jerk through the `MARKS`, at rest at both ends."""
    R = rb.matrix_from_zyx(np.radians(MARKS))
    return rb.minimum_jerk_spline(np.arange(len(R)), R, "rest")


def speeds(curves: dict[str, Curve], order: Literal[1, 2]) -> Table:
    """Return the norms of w (order 1) or w' (order 2) of curves on SO(3), to four decimals."""
    t = np.linspace(*next(iter(curves.values())).domain, 1601)
    unit = " [rad/s]" if order == 1 else " [rad/s²]"
    norms = {name: np.linalg.norm(c(t, order), axis=1) for name, c in curves.items()}
    found = {name + unit: np.round(x, 4) for name, x in norms.items()}
    return {"t [s]": t, **found}


def draw_speeds(ax: Axes, data: Table) -> None:
    """Draw a table of `speeds`."""
    unit = "rad/s²" if "²" in [*data][-1] else "rad/s"
    t, curves = np.asarray(data["t [s]"]), named(f" [{unit}]", data)
    for name, values in curves.items():
        ax.plot(t, values, label=name, **_LOOKS[name])
    letter = r"\omega'" if unit == "rad/s²" else r"\omega"
    ax.set(xlabel="time (s)", ylabel=rf"$\Vert {letter}\Vert$ ({unit})", xlim=(t[0], t[-1]))
    ax.set(ylim=(0, 1.05 * max(x.max() for x in curves.values())))
    ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1), ncols=2)


def distance(a: Array, b: Array) -> float:
    """Return the root mean square of the angles between rotations, in degrees."""
    angles = rb.angle_between(a, b)
    return float(np.degrees(np.sqrt(np.mean(angles**2))))


def wrong_rate(curve: Curve, truth: Curve) -> float:
    """Return the root mean square of the error of w, in degrees for a unit of time."""
    t = np.linspace(*truth.domain, 3201)
    wrong = np.linalg.norm(curve(t, 1) - truth(t, 1), axis=1)
    return float(np.degrees(np.sqrt(np.mean(wrong**2))))


def projected_entries(t: Array, R: Array, period: float) -> Array:
    """Return the rotations nearest to SciPy's smoothing splines of the entries of matrices."""
    smoothing = (period / (2 * np.pi)) ** 4 / np.diff(t).mean()
    columns = [make_smoothing_spline(t, x, lam=smoothing)(t) for x in R.reshape(-1, 9).T]
    return rb.project_so(np.stack(columns, axis=-1).reshape(R.shape))


def validation_table(
    truth: Curve, t: Array, measured: Array, periods: Sequence[float] | Array
) -> Table:
    """Return root mean squares of the distances of smoothed curves, for each period, in rad.

    The curve without one pose misses this pose by about its distance with the pose, divided by the
    share of the degrees of freedom that the residuals have.
    """
    rows = []
    for period in periods:
        c = rb.smoothing_spline(t, measured, period=float(period))
        near = distance(c(t), measured)
        misfit = np.sum((c(t) - measured) ** 2) / 2
        share = misfit / (3 * c.noise**2) / len(t)
        rows.append(np.radians([near, near / share, distance(c(t), truth(t))]))
    names = (f"{name} [rad]" for name in _ERRORS)
    columns = rounded(np.transpose(rows))
    return {"period [s]": np.asarray(periods), **dict(zip(names, columns, strict=True))}


def draw_validation(ax: Axes, data: Table, best: float) -> None:
    """Draw a `validation_table` in degrees, with a line at the best period."""
    periods, errors = np.asarray(data["period [s]"]), named(" [rad]", data)
    for name, values in errors.items():
        ax.plot(periods, np.degrees(values), label=name, **_ERRORS[name])
    ax.axvline(best, color=COLOURS["reference"], lw=1.5, ls=":")
    ax.text(1.05 * best, 3.2, "chosen", color=COLOURS["reference"])
    ax.set(xscale="log", yscale="log", xlabel="period (s)", ylabel="distance (°)")
    ax.set(xlim=(periods[0], periods[-1]), ylim=(0.1, 6))
    ax.set_xticks([0.03, 0.1, 0.3, 1], ["0.03", "0.1", "0.3", "1"])
    ax.set_yticks([0.1, 0.3, 1, 3], ["0.1", "0.3", "1", "3"])
    ax.minorticks_off()
    name_lines(ax, {"from the measured poses": (0.2, 0.6), "from the hand": (0.12, 0.22)})
    name_lines(ax, {"from an omitted pose": (0.06, 2)})


def distances(truth: Curve, t: Array, curves: dict[str, Array]) -> Table:
    """Return the angles between rotations and a curve at the times t, to six decimals, in rad."""
    angles = {name: rb.angle_between(R, truth(t)) for name, R in curves.items()}
    return {"t [s]": t} | {f"{name} [rad]": np.round(x, 6) for name, x in angles.items()}


def draw_distances(ax: Axes, data: Table) -> None:
    """Draw distances from the hand, given in rad, in degrees over time."""
    t = np.asarray(data["t [s]"])
    for name, values in named(" [rad]", data).items():
        ax.plot(t, np.degrees(values), label=name, **_LOOKS[name])
    ax.set(yscale="log", ylim=(0.01, 200), xlim=(t[0], t[-1]))
    ax.set_yticks([0.01, 0.1, 1, 10, 100], ["0.01", "0.1", "1", "10", "100"])
    ax.set(xlabel="time (s)", ylabel="distance from the hand (°)")
    ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1), ncols=2)
