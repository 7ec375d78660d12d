"""Show a lesson to a class, or test it before class."""

import argparse
import sys
from pathlib import Path

from rbclassroom.course.lecture import find_lesson, open_votes, present
from rbclassroom.course.rehearsal import check


def main() -> None:
    """Show a lesson from the command line, in the folder of the course."""
    parser = argparse.ArgumentParser(prog="course.py lecture")
    parser.add_argument("lesson", help="its number: 01")
    parser.add_argument("--check", action="store_true", help="test it before class; show nothing")
    parser.add_argument("--no-browser", action="store_true", help="print the address only")
    parser.add_argument("--votes", nargs="?", const="", metavar="ADDRESS", help="of this machine")
    words = parser.parse_args()
    try:
        path = find_lesson(words.lesson, Path("notebooks"))
        if words.check:
            missing = check(path)
            print("\n".join(f"not ready: {what}" for what in missing) or "ready")
            sys.exit(bool(missing))
        phones = None if words.votes is None else open_votes(words.votes)
    except ValueError as error:
        sys.exit(str(error))
    present(path, not words.no_browser, phones)


if __name__ == "__main__":
    main()
