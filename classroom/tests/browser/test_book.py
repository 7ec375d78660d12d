"""The book as a reader opens it: files on a disk, no server, no network."""

import posixpath
import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest
from pixels import shown
from playwright.sync_api import expect

from rbclassroom.book import places

ROOT = Path(__file__).parents[3]
BOOK = ROOT / "book"
PAGES = sorted(path.relative_to(BOOK).as_posix() for path in BOOK.rglob("*.html"))
MOVED = [f"package/{name}.html" for name in places.MOVED]
LIVING = [name for name in PAGES if "<script>{" in (BOOK / name).read_text("utf-8")]

# formulas that were not set, and whether they were set wrongly
FORMULAS = """async () => {
  if (window.MathJax) await MathJax.startup.promise;
  const faults = [...document.querySelectorAll("mjx-merror")].map((e) => e.textContent);
  const text = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (text.nextNode()) {
    const node = text.currentNode;
    if (node.parentElement.closest("pre, code, script, style, noscript, mjx-container")) continue;
    if (/\\\\[([a-z]|\\$[^$]+\\$|\\]\\(/.test(node.data)) faults.push(node.data.slice(0, 80));
  }
  return faults;
}"""


class Page(HTMLParser):
    """The anchors of a page, where it points to, and what it loads."""

    def __init__(self, name):
        super().__init__()
        self.anchors, self.links, self.loaded, self.opened = set(), [], [], []
        self.feed((BOOK / name).read_text("utf-8"))

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        self.anchors.add(given.get("id"))
        if tag == "a" and "href" in given:
            self.links.append(given["href"])
        elif "src" in given:
            self.loaded.append(given["src"])
        elif tag == "link" and given.get("rel") in ("stylesheet", "icon"):
            self.loaded.append(given["href"])
        if tag == "details" and "open" in given:
            self.opened.append(given)


@pytest.fixture(scope="session")
def parsed():
    return {name: Page(name) for name in PAGES}


def test_the_book_is_there():
    assert {"index.html", "ledger.html", "lessons/06_geodesics.html"} <= set(PAGES)
    assert len(LIVING) >= 14


def test_every_link_leads_somewhere(parsed):
    broken = []
    for name, page in parsed.items():
        for target in {*page.links, *page.loaded}:
            parts = urlsplit(target)
            if parts.scheme in ("data", "https", "mailto"):
                continue
            path = posixpath.normpath(posixpath.join(posixpath.dirname(name), unquote(parts.path)))
            there = parsed.get(path if parts.path else name)
            anchor = unquote(parts.fragment)
            if not (anchor in there.anchors if anchor else there or (BOOK / path).is_file()):
                broken.append(f"{name}: {target}")
    assert broken == []


def test_nothing_is_loaded_from_elsewhere_and_all_answers_are_closed(parsed):
    for name, page in parsed.items():
        assert page.opened == [], name
        assert not any(source.startswith(("http", "//")) for source in page.loaded), name


def test_it_is_small_enough_to_be_carried():
    assert sum(path.stat().st_size for path in BOOK.rglob("*") if path.is_file()) < 30e6


def test_it_is_the_same_each_time(tmp_path):
    code = "import sys; from pathlib import Path; from rbclassroom.book.build import build; "
    code += "build(Path(), Path(sys.argv[1]))"
    again = tmp_path / "book"
    subprocess.run([sys.executable, "-c", code, str(again)], cwd=ROOT, check=True)
    files = {path.relative_to(again) for path in again.rglob("*") if path.is_file()}
    assert files == {path.relative_to(BOOK) for path in BOOK.rglob("*") if path.is_file()}
    assert [x for x in files if (again / x).read_bytes() != (BOOK / x).read_bytes()] == []


def test_a_page_that_moved_leads_to_its_new_address(page):
    assert len(MOVED) >= 20
    for name in MOVED:
        page.goto((BOOK / name).as_uri())
        expect(page).not_to_have_url((BOOK / name).as_uri())
        expect(page).not_to_have_title(re.compile("^(Moved)?$"))


@pytest.mark.parametrize("folder", sorted({name.rpartition("/")[0] for name in PAGES}))
def test_pages_show_all_they_have_on_every_screen(folder, page):
    """Light and dark, on a desk and on a phone."""
    wide = "document.documentElement.scrollWidth - document.documentElement.clientWidth"
    for name in PAGES:
        if name in MOVED or name.rpartition("/")[0] != folder:
            continue
        page.goto((BOOK / name).as_uri())
        assert page.evaluate(FORMULAS) == [], name
        for scheme in ("dark", "light"):
            page.emulate_media(color_scheme=scheme)
            for width in (390, 1280):
                page.set_viewport_size({"width": width, "height": 800})
                assert page.evaluate(wide) == 0, (name, width, scheme)


@pytest.mark.parametrize("name", LIVING)
def test_keys_and_pointer_move_what_lives(name, page):
    page.goto((BOOK / name).as_uri())
    figures = page.locator("figure:has(script)")
    assert figures.count()
    for figure in figures.all():
        canvas = figure.locator("canvas")
        canvas.wait_for(state="attached")
        for answer in figure.locator("xpath=ancestor::details").all():
            answer.evaluate("(answer) => { answer.open = true; }")
        canvas.scroll_into_view_if_needed()
        sliders = figure.locator("input").all()
        assert sliders or figure.locator(".rbcourse-view").count()
        for slider in reversed(sliders):
            box = slider.bounding_box()
            page.mouse.click(box["x"] + 1, box["y"] + box["height"] / 2)
            low = slider.get_attribute("aria-valuetext"), shown(canvas)
            page.keyboard.press("End")
            assert slider.get_attribute("aria-valuetext") != low[0]
            assert shown(canvas) != low[1]
            slider.fill(str(round(0.6 * float(slider.get_attribute("max")))))
        if figure.locator(".rbcourse-view").count():
            before = shown(canvas)
            canvas.press("ArrowLeft")
            turned = shown(canvas)
            assert turned != before
            box = canvas.bounding_box()
            page.mouse.move(box["x"] + 80, box["y"] + 80)
            page.mouse.down()
            page.mouse.move(box["x"] + 130, box["y"] + 80)
            page.mouse.up()
            assert shown(canvas) != turned


@pytest.mark.parametrize(
    ("words", "wanted"),
    [
        ("geodesic", "lessons/06_geodesics.html"),
        ("Slerp", "lessons/06_geodesics.html"),
        ("BK (16)", "ledger.html"),
        ("project_so", "package/projection.html#rbcourse.projection.project_so"),
    ],
)
def test_search_finds(words, wanted, page):
    page.goto((BOOK / "index.html").as_uri())
    page.get_by_role("textbox", name="Search").fill(words)
    page.keyboard.press("Enter")
    page.locator("#search-results li").first.wait_for()
    page.get_by_text(re.compile("Search finished|found")).first.wait_for()
    links = page.locator("#search-results li a").evaluate_all("(all) => all.map((a) => a.href)")
    there = [
        link.partition("/book/")[2].partition("?")[0] + "#" + link.partition("#")[2]
        for link in links
    ]
    assert any(link.startswith(wanted) for link in there[:10]), there[:10]


def test_the_ledger_is_filtered(page):
    page.goto((BOOK / "ledger.html").as_uri())
    rows = page.locator("table.ledger tbody tr:visible")
    every = rows.count()
    page.locator("#filter").fill("bk (16) 06")
    assert 0 < rows.count() < every
    assert rows.first.locator("#bk-eq-16").count() == 1
    page.locator("#filter").fill("BK 3")
    assert rows.locator("a.row").all_inner_texts() == ["BK 3"]
    page.locator("#filter").fill("Figure 5")
    assert rows.locator("a.row").all_inner_texts() == ["BK Fig. 5", "RR Fig. 5"]
    page.locator("#filter").fill("nothing has this")
    assert rows.count() == 0
    assert page.locator("#found").inner_text() == f"0 of {every} rows"
