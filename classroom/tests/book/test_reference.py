"""Test the pages about the package: their modules, code and tests."""

import ast
import html
import re
from importlib import import_module
from inspect import ismodule
from pathlib import Path

import rbcourse as rb
from rbclassroom.book import reference
from rbclassroom.course import ledger

ROOT = Path(__file__).parents[3]


MODULES = [each for some in reference.modules(ROOT).values() for each in some]


def test_every_public_name_is_described_once_under_the_name_that_users_import():
    public = [each for name in dir(rb) if ismodule(each := getattr(rb, name))]
    listed = {f"{one.__name__}.{name}" for one in public for name in getattr(one, "__all__", [])}
    names = {each["name"] for each in MODULES}
    assert {name.split(".")[1] for name in listed} | {"draw", "atlas"} <= {
        name.split(".")[0] for name in names
    }
    found = [each.address for module in MODULES for each in module["members"]]
    assert len(found) == len(set(found))
    exported = {f"rbcourse.{name}" for name in rb.__all__ if name != "Array"}
    assert exported <= set(found)
    for address in found:
        module, _, name = address.rpartition(".")
        assert hasattr(import_module(module), name)
    short = {name.rpartition(".")[2] for name in found}
    assert {name.rpartition(".")[2] for name in listed} - short == {"Plan", "Rng"}  # annotations


def test_classes_of_results_are_described_after_the_exported_names():
    found = {each.address for module in MODULES for each in module["members"]}
    (curve,) = (module for module in MODULES if module["name"] == "curves.curve")
    assert [each.name for each in curve["members"]] == ["Curve", "State"]
    names = "Curve", "Body", "Chain", "Timed", "optimum.Optimum"
    assert {f"rbcourse.{name}" for name in names} <= found


def test_the_code_of_tests_with_answers_has_no_page():
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
