"""Every explorer in JupyterLab: the pictures follow the keys; printed as a table, how fast."""

import statistics
import time

import nbformat
from pages import IDLE, NOTE, centre, move_every_control, open_in_lab, run_all, wait_for
from pixels import check_alike, shown
from playwright.sync_api import expect

from rbclassroom import explorers
from rbclassroom.course.notebooks import KERNEL

HELD = 1.0
SOLVES = {"cube_explorer": 2}  # the slider that is held where the last one only moves the time


def test_the_pictures_follow_the_keys(home, lab, page, record_property):
    course, _ = home
    sources = [
        "from rbclassroom import explorers",
        *(f"explorers.{name}()" for name in explorers.__all__),
    ]
    cells = [nbformat.v4.new_code_cell(source) for source in sources]
    notebook = nbformat.v4.new_notebook(cells=cells, metadata={"kernelspec": KERNEL})
    nbformat.write(notebook, course / "work" / "explorers.ipynb")
    page.set_viewport_size({"width": 1280, "height": 9000})  # all explorers are there at once
    open_in_lab(page, lab("workspaces/explorers/tree/explorers.ipynb"))
    run_all(page)
    there = page.locator(".rbcourse-explorer")
    expect(there).to_have_count(len(explorers.__all__))
    page.set_viewport_size({"width": 1280, "height": 800})
    page.evaluate(NOTE)
    for name, explorer in zip(explorers.__all__, there.all(), strict=True):
        centre(explorer)
        check_picture(wait_for(explorer), getattr(explorers, name)())
        move_every_control(explorer)
        settle(page)
        handles = explorer.locator(".noUi-handle").all()
        held = handles[SOLVES.get(name, -1)]
        waits = list(follow(page, held)) or [float("nan")]
        count, after, late = hold(page, held)
        row = f"{name.removesuffix('_explorer'):22}{kind(name):4}{statistics.median(waits):7.0f} ms"
        row += f"{max(waits):7.0f} ms{count / HELD:8.0f}/s{late:9.0f} ms"
        record_property("speed", row)
        assert count, f"{name}: no picture follows the keys"
        # one on its way, one being drawn, and one of where the slider has come to
        assert after <= 3, f"{name}: keys held down left a backlog"


def check_picture(element, explorer):
    """The canvas, made twice as wide, is Matplotlib's picture."""
    canvas = element.locator("canvas")
    style = canvas.get_attribute("style")
    canvas.evaluate(
        """async (canvas) => {
            const drawn = new Promise((done) => canvas.addEventListener("drawn", done));
            Object.assign(canvas.style, { width: "1120px", maxWidth: "none" });
            await drawn;
        }"""
    )
    want = explorer.draw(explorer.state().shown, zoom=2)
    check_alike(shown(canvas), want, explorer.background)
    canvas.evaluate("(canvas, style) => { canvas.style = style; }", style)


def follow(page, handle):
    """Press keys on a slider; return the milliseconds to each new picture."""
    for key in ("ArrowLeft", "ArrowRight"):
        page.evaluate("keys.length = pictures.length = 0")
        handle.press(key)
        settle(page)
        pressed, shown = page.evaluate("[keys, pictures]")
        if shown:  # the slider was not at its end
            yield shown[0] - pressed[0]


def hold(page, handle):
    """Hold keys, 30 a second; return how many pictures came, how many of them after the last key,
    and how late the last of them."""
    handle.focus()
    page.evaluate("keys.length = pictures.length = 0")
    start, n = time.monotonic(), 0
    while (now := time.monotonic() - start) < HELD:
        if now * 30 >= n:
            page.keyboard.press("ArrowLeft" if now < HELD / 2 else "ArrowRight")
            n += 1
        time.sleep(0.002)
    settle(page)
    keys, pictures = page.evaluate("[keys, pictures]")
    after = [picture - keys[-1] for picture in pictures if picture > keys[-1]]
    return len(pictures), len(after), max(after, default=0)


def settle(page):
    """Wait until the kernel has nothing more to do and no more pictures come."""
    before = None
    while before != (before := page.evaluate("pictures.length")):
        page.wait_for_timeout(200)
        page.get_by_text(IDLE).wait_for()


def kind(name):
    figure = getattr(explorers, name)()._fig
    return "3-D" if any(ax.name == "space" for ax in figure.axes) else "2-D"
