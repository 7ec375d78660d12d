"""Functions that act as a user does: they open pages, press keys, and compare pictures."""

import base64
import io
import re
from contextlib import contextmanager

import numpy as np
from PIL import Image
from playwright.sync_api import expect

IDLE = re.compile(r"\| Idle$")
# A JavaScript function that returns the faults of the pictures and players on a page.
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

FRAMES = "async (count) => { while (count--) await new Promise(requestAnimationFrame); }"


@contextmanager
def watched(context):
    """Yield a page that must not send requests to another machine, and must not log errors."""
    page, faults = context.new_page(), []
    page.set_viewport_size({"width": 1280, "height": 800})
    local = ("http://127.0.0.1:", "ws://127.0.0.1:", "data:", "blob:", "file:///")
    page.on("request", lambda r: r.url.startswith(local) or faults.append(f"asked {r.url}"))
    # JupyterLab shows why it cannot save, and then throws this error
    meant = "is an original, and is not saved"
    page.on("pageerror", lambda error: meant in str(error) or faults.append(f"error {error}"))
    # JupyterLab gets status 403 when it tries to save an original. If a kernel has ended, widgets
    # report that they cannot send it their values, and JupyterLab that it cannot ask its debugger.
    known = re.compile(
        "^(?!error)|403|Could not send widget sync message|Could not restore the debugger state"
    )
    page.on("console", lambda m: known.search(f"{m.type} {m.text}") or faults.append(m.text))
    yield page
    page.close()
    assert not faults, faults


def wait_for(explorer):
    """Wait until an explorer has its picture and its numbers; return it."""
    explorer.locator(".widget-readout", has_text=re.compile(r"\d")).last.wait_for()
    explorer.locator("table").wait_for()
    explorer.get_by_role("img").wait_for()  # a canvas gets this role once it is drawn
    return explorer


def move_every_control(explorer):
    """Move each slider and choose each option, with keys and with the mouse.

    The time is moved first. The numbers must change immediately; the picture and the text may
    follow later.
    """
    table, sliders = explorer.locator("table"), explorer.locator(".widget-slider").all()
    said, picture = table.inner_text(), shown(explorer.locator("canvas"))
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
    expect(table).not_to_have_text(said, use_inner_text=True)
    assert shown(explorer.locator("canvas")) != picture


def pixels(png):
    """Return the pixels of a PNG, shape (rows, columns, 3)."""
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB"), dtype=int)


def shown(canvas):
    """Return the picture of a canvas of the page, as a PNG."""
    return base64.b64decode(canvas.evaluate("(canvas) => canvas.toDataURL()").split(",")[1])


def check_alike(drawn, want, background):
    """Check that few pixels differ by more than 64.

    Their number must be under 1 % of all pixels, and at most half the number of moving pixels.
    Thin lines cover so few pixels that an empty canvas would pass the first condition.
    """
    drawn, want, background = map(pixels, (drawn, want, background))
    assert drawn.shape == want.shape == background.shape
    off, moves = (np.abs(other - want).max(axis=-1) > 64 for other in (drawn, background))
    assert off.mean() < 0.01
    assert off.sum() <= 0.5 * moves.sum(), off.sum() / moves.sum()
