"""The ledger lists where each equation of the texts is implemented, tested and taught."""

import ast
import re
import sys
import tomllib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import nbformat

from rbclassroom.course.notebooks import lesson_paths
from rbcourse.files import replace_file

KEY = re.compile(
    r"\b(?:(?:BK|RR) (?:\(\d+\)|\d+(?:\.\d+)?|(?:Prop\.|Cor\.|Remark|Fig\.) \d+)"
    r"|beyond BK \d+|errata \d+)"
    r"(?!\w|\.\d)",
    re.ASCII,
)
SOURCES = tomllib.loads(Path(__file__).with_name("sources.toml").read_text("utf-8"))
MISPRINTS = {f"errata {i}": row for i, row in enumerate(SOURCES["misprints"], start=1)}
WHAT: dict[str, str] = SOURCES["entries"] | SOURCES["beyond"]
"""The description of each entry, of the texts and beyond them."""
GROUPS: dict[str, list[str]] = {
    f"{text}: {title}": [key for key in SOURCES["entries"] if key.startswith(text)]
    for text, title in SOURCES["texts"].items()
} | {"Beyond BK: real bodies, and jerk": list(SOURCES["beyond"])}
"""The entries by their headings."""
_HEAD = """\
# Ledger

This page lists the modules and lessons for each equation, proposition, remark and figure of the two
texts, and the misprints in our copies of the texts. `python -m rbclassroom.course.ledger` writes
the page; do not edit it. The ledger of the book, which `python3 course.py book` makes, also links
functions,
tests, sections and pictures."""
_MISPRINTS = """\
## Misprints

The tests show that the printed form is wrong and the corrected form is right. (Entry 21 only looks
like a misprint.) Our copy of BK is text recognised from a scan, which loses dots, hats and the
positions of indices. The last column tells for each entry whether the misprint is the authors', a
loss of our copy, or either, and why we think so. We have not seen the publisher's pages."""
ORIGINS = {
    "authors": "the authors'",
    "copy": "our copy",
    "either": "either",
    "none": "no misprint",
}
"""Whose a misprint is: the keys of sources.toml, and the words of the ledger."""


@dataclass
class Entry:
    """The places where one entry of the texts occurs.

    Functions and constants are named within their package, such as ``so3.hat_so3``. Tests and
    lessons are named within their folder: ``test_so3.py::test_hat``, ``06_geodesics.ipynb, 3``.
    """

    functions: list[str] = field(default_factory=list)
    tests: list[str] = field(default_factory=list)
    lessons: list[str] = field(default_factory=list)

    def lacks(self) -> list[str]:
        """Return the kinds of places in which the entry does not occur."""
        return [kind for kind in ("functions", "tests", "lessons") if not getattr(self, kind)]


def collect(root: Path) -> dict[str, Entry]:
    """Return the places of each entry and each misprint.

    The keys of a function are in the paragraph "Source: …" of its docstring, and the keys of a
    constant are in the text below the constant. Tests have keys in the mark ``source``. Sections of
    lessons have keys in small type below their headings.
    """
    found = {key: Entry() for key in [*WHAT, *MISPRINTS]}
    finders = {"functions": _functions, "tests": _tests, "lessons": _headings}
    for kind, finder in finders.items():
        for place, text in finder(root):
            for key in dict.fromkeys(KEY.findall(text)):
                if key not in found:
                    raise ValueError(f"{place}: a key of sources.toml is wanted, got {key}")
                getattr(found[key], kind).append(place)
    return found


def _functions(root: Path) -> Iterator[tuple[str, str]]:
    packages = root / "rbcourse", root / "classroom/rbclassroom"
    paths = ((package, path) for package in packages for path in sorted(package.rglob("*.py")))
    for package, path in paths:
        module = ".".join(path.relative_to(package).with_suffix("").parts)
        module = module.removesuffix(".__init__")
        body = ast.parse(path.read_text(encoding="utf-8")).body
        for node, below in zip(body, [*body[1:], None], strict=True):
            if isinstance(node, ast.FunctionDef | ast.ClassDef) and node.name[0] != "_":
                yield f"{module}.{node.name}", _sources(ast.get_docstring(node) or "")
            elif isinstance(node, ast.Assign) and isinstance(below, ast.Expr):
                yield f"{module}.{ast.unparse(node.targets[0])}", ast.unparse(below)


def _sources(docstring: str) -> str:
    """Return the paragraph "Source: …" of a docstring, or else the text before the sections."""
    if source := re.search(r"^Source: (.*?)(?=\n\n|\Z)", docstring, re.MULTILINE | re.DOTALL):
        return source[1]
    return " ".join(re.split(r"\n\n\w+( \w+)?\n-+\n", docstring)[0].split())


def _tests(root: Path) -> Iterator[tuple[str, str]]:
    folders = root / "tests", root / "classroom/tests"
    paths = ((folder, path) for folder in folders for path in sorted(folder.rglob("test_*.py")))
    for folder, path in paths:
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.FunctionDef) and node.name.startswith("test_"):
                marks = [m for m in map(ast.unparse, node.decorator_list) if "mark.source(" in m]
                yield f"{path.relative_to(folder).as_posix()}::{node.name}", " ".join(marks)


def _headings(root: Path) -> Iterator[tuple[str, str]]:
    for path in lesson_paths(root / "notebooks"):
        for cell in nbformat.read(path, as_version=4).cells:
            if cell.cell_type == "markdown" and cell.source.startswith("#"):
                heading, *below = cell.source.splitlines()
                number = re.match(r"## (\d+) ·", heading)
                keys = [line for line in below[1:2] if line.startswith("<small>")]
                yield f"{path.name}, {number[1] if number else heading.lstrip('# ')}", "".join(keys)


def render(found: dict[str, Entry]) -> str:
    """Return the page docs/ledger.md with the modules and the lessons of each entry."""
    parts = [_HEAD]
    for title, keys in GROUPS.items():
        rows = []
        for key in keys:
            places = dict.fromkeys(map(_place, found[key].functions))
            modules = sorted(places, key=lambda name: name.startswith("_"))  # private names last
            lessons = dict.fromkeys(lesson[:2] for lesson in found[key].lessons)
            rows.append((key, WHAT[key], ", ".join(modules), ", ".join(lessons)))
        parts.append(f"## {title}\n\n{_table(('', 'what', 'modules', 'lessons'), rows)}")
    misprints = (
        (key.removeprefix("errata "), row["where"], row["printed"], row["holds"], whose(row))
        for key, row in MISPRINTS.items()
    )
    head = ("", "where", "as printed in our copy", "corrected", "whose")
    return "\n\n".join([*parts, _MISPRINTS, _table(head, misprints)]) + "\n"


def whose(misprint: dict[str, str]) -> str:
    """Return whether a misprint is the authors' or a loss of our copy, with the evidence."""
    return f"{ORIGINS[misprint['origin']]}: {misprint['why']}"


def _place(function: str) -> str:
    """Return the module of a function; except for `curves`, return only the folder."""
    module = function.rsplit(".", 1)[0]
    return module if module.startswith("curves.") else module.split(".")[0]


def _table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    rule = ["---" for _ in head]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in (head, rule, *rows))


def main() -> None:
    """Write docs/ledger.md; the current folder is the course."""
    try:
        replace_file("docs/ledger.md", render(collect(Path())).encode())
    except (OSError, ValueError) as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main()
