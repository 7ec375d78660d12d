"""Slides as pages: for each lesson a deck, and a crib sheet for its lecturer."""

import html
import re
import shutil
from collections.abc import Callable
from importlib.metadata import distribution
from itertools import groupby
from pathlib import Path
from typing import Any

from markdown_it import MarkdownIt
from mdit_py_plugins.dollarmath import dollarmath_plugin

from rbclassroom.explorers.recorded import COMPUTED
from rbclassroom.lecture.slides import Deck, Slide
from rbcourse.draw.display import ENGINE

STATIC = Path(__file__).with_name("static")
WIDE = 1.8
"""A picture whose ratio of width to height exceeds this value is shown below its text."""
_KEYS = re.compile(r" \[\w+\d{4}(?:[;,] \w+\d{4})*\]")  # keys of cited works, for the book only
_LINK = re.compile(r"(?<!!)\[([^\]\n]+)\]\((?!https?:)[^)\s]+\)")  # links to files of the course
_TOGETHER = {  # patterns of text that must stay on one line
    r"(\d) (%|°|m|kg|s|rad|: \d)(?![\w\\])": "\\1\N{NO-BREAK SPACE}\\2",
    r"\b(kg|N) (?=m)": "\\1\N{NO-BREAK SPACE}",
    r"\b((?:half|quarter|near|p)-\w+)": r'<span class="whole">\1</span>',
    r"\b([Ff]igure|[Ll]esson|[Ss]ection) (?=\d)": "\\1\N{NO-BREAK SPACE}",
    r" (–|\d{1,2}[.,]|: (?=\d))": "\N{NO-BREAK SPACE}\\1",
    r"(\d)–(\d)": "\\1\N{WORD JOINER}–\N{WORD JOINER}\\2",
    r"(?<!span>) ([^\s<]{1,8}</(?:p|li|h3)>)": "\N{NO-BREAK SPACE}\\1",
}
_WHOLE = re.compile(r'(<span class="math inline">(?:(?!</span>).)*</span>[.,;:?!)]+)')
_SYMBOL = re.compile(r' (?=(?:<span class="whole">)?<span class="math inline">\\\(\\?\w+\\\))')


def _math(text: str, options: dict[str, Any]) -> str:
    tex = re.sub(r"\\mathsf(?: T|\{T\})", r"\\top", text).replace("°", r"^{\circ}")
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
    page = _WHOLE.sub(r'<span class="whole">\1</span>', page)
    return _SYMBOL.sub("\N{NO-BREAK SPACE}", page)


def _inline(text: str) -> str:
    return marked(text).strip().removeprefix("<p>").removesuffix("</p>")


def _words(slide: Slide) -> str:
    """Return the text of a slide as HTML; later parts and items of lists appear one by one."""
    first, *later = slide.parts
    parts = [marked(first), *(f'<div class="fragment">{marked(part)}</div>' for part in later)]
    words = "".join(parts).replace("<li>", '<li class="fragment">')
    return re.sub(r'(^\s*<[uo]l>\s*<li) class="fragment">', r"\1>", words)


def _options(slide: Slide) -> str:
    """Return the options of a poll, and the ideas behind them; a poll keeps the ideas hidden."""
    rows = ""
    for letter, text in slide.options.items():
        state = " right" if letter == slide.right else " wrong"
        step = " fragment" if letter != slide.right and slide.kind == "verdict" else ""
        rows += f'<li class="option{state * (slide.kind == "verdict")}"><b>{letter}</b>'
        rows += f"<div{' class=large' * (len(text) < 12)}>{_inline(text)}</div>"
        rows += f'<p class="idea{step}">{_inline(slide.ideas.get(letter, ""))}</p></li>'
    return f'<ul class="options{" brief" * (rows.count("=large>") > 2)}">{rows}</ul>'


def section(slide: Slide) -> str:
    """Return a slide as HTML for reveal.js."""
    layout, words, head = slide.kind, _words(slide), f"<h2>{_inline(slide.title)}</h2>"
    picture, text = slide.picture, "".join(slide.parts)
    short = len(text) < (290 if picture else 420) and "$$" not in text and "|-" not in text
    if slide.kind in ("title", "end") and '"controls":[]' not in picture:
        picture = picture.partition("<script")[0]  # sliders would need much room
    if slide.kind == "title":
        head, words = "", f"<h1>{_inline(slide.title)}</h1>{words}"
    elif slide.kind == "end":
        layout = "plain sketched end" if picture else "plain end"
        head, words = "<h2></h2>", f"<h3>{_inline(slide.title)}</h3>{words}"
    elif slide.poll:
        head, words = f"<h2>{_inline(slide.title)} · {slide.poll}</h2>", words + _options(slide)
    elif picture.startswith("<svg") and slide.aspect < 1:
        layout = "plain sketched" + " short" * short
    elif picture:
        layout = "wide" if slide.aspect > WIDE else "split"
    elif "<h3>" not in words:  # the slide is a recap, or comes after the end
        head, words = "<h2></h2>", f"<h3>{_inline(slide.title)}</h3>{words}"
    elif slide.kind == "plain":
        layout = "plain" + " short" * short
    if heading := re.match(r"\s*<h3>.*?</h3>", words):
        head, words = head + heading[0], words[heading.end() :]
    layout += " tabled" * ("<table" in words)
    shown = f"<figure>{picture}</figure>" if picture else ""
    notes = "".join(f"<div>{marked(note)}</div>" for note in slide.notes)
    timing = f' data-timing="{slide.seconds:.0f}"' if slide.seconds else ""
    return (
        f'<section class="{layout}" data-poll="{slide.poll}"{timing}>{head}'
        f'<div class="body"><div class="words">{words}</div>{shown}</div>'
        f'<aside class="notes">{notes}</aside></section>'
    )


def _page(template: str, title: str, body: str) -> str:
    page = (STATIC / template).read_text(encoding="utf-8")
    return page.replace("<!--TITLE-->", html.escape(title)).replace("<!--BODY-->", body)


def deck_page(deck: Deck) -> str:
    """Return the page of a deck; the last column has the last slide, exercises and references."""
    *slides, end = deck.shown
    stacks = [[*part] for _, part in groupby(slides, lambda slide: slide.title)]
    stacks.append([end, *deck.behind])
    body = "\n".join(f"<section>{''.join(map(section, stack))}</section>" for stack in stacks)
    body = body.replace("<h1>", f'<p class="lesson">Lesson {deck.number}</p><h1>', 1)
    return _page("deck.html", slides[0].title, body)


def crib_page(deck: Deck) -> str:
    """Return the crib sheet of a lecture: its run sheet, numbers of slides and right answers."""
    title = deck.shown[0].title
    polls = [slide for slide in deck.shown if slide.kind == "verdict"]
    right = [f"- **{poll.poll}: {poll.right}** · {poll.options[poll.right]}" for poll in polls]
    text = "\n".join([f"# {title}\n", f"{deck.sheet}\n", *right])
    return _page("crib.html", title, marked(text))


def write(decks: dict[str, Deck], folder: Path, ready: Callable[[str], str] = str) -> None:
    """Write decks, crib sheets, and the files that all decks share, to a folder.

    The keys of `decks` are the names of the pages. Each page of slides is changed by `ready`
    before it is written. In the book, this function replaces stills by files that the slides share
    with the lesson.
    """
    shared = folder / "shared"
    shutil.copytree(STATIC / "vendor", shared, dirs_exist_ok=True)
    for name in ("slides.css", "sketch.css", "slides.js"):
        shutil.copyfile(STATIC / name, shared / name)
    engine = (ENGINE + COMPUTED).replace("lineWidth: line", "lineWidth: 1.4 * line")
    texts = {"shared/display.js": engine}
    for name, deck in decks.items():
        texts[f"{name}.html"] = ready(deck_page(deck))
        if deck.sheet:
            texts[f"{name}_crib.html"] = crib_page(deck)
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8", newline="\n")


def mathjax() -> Path:
    """Return the path of the file of MathJax, which the pages expect in ``../_static``."""
    found = distribution("sphinx-mathjax-offline")
    return Path(str(found.locate_file("sphinx-mathjax-offline/static/mathjax/tex-svg.js")))
