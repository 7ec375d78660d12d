"""Hand out, collect and grade problem sets from the command line, in the course's folder."""

import argparse
import io
import sys
from datetime import datetime
from pathlib import Path

from nbclient.exceptions import CellExecutionError

from rbclassroom.assignments.collect import LISTS, collect
from rbclassroom.course.folder import require_writable


def main() -> None:
    """Run a task of ``python -m rbclassroom.assignments``: handout, collect or grade."""
    parser = argparse.ArgumentParser(prog="python -m rbclassroom.assignments")
    tasks = parser.add_subparsers(dest="task", required=True)
    task = tasks.add_parser("handout", help="pack a problem set for students")
    task.add_argument("set", help="the name of the problem set, such as ps1")
    task.add_argument("--solutions", action="store_true", help="write the model answers instead")
    task = tasks.add_parser("collect", help="sort the downloads from Moodle and Canvas")
    task.add_argument("folder", type=Path)
    task.add_argument("--due", type=datetime.fromisoformat, help='such as "2026-12-01 23:59"')
    task = tasks.add_parser("grade", help="grade the collected submissions")
    task.add_argument("sets", nargs="*", metavar="set", help="such as ps1; by default all sets")
    risk = "grade even if there is no sandbox: submissions can then do all that you can do"
    task.add_argument("--without-box", action="store_true", help=risk)
    known, assignments = parser.parse_args(), Path("notebooks", "assignments")
    if isinstance(sys.stdout, io.TextIOWrapper):  # some consoles cannot print every letter
        sys.stdout.reconfigure(errors="replace")
    try:
        require_writable(Path())
        if known.task == "grade":  # nbgrader is imported here because the import takes a second
            from rbclassroom.assignments.grade import grade

            grade(known.sets, assignments, known.without_box)
        elif known.task == "collect":
            rows = collect(known.folder, assignments, known.due)
            for kind in LISTS:
                own = [f"  {what}: {why}" for name, what, why in rows if name == kind]
                if own or kind == "collected":
                    print(f"{kind}: {len(own)}", *own, sep="\n")
        else:
            from rbclassroom.assignments.handout import make_handout, make_solutions

            if known.solutions:
                print(make_solutions(known.set, assignments))
            else:
                print(make_handout(known.set, assignments, Path()))
    except (OSError, ValueError, CellExecutionError) as error:
        sys.exit(str(error))
    except KeyboardInterrupt:
        sys.exit(130)


if __name__ == "__main__":
    main()
