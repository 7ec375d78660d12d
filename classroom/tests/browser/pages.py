"""What a person does on the pages: scroll through them, press keys, look."""

import re

from playwright.sync_api import expect

SCROLLER = ".jp-NotebookPanel .jp-WindowedPanel-outer"
IDLE = re.compile(r"\| Idle$")

# all pictures and players that are on the page now, and whether something is wrong with them
SEEN = """() => {
  const faults = [], parts = ":is(.jp-Cell figure, .rbcourse-explorer) :is(img, canvas)";
  for (const picture of document.querySelectorAll(parts)) {
    if (picture.complete && !picture.naturalWidth) faults.push("blank picture: " + picture.alt);
    if (!(picture.alt || picture.ariaLabel)) faults.push("picture without description");
    const figure = picture.closest("figure");
    if (figure?.querySelector("script") && !figure.querySelector("canvas, img[data-read]"))
      faults.push("player that cannot be moved: " + picture.id);
    const slider = figure?.querySelector("input");
    if (slider && slider.offsetWidth < picture.offsetWidth / 2)
      faults.push("slider of a player that is short: " + picture.ariaLabel);
    const button = figure?.querySelector("button[aria-label]");
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
  document.addEventListener("drawn", () =>
    requestAnimationFrame(() => pictures.push(performance.now())));
}"""


PICTURES = """() => [...document.querySelectorAll(".jp-Cell figure :is(img, canvas)")]
    .filter((picture) => picture.complete ?? true)
    .map((picture) => picture.alt ?? picture.ariaLabel.replace(/ Seen from azimuth .*/, ""))"""
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
    explorer.get_by_role("img").wait_for()  # a canvas is one when it has been drawn
    return explorer


def centre(explorer):
    """Bring an explorer to the middle of the screen."""
    explorer.evaluate("(explorer) => explorer.scrollIntoView({ block: 'center' })")


def read(explorer):
    """What an explorer shows: its picture, and what is to be read."""
    return explorer.evaluate(
        """(explorer) => ({
            picture: explorer.querySelector("canvas").toDataURL(),
            said: explorer.querySelector("table").innerText,
        })"""
    )


def move_every_control(explorer):
    """Move each slider by a key and by the mouse, and choose by both; time is moved first.

    Numbers follow at once, and then picture and text.
    """
    before, sliders = read(explorer), explorer.locator(".widget-slider").all()
    for slider in [sliders[-1], *sliders[:-1]]:
        handle, number = slider.locator(".noUi-handle"), slider.locator(".widget-readout")
        if handle.evaluate("(handle) => Boolean(handle.closest('[disabled]'))"):
            continue
        now = number.inner_text()
        low, high = (float(handle.get_attribute(f"aria-value{end}")) for end in ("min", "max"))
        right = float(handle.get_attribute("aria-valuenow")) > (low + high) / 2
        handle.press("Home" if right else "End")
        expect(number).not_to_have_text(now)
        now, box = number.inner_text(), slider.locator(".noUi-base").bounding_box()
        x, y = box["x"] + 0.6 * box["width"], box["y"] + box["height"] / 2
        explorer.page.mouse.click(x, y)
        expect(number).not_to_have_text(now)
    for buttons in explorer.locator(".widget-toggle-buttons").all():
        first, second = buttons.locator("button").all()[:2]
        second.press("Enter")
        expect(second).to_have_class(re.compile("mod-active"))
        first.click()
        expect(first).to_have_class(re.compile("mod-active"))
    for menu in explorer.locator("select").all():
        now = menu.input_value()
        menu.press("ArrowDown")
        expect(menu).not_to_have_value(now)
        menu.select_option(now)
        expect(menu).to_have_value(now)
    expect(explorer.locator("table")).not_to_have_text(before["said"], use_inner_text=True)
    assert read(explorer)["picture"] != before["picture"]
