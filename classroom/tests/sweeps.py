"""The states of explorers at all settings of their controls."""

import re
from functools import cache

import numpy as np
from mpl_toolkits.mplot3d import proj3d
from scipy.linalg import hadamard

from rbclassroom import explorers


@cache
def made(name):
    """Return an explorer; each explorer is made only once."""
    return getattr(explorers, f"{name}_explorer")()


def sweep(name, **base):
    """Apply `base` and each setting in turn to a restarted explorer; yield values, texts, artists.

    Check that each setting shows values or states why there are none. No text may contain "nan" or
    "-0".
    """
    explorer = made(name)
    explorer.restart()
    first = explorer.values | base
    for setting in settings(explorer):
        explorer.put(**first | setting)
        said = read_off(explorer)
        assert len(said) >= 2 or notice(explorer), setting
        assert not re.search(r"\bnan\b|-0\.?0*(?![.\d])", "\n".join(said.values())), setting
        if not notice(explorer).startswith("Nothing to show"):
            yield explorer.values, said, explorer.artists


def settings(explorer):
    """Yield settings. First, each control alone takes five values in its range. Then all controls
    take extreme values, so that each pair of controls takes all four combinations."""
    ranges = {name: _range(control) for name, control in explorer.controls.items()}
    for name, values in ranges.items():
        yield from ({name: value} for value in values)
    for ends in (hadamard(8)[:, 1 : len(ranges) + 1] - 1) // 2:  # the indices are 0 or -1
        yield {name: ranges[name][end] for name, end in zip(ranges, ends, strict=True)}


def _range(control):
    if hasattr(control, "step"):
        return np.linspace(control.min, control.max, 5)
    if isinstance(control.options[0], str):
        return control.options
    return [control.options[i][1] for i in np.linspace(0, len(control.options) - 1, 5).astype(int)]


def points(artist):
    """Return the points of a line in the plane or in space, shape (n, 2) or (n, 3)."""
    data = artist.get_data_3d() if hasattr(artist, "get_data_3d") else artist.get_data()
    return np.stack(data, axis=-1)


def read_off(explorer):
    """Return the displayed texts, by name, with plain minus signs and spaces."""
    ((rows, *_),) = explorer.picture.run["texts"]
    return {name: text.replace("−", "-").replace("\u2007", " ") for name, text in rows}


def reads(text, wanted):
    """Return whether the numbers in a text equal `wanted`, up to half a unit of the last digit."""
    found = re.findall(r"-?\d+(?:\.\d+)?", text)
    digits = np.array([len(each.partition(".")[2]) for each in found])
    return np.all(np.abs(np.array(found, float) - np.ravel(wanted)) <= 0.51 * 10.0**-digits)


def off(found, wanted):
    return np.abs(np.subtract(found, wanted)).max()


def assert_box(box, R, half, place=(0, 0, 0), turned=1e-11, placed=1e-11):
    """Check the orientation and the place of a box with these half edges."""
    faces = box.corners[:6]
    assert off(faces.mean(axis=(0, 1)), place) < placed
    assert off(faces.mean(axis=1)[:3] - place, (half * R).T) < turned


def assert_within(places, *limits):
    for (low, high), along in zip(limits, np.transpose(places), strict=True):
        assert low < along.min() <= along.max() < high


def assert_seen(ax, places, *limits):
    """Check that points in space, shape (..., 3), appear within these limits, in pixels."""
    x, y, _ = proj3d.proj_transform(*np.reshape(places, (-1, 3)).T, ax.get_proj())
    assert_within(ax.transData.transform(np.stack([x, y], axis=-1)), *limits)


def notice(explorer):
    return explorer.picture.run["notice"] or explorer.picture.run["texts"][0][1]


def tell(explorer, **message):
    """Send a message as the browser does: the ``index`` of a state, or the ``place`` of a click."""
    data = {"method": "custom", "content": message}
    explorer.picture._handle_msg({"content": {"data": data}, "buffers": []})
