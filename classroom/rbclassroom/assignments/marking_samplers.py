"""Problems with random answers: a student's sampler, tested against known distributions."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rbclassroom.assignments.marking import Mistake, as_numbers, show
from rbclassroom.assignments.student_code import NotYet, call_student
from rbcourse import Array, exp_so3, matrix_from_quaternion
from rbcourse.sampling import Rng, angle_law

DELTA = 1e-6  # a correct sampler is refused less often than this


@dataclass(frozen=True)
class Sampler:
    """A function to be written, which draws at random: ``function(rng)`` returns one draw.

    A correct sampler is refused with a probability below `DELTA`, whatever generator it uses: by
    the inequality of Dvoretzky, Kiefer and Wolfowitz, with Massart's constant, the observed
    distribution of n independent numbers is off by more than e with a probability of at most
    2 exp(−2 n e²), for every n.

    Parameters
    ----------
    shape : tuple of int
        Of one draw.
    fault : callable
        Of the draws, stacked: a hint if one of them is not allowed at all, else an empty text.
    uniforms : callable
        Of the draws: a dict of name and numbers, a row of independent numbers each, which are
        uniform on [0, 1] if the draws are as they should be.
    mistakes : sequence of Mistake
        Their results are, for each row of `uniforms`, quantiles of its observed distribution.
    allowed : sequence of str
        As for a `Problem`.
    draws : int
        How many are taken.
    """

    shape: tuple[int, ...]
    fault: Callable[[Array], str]
    uniforms: Callable[[Array], dict[str, Array]]
    mistakes: Sequence[Mistake]
    allowed: Sequence[str] = ()
    draws: int = 20_000

    def accepts(self, function: Callable[..., Any], rng: Rng = None) -> bool:
        """Draw many times, one at a time, and compare their distributions with the right ones."""
        rng = np.random.default_rng(rng)
        drawn = self._as_draws(call_student(function, (rng,), self.allowed, self.draws))
        if (drawn[:10] == drawn[0]).all():
            raise NotYet(
                "Every call returns the same draw. Does your function make, and seed, a new "
                "generator each time? Draw from the rng that it is given."
            )
        if hint := self.fault(drawn):
            raise NotYet(hint)
        rows = self.uniforms(drawn)
        gaps = {name: _gap(row) for name, row in rows.items()}
        worst = max(gaps, key=lambda name: gaps[name] / self._bound(rows, name))
        if gaps[worst] <= self._bound(rows, worst):
            print(f"{self.draws} draws look as they should.")
            return True
        raise NotYet(
            self._hint(rows)
            or f"These draws are not uniform. What gives it away: {worst}, whose distribution is "
            f"off by {gaps[worst]:.3f}; chance alone stays below {self._bound(rows, worst):.3f}."
        )

    def _hint(self, rows: dict[str, Array]) -> str:
        """Return the hint of the mistake whose draws look most like these, if any does."""
        near, hint = 2.0, ""  # two samples of one law are not farther apart, in units of the bound
        for mistake in self.mistakes:
            for result in mistake.results:
                gaps = {name: _gap_to(row, result[i]) for i, (name, row) in enumerate(rows.items())}
                far = max(gap / self._bound(rows, name) for name, gap in gaps.items())
                near, hint = (far, mistake.hint) if far < near else (near, hint)
        return hint

    def _as_draws(self, given: list[Any]) -> Array:
        for i, got in enumerate(given):
            numbers = as_numbers(got)
            if numbers is None:
                why = " Does a branch end without return?" if got is None else ""
                raise NotYet(f"Draw {i} is to be numbers; yours is {show(got)}.{why}")
            if numbers.shape != self.shape:
                raise NotYet(f"A draw has the shape {self.shape}; yours has {numbers.shape}.")
            if not np.isfinite(numbers).all():
                raise NotYet(f"Draw {i} is not finite: {show(numbers)}. Is it divided by 0?")
        return np.array(given, dtype=float)

    def _bound(self, rows: dict[str, Array], name: str) -> float:
        return float(np.sqrt(np.log(2 * len(rows) / DELTA) / (2 * len(rows[name]))))


def _gap(row: Array) -> float:
    """Return how far the distribution of numbers is from the uniform one."""
    ordered, n = np.sort(row), len(row)
    steps = np.arange(n + 1) / n
    return float(max((steps[1:] - ordered).max(), (ordered - steps[:-1]).max()))


def quantiles(row: Array) -> Array:
    """Return numbers that divide a sample into 100 parts of one size."""
    return np.quantile(row, np.arange(0.005, 1, 0.01))


def _gap_to(row: Array, others: Array) -> float:
    """Return how far the distribution of numbers is from that with some quantiles."""
    levels = (np.arange(len(others)) + 0.5) / len(others)
    return float(np.abs(np.searchsorted(np.sort(row), others) / len(row) - levels).max())


def _normalised(points: Array) -> Array:
    return points / np.linalg.norm(points, axis=-1, keepdims=True)


def _cosine(c: Array) -> Array:
    """Return (1 + c)/2, uniform if c is the height of a uniform point of the sphere."""
    return (1 + c) / 2


_AXES = _normalised(
    np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1], [1, 1, -1], [1, -1, 1], [-1, 1, 1]])
)


def _direction_fault(drawn: Array) -> str:
    lengths = np.linalg.norm(drawn, axis=1)
    return _off_length("A direction", lengths)


def _off_length(what: str, lengths: Array) -> str:
    worst = lengths[np.argmax(np.abs(lengths - 1))]
    if abs(worst - 1) > 1e-9:
        return f"{what} has the length 1; one of yours has {worst:.10g}."
    return ""


def _direction_rows(drawn: Array) -> dict[str, Array]:
    rows = {f"the height along {axis.round(2).tolist()}": drawn @ axis for axis in _AXES}
    half = len(drawn) // 2
    rows["the height of a draw along the one before"] = np.einsum(
        "ni,ni->n", drawn[: 2 * half : 2], drawn[1 : 2 * half : 2]
    )
    return {name: _cosine(row) for name, row in rows.items()}


def _angles(R: Array) -> Array:
    trace = np.trace(R, axis1=-2, axis2=-1)
    return angle_law(np.arccos(np.clip((trace - 1) / 2, -1, 1)))


_FIXED = exp_so3([0.4, -1.1, 0.7])
_DIAGONALS = _normalised(np.array([[1, 1, 1], [1, 1, -1], [1, -1, 1]]))


def _rotation_rows(R: Array) -> dict[str, Array]:
    """Return uniform numbers: every entry, in several frames, and three angles by their law."""
    rows = {f"the entry R[{i}, {j}]": _cosine(R[:, i, j]) for i in range(3) for j in range(3)}
    for i, x in enumerate(_DIAGONALS):
        for j, y in enumerate(_DIAGONALS):
            rows[f"the cosine between diagonal {i} and the image of diagonal {j}"] = _cosine(
                R @ y @ x
            )
    half = len(R) // 2
    back = np.swapaxes(R, 1, 2)
    rows["the angle of the turn"] = _angles(R)
    rows["the angle to a fixed rotation"] = _angles(_FIXED.T @ R)
    rows["the angle from a draw to the next"] = _angles(back[: 2 * half : 2] @ R[1 : 2 * half : 2])
    return rows


def _rotation_fault(R: Array) -> str:
    stretch = np.linalg.svd(R, compute_uv=False)
    if np.abs(stretch - 1).max() > 1e-9:
        if np.abs(stretch[:, :2] - 1).max() < 1e-9:
            return (
                "A draw is no rotation. If you reflect by I − 2VVᵀ: V has not the length 1. Its "
                "radius is √z and its height √(1 − z); are both roots there?"
            )
        worst = stretch[np.argmax(np.abs(stretch - 1).max(axis=1))]
        return f"A draw is no rotation: its singular values are {worst.round(10).tolist()}."
    negative = (np.linalg.det(R) < 0).mean()
    if negative > 0:
        how = "all" if negative == 1 else f"{negative:.0%}"
        return (
            f"The determinant is −1 for {how} of your draws: mirrors. A reflection times a turn is "
            "a mirror; one sign more makes it a rotation."
        )
    return ""


def _quaternion_fault(drawn: Array) -> str:
    lengths = np.linalg.norm(drawn, axis=1)
    if lengths.min() > 0.7 and lengths.max() <= 1 and lengths.max() - lengths.min() > 0.1:
        return (
            "The length is between 0.71 and 1, and should be 1: the two radii are √s and √(1 − s), "
            "whose squares add up to 1. Are the roots there?"
        )
    return _off_length("A unit quaternion", lengths)


LAWS: dict[str, dict[str, Any]] = {
    "direction": {"shape": (3,), "fault": _direction_fault, "uniforms": _direction_rows},
    "rotation": {"shape": (3, 3), "fault": _rotation_fault, "uniforms": _rotation_rows},
    "quaternion": {
        "shape": (4,),
        "fault": _quaternion_fault,
        "uniforms": lambda q: _rotation_rows(matrix_from_quaternion(q)),  # q and −q are one
    },
}
"""How draws of each kind are judged: the shape, the fault and the uniforms of a `Sampler`."""
