"""Bessel's velocities: those of parabolas, wherever the path is and however it is seen."""

import numpy as np
import oracles
import pytest

import rbcourse as rb

EPS = np.finfo(float).eps
RNG = np.random.default_rng(112)
N = 9
TIMES = -2 + np.cumsum(RNG.uniform(0.3, 1.7, N))
ROTATIONS = np.array([oracles.exp_so3(w) for w in RNG.normal(size=(N, 3))])
POSES = rb.pose_from_components(ROTATIONS, RNG.normal(size=(N, 3)))


def test_bessels_velocities_are_those_of_the_parabola_through_three():
    """Of R_i exp(x(t)), x through the logarithms of the neighbours; and of d."""
    chosen = rb.bessel_velocities(TIMES, POSES)
    for i in range(N):
        m = min(max(i, 1), N - 2)
        three = slice(m - 1, m + 2)
        t = TIMES[three] - TIMES[i]
        x = [oracles.log_so3(ROTATIONS[m].T @ R) for R in ROTATIONS[three]]
        parabola = np.polynomial.Polynomial.fit
        turn = [parabola(t, component, 2) for component in np.transpose(x)]
        here, rate = ([p(0) for p in part] for part in (turn, [p.deriv() for p in turn]))
        w = oracles.right_jacobian_so3(here) @ rate
        d_dot = [parabola(t, component, 2).deriv()(0) for component in POSES[three, :3, 3].T]
        assert np.abs(chosen[i, :3] - w).max() < 200 * EPS
        assert np.abs(chosen[i, 3:] - ROTATIONS[i].T @ d_dot).max() < 200 * EPS


def test_moved_poses_have_moved_velocities():
    """Moved in the fixed frame not at all; by another body frame as that frame sees them."""
    A = rb.pose_from_coordinates([0.4, -1, 2, 3, 1, 5])
    chosen = rb.bessel_velocities(TIMES, POSES)
    assert np.abs(rb.bessel_velocities(TIMES, A @ POSES) - chosen).max() < 200 * EPS
    turned = rb.bessel_velocities(TIMES, ROTATIONS @ A[:3, :3])
    assert np.abs(turned - chosen[:, :3] @ A[:3, :3]).max() < 200 * EPS


def test_of_two_poses_the_velocity_is_constant():
    w = rb.bessel_velocities([1, 3], ROTATIONS[:2])
    assert np.abs(w - oracles.log_so3(ROTATIONS[0].T @ ROTATIONS[1]) / 2).max() < 10 * EPS


def test_a_path_of_uniform_acceleration_has_its_own_velocities():
    """A ball that is thrown, and a turn about one axis that is sped up."""
    t = TIMES[:, None]
    turn, place = [0.3, -0.2, 0.1] * t**2 / 4, [1.0, 2, 0] * t + [0, 0, -4.9] * t**2
    poses = rb.pose_from_coordinates(np.hstack([turn, place]))
    want = np.hstack([[0.3, -0.2, 0.1] * t / 2, [1.0, 2, 0] + [0, 0, -9.8] * t])
    got = rb.bessel_velocities(TIMES, poses)
    got[:, 3:] = np.einsum("nij,nj->ni", poses[:, :3, :3], got[:, 3:])
    assert np.abs(got - want).max() < 1e-12


def test_what_is_no_path_is_refused():
    for times, poses, message in (
        ([0, 0], POSES[:2], r"^times\[1\] is 0.0, a time after 0.0 is wanted"),
        ([0, 1], ROTATIONS[:1] @ [np.eye(3), np.diag([1.0, -1, -1])], "half-turn apart"),
        ([-1.7e308, 1.7e308], POSES[:2], r"^times\[0\] and times\[1\] are inf apart"),
        ([1], POSES[:1], "^times, poses: two or more"),
    ):
        with pytest.raises(ValueError, match=message):
            rb.bessel_velocities(times, poses)
