"""A progress bar for notebooks, which ends as a line of text."""

import html
from collections.abc import Callable
from typing import Any

from IPython.display import display


class Stage:
    """What the bar shows at one time.

    Parameters
    ----------
    what : str
        What is computed.
    done, total : int
        How much of it there is.
    """

    def __init__(self, what: str, done: int, total: int) -> None:
        self.what, self.done, self.total = what, done, total

    def __repr__(self) -> str:
        """Return the stage as a line of text."""
        return f"{self.what}: {self.done:,} of {self.total:,}"

    def _repr_html_(self) -> str:
        bar = f'<progress max="{self.total}" value="{self.done}"></progress> '
        return f"<div>{bar if self.done < self.total else ''}{html.escape(repr(self))}</div>"


def bar(what: str) -> Callable[[int, int], None]:
    """Return a function that shows how much is done: a bar; outside of notebooks, lines.

    Examples
    --------
    >>> report = bar("Problems")
    >>> report(2000, 2000)
    Problems: 2,000 of 2,000
    """
    handle: Any = None

    def report(done: int, total: int) -> None:
        nonlocal handle
        stage = Stage(what, done, total)
        if handle is None:
            handle = display(stage, display_id=True)
        else:
            handle.update(stage)

    return report
