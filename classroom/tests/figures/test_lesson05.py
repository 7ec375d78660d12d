"""Histograms of random rotations."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

import rbcourse as rb
from rbclassroom.figures import lesson05


@pytest.mark.source("RR 2")
def test_histograms_are_densities():
    rounded = rb.matrix_from_quaternion(
        rb.conversions.quaternion_from_zyx([[k, 0, 0] for k in range(10)])
    )
    rounded[:, 2, 2] += np.finfo(float).eps * np.arange(-5, 5)  # heights beyond 1, by rounding
    rounded[0] = np.eye(3)
    many = {"uniform": rb.sample_rotation(5000, rng=2), "e3 up": rounded}
    data = lesson05.histogram_table(lesson05.histograms(many))
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
    bins = lesson05.histograms(many)
    fig, axes = plt.subplots(1, 3)
    artists = lesson05.draw_histograms(axes, bins)
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
    said = lesson05.describe_histograms(lesson05.histograms({"up": up}))
    assert "height of the image of e₃, up: 95 %" in said
    assert "angle, up: 100 %" in said
