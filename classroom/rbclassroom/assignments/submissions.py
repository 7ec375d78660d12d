"""Read a student's notebook, whatever program wrote it, and restore the problem set in it.

`read_notebook` makes a clean notebook from the types, texts and marks of the cells. `restore` finds
the cells of the set: by nbgrader's marks, by their ids, by their texts, and answers also by the
functions that they define or by their place. Then it restores the locked cells. A text of the
student in a locked cell gets a cell of its own. The check and the grading use these functions.
"""

import copy
import json
import re
import warnings
from collections import defaultdict
from typing import Any

from nbformat import NotebookNode
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook, new_raw_cell

from rbclassroom.assignments.locked_cells import grade_id, is_answer, marks_of, name_cell

MANY = 3  # more cells with the same change get one remark
ELSEWHERE = "# This answer is in another cell."
DAMAGE = ArithmeticError, AttributeError, LookupError, RecursionError, TypeError, ValueError
MAKE: dict[str, Any] = {"code": new_code_cell, "markdown": new_markdown_cell, "raw": new_raw_cell}


class Refused(ValueError):
    """A submission cannot be graded automatically; the message gives the reason."""


def read_notebook(content: bytes, name: str) -> NotebookNode:
    """Return the cells in a file as a clean notebook; raise `Refused` if the file has none.

    The file may have any version of the notebook format and any encoding of JSON. Outputs and
    unknown fields are left out. A half of a surrogate pair becomes "?".
    """
    if not content.strip():
        raise Refused(f"{name} is empty; take an earlier copy, or start again")
    if content.startswith((b"%PDF", b"PK")):
        raise Refused(f"{name} is a PDF or an archive, not a notebook; hand in the notebook")
    if name.lower().endswith(".py"):
        raise Refused(f"{name} is a script, not a notebook; hand in the notebook")
    try:
        try:
            found = json.loads(content, strict=False)
        except UnicodeDecodeError:  # some editors of Windows do not save in UTF-8
            found = json.loads(content.decode("cp1252", "replace"), strict=False)
        sheets = found.get("worksheets") or [found]  # versions 2 and 3 have worksheets
        cells = [_clean(raw) for sheet in sheets for raw in sheet["cells"]]
        if not cells:
            raise ValueError("it has no cells")
    except DAMAGE as error:
        cure = "take an earlier copy, or start again from the handout"
        if b"\n<<<<<<< " in content:
            raise Refused(f"{name} has conflicts of a merge in git (<<<<<<<); {cure}") from error
        why = str(error) if isinstance(error, ValueError) else f"{type(error).__name__}: {error}"
        if isinstance(error, json.JSONDecodeError):
            why = f"it stops being JSON in line {error.lineno}"
        raise Refused(f"{name} is damaged or not a notebook ({why[:80]}); {cure}") from error
    for at, cell in enumerate(cells):
        cell.id = f"read-{at}"
    return new_notebook(cells=cells)


def _clean(raw: dict[str, Any]) -> NotebookNode:
    kind = raw.get("cell_type") or ("code" if "outputs" in raw else "markdown")
    text = raw.get("source", raw.get("input")) or ""  # version 3 has "input"
    if isinstance(text, list):  # some programs leave out the ends of the lines
        text = ("" if any("\n" in line for line in text) else "\n").join(text)
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    if kind == "heading":  # in version 3
        text = f"{'#' * raw['level']} {text}"
    cell = MAKE.get(kind, new_markdown_cell)(text.encode("utf-8", "replace").decode())
    about, attached = raw.get("metadata") or {}, raw.get("attachments") or {}
    pictures = {name: each for name, each in attached.items() if isinstance(each, dict)}
    # Colab writes the id into the metadata
    cell.metadata.ids = [str(each["id"]) for each in (raw, about) if "id" in each]
    cell.metadata.damaged = text != cell.source
    if isinstance(about.get("nbgrader"), dict):
        cell.metadata.nbgrader = NotebookNode(about["nbgrader"])
    if pictures and cell.cell_type != "code":
        cell.attachments = NotebookNode(pictures)
    return cell


def restore(notebook: NotebookNode, original: NotebookNode) -> list[str]:
    """Restore the cells of a set in a student's notebook, and return remarks on the changes.

    Answers keep their texts, and all cells keep the student's order. Raise `Refused` if less than
    half of the set is there, and most marks are lost or belong to another set; an answer is there
    if a cell defines its function.
    """
    work = _Restoring(notebook.cells, original)
    foreign = work.find()
    named, found, size = work.names(), len(work.present()), len(work.wanted)
    marked = len({*named} & work.wanted.keys()) - work.unmarked
    if marked <= foreign and 2 * found < size:
        cure = "copy your answers into a new copy of the notebook that was handed out"
        raise Refused(f"only {found} of the {size} cells are those of this problem set; {cure}")
    work.join_rest()
    for step in (work.join_copies, work.put_back, work.complete):
        for name in work.wanted:
            step(name)
    work.find_second_definitions()
    return work.finish()


def count_found(notebook: NotebookNode, original: NotebookNode) -> int:
    """Return how many cells of a set are found in a notebook by mark, id or text."""
    work = _Restoring(copy.deepcopy(notebook.cells), original)
    work.find()
    return len({*work.names()} & work.wanted.keys())


def count_written(notebook: NotebookNode) -> int:
    """Return the number of cells, without the answers that are as they were handed out."""
    blank = re.compile(r"raise NotImplementedError|^\s*YOUR ANSWER HERE\s*$")
    return sum(not re.search(blank, cell.source) for cell in notebook.cells)


def _core(text: str) -> str:
    """Return a text without white space and without a line "# %%"; editors change them."""
    return "".join(re.sub(r"\A\s*# ?%%.*", "", text).split())


def _around(text: str, locked: str) -> list[str]:
    """Return the parts of a text before and after a locked text, or [] if it is not there."""
    lines = [line.rstrip() for line in text.split("\n")]
    wanted = [line.rstrip() for line in locked.strip().split("\n")]
    for at in range(len(lines)):
        if any(wanted) and lines[at : at + len(wanted)] == wanted:
            return ["\n".join(part).strip("\n") for part in (lines[:at], lines[at + len(wanted) :])]
    return []


def _lines(cell: NotebookNode) -> set[str]:
    return {line.strip() for line in cell.source.split("\n")} - {""}


def _defines(cell: NotebookNode, given: NotebookNode) -> bool:
    """Tell whether a cell defines a function or class of an answer that was handed out."""
    names = re.findall(r"^(?:def|class) +(\w+)", given.source, re.MULTILINE)
    forms = r"^[ \t]*(?:async[ \t]+)?(?:def|class)[ \t]+{0}\b|^{0}[ \t]*=(?!=)"
    return any(re.search(forms.format(name), cell.source, re.MULTILINE) for name in names)


def _is_code(text: str) -> bool:
    """Tell whether a text is complete Python; lines for IPython count as Python."""
    try:
        with warnings.catch_warnings(action="ignore"):  # as for "\\d" in a text
            compile(re.sub(r"^([ \t]*)[%!].*", r"\1pass", text, flags=re.MULTILINE), "", "exec")
    except (MemoryError, RecursionError, SyntaxError, ValueError):
        return False
    return True


def _fill(target: NotebookNode, cells: list[NotebookNode], gap: str = "\n\n") -> None:
    """Give the texts and the pictures of some cells to a cell."""
    texts, pictures = [], dict[str, Any]()
    for at, cell in enumerate(cells):
        text = cell.source
        for name, picture in cell.get("attachments", {}).items():
            own = f"{at}-{name}" if pictures.get(name, picture) != picture else name
            pictures[own], text = picture, text.replace(f"attachment:{name}", f"attachment:{own}")
        texts.append(text)
    target.source = gap.join(texts)
    target.metadata.damaged = any(cell.metadata.get("damaged") for cell in cells)
    if pictures and target.cell_type != "code":
        target.attachments = NotebookNode(pictures)


class _Restoring:
    """A student's cells; during the restoration those of the set have their names as marks."""

    def __init__(self, cells: list[NotebookNode], original: NotebookNode) -> None:
        self.cells = cells
        self.wanted = {grade_id(cell): cell for cell in original.cells if grade_id(cell)}
        self.changes = list[tuple[str, str]]()  # the name or the id of a cell, and its change
        self.unmarked = 0  # the number of cells that have lost their marks

    def names(self) -> list[str]:
        return [grade_id(cell) for cell in self.cells]

    def present(self) -> set[str]:
        """Return the names of the cells that are there, and of answers whose function is there."""
        rest = [cell for cell in self.cells if not grade_id(cell)]
        answers = {name: cell for name, cell in self.wanted.items() if is_answer(cell)}
        written = {name for name, a in answers.items() if any(_defines(cell, a) for cell in rest)}
        return ({*self.names()} & self.wanted.keys()) | written

    def place(self, cell: NotebookNode) -> int:
        return next(at for at, each in enumerate(self.cells) if each is cell)

    def is_empty(self, cell: NotebookNode) -> bool:
        """Tell whether a cell of the set has no other text than the original."""
        given = self.wanted[grade_id(cell)].source.replace("# YOUR CODE HERE", "")
        return _core(cell.source.replace("# YOUR CODE HERE", "")) in ("", _core(given))

    def find(self) -> int:
        """Name the cells of the set by mark, id or text; return the number of other names."""
        foreign = {*self.names()} - self.wanted.keys() - {""}
        ids = {given.id: [name] for name, given in self.wanted.items()}
        texts = defaultdict[str, list[str]](list)
        for name, given in self.wanted.items():
            texts[_core(given.source)].append(name)
        by_id = [(cell, ids.get(own, [])) for cell in self.cells for own in cell.metadata.ids]
        by_text = [(cell, texts.get(_core(cell.source), [])) for cell in self.cells]
        for cell, names in by_id + by_text:
            new = [name for name in names if name not in self.names()]
            if new and not grade_id(cell):
                cell.metadata.nbgrader = NotebookNode(grade_id=new[0])
                self.unmarked += 1
        for cell in self.cells:
            if grade_id(cell) in foreign:
                cell.metadata.nbgrader = NotebookNode()
        return len(foreign)

    def join_rest(self) -> None:
        """Join an added cell that begins in the middle of a function with the cell above."""
        for cell in reversed(self.cells[1:]):
            above = self.cells[self.place(cell) - 1]
            name = grade_id(above)
            free = not grade_id(cell) and (not name or is_answer(self.wanted[name]))
            begun = re.match(r"\n*[ \t]+\S", cell.source)
            code = above.cell_type == cell.cell_type == "code"
            if free and begun and code and _is_code(f"{above.source}\n{cell.source}"):
                _fill(above, [above, cell], "\n")
                del self.cells[self.place(cell)]
                self.changes.append((name or above.id, "was split; its parts are joined"))

    def join_copies(self, name: str) -> None:
        """Let one cell have each name: a split cell is joined, and of copies the last one counts.

        Copies without a text of the student are left out, and the others become added cells.
        """
        copies = [cell for cell in self.cells if grade_id(cell) == name]
        if len(copies) < 2:
            return
        given, order = self.wanted[name], list(self.wanted)
        above = order[: order.index(name)][-1:]  # the name of the cell above, in the original
        filled = [cell for cell in copies if not self.is_empty(cell)]
        same = [cell for cell in filled if cell.cell_type == given.cell_type] or filled
        liked = [cell for cell in same if _defines(cell, given)]
        liked = liked or [cell for cell in same if self.names()[: self.place(cell)][-1:] == above]
        best = (liked or same or copies)[-1]
        if not is_answer(given) and len(filled) < len(copies):
            best = [cell for cell in copies if self.is_empty(cell)][-1]  # it was not changed
        elif self.are_parts(same, given) and len(same) == len(filled):
            _fill(best, same, "\n")
            self.changes.append((name, "was split; its parts are joined"))
            filled = [best]
        for cell in copies:
            if cell is best:
                continue
            if cell in filled:
                cell.metadata.nbgrader = NotebookNode()
                self.changes.append((cell.id, "is a copy; another one counts"))
            else:
                del self.cells[self.place(cell)]

    def are_parts(self, cells: list[NotebookNode], given: NotebookNode) -> bool:
        """Tell whether cells are the parts of one cell, and not copies of it."""
        near = cells and self.place(cells[-1]) - self.place(cells[0]) < len(cells)
        again = any(_defines(cell, given) for cell in cells[1:])
        text = "\n".join(cell.source for cell in cells)
        sound = given.cell_type != "code" or not is_answer(given) or _is_code(text)
        return bool(near and len(cells) > 1 and not again and sound)

    def put_back(self, name: str) -> None:
        """Restore a cell that is there; the student's text in a locked cell becomes added cells."""
        if name not in self.names():
            return
        cell, given = self.cells[self.names().index(name)], self.wanted[name]
        kept, before, after = copy.deepcopy(given), "", ""
        if is_answer(given):
            _fill(kept, [cell])
        elif not self.is_empty(cell) and not _lines(cell) <= _lines(given):
            before, after = _around(cell.source, given.source) or (cell.source, "")
        own, marks = ({**marks_of(each), "cell_type": ""} for each in (cell, given))
        changes = {
            "was changed": not is_answer(given) and _core(cell.source) != _core(given.source),
            f"was made a {cell.cell_type} cell": cell.cell_type != given.cell_type,
            "has other points or marks": len(own) > 2 and own != marks,
        }
        at, added = self.place(cell), list[list[NotebookNode]]()
        for text in (before, after):
            own_cell = MAKE[cell.cell_type]()
            _fill(own_cell, [NotebookNode(cell, source=text)])
            added.append([own_cell] if text else [])
        self.cells[at : at + 1] = [*added[0], kept, *added[1]]
        if what := " and ".join(change for change, made in changes.items() if made):
            saved = ", and its other text is in an added cell" * bool(before or after)
            self.changes.append((name, f"{what}; it is restored{saved}"))

    def complete(self, name: str) -> None:
        """Insert a cell that is missing; find the text of an answer that is missing or empty."""
        given, there = self.wanted[name], name in self.names()
        old = self.cells[self.names().index(name)] if there else None
        if old and not (is_answer(given) and self.is_empty(old)):
            return
        if not is_answer(given):
            self.cut_out(given.source)
        new, names, order = copy.deepcopy(given), self.names(), list(self.wanted)
        before, after = order[: order.index(name)][-1:], order[order.index(name) + 1 :][:1]
        above = names.index(before[0]) if before else -1
        below = next((k for k in range(above + 1, len(names)) if names[k] not in ("", name)), None)
        end = names.index(after[0]) if after and after[0] in names else None
        gap = self.cells[above + 1 : below]
        found = self.search(given, gap) if is_answer(given) else []
        if found:
            _fill(new, found)
            lost = "was found by its function or its place"
            self.changes.append((name, "has the text of an added cell" if old else lost))
        elif any(_defines(cell, given) for cell in self.cells[:end] if cell is not old):
            new.source = ELSEWHERE
            self.changes.append((name, "is empty; another cell has its function"))
        elif not old:
            self.changes.append((name, "was missing; it is restored"))
        if found and any(found[-1] is cell for cell in gap):
            place = self.place(found[-1])
        elif old:
            place = self.place(old)
        elif before and below and names[below : below + 1] == after and not is_answer(given):
            place = below
        else:
            place = above + 1
        self.cells.insert(place, new)
        for cell in [*found, *([old] if old else [])]:
            del self.cells[self.place(cell)]

    def cut_out(self, locked: str) -> None:
        """Remove a locked text from the answers and the added cells, with which it was merged."""
        for cell in self.cells:
            parts = _around(cell.source, locked)
            if parts and (is_answer(cell) or not grade_id(cell)):
                cell.source = "\n\n".join(filter(None, parts))

    def search(self, given: NotebookNode, gap: list[NotebookNode]) -> list[NotebookNode]:
        """Return the added cells that make up an answer, whose place is in `gap`."""
        own = [cell for cell in self.cells if not grade_id(cell) and cell.source.strip()]
        near = [cell for cell in own if any(cell is each for each in gap)]
        kinds = [[c for c in cells if c.cell_type == given.cell_type] for cells in (near, own)]
        if "def " not in given.source and "class " not in given.source:
            return kinds[0] or [cell for cell in near if cell.cell_type == "raw"]
        fits = [[c for c in cells if _defines(c, given)] for cells in (*kinds, near, own)]
        return next((cells[-1:] for cells in fits if cells), [])

    def find_second_definitions(self) -> None:
        """Note added cells that define the function of an answer again, below its test."""
        noted, above, tested = {name for name, _ in self.changes}, [], list[NotebookNode]()
        for cell in self.cells:
            given = self.wanted.get(grade_id(cell))
            if given and is_answer(given):
                above.append(given)
            elif given and given.cell_type == "code":
                tested, above = tested + above, []
            again = cell.cell_type == "code" and any(_defines(cell, each) for each in tested)
            if again and not given and cell.id not in noted:
                why = "defines the function of an answer again, below its test"
                self.changes.append((cell.id, f"{why}; put it into the answer"))

    def finish(self) -> list[str]:
        """Set the metadata of added cells, and return the remarks."""
        lost = f"{self.unmarked} cells have lost the marks of nbgrader; ids and texts identify them"
        remarks, grouped = [lost] * bool(self.unmarked), defaultdict[str, list[int]](list)
        for cell in self.cells:
            if cell.metadata.pop("damaged", False):
                why = "has a damaged letter, which is replaced by “?”"
                self.changes.append((grade_id(cell) or cell.id, why))
        for name, what in self.changes:
            same = (at for at, each in enumerate(self.cells) if name in (grade_id(each), each.id))
            grouped[what] += [*same][:1]  # an added cell can have become a part of an answer
        for what, places in grouped.items():
            numbers = ", ".join(str(at + 1) for at in sorted(places))
            if len(places) > MANY:
                remarks.append(f"cells {numbers}: each {what}")
            else:
                remarks += [f"{name_cell(self.cells, at)} {what}" for at in places]
        if [*filter(None, self.names())] != list(self.wanted):
            remarks.append("cells are not in the order of the original; they are run in your order")
        for at, cell in enumerate(self.cells):
            if not grade_id(cell):
                cell.id, cell.metadata = f"added-{at}", NotebookNode()
        return remarks
