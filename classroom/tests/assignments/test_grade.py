"""A class of submissions is graded in one run, and no submission affects another."""

import csv
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from concurrent.futures import Future, ProcessPoolExecutor
from glob import glob
from pathlib import Path
from zipfile import ZipFile

import nbformat
import psutil
import pytest
from tiny_class import Class, begun
from tiny_set import cell, write_tiny_set
from traitlets.config import Config

from rbclassroom.assignments import grade as grading
from rbclassroom.assignments import sandbox
from rbclassroom.assignments.__main__ import main
from rbclassroom.assignments.autograding import configure
from rbclassroom.assignments.collect import write_csv
from rbclassroom.assignments.feedback import page_markdown
from rbclassroom.assignments.grade import _graded_by_hand, grade, grade_one
from rbclassroom.assignments.handout import read_config
from rbclassroom.assignments.submissions import Refused

ROOT = Path(__file__).parents[3]
HIDDEN = ["square(-3)==9", "isclose(half,0.5)", "Likesigns"]


def tamper(notebook):
    test, answer = cell(notebook, "half-test"), cell(notebook, "square-answer")
    test.source, test.cell_type, test.metadata.tags = "pass", "raw", ["skip-execution"]
    test.metadata.nbgrader.update(points=100, grade=False)
    del test["outputs"], test["execution_count"]
    cell(notebook, "half-answer").metadata.nbgrader.solution = False
    copied, answer.source = nbformat.from_dict(dict(answer)), "square = None"
    for name in ("square-test", "imports"):
        notebook.cells.remove(cell(notebook, name))
    notebook.cells.append(copied)


WARNS = "import warnings\ndef square(x):\n    warnings.warn('old')\n    return x * x"
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
# This answer exceeds the limit on output before its time limit begins, and then prints slowly.
# Without the pause, fast machines would fill the memory before the time is over.
LOUD = f"""
import sys, time
from IPython.display import HTML, display
display(HTML("<p>" * 10**6))
print("on and on\\n" * 20_000, file=sys.stderr)
try:
    {begun()}
    while True:
        print("on and on", file=sys.stderr)
        time.sleep(0.001)
finally:
    half = 0.5
"""
STUCK = f"""
import signal
signal.signal(signal.SIGINT, signal.SIG_IGN)
{begun()}
while True:
    pass
"""
LOOP, DOUBLE = f"{begun()}\nwhile True: pass", "def square(x):\n    return 2 * x"
HUGE, DIES = "x = bytearray(2 * 10**9)\nhalf = square(0.5)", "import os\nos._exit(1)"
SQUARE, HALF = "cell 3, answer of “A tiny set”", "cell 5, answer of “A tiny set”"
# Each row has a student, a change, answers, points (none if refused), and parts of the remarks.
CLASS = [
    ("good one", None, {"square": WARNS}, "2 1", []),
    (
        "tampers",
        tamper,
        {"half": "half = squar(3)"},
        "2 0",
        ["is a copy; another one counts", "more", "“A tiny set”: shows NameError"],
    ),
    ("half right", None, {"square": DOUBLE, "half": HUGE}, "0 0", [f"{HALF}: takes too much"]),
    ("endless", None, {"square": LOOP, "half": LOUD}, "0 1", [f"{SQUARE}: stopped", f"{HALF}: st"]),
    ("nosy", None, {"square": NOSY}, "0 1", []),
    ("dies", None, {"half": DIES}, " ", [f"Python ended in or before {HALF}; grade by hand"]),
]
FILES = [
    ("pdf", "ps0.ipynb", b"%PDF-1.7 \xff", "ps0.ipynb is a PDF or an archive, not a notebook"),
    ("wrong name", "PS0.ipynb", b"{}", "the file ps0.ipynb is wanted, got PS0.ipynb"),
]


@pytest.fixture(scope="module")
def course(tmp_path_factory, template):
    """Return a course whose submissions were graded in one run."""
    course = Class(tmp_path_factory.mktemp("a course"), template)
    with course.gradebook() as gradebook:
        gradebook.update_or_create_assignment("ps0", duedate="2026-01-01 00:00:00")
    for student, change, answers, *_ in CLASS:
        course.submit(student, change, **answers)
    course.submit_bytes("good one", b"2026-01-01 01:30:00 UTC", "timestamp.txt")
    for student, name, content, _ in FILES:
        course.submit_bytes(student, content, name)
    assert grade([], course.folder, without_box=True) == [course.folder / "ps0-grades.csv"]
    return course


@pytest.mark.parametrize(
    ("student", "points", "remarks"),
    [(student, *wanted) for student, _, _, *wanted in CLASS]
    + [(student, " ", [why]) for student, _, _, why in FILES],
)
def test_each_submission_gets_the_expected_points_and_remarks(course, student, points, remarks):
    row = course.rows()[student]
    assert f"{row['square-test']} {row['half-test']}" == points, row
    assert all(remark in row["remarks"] for remark in remarks), row
    assert bool(remarks) == bool(row["remarks"])
    assert row["remarks"].startswith("refused: ") == (points == " ")
    assert course.graded(student).exists() == (points != " ")
    if points == " ":
        assert row["total"] == ""
    else:
        assert row["automatic"] == row["total"] == str(sum(map(int, points.split())))
        assert (row["maximum"], row["by hand"]) == ("6", "words-answer")
        assert row["late"] == ("1.5 h" if student == "good one" else "")


def test_changed_tests_are_restored_before_grading(course):
    notebook = nbformat.read(course.graded("tampers"), as_version=4)
    assert "BEGIN HIDDEN TESTS" in cell(notebook, "square-test").source
    assert cell(notebook, "half-test").metadata.nbgrader.points == 1
    assert cell(notebook, "half-test").cell_type == "code"


def test_feedback_shows_no_hidden_tests(course):
    for path in (course.folder / "feedback").glob("*/ps0/ps0.html"):
        text = re.sub(r"\s", "", course.feedback(path.parents[1].name))
        assert not [line for line in HIDDEN if line in text], path
    assert "False False" in course.feedback("nosy")
    unseen = "but a hidden test fails"
    assert unseen in course.feedback("half right")
    assert unseen not in course.feedback("good one")
    endless = course.feedback("endless")
    assert "This cell took longer than 1 s and was stopped." in endless
    assert "KeyboardInterrupt" not in endless
    assert "marking.py" not in endless
    assert course.graded("endless").stat().st_size < 500_000
    assert f"{HALF}: the output is too large" in course.rows()["endless"]["remarks"]


def test_a_page_of_feedback_begins_with_the_right_answers(course):
    said = [line for line in course.feedback("good one").splitlines() if line.strip()]
    assert [line.strip() for line in said[: said.index("Your notebook")]] == [
        "A tiny set",
        "3 of 6 points so far.",
        "Your lecturer still grades answers in words, for 3 more points.",
        "Right",
        "A tiny set: 2 of 2",
        "A tiny set: 1 of 1",
        "In words",
        "A tiny set: not graded yet",
    ]
    said = " ".join(course.feedback("nosy").split("Your notebook")[0].split())
    assert "Right A tiny set: 1 of 1 Look at these again A tiny set: 0 of 2 AssertionError" in said
    said = " ".join(course.feedback("half right").split("Your notebook")[0].split())
    assert "Right" not in said
    assert re.search("A tiny set: 0 of 1 MemoryError.{,20} It calls square, which is not", said)
    assert "Your file cell 5, answer of “A tiny set”: takes too much memory" in said


class Killed(ProcessPoolExecutor):
    """A pool of workers in which one student's worker is killed when it starts."""

    def submit(self, work, name, student, *further):
        if student == "half right":
            return super().submit(os._exit, 1)
        return super().submit(work, name, student, *further)


LISTED = [
    ("refused", "Bob_1_assignsubmission_file_/ps0.ipynb", "it is empty"),
    ("unmatched", "Eve_2_assignsubmission_file_/work.ipynb", "it is not a notebook of a handout"),
    ("unmatched", "Dan_3_assignsubmission_file_/ps1.ipynb", "it is not a notebook of a handout"),
    ("nothing usable", "Fay 4", "F_4_assignsubmission_file_/a.pdf: it is neither a notebook nor"),
    ("nothing usable", "Gus 5", "G_5_assignsubmission_file_/ps0.ipynb: it is empty"),
    ("refused", "G_5_assignsubmission_file_/ps0.ipynb", "it is empty"),
    ("nothing usable", "ivo", "I_8_assignsubmission_file_/a.pdf: it is neither a notebook nor"),
    ("missing", "ivo, ps0", "Ivo Ist"),
    ("nothing usable", "Hal 6", "H_6_assignsubmission_file_/ps1.ipynb: it is empty"),
    ("missing", "cid, ps0", "Cid Cole"),
    ("missing", "tampers, ps0", "Ann Ames"),
    ("missing", "cid, ps1", "Cid Cole"),
    ("late", "tampers, ps0", "perhaps: 2026-05-01 12:00:00 UTC may be the date of the download"),
    ("late", "good one, ps0", "perhaps: 2026-05-01 12:00:00 UTC may be the date of the download"),
    ("late", "half right, ps0", "Canvas marks it as late"),
]


@pytest.fixture(scope="module")
def again(tmp_path_factory, course):
    """Grade the class again after manual grading; one answer was changed, and one file is empty.

    A worker is killed, and a cell cannot be stopped.
    """
    again = Class(tmp_path_factory.mktemp("again"), (course.folder, course.given))
    for student in course.rows().keys() - {"good one", "half right", "tampers", "nosy"}:
        shutil.rmtree(again.folder / "submitted" / student)
    with again.gradebook() as gradebook:
        for student in ("good one", "tampers", "nosy"):
            gradebook.find_grade("words-answer", "ps0", "ps0", student).manual_score = 2.5
            comment = gradebook.find_comment("words-answer", "ps0", "ps0", student)
            comment.manual_comment = "Well put."
        gradebook.db.commit()
    again.submit("tampers", words="It is not.")
    again.submit_bytes("nosy", b"")
    again.submit("stuck", half=STUCK)
    with (again.folder / "nbgrader_config.py").open("a") as config:
        config.write("c.Execute.iopub_timeout = 1\n")
    (again.folder / "source" / "ps1").mkdir()
    rows = [dict(zip(("list", "what", "why"), line, strict=True)) for line in LISTED]
    write_csv(again.folder / "submitted" / "report.csv", rows)
    owners = {"tampers/ps0": ["4711", "Ann Ames"], "stuck/ps0": ["12", "Sam"]}
    (again.folder / "submitted" / "owners.json").write_text(json.dumps(owners))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(grading, "ProcessPoolExecutor", Killed)
        grade(["ps0"], again.folder, without_box=True)
    return again


@pytest.mark.parametrize(
    ("who", "said"),
    [
        ("nosy", "nosy has 5[0-9] of 6 points"),
        ("tampers", "The points of tampers changed during the grading of nosy"),
    ],
)
def test_points_written_by_a_submission_are_detected(tmp_path, course, monkeypatch, who, said):
    """A submission gives itself points above the maximum, or changes another student's points."""
    harmed = Class(tmp_path, (course.folder, course.given))
    for student in course.rows().keys() - {"nosy"}:
        shutil.rmtree(harmed.folder / "submitted" / student)

    class Cheating(ProcessPoolExecutor):
        def submit(self, *work):
            with harmed.gradebook() as gradebook:
                gradebook.find_grade("half-test", "ps0", "ps0", who).manual_score = 56
                gradebook.db.commit()
            done = Future()
            done.set_result([])
            return done

    monkeypatch.setattr(grading, "ProcessPoolExecutor", Cheating)
    with pytest.raises(ValueError, match=said):
        grade(["ps0"], harmed.folder, without_box=True)
    assert harmed.rows() == course.rows()  # this is the table of the first grading
    assert (harmed.folder / "gradebook.before-ps0.db").exists()


def test_grading_again_keeps_manual_scores_and_comments(again):
    rows = again.rows()
    row = rows["good one"]
    assert (row["words-answer"], row["automatic"], row["total"]) == ("2.5", "3", "5.5")
    assert row["by hand"] == row["remarks"] == ""
    assert (row["late"], rows["tampers"]["late"]) == ("1.5 h", "perhaps")
    assert rows["half right"]["late"] == "Canvas marks it as late"
    said = " ".join(again.feedback("good one").split())
    assert "A tiny set 5.5 of 6 points. Right" in said
    assert "In words A tiny set: 2.5 of 3 Your lecturer: Well put." in said
    assert "Look at these again" not in said
    assert rows["nosy"]["remarks"].startswith("refused: ps0.ipynb is empty")
    assert not again.graded("nosy").exists()
    assert not (again.folder / "feedback" / "nosy" / "ps0").exists()
    with again.gradebook() as gradebook:
        assert gradebook.find_submission("ps0", "nosy").score == 2.5


def test_only_points_given_by_a_person_count_as_graded_by_hand(again):
    found = {who: _graded_by_hand("ps0", who, again.folder) for who in ("tampers", "half right")}
    assert found == {"tampers": {"words-answer"}, "half right": set()}
    assert _graded_by_hand("ps0", "nobody", again.folder) == set()


@pytest.mark.parametrize(
    ("source", "shown"),
    [
        ("$x < y$", "<mi>x</mi><mo>&lt;</mo><mi>y</mi>"),
        (r"$$\text{<script>}$$", "<mtext>&lt;script&gt;</mtext>"),
        (r"$\href{javascript:f()}{x}$ $\style{position:fixed}{x}$", "<mi>x</mi>"),
        ("![a $x$ b](data:image/png;base64,AA)", 'alt="a formula b"'),
        ("&#xE000;5&#xE001; $x$", "<mi>x</mi>"),
        (r"$\frac{1$ <b>1</b>", "<b>1</b>"),
    ],
)
def test_formulas_become_mathml_that_does_nothing(source, shown):
    page = page_markdown({}, source)
    assert shown in page
    assert not re.search("<script|javascript|position", page)


def test_pages_are_packed_in_the_folders_of_a_download_from_moodle(again):
    with ZipFile(again.folder / "ps0-feedback.zip") as packed:
        (name,) = packed.namelist()  # the other student with a number was refused
        page = again.folder / "feedback" / "tampers" / "ps0" / "ps0.html"
        assert name == "Ann Ames_4711_assignsubmission_file_/ps0.html"
        assert packed.read(name) == page.read_bytes()


def test_the_table_lists_students_who_were_not_graded(again):
    remarks = {student: row["remarks"] for student, row in again.rows().items()}
    del remarks["good one"], remarks["nosy"]
    assert remarks == {
        "tampers": "the answer words-answer differs from the one that was graded before",
        "half right": "refused: its process ended, or took too long",
        "stuck": f"refused: {HALF} cannot be stopped",
        LISTED[0][1]: "not collected: it is empty",
        LISTED[1][1]: "not collected: it is not a notebook of a handout",
        "cid": "no file was collected",
        "Fay 4": f"nothing usable was handed in: {LISTED[3][2]}",
        "Gus 5": f"nothing usable was handed in: {LISTED[4][2]}",
        "ivo": f"nothing usable was handed in: {LISTED[6][2]}",
    }
    with (again.folder / "ps0-grades.csv").open(encoding="utf-8-sig") as table:
        lines = list(csv.reader(table))
    assert lines[0][:3] == ["student", "number", "name"]
    assert ["tampers", "4711", "Ann Ames"] in [line[:3] for line in lines]
    assert len(lines) == len(again.rows()) + 1


def test_alembic_is_found_without_an_activated_environment(monkeypatch):
    monkeypatch.setenv("PATH", os.defpath)
    configure(Config())
    assert Path(shutil.which("alembic")).parent == Path(sys.executable).parent


def test_unknown_sets_are_refused(tmp_path):
    write_tiny_set(tmp_path)
    with pytest.raises(ValueError, match="ps0: a submission in"):
        grade(["ps0"], tmp_path, without_box=True)
    with pytest.raises(ValueError, match=r"one of the problem sets is wanted \(ps0\), got ps7"):
        grade(["ps7"], tmp_path, without_box=True)
    with pytest.raises(ValueError, match="There are no submissions"):
        grade([], tmp_path)


def test_a_second_run_at_the_same_time_is_refused(tmp_path):
    """Otherwise points of the other run would be taken for forged ones."""
    write_tiny_set(tmp_path)
    with grading._alone(tmp_path), pytest.raises(ValueError, match=r"another grade is running"):
        grade(["ps0"], tmp_path, without_box=True)
    with pytest.raises(ValueError, match="ps0: a submission in"):
        grade(["ps0"], tmp_path, without_box=True)


def test_nbgrader_commands_use_the_same_configuration():
    wanted = Config()
    configure(wanted)
    assert read_config(ROOT / "notebooks" / "assignments") == wanted


FAILURES = {  # the last line of the output, and the reason
    "bwrap: No permissions": r"bubblewrap does not work here \(.*\); user namespaces",
    "No module named 'a'": r"the sandbox does not work here \(No module named 'a'\)(?!; user)",
}


@pytest.fixture(params=["no bubblewrap", *FAILURES])
def unboxed(request, tmp_path, monkeypatch):
    """Change the search path so that there is no sandbox; return the expected reason."""
    programs, path, why = tmp_path / "programs", os.environ["PATH"], r"bubblewrap is not installed "
    programs.mkdir()
    if request.param == "no bubblewrap":
        for name in ("sh", "chmod", "rm"):
            if os.name == "posix" and (there := shutil.which(name)):
                (programs / name).symlink_to(there)
        path = ""
    else:
        (programs / "bwrap").write_text(f'#!/bin/sh\necho "{request.param}" >&2\nexit 1\n')
        (programs / "bwrap").chmod(0o755)
        why = FAILURES[request.param]
    monkeypatch.setenv("PATH", f"{programs}{os.pathsep}{path}")
    sandbox.missing.cache_clear()
    yield why if sys.platform == "linux" else "it needs Linux"
    sandbox.missing.cache_clear()


def test_no_submission_runs_without_a_sandbox_unless_this_is_asked_for(
    tmp_path, template, unboxed, monkeypatch, capsys
):
    course, proof = Class(tmp_path / "notebooks" / "assignments", template), tmp_path / "proof"
    course.submit("ann", half=f"half = 0.5\nopen({str(proof)!r}, 'w').close()")
    before = sorted(course.folder.rglob("*"))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["assignments", "grade", "ps0"])
    with pytest.raises(SystemExit, match=f"^No submission was run.*no sandbox: {unboxed}"):
        main()
    assert sorted(course.folder.rglob("*")) == before
    assert not proof.exists()
    if "does not work" in unboxed:
        return  # the rest is the same
    sys.argv.append("--without-box")
    main()
    assert proof.exists()
    assert re.search(f"with all your rights: {unboxed}", capsys.readouterr().out)
    row = course.rows()["ann"]
    assert (row["boxed"], row["automatic"]) == ("no", "3")


@pytest.mark.filterwarnings("ignore:Object of type <Submitted")  # nbgrader's own, in this process
def test_a_submission_is_refused_if_the_sandbox_is_lost_during_grading(
    tmp_path, template, monkeypatch
):
    """The commands and the formgrader of nbgrader also run submissions in this way."""
    course, proof = Class(tmp_path / "course", template), tmp_path / "proof"
    course.submit("ann", half=f"half = 0.5\nopen({str(proof)!r}, 'w').close()")
    monkeypatch.setattr(sandbox, "missing", lambda: "it failed")
    with pytest.raises(Refused, match="there is no sandbox: it failed"):
        grade_one("ps0", "ann", course.folder, boxed=True)
    if hasattr(signal, "alarm"):
        assert signal.alarm(0) == 0  # the time limit does not end this process later
    assert not proof.exists()
    assert not course.graded("ann").exists()


@pytest.mark.skipif(sys.platform == "win32", reason="a test cannot press Ctrl-C on Windows")
def test_after_ctrl_c_the_submissions_at_work_count_as_not_graded(tmp_path, course):
    """The points, feedback and table of others remain."""
    course = Class(tmp_path / "notebooks" / "assignments", (course.folder, course.given))
    places = Path(tempfile.mkdtemp())  # a short path, because it is part of a socket's address
    table = course.rows()
    for student in table.keys() - {"good one", "tampers"}:
        shutil.rmtree(course.folder / "submitted" / student)
    course.submit("tampers", half="open('asleep', 'w').close()\nimport time\ntime.sleep(10**6)")
    words = [sys.executable, "-m", "rbclassroom.assignments", "grade", "--without-box"]
    job = subprocess.Popen(
        words,
        cwd=tmp_path,
        env=os.environ | {"TMPDIR": str(places), "PYTHONPATH": os.pathsep.join(sys.path)},
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        start_new_session=True,
    )
    family = [psutil.Process(job.pid)]
    assert "ps0, good one: 3 of 6 points" in job.stdout.readline()
    while not glob(f"{places}/*/*/work/asleep"):
        assert job.poll() is None
        time.sleep(0.1)
    family += family[0].children(recursive=True)
    os.killpg(job.pid, signal.SIGINT)
    said, errors = job.communicate()
    assert (job.returncode, errors) == (130, "")
    assert said.startswith("Stopped: 1 of 2 submissions are graded. ")
    assert said.count("\n") == 1
    assert psutil.wait_procs(family, timeout=60)[1] == []
    assert [path for path in places.iterdir() if not path.name.startswith("pymp-")] == []
    assert course.rows() == table
    assert "3 of 6 points so far" in course.feedback("good one")
    assert not course.graded("tampers").exists()
    assert not (course.folder / "feedback" / "tampers" / "ps0").exists()
    with course.gradebook() as gradebook:
        assert gradebook.find_submission("ps0", "good one").score == 3
        assert gradebook.find_submission("ps0", "tampers").score == 0
        gradebook.find_grade("words-answer", "ps0", "ps0", "good one").manual_score = 1
        gradebook.db.commit()
    # the next run continues
    course.submit("tampers", half="half = 0.5")
    before = course.graded("good one").stat().st_mtime_ns
    assert grade(["ps0"], course.folder, without_box=True)
    assert course.graded("good one").stat().st_mtime_ns == before
    assert (course.rows()["good one"]["total"], course.rows()["tampers"]["total"]) == ("4", "3")


def test_only_changed_submissions_run_again(tmp_path, template):
    """Marks given by hand change the table and the page without another run."""
    course = Class(tmp_path, template)
    for student in ("ann", "bob"):
        course.submit(student, half="import uuid\nhalf = 0.5\nprint(f'run {uuid.uuid4()}')")
    grade(["ps0"], course.folder, without_box=True)
    runs = {who: re.findall("run [0-9a-f-]{36}", course.page(who)) for who in ("ann", "bob")}
    with course.gradebook() as gradebook:
        gradebook.find_grade("words-answer", "ps0", "ps0", "ann").manual_score = 2.5
        gradebook.find_comment("words-answer", "ps0", "ps0", "ann").manual_comment = "Well put."
        gradebook.db.commit()
    shutil.rmtree(course.graded("bob").parent)
    graded = course.graded("ann").stat().st_mtime_ns
    grade(["ps0"], course.folder, without_box=True)
    assert course.graded("ann").stat().st_mtime_ns == graded
    assert runs["ann"] == re.findall("run [0-9a-f-]{36}", course.page("ann")) != []
    assert runs["bob"] != re.findall("run [0-9a-f-]{36}", course.page("bob"))
    assert (course.rows()["ann"]["total"], course.rows()["bob"]["total"]) == ("5.5", "3")
    said = " ".join(course.feedback("ann").split())
    assert "5.5 of 6 points. Right" in said
    assert "Your lecturer: Well put." in said
    pages = course.folder / "feedback" / "ann" / "ps0"
    assert [path.name for path in pages.iterdir()] == ["ps0.html"]
    with course.gradebook() as gradebook:  # an earlier gradebook may have other points
        before = grading._state(("ps0", "ann"), course.folder, False)
        gradebook.find_grade("square-test", "ps0", "ps0", "ann").auto_score = 0
        gradebook.db.commit()
    assert grading._state(("ps0", "ann"), course.folder, False) != before
