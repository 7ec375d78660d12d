"""Animations: GIFs, and players for notebooks that work without a network."""

import base64
import html
import io
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from string import Template
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from rbcourse.draw.save import Table, caption, csv_text, figures_folder, png, save_figure

Update = Callable[[int], Sequence[Any]]

_PLAYER = Template("""\
<figure><img id="$name" style="max-width: 100%" alt="$alt" src="$still"/>\
$caption
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
    """An animation, as a notebook shows it: a player with its description.

    Parameters
    ----------
    name : str
        What it is called.
    alt : str
        Alternative text: what the animation shows.
    pictures : tuple of Image
        Its frames. The player shows every second one.
    still : int
        Which of them is shown before it plays.
    seconds : float
        How long it takes.
    files : str, optional
        Where it is saved, for the caption.
    """

    name: str
    alt: str
    pictures: tuple[Image.Image, ...]
    still: int
    seconds: float
    files: str = ""

    def __repr__(self) -> str:
        """Return the name and the description."""
        return f"{self.name}: {self.alt}"

    def _repr_html_(self) -> str:
        """Return a player of its own: a still picture where scripts do not run."""
        sources = [
            "data:image/png;base64," + base64.b64encode(png(picture)).decode()
            for picture in self.pictures[self.still % 2 :: 2]
        ]
        return _PLAYER.substitute(
            name=f"{self.name}_{zlib.crc32(self.alt.encode()):08x}",
            caption=caption(self.alt, self.files),
            alt=html.escape(self.alt),
            still=sources[self.still // 2],
            shown=self.still // 2,
            last=len(sources) - 1,
            frames=", ".join(f'"{source}"' for source in sources),
            milliseconds=round(1000 * self.seconds / len(sources)),
        )

    def save(self, path: str | Path) -> None:
        """Write the animation to a file, as a GIF that starts again when it ends."""
        Path(path).write_bytes(gif(self.pictures, self.seconds))


def animate(
    fig: Figure,
    name: str,
    alt: str,
    update: Update,
    frames: int,
    seconds: float = 4.0,
    still: int = -1,
) -> Animation:
    """Return a figure as an animation, and leave it as it is in its still frame."""
    if not name.isidentifier():
        raise ValueError(f"name: a word of letters, digits and _ wanted, got {name!r}")
    if not 0 < frames <= 50 * seconds:
        raise ValueError(f"frames: 1 to 50 a second wanted, got {frames} in {seconds} s")
    pictures = tuple(indexed(render(fig, update, frames)))
    for artist in update(still % frames):
        artist.set_animated(False)
    return Animation(name, alt, pictures, still % frames, seconds)


def save_animation(
    fig: Figure,
    name: str,
    data: Table,
    alt: str,
    update: Update,
    frames: int,
    seconds: float = 4.0,
    still: int = -1,
) -> Animation:
    """Save an animation as GIF, its still frame as PNG and PDF, its numbers as CSV; close it.

    The files go where `save_figure` puts its own. The same input gives the same bytes.
    """
    csv_text(data)  # before anything is written
    animation = animate(fig, name, alt, update, frames, seconds, still)
    save_figure(fig, name, data, alt)
    folder = figures_folder()
    animation.save(folder / f"{name}.gif")
    (folder / f"{name}.png").write_bytes(png(animation.pictures[animation.still]))
    return replace(animation, files=f"{name}.gif, .png, .pdf, .csv")


def render(fig: Figure, update: Update, frames: int) -> list[Image.Image]:
    """Return the frames as pictures.

    What does not move is drawn once, and restored before each frame. The axes must not change.
    """
    before: Any = fig.canvas
    paint = painter(fig, update(0))
    drawn = [paint(update(i)) for i in range(frames)]
    fig.set_canvas(before)
    return drawn


def painter(fig: Figure, moving: Sequence[Any]) -> Callable[[Sequence[Any]], Image.Image]:
    """Draw what does not move, once; return what draws moving artists over it."""
    canvas: Any = FigureCanvasAgg(fig)  # its methods have no types
    for artist in moving:
        artist.set_animated(True)
    canvas.draw()
    background = canvas.copy_from_bbox(fig.bbox)

    def paint(artists: Sequence[Any]) -> Image.Image:
        canvas.restore_region(background)
        for artist in artists:
            if hasattr(artist, "do_3d_projection"):
                artist.do_3d_projection()
            artist.draw(canvas.get_renderer())
        return Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")

    return paint


def indexed(pictures: Sequence[Image.Image]) -> list[Image.Image]:
    """Return pictures with one palette: the 256 commonest colours of eight of them.

    Pillow looks colours up by the first 6 bits of each channel, as if the others were 0. Of those
    that agree in them the commonest stands for all.
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
    looked_up.putpalette([level for key in list(distinct)[:256] for level in key])
    shown = [level for colour in list(distinct.values())[:256] for level in colour]
    found = [picture.quantize(palette=looked_up, dither=Image.Dither.NONE) for picture in pictures]
    for picture in found:
        picture.putpalette(shown)
    return found


def gif(pictures: Sequence[Image.Image], seconds: float) -> bytes:
    """Return pictures as an endless GIF that takes so many seconds, in its steps of 10 ms."""
    content = io.BytesIO()
    ends = np.linspace(0, 100 * seconds, len(pictures) + 1).round().astype(int)
    durations = [int(10 * step) for step in np.diff(ends)]
    first, *others = pictures
    first.save(content, "gif", save_all=True, append_images=others, duration=durations, loop=0)
    return content.getvalue()
