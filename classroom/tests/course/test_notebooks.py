"""Test the modules that run, store and copy lessons."""

import asyncio
import os
import runpy
from functools import partial
from pathlib import Path

import nbformat
import nbval.kernel
import pytest
from broken_disk import check_all_or_nothing
from jupyter_client import KernelManager
from jupyter_server.services.contents.largefilemanager import LargeFileManager
from nbclient.exceptions import CellExecutionError
from nbformat.sign import NotebookNotary, SQLiteSignatureStore
from nbformat.v4 import new_code_cell, new_notebook, new_output
from tornado.web import HTTPError

from rbclassroom.course import figures as drawing
from rbclassroom.course import notebooks


def notebook_at(path, *sources):
    cells = [new_code_cell(source, id=f"cell-{k}") for k, source in enumerate(sources)]
    path.write_text(nbformat.writes(new_notebook(cells=cells)), encoding="utf-8")
    return path


def test_the_kernel_that_runs_a_lesson_opens_no_port(tmp_path):
    sources = [
        "print('one', flush=True)\nprint('two')",
        "import ipykernel, json\nprint(json.loads(ipykernel.get_connection_info())['transport'])",
        "object()",
    ]
    path = notebook_at(tmp_path / "01_all.ipynb", *sources)
    cells = nbformat.reads(asyncio.run(drawing.execute(path, tmp_path)), as_version=4).cells
    assert [cell.source for cell in cells] == sources
    assert [output.text for output in cells[0].outputs] == ["one\ntwo\n"]
    assert cells[1].outputs[0].text == ("tcp\n" if os.name == "nt" else "ipc\n")
    assert cells[2].outputs[0].data["text/plain"] == "<object at 0x0>"


@pytest.mark.skipif(os.name == "nt", reason="kernels listen at ports on Windows")
def test_the_kernel_that_tests_a_lesson_opens_no_port(monkeypatch, request):
    monkeypatch.setattr(nbval.kernel, "KernelManager", KernelManager)
    conftest = Path(__file__).parents[3] / "notebooks/conftest.py"
    runpy.run_path(str(conftest))["pytest_configure"](request.config)
    assert nbval.kernel.KernelManager(kernel_name="python3").transport == "ipc"


def test_differences_between_runs_and_machines_are_not_stored():
    source, texts = "key = 'd41d8cd98f00b204e9800998ecf8427e'; place = '0xdeadbeef'", []
    for one, two in (("4" * 32, "a" * 32), ("e" * 32, "0" * 32)):
        data = {"text/plain": f"<at 0x7f{one[:10]}>", "text/html": f"<p id={one}>{two}"}
        data["application/vnd.jupyter.widget-view+json"] = {}
        outputs = [
            new_output("stream", text=f"<at 0x7f{two[:10]}> {two}\n"),
            new_output("execute_result", data=data, execution_count=1),
        ]
        cells = [new_code_cell(source, outputs=outputs, id="cell-0")]
        metadata = {"widgets": {one: {}}, "kernelspec": {"name": one, "display_name": two}}
        texts.append(notebooks.normalised(new_notebook(cells=cells, metadata=metadata)))
    assert texts[0] == texts[1]
    stored = nbformat.reads(texts[0], as_version=4)
    assert stored.cells[0].source == source
    first, second = stored.cells[0].outputs
    assert first.text == f"<at 0x0> {1:032x}\n"
    assert second.data == {"text/plain": "<at 0x0>", "text/html": f"<p id={2:032x}>{1:032x}"}
    assert set(stored.metadata) == {"kernelspec", "language_info"}


def test_nothing_is_removed_from_a_folder_without_lessons(tmp_path):
    (tmp_path / "thesis.pdf").touch()
    with pytest.raises(ValueError, match="has no lessons; run this"):
        drawing.regenerate(tmp_path, tmp_path)
    assert (tmp_path / "thesis.pdf").exists()


def test_nothing_is_rewritten_if_a_lesson_fails(tmp_path):
    good = "import os, pathlib\npathlib.Path(os.environ['RBCOURSE_FIGURES'], 'new.png').touch()"
    paths = [
        notebook_at(tmp_path / "01_good.ipynb", good),
        notebook_at(tmp_path / "02_bad.ipynb", "1 / 0"),
    ]
    before, figures = [path.read_text() for path in paths], tmp_path / "figures"
    figures.mkdir()
    (figures / "old.png").touch()
    with pytest.raises(CellExecutionError, match="ZeroDivisionError"):
        drawing.regenerate(tmp_path, figures)
    assert [path.read_text() for path in paths] == before
    assert [file.name for file in figures.iterdir()] == ["old.png"]


def test_storing_one_lesson_changes_no_other_file(tmp_path, monkeypatch):
    async def execute(path, figures):
        """Save a figure named after the lesson; return the lesson with a new source."""
        name = path.stem[3:]
        (figures / f"lesson01_{name}.png").write_text(name)
        return nbformat.writes(new_notebook(cells=[new_code_cell(name, id="cell-0")])) + "\n"

    monkeypatch.setattr(drawing, "execute", execute)
    figures = tmp_path / "figures"
    figures.mkdir()
    was = {f"lesson01_{name}.png": "as it was" for name in ("arm", "old", "plane")} | {
        "my.png": "mine"
    }
    for file, text in was.items():
        (figures / file).write_text(text)
    paths = [notebook_at(tmp_path / f"{name}.ipynb", "1") for name in ("01_plane", "02_arm")]
    before = paths[1].read_text()
    drawing.regenerate(tmp_path, figures, ["01"])
    assert '"plane"' in paths[0].read_text()
    assert paths[1].read_text() == before
    now = {file.name: file.read_text() for file in figures.iterdir()}
    assert now == was | {"lesson01_plane.png": "plane"}
    drawing.regenerate(tmp_path, figures)
    assert '"arm"' in paths[1].read_text()
    assert {file.name for file in figures.iterdir()} == was.keys() - {"lesson01_old.png"}
    with pytest.raises(ValueError, match=r"numbers of lessons, .*, are wanted, got '03'"):
        drawing.regenerate(tmp_path, figures, ["03"])


def test_lessons_and_figures_are_stored_completely_or_not_at_all(tmp_path, monkeypatch):
    async def execute(path, figures):
        (figures / "plane.png").write_text("another picture")
        return nbformat.writes(new_notebook(cells=[new_code_cell("2", id="cell-0")])) + "\n"

    monkeypatch.setattr(drawing, "execute", execute)
    lessons, figures = tmp_path / "course" / "notebooks", tmp_path / "course" / "figures"
    for folder in (lessons, figures):
        folder.mkdir(parents=True)
    notebook_at(lessons / "01_plane.ipynb", "1")
    (figures / "plane.png").write_text("a picture")
    write = partial(drawing.regenerate, lessons, figures)
    check_all_or_nothing(write, lessons.parent)
    check_all_or_nothing(write, figures)


@pytest.fixture
def folders(tmp_path, monkeypatch):
    """Return a folder with one lesson and one assignment, and a folder to work in."""
    monkeypatch.setenv("JUPYTER_DATA_DIR", str(tmp_path / "data"))
    source = tmp_path / "notebooks"
    source.mkdir()
    notebook_at(source / "01_plane.ipynb", "1")
    notebook_at(source / "ps1.ipynb", "1")
    return source, tmp_path / "work"


def new_version(folders, source="2"):
    """Change the lesson, and copy the lessons twice; the second copy changes nothing."""
    notebook_at(folders[0] / "01_plane.ipynb", source)
    for _ in range(2):
        notebooks.copy_lessons(*folders)
    return sorted(path.name for path in folders[1].glob("*.ipynb"))


def test_copies_of_lessons_are_trusted(folders):
    notebooks.copy_lessons(*folders)
    (copy,) = folders[1].glob("*.ipynb")
    assert copy.name == "01_plane.ipynb"
    notary = NotebookNotary()
    assert notary.check_signature(nbformat.read(copy, as_version=4))
    notary.store.close()


@pytest.mark.parametrize("there", [False, True])
def test_a_copy_is_written_completely_or_not_at_all(folders, there):
    """A copy that is cut off would count as the student's own work in all later versions."""
    folders[1].mkdir()
    if there:
        notebooks.copy_lessons(*folders)
    notebook_at(folders[0] / "01_plane.ipynb", "2")
    check_all_or_nothing(lambda: notebooks.copy_lessons(*folders), folders[1])
    assert new_version(folders) == ["01_plane.ipynb"]
    assert '"2"' in (folders[1] / "01_plane.ipynb").read_text()


@pytest.mark.parametrize("damaged", [None, b"", b"[]", b"{", b"\xff\xfe", b"null"])
@pytest.mark.parametrize("run", [False, True])
def test_a_new_version_replaces_a_copy_that_was_not_edited(folders, damaged, run):
    """A damaged record of copies is ignored."""
    notebooks.copy_lessons(*folders)
    copy = folders[1] / "01_plane.ipynb"
    if damaged is not None:
        (folders[1] / ".copied.json").write_bytes(damaged)
        notebooks.copy_lessons(*folders)
    if run:
        notebook = nbformat.read(copy, as_version=4)
        notebook.cells[0].outputs = [new_output("stream", text="1")]
        nbformat.write(notebook, copy)
    assert new_version(folders) == ["01_plane.ipynb"]
    assert '"2"' in copy.read_text()


@pytest.mark.parametrize("there", [False, True])
@pytest.mark.parametrize("work", ["my notes", nbformat.writes(new_notebook())])
def test_a_copy_that_was_edited_is_never_changed(folders, capsys, there, work):
    """A file that existed before, or that is not a notebook any more, is not changed either."""
    if there:
        folders[1].mkdir()
    else:
        notebooks.copy_lessons(*folders)
    mine = folders[1] / "01_plane.ipynb"
    mine.write_text(work)
    for version in ("2", "3"):
        assert f"01_plane_{version}.ipynb" in new_version(folders, version)
        assert mine.read_text() == work
        assert f'"{version}"' in (folders[1] / f"01_plane_{version}.ipynb").read_text()
    assert len(list(folders[1].glob("*.ipynb"))) == 3
    assert "your copy is kept, the new one is 01_plane_2.ipynb" in capsys.readouterr().out


def test_a_lesson_that_is_not_a_notebook_is_reported(folders, monkeypatch):
    closed, close = [], SQLiteSignatureStore.close
    monkeypatch.setattr(SQLiteSignatureStore, "close", lambda s: closed.append(close(s)))
    (folders[0] / "02_arm.ipynb").write_text("<<<<<<< HEAD")
    with pytest.raises(ValueError, match=r"02_arm\.ipynb is not a notebook"):
        notebooks.copy_lessons(*folders)
    assert len(closed) == 1  # the signatures are in a database
    assert not (folders[1] / "02_arm.ipynb").exists()
    assert (folders[1] / "01_plane.ipynb").exists()


def test_a_copy_that_cannot_be_signed_is_still_made(folders, monkeypatch, capsys):
    def refuse(self, notebook):
        raise PermissionError("read-only home")

    monkeypatch.setattr(NotebookNotary, "sign", refuse)
    assert new_version(folders) == ["01_plane.ipynb"]
    assert "not marked as trusted: read-only home" in capsys.readouterr().out


def test_widgets_are_saved_only_as_still_pictures():
    widget = {"application/vnd.jupyter.widget-view+json": {"model_id": "1"}}
    still, alone = {"text/html": "<img>", **widget}, {"text/plain": "IntSlider()", **widget}
    outputs = [{"data": still}, {"name": "stdout", "text": "1"}, {"data": alone}]
    cells = [{"cell_type": "markdown", "source": "text"}, {"cell_type": "code", "outputs": outputs}]
    for kind, content in (("notebook", {"cells": cells}), ("file", "text"), ("notebook", None)):
        model = {"type": kind, "content": content}
        notebooks.before_saving(model, path="work/a.ipynb", contents_manager=None)
    assert still == {"text/html": "<img>"}
    assert alone == {"text/plain": "IntSlider()", **widget}


def test_an_original_keeps_its_bytes_after_a_run(folders, monkeypatch, request):
    lesson, (place, _) = "notebooks/01_plane.ipynb", folders
    notebooks.copy_lessons(*folders)
    manager = LargeFileManager(root_dir=str(place.parent))
    request.addfinalizer(lambda: manager.notary.store.close())
    manager.pre_save_hook = notebooks.before_saving
    stored = (place / "01_plane.ipynb").read_bytes()
    model = manager.get(lesson)
    model["content"]["cells"][0]["outputs"] = [new_output("stream", text="1")]
    manager.save(model, lesson)
    assert (place / "01_plane.ipynb").read_bytes().rstrip() == stored.rstrip()
    changed = {**model, "content": new_notebook(cells=[new_code_cell("2")])}
    tagged = manager.get(lesson)
    tagged["content"]["cells"][0]["metadata"]["tags"] = ["solution"]
    for each in (changed, tagged):
        with pytest.raises(HTTPError, match=r"is an original, and is not saved\. Your copy is in"):
            manager.save(each, lesson)
    for _ in range(2):
        manager.save(changed, "notebooks/01_mine.ipynb")
    (place / "01_plane.ipynb").write_text("<<<<<<< HEAD")
    with pytest.raises(HTTPError, match=r"01_plane\.ipynb is not saved"):
        manager.save(tagged, lesson)
    monkeypatch.setenv("RBCOURSE_EDIT", "1")
    manager.save(changed, lesson)
    assert '"2"' in (place / "01_plane.ipynb").read_text()
