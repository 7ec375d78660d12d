"""The ledger is complete and fresh, and every name in it resolves."""

import importlib
import re
from pathlib import Path

import nbformat
import numpy as np
import pytest
from nbformat.v4 import new_markdown_cell, new_notebook

from rbcourse import ledger

ROOT = Path(__file__).parents[1]
FOUND = ledger.collect(ROOT)
PAGE = (ROOT / "LEDGER.md").read_text("utf-8")
ENTRIES = ledger.SOURCES["entries"]
TO_COME = ledger.SOURCES["to_come"]


def test_the_stored_ledger_is_fresh():
    assert ledger.render(FOUND) == PAGE


def test_every_entry_that_has_landed_has_function_test_and_lesson():
    open_entries = {key: FOUND[key].lacks(key) for key in ENTRIES if key not in TO_COME}
    assert {key: kinds for key, kinds in open_entries.items() if kinds} == {}


def test_what_has_landed_is_not_still_to_come():
    assert [key for key in TO_COME if not FOUND[key].lacks(key)] == []
    planar, arm = range(14, 20), range(20, 24)
    later = {f"RR ({i})" for i in (*planar, *arm)} | {f"RR Fig. {i}" for i in range(6, 10)}
    assert set(TO_COME) <= later | {f"RR {k}.{i}" for k in (3, 4) for i in (1, 2, 3)}
    assert set(TO_COME) <= set(ENTRIES)
    assert ledger.SOURCES["prose"] == ["BK 1", "BK 7"]


def test_every_misprint_has_a_test():
    assert [key for key in ledger.MISPRINTS if not FOUND[key].tests] == []
    assert len(ledger.MISPRINTS) == 22


def test_all_of_both_texts_is_listed():
    """Equations, propositions, corollaries, remarks, figures and sections, by their numbers."""
    counts = {
        "BK ({})": 21,
        "BK Prop. {}": 7,
        "BK Cor. {}": 2,
        "BK Remark {}": 7,
        "BK Fig. {}": 5,
        "BK 2.{}": 6,
        "BK 3.{}": 2,
        "BK 6.{}": 3,
        "RR ({})": 23,
        "RR Fig. {}": 9,
        "RR 1.{}": 6,
        "RR 2.{}": 2,
        "RR 3.{}": 3,
        "RR 4.{}": 3,
    }
    wanted = {form.format(i) for form, count in counts.items() for i in range(1, count + 1)}
    assert wanted <= set(ENTRIES)
    assert set(ENTRIES) - wanted == {"BK 1", "BK 3", "BK 4", "BK 5", "BK 6", "BK 7", "RR 2"}


def test_every_name_in_it_resolves():
    for name in {name for entry in FOUND.values() for name in entry.functions}:
        module, function = name.split(".")
        assert hasattr(importlib.import_module(f"rbcourse.{module}"), function), name
    for name in {name for entry in FOUND.values() for name in entry.tests}:
        file, function = name.split("::")
        source = (ROOT / "tests" / file).read_text("utf-8")
        assert len(re.findall(rf"^def {function}\(", source, re.MULTILINE)) == 1, name
    targets = set(re.findall(r"\]\(([^)]+)\)", PAGE))
    assert len(targets) > 20
    for target in targets:
        assert (ROOT / target).is_file(), target


@pytest.fixture
def course(tmp_path):
    """A course with one function, one test and one lesson."""
    for folder in ("rbcourse", "tests", "notebooks"):
        (tmp_path / folder).mkdir()
    docstring = "References\n    ----------\n    BK (2), RR 2.\n\n    Notes\n    BK (3)\n"
    code = f'def turn():\n    """{docstring}"""\n\nBASIS = 1\n"""Three turns (BK (2))."""\n'
    (tmp_path / "rbcourse/so3.py").write_text(code, "utf-8")
    mark = '@pytest.mark.source("BK (2)", "errata 1")'
    test = mark + '\n@pytest.mark.parametrize("key", ["BK (3)"])\ndef test_turn():\n    pass\n'
    test += '@pytest.mark.source("BK (3)")\ndef not_a_test():\n    pass\n'
    (tmp_path / "tests/test_so3.py").write_text(test, "utf-8")
    cells = [new_markdown_cell("## 3 · Turns (BK (2))\n\nBK (3)"), new_markdown_cell("BK (4)")]
    nbformat.write(new_notebook(cells=cells), tmp_path / "notebooks/03_turns.ipynb")
    return tmp_path


def test_what_is_collected(course):
    found = ledger.collect(course)
    assert found["BK (2)"].functions == ["so3.turn", "so3.BASIS"]
    assert found["BK (2)"].tests == ["test_so3.py::test_turn"]
    assert found["BK (2)"].lessons == ["03_turns.ipynb, 3"]
    assert found["BK (2)"].lacks("BK (2)") == []
    assert found["RR 2"].functions == ["so3.turn"]
    assert found["RR 2"].lacks("RR 2") == ["tests", "lessons"]
    assert found["errata 1"].tests == ["test_so3.py::test_turn"]
    for key in ("BK (3)", "BK (4)"):
        assert found[key].lacks(key) == ["functions", "tests", "lessons"]
    assert found["BK 1"].lacks("BK 1") == ["lessons"]


def test_an_unknown_key_is_named(course):
    cell = new_markdown_cell("## 1 · Turns (BK (99))")
    nbformat.write(new_notebook(cells=[cell]), course / "notebooks/03_turns.ipynb")
    with pytest.raises(ValueError, match=r"03_turns\.ipynb, 1: BK \(99\) is no entry"):
        ledger.collect(course)


@pytest.mark.source("errata 4")
def test_the_printed_numbers_of_the_propositions_repeat_one_and_skip_one():
    printed = [1, 2, 2, 4, 5, 6, 7]
    corrected = [int(key.split()[-1]) for key in ENTRIES if key.startswith("BK Prop.")]
    assert len(set(printed)) < len(printed)
    assert corrected == list(range(1, 8))
    for number, word in {2: "nearest", 3: "invariant"}.items():
        assert any(word in name for name in FOUND[f"BK Prop. {number}"].tests)


@pytest.mark.source("errata 19")
def test_the_printed_interpolation_of_the_arm_mixes_the_links():
    """The first index counts the links in the formula, start and goal in the sentence below it."""
    start, goal = np.array([0.1, 0.2]), np.array([1.0, 2.0])

    def blend(theta, t):  # (20) and (21)
        return (1 - t) * theta[:, 0] + t * theta[:, 1]

    printed, corrected = np.array([start, goal]), np.transpose([start, goal])
    assert np.array_equal([blend(corrected, t) for t in (0, 1)], [start, goal])
    assert not np.array_equal(blend(printed, 0), start)
    assert not np.array_equal(blend(printed, 1), goal)


@pytest.mark.source("errata 20")
def test_a_configuration_of_the_arm_is_no_planar_pose():
    """Two configurations take the tip to one place, and most planar poses are out of reach."""

    def tip(theta0, theta1):
        return 2 * np.exp(1j * theta0) + 1.5 * np.exp(1j * (theta0 + theta1))

    place = tip(0.3, 0.8)
    mirrored = 2 * np.angle(place) - 0.3, -0.8
    assert abs(tip(*mirrored) - place) < 1e-15
    turned = np.linspace(-np.pi, np.pi, 181)
    assert abs(tip(*np.meshgrid(turned, turned))).max() < 3.5 + 1e-12
    q0, velocity, duration = np.array([0.3, 0.8]), np.array([1.0, -0.5]), 2  # (22), (23)
    assert (q0 + velocity * duration).shape == (2,)
    with pytest.raises(ValueError, match="broadcast"):
        np.zeros(3) + velocity * duration  # x, y, θ
