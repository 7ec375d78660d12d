import re
from pathlib import Path

import nbformat
import pytest

from rbclassroom.assignments.needed_code import names_in
from rbclassroom.course import notebooks
from rbclassroom.course.agreement import BASE64
from rbclassroom.live.cells import parsed

ROOT = Path(__file__).parents[1]
STORED = ROOT / "figures"
LESSONS = {
    path: nbformat.read(path, as_version=4) for path in notebooks.lesson_paths(ROOT / "notebooks")
}
START, *TAUGHT = LESSONS
TAGS = {"nbval-check-output", "nbval-ignore-output", "nbval-skip", "parameters", "raises-exception"}
TAGS |= {"hide-input", "hide-output", "remove-cell", "remove-input", "solution"}
RESIDUE = re.compile(r"(?<!< )\b\d\.?\d*e-(?:1[3-9]|[2-9]\d|\d{3})|\d\.\d{14,}|-0\.(?!\d)")
CLOCK = re.compile(r"^\s*(?:%%?time|(?:import|from)\b.*\b(?:time|timeit|datetime)\b)", re.MULTILINE)
CITED = re.compile(r"\[([A-Za-z]+\d{4}(?:; [A-Za-z]+\d{4})*)\]")
REFERENCES = (ROOT / "notebooks/REFERENCES.bib").read_text("utf-8")
WORKS = dict(re.findall(r"@\w+\{(\w+),\n(.*?)\n\}", REFERENCES, re.DOTALL))
every_lesson = pytest.mark.parametrize("path", LESSONS, ids=lambda path: path.stem)


def faults(notebook):
    """Yield the faults of a stored notebook."""
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    if notebook.metadata.get("kernelspec", {}).get("name") != "python3":
        yield "the kernel is not python3"
    texts = [cell.source for cell in notebook.cells if cell.cell_type == "markdown"]
    if sum(text.startswith("# ") for text in texts) != 1:
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
    for number, cell in enumerate(code, start=1):
        if cell.execution_count != number:
            yield "a cell is not executed, or not in order: run course.py figures with its number"
        if len(cell.source.splitlines()) > 10:
            yield "a cell is longer than ten lines"
        if CLOCK.search(cell.source):
            yield "a cell measures time"
        for output in cell.outputs:
            if output.output_type == "error" or output.get("name") == "stderr":
                yield "an error or a warning is stored"
            data = output.get("data", {})
            html = re.sub(BASE64, "", data.get("text/html", ""))  # without pictures
            for text in (output.get("text", ""), data.get("text/plain", ""), html):
                yield from (f"rounding residue {hit}" for hit in RESIDUE.findall(text))


@every_lesson
def test_stored_lessons_are_complete(path):
    assert list(faults(LESSONS[path])) == []


def needs_of_visible_cells(notebook):
    """Yield the names in visible cells whose last value comes from a cell below a collapsed
    heading, which a reader may not have run."""
    collapsed, hidden = 0, {}
    for cell in notebook.cells:
        if heading := re.match(r"#+", cell.source) if cell.cell_type == "markdown" else None:
            level = len(heading[0])
            collapsed = 0 if level <= collapsed else collapsed
            collapsed = level if cell.metadata.get("jp-MarkdownHeadingCollapsed") else collapsed
        if cell.cell_type == "code":
            for statement in parsed(cell.source, cell.id):
                read, bound = names_in(statement)
                needed = {name for name in read - bound if hidden.get(name)}
                yield from (f"{cell.id} needs {name}" for name in needed if not collapsed)
                hidden |= dict.fromkeys(bound, bool(collapsed))


@every_lesson
def test_visible_cells_need_no_hidden_ones(path):
    assert list(needs_of_visible_cells(LESSONS[path])) == []


@every_lesson
def test_every_exercise_in_code_has_a_cell_for_the_reader(path):
    heads = [c.source.splitlines()[0] for c in LESSONS[path].cells if c.source.startswith("### ")]
    wanted = [
        re.search(r"\d+", head)[0] for head in heads if re.match(r"### Exercise .*, in code", head)
    ]
    own = [cell.id for cell in LESSONS[path].cells if cell.source == "# Your code"]
    assert own == [f"your-code-{number}" for number in wanted]


@pytest.mark.parametrize("path", TAUGHT, ids=lambda path: path.stem)
def test_every_lesson_is_listed_with_its_minutes(path):
    head = "\n".join(cell.source for cell in LESSONS[path].cells[:3])
    (time,) = re.findall(r"^\| Time \| (.*) \|$", head, re.MULTILINE)
    minutes = re.escape(" + ".join(re.findall(r"(\d+) (?:minutes|more)", time)))
    for page, link in ((START, path.name), (ROOT / "README.md", f"notebooks/{path.name}")):
        assert re.search(rf"\({link}\) \|[^|]*\| {minutes} \|", page.read_text("utf-8"))
    page = (ROOT / "notebooks" / "QUESTIONS.md").read_text("utf-8")
    name = path.stem.replace("_", " ", 1)
    (part,) = re.findall(rf"^## {name}\n(.*?)(?=^## |\Z)", page, re.MULTILINE | re.DOTALL)
    asked = re.findall(r"^### (.*)\n1\. .+\n2\. .+\n#### Answers\n1\. .+\n2\. .+$", part, re.M)
    assert asked == re.findall(r"^- (.*)[.;]$", head, re.MULTILINE)


def cited_and_listed(path):
    """Return the keys in the text of a lesson, and the lines below its heading "References"."""
    texts = [cell.source for cell in LESSONS[path].cells if cell.cell_type == "markdown"]
    lists = [text for text in texts if text.startswith("## References")]
    groups = CITED.findall("\n".join(text for text in texts if text not in lists))
    return set("; ".join(groups).split("; ")) - {""}, "".join(lists).splitlines()[2:]


@every_lesson
def test_the_works_that_a_lesson_cites_are_listed_at_its_end(path):
    keys, lines = cited_and_listed(path)
    assert [re.match(r"- \[(\w+)\]", line)[1] for line in lines] == sorted(keys)
    for line in lines:
        year = re.search(r"^  year = \{(.*)\},?$", WORKS[line[3 : line.index("]")]], re.M)[1]
        assert line.endswith(f", {year}.")


def test_every_stored_figure_is_drawn():
    sources = "".join(path.read_text("utf-8") for path in LESSONS)
    names = set(re.findall(r'save_(?:figure\(fig, |animation\(fig, |table\()\\"(\w+)\\"', sources))
    texts = re.findall(r'(paper|report)\.figure_(\d)\((?:\\"([abc])\\")?', sources)
    names |= {f"{text}_fig{number}{panel}" for text, number, panel in texts}
    assert {file.stem for file in STORED.iterdir() if file.is_file()} == names
    note = re.findall(r"^- \[(\w+)\]", (ROOT / "docs/near_optimal.md").read_text("utf-8"), re.M)
    assert set(note).union(*(cited_and_listed(path)[0] for path in LESSONS)) == set(WORKS)
