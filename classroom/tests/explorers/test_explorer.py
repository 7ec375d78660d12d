"""Test the protocol with a small explorer, and the properties of every explorer."""

import io
import json
import re
import warnings
from itertools import pairwise
from pathlib import Path

import ipywidgets
import matplotlib as mpl
import nbformat
import numpy as np
import pytest
from ipywidgets.widgets.widget import _remove_buffers
from matplotlib.text import Text
from PIL import Image
from quick import quick_for
from sweeps import made, notice, tell
from traitlets import TraitError

from rbclassroom import explorers
from rbclassroom.course.agreement import polygons, split
from rbclassroom.course.notebooks import lesson_paths
from rbclassroom.explorers.explorer import Explorer, new_figure, new_line
from rbclassroom.explorers.widgets import choice, slider, stepped

FAR, WARN = 9.0, 8.0
LABELS = 13.5  # the size of the smallest letters, in points
FIRST = [[("place", "2.0\nlow")], "", "A dot. place: 2.0 low"]


@pytest.fixture
def explorer():
    with new_figure() as fig:
        ax = fig.add_axes((0.1, 0.15, 0.8, 0.8))
        ax.set(xlim=(0, 10), ylim=(-1, 2))
        line = new_line(ax, marker="o", ls="", color="black")
    controls = {"x": stepped("x (m)", 2.0, 0.0, 10.0, 0.5), "kind": choice("kind", ["low", "high"])}

    def show(x, kind):
        if x == FAR:
            raise ValueError("x: too <far>")
        if x == WARN:
            warnings.warn("nearly too far", stacklevel=1)
        line.set_data([x], [kind == "high"])
        return {"place": f"{x:.1f}\n{kind}"}

    def point(x, y):
        if x < 100:
            raise ValueError(f"click to the right of {x:g}, {y:g}")
        return {"x": 4.0, "kind": "high"}

    return Explorer("A dot", fig, {"dot": line}, controls, show, plays="x", point=point)


def sent(explorer):
    """Return the last states that were sent: the places of the dot, and the texts."""
    run = explorer.picture.run
    drawn = [polygons(state, run["styles"]) for state in split(run["states"])]
    return [[place for _, _, ((*place,),) in state] for state in drawn], run["texts"]


def at(x, y):
    """Return the place of the dot, in pixels from the upper left corner."""
    return pytest.approx([560 * (0.1 + 0.08 * x), 380 * (0.85 - 0.8 * (y + 1) / 3)], abs=0.07)


def test_the_picture_follows_the_controls(explorer):
    assert sent(explorer) == ([[at(2, 0)]], [FIRST])  # before any control is moved
    assert explorer.picture.run["index"] == 4
    assert (explorer.play.min, explorer.play.value, explorer.play.max) == (0, 4, 20)
    assert explorer.play.interval == 4000 / 20
    assert explorer.steps == [x / 2 for x in range(21)]
    runs = []
    explorer.picture.observe(lambda change: runs.append(change.new), "run")
    explorer.controls["x"].value = 5.0
    assert runs == []  # the player of this control requests the states
    explorer.controls["kind"].value = "high"
    assert sent(explorer) == ([[at(5, 1)]], [[[("place", "5.0\nhigh")], "", repr(explorer)]])
    explorer.put(x=7.0, kind="low")
    assert sent(explorer)[0] == [[at(7, 0)]]
    assert [run["index"] for run in runs] == [10, 14]  # the function runs once for each change
    explorer.play.playing = True
    explorer.reset.click()
    assert explorer.values == {"x": 2.0, "kind": "low"}
    assert sent(explorer) == ([[at(2, 0)]], [FIRST])
    assert not explorer.play.playing
    assert list(explorer._fig.axes[0].lines) == [explorer.artists["dot"]]


def test_requested_states_are_sent_in_order(explorer):
    version, known = explorer.picture.run["version"], 0
    while known < 21:
        tell(explorer, index=known)
        run, (dots, texts) = explorer.picture.run, sent(explorer)
        assert (run["version"], run["index"]) == (version, known)
        for dot, (rows, *_) in zip(dots, texts, strict=True):
            x = known / 2
            assert rows == ([] if x == FAR else [("place", f"{x:.1f}\nlow")])
            assert dot == ([] if x == FAR else [at(x, 0)])
            known += 1
    for number in (1, 2):
        tell(explorer, index=20)  # equal states are sent again
        assert explorer.picture.run["number"] == run["number"] + number
    assert explorer.values == {"x": 2.0, "kind": "low"}
    explorer.controls["kind"].value = "high"
    assert explorer.picture.run["version"] > version


def test_errors_and_warnings_are_reported(explorer):
    explorer.put(x=FAR)
    said = "Nothing to show here: x: too <far>"
    assert sent(explorer) == ([[]], [[[], said, f"A dot. {said}"]])
    assert not explorer.artists["dot"].get_visible()
    for x, warned in ((3.0, ""), (WARN, "nearly too far")):
        explorer.put(x=x)
        assert notice(explorer) == warned
        assert sent(explorer)[0] == [[at(x, 0)]]
    with pytest.raises(TraitError, match="Invalid selection"):
        explorer.put(kind="nope", x=5.0)
    assert explorer.values == {"x": 5.0, "kind": "low"}
    assert sent(explorer)[1][0][0] == [("place", "5.0\nlow")]
    explorer._show = lambda **values: 1 / 0
    with pytest.raises(ZeroDivisionError):  # other errors are not hidden
        explorer.controls["kind"].value = "high"


def test_a_refused_click_states_the_reason(explorer):
    tell(explorer, place=[0.5, 0.5])
    assert explorer.values == {"x": 4.0, "kind": "high"}
    for _ in range(2):  # both clicks are at the same place
        version = explorer.picture.run["version"]
        tell(explorer, place=[0.125, 0.1])
        assert explorer.picture.run["version"] > version
        assert notice(explorer) == "click to the right of 70, 342"  # pixels of the figure
        assert explorer.values == {"x": 4.0, "kind": "high"}
        explorer.put()
        assert notice(explorer) == ""
    shown = [each.picture.made["clickable"] for each in (explorer, made("arm"), made("planar"))]
    assert shown == [True, True, False]


def test_the_zoom_does_not_change_a_drawing(explorer):
    shown = explorer.state(x=7.0).shown
    for zoom in (1, 2, 3):
        drawn = np.asarray(Image.open(io.BytesIO(explorer.draw(shown, zoom))).convert("L"))
        assert drawn.shape == (380 * zoom, 560 * zoom)
        rows, columns = np.nonzero(drawn[10 * zoom : 315 * zoom, 70 * zoom : 500 * zoom] < 50)
        found = columns.mean() / zoom + 70, rows.mean() / zoom + 10
        assert found == pytest.approx(at(7, 0).expected, abs=0.6)
    assert explorer._fig.dpi == 100
    labels = explorer._fig.axes[0].get_xticklabels()
    assert {label.get_fontsize() for label in labels} == {LABELS}
    assert mpl.rcParams["xtick.labelsize"] == "medium"  # the style is not changed


def test_readers_without_a_kernel_see_a_still_picture(explorer):
    bundle = explorer._repr_mimebundle_()
    assert "application/vnd.jupyter.widget-view+json" in bundle
    assert 'alt="A dot. place: 2.0 low"' in bundle["text/html"]
    assert "data:image/png;base64," in bundle["text/html"]
    assert bundle["text/plain"] == repr(explorer) == "A dot. place: 2.0 low"
    for widget in (explorer, explorer.picture, *explorer.controls.values(), explorer.play):
        state, _, parts = _remove_buffers(widget.get_state())
        json.dumps(state)
        # the background and the states are separate parts
        assert len(parts) == (2 if widget is explorer.picture else 0)
    assert explorer.picture.made["background"].startswith(b"\x89PNG")


def test_readouts_have_as_many_digits_as_the_step():
    for step, shown in ((1.0, ".0f"), (0.25, ".2f"), (0.05, ".2f"), (5.0, ".0f")):
        assert slider("x (m)", 0.0, 0.0, 10.0, step).readout_format == shown
    # the control has no values between its steps
    control = stepped("pitch (°)", 0.0, -0.3, 0.3, 0.1)
    assert control._options_labels == ("−0.3", "−0.2", "−0.1", "0.0", "0.1", "0.2", "0.3")
    assert [value for _, value in control.options] == [-0.3, -0.2, -0.1, 0.0, 0.1, 0.2, 0.3]


LESSONS = lesson_paths(Path(__file__).parents[3] / "notebooks")


@pytest.mark.parametrize("path", quick_for(["03", "12", "16"], LESSONS))
def test_the_cell_of_an_explorer_needs_no_other_cell(path):
    cells = nbformat.read(path, as_version=4).cells
    found = [cell for cell in cells if re.search(r"^explorers\.\w+\(", cell.source, re.MULTILINE)]
    assert found
    for cell in found:
        *lines, last = cell.source.splitlines()
        space = {}
        exec("\n".join(lines), space)
        explorer = eval(last, space)
        assert isinstance(explorer, Explorer)
        ((rows, notice, _),) = explorer.picture.run["texts"]
        assert len(explorer.picture.run["states"]) > 100
        assert len(rows) >= 2
        assert notice == ""
        assert not explorer.play.playing
        (output,) = cell.outputs
        still = "a still. Run this cell (Shift + Enter) to get its sliders"
        assert still in output.data["text/html"]


UNIT = r" \((°|°/s|cm|m|m/s|m/s²|m/time|rad/s|rad/time|s|0 to 1|1: paper's)\)$"
WITHOUT_UNIT = "time t", "seed", "rotations", "y leans", "z leans", "z stretched"


@pytest.mark.parametrize("name", explorers.__all__)
def test_each_explorer_has_units_and_large_letters(name):
    explorer = made(name.removesuffix("_explorer"))
    for control in explorer.controls.values():
        if isinstance(control, ipywidgets.FloatSlider | ipywidgets.SelectionSlider):
            assert control.continuous_update
            assert re.search(UNIT, control.description) or control.description in WITHOUT_UNIT
        else:
            assert isinstance(control, ipywidgets.ToggleButtons | ipywidgets.Dropdown)
    for text in explorer._fig.findobj(Text):
        if text.get_visible() and text.get_text().strip():
            assert text.get_fontsize() >= LABELS, text.get_text()
    fig = explorer._fig
    fig.draw_without_rendering()
    flat = [ax for ax in fig.axes if ax.name == "rectilinear"]
    for box in (part.get_tightbbox() for part in [*flat, *fig.legends, *fig.texts]):
        assert (box.min >= 0).all(), box
        assert (box.max <= fig.bbox.max).all(), box
    artists = list(explorer.artists.values())
    assert len({id(artist) for artist in artists}) == len(artists)
    assert all(artist.get_figure() is explorer._fig for artist in artists)
    assert explorer.play.max == len(explorer.steps) - 1 >= 40
    chosen = [explorer.steps[i] for i in np.linspace(0, explorer.play.max, 5).astype(int)]
    states = [explorer.state(**{explorer.plays: value}) for value in chosen]
    assert len({state.drawn.tobytes() for state in states}) >= 4


@pytest.mark.parametrize("path", LESSONS[1:], ids=lambda path: path.stem)
def test_every_poll_has_a_button_for_each_option_above_its_answer(path):
    cells, open_ = nbformat.read(path, as_version=4).cells, None
    for above, cell in pairwise(cells):
        if asked := re.match(r"### Poll (\d+)", above.source):
            letters = "".join(re.findall(r"^- \*\*([A-Z])\*\*", above.source, re.MULTILINE))
            open_ = f"### Answer to poll {asked[1]}"
        if cell.source.startswith("### Answer to poll"):
            assert cell.source == open_
            assert above.source.splitlines()[-1] == f'polls.buttons("{letters}")'
            space = {}
            exec(above.source, space)
            assert space["polls"].buttons(letters).letters == list(letters)
