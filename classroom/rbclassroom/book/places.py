"""Where in the book the files of the course are: its addresses stay as they are."""

import re
from posixpath import dirname, join, normpath, relpath

from rbclassroom.course.ledger import KEY, MISPRINTS, WHAT

PAGES = {
    "README.md": "install.md",
    "docs/conventions.md": "conventions.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changelog.md",
    "docs/near_optimal.md": "near_optimal.md",
    "notebooks/QUESTIONS.md": "teach/questions.md",
    "notebooks/assignments/README.md": "teach/problem_sets.md",
}
"""The sources of pages that are made of one file each."""
CLASSROOM = "explorers", "figures", "surveys", "course", "assignments", "book"
"""The parts of `rbclassroom`; all other modules are in `rbcourse`."""
MOVED = {
    **{f"explore.{name}": f"explorers.{name}" for name in ("bodies", "curves", "explorer")},
    **{f"explore.{name}": f"explorers.{name}" for name in ("optima", "paths", "plane")},
    **{f"explore.{name}": f"explorers.{name}" for name in ("recorded", "rotations", "widgets")},
    **{f"study.{name}": f"surveys.{name}" for name in ("atlas", "atlas_figures", "body_atlas")},
    **{f"study.{name}": f"surveys.{name}" for name in ("progress", "survey")},
    **{name: f"optimum.{name}" for name in ("functionals", "search", "shooting")},
    "relaxation": "optimum.collocation",
    "draw.casteljau": "../code/classroom/rbclassroom/figures/lesson11",
    "draw.laws": "../code/classroom/rbclassroom/figures/lesson13",
    "draw.plots": "../code/classroom/rbclassroom/figures/lesson06",
    "draw.repairs": "../code/classroom/rbclassroom/figures/lesson04",
}
"""Modules whose pages have another address than before: the old page leads to the new one."""

_LINK = re.compile(r"`[^`\n]*`|\]\((?![a-z]+:|#)([^)#\s]+)(#[^)\s]+)?\)")


def source_of(path: str) -> str | None:
    """Return the source of the page that shows a file of the course, None if no page does.

    Examples
    --------
    >>> source_of("notebooks/06_geodesics.ipynb"), source_of("rbcourse/draw/save.py")
    ('lessons/06_geodesics.ipynb', 'package/draw.save.rst')
    >>> source_of("LICENSE")
    """
    if lesson := re.fullmatch(r"notebooks/(\d\d_\w+\.ipynb)", path):
        return f"lessons/{lesson[1]}"
    if code := re.fullmatch(r"(rbcourse|classroom/rbclassroom)/([\w/]+)\.py", path):
        module = code[2].replace("/", ".").removesuffix(".__init__")
        return f"package/{module}.rst" if has_page(module) else None
    return {"docs/ledger.md": "ledger.md", **PAGES}.get(path)


def package_of(module: str) -> str:
    """Return the package that a module is in, from its name within it.

    Examples
    --------
    >>> package_of("draw.save"), package_of("surveys.atlas")
    ('rbcourse', 'rbclassroom')
    """
    return "rbclassroom" if module.split(".")[0] in CLASSROOM else "rbcourse"


def file_of(module: str) -> str:
    """Return the file of a module, from its name within its package.

    Examples
    --------
    >>> file_of("surveys.atlas"), file_of("optimum")
    ('classroom/rbclassroom/surveys/atlas.py', 'rbcourse/optimum/__init__.py')
    """
    package = package_of(module)
    home = f"classroom/{package}" if package == "rbclassroom" else package
    path = module.replace(".", "/") + "/__init__" * (module == "optimum")
    return f"{home}/{path}.py"


def has_page(module: str) -> bool:
    """Tell whether a module has a page besides its code.

    Private modules and the figures of one lesson have none.

    Examples
    --------
    >>> has_page("draw.save"), has_page("_foam"), has_page("figures.lesson03")
    (True, False, False)
    """
    return not re.search(r"\b(_|conf$|figures\b)", module)


def anchor(key: str) -> str:
    """Return the name of a row of the ledger within its page.

    Examples
    --------
    >>> anchor("BK (16)"), anchor("BK Prop. 6"), anchor("RR 2.1"), anchor("errata 9")
    ('bk-eq-16', 'bk-prop-6', 'rr-2-1', 'misprint-9')
    """
    words = re.sub(r"\((\d+)\)", r"eq \1", key).replace("errata", "misprint")
    return re.sub(r"[^a-z0-9]+", "-", words.lower()).strip("-")


def address(source: str, fragment: str = "") -> str:
    """Return the address of a page in the book, from that of its source."""
    page = re.sub(r"\.(md|rst|ipynb)$", ".html", source)
    return f"{page}#{fragment}" if fragment else page


def link(to: str, page: str, text: str) -> str:
    """Return a link from a page to an address in the book, as HTML."""
    return f'<a href="{relpath(to, dirname(page) or ".")}">{text}</a>'


def with_keys(text: str, page: str) -> str:
    """Return a text with the keys of the two sources as links to their rows of the ledger."""

    def put(key: re.Match[str]) -> str:
        known = key[0] in WHAT or key[0] in MISPRINTS
        return link(f"ledger.html#{anchor(key[0])}", page, key[0]) if known else key[0]

    return KEY.sub(put, text)


def relinked(text: str, path: str, page: str) -> str:
    """Return Markdown of a file for a page of the book.

    Links to what has a page lead there, others to a copy of the file in the folder ``files``.
    """

    def put(match: re.Match[str]) -> str:
        if not match[1]:
            return match[0]  # code
        target = normpath(join(dirname(path), match[1]))
        source = source_of(target) or source_of(f"{target}/README.md") or f"files/{target}"
        return f"]({relpath(source, dirname(page) or '.')}{match[2] or ''})"

    return _LINK.sub(put, text)
