"""Run a cell in the browser's Python, after the statements above it that it needs.

Each run begins without variables of earlier runs. Therefore the same code gives the same outputs,
no matter how often and in which order the cells of a page are run.
"""

import ast
import base64
import io
import linecache
import logging
import sys
import traceback
from collections.abc import Callable, Sequence
from contextlib import redirect_stderr, redirect_stdout
from types import ModuleType
from typing import Any

from rbclassroom.assignments.needed_code import needed

Show = Callable[[str, str], object]
"""A function that shows an output. Its arguments are the kind of the output and its content.

The kinds are "text", "html", "hint" and "error".
"""
CUT = 100_000
"""The largest number of characters that a run may print."""

# hide messages about the cache of fonts
logging.getLogger("matplotlib.font_manager").setLevel(logging.ERROR)


def parsed(source: str, name: str) -> list[ast.stmt]:
    """Return the statements of a cell, and keep its lines for messages about errors."""
    linecache.cache[name] = (len(source), None, source.splitlines(keepends=True), name)
    return ast.parse(source, name).body


def run(above: Sequence[str], source: str, known: Sequence[str], show: Show) -> str:
    """Run a cell after the statements above it that it needs, and show its outputs.

    Return the name of a missing package if it is `known`; then the page loads the package and runs
    the cell again. Otherwise return an empty string.
    """
    module = sys.modules["__main__"] = ModuleType("__main__")
    module.__dict__["input"] = _no_input
    hidden, written = _Written(lambda *_: None), _Written(show)
    cells, unread = {}, list[SyntaxError]()
    for k, each in enumerate(above, 1):
        try:
            cells[f"<cell {k}>"] = parsed(each, f"<cell {k}>")
        except SyntaxError as error:  # the other cells run without it, if they can
            unread.append(error)
    try:
        cell = parsed(source, "<this cell>")
        kept = needed([each for some in cells.values() for each in some], cell)
        with redirect_stdout(hidden), redirect_stderr(hidden):
            for name, statements in cells.items():
                part = ast.Module([each for each in statements if each in kept], [])
                exec(compile(part, name, "exec"), module.__dict__)
        _take_figures(None)
        last = cell.pop() if cell and isinstance(cell[-1], ast.Expr) else None
        with redirect_stdout(written), redirect_stderr(written):
            exec(compile(ast.Module(cell, []), "<this cell>", "exec"), module.__dict__)
            if isinstance(last, ast.Expr):
                code = compile(ast.Expression(last.value), "<this cell>", "eval")
                _display(eval(code, module.__dict__), show)
    except BaseException as error:
        package = (getattr(error, "name", None) or "").partition(".")[0]
        if isinstance(error, ModuleNotFoundError) and package in known:
            return package
        show(*_told(unread[0] if unread and isinstance(error, NameError) else error))
    _take_figures(show)
    return ""


def _no_input(*_: object) -> None:
    raise EOFError("input() has no answer here; write the value into the code")


class _Written(io.TextIOBase):
    """A stream that shows up to `CUT` characters of printed text."""

    def __init__(self, show: Show) -> None:
        self._show, self._room = show, CUT

    def write(self, text: str) -> int:
        if self._room > 0 and text:
            cut = "" if len(text) <= self._room else "\n… The rest of the text is not shown."
            self._show("text", text[: self._room] + cut)
            self._room -= len(text)
        return len(text)


def _display(value: Any, show: Show) -> None:
    page = getattr(value, "_repr_html_", None)
    if page and not isinstance(value, type):
        show("html", page())
    elif value is not None:
        show("text", repr(value))


def _take_figures(show: Show | None) -> None:
    """Show all figures, unless `show` is None, and close them."""
    plt: Any = sys.modules.get("matplotlib.pyplot")
    for number in plt.get_fignums() if plt else []:
        if show:
            content = io.BytesIO()
            plt.figure(number).savefig(content, format="png")
            source = f"data:image/png;base64,{base64.b64encode(content.getvalue()).decode()}"
            show("html", f'<img alt="The figure that the cell draws" src="{source}">')
        plt.close(number)


def _told(error: BaseException) -> tuple[str, str]:
    """Return an error as a student should read it: its place in the cells, and its message."""
    if hasattr(error, "_render_traceback_"):  # a hint needs no traceback
        return "hint", f"{error} {getattr(error, 'case', '')}".rstrip()
    lines = [
        f"{frame.filename.strip('<>')}, line {frame.lineno}: {frame.line}"
        for frame in traceback.extract_tb(error.__traceback__)
        if frame.filename.startswith(("<cell ", "<this cell"))
    ]
    lines += traceback.format_exception_only(error)
    if isinstance(error, SyntaxError) and "U+00A0" in str(error):
        lines.append("This is a no-break space, often from a copied text: type a normal space.")
    return "error", "\n".join(line.rstrip() for line in lines)
