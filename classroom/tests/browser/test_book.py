"""Test the book as a reader opens it: from files, without a server or network."""

import posixpath
import re
import subprocess
import sys
from itertools import pairwise
from pathlib import Path
from urllib.parse import unquote, urlsplit

import lxml.html
import numpy as np
import pytest
from pages import pixels, shown, watched
from PIL import Image
from playwright.sync_api import expect
from quick import quick_for

ROOT = Path(__file__).parents[3]
LESSONS = sorted((ROOT / "notebooks").glob("[0-9][0-9]_*.ipynb"))
MEASURE = Path(__file__).with_name("measure.js").read_text("utf-8")
KINDS = [
    *("index.html", "ledger.html", "figures.html", "install.html", "search.html"),
    *("lessons/06_geodesics.html", "teach/06_geodesics.html", "teach/questions.html"),
    *("problems/ps1.html", "package/index.html", "package/so3.html", "code/rbcourse/so3.html"),
    *("lessons/index.html", "lessons/12_how_near_optimal.html", "near_optimal.html"),
]
QUICK = ["index.html", "lessons/06_geodesics.html", "package/so3.html"]


class Page:
    """The anchors, links, loaded files, formulas and faults of a page."""

    def __init__(self, path):
        text = path.read_text("utf-8")
        page = lxml.html.document_fromstring(text)
        self.anchors = set(page.xpath("//@id"))
        self.links = page.xpath("//a/@href")
        self.loaded = page.xpath("//@src | //link[@rel='stylesheet' or @rel='icon']/@href")
        math = page.find_class("math")
        self.formulas = [part.text_content() for part in math]
        apart = page.xpath("//pre | //code | //script | //style | //noscript")
        for part in [*math, *apart]:
            part.drop_tree()
        faults = {
            "no title": not page.findtext(".//title", "").strip(),
            "the path of this machine": str(ROOT) in text,
            "no description": page.xpath("//img[not(string(@alt) or @role='presentation')]/@src"),
            "an answer is open": page.xpath("//details[@open]"),
            "not set": re.findall(r".*(?:\\[a-z]|\$[^$]+\$|\]\().*", page.text_content()),
        }
        self.faults = {fault: found for fault, found in faults.items() if found}


@pytest.fixture(scope="module")
def parsed(book):
    return {path.relative_to(book).as_posix(): Page(path) for path in sorted(book.rglob("*.html"))}


@pytest.fixture(scope="module")
def lesson(context, book):
    """Return a page with lesson 06, which several tests share."""
    with watched(context) as page:
        page.goto((book / "lessons/06_geodesics.html").as_uri())
        yield page


def test_every_page_is_complete_and_every_link_has_a_target(parsed, book):
    assert set(KINDS) <= set(parsed)
    assert {name: page.faults for name, page in parsed.items() if page.faults} == {}
    broken = []
    for name, page in parsed.items():
        assert not any(source.startswith(("http", "//")) for source in page.loaded), name
        for target in {*page.links, *page.loaded}:
            parts = urlsplit(target)
            if parts.scheme in ("data", "https", "mailto"):
                continue
            path = posixpath.normpath(posixpath.join(posixpath.dirname(name), unquote(parts.path)))
            there = parsed.get(path if parts.path else name)
            anchor = unquote(parts.fragment)
            if not (anchor in there.anchors if anchor else there or (book / path).is_file()):
                broken.append(f"{name}: {target}")
    assert broken == []


def sizes(book):
    """Return the sizes of the slides, of Python in pages, and of all other files."""
    size = {path.relative_to(book): path.stat().st_size for path in book.rglob("*.*")}
    folders = "slides", "_static/live"
    slides, live = (sum(size[path] for path in size if path.is_relative_to(x)) for x in folders)
    return slides, live, sum(size.values()) - slides - live


def test_the_book_is_small(book):
    """A book with all states of its explorers is 3 MB larger."""
    assert np.less(sizes(book), [7e6, 45e6, 27e6]).all()


@pytest.mark.slow
def test_the_command_makes_a_small_book_with_the_same_bytes_each_time(tmp_path):
    book, again = ROOT / "book", tmp_path / "book"
    code = f"from rbclassroom.book.build import *; build(Path(), Path({str(again)!r}))"
    for words in (["-m", "rbclassroom.book.build", "--live"], ["-c", code]):
        subprocess.run([sys.executable, *words], cwd=ROOT, check=True)
    assert np.less(sizes(book), [7e6, 45e6, 30e6]).all()
    files = {path.relative_to(again) for path in again.rglob("*") if path.is_file()}
    live = re.compile(rb' tag_try-[\w-]+|\s*<[^>]*"\.\./_static/live/[^>]*>(?:</script>)?')
    there = {path.relative_to(book) for path in book.rglob("*") if path.is_file()}
    assert files == {path for path in there if not path.is_relative_to("_static/live")}
    # These may differ: the text above a problem set, the search index, and the list of the files.
    apart = {Path(f"problems/ps{k}.html") for k in range(1, 10)}
    apart |= {Path("_static/texts.js"), Path("searchindex.js"), Path("made-by-course.txt")}
    for path in files - apart:
        assert (again / path).read_bytes() == live.sub(b"", (book / path).read_bytes()), path


def test_all_formulas_of_the_book_can_be_typeset(parsed, book, page):
    formulas = sorted({formula for each in parsed.values() for formula in each.formulas})
    assert len(formulas) > 1000
    page.goto((book / "lessons/06_geodesics.html").as_uri())
    faults = page.evaluate(
        """async (formulas) => {
            await MathJax.startup.promise;
            const all = formulas.map((formula) => {
                const part = document.createElement("div");
                Object.assign(part, { className: "math", textContent: formula });
                return part;
            });
            document.querySelector("article").replaceChildren(...all);
            await MathJax.typesetPromise(all);
            const faults = "mjx-merror, [data-mjx-error]";
            const wrong = (part) => !part.querySelector("svg") || part.querySelector(faults);
            return formulas.filter((formula, i) => wrong(all[i]));
        }""",
        formulas,
    )
    assert faults == []


@pytest.mark.parametrize("name", quick_for(QUICK, KINDS))
def test_a_page_of_each_kind_is_readable_on_every_screen(name, book, page):
    """Nothing is cut, pale or overlapping, and lines have a moderate length."""
    page.goto((book / name).as_uri())
    page.evaluate("window.MathJax?.startup.promise")
    page.locator(".content details").evaluate_all("(all) => all.forEach((x) => { x.open = true; })")
    for width, scheme in ((390, "light"), (1280, "dark"), (1920, "light")):
        page.emulate_media(color_scheme=scheme)
        page.set_viewport_size({"width": width, "height": 800})
        page.evaluate("new Promise((done) => requestAnimationFrame(() => setTimeout(done)))")
        assert page.evaluate(MEASURE) == [], (width, scheme)


@pytest.mark.parametrize("path", quick_for(["01"], LESSONS))
def test_the_first_picture_of_a_lesson_is_visible_without_scrolling(path, book, page):
    page.goto((book / f"lessons/{path.stem}.html").as_uri())
    first = "document.querySelector('.content :is(canvas, img, .sketch)')"  # it may be replaced
    box = page.evaluate(f"{first}.getBoundingClientRect().toJSON()")
    assert box["height"] > 100
    assert box["y"] + box["height"] < 800


def test_a_poll_option_shows_only_its_own_explanation(lesson):
    """Test the mouse, the keys, and the names and states that screen readers use."""
    poll = lesson.get_by_role("group", name="Poll 1")
    ideas = poll.locator(".idea")
    assert poll.locator("summary").count() == ideas.count() == 4
    expect(poll.locator(".idea:visible")).to_have_count(0)
    for letter, said in {"B": "linear in, linear out", "C": "Right.", "D": "upside down"}.items():
        option = poll.locator("summary", has_text=re.compile(f"^\\s*{letter} "))
        option.focus()
        lesson.keyboard.press("Enter" if letter == "C" else "Space")
        expect(poll.locator("[open]")).to_have_count(1)
        expect(poll.locator(".idea:visible")).to_have_count(1)
        expect(poll.get_by_role("status").filter(visible=True, has_text=said)).to_have_count(1)
        assert not lesson.locator("#answer-to-poll-1").evaluate("(answer) => answer.open")
    option.click()
    expect(poll.locator(".idea:visible")).to_have_count(0)


def test_code_is_folded_until_the_reader_asks_for_it(lesson):
    code = lesson.locator(".cell_input pre")
    expect(code.locator("visible=true")).to_have_count(0)
    lesson.get_by_role("button", name="Show all code").press("Enter")
    assert code.locator("visible=true").count() > 15


def test_columns_of_a_figure_stand_one_below_another_on_a_phone(book, page):
    page.set_viewport_size({"width": 390, "height": 844})
    page.goto((book / "lessons/06_geodesics.html").as_uri())
    figure = page.locator("figure:has(.column)").first
    figure.scroll_into_view_if_needed()
    image = figure.locator("img").first
    cuts = [float(x) for x in image.get_attribute("data-cuts").split()]
    columns = figure.locator(".column").all()
    boxes = [each.bounding_box() for each in columns]
    assert len(boxes) == len(cuts) + 1
    assert max(box["width"] for box in boxes) == figure.bounding_box()["width"]
    for upper, lower in pairwise(boxes):
        assert lower["y"] >= upper["y"] + upper["height"] - 1
    path = book / "lessons" / image.get_attribute("src")
    whole = pixels(path.read_bytes())
    ends = np.round(np.array([0, *cuts, 1]) * whole.shape[1]).astype(int)
    for column, (left, right) in zip(columns, pairwise(ends), strict=True):
        seen = pixels(column.screenshot())
        part = Image.fromarray(whole[:, left:right].astype(np.uint8))
        want = np.asarray(part.resize(seen.shape[1::-1], Image.Resampling.BOX), int)
        assert np.abs(seen - want).mean() < 8


@pytest.mark.parametrize("motion", ["no-preference", "reduce"])
def test_the_picture_on_the_start_page_plays_once(motion, book, page):
    page.emulate_media(reduced_motion=motion)
    page.goto((book / "index.html").as_uri())
    hero = page.locator("figure.hero")
    time, play = hero.get_by_label("time t"), hero.get_by_role("button", name="play or pause")
    middle = str(int(time.get_attribute("max")) // 2)
    if motion == "no-preference":
        expect(play).to_have_text("❚❚")
        # the player first passes the middle, and later stops there
        expect(time).to_have_value(middle)
    expect(play).to_have_text("▶")
    if motion == "reduce":
        page.wait_for_timeout(1000)
    assert time.input_value() == middle
    expect(hero.locator("input:visible")).to_have_count(1)
    hero.get_by_text("More").click()
    expect(hero.locator("input:visible")).to_have_count(2)
    play.click()
    expect(play).to_have_text("❚❚")


def test_keys_move_interactive_pictures(lesson):
    figures = lesson.locator("figure:has(script)")
    assert figures.count()
    lesson.locator("details").evaluate_all("(all) => all.forEach((each) => { each.open = true; })")
    for figure in figures.all():
        canvas, slider = figure.locator("canvas"), figure.locator("input").last
        canvas.scroll_into_view_if_needed()
        before = shown(canvas)
        if slider.count():
            slider.press("End")
            slider.press("PageDown")
            assert shown(canvas) != before
        if figure.locator(".rbcourse-view").count():
            turned = shown(canvas)
            canvas.press("ArrowLeft")
            assert shown(canvas) != turned


def test_the_search_finds_lessons_and_functions(book, page):
    for words, wanted in {
        "Slerp": "lessons/06_geodesics.html",
        "BK (16)": "ledger.html",
        "project_so": "package/projection.html#rbcourse.project_so",
    }.items():
        page.goto((book / "index.html").as_uri())
        page.get_by_role("textbox", name="Search").fill(words)
        page.keyboard.press("Enter")
        page.locator("#search-results li").first.wait_for()
        page.get_by_text(re.compile("Search finished|found")).first.wait_for()
        links = page.locator("#search-results li a").evaluate_all("(all) => all.map((a) => a.href)")
        found = [re.sub(r".*/book/|\?[^#]*", "", link) for link in links[:10]]
        assert any(link.startswith(wanted) for link in found), found
        excerpt = page.locator("#search-results .excerpt").first
        assert len(excerpt.inner_text()) > 60


def test_the_filter_of_the_ledger_selects_rows(book, page):
    page.goto((book / "ledger.html").as_uri())
    rows, filter_ = page.locator("table.ledger tbody tr:visible"), page.locator("#filter")
    every = rows.count()
    filter_.fill("bk (16) 06")
    assert 0 < rows.count() < every
    assert rows.first.locator("#bk-eq-16").count() == 1
    filter_.fill("BK 3")
    assert rows.locator("a.row").all_inner_texts() == ["BK 3"]
    filter_.fill("Figure 5")
    assert rows.locator("a.row").all_inner_texts() == ["BK Fig. 5", "RR Fig. 5"]
    filter_.fill("nothing has this")
    assert rows.count() == 0
    assert page.locator("#found").inner_text() == f"0 of {every} rows"
