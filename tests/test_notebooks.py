"""The lessons as they are stored: complete, fresh, and the same on every machine."""

import ast
import base64
import csv
import io
import re
from pathlib import Path

import nbformat
import numpy as np
import pytest
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook, new_output
from PIL import Image

from rbcourse import lessons

ROOT = Path(__file__).parents[1]
LESSONS = lessons.lesson_paths(ROOT / "notebooks")
STORED = ROOT / "figures"
TAGS = {
    "hide-input",
    "hide-output",
    "nbval-check-output",
    "nbval-ignore-output",
    "nbval-skip",
    "parameters",
    "raises-exception",
    "remove-cell",
    "remove-input",
    "solution",
}
BASE64 = r"base64,([A-Za-z0-9+/=]+)"
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
            yield "a cell is not executed, or not in order"
        if len(cell.source.splitlines()) > 10:
            yield "a cell is longer than ten lines"
        if any(out.output_type == "error" or out.get("name") == "stderr" for out in cell.outputs):
            yield "an error or a warning is stored"
        if CLOCKS & set(imported(cell.source)) or re.search(r"^\s*%%?time", cell.source, re.M):
            yield "a cell measures time"
    for text in stored_text(notebook):
        yield from (f"rounding residue {hit}" for hit in RESIDUE.findall(text))


def differing_pixels(one, other):
    """The share of pixels that differ visibly, by more than 16 of 255 levels in some colour, and
    the mean difference in levels."""
    a, b = (
        np.asarray(Image.open(io.BytesIO(png)).convert("RGB"), dtype=int) for png in (one, other)
    )
    if a.shape != b.shape:
        return 1.0, 255.0
    difference = np.abs(a - b)
    return (difference.max(axis=-1) > 16).mean(), difference.mean()


def look_the_same(one, other):
    """As two processors draw: at most 1 in 10,000 pixels differs visibly, the mean by 0.05."""
    if one == other:
        return True
    share, mean = differing_pixels(one, other)
    return share < 1e-4 and mean < 0.05


@pytest.fixture(scope="module", params=LESSONS, ids=lambda path: path.stem)
def run(request, tmp_path_factory):
    """A lesson, what a run of it stores, and the folder with the figures that it draws."""
    figures = tmp_path_factory.mktemp(request.param.stem)
    return request.param, lessons.execute(request.param, figures), figures


@pytest.mark.parametrize("path", LESSONS, ids=lambda path: path.stem)
def test_stored_lessons_are_complete(path):
    assert list(faults(nbformat.read(path, as_version=4))) == []


def lesson(source="x = 1", output=None, **changes):
    """A notebook without faults, but for the changes."""
    cell = new_code_cell(source, execution_count=1)
    cell.outputs = [output or new_output("stream", name="stdout", text="1.5 and < 1e-14")]
    cell.metadata.tags = changes.get("tags", ["solution"])
    cell.execution_count = changes.get("count", 1)
    text = new_markdown_cell(changes.get("text", "Text"))
    text.metadata["jp-MarkdownHeadingCollapsed"] = "folded" in changes
    kernel = {"kernelspec": {"name": changes.get("kernel", "python3"), "display_name": "Python"}}
    title = new_markdown_cell(changes.get("title", "# Title"))
    return new_notebook(cells=[title, text, cell], metadata=kernel)


def plain(text):
    return new_output("execute_result", data={"text/plain": text})


@pytest.mark.parametrize(
    ("notebook", "fault"),
    [
        (lesson(kernel="xpython"), "the kernel is not python3"),
        (lesson(title="## Title"), "not one title"),
        (lesson(text="Text\n## Next"), "a heading is not the first line of its cell"),
        (lesson(text="## Answer\n42", folded=True), "a collapsed heading shows what follows it"),
        (lesson(tags=["raises-exeption"]), "unknown tag raises-exeption"),
        (lesson(tags=["nbval-skip"]), "a skipped cell gives no reason"),
        (lesson(count=None), "a cell is not executed, or not in order"),
        (lesson("x = 1\n" * 11), "a cell is longer than ten lines"),
        (lesson(output=new_output("stream", name="stderr")), "an error or a warning is stored"),
        (lesson("from time import perf_counter"), "a cell measures time"),
        (lesson("import timeit as t"), "a cell measures time"),
        (lesson("%timeit 1"), "a cell measures time"),
        (lesson(output=plain("1.11e-16")), "rounding residue 1.11e-16"),
        (lesson(output=plain("2e-16")), "rounding residue 2e-16"),
        (lesson(output=plain("0.30000000000000004")), "rounding residue 0.30000000000000004"),
        (lesson(output=plain("[-0.  1.]")), "rounding residue -0."),
    ],
)
def test_each_fault_is_seen(notebook, fault):
    assert list(faults(notebook)) == [fault]


def test_what_is_no_fault():
    assert list(faults(lesson("time = 0.5\nprint(time)"))) == []
    assert list(faults(lesson(output=plain("difference < 1e-14, 1.0e-09, -0.5")))) == []


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


def test_stored_lessons_are_fresh(run):
    """To the byte, except for pictures: another processor may draw a pixel differently."""
    path, again, _ = run
    assert re.sub(BASE64, "", again) == re.sub(BASE64, "", path.read_text("utf-8"))


def test_stored_pictures_are_fresh(run):
    for drawn in run[2].glob("*.png"):
        stored = STORED / drawn.name
        assert look_the_same(drawn.read_bytes(), stored.read_bytes()), drawn.name


def test_stored_documents_are_fresh(run):
    """Where picture and numbers are the same to the byte, so is the document."""
    for document in run[2].glob("*.pdf"):
        others = [document.with_suffix(suffix) for suffix in (".png", ".csv")]
        if all(file.read_bytes() == (STORED / file.name).read_bytes() for file in others):
            assert document.read_bytes() == (STORED / document.name).read_bytes(), document.name


def test_stored_animations_are_fresh(run):
    """Frame by frame, as pictures; the palette may differ by a shade."""
    for drawn in run[2].glob("*.gif"):
        if drawn.read_bytes() == (STORED / drawn.name).read_bytes():
            continue
        frames, stored = (list(gif_frames(file)) for file in (drawn, STORED / drawn.name))
        assert len(frames) == len(stored)
        assert all(look_the_same(*pair) for pair in zip(frames, stored, strict=True)), drawn.name


def gif_frames(file):
    with Image.open(file) as picture:
        for i in range(picture.n_frames):
            picture.seek(i)
            content = io.BytesIO()
            picture.convert("RGB").save(content, "png")
            yield content.getvalue()


def test_stored_numbers_are_fresh(run):
    """Another processor may round differently: by 1e-12 of the largest number in the column."""
    for drawn in run[2].glob("*.csv"):
        ours, theirs = (
            list(csv.reader(io.StringIO(file.read_text("utf-8"))))
            for file in (drawn, STORED / drawn.name)
        )
        for one, other in zip(zip(*ours, strict=True), zip(*theirs, strict=True), strict=True):
            assert one == other or fresh(one, other), (drawn.name, other[0])


def fresh(one, other):
    if one[0] != other[0]:
        return False
    ours, theirs = (np.array(column[1:], dtype=float) for column in (one, other))
    allowed = np.maximum(2e-11 * np.abs(theirs), max(1e-12 * np.abs(theirs).max(), 1e-13))
    return np.all(np.abs(ours - theirs) <= allowed)


def test_what_is_fresh():
    stored = "x [m]", "1", "1e-6"
    assert fresh(("x [m]", "1.00000000001", "1.0000009e-6"), stored)
    assert not fresh(("x [m]", "1.00000000003", "1e-6"), stored)
    assert not fresh(("x [m]", "1", "1.000002e-6"), stored)
    assert not fresh(("y [m]", "1", "1e-6"), stored)


def test_every_stored_figure_is_drawn_by_a_lesson():
    sources = "".join(path.read_text("utf-8") for path in LESSONS)
    names = set(re.findall(r'save_(?:figure|animation)\(fig, \\"(\w+)\\"', sources))
    assert {file.stem for file in STORED.iterdir()} == names


@pytest.mark.parametrize("path", LESSONS, ids=lambda path: path.stem)
def test_the_figures_in_a_lesson_are_the_stored_ones(path):
    """All whose captions name files; what an exercise shows may have none."""
    text = path.read_text("utf-8")
    shown = re.findall(BASE64 + r".{0,30}<figcaption>(\w+):", text)
    assert len(shown) == len(re.findall(r"<figcaption>\w+: \.", text))
    for picture, name in shown:
        assert base64.b64decode(picture) == (STORED / f"{name}.png").read_bytes()


def test_a_changed_picture_is_seen():
    stored = (STORED / "paper_fig2a.png").read_bytes()
    picture = Image.open(io.BytesIO(stored)).convert("RGB")
    letter, tint = picture.copy(), picture.point(lambda level: min(level, 250))
    letter.paste((0, 0, 0), (500, 200, 512, 208))
    assert look_the_same(stored, stored)
    for changed in (letter, tint):
        content = io.BytesIO()
        changed.save(content, "png")
        assert not look_the_same(stored, content.getvalue())
