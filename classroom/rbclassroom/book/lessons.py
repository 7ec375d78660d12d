"""A stored lesson as a page: outputs are kept, answers folded, the run sheet is split off."""

import base64
import copy
import hashlib
import re
import struct
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

from nbformat import NotebookNode
from nbformat.v4 import new_markdown_cell

from rbclassroom.book.places import relinked, with_keys
from rbclassroom.course.notebooks import lesson_paths, living, split_sheet
from rbcourse.draw.display import ENGINE

_PICTURE = re.compile(r'(<img\b[^>]*?) src="data:image/png;base64,([^"]+)"')
_PLAYER = re.compile(r"<script>\{\n.*?\n(for \(const image of [^\n]*)\n\}</script>", re.DOTALL)
_SAVED = re.compile(r'save_(?:figure|animation)\(\s*fig,\s*"(\w+)"')
_APART = re.compile(r"(the lecturer's) (run sheets?) (is|are) at the end")
_FILES = re.compile(r"<small>(\w+)(\.\w+(?:, \.\w+)*)</small>")
_LESSON = re.compile(r"`[^`]*`|\$[^$]*\$|\[[^\]]*\]\([^)]*\)|<[^>]*>|\b(lesson (\d+))\b")
_CONTROL = re.compile(r'\{"label":"([^"]+)"')
_EXPLORER = re.compile(r"explorers\.(\w+)_explorer\(\)")


@dataclass(frozen=True)
class Figure:
    """A figure of a lesson.

    Its files have its `name`. The lesson and the section that draw it are its `place`, such as
    ``06_geodesics.ipynb, 3``, with these `lines`. The `text` describes it.
    """

    name: str
    place: str
    lines: str
    text: str


def figures_of(lesson: str, notebook: NotebookNode) -> list[Figure]:
    """Return the figures that a lesson draws, in their order."""
    found, section = [], ""
    for cell in notebook.cells:
        if heading := re.match(r"## (?:(\d+) ·|(.*))", cell.source):
            section = heading[1] or heading[2]
        if cell.cell_type == "code" and (saved := _SAVED.search(cell.source)):
            name, texts = saved[1], [o.data["text/plain"] for o in cell.outputs if "data" in o]
            shown = [t.partition(": ")[2] for t in texts if t.startswith(f"{name}: ")]
            if not shown:
                raise ValueError(f"{lesson}: {name} has no stored output")
            found.append(Figure(name, f"{lesson}, {section}", cell.source, shown[0]))
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


def with_picture_files(
    shown: str, known: dict[bytes, str], folder: Path, loading: str = "lazy"
) -> str:
    """Return HTML whose pictures are files, by default loaded when they come into sight.

    Those that are not `known`, as addresses by contents, are written to ``pictures`` in a folder.
    """

    def put(match: re.Match[str]) -> str:
        content = base64.b64decode(match[2])
        if content not in known:
            known[content] = f"pictures/{hashlib.sha256(content).hexdigest()[:16]}.png"
            (folder / "pictures").mkdir(parents=True, exist_ok=True)
            (folder / known[content]).write_bytes(content)
        width, height = struct.unpack(">II", content[16:24])
        before = match[1].replace('style="', f'style="aspect-ratio: {width}/{height}; ', 1)
        return f'{before} loading="{loading}" src="{known[content]}"'

    return _PICTURE.sub(put, shown)


def with_script_files(shown: str, folder: Path, to: str = "pictures") -> str:
    """Return HTML whose living pictures have their states, and what draws them, in files.

    The files are written to ``pictures`` in a folder, whose address is `to`; each once.
    """

    def put(match: re.Match[str]) -> str:
        states = f"{hashlib.sha256(match[1].encode()).hexdigest()[:16]}.js"
        engine = (
            f"window.rbcourseDisplay ??= (() => {{\n{ENGINE}\nreturn rbcourseDisplay;\n}})();\n"
        )
        (folder / "pictures").mkdir(parents=True, exist_ok=True)
        for name, text in (("display.js", engine), (states, match[1])):
            (folder / "pictures" / name).write_text(text, encoding="utf-8", newline="\n")
        return "".join(f'<script src="{to}/{name}"></script>' for name in ("display.js", states))

    return _PLAYER.sub(put, shown)


def with_files(shown: str) -> str:
    """Return a figure whose caption links its files; a still leads to its picture in full size."""

    def put(caption: re.Match[str]) -> str:
        name, endings = caption[1], caption[2].split(", ")
        texts = zip(endings, [name + endings[0], *endings[1:]], strict=True)
        linked = [f'<a href="../figures/{name}{ending}">{text}</a>' for ending, text in texts]
        return f"<small>{', '.join(linked)}</small>"

    if "<script" not in shown:
        shown = re.sub(r'(<img [^>]*src="([^"]+)"[^>]*>)', r'<a href="\2">\1</a>', shown)
    return _FILES.sub(put, shown)


def prepared(
    notebook: NotebookNode, name: str, root: Path, known: dict[bytes, str], folder: Path
) -> str:
    """Prepare the notebook of a lesson for the book, and return its run sheet.

    Its pictures become files, see `with_picture_files`.
    """
    path, page, sheet_page = f"notebooks/{name}", f"lessons/{name}", f"teach/{Path(name).stem}.md"
    names = {int(each.name[:2]): each.name for each in lesson_paths(root / "notebooks")}

    def to_lesson(match: re.Match[str]) -> str:
        found = names.get(int(match[2] or -1))
        return f"[{match[1]}]({found})" if found else match[0]

    cells, sheet = split_sheet(notebook)
    for cell in cells:
        if cell.cell_type == "markdown":
            lines = cell.source.split("\n")
            keyed = [with_keys(x, page) if x.startswith("<small>") else x for x in lines]
            text = relinked(_LESSON.sub(to_lesson, "\n".join(keyed)), path, page)
            cell.source = _APART.sub(rf"\1 [\2](../{sheet_page}) \3 apart", text)
            continue
        explorer = _EXPLORER.search(cell.source)
        for shown in (
            output.data for output in cell.outputs if "text/html" in output.get("data", {})
        ):
            if explorer:
                figure = living(explorer[1], root)
                moved = " and ".join(f"<b>{label}</b>" for label in _CONTROL.findall(figure))
                shown["text/html"] = f"<p>Of its controls these move here: {moved}.</p>{figure}"
            shown["text/html"] = with_files(with_picture_files(shown["text/html"], known, folder))
            shown["text/html"] = with_script_files(shown["text/html"], folder)
    notebook.cells = folded(cells)
    return relinked(sheet, path, sheet_page)


def add_buttons(notebook: NotebookNode, name: str, repository: str) -> None:
    """Put the number of a lesson before its title, and ways to run it below."""
    title, _, rest = notebook.cells[0].source.partition("\n")
    slides = f"../slides/{Path(name).stem}.html"
    ways = [
        f'<a href="{slides}">Present</a>',
        f'<a download href="{name}">Download the notebook</a>',
    ]
    if repository:
        lesson = quote(f"notebooks/{name}", safe="")
        binder = f"https://mybinder.org/v2/gh/{repository}/HEAD?labpath={lesson}"
        ways.append(f'<a href="{binder}">Run it in Binder</a>')
    title = f"# {name[:2]} · {title.removeprefix('# ')}"
    notebook.cells[0].source = f'{title}\n\n<p class="buttons">{" ".join(ways)}</p>\n{rest}'
