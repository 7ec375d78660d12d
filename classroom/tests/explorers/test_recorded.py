"""The recorded explorers are complete and small, and their states equal those of the explorers."""

import base64
import html
import io
import json
import re
import zlib
from itertools import product

import ipywidgets
import numpy as np
import pytest
from PIL import Image
from quick import quick_for
from sweeps import made

from rbclassroom import explorers
from rbclassroom.course.agreement import polygons, split
from rbclassroom.explorers import recorded


def test_every_explorer_is_recorded():
    assert (
        sorted(f"{name}_explorer" for name in (*recorded.MOVED, *recorded.SCRIPTED))
        == explorers.__all__
    )


@pytest.mark.parametrize("name", quick_for(["body", "flip"], sorted(recorded.MOVED)))
def test_recorded_states_equal_the_states_of_the_explorer(name):
    """Record the first value of each control, its neighbours, and some steps."""
    explorer, moved = made(name), {}
    explorer.restart()
    for each, values in recorded.MOVED[name][0].items():
        at = list(values).index(explorer.values[each])
        moved[each] = list(values)[max(0, at - 1) : at + 2]
    stride = len(explorer.steps) // 3
    page = recorded.record(explorer, f"{name}_explorer", moved, stride)._repr_html_()
    assert not re.search(r'https?:|(?:src|href)="(?!data:)', page)
    without_scripts, _ = page.split("<script>")
    assert not re.search("<(button|input|canvas)", without_scripts)
    caption = html.unescape(re.search(r"<figcaption>(.*?)</figcaption>", without_scripts)[1])
    assert "you can move every control" in caption
    ((alt, png),) = re.findall(r'<img .*alt="(.*?)" src="data:image/png;base64,(.*?)"', page)
    assert html.unescape(alt) == repr(explorer)
    still, want = (
        np.asarray(Image.open(io.BytesIO(content)).convert("RGB"), dtype=int)
        for content in (base64.b64decode(png), explorer.draw(explorer.state().shown, zoom=2))
    )
    assert (np.abs(still - want).max(axis=-1) > 64).mean() < 1e-4

    data = json.loads(re.search(r"revive\(image, (\{.*\})\);\n", page)[1])
    plays, start = explorer.plays, explorer.time.index % stride
    steps = explorer.steps[start::stride]
    for each, kept in zip([*moved, plays], data["controls"], strict=True):
        control = explorer.controls[each]
        assert kept["label"] == control.description
        if isinstance(control, ipywidgets.FloatSlider):
            found = np.array([float(text.replace("−", "-")) for text in kept["values"]])
            assert found[kept["first"]] == control.value
            steps_from_least = (found - control.min) / control.step
            assert np.abs(steps_from_least - np.round(steps_from_least)).max() < 1e-9
        else:
            labels = list(control._options_labels)
            assert kept["values"] == (labels[start::stride] if each == plays else [*moved[each]])
            assert kept["values"][kept["first"]] == labels[control.index]
    for each, control in explorer.controls.items():
        assert (f"{control.description} = " in caption) == (each not in {*moved, plays})

    packed, known = (zlib.decompress(base64.b64decode(data[key])) for key in ("states", "known"))
    (styles, texts), states = json.loads(known), split(packed)
    places = list(product(*moved.values(), steps))
    assert len(states) == len(texts) == len(places)
    for k in range(len(states)):
        now = dict(zip([*moved, plays], places[k], strict=True))
        state = explorer.state(**now)
        assert texts[k] == json.loads(json.dumps(state.texts)), now
        drawn, kept = (
            polygons(state.drawn, list(explorer.display.styles)),
            polygons(states[k], styles),
        )
        drawn, kept = [*drawn], [*kept]
        assert len(drawn) == len(kept)
        for style, more, points in drawn:  # faces of equal depth may have another order
            alike = [
                found
                for look, goes_on, found in kept
                if (look, goes_on) == (json.loads(json.dumps(style)), more)
            ]
            far = [np.abs(points - found).max() for found in alike if found.shape == points.shape]
            assert min(far) < 0.2  # in pixels


def test_records_have_the_same_bytes_each_time():
    theta = made("theta")
    theta.restart()
    moved = {"angle": [60.0, 120.0]}
    one, other = (recorded.record(theta, "theta", moved) for _ in "ab")
    assert one._repr_html_() == other._repr_html_()
    for k, angle in enumerate((60.0, 120.0)):
        assert one.texts[101 * k + 30] == theta.state(angle=angle, t=0.3).texts
    assert "These controls are fixed here" not in one.caption
    with pytest.raises(ValueError, match="120"):
        recorded.record(theta, "theta", {"angle": [60.0]})


def test_an_explorer_is_recorded_once_until_its_code_changes(tmp_path, monkeypatch):
    asked = []
    monkeypatch.setattr(recorded.pooch, "os_cache", lambda _: tmp_path)
    monkeypatch.setattr(recorded, "record", lambda *given: asked.append(given[1]) or made("theta"))
    versions = iter(["one", "one", "two"])
    monkeypatch.setattr(recorded, "_version", lambda: next(versions))
    monkeypatch.setattr(type(made("theta")), "_repr_html_", lambda _: "<figure>", raising=False)
    for count in (1, 1, 2):
        assert recorded.living("spline") == "<figure>"
        assert asked == ["spline_explorer"] * count
