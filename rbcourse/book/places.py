"""Where in the book the files of the course are: its addresses stay as they are."""

import re
from posixpath import dirname, join, normpath, relpath

from rbcourse.course.ledger import KEY

PAGES = {
    "README.md": "install.md",
    "CONVENTIONS.md": "conventions.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changelog.md",
    "notebooks/QUESTIONS.md": "teach/questions.md",
    "notebooks/assignments/README.md": "teach/problem_sets.md",
}
"""The sources of pages that are made of one file each."""

_LINK = re.compile(r"\]\((?!https?:|#)([^)#\s]+)(#[^)\s]+)?\)")


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
    if module := re.fullmatch(r"rbcourse/([\w/]+)\.py", path):
        return f"package/{module[1].replace('/', '.')}.rst"
    return {"LEDGER.md": "ledger.md", **PAGES}.get(path)


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
    return KEY.sub(lambda key: link(f"ledger.html#{anchor(key[0])}", page, key[0]), text)


def relinked(text: str, path: str, page: str) -> str:
    """Return Markdown of a file for a page of the book.

    Links to what has a page lead there, others to a copy of the file in the folder ``files``.
    """

    def put(match: re.Match[str]) -> str:
        target = normpath(join(dirname(path), match[1]))
        source = source_of(target) or source_of(f"{target}/README.md") or f"files/{target}"
        return f"]({relpath(source, dirname(page) or '.')}{match[2] or ''})"

    return _LINK.sub(put, text)
