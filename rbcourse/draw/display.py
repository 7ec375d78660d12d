"""Display lists: drawings of moving artists as integers, for a canvas in a browser."""

import base64
import html
import json
import re
import zlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from string import Template
from typing import Any

import numpy as np
from matplotlib.backend_bases import RendererBase
from matplotlib.colors import to_hex, to_rgba
from matplotlib.figure import Figure
from numpy.typing import NDArray

from rbcourse.draw.pictures import data_url
from rbcourse.draw.scene import Piece, normals_of
from rbcourse.draw.space import not_in_space, scenes

_SCENE, _DISPLAY = (
    Path(__file__).with_name(f"{name}.js").read_text(encoding="utf-8")
    for name in ("scene", "display")
)
ENGINE = _SCENE + _DISPLAY
"""The JavaScript ``rbcourseScene`` and ``rbcourseDisplay``, which draws records of `Display`."""
PARTS = 8
"""The number of parts of a pixel; positions are counted in parts, and display.js divides by it."""
FAR = 16000
"""The largest coordinate, in parts of a pixel; differences of coordinates are still int16."""

_FIGURE = Template("""\
<figure><img id="$name" width="$width" style="max-width: 100%" alt="$alt" src="$still"/>$caption
<script>{
$engine
for (const image of document.querySelectorAll("#$name")) rbcourseDisplay.revive(image, $data);
}</script></figure>""")


class Display(RendererBase):
    """A Matplotlib renderer that returns drawings of a figure as numbers.

    Its `size`, width and height in pixels, is that of the figure and at most 1500.

    The dict `styles` has the number of each style. A style has the fill colour, the line (its
    colour, width, dashes, ends and corners), the clip rectangle, and the marker, whose polygons are
    written as in `record`. Missing parts are None or empty. Lengths are in pixels, except for
    markers. For a piece in space, the style also has the number of the `Space`, and the kind and
    zorder of the piece.

    The list `rooms` has, for each `Space` of the figure, the ``origin`` (where its centre appears,
    in pixels from the upper left corner) and the ``view`` (azimuth and elevation, in degrees).
    """

    def __init__(self, fig: Figure) -> None:
        super().__init__()
        self._fig = fig
        self.width, self.height = self.size = tuple(round(x) for x in fig.bbox.size)
        if max(self.size) > 1500:  # larger coordinates would not fit into int16
            raise ValueError(f"fig: at most 1500 × 1500 pixels are wanted, got {self.size}")
        self.styles: dict[tuple[Any, ...], int] = {}
        places = [scene.axes.sight().origin * [1, -1] + [0, self.height] for scene in scenes(fig)]
        views = np.round([(scene.axes.azim, scene.axes.elev) for scene in scenes(fig)], 2)
        self.rooms = [
            {"origin": place.round(2).tolist(), "view": view.tolist()}
            for place, view in zip(places, views, strict=True)
        ]
        self._drawn: list[NDArray[np.int16]] = []

    def record(self, artists: Iterable[Any]) -> NDArray[np.int16]:
        """Return the drawing of these artists.

        The result is a sequence of polygons. Each polygon has a style, a number of points, and
        their positions. Positions are in fractions of a pixel from the upper left, and are stored
        as differences from the previous position. A negative number of points means that the
        polygon is filled together with the previous one, for example as a hole. If the style has a
        marker, the marker is drawn at the points. All visible artists in a `Space` are recorded,
        too, with their positions in space.
        """
        self._drawn = [np.zeros(0, np.int16)]
        for room, scene in enumerate(scenes(self._fig)):
            for piece in scene.pieces(self):
                for part in _within(piece, 0.99 * FAR / PARTS):
                    self._keep_piece(room, part)
        for artist in not_in_space(artists):
            artist.draw(self)
        return np.concatenate(self._drawn)

    def _keep_piece(self, room: int, piece: Piece) -> None:
        if piece.kind == "face" and not normals_of(np.round(PARTS * piece.places)).any():
            piece = piece.edge  # the face has no area after rounding
        polygons = (path.to_polygons(closed_only=False) for path in piece.marker)
        marker = _marker(outline for outlines in polygons for outline in outlines)
        look = *self._style(piece.gc, piece.fill)[:-1], marker, room, piece.kind, piece.zorder
        self._keep(look, len(piece.places), piece.places[:, :3])

    def get_canvas_width_height(self) -> tuple[float, float]:
        """Return the size in pixels."""
        return self.width, self.height

    def points_to_pixels(self, points: Any) -> Any:
        """Convert a length from points to pixels."""
        return points * self._fig.dpi / 72

    def draw_path(self, gc: Any, path: Any, transform: Any, rgbFace: Any = None) -> None:
        """Record a path as polygons; Matplotlib calls this method for all drawings."""
        clip = None if rgbFace is not None else (-400, -400, self.width + 400, self.height + 400)
        simple = path.should_simplify and rgbFace is None
        clean = path.cleaned(transform, remove_nans=True, clip=clip, simplify=simple, curves=True)
        clean = type(path)(clean.vertices[:-1], clean.codes[:-1])  # the last vertex is a stop code
        for i, points in enumerate(clean.to_polygons(closed_only=False)):
            number = -len(points) if i and rgbFace is not None else len(points)
            self._keep(self._style(gc, rgbFace), number, points * [1, -1] + [0, self.height])

    def draw_markers(
        self,
        gc: Any,
        marker_path: Any,
        marker_trans: Any,
        path: Any,
        trans: Any,
        rgbFace: Any = None,
    ) -> None:
        """Record the marker, as a part of the style, and the points at which it is drawn."""
        points = trans.transform(path.vertices)
        points = points[np.isfinite(points).all(axis=1)] * [1, -1] + [0, self.height]
        outlines = marker_path.to_polygons(marker_trans, closed_only=False)
        self._keep((*self._style(gc, rgbFace)[:-1], _marker(outlines)), len(points), points)

    def _keep(self, look: tuple[Any, ...], number: int, points: Any) -> None:
        style = self.styles.setdefault(look, len(self.styles))
        self._drawn.append(np.array([style, number, *_steps(points)], np.int16))

    def _style(self, gc: Any, face: Any) -> tuple[Any, ...]:
        width = round(self.points_to_pixels(gc.get_linewidth()), 3)
        dashes = gc.get_dashes()[1] or ()
        clip = gc.get_clip_rectangle()
        alpha = gc.get_alpha() if gc.get_forced_alpha() else None
        box = (clip.x0, self.height - clip.y1, clip.width, clip.height) if clip else ()
        return (
            None if face is None else to_hex(to_rgba(face, alpha), keep_alpha=True),
            to_hex(to_rgba(gc.get_rgb(), alpha), keep_alpha=True) if width else None,
            width,
            tuple(round(self.points_to_pixels(dash), 3) for dash in dashes),
            "square" if gc.get_capstyle() == "projecting" else str(gc.get_capstyle()),
            str(gc.get_joinstyle()),
            tuple(round(float(x), 2) for x in box),
            (),
        )


def _within(piece: Piece, reach: float) -> list[Piece]:
    """Return the parts of a piece that are in a cube; `reach` is half the cube's edge."""
    parts = [piece]
    for side in [*np.eye(3), *-np.eye(3)] if np.abs(piece.places[:, :3]).max() > reach else []:
        cut = (part.cut(reach - part.places[:, :3] @ side) for part in parts)
        parts = [part for some in cut for where, part in some if where >= 0]
    return parts


def _steps(points: Any) -> NDArray[np.int_]:
    exact = np.round(PARTS * points, 6)  # so that all processors round halves alike
    whole = np.clip(np.round(exact), -FAR, FAR).astype(int)
    return np.diff(whole, axis=0, prepend=np.zeros_like(whole[:1])).ravel()


def _marker(outlines: Any) -> tuple[tuple[int, ...], ...]:
    return tuple(tuple(_steps(outline * [1, -1]).tolist()) for outline in outlines)


def joined(states: Sequence[NDArray[np.int16]]) -> bytes:
    """Return states of `Display.record` as bytes: their number, their lengths, and their data."""
    sizes = np.array([len(states), *map(len, states)], "<u4")
    return sizes.tobytes() + np.concatenate(states).astype("<i2").tobytes()


@dataclass(frozen=True)
class Player:
    """A figure that readers can move without Python. Without scripts, it is a still picture.

    There is a state for each combination of the controls. The last control changes fastest, and the
    play button moves it. Without controls, there is one state, whose view can be turned. If an
    explorer in JavaScript computes the states, there is one for each artist. The `parts` then have,
    for each artist, its ``name``, the map ``axes`` from its coordinates to pixels, and, if it is a
    text, the ``anchor`` of the recorded state, in pixels.
    """

    name: str
    alt: str  # the description
    caption: str  # as HTML
    shown: bytes  # the still picture, a PNG with twice the displayed resolution
    background: bytes  # the same of the fixed background
    display: Display  # it has recorded the states
    states: Sequence[NDArray[np.int16]]
    controls: Sequence[dict[str, Any]]  # ``label``, ``values`` as texts, index of the ``first``
    milliseconds: int = 0  # from one state to the next while the figure plays
    texts: Sequence[Any] = ()  # of each state: pairs of name and text, a notice, all as one line
    computed: str = ""  # the name of an explorer
    script: str = ""  # adds it to ``rbcourseDisplay.explorers``
    parts: Sequence[dict[str, Any]] = ()

    def __repr__(self) -> str:
        return f"{self.name}: {self.alt}"

    def _repr_html_(self) -> str:
        engine = (ENGINE if self.display.rooms else _DISPLAY) + self.script
        data = {
            "size": self.display.size,
            "rooms": self.display.rooms,
            "background": data_url(self.background),
            "states": _deflated(joined(self.states)),
            "known": _deflated(_json([list(self.display.styles), self.texts]).encode()),
            "controls": self.controls,
            "milliseconds": self.milliseconds,
        }
        if self.computed:
            data |= {"computed": self.computed, "parts": self.parts}
        return _FIGURE.substitute(
            name=f"{self.name}_{zlib.crc32(self.alt.encode()):08x}",
            width=self.display.width,
            alt=html.escape(self.alt),
            still=data_url(self.shown),
            caption=self.caption,
            engine=re.sub(r"^\s+(//.*)?|\n(?=\n)", "", engine, flags=re.MULTILINE),
            data=_json(data).replace("<", "\\u003c"),
        )


def _json(data: Any) -> str:
    return json.dumps(data, ensure_ascii=False, separators=(",", ":"))


def _deflated(content: bytes) -> str:
    return base64.b64encode(zlib.compress(content, 9)).decode()
