"""The problem sets: the reference passes, nothing passes, and each wrong answer gets its hint."""

import ast
import re
from importlib import import_module
from pathlib import Path
from textwrap import dedent, indent

import matplotlib.pyplot as plt
import nbformat
import numpy as np
import pytest
from wrong_answers import HELP, WRONG

from rbclassroom.assignments.marking import Mistake, Problem
from rbclassroom.assignments.marking_samplers import Sampler
from rbclassroom.assignments.student_code import NotYet

SOURCE = Path(__file__).parents[3] / "notebooks" / "assignments" / "source"
SETS = {path.stem: nbformat.read(path, as_version=4) for path in sorted(SOURCE.glob("*/*.ipynb"))}
TOPICS = ("plane", "arm", "rotations", "random", "geodesics", "acceleration", "bodies")
TESTS = [
    (name, cell.metadata.nbgrader.grade_id.removesuffix("-test"))
    for name, notebook in SETS.items()
    for cell in notebook.cells
    if cell.metadata.nbgrader.grade_id.endswith("-test")
]
FAILING = [(key, hint, body) for key, pairs in WRONG.items() for hint, body in pairs]


def cells(name):
    """The cells of a set by their grade_ids."""
    return {cell.metadata.nbgrader.grade_id: cell for cell in SETS[name].cells}


def visible(source):
    return re.sub(r"### BEGIN HIDDEN TESTS\n.*?### END HIDDEN TESTS", "", source, flags=re.DOTALL)


def head(source):
    """An answer as it is handed out: its first lines, without the solution."""
    return re.split(r" *### BEGIN SOLUTION", source)[0]


def try_answer(name, slug, answer, extra=""):
    """Run the test of a problem on an answer, after the reference answers of the others."""
    sources = {key: cell.source for key, cell in cells(name).items() if cell.cell_type == "code"}
    answers = [text for key, text in sources.items() if key.endswith("-answer")]
    space = {"__name__": "__main__"}
    for text in (sources["setup"], extra, *answers, answer, sources[f"{slug}-test"]):
        exec(compile(text, "<cell>", "exec"), space)


@pytest.fixture(autouse=True)
def no_figure_stays():
    yield
    plt.close("all")


@pytest.mark.parametrize(("name", "slug"), TESTS)
def test_the_reference_passes(name, slug):
    try_answer(name, slug, cells(name)[f"{slug}-answer"].source)


@pytest.mark.parametrize(("name", "slug"), TESTS)
def test_the_stub_is_told_that_nothing_is_written(name, slug):
    stub = head(cells(name)[f"{slug}-answer"].source) + "    raise NotImplementedError()"
    with pytest.raises(NotYet, match="Nothing is written here yet"):
        try_answer(name, slug, stub)


def answers(name):
    """The reference answers of a set, by the names of the functions."""
    sources = {key: cell.source for key, cell in cells(name).items() if cell.cell_type == "code"}
    space = {"__name__": "__main__"}
    for key, text in sources.items():
        if key == "setup" or key.endswith("-answer"):
            exec(compile(text, "<cell>", "exec"), space)
    return space


def in_tex(matrix):
    rows = (" & ".join(f"{x:.3g}" for x in row) for row in np.round(matrix, 3) + 0.0)
    return r"$\begin{pmatrix}" + r"\\ ".join(rows) + r"\end{pmatrix}$"


def place(numbers, form="g"):
    return f"({', '.join(f'{x:{form}}' for x in np.asarray(numbers) + 0.0)})"


def examples():
    """What each question gives as an example, from the reference answers."""
    one, two = answers("ps1"), answers("ps2")
    plan = [(np.array([1, 0, 0]), 3), (np.array([0, 0, 0.5]), 2)]
    poses = one["run_plan"](np.zeros(3), plan)
    seen = one["seen_from_body"](np.array([4, 2, np.pi / 2]), np.array([4.0, 5]))
    short = [
        np.degrees(one["short_way"](*np.radians(ends), 0.5)) for ends in ([170, -170], [20, 385])
    ]
    arm = one["arm_angles"](np.array([1.0, 2]), np.array([2, 1.5]))
    mirror = np.diag([1.0, 1, -1])
    return {
        ("ps1", "pose-matrix"): in_tex(one["pose_matrix"](np.array([4, 2, np.pi / 6]))),
        ("ps1", "seen"): f"the result is ${place(np.round(seen, 9))}$",
        ("ps1", "plan"): ", ".join(f"${place(pose)}$" for pose in poses),
        ("ps1", "short"): "half-way: {:.4g}. From 20 to 385, half-way: {:.4g}.".format(*short),
        ("ps1", "angles"): f"the result is, rounded, ${place(arm, '.2f')}$",
        ("ps2", "turn"): in_tex(two["turn_about"](np.ones(3), 2 * np.pi / 3)),
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
    given = re.compile(r"Examples?[:,]|rounded|\bit is \$|at the distance")
    assert {key for key, text in asked.items() if given.search(text)} == set(wanted)


@pytest.mark.parametrize(("key", "hint", "body"), FAILING)
def test_a_wrong_answer_gets_its_hint(key, hint, body):
    name, slug = key
    answer = head(cells(name)[f"{slug}-answer"].source) + indent(dedent(body).strip(), "    ")
    with pytest.raises(NotYet) as refused:
        try_answer(name, slug, answer, HELP)
    assert str(refused.value).startswith(hint)


def listed():
    """Every problem of the package, with its name."""
    modules = [import_module(f"rbclassroom.assignments.problems.{topic}") for topic in TOPICS]
    values = {name: value for module in modules for name, value in vars(module).items()}
    return {name: value for name, value in values.items() if isinstance(value, Problem | Sampler)}


@pytest.mark.parametrize(("name", "slug"), TESTS)
def test_lists_are_as_good_as_arrays(name, slug):
    """Whatever passes what students see must not fail for its type where they do not see."""
    source = cells(name)[f"{slug}-answer"].source
    if "(rng)" in source:
        return  # what is drawn is made an array first
    function = re.search(r"def (\w+)\(", source)[1]
    wrapped = f"{source}\n\n_inner = {function}\n\n\ndef {function}(*arguments):\n"
    wrapped += "    result = _inner(*arguments)\n    return np.asarray(result).tolist()\n"
    try_answer(name, slug, wrapped)


def test_every_listed_mistake_is_made_above():
    hints = {hint for _, hint, _ in FAILING}
    for name, problem in listed().items():
        for mistake in problem.mistakes:
            assert any(map(mistake.hint.startswith, hints)), (name, mistake.hint)


def test_every_problem_of_the_package_is_set_once():
    text = "\n".join(cell.source for notebook in SETS.values() for cell in notebook.cells)
    for name in listed():
        assert text.count(f"assert {name}.accepts(") == 1, name
    assert set(WRONG) == set(TESTS)


def test_no_two_mistakes_of_a_problem_have_one_hint():
    for name, problem in listed().items():
        starts = [mistake.hint[:30] for mistake in problem.mistakes]
        assert len(set(starts)) == len(starts), name
        assert all(isinstance(mistake, Mistake) for mistake in problem.mistakes)


def marks(cell):
    return cell.metadata.nbgrader


@pytest.mark.parametrize("name", SETS)
def test_a_set_has_what_a_set_needs(name):
    notebook = SETS[name]
    texts = [cell.source for cell in notebook.cells if cell.cell_type == "markdown"]
    problems = re.findall(
        r"^## Problem (\d) · .* \((\d+) points\)$", "\n".join(texts), re.MULTILINE
    )
    assert [int(number) for number, _ in problems] == list(range(1, len(problems) + 1))
    assert 3 <= len(problems) <= 6
    assert texts[0].startswith(f"# Problem set {name[2]}: ")
    assert "After this set you can" in texts[0]
    assert "**Mark scheme.**" in "".join(texts)
    assert any("draw_" in cell.source for cell in notebook.cells)
    assert f"rbclassroom.assignments.check {name}.ipynb" in texts[-1]


@pytest.mark.parametrize("name", SETS)
def test_the_points_of_cells_headings_and_the_set_agree(name):
    announced, given = {}, {}
    for cell in SETS[name].cells:
        if heading := re.match(r"## Problem (\d) · .* \((\d+) points\)", cell.source):
            problem = int(heading[1])
            announced[problem] = int(heading[2])
        if marks(cell).grade:
            given[problem] = given.get(problem, 0) + marks(cell).points
    assert given == announced
    (total,) = re.findall(r"There are (\d+) points", SETS[name].cells[0].source)
    assert sum(given.values()) == int(total)
    for cell in SETS[name].cells:
        for scheme in re.findall(r"\*\*Mark scheme.\*\*(.*)", cell.source):
            assert sum(map(int, re.findall(r"(\d) points?:", scheme))) == marks(cell).points


@pytest.mark.parametrize("name", SETS)
def test_every_cell_has_its_own_name_and_its_place_in_the_grading(name):
    ids = [marks(cell).grade_id for cell in SETS[name].cells]
    assert len(set(ids)) == len(ids)
    for cell in SETS[name].cells:
        assert re.fullmatch(r"[A-Za-z0-9_-]+", marks(cell).grade_id)
        assert marks(cell).schema_version == 3
        assert marks(cell).locked == (not marks(cell).solution)
        assert cell.get("outputs", []) == []


@pytest.mark.parametrize(("name", "slug"), TESTS)
def test_a_test_cell_ends_with_an_assertion_seen_and_unseen(name, slug):
    """Of a bare expression nbgrader takes the value for the points."""
    source = cells(name)[f"{slug}-test"].source
    assert source.count("### BEGIN HIDDEN TESTS") == source.count("### END HIDDEN TESTS") == 1
    for text in (source, visible(source)):
        last = ast.parse(text).body[-1]
        while isinstance(last, ast.For | ast.If):
            last = last.body[-1]
        assert isinstance(last, ast.Assert)


@pytest.mark.parametrize(("name", "slug"), TESTS)
def test_hidden_tests_need_nothing_of_the_package(name, slug):
    source = cells(name)[f"{slug}-test"].source
    hidden = source.partition("### BEGIN HIDDEN TESTS")[2]
    names = {node.id for node in ast.walk(ast.parse(hidden)) if isinstance(node, ast.Name)}
    own = {key for key in names if key.isupper() or key in ("rbcourse", "rb")}
    assert not {key for key in own if not key.startswith("DRAW_")}
    assert "import" not in hidden


@pytest.mark.parametrize(("name", "slug"), TESTS)
def test_hidden_tests_alone_refuse_what_only_looks_right(name, slug):
    """An answer that knows the visible inputs by heart and nothing else."""
    problem = listed()[re.search(r"assert (\w+)\.accepts", cells(name)[f"{slug}-test"].source)[1]]
    source = cells(name)[f"{slug}-answer"].source
    function = re.search(r"def (\w+)\(", source)[1]
    hidden = cells(name)[f"{slug}-test"].source.partition("### BEGIN HIDDEN TESTS")[2]
    space = {"__name__": "__main__"}
    exec(cells(name)["setup"].source, space)
    exec(re.search(r"from rbclassroom.*", cells(name)[f"{slug}-test"].source)[0], space)
    if isinstance(problem, Sampler):
        return
    space[function] = lambda *arguments: problem.answer(*problem.inputs[0])
    with pytest.raises((AssertionError, ValueError)):
        exec(hidden, space)


def test_the_example_of_the_page_for_teachers_runs():
    page = (SOURCE.parent / "README.md").read_text("utf-8")
    (code,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    start = "import numpy as np\ndef area(r): return {}"
    space = {"__name__": "__main__"}
    exec(start.format("np.pi * r * r") + "\n" + code, space)
    with pytest.raises(NotYet, match="This is the circumference"):
        exec(start.format("2 * np.pi * r") + "\n" + code, {"__name__": "__main__"})


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
