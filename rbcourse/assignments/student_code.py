"""Call a student's function: tell where it stops, and which functions it uses that it should not.

Only what a function names is looked at: that tells an honest student what is not meant.
"""

import functools
import linecache
import sys
import textwrap
import traceback
from collections.abc import Iterator, Sequence
from contextlib import suppress
from itertools import chain
from types import CodeType, FunctionType, MethodType, ModuleType
from typing import Any

TOOLS = {"__main__", "builtins", "numpy", "matplotlib", "mpl_toolkits", "IPython", "ipywidgets"}
TOOLS |= {"anywidget", "traitlets", "tqdm"}
LIBRARIES = {"rbcourse", "scipy", "sympy", "pytransform3d", "jax", "torch", "quaternion"}


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
        elif isinstance(value, ModuleType):
            yield from [] if _is_tool(value.__name__) else [value.__name__]
        else:
            named = value if isinstance(value, FunctionType | type) else type(value)
            module, name = _root(named.__module__), getattr(value, "__name__", named.__name__)
            if not _is_tool(module) and not (module == "rbcourse" and name in allowed):
                yield f"{module}.{name}"


def _referred_to(function: FunctionType) -> Iterator[Any]:
    """Yield the defaults of a function, and what its global and enclosed names stand for.

    The names of a function do not tell where they stand: of a module that is no tool all is taken
    that has one of them.
    """
    yield from function.__defaults__ or ()
    yield from (function.__kwdefaults__ or {}).values()
    with suppress(ValueError):  # an enclosed name that has no value yet
        yield from (cell.cell_contents for cell in function.__closure__ or ())
    names = _names(function.__code__)
    for name in names:
        value = function.__globals__.get(name)
        if name not in function.__globals__ and _root(name) in LIBRARIES:  # imported inside
            value = sys.modules.get(name) or ModuleType(name)
        if isinstance(value, ModuleType) and not _is_tool(value.__name__):
            used = [getattr(value, inner) for inner in names if hasattr(value, inner)]
            yield from used or [value]
        else:
            yield value


def _names(code: CodeType) -> list[str]:
    inner = [_names(part) for part in code.co_consts if isinstance(part, CodeType)]
    return [*code.co_names, *chain.from_iterable(inner)]
