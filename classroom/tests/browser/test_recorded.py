"""Test players and recorded explorers of each kind in Chromium, without a kernel or server."""

import html
import io
import re

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.patches import Annulus
from pages import check_alike, shown
from quick import quick_for

from rbclassroom import explorers
from rbclassroom.explorers import recorded
from rbcourse.draw import animate

ROWS = "div:has(> input), .rbcourse-choice"
HOUR = 3_600_000  # ms


def show(page, name):
    """Show a recorded explorer alone on a page."""
    page.set_content(f"<!doctype html>{recorded.living(name)}")


@plt.style.context(["default", "rbcourse.rbcourse"])
def test_a_player_shows_the_drawing(timed):
    """The drawing has holes, dashes, corners, and lines that are cut at the edges of the axes."""
    fig, ax = plt.subplots(figsize=(9, 4), dpi=80)
    ax.set(xlim=(0, 9), ylim=(0, 4))
    ring = ax.add_patch(Annulus((0, 2), 1.9, 1.2, fc="#0072B2", ec="black", lw=4))
    (line,) = ax.plot([0, 2, 4, 9], [0, 4, 0, 30], color="#D55E00", ls=(0, (4, 2)), lw=12)

    def update(i):
        ring.center = i / 4, 2
        line.set_xdata([i / 4, 2, 4, 9])
        return [ring, line]

    player = animate.animate(fig, "player", "what moves", update, 20, seconds=0.8, still=0)
    timed.set_viewport_size({"width": 1600, "height": 1000})
    timed.set_content(f"<!doctype html>{player._repr_html_()}")
    button, slider = timed.get_by_role("button", name="play or pause"), timed.locator("input")
    canvas = timed.get_by_role("img", name="what moves").and_(timed.locator("canvas"))
    canvas.evaluate("(canvas) => canvas.style.width = 2 * parseFloat(canvas.style.width) + 'px'")
    timed.clock.pause_at(HOUR)  # from here on, time passes only in steps
    button.press("Enter")
    timed.clock.run_for(280)
    button.press("Enter")
    timed.clock.run_for(1000)
    assert slider.input_value() == "7"
    for frame, share in ((0, "0 %"), (19, "100 %")):
        slider.fill(str(frame))
        assert slider.get_attribute("aria-valuetext") == share
        for artist in update(frame):
            artist.set_animated(False)
        fig.savefig(full := io.BytesIO(), format="png", dpi=2 * fig.dpi)
        check_alike(shown(canvas), full.getvalue(), player.background)
    plt.close(fig)
    button.press("Enter")
    timed.clock.run_for(40)
    assert slider.input_value() == "0"


@pytest.mark.parametrize("name", quick_for(["chain", "cube"], sorted(recorded.MOVED)))
def test_keys_and_mouse_move_a_recorded_explorer(name, timed):
    timed.set_viewport_size({"width": 1400, "height": 1000})
    show(timed, name)
    explorer, (moved, stride) = getattr(explorers, f"{name}_explorer")(), recorded.MOVED[name]
    steps = explorer.steps[explorer.time.index % stride :: stride]
    canvas = timed.locator("canvas")
    controls = dict(zip([*moved, explorer.plays], timed.locator(ROWS).all(), strict=True))
    canvas.evaluate("(canvas) => { canvas.style = 'display: block; width: 1120px'; }")
    assert canvas.get_attribute("aria-label").startswith(repr(explorer))
    rng = np.random.default_rng(1)
    for _ in range(2):
        now = {}
        for each, values in {**moved, explorer.plays: steps}.items():
            k = int(rng.integers(len(values)))
            if isinstance(values[k], str):
                controls[each].get_by_role("button").nth(k).click()
                pressed = controls[each].locator("[aria-pressed=true]")
                assert pressed.all_inner_texts() == [values[k]]
            else:
                controls[each].locator("input").fill(str(k))
            now[each] = values[k]
        state = explorer.state(**now)
        check_alike(shown(canvas), explorer.draw(state.shown, zoom=2), explorer.background)
        rows = timed.locator("tr").evaluate_all(
            "(rows) => rows.map((row) => [...row.cells].map((cell) => cell.textContent))"
        )
        said, _, line = state.texts
        assert rows == [list(pair) for pair in said]
        seen = timed.locator(".rbcourse-view output").all_inner_texts()
        assert canvas.get_attribute("aria-label") == " ".join([line, *seen])
    for each, row in controls.items():
        label, slider = explorer.controls[each].description, row.locator("input")
        if not slider.count():
            assert row.get_attribute("aria-label") == label
            continue
        assert slider.get_attribute("aria-label") == label
        box = slider.bounding_box()
        timed.mouse.click(box["x"] + 1, box["y"] + box["height"] / 2)
        low = slider.get_attribute("aria-valuetext"), shown(canvas)
        timed.keyboard.press("End")
        text = slider.get_attribute("aria-valuetext")
        assert low[0] != text
        assert low[1] != shown(canvas)
        assert timed.get_by_text(text, exact=True).count()
        # at this value everything is visible
        slider.fill(str(round(0.6 * float(slider.get_attribute("max")))))
    if explorer.display.rooms:
        before = shown(canvas)
        canvas.press("ArrowLeft")
        assert shown(canvas) != before
    timed.clock.pause_at(HOUR)
    assert timed.locator("[role=status]").inner_text() in canvas.get_attribute("aria-label")
    time = timed.locator("input").last
    time.fill("0")
    timed.get_by_role("button", name="play or pause").press("Enter")
    timed.clock.run_for(3 * stride * explorer.play.interval)
    assert time.input_value() == "3"


def test_players_show_few_steps_if_the_user_asks_for_less_motion(timed):
    timed.emulate_media(reduced_motion="reduce")
    show(timed, "theta")
    timed.locator("input").last.fill("0")
    timed.clock.pause_at(HOUR)
    timed.get_by_role("button", name="play or pause").click()
    for step in (20, 40, 60, 80):
        timed.clock.run_for(800)
        assert timed.locator("input").last.input_value() == str(step)


def test_a_page_without_scripts_shows_a_still_picture(context):
    plain = context.browser.new_context(java_script_enabled=False)
    page = plain.new_page()
    show(page, "spline")
    alt = html.unescape(re.search(r'alt="([^"]*)"', recorded.living("spline"))[1])
    assert page.get_by_role("img", name=alt, exact=True).is_visible()
    page.get_by_text("About this picture").click()
    assert page.get_by_text("with Python, you can move every control").is_visible()
    assert page.locator("input, button, canvas").count() == 0
    plain.close()
