"""How lessons are run as tests: nbval runs and compares the cells, then all is compared as stored.

The second comparison covers files, the form of the outputs, and cells whose output nbval ignores.

All uses of nbval's internals are in this file. nbval gives an item for each cell, a kernel, and the
comparison of text. To replace it, collect one item for each lesson that runs it with
`rbclassroom.course.figures.execute`, and does then what `Remains.runtest` does: `changed_lines`
compares everything that a lesson stores.
"""

import tempfile
from functools import partial
from pathlib import Path

import nbval.kernel
import pytest
from nbformat import NotebookNode
from nbval.plugin import IPyNbFile
from shown import not_shown, start_recording

from rbclassroom.course.agreement import changed_lines, stale_figures
from rbclassroom.course.notebooks import kernel_address, lesson_paths, normalised

ROOT = Path(__file__).parents[1]
LESSONS = lesson_paths(ROOT / "notebooks")


def pytest_configure(config):
    """Give the kernels of notebooks that are tests an address that no other program can take."""
    folder = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
    config.add_cleanup(folder.cleanup)
    address = kernel_address(folder.name)
    nbval.kernel.KernelManager = partial(nbval.kernel.KernelManager, **address)


@pytest.hookimpl(wrapper=True)
def pytest_collect_file(file_path, parent):
    """Collect a lesson as such; other notebooks are nbval's alone."""
    collected = yield
    return [Lesson.from_parent(parent, path=file_path)] if file_path in LESSONS else collected


class Lesson(IPyNbFile):
    """A notebook whose last item compares what the cells before it gave and drew."""

    def collect(self):
        """Return the items in their order."""
        self.cells = list(super().collect())
        for cell in self.cells:
            cell.output_timeout = 600  # seconds; nbval's 5 are too few on a busy machine
        return [*self.cells, Remains.from_parent(self, name="Outputs and figures")]

    def setup(self):
        """Start the kernel, with empty folders for figures and for what their artists show."""
        self.figures, self.shown, ipython = (
            tempfile.TemporaryDirectory(ignore_cleanup_errors=True) for _ in range(3)
        )
        self.folders, self.displays = (self.figures, self.shown, ipython), {}
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("RBCOURSE_FIGURES", self.figures.name)
            patch.setenv("IPYTHONDIR", start_recording(self.shown.name, ipython.name))
            super().setup()

    def teardown(self):
        """Stop the kernel, remove the folders."""
        super().teardown()
        for folder in self.folders:
            folder.cleanup()

    def get_kernel_message(self, timeout=None, stream="iopub"):
        """Let outputs that are updated, as progress bars are, end as they do in Jupyter."""
        message = super().get_kernel_message(timeout, stream)
        content = message["content"]
        if name := content.get("transient", {}).get("display_id"):
            shown = self.displays.setdefault(name, NotebookNode())
            shown.update(content["data"])
            content["data"] = shown
        return message


class Remains(pytest.Item):
    """What the cells of a lesson gave and drew, and what of it is stored."""

    def reportinfo(self):
        """Return what a report calls it."""
        return self.path, None, self.nodeid

    def runtest(self):
        """Fail with a line for each difference."""
        lesson = self.parent
        cells = [cell for cell in lesson.cells if not cell.options["skip"]]
        if unfinished := [cell.name for cell in cells if not finished(cell)]:
            pytest.fail(f"Not compared, for want of {', '.join(unfinished)}", pytrace=False)
        for cell in cells:
            cell.cell.outputs = cell.test_outputs
            for output in cell.test_outputs:
                if "execution_count" in output:  # nbval does not count
                    output.execution_count = cell.cell.execution_count
        stale = stale_figures(Path(lesson.figures.name), ROOT / "figures")
        changes = [
            *changed_lines(lesson.path.read_text("utf-8"), normalised(lesson.nb)),
            *(f"{name} is not stored as it is drawn" for name in stale),
            *not_shown(Path(lesson.figures.name), Path(lesson.shown.name)),
        ]
        if changes:
            pytest.fail("\n".join(changes), pytrace=False)


def finished(cell):
    """Tell whether a cell has run to its end."""
    outputs = cell.test_outputs
    return outputs is not None and all(out.output_type != "error" for out in outputs)
