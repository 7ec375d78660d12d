"""What a person does on the pages: scroll through them, press keys, look."""

import re

from playwright.sync_api import expect

SCROLLER = ".jp-NotebookPanel .jp-WindowedPanel-outer"
IDLE = re.compile(r"\| Idle$")

# all pictures and players that are on the page now, and whether something is wrong with them
SEEN = """() => {
  const faults = [], parts = ".jp-Cell figure :is(img, canvas), .rbcourse-explorer img";
  for (const picture of document.querySelectorAll(parts)) {
    if (picture.complete && !picture.naturalWidth) faults.push("blank picture: " + picture.alt);
    if (!(picture.alt || picture.ariaLabel)) faults.push("picture without description");
    const button = picture.parentNode.querySelector("button");
    if (button && button.parentNode.hidden && !picture.dataset.read)
      faults.push("player without buttons: " + picture.id);
    if (button && button.textContent !== "▶")
      faults.push("player that starts by itself: " + picture.ariaLabel);
  }
  const text = document.body.innerText;
  for (const wrong of ["model not found", "Error displaying widget",
                       "Error rendering output", "Traceback (most recent call last)"])
    if (text.includes(wrong)) faults.push(wrong);
  return faults;
}"""

# what the page notes: when keys go down, and when explorers have a new picture on the screen
NOTE = """() => {
  window.keys = []; window.pictures = [];
  document.addEventListener("keydown", () => keys.push(performance.now()), true);
  document.addEventListener("load", (event) => {
    if (event.target.closest?.(".rbcourse-explorer"))
      requestAnimationFrame(() => pictures.push(performance.now()));
  }, true);
}"""


PICTURES = """() => [...document.querySelectorAll(".jp-Cell figure :is(img, canvas)")]
    .filter((picture) => picture.complete ?? true)
    .map((picture) => picture.alt ?? picture.ariaLabel)"""
LOADED = """() => !document.body.innerText.includes("Loading widget")
    && !document.querySelector("img[data-read]")"""  # a player that has not unpacked its states
STARRED = """() => [...document.querySelectorAll(".jp-InputPrompt")]
    .some((prompt) => prompt.textContent.includes("[*]"))"""


def walk(page):
    """Scroll a notebook to its end, a large screen at a time.

    Return what is wrong, and the descriptions of the pictures.
    """
    faults, seen = set(), set()
    page.set_viewport_size({"width": 1280, "height": 6000})
    page.evaluate(f"document.querySelector('{SCROLLER}').scrollTop = 0")
    while True:
        page.wait_for_timeout(150)  # so that pictures are drawn
        page.wait_for_function(LOADED)
        faults.update(page.evaluate(SEEN))
        seen.update(page.evaluate(PICTURES))
        at_end = page.evaluate(
            f"""() => {{
                const box = document.querySelector('{SCROLLER}'), before = box.scrollTop;
                box.scrollTop += 0.8 * box.clientHeight;
                return box.scrollTop === before;
            }}"""
        )
        if at_end:
            page.set_viewport_size({"width": 1280, "height": 800})
            return faults, seen


def open_in_lab(page, address):
    """Open a notebook in JupyterLab, and wait until its cells are there."""
    page.goto(address)
    page.locator(".jp-NotebookPanel .jp-Cell").first.wait_for()


def run_all(page):
    """Run all cells and wait until the last of them is done."""
    page.get_by_text(IDLE).wait_for()
    page.evaluate(
        f"""() => {{
            window.started = false;
            const look = () => {{ window.started ||= ({STARRED})(); }};
            new MutationObserver(look).observe(document.body, {{ childList: true, subtree: true }});
        }}"""
    )
    page.get_by_role("menuitem", name="Run", exact=True).click()
    page.get_by_text("Run All Cells", exact=True).click()
    page.wait_for_function("window.started")
    page.wait_for_function(f"() => !({STARRED})()")
    page.get_by_text(IDLE).wait_for()


def explorer_in_lab(page):
    """Scroll a notebook to its explorer, which is made when it comes into sight."""
    explorer = page.locator(".rbcourse-explorer")
    page.evaluate(f"document.querySelector('{SCROLLER}').scrollTop = 0")
    while not explorer.count():
        page.evaluate(f"document.querySelector('{SCROLLER}').scrollTop += 300")
        page.wait_for_timeout(100)
    centre(explorer)
    return wait_for(explorer)


def wait_for(explorer):
    """Wait until an explorer has its picture and its numbers; return it."""
    explorer.locator(".widget-readout", has_text=re.compile(r"\d")).last.wait_for()
    explorer.locator("table").wait_for()
    expect(explorer.locator("img")).to_have_js_property("complete", True)
    return explorer


def centre(explorer):
    """Bring an explorer to the middle of the screen."""
    explorer.evaluate("(explorer) => explorer.scrollIntoView({ block: 'center' })")


def read(explorer):
    """What an explorer shows: its picture, and what is to be read."""
    return explorer.evaluate(
        """(explorer) => ({
            picture: explorer.querySelector("img").src,
            said: explorer.querySelector("table").innerText,
        })"""
    )


def move_every_slider(explorer):
    """Press a key on each slider: its number follows, and then the picture and the text.

    The last one, the time of most explorers, goes to its end first.
    """
    before, handles = read(explorer), explorer.locator(".noUi-handle")
    last = handles.count() - 1
    for i, key in [(last, "End"), *((i, "ArrowRight") for i in range(last))]:
        handle, number = handles.nth(i), explorer.locator(".widget-readout").nth(i)
        if handle.evaluate("(handle) => Boolean(handle.closest('[disabled]'))"):
            continue
        now = number.inner_text()
        if handle.get_attribute("aria-valuenow") == handle.get_attribute("aria-valuemax"):
            key = "ArrowLeft"
        handle.press(key)
        expect(number).not_to_have_text(now)
    expect(explorer.locator("img")).not_to_have_attribute("src", before["picture"])
    expect(explorer.locator("table")).not_to_have_text(before["said"], use_inner_text=True)
