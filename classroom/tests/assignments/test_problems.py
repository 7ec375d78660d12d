"""Test the problem sets: reference answers pass, and wrong answers get their hints."""

import ast
import contextlib
import functools
import re
import shutil
import sys
import tomllib
from dataclasses import replace
from pathlib import Path
from textwrap import indent
from types import SimpleNamespace

import matplotlib.pyplot as plt
import nbformat
import numpy as np
import pytest
from nbformat.v4 import new_code_cell, new_notebook

from rbclassroom.assignments.marking import NotYet
from rbclassroom.assignments.problems import problem
from rbclassroom.assignments.tables import update

SOURCE = Path(__file__).parents[3] / "notebooks" / "assignments" / "source"
SETS = {path.stem: nbformat.read(path, as_version=4) for path in sorted(SOURCE.glob("*/*.ipynb"))}
TABLES = {name: tomllib.loads((SOURCE / f"{name}.toml").read_text("utf-8")) for name in SETS}
TESTS = [
    (name, cell.metadata.nbgrader.grade_id.removesuffix("-test"))
    for name, notebook in SETS.items()
    for cell in notebook.cells
    if cell.metadata.nbgrader.grade_id.endswith("-test")
]
QUICK = "ps1", "ps2", "ps7", "ps8"  # sets that CI tests in all ways
problems = pytest.mark.parametrize(("name", "slug"), TESTS)
repeated = pytest.mark.parametrize(
    ("name", "slug"),
    [pytest.param(*x, marks=[pytest.mark.slow] * (x[0] not in QUICK)) for x in TESTS],
)
sets = pytest.mark.parametrize("name", SETS)


def cells(name):
    return {cell.metadata.nbgrader.grade_id: cell for cell in SETS[name].cells}


@functools.cache
def compiled(text):
    return compile(text, "<cell>", "exec")


def namespace(name, *further):
    """Run the answers of a notebook, and then `further` code; return the variables."""
    sources = {key: cell.source for key, cell in cells(name).items() if cell.cell_type == "code"}
    answers = [text for key, text in sources.items() if key.endswith("-answer")]
    space = {"__name__": "__main__"}
    with contextlib.chdir(SOURCE / name):
        for text in (sources["setup"], TABLES[name]["helpers"], *answers, *further):
            exec(compiled(text), space)
    return space


def head(name, slug):
    """Return the code before the solution in an answer, and the function's name."""
    text = re.split(r" *### BEGIN SOLUTION", cells(name)[f"{slug}-answer"].source)[0]
    return text, re.search(r"def (\w+)\(", text)[1]


def known(name, slug):
    with contextlib.chdir(SOURCE / name):
        return problem(name, slug)


@pytest.fixture(autouse=True)
def no_figure_stays():
    yield
    plt.close("all")


@repeated
def test_reference_answers_pass_even_if_they_return_lists(name, slug):
    """If an answer that returns lists passes the visible tests, it must pass the hidden tests."""
    start, function = head(name, slug)
    test = cells(name)[f"{slug}-test"].source
    with pytest.raises(NotYet, match="Write your answer in place of it"):
        namespace(name, f"{start}    raise NotImplementedError()", test)
    listed = f"_inner = {function}\n\n\ndef {function}(*arguments):\n"
    listed += "    result = _inner(*arguments)\n    return np.asarray(result).tolist()\n"
    random = "law" in TABLES[name][slug]  # draws of a sampler are first converted to an array
    for wrapper in [""] if random else ["", listed]:
        namespace(name, wrapper, test)


@repeated
def test_wrong_answers_get_their_hints(name, slug):
    """To save time, only the first wrong sampler makes as many draws as a student's sampler.

    The others make fewer draws, so their errors are harder to detect and to distinguish.
    """
    start, function = head(name, slug)
    judge, seed = known(name, slug), [5] if "law" in TABLES[name][slug] else []
    mistakes = TABLES[name][slug]["mistakes"]
    assert len({mistake["hint"][:30] for mistake in mistakes}) == len(mistakes) >= 4
    for mistake in mistakes:
        for code in mistake["code"]:
            space = namespace(name, start + indent(code.strip(), "    "))
            with pytest.raises(NotYet) as told:
                judge.accepts(space[function], *seed)
            assert str(told.value) == mistake["hint"], code
            judge = replace(judge, draws=8000) if seed else judge


def test_a_change_of_the_folder_does_not_hide_the_data(monkeypatch, tmp_path):
    """The code of a student may leave the folder in which its kernel was started."""
    update(SOURCE / "ps1")
    shell = SimpleNamespace(starting_dir=str(SOURCE / "ps1"))
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=lambda: shell))
    monkeypatch.chdir(tmp_path)
    assert problem("ps1", "seen").names == ["pose", "point"]


@problems
def test_the_lesson_to_read_again_has_the_section(name, slug):
    lesson, section = re.fullmatch(
        r"lesson (\d+), section (\d+)", TABLES[name][slug]["read"]
    ).groups()
    (path,) = SOURCE.parents[1].glob(f"{int(lesson):02}_*.ipynb")
    assert path.read_text("utf-8").count(f'"## {section} · ') == 1
    assert known(name, slug)


def in_tex(matrix):
    rows = (" & ".join(f"{x:.3g}" for x in row) for row in np.round(matrix, 3) + 0.0)
    return r"$\begin{pmatrix}" + r"\\ ".join(rows) + r"\end{pmatrix}$"


def place(numbers, form="g"):
    return f"({', '.join(f'{x:{form}}' for x in np.asarray(numbers) + 0.0)})"


def examples():
    """Return the examples in the questions, computed by the reference answers."""
    one, two = namespace("ps1"), namespace("ps2")
    plan = [(np.array([1, 0, 0]), 3), (np.array([0, 0, 0.5]), 2)]
    poses = one["run_plan"](np.zeros(3), plan)
    seen = one["seen_from_body"](np.array([4, 2, np.pi / 2]), np.array([4.0, 5]))
    short = [np.degrees(one["short_way"](*np.radians(x), 0.5)) for x in ([170, -170], [20, 385])]
    arm = one["arm_angles"](np.array([1.0, 2]), np.array([2, 1.5]))
    mirror = np.diag([1.0, 1, -1])
    return {
        ("ps1", "pose-matrix"): in_tex(one["pose_matrix"](np.array([4, 2, np.pi / 6]))),
        ("ps1", "seen"): f"the result is ${place(np.round(seen, 9))}$",
        ("ps1", "plan"): ", ".join(f"${place(pose)}$" for pose in poses),
        ("ps1", "short"): "is {:.4g}. Half-way from 20 to 385 it is {:.4g}.".format(*short),
        ("ps1", "angles"): f"the result is, rounded, ${place(arm, '.2f')}$",
        ("ps2", "turn"): in_tex(two["exp_so3"](2 * np.pi / 3 * np.ones(3) / np.sqrt(3))),
        ("ps2", "far"): f"is at the distance {two['how_far'](mirror):.9g}",
    }


def test_the_examples_in_the_questions_are_right():
    wanted = examples()
    asked = {
        (name, key.removesuffix("-question")): cell.source
        for name in SETS
        for key, cell in cells(name).items()
        if key.endswith("-question")
    }
    for key, text in wanted.items():
        assert text in asked[key], key
    given = re.compile(r"Examples?[:,]|rounded|\bmatrix is \$|at the distance")
    assert {key for key, text in asked.items() if given.search(text)} == set(wanted)


@sets
def test_each_set_is_complete(name):
    notebook = SETS[name]
    texts = [cell.source for cell in notebook.cells if cell.cell_type == "markdown"]
    assert texts[0].startswith(f"# Problem set {name[2]}: ")
    assert "After this set you can" in texts[0]
    assert "**Mark scheme.**" in "".join(texts)
    assert any("draw_" in cell.source for cell in notebook.cells)
    assert f"course.py check work/{name}/{name}.ipynb" in texts[-1]
    for cell in notebook.cells:
        assert cell.metadata.nbgrader.locked != cell.metadata.nbgrader.solution
        assert not cell.get("outputs")


@sets
def test_the_points_of_the_problems_add_up(name):
    announced, given = {}, {}
    for cell in SETS[name].cells:
        points = cell.metadata.nbgrader.get("points", 0)
        if heading := re.match(r"## Problem (\d) · .* \((\d+) points?\)", cell.source):
            problem = int(heading[1])
            announced[problem] = int(heading[2])
        if cell.metadata.nbgrader.grade:
            given[problem] = given.get(problem, 0) + points
        for scheme in re.findall(r"\*\*Mark scheme.\*\*(.*)", cell.source):
            assert sum(map(int, re.findall(r"(\d) points?:", scheme))) == points
    assert given == announced
    assert list(announced) in [list(range(1, count + 1)) for count in (3, 4, 5, 6)]
    (total,) = re.findall(r"There are (\d+) points", SETS[name].cells[0].source)
    assert sum(given.values()) == int(total)


@problems
def test_each_test_cell_ends_with_an_assertion(name, slug):
    """nbgrader would use the value of a final expression as the points."""
    source = cells(name)[f"{slug}-test"].source
    visible, hidden, end = re.split(r"### (?:BEGIN|END) HIDDEN TESTS", source)
    for text in (source, visible + end):
        last = ast.parse(text).body[-1]
        while isinstance(last, ast.For | ast.If):
            last = last.body[-1]
        assert isinstance(last, ast.Assert)
    names = {node.id for node in ast.walk(ast.parse(hidden)) if isinstance(node, ast.Name)}
    assert not names & {"rbcourse", "rb"}
    assert "import" not in hidden


@problems
def test_hidden_tests_refuse_memorised_answers(name, slug):
    if "law" in TABLES[name][slug]:
        return
    hidden = cells(name)[f"{slug}-test"].source.partition("### BEGIN HIDDEN TESTS")[2]
    answer = known(name, slug).answers[0]
    space = {"__name__": "__main__", "problem": problem}
    exec(cells(name)["setup"].source, space)
    space[head(name, slug)[1]] = lambda *arguments: answer
    with contextlib.chdir(SOURCE / name), pytest.raises((AssertionError, ValueError)):
        exec(hidden, space)


def test_the_example_on_the_page_for_teachers_runs(tmp_path, monkeypatch):
    page = (SOURCE.parent / "README.md").read_text("utf-8")
    (table,) = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)
    (test,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    start, right = "def area(r):\n", "    return np.pi * r * r"
    solution = f"{start}    ### BEGIN SOLUTION\n{right}\n    ### END SOLUTION"
    names = {"setup": "import numpy as np", "area-answer": solution, "area-test": test}
    given = [new_code_cell(text) for text in names.values()]
    for cell, name in zip(given, names, strict=True):
        cell.metadata.nbgrader = {"grade_id": name}
    folder = tmp_path / "ps10"
    folder.mkdir()
    (tmp_path / "ps10.toml").write_text(table, "utf-8")
    nbformat.write(new_notebook(cells=given), folder / "ps10.ipynb")
    monkeypatch.chdir(folder)
    start = f"import numpy as np\n{start}"
    exec(f"{start}{right}\n{test}", {"__name__": "__main__"})
    with pytest.raises(NotYet, match="This is the circumference"):
        exec(f"{start}    return 2 * np.pi * r\n{test}", {"__name__": "__main__"})


def test_missing_or_broken_tables_and_data_are_reported(tmp_path, monkeypatch):
    shutil.copytree(SOURCE / "ps2", tmp_path / "ps2", ignore=shutil.ignore_patterns("*.json"))
    monkeypatch.chdir(tmp_path / "ps2")
    with pytest.raises(NotYet, match=r"^ps2\.json is missing"):
        problem("ps2", "turn")
    with pytest.raises(ValueError, match=r"ps2\.toml is missing, and the tests of ps2\.ipynb need"):
        update(tmp_path / "ps2")
    for text, said in (
        ("[turn", r"^ps2\.toml: "),
        ("[turn]\ninputs = 1", r"^ps2\.toml, turn: mistakes is missing"),
        ("[turn]\nmistakes = []\ninput = 1", r"^ps2\.toml, turn: input is not one of accuracy"),
        ("[turn]\nmistakes = [{hint = '', cod = ''}]", r"turn, mistake 1: cod is not one of code"),
        ("[turn]\nmistakes = ['a']", r"turn, mistake 1: a table is wanted, got 'a'"),
        ("helper = 'a'", r"^ps2\.toml, helper: a table is wanted, got 'a'"),
        ("[turn]\nmistakes = []\ninputs = 1", r"^ps2\.toml, turn: TypeError"),
    ):
        (tmp_path / "ps2.toml").write_text(text, "utf-8")
        with pytest.raises(ValueError, match=said):
            update(tmp_path / "ps2")
    assert not (tmp_path / "ps2" / "ps2.json").exists()


def test_the_page_for_teachers_lists_the_sets():
    page = (SOURCE.parent / "README.md").read_text("utf-8")
    rows = re.findall(r"^\| (ps\d) \| (.*?) \| (.*?) \| (\d+) \|$", page, re.MULTILINE)
    assert [row[0] for row in rows] == list(SETS)
    for name, lessons, problems, points in rows:
        headings = re.findall(r"^## Problem", "\n".join(c.source for c in SETS[name].cells), re.M)
        assert len(problems.split("; ")) == len(headings)
        assert f"There are {points} points" in SETS[name].cells[0].source
        for lesson in re.findall(r"\d+", lessons):
            assert f"{int(lesson)}" in SETS[name].cells[0].source
