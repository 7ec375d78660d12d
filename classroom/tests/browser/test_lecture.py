"""Every lesson in the lecture view: large letters, question and explorer on one screen."""

import re
from contextlib import ExitStack

import pytest
from pages import SEEN, move_every_control, wait_for
from playwright.sync_api import expect
from servers import serving

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


@pytest.fixture
def show(home, page):
    """Show a lesson as a lecturer does: ``show("02")`` returns its explorer."""
    course, env = home
    with ExitStack() as stack:

        def shown(number, *further):
            words = ["rbclassroom.course.show", number, "--no-browser", *further]
            address = r"(http://127\.0\.0\.1:\d+/\?token=\w+)"
            page.set_viewport_size({"width": 1024, "height": 768})
            page.goto(stack.enter_context(serving(words, course, env, address))[1])
            explorer = wait_for(page.locator(".rbcourse-explorer"))
            page.locator("mjx-container").first.wait_for()
            page.wait_for_function(TYPESET)
            return explorer

        yield shown
        page.goto("about:blank")  # before the server ends


def test_a_lesson_can_be_shown_to_a_class(lesson, show, page, pictures):
    explorer = show(lesson[:2])
    assert not page.evaluate(SEEN)
    assert not page.evaluate(SMALL, 24)
    assert page.evaluate("document.documentElement.scrollWidth") <= 1024
    if lesson[:2] != "00":
        look_at_question_and_explorer(page, explorer)
    move_every_control(explorer)
    assert not page.evaluate(SEEN)
    pictures(f"lecture_{lesson}", lambda: to_question(page))


WHOLE = """() => {
  const top = document.querySelector(".lecture-above").getBoundingClientRect().bottom;
  const bottom = document.querySelector(".lecture-below").getBoundingClientRect().top;
  const parts = "h1, h2, h3, p, li, table, pre, figure, .rbcourse-explorer";
  window.seen ??= new Set();
  const all = [...document.querySelectorAll("#rendered_cells :is(" + parts + ")")]
    .filter((part) => part.checkVisibility() && part.getBoundingClientRect().height);
  for (const part of all) {
    const box = part.getBoundingClientRect();
    if (box.top > top - 2 && box.bottom < bottom + 2) seen.add(part);
  }
  return all.filter((part) => !seen.has(part)).map((part) => part.innerText.slice(0, 60));
}"""


# a busy machine: the renderer of widgets looks for one every 100 ms, here only once in two seconds
LATE = """() => {
  const soon = window.setTimeout;
  window.setTimeout = (todo, ms, ...rest) => soon(todo, ms === 100 ? 2500 : ms, ...rest);
}"""


def test_widgets_are_shown_however_seldom_their_renderer_looks(show, page):
    page.add_init_script(f"({LATE})()")
    show("01")
    assert "model not found" not in page.inner_text("#rendered_cells")


@pytest.mark.parametrize("number", ["02", "13"])
def test_the_keys_of_a_remote_control_turn_the_pages(number, show, page):
    show(number)
    places, unseen = [], None
    while len(places) < 60 and (len(places) < 2 or places[-1] != places[-2]):
        if len(places) == 4:
            handle = page.locator(".noUi-handle").first  # as after the mouse was there
            handle.evaluate("(handle) => handle.focus({ preventScroll: true })")
        unseen = page.evaluate(WHOLE)
        places.append(page.evaluate("scrollY"))
        page.keyboard.press("PageDown")
    assert len(places) > 15
    assert unseen == []  # everything was whole on some page
    for _ in range(60):
        page.keyboard.press("PageUp")
    assert page.evaluate("scrollY") < 20
    to_poll("Poll 2", page, page)
    page.keyboard.press("Enter")
    answer = page.locator(".lecture-answer").nth(1)
    assert answer.evaluate("(answer) => answer.open")


def test_who_scrolls_by_hand_sees_the_lesson_without_pages(show, page):
    show("02")
    page.keyboard.press("PageDown")
    cover = "document.querySelector('.lecture-below').getBoundingClientRect().height"
    page.wait_for_function(f"{cover} > 0")
    page.mouse.move(300, 300)
    page.mouse.wheel(0, 200)
    page.wait_for_function(f"{cover} === 0")
    page.keyboard.press("PageUp")
    page.wait_for_function(f"{cover} > 0")


def test_a_closed_answer_shows_nothing_of_what_follows(show, page):
    show("06")
    height = page.viewport_size["height"]
    gaps = page.evaluate(
        """() => [...document.querySelectorAll(".lecture-answer:not([open])")].map((answer) => {
            const after = [...document.querySelectorAll("#rendered_cells .jp-Cell")].find((cell) =>
                answer.compareDocumentPosition(cell) & Node.DOCUMENT_POSITION_FOLLOWING &&
                !answer.contains(cell) && cell.getBoundingClientRect().height);
            return after ? after.getBoundingClientRect().top -
                answer.getBoundingClientRect().bottom : 1e9;
        })"""
    )
    assert len(gaps) > 3
    assert min(gaps) >= height
    assert page.locator(".jp-InputArea .highlight:visible").count() == 0  # no code
    assert "def geodesic_so3" not in page.inner_text("#rendered_cells")


def test_letters_grow_with_the_window_and_keys_change_the_look(show, page):
    show("06")
    for height in (720, 1080):
        page.set_viewport_size({"width": height * 16 // 9, "height": height})
        assert not page.evaluate(SMALL, 0.022 * height)
    for key, name in {"b": "lecture-blank", "d": "lecture-dark"}.items():
        for there in (True, False):
            page.keyboard.press(key)
            assert (name in page.evaluate("document.documentElement.className")) is there
    for _ in range(4):
        page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowLeft")
    place = page.locator(".lecture-place")
    told = place.inner_text()
    assert re.fullmatch(r"[2-9] / \d\d", told)
    where = "() => document.querySelectorAll('#rendered_cells h2')[2].getBoundingClientRect().top"
    before = page.evaluate(where)
    page.reload()
    wait_for(page.locator(".rbcourse-explorer"))
    page.locator("mjx-container").first.wait_for()
    page.wait_for_function(TYPESET)
    expect(place).to_have_text(told)
    page.wait_for_function(f"Math.abs(({where})() - ({before})) < 3")


def test_where_python_has_ended_the_controls_say_so(show, page):
    show("06")
    page.evaluate(
        """() => {
            window.asked = fetch;
            window.fetch = async (address, ...more) => {
                if (String(address).includes("?token=")) throw new Error("no answer");
                return asked(address, ...more);
            };
        }"""
    )
    expect(page.locator(".lecture-gone .rbcourse-explorer")).to_be_visible()
    page.evaluate("window.fetch = asked")
    expect(page.locator(".lecture-gone")).to_have_count(0)


def test_the_lecturer_sees_in_a_second_window_what_the_class_does_not(show, page, context):
    show("06", "--votes", "127.0.0.1")
    assert not page.get_by_text("planned").count()
    assert "Run sheet" not in page.inner_text("#rendered_cells")
    with context.expect_page() as opened:
        page.keyboard.press("l")
    lecturer = opened.value
    to_poll("Poll 1", page, lecturer)
    expect(lecturer.locator("#now")).to_have_text("Poll 1")
    expect(lecturer.locator("#next")).to_have_text("Next: 6 · Why: a chord and its arc")
    expect(lecturer.locator("#answer")).to_contain_text("C it is")
    expect(lecturer.locator("#sheet tr.now td").nth(1)).to_have_text("poll 1")
    expect(lecturer.locator("#plan")).to_have_text("planned: minute 14 to 21")
    expect(lecturer.locator("#clock")).to_have_text(re.compile(r"\d+:\d\d"))
    assert lecturer.locator("#answer math").count()  # formulas, too

    expect(lecturer.locator("#vote")).to_have_text("V opens the vote on a poll.")
    lecturer.locator("#vote").click()
    panel, counted = page.locator(".lecture-vote"), page.locator(".lecture-counted")
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
    page.keyboard.press("v")
    expect(panel).to_have_count(0)
    shares = ["0 · 0%", "1 · 33%", "2 · 67%", "0 · 0%"]
    for again in (False, True):
        if again:
            page.reload()
        expect(counted).to_have_count(4)
        assert [item.get_attribute("data-count") for item in counted.all()] == shares
    for _ in "vv":  # by mistake
        page.keyboard.press("v")
    expect(panel).to_be_visible()
    page.wait_for_timeout(1500)
    assert panel.is_visible()
    lecturer.close()


def to_poll(name, page, window):
    """Turn the pages, with the keys of a window, until a poll is there."""
    for _ in range(60):
        if page.evaluate("window.lecture.tell().name") == name:
            return
        window.keyboard.press("PageDown")
    raise AssertionError(f"{name} was not reached")


def to_question(page):
    """Scroll to the last heading before the explorer."""
    return page.evaluate(
        """() => {
            const explorer = document.querySelector(".rbcourse-explorer");
            const before = [...document.querySelectorAll("h1, h2, h3")].filter((heading) =>
                heading.compareDocumentPosition(explorer) & Node.DOCUMENT_POSITION_FOLLOWING);
            const heading = before.at(-1);
            heading.scrollIntoView();
            return heading.innerText;
        }"""
    )


def look_at_question_and_explorer(page, explorer):
    assert re.match(r"Poll \d", to_question(page))
    for part in ("canvas", ".rbcourse-panel"):
        box = explorer.locator(part).bounding_box()
        assert 0 <= box["x"] <= box["x"] + box["width"] <= 1024
        assert 0 <= box["y"] <= box["y"] + box["height"] <= 768
    view = explorer.locator(".rbcourse-view")
    if view.count():  # what is in space can be turned by buttons that come with the pointer
        expect(view).to_have_css("opacity", "0")
        explorer.locator("canvas").hover()
        expect(view).to_have_css("opacity", "1")
        row, picture = view.bounding_box(), explorer.locator("canvas").bounding_box()
        assert abs(row["x"] - picture["x"]) < 2
        assert picture["y"] < row["y"] < row["y"] + row["height"] <= 768
    # so that letters have 18 px
    assert explorer.locator("canvas").bounding_box()["width"] == pytest.approx(560, abs=1)
