"""Compare the boxes "The paper says, we say", the glossary and the reading guide."""

import re
import tomllib
from collections import Counter
from pathlib import Path

import nbformat

ROOT = Path(__file__).parents[1]
LESSONS = {path.name[:2]: path for path in (ROOT / "notebooks").glob("[0-9][0-9]_*.ipynb")}
GUIDE = (ROOT / "docs/reading_guide.md").read_text("utf-8")
_, *ROWS = [line.split(" | ") for line in GUIDE.splitlines() if line.count(" | ") == 3]


def texts_of(number):
    """Return the texts of a lesson."""
    cells = nbformat.read(LESSONS[number], as_version=4).cells
    return [cell.source for cell in cells if cell.cell_type == "markdown"]


def test_the_glossary_lists_the_terms_of_all_boxes_with_their_lessons():
    terms = []
    for number in sorted(LESSONS)[3:]:
        (box,) = [text for text in texts_of(number) if text.startswith("## The paper says, we say")]
        found = re.findall(r"\*\*(.+?)\*\*", box)
        assert found, number
        terms += [f"{term} {number}" for term in found]
    assert max(Counter(term[:-3] for term in terms).values()) == 1
    listed = (ROOT / "docs/glossary.md").read_text("utf-8").strip().splitlines()[-1]
    assert sorted(listed.rstrip(".").split(", ")) == sorted(terms)


def test_the_reading_guide_names_sections_that_exist():
    for _, _, prepared, _ in ROWS:
        for number, some in re.findall(r"\b(\d\d)(?: \(([\d, ]+)\))?", prepared):
            for section in some.split(", ") if some else []:
                assert any(text.startswith(f"## {section} · ") for text in texts_of(number)), number


def numbers(text):
    """Return the numbers in a text such as ``5 to 8``."""
    for first, last in re.findall(r"(\d+)(?: to (\d+))?", text):
        yield from range(int(first), int(last or first) + 1)


def test_the_reading_guide_is_complete():
    table = tomllib.loads((ROOT / "classroom/rbclassroom/course/sources.toml").read_text("utf-8"))
    wrong = [
        x
        for row in ROWS
        for part in re.findall(r"misprints? ([\d, to]+)", row[3])
        for x in numbers(part)
    ]
    paper = [k for k, x in enumerate(table["misprints"], 1) if x["where"].startswith("BK")]
    assert sorted(wrong) == paper
    asked = " ".join(row[0] for row in ROWS)
    spans = re.findall(r"\((\d+)\)(?: (?:to|and) \((\d+)\))?", asked)
    equations = {x for first, last in spans for x in range(int(first), int(last or first) + 1)}
    assert equations == set(range(1, 22))
    for kind, last in {"Propositions?": 7, "Remarks?": 7, "Corollary": 2}.items():
        found = re.findall(rf"{kind} (\d(?:(?: to| and|,) \d)*)", asked)
        there = {x for part in found for x in numbers(part.replace("and", ""))}
        assert there | {3} >= set(range(1, last + 1))  # the paper calls Proposition 3 "2"
