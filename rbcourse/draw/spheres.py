"""Drawings of random rotations on the unit sphere."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from rbcourse import Array
from rbcourse.draw.save import COLOURS, Table
from rbcourse.draw.scene import OVER
from rbcourse.draw.space import Ball

Images = Mapping[str, tuple[Array, Array]]
"""The images of v0 and of v1, both of shape (n, 3), for each sample of n rotations."""

ELEVATION, AZIMUTH = np.radians(20), np.radians(-60)


def draw_sphere(ax: Any) -> None:
    """Draw the unit sphere with meridians and parallels; artists on the far side look pale."""
    turn = np.linspace(0, 2 * np.pi, 49)
    thin: Any = {"color": "0.7", "lw": 0.5, "zorder": 0}
    ax.add_artist(Ball())
    for longitude in np.radians(np.arange(0, 180, 30)):
        across = np.outer([np.cos(longitude), np.sin(longitude)], np.sin(turn))
        ax.plot(*across, np.cos(turn), **thin)
    for height in np.sin(np.radians(np.arange(-60, 90, 30))):
        ax.plot(*np.sqrt(1 - height**2) * np.array([np.cos(turn), np.sin(turn)]), height, **thin)
    ax.fit(-np.ones(3), np.ones(3), zoom=1.4)
    ax.view_init(elev=np.degrees(ELEVATION), azim=np.degrees(AZIMUTH))


def image_table(images: Images) -> Table:
    """Return a table of the images of two vectors, with one row per rotation."""
    return {
        f"{name} {vector} {axis} [1]": column
        for name, pair in images.items()
        for vector, points in zip(("v0", "v1"), pair, strict=True)
        for axis, column in zip("xyz", points.T, strict=True)
    }


def moving_images(axes: Sequence[Any], images: Images) -> Callable[[int], list[Any]]:
    """Draw one sphere per sample; return a function that draws images of v0 and v1 on the spheres.

    A dot is the image of v0. The stroke from the dot ends at the image of v1, so that a turn about
    v0 is visible, too. The samples are pink and blue in turn. ``update(i)`` shows the first i
    rotations and returns the artists that change (RR 2.2, RR Fig. 4, RR Fig. 5).
    """
    panels = []
    for k, (ax, (name, pair)) in enumerate(zip(axes, images.items(), strict=True)):
        draw_sphere(ax)
        for axis, direction in zip("xyz", np.eye(3), strict=True):
            ax.plot(*np.outer(direction, [1, 1.2]), color=COLOURS[axis], lw=2)
            place, look = 1.18 * direction, {"color": COLOURS[axis], "va": "center"}
            ax.text(*place, f"  ${axis}$", zorder=OVER, **look)
        ax.set_title(name)
        colour = COLOURS["z" if k % 2 else "projection"]
        gaps = np.full_like(pair[0], np.nan)  # between successive strokes
        strokes = np.stack([*pair, gaps], axis=1)
        lines = ax.plot([], [], [], color=colour, lw=1.6)[0]
        dots = ax.plot([], [], [], "o", ms=5, mew=0, color=colour)[0]
        panels.append((strokes, lines, dots))

    def update(i: int) -> list[Any]:
        for strokes, lines, dots in panels:
            lines.set_data_3d(*strokes[:i].reshape(-1, 3).T)
            dots.set_data_3d(*strokes[:i, 0].T)
        return [artist for _, *artists in panels for artist in artists]

    return update


def in_middle_half(points: Array) -> int:
    """Return how many points of the unit sphere are in the middle half of its height."""
    return int(np.sum(np.abs(points[:, 2]) < 0.5))


def describe_images(images: Images, kind: str = "rotations") -> str:
    """Return a description of the picture of `moving_images`; `kind` is the kind of the samples."""
    count = len(next(iter(images.values()))[0])
    said = ", ".join(f"{name}: {in_middle_half(v0)}" for name, (v0, _) in images.items())
    return (
        f"Images of the pole of a sphere under {count} random {kind}: {', '.join(images)}. A "
        "stroke at each image shows the turn about it. Numbers of images in the middle half of the "
        f"height, which is half of the area: {said}."
    )
