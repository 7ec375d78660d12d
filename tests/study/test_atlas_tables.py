"""What is read off the atlas."""

import numpy as np
import pytest

import rbcourse as rb
from rbcourse.study import atlas
from rbcourse.study import atlas_tables as tables


def test_nothing_is_divided_by_an_optimum_near_zero():
    """Along the axis of a turn by a, w0 = w1 = a + d costs 24 d²."""
    a, d = 1.0, np.array([0.0, 0.005, 0.01, 0.5])
    e, R0 = np.eye(3)[2], np.tile(np.eye(3), (4, 1, 1))
    w = (a + d)[:, None] * e
    ends = atlas.Ends(R0, rb.exp_so3(np.tile(a * e, (4, 1))), w, w)
    found = {"optimum": 24 * d**2, "other": 48 * d**2}
    assert (24 * d**2 < 3e-4 * (1 + d)).tolist() == [True, False, False, False]
    assert tables.near_zero(ends, found["optimum"]).tolist() == [True, False, False, False]
    excess = tables.excesses(ends, found)
    assert list(excess) == ["other"]
    assert np.isnan(excess["other"]).tolist() == [True, False, False, False]
    assert excess["other"][1:] == pytest.approx([1, 1, 1])


def test_a_quantile_is_the_number_that_so_many_do_not_pass():
    rng = np.random.default_rng(7)
    x = rng.random((3, 50))
    x[0, ::2] = np.nan
    for share in (0.1, 0.5, 0.9, 1):
        for row, value in zip(x, tables.quantile(x, share), strict=True):
            numbers = np.sort(row[~np.isnan(row)])
            assert value == pytest.approx(numbers[int(np.ceil(share * len(numbers))) - 1], rel=5e-4)


def test_numbers_have_four_digits_and_eight_decimals():
    assert tables.rounded(np.array([123456.0, 0.00123456, 1.26e-8, -1e-12])).tolist() == [
        123500.0,
        0.001235,
        1e-8,
        0.0,
    ]


def test_the_table_has_a_row_for_each_cell():
    excess = np.arange(2 * 10 * 10 * 5.0)
    excess[:2] = np.nan
    table = tables.cell_table({"one": excess, "two": 2 * excess}, 5, 0.5)
    assert table["family"].tolist() == ["along"] * 100 + ["across"] * 100
    middles = np.radians([9, 9, 27, 171])
    assert table["displacement [rad]"][[0, 9, 10, 199]] == pytest.approx(middles)
    assert table["end velocity [rad]"][[0, 9, 10, 199]] == pytest.approx([0.45, 8.55, 0.45, 8.55])
    assert table["problems [1]"].tolist() == [3] + [5] * 199
    middle = np.arange(200) * 5 + 2.0
    middle[0] = 3
    assert table["one excess [1]"] == pytest.approx(middle, rel=5e-4)
    assert table["two excess [1]"] == pytest.approx(2 * middle, rel=5e-4)
