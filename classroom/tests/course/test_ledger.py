"""The ledger is complete and up to date."""

import re
from pathlib import Path

import nbformat
import pytest
from nbformat.v4 import new_markdown_cell, new_notebook

from rbclassroom.course import ledger

ROOT = Path(__file__).parents[3]
PAGE = (ROOT / "docs/ledger.md").read_text("utf-8")
ENTRIES = ledger.SOURCES["entries"]


@pytest.fixture(scope="module")
def found():
    return ledger.collect(ROOT)


def test_the_stored_ledger_is_up_to_date_and_legible(found):
    assert ledger.render(found) == PAGE
    entries = PAGE.partition("## Misprints")[0].splitlines()
    assert max(map(len, entries)) <= 165
    modules = "curves.geodesics, straight_line, explorers"
    assert f"| BK (16) | the angle θ(t) | {modules} | 06 |" in entries


def test_every_entry_names_a_function_a_test_and_a_lesson(found):
    assert {key: lacks for key in ENTRIES if (lacks := found[key].lacks())} == {}
    beyond = [f"beyond BK {i}" for i in range(1, 18)]
    assert list(ledger.SOURCES["beyond"]) == beyond
    assert [key for key in beyond if not (found[key].functions and found[key].tests)] == []
    assert [key for key in ledger.MISPRINTS if not found[key].tests] == []
    assert len(ledger.MISPRINTS) == 36


def test_all_parts_of_both_texts_are_listed():
    """Check equations, propositions, corollaries, remarks, figures and sections by their
    numbers."""
    counts = {
        **{"BK ({})": 21, "BK Prop. {}": 7, "BK Cor. {}": 2, "BK Remark {}": 7, "BK Fig. {}": 5},
        **{"BK 2.{}": 6, "BK 3.{}": 2, "BK 6.{}": 3, "RR ({})": 23, "RR Fig. {}": 9},
        **{"RR 1.{}": 6, "RR 2.{}": 2, "RR 3.{}": 3, "RR 4.{}": 3},
    }
    wanted = {form.format(i) for form, count in counts.items() for i in range(1, count + 1)}
    assert wanted <= set(ENTRIES)
    assert set(ENTRIES) - wanted == {"BK 1", "BK 3", "BK 4", "BK 5", "BK 6", "BK 7", "RR 2", "RR 4"}


CODE = '''
def turn():
    """Turn.

    Source: BK (2),
    RR 2.

    Notes
    -----
    BK (3)
    """

BASIS = 1
"""Three turns (BK (2))."""
'''
TESTS = """
@pytest.mark.source("BK (2)", "errata 1")
@pytest.mark.parametrize("key", ["BK (3)"])
def test_turn():
    pass

@pytest.mark.source("BK (3)")
def not_a_test():
    pass
"""


def test_an_unknown_key_is_refused(tmp_path):
    """The keys are found in a function, a constant, a test and a lesson."""
    for folder in ("rbcourse", "tests", "notebooks"):
        (tmp_path / folder).mkdir()
    (tmp_path / "rbcourse/so3.py").write_text(CODE, "utf-8")
    (tmp_path / "tests/test_so3.py").write_text(TESTS, "utf-8")
    texts = "## 3 · Turns\n\n<small>BK (2)</small>\n\nBK (3)", "BK (4)"
    lesson = new_notebook(cells=[new_markdown_cell(text) for text in texts])
    nbformat.write(lesson, tmp_path / "notebooks/03_turns.ipynb")
    found = ledger.collect(tmp_path)
    functions, tests = ["so3.turn", "so3.BASIS"], ["test_so3.py::test_turn"]
    assert found["BK (2)"] == ledger.Entry(functions, tests, ["03_turns.ipynb, 3"])
    assert found["BK (2)"].lacks() == []
    assert found["RR 2"].functions == functions[:1]
    assert found["RR 2"].lacks() == ["tests", "lessons"]
    assert found["errata 1"].tests == tests
    for key in ("BK (3)", "BK (4)", "BK 1"):
        assert found[key].lacks() == ["functions", "tests", "lessons"]
    lesson.cells[0].source = "## 1 · Turns\n\n<small>BK (99)</small>"
    nbformat.write(lesson, tmp_path / "notebooks/03_turns.ipynb")
    said = r"03_turns\.ipynb, 1: a key of sources\.toml is wanted, got BK \(99\)"
    with pytest.raises(ValueError, match=said):
        ledger.collect(tmp_path)
    assert ledger.KEY.findall("beyond BK 3, BK 3, BK 6.1.2") == ["beyond BK 3", "BK 3"]


@pytest.mark.source("errata 4")
def test_one_proposition_number_is_printed_twice(found):
    """The proofs cite the projection as propositions 1 and 4, which are about other functions."""
    row = ledger.MISPRINTS["errata 4"]
    printed, cited = (list(map(int, re.findall(r"\d", x))) for x in row["printed"].split(";"))
    corrected = [int(key.split()[-1]) for key in ENTRIES if key.startswith("BK Prop.")]
    assert corrected == list(range(1, 8))
    assert [a - b for a, b in zip(printed, corrected, strict=True)] == [0, 0, -1, 0, 0, 0, 0]
    for number in {*cited, 2}:
        found_there = "projection.project_so" in found[f"BK Prop. {number}"].functions
        assert found_there == (number == 2)
    for number, word in {2: "nearest", 3: "invariant"}.items():
        assert any(word in name for name in found[f"BK Prop. {number}"].tests)


@pytest.mark.source("errata 33")
def test_the_volume_of_a_cited_paper_belongs_to_its_year():
    """Volume 1 of the journal (IEEE Transactions on Robotics and Automation) is of 1985."""
    works = (ROOT / "notebooks/REFERENCES.bib").read_text("utf-8").split("\n@")
    (work,) = (work for work in works if "{ZefranKumarCroke1998," in work)
    volume, year, first = (
        int(re.search(rf"{name} = \{{(\d+)", work)[1]) for name in ("volume", "year", "pages")
    )
    assert (year, first) == (1984 + volume, 576)
    printed = ledger.MISPRINTS["errata 33"]["printed"]
    assert str(year) not in printed
    assert str(first) not in printed
    (work,) = (work for work in works if "{Juttler1994," in work)
    assert 'J{\\"u}ttler' in work
