"""Compare a problem set with the original, cell by cell, and restore what must not change.

Cells are told apart as nbgrader does, by their grade_id, but without it: students do not have it.
"""

import copy
import re
import uuid
from typing import Any

import nbformat
from nbformat import NotebookNode


def marks_of(cell: NotebookNode) -> dict[str, Any]:
    """Return what nbgrader has written into a cell."""
    marks = cell.metadata.get("nbgrader")
    return marks if isinstance(marks, dict) else {}


def grade_id(cell: NotebookNode) -> str:
    """Return the name by which nbgrader knows a cell."""
    return str(marks_of(cell).get("grade_id") or "")


def is_test(cell: NotebookNode) -> bool:
    """Tell whether a cell holds tests."""
    marks = marks_of(cell)
    return bool(cell.cell_type == "code" and marks.get("grade") and not marks.get("solution"))


def name_cell(cells: list[NotebookNode], at: int, number: bool = True) -> str:
    """Return words by which a person finds a cell."""
    cell = cells[at]
    kind = "answer" if marks_of(cell).get("solution") else "test" if is_test(cell) else "locked"
    headings = [
        match[1].strip()
        for above in cells[: at + 1]
        if above.cell_type == "markdown"
        for match in re.finditer(r"^#+\s+(.+)", above.source, re.MULTILINE)
    ]
    place = [f"cell {at + 1}"] * number + [f"after the heading '{h}'" for h in headings[-1:]]
    words = f"{kind} cell '{grade_id(cell)}'" if grade_id(cell) else "cell without a name"
    return f"the {words} ({', '.join(place)})" if place else f"the {words}"


def mend(notebook: NotebookNode, original: NotebookNode) -> list[str]:
    """Put the locked cells of a notebook back as they were, and say what was done."""
    cells, wanted = notebook.cells, {grade_id(c): c for c in original.cells if grade_id(c)}
    ids = {grade_id(cell) for cell in cells} - {""}
    if len(ids & set(wanted)) <= len(ids - set(wanted)):
        raise ValueError(
            "the cells are not those of this problem set; check that this is the right file, and "
            "that it is the notebook handed out, not a new one"
        )
    remarks = [
        f"cell {at} still has merge marks, <<<<<<< and >>>>>>>; resolve them"
        for at, cell in enumerate(cells, 1)
        if re.search(r"^(<{7}|>{7}) ", cell.source, re.MULTILINE)
    ]
    remarks += _drop_extra_marks(cells, wanted)
    for at, cell in enumerate(cells):
        if grade_id(cell):
            remarks += _put_back(cells, at, original.cells)
    remarks += _add_missing(cells, original.cells)
    there = [grade_id(cell) for cell in cells if grade_id(cell)]
    if there != [name for name in wanted if name in there]:
        remarks.append("cells with names are not in the order of the original; this is left so")
    used: set[str] = set()
    for cell in cells:
        if cell.get("id") in used | {None}:
            cell.id = uuid.uuid4().hex[:8]
        used.add(cell.id)
    notebook.nbformat_minor = max(5, notebook.nbformat_minor)
    return remarks


def _drop_extra_marks(cells: list[NotebookNode], wanted: dict[str, NotebookNode]) -> list[str]:
    """Make ordinary cells of copies; of several with a name nbgrader takes the last."""
    remarks: list[str] = []
    last = {grade_id(cell): at for at, cell in enumerate(cells)}
    for at, cell in enumerate(cells):
        name = grade_id(cell)
        if name and name not in wanted:
            remarks.append(
                f"cell {at + 1} has the name '{name}', which the set does not have; "
                "it is taken as a cell of your own"
            )
        elif name and last[name] != at:
            remarks.append(
                f"{name_cell(cells, at)} is there again as cell {last[name] + 1}, which "
                f"counts; cell {at + 1} is taken as a cell of your own"
            )
        else:
            continue
        for key in ("nbgrader", "editable", "deletable"):
            cell.metadata.pop(key, None)
    return remarks


def _put_back(cells: list[NotebookNode], at: int, original: list[NotebookNode]) -> list[str]:
    cell = cells[at]
    wanted = next(c for c in original if grade_id(c) == grade_id(cell))
    where = name_cell(cells, at)
    changes = _changes(cell, wanted)
    if not marks_of(wanted).get("solution"):
        if not changes and cell.source == wanted.source:
            return []
        cells[at] = _copy(wanted)
        changes = ["was changed"] * (cell.source != wanted.source) + changes
        return [f"{name_cell(cells, at)} {' and '.join(changes)}; it is put back as it was"]
    remarks = []
    if changes:
        remarks.append(f"{where} {' and '.join(changes)}; this is put back, your answer stays")
        cells[at] = _copy(wanted)
        cells[at].source = cell.source
    if cell.source.strip() in ("", wanted.source.strip()):
        remarks.append(f"{name_cell(cells, at)} is not answered yet")
    return remarks


def _copy(cell: NotebookNode) -> NotebookNode:
    return nbformat.from_dict(copy.deepcopy(dict(cell)))


def _changes(cell: NotebookNode, wanted: NotebookNode) -> list[str]:
    """Say what was changed of a cell beside its content."""
    old, new = marks_of(wanted), marks_of(cell)
    changes = []
    if cell.cell_type != wanted.cell_type:
        changes.append(f"was made a {cell.cell_type} cell")
    if old.get("points") != new.get("points"):
        changes.append(f"has other points ({new.get('points')}, not {old.get('points')})")
    if any(old.get(key) != new.get(key) for key in {*old, *new} - {"points", "cell_type"}):
        changes.append("has other marks for grading")
    if any(cell.metadata.get(k) != wanted.metadata.get(k) for k in ("editable", "deletable")):
        changes.append("was unlocked")
    return changes


def _add_missing(cells: list[NotebookNode], original: list[NotebookNode]) -> list[str]:
    remarks, before = [], ""
    for at, wanted in enumerate(original):
        name = grade_id(wanted)
        there = [grade_id(cell) for cell in cells]
        if name and name not in there:
            cells.insert(there.index(before) + 1 if before else 0, _copy(wanted))
            empty = ", not answered" if marks_of(wanted).get("solution") else ""
            where = name_cell(original, at, number=False)
            remarks.append(f"{where} was deleted; it is put back as it was{empty}")
        before = name or before
    return remarks
