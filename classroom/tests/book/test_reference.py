"""Test the pages about the package: their modules, code and tests."""

import ast
import html
import re
from pathlib import Path

from rbclassroom.book import reference
from rbclassroom.course import ledger

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
    shown = set(reference.shown_code(ROOT, ledger.collect(ROOT)))
    assert {"rbcourse/so3.py", "tests/test_so3.py", "classroom/rbclassroom/atlas.py"} <= shown
    answers = "classroom/tests/assignments", "classroom/tests/browser", "classroom/tests/hostile"
    assert not any(name.startswith(answers) for name in shown)


def test_a_page_of_code_has_an_anchor_for_each_definition():
    source = (ROOT / "rbcourse/so3.py").read_text("utf-8")
    page = reference.coloured(source)
    names = [node.name for node in ast.parse(source).body if isinstance(node, ast.FunctionDef)]
    assert all(f'<a id="{name}"></a>' in page for name in [*names, "BASIS_SO3"])
    assert html.unescape(re.sub("<[^>]*>", "", page)) == source
