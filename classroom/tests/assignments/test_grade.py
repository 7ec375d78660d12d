"""A class full of submissions is graded in one go, and none of them harms another."""

import os
import re
import shutil
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from textwrap import dedent

import nbformat
import pytest
from nbformat.v4 import new_code_cell, new_notebook
from tiny_class import Class, cell, make_template
from tiny_set import ANSWERS, write_tiny_set
from traitlets.config import Config

from rbclassroom.assignments import grade as grading
from rbclassroom.assignments import sandbox
from rbclassroom.assignments.autograding import configure
from rbclassroom.assignments.grade import grade, grade_all
from rbclassroom.assignments.handout import read_config
from rbclassroom.assignments.restore import Refused
from rbclassroom.assignments.writing import write_csv

ROOT = Path(__file__).parents[3]
HIDDEN = ["square(-3)==9", "isclose(half,0.5)"]
MEMORY = 700_000_000


@pytest.fixture(scope="module")
def template(tmp_path_factory):
    return make_template(tmp_path_factory.mktemp("template"))


def rewrite_tests(notebook):
    for name in ("square-test", "half-test"):
        found = cell(notebook, name)
        found.source = "pass"
        found.metadata.nbgrader.points = 100
        found.metadata.tags = ["skip-execution"]
    cell(notebook, "half-test").metadata.nbgrader.grade = False
    cell(notebook, "half-test").cell_type = "raw"
    del cell(notebook, "half-test")["outputs"], cell(notebook, "half-test")["execution_count"]
    cell(notebook, "half-answer").metadata.nbgrader.solution = False


def delete_and_copy(notebook):
    copied = nbformat.from_dict(cell(notebook, "square-answer"))
    gone = {"square-test", "half-answer", "imports"}
    notebook.cells = [
        c for c in notebook.cells if c.metadata.get("nbgrader", {}).get("grade_id") not in gone
    ]
    notebook.cells.append(copied)


def strip_metadata(notebook):
    for found in notebook.cells:
        found.metadata = {}


NOSY = """
import linecache, os
def square(x):
    cells = "".join("".join(entry[2]) for entry in list(linecache.cache.values()))
    with open("seen.txt", "a") as file:
        print(x, cells, file=file)
    print(cells, x)
    raise AssertionError(cells)
### BEGIN HIDDEN TESTS
print(os.path.exists("ps0.ipynb"), os.path.exists("seen.txt") and open("seen.txt").read())
"""
LOUD = """
import sys
from IPython.display import HTML, display
display(HTML("<p>" * 10**7))
try:
    BEGIN
    while True:  # endless
        print("on and on" * 1000, file=sys.stderr)
finally:
    half = 0.5
"""


def hand_in_all(course):
    with course.gradebook() as gradebook:
        gradebook.update_or_create_assignment("ps0", duedate="2026-01-01 00:00:00")
    warned = "import warnings\ndef square(x):\n    warnings.warn('old')\n    return x * x"
    course.submit("good one", square=warned)
    stamp = course.folder / "submitted" / "good one" / "ps0" / "timestamp.txt"
    stamp.write_text("2026-01-01 01:30:00 UTC")
    course.submit("rewrites", rewrite_tests, square="square = None", half="half = 3")
    course.submit("deletes", delete_and_copy)
    course.submit("replaces", square="\nimport math\nmath.isclose = lambda *a, **k: True")
    course.submit("renames", square="def quadrat(x):\n    return x * x", half="half = = 1")
    course.submit(
        "half right", square="def square(x):\n    return 2 * x", half="import sys\nsys.exit()"
    )
    course.submit(
        "endless",
        square=f"{course.begin}\nwhile True: pass  # endless",
        half="half = 0.5\n'x' * 10**9",
    )
    course.submit(
        "loud",
        half=LOUD.replace("BEGIN", course.begin),
        square=ANSWERS["square-answer"] + "\nprint('x' * 10**9)",
    )
    course.submit("dies", half="import os\nos._exit(1)")
    course.submit("nosy", square=NOSY)
    course.submit("stripped", strip_metadata)
    course.submit_bytes("pdf", b"%PDF-1.7 \xff")
    course.submit_bytes("broken", b'{"cells": [')
    course.submit_bytes("empty", b"")
    course.submit_bytes(
        "other set", nbformat.writes(new_notebook(cells=[new_code_cell()])).encode()
    )
    course.submit_bytes("wrong name", course.given, "PS0.ipynb")


@pytest.fixture(scope="module")
def course(tmp_path_factory, template):
    """All of them graded at once."""
    course = Class(tmp_path_factory.mktemp("a course"), template)
    hand_in_all(course)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(grading, "MEMORY", MEMORY)
        grade("ps0", course.folder)
    return course


@pytest.fixture(scope="module")
def rows(course):
    return course.rows()


@pytest.mark.parametrize(
    ("student", "square", "half", "remarks"),
    [
        ("good one", "2", "1", []),
        ("rewrites", "0", "0", ["cell 4, test of “A tiny set” was changed", "and 2 more changes"]),
        ("deletes", "2", "0", ["cell 2, answer of “A tiny set”: is there again", "4 more changes"]),
        ("renames", "0", "0", []),
        ("half right", "0", "0", []),
        ("endless", "0", "1", ["cell 3, answer of “A tiny set”: stopped after 1 s", "cell 5, "]),
        ("loud", "2", "1", ["cell 3, answer", "cell 5, answer of “A tiny set”: stopped after"]),
        ("nosy", "0", "1", []),
    ],
)
def test_points_and_remarks(rows, student, square, half, remarks):
    row = rows[student]
    assert (row["square-test"], row["half-test"]) == (square, half), row
    assert row["automatic"] == row["total"] == str(int(square) + int(half))
    assert row["maximum"] == "6"
    assert row["by hand"] == "words-answer"
    for remark in remarks:
        assert remark in row["remarks"]
    assert "refused" not in row["remarks"]
    if not remarks:
        assert row["remarks"] == ""


@pytest.mark.parametrize(
    ("student", "why"),
    [
        ("replaces", "cell 3, answer of “A tiny set”, line 3 replaces math.isclose: grade by hand"),
        ("dies", "Python ended in or before cell 5, answer of “A tiny set”, or 600 s were over"),
        ("stripped", "the cells are not those of this problem set"),
        ("other set", "the cells are not those of this problem set"),
        ("pdf", "ps0.ipynb is no notebook, but a PDF or an archive; hand in the notebook"),
        ("broken", "ps0.ipynb is damaged or no notebook ("),
        ("empty", "ps0.ipynb is empty"),
        ("wrong name", "there is no ps0.ipynb, but PS0.ipynb"),
    ],
)
def test_what_is_refused_is_told_why(course, rows, student, why):
    assert rows[student]["remarks"].startswith(f"refused: {why}")
    assert rows[student]["total"] == ""
    assert not course.graded(student).exists()


def test_tests_are_as_they_were_given(course):
    for student in ("rewrites", "deletes"):
        notebook = nbformat.read(course.graded(student), as_version=4)
        assert "BEGIN HIDDEN TESTS" in cell(notebook, "square-test").source
        assert cell(notebook, "half-test").metadata.nbgrader.points == 1
        assert cell(notebook, "half-test").cell_type == "code"


def test_files_stay_small(course):
    for student in ("endless", "loud"):
        assert course.graded(student).stat().st_size < 500_000


def test_feedback_shows_points_and_no_hidden_tests(course):
    for path in (course.folder / "feedback").glob("*/ps0/ps0.html"):
        text = re.sub(r"\s", "", course.feedback(path.parents[1].name))
        assert not [line for line in HIDDEN if line in text], path
        assert "Likesigns" not in text
        assert "(Score:" in text
    assert "ps0 (Score: 3.0 / 6.0)" in course.feedback("good one")
    nosy = course.feedback("nosy")
    assert "False False" in nosy


def test_feedback_says_where_unseen_tests_fail(course):
    unseen = "others, which are not shown, fail"
    assert unseen in course.feedback("half right")
    assert unseen not in course.feedback("good one")


def test_feedback_of_an_endless_loop_says_so_and_shows_nothing_of_the_tests(course):
    page = course.feedback("endless")
    assert "This cell took longer than 1 s and was stopped." in page
    assert "KeyboardInterrupt" not in page
    assert "marking.py" not in page


def test_the_list_on_a_page_of_feedback_names_the_problems(course):
    page = (course.folder / "feedback" / "good one" / "ps0" / "ps0.html").read_text("utf-8")
    listed = re.findall(r'<li><a href="#[^"]+">([^<]*)</a> \(Score', page)
    assert listed == ["A tiny set, tests", "A tiny set, tests", "A tiny set, in words"]


def test_files_that_were_not_collected_have_a_line_in_the_table(tmp_path, template):
    course = Class(tmp_path, template)
    course.submit("ann")
    lines = [
        ("refused", "Bob_1_assignsubmission_file_/ps0.ipynb", "it is empty"),
        ("refused", "Eve_2_assignsubmission_file_/work.zip", "File is not a zip file"),
        ("unmatched", "Dan_3_assignsubmission_file_/ps1.ipynb", "its cells are of no set"),
        ("missing", "cid, ps0", "Cid Cole"),
        ("missing", "ann, ps0", "Ann Ames"),
        ("missing", "cid, ps1", "Cid Cole"),
    ]
    (tmp_path / "source" / "ps1").mkdir()
    keys = "list", "what", "why"
    rows = [dict(zip(keys, line, strict=True)) for line in lines]
    write_csv(tmp_path / "submitted" / "report.csv", rows)
    grade("ps0", tmp_path)
    remarks = {student: row["remarks"] for student, row in course.rows().items()}
    assert remarks == {
        "ann": "",
        lines[0][1]: "not collected: it is empty",
        lines[1][1]: "not collected: File is not a zip file",
        "cid": "nothing was collected",
    }


def test_grading_again_keeps_what_a_human_gave(tmp_path, template):
    course = Class(tmp_path, template)
    students = ("ann", "bob", "eve")
    for student in students:
        course.submit(student)
    assert [path.name for path in grade_all([], tmp_path)] == ["ps0-grades.csv"]
    with course.gradebook() as gradebook:
        for student in students:
            gradebook.find_grade("words-answer", "ps0", "ps0", student).manual_score = 2.5
            comment = gradebook.find_comment("words-answer", "ps0", "ps0", student)
            comment.manual_comment = "Well put."
        gradebook.db.commit()
    course.submit("bob", words="It is not.")
    course.submit_bytes("eve", b"")
    grade("ps0", tmp_path)
    row = course.rows()["ann"]
    assert (row["words-answer"], row["automatic"], row["total"]) == ("2.5", "3", "5.5")
    assert row["by hand"] == row["remarks"] == ""
    assert "Well put." in course.feedback("ann")
    assert "Score: 5.5 / 6.0" in course.feedback("ann")
    changed = "words-answer is another answer than when it was graded before"
    assert course.rows()["bob"]["remarks"] == changed
    assert course.rows()["eve"]["remarks"].startswith("refused: ps0.ipynb is empty")
    with course.gradebook() as gradebook:
        assert gradebook.find_submission("ps0", "eve").score == 2.5


def test_late_is_told_in_hours(rows):
    assert rows["good one"]["late"] == "1.5 h"
    assert rows["nosy"]["late"] == ""


def test_a_gradebook_is_made_also_where_the_environment_is_not_activated(monkeypatch):
    """nbgrader calls alembic by its name."""
    monkeypatch.setenv("PATH", os.defpath)
    configure(Config())
    assert Path(shutil.which("alembic")).parent == Path(sys.executable).parent


def test_a_set_without_submissions_and_an_unknown_one_are_told(tmp_path):
    write_tiny_set(tmp_path)
    with pytest.raises(ValueError, match="There is no submission of ps0"):
        grade("ps0", tmp_path)
    with pytest.raises(ValueError, match="no problem set ps7; there are: ps0"):
        grade_all(["ps7"], tmp_path)
    with pytest.raises(ValueError, match="There are no submissions"):
        grade_all([], tmp_path)


def test_a_cell_that_cannot_be_stopped_is_refused(tmp_path, template):
    """Here the test cell, which calls what never ends."""
    course = Class(tmp_path, template)
    with (tmp_path / "nbgrader_config.py").open("a") as config:
        config.write("c.Execute.iopub_timeout = 5\nENDLESS = 'square(2) == 4'\n")
    stubborn = f"""
        def square(x):
            import signal
            signal.signal(signal.SIGINT, signal.SIG_IGN)
            {course.begin}
            while True:
                pass
    """
    course.submit("ann", square=dedent(stubborn))
    grade("ps0", tmp_path)
    why = "cell 4, test of “A tiny set” cannot be stopped"
    assert course.rows()["ann"]["remarks"] == f"refused: {why}"


def test_the_commands_of_nbgrader_are_set_in_the_same_way():
    """All that grading needs is in the configuration that nbgrader's own commands read."""
    wanted = Config()
    configure(wanted)
    assert read_config(ROOT / "notebooks" / "assignments") == wanted


class Killed(ProcessPoolExecutor):
    """A worker that is killed when it begins with a student."""

    def submit(self, work, name, folder, student, boxed):
        if student == "bob":
            work, name = os._exit, 1
            return super().submit(work, name)
        return super().submit(work, name, folder, student, boxed)


def test_a_worker_that_dies_is_told_and_the_others_are_graded(tmp_path, template, monkeypatch):
    course = Class(tmp_path, template)
    for student in ("ann", "bob", "cyd", "dan"):
        course.submit(student)
    monkeypatch.setattr(grading, "ProcessPoolExecutor", Killed)
    grade("ps0", tmp_path)
    rows = course.rows()
    assert rows["bob"]["remarks"] == "refused: its process ended, or took too long"
    assert [rows[student]["total"] for student in ("ann", "cyd", "dan")] == ["3", "3", "3"]


def test_nothing_runs_on_without_a_box_that_was_there(tmp_path, template, monkeypatch):
    monkeypatch.setattr(sandbox, "missing", lambda: "it failed")
    course = Class(tmp_path, template)
    course.submit("ann")
    with pytest.raises(Refused, match="there is no box any more: it failed"):
        grading.grade_one("ps0", tmp_path, "ann", boxed=True)
