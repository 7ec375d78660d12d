"""What is drawn of an optimum and its projection is what is in the table."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

import rbcourse as rb
from rbcourse.draw import comparison

TIMES = np.linspace(0, 1, 21)
SIGMA = np.array([0.3, 0.6, 0.9])
ENDS = np.eye(3), rb.exp_so3(SIGMA), SIGMA, SIGMA + np.array([1, 0, 0])
CURVES = {
    "optimum": rb.minimum_acceleration_so3(*ENDS),
    "projection": rb.projected_cubic_so3(*ENDS),
}
TABLE = comparison.coordinate_table(CURVES, TIMES)


@pytest.fixture
def ax():
    fig, ax = plt.subplots()
    yield ax
    plt.close(fig)


def test_the_table_holds_rotation_vectors():
    assert np.array_equal(TABLE["t [1]"], TIMES)
    for name, curve in CURVES.items():
        sigma = np.array([TABLE[f"{name} sigma{i} [rad]"] for i in (1, 2, 3)]).T
        assert np.array_equal(sigma, rb.log_so3(curve(TIMES)))


@pytest.mark.source("BK Fig. 4")
def test_paths_coordinates_and_differences_are_those_of_the_table(ax):
    fig, ax3d = plt.subplots(subplot_kw={"projection": "3d"})
    lines = comparison.draw_coordinate_paths(ax3d, TABLE)
    sigma = [rb.log_so3(curve(TIMES)).T for curve in CURVES.values()]
    for line, path in zip(lines, sigma, strict=True):
        assert np.array_equal(line.get_data_3d(), path)
    assert len({line.get_color() for line in lines}) == len(
        {line.get_linestyle() for line in lines}
    )
    plt.close(fig)
    for line, part in zip(
        comparison.draw_coordinates(ax, TABLE), np.concatenate(sigma), strict=True
    ):
        assert np.array_equal(line.get_ydata(), part)
    apart = sigma[1] - sigma[0]
    for line, part in zip(comparison.draw_difference(ax, TABLE), apart, strict=True):
        assert np.array_equal(line.get_ydata(), part)
    distance = np.linalg.norm(apart, axis=0)
    said = comparison.describe_coordinates(TABLE)
    assert (
        f"most at t = {TIMES[distance.argmax()]:g}, by {distance.max():.2g} rad in length" in said
    )


def test_equal_curves_are_said_to_coincide():
    same = comparison.coordinate_table(dict.fromkeys(CURVES, CURVES["optimum"]), TIMES)
    assert comparison.describe_coordinates(same).endswith("They coincide at all times.")


def test_excess_is_drawn_on_logarithmic_axes(ax):
    scale = np.array([0.25, 0.5, 1])
    table = {"scale [1]": scale, "one excess [1]": scale**4, "two excess [1]": 2 * scale**4}
    one, two, slope = comparison.draw_excess(ax, table)
    assert np.array_equal(one.get_ydata(), scale**4)
    assert np.array_equal(two.get_ydata(), 2 * scale**4)
    assert np.allclose(np.diff(np.log(slope.get_ydata())), 4 * np.log(2))
    assert (ax.get_xscale(), ax.get_yscale()) == ("log", "log")
    assert "one from 3.9e-03 to 1; two from 7.8e-03 to 2" in comparison.describe_excess(table)
