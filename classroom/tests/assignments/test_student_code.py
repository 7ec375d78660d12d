"""A student's function is called; what it borrows, and where it stops, is told."""

from textwrap import dedent

import pytest

import rbcourse
from rbclassroom.assignments.student_code import NotYet, call_student


def student(source, name="answer"):
    """A function as a notebook defines it."""
    space = {"__name__": "__main__"}
    exec(compile(dedent(source), "<cell>", "exec"), space)
    return space[name]


BORROWED = {
    "the function itself": "from rbcourse import exp_so3 as answer",
    "under a name": "from rbcourse import exp_so3\ndef answer(w): return exp_so3(w)",
    "through its module": "import rbcourse as rb\ndef answer(w): return rb.exp_so3(w)",
    "through its submodule": "import rbcourse.so3\ndef answer(w): return rbcourse.so3.exp_so3(w)",
    "imported inside": "def answer(w):\n    from rbcourse import exp_so3\n    return exp_so3(w)",
    "by way of a helper": "from rbcourse import exp_so3\n"
    "def helper(w): return exp_so3(w)\ndef answer(w): return helper(w)",
    "by way of NumPy": "import numpy as np, rbcourse\n"
    "def answer(w): return np.apply_along_axis(rbcourse.exp_so3, 0, w)",
    "from the problem": "from rbclassroom.assignments.problems import problem\n"
    "def answer(w): return problem('ps2', 'turn').answers[0]",
}


@pytest.mark.parametrize("source", BORROWED.values(), ids=BORROWED)
def test_what_is_borrowed_from_the_package_is_named(source):
    with pytest.raises(NotYet, match=r"This uses rb(course|classroom)\..*Write it yourself"):
        call_student(student(source), ([0.1, 0.2, 0.3],), ())


@pytest.mark.parametrize(
    "source",
    [
        "from scipy.spatial.transform import Rotation\n"
        "def answer(w): return Rotation.from_rotvec(w).as_matrix()",
        "def answer(w):\n    from scipy.spatial.transform import Rotation\n"
        "    return Rotation.from_rotvec(w).as_matrix()",
        "import scipy.linalg\ndef answer(w): return scipy.linalg.expm([[0, 1], [-1, 0]])",
        "from scipy.linalg import expm\ndef answer(w): return expm([[0, 1], [-1, 0]])",
    ],
)
def test_what_is_borrowed_from_scipy_is_named(source):
    with pytest.raises(NotYet, match=r"This uses scipy"):
        call_student(student(source), ([0.1, 0.2, 0.3],), ())


@pytest.mark.parametrize("name", ["under a name", "through its module", "by way of a helper"])
def test_what_the_problem_allows_may_be_used(name):
    call_student(student(BORROWED[name]), ([0.1, 0.2, 0.3],), ("exp_so3",))


def test_another_function_than_the_allowed_one_may_not():
    with pytest.raises(NotYet, match=r"rbcourse\.exp_so3"):
        call_student(student(BORROWED["through its module"]), ([0.1, 0, 0],), ("log_so3",))


def test_numpy_python_and_printing_are_nobodys_secret(capsys):
    source = """
        import math
        import numpy as np
        from collections import namedtuple

        Pair = namedtuple("Pair", "a b")

        def answer(x):
            print("seen", x)
            U, s, Vt = np.linalg.svd(np.vander(x))
            pair = Pair(math.fsum(s), sorted(s, key=lambda value: -value))
            return np.vectorize(lambda value: value + 1)(pair.b)
    """
    (result,) = call_student(student(source), ([1.0, 2.0, 3.0],), ())
    assert len(result) == 3
    assert capsys.readouterr().out.startswith("seen")


def test_what_is_called_often_is_called_so_often():
    counted = student("count = []\ndef answer(): return len(count) or count.append(1) or 0")
    assert len(call_student(counted, (), (), 25)) == 25


def test_matplotlib_may_load_what_it_likes():
    source = """
        import matplotlib.pyplot as plt

        def answer():
            fig, ax = plt.subplots()
            ax.hist([1, 2, 3])
            fig.canvas.draw()
            plt.close(fig)
    """
    call_student(student(source), (), ())


def test_where_a_function_stops_is_told():
    with pytest.raises(NotYet, match=r"stops.*ZeroDivisionError: division by zero"):
        call_student(student("def answer(x): return 1 / 0"), (1,), ())
    with pytest.raises(NotYet, match="stops: TypeError: 'float' object is not callable"):
        call_student(1.5, (1,), ())


def test_a_notebook_shows_the_hint_alone_in_lines_that_fit():
    assert NotYet("the hint")._render_traceback_() == ["the hint"]
    lines = NotYet("a long hint " * 30)._render_traceback_()
    assert max(map(len, lines)) <= 80
    assert "\n".join(lines).split() == ["a", "long", "hint"] * 30


def test_the_package_is_there_to_be_borrowed():
    assert rbcourse.exp_so3([0, 0, 0]).shape == (3, 3)
