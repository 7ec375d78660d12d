"""Hand out, collect and grade problem sets from the command line, in the course's folder."""

import io
import sys
from collections import Counter
from pathlib import Path

from nbclient.exceptions import CellExecutionError

from rbclassroom.assignments.collect import LISTS, collect
from rbclassroom.course import options
from rbclassroom.course.folder import require_writable

TASKS = "handout", "collect", "grade"
TO_DO = ["perhaps late", *LISTS[LISTS.index("another set") :]]


def main() -> None:
    """Run a task of ``python -m rbclassroom.assignments``: handout, collect or grade."""
    task, *words = sys.argv[1:] or [""]
    if task not in TASKS:
        sys.exit(f"usage: python -m rbclassroom.assignments {{{','.join(TASKS)}}} ...")
    (known, _), assignments = options.parse(task, words), Path("notebooks", "assignments")
    if isinstance(sys.stdout, io.TextIOWrapper):  # some consoles cannot print every letter
        sys.stdout.reconfigure(errors="replace")
    try:
        require_writable(Path())
        if task == "grade":  # nbgrader is imported here because the import takes a second
            from rbclassroom.assignments.grade import grade

            grade(known.sets, assignments, known.without_box)
        elif task == "collect":
            rows = collect(known.folder, assignments, known.due)
            # files of students without a usable file are in their row, and not listed again
            useless = "; ".join(why for kind, _, why in rows if kind == "nothing usable")
            rows = [row for row in rows if f"{row[1]}: " not in useless]
            for kind in LISTS:
                own = [(what, why) for name, what, why in rows if name == kind]
                dated = kind == "late" and known.due
                if own or kind == "collected":
                    print(f"{kind}, after {known.due:%Y-%m-%d %H:%M}" if dated else kind, end=": ")
                    print(len(own))
                for reason in dict.fromkeys(why for _, why in own):
                    same = (what for what, why in own if why == reason)
                    print(f"  {'; '.join(same)}: {reason}")
            counts = Counter(kind for kind, _, _ in rows)
            counts["perhaps late"] = sum(why.startswith("perhaps") for _, _, why in rows)
            if wanted := ", ".join(f"{counts[kind]} {kind}" for kind in TO_DO if counts[kind]):
                print(f"Look at these: {wanted}. All rows are in submitted/report.csv.")
        else:
            from rbclassroom.assignments.handout import make_handout, make_solutions

            if known.solutions:
                print(make_solutions(known.set, assignments))
            else:
                print(make_handout(known.set, assignments, Path()))
                print(
                    "This file is for students. To solve the set here, unpack the file into work/."
                )
    except (OSError, ValueError, CellExecutionError) as error:
        sys.exit(str(error))
    except KeyboardInterrupt:
        print("Stopped.", file=sys.stderr)
        sys.exit(130)


if __name__ == "__main__":
    main()
