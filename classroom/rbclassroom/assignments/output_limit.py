"""An IPython extension that ends a cell whose text output is endless.

A loop that prints faster than the kernel sends would otherwise fill the kernel's memory, and end it
in a later cell.
"""

import sys
from collections.abc import Callable
from typing import Any

MOST = 10_000_000  # characters of a cell
TOO_MUCH = "the output is too large; does a loop in the answer never end?"


def load_ipython_extension(shell: Any) -> None:
    """Let stdout and stderr raise an error if a cell writes more than `MOST` characters."""
    written = 0

    def begin(_: object) -> None:
        nonlocal written
        written = 0

    def limited(write: Callable[[str], Any]) -> Callable[[str], Any]:
        def counted(text: str) -> Any:
            nonlocal written
            written += len(text)
            if written > MOST:
                raise RuntimeError(TOO_MUCH)
            return write(text)

        return counted

    for stream in (sys.stdout, sys.stderr):
        stream.write = limited(stream.write)  # type: ignore[method-assign]
    shell.events.register("pre_run_cell", begin)
