"""Call a student's function: report its errors, and calls of functions that it should replace."""

import dis
import functools
import gc
import linecache
import sys
import textwrap
import traceback
from collections.abc import Iterator, Sequence
from types import CodeType, FrameType, FunctionType, MethodType, ModuleType
from typing import Any

TOOLS = {"__main__", "builtins", "numpy", "matplotlib", "mpl_toolkits", "IPython", "ipykernel"}
# what these call is their own business: printing sends messages, imports ask every finder
OF_THEIR_OWN = {"matplotlib", "mpl_toolkits", "IPython", "ipykernel", "importlib", "zipimport"}


class NotYet(AssertionError):
    """What is wrong, for the student to read; a notebook shows it without a traceback."""

    def _render_traceback_(self) -> list[str]:
        return textwrap.wrap(str(self), 80)


def call_student(
    function: Any, arguments: tuple[Any, ...], allowed: Sequence[str], times: int = 1
) -> list[Any]:
    """Return what a student's function returns, each time."""
    _refuse(_foreign_names(function, allowed))
    watch, before, collecting = _Watch(allowed), sys.getprofile(), gc.isenabled()
    gc.disable()  # what it cleans up is not the student's
    sys.setprofile(watch)
    try:
        results = [function(*arguments) for _ in range(min(times, 10))]
        sys.setprofile(before)
        if collecting:
            gc.enable()
        results += [function(*arguments) for _ in range(times - 10)]
    except NotImplementedError:
        raise NotYet("Nothing is written here yet.") from None
    except Exception as error:
        raise NotYet(_trouble(error)) from None
    finally:
        sys.setprofile(before)
        if collecting:
            gc.enable()
    _refuse(watch.seen)
    return results


def _refuse(foreign: Sequence[str]) -> None:
    if foreign:
        raise NotYet(
            f"This uses {foreign[0]}. Write it yourself: with Python, NumPy, and what the problem "
            "set allows."
        )


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


class _Watch:
    """A profile function that notes whose functions a student's code calls."""

    def __init__(self, allowed: Sequence[str]) -> None:
        self.allowed = allowed
        self.seen: list[str] = []

    def __call__(self, frame: FrameType, event: str, argument: Any) -> None:
        module, name = frame.f_globals.get("__name__"), frame.f_code.co_name
        if event != "call" or _is_tool(module) or not _is_students(frame.f_back):
            return
        if _root(module) not in sys.modules:  # as of what Python itself writes for a named tuple
            return
        if not (_root(module) == "rbcourse" and name in self.allowed):
            self.seen.append(f"{_root(module)}.{name}")


def _is_students(frame: FrameType | None) -> bool:
    """Return whether a call from here was meant: by the student's code, if by way of NumPy."""
    module = ""
    while frame and module != "__main__":
        module = frame.f_globals.get("__name__", "")
        if not _is_tool(module) or _root(module) in OF_THEIR_OWN:
            return False
        frame = frame.f_back
    return module == "__main__"


def _foreign_names(function: Any, allowed: Sequence[str]) -> list[str]:
    """Return what a function refers to that is neither the student's own nor a tool."""
    found: list[str] = []
    waiting, known = [function], set[int]()
    while waiting:
        value = waiting.pop()
        if id(value) in known:
            continue
        known.add(id(value))
        if isinstance(value, functools.partial):
            waiting += [value.func, *value.args]
        elif isinstance(value, MethodType):
            waiting.append(value.__func__)
        elif isinstance(value, FunctionType) and value.__module__ == "__main__":
            waiting += _referred_to(value)
        elif isinstance(value, ModuleType) or callable(value):
            found += _judged(value, allowed)
    return found


def _judged(value: Any, allowed: Sequence[str]) -> list[str]:
    if isinstance(value, ModuleType):
        return [] if _is_tool(value.__name__) else [value.__name__]
    module = getattr(value, "__module__", None) or type(value).__module__
    name = getattr(value, "__name__", type(value).__name__)
    if _is_tool(module) or (_root(module) == "rbcourse" and name in allowed):
        return []
    return [f"{_root(module)}.{name}"]


def _referred_to(function: FunctionType) -> Iterator[Any]:
    """Yield the values of all global names, defaults and enclosed names of a function."""
    yield from function.__defaults__ or ()
    yield from (function.__kwdefaults__ or {}).values()
    yield from (cell.cell_contents for cell in function.__closure__ or () if _is_full(cell))
    for code in _codes(function.__code__):
        steps = list(dis.get_instructions(code))
        for i, step in enumerate(steps):
            if step.opname in ("LOAD_GLOBAL", "LOAD_NAME") and step.argval in function.__globals__:
                yield _followed(function.__globals__[step.argval], steps[i + 1 :])
            elif step.opname == "IMPORT_NAME" and _root(step.argval) != "rbcourse":
                yield sys.modules.get(_root(step.argval)) or ModuleType(step.argval)


def _is_full(cell: Any) -> bool:
    try:
        return cell.cell_contents is not None
    except ValueError:
        return False


def _codes(code: CodeType) -> Iterator[CodeType]:
    yield code
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _codes(constant)


def _followed(value: Any, steps: Sequence[dis.Instruction]) -> Any:
    """Follow a name through its attributes, as in numpy.linalg.svd, while they are modules."""
    for step in steps:
        if not isinstance(value, ModuleType) or step.opname not in ("LOAD_ATTR", "LOAD_METHOD"):
            return value
        value = getattr(value, step.argval, None)
    return value
