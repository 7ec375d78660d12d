"""Call a student's function: tell where it stops, and which functions it uses that it should not.

Only what a function names is looked at: that tells an honest student what is not meant.
"""

import ast
import functools
import inspect
import linecache
import sys
import textwrap
import traceback
from collections.abc import Iterator, Sequence
from types import CellType, CodeType, FunctionType, MethodType, ModuleType
from typing import Any

TOOLS = {"__main__", "builtins", "numpy", "matplotlib", "mpl_toolkits", "IPython", "ipywidgets"}
TOOLS |= {"anywidget", "traitlets", "tqdm"}


class NotYet(AssertionError):
    """What is wrong, for the student to read; a notebook shows it without a traceback."""

    def _render_traceback_(self) -> list[str]:
        return textwrap.wrap(str(self), 80)


def call_student(
    function: Any, arguments: tuple[Any, ...], allowed: Sequence[str], times: int = 1
) -> list[Any]:
    """Return what a student's function returns, each time."""
    for foreign in _foreign_names(function, allowed):
        raise NotYet(
            f"This uses {foreign}. Write it yourself: with Python, NumPy, and what the problem set "
            "allows."
        )
    try:
        return [function(*arguments) for _ in range(times)]
    except NotImplementedError:
        raise NotYet("Nothing is written here yet.") from None
    except Exception as error:
        raise NotYet(_trouble(error)) from None


def _trouble(error: Exception) -> str:
    own = [
        linecache.getline(frame.f_code.co_filename, line).strip()
        for frame, line in traceback.walk_tb(error.__traceback__)
        if frame.f_globals.get("__name__") == "__main__"
    ]
    where = f' at "{own[-1]}"' if own and own[-1] else ""
    return f"Your function stops{where}: {type(error).__name__}: {error}"


def _root(name: str | None) -> str:
    return (name or "").partition(".")[0]


def _is_tool(module: str | None) -> bool:
    return _root(module) in TOOLS or _root(module) in sys.stdlib_module_names


def _foreign_names(function: Any, allowed: Sequence[str]) -> Iterator[str]:
    """Yield what a function refers to that is neither the student's own nor a tool."""
    waiting, known = [function], set[int]()
    while waiting:
        value = waiting.pop()
        if id(value) in known:
            continue
        known.add(id(value))
        if isinstance(value, functools.partial):
            waiting += [value.func, *value.args]
        elif isinstance(value, MethodType):
            waiting += [value.__func__, value.__self__]
        elif isinstance(value, FunctionType) and value.__module__ == "__main__":
            waiting += _referred_to(value)
        else:
            is_named = isinstance(value, ModuleType | FunctionType | type)
            module = value.__name__ if isinstance(value, ModuleType) else None
            module = module or getattr(value if is_named else type(value), "__module__", "")
            name = getattr(value, "__name__", type(value).__name__)
            if not _is_tool(module) and not (_root(module) == "rbcourse" and name in allowed):
                yield str(name) if isinstance(value, ModuleType) else f"{_root(module)}.{name}"


def _referred_to(function: FunctionType) -> Iterator[Any]:
    """Yield the defaults of a function, and what its global and enclosed names stand for."""
    enclosed = dict(zip(function.__code__.co_freevars, function.__closure__ or (), strict=True))
    values = {
        **function.__globals__,
        **{n: c.cell_contents for n, c in enclosed.items() if _is_full(c)},
    }
    for name in _local_names(function.__code__):
        values.pop(name, None)
    yield from function.__defaults__ or ()
    yield from (function.__kwdefaults__ or {}).values()
    nodes, followed = list(ast.walk(_tree_of(function))), set[ast.AST]()
    for node in nodes:
        if isinstance(node, ast.Import):
            for alias in node.names:
                name = alias.asname or _root(alias.name)
                values[name] = _imported(alias.name if alias.asname else name)
        elif isinstance(node, ast.ImportFrom):
            module = _imported(node.module or "")
            for alias in node.names:
                values[alias.asname or alias.name] = getattr(module, alias.name, module)
    for node in nodes:
        if isinstance(node, ast.Name | ast.Attribute):
            value = _value_of(node, values)
            if node not in followed:
                yield value
            if isinstance(node, ast.Attribute) and (node in followed or value is not None):
                followed.add(node.value)


def _is_full(cell: CellType) -> bool:
    try:
        return cell.cell_contents is not None
    except ValueError:
        return False


def _local_names(code: CodeType) -> set[str]:
    inner = [_local_names(part) for part in code.co_consts if isinstance(part, CodeType)]
    return set[str]().union(code.co_varnames, code.co_cellvars, *inner)


def _tree_of(function: FunctionType) -> ast.AST:
    """Return the code of a function; nothing where it is not to be had."""
    try:
        return ast.parse(textwrap.dedent(inspect.getsource(function)))
    except (OSError, SyntaxError, TypeError):
        return ast.Module([], [])


def _imported(name: str) -> Any:
    return sys.modules.get(name) or ModuleType(name)


def _value_of(node: ast.AST, values: dict[str, Any]) -> Any:
    """Return what a name, or an attribute of a module, stands for; None for all else."""
    if isinstance(node, ast.Name):
        return values.get(node.id)
    if isinstance(node, ast.Attribute):
        module = _value_of(node.value, values)
        return getattr(module, node.attr, None) if isinstance(module, ModuleType) else None
    return None
