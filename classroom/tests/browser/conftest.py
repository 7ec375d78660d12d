"""One headless Chromium and one JupyterLab, shared by all workers; pages side by side."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
from contextlib import ExitStack, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from packages import find_program
from playwright.sync_api import expect, sync_playwright
from servers import serving

from rbclassroom.course.lab import configure

ROOT = Path(__file__).parents[3]
PATIENCE = 600_000  # milliseconds; long enough for a slow machine
QUIET = [
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
STARTED = pytest.StashKey[dict[str, str]]()


def pytest_addoption(parser):
    parser.addoption("--screenshots", help="a folder to put pictures of the pages in")


@pytest.hookimpl(tryfirst=True)
def pytest_sessionstart(session):
    """Start what the workers share, before there are any."""
    config = session.config
    if hasattr(config, "workerinput") or config.option.collectonly:
        return
    names = "chromium", "chromium-browser", "google-chrome", "msedge"
    os.environ["CHROMIUM"] = os.environ.get("CHROMIUM") or find_program("chromium", *names)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # so that the servers end too
    stack = ExitStack()
    config.add_cleanup(stack.close)
    config.stash[STARTED] = stack.enter_context(started())


@pytest.hookimpl(optionalhook=True)
def pytest_configure_node(node):
    """Tell a worker where it is."""
    node.workerinput |= node.config.stash[STARTED]


@contextmanager
def started():
    """A home with the course in it, as a user has it, a browser, and a JupyterLab."""
    with TemporaryDirectory(ignore_cleanup_errors=True) as home:
        course, env = Path(home, "course"), environment(home)
        for folder in ("notebooks", "benchmarks"):
            shutil.copytree(ROOT / folder, course / folder)
        code = "copy_lessons(Path('notebooks'), Path('work'))"
        code = f"from rbclassroom.course.notebooks import Path, copy_lessons; {code}"
        subprocess.run([sys.executable, "-c", code], cwd=course, env=env, check=True)
        chromium = {"executablePath": os.environ["CHROMIUM"], "args": QUIET}
        Path(home, "chromium.json").write_text(json.dumps(chromium))
        browser = ["playwright", "launch-server", "--browser=chromium"]
        browser += [f"--config={home}/chromium.json"]
        lab = ["jupyterlab", "--no-browser", "--ServerApp.port=0", "--expose-app-in-browser"]
        lab += [f"--ServerApp.root_dir={course / 'work'}"]
        if hasattr(os, "geteuid") and os.geteuid() == 0:
            lab.append("--allow-root")
        address = r"(http://127\.0\.0\.1:\d+)/lab\?(token=\w+)"
        configured = env | {"JUPYTER_CONFIG_PATH": str(configure())}
        with (
            serving(browser, course, os.environ | env, r"(ws://\S+)\n") as found,
            serving(lab, course, configured, address) as server,
        ):
            yield {"home": home, "browser": found[1], "lab": f"{server[1]}/lab/%s?{server[2]}"}


def environment(home):
    """The environment of a user with this home."""
    kept = ("PATH", "SYSTEMROOT", "LANG")
    env = {name: os.environ[name] for name in kept if name in os.environ}
    return env | {"HOME": home, "USERPROFILE": home, "PYTHONPATH": str(ROOT)}


@pytest.fixture(scope="session")
def shared(request):
    return getattr(request.config, "workerinput", None) or request.config.stash[STARTED]


@pytest.fixture(scope="session")
def context(shared):
    """What the pages of a worker have in common; it keeps what it has loaded."""
    expect.set_options(timeout=PATIENCE)
    with sync_playwright() as playwright:
        chromium = playwright.chromium.connect(shared["browser"], timeout=PATIENCE)
        context = chromium.new_context()
        context.set_default_timeout(PATIENCE)
        yield context
        context.close()


@pytest.fixture(scope="session")
def home(shared):
    """The folder of the course in the home, and the environment."""
    return Path(shared["home"], "course"), environment(shared["home"])


@pytest.fixture(scope="session")
def lab(shared):
    """The address of something in JupyterLab, with its token: ``lab(path)``."""
    return lambda path: shared["lab"] % path


@pytest.fixture
def page(context):
    """A page that must ask nobody outside this machine, and log no error."""
    page, faults = context.new_page(), []
    page.set_viewport_size({"width": 1280, "height": 800})
    local = ("http://127.0.0.1:", "ws://127.0.0.1:", "data:", "blob:", "file:///")
    page.on("request", lambda r: r.url.startswith(local) or faults.append(f"asked {r.url}"))
    # JupyterLab shows why it cannot save, and then throws it
    meant = "is an original, and is not saved"
    page.on("pageerror", lambda error: meant in str(error) or faults.append(f"error {error}"))
    # Voila asks to end the kernel of a page that is left, and is refused: 403; and widgets say
    # that they cannot send what their sliders are to a kernel that has ended
    known = re.compile("403|Could not send widget sync message")
    page.on(
        "console",
        lambda m: (
            m.type == "error" and not known.search(m.text) and faults.append(f"console {m.text}")
        ),
    )
    yield page
    page.close()
    assert faults == []


def pytest_generate_tests(metafunc):
    if "lesson" in metafunc.fixturenames:
        names = sorted(path.stem for path in (ROOT / "notebooks").glob("[0-9][0-9]_*.ipynb"))
        metafunc.parametrize("lesson", names)


@pytest.fixture
def pictures(page, request):
    """Keep pictures of the page in two sizes, where they are wanted."""
    folder = request.config.getoption("--screenshots")

    def keep(name, place):
        for width, height in ((1280, 800), (1024, 768)) if folder else ():
            page.set_viewport_size({"width": width, "height": height})
            place()
            page.wait_for_timeout(500)
            page.screenshot(path=Path(folder) / f"{name}_{width}.png")

    return keep


def pytest_terminal_summary(terminalreporter):
    reports = terminalreporter.stats.get("passed", []) + terminalreporter.stats.get("failed", [])
    rows = [value for report in reports for key, value in report.user_properties if key == "speed"]
    if rows:
        head = f"{'explorer':26}{'median':>10}{'longest':>10}{'held':>10}{'last after':>12}"
        terminalreporter.write_line("From key press to new picture, while the other tests run")
        terminalreporter.write_line("\n".join([head, *rows]))
