"""Compare the explorers that pages compute with those in Python."""

import re

import numpy as np
import pytest
from matplotlib.text import Text
from mpl_toolkits.mplot3d.art3d import Text3D
from pages import check_alike, shown, watched
from playwright.sync_api import expect
from quick import quick_for

import rbcourse as rb
from rbclassroom import explorers
from rbclassroom.explorers.recorded import COMPUTED, SCRIPTED, living
from rbcourse.arm import LINKS, arm_forward_kinematics, arm_inverse_kinematics
from rbcourse.draw.display import ENGINE
from rbcourse.draw.space import Faces
from rbcourse.quaternion import quaternion_from_zyx
from rbcourse.straight_line import line_singular_value, theta

NAMES = list(SCRIPTED)
UNIT = 1 / 8
"""The unit of coordinates in pictures, in pixels."""


@pytest.fixture
def page(context):
    with watched(context) as page:
        page.set_content("<!DOCTYPE html><meta charset='utf-8'>")
        page.add_script_tag(
            content=(ENGINE + COMPUTED).replace("const rbcourse", "globalThis.rbcourse")
        )
        yield page


def from_page(page, name, inputs):
    call = f"(all) => all.map((given) => rbcourseDisplay.computed.math.{name}(...given))"
    return np.array(
        page.evaluate(call, [[np.asarray(x).tolist() for x in each] for each in inputs])
    )


def test_functions_agree_with_those_in_python(page):
    rng = np.random.default_rng(1)
    q = rng.uniform(-np.pi, np.pi, (1000, 2))
    tips = arm_forward_kinematics(q).joints[:, -1]
    t, a = rng.random(1000), rng.uniform(1e-3, np.pi - 1e-3, 1000)
    wanted = {
        "arm_forward_kinematics": (arm_forward_kinematics(q).joints, ((x, LINKS) for x in q)),
        "arm_inverse_kinematics": (arm_inverse_kinematics(tips), ((x, LINKS) for x in tips)),
        "theta": (theta(t, a), zip(t, a, strict=True)),
        "theta_rate": (theta(t, a, 1), zip(t, a, strict=True)),
        "singular_value": (line_singular_value(t, a), zip(t, a, strict=True)),
    }
    angles = rng.uniform(-np.pi, np.pi, (1000, 3))
    M, R = rng.normal(size=(1000, 3, 3)), rb.sample_rotation(1001, rng=rng)
    quaternions = rb.quaternion_from_matrix(R)
    arcs = list(zip(quaternions[1:], quaternions[:-1], t, strict=True))
    gap = np.linalg.svd(M, compute_uv=False)[:, 1:] @ [1, 0]
    gap += np.sign(np.linalg.det(M)) * np.linalg.svd(M, compute_uv=False)[:, 2]
    M, G = M[gap > 1e-2], rb.projection.orthonormalize_gram_schmidt(M)
    wanted |= {
        "project_so": (rb.project_so(M), ([each] for each in M)),
        "orthonormalize_gram_schmidt": (G[gap > 1e-2], ([each] for each in M)),
        "det": (np.linalg.det(M), ([each] for each in M)),
        "angle_between": (rb.angle_between(R[1:], R[:-1]), zip(R[1:], R[:-1], strict=True)),
        "matrix_from_quaternion": (R, ([each] for each in quaternions)),
        "quaternion_from_matrix": (quaternions, ([each] for each in R)),
        "exp_so3": (rb.exp_so3(4 * M[:, 0]), ([4 * each[0]] for each in M)),
        "log_so3": (rb.log_so3(R), ([each] for each in R)),
        "matrix_from_zyx": (rb.matrix_from_zyx(angles), ([each] for each in angles)),
        "slerp": (
            np.array([rb.slerp(*each) for each in arcs]),
            arcs,
        ),
        "quaternion_from_zyx": (quaternion_from_zyx(angles), ([each] for each in angles)),
        "exp_planar": (rb.planar.exp_planar(angles), ([each] for each in angles)),
        "compose_planar": (
            rb.planar.compose_planar(angles, angles[::-1]),
            zip(angles, angles[::-1], strict=True),
        ),
    }
    for name, (right, inputs) in wanted.items():
        scale = max(1, np.abs(right).max())
        found = from_page(page, name, inputs)
        assert np.abs(found - right).max() <= 1e-12 * scale, name


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
    for _ in range(50):
        yield {name: rng.choice(each).item() for name, each in steps.items()}
    for name, each in steps.items():
        for value in each:
            yield explorer.values | {name: value}


def alike(said, texts):
    """Compare texts; numbers may differ by rounding, in the last digit."""
    number = r"−?\d+\.?(\d*)"
    for one, other in zip(said, texts, strict=True):
        one, other = " ".join(one), " ".join(other)
        if re.sub(number, "#", one) != re.sub(number, "#", other):
            return False
        for x, y in zip(re.finditer(number, one), re.finditer(number, other), strict=True):
            far = abs(float(x[0].replace("−", "-")) - float(y[0].replace("−", "-")))
            if far > 1.01 * 10.0 ** -len(x[1]):
                return False
    return True


@pytest.mark.parametrize("stride", [8, pytest.param(1, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", NAMES)
def test_each_state_agrees_with_that_of_python(page, name, stride):
    explorer = getattr(explorers, f"{name}_explorer")()
    explorer._resting = True  # the widgets are not shown
    trials = list(values_of(explorer))[::stride]
    call = f"(all) => all.map((values) => rbcourseDisplay.computed.{name}.show(values))"
    found = page.evaluate(call, [list(values.values()) for values in trials])
    for values, state in zip(trials, found, strict=True):
        texts = list(explorer._show(**values).items())  # without a picture
        assert alike(state["said"], texts), values
        for key, artist in explorer.artists.items():
            points = np.array(state["points"][key], float)
            if isinstance(artist, Faces):
                far = artist.axes.sight().scale * np.abs(points - artist.corners).max()
                assert far <= UNIT, (values, key)
                continue
            if not points.size:
                assert not artist.get_text()
                continue
            if points.shape[1] == 3:
                is_text = isinstance(artist, Text3D)
                place = artist.get_position_3d() if is_text else np.transpose(artist.get_data_3d())
                far = artist.axes.sight().scale * np.abs(points - place).max()
                several = "nearest?" in dict(texts) and "nearest" in key
                assert far <= UNIT or several, (values, key)
                continue
            is_text = isinstance(artist, Text)
            right = [artist.get_position()] if is_text else getattr(artist, "get_xy", list)()
            right = right if len(right) else artist.get_xydata()
            pixels = [artist.axes.transData.transform(each) for each in (points, right)]
            pixels[0] = np.round(pixels[0]) if is_text else pixels[0]
            assert np.abs(pixels[0] - pixels[1]).max() <= (1.01 if is_text else UNIT), (values, key)


@pytest.mark.parametrize("name", quick_for(["arm", "projection", "screw"], NAMES))
def test_sliders_give_the_pictures_of_python(page, name):
    page.set_viewport_size({"width": 1400, "height": 1400})
    page.set_content(f"<!DOCTYPE html><meta charset='utf-8'>{living(name)}")
    canvas, explorer = page.locator("canvas"), getattr(explorers, f"{name}_explorer")()
    expect(canvas).to_be_visible()
    sliders = page.locator("input[type=range]").all()
    seen = page.locator(".rbcourse-view output").all_inner_texts()
    assert canvas.get_attribute("aria-label") == " ".join([repr(explorer), *seen])
    canvas.evaluate("(canvas) => { canvas.style = 'display: block; width: 1120px'; }")
    rng, values = np.random.default_rng(1), {}
    for _ in range(3):
        for slider, key in zip(sliders, SCRIPTED[name], strict=True):
            slider.fill(str(rng.integers(int(slider.get_attribute("max")) + 1)))
            text = slider.get_attribute("aria-valuetext")
            values[key] = float(text.replace("−", "-"))
        state = explorer.state(**values)
        check_alike(shown(canvas), explorer.draw(state.shown, zoom=2), explorer.background)
        assert canvas.get_attribute("aria-label") == " ".join([state.texts[-1], *seen])


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


def test_the_point_on_the_line_follows_the_pointer_and_reset_returns_to_the_start(page):
    page.set_content(f"<!DOCTYPE html><meta charset='utf-8'>{living('theta')}")
    canvas, explorer = page.locator("canvas"), explorers.theta_explorer()
    expect(canvas).to_be_visible()
    first, box = canvas.get_attribute("aria-label"), canvas.bounding_box()
    half = np.sin(np.radians(explorer.values["angle"]) / 2)
    for time in (0.8, 0.25):
        place = ((2 * time - 1) * half, 0.5)
        x, y = explorer.artists["line"].axes.transData.transform(place)
        page.mouse.click(box["x"] + x, box["y"] + explorer.display.size[1] - y)
        expect(page.locator("output").last).to_have_text(f"{time:.2f}")
        explorer._answer(None, {"place": [x / 560, 1 - y / 380]}, None)
        assert explorer.values["t"] == pytest.approx(time, abs=0.006)
    page.get_by_role("slider", name="angle").fill("90")
    page.get_by_role("button", name="Reset").click()
    expect(canvas).to_have_attribute("aria-label", first)
