"""Each slider of an explorer at 25 places of its range, and pairs of extremes."""

import re
from itertools import combinations

import numpy as np


def settings(explorer):
    """Every setting to try: one control at a time over its range, then ends in pairs."""
    ranges = {name: _range(control) for name, control in explorer.controls.items()}
    for name, values in ranges.items():
        yield from ({name: value} for value in values)
    for (one, first), (other, second) in combinations(ranges.items(), 2):
        yield from (
            {one: a, other: b} for a in (first[0], first[-1]) for b in (second[0], second[-1])
        )


def sweep(explorer, **base):
    """Put each setting on top of these values; give all values, of those that can be served."""
    first = explorer.values | base
    for setting in settings(explorer):
        explorer.put(**first | setting)
        if not notice(explorer).startswith("Nothing to show"):
            yield explorer.values


def points(artist):
    """The points of a line in the plane or in space, shape (n, 2) or (n, 3)."""
    if hasattr(artist, "get_data_3d"):
        return np.stack(artist.get_data_3d(), axis=-1)
    return np.stack(artist.get_data(), axis=-1)


def corners(box):
    """The corners of the first six faces of a box, shape (6, 4, 3)."""
    return box.corners[:6]


def _range(control):
    if hasattr(control, "step"):
        steps = round((control.max - control.min) / control.step)
        values = [control.min + i * control.step for i in range(steps)] + [control.max]
    else:
        values = [option[1] if isinstance(option, tuple) else option for option in control.options]
    last = len(values) - 1
    return [
        values[round(i)] for i in np.unique(np.append(np.linspace(0, last, 24), last / 2).round())
    ]


def read_off(explorer):
    """What is to be read, by name, with plain minus signs and spaces."""
    ((rows, *_),) = explorer.picture.run["texts"]
    return {name: text.replace("−", "-").replace("\u2007", " ") for name, text in rows}


def notice(explorer):
    """What is to be noted; "" if nothing."""
    return explorer.picture.run["notice"] or explorer.picture.run["texts"][0][1]


def tell(explorer, **message):
    """Send what the browser sends: the ``index`` of a state, or the ``place`` of a click."""
    data = {"method": "custom", "content": message}
    explorer.picture._handle_msg({"content": {"data": data}, "buffers": []})


def numbers_in(text):
    """The numbers of a text."""
    return np.array(re.findall(r"-?\d+(?:\.\d+)?(?:e-?\d+)?", text), dtype=float)
