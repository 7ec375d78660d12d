"""Slides as pages: for each lesson a deck, and a crib sheet for its lecturer."""

import html
import re
import shutil
from collections.abc import Callable
from importlib.metadata import distribution
from pathlib import Path
from typing import Any

from markdown_it import MarkdownIt
from mdit_py_plugins.dollarmath import dollarmath_plugin

from rbclassroom.lecture.slides import Deck, Slide, rows_of, starts_of, words_of
from rbcourse.draw.display import ENGINE

STATIC = Path(__file__).with_name("static")
WIDE = 1.9
"""A picture whose ratio of width to height exceeds this value is shown below its text. The value is
1.6 if the text is brief."""
IDEA = 14
"""The largest number of words in an idea behind an option, unless its first sentence has more."""
# keys of cited works; only the book shows them
_KEYS = re.compile(r" \[\w+\d{4}(?:[;,] \w+\d{4})*\]")
_LINK = re.compile(r"(?<!!)\[([^\]\n]+)\]\((?!https?:)[^)\s]+\)")  # links to files of the course
_TOGETHER = {  # patterns of text that must stay on one line
    r"(\d) (%|°|m|kg|s|rad|: \d)(?![\w\\])": "\\1\N{NO-BREAK SPACE}\\2",
    r"\b(kg|N) (?=m)": "\\1\N{NO-BREAK SPACE}",
    r"\b([Ff]igure|[Ll]esson|[Ss]ection) (?=\d)": "\\1\N{NO-BREAK SPACE}",
    r" –": "\N{NO-BREAK SPACE}–",
    r"(\d)–(\d)": "\\1\N{WORD JOINER}–\N{WORD JOINER}\\2",
    r" ([^\s<]{1,5}</(?:p|li|h3)>)": "\N{NO-BREAK SPACE}\\1",
}
_WHOLE = re.compile(r'(<span class="math inline">(?:(?!</span>).)*</span>[.,;:?!)]+)')


def _math(text: str, options: dict[str, Any]) -> str:
    tex = re.sub(r"\\mathsf(?: T|\{T\})", r"\\top", text)
    both = (r"\[", r"\]") if options["display_mode"] else (r"\(", r"\)")
    return html.escape(f"{both[0]}{tex}{both[1]}", quote=False)


_MARKDOWN = MarkdownIt("commonmark", {"html": True, "typographer": True})
_MARKDOWN.enable(["table", "smartquotes"])
_MARKDOWN.use(dollarmath_plugin, renderer=_math)


def marked(text: str) -> str:
    """Return Markdown as HTML; a formula stays on one line with the punctuation after it."""
    page: str = _MARKDOWN.render(_LINK.sub(r"\1", _KEYS.sub("", text)))
    for pattern, kept in _TOGETHER.items():
        page = re.sub(pattern, kept, page)
    page = page.replace("<p><em>Look for", '<p class="look"><em>Look for')
    return _WHOLE.sub(r'<span class="whole">\1</span>', page)


def _inline(text: str) -> str:
    return marked(text).strip().removeprefix("<p>").removesuffix("</p>")


def _words(slide: Slide) -> str:
    """Return the text of a slide as HTML; later parts and items of lists appear one by one."""
    first, *later = slide.parts or [""]
    parts = [marked(first), *(f'<div class="fragment">{marked(part)}</div>' for part in later)]
    words = "".join(parts).replace("<li>", '<li class="fragment">')
    return re.sub(r'(^\s*<[uo]l>\s*<li) class="fragment">', r"\1>", words)


def _options(slide: Slide) -> str:
    """Return the options of a poll, and the ideas behind them; a poll keeps the ideas hidden."""
    rows = []
    for letter, text in slide.options.items():
        right = letter == slide.right and slide.kind == "verdict"
        state = " right" if right else " wrong" if slide.kind == "verdict" else ""
        step = "" if right or slide.kind == "poll" else " fragment"
        idea = _inline(_shortened(slide.ideas.get(letter, "")))
        said = f'<p class="idea{step}">{idea}</p>'
        rows.append(
            f'<li class="option{state}"><b>{letter}</b><div>{_inline(text)}</div>{said}</li>'
        )
    return f'<ul class="options">{"".join(rows)}</ul>'


def _shortened(text: str) -> str:
    """Return the first sentence of an idea, and further sentences up to `IDEA` words in all."""
    kept, *rest = re.split(r"(?<=[.?!])\s+(?=[A-Z$*(])", text.strip())
    while rest and words_of(f"{kept} {rest[0]}") <= IDEA:
        kept = f"{kept} {rest.pop(0)}"
    return re.sub(r"^\**[a-z]", lambda match: match[0].upper(), kept)


def section(slide: Slide) -> str:
    """Return a slide as HTML for reveal.js."""
    layout, words, head = slide.kind, _words(slide), f"<h2>{_inline(slide.title)}</h2>"
    if slide.kind == "title":
        head, words = "", f"<h1>{_inline(slide.title)}</h1>{words}"
    elif slide.kind == "end":
        head, words = "", f"<h1>{slide.title}</h1>{words}"
    elif slide.poll:
        head, words = f"<h2>{slide.poll}</h2>", words + _options(slide)
    elif slide.picture:
        brief = slide.words <= 30 and "math block" not in words
        narrow = " narrow" * (slide.words < 18)
        layout = "wide" if slide.picture.aspect > (1.6 if brief else WIDE) else f"split{narrow}"
        layout = "plain sketched" if slide.picture.html.startswith("<svg") else layout
    elif "<h3>" not in words:  # the slide is a recap, or comes after the end
        head, words = "<h2></h2>", f"<h3>{_inline(slide.title)}</h3>{words}"
    if heading := re.match(r"\s*<h3>.*?</h3>", words):
        head, words = head + heading[0], words[heading.end() :]
    layout += " tabled" * ("<table" in words)
    shown = f"<figure>{slide.picture.html}</figure>" if slide.picture else ""
    notes = "".join(f"<div>{marked(note)}</div>" for note in slide.notes)
    timing = f' data-timing="{slide.seconds:.0f}"' if slide.seconds else ""
    return (
        f'<section class="{layout}" data-poll="{slide.poll}"{timing}>{head}'
        f'<div class="body"><div class="words">{words}</div>{shown}</div>'
        f'<aside class="notes">{notes}</aside></section>'
    )


def deck_page(deck: Deck) -> str:
    """Return the page of a deck; the last column has the last slide, exercises and references."""
    *parts, end = deck.sections
    stacks = [part for part in parts if part] + [[*end, *deck.behind]]
    joined = ("".join(map(section, part)) for part in stacks)
    slides = "\n".join(f"<section>{part}</section>" for part in joined)
    slides = slides.replace("<h1>", f'<p class="lesson">Lesson {deck.number}</p><h1>', 1)
    template = (STATIC / "deck.html").read_text(encoding="utf-8")
    return template.replace("<!--TITLE-->", html.escape(deck.title)).replace(
        "<!--SLIDES-->", slides
    )


def crib_page(deck: Deck) -> str:
    """Return the crib sheet of a lecture: its run sheet, numbers of slides and right answers."""
    rows = rows_of(deck.sheet)
    starts = starts_of(deck.shown, rows)
    lines = [
        "| min | slide | part | question and expected answer | skip if late |",
        "|--|--|--|--|--|",
    ]
    for i, ((minute, part, ask, skip), start) in enumerate(zip(rows, starts, strict=True)):
        if i and minute < rows[i - 1][0]:
            lines.append("| | | **second lecture** | | |")
        lines.append(f"| {minute} | {start + 1} | {part} | {ask} | {skip} |")
    polls = [slide for slide in deck.shown if slide.kind == "verdict"]
    right = (f"- **{poll.poll}: {poll.right}** · {poll.options[poll.right]}" for poll in polls)
    before = deck.sheet.partition("\n")[0]
    text = "\n".join([f"# {deck.title}", "", before, "", *lines, "", *right])
    template = (STATIC / "crib.html").read_text(encoding="utf-8")
    body = marked(text)
    return template.replace("<!--TITLE-->", html.escape(deck.title)).replace("<!--BODY-->", body)


def write(
    decks: dict[str, Deck], folder: Path, ready: Callable[[str], str] = lambda page: page
) -> None:
    """Write decks, crib sheets, and the files that all decks share, to a folder.

    The keys of `decks` are the names of the pages. Each page of slides is changed by `ready`
    before it is written. In the book, this function replaces stills by files that the slides share
    with the lesson.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for name, deck in decks.items():
        _put(folder / f"{name}.html", ready(deck_page(deck)))
        if deck.sheet:
            _put(folder / f"{name}_crib.html", crib_page(deck))
    shared = folder / "shared"
    shutil.copytree(STATIC / "vendor", shared, dirs_exist_ok=True)
    for name in ("slides.css", "slides.js"):
        shutil.copyfile(STATIC / name, shared / name)
    # reveal.js scales slides; with `window.pixels`, a canvas has as many pixels as on the screen
    _put(shared / "display.js", ENGINE.replace("window.devicePixelRatio", "window.pixels"))


def put_mathjax(folder: Path) -> None:
    """Copy MathJax to its place in the book, ``_static`` beside the folder of the decks."""
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(mathjax(), folder / "tex-svg.js")


def mathjax() -> Path:
    """Return the path of the file of MathJax."""
    found = distribution("sphinx-mathjax-offline")
    return Path(str(found.locate_file("sphinx-mathjax-offline/static/mathjax/tex-svg.js")))


def _put(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8", newline="\n")
