"""nbgrader preprocessors: restore locked cells, run under limits, hide the hidden tests.

These are preprocessors of nbgrader; `configure` names them in its configuration, so that they
also work in its own commands.
"""

import os
import re
import shutil
import sys
import tempfile
from pathlib import Path
from typing import Any

from nbclient.exceptions import CellTimeoutError, DeadKernelError
from nbconvert.preprocessors import CSSHTMLHeaderPreprocessor
from nbformat import NotebookNode
from nbformat.v4 import new_code_cell, new_markdown_cell, new_output
from nbgrader import preprocessors as nbgrader
from nbgrader.api import Gradebook
from nbgrader.utils import find_all_files, is_grade, is_solution
from traitlets import Bool
from traitlets.config import Config

from rbcourse.assignments.quota import CUT
from rbcourse.assignments.tampering import find_in_cells
from rbcourse.course.notebooks import kernel_address

UNSEEN = "The tests that are shown here pass; others, which are not shown, fail.\n"


class RefusedError(ValueError):
    """A submission that is not graded by machine; the message says why."""


def configure(config: Config) -> None:
    """Set what nbgrader does with submissions and feedback, and where it finds its tools."""
    # to make a gradebook it calls alembic by name, which a shell finds in an activated environment
    if not shutil.which("alembic"):
        tools = [str(Path(sys.executable).parent), os.environ.get("PATH", os.defpath)]
        os.environ["PATH"] = os.pathsep.join(tools)
    config.Autograde.sanitize_preprocessors = [
        nbgrader.ClearOutput,
        RestoreCells,
        nbgrader.DeduplicateIds,
        nbgrader.OverwriteKernelspec,
        nbgrader.OverwriteCells,
        nbgrader.CheckCellMetadata,
    ]
    config.OverwriteCells.add_missing_cells = True
    config.Autograde.autograde_preprocessors = [
        BoundedExecute,
        nbgrader.IgnorePattern,
        nbgrader.LimitOutput,
        nbgrader.SaveAutoGrades,
        nbgrader.AssignLatePenalties,
        nbgrader.CheckCellMetadata,
    ]
    config.Execute.iopub_timeout = 20  # seconds that an interrupted cell may take to stop
    # nbgrader gives no points where anything is written to stderr, be it a mere warning
    config.IgnorePattern.enabled = True
    config.IgnorePattern.pattern = r"(?s)."
    # the feedback is of a run that never held the hidden tests; the scores are in the gradebook
    config.GenerateFeedback.preprocessors = [
        nbgrader.GetGrades,
        nbgrader.ClearHiddenTests,
        nbgrader.ClearMarkScheme,
        nbgrader.ClearOutput,
        BoundedExecute,
        NoteUnseen,
        nbgrader.LimitOutput,
        CSSHTMLHeaderPreprocessor,
    ]


class RestoreCells(nbgrader.NbGraderPreprocessor):
    """Restore locked cells; reject code that overrides names used by the tests."""

    def preprocess(
        self, nb: NotebookNode, resources: dict[str, Any]
    ) -> tuple[NotebookNode, dict[str, Any]]:
        """Restore the notebook; what was missing is noted in its metadata."""
        about = resources["nbgrader"]
        with Gradebook(about["db_url"]) as gradebook:
            given = _given_cells(gradebook.find_notebook(about["notebook"], about["assignment"]))
        nb.cells, remarks = _restored(nb.cells, given)
        nb.metadata = NotebookNode({"remarks": remarks})
        _refuse_tampering(nb.cells)
        return nb, resources


def _given_cells(notebook: Any) -> dict[str, NotebookNode]:
    """Return the cells as the gradebook has them, in their order."""
    points = {cell.name: cell.max_score for cell in [*notebook.grade_cells, *notebook.task_cells]}
    kinds = {
        "grade": {cell.name for cell in notebook.grade_cells},
        "solution": {cell.name for cell in notebook.solution_cells},
        "task": {cell.name for cell in notebook.task_cells},
    }
    given = {}
    for cell in notebook.source_cells:
        is_code = cell.cell_type == "code"
        made = new_code_cell(cell.source) if is_code else new_markdown_cell(cell.source)
        about = {"schema_version": 3, "grade_id": cell.name, "cell_type": cell.cell_type}
        about |= {"locked": cell.locked, "checksum": cell.checksum}
        about |= {kind: cell.name in names for kind, names in kinds.items()}
        about |= {"points": points[cell.name]} if cell.name in points else {}
        made.metadata = NotebookNode({"nbgrader": NotebookNode(about)})
        given[cell.name] = made
    return given


def _restored(
    cells: list[NotebookNode], given: dict[str, NotebookNode]
) -> tuple[list[NotebookNode], list[str]]:
    """Return the cells of the set as they were given, with the answers of the student."""
    names = [_name(cell) for cell in cells]
    marked = {name for name, cell in given.items() if is_grade(cell) or is_solution(cell)}
    if not marked & set(names):
        raise RefusedError("no problem of the set is in it: another notebook, or made anew")
    last = {name: index for index, name in enumerate(names) if name in given}
    remarks = [
        f"{name} is there twice, the last one counts" for name in last if names.count(name) > 1
    ]
    restored: list[NotebookNode] = []
    for index, (cell, name) in enumerate(zip(cells, names, strict=True)):
        known = given[name] if last.get(name) == index else None
        restored.append(_as_given(cell, known))
    before = ""
    for name, cell in given.items():
        if name not in last:
            there = [_name(other) for other in restored]
            restored.insert(there.index(before) + 1 if before else 0, cell)
            remarks += [f"{name} was missing"] if name in marked else []
        before = name
    return restored, remarks


def _name(cell: NotebookNode) -> str:
    about = cell.metadata.get("nbgrader")
    return str(about.get("grade_id", "")) if isinstance(about, dict) else ""


def _as_given(cell: NotebookNode, given: NotebookNode | None) -> NotebookNode:
    """Return a cell with its original metadata (student-added tags could skip execution)."""
    if given is not None and not is_solution(given):
        return given
    # what looks like a region of nbgrader would stop it
    source = re.sub(r"\b(BEGIN|END) (HIDDEN TESTS|MARK SCHEME)", r"\1-\2", cell.source)
    if given is not None and given.cell_type != cell.cell_type:
        given.source = source
        return given
    cell.source = source
    cell.metadata = NotebookNode() if given is None else given.metadata
    return cell


def _refuse_tampering(cells: list[NotebookNode]) -> None:
    """Raise a RefusedError if code of the student replaces what tests rely on."""
    code = [cell for cell in cells if cell.cell_type == "code"]
    found = find_in_cells((cell.source, not _name(cell) or is_solution(cell)) for cell in code)
    for at, line, what in found:
        where = describe(code[at], cells.index(code[at]))
        raise RefusedError(f"{where}, line {line} {what}: grade by hand")


def describe(cell: NotebookNode, index: int) -> str:
    """Return how a cell is called in a message."""
    kind = "answer cell" if is_solution(cell) else "cell"
    return f"{kind} {_name(cell) or index + 1}"


class BoundedExecute(nbgrader.Execute):
    """Run a notebook in a new folder, with a bound on its output."""

    store_widget_state = Bool(False)

    def preprocess(
        self, nb: NotebookNode, resources: dict[str, Any], km: Any = None
    ) -> tuple[NotebookNode, dict[str, Any]]:
        """Run all cells; errors are among the outputs."""
        remarks = nb.metadata.get("remarks", [])
        path = resources["metadata"]["path"]
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
            self._folder = Path(folder)
            work = self._folder / "work"
            self._copy_given_files(resources["nbgrader"]["assignment"], work)
            resources["metadata"]["path"] = str(work)
            extension = "--IPKernelApp.extensions=rbcourse.assignments.quota"
            self.extra_arguments = [extension, "--log-level=CRITICAL"]
            self.shutdown_kernel = "immediate"
            try:
                nb, resources = super().preprocess(nb, resources, km)
            finally:
                resources["metadata"]["path"] = path
        nb.metadata["remarks"] = remarks + self._remarks_on(nb.cells)
        return nb, resources

    def _remarks_on(self, cells: list[NotebookNode]) -> list[str]:
        errors = {
            "CellTimeoutError": f"stopped after {self.timeout} s",
            "TooMuchOutputError": "prints without end",
            "MemoryError": "takes too much memory",
        }
        found: dict[str, None] = {}
        for index, cell in enumerate(cells):
            for output in cell.get("outputs", []):
                what = errors.get(output.get("ename", ""))
                if CUT in output.get("text", "") or CUT in output.get("data", {}).get(
                    "text/plain", ""
                ):
                    what = "output cut"
                found |= {f"{describe(cell, index)}: {what}": None} if what else {}
        return list(found)

    def _copy_given_files(self, assignment: str, work: Path) -> None:
        """Copy the files of the set; those of the student could pass for modules of the tests."""
        course = self.parent.parent.coursedir
        source = course.format_path(course.source_directory, ".", assignment)
        work.mkdir()
        for file in find_all_files(source, [*course.ignore, "*.ipynb"]):
            target = work / os.path.relpath(file, source)
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(file, target)

    def create_kernel_manager(self) -> Any:
        """Return a manager of a kernel that listens at files of this run only."""
        manager = super().create_kernel_manager()
        for name, value in kernel_address(str(self._folder)).items():
            setattr(manager, name, value)
        return manager

    def start_new_kernel(self, **kwargs: Any) -> None:
        """Start the kernel; what it keeps, it keeps in the folder of this run."""
        folder = str(self._folder)
        own = {"IPYTHONDIR": folder, "TMPDIR": folder, "TEMP": folder, "OMP_NUM_THREADS": "1"}
        super().start_new_kernel(env={**os.environ, **own, "OPENBLAS_NUM_THREADS": "1"}, **kwargs)

    def preprocess_cell(
        self, cell: NotebookNode, resources: dict[str, Any], index: int
    ) -> tuple[NotebookNode, dict[str, Any]]:
        """Run a cell."""
        try:
            return super().preprocess_cell(cell, resources, index)
        except DeadKernelError as error:
            where = describe(cell, index)
            raise RefusedError(f"Python ended in or before {where}: grade by hand") from error
        except CellTimeoutError as error:
            raise RefusedError(f"{describe(cell, index)} cannot be stopped") from error

    def on_cell_executed(self, **kwargs: Any) -> None:
        """Keep what nbgrader reads as points out of a cell that fails."""
        super().on_cell_executed(**kwargs)
        cell = kwargs["cell"]
        if any(output.output_type == "error" for output in cell.outputs):
            cell.outputs = [out for out in cell.outputs if out.output_type != "execute_result"]


class NoteUnseen(nbgrader.NbGraderPreprocessor):
    """Say where tests fail that the feedback does not show."""

    def preprocess_cell(
        self, cell: NotebookNode, resources: dict[str, Any], index: int
    ) -> tuple[NotebookNode, dict[str, Any]]:
        """Add a line to the outputs of a test cell without points whose visible part passes."""
        if cell.cell_type == "code" and is_grade(cell) and not is_solution(cell):
            failed = any(output.output_type == "error" for output in cell.outputs)
            if not failed and cell.metadata.nbgrader.points and not cell.metadata.nbgrader.score:
                cell.outputs.append(new_output("stream", name="stdout", text=UNSEEN))
        return cell, resources
