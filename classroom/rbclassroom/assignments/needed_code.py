"""Find the statements of a notebook that a later statement needs."""

import ast
import symtable
from collections.abc import Sequence

_IMPORT = ast.Import | ast.ImportFrom
_DEFINITION = ast.FunctionDef | ast.ClassDef


def needed(above: Sequence[ast.stmt], cell: Sequence[ast.stmt]) -> list[ast.stmt]:
    """Return the statements above on which the names of a cell depend.

    A statement is needed if it binds a name that is used below, or if it may change the object of
    such a name. An object may change by an assignment to a part of it, by one of its methods, or as
    the first argument of a call whose result is not kept. A call that uses only modules may set an
    option of these modules. If a random generator is needed, every statement that uses it is
    needed.
    """
    statements = [*above, *cell]
    read, bound = {}, {}
    for each in statements:
        read[each], bound[each] = names_in(each)
    modules = set().union(*(bound[each] for each in above if isinstance(each, _IMPORT)))
    random = set().union(*(bound[each] for each in above if "default_rng" in ast.dump(each)))
    late = set[str]()  # names that are read when a function is called
    while True:
        kept, wanted = [], set(late)
        for each in reversed(statements):
            options = read[each] if isinstance(each, ast.Expr) and read[each] <= modules else set()
            changed = _changed(each) - modules | options | (read[each] & random)
            if each in cell or (bound[each] | changed) & wanted:
                sure = isinstance(each, ast.Assign | _DEFINITION | _IMPORT)
                wanted = wanted - (bound[each] if sure else set()) | read[each]
                kept.append(each)
        functions = (read[each] for each in kept if isinstance(each, _DEFINITION))
        if late == (late := late.union(*functions)):
            return [each for each in above if each in kept]


def names_in(statement: ast.stmt) -> tuple[set[str], set[str]]:
    """Return the names that a statement reads but does not bind itself, and those it may bind."""
    tables = [symtable.symtable(ast.unparse(statement), "<statement>", "exec")]
    symbols = tables[0].get_symbols()
    bound = {each.get_name() for each in symbols if each.is_assigned() or each.is_imported()}
    read = set[str]()
    for table in tables:
        tables += table.get_children()
        symbols = [each for each in table.get_symbols() if each.is_global()]
        read |= {each.get_name() for each in symbols if each.is_referenced()}
    if isinstance(statement, ast.For):  # the loop assigns its target before the body reads it
        target = {node.id for node in ast.walk(statement.target) if isinstance(node, ast.Name)}
        read = read - target | names_in(ast.Expr(statement.iter))[0]
    return read, bound


def _changed(statement: ast.stmt) -> set[str]:
    """Return the names whose objects a statement may change."""
    found = set[str]()
    for node in ast.walk(statement):
        if isinstance(node, ast.Attribute | ast.Subscript) and isinstance(node.ctx, ast.Store):
            found |= _root(node)
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            found |= _root(node.func)
    call = statement.value if isinstance(statement, ast.Expr) else None
    if isinstance(call, ast.Call) and call.args and _root(call.func) != {"print"}:
        found |= _root(call.args[0])
    return found


def _root(node: ast.AST) -> set[str]:
    """Return {"name"} for a chain such as ``name.part[0].method``, otherwise an empty set."""
    while isinstance(node, ast.Attribute | ast.Subscript | ast.Starred):
        node = node.value
    return {node.id} if isinstance(node, ast.Name) else set()
