"""How matrices drift, and where repairs take their columns and shadows."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

import rbcourse as rb
from rbclassroom.figures import lesson04

STEP = rb.exp_so3([0.01, 0.02, -0.03])
M = np.random.default_rng(1).normal(size=(30, 2, 2))
M = M[np.linalg.det(M) > 0.1]
POINTS = lesson04.shadows(M)
TABLE = lesson04.shadow_table(POINTS)


def test_a_matrix_in_single_precision_drifts_and_a_repaired_one_does_not():
    ways = {"left alone": (STEP, None), "repaired": (STEP, rb.project_so)}
    data = lesson04.drift_table(2000, ways)
    counts = data["steps [1]"]
    assert counts[0] == 1
    assert counts[-1] == 2000
    assert np.all(counts[counts > 100] % 100 == 0)
    R, factor = np.eye(3, dtype=np.float32), STEP.astype(np.float32)
    for _ in range(int(counts[20])):
        R = R @ factor
    defect = np.linalg.norm(R.astype(float).T @ R.astype(float) - np.eye(3))
    assert data["left alone [1]"][20] == pytest.approx(defect, abs=3e-6)
    early = counts <= 100
    assert np.array_equal(data["left alone [1]"][early], data["repaired [1]"][early])
    assert data["left alone [1]"][-1] > 5 * data["repaired [1]"][-1]
    assert data["repaired [1]"].max() < 2e-5


def test_a_first_order_step_stretches():
    h = 0.02
    factor = np.eye(3) + rb.hat_so3([0, 0, h])
    defect = lesson04.drift_table(100, {"first": (factor, None)})["first [1]"][-1]
    assert defect == pytest.approx(np.sqrt(2) * ((1 + h * h) ** 100 - 1), rel=1e-3)


def test_the_drift_is_drawn_and_described():
    ways = {"a": (STEP, None), "b": (STEP, rb.project_so), "c": (np.eye(3) + STEP / 9, None)}
    data = lesson04.drift_table(200, ways)
    fig, ax = plt.subplots()
    lines = lesson04.draw_drift(ax, data)
    assert [line.get_label() for line in lines] == ["a", "b", "c"]
    assert np.array_equal(lines[1].get_ydata(), data["b [1]"])
    assert f"After 200 products it is, a: {data['a [1]'][-1]:.0e}" in lesson04.describe_drift(data)
    plt.close(fig)


@pytest.mark.source("BK Prop. 2", "RR 1.4")
def test_columns_are_arrows_with_what_they_miss(axes):
    over, turned = np.array([[2.0, 0.5], [0, -1]]), rb.project_so([[0, -2], [3, 0]])
    matrices = {"M": over, "turned": turned}
    data = lesson04.column_table(matrices)
    assert list(data) == ["M x [1]", "M y [1]", "turned x [1]", "turned y [1]"]
    given, behind, before, *misses = lesson04.draw_columns(axes, matrices)
    for arrows, name in ((given, "M"), (behind, "M"), (before, "turned")):
        assert np.array_equal([arrows.U, arrows.V], [data[f"{name} {axis} [1]"] for axis in "xy"])
        assert np.all(arrows.get_offsets() == 0)
    assert np.array_equal(given.get_facecolors(), before.get_facecolors())
    assert not np.array_equal(given.get_facecolors(), behind.get_facecolors())
    ends = np.array([line.get_xydata() for line in misses])
    assert np.array_equal(ends[:, 0], over.T)
    assert np.array_equal(ends[:, 1], turned.T)
    missed = np.sqrt(np.sum((ends[:, 1] - ends[:, 0]) ** 2))
    assert axes[0].get_title() == "M\nmirrors"
    assert axes[1].get_title() == f"turned\nturns, misses {missed:.2f}"
    assert np.abs(ends).max() < min(ax.get_xlim()[1] for ax in axes)
    said = lesson04.describe_columns(matrices)
    assert "then those of turned, with M's behind in grey. M mirrors." in said
    assert f"turned turns, {missed:.2f} away" in said


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
    artists = lesson04.draw_shadows(axes, POINTS)
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
    table = lesson04.frame_table(M[0], angles)
    (z,), (m,) = turn_and_mirror(M[:1])
    assert np.abs(table["nearest rotation [rad]"] - np.angle(z)).max() < 1e-14
    seen = np.exp(1j * table["Gram–Schmidt [rad]"])
    wanted = z + m * np.exp(-2j * angles)  # the mirror part turns twice as fast
    assert np.abs(seen - wanted / abs(wanted)).max() < 1e-13
    lines = lesson04.draw_frames(axes[0], table)
    for line, name in zip(lines, ["nearest rotation", "Gram–Schmidt"], strict=True):
        assert np.array_equal(line.get_ydata(), np.degrees(table[f"{name} [rad]"]))
        assert line.get_label() == name


def test_descriptions_give_numbers():
    z, m = turn_and_mirror(M)
    off = np.degrees(np.abs(np.angle((z + m) / z))).max()
    assert f"{len(M)} matrices" in lesson04.describe_shadows(POINTS)
    assert f"by up to {off:.0f} degrees" in lesson04.describe_shadows(POINTS)
    far = lesson04.frame_table(np.array([[-1, 0.3], [0.3, -1]]), np.linspace(0, 6, 50))
    assert "nearest rotation finds 180.0 degrees in every" in lesson04.describe_frames(far).replace(
        "-", ""
    )
    said = lesson04.describe_frames(lesson04.frame_table(np.diag([2.0, 1]), [0, np.pi / 4]))
    assert "nearest rotation finds 0.0 degrees in every frame" in said
    assert "Gram–Schmidt finds -18.4 to 0.0 degrees" in said
