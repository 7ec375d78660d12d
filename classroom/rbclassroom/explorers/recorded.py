"""Explorers for pages without Python: the states of one control and of what plays, recorded."""

import argparse
import html
import sys
from collections.abc import Sequence
from pathlib import Path
from string import Template
from typing import Any

from rbclassroom import explorers
from rbclassroom.course.agreement import reconciled
from rbclassroom.course.notebooks import regenerate
from rbclassroom.explorers.explorer import Explorer, numbers
from rbclassroom.explorers.paths import JOINED
from rbcourse.draw.display import Player

_PAGE = Template("""\
<!doctype html>
<html lang="en"><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>$title</title>
<style>
  :root { color-scheme: light dark; font: 1rem sans-serif; }
  figure { margin: 0; }
  @media (prefers-color-scheme: dark) { img, canvas { filter: invert(0.93) hue-rotate(180deg); } }
</style>
$figure</html>
""")

_LESSON = "In the lesson, with Python, every control moves, with all of its steps."
MOVED: dict[str, tuple[str, Sequence[Any]]] = {
    "arm": ("theta1", range(-180, 181, 30)),
    "body": ("turn", range(25, 176, 25)),
    "chain": ("curve", JOINED),
    "cube": ("spin", range(-5, 6, 2)),
    "flip": ("axis", ["axis 1", "axis 2", "axis 3"]),
    "minimum_acceleration": ("size", [tenths / 10 for tenths in range(2, 15, 2)]),
    "planar": ("omega1", range(-90, 91, 15)),
    "projection": ("e12", [fifths / 5 for fifths in range(-5, 6)]),
    "random": ("sampler", ["three angles", "uniform"]),
    "rotation": ("gamma", range(-140, 176, 45)),
    "screw": ("tilt", range(0, 91, 15)),
    "spline": ("pitch", [-60, -40, -20, 20, 60]),
    "theta": ("angle", range(10, 171, 10)),
    "timing": ("acceleration", [0.5, 1, 2, 4, 6]),
}
"""Of each explorer the control that is recorded beside what plays, and which of its values."""


def record(explorer: Explorer, name: str, moved: str, values: Sequence[Any]) -> Player:
    """Return an explorer as a figure that moves without Python, in exactly these states.

    `values` are those of the control `moved`, its present value among them; what plays has all of
    its steps, and the other controls stay as they are.
    """
    now, plays, time = explorer.values, explorer.plays, explorer.time
    label = {each: control.description for each, control in explorer.controls.items()}
    stays = [f"{label[each]} = {_text(now[each])}" for each in now if each not in (moved, plays)]
    fixed = f" Here these stay: {'; '.join(stays)}." if stays else ""
    caption = f"{explorer.name}, recorded.{fixed} {_LESSON}"
    shown = explorer.state()
    still = explorer.draw(shown.shown, zoom=2)  # before the artists move on
    states = [explorer.state(**{moved: x, plays: t}) for x in values for t in explorer.steps]
    first = values.index(now[moved])
    controls = [
        {"label": label[moved], "values": [_text(value) for value in values], "first": first},
        {"label": label[plays], "values": list(time._options_labels), "first": time.index},
    ]
    return Player(
        name,
        shown.texts[-1],
        f"<figcaption>{html.escape(caption)}</figcaption>",
        still,
        explorer.background,
        explorer.display,
        [state.drawn for state in states],
        controls,
        explorer.play.interval,
        [state.texts for state in states],
    )


def _text(value: Any) -> str:
    return value if isinstance(value, str) else numbers(value, 2).rstrip("0").rstrip(".")


def write_pages(folder: Path) -> None:
    """Write a page for each explorer into a folder."""
    folder.mkdir(exist_ok=True)
    for name, moved in MOVED.items():
        print(f"{name} ...", flush=True)
        explorer = getattr(explorers, f"{name}_explorer")()
        figure = record(explorer, f"{name}_explorer", *moved)._repr_html_()
        page = _PAGE.substitute(title=html.escape(explorer.name), figure=figure)
        file = folder / f"{name}.html"
        if file.exists():
            page = reconciled(file.read_text("utf-8"), page)
        file.write_text(page, encoding="utf-8", newline="\n")


def main() -> None:
    """Run lessons and explorers again, in the folder of the course; store the changes."""
    parser = argparse.ArgumentParser(prog="course.py figures")
    help_ = "its number, such as 03; by default all lessons and the explorers"
    parser.add_argument("lessons", nargs="*", metavar="LESSON", help=help_)
    lessons = parser.parse_args().lessons
    try:
        regenerate(Path("notebooks"), Path("figures"), lessons)
    except (OSError, ValueError) as error:
        sys.exit(str(error))
    if not lessons:
        write_pages(Path("figures", "explorers"))


if __name__ == "__main__":
    main()
