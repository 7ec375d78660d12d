"""A call of a student's function reports errors and forbidden library functions."""

from textwrap import dedent

import pytest

from rbclassroom.assignments.student_code import NotYet, call_student


def student(source):
    """Return the function `answer`, defined as in a notebook."""
    space = {"__name__": "__main__"}
    exec(compile(dedent(source), "<cell>", "exec"), space)
    return space["answer"]


def told(problem, source, *seed):
    """Return why a problem refuses the function of a student."""
    with pytest.raises(NotYet) as refused:
        problem.accepts(student(source), *seed)
    return str(refused.value)


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
    "of SciPy": "from scipy.spatial.transform import Rotation\n"
    "def answer(w): return Rotation.from_rotvec(w).as_matrix()",
    "of SciPy, inside": "def answer(w):\n    from scipy.spatial.transform import Rotation\n"
    "    return Rotation.from_rotvec(w).as_matrix()",
    "of SciPy's module": "import scipy.linalg\n"
    "def answer(w): return scipy.linalg.expm([[0, 1], [-1, 0]])",
    "of SciPy, a function": "from scipy.linalg import expm\n"
    "def answer(w): return expm([[0, 1], [-1, 0]])",
}


@pytest.mark.parametrize("source", BORROWED.values(), ids=BORROWED)
def test_library_functions_that_solve_the_problem_are_reported(source):
    library = "scipy" if "scipy" in source else r"rb(course|classroom)\."
    with pytest.raises(NotYet, match=rf"Your function uses {library}.*Write it yourself"):
        call_student(student(source), ([0.1, 0.2, 0.3],), ())


@pytest.mark.parametrize("name", ["under a name", "through its module", "by way of a helper"])
def test_an_allowed_library_function_may_be_used(name):
    call_student(student(BORROWED[name]), ([0.1, 0.2, 0.3],), ("exp_so3",))
    with pytest.raises(NotYet, match=r"rbcourse\.exp_so3"):
        call_student(student(BORROWED[name]), ([0.1, 0, 0],), ("log_so3",))


def test_numpy_and_the_standard_library_are_allowed(capsys):
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
    for result in call_student(student(source), ([1.0, 2.0, 3.0],), (), times=25):
        assert len(result) == 3
    assert capsys.readouterr().out.count("seen") == 25


def test_the_libraries_that_matplotlib_loads_are_allowed():
    source = """
        import matplotlib.pyplot as plt

        def answer():
            fig, ax = plt.subplots()
            ax.hist([1, 2, 3])
            fig.canvas.draw()
            plt.close(fig)
    """
    call_student(student(source), (), ())


def test_errors_in_a_function_are_reported():
    with pytest.raises(NotYet, match=r"stops.*ZeroDivisionError: division by zero"):
        call_student(student("def answer(x): return 1 / 0"), (1,), ())
    with pytest.raises(NotYet, match="stops: TypeError: 'float' object is not callable"):
        call_student(1.5, (1,), ())


def test_a_notebook_shows_the_hint_in_short_lines():
    lines = NotYet("a long hint " * 30)._render_traceback_()
    assert max(map(len, lines)) <= 80
    assert "\n".join(lines).split() == ["a", "long", "hint"] * 30
