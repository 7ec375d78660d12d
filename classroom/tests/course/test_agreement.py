"""New and stored results may differ by rounding; every other change is detected."""

import base64
import io
import json
import re
import zlib
from functools import cache, partial

import nbformat
import numpy as np
import pytest
from matplotlib.figure import Figure
from nbformat.v4 import new_code_cell, new_notebook, new_output
from PIL import Image

from rbclassroom.course import agreement
from rbclassroom.course.agreement import reconciled, reconciled_notebook, stale_figures
from rbclassroom.explorers import random_explorer
from rbclassroom.explorers.recorded import record
from rbcourse.draw.display import PARTS, joined


@cache
def living():
    """Return an interactive picture in the plane and in space, with markers, texts and states."""
    explorer = random_explorer()
    return record(explorer, "random", {}, stride=len(explorer.steps) // 2)._repr_html_()


def changed(change):
    """Return `living` after `change` was applied to its states, styles, texts and settings."""
    data = json.loads(re.search(agreement.LIVING, living())[1])
    states, known = (zlib.decompress(base64.b64decode(data[key])) for key in ("states", "known"))
    states, (styles, texts) = [x.copy() for x in agreement.split(states)], json.loads(known)
    change(states, styles, texts, data)
    known = json.dumps([styles, texts]).encode()
    for key, content in (("states", joined(states)), ("known", known)):
        data[key] = base64.b64encode(zlib.compress(content)).decode()
    return re.sub(agreement.LIVING, lambda _: f"revive(image, {json.dumps(data)});", living())


def moved(states, styles, texts, data, by=1, at=-1):
    """Move the last point or, with ``at=2``, the first polygon, which is in space."""
    states[0][at] += by


def marker_moved(states, styles, texts, data, by=1):
    marker = next(style[7] for style in styles if style[7])
    marker[0][0] += by


def view_moved(states, styles, texts, data, by=0.01):
    data["rooms"][0]["view"][0] += by


def renumbered(states, styles, texts, data):
    """Change the number of the style of the first polygon; the picture remains the same."""
    styles.append(styles[states[0][0]])
    states[0][0] = len(styles) - 1


ROUNDING = [moved, partial(moved, by=-1), partial(moved, at=2), renumbered]
ROUNDING += [marker_moved, view_moved]
CHANGES = [
    *(partial(moved, by=2), partial(moved, by=PARTS), partial(moved, by=2, at=2)),
    *(partial(marker_moved, by=2), partial(view_moved, by=0.02)),
    lambda states, styles, texts, data: styles[0].__setitem__(0, "#d55e01ff"),
    lambda states, styles, texts, data: states.__setitem__(0, states[0][:0]),
    lambda states, styles, texts, data: states.append(states[-1]),
    lambda states, styles, texts, data: states.reverse(),
    lambda states, styles, texts, data: texts[-1].append("."),
    lambda states, styles, texts, data: data["size"].reverse(),
    lambda states, styles, texts, data: data.update(speed=2),
]


@pytest.mark.parametrize("change", [*ROUNDING, *CHANGES])
def test_rounding_in_an_interactive_picture_is_ignored(change):
    again = changed(change)
    assert again != living()
    assert reconciled(living(), again) == (living() if change in ROUNDING else again)


def test_positions_are_compared_in_display_units():
    assert agreement.UNIT == 1 / PARTS


def image(array):
    content = io.BytesIO()
    Image.fromarray(array).save(content, "png")
    return f"<img src='data:image/png;base64,{base64.b64encode(content.getvalue()).decode()}'> 3.1"


def test_a_picture_in_a_page_is_kept_if_it_looks_the_same():
    grey = np.full((200, 200, 4), 128, np.uint8)
    hardly, visibly, clear = grey.copy(), grey.copy(), grey.copy()
    hardly[5, 5] = 138
    visibly[5, 5:15] = 255
    clear[..., 3] = 0
    stored, again, *others = map(image, (grey, hardly, visibly, clear, grey[:199]))
    assert reconciled(stored, again) == stored
    assert reconciled(stored, again.replace("3.1", "3.2")) == stored.replace("3.1", "3.2")
    for other in others:
        assert reconciled(stored, other) == other


def test_a_different_letter_in_a_large_picture_is_detected():
    plots = []
    for label in ("w1 [rad]", "w2 [rad]", "w1 [rad/s]", "v1 [rad]"):
        fig = Figure(figsize=(9, 5.5))
        fig.add_subplot(ylabel=label)
        plots.append(io.BytesIO())
        fig.savefig(plots[-1], format="png")
    first, *others = (plot.getvalue() for plot in plots)
    assert not any(agreement.look_the_same(first, other) for other in others)


def notebook(*pages, ids=True):
    """Return a notebook whose cells show pages."""
    made = new_notebook()
    for number, page in enumerate(pages):
        output = new_output("execute_result", data={"text/html": page}, execution_count=number)
        made.cells.append(new_code_cell("x", outputs=[output], id=f"cell-{number}"))
        if not ids:
            del made.cells[-1]["id"]
    made.nbformat_minor = 5 if ids else 4
    return nbformat.writes(made) + "\n"


@pytest.mark.parametrize("ids", [True, False])
def test_running_a_notebook_again_does_not_change_its_bytes(ids):
    stored, again = (notebook(page, page, ids=ids) for page in (living(), changed(moved)))
    assert again != stored
    assert reconciled_notebook(stored, again) == stored
    assert list(agreement.changed_lines(stored, again)) == []


def test_cells_after_a_new_cell_are_still_recognised():
    stored, again = notebook("It is 1.", living()), notebook("It is 2.", changed(moved))
    lines = list(agreement.changed_lines(stored, again))
    assert [line.strip() for line in lines[3:]] == ['-       "It is 1."', '+       "It is 2."']
    again = nbformat.reads(again, as_version=4)
    again.cells.insert(0, new_code_cell("new", id="new"))
    kept = reconciled_notebook(stored, nbformat.writes(again))
    wanted = nbformat.reads(stored, as_version=4).cells[1]
    assert nbformat.reads(kept, as_version=4).cells[2] == wanted


PDF = b"%PDF-1.4\n"


def files(number="0.5", colour="#808080", duration=50, **others):
    """Return the files of a figure, by their endings."""
    still, moving = io.BytesIO(), io.BytesIO()
    Image.new("RGB", (200, 200), colour).save(still, "png")
    frames = [Image.new("RGB", (20, 20), colour) for colour in ("red", "blue")]
    frames[0].save(moving, "gif", save_all=True, append_images=frames[1:], duration=duration)
    return {
        "csv": f"x [m],name\n{number},a\nnan,b\n1,c\n".encode(),
        "png": still.getvalue(),
        "gif": moving.getvalue(),
        "pdf": PDF + f"{number} {colour}\n%%EOF\n".encode(),
        **others,
    }


@pytest.mark.parametrize(
    ("stored", "drawn", "stale"),
    [
        (files(), files(), ""),
        (files(), files("0.5000000000001"), ""),
        (files(), files("0.50000001"), "csv"),
        (files(), files("word"), "csv"),
        (files(), files(colour="#908080"), "png"),
        (files(), files(duration=500, pdf=PDF + b"other\n%%EOF\n"), ""),
        (files(), files(pdf=PDF), "pdf"),
        (files(), files(gif=b"GIF89a"), "gif"),
        (files(), files(txt=b"not stored"), "txt"),
        (files(svg=b"of a kind"), files(svg=b"that is unknown"), "svg"),
        (files(png=b"version https://git-lfs.github.com/spec/v1"), files(), "png"),
        (files(csv=b"\xff\xfe"), files("0.5000000000001"), "csv"),
        (files(gif=b"GIF89a"), files(), "gif"),
    ],
)
def test_a_file_that_differs_by_more_than_rounding_is_stale(tmp_path, stored, drawn, stale):
    for folder, contents in (("stored", stored), ("drawn", drawn)):
        (tmp_path / folder).mkdir()
        for ending, content in contents.items():
            (tmp_path / folder / f"a.{ending}").write_bytes(content)
    found = stale_figures(tmp_path / "drawn", tmp_path / "stored")
    assert found == [f"a.{ending}" for ending in stale.split()]
