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
import contextlib
import errno
import hashlib
import json
import os
import runpy
import shutil
import signal
import subprocess
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent
VENV = ROOT / ".venv"
DISCARDED = ROOT / ".venv-discarded"  # the environment that is being replaced
OPTIONS = ROOT / "classroom/rbclassroom/course/options.py"
STAMP = "made-by-course.txt"  # in .venv; it names the installed lists
UV = os.environ.get("UV") or shutil.which("uv")
LISTS = {  # lists of exact versions; an environment needs its own list and all lists before it
    "lessons": "environment.txt",
    "teach": "classroom/environment-teach.txt",
    "book": "classroom/environment-book.txt",
    "test": "tests/environment-test.txt",
}
PYTEST = "pytest -n auto --dist loadfile --no-loadscope-reorder"
TASKS = {  # the environment, commands and purpose of each task; the last command gets arguments
    "lab": ("lessons", ["rbclassroom.course.lab"], "open the lessons of the course in JupyterLab"),
    "check": ("lessons", ["rbclassroom.assignments.check"], "check a problem set: check FILE"),
    "book": ("book", ["rbclassroom.book.build"], "write the course as web pages, in book/"),
    "lecture": ("book", ["rbclassroom.lecture.serve"], "show slides to a class: lecture 01"),
    "handout": ("teach", ["rbclassroom.assignments handout"], "pack a problem set: handout ps1"),
    "collect": ("teach", ["rbclassroom.assignments collect"], "sort LMS downloads: collect FOLDER"),
    "grade": ("teach", ["rbclassroom.assignments grade"], "grade collected submissions: grade ps1"),
    "test": ("test", [PYTEST], "run all tests, or the tests in PATHS"),
    "figures": ("lessons", ["rbclassroom.course.figures"], "draw all figures again"),
    "lint": ("test", ["ruff check", "ruff format --check", "mypy"], "check style and types"),
}
PATHS = "check", "collect", "test"  # tasks with paths, relative to the terminal's folder
OFFLINE = "connection", "name resolution", "getaddrinfo", "timed out"  # words of pip


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
    environment, commands, purpose = TASKS[task]
    given, _ = runpy.run_path(str(OPTIONS))["parse"](task, words, purpose)  # --help ends here
    check_names(given)
    if task in PATHS and Path.cwd() != ROOT:
        words = [from_here(word) for word in words]
    set_up(environment)
    # matrices are small; on a busy machine, two threads take four times as long as one
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    if task in ("test", "figures"):
        # with this variable, each process would compile all modules again
        os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    for command in commands:
        run(*command.split(), *(words if command is commands[-1] else []))


def check_names(given):
    """Exit if there is no problem set or lesson of a name, before packages are installed."""
    places = (ROOT / "notebooks" / "assignments").glob("*/*/*.ipynb")
    sets = sorted({path.stem for path in places if path.parts[-3] in ("source", "private")})
    lessons = sorted(path.name[:2] for path in (ROOT / "notebooks").glob("[0-9][0-9]_*.ipynb"))
    asked = [*getattr(given, "sets", []), getattr(given, "set", "")]
    numbers = [*getattr(given, "lessons", []), getattr(given, "lesson", "")]
    for known, names in (
        (sets, asked),
        (lessons, [number.zfill(2) for number in numbers if number]),
    ):
        for name in names:
            if known and name and name not in known:
                sys.exit("%s: one of %s is wanted" % (name, ", ".join(known)))


def from_here(word):
    """Return a notebook, an existing path, or a test in a file, as an absolute path."""
    is_path = word.endswith(".ipynb") or os.path.exists(word.partition("::")[0])
    return os.path.abspath(word) if is_path else word


def run(*words):
    """Run a module with the Python of .venv, in the course's folder; exit if the module fails.

    Ctrl-C also reaches the module, and this function waits until the module ends.
    """
    code = None
    try:
        job = subprocess.Popen([python(), "-m"] + list(words), cwd=ROOT)
        while code is None:
            with contextlib.suppress(KeyboardInterrupt):
                code = job.wait()
    except OSError:  # this Python cannot be run
        code = 1
    finally:
        if code is None:  # this process ends
            job.terminate()
    if code and count_files() < (read_stamp() or {}).get("files", 0):
        write_stamp({"unfinished": True})
        sys.exit("Files of .venv are missing. Run the command again: it makes .venv again.")
    if code:
        sys.exit(code)


def set_up(environment):
    """Make .venv if necessary, and install the distributions of an environment."""
    names = list(LISTS)[: list(LISTS).index(environment) + 1]
    wanted = {name: fingerprint(ROOT / LISTS[name]) for name in names}
    if not not_installed(read_stamp(), wanted):
        return
    with alone():
        found = read_stamp()  # another start may have changed it
        missing = not_installed(found, wanted)
        if "lessons" in missing:
            create(found)
            found = {}
        if missing:
            print("Installing", ", ".join(LISTS[name] for name in missing), end=" ", flush=True)
            install(*[word for name in missing for word in ("-r", LISTS[name])])
            link()
            if "lessons" in missing:
                patiently(python(), "-c", "import matplotlib.pyplot")  # it searches for fonts once
            installed = {name: wanted[name] for name in missing}
            write_stamp(dict(found, files=count_files(), **installed))
            print(" done.", flush=True)


def not_installed(found, wanted):
    """Return the lists that have to be installed: all lists if .venv has to be made again."""
    if not found or "files" not in found or not os.path.exists(python()):
        return list(wanted)
    renewed = found.get("lessons") != wanted["lessons"]
    return [name for name in wanted if renewed or found.get(name) != wanted[name]]


@contextlib.contextmanager
def alone():
    """Wait until no other start changes .venv; the lock ends at the latest with this process."""
    with open(str(VENV) + ".lock", "a") as file:
        if not lock(file):
            print("Waiting for another start of course.py, which makes .venv.", flush=True)
            while not lock(file):
                time.sleep(0.2)
        yield


def lock(file):
    """Try to lock a file for this process; tell whether this succeeded."""
    try:
        if os.name == "nt":
            import msvcrt

            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except (BlockingIOError, PermissionError):
        return False
    return True


def create(found):
    """Make an empty .venv in place of the existing one; if interrupted, the next start goes on."""
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
    shutil.rmtree(DISCARDED, ignore_errors=True)
    if VENV.exists():
        try:
            VENV.rename(DISCARDED)  # on Windows this fails, and nothing is lost, if .venv is in use
        except OSError as error:
            sys.exit(".venv is in use (%s). Close JupyterLab and try again." % error)
    VENV.mkdir()
    write_stamp({"unfinished": True})  # for the next run, if this run is interrupted
    shutil.rmtree(DISCARDED, ignore_errors=True)
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


def link():
    """Write relative paths to both packages, because Python 3.12 may not read UTF-8 here."""
    site = site_packages()
    for name, folder in (("rbcourse", ROOT), ("rbclassroom", ROOT / "classroom")):
        (site / (name + ".pth")).write_text(os.path.relpath(folder, site) + "\n")


def site_packages():
    """Return the folder in which the Python of .venv looks for packages."""
    code = "import sysconfig; print(sysconfig.get_path('purelib', 'venv', {'base': '.'}))"
    words = [python(), "-I", "-S", "-c", code]  # -S: before `link`, it may fail to read its paths
    return VENV / subprocess.check_output(words, text=True).strip()


def count_files():
    """Return the number of files that are installed in .venv; 0 if its Python cannot be run."""
    with contextlib.suppress(OSError, subprocess.SubprocessError):
        places = os.walk(site_packages())
        return sum(len(names) for place, _, names in places if "__pycache__" not in place)
    return 0


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
    if sys.flags.utf8_mode:  # uv calls Python with -I, which ignores PYTHONUTF8
        environment["LC_ALL"] = "C.UTF-8"
    with tempfile.TemporaryFile("w+", errors="replace") as output:
        streams = {"stdin": subprocess.DEVNULL, "stdout": output, "stderr": output}
        words = list(map(str, command))
        # in a session of their own, the command and its children can be ended together
        job = subprocess.Popen(words, cwd=ROOT, env=environment, start_new_session=True, **streams)
        try:
            while job.poll() is None:
                with contextlib.suppress(subprocess.TimeoutExpired):
                    job.wait(timeout=2)
                    break
                print(".", end="", flush=True)
        finally:
            if job.returncode is None:  # Ctrl-C, or this process ends
                job.kill() if os.name == "nt" else os.killpg(job.pid, signal.SIGKILL)
                job.wait()
        if job.returncode:
            output.seek(0)
            raise SetUpError("".join(output.readlines()[-25:]))


def read_stamp():
    """Return the record of the installed lists, or None if course.py did not make .venv."""
    try:
        content = json.loads((VENV / STAMP).read_text())
    except ValueError:  # the stamp is from an earlier version of course.py, or is incomplete
        return {}
    except OSError:
        is_empty = VENV.is_dir() and not os.listdir(VENV)  # a start was interrupted
        return {} if is_empty else None
    return content if isinstance(content, dict) else {}


def write_stamp(content):
    """Record the lists that are installed into .venv."""
    (VENV / STAMP).write_text(json.dumps(content))


def fingerprint(path):
    """Return a text that changes if the file or the path of the course changes."""
    return hashlib.sha256(path.read_bytes() + str(ROOT).encode("utf-8", "replace")).hexdigest()


if __name__ == "__main__":
    for number in (signal.SIGTERM, getattr(signal, "SIGHUP", signal.SIGTERM)):
        if signal.getsignal(number) == signal.SIG_DFL:  # "nohup" sets SIG_IGN
            signal.signal(number, lambda *_: sys.exit(143))
    try:
        main()
    except (SetUpError, OSError) as error:
        if isinstance(error, SetUpError) and any(word in str(error) for word in OFFLINE):
            sys.exit(
                "\nThe packages could not be downloaded. Connect this computer to the internet (or "
                "set HTTPS_PROXY if there is a proxy), and run the command again. pip says: %s"
                % str(error).strip().split("\n")[0][:200]
            )
        print("\n%s" % error)
        if getattr(error, "errno", None) in (errno.EACCES, errno.EPERM, errno.EROFS):
            print("Copy the course to a folder in which you can write.")
        sys.exit("The set-up failed; docs/set_up.md, 'Messages', may help.")
    except KeyboardInterrupt:
        print("\nThe set-up was stopped. The next start continues it.")
        sys.exit(130)
