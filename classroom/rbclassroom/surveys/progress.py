"""A progress bar for notebooks; at the end it becomes a line of text."""

import html
import sys
from collections.abc import Callable
from typing import Any


def bar(what: str) -> Callable[[int, int], None]:
    """Return a function that shows progress as a bar or, outside of notebooks, as a line.

    Examples
    --------
    >>> report = bar("Problems")
    >>> report(2000, 2000)
    Problems: 2,000 of 2,000
    """
    handle: Any = None

    def report(done: int, total: int) -> None:
        nonlocal handle
        line = f"{what}: {done:,} of {total:,}"
        bar = f'<progress max="{total}" value="{done}"></progress> ' if done < total else ""
        stage = {"text/plain": line, "text/html": f"<div>{bar}{html.escape(line)}</div>"}
        shell = sys.modules.get("IPython")
        if shell is None or shell.get_ipython() is None:
            print(line, end="\r" if done < total else "\n", flush=True)
        elif handle is None:
            handle = shell.display.display(stage, raw=True, display_id=True)
        else:
            handle.update(stage, raw=True)

    return report
