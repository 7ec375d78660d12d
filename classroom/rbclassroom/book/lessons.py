"""A stored lesson as a page: outputs are kept, answers folded, the run sheet is split off."""

import base64
import copy
import hashlib
import re
import struct
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

import nbformat
from nbformat import NotebookNode
from nbformat.v4 import new_markdown_cell

from rbclassroom.book.places import relinked, with_keys
from rbclassroom.course.notebooks import lesson_paths

SHEET = "## Run sheet for the lecturer"
_PICTURE = re.compile(r'(?P<before><img\b[^>]*?) src="data:image/png;base64,(?P<content>[^"]+)"')
_SAVED = re.compile(r'save_(?:figure|animation)\(\s*fig,\s*"(\w+)"')
_APART = re.compile(r"(the lecturer's) (run sheets?) (is|are) at the end")
_FILES = re.compile(r"<small>(\w+)(\.\w+(?:, \.\w+)*)</small>")
_LESSON = re.compile(r"`[^`]*`|\$[^$]*\$|\[[^\]]*\]\([^)]*\)|<[^>]*>|\b(lesson (\d+))\b")
_CONTROL = re.compile(r'\{"label":"([^"]+)"')
_EXPLORER = re.compile(r"explorers\.(\w+)_explorer\(\)")


@dataclass(frozen=True)
class Figure:
    """A figure of a lesson.

    Attributes
    ----------
    name : str
        Of its files, without ending.
    lesson : str
        Such as ``06_geodesics``.
    section : str
        The number of the section that draws it, or its heading.
    lines : str
        The cell that draws it.
    text : str
        What it shows.
    """

    name: str
    lesson: str
    section: str
    lines: str
    text: str


def figures_of(lesson: str, notebook: NotebookNode) -> list[Figure]:
    """Return the figures that a lesson draws, in their order."""
    found, section = [], ""
    for cell in notebook.cells:
        if heading := re.match(r"## (?:(\d+) ·|(.*))", cell.source):
            section = heading[1] or heading[2]
        saved = _SAVED.search(cell.source) if cell.cell_type == "code" else None
        if saved:
            name, texts = saved[1], [o.data["text/plain"] for o in cell.outputs if "data" in o]
            shown = [t.partition(": ")[2] for t in texts if t.startswith(f"{name}: ")]
            if not shown:
                raise ValueError(f"{lesson}: {name} has no stored output")
            found.append(Figure(name, lesson, section, cell.source, shown[0]))
    return found


def cited_in(notebook: NotebookNode) -> list[str]:
    """Return the list of works at the end of a lesson."""
    texts = [cell.source for cell in notebook.cells if cell.source.startswith("## References")]
    return [line for text in texts for line in text.splitlines() if line.startswith("- ")]


def without_outputs(notebook: NotebookNode) -> NotebookNode:
    """Return a lesson as it is to be run: a file that is small."""
    plain = copy.deepcopy(notebook)
    for cell in plain.cells:
        if cell.cell_type == "code":
            cell.outputs, cell.execution_count = [], None
    return plain


def split_sheet(notebook: NotebookNode) -> tuple[list[NotebookNode], str]:
    """Return the cells for the class, and the run sheet, which has the answers."""
    for i, cell in enumerate(notebook.cells):
        if cell.source.startswith(SHEET):
            sheet = "\n\n".join(other.source for other in notebook.cells[i:])
            return notebook.cells[:i], sheet.removeprefix(SHEET).strip()
    return notebook.cells, ""


def folded(cells: list[NotebookNode]) -> list[NotebookNode]:
    """Return cells with each answer, up to the next heading, in something that opens."""
    result, inside = [], False
    for cell in cells:
        heading = cell.cell_type == "markdown" and re.match(r"#+ ([^\n]*)\n?", cell.source)
        if heading and inside:
            result.append(new_markdown_cell("</details>"))
            inside = False
        if heading and heading[1].startswith("Answer to "):
            name = re.sub(r"\W+", "-", heading[1].lower())
            opening = f'<details class="answer" id="{name}"><summary>{heading[1]}</summary>'
            result.append(new_markdown_cell(opening))
            cell, inside = new_markdown_cell(cell.source[heading.end() :]), True
        if cell.source.strip() or cell.cell_type == "code":
            result.append(cell)
    return [*result, new_markdown_cell("</details>")] if inside else result


class Pictures:
    """Takes pictures out of pages: each becomes a file, which is loaded when it comes into sight.

    Parameters
    ----------
    root : Path
        The folder of the course; what is among its figures is not written again.
    lessons : Path
        The folder of the pages; pictures are written to ``pictures`` in it.
    """

    def __init__(self, root: Path, lessons: Path) -> None:
        figures = sorted((root / "figures").glob("*.png"))
        self._known = {path.read_bytes(): f"../figures/{path.name}" for path in figures}
        self._lessons = lessons

    def taken_out(self, shown: str) -> str:
        """Return HTML with addresses of pictures, and their shapes."""
        return _PICTURE.sub(self._address, shown)

    def _address(self, match: re.Match[str]) -> str:
        content = base64.b64decode(match["content"])
        if content not in self._known:
            path = Path("pictures", f"{hashlib.sha256(content).hexdigest()[:16]}.png")
            (self._lessons / "pictures").mkdir(parents=True, exist_ok=True)
            (self._lessons / path).write_bytes(content)
            self._known[content] = path.as_posix()
        width, height = struct.unpack(">II", content[16:24])
        shape = f'style="aspect-ratio: {width}/{height}; '
        before = match["before"].replace('style="', shape, 1)
        return f'{before} loading="lazy" src="{self._known[content]}"'


def with_files(shown: str) -> str:
    """Return a figure whose caption links its files; a still leads to its picture in full size."""

    def put(caption: re.Match[str]) -> str:
        endings = caption[2].split(", ")
        files = [f"{caption[1] * (not i)}{ending}" for i, ending in enumerate(endings)]
        linked = [
            f'<a href="../figures/{caption[1]}{ending}">{text}</a>'
            for ending, text in zip(endings, files, strict=True)
        ]
        return f"<small>{', '.join(linked)}</small>"

    if "<script" not in shown:
        shown = re.sub(r'(<img [^>]*src="([^"]+)"[^>]*>)', r'<a href="\2">\1</a>', shown)
    return _FILES.sub(put, shown)


def living(name: str, root: Path) -> str:
    """Return an explorer that moves without Python, as HTML."""
    page = (root / "figures" / "explorers" / f"{name}.html").read_text(encoding="utf-8")
    return page[page.index("<figure>") : page.index("</html>")]


def prepared(path: str, page: str, root: Path, pictures: Pictures) -> tuple[NotebookNode, str]:
    """Return a lesson as the book shows it, and its run sheet."""
    notebook = nbformat.read(root / path, as_version=4)
    cells, sheet = split_sheet(notebook)
    names = {int(each.name[:2]): each.name for each in lesson_paths(root / "notebooks")}

    def to_lesson(match: re.Match[str]) -> str:
        name = names.get(int(match[2] or -1))
        return f"[{match[1]}]({name})" if name else match[0]

    for cell in cells:
        if cell.cell_type == "markdown":
            lines = cell.source.split("\n")
            keyed = [with_keys(x, page) if x.startswith("<small>") else x for x in lines]
            text = _LESSON.sub(to_lesson, "\n".join(keyed))
            text = relinked(text, path, page)
            cell.source = _APART.sub(rf"\1 [\2](../teach/{Path(path).stem}.md) \3 apart", text)
            continue
        explorer = _EXPLORER.search(cell.source)
        for output in cell.outputs:
            shown = output.get("data", {})
            if explorer and "text/html" in shown:
                figure = living(explorer[1], root)
                moved = " and ".join(f"<b>{label}</b>" for label in _CONTROL.findall(figure))
                shown["text/html"] = f"<p>Of its controls these move here: {moved}.</p>{figure}"
            if "text/html" in shown:
                shown["text/html"] = with_files(pictures.taken_out(shown["text/html"]))
    notebook.cells = folded(cells)
    return notebook, relinked(sheet, path, f"teach/{Path(path).stem}.md")


def with_buttons(notebook: NotebookNode, name: str, repository: str) -> NotebookNode:
    """Return a lesson with ways to run it below its title."""
    title, _, rest = notebook.cells[0].source.partition("\n")
    ways = [f'<a download href="{name}">Download the notebook</a>']
    if repository:
        lesson = quote(f"notebooks/{name}", safe="")
        binder = f"https://mybinder.org/v2/gh/{repository}/HEAD?labpath={lesson}"
        ways.append(f'<a href="{binder}">Run it in Binder</a>')
    title = f"# {name[:2]} · {title.removeprefix('# ')}"
    notebook.cells[0].source = f'{title}\n\n<p class="buttons">{" ".join(ways)}</p>\n{rest}'
    return notebook
