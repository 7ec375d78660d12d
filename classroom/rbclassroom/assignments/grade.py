"""Grade each submission of a problem set; write the feedback and a table of the points."""

import glob
import hashlib
import logging
import os
import re
import signal
import sqlite3
import sys
import tempfile
from collections.abc import Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, ProcessPoolExecutor, wait
from contextlib import ExitStack, closing, contextmanager, suppress
from functools import partial
from multiprocessing import active_children, get_context, parent_process
from pathlib import Path
from threading import Thread
from typing import Any

import nbformat
from nbformat import NotebookNode
from nbgrader.api import Gradebook, MissingEntry
from nbgrader.converters import Autograde, GenerateAssignment, GenerateFeedback
from nbgrader.coursedir import CourseDirectory
from nbgrader.utils import capture_log, rmtree
from traitlets.config import Config

import rbclassroom
import rbcourse
from rbclassroom.assignments import sandbox
from rbclassroom.assignments.autograding import RUN, configure
from rbclassroom.assignments.collect import read_owners, read_report, write_csv
from rbclassroom.assignments.handout import find_set, pack, read_config
from rbclassroom.assignments.locked_cells import grade_id, is_answer, marks_of
from rbclassroom.assignments.submissions import Refused, read_notebook
from rbclassroom.assignments.tables import update
from rbcourse.files import replace_file

WORKERS = max(2, (os.cpu_count() or 2) // 2)  # number of students graded at the same time
MEMORY = 1_500_000_000  # bytes, for each process
LARGEST = 30_000_000  # bytes of a notebook
Job = tuple[str, str]  # the name of a set, and the name of a student
Row = dict[str, Any]
Points = set[tuple[str, str, float]]  # students, sets, and points


def grade(names: Iterable[str], assignments: Path, without_box: bool = False) -> list[Path]:
    """Grade all submissions of some sets, by default of all sets with submissions.

    The function prints a line for each submission, and writes feedback and a table for each set.
    If there is no sandbox, ValueError is raised and nothing is run or written, unless `without_box`
    is true. Points given by hand are kept. A submission that is refused loses its feedback and its
    earlier automatic points. If a student's points exceed the maximum, or change while another
    student is graded, ValueError is raised and no table is written. A submission that was graded,
    also in an interrupted run, does not run again until its file, its set or the package changes.
    """
    chosen = list(names) or sorted({path.name for path in assignments.glob("submitted/*/*/")})
    if not chosen:
        raise ValueError("There are no submissions, such as submitted/STUDENT/ps1/ps1.ipynb.")
    if why := sandbox.missing():
        if not without_box:
            how = "--without-box runs them with all your rights"
            raise ValueError(f"No submission was run, because there is no sandbox: {why}; {how}.")
        print(f"Submissions run without a sandbox and with all your rights: {why}.", flush=True)
    with _alone(assignments):
        return _grade_sets([*dict.fromkeys(chosen)], assignments, boxed=not why)


def _grade_sets(names: list[str], assignments: Path, boxed: bool) -> list[Path]:
    """Grade all submissions of some sets; return their tables."""
    jobs = [job for name in names for job in _prepare(name, assignments)]
    tables, rows = list[Path](), dict[Job, Row]()
    try:
        for name in names:
            own = [job for job in jobs if job[0] == name]
            _grade_set(own, assignments, rows, boxed)
            tables.append(_write_table(name, [rows[job] for job in own], assignments))
    except KeyboardInterrupt:
        count = f"{len(rows)} of {len(jobs)} submissions are graded"
        print(f"Stopped: {count}. Run this again to continue; then the tables are written.")
        raise SystemExit(130) from None
    return tables


@contextmanager
def _alone(assignments: Path) -> Iterator[None]:
    """Refuse a second run at the same time; the lock of SQLite ends with this process."""
    with closing(sqlite3.connect(assignments / ".grading", timeout=0)) as lock:
        try:
            lock.execute("BEGIN EXCLUSIVE")
        except sqlite3.OperationalError as error:
            raise ValueError(f"{assignments}: another grade is running ({error})") from error
        yield


def _print_row(row: Row, progress: str) -> None:
    said = [f"{row['total']} of {row['maximum']} points"] if "total" in row else []
    said += [f"still to grade by hand: {row['by hand']}"] if row.get("by hand") else []
    said += [row["remarks"]] if row["remarks"] else []
    print(f"{progress} {row['set']}, {row['student']}: {'; '.join(said)}", flush=True)


def _write_table(name: str, graded: list[Row], assignments: Path) -> Path:
    """Write the table of a set, with a line for each file that was not collected, and the pages."""
    why_late = {
        row["what"]: row["why"] for row in read_report(assignments) if row["list"] == "late"
    }
    owners, rows = read_owners(assignments), list[Row]()
    for row in graded:
        student = row["student"]
        number, who = owners.get(f"{student}/{name}", ("", ""))
        rows.append({"student": student, "number": number, "name": who} | row)
        if not row.get("late"):  # nbgrader knows no due date, or the submission was refused
            why = why_late.get(f"{student}, {name}", "")
            rows[-1]["late"] = "perhaps" if why.startswith("perhaps") else why
    for what, reason in _not_collected(name, assignments, {row["student"] for row in graded}):
        number, who = owners.get(what, ("", ""))
        row = {"student": _tidy(what), "number": number, "name": who, "set": name}
        rows.append(row | {"remarks": _tidy(reason)})
        print(f"{name}, {rows[-1]['student']}: {rows[-1]['remarks']}", flush=True)
    table = assignments / f"{name}-grades.csv"
    write_csv(table, rows)
    print(table, flush=True)
    _pack_pages(name, rows, assignments)
    return table


def _pack_pages(name: str, rows: list[Row], assignments: Path) -> None:
    """Write the feedback of students with a number into a zip, in the folders of Moodle's zip."""
    pages = {}
    for row in rows:
        page = assignments / "feedback" / row["student"] / name / f"{name}.html"
        if row["number"] and page.exists():
            folder = f"{row['name']}_{row['number']}_assignsubmission_file_"
            pages[f"{folder}/{name}.html"] = page.read_bytes()
    packed = assignments / f"{name}-feedback.zip"
    packed.unlink(missing_ok=True)  # an earlier one may have pages of other students
    if pages:
        replace_file(packed, pack(pages))
        print(packed, flush=True)


def _prepare(name: str, assignments: Path) -> list[Job]:
    """Update the gradebook and the files of a set; return the submissions to grade."""
    config = course_config(name, assignments)
    students = sorted(path.parent.name for path in assignments.glob(f"submitted/*/{name}/"))
    if not students:
        raise ValueError(f"{name}: a submission in submitted/STUDENT/{name}/ is wanted, got none")
    table = assignments / f"{name}-grades.csv"
    try:
        if table.exists():
            table.open("a").close()
    except PermissionError as error:
        raise ValueError(f"{table} cannot be written; close it in other programs") from error
    before = Path(config.CourseDirectory.root, "gradebook.db")
    copy = before.with_name(f"gradebook.before-{name}.db")
    # a copy that is newer than the table is from a run that is not complete
    copied, written = (path.stat().st_mtime if path.exists() else 0 for path in (copy, table))
    if before.exists() and copied <= written:
        replace_file(copy, before.read_bytes())
    update(find_set(name, assignments))
    done = run_step(GenerateAssignment, config)
    if not done["success"]:
        raise ValueError(f"{name} cannot be graded: {last_line(done)}")
    return [(name, student) for student in students]


@contextmanager
def _without_ctrl_c() -> Iterator[None]:
    """Ignore Ctrl-C, and let programs that start here ignore it."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _state(job: Job, assignments: Path, boxed: bool) -> str:
    """Return a hash of all that decides a result, and of the stored automatic points."""
    name, student = job
    course, points = CourseDirectory(config=course_config(name, assignments)), list[Any]()
    with Gradebook(course.db_url) as gradebook, suppress(MissingEntry):
        grades = gradebook.find_submission_notebook(name, name, student).grades
        points = sorted((grade.name, grade.auto_score) for grade in grades)
    folders = [assignments / "submitted" / student / name, find_set(name, assignments)]
    files = [path for folder in folders for path in sorted(folder.iterdir())]
    packages = [*rbcourse.__path__, *rbclassroom.__path__]
    files += [path for folder in packages for path in sorted(Path(folder).rglob("*.py"))]
    files += [assignments / "nbgrader_config.py"]
    facts = [(path.name, path.read_bytes()) for path in files if path.is_file()]
    return hashlib.sha256(repr((boxed, points, facts)).encode()).hexdigest()


def _grade_set(jobs: list[Job], assignments: Path, rows: dict[Job, Row], boxed: bool) -> None:
    """Grade the submissions of a set in parallel; print and store their rows.

    After Ctrl-C, the submissions at work are ended, and lose their earlier points and their
    feedback, because a part of the new ones may be stored.
    """
    name, todo = jobs[0][0], [*jobs]
    course = CourseDirectory(config=course_config(name, assignments))
    works: dict[Future[list[str]], tuple[Job, ProcessPoolExecutor]] = {}
    folder = Path(tempfile.mkdtemp())  # for all kernels
    worker = partial(ProcessPoolExecutor, 1, get_context("spawn"), _begin, (MEMORY, str(folder)))
    with Gradebook(course.db_url) as gradebook:
        known = _points(gradebook)
    with ExitStack() as stack:
        stack.callback(sandbox.delete, folder)
        free = [stack.enter_context(worker()) for _ in range(WORKERS)]
        try:
            while todo or works:
                while todo and free:
                    job, pool = todo.pop(0), free.pop()
                    with _without_ctrl_c():
                        works[pool.submit(grade_one, *job, assignments, boxed)] = job, pool
                at_work = {student for (_, student), _ in works.values()}
                for work in wait(works, return_when=FIRST_COMPLETED).done:
                    job, pool = works.pop(work)
                    broken = isinstance(work.exception(), BrokenExecutor)
                    free.append(stack.enter_context(worker()) if broken else pool)
                    result = _result(work)
                    with Gradebook(course.db_url) as gradebook:
                        if isinstance(result, str):
                            _withdraw(gradebook, assignments, *job)
                        row = _row(gradebook, job, result, boxed)
                        known, before = _points(gradebook), known
                    if others := sorted({student for student, *_ in known ^ before} - at_work):
                        when = f"during the grading of {' and '.join(sorted(at_work))}"
                        where = f"The earlier points are in gradebook.before-{name}.db."
                        raise ValueError(f"The points of {others[0]} changed {when}. {where}")
                    rows[job] = row
                    done = len(jobs) - len(todo) - len(works)
                    _print_row(row, f"{done}/{len(jobs)}")
        except KeyboardInterrupt:
            with _without_ctrl_c():
                for process in active_children():
                    process.kill()
                stack.close()  # now no submission runs
                with Gradebook(course.db_url) as gradebook:
                    for job, _ in works.values():
                        _withdraw(gradebook, assignments, *job)
            raise


def _not_collected(name: str, assignments: Path, students: set[str]) -> Iterator[tuple[str, str]]:
    sets = {path.name for kind in ("source", "private") for path in assignments.glob(f"{kind}/*")}
    report = read_report(assignments)
    useless = [row for row in report if row["list"] == "nothing usable"]
    unusable = "".join(row["why"] for row in useless)
    known = students | {row["what"] for row in useless}
    for row in report:
        what, student = row["what"], row["what"].removesuffix(f", {name}")
        named = {each for each in sets if each in f"{what} {row['why']}".casefold()}
        if row["list"] == "missing" and student not in {what, *known}:
            yield student, "no file was collected"
        elif name not in (row["sets"].split() or named or {name}) or (named and name not in named):
            continue
        elif row["list"] == "nothing usable":
            yield what, f"nothing usable was handed in: {row['why']}"
        elif row["list"] in ("refused", "unmatched") and what not in unusable:
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
    """Run a step of nbgrader silently, and replace earlier results."""
    log = logging.getLogger(__name__)
    log.propagate, log.handlers = False, [logging.NullHandler()]
    step = converter(CourseDirectory(config=config), config=config, log=log)
    step.force = True
    done: dict[str, Any] = capture_log(step)
    if done.get("error", "").strip().endswith("KeyboardInterrupt"):
        raise KeyboardInterrupt
    return done


def last_line(done: dict[str, str]) -> str:
    """Return the error in a run of nbgrader, as one line."""
    log, kinds = done.get("log", ""), "Error|Exception|Entry|Refused"
    raised = re.findall(rf"(?m)^ *([\w.]*({kinds}))(?:: (.*))?$", log)
    refused = [what for _, kind, what in raised if kind == "Refused"]
    others = [what or name for name, _, what in raised]
    return (refused or others or done["error"].strip().splitlines()[-1:])[0]


def _points(gradebook: Any) -> Points:
    submissions = (each for student in gradebook.students for each in student.submissions)
    return {(each.student_id, each.assignment.name, each.score) for each in submissions}


def _begin(memory: int, folder: str) -> None:
    """Silence this process, limit its memory, choose its folder, let it end with its parent."""
    tempfile.tempdir = folder
    parent: Any = parent_process()
    Thread(target=lambda: (parent.join(), os._exit(1)), daemon=True).start()
    with open(os.devnull, "r+b") as nowhere:
        for stream in (0, 1, 2):
            os.dup2(nowhere.fileno(), stream)
    if sys.platform == "linux":  # other systems do not enforce this limit
        import resource

        resource.setrlimit(resource.RLIMIT_DATA, (memory, memory))


def grade_one(name: str, student: str, folder: Path, boxed: bool) -> list[str]:
    """Grade one submission, unless nothing has changed, and write its page; return remarks."""
    config = course_config(name, folder)
    config.BoxedExecute.boxed = boxed
    config.CourseDirectory.student_id = student
    alarm = getattr(signal, "alarm", lambda _: None)  # Windows has none
    alarm(300 + 2 * config.BoxedExecute.get("seconds", 600))  # it ends this process
    try:
        graded = folder / "autograded" / student / name / f"{name}.ipynb"
        job, stored = (name, student), graded.with_name(RUN)
        if glob.escape(student) != student:  # nbgrader reads this name as a pattern
            raise Refused("the name of the folder contains [, * or ?; rename the folder")
        given = {path.name for path in find_set(name, folder).iterdir()}
        check_submission(folder / "submitted" / student / name, name, given)
        state, remarks = _graded(stored)
        if state != _state(job, folder, boxed):
            by_hand = _graded_by_hand(name, student, folder)
            remarks = _autograde(graded, config, by_hand)
        done = run_step(GenerateFeedback, config)
        if not done["success"]:
            return [*remarks, f"no feedback was written: {last_line(done)}"]
        run = nbformat.read(stored, as_version=4)
        run.metadata.graded = [_state(job, folder, boxed), remarks]
        replace_file(stored, nbformat.writes(run).encode())
        return remarks
    finally:
        alarm(0)


def _graded(stored: Path) -> tuple[str, list[str]]:
    """Return the state of a submission when it was graded, and the remarks on it."""
    run = nbformat.read(stored, as_version=4) if stored.exists() else NotebookNode(metadata={})
    state, remarks = run.metadata.get("graded", ("", []))
    return state, remarks


def _graded_by_hand(name: str, student: str, folder: Path) -> set[str]:
    """Return the ids of the answers of a submission that have points given by a person."""
    database = folder / "gradebook.db"
    if not database.exists():
        return set()
    with Gradebook(f"sqlite:///{database.resolve()}") as gradebook, suppress(MissingEntry):
        grades = gradebook.find_submission_notebook(name, name, student).grades
        return {grade.name for grade in grades if grade.manual_score is not None}
    return set()


def _autograde(graded: Path, config: Config, by_hand: set[str]) -> list[str]:
    before = {key: words for key, words in _words(graded).items() if key in by_hand}
    done = run_step(Autograde, config)
    if not done["success"]:
        raise Refused(last_line(done))
    remarks: list[str] = nbformat.read(graded, as_version=4).metadata.get("remarks", [])
    changed = (key for key, words in _words(graded).items() if words != before.get(key, words))
    return remarks + [
        f"the answer {x} differs from the one that was graded before" for x in changed
    ]


def _words(path: Path) -> dict[str, str]:
    """Return the answers to grade by hand in an autograded notebook."""
    cells = nbformat.read(path, as_version=4).cells if path.exists() else []
    words = (cell for cell in cells if is_answer(cell) and marks_of(cell).get("grade"))
    return {grade_id(cell): cell.source for cell in words}


def check_submission(folder: Path, name: str, given: set[str]) -> None:
    """Raise `Refused` for an unreadable notebook, a link or an additional file."""
    wanted, there = f"{name}.ipynb", sorted(path.name for path in folder.iterdir())
    path = folder / wanted
    if wanted not in there:
        raise Refused(f"the file {wanted} is wanted, got {', '.join(there) or 'nothing'}")
    if any(place.is_symlink() for place in (folder, folder.parent, *folder.rglob("*"))):
        raise Refused(f"{wanted} or a file or folder beside it is a link")
    if others := sorted(set(there) - given - {wanted, "timestamp.txt"}):
        raise Refused(f"the folder has more files than {wanted}: remove {', '.join(others)}")
    if path.stat().st_size > LARGEST:
        raise Refused(f"{wanted} has more than {LARGEST:,} bytes")
    read_notebook(path.read_bytes(), wanted)


def _result(work: Future[list[str]]) -> list[str] | str:
    """Return the remarks on a submission, or the reason why it was refused."""
    error = work.exception()
    if isinstance(error, BrokenExecutor):
        return "its process ended, or took too long"
    if error:  # the other submissions are still graded
        return str(error) if isinstance(error, Refused) else f"{type(error).__name__}: {error}"
    return work.result()


def _row(gradebook: Any, job: Job, result: list[str] | str, boxed: bool) -> Row:
    name, student = job
    row: Row = {"student": student, "set": name, "boxed": "yes" if boxed else "no"}
    if isinstance(result, str):
        return row | {"remarks": f"refused: {_tidy(result)}"}
    submission = gradebook.find_submission_notebook(name, name, student)
    order = [cell.name for cell in submission.notebook.source_cells]
    grades = sorted(submission.grades, key=lambda grade: order.index(grade.name))
    extra = sum(grade.extra_credit or 0 for grade in grades)
    if submission.score > submission.max_score + extra:
        total = f"{submission.score:g} of {submission.max_score:g}"
        raise ValueError(f"{student} has {total} points; look at the gradebook")
    to_do = [g.name for g in grades if g.auto_score is None and g.manual_score is None]
    late = submission.assignment.total_seconds_late
    return (
        row
        | {g.name: "" if g.name in to_do else f"{g.score:g}" for g in grades}
        | {
            "automatic": f"{sum(grade.auto_score or 0 for grade in grades):g}",
            "total": f"{submission.score:g}",
            "maximum": f"{submission.max_score:g}",
            "by hand": " ".join(to_do),
            "late": f"{late / 3600:.1f} h" if late else "",
            "remarks": "; ".join(map(_tidy, result)),
        }
    )


def _tidy(words: str) -> str:
    """Return a remark, which may quote a student, as a short printable line."""
    words = "".join(letter if letter.isprintable() else "?" for letter in words)
    return words if len(words) <= 300 else f"{words[:300]}…"


def _withdraw(gradebook: Any, root: Path, name: str, student: str) -> None:
    """Remove the feedback and the automatic points of a refused submission."""
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
