"""Explorers are recorded completely, and only once; the browser's tests compare their states."""

import pytest
from sweeps import made

from rbclassroom import explorers
from rbclassroom.explorers import recorded


def test_every_explorer_is_recorded():
    names = *recorded.MOVED, *recorded.SCRIPTED
    assert sorted(f"{name}_explorer" for name in names) == explorers.__all__


def test_records_have_the_same_bytes_each_time():
    theta = made("theta")
    theta.restart()
    moved = {"angle": [60.0, 120.0]}
    one, other = (recorded.record(theta, "theta", moved) for _ in "ab")
    assert one._repr_html_() == other._repr_html_()
    for k, angle in enumerate((60.0, 120.0)):
        assert one.texts[101 * k + 30] == theta.state(angle=angle, t=0.3).texts
    said = "These controls are fixed here: "
    assert said not in one.caption
    assert said + theta.controls["angle"].description in recorded.record(theta, "theta", {}).caption
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
