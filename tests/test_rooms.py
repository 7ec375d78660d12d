"""Test imports: their order, their names, and the libraries that they load."""

import ast
import importlib
import inspect
import json
import re
import subprocess
import sys
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from textwrap import dedent
from typing import is_typeddict

import pytest
from quick import stored_notebooks

import rbclassroom
import rbcourse

ROOT = Path(rbcourse.__file__).parents[1]
PACKAGES = {one.__name__: Path(one.__file__).parent for one in (rbcourse, rbclassroom)}
MAY_IMPORT = {  # each part of the packages may import only the listed parts
    "rbcourse": set(),
    "rbcourse.draw": {"rbcourse"},
    "rbcourse.report": {"rbcourse", "rbcourse.draw"},
    "rbcourse.paper": {"rbcourse", "rbcourse.draw"},
    "rbcourse.__main__": {"rbcourse.draw", "rbcourse.paper", "rbcourse.report"},
    "rbclassroom": set(),
    "rbclassroom.figures": {"rbcourse", "rbcourse.draw"},
    "rbclassroom.explorers": {"rbcourse", "rbcourse.draw"}
    | {"rbclassroom.course", "rbclassroom.figures"},
    "rbclassroom.atlas": {"rbcourse", "rbcourse.draw", "rbclassroom.figures"},
    "rbclassroom.rivals": {"rbcourse", "rbcourse.draw", "rbclassroom.figures"},
    "rbclassroom.openings": {"rbcourse", "rbcourse.draw", "rbclassroom.figures"},
    "rbclassroom.polls": set(),
    "rbclassroom.course": {"rbcourse", "rbclassroom"},
    "rbclassroom.assignments": {"rbcourse", "rbcourse.draw", "rbclassroom", "rbclassroom.course"},
    "rbclassroom.lecture": {"rbcourse", "rbcourse.draw"}
    | {"rbclassroom.course", "rbclassroom.explorers"},
    "rbclassroom.live": {"rbcourse", "rbclassroom.assignments"},
    "rbclassroom.book": {"rbclassroom.course", "rbclassroom.lecture", "rbclassroom.assignments"}
    | {"rbclassroom.live", "rbcourse.draw", "rbclassroom.explorers"},
}
PUBLIC = rbcourse._MODULES - {"draw"}
"""Modules of the core whose names may be used from outside; each has an ``__all__``."""
LIBRARIES = {  # `test_repository` imports the classroom with the libraries that it declares
    "rbcourse": {"numpy", "scipy"},
    "rbcourse.draw": {"PIL", "matplotlib", "mpl_toolkits"},
    "rbcourse.report": {"matplotlib"},
    "rbcourse.paper": {"matplotlib"},
    "rbcourse.__main__": set(),
}


def modules(packages):
    """Yield the modules of packages by their dotted names."""
    for package, folder in packages.items():
        for path in folder.rglob("*.py"):
            parts = path.relative_to(folder).with_suffix("").parts
            yield ".".join([package, *parts]).removesuffix(".__init__"), path


def part(module):
    first = ".".join(module.split(".")[:2])
    return first if first in MAY_IMPORT else module.split(".")[0]


def imports(module, path, known):
    """Return all package modules and all libraries that a module or its functions import."""
    inner, outer = set(), set()
    here = module.split(".") if path.name == "__init__.py" else module.split(".")[:-1]
    tree = ast.parse(path.read_text("utf-8"))
    for block in ast.walk(tree):
        if isinstance(block, ast.If) and ast.unparse(block.test) == "TYPE_CHECKING":
            block.body = []
    for node in ast.walk(tree):
        names = []
        if isinstance(node, ast.Import):
            names = [(alias.name, []) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = here[: len(here) + 1 - node.level] if node.level else []
            name = ".".join([*base, *filter(None, [node.module])])
            names = [(name, [alias.name for alias in node.names])]
        for name, members in names:
            if name.split(".")[0] not in PACKAGES:
                outer.add(name.split(".")[0])
            else:
                found = [f"{name}.{each}" for each in members if f"{name}.{each}" in known]
                inner.update(found)
                if len(found) < len(members) or not members:
                    inner.add(name)
    return inner, outer


def faults(packages):
    """Yield each import that the rules forbid, as "a imports b", and the first cycle."""
    known = dict(modules(packages))
    graph = {}
    for module, path in known.items():
        inner, outer = imports(module, path, known)
        graph[module], own = inner - {module}, part(module)
        for other in sorted(inner):
            top = other == "rbcourse" and module != other  # this imports every mathematical module
            if part(other) not in {own, *MAY_IMPORT[own]} or (own == "rbcourse" and top):
                yield f"{module} imports {other}"
        if own in LIBRARIES:
            libraries = LIBRARIES["rbcourse"] | LIBRARIES[own] | set(sys.stdlib_module_names)
            yield from (f"{module} imports {name}" for name in sorted(outer - libraries))
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        yield "a circle: " + " imports ".join(reversed(error.args[1]))


def test_imports_follow_the_rules():
    assert list(faults(PACKAGES)) == []


ON_CURVES = {f"rbcourse{x}" for x in ("", ".closed_forms", ".files", ".outliers", ".textbook")}
DRAWN = "rbcourse.draw", "rbcourse.report", "rbcourse.paper", "rbcourse.__main__"


def test_the_folders_of_the_package_are_floors():
    """The groups are below the curves, and the curves are below the optima."""
    known = dict(modules({"rbcourse": PACKAGES["rbcourse"]}))
    for name in known.keys() - ON_CURVES:
        inner = " ".join(imports(name, known[name], known)[0] - {name})
        if not name.startswith(("rbcourse.optimum", *DRAWN)):
            assert "rbcourse.optimum" not in inner, name
            assert name.startswith("rbcourse.curves") or "rbcourse.curves" not in inner, name


IN_OTHER_FOLDERS = {  # these modules write into temporary folders and caches
    f"rbclassroom/{name}.py"
    for name in ("book/build", "book/conf", "book/lessons", "course/lock", "lecture/deck")
} | {"rbclassroom/live/engine.py"}


def writes(text):
    """Tell whether a module writes or copies a file."""
    for call in (node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Call)):
        name = getattr(call.func, "attr", getattr(call.func, "id", ""))
        given = [each.value for each in call.args if isinstance(each, ast.Constant)]
        if name in ("write_text", "write_bytes", "copyfile"):
            return True
        if name == "open" and any(re.fullmatch("[wx][bt]?", str(mode)) for mode in given):
            return True
    return False


def test_files_are_written_by_one_function():
    """`rbcourse.files.replace_file` writes a file completely or not at all."""
    found = {
        path.relative_to(folder.parent).as_posix()
        for name, folder in PACKAGES.items()
        for _, path in modules({name: folder})
        if writes(path.read_text("utf-8"))
    }
    assert found <= {"rbcourse/files.py", *IN_OTHER_FOLDERS}


def clients():
    """Yield the name and the text of each file that uses the package from outside."""
    folders = PACKAGES["rbcourse"] / "draw", PACKAGES["rbclassroom"], ROOT / "benchmarks"
    for path in sorted(path for folder in folders for path in folder.rglob("*.py")):
        yield path.relative_to(ROOT).as_posix(), path.read_text("utf-8")
    for path in stored_notebooks():
        cells = json.loads(path.read_text("utf-8"))["cells"]
        code = ("".join(cell["source"]) for cell in cells if cell["cell_type"] == "code")
        yield path.relative_to(ROOT).as_posix(), "\n".join(code)


def uses(text):
    """Yield the module and the name of each object of `rbcourse` that a text uses."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            for alias in node.names:
                if alias.name.startswith("rbcourse."):
                    yield alias.name.removeprefix("rbcourse."), "*"
        elif isinstance(node, ast.ImportFrom):
            top, _, module = (node.module or "").partition(".")
            if top == "rbcourse" and not node.level:
                yield from ((module, alias.name) for alias in node.names)
        elif isinstance(node, ast.Attribute):
            names, inner = [node.attr], node.value
            while isinstance(inner, ast.Attribute):
                names, inner = [inner.attr, *names], inner.value
            if isinstance(inner, ast.Name) and inner.id in ("rb", "rbcourse"):
                yield "", names[0]
                if names[0] in PUBLIC and len(names) > 1:
                    yield names[0], names[1]


def not_exported(text):
    """Yield the names among `uses` that are not exported, as "module.name"."""
    for module, name in uses(text):
        if name.startswith("__"):
            continue
        if module.split(".")[0] == "draw":
            known = [] if "_" in (name[0], module.rpartition(".")[2][0]) else [name]
        elif module in PUBLIC:
            known = importlib.import_module(f"rbcourse.{module}").__all__
        else:
            known = [] if module else [*rbcourse.__all__, *PUBLIC, "draw"]
        if name not in known:
            yield f"{module}.{name}".lstrip(".")


def test_clients_use_exported_names_only():
    faults = {name: sorted(set(not_exported(text))) for name, text in clients()}
    assert {name: found for name, found in faults.items() if found} == {}


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("from rbcourse import exp_so3\nimport rbcourse as rb\nrb.planar.log_planar(1)", []),
        ("from rbcourse.so3 import exp_so3", ["so3.exp_so3"]),
        ("from rbcourse.planar import as_plan", ["planar.as_plan"]),
        ("import rbcourse.optimum._search", ["optimum._search.*"]),
        ("from rbcourse.draw.save import save_figure, _text", ["draw.save._text"]),
        (
            "import rbcourse as rb\nrb.search.ball\nrb.files.text_lines",
            ["files.text_lines", "search"],
        ),
    ],
)
def test_names_that_are_not_exported_are_reported(text, found):
    assert sorted(set(not_exported(text))) == found


def test_exported_names_exist_and_are_listed_once():
    for module in (rbcourse, *(importlib.import_module(f"rbcourse.{name}") for name in PUBLIC)):
        assert len(set(module.__all__)) == len(module.__all__)
        assert all(hasattr(module, name) for name in module.__all__), module


def test_importing_the_package_loads_only_numpy():
    code = """
        import sys, numpy
        before = set(sys.modules)
        import rbcourse
        print(*set(sys.modules) - before)
    """
    loaded = subprocess.check_output([sys.executable, "-c", dedent(code)], text=True).split()
    others = {name.split(".")[0] for name in loaded} - set(sys.stdlib_module_names)
    assert others - {"numpy"} == {"rbcourse"}
    assert {part(name) for name in loaded if name.startswith("rbcourse.")} == {"rbcourse"}


def test_every_name_of_the_package_is_documented():
    """Shift + Tab shows the name ArrayLike, not its long definition."""
    for name in rbcourse.__all__:
        exported = getattr(rbcourse, name)
        assert exported.__doc__, name
        if inspect.isroutine(exported) or (
            inspect.isclass(exported) and not is_typeddict(exported)
        ):
            assert "Buffer" not in str(inspect.signature(exported)), name


def test_the_map_for_contributors_names_every_module():
    page = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
    names = {path.stem for path in (ROOT / "rbcourse").rglob("*.py") if "draw" not in path.parts}
    missing = {name for name in names if not re.search(rf"\b{name}\b", page)}
    assert missing <= {"__main__"}
