"""Animations: GIFs, and players for notebooks that work without a network."""

import base64
import html
import io
import json
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

from rbcourse.draw.display import ENGINE, Display
from rbcourse.draw.save import (
    Table,
    caption,
    csv_text,
    few_colours,
    figures_folder,
    png,
    save_figure,
)

Update = Callable[[int], Sequence[Any]]

_PLAYER = Template("""\
<figure><img id="$name" width="$width" style="max-width: 100%" alt="$alt" src="$still"/>\
$caption
<div hidden><button aria-label="play or pause">▶</button>
<input type="range" min="0" max="$last" value="$shown" aria-label="time" style="width: 60%"/></div>
<script>
document.querySelectorAll("#$name").forEach(async (image) => {
  const panel = image.parentNode.querySelector("div");
  if (!panel || image.matches("[data-read]") || !window.DecompressionStream) return;
  image.dataset.read = true;
  $engine
  const { states, back } = await rbcourseDisplay.load("$states", "$background");
  const canvas = document.createElement("canvas"), [button, slider] = panel.children;
  canvas.style.cssText = "display: block; width: $width" + "px; max-width: 100%";
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", image.alt);
  const show = () => {
    rbcourseDisplay.draw(canvas, back, [$width, $height], $styles, states[slider.value]);
    slider.setAttribute("aria-valuetext", `$${Math.round((100 * slider.value) / slider.max)} %`);
  };
  const calm = matchMedia("(prefers-reduced-motion: reduce)").matches;
  const step = calm ? Math.ceil(states.length / 5) : 1;
  let timer = null;
  const pause = () => { clearInterval(timer); timer = null; button.textContent = "▶"; };
  const turn = () => { slider.value = (+slider.value + step) % states.length; show(); };
  button.onclick = () => {
    if (timer) return pause();
    timer = setInterval(turn, step * $milliseconds);
    button.textContent = "❚❚";
  };
  slider.oninput = () => { pause(); show(); };
  panel.onkeydown = (event) => event.stopPropagation();  // or JupyterLab takes them
  image.replaceWith(canvas);
  panel.hidden = false;
  new ResizeObserver(show).observe(canvas);
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
        Its frames, for the GIF.
    display : Display
        Its frames, for the player.
    background, shown : bytes
        PNGs, twice as fine as they are shown: what does not move; and the still.
    still : int
        Which frame is shown before it plays.
    seconds : float
        How long it takes.
    files : str, optional
        Where it is saved, for the caption.
    """

    name: str
    alt: str
    pictures: tuple[Image.Image, ...]
    display: Display
    background: bytes
    shown: bytes
    still: int
    seconds: float
    files: str = ""

    def __repr__(self) -> str:
        """Return the name and the description."""
        return f"{self.name}: {self.alt}"

    def _repr_html_(self) -> str:
        """Return a player of its own: a still picture where scripts do not run."""
        width, height = (round(size) for size in self.display.get_canvas_width_height())
        return _PLAYER.substitute(
            name=f"{self.name}_{zlib.crc32(self.alt.encode()):08x}",
            caption=caption(self.alt, self.files),
            alt=html.escape(self.alt),
            width=width,
            height=height,
            still=_url("image/png", self.shown),
            background=_url("image/png", self.background),
            states=_url("application/octet-stream", self.display.pack()),
            styles=json.dumps(self.display.styles),
            engine=ENGINE,
            shown=self.still,
            last=len(self.pictures) - 1,
            milliseconds=round(1000 * self.seconds / len(self.pictures)),
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
    fig.set_layout_engine("none")  # all stays where it is
    display = Display(fig)
    for i in range(frames):
        display.record(update(i))
    moving = update(still % frames)
    for artist in moving:
        artist.set_animated(False)
    shown = _draw(fig)
    seen = [artist.get_visible() for artist in moving]
    for artist in moving:
        artist.set_visible(False)
    background = _draw(fig)
    for artist, visible in zip(moving, seen, strict=True):
        artist.set_visible(visible)
    return Animation(name, alt, pictures, display, background, shown, still % frames, seconds)


def _draw(fig: Figure) -> bytes:
    """Return the figure twice as fine as it is, as a PNG of few colours."""
    drawn = io.BytesIO()
    fig.savefig(drawn, format="png", dpi=2 * fig.dpi)
    return png(few_colours(Image.open(drawn)))


def _url(kind: str, content: bytes) -> str:
    return f"data:{kind};base64,{base64.b64encode(content).decode()}"


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
    (folder / f"{name}.png").write_bytes(animation.shown)
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
