"""Submissions that mean harm, and unlucky ones, graded in one go: nobody else is harmed."""

import base64
import builtins
import html
import os
import re
import socket
import subprocess
import sys
import tempfile
import threading
from pathlib import Path

import nbformat
import psutil
import pytest
from nbformat.v4 import new_code_cell, new_markdown_cell
from tiny_class import Class, cell, make_template
from tiny_set import ANSWERS

import rbcourse
from rbclassroom.assignments import grade as grading
from rbclassroom.assignments import sandbox
from rbclassroom.assignments.grade import grade, grade_all

SQUARE = ANSWERS["square-answer"]
PIXEL = (
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAQAAAC1HAwCAAAAC0lEQVR42mNk+A8AAQUBAScY42YAAAAASUVORK5CYII="
)
HIDDEN = ["assert square(-3) == 9", "assert math.isclose(half, 0.5)"]
SLEEP = f"9{os.getpid():08d}"  # a number of seconds that nobody else sleeps
SECRET = "the-token-of-the-teacher"
REFUSALS = {"AssertionError", "CalledProcessError", "OperationalError"}
REFUSALS |= {
    name
    for name, kind in vars(builtins).items()
    if isinstance(kind, type) and issubclass(kind, OSError)
}

# Each is the answer with the square, to which the right one is added, or only that with the half.
HONEST = {
    "interact": "from ipywidgets import interact\ninteract(lambda x: print(x), x=(0.0, 3.0));",
    "widget of outputs": "from ipywidgets import Output\nout = Output()\nwith out:\n"
    "    print('in')\n    display('it')\nout.clear_output()\nout",
    "sliders": "from ipywidgets import FloatSlider, HBox, interactive_output\n"
    "slider = FloatSlider()\nout = interactive_output(print, {'x': slider})\n"
    "slider.value = 2\nHBox([slider, out])",
    "matplotlib": "%matplotlib inline\n%config InlineBackend.figure_formats = ['svg']\n"
    "import matplotlib.pyplot as plt\nplt.plot([1, 2]); plt.show()",
    "tqdm": "from tqdm.auto import tqdm\nfor i in tqdm(range(99)): pass\n"
    "from tqdm import tqdm\nfor i in tqdm(range(99)): pass",
    "threads": "import threading\nthread = threading.Thread(target=print, args=('done',))\n"
    "thread.start()\nthread.join()",
    "pools": "from concurrent.futures import ThreadPoolExecutor\n"
    "print(list(ThreadPoolExecutor(4).map(abs, range(9))))",
    "warns": "import warnings\nwarnings.warn('old')",
    "asyncs": "import asyncio\nawait asyncio.sleep(0)\nprint(1)",
    "pool": "from multiprocessing import Pool\nwith Pool(2) as pool:\n    pool.map(abs, range(9))",
    "odd outputs": "odd = {'text/plain': {'a': 1}, 'application/x-odd': [float('inf')]}\n"
    "display(odd, raw=True)",
    "reloads": "%load_ext autoreload\n%autoreload 2",
}
# What they try fails, and they say what they got; the points are those of their answers.
SNEAKS = {
    "reads the set": "print(open('COURSE/source/ps0/ps0.ipynb').read())",
    "reads others": "import os\nprint(os.listdir('COURSE/submitted'))",
    "reads home": "import os\nassert len(os.listdir('HOME')) > 1",
    "finds the set": "import os\nfound = [f for _, _, names in os.walk('/') for f in names]\n"
    "assert 'ps0.ipynb' in found",
    "writes the gradebook": "import sqlite3\nbook = sqlite3.connect('COURSE/gradebook.db')\n"
    "book.execute('update grade set manual_score = 56')\nbook.commit()",
    "writes to the course": "open('COURSE/source/mine', 'w')",
    "writes to the package": "open('PACKAGE/mine.py', 'w')",
    "writes to the disk": "open('/usr/mine', 'w')",
    "writes to memory": "open('/dev/mine', 'w')",
    "asks the network": "import socket\nsocket.create_connection(('1.1.1.1', 53), 5)",
    "asks this machine": "import socket\nsocket.create_connection(('127.0.0.1', PORT), 5)",
    "asks by a socket": "import socket\nsocket.socket(socket.AF_UNIX).connect('COURSE/sock')",
    "fills the disk": "with open('big', 'wb') as file:\n    for _ in range(3000):\n"
    "        file.write(bytes(10**6))",
    "starts too many": "import subprocess\nfor _ in range(500):\n"
    "    subprocess.Popen(['sleep', 'SLEEP'], start_new_session=True)",
    "forks": "import os, signal\nfor _ in range(10**4):\n"
    "    if not os.fork():\n        signal.pause()",
    "becomes root": "import os\nos.setuid(0)",
    "mounts": "import subprocess\n"
    "subprocess.run(['mount', '-t', 'tmpfs', 'x', '/usr'], check=True)",
}
# These do what they want, in the box; the points are those of their answers.
LOUD = {
    "leaves daemons": "import subprocess\nfor _ in range(50):\n"
    "    subprocess.Popen(['setsid', 'sleep', 'SLEEP'], start_new_session=True)",
    "kills everything": "import os, signal\ntry:\n    os.kill(-1, signal.SIGKILL)\n"
    "except OSError as error:\n    print(error)",
    "tells the environment": "import os\nprint(dict(os.environ))",
    "prints": "print('x' * 3_000_000)",
    "digs": "import os\nfor _ in range(3000):\n    os.mkdir('d')\n    os.chdir('d')",
    "locks": "import os\nos.mkdir('a')\nos.symlink('COURSE/source', 'a/b')\nos.chmod('a', 0)",
    "page": "from IPython.display import HTML, Javascript, SVG, display\n"
    "display(HTML('<script>alert(1)</script><img src=x onerror=alert(2)>'\n"
    '\'<a href="javascript:alert(3)">x</a><iframe src="https://evil.example"></iframe>\'\n'
    "'<svg onload=alert(4)></svg><form action=\"https://evil.example\"><input></form>'\n"
    "'<style>body {display: none}</style>'), metadata={'text/html': {'isolated': True}})\n"
    "display(Javascript('alert(5)'), SVG('<svg xmlns=\"http://www.w3.org/2000/svg\">'\n"
    "'<script>alert(6)</script></svg>'))\n"
    "display({'text/vnd.mermaid': 'x', 'text/plain': 'x'}, raw=True)\n"
    "display({'image/png': '', 'text/plain': ''}, raw=True,\n"
    "    metadata={'filenames': {'image/png': 'https://evil.example/x.png'}})",
}
# It leaves what it has read for the next run: in a file, and with the keys that Linux keeps.
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
call(keyctl, 8, -4, -2)  # what the process has it may read
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
# Ways round the tests: graded by hand, for the reason that is told.
TRICKS = {
    "transforms": (
        "import sys\nsys.modules['IPython'].get_ipython().input_transformers_post.append("
        "lambda lines: [])",
        "line 2 uses get_ipython",
    ),
    "transforms trees": ("x.ast_transformers.append(None)", "uses ast_transformers"),
    "profile": ("import sys\nsys.setprofile(None)", "line 2 uses setprofile"),
    "an alias": ("m = [math][0]\nm.isclose = print", "line 2 replaces m.isclose"),
    "locals": ("locals()['math'] = None", "line 1 uses locals"),
    "globals": ("globals()['math'] = None", "line 1 uses globals"),
    "reads what was run": ("print(In[-1])", "line 1 uses In"),
    "code in a text": ("exec('import math; math.isclose = print')", "line 1 uses exec"),
    "import by name": ("__import__('builtins').abs = print", "line 1 uses __import__"),
    "a module": ("import sys\nsys.modules['math'] = None", "line 2 uses modules"),
    "setattr": ("setattr(math, 'isclose', print)", "line 1 uses setattr"),
    "a computed name": ("getattr(math, 'is' + 'close')", "line 1 uses getattr(math"),
    "frames": ("def f():\n    yield\nf().gi_frame.f_back", "line 3 uses f_back"),
    "garbage": ("import gc", "line 1 imports gc"),
    "a shell": ("!ls", "line 1 uses a magic or a shell"),
}


@pytest.fixture(scope="module", autouse=True)
def box():
    assert sandbox.missing() == ""


@pytest.fixture(scope="module")
def template(tmp_path_factory):
    return make_template(tmp_path_factory.mktemp("template"))


def change_tests(notebook):
    for name in ("square-test", "half-test"):
        found = cell(notebook, name)
        found.source, found.metadata.tags = "pass", ["skip-execution"]
        found.metadata.nbgrader.points = 100


def forge_remarks(notebook):
    cell(notebook, "half-test").metadata.nbgrader.points = "1\nann: graded, 6 of 6\x1b[2J" * 9**5
    cell(notebook, "title").source = "# \x1b[2J" + "x" * 9**5


def drop_tests(notebook):
    notebook.cells = notebook.cells[:3]


def write_words(notebook):
    cell(notebook, "words-answer").source = (
        "<script>alert(7)</script> [x](javascript:alert(8)) ![x](https://evil.example/x.png)\n"
        '<a href="https://evil.example">y</a> <img src=x onerror=alert(9)> $a < b$\n\n'
        r"$\href{https://evil.example}{x}$ $&#92;href{https://evil.example}{y}$ "
        "![pasted](attachment:a.png) ![gone](attachment:b.png)"
    )
    cell(notebook, "words-answer").attachments = {"a.png": {"image/png": PIXEL}}
    notebook.cells.append(new_markdown_cell("<svg onload=alert(10)>"))


def loops(begin):
    return f"{begin}\nwhile True: pass  # endless"


def hand_in_all(course, port):
    places = {"COURSE": str(course.folder), "PACKAGE": str(Path(rbcourse.__file__).parent)}
    places |= {"HOME": str(Path.home()), "PORT": str(port), "SLEEP": SLEEP}

    def placed(code):
        return re.sub("|".join(places), lambda match: places[match[0]], code)

    for name, code in {**HONEST, **SNEAKS, **LOUD}.items():
        course.submit(name, half=placed(code) + "\nhalf = 0.5" * (name not in SNEAKS))
    for name, (code, _) in TRICKS.items():
        course.submit(name, half=f"{code}\nhalf = 1")
    course.submit("tells", square=TELLS)
    course.submit("writes words", write_words)
    course.submit("forges remarks", forge_remarks)
    course.submit("loops", half=loops(course.begin))
    course.submit("floods", half=f"{course.begin}\nwhile True: print('x' * 9**4)  # endless")
    course.submit("takes memory", half="x = bytearray(3 * 10**9)")
    course.submit("exits", half="import os\nos._exit(0)")
    course.submit("ends itself", half="import os, signal\nos.kill(os.getpid(), signal.SIGKILL)")
    course.submit("raises", square="def square(x):\n    raise SystemExit")
    course.submit("returns points", half="half = 1\n100.0")
    course.submit("changes tests", change_tests, half="half = 1")
    course.submit("drops tests", drop_tests, square="def square(x):\n    return 4")
    course.submit("=cmd|' -C calc'!A0", half="half = 1")
    plain = nbformat.reads(course.given.decode(), as_version=4)
    for name, text in ANSWERS.items():
        cell(plain, name).source = text
    plain.cells.insert(3, new_code_cell("mine = 1", metadata={"tags": ["raises-exception"]}))
    text = nbformat.writes(plain)
    course.submit_bytes("crlf", text.replace("\n", "\r\n").encode())
    course.submit_bytes("bom", text.encode("utf-8-sig"))
    course.submit_bytes("utf-16", text.encode("utf-16"))
    course.submit_bytes("pdf", b"%PDF-1.7")
    course.submit_bytes("half a file", text.encode()[:999])
    course.submit_bytes("deep", b'{"cells": ' + b"[" * 10**5)
    course.submit_bytes("long", b" " * 31_000_000)
    course.submit("[ab]*")
    course.submit("more files")
    course.submit_bytes("more files", b"<script>", "feedback.html")
    place = course.folder / "submitted" / "a link" / "ps0"
    place.mkdir(parents=True)
    (place / "ps0.ipynb").symlink_to(course.folder / "source" / "ps0" / "ps0.ipynb")


@pytest.fixture(scope="module")
def course(tmp_path_factory, template, monkeypatch_module):
    """All of them graded at once, while a server and a socket wait to be asked."""
    monkeypatch_module.setenv("SECRET", SECRET)
    course = Class(tmp_path_factory.mktemp("course"), template)
    asked = []
    server, local = socket.create_server(("127.0.0.1", 0)), socket.socket(socket.AF_UNIX)
    os.chdir(course.folder)
    local.bind("sock")
    local.listen()
    for ear in (server, local):
        threading.Thread(target=lambda ear=ear: asked.append(ear.accept()), daemon=True).start()
    hand_in_all(course, server.getsockname()[1])
    course.before = state(course.folder)
    places = Path(tempfile.mkdtemp())
    monkeypatch_module.setenv("TMPDIR", str(places))
    grade("ps0", course.folder)
    monkeypatch_module.delenv("TMPDIR")
    assert [path for path in places.iterdir() if not path.name.startswith("pymp-")] == []
    assert not asked
    return course


@pytest.fixture(scope="module")
def monkeypatch_module():
    with pytest.MonkeyPatch.context() as patch:
        yield patch


@pytest.fixture(scope="module")
def rows(course):
    return course.rows()


def state(folder):
    """What there is outside of what grading writes."""
    paths = [*folder.glob("source/**/*"), *folder.glob("submitted/**/*")]
    return {path: path.read_bytes() for path in paths if path.is_file()}


def points(row):
    return row["square-test"], row["half-test"]


@pytest.mark.parametrize("student", HONEST)
def test_honest_work_is_graded_without_a_remark(rows, student):
    assert (points(rows[student]), rows[student]["remarks"]) == (("2", "1"), "")


@pytest.mark.parametrize("student", SNEAKS)
def test_what_is_tried_outside_fails(course, rows, student):
    assert points(rows[student]) == ("2", "0")
    answer = cell(nbformat.read(course.graded(student), as_version=4), "half-answer")
    assert {output.get("ename") for output in answer.outputs} & REFUSALS, answer.outputs


@pytest.mark.parametrize("student", LOUD)
def test_what_is_done_in_the_box_costs_nobody_points(rows, student):
    assert points(rows[student]) == ("2", "1")


@pytest.mark.parametrize("student", TRICKS)
def test_ways_round_the_tests_are_named(course, rows, student):
    assert rows[student]["total"] == ""
    assert rows[student]["remarks"].startswith("refused: cell 5, answer of “A tiny set”, line ")
    assert TRICKS[student][1] in rows[student]["remarks"]
    assert not course.graded(student).exists()


@pytest.mark.parametrize(
    ("student", "square", "half", "remark"),
    [
        ("tells", "2", "1", ""),
        ("writes words", "2", "1", ""),
        ("loops", "2", "0", "cell 5, answer of “A tiny set”: stopped after"),
        ("floods", "2", "0", "cell 5, answer of “A tiny set”: stopped after"),
        ("takes memory", "2", "0", "cell 5, answer of “A tiny set”: takes too much memory"),
        ("prints", "2", "1", "cell 5, answer of “A tiny set”: the output is too large"),
        ("raises", "0", "1", ""),
        ("forges remarks", "2", "1", "cell 1, locked cell of “A tiny set” was changed; it is put"),
        ("returns points", "2", "0", ""),
        ("changes tests", "2", "0", "cell 4, test of “A tiny set” was changed and has other"),
        ("drops tests", "0", "0", "cell 4, test of “A tiny set” was missing; it is put back"),
        ("'=cmd|' -C calc'!A0", "2", "0", ""),
        ("crlf", "2", "1", ""),
        ("exits", "", "", "refused: Python ended in or before cell 5, answer of “A tiny set”"),
        ("ends itself", "", "", "refused: Python ended in or before cell 5, answer"),
        ("bom", "", "", "refused: ps0.ipynb is not plain UTF-8: collect it again, or save it"),
        ("utf-16", "", "", "refused: ps0.ipynb is not plain UTF-8: collect it again, or save it"),
        ("pdf", "", "", "refused: ps0.ipynb is no notebook, but a PDF"),
        ("half a file", "", "", "refused: ps0.ipynb is damaged or no notebook"),
        ("deep", "", "", "refused: ps0.ipynb is damaged or no notebook"),
        ("long", "", "", "refused: ps0.ipynb has more than 30,000,000 bytes"),
        ("a link", "", "", "refused: ps0.ipynb, or what is beside it, is a link"),
        ("[ab]*", "", "", "refused: the name of the folder holds [, * or ?: give it another"),
        ("more files", "", "", "refused: there is more than ps0.ipynb: take away feedback.html"),
    ],
)
def test_each_has_its_points_and_a_clear_line(rows, student, square, half, remark):
    assert points(rows[student]) == (square, half), rows[student]
    assert rows[student]["remarks"].startswith(remark), rows[student]
    assert bool(remark) == bool(rows[student]["remarks"])
    assert rows[student]["remarks"].isprintable()
    assert len(rows[student]["remarks"]) < 700


def test_nothing_outside_is_changed(course, rows):
    assert state(course.folder) == course.before
    assert not (Path(rbcourse.__file__).parent / "mine.py").exists()
    assert {row["boxed"] for row in rows.values()} == {"yes"}


def test_nothing_is_left_running(course):
    assert not [job for job in psutil.process_iter(["cmdline"]) if SLEEP in str(job.info)]


def pages(course):
    return {p.parts[-3]: p.read_text("utf-8") for p in course.folder.glob("feedback/*/ps0/*.html")}


def test_pages_hold_nothing_of_students_that_runs_or_loads(course):
    for student, page in pages(course).items():
        body = page.split("<body>", 1)[1]
        assert "<script" not in body, student
        tags = " ".join(re.findall(r"<[a-zA-Z][^>]*>", body))
        assert not re.search(r"\son\w+\s*=|javascript:|evil\.example|<(iframe|form|svg)", tags)
        loaded = re.findall(r"\s(?:src|href)=\"([^\"]*)\"", tags)
        assert all(address.startswith(("data:image/", "#")) for address in loaded), student
    assert ">A tiny set</h1>" in pages(course)["writes words"]
    words = pages(course)["writes words"]
    assert "$a &lt; b$" in words
    assert PIXEL in words
    assert r"$\text{https://evil.example}{x}$" in words
    assert r"\href" not in words
    assert "gone (attachment:b.png is missing)" in words


def test_pages_hold_no_hidden_test_in_any_writing_and_no_environment(course):
    for student, page in pages(course).items():
        text = html.unescape(re.sub(r"<[^>]*>", "", page))
        for line in HIDDEN:
            codes = [base64.b64encode(b" " * n + line.encode())[4:-4].decode() for n in range(3)]
            for shown in (line, line[::-1], *codes):
                assert shown not in text, student
        assert SECRET not in page


def test_without_a_box_it_is_said_or_refused(tmp_path, template, monkeypatch, capsys):
    """As on macOS: then a submission can do what the teacher can."""
    why = "bubblewrap is not installed; on Debian and Ubuntu: sudo apt install bubblewrap"
    monkeypatch.setattr(sandbox, "missing", lambda: why)
    course = Class(tmp_path, template)
    with pytest.raises(ValueError, match=f"There is no box for submissions: {why}"):
        grade_all(["ps0"], course.folder, require_box=True)
    course.submit("ann")
    grade_all(["ps0"], course.folder)
    assert why in capsys.readouterr().out
    assert course.rows()["ann"]["boxed"] == "no"


@pytest.mark.parametrize("who", ["ann", "bob"])
def test_points_that_a_submission_writes_are_found(tmp_path, template, who, monkeypatch):
    """Its own are above the maximum, those of another have changed."""
    course = Class(tmp_path, template)
    course.submit("ann")
    grade("ps0", course.folder)
    book = course.folder / "gradebook.db"
    script = tmp_path / "harm.py"
    script.write_text(
        "import sqlite3\n"
        f"book = sqlite3.connect({str(book)!r}, timeout=60)\n"
        "book.execute('update grade set manual_score = 56 where notebook_id in (select "
        "submitted_notebook.id from submitted_notebook join submitted_assignment on "
        "submitted_assignment.id = submitted_notebook.assignment_id where student_id in "
        f'("{who}"))\')\nbook.commit()\n'
    )
    course.submit("bob")
    plain = grading.wait

    def harmed(works, **how):
        found = plain(works, **how)
        if "bob" in [student for student, _ in works.values()]:
            subprocess.run([sys.executable, str(script)], check=True)
        return found

    monkeypatch.setattr(grading, "WORKERS", 1)
    monkeypatch.setattr(grading, "wait", harmed)
    changed = "The points of ann changed during the grading of bob"
    said = "bob has .* points" if who == "bob" else changed
    with pytest.raises(ValueError, match=said):
        grading.grade("ps0", course.folder)
    assert "bob" not in course.rows()  # of the table before
    assert (course.folder / "gradebook.before-ps0.db").exists()
