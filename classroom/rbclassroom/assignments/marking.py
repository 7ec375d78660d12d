"""Compare a student's function with the right answers and with known mistakes, and give hints.

A correct function is accepted. For any other function, `NotYet` is raised with one hint. The data
of a problem are numbers: inputs, right answers, and the results of functions that make a known
mistake. If a student's function agrees with a mistake on each input, the student gets the hint of
this mistake.
"""

import copy
import linecache
import textwrap
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Self

import numpy as np

from rbcourse import Array

SHOWN = 16  # larger arrays are described by their shape
IN_RADIANS = (
    "Angles are in radians here, and NumPy's functions take and return radians: convert nothing."
)
EMPTY = "Your function stops at raise NotImplementedError(). Write your answer in place of it."
NO_INPUT = "StdinNotImplementedError"  # the error of ipykernel, with a long traceback
WHY_NO_INPUT = "input() has no answer here; write the value into the code"
_rows = np.atleast_1d
GENERAL: dict[str, Callable[[Array, Array], list[Array]]] = {
    "Your result is transposed.": lambda right, got: [right.T],
    "The entries of your result are in the reverse order.": lambda right, got: [_rows(right)[::-1]],
    "Your result has the wrong sign.": lambda right, got: [-right],
    "The digits after the point are cut off: do you fill an array of integers?": (
        lambda right, got: [np.trunc(right)]
    ),
    "Your result is rounded: return all digits.": (
        lambda right, got: [np.round(right, digits) for digits in range(7)]
    ),
    "Your result has one axis too many.": lambda right, got: [right[None], right[..., None]],
    "Your result is only the beginning of the right one. Is return inside a loop?": (
        lambda right, got: [_first_rows(right, len(_rows(got))), _rows(right)[0]]
    ),
}
"""The hints of mistakes that can be made in every problem, and the results of these mistakes."""


class NotYet(AssertionError):
    """An error with a message for the student, which a notebook shows without a traceback.

    If the message is a hint, `case` is an example: the right result, and that of the function.
    """

    def __init__(self, message: str, case: str = "") -> None:
        super().__init__(message)
        self.case = case

    def _render_traceback_(self) -> list[str]:
        texts = [textwrap.wrap(text, 80) for text in (str(self), self.case) if text]
        return [line for lines in texts for line in ("", *lines)][1:]


def call_student(function: Any, arguments: tuple[Any, ...], times: int = 1) -> list[Any]:
    """Return the results of a student's function, one for each call.

    Raise `NotYet` if the function raises an error.
    """
    try:
        return [function(*arguments) for _ in range(times)]
    except NotImplementedError as error:
        *_, (frame, _) = traceback.walk_tb(error.__traceback__)
        name = frame.f_code.co_name
        if type(error).__name__ == NO_INPUT:
            raise NotYet(f"Your function stops: {WHY_NO_INPUT}") from None
        if name != getattr(function, "__name__", name):
            why = f"Your function calls {name}, where nothing is written yet."
            raise NotYet(why) from None
        raise NotYet(EMPTY) from None
    except Exception as error:
        lines = [
            linecache.getline(frame.f_code.co_filename, line).strip()
            for frame, line in traceback.walk_tb(error.__traceback__)
            if frame.f_globals.get("__name__") == "__main__"
        ]
        where = f' at "{lines[-1]}"' if lines and lines[-1] else ""
        raise NotYet(f"Your function stops{where}: {type(error).__name__}: {error}") from None


class Mistake(NamedTuple):
    """A common mistake: a hint, and the results of functions that make this mistake."""

    hint: str
    results: Sequence[Sequence[Any]]


@dataclass(frozen=True)
class Problem:
    """A problem whose answer is a function that returns numbers.

    The `inputs` distinguish every mistake from the answer and from the other mistakes. A result may
    differ from the answer by `accuracy` times the largest entry of the answer, or by `accuracy` if
    this entry is below 1. Entries with the indices `angles` are compared up to full turns.
    """

    names: Sequence[str]  # the names of the arguments
    inputs: Sequence[Sequence[Any]]  # the arguments of each trial
    answers: Sequence[Any]  # the right result of each trial
    mistakes: Sequence[Mistake] = ()
    own: str = ""  # the functions that an answer may use
    accuracy: float = 1e-9
    angles: Sequence[int] = ()

    def accepts(self, function: Callable[..., Any]) -> bool:
        """Compare a function with the answer on all inputs."""
        self._examine(function)
        said = "The function is correct on these inputs. Grading tries others."
        print(f"{said} {self.own}".rstrip())
        return True

    def on(self, inputs: Sequence[Sequence[Any]], answers: Sequence[Any]) -> Self:
        """Return the problem with other inputs and their answers, for hidden tests."""
        return replace(self, inputs=inputs, answers=answers, mistakes=())

    def same(self, got: Any, wanted: Any) -> bool:
        """Return whether two results agree to the accuracy of the problem."""
        one, other, angles = as_numbers(got), as_numbers(wanted), list(self.angles)
        if one is None or other is None or one.shape != other.shape:
            return False
        one, other = (
            np.r_[np.delete(x, angles), np.cos(x.ravel()[angles]), np.sin(x.ravel()[angles])]
            for x in (one, other)
        )
        scale = max(1.0, float(np.abs(other).max(initial=0)))
        return bool(np.abs(one - other).max(initial=0) <= self.accuracy * scale)

    def _examine(self, function: Callable[..., Any]) -> None:
        given = [self._run(function, trial) for trial in self.inputs]
        right = [self.same(*pair) for pair in zip(given, self.answers, strict=True)]
        if all(right):
            return
        first = right.index(False)
        arguments = zip(self.names, self.inputs[first], strict=False)
        called = "For " + ", ".join(f"{name} = {show(value)}" for name, value in arguments)
        case = self._describe(called, given[first], self.answers[first])
        if hint := self._hint(given) or self._general_hint(given):
            raise NotYet(hint, case)
        numbers = [(value, as_numbers(value)) for value in given]
        meant = [value if number is None else np.radians(number) for value, number in numbers]
        if hint := self._hint(meant):  # the student's results are in degrees
            raise NotYet(f"{IN_RADIANS} There is a second mistake: {hint}", case)
        raise NotYet(case)

    def _hint(self, given: list[Any]) -> str:
        for mistake in self.mistakes:
            # in each trial, one of the mistake's functions has to match
            trials = zip(given, *mistake.results, strict=True)
            if all(any(self.same(got, known) for known in results) for got, *results in trials):
                return mistake.hint
        return ""

    def _general_hint(self, given: list[Any]) -> str:
        """Return the hint of a mistake that can be made in every problem, or ""."""
        hints = list(GENERAL)
        for pair in zip(given, self.answers, strict=True):
            got, right = map(as_numbers, pair)
            if got is None or right is None:
                return ""
            hints = [h for h in hints if any(self.same(got, x) for x in GENERAL[h](right, got))]
        return hints[0] if hints else ""

    def _run(self, function: Callable[..., Any], trial: Sequence[Any]) -> Any:
        arguments = tuple(copy.deepcopy(trial))
        (result,) = call_student(function, arguments)
        if not _unchanged(tuple(trial), arguments):
            raise NotYet("Your function changes its arguments. Work on a copy.")
        return result

    def _describe(self, called: str, got: Any, wanted: Any) -> str:
        wanted, numbers = np.asarray(wanted), as_numbers(got)
        if got is None:
            return f"{called} your function returns nothing. Is the line with return missing?"
        if numbers is None:
            complex_ = isinstance(got, np.ndarray | complex) and np.iscomplexobj(got)
            why = " It is complex: return its real part." if complex_ else ""
            return f"{called} your function should return real numbers, not {show(got)}.{why}"
        if numbers.shape != wanted.shape:
            return f"{called} the shape {wanted.shape} is wanted; yours is {numbers.shape}."
        if not np.isfinite(numbers).all():
            why = "Does it divide by 0, or take a root or an arccos of a number without one?"
            return f"{called} your result is not finite: {show(numbers)}. {why}"
        off = np.abs(numbers - wanted)
        entry = "the result"
        if wanted.size > SHOWN:
            worst = np.unravel_index(int(off.argmax()), off.shape)
            entry = f"entry {[int(at) for at in worst]} of the result"
            wanted, numbers = wanted[worst], numbers[worst]
        text = f"{called} {entry} should be {show(wanted)}; yours is {show(numbers)}"
        return f"{text}, off by {off.max(initial=0):.3g}."


@dataclass(frozen=True)
class Drawing(Problem):
    """A problem whose answer is a function that draws on axes; the drawn data are compared.

    The student's function gets axes before the arguments of `inputs`. A result is a list of curves,
    which are arrays of points of shape (n, 2). The function may draw further curves. The curve of a
    histogram goes through the midpoints of the upper edges of its bars. Both axes need a label.
    """

    accuracy: float = 1e-6

    def _examine(self, function: Callable[..., Any]) -> None:
        super()._examine(function)
        axes = self._draw(function, self.inputs[0])
        for name, label in (("x", axes.get_xlabel()), ("y", axes.get_ylabel())):
            if not label.strip():
                needs = f"The {name} axis needs a label: the quantity and its unit."
                raise NotYet(f"The curves are right. {needs}")

    def same(self, got: Any, wanted: Any) -> bool:
        """Return whether each wanted curve was drawn, in either direction."""
        drawn = [*got, *(curve[::-1] for curve in got)]
        return all(any(super(Drawing, self).same(d, w) for d in drawn) for w in wanted)

    def _general_hint(self, given: list[Any]) -> str:
        return ""

    def _run(self, function: Callable[..., Any], trial: Sequence[Any]) -> Any:
        return curves_of(self._draw(function, trial))

    def _draw(self, function: Callable[..., Any], trial: Sequence[Any]) -> Any:
        return draw(lambda *given: call_student(function, given), trial)

    def _describe(self, called: str, got: Any, wanted: Any) -> str:
        if not got:
            return "Your function drew nothing on the axes that it was given."
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


def draw(function: Callable[..., Any], trial: Sequence[Any]) -> Any:
    """Return new axes on which a function has drawn."""
    from matplotlib.figure import Figure

    axes = Figure().subplots()
    function(axes, *copy.deepcopy(trial))
    return axes


def curves_of(axes: Any) -> list[Array]:
    """Return the points of all lines, dots, bars and steps on axes."""
    from matplotlib.cbook import STEP_LOOKUP_MAP
    from matplotlib.container import BarContainer
    from matplotlib.patches import Polygon, StepPatch

    found = [line.get_xydata() for line in axes.lines]
    found += [dots.get_offsets() for dots in axes.collections]
    for bars in (c for c in axes.containers if isinstance(c, BarContainer)):
        found.append([(b.get_x() + b.get_width() / 2, b.get_height()) for b in bars])
    outlines = [p.get_xy() for p in axes.patches if isinstance(p, Polygon)]
    outlines += [path.vertices for shape in axes.collections for path in shape.get_paths()]
    for line in axes.lines:
        if (style := line.get_drawstyle()) != "default":
            outlines.append(np.column_stack(STEP_LOOKUP_MAP[style](*line.get_xydata().T)))
    for a, b in ((np.array(outline[:-1]), np.array(outline[1:])) for outline in outlines):
        treads = (a[:, 1] == b[:, 1]) & (a[:, 0] < b[:, 0])  # only top edges go from left to right
        found.append((a + b)[treads] / 2)
    for values, edges, _ in (p.get_data() for p in axes.patches if isinstance(p, StepPatch)):
        found.append(np.column_stack([(edges[1:] + edges[:-1]) / 2, values]))
    curves = [np.array(points, float) for points in found]
    return [curve for curve in curves if curve.ndim == 2 and len(curve)]


def as_numbers(value: Any) -> Array | None:
    """Return a result as an array of floats, or None if it cannot be converted."""
    try:
        array = np.asarray(value)
    except ValueError:
        return None
    return array.astype(float) if array.dtype.kind in "biuf" else None


def show(value: Any) -> str:
    """Return a short text: the rounded entries of a small array, or the shape of a large one."""
    if isinstance(value, np.ndarray) and value.size > SHOWN:
        return f"an array of shape {value.shape}"
    return value if isinstance(value, str) else repr(_plain(value))[:300]


def _first_rows(right: Array, count: int) -> Array:
    """Return the first results; no loop makes more than one row of a square matrix at a time."""
    square = right.ndim == 2 and len(right) == right.shape[1]
    return _rows(right)[: 1 if square else count]


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return (list if isinstance(value, list) else tuple)(map(_plain, value))
    if isinstance(value, complex):
        return complex(round(value.real, 4), round(value.imag, 4))
    return round(value, 4) + 0 if isinstance(value, float) else value


def _unchanged(before: Any, after: Any) -> bool:
    if isinstance(before, np.ndarray):
        return np.array_equal(before, after)
    if isinstance(before, (list, tuple)):
        return len(before) == len(after) and all(map(_unchanged, before, after))
    return bool(before == after)
