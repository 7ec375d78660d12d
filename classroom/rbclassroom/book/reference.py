"""Pages about the package, its tests, its figures, and the ledger that joins them."""

import ast
import html
import re
from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path

from rbclassroom.book.lessons import Figure
from rbclassroom.book.places import (
    CLASSROOM,
    address,
    anchor,
    file_of,
    has_page,
    link,
    package_of,
    source_of,
    with_keys,
)
from rbclassroom.course.ledger import GROUPS, MISPRINTS, WHAT, Entry

HOUSE = {
    "Rotations and poses": "so3 quaternion conversions se3",
    "Projection, sampling, metrics": "projection sampling metrics connection",
    "Curves": "curves projected_line projected_cubic closed_forms bezier motions paths cost",
    "The optimum": "optimum optimum.functionals optimum.collocation optimum.search "
    "optimum.guesses optimum.chebyshev optimum.shooting excess",
    "The plane": "planar arm",
    "Textbook versions, files, the report": "textbook files report",
}
"""The modules that are flat in the package, in the order of CONTRIBUTING.md."""
ROOMS = {
    "draw": "Pictures",
    "explorers": "Explorers",
    "surveys": "The atlas",
    "course": "For maintainers: lessons run and shown",
    "assignments": "For maintainers: problem sets",
    "book": "For maintainers: this book",
}
"""The folders of both packages."""
MAINTAINED = ("course", "assignments", "book")
"""Rooms for who works on the course: left out of the contents and of the search for words."""
_ENTRIES = {"": 8, "what": 20, "functions": 30, "tests": 14, "lessons": 9, "pictures": 19}
_MISPRINTS = {"": 8, "where": 14, "as printed in our copy": 29, "what holds": 29, "tests": 20}


def modules(root: Path) -> dict[str, list[str]]:
    """Return the public modules under the headings of the house, by their dotted names."""
    groups = {title: names.split() for title, names in HOUSE.items()}
    for room, title in ROOMS.items():
        folder = root / file_of(room).removesuffix(".py")
        paths = (path.relative_to(folder).with_suffix("") for path in sorted(folder.rglob("*.py")))
        names = [".".join([room, *path.parts]) for path in paths]
        groups[title] = [name for name in names if has_page(name)]
    return groups


def module_page(name: str, root: Path) -> str:
    """Return the page of a module: what is in it, and its docstrings, which Sphinx reads."""
    source = (root / file_of(name)).read_text(encoding="utf-8")
    full = f"{package_of(name)}.{name}"
    public = [
        node.name
        for node in ast.parse(source).body
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and node.name[0] != "_"
    ]
    listed = " · ".join(f'<a href="#{full}.{each}"><code>{each}</code></a>' for each in public)
    hidden = ":orphan:\n:nosearch:\n\n" if name.split(".")[0] in MAINTAINED else ""
    return hidden + (
        f"{name}\n{'=' * len(name)}\n\n"
        f'.. raw:: html\n\n   <p class="listed">{listed}</p>\n\n'
        f".. automodule:: {full}\n   :members:\n   :member-order: bysource\n"
        "   :ignore-module-all:\n"
    )


def module_tables(groups: dict[str, list[str]], root: Path) -> str:
    """Return the modules with what each is for, and the contents of their folder."""
    lines = []
    for title, names in groups.items():
        lines += [f"## {title}", "", "| module | |", "|---|---|"]
        for name in names:
            source = (root / file_of(name)).read_text("utf-8")
            first = (ast.get_docstring(ast.parse(source)) or "").splitlines()[0]
            lines.append(f"| [{name}]({name}.rst) | {first} |")
        outer = [name for name in names if name.split(".")[0] not in MAINTAINED]
        lines += ["", "```{toctree}", ":hidden:", "", *outer, "```", ""]
    return "\n".join(lines)


def shown_code(root: Path) -> list[Path]:
    """Return the files with a page in the folder ``code``: none that answers a problem."""
    packages, tests = ("rbcourse", "classroom/rbclassroom"), ("tests", "classroom/tests")
    paths = [path for package in packages for path in (root / package).rglob("*.py")]
    paths += [path for folder in tests for path in (root / folder).rglob("test_*.py")]
    machinery = "assignments", "book", "browser", "hostile"
    hidden = [root / "classroom/tests" / name for name in machinery]
    return sorted(path for path in paths if not any(map(path.is_relative_to, hidden)))


def naming(root: Path) -> dict[str, list[str]]:
    """Return for each function, such as ``so3.exp_so3``, the tests that name it.

    They are named as in the ledger: ``test_so3.py::test_exp``.
    """
    found, folders = defaultdict(list), (root / "tests", root / "classroom/tests")
    exported = {}
    for path in (root / "rbcourse").rglob("__init__.py"):
        room = ".".join(path.relative_to(root).parts[:-1])
        for name, full in _imported(ast.parse(path.read_text(encoding="utf-8"))).items():
            exported[f"{room}.{name}"] = full
    tests = [(path, each) for path in shown_code(root) for each in folders]
    for path, folder in ((path, each) for path, each in tests if path.is_relative_to(each)):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        known = _imported(tree)
        for test in tree.body:
            if isinstance(test, ast.FunctionDef) and test.name.startswith("test_"):
                for full in {_full_name(node, known) for node in ast.walk(test)} - {""}:
                    name = re.sub(r"^rb(course|classroom)\.", "", exported.get(full, full))
                    found[name].append(f"{path.relative_to(folder).as_posix()}::{test.name}")
    return found


def _imported(tree: ast.Module) -> dict[str, str]:
    """Return the full names of what a file imports, by the names that it uses."""
    known = {}
    for node in tree.body:
        if isinstance(node, ast.Import | ast.ImportFrom):
            module = f"{node.module}." if isinstance(node, ast.ImportFrom) else ""
            for alias in node.names:
                known[alias.asname or alias.name] = f"{module}{alias.name}"
    return known


def _full_name(node: ast.AST, known: dict[str, str]) -> str:
    """Return the name of an imported object, such as ``rbcourse.so3.exp_so3``; otherwise ""."""
    if isinstance(node, ast.Name):
        return known.get(node.id, "")
    if isinstance(node, ast.Attribute):
        left = _full_name(node.value, known)
        return f"{left}.{node.attr}" if left else ""
    return ""


def tests_of(name: str, named: dict[str, list[str]]) -> list[str]:
    """Return the tests of a function: those for its module that name it, otherwise all that do."""
    *room, module, _ = name.split(".")
    own = "/".join([*room, f"test_{module}"])
    found = named.get(name, [])
    return [test for test in found if test.startswith(own)] or found


def to_test(test: str, page: str) -> str:
    """Return a link to a test."""
    path, name = test.split(".py::")
    home = "classroom/tests" if path.split("/")[0] in CLASSROOM else "tests"
    return link(f"code/{home}/{path}.html#{name}", page, name.replace("_", "_<wbr>"))


def to_function(name: str, page: str) -> str:
    """Return a link to a function: to its docstring, of what is private to its code."""
    module, _, own = name.rpartition(".")
    path = file_of(module)
    full, source = f"{package_of(module)}.{name}", source_of(path)
    to = address(source, full) if source else f"code/{path.removesuffix('.py')}.html#{own}"
    text = name.replace(".", ".<wbr>").replace("_", "_<wbr>")
    return link(to, page, f"<code>{text}</code>")


def to_section(place: str, page: str) -> str:
    """Return a link to a section of a lesson, as the ledger names it."""
    file, section = place.split(", ", 1)
    source = source_of(f"notebooks/{file}") or ""
    text = f"{file[:2]} {'§ ' * section.isdigit()}{section}"
    return link(address(source, fragment(section)), page, text)


def fragment(heading: str) -> str:
    """Return the part of an address that stands for a heading of a lesson, or for its number.

    Examples
    --------
    >>> [fragment(x) for x in ("3", "3 · Angular velocity", "Exercise 2, on paper", "Recap")]
    ['s3', 's3', 'exercise-2', 'recap']
    """
    if number := re.match(r"(\d+)(?: ·|$)", heading):
        return f"s{number[1]}"
    if numbered := re.match(r"(\w+ \d+)\b", heading):
        heading = numbered[1]
    return re.sub(r"\W+", "-", heading.lower()).strip("-")


def pictures_of(entry: Entry, key: str, figures: Iterable[Figure]) -> list[Figure]:
    """Return the figures in the sections that teach an entry; of a figure, those it is."""
    if figure := re.fullmatch(r"(BK|RR) Fig\. (\d+)", key):
        own = re.compile(rf"{ {'BK': 'paper', 'RR': 'report'}[figure[1]] }_fig{figure[2]}[a-z]?")
        if drawn := [each for each in figures if own.fullmatch(each.name)]:
            return drawn
    return [each for each in figures if f"{each.lesson}.ipynb, {each.section}" in entry.lessons]


def ledger_tables(found: dict[str, Entry], figures: list[Figure]) -> str:
    """Return the ledger, each row with an anchor."""
    page, lines = "ledger.md", []
    for title, keys in GROUPS.items():
        rows = [_row(key, found[key], pictures_of(found[key], key, figures), page) for key in keys]
        lines += [f"## {title}", "", *_table(_ENTRIES, rows)]
    misprints = [
        (
            _named(key, key.replace("errata", "misprint")),
            with_keys(row["where"], page),
            row["printed"],
            row["holds"],
            folded("tests", [to_test(name, page) for name in found[key].tests]),
        )
        for key, row in MISPRINTS.items()
    ]
    said = (
        "The tests show that the one does not hold, and the other does. (21 only looks like one.)"
    )
    return "\n".join([*lines, "## Misprints", "", said, "", *_table(_MISPRINTS, misprints)])


def _row(key: str, entry: Entry, drawn: list[Figure], page: str) -> tuple[str, ...]:
    return (
        _named(key, key),
        WHAT[key],
        _lines(to_function(name, page) for name in entry.functions),
        folded("tests", [to_test(name, page) for name in entry.tests]),
        _lines(to_section(place, page) for place in entry.lessons),
        _lines(link(f"figures.html#{figure.name}", page, figure.name) for figure in drawn),
    )


def _named(key: str, text: str) -> str:
    """Return the first cell of a row: its anchor, its text, and an entry of the index."""
    return f'<a class="row" id="{anchor(key)}" href="#{anchor(key)}">{{index}}`!{text}`</a>'


def _lines(links: Iterable[str]) -> str:
    return "<br>".join(links)


def folded(what: str, links: list[str]) -> str:
    """Return links that are shown when they are asked for; a single one as it is."""
    if len(links) < 2:
        return "".join(links)
    return f"<details><summary>{len(links)} {what}</summary>{_lines(links)}</details>"


def _table(shares: dict[str, int], rows: Iterable[tuple[str, ...]]) -> list[str]:
    widths = " ".join(map(str, shares.values()))
    lines = ["```{list-table}", ":class: ledger", ":header-rows: 1", f":widths: {widths}", ""]
    for row in (shares, *rows):
        lines += [f"{'* ' if not i else '  '}- {cell}".rstrip() for i, cell in enumerate(row)]
    return [*lines, "```", ""]


def gallery(figures: list[Figure], root: Path) -> str:
    """Return each figure with its files and the lines that draw it."""
    groups: dict[str, list[Figure]] = defaultdict(list)
    for figure in sorted(figures, key=lambda figure: figure.name):
        groups[figure.name.partition("_")[0]].append(figure)
    lines = []
    for title, start in (("The paper (BK)", "paper"), ("The report (RR)", "report")):
        lines += [f"## {title}", ""]
        lines += [line for figure in groups.pop(start) for line in _figure(figure, root)]
    lines += ["## The lessons", ""]
    lines += [line for some in groups.values() for each in some for line in _figure(each, root)]
    return "\n".join(lines)


def _figure(figure: Figure, root: Path) -> list[str]:
    page, folder = "figures.md", root / "figures"
    files = {f"{figure.name}.{ending}": ending.upper() for ending in ("png", "pdf", "csv", "gif")}
    for path in sorted(folder.glob(f"{re.sub('(?<=[0-9])[a-z]$', '', figure.name)}_*.csv")):
        if not path.with_suffix(".png").exists():  # a table that belongs to several figures
            files[path.name] = path.name
    there = [link(f"figures/{x}", page, files[x]) for x in files if (folder / x).exists()]
    place = f"{figure.lesson}.ipynb, {figure.section}"
    number = re.fullmatch(r"(paper|report)_fig(\w+)", figure.name)
    title = f"{number[1].capitalize()}, Figure {number[2]}: " if number else ""
    return [
        f'<a id="{figure.name}"></a>',
        "",
        f"### {title}{figure.name}",
        "",
        f'<img class="figure" loading="lazy" src="figures/{figure.name}.png" alt="{figure.name}">',
        "",
        f"<p>{html.escape(figure.text)}</p>",
        "",
        f"{' · '.join(there)} · lesson {to_section(place, page)}",
        "",
        "<details><summary>The lines that draw it</summary>",
        "",
        "```python",
        figure.lines,
        "```",
        "",
        "</details>",
        "",
    ]


def folded_answers(text: str) -> str:
    """Return the page of questions with the answers of each in something that opens."""
    answers = re.compile(r"^#### Answers\n(.*?)(?=^#|\Z)", re.MULTILINE | re.DOTALL)
    shown = r'<details class="answer"><summary>Answers</summary>\n\n\1\n</details>\n\n'
    return answers.sub(shown, text)


def works(cited: dict[str, list[str]]) -> str:
    """Return the works that the lessons cite, from what stands at the end of each."""
    found = defaultdict(list)
    for lesson, lines in cited.items():
        for line in lines:
            to = f"lessons/{lesson}.html#references"
            found[line].append(link(to, "references.html", lesson[:2]))
    return "\n".join(f"{line} Lesson {', '.join(found[line])}." for line in sorted(found))
