"""Lesson 15: the phase plane of a path, the two passes, and the use of each limit."""

from collections.abc import Sequence
from itertools import combinations
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import ArrayLike

from rbclassroom.figures import name_lines, named
from rbclassroom.figures.lesson14 import profile_table
from rbcourse import Array, Curve
from rbcourse.draw.save import COLOURS, PALE, Table, in_words

LIMITS = {
    "angular_speed": (1, 0, "angular speed [rad/s]"),
    "speed": (1, 1, "speed [m/s]"),
    "angular_acceleration": (2, 0, "angular acceleration [rad/s²]"),
    "acceleration": (2, 1, "acceleration [m/s²]"),
}
"""The order of the derivative, the half of the twist (0 or 1), and the name in `profile_table`."""
_LOOKS: dict[str, dict[str, Any]] = {
    "accelerations": {"color": COLOURS["x"], "label": "limit of accelerations"},
    "speeds": {"color": COLOURS["z"], "ls": "-.", "label": "limit of speeds"},
    "one rate": {"color": COLOURS["reference"], "ls": "--"},
    "fastest": {"color": COLOURS["optimum"], "lw": 2.5},
}


def highest_rates(path: Curve, s: Array, limits: dict[str, float]) -> dict[str, Array]:
    """Return the largest rates s' that the limits on accelerations and on speeds allow.

    The limits on accelerations allow a rate if some s'' satisfies these limits at this rate.
    `limits` maps names in `LIMITS` to the largest norms. The rate is infinite if no limit applies.
    """
    velocity, bend = (path(s, order).reshape(len(s), -1, 3) for order in (1, 2))
    squares, a, b = [np.zeros(len(s))], list[Array](), list[Array]()
    for name, most in limits.items():
        order, half, _ = LIMITS[name]
        if order == 1:
            squares.append(np.sum(velocity[:, half] ** 2, axis=1) / most**2)
        else:
            a.append(velocity[:, half] / most)
            b.append(bend[:, half] / most)
    with np.errstate(divide="ignore"):
        speeds = np.max(squares, axis=0) ** -0.5
        return {"accelerations": _least(a, b) ** -0.25, "speeds": speeds}


def _least(a: list[Array], b: list[Array]) -> Array:
    """Minimise the largest ‖a r + b‖² of all limits over r; return the minimum for each s."""
    if not a:
        return np.zeros(1)
    A, B = np.array(a), np.array(b)
    aa, ab, bb = (np.sum(x * y, axis=-1) for x, y in ((A, A), (A, B), (B, B)))
    with np.errstate(divide="ignore", invalid="ignore"):
        trials = list(-ab / aa)
        # values of r for which the terms of two limits are equal
        for i, j in combinations(range(len(aa)), 2):
            p, q, r = (x[i] - x[j] for x in (aa, ab, bb))
            root = np.sqrt(q * q - p * r)
            trials += [(-q + root) / p, (-q - root) / p]
    r = np.nan_to_num(np.array(trials), nan=0, posinf=0, neginf=0)[:, None]
    least: Array = np.min(np.max(aa * r**2 + 2 * ab * r + bb, axis=1), axis=0)
    return least


def phase_table(timed: Any, limits: dict[str, float], even: float) -> Table:
    """Return a table of rates: the limit curves, a constant rate, and the fastest rate.

    `timed` is a result of `rbcourse.fastest`. With the constant rate, the motion takes `even`
    seconds. Rates above twice the largest rate of the fastest timing are replaced by NaN.
    """
    first, last = timed.curve.domain
    s = np.linspace(first, last, 601)
    rates = highest_rates(timed.curve, s, limits)
    rates |= {"one rate": np.full(len(s), np.ptp(s) / even)}
    rates |= {"fastest": np.interp(s, timed.s, timed.rate**2) ** 0.5}
    highest = 2 * rates["fastest"].max()
    shown = {f"{name} [1]": np.where(x <= highest, x, np.nan) for name, x in rates.items()}
    return {"s [s]": s, **shown}


def draw_phase_plane(ax: Axes, data: Table, knots: ArrayLike) -> None:
    """Draw a `phase_table`, with a dotted line at each pose."""
    s, *columns = (np.asarray(x) for x in data.values())
    for knot in np.asarray(knots):
        ax.axvline(knot, color=PALE, lw=1, ls=":")
    for (name, look), rate in zip(_LOOKS.items(), columns, strict=True):
        ax.plot(s, rate, **{"label": name, **look})
    ax.set(xlabel="path parameter $s$ (s)", ylabel=r"rate $\dot s$", xlim=(s[0], s[-1]))
    ax.set(ylim=(0, 2 * np.max(columns[-1])), xticks=range(4), yticks=[0, 0.5, 1, 1.5])
    name_lines(ax, {"limit of speeds": (0.95, 1.06), "limit of accelerations": (2.1, 1.32)})
    name_lines(ax, {"one rate": (1.5, 0.38), "fastest": (0.2, 0.2)})


def describe_phase_plane(data: Table) -> str:
    """Return a description of the picture of `draw_phase_plane`."""
    _, accelerations, speeds, even, best = (np.asarray(x) for x in data.values())
    at_speeds, at_bends = (np.mean(best > 0.995 * x) for x in (speeds, accelerations))
    return (
        "The phase plane of a path: the rate of the fastest timing over the path parameter, and "
        "the limits of accelerations and of speeds. The rate goes up to "
        f"{in_words(best.max(), 1)}; it is {in_words(even[0], 1)} if it is the same everywhere. "
        f"The fastest timing is on the limit of speeds on {100 * at_speeds:.0f} % of the path, on "
        f"that of accelerations on {100 * at_bends:.0f} %."
    )


def share_table(motion: Curve, limits: dict[str, float]) -> Table:
    """Return the fraction of each limit that a motion uses, over time, to four decimals."""
    rates = {1: profile_table(motion, 1, 1201), 2: profile_table(motion, 2, 1201)}
    shares = {name: np.asarray(rates[LIMITS[name][0]][LIMITS[name][2]]) for name in limits}
    return {
        "t [s]": rates[1]["t [s]"],
        **{
            f"{name.replace('_', ' ')} [1]": np.round(x / limits[name], 4)
            for name, x in shares.items()
        },
    }


def draw_shares(axes: Sequence[Axes], data: Table) -> None:
    """Draw each share of a `share_table` on its own axes; it is coloured while it is 1."""
    t = np.asarray(data["t [s]"])
    for ax, (label, share) in zip(axes, named(" [1]", data).items(), strict=True):
        ax.fill_between(t, share, color=PALE, lw=0, alpha=0.4)
        used = ax.fill_between(t, share, where=share > 0.99, color=COLOURS["x"], lw=0)
        ax.plot(t, share, color=COLOURS["optimum"], lw=1.2, label=label)
        ax.set(ylim=(0, 1.05), yticks=[0, 1], xlim=(t[0], t[-1]))
        ax.set_ylabel(label.replace(" ", "\n"), rotation=0, ha="right", va="center")
        ax.label_outer()
    axes[-1].set_xlabel("time (s)")
    axes[0].figure.legend([used], ["at the limit"], loc="outside upper right")


def describe_shares(data: Table) -> str:
    """Return a description of the picture of `draw_shares`."""
    shares = named(" [1]", data)
    said = (f"{name} {100 * np.mean(x > 0.99):.0f} %" for name, x in shares.items())
    some = np.mean(np.max(list(shares.values()), axis=0) > 0.99)
    return (
        "Share of each limit that a motion uses, over time. The part of the time during which a "
        f"limit is used to 99 % or more: {', '.join(said)}; one of them {100 * some:.0f} %."
    )


def two_passes(highest: ArrayLike, step: float) -> tuple[Array, Array]:
    """Return the largest allowed x at the nodes, after the pass from the end and after both passes.

    Each x is at most `highest`, and exceeds the x of a neighbour by at most `step`. At both ends, x
    is 0.
    """
    back = np.array(highest, float)
    back[[0, -1]] = 0
    for i in reversed(range(len(back) - 1)):
        back[i] = min(back[i], back[i + 1] + step)
    both = back.copy()
    for i in range(len(both) - 1):
        both[i + 1] = min(both[i + 1], both[i] + step)
    return back, both


def draw_passes(ax: Axes, data: Table) -> None:
    """Draw three columns of x over the position: the limits, and x after each of the passes."""
    s, highest, back, both = (np.asarray(x) for x in data.values())
    ax.plot(s, highest, color=COLOURS["z"], ls="", marker="_", ms=22, mew=3, label="speed limit")
    ax.plot(s, back, color=COLOURS["reference"], ls="--", marker="o", label="from the end")
    ax.plot(s, both, color=COLOURS["optimum"], lw=2.5, marker="o", label="then from the start")
    for place, x in zip(s, both, strict=True):
        ax.annotate(f"{x:g}", (place, x), (0, -18), textcoords="offset points", ha="center")
    ax.set(xlabel="place $s$ (m)", ylabel=r"$x = \dot s^2$ (m²/s²)")
    ax.set_ylim(-0.8, np.max(highest) * 1.1)
    ax.set_xticks(s, [f"{place:g}" for place in s])
    name_lines(ax, {"speed limit": (1.2, 4), "from the end": (0.6, 3.1)}, ha="left")
    name_lines(ax, {"then from the start": (2, 1.5)})


def describe_passes(data: Table) -> str:
    """Return a description of the picture of `draw_passes`."""
    columns = [np.asarray(x).tolist() for x in data.values()]
    _, highest, back, both = ([f"{x:g}" for x in column] for column in columns)
    return (
        "Squared speeds along a straight path: their limits, the values after a pass from the end, "
        "and those after a second pass, from the start. Speed limits: "
        f"{', '.join(highest)}; after the pass from the end {', '.join(back)}; after the pass from "
        f"the start {', '.join(both)}."
    )
