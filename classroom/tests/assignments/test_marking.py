"""A problem accepts right answers and gives hints for known mistakes."""

import numpy as np
import pytest
from matplotlib.figure import Figure
from test_student_code import student, told

from rbclassroom.assignments.marking import IN_RADIANS, Drawing, Mistake, NotYet, Problem, curves_of

X = [(np.array([1.0, -2.0]), 1), (np.array([0.5, 4.0]), 3)]
DOUBLE = Problem(
    names=["x", "k"],
    inputs=X,
    answers=[2 * k * x for x, k in X],
    mistakes=[
        Mistake("half", [[x * k / 2 for x, k in X], [x / 2 for x, _ in X]]),
        Mistake("sign", [[-2 * k * x for x, k in X]]),
    ],
)


@pytest.mark.parametrize("text", ["2 * k * x", "list(2 * k * x)", "k * x + k * x + 1e-12"])
def test_right_answers_are_accepted(text, capsys):
    assert DOUBLE.accepts(student(f"def answer(x, k): return {text}")) is True
    assert capsys.readouterr().out.startswith("The function is correct")


PARTLY = "the result should be [2.0, -4.0]; yours is [0.5, -1.0], off by 3."
DEGREES = f"{IN_RADIANS} There is a second mistake: sign"


@pytest.mark.parametrize(
    ("body", "said"),
    [
        ("return k * x / 2", "half"),
        ("return x / 2", "half"),
        ("return -2 * k * x", "sign"),
        ("return np.degrees(-2 * k * x)", DEGREES),
        ("return x * k / 2 if k == 1 else 2 * k * x", f"For x = [1.0, -2.0], k = 1 {PARTLY}"),
        ("pass", "returns nothing. Is the line with return missing?"),
        ("return np.linalg.svd(np.eye(2))", "should return real numbers, not ("),
        ("return 'two'", "should return real numbers, not two"),
        ("return [[1], [1, 2]]", "should return real numbers, not [[1], [1, 2]]."),
        ("return x + 0j", "real numbers, not [(1+0j), (-2+0j)]. It is complex"),
        ("return (2 * k * x)[:, None] * [1, 2]", "the shape (2,) is wanted; yours is (2, 2)"),
        ("return x * np.nan", "your result is not finite: [nan, nan]"),
        ("x *= 2 * k\n    return x", "changes its arguments"),
        (
            "raise NotImplementedError()",
            "stops at raise NotImplementedError(). Write your answer in place of it.",
        ),
        ("return undefined", "stops: NameError: name 'undefined' is not defined"),
    ],
)
def test_wrong_answers_get_a_hint_or_a_description_of_the_error(body, said):
    before = [x.copy() for x, _ in DOUBLE.inputs]
    text = told(DOUBLE, f"import numpy as np\ndef answer(x, k):\n    {body}")
    assert text == said if said in ("half", "sign", DEGREES) else said in text
    assert all(map(np.array_equal, before, [x for x, _ in DOUBLE.inputs]))


M = [(np.array([[1.25, 2.6], [3.7, -4.9]]),), (np.array([[0.5, -1.5], [2.25, 6.1]]),)]
SAME = Problem(names=["m"], inputs=M, answers=[m for (m,) in M])


@pytest.mark.parametrize(
    ("body", "said"),
    [
        ("return m.T", "transposed"),
        ("return m[::-1]", "reverse order"),
        ("return -m", "wrong sign"),
        ("return m.astype(int)", "cut off: do you fill an array of integers"),
        ("return m.round(1)", "rounded: return all digits"),
        ("return m[None]", "one axis too many"),
        ("return m[..., None]", "one axis too many"),
        ("return m[:1]", "only the beginning of the right one. Is return inside a loop"),
        ("return m[0]", "only the beginning of the right one. Is return inside a loop"),
    ],
)
def test_mistakes_that_can_be_made_everywhere_get_a_hint(body, said):
    assert said in told(SAME, f"def answer(m):\n    {body}")
    once = f"def answer(m):\n    if m[0, 0] == 0.5: return 3 * m\n    {body}"
    assert told(SAME, once).startswith("For m = ")


def test_hints_are_followed_by_an_example():
    with pytest.raises(NotYet, match=r"^half$") as refused:
        DOUBLE.accepts(student("def answer(x, k):\n    return x / 2"))
    assert refused.value.case == f"For x = [1.0, -2.0], k = 1 {PARTLY}"
    shown = refused.value._render_traceback_()
    assert shown[:2] == ["half", ""]
    assert " ".join(shown[2:]) == refused.value.case


def test_the_worst_entry_of_a_large_result_is_shown():
    many = np.arange(40.0).reshape(20, 2)
    problem = Problem(["m"], [(many,)], [many])
    source = "def answer(m):\n    m = m.copy()\n    m[3, 1] = 0.25\n    return m"
    wanted = "entry [3, 1] of the result should be 7.0; yours is 0.25, off by 6.75."
    assert wanted in told(problem, source)


def test_full_turns_are_ignored_if_the_problem_says_so():
    x = np.array([1.0, 2.0])
    problem = Problem(["x"], [(x,)], [x], angles=[1])
    turned = "import numpy as np\ndef answer(x): return x + 2 * np.pi * np.array([{}, {}])"
    assert problem.accepts(student(turned.format(0, 1)))
    assert "off by 6" in told(problem, turned.format(1, 0))


@pytest.mark.parametrize("size", [0.1, 1, 1000])
def test_results_agree_to_the_accuracy_of_the_problem(size):
    problem, wanted = Problem(["x"], [], [], accuracy=1e-4), np.array([size, 0])
    for share, same in ((0.5, True), (2, False)):
        off = share * 1e-4 * max(1, size) * np.array([0, 1])
        assert problem.same(wanted + off, wanted) is same


T = [np.linspace(0, 1, 5), np.linspace(0, 2, 7)]
LINE = Drawing(
    names=["t"],
    inputs=[(t,) for t in T],
    answers=[[np.column_stack([t, t**2])] for t in T],
    mistakes=[Mistake("swapped", [[[np.column_stack([t**2, t])] for t in T]])],
    accuracy=1e-6,
)
LABELS = "ax.set(xlabel='x [m]', ylabel='y [m]')"


@pytest.mark.parametrize(
    "drawing",
    [
        "ax.plot(t, t**2)",
        "ax.plot(t, t**2, 'o')",
        "ax.scatter(t, t**2)",
        "ax.plot(t[::-1], t[::-1] ** 2)",
        "ax.plot([0, 1], [0, 0])\n    ax.plot(t, t**2)",
    ],
)
def test_drawings_are_judged_by_their_points(drawing):
    assert LINE.accepts(student(f"def answer(ax, t):\n    {drawing}\n    {LABELS}"))


@pytest.mark.parametrize(
    ("drawing", "said"),
    [
        ("ax.plot(t**2, t)", "swapped"),
        ("pass", "Your function drew nothing on the axes that it was given."),
        ("ax.plot(t[1:], t[1:])", "A curve of 5 points is wanted; you drew curves of [4] points."),
        ("for x in t: ax.plot(x, x, '.')", "Draw one line through 5 points; you drew 5 lines of 1"),
        ("ax.plot(t, t)", "Point 2 of the curve should be [0.5, 0.25]; yours is [0.5, 0.5]."),
        ("ax.plot(t, t**2)", "The curves are right. The x axis needs a label"),
        ("ax.plot(t, t**2)\n    ax.set_xlabel('t')", "The curves are right. The y axis needs"),
    ],
)
def test_faults_of_drawings_are_described(drawing, said):
    assert told(LINE, f"def answer(ax, t):\n    {drawing}").startswith(said)


DATA, EDGES, HEIGHTS = [0.5, 1.2, 1.4], [0, 1, 2], [1 / 3, 2 / 3]


@pytest.mark.parametrize(
    "draw",
    [
        lambda ax: ax.hist(DATA, EDGES, density=True),
        lambda ax: ax.hist(DATA, EDGES, density=True, histtype="step"),
        lambda ax: ax.hist(DATA, EDGES, density=True, histtype="stepfilled"),
        lambda ax: ax.stairs(HEIGHTS, EDGES),
        lambda ax: ax.bar([0.5, 1.5], HEIGHTS, width=0.8),
        lambda ax: ax.step(EDGES, [*HEIGHTS, HEIGHTS[-1]], where="post"),
        lambda ax: ax.fill_between(EDGES, [*HEIGHTS, 0], step="post"),
        lambda ax: (ax.axvspan(0, 1), ax.hist(DATA, EDGES, density=True)),
    ],
)
def test_bars_and_steps_are_read_as_curves(draw):
    draw(ax := Figure().subplots())
    wanted = [[0.5, 1 / 3], [1.5, 2 / 3]]
    assert any(np.shape(c) == (2, 2) and np.allclose(c, wanted) for c in curves_of(ax))
