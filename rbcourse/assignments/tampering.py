"""Find code in a submission that overrides names used by the tests."""

import ast
import builtins
import re
from collections.abc import Iterable, Iterator

from IPython.core.inputtransformer2 import TransformerManager

# each leads round what can be read in the code
DARK = {
    *("exec", "eval", "globals", "__import__", "__builtins__", "get_ipython", "_getframe"),
    *("__dict__", "__setattr__", "__delattr__", "__code__", "__globals__", "__subclasses__"),
    *("displayhook", "settrace", "setprofile"),
}
DARK_MODULES = {"builtins", "ctypes", "gc", "importlib", "inspect", "IPython", "ipykernel"}
DARK_MODULES |= {"nbgrader", "pytest", "unittest"}
# an object that equals everything passes every test
DARK_METHODS = {f"__{name}__" for name in ("eq", "ne", "lt", "le", "gt", "ge", "bool")}
DARK_METHODS |= {"__array_ufunc__", "__array_function__"}
MAGICS = {"matplotlib", "pinfo", "pinfo2", "time", "timeit", "capture"}
CUSTOMARY = {"np": "numpy", "plt": "matplotlib.pyplot", "mpl": "matplotlib", "sp": "scipy"}


def names_relied_on(locked: Iterable[str]) -> set[str]:
    """Return the names that students may not give a new meaning.

    Examples
    --------
    >>> sorted(names_relied_on(["import numpy as np", "assert all(np.isclose(x, 1))"]))
    ['all', 'np']
    """
    relied: set[str] = set()
    for node in (node for source in locked for node in ast.walk(_parsed(source))):
        if isinstance(node, ast.Import | ast.ImportFrom):
            relied |= {_bound(alias) for alias in node.names}
        elif isinstance(node, ast.FunctionDef | ast.ClassDef):
            relied.add(node.name)
        elif isinstance(node, ast.Name) and hasattr(builtins, node.id):
            relied.add(node.id)
    return relied - {"*"}


def find_tampering(
    source: str, relied: set[str], imported: set[str] | None = None
) -> list[tuple[int, str]]:
    r"""Find where code replaces what tests rely on, or hides what it does.

    This reads the code and does not run it: it finds what students write in earnest or in jest,
    not what an expert takes pains to hide.

    Examples
    --------
    >>> find_tampering("import numpy as np\nnp.allclose = print", {"np"})
    [(2, 'replaces np.allclose')]
    >>> find_tampering("import matplotlib.pyplot as plt\nplt.rcParams['font.size'] = 9", {"np"})
    []
    """
    imported = set() if imported is None else imported
    tree = _parsed(source)
    nodes = list(ast.walk(tree))
    for node in nodes:
        _learn(node, imported)
    rebound = _rebound(tree)
    found = {(line, f"gives {name} another meaning") for line, name in rebound if name in relied}
    for node in nodes:
        found |= {(getattr(node, "lineno", 0), what) for what in _suspicious(node, imported)}
    return sorted(found)


def find_in_cells(cells: Iterable[tuple[str, bool]]) -> list[tuple[int, int, str]]:
    """Find where a notebook replaces what its tests rely on."""
    cells = list(cells)
    relied = names_relied_on(source for source, own in cells if not own)
    imported: set[str] = set()
    found = [find_tampering(source, relied, imported) for source, _ in cells]
    return [(i, *what) for i, (_, own) in enumerate(cells) if own for what in found[i]]


class _Magics(ast.NodeTransformer):
    """Replace magics that do no harm by the code that they run."""

    def visit_Expr(self, node: ast.Expr) -> ast.AST | list[ast.stmt]:
        name, body = _magic(node.value)
        if name not in ("time", "timeit", "capture"):
            return self.generic_visit(node)
        inner = _parsed(body)
        below = "cell" in ast.unparse(node)[:24]
        return ast.increment_lineno(inner, node.lineno - (not below)).body

    def visit_Call(self, node: ast.Call) -> ast.AST:
        name, body = _magic(node)
        harmless = name in MAGICS or (name == "config" and body.startswith("InlineBackend."))
        return ast.copy_location(ast.Constant(None), node) if harmless else self.generic_visit(node)


def _magic(node: ast.AST) -> tuple[str, str]:
    """Return the name of a magic and the code, or what else is given to it."""
    if isinstance(node, ast.Call) and re.match(
        r"get_ipython\(\)\.run_(line|cell)_magic\(", ast.unparse(node)
    ):
        words = [str(arg.value) for arg in node.args if isinstance(arg, ast.Constant)]
        return (words[0], words[-1]) if words else ("", "")
    return "", ""


def _parsed(source: str) -> ast.Module:
    """Return the code; nothing if it is not Python, and so does not run."""
    try:
        tree = ast.parse(TransformerManager().transform_cell(source))
        blank = len(source) - len(source.lstrip("\n"))
        changed = _Magics().visit(ast.increment_lineno(tree, blank))
        return changed if isinstance(changed, ast.Module) else tree
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return ast.Module([], [])


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
        elif not isinstance(node, ast.Lambda | ast.comprehension):
            todo += ast.iter_child_nodes(node)


def _suspicious(node: ast.AST, imported: set[str]) -> Iterator[str]:
    if isinstance(node, ast.Attribute) and not isinstance(node.ctx, ast.Load):
        if _root(node) in imported:
            yield f"replaces {ast.unparse(node)}"
    elif isinstance(node, ast.Call) and ast.unparse(node.func) in ("setattr", "delattr", "vars"):
        first = ast.unparse(node.args[0]) if node.args else "everything"
        if not node.args or _root(node.args[0]) in imported:
            yield f"replaces parts of {first}"
    elif isinstance(node, ast.Subscript) and not isinstance(node.ctx, ast.Load):
        if ast.unparse(node.value) == "sys.modules":
            yield "replaces sys.modules"
    elif isinstance(node, ast.ImportFrom) and node.module != "IPython.display":
        yield from _dark(node.module or "", [alias.name for alias in node.names])
    elif isinstance(node, ast.Import):
        yield from (what for alias in node.names for what in _dark(alias.name, []))
    elif isinstance(node, ast.FunctionDef) and node.name in DARK_METHODS:
        yield f"defines {node.name}"
    name = getattr(node, "attr", getattr(node, "id", ""))
    if name in DARK and (isinstance(node, ast.Name) or name.startswith("_") or "display" in name):
        yield "uses a magic or a shell" if name == "get_ipython" else f"uses {name}"


def _dark(module: str, names: list[str]) -> Iterator[str]:
    for name in (module.split(".")[0], *names):
        if name in DARK_MODULES | DARK:
            yield f"imports {name}"
