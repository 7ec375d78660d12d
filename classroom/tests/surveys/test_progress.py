"""The bar that shows how far a computation is."""

import pytest

from rbclassroom.surveys import progress


@pytest.fixture
def shown(monkeypatch):
    """What is displayed, and what takes its place."""
    stages = []

    class Handle:
        def update(self, stage):
            stages.append(stage._repr_html_())

    def display(stage, display_id):
        assert display_id
        stages.append(stage._repr_html_())
        return Handle()

    monkeypatch.setattr(progress, "display", display)
    return stages


def test_a_bar_grows_and_ends_as_a_line(shown):
    report = progress.bar("A < B")
    report(5000, 20_000)
    report(20_000, 20_000)
    assert shown == [
        '<div><progress max="20000" value="5000"></progress> A &lt; B: 5,000 of 20,000</div>',
        "<div>A &lt; B: 20,000 of 20,000</div>",
    ]


def test_where_there_is_no_notebook_lines_are_printed(monkeypatch, capsys):
    monkeypatch.setattr(progress, "display", lambda stage, display_id: print(stage))
    report = progress.bar("Problems")
    report(1, 2)
    report(2, 2)
    assert capsys.readouterr().out == "Problems: 1 of 2\nProblems: 2 of 2\n"
