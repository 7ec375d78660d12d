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
from itertools import chain
from types import CodeType, ModuleType
from typing import Any

Show = Callable[[str, str], object]
"""A function that shows an output. Its arguments are the kind of the output and its content.

The kinds are "text", "html", "hint" and "error".
"""
CUT = 100_000
"""The largest number of characters that a run may print."""

# hide messages about the cache of fonts
logging.getLogger("matplotlib.font_manager").setLevel(logging.ERROR)


def needed(above: Sequence[Sequence[ast.stmt]], cell: Sequence[ast.stmt]) -> list[list[ast.stmt]]:
    """Return, for each cell above, the statements on which the names of a cell depend.

    A statement is needed if it binds a name that is used below, or if it may change the object of
    such a name. An object may change by an assignment to a part of it, by one of its methods, or as
    the first argument of a call whose result is not kept. If a random generator is needed, every
    statement that uses it is needed.
    """
    generators = {
        name
        for statement in chain(*above)
        if "default_rng" in ast.dump(statement)
        for name in _bound(statement)
    }
    modules = {name for each in chain(*above) if _is_import(each) for name in _bound(each)}
    wanted = set[str]()
    for statement in reversed(cell):
        wanted = wanted - _replaced(statement) | _read(statement)
    while True:
        kept, names = [], set(wanted)
        for statement in reversed([*chain(*above)]):
            changed = _changed(statement, modules) | (_read(statement) & generators)
            if (_bound(statement) | changed) & names:
                names = names - _replaced(statement) | _read(statement)
                kept.append(statement)
        functions = (each for each in kept if isinstance(each, ast.FunctionDef | ast.ClassDef))
        late = wanted.union(*map(_read, functions))  # names that are read when a function is called
        if late == wanted:
            return [[each for each in some if each in kept] for some in above]
        wanted = late


def parsed(source: str, name: str) -> list[ast.stmt]:
    """Return the statements of a cell; an import of several names becomes several statements."""
    linecache.cache[name] = (len(source), None, source.splitlines(keepends=True), name)
    statements = list[ast.stmt]()
    for each in ast.parse(source, name).body:
        if isinstance(each, ast.Import):
            statements += [ast.copy_location(ast.Import([alias]), each) for alias in each.names]
        elif isinstance(each, ast.ImportFrom):
            parts = (ast.ImportFrom(each.module, [alias], each.level) for alias in each.names)
            statements += [ast.copy_location(part, each) for part in parts]
        else:
            statements.append(each)
    return statements


def run(above: Sequence[str], source: str, known: Sequence[str], show: Show) -> str:
    """Run a cell after the statements above it that it needs, and show its outputs.

    Return the name of a missing package if it is `known`; then the page loads the package and runs
    the cell again. Otherwise return an empty string.
    """
    module = sys.modules["__main__"] = ModuleType("__main__")
    written, error = _Written(show), None
    try:
        cells = [parsed(each, f"<cell {k}>") for k, each in enumerate(above, 1)]
        cell = parsed(source, "<this cell>")
        with redirect_stdout(_Written(None)), redirect_stderr(_Written(None)):
            for k, statements in enumerate(needed(cells, cell), 1):
                exec(_code(statements, f"<cell {k}>"), module.__dict__)
        _close_figures()
        last = cell.pop() if cell and isinstance(cell[-1], ast.Expr) else None
        with redirect_stdout(written), redirect_stderr(written):
            exec(_code(cell, "<this cell>"), module.__dict__)
            if isinstance(last, ast.Expr):
                code = compile(ast.Expression(last.value), "<this cell>", "eval")
                _display(eval(code, module.__dict__), show)
    except BaseException as raised:
        error = raised
    if isinstance(error, ModuleNotFoundError) and (error.name or "").partition(".")[0] in known:
        return str(error.name).partition(".")[0]
    _show_figures(show)
    if error:
        show("hint" if hasattr(error, "_render_traceback_") else "error", _told(error))
    return ""


class _Written(io.TextIOBase):
    """A stream that shows up to `CUT` characters of printed text, or nothing if `show` is None."""

    def __init__(self, show: Show | None) -> None:
        self._show, self._room = show, CUT

    def write(self, text: str) -> int:
        if self._show and self._room > 0 and text:
            cut = "" if len(text) <= self._room else "\n… The rest of the text is not shown."
            self._show("text", text[: self._room] + cut)
            self._room -= len(text)
        return len(text)


def _code(statements: list[ast.stmt], name: str) -> CodeType:
    return compile(ast.Module(statements, []), name, "exec")


def _display(value: Any, show: Show) -> None:
    if value is None:
        return
    page = getattr(value, "_repr_html_", None)
    if page and not isinstance(value, type):
        show("html", page())
    else:
        show("text", repr(value))


def _close_figures() -> None:
    if "matplotlib.pyplot" in sys.modules:
        sys.modules["matplotlib.pyplot"].close("all")


def _show_figures(show: Show) -> None:
    plt: Any = sys.modules.get("matplotlib.pyplot")
    for number in plt.get_fignums() if plt else []:
        content = io.BytesIO()
        plt.figure(number).savefig(content, format="png")
        source = base64.b64encode(content.getvalue()).decode()
        show(
            "html",
            f'<img alt="The figure that the cell draws" src="data:image/png;base64,{source}">',
        )
    _close_figures()


def _told(error: BaseException) -> str:
    """Return an error as a student should read it: its place in the cells, and its message."""
    if hasattr(error, "_render_traceback_"):  # a hint needs no traceback
        return str(error)
    lines = [
        f"{frame.f_code.co_filename.strip('<>')}, line {line}: "
        + linecache.getline(frame.f_code.co_filename, line).strip()
        for frame, line in traceback.walk_tb(error.__traceback__)
        if frame.f_code.co_filename.startswith(("<cell ", "<this cell"))
    ]
    return "\n".join([*lines, "".join(traceback.format_exception_only(error))]).rstrip()


def _is_import(statement: ast.stmt) -> bool:
    return isinstance(statement, ast.Import | ast.ImportFrom)


def _bound(statement: ast.stmt) -> set[str]:
    """Return the names to which a statement may assign a value."""
    symbols = _table(statement).get_symbols()
    return {each.get_name() for each in symbols if each.is_assigned() or each.is_imported()}


def _read(statement: ast.stmt) -> set[str]:
    """Return the names that a statement reads but does not bind itself."""
    found, waiting = set[str](), [_table(statement)]
    for table in waiting:
        outside = table.get_type() == "module"
        waiting += table.get_children()
        used = (each for each in table.get_symbols() if each.is_referenced())
        found |= {each.get_name() for each in used if outside or each.is_global()}
    if isinstance(statement, ast.For):  # the loop assigns its target before the body reads it
        given = (node.id for node in ast.walk(statement.target) if isinstance(node, ast.Name))
        found = found - set(given) | _read(ast.Expr(statement.iter))
    return found


def _replaced(statement: ast.stmt) -> set[str]:
    """Return the names that certainly have a new value after a statement."""
    sure = ast.Assign | ast.FunctionDef | ast.ClassDef | ast.Import | ast.ImportFrom
    return _bound(statement) if isinstance(statement, sure) else set()


def _table(statement: ast.stmt) -> symtable.SymbolTable:
    return symtable.symtable(ast.unparse(statement), "<statement>", "exec")


def _changed(statement: ast.stmt, modules: set[str]) -> set[str]:
    """Return the names whose objects a statement may change."""
    value = statement.value if isinstance(statement, ast.Expr) else None
    call = value if isinstance(value, ast.Call) else None
    if call and _root(call.func) == {"print"}:
        return set()
    found = set[str]()
    for node in ast.walk(statement):
        if isinstance(node, ast.Attribute | ast.Subscript) and isinstance(node.ctx, ast.Store):
            found |= _root(node)
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            found |= _root(node.func)
    found -= modules
    if call:
        given = [*call.args, *(each.value for each in call.keywords)]
        if not any(isinstance(node, ast.Name) for each in given for node in ast.walk(each)):
            found |= _root(call.func)  # an option of a module is set: plt.style.use("...")
        elif call.args:
            found |= _root(call.args[0])
    return found


def _root(node: ast.AST) -> set[str]:
    """Return {"name"} for a chain such as ``name.part[0].method``, otherwise an empty set."""
    while isinstance(node, ast.Attribute | ast.Subscript | ast.Starred):
        node = node.value
    return {node.id} if isinstance(node, ast.Name) else set()
