"""From key press to changed picture, in JupyterLab, for every explorer; printed as a table."""

import statistics
import time

import nbformat
from pages import NOTE, centre, open_in_lab, run_all

from rbcourse import explore
from rbcourse.course.notebooks import KERNEL

HELD = 1.5
SOLVES = {"cube_explorer": 2}  # the slider that is held where the last one only moves the time


def test_the_pictures_follow_the_keys(home, lab, page, record_property):
    course, _ = home
    sources = ["from rbcourse import explore", *(f"explore.{name}()" for name in explore.__all__)]
    cells = [nbformat.v4.new_code_cell(source) for source in sources]
    notebook = nbformat.v4.new_notebook(cells=cells, metadata={"kernelspec": KERNEL})
    nbformat.write(notebook, course / "work" / "speed.ipynb")
    page.set_viewport_size({"width": 1280, "height": 9000})  # all explorers are there at once
    open_in_lab(page, lab("workspaces/speed/tree/speed.ipynb"))
    run_all(page)
    explorers = page.locator(".rbcourse-explorer")
    explorers.last.wait_for()
    assert explorers.count() == len(explore.__all__)
    page.set_viewport_size({"width": 1280, "height": 800})
    page.evaluate(NOTE)
    for name, explorer in zip(explore.__all__, explorers.all(), strict=True):
        centre(page, explorer)
        handles = explorer.locator(".noUi-handle").all()
        held = handles[SOLVES.get(name, -1)]
        waits = [wait for handle in (handles[0], held) for wait in follow(page, handle)]
        shown, late = hold(page, held)
        wait = statistics.median(waits)
        row = f"{name.removesuffix('_explorer'):22}{kind(name):4}{wait:7.0f} ms"
        row += f"{max(waits):7.0f} ms{shown / HELD:8.0f}/s{late:9.0f} ms"
        record_property("speed", row)
        # on a loud machine measured by its own single pictures; a backlog would take seconds
        assert late < max(500, 6 * wait), f"{name}: keys held down left a backlog"
        assert shown > min(3 * HELD, 1000 * HELD / (4 * wait))


def follow(page, handle):
    """Press keys on a slider; return the milliseconds to each new picture."""
    handle.focus()
    for key in ("ArrowLeft", "ArrowRight"):
        page.evaluate("keys.length = pictures.length = 0")
        page.keyboard.press(key)
        page.wait_for_timeout(150)
        pressed, shown = page.evaluate("[keys, pictures]")
        if shown:  # the slider was not at its end
            yield shown[0] - pressed[0]


def hold(page, handle):
    """Hold keys, 30 a second; return how many pictures came, and how late the last of them."""
    handle.focus()
    page.evaluate("keys.length = pictures.length = 0")
    start, n = time.monotonic(), 0
    while (now := time.monotonic() - start) < HELD:
        if now * 30 >= n:
            page.keyboard.press("ArrowRight" if now < HELD / 2 else "ArrowLeft")
            n += 1
        time.sleep(0.002)
    page.wait_for_timeout(600)
    keys, pictures = page.evaluate("[keys, pictures]")
    return len(pictures), pictures[-1] - keys[-1]


def kind(name):
    figure = getattr(explore, name)()._fig
    return "3-D" if any(ax.name == "3d" for ax in figure.axes) else "2-D"
