"""Define fixtures: a headless Chromium, and a JupyterLab for tests that need one."""

import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest
from pages import watched
from playwright.sync_api import expect, sync_playwright
from servers import serving

from rbclassroom.book.build import build
from rbclassroom.live import engine

ROOT = Path(__file__).parents[3]
PACKAGES = str(ROOT), str(ROOT / "classroom")
PATIENCE = 600_000  # in milliseconds; enough for a slow machine
QUIET = ["--no-sandbox", "--no-first-run", "--disable-quic", "--disable-sync"]
QUIET += ["--disable-background-networking", "--disable-component-update"]


@pytest.fixture(scope="module")
def context():
    """Return a browser context; all its pages share one cache.

    While Playwright runs, no other test can start an event loop, so each module has its own.
    """
    expect.set_options(timeout=PATIENCE)
    with sync_playwright() as playwright:
        path = os.environ["CHROMIUM"]
        chromium = playwright.chromium.launch(executable_path=path, args=QUIET)
        context = chromium.new_context()
        context.set_default_timeout(PATIENCE)
        yield context
        chromium.close()


@pytest.fixture(scope="module")
def book(few_states, shared):
    """Make the book, once for all workers; return its folder."""
    done = shared / "done"
    try:
        (shared / "begun").touch(exist_ok=False)
    except FileExistsError:
        while not done.exists():  # another worker makes it
            time.sleep(0.2)
    else:
        try:
            build(ROOT, shared / "book", pyodide=engine.fetch())
        finally:
            done.touch()
    assert (shared / "book").exists(), "the book could not be made"
    return shared / "book"


@pytest.fixture(scope="session")
def home(tmp_path_factory):
    """Make a home directory with a course folder, and copy the lessons. Return the course folder
    and the environment variables."""
    home = tmp_path_factory.mktemp("home")
    kept = ("PATH", "SYSTEMROOT", "LANG")
    env = {name: os.environ[name] for name in kept if name in os.environ}
    env |= {"HOME": str(home), "USERPROFILE": str(home), "PYTHONPATH": os.pathsep.join(PACKAGES)}
    for folder in ("notebooks", "benchmarks"):
        shutil.copytree(ROOT / folder, home / "course" / folder)
    code = "from rbclassroom.course.notebooks import Path, copy_lessons\n"
    code += "copy_lessons(Path('notebooks'), Path('work'))"
    subprocess.run([sys.executable, "-c", code], cwd=home / "course", env=env, check=True)
    return home / "course", env


@pytest.fixture(scope="session")
def lab(home, tmp_path_factory):
    """Start JupyterLab in the folder work/; return its address with the token. JupyterLab renders
    all cells, also those outside of its window."""
    course, env = home
    settings = tmp_path_factory.mktemp("settings")
    own = settings / "@jupyterlab" / "notebook-extension" / "tracker.jupyterlab-settings"
    own.parent.mkdir(parents=True)
    own.write_text('{"windowingMode": "none"}')
    words = ["jupyterlab", "--no-browser", "--ServerApp.port=0", "--expose-app-in-browser"]
    words.append(f"--ServerApp.root_dir={course / 'work'}")
    if hasattr(os, "geteuid") and os.geteuid() == 0:
        words.append("--allow-root")
    configured = env | {"JUPYTER_CONFIG_PATH": str(Path(sys.prefix, "share", "rbcourse"))}
    configured["JUPYTERLAB_SETTINGS_DIR"] = str(settings)
    address = r"http://127\.0\.0\.1:\d+/lab\?token=\w+"
    with serving(words, course, configured, address) as server:
        yield server[0]


@pytest.fixture
def page(context):
    """Return a page for a single test; `watched` checks its requests and errors."""
    with watched(context) as page:
        yield page


@pytest.fixture
def timed(context):
    """Return a page with a clock that the test controls.

    It has its own context, because Playwright sets the clock of a whole context.
    """
    own = context.browser.new_context()
    own.set_default_timeout(PATIENCE)
    own.clock.install(time=0)
    with watched(own) as page:
        yield page
    own.close()
