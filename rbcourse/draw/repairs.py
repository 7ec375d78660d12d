"""Matrices that should be rotations: how they drift, and what a repair makes of them."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from rbcourse._numerics import Array
from rbcourse.draw.save import COLOURS, Table

Repair = Callable[[Array], Array]

_LETTER = np.array(
    [
        *([0, 0], [0.2, 0], [0.2, 0.4], [0.5, 0.4], [0.5, 0.6], [0.2, 0.6], [0.2, 0.8]),
        *([0.6, 0.8], [0.6, 1], [0, 1], [0, 0]),
    ]
)
"""The outline of an F, which no turn makes of its mirror image."""


def drift_table(steps: int, ways: Mapping[str, tuple[Array, Repair | None]]) -> Table:
    """Multiply a matrix again and again in single precision, and return how it leaves SO(3).

    Parameters
    ----------
    steps : int
        How many products, at least 100.
    ways : mapping of str to (ndarray of shape (3, 3), callable or None)
        For each way the factor, and what repairs the matrix after every 100 products.

    Returns
    -------
    dict of str to ndarray
        At up to 60 numbers of steps, evenly spread over the powers of ten, beyond 100 multiples of
        it, the defect ‖RᵀR − I‖ of each way, before the repair.

    References
    ----------
    RR 1.4.
    """
    counts = np.unique(np.geomspace(1, steps, 60).round().astype(int))
    counts = np.unique(np.where(counts > 100, counts // 100 * 100, counts))
    table: dict[str, Array] = {"steps [1]": counts.astype(float)}
    for name, (factor, repair) in ways.items():
        table[f"{name} [1]"] = _defects(counts, factor.astype(np.float32), repair)
    return table


def _defects(counts: Array, factor: Array, repair: Repair | None) -> Array:
    """Return the defects; products entry by entry, because libraries round them differently."""
    R: Array = np.eye(3, dtype=np.float32)
    defects, wanted = [], set(counts.tolist())
    for count in range(1, int(counts[-1]) + 1):
        R = R[:, :1] * factor[0] + R[:, 1:2] * factor[1] + R[:, 2:] * factor[2]
        if count in wanted:
            exact = R.astype(np.float64)
            defects.append(np.linalg.norm(exact.T @ exact - np.eye(3)))
        if repair and count % 100 == 0:
            R = repair(R).astype(np.float32)
    return np.array(defects)


def draw_drift(ax: Axes, data: Table) -> list[Any]:
    """Draw how matrices leave the rotations as they are multiplied.

    Parameters
    ----------
    ax : Axes
        Where to draw.
    data : mapping of str to array_like
        A `drift_table` of three ways.

    Returns
    -------
    list of Line2D
    """
    (_, steps), *ways = ((name, np.asarray(column)) for name, column in data.items())
    looks = [(COLOURS["z"], "-"), (COLOURS["x"], "-."), (COLOURS["y"], "--")]
    lines = [
        ax.loglog(steps, defect, color=colour, ls=dash, label=name.removesuffix(" [1]"))[0]
        for (name, defect), (colour, dash) in zip(ways, looks, strict=True)
    ]
    ax.set(xlabel="products", ylabel="defect ‖RᵀR − I‖", xlim=(1, steps[-1]))
    ax.legend()
    return lines


def describe_drift(data: Table) -> str:
    """Return in words what `draw_drift` shows.

    Parameters
    ----------
    data : mapping of str to array_like
        As for `draw_drift`.

    Returns
    -------
    str
    """
    steps = np.asarray(data["steps [1]"])
    said = [
        f"{name.removesuffix(' [1]')}: {np.asarray(column)[-1]:.0e}"
        for name, column in data.items()
        if name != "steps [1]"
    ]
    return (
        "The defect of matrices that are multiplied again and again, over the number of products, "
        f"both axes logarithmic. After {steps[-1]:.0f} products it is, {'; '.join(said)}."
    )


def letter_table(matrices: Mapping[str, Array]) -> Table:
    """Return what matrices make of the outline of a letter F as a table.

    Parameters
    ----------
    matrices : mapping of str to ndarray of shape (2, 2)
        With their names.

    Returns
    -------
    dict of str to ndarray
        x and y of the letter, then of each image.
    """
    table = {"x [1]": _LETTER[:, 0], "y [1]": _LETTER[:, 1]}
    for name, M in matrices.items():
        x, y = M @ _LETTER.T
        table |= {f"{name} x [1]": x, f"{name} y [1]": y}
    return table


def draw_letters(axes: Sequence[Axes], data: Table) -> list[Any]:
    """Draw a letter, and what matrices make of it, each on its own axes.

    The first matrix is the given one; its image is repeated behind the others, whose titles say how
    far their matrix is from it.

    Parameters
    ----------
    axes : sequence of Axes
        Where to draw.
    data : mapping of str to array_like
        A `letter_table` of as many matrices.

    Returns
    -------
    list of artists

    References
    ----------
    BK Prop. 2, RR 1.4.
    """
    images = _images(data)
    artists: list[Any] = []
    for k, (ax, (name, image)) in enumerate(zip(axes, images.items(), strict=True)):
        behind = images[next(iter(images))] if k else _LETTER
        artists += ax.fill(*behind.T, color="0.88")
        colour = COLOURS["y"] if _turned(image) else COLOURS["x"]
        artists += ax.fill(*image.T, fill=False, edgecolor=colour, lw=2)
        title = f"{name}\ndistance {_distance(image, images):.2f}" if k else name
        ax.set(aspect="equal", title=title, xlabel="x")
    axes[0].set_ylabel("y")
    return artists


def describe_letters(data: Table) -> str:
    """Return in words what `draw_letters` shows.

    Parameters
    ----------
    data : mapping of str to array_like
        As for `draw_letters`.

    Returns
    -------
    str
    """
    images = _images(data)
    (first, given), *others = images.items()
    said = [
        f"{name}: a {'turned' if _turned(image) else 'mirrored'} letter, at the distance "
        f"{_distance(image, images):.2f} from {first}"
        for name, image in others
    ]
    what = "turned" if _turned(given) else "mirrored"
    return (
        f"A letter F; {first} makes a {what} and distorted one of it. Beside it: {'; '.join(said)}."
    )


def _images(data: Table) -> dict[str, Array]:
    names = [key.removesuffix(" x [1]") for key in data if key.endswith(" x [1]")]
    return {
        name: np.stack([data[f"{name} x [1]"], data[f"{name} y [1]"]], axis=-1) for name in names
    }


def _distance(image: Array, images: dict[str, Array]) -> float:
    """Return the Frobenius distance of the matrix of an image to that of the first image."""
    apart = np.linalg.lstsq(_LETTER, image - next(iter(images.values())))[0]
    return float(np.linalg.norm(apart))


def _turned(image: Array) -> bool:
    """Tell whether the outline still runs round the letter the same way."""
    x, y = image.T
    ox, oy = _LETTER.T
    area, before = (np.sum(a[:-1] * b[1:] - a[1:] * b[:-1]) for a, b in ((x, y), (ox, oy)))
    return bool(area * before > 0)
