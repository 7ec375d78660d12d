"""What all explorers have in common, on a small one."""

import io
import json
import warnings

import ipywidgets
import numpy as np
import pytest
from PIL import Image
from traitlets import TraitError

from rbcourse.explore.explorer import LABELS, Explorer, choice, look, new_figure, new_line, slider

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
        line = new_line(ax, marker="o", color="black")
    controls = {"x": slider("x (m)", 2.0, 0.0, 10.0, 0.5), "kind": choice("kind", ["low", "high"])}
    return Explorer("A dot", fig, {"dot": line}, controls, show_in(line), plays="x", point=place)


def place(x, y):
    if x < 100:
        raise ValueError("click more to the right")
    return {"x": 4.0, "kind": "high"}


def pixels(explorer):
    return np.asarray(Image.open(io.BytesIO(explorer.picture.png)).convert("L"), dtype=int)


def darkest(explorer):
    """The place of the dot, in shares of the picture, from the left and from the top."""
    rows, columns = np.nonzero(pixels(explorer)[10:315, 70:500] < 50)
    return (columns.mean() + 70) / 560, (rows.mean() + 10) / 380


def test_it_shows_something_before_it_is_touched(explorer):
    assert darkest(explorer) == pytest.approx((0.1 + 0.8 * 0.2, 1 - (0.15 + 0.8 / 3)), abs=0.003)
    assert "2.0\nlow" in explorer.said.value
    assert explorer.picture.alt == "A dot. place: 2.0 low"
    assert explorer.notice.value == ""
    assert not explorer.play.playing


def test_the_picture_follows_each_control(explorer):
    explorer.controls["x"].value = 7.0
    assert darkest(explorer) == pytest.approx((0.1 + 0.8 * 0.7, 1 - (0.15 + 0.8 / 3)), abs=0.003)
    explorer.controls["kind"].value = "high"
    assert darkest(explorer) == pytest.approx((0.1 + 0.8 * 0.7, 1 - (0.15 + 1.6 / 3)), abs=0.003)
    assert "7.0\nhigh" in explorer.said.value


def test_it_keeps_its_figure_and_its_artist(explorer):
    figure, dot = explorer._fig, explorer.artists["dot"]
    explorer.controls["x"].value = 7.0
    assert explorer._fig is figure
    assert list(figure.axes[0].lines) == [dot]


def test_several_controls_are_set_with_one_picture(explorer):
    pictures = []
    explorer.picture.observe(lambda change: pictures.append(change.new), "png")
    explorer.put(x=5.0, kind="high")
    assert explorer.values == {"x": 5.0, "kind": "high"}
    assert len(pictures) == 1


def test_reset_brings_everything_back_and_stops(explorer):
    before = explorer.picture.png, explorer.said.value
    explorer.put(x=5.0, kind="high")
    explorer.play.playing = True
    explorer.reset.click()
    assert explorer.values == {"x": 2.0, "kind": "low"}
    assert (explorer.picture.png, explorer.said.value) == before
    assert not explorer.play.playing


def test_play_and_slider_move_together(explorer):
    assert (explorer.play.min, explorer.play.value, explorer.play.max) == (0, 4, 20)
    assert explorer.play.interval == 4000 / 20
    explorer.play.playing = True
    explorer.play.value = 9
    assert explorer.controls["x"].value == 4.5
    assert "4.5" in explorer.said.value
    explorer.play.playing = False
    explorer.controls["x"].value = 10.0
    assert explorer.play.value == 20


def test_what_the_player_says_too_late_is_not_followed(explorer):
    explorer.play.playing = True
    explorer.play.value = 9
    explorer.reset.click()
    explorer.play.value = 10  # sent before the browser heard of the reset
    assert explorer.values == {"x": 2.0, "kind": "low"}
    assert explorer.play.value == 4


def test_stop_goes_to_the_start_of_the_range(explorer):
    explorer.play.value = 0
    assert explorer.controls["x"].value == 0


def test_what_cannot_be_served_is_said_and_nothing_that_moves_is_drawn(explorer):
    explorer.controls["x"].value = FAR
    assert (pixels(explorer)[10:315, 70:500] >= 50).all()
    assert "too &lt;far&gt;" in explorer.notice.value
    assert 'role="alert"' in explorer.notice.value
    assert explorer.picture.alt == "A dot. Nothing to show here: x: too <far>"
    explorer.controls["x"].value = 3.0
    assert explorer.notice.value == ""
    assert darkest(explorer)[0] == pytest.approx(0.1 + 0.8 * 0.3, abs=0.003)


def test_what_is_read_off_is_text_and_no_html(explorer):
    explorer._show = lambda **values: {"1 < 2": "<b>"}
    explorer.controls["x"].value = 3.0
    assert "1 &lt; 2" in explorer.said.value
    assert "&lt;b&gt;" in explorer.said.value


def test_a_warning_is_said_and_the_picture_drawn(explorer):
    explorer.controls["x"].value = WARN
    assert "nearly too far" in explorer.notice.value
    assert darkest(explorer)[0] == pytest.approx(0.1 + 0.8 * 0.8, abs=0.003)


def test_other_errors_are_not_hidden(explorer):
    explorer._show = lambda **values: 1 / 0
    with pytest.raises(ZeroDivisionError):
        explorer.controls["x"].value = 3.0


def test_a_click_is_given_in_the_pixels_of_the_figure(explorer):
    seen = []
    explorer._point = lambda x, y: seen.append((x, y)) or {}
    explorer.picture.place = [0.25, 0.1, 1]
    assert seen == [(0.25 * 560, 0.9 * 380)]


def test_a_click_sets_controls_or_says_why_not(explorer):
    explorer.picture.place = [0.5, 0.5, 1]
    assert explorer.values == {"x": 4.0, "kind": "high"}
    explorer.picture.place = [0.05, 0.5, 2]
    assert "click more to the right" in explorer.notice.value
    assert 'role="alert"' in explorer.notice.value
    assert explorer.values == {"x": 4.0, "kind": "high"}
    explorer.restart()
    assert explorer.notice.value == ""
    explorer.picture.place = [0.05, 0.5, 3]  # the same place again
    assert "click more to the right" in explorer.notice.value


def test_only_what_can_be_clicked_shows_it(explorer):
    from rbcourse.explore import arm_explorer, theta_explorer

    assert explorer.picture.clickable
    assert [make().picture.clickable for make in (arm_explorer, theta_explorer)] == [True, False]


def test_a_wrong_setting_leaves_a_true_picture(explorer):
    with pytest.raises(TraitError, match="Invalid selection"):
        explorer.put(kind="nope", x=5.0)
    assert explorer.values == {"x": 5.0, "kind": "low"}
    assert "5.0\nlow" in explorer.said.value
    explorer.controls["x"].value = 6.0
    assert "6.0\nlow" in explorer.said.value


@pytest.mark.parametrize(
    ("density", "factor"), [(1.0, 1), (0.8, 1), (1.5, 1.5), (2.0, 2), (3.0, 2)]
)
def test_on_finer_screens_the_picture_is_finer_and_shows_the_same(explorer, density, factor):
    explorer.picture.density = density
    height, width = pixels(explorer).shape
    assert (width, height) == (560 * factor, 380 * factor)
    assert explorer.picture.width == 560
    explorer.controls["x"].value = 7.0
    columns = np.nonzero(pixels(explorer) < 50)[1]
    assert (columns > 0.6 * width).any()


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
    for widget in (explorer, *explorer.controls.values(), explorer.play, explorer.said):
        json.dumps(widget.get_state(), default=str)
    assert isinstance(explorer.picture.png, bytes)


@pytest.mark.parametrize(
    ("step", "shown"), [(1.0, ".0f"), (0.25, ".2f"), (0.05, ".2f"), (5.0, ".0f")]
)
def test_readouts_have_the_digits_of_the_step(step, shown):
    assert slider("x (m)", 0.0, 0.0, 10.0, step).readout_format == shown


def test_sliders_follow_while_they_are_dragged(explorer):
    assert explorer.controls["x"].continuous_update
    assert isinstance(explorer.controls["x"], ipywidgets.FloatSlider)
