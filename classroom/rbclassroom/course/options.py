"""The options of the tasks of course.py.

course.py loads this file before it installs packages, so the file imports only the standard
library.
"""

import argparse
import re
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path

FURTHER = {"lab": "JupyterLab, such as --no-browser", "test": "pytest"}
"""The tasks that pass arguments which they do not know to another program."""


def repository(text: str) -> str:
    """Return the name of a repository on GitHub, or refuse it."""
    if not re.fullmatch(r"([\w.-]+/[\w.-]+)?", text):
        raise argparse.ArgumentTypeError(f"owner/name is wanted, got {text}")
    return text


def date(text: str) -> datetime:
    """Return a date with a time, or refuse it; a date without a time means the end of the day."""
    try:
        given = datetime.fromisoformat(text)
    except ValueError:
        wanted = 'a date such as "2026-12-01 23:59" is wanted'
        raise argparse.ArgumentTypeError(f"{wanted}, got {text}") from None
    has_time = len(text) > len("2026-12-01")
    return given if has_time else given.replace(hour=23, minute=59, second=59)


def parser(task: str, purpose: str = "") -> argparse.ArgumentParser:
    """Return the parser of a task; its help states the purpose of the task."""
    made = argparse.ArgumentParser(
        prog=f"course.py {task}", description=purpose, allow_abbrev=task not in FURTHER
    )
    if task in FURTHER:
        made.epilog = f"Further arguments go to {FURTHER[task]}."
    add = made.add_argument
    if task == "lab":
        add("--edit", action="store_true", help="edit originals, not copies in work/")
    elif task == "check":
        add("file", type=Path, help="the notebook to hand in, such as ps1.ipynb")
    elif task == "book":
        add("--serve", action="store_true", help="show the book in the browser")
        add("--live", action="store_true", help="let Python run in its pages (+ 40 MB)")
        add("--repository", type=repository, default="", help="owner/name on GitHub, for Binder")
    elif task == "lecture":
        add("lesson", help="number of the lesson, such as 01")
        add("--no-browser", action="store_true", help="only print the address")
        add("--pdf", action="store_true", help="only write the slides as PDF")
        votes = "let phones vote, at this machine's ADDRESS in their network"
        add("--votes", nargs="?", const="", metavar="ADDRESS", help=votes)
    elif task == "handout":
        add("set", help="the name of the problem set, such as ps1")
        add("--solutions", action="store_true", help="write the model answers instead")
    elif task == "collect":
        add("folder", type=Path, help="the folder with the downloads from Moodle or Canvas")
        add("--due", type=date, help='such as "2026-12-01 23:59"; without a time, 23:59:59')
    elif task == "grade":
        add("sets", nargs="*", metavar="set", help="such as ps1; by default all sets")
        risk = "grade even if there is no sandbox: submissions can then do all that you can do"
        add("--without-box", action="store_true", help=risk)
    elif task == "test":
        add("paths", nargs="*", metavar="PATH", help="files or folders; by default all tests")
    elif task == "figures":
        lessons = "the number of a lesson, such as 03; by default all lessons"
        add("lessons", nargs="*", metavar="LESSON", help=lessons)
    return made


def parse(
    task: str, words: Sequence[str] | None = None, purpose: str = ""
) -> tuple[argparse.Namespace, list[str]]:
    """Return the options of a task and its further arguments; exit if an argument is wrong."""
    made = parser(task, purpose)
    known, further = made.parse_known_args(words)
    if further and task not in FURTHER:
        spaces = "; a path with spaces needs quotation marks" * (task in ("check", "collect"))
        made.error(f"unrecognized arguments: {' '.join(further)}{spaces}")
    return known, further
