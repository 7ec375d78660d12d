"""An explorer's cell in a lesson runs alone, as its still tells the reader."""

import re
from pathlib import Path

import nbformat
import pytest

from rbclassroom.course.notebooks import lesson_paths
from rbclassroom.explorers.explorer import Explorer

LESSONS = lesson_paths(Path(__file__).parents[3] / "notebooks")


@pytest.mark.parametrize("path", LESSONS, ids=lambda path: path.stem)
def test_the_cell_of_an_explorer_needs_no_other_cell(path):
    cells = nbformat.read(path, as_version=4).cells
    (cell,) = [cell for cell in cells if re.search(r"^explorers\.\w+\(", cell.source, re.MULTILINE)]
    *lines, last = cell.source.splitlines()
    space = {}
    exec("\n".join(lines), space)
    assert isinstance(eval(last, space), Explorer)
    (output,) = cell.outputs
    assert "a still. Run this cell (Shift + Enter) to get its sliders" in output.data["text/html"]
