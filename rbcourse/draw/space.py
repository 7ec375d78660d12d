"""Axes for drawings in space; lines, letters, marks and faces form one scene.

Matplotlib draws the artists in space one after the other, so a line is entirely in front of a body
or behind it. In this module, all artists become pieces of a scene, which are cut where they pass
through faces.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import combinations
from numbers import Integral
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from matplotlib.artist import Artist
from matplotlib.backend_bases import GraphicsContextBase, RendererBase
from matplotlib.cbook import contiguous_regions
from matplotlib.colors import to_rgba, to_rgba_array
from matplotlib.figure import Figure
from matplotlib.path import Path
from matplotlib.projections import register_projection
from matplotlib.textpath import text_to_path
from matplotlib.transforms import Affine2D, IdentityTransform
from mpl_toolkits.mplot3d import Axes3D
from mpl_toolkits.mplot3d.art3d import Line3D, Text3D
from mpl_toolkits.mplot3d.proj3d import proj_transform
from numpy.typing import ArrayLike

from rbcourse import Array
from rbcourse.draw.scene import (
    OVERLAP,
    Piece,
    context,
    crossings,
    in_sight,
    normals_of,
    whole_pixels,
)

LIGHT = np.array([0.48, -0.36, 0.8])
"""The direction to the light, a unit vector."""


class Faces(Artist):
    """The faces of a convex body, with a colour for each; those turned to the light are lighter.

    The array `corners`, shape (n, k, 3), has the corners of each face, in order around it.
    """

    def __init__(self, corners: Array, colours: Any) -> None:
        super().__init__()
        self.corners = corners
        self.set(colours=colours, edgecolor="#1a1d21", linewidth=1.2)

    def set_colours(self, colours: Any) -> None:
        """Set the colour of each face; a face with the colour "none" is not filled."""
        self._colours = to_rgba_array(colours)

    def set_edgecolor(self, colour: Any) -> None:
        """Set the colour of all edges."""
        self._edgecolor = colour

    def set_linewidth(self, width: float) -> None:
        """Set the width of all edges, in points."""
        self._linewidth = width

    def pieces(self, scale: float, middle: Array) -> Iterable[Piece]:
        """Return the faces, or the edges of faces that are not filled."""
        centre = self.corners.mean(axis=(0, 1))
        edge = context(to_rgba(self._edgecolor, self.get_alpha()), self._linewidth)
        opacity = 1.0 if self.get_alpha() is None else self.get_alpha()
        normals = normals_of(self.corners)
        for corners, normal, colour in zip(self.corners, normals, self._colours, strict=True):
            if not np.isfinite(corners).all() or not normal.any():
                continue
            outward = np.sign(normal @ (corners.mean(axis=0) - centre)) * normal
            light = round(32 * (0.84 + 0.16 * outward @ LIGHT)) / 32
            fill = (*np.clip(light * colour[:3], 0, 1), opacity * colour[3])
            places, zorder = scale * (corners - middle), self.get_zorder()
            face = Piece("face", places, edge, fill, zorder=zorder, normal=normal)
            yield face if fill[3] else face.edge


class Ball(Artist):
    """A unit ball of white glass at the origin; artists behind it or on its far side look pale."""

    def pieces(self, scale: float, middle: Array) -> Iterable[Piece]:
        """Return the visible disc; its plane passes through the centre."""
        turn = np.linspace(0, 2 * np.pi, 91)
        disc = Path(scale * np.stack([np.cos(turn), np.sin(turn)], axis=-1))
        fill = to_rgba("white", 0.7)
        place = -scale * middle[None]
        yield Piece("ball", place, context(to_rgba("0.8"), 0.8), fill, (disc,))


class Scene(Artist):
    """The contents of a `Space`: its lines, letters, `Faces` and `Ball`, drawn by depth."""

    axes: Any

    def __init__(self) -> None:
        super().__init__()
        self.set_in_layout(False)
        # the pieces of lines and letters, kept until an artist changes
        self._known: WeakKeyDictionary[Artist, tuple[Any, list[Piece]]] = WeakKeyDictionary()

    @property
    def artists(self) -> list[Any]:
        """The artists in the scene."""
        for artist in self.axes.get_children():
            if hasattr(artist, "do_3d_projection"):
                name = type(artist).__name__
                raise ValueError(f"{name}: lines, letters, Faces or a Ball are wanted in a Space")
        return [artist for artist in self.axes.get_children() if isinstance(artist, IN_SPACE)]

    def pieces(self, renderer: Any) -> list[Piece]:
        """Return all visible pieces, uncut, in the view of the axes.

        The pieces include the lines in which two bodies intersect.
        """
        found: list[Piece] = []
        bodies: list[list[Piece]] = []
        sight = self.axes.sight()
        for artist in [artist for artist in self.artists if artist.get_visible()]:
            if isinstance(artist, Faces | Ball):
                body = list(artist.pieces(sight.scale, sight.middle))
                bodies.append([piece for piece in body if piece.kind == "face"])
                found += body
                continue
            known, made = self._known.get(artist, (None, []))
            if artist.stale or known != sight.key:
                looks = Looks(renderer, isinstance(artist, Text3D))
                artist.draw(looks)
                make = _letters if isinstance(artist, Text3D) else _strokes
                made = [piece for piece in make(artist, looks, sight) if len(piece.places)]
                self._known[artist] = sight.key, made
            found += made
        for one, other in combinations(bodies, 2):
            found += crossings(one, other)
        return found

    def draw(self, renderer: Any) -> None:
        """Draw all visible pieces."""
        sight, written = self.axes.sight(), set()
        overlap = renderer.points_to_pixels(OVERLAP)
        for piece in in_sight(self.pieces(renderer), sight.eye, overlap):
            if piece.text:
                if piece.text not in written:  # this draws all lines of the text
                    piece.text.draw(renderer)
                written.add(piece.text)
                continue
            gc = renderer.new_gc()
            gc.copy_properties(piece.gc)
            seen = sight.flat(piece.places[:, :3])
            dashes = gc.get_dashes()[1]
            if dashes is not None:
                gc.set_dashes(piece.places[0, 3] / renderer.points_to_pixels(1), dashes)
            for path in piece.marker:
                depths = whole_pixels(piece.places[:, :3] @ sight.eye)
                nearer = np.argsort(depths, kind="stable")
                renderer.draw_markers(gc, path, _SAME, Path(seen[nearer]), _SAME, piece.fill)
            if not piece.marker:
                ends = seen[[*range(len(seen)), 0]] if piece.fill else seen
                renderer.draw_path(gc, Path(ends), _SAME, piece.fill)
            gc.restore()


class Looks(RendererBase):
    """A renderer that records the look of an artist: context, filling, and outlines in pixels.

    The outlines belong to letters or to the marker of a line.
    """

    def __init__(self, renderer: Any, letters: bool) -> None:
        super().__init__()
        self._text2path = text_to_path  # shared: it parses each formula once, not in each frame
        self.renderer, self.letters = renderer, letters
        self.found: list[tuple[GraphicsContextBase, Any, tuple[Path, ...]]] = []

    def points_to_pixels(self, points: Any) -> Any:
        """Convert a length from points to pixels."""
        return self.renderer.points_to_pixels(points)

    def get_canvas_width_height(self) -> Any:
        """Return the size in pixels."""
        return self.renderer.get_canvas_width_height()

    def _keep(self, gc: Any, fill: Any, outlines: tuple[Path, ...]) -> None:
        kept = GraphicsContextBase()
        kept.copy_properties(gc)
        kept.set_clip_rectangle(None)
        kept.set_clip_path(None)
        kept.set_capstyle("butt")  # otherwise the parts of a cut line would overlap
        self.found.append((kept, fill, outlines))

    def draw_path(self, gc: Any, path: Any, transform: Any, rgbFace: Any = None) -> None:
        """Record letters, or the look of a line."""
        self._keep(gc, rgbFace, (path.transformed(transform),) if self.letters else ())

    def draw_markers(
        self,
        gc: Any,
        marker_path: Any,
        marker_trans: Any,
        path: Any,
        trans: Any,
        rgbFace: Any = None,
    ) -> None:
        """Record the marker."""
        self._keep(gc, rgbFace, (marker_path.transformed(marker_trans),))


@dataclass(frozen=True)
class Sight:
    """The view of a `Space`; `right`, `up` and `eye` are unit vectors, the last one to the eye."""

    scale: float  # pixels per unit of length
    middle: Array  # of the limits; it does not move when the view turns
    origin: Array  # the image of the middle, in pixels
    right: Array
    up: Array
    eye: Array

    @property
    def key(self) -> bytes:
        """The bytes of the view, which are equal for equal views."""
        parts = self.middle, self.origin, self.right, self.up
        return np.concatenate([[self.scale], *parts]).tobytes()

    def flat(self, places: Array) -> Array:
        """Project positions relative to the middle to image points in pixels, shape (n, 2)."""
        return self.origin + places @ np.stack([self.right, self.up], axis=-1)


class Space(Axes3D):  # type: ignore[misc]
    """Axes in space with equal units and parallel projection.

    The axes are the Matplotlib projection "space": ``plt.subplots(subplot_kw={"projection":
    "space"})``. Artists are added by ``plot`` and ``text``, and by ``add_artist`` with `Faces` or a
    `Ball`. Elevations are from -90° to 90°, and the roll is 0. The `scene` draws all contents.
    """

    name = "space"

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        self._magnified = 1.0
        super().__init__(*args, proj_type="ortho", **kwargs)
        self.set_axis_off()
        self.patch.set_visible(False)
        self.scene = Scene()
        self.scene.axes = self
        self.scene.set_figure(self.get_figure())

    def fit(self, low: ArrayLike, high: ArrayLike, zoom: float = 1.0) -> None:
        """Fit the axes to the box between two corners, shape (3,)."""
        (x0, y0, z0), (x1, y1, z1) = np.array(low, float), np.array(high, float)
        self.set(xlim=(x0, x1), ylim=(y0, y1), zlim=(z0, z1))
        self._magnified = zoom

    def sight(self) -> Sight:
        """Return the view of the axes."""
        if self.roll or not -90 <= self.elev <= 90:
            view = f"elev {self.elev:g}, roll {self.roll:g}"
            raise ValueError(f"view_init: -90 <= elev <= 90 and roll 0 are wanted, got {view}")
        low, high = np.reshape(self.get_w_lims(), (3, 2)).T
        self.set_box_aspect(high - low, zoom=self._magnified)
        self.apply_aspect()
        self.M = self.get_proj()
        middle = (low + high) / 2
        x, y, _ = proj_transform(*(middle + np.vstack([np.zeros(3), np.eye(3)])).T, self.M)
        seen = self.transData.transform(np.stack([x, y], axis=-1))
        across = (seen[1:] - seen[0]).T
        scale = float(np.linalg.norm(across[0]))
        right, up = across / scale
        return Sight(scale, middle, seen[0], right, up, np.cross(right, up))

    def draw(self, renderer: Any) -> None:
        """Draw the artists that are not in space, such as titles, and then the scene."""
        if not self.get_visible():
            return
        inside = [artist for artist in self.scene.artists if artist.get_visible()]
        for artist in inside:  # otherwise Matplotlib would draw them, too
            artist.set_visible(False)
        try:
            super().draw(renderer)
        finally:
            for artist in inside:
                artist.set_visible(True)
        if not self.scene.get_animated() or self.get_figure().canvas.is_saving():
            self.scene.draw(renderer)


register_projection(Space)

IN_SPACE = Line3D | Text3D | Faces | Ball
_SAME = IdentityTransform()


def scenes(fig: Figure) -> list[Scene]:
    """Return the scenes of a figure."""
    return [ax.scene for ax in fig.axes if isinstance(ax, Space)]


def not_in_space(artists: Iterable[Any]) -> list[Any]:
    """Return those artists that are not in a scene."""
    return [artist for artist in artists if not isinstance(artist, IN_SPACE)]


def _letters(artist: Text3D, looks: Looks, sight: Sight) -> Iterable[Piece]:
    place = sight.scale * (np.array([artist.get_position_3d()]) - sight.middle)
    back = Affine2D().translate(*-sight.flat(place)[0])
    for gc, fill, outlines in looks.found:
        letters = tuple(back.transform_path(path) for path in outlines)
        yield Piece("mark", place, gc, fill, letters, artist.get_zorder(), text=artist)


def _strokes(artist: Line3D, looks: Looks, sight: Sight) -> Iterable[Piece]:
    places = sight.scale * (np.stack(artist.get_data_3d(), axis=-1) - sight.middle)
    for gc, fill, marker in looks.found:
        if marker:
            marked = places[_marked(artist.get_markevery())]
            some = marked[np.isfinite(marked).all(axis=1)]
            yield Piece("mark", some, gc, fill, marker, artist.get_zorder())
        else:
            for start, stop in contiguous_regions(np.isfinite(places).all(axis=1)):
                if stop - start > 1:
                    run = places[start:stop]
                    steps = np.linalg.norm(np.diff(sight.flat(run), axis=0), axis=1)
                    along = np.cumsum([0.0, *steps])  # the visible distance along the line
                    run = np.column_stack([run, along])
                    yield Piece("line", run, gc, zorder=artist.get_zorder())


def _marked(every: Any) -> Any:
    """Return an index that selects the points of a line that have a marker."""
    if every is None or isinstance(every, Integral):
        return slice(None, None, every)
    if isinstance(every, list | slice):
        return every
    raise ValueError(f"markevery: None, an integer, a list or a slice is wanted, got {every!r}")
