"""Docstrings that share the descriptions of parameters.

A docstring may leave out parameters that another function, or the docstring of the module,
describes. When the module is imported, these entries are copied, so that `help` of each function is
complete. A section "Returns" of one line may be an argument of the decorator.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import cache
from inspect import cleandoc, signature
from itertools import groupby
from operator import itemgetter
from typing import Any, TypeVar

Function = TypeVar("Function", bound=Callable[..., Any])
_SECTION = re.compile(
    r"^(?:Parameters\n-+\n(.*?))?(?=^\S[^\n]*\n-{3,}\n|\Z)", re.MULTILINE | re.DOTALL
)
_ENTRY = re.compile(r"^(\S[^\n]*)\n((?:[ ]+[^\n]*\n|\n)*)", re.MULTILINE)


def described_by(
    *sources: Callable[..., Any] | str | None, returns: str = ""
) -> Callable[[Function], Function]:
    """Return a decorator that copies missing descriptions of parameters from other docstrings.

    If given, `returns` is the text of the section "Returns".
    """
    result = f"Returns\n-------\n{returns}\n\n" if returns else ""

    def complete(function: Function) -> Function:
        if function.__doc__ is None:  # python -OO
            return function
        text, known = cleandoc(function.__doc__) + "\n", dict[str, tuple[str, str]]()
        for one in (*sources, function):
            known |= _described(one.__doc__ if callable(one) else one)
        wanted = (known[name] for name in signature(function).parameters if name != "self")
        entries = (
            ", ".join(name for name, _ in group) + entry
            for entry, group in groupby(wanted, itemgetter(1))
        )
        place = next(_SECTION.finditer(text))
        before, after = text[: place.start()].rstrip(), result + text[place.end() :]
        function.__doc__ = f"{before}\n\nParameters\n----------\n{''.join(entries)}\n{after}"
        return function

    return complete


@cache
def _described(docstring: str | None) -> dict[str, tuple[str, str]]:
    """Return the name as written, and the entry, of each parameter that a docstring describes."""
    found = next(_SECTION.finditer(cleandoc(docstring or "") + "\n"))
    return {
        name.strip(" *"): (name.strip(), f"{colon}{kind}\n{text.rstrip()}\n")
        for head, text in _ENTRY.findall(found[1] or "")
        for names, colon, kind in [head.partition(" : ")]
        for name in names.split(",")
    }
