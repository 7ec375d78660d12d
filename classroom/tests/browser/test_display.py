"""Players in Chromium: the canvas beside Matplotlib's own picture of the same frame."""

import io

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.patches import Annulus
from pixels import check_alike, shown

import rbcourse as rb
from rbclassroom.figures import lesson08, lesson11
from rbcourse.draw import animate, bodies, plane, spheres

TIMES = np.linspace(0, 1, 21)
GOAL = rb.pose_from_coordinates([0.5, 1.0, 0.5, 3, 2, 1])


def cubes():
    fig, ax = plt.subplots(figsize=(4, 4), dpi=80, subplot_kw={"projection": "space"})
    return fig, bodies.moving_boxes([ax], {"cube": rb.screw_se3(np.eye(4), GOAL)(TIMES)}, edges=1)


def book():
    fig, ax = plt.subplots(figsize=(4, 4), dpi=80, subplot_kw={"projection": "space"})
    R = rb.geodesic_so3(np.eye(3), GOAL[:3, :3])(TIMES)
    return fig, lesson08.moving_book(ax, TIMES, R, (0.2, 0.16, 0.03))


def points():
    fig, ax = plt.subplots(figsize=(4, 4), dpi=80, subplot_kw={"projection": "space"})
    v0 = rb.sample_rotation(20, rng=np.random.default_rng(1))[:, :, 2]
    return fig, spheres.moving_images([ax], {"points": (v0, 0.9 * v0 + 0.1)})


def rectangle():
    fig, ax = plt.subplots(figsize=(5, 4), dpi=80)
    path = rb.planar.interpolate_planar([0, 0, 0], [4, 2, 2], steps=20)
    return fig, plane.moving_route(ax, path, 1.2, shown=range(0, 21, 5))


def construction():
    fig = plt.figure(figsize=(9, 5), dpi=80)
    axes = fig.add_subplot(1, 2, 1), fig.add_subplot(1, 2, 2, projection="space")
    flat = np.array([[0.0, 0], [1, 2], [3, 2], [4, 0]])
    ends = np.eye(3), GOAL[:3, :3], [1, 0, 0], [0, 2, 0]
    return fig, lesson11.moving_casteljau(axes, TIMES, flat, ends, np.array([1.0, 0, 0]))


def rings():
    """Holes, dashes, corners, and what is cut at the edges of the axes, in a wide picture."""
    fig, ax = plt.subplots(figsize=(9, 4), dpi=80)
    ax.set(xlim=(0, 9), ylim=(0, 4))
    ring = ax.add_patch(Annulus((0, 2), 1.9, 1.2, fc="#0072B2", ec="black", lw=4))
    (line,) = ax.plot([0, 2, 4, 9], [0, 4, 0, 30], color="#D55E00", ls=(0, (4, 2)), lw=12)

    def update(i):
        ring.center = i / 4, 2
        line.set_xdata([i / 4, 2, 4, 9])
        return [ring, line]

    return fig, update


@pytest.mark.parametrize("make", [cubes, book, points, rectangle, construction, rings])
def test_a_player_draws_what_matplotlib_draws(make, page):
    with plt.style.context(["default", "rbcourse.rbcourse"]):
        fig, update = make()
        animation = animate.animate(fig, "player", "what moves", update, 20)
    page.set_content(f"<!doctype html>{animation._repr_html_()}")
    page.set_viewport_size({"width": 1600, "height": 1000})
    slider, canvas = page.locator("input"), page.locator("canvas")
    canvas.evaluate("(canvas) => canvas.style.width = 2 * parseFloat(canvas.style.width) + 'px'")
    for frame in (0, 7, 19):
        slider.fill(str(frame))
        for artist in update(frame):
            artist.set_animated(False)
        full = io.BytesIO()
        with plt.style.context(["default", "rbcourse.rbcourse"]):
            fig.savefig(full, format="png", dpi=2 * fig.dpi)
        check_alike(shown(canvas), full.getvalue(), animation.background)
    plt.close(fig)


def test_a_player_plays_pauses_and_begins_again(page):
    with plt.style.context(["default", "rbcourse.rbcourse"]):
        fig, update = cubes()
        animation = animate.animate(fig, "player", "what moves", update, 20, seconds=0.8, still=0)
        plt.close(fig)
    page.set_content(f"<!doctype html>{animation._repr_html_()}")
    button = page.get_by_role("button", name="play or pause")
    slider = page.locator("input")
    assert page.get_by_role("img", name="what moves").count() == 1
    button.focus()
    page.keyboard.press("Enter")
    page.wait_for_function("document.querySelector('input').value > 3")
    page.keyboard.press("Enter")
    paused = slider.input_value()
    page.wait_for_timeout(200)
    assert slider.input_value() == paused
    slider.focus()
    page.keyboard.press("End")
    assert slider.get_attribute("aria-valuetext") == "100 %"


def test_without_what_it_takes_the_still_stays(page):
    with plt.style.context(["default", "rbcourse.rbcourse"]):
        fig, update = cubes()
        animation = animate.animate(fig, "player", "what moves", update, 3)
        plt.close(fig)
    page.set_content(
        "<!doctype html><script>DecompressionStream = undefined</script>" + animation._repr_html_()
    )
    page.wait_for_timeout(500)
    assert page.locator("img").is_visible()
    assert page.locator("button").count() == 0
