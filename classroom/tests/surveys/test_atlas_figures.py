"""What is drawn of the atlas is what is in the tables."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

from rbclassroom.surveys import atlas, atlas_figures

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
    "family": np.array(["random"] * 4 + ["Figure 5", "no turn", "no turn"]),
    "projection margin [1]": np.array([0.1, 0.15, 1.5, 1.9, 1.7, 2.0, 2.0]),
    "projection excess [1]": np.array([1000.0, 300.0, 0.2, np.nan, 0.7, 0.5, 1.5]),
    "quaternion margin [1]": np.array([0.6, 0.9, 1.0, 1.0, 1.0, 1.0, 1.0]),
    "quaternion excess [1]": np.array([30.0, 0.2, 0.02, 0.01, 0.04, 0.4, 0.9]),
}


@pytest.fixture
def fig():
    fig = plt.figure(figsize=(9, 6))
    yield fig
    plt.close(fig)


@pytest.mark.parametrize("family", atlas.FAMILIES)
def test_each_cell_has_its_colour(fig, family):
    maps = atlas_figures.draw_atlas(fig, CELLS, family, "median")
    assert len(maps) == 7
    for drawn, way in zip(maps, atlas.WAYS, strict=True):
        wanted = CELLS[f"{way} excess [1]"][CELLS["family"] == family].reshape(10, 10)
        assert drawn.axes.get_title() == way
        assert np.array_equal(drawn.get_array(), wanted.T)
        assert drawn.norm.boundaries == pytest.approx(10.0 ** np.arange(-4, 3))
        edges = np.asarray(drawn.get_coordinates())
        assert edges[0, :, 0] == pytest.approx(np.arange(0, 181, 18))
        assert edges[:, 0, 1] == pytest.approx(np.arange(0, 9.1, 0.9))
    fig.canvas.draw()
    bar = fig.axes[-1]
    assert bar.get_yticks()[2:5] == pytest.approx([0.01, 0.1, 1])
    assert [text.get_text() for text in bar.get_yticklabels()][2:5] == ["1 %", "10 %", "100 %"]
    assert "median" in bar.get_ylabel()
    assert fig.get_supylabel() == f"end velocity, {family} the axis (rad)"


def test_the_line_is_where_the_excess_is_10_percent(fig):
    slope = np.repeat(np.linspace(-3, 1, 10), 10)  # over the displacement, in powers of ten
    table = CELLS | {f"{way} excess [1]": np.tile(10.0**slope, 2) for way in atlas.WAYS}
    ax = atlas_figures.draw_atlas(fig, table, "along", "median")[0].axes
    _, line = ax.collections
    drawn = np.concatenate(line.get_paths()[0].to_polygons(closed_only=False))
    assert drawn[:, 0] == pytest.approx(
        np.interp(-1, np.linspace(-3, 1, 10), np.arange(9, 180, 18))
    )


def test_the_shares_are_told():
    said = atlas_figures.describe_atlas(CELLS, "across", "median")
    x = CELLS["projection excess [1]"][100:]
    shares = ", ".join(f"{100 * np.mean(x < level):.0f}" for level in (0.01, 0.1, 1))
    assert f"projection {shares};" in said
    assert "Bézier 100, 100, 100;" in said
    assert "across the axis" in said


def test_medians_and_90_percent_quantiles_are_lines_at_their_sizes(fig):
    lines = atlas_figures.draw_growth(fig.subplots(), GROWTH)
    for kind, drawn in (("median", lines[:7]), ("90 %", lines[7:])):
        for line, way in zip(drawn, atlas.WAYS, strict=True):
            assert np.array_equal(line.get_xdata(), SIZES)
            assert np.array_equal(line.get_ydata(), GROWTH[f"{way} {kind} excess [1]"])
    medians, highs = lines[:7], lines[7:]
    assert [line.get_label() for line in medians] == list(atlas.WAYS)
    assert [line.get_color() for line in medians] == [line.get_color() for line in highs]
    assert len({line.get_color() for line in medians}) == 7
    assert len({line.get_marker() for line in medians}) == 7
    assert "projection from 3.9e-06 to 8.1e-02" in atlas_figures.describe_growth(GROWTH)


def test_only_the_curves_in_the_data_are_drawn(fig):
    data = {key: x for key, x in GROWTH.items() if key.split()[0] in ("size", "Bézier")}
    data |= {f"normal {kind} excess [1]": 1e-5 * SIZES**4 for kind in ("median", "90 %")}
    lines = atlas_figures.draw_growth(fig.subplots(), data)
    assert [line.get_label() for line in lines[:2]] == ["Bézier", "normal"]
    assert "normal from 3.9e-08 to 8.1e-04" in atlas_figures.describe_growth(data)


def test_each_body_has_a_row_of_maps_and_each_curve_a_column(fig):
    names = {"one": "curve\none", "two": "another"}
    data = {"body": np.repeat(["ball", "book"], 100)}
    data |= {f"{name} median [1]": 10.0 ** RNG.uniform(-5, 3, 200) for name in names}
    drawn = atlas_figures.draw_body_atlas(fig, data, names)
    assert [(m.axes.get_ylabel(), m.axes.get_title()) for m in drawn] == [
        ("ball", "curve\none"),
        ("", "another"),
        ("book", ""),
        ("", ""),
    ]
    for k, shown in enumerate(drawn):
        wanted = data[f"{list(names)[k % 2]} median [1]"].reshape(2, 10, 10)[k // 2]
        assert np.array_equal(shown.get_array(), wanted.T)
    share = 100 * np.mean(data["one median [1]"][100:] < 0.1)
    assert f"book: curve one {share:.0f}," in atlas_figures.describe_body_atlas(data, names)


def test_each_problem_is_a_mark_of_its_family(fig):
    axes = fig.subplots(1, 2, sharey=True)
    *marks, line = atlas_figures.draw_margins(axes, MARGINS)
    rows = slice(0, 4), slice(4, 5), slice(5, 7)
    panels = zip(axes, ("projection", "quaternion"), (marks[:3], marks[3:]), strict=True)
    for ax, way, drawn in panels:
        for dots, chosen in zip(drawn, rows, strict=True):
            assert dots.axes is ax
            assert dots.get_label() == MARGINS["family"][chosen][0]
            assert np.array_equal(dots.get_xdata(), MARGINS[f"{way} margin [1]"][chosen])
            wanted = MARGINS[f"{way} excess [1]"][chosen]
            assert np.array_equal(dots.get_ydata(), wanted, equal_nan=True)
        assert len({dots.get_marker() for dots in drawn}) == 3
    assert len({ax.get_xlabel() for ax in axes}) == 2
    slope = np.diff(np.log(line.get_ydata())) / np.diff(np.log(line.get_xdata()))
    assert slope == pytest.approx([-3])


def test_what_is_said_of_the_margins():
    said = atlas_figures.describe_margins(MARGINS)
    assert "6.5e+02 where the margin is below 0.2, and 2.0e-01 where it is above 1" in said
    assert "Figure 5: 70 % at 1.700. no turn: 50 % at 2.000, 150 % at 2.000." in said
    assert "least margin of the quaternions is 0.60" in said


def test_deviations_are_lines_in_their_panels(fig):
    t = np.linspace(0, 1, 11)
    data = {"t [1]": t, "projection d [1]": t**2, "Bézier d [1]": t / 9, "Bézier e [1]": -t}
    axes = fig.subplots(1, 2)
    lines = atlas_figures.draw_deviations(axes, data)
    assert [line.get_label() for line in lines] == ["projection", "Bézier", "Bézier"]
    assert [line.axes is axes[1] for line in lines] == [False, False, True]
    for line, name in zip(lines, list(data)[1:], strict=True):
        assert np.array_equal(line.get_ydata(), data[name])
    assert "Bézier d 1.1e-01" in atlas_figures.describe_deviations(data)
