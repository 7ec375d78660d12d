"""On the sphere: what is drawn is what was computed."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

import rbcourse as rb
from rbcourse.draw import spheres

R = rb.sample_rotation(50, rng=1)
V0 = np.array([0.0, 0, 1])
V1 = np.array([0.0, 0.2, 1])
IMAGES = {"one": (R @ V0, R @ V1), "other": (-R @ V0, -R @ V1)}
TABLE = spheres.image_table(IMAGES)


@pytest.fixture
def panels():
    fig, axes = plt.subplots(1, 2, subplot_kw={"projection": "space"})
    yield axes
    plt.close(fig)


@pytest.mark.source("RR 2.2", "RR Fig. 4", "RR Fig. 5")
@pytest.mark.parametrize("shown", [0, 1, 17, 50])
def test_the_first_images_are_marked(panels, shown):
    artists = spheres.moving_images(panels, IMAGES)(shown)
    for k, (v0, v1) in enumerate(IMAGES.values()):
        strokes, dots = artists[2 * k : 2 * k + 2]
        drawn = np.transpose(strokes.get_data_3d()).reshape(-1, 3, 3)
        assert np.array_equal(drawn[:, :2], np.stack([v0, v1], axis=1)[:shown])
        assert np.isnan(drawn[:, 2]).all()  # one stroke ends before the next begins
        assert np.array_equal(np.transpose(dots.get_data_3d()), v0[:shown])
        assert panels[k].get_title() == list(IMAGES)[k]


def test_the_table_has_a_row_for_each_rotation_and_the_description_counts():
    assert list(TABLE)[:6] == [f"one {v} {axis} [1]" for v in ("v0", "v1") for axis in "xyz"]
    assert np.array_equal(TABLE["other v1 y [1]"], -(R @ V1)[:, 1])
    said = spheres.describe_images(IMAGES)
    inside = (np.abs((R @ V0)[:, 2]) < 0.5).sum()
    assert "under 50 random rotations" in said
    assert f"area: one: {inside}, other: {inside}." in said
