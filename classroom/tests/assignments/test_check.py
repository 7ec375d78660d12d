"""Test `check`: its report, and the file to submit."""

import os
import subprocess
import sys
import time
from functools import partial
from inspect import signature
from itertools import count
from types import SimpleNamespace

import nbformat
import pytest
from nbformat.v4 import new_code_cell, new_notebook, new_output
from tiny_set import answered, cell, write_tiny_set

from rbclassroom.assignments import check
from rbclassroom.assignments.autograding import BoxedExecute
from rbclassroom.assignments.locked_cells import grade_id
from rbclassroom.assignments.notebook_runner import BoundedClient
from rbclassroom.assignments.output_limit import TOO_MUCH
from rbclassroom.course.notebooks import KERNEL


@pytest.fixture
def hand_in(tmp_path, release):
    """Return a function that saves a student's notebook in the unpacked handout."""
    folder = tmp_path / "my folder ü" / "ps0"
    (folder / "original").mkdir(parents=True)
    (folder / "original" / "ps0.ipynb").write_text(release, encoding="utf-8")
    (folder / "original" / "table.csv").write_text("1", encoding="utf-8")

    def write(edit=None, name="ps0.ipynb", **answers):
        nbformat.write(answered(release, edit, **answers), folder / name)
        return folder / name

    return write


def submitted(path):
    return nbformat.read(path.parent / "to_submit" / "ps0.ipynb", as_version=4)


def test_check_writes_the_file_to_submit_without_nbgrader(hand_in):
    half = "half = float(open('table.csv').read()) / 2\nfrom ipywidgets import Output\n"
    half += "with Output():\n    print('inside')"
    run = "import runpy, sys; sys.modules['nbgrader'] = None; "
    run += "runpy.run_module('rbclassroom.assignments.check', run_name='__main__')"

    def change(notebook):
        notebook.metadata.kernelspec.name = "mine"
        notebook.cells.append(new_code_cell("import os; print('é∞', *sorted(os.listdir()))"))

    path = hand_in(change, half=half)
    (path.parent / "mine.csv").write_text("1", encoding="utf-8")
    before = path.read_bytes()
    os.utime(path, (3.156e8, 3.156e8))  # the date of files in a handout, 1980-01-01
    done = subprocess.run(
        [sys.executable, "-c", run, "ps0.ipynb"],
        cwd=path.parent,
        capture_output=True,
        encoding="ascii",
        env={**os.environ, "PYTHONIOENCODING": "ascii"},
    )
    assert (done.returncode, done.stderr) == (0, ""), done
    assert done.stdout.startswith("checking ps0.ipynb\n")
    assert "running cell 9 of 9" in done.stdout
    tests, last = done.stdout.splitlines()[-2:]
    assert tests == "2 of 2 visible tests passed; hidden tests run in grading"
    assert last.endswith("ps0.ipynb")
    # as in grading, only the files of the set are there
    assert submitted(path).cells[-1].outputs[0].text == "é∞ table.csv\n"
    assert submitted(path).metadata.kernelspec.name == "python3"
    # the output widget must not swallow the output
    assert cell(submitted(path), "half-answer").outputs[0].text == "inside\n"
    assert path.read_bytes() == before
    names = sorted(file.name for file in path.parent.rglob("*.*"))
    assert names == ["mine.csv", "ps0.ipynb", "ps0.ipynb", "ps0.ipynb", "table.csv"]


def test_the_file_is_written_even_if_answers_have_faults(hand_in, capsys, monkeypatch):
    def change(notebook):
        cell(notebook, "half-test").source = "assert True"
        notebook.cells.append(new_code_cell("open('made_by_a_run', 'w').close(); nowhere"))

    clock = vars(time) | {"monotonic": partial(next, count(0, 16))}
    monkeypatch.setattr(check, "time", SimpleNamespace(**clock))
    wrong = {"square": "def square(x):\n    return x", "half": "half = 5"}
    path = hand_in(change, name="ps0 (1).ipynb", **wrong)
    assert check.check(path) == path.parent / "to_submit" / "ps0.ipynb"
    said = capsys.readouterr().out
    for words in (
        "the file to hand in gets the name ps0.ipynb",
        "- cell 7, test of “A tiny set” was changed; it is restored, and its other text is in an",
        "- cell 10, added cell of “A tiny set” fails: NameError: name 'nowhere' is not",
        "FAILED  A tiny set\n        cell 4 AssertionError: times itself\n        cell 7 Assertion",
        "0 of 2 visible tests passed",
    ):
        assert words in said
    assert cell(submitted(path), "half-test").source.startswith("assert half < 1")
    slow = "took more than half of the 30 s that grading allows"
    assert said.count(slow) == 7  # in this test, every code cell counts as slow
    assert BoxedExecute().timeout == signature(check.check).parameters["seconds"].default == 30
    assert not (path.parent / "made_by_a_run").exists()


@pytest.fixture
def endless(monkeypatch, tmp_path):
    """Return a function that gives a time limit to a single cell: ``endless(name, patience)``.

    The function returns code that the cell runs before its endless loop. Then the limit begins.
    """

    def begin(name, patience):
        begun = tmp_path / "begun"

        def limit(cell):
            while grade_id(cell) == name and not begun.exists():
                time.sleep(0.01)
            return 0.1 if grade_id(cell) == name else None

        client = partial(check._Client, timeout_func=limit, iopub_timeout=patience)
        monkeypatch.setattr(check, "_Client", client)
        return f"open({str(begun)!r}, 'w').close()"

    return begin


def test_an_endless_loop_and_a_dead_kernel_are_reported(hand_in, capsys, endless):
    def ran_before(notebook):
        cell(notebook, "half-test").execution_count = 7

    begin = endless("square-answer", 600)
    printed = "import time\nfor text in ('x\\n' * 10**6, 'y'):\n    print(text, flush=True)"
    loop = f"{printed}\n{begin}\nwhile True:\n    print(time.sleep(0.001))"
    path = hand_in(ran_before, square=loop, half="import os\nos._exit(1)")
    check.check(path)
    said = capsys.readouterr().out
    assert "- cell 3, answer of “A tiny set” took longer than 30 s" in said
    assert "the output is too large" in said
    assert "more than half" not in said
    assert "the kernel died in cell 5" in said
    assert "cell 5 was not run to its end" in said
    assert "cell 6 not run" in said
    assert "0 of 2 visible tests passed" in said
    assert (path.parent / "to_submit" / "ps0.ipynb").stat().st_size < 3_000_000


def test_exit_and_input_are_reported_in_their_cells(hand_in, capsys):
    asks = "def square(x):\n    return x * int(input())\ninput()"
    check.check(hand_in(square=asks, half="exit()"))
    said = capsys.readouterr().out
    assert said.count("input() has no answer here") == 2
    assert "the kernel died in cell 5: the code called exit" in said
    assert "cell 5 was not run to its end" in said


@pytest.mark.skipif(os.name == "nt", reason="interrupts are not signals on Windows")
def test_a_cell_that_cannot_be_interrupted_ends_the_run(hand_in, capsys, endless):
    stuck = "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)"
    begin = endless("square-test", 1)
    check.check(hand_in(square=f"def square(x):\n    {stuck}; {begin}\n    while True: pass"))
    said = capsys.readouterr().out
    assert "took longer than 30 s" in said
    assert "the cells after cell 4 were not run" in said
    assert "FAILED  A tiny set\n        cell 4 " in said
    assert "0 of 2 visible tests passed" in said


def test_problems_without_an_answer_are_not_counted(release, capsys):
    notebook = nbformat.reads(release, as_version=4)
    assert check._print_problems(notebook, notebook) == [False, False]
    said = capsys.readouterr().out
    assert said.startswith("empty   A tiny set\n")
    assert said.count("is not answered yet\n") == 3
    cell(notebook, "half-test").source = "# the tests of this cell are hidden"
    cell(notebook, "square-test").execution_count = 1
    assert check._print_problems(notebook, notebook) == [True]
    assert "cell 6 has hidden tests only" in capsys.readouterr().out


def test_a_failure_names_the_failed_answer_that_it_calls(release, capsys):
    """The second answer is wrong only because it calls the first one."""
    notebook, original = (nbformat.reads(release, as_version=4) for _ in range(2))
    cell(notebook, "square-answer").source = "def square(x):\n    return x"
    cell(notebook, "half-answer").source = "half = square(0.7)"
    for name in ("square-test", "half-test"):
        cell(notebook, name).outputs = [new_output("error", ename="AssertionError", evalue="")]
    assert check._print_problems(notebook, original) == [False, False]
    said = capsys.readouterr().out
    assert said.count("(It calls square, which is not right yet.)") == 1


@pytest.mark.parametrize("content", [b"", b"%PDF-1.7", b"no json"])
def test_files_that_are_not_notebooks_are_refused(content, hand_in):
    path = hand_in()
    path.write_bytes(content)
    with pytest.raises(ValueError, match=r"ps0\.ipynb is "):
        check.check(path)
    assert not (path.parent / "to_submit").exists()


def test_a_missing_original_is_made_from_its_source(hand_in, tmp_path, monkeypatch, capsys):
    def checked(path):
        monkeypatch.setattr(sys, "argv", ["check", str(path)])
        check.main()

    path = hand_in()
    monkeypatch.chdir(tmp_path)
    (path.parent / "original" / "ps0.ipynb").unlink()
    with pytest.raises(SystemExit, match="unpack the handout again"):
        checked(path)
    write_tiny_set(tmp_path / "course" / "notebooks" / "assignments")
    monkeypatch.chdir(tmp_path / "course")
    with monkeypatch.context() as without_nbgrader:
        without_nbgrader.setitem(sys.modules, "rbclassroom.assignments.handout", None)
        with pytest.raises(SystemExit, match="unpack the handout again"):
            checked(path)
    monkeypatch.setattr(check, "_run", lambda *_: [])
    path = path.rename(tmp_path / "ps0 (1).ipynb")
    checked(path)
    assert cell(submitted(path), "half-test").source.startswith("assert half < 1")
    checked(path.rename(tmp_path / "mine.txt"))
    assert "the file to hand in gets the name ps0.ipynb" in capsys.readouterr().out
    with pytest.raises(SystemExit, match="is a file to hand in; check the notebook in"):
        checked(path.parent / "to_submit" / "ps0.ipynb")


def test_a_cell_that_stops_after_its_function_passes_as_in_grading(hand_in, capsys):
    check.check(hand_in(square="def square(x):\n    return x * x\n1 / 0"))
    said = capsys.readouterr().out
    assert "passed  A tiny set\n        cell 3 ZeroDivisionError: division by zero\n" in said
    assert "2 of 2 visible tests passed" in said


def test_functions_with_a_wrong_name_and_syntax_errors_are_reported(hand_in, capsys):
    path = hand_in(square="def squared(x):\n    return x * x", half="if 1\n    half = 0.5")
    check.check(path.parent)  # a folder stands for its notebook
    said = capsys.readouterr().out
    assert "name 'square' is not defined (cell 3 must define square.)" in said
    assert "SyntaxError: expected ':' (line 1)" in said


def test_errors_are_reported_even_if_their_output_is_lost():
    notebook = new_notebook(cells=[new_code_cell("1 / 0")])
    reply = {"status": "error", "ename": "ZeroDivisionError", "evalue": "by zero", "traceback": []}
    check._Client(notebook).on_cell_executed(notebook.cells[0], 0, {"content": reply})
    assert check._error(notebook.cells[0]) == "ZeroDivisionError: by zero"
    hint = new_output("error", ename="NotYet", evalue="x and y are swapped.", traceback=[])
    assert check._error(new_code_cell("1", outputs=[hint])) == "x and y are swapped."


def test_a_cell_that_prints_without_end_is_stopped_by_the_size_of_its_output(tmp_path):
    """Otherwise the text could fill the memory of the kernel before the time is over."""
    loop = "for n in range(1, 10_000):\n    print('x' * 9_999)"
    notebook = new_notebook(cells=[new_code_cell(loop), new_code_cell("print(n)")])
    client = BoundedClient(notebook, kernel_name=KERNEL["name"])
    client.folder = tmp_path
    client.execute(cwd=str(tmp_path))
    (printed, *_), (after,) = (cell.outputs for cell in notebook.cells)
    assert any(TOO_MUCH in output.get("evalue", "") for output in notebook.cells[0].outputs)
    assert len(printed.text) < 101_000
    assert after.text == "1001\n"  # each line has 10,000 characters, and 10,000,000 are allowed
