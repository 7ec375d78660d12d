"""Run a cell in the browser's Python, after the statements above it that it needs.

Each run begins without variables of earlier runs. Therefore the same code gives the same outputs,
no matter how often and in which order the cells of a page are run.
"""

import ast
import base64
import io
import linecache
import logging
import symtable
import sys
import traceback
from collections.abc import Callable, Sequence
from contextlib import redirect_stderr, redirect_stdout
from types import ModuleType
from typing import Any

Show = Callable[[str, str], object]
"""A function that shows an output. Its arguments are the kind of the output and its content.

The kinds are "text", "html", "hint" and "error".
"""
CUT = 100_000
"""The largest number of characters that a run may print."""
_IMPORT = ast.Import | ast.ImportFrom
_DEFINITION = ast.FunctionDef | ast.ClassDef

# hide messages about the cache of fonts
logging.getLogger("matplotlib.font_manager").setLevel(logging.ERROR)


def needed(above: Sequence[ast.stmt], cell: Sequence[ast.stmt]) -> list[ast.stmt]:
    """Return the statements above on which the names of a cell depend.

    A statement is needed if it binds a name that is used below, or if it may change the object of
    such a name. An object may change by an assignment to a part of it, by one of its methods, or as
    the first argument of a call whose result is not kept. A call that uses only modules may set an
    option of these modules. If a random generator is needed, every statement that uses it is
    needed.
    """
    statements = [*above, *cell]
    read, bound = {}, {}
    for each in statements:
        read[each], bound[each] = names_in(each)
    modules = set().union(*(bound[each] for each in above if isinstance(each, _IMPORT)))
    random = set().union(*(bound[each] for each in above if "default_rng" in ast.dump(each)))
    late = set[str]()  # names that are read when a function is called
    while True:
        kept, wanted = [], set(late)
        for each in reversed(statements):
            options = read[each] if isinstance(each, ast.Expr) and read[each] <= modules else set()
            changed = _changed(each) - modules | options | (read[each] & random)
            if each in cell or (bound[each] | changed) & wanted:
                sure = isinstance(each, ast.Assign | _DEFINITION | _IMPORT)
                wanted = wanted - (bound[each] if sure else set()) | read[each]
                kept.append(each)
        functions = (read[each] for each in kept if isinstance(each, _DEFINITION))
        if late == (late := late.union(*functions)):
            return [each for each in above if each in kept]


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
    hidden, written = _Written(lambda *_: None), _Written(show)
    try:
        cells = {f"<cell {k}>": parsed(each, f"<cell {k}>") for k, each in enumerate(above, 1)}
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
        show(*_told(error))
    _take_figures(show)
    return ""


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
    return "error", "\n".join([*lines, "".join(traceback.format_exception_only(error))]).rstrip()


def names_in(statement: ast.stmt) -> tuple[set[str], set[str]]:
    """Return the names that a statement reads but does not bind itself, and those it may bind."""
    tables = [symtable.symtable(ast.unparse(statement), "<statement>", "exec")]
    symbols = tables[0].get_symbols()
    bound = {each.get_name() for each in symbols if each.is_assigned() or each.is_imported()}
    read = set[str]()
    for table in tables:
        tables += table.get_children()
        symbols = [each for each in table.get_symbols() if each.is_global()]
        read |= {each.get_name() for each in symbols if each.is_referenced()}
    if isinstance(statement, ast.For):  # the loop assigns its target before the body reads it
        target = {node.id for node in ast.walk(statement.target) if isinstance(node, ast.Name)}
        read = read - target | names_in(ast.Expr(statement.iter))[0]
    return read, bound


def _changed(statement: ast.stmt) -> set[str]:
    """Return the names whose objects a statement may change."""
    found = set[str]()
    for node in ast.walk(statement):
        if isinstance(node, ast.Attribute | ast.Subscript) and isinstance(node.ctx, ast.Store):
            found |= _root(node)
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            found |= _root(node.func)
    call = statement.value if isinstance(statement, ast.Expr) else None
    if isinstance(call, ast.Call) and call.args and _root(call.func) != {"print"}:
        found |= _root(call.args[0])
    return found


def _root(node: ast.AST) -> set[str]:
    """Return {"name"} for a chain such as ``name.part[0].method``, otherwise an empty set."""
    while isinstance(node, ast.Attribute | ast.Subscript | ast.Starred):
        node = node.value
    return {node.id} if isinstance(node, ast.Name) else set()
