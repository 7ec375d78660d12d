"""Scenes in space: nearer objects hide farther ones, from every viewpoint."""

import inspect
import io
import sys
from functools import partial
from itertools import pairwise

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.proj3d import proj_transform
from PIL import Image

import rbcourse as rb
from rbcourse.draw import bodies, scene, space, spheres

SIDES = [(elev, azim) for elev in (-50, 5, 60) for azim in (-170, -80, 10, 100)]


@pytest.fixture
def ax():
    axes = Figure(figsize=(4, 4), dpi=100).add_subplot(projection="space")
    axes.fit(-np.ones(3), np.ones(3))
    return axes


def drawn(ax):
    """Return the parts of a scene in drawing order, and the view."""
    pieces = ax.scene.pieces(FigureCanvasAgg(ax.figure).get_renderer())
    return scene.in_sight(pieces, ax.sight().eye), ax.sight()


@pytest.mark.parametrize("fitted", [True, False])
def test_the_view_agrees_with_matplotlib(fitted):
    ax = Figure(figsize=(2, 2)).add_subplot(projection="space")
    ax.plot([0, 1], [0, 5], [0, 20])
    if fitted:
        ax.fit([0, 0, 0], [1, 5, 2])
    first, places = ax.sight().origin, np.random.default_rng(1).uniform(-1, 1, (20, 3))
    for side in SIDES:
        ax.view_init(*side)
        ax.figure.draw_without_rendering()
        sight = ax.sight()
        frame = np.stack([sight.right, sight.up, sight.eye])
        assert np.abs(frame @ frame.T - np.eye(3)).max() < 1e-12
        (cos_e, cos_a), (sin_e, sin_a) = np.cos(np.radians(side)), np.sin(np.radians(side))
        assert np.abs(sight.eye - [cos_e * cos_a, cos_e * sin_a, sin_e]).max() < 1e-12
        assert np.abs(sight.origin - first).max() < 1e-9
        x, y, _ = proj_transform(*places.T, ax.get_proj())
        want = ax.transData.transform(np.stack([x, y], axis=-1))
        assert np.abs(sight.flat(sight.scale * (places - sight.middle)) - want).max() < 1e-9


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (("view_init", 20, 0, 30), "^view_init: -90 <= elev <= 90 and roll 0 are wanted"),
        (("view_init", 90.5), "^view_init: -90 <= elev <= 90 and roll 0 are wanted"),
        (("scatter", [0], [0], [0]), "^Path3DCollection: lines, letters, Faces or a Ball"),
        (("set_title", r"$\frac{1$"), "frac"),
    ],
)
def test_scenes_that_cannot_be_drawn_are_refused(ax, call, message):
    (line,) = ax.plot([0, 1], [0, 0], [0, 0])
    getattr(ax, call[0])(*call[1:])
    with pytest.raises(ValueError, match=message):
        ax.figure.draw_without_rendering()
    assert line.get_visible()


def book(ax):
    """Draw a book, and its three axes through it."""
    R = rb.sample_rotation(rng=np.random.default_rng(3))
    bodies.draw_box(ax, rb.pose_from_components(R, np.zeros(3)), np.array([0.9, 0.6, 0.14]))
    for axis in R.T:
        ax.plot(*np.outer(axis, [-0.7, 0.7]), lw=3, zorder=7)


def tangle(ax):
    """Draw triangles, lines and marks that pass through one another."""
    rng = np.random.default_rng(2)
    for _ in range(8):
        ax.add_artist(space.Faces(rng.uniform(-1, 1, (1, 3, 3)), ["red"]))
    ax.plot(*rng.uniform(-1, 1, (3, 10)))
    ax.plot(*rng.uniform(-1, 1, (3, 50)), "o")


def ball(ax):
    """Draw a ball with points on it, and a line through it."""
    spheres.draw_sphere(ax)
    ax.plot(*rb.sample_rotation(100, rng=np.random.default_rng(4))[:, :, 0].T, "o")
    ax.plot([-1.2, 1.2], [0.3, -0.3], [0, 0])


def sampled(part):
    """Return sample points of a part: on a line, or on the edges of a face."""
    ends, shares = part.places[:, :3], np.linspace(0.02, 0.98, 40)[:, None, None]
    return ends if part.marker else (ends[:-1] + shares * np.diff(ends, axis=0)).reshape(-1, 3)


def covers(face, places, sight):
    """Return a mask of the places that appear within the outline of a face or a ball."""
    corners = sight.flat(face.places)
    (x, y), to = (np.roll(corners, -1, axis=0) - corners).T, sight.flat(places)[:, None] - corners
    if face.kind == "ball":
        return np.linalg.norm(to[:, 0], axis=1) < sight.scale
    turn = x * to[..., 1] - y * to[..., 0]
    return (turn > 0).all(axis=1) | (turn < 0).all(axis=1)


@pytest.mark.parametrize("make", [book, tangle, ball])
def test_each_part_is_drawn_before_the_faces_that_hide_it(ax, make):
    make(ax)
    for side in SIDES[::2]:
        ax.view_init(*side)
        parts, sight = drawn(ax)
        found = [sampled(part) for part in parts]
        number = np.repeat(np.arange(len(parts)), [len(each) for each in found])
        places, hidden = np.concatenate(found), 0
        for i, face in enumerate(parts):
            if face.kind in ("face", "ball"):
                normal = sight.eye if face.normal is None else face.normal
                height = (places - face.places[0]) @ normal * np.sign(normal @ sight.eye)
                over = covers(face, places, sight) & (np.abs(height) > 4 * scene.NEAR)
                assert np.array_equal(height[over] > 0, number[over] > i), side
                hidden += (height[over] < 0).sum()
        assert hidden > 100


def test_a_line_that_is_cut_keeps_its_length_and_its_dashes(ax):
    bodies.draw_box(ax, np.eye(4), 0.5)
    # the line has two segments, to the right and back to the left
    corners = np.array([[-1, 0.1, 0.05], [1, 0.1, 0], [-1, -0.1, -0.05]])
    ax.plot(*corners.T, ls="--", lw=3)
    parts, sight = drawn(ax)
    line = [part.places for part in parts if part.gc.get_linewidth() == 3]
    assert len(line) > 2
    for one, after in pairwise(sorted(line, key=lambda places: places[0, 3])):
        assert np.abs(one[-1] - after[0]).max() < 1e-9
    steps = np.linalg.norm(np.diff(sight.flat(sight.scale * corners), axis=0), axis=1)
    assert max(places[-1, 3] for places in line) == pytest.approx(steps.sum())


def test_intersecting_bodies_have_an_outline_where_they_meet(ax):
    """A corner of one cube is inside the other cube, so six lines meet at their ends."""
    corners, apart = bodies.draw_box(ax, np.eye(4), 1.0).corners[:6], np.array([0.4, 0.3, 0.2])
    ax.artists[0].remove()
    cube, other = (ax.add_artist(space.Faces(c, 6 * ["0.9"])) for c in (corners, corners + apart))
    pieces, scale = ax.scene.pieces(FigureCanvasAgg(ax.figure).get_renderer()), ax.sight().scale
    lines = np.array([piece.places[:, :3] / scale for piece in pieces if piece.kind == "line"])
    for centre in (0, apart):  # the lines are on the faces of both cubes
        assert np.abs(np.abs(lines - centre).max(axis=-1) - 0.5).max() < 1e-12
    ends, counts = np.unique(lines.reshape(-1, 3).round(9), axis=0, return_counts=True)
    assert (len(lines), len(ends), set(counts)) == (6, 6, {2})
    other.corners = cube.corners + np.array([1.1, 0, 0])
    pieces = ax.scene.pieces(FigureCanvasAgg(ax.figure).get_renderer())
    assert {piece.kind for piece in pieces} == {"face"}


def test_bodies_in_the_same_place_have_no_outline_where_their_faces_coincide(ax):
    """The corners differ by rounding errors only."""
    corners = bodies.draw_box(ax, np.eye(4), 1.0).corners[:6]
    ax.artists[0].remove()
    one, other = (ax.add_artist(space.Faces(corners, 6 * ["0.9"])) for _ in "ab")
    for turn in rb.exp_so3(np.random.default_rng(1).normal(size=(50, 3))):
        one.corners, other.corners = corners @ turn.T, corners @ (turn @ turn.T @ turn).T
        pieces = ax.scene.pieces(FigureCanvasAgg(ax.figure).get_renderer())
        assert {piece.kind for piece in pieces} == {"face"}


def test_the_zorder_decides_the_order_in_the_plane_of_a_face(ax):
    ax.plot([-0.4, 0.4], [0, 0], [0.5, 0.5], lw=3, zorder=9)
    bodies.draw_box(ax, np.eye(4), 1.0)
    ax.text(0, 0, 0, "inside", zorder=scene.OVER)
    ax.text(0, 0, 0, "over it", zorder=scene.OVER + 1)
    ax.plot([0, 1], [0, 0], [0, 0], zorder=scene.OVER + 0.5)
    ax.view_init(30, -60)
    parts, sight = drawn(ax)
    assert [part.kind for part in parts[-3:]] == ["mark", "line", "mark"]
    in_plane = [part for part in parts if np.allclose(part.places[:, 2], 0.5 * sight.scale)]
    assert [part.kind for part in in_plane] == ["face", "line", "line"]
    assert in_plane[-1].gc.get_linewidth() == 3


def test_a_line_is_not_drawn_in_its_gaps(ax):
    places = np.array([[0, 0, 0], [1, 0, 0], [np.nan] * 3, [0, 1, 0], [1, 1, 0], [0, np.inf, 0]])
    (line,) = ax.plot(*places.T)
    parts, sight = drawn(ax)
    scale = sight.scale
    assert sorted(part.places[:, 1].tolist() for part in parts) == [[0, 0], [scale, scale]]
    assert {part.gc.get_capstyle() for part in parts} == {"butt"}  # the parts must not overlap
    line.set(linestyle="", marker="o")
    line.set_data_3d(np.arange(5), np.zeros(5), np.zeros(5))
    for every, marked in ((None, [0, 1, 2, 3, 4]), (2, [0, 2, 4]), ([0, 3], [0, 3])):
        line.set_markevery(every)
        ((part,), _) = drawn(ax)
        assert np.allclose(part.places[:, 0], scale * np.array(marked))
    line.set_markevery(0.1)
    with pytest.raises(ValueError, match=r"^markevery: None, an integer, a list"):
        drawn(ax)


def test_a_changed_artist_and_a_changed_view_are_drawn_again(ax):
    (line,) = ax.plot([0, 1], [0, 0], [0, 0])
    first, _ = drawn(ax)
    assert drawn(ax)[0] == first  # the same objects
    line.set_data_3d([0, 0.5], [0, 0], [0, 0])
    moved, sight = drawn(ax)
    assert [part.places[-1, 0] for part in moved] == [0.5 * sight.scale]
    ax.view_init(10, 10)
    assert not {*drawn(ax)[0]} & {*moved}


def test_artists_are_drawn_once(ax):
    (line,) = ax.plot([-1, 1], [0, 0], [0, 0], color="red", lw=8, alpha=0.5, label="a line")
    legend, inside = ax.legend(loc="upper left"), [line, space.Ball(), ax.text(0, 0, 0, "")]
    assert space.scenes(ax.figure) == [ax.scene]
    assert space.not_in_space([legend, *inside]) == [legend]
    ax.figure.savefig(content := io.BytesIO(), dpi=100)
    assert line.get_visible()
    picture = np.asarray(Image.open(content).convert("RGB"), dtype=int)
    # if the artist were drawn twice, the value would be 64
    assert picture[200:, :, 1].min() == pytest.approx(127, abs=2)
    assert (picture[:100] < 100).all(axis=-1).any()  # the letters of the legend
    ax.set_visible(False)
    canvas = FigureCanvasAgg(ax.figure)
    canvas.draw()
    assert (np.asarray(canvas.buffer_rgba())[..., :3] == 255).all()


def test_faces_that_are_not_flat_are_drawn(ax):
    plate = bodies.draw_box(ax, np.eye(4), np.array([1.6, 1.6, 0.0]))
    ax.plot([-1, 1], [0, 0], [-0.6, -0.6], lw=3)
    ax.view_init(20, -60)
    kinds = [(part.kind, part.gc.get_linewidth()) for part in drawn(ax)[0]]
    assert kinds.index(("line", 3)) < kinds.index(("face", 0))
    plate.remove()
    ax.add_artist(space.Faces(np.array([[[0, 0, 0], [1, 0, 0], [1, 1, 0.3], [0, 1, 0]]]), ["red"]))
    ax.add_artist(space.Faces(np.full((1, 3, 3), np.nan), ["red"]))
    assert sum(part.kind == "face" for part in drawn(ax)[0]) == 1


def test_the_number_of_faces_is_not_limited_by_the_depth_of_recursion(ax, request):
    corners = np.tile([[-1.0, -1, 0], [1, -1, 0], [0, 1, 0]], (150, 1, 1))
    corners[..., 2] = np.linspace(-1, 1, 150)[:, None]
    ax.add_artist(space.Faces(corners, 150 * ["red"]))
    request.addfinalizer(partial(sys.setrecursionlimit, sys.getrecursionlimit()))
    sys.setrecursionlimit(len(inspect.stack()) + 100)
    depths = [part.places[:, 2].mean() for part in drawn(ax)[0] if part.kind == "face"]
    assert (np.diff(depths) > -2 * scene.NEAR).all()
