"""Show the slides of a lesson, with votes by phone if requested, or write them as PDF."""

import argparse
import asyncio
import os
import secrets
import shutil
import signal
import sys
import tempfile
import threading
import webbrowser
from pathlib import Path
from typing import Any

import segno
from tornado.escape import json_decode
from tornado.httpserver import HTTPServer
from tornado.netutil import bind_sockets
from tornado.web import Application, HTTPError, RequestHandler, StaticFileHandler

from rbclassroom.course.notebooks import lesson_paths
from rbclassroom.lecture.deck import put_mathjax, write
from rbclassroom.lecture.slides import deck_of
from rbclassroom.lecture.votes import Phones, find_address

HOST = "127.0.0.1"
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome", "msedge")
"""Programs that print a page as PDF."""


def find_lesson(number: str, folder: Path) -> Path:
    """Return the path of the lesson with the given number."""
    paths = {path.name[:2]: path for path in lesson_paths(folder)}
    if number.zfill(2) not in paths:
        there = ", ".join(paths) or "none; run this in the folder of the course"
        raise ValueError(f"There is no lesson {number}; the lessons are: {there}.")
    return paths[number.zfill(2)]


class _Here(RequestHandler):
    """A handler that answers only requests to the IP address of this machine, never to a host name.

    This refuses other sites whose host names lead to this machine (DNS rebinding).
    """

    def prepare(self) -> None:
        if self.request.host_name != HOST:
            raise HTTPError(403)


class Slides(_Here, StaticFileHandler):
    """The handler of the files of the slides."""


class Hold(_Here):
    """The handler of an image that a page requests, and drops when its slides are laid out.

    A browser prints a page when all of its images are loaded or dropped.
    """

    async def get(self) -> None:
        """Wait."""
        await asyncio.Event().wait()


class Desk(_Here):
    """The handler that opens, watches and closes votes, for requests with the token."""

    def initialize(self, phones: Phones, token: str) -> None:
        """Store the votes and the token."""
        self.phones, self.token = phones, token
        code = segno.make(phones.url, micro=False)
        self.code = code.svg_inline(border=2, light="white", omitsize=True)

    def prepare(self) -> None:
        """Refuse a request without the token."""
        super().prepare()
        asked = self.get_query_argument("token", "").encode()
        if not secrets.compare_digest(asked, self.token.encode()):
            raise HTTPError(403)

    def get(self) -> None:
        """Answer with the state of the vote, and the address for phones with its QR code."""
        state = self.phones.ballot.state()
        self.finish({**state, "address": self.phones.url, "code": self.code})

    def post(self) -> None:
        """Open a vote for ``{"poll": "Poll 1", "options": []}``, or close it for ``{}``."""
        asked = json_decode(self.request.body)
        ballot = self.phones.ballot
        try:
            ballot.begin(asked["poll"], asked["options"]) if asked else ballot.close()
        except ValueError as error:
            raise HTTPError(409, reason=str(error)) from error
        self.get()


async def serve(path: Path, phones: Phones | None, browser: bool, pdf: Path | None) -> None:
    """Serve the slides of a lesson until Ctrl-C, or until they are written as PDF."""
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        write({path.stem: deck_of(path)}, Path(folder, "slides"))
        put_mathjax(Path(folder, "_static"))
        token, handlers = secrets.token_hex(24), list[tuple[str, Any, dict[str, Any]]]()
        if phones:
            handlers.append(("/slides/votes", Desk, {"phones": phones, "token": token}))
            phones.start()
        handlers += [("/slides/hold", Hold, {}), (r"/(.*)", Slides, {"path": folder})]
        server = HTTPServer(Application(handlers, log_function=lambda handler: None))
        sockets = bind_sockets(0, HOST)
        server.add_sockets(sockets)
        address = f"http://{HOST}:{sockets[0].getsockname()[1]}/slides/{path.stem}.html"
        if pdf:
            await print_pdf(address, pdf)
            return
        shown = f"{address}?token={token}" if phones else address
        print(f"{path.name} is shown at {shown}", flush=True)
        if Path(folder, "slides", f"{path.stem}_crib.html").exists():
            sheet = address.replace(".html", "_crib.html")
            print(f"Run sheet and answers, for the lecturer only: {sheet}", flush=True)
        if phones:
            print(f"Phones vote at {phones.url}", flush=True)
        print("Press Ctrl-C to stop.", flush=True)
        if browser:  # with some browsers, this call returns only when they are closed
            threading.Thread(target=webbrowser.open, args=[shown], daemon=True).start()
        await asyncio.Event().wait()


async def print_pdf(address: str, pdf: Path) -> None:
    """Print slides as PDF with a browser that is based on Chromium."""
    named = os.environ.get("BROWSER", "")
    found = next(filter(None, map(shutil.which, (named, *BROWSERS))), None)
    if not found:
        wanted = f"no browser that prints was found; install one of {', '.join(BROWSERS)}"
        raise ValueError(f"{wanted}, or name a browser in the variable BROWSER")
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        made = Path(profile, "slides.pdf")
        words = ["--headless", "--disable-gpu", "--no-first-run", "--no-pdf-header-footer"]
        if hasattr(os, "geteuid") and os.geteuid() == 0:
            words.append("--no-sandbox")  # Chromium has no sandbox for the administrator
        words += [f"--user-data-dir={profile}", f"--print-to-pdf={made}"]
        quiet = asyncio.subprocess.DEVNULL
        job = await asyncio.create_subprocess_exec(
            found, *words, f"{address}?print-pdf&hold", stdout=quiet, stderr=quiet
        )
        try:
            await asyncio.wait_for(job.wait(), 120)
            shutil.copyfile(made, pdf)
        except (TimeoutError, OSError) as error:
            raise ValueError(f"{found} could not print the slides: {error!r}") from error
        finally:
            if job.returncode is None:
                job.kill()
                await job.wait()
    print(f"{pdf}: {pdf.stat().st_size / 1e6:.1f} MB")


def open_votes(address: str) -> Phones | None:
    """Return the server for votes at an address, by default the address of this machine.

    Return None if `address` is empty and this machine has no network.
    """
    try:
        address = address or find_address()
    except OSError:
        print("No network was found, so the class votes by show of hands.", flush=True)
        return None
    try:
        return Phones(address)
    except (ValueError, OSError) as error:
        raise ValueError(f"Phones cannot vote at {address}: {error}.") from error


def main() -> None:
    """Run the command ``course.py lecture`` in the folder of the course."""
    parser = argparse.ArgumentParser(prog="course.py lecture")
    parser.add_argument("lesson", help="number of the lesson, such as 01")
    parser.add_argument("--no-browser", action="store_true", help="only print the address")
    parser.add_argument("--pdf", action="store_true", help="only write the slides as PDF")
    votes = "let phones vote, at this machine's ADDRESS in their network"
    parser.add_argument("--votes", nargs="?", const="", metavar="ADDRESS", help=votes)
    words = parser.parse_args()
    # Ctrl-C ends the lecture even if the calling script ignores Ctrl-C
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        path = find_lesson(words.lesson, Path("notebooks"))
        phones = None if words.votes is None or words.pdf else open_votes(words.votes)
        pdf = Path(f"{path.stem}.pdf") if words.pdf else None
        asyncio.run(serve(path, phones, not words.no_browser, pdf))
    except (ValueError, OSError) as error:
        sys.exit(str(error))
    except KeyboardInterrupt:
        sys.exit(130)


if __name__ == "__main__":
    main()
