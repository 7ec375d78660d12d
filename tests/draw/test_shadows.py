"""What two repairs make of matrices in the plane is drawn where it is."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

from rbcourse.draw import shadows

M = np.random.default_rng(1).normal(size=(30, 2, 2))
M = M[np.linalg.det(M) > 0.1]
TABLE = shadows.shadow_table(M)


@pytest.fixture
def axes():
    fig, axes = plt.subplots(1, 2)
    yield axes
    plt.close(fig)


def turn_and_mirror(matrices):
    """z and m with M ζ = z ζ + m ζ*, from where M takes 1 and i."""
    one, i = matrices[:, 0, 0] + 1j * matrices[:, 1, 0], matrices[:, 0, 1] + 1j * matrices[:, 1, 1]
    return (one - 1j * i) / 2, (one + 1j * i) / 2


@pytest.mark.source("BK Prop. 2")
def test_the_nearest_rotation_lies_on_the_ray_and_gram_schmidt_on_that_of_the_first_column():
    z, m = turn_and_mirror(M)
    for name, wanted in {"M": z, "nearest rotation": z / abs(z), "Gram–Schmidt": z + m}.items():
        found = TABLE[f"{name} x [1]"] + 1j * TABLE[f"{name} y [1]"]
        if name == "Gram–Schmidt":
            wanted = wanted / abs(wanted)
        assert np.abs(found - wanted).max() < 1e-14


def test_a_line_runs_from_each_matrix_to_each_answer(axes):
    artists = shadows.draw_shadows(axes, TABLE)
    assert len(artists) == 2 * (1 + len(M))
    for k, name in enumerate(["nearest rotation", "Gram–Schmidt"]):
        dots, *lines = artists[k * (1 + len(M)) :][: 1 + len(M)]
        assert np.array_equal(dots.get_xdata(), TABLE["M x [1]"])
        assert np.array_equal([line.get_xdata()[0] for line in lines], TABLE["M x [1]"])
        assert np.array_equal([line.get_ydata()[1] for line in lines], TABLE[f"{name} y [1]"])
        assert axes[k].get_title() == name


@pytest.mark.source("BK Prop. 3")
def test_in_turned_frames_the_nearest_rotation_is_one_and_gram_schmidt_finds_others(axes):
    angles = np.linspace(0, 2 * np.pi, 25)
    table = shadows.frame_table(M[0], angles)
    (z,), (m,) = turn_and_mirror(M[:1])
    assert np.abs(table["nearest rotation [rad]"] - np.angle(z)).max() < 1e-14
    seen = np.exp(1j * table["Gram–Schmidt [rad]"])
    wanted = z + m * np.exp(-2j * angles)  # the mirror part turns twice as fast
    assert np.abs(seen - wanted / abs(wanted)).max() < 1e-13
    lines = shadows.draw_frames(axes[0], table)
    for line, name in zip(lines, ["nearest rotation", "Gram–Schmidt"], strict=True):
        assert np.array_equal(line.get_ydata(), np.degrees(table[f"{name} [rad]"]))
        assert line.get_label() == name


def test_descriptions_give_numbers():
    z, m = turn_and_mirror(M)
    off = np.degrees(np.abs(np.angle((z + m) / z))).max()
    assert f"{len(M)} matrices" in shadows.describe_shadows(TABLE)
    assert f"by up to {off:.0f} degrees" in shadows.describe_shadows(TABLE)
    far = shadows.frame_table(np.array([[-1, 0.3], [0.3, -1]]), np.linspace(0, 6, 50))
    assert "nearest rotation finds 180.0 degrees in every" in shadows.describe_frames(far).replace(
        "-", ""
    )
    said = shadows.describe_frames(shadows.frame_table(np.diag([2.0, 1]), [0, np.pi / 4]))
    assert "nearest rotation finds 0.0 degrees in every frame" in said
    assert "Gram–Schmidt finds -18.4 to 0.0 degrees" in said
