"""Pages with a problem set say how to use their buttons, and do not mention Jupyter's commands."""

import nbformat
import pytest
from test_problems import SETS, SOURCE

from rbclassroom.assignments.handout import release
from rbclassroom.live.pages import mark_problems


def released(name):
    return nbformat.reads(release(name, SOURCE.parent)[f"{name}.ipynb"].decode(), as_version=4)


@pytest.mark.parametrize("name", SETS)
def test_a_page_explains_its_buttons_and_no_command(name):
    notebook = released(name)
    mark_problems(notebook)
    text = "\n".join(cell.source for cell in notebook.cells if cell.cell_type == "markdown")
    assert text.count("*Check*, below each answer, tells you") == 1
    assert text.count("download the file, and hand it in") == 1
    assert "rbclassroom.assignments.check" not in text


def test_a_missing_sentence_is_named():
    notebook = released("ps1")
    for cell in notebook.cells:
        cell.source = cell.source.replace("Save the notebook", "Save your notebook")
    with pytest.raises(ValueError, match="problem set: the sentence 'Save the notebook"):
        mark_problems(notebook)
