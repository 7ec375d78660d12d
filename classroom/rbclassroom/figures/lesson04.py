"""Matrices that should be rotations: how they drift, and where repairs take them (lesson 04).

A 2 × 2 matrix is a turn with a stretch plus a mirror with a stretch. As a map of complex numbers it
takes ζ to ``z ζ + m ζ*``, and the nearest rotation, ``z/|z|``, depends on z alone: the `shadows`
are these z, and the rotations are the unit circle.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle
from numpy.typing import ArrayLike

from rbcourse import Array, orthonormalize_gram_schmidt, project_so
from rbcourse.draw.save import COLOURS, Table

Repair = Callable[[Array], Array]

_REPAIRS = {"nearest rotation": project_so, "Gram–Schmidt": orthonormalize_gram_schmidt}
_COLOURS = {"nearest rotation": COLOURS["projection"], "Gram–Schmidt": COLOURS["z"]}


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


def column_table(matrices: Mapping[str, Array]) -> Table:
    """Return x and y of the two columns of each 2 × 2 matrix, a row for each column, as a table."""
    return {
        f"{name} {axis} [1]": row
        for name, M in matrices.items()
        for axis, row in zip("xy", M, strict=True)
    }


def draw_columns(axes: Sequence[Axes], matrices: Mapping[str, Array]) -> list[Any]:
    """Draw the columns of 2 × 2 matrices as arrows, each matrix on its own axes.

    The first matrix is the given one. Its arrows are repeated in grey behind those of the others,
    and a dotted line joins each tip with its grey one. The titles say what the two lines come to,
    the root of the sum of their squares: the Frobenius distance (BK Prop. 2, RR 1.4).
    """
    given, *others = matrices.values()
    edge = 1.1 * max(1.0, *(np.hypot(*M).max() for M in matrices.values()))
    artists = [_draw_arrows(axes[0], given, [COLOURS["x"], COLOURS["y"]])]
    for ax, M in zip(axes[1:], others, strict=True):
        artists.append(_draw_arrows(ax, given, ["0.7"]))
        artists.append(_draw_arrows(ax, M, [COLOURS["x"], COLOURS["y"]]))
        artists += ax.plot(*np.stack([given, M], axis=1), color="black", ls=":", zorder=4)
    for ax, (name, M) in zip(axes, matrices.items(), strict=True):
        ax.add_patch(Circle((0, 0), 1, fill=False, color="0.8", lw=1))
        missed = "" if M is given else f", misses {np.linalg.norm(M - given):.2f}"
        ax.set(aspect="equal", title=f"{name}\n{_sense(M)}{missed}", xlabel="x")
        ax.set(xlim=(-edge, edge), ylim=(-edge, edge), xticks=[-1, 0, 1], yticks=[-1, 0, 1])
    axes[0].set_ylabel("y")
    (x, y), second = given.T[0] / 2, given.T[1]
    axes[0].text(x, y, "first", color=COLOURS["x"], ha="right", va="bottom")
    axes[0].text(second[0], second[1], " second", color=COLOURS["y"], va="top")
    return artists


def describe_columns(matrices: Mapping[str, Array]) -> str:
    """Return in words what `draw_columns` shows."""
    (first, given), *others = matrices.items()
    said = [f"{name} {_sense(M)}, {np.linalg.norm(M - given):.2f} away" for name, M in others]
    return (
        f"The columns of {first} as arrows, the first orange, the second green; then those of "
        f"{', '.join(matrices).removeprefix(f'{first}, ')}, with {first}'s behind in grey. "
        f"{first} {_sense(given)}. {'; '.join(said)}, by the root of the sum of the squares of "
        "the two dotted lines from tip to tip."
    )


def _draw_arrows(ax: Axes, M: Array, colours: Sequence[str]) -> Any:
    style: Any = {"angles": "xy", "scale_units": "xy", "scale": 1, "width": 0.025, "zorder": 3}
    return ax.quiver([0, 0], [0, 0], *M, color=colours, **style)


def _sense(M: Array) -> str:
    """Tell what a matrix does: one that mirrors has its second column to the right of the first."""
    return "turns" if np.linalg.det(M) > 0 else "mirrors"


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
    return (
        "The angle of the rotation that two repairs find, over the angle by which the body frame "
        f"is turned. Of the two, {'; '.join(ranges)}."
    )
