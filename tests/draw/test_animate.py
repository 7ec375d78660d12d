"""Animations: every frame is what a full drawing would be, and players need no network."""

import base64
import io
import json
import re

import matplotlib.pyplot as plt
import numpy as np
import pytest
from PIL import Image

import rbcourse as rb
from rbcourse.draw import animate, bodies, spheres

A1 = rb.pose_from_coordinates([0.5, 1.0, 0.5, 3, 2, 1])
TIMES = np.linspace(0, 1, 12)
POSES = rb.screw_se3(np.eye(4), A1)(TIMES)
TABLE = bodies.pose_table({"t [1]": TIMES}, POSES)


def cube():
    fig, ax = plt.subplots(
        figsize=(3, 3), dpi=60, layout="none", subplot_kw={"projection": "space"}
    )
    return fig, bodies.moving_boxes([ax], {"cube": POSES}, edges=1)


def save(folder, monkeypatch):
    monkeypatch.setenv("RBCOURSE_FIGURES", str(folder))
    fig, update = cube()
    return animate.save_animation(fig, "cube", TABLE, 'a "cube"', update, 12, seconds=3)


def held(page):
    """What the script of a player holds."""
    return json.loads(re.search(r"revive\(image, (\{.*\})\);\n", page)[1])


def pixels(file):
    return np.asarray(Image.open(file).convert("RGB"), dtype=int)


def many_images():
    fig, ax = plt.subplots(
        figsize=(5, 5), dpi=80, layout="none", subplot_kw={"projection": "space"}
    )
    R = rb.sample_rotation(300, rng=1)
    return fig, spheres.moving_images([ax], {"many": (R[:, :, 2], R @ [0, 0.2, 1])})


@pytest.mark.parametrize(
    ("make", "count", "some", "share"),
    [(cube, 12, (0, 5, 11), 0.01), (many_images, 301, (300,), 0)],  # stars before, not after a cube
)
def test_frames_are_what_a_full_drawing_gives(make, count, some, share):
    fig, update = make()
    frames = animate.render(fig, update, count)
    for i in some:
        for artist in update(i):
            artist.set_animated(False)
        full = io.BytesIO()
        fig.savefig(full, format="png", dpi=fig.dpi)
        off = np.abs(np.asarray(frames[i], dtype=int) - pixels(full)).max(axis=-1)
        assert (off > (16 if share else 7)).mean() <= share
    plt.close(fig)


def test_the_gif_shows_each_frame_in_its_colours(tmp_path, monkeypatch):
    save(tmp_path, monkeypatch)
    fig, update = cube()
    wanted = animate.render(fig, update, 12)
    plt.close(fig)
    with Image.open(tmp_path / "cube.gif") as picture:
        assert (picture.n_frames, picture.info["loop"], picture.info["duration"]) == (12, 0, 250)
        for i, want in enumerate(wanted):
            picture.seek(i)
            frame = np.asarray(picture.convert("RGB"), dtype=int)
            off = np.abs(frame - np.asarray(want, dtype=int))
            assert off.max() <= 24
            assert off.mean() < 1
            assert np.array_equal(frame[0, 0], [255, 255, 255])


@pytest.mark.parametrize(("count", "seconds"), [(60, 4), (100, 1.99), (3, 1), (7, 0.5)])
def test_a_gif_takes_its_time(count, seconds):
    shades = [Image.new("L", (4, 4), 2 * i) for i in range(count)]
    with Image.open(io.BytesIO(animate.gif(shades, seconds))) as picture:
        assert picture.n_frames == count
        total = 0
        for i in range(count):
            picture.seek(i)
            total += picture.info["duration"]
    assert total == round(1000 * seconds)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"name": "a b"}, "name: a word"),
        ({"name": "1x"}, "name: a word"),
        ({"frames": 0}, "frames: 1 to 50 a second wanted, got 0"),
        ({"frames": 51}, "frames: 1 to 50 a second wanted, got 51 in 1.0 s"),
        ({"seconds": -1.0}, "frames: 1 to 50 a second"),
        ({"seconds": float("nan")}, "frames: 1 to 50 a second"),
    ],
)
def test_what_would_not_play_is_refused(change, message):
    fig, update = cube()
    given = {"name": "cube", "alt": "", "update": update, "frames": 12, "seconds": 1.0} | change
    with pytest.raises(ValueError, match=message):
        animate.animate(fig, **given)
    plt.close(fig)


@pytest.mark.parametrize(("still", "count"), [(-1, 12), (5, 12), (0, 3)])
def test_the_player_starts_with_the_still_frame(still, count):
    fig, update = cube()
    before = fig.canvas
    animation = animate.animate(fig, "cube", "", update, count, still=still)
    assert fig.canvas is before
    assert not any(artist.get_animated() for artist in update(0))
    assert all(artist.get_visible() for artist in update(0))
    page = animation._repr_html_()
    assert held(page)["controls"][0]["first"] == still % count
    first = re.search(r'src="data:image/png;base64,([^"]*)"', page)[1]
    assert base64.b64decode(first) == animation.shown
    update(still % count)
    full = io.BytesIO()
    fig.savefig(full, format="png", dpi=120)  # twice as fine
    off = np.abs(pixels(io.BytesIO(animation.shown)) - pixels(full))
    assert off.mean() < 1  # stars before the cube
    background = pixels(io.BytesIO(animation.background))  # the artists that do not move
    orange = np.abs(background - [0xD5, 0x5E, 0x00]).max(axis=-1) < 30
    assert not orange.any()  # the square on the cube
    assert (background < 128).any()  # the axes
    plt.close(fig)


def test_two_players_of_one_name_do_not_meet():
    pages = []
    for alt in ("one", "other"):
        fig, update = cube()
        pages.append(animate.animate(fig, "cube", alt, update, 2)._repr_html_())
        plt.close(fig)
    one, other = (re.search(r'id="(\w+)"', page)[1] for page in pages)
    assert one != other
    assert f'querySelectorAll("#{one}")' in pages[0]


def test_the_files_are_saved_with_the_same_bytes_and_the_figure_closed(tmp_path, monkeypatch):
    one, other = (save(tmp_path / folder, monkeypatch) for folder in "ab")
    files, again = ({f.name: f.read_bytes() for f in (tmp_path / x).iterdir()} for x in "ab")
    assert set(files) == {"cube.gif", "cube.png", "cube.pdf", "cube.csv"}
    assert files == again
    assert one._repr_html_() == other._repr_html_()
    assert one.controls[0]["first"] == 11  # the last
    assert files["cube.png"] == one.shown
    assert files["cube.csv"].startswith(b"t [1],x [m],")
    assert plt.get_fignums() == []
    assert repr(one) == 'cube: a "cube"'


def test_the_player_has_all_it_needs(tmp_path, monkeypatch):
    animation = save(tmp_path, monkeypatch)
    page = animation._repr_html_()
    assert not re.search(r"https?:|src=\"(?!data:)", page)
    assert "$" not in re.sub(r"\$\{|\"data:[^\"]*\"", "", page)  # all is filled in
    assert 'alt="a &quot;cube&quot;"' in page
    assert page.count("data:image/png;base64,") == 2  # the still, and what does not move
    files = "<small>cube.gif, .png, .pdf, .csv</small>"
    assert f'<figcaption>a "cube" {files}</figcaption>' in page
    data = held(page)
    assert data["milliseconds"] == 250
    assert len(data["controls"][0]["values"]) == 12
    assert data["controls"][0]["values"][::11] == ["0 %", "100 %"]
    assert not re.search("<(button|input)", page.split("<script>")[0])  # none that are dead
