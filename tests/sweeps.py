"""Each slider of an explorer at 25 places of its range, and pairs of extremes."""

import html
import re
from itertools import combinations

import numpy as np
from PIL import Image

_BLANK = Image.new("RGB", (1, 1))


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
    """Put each setting on top of these values; give all values, of those that can be served.

    The artists move, but no picture is made of them: test_explore.py looks at pictures.
    """
    first, paint = explorer.values | base, explorer._paint
    explorer._paint = lambda artists: _BLANK
    for setting in settings(explorer):
        explorer.put(**first | setting)
        if not explorer.notice.value.startswith('<b role="alert">Nothing'):
            yield explorer.values
    explorer._paint = paint


def points(artist):
    """The points of a line in the plane or in space, shape (n, 2) or (n, 3)."""
    if hasattr(artist, "get_data_3d"):
        return np.stack(artist.get_data_3d(), axis=-1)
    return np.stack(artist.get_data(), axis=-1)


def corners(box):
    """The corners of the first six faces of a box, shape (6, 4, 3)."""
    return np.asarray(box._faces)[:6]


def _range(control):
    if hasattr(control, "options"):
        return list(control.options)
    steps = round((control.max - control.min) / control.step)
    chosen = np.unique(np.append(np.linspace(0, steps, 24), steps / 2).round())
    return [control.min + i * control.step for i in chosen[:-1]] + [control.max]


def read_off(explorer):
    """What is to be read, by name, with plain minus signs and spaces."""
    text = explorer.said.value.replace("−", "-").replace("\u2007", " ")
    rows = re.findall(r"<tr[^>]*><td[^>]*>(.*?)</td><td[^>]*>(.*?)</td></tr>", text, re.S)
    return {html.unescape(name): html.unescape(value) for name, value in rows}


def numbers_in(text):
    """The numbers of a text."""
    return np.array(re.findall(r"-?\d+(?:\.\d+)?(?:e-?\d+)?", text), dtype=float)
