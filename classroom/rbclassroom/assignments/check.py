"""Check a problem set, report changed cells and errors, and write the file to submit.

Students run this module before they submit. It does not need nbgrader.
"""

import io
import logging
import os
import re
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import nbformat
from nbclient.exceptions import CellTimeoutError, DeadKernelError
from nbformat import NotebookNode

from rbclassroom.assignments import locked_cells
from rbclassroom.assignments.locked_cells import grade_id, is_answer, is_test, name_cell
from rbclassroom.assignments.my_motion import FILE, find, keep
from rbclassroom.assignments.notebook_runner import CELL_SECONDS, CUT, BoundedClient
from rbclassroom.assignments.submissions import count_found, read_notebook, restore
from rbclassroom.course import options
from rbclassroom.course.notebooks import KERNEL
from rbcourse.files import replace_file

HANDED = "to_submit"
"""The folder of the file to hand in, beside the notebook."""


def check(path: Path, seconds: int = CELL_SECONDS) -> Path:
    """Compare a problem set with its original, run it, and write the file to submit.

    The file to submit has the locked cells of the original. As in grading, the notebook runs in a
    folder with the files of the set only, but with the student's functions of earlier sets. The
    functions that pass are added to ``my_motion.py``, beside the folder of the set.
    """
    if path.is_dir() and (path / f"{path.name}.ipynb").is_file():
        path = path / f"{path.name}.ipynb"
    if not path.is_file():
        raise ValueError(f"{path} is not a file; give the path of your notebook")
    if path.parent.name == HANDED:
        raise ValueError(f"{path} is a file to hand in; check the notebook in {path.parents[1]}")
    notebook = read_notebook(path.read_bytes(), path.name)
    name, files = _find_set(notebook, path.parent)
    original = nbformat.reads(files.pop(name).decode(), as_version=4)
    saved = time.strftime("%Y-%m-%d %H:%M", time.localtime(path.stat().st_mtime))
    known = not saved.startswith("1980")  # the date of files in handouts
    print(f"checking {path.name}" + f", last saved {saved}" * known, flush=True)
    count = len(notebook.cells)
    remarks = restore(notebook, original)
    if path.name != name:
        print(f"the file to hand in gets the name {name}")
    where = "as JupyterLab does at the bottom of its window"
    if len(notebook.cells) != count:
        where = f"in {HANDED}/{name}, where damaged cells are restored"
    print(f"cell numbers count all cells, {where}")
    notebook.metadata = NotebookNode({"kernelspec": dict(KERNEL)})
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as own:
        work = Path(own, "work")
        work.mkdir()
        for file, content in files.items():
            (work / file).parent.mkdir(parents=True, exist_ok=True)
            replace_file(work / file, content)
        if (mine := find(path.parent, Path(name).stem)).is_file():
            replace_file(Path(own, FILE), mine.read_bytes())
        remarks += _run(notebook, Path(own), seconds)
    print("".join(f"- {what}\n" for what in remarks), end="")
    passed = _print_problems(notebook, original)
    nbformat.validate(notebook)
    content = (nbformat.writes(notebook) + "\n").encode()
    target = path.parent / HANDED / name
    target.parent.mkdir(exist_ok=True)
    replace_file(target, content)
    print(f"{sum(passed)} of {len(passed)} visible tests passed; hidden tests run in grading")
    stem = name.removesuffix(".ipynb")
    _keep(notebook, stem, files.get(f"{stem}.json", b"{}"), path.parent)
    print(f"check again after each change; the file to hand in is {target}")
    return target


def _find_set(notebook: NotebookNode, folder: Path) -> tuple[str, dict[str, bytes]]:
    """Return the name of the original of a notebook, and the files of its set as handed out.

    The files are in the folder ``original`` of a handout, beside the notebook or in the current
    folder, or the course in the current folder makes them.
    """
    for place in (folder / "original", Path("original")):
        if names := sorted(path.name for path in place.glob("*.ipynb")):
            if len(names) > 1:
                raise ValueError(f"{place} has several notebooks; unpack the handout again")
            paths = [path for path in place.rglob("*") if path.is_file()]
            return names[0], {p.relative_to(place).as_posix(): p.read_bytes() for p in paths}
    course = Path("notebooks", "assignments")
    sources = [path for path in course.glob("*/*/*.ipynb") if path.stem == path.parent.name]
    try:
        from rbclassroom.assignments.handout import release  # this needs nbgrader
    except ImportError:
        sources = []
    if not sources:
        missing = "the folder original of the handout is missing beside the notebook"
        raise ValueError(f"{missing}; unpack the handout again, and work in its folder")
    shared = {path: count_found(notebook, nbformat.read(path, 4)) for path in sources}
    best = max(sources, key=lambda path: shared[path])
    return best.name, release(best.stem, course)


def _keep(notebook: NotebookNode, name: str, data: bytes, folder: Path) -> None:
    """Write the accepted functions of a set to the student's file."""
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    kept = [c for c in code if is_answer(c) or is_test(c) or grade_id(c) in ("", "setup")]
    own = [(grade_id(c), "" if is_test(c) else c.source) for c in kept]
    tests = [grade_id(c) for c in code if is_test(c) and c.execution_count and not _error(c)]
    mine = find(folder, name)
    if not all(cell.execution_count for cell in code if is_test(cell) and cell.source.strip()):
        print(f"{FILE} is not changed, because some tests were not run")
        return
    try:
        text = mine.read_text("utf-8-sig") if mine.is_file() else ""
        passed = [test.removesuffix("-test") for test in tests]
        new, said = keep(text, name, data.decode(), own, passed)
        if new != text:
            if text:
                replace_file(mine.with_suffix(".before.py"), text.encode())
            replace_file(mine, new.encode())
    except (OSError, ValueError) as error:
        said = f"{FILE} is not changed: {error}"
    if said:
        print(f"{said} ({mine})")


class _Client(BoundedClient):
    at, began, took = 0, 0.0, dict[int, float]()

    def on_cell_start(self, cell: NotebookNode, cell_index: int) -> None:
        self.at, self.began = cell_index, time.monotonic()
        print(f"\rrunning cell {self.at + 1} of {len(self.nb.cells)} ", end="", flush=True)

    def on_cell_executed(self, cell: NotebookNode, cell_index: int, execute_reply: Any) -> None:
        super().on_cell_executed(cell, cell_index, execute_reply)
        self.took = self.took | {cell_index: time.monotonic() - self.began}


def _run(notebook: NotebookNode, own: Path, seconds: int) -> list[str]:
    """Run all cells; return remarks on errors outside answers and tests."""
    log = logging.getLogger(__name__)
    log.setLevel(logging.CRITICAL + 1)  # this module reports the errors itself
    cells, ends = notebook.cells, list[str]()
    client = _Client(notebook, log=log, kernel_name=KERNEL["name"], timeout=seconds)
    client.folder, client.resources = own, {"metadata": {"path": str(own / "work")}}
    try:
        client.execute(env={**os.environ, "IPYTHONDIR": str(own)})
    except (DeadKernelError, CellTimeoutError) as error:
        if isinstance(error, DeadKernelError):
            why = "the code called exit, or used up the memory"
            cure = "correct this cell, because grading gives no points to a file whose Python ends"
            ends.append(f"the kernel died in cell {client.at + 1}: {why}; {cure}")
        cells[client.at].execution_count = None
        ends.append(f"the cells after cell {client.at + 1} were not run")
    except (OSError, RuntimeError, KeyError) as error:
        why = f"Python could not be started, or stopped ({error})"
        raise ValueError(f"{why}; install requirements.txt of the handout again") from error
    print(flush=True)
    near = f" took more than half of the {seconds} s that grading allows: make it faster"
    slow = {at for at, took in client.took.items() if took > seconds / 2} - {*client.slow}
    faults = [(at, f" took longer than {seconds} s and was stopped") for at in client.slow]
    faults += [(at, near) for at in sorted(slow)] + [(at, f": {CUT}") for at in client.cut]
    for at, cell in enumerate(cells):
        last, in_problem = _error(cell), is_test(cell) or is_answer(cell)
        if last and not (in_problem or at in client.slow or last == "NotImplementedError"):
            faults.append((at, f" fails: {last}"))  # an empty answer is reported below
    return ends + [f"{name_cell(cells, at)}{fault}" for at, fault in faults]


def _error(cell: NotebookNode) -> str:
    errors = [o for o in cell.get("outputs", []) if o.output_type == "error"]
    if not errors:
        return ""
    lines = re.sub(r"\x1b\[[0-9;]*m", "", errors[-1].evalue).strip().splitlines() or [""]
    hint = lines[-1] and errors[-1].ename == "NotYet"  # show a hint without the name of its error
    return lines[-1][:400] if hint else f"{errors[-1].ename}: {lines[-1][:400]}".rstrip(": ")


def _print_problems(notebook: NotebookNode, original: NotebookNode) -> list[bool]:
    """Print the state of each problem; return True or False for each visible test."""
    empty = {grade_id(c): c.source.strip() for c in original.cells if is_answer(c)}
    problems: dict[str, list[tuple[str, str]]] = {}
    passed, answered, source, wrong = [], True, "", list[str]()
    missing = list[str]()  # names that the last answer should define
    code = (at for at, c in enumerate(notebook.cells) if c.cell_type == "code" and c.source.strip())
    ended = next((at for at in code if not notebook.cells[at].execution_count), -1)
    for at, cell in enumerate(notebook.cells):
        where = f"cell {at + 1}"
        error = _error(cell) or ("was not run to its end" if at == ended else "")
        found = problems.setdefault(locked_cells.title_of(notebook.cells, at), [])
        if is_answer(cell):
            source = cell.source
            answered = source.strip() not in ("", empty[grade_id(cell)])
            wanted = re.findall(r"^def (\w+)", empty[grade_id(cell)], re.MULTILINE)
            missing = [
                f"{where} must define {x}" for x in wanted if not re.search(rf"\b{x}\b", source)
            ]
            if not answered:
                found.append(("empty", f"{where} is not answered yet"))
            elif error:
                found.append(("fault", f"{where} {error}"))
            elif locked_cells.marks_of(cell).get("grade"):
                found.append(("words", f"{where} is graded by a person"))
        elif is_test(cell) and not re.search(r"^\s*[^#\s]", cell.source, re.MULTILINE):
            found.append(("hidden", f"{where} has hidden tests only"))
        elif is_test(cell):
            passed.append(not error and bool(cell.execution_count))
            if error:
                if hint := locked_cells.blame(source, wrong):
                    error += f" ({hint})"
                error += "".join(f" ({words}.)" for words in missing[:1])
            if error and (answered or at == ended):
                found.append(("FAILED", f"{where} {error}"))
            elif not error:
                status = "passed" if cell.execution_count else "not run"
                found.append((status, f"{where} {status}"))
    order = ("FAILED", "fault", "empty", "not run", "passed", "words", "hidden")
    for title, found in problems.items():
        if found:
            kinds = {kind for kind, _ in found}
            status = min(kinds, key=order.index)
            if status == "fault":  # a cell may stop after the function that is tested
                status = "passed" if "passed" in kinds and "not run" not in kinds else "FAILED"
            print(f"{status:8}{title}")
            shown = (said for kind, said in found if not kind == status == "passed")
            print("".join(f"{'':8}{said}\n" for said in shown), end="")
    return passed


def main() -> None:
    """Check a problem set: ``python -m rbclassroom.assignments.check FILE.ipynb``."""
    asked, _ = options.parse("check")
    if isinstance(sys.stdout, io.TextIOWrapper):  # some consoles cannot print every letter
        sys.stdout.reconfigure(errors="replace")
    try:
        check(asked.file.absolute())
    except (OSError, ValueError, nbformat.ValidationError) as error:
        sys.exit(f"nothing to submit was written: {error}")


if __name__ == "__main__":
    main()
