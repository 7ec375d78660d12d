"""The lecture view: the server with a tiny lesson, as the command line starts it."""

import re
import signal
import sys
from copy import deepcopy

import pytest
from nbformat import NotebookNode
from nbformat.v4 import new_code_cell, new_markdown_cell
from tiny import ask, lecture, lesson_at

from rbclassroom.course import rehearsal
from rbclassroom.course.lecture import find_lesson, mark_sections
from rbclassroom.course.show import main


def test_a_lesson_is_found_by_its_number(tmp_path, monkeypatch):
    path = lesson_at(tmp_path)
    assert find_lesson("01", path.parent) == find_lesson("1", path.parent) == path
    for number in ("2", "11", "plane", ""):
        with pytest.raises(ValueError, match=f"no lesson {number}; there are: 01"):
            find_lesson(number, path.parent)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["lecture", "7"])
    with pytest.raises(SystemExit, match=r"^There is no lesson 7; there are: 01\.$"):
        main()


def sections(*cells):
    """The sources, with { where a folded section opens and } for each that closes."""
    notebook = NotebookNode(cells=[deepcopy(cell) for cell in cells])
    mark_sections(notebook)
    marks = [(cell.source, cell.metadata.lecture) for cell in notebook.cells]
    return " ".join("{" * m.opens + source + "}" * m.closes for source, m in marks)


def answer(text):
    return new_markdown_cell(text, metadata={"jp-MarkdownHeadingCollapsed": True})


def test_a_folded_section_reaches_to_the_next_heading_of_its_level_or_a_higher_one():
    text, code = new_markdown_cell("text"), new_code_cell("# no heading")
    for level in ("##", "###"):
        end = new_markdown_cell(f"{level} end")
        cells = answer("### a"), text, code, end
        assert sections(*cells) == f"{{### a text # no heading}} {level} end"
    lower = new_markdown_cell("#### b")
    assert sections(text, answer("### a"), lower, text) == "text {### a #### b text}"
    assert sections(answer("### a"), answer("### b"), text) == "{### a} {### b text}"
    assert sections(answer("## a"), answer("### b"), text) == "{## a {### b text}}"
    assert sections(answer("### a\n\nmore"), text) == "{### a \nmore text}"
    assert sections(new_markdown_cell("### a"), text) == "### a text"


def test_with_the_token_the_lesson_is_seen_folded_and_without_it_nothing(tmp_path):
    lesson_at(
        tmp_path,
        new_markdown_cell("# Tiny"),
        answer("### Answer"),
        new_code_cell("import os; print(6 * 7, os.getcwd(), os.environ['RBCOURSE_FIGURES'])"),
        new_markdown_cell("## After"),
        new_markdown_cell("## Run sheet"),
    )
    refused = (302, 401, 403)
    with lecture(tmp_path) as (address, server):
        assert address.startswith("http://127.0.0.1:")
        status, text, _ = ask(address.split("?")[0])
        assert status in refused
        assert "Tiny" not in text
        assert ask(re.sub("token=.", "token=!", address))[0] in refused
        status, text, _ = ask(address)
        assert status == 200
        page = rehearsal._Page()
        page.feed(text)
        assert (page.errors, page.outside) == ([], [])
        assert page.cells >= 5
        for channels in ("", "/channels"):
            kernels = address.split("?")[0] + f"api/kernels/{page.kernel}{channels}"
            assert ask(kernels)[0] in refused
        server.send_signal(signal.SIGTERM if sys.platform == "win32" else signal.SIGINT)
        server.wait()
    folded = text[text.index('<details class="lecture-answer">') : text.index(">After")]
    assert "Tiny" not in folded
    assert "Answer" in folded
    assert folded.count("<details") == folded.count("</details>") == 1
    assert re.search(r"42 \S+notebooks \S+figures", text)
    assert str(tmp_path / "figures") not in text
    assert "getcwd" not in text  # no code
    unseen = text[text.index('<div hidden class="lecture-sheet">') :]
    assert "Run sheet" in unseen
    assert "After" not in unseen
    assert not re.search(r"<details[^>]* open", text)
