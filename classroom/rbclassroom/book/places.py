"""The addresses of the course's files in the book; published addresses must not change."""

import re
import tomllib
from pathlib import Path
from posixpath import dirname, join, normpath, relpath

from rbclassroom.course.ledger import KEY, MISPRINTS, WHAT

CONTENTS = tomllib.loads(Path(__file__).with_name("contents.toml").read_text("utf-8"))
PAGES: dict[str, str] = CONTENTS["pages"]
CLASSROOM = {path.stem for path in Path(__file__).parents[1].glob("[!_]*")}
"""The parts of `rbclassroom`; all other modules are in `rbcourse`."""

_LINK = re.compile(r"`[^`\n]*`|\]\((?![a-z]+:|#)([^)#\s]+)(#[^)\s]+)?\)")


def source_of(path: str) -> str | None:
    """Return the source of the page that shows a file of the course, or None if no page does."""
    if lesson := re.fullmatch(r"notebooks/(\d\d_\w+\.ipynb)", path):
        return f"lessons/{lesson[1]}"
    if code := re.fullmatch(r"(rbcourse|classroom/rbclassroom)/([\w/]+)\.py", path):
        module = code[2].replace("/", ".").removesuffix(".__init__")
        return f"package/{module}.rst" if has_page(module) else None
    return {"docs/ledger.md": "ledger.md", **PAGES}.get(path)


def full_name(module: str) -> str:
    """Return the full dotted name of a module or function, given its name within its package."""
    package = "rbclassroom" if module.split(".")[0] in CLASSROOM else "rbcourse"
    return f"{package}.{module}"


def file_of(module: str) -> str:
    """Return the file of a module, given its name within its package.

    Examples
    --------
    >>> file_of("atlas"), file_of("optimum")
    ('classroom/rbclassroom/atlas.py', 'rbcourse/optimum/__init__.py')
    """
    path = full_name(module).replace(".", "/") + "/__init__" * (module == "optimum")
    return f"{'classroom/' * path.startswith('rbclassroom')}{path}.py"


def file_of_test(test: str) -> str:
    """Return the file of a test, given its name in the ledger.

    Examples
    --------
    >>> file_of_test("test_so3.py::test_exp"), file_of_test("atlas/test_atlas.py::test_map")
    ('tests/test_so3.py', 'classroom/tests/atlas/test_atlas.py')
    """
    path = test.partition("::")[0]
    return f"{'classroom/' * (path.split('/')[0] in CLASSROOM)}tests/{path}"


def has_page(module: str) -> bool:
    """Tell whether a module has a page; private modules and modules for maintainers have none."""
    room, _, own = module.partition(".")
    listed = {name for names in CONTENTS["modules"].values() for name in names.split()}
    return module in listed or (room in CONTENTS["rooms"] and own != "" and own[0] != "_")


def anchor(key: str) -> str:
    """Return the anchor of the row with this key in the page of the ledger.

    Examples
    --------
    >>> anchor("BK (16)"), anchor("BK Prop. 6"), anchor("RR 2.1"), anchor("errata 9")
    ('bk-eq-16', 'bk-prop-6', 'rr-2-1', 'misprint-9')
    """
    words = re.sub(r"\((\d+)\)", r"eq \1", key).replace("errata", "misprint")
    return re.sub(r"[^a-z0-9]+", "-", words.lower()).strip("-")


def fragment(heading: str) -> str:
    """Return the anchor of a section in a lesson's page, given the section's heading or number.

    Examples
    --------
    >>> [fragment(x) for x in ("3", "3 · Angular velocity", "Exercise 2, on paper", "Recap")]
    ['s3', 's3', 'exercise-2', 'recap']
    """
    if number := re.match(r"(\d+)(?: ·|$)", heading):
        return f"s{number[1]}"
    numbered = re.match(r"\w+ \d+\b", heading)
    return re.sub(r"\W+", "-", (numbered[0] if numbered else heading).lower()).strip("-")


def link(to: str, text: str, page: str = "ledger.md") -> str:
    """Return a link from a page to an address in the book, as HTML."""
    return f'<a href="{relpath(to, dirname(page) or ".")}">{text}</a>'


def to_tests(tests: list[str]) -> str:
    """Return links to tests, given their names in the ledger; two or more links are folded."""
    links = []
    for test in tests:
        name = test.partition("::")[2]
        to = f"code/{file_of_test(test).removesuffix('.py')}.html#{name}"
        links.append(link(to, name.replace("_", "_<wbr>")))
    shown = "<br>".join(links)
    more = f"<details><summary>{len(tests)} tests</summary>{shown}</details>"
    return more if len(tests) > 1 else shown


def to_function(name: str, addresses: dict[str, str]) -> str:
    """Return a link to the docstring of a function, or to its code if no page describes it."""
    module, _, own = name.rpartition(".")
    code = f"code/{file_of(module).removesuffix('.py')}.html#{own}"
    to = addresses.get(name, code)
    text = name.replace(".", ".<wbr>").replace("_", "_<wbr>")
    return link(to, f"<code>{text}</code>")


def to_section(place: str) -> str:
    """Return a link to a section of a lesson, given its name in the ledger."""
    file, section = place.split(".ipynb, ", 1)
    text = f"{file[:2]} {'§ ' * section.isdigit()}{section}"
    return link(f"lessons/{lesson_of(place)}", text)


def lesson_of(place: str) -> str:
    """Return the address of a section in the folder ``lessons``, given its name in the ledger.

    Examples
    --------
    >>> lesson_of("06_geodesics.ipynb, 3")
    '06_geodesics.html#s3'
    """
    file, section = place.split(".ipynb, ", 1)
    return f"{file}.html#{fragment(section)}"


def with_keys(text: str, page: str = "ledger.md") -> str:
    """Return a text in which the keys of BK and RR link to their rows in the ledger."""

    def put(key: re.Match[str]) -> str:
        known = key[0] in WHAT or key[0] in MISPRINTS
        return link(f"ledger.html#{anchor(key[0])}", key[0], page) if known else key[0]

    return KEY.sub(put, text)


def relinked(text: str, path: str, page: str) -> str:
    r"""Return the Markdown of a file, with its links and formulas adapted to a page of the book.

    A link to a file that has a page leads to this page. Any other link leads to a copy of its file
    in the folder ``files``. The sign of a transpose becomes ``\top``, because the font of
    formulas has this sign.
    """
    text = re.sub(r"\\mathsf(?: T|\{T\})", r"\\top", text)

    def put(match: re.Match[str]) -> str:
        if not match[1]:
            return match[0]  # code
        target = normpath(join(dirname(path), match[1]))
        source = source_of(target) or source_of(f"{target}/README.md") or f"files/{target}"
        return f"]({relpath(source, dirname(page) or '.')}{match[2] or ''})"

    return _LINK.sub(put, text)
