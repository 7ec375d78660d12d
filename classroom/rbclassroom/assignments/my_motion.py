"""Collect the accepted functions of a student in ``my_motion.py``, and lend them to later sets.

The file begins with a docstring and imports. The part of a set begins with a line such as
``# %% ps2``, and contains the functions that the table of the set marks with ``keep``, with the
student's own helpers. The check replaces this part. It does not change the text below `OWN`.
"""

import ast
import contextlib
import copy
import getpass
import inspect
import io
import json
import re
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, Self

import numpy as np

from rbclassroom.assignments import twins
from rbclassroom.assignments.problems import start_folder
from rbclassroom.live.cells import names_in
from rbcourse import exp_so3

FILE = "my_motion.py"
OWN = "# %% my own functions"
_HEAD = '''"""My motions: the functions that I wrote in the problem sets on rotations.

By {by}. The check writes the parts of the sets. Write other functions below the last line.
"""
'''
_LENT = "  # the course's, until yours have passed"
_only_course = False


@contextlib.contextmanager
def only_course() -> Iterator[None]:
    """Let `mine` return the course's functions, without a word."""
    global _only_course
    before, _only_course = _only_course, True
    yield
    _only_course = before


def mine(*names: str) -> Any:
    """Return functions of earlier sets, and print where they come from.

    They are the student's, or the course's if the student's is missing or wrong.
    """
    lent = {name: getattr(twins, name) for name in names}
    if not _only_course:
        own, fault = _load()
        right = [name for name in names if name in own and _agree(own[name], lent[name])]
        wrong = [name for name in names if name in own and name not in right]
        missing = fault or f"{FILE} does not contain them yet"
        cases = {
            f"your own, from {FILE}": right,
            "the course's, because yours give other results": wrong,
            f"the course's, because {missing}": [name for name in names if name not in own],
        }
        print("\n".join(f"{', '.join(some)}: {case}" for case, some in cases.items() if some))
        lent |= {name: own[name] for name in right}
    return tuple(lent.values()) if len(names) > 1 else lent[names[0]]


def find(folder: Path) -> Path:
    """Return the path of the student's file: in the folder of a set, or beside this folder."""
    own, beside = folder / FILE, folder.parent / FILE
    return beside if beside.is_file() else own


def _load() -> tuple[dict[str, Any], str]:
    """Return the names that the student's file defines, or the reason why it cannot be used."""
    path, space = find(start_folder()), {"__name__": "my_motion"}
    if not path.is_file():
        return {}, ""
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            exec(compile(path.read_text("utf-8"), str(path), "exec"), space)
    except Exception as error:
        return {}, f"{FILE} stops: {type(error).__name__}: {error}"
    return space, ""


def _agree(function: Any, twin: Callable[..., Any]) -> bool:
    """Compare two functions for five arguments; the first vectors are 0, and rotations are I."""
    rng = np.random.default_rng(1)
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        try:
            for k in range(5):
                R, M = exp_so3(k * rng.normal(size=3)), rng.normal(size=(3, 3))
                kinds: dict[str, Any] = {"R": R, "M": M, "A": M, "t": rng.random()}
                names = inspect.signature(twin).parameters
                given = [kinds.get(name[0], k * rng.normal(size=3)) for name in names]
                if not np.allclose(function(*given), twin(*given), rtol=0, atol=1e-7):
                    return False
        except Exception:
            return False
    return True


def kept() -> str:
    """Return, in a page, the student's file after a check and a message, as JSON."""
    given, text = json.loads(Path("answers.json").read_text("utf-8")), Path(FILE).read_text("utf-8")
    data = json.loads(Path(f"{given['name']}.json").read_text("utf-8"))
    by = "(write your name here)"
    return json.dumps(keep(text, given["name"], data, given["cells"], given["passed"], by))


def keep(
    text: str,
    name: str,
    data: dict[str, Any],
    cells: Sequence[str],
    passed: Sequence[str],
    by: str = "",
) -> tuple[str, str]:
    """Return the text of the student's file with the accepted functions of a set, and a message.

    Parameters
    ----------
    text : str
        The text of the file before; it may be empty.
    name : str
        The name of the set.
    data : dict
        The data of the set, from ``NAME.json``.
    cells : sequence of str
        The code of the student, without tests.
    passed : sequence of str
        The problems whose tests have passed.
    by : str, optional
        The name of the student; by default, the name of the account.
    """
    problems = {slug: each for slug, each in data.items() if isinstance(each, dict)}
    keeps = {each["keep"]: slug in passed for slug, each in problems.items() if "keep" in each}
    wanted = [function for function, right in keeps.items() if right]
    if not wanted:
        return text, ""
    try:
        head, parts, own = _split(text or _HEAD.format(by=by or getpass.getuser()))
        old = parts.pop(name, "")
        others, before = _Definitions([head, own, *parts.values()]), _Definitions([old])
    except SyntaxError as error:
        return text, f"{FILE} is not changed: its line {error.lineno} is not Python"
    if lost := [each for each in keeps if each in before.code and each not in wanted]:
        return text, f"{FILE} keeps your earlier part of {name}, since {lost[0]} fails now"
    mine = _Definitions(filter(_is_python, cells), [each.get("doc") for each in problems.values()])
    needed = [key for key in mine.needed_by(wanted) if not others.has_same(mine, key)]
    if clash := [key for key in needed if key in others.code]:
        return text, f"{FILE} is not changed: it has another {clash[0]}; rename yours in {name}"
    imports = [mine.code[key] for key in needed if mine.is_import(key)]
    code = [mine.code[key] for key in needed if not mine.is_import(key)]
    part = "\n\n".join(dict.fromkeys(code))
    day = time.strftime("%Y-%m-%d")
    parts[name] = old if old.partition("\n")[2] == part else f"# %% {name} · {day}\n{part}"
    head = "\n".join([head, *(line for line in imports if line not in head)])
    body = [*(parts[key] for key in sorted(parts)), own]
    lent = sorted(_Definitions([head, *body]).missing() & {*twins.__all__})
    if lent:
        head += f"\nfrom rbclassroom.assignments.twins import {', '.join(lent)}{_LENT}"
    return "\n\n".join([head, *body]) + "\n", f"{FILE} has your {', '.join(wanted)}"


def _split(text: str) -> tuple[str, dict[str, str], str]:
    """Return the head of the file, the parts of the sets, and the student's own text."""
    text, _, own = text.partition(OWN)
    head, *parts = re.split(r"^(?=# %% ps)", text, flags=re.MULTILINE)
    head = "\n".join(line for line in head.strip().splitlines() if not line.endswith(_LENT))
    return head, {part.split()[2]: part.strip() for part in parts}, f"{OWN}{own}".strip()


def _plain(cell: str) -> str:
    """Return the code of a cell without commands of Jupyter."""
    return re.sub(r"^[%!].*$", "", cell, flags=re.MULTILINE)


def _is_python(cell: str) -> bool:
    try:
        return bool(ast.parse(_plain(cell)))
    except SyntaxError:
        return False


class _Definitions:
    """The code that defines each name of some cells, without docstrings that are given."""

    def __init__(self, cells: Iterable[str], given: Sequence[str | None] = ()) -> None:
        self.code, self._nodes = dict[str, str](), dict[str, ast.stmt]()
        self._reads, self._given = dict[str, set[str]](), given
        for text in map(_plain, cells):
            for node in ast.parse(text).body:
                if isinstance(node, ast.Import | ast.ImportFrom):
                    self._add_import(node)
                elif not isinstance(node, ast.Expr):
                    self._add(node, self._code_of(node, text.splitlines()))

    def _add_import(self, node: ast.Import | ast.ImportFrom) -> None:
        if (getattr(node, "module", "") or "").partition(".")[0] in ("my_motion", "rbclassroom"):
            return
        for alias in node.names:  # one line for each name
            single = copy.copy(node)
            single.names = [alias]
            self._add(single, ast.unparse(single))

    def _add(self, node: ast.stmt, code: str) -> None:
        reads, binds = names_in(node)
        if "mine" not in reads:
            for name in binds:
                self.code[name], self._nodes[name], self._reads[name] = code, node, reads

    def _code_of(self, node: ast.stmt, lines: list[str]) -> str:
        """Return the lines of a statement, with decorators and with the comment above."""
        first = min(each.lineno for each in [node, *getattr(node, "decorator_list", [])]) - 1
        while first and re.match(r"#(?! %%)", lines[first - 1]):
            first -= 1
        kept = dict(enumerate(lines[first : node.end_lineno], first + 1))
        if isinstance(node, ast.FunctionDef) and ast.get_docstring(node, False) in self._given:
            for number in range(node.body[0].lineno, (node.body[0].end_lineno or 0) + 1):
                del kept[number]
        return "\n".join(line for line in kept.values() if line.strip() != "# YOUR CODE HERE")

    def is_import(self, name: str) -> bool:
        return isinstance(self._nodes[name], ast.Import | ast.ImportFrom)

    def has_same(self, others: Self, name: str) -> bool:
        pair = [some._nodes.get(name, ast.Pass()) for some in (self, others)]
        return ast.dump(pair[0]) == ast.dump(pair[1])

    def needed_by(self, names: Sequence[str]) -> list[str]:
        """Return the given names and those that their code needs, in the order of the cells."""
        needed, open_ = set[str](), [*names]
        while open_:
            if (name := open_.pop()) in self.code and name not in needed:
                needed.add(name)
                open_ += self._reads[name]
        return [name for name in self.code if name in needed]

    def missing(self) -> set[str]:
        return set().union(*self._reads.values()) - {*self.code}
