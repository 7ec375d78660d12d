"""What the pages about the package say."""

import ast
import re
from pathlib import Path

import nbformat
import pytest

from rbclassroom.book import reference
from rbclassroom.book.code import code_page
from rbclassroom.book.lessons import figures_of
from rbclassroom.course import ledger
from rbclassroom.course.notebooks import lesson_paths

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def figures():
    paths = lesson_paths(ROOT / "notebooks")
    return [f for path in paths for f in figures_of(path.stem, nbformat.read(path, as_version=4))]


def test_every_public_module_has_a_page_but_those_with_answers():
    packages = ROOT / "rbcourse", ROOT / "classroom/rbclassroom"
    paths = {path.relative_to(package) for package in packages for path in package.rglob("*.py")}
    names = {".".join(path.with_suffix("").parts) for path in paths if path.stem[0] != "_"}
    listed = [name for names in reference.modules(ROOT).values() for name in names]
    assert len(listed) == len(set(listed))
    names.add("optimum")  # a package with public functions of its own
    hidden = {"book.conf"} | {name for name in names if "figures." in name}
    assert set(listed) == names - hidden
    assert len(hidden) == 10


def test_no_page_of_code_answers_a_problem():
    shown = {path.relative_to(ROOT).as_posix() for path in reference.shown_code(ROOT)}
    assert {"rbcourse/so3.py", "tests/test_so3.py", "tests/draw/test_save.py"} <= shown
    assert not any(name.startswith("classroom/tests/assignments") for name in shown)


def test_the_tests_of_a_function_are_those_that_name_it():
    named = reference.naming(ROOT)
    found = reference.tests_of("so3.hat_so3", named)
    assert any(test.startswith("test_so3.py::test_hat_is_the_cross_product") for test in found)
    assert all(test.startswith("test_so3.py::") for test in found)
    found = reference.tests_of("draw.save.save_figure", named)
    assert found
    assert all(test.startswith("draw/test_save") for test in found)
    assert reference.tests_of("so3.nothing", named) == []


def test_a_test_names_what_it_imports(tmp_path):
    """By whatever name; `str.split` is no function of the package."""
    (tmp_path / "rbcourse/draw").mkdir(parents=True)
    (tmp_path / "tests").mkdir()
    (tmp_path / "rbcourse/__init__.py").write_text("from rbcourse.so3 import exp_so3\n")
    (tmp_path / "rbcourse/draw/__init__.py").write_text("from rbcourse.draw.save import save\n")
    code = "import rbcourse as rb\nfrom rbcourse import so3 as s\nfrom rbcourse.draw import save\n"
    code += "def test_a():\n    rb.exp_so3(1)\n    rb.so3.hat(1)\n    x = 'y'\n    x.split()\n"
    code += "def test_b():\n    s.hat(2)\n    save(3)\ndef other():\n    s.vee(1)\n"
    (tmp_path / "tests/test_so3.py").write_text(code)
    found = reference.naming(tmp_path)
    assert found["so3.exp_so3"] == ["test_so3.py::test_a"]
    assert found["so3.hat"] == ["test_so3.py::test_a", "test_so3.py::test_b"]
    assert found["draw.save.save"] == ["test_so3.py::test_b"]
    assert not any("split" in name or "vee" in name for name in found)


def test_what_has_no_test_for_its_module_has_those_that_name_it_elsewhere():
    named = {
        "so3.turn": ["test_se3.py::test_a"],
        "so3.hat": ["test_so3.py::test_b", "test_c.py::x"],
    }
    assert reference.tests_of("so3.turn", named) == ["test_se3.py::test_a"]
    assert reference.tests_of("so3.hat", named) == ["test_so3.py::test_b"]


def test_code_has_an_anchor_for_each_definition_and_loses_nothing():
    source = (ROOT / "rbcourse/so3.py").read_text("utf-8")
    page = code_page("rbcourse/so3.py", ROOT)
    for node in ast.parse(source).body:
        if isinstance(node, ast.FunctionDef):
            assert f'<a id="{node.name}"></a>' in page
    assert '<a id="BASIS_SO3"></a>' in page
    text = re.sub("<[^>]*>", "", page[page.index("<pre>") : page.index("</pre>")])
    for entity, letter in (("&#39;", "'"), ("&quot;", '"'), ("&lt;", "<"), ("&gt;", ">")):
        text = text.replace(entity, letter)
    assert text.replace("&amp;", "&") == source


def test_a_figure_of_the_texts_is_its_own_picture(figures):
    found = ledger.collect(ROOT)

    def names(key):
        return [figure.name for figure in reference.pictures_of(found[key], key, figures)]

    assert names("BK Fig. 5") == ["paper_fig5a", "paper_fig5b"]
    assert sorted(names("BK Fig. 4")) == ["paper_fig4a", "paper_fig4b", "paper_fig4c"]
    assert names("RR Fig. 6") == ["report_fig6"]
    assert "lesson06_chord" in names("BK (16)")


def test_the_ledger_has_a_row_for_every_key(figures):
    found = ledger.collect(ROOT)
    table = reference.ledger_tables(found, figures)
    assert table.count('class="row"') == len(found)
    row = table[table.index('id="bk-eq-16"') :]
    row = row[: row.index("* - ")]
    assert "package/projected_line.html#rbcourse.projected_line.theta" in row
    assert "lessons/06_geodesics.html#s6" in row
    assert "code/tests/test_projected_line.html#" in row


def test_the_gallery_has_all_figures_with_their_files(figures):
    page = reference.gallery(figures, ROOT)
    assert page.count("<img ") == len(figures)
    for path in (ROOT / "figures").glob("*.*"):
        assert f'href="figures/{path.name}"' in page
    assert page.index("paper_fig1") < page.index("report_fig4") < page.index("lesson00_cubes")


def test_works_are_listed_once_with_their_lessons():
    cited = {"04_nearest_rotation": ["- [A] x", "- [B] y"], "06_geodesics": ["- [B] y"]}
    lines = reference.works(cited).splitlines()
    assert [line[:7] for line in lines] == ["- [A] x", "- [B] y"]
    assert lines[1].count("<a href=") == 2


def test_answers_of_questions_are_folded():
    text = "## 01\n1. Why?\n#### Answers\n1. So.\n### next\n1. How?\n#### Answers\n1. Thus.\n"
    page = reference.folded_answers(text)
    assert page.count("<details") == page.count("</details>") == 2
    assert page.index("</details>") < page.index("### next")
