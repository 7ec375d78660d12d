"""What all explorers have in common, on a small one."""

import io
import json
import warnings

import ipywidgets
import numpy as np
import pytest
from ipywidgets.widgets.widget import _remove_buffers
from PIL import Image
from sweeps import notice, tell
from traitlets import TraitError

from rbclassroom.course.agreement import polygons, split
from rbclassroom.explorers.explorer import LABELS, Explorer, look, new_figure, new_line
from rbclassroom.explorers.widgets import choice, slider, stepped

FAR, WARN = 9.0, 8.0


def show_in(line):
    def show(x, kind):
        if x == FAR:
            raise ValueError("x: too <far>")
        if x == WARN:
            warnings.warn("nearly too far", stacklevel=1)
        line.set_data([x], [0 if kind == "low" else 1])
        return {"place": f"{x:.1f}\n{kind}"}

    return show


@pytest.fixture
def explorer():
    with look():
        fig = new_figure()
        ax = fig.add_axes((0.1, 0.15, 0.8, 0.8))
        ax.set(xlim=(0, 10), ylim=(-1, 2))
        line = new_line(ax, marker="o", ls="", color="black")
    controls = {"x": stepped("x (m)", 2.0, 0.0, 10.0, 0.5), "kind": choice("kind", ["low", "high"])}
    return Explorer("A dot", fig, {"dot": line}, controls, show_in(line), plays="x", point=place)


def place(x, y):
    if x < 100:
        raise ValueError("click more to the right")
    return {"x": 4.0, "kind": "high"}


def sent(explorer):
    """What the browser was sent last: the places of the dots, by state, and the texts."""
    run = explorer.picture.run
    drawn = [polygons(state, run["styles"]) for state in split(run["states"])]
    return [[places[0] for *_, places in state] for state in drawn], run["texts"]


def at(x, y):
    """Where the dot is in the picture, in pixels from the upper left."""
    return 560 * (0.1 + 0.8 * x / 10), 380 * (1 - 0.15 - 0.8 * (y + 1) / 3)


def test_it_shows_something_before_it_is_touched(explorer):
    ((dots,), (texts,)) = sent(explorer)
    assert dots[0] == pytest.approx(at(2, 0), abs=0.07)
    assert texts == [[("place", "2.0\nlow")], "", "A dot. place: 2.0 low"]
    assert explorer.picture.run["index"] == 4
    assert not explorer.play.playing


def test_the_picture_follows_each_control_with_its_figure_and_its_artist(explorer):
    figure, dot = explorer._fig, explorer.artists["dot"]
    explorer.put(x=7.0)
    assert sent(explorer)[0][0] == [pytest.approx(at(7, 0), abs=0.07)]
    explorer.controls["kind"].value = "high"
    assert sent(explorer)[0][0] == [pytest.approx(at(7, 1), abs=0.07)]
    assert sent(explorer)[1][0][0] == [("place", "7.0\nhigh")]
    assert explorer._fig is figure
    assert list(figure.axes[0].lines) == [dot]


def test_the_browser_is_sent_the_states_it_asks_for_one_after_the_other(explorer):
    version, known = explorer.picture.run["version"], 0
    while known < 21:
        tell(explorer, index=known)
        assert explorer.picture.run["version"] == version
        assert explorer.picture.run["index"] == known
        dots, texts = sent(explorer)
        for dot, (rows, *_) in zip(dots, texts, strict=True):
            x = known / 2
            assert rows == ([] if x == FAR else [("place", f"{x:.1f}\nlow")])
            assert dot == ([] if x == FAR else [pytest.approx(at(x, 0), abs=0.07)])
            known += 1
    assert explorer.values == {"x": 2.0, "kind": "low"}
    explorer.controls["kind"].value = "high"
    assert explorer.picture.run["version"] > version


@pytest.mark.parametrize(
    ("act", "count"),
    [
        (lambda explorer: setattr(explorer.controls["x"], "value", 5.0), 0),  # it plays
        (lambda explorer: setattr(explorer.controls["kind"], "value", "high"), 1),
        (lambda explorer: explorer.put(x=5.0, kind="high"), 1),
        (lambda explorer: [tell(explorer, index=20) for _ in "ab"], 2),  # though it is the same
    ],
)
def test_each_change_is_sent_once_and_what_plays_asks_nothing(explorer, act, count):
    runs = []
    explorer.picture.observe(lambda change: runs.append(change.new), "run")
    act(explorer)
    assert len(runs) == count
    if count == 1:
        assert runs[0]["index"] == explorer.steps.index(explorer.values["x"])


def test_reset_brings_everything_back_and_stops(explorer):
    dots, texts = sent(explorer)
    explorer.put(x=5.0, kind="high")
    assert explorer.values == {"x": 5.0, "kind": "high"}
    explorer.play.playing = True
    explorer.reset.click()
    assert explorer.values == {"x": 2.0, "kind": "low"}
    assert np.array_equal(sent(explorer)[0], dots)
    assert sent(explorer)[1] == texts
    assert not explorer.play.playing


def test_play_has_the_steps_of_the_slider_and_its_seconds(explorer):
    assert (explorer.play.min, explorer.play.value, explorer.play.max) == (0, 4, 20)
    assert explorer.play.interval == 4000 / 20
    assert explorer.steps == [x / 2 for x in range(21)]


def test_what_cannot_be_served_and_a_warning_are_said(explorer):
    explorer.put(x=FAR)
    said = "Nothing to show here: x: too <far>"
    assert sent(explorer) == ([[]], [[[], said, f"A dot. {said}"]])
    for x, warned in ((3.0, ""), (WARN, "nearly too far")):
        explorer.put(x=x)
        assert notice(explorer) == warned
        assert sent(explorer)[0][0] == [pytest.approx(at(x, 0), abs=0.07)]


def test_other_errors_are_not_hidden(explorer):
    explorer._show = lambda **values: 1 / 0
    with pytest.raises(ZeroDivisionError):
        explorer.controls["kind"].value = "high"


def test_a_click_sets_controls_or_says_why_not(explorer):
    tell(explorer, place=[0.5, 0.5])
    assert explorer.values == {"x": 4.0, "kind": "high"}
    version = explorer.picture.run["version"]
    tell(explorer, place=[0.05, 0.5])
    assert notice(explorer) == "click more to the right"
    assert explorer.values == {"x": 4.0, "kind": "high"}
    explorer.restart()
    assert notice(explorer) == ""
    tell(explorer, place=[0.05, 0.5])  # the same place again
    assert notice(explorer) == "click more to the right"
    assert explorer.picture.run["version"] > version
    seen = []
    explorer._point = lambda x, y: seen.append((x, y)) or {}
    tell(explorer, place=[0.25, 0.1])
    assert seen == [(0.25 * 560, 0.9 * 380)]  # pixels of the figure


def test_only_what_can_be_clicked_shows_it(explorer):
    from rbclassroom.explorers import arm_explorer, theta_explorer

    made = [explorer, arm_explorer(), theta_explorer()]
    assert [each.picture.made["clickable"] for each in made] == [True, True, False]


def test_a_wrong_setting_leaves_a_true_picture(explorer):
    with pytest.raises(TraitError, match="Invalid selection"):
        explorer.put(kind="nope", x=5.0)
    assert explorer.values == {"x": 5.0, "kind": "low"}
    assert sent(explorer)[1][0][0] == [("place", "5.0\nlow")]


@pytest.mark.parametrize("zoom", [1, 2, 3])
def test_it_is_drawn_as_fine_as_is_wanted_and_shows_the_same(explorer, zoom):
    drawn = Image.open(io.BytesIO(explorer.draw(explorer.state(x=7.0).shown, zoom))).convert("L")
    assert drawn.size == (560 * zoom, 380 * zoom)
    rows, columns = np.nonzero(
        np.asarray(drawn)[10 * zoom : 315 * zoom, 70 * zoom : 500 * zoom] < 50
    )
    found = columns.mean() / zoom + 70, rows.mean() / zoom + 10
    assert found == pytest.approx(at(7, 0), abs=0.6)
    assert explorer._fig.dpi == 100


def test_letters_have_18_pixels_and_the_style_is_left_alone(explorer):
    import matplotlib as mpl

    assert LABELS / 72 * 100 >= 18
    ax = explorer._fig.axes[0]
    assert {label.get_fontsize() for label in ax.get_xticklabels()} == {LABELS}
    assert mpl.rcParams["xtick.labelsize"] == "medium"


def test_the_output_has_a_still_for_who_has_no_kernel(explorer):
    bundle = explorer._repr_mimebundle_()
    assert "application/vnd.jupyter.widget-view+json" in bundle
    assert 'alt="A dot. place: 2.0 low"' in bundle["text/html"]
    assert "data:image/png;base64," in bundle["text/html"]
    assert bundle["text/plain"] == repr(explorer) == "A dot. place: 2.0 low"


def test_the_state_can_be_sent(explorer):
    for widget in (explorer, explorer.picture, *explorer.controls.values(), explorer.play):
        state, _, parts = _remove_buffers(widget.get_state())
        json.dumps(state)
        assert len(parts) == (2 if widget is explorer.picture else 0)  # background, and states
    assert explorer.picture.made["background"].startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("step", "shown"), [(1.0, ".0f"), (0.25, ".2f"), (0.05, ".2f"), (5.0, ".0f")]
)
def test_readouts_have_the_digits_of_the_step_and_follow_while_dragged(step, shown):
    control = slider("x (m)", 0.0, 0.0, 10.0, step)
    assert control.readout_format == shown
    assert control.continuous_update


def test_what_plays_has_its_steps_and_nothing_between():
    control = stepped("pitch (°)", 0.0, -0.3, 0.3, 0.1)
    labels = ("−0.3", "−0.2", "−0.1", "0.0", "0.1", "0.2", "0.3")
    assert isinstance(control, ipywidgets.SelectionSlider)
    assert control.continuous_update
    assert control._options_labels == labels
    assert [value for _, value in control.options] == [-0.3, -0.2, -0.1, 0.0, 0.1, 0.2, 0.3]
