"""The problem sets handed out, handed in and graded, as students and teachers meet them."""

import base64
import csv
import html
import io
import re
import shutil
import tomllib
from pathlib import Path
from textwrap import indent
from zipfile import ZipFile

import nbformat
import pytest
from nbgrader.api import Gradebook

from rbclassroom.assignments.grade import grade_all
from rbclassroom.assignments.handout import make_handout, release

ROOT = Path(__file__).parents[3]
ASSIGNMENTS = ROOT / "notebooks" / "assignments"
SETS = sorted(path.parent.name for path in ASSIGNMENTS.glob("source/*/*.ipynb"))


TABLES = {
    name: tomllib.loads((ASSIGNMENTS / f"source/{name}.toml").read_text("utf-8")) for name in SETS
}


def source_of(name):
    return nbformat.read(ASSIGNMENTS / "source" / name / f"{name}.ipynb", as_version=4)


def hidden_lines(name, kinds="HIDDEN TESTS|MARK SCHEME"):
    """The lines that students must not see, but short ones and those that they see elsewhere."""
    texts = [cell.source for cell in source_of(name).cells]
    region = rf"BEGIN ({kinds})(.*?)END (?:{kinds})"
    inside = "\n".join(found[1] for text in texts for found in re.findall(region, text, re.DOTALL))
    outside = re.sub(r"(?s)BEGIN [A-Z]+.*?END [A-Z]+", "", "\n".join(texts))
    lines = {line.strip() for line in inside.splitlines()}
    lines -= {line.strip() for line in outside.splitlines()}
    return [ln for ln in lines if len(ln) >= 12 and not re.match("(import|from|raise|#+) ", ln)]


def kinds(name):
    """The names of the graded cells: those with tests, and those in words."""
    graded = [cell for cell in source_of(name).cells if cell.metadata.nbgrader.grade]
    points = {cell.metadata.nbgrader.grade_id: cell.metadata.nbgrader.points for cell in graded}
    tests = {key: value for key, value in points.items() if key.endswith("-test")}
    return tests, {key: value for key, value in points.items() if key not in tests}


def solved(name, text):
    """The release with the model answers."""
    notebook = nbformat.reads(text, as_version=4)
    answers = {cell.metadata.nbgrader.grade_id: cell.source for cell in source_of(name).cells}
    for cell in notebook.cells:
        if cell.metadata.nbgrader.solution:
            cell.source = answers[cell.metadata.nbgrader.grade_id]
    return nbformat.writes(notebook)


def wrong(name, text):
    """The release with a wrong answer in each problem."""
    notebook = nbformat.reads(text, as_version=4)
    for cell in notebook.cells:
        slug = cell.metadata.nbgrader.grade_id.removesuffix("-answer")
        if slug in TABLES[name]:
            code = TABLES[name][slug]["mistakes"][-1]["code"][-1]
            stub = cell.source.partition("    # YOUR CODE HERE")[0]
            cell.source = f"{TABLES[name]['helpers']}\n\n{stub}{indent(code.strip(), '    ')}"
    return nbformat.writes(notebook)


@pytest.fixture(scope="module")
def course(tmp_path_factory):
    """A course in which all sets were graded: solved and untouched, the first one wrong too."""
    folder = tmp_path_factory.mktemp("course")
    shutil.copytree(ASSIGNMENTS / "source", folder / "source")
    shutil.copy(ASSIGNMENTS / "nbgrader_config.py", folder)
    for name in SETS:
        given = release(name, folder)[f"{name}.ipynb"].decode()
        handed_in = {"solved": solved(name, given), "untouched": given}
        if name == SETS[0]:
            handed_in["wrong"] = wrong(name, given)
        for student, text in handed_in.items():
            path = folder / "submitted" / student / name / f"{name}.ipynb"
            path.parent.mkdir(parents=True)
            path.write_text(text, encoding="utf-8")
    grade_all([], folder)
    return folder


def row(course, name, student):
    with (course / f"{name}-grades.csv").open(encoding="utf-8-sig", newline="") as table:
        return next(row for row in csv.DictReader(table) if row["student"] == student)


def page(course, name, student):
    text = (course / "feedback" / student / name / f"{name}.html").read_text("utf-8")
    return html.unescape(re.sub(r"<[^>]*>", "", text.split("<body>", 1)[1]))


@pytest.mark.parametrize("name", SETS)
def test_the_reference_gets_all_points(course, name):
    tests, words = kinds(name)
    found = row(course, name, "solved")
    assert {key: float(found[key]) for key in tests} == tests
    assert found["by hand"].split() == list(words)
    assert float(found["maximum"]) == sum(tests.values()) + sum(words.values())
    assert found["remarks"] == ""


@pytest.mark.parametrize("name", SETS)
def test_the_untouched_release_gets_none_and_no_work_for_a_human(course, name):
    found = row(course, name, "untouched")
    assert float(found["total"]) == float(found["automatic"]) == 0
    assert (found["by hand"], found["remarks"]) == ("", "")


def test_wrong_answers_get_none_and_their_hints(course):
    """Of the other sets, test_problems.py sees that their tests fail, and how."""
    name = SETS[0]
    found = row(course, name, "wrong")
    assert {found[key] for key in kinds(name)[0]} == {"0"}
    text = " ".join(page(course, name, "wrong").split())
    for slug, table in TABLES[name].items():
        if slug != "helpers":
            assert table["mistakes"][-1]["hint"][:40] in text


@pytest.mark.parametrize("name", SETS)
def test_with_the_words_graded_the_reference_has_the_maximum(course, name):
    with Gradebook(f"sqlite:///{course / 'gradebook.db'}") as gradebook:
        for key, points in kinds(name)[1].items():
            gradebook.find_grade(key, name, name, "solved").manual_score = points
        submission = gradebook.find_submission(name, "solved")
        assert submission.score == submission.max_score == 20
        gradebook.db.rollback()


@pytest.mark.parametrize("name", SETS)
def test_the_release_is_what_nbgrader_makes_with_its_gradebook(course, name):
    made = (course / "release" / name / f"{name}.ipynb").read_bytes()
    assert made == release(name, course)[f"{name}.ipynb"]


@pytest.mark.parametrize("name", SETS)
def test_feedback_shows_no_hidden_test_and_no_mark_scheme(course, name):
    secrets = [re.sub(r"\s", "", line) for line in hidden_lines(name)]
    assert len(secrets) > 20
    for folder in (course / "feedback").glob(f"*/{name}"):
        student = folder.parent.name
        if student == "solved":  # its own answers are the secrets
            continue
        text = re.sub(r"\s", "", page(course, name, student))
        assert not [line for line in secrets if line in text]


def files_in(content, place=""):
    """Every file of a zip, and of the zips and wheels in it."""
    with ZipFile(io.BytesIO(content)) as archive:
        for name in archive.namelist():
            inner = archive.read(name)
            if name.endswith((".zip", ".whl")):
                yield from files_in(inner, f"{place}{name}/")
            else:
                yield f"{place}{name}", inner.decode("utf-8", "replace")


@pytest.fixture(scope="module")
def handouts(tmp_path_factory):
    folder = tmp_path_factory.mktemp("handouts")
    shutil.copytree(ASSIGNMENTS / "source", folder / "source")
    return {name: make_handout(name, folder, ROOT).read_bytes() for name in SETS}


@pytest.mark.parametrize("name", SETS)
def test_no_file_of_a_handout_gives_anything_away(handouts, name):
    files = dict(files_in(handouts[name]))
    assert any("whl/rbclassroom/assignments/marking.py" in path for path in files)
    notebook = source_of(name)
    for line in hidden_lines(name):
        assert not [path for path, text in files.items() if line in text], line
    shown = [text for path, text in files.items() if ".whl/" not in path]
    for line in hidden_lines(name, "HIDDEN TESTS|MARK SCHEME|SOLUTION"):
        assert not [text for text in shown if line in text], line
    packed = "\n".join(files.values())
    region = re.compile(r"### BEGIN SOLUTION\n(.*?) *### END", re.DOTALL)
    secrets = [text for cell in notebook.cells for text in region.findall(cell.source)]
    tables = [table for slug, table in TABLES[name].items() if slug != "helpers"]
    secrets += [code for table in tables for m in table["mistakes"] for code in m["code"]]
    for secret in secrets:
        encoded = base64.b64encode(secret.encode()).decode().rstrip("=")[:-4]
        hidden = [secret, secret[::-1], encoded]
        assert not [text for text in hidden if len(text) > 40 and text in packed]
