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

from rbclassroom.course import rehearsal, show


def test_faults_of_a_lesson_are_named_and_it_stays_as_it_is(tmp_path, monkeypatch):
    path = lesson_at(
        tmp_path,
        new_markdown_cell("[a link](https://example.org) is asked for by nobody"),
        new_markdown_cell('<img src="https://example.org/a.png">'),
        new_code_cell("from IPython.display import HTML\nHTML('<img src=//example.org/b.png>')"),
        new_code_cell("1 / 0"),
    )
    before = path.read_bytes()
    monkeypatch.setenv("BROWSER", sys.executable)  # any program will do; it is not opened
    words = [*MODULE, "rbclassroom.course.show", "1", "--check"]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 1
    lines = done.stdout.splitlines()
    first, *others = [line for line in lines if line.startswith("not ready: ")]
    assert "ZeroDivisionError: division by zero" in first
    places = "https://example.org/a.png", "//example.org/b.png"
    assert others == [f"not ready: the page asks for {x}; store it in the lesson" for x in places]
    assert "nobody gets in without the token: yes" in lines
    assert "ready" not in lines
    assert path.read_bytes() == before
    assert [file.name for file in path.parent.iterdir()] == [path.name]


def test_a_lesson_without_faults_is_ready(tmp_path, monkeypatch, capsys):
    lesson_at(tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["show", "1", "--check"])
    monkeypatch.setattr(show, "check", lambda path: [])
    with pytest.raises(SystemExit) as end:
        show.main()
    assert not end.value.code
    assert capsys.readouterr().out == "ready\n"


OUTSIDE = [f"https://example.org/{letter}" for letter in "abcdefgh"]
PAGE = """<link href="{}"><img src="{}"><img srcset="a.png 1x, {} 2x"><video poster="{}">
<object data="{}"><p style="background: url({})"><style>@import "{}"</style><script>fetch("{}")
</script><a href="https://example.org">to click</a><img src="data:image/png;base64,AA">"""


def test_every_way_to_ask_outside_is_seen():
    found = rehearsal._Page()
    found.feed(PAGE.format(*OUTSIDE))
    assert [address.partition(" ")[0] for address in found.outside] == OUTSIDE


def test_a_server_that_lets_everybody_in_is_named(capsys):
    class Open(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            self.send_response(200)
            self.end_headers()

        def log_message(self, *words):
            pass

    with http.server.HTTPServer(("127.0.0.1", 0), Open) as server:
        serve = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        serve.start()
        found = rehearsal._look_for_token(f"127.0.0.1:{server.server_port}", "1")
        server.shutdown()
        serve.join()
    assert len(found) == 3
    assert all("is open to everybody" in line for line in found)
    assert "without the token: no" in capsys.readouterr().out


def test_without_a_screen_a_browser_on_the_path_will_do(monkeypatch, capsys):
    def no_screen():
        raise webbrowser.Error

    monkeypatch.setattr(webbrowser, "get", no_screen)
    for there in ("firefox", ""):
        monkeypatch.setattr(shutil, "which", lambda name, there=there: there == name)
        assert len(rehearsal._look_for_browser()) == (not there)
        assert ("firefox, to be opened by hand" in capsys.readouterr().out) == bool(there)
