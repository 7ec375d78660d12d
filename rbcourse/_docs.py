"""Docstrings that share the descriptions of parameters.

In the source, an entry "As for `f`." takes the place of a description that the function f has. When
the module is imported, the description is copied, so that `help` of each function is complete.
The docstring of a module may describe parameters that many of its functions have.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from inspect import cleandoc, signature
from typing import Any, TypeVar

Function = TypeVar("Function", bound=Callable[..., Any])
_SECTION = re.compile(r"^Parameters\n-+\n(.*?)(?=^\S[^\n]*\n-+\n|\Z)", re.MULTILINE | re.DOTALL)
_ENTRY = re.compile(r"^(\S[^\n]*)\n((?:[ ]+[^\n]*\n|\n)*)", re.MULTILINE)


def described_by(*sources: Callable[..., Any]) -> Callable[[Function], Function]:
    """Return a decorator that copies the descriptions of parameters from other functions."""

    def complete(function: Function) -> Function:
        if function.__doc__ is None:  # python -OO
            return function
        known = {
            name: entry
            for one in sources
            for entry in _entries(one.__doc__)
            for name in _names(entry)
        }
        text = cleandoc(function.__doc__) + "\n"
        for entry in _entries(function.__doc__):
            if re.search(r"\n\s+As for ", entry):
                copied = dict.fromkeys(known[name] for name in _names(entry))
                text = text.replace(entry, "".join(copied))
        function.__doc__ = text
        return function

    return complete


def described_together(module_doc: str | None, *functions: Callable[..., Any]) -> None:
    """Add the section "Parameters" to functions; its entries are in the docstring of the module."""
    shared = _entries(module_doc)
    for one in functions:
        text, names = one.__doc__, set(signature(one).parameters)
        if text is None:  # python -OO
            continue
        entries = "".join(entry for entry in shared if names & set(_names(entry)))
        before, heading, examples = (cleandoc(text) + "\n").partition("Examples\n--------\n")
        one.__doc__ = f"{before}Parameters\n----------\n{entries}\n{heading}{examples}"


def _entries(docstring: str | None) -> list[str]:
    """Return the entries of the section "Parameters" of a docstring."""
    found = _SECTION.search(cleandoc(docstring or "") + "\n")
    if found is None:
        return []
    return [f"{head}\n{text.rstrip()}\n" for head, text in _ENTRY.findall(found[1])]


def _names(entry: str) -> list[str]:
    return [name.strip(" *") for name in entry.split("\n")[0].split(" : ")[0].split(",")]
