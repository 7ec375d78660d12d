"""Compare the explorers that pages compute with those in Python."""

import numpy as np
import pytest
from matplotlib.text import Text
from pages import check_alike, shown, watched
from playwright.sync_api import expect

from rbclassroom import explorers
from rbclassroom.explorers.recorded import COMPUTED, living
from rbcourse.arm import LINKS, arm_forward_kinematics, arm_inverse_kinematics
from rbcourse.planar import compose_planar, exp_planar
from rbcourse.straight_line import line_singular_value, theta

NAMES = ["arm", "planar", "theta"]
UNIT = 1 / 8
"""The unit of coordinates in pictures, in pixels."""


@pytest.fixture
def page(context):
    with watched(context) as page:
        page.set_content("<!DOCTYPE html><meta charset='utf-8'>")
        page.add_script_tag(content=COMPUTED.replace("const rbcourse", "globalThis.rbcourse"))
        yield page


def from_page(page, name, inputs):
    call = f"(all) => all.map((given) => rbcourseComputed.math.{name}(...given))"
    return np.array(
        page.evaluate(call, [[np.asarray(x).tolist() for x in each] for each in inputs])
    )


def test_functions_agree_with_those_in_python(page):
    rng = np.random.default_rng(1)
    poses, twists = rng.normal(size=(2, 1000, 3)) * [3, 3, 2]
    twists[0] = 0
    q = rng.uniform(-np.pi, np.pi, (1000, 2))
    tips = arm_forward_kinematics(q).joints[:, -1]
    t, a = rng.random(1000), rng.uniform(1e-3, np.pi - 1e-3, 1000)
    wanted = {
        "compose_planar": (compose_planar(poses, twists), zip(poses, twists, strict=True)),
        "exp_planar": (exp_planar(twists), ([each] for each in twists)),
        "arm_forward_kinematics": (arm_forward_kinematics(q).joints, ((x, LINKS) for x in q)),
        "arm_inverse_kinematics": (arm_inverse_kinematics(tips), ((x, LINKS) for x in tips)),
        "theta": (theta(t, a), zip(t, a, strict=True)),
        "theta_rate": (theta(t, a, 1), zip(t, a, strict=True)),
        "singular_value": (line_singular_value(t, a), zip(t, a, strict=True)),
    }
    for name, (right, inputs) in wanted.items():
        scale = max(1, np.abs(right).max())
        np.testing.assert_allclose(from_page(page, name, inputs), right, rtol=0, atol=1e-12 * scale)


def values_of(explorer):
    """Yield random values of all controls, and all values of each control on its own."""
    rng, steps = np.random.default_rng(1), {}
    for name, control in explorer.controls.items():
        listed = getattr(control, "options", None)
        if listed is None:
            count = round((control.max - control.min) / control.step) + 1
            steps[name] = np.linspace(control.min, control.max, count).round(9).tolist()
        else:
            steps[name] = [value for _, value in listed]
    for _ in range(200):
        yield {name: rng.choice(each).item() for name, each in steps.items()}
    for name, each in steps.items():
        for value in each:
            yield explorer.values | {name: value}


@pytest.mark.parametrize("name", NAMES)
def test_each_state_agrees_with_that_of_python(page, name):
    explorer = getattr(explorers, f"{name}_explorer")()
    explorer._resting = True  # the widgets are not shown
    trials = list(values_of(explorer))
    call = f"(all) => all.map((values) => rbcourseComputed.{name}.show(values))"
    found = page.evaluate(call, [list(values.values()) for values in trials])
    for values, state in zip(trials, found, strict=True):
        texts = explorer.state(**values).texts[0]
        assert [tuple(pair) for pair in state["said"]] == texts, values
        for key, artist in explorer.artists.items():
            points = np.array(state["points"][key], float)
            is_text = isinstance(artist, Text)
            right = [artist.get_position()] if is_text else getattr(artist, "get_xy", list)()
            right = right if len(right) else artist.get_xydata()
            pixels = [artist.axes.transData.transform(each) for each in (points, right)]
            pixels[0] = np.round(pixels[0]) if is_text else pixels[0]
            assert np.abs(pixels[0] - pixels[1]).max() <= (1 if is_text else UNIT), (values, key)


@pytest.mark.parametrize("name", NAMES)
def test_sliders_give_the_pictures_of_python(page, name):
    page.set_viewport_size({"width": 1400, "height": 1400})
    page.set_content(f"<!DOCTYPE html><meta charset='utf-8'>{living(name)}")
    canvas, sliders = page.locator("canvas"), page.locator("input[type=range]").all()
    explorer = getattr(explorers, f"{name}_explorer")()
    expect(canvas).to_have_attribute("aria-label", repr(explorer))
    canvas.evaluate("(canvas) => { canvas.style = 'display: block; width: 1120px'; }")
    rng, values = np.random.default_rng(1), {}
    for _ in range(3):
        for slider, key in zip(sliders, explorer.controls, strict=True):
            slider.fill(str(rng.integers(int(slider.get_attribute("max")) + 1)))
            text = slider.get_attribute("aria-valuetext")
            values[key] = float(text.replace("−", "-"))
        state = explorer.state(**values)
        check_alike(shown(canvas), explorer.draw(state.shown, zoom=2), explorer.background)
        assert canvas.get_attribute("aria-label") == state.texts[-1]


def test_the_hand_follows_the_pointer(page):
    page.set_content(f"<!DOCTYPE html><meta charset='utf-8'>{living('arm')}")
    canvas = page.locator("canvas")
    expect(canvas).to_be_visible()
    explorer = explorers.arm_explorer()
    width, height = explorer.display.size
    axes = explorer.artists["links"].axes
    box = canvas.bounding_box()
    page.mouse.move(box["x"] + width / 2, box["y"] + height / 2)
    page.mouse.down()
    for place in ((2.5, 1.0), (-1.2, 2.2), (-2.0, -1.5)):
        x, y = axes.transData.transform(place)
        page.mouse.move(box["x"] + x, box["y"] + height - y)
        hand = ", ".join(f"{each:.1f}" for each in place).replace("-", "−")
        shown = page.locator("td").last.inner_text()
        numbers = [float(each.replace("−", "-")) for each in shown.strip("() m").split(", ")]
        assert np.abs(np.subtract(numbers, place)).max() < 0.02, (hand, shown)
    expect(page.locator("output").last).to_have_text("1.00")
    before = page.locator("td").last.inner_text()
    page.mouse.move(box["x"] + 1, box["y"] + 1)  # out of reach
    assert page.locator("td").last.inner_text() == before
    page.mouse.up()
