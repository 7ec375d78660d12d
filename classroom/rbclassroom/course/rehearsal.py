"""Try a lesson before class: cells run, no request leaves the machine, access needs a token."""

import http.client
import json
import logging
import re
import shutil
import threading
import time
import webbrowser
from collections.abc import Callable
from functools import partial
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import urlsplit

import nbformat
from tornado.ioloop import IOLoop, PeriodicCallback

from rbclassroom.course.lecture import serve

BROWSERS = ("firefox", "chromium", "chromium-browser", "google-chrome", "msedge")
HEARTBEAT = "window.voila_heartbeat()"
OUTSIDE = re.compile(r"(?:https?:|wss?:)?//[\w.-]+[^\s\"'<>)]*", re.IGNORECASE)


class _Page(HTMLParser):
    """Reads a page: the number of its `cells`, the last line of each error, the id of its kernel.

    `outside` has the addresses of other machines that scripts, styles, links of the head, and
    pictures name.
    """

    def __init__(self) -> None:
        super().__init__()
        self.outside: list[str] = []
        self.cells = 0
        self.errors: list[str] = []
        self.kernel = ""
        self._element, self._type, self._error = "", "", ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = {name: value or "" for name, value in attrs}
        self._element, self._type = tag, values.get("type", "")
        self.cells += "cell-index" in values
        if "lecture-error" in values.get("class", "").split():
            self._error = " "
        if tag != "a":
            for name in ("src", "href", "xlink:href", "poster", "data"):
                self._note(values.get(name, ""), OUTSIDE.match)
            for candidate in values.get("srcset", "").split(","):
                self._note(candidate, OUTSIDE.match)
        self._note_style(values.get("style", ""))

    def handle_endtag(self, tag: str) -> None:
        self._element = ""
        if tag == "div" and self._error:
            self.errors.append((self._error.strip() or "an error").splitlines()[-1])
            self._error = ""

    def handle_data(self, data: str) -> None:
        if self._error:
            self._error += data
        if self._element == "style":
            self._note_style(data)
        elif self._element == "script":
            self._handle_script(data)

    def _handle_script(self, text: str) -> None:
        if self._type == "application/vnd.voila.cell-output+json":
            for kind, content in json.loads(text).get("data", {}).items():
                if kind in ("text/html", "image/svg+xml"):
                    inner = _Page()
                    inner.feed(content)
                    self.outside += inner.outside
        elif self._type == "application/json":
            self.kernel = json.loads(text).get("kernelId", self.kernel)
        elif self._type in ("", "text/javascript", "module"):
            self._note(text, re.compile(r"https?://(?!www\.w3\.org/)[^\s\"'`)]+").search)

    def _note_style(self, text: str) -> None:
        for called in re.findall(r"(?:url\(|@import)\s*[\"']?([^\s\"')]+)", text):
            self._note(called, OUTSIDE.match)

    def _note(self, text: str, find: Callable[[str], re.Match[str] | None]) -> None:
        if match := find(text.strip()):
            self.outside.append(match[0])


def check(path: Path) -> list[str]:
    """Try a lesson before class; what is looked at is printed."""
    missing: list[str] = []
    print(f"lesson: {path.name}", flush=True)

    def begin(address: str) -> None:
        loop = IOLoop.current()
        dots = PeriodicCallback(partial(print, ".", end="", flush=True), 1000)
        dots.start()

        def look() -> None:
            try:
                missing.extend(_look(path, address, dots.stop))
            except (OSError, http.client.HTTPException) as error:
                missing.append(f"the server does not answer ({error!r}); try again")
            finally:
                loop.add_callback(loop.stop)

        threading.Thread(target=look, daemon=True).start()

    print("running every cell ", end="", flush=True)
    logging.disable()  # what the server has to say is found in the page
    serve(path, begin)
    return [*missing, *_look_for_browser()]


def _look(path: Path, address: str, finished: Callable[[], None]) -> list[str]:
    start = time.perf_counter()
    parts = urlsplit(address)
    page = _read_page(parts.netloc, f"/?{parts.query}")
    finished()
    print(f" {time.perf_counter() - start:.0f} s", flush=True)
    missing = [f"a cell fails: {error}; mend it in {path.name}" for error in page.errors]
    number = len(nbformat.read(path, as_version=4).cells)
    if page.cells < number and not missing:
        missing.append(f"only {page.cells} of {number} cells were run; try again")
    return [*missing, *_look_for_token(parts.netloc, page.kernel), *_look_outside(page)]


def _read_page(netloc: str, target: str) -> _Page:
    """Get the page, which comes cell by cell; what is stuck is given up."""
    page, heartbeats = _Page(), 0
    connection = http.client.HTTPConnection(netloc, timeout=120)
    connection.request("GET", target)
    for line in connection.getresponse():
        text = line.decode("utf-8")
        heartbeats = heartbeats + 1 if HEARTBEAT in text and "function" not in text else 0
        if heartbeats > 20:  # one every ten seconds; a cell may take 120 seconds
            break
        page.feed(text)
    connection.close()
    return page


def _look_for_token(netloc: str, kernel: str) -> list[str]:
    here = f"/api/kernels/{kernel or '00000000-0000-0000-0000-000000000000'}"
    targets = "/", here, f"{here}/channels"
    # 302 leads to a form that asks for the token
    open_ = [target for target in targets if _status(netloc, target) not in (302, 401, 403)]
    print(f"nobody gets in without the token: {'no' if open_ else 'yes'}", flush=True)
    return [f"{target} is open to everybody; update voila" for target in open_]


def _status(netloc: str, target: str) -> int:
    connection = http.client.HTTPConnection(netloc, timeout=30)
    connection.request("GET", target)
    status = connection.getresponse().status
    connection.close()
    return status


def _look_outside(page: _Page) -> list[str]:
    asked = "no" if page.outside else "yes"
    print(f"nothing is asked for outside this machine: {asked}", flush=True)
    return [f"the page asks for {address}; store it in the lesson" for address in page.outside]


def _look_for_browser() -> list[str]:
    try:
        browser = webbrowser.get()
        name = getattr(browser, "name", type(browser).__name__)
    except webbrowser.Error:  # also where there is no screen
        if not (found := next(filter(shutil.which, BROWSERS), "")):
            return ["no web browser is found; install one, or name it in the variable BROWSER"]
        name = f"{found}, to be opened by hand"
    print(f"browser: {name}", flush=True)
    return []
