"""Pieces of a scene in space, cut and ordered by depth: near pieces hide pieces behind them.

In the browser, scene.js does the same for each direction of view.
"""

from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from matplotlib.backend_bases import GraphicsContextBase
from matplotlib.cbook import contiguous_regions
from matplotlib.path import Path

from rbcourse import Array

OVER = 10
"""Pieces with at least this zorder are drawn in front of all others."""
NEAR = 0.2
"""A piece whose distance from a plane is less than this, in pixels, lies in the plane."""
OVERLAP = 0.55
"""The overlap, in points, of the parts of a cut opaque piece; it hides the gap between them."""


@dataclass(frozen=True, eq=False)
class Piece:
    """A piece of a scene that is drawn in one step.

    It is a filled "face"; a "line"; a "mark", such as a letter, which always faces the viewer; or a
    "ball", a mark whose plane separates pieces behind it from pieces in front. Its `places`, shape
    (n, 3) or (n, 4), are relative to the middle of the axes, in pixels. For lines, the fourth
    number is the visible length from the start, which places the dashes.
    """

    kind: Literal["face", "line", "mark", "ball"]
    places: Array
    gc: GraphicsContextBase  # the look
    fill: Any = None  # a colour
    marker: tuple[Path, ...] = ()  # outlines at each position, in pixels, with y upwards
    zorder: float = 0.0  # of pieces that no face separates, the lowest zorder is drawn first
    normal: Array | None = None  # of the whole face, of which the piece may be a part
    text: Any = None  # for letters, the artist that draws them in print, with its font

    @property
    def edge(self) -> "Piece":
        """The edge of a face, as a line."""
        ends = np.column_stack([[*self.places, self.places[0]], np.zeros(len(self.places) + 1)])
        return replace(self, kind="line", places=ends, fill=None, normal=None)

    def cut(self, height: Array, overlap: float = 0.0) -> "list[tuple[int, Piece]]":
        """Return the parts above a plane (1), in the plane (0), and below the plane (-1).

        `height` contains the heights of the positions above the plane, shape (n,). Pieces above the
        plane are extended below it by `overlap` pixels, except for transparent or dashed ones.
        """
        side = np.where(np.abs(height) < NEAR, 0, np.sign(height)).astype(int)
        if self.marker:
            return [(s, replace(self, places=self.places[side == s])) for s in set(side.tolist())]
        low, high = int(side.min(initial=0)), int(side.max(initial=0))
        if low * high == 0:
            return [(low + high, self)]
        closed = self.kind == "face"
        opaque = (self.fill or self.gc.get_rgb())[3] == 1 and self.gc.get_dashes()[1] is None
        points = []  # the side of each point, and its place in the parts below and above the plane
        for i, (p, s) in enumerate(zip(self.places, side, strict=True)):
            points.append((s, p, p))
            j = (i + 1) % len(side)
            if s * side[j] < 0 and (closed or j):
                q = p + height[i] / (height[i] - height[j]) * (self.places[j] - p)
                below = (p if s < 0 else self.places[j]) - q
                more = opaque * min(1.0, overlap / float(np.linalg.norm(below[:3])))
                points.append((0, q, q + more * below))
        sides, *both = map(np.array, zip(*points, strict=True))
        parts = []
        for t, places in zip((-1, 1), both, strict=True):
            there = t * sides >= 0
            runs = [there] if closed else [slice(*ends) for ends in contiguous_regions(there)]
            parts += [(t, replace(self, places=places[run])) for run in runs]
        return [(t, part) for t, part in parts if len(part.places) > (2 if closed else 1)]


def in_sight(pieces: list[Piece], eye: Array, overlap: float = 0.0) -> list[Piece]:
    """Return pieces in the order in which they are drawn; `eye` is the direction to the eye.

    The parts of a cut piece overlap by `overlap` pixels (see `Piece.cut`). Each face becomes two
    pieces: its filling, and its edge, which is not drawn where the face is cut.
    """
    parts: list[Piece] = []
    for piece in pieces:
        if piece.kind == "face":
            parts += [replace(piece, gc=context(None, 0)), piece.edge]
        else:
            parts.append(piece)
    hidden, seen = ([p for p in parts if (p.zorder >= OVER) is over] for over in (False, True))
    return [*in_order(hidden, eye, overlap), *sorted(seen, key=lambda piece: piece.zorder)]


def in_order(pieces: list[Piece], eye: Array, overlap: float = 0.0) -> list[Piece]:
    """Return pieces from the farthest to the nearest, cut where they pass through faces.

    The eye is on one side of the plane of a face. Pieces on the other side are drawn first, then
    pieces in the plane in the order of zorder, and then pieces on the side of the eye. The pieces
    on each side are ordered in the same way by their next face. A piece that lies in the plane and
    covers faces, such as an edge, is drawn with the pieces on the side of the eye. Otherwise the
    next faces could cover half of this piece. The first face is the one whose plane cuts the fewest
    faces and lines. Pieces that no face separates are drawn in the order of zorder, then of their
    mean depth in `whole_pixels`, and then in the given order. `eye` is the direction to the eye,
    shape (3,).
    """
    drawn: list[Piece] = []
    todo = [(False, pieces)]  # True if the pieces are already in order
    while todo:
        ready, group = todo.pop()
        wall = _wall(group, eye)
        if ready:
            drawn += group
        elif wall is None:
            depths = [whole_pixels((piece.places[:, :3] @ eye).mean()) for piece in group]
            order = sorted(range(len(group)), key=lambda i: (group[i].zorder, depths[i]))
            drawn += [group[i] for i in order]
        else:
            normal = eye if wall.normal is None else wall.normal
            normal = normal if normal @ eye >= 0 else -normal
            sides: dict[int, list[Piece]] = {-1: [], 0: [wall], 1: []}
            for piece in group:
                if piece is not wall:
                    height = (piece.places[:, :3] - wall.places[0]) @ normal
                    for side, part in piece.cut(height, overlap):
                        sides[side].append(part)
            inside = sorted(sides[0], key=lambda piece: piece.zorder)
            top = max(i for i, piece in enumerate(inside, 1) if piece.kind in ("face", "ball"))
            todo += [(False, inside[top:] + sides[1]), (True, inside[:top]), (False, sides[-1])]
    return drawn


def _wall(group: list[Piece], eye: Array) -> Piece | None:
    """Return the face whose plane cuts the fewest faces and lines, or None if there is no face."""
    walls = [piece for piece in group if piece.kind in ("face", "ball")]
    if len(walls) < 2:
        return walls[0] if walls else None
    whole = [piece.places[:, :3] for piece in group if piece.kind in ("face", "line")]
    starts = np.cumsum([0, *map(len, whole[:-1])])
    normals = np.array([eye if wall.normal is None else wall.normal for wall in walls])
    levels = np.array([wall.places[0] for wall in walls]) * normals
    height = np.concatenate(whole) @ normals.T - levels.sum(axis=1)
    above = np.maximum.reduceat(height, starts) >= NEAR
    below = np.minimum.reduceat(height, starts) <= -NEAR
    return walls[(above & below).sum(axis=0).argmin()]


def whole_pixels(depth: Any) -> Any:
    """Return depths as whole numbers, so that their order does not depend on rounding errors.

    Fractions of 0.7 and more are rounded up, since depths in symmetric scenes rarely have a
    fraction of 0.7.
    """
    return np.floor(depth + 0.3)


def normals_of(corners: Array) -> Array:
    """Return the unit normals of polygons, shape (..., n, 3); 0 for those without an area."""
    spokes = corners[..., 1:, :] - corners[..., :1, :]
    normal = np.cross(spokes[..., :-1, :], spokes[..., 1:, :]).sum(axis=-2)
    size = np.linalg.norm(normal, axis=-1, keepdims=True)
    flat = size <= 1e-9 * np.sum(spokes**2, axis=(-2, -1))[..., None]
    return np.where(flat, 0.0, normal / np.where(flat, 1.0, size))


def context(colour: Any, width: float) -> GraphicsContextBase:
    """Return the graphics context of a colour, which may be None, and a width in points."""
    gc = GraphicsContextBase()
    gc.set_foreground(colour or (0.0, 0.0, 0.0, 0.0), isRGBA=True)
    gc.set_linewidth(width)
    gc.set_joinstyle("round")
    return gc


def crossings(one: list[Piece], other: list[Piece]) -> list[Piece]:
    """Return the lines in which faces of two bodies intersect, with the look of edges."""
    if not one or not other:
        return []
    starts = np.cumsum([0, *(len(face.places) for face in one[:-1])])
    normals = np.array([wall.normal for wall in other])
    levels = np.array([wall.places[0] for wall in other]) * normals
    height = np.concatenate([face.places for face in one]) @ normals.T - levels.sum(axis=1)
    above = np.maximum.reduceat(height, starts) > -NEAR
    below = np.minimum.reduceat(height, starts) < NEAR
    pairs = np.argwhere(above & below)
    return [line for i, j in pairs for line in _crossing(one[i], other[j])]


def _crossing(one: Piece, other: Piece) -> list[Piece]:
    """Return the line in which two faces intersect; coplanar faces have no such line."""
    normal: Any = other.normal
    height = (one.places - other.places[0]) @ normal
    i = np.flatnonzero(height * np.roll(height, -1) < 0)
    if len(i) != 2 or np.abs(height).max() < 0.01:  # in pixels
        return []
    j = (i + 1) % len(height)
    share = (height[i] / (height[i] - height[j]))[:, None]
    ends = np.column_stack([(1 - share) * one.places[i] + share * one.places[j], np.zeros(2)])
    parts = [replace(one.edge, places=ends)]
    edges = np.roll(other.places, -1, 0) - other.places
    inward = np.cross(normal, edges / np.linalg.norm(edges, axis=1, keepdims=True))
    for corner, across in zip(other.places, inward, strict=True):
        cut = (part.cut((part.places[:, :3] - corner) @ across) for part in parts)
        parts = [part for some in cut for side, part in some if side > 0]
    return parts
