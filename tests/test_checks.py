import re

import numpy as np
import pytest

import rbcourse as rb
from rbcourse import _checks as checks

EPS = np.finfo(float).eps


def test_nearly_symmetric_matrices_are_made_symmetric():
    given = np.array([[1, 2 + 1e-15], [2, 3]])
    assert np.array_equal(checks.as_symmetric("G", given, 2), [[1, 2 + 5e-16], [2 + 5e-16, 3]])
    nearly = checks.as_symmetric("G", [[1, 1], [1 + 9e-7, 1]], 2)
    assert np.array_equal(nearly, nearly.T)
    with pytest.raises(ValueError, match="G is not symmetric"):
        checks.as_symmetric("G", 1.5e308 * np.array([[1, 1], [-1, 1]]), 2)
    for scale in (1e-200, 1, 1e200):
        bad = scale * np.array([np.eye(2), [[1, 1.1e-6], [0, 1]]])
        with pytest.raises(ValueError, match=r"G\[1\] is not symmetric.* 1.1e-06 of"):
            checks.as_symmetric("G", bad, "n")
    assert not checks.as_symmetric("G", np.zeros((2, 2)), 2).any()


def test_inertias_and_times_in_single_precision_are_accepted():
    rng = np.random.default_rng(7)
    for R in rb.sample_rotation(50, rng=rng).astype(np.float32):
        inertia = R @ np.diag(rng.uniform(1, 2, 3).astype(np.float32)) @ R.T
        assert np.abs(rb.Body(inertia).inertia - inertia).max() < 1e-6
    for end in rng.uniform(0.1, 100, 50):
        assert checks.as_time(np.float32([0, end]), 0, (0.0, end))[1] == pytest.approx(end)
        with pytest.raises(ValueError, match="t"):
            checks.as_time(np.float32(end * (1 + 2e-6)), 0, (0.0, end))


def test_a_message_converts_dates_to_seconds():
    times = np.array(["2026-03-01T10:00:00.5", "2026-03-01T10:00:02"], "datetime64[ms]")
    with pytest.raises(ValueError, match=r"^times: .*; seconds are") as caught:
        rb.chain(times, np.stack([np.eye(3)] * 2), np.zeros((2, 3)))
    formula = str(caught.value).rpartition("seconds are ")[2]
    assert eval(formula, {"times": times, "np": np}).tolist() == [0, 1.5]


def test_times_and_angles_just_outside_an_interval_are_moved_to_its_end():
    assert checks.as_time([0, 1], 2).shape == (2, 1, 1)
    accumulated = np.cumsum(np.full(100, 0.07))  # the last time is 7.000000000000009
    assert accumulated[-1] > 7
    assert np.array_equal(checks.as_time(accumulated, 0, (0.0, 7.0)), np.minimum(accumulated, 7))
    assert checks.as_time(-1e-15, 0, (0.0, 7.0)) == 0
    assert np.array_equal(checks.as_angle([0, np.nextafter(np.pi, 4)]), [0, np.pi])
    for bad, end in ((-2e-15, 1), (1.000000000000002, 1), (7 * (1 + 10 * EPS), 7), (-1e-13, 7)):
        message = f"t[1] is {bad}, a time in [0, {end}] is wanted"
        with pytest.raises(ValueError, match=re.escape(message)):
            checks.as_time([0, bad], 0, (0.0, end))
    for bad in (-1e-300, 3.2):
        with pytest.raises(ValueError, match=re.escape(f"angle is {bad}, an angle in [0, π]")):
            checks.as_angle(bad)
