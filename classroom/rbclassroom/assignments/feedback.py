"""Pages of feedback: a notebook with a summary of its results, and HTML that cannot run anything.

A page shows a run without hidden tests: first the right answers, then those to look at again.
Formulas are MathML, which browsers show without a script.
"""

import html
import json
import re
import secrets
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import bleach
from jinja2 import pass_context
from latex2mathml.converter import convert_to_element
from nbconvert.exporters import HTMLExporter
from nbconvert.filters.markdown_mistune import IPythonRenderer, MarkdownWithMath
from nbformat import NotebookNode
from nbformat.v4 import new_output
from nbgrader import preprocessors as nbgrader

from rbclassroom.assignments.locked_cells import blame, is_test, marks_of, title_of
from rbclassroom.assignments.marking import EMPTY

UNSEEN = "The visible tests pass, but a hidden test fails.\n"
# students' HTML is shown without elements that run, load files or imitate the page
TAGS = {"a", "b", "blockquote", "br", "code", "dd", "del", "details", "div", "dl", "dt"}
TAGS |= {"em", "h1", "h2", "h3", "h4", "h5", "h6", "hr", "i", "img", "li", "ol", "p", "pre"}
TAGS |= {"s", "span", "strong", "sub", "summary", "sup", "table", "tbody", "td", "tfoot"}
TAGS |= {"th", "thead", "tr", "ul"}
_CODED = re.compile(  # a character in decimal or hexadecimal code, below 1,000 or 256
    r"&(?:#0*([0-9]{1,3})(?![0-9]);?|#x0*([0-9a-f]{1,2})(?![0-9a-f]);?|bsol;)", re.IGNORECASE
)
_LINK = re.compile(r"\\href", re.IGNORECASE)  # a command of MathJax, which the formgrader loads


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
        for cell in (nb.cells[at] for at in graded if is_test(nb.cells[at])):
            failed = marks_of(cell)["points"] and not marks_of(cell)["score"]
            if failed and not any("ename" in output for output in cell.outputs):
                cell.outputs.append(new_output("stream", name="stdout", text=UNSEEN))
        wrong = list[str]()  # functions that failed above
        rows = [_row(nb.cells, at, table, wrong) for at in graded]
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


def _row(
    cells: list[NotebookNode], at: int, table: dict[str, Any], wrong: list[str]
) -> dict[str, Any]:
    marks = marks_of(cells[at])
    slug = str(marks["grade_id"]).removesuffix("-test")
    answers = [cell for cell in cells[:at] if marks_of(cell).get("grade_id") == f"{slug}-answer"]
    said = [text for cell in answers for text in _said(cell)] or _said(cells[at])
    if is_test(cells[at]) and marks["score"] < marks["points"]:
        said += [hint for cell in answers if (hint := blame(cell.source, wrong))]
    return {
        "name": marks["grade_id"],
        "title": _title(cells, at),
        "test": is_test(cells[at]),
        "score": marks["score"],
        "points": marks["points"],
        "waits": marks["waits"],
        "said": [text[:600] for text in said],
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
            return [f"{output.ename}: {output.evalue}"]
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


def mathml(tex: str, display: str) -> str:
    """Return a formula as MathML, or as TeX if it is not understood.

    Examples
    --------
    >>> mathml("x^2", "inline")
    '<math display="inline"><mrow><msup><mi>x</mi><mn>2</mn></msup></mrow></math>'
    """
    try:
        formula = convert_to_element(tex, display=display)
    except Exception:  # the converter raises errors of many kinds
        return f"<code>{html.escape(tex)}</code>"
    for element in formula.iter():
        element.text = html.unescape(element.text or "")  # symbols are written as codes
        for name in ("class", "href", "id", "style", "xmlns"):
            element.attrib.pop(name, None)
    return ElementTree.tostring(formula, encoding="unicode")


class _Renderer(IPythonRenderer):
    """Render Markdown; links and missing pictures become text with their addresses."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self.formulas: list[str] = []
        self.place = re.compile(rf"{secrets.token_hex(8)}-([0-9]+)-")  # no student can guess it

    def link(self, text: str, url: str, title: str | None = None) -> str:
        return f"{text} ({html.escape(url)})"

    def image(self, text: str, url: str, title: str | None = None) -> str:
        text = self.place.sub("formula", text)  # a description cannot contain elements
        if url.startswith("attachment:") and url.partition(":")[2] not in self.attachments:
            return f"{text} ({html.escape(url)} is missing)"
        return str(super().image(text, url, title))

    def with_formulas(self, page: str) -> str:
        """Put the stored formulas into their places."""
        return self.place.sub(lambda found: self.formulas[int(found[1])], page)


class _PageRenderer(_Renderer):
    """Store formulas as MathML, and mark their places."""

    def inline_math(self, body: str) -> str:
        return self._stored(mathml(body, "inline"))

    def block_math(self, body: str) -> str:
        return self._stored(mathml(body, "block"))

    def _stored(self, formula: str) -> str:
        self.formulas.append(formula)
        return self.place.pattern.replace("([0-9]+)", str(len(self.formulas) - 1))


@pass_context
def inert_markdown(context: Any, source: str, kind: type[_Renderer] = _Renderer) -> str:
    """Return the HTML of Markdown without elements that run or load files."""
    attached = context.get("cell", {}).get("attachments", {})
    renderer = kind(escape=False, attachments=attached, exclude_anchor_links=True)
    return renderer.with_formulas(inert_html(MarkdownWithMath(renderer=renderer).render(source)))


@pass_context
def page_markdown(context: Any, source: str) -> str:
    """Return the same HTML with formulas as MathML; nbgrader's formgrader would remove them."""
    return inert_markdown(context, source, _PageRenderer)
