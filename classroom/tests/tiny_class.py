"""A course folder with the tiny set, and students who hand in."""

import csv
import html
import json
import re
import shutil
import uuid

import nbformat
from nbgrader.api import Gradebook
from nbgrader.converters import GenerateAssignment
from tiny_set import ANSWERS, write_tiny_set

from rbclassroom.assignments.grade import course_config, run_step
from rbclassroom.assignments.handout import release


def cell(notebook, grade_id):
    """The cell of a name."""
    (found,) = [
        c for c in notebook.cells if c.metadata.get("nbgrader", {}).get("grade_id") == grade_id
    ]
    return found


CONFIG = """
import re
import tempfile
import time
from pathlib import Path

from rbclassroom.assignments.autograding import configure

c = get_config()
configure(c)
c.Execute.timeout = 1
c.Execute.iopub_timeout = 600
ENDLESS = "endless"


def limit(cell):
    if ENDLESS not in cell.source:
        return None
    own = re.search(r"BEGUN-\\w+", cell.source)
    name = own[0] if own else "BEGUN-*"
    while not (begun := list(Path(tempfile.gettempdir()).glob(f"*/work/{name}"))):
        time.sleep(0.01)
    begun[0].unlink()
    return 1


c.Execute.timeout_func = limit
"""


def make_template(folder):
    """Write a course folder with the tiny set and its gradebook.

    Only cells whose source says that they are endless have a limit, a second from when they write
    a file that says that they have begun. Returned are the folder, the set as it is handed out,
    and how the names of these files begin.
    """
    begun = f"begun-{uuid.uuid4().hex}"
    write_tiny_set(folder)
    (folder / "nbgrader_config.py").write_text(CONFIG.replace("BEGUN", begun))
    assert run_step(GenerateAssignment, course_config("ps0", folder))["success"]
    return folder, release("ps0", folder)["ps0.ipynb"], begun


class Class:
    """A course folder with the tiny set, and students who hand in."""

    def __init__(self, folder, template):
        made, self.given, self.begun = template
        self.folder = shutil.copytree(made, folder, dirs_exist_ok=True)

    @property
    def begin(self):
        """What a cell writes when it begins; each has its own."""
        return f"open('{self.begun}-{uuid.uuid4().hex}', 'w').close()"

    def gradebook(self):
        return Gradebook(f"sqlite:///{self.folder / 'gradebook.db'}")

    def submit(self, student, change=None, **answers):
        """Hand in the right answers, but for those that are given, changed."""
        notebook = nbformat.reads(self.given.decode(), as_version=4)
        given = {name.replace("_", "-") + "-answer": text for name, text in answers.items()}
        for name, text in (ANSWERS | {"words-answer": "It is."} | given).items():
            cell(notebook, name).source = text
        if change:
            change(notebook)
        self.submit_bytes(student, json.dumps(notebook).encode())

    def submit_bytes(self, student, content, name="ps0.ipynb"):
        path = self.folder / "submitted" / student / "ps0" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)

    def rows(self):
        with (self.folder / "ps0-grades.csv").open(encoding="utf-8-sig", newline="") as table:
            return {row["student"]: row for row in csv.DictReader(table)}

    def graded(self, student):
        return self.folder / "autograded" / student / "ps0" / "ps0.ipynb"

    def feedback(self, student):
        """The text of the feedback."""
        page = (self.folder / "feedback" / student / "ps0" / "ps0.html").read_text("utf-8")
        return html.unescape(re.sub(r"<[^>]*>", "", page.split("<body>", 1)[1]))
