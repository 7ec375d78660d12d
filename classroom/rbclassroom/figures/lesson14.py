"""Lesson 14: speeds and accelerations of a motion."""

from collections.abc import Iterator, Sequence

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import ArrayLike

from rbcourse import Array, Curve
from rbcourse.draw.save import COLOURS, Table, in_words

RATES = {
    1: ("angular speed [rad/s]", "speed [m/s]"),
    2: ("angular acceleration [rad/s²]", "acceleration [m/s²]"),
}
_TIME = "t [s]"


def profile_table(motion: Curve, order: int, samples: int = 401) -> Table:
    """Return how fast a motion turns and moves over time, or how strongly it is accelerated.

    They are the norms of the two halves of ``motion(t, order)``, order 1 or 2, at even times in s.
    It has to be a single motion on SE(3).
    """
    t = np.linspace(*motion.domain, samples)
    rates = motion(t, order)
    if rates.shape != (samples, 6):
        raise ValueError("motion: a single curve on SE(3) wanted")
    norms = np.linalg.norm(np.split(rates, 2, axis=-1), axis=-1)
    return {_TIME: t, **dict(zip(RATES[order], norms, strict=True))}


def draw_profiles(axes: Sequence[Axes], data: Table, knots: ArrayLike) -> None:
    """Draw each column over time, on axes of its own, and a thin line at each of some times."""
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


def describe_profiles(data: Table, knots: ArrayLike) -> str:
    """Say how large each column of such a drawing becomes, and when."""
    t = np.asarray(data[_TIME])
    parts, labels = [], []
    for label, unit, values in _profiles(data):
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


def _profiles(data: Table) -> Iterator[tuple[str, str, Array]]:
    """Give the label, the unit and the values of each column but the time."""
    for name, values in data.items():
        label, unit = name.removesuffix("]").split(" [")
        if name != _TIME:
            yield label, unit, np.asarray(values)
