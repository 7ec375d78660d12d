"""From key press to changed picture, in JupyterLab, for every explorer; printed as a table."""

import statistics
import time

import nbformat
import pytest
from pages import NOTE, explorer_in_lab, open_in_lab, run_all

from rbcourse import widgets

HELD = 3.0


@pytest.mark.parametrize("name", widgets.__all__)
def test_the_picture_follows_the_keys(name, home, lab, page, record_property):
    course, _ = home
    source = f"from rbcourse import widgets\nwidgets.{name}()"
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(source)])
    nbformat.write(notebook, course / "work" / f"{name}.ipynb")
    open_in_lab(page, lab(f"workspaces/{name}/tree/{name}.ipynb"))
    run_all(page)
    explorer = explorer_in_lab(page)
    page.evaluate(NOTE)
    handles = explorer.locator(".noUi-handle")
    waits = []
    for i in range(handles.count()):
        handles.nth(i).focus()
        waits += [wait for key in ("ArrowLeft", "ArrowRight") * 6 if (wait := pressed(page, key))]
    handles.last.focus()
    pictures, late = held(page)
    space = "3-D" if explorer_in_space(name) else "2-D"
    row = f"{name.removesuffix('_explorer'):22}{space:4}{statistics.median(waits):7.0f} ms"
    row += f"{max(waits):7.0f} ms{pictures / HELD:8.0f}/s{late:9.0f} ms"
    record_property("speed", row)
    assert late < 500, "keys held down left a backlog"
    assert pictures > 10


def pressed(page, key):
    """Press a key; return the milliseconds until a new picture is shown, or None."""
    page.evaluate("keys.length = pictures.length = 0")
    page.keyboard.press(key)
    page.wait_for_timeout(180)
    pressed, shown = page.evaluate("[keys, pictures]")
    return shown[0] - pressed[0] if shown else None


def held(page):
    """Hold keys for some seconds, 30 a second; return how many pictures, how late the last is."""
    page.evaluate("keys.length = pictures.length = 0")
    start, n = time.monotonic(), 0
    while (now := time.monotonic() - start) < HELD:
        if now * 30 >= n:
            page.keyboard.press("ArrowRight" if now < HELD / 2 else "ArrowLeft")
            n += 1
        time.sleep(0.002)
    page.wait_for_timeout(1500)
    keys, pictures = page.evaluate("[keys, pictures]")
    return len(pictures), pictures[-1] - keys[-1]


def explorer_in_space(name):
    explorer = getattr(widgets, name)()
    return any(ax.name == "3d" for ax in explorer._fig.axes)
