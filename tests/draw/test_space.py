"""In space: what is before hides what is behind, from every side."""

import io
from itertools import pairwise

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from mpl_toolkits.mplot3d.proj3d import proj_transform
from PIL import Image

import rbcourse as rb
from rbcourse.draw import bodies, scene, space, spheres

BOOK = np.array([0.20, 0.13, 0.03])
SIDES = [(elev, azim) for elev in (-50, 5, 60) for azim in (-170, -80, 10, 100)]
"""Twelve sides from which one can look."""


@pytest.fixture
def ax():
    fig, axes = plt.subplots(figsize=(4, 4), dpi=100, subplot_kw={"projection": "space"})
    axes.fit(-np.ones(3), np.ones(3))
    yield axes
    plt.close(fig)


def drawn(ax):
    """The parts of a scene as they are drawn one after the other, and how it is seen."""
    pieces = ax.scene.pieces(FigureCanvasAgg(ax.figure).get_renderer())
    return scene.in_sight(pieces, ax.sight().eye), ax.sight()


def faces_over(parts, place, sight, least):
    """The numbers of the faces that cover a place, with how far before it they are, in pixels.

    The sine of the angle between a face and the line of sight is the least one, or more.
    """
    found = {}
    for i, part in enumerate(parts):
        if part.kind == "face":
            flat, p = sight.flat(part.places), sight.flat(place)
            side = np.roll(flat, -1, axis=0) - flat
            turn = side[:, 0] * (p - flat)[:, 1] - side[:, 1] * (p - flat)[:, 0]
            steep = part.normal @ sight.eye
            if abs(steep) > least and (np.all(turn > 0) or np.all(turn < 0)):
                found[i] = (part.places[0] - place) @ part.normal / steep
    return found


def test_it_is_seen_as_matplotlib_sees_it_without_perspective(ax):
    ax.view_init(elev=33, azim=-71)
    ax.figure.canvas.draw()
    places, sight = np.random.default_rng(1).uniform(-1, 1, (20, 3)), ax.sight()
    x, y, _ = proj_transform(*places.T, ax.get_proj())
    want = ax.transData.transform(np.stack([x, y], axis=-1))
    assert np.abs(sight.flat(sight.scale * (places - sight.middle)) - want).max() < 1e-9
    e, a = np.radians([33, -71])
    eye = [np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)]
    assert np.abs(sight.eye - eye).max() < 1e-12


@pytest.mark.parametrize("limits", [True, False])
def test_units_are_equal_and_the_middle_stays(limits):
    fig, ax = plt.subplots(subplot_kw={"projection": "space"})
    ax.plot([0, 1], [0, 5], [0, 20])
    if limits:
        ax.fit([0, 0, 0], [1, 5, 2])
    first = ax.sight().origin
    for side in SIDES:
        ax.view_init(*side)
        sight = ax.sight()
        axes = np.stack([sight.right, sight.up, sight.eye])
        assert np.abs(axes @ axes.T - np.eye(3)).max() < 1e-12
        assert np.abs(sight.origin - first).max() < 1e-9
    plt.close(fig)


@pytest.mark.parametrize("view", [{"elev": 20, "roll": 30}, {"elev": 110}])
def test_views_that_the_browser_has_not_are_refused(ax, view):
    ax.view_init(**view)
    with pytest.raises(ValueError, match=r"^view_init: -90 <= elev <= 90 and roll 0 wanted"):
        ax.sight()


@pytest.mark.parametrize("side", SIDES)
def test_of_triangles_that_pass_through_one_another_the_nearest_is_on_top(ax, side):
    """At random places the faces are drawn from the farthest to the nearest."""
    ax.view_init(*side)
    rng = np.random.default_rng(2)
    for _ in range(12):
        ax.add_artist(space.Faces(rng.uniform(-1, 1, (1, 3, 3)), ["red"]))
    parts, sight = drawn(ax)
    seen = 0
    for place in sight.scale * rng.uniform(-1, 1, (400, 3)):
        over = faces_over(parts, place, sight, 0.1)
        depths = np.array([over[i] for i in sorted(over)])
        # a place may be so far from a plane that it is taken to be in it
        assert (np.diff(depths) > -2 * scene.NEAR / 0.1).all()
        seen += len(depths) > 1
    assert seen > 10


@pytest.mark.parametrize("side", SIDES)
def test_the_axes_of_a_book_end_where_they_leave_it(ax, side):
    """Of a line through a box what is inside, or behind, is drawn before the face that hides it."""
    ax.fit(np.full(3, -0.15), np.full(3, 0.15))
    ax.view_init(*side)
    R = rb.sample_rotation(rng=np.random.default_rng(3))
    bodies.draw_box(ax, rb.pose_from_components(R, np.zeros(3)), BOOK)
    for i in range(3):
        ax.plot(*np.outer(R[:, i], [-0.14, 0.14]), lw=3, zorder=7)
    parts, sight = drawn(ax)
    scale = sight.scale
    lines = [(i, part) for i, part in enumerate(parts) if part.gc.get_linewidth() == 3]
    hidden = 0
    for i in range(3):
        for share in np.linspace(-0.139, 0.139, 40):
            place = scale * share * R[:, i]
            ray = (place / scale + np.linspace(1e-3, 0.5, 2000)[:, None] * sight.eye) @ R
            depth = (BOOK / 2 - np.abs(ray)).min(axis=1).max()
            if abs(depth) < 2e-3:
                continue  # at an edge
            offs = {}
            for number, part in lines:
                start, end = part.places[[0, -1], :3]
                t = np.clip((place - start) @ (end - start) / ((end - start) @ (end - start)), 0, 1)
                offs[number] = np.linalg.norm(start + t * (end - start) - place)
            number = min(offs, key=offs.get)
            assert offs[number] < 0.5
            after = [face for face in faces_over(parts, place, sight, 1e-9) if face > number]
            assert bool(after) == (depth > 0), (i, share)
            hidden += depth > 0
    assert hidden > 10


def test_what_is_on_the_far_side_of_a_ball_is_behind_its_disc(ax):
    spheres.draw_sphere(ax)
    points = rb.sample_rotation(100, rng=np.random.default_rng(4))[:, :, 0]
    ax.plot(*points.T, "o")
    for side in SIDES:
        ax.view_init(*side)
        parts, sight = drawn(ax)
        (disc,) = [i for i, part in enumerate(parts) if part.kind == "ball"]
        behind, before = (
            np.concatenate([part.places for part in those if part.kind == "mark"])
            for those in (parts[:disc], parts[disc + 1 :])
        )
        assert len(behind) + len(before) == 100
        assert (behind @ sight.eye < scene.NEAR).all()
        assert (before @ sight.eye > -scene.NEAR).all()


def test_a_line_that_is_cut_keeps_its_length_and_its_dashes(ax):
    bodies.draw_box(ax, np.eye(4), 0.5)
    ax.plot([-1, 1], [0.1, 0.1], [0.05, -0.05], ls="--", lw=3)
    parts, sight = drawn(ax)
    line = [part for part in parts if part.gc.get_linewidth() == 3]
    assert len(line) > 2
    line.sort(key=lambda part: part.places[0, 3])
    for one, after in pairwise(line):
        assert np.abs(one.places[-1] - after.places[0]).max() < 1e-9
    flat = sight.flat(sight.scale * np.array([[-1, 0.1, 0.05], [1, 0.1, -0.05]]))
    assert line[-1].places[-1, 3] == pytest.approx(np.linalg.norm(flat[1] - flat[0]))


def test_a_face_is_lightest_where_it_is_turned_to_the_light(ax):
    shades = {}
    for R in rb.sample_rotation(50, rng=np.random.default_rng(5)):
        box = bodies.draw_box(ax, rb.pose_from_components(R, np.zeros(3)), 1.0)
        box = space.Faces(box.corners[:6], 6 * ["1"])
        for face, corners in zip(box.pieces(1.0, np.zeros(3)), box.corners, strict=True):
            out = corners.mean(axis=0) / np.linalg.norm(corners.mean(axis=0))
            shades[float(out @ space.LIGHT)] = face.fill[0]
    assert np.linalg.norm(space.LIGHT) == pytest.approx(1)
    towards = sorted(shades)
    assert (np.diff([shades[x] for x in towards]) >= 0).all()
    assert shades[towards[0]] < 0.6 < 0.95 < shades[towards[-1]]


def test_what_is_named_over_everything_is_drawn_last(ax):
    bodies.draw_box(ax, np.eye(4), 1.0)
    ax.text(0, 0, 0, "inside", zorder=scene.OVER)
    ax.text(0, 0, 0, "over it", zorder=scene.OVER + 1)
    ax.plot([0, 1], [0, 0], [0, 0], zorder=scene.OVER + 0.5)
    parts, _ = drawn(ax)
    assert [part.kind for part in parts[-3:]] == ["mark", "line", "mark"]


def test_a_line_with_gaps_is_drawn_without_them(ax):
    places = np.array([[0, 0, 0], [1, 0, 0], [np.nan] * 3, [0, 1, 0], [1, 1, 0], [0, np.inf, 0]])
    ax.plot(*places.T)
    parts, sight = drawn(ax)
    scale = sight.scale
    assert sorted(part.places[:, 1].tolist() for part in parts) == [[0, 0], [scale, scale]]
    assert {part.gc.get_capstyle() for part in parts} == {"butt"}  # parts must not overlap


def test_a_change_is_seen_and_what_stays_is_not_made_again(ax):
    (line,) = ax.plot([0, 1], [0, 0], [0, 0])
    text = ax.text(0, 0, 0, "a")
    first, _ = drawn(ax)
    again, _ = drawn(ax)
    assert {id(part) for part in again} == {id(part) for part in first}
    line.set_data_3d([0, 0.5], [0, 0], [0, 0])
    text.set_text("b")
    moved, sight = drawn(ax)
    assert {part.places[-1, 0] for part in moved} == {0.5 * sight.scale, 0}
    assert not {id(part) for part in moved} & {id(part) for part in first}
    ax.view_init(10, 10)
    turned, _ = drawn(ax)
    assert not {id(part) for part in turned} & {id(part) for part in moved}
    line.set_visible(False)
    assert len(drawn(ax)[0]) == 1


def test_titles_and_legends_are_drawn_too_and_nothing_twice(ax):
    (line,) = ax.plot([-1, 1], [0, 0], [0, 0], color="red", lw=8, alpha=0.5, label="a line")
    ax.legend(loc="upper left")
    content = io.BytesIO()
    ax.figure.savefig(content, dpi=100)
    assert line.get_visible()
    picture = np.asarray(Image.open(content).convert("RGB"), dtype=int)
    shades = set(picture[200:].reshape(-1, 3)[:, 1].tolist())
    assert min(shades) == pytest.approx(127, abs=2)  # twice it would be 64
    assert (picture[:100] < 100).all(axis=-1).any()  # the letters of the legend


def test_what_is_in_space_is_told_from_what_is_not(ax):
    (line,) = ax.plot([0, 1], [0, 1], [0, 1])
    text, box = ax.text2D(0, 0, "flat"), bodies.draw_box(ax, np.eye(4), 1.0)
    assert space.not_in_space([line, text, box]) == [text]
    assert space.scenes(ax.figure) == [ax.scene]


def test_what_cannot_be_ordered_is_refused(ax):
    points = ax.scatter([0], [0], [0])
    with pytest.raises(ValueError, match=r"^Path3DCollection: lines, letters, Faces or a Ball"):
        ax.figure.canvas.draw()
    points.remove()
    ax.plot([0, 1], [0, 0], [0, 0], "o", markevery=0.1)
    with pytest.raises(ValueError, match=r"^markevery: None, an integer, a list or a slice"):
        ax.figure.canvas.draw()


def test_faces_without_area_part_nothing_and_faces_that_are_not_flat_are_drawn(ax):
    plate = bodies.draw_box(ax, np.eye(4), np.array([1.6, 1.6, 0.0]))
    ax.plot([-1, 1], [0, 0], [-0.6, -0.6], lw=3)
    ax.view_init(20, -60)
    parts, _ = drawn(ax)
    kinds = [(part.kind, part.gc.get_linewidth()) for part in parts]
    assert kinds.index(("line", 3)) < kinds.index(("face", 0.5))
    plate.remove()
    ax.add_artist(space.Faces(np.array([[[0, 0, 0], [1, 0, 0], [1, 1, 0.3], [0, 1, 0]]]), ["red"]))
    ax.add_artist(space.Faces(np.full((1, 3, 3), np.nan), ["red"]))
    assert sum(part.kind == "face" for part in drawn(ax)[0]) == 1


def test_many_faces_can_be_drawn(ax):
    """More than Python can call functions within one another."""
    corners = np.tile([[-1.0, -1, 0], [1, -1, 0], [0, 1, 0]], (1200, 1, 1))
    corners[..., 2] = np.linspace(-1, 1, 1200)[:, None]
    ax.add_artist(space.Faces(corners, 1200 * ["red"]))
    parts, _ = drawn(ax)
    depths = [part.places[:, 2].mean() for part in parts if part.kind == "face"]
    assert (np.diff(depths) > -2 * scene.NEAR).all()


def test_in_the_plane_of_a_face_what_has_the_higher_zorder_is_over_it(ax):
    ax.plot([-0.4, 0.4], [0, 0], [0.5, 0.5], lw=3, zorder=9)
    bodies.draw_box(ax, np.eye(4), 1.0)
    ax.view_init(30, -60)
    parts, sight = drawn(ax)
    in_plane = [part for part in parts if np.allclose(part.places[:, 2], 0.5 * sight.scale)]
    assert [part.kind for part in in_plane] == ["face", "line", "line"]
    assert in_plane[-1].gc.get_linewidth() == 3


def test_an_axes_that_is_not_visible_is_not_drawn_and_a_fault_hides_nothing(ax):
    (line,) = ax.plot([-1, 1], [0, 0], [0, 0], lw=9)
    ax.set_visible(False)
    canvas = FigureCanvasAgg(ax.figure)
    canvas.draw()
    assert (np.asarray(canvas.buffer_rgba())[..., :3] == 255).all()
    ax.set_visible(True)
    ax.set_title(r"$\frac{1$")
    with pytest.raises(ValueError, match="frac"):
        canvas.draw()
    assert line.get_visible()


@pytest.mark.parametrize(
    ("every", "marked"), [(None, [0, 1, 2, 3, 4]), (2, [0, 2, 4]), ([0, 3], [0, 3])]
)
def test_only_some_places_of_a_line_may_have_marks(ax, every, marked):
    ax.plot(np.arange(5) / 5, np.zeros(5), np.zeros(5), "o", markevery=every)
    (part,), sight = drawn(ax)
    assert np.allclose(part.places[:, 0], sight.scale * np.array(marked) / 5)
