"""Read a problem set, and restore the locked cells from the original.

The check and the grading use the same functions. Cells are identified by their grade_id, as in
nbgrader. The module does not import nbgrader, because students do not have it.
"""

import copy
import logging
import re
import uuid
import warnings
from typing import Any

import nbformat
from nbformat import NotebookNode


class Refused(ValueError):
    """A submission cannot be graded automatically; the message gives the reason."""


def decode(content: bytes) -> str:
    """Return the text of a file in UTF-8 or, with a byte order mark, in UTF-16."""
    marked = content.startswith((b"\xff\xfe", b"\xfe\xff"))
    return content.decode("utf-16" if marked else "utf-8-sig")


def read_notebook(content: bytes, name: str) -> NotebookNode:
    """Return the notebook in a file; raise `Refused` with a remedy if it cannot be read."""
    if not content.strip():
        raise Refused(f"{name} is empty; open it in JupyterLab and save it, or start again")
    if content.startswith((b"%PDF", b"PK")):
        raise Refused(f"{name} is a PDF or an archive, not a notebook; hand in the notebook")
    logging.disable()  # nbformat warns about missing ids, which `restore` adds
    try:
        with warnings.catch_warnings(action="ignore"):
            notebook = nbformat.reads(decode(content), as_version=4)
            nbformat.validate(notebook)
        if not notebook.cells:
            raise ValueError("it has no cells")
    except Exception as error:  # nbformat raises many kinds of errors
        why = (str(error).splitlines() or [type(error).__name__])[0][:80]
        cure = "take an earlier copy, or open it in JupyterLab and save it again"
        raise Refused(f"{name} is damaged or not a notebook ({why}); {cure}") from error
    finally:
        logging.disable(logging.NOTSET)
    return notebook


def marks_of(cell: NotebookNode) -> dict[str, Any]:
    """Return the metadata of nbgrader in a cell."""
    marks = cell.metadata.get("nbgrader")
    return marks if isinstance(marks, dict) else {}


def grade_id(cell: NotebookNode) -> str:
    """Return the name that nbgrader gives to a cell."""
    return str(marks_of(cell).get("grade_id") or "")


def is_answer(cell: NotebookNode) -> bool:
    """Tell whether a cell holds an answer of the student."""
    return bool(marks_of(cell).get("solution"))


def is_test(cell: NotebookNode) -> bool:
    """Tell whether a cell holds tests."""
    return bool(cell.cell_type == "code" and marks_of(cell).get("grade") and not is_answer(cell))


def title_of(cells: list[NotebookNode], at: int) -> str:
    """Return the last heading in or above a cell; headings of the student do not count."""
    given = [c for c in cells[: at + 1] if c.cell_type == "markdown" and not is_answer(c)]
    text = "\n".join(cell.source for cell in given if grade_id(cell))
    return (re.findall(r"^#+\s+(.+?)\s*$", text, re.MULTILINE) or [""])[-1]


def name_cell(cells: list[NotebookNode], at: int) -> str:
    """Describe a cell by its number, kind and title."""
    cell, title = cells[at], title_of(cells, at)
    given = "answer" if is_answer(cell) else "test" if is_test(cell) else "locked cell"
    kind = given if grade_id(cell) else "added cell"
    return f"cell {at + 1}, {kind}" + f" of “{title}”" * bool(title)


def restore(notebook: NotebookNode, original: NotebookNode) -> list[str]:
    """Restore the locked cells of a notebook, and return a remark for each change.

    Answers are not changed. If several cells have the same name, the last one counts, and the
    others become cells of the student. Cells of the student lose their metadata, which could
    prevent a run.
    """
    cells, wanted = notebook.cells, {grade_id(c): c for c in original.cells if grade_id(c)}
    last = {grade_id(cell): at for at, cell in enumerate(cells) if grade_id(cell)}
    if len(last.keys() & wanted.keys()) <= len(last.keys() - wanted.keys()):
        why = "the cells are not those of this problem set"
        raise Refused(f"{why}; check that this is the notebook handed out, not a new one")
    remarks = []
    for at, cell in enumerate(cells):
        name = grade_id(cell)
        if name in wanted and last[name] == at:
            remarks += _put_back(cells, at, wanted[name])
            continue
        if name in wanted:
            counts = f"cell {last[name] + 1} has the same name, and counts"
            remarks.append(f"{name_cell(cells, at)}: {counts}")
        cell.metadata = NotebookNode()
    above = -1
    for name, missing in wanted.items():
        if name not in map(grade_id, cells):
            cells.insert(above + 1, copy.deepcopy(missing))
            remarks.append(f"{name_cell(cells, above + 1)} was missing; it is restored")
        above = [grade_id(cell) for cell in cells].index(name)
    if [grade_id(cell) for cell in cells if grade_id(cell)] != list(wanted):
        remarks.append("cells are not in the order of the original; they are run in your order")
    used = {""}
    for cell in cells:
        if cell.get("id", "") in used:
            cell.id = uuid.uuid4().hex[:8]
        used.add(cell.id)
        if cell.cell_type == "code":
            cell.outputs, cell.execution_count = [], None
    notebook.nbformat_minor = max(5, notebook.nbformat_minor)
    return remarks


def _put_back(cells: list[NotebookNode], at: int, wanted: NotebookNode) -> list[str]:
    cell, kept = cells[at], copy.deepcopy(wanted)
    own, given = ({**marks_of(c), "cell_type": ""} for c in (cell, wanted))
    locks = [[c.metadata.get(key) for key in ("editable", "deletable")] for c in (cell, wanted)]
    changes = {
        "was changed": not is_answer(wanted) and cell.source != wanted.source,
        f"was made a {cell.cell_type} cell": cell.cell_type != wanted.cell_type,
        "has other points or marks": own != given,
        "was unlocked": locks[0] != locks[1],
    }
    if is_answer(wanted):
        kept.source = cell.source
        if cell.get("attachments") and kept.cell_type == "markdown":
            kept.attachments = cell.attachments
    cells[at] = kept
    what = " and ".join(change for change, made in changes.items() if made)
    return [f"{name_cell(cells, at)} {what}; it is restored"] if what else []
