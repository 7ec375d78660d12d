"""Figures as files: the same bytes each time, colours for all eyes."""

import html
import re
from functools import partial
from itertools import combinations

import matplotlib.pyplot as plt
import numpy as np
import pytest

from rbcourse.draw import animate, save

TABLE = {"t [1]": [0, 0.5, 1], "theta [1]": [0, 1 / 3, 1]}


def saved(folder, monkeypatch, alt="a line"):
    monkeypatch.setenv("RBCOURSE_FIGURES", str(folder))
    fig, ax = plt.subplots()
    ax.plot(*TABLE.values())
    return save.save_figure(fig, "line", TABLE, alt)


def test_a_figure_is_saved_as_picture_document_and_numbers_of_the_same_bytes(tmp_path, monkeypatch):
    picture, _ = (saved(tmp_path / folder, monkeypatch) for folder in "ab")
    files, again = ({f.name: f.read_bytes() for f in (tmp_path / x).iterdir()} for x in "ab")
    assert set(files) == {"line.png", "line.pdf", "line.csv"}
    assert files == again
    assert picture.png == files["line.png"]
    assert files["line.csv"] == b"t [1],theta [1]\n0,0\n0.5,0.333333333333\n1,1\n"
    assert plt.get_fignums() == []


def seen(colour, matrix):
    """A colour as CIE Lab, as an eye sees it whose deficiency is a matrix on linear RGB."""
    channels = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255
    linear = np.where(channels <= 0.04045, channels / 12.92, ((channels + 0.055) / 1.055) ** 2.4)
    to_xyz = [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750]]
    to_xyz += [[0.0193339, 0.1191920, 0.9503041]]
    share = to_xyz @ np.clip(matrix @ linear, 0, 1) / [0.95047, 1, 1.08883]
    x, y, z = np.where(share > 216 / 24389, np.cbrt(share), (24389 / 27 * share + 16) / 116)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


def test_colours_can_be_told_apart_by_all_eyes():
    """The deficiencies in full, by Machado, Oliveira and Fernandes 2009; differences as CIE76."""
    eyes = {
        "normal": "1 0 0 0 1 0 0 0 1",
        "protan": "0.152286 1.052583 -0.204868 0.114503 0.786281 0.099216 "
        "-0.003882 -0.048116 1.051998",
        "deutan": "0.367322 0.860646 -0.227968 0.280085 0.672501 0.047413 "
        "-0.011820 0.042940 0.968881",
        "tritan": "1.255528 -0.076749 -0.178779 -0.078411 0.930809 0.147602 "
        "0.004733 0.691367 0.303900",
    }
    for eye, entries in eyes.items():
        matrix = np.array(entries.split(), dtype=float).reshape(3, 3)
        for one, other in combinations(save.COLOURS.values(), 2):
            apart = np.linalg.norm(seen(one, matrix) - seen(other, matrix))
            assert apart > 16.9, (eye, one, other)


def test_by_default_figures_go_beside_the_notebook(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("RBCOURSE_FIGURES", raising=False)
    fig, _ = plt.subplots()
    save.save_figure(fig, "empty", TABLE, "nothing")
    assert (tmp_path / "figures" / "empty.png").exists()


@pytest.mark.parametrize(
    ("alt", "sentence"),
    [
        ("One of two. The other.", "One of two."),
        ("By 0.5 to 1. Then more. And more.", "By 0.5 to 1."),
        ("A cubic, cf. Figure 5, of 2. order. No more.", "A cubic, cf. Figure 5, of 2. order."),
        ('A < "B": no end', 'A &lt; "B": no end'),
    ],
)
def test_the_caption_is_the_first_sentence_and_the_files(tmp_path, monkeypatch, alt, sentence):
    picture = saved(tmp_path, monkeypatch, alt)
    assert repr(picture) == f"line: {alt}"
    assert f'alt="{html.escape(alt)}"' in picture._repr_html_()
    said = f"<figcaption>{sentence} <small>line.png, .pdf, .csv</small></figcaption></figure>"
    assert picture._repr_html_().endswith(said)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"t [1]": [0, 1], "x [m]": [0, 1, 2]}, "one shape wanted, got t [1] (2,), x [m] (3,)"),
        *(
            ({"body": ["a"], name: [1.0]}, f"data: {name!r} has to end with")
            for name in ("pitch [deg]", "t", "angle (rad)", "x[m]")
        ),
    ],
)
@pytest.mark.parametrize(
    "saved", [save.save_figure, partial(animate.save_animation, update=list, frames=2)]
)
def test_tables_that_are_ragged_or_lack_units_are_refused_and_nothing_is_written(
    table, message, saved, tmp_path, monkeypatch
):
    monkeypatch.setenv("RBCOURSE_FIGURES", str(tmp_path))
    fig, _ = plt.subplots()
    with pytest.raises(ValueError, match=re.escape(message)):
        saved(fig, "bad", table, alt="")
    assert list(tmp_path.iterdir()) == []
    plt.close(fig)
