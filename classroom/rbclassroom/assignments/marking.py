"""Problems that give hints: a student's function compared with an answer and known mistakes.

What is right is accepted; else `NotYet` is raised, whose text is one hint. What people get wrong is
listed with each problem, as functions that get it wrong in the same way: a student's function that
agrees with one of them everywhere gets its hint.
"""

import copy
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from inspect import signature
from typing import Any, Self

import numpy as np

from rbclassroom.assignments.student_code import NotYet, call_student
from rbcourse import Array

IN_RADIANS = (
    "Angles are in radians here, and NumPy's functions take and give radians: convert none."
)


class Mistake:
    """What people get wrong, and what to tell them.

    Parameters
    ----------
    hint : str
        For the student.
    *answers : callable
        Called as the student's function is; each returns what somebody who makes this mistake
        returns.
    """

    def __init__(self, hint: str, *answers: Callable[..., Any]) -> None:
        self.hint, self.answers = hint, answers


@dataclass(frozen=True)
class Problem:
    """A function to be written, which returns numbers.

    Parameters
    ----------
    answer : callable
        The right answer.
    inputs : sequence of tuple
        The arguments of each trial; so many, and so general, that no mistake agrees with the
        answer, or with another mistake, on all of them.
    mistakes : sequence of Mistake
    read : callable
        What counts of a result: angles up to full turns, say.
    allowed : tuple of str
        Names of the package that the student may use.
    accuracy : float
        How far an entry may be off, in units of the largest entry, or of 1.
    """

    answer: Callable[..., Any]
    inputs: Sequence[tuple[Any, ...]]
    mistakes: Sequence[Mistake]
    read: Callable[[Array], Array] = np.array
    allowed: tuple[str, ...] = ()
    accuracy: float = 1e-9

    def accepts(self, function: Callable[..., Any]) -> bool:
        """Compare a function with the answer on all inputs."""
        self._examine(function)
        print("As it should be, on these inputs. Others are tried when it is graded.")
        return True

    def on(self, *inputs: tuple[Any, ...]) -> Self:
        """Return the problem with other inputs, for hidden tests."""
        return replace(self, inputs=inputs)

    def results(self, answer: Callable[..., Any]) -> list[Any]:
        """Return what an answer gives for each input."""
        return [answer(*copy.deepcopy(trial)) for trial in self.inputs]

    def same(self, got: Any, wanted: Any) -> bool:
        """Return whether two results are the same, to the accuracy of the problem."""
        one, other = as_numbers(got), as_numbers(wanted)
        if one is None or other is None or one.shape != other.shape:
            return False
        one, other = self.read(one), self.read(other)
        scale = max(1.0, float(np.abs(other).max(initial=0)))
        return bool(np.abs(one - other).max(initial=0) <= self.accuracy * scale)

    def _examine(self, function: Callable[..., Any]) -> None:
        given = [self._run(function, trial) for trial in self.inputs]
        wanted = self.results(self.answer)
        right = [self.same(*pair) for pair in zip(given, wanted, strict=True)]
        if all(right):
            return
        for mistake in self.mistakes:
            if any(all(map(self.same, given, self.results(f))) for f in mistake.answers):
                raise NotYet(mistake.hint)
        given_degrees = [_in_radians(value) for value in given]
        for mistake in self.mistakes:  # two at once
            if any(all(map(self.same, given_degrees, self.results(f))) for f in mistake.answers):
                raise NotYet(f"{IN_RADIANS} There is a second mistake: {mistake.hint}")
        first = right.index(False)
        called = f"For {_named(self.answer, self.inputs[first])}"
        raise NotYet(self._describe(called, given[first], wanted[first]))

    def _run(self, function: Callable[..., Any], trial: tuple[Any, ...]) -> Any:
        arguments = copy.deepcopy(trial)
        (result,) = call_student(function, arguments, self.allowed)
        if not _unchanged(trial, arguments):
            raise NotYet("Your function changes the arguments that it is given. Work on a copy.")
        return result

    def _describe(self, called: str, got: Any, wanted: Any) -> str:
        wanted = np.asarray(wanted)
        if got is None:
            return f"{called} your function returns nothing. Is the line with return missing?"
        numbers = as_numbers(got)
        if numbers is None:
            complex_ = isinstance(got, np.ndarray | complex) and np.iscomplexobj(got)
            why = " It is complex: return its real part." if complex_ else ""
            return f"{called} your function returns no real numbers but {show(got)}.{why}"
        if numbers.shape != wanted.shape:
            return f"{called} the shape {wanted.shape} is wanted; yours is {numbers.shape}."
        if not np.isfinite(numbers).all():
            return (
                f"{called} your result is not finite: {show(numbers)}. Is something divided by 0?"
            )
        text = f"{called} the result should be {show(wanted)}; yours is {show(numbers)}"
        off = float(np.abs(numbers - wanted).max(initial=0))
        return f"{text}, off by {off:.1g}."


@dataclass(frozen=True)
class Drawing(Problem):
    """A function to be written, which draws: judged by the data of what it drew.

    The student's function gets axes before the arguments of `inputs`. `answer` and the mistakes
    get none, and return the curves that are wanted, each an array of points, shape (n, 2). Others
    may be drawn besides. The bars of a histogram are a curve too: middle and height of each.
    Both axes need a label.
    """

    accuracy: float = 1e-6

    def _examine(self, function: Callable[..., Any]) -> None:
        super()._examine(function)
        axes = self._draw(function, self.inputs[0])
        for name, label in (("x", axes.get_xlabel()), ("y", axes.get_ylabel())):
            if not label.strip():
                raise NotYet(
                    f"The curves are right. The {name} axis needs a label: what, and its unit."
                )

    def same(self, got: Any, wanted: Any) -> bool:
        """Return whether each wanted curve is among those that were drawn, from either end."""
        drawn = [*got, *(curve[::-1] for curve in got)]
        return all(any(super(Drawing, self).same(d, w) for d in drawn) for w in wanted)

    def _run(self, function: Callable[..., Any], trial: tuple[Any, ...]) -> Any:
        return curves_of(self._draw(function, trial))

    def _draw(self, function: Callable[..., Any], trial: tuple[Any, ...]) -> Any:
        from matplotlib.figure import Figure

        axes = Figure().subplots()
        call_student(function, (axes, *copy.deepcopy(trial)), self.allowed)
        return axes

    def _describe(self, called: str, got: Any, wanted: Any) -> str:
        if not got:
            return "Nothing was drawn on the axes that your function was given."
        lost = next(curve for curve in wanted if not self.same(got, [curve]))
        near = next((curve for curve in got if curve.shape == lost.shape), None)
        if near is None:
            sizes = sorted({len(curve) for curve in got})
            if sizes == [1]:
                drawn = f"you drew {len(got)} lines of 1 point"
                return f"Draw one line through {len(lost)} points; {drawn}."
            return f"A curve of {len(lost)} points is wanted; you drew curves of {sizes} points."
        i = int(np.argmax(np.abs(near - lost).max(axis=1)))
        return f"Point {i} of the curve should be {show(lost[i])}; yours is {show(near[i])}."


def curves_of(axes: Any) -> list[Array]:
    """Return the points of all lines, dots, bars and steps on axes."""
    from matplotlib.cbook import STEP_LOOKUP_MAP
    from matplotlib.container import BarContainer
    from matplotlib.patches import Polygon, StepPatch

    found = [np.array(line.get_xydata(), float) for line in axes.lines]
    found += [np.array(dots.get_offsets(), float) for dots in axes.collections]
    for bars in (c for c in axes.containers if isinstance(c, BarContainer)):
        found.append(np.array([[b.get_x() + b.get_width() / 2, b.get_height()] for b in bars]))
    outlines = [p.get_xy() for p in axes.patches if isinstance(p, Polygon)]
    outlines += [path.vertices for shape in axes.collections for path in shape.get_paths()]
    for line in axes.lines:
        if str(line.get_drawstyle()).startswith("steps"):
            steps = STEP_LOOKUP_MAP[line.get_drawstyle()]
            outlines.append(np.column_stack(steps(*line.get_xydata().T)))
    found += map(_treads, outlines)
    for values, edges, _ in (p.get_data() for p in axes.patches if isinstance(p, StepPatch)):
        found.append(np.column_stack([(edges[1:] + edges[:-1]) / 2, values]))
    return [curve for curve in found if curve.ndim == 2 and len(curve)]


def _treads(outline: Any) -> Array:
    """Return middle and height of each piece of an outline that runs to the right."""
    a, b = np.array(outline[:-1], float), np.array(outline[1:], float)
    level = (a[:, 1] == b[:, 1]) & (a[:, 0] < b[:, 0])
    return np.asarray((a + b)[level] / 2)


def as_numbers(value: Any) -> Array | None:
    """Return a result as an array of floats, or None if it is no such thing."""
    try:
        array = np.asarray(value)
    except ValueError:
        return None
    return array.astype(float) if array.dtype.kind in "biuf" else None


def show(value: Any) -> str:
    """Return a value as one reads it: arrays as lists, rounded, or by their shape."""
    if isinstance(value, np.ndarray) and value.size > 16:
        return f"an array of shape {value.shape}"
    return value if isinstance(value, str) else repr(_plain(value))[:300]


def _in_radians(value: Any) -> Any:
    """Return numbers in radians that were meant in degrees, and anything else as it is."""
    numbers = as_numbers(value)
    return value if numbers is None else np.radians(numbers)


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return (list if isinstance(value, list) else tuple)(map(_plain, value))
    if isinstance(value, complex):
        return complex(round(value.real, 4), round(value.imag, 4))
    return round(value, 4) + 0 if isinstance(value, float) else value


def _named(answer: Callable[..., Any], trial: tuple[Any, ...]) -> str:
    names = list(signature(answer).parameters)
    return ", ".join(f"{name} = {show(value)}" for name, value in zip(names, trial, strict=False))


def _unchanged(before: Any, after: Any) -> bool:
    if isinstance(before, np.ndarray):
        return np.array_equal(before, after)
    if isinstance(before, (list, tuple)):
        return len(before) == len(after) and all(map(_unchanged, before, after))
    return bool(before == after)
