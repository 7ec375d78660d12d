"""The lecture view: large letters, pages, votes; of every lesson, its question and explorer."""

import re
from contextlib import contextmanager

import nbformat
import pytest
from pages import SEEN, move_every_control, wait_for, watched
from playwright.sync_api import expect
from servers import serving

# text that is smaller than `least` pixels; code and panels may have 5/6 of it
SMALL = """(least) => {
  const found = [];
  const walker = document.createTreeWalker(document.querySelector("#rendered_cells"), 4);
  while (walker.nextNode()) {
    const text = walker.currentNode, box = text.parentElement;
    const apart = "mjx-container, script, style, sup, sub, small, [hidden]";
    if (!text.textContent.trim() || box.closest(apart)) continue;
    const smaller = "pre, code, .rbcourse-panel, .rbcourse-view";
    const printed = box.closest(smaller) ? least * 5 / 6 : least;
    if (parseFloat(getComputedStyle(box).fontSize) < printed)
      found.push(getComputedStyle(box).fontSize + " " + text.textContent.trim().slice(0, 40));
  }
  return found;
}"""
TYPESET = """() => ![...document.querySelectorAll("#rendered_cells .jp-MarkdownOutput")]
    .some((cell) => /\\$[^$]+\\$/.test(cell.innerText))"""
# parts that were whole on no page so far; a table larger than a page is cut between its rows
UNSEEN = """() => {
  const top = document.querySelector(".lecture-above").getBoundingClientRect().bottom;
  const bottom = document.querySelector(".lecture-below").getBoundingClientRect().top;
  const parts = "h1, h2, h3, p, li, table, tr, pre, figure, .rbcourse-explorer";
  window.seen ??= new Set();
  const all = [...document.querySelectorAll("#rendered_cells :is(" + parts + ")")]
    .filter((part) => part.checkVisibility() && part.getBoundingClientRect().height)
    .filter((part) => part.tagName !== "TABLE" || part.offsetHeight < 0.98 * innerHeight);
  for (const part of all) {
    const box = part.getBoundingClientRect();
    if (box.top > top - 2 && box.bottom < bottom + 2) seen.add(part);
  }
  return all.filter((part) => !seen.has(part)).map((part) => part.innerText.slice(0, 60));
}"""
# from each closed answer to the next cell that is seen
GAPS = """() => [...document.querySelectorAll(".lecture-answer:not([open])")].map((answer) => {
  const after = [...document.querySelectorAll("#rendered_cells .jp-Cell")].find((cell) =>
    answer.compareDocumentPosition(cell) & Node.DOCUMENT_POSITION_FOLLOWING &&
    !answer.contains(cell) && cell.getBoundingClientRect().height);
  return after ? after.getBoundingClientRect().top - answer.getBoundingClientRect().bottom : 1e9;
})"""
# scroll to the last heading before an explorer, and return it
QUESTION = """(explorer) => {
  const heading = [...document.querySelectorAll("h1, h2, h3")].filter((heading) =>
    heading.compareDocumentPosition(explorer) & Node.DOCUMENT_POSITION_FOLLOWING).at(-1);
  heading.scrollIntoView();
  return heading.innerText;
}"""
# a busy machine: the renderer of widgets looks for one every 100 ms, here only once in 2.5 s
LATE = """(() => {
  const soon = window.setTimeout;
  window.setTimeout = (todo, ms, ...rest) => soon(todo, ms === 100 ? 2500 : ms, ...rest);
})()"""


@contextmanager
def shown(context, course, env, *words, script=""):
    """A page with a lesson as a lecturer shows it."""
    words = ["rbclassroom.course.show", *words, "--no-browser"]
    address = r"(http://127\.0\.0\.1:\d+/\?token=\w+)"
    with serving(words, course, env, address) as found, watched(context) as page:
        page.set_viewport_size({"width": 1024, "height": 768})
        page.add_init_script(script)
        page.goto(found[1])
        loaded(page)
        yield page
        page.goto("about:blank")  # before the server ends


def loaded(page):
    wait_for(page.locator(".rbcourse-explorer").last)
    page.locator("mjx-container").first.wait_for()
    page.wait_for_function(TYPESET)


@pytest.fixture(scope="module")
def screen(context, home):
    """Lesson 06 as the class sees it; phones may vote."""
    with shown(context, *home, "06", "--votes", "127.0.0.1") as page:
        yield page


def test_the_keys_of_a_remote_control_turn_the_pages(screen):
    places, unseen = [], None
    while len(places) < 60 and (len(places) < 2 or places[-1] != places[-2]):
        if len(places) == 4:
            handle = screen.locator(".noUi-handle").first  # as after the mouse was there
            handle.evaluate("(handle) => handle.focus({ preventScroll: true })")
        unseen = screen.evaluate(UNSEEN)
        places.append(screen.evaluate("scrollY"))
        screen.keyboard.press("PageDown")
    assert len(places) > 15
    assert unseen == []  # everything was whole on some page
    for _ in range(60):
        screen.keyboard.press("PageUp")
    assert screen.evaluate("scrollY") < 20
    turn_pages(screen, screen, "document.activeElement.matches('.lecture-answer > summary')")
    for there in (True, False):
        screen.keyboard.press("Enter")
        assert screen.evaluate("document.activeElement.parentElement.open") is there
    # who scrolls by hand sees the lesson without pages
    screen.evaluate("window.lecture.press('Home')")
    screen.keyboard.press("PageDown")
    cover = "document.querySelector('.lecture-below').getBoundingClientRect().height"
    screen.wait_for_function(f"{cover} > 0")
    screen.mouse.move(300, 300)
    screen.mouse.wheel(0, 200)
    screen.wait_for_function(f"{cover} === 0")
    screen.keyboard.press("PageUp")
    screen.wait_for_function(f"{cover} > 0")


def test_letters_grow_with_the_window_and_answers_and_code_are_not_seen(screen):
    assert screen.evaluate(SEEN) == []
    assert screen.evaluate("document.documentElement.scrollWidth") <= 1024
    assert screen.evaluate(SMALL, 24) == []
    for height in (720, 1080, 768):
        screen.set_viewport_size({"width": height * 4 // 3, "height": height})
        assert screen.evaluate(SMALL, 0.022 * height) == []
    gaps = screen.evaluate(GAPS)
    assert len(gaps) > 3
    assert min(gaps) >= 768
    assert screen.locator(".jp-InputArea .highlight:visible").count() == 0
    text = screen.inner_text("#rendered_cells")
    assert "def geodesic_so3" not in text
    assert "Run sheet" not in text
    assert "planned" not in text


def test_keys_change_the_look_and_the_place_is_kept_when_the_page_is_loaded_again(screen):
    for key, name in {"b": "lecture-blank", "d": "lecture-dark"}.items():
        for there in (True, False):
            screen.keyboard.press(key)
            assert (name in screen.evaluate("document.documentElement.className")) is there
    screen.evaluate("window.lecture.press('Home')")
    for _ in range(4):
        screen.keyboard.press("ArrowRight")
    screen.keyboard.press("ArrowLeft")
    place = screen.locator(".lecture-place")
    told = place.inner_text()
    assert re.fullmatch(r"[2-9] / \d\d", told)
    where = "() => document.querySelectorAll('#rendered_cells h2')[2].getBoundingClientRect().top"
    before = screen.evaluate(where)
    screen.reload()
    loaded(screen)
    expect(place).to_have_text(told)
    screen.wait_for_function(f"Math.abs(({where})() - ({before})) < 3")


def test_controls_move_the_explorer_and_say_so_where_python_has_ended(screen):
    move_every_control(screen.locator(".rbcourse-explorer"))
    assert screen.evaluate(SEEN) == []
    screen.evaluate(
        """() => {
            window.asked = fetch;
            window.fetch = async (address, ...more) => {
                if (String(address).includes("?token=")) throw new Error("no answer");
                return asked(address, ...more);
            };
        }"""
    )
    expect(screen.locator(".lecture-gone .rbcourse-explorer")).to_be_visible()
    screen.evaluate("window.fetch = asked")
    expect(screen.locator(".lecture-gone")).to_have_count(0)


def test_the_lecturer_sees_in_a_second_window_what_the_class_does_not(screen, context):
    with context.expect_page() as opened:
        screen.keyboard.press("l")
    lecturer = opened.value
    turn_pages(screen, lecturer, "window.lecture.tell().name === 'Poll 1'")
    expect(lecturer.locator("#now")).to_have_text("Poll 1")
    expect(lecturer.locator("#next")).to_have_text("Next: 6 · Why: a chord and its arc")
    expect(lecturer.locator("#answer")).to_contain_text("C it is")
    expect(lecturer.locator("#sheet tr.now td").nth(1)).to_have_text("poll 1")
    expect(lecturer.locator("#plan")).to_have_text("planned: minute 14 to 21")
    expect(lecturer.locator("#clock")).to_have_text(re.compile(r"\d+:\d\d"))
    assert lecturer.locator("#answer math").count()  # formulas, too

    expect(lecturer.locator("#vote")).to_have_text("V opens the vote on a poll.")
    lecturer.locator("#vote").click()
    panel, counted = screen.locator(".lecture-vote"), screen.locator(".lecture-counted")
    expect(panel.locator("svg")).to_be_visible()
    address = panel.locator("p").first.inner_text()
    for letters in ("B", "AC", "C"):
        phone = context.browser.new_context().new_page()
        phone.goto(address)
        for letter in letters:
            phone.get_by_role("button", name=letter, exact=True).click()
        expect(phone.locator("p").first).to_contain_text(f"You voted {letters[-1]}.")
        phone.context.close()
    expect(panel).to_contain_text("3 votes")
    assert counted.count() == 0
    screen.keyboard.press("v")
    expect(panel).to_have_count(0)
    for again in (False, True):
        if again:
            screen.reload()
        expect(counted).to_have_count(4)
        shares = [item.get_attribute("data-count") for item in counted.all()]
        assert shares == ["0 · 0%", "1 · 33%", "2 · 67%", "0 · 0%"]
    for _ in "vv":  # by mistake
        screen.keyboard.press("v")
    expect(panel).to_be_visible()
    for _ in range(2):
        with screen.expect_response(re.compile("/votes")):  # it asks again
            pass
    assert panel.is_visible()
    lecturer.close()


def turn_pages(page, window, until):
    """Turn the pages, from the first one, with the keys of a window, until something holds."""
    page.evaluate("window.lecture.press('Home')")
    for _ in range(60):
        if page.evaluate(until):
            return
        window.keyboard.press("PageDown")
    raise AssertionError(f"{until} on no page")


def test_every_question_stands_with_its_explorer_on_one_screen(context, home, tmp_path):
    """However seldom the renderer of widgets looks."""
    course, env = home
    parts, new = [], nbformat.v4.new_notebook
    for path in sorted((course / "notebooks").glob("[0-9][0-9]_*.ipynb"))[1:]:
        cells = nbformat.read(path, as_version=4).cells
        end = next(i for i, cell in enumerate(cells) if "_explorer()" in cell.source)
        headings = [i for i in range(end) if cells[i].source.startswith("#")]
        parts += cells[headings[-1] : end + 1]
    for number, cell in enumerate(parts):
        cell.id = f"cell-{number}"
    (tmp_path / "notebooks").mkdir()
    nbformat.write(new(cells=parts), tmp_path / "notebooks" / "01_all.ipynb")
    with shown(context, tmp_path, env, "01", script=LATE) as page:
        explorers = page.locator(".rbcourse-explorer").all()
        assert len(explorers) == 14
        for explorer in map(wait_for, explorers):
            assert re.match(r"Poll \d", explorer.evaluate(QUESTION))
            canvas, view = explorer.locator("canvas"), explorer.locator(".rbcourse-view")
            box = canvas.bounding_box()
            for each in (box, explorer.locator(".rbcourse-panel").bounding_box()):
                assert 0 <= each["x"] <= each["x"] + each["width"] <= 1024
                assert 0 <= each["y"] <= each["y"] + each["height"] <= 768
            assert box["width"] == pytest.approx(560, abs=1)  # so that letters have 18 px
            if view.count():  # a picture in space has buttons that appear with the pointer
                page.mouse.move(1020, 400)
                expect(view).to_have_css("opacity", "0")
                canvas.hover()
                expect(view).to_have_css("opacity", "1")
                row = view.bounding_box()
                assert abs(row["x"] - box["x"]) < 2
                assert box["y"] < row["y"] < row["y"] + row["height"] <= 768
        assert page.evaluate(SEEN) == []
        assert "model not found" not in page.inner_text("#rendered_cells")
