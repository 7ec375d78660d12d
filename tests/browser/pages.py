"""What a person does on the pages: scroll through them, press keys, look."""

import re
import time

SCROLLER = ".jp-NotebookPanel .jp-WindowedPanel-outer"
IDLE = re.compile(r"\| Idle$")

# all pictures and players that are on the page now, and whether something is wrong with them
SEEN = """() => {
  const faults = [];
  for (const image of document.querySelectorAll(".jp-Cell figure img, .rbcourse-explorer img")) {
    if (image.complete && !image.naturalWidth) faults.push("blank picture: " + image.alt);
    if (!image.alt) faults.push("picture without description");
    const panel = image.id && image.parentNode.querySelector("div");
    if (panel && panel.hidden) faults.push("player without buttons: " + image.id);
    if (panel && panel.querySelector("button").textContent !== "▶")
      faults.push("player that starts by itself: " + image.id);
  }
  const text = document.body.innerText;
  for (const wrong of ["model not found", "Error displaying widget", "Loading widget",
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


def walk(page, each):
    """Scroll a notebook to its end, a large screen at a time, and do something at each stop."""
    page.set_viewport_size({"width": 1280, "height": 6000})
    page.evaluate(f"document.querySelector('{SCROLLER}').scrollTop = 0")
    while True:
        page.wait_for_timeout(150)
        each()
        at_end = page.evaluate(
            f"""() => {{
                const box = document.querySelector('{SCROLLER}'), before = box.scrollTop;
                box.scrollTop += 0.8 * box.clientHeight;
                return box.scrollTop === before;
            }}"""
        )
        if at_end:
            return page.set_viewport_size({"width": 1280, "height": 800})


def open_in_lab(page, address):
    """Open a notebook in JupyterLab and wait until its kernel is there."""
    page.goto(address)
    page.locator(".jp-NotebookPanel .jp-Cell").first.wait_for(timeout=60_000)
    page.get_by_text(IDLE).wait_for(timeout=60_000)


def run_all(page):
    """Run all cells and wait until the last of them is done."""
    page.get_by_role("menuitem", name="Run", exact=True).click()
    page.get_by_text("Run All Cells", exact=True).click()
    waiting = page.locator(".jp-InputPrompt", has_text="[*]")
    waiting.last.wait_for(state="attached", timeout=10_000)
    page.wait_for_function(
        """() => ![...document.querySelectorAll(".jp-InputPrompt")]
            .some((prompt) => prompt.textContent.includes("[*]"))""",
        timeout=120_000,
    )
    page.get_by_text(IDLE).wait_for(timeout=60_000)


def explorer_in_lab(page):
    """Scroll a notebook to its explorer, which is made when it comes into sight."""
    explorer = page.locator(".rbcourse-explorer")
    page.evaluate(f"document.querySelector('{SCROLLER}').scrollTop = 0")
    while not explorer.count():
        page.evaluate(f"document.querySelector('{SCROLLER}').scrollTop += 300")
        page.wait_for_timeout(100)
    centre(page, explorer)
    explorer.locator(".widget-readout", has_text=re.compile(r"\d")).last.wait_for()
    return explorer


def centre(page, explorer):
    """Bring an explorer to the middle of the screen."""
    explorer.evaluate("(explorer) => explorer.scrollIntoView({ block: 'center' })")
    page.wait_for_timeout(500)


def press(page, explorer, handle, key):
    """Press a key on a slider; return whether the picture changed, what was read, what is."""
    before = read(explorer)
    page.evaluate("pictures.length = 0")
    handle.focus()
    page.keyboard.press(key)
    end = time.monotonic() + 0.7
    while time.monotonic() < end and not page.evaluate("pictures.length"):
        page.wait_for_timeout(10)
    page.wait_for_timeout(60)
    after = read(explorer)
    return before["picture"] != after["picture"], before, after


def read(explorer):
    """What an explorer shows: its picture, what is to be read, and what its sliders say."""
    return explorer.evaluate(
        """(explorer) => ({
            picture: explorer.querySelector("img").src,
            said: explorer.querySelector("table").innerText,
            sliders: [...explorer.querySelectorAll(".widget-readout")].map((r) => r.innerText),
        })"""
    )


def move_every_slider(page, explorer):
    """Press keys on each slider: its number follows, and of some the picture and the text.

    The last one, the time of most explorers, goes to its end first.
    """
    page.evaluate(NOTE)
    handles = explorer.locator(".noUi-handle")
    both, last = 0, handles.count() - 1
    for i, key in [(last, "End"), *((i, "ArrowRight") for i in range(last))]:
        changed, before, after = press(page, explorer, handles.nth(i), key)
        if before["sliders"][i] == after["sliders"][i]:  # it was at its end
            changed, before, after = press(page, explorer, handles.nth(i), "ArrowLeft")
        assert before["sliders"][i] != after["sliders"][i]
        both += changed and before["said"] != after["said"]
    assert both, "no slider changes picture and numbers"
