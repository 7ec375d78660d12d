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
    """What a state draws: (style, whether it goes on, places in pixels) of each polygon.

    What is in space has styles with more parts, and places with three numbers.
    """
    found, i = [], 0
    while i < len(state):
        size = 3 if len(styles[state[i]]) > 8 else 2
        end = i + 2 + size * abs(int(state[i + 1]))
        places = state[i + 2 : end].reshape(-1, size).cumsum(axis=0) / PARTS
        found.append((styles[state[i]], state[i + 1] < 0, places))
        i = end
    return found
