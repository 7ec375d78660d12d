"""Random rotations on the sphere: what is drawn is what was computed."""

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


@pytest.fixture
def panels():
    fig, axes = plt.subplots(1, 2, subplot_kw={"projection": "3d"})
    yield axes
    plt.close(fig)


def test_the_table_has_a_row_for_each_rotation():
    assert list(TABLE)[:6] == [f"one {v} {axis} [1]" for v in ("v0", "v1") for axis in "xyz"]
    assert np.array_equal(TABLE["other v1 y [1]"], -(R @ V1)[:, 1])


@pytest.mark.source("RR 2.2", "RR Fig. 4", "RR Fig. 5")
@pytest.mark.parametrize("shown", [0, 1, 17, 50])
def test_the_first_images_are_marked(panels, shown):
    artists = spheres.moving_images(panels, TABLE)(shown)
    for k, (v0, v1) in enumerate(IMAGES.values()):
        far, strokes, near = artists[3 * k : 3 * k + 3]
        drawn = np.array(strokes._segments3d).reshape(-1, 2, 3)
        assert np.array_equal(drawn, np.stack([v0, v1], axis=1)[:shown])
        dots = np.concatenate([np.transpose(part.get_data_3d()) for part in (far, near)])
        assert np.array_equal(np.sort(dots, axis=0), np.sort(v0[:shown], axis=0))
        assert panels[k].get_title() == list(IMAGES)[k]


def test_what_lies_behind_is_pale(panels):
    far, strokes, near = spheres.moving_images(panels, TABLE)(50)[:3]
    e, a = np.radians([panels[0].elev, panels[0].azim])
    eye = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    assert (eye @ far.get_data_3d() < 0).all()
    assert (eye @ near.get_data_3d() >= 0).all()
    assert far.get_color() != near.get_color()
    assert len({tuple(colour) for colour in strokes.get_color()}) == 2


def test_frames_are_what_a_full_drawing_gives():
    fig, ax = plt.subplots(figsize=(5, 5), dpi=80, subplot_kw={"projection": "3d"}, layout="none")
    many = rb.sample_rotation(300, rng=1)
    table = spheres.image_table({"many": (many @ V0, many @ V1)})
    pictures = animate.render(fig, spheres.moving_images([ax], table), 301)[-1:]
    for artist in ax.get_children():
        artist.set_animated(False)
    full = io.BytesIO()
    fig.savefig(full, format="png", dpi=80)
    plt.close(fig)
    off = np.abs(np.asarray(Image.open(full).convert("RGB"), dtype=int) - pictures[-1]).max()
    assert off < 8


def test_the_description_counts():
    said = spheres.describe_images(TABLE)
    inside = (np.abs((R @ V0)[:, 2]) < 0.5).sum()
    assert "under 50 random rotations" in said
    assert f"area: one: {inside}, other: {inside}." in said


@pytest.mark.source("RR 2")
def test_histograms_are_densities():
    rounded = rb.matrix_from_quaternion(
        rb.conversions.quaternion_from_zyx([[k, 0, 0] for k in range(10)])
    )
    rounded[:, 2, 2] += np.finfo(float).eps * np.arange(-5, 5)  # heights beyond 1, by rounding
    rounded[0] = np.eye(3)
    many = {"uniform": rb.sample_rotation(5000, rng=2), "e3 up": rounded}
    data = spheres.histogram_table(many)
    for column, unit in (("angle", "rad"), ("height of e₁", "1"), ("height of e₃", "1")):
        edges = data[f"{column} [{unit}]"]
        for name in many:
            density = data[f"{column}, {name} [1]"]
            assert np.sum(density[:-1] * np.diff(edges)) == pytest.approx(1, rel=1e-12)
            assert density[-1] == 0
    counts, _ = np.histogram(many["uniform"][:, 2, 0], np.linspace(-1, 1, 21))
    assert np.allclose(data["height of e₁, uniform [1]"][:-1], counts / 500, rtol=1e-12)
    assert data["height of e₃, e3 up [1]"][19] == pytest.approx(10)
    assert data["angle, e3 up [1]"][0] > 0


def test_histograms_show_the_table_and_the_law():
    many = {
        "a": rb.sample_rotation(5000, rng=2),
        "b": rb.sampling.sample_rotation_naive(5000, rng=2),
    }
    data = spheres.histogram_table(many)
    fig, axes = plt.subplots(1, 3)
    artists = spheres.draw_histograms(axes, data)
    for k, column in enumerate(("angle", "height of e₁", "height of e₃")):
        a, b, law = artists[3 * k : 3 * k + 3]
        for stairs, name in ((a, "a"), (b, "b")):
            assert np.array_equal(stairs.get_data().values, data[f"{column}, {name} [1]"][:-1])
        x, y = law.get_data()
        want = (1 - np.cos(x)) / np.pi if k == 0 else np.full_like(x, 0.5)
        assert np.abs(y - want).max() < 1e-4
    plt.close(fig)


def test_histograms_are_described_by_what_is_in_the_wrong_bins():
    up = rb.exp_so3(np.zeros((10, 3)))
    said = spheres.describe_histograms(spheres.histogram_table({"up": up}))
    assert "height of the image of e₃, up: 95 %" in said
    assert "angle, up: 100 %" in said
