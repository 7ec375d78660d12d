"""Cells can be run in any order: the earlier statements that a cell needs are run first."""

import ast
import sys

import pytest

from rbclassroom.assignments.marking import NotYet
from rbclassroom.live import cells


@pytest.fixture(autouse=True)
def own_main(monkeypatch):
    monkeypatch.setitem(sys.modules, "__main__", sys.modules["__main__"])


def run(above, source, known=()):
    found = []
    missing = cells.run(above, source, known, lambda kind, content: found.append((kind, content)))
    return missing, "".join(content for kind, content in found if kind == "text"), found


def kept(above, source):
    """Return the earlier statements that are kept, as text."""
    statements = [each for text in above for each in cells.parsed(text, "<cell>")]
    return [ast.unparse(each) for each in cells.needed(statements, cells.parsed(source, ""))]


ABOVE = [
    "import math\nfrom os import path, sep\nimport json",
    "a = 1\nb = a + 1\nprint(b)",
    "a = 5",
]


def test_only_statements_that_a_cell_needs_are_kept():
    assert kept(ABOVE, "b") == ["a = 1", "b = a + 1"]
    assert kept(ABOVE, "a + math.pi") == ["import math", "a = 5"]
    assert kept(ABOVE, "a = sep\na") == ["from os import path, sep"]
    assert kept(ABOVE, "sum(a for a in [1])") == []
    assert len(kept(["q = 1", "for q in range(2):\n    z = q"], "z")) == 1


@pytest.mark.parametrize(
    ("above", "source", "wanted"),
    [
        (["x = []", "x.append(1)", "y = 2"], "print(x)", "[1]"),
        (["x = {}", "x['a'] = 1"], "print(x)", "{'a': 1}"),
        (["x = [3, 1]", "def put(z):\n    z.append(0)", "put(x)"], "print(x)", "[3, 1, 0]"),
        (["x = 1", "x += 1"], "print(x)", "2"),
        (["x = 1", "for k in range(3):\n    x = x + k"], "print(x, k)", "4 2"),
        (["def f():\n    return g()", "def g():\n    return late", "late = 7"], "print(f())", "7"),
        (["x = 1", "if x:\n    y = 2"], "print(y)", "2"),
        (["import math", "f = lambda r: math.floor(r)"], "print(f(2.5))", "2"),
        (["a, (b, *c) = 1, (2, 3, 4)"], "print(b, c)", "2 [3, 4]"),
        (
            [
                *("from numpy.random import default_rng", "rng = default_rng(1)"),
                *("x = rng.integers(9)", "def draw(r):\n    return r.integers(9)", "y = draw(rng)"),
            ],
            "print(rng.integers(9))",
            "6",
        ),
    ],
)
def test_skipping_unneeded_statements_does_not_change_the_output(above, source, wanted, capsys):
    space = {}
    for text in [*above, source]:
        exec(text, space)
    assert capsys.readouterr().out.strip() == wanted
    for _ in "ab":  # the output must be the same each time
        assert run(above, source)[1].strip() == wanted


def test_results_of_all_kinds_are_shown():
    assert run([], "print(1)\n2")[1] == "1\n2"
    page = "class P:\n    def _repr_html_(self):\n        return '<b>x</b>'"
    assert run([page], "P()")[2] == [("html", "<b>x</b>")]
    draw = "import matplotlib.pyplot as plt\n_ = plt.figure()"
    above = "import matplotlib.pyplot as plt\nfig = plt.figure()"
    # the figure that is drawn above is not shown
    assert run([above], "fig.number")[2] == [("text", "1")]
    ((kind, content),) = run([], draw)[2]
    assert kind == "html"
    assert content.startswith('<img alt="The figure that the cell draws" src="data:image/png')
    assert len(run([], f"print('x' * {cells.CUT + 5})")[1]) < cells.CUT + 60


def test_errors_state_their_place():
    _, text, found = run(["def f(x):\n    return 1 / x"], "print(1)\nf(0)")
    assert text == "1\n"
    kind, said = found[-1]
    assert kind == "error"
    assert said.splitlines() == [
        *("this cell, line 2: f(0)", "cell 1, line 2: return 1 / x"),
        "ZeroDivisionError: division by zero",
    ]
    assert run([], "x = (")[2][0][1].splitlines()[-1].startswith("SyntaxError")
    hint = "from rbclassroom.assignments.marking import NotYet\nraise NotYet('Turn it round.')"
    assert run([], hint)[2] == [("hint", str(NotYet("Turn it round.")))]


def test_missing_packages_that_can_be_loaded_are_named():
    assert run([], "import not_there.part", ["not_there"])[0] == "not_there"
    missing, _, found = run([], "import not_there")
    assert missing == ""
    assert "No module named 'not_there'" in found[-1][1]


def test_a_cell_above_that_cannot_be_read_stops_only_cells_that_need_it():
    above = ["x = 1", "def broken(:\n    return 1"]
    assert run(above, "print(x)")[1] == "1\n"
    *_, found = run(above, "broken()")
    ((kind, said),) = found
    assert kind == "error"
    assert "cell 2" in said
    assert "SyntaxError" in said


def test_input_and_no_break_spaces_are_explained():
    ((_, said),) = run([], "input('x')")[2]
    assert "write the value into the code" in said
    ((_, said),) = run([], "x =\u00a01")[2]
    assert "type a normal space" in said
