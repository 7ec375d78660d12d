"""Test the pages about the package: their modules, code and tests."""

import ast
import html
import re
from pathlib import Path

from rbclassroom.book import reference

ROOT = Path(__file__).parents[3]


def test_all_modules_have_pages_except_those_for_maintainers():
    packages = ROOT / "rbcourse", ROOT / "classroom/rbclassroom"
    paths = {path.relative_to(package) for package in packages for path in package.rglob("*.py")}
    names = {".".join(path.with_suffix("").parts) for path in paths if path.stem[0] != "_"}
    listed = [module["name"] for some in reference.modules(ROOT).values() for module in some]
    assert len(listed) == len(set(listed))
    names.add("optimum")  # this package has public functions of its own
    apart = "assignments.", "book.", "course.", "figures.", "lecture.", "live."
    hidden = {name for name in names if name.startswith(apart)}
    assert set(listed) == names - hidden
    shown = reference.shown_code(ROOT)
    assert {"rbcourse/so3.py", "tests/test_so3.py", "tests/draw/test_save.py"} <= set(shown)
    assert not any(name.startswith("classroom/tests/assignments") for name in shown)


def test_only_tests_that_use_a_function_are_listed_for_it():
    named = {"so3.turn": ["test_se3.py::a"], "so3.hat": ["test_so3.py::b", "test_c.py::x"]}
    named["draw.save.png"] = ["draw/test_save.py::c", "test_save.py::d"]
    assert reference.tests_of("so3.turn", named) == ["test_se3.py::a"]
    assert reference.tests_of("so3.hat", named) == ["test_so3.py::b"]
    assert reference.tests_of("draw.save.png", named) == ["draw/test_save.py::c"]
    assert reference.tests_of("so3.nothing", named) == []


def test_a_test_is_listed_for_the_functions_that_it_uses(tmp_path):
    """Any import name counts. `str.split` is not a function of the package."""
    (tmp_path / "rbcourse/draw").mkdir(parents=True)
    (tmp_path / "tests/draw").mkdir(parents=True)
    (tmp_path / "rbcourse/__init__.py").write_text("from rbcourse.so3 import exp_so3\n")
    (tmp_path / "rbcourse/draw/__init__.py").write_text("from rbcourse.draw.save import save\n")
    code = "import rbcourse as rb\nfrom rbcourse import so3 as s\nfrom rbcourse.draw import save\n"
    code += "def test_a():\n    rb.exp_so3(1)\n    rb.so3.hat(1)\n    x = 'y'\n    x.split()\n"
    code += "def test_b():\n    s.hat(2)\n    save(3)\ndef other():\n    s.vee(1)\n"
    (tmp_path / "tests/test_so3.py").write_text(code)
    code = "from rbcourse.draw import save\ndef test_c():\n    save(3)\n"
    (tmp_path / "tests/draw/test_save.py").write_text(code)
    found = reference.naming(tmp_path)
    assert found["so3.exp_so3"] == ["test_so3.py::test_a"]
    assert found["so3.hat"] == ["test_so3.py::test_a", "test_so3.py::test_b"]
    assert found["draw.save.save"] == ["draw/test_save.py::test_c", "test_so3.py::test_b"]
    assert not any("split" in name or "vee" in name for name in found)


def test_a_page_of_code_has_an_anchor_for_each_definition():
    source = (ROOT / "rbcourse/so3.py").read_text("utf-8")
    page = reference.coloured(source)
    names = [node.name for node in ast.parse(source).body if isinstance(node, ast.FunctionDef)]
    assert all(f'<a id="{name}"></a>' in page for name in [*names, "BASIS_SO3"])
    assert html.unescape(re.sub("<[^>]*>", "", page)) == source
