"""On the sphere: what is drawn is what was computed."""

import io

import matplotlib.pyplot as plt
import numpy as np
import pytest
from PIL import Image

import rbcourse as rb
from rbcourse.draw import animate, spheres

R = rb.sample_rotation(50, rng=1)
V0 = np.array([0.0, 0, 1])
V1 = np.array([0.0, 0.2, 1])
IMAGES = {"one": (R @ V0, R @ V1), "other": (-R @ V0, -R @ V1)}
TABLE = spheres.image_table(IMAGES)
MOMENTS = np.array([1.0, 2, 3])
TIMES = np.linspace(0, 24, 481)
STARTS = {"axis 1": [2, 0.01, 0.01], "axis 2": [0.01, 2, 0.01], "axis 3": [0.01, 0.01, 2]}


@pytest.fixture(scope="module")
def turning():
    """Orientations and angular velocities of the three spins, shape (times, spins, ...)."""
    return rb.geodesic_flow(np.diag(MOMENTS), np.eye(3), list(STARTS.values()), TIMES)


@pytest.fixture(scope="module")
def spins(turning):
    return {name: turning[1][:, k] for k, name in enumerate(STARTS)}


@pytest.fixture
def panels():
    fig, axes = plt.subplots(1, 2, subplot_kw={"projection": "space"})
    yield axes
    plt.close(fig)


def test_the_table_has_a_row_for_each_rotation():
    assert list(TABLE)[:6] == [f"one {v} {axis} [1]" for v in ("v0", "v1") for axis in "xyz"]
    assert np.array_equal(TABLE["other v1 y [1]"], -(R @ V1)[:, 1])


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


def test_frames_are_what_a_full_drawing_gives():
    fig, ax = plt.subplots(
        figsize=(5, 5), dpi=80, layout="none", subplot_kw={"projection": "space"}
    )
    many = rb.sample_rotation(300, rng=1)
    images = {"many": (many @ V0, many @ V1)}
    pictures = animate.render(fig, spheres.moving_images([ax], images), 301)[-1:]
    for artist in ax.get_children():
        artist.set_animated(False)
    full = io.BytesIO()
    fig.savefig(full, format="png", dpi=80)
    plt.close(fig)
    off = np.abs(np.asarray(Image.open(full).convert("RGB"), dtype=int) - pictures[-1]).max()
    assert off < 8


def test_the_description_counts():
    said = spheres.describe_images(IMAGES)
    inside = (np.abs((R @ V0)[:, 2]) < 0.5).sum()
    assert "under 50 random rotations" in said
    assert f"area: one: {inside}, other: {inside}." in said


@pytest.fixture
def space():
    fig, ax = plt.subplots(subplot_kw={"projection": "space"})
    yield ax
    plt.close(fig)
