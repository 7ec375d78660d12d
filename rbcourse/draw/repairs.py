"""Matrices that should be rotations: how they drift, and where repairs take them (lesson 04).

A 2 × 2 matrix is a turn with a stretch plus a mirror with a stretch. As a map of complex numbers it
takes ζ to z ζ + m ζ*, and the nearest rotation, z/|z|, depends on z alone: the `shadows` are these
z, and the rotations are the unit circle.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import ArrayLike

from rbcourse._numerics import Array
from rbcourse.draw.save import COLOURS, Table
from rbcourse.projection import orthonormalize_gram_schmidt, project_so

Repair = Callable[[Array], Array]

_REPAIRS = {"nearest rotation": project_so, "Gram–Schmidt": orthonormalize_gram_schmidt}
_COLOURS = {"nearest rotation": COLOURS["projection"], "Gram–Schmidt": COLOURS["z"]}
_LETTER = np.array(
    [
        *([0, 0], [0.2, 0], [0.2, 0.4], [0.5, 0.4], [0.5, 0.6], [0.2, 0.6], [0.2, 0.8]),
        *([0.6, 0.8], [0.6, 1], [0, 1], [0, 0]),
    ]
)
"""The outline of an F, which no turn makes of its mirror image."""


def drift_table(steps: int, ways: Mapping[str, tuple[Array, Repair | None]]) -> Table:
    """Multiply a matrix again and again in single precision, and return how it leaves SO(3).

    `ways` gives for each name the factor, shape (3, 3), and what repairs the matrix after every
    100 products. The table has the defect ‖RᵀR − I‖ of each way, before the repair, at up to 60
    numbers of steps, evenly spread over the powers of ten, beyond 100 multiples of it (RR 1.4).
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
    """Draw how matrices leave the rotations as they are multiplied."""
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
    """Return in words what `draw_drift` shows."""
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


def letters(matrices: Mapping[str, Array]) -> dict[str, Array]:
    """Return the images of the outline of a letter F, shape (points, 2), under 2 × 2 matrices."""
    return {name: (M @ _LETTER.T).T for name, M in matrices.items()}


def letter_table(images: Mapping[str, Array]) -> Table:
    """Return x and y of the letter, then of each of its `letters`, as a table."""
    table = {"x [1]": _LETTER[:, 0], "y [1]": _LETTER[:, 1]}
    for name, image in images.items():
        table |= {f"{name} x [1]": image[:, 0], f"{name} y [1]": image[:, 1]}
    return table


def draw_letters(axes: Sequence[Axes], images: Mapping[str, Array]) -> list[Any]:
    """Draw the images of a letter under matrices, each on its own axes.

    The first matrix is the given one; its image is repeated behind the others, whose titles say how
    far their matrix is from it (BK Prop. 2, RR 1.4).
    """
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


def describe_letters(images: Mapping[str, Array]) -> str:
    """Return in words what `draw_letters` shows."""
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


def _distance(image: Array, images: Mapping[str, Array]) -> float:
    """Return the Frobenius distance of the matrix of an image to that of the first image."""
    apart = np.linalg.lstsq(_LETTER, image - next(iter(images.values())))[0]
    return float(np.linalg.norm(apart))


def _turned(image: Array) -> bool:
    """Tell whether the outline still runs round the letter the same way."""
    x, y = image.T
    ox, oy = _LETTER.T
    area, before = (np.sum(a[:-1] * b[1:] - a[1:] * b[:-1]) for a, b in ((x, y), (ox, oy)))
    return bool(area * before > 0)


def shadows(M: Array) -> dict[str, Array]:
    """Return the shadows of matrices "M" and of what repairs make of them, each of shape (n, 2).

    M are matrices [[a, b], [c, d]], shape (n, 2, 2), with a positive determinant; the shadow is
    x = (a + d)/2, y = (c − b)/2.
    """
    matrices = {"M": M, **{name: fix(M) for name, fix in _REPAIRS.items()}}
    return {
        name: np.stack([A[:, 0, 0] + A[:, 1, 1], A[:, 1, 0] - A[:, 0, 1]], axis=-1) / 2
        for name, A in matrices.items()
    }


def shadow_table(points: Mapping[str, Array]) -> Table:
    """Return `shadows` as a table."""
    return {
        f"{name} {axis} [1]": column
        for name, places in points.items()
        for axis, column in zip("xy", places.T, strict=True)
    }


def draw_shadows(axes: Sequence[Axes], points: Mapping[str, Array]) -> list[Any]:
    """Draw the `shadows` of matrices, and where each of the two repairs takes them, on its axes.

    Return for each repair the dots, then the lines to the circle (BK 4, BK Prop. 2).
    """
    artists: list[Any] = []
    circle = np.exp(1j * np.linspace(0, 2 * np.pi, 181))
    start = points["M"]
    for ax, name in zip(axes, _REPAIRS, strict=True):
        ax.plot(circle.real, circle.imag, color="0.6", lw=1)
        artists += ax.plot(*start.T, "o", ms=5, color=_COLOURS[name])
        ways = np.stack([start, points[name]])
        artists += ax.plot(*ways.transpose(2, 0, 1), color=_COLOURS[name], lw=1.5)
        ax.plot(*ways[1].T, "o", ms=4, mfc="white", mec=_COLOURS[name])
        ax.plot(0, 0, "+", color="0.3", ms=9)
        ax.set(aspect="equal", title=name, xlabel="(a + d)/2", xticks=[-1, 0, 1], yticks=[-1, 0, 1])
    axes[0].set_ylabel("(c − b)/2")
    return artists


def describe_shadows(points: Mapping[str, Array]) -> str:
    """Return in words what `draw_shadows` shows."""
    start, found = (points[name] @ [1, 1j] for name in ("M", "Gram–Schmidt"))
    off = np.degrees(np.abs(np.angle(found / start))).max()
    return (
        f"{len(start)} matrices as dots in a plane in which the rotations are the unit circle, "
        "and lines from each to what a repair makes of it. To the nearest rotation the lines run "
        "along the rays from the origin. With Gram–Schmidt they miss the ray by up to "
        f"{off:.0f} degrees."
    )


def frame_table(M: Array, angles: ArrayLike) -> Table:
    """Return which rotation repairs find when a 2 × 2 matrix is measured in a turned body frame.

    For each angle of the frame in rad, and each repair, it is the angle of fix(M L) Lᵀ, L the turn
    of the frame. M has a positive determinant.
    """
    angles = np.asarray(angles, dtype=np.float64)
    cos, sin = np.cos(angles), np.sin(angles)
    L = np.stack([cos, -sin, sin, cos], axis=-1).reshape(-1, 2, 2)
    table = {"frame [rad]": angles}
    for name, fix in _REPAIRS.items():
        R = fix(M @ L) @ np.swapaxes(L, -1, -2)
        table[f"{name} [rad]"] = np.unwrap(np.arctan2(R[:, 1, 0], R[:, 0, 0]))
    return table


def draw_frames(ax: Axes, data: Table) -> list[Any]:
    """Draw which rotation two repairs find, over the angle of the frame (BK Prop. 3)."""
    frame = np.degrees(data["frame [rad]"])
    lines = [
        ax.plot(frame, np.degrees(data[f"{name} [rad]"]), color=_COLOURS[name], ls=dash, label=name)
        for name, dash in zip(_REPAIRS, ("-", "--"), strict=True)
    ]
    ax.set(xlabel="the body frame is turned by (°)", ylabel="rotation found (°)")
    ax.set(xlim=(frame[0], frame[-1]), xticks=np.arange(frame[0], frame[-1] + 1, 45))
    ax.legend(loc="center left", bbox_to_anchor=(1, 0.5))
    return [line for (line,) in lines]


def describe_frames(data: Table) -> str:
    """Return in words what `draw_frames` shows."""
    found = {name: np.degrees(np.asarray(data[f"{name} [rad]"])) for name in _REPAIRS}
    ranges = [
        f"{name} finds {angle.min():.1f} to {angle.max():.1f} degrees"
        if np.ptp(angle) > 1e-6
        else f"{name} finds {angle[0]:.1f} degrees in every frame"
        for name, angle in found.items()
    ]
    return f"The rotation found, over the angle of the body frame: {'; '.join(ranges)}."
