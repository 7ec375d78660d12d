"""What is drawn of the atlas is what is in the tables."""

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.colors import LogNorm

from rbcourse.study import atlas, atlas_figures

RNG = np.random.default_rng(11)
CELLS = atlas.cell_table(
    {way: 10.0 ** RNG.uniform(-6, 3, 200) for way in atlas.WAYS} | {"Bézier": np.zeros(200)}, 1, 0.5
)
SIZES = np.array([0.25, 1, 3])
GROWTH = {"size [rad]": SIZES} | {
    f"{way} {name} excess [1]": (k + 1) * high * SIZES**4
    for k, way in enumerate(atlas.WAYS)
    for name, high in (("median", 1e-3), ("90 %", 1e-2))
}
MARGINS = {
    "projection margin [1]": np.array([0.1, 0.15, 1.5, 1.9]),
    "projection excess [1]": np.array([1000.0, 300.0, 0.2, np.nan]),
    "quaternion margin [1]": np.array([0.6, 0.9, 1.0, 1.0]),
    "quaternion excess [1]": np.array([30.0, 0.2, 0.02, 0.01]),
}


@pytest.fixture
def fig():
    fig = plt.figure(figsize=(9, 4.8))
    yield fig
    plt.close(fig)


def test_each_cell_has_its_colour(fig):
    maps = atlas_figures.draw_atlas(fig, CELLS, "median")
    assert len(maps) == 12
    for k, drawn in enumerate(maps):
        way, family = list(atlas.WAYS)[k % 6], atlas.FAMILIES[k // 6]
        wanted = CELLS[f"{way} excess [1]"][CELLS["family"] == family].reshape(10, 10)
        assert drawn.axes.get_title() == (way if k < 6 else "")
        assert np.array_equal(drawn.get_array(), np.clip(wanted, 1e-5, None).T)
        assert isinstance(drawn.norm, LogNorm)
        assert (drawn.norm.vmin, drawn.norm.vmax) == (1e-4, 1e2)
        edges = np.asarray(drawn.get_coordinates())
        assert edges[0, :, 0] == pytest.approx(np.arange(0, 181, 18))
        assert edges[:, 0, 1] == pytest.approx(np.arange(0, 9.1, 0.9))
    fig.canvas.draw()


def test_contours_are_where_the_excess_is_1_10_and_100_percent(fig):
    slope = np.repeat(np.linspace(-3, 1, 10), 10)  # over the displacement, in powers of ten
    table = CELLS | {f"{way} excess [1]": np.tile(10.0**slope, 2) for way in atlas.WAYS}
    ax = atlas_figures.draw_atlas(fig, table, "median")[0].axes
    lines = [
        np.concatenate(c.get_paths()[0].to_polygons(closed_only=False)) for c in ax.collections[1:]
    ]
    places = np.interp([-2, -1, 0], np.linspace(-3, 1, 10), np.arange(9, 180, 18))
    assert [line[:, 0].mean() for line in lines] == pytest.approx(places)


def test_the_shares_are_told():
    said = atlas_figures.describe_atlas(CELLS, "median")
    x = CELLS["projection excess [1]"]
    shares = ", ".join(f"{100 * np.mean(x < level):.0f}" for level in (0.01, 0.1, 1))
    assert f"projection {shares};" in said
    assert "Bézier 100, 100, 100;" in said


def test_medians_are_lines_and_bars_reach_the_90_percent_quantile(fig):
    ax = fig.subplots()
    lines = atlas_figures.draw_growth(ax, GROWTH)
    for line, way, bars in zip(lines, atlas.WAYS, ax.collections, strict=True):
        assert line.get_label() == way
        assert np.array_equal(line.get_ydata(), GROWTH[f"{way} median excess [1]"])
        assert np.abs(line.get_xdata() / SIZES - 1).max() < 0.1  # side by side
        ends = [bar[:, 1] for bar in bars.get_segments()]
        assert np.transpose(ends)[1] == pytest.approx(GROWTH[f"{way} 90 % excess [1]"])
    looks = {(line.get_color(), line.get_marker()) for line in lines}
    assert len(looks) == len(lines)
    assert "projection from 3.9e-06 to 8.1e-02" in atlas_figures.describe_growth(GROWTH)


def test_each_problem_is_a_dot(fig):
    *dots, line = atlas_figures.draw_margins(fig.subplots(), MARGINS)
    for drawn, way in zip(dots, ("projection", "quaternion"), strict=True):
        assert np.array_equal(drawn.get_xdata(), MARGINS[f"{way} margin [1]"])
        assert np.array_equal(drawn.get_ydata(), MARGINS[f"{way} excess [1]"], equal_nan=True)
    slope = np.diff(np.log(line.get_ydata())) / np.diff(np.log(line.get_xdata()))
    assert slope == pytest.approx([-3])
    said = atlas_figures.describe_margins(MARGINS)
    assert "6.5e+02 where the margin is below 0.2, and 2.0e-01 where it is above 1" in said
    assert "quaternions is 0.6 or more" in said
