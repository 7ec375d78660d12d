"""Find code in a submission that overrides what the tests rely on.

This reads the code and does not run it: it finds what students write in earnest or in jest, not
what an expert takes pains to hide.
"""

import ast
import builtins
import re
from collections.abc import Iterable, Iterator

from IPython.core.inputtransformer2 import TransformerManager
from nbformat import NotebookNode

from rbcourse.assignments.restore import grade_id, is_answer

# each leads round what can be read in the code
NAMES = {"exec", "eval", "compile", "globals", "locals", "__import__", "__builtins__"}
NAMES |= {"get_ipython"}
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
HISTORY = {"In", "_ih", "_i", "_ii", "_iii"}  # what was run, hidden tests included
# magics and help that do no harm; of those that run code only their names are left out
MAGICS = re.compile(
    r"(\A\s*%%(?:time|capture)\b[ \t\w-]*$|^[ \t]*%time(?:it)?\b(?:[ \t]+-\w+[ \t]*\d*)*[ \t]*"
    r"|\A\s*%%timeit\b(?:[ \t]+-\w+[ \t]*\d*)*[ \t]*)"
    r"|^[ \t]*(?:%(?:matplotlib|precision|autoreload|whos?|pwd)\b[ \t\w.-]*"
    r"|%load_ext[ \t]+autoreload"
    r"|%config[ \t]+InlineBackend\.\w+[ \t]*=[ \t]*[\[{]?['\"]\w+['\"][\]}]?"
    r"|\?{0,2}[\w.]+\?{1,2}|\?{1,2}[\w.]+)[ \t]*$",
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
    bound = {name for at in own for _, name in _rebound(trees[at])}
    imported: set[str] = set()
    found = []
    for at, tree in trees.items():
        nodes = list(ast.walk(tree))
        for node in nodes:
            _learn(node, imported)
        called = {node.func for node in nodes if isinstance(node, ast.Call)}
        if at in own:
            rebound = [(line, name) for line, name in _rebound(tree) if name in names]
            said = {(line, f"gives {name} another meaning") for line, name in rebound}
            for node in nodes:
                line = getattr(node, "lineno", 0)
                if getattr(node, "id", "") in ("setattr", "delattr", "vars") and node not in called:
                    said.add((line, f"renames {ast.unparse(node)}"))
                said |= {(line, what) for what in _suspicious(node, attributes, imported, bound)}
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
    relied, attributes = set[str](), set[str]()
    for node in (node for tree in trees for node in ast.walk(tree)):
        if isinstance(node, ast.Import | ast.ImportFrom):
            relied |= {_bound(alias) for alias in node.names}
        elif isinstance(node, ast.FunctionDef | ast.ClassDef):
            relied.add(node.name)
        elif isinstance(node, ast.Name) and hasattr(builtins, node.id):
            relied.add(node.id)
        elif isinstance(node, ast.Attribute):
            attributes.add(node.attr)
    return relied - {"*"}, attributes | METHODS | ATTRIBUTES


def _bound(alias: ast.alias) -> str:
    return alias.asname or alias.name.split(".")[0]


def _learn(node: ast.AST, imported: set[str]) -> None:
    """Add the names that a statement binds to a module or to what is in one."""
    if isinstance(node, ast.Import | ast.ImportFrom):
        imported |= {_bound(alias) for alias in node.names}
    elif isinstance(node, ast.Assign) and _root(node.value) in imported:
        imported |= {target.id for target in node.targets if isinstance(target, ast.Name)}


def _root(node: ast.AST) -> str:
    """Return the name at the root of a chain of attributes, or nothing."""
    while isinstance(node, ast.Attribute):
        node = node.value
    return node.id if isinstance(node, ast.Name) else ""


def _rebound(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield the names that the notebook binds, except imports under customary names."""
    todo: list[ast.AST] = list(tree.body)
    while todo:
        node = todo.pop()
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            yield node.lineno, node.name
            changed = (inner for inner in ast.walk(node) if isinstance(inner, ast.Global))
            yield from ((inner.lineno, name) for inner in changed for name in inner.names)
        elif isinstance(node, ast.Import | ast.ImportFrom):
            place = f"{node.module}." if isinstance(node, ast.ImportFrom) else ""
            for alias in node.names:
                usual = CUSTOMARY.get(alias.asname or "", alias.asname)
                if alias.asname and usual not in (alias.name, place + alias.name):
                    yield node.lineno, alias.asname
        elif isinstance(node, ast.Name) and not isinstance(node.ctx, ast.Load):
            yield node.lineno, node.id
        elif isinstance(node, ast.MatchAs | ast.MatchStar):
            yield node.lineno, node.name or ""
            todo += ast.iter_child_nodes(node)
        elif isinstance(node, ast.comprehension):  # its own names end with it
            inner = [part for part in ast.walk(node) if isinstance(part, ast.NamedExpr)]
            yield from ((part.lineno, part.target.id) for part in inner)
        elif not isinstance(node, ast.Lambda):
            todo += ast.iter_child_nodes(node)


def _suspicious(
    node: ast.AST, relied: set[str], imported: set[str], bound: set[str]
) -> Iterator[str]:
    if isinstance(node, ast.Attribute):
        own = _root(node) == "self"  # of an object that the student describes
        if isinstance(node.ctx, ast.Load):
            yield from [f"uses {node.attr}"] * (node.attr in ATTRIBUTES)
        elif _root(node) in imported or (node.attr in relied and not own):
            yield f"replaces {ast.unparse(node)}"
    elif isinstance(node, ast.Name) and node.id in NAMES:
        yield "uses a magic or a shell" if node.id == "get_ipython" else f"uses {node.id}"
    elif isinstance(node, ast.Name) and node.id in HISTORY - bound:
        yield f"reads {node.id}, what was run"
    elif isinstance(node, ast.Name) and node.id in METHODS:
        yield f"defines {node.id}"
    elif isinstance(node, ast.Constant) and node.value in (ATTRIBUTES | METHODS) - {"modules"}:
        yield f"names {node.value}"
    elif isinstance(node, ast.Call):
        called, given = ast.unparse(node.func), node.args
        if called in ("setattr", "delattr", "vars") and _root((given or [node])[0]) in imported:
            yield f"replaces parts of {ast.unparse(given[0])}"
        if called == "vars" and not given:
            yield "uses vars"
        if called in ("setattr", "delattr", "getattr"):
            second = given[1] if len(given) > 1 else None
            name = second.value if isinstance(second, ast.Constant) else None
            if name is None or (called != "getattr" and name in relied):
                yield f"uses {called} with {ast.unparse(second) if second else 'stars'}"
    elif isinstance(node, ast.Import | ast.ImportFrom):
        place = f"{node.module}." if isinstance(node, ast.ImportFrom) else ""
        dark = (_dark(place + alias.name) for alias in node.names)
        yield from (f"imports {name}" for name in dark if name)
    elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and node.name in METHODS:
        yield f"defines {node.name}"


def _dark(name: str) -> str:
    """Return the part of the name of an import that leads round what can be read in the code."""
    parts = name.split(".")
    dark = [part for part in (parts[0], parts[-1]) if part in MODULES | NAMES | ATTRIBUTES]
    harmless = name.startswith(("IPython.display", "IPython.core.display"))
    return dark[0] if dark and not harmless else ""
