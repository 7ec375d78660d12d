"""Compare the routes in `docs/routes.md` with the run sheets and the times of the lessons."""

import re
from itertools import pairwise
from pathlib import Path

import nbformat
import pytest

ROOT = Path(__file__).parents[1]
NOTEBOOKS = ROOT / "notebooks"
LESSONS = {path.name[:2]: path for path in sorted(NOTEBOOKS.glob("[0-9][0-9]_*.ipynb"))}
ROUTES = re.split(r"^## ", (ROOT / "docs" / "routes.md").read_text("utf-8"), flags=re.MULTILINE)[1:]
ORDER = "first", "second"


def sessions(number):
    """Return the minutes of the rows of each session of a lesson, by the names of the rows."""
    (time,) = re.findall(r"^\| Time \| (.*) \|$", text_of(number), re.MULTILINE)
    lengths = map(int, re.findall(r"(\d+) (?:minutes|more)", time))
    sheet = (NOTEBOOKS / "slides" / f"{number}.md").read_text("utf-8")
    sheets = sheet[: sheet.index("\n## ", 9)].split("| minute |")[1:]
    for length, rows in zip(lengths, sheets, strict=True):
        found = re.findall(r"^\| (\d+) \| ([^,|:]*)", rows, re.MULTILINE)
        starts = [int(minute) for minute, _ in found] + [length]
        names = [name.strip() for _, name in found]
        yield {name: b - a for name, (a, b) in zip(names, pairwise(starts), strict=True)}


def text_of(number):
    return "\n".join(cell.source for cell in nbformat.read(LESSONS[number], 4).cells)


def minutes(word):
    """Return the minutes of ``03``, of ``04, first``, or of a problem set."""
    if word.startswith("ps"):
        return 50
    number, _, which = word.partition(", ")
    there = list(sessions(number))
    assert (len(there) > 1) == bool(which), word
    return sum(there[ORDER.index(which) if which else 0].values())


@pytest.mark.parametrize("route", ROUTES[:4], ids=["2 × 50", "2 × 90", "4 hours", "12 hours"])
def test_the_minutes_of_a_route_follow_from_the_run_sheets(route):
    total = 0
    for word, stated, without in re.findall(r"^\| (\d\d.*?) \| (\d+) \|(.*)\|$", route, re.M):
        number, _, which = word.partition(", ")
        rows = list(sessions(number))[ORDER.index(which) if which else 0]
        left_out = [name.strip() for name in without.split(";") if name.strip()]
        assert int(stated) == minutes(word) - sum(rows[name] for name in left_out)
        total += int(stated)
    assert f"Total: {total} minutes." in route


def test_the_minutes_of_a_term_are_those_of_its_sessions():
    total, taught = 0, []
    for words, stated in re.findall(r"^\| \d+ – \d+ \| (.*) \| (\d+) \|$", ROUTES[4], re.M):
        assert int(stated) == sum(map(minutes, words.split("; ")))
        total, taught = total + int(stated), taught + words.split("; ")
    assert f"Total: {total} minutes." in ROUTES[4]
    assert {word[:2] for word in taught if word[0] != "p"} == set(LESSONS) - {"00"}
    assert len(taught) == 28


def test_the_four_hours_end_at_figure_5():
    assert re.findall(r"^\| (\d\d)", ROUTES[2], re.M)[-1] == "10"
    assert "Total: 240 minutes." in ROUTES[2]
