"""What a student is told before handing in, and the file that is to be submitted."""

import os
import subprocess
import sys
import time
from functools import partial
from hashlib import sha256
from inspect import signature
from textwrap import dedent

import nbformat
import pytest
from nbformat.v4 import new_code_cell, new_markdown_cell
from nbgrader.preprocessors import ClearHiddenTests, ClearSolutions, ComputeChecksums, LockCells
from tiny import MODULE
from tiny_set import ANSWERS, write_tiny_set

from rbclassroom.assignments import check, client
from rbclassroom.assignments.autograding import BoxedExecute
from rbclassroom.assignments.restore import restore


@pytest.fixture(scope="module")
def release(tmp_path_factory):
    """The tiny set as nbgrader hands it out."""
    path = write_tiny_set(tmp_path_factory.mktemp("assignments"))
    notebook = nbformat.read(path, as_version=4)
    for step in (LockCells(), ClearSolutions(), ClearHiddenTests(), ComputeChecksums()):
        notebook, _ = step.preprocess(notebook, {})
    return nbformat.writes(notebook)


@pytest.fixture
def handout(tmp_path, release):
    """The folder that a student unpacks."""
    folder = tmp_path / "my folder ü" / "ps0"
    (folder / "original").mkdir(parents=True)
    for place in (folder, folder / "original"):
        (place / "ps0.ipynb").write_text(release, encoding="utf-8")
    return folder


def cell_of(notebook, name):
    return next(c for c in notebook.cells if c.metadata.get("nbgrader", {}).get("grade_id") == name)


def edited(handout, edit, name="ps0.ipynb", **answers):
    """The student's file, answered and edited."""
    path = handout / "ps0.ipynb"
    notebook = nbformat.read(path, as_version=4)
    for key, source in {**ANSWERS, "words-answer": "Signs.", **answers}.items():
        cell_of(notebook, key).source = source
    edit(notebook)
    path.write_text(nbformat.writes(notebook), encoding="utf-8")
    return path.rename(handout / name)


def mended(release, edit):
    """What is said of an edited notebook, and what becomes of it."""
    notebook, original = (nbformat.reads(release, as_version=4) for _ in range(2))
    for name, source in {**ANSWERS, "words-answer": "Signs."}.items():
        cell_of(notebook, name).source = source
    edit(notebook)
    said = restore(notebook, original)
    nbformat.validate(notebook)
    return said, notebook


def names(notebook):
    found = [c.metadata.get("nbgrader", {}).get("grade_id") for c in notebook.cells]
    return [name for name in found if name]


def submitted(handout):
    return nbformat.read(handout / "to_submit" / "ps0.ipynb", as_version=4)


def test_an_answered_set_is_run_and_written(handout):
    path = edited(handout, lambda notebook: notebook.cells.append(new_code_cell("print('é∞', 1)")))
    before = sha256(path.read_bytes()).digest()
    done = subprocess.run(
        [*MODULE, "rbclassroom.assignments.check", "ps0.ipynb"],
        cwd=handout,
        capture_output=True,
        encoding="ascii",
        env={**os.environ, "PYTHONIOENCODING": "ascii"},
    )
    assert done.returncode == 0, done
    assert done.stderr == ""
    assert "running cell 9 of 9" in done.stdout
    last = done.stdout.splitlines()[-1]
    assert last.startswith("2 of 2 visible tests passed; hidden tests run when it is graded")
    assert last.endswith("ps0.ipynb")
    assert submitted(handout).cells[-1].outputs[0].text == "é∞ 1\n"
    assert sha256(path.read_bytes()).digest() == before
    assert sorted(f.name for f in handout.iterdir()) == ["original", "ps0.ipynb", "to_submit"]
    assert [f.name for f in (handout / "to_submit").iterdir()] == ["ps0.ipynb"]


def test_failing_tests_are_named_with_their_hint_and_do_not_keep_from_handing_in(handout, capsys):
    def edit(notebook):
        notebook.cells.append(new_code_cell("open('made_by_a_run', 'w').close(); nowhere"))

    edited(handout, edit, **{"square-answer": "def square(x):\n    return x"})
    check.check(handout / "ps0.ipynb")
    said = capsys.readouterr().out
    assert "FAILED  A tiny set: cell 4 AssertionError: times itself; cell 8 is graded by" in said
    assert "1 of 2 visible tests passed" in said
    assert "NameError: name 'nowhere' is not defined" in said
    assert not (handout / "made_by_a_run").exists()


def test_a_changed_test_does_not_help_and_the_name_is_put_right(handout, capsys):
    def edit(notebook):
        cell_of(notebook, "half-test").source = "assert True"

    path = edited(handout, edit, name="ps0 (1).ipynb", **{"half-answer": "half = 5"})
    assert check.check(path) == handout / "to_submit" / "ps0.ipynb"
    said = capsys.readouterr().out
    assert "submitted under the name ps0.ipynb" in said
    assert "- cell 6, test of “A tiny set” was changed; it is put back\n" in said
    assert "1 of 2 visible tests passed" in said
    assert cell_of(submitted(handout), "half-test").source.startswith("assert half < 1")


@pytest.fixture
def endless(monkeypatch, tmp_path):
    """``endless(name)``: only that cell has a limit, a second from where its loop begins.

    The loop begins when the file exists whose path is returned.
    """

    def begin(name):
        begun = tmp_path / "begun"

        def limit(cell):
            if cell.metadata.get("nbgrader", {}).get("grade_id") != name:
                return None
            while not begun.exists():
                time.sleep(0.01)
            return 1

        monkeypatch.setattr(check, "_Client", partial(check._Client, timeout_func=limit))
        return str(begun)

    return begin


def test_an_endless_loop_is_stopped_and_named_and_its_output_is_cut(
    handout, capsys, monkeypatch, endless
):
    monkeypatch.setattr(client.BoundedClient.iopub_timeout, "default_value", 600)
    loop = f"open({endless('square-answer')!r}, 'w')\nwhile True:\n    print('x' * 10000)"
    edited(handout, lambda notebook: None, **{"square-answer": loop})
    check.check(handout / "ps0.ipynb", seconds=1)
    said = capsys.readouterr().out
    assert "- cell 3, answer of “A tiny set” took longer than 1 s" in said
    assert "the output is too large" in said
    assert "1 of 2 visible tests passed" in said
    assert (handout / "to_submit" / "ps0.ipynb").stat().st_size < 3_000_000


def test_a_slow_cell_is_named_and_the_limit_is_that_of_grading(handout, capsys):
    edited(handout, lambda notebook: None, **{"square-answer": "import time\ntime.sleep(1.2)"})
    check.check(handout / "ps0.ipynb", seconds=2)
    said = capsys.readouterr().out
    assert "cell 3, answer of “A tiny set” took more than half of the 2 s that grading" in said
    assert BoxedExecute().timeout == signature(check.check).parameters["seconds"].default


@pytest.mark.skipif(os.name == "nt", reason="there interrupts are no signals")
def test_a_loop_that_cannot_be_stopped_ends_the_run(handout, capsys, monkeypatch, endless):
    monkeypatch.setattr(client.BoundedClient.iopub_timeout, "default_value", 1)
    loop = f"""
        def square(x):
            import signal
            signal.signal(signal.SIGINT, signal.SIG_IGN)
            open({endless("square-test")!r}, "w")
            while True:
                pass
    """
    edited(handout, lambda notebook: None, **{"square-answer": dedent(loop)})
    check.check(handout / "ps0.ipynb", seconds=1)
    said = capsys.readouterr().out
    assert "took longer than 1 s" in said
    assert "the cells after cell 4 were not run" in said
    assert "FAILED  A tiny set: cell 4 " in said
    assert "0 of 2 visible tests passed" in said


def test_a_dead_kernel_is_named(handout, capsys):
    def ran_before(notebook):
        cell_of(notebook, "half-test").execution_count = 7

    edited(handout, ran_before, **{"half-answer": "import os\nos._exit(1)"})
    check.check(handout / "ps0.ipynb")
    said = capsys.readouterr().out
    assert "the kernel died in cell 5" in said
    assert "1 of 2 visible tests passed" in said
    assert "FAILED  A tiny set: cell 6 it was not run" in said


def test_what_is_as_it_was_handed_out_is_not_answered_yet(handout, capsys):
    check.check(handout / "ps0.ipynb")
    said = capsys.readouterr().out
    (line,) = [line for line in said.splitlines() if "A tiny set" in line]
    assert line == "empty  A tiny set: " + "; ".join(
        f"cell {at} is not answered yet" for at in (3, 5, 8)
    )
    assert "0 of 2 visible tests passed" in said


@pytest.mark.parametrize("name", ["title", "square-answer", "square-test", "words-answer"])
def test_a_deleted_cell_is_named_and_comes_back_in_its_place(name, release):
    original = nbformat.reads(release, as_version=4)
    said, notebook = mended(release, lambda n: n.cells.remove(cell_of(n, name)))
    (what,) = said
    assert what.endswith(" was missing; it is put back")
    assert names(notebook) == names(original)
    assert cell_of(notebook, name).source == cell_of(original, name).source


def test_cells_that_were_all_deleted_but_one_come_back_in_order(release):
    def edit(notebook):
        notebook.cells = [new_markdown_cell("mine"), cell_of(notebook, "half-answer")]

    said, notebook = mended(release, edit)
    assert names(notebook) == names(nbformat.reads(release, as_version=4))
    assert len(said) == 7


def test_of_copies_the_last_counts_as_for_nbgrader(release):
    def edit(notebook):
        twin = nbformat.from_dict(dict(cell_of(notebook, "half-answer")))
        twin.source = "half = 0.25"
        notebook.cells.append(twin)

    said, notebook = mended(release, edit)
    assert said[0] == "cell 5, answer of “A tiny set”: is there again as cell 9, which counts"
    assert cell_of(notebook, "half-answer").source == "half = 0.25"
    assert names(notebook).count("half-answer") == 1
    assert "order" in said[-1]


def _type(notebook):
    cell_of(notebook, "square-test").cell_type = "raw"
    for key in ("outputs", "execution_count"):
        cell_of(notebook, "square-test").pop(key)


def _points(notebook):
    cell_of(notebook, "square-test").metadata.nbgrader.points = 20


def _marks(notebook):
    cell_of(notebook, "square-test").metadata.nbgrader.grade = False


def _lock(notebook):
    cell_of(notebook, "square-test").metadata.editable = True


@pytest.mark.parametrize(
    ("edit", "word"),
    [
        (_type, "a raw cell"),
        (_points, "other points"),
        (_marks, "marks"),
        (_lock, "unlocked"),
    ],
)
def test_type_points_and_marks_are_put_back(edit, word, release):
    original = nbformat.reads(release, as_version=4)
    said, notebook = mended(release, edit)
    assert len(said) == 1
    assert word in said[0]
    assert cell_of(notebook, "square-test") == cell_of(original, "square-test")


def test_an_answer_that_was_made_another_type_keeps_its_words(release):
    def edit(notebook):
        cell = cell_of(notebook, "words-answer")
        cell.cell_type, cell.outputs, cell.execution_count = "code", [], None

    said, notebook = mended(release, edit)
    assert "was made a code cell" in said[0]
    assert cell_of(notebook, "words-answer").cell_type == "markdown"
    assert cell_of(notebook, "words-answer").source == "Signs."


def test_a_notebook_of_another_set_is_refused(release):
    def rename(notebook):
        for cell in notebook.cells:
            cell.metadata.nbgrader.grade_id += "-of-another"

    def unmark(notebook):
        for cell in notebook.cells:
            cell.metadata.clear()

    for edit in (rename, unmark):
        with pytest.raises(ValueError, match="not those of this problem set"):
            mended(release, edit)


@pytest.mark.parametrize(
    ("content", "word"),
    [
        (b"", "empty"),
        (b"no json", "damaged or no notebook"),
        (b'{"cells": 3}', "damaged or no notebook"),
        (b"\xff\xfe", "damaged or no notebook"),
        (b"%PDF-1.7", "a PDF or an archive"),
        (b'{\n<<<<<<< HEAD\n"a": 1\n=======\n>>>>>>> b\n}', "damaged or no notebook"),
    ],
)
def test_what_is_no_notebook_is_refused_in_one_line(content, word, handout):
    (handout / "ps0.ipynb").write_bytes(content)
    with pytest.raises(ValueError, match=word):
        check.check(handout / "ps0.ipynb")
    assert not (handout / "to_submit").exists()


def test_without_the_original_it_is_said_what_to_do(handout, monkeypatch, capsys):
    (handout / "original" / "ps0.ipynb").unlink()
    monkeypatch.setattr(sys, "argv", ["submission", str(handout / "ps0.ipynb")])
    with pytest.raises(SystemExit, match="unpack the handout again"):
        check.main()


def test_what_grading_would_refuse_is_said_before(handout, capsys):
    edited(handout, lambda notebook: None, **{"half-answer": "half = 0.5\nmath.isclose = print"})
    check.check(handout / "ps0.ipynb")
    said = capsys.readouterr().out
    assert "- cell 5, answer of “A tiny set”, line 2 " in said
    assert "replaces math.isclose: change it, or a person has to look" in said


def test_in_the_course_the_original_is_made_from_the_source(handout, tmp_path, monkeypatch, capsys):
    write_tiny_set(tmp_path / "course" / "notebooks" / "assignments")
    path = edited(handout, lambda notebook: None).rename(tmp_path / "ps0.ipynb")
    monkeypatch.chdir(tmp_path / "course")
    monkeypatch.setattr(sys, "argv", ["submission", str(path)])
    check.main()
    assert "2 of 2 visible tests passed" in capsys.readouterr().out
    assert (tmp_path / "to_submit" / "ps0.ipynb").exists()
    path = path.rename(tmp_path / "ps0 (1).ipynb")
    monkeypatch.setattr(sys, "argv", ["submission", str(path)])
    check.main()
    unknown = path.rename(tmp_path / "mine.ipynb")
    monkeypatch.setattr(sys, "argv", ["submission", str(unknown)])
    with pytest.raises(SystemExit, match="no problem set mine; there are: ps0"):
        check.main()


def test_a_test_that_is_hidden_as_a_whole_is_not_counted(release, capsys):
    notebook = nbformat.reads(release, as_version=4)
    cell_of(notebook, "half-test").source = "# the tests of this cell are hidden"
    cell_of(notebook, "square-test").execution_count = 1
    assert check._print_problems(notebook, notebook) == [True]
    assert "cell 6 has hidden tests only" in capsys.readouterr().out


def test_nothing_of_nbgrader_is_needed():
    code = "import sys; sys.modules['nbgrader'] = None; import rbclassroom.assignments.check"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_files_beside_the_notebook_are_there_when_it_runs(handout, capsys):
    (handout / "points.csv").write_text("1", encoding="utf-8")
    edited(
        handout,
        lambda notebook: None,
        **{"half-answer": "half = float(open('points.csv').read()) / 2"},
    )
    check.check(handout / "ps0.ipynb")
    assert "2 of 2 visible tests passed" in capsys.readouterr().out


def test_an_error_whose_output_is_lost_is_an_error():
    notebook = nbformat.v4.new_notebook(cells=[new_code_cell("1 / 0")])
    reply = {"status": "error", "ename": "ZeroDivisionError", "evalue": "by zero", "traceback": []}
    check._Client(notebook).on_cell_executed(notebook.cells[0], 0, {"content": reply})
    assert check._error(notebook.cells[0]) == "ZeroDivisionError: by zero"


def test_a_hint_speaks_for_itself():
    hint = {"ename": "NotYet", "evalue": "x and y are swapped.", "traceback": []}
    cell = new_code_cell("1", outputs=[nbformat.v4.new_output("error", **hint)])
    assert check._error(cell) == "x and y are swapped."


def test_what_an_output_widget_holds_stands_in_its_cell(handout, capsys):
    code = "from ipywidgets import Output\nhalf = 0.5\nwith Output():\n    print('inside')"
    edited(handout, lambda notebook: None, **{"half-answer": code})
    check.check(handout / "ps0.ipynb")
    assert "2 of 2 visible tests passed" in capsys.readouterr().out
    assert cell_of(submitted(handout), "half-answer").outputs[0].text == "inside\n"
