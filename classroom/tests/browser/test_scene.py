"""Compare scenes that are turned in Chromium with Python's drawings from the same viewpoints."""

import io
import re

import matplotlib.pyplot as plt
import numpy as np
import pytest
from pages import check_alike, pixels, shown
from playwright.sync_api import expect
from test_recorded import show

import rbcourse as rb
from rbcourse.draw import animate, bodies, save_figure, spheres
from rbcourse.draw.display import ENGINE, Display
from rbcourse.draw.scene import in_sight

GOAL = rb.pose_from_coordinates([0.5, 1.0, 0.5, 3, 2, 1])
SIDES = [(elev, azim) for elev in (-50, 5, 60) for azim in (-170, -80, 10, 100)]
STYLES = ["default", "rbcourse.rbcourse"]
SIZE = {"figsize": (4, 4), "dpi": 100, "subplot_kw": {"projection": "space"}}

# A function that returns, for each view, the parts of a state in drawing order.
SEEN = """({ state, styles, room, views }) => {
  const all = rbcourseDisplay.decode(Int16Array.from(state), styles);
  const pieces = all.map(({ style, runs }) =>
    ({ kind: style[9], zorder: style[10], style, places: runs[0] }));
  return views.map((view) => rbcourseScene.seen(pieces, room, view));
}"""


def sphere(ax):
    spheres.draw_sphere(ax)
    ax.plot(*rb.sample_rotation(80, rng=np.random.default_rng(2))[:, :, 0].T, "o", color="red")
    ax.plot([-1.2, 1.2], [0.3, -0.3], [0, 0], color="blue", lw=3)


def far(ax):
    """Draw cubes and a floor far from the origin, a line that leaves the picture, and a legend."""
    poses = rb.screw(np.eye(4), GOAL)(np.linspace(0, 1, 6))
    poses[:, :3, 3] += [100, 3, 7]
    bodies.draw_cube_motion(ax, poses, side=1)
    ax.plot([50, 150], [-10, 20], [7, 7], color="blue", lw=3, label="a line")
    ax.legend(loc="upper left")


def crossing(ax):
    """Draw two boxes that intersect, a dashed line through both, and letters."""
    ax.plot([-0.7, 0.7], [0.3, 0.3], [0.15, 0.15], color="green", lw=5)  # the line lies on the box
    bodies.draw_box(ax, np.eye(4), np.array([1.6, 0.8, 0.3]))
    bodies.draw_box(ax, rb.pose_from_coordinates([0.5, 0.4, 1.0, 0.2, 0.1, 0.1]), 0.7)
    ax.plot([-1, 1], [-0.8, 0.9], [0.3, -0.2], color="black", lw=3, ls="--")
    ax.text(0.9, 0, 0.4, "letters", ha="center")
    ax.fit(np.full(3, -1), np.full(3, 1))


def turn_to(page, canvas, now, side):
    """Drag from one view to another, in steps within the canvas; a pixel is half a degree."""
    box, (up, across) = canvas.bounding_box(), np.subtract(side, now)
    steps = int(max(abs(up), abs(across)) // 60 + 1)
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    for _ in range(steps):
        page.mouse.move(x + across / steps, y - up / steps)
        page.mouse.down()
        page.mouse.move(x - across / steps, y + up / steps)
        page.mouse.up()


def told(side):
    elev, azim = (f"{angle}".replace("-", "−") for angle in side)
    return f"Seen from azimuth {azim}°, elevation {elev}°."


def put(page, player):
    page.set_content(f"<!doctype html><body>{player._repr_html_()}")
    page.set_viewport_size({"width": 1600, "height": 1300})
    canvas = page.locator("canvas")
    canvas.evaluate("(canvas) => { canvas.style.maxWidth = 'none'; canvas.style.width = '960px'; }")
    expect(canvas).to_have_attribute("width", "960")  # the drawing has followed
    return canvas


@pytest.mark.parametrize(("make", "sides"), [(sphere, SIDES[::5]), (far, SIDES[2::4])])
@plt.style.context(STYLES)
def test_a_turned_scene_equals_the_drawing_from_the_same_side(
    make, sides, page, tmp_path, monkeypatch
):
    """The point at which a line leaves a body may be a pixel or two off, so a few pixels differ."""
    monkeypatch.setenv("RBCOURSE_FIGURES", str(tmp_path))
    fig, ax = plt.subplots(**SIZE)
    make(ax)
    fig.set_layout_engine("none")
    ax.view_init(20, -60)
    player = save_figure(fig, "scene", {"t [1]": [0]}, "A scene that can be turned.")
    canvas, now = put(page, player), (20, -60)
    for side in sides:
        turn_to(page, canvas, now, side)
        assert told(side) in canvas.get_attribute("aria-label")
        now = side
        ax.view_init(*side)
        fig.savefig(full := io.BytesIO(), format="png", dpi=240)
        check_alike(shown(canvas), full.getvalue(), player.background)


def test_the_browser_cuts_and_orders_parts_as_python_does(page):
    """The parts, their order, their places, and the phases of their dashes are the same.

    The parts do not overlap in this test. Otherwise, rounding would decide how pieces are cut.
    """
    fig, ax = plt.subplots(**SIZE)
    crossing(ax)
    display = Display(fig)
    known = {"state": display.record([]).tolist(), "styles": list(display.styles)}
    known |= {"room": display.rooms[0], "views": [side[::-1] for side in SIDES]}
    page.add_script_tag(content=ENGINE.replace("const rbcourse", "globalThis.rbcourse"))
    page.evaluate("rbcourseScene.overlap = 0")
    for side, found in zip(SIDES, page.evaluate(SEEN, known), strict=True):
        ax.view_init(*side)
        sight = ax.sight()
        want = in_sight(ax.scene.pieces(display), sight.eye)
        for part, piece in zip(found, want, strict=True):
            assert (part["style"][0] is None) == (piece.fill is None)
            flat = sight.flat(piece.places[:, :3]) * [1, -1] + [0, display.height]
            run = np.array(part["runs"][0])[: len(flat)]
            assert np.abs(run - flat).max() < 0.5  # in pixels
            if piece.gc.get_dashes()[1]:
                assert abs(part["along"] - piece.places[0, 3]) < 1
    plt.close(fig)


@plt.style.context(STYLES)
def test_buttons_and_keys_set_the_view(timed, tmp_path):
    fig, axes = plt.subplots(1, 2, dpi=80, subplot_kw={"projection": "space"})
    motion = rb.screw(np.eye(4), GOAL)(np.linspace(0, 1, 5))
    update = bodies.moving_boxes(axes, {"one": motion, "other": motion}, edges=1)
    player = animate.animate(fig, "player", "Two cubes.", update, 5, still=0)
    plt.close(fig)
    canvas = put(timed, player)
    view, time = timed.locator(".rbcourse-view output"), timed.locator("input")
    first = told((18, -22))
    expect(view).to_have_text(first)
    assert canvas.get_attribute("aria-label") == f"Two cubes. {first}"
    seen = {first: shown(canvas)}
    for name, side in {"front": (0, -90), "side": (0, 0), "top": (90, -90)}.items():
        timed.get_by_role("button", name=name).press("Enter")
        expect(view).to_have_text(told(side))
        seen[told(side)] = shown(canvas)
    assert len(set(seen.values())) == 4
    timed.clock.run_for(500)
    expect(timed.locator("[role=status]")).to_have_text(told((90, -90)))
    canvas.press("ArrowUp")
    expect(view).to_have_text(told((90, -90)))  # the view does not pass over the top
    for key in ("Home", "ArrowRight", "ArrowDown"):
        canvas.press(key)
    expect(view).to_have_text(told((13, -27)))
    timed.get_by_role("button", name="first view").click()
    expect(view).to_have_text(first)
    assert shown(canvas) == seen[first]
    time.press("End")  # the view is kept while time runs
    timed.get_by_role("button", name="side").click()
    time.press("Home")
    expect(view).to_have_text(told((0, 0)))
    assert shown(canvas) == seen[told((0, 0))]
    with timed.expect_download() as download:
        timed.get_by_role("button", name="save picture").click()
    download.value.save_as(tmp_path / "saved.png")
    assert np.array_equal(pixels((tmp_path / "saved.png").read_bytes()), pixels(shown(canvas)))
    assert re.fullmatch(r"\w+\.png", download.value.suggested_filename)


def test_a_finger_turns_a_scene_sideways_on_a_phone(context):
    size = {"width": 390, "height": 800}
    phone = context.browser.new_context(viewport=size, has_touch=True, device_scale_factor=2)
    page = phone.new_page()
    show(page, "cube")
    canvas, view = page.locator("canvas"), page.locator(".rbcourse-view output")
    box, before = canvas.bounding_box(), view.inner_text()
    assert box["width"] <= 390
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    touch = phone.new_cdp_session(page)
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    for kind, dx in (("Start", 0), ("Move", 20), ("Move", 40), ("Move", 60), ("End", None)):
        points = [] if dx is None else [{"x": x + dx, "y": y}]
        touch.send("Input.dispatchTouchEvent", {"type": f"touch{kind}", "touchPoints": points})
    expect(view).not_to_have_text(before)
    assert "elevation 18°" in view.inner_text()
    phone.close()
