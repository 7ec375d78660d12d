"""Saved figures have the same bytes each time, and colours that all eyes can distinguish."""

import re
import subprocess
import sys
from itertools import combinations

import matplotlib.pyplot as plt
import numpy as np
import pytest
from broken_disk import check_all_or_nothing

from rbcourse.draw import animate, save

TABLE = {"t [1]": [0, 0.5, 1], "theta [1]": [0, 1 / 3, 1]}


def test_saved_files_have_the_same_bytes_each_time(tmp_path, monkeypatch):
    for folder in "ab":
        monkeypatch.setenv("RBCOURSE_FIGURES", str(tmp_path / folder))
        fig, ax = plt.subplots()
        ax.plot(*TABLE.values())
        picture = save.save_figure(fig, "line", TABLE, "a line", pdf=True)
    files, again = ({f.name: f.read_bytes() for f in (tmp_path / x).iterdir()} for x in "ab")
    assert set(files) == {"line.png", "line.pdf", "line.csv"}
    assert files == again
    assert picture.png == files["line.png"]
    assert files["line.csv"] == b"t [1],theta [1]\n0,0\n0.5,0.333333333333\n1,1\n"
    assert plt.get_fignums() == []


@pytest.mark.parametrize("name", ["line", "new"])
def test_the_files_of_a_figure_are_written_completely_or_not_at_all(tmp_path, monkeypatch, name):
    monkeypatch.setenv("RBCOURSE_FIGURES", str(tmp_path))

    def draw(name, table):
        fig, ax = plt.subplots(figsize=(1, 1))
        (line,) = ax.plot(*table.values())
        animate.save_animation(fig, name, table, "a line", lambda _: [line], 2, pdf=True)

    draw("line", TABLE)
    changed = {key: [0, *column] for key, column in TABLE.items()}
    check_all_or_nothing(lambda: draw(name, changed), tmp_path)
    plt.close("all")


def test_all_files_have_the_layout_of_the_figure(tmp_path, monkeypatch):
    monkeypatch.setenv("RBCOURSE_FIGURES", str(tmp_path))
    with plt.style.context("rbcourse.rbcourse"):
        fig, ax = plt.subplots(layout="none")
        fig.subplots_adjust(left=0.4)
        save.save_figure(fig, "line", TABLE, "a line")
        assert ax.get_position().x0 == pytest.approx(0.4)


def test_only_a_pdf_loads_the_writer_of_pdfs():
    """The pages in which Python runs have no fontTools, and an older Matplotlib."""
    code = "import sys, rbcourse.draw, rbcourse.report; "
    code += "sys.exit('matplotlib.backends.backend_pdf' in sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)


def seen(colour, matrix):
    """Return the CIE Lab colour that an eye sees; the matrix acts on linear RGB."""
    channels = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255
    linear = np.where(channels <= 0.04045, channels / 12.92, ((channels + 0.055) / 1.055) ** 2.4)
    to_xyz = [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750]]
    to_xyz += [[0.0193339, 0.1191920, 0.9503041]]
    share = to_xyz @ np.clip(matrix @ linear, 0, 1) / [0.95047, 1, 1.08883]
    x, y, z = np.where(share > 216 / 24389, np.cbrt(share), (24389 / 27 * share + 16) / 116)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


EYES = {
    "normal": "1 0 0 0 1 0 0 0 1",
    "protan": "0.152286 1.052583 -0.204868 0.114503 0.786281 0.099216 -0.003882 -0.048116 1.051998",
    "deutan": "0.367322 0.860646 -0.227968 0.280085 0.672501 0.047413 -0.011820 0.042940 0.968881",
    "tritan": "1.255528 -0.076749 -0.178779 -0.078411 0.930809 0.147602 0.004733 0.691367 0.303900",
}


@pytest.mark.parametrize("eye", EYES)
def test_colours_can_be_distinguished_by_all_eyes(eye):
    """The matrices for full colour deficiency are from Machado, Oliveira and Fernandes 2009. The
    colour difference is CIE76."""
    matrix = np.array(EYES[eye].split(), dtype=float).reshape(3, 3)
    for one, other in combinations(save.COLOURS.values(), 2):
        assert np.linalg.norm(seen(one, matrix) - seen(other, matrix)) > 16.9, (one, other)


def test_all_colours_have_a_contrast_of_3_on_white():
    """WCAG 2 requires this contrast for graphical objects. The luminance is computed from the
    lightness L."""
    for colour in [*save.COLOURS.values(), save.PALE]:
        lightness, *_ = seen(colour, np.eye(3))
        luminance = max((lightness + 16) / 116, 6 / 29) ** 3
        assert 1.05 / (luminance + 0.05) >= 3, colour


def test_figures_are_saved_beside_the_notebook_by_default(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("RBCOURSE_FIGURES", raising=False)
    save.save_table("empty", TABLE)
    assert (tmp_path / "figures" / "empty.csv").exists()


def test_the_caption_has_the_first_sentence_of_the_description():
    said = save.caption("A cubic, cf. Figure 5, of 2. order by 0.5. No more.")
    assert said == "<figcaption>A cubic, cf. Figure 5, of 2. order by 0.5.</figcaption>"
    page = save.Picture("line", 'A < "B"', save.caption('A < "B"'), b"", 100)._repr_html_()
    assert 'alt="A &lt; &quot;B&quot;"' in page
    assert page.endswith('<figcaption>A &lt; "B"</figcaption></figure>')


RAGGED = {"t [1]": [0, 1], "x [m]": [0, 1, 2]}, "one shape are wanted, got t [1] (2,), x [m] (3,)"


@pytest.mark.parametrize("name", ["pitch [deg]", "t", "angle (rad)", "x[m]", None])
def test_ragged_tables_and_tables_without_units_are_refused(name, tmp_path, monkeypatch):
    monkeypatch.setenv("RBCOURSE_FIGURES", str(tmp_path))
    unit = {"body": ["a"], name: [1.0]}, f"data: {name!r} must end with"
    table, message = unit if name else RAGGED
    for saved, more in ((save.save_figure, ()), (animate.save_animation, (list, 2))):
        with pytest.raises(ValueError, match=re.escape(message)):
            saved(plt.Figure(), "bad", table, "", *more)
    assert list(tmp_path.iterdir()) == []
