"""Stored lessons as pages: what is folded, taken out and put in."""

import base64
import io
from pathlib import Path

import nbformat
import pytest
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook, new_output
from PIL import Image

from rbclassroom.book.lessons import (
    Pictures,
    cited_in,
    figures_of,
    folded,
    living,
    prepared,
    split_sheet,
    with_buttons,
    with_files,
    without_outputs,
)
from rbclassroom.course.notebooks import lesson_paths

ROOT = Path(__file__).parents[3]
LESSONS = lesson_paths(ROOT / "notebooks")


def markdown(*texts):
    return [new_markdown_cell(text) for text in texts]


def sources(cells):
    return [cell.source for cell in cells]


def png(size, colour):
    content = io.BytesIO()
    Image.new("RGB", size, colour).save(content, "png")
    return content.getvalue()


def shown(content):
    text = base64.b64encode(content).decode()
    return f'<figure><img width="3" style="max-width: 100%" src="data:image/png;base64,{text}"/>'


def test_an_answer_is_folded_up_to_the_next_heading():
    code = new_code_cell("1 + 1")
    cells = [
        *markdown("### Poll 1", "### Answer to poll 1\n\n**B**"),
        code,
        *markdown("Why", "## 2"),
    ]
    opening = '<details class="answer" id="answer-to-poll-1"><summary>Answer to poll 1</summary>'
    assert sources(folded(cells)) == [
        *("### Poll 1", opening, "\n**B**", "1 + 1", "Why", "</details>", "## 2")
    ]


def test_an_answer_at_the_end_is_closed_and_one_follows_another():
    found = sources(folded(markdown("### Answer to exercise 1", "A", "### Answer to exercise 2")))
    assert [text.startswith("<details") for text in found] == [True, False, False, True, False]
    assert found[2] == found[4] == "</details>"


@pytest.mark.parametrize("path", LESSONS, ids=lambda path: path.stem)
def test_the_page_of_a_lesson_has_all_of_it_but_its_run_sheet(path, tmp_path):
    notebook = nbformat.read(path, as_version=4)
    page, sheet = prepared(
        f"notebooks/{path.name}", f"lessons/{path.name}", ROOT, Pictures(ROOT, tmp_path)
    )
    code = [cell.source for cell in notebook.cells if cell.cell_type == "code"]
    assert [cell.source for cell in page.cells if cell.cell_type == "code"] == code
    assert bool(sheet) == (path.stem != "00_start_here")
    text = "\n".join(sources(page.cells))
    assert "Run sheet for the lecturer" not in text
    assert "at the end |" not in text
    assert text.count("<details") == text.count("</details>")
    assert text.count('class="answer"') == sum(
        "### Answer to" in s for s in sources(notebook.cells)
    )


def test_pictures_become_files_and_figures_are_not_written_twice(tmp_path):
    figure, other = png((3, 2), "red"), png((4, 5), "blue")
    (tmp_path / "figures").mkdir()
    (tmp_path / "figures" / "one.png").write_bytes(figure)
    pictures = Pictures(tmp_path, tmp_path / "lessons")
    found = pictures.taken_out(shown(figure))
    assert 'style="aspect-ratio: 3/2; max-width: 100%"' in found
    assert 'loading="lazy" src="../figures/one.png"' in found
    found = pictures.taken_out(shown(other) + shown(other))
    (written,) = (tmp_path / "lessons" / "pictures").iterdir()
    assert written.read_bytes() == other
    assert found.count(f'src="pictures/{written.name}"') == 2
    assert "base64" not in found


def test_a_caption_links_its_files_and_a_still_its_picture():
    small = "<figcaption>A turn. <small>turn.png, .csv</small></figcaption></figure>"
    still = f'<figure><img width="3" src="../figures/turn.png"/>{small}'
    linked = '<small><a href="../figures/turn.png">turn.png</a>, '
    linked += '<a href="../figures/turn.csv">.csv</a></small>'
    found = with_files(still)
    assert '<a href="../figures/turn.png"><img width="3" src="../figures/turn.png"/></a>' in found
    assert linked in found
    player = f'<figure><img src="pictures/0.png"/>{small}<script>1</script>'
    assert "<figure><img" in with_files(player)
    assert linked in with_files(player)


def test_a_lesson_that_is_named_is_linked(tmp_path):
    page, _ = prepared(
        "notebooks/06_geodesics.ipynb",
        "lessons/06_geodesics.ipynb",
        ROOT,
        Pictures(ROOT, tmp_path),
    )
    assert "([lesson 3](03_rotations_in_space.ipynb))" in page.cells[0].source
    assert "[run sheet](../teach/06_geodesics.md) is apart" in page.cells[0].source
    first, _ = prepared(
        "notebooks/00_start_here.ipynb", "lessons/x.ipynb", ROOT, Pictures(ROOT, tmp_path)
    )
    assert "On to [lesson 1](01_plane.ipynb)" in first.cells[-1].source
    explorers = [c for c in page.cells if "explorers.theta_explorer()" in c.source]
    shown = explorers[0].outputs[0]["data"]["text/html"]
    assert shown.startswith("<p>Of its controls these move here: <b>")


def test_the_figures_of_a_lesson_have_their_sections_and_lines():
    lines = 'save_animation(\n    fig, "lesson01_way", data, alt)'
    data = {"text/plain": "lesson01_way: A way.", "text/html": "…"}
    drawn = new_code_cell(lines, outputs=[new_output("execute_result", data=data)])
    cells = [*markdown("# Title", "## 3 · Ways"), new_code_cell("x = 1"), drawn]
    (figure,) = figures_of("01_plane", new_notebook(cells=cells))
    assert (figure.name, figure.lesson, figure.section) == ("lesson01_way", "01_plane", "3")
    assert (figure.lines, figure.text) == (lines, "A way.")


def test_every_figure_is_drawn_by_a_lesson():
    found = [f.name for p in LESSONS for f in figures_of(p.stem, nbformat.read(p, as_version=4))]
    assert sorted(found) == sorted(path.stem for path in (ROOT / "figures").glob("*.png"))


def test_every_explorer_has_a_living_page():
    for path in (ROOT / "figures" / "explorers").iterdir():
        figure = living(path.stem, ROOT)
        assert figure.startswith("<figure>")
        assert figure.rstrip().endswith("</figure>")


def test_a_sheet_is_split_off_and_works_are_found():
    cells = markdown("# T", "## References\n\n- [A] B\n", "## Run sheet for the lecturer\n\nx", "y")
    rest, sheet = split_sheet(new_notebook(cells=cells))
    assert sources(rest) == ["# T", "## References\n\n- [A] B\n"]
    assert sheet == "x\n\ny"
    assert cited_in(new_notebook(cells=cells)) == ["- [A] B"]


def test_a_lesson_can_be_downloaded_and_with_a_repository_be_run():
    def first(repository):
        notebook = new_notebook(cells=markdown("# T\n\ntext"))
        return with_buttons(notebook, "01_plane.ipynb", repository).cells[0].source

    assert '<a download href="01_plane.ipynb">' in first("")
    assert "mybinder" not in first("")
    assert "https://mybinder.org/v2/gh/us/course/HEAD?labpath=notebooks%2F01_plane.ipynb" in first(
        "us/course"
    )
    assert first("").startswith("# 01 · T\n\n")
    assert first("").endswith("\n\ntext")


def test_a_downloaded_lesson_has_no_outputs():
    ran = new_code_cell("1", outputs=[new_output("stream", text="1")])
    assert without_outputs(new_notebook(cells=[ran])).cells[0].outputs == []
