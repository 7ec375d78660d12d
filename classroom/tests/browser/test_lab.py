"""Every lesson in JupyterLab as it is stored; one of them run, as a person does."""

import html
import json
import re
import shutil

from pages import IDLE, SEEN, centre, explorer_in_lab, open_in_lab, run_all, walk
from playwright.sync_api import expect

OPEN = """async (path) => {
  window.opened = await jupyterapp.commands.execute("docmanager:open", { path });
  await opened.sessionContext.ready; // what is closed while its kernel starts fails
  await opened.sessionContext.session.kernel.info;
}"""


def test_lessons_are_whole_as_they_are_stored(home, lab, page):
    """One after the other, in one JupyterLab."""
    page.goto(lab("workspaces/stored/tree"))
    page.locator(".jp-Launcher").first.wait_for()
    wrong = {}
    for path in sorted((home[0] / "work").glob("[0-9][0-9]_*.ipynb")):
        page.evaluate(OPEN, path.name)
        page.locator(".jp-NotebookPanel .jp-Cell").first.wait_for()
        stored, seen = pictures_in(path), set()
        for _ in range(9):  # on a slow machine cells may come after the end has been reached
            faults, pictures = walk(page)
            seen |= pictures
            if faults or stored <= seen:
                break
        if page.evaluate("opened.context.model.dirty"):
            faults |= {"it is marked as changed"}
        if not stored or faults or stored != seen:
            wrong[path.stem] = faults | (stored ^ seen)
        page.evaluate("opened.sessionContext.shutdown()")  # fifteen kernels need much memory
        page.evaluate("opened.dispose()")
        page.locator(".jp-NotebookPanel").wait_for(state="detached")
    assert not wrong


def pictures_in(path):
    """The descriptions of the pictures that a lesson stores."""
    cells = json.loads(path.read_text("utf-8"))["cells"]
    outputs = [output.get("data", {}) for cell in cells for output in cell.get("outputs", [])]
    text = "".join("".join(data.get("text/html", "")) for data in outputs)
    return set(map(html.unescape, re.findall(r'<img[^>]* alt="([^"]*)"', text)))


# Wait until an explorer plays, and stop it, within the page: a slow test cannot come too late.
PAUSE = """async (explorer) => {
  const number = [...explorer.querySelectorAll(".widget-readout")].at(-1);
  while (parseFloat(number.innerText) < 0.1) await new Promise(requestAnimationFrame);
  explorer.querySelector("button").click();
}"""


def test_keys_play_pause_and_reset_and_a_click_sets_the_goal(home, lab, page, pictures):
    lesson = home[0] / "work" / "02_two_link_arm.ipynb"
    shutil.copy(lesson, lesson.with_stem("play"))  # which may be saved
    open_in_lab(page, lab("workspaces/play/tree/play.ipynb"))
    run_all(page)
    assert not walk(page)[0]
    explorer = explorer_in_lab(page)
    time, play = explorer.locator(".widget-readout").last, explorer.locator("button").first
    expect(time).to_have_text("0.00")
    play.press("Enter")
    explorer.evaluate(PAUSE)
    paused = settled(page, time)
    assert 0.1 <= float(paused) < 1
    page.wait_for_timeout(500)
    assert time.inner_text() == paused
    reset = explorer.get_by_role("button", name="Reset")
    reset.press("Enter")
    expect(time).to_have_text("0.00")
    play.press("Enter")
    expect(time).not_to_have_text("0.00")
    reset.press("Enter")  # while it plays
    expect(time).to_have_text("0.00")
    assert settled(page, time) == "0.00"
    handle = explorer.locator(".noUi-handle").last
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
    page.wait_for_timeout(3000)  # while what plays is prepared
    assert refused.is_visible()
    assert not page.evaluate(SEEN)
    pictures("lab_02_two_link_arm", lambda: centre(explorer))


# The boxes of an explorer that scroll up and down: their classes and heights.
SCROLLING = """(explorer) => [explorer, ...explorer.querySelectorAll("*")]
  .filter((box) => box.scrollHeight > box.clientHeight + 0.5)
  .filter((box) => ["auto", "scroll"].includes(getComputedStyle(box).overflowY))
  .map((box) => [box.className, box.scrollHeight, box.clientHeight])"""


def test_the_cell_of_a_still_is_run_alone_and_its_explorer_does_not_scroll(
    home, lab, page, pictures
):
    """As the still tells its reader."""
    lesson = home[0] / "work" / "06_geodesics.ipynb"
    shutil.copy(lesson, lesson.with_stem("alone"))
    cells = json.loads(lesson.read_text("utf-8"))["cells"]
    number = next(i for i, cell in enumerate(cells) if "_explorer()" in "".join(cell["source"]))
    open_in_lab(page, lab("workspaces/alone/tree/alone.ipynb"))
    page.get_by_text(IDLE).wait_for()
    page.evaluate(f"jupyterapp.shell.currentWidget.content.activeCellIndex = {number}")
    page.evaluate("jupyterapp.commands.execute('notebook:run-cell')")
    explorer = explorer_in_lab(page)
    explorer.locator(".noUi-handle").first.press("ArrowRight")
    explorer.locator("span[role=status]").wait_for(state="attached")
    assert explorer.evaluate(SCROLLING) == []
    pictures("lab_alone", lambda: centre(explorer))


def test_an_original_that_was_changed_is_not_saved_and_says_where_the_copy_is(
    home, lab, page, pictures
):
    original = home[0] / "work" / "notebooks" / "01_plane.ipynb"
    original.parent.mkdir()
    stored = (home[0] / "work" / original.name).read_bytes()
    original.write_bytes(stored)
    (original.parent.parent / "work").mkdir()
    (original.parent.parent / "work" / ".copied.json").write_text('{"01_plane.ipynb": []}')
    open_in_lab(page, lab("workspaces/original/tree/notebooks/01_plane.ipynb"))
    page.get_by_text(IDLE).wait_for()
    model = "jupyterapp.shell.currentWidget.context.model"
    page.evaluate(f"{model}.setMetadata('touched', true)")
    page.evaluate("jupyterapp.commands.execute('docmanager:save')")
    page.wait_for_function(f"!{model}.dirty")
    assert original.read_bytes() == stored
    page.evaluate(f"{model}.cells.get(0).sharedModel.setSource('# Mine')")
    page.evaluate("void jupyterapp.commands.execute('docmanager:save')")
    page.get_by_text("Your copy is in work/").first.wait_for()
    pictures("lab_original", lambda: None)
    assert original.read_bytes() == stored


def settled(page, text):
    """What a text is when the kernel has nothing more to do."""
    now = None
    while now != text.inner_text():
        now = text.inner_text()
        page.wait_for_timeout(1000)
        page.get_by_text(IDLE).wait_for()
    return now


def test_without_its_kernel_an_explorer_says_so_and_is_a_still_when_it_is_opened_again(
    home, lab, page, pictures
):
    lesson = home[0] / "work" / "06_geodesics.ipynb"
    shutil.copy(lesson, lesson.with_stem("ended"))
    open_in_lab(page, lab("workspaces/ended/tree/ended.ipynb"))
    run_all(page)
    explorer = explorer_in_lab(page)
    page.evaluate("jupyterapp.shell.currentWidget.sessionContext.shutdown()")
    explorer.locator(".noUi-handle").first.press("ArrowRight")
    explorer.get_by_role("alert").get_by_text("Python does not answer").wait_for()
    assert explorer.locator("tr").count() == 0
    pictures("lab_ended", lambda: centre(explorer))
    page.evaluate("jupyterapp.shell.currentWidget.context.save()")
    page.get_by_text("Saving completed").wait_for()
    open_in_lab(page, lab("workspaces/again/tree/ended.ipynb"))
    assert not walk(page)[0]
    still = page.get_by_role("img", name=re.compile(r"^The line and its shadow\. θ\(t\): "))
    page.set_viewport_size({"width": 1280, "height": 30_000})
    expect(still).to_have_js_property("tagName", "IMG")
