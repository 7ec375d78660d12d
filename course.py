# /// script
# requires-python = ">=3.11"
# ///
"""Run a task of the course: python3 course.py TASK ...

The first task makes the environment .venv from environment.txt; later tasks extend it.
If environment.txt changes or the folder is moved, .venv is made again.
"""

import sys

if sys.version_info < (3, 11):
    sys.exit(
        "rbcourse needs Python 3.11 or newer, and this is Python %d.%d (%s)."
        % (sys.version_info[0], sys.version_info[1], sys.executable)
    )

import ast
import hashlib
import json
import os
import shutil
import subprocess
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent
VENV = ROOT / ".venv"
UV = os.environ.get("UV") or shutil.which("uv")
LISTS = {  # lists of exact versions; an environment needs its own list and all lists before it
    "lessons": "environment.txt",
    "teach": "classroom/environment-teach.txt",
    "book": "classroom/environment-book.txt",
    "test": "tests/environment-test.txt",
}
PYTEST = "pytest -n auto --dist loadfile --no-loadscope-reorder"
BROWSER = "pytest -n auto --dist worksteal classroom/tests/browser"
TASKS = {  # the environment, commands and help of each task; the last command gets arguments
    "lab": ("lessons", ["rbclassroom.course.lab"], "open the lessons in JupyterLab"),
    "check": ("lessons", ["rbclassroom.assignments.check"], "check a problem set: check FILE"),
    "book": ("book", ["rbclassroom.book.build"], "write the course as web pages, in book/"),
    "lecture": ("book", ["rbclassroom.lecture.serve"], "show slides to a class: lecture 01"),
    "handout": ("teach", ["rbclassroom.assignments handout"], "pack a problem set: handout ps1"),
    "collect": ("teach", ["rbclassroom.assignments collect"], "sort LMS downloads: collect FOLDER"),
    "grade": ("teach", ["rbclassroom.assignments grade"], "grade collected submissions: grade ps1"),
    "test": ("test", [PYTEST], "run the tests and the lessons"),
    "releases": ("test", ["rbclassroom.course.releases"], "test with oldest or newest releases"),
    "hostile": ("test", [PYTEST + " classroom/tests/hostile"], "grade harmful submissions"),
    "browser": ("test", ["rbclassroom.book.build --live", BROWSER], "test pages in Chromium"),
    "figures": ("lessons", ["rbclassroom.explorers.recorded"], "run lessons again; store changes"),
    "ledger": ("test", ["rbclassroom.course.ledger"], "write docs/ledger.md"),
    "atlas": ("lessons", ["rbclassroom.surveys.body_atlas"], "compute the atlas of real bodies"),
    "bench": ("test", ["benchmarks"], "compare times with other packages"),
    "lint": ("test", ["ruff check", "ruff format --check", "mypy"], "check style and types"),
    "lock": ("test", ["rbclassroom.course.lock"], "write the lists of exact versions"),
}
PATHS = "check", "collect"  # tasks that take a path, relative to the terminal's folder
PLAIN = "ledger", "atlas", "bench"  # tasks without further arguments


class SetUpError(Exception):
    """A set-up command has failed; the message is the end of its output."""


def main():
    """Set up the environment of a task, and run the task."""
    task, words = (sys.argv[1:] or ["--help"])[0], sys.argv[2:]
    if task in ("-h", "--help"):
        print(__doc__)
        print("\n".join("  %-9s %s" % (name, TASKS[name][-1]) for name in TASKS))
        print("\n'python3 course.py TASK --help' lists the options of a task.")
        return
    if task not in TASKS:
        print("There is no task %r. Choose from: %s." % (task, ", ".join(TASKS)), file=sys.stderr)
        sys.exit(2)
    if words and task in PLAIN:
        sys.exit("'course.py %s' takes no options, got: %s" % (task, " ".join(words)))
    if task in PATHS:
        words = [os.path.abspath(word) if os.path.exists(word) else word for word in words]
    environment, commands, _ = TASKS[task]
    set_up(environment)
    if "pytest" in commands[-1]:  # each worker uses one processor, so one thread is enough
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
        # with this variable, each process would compile all modules again
        os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    for command in commands:
        run(*command.split(), *(words if command is commands[-1] else []))


def run(*words):
    """Run a module with the Python of .venv, in the course's folder; exit if the module fails.

    Ctrl-C also reaches the module, and this function waits until the module ends.
    """
    job = subprocess.Popen([python(), "-m"] + list(words), cwd=ROOT)
    while True:
        try:
            code = job.wait()
            break
        except KeyboardInterrupt:
            pass
    if code:
        sys.exit(code)


def set_up(environment):
    """Make .venv if necessary, and install the distributions of an environment."""
    names = list(LISTS)[: list(LISTS).index(environment) + 1]
    wanted = {name: fingerprint(ROOT / LISTS[name]) for name in names}
    found = read_stamp()
    if not found or found.get("lessons") != wanted["lessons"] or not os.path.exists(python()):
        create(found)
        found = {}
    missing = [name for name in names if found.get(name) != wanted[name]]
    if missing:
        print("Installing", ", ".join(LISTS[name] for name in missing), end=" ", flush=True)
        install(*[word for name in missing for word in ("-r", LISTS[name])])
        if "lessons" in missing:
            patiently(python(), "-c", "import matplotlib.pyplot")  # it searches for fonts once
        write_stamp(dict(found, **{name: wanted[name] for name in missing}))
        print(" done.", flush=True)


def create(found):
    """Make an empty .venv in place of the existing one."""
    if found is None and os.path.lexists(VENV):
        delete = "Remove-Item -Recurse" if os.name == "nt" else "rm -r"
        sys.exit(
            ".venv was not made by course.py. Move it away, or delete it with '%s \"%s\"', and "
            "try again." % (delete, VENV)
        )
    if Path(sys.prefix).resolve() == VENV.resolve():
        sys.exit(
            "The environment has to be made again, but this Python belongs to it. Leave it with "
            "'deactivate', or call %s course.py." % getattr(sys, "_base_executable", "python3")
        )
    try:
        if VENV.exists():
            shutil.rmtree(VENV)
    except OSError as error:
        sys.exit(".venv is in use (%s). Close JupyterLab and try again." % error)
    VENV.mkdir()
    write_stamp({"unfinished": True})  # for the next run, if this run is interrupted
    print("Making .venv", end=" ", flush=True)
    if UV:
        how = "--seed", "--allow-existing", "--python", sys.executable
        patiently(UV, "venv", *how, VENV)
    else:
        patiently(sys.executable, "-m", "venv", VENV)
    print(" done.", flush=True)


def install(*words):
    """Install distributions into .venv with uv, or with pip if uv fails."""
    pip = python(), "-m", "pip"
    uv, settings = UV, {}
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        try:
            if not uv:
                where = "--only-binary", ":all:", "--target", folder
                patiently(*pip, "install", "--disable-pip-version-check", *where, "uv")
                uv, settings = os.path.join(folder, "bin", "uv"), settings_of_pip(*pip)
            patiently(uv, "pip", "install", "--python", python(), *words, **settings)
        except (SetUpError, OSError):
            quick = "--disable-pip-version-check", "--no-compile"
            patiently(*pip, "install", *quick, *words)


def settings_of_pip(*pip):
    """Return pip's indexes and certificates as environment variables for uv."""
    names = {
        "index-url": "UV_DEFAULT_INDEX",
        "extra-index-url": "UV_INDEX",
        "find-links": "UV_FIND_LINKS",
        "cert": "SSL_CERT_FILE",
    }
    listed = subprocess.run(pip + ("config", "list"), stdout=subprocess.PIPE, text=True).stdout
    settings = {"UV_INDEX_STRATEGY": "unsafe-best-match"}  # all indexes are alike, as for pip
    for key, _, value in (line.partition("=") for line in listed.splitlines()):
        name = names.get(key.rpartition(".")[2])
        if name:
            settings[name] = " ".join(ast.literal_eval(value).split())
    return settings


def python():
    """Return the path of the Python in .venv."""
    return str(VENV / ("Scripts/python.exe" if os.name == "nt" else "bin/python"))


def patiently(*command, **settings):
    """Run a command and print a dot every two seconds; raise `SetUpError` if the command fails.

    Like pip, uv uses the system's certificates, which include those of a school's network.
    """
    uv = {"UV_PYTHON_DOWNLOADS": "never", "UV_SYSTEM_CERTS": "true", "UV_NATIVE_TLS": "true"}
    environment = dict(dict(uv, **settings), **dict(os.environ, PIP_USER="0"))
    with tempfile.TemporaryFile("w+", errors="replace") as output:
        words = list(map(str, command))
        job = subprocess.Popen(words, cwd=ROOT, env=environment, stdout=output, stderr=output)
        while True:
            try:
                job.wait(timeout=2)
                break
            except subprocess.TimeoutExpired:
                print(".", end="", flush=True)
        if job.returncode:
            output.seek(0)
            raise SetUpError("".join(output.readlines()[-25:]))


def read_stamp():
    """Return the record of the installed lists, or None if course.py did not make .venv."""
    try:
        return json.loads((VENV / "made-by-course.txt").read_text())
    except FileNotFoundError:
        return None
    except ValueError:  # the stamp is from an earlier version of course.py
        return {}


def write_stamp(content):
    """Record the lists that are installed into .venv."""
    (VENV / "made-by-course.txt").write_text(json.dumps(content))


def fingerprint(path):
    """Return a text that changes if the file or the path of the course changes."""
    return hashlib.sha256(path.read_bytes() + str(ROOT).encode("utf-8", "replace")).hexdigest()


if __name__ == "__main__":
    try:
        main()
    except SetUpError as error:
        print("\n%s" % error)
        sys.exit("The set-up failed; README.md, 'When something goes wrong', may help.")
    except KeyboardInterrupt:
        sys.exit(130)
