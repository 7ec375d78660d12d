"""Every explorer: complete, readable, and safe wherever its sliders are."""

import re

import ipywidgets
import numpy as np
import pytest
from matplotlib.text import Text
from sweeps import settings

from rbclassroom import explorers
from rbclassroom.explorers.explorer import LABELS


@pytest.fixture(scope="module", params=explorers.__all__)
def explorer(request):
    return getattr(explorers, request.param)()


def test_there_are_twelve():
    assert len(explorers.__all__) == 12
    assert explorers.__all__ == sorted(explorers.__all__)


def test_it_shows_something_before_it_is_touched(explorer):
    ((rows, notice, _),) = explorer.picture.run["texts"]
    assert len(explorer.picture.run["states"]) > 100
    assert notice == ""
    assert len(rows) >= 2
    assert not explorer.play.playing


SLIDERS = ipywidgets.FloatSlider, ipywidgets.SelectionSlider
WITHOUT_UNIT = {"time t", "seed", "rotations", "y leans", "z leans", "z stretched"} | {
    "pull (0 to 1)",
    "size s (1: paper's)",
    "turn (1: paper's)",
    "× Bessel's ω, v",
}


def test_every_label_has_its_unit_and_the_keyboard_reaches_every_control(explorer):
    for control in explorer.controls.values():
        label = control.description
        if isinstance(control, SLIDERS):
            assert control.continuous_update
            unit = re.search(r"\((°|°/s|cm|m|m/s|m/time|rad/time|s)\)$", label)
            assert unit or label in WITHOUT_UNIT, label
        else:
            assert isinstance(control, ipywidgets.ToggleButtons | ipywidgets.Dropdown)


def test_every_setting_gives_a_picture_and_says_something(explorer):
    """Each slider at eight or nine places, and all pairs of ends."""
    first = explorer.values
    chosen = [s for i, s in enumerate(settings(explorer)) if len(s) == 2 or i % 3 == 0]
    for setting in chosen:
        explorer.put(**first | setting)
        ((rows, notice, _),) = explorer.picture.run["texts"]
        assert len(rows) >= 2 or notice, setting
        for _, text in rows:
            assert not re.search(r"\bnan\b", text), setting
            assert not re.search(r"[-−]0\.?0*(?![.\d])", text), setting
    explorer.restart()


def test_letters_are_large_enough_and_every_artist_is_on_the_figure_once(explorer):
    for text in explorer._fig.findobj(Text):
        if text.get_visible() and text.get_text().strip():
            assert text.get_fontsize() >= LABELS, text.get_text()
    artists = list(explorer.artists.values())
    assert len({id(artist) for artist in artists}) == len(artists)
    assert all(artist.get_figure() is explorer._fig for artist in artists)


def test_playing_runs_through_the_whole_range(explorer):
    assert explorer.play.max == len(explorer.steps) - 1 >= 40
    chosen = [explorer.steps[i] for i in np.linspace(0, explorer.play.max, 5).astype(int)]
    states = [explorer.state(**{explorer.plays: value}) for value in chosen]
    assert len({state.drawn.tobytes() for state in states}) >= 4
