"""Sandboxed processes end after their time limit, or when the grading process ends."""

import os
import sys
import tempfile
import time
from pathlib import Path

import psutil
from tiny_class import Class

from rbclassroom.assignments.grade import grade

ROOT = Path(__file__).parents[3]


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
