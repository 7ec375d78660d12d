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


@pytest.mark.source("RR 2")
def test_histograms_are_densities():
    rounded = rb.matrix_from_quaternion(
        rb.conversions.quaternion_from_zyx([[k, 0, 0] for k in range(10)])
    )
    rounded[:, 2, 2] += np.finfo(float).eps * np.arange(-5, 5)  # heights beyond 1, by rounding
    rounded[0] = np.eye(3)
    many = {"uniform": rb.sample_rotation(5000, rng=2), "e3 up": rounded}
    data = spheres.histogram_table(spheres.histograms(many))
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
    bins = spheres.histograms(many)
    fig, axes = plt.subplots(1, 3)
    artists = spheres.draw_histograms(axes, bins)
    for k, column in enumerate(("angle", "height of e₁", "height of e₃")):
        a, b, law = artists[3 * k : 3 * k + 3]
        for stairs, name in ((a, "a"), (b, "b")):
            assert np.array_equal(stairs.get_data().values, bins[column][1][name])
            assert np.array_equal(stairs.get_data().edges, bins[column][0])
        x, y = law.get_data()
        want = (1 - np.cos(x)) / np.pi if k == 0 else np.full_like(x, 0.5)
        assert np.abs(y - want).max() < 1e-4
    plt.close(fig)


def test_histograms_are_described_by_what_is_in_the_wrong_bins():
    up = rb.exp_so3(np.zeros((10, 3)))
    said = spheres.describe_histograms(spheres.histograms({"up": up}))
    assert "height of the image of e₃, up: 95 %" in said
    assert "angle, up: 100 %" in said


@pytest.fixture
def space():
    fig, ax = plt.subplots(subplot_kw={"projection": "space"})
    yield ax
    plt.close(fig)


@pytest.mark.source("BK (8)")
def test_spins_are_drawn_with_a_line_for_each_component(spins):
    fig, axes = plt.subplots(1, 3)
    lines = spheres.draw_spins(axes, TIMES, spins)
    assert len(lines) == 9
    for k, name in enumerate(STARTS):
        assert axes[k].get_title() == name
        for i in range(3):
            assert np.array_equal(lines[3 * k + i].get_ydata(), spins[name][:, i])
    assert len({(line.get_color(), line.get_linestyle()) for line in lines}) == 3
    plt.close(fig)


def test_the_description_counts_flips(spins):
    said = spheres.describe_spins(spins)
    flips = np.count_nonzero(np.diff(np.sign(spins["axis 2"][:, 1])))
    assert flips >= 1
    assert f"axis 1: it stays; axis 2: it changes its sign {flips} times; axis 3: it stays" in said


@pytest.mark.source("BK (8)")
def test_momenta_lie_on_the_sphere_on_paths_of_equal_energy(space, turning):
    L = spheres.momentum_directions(MOMENTS, turning[1])
    table = spheres.momentum_table(L)
    assert np.array_equal(np.stack([table[f"{axis} [1]"] for axis in "xyz"], axis=-1), L)
    assert L.shape == (3, 481, 3)
    assert np.abs(np.linalg.norm(L, axis=-1) - 1).max() < 1e-14
    energy = (L**2 / MOMENTS).sum(axis=-1)
    assert np.abs(energy - energy[:, :1]).max() < 1e-9
    assert np.array_equal(table["path [1]"][:, 0], [0, 1, 2])
    lines = spheres.draw_momenta(space, L)
    for line, path in zip(lines, L, strict=True):
        assert np.array_equal(np.transpose(line.get_data_3d()), path)
    assert len({line.get_color() for line in lines}) == 3
    said = spheres.describe_momenta(L)
    assert "Black: the 1 that pass close to axis 2." in said
    assert "none round axis 2" in said


def test_the_book_turns_and_its_pin_with_it(space, turning):
    edges = np.array([2.0, 1, 0.5])
    turns, _ = turning
    update = spheres.moving_book(space, TIMES, turns[:, 1], edges)
    flat = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * edges / 2
    for i in (0, 40, 100, 120, 130, 160):
        artists = update(i)
        book, pin, clock = artists
        assert clock.get_text() == f"t = {TIMES[i]:.1f}"
        corners = np.unique(book.corners[:6].reshape(-1, 3).round(12), axis=0)
        assert np.abs(np.sort(corners, 0) - np.sort(flat @ turns[i, 1].T, 0)).max() < 1e-11
        foot, tip = np.transpose(pin.get_data_3d())
        assert np.abs(foot - edges[1] / 2 * turns[i, 1, :, 1]).max() < 1e-14
        assert np.abs(np.cross(tip, foot)).max() < 1e-14
        assert tip @ foot > foot @ foot


def test_the_description_of_the_book_says_when_it_turns_over():
    t = np.linspace(0, 4, 41)
    over = rb.exp_so3(np.outer(np.where(t > 1.95, np.pi, 0), [1, 0, 0]))
    upright = rb.exp_so3([np.pi / 2, 0, 0])
    said = spheres.describe_book(t, over @ upright)
    assert "It starts up, and turns over at t = 2.0." in said
    still = np.broadcast_to(upright, over.shape)
    assert "It starts up, and stays there." in spheres.describe_book(t, still)
    level = np.broadcast_to(np.eye(3), over.shape)
    assert "It starts down, and stays there." in spheres.describe_book(t, level)


@pytest.mark.source("BK (9)")
def test_a_parallel_arrow_turns_by_half_of_the_body():
    turned = np.radians([0, 90, 180])
    fig, axes = plt.subplots(1, 3)
    arrows = spheres.draw_carried(axes, turned)
    tips = np.array([arrow.get_xydata()[1] for arrow in arrows]).reshape(3, 3, 2)
    angles = np.degrees(np.arctan2(tips[..., 1], tips[..., 0])) % 360
    assert angles == pytest.approx(30 + np.outer([0, 90, 180], [0, 0.5, 1]))
    data = spheres.carried_table(turned)
    assert data["parallel x [1]"] == pytest.approx(tips[:, 1, 0])
    assert "0, 90, 180 degrees" in spheres.describe_carried(turned)
    plt.close(fig)
