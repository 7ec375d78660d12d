"""Grade problem sets: each submission on its own, with feedback and a table of the points."""

import csv
import glob
import html
import io
import logging
import os
import re
import shutil
import signal
import sys
from collections.abc import Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, ProcessPoolExecutor, wait
from contextlib import ExitStack
from functools import partial
from multiprocessing import get_context, parent_process
from pathlib import Path
from threading import Thread
from typing import Any

import nbformat
from nbgrader.api import Gradebook, MissingEntry
from nbgrader.converters import Autograde, GenerateAssignment, GenerateFeedback
from nbgrader.coursedir import CourseDirectory
from nbgrader.utils import capture_log, rmtree
from traitlets.config import Config

from rbclassroom.assignments import sandbox
from rbclassroom.assignments.autograding import configure
from rbclassroom.assignments.handout import find_set, read_config
from rbclassroom.assignments.restore import (
    Refused,
    grade_id,
    is_answer,
    marks_of,
    read_notebook,
    title_of,
)
from rbclassroom.assignments.tables import update
from rbclassroom.assignments.writing import write_csv

WORKERS = 2  # so many students are graded at once
MEMORY = 1_500_000_000  # bytes, for each process
LARGEST = 30_000_000  # bytes of a notebook
Work = Future[list[str]]


def grade(name: str, assignments: Path) -> Path:
    """Grade all submissions of a set, write the feedback and a table; a line a student is printed.

    What a human has given points for is kept. A submission that is refused loses the points that
    a machine gave it before, and its feedback. When points of one student change while another
    is graded, or exceed the maximum, a ValueError names them and no table is written;
    ``gradebook.before-NAME.db`` holds the gradebook as it was.
    """
    config = course_config(name, assignments)
    course = CourseDirectory(config=config)
    students = sorted(path.parent.name for path in assignments.glob(f"submitted/*/{name}/"))
    if not students:
        raise ValueError(f"There is no submission of {name}: submitted/STUDENT/{name}/{name}.ipynb")
    table = assignments / f"{name}-grades.csv"
    try:
        table.open("a").close()
    except PermissionError as error:
        raise ValueError(f"{table} cannot be written: close it where it is open") from error
    before = Path(course.root, "gradebook.db")
    if before.exists():
        shutil.copyfile(before, before.with_name(f"gradebook.before-{name}.db"))
    update(find_set(name, assignments))
    done = run_step(GenerateAssignment, config)
    if not done["success"]:
        raise ValueError(f"{name} cannot be graded: {last_line(done)}")
    with Gradebook(course.db_url) as gradebook:
        known, rows = _points(gradebook), dict[str, dict[str, Any]]()
    boxed = not sandbox.missing()
    todo, works = students[::-1], dict[Work, tuple[str, ProcessPoolExecutor]]()
    worker = partial(ProcessPoolExecutor, 1, get_context("spawn"), _begin, (MEMORY,))
    with ExitStack() as stack:
        free = [stack.enter_context(worker()) for _ in range(WORKERS)]
        while todo or works:
            while todo and free:
                student, pool = todo.pop(), free.pop()
                works[pool.submit(grade_one, name, assignments, student, boxed)] = student, pool
            at_work = sorted(student for student, _ in works.values())
            for work in wait(works, return_when=FIRST_COMPLETED).done:
                student, pool = works.pop(work)
                broken = isinstance(work.exception(), BrokenExecutor)
                free.append(stack.enter_context(worker()) if broken else pool)
                with Gradebook(course.db_url) as gradebook:
                    now = _points(gradebook)
                    for other in sorted({*known, *now} - set(at_work)):
                        if known.get(other) != now.get(other):
                            when = f"during the grading of {' and '.join(at_work)}"
                            where = f"gradebook.before-{name}.db holds what they were"
                            raise ValueError(f"The points of {other} changed {when}. {where}")
                    rows[student] = _row(gradebook, course, student, work)
                    known = now | {student: _points(gradebook).get(student)}
                print(f"{student}: {_summary(rows[student])}", flush=True)
    first = {"set": name, "boxed": "yes" if boxed else "no"}
    lines = [{"student": student} | first | rows[student] for student in students]
    for what, why in _not_collected(name, assignments, students):
        lines.append({"student": _tidy(what), "set": name, "remarks": _tidy(why)})
        print(f"{lines[-1]['student']}: {lines[-1]['remarks']}", flush=True)
    write_csv(table, lines)
    return table


def _not_collected(name: str, assignments: Path, students: list[str]) -> Iterator[tuple[str, str]]:
    """Yield the files that `collect` could not use, perhaps for this set, and who is missing."""
    report = assignments / "submitted" / "report.csv"
    if not report.exists():
        return
    sets = {path.name for kind in ("source", "private") for path in assignments.glob(f"{kind}/*")}
    for row in csv.DictReader(io.StringIO(report.read_text("utf-8-sig"), newline="")):
        what, student = row["what"], row["what"].removesuffix(f", {name}")
        if row["list"] == "missing" and student != what and student not in students:
            yield student, "nothing was collected"
        elif row["list"] in ("refused", "unmatched"):
            named = {each for each in sets if each in what.casefold()}
            if name in named or not named:
                yield what, f"not collected: {row['why']}"


def course_config(name: str, assignments: Path) -> Config:
    """Return the settings of nbgrader for a set."""
    source, config = find_set(name, assignments), Config()
    configure(config)
    config.merge(read_config(assignments))
    config.CourseDirectory.root = os.path.realpath(assignments)
    config.CourseDirectory.source_directory = source.parent.name
    config.CourseDirectory.assignment_id = name
    return config


def run_step(converter: Any, config: Config) -> dict[str, Any]:
    """Run a step of nbgrader, over what it made before, and print nothing."""
    log = logging.getLogger(__name__)
    log.propagate, log.handlers = False, [logging.NullHandler()]
    step = converter(CourseDirectory(config=config), config=config, log=log)
    step.force = True
    return capture_log(step)


def last_line(done: dict[str, str]) -> str:
    """Return what went wrong in a run of nbgrader, as one line."""
    log, kinds = done.get("log", ""), "Error|Exception|Entry|Refused"
    raised = re.findall(rf"(?m)^ *([\w.]*({kinds}))(?:: (.*))?$", log)
    refused = [what for _, kind, what in raised if kind == "Refused"]
    others = [what or name for name, _, what in raised]
    return (refused or others or done["error"].strip().splitlines()[-1:])[0]


def _points(gradebook: Any) -> dict[str, Any]:
    """Return the points of each student in each set."""
    return {
        student.id: sorted((of.assignment.name, of.score) for of in student.submissions)
        for student in gradebook.students
    }


def _begin(memory: int) -> None:
    """Silence this process, bound its memory, and let it end with its parent."""
    parent: Any = parent_process()
    Thread(target=lambda: (parent.join(), os._exit(1)), daemon=True).start()
    with open(os.devnull, "r+b") as nowhere:
        for stream in (0, 1, 2):
            os.dup2(nowhere.fileno(), stream)
    if sys.platform == "linux":  # others have the limit, and do not keep it
        import resource

        resource.setrlimit(resource.RLIMIT_DATA, (memory, memory))


def grade_one(name: str, folder: Path, student: str, boxed: bool) -> list[str]:
    """Grade one submission; return remarks on it."""
    if boxed and sandbox.missing():
        raise Refused(f"there is no box any more: {sandbox.missing()}")
    config = course_config(name, folder)
    if hasattr(signal, "alarm"):  # should all else fail, in two runs
        signal.alarm(300 + 2 * config.BoxedExecute.get("seconds", 600))
    config.CourseDirectory.student_id = student
    graded = folder / "autograded" / student / name / f"{name}.ipynb"
    before = _words(graded)
    if glob.escape(student) != student:  # nbgrader would take it for a pattern
        raise Refused("the name of the folder holds [, * or ?: give it another")
    given = {path.name for path in find_set(name, folder).iterdir()}
    check_submission(folder / "submitted" / student / name, name, given)
    done = run_step(Autograde, config)
    if not done["success"]:
        raise Refused(last_line(done))
    remarks: list[str] = nbformat.read(graded, as_version=4).metadata.get("remarks", [])
    for key, words in _words(graded).items():
        if words != before.get(key, words):
            remarks.append(f"{key} is another answer than when it was graded before")
    done = run_step(GenerateFeedback, config)
    if done["success"]:
        page = folder / "feedback" / student / name / f"{name}.html"
        page.write_text(_with_titles(page.read_text("utf-8"), graded), "utf-8")
    else:
        remarks.append(f"no feedback: {last_line(done)}")
    return remarks


def _with_titles(page: str, graded: Path) -> str:
    """Return a page of feedback whose list names problems, where nbgrader has "Test cell"."""
    cells = nbformat.read(graded, as_version=4).cells
    for at, cell in enumerate(cells):
        link = f'<a href="#{grade_id(cell)}">'
        kind = "in words" if is_answer(cell) else "tests"
        title = re.sub(r" \(\d+ points?\)$", "", title_of(cells, at))
        name = f"{html.escape(title)}, {kind}".replace("\\", "\\\\")  # re.sub reads it
        page = re.sub(f"({re.escape(link)})[^<]*</a>", rf"\g<1>{name}</a>", page)
    return page


def _words(path: Path) -> dict[str, str]:
    """Return the answers that a human grades, as they were graded last."""
    cells = nbformat.read(path, as_version=4).cells if path.exists() else []
    words = (cell for cell in cells if is_answer(cell) and marks_of(cell).get("grade"))
    return {grade_id(cell): cell.source for cell in words}


def check_submission(folder: Path, name: str, given: set[str]) -> None:
    """Refuse what nbgrader cannot read, and what it would copy: links, files not handed out."""
    wanted, there = f"{name}.ipynb", sorted(path.name for path in folder.iterdir())
    path = folder / wanted
    if wanted not in there:
        raise Refused(f"there is no {wanted}, but {', '.join(there) or 'nothing'}")
    if any(place.is_symlink() for place in (folder, folder.parent, *folder.rglob("*"))):
        raise Refused(f"{wanted}, or what is beside it, is a link")
    if others := sorted(set(there) - given - {wanted, "timestamp.txt"}):
        raise Refused(f"there is more than {wanted}: take away {', '.join(others)}")
    if path.stat().st_size > LARGEST:
        raise Refused(f"{wanted} has more than {LARGEST:,} bytes")
    content = path.read_bytes()
    read_notebook(content, wanted)
    if content.startswith((b"\xff\xfe", b"\xfe\xff", b"\xef\xbb\xbf")):
        raise Refused(f"{wanted} is not plain UTF-8: collect it again, or save it in Jupyter")


def _row(gradebook: Any, course: CourseDirectory, student: str, work: Work) -> dict[str, Any]:
    """Return the row of a student in the table."""
    name, error = course.assignment_id, work.exception()
    if error:  # the others are graded
        _withdraw(gradebook, Path(course.root), name, student)
        why = str(error) if isinstance(error, Refused) else f"{type(error).__name__}: {error}"
        why = "its process ended, or took too long" if isinstance(error, BrokenExecutor) else why
        return {"remarks": f"refused: {_tidy(why)}"}
    submission = gradebook.find_submission_notebook(name, name, student)
    order = [cell.name for cell in submission.notebook.source_cells]
    grades = sorted(submission.grades, key=lambda grade: order.index(grade.name))
    extra = sum(grade.extra_credit or 0 for grade in grades)
    if submission.score > submission.max_score + extra:
        total = f"{submission.score:g} of {submission.max_score:g}"
        raise ValueError(f"{student} has {total} points: look at the gradebook")
    to_do = [g.name for g in grades if g.auto_score is None and g.manual_score is None]
    late = submission.assignment.total_seconds_late
    row = {g.name: "" if g.name in to_do else f"{g.score:g}" for g in grades}
    row["automatic"] = f"{sum(grade.auto_score or 0 for grade in grades):g}"
    row["total"] = f"{submission.score:g}"
    row["maximum"] = f"{submission.max_score:g}"
    row["by hand"] = " ".join(to_do)
    row["late"] = f"{late / 3600:.1f} h" if late else ""
    return row | {"remarks": "; ".join(map(_tidy, work.result()))}


def _tidy(words: str) -> str:
    """Return a remark, which may hold what a student wrote, as a short line that can be printed."""
    words = "".join(letter if letter.isprintable() else "?" for letter in words)
    return words if len(words) <= 300 else f"{words[:300]}…"


def _withdraw(gradebook: Any, root: Path, name: str, student: str) -> None:
    """Take back what a machine gave a submission that is refused now."""
    for step in ("autograded", "feedback"):
        if (root / step / student / name).exists():
            rmtree(str(root / step / student / name))
    try:
        grades = gradebook.find_submission_notebook(name, name, student).grades
    except MissingEntry:
        return
    for points in grades:
        points.auto_score, points.needs_manual_grade = None, True
    gradebook.db.commit()


def _summary(row: dict[str, Any]) -> str:
    points = f"graded, {row['total']} of {row['maximum']}" if "total" in row else ""
    by_hand = f"by hand: {row['by hand']}" if row.get("by hand") else ""
    return "; ".join(filter(None, [points, by_hand, row["remarks"]]))


def grade_all(names: Iterable[str], assignments: Path, require_box: bool = False) -> list[Path]:
    """Grade sets, or all of which there are submissions, one after the other."""
    chosen = list(names) or sorted({path.name for path in assignments.glob("submitted/*/*/")})
    if not chosen:
        raise ValueError("There are no submissions: submitted/STUDENT/ps1/ps1.ipynb")
    if why := sandbox.missing():
        if require_box:
            raise ValueError(f"There is no box for submissions: {why}")
        print(f"Submissions run without a box, and can do what you can: {why}", flush=True)
    tables = []
    for name in chosen:
        print(f"{name}:", flush=True)
        tables.append(grade(name, assignments))
        print(tables[-1])
    return tables
