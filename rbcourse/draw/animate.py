"""Animations: GIFs, and players that work in notebooks without a network."""

import io
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure
from PIL import Image

from rbcourse.draw.display import Display, Player
from rbcourse.draw.pictures import drawn, painter
from rbcourse.draw.save import Table, caption, csv_text, figures_folder, write_figure
from rbcourse.draw.space import scenes
from rbcourse.files import replace_file

Update = Callable[[int], Sequence[Any]]


@dataclass(frozen=True, repr=False)
class Animation(Player):
    """A player of a moving figure; it also stores the frames as pictures."""

    pictures: tuple[Image.Image, ...] = ()  # the frames, for a GIF
    seconds: float = 4.0  # the duration

    def save(self, path: str | Path) -> None:
        """Write the animation to a file as a GIF that repeats forever."""
        if not self.pictures:
            why = "with gif=False, or if RBCOURSE_FIGURES is empty, the frames are not drawn"
            raise ValueError(f"this animation has no frames: {why}")
        replace_file(path, as_gif(self.pictures, self.seconds))


def animate(
    fig: Figure,
    name: str,
    alt: str,
    update: Update,
    frames: int,
    seconds: float = 4.0,
    still: int = -1,
    gif: bool = True,
) -> Animation:
    """Return a figure as an animation; afterwards the figure shows the still frame.

    Without `gif`, the frames of a file are not drawn, which takes most of the time.
    """
    if not name.isidentifier():
        raise ValueError(f"name: a word of letters, digits and _ is wanted, got {name!r}")
    if not 0 < frames <= 50 * seconds:
        raise ValueError(f"frames: 1 to 50 per second are wanted, got {frames} in {seconds} s")
    files = gif and os.environ.get("RBCOURSE_FIGURES") != ""  # see `save_figure`
    rendered = render(fig, update, frames if files else 0)  # `render` also lays out the figure
    pictures = tuple(indexed(rendered)) if rendered else ()
    fig.set_layout_engine("none")  # keeps all artists in place
    display = Display(fig)
    states = [display.record(update(i)) for i in range(frames)]
    background = drawn(fig, update(still % frames), None)
    shown = frame_picture(fig, update, still % frames)
    shares = [f"{round(100 * i / max(1, frames - 1))} %" for i in range(frames)]
    return Animation(
        name,
        alt,
        caption(alt),
        shown,
        background,
        display,
        states,
        controls=[{"label": "time", "values": shares, "first": still % frames}],
        milliseconds=round(1000 * seconds / frames),
        pictures=pictures,
        seconds=seconds,
    )


def save_animation(
    fig: Figure,
    name: str,
    data: Table,
    alt: str,
    update: Update,
    frames: int,
    seconds: float = 4.0,
    still: int = -1,
    *,
    gif: bool = True,
    pdf: bool = False,
) -> Animation:
    """Save an animation as GIF, its still frame as PNG, and its numbers as CSV.

    The files go to the folder of `save_figure`. The same input always gives the same bytes. The
    figure is closed.

    Parameters
    ----------
    fig : matplotlib Figure
        The figure.
    name : str
        The name of the files without the extension: a word of letters, digits and _.
    data : dict of array_like, all of one shape
        The plotted numbers. The names of the columns end with a unit, such as ``"t [s]"``.
    alt : str
        The description of the figure, for readers who do not see it.
    update : callable
        ``update(i)`` moves the artists to frame i, and returns the artists that move.
    frames : int
        The number of frames, at most 50 per second.
    seconds : float, optional
        The duration of the animation, in s.
    still : int, optional
        The number of the frame that the PNG shows, by default the last one.
    gif : bool, optional
        Whether to save a GIF; without it, only a notebook shows the animation.
    pdf : bool, optional
        Whether to save the still frame also as PDF, for printing.
    """
    table = csv_text(data)
    animation = animate(fig, name, alt, update, frames, seconds, still, gif)
    pictures = {"png": animation.shown}
    if animation.pictures:
        pictures["gif"] = as_gif(animation.pictures, seconds)
    write_figure(fig, name, table, pictures, pdf, figures_folder())
    plt.close(fig)
    files = f"{name}.{'gif, .' * gif}png{', .pdf' * pdf}, .csv"
    return replace(animation, caption=caption(alt, files))


def frame_picture(fig: Figure, update: Update, i: int) -> bytes:
    """Return a PNG of a frame, and leave the figure in this frame."""
    moving = update(i)
    picture = drawn(fig, moving, moving)
    for artist in [*scenes(fig), *moving]:
        artist.set_animated(False)
    return picture


def render(fig: Figure, update: Update, frames: int) -> list[Image.Image]:
    """Return the frames as pictures.

    The fixed artists are drawn once, and restored before each frame. The axes must not change.
    """
    paint = painter(fig, update(0))
    return [paint(update(i)) for i in range(frames)]


def indexed(pictures: Sequence[Image.Image]) -> list[Image.Image]:
    """Return pictures with a common palette: the 96 most frequent colours of eight of them.

    Pillow looks up colours by the first 6 bits of each channel, as if the other bits were 0. Among
    the colours that agree in these bits, the most frequent one represents all of them.
    """
    width, height = pictures[0].size
    some = Image.new("RGB", (width, 8 * height))
    for k, i in enumerate(np.linspace(0, len(pictures) - 1, 8).round().astype(int)):
        some.paste(pictures[i], (0, k * height))
    counted: Any = some.getcolors(some.width * some.height)
    distinct: dict[tuple[int, ...], tuple[int, ...]] = {}
    for _, colour in sorted(counted, reverse=True):
        distinct.setdefault(tuple(level // 4 * 4 for level in colour), colour)
    looked_up = Image.new("P", (1, 1))
    looked_up.putpalette([level for key in list(distinct)[:96] for level in key])
    shown = [level for colour in list(distinct.values())[:96] for level in colour]
    found = [picture.quantize(palette=looked_up, dither=Image.Dither.NONE) for picture in pictures]
    for picture in found:
        picture.putpalette(shown)
    return found


def as_gif(pictures: Sequence[Image.Image], seconds: float) -> bytes:
    """Return pictures as a GIF that repeats forever; each frame lasts a multiple of 10 ms."""
    content = io.BytesIO()
    ends = np.linspace(0, 100 * seconds, len(pictures) + 1).round().astype(int)
    durations = [int(10 * step) for step in np.diff(ends)]
    first, *others = pictures
    first.save(content, "gif", save_all=True, append_images=others, duration=durations, loop=0)
    return content.getvalue()
