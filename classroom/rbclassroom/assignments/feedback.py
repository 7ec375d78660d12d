"""Make the feedback page of a student: first the right answers, then those to look at again.

The page shows a run without hidden tests. HTML of students cannot run anything.
"""

import html
import json
import re
from pathlib import Path
from typing import Any

import bleach
from jinja2 import pass_context
from nbconvert import HTMLExporter
from nbconvert.filters.markdown_mistune import IPythonRenderer, MarkdownWithMath
from nbformat import NotebookNode
from nbgrader import preprocessors as nbgrader

from rbclassroom.assignments.locked_cells import is_test, marks_of, title_of
from rbclassroom.assignments.notebook_runner import without_number
from rbclassroom.assignments.student_code import EMPTY

UNSEEN = "The visible tests pass, but a hidden test fails.\n"
# students' HTML is shown without elements that run, load files or imitate the page
TAGS = {"a", "b", "blockquote", "br", "code", "dd", "del", "details", "div", "dl", "dt"}
TAGS |= {"em", "h1", "h2", "h3", "h4", "h5", "h6", "hr", "i", "img", "li", "ol", "p", "pre"}
TAGS |= {"s", "span", "strong", "sub", "summary", "sup", "table", "tbody", "td", "tfoot"}
TAGS |= {"th", "thead", "tr", "ul"}
_CODED = re.compile(  # a character in decimal or hexadecimal code, below 1,000 or 256
    r"&(?:#0*([0-9]{1,3})(?![0-9]);?|#x0*([0-9a-f]{1,2})(?![0-9a-f]);?|bsol;)", re.IGNORECASE
)
_LINK = re.compile(r"\\href", re.IGNORECASE)  # a command of MathJax


class FeedbackExporter(HTMLExporter):
    """Export a notebook with a summary of its results."""


class GetResults(nbgrader.GetGrades):
    """Read points and comments from the gradebook, and mark cells that a person has to grade."""

    def _get_score(self, cell: NotebookNode, resources: Any) -> None:
        super()._get_score(cell, resources)
        grade = self._find(self.gradebook.find_grade, cell)
        cell.metadata.nbgrader.waits = grade.auto_score is None and grade.manual_score is None

    def _get_comment(self, cell: NotebookNode, resources: Any) -> None:
        comment = self._find(self.gradebook.find_comment, cell)  # without nbgrader's "No response"
        cell.metadata.nbgrader.comment = comment.manual_comment or ""

    def _find(self, find: Any, cell: NotebookNode) -> Any:
        name = marks_of(cell)["grade_id"]
        return find(name, self.notebook_id, self.assignment_id, self.student_id)


class Summarise(nbgrader.NbGraderPreprocessor):
    """Collect the results of a notebook, after its run, for the top of the page."""

    def preprocess(self, nb: NotebookNode, resources: Any) -> tuple[NotebookNode, Any]:
        """Store the summary in the resources."""
        about, course = resources["nbgrader"], self.parent.parent.coursedir
        source = course.format_path(course.source_directory, ".", about["assignment"])
        data = Path(source, f"{about['assignment']}.json")
        table = json.loads(data.read_text("utf-8")) if data.exists() else {}
        graded = [at for at, cell in enumerate(nb.cells) if marks_of(cell).get("grade")]
        rows = [_row(nb.cells, at, table) for at in graded]
        tests, words = ([row for row in rows if row["test"] == kind] for kind in (True, False))
        resources["summary"] = {
            "title": title_of(nb.cells, 0) or about["assignment"],
            "score": about["score"],
            "points": about["max_score"],
            "waiting": sum(row["points"] for row in words if row["waits"]),
            "right": [row for row in tests if row["score"] >= row["points"]],
            "again": [row for row in tests if row["score"] < row["points"]],
            "words": words,
            "remarks": list(dict.fromkeys(nb.metadata.get("remarks", []))),
        }
        return nb, resources


def _row(cells: list[NotebookNode], at: int, table: dict[str, Any]) -> dict[str, Any]:
    marks = marks_of(cells[at])
    slug = str(marks["grade_id"]).removesuffix("-test")
    answers = [cell for cell in cells[:at] if marks_of(cell).get("grade_id") == f"{slug}-answer"]
    said = [text for cell in answers for text in _said(cell)] or _said(cells[at])
    return {
        "name": marks["grade_id"],
        "title": _title(cells, at),
        "test": is_test(cells[at]),
        "score": marks["score"],
        "points": marks["points"],
        "waits": marks["waits"],
        "said": [without_links(text[:600]) for text in said],
        "read": table.get(slug, {}).get("read", ""),
        "comment": marks.get("comment") or "",
    }


def _said(cell: NotebookNode) -> list[str]:
    """Return the hint of a test with its example, or another error."""
    for output in cell.get("outputs", []):
        if output.get("text") == UNSEEN:
            return [UNSEEN.strip()]
        if output.get("ename") in ("NotYet", "Timeout"):
            return "\n".join(output.traceback).split("\n\n")
        if output.get("ename") == "NotImplementedError":
            return [EMPTY]
        if output.output_type == "error":
            return [f"{output.ename}: {without_number(output.evalue)}"]
    return []


def _title(cells: list[NotebookNode], at: int) -> str:
    """Return the heading above a cell without its points, and the letter of the part."""
    title = re.sub(r" \(\d+ points?\)$", "", title_of(cells, at))
    locked = [c for c in cells[:at] if c.cell_type == "markdown" and marks_of(c).get("locked")]
    parts = re.findall(r"^\*\*([a-z])\*\*", locked[-1].source, re.M) if locked else []
    return f"{title}, {parts[-1]}" if parts else title


def inert_html(content: object) -> str:
    """Return HTML without scripts, styles, frames, forms, links and external pictures.

    Examples
    --------
    >>> inert_html('<p onclick="steal()">x</p><img src="https://a.b/c.png"><script>1</script>')
    '<p>x</p><img>&lt;script&gt;1&lt;/script&gt;'
    """

    def is_inert(tag: str, name: str, value: str) -> bool:
        embedded = name == "src" and value.startswith("data:image/")
        return tag == "img" and (name in ("alt", "title") or embedded)

    inert = bleach.clean(str(content), TAGS, is_inert, protocols={"data"})
    return without_links(str(inert))


def without_links(text: str) -> str:
    r"""Return HTML or TeX in which MathJax finds no links, also if they are written in codes.

    Examples
    --------
    >>> without_links("&#x5C;h&#114;ef{https://a.b}{c} &#60;")
    '\\text{https://a.b}{c} &#60;'
    """

    def letter(coded: re.Match[str]) -> str:
        code = int(coded[2], 16) if coded[2] else int(coded[1] or 92)
        known = code < 128 and (chr(code).isalnum() or chr(code) == "\\")
        return chr(code) if known else coded[0]

    return _LINK.sub(r"\\text", _CODED.sub(letter, text))


class _Renderer(IPythonRenderer):
    """Render Markdown; links and missing pictures become text with their addresses."""

    def link(self, text: str, url: str, title: str | None = None) -> str:
        return f"{text} ({html.escape(url)})"

    def image(self, text: str, url: str, title: str | None = None) -> str:
        if url.startswith("attachment:") and url.partition(":")[2] not in self.attachments:
            return f"{text} ({html.escape(url)} is missing)"
        return str(super().image(text, url, title))


@pass_context
def inert_markdown(context: Any, source: str) -> str:
    """Return the HTML of Markdown without elements that run or load files."""
    attached = context.get("cell", {}).get("attachments", {})
    renderer = _Renderer(escape=False, attachments=attached, exclude_anchor_links=True)
    return inert_html(MarkdownWithMath(renderer=renderer).render(source))
