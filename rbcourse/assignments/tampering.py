"""Find code in a submission that overrides what the tests rely on.

This reads the code and does not run it: it finds what students write in earnest or in jest, not
what an expert takes pains to hide.
"""

import ast
import builtins
import re
from collections.abc import Iterable, Iterator
from typing import Any

from IPython.core.inputtransformer2 import TransformerManager
from nbformat import NotebookNode

from rbcourse.assignments.restore import grade_id, is_answer

# each leads round what can be read in the code
NAMES = {"exec", "eval", "compile", "globals", "locals", "vars", "setattr", "delattr"}
NAMES |= {"get_ipython", "__import__", "__builtins__", "In", "_ih"}  # what was run, tests too
ATTRIBUTES = {"modules", "get_ipython", "displayhook", "settrace", "setprofile", "ast_transformers"}
ATTRIBUTES |= {"input_transformers_post", "input_transformers_cleanup", "_getframe", "tb_frame"}
ATTRIBUTES |= {"f_back", "f_globals", "f_locals", "f_builtins", "gi_frame", "__dict__", "__code__"}
ATTRIBUTES |= {"__setattr__", "__delattr__", "__globals__", "__closure__", "__subclasses__"}
ATTRIBUTES |= {"__builtins__", "__wrapped__", "__self__", "__bases__", "__mro__"}
ATTRIBUTES |= {"attrgetter", "methodcaller"}
MODULES = {"builtins", "ctypes", "gc", "importlib", "inspect", "IPython", "ipykernel", "pkgutil"}
MODULES |= {"nbgrader", "pytest", "runpy", "unittest", "zmq", "jupyter_client", "pickle"}
MODULES |= {"code", "codeop", "cProfile", "profile"}
# an object that equals everything passes every test
METHODS = {f"__{name}__" for name in ("eq", "ne", "lt", "le", "gt", "ge", "bool", "array_ufunc")}
METHODS |= {"__array_function__"}
# magics and help that do no harm; of those that run code only their names are left out
MAGICS = re.compile(
    r"(^%%capture\b[ \w-]*$|^[ \t]*%%?time(?:it)?\b(?: +-[nr] *\d+)*)"
    r"|^[ \t]*(?:%(?:matplotlib|precision|(?:load_ext +)?autoreload)\b[ \w.-]*"
    r"|%config +InlineBackend\.\w+ *=[\w'\"{}\[\], -]*|\?{0,2}[\w.]+\?{1,2}|\?{1,2}[\w.]+) *$",
    re.MULTILINE,
)
CUSTOMARY = {"np": "numpy", "plt": "matplotlib.pyplot", "mpl": "matplotlib", "sp": "scipy"}


def find_in_cells(cells: Iterable[NotebookNode]) -> list[tuple[int, int, str]]:
    """Find where the student's cells of a notebook override what its locked cells rely on.

    Returns
    -------
    list of (int, int, str)
        The index of the cell, the line in it, and what it does.
    """
    code = {at: cell for at, cell in enumerate(cells) if cell.cell_type == "code"}
    trees = {at: _parsed(cell.source) for at, cell in code.items()}
    own = [at for at, cell in code.items() if is_answer(cell) or not grade_id(cell)]
    names, attributes = _relied_on(tree for at, tree in trees.items() if at not in own)
    imported, found = set[str](), []
    for at, tree in trees.items():
        for node in ast.walk(tree):  # names of modules, and of what is in them
            if isinstance(node, ast.Import | ast.ImportFrom):
                imported |= {_bound(alias) for alias in node.names}
            elif isinstance(node, ast.Assign) and _root(node.value) in imported:
                imported |= {target.id for target in node.targets if isinstance(target, ast.Name)}
        if at in own:
            rebound = [(line, name) for line, name in _bindings(tree) if name in names]
            said = {(line, f"gives {name} another meaning") for line, name in rebound}
            for node in ast.walk(tree):
                for what in _suspicious(node, attributes, imported):
                    said.add((getattr(node, "lineno", 0), what))
            found += [(at, *what) for what in sorted(said)]
    return found


def _parsed(source: str) -> ast.Module:
    """Return the code; nothing if it is not Python, and so does not run."""
    harmless = MAGICS.sub(lambda found: "" if found[1] else "pass", source)
    for text in (harmless, source):
        try:
            tree = ast.parse(TransformerManager().transform_cell(text))
            return ast.increment_lineno(tree, len(text) - len(text.lstrip("\n")))
        except (SyntaxError, ValueError, RecursionError, MemoryError):
            continue
    return ast.Module([], [])


def _relied_on(trees: Iterable[ast.Module]) -> tuple[set[str], set[str]]:
    """Return the names, and the attributes, that students may not give a new meaning."""
    relied, attributes = set[str](), METHODS | ATTRIBUTES
    for node in (node for tree in trees for node in ast.walk(tree)):
        if isinstance(node, ast.Import | ast.ImportFrom):
            relied |= {_bound(alias) for alias in node.names}
        elif isinstance(node, ast.FunctionDef | ast.ClassDef):
            relied.add(node.name)
        elif isinstance(node, ast.Name) and hasattr(builtins, node.id):
            relied.add(node.id)
        elif isinstance(node, ast.Attribute):
            attributes |= {node.attr}
    return relied - {"*"}, attributes


def _bound(alias: ast.alias) -> str:
    return alias.asname or alias.name.split(".")[0]


def _root(node: ast.AST) -> str:
    """Return the name at the root of a chain of attributes, or nothing."""
    while isinstance(node, ast.Attribute):
        node = node.value
    return node.id if isinstance(node, ast.Name) else ""


def _bindings(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield the names that the notebook binds, except imports under customary names."""
    todo: list[tuple[Any, bool]] = [(tree, False)]
    while todo:
        node, local = todo.pop()
        # of definitions, and in match
        names: list[Any] = [] if local else [getattr(node, "name", None)]
        if isinstance(node, ast.Name):
            names = [node.id] * (not local and not isinstance(node.ctx, ast.Load))
        elif isinstance(node, ast.NamedExpr):  # also in a comprehension
            names = [node.target.id]
        elif isinstance(node, ast.Global):
            names = node.names
        elif isinstance(node, ast.alias) and not local:
            usual = CUSTOMARY.get(node.asname or "", node.asname or "").rpartition(".")[2]
            names = [node.asname] * (usual != node.name.rpartition(".")[2])
        yield from ((getattr(node, "lineno", 0), name) for name in names if name)
        local |= isinstance(
            node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda | ast.ClassDef
        )
        local |= isinstance(node, ast.comprehension)
        todo += [(child, local) for child in ast.iter_child_nodes(node)]


def _suspicious(node: Any, relied: set[str], imported: set[str]) -> Iterator[str]:
    if isinstance(node, ast.Attribute):
        own = _root(node) == "self"  # of an object that the student describes
        if isinstance(node.ctx, ast.Load):
            yield from [f"uses {node.attr}"] * (node.attr in ATTRIBUTES)
        elif _root(node) in imported or (node.attr in relied and not own):
            yield f"replaces {ast.unparse(node)}"
    elif isinstance(node, ast.Name) and node.id in NAMES:
        yield "uses a magic or a shell" if node.id == "get_ipython" else f"uses {node.id}"
    elif (name := getattr(node, "id", getattr(node, "name", ""))) in METHODS:
        yield f"defines {name}"
    elif isinstance(node, ast.Call) and getattr(node.func, "id", "") == "getattr":
        if [type(name) for name in node.args[1:2]] != [ast.Constant]:
            yield f"uses {ast.unparse(node)}"
    elif isinstance(node, ast.Constant) and node.value in (ATTRIBUTES | METHODS) - {"modules"}:
        yield f"names {node.value}"
    elif isinstance(node, ast.Import | ast.ImportFrom):
        place = f"{node.module}." if isinstance(node, ast.ImportFrom) else ""
        for parts in ((place + alias.name).split(".") for alias in node.names):
            dark = {parts[0], parts[-1]} & (MODULES | NAMES | ATTRIBUTES)
            harmless = parts[:2] == ["IPython", "display"] or parts[1:3] == ["core", "display"]
            yield from () if harmless else (f"imports {name}" for name in sorted(dark))
