"""The lessons as files: complete, fresh, and the same on every machine."""

import ast
import base64
import functools
import io
import re
import shutil
import tempfile
from pathlib import Path

import nbformat
import numpy as np
import pytest
from nbclient.exceptions import CellExecutionError
from nbformat.sign import NotebookNotary
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook, new_output
from PIL import Image

from rbcourse import lessons

ROOT = Path(__file__).parents[1]
LESSONS = lessons.lesson_paths(ROOT / "notebooks")
TAGS = {
    "hide-input",
    "hide-output",
    "nbval-check-output",
    "nbval-ignore-output",
    "nbval-skip",
    "parameters",
    "raises-exception",
    "remove-cell",
    "remove-input",
    "solution",
}
BASE64 = r"base64,[A-Za-z0-9+/=]+"
RESIDUE = re.compile(r"\d\.\d+e-(?:1[3-9]|[2-9]\d|\d{3})")
TIMERS = {"time", "timeit", "datetime"}


@functools.cache
def executed(path):
    """What a run of the lesson stores, and the folder with the figures that it draws."""
    figures = Path(tempfile.mkdtemp())
    return lessons.execute(path, figures), figures


@pytest.fixture(scope="module", autouse=True)
def _remove_drawn_figures():
    yield
    for path in LESSONS:
        shutil.rmtree(executed(path)[1])


def code_cells(notebook):
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


def stored_text(notebook):
    """All text that the outputs of a notebook show, without pictures."""
    for cell in code_cells(notebook):
        for output in cell.outputs:
            data = output.get("data", {})
            yield from (output.get("text", ""), data.get("text/plain", ""))
            yield re.sub(BASE64, "", data.get("text/html", ""))


def faults(notebook):
    """What is wrong with a notebook as it is stored."""
    found = []
    kernel = notebook.metadata.get("kernelspec", {}).get("name")
    if kernel != "python3":
        found.append(f"kernel {kernel}")
    heads = [line for cell in notebook.cells for line in cell.source.splitlines()[:1]]
    if sum(line.startswith("# ") for line in heads) != 1:
        found.append("not one first-level heading")
    for cell in notebook.cells:
        lines = cell.source.splitlines()
        if cell.cell_type == "markdown" and any(line.startswith("#") for line in lines[1:]):
            found.append("a heading is not the first line of its cell")
        if cell.metadata.get("jp-MarkdownHeadingCollapsed") and len(lines) > 1:
            found.append("a collapsed heading shows what follows it")
    for number, cell in enumerate(code_cells(notebook), start=1):
        if cell.execution_count != number:
            found.append(f"code cell {number} has the count {cell.execution_count}")
        if len(cell.source.splitlines()) > 10:
            found.append(f"code cell {number} is longer than ten lines")
        for output in cell.outputs:
            if output.output_type == "error" or output.get("name") == "stderr":
                found.append(f"code cell {number} stores an error or a warning")
        used = {node.id for node in ast.walk(ast.parse(cell.source)) if isinstance(node, ast.Name)}
        if used & TIMERS:
            found.append(f"code cell {number} measures time")
    for cell in notebook.cells:
        tags = cell.metadata.get("tags", [])
        found += [f"unknown tag {tag}" for tag in tags if tag not in TAGS]
        if "nbval-skip" in tags and "skipped" not in cell.source:
            found.append("a skipped cell gives no reason")
    found += [
        f"rounding residue {hit}" for t in stored_text(notebook) for hit in RESIDUE.findall(t)
    ]
    return found


def differing_pixels(one, other):
    """The share of pixels that differ visibly: by more than 16 of 255 levels in some colour."""
    a, b = (
        np.asarray(Image.open(io.BytesIO(png)).convert("RGB"), dtype=int) for png in (one, other)
    )
    return 1.0 if a.shape != b.shape else (np.abs(a - b).max(axis=-1) > 16).mean()


@pytest.mark.parametrize("path", LESSONS, ids=lambda path: path.stem)
def test_stored_lessons_are_complete(path):
    assert faults(nbformat.read(path, as_version=4)) == []


def test_faults_are_seen():
    cell = new_code_cell("import time\ntime.sleep(0)" + "\n" * 10 + "1", execution_count=3)
    cell.metadata.tags = ["nbval-skip", "raises-exeption"]
    cell.outputs = [
        new_output("stream", name="stderr", text="Warning"),
        new_output("execute_result", data={"text/plain": "1.11e-16"}),
    ]
    text = new_markdown_cell("## Answer\n42\n## Next")
    text.metadata["jp-MarkdownHeadingCollapsed"] = True
    found = faults(new_notebook(cells=[text, cell]))
    assert len(found) == 11
    good = new_code_cell("x = 1", execution_count=1)
    good.outputs = [new_output("stream", name="stdout", text="difference < 1e-14")]
    kernel = {"kernelspec": {"name": "python3", "display_name": "Python 3"}}
    assert faults(new_notebook(cells=[new_markdown_cell("# One"), good], metadata=kernel)) == []


@pytest.mark.parametrize("path", LESSONS, ids=lambda path: path.stem)
def test_stored_lessons_are_fresh(path):
    """To the byte, except for pictures: another processor may draw a pixel differently."""
    again, stored = executed(path)[0], path.read_text("utf-8")
    assert re.sub(BASE64, "", again) == re.sub(BASE64, "", stored)


def test_the_stored_figures_are_those_that_the_lessons_draw():
    drawn = {file.name for path in LESSONS for file in executed(path)[1].iterdir()}
    assert drawn == {file.name for file in (ROOT / "figures").iterdir()}


@pytest.mark.parametrize("path", LESSONS, ids=lambda path: path.stem)
def test_stored_pictures_are_fresh(path):
    for drawn in sorted(executed(path)[1].glob("*.png")):
        stored = ROOT / "figures" / drawn.name
        assert differing_pixels(drawn.read_bytes(), stored.read_bytes()) < 1e-4, drawn.name


@pytest.mark.parametrize("path", LESSONS, ids=lambda path: path.stem)
def test_the_pictures_in_a_lesson_are_those_in_the_folder(path):
    shown = re.findall(r"base64,([A-Za-z0-9+/=]+)", path.read_text("utf-8"))
    files = {file.read_bytes() for file in (ROOT / "figures").glob("*.png")}
    assert shown
    assert {base64.b64decode(picture) for picture in shown} <= files


def test_a_changed_picture_is_seen():
    stored = (ROOT / "figures" / "paper_fig2a.png").read_bytes()
    picture = Image.open(io.BytesIO(stored)).convert("RGB")
    picture.paste((0, 0, 0), (500, 200, 512, 208))  # as large as one letter
    changed = io.BytesIO()
    picture.save(changed, "png")
    assert differing_pixels(stored, stored) == 0
    assert differing_pixels(stored, changed.getvalue()) > 1e-4


@pytest.mark.parametrize("path", LESSONS, ids=lambda path: path.stem)
def test_stored_numbers_are_fresh(path):
    for drawn in sorted(executed(path)[1].glob("*.csv")):
        stored = ROOT / "figures" / drawn.name
        ours, theirs = drawn.read_text("utf-8").split("\n"), stored.read_text("utf-8").split("\n")
        assert len(ours) == len(theirs)
        assert ours[0] == theirs[0]
        for one, other in zip(ours[1:], theirs[1:], strict=True):
            for a, b in zip(one.split(","), other.split(","), strict=True):
                assert a == b or float(a) == pytest.approx(float(b), rel=1e-11, abs=1e-13)


def notebook_at(path, *sources):
    cells = [new_code_cell(source) for source in sources]
    for number, cell in enumerate(cells):
        cell.id = f"cell-{number}"
    path.write_text(nbformat.writes(new_notebook(cells=cells)), encoding="utf-8")
    return path


def test_runs_give_the_same_bytes(tmp_path):
    source = "import uuid\nprint(object(), uuid.uuid4().hex)\nobject()"
    path = notebook_at(tmp_path / "01_ids.ipynb", source, "print(uuid.uuid4().hex)")
    first = lessons.execute(path, tmp_path)
    assert first == lessons.execute(path, tmp_path)
    assert "0x0>" in first
    assert f"{1:032x}" in first
    assert f"{2:032x}" in first


def test_what_is_printed_in_pieces_is_stored_as_one(tmp_path):
    source = "import time\nprint('one', flush=True)\ntime.sleep(0.5)\nprint('two')"
    path = notebook_at(tmp_path / "01_pieces.ipynb", source)
    stored = nbformat.reads(lessons.execute(path, tmp_path), as_version=4)
    assert [output.text for output in stored.cells[0].outputs] == ["one\ntwo\n"]


def test_nothing_is_rewritten_when_a_lesson_fails(tmp_path):
    good = "import os, pathlib\npathlib.Path(os.environ['RBCOURSE_FIGURES'], 'new.png').touch()"
    paths = [
        notebook_at(tmp_path / "01_good.ipynb", good),
        notebook_at(tmp_path / "02_bad.ipynb", "1 / 0"),
    ]
    before, figures = [path.read_text() for path in paths], tmp_path / "figures"
    figures.mkdir()
    (figures / "old.png").touch()
    with pytest.raises(CellExecutionError, match="ZeroDivisionError"):
        lessons.regenerate(tmp_path, figures)
    assert [path.read_text() for path in paths] == before
    assert [file.name for file in figures.iterdir()] == ["old.png"]
    paths[1].unlink()
    lessons.regenerate(tmp_path, figures)
    assert [file.name for file in figures.iterdir()] == ["new.png"]


@pytest.fixture
def folders(tmp_path, monkeypatch):
    """A folder with one lesson and one assignment, and one to work in."""
    monkeypatch.setenv("JUPYTER_DATA_DIR", str(tmp_path / "data"))
    source = tmp_path / "notebooks"
    source.mkdir()
    notebook_at(source / "01_plane.ipynb", "1")
    notebook_at(source / "ps1.ipynb", "1")
    return source, tmp_path / "work"


def test_copies_are_trusted_and_assignments_left_out(folders):
    lessons.copy_lessons(*folders)
    copies = list(folders[1].glob("*.ipynb"))
    assert [copy.name for copy in copies] == ["01_plane.ipynb"]
    assert NotebookNotary().check_signature(nbformat.read(copies[0], as_version=4))


def test_a_new_version_replaces_a_copy_that_was_left_alone(folders):
    lessons.copy_lessons(*folders)
    notebook_at(folders[0] / "01_plane.ipynb", "2")
    lessons.copy_lessons(*folders)
    assert '"2"' in (folders[1] / "01_plane.ipynb").read_text()
    assert len(list(folders[1].glob("*.ipynb"))) == 1


def test_a_copy_that_was_worked_in_is_never_touched(folders, capsys):
    lessons.copy_lessons(*folders)
    mine = notebook_at(folders[1] / "01_plane.ipynb", "my work")
    lessons.copy_lessons(*folders)
    assert "my work" in mine.read_text()
    for version in ("2", "3"):
        notebook_at(folders[0] / "01_plane.ipynb", version)
        lessons.copy_lessons(*folders)
        lessons.copy_lessons(*folders)
        assert "my work" in mine.read_text()
        assert f'"{version}"' in (folders[1] / f"01_plane_{version}.ipynb").read_text()
    assert len(list(folders[1].glob("*.ipynb"))) == 3
    assert "your copy stays, the new one is 01_plane_2.ipynb" in capsys.readouterr().out


def test_a_copy_that_was_only_run_is_replaced(folders):
    lessons.copy_lessons(*folders)
    copy = folders[1] / "01_plane.ipynb"
    copy.write_text(lessons.execute(copy, folders[1]), encoding="utf-8")
    notebook_at(folders[0] / "01_plane.ipynb", "2")
    lessons.copy_lessons(*folders)
    assert '"2"' in copy.read_text()
    assert len(list(folders[1].glob("*.ipynb"))) == 1


def test_a_copy_that_is_no_notebook_any_more_is_never_touched(folders):
    lessons.copy_lessons(*folders)
    (folders[1] / "01_plane.ipynb").write_text("my notes")
    notebook_at(folders[0] / "01_plane.ipynb", "2")
    lessons.copy_lessons(*folders)
    assert (folders[1] / "01_plane.ipynb").read_text() == "my notes"
    assert (folders[1] / "01_plane_2.ipynb").exists()


def test_a_copy_that_was_there_before_is_never_touched(folders):
    folders[1].mkdir()
    mine = notebook_at(folders[1] / "01_plane.ipynb", "my work")
    lessons.copy_lessons(*folders)
    assert "my work" in mine.read_text()
    assert (folders[1] / "01_plane_2.ipynb").exists()
