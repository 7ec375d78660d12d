"""Check a problem set before submission: what was changed, whether it runs, the file to submit.

A student runs this, without nbgrader.
"""

import argparse
import io
import json
import logging
import os
import re
import shutil
import sys
import tempfile
import time
import warnings
from pathlib import Path
from typing import Any

import nbformat
from nbclient import NotebookClient
from nbclient.exceptions import CellTimeoutError, DeadKernelError
from nbformat import NotebookNode

from rbcourse.assignments.restore import grade_id, is_test, marks_of, mend, name_cell
from rbcourse.assignments.tampering import find_in_cells
from rbcourse.course.notebooks import KERNEL, kernel_address

CELL_SECONDS = 60
STOP_SECONDS = 20  # that an interrupted cell may take to stop
CELL_BYTES = 2_000_000
ALL_BYTES = 10_000_000
COPIED_BYTES = 50_000_000
SLOW = "the cell took too long"
SHOWN = ("stream", "display_data", "execute_result", "update_display_data")


def check(path: Path, original: Path | None = None, seconds: int = CELL_SECONDS) -> Path:
    """Compare a problem set with its original, run it, and write the file to submit.

    What is found is printed. The file of the student is only read; the file to submit has the
    locked cells as in the original.
    """
    notebook = _read(path)
    original = original or _find_original(path)
    wanted = _read(original)
    saved = time.strftime("%Y-%m-%d %H:%M", time.localtime(path.stat().st_mtime))
    print(f"checking {path.name}, last saved {saved}", flush=True)
    if path.name != original.name:
        print(f"it is to be submitted under the name {original.name}")
    number = len(notebook.cells)
    _list(mend(notebook, wanted))
    if len(notebook.cells) != number:
        print("from here on cells are counted in the file to submit")
    notebook.metadata.kernelspec = dict(KERNEL)
    _list(_not_graded(notebook))
    remarks = _run(notebook, path.parent, seconds)
    _list(remarks + _failures(notebook, wanted))
    passed = _tests(notebook)
    target = path.parent / "to_submit" / original.name
    _write(notebook, target)
    size = target.stat().st_size / 1e6
    if size > 2 * ALL_BYTES / 1e6:
        _list([f"the file has {size:.0f} MB: are there pictures in its text? Make them smaller"])
    print(
        f"{sum(passed)} of {len(passed)} visible tests passed; hidden tests run when it is graded; "
        f"the file to submit is {target}"
    )
    return target


def _list(remarks: list[str]) -> None:
    for what in remarks:
        print(f"- {what}", flush=True)


def _read(path: Path) -> NotebookNode:
    if path.suffix != ".ipynb":
        raise ValueError(f"{path.name} is no notebook; give the file that ends with .ipynb")
    if not path.is_file():
        raise ValueError(f"{path}: there is no such file")
    content = path.read_bytes()
    if not content.strip():
        raise ValueError(f"{path.name} is empty; open it in JupyterLab and save it, or start anew")
    if re.search(rb"^(<{7}|>{7}) ", content, re.MULTILINE):
        raise ValueError(f"{path.name} still has merge marks, <<<<<<< and >>>>>>>; resolve them")
    try:
        with warnings.catch_warnings():  # on cells without ids, which get them later
            warnings.simplefilter("ignore")
            logging.disable()
            notebook = nbformat.reads(content.decode("utf-8-sig"), as_version=4)
            cells = notebook.cells
    except Exception as error:  # whatever nbformat stumbles over
        raise ValueError(
            f"{path.name} is damaged or no notebook ({str(error).splitlines()[0][:80]}); "
            "take an earlier copy, or save it in JupyterLab again"
        ) from error
    finally:
        logging.disable(logging.NOTSET)
    if not cells:
        raise ValueError(f"{path.name} has no cells; open it in JupyterLab and save it again")
    for cell in cells:
        if cell.cell_type == "code":
            cell.outputs, cell.execution_count = [], None
    return notebook


def _find_original(path: Path) -> Path:
    folder = path.parent / "original"
    if (folder / path.name).is_file():
        return folder / path.name
    notebooks = sorted(folder.glob("*.ipynb"))
    if len(notebooks) != 1:
        raise ValueError(
            f"{folder / path.name} is missing; unpack the handout again, put {path.name} into "
            "its folder, and check it there"
        )
    return notebooks[0]


class _Client(NotebookClient):
    """A client that tells where it is and keeps a limited amount of output.

    Attributes
    ----------
    at : int
        The number of the cell that is run, from 1.
    slow : list of int
        The cells that took too long.
    cut : list of int
        The cells of which not all output is kept.
    """

    def __init__(self, notebook: NotebookNode, **settings: Any) -> None:
        hooks: dict[str, Any] = {"on_cell_start": self._begin, "on_cell_executed": self._end}
        super().__init__(notebook, **hooks, **settings)
        self.at, self._bytes, self._left = 0, 0, ALL_BYTES
        self.slow: list[int] = []
        self.cut: list[int] = []

    def _begin(self, cell: NotebookNode, cell_index: int) -> None:
        self.at, self._bytes = cell_index + 1, min(CELL_BYTES, self._left)
        self.raise_on_iopub_timeout = False
        if len(self.slow) > 1:
            raise CellTimeoutError("cells take too long")
        print(f"\rrunning cell {self.at} of {len(self.nb.cells)} ", end="", flush=True)

    def _end(self, cell: NotebookNode, cell_index: int, execute_reply: dict[str, Any]) -> None:
        """Keep an error that did not come through: without it a test seems to pass."""
        reply = execute_reply["content"]
        if reply["status"] != "ok" and (self.at in self.slow or not _error(cell)):
            empty = {"ename": "Error", "evalue": "it was not run", "traceback": []}
            what = {key: reply.get(key, value) for key, value in empty.items()}
            cell.outputs.append(nbformat.v4.new_output("error", **what))

    async def _async_handle_timeout(
        self, timeout: int, cell: NotebookNode | None = None
    ) -> dict[str, Any] | None:
        self.slow.append(self.at)
        self.raise_on_iopub_timeout = True  # what does not stop now cannot be stopped
        reply: dict[str, Any] | None = await super()._async_handle_timeout(timeout, cell)
        return reply

    def process_message(
        self, msg: dict[str, Any], cell: NotebookNode, cell_index: int
    ) -> NotebookNode | None:
        content = msg["content"]
        if msg["msg_type"] == "error":
            content["evalue"] = content["evalue"][:5000]
            content["traceback"] = [line[:5000] for line in content["traceback"][-50:]]
        elif msg["msg_type"] in SHOWN:
            size = len(content.get("text") or json.dumps(content, default=str))
            if self.at in self.cut or size > self._bytes:
                self.cut += [self.at] * (self.at not in self.cut)
                return None
            self._bytes -= size
            self._left -= size
        return super().process_message(msg, cell, cell_index)


def _run(notebook: NotebookNode, folder: Path, seconds: int) -> list[str]:
    """Run all cells in a copy of the folder; say what did not go well."""
    with (
        tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as work,
        tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as own,
    ):
        remarks = _copy_files(folder, Path(work))
        log = logging.getLogger(__name__)
        log.setLevel(logging.CRITICAL + 1)  # what there is to say is said here
        client = _Client(
            notebook,
            log=log,
            kernel_name=KERNEL["name"],
            record_timing=False,
            coalesce_streams=True,
            store_widget_state=False,
            shutdown_kernel="immediate",
            allow_errors=True,
            timeout=seconds,
            interrupt_on_timeout=True,
            iopub_timeout=STOP_SECONDS,
            error_on_timeout={"ename": "TimeoutError", "evalue": SLOW, "traceback": [SLOW]},
            extra_arguments=["--log-level=CRITICAL"],
            resources={"metadata": {"path": work}},
        )
        kernel = client.create_kernel_manager()
        for name, value in kernel_address(own).items():
            setattr(kernel, name, value)
        try:
            client.execute(env={**os.environ, "IPYTHONDIR": own})
        except DeadKernelError:
            notebook.cells[client.at - 1].execution_count = None
            remarks.append(
                f"the kernel died in cell {client.at}: it called exit, or used up the memory; "
                "the cells after it were not run"
            )
        except CellTimeoutError:
            notebook.cells[client.at - 1].execution_count = None
            first = client.at + (client.at in client.slow)
            if first <= len(notebook.cells):
                remarks.append(f"cells from {first} on were not run")
        except (RuntimeError, KeyError) as error:
            raise ValueError(
                f"Python could not be started for the notebook ({error}); install what "
                "requirements.txt of the handout lists"
            ) from error
        print(flush=True)
    return remarks + _note(notebook, client, seconds)


def _not_graded(notebook: NotebookNode) -> list[str]:
    """Say what a machine will not grade: it could be meant to deceive the tests."""
    code = [i for i, cell in enumerate(notebook.cells) if cell.cell_type == "code"]
    marks = [marks_of(notebook.cells[i]) for i in code]
    own = [not mark.get("grade_id") or bool(mark.get("solution")) for mark in marks]
    sources = (notebook.cells[i].source for i in code)
    return [
        f"{name_cell(notebook.cells, code[at])}, line {line} {what}: not graded so, change it"
        for at, line, what in find_in_cells(zip(sources, own, strict=True))
    ]


def _copy_files(folder: Path, work: Path) -> list[str]:
    """Copy what lies beside the notebook, not what lies in folders: that may be a whole disk."""
    remarks, left = [], COPIED_BYTES
    for file in sorted(folder.iterdir()):
        if file.is_file() and file.suffix not in (".whl", ".zip"):
            try:
                size = file.stat().st_size
                if size > left:
                    raise OSError("too large")
                shutil.copyfile(file, work / file.name)
                left -= size
            except OSError as error:
                remarks.append(f"{file.name} cannot be copied for the run: {error}")
    return remarks


def _note(notebook: NotebookNode, client: _Client, seconds: int) -> list[str]:
    """Put into the outputs, and say, what was too long."""
    names = [name_cell(notebook.cells, at - 1) for at in client.slow]
    remarks = [f"{name} took longer than {seconds} s and was stopped" for name in names]
    for at in client.cut:
        words = "the output is too large; what is too much is left out"
        remarks.append(f"{name_cell(notebook.cells, at - 1)}: {words}")
        note = nbformat.v4.new_output("stream", name="stdout", text=f"\n({words})\n")
        notebook.cells[at - 1].outputs.append(note)
    return remarks


def _error(cell: NotebookNode) -> str:
    """Return the last line of the last error of a cell, or an empty string."""
    errors = [o for o in cell.get("outputs", []) if o.output_type == "error"]
    if not errors:
        return ""
    lines = [line for line in errors[-1].evalue.splitlines() if line.strip()]
    words = re.sub(r"\x1b\[[0-9;]*m", "", lines[-1].strip() if lines else "")[:200]
    if words and errors[-1].ename == "NotYet":  # a hint, which speaks for itself
        return words
    return f"{errors[-1].ename}: {words}" if words else str(errors[-1].ename)


def _failures(notebook: NotebookNode, original: NotebookNode) -> list[str]:
    """Name the cells that fail, except tests and unanswered questions."""
    empty = {grade_id(c): c.source.strip() for c in original.cells if marks_of(c).get("solution")}
    return [
        f"{name_cell(notebook.cells, at)} fails: {_error(cell)}"
        for at, cell in enumerate(notebook.cells)
        if _error(cell)
        and not _error(cell).endswith(SLOW)  # this is said already
        and not is_test(cell)
        and cell.source.strip() != empty.get(grade_id(cell))
    ]


def _tests(notebook: NotebookNode) -> list[bool]:
    """Print how the visible tests went."""
    passed = []
    for at, cell in enumerate(notebook.cells):
        if not is_test(cell):
            continue
        if not re.search(r"^\s*[^#\s]", cell.source, re.MULTILINE):
            print(f"hidden  {name_cell(notebook.cells, at)} has hidden tests only")
            continue
        error = _error(cell) or ("" if cell.execution_count else "it was not run to its end")
        passed.append(not error)
        print(f"{'FAILED' if error else 'passed'}  {name_cell(notebook.cells, at)}", end="")
        print(f": {error}" if error else "")
    return passed


def _write(notebook: NotebookNode, target: Path) -> None:
    notebook.metadata.pop("widgets", None)
    nbformat.validate(notebook)
    target.parent.mkdir(exist_ok=True)
    part = target.with_suffix(".part")
    part.write_text(nbformat.writes(notebook) + "\n", encoding="utf-8", newline="\n")
    part.replace(target)


def _check_with_course(path: Path, assignments: Path) -> None:
    """Check a problem set without its original in the course that it is of."""
    from rbcourse.assignments.handout import release  # a student does not have nbgrader

    sets = [place.parent.name for place in assignments.glob("*/*/*.ipynb")]
    name = next((own for own in sets if path.stem.startswith(own)), path.stem)
    with tempfile.TemporaryDirectory() as folder:
        original = Path(folder, f"{name}.ipynb")
        original.write_bytes(release(name, assignments)[original.name])
        check(path, original)


def main() -> None:
    """Check a problem set: ``python -m rbcourse.assignments.check FILE.ipynb``."""
    parser = argparse.ArgumentParser(prog="python -m rbcourse.assignments.check")
    parser.add_argument("file", type=Path, help="the notebook to be handed in: ps1.ipynb")
    parser.add_argument("--original", type=Path, help="as it was handed out")
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # a console may not know every letter
            stream.reconfigure(errors="replace")
    known = parser.parse_args()
    path, course = known.file.absolute(), Path("notebooks", "assignments")
    try:
        if known.original or (path.parent / "original").exists() or not course.is_dir():
            check(path, known.original)
        else:
            _check_with_course(path, course)
    except (OSError, ValueError, nbformat.ValidationError) as error:
        sys.exit(f"nothing to submit was written: {error}")


if __name__ == "__main__":
    main()
