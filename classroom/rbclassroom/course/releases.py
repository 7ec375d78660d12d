"""Run the tests with the oldest or newest releases that the distributions allow."""

import argparse
import os
import subprocess
import sys
from pathlib import Path

RANGES = ["-e", ".[draw,test]", "-e", "./classroom[lessons,grading]"]
# the stored outputs of the lessons belong to the releases of environment.txt
TESTS = ["-n", "auto", "--dist", "loadfile", "--no-loadscope-reorder"]
TESTS += ["--deselect=notebooks", "--deselect=tests/test_notebooks.py"]


def main() -> None:
    """Make .venv-oldest or .venv-newest anew, in the folder of the course, and test in it."""
    parser = argparse.ArgumentParser(
        prog="course.py releases", epilog="Further arguments go to pytest."
    )
    parser.add_argument("which", choices=["oldest", "newest"])
    known, words = parser.parse_known_args()
    if known.which == "oldest" and sys.version_info >= (3, 13):
        sys.exit("The oldest releases exist for Python 3.11 and 3.12 only: call one of these.")
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
