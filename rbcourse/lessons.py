"""The lessons as files: executed so that what is stored is the same, byte for byte, each time."""

import argparse
import hashlib
import json
import os
import re
import shutil
import tempfile
import time
from collections.abc import Iterator
from itertools import count
from pathlib import Path

import nbformat
from nbclient import NotebookClient
from nbformat import NotebookNode
from nbformat.sign import NotebookNotary

KERNEL = {"display_name": "Python 3", "language": "python", "name": "python3"}


def lesson_paths(folder: Path) -> list[Path]:
    """Return the lessons of a folder in the order of the course; assignments are none.

    Parameters
    ----------
    folder : Path

    Returns
    -------
    list of Path
    """
    return sorted(folder.glob("[0-9][0-9]_*.ipynb"))


def execute(path: Path, figures: Path) -> str:
    """Run a lesson from top to bottom in a new kernel and return what is to be stored.

    Parameters
    ----------
    path : Path
        The notebook; it is only read.
    figures : Path
        The folder that its figures go to.

    Returns
    -------
    str
        The notebook with its outputs, normalised.

    Raises
    ------
    nbclient.exceptions.CellExecutionError
        If a cell fails.
    """
    notebook = nbformat.read(path, as_version=4)
    client = NotebookClient(
        notebook,
        kernel_name=KERNEL["name"],
        record_timing=False,
        coalesce_streams=True,
        timeout=120,
        extra_arguments=["--log-level=ERROR"],
        resources={"metadata": {"path": str(path.parent)}},
    )
    client.execute(env={**os.environ, "RBCOURSE_FIGURES": str(figures.resolve())})
    return normalised(notebook)


def normalised(notebook: NotebookNode) -> str:
    """Return a notebook as text without what differs from run to run or machine to machine.

    Kernel and language are stored by name only, memory addresses are blanked, and random ids of
    32 hexadecimal digits are numbered in the order of appearance.

    Parameters
    ----------
    notebook : NotebookNode
        It is changed in place.

    Returns
    -------
    str
    """
    notebook.metadata.kernelspec = dict(KERNEL)
    notebook.metadata.language_info = {"name": "python"}
    for cell in notebook.cells:
        for output in cell.get("outputs", []):
            if "text" in output:
                output.text = _without_addresses(output.text)
            if "text/plain" in output.get("data", {}):
                output.data["text/plain"] = _without_addresses(output.data["text/plain"])
    return _with_numbered_ids(nbformat.writes(notebook)) + "\n"


def _without_addresses(text: str) -> str:
    return re.sub(r"0x[0-9a-fA-F]{6,16}", "0x0", text)


def _with_numbered_ids(text: str) -> str:
    numbers, names = count(1), dict[str, str]()
    return re.sub(
        r"\b[0-9a-f]{32}\b",
        lambda match: names.setdefault(match[0], f"{next(numbers):032x}"),
        text,
    )


def regenerate(lessons: Path, figures: Path) -> None:
    """Execute every lesson, then rewrite the stored outputs and the figures.

    Nothing is rewritten unless every lesson ran; figures that no lesson draws are removed.

    Parameters
    ----------
    lessons, figures : Path
        The two folders.
    """
    with tempfile.TemporaryDirectory() as folder:
        texts = {}
        for path in lesson_paths(lessons):
            print(f"{path.stem} ...", end=" ", flush=True)
            start = time.perf_counter()
            texts[path] = execute(path, Path(folder))
            print(f"{time.perf_counter() - start:.1f} s", flush=True)
        for path, text in texts.items():
            path.write_text(text, encoding="utf-8", newline="\n")
        shutil.rmtree(figures, ignore_errors=True)
        shutil.copytree(folder, figures)
    print(f"{len(texts)} lessons, {len(list(figures.iterdir()))} files in {figures.name}/")


def copy_lessons(lessons: Path, work: Path) -> None:
    """Copy the lessons to a folder to work in, trusted; what was written there is never touched.

    A lesson that is new to the folder is copied. One that has changed since it was copied takes
    the place of its copy if the cells of that are as they were, run or not, and is laid beside it
    otherwise.

    Parameters
    ----------
    lessons, work : Path
        From where and to where.
    """
    work.mkdir(exist_ok=True)
    record = work / ".copied.json"
    copied = json.loads(record.read_text("utf-8")) if record.exists() else {}
    for path in lesson_paths(lessons):
        text, target = path.read_text("utf-8"), work / path.name
        last = copied.get(path.name, {})
        if target.exists() and last.get("lesson") == _digest(text):
            continue
        if target.exists() and last.get("cells") != _digest(_cells(target.read_text("utf-8"))):
            target = next(p for p in _numbered(target) if not p.exists())
            print(f"{path.name} has changed; your copy stays, the new one is {target.name}")
        target.write_text(text, encoding="utf-8", newline="\n")
        NotebookNotary().sign(nbformat.reads(text, as_version=4))
        copied[path.name] = {"lesson": _digest(text), "cells": _digest(_cells(text))}
        record.write_text(json.dumps(copied, indent=1), encoding="utf-8")


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def _cells(text: str) -> str:
    """Return what a person writes in a notebook; all of it where it cannot be read as one."""
    try:
        cells = nbformat.reads(text, as_version=4).cells
    except nbformat.reader.NotJSONError:
        return text
    return json.dumps([(cell.cell_type, cell.source) for cell in cells])


def _numbered(path: Path) -> Iterator[Path]:
    return (path.with_stem(f"{path.stem}_{number}") for number in count(2))


def main() -> None:
    """Run a task from the command line: ``python -m rbcourse.lessons TASK``, in the course."""
    parser = argparse.ArgumentParser(prog="python -m rbcourse.lessons")
    parser.add_argument("task", choices=["regenerate", "copy"])
    task = parser.parse_args().task
    if task == "regenerate":
        regenerate(Path("notebooks"), Path("figures"))
    else:
        copy_lessons(Path("notebooks"), Path("work"))


if __name__ == "__main__":
    main()
