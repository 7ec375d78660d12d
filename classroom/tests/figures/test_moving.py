"""Animations of the lessons follow the mathematics in every frame."""

import numpy as np
import pytest
from matplotlib.figure import Figure

import rbcourse as rb
from rbclassroom.figures import lesson08, lesson11

T = np.linspace(0, 1, 21)
POINTS = np.array([[0, 0], [1, 2], [3, 2.5], [4, 0.5]])
SIGMA = np.pi / 6 * np.array([1, 2, 3])  # BK (21)
ENDS = np.eye(3), rb.exp_so3(SIGMA), SIGMA, SIGMA + np.array([5, 0, 0])
V = np.array([0, -0.8, 0.6])


@pytest.fixture
def axes():
    """Return axes in the plane, and in space."""
    fig = Figure()
    return [fig.add_subplot(1, 2, k, projection=kind) for k, kind in ((1, None), (2, "space"))]


def places(artist):
    return np.array(artist.get_data_3d() if hasattr(artist, "get_data_3d") else artist.get_data())


def test_the_book_and_its_pin_turn_together(axes):
    edges, turned = np.array([2.0, 1, 0.5]), rb.exp_so3(np.outer(np.linspace(0, 6, 9), [1, 2, 3]))
    times = np.linspace(0, 24, 9)
    update = lesson08.moving_book(axes[1], times, turned, edges)
    flat = (np.indices((2, 2, 2)).reshape(3, -1).T - 0.5) * edges
    for i in (0, 3, 8, 1):
        book, pin, clock = update(i)
        assert clock.get_text() == f"$t = {times[i]:.1f}$"
        corners = np.unique(book.corners[:6].reshape(-1, 3).round(12), axis=0)
        assert np.abs(np.sort(corners, 0) - np.sort(flat @ turned[i].T, 0)).max() < 1e-11
        foot, tip = places(pin).T
        assert np.abs(foot - edges[1] / 2 * turned[i, :, 1]).max() < 1e-14
        assert np.abs(np.cross(tip, foot)).max() < 1e-14
        assert tip @ foot > foot @ foot


def test_the_description_states_when_the_book_turns_over():
    t = np.linspace(0, 4, 41)
    over = rb.exp_so3(np.outer(np.where(t > 1.95, np.pi, 0), [1, 0, 0]))
    upright, still = rb.exp_so3([np.pi / 2, 0, 0]), np.broadcast_to(np.eye(3), over.shape)
    for R, fate in (
        (over @ upright, "up, and turns over at t = 2.0."),
        (still @ upright, "up, and stays there."),
        (still, "down, and stays there."),
    ):
        assert f"It starts {fate}" in lesson08.describe_book(t, R)


@pytest.fixture(scope="module")
def level():
    """Return a function: ``level(name, k)`` gives the points of level k of the construction.

    The points have the shape (4 - k, 2 or 3, times).
    """
    table = lesson11.casteljau_table(T, POINTS, ENDS, V)

    def points(name, k):
        letters = "xy" if name == "plane" else "xyz"
        columns = [f"{name} level {k} point {j} {x} [1]" for j in range(4 - k) for x in letters]
        return np.array([table[column] for column in columns]).reshape(4 - k, -1, len(T))

    return points


def test_de_casteljaus_construction_gives_beziers_curve(level):
    s = 1 - T
    bernstein = np.array([s**3, 3 * s**2 * T, 3 * s * T**2, T**3])
    assert np.abs(level("plane", 3)[0] - POINTS.T @ bernstein).max() < 1e-12
    assert np.abs(level("sphere", 3)[0].T - rb.closed_forms.bezier(*ENDS)(T) @ V).max() < 1e-12
    R0, R1, w0, w1 = ENDS
    controls = R0, R0 @ rb.exp_so3(w0 / 3), R1 @ rb.exp_so3(-w1 / 3), R1
    assert np.abs(np.moveaxis(level("sphere", 0), 2, 0) - controls @ V).max() < 1e-14
    assert np.array_equal(level("plane", 0)[:, :, 3], POINTS)


def test_the_construction_moves_along_lines_and_geodesics(axes, level):
    update = lesson11.moving_casteljau(axes, T, POINTS, ENDS, V)
    for i in (0, 4, 20, 7):
        clock, *artists = update(i)
        assert clock.get_text() == f"$t = {T[i]:.2f}$"
        for name, (*legs, curve, point) in (("plane", artists[:4]), ("sphere", artists[4:])):
            for k, leg in enumerate(legs, 1):
                marked = places(leg)[:, leg.get_markevery()]
                assert np.abs(marked.T - level(name, k)[..., i]).max() < 1e-12
            assert np.array_equal(places(curve), level(name, 3)[0][:, : i + 1])
            assert np.array_equal(places(point)[:, 0], level(name, 3)[0][:, i])
    straight, arc = (places(artists[k]) for k in (1, 5))
    a, b = level("plane", 2)[..., 7]
    assert np.abs(straight - (a[:, None] + np.outer(b - a, np.linspace(0, 1, 33)))).max() < 1e-12
    assert np.abs(np.linalg.norm(arc, axis=0) - 1).max() < 1e-12
    # the arc lies in one plane, so it is a circle
    assert np.linalg.svd(arc - arc[:, :1], compute_uv=False)[2] < 1e-12
    assert np.ptp(np.linalg.norm(np.diff(arc, axis=1), axis=0)) < 1e-12
    first, last = (np.degrees(np.linalg.norm(w) / 3) for w in ENDS[2:])
    said = lesson11.describe_casteljau(ENDS)
    assert f"next are {first:.0f}, " in said
    assert f", {last:.0f} degrees." in said
