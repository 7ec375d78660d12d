"""Test every slide of the book, opened as files: keys, votes, notes and PDF."""

import re
import subprocess
import sys
from itertools import groupby
from pathlib import Path

import nbformat
import pytest
from pages import watched
from playwright.sync_api import expect
from quick import quick_for
from servers import serving

from rbclassroom.lecture.deck import write
from rbclassroom.lecture.slides import deck_of
from rbcourse.draw.save import SHOWN

ROOT = Path(__file__).parents[3]
LESSONS = sorted((ROOT / "notebooks").glob("[0-9][0-9]_*.ipynb"))
FAULTS, FORMULAS = (
    Path(__file__).with_name(f"{name}.js").read_text(encoding="utf-8")
    for name in ("faults", "formulas")
)
PICTURES = """() => [...document.querySelectorAll(".slides section section")]
  .flatMap((section, i) => [...section.querySelectorAll("figure > img")].map((image) => [
    i + 1, image.alt, image.naturalWidth]))"""
# Move each slider, and return the labels of those that do not work: the value beside them, or the
# picture, stays the same.
DEAD = """() => [...sections].flatMap((section) => {
  Reveal.slide(...Object.values(Reveal.getIndices(section)));
  return [...section.querySelectorAll("input[type=range]")].filter((slider) => {
    const output = slider.parentElement.querySelector("output"), before = output.textContent;
    const canvas = section.querySelector("canvas"), picture = canvas.toDataURL();
    slider.value = +slider.value === +slider.max ? 0 : slider.max;
    slider.dispatchEvent(new Event("input", { bubbles: true }));
    const same = output.textContent === before || canvas.toDataURL() === picture;
    // the belt is untwisted only after a turn by 720°
    return same && slider.ariaLabel !== "untwist (0 to 1)";
  }).map((slider) => `slider ${slider.ariaLabel}`);
})"""
HERE = "() => Reveal.getCurrentSlide().innerText"
SLIDE = "section.present > section.present"


def saved_inches():
    """Return the width of each still figure in inches, by its description."""
    found = {}
    for path in LESSONS:
        for cell in nbformat.read(path, as_version=4).cells:
            for output in cell.get("outputs", []):
                data = output.get("data", {})
                _, _, alt = data.get("text/plain", "").partition(": ")
                if width := re.search(r'<figure><img width="(\d+)"', data.get("text/html", "")):
                    found[alt] = int(width[1]) / SHOWN
    return found


INCHES = saved_inches()


def opened(page, address):
    """Open slides and wait until they are laid out."""
    page.goto(address)
    page.wait_for_function("document.documentElement.dataset.ready")
    return page


@pytest.fixture
def of(book):
    """Return a function that gives the address of a deck."""
    return lambda path: (book / "slides" / f"{path.stem}.html").as_uri()


@pytest.mark.parametrize(
    ("size", "key"),
    [
        pytest.param((1920, 1080), None, id="light"),
        pytest.param((1280, 720), "d", id="dark", marks=pytest.mark.slow),
    ],
)
@pytest.mark.parametrize("path", quick_for(["06"], LESSONS))
def test_every_slide_fits_and_is_legible_from_the_last_row(page, of, path, size, key):
    page.set_viewport_size(dict(zip(("width", "height"), size, strict=True)))
    opened(page, of(path))
    if key:
        page.keyboard.press(key)
    pictures = page.evaluate(PICTURES)
    faults, thin, widths = page.evaluate(FAULTS)
    for width in (1280, 1920, 3840):
        page.set_viewport_size({"width": width, "height": width * 9 // 16})
        page.wait_for_function(f"Math.abs(Reveal.getScale() - {width} / 1920) < 0.01")
        faults += [f"{width} pixels, slide {fault}" for fault in page.evaluate(FORMULAS)]
    faults += page.evaluate(DEAD)
    assert faults == []
    assert len(thin) <= 3, thin
    for number, alt, pixels in pictures:  # the smallest letters have 13.5 points
        inches = INCHES.get(alt, pixels / 200)
        letters = 13.5 / 72 * widths[str(number)] / inches
        assert letters > 0.025 * 1080, (number, alt, letters)


def test_decks_are_small_enough_for_mail(book):
    slides = book / "slides"
    decks = [path for path in slides.glob("*.html") if not path.stem.endswith("_crib")]
    assert {path.stem for path in decks} == {path.stem for path in LESSONS}
    assert max(path.stat().st_size for path in decks) < 1.2e6
    shared = [*(slides / "shared").iterdir(), book / "_static" / "tex-svg.js"]
    assert sum(path.stat().st_size for path in shared) < 2.6e6


@pytest.fixture
def deck(page, of):
    """Return the slides of lesson 06."""
    page.set_viewport_size({"width": 1280, "height": 720})
    return opened(page, of(LESSONS[6]))


def until(page, selector, key="PageDown"):
    """Press a key until the wanted slide is shown."""
    for _ in range(150):
        if page.evaluate("(what) => Reveal.getCurrentSlide().matches(what)", selector):
            return
        page.keyboard.press(key)
        page.wait_for_function(
            "!Reveal.getCurrentSlide().querySelector('figure > :is(script, img[data-read])')"
        )
    raise AssertionError(f"no slide {selector}")


def test_a_remote_control_goes_through_all_steps(deck, of):
    seen, steps = [], 0
    until(deck, ":has(.panel input)")
    slider = deck.locator(f"{SLIDE} .panel input").first
    slider.focus()
    at = slider.input_value()
    here = deck.evaluate(HERE)
    deck.keyboard.press("ArrowRight")
    assert slider.input_value() != at
    assert deck.evaluate(HERE).partition("\n")[0] == here.partition("\n")[0]
    deck.keyboard.press("PageDown")
    assert deck.locator(f"{SLIDE} .panel input").count() == 0
    opened(deck, of(LESSONS[6]))
    while not deck.evaluate("Reveal.getCurrentSlide().matches('.end')"):
        seen.append(deck.evaluate("Reveal.getCurrentSlide().className"))
        deck.keyboard.press("PageDown")
        steps += 1
        assert steps < 150
    lesson = deck_of(LESSONS[6])
    assert steps >= len(lesson.shown) + 20
    number, bar = deck.locator(".slide-number"), deck.locator("#bar")
    for text in f"{len(lesson.shown)} / {len(lesson.shown)}", "end + 1":
        expect(number).to_have_text(text)
        done = bar.locator("i").evaluate_all("(parts) => parts.map(({ style }) => style.cssText)")
        assert len(done) == len([*groupby(slide.title for slide in lesson.shown)])
        assert min(float(part.split("--done:")[1].strip(" ;%")) for part in done) >= 100
        deck.keyboard.press("e")
    deck.keyboard.press("e")
    assert "Exercise\N{NO-BREAK SPACE}1" in deck.evaluate(HERE)
    deck.keyboard.press("e")
    assert "Recap" in deck.evaluate(HERE)


def test_the_dark_scheme_is_never_automatic(page, of):
    page.emulate_media(color_scheme="dark")
    opened(page, of(LESSONS[6]))
    colour = "getComputedStyle(document.body).backgroundColor"
    assert page.evaluate(colour) == "rgb(255, 255, 255)"
    page.keyboard.press("d")
    assert page.evaluate(colour) == "rgb(22, 24, 28)"
    page.keyboard.press("d")
    expect(page.locator("html")).not_to_have_class(re.compile("dark"))
    page.keyboard.press("?")
    keys = "Open or close a vote", "Dark or light", "After the end", "Readouts", "overview"
    for words in keys:
        expect(page.locator(".r-overlay-help")).to_contain_text(words)
    page.keyboard.press("Escape")
    until(page, ":has(.panel input)")
    table = page.locator(f"{SLIDE} .panel table")
    expect(table).to_be_hidden()
    page.keyboard.press("r")
    expect(table).to_be_visible()
    page.keyboard.press("r")
    time = page.locator(f"{SLIDE} .panel input").last
    before = time.input_value()
    page.keyboard.press("m")
    expect(time).not_to_have_value(before)
    page.keyboard.press("m")
    until(page, ".verdict")
    until(page, ":has(.panel input)", "PageUp")
    expect(table).to_be_visible()  # the vote is over, so the table is shown


def speaker_view(page, context):
    """Open the speaker view with the key S, and return it when its slide is shown."""
    with context.expect_page() as found:
        page.keyboard.press("s")
    frame = found.value.frame_locator("#current-slide iframe")
    frame.locator("html[data-ready]").wait_for()
    return found.value, frame


def test_the_poll_and_its_verdict_show_the_votes_of_phones(context, home):
    course, env = home
    words = ["rbclassroom.lecture.serve", "06", "--no-browser", "--votes", "127.0.0.1"]
    pattern = r"http://127\.0\.0\.1:\d+/slides/\S+"
    with serving(words, course, env, pattern) as address, watched(context) as page:
        opened(page, address[0])
        page.keyboard.press("t")  # this slide has no poll
        until(page, ".poll")
        page.keyboard.press("t")
        panel = page.locator("#vote")
        expect(panel.locator("svg")).to_be_visible()
        for idea in page.locator(f"{SLIDE} .idea").all():
            expect(idea).to_be_hidden()
        url = "http://" + panel.locator("div").first.inner_text()
        options = page.locator(f"{SLIDE} .option > div").all_inner_texts()
        for letters in ("B", "AC", "C"):
            phone = context.browser.new_context().new_page()
            phone.goto(url)
            for letter in letters:
                phone.get_by_role("button", name=options["ABCD".index(letter)]).click()
            expect(phone.locator("p").nth(1)).to_contain_text(f"You voted {letters[-1]}.")
            phone.context.close()
        expect(panel).to_contain_text("3 votes")
        speaker, _ = speaker_view(page, context)
        speaker.keyboard.press("t")  # the vote is closed
        expect(panel).to_be_hidden()
        speaker.close()
        counts = ["0 · 0%", "1 · 33%", "2 · 67%", "0 · 0%"]
        for kind in (".poll", ".verdict"):
            until(page, kind)
            shown = page.locator(f"{SLIDE} .option")
            assert [each.get_attribute("data-count") for each in shown.all()] == counts
        here = "`#/${Reveal.getIndices().h}/${Reveal.getIndices().v}`"
        page.wait_for_function(f"location.hash.startsWith({here})")
        page.reload()
        page.wait_for_function("document.documentElement.dataset.ready")
        third = page.locator(f"{SLIDE} .option").nth(2)
        expect(third).to_have_attribute("data-count", counts[2])
        page.goto("about:blank")  # leave the page before the server ends


def test_the_speaker_view_shows_the_run_sheet_and_the_answers(deck, context):
    speaker, frame = speaker_view(deck, context)
    notes = speaker.locator(".speaker-controls-notes")
    expect(notes).to_contain_text(re.compile(r"Minute 0\W+\d+ · question, 1"))
    expect(notes).to_contain_text("Before class")
    before = deck.evaluate(HERE)
    while deck.evaluate(HERE) == before:  # the slides may not follow the speaker view yet
        speaker.keyboard.press("PageDown")
        speaker.wait_for_timeout(300)
    deck.evaluate("Reveal.slide(1, 0)")
    expect(notes).to_contain_text("Which column of")
    until(deck, ".poll")
    expect(notes).to_contain_text("Right: C.")
    expect(notes).to_contain_text(re.compile(r"Minute \d+\W+\d+ · poll 1"))
    expect(frame.locator(f"{SLIDE} h2")).to_contain_text("· Poll 1")
    speaker.close()


def test_each_printed_title_is_above_its_text(page, of):
    opened(page, of(LESSONS[6]) + "?print-pdf")
    page.locator(".pdf-page section h2").last.wait_for(state="attached")
    pairs = page.evaluate(
        """() => [...document.querySelectorAll(".pdf-page section:has(h2)")].map((section) =>
          ["h2", ".body"].map((part) => section.querySelector(part).getBoundingClientRect()))"""
    )
    assert len(pairs) > 20
    assert all(body["top"] >= title["bottom"] for title, body in pairs)


def test_slides_say_that_they_need_javascript(context, tmp_path):
    write({"tiny": deck_of(LESSONS[0])}, tmp_path)
    own = context.browser.new_context(java_script_enabled=False)
    page = own.new_page()
    page.goto((tmp_path / "tiny.html").as_uri())
    expect(page.locator("noscript h1")).to_be_visible()
    own.close()


def test_the_pdf_has_a_page_for_each_slide(home):
    course, env = home
    words = [sys.executable, "-m", "rbclassroom.lecture.serve", "06", "--pdf"]
    done = subprocess.run(words, cwd=course, env=env, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    content = (course / "06_geodesics.pdf").read_bytes()
    lesson = deck_of(LESSONS[6])
    slides = [*lesson.shown, *lesson.behind]
    assert len(re.findall(rb"/Type /Page\b(?!s)", content)) == len(slides)
    fonts = [
        x for x in content.split(b"endobj") if re.search(rb"/FontDescriptor\n|/Type /FontD", x)
    ]
    assert fonts
    loose = [each for each in fonts if b"/FontFile" not in each and b"/Type3" not in each]
    assert len(loose) <= content.count(b"/Subtype /Type3")  # their glyphs are drawings
