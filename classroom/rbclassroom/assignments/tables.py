"""Tables of problems, and the data that they become: inputs, answers and results of mistakes.

The table of the set ``NAME`` is the file ``NAME.toml`` beside its folder, and never leaves the
teacher. It has a section for each problem, under the name of its cells, ``SLUG-answer`` and
``SLUG-test``: the inputs, and common mistakes, each with a hint and the bodies of functions that
make it. The right answers are those of the notebook.
"""

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

from rbclassroom.assignments.marking import curves_of
from rbclassroom.assignments.marking_samplers import LAWS, quantiles
from rbclassroom.assignments.restore import grade_id
from rbclassroom.assignments.writing import write_whole

DRAWS = 5000


def update(folder: Path) -> None:
    """Write the data of a set into its folder, if its table or notebook has changed since."""
    table, notebook = folder.parent / f"{folder.name}.toml", folder / f"{folder.name}.ipynb"
    if not table.is_file():
        if "assignments.problems import problem" in notebook.read_text("utf-8"):
            raise ValueError(f"{table} is missing: the tests of {notebook.name} need it")
        return
    state = hashlib.sha256(table.read_bytes() + notebook.read_bytes()).hexdigest()
    target = folder / f"{folder.name}.json"
    if not target.exists() or json.loads(target.read_text("utf-8")).get("state") != state:
        text = json.dumps({"state": state, **evaluate(folder)}, default=_plain)
        write_whole(target, text.encode())


def evaluate(folder: Path) -> dict[str, dict[str, Any]]:
    """Return the arguments of `Problem`, `Drawing` or `Sampler` for each problem of a set."""
    try:
        table = tomllib.loads((folder.parent / f"{folder.name}.toml").read_text("utf-8"))
    except tomllib.TOMLDecodeError as error:
        raise ValueError(f"{folder.name}.toml: {error}") from error
    notebook = nbformat.read(folder / f"{folder.name}.ipynb", as_version=4)
    cells = {grade_id(cell): cell.source for cell in notebook.cells if cell.cell_type == "code"}
    space: dict[str, Any] = {"__name__": "__main__"}
    answers = [text for name, text in cells.items() if name.endswith("-answer")]
    for text in (cells.get("setup", ""), *answers, table.pop("helpers", "")):
        exec(compile(text, folder.name, "exec"), space)
    found = {}
    for slug, problem in table.items():
        try:
            found[slug] = _evaluate(problem, cells[f"{slug}-answer"], space)
        except Exception as error:
            raise ValueError(f"{folder.name}.toml, {slug}: {error!r}") from error
    return found


def _evaluate(problem: dict[str, Any], answer: str, space: dict[str, Any]) -> dict[str, Any]:
    name, mistakes = re.findall(r"^def (\w+)\(", answer, re.MULTILINE)[-1], problem["mistakes"]
    functions = [[function_of(answer, code, space) for code in m["code"]] for m in mistakes]
    if law := problem.get("law"):
        rows = LAWS[law]["uniforms"]
        results = [[_quantiles(function, rows) for function in some] for some in functions]
        known: dict[str, Any] = {"law": law}
    else:
        names = list(inspect.signature(space[name]).parameters)
        drawing = names[0] == "ax"
        inputs = eval(problem["inputs"], space)

        def run(function: Callable[..., Any]) -> list[Any]:
            trials = (copy.deepcopy(trial) for trial in inputs)
            return [(_draw(function, trial) if drawing else function(*trial)) for trial in trials]

        results = [[run(function) for function in some] for some in functions]
        known = {"drawing": drawing, "names": names[drawing:], "inputs": inputs}
        known |= {"answers": run(space[name])} | ({"accuracy": 1e-6} if drawing else {})
    known |= {key: problem[key] for key in ("allowed", "accuracy", "angles") if key in problem}
    hints = [mistake["hint"] for mistake in mistakes]
    pairs = zip(hints, results, strict=True)
    return known | {"mistakes": [{"hint": hint, "results": some} for hint, some in pairs]}


def function_of(answer: str, code: str, space: dict[str, Any]) -> Callable[..., Any]:
    """Return the function of an answer cell with another body."""
    head = re.split(r" *### BEGIN SOLUTION", answer)[0]
    own = dict(space)
    exec(compile(head + indent(code.strip(), "    "), "<mistake>", "exec"), own)
    function: Callable[..., Any] = own[re.findall(r"^def (\w+)\(", head, re.MULTILINE)[-1]]
    return function


def _draw(function: Callable[..., Any], trial: Any) -> list[Any]:
    from matplotlib.figure import Figure

    axes = Figure().subplots()
    function(axes, *trial)
    return curves_of(axes)


def _quantiles(function: Callable[..., Any], rows: Callable[[Any], dict[str, Any]]) -> list[Any]:
    rng = np.random.default_rng(1)
    drawn = np.array([function(rng) for _ in range(DRAWS)])
    return [quantiles(row).round(4) for row in rows(drawn).values()]


def _plain(value: Any) -> Any:
    """Return an array or a number of NumPy's in a form that JSON has."""
    return {"array": value.tolist()} if isinstance(value, np.ndarray) else value.item()
