"""Grade malicious and broken submissions in one run; no other submission is affected."""

import base64
import contextlib
import html
import json
import os
import re
import socket
import tempfile
import threading
from pathlib import Path

import nbformat
import psutil
import pytest
from nbformat.v4 import new_code_cell, new_markdown_cell
from tiny_class import Class, begun
from tiny_set import answered, cell

import rbcourse
from rbclassroom.assignments import sandbox
from rbclassroom.assignments.grade import grade

PIXEL = (
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAQAAAC1HAwCAAAAC0lEQVR42mNk+A8AAQUBAScY42YAAAAASUVORK5CYII="
)
HIDDEN = ["assert square(-3) == 9", "assert math.isclose(half, 0.5)"]
SLEEP = f"9{os.getpid():08d}"  # no other process sleeps for this number of seconds
SECRET = "the-token-of-the-teacher"
REFUSALS = {"AssertionError", "CalledProcessError", "OperationalError"}
KINDS = [OSError, *OSError.__subclasses__(), *ConnectionError.__subclasses__()]
REFUSALS |= {kind.__name__ for kind in KINDS}

# Each text is the beginning of a student's answer to the second problem; the right answer follows.
HONEST = (
    "from ipywidgets import FloatSlider, HBox, Output, interact, interactive_output\n"
    "interact(lambda x: print(x), x=(0.0, 3.0));\nout = Output()\nwith out:\n    print('in')\n"
    "    display('it')\nout.clear_output()\nslider = FloatSlider()\n"
    "out = interactive_output(print, {'x': slider})\nslider.value = 2\nHBox([slider, out])\n"
    "%matplotlib inline\n%config InlineBackend.figure_formats = ['svg']\n"
    "%load_ext autoreload\n%autoreload 2\n"
    "import matplotlib.pyplot as plt\nplt.plot([1, 2]); plt.show()\n"
    "import asyncio, threading, warnings\nfrom multiprocessing import Pool\n"
    "from concurrent.futures import ThreadPoolExecutor\nwarnings.warn('old')\n"
    "thread = threading.Thread(target=print, args=('done',))\nthread.start()\nthread.join()\n"
    "print(list(ThreadPoolExecutor(4).map(abs, range(9))))\nawait asyncio.sleep(0)\nprint(1)\n"
    "with Pool(2) as pool:\n    pool.map(abs, range(9))\n"
    "odd = {'text/plain': {'a': 1}, 'application/x-odd': [float('inf')]}\n"
    "display(odd, raw=True)\n"
)
# All these attacks have to fail. One student makes them, and prints the error of each of them.
SNEAKS = {
    "reads the set": "print(open('COURSE/source/ps0/ps0.ipynb').read())",
    "reads home": "import os\nassert len(os.listdir('HOME')) > 1",
    "finds the set": "import os\nfound = [f for _, _, names in os.walk('/') for f in names]\n"
    "assert 'ps0.ipynb' in found",
    "writes the gradebook": "import sqlite3\nbook = sqlite3.connect('COURSE/gradebook.db')\n"
    "book.execute('update grade set manual_score = 56')\nbook.commit()",
    "writes to the package": "open('PACKAGE/mine.py', 'w')",
    "writes to the disk": "open('/usr/mine', 'w')",
    "writes to memory": "open('/dev/mine', 'w')",
    "asks the network": "import socket\nsocket.create_connection(('1.1.1.1', 53), 5)",
    "asks this machine": "import socket\nsocket.create_connection(('127.0.0.1', PORT), 5)",
    "asks by a socket": "import socket\nsocket.socket(socket.AF_UNIX).connect('COURSE/sock')",
    "becomes root": "import os\nos.setuid(0)",
    "fills the disk": "with open('big', 'wb') as file:\n    for _ in range(3000):\n"
    "        file.write(bytes(10**6))",
    "mounts": "import subprocess as s\ns.run(['mount', '-t', 'tmpfs', 'x', '/usr'], check=True)",
}
TRIED = f"""
for name, code in {SNEAKS!r}.items():
    try:
        exec(code)
    except Exception as error:
        print(f"{{name}}: {{type(error).__name__}}")
"""
# These attacks use up a resource, and fail.
TAKES = "bytearray(3 * 10**9)"
FORKS = "import os, signal\nfor _ in range(10**4):\n    if not os.fork():\n        signal.pause()"
# These attacks succeed only inside the sandbox. Each answer gets only the points that it earns.
SHOWS = (
    "from IPython.display import HTML, Javascript, SVG, display\n"
    "display(HTML('<script>alert(1)</script><img src=x onerror=alert(2)>'\n"
    '\'<a href="javascript:alert(3)">x</a><iframe src="https://evil.example"></iframe>\'\n'
    "'<svg onload=alert(4)></svg><form action=\"https://evil.example\"><input></form>'\n"
    "'<style>body {display: none}</style>'), metadata={'text/html': {'isolated': True}})\n"
    "display(Javascript('alert(5)'), SVG('<svg xmlns=\"http://www.w3.org/2000/svg\">'\n"
    "'<script>alert(6)</script></svg>'))\n"
    "display({'text/vnd.mermaid': 'x', 'text/plain': 'x'}, raw=True)\n"
    "display({'image/png': '', 'text/plain': ''}, raw=True,\n"
    "    metadata={'filenames': {'image/png': 'https://evil.example/x.png'}})\n"
    "import os, subprocess\nprint(dict(os.environ))\nfor _ in range(50):\n"
    "    subprocess.Popen(['setsid', 'sleep', 'SLEEP'], start_new_session=True)\n"
    "print('x' * 3_000_000)"
)
HIDES = (
    "import os\nos.mkdir('a')\nos.symlink('COURSE/source', 'a/b')\nos.chmod('a', 0)\n"
    "for _ in range(3000):\n    os.mkdir('d')\n    os.chdir('d')\n"
    "import signal\ntry:\n    os.kill(-1, signal.SIGKILL)\nexcept OSError as error:\n"
    "    print(error)"
)
# This answer tries to pass data to the next run: in a file, and in the kernel's keyring.
TELLS = """
import base64, linecache, platform
import numpy
ctypes = numpy.ctypeslib.ctypes
call = ctypes.CDLL(None).syscall
add_key, keyctl = {"x86_64": (248, 250), "aarch64": (217, 219)}[platform.machine()]
def square(x):
    code = "".join("".join(entry[2]) for entry in list(linecache.cache.values()))
    for text in (code, code[::-1], base64.b64encode(code.encode()).decode()):
        print(text)
    for ring in (-3, -4):  # of the session, of the user
        call(add_key, b"user", b"note", code[-5000:].encode(), len(code[-5000:].encode()), ring)
    try:
        with open('/tmp/kept', 'a') as file:
            file.write(code)
    except OSError:
        pass
    return x * x
call(keyctl, 8, -4, -2)  # the process may read its own data
for ring in (-3, -4):
    key = call(keyctl, 10, ring, b"user", b"note", 0)
    text = ctypes.create_string_buffer(9999)
    if key > 0 and call(keyctl, 11, key, text, 9999) > 0:
        print(text.value.decode())
try:
    print(open('/tmp/kept').read())
except OSError:
    pass
"""


def forge_remarks(notebook):
    cell(notebook, "half-test").metadata.nbgrader.points = "1\nann: graded, 6 of 6\x1b[2J" * 9**5
    cell(notebook, "title").source = "# \x1b[2J" + "x" * 9**5


def write_words(notebook):
    cell(notebook, "words-answer").source = (
        "<script>alert(7)</script> [x](javascript:alert(8)) ![x](https://evil.example/x.png)\n"
        '<a href="https://evil.example">y</a> <img src=x onerror=alert(9)> $a < b$\n\n'
        r"$\href{https://evil.example}{x}$ $&#92;href{https://evil.example}{y}$ "
        "![pasted $x$](attachment:a.png) ![gone](attachment:b.png)\n\n"
        r"<p>$\h&#114;ef{https://evil.example}{z}$ $\hr&#x65;f{https://evil.example}{z}$</p>"
    )
    cell(notebook, "words-answer").attachments = {"a.png": {"image/png": PIXEL}}
    notebook.cells.append(new_markdown_cell("<svg onload=alert(10)>"))
    tagged = {"tags": ["raises-exception"]}
    notebook.cells.insert(3, new_code_cell("mine = 1", metadata=tagged))


CELL_3, CELL_5 = "cell 3, answer of “A tiny set”", "cell 5, answer of “A tiny set”"
HALF = "\nhalf = 0.5"
EXITS = "def square(x):\n    raise SystemExit"
LINKS = (
    "def square(x):\n"
    "    raise ValueError(r'$\\href{https://evil.example}{x}$ <script>alert(1)</script>')"
)
# The endless output is stopped when the time is over, or when the memory is full.
LOOP, FLOOD = (f"{begun()}\nwhile True: {what}" for what in ("pass", "print('x' * 9**4)"))
# Each row has a student, a change, answers, points (none if refused), and how the remark begins;
# with None, every remark is accepted.
CLASS = [
    ("honest", None, {"half": HONEST + HALF}, "2 1", f"{CELL_5}: shows TypeError"),
    ("sneaks", None, {"half": TRIED + HALF}, "2 1", None),
    ("hides", None, {"half": HIDES + HALF}, "2 1", None),
    ("shows", None, {"half": SHOWS + HALF}, "2 1", f"{CELL_5}: the output is too large"),
    ("tells", write_words, {"square": TELLS}, "2 1", ""),
    ("forges", forge_remarks, {"square": LINKS}, "0 1", "cell 2, locked cell of “A tiny set” was"),
    ("takes", None, {"square": TAKES, "half": FORKS}, "0 0", f"{CELL_3}: takes too much memory"),
    ("prints", None, {"square": FLOOD}, "0 1", None),
    ("loops", None, {"square": LOOP, "half": FLOOD}, "0 0", f"{CELL_3}: stopped after"),
    # the answer to the second problem returns points
    ("=cmd|' -C calc'!A0", None, {"square": EXITS, "half": "half = 1\n100.0"}, "0 0", ""),
    ("[ab]*", None, {}, " ", "the name of the folder contains [, * or ?; rename the folder"),
]
FILES = [
    ("utf-16", lambda good: good.decode().encode("utf-16"), "2 1", ""),
    ("deep", lambda good: b'{"cells": ' + b"[" * 10**5, " ", "ps0.ipynb is damaged or not a note"),
    ("long", lambda good: b" " * 31_000_000, " ", "ps0.ipynb has more than 30,000,000 bytes"),
    ("more files", lambda good: good, " ", "the folder has more files than ps0.ipynb: remove feed"),
]
RESULTS = [(student, *result) for student, _, _, *result in CLASS]
RESULTS += [(student, *result) for student, _, *result in FILES]
RESULTS += [("a link", " ", "ps0.ipynb or a file or folder beside it is a link")]


def hand_in_all(course, port):
    places = {"COURSE": str(course.folder), "PACKAGE": str(Path(rbcourse.__file__).parent)}
    places |= {"HOME": str(Path.home()), "PORT": str(port), "SLEEP": SLEEP}
    for student, change, answers, *_ in CLASS:
        for place, text in places.items():
            answers = {name: code.replace(place, text) for name, code in answers.items()}
        course.submit(student, change, **answers)
    good = json.dumps(answered(course.given.decode())).encode()
    for student, change, *_ in FILES:
        course.submit_bytes(student, change(good))
    course.submit_bytes("more files", b"<script>", "feedback.html")
    place = course.folder / "submitted" / "a link" / "ps0"
    place.mkdir(parents=True)
    (place / "ps0.ipynb").symlink_to(course.folder / "source" / "ps0" / "ps0.ipynb")


@pytest.fixture(scope="module")
def course(tmp_path_factory, template):
    """Grade all submissions in one run while a server and a socket wait for connections."""
    assert sandbox.missing() == ""
    course = Class(tmp_path_factory.mktemp("course"), template)
    asked = []
    server, local = socket.create_server(("127.0.0.1", 0)), socket.socket(socket.AF_UNIX)
    with contextlib.chdir(course.folder):  # the path of a socket must be short
        local.bind("sock")
    local.listen()
    for ear in (server, local):
        threading.Thread(target=lambda ear=ear: asked.append(ear.accept()), daemon=True).start()
    hand_in_all(course, server.getsockname()[1])
    course.before = state(course.folder)
    places = Path(tempfile.mkdtemp())
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SECRET", SECRET)
        patch.setenv("TMPDIR", str(places))
        grade(["ps0"], course.folder)
    assert [path for path in places.iterdir() if not path.name.startswith("pymp-")] == []
    assert not asked
    return course


def state(folder):
    """Return the files that grading must not change."""
    paths = [*folder.glob("source/**/*"), *folder.glob("submitted/**/*")]
    return {path: path.read_bytes() for path in paths if path.is_file()}


@pytest.mark.parametrize(("student", "wanted", "remark"), RESULTS)
def test_each_submission_gets_the_expected_points_and_remark(course, student, wanted, remark):
    """Large outputs cost no points."""
    row = course.rows()["'" * student.startswith("=") + student]
    assert f"{row['square-test']} {row['half-test']}" == wanted, row
    assert row["remarks"].isprintable()
    assert len(row["remarks"]) < 700
    assert course.graded(student).exists() == (wanted != " ")
    if remark is not None:
        assert row["remarks"].startswith("refused: " * (wanted == " ") + remark), row
        assert bool(remark) == bool(row["remarks"])


def test_attempts_to_leave_the_sandbox_fail(course):
    errors = {}
    for student in ("sneaks", "takes"):
        answer = cell(nbformat.read(course.graded(student), as_version=4), "half-answer")
        for output in answer.outputs:
            errors |= dict(line.split(": ") for line in output.get("text", "").splitlines())
            errors[student] = output.get("ename", "OSError")
    assert errors.keys() == {*SNEAKS, "sneaks", "takes"}
    assert {*errors.values()} <= REFUSALS, errors


def test_nothing_outside_the_sandbox_is_changed(course):
    assert state(course.folder) == course.before
    assert not (Path(rbcourse.__file__).parent / "mine.py").exists()
    assert {row["boxed"] for row in course.rows().values()} == {"yes"}
    assert not [job for job in psutil.process_iter(["cmdline"]) if SLEEP in str(job.info)]


@pytest.fixture(scope="module")
def pages(course):
    return {p.parts[-3]: p.read_text("utf-8") for p in course.folder.glob("feedback/*/ps0/*.html")}


def test_feedback_pages_contain_no_active_content_of_students(pages):
    for student, page in pages.items():
        assert "<script" not in page, student
        body = page.split("<body>", 1)[1]
        tags = " ".join(re.findall(r"<[a-zA-Z][^>]*>", body))
        assert not re.search(r"\son\w+\s*=|javascript:|evil\.example|<(iframe|form|svg)", tags)
        loaded = re.findall(r"\s(?:src|href)=\"([^\"]*)\"", tags)
        assert all(address.startswith(("data:image/", "#")) for address in loaded), student
    words = pages["tells"]
    for shown in (">A tiny set</h1>", PIXEL):
        assert shown in words
    assert "<mi>a</mi><mo>&lt;</mo><mi>b</mi>" in re.sub(r"\s", "", words)
    assert r"\href" not in html.unescape(words)
    assert "gone (attachment:b.png is missing)" in words


def test_feedback_pages_show_no_hidden_test(pages):
    for student, page in pages.items():
        text = html.unescape(re.sub(r"<[^>]*>", "", page))
        for line in HIDDEN:
            codes = [base64.b64encode(b" " * n + line.encode())[4:-4].decode() for n in range(3)]
            for shown in (line, line[::-1], *codes):
                assert shown not in text, student
        assert SECRET not in page
