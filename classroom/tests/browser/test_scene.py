"""What is in space, turned in Chromium: seen from each side as Python draws it from there."""

import io
import re

import matplotlib.pyplot as plt
import numpy as np
import pytest
from PIL import Image
from pixels import check_alike, pixels, shown
from playwright.sync_api import expect
from test_recorded import FOLDER

import rbcourse as rb
from rbclassroom import explorers
from rbcourse.draw import animate, bodies, save_figure, spheres
from rbcourse.draw.display import ENGINE, Display
from rbcourse.draw.scene import in_sight

TIMES = np.linspace(0, 1, 21)
GOAL = rb.pose_from_coordinates([0.5, 1.0, 0.5, 3, 2, 1])
SIDES = [(elev, azim) for elev in (-50, 5, 60) for azim in (-170, -80, 10, 100)]
"""Twelve sides from which one can look."""


def book():
    """A book with its three axes through it."""
    fig, ax = plt.subplots(figsize=(4, 4), dpi=100, subplot_kw={"projection": "space"})
    R = rb.sample_rotation(rng=np.random.default_rng(1))
    bodies.draw_box(ax, rb.pose_from_components(R, np.zeros(3)), np.array([0.2, 0.13, 0.03]))
    for axis, colour in zip(R.T, ("red", "green", "blue"), strict=True):
        ax.plot(*np.outer(axis, [-0.16, 0.16]), color=colour, lw=3.5)
    ax.fit(np.full(3, -0.16), np.full(3, 0.16))
    return fig, ax


def sphere():
    """A sphere with points, and a line that goes through it."""
    fig, ax = plt.subplots(figsize=(4, 4), dpi=100, subplot_kw={"projection": "space"})
    spheres.draw_sphere(ax)
    ax.plot(*rb.sample_rotation(80, rng=np.random.default_rng(2))[:, :, 0].T, "o", color="red")
    ax.plot([-1.2, 1.2], [0.3, -0.3], [0, 0], color="blue", lw=3)
    return fig, ax


def crossing():
    """Two boxes that pass through one another, dashes through both, and letters."""
    fig, ax = plt.subplots(figsize=(4, 4), dpi=100, subplot_kw={"projection": "space"})
    ax.plot([-0.7, 0.7], [0.3, 0.3], [0.15, 0.15], color="green", lw=5)  # on the box
    bodies.draw_box(ax, np.eye(4), np.array([1.6, 0.8, 0.3]))
    bodies.draw_box(ax, rb.pose_from_coordinates([0.5, 0.4, 1.0, 0.2, 0.1, 0.1]), 0.7)
    ax.plot([-1, 1], [-0.8, 0.9], [0.3, -0.2], color="black", lw=3, ls="--")
    ax.text(0.9, 0, 0.4, "letters", ha="center")
    ax.fit(np.full(3, -1), np.full(3, 1))
    return fig, ax


def far():
    """Cubes and a floor that are not about the origin, a line that leaves the picture, a legend."""
    fig, ax = plt.subplots(figsize=(4, 4), dpi=100, subplot_kw={"projection": "space"})
    poses = rb.screw_se3(np.eye(4), GOAL)(TIMES[::4])
    poses[:, :3, 3] += [100, 3, 7]
    bodies.draw_cube_motion(ax, poses, side=1)
    ax.plot([50, 150], [-10, 20], [7, 7], color="blue", lw=3, label="a line")
    ax.legend(loc="upper left")
    return fig, ax


def turn_to(page, canvas, now, side):
    """Drag from a view to another one: half a degree for a pixel, in steps within the canvas."""
    (elev, azim), box = side, canvas.bounding_box()
    steps = max(abs(azim - now[1]), abs(elev - now[0])) // 60 + 1
    for _ in range(int(steps)):
        dx, dy = -2 * (azim - now[1]) / steps, 2 * (elev - now[0]) / steps
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        page.mouse.move(x - dx / 2, y - dy / 2)
        page.mouse.down()
        page.mouse.move(x + dx / 2, y + dy / 2)
        page.mouse.up()


def told(side):
    elev, azim = (f"{round(angle)}".replace("-", "−") for angle in side)
    return f"Seen from azimuth {azim}°, elevation {elev}°."


def put(page, figure):
    page.set_content(f"<!doctype html><body>{figure._repr_html_()}")
    page.set_viewport_size({"width": 1600, "height": 1300})
    canvas = page.locator("canvas")
    canvas.evaluate("(canvas) => { canvas.style.maxWidth = 'none'; canvas.style.width = '960px'; }")
    return canvas


@pytest.mark.parametrize("make", [book, sphere, crossing, far])
def test_from_twelve_sides_it_is_what_python_draws_from_there(make, page, tmp_path, monkeypatch):
    """Where lines leave a body, too: within a pixel or two, as many pixels as differ are few."""
    monkeypatch.setenv("RBCOURSE_FIGURES", str(tmp_path))
    with plt.style.context(["default", "rbcourse.rbcourse"]):
        fig, ax = make()
        fig.set_layout_engine("none")
        ax.view_init(20, -60)
        figure = save_figure(fig, "scene", {"t [1]": [0]}, "What can be turned.")
        canvas, now = put(page, figure), (20, -60)
        for side in SIDES:
            turn_to(page, canvas, now, side)
            assert told(side) in canvas.get_attribute("aria-label")
            now = side
            ax.view_init(*side)
            full = io.BytesIO()
            fig.savefig(full, format="png", dpi=240)
            check_alike(shown(canvas), full.getvalue(), figure.background)


def test_the_corners_are_at_the_same_pixels_and_the_poses_those_of_the_motion(page):
    """Of a cube at all times: as Matplotlib projects its corners, and as rbcourse has its poses."""
    motion = rb.screw_se3(np.eye(4), GOAL)
    fig, ax = plt.subplots(figsize=(4, 4), dpi=80, subplot_kw={"projection": "space"})
    cube = bodies.draw_box(ax, np.eye(4), 1.0)
    ax.fit(np.full(3, -1.5), np.full(3, 4.5))
    display = Display(fig)
    sight = ax.sight()
    page.add_script_tag(content=ENGINE.replace("const rbcourse", "globalThis.rbcourse"))
    for t in TIMES:
        bodies.move_box(cube, motion(t), 1.0)
        state = display.record([cube])
        decoded, seen = page.evaluate(
            """({ state, styles, room }) => {
                const all = rbcourseDisplay.decode(Int16Array.from(state), styles);
                const pieces = all.map(({ style, runs }) =>
                    ({ kind: style[9], zorder: style[10], style, places: runs[0] }));
                const seen = rbcourseScene.seen(pieces, room, room.view);
                return [pieces.map(({ places }) => places),
                        seen.filter(({ style }) => style[0]).map(({ runs }) => runs[0])];
            }""",
            {
                "state": state.tolist(),
                "styles": list(display.styles),
                "room": display.rooms[0],
            },
        )
        places = np.array(decoded) / sight.scale + sight.middle
        R = 2 * (places[:3].mean(axis=1) - places[:6].mean(axis=(0, 1))).T
        off = np.degrees(rb.angle_between(motion(t)[:3, :3], rb.project_so(R)))
        assert off < 0.2
        room = 6.0
        assert np.abs(places[:6].mean(axis=(0, 1)) - motion(t)[:3, 3]).max() < 0.01 * room
        want = sight.flat(sight.scale * (cube.corners.reshape(-1, 3) - sight.middle))
        want = want * [1, -1] + [0, display.height]
        for corner in np.concatenate([np.array(run) for run in seen]):
            assert np.linalg.norm(want - corner, axis=1).min() < 0.02 * sight.scale  # of its side
    plt.close(fig)


@pytest.mark.parametrize("side", SIDES)
def test_the_browser_cuts_and_orders_as_python_does(side, page):
    """The same parts, one after the other, at the same places, dashes as far along their line."""
    fig, ax = crossing()
    display = Display(fig)
    state = display.record([])
    ax.view_init(*side)
    sight = ax.sight()
    want = in_sight(ax.scene.pieces(display), sight.eye)
    page.add_script_tag(content=ENGINE.replace("const rbcourse", "globalThis.rbcourse"))
    found = page.evaluate(
        """({ state, styles, room, view }) => {
            const all = rbcourseDisplay.decode(Int16Array.from(state), styles);
            const pieces = all.map(({ style, runs }) =>
                ({ kind: style[9], zorder: style[10], style, places: runs[0] }));
            return rbcourseScene.seen(pieces, room, view);
        }""",
        {
            "state": state.tolist(),
            "styles": list(display.styles),
            "room": display.rooms[0],
            "view": side[::-1],
        },
    )
    plt.close(fig)
    assert len(found) == len(want)
    for part, piece in zip(found, want, strict=True):
        assert (part["style"][0] is None) == (piece.fill is None)
        flat = sight.flat(piece.places[:, :3]) * [1, -1] + [0, display.height]
        run = np.array(part["runs"][0])[: len(flat)]
        assert np.abs(run - flat).max() < 0.5  # pixels
        if piece.gc.get_dashes()[1]:
            assert abs(part["along"] - piece.places[0, 3]) < 1


def test_buttons_and_keys_set_the_view_and_it_is_told(page):
    with plt.style.context(["default", "rbcourse.rbcourse"]):
        fig, axes = plt.subplots(1, 2, dpi=80, subplot_kw={"projection": "space"})
        motions = {name: rb.screw_se3(np.eye(4), GOAL)(TIMES) for name in ("one", "other")}
        update = bodies.moving_boxes(axes, motions, edges=1)
        animation = animate.animate(fig, "player", "Two cubes.", update, 20, still=0)
        plt.close(fig)
    canvas = put(page, animation)
    view = page.locator(".rbcourse-view output")
    first = told((18, -22))
    expect(view).to_have_text(first)
    assert canvas.get_attribute("aria-label") == f"Two cubes. {first}"
    seen = {first: shown(canvas)}
    for name, side in {"front": (0, -90), "side": (0, 0), "top": (90, -90)}.items():
        page.get_by_role("button", name=name).press("Enter")
        expect(view).to_have_text(told(side))
        seen[told(side)] = shown(canvas)
    assert len(set(seen.values())) == 4
    status = page.locator("[role=status]")
    expect(status).to_have_text(told((90, -90)))
    canvas.focus()
    page.keyboard.press("ArrowUp")
    expect(view).to_have_text(told((90, -90)))  # not over the top
    page.keyboard.press("Home")
    page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowDown")
    expect(view).to_have_text(told((13, -27)))
    page.get_by_role("button", name="as printed").click()
    expect(view).to_have_text(first)
    assert shown(canvas) == seen[first]
    page.locator("input").press("End")  # turning stays while time runs
    page.get_by_role("button", name="side").click()
    page.locator("input").press("Home")
    expect(view).to_have_text(told((0, 0)))
    assert shown(canvas) == seen[told((0, 0))]


def test_what_is_seen_can_be_saved(page, tmp_path):
    with plt.style.context(["default", "rbcourse.rbcourse"]):
        fig, _ = crossing()
        animation = animate.animate(fig, "player", "Two boxes.", lambda _: [], 1)
        plt.close(fig)
    canvas = put(page, animation)
    page.get_by_role("button", name="top").click()
    with page.expect_download() as download:
        page.get_by_role("button", name="save picture").click()
    download.value.save_as(tmp_path / "saved.png")
    saved = (tmp_path / "saved.png").read_bytes()
    assert np.array_equal(pixels(saved), pixels(shown(canvas)))
    assert re.fullmatch(r"\w+\.png", download.value.suggested_filename)


def test_a_finger_turns_it_sideways_on_a_phone(context):
    phone = context.browser.new_context(
        viewport={"width": 390, "height": 800}, has_touch=True, device_scale_factor=2
    )
    page = phone.new_page()
    page.goto((FOLDER / "cube.html").as_uri())
    canvas = page.locator("canvas")
    canvas.wait_for()
    box = canvas.bounding_box()
    assert box["width"] <= 390
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    before = page.locator(".rbcourse-view output").inner_text()
    touch = phone.new_cdp_session(page)
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    for kind, dx in (("touchStart", 0), ("touchMove", 20), ("touchMove", 40), ("touchMove", 60)):
        points = [{"x": x + dx, "y": y}]
        touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
    touch.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    expect(page.locator(".rbcourse-view output")).not_to_have_text(before)
    assert "elevation 18°" in page.locator(".rbcourse-view output").inner_text()
    phone.close()


@pytest.mark.parametrize("name", ["cube", "flip", "rotation", "screw", "chain", "random"])
def test_explorers_turn_without_python(name, page):
    page.goto((FOLDER / f"{name}.html").as_uri())
    canvas = page.locator("canvas")
    canvas.wait_for()
    explorer = getattr(explorers, f"{name}_explorer")()
    assert len(explorer.display.rooms) == (2 if name == "cube" else 1)
    before = shown(canvas)
    canvas.press("ArrowLeft")
    after = shown(canvas)
    assert Image.open(io.BytesIO(after)).size == Image.open(io.BytesIO(before)).size
    assert (pixels(after) != pixels(before)).any()
