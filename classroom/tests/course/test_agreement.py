"""What a run gives and what is stored agree up to rounding; every real change is seen."""

import base64
import io
import json
import re
import zlib

import matplotlib.pyplot as plt
import nbformat
import numpy as np
import pytest
from nbformat.v4 import new_code_cell, new_notebook, new_output
from PIL import Image

from rbclassroom.course import agreement
from rbclassroom.course.agreement import reconciled, reconciled_notebook, stale_figures
from rbclassroom.explorers import recorded, theta_explorer
from rbcourse.draw.display import PARTS, joined
from rbcourse.draw.save import save_figure


@pytest.fixture(scope="module")
def page():
    """A living picture with controls, as HTML."""
    return recorded.record(theta_explorer(), "theta", "angle", [60.0, 120.0])._repr_html_()


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    """A living picture in space, as HTML."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RBCOURSE_FIGURES", str(tmp_path_factory.mktemp("figures")))
        fig, ax = plt.subplots(subplot_kw={"projection": "space"})
        ax.plot([0, 1, 1], [0, 0, 1], [0, 0, 0], color="red")
        ax.text(1, 1, 1, "M")
        return save_figure(fig, "scene", {"t [1]": [0, 1]}, "A line.")._repr_html_()


def deflated(content):
    return base64.b64encode(zlib.compress(content)).decode()


def inflated(text):
    return zlib.decompress(base64.b64decode(text))


def changed(page, change):
    """A page whose states, styles and texts were changed in place, and deflated again."""
    data = json.loads(re.search(agreement.LIVING, page)[1])
    states = [state.copy() for state in agreement.split(inflated(data["states"]))]
    styles, texts = json.loads(inflated(data["known"]))
    states = change(states, styles, texts, data) or states
    data["states"] = deflated(joined(states))
    data["known"] = deflated(json.dumps([styles, texts]).encode())
    return re.sub(agreement.LIVING, lambda _: f"revive(image, {json.dumps(data)});", page)


def places_moved_by(units):
    """Move the first place of the last polygon of a state; the polygon keeps its form."""

    def move(states, styles, texts, data):
        i = 0
        while i < len(states[-1]):
            last, size = i, 3 if len(styles[states[-1][i]]) > 8 else 2
            i += 2 + size * abs(int(states[-1][i + 1]))
        states[-1][last + 2] += units

    return move


def marker_moved_by(units):
    def move(states, styles, texts, data):
        marker = next(style[7] for style in styles if style[7])
        marker[0][0] += units

    return move


def reordered(states, styles, texts, data):
    """The styles in another order: nothing that is seen changes."""
    order = list(range(len(styles)))[::-1]
    styles[:] = [styles[k] for k in order]
    for state in states:
        i = 0
        while i < len(state):
            state[i] = order.index(state[i])
            i += 2 + (3 if len(styles[state[i]]) > 8 else 2) * abs(int(state[i + 1]))


def test_the_unit_of_the_comparison_is_that_of_the_display():
    assert agreement.UNIT == 1 / PARTS


@pytest.mark.parametrize("change", [places_moved_by(1), places_moved_by(-1), reordered])
@pytest.mark.parametrize("kind", ["page", "scene"])
def test_a_living_picture_that_differs_by_rounding_is_the_stored_one(kind, change, request):
    stored = request.getfixturevalue(kind)
    again = changed(stored, change)
    assert again != stored
    assert reconciled(stored, again) == stored


def test_a_marker_that_differs_by_rounding_is_the_stored_one(scene):
    assert reconciled(scene, changed(scene, marker_moved_by(1))) == scene


def coloured(states, styles, texts, data):
    styles[0][1] = "#d55e01ff" if styles[0][1] else "#d55e00ff"


def one_more_frame(states, styles, texts, data):
    return [*states, states[-1]]


def frames_exchanged(states, styles, texts, data):
    return [states[-1], *states[1:-1], states[0]]


def without_a_polygon(states, styles, texts, data):
    size = 3 if len(styles[states[0][0]]) > 8 else 2
    states[0] = states[0][2 + size * abs(int(states[0][1])) :]


def said_otherwise(states, styles, texts, data):
    if texts:
        texts[-1][2] += "."
    else:
        texts.append(["", "", "."])


def seen_from_elsewhere(states, styles, texts, data):
    data["size"][0] += 1
    for room in data["rooms"]:
        room["view"][0] += 0.1


def a_new_setting(states, styles, texts, data):
    data["speed"] = 2


SEEN = {
    "a setting": a_new_setting,
    "a place moved by a pixel": places_moved_by(PARTS),
    "a place moved by two units": places_moved_by(2),
    "a colour": coloured,
    "a frame more": one_more_frame,
    "a polygon less": without_a_polygon,
    "a text": said_otherwise,
    "the size or the view": seen_from_elsewhere,
}


@pytest.mark.parametrize("change", SEEN.values(), ids=SEEN)
@pytest.mark.parametrize("kind", ["page", "scene"])
def test_a_change_of_a_living_picture_is_seen(kind, change, request):
    stored = request.getfixturevalue(kind)
    again = changed(stored, change)
    assert reconciled(stored, again) == again != stored


def test_frames_in_another_order_and_a_larger_marker_are_seen(page, scene):
    for stored, change in ((page, frames_exchanged), (scene, marker_moved_by(2))):
        again = changed(stored, change)
        assert reconciled(stored, again) == again


def png(array):
    content = io.BytesIO()
    Image.fromarray(array).save(content, "png")
    return f"data:image/png;base64,{base64.b64encode(content.getvalue()).decode()}"


def test_a_picture_in_a_page_is_kept_where_it_looks_the_same():
    grey = np.full((200, 200, 3), 128, np.uint8)
    hardly, visibly = grey.copy(), grey.copy()
    hardly[5, 5] = 138
    visibly[5, 5:15] = 255
    stored, *again = (f"<img src='{png(array)}'> 3.1" for array in (grey, hardly, visibly))
    assert reconciled(stored, again[0]) == stored
    assert reconciled(stored, again[1]) == again[1]
    assert reconciled(stored, again[0].replace("3.1", "3.2")) == stored.replace("3.1", "3.2")


def labelled(label):
    """A plot, as PNG, with one letter or digit in question."""
    fig, ax = plt.subplots(figsize=(9, 5.5))
    ax.set_ylabel(label)
    content = io.BytesIO()
    fig.savefig(content, format="png")
    plt.close(fig)
    return content.getvalue()


@pytest.mark.parametrize("label", ["w2 [rad]", "w1 [rad/s]", "v1 [rad]"])
def test_another_letter_in_a_large_picture_is_seen(label):
    assert not agreement.look_the_same(labelled("w1 [rad]"), labelled(label))


def test_a_transparent_picture_and_one_of_another_size_are_seen():
    grey = np.full((40, 40, 4), 128, np.uint8)
    clear = grey.copy()
    clear[..., 3] = 0
    page, *others = (f"<img src='{png(each)}'>" for each in (grey, clear, grey[:39]))
    for other in others:
        assert reconciled(page, other) == other


def test_an_animation_that_runs_at_another_speed_is_stale(tmp_path):
    frames = [Image.new("RGB", (20, 20), colour) for colour in ("red", "blue")]
    for place, duration in (("stored", 50), ("drawn", 500)):
        (tmp_path / place).mkdir()
        frames[0].save(
            tmp_path / place / "a.gif", save_all=True, append_images=frames[1:], duration=duration
        )
    assert stale_figures(tmp_path / "drawn", tmp_path / "stored") == ["a.gif"]
    assert stale_figures(tmp_path / "drawn", tmp_path / "drawn") == []


def test_cells_without_ids_are_paired_by_their_places(page):
    texts = [notebook(page), notebook(changed(page, places_moved_by(1)))]
    for i, text in enumerate(texts):
        content = nbformat.reads(text, as_version=4)
        content.nbformat_minor = 4
        del content.cells[0]["id"]
        texts[i] = nbformat.writes(content) + "\n"
    assert reconciled_notebook(*texts) == texts[0]


def notebook(*pages):
    cells = []
    for number, page in enumerate(pages):
        output = new_output("execute_result", data={"text/html": page}, execution_count=number)
        cells.append(new_code_cell("x", outputs=[output], id=f"cell-{number}"))
    return nbformat.writes(new_notebook(cells=cells)) + "\n"


def test_a_notebook_that_was_run_again_keeps_its_bytes(page, scene):
    stored = notebook(page, scene)
    again = notebook(*(changed(each, places_moved_by(1)) for each in (page, scene)))
    assert again != stored
    assert reconciled_notebook(stored, again) == stored
    assert list(agreement.changed_lines(stored, again)) == []


def test_a_new_cell_does_not_keep_the_others_from_being_recognised(page, scene):
    stored = nbformat.reads(notebook(page, scene), as_version=4)
    again = nbformat.reads(notebook(page, changed(scene, places_moved_by(1))), as_version=4)
    for each in (stored, again):
        each.cells[1].id = "scene"
    again.cells.insert(0, new_code_cell("new", id="new"))
    kept = reconciled_notebook(*(nbformat.writes(each) for each in (stored, again)))
    assert nbformat.reads(kept, as_version=4).cells[2] == stored.cells[1]


def test_changed_lines_name_what_was_said_otherwise(page):
    stored, again = notebook(page, "It is 1."), notebook(page, "It is 2.")
    lines = list(agreement.changed_lines(stored, again))
    assert [line.strip() for line in lines if "It is" in line] == [
        '-       "It is 1."',
        '+       "It is 2."',
    ]


def figure(folder, number, colour):
    folder.mkdir(exist_ok=True)
    (folder / "a.csv").write_text(f"x [m],name\n{number},a\n1,b\n")
    Image.new("RGB", (200, 200), colour).save(folder / "a.png")
    (folder / "a.pdf").write_bytes(f"{number} {colour}".encode())


@pytest.mark.parametrize(
    ("number", "colour", "stale"),
    [
        ("0.5", "#808080", []),
        ("0.5000000000001", "#808080", []),  # the document may differ where the numbers do
        ("0.50000001", "#808080", ["a.csv"]),
        ("word", "#808080", ["a.csv"]),
        ("0.5", "#908080", ["a.png"]),
    ],
)
def test_a_file_that_differs_by_more_than_rounding_is_stale(tmp_path, number, colour, stale):
    figure(tmp_path / "stored", "0.5", "#808080")
    figure(tmp_path / "drawn", number, colour)
    assert stale_figures(tmp_path / "drawn", tmp_path / "stored") == stale


def test_a_damaged_file_and_one_of_an_unknown_kind_are_stale(tmp_path):
    figure(tmp_path / "stored", "0.5", "#808080")
    figure(tmp_path / "drawn", "0.5000000000001", "#808081")
    (tmp_path / "stored" / "a.png").write_bytes(b"version https://git-lfs.github.com/spec/v1")
    (tmp_path / "stored" / "a.csv").write_bytes(b"\xff\xfe")
    for place in ("stored", "drawn"):
        (tmp_path / place / "a.svg").write_text(place)
    assert stale_figures(tmp_path / "drawn", tmp_path / "stored") == ["a.csv", "a.png", "a.svg"]


def test_nan_in_a_table_agrees_with_itself(tmp_path):
    for place, number in (("stored", "0.5"), ("drawn", "0.5000000000001")):
        (tmp_path / place).mkdir()
        (tmp_path / place / "a.csv").write_text(f"x [m]\n{number}\nnan\n")
    assert stale_figures(tmp_path / "drawn", tmp_path / "stored") == []


def test_a_document_that_alone_differs_and_a_file_that_is_not_stored_are_stale(tmp_path):
    figure(tmp_path / "stored", "0.5", "#808080")
    figure(tmp_path / "drawn", "0.5", "#808080")
    (tmp_path / "drawn" / "a.pdf").write_bytes(b"other")
    (tmp_path / "drawn" / "b.csv").write_text("x [m]\n1\n")
    assert stale_figures(tmp_path / "drawn", tmp_path / "stored") == ["a.pdf", "b.csv"]
