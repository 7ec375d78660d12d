"""Who imports from whom: one way, no circles, exported names only, and NumPy alone at first."""

import ast
import importlib
import inspect
import json
import subprocess
import sys
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from textwrap import dedent

import pytest

import rbcourse

PACKAGE = Path(rbcourse.__file__).parent
MAY_IMPORT = {  # the rooms, beside the core and itself, that a room may import
    "core": set(),
    "draw": set(),
    "explore": {"draw", "course"},
    "study": {"draw"},
    "report": {"draw"},
    "course": None,  # not even the core
    "assignments": {"draw", "course"},
    "book": {"course", "assignments"},
}
CLIENTS = "draw", "explore", "study", "course", "assignments", "book"
PUBLIC = {name for name in rbcourse.__all__ if inspect.ismodule(getattr(rbcourse, name))} | {
    "report",
    "textbook",
}
"""Modules of the core whose names may be used from outside; each has an ``__all__``."""
LIBRARIES = {
    "core": {"numpy", "scipy"},
    "draw": {"PIL", "matplotlib", "mpl_toolkits"},
    "explore": {"PIL", "anywidget", "ipywidgets", "matplotlib", "traitlets"},
    "study": {"IPython", "matplotlib", "threadpoolctl", "tqdm"},
    "report": {"matplotlib"},
    "course": {"PIL", "jupyter_server", "nbclient", "nbformat", "numpy", "segno", "tornado"}
    | {"traitlets", "voila"},
    "assignments": {"IPython", "bleach", "jinja2", "matplotlib", "nbclient", "nbconvert"}
    | {"nbformat", "nbgrader", "traitlets"},
    "book": {"nbformat", "pygments", "sphinx"},
}


def modules(package):
    """The modules of a package by their dotted names below it, the package itself as ""."""
    for path in package.rglob("*.py"):
        parts = path.relative_to(package).with_suffix("").parts
        yield ".".join(parts[:-1] if parts[-1] == "__init__" else parts), path


def room(module):
    first = module.split(".")[0]
    return first if first in MAY_IMPORT else "core"


def imports(module, path, known):
    """What a module imports anywhere, inside functions too: modules of the package, libraries."""
    inner, outer = set(), set()
    here = module.split(".") if path.name == "__init__.py" else module.split(".")[:-1]
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        names = []
        if isinstance(node, ast.Import):
            names = [(alias.name, []) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = ["rbcourse", *here[: len(here) + 1 - node.level]] if node.level else []
            name = ".".join([*filter(None, base), *filter(None, [node.module])])
            names = [(name, [alias.name for alias in node.names])]
        for name, members in names:
            top, _, below = name.partition(".")
            if top != "rbcourse":
                outer.add(top)
            else:
                submodules = [".".join(filter(None, [below, member])) for member in members]
                found = [name for name in submodules if name in known]
                inner.update(found)
                if len(found) < len(members) or not members:
                    inner.add(below)
    return inner, outer


def faults(package):
    """Each import that the rules forbid, as "a imports b"; and the first circle that is found."""
    known = dict(modules(package))
    graph = {}
    for module, path in known.items():
        inner, outer = imports(module, path, known)
        graph[module], own = inner - {module}, room(module)
        allowed = {own} if MAY_IMPORT[own] is None else {own, "core", *MAY_IMPORT[own]}
        for other in sorted(inner):
            top = other == "" and module != ""  # what imports all of the core, for its version
            if room(other) not in allowed or (own == "core" and top):
                yield f"{module} imports {other or 'rbcourse'}"
        libraries = LIBRARIES["core"] | LIBRARIES[own] | set(sys.stdlib_module_names)
        yield from (f"{module} imports {name}" for name in sorted(outer - libraries))
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        yield "a circle: " + " imports ".join(reversed(error.args[1]))


def test_imports_keep_the_rules():
    assert list(faults(PACKAGE)) == []


def clients():
    """The name and the text of each file that uses the package from outside."""
    root = PACKAGE.parent
    for folder in (*(PACKAGE / room for room in CLIENTS), root / "benchmarks"):
        for path in sorted(folder.rglob("*.py")):
            yield path.relative_to(root).as_posix(), path.read_text("utf-8")
    for path in sorted((root / "notebooks").rglob("*.ipynb")):
        cells = json.loads(path.read_text("utf-8"))["cells"]
        code = ("".join(cell["source"]) for cell in cells if cell["cell_type"] == "code")
        yield path.relative_to(root).as_posix(), "\n".join(code)


def uses(text):
    """Each name of `rbcourse` that a text imports or reads as an attribute, with its module."""
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
    """The names among `uses` that are not exported, as "module.name"."""
    for module, name in uses(text):
        first = module.split(".")[0]
        if first in CLIENTS or name.startswith("__"):
            continue
        if module in PUBLIC:
            known = importlib.import_module(f"rbcourse.{module}").__all__
        else:
            known = [] if module else [*rbcourse.__all__, *PUBLIC, *CLIENTS]
        if name not in known:
            yield f"{module}.{name}".lstrip(".")


def test_clients_use_exported_names_only():
    faults = {name: sorted(set(not_exported(text))) for name, text in clients()}
    assert {name: found for name, found in faults.items() if found} == {}


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("from rbcourse import exp_so3, Ends", []),
        ("from rbcourse.sampling import angle_law", []),
        ("import rbcourse as rb\nrb.planar.log_planar(rb.__version__)", []),
        ("from rbcourse import hat", ["hat"]),
        ("from rbcourse.so3 import exp_so3", ["so3.exp_so3"]),
        ("from rbcourse._numerics import Array", ["_numerics.Array"]),
        ("from rbcourse.planar import as_states", ["planar.as_states"]),
        ("import rbcourse.search", ["search.*"]),
        ("import rbcourse as rb\nrb.search.ball", ["search"]),
        ("import rbcourse as rb\nrb.files.csv_lines", ["files.csv_lines"]),
    ],
)
def test_a_name_that_is_not_exported_is_found(text, found):
    assert sorted(set(not_exported(text))) == found


def test_names_in_all_exist_and_are_documented():
    for module in PUBLIC:
        public = importlib.import_module(f"rbcourse.{module}")
        assert len(set(public.__all__)) == len(public.__all__)
        assert all(hasattr(public, name) for name in public.__all__), module


def test_import_loads_numpy_only():
    code = """
        import sys, numpy
        before = set(sys.modules)
        import rbcourse
        print(*set(sys.modules) - before)
    """
    done = subprocess.run(
        [sys.executable, "-c", dedent(code)], capture_output=True, text=True, check=True
    )
    loaded = {name.split(".")[0] for name in done.stdout.split()}
    assert loaded - set(sys.stdlib_module_names) - {"numpy"} == {"rbcourse"}
    rooms = {name for name in done.stdout.split() if name.startswith("rbcourse.")}
    assert {room(name.removeprefix("rbcourse.")) for name in rooms} == {"core"}


def test_every_public_name_is_listed_once_and_documented():
    assert len(set(rbcourse.__all__)) == len(rbcourse.__all__)
    for name in rbcourse.__all__:
        assert getattr(rbcourse, name).__doc__, name


def test_signatures_are_short_enough_to_be_read():
    """Shift + Tab shows ArrayLike, not the types that it stands for."""
    for name in rbcourse.__all__:
        if inspect.isroutine(getattr(rbcourse, name)) or inspect.isclass(getattr(rbcourse, name)):
            assert "Buffer" not in str(inspect.signature(getattr(rbcourse, name))), name
