"""What a student is told before handing in, and the file that is to be submitted."""

import os
import subprocess
import sys
import time
from functools import partial
from hashlib import sha256
from inspect import signature
from itertools import count
from types import SimpleNamespace

import nbformat
import pytest
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook, new_output
from nbgrader.preprocessors import ClearHiddenTests, ClearSolutions, ComputeChecksums, LockCells
from tiny import MODULE
from tiny_set import ANSWERS, cell, write_tiny_set

from rbclassroom.assignments import check
from rbclassroom.assignments.autograding import BoxedExecute
from rbclassroom.assignments.locked_cells import grade_id, restore


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


def answered(release, edit=None, **answers):
    """The set with the right answers, but for those that are given, edited."""
    notebook = nbformat.reads(release, as_version=4)
    given = {f"{key}-answer": text for key, text in answers.items()}
    notebook.metadata.kernelspec.name = "mine"
    for name, source in {**ANSWERS, "words-answer": "Signs.", **given}.items():
        cell(notebook, name).source = source
    if edit:
        edit(notebook)
    return notebook


def hand_in(handout, release, edit=None, name="ps0.ipynb", **answers):
    """Write the student's file; return its path."""
    path = handout / "ps0.ipynb"
    path.write_text(nbformat.writes(answered(release, edit, **answers)), encoding="utf-8")
    return path.rename(handout / name)


def submitted(handout):
    return nbformat.read(handout / "to_submit" / "ps0.ipynb", as_version=4)


def test_an_answered_set_is_run_and_written(handout, release):
    (handout / "points.csv").write_text("1", encoding="utf-8")
    half = "half = float(open('points.csv').read()) / 2\nfrom ipywidgets import Output\n"
    half += "with Output():\n    print('inside')"
    added = new_code_cell("print('é∞', 1)")
    path = hand_in(handout, release, lambda notebook: notebook.cells.append(added), half=half)
    before = sha256(path.read_bytes()).digest()
    done = subprocess.run(
        [*MODULE, "rbclassroom.assignments.check", "ps0.ipynb"],
        cwd=handout,
        capture_output=True,
        encoding="ascii",
        env={**os.environ, "PYTHONIOENCODING": "ascii"},
    )
    assert (done.returncode, done.stderr) == (0, ""), done
    assert "running cell 9 of 9" in done.stdout
    last = done.stdout.splitlines()[-1]
    assert last.startswith("2 of 2 visible tests passed; hidden tests run when it is graded")
    assert last.endswith("ps0.ipynb")
    assert submitted(handout).cells[-1].outputs[0].text == "é∞ 1\n"
    assert submitted(handout).metadata.kernelspec.name == "python3"
    # an output widget keeps nothing for itself
    assert cell(submitted(handout), "half-answer").outputs[0].text == "inside\n"
    assert sha256(path.read_bytes()).digest() == before
    names = sorted(file.name for file in handout.rglob("*.*"))
    assert names == ["points.csv", "ps0.ipynb", "ps0.ipynb", "ps0.ipynb"]


def test_faults_are_named_and_do_not_keep_from_handing_in(handout, release, capsys, monkeypatch):
    def change(notebook):
        cell(notebook, "half-test").source = "assert True"
        notebook.cells.append(new_code_cell("open('made_by_a_run', 'w').close(); nowhere"))

    clock = vars(time) | {"monotonic": partial(next, count(0, 16))}
    monkeypatch.setattr(check, "time", SimpleNamespace(**clock))
    path = hand_in(
        handout,
        release,
        change,
        name="ps0 (1).ipynb",
        square="def square(x):\n    return x",
        half="half = 5\nmath.isclose = print",
    )
    assert check.check(path) == handout / "to_submit" / "ps0.ipynb"
    said = capsys.readouterr().out
    assert "submitted under the name ps0.ipynb" in said
    assert "- cell 6, test of “A tiny set” was changed; it is put back\n" in said
    assert cell(submitted(handout), "half-test").source.startswith("assert half < 1")
    forbidden = "replaces math.isclose: change it, or a person has to look"
    assert f"- cell 5, answer of “A tiny set”, line 2 {forbidden}" in said
    assert "- cell 9, added cell of “A tiny set” fails: NameError: name 'nowhere' is not" in said
    hint = "cell 4 AssertionError: times itself; cell 6 AssertionError; cell 8 is graded by"
    assert f"FAILED  A tiny set: {hint}" in said
    assert "0 of 2 visible tests passed" in said
    slow = "took more than half of the 30 s that grading allows"
    assert said.count(slow) == 6  # of each cell with code, for the clock jumps
    assert BoxedExecute().timeout == signature(check.check).parameters["seconds"].default == 30
    assert not (handout / "made_by_a_run").exists()


@pytest.fixture
def endless(monkeypatch, tmp_path):
    """``endless(name, patience)``: only that cell has a limit, which begins with its loop.

    The loop begins when it has run the code that is returned.
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


def test_an_endless_loop_is_stopped_and_named_and_its_output_is_cut(
    handout, release, capsys, endless
):
    begin = endless("square-answer", 600)
    printed = "import time\nfor text in ('x\\n' * 10**6, 'y'):\n    print(text, flush=True)"
    loop = f"{printed}\n{begin}\nwhile True:\n    print(time.sleep(0.001))"
    check.check(hand_in(handout, release, square=loop))
    said = capsys.readouterr().out
    assert "- cell 3, answer of “A tiny set” took longer than 30 s" in said
    assert "the output is too large" in said
    assert "more than half" not in said
    assert "1 of 2 visible tests passed" in said
    assert (handout / "to_submit" / "ps0.ipynb").stat().st_size < 3_000_000


@pytest.mark.skipif(os.name == "nt", reason="there interrupts are no signals")
def test_a_loop_that_cannot_be_stopped_ends_the_run(handout, release, capsys, endless):
    begin = endless("square-test", 1)
    square = f"""def square(x):
        import signal
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        {begin}
        while True:
            pass
    """
    check.check(hand_in(handout, release, square=square))
    said = capsys.readouterr().out
    assert "took longer than 30 s" in said
    assert "the cells after cell 4 were not run" in said
    assert "FAILED  A tiny set: cell 4 " in said
    assert "0 of 2 visible tests passed" in said


def test_a_dead_kernel_is_named(handout, release, capsys):
    def ran_before(notebook):
        cell(notebook, "half-test").execution_count = 7

    check.check(hand_in(handout, release, ran_before, half="import os\nos._exit(1)"))
    said = capsys.readouterr().out
    assert "the kernel died in cell 5" in said
    assert "1 of 2 visible tests passed" in said
    assert "FAILED  A tiny set: cell 6 it was not run" in said


def test_problems_without_an_answer_and_hidden_tests_are_not_counted(release, capsys):
    notebook = nbformat.reads(release, as_version=4)
    assert check._print_problems(notebook, notebook) == [False, False]
    empty = "; ".join(f"cell {at} is not answered yet" for at in (3, 5, 8))
    assert capsys.readouterr().out == f"empty  A tiny set: {empty}\n"
    cell(notebook, "half-test").source = "# the tests of this cell are hidden"
    cell(notebook, "square-test").execution_count = 1
    assert check._print_problems(notebook, notebook) == [True]
    assert "cell 6 has hidden tests only" in capsys.readouterr().out


def without(name):
    return lambda notebook: notebook.cells.remove(cell(notebook, name))


def with_test(edit):
    return lambda notebook: edit(cell(notebook, "square-test"))


def keep_one(notebook):
    notebook.cells = [new_markdown_cell("mine"), cell(notebook, "half-answer")]


def copy_answer(notebook):
    twin = nbformat.from_dict(dict(cell(notebook, "half-answer")))
    cell(notebook, "half-answer").source = "half = 0.25"
    notebook.cells.append(twin)


def make_code(notebook):
    words = cell(notebook, "words-answer")
    words.cell_type, words.outputs, words.execution_count = "code", [], None


def make_raw(test):
    test.cell_type = "raw"
    del test["outputs"], test["execution_count"]


TEST = "cell 4, test of “A tiny set”"


@pytest.mark.parametrize(
    ("edit", "said"),
    [
        (without("title"), ["cell 1, locked cell of “A tiny set” was missing; it is put back"]),
        (without("square-answer"), ["cell 3, answer of “A tiny set” was missing; it is put back"]),
        (without("square-test"), [f"{TEST} was missing; it is put back"]),
        (without("words-answer"), ["cell 8, answer of “A tiny set” was missing; it is put back"]),
        (keep_one, ["was missing; it is put back"] * 7),
        (copy_answer, ["cell 5, answer of “A tiny set”: is there again as cell 9", "order"]),
        (make_code, ["cell 8, answer of “A tiny set” was made a code cell; it is put back"]),
        (with_test(make_raw), [f"{TEST} was made a raw cell; it is put back"]),
        (with_test(lambda t: t.metadata.nbgrader.update(points=20)), [f"{TEST} has other points"]),
        (
            with_test(lambda t: t.metadata.nbgrader.update(grade=False)),
            ["has other points or marks"],
        ),
        (with_test(lambda t: t.metadata.update(editable=True)), [f"{TEST} was unlocked; it is"]),
    ],
)
def test_locked_cells_are_put_back_and_answers_kept(release, edit, said):
    original, notebook = nbformat.reads(release, as_version=4), answered(release, edit)
    there = {grade_id(each): each.source for each in notebook.cells}  # of copies the last
    given = restore(notebook, original)
    nbformat.validate(notebook)
    assert all(map(str.__contains__, given, said))
    assert len(given) == len(said)
    names, wanted = (
        list(filter(None, map(grade_id, notebook.cells))),
        [*map(grade_id, original.cells)],
    )
    assert names == wanted or ("order" in said and sorted(names) == sorted(wanted))
    for name, each in zip(wanted, original.cells, strict=True):
        if each.metadata.nbgrader.solution:
            each.source = there.get(name, each.source)
        found = cell(notebook, name)
        assert {**found, "id": ""} == {**each, "id": ""}
        assert found.id == each.id or "order" in said


def test_a_notebook_of_another_set_is_refused(release):
    original = nbformat.reads(release, as_version=4)
    renamed, unmarked = answered(release), answered(release)
    for one, other in zip(renamed.cells, unmarked.cells, strict=True):
        one.metadata.nbgrader.grade_id += "-of-another"
        other.metadata.clear()
    for notebook in (renamed, unmarked):
        with pytest.raises(ValueError, match="not those of this problem set"):
            restore(notebook, original)


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
def test_a_file_that_is_no_notebook_is_refused_in_one_line(content, word, handout):
    (handout / "ps0.ipynb").write_bytes(content)
    with pytest.raises(ValueError, match=word):
        check.check(handout / "ps0.ipynb")
    assert not (handout / "to_submit").exists()


def checked(path, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["check", str(path)])
    check.main()


def test_without_the_original_the_message_says_what_to_do(handout, monkeypatch):
    (handout / "original" / "ps0.ipynb").unlink()
    with pytest.raises(SystemExit, match="unpack the handout again"):
        checked(handout / "ps0.ipynb", monkeypatch)


def test_in_the_course_the_original_is_made_from_the_source(
    handout, release, tmp_path, monkeypatch, capsys
):
    write_tiny_set(tmp_path / "course" / "notebooks" / "assignments")
    path = hand_in(handout, release).rename(tmp_path / "ps0 (1).ipynb")
    monkeypatch.chdir(tmp_path / "course")
    checked(path, monkeypatch)
    assert "2 of 2 visible tests passed" in capsys.readouterr().out
    assert (tmp_path / "to_submit" / "ps0.ipynb").exists()
    with pytest.raises(SystemExit, match="no problem set mine; there are: ps0"):
        checked(path.rename(tmp_path / "mine.ipynb"), monkeypatch)


def test_check_needs_nothing_of_nbgrader():
    code = "import sys; sys.modules['nbgrader'] = None; import rbclassroom.assignments.check"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_an_error_whose_output_is_lost_is_an_error():
    notebook = new_notebook(cells=[new_code_cell("1 / 0")])
    reply = {"status": "error", "ename": "ZeroDivisionError", "evalue": "by zero", "traceback": []}
    check._Client(notebook).on_cell_executed(notebook.cells[0], 0, {"content": reply})
    assert check._error(notebook.cells[0]) == "ZeroDivisionError: by zero"


def test_a_hint_is_shown_without_the_name_of_the_error():
    hint = new_output("error", ename="NotYet", evalue="x and y are swapped.", traceback=[])
    assert check._error(new_code_cell("1", outputs=[hint])) == "x and y are swapped."
