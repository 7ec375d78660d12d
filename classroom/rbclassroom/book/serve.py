"""Show the finished book in a browser, from a server on this machine."""

import os
import threading
import webbrowser
from contextlib import suppress
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

from rbclassroom.course.folder import port_of

HOST = "127.0.0.1"


class Handler(SimpleHTTPRequestHandler):
    """The handler of requests for files of the book."""

    def end_headers(self) -> None:
        """Let browsers ask whether a file has changed, because the port stays the same."""
        self.send_header("Cache-Control", "no-cache")
        super().end_headers()

    def translate_path(self, path: str) -> str:
        """Return the place of a file; a path with a null byte is that of no file."""
        return super().translate_path(path.replace("%00", "%EF%BF%BD"))

    def log_message(self, *_: object) -> None:
        """Print nothing about requests."""


class _Server(ThreadingHTTPServer):
    allow_reuse_address = os.name != "nt"  # on Windows, two programs could share the port


def serve(book: Path) -> None:
    """Serve the book from this machine and show it in a browser, until Ctrl-C.

    Its port is always the same, because browsers store the answers to problem sets by port. If the
    port is in use, ValueError is raised.
    """
    port = port_of(book)
    address = f"http://{HOST}:{port}/"
    try:
        server = _Server((HOST, port), partial(Handler, directory=str(book.resolve())))
    except OSError as error:
        why = f"port {port} of this machine is in use ({error.strerror})"
        keep = "Browsers keep the answers to problem sets for this port only"
        there = f"If another terminal shows the book, open {address}"
        raise ValueError(f"The book is made, but {why}. {keep}. {there}.") from error
    with server:
        print(f"The book is at {address}. Press Ctrl-C here to stop its server.", flush=True)
        # with some browsers, this call returns only when they are closed
        threading.Thread(target=webbrowser.open, args=[address], daemon=True).start()
        with suppress(KeyboardInterrupt):
            server.serve_forever()
