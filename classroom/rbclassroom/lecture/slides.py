"""A stored lesson as slides: ``notebooks/slides/06.md`` has the texts that the class sees.

A cell without such a text makes no slide; its own text goes to the notes of the previous slide.
The same file has the run sheet of the lecturer.
docs/authoring.md has the rules for authors.
"""

import base64
import io
import re
import xml.etree.ElementTree as ET
from collections.abc import Collection
from dataclasses import dataclass, field, replace
from pathlib import Path

import nbformat
from nbformat import NotebookNode
from PIL import Image

from rbclassroom.course.notebooks import shown_figures
from rbclassroom.explorers import recorded

BEHIND = ("Exercises", "References")
"""Sections whose slides come after the last slide; the key E leads to them."""
SHEET = "run sheet"
"""The name of the run sheet in a file of slides."""
WORKS = 4
"""The largest number of works on one slide."""
SHORT = 300
"""An exercise stands below other ones if these have fewer characters than this."""
_ITEM = re.compile(r"^(- )?\*\*([A-Z])\*\* (?:· )?(.*)$\n?", re.M)
_PICTURE = re.compile(r"!\[\]\((?:(\w+)/)?([\w-]+)\)")
_SVG = "http://www.w3.org/2000/svg"
ET.register_namespace("", _SVG)
_LIVING = re.compile(r"rbcourseDisplay\.revive\(image, (\{.*\})\);\s*\}</script>", re.S)


@dataclass
class Slide:
    """The content of a slide, and the notes for the lecturer.

    The `parts` are Markdown texts; each part after the first one appears at a key press. The
    `picture` is HTML, and `aspect` is the ratio of its width to its height. The slide of a poll has
    `options`. The slide of the verdict also has the `ideas` behind the options, and the `right`
    letter.
    """

    title: str
    kind: str = "plain"
    parts: list[str] = field(default_factory=list)
    picture: str = ""
    aspect: float = 1
    notes: list[str] = field(default_factory=list)
    poll: str = ""
    options: dict[str, str] = field(default_factory=dict)
    ideas: dict[str, str] = field(default_factory=dict)
    right: str = ""
    seconds: float = 0


@dataclass
class Deck:
    """The slides of a lesson up to its end, those behind it, and its run sheet in Markdown."""

    number: int
    shown: list[Slide]
    behind: list[Slide]
    sheet: str


class _Reader:
    def __init__(self, path: Path, names: Collection[str]) -> None:
        self.root = path.resolve().parents[1]
        self.sketches = path.parent / "slides" / f"{path.name[:2]}.svg"
        self.texts = texts_of(self.sketches.with_suffix(".md"), names)
        self.sheet = self.texts.pop(SHEET, "")
        for name, text in self.texts.items():
            check_formulas(f"slides/{path.name[:2]}.md, {name}", text)
        self.section = ""
        self.shown, self.behind = list[Slide](), list[Slide]()
        self.ahead = list[str]()  # notes for the next slide
        self.names = dict[str, int]()  # positions of slides by their names in the run sheet

    def put(self, slide: Slide) -> None:
        """Add a slide to the current section."""
        slide.notes, self.ahead = [*self.ahead, *slide.notes], []
        (self.behind if self.section in BEHIND else self.shown).append(slide)

    def put_text(self, wish: str, kind: str = "plain") -> None:
        """Add the slides of a text."""
        for text in map(str.strip, re.split(r"^---$", wish, flags=re.M)):
            if _ITEM.match(text):
                self.put_verdict(text)
                continue
            parts = re.split(r"^\. \. \.$", _PICTURE.sub("", text), flags=re.M)
            slide = Slide(self.section, kind, [part.strip() for part in parts])
            if name := _PICTURE.search(text):
                slide.picture, slide.aspect = self.borrowed(*name.groups(default=""))
            self.put(slide)

    def put_verdict(self, text: str) -> None:
        """Add the verdict of the last poll: the right option is not an item of the list."""
        poll = next(slide for slide in reversed(self.shown) if slide.kind == "poll")
        found = _ITEM.findall(text)
        if sorted(letter for _, letter, _ in found) != sorted(poll.options):
            listed, got = ", ".join(poll.options), ", ".join(letter for _, letter, _ in found)
            raise ValueError(f"slides: {poll.poll} has the options {listed}; its answer has {got}")
        right = [letter for item, letter, _ in found if not item]
        if len(right) != 1:
            raise ValueError(
                f"slides: {poll.poll} has one right option, the one without '-' before it; its "
                f"answer has {', '.join(right) or 'none'}"
            )
        poll.ideas, poll.right = {letter: idea for _, letter, idea in found}, right[0]
        self.put(replace(poll, kind="verdict", notes=[]))
        poll.notes += [f"Right: **{poll.right}**.", text]

    def borrowed(self, folder: str, name: str) -> tuple[str, float]:
        """Return the sketch ``name``, or the picture of the cell ``lesson/name``."""
        if not folder:
            return sketch_of(self.sketches, name)
        path = self.root / "notebooks" / f"{folder}.ipynb"
        for cell in nbformat.read(path, as_version=4).cells:
            if cell.id == name:
                return picture_of(cell)
        raise ValueError(f"slide: there is no cell {folder}/{name}")

    def read(self, cell: NotebookNode) -> None:
        """Add the slides of a cell, and its notes."""
        wish = self.texts.get(cell.id, "")
        self.names[cell.id.replace("-", " ")] = len(self.shown)
        if cell.cell_type == "markdown":
            self.read_text(cell.source, wish)
        elif wish:
            for figure in shown_figures(cell):
                name = figure.partition("_")[2].replace("fig", "figure ")
                self.names[name] = len(self.shown)
            self.put_text(wish)
            last = self.shown[-1]
            if not last.picture:  # a sketch can replace the figure
                last.picture, last.aspect = picture_of(cell)
            if "_explorer()" in cell.source:
                note = "M plays the picture. R shows its numbers, which stay on after the verdict."
                last.notes.append(note)

    def read_text(self, source: str, wish: str) -> None:
        heading = re.match(r"(#+) (.*)\n*", source)
        level, words = heading.groups() if heading else ("", "")
        text = source[heading.end() :] if heading else source
        if heading:
            self.section = words if len(level) < 3 else self.section
            name = "question" if level == "#" else words.lower().partition(" · ")[0]
            self.names[name] = len(self.shown)
        if self.section in BEHIND:
            self.put_behind(words, text, wish)
        elif words.startswith("Poll"):
            options = {letter: option for _, letter, option in _ITEM.findall(text)}
            question = wish or _ITEM.sub("", text).strip()
            self.put(Slide(self.section, "poll", [question], poll=words, options=options))
        else:
            # a note belongs to the next slide if it stands before a picture, or after such a note
            leads = wish or heading or self.ahead or "*Look for" in text
            notes = self.ahead if leads else self.shown[-1].notes
            notes += [text.strip()] if text.strip() else []
            if wish or level == "#":
                self.put_text(wish, "title" if level == "#" else "plain")

    def put_behind(self, words: str, text: str, wish: str) -> None:
        """Add slides after the end; a long list of works is split over several slides."""
        if words.startswith("Exercise "):
            text = wish or re.sub(r"<details>.*?</details>", "", text, flags=re.S)
            text = f"**{words}.** {text.strip()}"
            if self.behind and len(self.behind[-1].parts[0]) < SHORT:
                self.behind[-1].parts[0] += f"\n\n{text}"
            else:
                self.put(Slide(self.section, "plain", [text]))
        elif words == "References":
            _, *works = re.split(r"^(?=- )", text, flags=re.M)
            for i in range(0, len(works), WORKS):
                self.put(Slide(words, "plain", ["".join(works[i : i + WORKS])]))


def sketch_of(path: Path, name: str) -> tuple[str, float]:
    """Return a sketch of a file as SVG, and its width over the height of a panel."""
    try:
        sketch = ET.parse(path).find(f"{{{_SVG}}}svg[@id='{name}'][@viewBox]")
    except ET.ParseError as error:
        raise ValueError(f"slides/{path.name}: {error}") from error
    if sketch is None:
        raise ValueError(f"slides/{path.name} has no sketch {name} with a viewBox")
    sketch.tail = None
    for key in ("x", "y", "width", "height"):  # its place on the page of all sketches
        sketch.attrib.pop(key, None)
    for element in sketch.iter():
        element.attrib.pop("id", None)  # a slide can show a sketch again
    width = float(sketch.attrib["viewBox"].split()[2])
    return ET.tostring(sketch, encoding="unicode"), width / 720  # the height can vary


def picture_of(cell: NotebookNode) -> tuple[str, float]:
    """Return the picture of a code cell, interactive if possible, and its width over its height."""
    page = "".join(o.get("data", {}).get("text/html", "") for o in cell.get("outputs", []))
    if explorer := re.search(r"explorers\.(\w+)_explorer\(\)", cell.source):
        page = recorded.living(explorer[1])  # moves without Python
    image = re.search(r'<img [^>]*?alt="([^"]*)"[^>]*?src="(data:image/png;base64,([^"]+))"', page)
    if not image:
        raise ValueError(f"slide: {cell.id} has no picture; 'course.py figures' stores it")
    data = _LIVING.search(page)
    with Image.open(io.BytesIO(base64.b64decode(image[3]))) as still:
        crop = [0.0] * 4 if data and '"controls":[]' not in data[1] else margins(still)
        left, top, right, bottom = crop
        aspect = still.width * (1 - left - right) / (still.height * (1 - top - bottom))
    shares = " ".join(f"{share:.3f}" for share in crop)
    html = f'<img data-crop="{shares}" alt="{image[1]}" src="{image[2]}">'
    html += f'<script type="application/json">{data[1]}</script>' if data else ""
    return html, aspect


def margins(still: Image.Image) -> list[float]:
    """Return the white margins (left, top, right, bottom) of a still as fractions of its size."""
    dark = still.convert("L").point([255 * (grey < 245) for grey in range(256)])
    width, height = still.size
    left, top, right, bottom = dark.getbbox() or (0, 0, width, height)
    sides = left / width, top / height, 1 - right / width, 1 - bottom / height
    return [max(0.0, side - 0.01) for side in sides]


def plan(slides: list[Slide], names: dict[str, int], sheet: str) -> str:
    """Give each slide its row of the run sheet and its share of the time.

    A row begins at the slide that the first name in its part names. Homework belongs to the last
    slide of a lecture. The question of a row is asked at its slides after a vote. Return the run
    sheet with the number of the first slide in each row.
    """
    stop, later = len(slides), 0
    rows = re.finditer(r"^\| (\d+) \|([^|]*)\|([^|]*)\|([^|]*)\|", sheet, re.M)
    for row in reversed([*rows]):
        minute, (part, ask, skip) = int(row[1]), map(str.strip, row.groups()[1:])
        name = part.partition(",")[0].lower()
        start = stop - 1 if name == "homework" else names.get(name, stop + 1)
        if start > stop:
            where = "no slide, or one after that of the next row"
            raise ValueError(f"run sheet, minute {minute}: {part!r} names {where}")
        end = later if later > minute else minute + 1
        span = slides[start : max(stop, start + 1)]
        votes = [k + 1 for k, slide in enumerate(span[:-1]) if slide.kind == "poll"]
        for k, slide in enumerate(span):
            slide.seconds = 60 * (end - minute) / len(span)
            asked = [f"**Ask:** {ask}"] if ask and k >= max(votes, default=0) else []
            late = f" · if late, skip {skip}" if skip else ""
            slide.notes[:0] = [f"*Minute {minute}–{end}* · {part}{late}", *asked]
        sheet = f"{sheet[: row.end(1)]} | {start + 1}{sheet[row.end(1) :]}"
        stop, later = start, minute
    return sheet.replace("| minute |", "| minute | slide |").replace("\n|---", "\n|---|---")


def texts_of(path: Path, names: Collection[str]) -> dict[str, str]:
    """Return the texts in a file by the cells that they belong to; `names` are those of the lesson.

    A line such as ``## cell-04`` begins the text of a cell, and ``## run sheet`` the run sheet.
    """
    texts, name = dict[str, str](), ""
    for number, line in enumerate(path.read_text(encoding="utf-8-sig").split("\n"), 1):
        where = f"slides/{path.name}, line {number}"
        if line.startswith("## "):
            name = line[3:].strip()
            if name != SHEET and name not in names:
                raise ValueError(f"{where}: the lesson has no cell {name!r}")
            if name in texts:
                raise ValueError(f"{where}: cell {name} has a text above")
            texts[name] = ""
        elif name:
            texts[name] += f"{line}\n"
        elif line.strip():
            raise ValueError(f"{where}: a line such as '## cell-04' is wanted before the text")
    return {name: text.strip() for name, text in texts.items()}


def check_formulas(where: str, text: str) -> None:
    """Refuse formulas whose braces or dollar signs do not match; a slide would show their TeX."""
    text = re.sub(r"\\[{}$\\]", "", text)
    for formula in re.findall(r"\$\$.+?\$\$|\$.+?\$", text, re.S):
        if formula.count("{") != formula.count("}"):
            raise ValueError(f"{where}: the braces of {formula:.60} do not match")
    if text.count("$") % 2:
        raise ValueError(f"{where}: a formula has only one $")


def deck_of(path: Path) -> Deck:
    """Return the slides of a lesson in the folder ``notebooks`` of a course."""
    try:
        cells = nbformat.read(path, as_version=4).cells
        if not cells or not cells[0].source.startswith("# "):
            raise ValueError("it does not begin with a title, such as # The plane")
        reader = _Reader(path, {cell.id for cell in cells})
        for cell in cells:
            reader.read(cell)
        title = reader.shown[0]
        note = "E leads to exercises and references, after this slide."
        if reader.shown[-1].title != "Recap":
            reader.put(Slide("Questions?", "plain", title.parts))
        end = reader.shown[-1]
        end.kind, end.picture, end.notes = "end", title.picture, [*end.notes, note]
        planned = plan(reader.shown, reader.names, reader.sheet)
        title.notes[:0] = reader.sheet.splitlines()[:1]  # what to do before class
        return Deck(int(path.name[:2]), reader.shown, reader.behind, planned)
    except (ValueError, OSError) as error:
        raise ValueError(f"{path.name}: {error}") from error
