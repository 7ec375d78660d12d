"""Explorers for pages without Python, which a script computes, or of which states are recorded."""

import hashlib
import html
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from itertools import product
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pooch
from matplotlib.colors import to_hex
from matplotlib.text import Text

import rbcourse
from rbclassroom import explorers, figures
from rbclassroom.explorers.explorer import Explorer, numbers
from rbclassroom.explorers.paths import JOINED
from rbclassroom.figures import FORMS
from rbcourse.draw.display import Player
from rbcourse.draw.space import IN_SPACE, Faces, scenes
from rbcourse.files import replace_file

_ABOUT = "This is a recording. In the lesson, with Python, you can move every control in all steps."
MOVED: dict[str, tuple[Mapping[str, Sequence[Any]], int]] = {
    "body": (
        {
            "about": ["z, through the covers", "the diagonal x + y + z"],
            "turn": [90, 110, 115, 130, 150],
        },
        2,
    ),
    "chain": ({"curve": JOINED}, 1),
    "cube": ({"spin": range(-5, 6, 2)}, 2),
    "double_cover": ({"untwist": [tenths / 10 for tenths in range(11)]}, 3),
    "flip": ({"axis": ["axis 1", "axis 2", "axis 3"]}, 1),
    "minimum_acceleration": ({"rival": list(FORMS), "size": [0.5, 1, 1.5]}, 2),
    "random": ({"sampler": ["three angles", "uniform"], "seed": range(3)}, 4),
    "smoothing": ({"noise": [0.2, 1, 2, 5]}, 3),
    "spline": ({"pitch": [-60, -40, -20, 20, 60], "third": [2, 2.5, 3]}, 2),
    "timing": ({"angular_speed": [0.5, 1, 2], "acceleration": [0.5, 1, 2, 4, 6]}, 4),
}
"""The recorded values of controls of each explorer, and the stride of the control that plays."""
COMPUTED = Path(__file__).with_name("computed.js").read_text(encoding="utf-8")
"""The JavaScript of the explorers that pages compute; it follows ``ENGINE``."""
SCRIPTED: dict[str, Sequence[str]] = {
    "arm": ["theta0", "theta1", "t"],
    "interpolation": ["yaw1", "pitch1", "t"],
    "planar": ["omega1", "omega2", "t"],
    "projection": ["e12", "e23", "e33", "pull"],
    "rotation": ["alpha", "beta", "gamma"],
    "screw": ["angle", "tilt", "t"],
    "theta": ["angle", "t"],
}
"""The explorers that computed.js computes, and their controls; the other controls are fixed."""
_SLOWEST_FIRST = sorted(
    [*MOVED, *SCRIPTED], key=["rotation", "projection", "spline"].__contains__, reverse=True
)


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


def computed(explorer: Explorer, name: str) -> Player:
    """Return an explorer as a figure that computed.js moves, in all steps of its controls."""
    now, plays, height = explorer.values, explorer.plays, explorer.display.size[1]
    shown = explorer.state()
    still = explorer.draw(shown.shown, zoom=2)
    explorer.state(**{plays: explorer.steps[len(explorer.steps) // 2]})  # nothing is empty here
    stays = [
        f"{control.description} = {_text(now[key])}"
        for key, control in explorer.controls.items()
        if key not in SCRIPTED[name]
    ]
    more = f". Fixed here: {'; '.join(stays)}" if stays else ""
    if explorer.picture.made["clickable"]:
        more += ". Drag in the picture, or move the sliders."
    fig = next(iter(explorer.artists.values())).figure
    inside = [artist for scene in scenes(fig) for artist in scene.artists]
    fixed = {"": [artist for artist in inside if artist not in explorer.artists.values()]}
    parts, states = list[dict[str, Any]](), list[Any]()
    for key, shown_now in {**fixed, **{k: [each] for k, each in explorer.artists.items()}}.items():
        for each in inside:
            each.set_visible(each in shown_now)
        states.append(explorer.display.record(shown_now))
        parts.append({"name": key, **(_places(shown_now[0], height) if key else {})})
    for each in inside:
        each.set_visible(True)
    controls = list[dict[str, Any]]()
    for key, control in explorer.controls.items():
        values = explorer.steps if key == plays else _values(control)
        values = values if key in SCRIPTED[name] else [now[key]]
        texts = control._options_labels if key == plays else [_text(value) for value in values]
        first = int(np.argmin(np.abs(np.array(values) - now[key])))
        controls.append({"label": control.description, "values": texts, "first": first})
        controls[-1]["plays"] = key == plays
    return Player(
        f"{name}_explorer",
        shown.texts[-1],
        f"<figcaption>{html.escape(explorer.name + more)}</figcaption>",
        still,
        explorer.background,
        explorer.display,
        states,
        controls,
        explorer.play.interval,
        computed=name,
        script=COMPUTED,
        parts=parts,
    )


def _places(artist: Any, height: int) -> dict[str, Any]:
    """Return the map from the coordinates of an artist to pixels, and the place of a name."""
    if isinstance(artist, IN_SPACE):
        scale, middle = artist.axes.sight().scale, artist.axes.sight().middle
        axes = [part for x in middle for part in (scale, -scale * x)]
        if isinstance(artist, Faces):
            return {"axes": axes, "colours": [to_hex(colour) for colour in artist._colours]}
        return {"axes": axes}
    to_pixels = artist.axes.transData.transform
    x, y = to_pixels([[0, 0], [1, 1]]).T
    axes = [x[1] - x[0], x[0], y[0] - y[1], height - y[0]]
    found: dict[str, Any] = {"axes": [round(float(each), 9) for each in axes]}
    if isinstance(artist, Text):
        right, up = to_pixels(artist.get_position())
        found["anchor"] = [round(right), height - round(up)]
    return found


def _values(slider: Any) -> list[float]:
    count = round((slider.max - slider.min) / slider.step) + 1
    return np.linspace(slider.min, slider.max, count).round(9).tolist()


def _text(value: Any) -> str:
    return value if isinstance(value, str) else numbers(value, 2).rstrip("0").rstrip(".")


def living(name: str) -> str:
    """Return the HTML of an explorer that moves without Python; it is recorded only once."""
    file = _stored(name)
    if not file.exists():
        file.parent.mkdir(parents=True, exist_ok=True)
        explorer = getattr(explorers, f"{name}_explorer")()
        if name in SCRIPTED:
            figure = computed(explorer, name)
        else:
            figure = record(explorer, f"{name}_explorer", *MOVED[name])
        replace_file(file, figure._repr_html_().encode())
    return file.read_text("utf-8")


def record_all() -> None:
    """Record the explorers that are not yet recorded, in as many processes as processors."""
    missing = [name for name in _SLOWEST_FIRST if not _stored(name).exists()]
    if missing:
        print(f"Recording {len(missing)} explorers, for pages without Python ...", flush=True)
        # a new process has no threads of the server or of the tests that call this function
        with ProcessPoolExecutor(mp_context=get_context("spawn")) as pool:
            for _ in pool.map(living, missing):
                print(".", end="", flush=True)
        print(flush=True)


def _stored(name: str) -> Path:
    return pooch.os_cache("rbcourse") / "explorers" / f"{name}-{_version()}.html"


@cache
def _version() -> str:
    """Return a digest of all code and styles on which a recorded explorer depends."""
    digest = hashlib.sha256(matplotlib.__version__.encode())
    for folder in (*rbcourse.__path__, *explorers.__path__, *figures.__path__):
        for path in sorted(Path(folder).rglob("*.*")):
            if path.suffix in (".py", ".js", ".mplstyle", ".ttf"):
                digest.update(path.read_bytes())
    return digest.hexdigest()[:16]
