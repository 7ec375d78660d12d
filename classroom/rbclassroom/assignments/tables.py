"""Convert the table of a problem set to inputs, answers and results of mistakes.

The table of the set ``NAME`` is the file ``NAME.toml`` beside its folder. Students do not get the
table. It has a section ``SLUG`` for the problem with the cells ``SLUG-answer`` and ``SLUG-test``. A
section has the inputs and common mistakes, and says in which lesson to `read` again, and whether
students `keep` their function for later sets. Each mistake has a hint, and the bodies of functions
that make the mistake. The right answers come from the notebook. `own` says which functions an
answer may use; students see it when an answer is right, and nothing checks it.
"""

import ast
import copy
import hashlib
import inspect
import json
import re
import tomllib
from collections.abc import Callable
from pathlib import Path
from textwrap import indent
from typing import Any

import nbformat
import numpy as np

from rbclassroom.assignments.locked_cells import grade_id
from rbclassroom.assignments.marking import curves_of, draw
from rbclassroom.assignments.marking_samplers import LAWS, quantiles
from rbclassroom.assignments.safe_files import write_whole
from rbclassroom.assignments.twins import only_twins

DRAWS = 5000
Function = Callable[..., Any]


def update(folder: Path) -> None:
    """Write the data of a set into its folder if its table or its notebook has changed."""
    table, notebook = folder.parent / f"{folder.name}.toml", folder / f"{folder.name}.ipynb"
    if not table.is_file():
        if "assignments.problems import problem" in notebook.read_text("utf-8"):
            raise ValueError(f"{table} is missing, and the tests of {notebook.name} need it")
        return
    state = hashlib.sha256(table.read_bytes() + notebook.read_bytes()).hexdigest()
    target = folder / f"{folder.name}.json"
    if not target.exists() or json.loads(target.read_text("utf-8")).get("state") != state:

        def plain(value: Any) -> Any:  # JSON cannot store NumPy's arrays and scalars
            return {"array": value.tolist()} if isinstance(value, np.ndarray) else value.item()

        text = json.dumps({"state": state, **evaluate(folder)}, default=plain)
        write_whole(target, text.encode())


def evaluate(folder: Path) -> dict[str, dict[str, Any]]:
    """Return the arguments of `Problem`, `Drawing` or `Sampler` for each problem of a set."""
    try:
        table = tomllib.loads((folder.parent / f"{folder.name}.toml").read_text("utf-8"))
    except tomllib.TOMLDecodeError as error:
        raise ValueError(f"{folder.name}.toml: {error}") from error
    notebook = nbformat.read(folder / f"{folder.name}.ipynb", as_version=4)
    cells = {grade_id(cell): cell.source for cell in notebook.cells if cell.cell_type == "code"}
    answers = [text for name, text in cells.items() if name.endswith("-answer")]
    space: dict[str, Any] = {"__name__": "__main__"}
    with only_twins():
        for text in (cells.get("setup", ""), *answers, table.pop("helpers", "")):
            exec(compile(text, folder.name, "exec"), space)
    found, own = {}, table.pop("own", "")
    for slug, problem in table.items():
        try:
            found[slug] = {"own": own, **_evaluate(problem, cells[f"{slug}-answer"], space)}
        except Exception as error:
            raise ValueError(f"{folder.name}.toml, {slug}: {error!r}") from error
    return found


def _evaluate(problem: dict[str, Any], answer: str, space: dict[str, Any]) -> dict[str, Any]:
    kept = "law", "accuracy", "angles", "read"
    known: dict[str, Any] = {key: problem[key] for key in kept if key in problem}
    inputs = eval(problem.get("inputs", "[]"), space)
    names = list(inspect.signature(space[_name(answer)]).parameters)
    drawing = names[0] == "ax"

    def run(function: Function) -> list[Any]:
        if "law" in known:
            rng = np.random.default_rng(1)
            drawn = np.array([function(rng) for _ in range(DRAWS)])
            rows = LAWS[known["law"]]["uniforms"](drawn)
            return [quantiles(row).round(4) for row in rows.values()]
        if drawing:
            return [curves_of(draw(function, trial)) for trial in inputs]
        return [function(*copy.deepcopy(trial)) for trial in inputs]

    if "law" not in known:
        known |= {"drawing": drawing, "names": names[drawing:], "inputs": inputs}
        known["answers"] = run(space[_name(answer)])
    defined = [node for node in ast.parse(answer).body if isinstance(node, ast.FunctionDef)]
    known["doc"] = ast.get_docstring(defined[-1])
    if problem.get("keep"):
        known["keep"] = _name(answer)
    known["mistakes"] = []
    for mistake in problem["mistakes"]:
        functions = (function_of(answer, code, space) for code in mistake["code"])
        known["mistakes"].append({"hint": mistake["hint"], "results": list(map(run, functions))})
    return known


def function_of(answer: str, code: str, space: dict[str, Any]) -> Function:
    """Return the function of an answer cell, with the given code as its body."""
    head = re.split(r" *### BEGIN SOLUTION", answer)[0]
    own = dict(space)
    exec(compile(head + indent(code.strip(), "    "), "<mistake>", "exec"), own)
    function: Function = own[_name(head)]
    return function


def _name(text: str) -> str:
    return str(re.findall(r"^def (\w+)\(", text, re.MULTILINE)[-1])
