"""The base class of explorers: pictures that readers change with sliders."""

import html
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from time import monotonic
from typing import Any

import anywidget
import ipywidgets
import numpy as np
import traitlets
from matplotlib.figure import Figure
from numpy.typing import NDArray

from rbcourse import angle_between
from rbcourse.draw.bodies import set_turning
from rbcourse.draw.display import ENGINE, Display, joined
from rbcourse.draw.drawing import style
from rbcourse.draw.pictures import data_url, drawn

# the labels of sliders are above them, so that a slider has the width of the panel
_PANEL = """.rbcourse-panel .widget-slider { flex-wrap: wrap; height: auto; }
.rbcourse-panel .widget-slider > .widget-label {
  flex: 1 0 100%; max-width: none; text-align: left;
}
"""


class Canvas(anywidget.AnyWidget):
    """The picture in the browser; it draws the states that Python sends (see canvas.js).

    ``made`` never changes. A ``run`` has consecutive states of the control that the play button
    moves. All runs of one version have the same values of the other controls, and the first run may
    have a notice (after a click, for example). The browser sends a message with the ``index`` of a
    missing state, or with the ``place`` of a click. A place consists of the distance from the left
    as a fraction of the width, and the distance from the top as a fraction of the height.
    """

    _esm = ENGINE + Path(__file__).with_name("canvas.js").read_text(encoding="utf-8")
    _css = _PANEL
    made = traitlets.Dict().tag(sync=True)
    run = traitlets.Dict().tag(sync=True)


@dataclass(frozen=True)
class State:
    """The visible artists of an explorer, their drawing commands, and the texts for display.js."""

    shown: list[Any]
    drawn: NDArray[np.int16]
    texts: list[Any]  # pairs of a name and a value, a notice, and a line with all of these


class Explorer(ipywidgets.Box):  # type: ignore[misc]
    """A picture, its controls, and the displayed values.

    The background is drawn once. The browser plays recorded states, and asks Python for missing
    states; each change of another control is sent as one state. If no picture exists for the values
    of the controls, the panel gives the reason, and the artists that move are hidden.

    Parameters
    ----------
    name, fig
        The title of the explorer, and the figure with all artists. The axes must not change.
    artists, controls : mapping of str
        The artists that move, in the order in which they are drawn, and the sliders and choices.
    show : callable
        ``show(**values)`` moves the artists to the values of the controls, and returns the
        displayed texts, by name. It may raise a ValueError or a RuntimeError, or warn.
    plays, seconds
        The name of the control that the play button moves, and its playing time in seconds.
        `widgets.stepped` must have made this control.
    point : callable, optional
        ``point(x, y)`` gets the position of a click in the pixels of Matplotlib, and returns the
        new values of controls, as a dict; it may raise a ValueError.
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
        self.plays, self.time = plays, self.controls[plays]
        self.steps = [value for _, value in self.time.options]
        self._first, self._resting, self._version = self.values, False, 0
        self.display, self.background = Display(fig), self.draw(None, zoom=2)
        last = len(self.steps) - 1
        interval = max(40, round(1000 * seconds / last))
        self.play = ipywidgets.Play(self.time.index, max=last, interval=interval, show_repeat=False)
        self.reset = ipywidgets.Button(description="Reset", layout={"width": "5em"})
        self.reset.add_class("rbcourse-reset")
        said = ipywidgets.HTML()
        others = [control for control in self.controls.values() if control is not self.time]
        made = {
            "size": self.display.size,
            "rooms": self.display.rooms,
            "background": self.background,
            "first": self.time.index,
            "clickable": point is not None,
            "parts": [part.model_id for part in (self.time, self.play, said, *others)],
        }
        # the picture grows with the cell
        most = f"{1.25 * self.display.width:.0f}px"
        wide = {"flex": f"2 1 {self.display.width}px", "min_width": "0", "max_width": most}
        self.picture = Canvas(made=made, layout=wide)
        panel = ipywidgets.VBox(
            [ipywidgets.HBox([self.play, self.reset]), self.time, *others, said],
            layout={"flex": "1 1 19em", "min_width": "0"},
        )
        panel.add_class("rbcourse-panel")
        flow = {"flex_flow": "row wrap", "align_items": "flex-start", "grid_gap": "8px 16px"}
        super().__init__([self.picture, panel], layout=flow)
        self.add_class("rbcourse-explorer")
        self._follow()
        for control in others:
            control.observe(self._follow, "value")
        self.reset.on_click(lambda _: self.restart())
        self.picture.on_msg(self._answer)

    @property
    def values(self) -> dict[str, Any]:
        """The values of the controls, by name."""
        return {name: control.value for name, control in self.controls.items()}

    def put(self, **values: Any) -> None:
        """Set some of the controls, one after the other, and send only the final state."""
        self._resting = True
        try:
            for name in [name for name in self.controls if name in values]:
                self.controls[name].value = values[name]
        finally:
            self._resting = False
            self._follow()

    def restart(self) -> None:
        """Set all controls to their first values, and stop playing."""
        self.play.playing = False
        self.put(**self._first)

    def state(self, **values: Any) -> State:
        """Return the state with these values; the other controls keep their present values."""
        shown, said, notice = list(self.artists.values()), {}, ""
        with warnings.catch_warnings(record=True, action="always") as warned:
            try:
                said = dict(self._show(**self.values | values))
                notice = " ".join(str(warning.message) for warning in warned)
            except (ValueError, RuntimeError) as error:
                shown, notice = [], f"Nothing to show here: {error}"
        for artist in self.artists.values():
            artist.set_visible(bool(shown))
        parts = (f"{name}: {' '.join(text.split())}" for name, text in said.items())
        line = f"{self.name}. {'; '.join(parts) or notice}"
        return State(shown, self.display.record(shown), [list(said.items()), notice, line])

    def draw(self, shown: Sequence[Any] | None, zoom: float = 1) -> bytes:
        """Return these artists as a PNG over the background, with `zoom` times the resolution.

        If `shown` is None, scenes in space are omitted, because the reader can turn them.
        """
        with style():
            return drawn(self._fig, list(self.artists.values()), shown, zoom)

    def _follow(self, _: Any = None, notice: str = "") -> None:
        """Send the present state, with a notice that is shown until a control moves."""
        if not self._resting:
            self._version += 1
            self._push(self.time.index, [self.state()], notice)

    def _answer(self, _: Any, asked: Mapping[str, Any], __: Any) -> None:
        """Send states for 50 ms, beginning with the requested state, or react to a click."""
        if "place" in asked and self._point:
            (right, down), (width, height) = asked["place"], self.display.size
            try:
                return self.put(**self._point(width * right, height * (1 - down)))
            except ValueError as error:
                return self._follow(notice=str(error))
        states, end = [], monotonic() + 0.05
        for value in self.steps[asked["index"] :]:
            states.append(self.state(**{self.plays: value}))
            if monotonic() > end:
                break
        self._push(asked["index"], states)

    def _push(self, first: int, states: Sequence[State], notice: str = "") -> None:
        self.picture.run = {
            "version": self._version,
            "number": self.picture.run.get("number", 0) + 1,  # equal runs would not be sent
            "index": first,
            "states": joined([state.drawn for state in states]),
            "texts": [state.texts for state in states],
            "styles": list(self.display.styles),
            "notice": notice,
        }

    def __repr__(self) -> str:
        """Return the name of the explorer and all displayed texts."""
        return self.state().texts[-1]

    def _repr_mimebundle_(self, **kwargs: Any) -> dict[str, Any]:
        """Return the explorer, and a still picture for readers without a kernel."""
        picture = data_url(self.draw(self.state().shown))
        still = (
            f'<figure><img style="max-width: 100%" alt="{html.escape(repr(self))}" '
            f'src="{picture}"/><figcaption>{html.escape(self.name)}: '
            "a still. Run this cell (Shift + Enter) to get its sliders</figcaption></figure>"
        )
        return {"text/html": still, **super()._repr_mimebundle_(**kwargs)}


@contextmanager
def new_figure() -> Iterator[Figure]:
    """Yield a figure for an explorer; drawings on it have the style of the course."""
    with style():
        fig = Figure(figsize=(5.6, 3.8), dpi=100)
        fig.set_layout_engine("none")
        yield fig


def new_space(fig: Figure, place: tuple[float, float, float, float], reach: float) -> Any:
    """Add axes for bodies that turn about the origin, with pale lines for the fixed axes."""
    ax: Any = fig.add_axes(place, projection="space")
    set_turning(ax, reach, zoom=1.25, lw=1.5)
    return ax


def new_line(ax: Any, **style: Any) -> Any:
    """Draw an empty line, in the plane or in space; its points are set later."""
    return ax.plot(*[[]] * (3 if ax.name == "space" else 2), **style)[0]


def apart(R: Any, S: Any) -> str:
    """Return the largest angle between the rotations R and S, as text in degrees."""
    return f"{numbers(np.degrees(angle_between(R, S)).max(), 1)}°"


def numbers(values: Any, digits: int) -> str:
    """Return numbers as text, separated by commas; zero has no minus sign."""
    rounded = np.round(np.atleast_1d(values), digits) + 0.0
    return ", ".join(f"{x:.{digits}f}".replace("-", "−") for x in rounded)
