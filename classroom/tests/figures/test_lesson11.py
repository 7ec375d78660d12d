"""De Casteljau's construction as drawn: Bernstein's cubic in the plane, Bézier's curve on SO(3)."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

import rbcourse as rb
from rbclassroom.figures import lesson11

T = np.linspace(0, 1, 11)
POINTS = np.array([[0, 0], [1, 2], [3, 2.5], [4, 0.5]])
SIGMA = np.pi / 6 * np.array([1, 2, 3])  # BK (21)
ENDS = np.eye(3), rb.exp_so3(SIGMA), SIGMA, SIGMA + np.array([5, 0, 0])
V = np.array([0, -0.8, 0.6])
TABLE = lesson11.casteljau_table(T, POINTS, ENDS, V)


def level(name, k):
    """The points of a level, shape (4 - k, 2 or 3, times), from the table."""
    axes = "xy" if name == "plane" else "xyz"
    columns = [[f"{name} level {k} point {j} {axis} [1]" for axis in axes] for j in range(4 - k)]
    return np.array([[TABLE[column] for column in point] for point in columns])


@pytest.fixture
def axes():
    fig = plt.figure()
    yield fig.add_subplot(1, 2, 1), fig.add_subplot(1, 2, 2, projection="space")
    plt.close(fig)


def drawn(artist):
    return np.array(artist.get_data_3d() if hasattr(artist, "get_data_3d") else artist.get_data())


def test_the_last_point_is_bernsteins_cubic_and_beziers_curve():
    s = 1 - T
    bernstein = np.array([s**3, 3 * s**2 * T, 3 * s * T**2, T**3])
    assert np.abs(level("plane", 3)[0] - POINTS.T @ bernstein).max() < 1e-12
    assert np.abs(level("sphere", 3)[0].T - rb.bezier_so3(*ENDS)(T) @ V).max() < 1e-12


def test_the_control_points_have_the_ends():
    R0, R1, w0, w1 = ENDS
    inner = R0 @ rb.exp_so3(w0 / 3), R1 @ rb.exp_so3(-w1 / 3)
    for point, R in zip(level("sphere", 0), (R0, *inner, R1), strict=True):
        assert np.abs(point.T - R @ V).max() < 1e-14
    assert np.array_equal(level("plane", 0)[:, :, 3], POINTS)


def test_what_moves_is_what_the_table_says(axes):
    update = lesson11.moving_casteljau(axes, T, POINTS, ENDS, V)
    for i in (0, 4, 10, 7):
        clock, *artists = update(i)
        assert clock.get_text() == f"t = {T[i]:.2f}"
        for name, (first, second, curve, point) in (
            ("plane", artists[:4]),
            ("sphere", artists[4:]),
        ):
            for legs, k in ((first, 1), (second, 2)):
                marked = drawn(legs)[:, legs.get_markevery()]
                assert np.abs(marked.T - level(name, k)[..., i]).max() < 1e-12
            assert np.array_equal(drawn(curve), level(name, 3)[0][:, : i + 1])
            assert np.array_equal(drawn(point)[:, 0], level(name, 3)[0][:, i])


def test_legs_are_straight_in_the_plane_and_images_of_geodesics_on_the_sphere(axes):
    update = lesson11.moving_casteljau(axes, T, POINTS, ENDS, V)
    straight, arc = (drawn(update(4)[k]) for k in (2, 6))
    a, b = level("plane", 2)[..., 4]
    assert np.abs(straight - (a[:, None] + np.outer(b - a, np.linspace(0, 1, 33)))).max() < 1e-12
    assert np.abs(np.linalg.norm(arc, axis=0) - 1).max() < 1e-12
    off = arc - arc[:, :1]
    assert np.linalg.svd(off, compute_uv=False)[2] < 1e-12  # a circle, in one plane
    lengths = np.linalg.norm(np.diff(arc, axis=1), axis=0)
    assert np.ptp(lengths) < 1e-12


def test_control_points_have_names_and_legs(axes):
    lesson11.moving_casteljau(axes, T, POINTS, ENDS, V)
    for ax, name, words in zip(
        axes,
        ("plane", "sphere"),
        (["b₀", "b₁", "b₂", "b₃"], ["R₀v", "B₁v", "B₂v", "R₁v"]),
        strict=True,
    ):
        assert [text.get_text() for text in ax.texts][:4] == words
        legs = drawn(next(line for line in ax.lines if line.get_marker() == "o"))
        for point in level(name, 0)[..., 0]:
            assert np.abs(legs - point[:, None]).max(axis=0).min() < 1e-12


def test_the_description_measures_the_legs():
    said = lesson11.describe_casteljau(ENDS)
    first = np.degrees(np.linalg.norm(SIGMA) / 3)
    last = np.degrees(np.linalg.norm(SIGMA + np.array([5, 0, 0])) / 3)
    assert f"next are {first:.0f}, " in said
    assert f", {last:.0f} degrees." in said
