"""The recorded explorers in Chromium, as files on a disk: no kernel and no server."""

import html
import re
from pathlib import Path

import numpy as np
import pytest
from pixels import check_alike, shown

from rbclassroom import explorers
from rbclassroom.explorers import recorded

FOLDER = Path(__file__).parents[3] / "figures" / "explorers"


@pytest.fixture(params=sorted(recorded.MOVED))
def opened(request, page):
    """The name of an explorer, the explorer, and its page, open."""
    page.set_viewport_size({"width": 1400, "height": 1000})
    page.goto((FOLDER / f"{request.param}.html").as_uri())
    page.locator("canvas").wait_for()
    return request.param, getattr(explorers, f"{request.param}_explorer")(), page


def test_the_canvas_shows_what_matplotlib_draws_and_the_text_what_the_explorer_says(opened):
    """At random states."""
    name, explorer, page = opened
    moved, values = recorded.MOVED[name]
    values = list(explorer.controls[moved].options) if values is None else values.tolist()
    canvas, sliders = page.locator("canvas"), page.locator("input")
    canvas.evaluate(
        "(canvas) => { canvas.style.width = '1120px'; canvas.style.maxWidth = 'none'; }"
    )
    rng = np.random.default_rng(1)
    for _ in range(4):
        k, i = int(rng.integers(len(values))), int(rng.integers(len(explorer.steps)))
        sliders.first.fill(str(k))
        sliders.last.fill(str(i))
        now = {moved: values[k], explorer.plays: explorer.steps[i]}
        state = explorer.state(**now)
        check_alike(shown(canvas), explorer.draw(state.shown, zoom=2), explorer.background)
        rows = page.locator("tr").evaluate_all(
            "(rows) => rows.map((row) => [...row.cells].map((cell) => cell.textContent))"
        )
        assert rows == [list(pair) for pair in state.said.items()]
        seen = page.locator(".rbcourse-view output").all_inner_texts()
        assert canvas.get_attribute("aria-label") == " ".join([state.line, *seen])


def test_keys_and_mouse_move_every_control(opened):
    _, explorer, page = opened
    canvas, sliders = page.locator("canvas"), page.locator("input")
    assert sliders.count() == 2
    labels = [slider.get_attribute("aria-label") for slider in sliders.all()]
    assert labels[1] == explorer.time.description
    for slider in reversed(sliders.all()):
        box = slider.bounding_box()
        page.mouse.click(box["x"] + 1, box["y"] + box["height"] / 2)
        low = slider.get_attribute("aria-valuetext"), shown(canvas)
        slider.focus()
        page.keyboard.press("End")
        high = slider.get_attribute("aria-valuetext"), shown(canvas)
        assert low[0] != high[0]
        assert low[1] != high[1]
        assert page.get_by_text(high[0], exact=True).count()
        slider.fill(str(round(0.6 * float(slider.get_attribute("max")))))  # where all is seen
    page.locator("[role=status]").filter(has_text=canvas.get_attribute("aria-label")).wait_for()
    play = page.get_by_role("button", name="play or pause")
    sliders.last.fill("0")
    play.press("Enter")
    page.wait_for_function("[...document.querySelectorAll('input')].at(-1).value > 2")
    play.press("Enter")


def test_who_wants_little_motion_sees_few_steps(page):
    page.emulate_media(reduced_motion="reduce")
    page.goto((FOLDER / "theta.html").as_uri())
    page.locator("canvas").wait_for()
    page.evaluate(
        """() => {
            window.seen = new Set();
            const time = [...document.querySelectorAll("input")].at(-1);
            const look = () => { seen.add(time.value); requestAnimationFrame(look); };
            look();
            document.querySelector("button[aria-label]").click();
        }"""
    )
    page.wait_for_function("seen.size > 4")
    assert page.evaluate("[...seen].map(Number)") == [0, 20, 40, 60, 80]


@pytest.mark.parametrize("name", sorted(recorded.MOVED))
def test_without_scripts_a_page_is_its_still_and_says_what_is_missing(name, context):
    content = (FOLDER / f"{name}.html").read_text(encoding="utf-8")
    plain = context.browser.new_context(java_script_enabled=False)
    page = plain.new_page()
    page.goto((FOLDER / f"{name}.html").as_uri())
    alt = html.unescape(re.search(r'alt="([^"]*)"', content)[1])
    assert page.get_by_role("img", name=alt, exact=True).is_visible()
    assert page.get_by_text("In the lesson, with Python, every control moves").is_visible()
    assert page.locator("input, button, canvas").count() == 0
    plain.close()
