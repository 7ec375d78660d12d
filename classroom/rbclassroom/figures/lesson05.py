"""Lesson 5: histograms of random rotations."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from rbcourse import Array
from rbcourse.draw.save import COLOURS, Table
from rbcourse.sampling import angle_law

Bins = Mapping[str, tuple[Array, Mapping[str, Array]]]
"""For each column of a histogram the edges of its bins, and the densities of each sample."""

_LAWS: dict[str, tuple[str, tuple[float, float], Callable[[Array], Array]]] = {
    "angle": ("angle (rad)", (0, np.pi), angle_law),
    "height of e₁": ("height of the image of e₁", (-1, 1), lambda z: (z + 1) / 2),
    "height of e₃": ("height of the image of e₃", (-1, 1), lambda z: (z + 1) / 2),
}
"""The columns of a histogram: label, range, and their distribution for uniform rotations."""


def histograms(R: Mapping[str, Array]) -> Bins:
    """Return the densities of samples of rotations, shape (n, 3, 3), in 20 bins for each column.

    The columns are the angle and the heights of the images of e₁ and e₃; a density is the number
    in a bin over its width and n.
    """
    bins = {}
    for column, (_, (low, high), _) in _LAWS.items():
        edges, densities = np.linspace(low, high, 21), {}
        for name, matrices in R.items():
            counts, _ = np.histogram(np.clip(_shown(column, matrices), low, high), edges)
            densities[name] = counts / (len(matrices) * np.diff(edges))
        bins[column] = edges, densities
    return bins


def _shown(column: str, R: Array) -> Array:
    if column == "angle":
        return np.arccos(np.clip((np.trace(R, axis1=-2, axis2=-1) - 1) / 2, -1, 1))
    return R[:, 2, 0 if column.endswith("₁") else 2]


def histogram_table(bins: Bins) -> Table:
    """Return `histograms` as a table: edges, and the densities in the bins that start there."""
    table: dict[str, Array] = {}
    for column, (edges, densities) in bins.items():
        table[f"{column} [{'rad' if column == 'angle' else '1'}]"] = edges
        table |= {f"{column}, {name} [1]": np.append(x, 0) for name, x in densities.items()}
    return table


def draw_histograms(axes: Sequence[Axes], bins: Bins) -> list[Any]:
    """Draw the histograms of two samples of rotations on three axes, and the law of uniform ones.

    (RR 2)
    """
    artists: list[Any] = []
    colours = COLOURS["projection"], COLOURS["z"]
    for ax, (column, (label, limits, law)) in zip(axes, _LAWS.items(), strict=True):
        edges, densities = bins[column]
        for (name, density), colour in zip(densities.items(), colours, strict=True):
            artists.append(ax.stairs(density, edges, color=colour, lw=2, label=name))
        fine = np.linspace(*limits, 201)
        density = np.diff(law(fine)) / np.diff(fine)
        middle = (fine[:-1] + fine[1:]) / 2
        artists += ax.plot(middle, density, color="black", ls="--", lw=1.5, label="the law")
        ax.set(xlabel=label, xlim=limits, ylim=(0, None))
    axes[0].set_xticks([0, np.pi / 2, np.pi], ["0", "π/2", "π"])
    axes[0].set_ylabel("density")
    axes[0].legend()
    return artists


def describe_histograms(bins: Bins) -> str:
    """Return in words what `draw_histograms` shows."""
    said = []
    for column, (label, _, law) in _LAWS.items():
        edges, densities = bins[column]
        for name, density in densities.items():
            off = np.abs(density * np.diff(edges) - np.diff(law(edges))).sum() / 2
            said.append(f"{label.split(' (')[0]}, {name}: {100 * off:.0f} %")
    return (
        "Histograms of random rotations, of their angles and of the heights of two images, beside "
        "the law of uniform ones. The share of the draws that lies in the wrong bins: "
        f"{'; '.join(said)}."
    )
