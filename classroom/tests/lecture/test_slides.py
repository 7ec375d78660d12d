"""Test the slide generator with small lessons, and the rules for authors with all lessons."""

import base64
import io
import re
from itertools import pairwise
from pathlib import Path

import nbformat
import pytest
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook, new_output
from PIL import Image
from tiny import lesson_at

pytest.importorskip("markdown_it", reason="slides are made in the environment of the book")

from rbclassroom.lecture import deck as pages
from rbclassroom.lecture.slides import deck_of, sketch_of, texts_of

ROOT = Path(__file__).parents[3]
LESSONS = sorted((ROOT / "notebooks").glob("[0-9][0-9]_*.ipynb"))
SHEET = "## run sheet\n\n*Before class:* Sleep.\n\n"
SHEET += "| minute | part | ask | skip |\n|---|---|---|---|\n"


def text(source, slide=None):
    """Return a cell of text, and its text on slides."""
    return new_markdown_cell(source), slide


def picture(slide, size, **more):
    """Return a code cell with a black picture, whose white margins are a tenth of its size."""
    still = Image.new("L", size, 255)
    still.paste(0, (size[0] // 10, size[1] // 10, size[0] * 9 // 10, size[1] * 9 // 10))
    file = io.BytesIO()
    still.save(file, "PNG")
    src = f"data:image/png;base64,{base64.b64encode(file.getvalue()).decode()}"
    data = {"text/html": f'<figure><img id="x" alt="described" src="{src}"/></figure>'}
    return new_code_cell("1", outputs=[new_output("display_data", data)], **more), slide


def tiny(folder, *cells, sheet=""):
    """Return the deck of a lesson that has a title and these cells."""
    pairs = [text("# Tiny: a lesson\n\nGoals.", "Why?"), *cells]
    (folder / "notebooks" / "slides").mkdir(parents=True, exist_ok=True)
    path = folder / "notebooks" / "01_tiny.ipynb"
    notebook = new_notebook(cells=[cell for cell, _ in pairs])
    path.write_text(nbformat.writes(notebook), encoding="utf-8")
    texts = "\n".join(f"## {cell.id}\n\n{slide}\n" for cell, slide in pairs if slide)
    texts += SHEET + sheet if sheet else ""
    (path.parent / "slides" / "01.md").write_text(texts, encoding="utf-8")
    return deck_of(path)


def test_slides_show_only_the_text_written_for_them(tmp_path):
    deck = tiny(
        tmp_path,
        text("## 1 · One\n\nLong.", "Short.\n\n. . .\n\nThen.\n\n---\n\nNext."),
        text("More, for the lecturer."),
        text("## 2 · Two\n\nNothing here."),
        text("Nor here."),
        text("### Below\n\nText.", "On it."),
        text("## Recap", "- all of it"),
    )
    assert [(slide.title, slide.kind, slide.parts) for slide in deck.shown] == [
        ("Tiny: a lesson", "title", ["Why?"]),
        ("1 · One", "plain", ["Short.", "Then."]),
        ("1 · One", "plain", ["Next."]),
        ("2 · Two", "plain", ["On it."]),
        ("Recap", "end", ["- all of it"]),
    ]
    notes = [slide.notes for slide in deck.shown[:3]]
    assert notes == [["Goals."], ["Long."], ["More, for the lecturer."]]
    assert deck.shown[3].notes == ["Nothing here.", "Nor here.", "Text."]
    page = pages.deck_page(deck).replace("\N{NO-BREAK SPACE}", " ")
    assert "Lesson 1</p><h1>" in page
    assert "<p>Short.</p>" in page
    assert '<div class="fragment"><p>Then.</p>' in page
    assert "<li>all of it</li>" in page
    with pytest.raises(ValueError, match="does not begin with a title"):
        deck_of(lesson_at(tmp_path / "untitled", new_markdown_cell("Text.")))


@pytest.mark.parametrize(
    ("texts", "wrong"),
    [
        ("## one\n\nText.\n\n## tow\n", "5: the lesson has no cell 'tow'"),
        ("## one\n\n## two\n## one\n", "4: cell one has a text above"),
        ("\nText.\n", "2: a line such as '## cell-04' is wanted before the text"),
    ],
)
def test_a_text_without_a_cell_is_refused(tmp_path, texts, wrong):
    path = lesson_at(tmp_path, *(new_markdown_cell("# It", id=name) for name in ("one", "two")))
    (path.parent / "slides" / "01.md").write_text(texts, encoding="utf-8")
    with pytest.raises(ValueError, match=re.escape(f"01_tiny.ipynb: slides/01.md, line {wrong}")):
        deck_of(path)
    (path.parent / "slides" / "01.md").unlink()
    with pytest.raises(ValueError, match=r"01_tiny\.ipynb: .*No such file .*01\.md"):
        deck_of(path)


@pytest.mark.parametrize(
    ("verdict", "wrong"),
    [
        ("**E** All.\n\n- **A** None.", "the options A, B; its answer has E, A"),
        ("**B** All.\n\n- **B** None.", "the options A, B; its answer has B, B"),
        ("**A** All.", "the options A, B; its answer has A"),
        ("- **A** All.\n- **B** None.", "the one without '-' before it; its answer has none"),
        ("**A** All.\n\n**B** None.", "the one without '-' before it; its answer has A, B"),
    ],
)
def test_a_verdict_must_explain_each_option_once(tmp_path, verdict, wrong):
    poll = text("### Poll 1\n\nHow many?\n\n- **A** one\n- **B** two")
    with pytest.raises(ValueError, match=re.escape(wrong)):
        tiny(tmp_path, poll, text("Answer.", verdict))


@pytest.mark.parametrize(
    ("formula", "wrong"),
    [(r"$\frac{1 \det M = -1$", "the braces of"), ("$$x$$ and $y", "a formula has only one $")],
)
def test_formulas_that_cannot_be_typeset_are_refused(tmp_path, formula, wrong):
    with pytest.raises(ValueError, match=re.escape(f"{wrong}")) as told:
        tiny(tmp_path, text("Text.", f"It is {formula}."))
    assert "slides/01.md, " in str(told.value)
    tiny(tmp_path / "good", text("Text.", r"It is $\{x\}^{2}$, and costs \$5."))


def test_a_picture_is_shown_with_the_text_of_its_cell(tmp_path):
    deck = tiny(
        tmp_path,
        text("## 1 · One", "One.\n\n![](01_tiny/high)"),
        picture("Before.\n\n---\n\n*Look for:* it.", (900, 400)),
        picture("It.", (400, 300), id="high"),
        picture(None, (400, 300)),
    )
    _, borrowed, before, wide, high, _ = deck.shown
    assert before.picture == ""
    assert borrowed.picture == high.picture
    assert high.aspect == pytest.approx(4 / 3, rel=0.01)
    assert wide.aspect == pytest.approx(9 / 4, rel=0.01)
    margin = re.search(r'data-crop="([\d. ]+)"', high.picture)[1]
    assert [float(share) for share in margin.split()] == pytest.approx([0.09] * 4, abs=0.003)
    assert 'class="wide"' in pages.section(wide)
    assert 'class="split"' in pages.section(high)
    look = '<p class="look"><em>Look for:</em>\N{NO-BREAK SPACE}it.</p>'
    assert look in pages.section(wide)


SKETCHES = """<svg xmlns="http://www.w3.org/2000/svg" width="1440" height="90">
<text x="0" y="9">it</text>
<svg id="it" class="sketch" x="0" y="9" width="9" height="9" viewBox="0 0 1030 400">
<path id="it-curve" d="M0 0 L1 1"/>
</svg>
</svg>
"""


def test_a_sketch_is_shown_beside_a_text(tmp_path):
    path = tmp_path / "notebooks" / "slides" / "01.svg"
    path.parent.mkdir(parents=True)
    path.write_text(SKETCHES, encoding="utf-8")
    deck = tiny(tmp_path, text("## 1", "Above.\n\n---\n\nBeside.\n\n![](it)"))
    picture = deck.shown[2].picture
    assert picture.startswith("<svg ")
    assert re.findall(r' (\w+)="', picture.partition(">")[0]) == ["xmlns", "class", "viewBox"]
    assert '<path d="M0 0 L1 1" />' in picture  # ids are names for the program only
    assert 'class="split"' in pages.section(deck.shown[2])
    path.write_text(SKETCHES[:-7], encoding="utf-8")
    with pytest.raises(ValueError, match=r"01_tiny\.ipynb: slides/01\.svg: no element found: line"):
        tiny(tmp_path, text("## 1", "![](it)"))


@pytest.mark.parametrize(
    ("cell", "wrong"),
    [
        (text("## 1", "![](01_tiny/nowhere)"), "there is no cell 01_tiny/nowhere"),
        (text("## 1", "![](09_nowhere/cell)"), "No such file .*09_nowhere"),
        (text("## 1", "![](is)"), r"slides/01\.svg has no sketch is "),
        ((new_code_cell("1"), "Text."), r"has no picture; 'course\.py figures' stores it"),
    ],
)
def test_a_picture_that_is_missing_is_named(tmp_path, cell, wrong):
    path = tmp_path / "notebooks" / "slides" / "01.svg"
    path.parent.mkdir(parents=True)
    path.write_text(SKETCHES, encoding="utf-8")
    with pytest.raises(ValueError, match=rf"^01_tiny\.ipynb: .*{wrong}"):
        tiny(tmp_path, cell)


VERDICT = """**B** It is even.

- **A** Odd, which nobody wants.
- **C** As odd.
- **D** As odd as C.

---

After."""


def poll():
    options = "".join(f"- **{letter}** · option {letter}\n" for letter in "ABCD")
    return (
        text("## 1 · One"),
        text(f"### Poll 1\n\nWhich?\n\n{options}"),
        text("### Answer to poll 1"),
        text("It was measured.", "Evidence."),
        text("**B** it is.\n\n- **A** is odd, and so on.", VERDICT),
    )


def test_the_verdict_of_a_poll_comes_after_the_evidence(tmp_path):
    deck = tiny(tmp_path, *poll())
    _, asked, evidence, verdict, after, _ = deck.shown
    assert (asked.kind, asked.parts, asked.poll) == ("poll", ["Which?"], "Poll 1")
    assert asked.options == {letter: f"option {letter}" for letter in "ABCD"}
    assert evidence.parts == ["Evidence."]
    assert (verdict.kind, verdict.right) == ("verdict", "B")
    ideas = {"A": "Odd, which nobody wants.", "B": "It is even.", "C": "As odd."}
    assert verdict.ideas == {**ideas, "D": "As odd as C."}
    assert verdict.notes == ["**B** it is.\n\n- **A** is odd, and so on."]
    assert after.parts == ["After."]
    page = pages.section(verdict)
    assert page.count('class="option wrong"') == 3
    assert page.count('class="option right"') == 1
    assert page.count("fragment") == 3  # each wrong option has its own step
    seen = pages.section(asked).partition("<aside")[0]
    # the ideas keep their place, and the page hides them
    assert re.findall(r'class="((?:option|idea).*?)">', seen)[1:] == ["option", "idea"] * 4
    assert asked.notes[0] == "Right: **B**."


def test_long_lists_of_works_are_split(tmp_path):
    works = "".join(f"- [One{1990 + i}] A work\n" for i in range(7))
    deck = tiny(
        tmp_path,
        text("## Exercises"),
        text("### Exercise 1, by hand\n\nShow it.\n\n<details>\nSecret.\n</details>"),
        text("### Exercise 2\n\nAnd this." + " Long." * 60),
        text("### Answer to exercise 2"),
        text("The answer."),
        text("### Exercise 3\n\nNot this.", "Short."),
        text("## Recap", "- so"),
        text(f"## References\n\n{works}"),
    )
    behind = [slide.parts[0] for slide in deck.behind]
    first = "**Exercise 1, by hand.** Show it.\n\n**Exercise 2.** And this."
    assert behind[:2] == [first + " Long." * 60, "**Exercise 3.** Short."]
    assert [part.count("A work") for part in behind[2:4]] == [4, 3]
    assert "One1990" not in pages.section(deck.behind[2])
    assert deck.shown[-1].title == "Recap"


def test_each_row_of_the_run_sheet_begins_at_its_slide(tmp_path):
    sheet = """| 0 | question | Ask. | |
| 2 | poll 1, a vote | | the second |
| 12 | recap, homework | | |
"""
    deck = tiny(tmp_path, *poll(), text("## Recap", "- so"), sheet=sheet)
    seconds = [slide.seconds for slide in deck.shown]
    assert seconds == [120, 150, 150, 150, 150, 60]
    assert deck.shown[1].notes[0] == "*Minute 2–12* · poll 1, a vote · if late, skip the second"
    first = ["*Before class:* Sleep.", "*Minute 0–2* · question", "**Ask:** Ask."]
    assert deck.shown[0].notes[:3] == first
    crib = pages.crib_page(deck)
    rows = re.findall(r"<td>(\d+)</td>\s*<td>(\d+)</td>", crib)
    assert rows == [("0", "1"), ("2", "2"), ("12", "6")]
    assert "Poll 1: B" in crib
    with pytest.raises(ValueError, match="minute 0: 'a dance' names no slide"):
        tiny(tmp_path, *poll(), sheet="| 0 | a dance | | |\n")
    with pytest.raises(ValueError, match=r"minute 0: 'poll 1' names .* after that"):
        tiny(tmp_path, *poll(), sheet="| 0 | poll 1 | | |\n| 1 | question | | |\n")
    two = "| 0 | question | | |\n| 9 | homework | | |\n| 0 | poll 1 | | |\n| 9 | homework | | |\n"
    deck = tiny(tmp_path, text("## 0", "x"), *poll(), sheet=two)
    assert re.findall(r"^\| \d \| (\d) \|", deck.sheet, re.M) == ["1", "2", "3", "7"]


def test_a_question_about_a_poll_is_asked_after_the_vote(tmp_path):
    sheet = "| 0 | question, 1, poll 1 | Why B? | |\n| 9 | recap | And so? | |\n"
    deck = tiny(tmp_path, *poll(), text("## Recap", "- so"), sheet=sheet)
    asked = ["".join(note for note in slide.notes if "Ask" in note) for slide in deck.shown]
    assert asked == ["", "", *["**Ask:** Why B?"] * 3, "**Ask:** And so?"]
    cells = poll()
    cells[3][0].id = "proof"  # the row of the poll has only the slide of the poll
    deck = tiny(tmp_path, *cells, sheet="| 0 | poll 1 | Why B? | |\n| 5 | proof | | |\n")
    assert "**Ask:** Why B?" in deck.shown[1].notes


def test_no_line_break_separates_a_number_from_its_unit():
    text = "[In](01.ipynb#s2) 5 % of 12 m, pages 3–9, it is so – or 1 : 2 of *it* is."
    whole = "In 5_% of 12_m, pages 3~–~9, it is so_– or 1_: 2 of <em>it</em>_is."
    marks = {"_": "\N{NO-BREAK SPACE}", "~": "\N{WORD JOINER}"}
    assert pages.marked(text).strip() == f"<p>{whole.translate(str.maketrans(marks))}</p>"
    # a line can break after a formula; a no-break space would then begin the next line
    assert "</span> counts.</p>" in pages.marked("Only $a + b$ counts.")


def words_of(slide):
    """Return the number of words without the heading; a formula in a sentence is one word."""
    text = re.sub(r"^###.*|\$\$[\s\S]*?\$\$", " ", "\n\n".join(slide.parts), flags=re.M)
    text = re.sub(r"^[-*] |<[^>]*>", " ", re.sub(r"\$[^$]*\$", " x ", text), flags=re.M)
    return len(re.findall(r"\w[\w’'.,-]*", text))


def most_words(slide):
    """Return the largest number of words that the rules allow on a slide."""
    if slide.kind in ("poll", "verdict"):
        return 35
    if slide.title == "Recap":
        return 120
    if slide.picture.startswith("<img"):
        return 30 if slide.aspect > pages.WIDE else 40
    return 52


@pytest.mark.parametrize("path", LESSONS, ids=lambda path: path.stem[:2])
def test_lessons_follow_the_rules_for_authors(path):
    shown = deck_of(path).shown
    assert len(shown) > 8
    verdicts = [slide for slide in shown if slide.kind == "verdict"]
    assert [slide.poll for slide in verdicts] == [s.poll for s in shown if s.kind == "poll"]
    for slide in verdicts:
        assert slide.right in slide.options
        assert {*slide.ideas} == {*slide.options}
    for slide in shown:
        words = "".join(slide.parts)
        assert words_of(slide) <= most_words(slide), slide
        assert words.count("$$") <= 6, slide
        assert slide.picture or "*Look for" not in words, slide
        assert "array(" not in words
        if slide.kind == "plain" and slide.title != "Recap":  # a heading of at most ten words
            assert re.match(r"### (?:\S+ ?){1,10}(\n|$)", words), slide


def plain(tex):
    """Return TeX without the commands that change only its look."""
    looks = "begin{aligned}", "end{aligned}", "bigl", "bigr", "Bigl", "Bigr", "left", "right"
    looks = "|".join(map(re.escape, (*looks, "qquad", "quad", *",;:! ")))
    return re.sub(rf"\\(?:{looks})|[\s&{{}}]", "", tex).rstrip(".,;")


def pieces(formula):
    """Split a formula at equals signs, gaps, line breaks, and the entries of its matrices."""
    parts = re.split(r"\\q?quad|=|\\\\|&|\\(?:begin|end){pmatrix}", formula)
    return [part for part in parts if part.strip()]


@pytest.mark.parametrize("path", LESSONS, ids=lambda path: path.stem[:2])
def test_every_number_and_formula_on_a_slide_is_in_its_section(path):
    lesson = nbformat.read(path, as_version=4).cells
    sketches = path.parent / "slides" / f"{path.name[:2]}.svg"
    texts = texts_of(sketches.with_suffix(".md"), [cell.id for cell in lesson])
    starts = [k for k, cell in enumerate(lesson) if cell.source.startswith("## ")]
    for first, last in pairwise([0, *starts, len(lesson)]):
        cells = lesson[first:last]
        outputs = [o for cell in cells for o in cell.get("outputs", [])]
        printed = "".join(o.get("text") or o.get("data", {}).get("text/plain", "") for o in outputs)
        source = "\n".join(cell.source for cell in cells) + printed
        known = plain(source)
        for cell in cells:
            slide = texts.get(cell.id, "")
            names = re.findall(r"!\[\]\((\w+)\)", slide)
            drawn = "".join(sketch_of(sketches, name)[0] for name in names)
            slide = re.sub(r"!\[\]\([^)]*\)", "", slide)
            for formula in re.findall(r"\$\$?([^$]+)\$\$?", slide):
                parts = [formula] if plain(formula) in known else pieces(formula)
                assert all(plain(part) in known for part in parts), formula
            words = re.sub(r"\$\$?[^$]+\$\$?", " ", slide) + re.sub("<[^>]*>", " ", drawn)
            for number in re.findall(r"(?<![\w.])\d[\d,.]*(?:e-\d+)?", words):
                assert number.rstrip(".,") in source, (cell.id, number)
