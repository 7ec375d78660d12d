"""Test JupyterLab: stored lessons, votes, running explorers, and originals."""

import html
import re
import shutil

import nbformat
import pytest
from pages import (
    FRAMES,
    IDLE,
    SEEN,
    check_alike,
    move_every_control,
    shown,
    wait_for,
    watched,
)
from playwright.sync_api import expect

from rbclassroom import explorers
from rbclassroom.course.notebooks import KERNEL

PANEL = "jupyterapp.shell.currentWidget"
DIRTY = f"{PANEL}.context.model.dirty"
OPEN = "async (path) => void (await jupyterapp.commands.execute('docmanager:open', { path }))"
# A function that tests whether all pictures with the given descriptions are shown, and no others.
WHOLE = """(wanted) => {
  const pictures = [...document.querySelectorAll(".jp-Cell figure :is(img, canvas)")];
  const found = pictures.filter((picture) => picture.complete ?? true)
    .map((picture) => picture.alt ?? picture.ariaLabel.replace(/ Seen from azimuth .*/, ""));
  return !document.body.innerText.includes("Loading widget")
    && !document.querySelector("img[data-read]")
    && [...new Set(found)].sort().join() === [...wanted].sort().join();
}"""
# A function that returns the class and height of each box with vertical scrolling.
SCROLLING = """(explorer) => [explorer, ...explorer.querySelectorAll("*")]
  .filter((box) => box.scrollHeight > box.clientHeight + 0.5)
  .filter((box) => ["auto", "scroll"].includes(getComputedStyle(box).overflowY))
  .map((box) => [box.className, box.scrollHeight, box.clientHeight])"""
# A function that stops a playing explorer. It runs in the page, where a slow test cannot delay it.
PAUSE = """async (explorer) => {
  const number = explorer.querySelector(".widget-readout");
  while (parseFloat(number.innerText) < 0.1) await new Promise(requestAnimationFrame);
  explorer.querySelector("button").click();
}"""
# A function that records when keys go down, and when the screen shows a new picture.
NOTE = """() => {
  window.keys = []; window.pictures = [];
  let frame = null;
  const show = () => { frame = null; pictures.push(performance.now()); };
  document.addEventListener("keydown", () => keys.push(performance.now()), true);
  document.addEventListener("drawn", () => { frame ??= requestAnimationFrame(show); });
}"""
WIDE = """async (canvas) => {
  const drawn = new Promise((done) => canvas.addEventListener("drawn", done));
  Object.assign(canvas.style, { width: "1120px", maxWidth: "none" });
  await drawn;
}"""
TIMES = "() => new Promise((done) => requestAnimationFrame(() => done([keys, pictures])))"
# Explorers that can be clicked, in the plane with a menu, and in space with buttons, and one that
# solves a problem for each picture. Each entry also has the place and the name of the slider that
# the test moves.
KINDS = {"arm": (1, "theta0"), "chain": (1, "duration"), "flip": (1, "off"), "cube": (2, "spin")}


@pytest.fixture(scope="module")
def page(context, lab):
    """Return a page with JupyterLab, which all tests of this module share."""
    with watched(context) as page:
        page.goto(lab)
        page.wait_for_function("window.jupyterapp")
        page.evaluate("jupyterapp.restored.then(() => true)")
        yield page


@pytest.fixture
def opened(home, page):
    """Return a function that opens a notebook of the folder work/, and returns its path."""

    def open_(name):
        page.evaluate(OPEN, name)
        page.wait_for_function(f"(path) => {PANEL}?.context?.path === path", arg=name)
        page.locator(".jp-NotebookPanel .jp-Cell").first.wait_for()
        page.get_by_text(IDLE).wait_for()
        return home[0] / "work" / name

    yield open_
    page.evaluate(f"void {PANEL}.dispose()")


@pytest.fixture
def running(home, opened, page):
    """Run explorers in a notebook, and return their elements."""
    cells = ["from rbclassroom import explorers"]
    cells += [f"explorers.{name}_explorer()" for name in KINDS]
    notebook = nbformat.v4.new_notebook(metadata={"kernelspec": KERNEL})
    notebook.cells = [nbformat.v4.new_code_cell(source) for source in cells]
    nbformat.write(notebook, home[0] / "work" / "explorers.ipynb")
    page.set_viewport_size({"width": 1280, "height": 5000})  # all explorers are in the window
    opened("explorers.ipynb")
    page.evaluate("jupyterapp.commands.execute('notebook:run-all-cells')")
    there = page.locator(".rbcourse-explorer")
    expect(there).to_have_count(len(KINDS))
    for element in there.all():
        wait_for(element)
    page.set_viewport_size({"width": 1280, "height": 800})
    return there.all()


def run_explorer(page, path):
    """Run only the explorer's cell, as the text on the still picture tells the reader to do."""
    cells = nbformat.read(path, as_version=4).cells
    number = next(i for i, cell in enumerate(cells) if "_explorer()" in cell.source)
    page.evaluate(f"{PANEL}.content.activeCellIndex = {number}")
    page.evaluate("jupyterapp.commands.execute('notebook:run-cell')")
    return wait_for(page.locator(".rbcourse-explorer"))


def descriptions(path):
    """Return the descriptions of the pictures that a lesson stores."""
    cells = nbformat.read(path, as_version=4).cells
    outputs = [output.get("data", {}) for cell in cells for output in cell.get("outputs", [])]
    text = "".join(data.get("text/html", "") for data in outputs)
    return sorted(set(map(html.unescape, re.findall(r'<img[^>]* alt="([^"]*)"', text))))


def test_a_stored_lesson_is_complete_and_its_explorer_works(opened, page):
    """Without a kernel, the explorer shows an error; reopened, the lesson has a still picture."""
    page.set_viewport_size({"width": 1280, "height": 30_000})  # all pictures are in the window
    path = opened("06_geodesics.ipynb")
    stored = descriptions(path)
    assert len(stored) > 3
    page.wait_for_function(WHOLE, arg=stored)
    assert page.evaluate(SEEN) == []
    assert not page.evaluate(DIRTY)

    explorer = run_explorer(page, path)
    explorer.locator(".noUi-handle").last.press("ArrowRight")
    explorer.locator("span[role=status]").wait_for(state="attached")
    assert explorer.evaluate(SCROLLING) == []

    page.evaluate(f"{PANEL}.sessionContext.shutdown()")
    explorer.locator(".noUi-handle").last.press("ArrowRight")
    explorer.get_by_role("alert").get_by_text("Python does not answer").wait_for()
    assert explorer.locator("tr").count() == 0
    page.evaluate(f"{PANEL}.context.save()")
    page.wait_for_function(f"!{DIRTY}")
    page.evaluate(f"void {PANEL}.dispose()")
    opened("06_geodesics.ipynb")
    page.wait_for_function(WHOLE, arg=stored)
    still = page.get_by_role("img", name=re.compile(r"^The line and its shadow\. θ\(t\): "))
    expect(still).to_have_js_property("tagName", "IMG")
    page.set_viewport_size({"width": 1280, "height": 800})


def test_a_vote_opens_the_answer_and_shift_enter_passes_it(opened, page):
    path = opened("01_plane.ipynb")
    ids = [cell.id for cell in nbformat.read(path, as_version=4).cells]
    state = f"""(place) => {{
      const notebook = {PANEL}.content;
      return [notebook.activeCellIndex, notebook.widgets[place].isHidden];
    }}"""
    closed = ids.index("cell-12")
    page.evaluate(f"{PANEL}.content.activeCellIndex = {ids.index('cell-01')}")
    page.evaluate("jupyterapp.commands.execute('notebook:run-cell')")
    page.get_by_text(IDLE).wait_for()
    page.evaluate(f"{PANEL}.content.activeCellIndex = {ids.index('vote-1')}")
    page.evaluate(f"{PANEL}.content.node.focus()")
    page.keyboard.press("Shift+Enter")  # runs the cell with the buttons
    votes = page.get_by_role("group", name="Your vote")
    votes.wait_for()
    assert votes.get_by_role("button").all_inner_texts() == ["A", "B", "C", "D"]
    page.keyboard.press("Shift+Enter")  # runs the heading of the answer
    page.wait_for_function(f"{PANEL}.content.activeCellIndex == {ids.index('cell-16')}")
    assert page.evaluate(state, closed) == [ids.index("cell-16"), True]
    votes.get_by_role("button", name="B").click()
    page.wait_for_function(f"!{PANEL}.content.widgets[{closed}].isHidden")
    assert votes.locator("[aria-pressed=true]").all_inner_texts() == ["B"]
    expect(votes).to_contain_text("You chose B; the answer is A.")
    votes.get_by_role("button", name="A").click()
    expect(votes).to_contain_text("A is right.")
    assert page.evaluate(state, ids.index("cell-28"))[1]  # the next answer is still closed


def settled(page, text):
    """Wait until the kernel is idle and no more pictures arrive; return the text."""
    now = None
    while now != (now := text.inner_text()):
        page.get_by_text(IDLE).wait_for()
        page.evaluate(FRAMES, 30)
    return now


def test_explorers_follow_keys_and_clicks(running, page):
    assert page.evaluate(SEEN) == []
    check_play_and_clicks(running[0], page)
    page.evaluate(NOTE)
    for (name, slider), element in zip(KINDS.items(), running, strict=True):
        explorer, canvas = getattr(explorers, f"{name}_explorer")(), element.locator("canvas")
        element.get_by_role("button", name="Reset").press("Enter")
        expect(canvas).to_have_attribute("aria-label", starting_with(explorer))
        style = canvas.get_attribute("style")
        canvas.evaluate(WIDE)
        want = explorer.draw(explorer.state().shown, zoom=2)
        check_alike(shown(canvas), want, explorer.background)
        canvas.evaluate("(canvas, style) => { canvas.style = style; }", style)
        keys, pictures = press(element, explorer, *slider, *["ArrowRight"] * 15)
        after = [picture - keys[-1] for picture in pictures if picture > keys[-1]]
        # at most three pictures follow the keys: one in transit, one being drawn, and the last one
        assert len(after) <= 3, f"{name}: pictures lag behind keys that are held down"
        move_every_control(element)


def starting_with(explorer):
    return re.compile("^" + re.escape(repr(explorer)))


def press(element, explorer, place, name, *keys):
    """Press keys on a slider; wait for the last picture; return the times of keys and pictures."""
    element.locator(".noUi-handle").nth(place).focus()
    element.page.evaluate("keys.length = pictures.length = 0")
    for key in keys:
        element.page.keyboard.press(key)
    text = element.locator(".widget-slider .widget-readout").nth(place).inner_text()
    explorer.put(**{name: float(text.replace("−", "-"))})
    expect(element.locator("canvas")).to_have_attribute("aria-label", starting_with(explorer))
    return element.page.evaluate(TIMES)


def check_play_and_clicks(explorer, page):
    time, play = explorer.locator(".widget-readout").first, explorer.locator("button").first
    expect(time).to_have_text("0.00")
    play.press("Enter")
    explorer.evaluate(PAUSE)
    assert 0.1 <= float(settled(page, time)) < 1
    reset = explorer.get_by_role("button", name="Reset")
    reset.press("Enter")
    expect(time).to_have_text("0.00")
    play.press("Enter")
    expect(time).not_to_have_text("0.00")
    reset.press("Enter")  # during the playback
    expect(time).to_have_text("0.00")
    assert settled(page, time) == "0.00"
    handle = explorer.locator(".noUi-handle").first
    expect(handle).to_have_attribute("aria-label", "time t")
    handle.press("ArrowRight")
    expect(handle).to_have_attribute("aria-valuetext", "0.01")
    handle.press("ArrowLeft")
    expect(handle).to_have_attribute("aria-valuetext", "0.00")
    expect(play).to_have_attribute("title", "Play or pause")

    canvas = explorer.locator("canvas")
    box = canvas.bounding_box()
    canvas.click(position={"x": 0.3 * box["width"], "y": 0.3 * box["height"]})
    expect(time).to_have_text("1.00")
    canvas.click(position={"x": 0.14 * box["width"], "y": 0.05 * box["height"]})
    refused = explorer.get_by_role("alert").get_by_text("from the base wanted")
    refused.wait_for()
    assert "wanted" in settled(page, refused)  # the player is ready by now
    assert page.evaluate(SEEN) == []


def test_a_changed_original_is_not_saved(home, opened, page):
    work = home[0] / "work"
    for folder in ("notebooks", "work"):
        (work / folder).mkdir()
    shutil.copy(work / "01_plane.ipynb", work / "notebooks")
    (work / "work" / ".copied.json").write_text('{"01_plane.ipynb": []}')
    original = opened("notebooks/01_plane.ipynb")
    stored = original.read_bytes()
    page.evaluate(f"{PANEL}.context.model.cells.get(0).sharedModel.setSource('# Mine')")
    page.evaluate("void jupyterapp.commands.execute('docmanager:save')")
    page.get_by_text("Your copy is in work/").first.wait_for()
    assert original.read_bytes() == stored
