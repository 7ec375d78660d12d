"""What a rehearsal finds, as the command line starts it."""

import http.server
import shutil
import subprocess
import sys
import threading
import webbrowser

import pytest
from nbformat.v4 import new_code_cell, new_markdown_cell
from tiny import MODULE, lesson_at

from rbclassroom.course import rehearsal


def checked(folder, monkeypatch):
    """Check the lesson of a folder; any program will do as the browser, it is not opened."""
    monkeypatch.setenv("BROWSER", sys.executable)
    return subprocess.run(
        [*MODULE, "rbclassroom.course.show", "1", "--check"],
        cwd=folder,
        capture_output=True,
        text=True,
    )


def test_a_lesson_that_runs_is_ready(tmp_path, monkeypatch):
    link = new_markdown_cell("[a link](https://example.org) is asked for by nobody")
    path = lesson_at(tmp_path, link, new_code_cell("6 * 7"))
    before = path.read_bytes()
    done = checked(tmp_path, monkeypatch)
    assert done.stdout.splitlines()[-1] == "ready", done
    assert done.returncode == 0
    assert path.read_bytes() == before
    assert [file.name for file in path.parent.iterdir()] == [path.name]


def test_cells_that_fail_and_pictures_from_outside_are_named(tmp_path, monkeypatch):
    lesson_at(
        tmp_path,
        new_markdown_cell('<img src="https://example.org/a.png">'),
        new_code_cell("from IPython.display import HTML\nHTML('<img src=//example.org/b.png>')"),
        new_code_cell("1 / 0"),
    )
    done = checked(tmp_path, monkeypatch)
    assert done.returncode == 1
    missing = [line for line in done.stdout.splitlines() if line.startswith("not ready: ")]
    assert len(missing) == 3
    assert "ZeroDivisionError: division by zero" in missing[0]
    assert "https://example.org/a.png" in missing[1]
    assert "//example.org/b.png" in missing[2]
    assert "ready" not in done.stdout.splitlines()


def outside(page):
    """The addresses that are found in a page."""
    found = rehearsal._Page()
    found.feed(page)
    return found.outside


@pytest.mark.parametrize(
    "page",
    [
        '<img src="https://example.org/a.png">',
        '<img srcset="a.png 1x, //example.org/b.png 2x">',
        '<video poster="http://example.org/c.png">',
        '<object data="https://example.org/d.svg">',
        '<link href="https://example.org/e.css">',
        '<p style="background: url(https://example.org/f.png)">',
        '<style>@import "https://example.org/g.css"</style>',
        '<script>fetch("https://example.org/h.js")</script>',
    ],
)
def test_every_way_to_ask_outside_is_seen(page):
    assert len(outside(page)) == 1


def test_links_to_be_clicked_and_pictures_of_the_page_itself_are_none():
    assert (
        outside('<a href="https://example.org">more</a><img src="data:image/png;base64,AA">') == []
    )


def test_a_server_that_lets_everybody_in_is_named(capsys):
    class Open(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            self.send_response(200)
            self.end_headers()

        def log_message(self, *words):
            pass

    with http.server.HTTPServer(("127.0.0.1", 0), Open) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        found = rehearsal._look_for_token(f"127.0.0.1:{server.server_port}", "1")
        server.shutdown()
    assert len(found) == 3
    assert all("is open to everybody" in what for what in found)
    assert "without the token: no" in capsys.readouterr().out


@pytest.mark.parametrize(("there", "found"), [("firefox", 0), ("", 1)])
def test_without_a_screen_a_browser_on_the_path_will_do(there, found, monkeypatch, capsys):
    def no_screen():
        raise webbrowser.Error

    monkeypatch.setattr(webbrowser, "get", no_screen)
    monkeypatch.setattr(shutil, "which", lambda name: there == name)
    assert len(rehearsal._look_for_browser()) == found
    assert ("firefox, to be opened by hand" in capsys.readouterr().out) == bool(there)
