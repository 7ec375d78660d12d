"""The problem sets: the reference passes, nothing passes, and each wrong answer gets its hint."""

import ast
import contextlib
import re
import shutil
import tomllib
from pathlib import Path
from textwrap import dedent, indent

import matplotlib.pyplot as plt
import nbformat
import numpy as np
import pytest
from nbformat.v4 import new_code_cell, new_notebook

from rbclassroom.assignments.problems import problem
from rbclassroom.assignments.student_code import NotYet
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
GENERIC = [  # faults that need no table
    (
        ("ps1", "plan"),
        "Your function changes the arguments",
        """
        poses = [start.copy()]
        for v, d in plan:
            start += v * d
            poses.append(start.copy())
        return np.array(poses)
        """,
    ),
    (
        ("ps1", "tip"),
        "The curves are right. The y axis needs a label",
        """
        q = start + np.linspace(0, 1, 41)[:, None] * (goal - start)
        x = lengths[0] * np.cos(q[:, 0]) + lengths[1] * np.cos(q.sum(axis=1))
        y = lengths[0] * np.sin(q[:, 0]) + lengths[1] * np.sin(q.sum(axis=1))
        ax.plot(x, y)
        ax.set_xlabel("x [m]")
        """,
    ),
    (("ps1", "tip"), "Nothing was drawn on the axes", "plt.figure()"),
    (("ps3", "direction"), "A direction has the length 1", "return rng.normal(size=3)"),
    (
        ("ps3", "direction"),
        "Every call returns the same draw",
        """
        rng = np.random.default_rng(0)
        p = rng.normal(size=3)
        return p / np.linalg.norm(p)
        """,
    ),
    (
        ("ps3", "quaternion"),
        "The length is between 0.71 and 1",
        """
        s, a, b = rng.random(), 2 * np.pi * rng.random(), 2 * np.pi * rng.random()
        r = 1 - s
        return np.array([s * np.cos(b), r * np.sin(a), r * np.cos(a), s * np.sin(b)])
        """,
    ),
    (("ps3", "quaternion"), "A unit quaternion has the length 1", "return rng.normal(size=4)"),
    (
        ("ps3", "rotation"),
        "A draw is no rotation. If you reflect",
        """
        a, b, z = 2 * np.pi * rng.random(), 2 * np.pi * rng.random(), rng.random()
        V = np.array([np.cos(b) * z, np.sin(b) * z, np.sqrt(1 - z)])
        return -(np.eye(3) - 2 * np.outer(V, V)) @ RZ(a)
        """,
    ),
    (
        ("ps3", "rotation"),
        "The determinant is −1 for all",
        """
        a, b, z = 2 * np.pi * rng.random(), 2 * np.pi * rng.random(), rng.random()
        V = np.array([np.cos(b) * np.sqrt(z), np.sin(b) * np.sqrt(z), np.sqrt(1 - z)])
        return (np.eye(3) - 2 * np.outer(V, V)) @ RZ(a)
        """,
    ),
    (
        ("ps3", "rotation"),
        "The determinant is −1 for ",
        """
        Q, R = np.linalg.qr(rng.normal(size=(3, 3)))
        return Q * np.sign(np.diag(R))
        """,
    ),
    (
        ("ps3", "rotation"),
        "A draw is no rotation: its singular values",
        "return rng.normal(size=(3, 3))",
    ),
]
FAILING = [
    ((name, slug), mistake["hint"], code)
    for name, slug in TESTS
    for mistake in TABLES[name][slug]["mistakes"]
    for code in mistake["code"]
] + GENERIC


def cells(name):
    """The cells of a set by their grade_ids."""
    return {cell.metadata.nbgrader.grade_id: cell for cell in SETS[name].cells}


def visible(source):
    return re.sub(r"### BEGIN HIDDEN TESTS\n.*?### END HIDDEN TESTS", "", source, flags=re.DOTALL)


def head(source):
    """An answer as it is handed out: its first lines, without the solution."""
    return re.split(r" *### BEGIN SOLUTION", source)[0]


def try_answer(name, slug, answer):
    """Run the test of a problem on an answer, after the reference answers of the others."""
    sources = {key: cell.source for key, cell in cells(name).items() if cell.cell_type == "code"}
    answers = [text for key, text in sources.items() if key.endswith("-answer")]
    space = {"__name__": "__main__"}
    own = TABLES[name]["helpers"]
    with contextlib.chdir(SOURCE / name):
        for text in (sources["setup"], own, *answers, answer, sources[f"{slug}-test"]):
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


@pytest.mark.parametrize(("key", "hint", "body"), FAILING, ids=range(len(FAILING)))
def test_a_wrong_answer_gets_its_hint(key, hint, body):
    name, slug = key
    answer = head(cells(name)[f"{slug}-answer"].source) + indent(dedent(body).strip(), "    ")
    with pytest.raises(NotYet) as refused:
        try_answer(name, slug, answer)
    assert str(refused.value).startswith(hint)


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


def test_every_problem_is_in_the_table_of_its_set():
    for name, table in TABLES.items():
        assert {slug for slug in table if slug != "helpers"} == {s for n, s in TESTS if n == name}
        for slug, problem_data in table.items():
            if slug != "helpers":
                assert {"inputs", "law"} & set(problem_data)
                starts = [mistake["hint"][:30] for mistake in problem_data["mistakes"]]
                assert len(set(starts)) == len(starts) >= 4, slug


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
    assert not {key for key in names if key in ("rbcourse", "rb")}
    assert "import" not in hidden


@pytest.mark.parametrize(("name", "slug"), TESTS)
def test_hidden_tests_alone_refuse_what_only_looks_right(name, slug):
    """An answer that knows the visible inputs by heart and nothing else."""
    source = cells(name)[f"{slug}-answer"].source
    function = re.search(r"def (\w+)\(", source)[1]
    hidden = cells(name)[f"{slug}-test"].source.partition("### BEGIN HIDDEN TESTS")[2]
    space = {"__name__": "__main__", "problem": problem}
    exec(cells(name)["setup"].source, space)
    with contextlib.chdir(SOURCE / name):
        known = problem(name, slug)
        if "law" in TABLES[name][slug]:
            return
        space[function] = lambda *arguments: known.answers[0]
        with pytest.raises((AssertionError, ValueError)):
            exec(hidden, space)


def test_the_example_of_the_page_for_teachers_runs(tmp_path, monkeypatch):
    page = (SOURCE.parent / "README.md").read_text("utf-8")
    (table,) = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)
    (test,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    head, right = "def area(r):\n", "    return np.pi * r * r"
    solution = f"{head}    ### BEGIN SOLUTION\n{right}\n    ### END SOLUTION"
    names = {"setup": "import numpy as np", "area-answer": solution, "area-test": test}
    given = [new_code_cell(text) for text in names.values()]
    for cell, name in zip(given, names, strict=True):
        cell.metadata.nbgrader = {"grade_id": name}
    folder = tmp_path / "ps9"
    folder.mkdir()
    (tmp_path / "ps9.toml").write_text(table, "utf-8")
    nbformat.write(new_notebook(cells=given), folder / "ps9.ipynb")
    monkeypatch.chdir(folder)
    start = f"import numpy as np\n{head}"
    exec(f"{start}{right}\n{test}", {"__name__": "__main__"})
    with pytest.raises(NotYet, match="This is the circumference"):
        exec(f"{start}    return 2 * np.pi * r\n{test}", {"__name__": "__main__"})


def test_missing_or_broken_tables_and_data_are_named(tmp_path, monkeypatch):
    shutil.copytree(SOURCE / "ps2", tmp_path / "ps2", ignore=shutil.ignore_patterns("*.json"))
    monkeypatch.chdir(tmp_path / "ps2")
    with pytest.raises(NotYet, match=r"^ps2\.json is missing"):
        problem("ps2", "turn")
    with pytest.raises(ValueError, match=r"ps2\.toml is missing: the tests of ps2\.ipynb need it"):
        update(tmp_path / "ps2")
    for text, said in (("[turn", r"^ps2\.toml: "), ("[turn]\ninputs = 1", r"^ps2\.toml, turn: ")):
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
