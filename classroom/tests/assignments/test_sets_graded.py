"""Hand out, hand in and grade the problem sets, as students and teachers do."""

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
from test_problems import SETS, SOURCE, TABLES

from rbclassroom.assignments.grade import grade
from rbclassroom.assignments.handout import make_handout, release
from rbclassroom.assignments.marking import EMPTY

FIRST, LATER = "ps1", "ps4"  # the later set uses functions of earlier sets
PROBLEMS = [slug for slug, table in TABLES[FIRST].items() if isinstance(table, dict)][1:]
UNSEEN = "HIDDEN TESTS|MARK SCHEME"


def regions(name, kinds):
    """Return the hidden lines of a set, except short lines and lines that are also visible."""
    text = "\n".join(cell.source for cell in SETS[name].cells)
    inside = re.findall(rf"BEGIN (?:{kinds})(.*?)END (?:{kinds})", text, re.DOTALL)
    outside = re.sub(r"(?s)BEGIN [A-Z]+.*?END [A-Z]+", "", text)
    lines = {line.strip() for line in "\n".join(inside).splitlines()}
    lines -= {line.strip() for line in outside.splitlines()}
    return [ln for ln in lines if len(ln) >= 12 and not re.match("(import|from|raise|#+) ", ln)]


def points(name):
    """Return two dicts of points: for cells with tests, and for written answers."""
    marks = [cell.metadata.nbgrader for cell in SETS[name].cells]
    graded = {mark.grade_id: mark.points for mark in marks if mark.grade}
    tests = {key: value for key, value in graded.items() if key.endswith("-test")}
    return tests, {key: value for key, value in graded.items() if key not in tests}


def wrong(grade_id, source):
    """Return a wrong answer to a problem of the first set; one problem and the words stay empty."""
    slug, table = grade_id.removesuffix("-answer"), TABLES[FIRST]
    if slug not in PROBLEMS:
        return source
    stub = source.partition("    # YOUR CODE HERE")[0]
    code = table[slug]["mistakes"][-1]["code"][-1]
    return f"{table['helpers']}\n\n{stub}{indent(code.strip(), '    ')}"


@pytest.fixture(scope="module")
def course(tmp_path_factory):
    """Return a course with two graded sets: wrong and empty answers, and the reference."""
    folder = tmp_path_factory.mktemp("course")
    shutil.copytree(SOURCE, folder / "source")
    shutil.copy(SOURCE.parent / "nbgrader_config.py", folder)
    model = {c.metadata.nbgrader.grade_id: c.source for c in SETS[LATER].cells}
    for name, answer in ((FIRST, wrong), (LATER, lambda key, source: model[key])):
        notebook = nbformat.reads(release(name, folder)[f"{name}.ipynb"].decode(), as_version=4)
        for cell in notebook.cells:
            if cell.metadata.nbgrader.solution:
                cell.source = answer(cell.metadata.nbgrader.grade_id, cell.source)
        path = folder / "submitted" / "ann" / name / f"{name}.ipynb"
        path.parent.mkdir(parents=True)
        nbformat.write(notebook, path)
    grade([], folder, without_box=True)
    return folder


def row(course, name):
    with (course / f"{name}-grades.csv").open(encoding="utf-8-sig", newline="") as table:
        return next(csv.DictReader(table))


def test_the_reference_gets_all_points(course):
    """For the other sets, test_problems.py checks that the reference passes."""
    name, (tests, words) = LATER, points(LATER)
    found = row(course, name)
    assert {key: float(found[key]) for key in tests} == tests
    assert found["by hand"].split() == list(words)
    assert found["remarks"] == ""
    with Gradebook(f"sqlite:///{course / 'gradebook.db'}") as gradebook:
        for key, value in words.items():
            gradebook.find_grade(key, name, name, "ann").manual_score = value
        submission = gradebook.find_submission(name, "ann")
        assert submission.score == submission.max_score == float(found["maximum"]) == 20
        gradebook.db.rollback()
    made = (course / "release" / name / f"{name}.ipynb").read_bytes()
    assert made == release(name, course)[f"{name}.ipynb"]


def test_wrong_answers_get_hints_but_no_points(course):
    """For the other sets, test_problems.py checks the hints."""
    found = row(course, FIRST)
    assert {found[key] for key in (*points(FIRST)[0], "automatic", "total")} == {"0"}
    assert (found["by hand"], found["remarks"]) == ("", "")
    text = (course / "feedback" / "ann" / FIRST / f"{FIRST}.html").read_text("utf-8")
    page = re.sub(r"\s", "", html.unescape(re.sub(r"<[^>]*>", "", text.split("<body>", 1)[1])))
    unseen = [re.sub(r"\s", "", line) for line in regions(FIRST, UNSEEN)]
    assert len(unseen) > 20
    assert not [line for line in unseen if line in page]
    hints = [TABLES[FIRST][slug]["mistakes"][-1]["hint"] for slug in PROBLEMS]
    hints.append(EMPTY)
    assert all(re.sub(r"\s", "", hint[:40]) in page for hint in hints)


def files_in(content, place=""):
    """Yield every file in a zip, and in the zips and wheels inside it."""
    with ZipFile(io.BytesIO(content)) as archive:
        for name in archive.namelist():
            inner = archive.read(name)
            if name.endswith((".zip", ".whl")):
                yield from files_in(inner, f"{place}{name}/")
            else:
                yield f"{place}{name}", inner.decode("utf-8", "replace")


@pytest.fixture(scope="module")
def handed_out(course):
    """Return the files of the handout of the first set."""
    return dict(files_in(make_handout(FIRST, course, SOURCE.parents[2]).read_bytes()))


@pytest.mark.parametrize("name", SETS)
def test_no_file_of_a_handout_reveals_solutions_or_hidden_tests(course, handed_out, name):
    """The release of each set is tested, too.

    Written answers that were left blank need no manual grading.
    """
    own = {path: content.decode() for path, content in release(name, course).items()}
    files = {**handed_out, **own}
    assert any("whl/rbclassroom/assignments/marking.py" in path for path in files)
    shown = {path: text for path, text in files.items() if ".whl/" not in path}
    for kinds, some in ((UNSEEN, files), (f"{UNSEEN}|SOLUTION", shown)):
        for line in regions(name, kinds):
            assert not [path for path in some if line in some[path]], line
    packed = "\n".join(files.values())
    region = re.compile(r"### BEGIN SOLUTION\n(.*?) *### END", re.DOTALL)
    secrets = [text for cell in SETS[name].cells for text in region.findall(cell.source)]
    tables = [table for table in TABLES[name].values() if isinstance(table, dict)]
    secrets += [code for table in tables for m in table["mistakes"] for code in m["code"]]
    secrets = [text for text in secrets if len(text) > 40]
    library = "\n".join(text for path, text in files.items() if "/rbcourse/" in path)
    long = [line for line in regions(name, "SOLUTION") if len(line) >= 30]
    secrets += [line for line in long if line not in library]
    for secret in secrets:
        encoded = base64.b64encode(secret.encode()).decode()[4:-4]
        assert not [text for text in (secret, secret[::-1], encoded) if text in packed]
    cells = nbformat.reads(own[f"{name}.ipynb"], as_version=4).cells
    graded = {cell.metadata.nbgrader.grade_id: cell for cell in cells}
    for key, value in points(name)[1].items():
        assert determine_grade(graded[key]) == (0, value)
