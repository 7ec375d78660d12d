"""Show the slides of a lesson, with votes by phone if requested, or write them as PDF."""

import asyncio
import secrets
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
from tornado.web import Application, ErrorHandler, HTTPError, RequestHandler, StaticFileHandler

from rbclassroom.course import options
from rbclassroom.course.folder import port_of
from rbclassroom.course.notebooks import lesson_paths
from rbclassroom.lecture.deck import mathjax, write
from rbclassroom.lecture.pdf import print_pdf
from rbclassroom.lecture.slides import deck_of
from rbclassroom.lecture.votes import Ballot, open_votes

HOST = "127.0.0.1"


def find_lesson(number: str, folder: Path) -> Path:
    """Return the path of the lesson with the given number."""
    paths = {path.name[:2]: path for path in lesson_paths(folder)}
    if number.zfill(2) not in paths:
        there = ", ".join(paths) or "none; run this in the folder of the course"
        raise ValueError(f"There is no lesson {number}; the lessons are: {there}.")
    return paths[number.zfill(2)]


class Hold(RequestHandler):
    """The handler of an image that a page requests, and drops when its slides are laid out.

    A browser prints a page when all of its images are loaded or dropped.
    """

    async def get(self) -> None:
        """Wait."""
        await asyncio.Event().wait()


class _Files(StaticFileHandler):
    def set_extra_headers(self, path: str) -> None:
        """Let browsers ask whether a file has changed, because the port stays the same."""
        self.set_header("Cache-Control", "no-cache")

    def validate_absolute_path(self, root: str, absolute_path: str) -> str | None:
        """Return the path, or answer with status 404 if no file can have it, such as ``/%00``."""
        try:
            return super().validate_absolute_path(root, absolute_path)
        except ValueError as error:
            raise HTTPError(404) from error


class Desk(RequestHandler):
    """The handler that opens, watches and closes votes, for requests with the token."""

    def initialize(self, ballot: Ballot, url: str, token: str) -> None:
        """Store the votes, the address for phones, and the token."""
        self.ballot, self.url, self.token = ballot, url, token

    def prepare(self) -> None:
        """Refuse a request without the token."""
        asked = self.get_query_argument("token", "").encode()
        if not secrets.compare_digest(asked, self.token.encode()):
            raise HTTPError(403)

    def get(self) -> None:
        """Answer with the state of the vote, and the address for phones with its QR code."""
        code = segno.make(self.url, micro=False)
        picture = code.svg_inline(border=2, light="white", omitsize=True)
        self.finish({**self.ballot.state(), "address": self.url, "code": picture})

    def post(self) -> None:
        """Open a vote for ``{"poll": "Poll 1", "options": []}``, or close it for ``{}``."""
        asked = json_decode(self.request.body)
        self.ballot.begin(**asked) if asked else self.ballot.close()
        self.get()


async def serve(path: Path, votes: str | None, browser: bool, pdf: bool) -> None:
    """Serve the slides of a lesson until Ctrl-C, or until they are written as PDF.

    Phones vote at the address `votes`; if it is empty, at the address of this machine.
    """
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        deck, token = deck_of(path), secrets.token_hex(24)
        write({path.stem: deck}, Path(folder, "slides"))
        url, ballot = ("", Ballot()) if votes is None else open_votes(votes)
        handlers: list[tuple[str, Any, dict[str, Any]]] = [
            ("/slides/votes", Desk, {"ballot": ballot, "url": url, "token": token}),
            ("/slides/hold", Hold, {}),
            (r"/_static/(.*)", _Files, {"path": mathjax().parent}),
            (r"/(.*)", _Files, {"path": folder}),
        ]
        application = Application(
            log_function=lambda handler: None,
            default_handler_class=ErrorHandler,  # for other hosts
            default_handler_args={"status_code": 403},
        )
        # refuse other sites whose host names lead to this machine (DNS rebinding)
        application.add_handlers(HOST.replace(".", r"\."), handlers)
        try:  # the speaker view stores its layout by port
            sockets = bind_sockets(0 if pdf else port_of(path.parent), HOST)
        except OSError:  # another lecture is shown
            sockets = bind_sockets(0, HOST)
        HTTPServer(application).add_sockets(sockets)
        address = f"http://{HOST}:{sockets[0].getsockname()[1]}/slides/{path.stem}"
        if pdf:
            await asyncio.to_thread(print_pdf, f"{address}.html", Path(f"{path.stem}.pdf"))
            return
        shown = f"{address}.html" + f"?token={token}" * bool(url)
        print(f"{path.name} is shown at {shown}", flush=True)
        if deck.sheet:
            print(f"Run sheet and answers, for the lecturer only: {address}_crib.html", flush=True)
        if url:
            print(f"Phones vote at {url}", flush=True)
        print("Press Ctrl-C to stop.", flush=True)
        if browser:  # with some browsers, this call returns only when they are closed
            threading.Thread(target=webbrowser.open, args=[shown], daemon=True).start()
        await asyncio.Event().wait()


def main() -> None:
    """Run the command ``course.py lecture`` in the folder of the course."""
    words, _ = options.parse("lecture")
    # Ctrl-C ends the lecture even if the calling script ignores Ctrl-C
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        path = find_lesson(words.lesson, Path("notebooks"))
        asked = None if words.pdf else words.votes
        asyncio.run(serve(path, asked, not words.no_browser, words.pdf))
    except (ValueError, OSError) as error:
        sys.exit(str(error))
    except KeyboardInterrupt:
        sys.exit(130)


if __name__ == "__main__":
    main()
