"""How matrices drift, and what repairs make of a letter."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

import rbcourse as rb
from rbcourse.draw import repairs

STEP = rb.exp_so3([0.01, 0.02, -0.03])


def test_a_matrix_in_single_precision_drifts_and_a_repaired_one_does_not():
    ways = {"left alone": (STEP, None), "repaired": (STEP, rb.project_so)}
    data = repairs.drift_table(2000, ways)
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
    defect = repairs.drift_table(100, {"first": (factor, None)})["first [1]"][-1]
    assert defect == pytest.approx(np.sqrt(2) * ((1 + h * h) ** 100 - 1), rel=1e-3)


def test_the_drift_is_drawn_and_described():
    ways = {"a": (STEP, None), "b": (STEP, rb.project_so), "c": (np.eye(3) + STEP / 9, None)}
    data = repairs.drift_table(200, ways)
    fig, ax = plt.subplots()
    lines = repairs.draw_drift(ax, data)
    assert [line.get_label() for line in lines] == ["a", "b", "c"]
    assert np.array_equal(lines[1].get_ydata(), data["b [1]"])
    assert f"After 200 products it is, a: {data['a [1]'][-1]:.0e}" in repairs.describe_drift(data)
    plt.close(fig)


@pytest.mark.source("BK Prop. 2", "RR 1.4")
def test_letters_are_the_images_and_mirrors_are_told_from_turns():
    matrices = {"M": np.diag([2.0, -1]), "turned": rb.project_so([[0, -2], [3, 0]])}
    data = repairs.letter_table(matrices)
    letter = np.stack([data["x [1]"], data["y [1]"]])
    assert np.array_equal([data["M x [1]"], data["M y [1]"]], matrices["M"] @ letter)
    off = np.linalg.norm(matrices["turned"] - matrices["M"])
    fig, axes = plt.subplots(1, 2)
    behind, given, under, turned = repairs.draw_letters(axes, data)
    assert np.array_equal(behind.get_xy()[: letter.shape[1]], letter.T)
    assert np.array_equal(given.get_xy()[: letter.shape[1]], (matrices["M"] @ letter).T)
    assert np.array_equal(under.get_xy(), given.get_xy())
    assert given.get_edgecolor() != turned.get_edgecolor()
    assert [ax.get_title() for ax in axes] == ["M", f"turned\ndistance {off:.2f}"]
    plt.close(fig)
    said = repairs.describe_letters(data)
    assert "M makes a mirrored and distorted one" in said
    assert f"turned: a turned letter, at the distance {off:.2f} from M" in said
