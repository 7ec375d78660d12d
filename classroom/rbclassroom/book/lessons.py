"""A stored lesson as a page of the book.

Readers can answer its polls, and open its folded code and answers. Stored outputs are kept.
"""

import base64
import copy
import hashlib
import io
import re
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

from nbformat import NotebookNode
from nbformat.v4 import new_markdown_cell
from PIL import Image

from rbclassroom.book.citations import listed, names, with_citations
from rbclassroom.book.places import relinked, with_keys
from rbclassroom.book.polls import voted
from rbclassroom.course.notebooks import lesson_paths, shown_figures
from rbclassroom.explorers import recorded
from rbclassroom.explorers.recorded import COMPUTED
from rbcourse.draw.display import ENGINE
from rbcourse.draw.save import caption

_PICTURE = re.compile(r'(<img\b[^>]*?) src="data:image/png;base64,([^"]+)"')
_PLAYER = re.compile(
    r"<script>\{\n.*?\n(for \(const image of [^\n]*revive\(image, )(\{[^\n]*\})\);\n\}</script>",
    re.DOTALL,
)
_DATA = re.compile(r'<script type="application/json">(.*?)</script>', re.DOTALL)
_SAVED = re.compile(r"save_(figure|animation)\(|\.save\(\)")
_TIME = re.compile(r"^(\| Time \| .*) \|$", re.MULTILINE)
_FILES = re.compile(r"<small>(\w+)(\.\w+(?:, \.\w+)*)</small>")
_PERCENT = re.compile(r"(?<=\d) (?=%)")
_LESSON = re.compile(r"`[^`]*`|\$[^$]*\$|\[[^\]]*\]\([^)]*\)|<[^>]*>|\b(lesson (\d+))\b")
_EXPLORER = re.compile(r"explorers\.(\w+)_explorer\(\)")


@dataclass(frozen=True)
class Figure:
    """A figure of a lesson.

    `name` is the name of its files, and `place` is the lesson and the section that draw it, such as
    ``06_geodesics.ipynb, 3``. `text` is its description.
    """

    name: str
    place: str
    text: str

    @property
    def caption(self) -> str:
        """The caption of the figure, as HTML."""
        return re.sub("</?figcaption>", "", caption(self.text))


def figures_of(lesson: str, notebook: NotebookNode) -> list[Figure]:
    """Return the figures of a lesson, in the order in which it draws them."""
    found, section = [], ""
    for cell in notebook.cells:
        if heading := re.match(r"## (?:(\d+) ·|(.*))", cell.source):
            section = heading[1] or heading[2]
        if cell.cell_type == "code" and _SAVED.search(cell.source):
            shown = shown_figures(cell)
            if not shown:
                line = cell.source.splitlines()[-1].strip()
                raise ValueError(f"{lesson}: the figure of {line!r} has no stored output")
            place = f"{lesson}, {section}"
            found += [Figure(name, place, text) for name, text in shown.items()]
    return found


def cited_in(notebook: NotebookNode) -> list[str]:
    """Return the list of works at the end of a lesson."""
    texts = [cell.source for cell in notebook.cells if cell.source.startswith("## References")]
    return [line for text in texts for line in text.splitlines() if line.startswith("- ")]


def without_outputs(notebook: NotebookNode) -> NotebookNode:
    """Return a copy of a lesson without outputs."""
    plain = copy.deepcopy(notebook)
    for cell in plain.cells:
        if cell.cell_type == "code":
            cell.outputs, cell.execution_count = [], None
    return plain


def folded(cells: list[NotebookNode]) -> list[NotebookNode]:
    """Return cells in which each answer is folded; an answer ends at the next heading."""
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
    """Return HTML with pictures in files; by default a picture is loaded when it becomes visible.

    `known` maps the contents of pictures to their addresses. Other pictures are written to the
    folder ``pictures`` inside `folder`. On phones, book.js divides pictures with
    ``data-cuts``; those with ``data-wide`` scroll.
    """

    def put(match: re.Match[str]) -> str:
        content = base64.b64decode(match[2])
        if content not in known:
            known[content] = f"pictures/{hashlib.sha256(content).hexdigest()[:16]}.png"
            (folder / "pictures").mkdir(parents=True, exist_ok=True)
            (folder / known[content]).write_bytes(content)
        with Image.open(io.BytesIO(content)) as still:
            (width, height), cuts = still.size, still.info.get("cuts", "")
        before = match[1].replace('style="', f'style="aspect-ratio: {width}/{height}; ', 1)
        if cuts or width >= 1.8 * height:
            before += f' data-cuts="{cuts}"' if cuts else " data-wide"
        return f'{before} loading="{loading}" src="{known[content]}"'

    return _PICTURE.sub(put, shown)


def with_script_files(shown: str, folder: Path, to: str = "pictures") -> str:
    """Return HTML with the states and scripts of interactive pictures in separate files.

    Files are written to the folder ``pictures`` inside `folder`, and `to` is the address of this
    folder. Pages of lessons load a script that draws the pictures. Pages of slides
    load only the data, because slides have their own script.
    """

    def kept(data: str) -> tuple[str, str]:
        name = hashlib.sha256(data.encode()).hexdigest()[:16]
        text = f'(window.rbcourseStates ??= {{}})["{name}"] = {data};\n'
        write(folder / "pictures" / f"{name}.js", text)
        return name, f'<script src="{to}/{name}.js"></script>'

    def put_player(match: re.Match[str]) -> str:
        own = f"{ENGINE}{COMPUTED}\nreturn rbcourseDisplay;"
        engine = f"window.rbcourseDisplay ??= (() => {{\n{own}\n}})();\n"
        write(folder / "pictures" / "display.js", engine)
        name, tag = kept(match[2])
        start = f'<script>{match[1]}rbcourseStates["{name}"]);</script>'
        return f'<script src="{to}/display.js"></script>{tag}{start}'

    def put_data(match: re.Match[str]) -> str:
        name, tag = kept(match[1])
        return f'{tag}<script type="application/json">"{name}"</script>'

    return _DATA.sub(put_data, _PLAYER.sub(put_player, shown))


def write(path: Path, text: str) -> None:
    """Write a text file with Unix line ends, and make its folder."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8", newline="\n")


def with_files(shown: str) -> str:
    """Link the caption of a figure to its files, and its still to the picture in full size."""

    def put(caption: re.Match[str]) -> str:
        name, endings = caption[1], caption[2].split(", ")
        texts = zip(endings, [name + endings[0], *endings[1:]], strict=True)
        linked = [f'<a href="../figures/{name}{ending}">{text}</a>' for ending, text in texts]
        return f"<small>{', '.join(linked)}</small>"

    if "<script" not in shown:
        shown = re.sub(r'(<img [^>]*src="([^"]+)"[^>]*>)', r'<a href="\2">\1</a>', shown)
    return _FILES.sub(put, shown)


def in_order(cells: list[NotebookNode]) -> list[NotebookNode]:
    """Return cells with the imports moved from the start of the lesson to its end."""
    first = next((i for i, cell in enumerate(cells) if cell.source.startswith("## ")), len(cells))
    imports = [c for c in cells[:first] if c.cell_type == "code" and not c.outputs]
    others = [cell for cell in cells if not any(cell is each for each in imports)]
    for cell in imports:
        cell.metadata.tags = [*cell.metadata.get("tags", []), "imports"]
    text = new_markdown_cell("The code of this lesson begins with these imports.")
    return [*others, text, *imports] if imports else others


def joined(cells: list[NotebookNode]) -> list[NotebookNode]:
    """Join each code cell without output to the code cell that follows it, and return all cells."""
    result: list[NotebookNode] = []
    for cell in cells:
        last = result[-1] if result else None
        if last and cell.cell_type == last.cell_type == "code" and not last.outputs:
            cell.source = f"{last.source}\n\n{cell.source}"
            result.pop()
        result.append(cell)
    return result


def hide_code(cells: list[NotebookNode]) -> None:
    """Fold the code of cells, except for code that answers an exercise."""
    inside = False
    for cell in cells:
        if cell.cell_type == "markdown" and re.match("</?details", cell.source):
            inside = 'id="answer-to-exercise' in cell.source
        elif cell.cell_type == "code" and not inside:
            cell.metadata.tags = [*cell.metadata.get("tags", []), "hide-input"]


def prepare(
    notebook: NotebookNode,
    name: str,
    root: Path,
    known: dict[bytes, str],
    folder: Path,
    sheet: str = "",
) -> None:
    """Prepare the notebook of a lesson for the book.

    The pictures become files, see `with_picture_files`. `sheet` is the address of the run sheet.
    """
    path, page = f"notebooks/{name}", f"lessons/{name}"
    lessons = {int(each.name[:2]): each.name for each in lesson_paths(root / "notebooks")}
    works = names((root / "notebooks" / "REFERENCES.bib").read_text("utf-8"))
    cells = notebook.cells
    here = {key for cell in cells for key in listed(cell.source)}

    def to_lesson(match: re.Match[str]) -> str:
        found = lessons.get(int(match[2] or -1))
        return f"[{match[1]}]({found})" if found else match[0]

    for cell in cells:
        if cell.cell_type == "markdown":
            lines = cell.source.split("\n")
            keyed = [with_keys(x, page) if x.startswith("<small>") else x for x in lines]
            text = relinked(_LESSON.sub(to_lesson, "\n".join(keyed)), path, page)
            if sheet:
                text = _TIME.sub(rf"\1 · [run sheet for lecturers](../{sheet}) |", text)
            text = _PERCENT.sub("\N{NO-BREAK SPACE}", text)
            cell.source = with_citations(text, works, here, "../references.html")
            continue
        explorer = _EXPLORER.search(cell.source)
        for shown in (
            output.data for output in cell.outputs if "text/html" in output.get("data", {})
        ):
            if explorer:
                shown["text/html"] = recorded.living(explorer[1])
            shown["text/html"] = with_files(with_picture_files(shown["text/html"], known, folder))
            shown["text/html"] = with_script_files(shown["text/html"], folder)
    voted(cells)
    notebook.cells = folded(joined(in_order(cells)))
    hide_code(notebook.cells)


def add_buttons(notebook: NotebookNode, name: str, repository: str) -> None:
    """Put the number of a lesson before its title, and buttons below the title."""
    title, _, rest = notebook.cells[0].source.partition("\n")
    slides = f"../slides/{Path(name).stem}.html"
    ways = [
        f'<a href="{slides}">Present</a>',
        f'<a download href="{name}">Download the notebook</a>',
        '<button type="button" id="all-code" aria-pressed="false">Show all code</button>',
    ]
    if repository:
        lesson = quote(f"notebooks/{name}", safe="")
        binder = f"https://mybinder.org/v2/gh/{repository}/HEAD?labpath={lesson}"
        ways.append(f'<a href="{binder}">Run it in Binder</a>')
    title = f"# {name[:2]} · {title.removeprefix('# ')}"
    notebook.cells[0].source = f'{title}\n\n<p class="buttons">{" ".join(ways)}</p>\n{rest}'
