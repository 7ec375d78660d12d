"""Call a student's function, and report errors and functions that are not allowed.

Only the names in a function are examined. This helps honest students; it is not protection.
"""

import linecache
import sys
import textwrap
import traceback
from collections.abc import Iterator, Sequence
from types import CodeType, FunctionType, ModuleType
from typing import Any

LIBRARIES = {"rbcourse", "rbclassroom", "scipy", "sympy", "pytransform3d", "jax", "torch"}
LIBRARIES |= {"quaternion"}


class NotYet(AssertionError):
    """An error with a message for the student, which a notebook shows without a traceback."""

    def _render_traceback_(self) -> list[str]:
        return textwrap.wrap(str(self), 80)


def call_student(
    function: Any, arguments: tuple[Any, ...], allowed: Sequence[str], times: int = 1
) -> list[Any]:
    """Return the results of a student's function, one for each call.

    Raise `NotYet` if the function raises an error, or uses a library object that is not allowed.
    """
    for foreign in _foreign_names(function, allowed):
        how = "Write it yourself with Python, NumPy, and the functions that the problem set allows."
        raise NotYet(f"Your function uses {foreign}. {how}")
    try:
        return [function(*arguments) for _ in range(times)]
    except NotImplementedError:
        raise NotYet("Nothing is written here yet.") from None
    except Exception as error:
        lines = [
            linecache.getline(frame.f_code.co_filename, line).strip()
            for frame, line in traceback.walk_tb(error.__traceback__)
            if frame.f_globals.get("__name__") == "__main__"
        ]
        where = f' at "{lines[-1]}"' if lines and lines[-1] else ""
        raise NotYet(f"Your function stops{where}: {type(error).__name__}: {error}") from None


def _foreign_names(function: Any, allowed: Sequence[str]) -> Iterator[str]:
    """Yield the library objects in the code of a function and of the functions that it calls."""
    permitted = [("rbcourse", name) for name in allowed]
    waiting, known = [(function, list[str]())], set[tuple[Any, ...]]()
    while waiting:
        value, names = waiting.pop()
        key, found = (id(value), *names), list[Any]()
        module = getattr(value, "__module__", None) or type(value).__module__
        name = getattr(value, "__name__", type(value).__name__)
        if key in known:
            continue
        if isinstance(value, FunctionType) and module == "__main__":
            names = _names(value.__code__)
            # names that the function itself imports are not globals
            found = [value.__globals__.get(name, sys.modules.get(name)) for name in names]
        elif isinstance(value, ModuleType) and name.partition(".")[0] in LIBRARIES:
            # an attribute may belong to any module, so search all modules
            found = [getattr(value, inner) for inner in names if hasattr(value, inner)]
        elif (own := module.partition(".")[0]) in LIBRARIES and (own, name) not in permitted:
            yield f"{own}.{name}"
        known.add(key)
        waiting += [(inner, names) for inner in found]


def _names(code: CodeType) -> list[str]:
    inner = [_names(part) for part in code.co_consts if isinstance(part, CodeType)]
    return sum(inner, list(code.co_names))
