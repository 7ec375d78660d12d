"""What the students get: all they need, and nothing of what they shall find out."""

import io
import os
import subprocess
import sys
from pathlib import Path
from zipfile import ZipFile

import nbformat
import pytest
from nbclient.exceptions import CellExecutionError
from tiny_set import write_tiny_set

from rbclassroom.assignments.handout import NEEDED, make_handout, make_solutions, release

ROOT = Path(__file__).parents[3]
SECRETS = ["return x * x", "half = 0.5", "square(-3)", "isclose", "Like signs", "Mark scheme"]


@pytest.fixture(scope="module")
def course(tmp_path_factory):
    """A course folder, in a path with a space, with the tiny set and a file beside it."""
    folder = tmp_path_factory.mktemp("a course") / "assignments"
    (write_tiny_set(folder).parent / "table.csv").write_text("1,2\n")
    return folder


@pytest.fixture(scope="module")
def unpacked(course, tmp_path_factory):
    folder = tmp_path_factory.mktemp("a student")
    ZipFile(make_handout("ps0", course, ROOT)).extractall(folder)
    return folder / "ps0"


def changed(course, tmp_path, change):
    """A copy of the set, changed."""
    path = write_tiny_set(tmp_path)
    notebook = nbformat.read(path, as_version=4)
    change(notebook)
    nbformat.write(notebook, path)
    return tmp_path


def wheels_in(folder):
    return sorted(path.name for path in folder.glob("*.whl"))


def test_the_handout_holds_what_a_student_needs(course, unpacked):
    names = {path.relative_to(unpacked).as_posix() for path in unpacked.rglob("*.*")}
    wheels = wheels_in(unpacked)
    assert [name.partition("-")[0] for name in wheels] == ["rbcourse", "rbcourse_classroom"]
    own = {"ps0.ipynb", "original/ps0.ipynb", "requirements.txt", "README.txt", "table.csv"}
    assert names == {*own, *wheels}
    assert (unpacked / "original" / "ps0.ipynb").read_bytes() == (
        unpacked / "ps0.ipynb"
    ).read_bytes()
    assert {path.name for path in course.iterdir()} == {"source", "handouts"}


def test_requirements_are_pins_of_the_environment(unpacked):
    lines = (unpacked / "requirements.txt").read_text().splitlines()
    environment = (ROOT / "environment.txt").read_text("utf-8").splitlines()
    assert lines[-2:] == [f"./{name}" for name in wheels_in(unpacked)]
    assert set(lines[:-2]) < set(environment)
    assert [line.split("==")[0] for line in lines[:-2]] == NEEDED


def test_nothing_in_the_handout_gives_a_solution_away(unpacked):
    texts = [path.read_bytes() for path in unpacked.rglob("*.*") if path.suffix != ".whl"]
    for secret in SECRETS:
        assert not [text for text in texts if secret.encode() in text], secret
    wheels = [ZipFile(unpacked / name) for name in wheels_in(unpacked)]
    texts = [wheel.read(name) for wheel in wheels for name in wheel.namelist()]
    for secret in SECRETS[:1] + SECRETS[2:3] + SECRETS[4:5]:
        assert not [text for text in texts if secret.encode() in text], secret


def test_the_wheel_is_installed_from_the_unpacked_folder(unpacked, tmp_path):
    wheels = [f"./{name}" for name in wheels_in(unpacked)]
    pip = [sys.executable, "-m", "pip", "install", "--no-deps", "--no-index", "--no-compile"]
    target = tmp_path / "there"
    subprocess.run(
        [*pip, "-q", "--target", str(target), *wheels],
        cwd=unpacked,
        check=True,
        capture_output=True,
    )
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    done = subprocess.run(
        [sys.executable, "-c", "import rbclassroom; print(rbclassroom.__file__)"],
        cwd=target,
        env={**environment, "PYTHONPATH": str(target)},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.startswith(str(target))


def test_the_same_handout_is_made_each_time(course):
    path = make_handout("ps0", course, ROOT)
    before = path.read_bytes()
    path.unlink()
    assert make_handout("ps0", course, ROOT).read_bytes() == before
    assert [file.name for file in path.parent.iterdir()] == ["ps0.zip"]


def test_a_private_set_goes_before_that_of_the_course(tmp_path):
    write_tiny_set(tmp_path)
    private = write_tiny_set(tmp_path / "other")
    private.write_text(private.read_text().replace("A tiny set", "My own set"))
    (tmp_path / "private").mkdir()
    private.parent.rename(tmp_path / "private" / "ps0")
    assert b"My own set" in release("ps0", tmp_path)["ps0.ipynb"]


def hidden_test_mistyped(notebook):
    cell = notebook.cells[3]
    cell.source = cell.source.replace("BEGIN HIDDEN TESTS", "BEGIN HIDEN TESTS")


def mark_scheme_outside(notebook):
    notebook.cells[6].source += "\nMark scheme: a point"


def attachment_of_an_answer(notebook):
    notebook.cells[7].attachments = {"a.png": {"image/png": "AA=="}}


def solution_in_metadata(notebook):
    notebook.cells[2].metadata.note = "it is def square(x):"


def solution_without_end(notebook):
    notebook.cells[2].source = "### BEGIN SOLUTION\nx = 1"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (hidden_test_mistyped, "ps0.ipynb gives away '### BEGIN HIDEN TESTS'"),
        (mark_scheme_outside, "ps0.ipynb gives away 'Mark scheme'"),
        (attachment_of_an_answer, "nbgrader leaves the attachment"),
        (solution_in_metadata, r"ps0.ipynb gives away 'def square\(x\):'"),
        (solution_without_end, "cannot be released: no end solution statement found"),
    ],
)
def test_a_set_that_would_give_something_away_is_refused(course, tmp_path, change, message):
    folder = changed(course, tmp_path, change)
    with pytest.raises(ValueError, match=message):
        make_handout("ps0", folder, ROOT)
    assert not (folder / "handouts").exists()


def test_a_file_with_a_solution_and_a_second_notebook_are_refused(tmp_path):
    folder = write_tiny_set(tmp_path).parent
    (folder / "helper.py").write_text("def square(x):\n    return x * x\n")
    with pytest.raises(ValueError, match=r"helper\.py gives away"):
        release("ps0", tmp_path)
    (folder / "helper.py").unlink()
    (folder / "key.ipynb").write_bytes((folder / "ps0.ipynb").read_bytes())
    with pytest.raises(ValueError, match=r"key\.ipynb is a second notebook"):
        release("ps0", tmp_path)


def test_what_jupyter_leaves_there_is_left_out(tmp_path):
    path = write_tiny_set(tmp_path)
    left = path.parent / ".ipynb_checkpoints" / "ps0-checkpoint.ipynb"
    left.parent.mkdir()
    left.write_bytes(path.read_bytes())
    assert set(release("ps0", tmp_path)) == {"ps0.ipynb"}


def test_an_unknown_set_and_a_folder_without_sets_are_told_in_a_line(course, tmp_path):
    with pytest.raises(ValueError, match="no problem set ps9; there are: ps0"):
        release("ps9", course)
    (tmp_path / "source" / "ps1").mkdir(parents=True)
    command = [sys.executable, "-m", "rbclassroom.assignments", "handout", "ps1"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 1
    assert done.stderr.splitlines() == [
        "There is no problem set ps1; there are: none; this is run in the folder of the course."
    ]


def test_the_readme_is_plain_text_for_every_system(unpacked):
    readme = (unpacked / "README.txt").read_bytes()
    assert readme.count(b"\r\n") == readme.count(b"\n") > 20
    assert io.TextIOWrapper(io.BytesIO(readme), "ascii").read().startswith("Problem set ps0")


def test_solutions_are_run_and_hold_no_hidden_test_and_no_mark_scheme(course):
    path = make_solutions("ps0", course)
    assert path == course / "handouts" / "ps0-solutions.ipynb"
    notebook = nbformat.read(path, as_version=4)
    text = "\n".join(cell.source for cell in notebook.cells)
    for shown in ("return x * x", "half = 0.5", "Like signs"):
        assert shown in text
    for hidden in ("square(-3)", "isclose", "###", "nbgrader", "Mark scheme"):
        assert hidden not in path.read_text("utf-8")
    assert all(cell.execution_count for cell in notebook.cells if cell.cell_type == "code")


def test_solutions_that_fail_are_not_written(tmp_path):
    path = write_tiny_set(tmp_path)
    path.write_text(path.read_text("utf-8").replace("return x * x", "return x"), "utf-8")
    with pytest.raises(CellExecutionError, match="times itself"):
        make_solutions("ps0", tmp_path)
    assert not (tmp_path / "handouts").exists()
