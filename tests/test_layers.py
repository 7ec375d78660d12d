"""A module imports from lower levels only, and importing the package loads NumPy alone."""

import ast
import subprocess
import sys
from pathlib import Path
from textwrap import dedent

import pytest

import rbcourse

PACKAGE = Path(rbcourse.__file__).parent
LEVELS = {
    "_numerics": 0,
    "foam": 1,
    "quaternion": 1,
    "projection": 2,
    "inertia": 1,
    "own_work": 0,
    "marking": 1,
    "marking_samplers": 2,
    "problems_acceleration": 7,
    "problems_geodesics": 7,
    "problems_random": 7,
    "problems_rotations": 7,
    "problems_arm": 7,
    "problems_plane": 7,
    "jets": 1,
    "line": 1,
    "plans": 1,
    "polynomials": 1,
    "arm": 2,
    "conversions": 2,
    "planar": 2,
    "so3": 3,
    "sampling": 3,
    "uniformity": 3,
    "se3": 4,
    "curves": 5,
    "textbook": 5,
    "metrics": 5,
    "projected": 6,
    "quaternion_curves": 6,
    "rivals": 7,
    "screws": 6,
    "bessel": 6,
    "chains": 8,
    "cost": 9,
    "trajectories": 5,
    "connection": 6,
    "motions": 7,
    "optimum": 7,
    "relaxation": 8,
    "shooting": 8,
    "figures": 8,
    "atlas": 9,
    "atlas_figures": 10,
    "atlas_tables": 10,
    "progress": 0,
    "comparison": 9,
    "frames": 9,
    "plots": 9,
    "profiles": 9,
    "postures": 9,
    "shadows": 9,
    "repairs": 9,
    "routes": 9,
    "spheres": 9,
    "bodies": 10,
    "tumbling": 11,
    "animate": 10,
    "report_motions": 11,
    "report_rotations": 11,
    "assignment": 12,
    "lessons": 11,
    "lecture": 12,
    "rehearsal": 13,
    "submission": 13,
    "mending": 11,
    "downloads": 11,
    "collection": 12,
    "fairplay": 0,
    "quota": 0,
    "handout": 12,
    "autograding": 13,
    "isolated": 14,
    "grading": 15,
    "ledger": 12,
    "explorer": 11,
    "explore_chains": 12,
    "explore_curves": 12,
    "explore_optima": 12,
    "explore_plane": 12,
    "explore_rotations": 12,
    "widgets": 13,
}
ALLOWED = {
    "figures": {"matplotlib"},
    "marking": {"matplotlib"},
    "animate": {"PIL", "matplotlib"},
    "atlas_figures": {"matplotlib"},
    "bodies": {"matplotlib", "mpl_toolkits"},
    "comparison": {"matplotlib"},
    "explorer": {"anywidget", "ipywidgets", "matplotlib", "traitlets"},
    "frames": {"matplotlib", "mpl_toolkits"},
    "plots": {"matplotlib"},
    "profiles": {"matplotlib"},
    "progress": {"IPython"},
    "postures": {"matplotlib"},
    "repairs": {"matplotlib"},
    "report_motions": {"matplotlib"},
    "report_rotations": {"matplotlib"},
    "routes": {"matplotlib"},
    "shadows": {"matplotlib"},
    "spheres": {"matplotlib", "mpl_toolkits"},
    "tumbling": {"matplotlib"},
    "lessons": {"nbformat", "nbclient"},
    "lecture": {"nbformat", "tornado", "traitlets", "voila"},
    "rehearsal": {"nbformat", "tornado"},
    "submission": {"nbclient", "nbformat"},
    "mending": {"nbformat"},
    "collection": {"nbformat"},
    "ledger": {"nbformat"},
    "fairplay": {"IPython"},
    "handout": {"nbformat", "nbgrader", "traitlets"},
    "autograding": {"nbclient", "nbconvert", "nbformat", "nbgrader", "traitlets"},
    "isolated": {"nbformat", "nbgrader", "psutil", "traitlets"},
    "grading": {"nbgrader", "traitlets"},
}


def imports(source):
    """Every module imported anywhere in the source, inside functions too."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield "." * node.level + (node.module or "")


def upward(module, source):
    """The imports of the package that are not from a lower level."""
    inner = [name for name in imports(source) if name.startswith((".", "rbcourse"))]
    named = [name.removeprefix("rbcourse.") for name in inner]
    return [name for name in named if LEVELS.get(name, 99) >= LEVELS[module]]


def test_every_module_has_a_level():
    assert {path.stem for path in PACKAGE.glob("*.py")} - {"__init__"} == set(LEVELS)


@pytest.mark.parametrize("module", LEVELS)
def test_imports_go_down(module):
    assert upward(module, (PACKAGE / f"{module}.py").read_text("utf-8")) == []


def test_an_import_that_goes_up_is_seen():
    for source in (
        "from rbcourse.curves import theta",
        "import rbcourse.so3",
        "def late():\n    from rbcourse import exp_so3",
        "from .curves import theta",
        "from rbcourse.planar import compose_planar",
    ):
        assert upward("projection", source) != [], source
    assert upward("curves", "from rbcourse.so3 import exp_so3\nimport numpy") == []


@pytest.mark.parametrize("module", LEVELS)
def test_only_named_libraries_are_used(module):
    outer = {name.split(".")[0] for name in imports((PACKAGE / f"{module}.py").read_text("utf-8"))}
    known = {"rbcourse", "numpy", "scipy"} | ALLOWED.get(module, set())
    assert outer - known - set(sys.stdlib_module_names) == set()


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


def test_every_public_name_is_listed_once_and_documented():
    assert len(set(rbcourse.__all__)) == len(rbcourse.__all__)
    for name in rbcourse.__all__:
        assert getattr(rbcourse, name).__doc__, name
