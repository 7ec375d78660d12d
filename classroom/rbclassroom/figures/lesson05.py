"""Lesson 5: histograms of random rotations."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from rbcourse import Array
from rbcourse.draw.save import COLOURS, Table
from rbcourse.sampling import angle_law

Bins = Mapping[str, tuple[Array, Mapping[str, Array]]]
"""The edges of the bins and the densities of each sample, for each quantity of `histograms`."""

_HEIGHT: Any = (-1, 1), lambda z: (z + 1) / 2
_LAWS: dict[str, tuple[str, tuple[float, float], Callable[[Array], Array]]] = {
    "angle": ("angle (rad)", (0, np.pi), angle_law),
    "height of e₁": ("height of the image of e₁", *_HEIGHT),
    "height of e₃": ("height of the image of e₃", *_HEIGHT),
}
"""The label, the range, and the distribution for uniform rotations of each quantity."""


def histograms(R: Mapping[str, Array]) -> Bins:
    """Return histograms of three quantities of random rotations, shape (n, 3, 3), in 20 bins.

    The quantities are the angle and the heights of the images of e₁ and e₃. A density is the number
    of values in a bin, divided by n and the width of the bin.
    """
    bins = {
        c: (np.linspace(*limits, 21), dict[str, Array]()) for c, (_, limits, _) in _LAWS.items()
    }
    for name, matrices in R.items():
        cosine = (np.trace(matrices, axis1=-2, axis2=-1) - 1) / 2
        values = np.arccos(np.clip(cosine, -1, 1)), matrices[:, 2, 0], matrices[:, 2, 2]
        for x, (edges, densities) in zip(values, bins.values(), strict=True):
            inside = np.clip(x, edges[0], edges[-1])
            densities[name], _ = np.histogram(inside, edges, density=True)
    return bins


def histogram_table(bins: Bins) -> Table:
    """Return `histograms` as a table of the lower edge and the densities of each bin."""
    table: dict[str, Array] = {}
    for column, (edges, densities) in bins.items():
        table[f"{column} [{'rad' if column == 'angle' else '1'}]"] = edges
        table |= {f"{column}, {name} [1]": np.append(x, 0) for name, x in densities.items()}
    return table


def draw_histograms(axes: Sequence[Axes], bins: Bins) -> None:
    """Draw the histograms of two samples, and the densities of uniform rotations (RR 2)."""
    for ax, (column, (label, limits, law)) in zip(axes, _LAWS.items(), strict=True):
        edges, densities = bins[column]
        for (name, density), look in zip(densities.items(), ("projection", "z"), strict=True):
            ax.stairs(density, edges, baseline=None, color=COLOURS[look], lw=2, label=name)
        fine = np.linspace(*limits, 201)
        density, middle = np.diff(law(fine)) / np.diff(fine), (fine[:-1] + fine[1:]) / 2
        ax.plot(
            middle, density, color="black", ls="--", lw=1.5, label="density of uniform rotations"
        )
        ax.set_xticks(np.linspace(*limits, 3))
        ax.set(xlabel=label.replace("e₁", "$e_1$").replace("e₃", "$e_3$"), xlim=limits)
    axes[0].set_xticks([0, np.pi / 2, np.pi], ["0", "π/2", "π"])
    for ax in axes:
        ax.set_ylim(0)
    axes[0].set_ylabel("density")
    axes[0].locator_params(axis="y", nbins=4)
    looks = ("projection", 0.2), ("z", 0.63), ("optimum", 0.85)
    for name, (look, y) in zip([*densities, "dashed: exact"], looks, strict=True):
        axes[1].text(0, y, name, color=COLOURS[look], ha="center", va="center")


def describe_histograms(bins: Bins) -> str:
    """Return a description of the picture of `draw_histograms`."""
    said = []
    for column, (label, _, law) in _LAWS.items():
        edges, densities = bins[column]
        for name, density in densities.items():
            off = np.abs(density * np.diff(edges) - np.diff(law(edges))).sum() / 2
            said.append(f"{label.split(' (')[0]}, {name}: {100 * off:.0f} %")
    return (
        "Histograms of the angles of random rotations and of the heights of the images of e₁ and "
        "e₃, with the densities of uniform rotations. The proportion of the draws in the wrong "
        f"bins: {'; '.join(said)}."
    )
