"""Display lists: what moving artists draw, as whole numbers that a canvas in a browser can draw."""

import zlib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backend_bases import RendererBase
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from numpy.typing import NDArray

ENGINE = Path(__file__).with_suffix(".js").read_text(encoding="utf-8")
"""JavaScript: ``rbcourseDisplay.unpack`` and ``rbcourseDisplay.draw``."""
PARTS = 16
"""Of a pixel: in these the places are counted; display.js divides by it."""
FAR = 16000
"""No place is further; the difference of two is still an int16."""


class Display(RendererBase):
    """A renderer of Matplotlib that keeps what is drawn, state by state.

    A state is a sequence of polygons, of each its style, its number of points, and their places in
    parts of a pixel from the upper left, each as the difference from the one before. A number
    below 0 is of a polygon that is filled together with the one before it, as a hole perhaps.

    Parameters
    ----------
    fig : Figure
        The figure; its size in pixels is that of the canvas.

    Attributes
    ----------
    styles : list of list
        Colour to fill, colour of the line, its width, its dashes, its ends and corners, and the
        rectangle that is drawn in; what there is not is None or empty. Lengths are in pixels.
    states : list of ndarray
        What `record` has kept: int16.
    """

    def __init__(self, fig: Figure) -> None:
        super().__init__()
        self._fig = fig
        self.width, self.height = fig.bbox.size
        self.states: list[NDArray[np.int16]] = []
        self._styles: dict[tuple[Any, ...], int] = {}
        self._drawn: list[NDArray[np.int16]] = []

    @property
    def styles(self) -> list[list[Any]]:
        """The styles, in the order of their numbers."""
        return [list(style) for style in self._styles]

    def record(self, artists: Iterable[Any]) -> None:
        """Keep what these artists draw as another state."""
        self._drawn = [np.zeros(0, np.int16)]
        for artist in artists:
            if hasattr(artist, "do_3d_projection"):
                artist.do_3d_projection()
            artist.draw(self)
        self.states.append(np.concatenate(self._drawn))

    def pack(self) -> bytes:
        """Return all states: how many there are, their lengths, and what they draw, deflated."""
        sizes = np.array([len(self.states), *map(len, self.states)], "<u4")
        numbers = np.concatenate(self.states).astype("<i2")
        return zlib.compress(sizes.tobytes() + numbers.tobytes(), 9)

    def get_canvas_width_height(self) -> tuple[float, float]:
        """Return the size in pixels."""
        return self.width, self.height

    def points_to_pixels(self, points: Any) -> Any:
        """Return a length in points as one in pixels."""
        return points * self._fig.dpi / 72

    def draw_path(self, gc: Any, path: Any, transform: Any, rgbFace: Any = None) -> None:
        """Keep a path as polygons; Matplotlib calls this for all that it draws."""
        look = self._style(gc, rgbFace)
        style = self._styles.setdefault(look, len(self._styles))
        clip = None if rgbFace is not None else (-400, -400, self.width + 400, self.height + 400)
        simple = path.should_simplify and rgbFace is None
        clean = path.cleaned(transform, remove_nans=True, clip=clip, simplify=simple, curves=True)
        clean = type(path)(clean.vertices[:-1], clean.codes[:-1])  # the last one is a stop
        for i, points in enumerate(clean.to_polygons(closed_only=False)):
            places = PARTS * np.stack([points[:, 0], self.height - points[:, 1]], axis=1)
            whole = np.clip(np.round(places), -FAR, FAR).astype(int)
            steps = np.diff(whole, axis=0, prepend=np.zeros((1, 2), int))
            number = -len(steps) if i and rgbFace is not None else len(steps)
            self._drawn.append(np.array([style, number, *steps.ravel()], np.int16))

    def _style(self, gc: Any, face: Any) -> tuple[Any, ...]:
        width = round(self.points_to_pixels(gc.get_linewidth()), 3)
        dashes = gc.get_dashes()[1] or ()
        clip = gc.get_clip_rectangle()
        alpha = gc.get_alpha() if gc.get_forced_alpha() else None
        box = (clip.x0, self.height - clip.y1, clip.width, clip.height) if clip else ()
        return (
            None if face is None else to_hex((*face[:3], _alpha(face, alpha)), keep_alpha=True),
            to_hex((*gc.get_rgb()[:3], _alpha(gc.get_rgb(), alpha)), keep_alpha=True)
            if width
            else None,
            width,
            tuple(round(self.points_to_pixels(dash), 3) for dash in dashes),
            "square" if gc.get_capstyle() == "projecting" else str(gc.get_capstyle()),
            str(gc.get_joinstyle()),
            tuple(round(float(x), 2) for x in box),
        )


def _alpha(colour: Any, forced: float | None) -> float:
    return forced if forced is not None else colour[3] if len(colour) > 3 else 1.0
