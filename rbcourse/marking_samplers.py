"""Problems whose answer is random: a student's sampler, judged by the laws of its draws."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rbcourse._numerics import Array, Rng
from rbcourse.marking import Mistake, as_numbers, show
from rbcourse.own_work import NotYet, call_student

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
        """Draw many times, one at a time, and compare their distributions with the right ones.

        Parameters
        ----------
        function : callable
            The student's.
        rng : Generator, int or None
            What is handed to it.

        Returns
        -------
        bool
            True, always: a notebook asserts it.

        Raises
        ------
        NotYet
            With one hint.
        """
        rng = np.random.default_rng(rng)
        first = [call_student(function, (rng,), self.allowed) for _ in range(10)]
        self._look_at(first)
        drawn = np.array(first + [function(rng) for _ in range(self.draws - 10)], dtype=float)
        if hint := self.fault(drawn):
            raise NotYet(hint)
        rows = self.uniforms(drawn)
        gaps = {name: _gap(row) for name, row in rows.items()}
        worst = max(gaps, key=lambda name: gaps[name] / self._bound(rows, name))
        if gaps[worst] <= self._bound(rows, worst):
            print(f"{self.draws} draws look as they should.")
            return True
        for mistake in self.mistakes:
            if any(self._looks_like(rows, answer) for answer in mistake.answers):
                raise NotYet(mistake.hint)
        raise NotYet(
            f"These draws are not uniform. What gives it away: {worst}, whose distribution is off "
            f"by {gaps[worst]:.3f}; chance alone stays below {self._bound(rows, worst):.3f}."
        )

    def _look_at(self, first: list[Any]) -> None:
        for got in first:
            numbers = as_numbers(got)
            if numbers is None:
                raise NotYet(f"One draw of numbers is wanted; yours is {show(got)}.")
            if numbers.shape != self.shape:
                raise NotYet(f"A draw has the shape {self.shape}; yours has {numbers.shape}.")
            if not np.isfinite(numbers).all():
                raise NotYet(f"A draw is not finite: {show(numbers)}.")
        if all(np.array_equal(first[0], got) for got in first[1:]):
            raise NotYet(
                "Every call returns the same draw. Does your function make, and seed, a new "
                "generator each time? Draw from the rng that it is given."
            )

    def _bound(self, rows: dict[str, Array], name: str) -> float:
        return float(np.sqrt(np.log(2 * len(rows) / DELTA) / (2 * len(rows[name]))))

    def _looks_like(self, rows: dict[str, Array], answer: Callable[..., Any]) -> bool:
        """Return whether draws with a mistake are distributed like these, as far as one can see."""
        others = self.uniforms(answer(self.draws, np.random.default_rng(1)))
        return all(
            _gap_between(row, others[name]) <= 2 * self._bound(rows, name)
            for name, row in rows.items()
        )


def _gap(row: Array) -> float:
    """Return how far the distribution of numbers is from the uniform one."""
    ordered, n = np.sort(row), len(row)
    steps = np.arange(n + 1) / n
    return float(max((steps[1:] - ordered).max(), (ordered - steps[:-1]).max()))


def _gap_between(one: Array, other: Array) -> float:
    places = np.sort(np.concatenate([one, other]))
    counts = [np.searchsorted(np.sort(row), places, "right") / len(row) for row in (one, other)]
    return float(np.abs(counts[0] - counts[1]).max())
