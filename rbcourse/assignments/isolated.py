"""Grade one submission in a process of its own, with limits of time and memory."""

import glob
import html
import json
import os
import re
import sys
import tempfile
from contextlib import suppress
from multiprocessing import get_context
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

import nbformat
import psutil
from nbgrader.converters import Autograde, GenerateFeedback
from nbgrader.coursedir import CourseDirectory
from nbgrader.utils import capture_log, is_grade, is_solution
from traitlets.config import Config

from rbcourse.assignments.autograding import RefusedError, configure
from rbcourse.assignments.handout import find_set, last_line, quiet_log, read_config, secret_lines

LARGEST = 50_000_000  # bytes of a notebook


def course_config(name: str, assignments: Path) -> Config:
    """Return the settings of nbgrader for a set."""
    source = find_set(name, assignments)
    config = Config()
    configure(config)
    config.merge(read_config(assignments))
    config.CourseDirectory.root = os.path.realpath(assignments)
    config.CourseDirectory.source_directory = source.parent.name
    config.CourseDirectory.assignment_id = name
    return config


def run_step(converter: Any, config: Config) -> dict[str, Any]:
    """Run a step of nbgrader, over what it made before."""
    course = CourseDirectory(config=config)
    step = converter(course, config=config, log=quiet_log("steps"))
    step.force = True
    return capture_log(step)


def grade_apart(
    name: str, assignments: Path, student: str, seconds: float, memory: int
) -> dict[str, Any]:
    """Grade a submission in a process of its own."""
    # on Linux it is copied from one that has loaded nbgrader, which takes seconds
    context: Any = get_context("forkserver" if sys.platform == "linux" else "spawn")
    context.set_forkserver_preload(["rbcourse.assignments.isolated"])
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        result = Path(folder, "result.json")
        given = (name, Path(os.path.realpath(assignments)), student, memory, result)
        worker = context.Process(target=_work, args=given)
        worker.start()
        worker.join(seconds)
        late = worker.is_alive()
        if late:
            _end(worker)
        try:
            return dict(json.loads(result.read_bytes()))
        except (OSError, ValueError):
            ended = "its process ended, or took too much memory"
            return {"refused": f"not done after {seconds:g} s" if late else ended}


def _end(worker: BaseProcess) -> None:
    """End a process and all that it has started."""
    tree = []
    with suppress(psutil.NoSuchProcess):
        tree = psutil.Process(worker.pid).children(recursive=True)
    worker.kill()
    for process in tree:
        with suppress(psutil.NoSuchProcess):
            process.kill()
    worker.join()


def _work(name: str, assignments: Path, student: str, memory: int, result: Path) -> None:
    """Grade a submission in this process, under limits and with nothing printed."""
    with open(os.devnull, "r+b") as nowhere:
        for stream in (0, 1, 2):
            os.dup2(nowhere.fileno(), stream)
    if sys.platform == "linux":  # others have the limit, and do not keep it
        import resource

        resource.setrlimit(resource.RLIMIT_DATA, (memory, memory))
    try:
        found = grade_one(name, assignments, student)
    except Exception as error:  # told, and the others are graded
        found = {"refused": f"{type(error).__name__}: {error}"}
    result.write_text(json.dumps(found), encoding="utf-8")


def grade_one(name: str, folder: Path, student: str) -> dict[str, Any]:
    """Grade one submission in this process."""
    config = course_config(name, folder)
    config.CourseDirectory.student_id = glob.escape(student)
    graded = folder / "autograded" / student / name / f"{name}.ipynb"
    before = _words(graded)
    try:
        check_submission(folder / "submitted" / student / name, name)
        done = run_step(Autograde, config)
        if not done["success"]:
            raise RefusedError(last_line(done))
    except RefusedError as error:
        return {"refused": str(error)}
    remarks = nbformat.read(graded, as_version=4).metadata.get("remarks", [])
    now = _words(graded)
    new = [key for key in now if key in before and now[key] != before[key]]
    remarks += [f"{key} is another answer than when it was graded before" for key in new]
    return {"remarks": remarks + _give_feedback(name, folder, student, config)}


def _words(path: Path) -> dict[str, str]:
    """Return the answers that a human grades, as they were graded last."""
    if not path.exists():
        return {}
    cells = nbformat.read(path, as_version=4).cells
    return {
        cell.metadata.nbgrader.grade_id: cell.source
        for cell in cells
        if "nbgrader" in cell.metadata and is_grade(cell) and is_solution(cell)
    }


def check_submission(folder: Path, name: str) -> None:
    """Refuse what is no notebook of the right name."""
    there = sorted(path.name for path in folder.iterdir())
    wanted = f"{name}.ipynb"
    if wanted not in there:
        raise RefusedError(f"there is no {wanted}, but {', '.join(there) or 'nothing'}")
    path = folder / wanted
    if path.stat().st_size > LARGEST:
        raise RefusedError(f"{wanted} has more than {LARGEST:,} bytes")
    content = path.read_bytes()
    if not content.strip():
        raise RefusedError(f"{wanted} is empty")
    if content.startswith((b"%PDF", b"PK")):
        raise RefusedError(f"{wanted} is no notebook, but a PDF or an archive under another name")
    try:
        nbformat.validate(nbformat.reads(content.decode("utf-8"), as_version=4))
    except Exception as error:  # nbformat raises whatever the content makes it raise
        raise RefusedError(f"{wanted} is no notebook: {str(error).splitlines()[0][:80]}") from error


def _give_feedback(name: str, folder: Path, student: str, config: Config) -> list[str]:
    """Write the feedback; return what is to be said of it."""
    done = run_step(GenerateFeedback, config)
    if not done["success"]:
        return [f"no feedback: {last_line(done)}"]
    path = folder / "feedback" / student / name / f"{name}.html"
    page = _squeezed(html.unescape(re.sub(r"<[^>]*>", "", path.read_text("utf-8"))))
    own = nbformat.read(folder / "submitted" / student / name / f"{name}.ipynb", as_version=4)
    written = _squeezed("".join(cell.source for cell in own.cells))
    source = nbformat.read(find_set(name, folder) / f"{name}.ipynb", as_version=4)
    secrets = map(_squeezed, secret_lines(source, solutions=False))
    if any(secret in page and secret not in written for secret in secrets):
        path.unlink()
        return ["no feedback: it would show hidden tests or the mark scheme; look at the outputs"]
    return []


def _squeezed(text: str) -> str:
    return re.sub(r"\s+", "", text)
