"""Convert the table of a problem set to inputs, answers and results of mistakes.

The table of the set ``NAME`` is the file ``NAME.toml`` beside its folder; the page for lecturers
describes it. It has a section ``SLUG`` for the problem with the cells ``SLUG-answer`` and
``SLUG-test``. `own` says which functions an answer may use, and nothing checks it.
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

from rbclassroom.assignments import twins
from rbclassroom.assignments.locked_cells import grade_id
from rbclassroom.assignments.marking import curves_of, draw
from rbclassroom.assignments.marking_samplers import LAWS, quantiles
from rbcourse.files import replace_file

DRAWS = 5000
KEPT = "law", "accuracy", "angles", "read"
"""The names in the table of a problem whose values go into the data of the set as they are."""
NAMES = {*KEPT, "inputs", "keep"}
"""The names that the table of a problem may have besides `mistakes`."""


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

        text = json.dumps({"state": state, **_problems(table, notebook)}, default=plain)
        replace_file(target, text.encode())


def _problems(path: Path, notebook: Path) -> dict[str, dict[str, Any]]:
    """Return the arguments of `Problem`, `Drawing` or `Sampler` for each problem of a set."""
    try:
        table = tomllib.loads(path.read_text("utf-8"))
    except tomllib.TOMLDecodeError as error:
        raise ValueError(f"{path.name}: {error}") from error
    read = nbformat.read(notebook, as_version=4).cells
    cells = {grade_id(cell): cell.source for cell in read if cell.cell_type == "code"}
    answers = [text for name, text in cells.items() if name.endswith("-answer")]
    space: dict[str, Any] = {"__name__": "__main__"}
    twins.alone = True
    try:
        for text in (cells.get("setup", ""), *answers, table.pop("helpers", "")):
            exec(compile(text, path.stem, "exec"), space)
    finally:
        twins.alone = False
    found, own = {}, table.pop("own", "")
    for slug, problem in table.items():
        _check_names(path.name, slug, problem)
        try:
            found[slug] = {"own": own, **_evaluate(problem, cells[f"{slug}-answer"], space)}
        except Exception as error:
            raise ValueError(f"{path.name}, {slug}: {error!r}") from error
    return found


def _check_names(file: str, slug: str, problem: Any) -> None:
    """Refuse a misspelt or missing name in the table of a problem."""
    tables: list[tuple[str, Any, set[str], set[str]]]
    tables = [(f"{file}, {slug}", problem, {"mistakes"}, NAMES)]
    mistakes = problem.get("mistakes", []) if isinstance(problem, dict) else []
    for i, mistake in enumerate(mistakes, start=1):
        tables.append((f"{file}, {slug}, mistake {i}", mistake, {"hint", "code"}, set()))
    for place, table, needed, more in tables:
        if not isinstance(table, dict):
            raise ValueError(f"{place}: a table is wanted, got {table!r:.60}")
        if unknown := table.keys() - needed - more:
            known = ", ".join(sorted(needed | more))
            raise ValueError(f"{place}: {min(unknown)} is not one of {known}")
        if missing := needed - table.keys():
            raise ValueError(f"{place}: {min(missing)} is missing")


def _evaluate(problem: dict[str, Any], answer: str, space: dict[str, Any]) -> dict[str, Any]:
    known: dict[str, Any] = {key: problem[key] for key in KEPT if key in problem}
    inputs = eval(problem.get("inputs", "[]"), space)
    defined = [node for node in ast.parse(answer).body if isinstance(node, ast.FunctionDef)]
    name = defined[-1].name
    names = list(inspect.signature(space[name]).parameters)
    drawing = names[0] == "ax"

    def run(function: Callable[..., Any]) -> list[Any]:
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
        known["answers"] = run(space[name])
    known["doc"] = ast.get_docstring(defined[-1])
    if problem.get("keep"):
        known["keep"] = name
    known["mistakes"] = []
    head = re.split(r" *### BEGIN SOLUTION", answer)[0]
    for mistake in problem["mistakes"]:
        results = []
        for code in mistake["code"]:
            own = dict(space)
            exec(compile(head + indent(code.strip(), "    "), "<mistake>", "exec"), own)
            results.append(run(own[name]))
        known["mistakes"].append({"hint": mistake["hint"], "results": results})
    return known
