"""Show the finished book in a browser, from a server on this machine."""

import os
import webbrowser
from contextlib import closing, suppress
from functools import partial
from http.client import HTTPConnection, HTTPException
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any
from urllib.parse import quote

from rbclassroom.course.folder import port_of

HOST = "127.0.0.1"


class Handler(SimpleHTTPRequestHandler):
    """The handler of requests for files of the book; the header ``Server`` names its folder."""

    def version_string(self) -> str:
        """Return the header ``Server``."""
        return f"rbcourse {quote(self.directory)}"

    def send_head(self) -> Any:
        """Answer with status 404 if no file can have the requested name, such as ``/%00``."""
        try:
            return super().send_head()
        except ValueError:
            self.send_error(404)
            return None

    def end_headers(self) -> None:
        """Let browsers ask whether a file has changed, because the port stays the same."""
        self.send_header("Cache-Control", "no-cache")
        super().end_headers()

    def log_message(self, *_: object) -> None:
        """Print nothing about requests."""


class _Server(ThreadingHTTPServer):
    allow_reuse_address = os.name != "nt"  # on Windows, two programs could share the port


def serve(book: Path) -> None:
    """Serve the book from this machine and show it in a browser, until Ctrl-C.

    Its port is always the same, because browsers store the answers to problem sets by port. If the
    book is served already, it is only shown. If another program uses the port, ValueError is
    raised.
    """
    folder, port = book.resolve(), port_of(book)
    address = f"http://{HOST}:{port}/"
    try:
        server = _Server((HOST, port), partial(Handler, directory=str(folder)))
    except OSError as error:
        if not _is_served(folder, port):
            why = f"another program uses port {port} of this machine ({error.strerror})"
            keep = "browsers keep the answers to problem sets for this port only"
            raise ValueError(f"The book is made, but not shown: {why}, and {keep}.") from error
        print(f"The book is at {address}, where another terminal serves it.", flush=True)
        webbrowser.open(address)
        return
    with server:
        print(f"The book is at {address}. Press Ctrl-C here to stop its server.", flush=True)
        webbrowser.open(address)
        with suppress(KeyboardInterrupt):
            server.serve_forever()


def _is_served(folder: Path, port: int) -> bool:
    """Tell whether a server of this folder answers at a port."""
    with closing(HTTPConnection(HOST, port, timeout=5)) as connection:
        try:
            connection.request("HEAD", "/")
            found = connection.getresponse().getheader("Server")
        except (OSError, HTTPException):
            return False
    return found == f"rbcourse {quote(str(folder))}"
