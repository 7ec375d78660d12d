"""Pack a problem set for students: the notebook, the package, and instructions."""

import copy
import io
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

import nbformat
from nbformat import NotebookNode
from nbgrader import preprocessors as nbgrader
from nbgrader.nbgraderformat import ValidationError
from traitlets.config import Config
from traitlets.config.loader import PyFileConfigLoader

from rbclassroom.assignments.locked_cells import is_answer
from rbclassroom.assignments.notebook_runner import BoundedClient
from rbclassroom.assignments.tables import update
from rbclassroom.course.notebooks import KERNEL
from rbcourse.files import replace_file

LEFTOVER = re.compile(
    r"#+ *(?:BEGIN|END)\b.*|(?:BEGIN|END) +(?:SOLUTION|HIDDEN|MARK)|MARK +SCHEME|HIDDEN +TESTS?",
    re.IGNORECASE,
)
# the steps of `nbgrader generate_assignment`
STEPS = [nbgrader.LockCells, nbgrader.ClearSolutions, nbgrader.ClearOutput]
STEPS += [nbgrader.CheckCellMetadata, nbgrader.ClearHiddenTests, nbgrader.ClearMarkScheme]
STEPS += [nbgrader.ComputeChecksums]


def find_set(name: str, assignments: Path) -> Path:
    """Return the folder of a problem set; a private set replaces the course's set of that name."""
    folders = [p for step in ("source", "private") for p in sorted(assignments.glob(f"{step}/*/"))]
    sets = {p.name: p for p in folders if (p / f"{p.name}.ipynb").is_file()}
    if name not in sets:
        there = ", ".join(sorted(sets)) or "none; run this in the folder of the course"
        raise ValueError(f"set: one of the problem sets is wanted ({there}), got {name}")
    return sets[name]


def read_config(assignments: Path) -> Config:
    """Return the settings in nbgrader_config.py."""
    if not (assignments / "nbgrader_config.py").is_file():
        return Config()
    return PyFileConfigLoader("nbgrader_config.py", path=str(assignments)).load_config()


def release(name: str, assignments: Path) -> dict[str, bytes]:
    """Return the files that students get, as ``nbgrader generate_assignment`` makes them.

    Raise ValueError if a file shows a solution, a hidden test or a mark scheme.
    """
    source, config = find_set(name, assignments), read_config(assignments)
    update(source)
    given = nbformat.read(source / f"{name}.ipynb", as_version=4)
    notebook, about = copy.deepcopy(given), dict[str, Any]()
    try:
        for step in STEPS:
            notebook, about = step(config=config).preprocess(notebook, about)
    except (RuntimeError, ValidationError) as error:
        raise ValueError(f"{name} cannot be released: {error}") from error
    paths = sorted(path for path in source.rglob("*") if path.is_file())
    paths = [path for path in paths if ".ipynb_checkpoints" not in path.parts]
    files = {path.relative_to(source).as_posix(): path.read_bytes() for path in paths}
    files[f"{name}.ipynb"] = (nbformat.writes(notebook) + "\n").encode()
    given_away = _leak(name, given, notebook, files)
    if given_away:
        raise ValueError(f"{name}: {given_away}")
    return files


def _leak(name: str, given: NotebookNode, notebook: NotebookNode, files: dict[str, bytes]) -> str:
    """Return a message if a file shows solutions, hidden tests or mark schemes, otherwise ""."""
    taken, common = _lines(given) - _lines(notebook), ("import ", "from ", "raise ")
    secrets = sorted(line for line in taken if len(line) >= 12 and not line.startswith(common))
    if any(cell.get("attachments") and is_answer(cell) for cell in notebook.cells):
        return "an answer has an attachment, and nbgrader does not remove attachments"
    for path, content in files.items():
        text = content.decode("utf-8", errors="replace")
        if path == f"{name}.ipynb":
            text = "\n".join(f"{cell.source}\n{cell.metadata}" for cell in notebook.cells)
        elif path.endswith(".ipynb"):
            return f"a set has one notebook, and {path} is a second one"
        if shown := [*(line for line in secrets if line in text), *LEFTOVER.findall(text)]:
            return f"{path} gives away {shown[0]!r}"
    return ""


def _lines(notebook: NotebookNode) -> set[str]:
    return {line.strip() for cell in notebook.cells for line in cell.source.splitlines()}


def build_wheel(course: Path) -> tuple[str, bytes]:
    """Build the wheel of a distribution, reproducibly and without a network."""
    with tempfile.TemporaryDirectory() as folder:
        words = [sys.executable, "-m", "flit_core.wheel", "--outdir", folder]
        own = {**os.environ, "SOURCE_DATE_EPOCH": "315532800"}  # the earliest date in a zip
        subprocess.run(words, cwd=course, env=own, check=True, capture_output=True)
        (built,) = Path(folder).glob("*.whl")
        return built.name, built.read_bytes()


def make_handout(name: str, assignments: Path, course: Path) -> Path:
    """Write ``handouts/NAME.zip`` for the students, reproducibly."""
    files = release(name, assignments)
    wheels = dict(build_wheel(folder) for folder in (course, course / "classroom"))
    environment = (course / "environment.txt").read_text("utf-8").splitlines()
    pins = [line.partition("#")[0].strip() for line in environment if line[:1] not in ("#", "-")]
    required = [*pins, *(f"./{wheel}" for wheel in wheels)]
    readme = Path(__file__).with_suffix(".txt").read_text("ascii")
    own = {
        **{f"original/{path}": data for path, data in files.items()},
        "requirements.txt": "".join(f"{line}\n" for line in required).encode(),
        "README.txt": readme.format(name=name).replace("\n", "\r\n").encode("ascii"),
        **wheels,
    }
    if taken := files.keys() & own.keys():
        raise ValueError(f"{name}: rename {min(taken)}; the handout has its own file of this name")
    packed = pack({f"{name}/{path}": data for path, data in {**files, **own}.items()})
    return _write(assignments / "handouts" / f"{name}.zip", packed)


def _write(path: Path, content: bytes) -> Path:
    path.parent.mkdir(exist_ok=True)
    replace_file(path, content)
    return path


def pack(files: dict[str, bytes]) -> bytes:
    """Return a zip of files; the same files always give the same bytes."""
    packed = io.BytesIO()
    with ZipFile(packed, "w") as archive:
        for path, data in sorted(files.items()):
            entry = ZipInfo(path)  # its default date is the earliest
            entry.create_system, entry.external_attr = 3, 0o644 << 16
            archive.writestr(entry, data, compress_type=ZIP_DEFLATED)
    return packed.getvalue()


def make_solutions(name: str, assignments: Path) -> Path:
    """Write ``handouts/NAME-solutions.ipynb``: model answers and outputs, without hidden tests."""
    source = find_set(name, assignments)
    update(source)
    notebook = nbformat.read(source / f"{name}.ipynb", as_version=4)
    for step in (nbgrader.ClearHiddenTests(), nbgrader.ClearMarkScheme()):
        notebook, _ = step.preprocess(notebook, {})
    for cell in notebook.cells:
        cell.source = re.sub(r"^.*### (BEGIN|END) SOLUTION.*\n?", "", cell.source, flags=re.M)
        cell.source = re.sub(r"\s*^\*\*Mark scheme\b.*", "", cell.source, flags=re.M | re.S)
        cell.metadata = NotebookNode()
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        work = shutil.copytree(
            source, Path(folder, "work"), ignore=shutil.ignore_patterns("*.ipynb")
        )
        client = BoundedClient(notebook, kernel_name=KERNEL["name"])
        client.folder, client.allow_errors = Path(folder), False
        client.execute(cwd=str(work))
    notebook.metadata = NotebookNode({"kernelspec": dict(KERNEL)})
    target = assignments / "handouts" / f"{name}-solutions.ipynb"
    return _write(target, (nbformat.writes(notebook) + "\n").encode())
