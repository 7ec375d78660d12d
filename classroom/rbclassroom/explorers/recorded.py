"""Explorers for pages without Python, with recorded states of some controls."""

import html
import sys
from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path
from string import Template
from typing import Any

from rbclassroom import explorers
from rbclassroom.course import options
from rbclassroom.course.agreement import reconciled
from rbclassroom.course.notebooks import regenerate
from rbclassroom.explorers.explorer import Explorer, numbers
from rbclassroom.explorers.paths import JOINED
from rbcourse.draw.display import Player
from rbcourse.draw.save import FORMS
from rbcourse.files import replace_file

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

_ABOUT = "This is a recording. In the lesson, with Python, you can move every control in all steps."
MOVED: dict[str, tuple[Mapping[str, Sequence[Any]], int]] = {
    "arm": ({"theta0": range(-170, 131, 60), "theta1": range(-180, 181, 60)}, 4),
    "body": (
        {
            "about": ["z, through the covers", "the diagonal x + y + z"],
            "turn": [90, 110, 115, 130, 150],
        },
        2,
    ),
    "chain": ({"curve": JOINED}, 1),
    "cube": ({"spin": range(-5, 6, 2)}, 2),
    "flip": ({"axis": ["axis 1", "axis 2", "axis 3"]}, 1),
    "minimum_acceleration": ({"rival": list(FORMS), "size": [0.5, 1, 1.5]}, 2),
    "planar": ({"omega1": range(-90, 91, 45), "omega2": range(-90, 91, 45)}, 2),
    "projection": ({"e12": [fifths / 5 for fifths in range(-5, 6)]}, 1),
    "random": ({"sampler": ["three angles", "uniform"], "seed": range(3)}, 4),
    "rotation": ({"alpha": range(-160, 141, 60), "gamma": range(-160, 141, 60)}, 5),
    "screw": ({"tilt": range(0, 91, 15)}, 2),
    "spline": ({"pitch": [-60, -40, -20, 20, 60], "third": [2, 2.5, 3]}, 2),
    "theta": ({"angle": range(10, 171, 10)}, 1),
    "timing": ({"angular_speed": [0.5, 1, 2], "acceleration": [0.5, 1, 2, 4, 6]}, 4),
}
"""The recorded values of controls of each explorer, and the stride of the control that plays."""


def record(
    explorer: Explorer, name: str, moved: Mapping[str, Sequence[Any]], stride: int = 1
) -> Player:
    """Return an explorer as a figure that moves without Python and has exactly these states.

    `moved` maps some controls to the values that are recorded; the present value must be one of
    them. Every `stride`-th step of the control that plays is recorded, too, including the present
    step. The other controls keep their present values.
    """
    now, plays, time = explorer.values, explorer.plays, explorer.time
    start = time.index % stride
    recorded = {**moved, plays: explorer.steps[start::stride]}
    label = {each: control.description for each, control in explorer.controls.items()}
    stays = [f"{label[each]} = {_text(now[each])}" for each in now if each not in recorded]
    fixed = f" These controls are fixed here: {'; '.join(stays)}." if stays else ""
    caption = (
        f"{html.escape(explorer.name)} <details><summary>About this picture</summary>"
        f"{html.escape(_ABOUT + fixed)}</details>"
    )
    shown = explorer.state()
    still = explorer.draw(shown.shown, zoom=2)  # drawn now, because recording moves the artists
    states = [
        explorer.state(**dict(zip(recorded, values, strict=True)))
        for values in product(*recorded.values())
    ]
    controls: list[dict[str, Any]] = [
        {
            "label": label[each],
            "values": [_text(value) for value in values],
            "first": list(values).index(now[each]),
        }
        for each, values in recorded.items()
    ]
    controls[-1]["values"] = time._options_labels[start::stride]  # with equally many digits
    return Player(
        name,
        shown.texts[-1],
        f"<figcaption>{caption}</figcaption>",
        still,
        explorer.background,
        explorer.display,
        [state.drawn for state in states],
        controls,
        explorer.play.interval * stride,
        [state.texts for state in states],
    )


def _text(value: Any) -> str:
    return value if isinstance(value, str) else numbers(value, 2).rstrip("0").rstrip(".")


def write_pages(folder: Path) -> None:
    """Write a page for each explorer to a folder."""
    folder.mkdir(exist_ok=True)
    for name, moved in MOVED.items():
        print(f"{name} ...", flush=True)
        explorer = getattr(explorers, f"{name}_explorer")()
        figure = record(explorer, f"{name}_explorer", *moved)._repr_html_()
        page = _PAGE.substitute(title=html.escape(explorer.name), figure=figure)
        file = folder / f"{name}.html"
        if file.exists():
            page = reconciled(file.read_text("utf-8"), page)
        replace_file(file, page.encode())


def main() -> None:
    """Run lessons and explorers again, in the folder of the course, and store the changes."""
    lessons = options.parse("figures")[0].lessons
    try:
        regenerate(Path("notebooks"), Path("figures"), lessons)
    except (OSError, ValueError) as error:
        sys.exit(str(error))
    if not lessons:
        write_pages(Path("figures", "explorers"))


if __name__ == "__main__":
    main()
