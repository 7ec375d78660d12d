"""Test the file with a student's own functions: it grows, and later sets use it."""

import json
import re

import nbformat
import numpy as np
import pytest
from nbformat.v4 import new_code_cell
from quick import quick_for
from test_problems import SETS, SOURCE, TABLES, cells

from rbclassroom.assignments import my_motion, twins
from rbclassroom.assignments.check import check
from rbclassroom.assignments.handout import release
from rbclassroom.assignments.my_motion import FILE, OWN, find, keep, mine
from rbclassroom.assignments.tables import update
from rbcourse import acceleration_cost, exp_so3, minimum_acceleration, projected_cubic

ORDER = [f"ps{number}" for number in (1, 2, 3, 4, 8, 5, 6, 7, 9)]


def data_of(name):
    update(SOURCE / name)
    return (SOURCE / name / f"{name}.json").read_text("utf-8")


def kept_by(name):
    return [each["keep"] for each in json.loads(data_of(name)).values() if "keep" in each]


def answers(name):
    """Return the code of a student whose answers are the model answers."""
    found = {key: cell.source for key, cell in cells(name).items() if cell.cell_type == "code"}
    own = [(key, text) for key, text in found.items() if key == "setup" or key.endswith("-answer")]
    return [(key, re.sub(r" *### (BEGIN|END) SOLUTION\n?", "", text)) for key, text in own]


def after(text, name, passed=None):
    return keep(text, name, data_of(name), answers(name), passed or [*TABLES[name]], "Ada")[0]


@pytest.fixture(scope="module")
def whole():
    text = ""
    for name in ORDER:
        text = after(text, name)
    return text


def test_the_file_of_all_sets_draws_figure_5_with_the_costs_of_the_package(whole):
    assert "By Ada." in whole
    assert whole.count("\n") < 220
    assert not re.search("rbcourse|rbclassroom|SOLUTION", whole)
    space = {}
    exec(whole, space)
    ends = np.eye(3), exp_so3([np.pi / 6, 2 * np.pi / 3, np.pi / 2]), [1.0, 2, 3], [2.0, 1, 1]
    best, near = minimum_acceleration(*ends), projected_cubic(*ends)
    t, ends = space["nodes"](36), [np.array(end, float) for end in ends]
    projected = np.array([space["projected_cubic"](*ends, time) for time in t])
    costs = [space["rotation_cost"](t, R) for R in (space["relax"](*ends, 36), projected)]
    wanted = [acceleration_cost(best), acceleration_cost(near)]
    np.testing.assert_allclose(costs, wanted, rtol=1e-8)
    assert round(costs[1] / costs[0], 2) == 1.77


def test_a_set_that_is_kept_again_does_not_change_the_file(whole):
    earlier = re.sub(r"\d{4}-\d\d-\d\d", "2020-02-29", whole)
    text = before = f"{earlier}\n\ndef own():\n    return 'mine'\n"
    for name in ORDER[1::3]:
        text = after(text, name)
    assert text == before


def test_a_late_starter_borrows_functions_until_the_own_ones_pass():
    text = after("", "ps4")
    lent = re.findall(r"from rbclassroom.* import (\w+)  # the course's", text)
    assert lent == ["exp_so3", "hat_so3", "log_so3", "nearest_rotation"]
    exec(text, {})
    assert "rbclassroom" not in after(text, "ps2")


def test_only_accepted_functions_are_kept_and_none_is_lost():
    text = after("", "ps4", ["geodesic", "screw"])
    assert "def screw" in text
    assert "def projected_line" not in text
    unchanged, said = keep(text, "ps4", data_of("ps4"), answers("ps4"), ["screw"])
    assert unchanged == text
    assert (
        said == f"{FILE} is not changed: geodesic passed in an earlier check of ps4, and fails now"
    )
    assert keep("", "ps4", data_of("ps4"), answers("ps4"), ["theta"]) == ("", "")


def test_code_with_another_meaning_is_not_overwritten():
    text = f"{after('', 'ps2')}\n\ndef coupling(Q):\n    return 'another meaning'\n"
    for broken, said in (
        (text, "“my own functions” has another “coupling”; rename one of them"),
        (text.replace("import numpy", "import numpy as"), "it is not Python: invalid syntax"),
        (text.replace(OWN, ""), "a set has two parts, or the line"),
    ):
        same, told = keep(broken, "ps7", data_of("ps7"), answers("ps7"), ["spline"])
        assert same == broken
        assert said in told


PATH = "def geodesic(R0, R1, t):\n    return exp_so3(log_so3(R1 @ R0.T) * t) @ R0\n"
NEEDED = {
    "a comment, a constant, and a command of Jupyter": f"""%matplotlib inline
from math import pi, tau

# half a turn
HALF = pi
{PATH.replace(" * t", " * t * HALF / (tau - HALF)")}""",
    "a changed array": "eye = np.zeros((3, 3))\nfor k in range(3):\n    eye[k, k] = 1\n"
    + PATH.replace("@ R0\n", "@ R0 @ eye\n"),
    "a decorator, a class and a later definition": f"""import functools
class Turn:
    def __init__(self, R):
        self.R = R
@functools.lru_cache
def one(): return 2
def one(): return 1
{PATH.replace("return exp", "return one() * Turn(exp").replace("t) @", "t)).R @")}""",
    "a star": f"from math import *\n{PATH.replace('* t', '* t * cos(0)')}",
    "a question, and a text with a mark": f"{PATH}    '''\n# %% ps3\n'''\ngeodesic?",
    "a wrapped function": f"{PATH}plain = geodesic\ngeodesic = lambda *ends: plain(*ends)\n",
}


@pytest.mark.parametrize("code", NEEDED.values(), ids=NEEDED)
def test_the_code_that_a_function_needs_comes_along(code):
    later = "geodesic = None\ndef one(): pass"
    given = [answers("ps4")[0], ("", "1 +"), ("geodesic-answer", code), ("", later)]
    text, said = keep(after("", "ps2"), "ps4", data_of("ps4"), given, ["geodesic"])
    assert said == f"{FILE} has your geodesic"
    assert "rbclassroom" not in text
    assert ("# half a turn\nHALF = pi" in text) == ("HALF" in code)
    assert "def one(): pass" not in text


@pytest.mark.parametrize(
    ("code", "why"),
    [
        (PATH.replace("* t", "* t * unknown"), "unknown is not defined"),
        (PATH.replace("exp_so3", "mine('exp_so3')"), "mine is not defined"),
        (PATH.replace("return", "1 / 0\n    return"), "your code fails: Your function stops"),
    ],
)
def test_code_that_fails_in_the_file_is_refused(code, why):
    text = after("", "ps2")
    given = [answers("ps4")[0], ("geodesic-answer", code)]
    same, said = keep(text, "ps4", data_of("ps4"), given, ["geodesic"])
    assert same == text
    assert why in said


@pytest.mark.parametrize("name", ["UNI\\nora", 'a"""b', ""])
def test_each_name_of_an_account_is_possible(name, monkeypatch):
    def account():
        if name:
            return name
        raise KeyError("getpwuid(): uid not found")

    monkeypatch.setattr(my_motion.getpass, "getuser", account)
    text, said = keep("", "ps2", data_of("ps2"), answers("ps2"), ["hat"])
    assert said == f"{FILE} has your hat_so3"
    compile(text, FILE, "exec")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    (tmp_path / "ps4").mkdir()
    monkeypatch.setattr(my_motion, "start_folder", lambda: tmp_path / "ps4")
    return tmp_path


def test_a_later_set_uses_right_functions_and_replaces_others(folder, capsys, monkeypatch):
    assert mine("exp_so3") is twins.exp_so3
    assert "does not contain them yet" in capsys.readouterr().out
    right = (
        "def vee_so3(A):\n    K = (A - A.T) / 2\n    return np.array([K[2, 1], K[0, 2], K[1, 0]])\n"
    )
    wrong = "def hat_so3(w):\n    return np.zeros((3, 3))\n"
    shorter = "def cubic(p0, p1):\n    return p0\n"
    text = f"import numpy as np\n{right}\n{wrong}\n{shorter}"
    (folder / FILE).write_text(text, "utf-8")
    vee, hat, log, cubic = mine("vee_so3", "hat_so3", "log_so3", "cubic")
    assert vee.__module__ == "my_motion"
    assert (hat, log, cubic) == (twins.hat_so3, twins.log_so3, twins.cubic)
    assert capsys.readouterr().out.splitlines() == [
        f"vee_so3: your own, from {FILE}",
        "hat_so3, cubic: the course's, because yours give other results",
        f"log_so3: the course's, because {FILE} does not contain them yet",
    ]
    with monkeypatch.context() as patch:
        patch.setattr(twins, "alone", True)
        assert mine("vee_so3") is twins.vee_so3
    flat = "a = np.arccos(np.clip((np.trace(R) - 1) / 2, -1, 1))"  # 0 for an angle of 1e-9
    inexact = f"def log_so3(R):\n    {flat}\n    return a * vee_so3(R) / max(np.sin(a), 1e-99)\n"
    (folder / FILE).write_text(f"import numpy as np\n{right}\n{inexact}", "utf-8")
    assert mine("log_so3") is twins.log_so3
    assert "yours give other results" in capsys.readouterr().out
    (folder / FILE).write_text("1 / 0", "utf-8")
    assert mine("vee_so3") is twins.vee_so3
    assert f"{FILE} stops: ZeroDivisionError" in capsys.readouterr().out


def test_the_check_writes_the_file_and_the_next_set_uses_it(tmp_path, capsys):
    for name in ("ps2", "ps4"):
        files = release(name, SOURCE.parent)
        for path, content in files.items():
            for place in (tmp_path / name, tmp_path / name / "original"):
                place.mkdir(exist_ok=True)
                (place / path).write_bytes(content)
        notebook, right = nbformat.reads(files[f"{name}.ipynb"].decode(), 4), dict(answers(name))
        for cell in notebook.cells:
            cell.source = right.get(cell.metadata.nbgrader.grade_id, cell.source)
        if name == "ps4":  # the answer is in an added cell, above its test
            at = [c.metadata.nbgrader.grade_id for c in notebook.cells].index("geodesic-answer")
            notebook.cells.insert(at + 1, new_code_cell(notebook.cells[at].source))
            notebook.cells[at].source = "def geodesic(*given):\n    raise NotImplementedError()"
        nbformat.write(notebook, tmp_path / name / f"{name}.ipynb")
        before = (tmp_path / FILE).read_text("utf-8") if (tmp_path / FILE).exists() else ""
        submitted = check(tmp_path / name / f"{name}.ipynb")
        kept = (tmp_path / FILE).with_suffix(".before.py")
        assert (kept.read_text("utf-8") if kept.exists() else "") == before
        assert f"{FILE} has your" in capsys.readouterr().out
    assert "def screw" in (tmp_path / FILE).read_text("utf-8")
    assert "NotImplementedError" not in (tmp_path / FILE).read_text("utf-8")
    outputs = [cell.get("outputs") for cell in nbformat.read(submitted, 4).cells]
    assert f"exp_so3, log_so3, nearest_rotation: your own, from {FILE}" in str(outputs)


def test_the_file_is_found_beside_the_folders_of_the_sets(tmp_path):
    nested = tmp_path / "ps2 (1)" / "ps2"
    nested.mkdir(parents=True)
    assert find(nested, "ps2") == tmp_path / FILE
    assert find(tmp_path, "ps2") == tmp_path / FILE
    (tmp_path / FILE).touch()
    assert find(nested, "ps2") == find(nested) == find(tmp_path / "ps4") == tmp_path / FILE
    assert find(tmp_path / "ps4" / "other", "ps4") == tmp_path / "ps4" / "other" / FILE


@pytest.mark.parametrize("name", quick_for(["ps1", "ps3", "ps9"], SETS))
def test_each_set_keeps_functions_and_ends_with_a_comparison(name, capsys):
    space = {}
    for _, text in answers(name):
        exec(text, space)
    capsys.readouterr()
    exec(cells(name)["compare-table"].source, space)
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) >= 4
    assert not re.search("fails|written", "\n".join(lines))
    assert cells(name)["compare"].source.count("?") == 1
    title = cells(name)["title"].source
    assert kept_by(name)
    for function in kept_by(name):
        assert f"`{function}`" in title


def test_the_page_for_teachers_has_the_thread():
    page = (SOURCE.parent / "README.md").read_text("utf-8")
    rows = dict(re.findall(r"^\| (ps\d) \| (`.*?`) \|", page, re.MULTILINE))
    assert [*rows] == ORDER
    for name, functions in rows.items():
        assert sorted(re.findall(r"`(\w+)`", functions)) == sorted(kept_by(name))
