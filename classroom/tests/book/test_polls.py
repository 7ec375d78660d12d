"""Polls in the book: each option has its own explanation."""

import re
from pathlib import Path

import nbformat
import pytest
from nbformat.v4 import new_markdown_cell

from rbclassroom.book import polls
from rbclassroom.course.notebooks import lesson_paths
from rbclassroom.lecture import slides
from rbclassroom.lecture.slides import deck_of

PATHS = lesson_paths(Path(__file__).parents[3] / "notebooks")
OPTION = re.compile(
    r'^- <details name="Poll \d+"><summary>\n\n  \*\*([A-Z])\*\* <span>.+</span>\n\n'
    r'  </summary><div role="status" class="idea( right)?">\n\n'
    r"  (.*(?:\n.*)*?)\n\n  </div></details>$",
    re.MULTILINE,
)


@pytest.mark.parametrize("path", PATHS, ids=lambda path: path.stem)
def test_each_poll_option_has_its_own_explanation(path, monkeypatch):
    monkeypatch.setattr(slides, "picture_of", lambda cell: ("", 1))  # takes most of the time
    verdicts = {slide.poll: slide for slide in deck_of(path).shown if slide.kind == "verdict"}
    cells = nbformat.read(path, as_version=4).cells
    polls.voted(cells)
    asked = [cell.source for cell in cells if cell.source.startswith("### Poll")]
    assert len(asked) == len(verdicts)
    for text in asked:
        verdict = verdicts[re.match("### (Poll [0-9]+)", text)[1]]
        found = OPTION.findall(text)
        assert [letter for letter, _, _ in found] == list(verdict.options)
        assert [letter for letter, right, _ in found if right] == [verdict.right]
        lines = [line for *_, line in found]
        assert len(set(lines)) == len(lines)
        for letter, right, line in found:
            assert line.startswith("*Right.* " if right else "*Not quite.* ")
            assert f"**{letter}**" in line
            others = set(verdict.options) - {letter}
            assert not any(f"**{other}**" in line for other in others), line


def test_an_answer_that_omits_a_poll_option_raises_an_error():
    question = "### Poll 2\n\nWhich?\n\n- **A** · one\n- **B** · two"
    for answer, match in (
        ("It is **A**.", "Poll 2: the answer does not explain B"),
        ("- **A** is one.\n- **B** is two.", "no paragraph"),
    ):
        cells = [new_markdown_cell(text) for text in (question, "### Answer to poll 2", answer)]
        with pytest.raises(ValueError, match=match):
            polls.voted(cells)
