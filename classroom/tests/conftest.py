"""Prepare the tests that need Chromium or a sandbox, or leave them out and say why."""

import os
import shutil
from pathlib import Path

import pytest
from packages import find_program

from rbclassroom.assignments import sandbox
from rbclassroom.assignments.tables import update
from rbclassroom.course.lab import configure
from rbclassroom.lecture.pdf import BROWSERS

HERE = Path(__file__).parent
ROOT = HERE.parents[1]


def sandbox_for(named):
    """Return why submissions cannot be graded in a sandbox, or ""."""
    if named:
        find_program("bubblewrap", "bwrap")
    return sandbox.missing()


def pages_for(named):
    """Find Chromium and fetch Pyodide; return why pages cannot be tested, or ""."""
    from rbclassroom.live import engine

    found = os.environ.get("CHROMIUM") or next(filter(None, map(shutil.which, BROWSERS)), None)
    os.environ["CHROMIUM"] = found or (find_program(BROWSERS[0], *BROWSERS) if named else "")
    if not os.environ["CHROMIUM"]:
        return "Chromium is not found; install it, or set CHROMIUM to its path"
    try:
        engine.fetch()
    except OSError as error:
        return str(error)
    configure()
    return ""


@pytest.fixture(scope="session")
def shared(tmp_path_factory):
    """Return a folder that all workers share."""
    base = tmp_path_factory.getbasetemp()
    folder = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "Kurs ä"
    folder.mkdir(exist_ok=True)
    return folder


@pytest.fixture(scope="module", autouse=True)
def few_states(request, shared):
    """Let pages have explorers with a fifth of the states; each is recorded once."""
    with pytest.MonkeyPatch.context() as patch:
        if request.path.parent.name in ("book", "browser", "lecture"):
            from rbclassroom.explorers import recorded

            fewer = {name: (moved, 5 * stride) for name, (moved, stride) in recorded.MOVED.items()}
            patch.setattr(recorded, "MOVED", fewer)
            patch.setattr(recorded, "_stored", lambda name: shared / f"{name}.html")
            patch.setattr(recorded, "record_all", lambda: None)
        yield


@pytest.fixture(scope="session")
def template(tmp_path_factory):
    from tiny_class import make_template

    return make_template(tmp_path_factory.mktemp("template"))


@pytest.fixture(scope="session")
def release(tmp_path_factory):
    """Return the tiny set as it is handed out."""
    from tiny_set import write_tiny_set

    from rbclassroom.assignments import handout

    folder = tmp_path_factory.mktemp("assignments")
    write_tiny_set(folder)
    return handout.release("ps0", folder)["ps0.ipynb"].decode()


@pytest.hookimpl(tryfirst=True)
def pytest_sessionstart(session):
    """Prepare these tests before the workers start; a folder that is named is never left out."""
    config, here, ignored = session.config, Path.cwd(), session.config.option.ignore or []
    config.left_out = {}
    if hasattr(config, "workerinput") or config.option.collectonly:
        return
    paths = [here / word.partition("::")[0] for word in config.args]
    if any(HERE in (path, *path.parents) or path in HERE.parents for path in paths):
        for folder in sorted((ROOT / "notebooks/assignments/source").glob("*/")):
            try:
                update(folder)  # otherwise, in a new clone, each worker would do this
            except ValueError as error:
                raise pytest.UsageError(str(error)) from error
    for name, prepare in (("hostile", sandbox_for), ("browser", pages_for)):
        folder = HERE / name
        named = any(folder in (path, *path.parents) for path in paths)
        inside = any(path in folder.parents for path in paths)
        if named or (inside and folder not in [here / path for path in ignored]):
            is_part = inside and config.option.keyword  # such as -k so3
            reason = "with -k, it runs only if it is named" if is_part else prepare(named)
            if named and reason:
                raise pytest.UsageError(reason)
            if reason:
                config.option.ignore = [*(config.option.ignore or []), str(folder)]
                config.left_out[name] = reason


def pytest_terminal_summary(terminalreporter, config):
    for name, reason in config.left_out.items():
        terminalreporter.write_line(f"Left out: classroom/tests/{name} ({reason})")
