"""Artists over time: GIFs, and players that can be paused and work without a network."""

import base64
import html
import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from string import Template
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from rbcourse.figures import Table, csv_text, figures_folder

Update = Callable[[int], Sequence[Any]]

_PLAYER = Template("""\
<figure><img id="$name" style="max-width: 100%" alt="$alt" src="$still"/>\
<figcaption>$name: .gif, .png, .csv</figcaption>
<div hidden><button aria-label="play or pause">▶</button>
<input type="range" min="0" max="$last" value="$shown" aria-label="time" style="width: 60%"/></div>
<script>
document.querySelectorAll("#$name").forEach((image) => {
  const panel = image.parentNode.querySelector("div");
  if (!panel || !panel.hidden) return;
  const frames = [$frames], [button, slider] = panel.children;
  let timer = null;
  const show = () => { image.src = frames[slider.value]; };
  const pause = () => { clearInterval(timer); timer = null; button.textContent = "▶"; };
  const step = () => { slider.value = (+slider.value + 1) % frames.length; show(); };
  button.onclick = () => {
    if (timer) return pause();
    timer = setInterval(step, $milliseconds);
    button.textContent = "❚❚";
  };
  slider.oninput = () => { pause(); show(); };
  panel.hidden = false;
});
</script></figure>""")


@dataclass(frozen=True)
class Animation:
    """A saved animation, as a notebook shows it: a player with its description.

    Parameters
    ----------
    name : str
        The name of its files, without ending.
    alt : str
        What is to be seen, for who cannot see it.
    pictures : tuple of bytes
        PNG frames of the player.
    shown : int
        Which of them is shown first.
    seconds : float
        How long it takes.
    """

    name: str
    alt: str
    pictures: tuple[bytes, ...]
    shown: int
    seconds: float

    def __repr__(self) -> str:
        """Return the name and the description."""
        return f"{self.name}: {self.alt}"

    def _repr_html_(self) -> str:
        """Return a player of its own: a still picture where scripts do not run."""
        sources = [
            "data:image/png;base64," + base64.b64encode(png).decode() for png in self.pictures
        ]
        return _PLAYER.substitute(
            name=self.name,
            alt=html.escape(self.alt),
            still=sources[self.shown],
            shown=self.shown,
            last=len(sources) - 1,
            frames=", ".join(f'"{source}"' for source in sources),
            milliseconds=round(1000 * self.seconds / len(sources)),
        )


def save_animation(
    fig: Figure,
    name: str,
    data: Table,
    alt: str,
    update: Update,
    frames: int,
    seconds: float = 4.0,
) -> Animation:
    """Save an animation as GIF, with a still PNG of its middle and a CSV, and close the figure.

    The files go where `save_figure` puts its own. The same input gives the same bytes.

    Parameters
    ----------
    fig : Figure
        The figure, with everything on it that does not move.
    name : str
        The name of the files, without ending.
    data : mapping of str to array_like
        The plotted numbers: columns of one shape, with units in their names.
    alt : str
        A sentence or two that say what is to be seen.
    update : callable
        ``update(i)`` moves the artists to frame i and returns those that move.
    frames : int
        How many frames.
    seconds : float, optional
        How long the animation takes.

    Returns
    -------
    Animation
        It plays every second frame.

    Raises
    ------
    ValueError
        If the columns differ in shape.
    """
    text = csv_text(data)
    pictures, middle = indexed(render(fig, update, frames)), frames // 4
    plt.close(fig)
    shown = tuple(_png(picture) for picture in pictures[::2])
    folder = figures_folder()
    (folder / f"{name}.gif").write_bytes(gif(pictures, seconds))
    (folder / f"{name}.png").write_bytes(shown[middle])
    (folder / f"{name}.csv").write_text(text, encoding="utf-8", newline="\n")
    return Animation(name, alt, shown, middle, seconds)


def render(fig: Figure, update: Update, frames: int) -> list[Image.Image]:
    """Return the frames as pictures.

    What does not move is drawn once, and restored before each frame. The axes must not change.

    Parameters
    ----------
    fig : Figure
        The figure.
    update : callable
        ``update(i)`` moves the artists to frame i and returns those that move.
    frames : int
        How many.

    Returns
    -------
    list of Image
        In RGB.
    """
    canvas: Any = FigureCanvasAgg(fig)  # its methods have no types
    for artist in update(0):
        artist.set_animated(True)
    canvas.draw()
    background = canvas.copy_from_bbox(fig.bbox)
    drawn = []
    for i in range(frames):
        canvas.restore_region(background)
        for artist in update(i):
            if hasattr(artist, "do_3d_projection"):
                artist.do_3d_projection()
            artist.axes.draw_artist(artist)
        drawn.append(Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB"))
    return drawn


def indexed(pictures: Sequence[Image.Image]) -> list[Image.Image]:
    """Return pictures with one palette: the 256 commonest colours of eight of them.

    Pillow looks colours up to 6 bits a channel, so of those that agree in them one is enough.
    """
    width, height = pictures[0].size
    some = Image.new("RGB", (width, 8 * height))
    for k, i in enumerate(np.linspace(0, len(pictures) - 1, 8).round().astype(int)):
        some.paste(pictures[i], (0, k * height))
    counted: Any = some.getcolors(some.width * some.height)
    distinct: dict[tuple[int, ...], tuple[int, ...]] = {}
    for _, colour in sorted(counted, reverse=True):
        distinct.setdefault(tuple(level // 4 for level in colour), colour)
    palette = Image.new("P", (1, 1))
    palette.putpalette([level for colour in list(distinct.values())[:256] for level in colour])
    return [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]


def gif(pictures: Sequence[Image.Image], seconds: float) -> bytes:
    """Return pictures as an endless GIF that takes so many seconds."""
    content = io.BytesIO()
    each = round(1000 * seconds / len(pictures))
    first, *others = pictures
    first.save(content, "gif", save_all=True, append_images=others, duration=each, loop=0)
    return content.getvalue()


def _png(picture: Image.Image) -> bytes:
    content = io.BytesIO()
    picture.save(content, "png")
    return content.getvalue()
