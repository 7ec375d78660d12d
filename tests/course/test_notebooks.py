"""The machinery that runs, stores and copies lessons."""

import os

import nbformat
import nbval.kernel
import pytest
from nbclient.exceptions import CellExecutionError
from nbformat.sign import NotebookNotary
from nbformat.v4 import new_code_cell, new_notebook

from rbcourse.course import notebooks


def notebook_at(path, *sources):
    cells = [new_code_cell(source) for source in sources]
    for number, cell in enumerate(cells):
        cell.id = f"cell-{number}"
    path.write_text(nbformat.writes(new_notebook(cells=cells)), encoding="utf-8")
    return path


def test_runs_give_the_same_bytes(tmp_path):
    source = "import uuid\nprint(object(), uuid.uuid4().hex)\nobject()"
    path = notebook_at(tmp_path / "01_ids.ipynb", source, "print(uuid.uuid4().hex)")
    first = notebooks.execute(path, tmp_path)
    assert first == notebooks.execute(path, tmp_path)
    assert "0x0>" in first
    assert f"{1:032x}" in first
    assert f"{2:032x}" in first


@pytest.mark.skipif(os.name == "nt", reason="there kernels listen at ports")
def test_kernels_listen_at_files(tmp_path):
    source = (
        "import ipykernel, json\nprint(json.loads(ipykernel.get_connection_info())['transport'])"
    )
    ran = notebooks.execute(notebook_at(tmp_path / "01_kernel.ipynb", source), tmp_path)
    assert nbformat.reads(ran, as_version=4).cells[0].outputs[0].text == "ipc\n"
    assert nbval.kernel.KernelManager(kernel_name="python3").transport == "ipc"


def test_of_an_explorer_its_still_is_stored_the_same_each_time(tmp_path):
    source = "from rbcourse import explore\nexplore.arm_explorer()"
    path = notebook_at(tmp_path / "01_arm.ipynb", source)
    first = notebooks.execute(path, tmp_path)
    assert first == notebooks.execute(path, tmp_path)
    stored = nbformat.reads(first, as_version=4)
    (output,) = stored.cells[0].outputs
    assert set(output.data) == {"text/html", "text/plain"}
    assert "data:image/png" in output.data["text/html"]
    assert "widgets" not in stored.metadata


def test_sources_are_left_as_they_are(tmp_path):
    source = "key = 'd41d8cd98f00b204e9800998ecf8427e'; place = '0xdeadbeef'"
    path = notebook_at(tmp_path / "01_key.ipynb", source)
    stored = nbformat.reads(notebooks.execute(path, tmp_path), as_version=4)
    assert stored.cells[0].source == source


def test_without_lessons_nothing_is_removed(tmp_path):
    (tmp_path / "thesis.pdf").touch()
    with pytest.raises(ValueError, match="no lessons here"):
        notebooks.regenerate(tmp_path, tmp_path)
    assert (tmp_path / "thesis.pdf").exists()


def test_what_is_printed_in_pieces_is_stored_as_one(tmp_path):
    source = "import time\nprint('one', flush=True)\ntime.sleep(0.5)\nprint('two')"
    path = notebook_at(tmp_path / "01_pieces.ipynb", source)
    stored = nbformat.reads(notebooks.execute(path, tmp_path), as_version=4)
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


def test_a_lesson_that_is_no_notebook_is_named_and_not_copied(folders):
    (folders[0] / "02_arm.ipynb").write_text("<<<<<<< HEAD")
    with pytest.raises(ValueError, match=r"02_arm\.ipynb is no notebook"):
        notebooks.copy_lessons(*folders)
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
