"""The problem sets handed out, handed in and graded, as students and teachers meet them."""

import base64
import csv
import html
import io
import re
import shutil
from textwrap import indent
from zipfile import ZipFile

import nbformat
import pytest
from nbgrader.api import Gradebook
from nbgrader.utils import determine_grade
from test_problems import SETS, SOURCE, TABLES, sets

from rbclassroom.assignments.grade import grade
from rbclassroom.assignments.handout import make_handout, make_solutions, release

ROOT = SOURCE.parents[2]
FIRST = next(iter(SETS))


def regions(name, kinds):
    """The lines that students must not see, but short ones and those that they see elsewhere."""
    text = "\n".join(cell.source for cell in SETS[name].cells)
    inside = re.findall(rf"BEGIN (?:{kinds})(.*?)END (?:{kinds})", text, re.DOTALL)
    outside = re.sub(r"(?s)BEGIN [A-Z]+.*?END [A-Z]+", "", text)
    lines = {line.strip() for line in "\n".join(inside).splitlines()}
    lines -= {line.strip() for line in outside.splitlines()}
    return [ln for ln in lines if len(ln) >= 12 and not re.match("(import|from|raise|#+) ", ln)]


def points(name):
    """The points of the cells with tests, and of those in words."""
    marks = [cell.metadata.nbgrader for cell in SETS[name].cells]
    graded = {mark.grade_id: mark.points for mark in marks if mark.grade}
    tests = {key: value for key, value in graded.items() if key.endswith("-test")}
    return tests, {key: value for key, value in graded.items() if key not in tests}


def answered(name, text, answer):
    """The release with the answers that ``answer(grade_id, source)`` gives."""
    notebook = nbformat.reads(text, as_version=4)
    for cell in notebook.cells:
        if cell.metadata.nbgrader.solution:
            cell.source = answer(cell.metadata.nbgrader.grade_id, cell.source)
    return nbformat.writes(notebook)


def wrong(grade_id, source):
    """A wrong answer of the first set."""
    slug, table = grade_id.removesuffix("-answer"), TABLES[FIRST]
    if slug not in table:
        return source
    stub = source.partition("    # YOUR CODE HERE")[0]
    code = table[slug]["mistakes"][-1]["code"][-1]
    return f"{table['helpers']}\n\n{stub}{indent(code.strip(), '    ')}"


@pytest.fixture(scope="module")
def course(tmp_path_factory):
    """A course in which all sets were graded: solved, the first one wrong and untouched too.

    Another student solves each, so that all can be graded at once.
    """
    folder = tmp_path_factory.mktemp("course")
    shutil.copytree(SOURCE, folder / "source")
    shutil.copy(SOURCE.parent / "nbgrader_config.py", folder)
    given = {name: release(name, folder)[f"{name}.ipynb"].decode() for name in SETS}
    handed_in = {(FIRST, "untouched"): given[FIRST]}
    handed_in[FIRST, "wrong"] = answered(FIRST, given[FIRST], wrong)
    for name, text in given.items():
        model = {cell.metadata.nbgrader.grade_id: cell.source for cell in SETS[name].cells}
        solved = answered(name, text, lambda key, _, model=model: model[key])
        handed_in[name, f"solved {name}"] = solved
    for (name, student), text in handed_in.items():
        path = folder / "submitted" / student / name / f"{name}.ipynb"
        path.parent.mkdir(parents=True)
        path.write_text(text, encoding="utf-8")
    grade([], folder)
    return folder


def row(course, name, student):
    with (course / f"{name}-grades.csv").open(encoding="utf-8-sig", newline="") as table:
        return next(row for row in csv.DictReader(table) if row["student"] == student)


def page(course, name, student):
    text = (course / "feedback" / student / name / f"{name}.html").read_text("utf-8")
    return html.unescape(re.sub(r"<[^>]*>", "", text.split("<body>", 1)[1]))


@sets
def test_the_reference_gets_all_points(course, name):
    tests, words = points(name)
    student = f"solved {name}"
    found = row(course, name, student)
    assert {key: float(found[key]) for key in tests} == tests
    assert found["by hand"].split() == list(words)
    assert found["remarks"] == ""
    with Gradebook(f"sqlite:///{course / 'gradebook.db'}") as gradebook:
        for key, value in words.items():
            gradebook.find_grade(key, name, name, student).manual_score = value
        submission = gradebook.find_submission(name, student)
        assert submission.score == submission.max_score == float(found["maximum"]) == 20
        gradebook.db.rollback()


@sets
def test_the_untouched_release_gets_no_points_and_no_work_for_a_human(course, name):
    """Of the other sets, test_problems.py sees that their tests fail."""
    if name == FIRST:
        found = row(course, name, "untouched")
        assert float(found["total"]) == float(found["automatic"]) == 0
        assert (found["by hand"], found["remarks"]) == ("", "")
    notebook = nbformat.read(course / "release" / name / f"{name}.ipynb", as_version=4)
    cells = {cell.metadata.nbgrader.grade_id: cell for cell in notebook.cells}
    for key, value in points(name)[1].items():
        assert determine_grade(cells[key]) == (0, value)


def test_wrong_answers_get_no_points_and_their_hints(course):
    """Of the other sets, test_problems.py sees that their tests fail, and how."""
    found = row(course, FIRST, "wrong")
    assert {found[key] for key in points(FIRST)[0]} == {"0"}
    text = " ".join(page(course, FIRST, "wrong").split())
    for slug, table in TABLES[FIRST].items():
        if slug != "helpers":
            assert table["mistakes"][-1]["hint"][:40] in text


@sets
def test_the_release_is_what_nbgrader_makes_with_its_gradebook(course, name):
    made = (course / "release" / name / f"{name}.ipynb").read_bytes()
    assert made == release(name, course)[f"{name}.ipynb"]


@pytest.mark.parametrize("student", ["wrong", "untouched"])
def test_feedback_shows_no_hidden_test_and_no_mark_scheme(course, student):
    """Of the other sets, each release, which is what feedback is made from, shows none."""
    secrets = [re.sub(r"\s", "", line) for line in regions(FIRST, "HIDDEN TESTS|MARK SCHEME")]
    assert len(secrets) > 20
    text = re.sub(r"\s", "", page(course, FIRST, student))
    assert not [line for line in secrets if line in text]


def test_the_solutions_of_a_set_are_run(course):
    notebook = nbformat.read(make_solutions(FIRST, course), as_version=4)
    said = [out.text for cell in notebook.cells for out in cell.get("outputs", []) if "text" in out]
    assert sum(text.startswith("As it should be") for text in said) == len(points(FIRST)[0])


def files_in(content, place=""):
    """Every file of a zip, and of the zips and wheels in it."""
    with ZipFile(io.BytesIO(content)) as archive:
        for name in archive.namelist():
            inner = archive.read(name)
            if name.endswith((".zip", ".whl")):
                yield from files_in(inner, f"{place}{name}/")
            else:
                yield f"{place}{name}", inner.decode("utf-8", "replace")


@sets
def test_no_file_of_a_handout_gives_anything_away(course, name):
    files = dict(files_in(make_handout(name, course, ROOT).read_bytes()))
    assert any("whl/rbclassroom/assignments/marking.py" in path for path in files)
    for line in regions(name, "HIDDEN TESTS|MARK SCHEME"):
        assert not [path for path, text in files.items() if line in text], line
    shown = [text for path, text in files.items() if ".whl/" not in path]
    for line in regions(name, "HIDDEN TESTS|MARK SCHEME|SOLUTION"):
        assert not [text for text in shown if line in text], line
    packed = "\n".join(files.values())
    region = re.compile(r"### BEGIN SOLUTION\n(.*?) *### END", re.DOTALL)
    secrets = [text for cell in SETS[name].cells for text in region.findall(cell.source)]
    tables = [table for slug, table in TABLES[name].items() if slug != "helpers"]
    secrets += [code for table in tables for m in table["mistakes"] for code in m["code"]]
    for secret in secrets:
        encoded = base64.b64encode(secret.encode()).decode().rstrip("=")[:-4]
        hidden = [secret, secret[::-1], encoded]
        assert not [text for text in hidden if len(text) > 40 and text in packed]
