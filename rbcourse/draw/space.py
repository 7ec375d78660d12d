"""Axes for what is in space: what is before hides what is behind, in print and in the browser.

Matplotlib draws one artist in space after the other, so that a line is before or behind all of a
body. Here lines, letters, marks and the faces of bodies are pieces of one scene, which are cut
where they pass through one another. The browser does the same, for each direction of view, with
`rbcourseScene` in scene.js.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from matplotlib.artist import Artist
from matplotlib.backend_bases import GraphicsContextBase, RendererBase
from matplotlib.colors import to_rgba, to_rgba_array
from matplotlib.path import Path
from matplotlib.projections import register_projection
from matplotlib.transforms import Affine2D, IdentityTransform
from mpl_toolkits.mplot3d import Axes3D
from mpl_toolkits.mplot3d.art3d import Line3D, Text3D
from mpl_toolkits.mplot3d.proj3d import proj_transform
from numpy.typing import ArrayLike

from rbcourse._numerics import Array

LIGHT = np.array([0.48, -0.36, 0.8])
"""Where the light comes from: a unit vector."""
OVER = 10
"""What has this zorder, or a higher one, is seen through everything."""
NEAR = 0.2
"""A piece that is nearer to a plane than this, in pixels, lies in it."""


@dataclass(frozen=True, eq=False)
class Piece:
    """What is drawn in one go.

    Parameters
    ----------
    kind : str
        A filled "face"; a "line"; a "mark", which is always seen from its front, as letters are; or
        a "ball", a mark with a plane that parts the others.
    places : ndarray, shape (n, 3) or (n, 4)
        In the room, in pixels from its origin; of lines also how far each is along the line, as it
        is seen, for dashes.
    gc : GraphicsContextBase
        How it is drawn.
    fill : tuple of float, optional
        The colour that it is filled with.
    marker : tuple of Path
        What is drawn at each of its places, in pixels, y upwards.
    zorder : float
        Of what no face parts that is drawn first where it is least.
    """

    kind: Literal["face", "line", "mark", "ball"]
    places: Array
    gc: GraphicsContextBase
    fill: Any = None
    marker: tuple[Path, ...] = ()
    zorder: float = 0.0

    @property
    def edge(self) -> "Piece":
        """The edge of a face, as a line."""
        ends = np.pad(self.places, ((0, 1), (0, 1)), mode="wrap")
        ends[:, 3] = 0
        return replace(self, kind="line", places=ends, fill=None)

    def cut(self, height: Array) -> "list[tuple[int, Piece]]":
        """Return the parts above a plane (1), in it (0), and below (-1).

        `height` is that of the places over the plane, shape (n,).
        """
        side = np.where(np.abs(height) < NEAR, 0, np.sign(height)).astype(int)
        if self.marker:
            return [(s, replace(self, places=self.places[side == s])) for s in set(side.tolist())]
        low, high = int(side.min(initial=0)), int(side.max(initial=0))
        if low * high == 0:
            return [(low + high, self)]
        closed = self.kind == "face"
        parts: dict[int, list[list[Array]]] = {-1: [[]], 1: [[]]}
        for i, (p, s) in enumerate(zip(self.places, side, strict=True)):
            for t in (-1, 1):
                if s in (t, 0):
                    parts[t][-1].append(p)
            j = (i + 1) % len(side)
            if s * side[j] < 0 and (closed or j):
                q = p + height[i] / (height[i] - height[j]) * (self.places[j] - p)
                parts[s][-1].append(q)
                if not closed:
                    parts[s].append([])
                parts[int(side[j])][-1].append(q)
        return [
            (t, replace(self, places=np.array(run)))
            for t, runs in parts.items()
            for run in runs
            if len(run) > 1
        ]


def in_sight(pieces: list[Piece], eye: Array) -> list[Piece]:
    """Return pieces in the order in which they are drawn; `eye` is the direction to the eye.

    A face has become two: what fills it, and its edge, which is not drawn where the face is cut.
    """
    inner = _context(None, 0)
    pieces = [
        part
        for piece in pieces
        for part in ([replace(piece, gc=inner), piece.edge] if piece.kind == "face" else [piece])
    ]
    hidden, seen = ([p for p in pieces if (p.zorder >= OVER) is over] for over in (False, True))
    return [*in_order(hidden, eye), *seen]


def in_order(pieces: list[Piece], eye: Array) -> list[Piece]:
    """Return pieces from the farthest to the nearest, cut where they pass through one another.

    The plane of a face has the eye on one of its sides. What is on the other side is drawn first,
    then what is in the plane, then what is on the side of the eye; and so on with the next face,
    on both sides. `eye` is the direction to the eye, shape (3,).
    """
    wall = next((piece for piece in pieces if piece.kind in ("face", "ball")), None)
    if wall is None:
        return sorted(pieces, key=lambda one: (one.zorder, (one.places[:, :3] @ eye).mean()))
    origin, normal = plane(wall.places) if wall.kind == "face" else (wall.places[0], eye)
    normal = normal if normal @ eye >= 0 else -normal
    sides: dict[int, list[Piece]] = {-1: [], 0: [], 1: []}
    for piece in pieces:
        for side, part in piece.cut((piece.places[:, :3] - origin) @ normal):
            sides[side].append(part)
    return [*in_order(sides[-1], eye), *sides[0], *in_order(sides[1], eye)]


def plane(places: Array) -> tuple[Array, Array]:
    """Return a point of the plane of a polygon, and its unit normal."""
    spokes = places[1:, :3] - places[0, :3]
    normal = np.cross(spokes[:-1], spokes[1:]).sum(axis=0)
    return places[0, :3], normal / (np.linalg.norm(normal) or 1.0)


class Faces(Artist):
    """The faces of a convex body, lighter where they are turned to the light.

    Parameters
    ----------
    corners : array_like, shape (n, k, 3)
        Of each face its corners, one after the other.
    colours : sequence of colours
        Of each face.
    edgecolor : colour, optional
    linewidth : float, optional
        In points.
    """

    def __init__(
        self, corners: Array, colours: Any, edgecolor: Any = "0.3", linewidth: float = 0.8
    ) -> None:
        super().__init__()
        self.corners = corners
        self.set_colours(colours)
        self.set_edgecolor(edgecolor)
        self.set_linewidth(linewidth)

    def set_colours(self, colours: Any) -> None:
        """Set the colour of each face; "none": it is not filled."""
        self._colours = to_rgba_array(colours)

    def set_edgecolor(self, colour: Any) -> None:
        """Set the colour of all edges."""
        self._edgecolor = colour

    def set_linewidth(self, width: float) -> None:
        """Set the width of all edges, in points."""
        self._linewidth = width

    def pieces(self, scale: float) -> Iterable[Piece]:
        """Return the faces; of those that are not filled their edges."""
        middle = self.corners.mean(axis=(0, 1))
        for corners, colour in zip(self.corners, self._colours, strict=True):
            _, normal = plane(corners)
            outward = np.sign(normal @ (corners.mean(axis=0) - middle))
            light = round(32 * (0.78 + 0.22 * outward * (normal @ LIGHT))) / 32
            alpha = colour[3] * (1.0 if self.get_alpha() is None else self.get_alpha())
            edge = _context(to_rgba(self._edgecolor, self.get_alpha()), self._linewidth)
            fill = (*np.clip(light * colour[:3], 0, 1), alpha)
            face = Piece("face", scale * corners, edge, fill)
            yield face if alpha else face.edge


class Ball(Artist):
    """A ball of white glass: what is behind it, or on its far side, is pale.

    Parameters
    ----------
    radius : float, optional
        Its centre is the origin.
    """

    def __init__(self, radius: float = 1.0) -> None:
        super().__init__()
        self.radius = radius

    def pieces(self, scale: float) -> Iterable[Piece]:
        """Return the disc that is seen; its plane goes through the centre."""
        turn = np.linspace(0, 2 * np.pi, 91)
        disc = Path(scale * self.radius * np.stack([np.cos(turn), np.sin(turn)], axis=-1))
        fill = to_rgba("white", 0.7)
        yield Piece("ball", np.zeros((1, 3)), _context(to_rgba("0.8"), 0.8), fill, (disc,))


class Scene(Artist):
    """All that is in a `Space`: its lines, letters, `Faces` and `Ball`, drawn in their order."""

    axes: Any

    def __init__(self) -> None:
        super().__init__()
        self.set_in_layout(False)
        self._known: dict[Artist, tuple[Any, list[Piece]]] = {}  # as long as they do not change

    @property
    def artists(self) -> list[Any]:
        """What is in the scene."""
        kinds = Line3D | Text3D | Faces | Ball
        return [artist for artist in self.axes.get_children() if isinstance(artist, kinds)]

    def pieces(self, renderer: Any) -> list[Piece]:
        """Return what is visible, whole, as it is seen from where the axes are seen."""
        found: list[Piece] = []
        scale, origin, sight = self.axes.sight()
        now = scale, origin.tobytes(), sight.tobytes()
        for artist in [artist for artist in self.artists if artist.get_visible()]:
            if isinstance(artist, Faces | Ball):
                found += artist.pieces(scale)
                continue
            if artist.stale or self._known.get(artist, (None,))[0] != now:
                looks = Looks(renderer)
                artist.draw(looks)
                make = _letters if isinstance(artist, Text3D) else _strokes
                made = [p for p in make(artist, looks, scale, origin, sight) if len(p.places)]
                self._known[artist] = now, made
            found += self._known[artist][1]
        return found

    def draw(self, renderer: Any) -> None:
        """Draw all that is visible."""
        if not self.get_visible():
            return
        _, origin, sight = self.axes.sight()
        for piece in in_sight(self.pieces(renderer), sight[2]):
            gc = renderer.new_gc()
            gc.copy_properties(piece.gc)
            seen = origin + piece.places[:, :3] @ sight[:2].T
            dashes = gc.get_dashes()[1]
            if dashes is not None:
                gc.set_dashes(piece.places[0, 3] / renderer.points_to_pixels(1), dashes)
            for path in piece.marker:
                nearer = np.argsort(piece.places[:, :3] @ sight[2], kind="stable")
                renderer.draw_markers(gc, path, _SAME, Path(seen[nearer]), _SAME, piece.fill)
            if not piece.marker:
                ends = seen[[*range(len(seen)), 0]] if piece.fill else seen
                renderer.draw_path(gc, Path(ends), _SAME, piece.fill)
            gc.restore()


class Looks(RendererBase):
    """A renderer that keeps how an artist is drawn: context, filling, and outlines in pixels."""

    def __init__(self, renderer: Any) -> None:
        super().__init__()
        self.points_to_pixels = renderer.points_to_pixels
        self.get_canvas_width_height = renderer.get_canvas_width_height
        self.found: list[tuple[GraphicsContextBase, Any, tuple[Path, ...]]] = []

    def _keep(self, gc: Any, fill: Any, outlines: tuple[Path, ...]) -> None:
        kept = GraphicsContextBase()
        kept.copy_properties(gc)
        kept.set_clip_rectangle(None)
        self.found.append((kept, fill, outlines))

    def draw_path(self, gc: Any, path: Any, transform: Any, rgbFace: Any = None) -> None:
        """Keep the outlines of letters; of lines the context alone is wanted."""
        outlines = () if rgbFace is None else (path.transformed(transform),)
        self._keep(gc, rgbFace, outlines)

    def draw_markers(
        self,
        gc: Any,
        marker_path: Any,
        marker_trans: Any,
        path: Any,
        trans: Any,
        rgbFace: Any = None,
    ) -> None:
        """Keep the marker."""
        self._keep(gc, rgbFace, (marker_path.transformed(marker_trans),))


class Space(Axes3D):  # type: ignore[misc]
    """Axes in which units are equal and what is far is as large as what is near.

    They are the projection "space" of Matplotlib: ``plt.subplots(subplot_kw={"projection":
    "space"})``. ``plot``, ``text`` and ``add_artist``, with `Faces` or a `Ball`, put into them what
    is to be seen.

    Attributes
    ----------
    scene : Scene
        The artist that draws all of it.
    """

    name = "space"

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, proj_type="ortho", **kwargs)
        self.set_axis_off()
        self.patch.set_visible(False)
        self.scene = Scene()
        self.scene.axes = self
        self.scene.set_figure(self.get_figure())

    def fit(self, low: ArrayLike, high: ArrayLike, zoom: float = 1.0) -> None:
        """Show what is between two corners, shape (3,)."""
        (x0, y0, z0), (x1, y1, z1) = low, high = np.array(low, float), np.array(high, float)
        self.set(xlim=(x0, x1), ylim=(y0, y1), zlim=(z0, z1))
        self.set_box_aspect(high - low, zoom=zoom)

    def sight(self) -> tuple[float, Array, Array]:
        """Return pixels per unit, the place of the origin in pixels, and three unit vectors.

        They point to the right, upwards, and to the eye, shape (3, 3).
        """
        self.apply_aspect()
        self.M = self.get_proj()
        x, y, _ = proj_transform(*np.column_stack([np.zeros(3), np.eye(3)]), self.M)
        seen = self.transData.transform(np.stack([x, y], axis=-1))
        across = (seen[1:] - seen[0]).T
        scale = float(np.linalg.norm(across[0]))
        right, up = across / scale
        return scale, seen[0], np.stack([right, up, np.cross(right, up)])

    def draw(self, renderer: Any) -> None:
        """Draw the scene, and over it what is not in space: titles, legends."""
        if not self.scene.get_animated() or self.get_figure(root=True).canvas.is_saving():
            self.scene.draw(renderer)
        hidden = [artist for artist in self.scene.artists if artist.get_visible()]
        for artist in hidden:  # or each of them would be drawn once more
            artist.set_visible(False)
        super().draw(renderer)
        for artist in hidden:
            artist.set_visible(True)


register_projection(Space)

_SAME = IdentityTransform()


def scenes(artists: Iterable[Any]) -> list[Any]:
    """Return artists, each scene instead of what is in it."""
    found = (
        artist.axes.scene
        if isinstance(artist.axes, Space) and artist in artist.axes.scene.artists
        else artist
        for artist in artists
    )
    return list(dict.fromkeys(found))


def _letters(
    artist: Text3D, looks: Looks, scale: float, origin: Array, sight: Array
) -> Iterable[Piece]:
    place = scale * np.array([artist.get_position_3d()])
    back = Affine2D().translate(*(-origin - place[0] @ sight[:2].T))
    for gc, fill, outlines in looks.found:
        letters = tuple(back.transform_path(path) for path in outlines)
        yield Piece("mark", place, gc, fill, letters, artist.get_zorder())


def _strokes(
    artist: Line3D, looks: Looks, scale: float, origin: Array, sight: Array
) -> Iterable[Piece]:
    places = scale * np.stack(artist.get_data_3d(), axis=-1)
    every: Any = artist.get_markevery()
    marked = places[:: every or 1] if every is None or isinstance(every, int) else places[every]
    for gc, fill, marker in looks.found:
        if marker:
            some = marked[np.isfinite(marked).all(axis=1)]
            yield Piece("mark", some, gc, fill, marker, artist.get_zorder())
        else:
            for run in _runs(places):
                yield Piece("line", _along(run, sight), gc, zorder=artist.get_zorder())


def _context(colour: Any, width: float) -> GraphicsContextBase:
    gc = GraphicsContextBase()
    gc.set_foreground(colour or (0.0, 0.0, 0.0, 0.0), isRGBA=True)
    gc.set_linewidth(width)
    gc.set_joinstyle("round")
    return gc


def _runs(places: Array) -> list[Array]:
    """Return the parts of a line between places that are not finite."""
    gaps = np.flatnonzero(~np.isfinite(places).all(axis=1))
    parts = np.split(places, gaps)
    kept = (part[np.isfinite(part).all(axis=1)] for part in parts)
    return [part for part in kept if len(part) > 1]


def _along(places: Array, sight: Array) -> Array:
    """Return places, and how far each is along their line, as it is seen."""
    steps = np.linalg.norm(np.diff(places @ sight[:2].T, axis=0), axis=1)
    return np.column_stack([places, np.concatenate([[0.0], np.cumsum(steps)])])
