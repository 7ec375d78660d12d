"""Find code in a submission that overrides names and objects of the tests.

The code is read but not run. The search finds accidents and simple tricks, but not code that an
expert hides carefully.
"""

import ast
import builtins
import re
from collections.abc import Iterator
from typing import Any

from IPython.core.inputtransformer2 import TransformerManager
from nbformat import NotebookNode

from rbclassroom.assignments.locked_cells import grade_id, is_answer

# these names give access to objects that the code does not mention
NAMES = {"exec", "eval", "compile", "globals", "locals", "vars", "setattr", "delattr"}
NAMES |= {"get_ipython", "__import__", "__builtins__", "In", "_ih"}  # In and _ih contain the tests
ATTRIBUTES = {"modules", "get_ipython", "displayhook", "settrace", "setprofile", "ast_transformers"}
ATTRIBUTES |= {"input_transformers_post", "input_transformers_cleanup", "_getframe", "tb_frame"}
ATTRIBUTES |= {"f_back", "f_globals", "f_locals", "f_builtins", "gi_frame", "__dict__", "__code__"}
ATTRIBUTES |= {"__setattr__", "__delattr__", "__globals__", "__closure__", "__subclasses__"}
ATTRIBUTES |= {"__builtins__", "__wrapped__", "__self__", "__bases__", "__mro__"}
ATTRIBUTES |= {"attrgetter", "methodcaller"}
MODULES = {"builtins", "ctypes", "gc", "importlib", "inspect", "IPython", "ipykernel", "pkgutil"}
MODULES |= {"nbgrader", "pytest", "runpy", "unittest", "zmq", "jupyter_client", "pickle"}
MODULES |= {"code", "codeop", "cProfile", "profile"}
TIMED = re.compile(r"^%%capture\b[ \w-]*$|^[ \t]*%%?time(?:it)?\b(?: +-[nr] *\d+)*", re.MULTILINE)
HARMLESS = re.compile(
    r"^[ \t]*(?:%(?:matplotlib|precision|(?:load_ext +)?autoreload)\b[ \w.-]*"
    r"|%config +InlineBackend\.\w+ *=[\w'\"{}\[\], -]*|(?:\?{0,2}[\w.]+\?{1,2}|\?{1,2}[\w.]+) *)$",
    re.MULTILINE,
)
CUSTOMARY = {"np": "numpy", "plt": "pyplot", "mpl": "matplotlib", "sp": "scipy"}
LOCAL = ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda | ast.ClassDef | ast.comprehension


def find_in_cells(cells: list[NotebookNode]) -> list[tuple[int, int, str]]:
    """Return the cell index, the line and a description of each override in the student's code."""
    trees = {at: _parsed(c.source) for at, c in enumerate(cells) if c.cell_type == "code"}
    own = [at for at in trees if is_answer(cells[at]) or not grade_id(cells[at])]
    given = [node for at in trees.keys() - own for node in ast.walk(trees[at])]
    names = {_defines(node) for node in given} - {""}
    attributes = ATTRIBUTES | {node.attr for node in given if isinstance(node, ast.Attribute)}
    modules = set[str]()  # names of imported modules and of their parts
    for node in (node for tree in trees.values() for node in ast.walk(tree)):
        if isinstance(node, ast.alias):
            modules.add(_defines(node))
        elif isinstance(node, ast.Assign) and _root(node.value) in modules:
            modules |= {target.id for target in node.targets if isinstance(target, ast.Name)}
    said = {(at, *what) for at in own for what in _overrides(trees[at], names, attributes, modules)}
    return sorted(said)


def _parsed(source: str) -> ast.Module:
    for text in (HARMLESS.sub("pass", TIMED.sub("", source)), source):
        try:
            tree = ast.parse(TransformerManager().transform_cell(text))
            return ast.increment_lineno(tree, len(text) - len(text.lstrip("\n")))
        except (SyntaxError, ValueError, RecursionError, MemoryError):
            continue
    return ast.Module([], [])


def _defines(node: ast.AST) -> str:
    """Return the name that a node of a locked cell defines, or "" if it does not define a name."""
    if isinstance(node, ast.alias):
        return node.asname or node.name.partition(".")[0]
    if isinstance(node, ast.FunctionDef | ast.ClassDef):
        return node.name
    return node.id if isinstance(node, ast.Name) and hasattr(builtins, node.id) else ""


def _root(node: ast.AST) -> str:
    """Return the name at the root of a chain of attributes, or "" if the root is not a name."""
    while isinstance(node, ast.Attribute):
        node = node.value
    return node.id if isinstance(node, ast.Name) else ""


def _rebound(node: ast.AST, local: bool) -> list[str]:
    """Return the global names that a node binds, except usual abbreviations such as np."""
    match node:
        case ast.Global(names=names):
            return names
        case ast.NamedExpr(target=ast.Name(id=name)):
            return [name]
        case ast.Name(id=name, ctx=ast.Store() | ast.Del()) if not local:
            return [name]
        case ast.alias(name=name, asname=short) if not local:
            usual = CUSTOMARY.get(short or "", short)
            return [short] if short and usual != name.rpartition(".")[2] else []
    return [] if local else [getattr(node, "name", "")]  # a definition or a pattern of `match`


def _overrides(
    tree: ast.Module, names: set[str], attributes: set[str], modules: set[str]
) -> Iterator[tuple[int, str]]:
    """Yield the line and a description of code that could deceive the tests."""
    scopes = [node for node in ast.walk(tree) if isinstance(node, LOCAL)]
    inner = {n for scope in scopes for part in ast.iter_child_nodes(scope) for n in ast.walk(part)}
    node: Any
    for node in ast.walk(tree):
        for name in names.intersection(_rebound(node, node in inner)):
            yield node.lineno, f"gives {name} another meaning"
        match node:
            case ast.Name(id=name) if name in NAMES:
                yield node.lineno, f"uses {'a magic or a shell' if name == 'get_ipython' else name}"
            case ast.Attribute(attr=name, ctx=ast.Load()) if name in ATTRIBUTES:
                yield node.lineno, f"uses {name}"
            case ast.Attribute(attr=name, ctx=ast.Store() | ast.Del()):
                root = _root(node)  # attributes of `self` are the student's own
                if root in modules or (name in attributes and root != "self"):
                    yield node.lineno, f"replaces {ast.unparse(node)}"
            case ast.Call(func=ast.Name(id="getattr"), args=args):
                if not any(isinstance(name, ast.Constant) for name in args[1:2]):
                    yield node.lineno, f"uses {ast.unparse(node)}"
            case ast.Constant(value=str(name)) if name in ATTRIBUTES - {"modules"}:
                yield node.lineno, f"names {name}"
            case ast.Import() | ast.ImportFrom():
                place = f"{node.module}." if isinstance(node, ast.ImportFrom) else ""
                for parts in ((place + alias.name).split(".") for alias in node.names):
                    shown = parts[:2] == ["IPython", "display"] or parts[1:3] == ["core", "display"]
                    dark = {parts[0], parts[-1]} & (MODULES | NAMES | ATTRIBUTES)
                    for name in set() if shown else dark:
                        yield node.lineno, f"imports {name}"
