"""The handout has all files that students need, and no solutions."""

import os
import subprocess
import sys
from pathlib import Path
from zipfile import ZipFile

import nbformat
import pytest
from nbclient.exceptions import CellExecutionError
from tiny import MODULE
from tiny_set import write_tiny_set

from rbclassroom.assignments.__main__ import main
from rbclassroom.assignments.handout import make_handout, make_solutions, release

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def course(tmp_path_factory):
    """Return a course folder with the tiny set and a data file; its path contains a space."""
    folder = tmp_path_factory.mktemp("a course") / "assignments"
    path = write_tiny_set(folder)
    (path.parent / "table.csv").write_text("1,2\n")
    left = path.parent / ".ipynb_checkpoints" / "ps0-checkpoint.ipynb"
    left.parent.mkdir()
    left.write_bytes(path.read_bytes())
    return folder


@pytest.fixture(scope="module")
def unpacked(course, tmp_path_factory):
    folder = tmp_path_factory.mktemp("a student")
    ZipFile(make_handout("ps0", course, ROOT)).extractall(folder)
    return folder / "ps0"


def test_the_handout_has_all_files_that_a_student_needs(course, unpacked):
    names = {path.relative_to(unpacked).as_posix() for path in unpacked.rglob("*.*")}
    wheels = sorted(path.name for path in unpacked.glob("*.whl"))
    assert [name.partition("-")[0] for name in wheels] == ["rbcourse", "rbcourse_classroom"]
    given = {"ps0.ipynb", "table.csv"}
    own = {"requirements.txt", "README.txt", *given, *(f"original/{name}" for name in given)}
    assert names == {*own, *wheels}
    original = (unpacked / "original" / "ps0.ipynb").read_bytes()
    assert (unpacked / "ps0.ipynb").read_bytes() == original
    assert {path.name for path in course.iterdir()} == {"source", "handouts"}
    lines = (unpacked / "requirements.txt").read_text().splitlines()
    environment = (ROOT / "environment.txt").read_text("utf-8")
    assert lines[-2:] == [f"./{name}" for name in wheels]
    assert all(f"\n{line} " in environment for line in lines[:-2])
    assert len(lines) == environment.count("==") - environment.count("== ") + 2
    readme = (unpacked / "README.txt").read_bytes()  # this text must be readable on every system
    assert readme.count(b"\r\n") == readme.count(b"\n") > 20
    assert readme.decode("ascii").startswith("Problem set ps0")


def test_the_wheels_are_installed_from_the_unpacked_folder(unpacked, tmp_path):
    pip = [*MODULE, "pip", "install", "--no-deps", "--no-index", "--no-compile", "-q", "--target"]
    wheels = [f"./{path.name}" for path in unpacked.glob("*.whl")]
    subprocess.run([*pip, str(tmp_path), *wheels], cwd=unpacked, check=True, capture_output=True)
    words = [sys.executable, "-c", "import rbclassroom; print(rbclassroom.__file__)"]
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    place = subprocess.check_output(words, cwd=tmp_path, env=environment, text=True)
    assert place.startswith(str(tmp_path))


def test_the_handout_has_the_same_bytes_each_time(course, unpacked):
    path = course / "handouts" / "ps0.zip"
    before = path.read_bytes()
    path.unlink()
    assert make_handout("ps0", course, ROOT).read_bytes() == before
    assert [file.name for file in path.parent.iterdir()] == ["ps0.zip"]


def test_a_private_set_replaces_the_public_one(tmp_path):
    write_tiny_set(tmp_path)
    private = write_tiny_set(tmp_path / "other")
    private.write_text(private.read_text().replace("A tiny set", "My own set"))
    (tmp_path / "private").mkdir()
    private.parent.rename(tmp_path / "private" / "ps0")
    assert b"My own set" in release("ps0", tmp_path)["ps0.ipynb"]


@pytest.mark.parametrize(
    ("at", "change", "message"),
    [
        (3, {"source": "### BEGIN HIDEN TESTS"}, "gives away '### BEGIN HIDEN TESTS'"),
        (6, {"source": "Mark scheme: a point"}, "ps0.ipynb gives away 'Mark scheme'"),
        (2, {"source": "### BEGIN SOLUTION"}, "be released: no end solution statement found"),
        (7, {"attachments": {"a.png": {"image/png": "AA=="}}}, "an answer has an attachment"),
        (2, {"metadata": {"note": "it is return x * x"}}, r"gives away 'return x \* x'"),
    ],
)
def test_sets_that_reveal_solutions_or_hidden_tests_are_refused(tmp_path, at, change, message):
    path = write_tiny_set(tmp_path)
    notebook = nbformat.read(path, as_version=4)
    cell = notebook.cells[at]
    cell.update(change, metadata=cell.metadata | change.get("metadata", {}))
    nbformat.write(notebook, path)
    with pytest.raises(ValueError, match=message):
        make_handout("ps0", tmp_path, ROOT)
    assert not (tmp_path / "handouts").exists()


def test_data_files_with_solutions_are_refused(tmp_path):
    folder = write_tiny_set(tmp_path).parent
    (folder / "helper.py").write_text("def square(x):\n    return x * x\n")
    with pytest.raises(ValueError, match=r"helper\.py gives away"):
        release("ps0", tmp_path)
    (folder / "helper.py").unlink()
    (folder / "key.ipynb").write_bytes((folder / "ps0.ipynb").read_bytes())
    with pytest.raises(ValueError, match=r"key\.ipynb is a second one"):
        release("ps0", tmp_path)


def test_unknown_sets_are_refused(course, tmp_path, monkeypatch):
    with pytest.raises(ValueError, match=r"one of the problem sets is wanted \(ps0\), got ps9"):
        release("ps9", course)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["assignments", "handout", "ps1"])
    with pytest.raises(SystemExit, match=r"none; run this in the folder of the course\), got ps1"):
        main()


def test_solutions_contain_no_hidden_test(course):
    path = make_solutions("ps0", course)
    assert path == course / "handouts" / "ps0-solutions.ipynb"
    notebook = nbformat.read(path, as_version=4)
    text = "\n".join(cell.source for cell in notebook.cells)
    for shown in ("return x * x", "half = 0.5", "Like signs"):
        assert shown in text
    for hidden in ("square(-3)", "isclose", "###", "nbgrader", "Mark scheme"):
        assert hidden not in path.read_text("utf-8")
    assert all(cell.execution_count for cell in notebook.cells if cell.cell_type == "code")


def test_failing_solutions_are_not_written(tmp_path):
    path = write_tiny_set(tmp_path)
    path.write_text(path.read_text("utf-8").replace("return x * x", "return x"), "utf-8")
    with pytest.raises(CellExecutionError, match="times itself"):
        make_solutions("ps0", tmp_path)
    assert not (tmp_path / "handouts").exists()
