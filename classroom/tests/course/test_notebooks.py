"""The machinery that runs, stores and copies lessons."""

import os
import runpy
from pathlib import Path

import nbformat
import nbval.kernel
import pytest
from jupyter_client import KernelManager
from jupyter_server.services.contents.largefilemanager import LargeFileManager
from nbclient.exceptions import CellExecutionError
from nbformat.sign import NotebookNotary, SQLiteSignatureStore
from nbformat.v4 import new_code_cell, new_notebook, new_output
from tornado.web import HTTPError

from rbclassroom.course import notebooks


def notebook_at(path, *sources):
    cells = [new_code_cell(source) for source in sources]
    for number, cell in enumerate(cells):
        cell.id = f"cell-{number}"
    path.write_text(nbformat.writes(new_notebook(cells=cells)), encoding="utf-8")
    return path


SOURCES = {
    "ids": "import uuid\nprint(object(), uuid.uuid4().hex)\nobject()",
    "more ids": "print(uuid.uuid4().hex)",
    "names": "key = 'd41d8cd98f00b204e9800998ecf8427e'; place = '0xdeadbeef'",
    "pieces": "print('one', flush=True)\nprint('two')",
    "kernel": "import ipykernel, json\n"
    "print(json.loads(ipykernel.get_connection_info())['transport'])",
    "explorer": "from rbclassroom import explorers\nexplorers.arm_explorer()",
}


@pytest.fixture(scope="module")
def twice(tmp_path_factory):
    """A lesson with these cells, run twice."""
    folder = tmp_path_factory.mktemp("lesson")
    path = notebook_at(folder / "01_all.ipynb", *SOURCES.values())
    return [notebooks.execute(path, folder) for _ in range(2)]


@pytest.fixture(scope="module")
def stored(twice):
    return nbformat.reads(twice[0], as_version=4)


def cell_of(stored, name):
    return stored.cells[list(SOURCES).index(name)]


def test_runs_give_the_same_bytes(twice, stored):
    assert twice[0] == twice[1]
    assert "0x0>" in cell_of(stored, "ids").outputs[0].text
    assert f"{1:032x}" in cell_of(stored, "ids").outputs[0].text
    assert f"{2:032x}" in cell_of(stored, "more ids").outputs[0].text


@pytest.mark.skipif(os.name == "nt", reason="there kernels listen at ports")
def test_kernels_listen_at_files(stored, monkeypatch, request):
    assert cell_of(stored, "kernel").outputs[0].text == "ipc\n"
    monkeypatch.setattr(nbval.kernel, "KernelManager", KernelManager)
    conftest = Path(__file__).parents[3] / "notebooks/conftest.py"
    runpy.run_path(str(conftest))["pytest_configure"](request.config)
    assert nbval.kernel.KernelManager(kernel_name="python3").transport == "ipc"


def test_of_an_explorer_its_still_is_stored(stored):
    (output,) = cell_of(stored, "explorer").outputs
    assert set(output.data) == {"text/html", "text/plain"}
    assert "data:image/png" in output.data["text/html"]
    assert "widgets" not in stored.metadata


def test_sources_are_left_as_they_are(stored):
    assert [cell.source for cell in stored.cells] == list(SOURCES.values())


def test_what_is_printed_in_pieces_is_stored_as_one(stored):
    assert [output.text for output in cell_of(stored, "pieces").outputs] == ["one\ntwo\n"]


def test_without_lessons_nothing_is_removed(tmp_path):
    (tmp_path / "thesis.pdf").touch()
    with pytest.raises(ValueError, match="no lessons here"):
        notebooks.regenerate(tmp_path, tmp_path)
    assert (tmp_path / "thesis.pdf").exists()


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
        notebooks.regenerate(tmp_path, figures)
    assert [path.read_text() for path in paths] == before
    assert [file.name for file in figures.iterdir()] == ["old.png"]
    paths[1].unlink()
    notebooks.regenerate(tmp_path, figures)
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
    notebooks.copy_lessons(*folders)
    copies = list(folders[1].glob("*.ipynb"))
    assert [copy.name for copy in copies] == ["01_plane.ipynb"]
    notary = NotebookNotary()
    assert notary.check_signature(nbformat.read(copies[0], as_version=4))
    notary.store.close()


def test_a_new_version_replaces_a_copy_that_was_left_alone(folders):
    notebooks.copy_lessons(*folders)
    notebook_at(folders[0] / "01_plane.ipynb", "2")
    notebooks.copy_lessons(*folders)
    assert '"2"' in (folders[1] / "01_plane.ipynb").read_text()
    assert len(list(folders[1].glob("*.ipynb"))) == 1


def test_a_copy_that_was_worked_in_is_never_touched(folders, capsys):
    notebooks.copy_lessons(*folders)
    mine = notebook_at(folders[1] / "01_plane.ipynb", "my work")
    notebooks.copy_lessons(*folders)
    assert "my work" in mine.read_text()
    for version in ("2", "3"):
        notebook_at(folders[0] / "01_plane.ipynb", version)
        notebooks.copy_lessons(*folders)
        notebooks.copy_lessons(*folders)
        assert "my work" in mine.read_text()
        assert f'"{version}"' in (folders[1] / f"01_plane_{version}.ipynb").read_text()
    assert len(list(folders[1].glob("*.ipynb"))) == 3
    assert "your copy stays, the new one is 01_plane_2.ipynb" in capsys.readouterr().out


def test_a_copy_that_was_only_run_is_replaced(folders):
    notebooks.copy_lessons(*folders)
    copy = folders[1] / "01_plane.ipynb"
    copy.write_text(notebooks.execute(copy, folders[1]), encoding="utf-8")
    notebook_at(folders[0] / "01_plane.ipynb", "2")
    notebooks.copy_lessons(*folders)
    assert '"2"' in copy.read_text()
    assert len(list(folders[1].glob("*.ipynb"))) == 1


def test_a_copy_that_is_no_notebook_any_more_is_never_touched(folders):
    notebooks.copy_lessons(*folders)
    (folders[1] / "01_plane.ipynb").write_text("my notes")
    notebook_at(folders[0] / "01_plane.ipynb", "2")
    notebooks.copy_lessons(*folders)
    assert (folders[1] / "01_plane.ipynb").read_text() == "my notes"
    assert (folders[1] / "01_plane_2.ipynb").exists()


def test_a_copy_that_was_there_before_is_never_touched(folders):
    folders[1].mkdir()
    mine = notebook_at(folders[1] / "01_plane.ipynb", "my work")
    notebooks.copy_lessons(*folders)
    assert "my work" in mine.read_text()
    assert (folders[1] / "01_plane_2.ipynb").exists()


@pytest.mark.parametrize("damaged", [b"", b"[]", b"{", b"\xff\xfe", b"null"])
def test_a_damaged_record_is_no_record(folders, damaged):
    notebooks.copy_lessons(*folders)
    (folders[1] / ".copied.json").write_bytes(damaged)
    notebooks.copy_lessons(*folders)
    assert len(list(folders[1].glob("*.ipynb"))) == 1
    notebook_at(folders[0] / "01_plane.ipynb", "2")
    notebooks.copy_lessons(*folders)
    assert len(list(folders[1].glob("*.ipynb"))) == 1


def test_a_lesson_that_is_no_notebook_is_named_and_not_copied(folders, monkeypatch):
    closed, close = [], SQLiteSignatureStore.close
    monkeypatch.setattr(SQLiteSignatureStore, "close", lambda s: closed.append(close(s)))
    (folders[0] / "02_arm.ipynb").write_text("<<<<<<< HEAD")
    with pytest.raises(ValueError, match=r"02_arm\.ipynb is no notebook"):
        notebooks.copy_lessons(*folders)
    assert len(closed) == 1  # what is trusted is a database
    assert not (folders[1] / "02_arm.ipynb").exists()
    assert (folders[1] / "01_plane.ipynb").exists()


def test_a_copy_that_cannot_be_signed_is_still_a_copy(folders, monkeypatch, capsys):
    def refuse(self, notebook):
        raise PermissionError("read-only home")

    monkeypatch.setattr(NotebookNotary, "sign", refuse)
    for _ in range(2):
        notebooks.copy_lessons(*folders)
    assert [copy.name for copy in folders[1].glob("*.ipynb")] == ["01_plane.ipynb"]
    assert "not marked as trusted: read-only home" in capsys.readouterr().out


def test_what_is_saved_keeps_the_stills_of_widgets_and_drops_the_widgets():
    still = {"text/html": "<img>", "application/vnd.jupyter.widget-view+json": {"model_id": "1"}}
    alone = {"text/plain": "IntSlider()", "application/vnd.jupyter.widget-view+json": {}}
    cells = [
        {"cell_type": "markdown", "source": "text"},
        {"cell_type": "code", "outputs": [{"data": still}, {"name": "stdout", "text": "1"}]},
        {"cell_type": "code", "outputs": [{"data": dict(alone)}]},
    ]
    model = {"type": "notebook", "content": {"cells": cells}}
    notebooks.before_saving(model, path="work/a.ipynb", contents_manager=None)
    assert cells[1]["outputs"][0]["data"] == {"text/html": "<img>"}
    assert cells[2]["outputs"][0]["data"] == alone
    for model in ({"type": "file", "content": "text"}, {"type": "notebook", "content": None}):
        notebooks.before_saving(model, path="work/a", contents_manager=None)


def test_an_original_that_was_run_keeps_its_bytes_and_one_that_was_changed_is_not_saved(
    folders, monkeypatch, request
):
    lesson, (place, _) = "notebooks/01_plane.ipynb", folders
    notebooks.copy_lessons(*folders)
    manager = LargeFileManager(root_dir=str(place.parent))
    request.addfinalizer(lambda: manager.notary.store.close())
    manager.pre_save_hook = notebooks.before_saving
    stored = (place / "01_plane.ipynb").read_bytes()
    model = manager.get(lesson)
    cells = model["content"]["cells"]
    cells[0]["outputs"] = [new_output("stream", text="1")]
    manager.save(model, lesson)
    assert (place / "01_plane.ipynb").read_bytes().rstrip() == stored.rstrip()
    model["content"] = new_notebook(cells=[new_code_cell("2")])
    with pytest.raises(
        HTTPError, match=r"is an original, and is not saved\. Your copy is in work/"
    ):
        manager.save(model, lesson)
    manager.save(model, "notebooks/01_mine.ipynb")
    manager.save(model, "notebooks/01_mine.ipynb")
    model = manager.get(lesson)
    model["content"]["cells"][0]["metadata"]["tags"] = ["solution"]
    with pytest.raises(HTTPError, match="is an original"):
        manager.save(model, lesson)
    (place / "01_plane.ipynb").write_text("<<<<<<< HEAD")
    with pytest.raises(HTTPError, match=r"01_plane\.ipynb is not saved"):
        manager.save(model, lesson)
    model["content"] = new_notebook(cells=[new_code_cell("2")])
    monkeypatch.setenv("RBCOURSE_EDIT", "1")
    manager.save(model, lesson)
    assert '"2"' in (place / "01_plane.ipynb").read_text()


DRAW = """
import os, pathlib
def save_figure(fig, name):
    pathlib.Path(os.environ["RBCOURSE_FIGURES"], name + ".png").write_text(name)
fig = None
save_figure(fig, "NAME")
"""


def test_one_lesson_is_stored_again_and_nothing_else_is_touched(tmp_path):
    figures = tmp_path / "figures"
    figures.mkdir()
    for file in ("arm.png", "old.png", "plane.png"):  # the last one is damaged
        (figures / file).write_text("as it was")
    paths = [
        notebook_at(tmp_path / f"0{k}_{name}.ipynb", DRAW.replace("NAME", name))
        for k, name in ((1, "plane"), (2, "arm"))
    ]
    before = [path.read_text() for path in paths]
    notebooks.regenerate(tmp_path, figures, ["01"])
    assert [path.read_text() != text for path, text in zip(paths, before, strict=True)] == [
        True,
        False,
    ]
    assert {file.name: file.read_text() for file in figures.iterdir()} == {
        "arm.png": "as it was",
        "old.png": "as it was",
        "plane.png": "plane",
    }
    notebooks.regenerate(tmp_path, figures)
    assert {file.name for file in figures.iterdir()} == {"arm.png", "plane.png"}
    with pytest.raises(ValueError, match="no lesson's name begins with '03'"):
        notebooks.regenerate(tmp_path, figures, ["03"])
