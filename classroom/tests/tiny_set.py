"""A problem set as a teacher writes it: two small problems, and one question in words."""

import re
from pathlib import Path

import nbformat
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook

from rbclassroom.course.notebooks import KERNEL

ANSWERS = {"square-answer": "def square(x):\n    return x * x", "half-answer": "half = 0.5"}


def cell(notebook, grade_id):
    names = [
        marks.get("nbgrader", {}).get("grade_id") for marks in (c.metadata for c in notebook.cells)
    ]
    return notebook.cells[names.index(grade_id)]


def answered(released, change=None, **answers):
    """Return the set with the given answers, and with right answers to the other questions."""
    notebook = nbformat.reads(released, as_version=4)
    given = {f"{name}-answer": text for name, text in answers.items()}
    for name, text in (ANSWERS | {"words-answer": "It is."} | given).items():
        cell(notebook, name).source = text
    if change:
        change(notebook)
    return notebook


def marked(cell, grade_id, points=None, **kind):
    marks = {"schema_version": 3, "grade_id": grade_id, "locked": True, "grade": False}
    marks |= {"solution": False, "task": False, "cell_type": cell.cell_type, **kind}
    cell.metadata["nbgrader"] = marks | ({} if points is None else {"points": points})
    cell.id = grade_id
    return cell


def _answer(source, grade_id):
    head, body = re.fullmatch(r"(def .*\n)?([^\0]*)", source).groups(default="")
    text = f"{head}{'    ' * bool(head)}### BEGIN SOLUTION\n{body}\n### END SOLUTION"
    return marked(new_code_cell(text), grade_id, locked=False, solution=True)


def _tests(visible, hidden, grade_id, points):
    text = f"{visible}\n### BEGIN HIDDEN TESTS\n{hidden}\n### END HIDDEN TESTS"
    return marked(new_code_cell(text), grade_id, points, grade=True)


def write_tiny_set(assignments: Path, name: str = "ps0") -> Path:
    """Write the set into the folder of assignments; return its path."""
    words = "Like signs.\n\n**Mark scheme** One point for the sign of a product."
    cells = [
        marked(new_markdown_cell("# A tiny set"), "title"),
        marked(new_code_cell("import math"), "imports"),
        _answer(ANSWERS["square-answer"], "square-answer"),
        _tests("assert square(2) == 4, 'times itself'", "assert square(-3) == 9", "square-test", 2),
        _answer(ANSWERS["half-answer"], "half-answer"),
        _tests("assert half < 1", "assert math.isclose(half, 0.5)", "half-test", 1),
        marked(new_markdown_cell("Why is a square never negative?"), "words-question"),
        marked(
            new_markdown_cell(f"### BEGIN SOLUTION\n{words}\n### END SOLUTION"),
            "words-answer",
            points=3,
            locked=False,
            grade=True,
            solution=True,
        ),
    ]
    notebook = new_notebook(cells=cells)
    notebook.metadata.kernelspec = dict(KERNEL)
    path = assignments / "source" / name / f"{name}.ipynb"
    path.parent.mkdir(parents=True)
    path.write_text(nbformat.writes(notebook), encoding="utf-8")
    return path
