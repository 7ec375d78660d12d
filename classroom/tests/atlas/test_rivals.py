"""Test the stored errors of the rivals of the smoothing spline, and the rivals themselves."""

import numpy as np
import pytest

import rbcourse as rb
from rbclassroom import rivals

OURS = "smoothing_spline", "with the noise", "optimum"


@pytest.mark.parametrize("kind", rivals.MOTIONS)
def test_rates_of_motions_are_derivatives(kind):
    motion = rivals.MOTIONS[kind](np.random.default_rng(3), 0.1)
    h = motion.t[1]
    assert np.linalg.norm(motion.w, axis=1).mean() == pytest.approx(0.1, rel=0.3)
    rate = rb.log_so3(motion.R[:-2].mT @ motion.R[2:]) / (2 * h)
    assert np.abs(rate - motion.w[1:-1]).max() < 2e-3
    assert np.abs((motion.w[2:] - motion.w[:-2]) / (2 * h) - motion.a[1:-1]).max() < 2e-3


def test_all_methods_find_a_motion_with_little_noise():
    """Windows of three poses change the motion itself, by much more than the noise."""
    found = rivals.errors_of_all(1, 0.2, "wander", 5)
    assert set(found) == set(rivals.stored()[1, 0.2])
    for name, numbers in found.items():
        most = 0.8 if name != "through the data" else 1.05
        assert numbers[0] < most, name
        assert numbers[0] < numbers[1] * 8 + 1


def test_smoothing_splines_are_as_good_as_all_rivals_up_to_20_degrees_a_step():
    """The acceleration is an exception at 20° and 0.2°, where a moving average is far off."""
    stored = rivals.stored()
    assert [*stored] == [(s, n) for s in rivals.STEPS for n in rivals.NOISES]
    for (step, noise), errors in stored.items():
        others = [numbers for name, numbers in errors.items() if name not in OURS]
        ratio = errors["smoothing_spline"] / np.min(others, axis=0)
        if step <= 20:
            assert ratio[:2].max() < 1.05
            assert ratio[2] < (1.13 if (step, noise) == (20, 0.2) else 1.05)
        apart = errors["smoothing_spline"] / errors["optimum"]
        if step < 20:
            assert apart.max() < 1.05
        assert errors["optimum"][0] < 1.05 * np.min(others, axis=0)[0]


def test_stored_errors_are_those_of_the_motions():
    """With this seed, the errors of one motion of each kind differ from medians of 30 by 12 %."""
    found = [rivals.errors_of_all(5, 1, kind, 0) for kind in rivals.MOTIONS]
    for name, stored in rivals.stored()[5, 1].items():
        mean = np.exp(np.mean(np.log([errors[name] for errors in found]), axis=0))
        assert stored == pytest.approx(mean, rel=0.2), name
