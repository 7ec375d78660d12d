"""Sandboxed processes have no network, and end with their time or with the grading process."""

import os
import re
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import psutil
from tiny_class import Class

from rbclassroom.assignments import sandbox
from rbclassroom.assignments.grade import grade

ROOT = Path(__file__).parents[3]


def test_a_process_in_the_sandbox_cannot_connect_to_a_server_outside(tmp_path):
    sandbox.prepare(tmp_path)
    code = "import socket, sys; socket.create_connection(('127.0.0.1', int(sys.argv[1])), 5)"
    with socket.create_server(("127.0.0.1", 0)) as server:
        words = [sys.executable, "-c", code, str(server.getsockname()[1])]
        subprocess.run(words, check=True)
        boxed, environment = [*sandbox.box(tmp_path, 60), *words], sandbox.environment(tmp_path)
        done = subprocess.run(boxed, env=environment, stderr=subprocess.PIPE, text=True)
    assert re.search(r"^ConnectionRefusedError|Network is unreachable", done.stderr, re.MULTILINE)


def test_a_submission_that_takes_too_long_is_ended(tmp_path, template, monkeypatch):
    course, places = Class(tmp_path, template), Path(tempfile.mkdtemp())
    with (tmp_path / "nbgrader_config.py").open("a") as config:
        config.write("c.BoxedExecute.seconds = 9\n")
    monkeypatch.setenv("TMPDIR", str(places))
    course.submit("ann", half="import time\nwhile True:\n    time.sleep(9)")
    grade(["ps0"], tmp_path)
    why = "the 9 s for the notebook were over in or before cell 5, answer of “A tiny set”"
    assert course.rows()["ann"]["remarks"] == f"refused: {why}; grade by hand"
    assert [path for path in places.iterdir() if not path.name.startswith("pymp-")] == []


def test_a_sandbox_ends_with_the_process_that_grades(tmp_path, template):
    course = Class(tmp_path, template)
    asleep = f"8{os.getpid():08d}"
    course.submit("ann", half=f"import subprocess\nsubprocess.run(['sleep', '{asleep}'])")
    code = "from pathlib import Path; from rbclassroom.assignments.grade import grade\n"
    code += f"if __name__ == '__main__': grade(['ps0'], Path({str(tmp_path)!r}))\n"
    (tmp_path / "begin.py").write_text(code)
    job = psutil.Popen([sys.executable, str(tmp_path / "begin.py")], cwd=ROOT)
    while not (begun := [p for p in psutil.process_iter(["cmdline"]) if asleep in str(p.info)]):
        assert job.poll() is None
        time.sleep(0.1)
    family = [*job.children(recursive=True), *begun]
    job.kill()
    job.wait()
    assert psutil.wait_procs(family, timeout=60)[1] == []
