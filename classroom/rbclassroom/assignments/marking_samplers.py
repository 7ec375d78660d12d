"""Test a student's sampler against known distributions, for problems with random answers."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rbclassroom.assignments.marking import Mistake, NotYet, as_numbers, call_student, show
from rbcourse import Array, exp_so3, matrix_from_quaternion
from rbcourse.sampling import Rng, angle_law

DELTA = 1e-6  # the probability of rejecting a correct sampler is below this value
Rows = dict[str, Array]


@dataclass(frozen=True)
class Sampler:
    """A problem whose answer is a sampler: the student's ``function(rng)`` returns one draw.

    A correct sampler is rejected with a probability below `DELTA`, for every generator. This
    follows from the inequality of Dvoretzky, Kiefer and Wolfowitz, with Massart's constant. For
    every n, the observed distribution of n independent numbers is off by more than e with a
    probability of at most 2 exp(−2 n e²).

    If the sampler is correct, each row of `uniforms` has independent numbers that are uniform on
    [0, 1]. If the sampler makes a known mistake, these numbers have other distributions, and
    `mistakes` has the quantiles of these distributions.
    """

    shape: tuple[int, ...]  # of one draw
    fault: Callable[[Array], str]  # returns a hint if a stacked draw is invalid, else ""
    uniforms: Callable[[Array], Rows]  # returns named rows of numbers from stacked draws
    mistakes: Sequence[Mistake]
    own: str = ""  # as in `Problem`
    draws: int = 20_000

    def accepts(self, function: Callable[..., Any], rng: Rng = None) -> bool:
        """Call a sampler many times, and compare its distributions with the right ones."""
        rng = np.random.default_rng(rng)
        drawn = self._as_draws(call_student(function, (rng,), self.draws))
        if (drawn[:10] == drawn[0]).all():
            raise NotYet(
                "Every call returns the same draw. Does your function make, and seed, a new "
                "generator in each call? Draw from the rng that your function is given."
            )
        if hint := self.fault(drawn):
            raise NotYet(hint)
        rows = {name: np.sort(row) for name, row in self.uniforms(drawn).items()}
        gaps = {name: _gap(row) for name, row in rows.items()}
        worst = max(gaps, key=lambda name: gaps[name] / self._bound(rows, name))
        if gaps[worst] <= self._bound(rows, worst):
            said = f"The {self.draws} draws agree with the distribution that is wanted."
            print(f"{said} {self.own}".rstrip())
            return True
        raise NotYet(
            self._hint(rows)
            or f"These draws are not uniform. The distribution of {worst} is off by "
            f"{gaps[worst]:.3f}; by chance alone it is below {self._bound(rows, worst):.3f}."
        )

    def _hint(self, rows: Rows) -> str:
        """Return the hint of the mistake with the nearest distributions, or "" if none is near."""
        near, hint = 2.0, ""  # two bounds: samples of one distribution differ by less
        for mistake in self.mistakes:
            for result in mistake.results:
                pairs = zip(rows.items(), result, strict=True)
                far = max(_gap_to(row, part) / self._bound(rows, key) for (key, row), part in pairs)
                near, hint = (far, mistake.hint) if far < near else (near, hint)
        return hint

    def _as_draws(self, given: list[Any]) -> Array:
        drawn = as_numbers(given)
        if drawn is not None and drawn.shape[1:] == self.shape and np.isfinite(drawn).all():
            return drawn
        for i, got in enumerate(given):
            numbers = as_numbers(got)
            if numbers is None:
                why = " Does a branch end without return?" if got is None else ""
                raise NotYet(f"Draw {i} should be numbers; yours is {show(got)}.{why}")
            if numbers.shape != self.shape:
                raise NotYet(f"A draw should have shape {self.shape}; yours has {numbers.shape}.")
            if not np.isfinite(numbers).all():
                raise NotYet(f"Draw {i} is not finite: {show(numbers)}. Do you divide by 0?")
        return np.array(given, dtype=float)

    def _bound(self, rows: Rows, name: str) -> float:
        return float(np.sqrt(np.log(2 * len(rows) / DELTA) / (2 * len(rows[name]))))


def _gap(ordered: Array) -> float:
    """Return the largest distance between a sample's distribution and the uniform one."""
    steps = np.arange(len(ordered) + 1) / len(ordered)
    return float(max((steps[1:] - ordered).max(), (ordered - steps[:-1]).max()))


def quantiles(row: Array) -> Array:
    """Return the quantiles of a sample at the levels 0.005, 0.015, …, 0.995."""
    return np.quantile(row, np.arange(0.005, 1, 0.01))


def _gap_to(ordered: Array, others: Array) -> float:
    """Return the largest distance between a sample's distribution and given quantiles."""
    levels = (np.arange(len(others)) + 0.5) / len(others)
    return float(np.abs(np.searchsorted(ordered, others) / len(ordered) - levels).max())


def _off_length(what: str, drawn: Array) -> str:
    lengths = np.linalg.norm(drawn, axis=1)
    worst = lengths[np.argmax(np.abs(lengths - 1))]
    right = abs(worst - 1) <= 1e-9
    return "" if right else f"{what} should have the length 1; one of yours has {worst:.10g}."


def _quaternion_fault(drawn: Array) -> str:
    lengths = np.linalg.norm(drawn, axis=1)
    if lengths.min() > 0.7 and lengths.max() <= 1 and np.ptp(lengths) > 0.1:
        return (
            "The length is between 0.71 and 1, and should be 1. The two radii should be √s and "
            "√(1 − s), whose squares add up to 1. Does your code have the roots?"
        )
    return _off_length("A unit quaternion", drawn)


def _rotation_fault(R: Array) -> str:
    off = np.abs((stretch := np.linalg.svd(R, compute_uv=False)) - 1)
    if off.max() > 1e-9 > off[:, :2].max():
        return (
            "A draw is not a rotation. If you reflect by I − 2VVᵀ, the length of V is not 1. Its "
            "radius should be √z and its height √(1 − z); does your code have both roots?"
        )
    if off.max() > 1e-9:
        worst = stretch[np.argmax(off.max(axis=1))].round(10).tolist()
        return f"A draw is not a rotation: its singular values are {worst}."
    if negative := (np.linalg.det(R) < 0).mean():
        how = "all" if negative == 1 else f"{negative:.0%}"
        return (
            f"The determinant is −1 for {how} of your draws: these are mirrors. A reflection times "
            "a turn is a mirror; a change of sign makes it a rotation."
        )
    return ""


def _directions(*vectors: list[int]) -> Array:
    return np.array(vectors) / np.linalg.norm(vectors, axis=1, keepdims=True)


_DIAGONALS = _directions([1, 1, 1], [1, 1, -1], [1, -1, 1])
_AXES = [*np.eye(3), *_DIAGONALS, *_directions([-1, 1, 1])]
_FIXED = exp_so3([0.4, -1.1, 0.7])


def _direction_rows(drawn: Array) -> Rows:
    rows = {f"the height along {axis.round(2).tolist()}": drawn @ axis for axis in _AXES}
    before = np.einsum("ni,ni->n", drawn[:-1:2], drawn[1::2])
    rows["the height of a draw along the one before"] = before
    return {name: (1 + height) / 2 for name, height in rows.items()}


def _rotation_rows(R: Array) -> Rows:
    """Return rows of entries and angles that are uniform if the rotations R are uniform."""
    heights = {f"the entry R[{i}, {j}]": R[:, i, j] for i in range(3) for j in range(3)}
    for i, x in enumerate(_DIAGONALS):
        for j, y in enumerate(_DIAGONALS):
            heights[f"the cosine between diagonal {i} and the image of diagonal {j}"] = R @ y @ x
    turns = {"the angle of the turn": R, "the angle to a fixed rotation": _FIXED.T @ R}
    turns["the angle from a draw to the next"] = R[:-1:2].swapaxes(1, 2) @ R[1::2]
    rows: Rows = {name: (1 + height) / 2 for name, height in heights.items()}
    for name, turn in turns.items():
        cosines = np.clip((np.trace(turn, axis1=1, axis2=2) - 1) / 2, -1, 1)
        rows[name] = angle_law(np.arccos(cosines))
    return rows


LAWS: dict[str, dict[str, Any]] = {
    "direction": {
        "shape": (3,),
        "fault": lambda drawn: _off_length("A direction", drawn),
        "uniforms": _direction_rows,
    },
    "rotation": {"shape": (3, 3), "fault": _rotation_fault, "uniforms": _rotation_rows},
    "quaternion": {
        "shape": (4,),
        "fault": _quaternion_fault,
        "uniforms": lambda q: _rotation_rows(matrix_from_quaternion(q)),  # q and −q give the same R
    },
}
"""The shape, the fault and the uniforms of a `Sampler`, for each kind of draws."""
