"""The bar that shows how far a computation is."""

import pytest

from rbcourse import progress


@pytest.fixture
def shown(monkeypatch):
    """What is displayed, and what takes its place."""
    stages = []

    class Handle:
        def update(self, stage):
            stages.append(stage)

    def display(stage, display_id):
        assert display_id
        stages.append(stage)
        return Handle()

    monkeypatch.setattr(progress, "display", display)
    return stages


def test_a_bar_grows_and_ends_as_a_line(shown):
    report = progress.bar("The atlas")
    report(5000, 20_000)
    report(20_000, 20_000)
    texts = [stage._repr_html_() for stage in shown]
    assert texts == [
        '<div><progress max="1" value="0"></progress> The atlas: 0 of 1</div>',
        '<div><progress max="20000" value="5000"></progress> The atlas: 5,000 of 20,000</div>',
        "<div>The atlas: 20,000 of 20,000</div>",
    ]
    assert repr(shown[-1]) == "The atlas: 20,000 of 20,000"
