"""The base of all explorers: a picture that follows its sliders."""

import base64
import html
import io
import warnings
from collections.abc import Callable, Mapping
from contextlib import contextmanager
from typing import Any

import anywidget
import ipywidgets
import matplotlib.pyplot as plt
import numpy as np
import traitlets
from matplotlib.figure import Figure
from PIL import Image

from rbcourse.draw.animate import painter
from rbcourse.draw.save import few_colours, png

DPI = 100
"""Pixels per inch of a picture at its own size."""
LABELS = 13.0
"""Size of all letters in the pictures, in points: 18 pixels."""

_SCRIPT = """
export default {
  render({ model, el }) {
    const image = document.createElement("img");
    image.style.maxWidth = "100%";
    const draw = () => {
      const before = image.src;
      image.src = URL.createObjectURL(new Blob([model.get("png")], { type: "image/png" }));
      URL.revokeObjectURL(before);
      image.alt = model.get("alt");
      image.width = model.get("width");
    };
    let clicks = 0;
    const point = (event) => {
      if (!(event.buttons & 1)) return;
      const { left, top, width, height } = image.getBoundingClientRect();
      const place = [(event.clientX - left) / width, (event.clientY - top) / height];
      model.set("place", [...place, ++clicks]);  // so that the same place counts again
      model.save_changes();
    };
    if (model.get("clickable")) {
      image.style.cursor = "crosshair";
      image.style.touchAction = "none";
      image.draggable = false;
      image.addEventListener("pointerdown", point);
      image.addEventListener("pointermove", point);
    }
    // Give buttons and sliders names for screen readers.
    const name = (panel) => {
      panel.querySelectorAll(".widget-slider").forEach((slider) => {
        const label = slider.querySelector(".widget-label")?.textContent ?? "";
        slider.querySelector(".noUi-handle")?.setAttribute("aria-label", label);
      });
      panel.querySelectorAll(".widget-play button").forEach((button, i) => {
        button.title = ["Play or pause", "Stop"][i] ?? "";
      });
    };
    const observer = new MutationObserver(() => name(panel));
    let panel = null, timer = 0;
    const begin = () => {
      panel = el.closest(".rbcourse-explorer");
      if (!panel) { timer = setTimeout(begin, 100); return; }
      name(panel);
      observer.observe(panel, { childList: true, subtree: true });
    };
    begin();
    model.on("change:png", draw);
    draw();
    image.addEventListener("load", () => {
      const zoom = Math.max(1, image.clientWidth / image.width);
      model.set("density", window.devicePixelRatio * zoom);
      model.save_changes();
    }, { once: true });
    el.append(image);
    return () => {
      model.off("change:png", draw);
      observer.disconnect();
      clearTimeout(timer);
      URL.revokeObjectURL(image.src);
    };
  }
};
"""


class Picture(anywidget.AnyWidget):
    """A PNG in the browser, which tells how fine the screen is, and where it is clicked.

    A place is the share of the width from the left, that of the height from the top, and the number
    of the click.
    """

    _esm = _SCRIPT
    png = traitlets.Bytes().tag(sync=True)
    alt = traitlets.Unicode().tag(sync=True)
    width = traitlets.Int().tag(sync=True)
    clickable = traitlets.Bool().tag(sync=True)
    place = traitlets.List(traitlets.Float()).tag(sync=True)
    density = traitlets.Float(1.0).tag(sync=True)


class Explorer(ipywidgets.Box):  # type: ignore[misc]
    """A picture, its controls, and what is to be read off it.

    What does not move is drawn once. Each change of a control moves the artists, in one picture.
    What cannot be served is said in the panel; then nothing is drawn that moves.

    Parameters
    ----------
    name : str
        What it is called.
    fig : Figure
        The figure with everything on it; its axes must not change.
    artists : mapping of str to artist
        What moves, with names, in the order in which it is drawn.
    controls : mapping of str to widget
        Sliders and choices, with names.
    show : callable
        ``show(**values)`` moves the artists to what the controls say, one keyword for each, and
        returns what is to be read: names, and what is said of them. It may raise a ValueError or a
        RuntimeError, or warn.
    plays : str
        Which control the play button moves: a slider.
    seconds : float, optional
        How long it plays.
    point : callable, optional
        ``point(x, y)`` gets the place of a click in the pixels of Matplotlib, and returns the
        controls to be set, as a dict; it may raise a ValueError.
    """

    def __init__(
        self,
        name: str,
        fig: Figure,
        artists: Mapping[str, Any],
        controls: Mapping[str, Any],
        show: Callable[..., Mapping[str, str]],
        plays: str,
        seconds: float = 4.0,
        point: Callable[[float, float], Mapping[str, Any]] | None = None,
    ) -> None:
        self.name, self.artists, self.controls = name, dict(artists), dict(controls)
        self._fig, self._show, self._point = fig, show, point
        self._first = self.values
        self._resting = False
        for control in self.controls.values():
            control.observe(self._follow, "value")
        width = round(fig.get_figwidth() * DPI)
        self.picture = Picture(width=width, clickable=point is not None)
        self.said, self.notice = ipywidgets.HTML(), ipywidgets.HTML()
        self.play = _play(self.controls[plays], seconds)
        self.reset = ipywidgets.Button(description="Reset", layout={"width": "5em"})
        buttons = ipywidgets.HBox([self.play, self.reset])
        panel = ipywidgets.VBox(
            [buttons, *self.controls.values(), self.said, self.notice],
            layout={"flex": "1 1 19em", "min_width": "0"},
        )
        panel.add_class("rbcourse-panel")
        self.picture.layout = {"flex": f"0 1 {width}px", "min_width": "0"}
        super().__init__(
            [self.picture, panel], layout={"flex_flow": "row wrap", "align_items": "flex-start"}
        )
        self.add_class("rbcourse-explorer")
        self._prepare()
        self.reset.on_click(lambda _: self.restart())
        self.picture.observe(self._prepare, "density")
        self.picture.observe(self._pointed, "place")

    @property
    def values(self) -> dict[str, Any]:
        """What the controls say, by name."""
        return {name: control.value for name, control in self.controls.items()}

    def put(self, **values: Any) -> None:
        """Set some of the controls, in their order, and draw once."""
        self._resting = True
        try:
            for name in [name for name in self.controls if name in values]:
                self.controls[name].value = values[name]
        finally:
            self._resting = False
            self._follow()

    def restart(self) -> None:
        """Set all controls to what they were at first; stop playing."""
        self.play.playing = False
        self.put(**self._first)

    def _prepare(self, _: Any = None) -> None:
        """Draw what does not move, as finely as the screen shows it."""
        self._fig.set_dpi(DPI * min(max(self.picture.density, 1.0), 2.0))
        with look():
            self._paint = painter(self._fig, list(self.artists.values()))
        self._follow()

    def _follow(self, _: Any = None) -> None:
        if self._resting:
            return
        shown, said, notice = list(self.artists.values()), {}, ""
        with warnings.catch_warnings(record=True, action="always") as warned:
            try:
                said = dict(self._show(**self.values))
                notice = " ".join(str(warning.message) for warning in warned)
            except (ValueError, RuntimeError) as error:
                shown, notice = [], f"Nothing to show here: {error}"
        drawn = io.BytesIO()
        self._paint(shown).save(drawn, "png", compress_level=1)
        plain = "; ".join(f"{key}: {' '.join(text.split())}" for key, text in said.items())
        with self.picture.hold_sync():
            self.picture.png, self.picture.alt = drawn.getvalue(), f"{self.name}. {plain or notice}"
        self.said.value = _table(said)
        self._warn(notice)

    def _warn(self, notice: str) -> None:
        self.notice.value = f'<b role="alert">{html.escape(notice)}</b>' if notice else ""

    def _pointed(self, change: Any) -> None:
        right, down, _ = change.new
        x, y = self._fig.bbox.width * right, self._fig.bbox.height * (1 - down)
        assert self._point is not None
        try:
            self.put(**self._point(x, y))
        except ValueError as error:
            self._warn(str(error))

    def __repr__(self) -> str:
        """Return the name, and what is to be read."""
        return self.picture.alt

    def _repr_mimebundle_(self, **kwargs: Any) -> dict[str, Any]:
        """Return the explorer, and a still of it for readers without a kernel."""
        picture = png(few_colours(Image.open(io.BytesIO(self.picture.png))))
        source = base64.b64encode(picture).decode()
        still = (
            f'<figure><img style="max-width: 100%" alt="{html.escape(repr(self))}" '
            f'src="data:image/png;base64,{source}"/><figcaption>{html.escape(self.name)}: '
            "run this cell (Shift + Enter) to get its sliders</figcaption></figure>"
        )
        return {"text/html": still, **super()._repr_mimebundle_(**kwargs)}


@contextmanager
def look() -> Any:
    """Draw as all figures of the course are drawn, with all letters of one size."""
    sizes = dict.fromkeys(
        ("legend.fontsize", "legend.title_fontsize", "xtick.labelsize", "ytick.labelsize"), LABELS
    )
    with plt.style.context(["default", "rbcourse.rbcourse", sizes]):
        yield


def new_figure() -> Figure:
    """Return a figure for an explorer; to be used within `look`."""
    fig = Figure(figsize=(5.6, 3.8), dpi=DPI)
    fig.set_layout_engine("none")
    return fig


def new_space(fig: Figure, place: tuple[float, float, float, float], reach: float) -> Any:
    """Add axes for bodies that turn about the origin; pale: the axes of the room."""
    ax: Any = fig.add_axes(place, projection="3d")
    for room in reach * np.eye(3):
        ax.plot(*np.stack([-room, room], axis=1), color="0.88", lw=1.5, zorder=0)
    ax.set(xlim=(-reach, reach), ylim=(-reach, reach), zlim=(-reach, reach))
    ax.set_box_aspect((1, 1, 1), zoom=1.25)
    ax.set_axis_off()
    ax.set_proj_type("ortho")  # in perspective the square of a box can sink into its face
    ax.view_init(elev=20, azim=-55)
    return ax


def new_line(ax: Any, **style: Any) -> Any:
    """Draw a line without points, in the plane or in space, to be filled."""
    return ax.plot(*[[]] * (3 if ax.name == "3d" else 2), **style)[0]


def slider(label: str, value: float, low: float, high: float, step: float) -> Any:
    """Return a slider; its label ends with the unit, where there is one."""
    digits = len(f"{step:g}".partition(".")[2])
    return ipywidgets.FloatSlider(
        value,
        description=label,
        min=low,
        max=high,
        step=step,
        readout_format=f".{digits}f",
        style={"description_width": "9.5em"},
        layout={"width": "auto"},
    )


def choice(label: str, options: Any) -> Any:
    """Return buttons of which one is chosen, the first to begin with."""
    return ipywidgets.ToggleButtons(
        options=options,
        description=label,
        style={"description_width": "9.5em", "button_width": "auto"},
    )


def menu(label: str, options: Any) -> Any:
    """Return a menu of which one line is chosen, the first to begin with: for many options."""
    style = {"description_width": "9.5em"}
    return ipywidgets.Dropdown(
        options=options, description=label, style=style, layout={"width": "auto"}
    )


def numbers(values: Any, digits: int) -> str:
    """Return numbers as text, with commas between them, and without a minus before zero."""
    rounded = np.round(np.atleast_1d(values), digits) + 0.0
    return ", ".join(f"{x:.{digits}f}".replace("-", "−") for x in rounded)


def _table(said: Mapping[str, str]) -> str:
    """Return names, and what is said of them, as HTML; lines stay lines."""
    cells = "".join(
        f'<tr style="vertical-align: top"><td style="padding-right: 0.8em">{html.escape(name)}</td>'
        f'<td style="white-space: pre; font-variant-numeric: tabular-nums">{html.escape(text)}</td>'
        "</tr>"
        for name, text in said.items()
    )
    return f'<table style="line-height: 1.35">{cells}</table>'


def _play(control: Any, seconds: float) -> Any:
    steps = round((control.max - control.min) / control.step)
    play = ipywidgets.Play(min=0, max=steps, interval=max(40, round(1000 * seconds / steps)))
    play.show_repeat = False

    def follow(_: Any) -> None:
        play.value = round((control.value - control.min) / control.step)

    def lead(change: Any) -> None:
        if play.playing or change.new == play.min:
            control.value = float(control.min + change.new * control.step)
        else:  # said before the browser heard that it was stopped
            follow(change)

    follow(None)
    control.observe(follow, "value")
    play.observe(lead, "value")
    return play
