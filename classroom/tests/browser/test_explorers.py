"""Test that explorers in JupyterLab follow the keys."""

import re

import nbformat
from pages import centre, check_alike, move_every_control, open_in_lab, run_all, shown, wait_for
from playwright.sync_api import expect

from rbclassroom import explorers
from rbclassroom.course.notebooks import KERNEL

# Explorers in the plane with a menu, and in space with buttons, and one that solves a problem for
# each picture. Each entry also has the place and the name of the slider that the test moves.
KINDS = {"chain": (1, "duration"), "flip": (1, "off"), "cube": (2, "spin")}

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


def test_explorer_pictures_follow_the_keys(home, lab, page):
    cells = ["from rbclassroom import explorers"]
    cells += [f"explorers.{name}_explorer()" for name in KINDS]
    notebook = nbformat.v4.new_notebook(metadata={"kernelspec": KERNEL})
    notebook.cells = [nbformat.v4.new_code_cell(source) for source in cells]
    nbformat.write(notebook, home[0] / "work" / "explorers.ipynb")
    # this window renders all explorers together
    page.set_viewport_size({"width": 1280, "height": 4000})
    open_in_lab(page, lab("workspaces/explorers/tree/explorers.ipynb"))
    run_all(page)
    there = page.locator(".rbcourse-explorer")
    expect(there).to_have_count(len(KINDS))
    page.set_viewport_size({"width": 1280, "height": 800})
    page.evaluate(NOTE)
    for (name, slider), element in zip(KINDS.items(), there.all(), strict=True):
        explorer, canvas = getattr(explorers, f"{name}_explorer")(), element.locator("canvas")
        centre(wait_for(element))
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


def press(element, explorer, place, name, *keys):
    """Press keys on a slider; wait for the last picture; return the times of keys and pictures."""
    element.locator(".noUi-handle").nth(place).focus()
    element.page.evaluate("keys.length = pictures.length = 0")
    for key in keys:
        element.page.keyboard.press(key)
    text = element.locator(".widget-slider .widget-readout").nth(place).inner_text()
    explorer.put(**{name: float(text.replace("−", "-"))})
    line = re.compile("^" + re.escape(repr(explorer)))
    expect(element.locator("canvas")).to_have_attribute("aria-label", line)
    return element.page.evaluate(TIMES)
