"""The contents of the pages about the package, its tests, its figures and the ledger."""

import ast
import re
from collections import defaultdict
from collections.abc import Iterable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

from pygments import format as formatted
from pygments.formatters import HtmlFormatter
from pygments.lexers import PythonLexer
from pygments.token import Comment, Keyword, String, Token

from rbclassroom.book.lessons import Figure
from rbclassroom.book.places import CONTENTS, file_of, full_name, has_page
from rbclassroom.course.ledger import Entry


def modules(root: Path) -> dict[str, list[dict[str, Any]]]:
    """Return the modules that have a page, as a dict of lists by heading; see `module`."""
    groups = {title: names.split() for title, names in CONTENTS["modules"].items()}
    for room, title in CONTENTS["rooms"].items():
        folder = root / file_of(room).removesuffix(".py")
        paths = (path.relative_to(folder).with_suffix("") for path in sorted(folder.rglob("*.py")))
        groups[title] = [".".join([room, *path.parts]) for path in paths]
    return {
        title: [module(name, root) for name in names if has_page(name)]
        for title, names in groups.items()
    }


def module(name: str, root: Path) -> dict[str, Any]:
    """Return the names, the summary and the public members of a module, with constants last."""
    tree = ast.parse((root / file_of(name)).read_text(encoding="utf-8"))
    about = (ast.get_docstring(tree) or "").partition("\n")[0]
    # the constant ENGINE is JavaScript
    explained = {node for node, after in pairwise(tree.body) if isinstance(after, ast.Expr)}
    members = [
        (each, kind)
        for each, kind, node in _definitions(tree)
        if each[0] != "_" and (kind != "data" or (node in explained and each != "ENGINE"))
    ]
    members.sort(key=lambda member: member[1] == "data")
    return {"name": name, "full": full_name(name), "about": about, "members": members}


def _definitions(tree: ast.Module) -> Iterator[tuple[str, str, ast.stmt]]:
    """Yield the name, the kind and the statement of each definition in a module."""
    for node in tree.body:
        match node:
            case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name):
                yield name, "function", node
            case ast.ClassDef(name=name):
                yield name, "class", node
            case ast.Assign(targets=[ast.Name(id=name)]) | ast.AnnAssign(target=ast.Name(id=name)):
                yield name, "data", node


def shown_code(root: Path) -> list[str]:
    """Return the files whose code has a page; tests that contain answers have no page."""
    packages, tests = ("rbcourse", "classroom/rbclassroom"), ("tests", "classroom/tests")
    paths = [path for package in packages for path in (root / package).rglob("*.py")]
    paths += [path for folder in tests for path in (root / folder).rglob("test_*.py")]
    names = sorted(path.relative_to(root).as_posix() for path in paths)
    hidden = re.compile("classroom/tests/(assignments|book|browser|hostile)/")
    return [name for name in names if not hidden.match(name)]


def coloured(source: str) -> str:
    """Return Python code as HTML, with an anchor for each definition."""
    tokens = (
        (next((kind for kind in (Comment, Keyword, String) if found in kind), Token), text)
        for found, text in PythonLexer(stripnl=False).get_tokens(source)
    )
    lines = formatted(tokens, HtmlFormatter(nowrap=True)).split("\n")
    for name, _, node in _definitions(ast.parse(source)):
        lines[node.lineno - 1] = f'<a id="{name}"></a>{lines[node.lineno - 1]}'
    return "\n".join(lines)


def naming(root: Path) -> dict[str, list[str]]:
    """Return a dict that maps the names of functions to the tests that use them.

    Functions have names such as ``so3.exp_so3``. Tests are named as in the ledger:
    ``test_so3.py::test_exp``.
    """
    found, exported = defaultdict(list), {}
    for init in (root / "rbcourse").rglob("__init__.py"):
        room = ".".join(init.relative_to(root).parts[:-1])
        for name, target in _imported(ast.parse(init.read_text(encoding="utf-8"))).items():
            exported[f"{room}.{name}"] = target
    for file in shown_code(root):
        path = file.rpartition("tests/")[2]
        tree = ast.parse((root / file).read_text(encoding="utf-8"))
        known = _imported(tree)
        for test in tree.body:
            if isinstance(test, ast.FunctionDef) and test.name.startswith("test_"):
                nodes = (x for x in ast.walk(test) if isinstance(x, ast.Name | ast.Attribute))
                read = (ast.unparse(node).partition(".") for node in nodes)
                full = {known[top] + dot + rest for top, dot, rest in read if top in known}
                for name in {exported.get(each, each) for each in full}:
                    name = name.removeprefix("rbcourse.").removeprefix("rbclassroom.")
                    found[name].append(f"{path}::{test.name}")
    return found


def _imported(tree: ast.Module) -> dict[str, str]:
    known = {}
    for node in tree.body:
        if isinstance(node, ast.Import | ast.ImportFrom):
            module = f"{node.module}." if isinstance(node, ast.ImportFrom) else ""
            for alias in node.names:
                known[alias.asname or alias.name] = f"{module}{alias.name}"
    return known


def tests_of(name: str, named: dict[str, list[str]]) -> list[str]:
    """Return a function's tests in its module's test file or, if none are there, all its tests."""
    *room, module, _ = name.split(".")
    own = "/".join([*room, f"test_{module}"])
    found = named.get(name, [])
    return [test for test in found if test.startswith(own)] or found


def pictures_of(key: str, entry: Entry, figures: Iterable[Figure]) -> list[Figure]:
    """Return the figures of an entry of the ledger.

    For a figure of BK or RR, return the figures that reproduce it. For other entries, and for
    figures that are not reproduced, return the figures in the sections that teach the entry.
    """
    if figure := re.fullmatch(r"(BK|RR) Fig\. (\d+)", key):
        own = re.compile(rf"{ {'BK': 'paper', 'RR': 'report'}[figure[1]] }_fig{figure[2]}[a-z]?")
        if drawn := [each for each in figures if own.fullmatch(each.name)]:
            return drawn
    return [each for each in figures if each.place in entry.lessons]


def files_of(name: str, files: set[str]) -> list[str]:
    """Return links to the files of a figure, and to tables that several figures share."""
    found = {f"{name}.{ending}": ending.upper() for ending in ("png", "pdf", "csv", "gif")}
    table = re.compile(re.sub("(?<=[0-9])[a-z]$", "", name) + r"_.*\.csv")
    alone = (x for x in sorted(files) if x.endswith(".csv") and f"{x[:-4]}.png" not in files)
    found |= {x: x for x in alone if table.fullmatch(x)}
    return [f'<a href="figures/{x}">{text}</a>' for x, text in found.items() if x in files]


def folded_answers(text: str) -> str:
    """Return the page of questions with folded answers."""
    answers = re.compile(r"^#### Answers\n(.*?)(?=^#|\Z)", re.MULTILINE | re.DOTALL)
    shown = r'<details class="answer"><summary>Answers</summary>\n\n\1\n</details>\n\n'
    return answers.sub(shown, text)
