"""The stored lessons, and their copies for readers."""

import hashlib
import json
import os
import platform
import re
from contextlib import closing
from itertools import count
from pathlib import Path
from typing import Any

import nbformat
from nbformat import NotebookNode
from nbformat.sign import NotebookNotary
from tornado.web import HTTPError

from rbcourse.files import replace_file

KERNEL = {"display_name": "Python 3", "language": "python", "name": "python3"}
# JupyterLab marks a notebook as changed if it has to add these metadata
OPENED = {
    "kernelspec": {**KERNEL, "display_name": "Python 3 (ipykernel)"},
    "language_info": {
        "codemirror_mode": {"name": "ipython", "version": 3},
        "file_extension": ".py",
        "mimetype": "text/x-python",
        "name": "python",
        "nbconvert_exporter": "python",
        "pygments_lexer": "ipython3",
        "version": platform.python_version(),
    },
}


def lesson_paths(folder: Path) -> list[Path]:
    """Return the lessons of a folder in the order of the course, without assignments."""
    return sorted(folder.glob("[0-9][0-9]_*.ipynb"))


def shown_figures(cell: NotebookNode) -> dict[str, str]:
    """Return the descriptions of the figures in the outputs of a cell, by their names."""
    texts = [output.get("data", {}).get("text/plain", "") for output in cell.outputs]
    figures = (re.fullmatch(r"((?:lesson\d\d|paper|report)_\w+): (.+)", text) for text in texts)
    return {figure[1]: figure[2] for figure in figures if figure}


def kernel_address(folder: str) -> dict[str, str]:
    """Return the address of a kernel, as settings of its manager.

    Except on Windows, a kernel uses files as addresses, because another program could take a free
    port before the kernel does.
    """
    if os.name == "nt":
        return {}
    return {"transport": "ipc", "ip": os.path.join(folder, "kernel")}


def normalised(notebook: NotebookNode) -> str:
    """Return the text of a notebook in a form that is the same for all runs and machines.

    Only the names of kernel and language are stored. In the outputs, memory addresses become 0x0,
    and random ids of 32 hexadecimal digits are numbered in the order of appearance.
    """
    notebook.metadata.kernelspec = dict(KERNEL)
    notebook.metadata.language_info = {"name": "python"}
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    keep_stills(notebook)
    for output in (output for cell in cells for output in cell.outputs):
        for texts, key in ((output, "text"), (output.get("data", {}), "text/plain")):
            if key in texts:
                texts[key] = re.sub(r"0x[0-9a-fA-F]{6,16}", "0x0", texts[key])
    notebook.metadata.pop("widgets", None)
    for cell, ran in zip(cells, _with_numbered_ids([c.outputs for c in cells]), strict=True):
        cell.outputs = ran
    return nbformat.writes(notebook) + "\n"


def keep_stills(notebook: Any) -> None:
    """If an output has a still, remove its widget, which does not work without a kernel."""
    for cell in notebook["cells"]:
        for output in cell.get("outputs", []):
            if "text/html" in (data := output.get("data", {})):
                data.pop("application/vnd.jupyter.widget-view+json", None)


def before_saving(model: Any, path: str, contents_manager: Any, **_: Any) -> None:
    """Save stills in place of widgets, and do not change the stored lessons.

    Without ``course.py lab --edit``, the stored lesson is protected if it has a copy in ``work/``.
    The stored lesson keeps its outputs if it was only opened or run. A changed lesson is not saved,
    and the error message gives the path of the copy.
    """
    if model["type"] != "notebook" or not model.get("content"):
        return
    folder, name = os.path.split(path)
    if folder == "notebooks" and not os.environ.get("RBCOURSE_EDIT"):
        root = Path(contents_manager.root_dir)
        if name in _read_record(root / "work" / ".copied.json"):
            model["content"] = _as_stored(root / path, model["content"])
    keep_stills(model["content"])


def _as_stored(path: Path, content: Any) -> Any:
    """Return the stored lesson; raise an error for JupyterLab if its cells were changed."""
    try:
        stored = nbformat.read(path, as_version=4)
        now = nbformat.from_dict(content)
        same = _sources(stored) == _sources(now) and _tags(stored) == _tags(now)
    except Exception as error:  # JupyterLab ignores other errors and saves the file
        raise HTTPError(500, f"{path.name} is not saved: {error}") from error
    if not same:
        why = f"{path.name} is an original, and is not saved. Your copy is in work/"
        keep = "to keep this one, choose File > Save Notebook As and enter a path such as work/mine"
        raise HTTPError(403, f"{why}; {keep}.ipynb", reason="Not saved: this is an original")
    return stored


def _with_numbered_ids(ran: list[Any]) -> list[Any]:
    numbers, names = count(1), dict[str, str]()
    text = re.sub(
        r"(?<![0-9a-f])[0-9a-f]{32}(?![0-9a-f])",
        lambda match: names.setdefault(match[0], f"{next(numbers):032x}"),
        json.dumps(ran),
    )
    return [nbformat.from_dict(part) for part in json.loads(text)]


def copy_lessons(lessons: Path, work: Path) -> None:
    """Copy the lessons to a working folder as trusted notebooks, and keep changed copies.

    The new version of a lesson replaces a copy whose cells are unchanged, even if they were run. A
    copy with changed cells is kept, and the new version is stored beside it.
    """
    work.mkdir(exist_ok=True)
    record = work / ".copied.json"
    copied, notary = _read_record(record), NotebookNotary()
    with closing(notary.store):
        for path in lesson_paths(lessons):
            lesson, target = path.read_bytes(), work / path.name
            notebook = _parsed(path)
            last, now = copied.get(path.name), [_digest(lesson), _digest(_cells(lesson))]
            if target.exists() and last and last[0] == now[0]:
                continue
            notebook.metadata.update(OPENED)
            copy = (nbformat.writes(notebook) + "\n").encode()
            if not _left_alone(target, copy, last):
                others = (target.with_stem(f"{path.stem}_{number}") for number in count(2))
                target = next(other for other in others if not other.exists())
                print(f"{path.name} has changed; your copy is kept, the new one is {target.name}")
            replace_file(target, copy)
            try:
                notary.sign(notebook)
            except OSError as error:
                print(f"{target.name} is copied, but not marked as trusted: {error}")
            copied[path.name] = now
            replace_file(record, json.dumps(copied, indent=1).encode())


def _read_record(record: Path) -> dict[str, list[str]]:
    """Return the record of copies, or an empty record if the file is lost or damaged."""
    try:
        copied = json.loads(record.read_bytes())
    except (OSError, ValueError):
        return {}
    return copied if isinstance(copied, dict) else {}


def _left_alone(target: Path, lesson: bytes, last: list[str] | None) -> bool:
    """Tell whether a copy is absent, equals the lesson, or is unchanged except for its outputs."""
    if not target.exists():
        return True
    content = target.read_bytes()
    return content == lesson or (last is not None and last[1] == _digest(_cells(content)))


def _parsed(path: Path) -> NotebookNode:
    try:
        return nbformat.read(path, as_version=4)
    except ValueError as error:
        raise ValueError(f"{path.name} is not a notebook: {str(error)[:80]}") from error


def _digest(content: bytes) -> str:
    return hashlib.sha256(content.replace(b"\r\n", b"\n")).hexdigest()


def _cells(content: bytes) -> bytes:
    """Return the sources of the cells, or the whole text if it is not a valid notebook."""
    try:
        return json.dumps(_sources(nbformat.reads(content.decode(), as_version=4))).encode()
    except Exception:
        return content


def _sources(notebook: Any) -> list[tuple[str, str]]:
    return [(cell.cell_type, cell.source) for cell in notebook.cells]


def _tags(notebook: Any) -> list[Any]:
    return [cell.metadata.get("tags", []) for cell in notebook.cells]
