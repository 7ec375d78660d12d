"""What a rehearsal finds, as the command line starts it."""

import subprocess
import sys

from nbformat.v4 import new_code_cell, new_markdown_cell
from tiny import MODULE, lesson_at


def checked(folder, monkeypatch):
    """Check the lesson of a folder; any program will do as the browser, it is not opened."""
    monkeypatch.setenv("BROWSER", sys.executable)
    return subprocess.run(
        [*MODULE, "rbcourse.rehearsal", "1"], cwd=folder, capture_output=True, text=True
    )


def test_a_lesson_that_runs_is_ready(tmp_path, monkeypatch):
    link = new_markdown_cell("[a link](https://example.org) is asked for by nobody")
    path = lesson_at(tmp_path, link, new_code_cell("6 * 7"))
    before = path.read_bytes()
    done = checked(tmp_path, monkeypatch)
    assert done.stdout.splitlines()[-1] == "ready", done
    assert done.returncode == 0
    assert path.read_bytes() == before
    assert [file.name for file in path.parent.iterdir()] == [path.name]


def test_cells_that_fail_and_pictures_from_outside_are_named(tmp_path, monkeypatch):
    lesson_at(
        tmp_path,
        new_markdown_cell('<img src="https://example.org/a.png">'),
        new_code_cell("from IPython.display import HTML\nHTML('<img src=//example.org/b.png>')"),
        new_code_cell("1 / 0"),
    )
    done = checked(tmp_path, monkeypatch)
    assert done.returncode == 1
    missing = [line for line in done.stdout.splitlines() if line.startswith("missing: ")]
    assert len(missing) == 3
    assert "ZeroDivisionError: division by zero" in missing[0]
    assert "https://example.org/a.png" in missing[1]
    assert "//example.org/b.png" in missing[2]
    assert "ready" not in done.stdout
