"""Test animations: each frame equals a full drawing, and players need no network."""

import io
import json
import re
from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
import pytest
from PIL import Image

import rbcourse as rb
from rbcourse.draw import animate, bodies, space, spheres

TIMES = np.linspace(0, 1, 12)
POSES = rb.screw(np.eye(4), rb.pose_from_coordinates([0.5, 1.0, 0.5, 3, 2, 1]))(TIMES)
TABLE = bodies.pose_table({"t [1]": TIMES}, POSES)


SIZE = {"figsize": (3, 3), "dpi": 60, "layout": "none", "subplot_kw": {"projection": "space"}}


def cube():
    fig, ax = plt.subplots(**SIZE)
    return fig, bodies.moving_boxes([ax], {"cube": POSES}, edges=1)


def images():
    (fig, ax), R = plt.subplots(**SIZE), rb.sample_rotation(300, rng=1)
    return fig, spheres.moving_images([ax], {"many": (R[:, :, 2], R @ [0, 0.2, 1])})


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """Save the animation of a cube twice; return the players and the contents of their files."""
    made = []
    for _ in "ab":
        folder, (fig, update) = tmp_path_factory.mktemp("figures"), cube()
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("RBCOURSE_FIGURES", str(folder))
            player = animate.save_animation(fig, "cube", TABLE, 'a "cube"', update, 12, seconds=3)
        made.append((player, {file.name: file.read_bytes() for file in folder.iterdir()}))
    return made


def test_no_frames_are_drawn_without_files(saved, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("RBCOURSE_FIGURES", "")
    fig, update = cube()
    player = animate.save_animation(fig, "cube", TABLE, 'a "cube"', update, 12, seconds=3)
    assert player._repr_html_() == saved[0][0]._repr_html_()
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(ValueError, match="RBCOURSE_FIGURES is empty"):
        player.save("cube.gif")
    monkeypatch.setenv("RBCOURSE_FIGURES", str(tmp_path))
    fig, update = cube()
    animate.save_animation(fig, "cube", TABLE, 'a "cube"', update, 12, 3, gif=False)
    assert {path.name for path in tmp_path.iterdir()} == {"cube.png", "cube.csv"}


def test_the_layout_is_the_same_with_and_without_files(tmp_path, monkeypatch):
    """The label of an axis has the same place whether or not the frames are drawn."""
    pages = []
    for folder in (str(tmp_path), ""):
        monkeypatch.setenv("RBCOURSE_FIGURES", folder)
        fig, ax = plt.subplots(figsize=(4, 2), layout="constrained")
        ax.set(xlim=(0, 9), xlabel="x (m)", ylabel="y (m)", title="A title")
        (dot,) = ax.plot([0], [0], "o")

        def update(i, dot=dot):
            dot.set_xdata([i])
            return [dot]

        pages.append(animate.save_animation(fig, "dot", TABLE, "a dot", update, 8)._repr_html_())
    assert pages[0] == pages[1]


def held(page):
    """Return the data in the script of a player."""
    return json.loads(re.search(r"revive\(image, (\{.*\})\);\n", page)[1])


def pixels(picture):
    return np.asarray(picture.convert("RGB"), dtype=int)


def full(fig, artists, dpi):
    """Return the picture of a figure whose artists Matplotlib draws in a single pass."""
    for artist in artists:
        artist.set_animated(False)
    fig.savefig(content := io.BytesIO(), format="png", dpi=dpi)
    return pixels(Image.open(content))


@pytest.mark.parametrize(
    ("make", "some", "most", "share"),
    # the stars are drawn before the cube, not after it
    [(cube, (0, 5, 11), 16, 0.01), (images, (1, 300), 7, 0)],
)
def test_each_frame_equals_a_full_drawing(make, some, most, share):
    fig, update = make()
    frames = animate.render(fig, lambda k: update(some[k]), len(some))
    for frame, i in zip(frames, some, strict=True):
        off = np.abs(pixels(frame) - full(fig, update(i), fig.dpi)).max(axis=-1)
        assert (off > most).mean() <= share
    plt.close(fig)


def test_the_gif_shows_each_frame_in_its_colours(saved):
    fig, update = cube()
    wanted = animate.render(fig, update, 12)
    plt.close(fig)
    with Image.open(io.BytesIO(saved[0][1]["cube.gif"])) as picture:
        assert (picture.n_frames, picture.info["loop"], picture.info["duration"]) == (12, 0, 250)
        for i, want in enumerate(wanted):
            picture.seek(i)
            off = np.abs(pixels(picture) - pixels(want))
            assert (off.max(axis=-1) > 24).mean() < 1e-3  # rare colours at edges
            assert off.mean() < 1
            assert np.array_equal(pixels(picture)[0, 0], [255, 255, 255])


@pytest.mark.parametrize(("count", "seconds"), [(100, 1.99), (7, 0.5)])
def test_a_gif_lasts_as_long_as_requested(count, seconds):
    shades = [Image.new("L", (4, 4), 2 * i) for i in range(count)]
    with Image.open(io.BytesIO(animate.as_gif(shades, seconds))) as picture:
        durations = [picture.seek(i) or picture.info["duration"] for i in range(picture.n_frames)]
    assert (len(durations), sum(durations)) == (count, round(1000 * seconds))


@pytest.mark.parametrize(
    ("name", "frames", "seconds"), [("a b", 9, 1), ("x", 0, 1), ("x", 51, 1.0), ("x", 9, np.nan)]
)
def test_animations_that_cannot_play_are_refused(name, frames, seconds):
    message = f"frames: 1 to 50 per second are wanted, got {frames} in {seconds} s"
    with pytest.raises(ValueError, match=message if name == "x" else "name: a word"):
        animate.animate(plt.Figure(), name, "", list, frames, seconds)


@pytest.mark.parametrize(("still", "count"), [(-1, 4), (1, 3)])
def test_the_player_starts_with_the_still_frame(still, count):
    fig, update = cube()
    before = fig.canvas
    player = animate.animate(fig, "cube", "", update, count, still=still)
    assert fig.canvas is before
    artists = [*space.scenes(fig), *update(0)]
    assert all(artist.get_visible() and not artist.get_animated() for artist in artists)
    assert held(player._repr_html_())["controls"][0]["first"] == still % count
    pngs = map(io.BytesIO, (player.shown, player.background))
    shown, background = (pixels(Image.open(png)) for png in pngs)
    twice = full(fig, update(still % count), 2 * fig.dpi)
    assert np.abs(shown - twice).mean() < 1  # the stars are drawn before the cube
    # the blue square is hidden
    assert (np.abs(background - [0x00, 0x72, 0xB2]).max(axis=-1) >= 30).all()
    assert (background < 128).any()  # the axes are drawn
    plt.close(fig)


def test_animation_files_have_the_same_bytes_each_time(saved):
    (player, files), (other, again) = saved
    assert set(files) == {"cube.gif", "cube.png", "cube.csv"}
    assert files == again
    assert player._repr_html_() == other._repr_html_()
    assert files["cube.png"] == player.shown


def test_the_player_needs_no_network_and_is_alone(saved):
    player = saved[0][0]
    page, other = (replace(player, alt=alt)._repr_html_() for alt in (player.alt, "other"))
    one, two = (re.search(r'id="(\w+)"', text)[1] for text in (page, other))
    assert one != two  # the identifiers differ although the name is the same
    assert not re.search(r"https?:|src=\"(?!data:)", page)
    assert 'alt="a &quot;cube&quot;"' in page
    shares = held(page)["controls"][0]["values"]
    assert (held(page)["milliseconds"], shares[0], shares[-1]) == (250, "0 %", "100 %")
