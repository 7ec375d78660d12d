"""A call of a student's function reports its errors."""

from textwrap import dedent

import pytest

from rbclassroom.assignments.marking import NotYet, call_student


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


def test_errors_in_a_function_are_reported():
    with pytest.raises(NotYet, match=r"stops.*ZeroDivisionError: division by zero"):
        call_student(student("def answer(x): return 1 / 0"), (1,))
    with pytest.raises(NotYet, match="stops: TypeError: 'float' object is not callable"):
        call_student(1.5, (1,))


def test_a_function_that_asks_for_input_is_told_so():
    source = """
        from IPython.core.error import StdinNotImplementedError
        def raw_input(): raise StdinNotImplementedError("no frontend")
        def answer(x): return raw_input()
        """
    with pytest.raises(NotYet, match=r"^Your function stops: input\(\) has no answer here"):
        call_student(student(source), (1,))


def test_an_answer_that_calls_an_empty_answer_is_told_so():
    source = "def half(x):\n    raise NotImplementedError()\ndef answer(x): return half(x)"
    with pytest.raises(NotYet, match="calls half, where nothing is written yet"):
        call_student(student(source), (1,))


def test_a_notebook_shows_the_hint_in_short_lines():
    lines = NotYet("a long hint " * 30)._render_traceback_()
    assert max(map(len, lines)) <= 80
    assert "\n".join(lines).split() == ["a", "long", "hint"] * 30
