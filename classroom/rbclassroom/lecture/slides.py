"""A stored lesson as slides: the metadata `slide` of a cell is the text that the class sees.

A cell without this metadata makes no slide; its text goes to the notes of the previous slide.
CONTRIBUTING.md has the rules for authors.
"""

import base64
import io
import re
from dataclasses import dataclass, field, replace
from pathlib import Path

import nbformat
from nbformat import NotebookNode
from PIL import Image

from rbclassroom.course.notebooks import living, split_sheet

BEHIND = ("Exercises", "Misprints", "References")
"""Sections whose slides come after the last slide; the key E leads to them."""
SKETCHES = Path(__file__).with_name("sketches")
ROWS = 4
"""The largest number of table rows, or of works, on one slide."""
TOGETHER = 85
"""The largest number of words in two exercises that share a slide."""
_ITEM = re.compile(r"^- ((?:\*\*[A-Z]\*\*(?:, | and )?)+)(?: · |[,:.]? ?)(.*(?:\n .*)*)", re.M)
_PICTURE = re.compile(r"!\[\]\(([^)]+)\)\n*")
_LIVING = re.compile(r"rbcourseDisplay\.revive\(image, (\{.*\})\);\s*\}</script>", re.S)


@dataclass
class Picture:
    """A picture of a code cell, or a sketch: its HTML, and the ratio of its width to its height."""

    html: str
    aspect: float


@dataclass
class Slide:
    """The content of a slide, and the notes for the lecturer.

    The `parts` are Markdown texts; each part after the first one appears at a key press. In the run
    sheet, one of the `keys` names the slide. The slide of a poll has `options`. The slide of the
    verdict also has the `ideas` behind the options, and the `right` letter.
    """

    title: str
    kind: str = "plain"
    parts: list[str] = field(default_factory=list)
    picture: Picture | None = None
    keys: set[str] = field(default_factory=set)
    notes: list[str] = field(default_factory=list)
    poll: str = ""
    options: dict[str, str] = field(default_factory=dict)
    ideas: dict[str, str] = field(default_factory=dict)
    right: str = ""
    seconds: float = 0

    @property
    def words(self) -> int:
        """The number of words of the slide's text; a formula in a sentence counts as one word."""
        return words_of("\n\n".join(self.parts))


def words_of(text: str) -> int:
    """Return the number of words of a slide text without its heading."""
    text = re.sub(r"^###.*|\$\$[\s\S]*?\$\$", " ", text, flags=re.M)
    text = re.sub(r"\$[^$]*\$", " x ", text)
    return len(
        re.findall(r"\w[\w’'.,-]*", re.sub(r"^[-*] |<[^>]*>|\. \. \.", " ", text, flags=re.M))
    )


@dataclass
class Deck:
    """The slides of a lesson by sections, the slides after the end, and the run sheet."""

    title: str
    sections: list[list[Slide]]
    behind: list[Slide]
    sheet: str
    number: str = ""

    @property
    def shown(self) -> list[Slide]:
        """The slides up to the end of the lecture."""
        return [slide for section in self.sections for slide in section]


class _Reader:
    def __init__(self, root: Path) -> None:
        self.root = root
        self.sections: list[list[Slide]] = [[]]
        self.behind: list[Slide] = []
        self.section = self.title = ""
        self.keys: set[str] = set()  # the keys of the next slide
        self.ahead: list[str] = []  # notes for the next slide
        self.poll: Slide | None = None  # the poll whose verdict comes next
        self.answer = ""

    @property
    def after(self) -> bool:
        return self.section.startswith(BEHIND)

    def put(self, slide: Slide) -> None:
        """Add a slide to the current section."""
        slide.keys |= self.keys
        slide.notes = [*self.ahead, *slide.notes]
        self.keys, self.ahead = set(), []
        (self.behind if self.after else self.sections[-1]).append(slide)

    def put_text(self, wish: str, own: Picture | None = None) -> None:
        """Add the slides of a text; the last slide shows `own`, the picture of the cell."""
        texts = [text.strip() for text in re.split(r"^---$", wish, flags=re.M)]
        for text in texts:
            borrowed = [self.borrowed(name) for name in _PICTURE.findall(text)]
            if text is texts[-1] and own:
                borrowed = [own]
            parts = re.split(r"^\. \. \.$", _PICTURE.sub("", text), flags=re.M)
            parts = [part.strip() for part in parts if part.strip()]
            if parts or borrowed:
                title = self.section or self.title
                self.put(Slide(title, "plain", parts, borrowed[0] if borrowed else None))

    def borrowed(self, name: str) -> Picture:
        """Return a picture: of a cell, of ``lesson/cell``, or the sketch ``sketches/name``."""
        lesson, _, cell = name.rpartition("/")
        cells = self.notebook.cells
        if lesson == "sketches":
            file = SKETCHES / f"{cell}.svg"
            if not file.exists():
                raise ValueError(f"slide: there is no sketch {file.name}")
            return Picture(file.read_text(encoding="utf-8"), 0.9)
        if lesson:
            path = self.root / "notebooks" / f"{lesson}.ipynb"
            cells = nbformat.read(path, as_version=4).cells
        found = [picture_of(each, self.root) for each in cells if each.id == cell]
        if not found or not found[0]:
            raise ValueError(f"slide: {name} is not a cell with a stored picture")
        return found[0]

    def note(self, text: str, ahead: bool = False) -> None:
        """Add a note for the lecturer to the last slide, or to the next one if `ahead` is true."""
        slides = self.sections[-1]
        if text.strip() and not self.after and (ahead or slides):
            (self.ahead if ahead else slides[-1].notes).append(text.strip())

    def read(self, notebook: NotebookNode) -> Deck:
        """Return the deck of a lesson."""
        self.notebook = notebook
        cells, sheet = split_sheet(notebook)
        for cell in cells:
            wish = cell.metadata.get("slide", False)
            if wish is not False and not isinstance(wish, str):
                raise ValueError(f"slide: a text or false is wanted in {cell.id}, got {wish!r}")
            if {"solution", "not-in-lectures"} & {*cell.metadata.get("tags", [])}:
                continue
            if cell.cell_type == "code":
                if wish is not False:
                    self.read_code(cell, wish)
            else:
                self.read_text(cell, wish or "")
        if not self.sections[0]:
            raise ValueError("it does not begin with a title, such as # The plane")
        deck = Deck(self.sections[0][0].title, self.sections, self.behind, sheet)
        self.keys, self.section = {"homework"}, ""
        self.sections.append([])
        self.note("E leads to exercises, misprints and references, after this slide.", ahead=True)
        title = self.sections[0][0]
        still = title.picture and replace(
            title.picture, html=title.picture.html.partition("<script")[0]
        )
        self.put(Slide("Questions?", "end", title.parts, still))
        plan(deck.shown, sheet)
        return deck

    def read_code(self, cell: NotebookNode, wish: str) -> None:
        name = re.search(r'save_\w+\(\s*fig,\s*"(?:lesson\d\d_|paper_|report_)?(\w+)"', cell.source)
        key = name[1] if name else "explorer" if "_explorer()" in cell.source else cell.id
        figure = re.fullmatch(r"fig(\d+)([a-z]?)", key)
        self.keys |= {f"figure {figure[1]}", f"figure {figure[1]}{figure[2]}"} if figure else {key}
        self.keys.add(cell.id.replace("-", " "))
        if not cell.outputs:
            raise ValueError(
                f"slide: {cell.id} has no outputs: run 'course.py figures' to store them"
            )
        self.put_text(wish, picture_of(cell, self.root))
        if key == "explorer":
            self.note("M plays the picture. R shows its numbers, which stay on after the verdict.")

    def read_text(self, cell: NotebookNode, wish: str) -> None:
        heading = re.match(r"(#+) (.*)\n*", cell.source)
        text = cell.source[heading.end() :] if heading else cell.source
        self.keys |= {cell.id.replace("-", " ")} if wish else set()
        if heading and self.begins(len(heading[1]), heading[2], text, wish):
            return
        if self.after:
            if not self.answer:
                self.put_behind(wish or re.sub(r"<details>.*?</details>", "", text, flags=re.S))
        elif self.answer and self.poll and not heading:
            self.put_answer(self.poll, text, wish)
        else:
            if self.section == "Recap":
                wish = wish or text
            leads = wish or heading or "*Look for" in text  # the note belongs to the next slide
            self.note(text, ahead=bool(leads))
            self.put_text(wish)

    def begins(self, level: int, words: str, text: str, wish: str) -> bool:
        """Begin the part with this heading; return True if its cell needs no further reading."""
        self.answer = words if words.startswith("Answer") else ""
        if level == 1:
            question = re.search(r"\*\*The question of this \w+\.\*\* (.*)", text)
            self.title, self.keys = words, {"question"}
            self.put_text(wish or (question[1] if question else ""))
            if not self.sections[0]:
                self.put(Slide(words))
            title = self.sections[0][0]
            title.kind = "title"
            if title.picture and '"controls":[]' not in title.picture.html:
                title.picture.html = title.picture.html.partition("<script")[0]  # no sliders here
            self.note(text)
            return True
        if level == 2:
            self.section = self.title = words
            number = re.match(r"\d+", words)
            self.keys = {number[0] if number else words.lower(), words.lower()}
            if not self.after:
                self.sections.append([])
        elif words.startswith("Poll"):
            self.begins_poll(words, text, wish)
            return True
        elif not self.answer:
            self.title = words
            self.keys |= {words.lower()}
        return bool(self.answer)

    def begins_poll(self, words: str, text: str, wish: str) -> None:
        question = wish or _ITEM.sub("", text).strip()
        options = {item[1].strip("*"): item[2] for item in _ITEM.finditer(text)}
        self.poll = Slide(self.title, "poll", [question], poll=words, options=options)
        self.keys |= {words.lower()}
        self.put(self.poll)

    def put_answer(self, poll: Slide, text: str, wish: str) -> None:
        """Read a cell of an answer; the list of ideas becomes the slide of the verdict."""
        listed = [*_ITEM.finditer(text)]
        outside = re.search(r"(?:^|[^-] )\*\*([A-Z])\*\*(.*(?:\n.+)*)", _ITEM.sub("", text), re.M)
        if outside and not poll.right:
            poll.right = outside[1]
            said = re.sub(r"^( it is)?[:., ]+", "", outside[2].partition("*Look for")[0])
            if outside[0].startswith("**"):
                poll.ideas[poll.right] = said.strip()
        for item in [*listed, *_ITEM.finditer(wish)]:  # `wish` replaces the text of the cell
            said = re.sub(r"^(is|are) ", "", item[2].strip())
            poll.ideas |= dict.fromkeys(re.findall("[A-Z]", item[1]), said)
        if listed:
            verdict = Slide(self.title, "verdict", poll.parts, poll=poll.poll)
            verdict.options, verdict.ideas, verdict.right = poll.options, poll.ideas, poll.right
            told = [f"**{letter}**: {poll.ideas.get(letter, '')}" for letter in poll.options]
            verdict.notes, verdict.keys = told, {self.answer.lower()}
            poll.notes = [f"Right: **{poll.right}**.", *poll.notes, *told]
            self.put(verdict)
            self.poll = None
        wish = _ITEM.sub("", wish).strip()
        self.note(_ITEM.sub("", text), ahead=bool(wish))
        self.put_text(wish)

    def put_behind(self, text: str) -> None:
        """Add slides after the end; a long table or list is split over several slides."""
        text = text.strip()
        if text.startswith("<small>") and "\n" not in text:
            return
        table = re.search(r"^\|.*\n\|[-| :]+\n", text, re.M)
        before = text[: table.start()].strip() if table else text
        rows = re.findall(r"^\|.*", text[table.end() :], re.M) if table else []
        items = re.split(r"\n(?=- )", text) if text.startswith("- ") else []
        for i in range(0, len(rows), ROWS):
            some = table[0] + "\n".join(rows[i : i + ROWS]) if table else ""
            self.put(Slide(self.title, "plain", [some]))
        for i in range(0, len(items), ROWS):
            self.put(Slide(self.title, "plain", ["\n".join(items[i : i + ROWS])]))
        if before and not rows and not items:
            self.put_exercise(before)

    def put_exercise(self, text: str) -> None:
        """Add an exercise; short exercises share a slide."""
        if self.title != self.section:
            text = f"**{self.title}.** {text}"
        last = self.behind[-1] if self.behind else None
        if last and last.title == self.section and last.words + words_of(text) <= TOGETHER:
            last.parts[0] += f"\n\n{text}"
        else:
            self.put(Slide(self.section, "plain", [text]))


def picture_of(cell: NotebookNode, root: Path) -> Picture | None:
    """Return the picture of a code cell without the caption; if possible, it is interactive."""
    explorer = re.search(r"explorers\.(\w+)_explorer\(\)", cell.source)
    page = "".join(o.data["text/html"] for o in cell.outputs if "text/html" in o.get("data", {}))
    if explorer and (root / "figures" / "explorers" / f"{explorer[1]}.html").exists():
        page = living(explorer[1], root)  # a recorded explorer moves without Python
    image = re.search(r'<img [^>]*?alt="([^"]*)"[^>]*?src="data:image/png;base64,([^"]+)"', page)
    if not image:
        return None
    data, still = _LIVING.search(page), base64.b64decode(image[2])
    moves = data and '"controls":[]' not in data[1]
    with Image.open(io.BytesIO(still)) as opened:
        crop = (0.0,) * 4 if moves else margins(opened)
        inner = opened.width * (1 - crop[0] - crop[2]), opened.height * (1 - crop[1] - crop[3])
        aspect = inner[0] / inner[1]
    shares = " ".join(f"{share:.3f}" for share in crop)
    src = f"data:image/png;base64,{image[2]}"
    html = f'<img data-crop="{shares if any(crop) else ""}" alt="{image[1]}" src="{src}">'
    if data:
        html += f'<script type="application/json">{data[1]}</script>'
    return Picture(html, aspect)


def margins(still: Image.Image) -> tuple[float, ...]:
    """Return the white margins (left, top, right, bottom) of a still as fractions of its size."""
    grey = still.convert("L")
    box = grey.point([255 * (x < 245) for x in range(256)]).getbbox() or (0, 0, *still.size)
    sides = box[0], box[1], still.width - box[2], still.height - box[3]
    sizes = still.width, still.height, still.width, still.height
    return tuple(max(0.0, side / size - 0.01) for side, size in zip(sides, sizes, strict=True))


def rows_of(sheet: str) -> list[tuple[int, str, str, str]]:
    r"""Return the rows of a run sheet: minute, part, question with answer, parts to skip.

    Examples
    --------
    >>> rows_of("| minute | part | ask | skip |\n|---|---|---|---|\n| 3 | 2 | Why? *So.* | |")
    [(3, '2', 'Why? *So.*', '')]
    """
    found = re.findall(r"^\| (\d+) \|([^|]*)\|([^|]*)\|([^|]*)\|", sheet, re.M)
    return [(int(minute), *(text.strip() for text in texts)) for minute, *texts in found]


def named_in(slides: list[Slide], part: str) -> list[int]:
    """Return the number of the first slide for each name in `part`, such as ``poll 1, explorer``.

    Names without a slide are left out; they are notes for the lecturer.
    """
    found = []
    for name in re.split(r"[,;] | and ", part.lower()):
        name = name.removeprefix("the ")
        for k, slide in enumerate(slides):
            if name in slide.keys or (len(name) > 3 and any(name in key for key in slide.keys)):
                found.append(k)
                break
    return found


def starts_of(slides: list[Slide], rows: list[tuple[int, str, str, str]]) -> list[int]:
    """Return the slide at which each row of a run sheet begins: the first slide that it names.

    Homework belongs to the last slide. In a lesson of two lectures, homework also belongs to
    the last slide of the first lecture.
    """
    starts: list[int] = []
    later = [i for i, row in enumerate(rows[1:], 1) if row[0] < rows[i - 1][0]]
    if later and rows[later[0] - 1][1] == "homework":
        cut = later[0]
        rest = starts_of(slides, rows[cut:])
        return [*starts_of(slides, rows[: cut - 1]), rest[0] - 1, *rest]
    for minute, part, *_ in rows:
        start, *_ = [*named_in(slides, part), -1]
        if start < max([0, *starts[-1:]]):
            where = "no slide" if start < 0 else "a slide before that of the row above"
            raise ValueError(f"run sheet, minute {minute}: {part!r} names {where}")
        starts.append(start)
    return starts


def plan(slides: list[Slide], sheet: str) -> None:
    """Give each slide its row of the run sheet and its share of the time.

    The question of a row is asked at the last slide that the row names, but never before the
    vote on this slide has ended.
    """
    rows = rows_of(sheet)
    starts = starts_of(slides, rows)
    for i, (minute, part, ask, skip) in enumerate(rows):
        last = i + 1 == len(rows)
        end = minute + 1 if last else rows[i + 1][0]
        end = end if end >= minute else minute + 2  # the next row begins another lecture
        span = slides[starts[i] : len(slides) if last else max(starts[i + 1], starts[i] + 1)]
        late = f" · if late, skip {skip}" if skip else ""
        for slide in span:
            slide.seconds = 60 * (end - minute) / len(span)
            slide.notes.insert(0, f"*Minute {minute}–{end}* · {part}{late}")
        at = max(named_in(slides, part.partition(", recap")[0]), default=0)
        at = next((k for k in range(at, len(slides)) if slides[k].kind != "poll"), at)
        over = [k for k, slide in enumerate(slides) if slide.kind == "verdict" and slide in span]
        asked = span[-1] if part == "homework" else slides[max([at, *over])]
        if ask:
            asked.notes.insert(1 if asked in span else 0, f"**Ask:** {ask}")
    if before := re.search(r"\*Before class:\*.*", sheet):
        slides[0].notes.insert(0, before[0])


def deck_of(path: Path) -> Deck:
    """Return the slides of a lesson in the folder ``notebooks`` of a course."""
    try:
        notebook = nbformat.read(path, as_version=4)
        deck = _Reader(path.resolve().parents[1]).read(notebook)
    except ValueError as error:
        raise ValueError(f"{path.name}: {error}") from error
    deck.number = str(int(path.name[:2]))
    return deck
