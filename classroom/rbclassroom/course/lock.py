"""Write the lists of exact versions that course.py installs, from the ranges in pyproject.toml.

``python -m rbclassroom.course.lock`` keeps the present versions if possible; with ``--upgrade``, it
takes the newest ones.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

from rbcourse.files import replace_file

COURSE = "-e .[draw]\n-e ./classroom[lessons]\n"
LISTS = {  # what each list adds to the lists before it
    "environment.txt": COURSE,
    "classroom/environment-teach.txt": "-e ./classroom[grading]\n",
    "classroom/environment-book.txt": "-e ./classroom[book]\n",
    "tests/environment-test.txt": "-e .[test,lint]\n-e ./classroom[browser]\n",
}
SLOW = "jsonschema<4.25\n"  # later releases need 1.5 s more for their import
HEAD = "# Exact versions, for every system and Python; written by rbclassroom.course.lock.\n"


def compiled(wanted: str, preferred: str, *words: str) -> list[str]:
    """Return a line for each required distribution, with the preferred version if possible."""
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder, "output.txt")
        output.write_text(preferred, "utf-8")
        command = [sys.executable, "-m", "uv", "pip", "compile", "--universal", "--no-header"]
        command += ["--annotation-style", "line", "--python-version", "3.11", "--quiet"]
        command += [*words, "-o", str(output), "-"]
        subprocess.run(command, input=wanted + SLOW, text=True, check=True)
        return output.read_text("utf-8").splitlines()


def main() -> None:
    """Write all lists into the folder of the course, which is the current one."""
    now = "".join(Path(name).read_text("utf-8") for name in LISTS if Path(name).exists())
    now = "\n".join(compiled("".join(LISTS.values()), now, *sys.argv[1:]))
    wanted, there = "", set[str]()
    for name, more in LISTS.items():
        wanted += more
        lines = [line for line in compiled(wanted, now) if _pin(line) not in there]
        there.update(map(_pin, lines))
        replace_file(name, (HEAD + "\n".join(lines) + "\n").encode())
        print(f"{name}: {len(lines)} distributions")


def _pin(line: str) -> str:
    return line.partition("#")[0].strip()


if __name__ == "__main__":
    main()
