"""What is seen when a lesson gives something else than what is stored, and what is let pass."""

import shutil
import subprocess
from pathlib import Path

import pytest
from freshness import changed_lines, same_columns, stale_figures
from nbformat.v4 import new_code_cell
from PIL import Image
from tiny import MODULE, lesson_at

from rbcourse.course import notebooks

ROOT = Path(__file__).parents[1]
STORED = ROOT / "figures"
NAME = "report_fig6"


def picture():
    with Image.open(STORED / f"{NAME}.png") as stored:
        return stored.convert("RGB")


def spotted():
    spotted = picture()
    spotted.paste((0, 0, 0), (500, 200, 512, 208))
    return spotted


def tinted():
    return picture().point(lambda level: min(level, 250))


def shaded():
    """By one level in one pixel, as another processor may draw."""
    shaded, place = picture(), (500, 200)
    red, green, blue = shaded.getpixel(place)
    shaded.putpixel(place, (red ^ 1, green, blue))
    return shaded


@pytest.fixture
def drawn(tmp_path):
    """A folder with a stored animation: GIF, PNG, PDF, CSV."""
    for file in STORED.glob(f"{NAME}.*"):
        shutil.copyfile(file, tmp_path / file.name)
    assert len(list(tmp_path.iterdir())) == 4
    return tmp_path


def test_copies_are_fresh(drawn):
    assert list(stale_figures(drawn, STORED)) == []


def test_what_is_not_stored_is_named(drawn):
    (drawn / "new.csv").touch()
    assert list(stale_figures(drawn, STORED)) == ["new.csv is not stored"]


@pytest.mark.parametrize("changed", [spotted, tinted])
def test_a_changed_picture_is_seen(drawn, changed):
    changed().save(drawn / f"{NAME}.png")
    assert list(stale_figures(drawn, STORED)) == [f"{NAME}.png is stored otherwise"]


def test_pixels_may_differ_by_a_shade_and_then_so_may_the_document(drawn):
    shaded().save(drawn / f"{NAME}.png")
    (drawn / f"{NAME}.pdf").write_bytes(b"another")
    assert list(stale_figures(drawn, STORED)) == []


def test_a_changed_document_is_seen(drawn):
    (drawn / f"{NAME}.pdf").write_bytes(b"another")
    assert list(stale_figures(drawn, STORED)) == [f"{NAME}.pdf is stored otherwise"]


@pytest.fixture
def folders(tmp_path):
    """Two, each with the same animation of three frames, one written in another way."""
    for name, loop in (("drawn", 0), ("stored", 1)):
        (tmp_path / name).mkdir()
        save_frames(tmp_path / name, *frames(), loop=loop)
    return tmp_path / "drawn", tmp_path / "stored"


def frames():
    with Image.open(STORED / f"{NAME}.gif") as stored:
        for number in (0, 20, 40):
            stored.seek(number)
            yield stored.convert("RGB")


def save_frames(folder, first, *others, loop=0):
    first.save(folder / "a.gif", save_all=True, append_images=others, loop=loop)


def test_frames_may_be_written_in_another_way(folders):
    one, other = ((folder / "a.gif").read_bytes() for folder in folders)
    assert one != other
    assert list(stale_figures(*folders)) == []


def test_a_changed_frame_is_seen_and_one_that_is_missing(folders):
    first, *others = frames()
    save_frames(folders[0], first.transpose(Image.Transpose.FLIP_LEFT_RIGHT), *others)
    assert list(stale_figures(*folders)) == ["a.gif is stored otherwise"]
    save_frames(folders[0], first, *others[:-1])
    assert list(stale_figures(*folders)) == ["a.gif is stored otherwise"]


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text.replace("0.06,", "0.06000001,", 1),
        lambda text: text.replace("[m]", "[km]", 1),
        lambda text: text[: text.rindex("\n", 0, -1) + 1],
    ],
    ids=["number", "unit", "row"],
)
def test_a_changed_table_is_seen(drawn, change):
    table = drawn / f"{NAME}.csv"
    before = table.read_text("utf-8")
    table.write_text(change(before), "utf-8", newline="\n")
    assert table.read_text("utf-8") != before
    assert list(stale_figures(drawn, STORED)) == [f"{NAME}.csv is stored otherwise"]


def test_what_columns_are_the_same():
    stored = "x [m]", "1", "1e-6"
    assert same_columns(("x [m]", "1.00000000001", "1.0000009e-6"), stored)
    assert not same_columns(("x [m]", "1.00000000003", "1e-6"), stored)
    assert not same_columns(("x [m]", "1", "1.000002e-6"), stored)
    assert not same_columns(("y [m]", "1", "1e-6"), stored)


def test_of_a_notebook_all_is_compared_but_the_pictures():
    stored = '<img alt="a cube" src="data:image/png;base64,AAAA"/>\n42\n'
    assert list(changed_lines(stored, stored.replace("AAAA", "BBBB"))) == []
    for changed in (stored.replace("cube", "ball"), stored.replace("42", "43"), stored[:-1]):
        assert list(changed_lines(stored, changed))


BAR = """\
from rbcourse.study.progress import bar
report = bar("Steps")
report(1, 2)
report(2, 2)"""
DRAW = """\
import os, pathlib
pathlib.Path(os.environ["RBCOURSE_FIGURES"], "a.csv").write_text("x")"""


@pytest.fixture
def lesson(tmp_path):
    """In a course that is tested as this one: a bar, which nbval ignores, a figure, an answer."""
    shown = new_code_cell(BAR, metadata={"tags": ["nbval-ignore-output"]})
    path = lesson_at(tmp_path, shown, new_code_cell(DRAW), new_code_cell("6 * 7"))
    for folder in ("figures", "tests"):
        (tmp_path / folder).mkdir()
    path.write_text(notebooks.execute(path, tmp_path / "figures"), encoding="utf-8")
    for name in ("conftest.py", "pyproject.toml", "tests/freshness.py", "tests/nbval_sanitize.cfg"):
        shutil.copyfile(ROOT / name, tmp_path / name)
    return path


def said(lesson, *words):
    """What pytest says."""
    command = [*MODULE, "pytest", "-p", "no:cacheprovider", "notebooks", *words]
    return subprocess.run(
        command, cwd=lesson.parents[1], capture_output=True, text=True, encoding="utf-8"
    ).stdout


def test_when_its_cells_have_run_a_lesson_is_compared(lesson):
    changed = lesson.read_text("utf-8").replace("Steps: 2 of 2", "Steps: 2 of 3")
    lesson.write_text(changed, encoding="utf-8")
    (lesson.parents[1] / "figures" / "a.csv").write_text("y")
    text = said(lesson)
    assert "1 failed, 3 passed" in text
    assert '+       "Steps: 2 of 2"' in text
    assert "a.csv is stored otherwise" in text
    assert lesson.read_text("utf-8") == changed


def test_when_cells_are_left_out_or_fail_a_lesson_is_not_compared(lesson):
    lesson.write_text(lesson.read_text("utf-8").replace("6 * 7", "6 / 0"), encoding="utf-8")
    text = said(lesson, "--deselect", "notebooks/01_tiny.ipynb::Cell 1")
    assert "Not compared, for want of Cell 1, Cell 2" in text
    assert "stored otherwise" not in text
