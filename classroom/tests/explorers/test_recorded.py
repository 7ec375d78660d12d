"""The recorded explorers: whole, small, and in every state what the explorer itself shows."""

import base64
import html
import io
import json
import re
import zlib
from pathlib import Path

import ipywidgets
import numpy as np
import pytest
from PIL import Image

from rbclassroom import explorers
from rbclassroom.course.agreement import polygons, split
from rbclassroom.explorers import recorded

FOLDER = Path(__file__).parents[3] / "figures" / "explorers"


def test_every_explorer_is_recorded_and_together_they_are_small():
    pages = sorted(FOLDER.iterdir())
    assert [page.stem for page in pages] == [
        name[: -len("_explorer")] for name in explorers.__all__
    ]
    assert sorted(recorded.MOVED) == [page.stem for page in pages]
    assert sum(page.stat().st_size for page in pages) <= 3_000_000


@pytest.fixture(params=sorted(recorded.MOVED))
def stored(request):
    """The name of an explorer, the explorer, its page, and what the page holds."""
    page = (FOLDER / f"{request.param}.html").read_text(encoding="utf-8")
    data = json.loads(re.search(r"revive\(image, (\{.*\})\);\n", page)[1])
    states, known = (zlib.decompress(base64.b64decode(data[key])) for key in ("states", "known"))
    data["states"], (data["styles"], data["texts"]) = split(states), json.loads(known)
    return request.param, getattr(explorers, f"{request.param}_explorer")(), page, data


def test_the_states_are_those_of_the_explorer(stored):
    """At states of which those who recorded them knew nothing."""
    name, explorer, _, data = stored
    moved, values = recorded.MOVED[name]
    values = list(explorer.controls[moved].options) if values is None else values.tolist()
    steps = explorer.steps
    assert len(data["states"]) == len(data["texts"]) == len(values) * len(steps)
    rng = np.random.default_rng(1)
    for k in rng.choice(len(data["states"]), 12, replace=False):
        now = {moved: values[k // len(steps)], explorer.plays: steps[k % len(steps)]}
        state = explorer.state(**now)
        assert data["texts"][k] == json.loads(json.dumps(state.texts)), now
        want = polygons(state.drawn, list(explorer.display.styles))
        have = polygons(data["states"][k], data["styles"])
        for (style, more, places), (kept, goes_on, found) in zip(want, have, strict=True):
            assert json.loads(json.dumps(style)) == kept
            assert more == goes_on
            assert np.abs(places - found).max() < 0.2  # pixels


def test_the_values_are_steps_of_the_slider_and_the_first_is_what_the_explorer_starts_with(stored):
    name, explorer, _, data = stored
    moved, _ = recorded.MOVED[name]
    for control, kept in zip(
        (explorer.controls[moved], explorer.time), data["controls"], strict=True
    ):
        assert kept["label"] == control.description
        if isinstance(control, ipywidgets.FloatSlider):
            values = np.array([float(text.replace("−", "-")) for text in kept["values"]])
            assert values[kept["first"]] == control.value
            steps = (values - control.min) / control.step
            assert np.abs(steps - np.round(steps)).max() < 1e-9
        else:
            assert kept["values"] == list(control._options_labels)
            assert kept["values"][kept["first"]] == control._options_labels[control.index]


def test_what_stays_is_said_with_its_value(stored):
    _, explorer, page, data = stored
    caption = html.unescape(re.search(r"<figcaption>(.*?)</figcaption>", page)[1])
    moving = {control["label"] for control in data["controls"]}
    for control in explorer.controls.values():
        stays = f"{control.description} = " in caption
        assert stays != (control.description in moving)


def test_a_page_needs_nothing_else_and_has_its_still(stored):
    _, explorer, page, _ = stored
    assert not re.search(r'https?:|(?:src|href)="(?!data:)', page)
    alt = html.unescape(re.search(r'<img [^>]*alt="([^"]*)"', page)[1])
    assert alt == repr(explorer)
    assert page.count("<img ") == 1
    png = base64.b64decode(re.search(r'<img [^>]*src="data:image/png;base64,([^"]*)"', page)[1])
    still, want = (
        np.asarray(Image.open(io.BytesIO(content)).convert("RGB"), dtype=int)
        for content in (png, explorer.draw(explorer.state().shown, zoom=2))
    )
    assert (np.abs(still - want).max(axis=-1) > 64).mean() < 1e-4


def test_the_same_explorer_gives_the_same_page():
    pages = [
        recorded.record(explorers.theta_explorer(), "theta", "angle", [60.0, 120.0]) for _ in "ab"
    ]
    assert pages[0]._repr_html_() == pages[1]._repr_html_()


def test_a_value_that_is_not_among_them_is_refused():
    with pytest.raises(ValueError, match="120"):
        recorded.record(explorers.theta_explorer(), "theta", "angle", [60.0])
