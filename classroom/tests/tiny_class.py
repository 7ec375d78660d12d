"""A course folder with the tiny problem set, and functions that hand in answers."""

import csv
import html
import json
import re
import shutil
import uuid

from nbgrader.api import Gradebook
from nbgrader.converters import GenerateAssignment
from tiny_set import answered, write_tiny_set

from rbclassroom.assignments.grade import course_config, run_step
from rbclassroom.assignments.handout import release

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


def limit(cell):
    begun = re.search(r"begun-\\w+", cell.source)
    while begun and not list(Path(tempfile.gettempdir()).glob(f"*/work/{begun[0]}")):
        time.sleep(0.01)
    return 0.1 if begun else None


c.Execute.timeout_func = limit
"""


def make_template(folder):
    """Write a course folder with the tiny set and its gradebook.

    A time limit applies only to cells that report that they have `begun`. Returns the folder, and
    the set as it is handed out.
    """
    write_tiny_set(folder)
    (folder / "nbgrader_config.py").write_text(CONFIG)
    assert run_step(GenerateAssignment, course_config("ps0", folder))["success"]
    return folder, release("ps0", folder)["ps0.ipynb"]


def begun():
    """Return code that reports, under a new name, that the endless part of a cell begins."""
    return f"open('begun-{uuid.uuid4().hex}', 'w').close()"


class Class:
    """A course folder with the tiny problem set, and functions that hand in answers."""

    def __init__(self, folder, template):
        made, self.given = template
        self.folder = shutil.copytree(made, folder, dirs_exist_ok=True)

    def gradebook(self):
        return Gradebook(f"sqlite:///{self.folder / 'gradebook.db'}")

    def submit(self, student, change=None, **answers):
        """Hand in the given answers, and right answers to the other questions."""
        notebook = answered(self.given.decode(), change, **answers)
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

    def page(self, student):
        return (self.folder / "feedback" / student / "ps0" / "ps0.html").read_text("utf-8")

    def feedback(self, student):
        return html.unescape(re.sub(r"<[^>]*>", "", self.page(student).split("<body>", 1)[1]))
