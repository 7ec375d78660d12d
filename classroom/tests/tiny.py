"""Helpers: a course with one small lesson, a command that runs a module, and a server."""

import http.client
import re
import signal
import subprocess
import sys
from contextlib import contextmanager
from http.cookies import SimpleCookie
from urllib.parse import urlsplit

import nbformat
from nbformat.v4 import new_notebook

MODULE = [sys.executable, "-m"]
SERVE = """
import pathlib, signal, sys, time, webbrowser
from rbclassroom.book.serve import serve
webbrowser.open = lambda address: time.sleep(120)  # some calls return when the browser is closed
signal.signal(signal.SIGINT, signal.default_int_handler)
serve(pathlib.Path(sys.argv[1]))
"""


def lesson_at(folder, *cells):
    """Write a lesson of these cells into the course of a folder; return its path."""
    (folder / "notebooks" / "slides").mkdir(parents=True)
    (folder / "notebooks" / "slides" / "01.md").touch()
    path = folder / "notebooks" / "01_tiny.ipynb"
    path.write_text(nbformat.writes(new_notebook(cells=list(cells))), encoding="utf-8")
    return path


@contextmanager
def lecture(folder, *further):
    """Serve a lecture; yield its address and the process."""
    words = [*MODULE, "rbclassroom.lecture.serve", "1", "--no-browser", *further]
    with subprocess.Popen(words, cwd=folder, stdout=subprocess.PIPE, text=True) as server:
        try:
            yield server.stdout.readline().split()[-1], server
        finally:
            server.terminate()
            server.stdout.read()


@contextmanager
def served(book):
    """Serve a book; yield its address. End the server as Ctrl-C does."""
    words = [sys.executable, "-c", SERVE, str(book)]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as server:
        try:
            yield re.search(r"http://127\.0\.0\.1:\d+/", server.stdout.readline())[0]
        finally:
            server.send_signal(signal.SIGTERM if sys.platform == "win32" else signal.SIGINT)
        assert server.wait() == 0 or sys.platform == "win32"


def ask(address, method="GET", body=None, **headers):
    """Request a page; return its status, its text and its cookies."""
    parts = urlsplit(address)
    connection = http.client.HTTPConnection(parts.netloc, timeout=60)
    connection.request(method, f"{parts.path or '/'}?{parts.query}", body, headers)
    answer = connection.getresponse()
    text = answer.read().decode()
    connection.close()
    cookies = SimpleCookie(answer.getheader("Set-Cookie"))
    return answer.status, text, "; ".join(f"{key}={it.value}" for key, it in cookies.items())
