"""Figures as pictures: the fixed artists are drawn only once, and PNGs are small."""

import base64
import io
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from rbcourse.draw.space import not_in_space, scenes


def painter(fig: Figure, moving: Sequence[Any]) -> Callable[[Sequence[Any] | None], Image.Image]:
    """Draw the fixed artists once; return a function that draws moving artists over them.

    The function also draws the scenes of the figure. With None instead of artists, it gives the
    background alone.
    """
    before: Any = fig.canvas
    canvas: Any = FigureCanvasAgg(fig)  # Matplotlib does not annotate its methods
    for artist in [*scenes(fig), *not_in_space(moving)]:
        artist.set_animated(True)
    canvas.draw()
    fig.set_canvas(before)
    background = canvas.copy_from_bbox(fig.bbox)

    def paint(artists: Sequence[Any] | None) -> Image.Image:
        canvas.restore_region(background)
        for artist in [] if artists is None else [*scenes(fig), *not_in_space(artists)]:
            artist.draw(canvas.get_renderer())
        return Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")

    return paint


def drawn(
    fig: Figure, moving: Sequence[Any], artists: Sequence[Any] | None, zoom: float = 2
) -> bytes:
    """Return a PNG of a figure with these moving artists, at `zoom` times the resolution.

    With None instead of artists, the PNG shows the background alone, without scenes.
    """
    dpi = fig.dpi
    fig.set_dpi(zoom * dpi)
    picture = painter(fig, moving)(artists)
    fig.set_dpi(dpi)
    return png(picture)


def png(picture: Image.Image, cuts: str = "") -> bytes:
    """Return a picture as a PNG in 256 colours, without dithering, with a text if it is given."""
    content, texts = io.BytesIO(), PngInfo()
    if cuts:
        texts.add_text("cuts", cuts)
    few_colours = picture.convert("RGB").quantize(256, dither=Image.Dither.NONE)
    few_colours.save(content, "png", optimize=True, pnginfo=texts)
    return content.getvalue()


def data_url(png: bytes) -> str:
    """Return the address of a PNG that is a part of the page."""
    return f"data:image/png;base64,{base64.b64encode(png).decode()}"
