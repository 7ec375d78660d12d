"""Explorers for pages without Python: the states of one control and of what plays, recorded."""

import html
import sys
from collections.abc import Sequence
from pathlib import Path
from string import Template
from typing import Any

import numpy as np

from rbclassroom import explorers
from rbclassroom.course.agreement import reconciled
from rbclassroom.explorers.explorer import Explorer, numbers
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
MOVED: dict[str, tuple[str, Any]] = {
    "arm": ("theta1", np.arange(-180, 181, 30)),
    "body": ("turn", np.arange(25, 176, 25)),
    "chain": ("leg", None),
    "cube": ("spin", np.arange(-5, 6, 2)),
    "flip": ("axis", None),
    "minimum_acceleration": ("size", np.arange(2, 15, 2) / 10),
    "planar": ("omega1", np.arange(-90, 91, 15)),
    "projection": ("e12", np.arange(-5, 6) / 5),
    "random": ("sampler", None),
    "rotation": ("gamma", np.arange(-140, 176, 45)),
    "screw": ("tilt", np.arange(0, 91, 15)),
    "theta": ("angle", np.arange(10, 171, 10)),
}
"""Of each explorer the control that is recorded beside what plays, and its values: all of a choice.

They are steps of its slider; between them nothing is made up.
"""


def record(explorer: Explorer, name: str, moved: str, values: Sequence[Any]) -> Player:
    """Return an explorer as a figure that moves without Python, in exactly these states.

    `values` are those of the control `moved`, what it is now among them; what plays has all of its
    steps, and the other controls stay as they are.
    """
    now, plays, time = explorer.values, explorer.plays, explorer.time
    labels = {each: control.description for each, control in explorer.controls.items()}
    stays = [f"{labels[each]} = {_text(now[each])}" for each in now if each not in (moved, plays)]
    fixed = f" Here these stay: {'; '.join(stays)}." if stays else ""
    caption = f"{explorer.name}, recorded.{fixed} {_LESSON}"
    shown = explorer.state()
    still = explorer.draw(shown.shown, zoom=2)  # before the artists move on
    states = [explorer.state(**{moved: x, plays: t}) for x in values for t in explorer.steps]
    return Player(
        name,
        shown.line,
        f"<figcaption>{html.escape(caption)}</figcaption>",
        still,
        explorer.background,
        explorer.display,
        [state.drawn for state in states],
        [
            {
                "label": labels[moved],
                "values": [_text(value) for value in values],
                "first": list(values).index(now[moved]),
            },
            {
                "label": labels[plays],
                "values": [text for text, _ in time.options],
                "first": time.index,
            },
        ],
        explorer.play.interval,
        [state.texts for state in states],
    )


def _text(value: Any) -> str:
    return value if isinstance(value, str) else numbers(value, 2).rstrip("0").rstrip(".")


def main(folder: Path) -> None:
    """Write a page for each explorer into a folder."""
    folder.mkdir(exist_ok=True)
    for name, (moved, values) in MOVED.items():
        print(f"{name} ...", flush=True)
        explorer = getattr(explorers, f"{name}_explorer")()
        chosen = list(explorer.controls[moved].options) if values is None else values.tolist()
        figure = record(explorer, f"{name}_explorer", moved, chosen)._repr_html_()
        page = _PAGE.substitute(title=html.escape(explorer.name), figure=figure)
        file = folder / f"{name}.html"
        if file.exists():
            page = reconciled(file.read_text("utf-8"), page)
        file.write_text(page, encoding="utf-8", newline="\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
