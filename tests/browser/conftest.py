"""A headless Chromium, and the two servers that it looks at: JupyterLab and the lecture view."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from playwright.sync_api import sync_playwright
from servers import serving

ROOT = Path(__file__).parents[2]
QUIET = [
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]


def pytest_addoption(parser):
    parser.addoption("--screenshots", help="a folder to put pictures of the pages in")


@pytest.fixture(scope="session")
def context():
    """A browser that keeps what it has loaded, as a person's does; course.py names it."""
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=os.environ["CHROMIUM"], args=QUIET)
        yield chromium.new_context()


@pytest.fixture(scope="session")
def home(tmp_path_factory):
    """An environment with an empty home, and the course in it: lessons copied, as a user has."""
    home = tmp_path_factory.mktemp("home")
    kept = ("PATH", "SYSTEMROOT", "LANG")
    env = {name: os.environ[name] for name in kept if name in os.environ}
    env |= {"HOME": str(home), "USERPROFILE": str(home), "PYTHONPATH": str(ROOT)}
    for folder in ("notebooks", "benchmarks"):
        shutil.copytree(ROOT / folder, home / "course" / folder)
    words = [sys.executable, "-m", "rbcourse.course.notebooks", "copy"]
    subprocess.run(words, cwd=home / "course", env=env, check=True)
    return home / "course", env


@pytest.fixture(scope="session")
def lab(home):
    """The address of a JupyterLab that shows the lessons, with its token: ``lab(path)``."""
    course, env = home
    words = ["jupyterlab", "--no-browser", "--ServerApp.port=0", "--ServerApp.open_browser=False"]
    words += [f"--ServerApp.root_dir={course / 'work'}"]
    if hasattr(os, "geteuid") and os.geteuid() == 0:
        words.append("--allow-root")
    with serving(words, course, env, r"(http://127\.0\.0\.1:\d+)/lab\?(token=\w+)") as found:
        yield lambda path: f"{found[1]}/lab/{path}?{found[2]}"


@pytest.fixture
def page(context):
    """A page that must ask nobody outside this machine, and log no error."""
    page, faults = context.new_page(), []
    page.set_viewport_size({"width": 1280, "height": 800})
    local = ("http://127.0.0.1:", "ws://127.0.0.1:", "data:", "blob:")
    page.on("request", lambda r: r.url.startswith(local) or faults.append(f"asked {r.url}"))
    page.on("pageerror", lambda error: faults.append(f"error {error}"))
    page.on("console", lambda m: m.type == "error" and faults.append(f"console {m.text}"))
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
        terminalreporter.write_line("From key press to changed picture")
        terminalreporter.write_line("\n".join([head, *rows]))
