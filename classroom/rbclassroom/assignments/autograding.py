"""nbgrader steps that restore cells and run code in a sandbox.

`configure` adds them, and those of `feedback`, to nbgrader's configuration, so that they also work
in nbgrader's own commands and in the formgrader.
"""

import os
import re
import shutil
import sys
import tempfile
import time
from pathlib import Path
from typing import Any, cast

import nbformat
from nbclient.exceptions import CellTimeoutError, DeadKernelError
from nbconvert.exporters import NotebookExporter
from nbconvert.preprocessors import CSSHTMLHeaderPreprocessor
from nbformat import NotebookNode
from nbformat.v4 import new_output
from nbgrader import preprocessors as nbgrader
from traitlets import Bool, Integer
from traitlets.config import Config

from rbclassroom.assignments import feedback, sandbox
from rbclassroom.assignments.locked_cells import (
    is_answer,
    marks_of,
    name_cell,
)
from rbclassroom.assignments.notebook_runner import CUT, BoundedClient
from rbclassroom.assignments.submissions import Refused, read_notebook, restore
from rbcourse.files import replace_file

RUN = "run.json"  # beside a graded notebook: its run for the page
SHOWN = {"text/plain", "text/html", "text/markdown", "text/latex"}
SHOWN |= {"image/png", "image/jpeg", "image/svg+xml"}


def configure(config: Config) -> None:
    """Set nbgrader's steps for submissions and feedback, and the path of nbgrader's tools."""
    # nbgrader runs the program alembic, which PATH contains only in an activated environment
    if not shutil.which("alembic"):
        path = os.environ.get("PATH", os.defpath)
        os.environ["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{path}"
    end = nbgrader.CheckCellMetadata
    ignored = [".ipynb_checkpoints", "*.pyc", "__pycache__", "feedback"]  # nbgrader's own list
    config.CourseDirectory.ignore = [*ignored, RUN]  # the run is not copied to the page
    config.Autograde.exporter_class = ReadSubmission
    config.Autograde.sanitize_preprocessors = [RestoreCells, nbgrader.OverwriteKernelspec, end]
    run = [BoxedExecute, nbgrader.IgnorePattern, nbgrader.SaveAutoGrades]
    config.Autograde.autograde_preprocessors = [*run, nbgrader.AssignLatePenalties, end]
    # by default nbgrader gives no points for a cell that writes to stderr, even for a warning
    config.IgnorePattern.enabled = True
    config.IgnorePattern.pattern = r"(?s)."
    # the feedback shows a run without hidden tests, with the scores from the gradebook
    clear = [nbgrader.ClearHiddenTests, nbgrader.ClearMarkScheme, nbgrader.ClearOutput]
    shown = [
        feedback.GetResults,
        *clear,
        ExecuteOnce,
        feedback.Summarise,
        CSSHTMLHeaderPreprocessor,
    ]
    config.GenerateFeedback.preprocessors = shown
    config.GenerateFeedback.exporter_class = feedback.FeedbackExporter
    config.FeedbackExporter.template_name = "page"
    config.FeedbackExporter.extra_template_basedirs = [str(Path(__file__).parent / "templates")]
    # the feedback and the formgrader show HTML that cannot run anything
    config.HTMLExporter.sanitize_html = True
    filters = {"clean_html": "inert_html", "markdown2html": "inert_markdown"}
    filters["page_markdown"] = "page_markdown"
    config.HTMLExporter.filters = {key: f"{feedback.__name__}.{f}" for key, f in filters.items()}


class ReadSubmission(NotebookExporter):
    """Read submissions as the students' check does."""

    def from_file(self, file_stream: Any, *args: Any, **settings: Any) -> Any:
        """Return the converted notebook in an open file, and its resources."""
        step: Any = self.parent
        if not step._sanitizing:  # the notebook was restored before
            return super().from_file(file_stream, *args, **settings)
        path, exporter = Path(file_stream.name), cast(Any, self)
        notebook = read_notebook(path.read_bytes(), path.name)
        return exporter.from_notebook_node(notebook, *args, **settings)


class RestoreCells(nbgrader.OverwriteCells):  # the base class adds the hidden tests
    """Restore the locked cells and the hidden tests."""

    def preprocess(self, nb: NotebookNode, resources: Any) -> tuple[NotebookNode, Any]:
        """Restore the locked cells and hidden tests, and store remarks in the metadata."""
        about, course = resources["nbgrader"], self.parent.parent.coursedir
        released = course.format_path(course.release_directory, ".", about["assignment"])
        original = nbformat.read(Path(released, f"{about['notebook']}.ipynb"), as_version=4)
        remarks = restore(nb, original)
        if len(remarks) > 2:
            remarks[1:] = [f"and {len(remarks) - 1} more changes"]
        for cell in nb.cells:  # nbgrader fails if a student's cell has these words
            if is_answer(cell) or not marks_of(cell):
                regions = r"\b(BEGIN|END) (HIDDEN TESTS|MARK SCHEME)"
                cell.source = re.sub(regions, r"\1-\2", cell.source)
        nb, resources = super().preprocess(nb, resources)
        nb.metadata = NotebookNode({"remarks": remarks})
        return nb, resources


class BoxedExecute(BoundedClient, nbgrader.Execute):
    """Run a notebook in a new folder, and in a sandbox unless `boxed` is False."""

    boxed = Bool(True, help="run the notebook only in the sandbox").tag(config=True)
    seconds = Integer(600, help="the time limit of a notebook in the sandbox").tag(config=True)

    def preprocess(self, nb: NotebookNode, resources: Any, km: Any = None) -> Any:
        """Run all cells, and store errors among the outputs."""
        step: Any = self.parent
        course, name = step.parent.coursedir, resources["nbgrader"]["assignment"]
        source = course.format_path(course.source_directory, ".", name)
        self.folder, path = Path(tempfile.mkdtemp()), resources["metadata"]["path"]
        work = self.folder / "work"
        try:
            # only files of the set are copied: a student's file could replace a module of the tests
            shutil.copytree(source, work, ignore=shutil.ignore_patterns("*.ipynb", *course.ignore))
            sandbox.prepare(self.folder)
            resources["metadata"]["path"] = str(work)
            nb, resources = nbgrader.Execute.preprocess(self, nb, resources, km)
        finally:
            resources["metadata"]["path"] = path
            sandbox.delete(self.folder)
        remarks = nb.metadata.setdefault("remarks", [])
        for at, cell in enumerate(nb.cells):
            outputs = cell.get("outputs", [])
            errors = {output.get("ename") for output in outputs} - {None}
            faults = [f"stopped after {self.timeout} s"] * (at in self.slow)
            faults += [CUT] * (at in self.cut)
            faults += ["takes too much memory"] * ("MemoryError" in errors)
            if is_answer(cell) and not faults:
                wrong = errors - {"NotImplementedError"}  # of an answer that was not begun
                faults += [f"shows {name[:60]}" for name in sorted(wrong)]
            remarks += [f"{name_cell(nb.cells, at)}: {fault}" for fault in faults]
            if at in self.slow:  # replace the traceback, which may quote tests
                outputs[:] = [output for output in outputs if output.output_type != "error"]
                said = f"This cell took longer than {self.timeout} s and was stopped."
                outputs.append(new_output("error", ename="Timeout", evalue="", traceback=[said]))
            for output in (output for output in outputs if "data" in output):
                output.metadata = NotebookNode()
                output.data = NotebookNode({k: v for k, v in output.data.items() if k in SHOWN})
                if "text/latex" in output.data:
                    output.data["text/latex"] = feedback.without_links(output.data["text/latex"])
        return nb, resources

    def create_kernel_manager(self) -> Any:
        """Return a manager of a kernel in the sandbox; raise `Refused` if there is no sandbox."""
        manager = super().create_kernel_manager()
        if self.boxed:
            if why := sandbox.missing():
                raise Refused(f"there is no sandbox: {why}")
            sandbox.put_in_box(manager, self.folder, self.seconds)
        return manager

    def start_new_kernel(self, **kwargs: Any) -> None:
        """Start the kernel with the environment variables of the sandbox."""
        self.began = time.monotonic()
        super().start_new_kernel(env=sandbox.environment(self.folder), **kwargs)

    def preprocess_cell(self, cell: NotebookNode, resources: Any, index: int) -> Any:
        """Run a cell; raise `Refused` if the kernel ends or cannot be interrupted."""
        try:
            return super().preprocess_cell(cell, resources, index)
        except (DeadKernelError, CellTimeoutError) as error:
            where = name_cell(self.nb.cells, index)
            if isinstance(error, CellTimeoutError):
                raise Refused(f"{where} cannot be stopped") from error
            over = self.boxed and time.monotonic() - self.began >= self.seconds
            what = f"the {self.seconds} s for the notebook were over" if over else "Python ended"
            raise Refused(f"{what} in or before {where}; grade by hand") from error


class ExecuteOnce(BoxedExecute):
    """Run a graded notebook for its page, or take the stored run, which grading deletes."""

    def preprocess(self, nb: NotebookNode, resources: Any, km: Any = None) -> Any:
        """Return the notebook with the outputs of its run, and with its present marks."""
        step, about = cast(Any, self.parent), resources["nbgrader"]
        course, job = step.parent.coursedir, (about["student"], about["assignment"])
        stored = Path(course.format_path(course.autograded_directory, *job), RUN)
        if not stored.exists():
            nb, resources = super().preprocess(nb, resources, km)
            replace_file(stored, nbformat.writes(nb).encode())
        ran = nbformat.read(stored, as_version=4)
        for cell, now in zip(ran.cells, nb.cells, strict=True):
            cell.metadata = now.metadata
        return ran, resources
