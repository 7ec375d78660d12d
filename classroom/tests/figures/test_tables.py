"""The tables of the lessons' figures agree with their definitions.

The last test of each lesson compares its figures, animations and descriptions with the stored ones.
"""

import numpy as np
import pytest

import rbcourse as rb
from rbclassroom.figures import lesson05, lesson11, lesson13, lesson14, lesson15, vectors

T = np.linspace(0, 1, 21)
POINTS = np.array([[0, 0], [1, 2], [3, 2.5], [4, 0.5]])
SIGMA = np.pi / 6 * np.array([1, 2, 3])  # BK (21)
ENDS = np.eye(3), rb.exp_so3(SIGMA), SIGMA, SIGMA + np.array([5, 0, 0])
V = np.array([0, -0.8, 0.6])


@pytest.mark.source("RR 2")
def test_histograms_count_all_draws():
    many = {"a": rb.sample_rotation(5000, rng=2), "b": rb.exp_so3(np.zeros((10, 3)))}
    # rounding makes some heights exceed 1
    many["b"][:, 2, 2] += np.finfo(float).eps * np.arange(-5, 5)
    for edges, densities in lesson05.histograms(many).values():
        shares = np.array(list(densities.values())) @ np.diff(edges)
        assert shares == pytest.approx([1, 1], rel=1e-12)


def test_profiles_agree_with_the_motion():
    poses = rb.pose_from_coordinates([[0, 0, 0, 0, 0, 0], [0, 0, 1, 3, 4, 0], [0, 0, 1, 3, 4, 5]])
    table = lesson14.profile_table(rb.chain([0, 2, 4], poses, leg=rb.geodesic), 1, 5)
    assert table["t [s]"].tolist() == [0, 1, 2, 3, 4]
    assert np.allclose(table["angular speed [rad/s]"], [0.5, 0.5, 0, 0, 0], atol=1e-14)
    assert np.allclose(table["speed [m/s]"], 2.5, atol=1e-14)
    smooth, h = rb.projected_spline([0, 2, 4], poses, "rest", rest_at=[1]), 1e-4
    for t, w, d in zip(*lesson14.profile_table(smooth, 2, 9).values(), strict=True):
        if t not in (0, 2, 4):
            before, now, after = (smooth(t + s)[:3, 3] for s in (-h, 0, h))
            assert d == pytest.approx(np.linalg.norm(after - 2 * now + before) / h**2, abs=1e-5)
            w_dot = (smooth(t + h, 1) - smooth(t - h, 1))[:3] / (2 * h)
            assert w == pytest.approx(np.linalg.norm(w_dot), abs=1e-6)
    with pytest.raises(ValueError, match=r"^motion: a single curve on SE\(3\) is wanted"):
        lesson14.profile_table(rb.geodesic(np.eye(3), np.eye(3)), 1)


@pytest.mark.source("beyond BK 7")
def test_free_motions_are_straight_in_normal_coordinates_to_second_order():
    """Free motions deviate from the lines t w by O(w²) in exponential coordinates, and by O(w³) in
    normal coordinates."""
    book, t = rb.Body.box([0.30, 0.20, 0.03]).inertia, np.linspace(0, 1, 5)
    w = np.array([[0.8, 0.6, 1], [-0.6, 0.8, 1]])
    kinds = "exponential coordinates", "normal coordinates"

    def off(inertia, size):
        """Return how far the two motions are from straight lines, in both kinds of coordinates."""
        lines = vectors("{} {} [rad]", lesson13.normal_table(t, size * w, inertia), "xy")
        for k in (1, 2):
            assert np.allclose(lines[f"straight {k}"], t[:, None] * size * w[k - 1, :2], 1e-15)
        return np.array(
            [[lines[f"{kind} {k}"] - lines[f"straight {k}"] for k in (1, 2)] for kind in kinds]
        )

    whole, half = (np.linalg.norm(off(book, size)[:, :, -1], axis=-1) for size in (0.02, 0.01))
    assert np.log2(whole / half) == pytest.approx(np.array([[2, 2], [3, 3]]), abs=0.05)
    w_dot = -np.cross(w, w @ book) @ np.linalg.inv(book)  # Euler's equations
    want = 0.01**2 / 2 * w_dot[:, :2]
    assert off(book, 0.01)[0, :, -1] == pytest.approx(want, abs=0.03 * np.abs(want).max())
    assert np.abs(off(2 * np.eye(3), 1)).max() < 1e-13  # for a ball, both motions are straight


def test_the_turns_are_natural_splines_through_the_angles():
    data = lesson14.turns_table({"one": (0, 0), "two": (4, 6)})
    t = data["t [s]"]
    for name, goal in (("one", 0.3), ("two", 0.3 + 20 * np.pi)):
        angle, bend = data[f"{name} [rad]"], data[f"{name} bend [rad]"]
        assert angle[[0, -1]] == pytest.approx([0, goal])
        assert np.abs(bend[[0, -1]]).max() < 1e-12
        assert angle - bend == pytest.approx(goal * t / t[-1])
        curvature = np.diff(angle, 2)
        assert np.abs(curvature[[0, -1]]).max() < 0.05 * np.abs(curvature).max()


def test_limit_curves_are_the_largest_admissible_rates():
    """The test tries many changes of the rate at each place."""
    poses = np.eye(4), rb.pose_from_coordinates([1, 0, 1, 2, 1, 0])
    twists = rb.twist_from_rates(poses, [[0, 1, 0], [1, 0, 0]], [[1, 0, 0], [0, 2, 1]])
    path = rb.minimum_acceleration(*poses, *twists)
    limits = {"speed": 1.5, "angular_speed": 0.7, "acceleration": 2.0, "angular_acceleration": 1.0}
    s = np.linspace(0, 1, 9)
    found = lesson15.highest_rates(path, s, limits)
    V, A = (path(s, k).reshape(9, 2, 3) for k in (1, 2))
    speeds = np.min([0.7, 1.5] / np.linalg.norm(V, axis=2), axis=1)
    assert found["speeds"] == pytest.approx(speeds, rel=1e-12)
    ratios = np.linspace(-60, 60, 240_001)[:, None, None]  # u/x
    for i, rate in enumerate(found["accelerations"]):
        norms = np.linalg.norm(V[i] * ratios + A[i], axis=2) / [1.0, 2.0]
        assert rate == pytest.approx(norms.max(axis=1).min() ** -0.5, rel=1e-5)


def test_two_passes_give_the_largest_squared_rates_below_all_limits():
    """The squared rate x_i is the minimum of highest_j + step |i − j| over all j."""
    highest = np.random.default_rng(3).uniform(0.5, 6, 12)
    highest[[0, -1]] = 0
    apart = np.abs(np.subtract.outer(np.arange(12), np.arange(12)))
    back, both = lesson15.two_passes(highest, 0.8)
    assert both == pytest.approx((highest + 0.8 * apart).min(axis=1))
    later = np.where(np.triu(np.ones((12, 12))), highest + 0.8 * apart, np.inf)
    assert back == pytest.approx(later.min(axis=1))


def test_a_used_share_is_a_norm_divided_by_its_limit():
    path = rb.screw(np.eye(4), rb.pose_from_coordinates([0, 0, 2, 3, 0, 0]))
    data = lesson15.share_table(path, {"angular_speed": 4.0, "speed": 5.0})
    assert data["angular speed [1]"] == pytest.approx(0.5)
    assert data["speed [1]"] == pytest.approx(np.linalg.norm(path(0, 1)[3:]) / 5, abs=5e-5)


def test_de_casteljaus_construction_gives_beziers_curve():
    table, s = lesson11.casteljau_table(T, POINTS, ENDS, V), 1 - T

    def level(name, k):
        """Return the points of level k of the construction, shape (4 - k, 2 or 3, times)."""
        letters = "xy" if name == "plane" else "xyz"
        columns = [f"{name} level {k} point {j} {x} [1]" for j in range(4 - k) for x in letters]
        return np.array([table[column] for column in columns]).reshape(4 - k, -1, len(T))

    bernstein = np.array([s**3, 3 * s**2 * T, 3 * s * T**2, T**3])
    assert np.abs(level("plane", 3)[0] - POINTS.T @ bernstein).max() < 1e-12
    assert np.abs(level("sphere", 3)[0].T - rb.closed_forms.bezier(*ENDS)(T) @ V).max() < 1e-12
    R0, R1, w0, w1 = ENDS
    controls = R0, R0 @ rb.exp_so3(w0 / 3), R1 @ rb.exp_so3(-w1 / 3), R1
    assert np.abs(np.moveaxis(level("sphere", 0), 2, 0) - controls @ V).max() < 1e-14
    assert np.array_equal(level("plane", 0)[:, :, 3], POINTS)
