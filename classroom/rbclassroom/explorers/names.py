"""Names at the things in the pictures of explorers, in front of everything."""

from typing import Any

import numpy as np
from matplotlib.patheffects import withStroke

from rbcourse.draw.scene import OVER


def new_name(ax: Any, name: str, **style: Any) -> Any:
    """Write a name, in space with a white outline; `put_name` moves it."""
    look = {"ha": "center", "va": "center", "zorder": OVER, **style}
    if ax.name != "space":  # without an outline, recordings are half as large
        return ax.text(0, 0, name, **look)
    halo = withStroke(foreground="white", linewidth=3)
    return ax.text(0, 0, 0, name, path_effects=[halo], **look)


def put_name(name: Any, place: Any) -> None:
    """Move a name; in the plane it moves by whole pixels, which keeps recordings small."""
    if name.axes.name == "space":
        name.set_position_3d(place)
    else:
        pixels = name.axes.transData
        name.set_position(pixels.inverted().transform(np.round(pixels.transform(place))))
