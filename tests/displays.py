"""What is recorded as numbers, as polygons again."""

import numpy as np

from rbcourse.draw.display import PARTS


def split(content):
    """The states of bytes, an array of numbers each."""
    count = int(np.frombuffer(content, "<u4", 1)[0])
    sizes = np.frombuffer(content, "<u4", count, 4)
    numbers = np.frombuffer(content, "<i2", offset=4 * (count + 1))
    assert sizes.sum() == len(numbers)
    return np.split(numbers, np.cumsum(sizes)[:-1])


def polygons(state, styles):
    """What a state draws: (style, whether it goes on, places in pixels) of each polygon."""
    found, i = [], 0
    while i < len(state):
        end = i + 2 + 2 * abs(int(state[i + 1]))
        places = state[i + 2 : end].reshape(-1, 2).cumsum(axis=0) / PARTS
        found.append((styles[state[i]], state[i + 1] < 0, places))
        i = end
    return found
