"""Lesson 11: de Casteljau's construction in the plane and on SO(3); the symmetries of curves."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rbclassroom.figures import columns
from rbcourse import Array, Curve, angle_between, exp_so3, geodesic, sample_rotation
from rbcourse.draw.save import COLOURS, PALE
from rbcourse.draw.spheres import draw_sphere
from rbcourse.sampling import Rng

_SHARES = np.linspace(0, 1, 33)  # fractions of a leg at which points are drawn
_LOOKS = (PALE, 2), ("0.35", 2), (COLOURS["optimum"], 3)
"""Colour and width of the legs between the points of each level."""
_NAMES = {"plane": ["b_0", "b_1", "b_2", "b_3"], "sphere": ["R_0v", "B_1v", "B_2v", "R_1v"]}


def casteljau_table(
    t: Array, points: ArrayLike, ends: Sequence[ArrayLike], v: ArrayLike
) -> dict[str, Array]:
    """Return the points of all levels of `moving_casteljau`, from the given points to the curve."""
    constructed = {
        f"{name} level {k} point {j}": level[:, j]
        for name, (levels, _) in _constructions(t, points, ends, v).items()
        for k, level in enumerate(levels)
        for j in range(4 - k)
    }
    return {"t [1]": t} | columns("{} {} [1]", constructed)


def moving_casteljau(
    axes: Sequence[Any], t: Array, points: ArrayLike, ends: Sequence[ArrayLike], v: ArrayLike
) -> Callable[[int], list[Any]]:
    """Draw control points and their legs, and return the function that divides the legs.

    The first axes show the construction in the plane, with the four control `points`, shape (4, 2).
    The second axes, in space, show the construction on SO(3). Its control points are those of
    `closed_forms.bezier` for the `ends` R0, R1, w0, w1. Each rotation is shown as the image of v on
    the unit sphere; choose v such that all images are in front.

    ``update(i)`` divides all legs at the fraction t[i] and joins the new points by legs, until a
    single point is left. This point draws the curve. The function returns the artists that move: a
    text and, for each Axes, the legs of two levels, the curve so far, and its last point.
    """
    plane, sphere = axes
    plane.set(aspect="equal", adjustable="datalim", xmargin=0.15)
    plane.set_axis_off()
    draw_sphere(sphere)
    for ax, title in zip(axes, ("in the plane", "on SO(3), images of $v$"), strict=True):
        ax.set_title(title, pad=12, size=16)
    panels = []
    constructions = _constructions(t, points, ends, v)
    for ax, (name, (levels, legs)) in zip(axes, constructions.items(), strict=True):
        lines: list[Any] = []
        for k, (leg, (colour, width)) in enumerate(zip(legs, _LOOKS, strict=True)):
            style: Any = {"color": colour, "lw": width, "ms": 8, "zorder": 3 + k}
            corners = [*range(0, leg.shape[1], len(_SHARES)), leg.shape[1] - 1]
            lines += ax.plot(*leg[0].T, "o-", markevery=corners, **style)
        given = levels[0][0]
        outward = given - given.mean(axis=0)
        outward *= 0.15 * np.ptp(given) / np.linalg.norm(outward, axis=-1, keepdims=True)
        for word, place in zip(_NAMES[name], given + outward, strict=True):
            ax.text(*place, f"${word}$", ha="center", va="center", zorder=9, fontsize=16)
        lines += ax.plot(*levels[3][0].T, color=COLOURS["z"], lw=4, zorder=7)
        lines += ax.plot(*levels[3][0].T, "o", color=COLOURS["optimum"], ms=12, zorder=8)
        panels.append((levels[3][:, 0], legs[1:], lines[1:]))
    clock = plane.text(0.02, 0.02, "", transform=plane.transAxes, fontsize=16)

    def update(i: int) -> list[Any]:
        clock.set_text(f"$t = {t[i]:.2f}$")
        for drawn, legs, artists in panels:
            shown = *(leg[i] for leg in legs), drawn[: i + 1], drawn[i : i + 1]
            for artist, places in zip(artists, shown, strict=True):
                flat = places.shape[-1] == 2
                (artist.set_data if flat else artist.set_data_3d)(*places.T)
        return [clock, *(artist for *_, artists in panels for artist in artists)]

    return update


def describe_casteljau(ends: Sequence[ArrayLike]) -> str:
    """Return a description of the picture of `moving_casteljau`."""
    B = _controls(ends)
    legs = ", ".join(f"{x:.0f}" for x in np.degrees(angle_between(B[:-1], B[1:])))
    return (
        "De Casteljau's construction of a cubic, which divides legs in the ratio t: straight legs "
        "in the plane (left), and geodesics on SO(3) (right). Four control points have three legs; "
        "the points that divide these have two, the points that divide those have one, and the "
        "point that divides it draws the curve. On SO(3) the rotations are shown by the images of "
        "a vector v on the unit sphere; B₁ is R₀ exp(ω₀/3), and B₂ is R₁ exp(−ω₁/3). From one "
        f"control rotation to the next are {legs} degrees."
    )


def _controls(ends: Sequence[ArrayLike]) -> Array:
    R0, R1, w0, w1 = (np.asarray(x, float) for x in ends)
    return np.stack([R0, R0 @ exp_so3(w0 / 3), R1 @ exp_so3(-w1 / 3), R1])


def _constructions(
    t: Array, points: ArrayLike, ends: Sequence[ArrayLike], v: ArrayLike
) -> dict[str, tuple[list[Array], list[Array]]]:
    """Return the levels and legs of `_construct` in the plane and on the sphere."""
    plane = _construct(t, np.asarray(points), lambda a, b, t: a + t[:, None, None] * (b - a))
    levels, legs = _construct(t, _controls(ends), _on_geodesic)
    v = np.asarray(v)
    return {"plane": plane, "sphere": ([R @ v for R in levels], [R @ v for R in legs])}


def _construct(
    t: Array, points: Array, between: Callable[[Array, Array, Array], Array]
) -> tuple[list[Array], list[Array]]:
    """Return the points of each level, shape (times, 4 − k, ...), and the legs between them."""
    levels, legs = [np.broadcast_to(points, t.shape + points.shape)], []
    while levels[-1].shape[1] > 1:
        first, last = levels[-1][:, :-1], levels[-1][:, 1:]
        all_along = [between(first, last, np.full_like(t, s)) for s in _SHARES]
        legs.append(np.stack(all_along, axis=2).reshape(len(t), -1, *points.shape[1:]))
        levels.append(between(first, last, t))
    return levels, legs


def _on_geodesic(first: Array, last: Array, t: Array) -> Array:
    return geodesic(first, last).at_own_times(np.tile(t[:, None], first.shape[1]))


def defects(
    make: Callable[..., Curve], ends: tuple[Array, Array, Array, Array], *, rng: Rng = None
) -> dict[str, float]:
    """Return how far curves are from being invariant when their ends are moved or exchanged.

    The values are the largest angles in rad over all problems at 33 values of t, for random
    rotations L and Q (BK Prop. 3). "left" compares L R(t) with the curve of the ends moved by L,
    "right" compares R(t) Q with the curve of the ends moved by Q, and "reversed" compares R(1 − t)
    with the curve of the exchanged ends.
    """
    R0, R1, w0, w1 = ends
    L, Q = sample_rotation(2, rng=rng)
    t = np.linspace(0, 1, 33)
    R = make(*ends)(t)
    pairs = {
        "left": (L @ R, make(L @ R0, L @ R1, w0, w1)),
        "right": (R @ Q, make(R0 @ Q, R1 @ Q, w0 @ Q, w1 @ Q)),
        "reversed": (R[::-1], make(R1, R0, -w1, -w0)),
    }
    return {name: float(angle_between(A, curve(t)).max()) for name, (A, curve) in pairs.items()}
