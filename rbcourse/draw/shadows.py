"""What two repairs make of 2 × 2 matrices: pictures of the plane in which rotations are a circle.

Every 2 × 2 matrix is a turn with a stretch plus a mirror with a stretch. As a map of complex
numbers it takes ζ to z ζ + m ζ*, and z is all that the nearest rotation z/|z| looks at.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import ArrayLike

from rbcourse._numerics import Array
from rbcourse.draw.save import COLOURS, Table
from rbcourse.projection import orthonormalize_gram_schmidt, project_so

_REPAIRS = {"nearest rotation": project_so, "Gram–Schmidt": orthonormalize_gram_schmidt}
_COLOURS = {"nearest rotation": COLOURS["projection"], "Gram–Schmidt": COLOURS["z"]}


def shadow_table(M: Array) -> Table:
    """Return where matrices and what repairs make of them lie in the plane of the turns.

    Parameters
    ----------
    M : ndarray, shape (n, 2, 2)
        Matrices [[a, b], [c, d]] with a positive determinant.

    Returns
    -------
    dict of str to ndarray
        x = (a + d)/2 and y = (c − b)/2 of each matrix, of its nearest rotation, and of what
        Gram–Schmidt makes of it.
    """
    table = {}
    for name, matrices in {"M": M, **{name: fix(M) for name, fix in _REPAIRS.items()}}.items():
        table[f"{name} x [1]"] = (matrices[:, 0, 0] + matrices[:, 1, 1]) / 2
        table[f"{name} y [1]"] = (matrices[:, 1, 0] - matrices[:, 0, 1]) / 2
    return table


def draw_shadows(axes: Sequence[Axes], data: Table) -> list[Any]:
    """Draw matrices in the plane of the turns, and where each of two repairs takes them.

    Parameters
    ----------
    axes : sequence of two Axes
        Where to draw, one for each repair.
    data : mapping of str to array_like, shape (n,)
        A `shadow_table`.

    Returns
    -------
    list of artists
        For each repair the dots, then the lines to the circle.

    References
    ----------
    BK 4, BK Prop. 2.
    """
    artists: list[Any] = []
    circle = np.exp(1j * np.linspace(0, 2 * np.pi, 181))
    start = _points(data, "M")
    for ax, name in zip(axes, _REPAIRS, strict=True):
        ax.plot(circle.real, circle.imag, color="0.6", lw=1)
        artists += ax.plot(*start.T, "o", ms=5, color=_COLOURS[name])
        ways = np.stack([start, _points(data, name)])
        artists += ax.plot(*ways.transpose(2, 0, 1), color=_COLOURS[name], lw=1.5)
        ax.plot(*ways[1].T, "o", ms=4, mfc="white", mec=_COLOURS[name])
        ax.plot(0, 0, "+", color="0.3", ms=9)
        ax.set(aspect="equal", title=name, xlabel="(a + d)/2", xticks=[-1, 0, 1], yticks=[-1, 0, 1])
    axes[0].set_ylabel("(c − b)/2")
    return artists


def describe_shadows(data: Table) -> str:
    """Return in words what `draw_shadows` shows.

    Parameters
    ----------
    data : mapping of str to array_like, shape (n,)
        As for `draw_shadows`.

    Returns
    -------
    str
    """
    start = _complex(data, "M")
    off = np.degrees(np.abs(np.angle(_complex(data, "Gram–Schmidt") / start))).max()
    return (
        f"{len(start)} matrices as dots in a plane in which the rotations are the unit circle, "
        "and lines from each to what a repair makes of it. To the nearest rotation the lines run "
        "along the rays from the origin. With Gram–Schmidt they miss the ray by up to "
        f"{off:.0f} degrees."
    )


def frame_table(M: Array, angles: ArrayLike) -> Table:
    """Return which rotation repairs find when the matrix is measured in a turned body frame.

    Parameters
    ----------
    M : ndarray, shape (2, 2)
        A matrix with a positive determinant.
    angles : array_like, shape (n,)
        By how much the frame is turned, in rad.

    Returns
    -------
    dict of str to ndarray
        The angles, and for each repair the angle of fix(M L) Lᵀ, L the turn of the frame.
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
    """Draw which rotation two repairs find, over the angle of the frame.

    Parameters
    ----------
    ax : Axes
        Where to draw.
    data : mapping of str to array_like, shape (n,)
        A `frame_table`.

    Returns
    -------
    list of Line2D

    References
    ----------
    BK Prop. 3.
    """
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
    """Return in words what `draw_frames` shows.

    Parameters
    ----------
    data : mapping of str to array_like, shape (n,)
        As for `draw_frames`.

    Returns
    -------
    str
    """
    found = {name: np.degrees(np.asarray(data[f"{name} [rad]"])) for name in _REPAIRS}
    ranges = [
        f"{name} finds {angle.min():.1f} to {angle.max():.1f} degrees"
        if np.ptp(angle) > 1e-6
        else f"{name} finds {angle[0]:.1f} degrees in every frame"
        for name, angle in found.items()
    ]
    return f"The rotation found, over the angle of the body frame: {'; '.join(ranges)}."


def _points(data: Table, name: str) -> Array:
    return np.stack([data[f"{name} x [1]"], data[f"{name} y [1]"]], axis=-1)


def _complex(data: Table, name: str) -> Any:
    return _points(data, name) @ [1, 1j]
