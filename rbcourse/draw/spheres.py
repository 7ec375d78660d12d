"""Random rotations on the sphere: what they do to a vector, still and one by one."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from mpl_toolkits.mplot3d.art3d import Line3DCollection

from rbcourse._numerics import Array
from rbcourse.draw.save import COLOURS, Table
from rbcourse.sampling import angle_law

ELEVATION, AZIMUTH = np.radians(20), np.radians(-60)
EYE = np.array(
    [
        np.cos(ELEVATION) * np.cos(AZIMUTH),
        np.cos(ELEVATION) * np.sin(AZIMUTH),
        np.sin(ELEVATION),
    ]
)
PALE = "#E9CFDE"  # the colour of what lies behind
_LAWS: dict[str, tuple[str, tuple[float, float], Callable[[Array], Array]]] = {
    "angle": ("angle (rad)", (0, np.pi), angle_law),
    "height of e₁": ("height of the image of e₁", (-1, 1), lambda z: (z + 1) / 2),
    "height of e₃": ("height of the image of e₃", (-1, 1), lambda z: (z + 1) / 2),
}
"""The columns of a histogram: label, range, and their distribution for uniform rotations."""


def image_table(images: Mapping[str, tuple[Array, Array]]) -> Table:
    """Return where rotations carry two vectors as a table: one row for each rotation.

    Parameters
    ----------
    images : mapping of str to (ndarray, ndarray), each of shape (n, 3)
        For each sample of rotations the images of v0 and of v1.

    Returns
    -------
    dict of str to ndarray
    """
    return {
        f"{name} {vector} {axis} [1]": column
        for name, pair in images.items()
        for vector, points in zip(("v0", "v1"), pair, strict=True)
        for axis, column in zip("xyz", points.T, strict=True)
    }


def moving_images(axes: Sequence[Any], data: Table) -> Callable[[int], list[Any]]:
    """Draw spheres; return what marks on them, one by one, where the rotations carry v0 and v1.

    A dot is the image of v0, and the stroke from it ends at the image of v1, so that a turn about
    v0 shows too. What lies behind is pale.

    Parameters
    ----------
    axes : sequence of Axes3D
        Where to draw, one for each sample.
    data : mapping of str to array_like, shape (n,)
        An `image_table`.

    Returns
    -------
    callable
        ``update(i)`` shows the first i of the n rotations and returns the artists that change.

    References
    ----------
    RR 2.2, RR Fig. 4, RR Fig. 5.
    """
    panels = []
    for ax, (name, strokes) in zip(axes, _strokes(data).items(), strict=True):
        draw_sphere(ax)
        ax.plot([0, 0], [0, 0], [1, 1.2], color=COLOURS["z"], lw=2)
        ax.text(0, 0, 1.07, "  z", color=COLOURS["z"])
        ax.set_title(name)
        behind = strokes[:, 0] @ EYE < 0
        colours = np.where(behind, PALE, COLOURS["projection"])
        lines = Line3DCollection(strokes, colors=colours, lw=1.6, zorder=3)
        ax.add_collection3d(lines)
        dots = [
            ax.plot([], [], [], "o", ms=5, mew=0, color=colour, zorder=zorder)[0]
            for colour, zorder in ((PALE, 2), (COLOURS["projection"], 4))
        ]
        panels.append((strokes, behind, colours, lines, dots))

    def update(i: int) -> list[Any]:
        artists = []
        for strokes, behind, colours, lines, (far, near) in panels:
            lines.set_segments(strokes[:i])
            lines.set_color(colours[:i])
            far.set_data_3d(*strokes[:i, 0][behind[:i]].T)
            near.set_data_3d(*strokes[:i, 0][~behind[:i]].T)
            artists += [far, lines, near]
        return artists

    return update


def draw_sphere(ax: Any) -> None:
    """Draw the unit sphere by its meridians and parallels, as `moving_images` looks at it."""
    longitude, latitude = np.mgrid[0 : 2 * np.pi : 61j, 0 : np.pi : 31j]
    across = np.sin(latitude)
    ax.plot_wireframe(
        np.cos(longitude) * across,
        np.sin(longitude) * across,
        np.cos(latitude),
        rstride=5,
        cstride=5,
        color="0.85",
        lw=0.5,
    )
    ax.computed_zorder = False
    ax.view_init(elev=np.degrees(ELEVATION), azim=np.degrees(AZIMUTH))
    ax.set_proj_type("ortho")
    ax.set(xlim=(-1, 1), ylim=(-1, 1), zlim=(-1, 1))
    ax.set_box_aspect((1, 1, 1), zoom=1.4)
    ax.set_axis_off()


def describe_images(data: Table) -> str:
    """Return in words what `moving_images` shows.

    Parameters
    ----------
    data : mapping of str to array_like, shape (n,)
        As for `moving_images`.

    Returns
    -------
    str
    """
    strokes = _strokes(data)
    count = len(next(iter(strokes.values())))
    said = ", ".join(
        f"{name}: {(np.abs(points[:, 0, 2]) < 0.5).sum()}" for name, points in strokes.items()
    )
    return (
        f"The images of the pole of a sphere under {count} random rotations, a stroke at each "
        "image showing how it is turned. How many lie in the middle half of the height, which is "
        f"half of the area: {said}."
    )


def histogram_table(R: Mapping[str, Array]) -> Table:
    """Return what the histograms of samples of rotations show as a table.

    Parameters
    ----------
    R : mapping of str to ndarray, each of shape (n, 3, 3)
        Samples of rotation matrices, with their names.

    Returns
    -------
    dict of str to ndarray
        For the angle and the heights of the images of e₁ and e₃ the edges of 20 bins, and for
        each sample the density in the bin that starts there: numbers over bin width and n. The
        last edge has no bin, and 0.
    """
    table: dict[str, Array] = {}
    for column, (_, (low, high), _) in _LAWS.items():
        unit = "rad" if column == "angle" else "1"
        table[f"{column} [{unit}]"] = edges = np.linspace(low, high, 21)
        for name, matrices in R.items():
            counts, _ = np.histogram(np.clip(_shown(column, matrices), low, high), edges)
            density = counts / (len(matrices) * np.diff(edges))
            table[f"{column}, {name} [1]"] = np.append(density, 0)
    return table


def draw_histograms(axes: Sequence[Axes], data: Table) -> list[Any]:
    """Draw histograms of samples of rotations, and what uniform ones give.

    Parameters
    ----------
    axes : sequence of three Axes
        Where to draw.
    data : mapping of str to array_like, shape (bins + 1,)
        A `histogram_table`, of two samples.

    Returns
    -------
    list of artists

    References
    ----------
    RR 2.
    """
    artists: list[Any] = []
    colours = COLOURS["projection"], COLOURS["z"]
    for ax, (column, (label, limits, law)) in zip(axes, _LAWS.items(), strict=True):
        edges, densities = _bins(data, column)
        for (name, density), colour in zip(densities.items(), colours, strict=True):
            artists.append(ax.stairs(density[:-1], edges, color=colour, lw=2, label=name))
        fine = np.linspace(*limits, 201)
        density = np.diff(law(fine)) / np.diff(fine)
        middle = (fine[:-1] + fine[1:]) / 2
        artists += ax.plot(middle, density, color="black", ls="--", lw=1.5, label="the law")
        ax.set(xlabel=label, xlim=limits, ylim=(0, None))
    axes[0].set_xticks([0, np.pi / 2, np.pi], ["0", "π/2", "π"])
    axes[0].set_ylabel("density")
    axes[0].legend()
    return artists


def describe_histograms(data: Table) -> str:
    """Return in words what `draw_histograms` shows.

    Parameters
    ----------
    data : mapping of str to array_like, shape (bins + 1,)
        As for `draw_histograms`.

    Returns
    -------
    str
    """
    said = []
    for column, (label, _, law) in _LAWS.items():
        edges, densities = _bins(data, column)
        width = np.diff(edges)
        for name, density in densities.items():
            off = np.abs(density[:-1] * width - np.diff(law(edges))).sum() / 2
            said.append(f"{label.split(' (')[0]}, {name}: {100 * off:.0f} %")
    return (
        "Histograms of random rotations beside the law of uniform ones. The share of the draws "
        f"that lies in the wrong bins: {'; '.join(said)}."
    )


def _strokes(data: Table) -> dict[str, Array]:
    """Return the images of v0 and v1, shape (n, 2, 3), for each sample of an `image_table`."""
    names = [key.removesuffix(" v0 x [1]") for key in data if key.endswith(" v0 x [1]")]
    return {
        name: np.array([[data[f"{name} {v} {axis} [1]"] for axis in "xyz"] for v in ("v0", "v1")])
        .transpose(2, 0, 1)
        .astype(float)
        for name in names
    }


def _shown(column: str, R: Array) -> Array:
    if column == "angle":
        return np.arccos(np.clip((np.trace(R, axis1=-2, axis2=-1) - 1) / 2, -1, 1))
    return R[:, 2, 0 if column.endswith("₁") else 2]


def _bins(data: Table, column: str) -> tuple[Array, dict[str, Array]]:
    edges = next(np.asarray(data[key]) for key in data if key.startswith(f"{column} ["))
    densities = {
        key.removeprefix(f"{column}, ").removesuffix(" [1]"): np.asarray(data[key])
        for key in data
        if key.startswith(f"{column}, ")
    }
    return edges, densities
