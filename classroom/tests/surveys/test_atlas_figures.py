"""Heat maps of the atlas show the cells of their tables. The other figures of the atlas are tested
in test_drawn.py."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from rbclassroom.surveys import atlas, atlas_figures

RNG = np.random.default_rng(11)
EXCESS = {way: 10.0 ** RNG.uniform(-6, 3, 200) for way in atlas.WAYS}
CELLS = atlas.cell_table(EXCESS | {"Bézier": np.zeros(200)}, 1, 0.5)


@pytest.fixture
def fig():
    return Figure(figsize=(9, 6))


@pytest.mark.parametrize("family", atlas.FAMILIES)
def test_each_cell_has_its_colour(fig, family):
    atlas_figures.draw_atlas(fig, CELLS, family, "median")
    *row, corner = fig.axes[:4]
    for ax, way in zip([*row, *fig.axes[4:]], atlas.WAYS, strict=True):
        drawn = ax.collections[0]
        wanted = CELLS[f"{way} excess [1]"][CELLS["family"] == family].reshape(10, 10)
        assert ax.get_title() == way
        assert np.array_equal(drawn.get_array(), wanted.T)
        assert drawn.norm.boundaries == pytest.approx(10.0 ** np.arange(-4, 3))
        edges = np.asarray(drawn.get_coordinates())
        assert edges[0, :, 0] == pytest.approx(np.arange(0, 181, 18))
        assert edges[:, 0, 1] == pytest.approx(np.arange(0, 9.1, 0.9))
        said = [text.get_text() for text in ax.texts]
        assert said == (["< 0.01 %\neverywhere"] if way == "Bézier" else [])
    fig.draw_without_rendering()
    (bar,) = corner.child_axes
    assert not corner.axison
    assert bar.get_yticks()[1:4] == pytest.approx([0.01, 0.1, 1])
    assert [text.get_text() for text in bar.get_yticklabels()][1:4] == ["1 %", "10 %", "100 %"]
    assert corner.get_title() == "excess, median"
    assert fig.get_supylabel() == f"end velocity, {family} the axis (rad)"


def test_the_contour_is_at_an_excess_of_10_percent(fig):
    # the logarithm of the excess increases with the displacement
    slope = np.repeat(np.linspace(-3, 1, 10), 10)
    table = CELLS | {f"{way} excess [1]": np.tile(10.0**slope, 2) for way in atlas.WAYS}
    atlas_figures.draw_atlas(fig, table, "along", "median")
    place = np.interp(-1, np.linspace(-3, 1, 10), np.arange(9, 180, 18))
    for line in fig.axes[0].collections[1:]:
        drawn = np.concatenate(line.get_paths()[0].to_polygons(closed_only=False))
        assert drawn[:, 0] == pytest.approx(place)


def test_the_description_states_the_shares_of_cells():
    said = atlas_figures.describe_atlas(CELLS, "across", "median")
    x = CELLS["projection excess [1]"][100:]
    shares = ", ".join(f"{100 * np.mean(x < level):.0f}" for level in (0.01, 0.1, 1))
    assert f"projection {shares};" in said
    assert "Bézier 100, 100, 100;" in said
    assert "across the axis" in said


def test_rows_of_maps_are_bodies_and_columns_are_curves(fig):
    names = {"one": "curve\none", "two": "another"}
    data = {"body": np.repeat(["ball", "book"], 100)}
    data |= {f"{name} median [1]": 10.0 ** RNG.uniform(-5, 3, 200) for name in names}
    atlas_figures.draw_body_atlas(fig, data, names)
    *maps, _ = fig.axes
    assert [ax.get_ylabel() for ax in maps] == ["ball", "", "book", ""]
    assert [ax.get_title() for ax in maps] == ["curve\none", "another", "", ""]
    for k, ax in enumerate(maps):
        wanted = data[f"{list(names)[k % 2]} median [1]"].reshape(2, 10, 10)[k // 2]
        assert np.array_equal(ax.collections[0].get_array(), wanted.T)
    share = 100 * np.mean(data["one median [1]"][100:] < 0.1)
    assert f"book: curve one {share:.0f}," in atlas_figures.describe_body_atlas(data, names)
