"""Lesson 4: the drift of matrices that should be rotations, and their repair.

A 2 × 2 matrix is a multiple of a turn plus a multiple of a reflection. As a map of complex numbers
it takes ζ to ``z ζ + m ζ*``, and the nearest rotation, ``z/|z|``, depends only on z. The function
`shadows` returns z; for rotations, z is on the unit circle.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle
from numpy.typing import ArrayLike

from rbclassroom.figures import columns, name_lines, named
from rbcourse import Array
from rbcourse.draw.save import COLOURS, PALE, Table
from rbcourse.projection import orthonormalize_gram_schmidt, project_so

Repair = Callable[[Array], Array]

_REPAIRS = {"nearest rotation": project_so, "Gram–Schmidt": orthonormalize_gram_schmidt}
_COLOURS = {"nearest rotation": COLOURS["projection"], "Gram–Schmidt": COLOURS["z"]}
_FORMULAS = {"M": "$M$", "U Vᵀ": r"$U V^{\!\top}$"}


def drift_table(steps: int, ways: Mapping[str, tuple[Array, Repair | None]]) -> Table:
    """Multiply a matrix repeatedly in single precision, and return its distance from SO(3).

    For each name, `ways` has the factor, shape (3, 3), and a function or None. The function repairs
    the matrix after every 100 products. For each name, the table has the defect ‖RᵀR − I‖ before
    the repair. Each row is for one number of products. There are up to 60 rows, equally spaced on
    a logarithmic scale; numbers above 100 are multiples of 100 (RR 1.4).
    """
    counts = np.unique(np.geomspace(1, steps, 60).round().astype(int))
    counts = np.unique(np.where(counts > 100, counts // 100 * 100, counts))
    table: dict[str, Array] = {"steps [1]": counts.astype(float)}
    wanted = set(counts.tolist())
    for name, (factor, repair) in ways.items():
        R, defects = np.eye(3, dtype=np.float32), []
        x, y, z = factor.astype(np.float32)
        for count in range(1, int(counts[-1]) + 1):
            R = R[:, :1] * x + R[:, 1:2] * y + R[:, 2:] * z  # library products round differently
            if count in wanted:
                exact = R.astype(np.float64)
                defects.append(np.linalg.norm(exact.T @ exact - np.eye(3)))
            if repair and count % 100 == 0:
                R = repair(R).astype(np.float32)
        table[f"{name} [1]"] = np.array(defects)
    return table


def draw_drift(ax: Axes, data: Table) -> None:
    """Draw the defects of a `drift_table` against the number of products."""
    (_, steps), *ways = named(" [1]", data).items()
    looks = [("optimum", "-"), ("reference", "-."), ("projection", "--")]
    names = [name.replace("I + hω̂", r"$I + h\hat{\omega}$") for name, _ in ways]
    for name, (_, defect), (look, dash) in zip(names, ways, looks, strict=True):
        ax.loglog(steps, defect, color=COLOURS[look], ls=dash, label=name)
    ax.set(xlabel="products", ylabel=r"defect $\Vert R^{\!\!\top}\!R - I\Vert$")
    ax.set(xlim=(1, steps[-1]), xticks=[1, 1e2, 1e4], yticks=[1e-6, 1e-3, 1, 1e3])
    places = (1.5e4, 6e-3), (60, 0.5), (2e3, 3e-7)
    name_lines(ax, dict(zip(names, places, strict=True)))


def column_table(matrices: Mapping[str, Array]) -> Table:
    """Return a table of the columns of 2 × 2 matrices; each row has one column of each matrix."""
    return columns("{} {} [1]", {name: M.T for name, M in matrices.items()})


def draw_columns(axes: Sequence[Axes], matrices: Mapping[str, Array]) -> None:
    """Draw the columns of 2 × 2 matrices as arrows, each matrix on its own axes.

    The first matrix is the original. Its arrows are repeated in grey behind those of the other
    matrices, and a dotted line joins the two tips of each column. The titles state the Frobenius
    distance, which is √(a² + b²) for lines of lengths a and b (BK Prop. 2, RR 1.4).
    """
    given = next(iter(matrices.values()))
    edge = 1.1 * max(1.0, *(np.hypot(*M).max() for M in matrices.values()))
    style: Any = {"angles": "xy", "scale_units": "xy", "scale": 1, "width": 0.025, "zorder": 3}
    for ax, (name, M) in zip(axes, matrices.items(), strict=True):
        title = f"{_FORMULAS.get(name, name)}\n{_sense(M)}"
        if M is not given:
            ax.quiver([0, 0], [0, 0], *given, color=PALE, **style)
            ax.plot(*np.stack([given, M], axis=1), color="black", ls=":", zorder=4)
            title += f", misses {np.linalg.norm(M - given):.2f}"
        ax.quiver([0, 0], [0, 0], *M, color=[COLOURS["x"], COLOURS["y"]], **style)
        ax.add_patch(Circle((0, 0), 1, fill=False, color=PALE, lw=1))
        ax.set(aspect="equal", title=title, xlabel="$x$", xticks=[-1, 0, 1], yticks=[-1, 0, 1])
        ax.set(xlim=(-edge, edge), ylim=(-edge, edge))
    axes[0].set_ylabel("$y$")
    (x, second_x), (y, second_y) = given
    axes[0].text(x / 2, y / 2, "first", color=COLOURS["x"], ha="right", va="bottom")
    axes[0].text(second_x, second_y, "second  ", color=COLOURS["y"], ha="right", va="center")


def describe_columns(matrices: Mapping[str, Array]) -> str:
    """Return a description of the picture of `draw_columns`."""
    (first, given), *others = matrices.items()
    said = [f"{name} {_sense(M)}, {np.linalg.norm(M - given):.2f} away" for name, M in others]
    return (
        f"The columns of {first} as arrows, the first orange, the second green; then those of "
        f"{', '.join(name for name, _ in others)}, with {first}'s behind in grey. "
        f"{first} {_sense(given)}. {'; '.join(said)}, by the root of the sum of the squares of "
        "the two dotted lines from tip to tip."
    )


def _sense(M: Array) -> str:
    return "turns" if np.linalg.det(M) > 0 else "mirrors"


def shadows(M: Array) -> dict[str, Array]:
    """Return the shadows of matrices "M" and of their repairs, each of shape (n, 2), by name.

    M contains matrices [[a, b], [c, d]], shape (n, 2, 2), with a positive determinant. The shadow
    of a matrix is the point x = (a + d)/2, y = (c − b)/2.
    """
    return {
        name: np.stack([A[:, 0, 0] + A[:, 1, 1], A[:, 1, 0] - A[:, 0, 1]], axis=-1) / 2
        for name, A in {"M": M, **{name: fix(M) for name, fix in _REPAIRS.items()}}.items()
    }


def shadow_table(points: Mapping[str, Array]) -> Table:
    """Return `shadows` as a table."""
    return columns("{} {} [1]", points)


def draw_shadows(axes: Sequence[Axes], points: Mapping[str, Array]) -> None:
    """Draw the `shadows` of matrices and of the repaired matrices, each repair on its own axes.

    Lines lead from the given to the repaired matrices (BK 4, BK Prop. 2).
    """
    circle = np.exp(1j * np.linspace(0, 2 * np.pi, 181))
    for ax, (name, colour) in zip(axes, _COLOURS.items(), strict=True):
        ways = np.stack([points["M"], points[name]])
        ax.plot(circle.real, circle.imag, color=PALE, lw=1)
        ax.plot(*ways[0].T, "o", ms=5, color=colour)
        ax.plot(*ways.transpose(2, 0, 1), color=colour, lw=1.5)
        ax.plot(*ways[1].T, "o", ms=4, mfc="white", mec=colour)
        ax.plot(0, 0, "+", color="0.3", ms=9)
        ax.set(aspect="equal", title=name, xlabel="$(a + d)/2$")
        ax.set(xticks=[-1, 0, 1], yticks=[-1, 0, 1])
    axes[0].set_ylabel("$(c - b)/2$")


def describe_shadows(points: Mapping[str, Array]) -> str:
    """Return a description of the picture of `draw_shadows`."""
    start, found = (points[name] @ [1, 1j] for name in ("M", "Gram–Schmidt"))
    off = np.degrees(np.abs(np.angle(found / start))).max()
    return (
        f"Repairs of {len(start)} matrices: a line leads from each matrix to a rotation, which is "
        "on the unit circle. To the nearest rotation the lines run along the rays from the origin. "
        f"With Gram–Schmidt they miss the ray by up to {off:.0f} degrees."
    )


def frame_table(M: Array, angles: ArrayLike) -> Table:
    """Return the rotations that repairs find if a 2 × 2 matrix is measured in a turned body frame.

    L is the turn of the frame. For each angle of L in rad and each repair ``fix``, the table has
    the angle of the rotation fix(M L) Lᵀ. M has a positive determinant.
    """
    angles = np.asarray(angles, dtype=np.float64)
    cos, sin = np.cos(angles), np.sin(angles)
    L = np.stack([cos, -sin, sin, cos], axis=-1).reshape(-1, 2, 2)
    table = {"frame [rad]": angles}
    for name, fix in _REPAIRS.items():
        R = fix(M @ L) @ np.swapaxes(L, -1, -2)
        table[f"{name} [rad]"] = np.unwrap(np.arctan2(R[:, 1, 0], R[:, 0, 0]))
    return table


def draw_frames(ax: Axes, data: Table) -> None:
    """Draw the angles of a `frame_table` against the angle of the frame (BK Prop. 3)."""
    (_, frame), *found = named(" [rad]", data).items()
    frame = np.degrees(frame)
    for (name, angle), dash in zip(found, ("-", "--"), strict=True):
        ax.plot(frame, np.degrees(angle), color=_COLOURS[name], ls=dash, label=name)
    ax.set(xlabel="the body frame is turned by (°)", ylabel="rotation found (°)")
    ax.set(xlim=(frame[0], frame[-1]), xticks=np.arange(frame[0], frame[-1] + 1, 90))
    name_lines(ax, {"nearest rotation": (155, 15), "Gram–Schmidt": (236, 28)})
