"""Spheres show the computed images of vectors."""

import numpy as np
import pytest
from matplotlib.figure import Figure

import rbcourse as rb
from rbcourse.draw import spheres

R = rb.sample_rotation(50, rng=1)
V0, V1 = R @ [0, 0, 1], R @ [0, 0.2, 1]
IMAGES = {"one": (V0, V1), "other": (-V0, -V1)}


@pytest.mark.source("RR 2.2", "RR Fig. 4", "RR Fig. 5")
def test_the_first_images_are_drawn_and_counted():
    axes = Figure().subplots(1, 2, subplot_kw={"projection": "space"})
    update = spheres.moving_images(axes, IMAGES)
    assert [ax.get_title() for ax in axes] == list(IMAGES)
    for shown in (17, 50, 1, 0):
        found = [np.transpose(line.get_data_3d()) for line in update(shown)]
        for strokes, dots, (v0, v1) in zip(found[::2], found[1::2], IMAGES.values(), strict=True):
            parts = strokes.reshape(-1, 3, 3)
            assert np.array_equal(parts[:, :2], np.stack([v0, v1], axis=1)[:shown])
            assert np.isnan(parts[:, 2]).all()  # one stroke ends before the next begins
            assert np.array_equal(dots, v0[:shown])
    table, said = spheres.image_table(IMAGES), spheres.describe_images(IMAGES)
    assert list(table)[:6] == [f"one {v} {axis} [1]" for v in ("v0", "v1") for axis in "xyz"]
    assert np.array_equal(table["other v1 y [1]"], -V1[:, 1])
    inside = (np.abs(V0[:, 2]) < 0.5).sum()
    assert said.startswith("Images of the pole of a sphere under 50 random rotations: one, other.")
    assert f"area: one: {inside}, other: {inside}." in said
