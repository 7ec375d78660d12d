"""Every lesson in JupyterLab, as a person finds it: before it is run, after, and its sliders."""

from pages import SEEN, centre, explorer_in_lab, move_every_slider, open_in_lab, run_all, walk


def test_a_lesson_is_whole_before_and_after_it_is_run(lesson, lab, page, pictures):
    open_in_lab(page, lab(f"workspaces/{lesson}/tree/{lesson}.ipynb"))
    faults = set()
    walk(page, lambda: faults.update(page.evaluate(SEEN)))
    run_all(page)
    faults.update(page.evaluate(SEEN))
    explorer = explorer_in_lab(page)
    move_every_slider(page, explorer)
    faults.update(page.evaluate(SEEN))
    assert not faults
    pictures(f"lab_{lesson}", lambda: centre(page, explorer))


def test_keys_play_pause_and_reset_and_a_click_sets_the_goal(lab, page):
    open_in_lab(page, lab("workspaces/play/tree/02_two_link_arm.ipynb"))
    run_all(page)
    explorer = explorer_in_lab(page)
    time, play = explorer.locator(".widget-readout").last, explorer.locator("button").first
    assert time.inner_text() == "0.00"
    play.press("Enter")
    page.wait_for_timeout(1500)
    play.press("Enter")
    page.wait_for_timeout(300)
    paused = time.inner_text()
    assert 0.1 < float(paused) < 0.9
    page.wait_for_timeout(500)
    assert time.inner_text() == paused
    reset = explorer.get_by_role("button", name="Reset")
    reset.press("Enter")
    page.wait_for_timeout(500)
    assert time.inner_text() == "0.00"
    play.press("Enter")
    page.wait_for_timeout(700)
    reset.press("Enter")  # while it plays
    page.wait_for_timeout(1000)
    assert time.inner_text() == "0.00"
    assert explorer.locator(".noUi-handle").last.get_attribute("aria-label") == "time t"
    assert play.get_attribute("title") == "Play or pause"

    image = explorer.locator("img")
    box = image.bounding_box()
    image.click(position={"x": 0.3 * box["width"], "y": 0.3 * box["height"]})
    page.wait_for_timeout(500)
    assert time.inner_text() == "1.00"
    image.click(position={"x": 0.14 * box["width"], "y": 0.05 * box["height"]})
    explorer.get_by_text("from the base wanted").wait_for(timeout=3000)
