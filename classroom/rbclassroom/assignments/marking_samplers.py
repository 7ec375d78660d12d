"""Problems with random answers: a student's sampler, tested against known distributions."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rbclassroom.assignments.marking import Mistake, as_numbers, show
from rbclassroom.assignments.student_code import NotYet, call_student
from rbcourse import Array
from rbcourse.sampling import Rng

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
        Their answers are ``(n, rng)`` and return n draws at once.
    allowed : tuple of str
        As for a `Problem`.
    draws : int
        How many are taken.
    """

    shape: tuple[int, ...]
    fault: Callable[[Array], str]
    uniforms: Callable[[Array], dict[str, Array]]
    mistakes: Sequence[Mistake]
    allowed: tuple[str, ...] = ()
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
            for answer in mistake.answers:
                far = self._distance(rows, answer, near)
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

    def _distance(self, rows: dict[str, Array], answer: Callable[..., Any], near: float) -> float:
        """Return how far these draws are from those of an answer, or something not below `near`."""
        others, far = self.uniforms(answer(self.draws, np.random.default_rng(1))), 0.0
        for name, row in rows.items():
            far = max(far, _gap_between(row, others[name]) / self._bound(rows, name))
            if far >= near:
                break
        return far


def _gap(row: Array) -> float:
    """Return how far the distribution of numbers is from the uniform one."""
    ordered, n = np.sort(row), len(row)
    steps = np.arange(n + 1) / n
    return float(max((steps[1:] - ordered).max(), (ordered - steps[:-1]).max()))


def _gap_between(one: Array, other: Array) -> float:
    places = np.sort(np.concatenate([one, other]))
    counts = [np.searchsorted(np.sort(row), places, "right") / len(row) for row in (one, other)]
    return float(np.abs(counts[0] - counts[1]).max())
