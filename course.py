"""Every task of the course, for who learns, who teaches, and who works on it.

The first call makes the environment .venv from environment.txt; later calls use it. When
environment.txt changes or the folder is moved, .venv is made anew.
"""

from __future__ import print_function

import sys

if sys.version_info < (3, 11):
    sys.exit(
        "rbcourse needs Python 3.11 or newer, and this is Python %d.%d (%s)."
        % (sys.version_info[0], sys.version_info[1], sys.executable)
    )

import argparse
import hashlib
import json
import os
import re
import shutil
import subprocess
import tempfile
import tomllib
from datetime import date
from pathlib import Path

ROOT = Path(__file__).resolve().parent
VENV = ROOT / ".venv"
UV = shutil.which("uv")
TOO_NEW = sys.version_info >= (3, 13)  # for the oldest releases
EXTRAS = {"": "draw,test", "classroom": "lessons,lecture,grading"}  # whose ranges are tested
DARK = """[data-jp-theme-light="false"] :is(figure, .rbcourse-explorer) :is(img, canvas) {
  filter: invert(0.93) hue-rotate(180deg);
}
"""
STILLS = """from rbclassroom.course.notebooks import before_saving
get_config().ContentsManager.pre_save_hook = before_saving
"""
CHROMIUM = ("chromium", "chromium-browser", "google-chrome", "msedge")


class SetUpError(Exception):
    """A command of the set-up has failed; its last words."""


def main():
    """Read the command line, set up what is missing, do the task."""
    parser = argparse.ArgumentParser(prog="course.py", description=__doc__.splitlines()[0])
    tasks = parser.add_subparsers(dest="task", required=True, metavar="TASK")
    figures = tasks.add_parser("figures", help="run lessons again; rewrite what has changed")
    help_ = "its number, such as 03; by default all lessons and the explorers"
    figures.add_argument("lessons", nargs="*", metavar="LESSON", help=help_)
    test = tasks.add_parser("test", help="run every test, lessons too; further words go to pytest")
    releases = test.add_mutually_exclusive_group()
    for name in ("oldest", "newest"):
        help_ = "with the %s releases that pyproject.toml allows; without the lessons" % name
        releases.add_argument(
            "--" + name, dest="releases", action="store_const", const=name, help=help_
        )
    lab = tasks.add_parser("lab", help="open the lessons; further words go to JupyterLab")
    lab.add_argument("--edit", action="store_true", help="the originals, not the copies in work/")
    lecture = tasks.add_parser("lecture", help="show a lesson to a class, large and without code")
    lecture.add_argument("lesson", help="its number: 01")
    lecture.add_argument("--check", action="store_true", help="try it before class; show nothing")
    lecture.add_argument("--no-browser", action="store_true", help="print the address only")
    help_ = "phones in the class network vote on polls, at this address of the machine"
    lecture.add_argument("--votes", nargs="?", const="", metavar="ADDRESS", help=help_)
    check = tasks.add_parser("check", help="try a problem set, and write the file to hand in")
    check.add_argument("file", type=os.path.abspath, help="the notebook: ps1.ipynb")
    handout = tasks.add_parser("handout", help="pack a problem set for students")
    handout.add_argument("set", help="its name: ps1")
    handout.add_argument("--solutions", action="store_true", help="the model answers instead")
    collect = tasks.add_parser("collect", help="sort what Moodle and Canvas give you")
    collect.add_argument("folder", type=os.path.abspath, help="with the downloads")
    collect.add_argument("--due", help='what is later is listed: "2026-12-01 23:59"')
    grade = tasks.add_parser("grade", help="grade what was collected; write feedback and a table")
    grade.add_argument("sets", nargs="*", metavar="set", help="ps1; without, all there are")
    grade.add_argument("--require-box", action="store_true", help="refuse to grade without a box")
    tasks.add_parser("hostile", help="grade submissions that mean harm; further words go to pytest")
    tasks.add_parser("browser", help="try all pages in Chromium; further words go to pytest")
    book = tasks.add_parser("book", help="make pages of everything, in book/, to be read anywhere")
    book.add_argument("--serve", action="store_true", help="show them in the browser")
    help_ = "where Binder finds the lessons on GitHub"
    book.add_argument("--repository", default="", metavar="OWNER/NAME", help=help_)
    tasks.add_parser("ledger", help="rewrite docs/ledger.md: where each equation is to be found")
    tasks.add_parser("atlas", help="compute the atlas of real bodies anew; goes on when stopped")
    tasks.add_parser("bench", help="time the package beside others; rewrite benchmarks/")
    tasks.add_parser("lint", help="check style and types of all code")
    if len(sys.argv) == 1:
        parser.print_help()
        return
    known, further = parser.parse_known_args()
    # the tests start about a hundred processes, which would all compile what they import
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    if further and known.task not in ("test", "lab", "browser", "hostile"):
        parser.error("%s takes no %s" % (known.task, " ".join(further)))
    if known.task == "test" and known.releases:
        venv = set_up_range(known.releases)
        # what the lessons store belongs to the releases of environment.txt
        stored = ["--deselect=notebooks", "--deselect=tests/test_notebooks.py"]
        test_in(venv, *(stored + further))
        return
    set_up()
    if known.task == "figures":
        run("-m", "rbclassroom.course.notebooks", "regenerate", *known.lessons)
        if not known.lessons:
            run("-m", "rbclassroom.explorers.recorded", "figures/explorers")
    elif known.task == "test":
        test_in(VENV, *further)
    elif known.task == "lab":
        open_lab(known.edit, further)
    elif known.task == "lecture":
        if known.check:
            run("-m", "rbclassroom.course.rehearsal", known.lesson)
        else:
            words = ["--no-browser"] * known.no_browser
            if known.votes is not None:
                words += ["--votes", known.votes] if known.votes else ["--votes"]
            run("-m", "rbclassroom.course.lecture", known.lesson, *words)
    elif known.task == "check":
        run("-m", "rbclassroom.assignments.check", known.file)
    elif known.task == "handout":
        run(
            "-m",
            "rbclassroom.assignments",
            "handout",
            known.set,
            *["--solutions"] * known.solutions,
        )
    elif known.task == "collect":
        due = ["--due", known.due] if known.due else []
        run("-m", "rbclassroom.assignments", "collect", known.folder, *due)
    elif known.task == "grade":
        box = ["--require-box"] * known.require_box
        run("-m", "rbclassroom.assignments", "grade", *(known.sets + box))
    elif known.task == "hostile":
        install_package("bwrap", "bubblewrap")
        test_in(VENV, "classroom/tests/hostile", *further)
    elif known.task == "browser":
        look_in_browser(further)
    elif known.task == "book":
        set_up_extra("book")
        words = ["--repository", known.repository] if known.repository else []
        run("-m", "rbclassroom.book.build", *(words + ["--serve"] * known.serve))
    elif known.task == "ledger":
        run("-m", "rbclassroom.course.ledger")
    elif known.task == "atlas":
        run("-m", "rbclassroom.surveys.body_atlas")
    elif known.task == "bench":
        set_up_peers()
        run("-m", "benchmarks")
    else:
        set_up_extra("lint")
        run("-m", "ruff", "check")
        run("-m", "ruff", "format", "--check")
        run("-m", "mypy")


def run(*words):
    """Run Python in .venv."""
    run_in(VENV, *words)


def run_in(venv, *words):
    """Run Python in an environment, in the folder of the course; stop if it fails.

    Ctrl-C reaches the job too, and the job decides: JupyterLab asks first.
    """
    job = subprocess.Popen([str(python(venv))] + list(words), cwd=ROOT)
    while True:
        try:
            code = job.wait()
            break
        except KeyboardInterrupt:
            pass
    if code:
        sys.exit(code)


def test_in(venv, *words):
    """Run the tests: a worker for each processor, with one thread each.

    File by file in their order: what is short comes last, and fills what time is left.
    """
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    files = ("--dist", "loadfile", "--no-loadscope-reorder")
    run_in(venv, "-m", "pytest", "-n", "auto", *(files + words))


def open_lab(edit, further):
    """Open JupyterLab on lesson 00; a root user need not be told what he is."""
    if edit:
        os.environ["RBCOURSE_EDIT"] = "1"
    else:
        run("-m", "rbclassroom.course.notebooks", "copy")
    folder = "notebooks" if edit else "work"
    words = ["--ServerApp.root_dir=%s" % ROOT, "--log-level=ERROR"]
    words.append("--LabApp.default_url=/lab/tree/%s/00_start_here.ipynb" % folder)
    if hasattr(os, "geteuid") and os.geteuid() == 0:
        words.append("--allow-root")
    paths = [str(set_up_lab()), os.environ.get("JUPYTER_CONFIG_PATH")]
    os.environ["JUPYTER_CONFIG_PATH"] = os.pathsep.join(filter(None, paths))
    print("JupyterLab opens in the browser. Stop it here, with Ctrl-C.", flush=True)
    # of what its own extensions use, not of what kernels run; it reads its configuration twice
    quiet = ["-W", "ignore::DeprecationWarning", "-W", "ignore:Overriding existing pre_save_hook"]
    run(*(quiet + ["-m", "jupyterlab"] + words + further))


def set_up_lab():
    """Tell JupyterLab to ask for no news and to show names in full; return its configuration.

    That leaves out nbgrader and Voila, which are for teachers, encrypts what kernels send, makes
    pictures dark in a dark theme, and saves explorers as stills.
    """
    quiet = {"fetchNews": "false", "checkForUpdates": False}
    plain = {"showLastModifiedColumn": False}
    overrides = {
        "@jupyterlab/apputils-extension:notification": quiet,
        "@jupyterlab/filebrowser-extension:browser": plain,
    }
    write_json(VENV / "share" / "jupyter" / "lab" / "settings" / "overrides.json", overrides)
    configuration = VENV / "share" / "rbcourse"
    teachers = "@jupyter/nbgrader", "@voila-dashboards/jupyterlab-preview"
    without = {"disabledExtensions": dict.fromkeys(teachers, True)}
    write_json(configuration / "labconfig" / "page_config.json", without)
    parts = "formgrader", "validate_assignment", "assignment_list", "course_list"
    off = {"nbgrader.server_extensions." + part: False for part in parts}
    off["voila.server_extension"] = False
    server = {"jpserver_extensions": off}
    style = configuration / "custom" / "custom.css"
    style.parent.mkdir(parents=True, exist_ok=True)
    style.write_text(DARK)
    server["tornado_settings"] = {"static_custom_path": [str(style.parent)]}
    server["answer_yes"] = True  # so that Ctrl-C ends it at once
    settings = {"ServerApp": server, "LabApp": {"log_level": "ERROR", "custom_css": True}}
    settings["KernelManager"] = {"transport_encryption": "auto"}
    write_json(configuration / "jupyter_server_config.json", settings)
    (configuration / "jupyter_server_config.py").write_text(STILLS)
    return configuration


def write_json(path, content):
    """Write a file, and the folders that it is in."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(content))


def look_in_browser(further):
    """Make the book; try every page, lesson and explorer in a browser."""
    set_up_extra("browser")
    set_up_extra("book")
    run("-m", "rbclassroom.book.build")
    os.environ["CHROMIUM"] = find_chromium()
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    set_up_lab()
    run("-m", "pytest", "-n", "auto", "--dist", "worksteal", "classroom/tests/browser", *further)


def set_up():
    """Make .venv, from environment.txt."""
    wanted = fingerprint([ROOT / "environment.txt"], ROOT)
    make(VENV, wanted, "-r", "environment.txt")


def set_up_range(releases):
    """Make .venv-oldest or .venv-newest, anew each day, for there may be newer releases."""
    if releases == "oldest" and TOO_NEW:
        sys.exit("The oldest releases are to be had for Python 3.11 and 3.12: call one of these.")
    venv = ROOT / (".venv-" + releases)
    words = [word for place in EXTRAS for word in ("-e", "./%s[%s]" % (place, EXTRAS[place]))]
    words += lower_bounds() if releases == "oldest" else []
    make(venv, fingerprint(projects(), ROOT, date.today()), *words)
    return venv


def projects():
    """Return the files that say what each distribution requires."""
    return [ROOT / place / "pyproject.toml" for place in EXTRAS]


def lower_bounds():
    """Return what the distributions require, each at the lower bound of its range."""
    ranges = []
    for path, extras in zip(projects(), EXTRAS.values(), strict=True):
        project = tomllib.loads(path.read_text(encoding="utf-8"))["project"]
        ranges += project["dependencies"]
        for name in extras.split(","):
            ranges += project["optional-dependencies"][name]
    return [re.sub(">=([^,]+).*", r"==\1", line) for line in ranges if ">=" in line]


def make(venv, wanted, *words):
    """Make an environment if it is not there, was left unfinished, or is not the one wanted."""
    stamp = venv / "made-by-course.txt"
    found = stamp.read_text() if stamp.exists() else None
    if found == wanted and python(venv).exists():
        return
    if found is None and os.path.lexists(venv):
        delete = "Remove-Item -Recurse" if os.name == "nt" else "rm -r"
        sys.exit(
            "%s was not made by course.py. Move it away, or delete it with '%s \"%s\"'; then try "
            "again." % (venv.name, delete, venv)
        )
    if Path(sys.prefix).resolve() == venv.resolve():
        sys.exit(
            "The environment has to be made anew, and this Python is in it: leave it with "
            "'deactivate', or call %s course.py." % getattr(sys, "_base_executable", "python3")
        )
    print("Setting up %s; about a minute" % venv.name, end="", flush=True)
    try:
        if venv.exists():
            shutil.rmtree(venv)
    except OSError as error:
        sys.exit("\n%s is in use (%s). Close JupyterLab and try again." % (venv.name, error))
    venv.mkdir()
    stamp.write_text("unfinished")  # first: the next call sees that this one was interrupted
    if UV:
        how = ("--seed", "--allow-existing", "--python", sys.executable)
        patiently(UV, "venv", *(how + (str(venv),)))
    else:
        patiently(sys.executable, "-m", "venv", str(venv))
    install(venv, *words)
    patiently(str(python(venv)), "-c", "import matplotlib.pyplot")  # looks for fonts, once
    stamp.write_text(wanted)
    print(" done.", flush=True)


def python(venv):
    """Return the path of an environment's Python."""
    return venv / ("Scripts/python.exe" if os.name == "nt" else "bin/python")


def set_up_extra(name):
    """Install an extra of a distribution that a task needs, at its exact versions."""
    stamp = VENV / ("%s-by-course.txt" % name)
    wanted = fingerprint(projects())
    if not stamp.exists() or stamp.read_text() != wanted:
        print("Installing what %s needs" % name, end="", flush=True)
        place = "classroom" if name in ("book", "browser") else "."
        install(VENV, "-e", "./%s[%s]" % (place, name))
        stamp.write_text(wanted)
        print(" done.", flush=True)


def set_up_peers():
    """Install what bench compares with besides; where that cannot be had, it is left out."""
    try:
        set_up_extra("peers")
    except SetUpError as error:
        print("%s\nThe run goes on without." % error, flush=True)


def find_chromium():
    """Return the path of a Chromium; it is installed where Debian's packages are to be had."""
    there = [os.environ.get("CHROMIUM")] + [shutil.which(name) for name in CHROMIUM]
    if any(there):
        return next(filter(None, there))
    return install_package("chromium", "chromium")


def install_package(command, package):
    """Return the path of a command; install its package where Debian's packages are to be had."""
    if not shutil.which(command):
        if not shutil.which("apt-get"):
            sys.exit("%s is not found: install %s." % (command, package))
        print("Installing %s" % package, end="", flush=True)
        root = [] if os.geteuid() == 0 else ["sudo"]
        apt_get = root + ["env", "DEBIAN_FRONTEND=noninteractive", "apt-get", "--yes"]
        patiently(*(apt_get + ["update"]))
        patiently(*(apt_get + ["install", "--no-install-recommends", package]))
        print(" done.", flush=True)
    return shutil.which(command)


def install(venv, *words):
    """Install into an environment, with uv where it is on the PATH."""
    if UV:
        patiently(UV, "pip", "install", "--python", str(python(venv)), *words)
    else:
        pip = ("-m", "pip", "install", "--disable-pip-version-check", "--no-compile")
        patiently(str(python(venv)), *(pip + words))


def patiently(*command):
    """Run a command, a dot every two seconds; if it fails, raise the end of what it said.

    The certificates of the system, as pip takes them (uv has two names for that): networks of
    schools and firms have their own.
    """
    uv = {"UV_PYTHON_DOWNLOADS": "never", "UV_SYSTEM_CERTS": "true", "UV_NATIVE_TLS": "true"}
    environment = dict(uv, **os.environ)
    environment["PIP_USER"] = "0"
    with tempfile.TemporaryFile("w+", errors="replace") as said:
        job = subprocess.Popen(command, cwd=ROOT, env=environment, stdout=said, stderr=said)
        while True:
            try:
                job.wait(timeout=2)
                break
            except subprocess.TimeoutExpired:
                print(".", end="", flush=True)
        if job.returncode:
            said.seek(0)
            raise SetUpError("".join(said.readlines()[-25:]))


def fingerprint(paths, *more):
    """Return a text that changes when one of the files or of the other things does."""
    text = "\n".join([path.read_text(encoding="utf-8") for path in paths] + list(map(str, more)))
    return hashlib.sha256(text.encode("utf-8", "surrogateescape")).hexdigest()


if __name__ == "__main__":
    try:
        main()
    except SetUpError as error:
        print("\n%s" % error)
        sys.exit("Set-up failed; README.md, 'When something goes wrong', may help.")
    except KeyboardInterrupt:
        sys.exit(130)
