"""Collect the accepted functions of a student in ``my_motion.py``, and lend them to later sets.

The file begins with a docstring and imports. The part of a set begins with a line with the name of
the set, the date, and the accepted functions, which the table of the set marks with ``keep``. The
part contains their code, with the helpers that it needs. The check replaces it, but does not change
the text below the line `OWN`.
"""

import ast
import builtins
import contextlib
import copy
import getpass
import inspect
import io
import json
import re
import time
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rbclassroom.assignments import twins
from rbclassroom.assignments.needed_code import names_in, needed
from rbclassroom.assignments.problems import loaded, made, start_folder
from rbcourse import exp_so3

FILE = "my_motion.py"
Cells = Sequence[tuple[str, str]]  # names and code
OWN = "# %% my own functions"
_HEAD = '''"""My motions: the functions that I wrote in the problem sets on rotations.

By {by}. The check writes the parts of the sets. Write other functions below the last line.
"""
'''
_PART = r"^(?=# %% \S+ · \d{4}-\d\d-\d\d · )"
_LENT = "from rbclassroom.assignments.twins import {}  # the course's"


def mine(*names: str) -> Any:
    """Return functions of earlier sets, and print where they come from.

    They are the student's, or the course's if the student's is missing or wrong.
    """
    lent = {name: getattr(twins, name) for name in names}
    if not twins.alone:
        own, fault = _load()
        there = [name for name in names if own.get(name, lent[name]) is not lent[name]]
        right = [name for name in there if _agree(own[name], lent[name])]
        cases = {
            f"your own, from {FILE}": right,
            "the course's, because yours give other results": [
                name for name in there if name not in right
            ],
            f"the course's, because {fault or f'{FILE} does not contain them yet'}": [
                name for name in names if name not in there
            ],
        }
        print("\n".join(f"{', '.join(some)}: {case}" for case, some in cases.items() if some))
        lent |= {name: own[name] for name in right}
    return tuple(lent.values()) if len(names) > 1 else lent[names[0]]


def find(folder: Path, name: str = "") -> Path:
    """Return the path of the student's file for the folder of a set, with the name of the set.

    The file is in this folder or, usually, beside it. Some programs unpack ps1 to ps1/ps1.
    """
    place = folder
    while place.name.startswith(name or folder.name) and place.name:
        place = place.parent
    return folder / FILE if (folder / FILE).is_file() else place / FILE


def _load() -> tuple[dict[str, Any], str]:
    """Return the names that the student's file defines, or the reason why it cannot be used."""
    path, space = find(start_folder()), {"__name__": "my_motion"}
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            if path.is_file():
                exec(compile(path.read_text("utf-8-sig"), str(path), "exec"), space)
    except (Exception, SystemExit) as error:
        return {}, f"{FILE} stops: {type(error).__name__}: {error}"
    return space, ""


def _agree(function: Any, twin: Callable[..., Any]) -> bool:
    """Compare two functions for vectors of five sizes, and for rotations by these vectors."""
    rng, names = np.random.default_rng(1), inspect.signature(twin).parameters
    with warnings.catch_warnings(action="ignore"), contextlib.redirect_stdout(io.StringIO()):
        for size in (0, 1e-8, 0.5, 1, 2):
            given = [_argument(name, size, rng) for name in names]
            right = twin(*given)
            try:
                got = np.asarray(function(*copy.deepcopy(given)))
                far = np.abs(got - right).max() > 1e-9 * np.abs(right).max() + 1e-12
                if got.shape != right.shape or far or not np.isfinite(got).all():
                    return False
            except Exception:
                return False
    return True


def _argument(name: str, size: float, rng: np.random.Generator) -> Any:
    if name == "t":
        return rng.random()
    if name in "AM":
        return rng.normal(size=(3, 3))
    vector = size * rng.normal(size=3)
    return exp_so3(vector) if name[0] == "R" else vector


def kept() -> str:
    """Return, in a page, the student's file after a check and a message, as JSON."""
    given = json.loads(Path("answers.json").read_text("utf-8"))
    data = Path(f"{given['name']}.json").read_text("utf-8")
    text, by = Path(FILE).read_text("utf-8"), "(write your name here)"
    return json.dumps(keep(text, given["name"], data, given["cells"], given["passed"], by))


def keep(
    text: str, name: str, data: str, cells: Cells, passed: Sequence[str], by: str = ""
) -> tuple[str, str]:
    """Return the text of the student's file with the accepted functions of a set, and a message.

    `text` is the file before; it may be empty. `name` is the name of the set, and `data` the text
    of its ``NAME.json``. `cells` has names and code of the student's cells, in their order, and
    may have the tests without their code. `passed` has the problems whose tests have passed. The
    last definition before the test of a problem counts. The new file must pass these tests, too.
    """
    problems = {slug: each for slug, each in loaded(data).items() if isinstance(each, dict)}
    wanted = {k: each["keep"] for k, each in problems.items() if "keep" in each and k in passed}
    if not wanted:
        return text, ""
    try:
        new = _grown(text, name, problems, cells, wanted, by or _account())
    except _Unchanged as why:
        return text, f"{FILE} is not changed: {why}"
    return new, f"{FILE} has your {', '.join(wanted.values())}"


class _Unchanged(Exception):
    """The reason why the file is not changed."""


class _Statement(NamedTuple):
    node: ast.stmt
    code: str
    reads: set[str]
    binds: set[str]

    @property
    def is_import(self) -> bool:
        return isinstance(self.node, ast.Import | ast.ImportFrom)


def _grown(
    text: str, name: str, problems: dict[str, Any], cells: Cells, wanted: dict[str, str], by: str
) -> str:
    head, parts, own = _split(text.strip() or _HEAD.format(by=by) + f"\n{OWN}")
    old = parts.pop(name, "")
    accepted = old.partition("\n")[0].split(" · ")[-1].split(", ") if old else []
    if lost := [each for each in accepted if each not in wanted.values()]:
        raise _Unchanged(f"{lost[0]} passed in an earlier check of {name}, and fails now")
    kept = _needed(cells, wanted, [each.get("doc") for each in problems.values()])
    _refuse_clashes(kept, [*parts.values(), own])
    code = "\n\n".join(each.code for each in kept if not each.is_import)
    title = f"# %% {name} · {time.strftime('%Y-%m-%d')} · {', '.join(wanted.values())}"
    same = accepted == [*wanted.values()] and old.partition("\n")[2] == code
    parts[name] = old if same else f"{title}\n{code}"
    body = "\n\n".join([*(parts[key] for key in sorted(parts)), own])
    new = f"{_with_imports(head, kept, body)}\n\n{body}\n"
    _test(new, {function: problems[slug] for slug, function in wanted.items()})
    return new


def _account() -> str:
    try:
        return re.sub(r'[\\"]', " ", getpass.getuser())
    except (ImportError, KeyError, OSError):
        return "me"


def _split(text: str) -> tuple[str, dict[str, str], str]:
    """Return the head of the file, the parts of the sets, and the student's own text."""
    try:
        ast.parse(text, FILE)
    except (SyntaxError, ValueError) as error:
        raise _Unchanged(f"it is not Python: {error}") from None
    theirs, mark, own = text.partition(OWN)
    head, *parts = re.split(_PART, theirs, flags=re.MULTILINE)
    if any(not each.is_import for each in _read(head)[1:]):
        raise _Unchanged(f"move your own code below the line “{OWN}”")
    found = {part.split()[2]: part.strip() for part in parts}
    if not mark or len(found) < len(parts):
        raise _Unchanged(f"a set has two parts, or the line “{OWN}” is missing")
    return head.strip(), found, f"{mark}{own}"


def _read(text: str, given: Sequence[str | None] = ()) -> list[_Statement]:
    """Return the statements of a cell, without given docstrings; [] if it is not Python."""
    # a line for Jupyter, such as %time or name?, becomes pass
    plain = re.sub(r"^([ \t]*)(?:[%!?].*|.*\?)$", r"\1pass", text, flags=re.MULTILINE)
    for lines in (text.split("\n"), plain.split("\n")):
        with contextlib.suppress(SyntaxError, ValueError, RecursionError):
            nodes = ast.parse("\n".join(lines)).body
            return [_Statement(x, _code_of(x, lines, given), *names_in(x)) for x in nodes]
    return []


def _code_of(node: ast.stmt, lines: list[str], given: Sequence[str | None]) -> str:
    """Return the lines of a statement, with decorators and with the comment above."""
    first = min(each.lineno for each in [node, *getattr(node, "decorator_list", [])]) - 1
    while first and re.match(r"#(?! %%)", lines[first - 1]):
        first -= 1
    kept = dict(enumerate(lines[first : node.end_lineno], first + 1))
    if isinstance(node, ast.FunctionDef) and (ast.get_docstring(node) or "no text") in given:
        start, end = node.body[0].lineno, node.body[0].end_lineno or 0
        if lines[start - 1].strip().startswith('"""') and lines[end - 1].endswith('"""'):
            end += not lines[end].strip()  # an empty line below
            kept = {number: line for number, line in kept.items() if not start <= number <= end}
    return "\n".join(line for line in kept.values() if line.strip() != "# YOUR CODE HERE")


def _needed(cells: Cells, wanted: dict[str, str], given: Sequence[str | None]) -> list[_Statement]:
    """Return the statements that the wanted functions need, in the order of the cells."""
    read = [(at, each) for at, (_, text) in enumerate(cells) for each in _read(text, given)]
    course = re.compile(r"from (rbclassroom|my_motion)\b|import my_motion\b|.*= mine\(")
    read = [(at, each) for at, each in read if not course.match(ast.unparse(each.node))]
    kept = list[ast.stmt]()
    for slug, function in wanted.items():
        ends = [
            at for at, (cell, _) in enumerate(cells) if cell in (f"{slug}-answer", f"{slug}-test")
        ]
        above = [each for at, each in read if at <= max(ends, default=-1)]
        target = [each.node for each in above if function in each.binds][-1:]
        nodes = [each.node for each in above]
        kept += [*needed(nodes, target), *target]
        kept += [each.node for each in above if each.is_import and "*" in each.code]
    return [each for _, each in read if each.node in kept]


def _refuse_clashes(kept: list[_Statement], others: list[str]) -> None:
    for part in others:
        there = {name: ast.dump(each.node) for each in _read(part) for name in each.binds}
        for each in kept:
            for name in each.binds & {*there}:
                if there[name] != ast.dump(each.node):
                    where = part.partition("\n")[0].removeprefix("# %% ")
                    raise _Unchanged(f"“{where}” has another “{name}”; rename one of them")


def _with_imports(head: str, kept: list[_Statement], body: str) -> str:
    """Return the head with the imports that the file needs, also of functions of the course."""
    imports = [each for each in [*_read(head), *kept] if each.is_import]
    imports = [each for each in imports if "assignments.twins" not in each.code]
    statements = _read(body)
    read = set().union(*(each.reads for each in statements))
    used = {each.code: each for each in imports if each.binds & read or "*" in each.code}
    bound = set().union(*(each.binds for each in [*statements, *used.values()]))
    lent = sorted((read - bound) & {*twins.__all__})
    unknown = set().union(*(each.reads for each in kept)) - bound - {*lent, *dir(builtins)}
    if unknown and not any("*" in code for code in used):
        raise _Unchanged(f"{min(unknown)} is not defined in an answer or an added cell")
    text = re.split(r"^(?=from |import )", head, flags=re.MULTILINE)[0].strip()
    return "\n".join([text, *used, *map(_LENT.format, lent)])


def _test(text: str, problems: dict[str, dict[str, Any]]) -> None:
    """Run the tests of the set with the functions of the new file."""
    space: dict[str, Any] = {"__name__": "my_motion"}
    with warnings.catch_warnings(action="ignore"), contextlib.redirect_stdout(io.StringIO()):
        try:
            exec(compile(text, FILE, "exec"), space)
            for name, problem in problems.items():
                made(problem).accepts(space[name])
        except (Exception, SystemExit) as error:
            raise _Unchanged(f"with the rest of the file, your code fails: {error}") from None
