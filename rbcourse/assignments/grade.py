"""Grade problem sets: each submission on its own, with feedback and a table of the points."""

import argparse
import csv
import io
import sys
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from typing import Any

from nbgrader.api import Gradebook, MissingEntry
from nbgrader.converters import GenerateAssignment
from nbgrader.coursedir import CourseDirectory
from nbgrader.utils import rmtree
from traitlets.config import Config

from rbcourse.assignments.handout import last_line
from rbcourse.assignments.isolated import course_config, grade_apart, run_step

SECONDS = 600  # for a student, all in all
MEMORY = 1_500_000_000  # bytes, for each process of a student


def sets_submitted(assignments: Path) -> list[str]:
    """Return the problem sets of which there are submissions."""
    return sorted({path.name for path in assignments.glob("submitted/*/*/")})


def grade(
    name: str,
    assignments: Path,
    *,
    seconds: float = SECONDS,
    memory: int = MEMORY,
    workers: int = 2,
) -> Path:
    """Grade all submissions of a set, write the feedback and a table; a line a student is printed.

    What a human has given points for is kept. A submission that is refused loses the points that
    a machine gave it before, and its feedback.
    """
    config = course_config(name, assignments)
    students = sorted(path.parent.name for path in assignments.glob(f"submitted/*/{name}/"))
    if not students:
        raise ValueError(f"There is no submission of {name}: submitted/STUDENT/{name}/{name}.ipynb")
    table = assignments / f"{name}-grades.csv"
    try:
        table.open("a").close()
    except PermissionError as error:
        raise ValueError(f"{table} cannot be written: close it where it is open") from error
    done = run_step(GenerateAssignment, config)
    if not done["success"]:
        raise ValueError(f"{name} cannot be graded: {last_line(done)}")
    found: dict[str, dict[str, Any]] = {}
    with ThreadPoolExecutor(workers) as pool:
        jobs = {
            pool.submit(grade_apart, name, assignments, student, seconds, memory): student
            for student in students
        }
        for job in as_completed(jobs):
            student = jobs[job]
            try:
                found[student] = _row(config, name, student, job.result())
            except Exception as error:  # one student's trouble is not that of the others
                remarks = f"not graded: {type(error).__name__}: {error}"
                found[student] = {"student": student, "set": name, "remarks": remarks}
            print(f"{student}: {_summary(found[student])}", flush=True)
    return _write_table(table, [found[who] for who in students])


def _row(config: Config, name: str, student: str, found: dict[str, Any]) -> dict[str, Any]:
    """Return the row of a student in the table."""
    course = CourseDirectory(config=config)
    remarks = found.get("remarks", [])
    row: dict[str, Any] = {"student": student, "set": name}
    with Gradebook(course.db_url) as gradebook:
        if "refused" in found:
            _withdraw(gradebook, Path(course.root), name, student)
            return row | {"remarks": f"refused: {found['refused']}"}
        submission = gradebook.find_submission_notebook(name, name, student)
        order = [cell.name for cell in submission.notebook.source_cells]
        grades = sorted(submission.grades, key=lambda grade: order.index(grade.name))
        to_do = [g.name for g in grades if g.auto_score is None and g.manual_score is None]
        row |= {g.name: "" if g.name in to_do else f"{g.score:g}" for g in grades}
        row["automatic"] = f"{sum(grade.auto_score or 0 for grade in grades):g}"
        row["total"] = f"{submission.score:g}"
        row["maximum"] = f"{submission.max_score:g}"
        late = submission.assignment.total_seconds_late
        row["by hand"] = " ".join(to_do)
        row["late"] = f"{late / 3600:.1f} h" if late else ""
    return row | {"remarks": "; ".join(remarks)}


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
    if "total" not in row:
        return str(row["remarks"])
    parts = [f"graded, {row['total']} of {row['maximum']}"]
    parts += [f"by hand: {row['by hand']}"] if row["by hand"] else []
    return "; ".join([*parts, row["remarks"]] if row["remarks"] else parts)


def _write_table(path: Path, rows: list[dict[str, Any]]) -> Path:
    columns: dict[str, None] = {}
    for row in sorted(rows, key=len, reverse=True):
        columns |= dict.fromkeys(row)
    text = io.StringIO(newline="")
    table = csv.DictWriter(text, list(columns), lineterminator="\n")
    table.writeheader()
    table.writerows(rows)
    part = path.with_suffix(".part")
    part.write_text(text.getvalue(), encoding="utf-8-sig", newline="")  # as Excel wants it
    part.replace(path)
    return path


def grade_all(names: Iterable[str], assignments: Path) -> list[Path]:
    """Grade sets one after the other."""
    chosen = list(names) or sets_submitted(assignments)
    if not chosen:
        raise ValueError("There are no submissions: submitted/STUDENT/ps1/ps1.ipynb")
    tables = []
    for name in chosen:
        print(f"{name}:", flush=True)
        tables.append(grade(name, assignments))
        print(tables[-1])
    return tables


def main() -> None:
    """Grade from the command line: ``python -m rbcourse.assignments.grade ps1``, in the course."""
    parser = argparse.ArgumentParser(prog="python -m rbcourse.assignments.grade")
    parser.add_argument("sets", nargs="*", metavar="set", help="as ps1; all that are submitted")
    try:
        grade_all(parser.parse_args().sets, Path("notebooks", "assignments"))
    except (OSError, ValueError) as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main()
