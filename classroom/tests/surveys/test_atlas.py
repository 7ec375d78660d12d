"""Test the atlas: its problems, the costs of curves, and the quantiles."""

from functools import partial

import numpy as np
import pytest

import rbcourse as rb
from rbclassroom.surveys import atlas

DRAWS = 6
SOME = atlas.random_problems(60, 3, rng=2)


def turns(ends):
    return rb.log_so3(ends.R0.mT @ ends.R1)


def norms(x):
    return np.linalg.norm(x, axis=-1)


def test_each_cell_has_problems_of_its_family():
    ends = atlas.atlas_problems(DRAWS, rng=1)
    family, turn, speed, _ = np.indices((2, 10, 10, DRAWS)).reshape(4, -1)
    sigma, w = turns(ends), np.stack([ends.w0, ends.w1])
    assert np.array_equal(np.floor(norms(sigma) / (np.pi / 10)), turn)
    assert np.array_equal(np.floor(np.hypot(*norms(w)) / 0.9), speed)
    cosine = np.abs(np.sum(w * sigma, axis=-1)) / norms(w) / norms(sigma)
    assert np.abs(cosine[:, family == 0] - 1).max() < 1e-9
    assert cosine[:, family == 1].max() < 1e-9
    along, across = (np.prod(norms(w), axis=0) ** -1 * np.sum(w[0] * w[1], axis=-1)).reshape(2, -1)
    assert np.abs(np.abs(along) - 1).max() < 1e-9
    assert 0.4 < np.mean(along > 0) < 0.6
    assert np.mean(np.abs(across) < np.cos(np.pi / 4)) == pytest.approx(0.5, abs=0.1)


def test_random_problems_are_uniform_in_balls():
    ends = atlas.random_problems(4000, 1.5, rng=3)
    for x, radius in ((turns(ends), 1.5), (ends.w0, 3), (ends.w1, 3)):
        share = (norms(x) / radius) ** 3  # the share of the ball closer to the centre than x
        assert share.max() < 1 + 1e-9
        assert np.abs(np.quantile(share, [0.25, 0.5, 0.75]) - [0.25, 0.5, 0.75]).max() < 0.05
        assert np.abs(x.mean(axis=0)).max() < 0.15 * radius


@pytest.mark.parametrize("make", [atlas.atlas_problems, partial(atlas.random_problems, size=1)])
def test_the_same_seed_gives_the_same_problems(make):
    one, again, other = make(2, rng=5), make(2, rng=5), make(2, rng=6)
    assert all(np.array_equal(a, b) for a, b in zip(one, again, strict=True))
    assert not any(np.array_equal(a, b) for a, b in zip(one, other, strict=True))
    with pytest.raises(ValueError, match=r"an integer from 1 up is wanted, got 0"):
        make(0, rng=5)


def test_bad_sizes_and_families_are_refused():
    for size in (0, -1, 3.2, np.nan, "a", [1, 2]):
        with pytest.raises(ValueError, match=r"^size"):
            atlas.random_problems(2, size)
    with pytest.raises(ValueError, match=r"^families: along, across or any .*\['around'\]"):
        atlas.atlas_problems(1, ["along", "around"])


def about_the_identity(R0, R1, w0, w1):
    """Return the curve whose logarithm goes straight from log R0 to log R1. It is reversible, but
    neither left- nor right-invariant."""
    a, b = rb.log_so3(R0), rb.log_so3(R1)
    return lambda t: rb.exp_so3(a + t[:, None, None] * (b - a))


@pytest.mark.source("BK Prop. 3")
def test_every_closed_form_moves_with_its_ends():
    reversible = "projection", "Bézier", "corrected", "quaternion", "about the identity"
    for way, make in {**atlas.WAYS, "about the identity": about_the_identity}.items():
        off = atlas.defects(make, SOME, rng=1)
        assert list(off) == ["left", "right", "reversed"]
        if way in atlas.WAYS:
            assert max(off["left"], off["right"]) < 1e-11, way
        else:
            assert min(off["left"], off["right"]) > 0.1
        assert off["reversed"] < 1e-11 if way in reversible else off["reversed"] > 0.1, way


def test_the_excess_is_nan_if_the_optimum_is_near_zero():
    """For a turn by a with w0 = w1 = a + d along its axis, the optimum costs 24 d²."""
    a, d = 1.0, np.array([0.0, 0.005, 0.01, 0.5])
    e, R0 = np.eye(3)[2], np.tile(np.eye(3), (4, 1, 1))
    w = (a + d)[:, None] * e
    ends = atlas.Ends(R0, rb.exp_so3(np.tile(a * e, (4, 1))), w, w)
    found = {"optimum": 24 * d**2, "other": 48 * d**2}
    assert atlas.near_zero(ends, found["optimum"]).tolist() == [True, False, False, False]
    excess = atlas.excesses(ends, found)
    assert list(excess) == ["other"]
    assert excess["other"] == pytest.approx([np.nan, 1, 1, 1], nan_ok=True)


def test_quantiles_are_values_of_the_sample_rounded_to_four_digits():
    x = np.random.default_rng(7).random((3, 50))
    x[0, ::2] = np.nan
    for share in (0.1, 0.5, 0.9, 1):
        for row, value in zip(x, atlas.quantile(x, share), strict=True):
            numbers = np.sort(row[~np.isnan(row)])
            assert value == pytest.approx(numbers[int(np.ceil(share * len(numbers))) - 1], rel=5e-4)
    few = np.array([123456.0, 0.00123456, 1.26e-8, -1e-12])
    assert atlas.rounded(few).tolist() == [123500.0, 0.001235, 1e-8, 0.0]


def test_the_table_has_a_row_for_each_cell():
    excess = np.arange(2 * 10 * 10 * 5.0)
    excess[:2] = np.nan
    table = atlas.cell_table({"one": excess, "two": 2 * excess}, 5, 0.5)
    assert table["family"].tolist() == ["along"] * 100 + ["across"] * 100
    some = [0, 9, 10, 199]
    assert table["displacement [rad]"][some] == pytest.approx(np.radians([9, 9, 27, 171]))
    assert table["end velocity [rad]"][some] == pytest.approx([0.45, 8.55, 0.45, 8.55])
    assert table["problems [1]"].tolist() == [3] + [5] * 199
    middle = np.array([3, *(np.arange(1, 200) * 5 + 2)])
    assert table["one excess [1]"] == pytest.approx(middle, rel=5e-4)
    assert table["two excess [1]"] == pytest.approx(2 * middle, rel=5e-4)
