"""Test the sources of the book and the folder of the finished book."""

import json
import re
import sys
from pathlib import Path
from zipfile import ZipFile

import nbformat
import pytest

from rbclassroom.assignments.handout import LEFTOVER
from rbclassroom.book import build, reference
from rbclassroom.book.places import CONTENTS
from rbclassroom.book.polls import VOTE
from rbclassroom.course.ledger import MISPRINTS, WHAT
from rbclassroom.course.notebooks import lesson_paths

ROOT = Path(__file__).parents[3]
LESSONS = lesson_paths(ROOT / "notebooks")
FIGURES = ROOT / "figures"


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """Return the folder with the book's sources; only one file has a code page."""
    folder = tmp_path_factory.mktemp("book")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(reference, "shown_code", lambda *_: ["rbcourse/so3.py"])
        build.write_sources(ROOT, folder / "sources", folder / "extra", "us/course")
    return folder


@pytest.fixture(scope="module")
def source(written):
    """Return a function that reads the source of a page: ``source("ledger.md")``."""
    return lambda page: (written / "sources" / page).read_text("utf-8")


def test_problem_sets_have_no_solutions(source):
    original = (ROOT / "notebooks/assignments/source/ps1/ps1.ipynb").read_text("utf-8")
    assert "BEGIN SOLUTION" in original
    for number in range(1, 8):
        text = source(f"problems/ps{number}.ipynb")
        assert "YOUR CODE HERE" in text
        assert "SOLUTION" not in text
        assert "HIDDEN" not in text
        assert not LEFTOVER.search(text)


def test_old_addresses_lead_to_new_pages(written):
    for old, new in CONTENTS["moved"].items():
        text = (written / "extra" / old).read_text("utf-8")
        assert f'location.replace("{new}" + location.hash)' in text
        page = (Path(old).parent / new).with_suffix("")
        pages = (written / "sources" / page).parent.glob(f"{page.name}.*")
        assert [*pages]
        assert not [*(written / "sources").glob(f"{Path(old).with_suffix('')}.*")]


def test_the_course_is_included_without_outputs(written, source):
    with ZipFile(written / "extra/course.zip") as archive:
        names = {name.removeprefix("rbcourse/") for name in archive.namelist()}
        lesson = json.loads(archive.read("rbcourse/notebooks/06_geodesics.ipynb"))
    assert set(CONTENTS["course"]["files"]) <= names
    needed = {path for path in (ROOT / "rbcourse").rglob("*.*") if "__pycache__" not in path.parts}
    assert {path.relative_to(ROOT).as_posix() for path in needed if path.is_file()} <= names
    assert {"rbcourse/py.typed", "classroom/rbclassroom/book/pages/index.md"} <= names
    assert {"notebooks/slides/06.md", "notebooks/slides/06.svg"} <= names
    assert not any(name.startswith(("notebooks/assignments", "tests", "figures")) for name in names)
    assert all(cell.get("outputs", []) == [] for cell in lesson["cells"])
    install = source("install.md")
    assert '<a href="course.zip">' in install
    assert "git clone https://github.com/us/course" in install
    assert "Download ZIP" not in install


def test_stray_files_are_not_included(tmp_path):
    root, extra = tmp_path / "course", tmp_path / "extra"
    stray = ["grades.csv", "notebooks/ps1.ipynb", "rbcourse/a.py~", "rbcourse/.b/c.py"]
    stray += ["rbcourse/.d.py", "rbcourse/__pycache__/a.cpython-311.pyc", "rbcourse/grades.csv"]
    wanted = [*CONTENTS["course"]["files"], "rbcourse/a.py", "rbcourse/static/b.css"]
    for name in [*stray, *wanted]:
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text("x")
    extra.mkdir()
    build.Sources(root, tmp_path / "sources", extra).put_course()
    with ZipFile(extra / "course.zip") as archive:
        assert set(archive.namelist()) == {f"rbcourse/{name}" for name in wanted}


@pytest.mark.parametrize("name", ["https://github.com/us/course", "us", "us/a b"])
def test_a_repository_name_without_its_owner_is_refused(name, monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["build", "--repository", name])
    with pytest.raises(SystemExit):
        build.main()
    assert "owner/name is wanted" in capsys.readouterr().err


def test_a_folder_that_is_not_a_book_is_not_changed(tmp_path):
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(ValueError, match="is not a book made by this command"):
        build.build(ROOT, tmp_path)
    assert (tmp_path / "mine.txt").read_text() == "mine"


def book_of(folder, **files):
    """Write a book as the command does: its files, and their list."""
    for name, text in files.items():
        path = folder / name.replace("__", "/").replace("_html", ".html")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    names = [path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()]
    (folder / build.MADE).write_text("\n".join([build.HEAD, *names, ""]))
    return folder


def files_of(folder):
    paths = [path for path in folder.rglob("*") if path.is_file() and path.name != build.MADE]
    return {path.relative_to(folder).as_posix(): path.read_text() for path in paths}


def test_files_that_the_command_did_not_make_are_kept(tmp_path):
    book = book_of(tmp_path / "book", index_html="old", lessons__gone_html="old")
    own = {"CNAME": "rotations.example.org", "lessons/mine.html": "mine"}
    for name, text in own.items():
        (book / name).write_text(text)
    (book / ".git" / "refs").mkdir(parents=True)  # git needs this folder even if it is empty
    links = ["broken", "folder"] if sys.platform != "win32" else []  # they need a privilege there
    for name, target in zip(links, ("nowhere", ".."), strict=False):
        (book / name).symlink_to(target)
    for number in range(3):
        pages = book_of(tmp_path / "new", index_html=f"new {number}")
        kept = build.replace(book, pages, tmp_path / f"old {number}")
        assert kept == sorted([*own, *links])
        assert (book / ".git" / "refs").is_dir()
        assert all((book / name).is_symlink() for name in links)
        assert files_of(book) == own | {"index.html": f"new {number}"}


def test_a_file_that_has_the_name_of_a_new_page_stops_the_command(tmp_path):
    book = book_of(tmp_path / "book", index_html="old")
    (book / "search.html").write_text("mine")
    before = files_of(book)
    pages = book_of(tmp_path / "new", index_html="new", search_html="new")
    with pytest.raises(ValueError, match=r"search\.html would be replaced by a page of the book"):
        build.replace(book, pages, tmp_path / "old")
    assert files_of(book) == before


@pytest.mark.parametrize("moment", [1, 2])
@pytest.mark.parametrize("error", [KeyboardInterrupt, PermissionError])
def test_the_old_book_remains_if_the_new_one_cannot_be_put_there(
    tmp_path, monkeypatch, moment, error
):
    book = book_of(tmp_path / "book", index_html="old")
    (book / "CNAME").write_text("rotations.example.org")
    before, plain, calls = files_of(book), Path.rename, []

    def fails(path, target):
        calls.append(path)
        if len(calls) == moment:
            raise error
        return plain(path, target)

    monkeypatch.setattr(Path, "rename", fails)
    with pytest.raises(error):
        build.replace(book, book_of(tmp_path / "new", index_html="new"), tmp_path / "old")
    assert files_of(book) == before


def test_a_build_that_fails_leaves_the_old_book(tmp_path, monkeypatch):
    book = book_of(tmp_path / "book", index_html="old")
    before = files_of(book)

    def fails(*_):
        raise OSError("No space left on device")

    monkeypatch.setattr(build, "write_sources", fails)
    with pytest.raises(OSError, match="No space"):
        build.build(ROOT, book)
    assert files_of(tmp_path) == {f"book/{name}": text for name, text in before.items()}


def test_a_folder_that_cannot_be_written_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr("os.access", lambda *_: False)  # root may write everywhere
    with pytest.raises(ValueError, match=rf"^You cannot write to the folder .*{tmp_path.name}\.\n"):
        build.build(ROOT, tmp_path / "book")
    assert [*tmp_path.iterdir()] == []


@pytest.mark.parametrize("path", LESSONS, ids=lambda path: path.stem)
def test_the_page_of_a_lesson_omits_only_the_run_sheet(path, source):
    stored = nbformat.read(path, as_version=4).cells
    cells = nbformat.reads(source(f"lessons/{path.name}"), as_version=4).cells
    stored = [
        cell for cell in stored if not VOTE.search(cell.source)
    ]  # in pages, options are buttons
    code, page_code = ([x.source for x in y if x.cell_type == "code"] for y in (stored, cells))
    first = next(i for i, cell in enumerate(stored) if cell.source.startswith("## "))
    imports = [x.source for x in stored[:first] if x.cell_type == "code" and not x.outputs]
    others = [source for source in code if source not in imports]
    text = "\n\n".join(page_code)
    assert text.replace("\n", "") == "".join(others + imports).replace("\n", "")
    assert len(page_code) <= len(code)
    text = "\n".join(cell.source for cell in cells)
    assert text.count("<details") == text.count("</details>")
    answers = sum("### Answer to" in cell.source for cell in stored)
    assert text.count('class="answer"') == answers
    assert "mybinder.org/v2/gh/us/course" in text
    if path.stem != "00_start_here":
        assert f" · [run sheet for lecturers](../teach/{path.stem}.md) |" in text
        sheet = source(f"teach/{path.stem}.md")
        assert sheet.startswith("# Run sheet: ")
        assert "| minute | slide |" in sheet


def test_mentions_of_lessons_become_links(source):
    text = source("lessons/06_geodesics.ipynb")
    assert "([lesson 3](03_rotations_in_space.ipynb))" in text
    assert "Go on to [lesson 1](01_plane.ipynb)" in source("lessons/00_start_here.ipynb")
    cells = nbformat.reads(text, as_version=4).cells
    (explorer,) = [cell for cell in cells if "explorers.theta_explorer()" in cell.source]
    shown = explorer.outputs[0].data["text/html"]
    assert shown.startswith("<figure>")
    assert shown.rstrip().endswith("</figure>")


def test_the_ledger_has_a_row_for_every_key(source):
    page = source("ledger.md")
    assert page.count('class="row"') == len(WHAT) + len(MISPRINTS)
    cells = row(page, "bk-eq-16")
    assert "package/straight_line.html#rbcourse.straight_line.theta" in cells[2]
    assert "code/tests/test_projected_line.html#" in cells[3]
    assert "lessons/06_geodesics.html#s6" in cells[4]
    assert "figures.html#lesson06_chord" in cells[5]
    # the ledger lists our pictures for each figure of the texts
    for key, names in {
        "bk-fig-4": ["paper_fig4a", "paper_fig4b", "paper_fig4c"],
        "bk-fig-5": ["paper_fig5a", "paper_fig5b"],
        "rr-fig-6": ["report_fig6"],
    }.items():
        assert sorted(re.findall(r"figures\.html#(\w+)", row(page, key)[5])) == names
    assert row(page, "misprint-12")[4].startswith("our copy: ")
    assert "code/tests/" in row(page, "misprint-9")[5]


def row(page, anchor):
    cells = page[page.index(f'id="{anchor}"') :].split("\n* - ")[0]
    return re.split(r"\n  - ", cells)


def test_the_gallery_has_all_figures_with_their_files(source):
    page = source("figures.md")
    assert page.count("<img ") == len(list(FIGURES.glob("*.png")))
    for path in FIGURES.glob("*.*"):
        assert f'href="figures/{path.name}"' in page
    names = "paper_fig1", "report_fig4", "lesson00_cubes"
    places = [page.index(f'<div id="{name}">') for name in names]
    assert places == sorted(places)
    assert '<a href="lessons/06_geodesics.html#s1">' in page[places[0] : page.index("Figure 2a")]


def test_each_work_is_listed_with_its_lessons(source):
    page = source("references.md")
    listed = dict(re.findall(r'^- <a id="(\w+)"></a>.* Lesson (.*)\.$', page, re.MULTILINE))
    cited = (re.findall(r'"- \[(\w+)\] ', path.read_text("utf-8")) for path in LESSONS)
    assert set(listed) == {key for keys in cited for key in keys}
    lessons = re.findall(r"lessons/(\w+)\.html#references", listed["Shoemake1985"])
    assert lessons == ["06_geodesics", "11_other_roads"]


def test_answers_to_questions_are_folded(source):
    answers = (ROOT / "notebooks/QUESTIONS.md").read_text("utf-8").count("#### Answers")
    page = source("teach/questions.md")
    assert page.count("<details") == page.count("</details>") == answers > 50
    assert "\n#" not in page[page.index("<details") : page.index("</details>")]


def test_pages_of_the_package_begin_with_a_list_of_functions(source):
    page = source("package/index.md")
    assert "| [so3](so3.rst) | " in page
    assert "```{toctree}\n:hidden:\n\nso3\nquaternion\n" in page
    assert "book.build" not in page
    so3, forms = source("package/so3.rst"), source("package/closed_forms.rst")
    assert '<a href="#rbcourse.exp_so3"><code>exp_so3</code></a>' in so3
    assert ".. autofunction:: rbcourse.exp_so3\n" in so3
    last = ".. autodata:: rbcourse.closed_forms.FORMS"
    assert 0 < forms.index("autofunction:: rbcourse.closed_forms.bezier\n") < forms.index(last)
