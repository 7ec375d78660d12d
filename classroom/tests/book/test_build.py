"""The sources of the book, and the folder that it is written to."""

import json
from pathlib import Path
from zipfile import ZipFile

import pytest

from rbclassroom.assignments.handout import LEFTOVER
from rbclassroom.book import build

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    folder = tmp_path_factory.mktemp("book")
    build.write_sources(ROOT, folder / "sources", folder / "extra", "us/course")
    return folder


def test_the_sources_have_all_parts(written):
    pages = {p.relative_to(written / "sources").as_posix() for p in written.rglob("sources/**/*")}
    assert {
        *("index.md", "install.md", "ledger.md", "figures.md", "references.md", "conventions.md"),
        *("changelog.md", "contributing.md", "lessons/index.md", "lessons/06_geodesics.ipynb"),
        *("teach/06_geodesics.md", "teach/questions.md", "teach/problem_sets.md"),
        *("problems/ps1.ipynb", "package/index.md", "package/draw.save.rst", "files/LICENSE"),
    } <= pages
    extra = {path.relative_to(written / "extra").as_posix() for path in written.rglob("extra/**/*")}
    assert {"figures/paper_fig5a.csv", "lessons/06_geodesics.ipynb"} <= extra
    assert "code/tests/test_so3.html" in extra
    assert "figures/explorers" not in extra


def test_problem_sets_come_without_solutions(written):
    source = (ROOT / "notebooks/assignments/source/ps1/ps1.ipynb").read_text("utf-8")
    assert "BEGIN SOLUTION" in source
    for path in (written / "sources/problems").iterdir():
        text = path.read_text("utf-8")
        assert "YOUR CODE HERE" in text
        assert "SOLUTION" not in text
        assert "HIDDEN" not in text
        assert not LEFTOVER.search(text)


def test_the_course_comes_along_without_the_notebooks_of_teachers(written):
    with ZipFile(written / "extra/course.zip") as archive:
        names = {name.removeprefix("rbcourse/") for name in archive.namelist()}
        lesson = json.loads(archive.read("rbcourse/notebooks/06_geodesics.ipynb"))
    assert {"course.py", "environment.txt", "pyproject.toml", "LICENSE", "README.md"} <= names
    assert {"rbcourse/so3.py", "rbcourse/py.typed", "benchmarks/benchmarks.csv"} <= names
    assert not any(name.startswith(("notebooks/assignments", "tests", "figures")) for name in names)
    assert all(cell.get("outputs", []) == [] for cell in lesson["cells"])
    install = (written / "sources/install.md").read_text("utf-8")
    assert '<a href="course.zip">' in install
    assert "git clone https://github.com/us/course" in install
    assert "green button" not in install


def test_what_lies_about_is_not_taken_along(tmp_path):
    root, extra = tmp_path / "course", tmp_path / "extra"
    stray = ["grades.csv", "notebooks/ps1.ipynb", "rbcourse/a.py~", "rbcourse/.b/c.py"]
    stray += ["rbcourse/.d.py", "rbcourse/__pycache__/a.cpython-311.pyc", "rbcourse/grades.csv"]
    wanted = [*build._TAKEN, "rbcourse/a.py", "rbcourse/static/b.css"]
    for name in [*stray, *wanted]:
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text("x")
    extra.mkdir()
    build.Sources(root, tmp_path / "sources", extra).put_course()
    with ZipFile(extra / "course.zip") as archive:
        assert set(archive.namelist()) == {f"rbcourse/{name}" for name in wanted}


def test_with_a_repository_lessons_open_in_binder(written):
    lesson = (written / "sources/lessons/01_plane.ipynb").read_text("utf-8")
    assert "mybinder.org/v2/gh/us/course" in lesson


@pytest.mark.parametrize("name", ["https://github.com/us/course", "us", "us/a b"])
def test_a_repository_is_an_owner_and_a_name(name, monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["build", "--repository", name])
    with pytest.raises(SystemExit):
        build.main()
    assert "owner/name wanted" in capsys.readouterr().err


def test_a_folder_that_is_no_book_is_left_alone(tmp_path):
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(ValueError, match="is no book that was made here"):
        build.build(ROOT, tmp_path)
    assert (tmp_path / "mine.txt").read_text() == "mine"
