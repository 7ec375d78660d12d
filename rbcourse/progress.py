"""How far a long computation is: a bar in the notebook, which ends as a line."""

from collections.abc import Callable

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
        return f"<div>{bar if self.done < self.total else ''}{self}</div>"


def bar(what: str) -> Callable[[int, int], None]:
    """Show a bar, and return the function that moves it.

    Parameters
    ----------
    what : str
        What is computed.

    Returns
    -------
    callable
        ``report(done, total)`` shows how much is done.

    Examples
    --------
    >>> report = bar("Problems")
    Problems: 0 of 1
    >>> report(2000, 2000)
    Problems: 2,000 of 2,000
    """
    handle = display(Stage(what, 0, 1), display_id=True)

    def report(done: int, total: int) -> None:
        handle.update(Stage(what, done, total))

    return report
