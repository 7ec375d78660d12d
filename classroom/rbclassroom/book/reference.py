"""The contents of the pages about the package, its tests, its figures and the ledger."""

import ast
import re
from collections.abc import Iterable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

from pygments import format as formatted
from pygments.formatters import HtmlFormatter
from pygments.lexers import PythonLexer
from pygments.token import Comment, Keyword, String, Token

from rbclassroom.book.lessons import Figure
from rbclassroom.book.places import CONTENTS, file_of, file_of_test, full_name, has_page
from rbclassroom.course.ledger import Entry


class Member(NamedTuple):
    """A name that the page of a module describes."""

    name: str
    kind: str
    home: str
    """The module that defines it, within its package."""
    address: str
    """The full name by which users import it."""


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
    """Return the names, the summary and the public members of a module.

    Names that `rbcourse` exports come first, and constants last. The public members are the names
    in ``__all__`` and the exported names; without ``__all__``, they are the exported names and the
    classes of their results; without exported names, all definitions.
    """
    tree = _parsed(name, root)
    about = (ast.get_docstring(tree) or "").partition("\n")[0]
    defined = _public(tree)
    homes = {each: (kind, name) for each, (kind, _) in defined.items()}
    exported = _imported(_parsed("__init__", root)).get(name, [])
    if listed := _listed(tree):
        for home, names in _imported(tree).items():
            kinds = _public(_parsed(home, root)) if listed.intersection(names) else {}
            homes |= {each: (kinds[each][0], home) for each in names if each in listed & {*kinds}}
        shown = listed | {*exported}
    elif shown := defined.keys() & exported:
        shown |= {result for each in shown for result in _results(defined[each][1])} & {*defined}
    else:
        shown = {*defined}
    members = []
    for each, (kind, home) in homes.items():
        # Sphinx finds the text of a constant only in the module that defines it
        known = each if each in exported else f"{home if kind == 'data' else name}.{each}"
        if each in shown:
            members.append(Member(each, kind, home, full_name(known)))
    members.sort(key=lambda member: (member.kind == "data", member.name not in exported))
    return {"name": name, "full": full_name(name), "about": about, "members": members}


def addresses(modules: dict[str, list[dict[str, Any]]]) -> dict[str, str]:
    """Return a dict that maps members, as the ledger names them, to their places in the book."""
    return {
        f"{each.home}.{each.name}": f"package/{module['name']}.html#{each.address}"
        for some in modules.values()
        for module in some
        for each in module["members"]
    }


def _parsed(module: str, root: Path) -> ast.Module:
    return ast.parse((root / file_of(module)).read_text(encoding="utf-8"))


def _public(tree: ast.Module) -> dict[str, tuple[str, ast.stmt]]:
    """Return the kinds and the statements of the public definitions in a module."""
    # the constant ENGINE is JavaScript
    explained = {node for node, after in pairwise(tree.body) if isinstance(after, ast.Expr)}
    return {
        each: (kind, node)
        for each, kind, node in _definitions(tree)
        if each[0] != "_" and (kind != "data" or (node in explained and each != "ENGINE"))
    }


def _imported(tree: ast.Module) -> dict[str, list[str]]:
    """Return the names that a module imports from each other module of `rbcourse`."""
    found = dict[str, list[str]]()
    for node in tree.body:
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("rbcourse."):
            home = (node.module or "").removeprefix("rbcourse.")
            found.setdefault(home, []).extend(alias.name for alias in node.names)
    return found


def _listed(tree: ast.Module) -> set[str]:
    """Return the names in ``__all__``."""
    for name, _, node in _definitions(tree):
        if name == "__all__" and isinstance(node, ast.Assign):
            return set(ast.literal_eval(node.value))
    return set()


def _results(node: ast.stmt) -> set[str]:
    """Return the annotations of the results of a function, or of the methods of a class."""
    functions = [each for each in ast.walk(node) if isinstance(each, ast.FunctionDef)]
    return {ast.unparse(each.returns) for each in functions if each.returns}


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


def shown_code(root: Path, found: dict[str, Entry]) -> list[str]:
    """Return the files whose code has a page, because the package's pages or the ledger link to it.

    `found` has the entries of the ledger.
    """
    pages = [each for some in modules(root).values() for each in some]
    names = {each["name"] for each in pages}
    names |= {member.home for each in pages for member in each["members"]}
    names |= {name.rpartition(".")[0] for entry in found.values() for name in entry.functions}
    tests = {file_of_test(test) for entry in found.values() for test in entry.tests}
    return sorted(tests.union(map(file_of, names)))


def coloured(source: str) -> str:
    """Return Python code as HTML, with an anchor for each definition."""
    tokens = (
        (next((kind for kind in (Comment, Keyword, String) if found in kind), Token), text)
        for found, text in PythonLexer(stripnl=False).get_tokens(source)
    )
    html = formatted(tokens, HtmlFormatter(nowrap=True))
    for kind, tag in {"k": "b", "s": "i", "c": "em"}.items():  # the pages are a fifth smaller
        html = re.sub(rf'<span class="{kind}">(.*?)</span>', rf"<{tag}>\1</{tag}>", html)
    lines = html.split("\n")
    for name, _, node in _definitions(ast.parse(source)):
        lines[node.lineno - 1] = f'<a id="{name}"></a>{lines[node.lineno - 1]}'
    return "\n".join(lines)


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
