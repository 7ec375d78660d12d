"""Run the tests with the oldest or newest releases that our distributions allow."""

import os
import subprocess
import sys
from pathlib import Path

from rbclassroom.course import options

RANGES = ["-e", ".[draw,test]", "-e", "./classroom[lessons,grading]"]
# lessons are not tested, because their outputs were stored with the releases of environment.txt
TESTS = ["-n", "auto", "--dist", "loadfile", "--no-loadscope-reorder"]
TESTS += ["--deselect=notebooks", "--deselect=tests/test_notebooks.py"]
TESTS += [f"--ignore=classroom/tests/{name}" for name in ("browser", "hostile", "hub")]


def main() -> None:
    """Make a new .venv-oldest or .venv-newest in the current folder, and run the tests in it."""
    known, words = options.parse("releases")
    if known.which == "oldest" and sys.version_info >= (3, 13):
        sys.exit("The oldest releases exist only for Python 3.11 and 3.12; use one of these.")
    venv, uv = Path(f".venv-{known.which}"), [sys.executable, "-m", "uv"]
    python = venv / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    oldest = ["--resolution", "lowest-direct"] * (known.which == "oldest")
    for command in (
        [*uv, "venv", "--clear", "--python", sys.executable, str(venv)],
        [*uv, "pip", "install", "--python", str(python), *oldest, *RANGES],
        [str(python), "-m", "pytest", *TESTS, *words],
    ):
        if code := subprocess.run(command).returncode:
            sys.exit(code)


if __name__ == "__main__":
    main()
