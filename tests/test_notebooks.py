"""The lessons as they are stored: complete, and the same on every machine."""

import ast
import base64
import io
import re
from pathlib import Path

import nbformat
import numpy as np
import pytest
from PIL import Image

from rbclassroom.course import notebooks
from rbclassroom.course.agreement import BASE64

ROOT = Path(__file__).parents[1]
LESSONS = notebooks.lesson_paths(ROOT / "notebooks")
STORED = ROOT / "figures"
TAGS = {
    "half-in-lectures",
    "hide-input",
    "hide-output",
    "nbval-check-output",
    "nbval-ignore-output",
    "nbval-skip",
    "not-in-lectures",
    "parameters",
    "raises-exception",
    "remove-cell",
    "remove-input",
    "solution",
}
RESIDUE = re.compile(r"(?<!< )\b\d\.?\d*e-(?:1[3-9]|[2-9]\d|\d{3})|\d\.\d{14,}|-0\.(?!\d)")
CLOCKS = {"time", "timeit", "datetime"}


def code_cells(notebook):
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


def stored_text(notebook):
    """All text that the outputs of a notebook show, without pictures."""
    for cell in code_cells(notebook):
        for output in cell.outputs:
            data = output.get("data", {})
            yield from (output.get("text", ""), data.get("text/plain", ""))
            yield re.sub(BASE64, "", data.get("text/html", ""))


def imported(source):
    plain = "\n".join(
        line for line in source.splitlines() if not line.lstrip().startswith(("%", "!"))
    )
    for node in ast.walk(ast.parse(plain)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.module


def faults(notebook):
    """What is wrong with a notebook as it is stored."""
    if notebook.metadata.get("kernelspec", {}).get("name") != "python3":
        yield "the kernel is not python3"
    heads = [cell.source.splitlines()[0] for cell in notebook.cells if cell.source]
    if sum(line.startswith("# ") for line in heads) != 1:
        yield "not one title"
    for cell in notebook.cells:
        lines, tags = cell.source.splitlines(), cell.metadata.get("tags", [])
        if cell.cell_type == "markdown" and any(line.startswith("#") for line in lines[1:]):
            yield "a heading is not the first line of its cell"
        if cell.metadata.get("jp-MarkdownHeadingCollapsed") and len(lines) > 1:
            yield "a collapsed heading shows what follows it"
        yield from (f"unknown tag {tag}" for tag in tags if tag not in TAGS)
        if "nbval-skip" in tags and "skipped" not in cell.source:
            yield "a skipped cell gives no reason"
    for number, cell in enumerate(code_cells(notebook), start=1):
        if cell.execution_count != number:
            yield "a cell is not executed, or not in order: run course.py figures with its number"
        if len(cell.source.splitlines()) > 10:
            yield "a cell is longer than ten lines"
        if any(out.output_type == "error" or out.get("name") == "stderr" for out in cell.outputs):
            yield "an error or a warning is stored"
        if CLOCKS & set(imported(cell.source)) or re.search(r"^\s*%%?time", cell.source, re.M):
            yield "a cell measures time"
    for text in stored_text(notebook):
        yield from (f"rounding residue {hit}" for hit in RESIDUE.findall(text))


@pytest.mark.parametrize("path", LESSONS, ids=lambda path: path.stem)
def test_stored_lessons_are_complete(path):
    assert list(faults(nbformat.read(path, as_version=4))) == []


START = (ROOT / "notebooks" / "00_start_here.ipynb").read_text("utf-8")


@pytest.mark.parametrize("path", LESSONS[1:], ids=lambda path: path.stem)
def test_every_lesson_is_announced_with_the_minutes_that_it_gives_itself(path):
    head = nbformat.read(path, as_version=4).cells[0].source
    (time,) = re.findall(r"^\| Time \| (.*) \|$", head, re.MULTILINE)
    minutes = " + ".join(re.findall(r"(\d+) (?:minutes|more)", time))
    readme = (ROOT / "README.md").read_text("utf-8")
    assert f"({path.name}) |" in START
    assert re.search(rf"\({path.name}\) \|[^|]*\| {re.escape(minutes)} \|", START)
    assert re.search(rf"\(notebooks/{path.name}\) \|[^|]*\| {re.escape(minutes)} \|", readme)


def test_every_stored_figure_is_drawn_by_a_lesson():
    sources = "".join(path.read_text("utf-8") for path in LESSONS)
    names = set(re.findall(r'save_(?:figure\(fig, |animation\(fig, |table\()\\"(\w+)\\"', sources))
    assert {file.stem for file in STORED.iterdir() if file.is_file()} == names


@pytest.mark.parametrize("path", LESSONS, ids=lambda path: path.stem)
def test_the_figures_in_a_lesson_are_the_stored_ones(path):
    """All whose captions name files; what an exercise shows may have none."""
    text = path.read_text("utf-8")
    shown = re.findall(BASE64 + r".{0,30}<figcaption>[^<]* <small>(\w+)\.", text)
    assert len(shown) == len(re.findall(r"<small>\w+\.(?:png|gif), ", text))
    for picture, name in shown:
        content, stored = base64.b64decode(picture), (STORED / f"{name}.png").read_bytes()
        if content == stored:
            continue
        # the still of what can be turned is less fine
        still, fine = (Image.open(io.BytesIO(png)).convert("RGB") for png in (content, stored))
        assert still.width < fine.width
        off = np.abs(np.asarray(fine.resize(still.size), int) - np.asarray(still, int))
        assert (off.max(axis=-1) > 128).mean() < 0.01, name


CITED = re.compile(r"\[([A-Za-z]+\d{4}(?:; [A-Za-z]+\d{4})*)\]")
WORKS = dict(
    re.findall(
        r"@\w+\{(\w+),\n(.*?)\n\}",
        (ROOT / "notebooks/REFERENCES.bib").read_text("utf-8"),
        re.DOTALL,
    )
)


def cited_and_listed(path):
    """The keys in the text of a lesson, and the lines below its heading "References"."""
    texts = [c.source for c in nbformat.read(path, as_version=4).cells if c.cell_type == "markdown"]
    lists = [text for text in texts if text.startswith("## References")]
    keys = [
        group.split("; ") for text in texts if text not in lists for group in CITED.findall(text)
    ]
    return {key for group in keys for key in group}, "".join(lists).splitlines()[2:]


def plain(words):
    """A field of BibTeX without its commands and braces."""
    return re.sub(r"\\['v]|[{}]", "", words.replace(r"\'e", "é"))


@pytest.mark.parametrize("path", LESSONS, ids=lambda path: path.stem)
def test_what_a_lesson_cites_is_listed_at_its_end_as_in_the_references(path):
    keys, lines = cited_and_listed(path)
    assert [re.match(r"- \[(\w+)\]", line)[1] for line in lines] == sorted(keys)
    for line in lines:
        work = dict(re.findall(r"^  (\w+) = \{(.*)\},?$", WORKS[line[3 : line.index("]")]], re.M))
        assert f"*{plain(work['title'])}*" in line
        assert line.endswith(f", {work['year']}.")
        for author in work["author"].split(" and "):
            family = plain(author.partition(",")[0])
            assert family.replace("Zefran", "Žefran") in line


def test_every_work_in_the_references_is_cited():
    assert set().union(*(cited_and_listed(path)[0] for path in LESSONS)) == set(WORKS)


@pytest.mark.parametrize("path", LESSONS[1:], ids=lambda path: path.stem)
def test_there_are_two_questions_for_each_objective(path):
    head = nbformat.read(path, as_version=4).cells[0].source
    wanted = re.findall(r"^- (.*)[.;]$", head, re.MULTILINE)
    name = path.stem.replace("_", " ", 1)
    page = (ROOT / "notebooks" / "QUESTIONS.md").read_text("utf-8")
    (part,) = re.findall(rf"^## {name}\n(.*?)(?=^## |\Z)", page, re.MULTILINE | re.DOTALL)
    asked = re.findall(r"^### (.*)\n1\. .+\n2\. .+\n#### Answers\n1\. .+\n2\. .+$", part, re.M)
    assert asked == wanted
