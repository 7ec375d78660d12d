"""The problem sets: the reference passes, nothing passes, and each wrong answer gets its hint."""

import re
from importlib import import_module
from pathlib import Path
from textwrap import dedent, indent

import matplotlib.pyplot as plt
import nbformat
import pytest
from wrong_answers import HELP, WRONG

from rbcourse.marking import Mistake, Problem
from rbcourse.marking_samplers import Sampler
from rbcourse.own_work import NotYet

SOURCE = Path(__file__).parents[1] / "notebooks" / "assignments" / "source"
SETS = {path.stem: nbformat.read(path, as_version=4) for path in sorted(SOURCE.glob("*/*.ipynb"))}
TOPICS = ("plane", "rotations", "random", "geodesics", "acceleration")
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


@pytest.mark.parametrize(("key", "hint", "body"), FAILING)
def test_a_wrong_answer_gets_its_hint(key, hint, body):
    name, slug = key
    answer = head(cells(name)[f"{slug}-answer"].source) + indent(dedent(body).strip(), "    ")
    with pytest.raises(NotYet) as refused:
        try_answer(name, slug, answer, HELP)
    assert str(refused.value).startswith(hint)


def listed():
    """Every problem of the package, with its name."""
    modules = [import_module(f"rbcourse.problems_{topic}") for topic in TOPICS]
    values = {name: value for module in modules for name, value in vars(module).items()}
    return {name: value for name, value in values.items() if isinstance(value, Problem | Sampler)}


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
