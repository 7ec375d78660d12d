"""Test the pages of lessons: which parts are folded, removed or added."""

import base64
import io
import re

import pytest
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook, new_output
from PIL import Image

from rbclassroom.book import lessons
from rbclassroom.explorers import recorded


def markdown(*texts):
    return [new_markdown_cell(text) for text in texts]


OPENING = '<details class="answer" id="answer-to-{0}"><summary>Answer to {1}</summary>'


def test_an_answer_is_folded_until_the_next_heading():
    cells = markdown("### Poll 1", "### Answer to poll 1\n\n**B**", "Why", "## 2")
    cells.insert(2, new_code_cell("1 + 1"))
    cells += markdown("### Answer to exercise 1", "A", "### Answer to exercise 2")
    first, second, third = (
        OPENING.format(name.replace(" ", "-"), name)
        for name in ("poll 1", "exercise 1", "exercise 2")
    )
    assert [cell.source for cell in lessons.folded(cells)] == [
        *("### Poll 1", first, "\n**B**", "1 + 1", "Why", "</details>", "## 2"),
        *(second, "A", "</details>", third, "</details>"),
    ]


def test_pictures_become_files(tmp_path):
    contents, shown = [], []
    for size in ((4, 2), (4, 5)):
        content = io.BytesIO()
        Image.new("RGB", size).save(content, "png")
        contents.append(content.getvalue())
        text = base64.b64encode(contents[-1]).decode()
        shown.append(f'<img style="max-width: 100%" src="data:image/png;base64,{text}"/>')
    known = {contents[0]: "../figures/one.png"}
    found = lessons.with_picture_files("".join([*shown, shown[1]]), known, tmp_path)
    (written,) = (tmp_path / "pictures").iterdir()
    assert written.read_bytes() == contents[1]
    assert 'style="aspect-ratio: 4/2; max-width: 100%" data-wide' in found
    assert 'style="aspect-ratio: 4/5; max-width: 100%" loading' in found
    assert 'loading="lazy" src="../figures/one.png"' in found
    assert found.count(f'src="pictures/{written.name}"') == 2
    assert "base64" not in found


def test_interactive_pictures_share_their_scripts(tmp_path):
    cube, arm = (recorded.living(name) for name in ("cube", "arm"))
    found = lessons.with_script_files(cube + arm + cube, tmp_path, "there")
    sources = re.findall(r'<script src="there/([^"]+)"></script>', found)
    assert len(sources) == 6
    assert len(set(sources)) == 3
    assert sources[0] == "display.js"
    assert {path.name for path in (tmp_path / "pictures").iterdir()} == set(sources)
    for shown, name in zip((cube, arm, cube), sources[1::2], strict=True):
        states = (tmp_path / "pictures" / name).read_text("utf-8")
        data = re.fullmatch(r'\(window\.rbcourseStates \?\?= {}\)\["\w+"\] = (.*);\n', states)[1]
        assert data in shown
        assert data not in found
    data = re.search(r"revive\(image, (.*)\);\n", cube)[1]
    slide = f'<script type="application/json">{data}</script>'
    found = lessons.with_script_files(slide, tmp_path, "there")
    assert re.findall(r'src="there/([^"]+)"', found) == [sources[1]]
    assert f'"{sources[1].removesuffix(".js")}"</script>' in found


def test_a_caption_links_to_its_files():
    small = "<figcaption>A turn. <small>turn.png, .csv</small></figcaption></figure>"
    image = '<img width="3" src="../figures/turn.png"/>'
    linked = '<small><a href="../figures/turn.png">turn.png</a>, '
    linked += '<a href="../figures/turn.csv">.csv</a></small>'
    found = lessons.with_files(f"<figure>{image}{small}")
    assert f'<a href="../figures/turn.png">{image}</a>' in found
    assert linked in found
    player = lessons.with_files(f"<figure>{image}{small}<script>1</script>")
    assert f"<figure>{image}" in player
    assert linked in player


def test_the_figures_of_a_lesson_are_listed_with_their_sections():
    lines = 'save_animation(\n    fig, "lesson01_way", data, alt)'
    data = {"text/plain": "lesson01_way: A way.", "text/html": "…"}
    drawn = new_code_cell(lines, outputs=[new_output("execute_result", data=data)])
    cells = [*markdown("# Title", "## 3 · Ways"), new_code_cell("x = 1"), drawn]
    (figure,) = lessons.figures_of("01_plane.ipynb", new_notebook(cells=cells))
    place = "01_plane.ipynb, 3"
    assert figure == lessons.Figure("lesson01_way", place, "A way.")
    drawn.outputs.clear()
    with pytest.raises(ValueError, match=r"01_plane\.ipynb: the figure of 'fig, .* has no stored"):
        lessons.figures_of("01_plane.ipynb", new_notebook(cells=cells))


@pytest.mark.parametrize("repository", ["", "us/course"])
def test_a_lesson_page_offers_a_download(repository):
    ran = new_code_cell("1", outputs=[new_output("stream", text="1")])
    notebook = new_notebook(cells=[*markdown("# T\n\ntext"), ran])
    lessons.add_buttons(notebook, "01_plane.ipynb", repository)
    first = notebook.cells[0].source
    assert first.startswith("# 01 · T\n\n")
    assert first.endswith("\n\ntext")
    assert '<a download href="01_plane.ipynb">' in first
    address = "https://mybinder.org/v2/gh/us/course/HEAD?labpath=notebooks%2F01_plane.ipynb"
    assert (address in first) == ("mybinder" in first) == bool(repository)
    assert lessons.without_outputs(notebook).cells[1].outputs == []


def test_code_is_folded_except_in_answers_to_exercises():
    shown = [new_output("stream", text="2")]
    cells = markdown("# A", "## 1", "### Answer to poll 1", "### Answer to exercise 1", "## 2")
    cells.insert(1, new_code_cell("import numpy as np"))
    cells[3:3] = [new_code_cell("a = 1"), new_code_cell("a + 1", outputs=shown)]
    cells.insert(6, new_code_cell("2 + 2", outputs=shown))
    cells.insert(8, new_code_cell("3 + 3", outputs=shown))
    cells = lessons.folded(lessons.joined(lessons.in_order(cells)))
    lessons.hide_code(cells)
    code = [cell for cell in cells if cell.cell_type == "code"]
    assert [c.source for c in code] == ["a = 1\n\na + 1", "2 + 2", "3 + 3", "import numpy as np"]
    hidden = ["hide-input" in cell.metadata.get("tags", []) for cell in code]
    assert hidden == [True, True, False, True]


def test_a_page_begins_with_the_opening_and_ends_with_the_imports():
    opening = new_code_cell("opening()", outputs=[new_output("stream", text="2")])
    cells = [*markdown("# A"), opening, new_code_cell("import numpy"), *markdown("## 1")]
    told = "The code of this lesson begins with these imports."
    ordered = [cell.source for cell in lessons.in_order(cells)]
    assert ordered == ["# A", "opening()", "## 1", told, "import numpy"]
