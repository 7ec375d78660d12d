"""What the explorer of real bodies draws and says is what the package computes."""

import numpy as np
import pytest
from mpl_toolkits.mplot3d import proj3d
from sweeps import corners, numbers_in, points, read_off, sweep

import rbcourse as rb
from rbclassroom.explorers import body_explorer

AXES = {"the diagonal x + y + z": [1, 1, 1], "x,": [1, 0, 0], "y,": [0, 1, 0], "z,": [0, 0, 1]}
LAWS = "as if a ball", "least acceleration", "least torque"
KNOWN = {}


@pytest.fixture(scope="module")
def books():
    return body_explorer()


def solved(about, turn, thickness):
    """The three curves, the inertia, and both costs of each; each is solved once."""
    key = about, turn, thickness
    if key not in KNOWN:
        (axis,) = (np.array(x, float) for name, x in AXES.items() if about.startswith(name))
        G = rb.metrics.box_inertia([0.3, 0.2, thickness / 100])
        rest = np.zeros(3)
        goal = rb.exp_so3(np.radians(turn) * axis / np.linalg.norm(axis))
        ends = np.eye(3), goal, rest, rest
        curves = [
            rb.minimum_acceleration_so3(*ends),
            rb.minimum_acceleration_so3(*ends, G),
            rb.minimum_torque_so3(*ends, G),
        ]
        costs = [[float(f(c, G)) for c in curves] for f in (rb.acceleration_cost, rb.torque_cost)]
        KNOWN[key] = curves, G, costs
    return KNOWN[key]


@pytest.mark.source("beyond BK 3", "beyond BK 4")
def test_three_books_their_torques_and_their_costs(books):
    for v in sweep(books, t=0.4):
        curves, G, costs = solved(v["about"], v["turn"], v["thickness"])
        half = 4.2 * np.array([0.3, 0.2, v["thickness"] / 100]) / 2
        for law, curve in zip(LAWS, curves, strict=True):
            faces, R = corners(books.artists[law]), curve(v["t"])
            assert np.abs(faces.mean(axis=1)[:3] - (half * R).T).max() < 1e-11
            t, torque = points(books.artists[f"{law} torque"]).T
            w, h = curve(t, 1), 1e-5
            inner = slice(1, -1)
            rate = (curve(t[inner] + h, 1) - curve(t[inner] - h, 1)) / (2 * h)
            exact = np.linalg.norm(rate @ G + np.cross(w[inner], w[inner] @ G), axis=-1)
            assert np.abs(torque[inner] - exact).max() < 1e-6
            assert torque.max() < 0.3
        said = read_off(books)
        for name, values in zip(("acceleration", "torque"), costs, strict=True):
            told = numbers_in(said[name])
            assert told == pytest.approx(np.array(values) / min(values), abs=5.1e-3)


def test_the_examples_of_the_lesson(books):
    books.restart()
    assert read_off(books) == {
        "acceleration": "1.00, 1.00, 1.30 × the least",
        "torque": "1.11, 1.11, 1.00 × the least",
    }
    books.put(about="the diagonal x + y + z")
    assert read_off(books) == {
        "acceleration": "1.36, 1.00, 1.04 × the least",
        "torque": "1.62, 1.03, 1.00 × the least",
    }


def test_no_book_leaves_its_picture(books):
    for v in sweep(books, thickness=30.0):
        for i, law in enumerate(LAWS):
            box = books.artists[law]
            x, y, _ = proj3d.proj_transform(*corners(box).reshape(-1, 3).T, box.axes.get_proj())
            x, y = box.axes.transData.transform(np.stack([x, y], axis=-1)).T
            assert 187 * i - 15 < x.min(), v
            assert x.max() < 187 * (i + 1) + 15, v
            assert 150 < y.min() < y.max() < 350, v
