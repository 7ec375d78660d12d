"""Pack a problem set for students: the notebook, the package, and a page on how to begin."""

import argparse
import io
import json
import logging
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

import nbformat
from nbclient.exceptions import CellExecutionError
from nbformat import NotebookNode
from nbgrader.converters import GenerateAssignment
from nbgrader.coursedir import CourseDirectory
from nbgrader.preprocessors import ClearHiddenTests, ClearMarkScheme
from nbgrader.utils import capture_log
from traitlets.config import Config
from traitlets.config.loader import PyFileConfigLoader

from rbcourse.assignments.client import BoundedClient
from rbcourse.assignments.restore import grade_id, is_answer
from rbcourse.assignments.writing import write_whole
from rbcourse.course.notebooks import KERNEL

# what a student needs of environment.txt
NEEDED = ["numpy", "scipy", "matplotlib", "pillow", "anywidget", "ipykernel", "ipywidgets"]
NEEDED += ["jupyterlab", "nbclient", "nbformat", "tqdm"]
LEFTOVER = re.compile(
    r"#+ *(?:BEGIN|END)\b.*|(?:BEGIN|END) +(?:SOLUTION|HIDDEN|MARK)|MARK +SCHEME|HIDDEN +TESTS?",
    re.IGNORECASE,
)
REGION = re.compile(
    r"BEGIN (SOLUTION|HIDDEN TESTS|MARK SCHEME).*?\n(.*?)^[^\n]*END \1", re.M | re.S
)


def find_set(name: str, assignments: Path) -> Path:
    """Return the folder of a problem set; a private one goes before that of the course."""
    folders = [p for step in ("source", "private") for p in sorted(assignments.glob(f"{step}/*/"))]
    sets = {p.name: p for p in folders if (p / f"{p.name}.ipynb").is_file()}
    if name not in sets:
        there = ", ".join(sorted(sets)) or "none; this is run in the folder of the course"
        raise ValueError(f"There is no problem set {name}; there are: {there}.")
    return sets[name]


def read_config(assignments: Path) -> Config:
    """Return what nbgrader_config.py says."""
    if not (assignments / "nbgrader_config.py").is_file():
        return Config()
    return PyFileConfigLoader("nbgrader_config.py", path=str(assignments)).load_config()


def release(name: str, assignments: Path) -> dict[str, bytes]:
    """Return what ``nbgrader generate_assignment`` makes, checked to give nothing away.

    Neither the gradebook nor the folder of releases is touched.
    """
    source, config = find_set(name, assignments), read_config(assignments)
    with tempfile.TemporaryDirectory() as folder:
        shutil.copytree(source, Path(folder, "source", name))
        # nbgrader looks for nothing outside, and writes nowhere else
        config.CourseDirectory.root = os.path.realpath(folder)
        config.CourseDirectory.source_directory = "source"
        config.CourseDirectory.assignment_id = name
        config.GenerateAssignment.no_database = True
        config.SaveCells.enabled = False
        maker = GenerateAssignment(
            CourseDirectory(config=config), config=config, log=quiet_log("release")
        )
        done = capture_log(maker)
        if not done["success"]:
            raise ValueError(f"{name} cannot be released: {last_line(done)}")
        made = Path(folder, "release", name)
        files = {
            path.relative_to(made).as_posix(): path.read_bytes()
            for path in sorted(made.rglob("*"))
            if path.is_file()
        }
    _refuse_leaks(name, nbformat.read(source / f"{name}.ipynb", as_version=4), files)
    return files


def quiet_log(name: str) -> logging.Logger:
    """Return a log for nbgrader that is printed nowhere."""
    log = logging.getLogger(f"{__name__}.{name}")
    log.propagate = False
    log.addHandler(logging.NullHandler())
    return log


def last_line(done: dict[str, str]) -> str:
    """Return what went wrong in a run of nbgrader, as one line."""
    raised = re.findall(r"^ *([\w.]+(?:Error|Exception|Entry)): (.*)$", done.get("log", ""), re.M)
    refused = [what for kind, what in raised if kind.endswith("RefusedError")]
    lines = refused or [what for _, what in raised] or done["error"].strip().splitlines()[-1:]
    return lines[0]


def _refuse_leaks(name: str, source: NotebookNode, files: dict[str, bytes]) -> None:
    """Raise a ValueError if a file contains solutions, hidden tests or mark schemes."""
    released = nbformat.reads(files[f"{name}.ipynb"].decode(), as_version=4)
    for cell in released.cells:
        left = LEFTOVER.search(cell.source)
        fault = f"{left[0].strip()!r} is left over" if left else ""
        if cell.get("outputs") or cell.get("execution_count"):
            fault = "outputs are left"
        elif cell.get("attachments") and is_answer(cell):
            fault = "nbgrader leaves the attachment of an answer there"
        if fault:
            raise ValueError(f"{name}, cell {grade_id(cell) or cell.get('id')}: {fault}")
    secrets = [*map(re.escape, secret_lines(source)), LEFTOVER.pattern]
    for path, content in files.items():
        text = content.decode("utf-8", errors="replace")
        if path.endswith(".ipynb"):
            if path != f"{name}.ipynb":
                raise ValueError(f"{name}: {path} is a second notebook; a set has one")
            text = "\n".join(_strings(json.loads(text)))
        if shown := re.search("|".join(secrets), text, LEFTOVER.flags):
            raise ValueError(f"{name}: {path} gives away {shown[0]!r}")


def secret_lines(notebook: NotebookNode, *, solutions: bool = True) -> list[str]:
    """Return the lines inside the regions that nbgrader removes, except short and common ones."""
    inside: set[str] = set()
    for cell in notebook.cells:
        for kind, region in REGION.findall(cell.source):
            if solutions or kind != "SOLUTION" or cell.cell_type == "markdown":
                inside |= {line.strip() for line in region.splitlines()}
    texts = [REGION.sub("", cell.source) for cell in notebook.cells]
    outside = {line.strip() for text in texts for line in text.splitlines()}
    return sorted(
        line
        for line in inside - outside
        if len(line) >= 12 and not line.startswith(("import ", "from ", "raise "))
    )


def _strings(value: object) -> list[str]:
    if isinstance(value, dict):
        return [text for pair in value.items() for part in pair for text in _strings(part)]
    if isinstance(value, list):
        return [text for part in value for text in _strings(part)]
    return [value] if isinstance(value, str) else []


def student_requirements(environment: str, wheel: str) -> str:
    """Return the requirements of the students."""
    pins = dict(
        re.findall(r"^(([\w-]+)==\S+)", line)[0][::-1]
        for line in environment.splitlines()
        if "==" in line
    )
    missing = [name for name in NEEDED if name not in pins]
    if missing:
        raise ValueError(f"environment.txt has no pin for {', '.join(missing)}")
    return "".join(f"{line}\n" for line in [*(pins[name] for name in NEEDED), f"./{wheel}"])


def build_wheel(course: Path) -> tuple[str, bytes]:
    """Build the package, the same byte for byte each time; nothing is asked for outside."""
    with tempfile.TemporaryDirectory() as folder:
        code = "import sys; from flit_core import buildapi; buildapi.build_wheel(sys.argv[1])"
        subprocess.run(
            [sys.executable, "-c", code, folder],
            cwd=course,
            env={**os.environ, "SOURCE_DATE_EPOCH": "315532800"},  # the first day a zip knows
            check=True,
            capture_output=True,
        )
        (built,) = Path(folder).glob("*.whl")
        return built.name, built.read_bytes()


def make_handout(name: str, assignments: Path, course: Path) -> Path:
    """Write ``handouts/NAME.zip``, which is what the students get; the same bytes each time."""
    files = release(name, assignments)
    wheel, content = build_wheel(course)
    environment = (course / "environment.txt").read_text("utf-8")
    readme = Path(__file__).with_suffix(".txt").read_text("ascii")
    own = {
        f"original/{name}.ipynb": files[f"{name}.ipynb"],
        "requirements.txt": student_requirements(environment, wheel).encode(),
        "README.txt": readme.format(name=name).replace("\n", "\r\n").encode("ascii"),
        wheel: content,
    }
    if files.keys() & own.keys():
        raise ValueError(
            f"{name}: {min(files.keys() & own.keys())} is a name that the handout needs"
        )
    packed = io.BytesIO()
    with ZipFile(packed, "w") as archive:
        for path, data in sorted({**files, **own}.items()):
            entry = ZipInfo(f"{name}/{path}")  # of the first day a zip knows
            entry.create_system, entry.external_attr = 3, 0o644 << 16
            archive.writestr(entry, data, compress_type=ZIP_DEFLATED)
    return write_whole(assignments / "handouts" / f"{name}.zip", packed.getvalue())


def make_solutions(name: str, assignments: Path) -> Path:
    """Write ``handouts/NAME-solutions.ipynb``: the model answers, run, for after the deadline.

    Hidden tests and mark schemes are left out.
    """
    notebook = nbformat.read(find_set(name, assignments) / f"{name}.ipynb", as_version=4)
    for step in (ClearHiddenTests(), ClearMarkScheme()):
        notebook, _ = step.preprocess(notebook, {})
    for cell in notebook.cells:
        cell.source = re.sub(r"^.*### (BEGIN|END) SOLUTION.*\n?", "", cell.source, flags=re.M)
        cell.source = re.sub(r"\s*^\*\*Mark scheme\b.*", "", cell.source, flags=re.M | re.S)
        cell.metadata = NotebookNode()
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        client = BoundedClient(notebook, kernel_name=KERNEL["name"])
        client.folder, client.allow_errors = Path(folder), False
        client.execute(cwd=folder)
    notebook.metadata = NotebookNode({"kernelspec": dict(KERNEL)})
    target = assignments / "handouts" / f"{name}-solutions.ipynb"
    return write_whole(target, (nbformat.writes(notebook) + "\n").encode())


def main() -> None:
    """Make a handout from the command line, in the folder of the course."""
    parser = argparse.ArgumentParser(prog="python -m rbcourse.assignments.handout")
    parser.add_argument("set", help="its name: ps1")
    parser.add_argument("--solutions", action="store_true", help="the model answers")
    known, assignments = parser.parse_args(), Path("notebooks", "assignments")
    try:
        if known.solutions:
            print(make_solutions(known.set, assignments))
        else:
            print(make_handout(known.set, assignments, Path()))
    except (OSError, ValueError, CellExecutionError) as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main()
